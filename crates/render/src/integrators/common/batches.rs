//! Number of light paths per image, and their division into batches.

/// Maximum number of paths per batch.
const MAX_BATCH: u32 = 4096;

/// Division of the light paths of one sample of the whole image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Batches {
    pub per_sample: u32,
    /// Paths per batch.
    pub size: u32,
}

impl Batches {
    /// - `stride`: camera paths per light path, at least 1.
    pub fn of_film(n_pixels: usize, stride: u32) -> Self {
        let n_paths = (n_pixels as f64 / f64::from(stride)).ceil();
        let per_sample = (n_paths / f64::from(MAX_BATCH)).ceil();
        Self { per_sample: per_sample as u32, size: (n_paths / per_sample).ceil() as u32 }
    }

    pub fn paths_per_sample(&self) -> f64 {
        f64::from(self.per_sample) * f64::from(self.size)
    }

    pub fn of_sample(&self, sample: u32) -> u64 {
        u64::from(sample) * u64::from(self.per_sample)
    }
}
