//! From keys and mouse to commands. Knows no window and no clock: it is told what happened and when.
//!
//! Nothing depends on how often [`Input::take`] is called: a held key moves by the time it was down, a drag by the
//! distance it went, and whatever happens between two calls is added up into one command of a kind.

mod sum;
#[cfg(test)]
mod tests;

use super::keys::{Action, Motion, action_of, motion_of};
use crate::frame::{Command, Edit, Navigation};
use std::time::{Duration, Instant};
use sum::{Sum, add};
use winit::event::MouseButton;
use winit::keyboard::{Key, ModifiersState, PhysicalKey};

/// Degrees a second while an orbit or roll key is down.
const ORBIT_RATE_DEG: f64 = 75.0;
const ROLL_RATE_DEG: f64 = 45.0;
/// Once around in 18 seconds.
const SPIN_RATE_DEG: f64 = 20.0;
/// Picture heights a second.
const PAN_RATE: f64 = 0.5;
/// What Shift multiplies the flying speed by.
const FAST: f64 = 4.0;
/// A tap that is over within a frame still moves as if the key had been down for so long, seconds.
const TAP: f64 = 1.0 / 30.0;

/// Degrees for a drag over the picture's height.
const LOOK_DRAG_DEG: f64 = 90.0;
const ORBIT_DRAG_DEG: f64 = 240.0;
/// A drag over the picture's height divides the distance to the pivot by e to this.
const ZOOM_DRAG: f64 = 2.0;
/// Pixels that a pressed mouse may tremble without turning the view.
const CLICK_SLACK: f64 = 4.0;
const DOUBLE_CLICK: Duration = Duration::from_millis(400);

/// A notch of the wheel multiplies or divides by this.
const SPEED_NOTCH: f64 = 1.25;
const ZOOM_NOTCH: f64 = 1.1;
/// Flying speed, strides a second; the wheel stays within.
const SPEED_RANGE: (f64, f64) = (1.0 / 256.0, 256.0);

/// What is being pressed and dragged, and what that adds up to since it was last asked.
#[derive(Debug)]
pub struct Input {
    navigation: Navigation,
    modifiers: ModifiersState,
    held: Vec<Held>,
    drag: Option<Drag>,
    last_press: Option<(Instant, [f64; 2])>,
    /// Window size and mouse position, physical pixels.
    size: [f64; 2],
    cursor: [f64; 2],
    /// Strides a second.
    speed: f64,
    /// Since when the camera goes around by itself and has not been counted.
    spin: Option<Instant>,
    /// A drag with the left button moves around the pivot, not the camera's direction.
    orbits: bool,
    /// The mouse moves the view without a button.
    captured: bool,
    /// What is under the mouse is focused on.
    focuses: bool,
    sum: Sum,
}

#[derive(Debug)]
struct Held {
    motion: Motion,
    /// Up to when it has been counted, and how many seconds that was.
    since: Instant,
    counted: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum DragKind {
    Look,
    /// Looks about, and letters fly as long as it lasts.
    Fly,
    Orbit,
    Pan,
    /// Nearer to the pivot or farther from it.
    Zoom,
    Focus,
}

#[derive(Debug)]
struct Drag {
    kind: DragKind,
    button: MouseButton,
    /// Where the mouse was last; until it `moved` out of the slack, where it was pressed.
    last: [f64; 2],
    moved: bool,
    /// Begun with Ctrl: a click selects beside what is selected, a drag orbits.
    ctrl: bool,
}

impl Input {
    /// For a window of this size, physical pixels.
    pub fn new(width: u32, height: u32, navigation: Navigation) -> Self {
        Self {
            navigation,
            modifiers: ModifiersState::empty(),
            held: Vec::new(),
            drag: None,
            last_press: None,
            size: [f64::from(width), f64::from(height)],
            cursor: [0.0; 2],
            speed: 1.0,
            spin: None,
            orbits: false,
            captured: false,
            focuses: false,
            sum: Sum::default(),
        }
    }

    pub fn resize(&mut self, width: u32, height: u32) {
        self.size = [f64::from(width), f64::from(height)];
    }

    pub fn set_modifiers(&mut self, modifiers: ModifiersState, now: Instant) {
        // What was held so far was held with the old ones.
        self.count(now);
        self.modifiers = modifiers;
    }

    /// Keys and gestures.
    pub fn navigation(&self) -> Navigation {
        self.navigation
    }

