//! The nearest point of a mesh: a tree of boxes, searched near side first.
//!
//! Boxes lie along the axes, and where that leaves them mostly empty, as with a fan of needles, turned ones beside them
//! (as in OBB trees, Gottschalk, Lin and Manocha 1996): a point that lies in the boxes of all needles lies in the turned
//! boxes of a few.
//!
//! Distances are right to rounding. Where thousands of triangles share an edge or lie on each other, rounding is all that
//! tells which of them is the nearest, and to find out would mean to look at each; the first that is met will do. Where
//! thousands are about as near, the distance is right to a thousandth ([`PATIENCE`]).

use crate::Mesh;
use glam::{DMat3, DVec3};
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Triangles a leaf.
const LEAF: usize = 4;

#[derive(Debug)]
pub(super) struct NearestTree {
    nodes: Vec<BoxNode>,
    frames: Vec<BoxFrame>,
    /// In the order of the leaves.
    triangles: Vec<[DVec3; 3]>,
    /// Metres: by how much distances to triangles and to boxes may be off.
    rounding: f64,
}

/// The share of a squared distance by which it may be off beside that.
const PRECISION: f64 = 1e-12;

/// Nodes that are looked into before [`ROUGHLY`] takes the place of [`PRECISION`].
const PATIENCE: usize = 1024;
const ROUGHLY: f64 = 2e-3;

#[derive(Clone, Copy, Debug)]
struct BoxNode {
    min: DVec3,
    max: DVec3,
    /// Inner node: index of the second child (the first is the next node). Leaf: first triangle.
    link: u32,
    /// 0 for an inner node.
    count: u32,
    /// Index of a turned box that is much smaller, or `NONE`.
    frame: u32,
}

const NONE: u32 = u32::MAX;

/// A box in a direction of its own.
#[derive(Clone, Copy, Debug)]
struct BoxFrame {
    /// Rows are the unit axes.
    axes: DMat3,
    center: DVec3,
    /// Along the axes, from the center.
    min: DVec3,
    max: DVec3,
}

impl NearestTree {
    /// - `offset`: added to the mesh's positions.
    pub fn build(mesh: &Mesh, offset: DVec3) -> Self {
        let mut triangles: Vec<[DVec3; 3]> =
            (0..mesh.triangles.len()).map(|t| mesh.corners(t).map(|p| p.as_dvec3() + offset)).collect();
        if triangles.is_empty() {
            return Self { nodes: Vec::new(), frames: Vec::new(), triangles, rounding: 0.0 };
        }
        let Branch { nodes, frames, .. } = build(&mut triangles, 0);
        let largest = nodes[0].min.abs().max(nodes[0].max.abs()).max_element();
        Self { nodes, frames, triangles, rounding: 64.0 * f64::EPSILON * largest }
    }

    /// The squared distance to the nearest point, to rounding; infinite for an empty mesh.
    ///
    /// - `guess`: the nearest triangle of a point close by, if known; set to this point's.
    pub fn nearest(&self, point: DVec3, guess: &mut Option<u32>) -> f64 {
        self.search(point, guess, || ())
    }

    /// Depth first, which is quick where little is looked at. What takes longer goes on with the nearest box of all: where
    /// large boxes hold the point and nothing near it, all that lies in them would be looked at first.
    ///
    /// - `look`: called for each triangle that is looked at.
    #[inline(always)]
    fn search(&self, point: DVec3, guess: &mut Option<u32>, mut look: impl FnMut()) -> f64 {
        const DEPTH_FIRST: usize = 128;
        let Some(root) = self.nodes.first() else { return f64::INFINITY };
        let best = guess.map_or(f64::INFINITY, |t| distance2_to_triangle(point, &self.triangles[t as usize]));
        let mut found = NearestSoFar { best, precision: PRECISION, limit: self.worthwhile(best, PRECISION), guess };
        // Splits halve the count, so 64 levels hold any mesh.
        let mut stack = [Open { bound: 0.0, node: 0 }; 64];
        stack[0] = Open { bound: distance2_to_box(point, root), node: 0 };
        let (mut top, mut steps) = (1, 0);
        while top > 0 && steps < DEPTH_FIRST {
            top -= 1;
            let open = stack[top];
            if open.bound >= found.limit {
                continue;
            }
            steps += 1;
            if let Some([near, far]) = self.step(point, open.node, &mut found, &mut look) {
                stack[top] = far;
                stack[top + 1] = near;
                top += 2;
            }
        }
        if top > 0 {
            self.search_on(point, BinaryHeap::from(stack[..top].to_vec()), &mut found, &mut look);
        }
        found.best
    }

