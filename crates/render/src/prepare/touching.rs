//! The search for objects that touch: pairs of a transparent object and another one with two faces in one plane, or of
//! two equal spheres.

use firstlight_kdtree::Shape;
use firstlight_kdtree::geometry::quad_corners;
use firstlight_kdtree::geometry::robust::UNIT_ROUNDOFF;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use rustc_hash::{FxBuildHasher, FxHashMap, FxHashSet};
use std::hash::BuildHasher;

/// A face in world space.
struct Face {
    vertices: [DVec3; 3],
    /// Unit normal.
    normal: DVec3,
    offset: f64,
}

impl Face {
    fn new(vertices: [DVec3; 3]) -> Option<Self> {
        let [a, b, c] = vertices;
        let normal = (b - a).cross(c - a).try_normalize()?;
        Some(Self { vertices, normal, offset: normal.dot(a) })
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

/// Maximum number of faces of an object in one cell that are compared with a face of another one; if there are more, the
/// objects count as touching.
const MOST_COMPARED: usize = 64;

/// Maximum number of equal spheres per position that are paired.
const MOST_EQUAL: usize = 64;

type Cell = [i64; 4];

/// Returns pairs of a transparent object and another one with possibly overlapping faces in one plane, in order.
///
/// Whether two objects touch depends on the shapes of these two alone.
///
/// - `clear`: per object, whether a part of it is transparent.
/// - `known`: for a pair with overlapping boxes, whether it touches, if that is known already.
pub(crate) fn touching(
    shapes: &[Shape],
    clear: &[bool],
    known: impl Fn((u32, u32)) -> Option<bool>,
) -> Vec<(u32, u32)> {
    if !clear.contains(&true) {
        return Vec::new();
    }
    let mut pairs = equal_spheres(shapes, clear);
    let boxes: Vec<[Vec3; 2]> = shapes.iter().map(box_of).collect();
    let flat: Vec<u32> =
        (0..shapes.len() as u32).filter(|&i| boxes[i as usize][0].cmple(boxes[i as usize][1]).all()).collect();
    let near = overlapping(&flat, &boxes).into_iter().filter(|&(a, b)| clear[a as usize] || clear[b as usize]);
    let (mut found, mut unknown) = (Vec::new(), Vec::new());
    for pair in near {
        match known(pair) {
            Some(touches) => found.extend(touches.then_some(pair)),
            None => unknown.push(pair),
        }
    }
    found.extend(compared(shapes, &boxes, unknown));
    for (a, b) in found {
        pairs.extend(clear[a as usize].then_some((a, b)));
        pairs.extend(clear[b as usize].then_some((b, a)));
    }
    pairs.sort_unstable();
    pairs
}

/// Returns those of `pairs` that touch. All of them have overlapping boxes.
fn compared(shapes: &[Shape], boxes: &[[Vec3; 2]], pairs: Vec<(u32, u32)>) -> Vec<(u32, u32)> {
    let overlap = |(a, b): (u32, u32)| {
        let ([low_a, high_a], [low_b, high_b]) = (boxes[a as usize], boxes[b as usize]);
        [low_a.max(low_b), high_a.min(high_b)].map(|p| p.as_dvec3())
    };
    let is_plane = |i: u32| matches!(shapes[i as usize], Shape::Plane { .. });
    // Per object: the parts of its box that others overlap.
    let mut parts: FxHashMap<u32, Vec<[DVec3; 2]>> = FxHashMap::default();
    for &pair in pairs.iter().filter(|(a, b)| !is_plane(*a) && !is_plane(*b)) {
        parts.entry(pair.0).or_default().push(overlap(pair));
        parts.entry(pair.1).or_default().push(overlap(pair));
    }
    let faces: FxHashMap<u32, Vec<Face>> =
        parts.into_par_iter().map(|(i, parts)| (i, faces_in(&shapes[i as usize], &parts))).collect();
    let filter = PlaneFilter::build(boxes, &faces, &pairs);
    let touches = |&pair: &(u32, u32)| {
        if !is_plane(pair.0) && !is_plane(pair.1) && !filter.may_touch(&faces, pair) {
            return false;
        }
        let [a, b] = [pair.0, pair.1].map(|i| &shapes[i as usize]);
        match (a, b) {
            // A plane has no faces: everything that lies in it touches it.
            (Shape::Plane { point, normal }, other) | (other, Shape::Plane { point, normal }) => {
                lies_in_plane(other, point.as_dvec3(), normal.as_dvec3().normalize())
            }
            _ => {
                let part = overlap(pair);
                let [a, b] = [pair.0, pair.1]
                    .map(|i| faces[&i].iter().filter(|face| meet(&face.bounds(), &part)).collect::<Vec<_>>());
                faces_touch(&a, &b)
            }
        }
    };
    pairs.into_par_iter().filter(touches).collect()
}

/// Tells of most pairs of objects that no two of their faces lie in one plane, in a step per face: comparing the faces of
/// many nested bodies takes most of a minute without it.
struct PlaneFilter {
    /// Per object: the exponent of two that is above all of its coordinates.
    exponents: Vec<i32>,
    /// By object and exponent of the pair.
    cells: FxHashMap<(u32, i32), PlaneCells>,
}

impl PlaneFilter {
    /// Steps of its grid in those of [`STEPS`]: what is found in neighbouring cells there is found here.
    const COARSER: f64 = 4.0;

    fn build(boxes: &[[Vec3; 2]], faces: &FxHashMap<u32, Vec<Face>>, pairs: &[(u32, u32)]) -> Self {
        let exponent = |[low, high]: &[Vec3; 2]| {
            let most = f64::from(low.abs().max(high.abs()).max_element()).clamp(f64::MIN_POSITIVE, f64::MAX);
            most.log2().floor() as i32 + 1
        };
        let mut filter = Self { exponents: boxes.iter().map(exponent).collect(), cells: FxHashMap::default() };
        let wanted: FxHashSet<(u32, i32)> = pairs
            .iter()
            .filter(|(a, b)| faces.contains_key(a) && faces.contains_key(b))
            .map(|&pair| (by_number_of_faces(faces, pair).0, filter.exponent_of(pair)))
            .collect();
        let cells = wanted.into_par_iter().map(|key| (key, PlaneCells::of(&faces[&key.0], key.1)));
        filter.cells = cells.collect();
        filter
    }

    fn exponent_of(&self, (a, b): (u32, u32)) -> i32 {
        self.exponents[a as usize].max(self.exponents[b as usize])
    }

    fn may_touch(&self, faces: &FxHashMap<u32, Vec<Face>>, pair: (u32, u32)) -> bool {
        let (fewer, more) = by_number_of_faces(faces, pair);
        let exponent = self.exponent_of(pair);
        let cells = &self.cells[&(fewer, exponent)];
        faces[&more].iter().any(|face| cells.have(face, exponent))
    }
}

/// The object of a pair with fewer faces, and the other.
fn by_number_of_faces(faces: &FxHashMap<u32, Vec<Face>>, (a, b): (u32, u32)) -> (u32, u32) {
    if faces[&a].len() <= faces[&b].len() { (a, b) } else { (b, a) }
}

/// Cells of the planes of an object's faces, of both orientations.
struct PlaneCells {
    /// A bit per remainder of the hash of a cell near a plane: most questions end here.
    near: Vec<u64>,
    hashes: FxHashSet<u64>,
}

impl PlaneCells {
    fn of(faces: &[Face], exponent: i32) -> Self {
        let mut cells = Self { near: vec![0; (4 * faces.len()).next_power_of_two()], hashes: FxHashSet::default() };
        for (face, sign) in faces.iter().flat_map(|face| [(face, 1.0), (face, -1.0)]) {
            let at = Self::place(sign * face.normal, sign * face.offset, exponent);
            cells.hashes.insert(hash_of(at.map(|x| x.floor() as i64)));
            for corner in 0..16 {
                let (word, bit) = Self::bit(&cells.near, hash_of(nearest_cell(&at, corner)));
                cells.near[word] |= bit;
            }
        }
        cells
    }

    fn have(&self, face: &Face, exponent: i32) -> bool {
        let at = Self::place(face.normal, face.offset, exponent);
        let (word, bit) = Self::bit(&self.near, hash_of(at.map(|x| x.floor() as i64)));
        self.near[word] & bit != 0 && (0..16).any(|corner| self.hashes.contains(&hash_of(nearest_cell(&at, corner))))
    }

    fn bit(bits: &[u64], hash: u64) -> (usize, u64) {
        ((hash >> 38) as usize & (bits.len() - 1), 1 << (hash >> 32 & 63))
    }

    fn place(normal: DVec3, offset: f64, exponent: i32) -> [f64; 4] {
        let [of_normal, of_offset] = STEPS.map(|step| PlaneFilter::COARSER * step);
        let n = normal / of_normal;
        [n.x, n.y, n.z, offset / (of_offset * f64::from(exponent).exp2())]
    }
}

fn hash_of(cell: Cell) -> u64 {
    FxBuildHasher.hash_one(cell)
}

/// One of the two nearest cells per axis.
fn nearest_cell(at: &[f64; 4], corner: u32) -> Cell {
    std::array::from_fn(|k| (at[k] - 0.5).floor() as i64 + i64::from(corner >> k & 1))
}

/// Whether two boxes overlap.
fn meet([low, high]: &[DVec3; 2], [other_low, other_high]: &[DVec3; 2]) -> bool {
    low.cmple(*other_high).all() && other_low.cmple(*high).all()
}

/// Whether some face of one list touches one of the other.
fn faces_touch(a: &[&Face], b: &[&Face]) -> bool {
    let (few, many) = if a.len() < b.len() { (a, b) } else { (b, a) };
    let size_of = |face: &&Face| face.bounds().map(|p| p.abs().max_element());
    let largest = few.iter().chain(many).flat_map(size_of).fold(f64::MIN_POSITIVE, f64::max);
    let place = |normal: DVec3, offset: f64| {
        let n = normal / STEPS[0];
        [n.x, n.y, n.z, offset / (STEPS[1] * largest)]
    };
    let mut cells: FxHashMap<Cell, Vec<&Face>> = FxHashMap::default();
    for face in few {
        for sign in [1.0, -1.0] {
            let cell = place(sign * face.normal, sign * face.offset).map(|x| x.floor() as i64);
            cells.entry(cell).or_default().push(face);
        }
    }
    many.iter().any(|face| {
        let at = place(face.normal, face.offset);
        (0..16u32).any(|corner| {
            let others = cells.get(&nearest_cell(&at, corner)).map_or(&[][..], |list| list);
            others.len() > MOST_COMPARED || others.iter().any(|other| face.touches(other) || other.touches(face))
        })
    })
}

/// Whether some face of a shape lies in a plane.
fn lies_in_plane(shape: &Shape, point: DVec3, normal: DVec3) -> bool {
    if let Shape::Plane { point: other, normal: n } = shape {
        let distance = (other.as_dvec3() - point).dot(normal).abs();
        let size = point.abs().max(other.as_dvec3().abs()).max_element();
        return normal.cross(n.as_dvec3().normalize()).length() < STEPS[0] && distance <= STEPS[1] * size;
    }
    faces_of(shape, |_| true).iter().any(|face| {
        let tolerance = face.tolerance() + 256.0 * f64::from(UNIT_ROUNDOFF) * point.abs().max_element();
        face.vertices.iter().all(|p| (*p - point).dot(normal).abs() <= tolerance)
    })
}

/// The faces of a shape whose boxes overlap one of `parts`.
fn faces_in(shape: &Shape, parts: &[[DVec3; 2]]) -> Vec<Face> {
    let whole = parts
        .iter()
        .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], part| [low.min(part[0]), high.max(part[1])]);
    faces_of(shape, |[a, b, c]| {
        let bounds = [a.min(*b).min(*c), a.max(*b).max(*c)];
        meet(&bounds, &whole) && parts.iter().any(|part| meet(&bounds, part))
    })
}

