//! Cases for intersection: rays against closed meshes, needles, flat objects, and the surfaces that rays leave.

use crate::geometry::Ray;
use crate::kdtree::{BuildPreset, HitSpace, MeshTree, SceneTree, Shape, SphereTree};
use crate::mesh::{Mesh, procedural};
use crate::stability::random::Random;
use crate::stability::reference::ReferenceIntersector;
use crate::stability::test_scene::{Probe, RaySet, TestScene, towards};
use glam::{Affine3A, DVec3, EulerRot, Quat, Vec3, vec3};
use std::sync::Arc;

/// A test scene that is built on demand; `None` if nothing remains of it at its position.
pub struct Plan {
    pub build: Box<dyn Fn() -> Option<TestScene> + Send + Sync>,
}

/// Size of a scene, and its distance from the origin in units of that size.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceCase {
    scale: f32,
    offset: f32,
}

impl SurfaceCase {
    const HERE: Self = Self { scale: 1.0, offset: 0.0 };

    /// Sizes of 10⁻⁶ … 10⁶ at distances of 0 and 10⁰ … 10⁷.
    fn all() -> impl Iterator<Item = Self> {
        let offsets = [0.0, 1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7];
        [1e-6, 1e-3, 1.0, 1e3, 1e6].into_iter().flat_map(move |scale| offsets.map(|offset| Self { scale, offset }))
    }

    fn shift(self) -> Vec3 {
        vec3(1.0, -0.7, 0.3) * (self.scale * self.offset)
    }

    fn apply(self, p: Vec3) -> Vec3 {
        p * self.scale + self.shift()
    }

    fn name(self) -> String {
        format!("size {:e}, {:e} sizes away", self.scale, self.offset)
    }
}

/// An indexed triangle soup.
#[derive(Clone, Default)]
struct TriangleSoup {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

impl TriangleSoup {
    fn of(mesh: Mesh) -> Self {
        Self { positions: mesh.positions, triangles: mesh.triangles }
    }

    fn push(&mut self, corners: [Vec3; 3]) {
        let first = self.positions.len() as u32;
        self.positions.extend(corners);
        self.triangles.push([first, first + 1, first + 2]);
    }

    fn mapped(mut self, map: impl Fn(Vec3) -> Vec3) -> Self {
        self.positions.iter_mut().for_each(|p| *p = map(*p));
        self
    }

    fn tree(&self) -> Arc<MeshTree> {
        Arc::new(MeshTree::build(&self.positions, &self.triangles, BuildPreset::Best))
    }

    fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|v| self.positions[v as usize])
    }

    fn size(&self) -> f32 {
        let bounds = crate::geometry::Aabb::from_points(self.positions.iter().copied());
        bounds.size().max_element()
    }
}

fn test_scene(name: String, shapes: Vec<Shape>, brute_every: u64, rays: RaySet) -> TestScene {
    let scene = SceneTree::build(shapes);
    let reference = ReferenceIntersector::of(&scene);
    TestScene { name, scene, reference, rays, brute_every }
}

fn mesh_shape(tree: &Arc<MeshTree>, world_from_object: Affine3A) -> Shape {
    Shape::Mesh { tree: tree.clone(), world_from_object, space: HitSpace::Object }
}

fn static_shape(tree: &Arc<MeshTree>, world_from_object: Affine3A) -> Shape {
    Shape::Mesh { tree: tree.clone(), world_from_object, space: HitSpace::World }
}

/// Closed meshes of one to two metres.
fn closed_meshes() -> Vec<(&'static str, TriangleSoup)> {
    let dented = procedural::DisplacedSphere { frequency: 6, ..procedural::DisplacedSphere::default() };
    vec![
        ("ball", TriangleSoup::of(procedural::icosphere(6))),
        ("cube", TriangleSoup::of(procedural::cuboid(DVec3::splat(2.0)))),
        ("ring", TriangleSoup::of(procedural::torus(1.0, 0.35, 24, 12))),
        ("stone", TriangleSoup::of(procedural::displaced_sphere(&dented))),
        ("cube with slits", slit_cube()),
    ]
}

