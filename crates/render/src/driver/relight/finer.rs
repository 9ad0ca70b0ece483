//! Light of a coarse image on the surfaces of a finer one: joint bilateral upsampling (Kopf et al. 2007).
//!
//! The light of a fine pixel is that of the four coarse pixels around it, weighted by their distance and by how well
//! they lie in the plane of the pixel and face its way. It is multiplied by the albedo of the pixel itself, so edges and
//! textures are as sharp as the fine image. Sixteen pixels of a row at a time.
//!
//! The light is mixed with that of the images before ([`past`](crate::driver::relight::past)), so that it has less and
//! less noise while it moves.
//!
//! What is out of focus is not sharp: as far as circles of confusion reach the size of some coarse pixels, the coarse
//! image itself is taken.

use crate::core::camera::Camera;
use crate::denoise::{APART, MARGIN, SmoothRow, divided_by};
use crate::driver::relight::past::{SeenPast, store};
use crate::integrators::common::seen::Seen;
use firstlight_simd::{Bits, Float, InstructionSet, LANES, Mask, Real, Simd, Truth, Vector, dispatch, select};
use glam::{UVec2, Vec2, Vec3};

/// Planes of [`FineRow`]: albedo, emitted radiance, normal, position, depth and object.
const N_PLANES: usize = 14;
const DEPTH: usize = 12;
const OBJECT: usize = 13;

/// Some pixels of a row of the fine image, plane by plane.
#[derive(Default)]
pub struct FineRow {
    numbers: Vec<f32>,
    /// Of a plane: a multiple of sixteen.
    length: usize,
}

impl FineRow {
    /// Takes what so many pixels show; the albedo is black where nothing scatters light.
    ///
    /// - `eye`: position of the camera, which positions are kept relative to.
    pub fn fill(&mut self, seen: &[Seen], eye: Vec3) {
        self.length = seen.len().next_multiple_of(LANES);
        self.numbers.resize(N_PLANES * self.length, 0.0);
        for (i, seen) in seen.iter().enumerate() {
            let Seen { albedo, emitted, normal, position, depth, object, .. } = *seen;
            let position = position - eye;
            let divisor = if albedo == Vec3::ZERO { albedo } else { divided_by(albedo) };
            for (k, vector) in [divisor, emitted, normal, position].into_iter().enumerate() {
                for c in 0..3 {
                    self.numbers[(3 * k + c) * self.length + i] = vector[c];
                }
            }
            self.numbers[DEPTH * self.length + i] = depth;
            self.numbers[OBJECT * self.length + i] = object as f32;
        }
    }
}

/// Where some pixels of a row of the fine image are, and what they count.
#[derive(Clone, Copy)]
pub struct FinePlace<'a> {
    /// Of both images.
    pub camera: &'a Camera,
    /// Column and row of the first pixel.
    pub first: UVec2,
    /// Where in each pixel its ray goes through, 0..1.
    pub at: Vec2,
    /// Of the fine image, pixels.
    pub size: UVec2,
    /// Number of earlier images that the present one counts as.
    pub weight: f32,
}

/// The coarse image around a row of the fine one.
pub struct Coarse<'a> {
    /// The two next ones are in the middle.
    pub rows: [SmoothRow<'a>; 4],
    /// Distance from the first of those, 0..1 rows.
    pub below: f32,
    /// Coarse pixels per fine one, and the coarse column at which the fine image begins.
    pub scale: f32,
    pub offset: f32,
    /// Pixels.
    pub width: usize,
    /// Side of a pixel on the film of the camera.
    pub pixel: f32,
    /// The fine image before.
    pub past: Option<SeenPast<'a>>,
}

/// Radiance of some pixels of a row of the fine image.
///
/// - `surfaces`: what they show; `to`: their radiance; `to_past`: the whole row that is kept.
pub fn relight_row(
    set: InstructionSet,
    place: FinePlace,
    coarse: &Coarse,
    surfaces: &FineRow,
    to: &mut [Vec3],
    to_past: &mut [f32],
) {
    dispatch!(
        set,
        relight(place: FinePlace, coarse: &Coarse, surfaces: &FineRow, to: &mut [Vec3], to_past: &mut [f32])
    );
}

