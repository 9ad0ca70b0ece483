//! Descends a [`LightTree`] from sixteen points at once, each lane to its own light.
//!
//! The values are those of the scalar code, bit for bit. Nodes are numbered by level here: the first levels, which all
//! lanes pass, fit into registers.

use crate::prepare::light::tree::{LEAF, LightTree, NodeBound, step_down};
use firstlight_simd::{Bits, Float, LANES, Mask, Real, Simd, Vector, Word, padded, select};

#[derive(Debug, Default)]
pub(crate) struct LightTreeArrays {
    all: NodeRows,
    /// The first nodes.
    top: NodeRows,
    /// The path to each light, lower and upper half.
    ways: [Vec<u32>; 2],
    has_spots: bool,
}

/// Number of nodes that are looked up in registers.
const TOP: usize = 2 * LANES;

/// One entry per node; see `LightNode` of the tree.
#[derive(Debug, Default)]
struct NodeRows {
    center: [Vec<f32>; 3],
    radius: Vec<f32>,
    axis: [Vec<f32>; 3],
    widening: Vec<f32>,
    power: Vec<f32>,
    least_cos: Vec<f32>,
    link: Vec<u32>,
}

impl LightTreeArrays {
    pub fn new(tree: &LightTree) -> Self {
        // Node numbers of the tree, by level.
        let mut order = vec![0];
        let mut all = NodeRows::default();
        let mut next = 0;
        while let Some(&number) = order.get(next) {
            let node = &tree.nodes[number as usize];
            let mut link = node.link;
            if link < LEAF {
                link = order.len() as u32;
                order.extend([node.link, node.link + 1]);
            }
            for axis in 0..3 {
                all.center[axis].push(node.center[axis]);
                all.axis[axis].push(node.axis[axis]);
            }
            all.radius.push(node.radius);
            all.widening.push(node.widening);
            all.power.push(node.power);
            all.least_cos.push(node.least_cos);
            all.link.push(link);
            next += 1;
        }
        let half = |shift: u32| padded(tree.ways.iter().map(|way| (way >> shift) as u32).collect());
        let (top, ways) = (all.map(first_of, first_of), [half(0), half(32)]);
        Self { top, all: all.map(padded, padded), ways, has_spots: tree.has_spots }
    }

    /// See [`LightTree::sample`]: returns lights, their probabilities, and the lanes that some light can reach.
    #[inline(always)]
    pub fn sample<S: Simd>(
        &self,
        mask: Mask,
        position: Vector<S>,
        normal: Option<Vector<S>>,
        mut u: Float<S>,
    ) -> (Bits<S>, Float<S>, Mask) {
        let s = u.s;
        let (mut node, mut pmf) = (Bits::splat(s, self.all.link[0]), u.all(1.0));
        let (mut found, mut open) = (mask, mask & !node.has(LEAF));
        while open != 0 {
            let rows = self.rows(open, node);
            let first = rows.bounds(self.has_spots, node, position, normal);
            let second = rows.bounds(self.has_spots, node + 1, position, normal);
            let none = open & (first + second).is_zero();
            found &= !none;
            open &= !none;
            let (take, part, rest) = step_down([first, second], u);
            u = select(open, rest, u);
            pmf = select(open, pmf * part, pmf);
            node = rows.children(open, take, node);
            open &= !node.has(LEAF);
        }
        (node & !LEAF, pmf, found)
    }

    /// See [`LightTree::pmf`].
    #[inline(always)]
    pub fn pmf<S: Simd>(&self, mask: Mask, id: Bits<S>, position: Vector<S>, normal: Vector<S>) -> Float<S> {
        let s = id.s;
        let zero = Float::splat(s, 0.0);
        let (mut node, mut pmf) = (Bits::splat(s, self.all.link[0]), zero.all(1.0));
        let mut open = mask & !node.has(LEAF);
        let mut way = Bits::gather(&self.ways[0], id);
        let mut level = 0;
        while open != 0 {
            if level == 32 {
                way = Bits::gather(&self.ways[1], id);
            }
            let rows = self.rows(open, node);
            let first = rows.bounds(self.has_spots, node, position, Some(normal));
            let second = rows.bounds(self.has_spots, node + 1, position, Some(normal));
            let sum = first + second;
            let take = way.has(1);
            let none = open & sum.is_zero();
            pmf = select(open, pmf * (select(take, second, first) / sum), pmf);
            pmf = select(none, zero, pmf);
            open &= !none;
            node = rows.children(open, take, node);
            open &= !node.has(LEAF);
            way = way.shift_right(1);
            level += 1;
        }
        pmf
    }

    /// Returns the table that has the children of all open lanes.
    #[inline(always)]
    fn rows<S: Simd>(&self, open: Mask, node: Bits<S>) -> &NodeRows {
        let s = node.s;
        let near = s.lt_u(node.v, s.splat_u(TOP as u32 - 1));
        if open & !near == 0 { &self.top } else { &self.all }
    }
}

/// Returns the first [`TOP`] entries, padded to that number.
fn first_of<T: Copy + Default>(mut array: Vec<T>) -> Vec<T> {
    array.resize(TOP, T::default());
    array
}

impl NodeRows {
    fn map(&self, floats: fn(Vec<f32>) -> Vec<f32>, links: fn(Vec<u32>) -> Vec<u32>) -> Self {
        Self {
            center: self.center.clone().map(floats),
            radius: floats(self.radius.clone()),
            axis: self.axis.clone().map(floats),
            widening: floats(self.widening.clone()),
            power: floats(self.power.clone()),
            least_cos: floats(self.least_cos.clone()),
            link: links(self.link.clone()),
        }
    }

    /// See [`NodeBound::irradiance`].
    #[inline(always)]
    fn bounds<S: Simd>(
        &self,
        has_spots: bool,
        node: Bits<S>,
        position: Vector<S>,
        normal: Option<Vector<S>>,
    ) -> Float<S> {
        let bound = NodeBound {
            offset: Vector::gather(&self.center, node) - position,
            radius: Float::gather(&self.radius, node),
            axis: Vector::gather(&self.axis, node),
            widening: Float::gather(&self.widening, node),
            power: Float::gather(&self.power, node),
            least_cos: has_spots.then(|| Float::gather(&self.least_cos, node)),
        };
        bound.irradiance(normal)
    }

    /// Returns the next nodes of open lanes.
    #[inline(always)]
    fn children<S: Simd>(&self, open: Mask, second: Mask, node: Bits<S>) -> Bits<S> {
        let s = node.s;
        let child = Bits { s, v: s.select_u(second, (node + 1).v, node.v) };
        let below = Bits::gather(&self.link, child);
        Bits { s, v: s.select_u(open, below.v, node.v) }
    }
}
