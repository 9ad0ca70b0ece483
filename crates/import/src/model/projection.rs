//! Lights that project an image through a frustum, in the scenes of other renderers.

use firstlight_files::relative::text_to_path;
use firstlight_format::parts::{LightPart, TransformPart};
use firstlight_format::sources::TextureSource;
use firstlight_format::value::Rgb;
use firstlight_render::{Falloff, ImageTexture, Texels};
use glam::{DMat3, DVec2, DVec3, Vec3};
use std::collections::HashMap;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

type ReadImage = dyn Fn(&Path) -> Option<ImageTexture> + Send + Sync;

/// The images of the lights of a scene, each read once.
pub(crate) struct LightImages {
    read: Box<ReadImage>,
    known: Mutex<HashMap<String, Option<Arc<LightImage>>>>,
}

/// What a light needs to know of its image: a small one with the same light.
pub(crate) struct LightImage {
    /// Width over height.
    pub aspect: f64,
    columns: usize,
    /// Share of each cell in the mean of the image, weighted by Rec. 709 luminance; from the first row on.
    luminance: Vec<f64>,
}

impl LightImages {
    /// - `read`: reads an image; `None` if it cannot be read.
    pub fn new(read: impl Fn(&Path) -> Option<ImageTexture> + Send + Sync + 'static) -> Self {
        Self { read: Box::new(read), known: Mutex::default() }
    }

    /// Whether an image is not grey; `false` if it cannot be read, which is told when it is loaded.
    ///
    /// - `folder`: of the scene.
    pub fn has_colours(&self, folder: &Path, file: &str) -> bool {
        let is_coloured = |Vec3 { x, y, z }| x != y || y != z;
        let image = (self.read)(&folder.join(text_to_path(file)));
        image.is_some_and(|image| (0..image.len()).any(|i| is_coloured(image.linear(i))))
    }

    /// Whether an image has an alpha channel; `false` if it cannot be read.
    ///
    /// - `folder`: of the scene.
    pub fn has_alpha(&self, folder: &Path, file: &str) -> bool {
        let image = (self.read)(&folder.join(text_to_path(file)));
        image.is_some_and(|image| {
            matches!(image.texels, Texels::U8 { channels: 2 | 4, .. } | Texels::U16 { channels: 2 | 4, .. })
        })
    }

    /// The image of a texture; `None` if it cannot be read, which is told when it is loaded.
    ///
    /// - `folder`: of the scene.
    pub fn of(&self, folder: &Path, source: &TextureSource) -> Option<Arc<LightImage>> {
        let TextureSource::Image { file, .. } = source else { return None };
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        let read = || Some(Arc::new(LightImage::of(&(self.read)(&folder.join(text_to_path(file)))?)));
        known.entry(file.clone()).or_insert_with(read).clone()
    }
}

impl LightImage {
    fn of(image: &ImageTexture) -> Self {
        /// Cells along each side: within one, the angle from the axis is nearly the same.
        const CELLS: usize = 128;
        let (width, height) = (image.width as usize, image.height as usize);
        let (columns, rows) = (width.min(CELLS), height.min(CELLS));
        let mut luminance = vec![0.0; columns * rows];
        for i in 0..image.len() {
            let cell = i / width * rows / height * columns + i % width * columns / width;
            luminance[cell] += image.linear(i).as_dvec3().dot(DVec3::new(0.2126, 0.7152, 0.0722)) / image.len() as f64;
        }
        Self { aspect: f64::from(image.width) / f64::from(image.height), columns, luminance }
    }

    /// Flux of the image as intensity, weighted by luminance.
    ///
    /// - `tangents`: of half the angles that it fills.
    pub fn flux(&self, tangents: [f64; 2]) -> f64 {
        let size = DVec2::new(self.columns as f64, (self.luminance.len() / self.columns) as f64);
        let of_cell = |(i, luminance): (usize, &f64)| {
            let at = DVec2::new((i % self.columns) as f64, (i / self.columns) as f64);
            let on_wall = (2.0 * (at + 0.5) / size - 1.0) * DVec2::from(tangents);
            luminance * (1.0 + on_wall.length_squared()).sqrt().recip().powi(3)
        };
        4.0 * tangents[0] * tangents[1] * self.luminance.iter().enumerate().map(of_cell).sum::<f64>()
    }
}

/// Tangents of an image in the world, by those in the space of a light that shines along its Z.
pub(crate) fn stretched(world: &DMat3, [width, height]: [f64; 2]) -> [f64; 2] {
    let [x, y, z] = [world.x_axis, world.y_axis, world.z_axis].map(DVec3::length);
    [width * x / z, height * y / z]
}

/// A light of intensity 1 at the origin, along −Z, of which nothing but its image bounds the light.
///
/// - `tangents`: of half the angles that the image fills, horizontally and vertically.
pub(crate) fn projection(tangents: [f64; 2]) -> LightPart {
    let [width, height] = tangents.map(|tangent| (2.0 * tangent.atan().to_degrees()).clamp(1e-6, 179.999));
    let corner = tangents[0].hypot(tangents[1]).atan().to_degrees().clamp(1e-6, 90.0);
    LightPart::Spot {
        name: None,
        hidden: false,
        position: DVec3::ZERO,
        direction: DVec3::NEG_Z,
        intensity: Rgb(Vec3::ONE),
        // At the corners it is cut by the image.
        inner_angle: corner,
        outer_angle: corner,
        falloff: Falloff::Quadratic,
        texture: None,
        up: DVec3::Y,
        image_width: width,
        image_height: height,
        even: false,
        transform: TransformPart::default(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicU32, Ordering};

    fn image(width: u32, height: u32) -> ImageTexture {
        let texel = |i: u32| Vec3::splat((i * 7919 % 101 + 1) as f32);
        ImageTexture::from_linear(width, height, (0..width * height).map(texel).collect())
    }

    #[test]
    fn an_image_of_many_lights_is_read_once() {
        static N_READ: AtomicU32 = AtomicU32::new(0);
        let images = LightImages::new(|path| {
            N_READ.fetch_add(1, Ordering::Relaxed);
            path.ends_with("a.png").then(|| image(3, 2))
        });
        for _ in 0..3 {
            let of = |name: &str| images.of(Path::new("scene"), &TextureSource::image(name.to_owned()));
            assert_eq!(of("a.png").map(|image| image.aspect), Some(1.5));
            assert!(of("missing.png").is_none());
        }
        assert_eq!(N_READ.load(Ordering::Relaxed), 2);
    }

    #[test]
    fn the_flux_is_the_integral_over_all_texels() {
        let tangents = [0.7, 0.4];
        for (width, height) in [(1, 1), (5, 3), (300, 170)] {
            let image = image(width, height);
            let expected: f64 = (0..image.len() as u32)
                .map(|i| {
                    let at = DVec2::new((i % width).into(), (i / width).into()) + 0.5;
                    let on_wall = (2.0 * at / DVec2::new(width.into(), height.into()) - 1.0) * DVec2::from(tangents);
                    f64::from(image.linear(i as usize).x) * (1.0 + on_wall.length_squared()).powf(-1.5)
                })
                .sum();
            let expected = 4.0 * 0.7 * 0.4 * expected / image.len() as f64;
            let found = LightImage::of(&image).flux(tangents);
            assert!((found / expected - 1.0).abs() < 1e-3, "{width} × {height}: {found} {expected}");
        }
    }
}
