//! The transparent bodies of a scene, smallest last, and which of them contain a point.
//!
//! A surface that is closed bounds a body. One that is open, such as the surface of water that ends at the walls of its
//! basin, is an interface: what is behind it is the medium, wherever the path has been before. Which it is follows from
//! the sum of the area vectors of its faces, which is zero for every closed surface; see [`LARGEST_HOLE`].
//!
//! A sphere is a separate body, alone or in a group; so are all triangles of one mesh with the same material. Quads,
//! triangles and planes of one material form one body together: a box may be made of them. Each body has as many rows
//! as its material has transparent parts: a blend of two glasses is, for each path, a body of the glass through which
//! the path entered.

use crate::core::material::{Material, MaterialId};
use crate::core::snapshot::Geometry;
use firstlight_kdtree::geometry::Ray;
use firstlight_kdtree::geometry::robust::offset_ray_origin;
use firstlight_kdtree::{Hit, SceneTree, Shape};
use glam::{DVec3, Vec3};
use rustc_hash::FxHashMap;
use std::f64::consts::PI;
use std::sync::Arc;

/// See the [module](self).
#[derive(Debug, Default)]
pub(crate) struct Bodies {
    rows: Vec<BodyRow>,
    /// Bodies of each object.
    of_object: Vec<BodySurface>,
    deepest: u32,
    /// What the triangles of a mesh with one of its transparent materials enclose, by object and material.
    meshes: FxHashMap<(u32, MaterialId), Enclosed>,
}

/// The bodies of another scene, which may have some of the same objects at the same indices.
pub(crate) struct BodiesBefore<'a> {
    pub geometry: &'a Geometry,
    pub bodies: &'a Bodies,
}

impl BodiesBefore<'_> {
    /// Returns what a part of a mesh encloses, if it is known and the object is the same in both scenes.
    fn enclosed(&self, geometry: &Geometry, object: u32, material: MaterialId) -> Option<Enclosed> {
        let known = self.bodies.meshes.get(&(object, material))?;
        let i = object as usize;
        let (now, then) = (&geometry.objects[i], &self.geometry.objects[i]);
        let has_same_mesh = now.mesh.as_ref().zip(then.mesh.as_ref()).is_some_and(|(a, b)| Arc::ptr_eq(a, b));
        let is_same = has_same_mesh && now.materials == then.materials;
        (is_same && geometry.tree.shapes()[i].is_same(&self.geometry.tree.shapes()[i])).then_some(*known)
    }
}

/// One transparent part of one body.
#[derive(Clone, Copy, Debug)]
struct BodyRow {
    ior: f32,
    dispersion: f32,
    absorption: Vec3,
    /// Number of rows of the body.
    n_leaves: u32,
    /// Whether its surface is open.
    is_open: bool,
}

/// The bodies to which the surface of an object belongs, by their first rows.
#[derive(Clone, Debug, Default)]
enum BodySurface {
    #[default]
    Opaque,
    /// One body for the whole object.
    One(u32),
    /// One body per primitive.
    Cloud(Vec<u32>),
    /// One body per transparent material.
    Parts(Vec<(MaterialId, u32)>),
}

/// The surface of a body, hit from one side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Boundary {
    /// First row of the body.
    pub body: u32,
    /// Whether it was hit from outside.
    pub front: bool,
}

/// A body without rows so far.
struct BodyCandidate {
    material: MaterialId,
    enclosed: Enclosed,
    of: BodyPart,
}

/// What the surface of a body encloses.
#[derive(Clone, Copy, Debug)]
struct Enclosed {
    /// Volume in cubic metres; infinite for a half-space.
    volume: f64,
    /// Area of its faces, and the sum of their area vectors, square metres; zero for spheres and planes.
    area: f64,
    area_vector: DVec3,
    low: DVec3,
    high: DVec3,
}

/// Area of the holes of a surface, as far as they face one way, over that of its faces, above which it counts as open:
/// a cracked mesh is still a body, and a bowl without thickness is not.
const LARGEST_HOLE: f64 = 0.1;

enum BodyPart {
    Object(u32),
    Primitive(u32, u32),
    Slot(u32),
    /// All quads, triangles and planes of a material.
    Faces(Vec<u32>),
}

/// Number of largest bodies among which the deepest nesting is determined: nested bodies lie within large ones.
const N_LARGEST: usize = 256;

/// Maximum number of hits that are followed to test whether a point is inside of a body.
const MOST_HITS: usize = 4096;

