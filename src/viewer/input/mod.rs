//! Translation of keys and mouse to commands. Independent of window and clock: events and times are passed in.
//!
//! The result does not depend on how often [`Input::take`] is called: a held key moves by the time it was down, a drag
//! by its distance, and all input between two calls is added up into one command per kind.

mod sum;
#[cfg(test)]
mod tests;

use crate::frame::{Command, Edit, Navigation};
use crate::viewer::input::sum::{Sum, add};
use crate::viewer::keys::{Action, Motion, action_of, motion_of};
use std::time::{Duration, Instant};
use winit::event::MouseButton;
use winit::keyboard::{Key, ModifiersState, PhysicalKey};

/// Degrees per second while an orbit or roll key is down.
const ORBIT_RATE_DEG: f64 = 75.0;
const ROLL_RATE_DEG: f64 = 45.0;
/// One turn in 18 seconds.
const SPIN_RATE_DEG: f64 = 20.0;
/// Image heights per second.
const PAN_RATE: f64 = 0.5;
/// Factor of Shift on the flying speed.
const FAST: f64 = 4.0;
/// A tap shorter than a frame moves as if the key had been down for this time, seconds.
const TAP: f64 = 1.0 / 30.0;

/// Degrees for a drag over the image's height.
const LOOK_DRAG_DEG: f64 = 90.0;
const ORBIT_DRAG_DEG: f64 = 240.0;
/// A drag over the image's height divides the distance to the pivot by e to this power.
const ZOOM_DRAG: f64 = 2.0;
/// Pixels that a pressed mouse may move without turning the view.
const CLICK_TOLERANCE: f64 = 4.0;
const DOUBLE_CLICK: Duration = Duration::from_millis(400);

/// Factor per notch of the wheel.
const SPEED_NOTCH: f64 = 1.25;
const ZOOM_NOTCH: f64 = 1.1;
/// Limits of the flying speed for the wheel, strides per second.
const SPEED_RANGE: (f64, f64) = (1.0 / 256.0, 256.0);

/// The keys and drags in progress, and the accumulated input since the last [`take`](Self::take).
#[derive(Debug)]
pub struct Input {
    navigation: Navigation,
    modifiers: ModifiersState,
    held: Vec<Held>,
    drag: Option<Drag>,
    last_press: Option<(Instant, [f64; 2])>,
    /// Image size and mouse position, physical pixels.
    size: [f64; 2],
    cursor: [f64; 2],
    /// Strides per second.
    speed: f64,
    /// Start of the part of the turntable rotation that has not been counted.
    spin: Option<Instant>,
    /// Until when the time of the animation has been advanced, if it plays.
    play: Option<Instant>,
    /// Whether a drag with the left button orbits the pivot instead of turning the camera, if the user has chosen that for
    /// this scene.
    orbits: Option<bool>,
    /// The camera of the scene begins in a room.
    in_room: bool,
    /// Whether the mouse moves the view without a button.
    captured: bool,
    /// Whether focus follows the mouse.
    focuses: bool,
    sum: Sum,
}

