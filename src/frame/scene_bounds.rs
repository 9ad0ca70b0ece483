//! Size, ground and home position of the scene, for navigation.

use crate::frame::core::rig::{Rig, Turning};
use crate::frame::navigation::Surroundings;
use crate::scene::{Extent, Material, ObjectInput, SceneInputs, Shape, View};
use bevy_ecs::prelude::Resource;
use glam::DVec3;

/// Size, ground and home position of the scene, for navigation.
#[derive(Resource, Clone, Debug)]
pub struct SceneBounds {
    /// A sphere around the finite objects, for framing and speeds.
    pub extent: Extent,
    /// Corners of the boxes of these objects, for framing.
    pub corners: Vec<DVec3>,
    /// The camera as it was when the scene was opened.
    pub home: Rig,
    /// The mode of turning.
    pub turning: Turning,
    /// The direction of a view from a side, for which the camera has parallel rays until it turns.
    pub side_view: Option<DVec3>,
    /// Distance to the target of flying, metres.
    pub pace: Option<f64>,
    /// The view that was moved nearer to its pivot by a wall, and the distance to which orbits take it again.
    pub reach: Option<(View, f64)>,
    /// Height of the ground that the home position is above, metres: of a plane, of which there is nothing to be seen from
    /// below.
    pub ground: Option<f64>,
    /// Height of the floor that the home position stands on, metres.
    pub floor: Option<f64>,
}

impl SceneBounds {
    /// Returns the reference sizes for commands, in an image of this aspect (width over height).
    pub fn surroundings(&self, aspect: f64) -> Surroundings {
        let Extent { center, radius } = self.extent;
        Surroundings {
            center,
            radius,
            home: self.home,
            aspect,
            turning: self.turning,
            pace: self.pace,
            ground: self.ground.or(self.floor),
        }
    }

    /// Whether a camera at this position sees nothing but the back of the ground.
    pub fn is_below_ground(&self, eye: DVec3) -> bool {
        self.ground.is_some_and(|ground| eye.y < ground)
    }
}

/// Height of the highest horizontal, opaque plane below a position that faces up; `None` without one.
pub fn ground_below(inputs: &SceneInputs, eye: DVec3) -> Option<f64> {
    let height = |object: &ObjectInput| {
        let Shape::Plane { normal } = object.shape else { return None };
        let up = object.placement.linear().inverse().transpose() * normal;
        let slot = object.slots.first()?;
        let material = &inputs.materials.iter().find(|input| input.entity == *slot)?.material;
        (up.x == 0.0 && up.z == 0.0 && up.y > 0.0 && hides(material)).then_some(object.placement.translation.y)
    };
    inputs.objects.iter().filter_map(height).filter(|height| *height < eye.y).max_by(f64::total_cmp)
}

/// Whether nothing is ever seen through a surface of this material.
fn hides(material: &Material) -> bool {
    type M = Material;
    matches!(material, M::Diffuse { .. } | M::Plastic { .. } | M::Mirror { .. } | M::Metal { .. })
        || matches!(material, M::Conductor { .. } | M::Phong { .. } | M::Emissive { .. })
}