impl Bodies {
    /// - `before`: what is the same there is not computed again.
    pub fn build(geometry: &Geometry, materials: &[Material], before: Option<BodiesBefore>) -> Self {
        let n_leaves: Vec<u32> = (0..materials.len() as u32).map(|id| leaves_of(materials, id).len() as u32).collect();
        let mut of_object = vec![BodySurface::Opaque; geometry.objects.len()];
        if n_leaves.iter().all(|&n| n == 0) {
            return Self { of_object, ..Self::default() };
        }
        let mut candidates = candidates(geometry, &n_leaves, before.as_ref());
        let of_mesh = |body: &BodyCandidate| match body.of {
            BodyPart::Slot(object) => Some(((object, body.material), body.enclosed)),
            _ => None,
        };
        let meshes = candidates.iter().filter_map(of_mesh).collect();
        // Of equally large bodies the later one counts, as if it had been entered last.
        candidates.sort_by(|a, b| b.enclosed.size().total_cmp(&a.enclosed.size()));
        let mut rows = Vec::new();
        for candidate in &candidates {
            let (BodyCandidate { material, enclosed, of }, first) = (candidate, rows.len() as u32);
            let is_open = enclosed.is_open();
            let leaves = leaves_of(materials, *material);
            let n_leaves = leaves.len() as u32;
            rows.extend(leaves.into_iter().map(|leaf| BodyRow { n_leaves, is_open, ..leaf }));
            match of {
                BodyPart::Object(object) => of_object[*object as usize] = BodySurface::One(first),
                BodyPart::Faces(objects) => {
                    objects.iter().for_each(|&object| of_object[object as usize] = BodySurface::One(first));
                }
                BodyPart::Primitive(object, prim) => {
                    let surface = &mut of_object[*object as usize];
                    if !matches!(surface, BodySurface::Cloud(_)) {
                        let Shape::Spheres { tree, .. } = &geometry.tree.shapes()[*object as usize] else { continue };
                        *surface = BodySurface::Cloud(vec![0; tree.len()]);
                    }
                    if let BodySurface::Cloud(bodies) = surface {
                        bodies[*prim as usize] = first;
                    }
                }
                BodyPart::Slot(object) => match &mut of_object[*object as usize] {
                    BodySurface::Parts(parts) => parts.push((*material, first)),
                    surface => *surface = BodySurface::Parts(vec![(*material, first)]),
                },
            }
        }
        let deepest = deepest(&candidates);
        Self { rows, of_object, deepest, meshes }
    }

    /// Maximum nesting of bodies, judged by their bounding boxes.
    pub fn deepest(&self) -> u32 {
        self.deepest
    }

    /// Whether some surface of an object belongs to a body.
    pub fn is_transparent(&self, object: u32) -> bool {
        !matches!(self.of_object[object as usize], BodySurface::Opaque)
    }

    /// Returns the boundary of a hit.
    ///
    /// - `material`: of the hit, transparent or a blend with a transparent part.
    #[inline]
    pub fn boundary(&self, object: u32, prim: u32, material: MaterialId, front: bool) -> Boundary {
        let body = match &self.of_object[object as usize] {
            BodySurface::One(body) => *body,
            BodySurface::Cloud(bodies) => bodies[prim as usize],
            BodySurface::Parts(parts) => parts.iter().find(|(id, _)| *id == material).map_or(0, |(_, body)| *body),
            BodySurface::Opaque => 0,
        };
        Boundary { body, front }
    }

    /// Indices of refraction of a body that was entered through one transparent part of its material: that of all
    /// light, and those of red, green and blue.
    pub fn iors(&self, row: u32) -> [f32; 4] {
        let BodyRow { ior, dispersion, .. } = self.rows[row as usize];
        let [red, green, blue] = Material::iors(ior, dispersion);
        [ior, red, green, blue]
    }

    /// Absorption per metre.
    pub fn absorption(&self, row: u32) -> Vec3 {
        self.rows[row as usize].absorption
    }

    /// Whether one transparent part of a body disperses light.
    pub fn disperses_in(&self, row: u32) -> bool {
        self.rows[row as usize].dispersion > 0.0
    }

    /// Whether a transparent part of a body disperses light.
    pub fn disperses(&self, body: u32) -> bool {
        let n = self.n_leaves(body) as usize;
        self.rows[body as usize..][..n].iter().any(|row| row.dispersion > 0.0)
    }

