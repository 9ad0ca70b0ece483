//! Lights that project an image through a frustum, in the scenes of other renderers.

use crate::model::foreign::ReadImage;
use firstlight_files::relative::text_to_path;
use firstlight_format::parts::{LightPart, TransformPart};
use firstlight_format::sources::TextureSource;
use firstlight_format::value::Rgb;
use firstlight_render::{Falloff, ImageTexture};
use glam::{DMat3, DVec3, Vec3};
use std::path::Path;

/// The image of a texture; `None` if it cannot be read, which is told when it is loaded.
///
/// - `folder`: of the scene.
pub(crate) fn image_of(read: ReadImage, folder: &Path, source: &TextureSource) -> Option<ImageTexture> {
    let TextureSource::Image { file, .. } = source else { return None };
    read(&folder.join(text_to_path(file)))
}

/// Width over height.
pub(crate) fn aspect_of(image: &ImageTexture) -> f64 {
    f64::from(image.width) / f64::from(image.height)
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
