//! Temporal antialiasing and upsampling of images of a moving camera (Karis 2014; Yang, Liu and Salvi 2020).
//!
//! The rays of an image go through another place in their pixels than those of the image before. Each pixel of a finer
//! grid mixes the color of the rays around it, as far as one is near, with what the images before had at the place where
//! its surface was then: so edges and textures are smooth, and finer than the rays of one image.
//!
//! Nothing is taken from where another object was, which has been uncovered since. Elsewhere what the images before had
//! counts within the spread of the colors of the rays around (Salvi 2016): what is wrong is soon gone.
//!
//! Colors are mixed as they are displayed, roughly: a pixel that an emitter covers in part is not white.

use crate::core::camera::Camera;
use crate::driver::relight::past::Past;
use bytemuck::cast_slice;
use firstlight_simd::{Float, InstructionSet, Real, Simd, dispatch};
use glam::{IVec2, UVec2, Vec2, Vec3, Vec4};
use rayon::prelude::*;

/// Weight of an image without a ray that is near a pixel; that of a ray through its middle is 1.
const FAR: f32 = 0.01;
/// Standard deviations that colors of images before may lie from those of the rays, where the same surface is seen; one
/// elsewhere. More keeps finer shadows, and what is left behind edges for longer.
const SURE: f32 = 2.0;
/// Number of rays that is more than any pixel is the mean of.
const COUNTLESS: f32 = 1e6;
/// Depth of what is infinitely far away, metres: moves as little when the camera does.
const FARTHEST: f32 = 1e9;

/// Mixes images, one after another.
#[derive(Default)]
pub struct Antialiased {
    /// Of the image, and of those before.
    present: Means,
    past: Means,
    /// The image, radiance.
    colors: Vec<Vec3>,
    /// Of the rays: their colors, compressed, and the spread around them.
    shades: Vec<Vec4>,
    spreads: Vec<Spread>,
}

/// The means of an image and those before.
#[derive(Default)]
struct Means {
    /// Pixels.
    size: UVec2,
    /// Colors, compressed, and the number of rays that each is the mean of.
    list: Vec<Vec4>,
    /// `None` if there is no image.
    camera: Option<Camera>,
    /// For which colors are compressed.
    exposure: f32,
}

/// An image with next to no noise, as one that images of the next views are mixed with: it counts as as many as may be.
pub struct StillImage(Means);

impl StillImage {
    /// - `colors`: radiance; `size`: pixels; `camera`: of its view; `exposure`: what radiance is multiplied by for the
    ///   display.
    pub fn new(colors: &[Vec3], size: UVec2, camera: &Camera, exposure: f32) -> Self {
        let list = colors.par_iter().map(|color| compressed(*color, exposure).extend(COUNTLESS)).collect();
        Self(Means { size, list, camera: Some(*camera), exposure })
    }
}

/// An image by one ray per pixel.
pub struct Rays<'a> {
    /// Radiance.
    pub colors: &'a [Vec3],
    /// Its depths, size, and where in pixels the rays go through.
    pub past: &'a Past,
    pub camera: &'a Camera,
    pub set: InstructionSet,
    /// What radiance is multiplied by for the display.
    pub exposure: f32,
    /// Number of images that it counts as.
    pub weight: f32,
    /// Number of images that those before count as, at most.
    pub most: f32,
}

/// Of the colors of a ray and the eight around it, about their mean, and the ray's own.
///
/// The fourth lanes tell how far its surface moves to the image before, over the size of the film; they are not numbers
/// if it was not in view.
#[derive(Clone, Copy, Default)]
struct Spread {
    low: Vec4,
    high: Vec4,
}

impl Antialiased {
    /// Begins with another image.
    pub fn start(&mut self) {
        if self.present.camera.is_some() {
            std::mem::swap(&mut self.present, &mut self.past);
            self.present.camera = None;
        }
    }

    /// Takes over an image of the present view.
    pub fn settle(&mut self, still: StillImage) {
        self.present = still.0;
    }

