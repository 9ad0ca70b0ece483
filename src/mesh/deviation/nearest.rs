//! The nearest point of a mesh: a tree of boxes, searched near side first.

use crate::mesh::Mesh;
use glam::DVec3;

/// Triangles a leaf.
const LEAF: usize = 4;

#[derive(Debug)]
pub(super) struct NearestTree {
    nodes: Vec<Node>,
    /// In the order of the leaves.
    triangles: Vec<[DVec3; 3]>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    min: DVec3,
    max: DVec3,
    /// Inner node: index of the second child (the first is the next node). Leaf: first triangle.
    link: u32,
    /// 0 for an inner node.
    count: u32,
}

impl NearestTree {
    /// - `offset`: added to the mesh's positions.
    pub fn build(mesh: &Mesh, offset: DVec3) -> Self {
        let mut triangles: Vec<[DVec3; 3]> =
            (0..mesh.triangles.len()).map(|t| mesh.corners(t).map(|p| p.as_dvec3() + offset)).collect();
        let nodes = if triangles.is_empty() { Vec::new() } else { build(&mut triangles, 0) };
        Self { nodes, triangles }
    }

    /// The squared distance to the nearest point; infinite for an empty mesh.
    ///
    /// - `guess`: the nearest triangle of a point close by, if known; set to this point's.
    pub fn nearest(&self, point: DVec3, guess: &mut Option<u32>) -> f64 {
        let Some(root) = self.nodes.first() else { return f64::INFINITY };
        let mut best = guess.map_or(f64::INFINITY, |t| distance2_to_triangle(point, &self.triangles[t as usize]));
        // Splits halve the count, so 64 levels hold any mesh.
        let mut stack = [(0.0, 0_u32); 64];
        stack[0] = (distance2_to_box(point, root), 0);
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let (bound, index) = stack[top];
            if bound >= best {
                continue;
            }
            let node = &self.nodes[index as usize];
            if node.count > 0 {
                for t in node.link..node.link + node.count {
                    let distance2 = distance2_to_triangle(point, &self.triangles[t as usize]);
                    if distance2 < best {
                        best = distance2;
                        *guess = Some(t);
                    }
                }
                continue;
            }
            let children = [index + 1, node.link].map(|i| (distance2_to_box(point, &self.nodes[i as usize]), i));
            let [near, far] = if children[0].0 <= children[1].0 { children } else { [children[1], children[0]] };
            stack[top] = far;
            stack[top + 1] = near;
            top += 2;
        }
        best
    }
}

/// Depth-first nodes over `triangles`, which are reordered; `first` is the number of the first of them.
fn build(triangles: &mut [[DVec3; 3]], first: u32) -> Vec<Node> {
    let corners = triangles.iter().flatten();
    let (min, max) = corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), &p| (min.min(p), max.max(p)));
    let count = triangles.len();
    if count <= LEAF {
        return vec![Node { min, max, link: first, count: count as u32 }];
    }
    let size = max - min;
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
    let shift = left.len() as u32 + 1;
    let mut nodes = Vec::with_capacity(left.len() + right.len() + 1);
    nodes.push(Node { min, max, link: shift, count: 0 });
    let moved = |by: u32| move |node: Node| if node.count == 0 { Node { link: node.link + by, ..node } } else { node };
    nodes.extend(left.into_iter().map(moved(1)));
    nodes.extend(right.into_iter().map(moved(shift)));
    nodes
}

#[inline]
fn distance2_to_box(point: DVec3, node: &Node) -> f64 {
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
    use crate::mesh::procedural;

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
            assert_eq!(tree.nearest(point, &mut guess), expected);
        }
    }
}
