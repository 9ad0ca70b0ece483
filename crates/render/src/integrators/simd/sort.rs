//! Hits sorted by kind of material, so that consecutive hits take the same branches.

use crate::core::material::MaterialId;
use crate::prepare::layer_table::LAYERED_RICHLY;
use crate::prepare::material_table::{Kinds, SEVERAL};
use crate::prepare::prepared::Prepared;
use crate::shading::vertex::material_of;
use firstlight_kdtree::HitBatch;
use firstlight_simd::{Bits, InstructionSet, LANES, Mask, Simd, dispatch};

/// Number of kinds of hits: misses, and those of materials.
pub(crate) const KINDS: usize = LAYERED_RICHLY + 2;

/// The hits of a wave, sorted.
#[derive(Default)]
pub(crate) struct SortedHits {
    /// The material of each hit.
    pub materials: Vec<MaterialId>,
    order: [Vec<u32>; KINDS],
    counts: [usize; KINDS],
}

impl SortedHits {
    /// Indices of the hits of a kind, ascending.
    pub fn of_kind(&self, kind: usize) -> &[u32] {
        &self.order[kind][..self.counts[kind]]
    }

    /// Sorts the first `n` hits.
    pub fn sort(&mut self, set: InstructionSet, scene: &Prepared, kinds: &Kinds, hits: &HitBatch, n: usize) {
        for array in self.order.iter_mut().chain([&mut self.materials]) {
            if array.len() < n + LANES {
                array.resize(n + LANES, 0);
            }
        }
        self.counts = [0; KINDS];
        let sorted = self;
        dispatch!(set, sort(sorted: &mut SortedHits, scene: &Prepared, kinds: &Kinds, hits: &HitBatch, n: usize));
    }
}

#[inline(always)]
fn sort<S: Simd>(s: S, sorted: &mut SortedHits, scene: &Prepared, kinds: &Kinds, hits: &HitBatch, n: usize) {
    let table = &scene.tables.materials;
    let lane_numbers = Bits::load(s, &std::array::from_fn(|lane| lane as u32));
    for first in (0..n).step_by(LANES) {
        let count = (n - first).min(LANES);
        let mask = if count == LANES { Mask::MAX } else { (1 << count) - 1 };
        let object = match hits.object[first..n].first_chunk() {
            Some(objects) => Bits::load(s, objects),
            None => {
                let mut objects = [HitBatch::MISS; LANES];
                objects[..count].copy_from_slice(&hits.object[first..n]);
                Bits::load(s, &objects)
            }
        };
        let missed = object.equals(HitBatch::MISS);
        let mut material = Bits::gather(&table.of_object, object);
        let several = mask & !missed & material.equals(SEVERAL);
        if several != 0 {
            let mut materials = material.to_array();
            for (lane, material) in materials.iter_mut().enumerate() {
                if several >> lane & 1 != 0
                    && let Some(hit) = hits.get(first + lane)
                {
                    *material = material_of(scene, &hit);
                }
            }
            material = Bits::load(s, &materials);
        }
        material.store(sorted.materials[first..].first_chunk_mut().expect("room for all lanes"));
        let kind = Bits::gather(&kinds.of_material, material);
        let index = lane_numbers + first as u32;
        for k in 0..KINDS {
            let lanes = match k {
                0 => mask & missed,
                _ if kinds.present >> (k - 1) & 1 == 0 => continue,
                _ => mask & !missed & kind.equals(k as u32 - 1),
            };
            let at = sorted.counts[k];
            index.compress(lanes).store(sorted.order[k][at..].first_chunk_mut().expect("room for all lanes"));
            sorted.counts[k] = at + lanes.count_ones() as usize;
        }
    }
}
