//! A priority queue by levels of cost, for keys that are not below the last one popped.

use super::surface::NONE;

/// A queue by levels. A level is an octave: of two keys in one level, the larger is less than twice the smaller. For
/// squared distances that is a factor of √2; narrower levels cost more time than their lower error is worth
/// (docs/simplification.md).
///
/// An item is in the queue at most once, so lists through an array of links suffice: two writes per entry, and no
/// search. A level is first in, first out, which also spreads steps of equal cost over the surface.
#[derive(Debug)]
pub(super) struct LevelQueue {
    /// First and last item of each level.
    ends: Vec<[u32; 2]>,
    /// The next item of each item in its level.
    next: Vec<u32>,
    /// All lower levels are empty.
    level: usize,
}

/// The bits of non-negative floats are in the order of their values; those of the mantissa are dropped.
const DROPPED_BITS: u32 = 23;
const LEVELS: usize = (f32::INFINITY.to_bits() >> DROPPED_BITS) as usize + 1;

impl LevelQueue {
    /// Creates a queue for items below `items`.
    pub fn new(items: usize) -> Self {
        Self { ends: vec![[NONE; 2]; LEVELS], next: vec![NONE; items], level: 0 }
    }

    /// Returns the least key of the level of `key`, which must be a non-negative number.
    #[inline]
    pub fn floor(key: f32) -> f32 {
        floor_of(level_of(key))
    }

    /// Adds an item. A key below the level of the last one popped counts as of that level.
    ///
    /// - `item`: must not be in the queue.
    #[inline]
    pub fn push(&mut self, key: f32, item: u32) {
        debug_assert!(key >= 0.0, "keys must not be negative or NaN: {key}");
        let ends = &mut self.ends[level_of(key).max(self.level)];
        self.next[item as usize] = NONE;
        match ends[0] {
            NONE => ends[0] = item,
            _ => self.next[ends[1] as usize] = item,
        }
        ends[1] = item;
    }

    /// Removes an item of the lowest level; returns it with the least key of that level.
    #[inline]
    pub fn pop(&mut self) -> Option<(f32, u32)> {
        let key = self.least_key()?;
        let ends = &mut self.ends[self.level];
        let item = ends[0];
        ends[0] = self.next[item as usize];
        Some((key, item))
    }

    /// The key that [`Self::pop`] would return.
    #[inline]
    pub fn least_key(&mut self) -> Option<f32> {
        self.level = (self.level..LEVELS).find(|&level| self.ends[level][0] != NONE)?;
        Some(floor_of(self.level))
    }

    /// The least key of the level of the median item.
    pub fn median_key(&self) -> Option<f32> {
        let counts: Vec<usize> = self.ends.iter().map(|ends| self.items_from(ends[0]).count()).collect();
        let middle = counts.iter().sum::<usize>() / 2;
        let mut below = 0;
        let is_middle = |count: &usize| {
            below += count;
            below > middle
        };
        counts.iter().position(is_middle).map(floor_of)
    }

    fn items_from(&self, first: u32) -> impl Iterator<Item = u32> {
        let some = |item: u32| Some(item).filter(|&item| item != NONE);
        std::iter::successors(some(first), move |&item| some(self.next[item as usize]))
    }
}

#[inline]
fn level_of(key: f32) -> usize {
    (key.to_bits() >> DROPPED_BITS) as usize
}

#[inline]
fn floor_of(level: usize) -> f32 {
    f32::from_bits((level as u32) << DROPPED_BITS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_looking_at_every_entry_under_mixed_pushes_and_pops() {
        let mut queue = LevelQueue::new(20_000);
        let mut plain: Vec<(u32, usize, u32)> = Vec::new();
        let (mut state, mut last) = (7_u32, 0.0_f32);
        for i in 0..20_000 {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            if state >> 30 != 0 && i < 15_000 {
                let key = last + (state >> 12 & 0xfff) as f32 * 0.37;
                queue.push(key, i);
                plain.push((LevelQueue::floor(key).to_bits(), i as usize, i));
            } else {
                // Least level first, and within it first in, first out.
                let expected = plain.iter().min().copied();
                plain.retain(|entry| Some(*entry) != expected);
                let found = queue.pop();
                assert_eq!(found, expected.map(|(bits, _, item)| (f32::from_bits(bits), item)));
                last = found.map_or(last, |(key, _)| key);
            }
        }
    }

    #[test]
    fn a_key_below_the_last_comes_out_next() {
        let mut queue = LevelQueue::new(3);
        queue.push(5.0, 0);
        queue.push(9.0, 1);
        assert_eq!(queue.median_key(), Some(8.0));
        assert_eq!(queue.pop(), Some((4.0, 0)));
        queue.push(1.0, 2);
        assert_eq!(queue.pop(), Some((4.0, 2)));
        assert_eq!(queue.pop(), Some((8.0, 1)));
        assert_eq!(queue.pop(), None);
    }

    #[test]
    fn a_level_is_less_than_an_octave_wide() {
        for key in [0.0, f32::MIN_POSITIVE, 1e-9, 0.3, 1.0, 1.9999, 7e20, f32::MAX] {
            let floor = LevelQueue::floor(key);
            assert!(floor <= key && (key == 0.0 || key / floor < 2.0), "{key}: {floor}");
        }
    }
}
