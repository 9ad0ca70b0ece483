//! Light of earlier images, carried along while the camera moves (the temporal part of SVGF, Schied et al. 2017).
//!
//! Each pixel of a fine image keeps its light without albedo, how many images that is the mean of, and what it shows. A
//! pixel of the next image finds itself in the one before by the point that it shows; what is seen in a mirror is a point
//! behind it. Neighbours there count if they show the same object at the expected depth.

use crate::core::camera::Camera;
use firstlight_simd::{Bits, Float, LANES, Real, Simd, Vector, select};
use glam::{UVec2, Vec2, Vec3};

/// Planes of a row: light, number of images, depth, object, and how the surface was seen in the image before.
pub const N_PAST: usize = 7;
const IMAGES: usize = 3;
const DEPTH: usize = 4;
const OBJECT: usize = 5;
const SEEN: usize = 6;

/// The light of an image.
#[derive(Default)]
pub struct Past {
    /// Planes of a row lie together.
    numbers: Vec<f32>,
    size: UVec2,
    /// Where in its pixel each ray went through, 0..1.
    at: Vec2,
    /// `None` if there is no image.
    camera: Option<Camera>,
}

impl Past {
    /// Begins with an image of this size; there is none until [`Self::finish`].
    ///
    /// - `at`: where in its pixel each ray goes through, 0..1.
    pub fn start(&mut self, size: UVec2, at: Vec2) {
        (self.size, self.at, self.camera) = (size, at, None);
        let n = size.y as usize * self.row_length();
        if self.numbers.len() != n {
            self.numbers = vec![0.0; n];
        }
    }

    /// All rows are written, as this camera sees them.
    pub fn finish(&mut self, camera: &Camera) {
        self.camera = Some(*camera);
    }

    /// There is no image.
    pub fn forget(&mut self) {
        self.camera = None;
    }

    /// Whether there is an image.
    pub fn is_there(&self) -> bool {
        self.camera.is_some()
    }

    /// Numbers of a row, all planes.
    pub fn row_length(&self) -> usize {
        N_PAST * self.stride()
    }

    /// Pixels.
    pub fn size(&self) -> UVec2 {
        self.size
    }

    /// Where in its pixel each ray goes through, 0..1.
    pub fn at(&self) -> Vec2 {
        self.at
    }

    /// Depths of a row, metres.
    pub fn depths(&self, y: usize) -> &[f32] {
        self.row(DEPTH, y)
    }

    /// How the surfaces of a row were seen in the image before: above 0 if all rays around show them, below 0 if none shows
    /// their object, 0 else.
    pub fn seen_before(&self, y: usize) -> &[f32] {
        self.row(SEEN, y)
    }

    fn row(&self, plane: usize, y: usize) -> &[f32] {
        let row = &self.numbers[y * self.row_length()..];
        &row[plane * self.stride()..][..self.size.x as usize]
    }

    pub fn rows_mut(&mut self) -> &mut [f32] {
        &mut self.numbers
    }

    fn stride(&self) -> usize {
        (self.size.x as usize).next_multiple_of(LANES)
    }

    /// The image, if there is one of at least 2 × 2 pixels.
    ///
    /// - `most`: it counts as at most so many images.
    pub fn seen(&self, most: f32) -> Option<SeenPast<'_>> {
        let camera = self.camera.as_ref().filter(|_| self.size.min_element() > 1)?;
        let pixel = camera.pixel_size(self.size.as_vec2());
        Some(SeenPast {
            numbers: &self.numbers,
            size: self.size,
            at: self.at,
            stride: self.stride(),
            camera,
            pixel,
            most,
        })
    }
}

/// An image before.
#[derive(Clone, Copy)]
pub struct SeenPast<'a> {
    numbers: &'a [f32],
    size: UVec2,
    at: Vec2,
    stride: usize,
    camera: &'a Camera,
    /// Side of a pixel on the film of the camera.
    pixel: f32,
    most: f32,
}

/// Share of the rays around that may show something else, for rounding.
const NEARLY_NONE: f32 = 1e-3;
/// Distance from the expected depth that counts as the same surface, over the depth.
const DEPTH_TOLERANCE: f32 = 0.003;

