//! Surfaces of transparent bodies that coincide with other surfaces: shared walls, glass that stands on a floor.
//!
//! A path that has passed a surface starts behind it, by the error bound of its position. It skips everything closer
//! than that, so coincident surfaces are handled at one vertex:
//!
//! - if one of them is opaque, that one is hit, from both sides;
//! - otherwise the path passes them all, entering bodies before leaving others, like a single wall between the media
//!   before and behind them ([`crate::shading::medium::MediumSets::interface`]).
//!
//! The objects that may have such points are determined when the scene is prepared: two faces in one plane, or two
//! equal spheres. Scenes without any have no cost.

use crate::core::material::Material;
use crate::core::snapshot::Geometry;
use crate::prepare::bodies::{Bodies, Boundary};
use firstlight_kdtree::geometry::robust::{UNIT_ROUNDOFF, offset_ray_origin};
use firstlight_kdtree::geometry::{Ray, quad_corners};
use firstlight_kdtree::{Hit, HitBatch, RayBatch, SceneTree, Shape, SurfacePoint};
use glam::{DVec3, Vec3};
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// See the [module](self).
#[derive(Debug, Default)]
pub(crate) struct Contacts {
    /// Per object; empty if there are none.
    of_object: Vec<Vec<Other>>,
}

/// The scene data for coincident surfaces.
pub(crate) struct ContactScene<'a> {
    pub geometry: &'a Geometry,
    pub materials: &'a [Material],
    pub bodies: &'a Bodies,
}

/// An object whose surface may coincide with that of a transparent one.
#[derive(Clone, Debug)]
struct Other {
    object: u32,
    /// A tree of this object only.
    alone: Arc<SceneTree>,
}

/// Precedence of coincident surfaces: the greatest is hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum ContactKind {
    Glass,
    /// Takes precedence over smooth glass: one rough wall scatters light that passes both.
    RoughGlass,
    /// A blend with transparent parts.
    PartlyClear,
    Opaque,
}

impl Contacts {
    pub fn build(geometry: &Geometry, materials: &[Material]) -> Self {
        let is_clear: Vec<bool> = materials.iter().map(|material| material.has_clear_part(materials)).collect();
        let pairs = touching(geometry, &is_clear);
        if pairs.is_empty() {
            return Self::default();
        }
        let shapes = geometry.tree.shapes();
        let statics = geometry.tree.statics();
        let mut alone: FxHashMap<u32, Arc<SceneTree>> = FxHashMap::default();
        let mut of_object = vec![Vec::new(); shapes.len()];
        for (clear, other) in pairs {
            let tree = alone.entry(other);
            let only = || vec![shapes[other as usize].clone()];
            let tree = tree.or_insert_with(|| Arc::new(SceneTree::build_with(only(), &statics)));
            of_object[clear as usize].push(Other { object: other, alone: tree.clone() });
        }
        Self { of_object }
    }

    /// Replaces each hit by the coincident surface that takes precedence: an opaque one, or the first of several
    /// transparent ones.
    pub fn settle(&self, touched: &ContactScene, rays: &RayBatch, hits: &mut HitBatch) {
        if self.of_object.is_empty() {
            return;
        }
        for i in 0..rays.len() {
            let Some(hit) = hits.get(i) else { continue };
            if !self.of_object[hit.object as usize].is_empty() {
                let Hit { t, u, v, prim, object } = self.met(touched, &rays.get(i), &hit);
                (hits.t[i], hits.u[i], hits.v[i], hits.prim[i], hits.object[i]) = (t, u, v, prim, object);
            }
        }
    }

    fn met(&self, touched: &ContactScene, ray: &Ray, hit: &Hit) -> Hit {
        let rank = |hit: &Hit| (kind_of(touched, hit), size_rank(touched, hit.object), std::cmp::Reverse(hit.object));
        let (mut met, mut greatest) = (*hit, rank(hit));
        if greatest.0 == ContactKind::Opaque {
            return met;
        }
        self.in_place_of(touched, ray, hit, |other, _| {
            let rank = rank(&other);
            if rank > greatest {
                (met, greatest) = (other, rank);
            }
        });
        met
    }

    /// Returns the boundaries of glass that coincide with that of a hit, which comes from [`Self::settle`].
    #[inline]
    pub fn along_with(&self, touched: &ContactScene, hit: &Hit, ray: impl FnOnce() -> Ray) -> Vec<Boundary> {
        let mut found = Vec::new();
        if !self.of_object.is_empty() && !self.of_object[hit.object as usize].is_empty() {
            let ray = ray();
            self.in_place_of(touched, &ray, hit, |other, at| {
                if matches!(kind_of(touched, &other), ContactKind::Glass | ContactKind::RoughGlass) {
                    let front = ray.dir.dot(at.geometric_normal) <= 0.0;
                    found.push(touched.bodies.boundary(
                        other.object,
                        other.prim,
                        touched.geometry.material_of(&other),
                        front,
                    ));
                }
            });
        }
        found
    }

