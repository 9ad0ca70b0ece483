//! The moving filter: an image of a few samples per pixel, smoothed within surfaces in a few milliseconds.
//!
//! Edge-avoiding à-trous wavelets (Dammertz et al. 2010) over light divided by albedo, with the weights of the spatial
//! part of SVGF (Schied et al. 2017): neighbours count as far as they lie in the same plane, face the same way and
//! differ in light by no more than the noise, whose variance is estimated from the neighbourhood and filtered along.
//! Positions take the place of depth: on a floor that is seen at a grazing angle, neighbours are in one plane however much
//! their depths differ. Three by three taps, at distances that double.
//!
//! A row of all planes lies together, with margins, so that sixteen pixels are one load wherever they begin. The formula
//! is generic over one or sixteen pixels. Start reading at [`smooth_moving`].

use crate::film::surfaces::PixelSurface;
use firstlight_simd::{Float, InstructionSet, LANES, Real, Simd, dispatch};
use glam::Vec3;
use rayon::prelude::*;

/// An image to be smoothed; both lists are row by row from the top.
#[derive(Clone, Copy, Debug)]
pub struct MovingInput<'a> {
    /// Pixels.
    pub width: usize,
    /// Pixels.
    pub height: usize,
    /// Mean radiance of each pixel, linear Rec. 709, W·m⁻²·sr⁻¹.
    pub color: &'a [Vec3],
    /// What each pixel shows.
    pub surfaces: &'a [PixelSurface],
    /// Position of the camera in the frame of the surfaces, metres.
    pub eye: Vec3,
}

/// Distances of the taps, pixels.
const STEPS: [usize; 5] = [1, 2, 4, 8, 16];
/// Of the taps by which variance is estimated: as far as 7 × 7 pixels.
const VARIANCE_STEPS: [usize; 2] = [1, 2];
/// Margin on both sides of a row, pixels: as far as a tap reaches.
const MARGIN: usize = 16;
/// No channel is divided by less, so that what dark surfaces reflect without it is not blown up.
const LEAST_ALBEDO: f32 = 0.04;
/// Differences of light that count as much as unlike surfaces, in standard deviations of the noise.
const DEVIATIONS: f32 = 4.0;
/// Squared differences of unit normals are multiplied by this: 20 degrees apart is 4.
const BY_NORMAL: f32 = 32.0;
/// Distance from the plane of a pixel that counts as 1, over the distance from the eye.
const PLANE_TOLERANCE: f32 = 0.004;
/// A normal that is unlike all others, of what takes no part.
const APART: f32 = 1e4;

/// Planes of a row: light or its moments, and the variance of light.
const N_LIGHT: usize = 4;
/// Planes of a row: normal and position.
const N_GUIDES: usize = 6;

/// Removes noise from an image on the current rayon pool; `None` if `stop`, which is called often, returned true. The
/// result does not depend on the number of threads or on `set`.
///
/// Pixels that show an emitter or the environment stay as they are, and count for no others.
///
/// # Panics
/// When a list has another length than the image has pixels, or the processor does not have `set`.
pub fn smooth_moving(input: &MovingInput, set: InstructionSet, stop: &(dyn Fn() -> bool + Sync)) -> Option<Vec<Vec3>> {
    let MovingInput { width, height, color, surfaces, .. } = *input;
    assert!(width > 0 && height > 0 && [color.len(), surfaces.len()] == [width * height; 2], "an image without pixels");
    let stride = width.next_multiple_of(LANES) + 2 * MARGIN;
    let guides = guides(input, stride);
    let mut light = Planes::new(height, stride, N_LIGHT);
    let mut other = Planes::new(height, stride, N_LIGHT);
    fill_moments(input, &mut light);
    for step in VARIANCE_STEPS {
        level(set, &light, &guides, step, width, &mut other, Weigh::Surfaces, stop);
        if stop() {
            return None;
        }
        std::mem::swap(&mut light, &mut other);
    }
    fill_light(input, &mut light);
    for step in STEPS {
        level(set, &light, &guides, step, width, &mut other, Weigh::Light, stop);
        if stop() {
            return None;
        }
        std::mem::swap(&mut light, &mut other);
    }
    let mut smooth = vec![Vec3::ZERO; width * height];
    smooth.par_chunks_exact_mut(width).enumerate().for_each(|(y, smooth)| {
        let row = light.row(y);
        for (x, smooth) in smooth.iter_mut().enumerate() {
            let (surface, at) = (&surfaces[y * width + x], MARGIN + x);
            let found = Vec3::new(row[at], row[stride + at], row[2 * stride + at]) * divisor(surface);
            *smooth = if takes_part(surface, color[y * width + x]) { found } else { color[y * width + x] };
        }
    });
    Some(smooth)
}

