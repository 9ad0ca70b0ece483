//! Durations of the latest occurrences of an event.

use std::collections::VecDeque;
use std::time::Duration;

/// The latest thousand durations, for quantiles.
#[derive(Clone, Debug, Default)]
pub struct LatencyHistogram(VecDeque<Duration>);

impl LatencyHistogram {
    /// Approximately a minute of continuous motion.
    const KEPT: usize = 1000;

    /// Adds a duration; beyond a thousand the oldest is dropped.
    pub fn add(&mut self, wait: Duration) {
        self.0.push_back(wait);
        if self.0.len() > Self::KEPT {
            self.0.pop_front();
        }
    }

    /// Number of stored durations.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether there are no durations.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns the quantile of the durations at `share`, 0..1; `None` if there are none.
    pub fn quantile(&self, share: f64) -> Option<Duration> {
        let mut sorted: Vec<Duration> = self.0.iter().copied().collect();
        sorted.sort_unstable();
        let last = sorted.len().checked_sub(1)?;
        Some(sorted[((share * sorted.len() as f64) as usize).min(last)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_of_the_latest() {
        let mut waits = LatencyHistogram::default();
        assert!(waits.is_empty() && waits.quantile(0.5).is_none());
        for ms in 0..3000 {
            waits.add(Duration::from_millis(ms));
        }
        assert_eq!(waits.len(), 1000);
        let ms = |share| waits.quantile(share).unwrap().as_millis();
        assert_eq!([ms(0.0), ms(0.5), ms(0.99), ms(1.0)], [2000, 2500, 2990, 2999]);
    }
}
