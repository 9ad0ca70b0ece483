//! The moving filter: an image of a few samples per pixel, smoothed within surfaces in a few milliseconds.
//!
//! Edge-avoiding à-trous wavelets (Dammertz et al. 2010) over light divided by albedo, with the weights of the spatial
//! part of SVGF (Schied et al. 2017): neighbours count as far as they lie in the same plane, face the same way and
//! differ in light by no more than the noise, whose variance is estimated from the neighbourhood and filtered along.
//! Positions take the place of depth: on a floor that is seen at a grazing angle, neighbours are in one plane however much
//! their depths differ. Three by three taps, at distances that double.
//!
//! A row of all planes lies together ([`planes`]), so that sixteen pixels are one load wherever they begin. The formula
//! is generic over one or sixteen pixels ([`kernel`]). Memory is kept from image to image: to get and clear it would take
//! longer than the filter. Start reading at [`MovingFilter::smooth`].

mod kernel;
mod planes;

pub use planes::{APART, MARGIN};

use crate::denoise::moving::kernel::{Job, N_LIGHT, smooth_light, smooth_moments};
use crate::denoise::moving::planes::Planes;
use crate::film::surfaces::PixelSurface;
use firstlight_simd::{InstructionSet, dispatch};
use glam::Vec3;
use rayon::prelude::*;

/// An image to be smoothed.
#[derive(Clone, Copy)]
pub struct MovingInput<'a> {
    /// Pixels.
    pub width: usize,
    /// Pixels.
    pub height: usize,
    /// Reads a row, counted from the top: the mean radiance of each pixel, linear Rec. 709, W·m⁻²·sr⁻¹, and what it
    /// shows. Called once for each row, in any order.
    pub read: &'a (dyn Fn(usize, &mut [Vec3], &mut [PixelSurface]) + Sync),
    /// Position of the camera in the frame of the surfaces, metres.
    pub eye: Vec3,
}

/// Distances of the taps, pixels.
const STEPS: [usize; 5] = [1, 2, 4, 8, 16];
/// The last of those for light that is mixed with that of images before: these take off the noise that is left, and
/// wider taps would blur shadows.
const NARROW: usize = 4;
/// Of the taps by which variance is estimated: as far as 7 × 7 pixels.
const VARIANCE_STEPS: [usize; 2] = [1, 2];
/// No channel is divided by less, so that what dark surfaces reflect without it is not blown up.
const LEAST_ALBEDO: f32 = 0.04;
/// Light over albedo from which a pixel takes no part: its square would not be finite.
const TOO_BRIGHT: f32 = 1e18;
/// Planes of a row: normal and position.
const N_GUIDES: usize = 6;

/// Smooths images, one after another, with the same memory.
#[derive(Default)]
pub struct MovingFilter {
    guides: Planes,
    light: Planes,
    /// What a level is written to, before it takes the place of `light`.
    next: Planes,
    /// Light that is smoothed by narrow taps alone, if the latest image has it.
    narrow: Planes,
    has_narrow: bool,
    keeps_narrow: bool,
    /// Pixels.
    width: usize,
    /// Number of pixels.
    n: usize,
    /// What light was divided by; 0 of pixels that take no part. At least as many as there are pixels.
    divisors: Vec<Vec3>,
    /// The image, first raw and in the end smoothed. At least as many as there are pixels.
    colors: Vec<Vec3>,
}

