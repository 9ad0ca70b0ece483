//! A default scene for a model: ground, environment, key light, and a camera that frames it.

use super::file::{CameraPart, DisplayPart, FilmPart, MaterialPart, Named, ObjectPart, SceneFile, TransformPart};
use super::meshes::LoadedMesh;
use super::orientation::faces_away;
use super::source::UpAxis;
use super::sources::{EnvironmentSource, MeshShading, MeshSource};
use super::up_axis::guess_up;
use super::value::{ColorValue, Rgb};
use crate::mesh::Mesh;
use crate::render::Integrator;
use glam::{DVec3, Vec3};

/// Names of the parts in a saved scene.
const CLAY: &str = "clay";
const KEY_LIGHT: &str = "key light";
const GROUND: &str = "ground";

fn sky() -> EnvironmentSource {
    EnvironmentSource::Gradient {
        zenith: Rgb(Vec3::new(0.35, 0.5, 0.8)),
        horizon: Rgb(Vec3::new(0.85, 0.9, 0.95)),
        ground: Rgb(Vec3::splat(0.3)),
    }
}

fn ground_material() -> MaterialPart {
    MaterialPart::Diffuse { albedo: ColorValue::rgb(0.45, 0.45, 0.43) }
}

/// For a light of the size of the model, five radii away: about three times the irradiance of the sky.
fn key_material() -> MaterialPart {
    MaterialPart::Emissive { radiance: ColorValue::rgb(26.0, 24.0, 21.0) }
}

fn ground(material: String, (min, max): (DVec3, DVec3)) -> ObjectPart {
    let center = 0.5 * (min + max);
    ObjectPart::Plane {
        name: Some(GROUND.to_owned()),
        point: DVec3::new(center.x, min.y, center.z),
        normal: DVec3::Y,
        material,
        transform: TransformPart::default(),
    }
}

/// - `side`: signs of the direction of the front.
fn key_light(material: String, (min, max): (DVec3, DVec3), side: DVec3) -> ObjectPart {
    let center = 0.5 * (min + max);
    let radius = (0.5 * (max - min).length()).max(SceneFile::MIN_SIZE);
    ObjectPart::Sphere {
        name: Some(KEY_LIGHT.to_owned()),
        center: center + 5.0 * radius * side * DVec3::new(-0.55, 0.75, 0.6).normalize(),
        radius,
        material,
        transform: TransformPart::default(),
    }
}

/// Adds an environment and a key light to a scene.
pub fn light(file: &mut SceneFile, bounds: (DVec3, DVec3)) {
    let name = new_material(file, KEY_LIGHT, key_material());
    file.objects.push(key_light(name, bounds, DVec3::ONE));
    file.environment = sky();
}

/// Adds a ground plane below a scene.
pub fn stand_on_ground(file: &mut SceneFile, bounds: (DVec3, DVec3)) {
    let name = new_material(file, GROUND, ground_material());
    file.objects.push(ground(name, bounds));
}

/// Adds a material under a new name, which is returned.
fn new_material(file: &mut SceneFile, wanted: &str, material: MaterialPart) -> String {
    let is_taken = |name: &String| file.materials.names().any(|known| known == name);
    let names = std::iter::once(wanted.to_owned()).chain((2..).map(|number: u64| format!("{wanted} {number}")));
    let name = names.into_iter().find(|name| !is_taken(name)).unwrap_or_default();
    file.materials.0.push((name.clone(), material));
    name
}