    /// n² of the medium where these bodies overlap.
    pub fn environment_scale(&self, rows: &[u32]) -> f32 {
        rows.last().map_or(1.0, |&row| self.rows[row as usize].ior.powi(2))
    }

    /// Whether the surface of a body is open, by any of its rows.
    #[inline]
    pub fn is_open(&self, row: u32) -> bool {
        self.rows[row as usize].is_open
    }

    pub fn n_leaves(&self, body: u32) -> u32 {
        self.rows[body as usize].n_leaves
    }

    /// Returns the rows of the bodies that contain a point, ascending; a body with winding number two is listed twice.
    /// For a body with several transparent parts, the first row.
    ///
    /// The cost is one test per transparent object, and rays through those whose bounding box contains the point.
    pub fn around(&self, geometry: &Geometry, point: Vec3) -> Vec<u32> {
        let mut rows = Vec::new();
        let mut open: Vec<(u32, Vec<Shape>)> = Vec::new();
        for (object, surface) in self.of_object.iter().enumerate() {
            let shape = &geometry.tree.shapes()[object];
            match (surface, shape) {
                (BodySurface::Opaque, _) => {}
                (BodySurface::One(body), Shape::Sphere { center, radius }) => {
                    let inside = is_inside(point.as_dvec3(), center.as_dvec3(), f64::from(*radius));
                    rows.extend(inside.then_some(*body));
                }
                (BodySurface::Cloud(bodies), Shape::Spheres { tree, world_from_object }) => {
                    let local = world_from_object.inverse().transform_point3(point).as_dvec3();
                    rows.extend((0..tree.len() as u32).filter_map(|prim| {
                        let (center, radius) = tree.sphere(prim);
                        is_inside(local, center.as_dvec3(), f64::from(radius)).then_some(bodies[prim as usize])
                    }));
                }
                (BodySurface::Parts(parts), Shape::Mesh { tree, world_from_object, .. }) => {
                    let local = world_from_object.inverse().transform_point3(point);
                    let bounds = tree.bounds();
                    if local.cmplt(bounds.min).any() || local.cmpgt(bounds.max).any() {
                        continue;
                    }
                    let alone = SceneTree::build_with(vec![shape.clone()], &geometry.tree.statics());
                    for (material, body) in parts {
                        let counts = |hit: &Hit| geometry.objects[object].material_of(hit.prim) == *material;
                        let winding = winding(&alone, point, &counts);
                        rows.extend((0..winding).map(|_| *body));
                    }
                }
                (BodySurface::One(body), _) => match open.iter_mut().find(|(other, _)| other == body) {
                    Some((_, shapes)) => shapes.push(shape.clone()),
                    None => open.push((*body, vec![shape.clone()])),
                },
                _ => {}
            }
        }
        for (body, shapes) in open {
            let alone = SceneTree::build_with(shapes, &geometry.tree.statics());
            let winding = winding(&alone, point, &|_| true);
            rows.extend((0..winding).map(|_| body));
        }
        rows.sort_unstable();
        // Open surfaces bound one medium at a time.
        let mut has_open = false;
        rows.retain(|&row| !self.is_open(row) || !std::mem::replace(&mut has_open, true));
        rows
    }
}

fn is_inside(point: DVec3, center: DVec3, radius: f64) -> bool {
    point.distance_squared(center) < radius * radius
}

/// Returns the winding number of closed surfaces around a point: back hits minus front hits of a ray to infinity, as
/// the median of three rays, because a ray may pass along an edge or through a hole.
fn winding(tree: &SceneTree, point: Vec3, counts: &dyn Fn(&Hit) -> bool) -> i32 {
    let directions =
        [Vec3::new(0.482, 0.617, 0.622), Vec3::new(-0.731, 0.289, -0.618), Vec3::new(0.171, -0.842, 0.512)];
    let mut windings = directions.map(|dir| {
        let (mut ray, mut winding) = (Ray::new(point, dir.normalize()), 0);
        for _ in 0..MOST_HITS {
            let Some(hit) = tree.closest_hit(&ray) else { break };
            let found = tree.surface_point(&ray, &hit);
            if counts(&hit) {
                winding += if ray.dir.dot(found.geometric_normal) > 0.0 { 1 } else { -1 };
            }
            let origin = offset_ray_origin(found.position, found.error, found.geometric_normal, ray.dir);
            ray = Ray::new(origin, ray.dir);
        }
        winding
    });
    windings.sort_unstable();
    windings[1].max(0)
}

