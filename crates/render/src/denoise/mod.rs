//! Denoiser with an error estimate: a filter guided by feature buffers (`regression`), and a combination of raw and
//! filtered image that converges to the limit of the raw image (`combine`), with its error (`risk`).
//! For images that are shown for a moment there is a filter of a few milliseconds (`moving`).
//!
//! Pure functions of slices. Every pixel is a fixed sequence of operations, so the result depends neither on threads
//! nor on the instruction set. Start reading at [`denoise`].

mod blur;
mod combine;
mod comparison;
mod denoised;
mod doubt;
mod energy;
mod fit;
mod input;
mod limit;
mod moments;
mod moving;
mod noise;
mod parallel;
mod regression;
mod risk;
mod soften;

pub use denoised::Denoised;
pub use input::{DenoiseInput, Guides};
pub(crate) use moving::{APART, MARGIN, SmoothRow, divided_by};
pub use moving::{MovingFilter, MovingInput};

use glam::Vec3;
use parallel::Stop;

/// Denoises an image, on the current rayon pool; `None` if `stop`, which is called often, returned true.
///
/// # Panics
/// If the lists of the input do not have one entry per pixel.
pub fn denoise(input: &DenoiseInput, stop: Stop) -> Option<Denoised> {
    input.check();
    let regression::Regression { candidates, noise } = regression::regression(input, stop)?;
    let filtered = regression::pick(input, &candidates, &noise, stop)?;
    drop(candidates);
    combine::combine(input, &noise, &filtered, stop)
}

