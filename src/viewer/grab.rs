//! Moving, rotating and scaling the selection with the mouse at once, as in Blender: X, Y and Z lock an axis, a number
//! can be typed, Enter or a click keeps the result, Esc or a right click restores what was there.

use crate::frame::gizmo::{Drag, Gizmo, Handle, Mode};
use crate::frame::{Edit, Projector};
use crate::viewer::handles::AXES;
use egui::{Context, LayerId, Pos2, Stroke};
use glam::{DVec2, DVec3};
use winit::keyboard::{Key, NamedKey};

const NAMES: [&str; 3] = ["X", "Y", "Z"];

/// A change of the selection that follows the mouse.
pub struct Grab {
    gizmo: Gizmo,
    projector: Projector,
    from: DVec2,
    mouse: DVec2,
    /// Steps rather than any amount.
    snap: bool,
    lock: Lock,
    /// The number so far.
    typed: String,
}

/// Along what it goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Lock {
    None,
    Axis(usize),
    /// Across this axis.
    Plane(usize),
}

/// What a key means.
#[derive(Clone, Debug, PartialEq)]
pub enum Answer {
    /// Show the amount again.
    Changed,
    Keep,
    Restore,
    /// The key is for nothing here.
    Nothing,
}

impl Grab {
    /// - `mouse`: in the window, points.
    pub fn new(gizmo: Gizmo, projector: Projector, mouse: DVec2) -> Self {
        Self { gizmo, projector, from: mouse, mouse, snap: false, lock: Lock::None, typed: String::new() }
    }

    pub fn mouse_at(&mut self, mouse: DVec2, snap: bool) {
        (self.mouse, self.snap) = (mouse, snap);
    }

    /// Handles a key press.
    pub fn key(&mut self, key: &Key, shift: bool) -> Answer {
        match key {
            Key::Named(NamedKey::Enter | NamedKey::Space) => return Answer::Keep,
            Key::Named(NamedKey::Escape) => return Answer::Restore,
            Key::Named(NamedKey::Backspace) => drop(self.typed.pop()),
            Key::Character(text) => match text.to_ascii_lowercase().as_str() {
                axis @ ("x" | "y" | "z") => {
                    let i = usize::from(axis.as_bytes()[0] - b'x');
                    let lock = if shift && self.gizmo.mode == Mode::Move { Lock::Plane(i) } else { Lock::Axis(i) };
                    // The same again releases it.
                    self.lock = if self.lock == lock { Lock::None } else { lock };
                }
                "-" if self.typed.starts_with('-') => drop(self.typed.remove(0)),
                "-" => self.typed.insert(0, '-'),
                "." | "," if !self.typed.contains('.') => self.typed.push('.'),
                digit if digit.len() == 1 && digit.as_bytes()[0].is_ascii_digit() && self.typed.len() < 12 => {
                    self.typed.push_str(digit);
                }
                _ => return Answer::Nothing,
            },
            _ => return Answer::Nothing,
        }
        Answer::Changed
    }

    /// The whole change so far; `None` where the mouse says nothing.
    pub fn edit(&self) -> Option<Edit> {
        Some(match self.drag()? {
            Drag::Move(by) => Edit::Move { by },
            Drag::Turn { axis, angle_deg } => Edit::Turn { axis, angle_deg },
            Drag::Scale(factors) => Edit::Scale { factors },
        })
    }

    /// The change that restores what was there.
    pub fn identity() -> Edit {
        Edit::Move { by: DVec3::ZERO }
    }

    fn drag(&self) -> Option<Drag> {
        let axis = match self.lock {
            Lock::Axis(i) => Some(i),
            _ => None,
        };
        if let Ok(number) = self.typed.parse::<f64>() {
            return match self.gizmo.mode {
                Mode::Move => Some(Drag::Move(number * self.gizmo.axes[axis.unwrap_or(0)])),
                Mode::Turn => {
                    // Counter-clockwise as seen.
                    let axis = axis.map_or_else(
                        || self.projector.towards(self.gizmo.center).map(|view| -view),
                        |i| Some(self.gizmo.axes[i]),
                    );
                    Some(Drag::Turn { axis: axis?, angle_deg: number })
                }
                Mode::Scale => self.scale(number),
            };
        }
        if self.gizmo.mode == Mode::Scale {
            let middle = self.projector.place(self.gizmo.center)?;
            let (before, now) = ((self.from - middle).length(), (self.mouse - middle).length());
            let factor = now / before.max(1.0);
            return self.scale(if self.snap { (10.0 * factor).round() / 10.0 } else { factor });
        }
        let handle = match self.lock {
            Lock::None => Handle::Middle,
            Lock::Axis(i) => Handle::Axis(i),
            Lock::Plane(i) => Handle::Plane(i),
        };
        self.gizmo.drag(handle, self.from, self.mouse, &self.projector, self.snap)
    }

    fn scale(&self, factor: f64) -> Option<Drag> {
        let mut factors = DVec3::ONE;
        match self.lock {
            Lock::Axis(i) => factors[i] = factor,
            _ => factors = DVec3::splat(factor),
        }
        (factor > 0.0 && factor.is_finite()).then_some(Drag::Scale(factors))
    }

