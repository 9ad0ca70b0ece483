//! Images that spot lights project.

use crate::common::scene::WholeScene;
use crate::common::surface::{Change, Use};
use firstlight_format::light::{LightKind, SpotLight};
use firstlight_format::parts::LightPart;
use firstlight_render::TexturePattern;
use glam::{DAffine3, DMat3, DVec2, DVec3};

/// The image that a spot light projects.
pub(crate) struct Projected {
    /// `None`: it is white.
    pub texture: Option<Use>,
    pub light: SpotLight,
    position: DVec3,
    /// Unit vectors to the right and upwards in the image, and along its middle.
    axes: [DVec3; 3],
    /// Tangents of half the angles that it fills, horizontally and vertically.
    pub half: DVec2,
    /// Width over height of the image in pixels.
    pub aspect: f64,
}

impl Projected {
    /// `None` for all other lights.
    pub(crate) fn of(scene: &WholeScene, part: &LightPart) -> Option<Self> {
        let LightPart::Spot { texture, .. } = part else { return None };
        let (kind, placement) = LightKind::from_part(part);
        let (LightKind::Spot(light), Some(direction)) = (kind, kind.direction(&placement)) else { return None };
        if texture.is_none() && !light.image.is_shaped() {
            return None;
        }
        let pattern = texture.as_ref().map(|name| &scene.textures[name].texture.pattern);
        let aspect = match pattern {
            Some(TexturePattern::Image { image, .. }) => f64::from(image.width) / f64::from(image.height),
            _ => 1.0,
        };
        let texture = texture.as_ref().map(|name| Use { name: name.clone(), change: Change::Nothing });
        let half = light.image.half(light.outer_angle_deg, aspect);
        let [right, up] = light.image.axes(&placement, direction);
        Some(Self { texture, light, position: placement.translation, axes: [right, up, direction], half, aspect })
    }

    /// Whether its cone cuts something off the image, or dims its edge.
    pub(crate) fn is_cut(&self) -> bool {
        // With room for the rounding of degrees.
        self.light.inner_angle_deg.to_radians().tan() < self.half.length() * (1.0 - 1e-6)
    }

    /// From the axes of the light to the world.
    ///
    /// - `x`, `y`: factors of the axes that point to the right and upwards in the image.
    pub(crate) fn world(&self, x: f64, y: f64) -> DAffine3 {
        let [right, up, axis] = self.axes;
        DAffine3::from_mat3_translation(DMat3::from_cols(x * right, y * up, axis), self.position)
    }
}