/// Squared differences of unit normals are multiplied by this: 20 degrees apart is 4.
const BY_NORMAL: f32 = 32.0;
/// Distance from the plane of a pixel that counts as 1, over the distance from the eye.
const PLANE_TOLERANCE: f32 = 0.01;
/// Circles of confusion from which on the coarse image is taken, coarse pixels: where they are smaller, its noise is worse
/// than an image that is too sharp.
const LARGE: f32 = 6.0;
/// Share of the twelve coarse pixels that are farther away, where the next ones show other surfaces.
const FARTHER: f32 = 0.02;

/// Light of coarse pixels, and of how many.
struct Taps<S: Simd> {
    normal: Vector<S>,
    position: Vector<S>,
    by_plane: Float<S>,
    light: Vector<S>,
    narrow: Vector<S>,
    total: Float<S>,
}

impl<S: Simd> Taps<S> {
    /// Adds a coarse pixel for each fine one; returns the coarse position relative to the eye, and whether it has any.
    #[inline(always)]
    fn add(&mut self, row: &SmoothRow, index: Bits<S>, share: Float<S>) -> (Vector<S>, Mask) {
        let stride = row.stride;
        let normal = three_of(row.guides, 0, stride, index);
        let position = three_of(row.guides, 3, stride, index);
        let turned = normal - self.normal;
        let off = self.normal.dot(position - self.position) * self.by_plane;
        let unlike = turned.dot(turned) * BY_NORMAL + off * off + 1.0;
        let takes_part = normal.x.lt(share.all(0.5 * APART));
        // Never zero: what is like none of them is lit as by the one that is least unlike.
        let weight = select(takes_part, share / (unlike * unlike), share.all(0.0));
        self.total += weight;
        self.light = self.light + three_of(row.light, 0, stride, index) * weight;
        self.narrow = self.narrow + three_of(row.narrow, 0, stride, index) * weight;
        (position, takes_part)
    }
}

/// Three planes of a row of the coarse image.
#[inline(always)]
fn three_of<S: Simd>(row: &[f32], first: usize, stride: usize, index: Bits<S>) -> Vector<S> {
    Vector {
        x: Float::gather(&row[first * stride..], index),
        y: Float::gather(&row[(first + 1) * stride..], index),
        z: Float::gather(&row[(first + 2) * stride..], index),
    }
}

/// Three planes of sixteen fine pixels.
#[inline(always)]
fn surface_of<S: Simd>(s: S, surfaces: &FineRow, first: usize, at: usize) -> Vector<S> {
    Vector {
        x: number_of(s, surfaces, first, at),
        y: number_of(s, surfaces, first + 1, at),
        z: number_of(s, surfaces, first + 2, at),
    }
}

#[inline(always)]
fn number_of<S: Simd>(s: S, surfaces: &FineRow, plane: usize, at: usize) -> Float<S> {
    Float::load(s, surfaces.numbers[plane * surfaces.length + at..].first_chunk().expect("rows are padded"))
}

