//! Statistics of a tree for reports, and the invariants that tests check.

use super::MeshTree;
use super::leaf::BLOCK;
use super::mesh_tree::BLOCK_COST;
use super::nodes::{KdNodes, Node};
use crate::geometry::Aabb;
use glam::Vec3;

/// Statistics of one tree.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct KdTreeStats {
    /// Triangles of the mesh, including those without area.
    pub primitives: usize,
    /// Nodes with two children.
    pub inner_nodes: usize,
    /// Leaves with at least one primitive.
    pub leaves: usize,
    /// Leaves without primitives.
    pub empty_leaves: usize,
    /// Depth of the deepest leaf; the root has depth 0.
    pub depth: usize,
    /// Entries in leaves; a primitive in several cells counts several times.
    pub references: usize,
    /// Blocks of up to sixteen primitives, which are tested together.
    pub blocks: usize,
    /// Memory of nodes and blocks, bytes.
    pub bytes: usize,
    /// Mean number of inner nodes that an unobstructed line through the bounds crosses.
    pub expected_inner_visits: f64,
    /// Mean number of non-empty leaves that such a line crosses.
    pub expected_leaf_visits: f64,
    /// Mean number of blocks in the leaves that such a line crosses.
    pub expected_block_tests: f64,
}

impl KdTreeStats {
    /// Mean number of leaf entries per primitive.
    pub fn references_per_primitive(&self) -> f64 {
        self.references as f64 / self.primitives.max(1) as f64
    }

    /// Expected cost of an unobstructed line through the bounds, in visits of an inner node: the quantity that the
    /// surface area heuristic minimises.
    pub fn sah_cost(&self) -> f64 {
        self.expected_inner_visits + f64::from(BLOCK_COST) * self.expected_block_tests
    }
}

impl MeshTree {
    /// Computes statistics of the tree and the costs that the surface area heuristic expects.
    pub fn stats(&self) -> KdTreeStats {
        let mut stats = KdTreeStats {
            primitives: self.n_triangles(),
            blocks: self.blocks().n_blocks(),
            bytes: self.blocks().bytes(),
            ..KdTreeStats::default()
        };
        let root_area = f64::from(self.blocks().nodes.bounds.area());
        self.blocks().nodes.visit_cells(&mut |node, cell, depth| {
            let share = if root_area > 0.0 { f64::from(cell.area()) / root_area } else { 1.0 };
            stats.depth = stats.depth.max(depth);
            match node {
                Node::Inner { .. } => {
                    stats.inner_nodes += 1;
                    stats.expected_inner_visits += share;
                }
                Node::Leaf { count: 0, .. } => stats.empty_leaves += 1,
                Node::Leaf { first, count } => {
                    stats.leaves += 1;
                    stats.references += self.blocks().leaf(first, count).prims().count();
                    stats.expected_leaf_visits += share;
                    stats.expected_block_tests += share * f64::from(count);
                }
            }
        });
        stats
    }

    /// Checks that every triangle with an area, or an earlier copy of it, is in every leaf whose cell it passes
    /// through.
    ///
    /// # Panics
    /// If one is not.
    pub fn check_invariants(&self) {
        let mut seen = vec![false; self.n_triangles()];
        self.blocks().nodes.visit_cells(&mut |node, cell, _| {
            assert!(!cell.is_empty(), "a cell inside out: {cell:?}");
            if let Node::Leaf { first, count } = node {
                let leaf = self.blocks().leaf(first, count);
                let prims: Vec<u32> = leaf.prims().collect();
                assert!(prims.is_sorted_by(|a, b| a < b), "not ascending: {prims:?}");
                assert_eq!(prims.len().div_ceil(BLOCK), leaf.n_blocks(), "blocks that could be saved");
                for &prim in &prims {
                    seen[prim as usize] = true;
                    let around = Aabb::from_points(self.vertices(prim));
                    assert!(!around.intersection(*cell).is_empty(), "triangle {prim} is not in {cell:?}");
                }
            }
        });
        let bits = |prim| self.vertices(prim).map(|vertex| vertex.to_array().map(f32::to_bits));
        let is_copy = |prim, other| other < prim && bits(other) == bits(prim);
        let mut shapes = std::collections::HashSet::new();
        for (prim, seen) in (0u32..).zip(seen) {
            // A later copy may be in no leaf: the first copy is checked instead.
            if !shapes.insert(bits(prim)) && !seen {
                continue;
            }
            // In f64 these points are exact.
            let [a, b, c] = self.vertices(prim).map(Vec3::as_dvec3);
            let points = [a, b, c, (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0, (a + b + 2.0 * c) / 4.0];
            if a == b || b == c || c == a {
                continue;
            }
            assert!(seen, "triangle {prim} is in no leaf");
            for point in points {
                assert!(
                    self.blocks().nodes.some_leaf_at(point.to_array(), |first, count| {
                        self.blocks().leaf(first, count).prims().any(|other| other == prim || is_copy(prim, other))
                    }),
                    "triangle {prim} is missing at {point}"
                );
            }
        }
    }
}

impl KdNodes {
    pub(super) fn visit_cells(&self, visit: &mut impl FnMut(Node, &Aabb, usize)) {
        if !self.bounds.is_empty() {
            self.visit_cell(0, self.bounds, 0, visit);
        }
    }

    fn visit_cell(&self, index: u32, cell: Aabb, depth: usize, visit: &mut impl FnMut(Node, &Aabb, usize)) {
        let node = self.nodes[index as usize].unpack();
        visit(node, &cell, depth);
        if let Node::Inner { axis, split, first_child } = node {
            let (mut below, mut above) = (cell, cell);
            below.max[axis] = split;
            above.min[axis] = split;
            self.visit_cell(first_child, below, depth + 1, visit);
            self.visit_cell(first_child + 1, above, depth + 1, visit);
        }
    }

    /// Whether `test` holds for any of the leaves whose closed cells contain the point.
    fn some_leaf_at(&self, point: [f64; 3], test: impl Fn(u32, u32) -> bool) -> bool {
        let mut stack = vec![0];
        while let Some(index) = stack.pop() {
            match self.nodes[index as usize].unpack() {
                Node::Inner { axis, split, first_child } => {
                    if point[axis] <= f64::from(split) {
                        stack.push(first_child);
                    }
                    if point[axis] >= f64::from(split) {
                        stack.push(first_child + 1);
                    }
                }
                Node::Leaf { first, count } if test(first, count) => return true,
                Node::Leaf { .. } => {}
            }
        }
        false
    }
}
