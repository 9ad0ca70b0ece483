//! From keys and mouse to commands. Knows no window and no clock: it is told what happened and when.
//!
//! Nothing depends on how often [`Input::take`] is called: a held key moves by the time it was down, a drag by the
//! distance it went, and whatever happens between two calls is added up into one command of a kind.

use super::keys::{Action, Motion, action_of, motion_of};
use crate::frame::{Command, Edit};
use std::time::{Duration, Instant};
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
    Orbit,
    Pan,
    Focus,
}

#[derive(Debug)]
struct Drag {
    kind: DragKind,
    button: MouseButton,
    /// Where the mouse was last; until it `moved` out of the slack, where it was pressed.
    last: [f64; 2],
    moved: bool,
    /// Of a click: select beside what is selected.
    add: bool,
}

/// Movement not yet sent, and the commands that must keep their order behind it.
#[derive(Debug, Default)]
struct Sum {
    turn: [f64; 2],
    orbit: [f64; 2],
    pan: [f64; 2],
    fly: [f64; 3],
    roll: f64,
    dolly: f64,
    zoom: f64,
    pace: Option<[f64; 2]>,
    pick: Option<([f64; 2], bool)>,
    focus: Option<[f64; 2]>,
    pivot: Option<[f64; 2]>,
}

impl Input {
    /// For a window of this size, physical pixels.
    pub fn new(width: u32, height: u32) -> Self {
        Self {
            modifiers: ModifiersState::empty(),
            held: Vec::new(),
            drag: None,
            last_press: None,
            size: [f64::from(width), f64::from(height)],
            cursor: [0.0; 2],
            speed: 1.0,
            spin: None,
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
            if !self.modifiers.control_key() && !self.modifiers.super_key() {
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
        let action = pressed.then(|| action_of(physical, typed, self.modifiers)).flatten()?;
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
        while let Some(held) = self.held.last() {
            self.release(held.motion, now);
        }
        self.drag = None;
        self.modifiers = ModifiersState::empty();
    }

    /// A mouse button went down or up.
    pub fn button(&mut self, button: MouseButton, pressed: bool, now: Instant) {
        if !pressed {
            if let Some(drag) = self.drag.take_if(|drag| drag.button == button)
                && drag.kind == DragKind::Look
                && !drag.moved
            {
                // The second click of two focuses, and leaves the selection of the first.
                let second = self.last_press.is_none();
                self.sum.pick = (!second).then(|| (self.place(), drag.add)).or(self.sum.pick);
            }
            return;
        }
        let (shift, alt) = (self.modifiers.shift_key(), self.modifiers.alt_key());
        let kind = match button {
            MouseButton::Left if shift => DragKind::Focus,
            MouseButton::Left if alt => DragKind::Orbit,
            MouseButton::Left => DragKind::Look,
            MouseButton::Middle if shift => DragKind::Pan,
            MouseButton::Middle => DragKind::Orbit,
            MouseButton::Right => DragKind::Pan,
            _ => return,
        };
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
        let add = self.modifiers.control_key();
        self.drag = Some(Drag { kind, button, last: self.cursor, moved: false, add });
    }

    /// The mouse is at this place of the window, physical pixels.
    pub fn cursor(&mut self, x: f64, y: f64) {
        self.cursor = [x, y];
        let place = self.place();
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
        match drag.kind {
            // The view goes where the mouse goes; what is orbited or panned sticks to the mouse.
            DragKind::Look => add(&mut self.sum.turn, [dx * LOOK_DRAG_DEG, -dy * LOOK_DRAG_DEG]),
            DragKind::Orbit => add(&mut self.sum.orbit, [-dx * ORBIT_DRAG_DEG, dy * ORBIT_DRAG_DEG]),
            DragKind::Pan => add(&mut self.sum.pan, [-dx, dy]),
            DragKind::Focus => self.sum.focus = Some(place),
        }
    }

    /// The wheel turned by so many notches, away from the person positive; true when the flying speed changed.
    pub fn wheel(&mut self, notches: f64, now: Instant) -> bool {
        if self.modifiers.control_key() {
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

impl Sum {
    fn into_commands(self) -> Vec<Command> {
        let mut commands = Vec::new();
        let mut push = |wanted: bool, command| {
            if wanted {
                commands.push(command);
            }
        };
        let zero = [0.0; 2];
        push(self.turn != zero, Command::Turn { yaw_deg: self.turn[0], pitch_deg: self.turn[1] });
        push(self.orbit != zero, Command::Orbit { yaw_deg: self.orbit[0], pitch_deg: self.orbit[1] });
        push(self.pan != zero, Command::Pan { right: self.pan[0], up: self.pan[1] });
        if let Some([x, y]) = self.pace {
            commands.push(Command::PaceAt { x, y });
        }
        let mut push = |wanted: bool, command| {
            if wanted {
                commands.push(command);
            }
        };
        let [right, up, forward] = self.fly;
        push(self.fly != [0.0; 3], Command::Fly { right, up, forward });
        push(self.roll != 0.0, Command::Roll { angle_deg: self.roll });
        push(self.dolly != 0.0, Command::Dolly { factor: self.dolly.exp() });
        push(self.zoom != 0.0, Command::Zoom { factor: self.zoom.exp() });
        if let Some(([x, y], add)) = self.pick {
            commands.push(Command::Edit(Edit::PickAt { x, y, add }));
        }
        if let Some([x, y]) = self.focus {
            commands.push(Command::FocusAt { x, y });
        }
        if let Some([x, y]) = self.pivot {
            commands.push(Command::PivotAt { x, y });
        }
        commands
    }
}

fn add(sum: &mut [f64; 2], amount: [f64; 2]) {
    sum[0] += amount[0];
    sum[1] += amount[1];
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use winit::keyboard::KeyCode;

    const NONE: ModifiersState = ModifiersState::empty();

    fn input() -> (Input, Instant) {
        (Input::new(800, 400), Instant::now())
    }

    fn after(start: Instant, ms: u64) -> Instant {
        start + Duration::from_millis(ms)
    }

    fn press(input: &mut Input, code: KeyCode, text: &str, down: bool, now: Instant) -> Option<Action> {
        input.key(PhysicalKey::Code(code), &Key::Character(text.into()), down, false, now)
    }

    #[test]
    fn how_far_a_key_flies_does_not_depend_on_the_frame_rate() {
        for frame_ms in [1, 7, 16, 100, 2000] {
            let (mut input, start) = input();
            press(&mut input, KeyCode::KeyW, "w", true, start);
            let mut flown = 0.0;
            let mut collect = |input: &mut Input, now| {
                for command in input.take(now) {
                    if let Command::PaceAt { .. } = command {
                        continue;
                    }
                    let Command::Fly { right: 0.0, up: 0.0, forward } = command else { panic!("{command:?}") };
                    flown += forward;
                }
            };
            let mut ms = 0;
            while ms + frame_ms < 1000 {
                ms += frame_ms;
                collect(&mut input, after(start, ms));
            }
            press(&mut input, KeyCode::KeyW, "w", false, after(start, 1000));
            collect(&mut input, after(start, 5000));
            assert!((flown - 1.0).abs() < 1e-9, "{frame_ms} ms: {flown}");
            assert!(!input.is_moving());
        }
    }

    #[test]
    fn speed_and_shift_count_from_when_they_change() {
        let (mut input, start) = input();
        press(&mut input, KeyCode::KeyW, "w", true, start);
        input.wheel(1.0, after(start, 1000));
        input.set_modifiers(ModifiersState::SHIFT, after(start, 2000));
        let [Command::PaceAt { .. }, Command::Fly { forward, .. }] = input.take(after(start, 3000))[..] else {
            panic!()
        };
        assert!((forward - (1.0 + SPEED_NOTCH + FAST * SPEED_NOTCH)).abs() < 1e-9, "{forward}");
    }

    #[test]
    fn a_tap_moves_and_opposite_keys_stand_still() {
        let (mut input, start) = input();
        press(&mut input, KeyCode::KeyD, "d", true, start);
        press(&mut input, KeyCode::KeyD, "d", false, start);
        let pace = Command::PaceAt { x: 0.0, y: 0.0 };
        assert_eq!(input.take(start), [pace.clone(), Command::Fly { right: TAP, up: 0.0, forward: 0.0 }]);
        press(&mut input, KeyCode::KeyA, "a", true, start);
        press(&mut input, KeyCode::KeyD, "d", true, start);
        assert_eq!(input.take(after(start, 500)), [pace]);
    }

    #[test]
    fn shift_flies_faster_and_turns_orbiting_into_panning() {
        let (mut input, start) = input();
        input.set_modifiers(ModifiersState::SHIFT, start);
        press(&mut input, KeyCode::KeyE, "E", true, start);
        press(&mut input, KeyCode::ArrowLeft, "", true, start);
        let commands = input.take(after(start, 1000));
        assert_eq!(
            commands,
            [
                Command::Pan { right: -PAN_RATE, up: 0.0 },
                Command::PaceAt { x: 0.0, y: 0.0 },
                Command::Fly { right: 0.0, up: FAST, forward: 0.0 }
            ]
        );
    }

    #[test]
    fn ctrl_letters_do_not_fly() {
        let (mut input, start) = input();
        input.set_modifiers(ModifiersState::CONTROL, start);
        assert_eq!(press(&mut input, KeyCode::KeyQ, "q", true, start), Some(Action::Quit));
        assert_eq!(press(&mut input, KeyCode::KeyW, "w", true, start), None);
        assert!(!input.is_moving());
    }

    #[test]
    fn losing_the_keyboard_lets_everything_go() {
        let (mut input, start) = input();
        press(&mut input, KeyCode::KeyW, "w", true, start);
        input.button(MouseButton::Middle, true, start);
        input.release_all(after(start, 100));
        input.cursor(300.0, 300.0);
        let commands = input.take(after(start, 900));
        assert_eq!(commands[1..], [Command::Fly { right: 0.0, up: 0.0, forward: 0.1 }]);
    }

    #[test]
    fn drags_follow_the_mouse_and_add_up() {
        let (mut input, start) = input();
        input.cursor(100.0, 100.0);
        input.button(MouseButton::Left, true, start);
        input.cursor(102.0, 100.0);
        assert_eq!(input.take(start), [], "a trembling mouse turns nothing");
        input.cursor(150.0, 100.0);
        input.cursor(200.0, 60.0);
        let commands = input.take(start);
        assert_eq!(commands, [Command::Turn { yaw_deg: 0.25 * LOOK_DRAG_DEG, pitch_deg: 0.1 * LOOK_DRAG_DEG }]);
        input.button(MouseButton::Left, false, start);
        input.cursor(400.0, 400.0);
        assert_eq!(input.take(start), []);

        input.button(MouseButton::Middle, true, start);
        input.cursor(440.0, 400.0);
        assert_eq!(input.take(start), [Command::Orbit { yaw_deg: -0.1 * ORBIT_DRAG_DEG, pitch_deg: 0.0 }]);
        input.button(MouseButton::Middle, false, start);
        input.button(MouseButton::Right, true, start);
        input.cursor(440.0, 440.0);
        assert_eq!(input.take(start), [Command::Pan { right: 0.0, up: 0.1 }]);
    }

    #[test]
    fn clicks_focus() {
        let (mut input, start) = input();
        input.cursor(200.0, 100.0);
        input.button(MouseButton::Left, true, start);
        input.button(MouseButton::Left, false, start);
        let picked = |add| Command::Edit(Edit::PickAt { x: 0.25, y: 0.25, add });
        assert_eq!(input.take(start), [picked(false)], "one click selects");
        input.button(MouseButton::Left, true, after(start, 200));
        input.button(MouseButton::Left, false, after(start, 250));
        assert_eq!(input.take(start), [Command::FocusAt { x: 0.25, y: 0.25 }, Command::PivotAt { x: 0.25, y: 0.25 }]);
        input.button(MouseButton::Left, true, after(start, 300));
        input.button(MouseButton::Left, false, after(start, 310));
        assert_eq!(input.take(start), [picked(false)], "a third click is not a second double click");
        input.set_modifiers(ModifiersState::CONTROL, start);
        input.button(MouseButton::Left, true, after(start, 1300));
        input.button(MouseButton::Left, false, after(start, 1310));
        assert_eq!(input.take(start), [picked(true)]);

        input.set_modifiers(ModifiersState::SHIFT, start);
        input.button(MouseButton::Left, true, after(start, 2000));
        assert_eq!(input.take(start), [Command::FocusAt { x: 0.25, y: 0.25 }]);
        input.cursor(900.0, 300.0);
        assert_eq!(input.take(start), [Command::FocusAt { x: 1.0, y: 0.75 }], "and a drag pulls it along");
    }

    #[test]
    fn the_wheel_does_three_things() {
        let (mut input, start) = input();
        assert!(input.wheel(2.0, start));
        assert_eq!(input.speed(), SPEED_NOTCH * SPEED_NOTCH);
        input.set_modifiers(ModifiersState::CONTROL, start);
        assert!(!input.wheel(1.0, start));
        input.set_modifiers(ModifiersState::SHIFT, start);
        assert!(!input.wheel(-1.0, start));
        let [Command::Dolly { factor: dolly }, Command::Zoom { factor: zoom }] = input.take(start)[..] else {
            panic!()
        };
        assert!((dolly * ZOOM_NOTCH - 1.0).abs() < 1e-12 && (zoom / ZOOM_NOTCH - 1.0).abs() < 1e-12);
        input.set_modifiers(NONE, start);
        for _ in 0..1000 {
            input.wheel(1.0, start);
        }
        assert_eq!(input.speed(), SPEED_RANGE.1);
    }

    #[test]
    fn a_turntable_goes_around_by_itself_until_it_is_stopped() {
        let (mut input, start) = input();
        input.toggle_spin(start);
        assert!(input.is_moving());
        assert_eq!(input.take(after(start, 1500)), [Command::Orbit { yaw_deg: 1.5 * SPIN_RATE_DEG, pitch_deg: 0.0 }]);
        input.toggle_spin(after(start, 2000));
        assert_eq!(input.take(after(start, 9000)), [Command::Orbit { yaw_deg: 0.5 * SPIN_RATE_DEG, pitch_deg: 0.0 }]);
        assert!(!input.is_moving());
    }

    #[test]
    fn steps_repeat_and_toggles_do_not() {
        let (mut input, start) = input();
        let mut repeat =
            |code, text: &str| input.key(PhysicalKey::Code(code), &Key::Character(text.into()), true, true, start);
        assert!(repeat(KeyCode::BracketLeft, "[").is_some());
        assert_eq!(repeat(KeyCode::KeyO, "o"), None);
        assert_eq!(repeat(KeyCode::KeyK, "k"), None);
    }
}
