//! The primitives of a tree that take part in a query: those whose objects the scene still has.

use crate::geometry::Aabb;

/// The primitives of a tree that belong to objects of the scene.
#[derive(Debug)]
pub(super) struct PresentPrimitives {
    /// Bounds of all of them.
    pub bounds: Aabb,
    /// One bit per primitive.
    bits: Vec<u64>,
}

impl PresentPrimitives {
    /// - `n`: number of primitives of the tree.
    /// - `bounds`: those of the primitives that take part.
    /// - `ranges`: the first one and the number of those of each object.
    pub fn new(n: usize, bounds: Aabb, ranges: impl Iterator<Item = (usize, usize)>) -> Self {
        let mut bits = vec![0u64; n.div_ceil(64)];
        for (first, count) in ranges {
            let (mut prim, end) = (first, first + count);
            while prim < end {
                let n = (64 - prim % 64).min(end - prim);
                bits[prim / 64] |= (u64::MAX >> (64 - n)) << (prim % 64);
                prim += n;
            }
        }
        Self { bounds, bits }
    }

    /// Whether a primitive takes part; the index of an empty lane of a block takes none.
    #[inline]
    pub fn has(&self, prim: u32) -> bool {
        self.bits.get(prim as usize / 64).is_some_and(|bits| bits >> (prim % 64) & 1 != 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_what_is_present() {
        let present =
            PresentPrimitives::new(300, Aabb::EMPTY, [(0, 1), (5, 60), (64, 0), (66, 128), (299, 1)].into_iter());
        for prim in 0..400 {
            let expected = prim == 0 || (5..65).contains(&prim) || (66..194).contains(&prim) || prim == 299;
            assert_eq!(present.has(prim), expected, "{prim}");
        }
        assert!(!present.has(u32::MAX >> 1));
    }
}