impl MovingFilter {
    /// Removes noise from an image on the current rayon pool; `None` if `stop`, which is called often, returned true.
    /// The result, row by row from the top, depends neither on the number of threads, nor on `set`, nor on images before.
    ///
    /// Pixels that show an emitter or the environment stay as they are, and count for no others.
    ///
    /// # Panics
    /// If the image has no pixels, or the processor does not have `set`.
    pub fn smooth(
        &mut self,
        input: &MovingInput,
        set: InstructionSet,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Option<&[Vec3]> {
        self.has_narrow = self.keeps_narrow;
        self.fill(input, stop);
        for step in VARIANCE_STEPS {
            self.level(set, step, input.width, Weigh::Surfaces, stop);
        }
        self.fill_light(input.width, stop);
        for step in STEPS {
            self.level(set, step, input.width, Weigh::Light, stop);
            if step == NARROW && self.has_narrow {
                self.narrow.copy(&self.light);
            }
        }
        if stop() {
            return None;
        }
        self.finish(input.width);
        Some(&self.colors[..self.n])
    }

    /// Reads the image: guides, and moments of light.
    fn fill(&mut self, input: &MovingInput, stop: &(dyn Fn() -> bool + Sync)) {
        let MovingInput { width, height, read, eye } = *input;
        assert!(width > 0 && height > 0, "an image without pixels");
        self.guides.fit(width, height, N_GUIDES);
        self.light.fit(width, height, N_LIGHT);
        self.next.fit(width, height, N_LIGHT);
        (self.width, self.n) = (width, width * height);
        for list in [&mut self.divisors, &mut self.colors] {
            if list.len() < self.n {
                *list = vec![Vec3::ZERO; self.n];
            }
        }
        let stride = self.light.stride();
        let nothing = PixelSurface { albedo: Vec3::ZERO, normal: Vec3::ZERO, position: Vec3::ZERO, is_bright: true };
        let planes = self.guides.rows_mut().zip(self.light.rows_mut());
        let pixels =
            self.colors[..self.n].par_chunks_exact_mut(width).zip(self.divisors[..self.n].par_chunks_exact_mut(width));
        planes.zip(pixels).enumerate().for_each_init(
            || vec![nothing; width],
            |surfaces, (y, ((guides, light), (colors, divisors)))| {
                if stop() {
                    return;
                }
                read(y, colors, surfaces);
                // Margins and what takes no part are unlike all others, and black.
                guides[..3 * stride].fill(APART);
                guides[3 * stride..].fill(0.0);
                light.fill(0.0);
                for (x, (surface, divisor)) in surfaces.iter().zip(divisors).enumerate() {
                    *divisor = divisor_of(surface, colors[x]);
                    if *divisor == Vec3::ZERO {
                        continue;
                    }
                    let at = MARGIN + x;
                    let position = surface.position - eye;
                    for (k, value) in surface.normal.to_array().into_iter().chain(position.to_array()).enumerate() {
                        guides[k * stride + at] = value;
                    }
                    let mean = (colors[x] / *divisor).element_sum() / 3.0;
                    (light[at], light[stride + at]) = (mean, mean * mean);
                }
            },
        );
    }

    /// Puts light, and the variance that its moments tell, in place of the moments.
    fn fill_light(&mut self, width: usize, stop: &(dyn Fn() -> bool + Sync)) {
        let stride = self.light.stride();
        let pixels = self.colors[..self.n].par_chunks_exact(width).zip(self.divisors[..self.n].par_chunks_exact(width));
        self.light.rows_mut().zip(pixels).for_each(|(row, (colors, divisors))| {
            if stop() {
                return;
            }
            for (at, (color, divisor)) in (MARGIN..).zip(colors.iter().zip(divisors)) {
                let (mean, square) = (row[at], row[stride + at]);
                row[3 * stride + at] = (square - mean * mean).max(0.0);
                let light = if *divisor == Vec3::ZERO { Vec3::ZERO } else { *color / *divisor };
                (row[at], row[stride + at], row[2 * stride + at]) = (light.x, light.y, light.z);
            }
        });
    }

    /// One level of the transform; rows are left out once `stop` returns true.
    ///
    /// Its time is that of reading memory, and whole rows are read fastest: strips that fit the first cache take a fifth
    /// longer.
    fn level(
        &mut self,
        set: InstructionSet,
        step: usize,
        width: usize,
        weigh: Weigh,
        stop: &(dyn Fn() -> bool + Sync),
    ) {
        let (light, guides) = (&self.light, &self.guides);
        let (height, stride) = (light.height(), light.stride());
        self.next.rows_mut().enumerate().for_each(|(y, to)| {
            if stop() {
                return;
            }
            let rows = [Some(y), y.checked_sub(step), Some(y + step).filter(|&y| y < height)];
            let rows = rows.map(|y| y.map(|y| (light.row(y), guides.row(y))));
            let job = Job { rows, stride, step, width };
            match weigh {
                Weigh::Surfaces => dispatch!(set, smooth_moments(job: Job, to: &mut [f32])),
                Weigh::Light => dispatch!(set, smooth_light(job: Job, to: &mut [f32])),
            }
        });
        std::mem::swap(&mut self.light, &mut self.next);
    }

    /// Multiplies light by what it was divided by.
    fn finish(&mut self, width: usize) {
        let stride = self.light.stride();
        let light = &self.light;
        let pixels =
            self.colors[..self.n].par_chunks_exact_mut(width).zip(self.divisors[..self.n].par_chunks_exact(width));
        pixels.enumerate().for_each(|(y, (colors, divisors))| {
            let row = light.row(y);
            for (at, (color, divisor)) in (MARGIN..).zip(colors.iter_mut().zip(divisors)) {
                if *divisor != Vec3::ZERO {
                    *color = Vec3::new(row[at], row[stride + at], row[2 * stride + at]) * *divisor;
                }
            }
        });
    }

    /// Whether images keep light that is smoothed by narrow taps alone, too.
    pub fn keep_narrow(&mut self, keeps: bool) {
        self.keeps_narrow = keeps;
    }

    /// Width and height of the latest image, pixels.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.light.height())
    }