#[inline(always)]
fn relight<S: Simd>(s: S, place: FinePlace, coarse: &Coarse, surfaces: &FineRow, to: &mut [Vec3], to_past: &mut [f32]) {
    let FinePlace { camera, first, at: in_pixel, size, weight } = place;
    let counted = Bits::load(s, &std::array::from_fn(|lane| lane as u32)).to_float();
    let (zero, one) = (counted.all(0.0), counted.all(1.0));
    let [above, below] = [1.0 - coarse.below, coarse.below];
    for (at, to) in (0..surfaces.length).step_by(LANES).zip(to.chunks_mut(LANES)) {
        let [albedo, emitted] = [surface_of(s, surfaces, 0, at), surface_of(s, surfaces, 3, at)];
        let [normal, position] = [surface_of(s, surfaces, 6, at), surface_of(s, surfaces, 9, at)];
        let [depth, object] = [number_of(s, surfaces, DEPTH, at), number_of(s, surfaces, OBJECT, at)];
        let by_plane = counted.all(1.0 / PLANE_TOLERANCE) / position.dot(position).sqrt().at_least(1e-20);
        let column = counted + ((first.x as usize + at) as f32 + in_pixel.x);
        // One more than the left one of the next columns, so that it is positive and truncated downwards.
        let u = (column * coarse.scale + (coarse.offset + 0.5)).at_least(0.0);
        let left = u.truncate();
        let right_share = u - left.to_float();
        let black = Vector::splat(s, Vec3::ZERO);
        let mut taps = Taps { normal, position, by_plane, light: black, narrow: black, total: zero };
        let mut blurred = black;
        let mut confusion = camera.confusion(depth);
        for (row, of_row) in [(1, above), (2, below)] {
            for right in 0..2 {
                let share = if right == 0 { one - right_share } else { right_share } * of_row;
                let row = &coarse.rows[row];
                let (tap, takes_part) = taps.add(row, left + (MARGIN as u32 - 1 + right), share);
                if camera.lens_radius > 0.0 {
                    let of_tap = camera.confusion(tap.dot(Vector::splat(s, camera.forward)));
                    confusion = confusion.max(select(takes_part, of_tap, zero));
                    let x = left.to_float() + (right as f32 - 1.0);
                    let index = x.at_least(0.0).at_most((coarse.width - 1) as f32).truncate() * 3;
                    blurred = blurred + three_of(bytemuck::cast_slice(row.colors), 0, 1, index) * share;
                }
            }
        }
        if (zero.lt(albedo.x) & taps.total.lt(one * FARTHER)).any() {
            for (k, row) in coarse.rows.iter().enumerate() {
                for right in 0..4 {
                    let is_next = (1..3).contains(&k) && (1..3).contains(&right);
                    if !is_next {
                        taps.add(row, left + (MARGIN as u32 - 2 + right), one * FARTHER);
                    }
                }
            }
        }
        let inverse = one / taps.total.at_least(1e-30);
        let mut light = taps.light * inverse;
        // Light of other surfaces counts less, so that it is soon replaced.
        let (mut images, mut seen) = (taps.total * weight, zero);
        if let Some(past) = coarse.past {
            let points = camera.points([column, one * (first.y as f32 + in_pixel.y)], size.as_vec2(), depth);
            let away = points - Vector::splat(s, camera.eye);
            let (old, [count, was_seen]) = past.light_of(s, points, away.dot(normal) / away.length(), object);
            let sum = images + count;
            let share = select(zero.lt(sum), images / sum, one);
            // The more images there are, the less is this one smoothed.
            let present = light * share + taps.narrow * inverse * (one - share);
            light = old * (one - share) + present * share;
            (images, seen) = (sum, was_seen);
        }
        store(to_past, first.x as usize + at, light, [images, depth, object, seen]);
        let mut color = light.times(albedo) + emitted;
        if camera.lens_radius > 0.0 {
            let share = (confusion * (1.0 / (LARGE * coarse.pixel))).at_most(1.0);
            color = color * (one - share) + blurred * share;
        }
        let color = color.to_arrays();
        for (lane, to) in to.iter_mut().enumerate() {
            *to = Vec3::new(color[0][lane], color[1][lane], color[2][lane]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::denoise::MovingInput;
    use crate::driver::relight::MovingImage;
    use crate::film::surfaces::PixelSurface;
    use crate::sampling::{hash_combine, hash_u32};

    const COARSE: UVec2 = UVec2::new(40, 24);
    const FINE: UVec2 = UVec2::new(160, 96);
    const MIDDLE: Vec2 = Vec2::splat(0.5);
    const FLOOR: u32 = 0;
    const WALL: u32 = 1;

    fn camera(x: f32) -> Camera {
        Camera { eye: Vec3::new(x, 0.0, 0.0), tan_half_vfov: 0.5, ..Camera::default() }
    }

    /// A checkered floor a metre below the eye before a wall, through the middle of a pixel.
    fn surface(camera: &Camera, wall: f32, size: UVec2, x: u32, y: u32) -> Seen {
        let ray = camera.middle_ray(Vec2::new(x as f32 + 0.5, y as f32 + 0.5), size.as_vec2());
        let to_floor = if ray.dir.y < 0.0 { -1.0 / ray.dir.y } else { f32::INFINITY };
        let to_wall = wall / -ray.dir.z;
        let (object, normal, t) =
            if to_floor < to_wall { (FLOOR, Vec3::Y, to_floor) } else { (WALL, Vec3::Z, to_wall) };
        let position = ray.dir * t;
        let field = ((position + camera.eye) * 3.0).floor();
        let is_dark = (field.x + field.y + field.z).rem_euclid(2.0) > 0.5;
        let albedo = Vec3::splat(if is_dark { 0.1 } else { 0.9 });
        let depth = -position.z;
        Seen { albedo, normal, position: position + camera.eye, depth, object, ..Seen::NOTHING }
    }

    fn surfaces(camera: &Camera, wall: f32, size: UVec2) -> Vec<Seen> {
        let row = |y| (0..size.x).map(move |x| surface(camera, wall, size, x, y));
        (0..size.y).flat_map(row).collect()
    }

    fn light(object: u32) -> f32 {
        if object == WALL { 4.0 } else { 1.0 }
    }

    fn images(surfaces: &[Seen]) -> Vec<Vec3> {
        surfaces.iter().map(|surface| surface.albedo * light(surface.object)).collect()
    }

    /// - `noise`: what light is multiplied by in each coarse pixel.
    fn relit(
        filter: &mut MovingImage,
        camera: &Camera,
        wall: f32,
        noise: impl Fn(usize) -> f32 + Sync,
        set: InstructionSet,
    ) -> Vec<Vec3> {
        let (width, coarse) = (COARSE.x as usize, surfaces(camera, wall, COARSE));
        let colors = images(&coarse);
        let read = |y: usize, to: &mut [Vec3], seen: &mut [PixelSurface]| {
            for x in 0..width {
                let i = y * width + x;
                let Seen { albedo, normal, position, .. } = coarse[i];
                to[x] = colors[i] * noise(i);
                seen[x] = PixelSurface { albedo, normal, position, is_bright: false };
            }
        };
        let input = MovingInput { width, height: COARSE.y as usize, read: &read, eye: camera.eye };
        filter.filter.smooth(&input, set, &|| false).expect("nothing stops it");
        let fine = surfaces(camera, wall, FINE);
        let (mut colors, mut present) = filter.take_finer(FINE, MIDDLE);
        let (mut row, length) = (FineRow::default(), present.row_length());
        let width = FINE.x as usize;
        let rows = colors.chunks_mut(width).zip(present.rows_mut().chunks_mut(length)).zip(fine.chunks(width));
        for (y, ((to, to_past), fine)) in rows.enumerate() {
            row.fill(fine, camera.eye);
            let place = FinePlace { camera, first: UVec2::new(0, y as u32), at: MIDDLE, size: FINE, weight: 1.0 };
            filter.relight_row(set, place, &row, to, to_past);
        }
        present.finish(camera);
        (filter.finer, filter.present) = (colors, present);
        filter.finer.clone()
    }

    /// Root of the mean squared relative error.
    fn error(found: &[Vec3], camera: &Camera, wall: f32) -> f32 {
        let truth = images(&surfaces(camera, wall, FINE));
        let sum: f32 = found.iter().zip(&truth).map(|(found, truth)| ((found.x - truth.x) / truth.x).powi(2)).sum();
        (sum / truth.len() as f32).sqrt()
    }

    /// Exponential noise, like that of a light that is hit now and then: mean 1.
    fn noise(image: u32) -> impl Fn(usize) -> f32 + Sync {
        move |i| {
            let number = hash_combine(hash_u32(i as u32), image) as f32 / u32::MAX as f32;
            -(1.0 - number.min(0.999_999)).ln()
        }
    }

    #[test]
    fn textures_and_edges_are_as_sharp_as_the_fine_image() {
        let (camera, mut filter) = (camera(0.0), MovingImage::default());
        let found = relit(&mut filter, &camera, 9.0, |_| 1.0, InstructionSet::detect());
        assert!(error(&found, &camera, 9.0) < 0.01, "{}", error(&found, &camera, 9.0));
    }

    /// Standard deviation of the light of the wall, over its mean.
    fn spread(found: &[Vec3], camera: &Camera) -> f32 {
        let all = found.iter().zip(surfaces(camera, 9.0, FINE)).filter(|(_, surface)| surface.object == WALL);
        let light: Vec<f32> = all.map(|(found, surface)| found.x / surface.albedo.x).collect();
        let n = light.len() as f32;
        let mean = light.iter().sum::<f32>() / n;
        (light.iter().map(|light| (light - mean).powi(2)).sum::<f32>() / n).sqrt() / mean
    }

    #[test]
    fn noise_falls_from_image_to_image_while_the_camera_moves() {
        let (mut alone, mut mixed) = (MovingImage::default(), MovingImage::default());
        let mut spreads = [0.0; 2];
        for image in 0..10 {
            let camera = camera(0.02 * image as f32);
            mixed.start_view(12.0);
            spreads = [&mut alone, &mut mixed]
                .map(|filter| spread(&relit(filter, &camera, 9.0, noise(image), InstructionSet::detect()), &camera));
        }
        assert!(spreads[1] < 0.75 * spreads[0], "{spreads:?}");
    }

    /// The wall is taken away, so that other surfaces come into view: they do not have its light.
    #[test]
    fn what_comes_into_view_has_light_of_its_own() {
        let (camera, mut filter) = (camera(0.0), MovingImage::default());
        for (wall, brightness) in [(3.0, 10.0), (9.0, 1.0)] {
            filter.start_view(12.0);
            let found = relit(&mut filter, &camera, wall, |_| brightness, InstructionSet::detect());
            if wall == 9.0 {
                // In the middle, where the near wall was.
                let i = (FINE.y / 2 * FINE.x + FINE.x / 2) as usize;
                let expected = images(&surfaces(&camera, wall, FINE))[i].x;
                assert!((found[i].x - expected).abs() < 0.01 * expected, "{} for {expected}", found[i].x);
            }
        }
    }

    /// A scene that changes keeps no more than it is told to.
    #[test]
    fn an_image_counts_as_no_more_than_it_may() {
        // The mean of the present light, 1, and of so many images with a light of 3.
        for (most, expected) in [(0.0, 1.0), (1.0, 2.0), (3.0, 2.5)] {
            let (camera, mut filter) = (camera(0.0), MovingImage::default());
            (0..6).for_each(|_| {
                filter.start_view(12.0);
                relit(&mut filter, &camera, 9.0, |_| 3.0, InstructionSet::detect());
            });
            filter.start_view(most);
            let found = relit(&mut filter, &camera, 9.0, |_| 1.0, InstructionSet::detect());
            let i = (FINE.y / 2 * FINE.x + FINE.x / 2) as usize;
            let found = found[i].x / images(&surfaces(&camera, 9.0, FINE))[i].x;
            assert!((found - expected).abs() < 0.02, "{found} for {most}");
        }
    }

    #[test]
    fn instruction_sets_change_no_bit() {
        let image = |set: InstructionSet| {
            let mut filter = MovingImage::default();
            let images = (0..3).map(|image| {
                filter.start_view(12.0);
                relit(&mut filter, &camera(0.02 * image as f32), 9.0, noise(image), set)
            });
            images.last()
        };
        let expected = image(InstructionSet::Portable);
        for set in InstructionSet::available() {
            assert_eq!(image(set), expected, "{set:?}");
        }
    }
}
