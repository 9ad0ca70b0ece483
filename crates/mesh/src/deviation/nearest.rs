//! Nearest point of a mesh: a bounding volume hierarchy, searched near side first.
//!
//! Nodes have axis-aligned bounds. Where these are mostly empty, as for a fan of needles, nodes have oriented bounds as
//! well (as in OBB trees, Gottschalk, Lin and Manocha 1996): a point in the axis-aligned bounds of all needles lies in
//! the oriented bounds of a few.
//!
//! Distances are accurate to rounding. Where thousands of triangles share an edge or coincide, only rounding decides
//! which of them is the nearest; instead of testing each, the search accepts the first. Where thousands are about
//! equally near, the distance is accurate to a thousandth ([`MAX_PRECISE_STEPS`]).

use crate::Mesh;
use glam::{DMat3, DVec3};
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Triangles per leaf.
const LEAF: usize = 4;

#[derive(Debug)]
pub(super) struct NearestTree {
    nodes: Vec<BoxNode>,
    frames: Vec<BoxFrame>,
    /// In leaf order.
    triangles: Vec<[DVec3; 3]>,
    /// Bound on the error of distances to triangles and to bounds, metres.
    rounding: f64,
}

/// Relative tolerance of a squared distance, in addition to rounding.
const PRECISION: f64 = 1e-12;

/// Visited nodes after which [`COARSE_PRECISION`] replaces [`PRECISION`].
const MAX_PRECISE_STEPS: usize = 1024;
const COARSE_PRECISION: f64 = 2e-3;

#[derive(Clone, Copy, Debug)]
struct BoxNode {
    min: DVec3,
    max: DVec3,
    /// Inner node: index of the second child (the first is the next node). Leaf: first triangle.
    link: u32,
    /// 0 for an inner node.
    count: u32,
    /// Index of an oriented box that is much smaller, or `NONE`.
    frame: u32,
}

const NONE: u32 = u32::MAX;

/// An oriented box.
#[derive(Clone, Copy, Debug)]
struct BoxFrame {
    /// Rows are the unit axes.
    axes: DMat3,
    center: DVec3,
    /// Extent along the axes, relative to the centre.
    min: DVec3,
    max: DVec3,
}

impl NearestTree {
    /// Builds the tree.
    ///
    /// - `offset`: added to the mesh's positions.
    pub fn build(mesh: &Mesh, offset: DVec3) -> Self {
        let mut triangles: Vec<[DVec3; 3]> =
            (0..mesh.triangles.len()).map(|t| mesh.corners(t).map(|p| p.as_dvec3() + offset)).collect();
        if triangles.is_empty() {
            return Self { nodes: Vec::new(), frames: Vec::new(), triangles, rounding: 0.0 };
        }
        let NearestBranch { nodes, frames, .. } = build(&mut triangles, 0);
        let largest = nodes[0].min.abs().max(nodes[0].max.abs()).max_element();
        Self { nodes, frames, triangles, rounding: 64.0 * f64::EPSILON * largest }
    }

    /// Returns the squared distance to the nearest point, accurate to rounding; infinite for an empty mesh.
    ///
    /// - `guess`: the nearest triangle of a point close by, if known; replaced by that of this point.
    pub fn nearest(&self, point: DVec3, guess: &mut Option<u32>) -> f64 {
        self.search(point, guess, || ())
    }

    /// Searches depth first, which is fast for short searches; a longer search continues best first. Where large bounds
    /// contain the point but nothing near it, depth-first search would visit everything in them.
    ///
    /// - `visit`: called for each triangle that is tested.
    #[inline(always)]
    fn search(&self, point: DVec3, guess: &mut Option<u32>, mut visit: impl FnMut()) -> f64 {
        const DEPTH_FIRST: usize = 128;
        let Some(root) = self.nodes.first() else { return f64::INFINITY };
        let best = guess.map_or(f64::INFINITY, |t| distance2_to_triangle(point, &self.triangles[t as usize]));
        let mut found = NearestSoFar { best, precision: PRECISION, limit: self.limit(best, PRECISION), guess };
        // Splits halve the count, so 64 levels suffice for any mesh.
        let mut stack = [OpenNode { bound: 0.0, node: 0 }; 64];
        stack[0] = OpenNode { bound: distance2_to_box(point, root), node: 0 };
        let (mut top, mut steps) = (1, 0);
        while top > 0 && steps < DEPTH_FIRST {
            top -= 1;
            let open = stack[top];
            if open.bound >= found.limit {
                continue;
            }
            steps += 1;
            if let Some([near, far]) = self.step(point, open.node, &mut found, &mut visit) {
                stack[top] = far;
                stack[top + 1] = near;
                top += 2;
            }
        }
        if top > 0 {
            self.search_best_first(point, BinaryHeap::from(stack[..top].to_vec()), &mut found, &mut visit);
        }
        found.best
    }