    /// A row of the latest image.
    pub fn row(&self, y: usize) -> SmoothRow<'_> {
        SmoothRow {
            light: self.light.row(y),
            narrow: if self.has_narrow { self.narrow.row(y) } else { self.light.row(y) },
            guides: self.guides.row(y),
            stride: self.light.stride(),
            colors: &self.colors[y * self.width..][..self.width],
        }
    }

    /// Whether a pixel of the latest image has light that is smoothed.
    pub fn takes_part(&self, x: usize, y: usize) -> bool {
        self.divisors[y * self.width + x] != Vec3::ZERO
    }
}

/// A row of a smoothed image. Planes begin with [`MARGIN`] pixels that take no part.
#[derive(Clone, Copy)]
pub struct SmoothRow<'a> {
    /// Planes of light over albedo.
    pub light: &'a [f32],
    /// The same, smoothed by narrow taps alone if that was kept.
    pub narrow: &'a [f32],
    /// Planes of normals and of positions relative to the camera; [`APART`] and 0 of pixels that take no part.
    pub guides: &'a [f32],
    /// Numbers of a plane.
    pub stride: usize,
    /// Radiance.
    pub colors: &'a [Vec3],
}

/// What light is divided by to take the albedo off it.
pub fn divided_by(albedo: Vec3) -> Vec3 {
    albedo.max(Vec3::splat(LEAST_ALBEDO))
}

/// What the light of a pixel is divided by; 0 if it takes no part.
fn divisor_of(surface: &PixelSurface, color: Vec3) -> Vec3 {
    let divisor = divided_by(surface.albedo);
    let is_usual = (color / divisor).abs().max_element() < TOO_BRIGHT;
    let takes_part = !surface.is_bright
        && is_usual
        && color.is_finite()
        && surface.normal.is_finite()
        && surface.position.is_finite();
    if takes_part { divisor } else { Vec3::ZERO }
}

/// By what neighbours are weighed.
#[derive(Clone, Copy)]
enum Weigh {
    Surfaces,
    Light,
}

#[cfg(test)]
mod tests {
    use super::kernel::{Load, N_MOMENTS};
    use super::*;
    use crate::sampling::{hash_combine, hash_u32};

    const WIDTH: usize = 75;
    const HEIGHT: usize = 41;

    #[derive(Clone, Copy)]
    struct One;

    impl Load for One {
        type Number = f32;

        fn load(self, row: &[f32], at: usize) -> f32 {
            row[at]
        }
    }

    /// A floor that is seen at a grazing angle, before a wall; some light.
    fn floor_and_wall(albedo: impl Fn(usize, usize) -> f32) -> Vec<PixelSurface> {
        let pixel = |i: usize| {
            let (x, y) = (i % WIDTH, i / WIDTH);
            let is_wall = y < HEIGHT / 3;
            let across = x as f32 / WIDTH as f32 - 0.5;
            let depth = if is_wall { 9.0 } else { 3.0 * HEIGHT as f32 / y as f32 };
            PixelSurface {
                albedo: Vec3::splat(albedo(x, y)),
                normal: if is_wall { Vec3::Z } else { Vec3::Y },
                position: Vec3::new(across * depth, if is_wall { 1.0 - y as f32 * 0.02 } else { -1.0 }, -depth),
                is_bright: false,
            }
        };
        (0..WIDTH * HEIGHT).map(pixel).collect()
    }