fn divisor(surface: &PixelSurface) -> Vec3 {
    surface.albedo.max(Vec3::splat(LEAST_ALBEDO))
}

fn takes_part(surface: &PixelSurface, color: Vec3) -> bool {
    !surface.is_bright && color.is_finite() && surface.normal.is_finite() && surface.position.is_finite()
}

/// Rows of several planes: those of a row lie together.
struct Planes {
    numbers: Vec<f32>,
    stride: usize,
    n: usize,
}

impl Planes {
    fn new(height: usize, stride: usize, n: usize) -> Self {
        Self { numbers: vec![0.0; height * stride * n], stride, n }
    }

    fn row(&self, y: usize) -> &[f32] {
        let length = self.stride * self.n;
        &self.numbers[y * length..][..length]
    }

    fn rows_mut(&mut self) -> rayon::slice::ChunksExactMut<'_, f32> {
        self.numbers.par_chunks_exact_mut(self.stride * self.n)
    }
}

/// Normals and positions about the eye. Margins and what takes no part have a normal that is unlike all others.
fn guides(input: &MovingInput, stride: usize) -> Planes {
    let mut guides = Planes::new(input.height, stride, N_GUIDES);
    guides.rows_mut().enumerate().for_each(|(y, row)| {
        row[..3 * stride].fill(APART);
        for x in 0..input.width {
            let pixel = y * input.width + x;
            let surface = &input.surfaces[pixel];
            if !takes_part(surface, input.color[pixel]) {
                continue;
            }
            let position = surface.position - input.eye;
            for (k, value) in surface.normal.to_array().into_iter().chain(position.to_array()).enumerate() {
                row[k * stride + MARGIN + x] = value;
            }
        }
    });
    guides
}

/// Light over albedo of a pixel; black of what takes no part.
fn light_of(input: &MovingInput, pixel: usize) -> Vec3 {
    let (surface, color) = (&input.surfaces[pixel], input.color[pixel]);
    if takes_part(surface, color) { color / divisor(surface) } else { Vec3::ZERO }
}

/// The mean over channels, and its square.
fn fill_moments(input: &MovingInput, light: &mut Planes) {
    let stride = light.stride;
    light.rows_mut().enumerate().for_each(|(y, row)| {
        for x in 0..input.width {
            let mean = light_of(input, y * input.width + x).element_sum() / 3.0;
            (row[MARGIN + x], row[stride + MARGIN + x]) = (mean, mean * mean);
        }
    });
}

/// Light, and the variance that its moments tell.
fn fill_light(input: &MovingInput, light: &mut Planes) {
    let stride = light.stride;
    light.rows_mut().enumerate().for_each(|(y, row)| {
        for at in MARGIN..MARGIN + input.width {
            let (mean, square) = (row[at], row[stride + at]);
            row[3 * stride + at] = (square - mean * mean).max(0.0);
            let light = light_of(input, y * input.width + at - MARGIN);
            (row[at], row[stride + at], row[2 * stride + at]) = (light.x, light.y, light.z);
        }
    });
}

/// By what neighbours are weighed.
#[derive(Clone, Copy, PartialEq)]
enum Weigh {
    Surfaces,
    Light,
}

/// One level of the transform; rows are left out once `stop` returns true.
#[allow(clippy::too_many_arguments)] // Two images, what one is made of, and how.
fn level(
    set: InstructionSet,
    light: &Planes,
    guides: &Planes,
    step: usize,
    width: usize,
    to: &mut Planes,
    weigh: Weigh,
    stop: &(dyn Fn() -> bool + Sync),
) {
    let height = light.numbers.len() / (light.stride * light.n);
    to.rows_mut().enumerate().for_each(|(y, to)| {
        if stop() {
            return;
        }
        // The row itself, and those above and below where there are any.
        let rows = [Some(y), y.checked_sub(step), Some(y + step).filter(|&y| y < height)];
        let rows = rows.map(|y| y.map(|y| (light.row(y), guides.row(y))));
        let job = Job { rows, stride: light.stride, step, width, by_light: weigh == Weigh::Light };
        dispatch!(set, smooth_row(job: Job, to: &mut [f32]));
    });
}