impl SeenPast<'_> {
    /// Light of points in the image, and the number of images that it is the mean of, zero where they cannot be seen; and how
    /// they are seen, as for [`Past::seen_before`].
    ///
    /// - `points`: in the frame of the snapshot; `cos`: between their normals and the way to the camera; `objects`: their
    ///   objects.
    #[inline(always)]
    pub fn light_of<S: Simd>(
        &self,
        s: S,
        points: Vector<S>,
        cos: Float<S>,
        objects: Float<S>,
    ) -> (Vector<S>, [Float<S>; 2]) {
        let (zero, one) = (cos.all(0.0), cos.all(1.0));
        let size = self.size.as_vec2();
        let found = self.camera.connections([zero, zero], points, size);
        let [u, v] = [found.film[0] - self.at.x, found.film[1] - self.at.y];
        let is_inside = zero.lt(found.depth)
            & u.lt(zero.all(size.x - 0.5))
            & v.lt(zero.all(size.y - 0.5))
            & zero.all(-0.5).le(u)
            & zero.all(-0.5).le(v);
        let (u, v) = (select(is_inside, u.at_least(0.0), zero), select(is_inside, v.at_least(0.0), zero));
        let (left, top) = (u.at_most(size.x - 2.0).truncate(), v.at_most(size.y - 2.0).truncate());
        let (right, below) = ((u - left.to_float()).at_most(1.0), (v - top.to_float()).at_most(1.0));
        let row_length = (N_PAST * self.stride) as u32;
        let corner = left + top * row_length;
        // As far as a surface goes away within two pixels, and what is bent between them.
        let across = match self.camera.orthographic {
            None => found.depth * (2.0 * self.pixel),
            Some(_) => zero.all(2.0 * self.pixel),
        };
        let tolerance = across / cos.abs().at_least(0.05) + found.depth * DEPTH_TOLERANCE;
        let mut light = Vector::splat(s, Vec3::ZERO);
        let (mut images, mut total, mut is_hidden) = (zero, zero, is_inside);
        let unknown = zero.all(u32::MAX as f32);
        for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let share = if dx == 0 { one - right } else { right } * if dy == 0 { one - below } else { below };
            let index = corner + (dx + dy * row_length);
            let object = self.plane(OBJECT, index);
            let is_object = object.equals(objects) | unknown.le(objects) | unknown.le(object);
            is_hidden &= !is_object;
            let is_near = (self.plane(DEPTH, index) - found.depth).abs().le(tolerance);
            let is_same = is_inside & is_object & is_near;
            let weight = select(is_same, share, zero);
            let tap = Vector { x: self.plane(0, index), y: self.plane(1, index), z: self.plane(2, index) };
            light = light + tap * weight;
            images += self.plane(IMAGES, index) * weight;
            total += weight;
        }
        let inverse = select(zero.lt(total), one / total, zero);
        let is_whole = one.lt(total + NEARLY_NONE);
        let seen = select(is_whole, one, select(is_hidden, -one, zero));
        (light * inverse, [(images * inverse).at_most(self.most), seen])
    }

    #[inline(always)]
    fn plane<S: Simd>(&self, plane: usize, index: Bits<S>) -> Float<S> {
        Float::gather(&self.numbers[plane * self.stride..], index)
    }
}

/// Writes sixteen pixels of a row.
///
/// - `row`: all planes; `at`: the first of the pixels.
#[inline(always)]
pub fn store<S: Simd>(
    row: &mut [f32],
    at: usize,
    light: Vector<S>,
    [images, depth, object, seen]: [Float<S>; N_PAST - 3],
) {
    let stride = row.len() / N_PAST;
    let planes = [light.x, light.y, light.z, images, depth, object, seen];
    for (k, numbers) in planes.into_iter().enumerate() {
        numbers.store(row[k * stride + at..].first_chunk_mut().expect("rows are padded"));
    }
}

#[cfg(test)]
impl Past {
    /// An image whose rays all end at this depth, on surfaces that were seen so in the image before.
    pub fn of_depth(size: UVec2, at: Vec2, depth: f32, seen: f32) -> Self {
        let mut past = Self::default();
        past.start(size, at);
        let stride = past.stride();
        for (plane, numbers) in past.numbers.chunks_exact_mut(stride).enumerate() {
            numbers.fill(if plane % N_PAST == DEPTH { depth } else { seen });
        }
        past
    }
}
