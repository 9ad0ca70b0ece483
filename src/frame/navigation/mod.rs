//! Camera navigation: pure functions from one view to the next.
//!
//! Each keeps the axes of the view orthonormal to rounding, without drift over millions of steps, and returns the view
//! unchanged for invalid amounts (not finite, a factor of zero). All computation is f64 in the scene's frame, so a
//! camera a million metres from the origin moves as smoothly as one at it.
//!
//! This file interprets commands; `moves` has the changes of a view, `lens` those of focus and aperture. Start reading
//! at [`steer`].

mod lens;
mod moves;

pub use lens::{focus_at, scale_aperture, scale_focus, set_aperture, toggle_depth_of_field};
pub use moves::{VERTICAL, dolly, fly, frame_points, frame_rig, level, orbit, pan, roll, turn, zoom};

pub use super::rig::{Rig, Turning};

use super::command::Command;
use crate::scene::View;
use glam::DVec3;

/// Reference sizes for the amounts of commands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surroundings {
    /// Centre of a sphere around everything finite in the scene, metres.
    pub center: DVec3,
    /// Radius of that sphere, metres; 0 if nothing is finite.
    pub radius: f64,
    /// The view of [`Command::Home`].
    pub home: Rig,
    /// Width of the image over its height.
    pub aspect: f64,
    /// The mode of turning.
    pub turning: Turning,
    /// Distance to the target of flying in metres, if known.
    pub pace: Option<f64>,
}

/// Executes a command that needs the camera and its reference sizes only; `None` for every other command.
pub fn steer(rig: &Rig, command: &Command, around: &Surroundings) -> Option<Rig> {
    let Rig { view, projection, lens } = *rig;
    let with_view = |view| Some(Rig { view, ..*rig });
    let with_lens = |lens| Some(Rig { lens, ..*rig });
    match *command {
        Command::Turn { yaw_deg, pitch_deg } => {
            with_view(turn(&view, yaw_deg.to_radians(), pitch_deg.to_radians(), around.turning))
        }
        Command::Fly { right, up, forward } => {
            with_view(fly(&view, DVec3::new(right, up, forward) * stride(&view, around.radius, around.pace)))
        }
        Command::Orbit { yaw_deg, pitch_deg } => {
            with_view(orbit(&view, yaw_deg.to_radians(), pitch_deg.to_radians(), around.turning))
        }
        Command::Pan { right, up } => with_view(pan(&view, &projection, right, up)),
        // With parallel rays, approaching does not enlarge.
        Command::Dolly { factor } if projection.orthographic_height.is_some() => {
            Some(Rig { projection: zoom(&projection, factor), ..*rig })
        }
        Command::Dolly { factor } => with_view(dolly(&view, factor)),
        Command::Zoom { factor } => Some(Rig { projection: zoom(&projection, factor), ..*rig }),
        Command::Roll { angle_deg } => with_view(roll(&view, angle_deg.to_radians())),
        Command::Level => with_view(level(&view)),
        Command::Home => Some(around.home),
        Command::SetView(view) => with_view(view),
        Command::SetProjection(projection) => Some(Rig { projection, ..*rig }),
        Command::SetLens(lens) => with_lens(lens),
        Command::ScaleFocus { factor } => with_lens(scale_focus(&lens, factor, view.pivot_distance)),
        Command::SetFocus { distance } => with_lens(focus_at(&lens, distance)),
        Command::ScaleAperture { factor } => with_lens(scale_aperture(&lens, factor)),
        Command::SetAperture { radius } => with_lens(set_aperture(&lens, radius)),
        Command::ToggleDepthOfField => with_lens(toggle_depth_of_field(&lens)),
        _ => None,
    }
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
    use std::f64::consts::FRAC_PI_2;

    fn start() -> View {
        View::look_at(DVec3::new(3.0, 2.0, 4.0), DVec3::new(0.5, 0.25, -0.5), DVec3::Y).unwrap()
    }

    fn around(turning: Turning) -> Surroundings {
        Surroundings {
            center: DVec3::new(1.0, 0.0, 2.0),
            radius: 3.0,
            home: Rig::default(),
            aspect: 1.5,
            turning,
            pace: None,
        }
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

    #[test]
    fn commands_reach_the_right_part_of_the_rig() {
        let rig = Rig { view: start(), ..Rig::default() };
        let around = around(Turning::Turntable);
        let go = |command| steer(&rig, &command, &around).unwrap();
        assert_eq!(
            go(Command::Turn { yaw_deg: 90.0, pitch_deg: 0.0 }).view,
            turn(&rig.view, FRAC_PI_2, 0.0, Turning::Turntable)
        );
        assert_eq!(go(Command::Home), around.home);
        let flown = go(Command::Fly { right: 0.0, up: 0.0, forward: 2.0 }).view;
        assert!(((flown.eye - rig.view.eye).length() - 2.0 * stride(&rig.view, 3.0, None)).abs() < 1e-14);
        assert_eq!(go(Command::ScaleFocus { factor: 2.0 }).view, rig.view);
        assert_eq!(steer(&rig, &Command::Restart, &around), None);
        assert_eq!(steer(&rig, &Command::FocusAt { x: 0.5, y: 0.5 }, &around), None);
    }
}
