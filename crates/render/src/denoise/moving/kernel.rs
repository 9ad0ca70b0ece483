//! The formula of the moving filter: a row of a level, for one or sixteen pixels at a time.

use crate::denoise::moving::planes::MARGIN;
use firstlight_simd::{Float, LANES, Real, Simd};

/// Planes of a row of moments: the mean over channels, and its square.
pub const N_MOMENTS: usize = 2;
/// Planes of a row of light: three channels, and the variance.
pub const N_LIGHT: usize = 4;

/// Differences of light that count as much as unlike surfaces, in standard deviations of the noise.
const DEVIATIONS: f32 = 4.0;
/// Squared differences of unit normals are multiplied by this: 20 degrees apart is 4.
const BY_NORMAL: f32 = 32.0;
/// Distance from the plane of a pixel that counts as 1, over the distance from the eye.
const PLANE_TOLERANCE: f32 = 0.004;
/// Of the middle and of the sides of three taps: 1/4, 1/2, 1/4.
const CENTER: f32 = 0.5;
const SIDE: f32 = 0.25;

/// What a row of the result is made of.
#[derive(Clone, Copy)]
pub struct Job<'a> {
    /// Light and guides of the row itself, then of the rows above and below where there are any.
    pub rows: [Option<(&'a [f32], &'a [f32])>; 3],
    /// Numbers of a plane of a row.
    pub stride: usize,
    /// Distance of the taps, pixels.
    pub step: usize,
    /// Pixels.
    pub width: usize,
}

/// A row of moments: neighbours count by their surfaces alone.
#[inline(always)]
pub fn smooth_moments<S: Simd>(s: S, job: Job, to: &mut [f32]) {
    smooth_row::<S, N_MOMENTS>(s, job, to);
}

/// A row of light: neighbours count by their surfaces and their light.
#[inline(always)]
pub fn smooth_light<S: Simd>(s: S, job: Job, to: &mut [f32]) {
    smooth_row::<S, N_LIGHT>(s, job, to);
}

#[inline(always)]
fn smooth_row<S: Simd, const N: usize>(s: S, job: Job, to: &mut [f32]) {
    for x in (0..job.width).step_by(LANES) {
        let found: [Float<S>; N] = smooth_at(Sixteen(s), &job, MARGIN + x);
        for (k, numbers) in found.into_iter().enumerate() {
            let to = to[k * job.stride + MARGIN + x..].first_chunk_mut();
            numbers.store(to.expect("rows have margins"));
        }
    }
}

/// Reads one pixel or sixteen. Not a closure: that would be compiled without the instructions of the set.
pub trait Load: Copy {
    /// One number or sixteen.
    type Number: Real;
    /// The numbers from `at` on.
    fn load(self, row: &[f32], at: usize) -> Self::Number;

    /// The numbers of several planes of a row, from plane `first` on.
    #[inline(always)]
    fn planes<const N: usize>(self, row: &[f32], first: usize, stride: usize, at: usize) -> [Self::Number; N] {
        let mut numbers = [self.load(row, first * stride + at); N];
        for (k, number) in numbers.iter_mut().enumerate().skip(1) {
            *number = self.load(row, (first + k) * stride + at);
        }
        numbers
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

/// The planes of the pixels at one place, smoothed.
#[inline(always)]
pub fn smooth_at<L: Load, const N: usize>(l: L, job: &Job, at: usize) -> [L::Number; N] {
    let (stride, step) = (job.stride, job.step);
    let Some((light, guides)) = job.rows[0] else { unreachable!("a row has itself") };
    let mut pixel = Pixel::<_, N>::of(l, light, guides, stride, at);
    pixel.add(l, light, guides, stride, at - step, SIDE * CENTER);
    pixel.add(l, light, guides, stride, at + step, SIDE * CENTER);
    for row in 1..3 {
        if let Some((light, guides)) = job.rows[row] {
            pixel.add(l, light, guides, stride, at - step, SIDE * SIDE);
            pixel.add(l, light, guides, stride, at, SIDE * CENTER);
            pixel.add(l, light, guides, stride, at + step, SIDE * SIDE);
        }
    }
    let inverse = pixel.weight.all(1.0) / pixel.weight;
    let mut found = pixel.sums;
    for (k, sum) in found.iter_mut().enumerate() {
        *sum = *sum * if k == VARIANCE { inverse * inverse } else { inverse };
    }
    found
}

/// The plane of light that is a variance: its weights are squares.
const VARIANCE: usize = 3;

/// What taps are compared with, and the sums over them.
struct Pixel<R, const N: usize> {
    normal: [R; 3],
    /// Offset of the pixel's plane: what lies in it has the same product with the normal.
    plane: R,
    by_plane: R,
    /// Mean over channels, and what differences from it are multiplied by; for light alone.
    own: R,
    by_light: R,
    weight: R,
    sums: [R; N],
}

impl<R: Real, const N: usize> Pixel<R, N> {
    #[inline(always)]
    fn of<L: Load<Number = R>>(l: L, light: &[f32], guides: &[f32], stride: usize, at: usize) -> Self {
        let normal = l.planes(guides, 0, stride, at);
        let position = l.planes(guides, 3, stride, at);
        let mut sums: [R; N] = l.planes(light, 0, stride, at);
        let distance = dot(position, position).sqrt().at_least(1e-20);
        let one = distance.all(1.0);
        let own = mean(&sums);
        let by_light = if N == N_LIGHT {
            one * (1.0 / DEVIATIONS) / (sums[VARIANCE].sqrt() + own.abs() * 0.01).at_least(1e-10)
        } else {
            one
        };
        let center = CENTER * CENTER;
        for (k, sum) in sums.iter_mut().enumerate() {
            *sum = *sum * if k == VARIANCE { center * center } else { center };
        }
        let plane = dot(normal, position);
        let by_plane = one * (1.0 / PLANE_TOLERANCE) / distance;
        Self { normal, plane, by_plane, own, by_light, weight: one * center, sums }
    }

    /// Adds one tap.
    #[inline(always)]
    fn add<L: Load<Number = R>>(&mut self, l: L, light: &[f32], guides: &[f32], stride: usize, at: usize, kernel: f32) {
        let normal: [R; 3] = l.planes(guides, 0, stride, at);
        let position = l.planes(guides, 3, stride, at);
        let values: [R; N] = l.planes(light, 0, stride, at);
        let turned = [normal[0] - self.normal[0], normal[1] - self.normal[1], normal[2] - self.normal[2]];
        let off = (dot(self.normal, position) - self.plane) * self.by_plane;
        let mut unlike = dot(turned, turned) * BY_NORMAL + off * off;
        if N == N_LIGHT {
            unlike = (mean(&values) - self.own).abs() * self.by_light + unlike;
        }
        // Nearly exp(−x), without its cost, and 0 from 10 on.
        let near = (unlike * -0.1 + 1.0).at_least(0.0);
        let near = near * near;
        let near = near * near;
        let weight = near * near * kernel;
        self.weight += weight;
        for (k, value) in values.into_iter().enumerate() {
            self.sums[k] += value * if k == VARIANCE { weight * weight } else { weight };
        }
    }
}

/// Mean over the three channels of light; of moments, the first.
#[inline(always)]
fn mean<R: Real, const N: usize>(values: &[R; N]) -> R {
    if N == N_LIGHT { (values[0] + values[1] + values[2]) * (1.0 / 3.0) } else { values[0] }
}

#[inline(always)]
fn dot<R: Real>(a: [R; 3], b: [R; 3]) -> R {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