#[derive(Debug)]
struct Held {
    motion: Motion,
    /// Time up to which it has been counted, and the seconds counted.
    since: Instant,
    counted: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum DragKind {
    Look,
    /// Looks around, and letters fly for its duration.
    Fly,
    Orbit,
    Pan,
    /// Towards the pivot or away from it.
    Zoom,
    Focus,
}

#[derive(Debug)]
struct Drag {
    kind: DragKind,
    button: MouseButton,
    /// The last mouse position; until it has `moved` beyond the tolerance, the position of the press.
    last: [f64; 2],
    moved: bool,
    /// Begun with Ctrl: a click adds to the selection, a drag orbits.
    ctrl: bool,
}

impl Input {
    /// Creates the state for a window of this size, physical pixels.
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
            play: None,
            orbits: None,
            in_room: true,
            captured: false,
            focuses: false,
            sum: Sum::default(),
        }
    }

    /// Sets the size of the image, physical pixels.
    pub fn resize(&mut self, width: u32, height: u32) {
        self.size = [f64::from(width), f64::from(height)];
    }

    pub fn set_modifiers(&mut self, modifiers: ModifiersState, now: Instant) {
        // Keys held so far are counted with the old modifiers.
        self.count(now);
        self.modifiers = modifiers;
    }

    /// The preset of keys and gestures.
    pub fn navigation(&self) -> Navigation {
        self.navigation
    }

    /// Sets the preset of keys and gestures.
    pub fn set_navigation(&mut self, navigation: Navigation, now: Instant) {
        self.release_motions(now, |_| true);
        self.drag = None;
        self.navigation = navigation;
    }

    /// Whether holding this key moves: under a preset, letters fly only during a fly drag.
    fn moves(&self, motion: Motion) -> bool {
        let flies = self.drag.as_ref().is_some_and(|drag| drag.kind == DragKind::Fly);
        // Z undoes there.
        let is_taken = self.navigation == Navigation::Maya && motion == Motion::RollLeft;
        self.navigation == Navigation::Firstlight || !motion.flies() && !is_taken || flies
    }

    /// Strides per second.
    pub fn speed(&self) -> f64 {
        self.speed
    }

    /// Whether a movement key is down, so that time alone changes the view.
    pub fn is_moving(&self) -> bool {
        !self.held.is_empty() || self.spin.is_some() || self.play.is_some()
    }

    /// Starts or stops the turntable.
    pub fn toggle_spin(&mut self, now: Instant) {
        self.count(now);
        self.spin = if self.spin.is_some() { None } else { Some(now) };
    }

    pub fn is_spinning(&self) -> bool {
        self.spin.is_some()
    }

    /// Starts or stops the animation.
    pub fn toggle_play(&mut self, now: Instant) {
        self.count(now);
        self.play = if self.play.is_some() { None } else { Some(now) };
        // It stops where it was last shown, at a whole frame.
        self.sum.play = 0.0;
    }

    pub fn is_playing(&self) -> bool {
        self.play.is_some()
    }

    /// Toggles whether a plain drag orbits the pivot or looks around; returns true for orbiting.
    pub fn toggle_orbits(&mut self) -> bool {
        let orbits = !self.orbits();
        self.orbits = Some(orbits);
        orbits
    }

    /// Whether a plain drag orbits the pivot: as the user has chosen, else unless the camera began in a room.
    pub fn orbits(&self) -> bool {
        self.orbits.unwrap_or(!self.in_room)
    }

    /// Tells whether the camera of a scene begins in a room, and not in front of things.
    pub fn set_in_room(&mut self, in_room: bool) {
        self.in_room = in_room;
    }

    /// Forgets what was chosen for a plain drag: that was for the scene before.
    pub fn forget_drag(&mut self) {
        self.orbits = None;
    }

    /// Ends a drag of which another use is made.
    pub fn drop_drag(&mut self) {
        self.drag = None;
    }

    /// Sets whether the mouse moves the view without a button, by [`Self::mouse_moved`].
    pub fn set_captured(&mut self, captured: bool) {
        self.captured = captured;
        self.drag = None;
    }

    pub fn is_captured(&self) -> bool {
        self.captured
    }

    /// Sets whether focus follows the mouse.
    pub fn set_focuses(&mut self, focuses: bool) {
        self.focuses = focuses;
    }

    /// Handles a movement of the captured mouse, pixels.
    pub fn mouse_moved(&mut self, x: f64, y: f64) {
        if self.captured {
            let height = self.size[1].max(1.0);
            self.turn([x / height, y / height], self.orbits == Some(true));
        }
    }

    /// Turns the view by image heights, downwards positive.
    fn turn(&mut self, [dx, dy]: [f64; 2], orbits: bool) {
        // The view follows the mouse; when orbiting, the object follows the mouse.
        if orbits {
            add(&mut self.sum.orbit, [-dx * ORBIT_DRAG_DEG, dy * ORBIT_DRAG_DEG]);
        } else {
            add(&mut self.sum.turn, [dx * LOOK_DRAG_DEG, -dy * LOOK_DRAG_DEG]);
        }
    }

    /// Whether a mouse button is down that turns, moves or focuses.
    pub fn is_dragging(&self) -> bool {
        self.drag.is_some()
    }

    /// The mouse position, physical pixels.
    pub fn cursor_place(&self) -> [f64; 2] {
        self.cursor
    }

    pub fn modifiers(&self) -> ModifiersState {
        self.modifiers
    }

    /// Sets the flying speed, strides per second.
    pub fn set_speed(&mut self, speed: f64, now: Instant) {
        self.count(now);
        self.speed = speed.clamp(SPEED_RANGE.0, SPEED_RANGE.1);
    }

    /// Handles a key press (a repeated one if `repeat`) or release; returns an action other than movement.
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
                // The pace is determined where the flight begins, and not again for every object passed.
                if !repeat && flies(motion) && self.held.is_empty() {
                    self.sum.pace = Some(self.place());
                }
                if !repeat && !self.held.iter().any(|held| held.motion == motion) {
                    // What flies is no click.
                    if let Some(drag) = &mut self.drag {
                        drag.moved = true;
                    }
                    self.held.push(Held { motion, since: now, counted: 0.0 });
                }
                return None;
            }
        }
        let action = pressed.then(|| action_of(self.navigation, physical, typed, self.modifiers)).flatten()?;
        // Only steps repeat: a repeated toggle would flicker, a repeated screenshot would fill the disk.
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

    /// Releases everything when the window loses the keyboard, because later releases are not reported.
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

    /// The kind of a drag with this button, if any.
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

    /// Whether Shift with a click adds to the selection, as in other programs, rather than focus there; with a drag it
    /// focuses.
    pub fn shift_selects(&self) -> bool {
        self.navigation != Navigation::Firstlight
    }

    /// Handles a mouse button press or release; returns true for a right click, which asks for a menu.
    pub fn button(&mut self, button: MouseButton, pressed: bool, now: Instant) -> bool {
        if self.captured {
            return false;
        }
        if !pressed {
            let Some(drag) = self.drag.take_if(|drag| drag.button == button) else { return false };
            if drag.kind == DragKind::Look && !drag.moved {
                // The second click of a double click focuses, and keeps the selection of the first.
                let second = self.last_press.is_none();
                self.sum.pick = (!second).then(|| (self.place(), drag.ctrl)).or(self.sum.pick);
            }
            if drag.kind == DragKind::Focus && !drag.moved && self.shift_selects() {
                self.sum.pick = Some((self.place(), true));
            }
            if drag.kind == DragKind::Fly {
                self.release_motions(now, Motion::flies);
            }
            return button == MouseButton::Right && !drag.moved && drag.kind != DragKind::Zoom;
        }
        let Some(kind) = self.kind_of_drag(button) else { return false };
        if kind == DragKind::Focus && !self.shift_selects() {
            self.sum.focus = Some(self.place());
        }
        if kind == DragKind::Look {
            let again = self.last_press.is_some_and(|(then, place)| {
                now.saturating_duration_since(then) < DOUBLE_CLICK && distance(place, self.cursor) <= CLICK_TOLERANCE
            });
            if again {
                self.sum.focus = Some(self.place());
                self.sum.pivot = Some(self.place());
            }
            // A third press starts a new double click.
            self.last_press = (!again).then_some((now, self.cursor));
        }
        let ctrl = self.modifiers.control_key();
        self.drag = Some(Drag { kind, button, last: self.cursor, moved: false, ctrl });
        false
    }

    /// Handles a mouse movement to this position of the window, physical pixels.
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
            if distance(drag.last, self.cursor) <= CLICK_TOLERANCE {
                return;
            }
            drag.moved = true;
        }
        let [dx, dy] = [(x - drag.last[0]) / height, (y - drag.last[1]) / height];
        drag.last = self.cursor;
        let (kind, ctrl) = (drag.kind, drag.ctrl);
        match kind {
            // Window managers intercept drags with Alt, but not those with Ctrl.
            DragKind::Look => self.turn([dx, dy], self.orbits() || ctrl),
            DragKind::Fly => self.turn([dx, dy], false),
            // Up and to the right moves nearer.
            DragKind::Zoom => self.sum.dolly -= (dx - dy) * ZOOM_DRAG,
            DragKind::Orbit => self.turn([dx, dy], true),
            // When panning, the object follows the mouse.
            DragKind::Pan => add(&mut self.sum.pan, [-dx, dy]),
            DragKind::Focus => self.sum.focus = Some(place),
        }
    }

    /// Handles a wheel movement in notches, positive away from the user; returns true if the flying speed changed.
    pub fn wheel(&mut self, notches: f64, now: Instant) -> bool {
        // In flight, the wheel is for the speed.
        let drags = self.drag.as_ref().is_some_and(|drag| drag.kind == DragKind::Fly);
        let flies = drags || self.held.iter().any(|held| held.motion.flies());
        if self.modifiers.shift_key() && !flies {
            self.sum.zoom -= notches * ZOOM_NOTCH.ln();
        } else if !flies && !self.modifiers.control_key() {
            self.sum.dolly -= notches * ZOOM_NOTCH.ln();
        } else {
            // The distance so far is counted with the old speed.
            self.count(now);
            self.speed = (self.speed * SPEED_NOTCH.powf(notches)).clamp(SPEED_RANGE.0, SPEED_RANGE.1);
            return true;
        }
        false
    }

    /// Returns the input since the last call, one command per kind.
    pub fn take(&mut self, now: Instant) -> Vec<Command> {
        self.count(now);
        std::mem::take(&mut self.sum).into_commands()
    }

    /// Adds up the movement of held keys until now.
    fn count(&mut self, now: Instant) {
        if let Some(since) = &mut self.spin {
            let since = std::mem::replace(since, now);
            let seconds = now.saturating_duration_since(since).as_secs_f64();
            add(&mut self.sum.orbit, [SPIN_RATE_DEG * seconds, 0.0]);
        }
        if let Some(since) = &mut self.play {
            let since = std::mem::replace(since, now);
            self.sum.play += now.saturating_duration_since(since).as_secs_f64();
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

    /// Size of the image, physical pixels.
    pub fn size(&self) -> [f64; 2] {
        self.size
    }

    /// The mouse position as a fraction of the image.
    pub fn place(&self) -> [f64; 2] {
        self.fractions(self.cursor)
    }

    /// A position in the window, physical pixels, as a fraction of the image.
    pub fn fractions(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [(x, self.size[0]), (y, self.size[1])].map(|(at, size)| (at / size.max(1.0)).clamp(0.0, 1.0))
    }
}

/// The modifier keys that gestures use.
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