/// The faces of a shape that `is_wanted` keeps by their vertices.
fn faces_of(shape: &Shape, is_wanted: impl Fn(&[DVec3; 3]) -> bool) -> Vec<Face> {
    let of = |vertices: [DVec3; 3]| is_wanted(&vertices).then(|| Face::new(vertices)).flatten();
    let face = |vertices: [Vec3; 3]| of(vertices.map(|p| p.as_dvec3()));
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
            (0..tree.n_triangles() as u32).filter_map(|prim| of(corners(prim))).collect()
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
    use firstlight_kdtree::{BuildPreset, HitSpace, MeshTree};
    use firstlight_mesh::{Mesh, procedural};
    use glam::{Affine3A, Quat};
    use std::f32::consts::FRAC_PI_4;
    use std::sync::Arc;

    /// A shape, and whether it is transparent.
    type Part = (Shape, bool);

    fn placed(mesh: &Mesh, map: Affine3A) -> Part {
        let tree = Arc::new(MeshTree::build(&mesh.positions, &mesh.triangles, BuildPreset::Quick));
        (Shape::Mesh { tree, world_from_object: map, space: HitSpace::Object }, true)
    }

    fn pairs(parts: Vec<Part>) -> Vec<(u32, u32)> {
        let (shapes, clear): (Vec<_>, Vec<_>) = parts.into_iter().unzip();
        touching(&shapes, &clear, |_| None)
    }

    fn block(center: Vec3, size: Vec3, turn: Quat) -> Part {
        let mesh = procedural::cuboid(DVec3::ONE).flat();
        let extent = mesh.positions.iter().fold(Vec3::ZERO, |most, p| most.max(p.abs())) * 2.0;
        let map = Affine3A::from_scale_rotation_translation(size / extent, turn, turn * center);
        placed(&mesh, map)
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
        let ball = |radius: f32| placed(&procedural::icosphere(24).flat(), Affine3A::from_scale(Vec3::splat(radius)));
        assert_eq!(pairs(vec![ball(1.0), ball(0.9), ball(0.95)]), []);
        assert_eq!(pairs(vec![ball(1.0), ball(1.0)]), [(0, 1), (1, 0)]);
    }

    #[test]
    fn only_what_lies_in_a_plane_touches_it() {
        let floor = || (Shape::Plane { point: Vec3::new(3.0, -1.0, 2.0), normal: Vec3::Y }, false);
        let at = |y: f32| block(Vec3::new(5.0, y, -7.0), Vec3::ONE, Quat::IDENTITY);
        assert_eq!(pairs(vec![at(-0.5), floor()]), [(0, 1)]);
        assert_eq!(pairs(vec![floor(), at(-0.4)]), []);
        let quad = Shape::Quad { corner: Vec3::new(0.0, -1.0, 0.0), edge_u: Vec3::X, edge_v: Vec3::Z };
        assert_eq!(pairs(vec![(quad, true), floor()]), [(0, 1)]);
    }

    #[test]
    fn equal_spheres_touch() {
        let sphere = |radius| (Shape::Sphere { center: Vec3::X, radius }, true);
        assert_eq!(pairs(vec![sphere(1.0), sphere(0.5), sphere(1.0)]), [(0, 2), (2, 0)]);
    }
}