    fn number(pixel: usize, k: u32) -> f32 {
        hash_combine(hash_u32(pixel as u32), k) as f32 / u32::MAX as f32
    }

    fn smooth_sized(
        filter: &mut MovingFilter,
        (width, height): (usize, usize),
        color: &[Vec3],
        surfaces: &[PixelSurface],
        set: InstructionSet,
    ) -> Vec<Vec3> {
        let read = |y: usize, colors: &mut [Vec3], of_pixels: &mut [PixelSurface]| {
            colors.copy_from_slice(&color[y * width..][..width]);
            of_pixels.copy_from_slice(&surfaces[y * width..][..width]);
        };
        let input = MovingInput { width, height, read: &read, eye: Vec3::ZERO };
        assert_eq!(filter.smooth(&input, set, &|| true), None);
        filter.smooth(&input, set, &|| false).expect("nothing stops it").to_vec()
    }

    fn smooth(color: &[Vec3], surfaces: &[PixelSurface], set: InstructionSet) -> Vec<Vec3> {
        smooth_sized(&mut MovingFilter::default(), (WIDTH, HEIGHT), color, surfaces, set)
    }

    fn sets() -> Vec<InstructionSet> {
        [InstructionSet::Portable, InstructionSet::Avx2, InstructionSet::Avx512]
            .into_iter()
            .filter(|set| set.is_available())
            .collect()
    }

    fn checker(x: usize, y: usize) -> f32 {
        if (x / 6 + y / 4).is_multiple_of(2) { 0.9 } else { 0.1 }
    }

    #[test]
    fn a_constant_stays_constant_and_texture_stays_sharp() {
        let surfaces = floor_and_wall(checker);
        let color: Vec<Vec3> = surfaces.iter().map(|surface| surface.albedo * Vec3::new(2.0, 1.0, 0.5)).collect();
        for (found, color) in smooth(&color, &surfaces, InstructionSet::detect()).iter().zip(&color) {
            assert!((*found - *color).abs().max_element() < 1e-5, "{found} for {color}");
        }
    }

    /// Noise on the floor and the wall, whose light differs: next to none comes from the one to the other.
    #[test]
    fn noise_goes_and_the_edge_between_surfaces_stays() {
        let surfaces = floor_and_wall(checker);
        let truth = |i: usize| surfaces[i].albedo * if surfaces[i].normal == Vec3::Z { 4.0 } else { 1.0 };
        // Exponential noise, like that of a sample of a light that is hit now and then: mean 1.
        let noise = |i: usize| -(1.0 - number(i, 1).min(0.999_999)).ln();
        let color: Vec<Vec3> = (0..surfaces.len()).map(|i| truth(i) * noise(i)).collect();
        let found = smooth(&color, &surfaces, InstructionSet::detect());
        let error = |colors: &[Vec3], pixels: std::ops::Range<usize>| {
            let n = pixels.len() as f32;
            pixels.map(|i| ((colors[i] - truth(i)) / truth(i)).x.powi(2)).sum::<f32>() / n
        };
        let all = 0..surfaces.len();
        assert!(error(&found, all.clone()) < 0.04 * error(&color, all), "{}", error(&found, 0..surfaces.len()));
        let edge = HEIGHT / 3 * WIDTH;
        let near = edge - WIDTH..edge + WIDTH;
        assert!(error(&found, near.clone()) < 0.08 * error(&color, near.clone()), "{}", error(&found, near));
        // The filter is nearly linear: it moves light about and loses little of it.
        let mean = |colors: &[Vec3]| (0..colors.len()).map(|i| (colors[i] / surfaces[i].albedo).x).sum::<f32>();
        let ratio = mean(&found) / mean(&color);
        assert!((0.92..1.05).contains(&ratio), "{ratio}");
    }

    #[test]
    fn bright_pixels_and_odd_ones_stay_as_they_are_and_touch_no_others() {
        let mut surfaces = floor_and_wall(|_, _| 0.5);
        let mut color = vec![Vec3::splat(0.5); surfaces.len()];
        let (light_part, bad) = (20 * WIDTH + 30, 30 * WIDTH + 50);
        surfaces[light_part].is_bright = true;
        color[light_part] = Vec3::splat(1e6);
        color[bad] = Vec3::splat(f32::INFINITY);
        for (i, found) in smooth(&color, &surfaces, InstructionSet::detect()).into_iter().enumerate() {
            let expected = color[i];
            assert!(found == expected || (found - expected).abs().max_element() < 1e-5, "{i}: {found}");
        }
    }