/// What a row of the result is made of.
#[derive(Clone, Copy)]
struct Job<'a> {
    /// Light and guides of the row itself, then of the others.
    rows: [Option<(&'a [f32], &'a [f32])>; 3],
    stride: usize,
    step: usize,
    width: usize,
    by_light: bool,
}

/// Reads one pixel or sixteen. Not a closure: that would be compiled without the instructions of the set.
trait Load: Copy {
    type Number: Real;
    fn load(self, row: &[f32], at: usize) -> Self::Number;

    /// Three planes of a row, from plane `first` on.
    #[inline(always)]
    fn three(self, row: &[f32], first: usize, stride: usize, at: usize) -> [Self::Number; 3] {
        let plane = first * stride + at;
        [self.load(row, plane), self.load(row, plane + stride), self.load(row, plane + 2 * stride)]
    }
}

#[derive(Clone, Copy)]
struct Sixteen<S>(S);

impl<S: Simd> Load for Sixteen<S> {
    type Number = Float<S>;

    #[inline(always)]
    fn load(self, row: &[f32], at: usize) -> Float<S> {
        Float::load(self.0, row[at..].first_chunk().expect("rows have margins"))
    }
}

#[inline(always)]
fn smooth_row<S: Simd>(s: S, job: Job, to: &mut [f32]) {
    for x in (0..job.width).step_by(LANES) {
        let [r, g, b, variance] = smooth_at(Sixteen(s), &job, MARGIN + x);
        store(r, to, MARGIN + x);
        store(g, to, job.stride + MARGIN + x);
        store(b, to, 2 * job.stride + MARGIN + x);
        store(variance, to, 3 * job.stride + MARGIN + x);
    }
}

#[inline(always)]
fn store<S: Simd>(numbers: Float<S>, to: &mut [f32], at: usize) {
    numbers.store(to[at..].first_chunk_mut().expect("rows have margins"));
}

/// Light and variance of the pixels at one place, smoothed.
#[inline(always)]
fn smooth_at<L: Load>(l: L, job: &Job, at: usize) -> [L::Number; N_LIGHT] {
    let (stride, step) = (job.stride, job.step);
    let Some((light, guides)) = job.rows[0] else { unreachable!("a row has itself") };
    let mut pixel = Pixel::of(l, light, guides, stride, at, job.by_light);
    pixel.add(l, light, guides, stride, at - step, SIDE * CENTER);
    pixel.add(l, light, guides, stride, at + step, SIDE * CENTER);
    for row in 1..3 {
        if let Some((light, guides)) = job.rows[row] {
            pixel.add(l, light, guides, stride, at - step, SIDE * SIDE);
            pixel.add(l, light, guides, stride, at, SIDE * CENTER);
            pixel.add(l, light, guides, stride, at + step, SIDE * SIDE);
        }
    }
    let inverse = pixel.own.all(1.0) / pixel.weight;
    let [r, g, b] = pixel.light;
    [r * inverse, g * inverse, b * inverse, pixel.variance * (inverse * inverse)]
}

/// What taps are compared with, and the sums over them.
struct Pixel<R> {
    normal: [R; 3],
    /// Offset of the pixel's plane: what lies in it has the same product with the normal.
    plane: R,
    by_plane: R,
    /// Mean over channels.
    own: R,
    by_light: R,
    weight: R,
    light: [R; 3],
    variance: R,
}

impl<R: Real> Pixel<R> {
    #[inline(always)]
    fn of<L: Load<Number = R>>(l: L, light: &[f32], guides: &[f32], stride: usize, at: usize, by_light: bool) -> Self {
        let normal = l.three(guides, 0, stride, at);
        let position = l.three(guides, 3, stride, at);
        let color = l.three(light, 0, stride, at);
        let variance = l.load(light, 3 * stride + at);
        let own = (color[0] + color[1] + color[2]) * (1.0 / 3.0);
        let distance = dot(position, position).sqrt().at_least(1e-20);
        let by_light = if by_light {
            own.all(1.0 / DEVIATIONS) / (variance.sqrt() + own.abs() * 0.01).at_least(1e-10)
        } else {
            own.all(0.0)
        };
        let center = CENTER * CENTER;
        Self {
            normal,
            plane: dot(normal, position),
            by_plane: own.all(1.0 / PLANE_TOLERANCE) / distance,
            own,
            by_light,
            weight: own.all(center),
            light: [color[0] * center, color[1] * center, color[2] * center],
            variance: variance * (center * center),
        }
    }

