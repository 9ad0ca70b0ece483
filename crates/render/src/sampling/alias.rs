//! Sampling of discrete distributions in constant time.

/// Samples index `i` with probability proportional to its weight (Walker 1977, Vose 1991).
#[derive(Clone, Debug, Default)]
pub struct AliasTable {
    bins: Vec<Bin>,
}

#[derive(Clone, Copy, Debug)]
struct Bin {
    /// Below it the bin's own index is selected, above it the alias.
    threshold: f32,
    alias: u32,
    pmf: f32,
}

impl AliasTable {
    /// Creates a table for non-negative weights. If all are zero, every index is equally likely; those that are beyond all
    /// numbers, or none, count as the largest.
    pub fn new(weights: &[f64]) -> Self {
        let n = weights.len();
        debug_assert!(weights.iter().all(|w| !(*w < 0.0)));
        // Of such, the sum is a number too.
        let most = f64::MAX / (2.0 * n.max(1) as f64);
        let weights: Vec<f64> = weights.iter().map(|w| w.min(most)).collect();
        let sum: f64 = weights.iter().sum();
        let pmf: Vec<f64> = weights.iter().map(|w| if sum > 0.0 { w / sum } else { 1.0 / n as f64 }).collect();
        let mut bins: Vec<_> =
            pmf.iter().enumerate().map(|(i, &p)| Bin { threshold: 1.0, alias: i as u32, pmf: p as f32 }).collect();
        let mut scaled: Vec<f64> = pmf.iter().map(|p| p * n as f64).collect();
        let (mut small, mut large): (Vec<usize>, Vec<usize>) = (0..n).partition(|&i| scaled[i] < 1.0);
        while let (Some(&s), Some(&l)) = (small.last(), large.last()) {
            small.pop();
            bins[s].threshold = scaled[s] as f32;
            bins[s].alias = l as u32;
            scaled[l] -= 1.0 - scaled[s];
            if scaled[l] < 1.0 {
                large.pop();
                small.push(l);
            }
        }
        // The remaining bins differ from 1 by rounding only; but a weight of zero must never be selected.
        for i in small {
            if pmf[i] == 0.0
                && let Some(other) = pmf.iter().position(|&p| p > 0.0)
            {
                bins[i].threshold = 0.0;
                bins[i].alias = other as u32;
            }
        }
        Self { bins }
    }

    /// Samples an index; returns it, its probability, and `u` rescaled to `[0, 1)`.
    #[inline]
    pub fn sample(&self, u: f32) -> (u32, f32, f32) {
        let n = self.bins.len();
        let scaled = u * n as f32;
        let i = (scaled as usize).min(n - 1);
        let rest = (scaled - i as f32).min(1.0f32.next_down());
        let bin = self.bins[i];
        let (index, fresh) = if rest < bin.threshold {
            (i as u32, rest / bin.threshold)
        } else {
            (bin.alias, (rest - bin.threshold) / (1.0 - bin.threshold))
        };
        (index, self.bins[index as usize].pmf, fresh.clamp(0.0, 1.0f32.next_down()))
    }

    /// Probability of an index, which must be below [`Self::len`].
    #[inline]
    pub fn pmf(&self, index: u32) -> f32 {
        self.bins[index as usize].pmf
    }

    /// Number of indices.
    pub fn len(&self) -> usize {
        self.bins.len()
    }

    /// Whether there are no indices.
    pub fn is_empty(&self) -> bool {
        self.bins.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frequencies_follow_the_weights() {
        let weights = [0.0, 3.0, 1.0, 0.0, 0.5, 12.0, 1e-3];
        let table = AliasTable::new(&weights);
        let sum: f64 = weights.iter().sum();
        let n = 1 << 20;
        let mut counts = [0u32; 7];
        for i in 0..n {
            let (index, pmf, fresh) = table.sample((i as f32 + 0.5) / n as f32);
            counts[index as usize] += 1;
            assert_eq!(pmf, table.pmf(index));
            assert!((0.0..1.0).contains(&fresh));
        }
        for (i, &w) in weights.iter().enumerate() {
            // Uniformly spaced u: deviates by rounding at bin borders only.
            let expected = w / sum * f64::from(n);
            assert!((f64::from(counts[i]) - expected).abs() < 4.0, "index {i}: {} for {expected}", counts[i]);
        }
    }

    #[test]
    fn weights_beyond_all_numbers_are_the_largest() {
        let table = AliasTable::new(&[1.0, f64::INFINITY, f64::NAN, 0.0]);
        assert_eq!([0, 1, 2, 3].map(|index| table.pmf(index)), [0.0, 0.5, 0.5, 0.0]);
    }

    #[test]
    fn what_is_left_of_u_is_even() {
        let table = AliasTable::new(&[0.2, 0.5, 0.3]);
        let n = 1 << 16;
        let mut counts = [0u32; 16];
        for i in 0..n {
            let (_, _, fresh) = table.sample((i as f32 + 0.5) / n as f32);
            counts[(fresh * 16.0) as usize] += 1;
        }
        assert!(counts.iter().all(|&c| c.abs_diff(n / 16) < 64), "{counts:?}");
    }

    #[test]
    fn all_zero_weights_are_even() {
        let table = AliasTable::new(&[0.0; 4]);
        assert!((0..4).all(|i| table.pmf(i) == 0.25));
    }
}