    /// Other keys and gestures from now on.
    pub fn set_navigation(&mut self, navigation: Navigation, now: Instant) {
        self.release_motions(now, |_| true);
        self.drag = None;
        self.navigation = navigation;
    }

    /// Whether holding this key moves: under a preset, letters fly only while a drag does.
    fn moves(&self, motion: Motion) -> bool {
        let flies = self.drag.as_ref().is_some_and(|drag| drag.kind == DragKind::Fly);
        self.navigation == Navigation::Firstlight || !motion.flies() || flies
    }

    /// Strides a second.
    pub fn speed(&self) -> f64 {
        self.speed
    }

    /// A key that moves is down, so time alone changes the view.
    pub fn is_moving(&self) -> bool {
        !self.held.is_empty() || self.spin.is_some()
    }

    /// The camera goes around by itself from now on, or stops.
    pub fn toggle_spin(&mut self, now: Instant) {
        self.count(now);
        self.spin = if self.spin.is_some() { None } else { Some(now) };
    }

    pub fn is_spinning(&self) -> bool {
        self.spin.is_some()
    }

    /// A plain drag moves around the pivot from now on, or looks about again; true for the first.
    pub fn toggle_orbits(&mut self) -> bool {
        self.orbits = !self.orbits;
        self.orbits
    }

    pub fn orbits(&self) -> bool {
        self.orbits
    }

    /// From now on the mouse moves the view by itself, as told by [`Self::mouse_moved`], or only with a button again.
    pub fn set_captured(&mut self, captured: bool) {
        self.captured = captured;
        self.drag = None;
    }

    pub fn is_captured(&self) -> bool {
        self.captured
    }

    /// Whether to focus on what is under the mouse, wherever it goes.
    pub fn set_focuses(&mut self, focuses: bool) {
        self.focuses = focuses;
    }

    /// A captured mouse was moved, pixels.
    pub fn mouse_moved(&mut self, x: f64, y: f64) {
        if self.captured {
            let height = self.size[1].max(1.0);
            self.turn([x / height, y / height], self.orbits);
        }
    }

    /// Heights of the picture, downwards positive.
    fn turn(&mut self, [dx, dy]: [f64; 2], orbits: bool) {
        // The view goes where the mouse goes; what is orbited sticks to the mouse.
        if orbits {
            add(&mut self.sum.orbit, [-dx * ORBIT_DRAG_DEG, dy * ORBIT_DRAG_DEG]);
        } else {
            add(&mut self.sum.turn, [dx * LOOK_DRAG_DEG, -dy * LOOK_DRAG_DEG]);
        }
    }

    /// A mouse button that turns, moves or focuses is down.
    pub fn is_dragging(&self) -> bool {
        self.drag.is_some()
    }

    /// Where the mouse is, physical pixels.
    pub fn cursor_place(&self) -> [f64; 2] {
        self.cursor
    }

    pub fn modifiers(&self) -> ModifiersState {
        self.modifiers
    }

    /// Flying speed, strides a second.
    pub fn set_speed(&mut self, speed: f64, now: Instant) {
        self.count(now);
        self.speed = speed.clamp(SPEED_RANGE.0, SPEED_RANGE.1);
    }

    /// A key went down (again, if `repeat`) or up; answers with what is to be done besides moving.
    pub fn key(
        &mut self,
        physical: PhysicalKey,
        typed: &Key,
        pressed: bool,
        repeat: bool,
        now: Instant,
    ) -> Option<Action> {
        if let Some(motion) = motion_of(physical) {
            if !pressed {
                self.release(motion, now);
                return None;
            }
            // With Ctrl or Super, letters are commands of the program or of the desktop.
            if self.moves(motion) && !self.modifiers.control_key() && !self.modifiers.super_key() {
                let flies = |motion| {
                    !matches!(motion, Motion::OrbitLeft | Motion::OrbitRight | Motion::OrbitUp | Motion::OrbitDown)
                };
                // How fast is decided by where the flight begins, not anew at every tree that passes.
                if !repeat && flies(motion) && self.held.is_empty() {
                    self.sum.pace = Some(self.place());
                }
                if !repeat && !self.held.iter().any(|held| held.motion == motion) {
                    self.held.push(Held { motion, since: now, counted: 0.0 });
                }
                return None;
            }
        }
        let action = pressed.then(|| action_of(self.navigation, physical, typed, self.modifiers)).flatten()?;
        // Only steps repeat: a toggle held down would flicker, a screenshot held down would fill the disk.
        let steps = matches!(
            action,
            Action::Send(
                Command::ScaleFocus { .. }
                    | Command::ScaleAperture { .. }
                    | Command::Dolly { .. }
                    | Command::Zoom { .. }
                    | Command::AdjustExposure { .. }
                    | Command::Edit(Edit::Undo | Edit::Redo)
            )
        );
        (steps || !repeat).then_some(action)
    }