    /// What happens and what one may do, for the status line.
    pub fn line(&self) -> String {
        let along = match (self.lock, self.gizmo.mode) {
            (Lock::None, _) => String::new(),
            (Lock::Axis(i), Mode::Turn) => format!(" about {}", NAMES[i]),
            (Lock::Axis(i), _) => format!(" along {}", NAMES[i]),
            (Lock::Plane(i), _) => format!(" across {}", NAMES[i]),
        };
        let amount = match self.drag() {
            _ if !self.typed.is_empty() => self.typed.clone(),
            None => "–".to_owned(),
            Some(Drag::Move(by)) => match self.lock {
                Lock::Axis(i) => format!("{:.3} m", by.dot(self.gizmo.axes[i])),
                _ => format!("{:.3}, {:.3}, {:.3} m", by.x, by.y, by.z),
            },
            Some(Drag::Turn { angle_deg, .. }) => format!("{angle_deg:.1}°"),
            Some(Drag::Scale(factors)) => match self.lock {
                Lock::Axis(i) => format!("× {:.3}", factors[i]),
                _ => format!("× {:.3}", factors.x),
            },
        };
        let mode = self.gizmo.mode.label();
        format!("{mode}{along}: {amount}   X Y Z: axis, type a number, Enter or click: done, Esc or right click: back")
    }

    /// Draws the axes that it goes along.
    pub fn draw(&self, context: &Context) {
        let axes: &[usize] = match &self.lock {
            Lock::None => &[],
            Lock::Axis(i) => std::slice::from_ref(i),
            Lock::Plane(0) => &[1, 2],
            Lock::Plane(1) => &[0, 2],
            Lock::Plane(_) => &[0, 1],
        };
        let painter = context.layer_painter(LayerId::background());
        let reach = 40.0 * self.gizmo.size;
        for &i in axes {
            let (center, along) = (self.gizmo.center, reach * self.gizmo.axes[i]);
            let Some(ends) = self.projector.segment(center - along, center + along) else { continue };
            let ends = ends.map(|place| Pos2::new(place.x as f32, place.y as f32));
            painter.line_segment(ends, Stroke::new(3.5, egui::Color32::from_black_alpha(150)));
            painter.line_segment(ends, Stroke::new(1.5, AXES[i]));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::navigation::Rig;
    use crate::scene::View;

    fn grab(mode: Mode) -> Grab {
        let view = View::look_at(DVec3::new(0.0, 0.0, 8.0), DVec3::ZERO, DVec3::Y).unwrap();
        let projector = Projector::new(&Rig { view, ..Rig::default() }, DVec2::new(800.0, 600.0));
        let gizmo = Gizmo::at(DVec3::ZERO, mode, DVec3::AXES, &projector).unwrap();
        Grab::new(gizmo, projector, DVec2::new(500.0, 300.0))
    }

    fn press(grab: &mut Grab, keys: &str) {
        for key in keys.chars() {
            assert_eq!(grab.key(&Key::Character(key.to_string().into()), false), Answer::Changed, "{key}");
        }
    }

    #[test]
    fn a_number_goes_along_the_axis_that_is_locked() {
        let mut grab = grab(Mode::Move);
        press(&mut grab, "y2.5");
        assert_eq!(grab.edit(), Some(Edit::Move { by: DVec3::new(0.0, 2.5, 0.0) }));
        press(&mut grab, "-");
        assert_eq!(grab.edit(), Some(Edit::Move { by: DVec3::new(0.0, -2.5, 0.0) }));
        assert!(grab.line().starts_with("move along Y: -2.5"), "{}", grab.line());
        assert_eq!(grab.key(&Key::Named(NamedKey::Backspace), false), Answer::Changed);
        press(&mut grab, "z");
        assert_eq!(grab.edit(), Some(Edit::Move { by: DVec3::new(0.0, 0.0, -2.0) }));
        assert_eq!(grab.key(&Key::Named(NamedKey::Enter), false), Answer::Keep);
        assert_eq!(grab.key(&Key::Named(NamedKey::Escape), false), Answer::Restore);
        assert_eq!(grab.key(&Key::Character("q".into()), false), Answer::Nothing);
    }

    #[test]
    fn the_mouse_moves_in_the_image_plane_or_along_an_axis() {
        let mut grab = grab(Mode::Move);
        grab.mouse_at(DVec2::new(600.0, 200.0), false);
        let metres = grab.projector.metres_at(DVec3::ZERO).unwrap();
        let Some(Edit::Move { by }) = grab.edit() else { panic!() };
        assert!((by - 100.0 * metres * DVec3::new(1.0, 1.0, 0.0)).length() < 1e-9, "{by}");
        press(&mut grab, "x");
        let Some(Edit::Move { by }) = grab.edit() else { panic!() };
        assert!((by - 100.0 * metres * DVec3::X).length() < 1e-9, "{by}");
        // The same key again releases the axis; with Shift, everything but the axis is free.
        press(&mut grab, "x");
        assert_eq!(grab.lock, Lock::None);
        grab.key(&Key::Character("Z".into()), true);
        let Some(Edit::Move { by }) = grab.edit() else { panic!() };
        assert!(by.z == 0.0 && by.y > 0.0, "{by}");
    }

    #[test]
    fn scaling_is_by_the_distance_from_the_middle_and_rotating_by_the_angle() {
        let mut scale = grab(Mode::Scale);
        scale.mouse_at(DVec2::new(400.0, 100.0), false);
        assert_eq!(scale.edit(), Some(Edit::Scale { factors: DVec3::splat(2.0) }));
        press(&mut scale, "x3");
        assert_eq!(scale.edit(), Some(Edit::Scale { factors: DVec3::new(3.0, 1.0, 1.0) }));
        let mut turn = grab(Mode::Turn);
        // From the right of the middle to above it: a quarter, counter-clockwise as seen.
        turn.mouse_at(DVec2::new(400.0, 200.0), false);
        let Some(Edit::Turn { axis, angle_deg }) = turn.edit() else { panic!() };
        assert!((axis.z * angle_deg - 90.0).abs() < 1e-9, "{axis} {angle_deg}");
        press(&mut turn, "90");
        assert_eq!(turn.edit(), Some(Edit::Turn { axis: DVec3::Z, angle_deg: 90.0 }));
    }
}
