//! How far detail in the light of a place is to be doubted.
//!
//! Where few samples are bright, windows differ by far more than noise with their variance would make them: what looks
//! like detail is one bright sample more or less. How far that is so shows in the variances of the pixels around: the
//! mean of their squares is far above the square of their mean. And light has detail mostly where surfaces have some:
//! at edges and where things touch. On a smooth wall, a spot would be seen best, and is least likely.

use crate::denoise::blur::{Pooled, blur};
use crate::denoise::input::{DenoiseInput, OTHER_NEARNESS, OTHER_NORMAL};
use crate::denoise::parallel::{Stop, each};

/// Scatter of the variances of normal noise, and how much more of it is the noise of few bright samples.
const NORMAL_SCATTER: f32 = 3.0;
const SCATTER_OF_RARE: f32 = 5.0;
/// Doubt on an even surface, relative to that at an edge.
const ON_EVEN_SURFACES: f32 = 10.0;
/// Squared difference of albedos that makes an edge, besides those that make another surface.
const OTHER_ALBEDO: f32 = 0.01;
/// Radius in pixels of the two box filters that find edges around a pixel, and the share of pixels at edges from which
/// on a surface is not even.
const RADIUS: usize = 3;
const SHARE_AT_EDGES: f32 = 0.125;

/// Mean square of variances over the square of their mean, in narrow neighbourhoods: 3 or less for normal noise, and
/// some 50 with one bright sample in a neighbourhood; `None` if `stop` returned true.
pub(super) fn scatter(variance: &[f32], pooled: &Pooled, stop: Stop) -> Option<Vec<f32>> {
    let mean = pooled.narrow(&|i| variance[i], stop)?;
    let squares = pooled.narrow(&|i| variance[i] * variance[i], stop)?;
    pooled.wide(&|i| squares[i].max(0.0) / (mean[i] * mean[i]).max(1e-30), stop)
}

/// By how many times the evidence for detail must be larger than for normal noise, less one, from `scatter`: 0 to
/// [`ON_EVEN_SURFACES`]; `None` if `stop` returned true.
pub(super) fn doubt(input: &DenoiseInput, scatter: &[f32], stop: Stop) -> Option<Vec<f32>> {
    let guides = &input.guides;
    let near = guides.nearness(stop)?;
    let (n, width, height) = (input.n_pixels(), input.width, input.height);
    let edges = each(n, stop, |i| {
        let differs = |other: usize| {
            let normals = guides.normal[i].distance_squared(guides.normal[other]) / OTHER_NORMAL;
            let albedos = guides.albedo[i].distance_squared(guides.albedo[other]) / OTHER_ALBEDO;
            normals + albedos + ((near[i] - near[other]) / OTHER_NEARNESS).powi(2)
        };
        let right = if i % width + 1 < width { differs(i + 1) } else { 0.0 };
        let below = if i / width + 1 < height { differs(i + width) } else { 0.0 };
        (right + below).min(1.0)
    })?;
    let around = blur(&edges, width, height, RADIUS, stop)?;
    each(n, stop, |i| {
        let rare = ((scatter[i] - NORMAL_SCATTER) / SCATTER_OF_RARE).clamp(0.0, 1.0);
        let even = (1.0 - around[i] / SHARE_AT_EDGES).max(0.0);
        rare * (1.0 + (ON_EVEN_SURFACES - 1.0) * even)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::denoise::Guides;
    use glam::Vec3;

    /// Two walls that meet at the middle column.
    #[test]
    fn detail_is_doubted_on_even_surfaces_and_only_where_samples_are_rare() {
        const WIDTH: usize = 64;
        const N: usize = WIDTH * 48;
        let normal: Vec<Vec3> = (0..N).map(|i| if i % WIDTH < WIDTH / 2 { Vec3::X } else { Vec3::Z }).collect();
        let guides = Guides {
            albedo: &[Vec3::splat(0.7); N],
            emitted: &[Vec3::ZERO; N],
            normal: &normal,
            depth: &[3.0; N],
            emitters: &[false; N],
        };
        let input = DenoiseInput { width: WIDTH, height: 48, color: &[Vec3::ONE; N], half_steps: None, guides };
        let pooled = Pooled::of(&input, guides.emitters, &|| false).unwrap();
        let at = |variance: &dyn Fn(usize) -> f32, column: usize| {
            let variance: Vec<f32> = (0..N).map(variance).collect();
            let scatter = scatter(&variance, &pooled, &|| false).unwrap();
            doubt(&input, &scatter, &|| false).unwrap()[24 * WIDTH + column]
        };
        let even = |_: usize| 1.0;
        let rare = |i: usize| if i.is_multiple_of(37) { 1.0 } else { 1e-3 };
        assert_eq!([at(&even, 8), at(&even, 31)], [0.0, 0.0]);
        assert_eq!([at(&rare, 8), at(&rare, 56)], [ON_EVEN_SURFACES; 2]);
        assert_eq!(at(&rare, 31), 1.0);
    }
}