/// The rows of a body of this material, in the order of shading.
fn leaves_of(materials: &[Material], id: MaterialId) -> Vec<BodyRow> {
    let material = &materials[id as usize];
    let row = |ior: f32, dispersion: f32, absorption: Vec3| {
        vec![BodyRow { ior, dispersion, absorption, n_leaves: 1, is_open: false }]
    };
    match material {
        Material::Blend { a, b, .. } => [leaves_of(materials, *a), leaves_of(materials, *b)].concat(),
        material if !material.is_clear() => Vec::new(),
        Material::Glass { ior, absorption, dispersion }
        | Material::RoughGlass { ior, absorption, dispersion, .. }
        | Material::Principled { ior, absorption, dispersion, .. } => row(*ior, *dispersion, *absorption),
        Material::Phong { ior, absorption, .. } => row(*ior, 0.0, *absorption),
        Material::Disney { ior, .. } => row(*ior, 0.0, Vec3::ZERO),
        _ => Vec::new(),
    }
}

/// All bodies, in the order of objects and primitives.
fn candidates(geometry: &Geometry, n_leaves: &[u32], before: Option<&BodiesBefore>) -> Vec<BodyCandidate> {
    let mut bodies = Vec::new();
    let mut faces: Vec<BodyCandidate> = Vec::new();
    for (i, (object, shape)) in (0..).zip(geometry.objects.iter().zip(geometry.tree.shapes())) {
        let is_clear = |id: MaterialId| n_leaves[id as usize] > 0;
        if !object.materials.iter().any(|&id| is_clear(id)) {
            continue;
        }
        let of_sphere = |material, center: DVec3, radius: f64, of| BodyCandidate {
            material,
            enclosed: Enclosed {
                volume: 4.0 / 3.0 * PI * radius.powi(3),
                low: center - radius,
                high: center + radius,
                ..Enclosed::NOTHING
            },
            of,
        };
        let material = object.materials[0];
        match shape {
            Shape::Sphere { center, radius } => {
                bodies.push(of_sphere(material, center.as_dvec3(), f64::from(*radius), BodyPart::Object(i)));
            }
            Shape::Spheres { tree, world_from_object } => {
                let map = world_from_object.matrix3.as_dmat3();
                let scale = map.determinant().abs().cbrt();
                bodies.extend((0..tree.len() as u32).map(|prim| {
                    let (center, radius) = tree.sphere(prim);
                    let center = map * center.as_dvec3() + Vec3::from(world_from_object.translation).as_dvec3();
                    of_sphere(material, center, f64::from(radius) * scale, BodyPart::Primitive(i, prim))
                }));
            }
            Shape::Mesh { tree, world_from_object, .. } => {
                let map = world_from_object.matrix3.as_dmat3();
                let offset = Vec3::from(world_from_object.translation).as_dvec3();
                let mut distinct = object.materials.clone();
                distinct.sort_unstable();
                distinct.dedup();
                bodies.extend(distinct.into_iter().filter(|&id| is_clear(id)).map(|material| {
                    let measure = || {
                        let mut enclosed = Enclosed::NOTHING;
                        for prim in (0..tree.n_triangles() as u32).filter(|&prim| object.material_of(prim) == material)
                        {
                            enclosed.add(tree.vertices(prim).map(|p| map * p.as_dvec3() + offset));
                        }
                        enclosed
                    };
                    let known = before.and_then(|before| before.enclosed(geometry, i, material));
                    BodyCandidate { material, enclosed: known.unwrap_or_else(measure), of: BodyPart::Slot(i) }
                }));
            }
            Shape::Plane { .. } | Shape::Quad { .. } | Shape::Triangle { .. } => {
                let at = faces.iter().position(|body| body.material == material).unwrap_or_else(|| {
                    let of = BodyPart::Faces(Vec::new());
                    faces.push(BodyCandidate { material, enclosed: Enclosed::NOTHING, of });
                    faces.len() - 1
                });
                let BodyCandidate { enclosed, of, .. } = &mut faces[at];
                if let BodyPart::Faces(objects) = of {
                    objects.push(i);
                }
                match shape {
                    Shape::Triangle { vertices } => enclosed.add(vertices.map(|p| p.as_dvec3())),
                    Shape::Quad { corner, edge_u, edge_v } => {
                        let [a, u, v] = [corner, edge_u, edge_v].map(|p| p.as_dvec3());
                        enclosed.add([a, a + u, a + u + v]);
                        enclosed.add([a, a + u + v, a + v]);
                    }
                    _ => {
                        (enclosed.volume, enclosed.area) = (f64::INFINITY, f64::INFINITY);
                        (enclosed.low, enclosed.high) = (DVec3::NEG_INFINITY, DVec3::INFINITY);
                    }
                }
            }
        }
    }
    bodies.extend(faces);
    bodies
}