    /// Mixes an image with those before; returns the result, of `size` pixels, radiance, or `None` if `stop` returned
    /// true.
    pub fn mix(&mut self, rays: &Rays, size: UVec2, stop: &(dyn Fn() -> bool + Sync)) -> Option<&[Vec3]> {
        let Self { present, past, colors, shades, spreads } = self;
        let before = past.camera.as_ref().filter(|_| past.exposure == rays.exposure);
        shades.clear();
        shades.par_extend(rays.colors.par_iter().map(|color| compressed(*color, rays.exposure).extend(0.0)));
        spreads.resize(shades.len(), Spread::default());
        let (shades, n_columns) = (&*shades, rays.past.size().x as usize);
        let rows = spreads.par_chunks_exact_mut(n_columns).enumerate();
        let done = rows.map(|(y, to)| {
            let set = rays.set;
            dispatch!(set, spread_row(shades: &[Vec4], rays: &Rays, before: Option<&Camera>, y: usize, to: &mut [Spread]));
            !stop()
        });
        // Rows without their spread would tell of places in images that are not there.
        if !done.all(|done| done) {
            return None;
        }
        let n = size.x as usize * size.y as usize;
        present.list.resize(n, Vec4::ZERO);
        colors.resize(n, Vec3::ZERO);
        (present.size, present.camera, present.exposure) = (size, None, rays.exposure);
        let grid = Grid::new(rays.past, size);
        let most = rays.most * grid.ratio.element_product();
        let (width, past, spreads) = (size.x as usize, &*past, &*spreads);
        let rows = present.list.par_chunks_exact_mut(width).zip(colors.par_chunks_exact_mut(width)).enumerate();
        let row = MixedRow { grid, past, shades, spreads, weight: rays.weight, most, exposure: rays.exposure };
        let done = rows.map(|(y, (means, colors))| {
            let (row, set) = (&row, rays.set);
            dispatch!(set, mix_row(row: &MixedRow, y: usize, means: &mut [Vec4], colors: &mut [Vec3]));
            !stop()
        });
        if !done.all(|done| done) {
            return None;
        }
        present.camera = Some(*rays.camera);
        Some(colors)
    }

    /// The latest image, radiance, and its size.
    pub fn latest(&self) -> (&[Vec3], UVec2) {
        (&self.colors, self.present.size)
    }
}

/// What all rows of an image are mixed from.
struct MixedRow<'a> {
    grid: Grid,
    past: &'a Means,
    shades: &'a [Vec4],
    spreads: &'a [Spread],
    weight: f32,
    /// Images before count as at most so many rays.
    most: f32,
    exposure: f32,
}

/// The instruction set changes no bit, but makes it half as fast again.
#[inline(always)]
fn mix_row<S: Simd>(s: S, row: &MixedRow, y: usize, means: &mut [Vec4], colors: &mut [Vec3]) {
    let inverse = row.grid.size.recip();
    for (x, (mean, color)) in means.iter_mut().zip(colors).enumerate() {
        let center = Vec2::new(x as f32, y as f32) + 0.5;
        let (near, shade) = row.grid.around(row.shades, center);
        let Spread { low, high } = row.spreads[near.index];
        let weight = row.weight * near.weight;
        let old = row.past.at(s, center * inverse + Vec2::new(low.w, high.w)).unwrap_or(Vec4::ZERO);
        let n = old.w.clamp(0.0, row.most);
        *mean = (old.max(low).min(high) * n + shade * weight) / (n + weight);
        mean.w = n + weight;
        *color = expanded(mean.truncate(), row.exposure);
    }
}

/// The spreads of a row of rays.
///
/// - `shades`: of all rays; `before`: the camera of the image before.
#[inline(always)]
fn spread_row<S: Simd>(_: S, shades: &[Vec4], rays: &Rays, before: Option<&Camera>, y: usize, to: &mut [Spread]) {
    let (size, at) = (rays.past.size(), rays.past.at());
    let (width, film) = (size.x as usize, size.as_vec2());
    let rows = [y.saturating_sub(1), y, (y + 1).min(size.y as usize - 1)].map(|y| &shades[y * width..][..width]);
    let surfaces = rays.past.depths(y).iter().zip(rays.past.seen_before(y));
    for ((x, to), (depth, seen)) in to.iter_mut().enumerate().zip(surfaces) {
        let columns = [x.saturating_sub(1), x, (x + 1).min(width - 1)];
        // Of differences, so that a constant has no spread.
        let own = rows[1][x];
        let (mut sum, mut squares) = (Vec4::ZERO, Vec4::ZERO);
        for color in rows.iter().flat_map(|row| columns.map(|x| row[x])) {
            let off = color - own;
            sum += off;
            squares += off * off;
        }
        let (off, mean) = (sum / 9.0, own + sum / 9.0);
        let variance = (squares / 9.0 - off * off).max(Vec4::ZERO);
        let deviation = Vec4::from(variance.to_array().map(f32::sqrt));
        let place = Vec2::new(x as f32, y as f32) + at;
        // Where another object was seen, nothing is taken from it.
        let before = before.filter(|_| *seen >= 0.0);
        let from = before.and_then(|before| moved(before, rays.camera, place, film, *depth));
        let back = from.map_or(Vec2::NAN, |from| (from - place) / film);
        let reach = if *seen > 0.0 && rays.most > 1.0 { deviation * SURE } else { deviation };
        let [low, high] = [(mean - reach).min(own), (mean + reach).max(own)];
        *to = Spread { low: low.with_w(back.x), high: high.with_w(back.y) };
    }
}