    /// Calls `f` with each other hit that a path through this one would skip.
    fn in_place_of(&self, touched: &ContactScene, ray: &Ray, hit: &Hit, mut f: impl FnMut(Hit, &SurfacePoint)) {
        let own = touched.geometry.tree.surface_point(ray, hit);
        let onwards =
            if own.geometric_normal.dot(ray.dir) < 0.0 { -own.geometric_normal } else { own.geometric_normal };
        let [near, far] =
            [-onwards, onwards].map(|to| offset_ray_origin(own.position, own.error, own.geometric_normal, to));
        for Other { object, alone } in &self.of_object[hit.object as usize] {
            let Some(found) = alone.closest_hit(ray) else { continue };
            let at = alone.surface_point(ray, &found);
            if (at.position - near).dot(onwards) >= 0.0 && (far - at.position).dot(onwards) >= 0.0 {
                f(Hit { object: *object, ..found }, &at);
            }
        }
    }
}

fn kind_of(touched: &ContactScene, hit: &Hit) -> ContactKind {
    match &touched.materials[touched.geometry.material_of(hit) as usize] {
        Material::Glass { .. } => ContactKind::Glass,
        Material::RoughGlass { .. } => ContactKind::RoughGlass,
        Material::Blend { .. } | Material::Phong { .. } | Material::Principled { .. }
            if touched.bodies.is_transparent(hit.object) =>
        {
            ContactKind::PartlyClear
        }
        _ => ContactKind::Opaque,
    }
}

/// Rank among equal surfaces: the one with the largest errors is hit, so that a path that starts behind it is behind
/// the others too. It does not depend on the side from which a path comes.
fn size_rank(touched: &ContactScene, object: u32) -> u32 {
    match &touched.geometry.tree.shapes()[object as usize] {
        Shape::Mesh { tree, world_from_object, .. } => {
            let bounds = tree.bounds();
            let offset = Vec3::from(world_from_object.translation).abs().max_element();
            let scale = world_from_object.matrix3.to_cols_array().iter().fold(0.0, |most: f32, x| most.max(x.abs()));
            // Positive numbers are ordered like their bits.
            (offset + scale * bounds.min.abs().max(bounds.max.abs()).max_element()).max(f32::MIN_POSITIVE).to_bits()
        }
        _ => 0,
    }
}

/// A face in world space.
struct Face {
    object: u32,
    vertices: [DVec3; 3],
    /// Unit normal.
    normal: DVec3,
    offset: f64,
}

impl Face {
    fn new(object: u32, vertices: [DVec3; 3]) -> Option<Self> {
        let [a, b, c] = vertices;
        let normal = (b - a).cross(c - a).try_normalize()?;
        Some(Self { object, vertices, normal, offset: normal.dot(a) })
    }

    fn bounds(&self) -> [DVec3; 2] {
        let [a, b, c] = self.vertices;
        [a.min(b).min(c), a.max(b).max(c)]
    }

    /// Bound on the error of positions: a few roundings of the matrix and the coordinates.
    fn tolerance(&self) -> f64 {
        let [low, high] = self.bounds();
        256.0 * f64::from(UNIT_ROUNDOFF) * low.abs().max(high.abs()).max_element()
    }

    fn touches(&self, other: &Self) -> bool {
        let tolerance = self.tolerance().max(other.tolerance());
        let ([low, high], [other_low, other_high]) = (self.bounds(), other.bounds());
        let boxes = (low - tolerance).cmple(other_high).all() && (other_low - tolerance).cmple(high).all();
        let off_plane = |p: &DVec3| (self.normal.dot(*p) - self.offset).abs() > tolerance;
        boxes && !other.vertices.iter().any(off_plane)
    }
}

/// Grid steps for planes: of the normal, and of the offset relative to the largest coordinate.
const STEPS: [f64; 2] = [1e-4, 1e-5];

/// Maximum number of faces per cell that are compared with a face of another object; if there are more, the objects
/// count as touching.
const MOST_COMPARED: usize = 64;

/// Maximum number of equal spheres per position that are paired.
const MOST_EQUAL: usize = 64;

type Cell = [i64; 4];