    /// The nearest box first.
    #[cold]
    fn search_on(&self, point: DVec3, mut open: BinaryHeap<Open>, found: &mut NearestSoFar, look: &mut impl FnMut()) {
        let mut steps = 0;
        while let Some(next) = open.pop()
            && next.bound < found.limit
        {
            steps += 1;
            if steps == PATIENCE {
                found.precision = ROUGHLY;
            }
            let children = self.step(point, next.node, found, look);
            open.extend(children.into_iter().flatten().filter(|child| child.bound < found.limit));
        }
    }

    /// Looks at the triangles of a leaf, or answers with the children of an inner node, the nearer one first.
    #[inline(always)]
    fn step(&self, point: DVec3, index: u32, found: &mut NearestSoFar, look: &mut impl FnMut()) -> Option<[Open; 2]> {
        let node = &self.nodes[index as usize];
        if node.count == 0 {
            let child = |node: u32| Open { bound: self.bound(point, &self.nodes[node as usize]), node };
            let [left, right] = [child(index + 1), child(node.link)];
            return Some(if left.bound <= right.bound { [left, right] } else { [right, left] });
        }
        for t in node.link..node.link + node.count {
            look();
            let distance2 = distance2_to_triangle(point, &self.triangles[t as usize]);
            if distance2 < found.best {
                (found.best, *found.guess) = (distance2, Some(t));
            }
        }
        found.limit = self.worthwhile(found.best, found.precision);
        None
    }
}

/// The nearest so far.
struct NearestSoFar<'a> {
    /// Squared distance.
    best: f64,
    /// The share of it by which it may be off.
    precision: f64,
    /// Boxes that are as far hold nothing nearer.
    limit: f64,
    guess: &'a mut Option<u32>,
}

/// A node that has not been looked into. The nearest is the greatest, of equals the first.
#[derive(Clone, Copy, Debug)]
struct Open {
    bound: f64,
    node: u32,
}

impl Ord for Open {
    fn cmp(&self, other: &Self) -> Ordering {
        other.bound.total_cmp(&self.bound).then(other.node.cmp(&self.node))
    }
}

impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Open {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Open {}

impl NearestTree {
    /// The squared distance to a box from which on nothing in it is nearer than `best` by more than rounding and this share.
    #[inline(always)]
    fn worthwhile(&self, best: f64, precision: f64) -> f64 {
        let nearer = (best.sqrt() - self.rounding).max(0.0);
        nearer * nearer * (1.0 - precision)
    }

    /// The squared distance of a point to what holds all that lies below a node.
    #[inline(always)]
    fn bound(&self, point: DVec3, node: &BoxNode) -> f64 {
        let straight = distance2_to_box(point, node);
        if node.frame == NONE { straight } else { straight.max(self.frames[node.frame as usize].distance2(point)) }
    }
}

/// Part of the tree: what lies below one node, depth first.
struct Branch {
    nodes: Vec<BoxNode>,
    frames: Vec<BoxFrame>,
    /// Of all triangles, doubled.
    area: f64,
}

/// Nodes over `triangles`, which are reordered; `first` is the number of the first of them.
fn build(triangles: &mut [[DVec3; 3]], first: u32) -> Branch {
    let corners = triangles.iter().flatten();
    let (min, max) = corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), &p| (min.min(p), max.max(p)));
    let count = triangles.len();
    let node = BoxNode { min, max, link: first, count: count as u32, frame: NONE };
    let mut branch = if count <= LEAF {
        let area = triangles.iter().map(|[a, b, c]| (*b - *a).cross(*c - *a).length()).sum();
        Branch { nodes: vec![node], frames: Vec::new(), area }
    } else {
        // Where the centres differ most, not the corners: needles side by side are long the other way.
        let size = extent_of_centers(triangles);
        let axis = (0..3).fold(0, |best, k| if size[k] > size[best] { k } else { best });
        let middle = count / 2;
        let key = |t: &[DVec3; 3]| t[0][axis] + t[1][axis] + t[2][axis];
        triangles.select_nth_unstable_by(middle, |p, q| key(p).total_cmp(&key(q)));
        let (left, right) = triangles.split_at_mut(middle);
        let second = first + middle as u32;
        let (left, right) = if count > 4096 {
            rayon::join(|| build(left, first), || build(right, second))
        } else {
            (build(left, first), build(right, second))
        };
        join(node, left, right)
    };
    // A surface that fills its box as surfaces do is not looked at any further: needles fill less of it, and the leaves of a
    // book more.
    let DVec3 { x, y, z } = max - min;
    let (face, area) = ((x * y).max(y * z).max(z * x), 0.5 * branch.area);
    if !(0.25 * face..=2.0 * face).contains(&area)
        && let Some(frame) = BoxFrame::around(triangles, 0.5 * (min + max))
        && (frame.area() < 0.5 * (x * y + y * z + z * x) || frame.volume() < 0.25 * x * y * z)
    {
        branch.nodes[0].frame = branch.frames.len() as u32;
        branch.frames.push(frame);
    }
    branch
}

