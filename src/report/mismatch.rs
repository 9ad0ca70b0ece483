//! Detects references that do not show the scene.
//!
//! If they show the same scene, the difference of two images is noise of either, with mean zero. Over a square of many
//! pixels noise adds up slowly: for differences that are independent between pixels and symmetric, of any size,
//! P(|Σd| > k √Σd²) ≤ 2 exp(−k²/2) (Efron 1969, from Hoeffding's inequality for random signs). Differences due to
//! another scene, camera, exposure or light add up in full, and more samples do not remove them. A square counts as
//! foreign if its sum exceeds that bound and a tenth of its own light. Images of the same scene almost never fail this
//! test, and noisy references, which raise √Σd² as well, are safe.

use crate::report::{LinearPicture, RELATIVE_FLOOR};
use glam::DVec3;

/// Pixels along a square.
const SIDE: usize = 16;

/// Factor of √Σd²: 2 exp(−32) is one square in 4·10¹³; if the noise of ten neighbours is correlated (wide filters), one
/// in a hundred.
const SIGMAS: f64 = 8.0;

/// Least relative difference of a foreign square: smaller differences are invisible.
const MIN_DIFFERENCE: f64 = 0.1;

/// Fewest pixels of a square: for smaller pieces, at the border, √Σd² alone is as large as a foreign difference.
const MIN_PIXELS: f64 = 2.0 * SIGMAS * SIGMAS;

/// Share of foreign squares from which a reference is reported as showing something else.
const MIN_FOREIGN_SHARE: f64 = 0.05;

/// The share of squares of 16 × 16 pixels in which `picture` differs from `reference` by more than noise can, 0..1.
///
/// Both have the same size; 0 for images smaller than half a square.
pub fn foreign_share(picture: &LinearPicture, reference: &LinearPicture) -> f64 {
    let (width, height) = (picture.width as usize, picture.height as usize);
    let (mut squares, mut foreign) = (0_u32, 0_u32);
    for top in (0..height).step_by(SIDE) {
        for left in (0..width).step_by(SIDE) {
            let (mut sum, mut squared, mut light, mut n) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO, 0.0);
            for y in top..(top + SIDE).min(height) {
                for x in left..(left + SIDE).min(width) {
                    let truth = reference.pixels[y * width + x].as_dvec3();
                    let difference = picture.pixels[y * width + x].as_dvec3() - truth;
                    sum += difference;
                    squared += difference * difference;
                    light += truth;
                    n += 1.0;
                }
            }
            if n < MIN_PIXELS {
                continue;
            }
            let level = ((light / n) * (light / n) + RELATIVE_FLOOR).map(f64::sqrt);
            let is_foreign =
                sum.abs().cmpgt(SIGMAS * squared.map(f64::sqrt)) & (sum.abs() / n).cmpgt(MIN_DIFFERENCE * level);
            squares += 1;
            foreign += u32::from(is_foreign.any());
        }
    }
    f64::from(foreign) / f64::from(squares.max(1))
}

/// Whether the share of foreign squares means that the reference shows something else.
pub fn is_another_scene(foreign_share: f64) -> bool {
    foreign_share >= MIN_FOREIGN_SHARE
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    /// Pseudo-random number in 0..1.
    fn random(i: u32, seed: u32) -> f32 {
        let mut x = i.wrapping_mul(0x9e37_79b9) ^ seed.wrapping_mul(0x85eb_ca6b);
        x = (x ^ x >> 16).wrapping_mul(0x7feb_352d);
        x = (x ^ x >> 15).wrapping_mul(0x846c_a68b);
        (x ^ x >> 16) as f32 / 4_294_967_296.0
    }

    fn picture(value: impl Fn(f32, f32, u32) -> f32) -> LinearPicture {
        let (width, height) = (100, 60);
        let pixels = (0..width * height).map(|i| {
            let (x, y) = ((i % width) as f32 / width as f32, (i / width) as f32 / height as f32);
            Vec3::splat(value(x, y, i))
        });
        LinearPicture { width, height, pixels: pixels.collect() }
    }

    fn scene(x: f32, y: f32) -> f32 {
        0.2 + x + if y > 0.5 { 0.5 } else { 0.0 }
    }

    #[test]
    fn noise_of_any_size_is_no_other_scene() {
        for seed in 0..20 {
            // Uniform noise, small and large, and noise concentrated in one pixel of fifty.
            for (size, rarity) in [(0.01, 1.0), (1.0, 1.0), (0.4, 0.02)] {
                let noisy = |seed: u32| {
                    picture(|x, y, i| {
                        let is_hit = random(i, seed + 500) < rarity;
                        let noise = if is_hit { size / rarity * 2.0 * (random(i, seed) - 0.5) } else { 0.0 };
                        scene(x, y) * (1.0 + noise)
                    })
                };
                let share = foreign_share(&noisy(seed), &noisy(seed + 1000));
                assert_eq!(share, 0.0, "noise {size} in {rarity} of the pixels, seed {seed}");
            }
        }
    }

    #[test]
    fn other_scenes_are_told_from_noise() {
        let noise = |i: u32, seed: u32| 0.3 * (random(i, seed) - 0.5);
        let shown = picture(|x, y, i| scene(x, y) * (1.0 + noise(i, 1)));
        for (what, other) in [
            ("mirrored", picture(|x, y, i| scene(1.0 - x, y) * (1.0 + noise(i, 2)))),
            ("brighter by half", picture(|x, y, i| 1.5 * scene(x, y) * (1.0 + noise(i, 2)))),
            ("upside down", picture(|x, y, i| scene(x, 1.0 - y) * (1.0 + noise(i, 2)))),
            ("black", picture(|_, _, _| 0.0)),
        ] {
            let share = foreign_share(&shown, &other);
            assert!(is_another_scene(share), "{what}: {share}");
        }
    }
}