/// Returns pairs of a transparent object and another one with possibly overlapping faces in one plane.
fn touching(geometry: &Geometry, is_clear: &[bool]) -> Vec<(u32, u32)> {
    let shapes = geometry.tree.shapes();
    let clear: Vec<bool> =
        geometry.objects.iter().map(|object| object.materials.iter().any(|&id| is_clear[id as usize])).collect();
    if !clear.contains(&true) {
        return Vec::new();
    }
    let mut pairs = equal_spheres(shapes, &clear);
    let boxes: Vec<[Vec3; 2]> = shapes.iter().map(box_of).collect();
    let flat: Vec<u32> =
        (0..shapes.len() as u32).filter(|&i| boxes[i as usize][0].cmple(boxes[i as usize][1]).all()).collect();
    // Per object: the part of its box that another object overlaps.
    let mut reached = vec![[Vec3::INFINITY, Vec3::NEG_INFINITY]; shapes.len()];
    let mut near_pairs: FxHashMap<(u32, u32), bool> = FxHashMap::default();
    for (a, b) in overlapping(&flat, &boxes).into_iter().filter(|&(a, b)| clear[a as usize] || clear[b as usize]) {
        near_pairs.insert((a.min(b), a.max(b)), false);
        let is_plane = |i: u32| matches!(shapes[i as usize], Shape::Plane { .. });
        if !is_plane(a) && !is_plane(b) {
            let ([low_a, high_a], [low_b, high_b]) = (boxes[a as usize], boxes[b as usize]);
            for i in [a, b] {
                let [low, high] = reached[i as usize];
                reached[i as usize] = [low.min(low_a.max(low_b)), high.max(high_a.min(high_b))];
            }
        }
    }
    let faces: Vec<Face> = (0..shapes.len() as u32)
        .filter(|&i| reached[i as usize][0].cmple(reached[i as usize][1]).all())
        .flat_map(|i| {
            let [low, high] = reached[i as usize].map(|p| p.as_dvec3());
            let is_inside = move |face: &Face| {
                let [face_low, face_high] = face.bounds();
                face_low.cmple(high).all() && low.cmple(face_high).all()
            };
            faces_of(i, &shapes[i as usize]).into_iter().filter(is_inside)
        })
        .collect();
    let size_of = |face: &Face| face.bounds().map(|p| p.abs().max_element());
    let largest = faces.iter().flat_map(size_of).fold(f64::MIN_POSITIVE, f64::max);
    let place = |normal: DVec3, offset: f64| {
        let n = normal / STEPS[0];
        [n.x, n.y, n.z, offset / (STEPS[1] * largest)]
    };
    let mut cells: FxHashMap<Cell, Vec<u32>> = FxHashMap::default();
    for (i, face) in (0..).zip(&faces) {
        for sign in [1.0, -1.0] {
            let cell = place(sign * face.normal, sign * face.offset).map(|x| x.floor() as i64);
            let list = cells.entry(cell).or_default();
            list.push(i);
        }
    }
    for face in &faces {
        let at = place(face.normal, face.offset);
        for corner in 0..16u32 {
            // The two nearest cells per axis.
            let cell: Cell = std::array::from_fn(|k| (at[k] - 0.5).floor() as i64 + i64::from(corner >> k & 1));
            let Some(list) = cells.get(&cell) else { continue };
            // Faces of later objects only: faces are in the order of their objects.
            let first = list.partition_point(|&j| faces[j as usize].object <= face.object);
            let others = list[first..].iter();
            for (n, &j) in others.enumerate() {
                let other = &faces[j as usize];
                let pair = (face.object.min(other.object), face.object.max(other.object));
                if let Some(found) = near_pairs.get_mut(&pair).filter(|found| !**found) {
                    *found = n >= MOST_COMPARED || face.touches(other) || other.touches(face);
                }
                if n > MOST_COMPARED {
                    break;
                }
            }
        }
    }
    // Planes have no faces: everything that lies in them touches them.
    for (&(a, b), found) in &mut near_pairs {
        let [a, b] = [a, b].map(|i| &shapes[i as usize]);
        let lies_in = |shape: &Shape, plane: &Shape| match plane {
            Shape::Plane { point, normal } => lies_in_plane(shape, point.as_dvec3(), normal.as_dvec3().normalize()),
            _ => false,
        };
        *found |= lies_in(a, b) || lies_in(b, a);
    }
    for ((a, b), _) in near_pairs.into_iter().filter(|(_, found)| *found) {
        pairs.extend(clear[a as usize].then_some((a, b)));
        pairs.extend(clear[b as usize].then_some((b, a)));
    }
    pairs.sort_unstable();
    pairs
}