/// Sides of the box around the centres, times three.
fn extent_of_centers(triangles: &[[DVec3; 3]]) -> DVec3 {
    let centers = triangles.iter().map(|[a, b, c]| *a + *b + *c);
    let (min, max) = centers.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), p| (min.min(p), max.max(p)));
    max - min
}

fn join(node: BoxNode, left: Branch, right: Branch) -> Branch {
    let shift = left.nodes.len() as u32 + 1;
    let shift_frames = left.frames.len() as u32;
    let moved = |by: u32, frames: u32| {
        move |node: BoxNode| BoxNode {
            link: if node.count == 0 { node.link + by } else { node.link },
            frame: if node.frame == NONE { NONE } else { node.frame + frames },
            ..node
        }
    };
    let mut nodes = Vec::with_capacity(left.nodes.len() + right.nodes.len() + 1);
    nodes.push(BoxNode { link: shift, count: 0, ..node });
    nodes.extend(left.nodes.into_iter().map(moved(1, 0)));
    nodes.extend(right.nodes.into_iter().map(moved(shift, shift_frames)));
    let mut frames = left.frames;
    frames.extend(right.frames);
    Branch { nodes, frames, area: left.area + right.area }
}

impl BoxFrame {
    /// Along the longest edge of the middle triangle, and in its plane; `None` if that has neither.
    fn around(triangles: &[[DVec3; 3]], center: DVec3) -> Option<Self> {
        let [a, b, c] = triangles[triangles.len() / 2];
        let longest =
            [b - a, c - b, a - c].into_iter().max_by(|p, q| p.length_squared().total_cmp(&q.length_squared()));
        let along = longest?.try_normalize()?;
        let normal = (b - a).cross(c - a);
        // Twice, so that the axes stand on each other to rounding even for a needle.
        let normal = (normal - along * along.dot(normal)).try_normalize()?;
        let normal = (normal - along * along.dot(normal)).try_normalize()?;
        let axes = DMat3::from_cols(along, normal, along.cross(normal)).transpose();
        let places = triangles.iter().flatten().map(|&p| axes * (p - center));
        let (min, max) = places.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), p| (min.min(p), max.max(p)));
        Some(Self { axes, center, min, max })
    }

    /// Half the surface.
    fn area(&self) -> f64 {
        let DVec3 { x, y, z } = self.max - self.min;
        x * y + y * z + z * x
    }

    fn volume(&self) -> f64 {
        (self.max - self.min).element_product()
    }

    /// The squared distance of a point to the box.
    #[inline]
    fn distance2(&self, point: DVec3) -> f64 {
        let place = self.axes * (point - self.center);
        (place - place.clamp(self.min, self.max)).length_squared()
    }
}