/// Where on its film a camera sees what another one sees at a place of its film, at this depth.
#[inline(always)]
fn moved(to: &Camera, from: &Camera, film: Vec2, size: Vec2, depth: f32) -> Option<Vec2> {
    let ray = from.middle_ray(film, size);
    let depth = if depth.is_finite() { depth } else { FARTHEST };
    let point = ray.at(depth / ray.dir.dot(from.forward));
    to.connection(Vec2::ZERO, point, size).map(|found| found.film.into())
}

/// Colors 0..1, such that differences are about as visible everywhere.
fn compressed(color: Vec3, exposure: f32) -> Vec3 {
    let color = (color * exposure).clamp(Vec3::ZERO, Vec3::splat(1e6));
    color / (1.0 + color.max_element())
}

/// The inverse.
#[inline(always)]
fn expanded(color: Vec3, exposure: f32) -> Vec3 {
    color / ((1.0 - color.max_element()).max(1e-6) * exposure)
}

/// The grid of the result among the rays.
struct Grid {
    /// Of the result, pixels.
    size: Vec2,
    /// Rays, and where they go through their pixels.
    rays: IVec2,
    at: Vec2,
    /// Rays per pixel of the result, and the inverse.
    ratio: Vec2,
    inverse: Vec2,
}

/// The ray next to a pixel.
struct Near {
    index: usize,
    /// 0..1.
    weight: f32,
}

impl Grid {
    fn new(rays: &Past, size: UVec2) -> Self {
        let (size, film) = (size.as_vec2(), rays.size().as_vec2());
        Self { size, rays: rays.size().as_ivec2(), at: rays.at(), ratio: film / size, inverse: size / film }
    }

    /// The ray next to a place, and the color there.
    #[inline(always)]
    fn around(&self, shades: &[Vec4], center: Vec2) -> (Near, Vec4) {
        let place = center * self.ratio - self.at;
        let corner = place.floor();
        let part = place - corner;
        let (first, last) = (corner.as_ivec2(), self.rays - 1);
        let columns = [first.x, first.x + 1].map(|x| x.clamp(0, last.x) as usize);
        let rows = [first.y, first.y + 1].map(|y| y.clamp(0, last.y) as usize * self.rays.x as usize);
        let [right, down] = [part.x, part.y].map(|part| usize::from(part >= 0.5));
        let off = (part - Vec2::new(right as f32, down as f32)).abs() * self.inverse;
        let weight = (1.0 - off.x).max(0.0) * (1.0 - off.y).max(0.0);
        let index = rows[down] + columns[right];
        if weight > FAR {
            return (Near { index, weight }, shades[index]);
        }
        let [above, below] = rows.map(|row| shades[row + columns[0]].lerp(shades[row + columns[1]], part.x));
        (Near { index, weight: FAR }, above.lerp(below, part.y))
    }
}