    /// All instruction sets and numbers of threads, and the formula for one pixel.
    #[test]
    fn sets_and_threads_change_no_bit() {
        let surfaces = floor_and_wall(checker);
        let color: Vec<Vec3> =
            (0..surfaces.len()).map(|i| Vec3::new(number(i, 2), number(i, 3), number(i, 4)) * 3.0).collect();
        let expected = smooth(&color, &surfaces, InstructionSet::Portable);
        for set in sets() {
            for threads in [1, 3] {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                assert_eq!(pool.install(|| smooth(&color, &surfaces, set)), expected, "{set:?}, {threads} threads");
            }
        }
    }

    /// A level for one pixel at a time has the same bits.
    #[test]
    fn a_level_is_its_formula_for_each_pixel() {
        let mut filter = MovingFilter::default();
        let surfaces = floor_and_wall(checker);
        let color: Vec<Vec3> =
            (0..surfaces.len()).map(|i| Vec3::new(number(i, 2), number(i, 3), number(i, 4)) * 3.0).collect();
        smooth_sized(&mut filter, (WIDTH, HEIGHT), &color, &surfaces, InstructionSet::Portable);
        for weigh in [Weigh::Surfaces, Weigh::Light] {
            for step in STEPS {
                filter.level(InstructionSet::detect(), step, WIDTH, weigh, &|| false);
                let MovingFilter { light: found, next: before, guides, .. } = &filter;
                let stride = before.stride();
                for (y, x) in (0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| (y, x))) {
                    let rows = [Some(y), y.checked_sub(step), Some(y + step).filter(|&y| y < HEIGHT)];
                    let rows = rows.map(|y| y.map(|y| (before.row(y), guides.row(y))));
                    let job = Job { rows, stride, step, width: WIDTH };
                    let one = match weigh {
                        Weigh::Surfaces => kernel::smooth_at::<_, N_MOMENTS>(One, &job, MARGIN + x).to_vec(),
                        Weigh::Light => kernel::smooth_at::<_, N_LIGHT>(One, &job, MARGIN + x).to_vec(),
                    };
                    let of_lanes: Vec<u32> =
                        (0..one.len()).map(|k| found.row(y)[k * stride + MARGIN + x].to_bits()).collect();
                    let one: Vec<u32> = one.into_iter().map(f32::to_bits).collect();
                    assert_eq!(one, of_lanes, "{x},{y} at {step}");
                }
            }
        }
    }

    /// What a filter did before changes no bit: images of other sizes, and those that were broken off.
    #[test]
    fn images_before_change_nothing() {
        let mut filter = MovingFilter::default();
        let surfaces = floor_and_wall(checker);
        let color: Vec<Vec3> =
            (0..surfaces.len()).map(|i| Vec3::new(number(i, 5), number(i, 6), number(i, 7)) * 3.0).collect();
        let expected = smooth(&color, &surfaces, InstructionSet::detect());
        for size in [(WIDTH, HEIGHT), (WIDTH / 2, HEIGHT), (WIDTH, HEIGHT / 2)] {
            let other = vec![Vec3::splat(1e30); size.0 * size.1];
            smooth_sized(&mut filter, size, &other, &surfaces[..other.len()], InstructionSet::detect());
            let found = smooth_sized(&mut filter, (WIDTH, HEIGHT), &color, &surfaces, InstructionSet::detect());
            assert_eq!(found, expected, "{size:?}");
        }
    }

    #[test]
    fn images_of_a_few_pixels_have_finite_results() {
        for (width, height) in [(1, 1), (2, 1), (1, 7), (5, 3), (17, 2)] {
            let surfaces =
                vec![
                    PixelSurface { albedo: Vec3::ZERO, normal: Vec3::ZERO, position: Vec3::ZERO, is_bright: false };
                    width * height
                ];
            let color: Vec<Vec3> = (0..width * height).map(|i| Vec3::splat(i as f32 * 1e4)).collect();
            let mut filter = MovingFilter::default();
            let found = smooth_sized(&mut filter, (width, height), &color, &surfaces, InstructionSet::detect());
            assert!(found.iter().all(|color| color.is_finite()), "{found:?}");
        }
    }
}