    /// Continues the search best first.
    #[cold]
    fn search_best_first(
        &self,
        point: DVec3,
        mut open: BinaryHeap<OpenNode>,
        found: &mut NearestSoFar,
        visit: &mut impl FnMut(),
    ) {
        let mut steps = 0;
        while let Some(next) = open.pop()
            && next.bound < found.limit
        {
            steps += 1;
            if steps == MAX_PRECISE_STEPS {
                found.precision = COARSE_PRECISION;
            }
            let children = self.step(point, next.node, found, visit);
            open.extend(children.into_iter().flatten().filter(|child| child.bound < found.limit));
        }
    }

    /// Tests the triangles of a leaf, or returns the children of an inner node, the nearer one first.
    #[inline(always)]
    fn step(
        &self,
        point: DVec3,
        index: u32,
        found: &mut NearestSoFar,
        visit: &mut impl FnMut(),
    ) -> Option<[OpenNode; 2]> {
        let node = &self.nodes[index as usize];
        if node.count == 0 {
            let child = |node: u32| OpenNode { bound: self.bound(point, &self.nodes[node as usize]), node };
            let [left, right] = [child(index + 1), child(node.link)];
            return Some(if left.bound <= right.bound { [left, right] } else { [right, left] });
        }
        for t in node.link..node.link + node.count {
            visit();
            let distance2 = distance2_to_triangle(point, &self.triangles[t as usize]);
            if distance2 < found.best {
                (found.best, *found.guess) = (distance2, Some(t));
            }
        }
        found.limit = self.limit(found.best, found.precision);
        None
    }
}

/// State of a search: the nearest point so far.
struct NearestSoFar<'a> {
    /// Squared distance.
    best: f64,
    /// Relative tolerance of `best`.
    precision: f64,
    /// Squared distance from which on nodes contain nothing nearer.
    limit: f64,
    guess: &'a mut Option<u32>,
}

/// A pending node. The ordering makes the nearest the greatest; of equals, the first.
#[derive(Clone, Copy, Debug)]
struct OpenNode {
    bound: f64,
    node: u32,
}

impl Ord for OpenNode {
    fn cmp(&self, other: &Self) -> Ordering {
        other.bound.total_cmp(&self.bound).then(other.node.cmp(&self.node))
    }
}

impl PartialOrd for OpenNode {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for OpenNode {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for OpenNode {}

impl NearestTree {
    /// Returns the squared distance from which on a node contains nothing that is nearer than `best` by more than
    /// rounding and the relative tolerance.
    #[inline(always)]
    fn limit(&self, best: f64, precision: f64) -> f64 {
        let nearer = (best.sqrt() - self.rounding).max(0.0);
        nearer * nearer * (1.0 - precision)
    }

    /// Returns a lower bound on the squared distance to the triangles below a node.
    #[inline(always)]
    fn bound(&self, point: DVec3, node: &BoxNode) -> f64 {
        let straight = distance2_to_box(point, node);
        if node.frame == NONE { straight } else { straight.max(self.frames[node.frame as usize].distance2(point)) }
    }
}

/// A subtree, depth first.
struct NearestBranch {
    nodes: Vec<BoxNode>,
    frames: Vec<BoxFrame>,
    /// Doubled area of all triangles.
    area: f64,
}

/// Builds nodes over `triangles`, which are reordered; `first` is the index of the first of them.
fn build(triangles: &mut [[DVec3; 3]], first: u32) -> NearestBranch {
    let corners = triangles.iter().flatten();
    let (min, max) = corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), &p| (min.min(p), max.max(p)));
    let count = triangles.len();
    let node = BoxNode { min, max, link: first, count: count as u32, frame: NONE };
    let mut branch = if count <= LEAF {
        let area = triangles.iter().map(|[a, b, c]| (*b - *a).cross(*c - *a).length()).sum();
        NearestBranch { nodes: vec![node], frames: Vec::new(), area }
    } else {
        // The axis along which the centres vary most, not the corners: parallel needles are long along another axis.
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
    // A typical surface needs no oriented box: only one whose area is much smaller than a face of its bounds (needles)
    // or much larger (the pages of a book).
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

/// Size of the bounds of the centres, times three.
fn extent_of_centers(triangles: &[[DVec3; 3]]) -> DVec3 {
    let centers = triangles.iter().map(|[a, b, c]| *a + *b + *c);
    let (min, max) = centers.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), p| (min.min(p), max.max(p)));
    max - min
}