/// Like [`denoise`], with another filter in place of the regression: it gets the radiance of each pixel and returns the
/// filtered one, or `None`, and is called twice.
///
/// # Panics
/// If a list does not have one entry per pixel.
pub fn denoise_with(
    input: &DenoiseInput,
    filter: &mut dyn FnMut(&[Vec3]) -> Option<Vec<Vec3>>,
    stop: Stop,
) -> Option<Denoised> {
    input.check();
    let noise = regression::noise(input, stop)?;
    let filtered = noise.probed(input, filter, stop)?;
    combine::combine(input, &noise, &filtered, stop)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::halves::HalfSteps;
    use crate::sampling::{hash_combine, hash_u32};
    use glam::Vec2;

    const WIDTH: usize = 96;
    const HEIGHT: usize = 64;

    /// An image with a known reference and known features.
    struct Scene {
        truth: Vec<Vec3>,
        albedo: Vec<Vec3>,
        normal: Vec<Vec3>,
        depth: Vec<f32>,
        emitters: Vec<bool>,
    }

    /// The image and its half steps at a number of samples.
    struct Rendered {
        color: Vec<Vec3>,
        halves: HalfSteps,
    }

    impl Scene {
        /// - `of`: albedo and light of a pixel.
        fn of(of: impl Fn(usize, usize) -> (f32, Vec3)) -> Self {
            let pixels: Vec<(f32, Vec3)> = (0..WIDTH * HEIGHT).map(|i| of(i % WIDTH, i / WIDTH)).collect();
            Self {
                truth: pixels.iter().map(|(albedo, light)| *albedo * *light).collect(),
                albedo: pixels.iter().map(|(albedo, _)| Vec3::splat(*albedo)).collect(),
                normal: vec![Vec3::Z; pixels.len()],
                depth: vec![5.0; pixels.len()],
                emitters: vec![false; pixels.len()],
            }
        }

        /// - `noise`: standard deviation of one sample, relative to the reference.
        fn render(&self, spp: u32, noise: f32) -> Rendered {
            let normal = |pixel: usize, k: u32| {
                let number = |k: u32| {
                    let hash = hash_combine(hash_u32(pixel as u32), k);
                    (f64::from(hash) + 0.5) / (1u64 << 32) as f64
                };
                let u = [number(2 * k), number(2 * k + 1)];
                ((-2.0 * u[0].ln()).sqrt() * (std::f64::consts::TAU * u[1]).cos()) as f32
            };
            let deviation = noise / (spp as f32 / 2.0).sqrt();
            let half = |pixel: usize, which: u32| {
                let channel = |c: usize| self.truth[pixel][c] * (1.0 + deviation * normal(pixel, 3 * which + c as u32));
                Vec3::new(channel(0), channel(1), channel(2))
            };
            let halves: Vec<[Vec3; 2]> = (0..self.truth.len()).map(|i| [half(i, 0), half(i, 1)]).collect();
            Rendered {
                color: halves.iter().map(|[a, b]| 0.5 * (*a + *b)).collect(),
                halves: HalfSteps {
                    steps: halves.iter().map(|[a, b]| 0.5 * (*b - *a)).collect(),
                    late: vec![Vec3::ZERO; halves.len()],
                    doubled: vec![1.0; halves.len()],
                    calibration: 1.0,
                },
            }
        }

        fn denoise(&self, of: &Rendered, with_halves: bool) -> Denoised {
            let Self { albedo, normal, depth, emitters, .. } = self;
            let emitted = &vec![Vec3::ZERO; albedo.len()];
            let guides = Guides { albedo, emitted, normal, depth, emitters };
            let half_steps = with_halves.then_some(&of.halves);
            let input = DenoiseInput { width: WIDTH, height: HEIGHT, color: &of.color, half_steps, guides };
            denoise(&input, &|| false).expect("nothing stops it")
        }

        fn relative_mse(&self, colors: &[Vec3]) -> f64 {
            let of = |(color, truth): (&Vec3, &Vec3)| {
                let off = *color - *truth;
                f64::from((off * off / (*truth * *truth + 0.01)).element_sum())
            };
            colors.iter().zip(&self.truth).map(of).sum::<f64>() / (3 * colors.len()) as f64
        }
    }

    fn checker(x: usize, y: usize) -> f32 {
        if (x / 7 + y / 5).is_multiple_of(2) { 0.8 } else { 0.1 }
    }

    /// Illumination with a gradient, on a floor whose colours are in the features.
    fn floor() -> Scene {
        Scene::of(|x, y| {
            (checker(x, y), Vec3::new(1.0, 0.8, 0.6) * (0.5 + x as f32 / WIDTH as f32 + 0.3 * y as f32 / HEIGHT as f32))
        })
    }

    /// The edge of a shadow, which is in no feature.
    fn shadow() -> Scene {
        Scene::of(|x, y| {
            let lit = Vec2::new(x as f32, y as f32).dot(Vec2::new(0.8, 0.6)) > 50.0;
            (0.6, Vec3::splat(if lit { 1.0 } else { 0.2 }))
        })
    }

    #[test]
    fn even_light_on_a_textured_floor_loses_nearly_all_noise() {
        let scene = floor();
        for (spp, with_halves) in [(1, false), (4, true), (64, true)] {
            let rendered = scene.render(spp.max(2), if spp == 1 { 0.4 * 2.0_f32.sqrt() } else { 0.4 });
            let found = scene.denoise(&rendered, with_halves);
            let (raw, denoised) = (scene.relative_mse(&rendered.color), scene.relative_mse(&found.color));
            // A single sample has no variance estimate.
            let most = if with_halves { 0.04 } else { 0.06 };
            assert!(denoised < most * raw, "{spp} samples: {denoised} of {raw}");
        }
    }

    /// As when each half of its samples has a bright one: the pixel looks like detail, and those around it do not.
    #[test]
    fn what_one_pixel_shows_alone_gives_no_grains_to_its_neighbours() {
        let scene = Scene::of(|_, _| (0.6, Vec3::ONE));
        let mut rendered = scene.render(16, 0.4);
        let bright: Vec<usize> = (0..5).flat_map(|y| (0..7).map(move |x| (7 + 12 * y) * WIDTH + 9 + 12 * x)).collect();
        bright.iter().for_each(|&i| rendered.color[i] *= 2.5);
        let found = scene.denoise(&rendered, true);
        // How much of the noise of those around is left.
        let off = |colors: &[Vec3], i: usize| colors[i] - scene.truth[i];
        let around = |&i: &usize| [i - WIDTH, i + WIDTH, i - 2, i - 1, i + 1, i + 2];
        let neighbours: Vec<usize> = bright.iter().flat_map(around).collect();
        let sum = |of: &dyn Fn(usize) -> f32| neighbours.iter().map(|&i| f64::from(of(i))).sum::<f64>();
        let raw = sum(&|i| off(&rendered.color, i).length_squared());
        let left = sum(&|i| off(&rendered.color, i).dot(off(&found.color, i)));
        assert!(left < 0.25 * raw, "{left} of {raw}");
    }

    /// As on a surface that gains nothing from evenly spread samples, where the rest of the image does.
    #[test]
    fn a_gain_that_is_not_there_leaves_no_grains_and_hides_no_edge() {
        let without_gain = |scene: &Scene, spp: u32| {
            let mut rendered = scene.render(spp, 0.4);
            rendered.halves.calibration = 0.3;
            let found = scene.denoise(&rendered, true);
            scene.relative_mse(&found.color) / scene.relative_mse(&rendered.color)
        };
        for spp in [4, 16, 64] {
            let [even, edge] = [&floor(), &shadow()].map(|scene| without_gain(scene, spp));
            assert!(even < 0.2 && edge < 0.5, "{spp} samples: {even}, {edge} of the raw error");
        }
        let edge = without_gain(&shadow(), 4096);
        assert!(edge < 1.2, "{edge} of the raw error");
    }

    #[test]
    fn the_edge_of_a_shadow_stays_where_it_is() {
        let scene = shadow();
        for spp in [4, 16, 64, 256, 1024] {
            let rendered = scene.render(spp, 0.4);
            let found = scene.denoise(&rendered, true);
            let (raw, denoised) = (scene.relative_mse(&rendered.color), scene.relative_mse(&found.color));
            assert!(denoised < 0.35 * raw, "{spp} samples: {denoised} of {raw}");
            let at_edge = |colors: &[Vec3]| {
                let off = |i: usize| (colors[i] - scene.truth[i]).length_squared() / scene.truth[i].length_squared();
                let near = (0..WIDTH * HEIGHT).filter(|i| {
                    let place = Vec2::new((i % WIDTH) as f32, (i / WIDTH) as f32).dot(Vec2::new(0.8, 0.6));
                    (place - 50.0).abs() < 1.5
                });
                near.map(|i| f64::from(off(i))).sum::<f64>()
            };
            let (raw, denoised) = (at_edge(&rendered.color), at_edge(&found.color));
            // The variance estimate from few pixels is noisy: the edge itself is blurred until there are more samples.
            let most = if spp < 256 { 4.5 } else { 1.25 };
            assert!(denoised < most * raw, "{spp} samples, at the edge: {denoised} of {raw}");
        }
    }

    /// One of a hundred pixels has a sample that is brighter than all others by two orders of magnitude.
    #[test]
    fn fireflies_leave_neither_grains_nor_blotches() {
        let scene = floor();
        let mut rendered = scene.render(4, 0.4);
        for pixel in (0..WIDTH * HEIGHT).filter(|&pixel| hash_u32(pixel as u32).is_multiple_of(97)) {
            let half = Vec3::splat(50.0 * scene.truth[pixel].x);
            rendered.color[pixel] += half;
            rendered.halves.steps[pixel] += if pixel % 2 == 0 { half } else { -half };
        }
        let found = scene.denoise(&rendered, true);
        let (raw, denoised) = (scene.relative_mse(&rendered.color), scene.relative_mse(&found.color));
        assert!(raw > 20.0 && denoised < 2e-3 * raw, "{denoised} of {raw}");
        let bright = (0..WIDTH * HEIGHT).filter(|&i| found.color[i].x > 2.0 * scene.truth[i].x).count();
        assert_eq!(bright, 0, "grains");
    }

    /// Samples that came after the last doubling, one in a hundred of them bright.
    #[test]
    fn fireflies_after_the_last_doubling_leave_neither_grains_nor_blotches() {
        let scene = floor();
        let rendered = scene.render(4, 0.4);
        let Rendered { color: before, mut halves } = rendered;
        // Two more: the doubling has 2/3 of the samples.
        let more = scene.render(2, 0.4);
        halves.doubled.fill(2.0 / 3.0);
        for (pixel, before) in before.iter().enumerate() {
            // Other noise than that of the same pixel in the doubling.
            let from = (pixel + WIDTH / 2) % (WIDTH * HEIGHT);
            let noise = more.color[from] / scene.truth[from] * scene.truth[pixel];
            let firefly =
                if hash_u32(pixel as u32).is_multiple_of(97) { 50.0 * scene.truth[pixel] } else { Vec3::ZERO };
            halves.late[pixel] = (noise + firefly - *before) / 3.0;
        }
        let color = before.iter().zip(&halves.late).map(|(before, late)| *before + *late).collect();
        let rendered = Rendered { color, halves };
        let found = scene.denoise(&rendered, true);
        let (raw, denoised) = (scene.relative_mse(&rendered.color), scene.relative_mse(&found.color));
        assert!(raw > 1.0 && denoised < 3e-3 * raw, "{denoised} of {raw}");
        let bright = (0..WIDTH * HEIGHT).filter(|&i| found.color[i].x > 2.5 * scene.truth[i].x).count();
        assert_eq!(bright, 0, "grains");
    }

    /// One sample in eight carries all light: the limit takes an eighth of it away.
    #[test]
    fn light_from_rare_samples_is_given_back() {
        let scene = floor();
        let mut rendered = scene.render(2, 0.0);
        for pixel in 0..WIDTH * HEIGHT {
            let hits = [0, 1].map(|k| hash_combine(hash_u32(pixel as u32), k).is_multiple_of(8));
            let halves = hits.map(|hit| if hit { 8.0 * scene.truth[pixel] } else { Vec3::ZERO });
            rendered.color[pixel] = 0.5 * (halves[0] + halves[1]);
            rendered.halves.steps[pixel] = 0.5 * (halves[1] - halves[0]);
        }
        let found = scene.denoise(&rendered, true);
        let sum = |colors: &[Vec3]| colors.iter().map(|color| f64::from(color.element_sum())).sum::<f64>();
        let kept = sum(&found.color) / sum(&rendered.color);
        assert!((0.9..1.02).contains(&kept), "{kept}");
    }

    /// A wall whose samples are dark but for one in `one_in`, as in a room that a window lights: denoised, relative to
    /// the reference.
    fn denoised_wall(one_in: u32, spp: u32) -> Vec<f32> {
        let scene = Scene::of(|x, _| (0.8, Vec3::splat(1.0 + 0.3 * x as f32 / WIDTH as f32)));
        let sample = |pixel: usize, k: u32| {
            let is_bright = hash_combine(hash_u32(pixel as u32), k).is_multiple_of(one_in);
            if is_bright { 0.1 + 0.9 * one_in as f32 } else { 0.1 }
        };
        let mut rendered = scene.render(2, 0.0);
        for (pixel, truth) in scene.truth.iter().enumerate() {
            let mean = |samples: std::ops::Range<u32>| {
                let n = samples.len() as f32;
                *truth * samples.map(|k| sample(pixel, k)).sum::<f32>() / n
            };
            let halves = if spp == 1 { [mean(0..1); 2] } else { [mean(0..spp / 2), mean(spp / 2..spp)] };
            rendered.color[pixel] = 0.5 * (halves[0] + halves[1]);
            rendered.halves.steps[pixel] = 0.5 * (halves[1] - halves[0]);
        }
        let found = scene.denoise(&rendered, spp > 1).color;
        found.iter().zip(&scene.truth).map(|(found, truth)| found.x / truth.x).collect()
    }

    /// 99th percentile of the absolute difference of two images.
    fn most_of(a: &[f32], b: &[f32]) -> f32 {
        let mut off: Vec<f32> = a.iter().zip(b).map(|(a, b)| (a - b).abs()).collect();
        off.sort_by(f32::total_cmp);
        off[off.len() * 99 / 100]
    }

    #[test]
    fn rare_bright_samples_leave_no_spots_on_a_smooth_wall() {
        for spp in [1, 2, 4, 8, 16] {
            let wall = denoised_wall(4, spp);
            let most = most_of(&wall, &blur::blur(&wall, WIDTH, HEIGHT, 2, &|| false).unwrap());
            // With one sample per pixel the noise is known from the residuals only.
            let allowed = if spp == 1 { 0.15 } else { 0.1 };
            assert!(most < allowed, "{spp} samples: the 99th percentile of fine variation is {most}");
        }
    }

    /// Spots of the size of the smallest windows.
    #[test]
    fn small_windows_are_not_taken_for_a_bright_sample_more_or_less() {
        for (one_in, spp, allowed) in [(8, 2, 0.15), (12, 4, 0.15), (16, 8, 0.13), (32, 8, 0.18)] {
            let wall = denoised_wall(one_in, spp);
            let mean = |radius| blur::blur(&wall, WIDTH, HEIGHT, radius, &|| false).unwrap();
            let most = most_of(&mean(1), &mean(6));
            assert!(most < allowed, "one in {one_in}, {spp} samples: the 99th percentile of spots is {most}");
        }
    }

    /// Light that is unrelated to the features: every pixel has its own.
    #[test]
    fn what_no_filter_can_know_is_left_alone() {
        let number = |x: usize, y: usize| f64::from(hash_u32((y * WIDTH + x) as u32)) / f64::from(u32::MAX);
        let scene = Scene::of(|x, y| (0.5, Vec3::splat(0.7 + 0.6 * number(x, y) as f32)));
        for spp in [16, 256, 4096] {
            let rendered = scene.render(spp, 0.4);
            let found = scene.denoise(&rendered, true);
            let (raw, denoised) = (scene.relative_mse(&rendered.color), scene.relative_mse(&found.color));
            assert!(denoised < 1.02 * raw, "{spp} samples: {denoised} of {raw}");
        }
        let silent = scene.render(1 << 30, 0.0);
        assert_eq!(scene.denoise(&silent, true).color, silent.color, "without noise the raw picture is the result");
    }

    #[test]
    fn the_error_that_is_told_is_the_error() {
        let wild = Scene::of(|x, y| {
            let stripe = (x * x / 40 + y).is_multiple_of(3);
            (checker(x, y), Vec3::splat(if stripe { 1.0 } else { 0.5 }))
        });
        for (name, scene) in [("shadow", shadow()), ("stripes", wild)] {
            for spp in [16, 64] {
                let rendered = scene.render(spp, 0.6);
                let found = scene.denoise(&rendered, true);
                let ratio = found.error / scene.relative_mse(&found.color).sqrt();
                // Noise of bright samples hides more bias than normal noise does, and is allowed for.
                assert!((0.8..1.3).contains(&ratio), "{name} at {spp} samples: {ratio}");
            }
        }
    }

    /// Around the focus of a caustic, the fewer samples are bright the further away, and they are 60 to 1200 times as
    /// bright as the light there. Windows without any of them seem to have no noise.
    #[test]
    fn bright_samples_around_a_caustic_leave_no_steps() {
        let probability = |pixel: usize| {
            let off = Vec2::new((pixel % WIDTH) as f32 - 40.0, (pixel / WIDTH) as f32 - 30.0);
            0.05 * (-off.length() / 5.0).exp()
        };
        let scene = Scene::of(|x, y| (0.5, Vec3::splat(0.5 + 90.0 * probability(y * WIDTH + x))));
        let sample = |pixel: usize, k: u32| {
            let hash = hash_combine(hash_u32(pixel as u32), k);
            let diffuse = 0.5 + 0.2 * ((hash & 255) as f32 / 255.0 - 0.5);
            let is_bright = (hash as f32) < probability(pixel) * 2.0_f32.powi(32);
            let brightness = 30.0 / ((hash_u32(hash) >> 16) as f32 / 65536.0 + 0.05);
            0.5 * (diffuse + if is_bright { brightness } else { 0.0 })
        };
        for spp in [16, 64, 256] {
            let mut rendered = scene.render(2, 0.0);
            for pixel in 0..WIDTH * HEIGHT {
                let n = spp / 2;
                let half = |first: u32| (first..first + n).map(|k| sample(pixel, k)).sum::<f32>() / n as f32;
                let halves = [half(0), half(n)].map(Vec3::splat);
                rendered.color[pixel] = 0.5 * (halves[0] + halves[1]);
                rendered.halves.steps[pixel] = 0.5 * (halves[1] - halves[0]);
            }
            let found = scene.denoise(&rendered, true).color;
            // On the logarithm, which is what is seen, and beyond what is there.
            let ratio = |i: usize| (found[i].x / scene.truth[i].x).ln();
            let rows = (0..HEIGHT - 1).flat_map(|y| (0..WIDTH - 1).map(move |x| y * WIDTH + x));
            let step = |i: usize| (ratio(i) - ratio(i + 1)).abs().max((ratio(i) - ratio(i + WIDTH)).abs());
            let most = rows.map(step).fold(0.0, f32::max);
            assert!(most < 0.37, "{spp} samples: {most}");
        }
    }

    #[test]
    fn threads_change_nothing_and_a_stop_ends_it() {
        let scene = floor();
        let rendered = scene.render(16, 0.4);
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| scene.denoise(&rendered, true))
        };
        assert_eq!(with(1), with(3));
        let Scene { albedo, normal, depth, emitters, .. } = &scene;
        let emitted = &vec![Vec3::ZERO; albedo.len()];
        let guides = Guides { albedo, emitted, normal, depth, emitters };
        let input = DenoiseInput {
            width: WIDTH,
            height: HEIGHT,
            color: &rendered.color,
            half_steps: Some(&rendered.halves),
            guides,
        };
        assert_eq!(denoise(&input, &|| true), None);
    }

    #[test]
    fn pictures_of_a_few_pixels_and_odd_features_have_finite_results() {
        for (width, height) in [(1, 1), (2, 1), (1, 7), (5, 3)] {
            let n = width * height;
            let color: Vec<Vec3> = (0..n).map(|i| Vec3::splat(i as f32 * 1e4)).collect();
            let depth: Vec<f32> = (0..n).map(|i| if i % 2 == 0 { f32::INFINITY } else { 1e20 }).collect();
            let guides = Guides {
                albedo: &vec![Vec3::ZERO; n],
                emitted: &vec![Vec3::ZERO; n],
                normal: &vec![Vec3::ZERO; n],
                depth: &depth,
                emitters: &vec![n > 5; n],
            };
            let found =
                denoise(&DenoiseInput { width, height, color: &color, half_steps: None, guides }, &|| false).unwrap();
            assert!(found.color.iter().all(|color| color.is_finite()) && found.error.is_finite(), "{found:?}");
        }
    }
}