/// The scene of a model that is opened by itself.
///
/// All sizes derive from the bounding box of the model, so that the unit of the model does not matter. The camera
/// stands in front of it, with the key light to its side.
pub fn around(loaded: &LoadedMesh, source: &MeshSource, up: Option<UpAxis>, aspect: f64) -> SceneFile {
    let up = up.unwrap_or_else(|| guess_up(&loaded.mesh));
    let (min, max) = bounds(&loaded.mesh, up);
    let transform = match up {
        UpAxis::Y => TransformPart::default(),
        UpAxis::Z => TransformPart { rotate: Some(DVec3::new(-90.0, 0.0, 0.0)), ..TransformPart::default() },
    };
    let material = |albedo| MaterialPart::Diffuse { albedo };
    let mut materials = vec![(GROUND.to_owned(), ground_material()), (KEY_LIGHT.to_owned(), key_material())];
    if loaded.slots.is_empty() {
        materials.push((CLAY.to_owned(), material(ColorValue::rgb(0.72, 0.56, 0.45))));
    }
    // Rotated half a turn about the vertical axis if the model faces the other way.
    let side = if faces_away(&loaded.mesh, up) { DVec3::new(-1.0, 1.0, -1.0) } else { DVec3::ONE };
    SceneFile {
        camera: camera(min, max, side, aspect),
        cameras: Named::default(),
        film: FilmPart::default(),
        integrator: Integrator::default(),
        max_depth: None,
        display: DisplayPart::default(),
        environment: sky(),
        air: Rgb::default(),
        textures: Named::default(),
        materials: Named(materials),
        objects: vec![
            ObjectPart::Mesh {
                name: Some("model".to_owned()),
                source: source.clone(),
                shading: MeshShading::Auto,
                simplify: None,
                material: loaded.slots.is_empty().then(|| CLAY.to_owned()),
                materials: None,
                transform,
            },
            ground(GROUND.to_owned(), (min, max)),
            key_light(KEY_LIGHT.to_owned(), (min, max), side),
        ],
        lights: Vec::new(),
        animation: Default::default(),
    }
}

/// Removes the key light: the environment lights the model alone.
pub fn remove_key_light(file: &mut SceneFile) {
    file.objects.retain(|object| !matches!(object, ObjectPart::Sphere { name: Some(name), .. } if name == KEY_LIGHT));
    file.materials.0.retain(|(name, _)| name != KEY_LIGHT);
}

/// A three-quarter view from slightly above, as close as the box allows; `side`: signs of the direction of the front.
pub fn camera(min: DVec3, max: DVec3, side: DVec3, aspect: f64) -> CameraPart {
    const VFOV_DEG: f64 = 35.0;
    /// Margin around the box.
    const MARGIN: f64 = 1.12;
    let center = 0.5 * (min + max);
    let back = side * DVec3::new(0.6, 0.38, 1.0).normalize();
    let right = DVec3::Y.cross(back).normalize();
    let up = back.cross(right);
    let tan_v = (0.5 * VFOV_DEG).to_radians().tan() / MARGIN;
    let tan_h = tan_v * aspect;
    // The least distance at which a corner is inside the image; the maximum over all corners.
    let distance = (0..8)
        .map(|i| {
            let corner = DVec3::new(
                if i & 1 == 0 { min.x } else { max.x },
                if i & 2 == 0 { min.y } else { max.y },
                if i & 4 == 0 { min.z } else { max.z },
            ) - center;
            corner.dot(back) + (corner.dot(right).abs() / tan_h).max(corner.dot(up).abs() / tan_v)
        })
        .fold(SceneFile::MIN_SIZE, f64::max);
    CameraPart { vfov: VFOV_DEG, ..CameraPart::looking_at(center + distance * back, center) }
}

/// The bounding box of the model, metres, rotated so that `up` points along +Y.
fn bounds(mesh: &Mesh, up: UpAxis) -> (DVec3, DVec3) {
    let used = mesh.triangles.iter().flatten().map(|&v| mesh.positions[v as usize].as_dvec3() + mesh.center);
    let (min, max) =
        used.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), point| (min.min(point), max.max(point)));
    match up {
        UpAxis::Y => (min, max),
        UpAxis::Z => (DVec3::new(min.x, min.z, -max.y), DVec3::new(max.x, max.z, -min.y)),
    }
}