#[inline]
fn distance2_to_box(point: DVec3, node: &BoxNode) -> f64 {
    (point - point.clamp(node.min, node.max)).length_squared()
}

/// Voronoi regions of corners, edges and face in turn (Ericson 2005, "Real-Time Collision Detection", 5.1.5).
#[inline]
fn distance2_to_triangle(p: DVec3, &[a, b, c]: &[DVec3; 3]) -> f64 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return ap.length_squared();
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return bp.length_squared();
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return (ap - ab * (d1 / (d1 - d3))).length_squared();
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return cp.length_squared();
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return (ap - ac * (d2 / (d2 - d6))).length_squared();
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return (bp - (c - b) * t).length_squared();
    }
    let scale = 1.0 / (va + vb + vc);
    (ap - ab * (vb * scale) - ac * (vc * scale)).length_squared()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::procedural;

    #[test]
    fn agrees_with_a_fine_grid_of_points_on_a_triangle() {
        let triangle = [DVec3::ZERO, DVec3::new(2.0, 0.3, 0.0), DVec3::new(0.4, 1.5, 0.8)];
        for i in 0..200 {
            let t = f64::from(i);
            let point = DVec3::new((t * 0.37).sin() * 3.0, (t * 0.71).cos() * 3.0, (t * 0.13).sin() * 2.0);
            let mut expected = f64::INFINITY;
            for u in 0..=200 {
                for v in 0..=200 - u {
                    let (u, v) = (f64::from(u) / 200.0, f64::from(v) / 200.0);
                    let on = triangle[0] + u * (triangle[1] - triangle[0]) + v * (triangle[2] - triangle[0]);
                    expected = expected.min(on.distance(point));
                }
            }
            let found = distance2_to_triangle(point, &triangle).sqrt();
            assert!(found <= expected + 1e-12 && expected - found < 0.02, "{point}: {found} {expected}");
        }
    }

    /// Needles from one point to all sides: a cone, and the same flat and turned.
    #[test]
    fn agrees_with_looking_at_every_needle_and_looks_at_few() {
        let turned = glam::DQuat::from_euler(glam::EulerRot::XYZ, 0.5, 0.9, 0.3);
        let straight = glam::DQuat::IDENTITY;
        // The last has its point on the rim.
        let rim_point = DVec3::new(1.0, 0.0, 0.0);
        let middle = DVec3::new(0.1, 0.2, 0.0);
        for (point, height, turn) in
            [(middle, 0.7, straight), (middle, 0.0, straight), (middle, 0.0, turned), (rim_point, 0.0, straight)]
        {
            let n = 2000_u32;
            let rim = |i: u32| {
                let (sin, cos) = (std::f64::consts::TAU * f64::from(i) / f64::from(n)).sin_cos();
                turn * DVec3::new(cos, sin, 0.0)
            };
            let points: Vec<DVec3> =
                std::iter::once(turn * (point + DVec3::Z * height)).chain((0..n).map(rim)).collect();
            let needles = (0..n).map(|i| [0, 1 + i, 1 + (i + 1) % n]).collect();
            let mesh = Mesh::from_f64(&points, needles).unwrap();
            let tree = NearestTree::build(&mesh, DVec3::ZERO);
            let (mut looked, queries) = (0, 300_u32);
            for i in 0..queries {
                let t = f64::from(i);
                // Half of them on the surface.
                let on = mesh.corners(i as usize * 5).map(|p| p.as_dvec3());
                let on = on[0] + (t * 0.37).fract() * (on[1] - on[0]) * 0.9 + 0.05 * (on[2] - on[0]);
                let off = DVec3::new((t * 0.37).sin(), (t * 0.71).cos(), (t * 0.13).sin());
                let point = if i % 2 == 0 { on } else { off };
                let expected = (0..mesh.triangles.len())
                    .map(|t| distance2_to_triangle(point, &mesh.corners(t).map(|p| p.as_dvec3())))
                    .fold(f64::INFINITY, f64::min);
                // Those inside the cone are about as far from all needles.
                let found = tree.search(point, &mut None, || looked += u32::from(i % 2 == 0));
                // Where many needles are as near as rounding can tell, any of them will do.
                assert!((found.sqrt() - expected.sqrt()).abs() < 1e-12, "{height} {i}: {found:e} {expected:e}");
            }
            let points = queries / 2;
            assert!(10 * looked < n * points, "{height}: {looked} triangles for {points} points, of {n} each");
        }
    }

    /// Triangles on one edge: the leaves of a book, of one near its back, and triangles that lie on each other in a plane.
    #[test]
    fn triangles_on_one_edge_are_looked_at_a_few_at_a_time() {
        let books: [(&str, fn(f64) -> DVec3); 4] = [
            ("a book", |t| DVec3::new(t.cos(), t.sin(), 0.5)),
            ("a thin book", |t| DVec3::new(0.01 * t.cos(), 0.01 * t.sin(), 0.5)),
            ("a plane", |t| DVec3::new(1.0 + 0.1 * t, 0.3 + 0.03 * t, 0.5)),
            ("a steep plane", |t| DVec3::new(0.2 + 0.02 * t, 0.9 - 0.05 * t, 0.3)),
        ];
        let turn = glam::DQuat::from_euler(glam::EulerRot::XYZ, 0.5, 0.9, 0.3);
        for (name, apex) in books {
            let looks = [4000_u32, 32_000].map(|n| {
                let apexes = (0..n).map(|i| apex(std::f64::consts::TAU * f64::from(i) / f64::from(n)));
                let points: Vec<DVec3> = [DVec3::ZERO, DVec3::Z].into_iter().chain(apexes).map(|p| turn * p).collect();
                let mesh = Mesh::from_f64(&points, (0..n).map(|i| [0, 1, 2 + i]).collect()).unwrap();
                let tree = NearestTree::build(&mesh, DVec3::ZERO);
                let (mut looks, queries) = (0, 500_usize);
                for i in 0..queries {
                    let t = i as f64;
                    // Half of them on the surface, the others a little off it.
                    let [a, b, c] = mesh.corners(i * 7 % n as usize).map(|p| p.as_dvec3());
                    let (u, v) = ((t * 0.37).fract(), (t * 0.71).fract());
                    let on = a + 0.5 * (u + v - u * v) * (b - a) + 0.5 * v * (c - a);
                    let point = if i % 2 == 0 { on } else { on + 1e-4 * (b - a).cross(c - a).normalize() };
                    let found = tree.search(point, &mut None, || looks += 1);
                    if i % 10 < 2 {
                        let expected = (0..mesh.triangles.len())
                            .map(|t| distance2_to_triangle(point, &mesh.corners(t).map(|p| p.as_dvec3())))
                            .fold(f64::INFINITY, f64::min);
                        let over = found.sqrt() - expected.sqrt();
                        assert!(
                            (-1e-12..=1e-12 + 1e-3 * expected.sqrt()).contains(&over),
                            "{name}: {over:e} over {expected:e}"
                        );
                    }
                }
                looks / queries
            });
            // Eight times as many triangles, and not twice the work.
            assert!(looks[1] <= 2 * looks[0] + 8, "{name}: {looks:?}");
        }
    }

    #[test]
    fn agrees_with_looking_at_every_triangle() {
        let mesh = procedural::displaced_sphere(&procedural::DisplacedSphere { frequency: 12, ..Default::default() });
        let tree = NearestTree::build(&mesh, DVec3::ZERO);
        let mut guess = None;
        for i in 0..300 {
            let t = f64::from(i);
            let point = DVec3::new((t * 0.37).sin(), (t * 0.71).cos(), (t * 0.13).sin()) * (0.2 + t * 0.01);
            let expected = (0..mesh.triangles.len())
                .map(|t| distance2_to_triangle(point, &mesh.corners(t).map(|p| p.as_dvec3())))
                .fold(f64::INFINITY, f64::min);
            let found = tree.nearest(point, &mut guess);
            assert!((found - expected).abs() <= 2.0 * PRECISION * expected, "{point}: {found:e} {expected:e}");
        }
    }
}