    /// The window lost the keyboard: whatever is let go now will not be told.
    pub fn release_all(&mut self, now: Instant) {
        self.release_motions(now, |_| true);
        self.drag = None;
        self.modifiers = ModifiersState::empty();
    }

    fn release_motions(&mut self, now: Instant, which: impl Fn(Motion) -> bool) {
        let motions: Vec<Motion> = self.held.iter().map(|held| held.motion).filter(|motion| which(*motion)).collect();
        for motion in motions {
            self.release(motion, now);
        }
    }

    /// What a drag with this button does, if anything.
    fn kind_of_drag(&self, button: MouseButton) -> Option<DragKind> {
        use MouseButton::{Left, Middle, Right};
        let Modifiers { ctrl, shift, alt } = Modifiers::of(self.modifiers);
        Some(match (self.navigation, button) {
            (Navigation::Blender, Left) if alt && shift => DragKind::Pan,
            (Navigation::Blender, Left) if alt && ctrl => DragKind::Zoom,
            (Navigation::Blender, Middle) if ctrl => DragKind::Zoom,
            (Navigation::Maya, Middle) => DragKind::Pan,
            (Navigation::Maya, Right) if alt || ctrl => DragKind::Zoom,
            (Navigation::Blender | Navigation::Maya, Right) => DragKind::Fly,
            (_, Left) if shift => DragKind::Focus,
            (_, Left) if alt => DragKind::Orbit,
            (_, Left) => DragKind::Look,
            (_, Middle) if shift => DragKind::Pan,
            (_, Middle) => DragKind::Orbit,
            (_, Right) => DragKind::Pan,
            _ => return None,
        })
    }

    /// A mouse button went down or up.
    pub fn button(&mut self, button: MouseButton, pressed: bool, now: Instant) {
        if self.captured {
            return;
        }
        if !pressed {
            let Some(drag) = self.drag.take_if(|drag| drag.button == button) else { return };
            if drag.kind == DragKind::Look && !drag.moved {
                // The second click of two focuses, and leaves the selection of the first.
                let second = self.last_press.is_none();
                self.sum.pick = (!second).then(|| (self.place(), drag.ctrl)).or(self.sum.pick);
            }
            if drag.kind == DragKind::Fly {
                self.release_motions(now, Motion::flies);
            }
            return;
        }
        let Some(kind) = self.kind_of_drag(button) else { return };
        if kind == DragKind::Focus {
            self.sum.focus = Some(self.place());
        }
        if kind == DragKind::Look {
            let again = self.last_press.is_some_and(|(then, place)| {
                now.saturating_duration_since(then) < DOUBLE_CLICK && distance(place, self.cursor) <= CLICK_SLACK
            });
            if again {
                self.sum.focus = Some(self.place());
                self.sum.pivot = Some(self.place());
            }
            // A third press begins anew.
            self.last_press = (!again).then_some((now, self.cursor));
        }
        let ctrl = self.modifiers.control_key();
        self.drag = Some(Drag { kind, button, last: self.cursor, moved: false, ctrl });
    }

    /// The mouse is at this place of the window, physical pixels.
    pub fn cursor(&mut self, x: f64, y: f64) {
        let moved = self.cursor != [x, y];
        self.cursor = [x, y];
        let place = self.place();
        if self.focuses && moved && !self.captured {
            self.sum.follow = Some(place);
        }
        let height = self.size[1].max(1.0);
        let Some(drag) = &mut self.drag else { return };
        if !drag.moved {
            if distance(drag.last, self.cursor) <= CLICK_SLACK {
                return;
            }
            drag.moved = true;
        }
        let [dx, dy] = [(x - drag.last[0]) / height, (y - drag.last[1]) / height];
        drag.last = self.cursor;
        let (kind, ctrl) = (drag.kind, drag.ctrl);
        match kind {
            // Window managers take drags with Alt, and leave those with Ctrl.
            DragKind::Look => self.turn([dx, dy], self.orbits || ctrl),
            DragKind::Fly => self.turn([dx, dy], false),
            // Up and to the right is nearer.
            DragKind::Zoom => self.sum.dolly -= (dx - dy) * ZOOM_DRAG,
            DragKind::Orbit => self.turn([dx, dy], true),
            // What is panned sticks to the mouse.
            DragKind::Pan => add(&mut self.sum.pan, [-dx, dy]),
            DragKind::Focus => self.sum.focus = Some(place),
        }
    }

