//! Assignment of sample dimensions on a camera path.

/// Number of dimensions of the camera; those of the vertices follow.
pub(crate) const CAMERA_DIMENSIONS: u32 = 2;
/// Number of dimensions per vertex.
const VERTEX_DIMENSIONS: u32 = 5;
pub(crate) const DIM_LIGHT_POINT: u32 = 0;
pub(crate) const DIM_DIRECTION: u32 = 1;
pub(crate) const DIM_LIGHT: u32 = 2;
pub(crate) const DIM_LOBE: u32 = 3;
pub(crate) const DIM_ROULETTE: u32 = 4;

/// Dimension of the channel to which dispersion limits a path, beyond those of all vertices.
pub(crate) const DIM_CHANNEL: u32 = u32::MAX - 1;

/// Dimensions of the choice among light samples, of the roulette of shadow rays and of chains, one each per vertex, beyond
/// those of all vertices.
const FIRST_OF_RESAMPLING: u32 = 1 << 30;
const FIRST_OF_SHADOW_ROULETTE: u32 = FIRST_OF_RESAMPLING + (1 << 29);
const FIRST_OF_CHAINS: u32 = FIRST_OF_SHADOW_ROULETTE + (1 << 28);

/// Returns the dimension that chooses among light samples at the end of segment `depth`.
pub(crate) fn resampling_dimension(depth: u32) -> u32 {
    FIRST_OF_RESAMPLING + depth
}

/// Returns the dimension of the roulette of the shadow ray from the end of segment `depth`.
pub(crate) fn shadow_roulette_dimension(depth: u32) -> u32 {
    FIRST_OF_SHADOW_ROULETTE + depth
}

/// Returns the dimension of the search for chains from the end of segment `depth`.
pub(crate) fn chain_dimension(depth: u32) -> u32 {
    FIRST_OF_CHAINS + depth
}

/// Returns the first dimension of the vertex at the end of segment `depth`.
pub(crate) fn first_dimension(depth: u32) -> u32 {
    CAMERA_DIMENSIONS + (depth - 1) * VERTEX_DIMENSIONS
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sampler;

    /// What a choice and a point find together has the same noise everywhere, and not more in blocks whose pixels all have
    /// the same order of the two.
    #[test]
    fn choices_are_as_noisy_in_all_parts_of_the_screen() {
        const SIDE: u32 = 64;
        let first = first_dimension(1);
        for (choice, point) in [(DIM_LIGHT, DIM_LIGHT_POINT), (DIM_LOBE, DIM_DIRECTION)] {
            let finds = |sampler: Sampler| sampler.single(first + choice) < 0.5 && sampler.pair(first + point).x < 0.5;
            let square = |x: u32, y: u32| {
                let found = (0..12).filter(|sample| finds(Sampler::of_pixel(3, x, y, *sample))).count();
                (found as f64 / 12.0 - 0.25).powi(2)
            };
            let of_block =
                |block: u32| (0..SIDE * SIDE).map(|i| square(block * SIDE + i % SIDE, i / SIDE)).sum::<f64>();
            let blocks: Vec<f64> = (0..40).map(of_block).collect();
            let mean = blocks.iter().sum::<f64>() / blocks.len() as f64;
            assert!(blocks.iter().all(|of_block| (0.8..1.25).contains(&(of_block / mean))), "{mean}: {blocks:?}");
        }
    }
}