/// A cube of side 2 whose faces are cut by strips of 2 µm: needles a million times longer than wide.
fn slit_cube() -> TriangleSoup {
    let cuts = [-1.0, -0.1, -0.1 + 2e-6, 1.0f32];
    let mut soup = TriangleSoup::default();
    for (axis, level, i, j) in (0..3).flat_map(|axis| {
        [-1.0, 1.0].into_iter().flat_map(move |level| (0..9).map(move |cell| (axis, level, cell / 3, cell % 3)))
    }) {
        let corner = |u: usize, v: usize| {
            let mut p = [0.0; 3];
            (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (level, cuts[u], cuts[v]);
            Vec3::from(p)
        };
        let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
        // The front faces outwards.
        let turned = |[a, b, c]: [Vec3; 3]| if level > 0.0 { [a, b, c] } else { [a, c, b] };
        soup.push(turned([a, b, c]));
        soup.push(turned([a, c, d]));
    }
    soup
}

/// Returns points well inside a closed surface, within the bounds of its corners.
fn insides(reference: &ReferenceIntersector, soup: &TriangleSoup, seed: u64) -> Vec<Vec3> {
    let bounds = crate::geometry::Aabb::from_points(soup.positions.iter().copied());
    let mut random = Random::new(seed, 0x1251DE);
    let candidates = (0..60).map(|_| bounds.center() + 0.5 * random.point() * bounds.size());
    candidates.filter(|&p| reference.winding(p).abs() > 0.5 && reference.is_clear(p)).take(8).collect()
}

/// Rays from inside a closed mesh at its corners, its edges, its faces and in random directions.
fn rays_from_inside(soup: TriangleSoup, origins: Vec<Vec3>) -> RaySet {
    Box::new(move |random| {
        let origin = *random.pick(&origins);
        let [a, b, c] = soup.corners(random.below(soup.triangles.len()));
        let target = match random.below(8) {
            0..3 => a,
            3..6 => a.lerp(b, random.unit()),
            6 => a.lerp(b, random.unit()).lerp(c, random.unit()),
            _ => origin + random.direction(),
        };
        let ray = if random.below(2) == 0 { towards(origin, target) } else { Ray::new(origin, target - origin) };
        let ray = if ray.dir == Vec3::ZERO { Ray::new(origin, Vec3::X) } else { ray };
        Probe { ray, must_hit: true }
    })
}

/// Rays from inside closed meshes, with vertices in world space in `f32` or in the mesh's own space.
pub fn closed() -> Vec<Plan> {
    let mut plans = Vec::new();
    for place in SurfaceCase::all() {
        for (index, (shape, _)) in closed_meshes().into_iter().enumerate() {
            for placed in [false, true] {
                let kind = if placed { "instance" } else { "mesh" };
                let name = format!("{shape}, {kind}, {}", place.name());

                let build = move || {
                    let soup = closed_meshes().swap_remove(index).1;
                    // The targets of the rays are in world space in both cases.
                    let world = soup.clone().mapped(|p| place.apply(p));
                    let shape = if placed {
                        let turn = Affine3A::from_scale(Vec3::splat(place.scale));
                        mesh_shape(&soup.tree(), Affine3A::from_translation(place.shift()) * turn)
                    } else {
                        static_shape(&world.tree(), Affine3A::IDENTITY)
                    };
                    let reference = ReferenceIntersector::of(&SceneTree::build(vec![shape.clone()]));
                    let origins = insides(&reference, &world, index as u64);
                    let rays = rays_from_inside(world, origins.clone());
                    (!origins.is_empty()).then(|| test_scene(name.clone(), vec![shape], 4096, rays))
                };
                plans.push(Plan { build: Box::new(build) });
            }
        }
    }
    plans
}

/// Rays at corners, along edges and axes, from corners and from afar, with zeros of both signs, denormal and extreme
/// directions.
fn awkward_rays(soup: TriangleSoup) -> RaySet {
    let size = soup.size();
    let axes = [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z, vec3(-0.0, 1.0, -0.0), vec3(-0.0, -0.0, -1.0)];
    Box::new(move |random| {
        let (p, q) = (*random.pick(&soup.positions), *random.pick(&soup.positions));
        let [a, b, _] = soup.corners(random.below(soup.triangles.len()));
        let far = p + random.direction() * (size * 1.5);
        let axis = *random.pick(&axes);
        let mut ray = match random.below(12) {
            0 => Ray::new(p, q - p),
            1 => Ray::new(p, random.direction()),
            2 => towards(far, p),
            3 => towards(far, a.lerp(b, random.unit())),
            4 => Ray::new(p - axis * size, axis),
            5 => Ray::new(p, axis),
            6 => Ray::new(p.lerp(q, 0.5), random.direction()),
            7 => Ray::new(p + (b - a), a - b),
            8 => {
                // Almost along an axis: the other components are denormal or negligible.
                let tiny = random.point() * 10f32.powi(-44 + random.below(30) as i32);
                Ray::new(p - axis * size + 0.01 * size * random.point(), axis + tiny)
            }
            9 => {
                let ray = towards(far, a.lerp(b, random.unit()));
                Ray::new(ray.origin, ray.dir * 10f32.powi(random.below(49) as i32 - 24))
            }
            10 => towards(p + random.direction() * (size * 1e3), a.lerp(b, random.unit())),
            _ => towards(p.lerp(q, random.unit()), a.lerp(b, random.unit())),
        };
        if ray.dir.abs().max_element() < f32::MIN_POSITIVE {
            ray.dir = axis;
        }
        if random.below(4) == 0 {
            ray.t_max = random.unit() * size / ray.dir.length();
        }
        Probe { ray, must_hit: false }
    })
}

fn plans_of_soup(make: fn() -> TriangleSoup) -> Vec<Plan> {
    let plan = |place: SurfaceCase| {
        let build = move || {
            let soup = make().mapped(|p| place.apply(p));
            let shape = mesh_shape(&soup.tree(), Affine3A::IDENTITY);
            Some(test_scene(place.name(), vec![shape], 1, awkward_rays(soup)))
        };
        Plan { build: Box::new(build) }
    };
    SurfaceCase::all().map(plan).collect()
}

/// Needles a thousand to a million times longer than wide, many of them crossing.
pub fn slivers() -> Vec<Plan> {
    plans_of_soup(|| {
        let mut random = Random::new(1, 1);
        let mut soup = TriangleSoup::default();
        for _ in 0..80 {
            let (start, along) = (random.point(), random.point());
            let across = along.cross(random.direction()).normalize_or(Vec3::X) * along.length();
            let aspect = 10f32.powf(-3.0 - 3.0 * random.unit());
            soup.push([start, start + along, start + along * random.unit() + across * aspect]);
        }
        soup
    })
}

/// Triangles without area, duplicates of one triangle, and many triangles in one plane.
pub fn degenerate() -> Vec<Plan> {
    plans_of_soup(|| {
        let mut random = Random::new(2, 1);
        let mut soup = TriangleSoup::default();
        for i in 0..60 {
            let (p, q, r) = (random.point(), random.point(), random.point());
            match i % 5 {
                0 => soup.push([p, p, q]),
                1 => soup.push([p, p + q, p + 2.0 * q]),
                2 => (0..3).for_each(|_| soup.push([Vec3::X, Vec3::Y, Vec3::Z])),
                3 => soup.push([p, q, r].map(|p| vec3(p.x, 0.25, p.z))),
                _ => soup.push([p, q, r]),
            }
        }
        soup.push([Vec3::ONE; 3]);
        soup
    })
}

/// A lattice of boxes and sheets whose faces lie in split planes of the tree.
pub fn split_planes() -> Vec<Plan> {
    plans_of_soup(|| {
        let mut soup = TriangleSoup::default();
        let cube = TriangleSoup::of(procedural::cuboid(DVec3::ONE));
        for i in 0..6 {
            let corner = vec3((i % 2) as f32, (i / 2 % 2) as f32, (i / 4) as f32) * 1.0;
            (0..12).for_each(|t| soup.push(cube.corners(t).map(|p| p + corner)));
        }
        for level in [-1.0, -0.5, 0.0, 0.5] {
            for axis in 0..3 {
                let place = |u: f32, v: f32| {
                    let mut p = [0.0; 3];
                    (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (level, u, v);
                    Vec3::from(p)
                };
                soup.push([place(-1.0, -1.0), place(1.0, -1.0), place(-1.0, 1.0)]);
                soup.push([place(1.0, 1.0), place(1.0, -1.0), place(-1.0, 1.0)]);
            }
        }
        soup
    })
}

/// One of each shape at a position.
fn shapes_at(place: SurfaceCase) -> Vec<(&'static str, Shape)> {
    let (a, b, c) = (vec3(-0.7, -0.2, 0.3), vec3(0.9, 0.1, -0.4), vec3(0.2, 0.8, 0.5));
    let SurfaceCase { scale, .. } = place;
    let turn = Quat::from_euler(EulerRot::XYZ, 0.3, 1.0, -0.5);
    let turned = Affine3A::from_scale_rotation_translation(vec3(2.0, 0.5, 1.0) * scale, turn, place.shift());
    let mirrored = Affine3A::from_scale_rotation_translation(vec3(-1.0, 1.0, 1.0) * scale, turn, place.shift());
    let even = Affine3A::from_scale_rotation_translation(Vec3::splat(scale), turn, place.shift());
    let stone = TriangleSoup::of(procedural::icosphere(8)).mapped(|p| p * vec3(1.0, 0.6, 0.8));
    let placed = stone.clone().mapped(|p| place.apply(p));
    let balls = SphereTree::build(&[a, b, c], &[0.5, 0.25, 0.125]);
    vec![
        ("ball", Shape::Sphere { center: place.apply(a), radius: 0.7 * scale }),
        ("plane", Shape::Plane { point: place.apply(b), normal: vec3(0.36, 0.48, -0.8) }),
        ("quad", Shape::Quad { corner: place.apply(a), edge_u: (b - a) * scale, edge_v: (c - a) * scale }),
        (
            "floor",
            Shape::Quad {
                corner: place.apply(-Vec3::ONE),
                edge_u: Vec3::Z * 2.0 * scale,
                edge_v: Vec3::X * 2.0 * scale,
            },
        ),
        ("triangle", Shape::Triangle { vertices: [a, b, c].map(|p| place.apply(p)) }),
        ("mesh", mesh_shape(&placed.tree(), Affine3A::IDENTITY)),
        ("instance", mesh_shape(&stone.tree(), turned)),
        ("mirrored instance", mesh_shape(&stone.tree(), mirrored)),
        ("static mesh", static_shape(&stone.tree(), turned)),
        ("mirrored static mesh", static_shape(&stone.tree(), mirrored)),
        ("balls", Shape::Spheres { tree: Arc::new(balls), world_from_object: even }),
    ]
}

/// Rays that leave a surface, half of them within 10⁻¹ to 10⁻⁴ rad of it, must not hit it again.
pub fn leaving() -> Vec<Plan> {
    let plan = |(place, index): (SurfaceCase, usize)| {
        let shape = shapes_at(place).swap_remove(index);
        let name = format!("{}, {}", shape.0, place.name());

        let build = move || {
            let shape = shapes_at(place).swap_remove(index).1;
            let rays: RaySet = Box::new(move |random| {
                let target = place.apply(random.point() * 0.8);
                let distance = place.scale * 10f32.powf(2.0 * random.signed());
                let origin = target + random.direction() * distance;
                Probe { ray: towards(origin, target), must_hit: false }
            });
            Some(test_scene(name.clone(), vec![shape], 16, rays))
        };
        Plan { build: Box::new(build) }
    };
    let n = shapes_at(SurfaceCase::HERE).len();
    SurfaceCase::all().flat_map(|place| (0..n).map(move |index| (place, index))).map(plan).collect()
}

/// Tangent spheres: on a floor, on each other, and on a floor that is a sphere of 10 km; seen from all around the
/// contact.
pub fn tangent() -> Vec<Plan> {
    let kinds: [(&str, fn(SurfaceCase) -> Vec<Shape>); 4] = [
        ("sphere on a plane", |place| {
            vec![
                Shape::Plane { point: place.shift(), normal: Vec3::Y },
                Shape::Sphere { center: place.apply(Vec3::Y), radius: place.scale },
            ]
        }),
        ("sphere on a quad", |place| {
            let corner = place.apply(vec3(-3.0, 0.0, -3.0));
            vec![
                Shape::Quad { corner, edge_u: Vec3::Z * 6.0 * place.scale, edge_v: Vec3::X * 6.0 * place.scale },
                Shape::Sphere { center: place.apply(Vec3::Y), radius: place.scale },
            ]
        }),
        ("sphere on a sphere of 10 km", |place| {
            vec![
                Shape::Sphere { center: place.apply(Vec3::NEG_Y * 1e4), radius: 1e4 * place.scale },
                Shape::Sphere { center: place.apply(Vec3::Y), radius: place.scale },
            ]
        }),
        ("three spheres", |place| {
            let ball =
                |center: Vec3, radius: f32| Shape::Sphere { center: place.apply(center), radius: radius * place.scale };
            vec![ball(Vec3::Y, 1.0), ball(vec3(2.0, 1.0, 0.0), 1.0), ball(vec3(0.0, 0.5, 0.0), 0.5)]
        }),
    ];
    let plan = |(place, (kind, shapes)): (SurfaceCase, (&'static str, fn(SurfaceCase) -> Vec<Shape>))| {
        let name = format!("{kind}, {}", place.name());

        let build = move || {
            let rays: RaySet = Box::new(move |random| {
                // Ever closer to the contact at the origin.
                let near = 10f32.powf(-5.0 * random.unit());
                let target = place.apply(random.point() * vec3(near, 0.5 * near * near, near));
                let origin = place.apply(random.point() * 2.0 + vec3(0.0, 2.1, 0.0));
                Probe { ray: towards(origin, target), must_hit: false }
            });
            Some(test_scene(name.clone(), shapes(place), 1, rays))
        };
        Plan { build: Box::new(build) }
    };
    SurfaceCase::all().flat_map(|place| kinds.map(|kind| (place, kind))).map(plan).collect()
}
