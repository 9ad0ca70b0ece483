//! A priority queue for keys that never fall below the last one taken out.

/// Radix heap (Ahuja, Mehlhorn, Orlin and Tarjan 1990): a few array writes an entry, where a binary heap spends
/// a cache miss a level. Entries with equal keys come out in an order that depends only on the calls made.
#[derive(Debug)]
pub(super) struct MonotoneQueue {
    /// Bucket k > 0 holds keys whose highest bit different from `last` is bit k − 1; bucket 0 those equal to it.
    buckets: Vec<Vec<(u32, u32)>>,
    last: u32,
}

impl MonotoneQueue {
    pub fn new() -> Self {
        Self { buckets: vec![Vec::new(); 33], last: 0 }
    }

    /// Keys below the last one taken out count as equal to it.
    #[inline]
    pub fn push(&mut self, key: f32, item: u32) {
        debug_assert!(key >= 0.0, "keys must not be negative or NaN: {key}");
        // The bits of non-negative floats are in the order of their values.
        let key = key.to_bits().max(self.last);
        self.buckets[bucket(key, self.last)].push((key, item));
    }

    /// The key that [`Self::pop`] would give.
    pub fn least_key(&self) -> Option<f32> {
        let filled = self.buckets.iter().find(|bucket| !bucket.is_empty())?;
        filled.iter().map(|entry| f32::from_bits(entry.0)).min_by(f32::total_cmp)
    }

    /// The key in the middle of all entries.
    pub fn median_key(&self) -> Option<f32> {
        let mut keys: Vec<u32> = self.buckets.iter().flatten().map(|entry| entry.0).collect();
        let middle = keys.len() / 2;
        if keys.is_empty() { None } else { Some(f32::from_bits(*keys.select_nth_unstable(middle).1)) }
    }

    /// The entry with the least key.
    pub fn pop(&mut self) -> Option<(f32, u32)> {
        if self.buckets[0].is_empty() {
            let filled = self.buckets.iter().position(|bucket| !bucket.is_empty())?;
            let mut entries = std::mem::take(&mut self.buckets[filled]);
            self.last = entries.iter().map(|entry| entry.0).min()?;
            for entry in entries.drain(..) {
                self.buckets[bucket(entry.0, self.last)].push(entry);
            }
            // Keep the memory for later.
            self.buckets[filled] = entries;
        }
        self.buckets[0].pop().map(|(key, item)| (f32::from_bits(key), item))
    }
}

#[inline]
fn bucket(key: u32, last: u32) -> usize {
    (u32::BITS - (key ^ last).leading_zeros()) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cmp::Reverse;
    use std::collections::BinaryHeap;

    #[test]
    fn agrees_with_a_binary_heap_under_mixed_pushes_and_pops() {
        let mut queue = MonotoneQueue::new();
        let mut heap = BinaryHeap::new();
        let (mut state, mut last) = (7_u32, 0.0_f32);
        for i in 0..20_000 {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            if state >> 30 != 0 {
                let key = (last + (state >> 12 & 0xfff) as f32 * 0.37).max(last);
                queue.push(key, i);
                heap.push(Reverse(key.to_bits()));
            } else {
                let expected = heap.pop().map(|Reverse(bits)| f32::from_bits(bits));
                let found = queue.pop().map(|(key, _)| key);
                assert_eq!(found, expected);
                last = found.unwrap_or(last);
            }
        }
    }

    #[test]
    fn a_key_below_the_last_comes_out_next() {
        let mut queue = MonotoneQueue::new();
        queue.push(5.0, 0);
        queue.push(9.0, 1);
        assert_eq!(queue.pop(), Some((5.0, 0)));
        queue.push(1.0, 2);
        assert_eq!(queue.pop(), Some((5.0, 2)));
        assert_eq!(queue.pop(), Some((9.0, 1)));
        assert_eq!(queue.pop(), None);
    }
}