impl Enclosed {
    const NOTHING: Self =
        Self { volume: 0.0, area: 0.0, area_vector: DVec3::ZERO, low: DVec3::INFINITY, high: DVec3::NEG_INFINITY };

    /// Volume in cubic metres; what has no volume contains everything else.
    fn size(&self) -> f64 {
        if self.is_open() { f64::INFINITY } else { self.volume.abs() }
    }

    fn is_open(&self) -> bool {
        self.area_vector.length() > LARGEST_HOLE * self.area
    }

    /// Adds a triangle of the surface: by the divergence theorem they sum up to the enclosed volume.
    fn add(&mut self, [a, b, c]: [DVec3; 3]) {
        self.volume += a.dot(b.cross(c)) / 6.0;
        let area_vector = 0.5 * (b - a).cross(c - a);
        self.area += area_vector.length();
        self.area_vector += area_vector;
        self.low = self.low.min(a).min(b).min(c);
        self.high = self.high.max(a).max(b).max(c);
    }
}

fn deepest(bodies: &[BodyCandidate]) -> u32 {
    let holds = |a: &Enclosed, b: &Enclosed| a.low.cmple(b.low).all() && b.high.cmple(a.high).all();
    let largest = &bodies[..bodies.len().min(N_LARGEST)];
    let depth = |b: &BodyCandidate| {
        let holds_it = |a: &&BodyCandidate| !std::ptr::eq(*a, b) && holds(&a.enclosed, &b.enclosed);
        largest.iter().filter(holds_it).count() as u32 + 1
    };
    bodies.iter().map(depth).max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::material::MaterialKind;
    use crate::core::snapshot::Object;
    use firstlight_kdtree::{BuildPreset, HitSpace, MeshTree};
    use firstlight_mesh::{Mesh, procedural};
    use glam::Affine3A;

    /// Boxes in a row, with the materials of their parts.
    fn boxes(mesh: &Arc<Mesh>, tree: &Arc<MeshTree>, placed: &[(f32, &[MaterialId])]) -> Geometry {
        let shape = |&(x, _): &(f32, &[MaterialId])| Shape::Mesh {
            tree: tree.clone(),
            world_from_object: Affine3A::from_translation(Vec3::new(x, 0.0, 0.0)),
            space: HitSpace::Object,
        };
        let object = |&(_, materials): &(f32, &[MaterialId])| Object {
            mesh: Some(mesh.clone()),
            materials: materials.to_vec(),
            ..Object::default()
        };
        Geometry::build(placed.iter().map(shape).collect(), placed.iter().map(object).collect())
    }

    #[test]
    fn bodies_after_changes_are_those_of_a_new_scene() {
        let materials = [MaterialKind::Glass, MaterialKind::Glass, MaterialKind::Diffuse]
            .map(|kind| Material::of_kind(kind, Vec3::ONE.into()).expect("no blend"));
        let mut mesh = procedural::cuboid(DVec3::ONE).flat();
        mesh.slots = (0..mesh.triangles.len()).map(|i| (i % 2) as u16).collect();
        let tree = Arc::new(MeshTree::build(&mesh.positions, &mesh.triangles, BuildPreset::Quick));
        let mesh = Arc::new(mesh);
        let before = boxes(&mesh, &tree, &[(0.0, &[0]), (2.0, &[0, 2]), (4.0, &[0]), (6.0, &[2])]);
        let bodies = Bodies::build(&before, &materials, None);
        // The first stays, the second has other parts, the third has moved, the fourth becomes glass.
        let after = boxes(&mesh, &tree, &[(0.0, &[0]), (2.0, &[2, 0]), (5.0, &[0]), (6.0, &[1])]);
        let known = || BodiesBefore { geometry: &before, bodies: &bodies };
        let is_known = |i| known().enclosed(&after, i, 0).is_some();
        assert_eq!([0, 1, 2, 3].map(is_known), [true, false, false, false]);
        let changed = Bodies::build(&after, &materials, Some(known()));
        assert_eq!(format!("{changed:?}"), format!("{:?}", Bodies::build(&after, &materials, None)));
    }
}
