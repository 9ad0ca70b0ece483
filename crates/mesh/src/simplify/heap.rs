//! A priority queue over the items 0..n whose keys may increase and decrease.

/// Indexed binary heap: least key first, ties by the smaller item.
#[derive(Debug)]
pub(super) struct IndexedHeap {
    heap: Vec<u32>,
    /// Index of each item in `heap`, or `ABSENT`.
    place: Vec<u32>,
    keys: Vec<f32>,
}

const ABSENT: u32 = u32::MAX;

impl IndexedHeap {
    pub fn new(items: usize) -> Self {
        Self { heap: Vec::new(), place: vec![ABSENT; items], keys: vec![0.0; items] }
    }

    /// Inserts `item` or changes its key. The key must not be NaN.
    pub fn set(&mut self, item: u32, key: f32) {
        self.keys[item as usize] = key;
        if self.place[item as usize] == ABSENT {
            self.place[item as usize] = self.heap.len() as u32;
            self.heap.push(item);
        }
        let at = self.place[item as usize] as usize;
        self.sift_up(at);
        self.sift_down(self.place[item as usize] as usize);
    }

    /// Removes `item` if present.
    pub fn remove(&mut self, item: u32) {
        let at = std::mem::replace(&mut self.place[item as usize], ABSENT);
        if at == ABSENT {
            return;
        }
        let Some(moved) = self.heap.pop() else { return };
        if moved != item {
            self.heap[at as usize] = moved;
            self.place[moved as usize] = at;
            self.sift_up(at as usize);
            self.sift_down(self.place[moved as usize] as usize);
        }
    }

    pub fn peek(&self) -> Option<(f32, u32)> {
        self.heap.first().map(|&item| (self.keys[item as usize], item))
    }

    fn less(&self, i: usize, j: usize) -> bool {
        let (p, q) = (self.heap[i], self.heap[j]);
        (self.keys[p as usize], p) < (self.keys[q as usize], q)
    }

    fn swap(&mut self, i: usize, j: usize) {
        self.heap.swap(i, j);
        self.place[self.heap[i] as usize] = i as u32;
        self.place[self.heap[j] as usize] = j as u32;
    }

    fn sift_up(&mut self, mut i: usize) {
        while i > 0 && self.less(i, (i - 1) / 2) {
            self.swap(i, (i - 1) / 2);
            i = (i - 1) / 2;
        }
    }

    fn sift_down(&mut self, mut i: usize) {
        loop {
            let mut least = i;
            for child in [2 * i + 1, 2 * i + 2] {
                if child < self.heap.len() && self.less(child, least) {
                    least = child;
                }
            }
            if least == i {
                return;
            }
            self.swap(i, least);
            i = least;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_looking_at_every_key() {
        let mut heap = IndexedHeap::new(50);
        let mut plain: Vec<Option<f32>> = vec![None; 50];
        let mut state = 1_u32;
        for _ in 0..5_000 {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let item = (state >> 8) % 50;
            if state >> 30 == 0 {
                heap.remove(item);
                plain[item as usize] = None;
            } else {
                let key = ((state >> 16) % 23) as f32;
                heap.set(item, key);
                plain[item as usize] = Some(key);
            }
            let least = (0..50_u32)
                .filter_map(|i| plain[i as usize].map(|key| (key, i)))
                .min_by(|p, q| p.partial_cmp(q).expect("keys are numbers"));
            assert_eq!(heap.peek(), least);
        }
    }
}
