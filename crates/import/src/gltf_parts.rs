//! Nodes of a glTF file in the words of a scene file: placements, cameras and lights.

use crate::gltf::assembly::PlacedLight;
use crate::gltf::cameras::{GltfCamera, Lens};
use crate::gltf::lights::GltfLightKind;
use firstlight_format::bounds;
use firstlight_format::camera::CameraPart;
use firstlight_format::parts::{LightPart, TransformPart};
use firstlight_format::value::Rgb;
use firstlight_render::Falloff;
use glam::{DAffine3, DVec3};

/// A camera as a scene file says it.
///
/// - `center`: middle of the scene, metres, which it turns about.
pub(crate) fn camera_of(camera: &GltfCamera, center: DVec3) -> CameraPart {
    /// Degrees.
    const WIDEST: f64 = 179.0;
    const NARROWEST: f64 = 0.01;
    let depth = (center - camera.eye).dot(camera.forward);
    let (vfov, orthographic_height) = match camera.lens {
        Lens::Perspective(yfov) => (yfov, None),
        // In perspective, with the same height at the distance of the scene's centre.
        Lens::Orthographic(half) => (2.0 * (half / depth.max(half)).atan(), Some(2.0 * half)),
    };
    CameraPart {
        look_at: None,
        forward: Some(camera.forward),
        pivot_distance: (depth > bounds::MIN_SIZE && depth < bounds::MAX_COORDINATE).then_some(depth),
        up: camera.up,
        vfov: vfov.to_degrees().clamp(NARROWEST, WIDEST),
        orthographic_height,
        ..CameraPart::looking_at(camera.eye, camera.eye + camera.forward)
    }
}

/// A light as a scene file says it.
pub(crate) fn light_of(placed: &PlacedLight, name: Option<String>) -> LightPart {
    let position = placed.world.translation;
    let direction = placed.world.transform_vector3(DVec3::NEG_Z).normalize_or(DVec3::NEG_Z);
    let (intensity, hidden) = (Rgb(placed.light.intensity), placed.is_hidden);
    match placed.light.kind {
        GltfLightKind::Point => LightPart::Point { name, hidden, position, intensity, radius: 0.0 },
        GltfLightKind::Spot { inner, outer } => LightPart::Spot {
            name,
            hidden,
            position,
            direction,
            intensity,
            inner_angle: inner.to_degrees(),
            outer_angle: outer.to_degrees(),
            falloff: Falloff::Quadratic,
            texture: None,
            up: DVec3::Y,
            image_width: 0.0,
            image_height: 0.0,
            even: false,
            transform: TransformPart::default(),
        },
        GltfLightKind::Directional => LightPart::Directional {
            name,
            hidden,
            direction,
            irradiance: intensity,
            transform: TransformPart::default(),
        },
    }
}

/// Extends bounds by a box that is placed in the world.
pub(crate) fn extend(bounds: &mut (DVec3, DVec3), (min, max): (DVec3, DVec3), world: &DAffine3) {
    for i in 0..8 {
        let pick = |axis: usize| if i >> axis & 1 == 0 { min[axis] } else { max[axis] };
        let corner = world.transform_point3(DVec3::new(pick(0), pick(1), pick(2)));
        *bounds = (bounds.0.min(corner), bounds.1.max(corner));
    }
}