/// Whether some face of a shape lies in a plane.
fn lies_in_plane(shape: &Shape, point: DVec3, normal: DVec3) -> bool {
    if let Shape::Plane { point: other, normal: n } = shape {
        let distance = (other.as_dvec3() - point).dot(normal).abs();
        let size = point.abs().max(other.as_dvec3().abs()).max_element();
        return normal.cross(n.as_dvec3().normalize()).length() < STEPS[0] && distance <= STEPS[1] * size;
    }
    faces_of(0, shape).iter().any(|face| {
        let tolerance = face.tolerance() + 256.0 * f64::from(UNIT_ROUNDOFF) * point.abs().max_element();
        face.vertices.iter().all(|p| (*p - point).dot(normal).abs() <= tolerance)
    })
}

fn faces_of(object: u32, shape: &Shape) -> Vec<Face> {
    let face = |vertices: [Vec3; 3]| Face::new(object, vertices.map(|p| p.as_dvec3()));
    match shape {
        Shape::Triangle { vertices } => face(*vertices).into_iter().collect(),
        Shape::Quad { corner, edge_u, edge_v } => {
            let [a, b, c, d] = quad_corners(*corner, *edge_u, *edge_v);
            [[a, b, c], [b, c, d], [a, c, d], [a, b, d]].into_iter().filter_map(face).collect()
        }
        Shape::Mesh { tree, world_from_object, .. } => {
            let map = world_from_object.matrix3.as_dmat3();
            let offset = Vec3::from(world_from_object.translation).as_dvec3();
            let corners = |prim| tree.vertices(prim).map(|p| map * p.as_dvec3() + offset);
            (0..tree.n_triangles() as u32).filter_map(|prim| Face::new(object, corners(prim))).collect()
        }
        Shape::Plane { .. } | Shape::Sphere { .. } | Shape::Spheres { .. } => Vec::new(),
    }
}

/// Bounding box of the faces of a shape, with a margin for rounding; empty if there are none.
fn box_of(shape: &Shape) -> [Vec3; 2] {
    let around = |points: &[Vec3]| {
        let low = points.iter().copied().fold(Vec3::INFINITY, Vec3::min);
        let high = points.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
        let room = 256.0 * UNIT_ROUNDOFF * low.abs().max(high.abs()).max_element();
        [low - room, high + room]
    };
    match shape {
        Shape::Plane { .. } => [Vec3::NEG_INFINITY, Vec3::INFINITY],
        Shape::Triangle { vertices } => around(vertices),
        Shape::Quad { corner, edge_u, edge_v } => around(&quad_corners(*corner, *edge_u, *edge_v)),
        Shape::Mesh { tree, world_from_object, .. } if !tree.bounds().is_empty() => {
            let bounds = tree.bounds();
            let pick = |i: usize, axis: usize| if i >> axis & 1 == 0 { bounds.min[axis] } else { bounds.max[axis] };
            let corner = |i| world_from_object.transform_point3(Vec3::new(pick(i, 0), pick(i, 1), pick(i, 2)));
            around(&std::array::from_fn::<_, 8, _>(corner))
        }
        _ => [Vec3::INFINITY, Vec3::NEG_INFINITY],
    }
}

/// Returns pairs of overlapping boxes, by a sweep along x.
fn overlapping(objects: &[u32], boxes: &[[Vec3; 2]]) -> Vec<(u32, u32)> {
    let of = |i: u32| boxes[i as usize];
    let mut order = objects.to_vec();
    order.sort_by(|&a, &b| of(a)[0].x.total_cmp(&of(b)[0].x));
    let (mut open, mut pairs): (Vec<u32>, _) = (Vec::new(), Vec::new());
    for i in order {
        let [low, high] = of(i);
        open.retain(|&j| of(j)[1].x >= low.x);
        let meets = |&&j: &&u32| of(j)[0].cmple(high).all() && low.cmple(of(j)[1]).all();
        pairs.extend(open.iter().filter(meets).map(|&j| (i, j)));
        open.push(i);
    }
    pairs
}