    /// Adds one tap.
    #[inline(always)]
    fn add<L: Load<Number = R>>(&mut self, l: L, light: &[f32], guides: &[f32], stride: usize, at: usize, kernel: f32) {
        let normal = l.three(guides, 0, stride, at);
        let position = l.three(guides, 3, stride, at);
        let color = l.three(light, 0, stride, at);
        let turned = [normal[0] - self.normal[0], normal[1] - self.normal[1], normal[2] - self.normal[2]];
        let off = (dot(self.normal, position) - self.plane) * self.by_plane;
        let unlike = ((color[0] + color[1] + color[2]) * (1.0 / 3.0) - self.own).abs() * self.by_light;
        let unlike = unlike + dot(turned, turned) * BY_NORMAL + off * off;
        // Nearly exp(−x), without its cost.
        let near = self.own.all(1.0) / (unlike * 0.125 + 1.0);
        let near = near * near;
        let near = near * near;
        let weight = near * near * kernel;
        self.weight += weight;
        self.light[0] += weight * color[0];
        self.light[1] += weight * color[1];
        self.light[2] += weight * color[2];
        self.variance += weight * weight * l.load(light, 3 * stride + at);
    }
}

#[inline(always)]
fn dot<R: Real>(a: [R; 3], b: [R; 3]) -> R {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Of the middle and of the sides of three taps: 1/4, 1/2, 1/4.
const CENTER: f32 = 0.5;
const SIDE: f32 = 0.25;

#[cfg(test)]
mod tests {
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

    fn smooth(color: &[Vec3], surfaces: &[PixelSurface], set: InstructionSet) -> Vec<Vec3> {
        let input = MovingInput { width: WIDTH, height: HEIGHT, color, surfaces, eye: Vec3::ZERO };
        assert_eq!(smooth_moving(&input, set, &|| true), None);
        smooth_moving(&input, set, &|| false).expect("nothing stops it")
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
        let (lamp, bad) = (20 * WIDTH + 30, 30 * WIDTH + 50);
        surfaces[lamp].is_bright = true;
        color[lamp] = Vec3::splat(1e6);
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
        let input = MovingInput { width: WIDTH, height: HEIGHT, color: &color, surfaces: &surfaces, eye: Vec3::ZERO };
        let stride = WIDTH.next_multiple_of(LANES) + 2 * MARGIN;
        let guides = guides(&input, stride);
        let [mut light, mut found] = [(); 2].map(|()| Planes::new(HEIGHT, stride, N_LIGHT));
        fill_light(&input, &mut light);
        light.numbers.iter_mut().enumerate().for_each(|(i, number)| *number += (i % 7) as f32 * 0.1);
        for step in STEPS {
            level(InstructionSet::detect(), &light, &guides, step, WIDTH, &mut found, Weigh::Light, &|| false);
            for (y, x) in (0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| (y, x))) {
                let rows = [Some(y), y.checked_sub(step), Some(y + step).filter(|&y| y < HEIGHT)];
                let rows = rows.map(|y| y.map(|y| (light.row(y), guides.row(y))));
                let job = Job { rows, stride, step, width: WIDTH, by_light: true };
                let one = smooth_at(One, &job, MARGIN + x);
                let of_lanes = std::array::from_fn(|k| found.row(y)[k * stride + MARGIN + x]);
                assert_eq!(one.map(f32::to_bits), <[f32; N_LIGHT]>::map(of_lanes, f32::to_bits), "{x},{y} at {step}");
            }
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
            let input = MovingInput { width, height, color: &color, surfaces: &surfaces, eye: Vec3::ZERO };
            let found = smooth_moving(&input, InstructionSet::detect(), &|| false).expect("nothing stops it");
            assert!(found.iter().all(|color| color.is_finite()), "{found:?}");
        }
    }
}