impl Means {
    /// Cubic interpolation (Catmull and Rom 1974), which keeps what is sharp, within the four values around; `None` outside
    /// of the film.
    ///
    /// - `film`: over its size.
    #[inline(always)]
    fn at<S: Simd>(&self, s: S, film: Vec2) -> Option<Vec4> {
        // False if it is not a number, too.
        if !(film.cmpge(Vec2::ZERO).all() && film.cmplt(Vec2::ONE).all()) {
            return None;
        }
        let place = film * self.size.as_vec2() - 0.5;
        let corner = place.floor();
        let part = place - corner;
        let (first, last) = (corner.as_ivec2() - 1, self.size.as_ivec2() - 1);
        let width = self.size.x as usize;
        let is_inside = first.cmpge(IVec2::ZERO).all() && (first + 3).cmple(last).all();
        // The four values of a row are sixteen numbers.
        let row = |dy: i32| {
            let y = (first.y + dy).clamp(0, last.y) as usize;
            let row = &self.list[y * width..][..width];
            if is_inside {
                let numbers: &[f32] = cast_slice(&row[first.x as usize..]);
                return Float::load(s, numbers.first_chunk().expect("four values are inside"));
            }
            let taps: [Vec4; 4] = std::array::from_fn(|dx| row[(first.x + dx as i32).clamp(0, last.x) as usize]);
            Float::load(s, &bytemuck::cast(taps))
        };
        let rows = [row(0), row(1), row(2), row(3)];
        let [above, a, b, below] = cubic(part.y);
        let sum = (rows[0] * above + rows[1] * a) + (rows[2] * b + rows[3] * below);
        let values = |numbers: Float<S>| -> [Vec4; 4] { bytemuck::cast(numbers.to_array()) };
        let ([sums, low, high], across) =
            ([sum, rows[1].min(rows[2]), rows[1].max(rows[2])].map(values), cubic(part.x));
        let sum = (sums[0] * across[0] + sums[1] * across[1]) + (sums[2] * across[2] + sums[3] * across[3]);
        Some(sum.max(low[1].min(low[2])).min(high[1].max(high[2])))
    }
}