/// Returns pairs of spheres of equal position and size, the first of which is transparent.
fn equal_spheres(shapes: &[Shape], clear: &[bool]) -> Vec<(u32, u32)> {
    let mut places: FxHashMap<[u32; 4], Vec<u32>> = FxHashMap::default();
    for (i, shape) in (0..).zip(shapes) {
        if let Shape::Sphere { center, radius } = shape {
            let place = [center.x + 0.0, center.y + 0.0, center.z + 0.0, *radius].map(f32::to_bits);
            let list = places.entry(place).or_default();
            if list.len() < MOST_EQUAL {
                list.push(i);
            }
        }
    }
    let mut pairs = Vec::new();
    for list in places.values().filter(|list| list.len() > 1) {
        for &a in list.iter().filter(|&&a| clear[a as usize]) {
            pairs.extend(list.iter().filter(|&&b| b != a).map(|&b| (a, b)));
        }
    }
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::snapshot::Object;
    use firstlight_kdtree::{BuildPreset, HitSpace, MeshTree};
    use firstlight_mesh::{Mesh, procedural};
    use glam::{Affine3A, Quat};
    use std::f32::consts::FRAC_PI_4;

    fn placed(mesh: Mesh, map: Affine3A) -> (Shape, Object) {
        let tree = Arc::new(MeshTree::build(&mesh.positions, &mesh.triangles, BuildPreset::Quick));
        (
            Shape::Mesh { tree, world_from_object: map, space: HitSpace::Object },
            Object { mesh: Some(Arc::new(mesh)), ..Object::plain(0) },
        )
    }

    /// Pairs of objects that are all transparent except those of material 1.
    fn pairs(parts: Vec<(Shape, Object)>) -> Vec<(u32, u32)> {
        let (shapes, objects) = parts.into_iter().unzip();
        touching(&Geometry::build(shapes, objects), &[true, false])
    }

    fn block(center: Vec3, size: Vec3, turn: Quat) -> (Shape, Object) {
        let mesh = procedural::cuboid(DVec3::ONE).flat();
        let extent = mesh.positions.iter().fold(Vec3::ZERO, |most, p| most.max(p.abs())) * 2.0;
        let map = Affine3A::from_scale_rotation_translation(size / extent, turn, turn * center);
        placed(mesh, map)
    }

    #[test]
    fn faces_in_one_plane_touch_however_they_overlap() {
        let turns =
            [Quat::IDENTITY, Quat::from_rotation_y(FRAC_PI_4), Quat::from_euler(glam::EulerRot::XYZ, 0.3, 1.1, -2.0)];
        for turn in turns {
            for scale in [1.0, 1e-4, 3e5] {
                let of = |center: Vec3, size: Vec3| block(center * scale, size * scale, turn);
                let low = || of(Vec3::new(0.0, -0.5, 0.0), Vec3::new(4.0, 1.0, 0.3));
                // Crossed, so that no vertex of either lies on the other one.
                let across = of(Vec3::new(1.1, 0.35, 0.2), Vec3::new(0.3, 0.7, 5.0));
                assert_eq!(pairs(vec![low(), across]), [(0, 1), (1, 0)], "{turn} {scale}");
                let apart = of(Vec3::new(1.1, 0.36, 0.2), Vec3::new(0.3, 0.7, 5.0));
                assert_eq!(pairs(vec![low(), apart]), [], "{turn} {scale}");
                // Bounding boxes separate faces in one plane.
                let beside = of(Vec3::new(2.5, 0.35, 0.0), Vec3::new(0.3, 0.7, 5.0));
                assert!(turn != Quat::IDENTITY || pairs(vec![low(), beside]).is_empty(), "{scale}");
            }
        }
    }

    #[test]
    fn curved_bodies_in_each_other_touch_nothing() {
        let ball = |radius: f32| placed(procedural::icosphere(24).flat(), Affine3A::from_scale(Vec3::splat(radius)));
        assert_eq!(pairs(vec![ball(1.0), ball(0.9), ball(0.95)]), []);
        assert_eq!(pairs(vec![ball(1.0), ball(1.0)]), [(0, 1), (1, 0)]);
    }

    #[test]
    fn only_what_lies_in_a_plane_touches_it() {
        let floor = || (Shape::Plane { point: Vec3::new(3.0, -1.0, 2.0), normal: Vec3::Y }, Object::plain(1));
        let at = |y: f32| block(Vec3::new(5.0, y, -7.0), Vec3::ONE, Quat::IDENTITY);
        assert_eq!(pairs(vec![at(-0.5), floor()]), [(0, 1)]);
        assert_eq!(pairs(vec![floor(), at(-0.4)]), []);
        let quad = Shape::Quad { corner: Vec3::new(0.0, -1.0, 0.0), edge_u: Vec3::X, edge_v: Vec3::Z };
        assert_eq!(pairs(vec![(quad, Object::plain(0)), floor()]), [(0, 1)]);
    }

    #[test]
    fn equal_spheres_touch() {
        let sphere = |radius| (Shape::Sphere { center: Vec3::X, radius }, Object::plain(0));
        assert_eq!(pairs(vec![sphere(1.0), sphere(0.5), sphere(1.0)]), [(0, 2), (2, 0)]);
    }
}
