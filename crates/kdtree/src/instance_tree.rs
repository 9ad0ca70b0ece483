//! Kd-tree over the bounds of objects that have their own tree, used when there are many of them.

use super::build::{LeafMaker, build};
use super::mesh_tree::BuildPreset;
use super::nodes::KdNodes;
use super::ray::TreeRay;
use super::reference::{BuildConfig, Primitives};
use crate::geometry::{Aabb, Ray, Shear};
use glam::Vec3;

#[derive(Debug)]
pub(super) struct InstanceTree {
    pub nodes: KdNodes,
    /// The largest side of the bounds.
    pub extent: f32,
    /// Indices into `objects`, leaf after leaf.
    leaf_places: Vec<u32>,
    objects: Vec<u32>,
    boxes: Vec<Aabb>,
}

/// The entry of a ray into the bounds of an instance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    pub t: f32,
    pub object: u32,
}

/// The objects tested last, so that an object that spans many cells is not tested in each of them.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Recent {
    /// Object index plus 1; 0 for an empty slot.
    objects: [u32; 8],
}

impl Recent {
    #[inline]
    pub fn is_new(&mut self, object: u32) -> bool {
        let slot = &mut self.objects[object as usize % 8];
        std::mem::replace(slot, object + 1) != object + 1
    }
}

/// Entries that a query collects at a time: most rays end before they need more.
const ENTRIES: usize = 4;

impl InstanceTree {
    /// Builds the tree.
    ///
    /// - `boxes`: bounds of all objects of the scene.
    /// - `objects`: indices of those in the tree.
    pub fn build(boxes: &[Aabb], objects: Vec<u32>) -> Self {
        let boxes: Vec<Aabb> = objects.iter().map(|&object| boxes[object as usize]).collect();
        let config = BuildConfig { exact_below: 8, block_cost: 4.0, max_growth: 2.0, ..BuildPreset::Best.config(1) };
        let (nodes, leaf_places) = build(&Boxes(&boxes), &config, &Places);
        Self { extent: nodes.extent(), nodes, leaf_places, objects, boxes }
    }

    /// Returns the objects of a leaf.
    pub fn leaf(&self, first: u32, count: u32) -> impl Iterator<Item = u32> {
        self.leaf_places[first as usize..][..count as usize].iter().map(|&place| self.objects[place as usize])
    }

    /// Appends some of the boxes that the ray enters within `from..=t_max`, nearest first. Returns the `t` from which
    /// the next call resumes; infinity when there are no more.
    ///
    /// - `recent`: objects in it are skipped; new ones are added.
    pub fn entries(&self, ray: &Ray, from: f32, t_max: f32, recent: &mut Recent, entries: &mut Vec<Entry>) -> f32 {
        let first = entries.len();
        let tree_ray = TreeRay::new(ray.origin, ray.dir, &Shear::new(ray.dir), self.extent);
        let mut resume = f32::INFINITY;
        let visit = |begin, count, end| {
            for &place in &self.leaf_places[begin as usize..][..count as usize] {
                let object = self.objects[place as usize];
                if recent.is_new(object) {
                    let (t, last) = tree_ray.clip(&self.boxes[place as usize], t_max);
                    if t <= last {
                        entries.push(Entry { t, object });
                    }
                }
            }
            // A cell without extent along the ray does not guarantee progress.
            if entries.len() - first >= ENTRIES && end > from {
                resume = end;
                return f32::NEG_INFINITY;
            }
            t_max
        };
        self.nodes.walk_cells(&tree_ray, from, t_max, visit, || ());
        entries[first..].sort_unstable_by(|a, b| a.t.total_cmp(&b.t));
        resume
    }
}

/// Leaves are ranges of `leaf_places`.
struct Places;

impl LeafMaker for Places {
    type Leaves = Vec<u32>;

    fn make(&self, places: &mut Vec<u32>, leaf: &[u32]) -> (u32, u32) {
        let first = places.len() as u32;
        places.extend_from_slice(leaf);
        (first, leaf.len() as u32)
    }

    fn with_room_for(&self, parts: &[&Vec<u32>]) -> Vec<u32> {
        Vec::with_capacity(parts.iter().map(|part| part.len()).sum())
    }

    fn add_part(&self, places: &mut Vec<u32>, mut part: Vec<u32>) -> impl Fn(u32) -> u32 {
        let n_before = places.len() as u32;
        places.append(&mut part);
        move |first| first + n_before
    }
}

struct Boxes<'a>(&'a [Aabb]);

impl Primitives for Boxes<'_> {
    fn len(&self) -> usize {
        self.0.len()
    }

    fn bounds(&self, prim: u32) -> Aabb {
        self.0[prim as usize]
    }

    fn clipped(&self, _: u32, _: usize, _: f32, _: bool, _: f32) -> Option<Aabb> {
        Some(Aabb { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY })
    }
}
