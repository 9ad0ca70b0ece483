//! Meshes to trace: models from a folder, and made ones that are hard in different ways.

use glam::{Vec3, vec3};

pub struct Mesh {
    pub name: String,
    pub positions: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
    /// Where the camera stands, in units of the bounds' half size around the centre; inside for closed rooms.
    pub eye: Vec3,
}

type Maker = fn(&mut Mesh);

/// All meshes whose name contains the filter.
pub fn all(filter: &str) -> Vec<Mesh> {
    let mut meshes = Vec::new();
    if let Ok(folder) = std::env::var("FIRSTLIGHT_MODELS") {
        for name in ["teapot", "armadillo", "bunny", "horse"] {
            if name.contains(filter) {
                meshes.push(load(&folder, name));
            }
        }
    }
    let made: [(&str, Maker); 6] = [
        ("stadium", stadium),
        ("blob200k", |mesh| blob(mesh, 317, Vec3::ZERO, 1.0)),
        ("room", room),
        ("blob1m", |mesh| blob(mesh, 707, Vec3::ZERO, 1.0)),
        ("terrain1m", |mesh| terrain(mesh, 707)),
        ("slivers", slivers),
    ];
    for (name, make) in made {
        if name.contains(filter) {
            let mut mesh = empty(name);
            make(&mut mesh);
            meshes.push(mesh);
        }
    }
    meshes
}

fn empty(name: &str) -> Mesh {
    Mesh { name: name.to_string(), positions: vec![], triangles: vec![], eye: vec3(0.9, 0.7, 2.6) }
}

fn load(folder: &str, name: &str) -> Mesh {
    let path = std::path::Path::new(folder).join(format!("{name}.obj"));
    let options = tobj::LoadOptions { triangulate: true, single_index: false, ..Default::default() };
    let (models, _) = tobj::load_obj(&path, &options).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let mut mesh = empty(name);
    for model in models {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(model.mesh.positions.chunks_exact(3).map(Vec3::from_slice));
        mesh.triangles.extend(model.mesh.indices.chunks_exact(3).map(|t| [t[0] + first, t[1] + first, t[2] + first]));
    }
    mesh
}

/// `n` rows of `n` squares over `point(u, v)` with u, v in 0..=1.
fn grid(mesh: &mut Mesh, n: u32, point: impl Fn(f32, f32) -> Vec3) {
    let first = mesh.positions.len() as u32;
    for i in 0..=n {
        for j in 0..=n {
            mesh.positions.push(point(i as f32 / n as f32, j as f32 / n as f32));
        }
    }
    for i in 0..n {
        for j in 0..n {
            let a = first + i * (n + 1) + j;
            mesh.triangles.extend([[a, a + 1, a + n + 1], [a + 1, a + n + 2, a + n + 1]]);
        }
    }
}

/// A sphere with bumps of several sizes.
fn blob(mesh: &mut Mesh, n: u32, center: Vec3, radius: f32) {
    grid(mesh, n, |u, v| {
        let (theta, phi) = (u * std::f32::consts::PI, v * std::f32::consts::TAU);
        let d = vec3(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
        let bumps = |f: f32| (f * d.x).sin() * (f * d.y + 1.0).sin() * (f * d.z + 2.0).sin();
        center + radius * d * (1.0 + 0.2 * bumps(5.0) + 0.06 * bumps(17.0) + 0.02 * bumps(61.0))
    });
}

fn terrain(mesh: &mut Mesh, n: u32) {
    grid(mesh, n, |u, v| {
        let (x, z) = (2.0 * u - 1.0, 2.0 * v - 1.0);
        let wave = |f: f32| (f * x + 0.3 * f * z).sin() * (f * z - 0.2 * f * x).cos();
        vec3(x, 0.12 * wave(4.0) + 0.05 * wave(11.0) + 0.02 * wave(31.0) + 0.006 * wave(97.0), z)
    });
    mesh.eye = vec3(0.5, 12.0, 1.6);
}

/// A dense blob in a huge, sparse bowl.
fn stadium(mesh: &mut Mesh) {
    blob(mesh, 226, Vec3::ZERO, 0.02);
    grid(mesh, 75, |u, v| {
        let (r, phi) = (1.0 + 29.0 * u, v * std::f32::consts::TAU);
        vec3(r * phi.cos(), -0.03 + 0.01 * r * r, r * phi.sin())
    });
    // Close to the blob, or it would be a few pixels.
    mesh.eye = vec3(0.002, -0.98, 0.003);
}

/// A closed room with columns and blobs: every ray hits something.
fn room(mesh: &mut Mesh) {
    let corner = vec3(-4.0, 0.0, -4.0);
    let (x, y, z) = (Vec3::X * 8.0, Vec3::Y * 4.0, Vec3::Z * 8.0);
    for (o, a, b) in
        [(corner, x, z), (corner + y, x, z), (corner, x, y), (corner + z, x, y), (corner, y, z), (corner + x, y, z)]
    {
        grid(mesh, 40, |u, v| o + u * a + v * b);
    }
    for (i, j) in (0..4).flat_map(|i| (0..4).map(move |j| (i, j))) {
        let at = vec3(i as f32 * 2.0 - 3.0, 0.0, j as f32 * 2.0 - 3.0);
        grid(mesh, 40, |u, v| {
            let phi = u * std::f32::consts::TAU;
            let r = 0.18 + 0.02 * (12.0 * phi).cos();
            at + vec3(r * phi.cos(), 4.0 * v, r * phi.sin())
        });
    }
    for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
        blob(mesh, 95, vec3(i as f32 * 2.0 - 2.0, 0.6, j as f32 * 2.0 - 2.0), 0.45);
    }
    mesh.eye = vec3(0.85, -0.1, 0.9);
}

/// A hundred thousand long, thin triangles.
fn slivers(mesh: &mut Mesh) {
    let mut state = 7u32;
    let mut random = move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 23) as f32 - 1.0
    };
    for _ in 0..100_000 {
        let mut point = || vec3(random(), random(), random());
        let (a, along, aside) = (point(), point() * 0.5, point() * 0.002);
        let first = mesh.positions.len() as u32;
        mesh.positions.extend([a, a + along, a + along + aside]);
        mesh.triangles.push([first, first + 1, first + 2]);
    }
}