    /// The wheel turned by so many notches, away from the person positive; true when the flying speed changed.
    pub fn wheel(&mut self, notches: f64, now: Instant) -> bool {
        let flies = self.drag.as_ref().is_some_and(|drag| drag.kind == DragKind::Fly);
        let zooms = self.navigation != Navigation::Firstlight && !flies && !self.modifiers.shift_key();
        if zooms || self.modifiers.control_key() {
            self.sum.dolly -= notches * ZOOM_NOTCH.ln();
        } else if self.modifiers.shift_key() {
            self.sum.zoom -= notches * ZOOM_NOTCH.ln();
        } else {
            // What was flown so far was flown at the old speed.
            self.count(now);
            self.speed = (self.speed * SPEED_NOTCH.powf(notches)).clamp(SPEED_RANGE.0, SPEED_RANGE.1);
            return true;
        }
        false
    }

    /// Everything asked for since the last call, one command of a kind.
    pub fn take(&mut self, now: Instant) -> Vec<Command> {
        self.count(now);
        std::mem::take(&mut self.sum).into_commands()
    }

    /// Adds up what the held keys have moved by now.
    fn count(&mut self, now: Instant) {
        if let Some(since) = &mut self.spin {
            let since = std::mem::replace(since, now);
            let seconds = now.saturating_duration_since(since).as_secs_f64();
            add(&mut self.sum.orbit, [SPIN_RATE_DEG * seconds, 0.0]);
        }
        for i in 0..self.held.len() {
            let held = &mut self.held[i];
            let seconds = now.saturating_duration_since(held.since).as_secs_f64();
            (held.since, held.counted) = (now, held.counted + seconds);
            let motion = held.motion;
            self.advance(motion, seconds);
        }
    }

    fn release(&mut self, motion: Motion, now: Instant) {
        let Some(i) = self.held.iter().position(|held| held.motion == motion) else { return };
        let held = self.held.swap_remove(i);
        let seconds = now.saturating_duration_since(held.since).as_secs_f64();
        self.advance(motion, seconds.max(TAP - held.counted));
    }

    fn advance(&mut self, motion: Motion, seconds: f64) {
        let shift = self.modifiers.shift_key();
        let fly = seconds * self.speed * if shift { FAST } else { 1.0 };
        let orbit = |sum: &mut Sum, x: f64, y: f64| {
            if shift {
                add(&mut sum.pan, [x * PAN_RATE * seconds, y * PAN_RATE * seconds]);
            } else {
                add(&mut sum.orbit, [x * ORBIT_RATE_DEG * seconds, y * ORBIT_RATE_DEG * seconds]);
            }
        };
        let sum = &mut self.sum;
        match motion {
            Motion::Right => sum.fly[0] += fly,
            Motion::Left => sum.fly[0] -= fly,
            Motion::Up => sum.fly[1] += fly,
            Motion::Down => sum.fly[1] -= fly,
            Motion::Forward => sum.fly[2] += fly,
            Motion::Back => sum.fly[2] -= fly,
            Motion::OrbitRight => orbit(sum, 1.0, 0.0),
            Motion::OrbitLeft => orbit(sum, -1.0, 0.0),
            Motion::OrbitUp => orbit(sum, 0.0, 1.0),
            Motion::OrbitDown => orbit(sum, 0.0, -1.0),
            Motion::RollRight => sum.roll += ROLL_RATE_DEG * seconds,
            Motion::RollLeft => sum.roll -= ROLL_RATE_DEG * seconds,
        }
    }

    /// Of the window, physical pixels.
    pub fn size(&self) -> [f64; 2] {
        self.size
    }

    /// The mouse as a fraction of the picture.
    pub fn place(&self) -> [f64; 2] {
        [0, 1].map(|i| (self.cursor[i] / self.size[i].max(1.0)).clamp(0.0, 1.0))
    }
}

/// Modifier keys that gestures look at.
struct Modifiers {
    ctrl: bool,
    shift: bool,
    alt: bool,
}

impl Modifiers {
    fn of(state: ModifiersState) -> Self {
        Self { ctrl: state.control_key(), shift: state.shift_key(), alt: state.alt_key() }
    }
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}
