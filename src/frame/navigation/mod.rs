//! Camera navigation: pure functions from one view to the next.
//!
//! Each keeps the axes of the view orthonormal to rounding, without drift over millions of steps, and returns the view
//! unchanged for invalid amounts (not finite, a factor of zero). All computation is f64 in the scene's frame, so a
//! camera a million metres from the origin moves as smoothly as one at it.
//!
//! `moves` has the changes of a view, `lens` those of focus and aperture.

mod lens;
mod moves;

pub use lens::{focus_at, scale_aperture, scale_focus, set_aperture, toggle_depth_of_field};
pub use moves::{
    VERTICAL, box_around, dolly_above, fly, frame_points, frame_rig, in_parallel, in_perspective, level, orbit,
    orbit_above, pan, roll, turn, view_from, view_from_behind, zoom,
};

pub use crate::frame::core::rig::{Rig, Side, Turning};

use crate::scene::View;
use glam::DVec3;

/// Reference sizes for the amounts of commands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surroundings {
    /// Centre of a sphere around everything finite in the scene, metres.
    pub center: DVec3,
    /// Radius of that sphere, metres; 0 if nothing is finite.
    pub radius: f64,
    /// The view of [`Command::Home`](crate::frame::Command::Home).
    pub home: Rig,
    /// Width of the image over its height.
    pub aspect: f64,
    /// The mode of turning.
    pub turning: Turning,
    /// Distance to the target of flying in metres, if known.
    pub pace: Option<f64>,
    /// Height of the ground that orbits stay above, metres.
    pub ground: Option<f64>,
}

/// Distance flown per second at speed 1, metres: half of the distance to the target. If that is unknown, half of the
/// smaller of the pivot distance and the scene's radius, so that neither a room seen from inside nor a model seen from
/// afar is left in one step.
pub fn stride(view: &View, scene_radius: f64, pace: Option<f64>) -> f64 {
    let size = if scene_radius > 0.0 { scene_radius.min(view.pivot_distance) } else { view.pivot_distance };
    // Clamped, so that the camera can leave a wall directly in front of it, and does not reach the horizon in a second.
    0.5 * pace.map_or(size, |pace| pace.clamp(0.02 * size, 4.0 * size))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn start() -> View {
        View::look_at(DVec3::new(3.0, 2.0, 4.0), DVec3::new(0.5, 0.25, -0.5), DVec3::Y).unwrap()
    }

    #[test]
    fn strides_fit_the_scene() {
        let view = start();
        assert_eq!(stride(&view, 0.0, None), 0.5 * view.pivot_distance);
        assert_eq!(stride(&view, 1e9, None), 0.5 * view.pivot_distance);
        assert_eq!(stride(&view, 0.5, None), 0.25);
        assert_eq!(stride(&view, 0.5, Some(0.7)), 0.35, "half of the way to what is under the mouse");
        assert_eq!(stride(&view, 0.5, Some(1e9)), 1.0, "and the horizon stays where it is");
    }
}
