//! Commands that move the camera.

use crate::frame::command::Command;
use crate::frame::core::rig::Rig;
use crate::frame::navigation::{
    Surroundings, dolly_above, fly, focus_at, in_parallel, level, orbit_above, pan, roll, scale_aperture, scale_focus,
    set_aperture, stride, toggle_depth_of_field, turn, view_from, view_from_behind, zoom,
};
use glam::DVec3;

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
            let (yaw, pitch) = (yaw_deg.to_radians(), pitch_deg.to_radians());
            with_view(orbit_above(&view, yaw, pitch, around.turning, around.ground))
        }
        Command::Pan { right, up } => with_view(pan(&view, &projection, right, up)),
        // With parallel rays, approaching does not enlarge.
        Command::Dolly { factor } if projection.orthographic_height.is_some() => {
            Some(Rig { projection: zoom(&projection, factor), ..*rig })
        }
        Command::Dolly { factor } => with_view(dolly_above(&view, factor, around.turning, around.ground)),
        Command::Zoom { factor } => Some(Rig { projection: zoom(&projection, factor), ..*rig }),
        Command::Roll { angle_deg } => with_view(roll(&view, angle_deg.to_radians())),
        Command::Level => with_view(level(&view)),
        Command::ViewFrom(side) => {
            let projection = in_parallel(&projection, view.pivot_distance);
            Some(Rig { view: view_from(&view, side), projection, ..*rig })
        }
        Command::ViewFromBehind => with_view(view_from_behind(&view)),
        // What is in focus, and how much, is no matter of where one stands.
        Command::Home => Some(Rig { lens, ..around.home }),
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::core::rig::Turning;
    use crate::scene::View;
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
            ground: None,
        }
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
        assert_eq!(go(Command::Home), Rig { lens: rig.lens, ..around.home });
        let flown = go(Command::Fly { right: 0.0, up: 0.0, forward: 2.0 }).view;
        assert!(((flown.eye - rig.view.eye).length() - 2.0 * stride(&rig.view, 3.0, None)).abs() < 1e-14);
        assert_eq!(go(Command::ScaleFocus { factor: 2.0 }).view, rig.view);
        assert_eq!(steer(&rig, &Command::Restart, &around), None);
        assert_eq!(steer(&rig, &Command::FocusAt { x: 0.5, y: 0.5 }, &around), None);
    }
}