fn join(node: BoxNode, left: NearestBranch, right: NearestBranch) -> NearestBranch {
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
    NearestBranch { nodes, frames, area: left.area + right.area }
}

impl BoxFrame {
    /// Builds a box along the longest edge of the middle triangle and in its plane; `None` if that triangle is
    /// degenerate.
    fn around(triangles: &[[DVec3; 3]], center: DVec3) -> Option<Self> {
        let [a, b, c] = triangles[triangles.len() / 2];
        let longest =
            [b - a, c - b, a - c].into_iter().max_by(|p, q| p.length_squared().total_cmp(&q.length_squared()));
        let along = longest?.try_normalize()?;
        let normal = (b - a).cross(c - a);
        // Done twice, so that the axes are orthogonal to rounding even for a needle.
        let normal = (normal - along * along.dot(normal)).try_normalize()?;
        let normal = (normal - along * along.dot(normal)).try_normalize()?;
        let axes = DMat3::from_cols(along, normal, along.cross(normal)).transpose();
        let places = triangles.iter().flatten().map(|&p| axes * (p - center));
        let (min, max) = places.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), p| (min.min(p), max.max(p)));
        Some(Self { axes, center, min, max })
    }

    /// Half the surface area.
    fn area(&self) -> f64 {
        let DVec3 { x, y, z } = self.max - self.min;
        x * y + y * z + z * x
    }

    fn volume(&self) -> f64 {
        (self.max - self.min).element_product()
    }

    /// Squared distance of a point to the box.
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

/// Tests the Voronoi regions of corners, edges and face in turn (Ericson 2005, "Real-Time Collision Detection", 5.1.5).
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

    /// Needles from one point in all directions: a cone, a disc, a rotated disc.
    #[test]
    fn agrees_with_looking_at_every_needle_and_looks_at_few() {
        let turned = glam::DQuat::from_euler(glam::EulerRot::XYZ, 0.5, 0.9, 0.3);
        let straight = glam::DQuat::IDENTITY;
        // In the last case the common point lies on the circle.
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
            let (mut visited, queries) = (0, 300_u32);
            for i in 0..queries {
                let t = f64::from(i);
                // Half of the points lie on the surface.
                let on = mesh.corners(i as usize * 5).map(|p| p.as_dvec3());
                let on = on[0] + (t * 0.37).fract() * (on[1] - on[0]) * 0.9 + 0.05 * (on[2] - on[0]);
                let off = DVec3::new((t * 0.37).sin(), (t * 0.71).cos(), (t * 0.13).sin());
                let point = if i % 2 == 0 { on } else { off };
                let expected = (0..mesh.triangles.len())
                    .map(|t| distance2_to_triangle(point, &mesh.corners(t).map(|p| p.as_dvec3())))
                    .fold(f64::INFINITY, f64::min);
                // Points inside the cone are about equally far from all needles.
                let found = tree.search(point, &mut None, || visited += u32::from(i % 2 == 0));
                // Where many needles are equally near to rounding, any of them is right.
                assert!((found.sqrt() - expected.sqrt()).abs() < 1e-12, "{height} {i}: {found:e} {expected:e}");
            }
            let points = queries / 2;
            assert!(10 * visited < n * points, "{height}: {visited} triangles for {points} points, of {n} each");
        }
    }

    /// Triangles on one edge: the pages of a book, those of a book near its spine, and coincident triangles in a plane.
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
            let visits = [4000_u32, 32_000].map(|n| {
                let apexes = (0..n).map(|i| apex(std::f64::consts::TAU * f64::from(i) / f64::from(n)));
                let points: Vec<DVec3> = [DVec3::ZERO, DVec3::Z].into_iter().chain(apexes).map(|p| turn * p).collect();
                let mesh = Mesh::from_f64(&points, (0..n).map(|i| [0, 1, 2 + i]).collect()).unwrap();
                let tree = NearestTree::build(&mesh, DVec3::ZERO);
                let (mut visits, queries) = (0, 500_usize);
                for i in 0..queries {
                    let t = i as f64;
                    // Half of the points lie on the surface, the others slightly off it.
                    let [a, b, c] = mesh.corners(i * 7 % n as usize).map(|p| p.as_dvec3());
                    let (u, v) = ((t * 0.37).fract(), (t * 0.71).fract());
                    let on = a + 0.5 * (u + v - u * v) * (b - a) + 0.5 * v * (c - a);
                    let point = if i % 2 == 0 { on } else { on + 1e-4 * (b - a).cross(c - a).normalize() };
                    let found = tree.search(point, &mut None, || visits += 1);
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
                visits / queries
            });
            // Eight times as many triangles must take less than twice the work.
            assert!(visits[1] <= 2 * visits[0] + 8, "{name}: {visits:?}");
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