/// Weights of four values for a place between the two in the middle.
#[inline(always)]
fn cubic(part: f32) -> [f32; 4] {
    let (square, cube) = (part * part, part * part * part);
    [
        -0.5 * part + square - 0.5 * cube,
        1.0 - 2.5 * square + 1.5 * cube,
        0.5 * part + 2.0 * square - 1.5 * cube,
        -0.5 * square + 0.5 * cube,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sampler;

    const RAYS: UVec2 = UVec2::new(48, 32);
    const SIZE: UVec2 = UVec2::new(96, 64);

    /// Squares on a wall, 2 metres away.
    fn wall(camera: &Camera, film: Vec2, size: Vec2) -> Vec3 {
        let ray = camera.middle_ray(film, size);
        let point = ray.at(2.0 / ray.dir.dot(camera.forward));
        let square = (point * 5.0).floor();
        Vec3::splat(if (square.x + square.y).rem_euclid(2.0) < 0.5 { 0.9 } else { 0.1 })
    }

    fn moved_camera(x: f32) -> Camera {
        Camera { eye: Vec3::new(x, 0.0, 0.0), tan_half_vfov: 0.5, ..Camera::default() }
    }

    /// Mixes in an image of rays through a place in their pixels.
    fn mix(image: &mut Antialiased, camera: &Camera, at: Vec2, most: f32, color: impl Fn(Vec2) -> Vec3) -> Vec<Vec3> {
        mix_by(InstructionSet::detect(), image, camera, at, most, color)
    }

    fn mix_by(
        set: InstructionSet,
        image: &mut Antialiased,
        camera: &Camera,
        at: Vec2,
        most: f32,
        color: impl Fn(Vec2) -> Vec3,
    ) -> Vec<Vec3> {
        // Surfaces are seen before as far as the light is the same.
        let seen = if most > 1.0 { 1.0 } else { 0.0 };
        let past = Past::of_depth(RAYS, at, 2.0, seen);
        let places = (0..RAYS.y).flat_map(|y| (0..RAYS.x).map(move |x| UVec2::new(x, y).as_vec2() + at));
        let colors: Vec<Vec3> = places.map(color).collect();
        image.start();
        let rays = Rays { colors: &colors, past: &past, camera, set, exposure: 1.0, weight: 1.0, most };
        image.mix(&rays, SIZE, &|| false).expect("nothing stops it").to_vec()
    }

    /// Root of the mean squared difference from means over pixels.
    fn error(found: &[Vec3], camera: &Camera) -> f32 {
        let of_pixel = |i: usize| {
            let corner = UVec2::new(i as u32 % SIZE.x, i as u32 / SIZE.x).as_vec2();
            let parts = (0..16).map(|k| corner + (Vec2::new((k % 4) as f32, (k / 4) as f32) + 0.5) / 4.0);
            parts.map(|film| wall(camera, film, SIZE.as_vec2()).x).sum::<f32>() / 16.0
        };
        let squares = found.iter().enumerate().map(|(i, color)| (color.x - of_pixel(i)).powi(2));
        (squares.sum::<f32>() / found.len() as f32).sqrt()
    }

    #[test]
    fn edges_become_finer_than_the_rays_while_the_camera_moves() {
        let mut image = Antialiased::default();
        let mut errors = Vec::new();
        for number in 0..16 {
            let camera = moved_camera(0.013 * number as f32);
            let at = Sampler::new(0, 0, 0, number).pair(0);
            let found = mix(&mut image, &camera, at, 12.0, |film| wall(&camera, film, RAYS.as_vec2()));
            errors.push(error(&found, &camera));
        }
        assert!(errors[15] < 0.7 * errors[0], "{errors:?}");
    }

    /// As when the camera moves on while the first image of a view is being mixed.
    #[test]
    fn an_image_that_is_stopped_at_once_is_none() {
        let (camera, past) = (moved_camera(0.0), Past::of_depth(RAYS, Vec2::splat(0.5), 2.0, 0.0));
        let colors = vec![Vec3::ONE; (RAYS.x * RAYS.y) as usize];
        let set = InstructionSet::detect();
        let rays = Rays { colors: &colors, past: &past, camera: &camera, set, exposure: 1.0, weight: 1.0, most: 1.0 };
        let mut image = Antialiased::default();
        image.start();
        assert!(image.mix(&rays, SIZE, &|| true).is_none());
        assert!(image.mix(&rays, SIZE, &|| false).is_some());
    }

    #[test]
    fn what_has_changed_is_gone_at_once() {
        let (mut image, camera) = (Antialiased::default(), moved_camera(0.0));
        for _ in 0..8 {
            mix(&mut image, &camera, Vec2::splat(0.5), 12.0, |_| Vec3::splat(4.0));
        }
        let found = mix(&mut image, &camera, Vec2::splat(0.5), 1.0, |_| Vec3::splat(0.5));
        assert!(found.iter().all(|color| (color.x - 0.5).abs() < 1e-4), "{}", found[0]);
    }

    #[test]
    fn a_settled_image_stays_sharp_when_the_camera_begins_to_move() {
        let (mut image, camera) = (Antialiased::default(), moved_camera(0.0));
        let pixels = (0..SIZE.y).flat_map(|y| (0..SIZE.x).map(move |x| UVec2::new(x, y).as_vec2() + 0.5));
        let settled: Vec<Vec3> = pixels.map(|film| wall(&camera, film, SIZE.as_vec2())).collect();
        image.settle(StillImage::new(&settled, SIZE, &camera, 1.0));
        let camera = moved_camera(0.013);
        let color = |film| wall(&camera, film, RAYS.as_vec2());
        let next = |image: &mut Antialiased| error(&mix(image, &camera, Vec2::splat(0.5), 12.0, color), &camera);
        let [begun, alone] = [next(&mut image), next(&mut Antialiased::default())];
        assert!(begun < 0.6 * alone, "{begun} and {alone}");
    }

    #[test]
    fn instruction_sets_change_no_bit() {
        let image = |set: InstructionSet| {
            let mut image = Antialiased::default();
            let images = (0..3).map(|number| {
                let camera = moved_camera(0.02 * number as f32);
                let at = Sampler::new(0, 0, 0, number).pair(0);
                mix_by(set, &mut image, &camera, at, 12.0, |film| wall(&camera, film, RAYS.as_vec2()))
            });
            images.last()
        };
        let expected = image(InstructionSet::Portable);
        for set in InstructionSet::available() {
            assert_eq!(image(set), expected, "{set:?}");
        }
    }

    #[test]
    fn a_constant_image_stays_as_it_is() {
        let mut image = Antialiased::default();
        for (number, value) in [(0, 3.0), (1, 3.0), (2, 3.0)] {
            let camera = moved_camera(0.1 * number as f32);
            let at = Sampler::new(0, 0, 0, number).pair(0);
            let found = mix(&mut image, &camera, at, 12.0, |_| Vec3::new(value, 0.5 * value, 0.0));
            let is_same = |color: &Vec3| (*color - Vec3::new(value, 0.5 * value, 0.0)).abs().max_element() < 1e-4;
            assert!(found.iter().all(is_same), "{number}: {}", found[0]);
        }
    }

    #[test]
    fn infinite_and_undefined_colors_last_no_longer_than_their_rays() {
        let (mut image, camera) = (Antialiased::default(), moved_camera(0.0));
        for bad in [f32::INFINITY, f32::NAN] {
            mix(&mut image, &camera, Vec2::splat(0.5), 12.0, |_| Vec3::splat(bad));
        }
        let found = mix(&mut image, &camera, Vec2::splat(0.5), 1.0, |_| Vec3::ONE);
        assert!(found.iter().all(|color| (*color - 1.0).abs().max_element() < 1e-3), "{}", found[0]);
    }
}
