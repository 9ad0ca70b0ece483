//! Window events: most of them are only recorded, and executed by the next tick.

use crate::frame::{Command, Edit, Selection};
use crate::viewer::app::{App, FRAME, Wake};
use crate::viewer::dialog::DialogPurpose;
use crate::viewer::help::{Help, ListKey};
use crate::viewer::question::Prompt;
use crate::viewer::toasts::Tone;
use glam::DVec2;
use std::sync::atomic::Ordering;
use std::time::Instant;
use winit::application::ApplicationHandler;
use winit::event::{DeviceEvent, DeviceId, MouseButton, MouseScrollDelta, StartCause, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow};
use winit::keyboard::{Key, ModifiersState, NamedKey};
use winit::window::WindowId;

/// Touchpad pixels per wheel notch.
const PIXELS_PER_NOTCH: f64 = 40.0;

impl ApplicationHandler<Wake> for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.window.is_none()
            && let Err(error) = self.open_window(event_loop)
        {
            self.failure = Some(error);
            event_loop.exit();
        }
    }

    fn user_event(&mut self, _: &ActiveEventLoop, _: Wake) {
        self.pending.store(false, Ordering::Release);
        self.needs_tick = true;
        // This image may be an awaited response.
        self.last_tick = None;
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let now = Instant::now();
        if event == WindowEvent::RedrawRequested {
            self.draw_or_leave(event_loop);
            return;
        }
        if self.grab_takes(&event, now) || self.help_takes(&event, now) {
            self.repaint_at = Some(now);
            self.needs_tick = true;
            return;
        }
        let was_over_widgets = self.over_widgets;
        // Overlays know where the mouse was when they were drawn, which may be before it jumped here.
        let at_mouse = match &event {
            WindowEvent::CursorMoved { position, .. } => Some([position.x, position.y]),
            WindowEvent::MouseInput { .. } | WindowEvent::MouseWheel { .. } => Some(self.input.cursor_place()),
            _ => None,
        };
        if let Some(place) = at_mouse {
            self.over_widgets = self.has_widget_at(place);
        }
        let in_menu = self.in_menu();
        let Some(presenter) = &mut self.presenter else { return };
        // Overlays get the keyboard only during text input. Tab, which the window uses itself, would give it to a button.
        let is_asked = self.palette.open || self.browser.is_open() || self.form.is_open();
        let typing = presenter.egui_context().wants_keyboard_input() || is_asked;
        let mut response = match is_tab(&event) && !typing {
            true => egui_winit::EventResponse::default(),
            false => presenter.on_window_event(&event),
        };
        if at_mouse.is_some() {
            response.consumed = self.over_widgets || presenter.egui_context().is_using_pointer();
        }
        // A click beside the list of commands closes it, and does what it does.
        if let WindowEvent::MouseInput { state, .. } = &event
            && state.is_pressed()
            && !response.consumed
        {
            self.palette.open = false;
        }
        if response.repaint && (was_over_widgets || self.has_widgets()) && !self.input.is_dragging() {
            self.repaint_at = Some(now);
        }
        self.needs_tick = true;
        match event {
            WindowEvent::CloseRequested => self.leaving.wanted = true,
            WindowEvent::Resized(_) | WindowEvent::ScaleFactorChanged { .. } => self.resized(),
            WindowEvent::Occluded(occluded) => {
                self.occluded = occluded;
                self.session.send(Command::SetWindowHidden { hidden: occluded });
                self.repaint_at = Some(now);
            }
            WindowEvent::Focused(false) => {
                self.capture_mouse(false, now);
                self.input.release_all(now);
            }
            WindowEvent::DroppedFile(path) => self.take_file(DialogPurpose::Open, path, now),
            WindowEvent::ModifiersChanged(modifiers) => {
                self.input.set_modifiers(modifiers.state(), now);
            }
            WindowEvent::KeyboardInput { event, is_synthetic: false, .. } => {
                let (pressed, modifiers) = (event.state.is_pressed(), self.input.modifiers());
                if pressed && self.leaving.question.is_some() {
                    if let Some(answer) = Prompt::key(&event.logical_key, modifiers).filter(|_| !event.repeat) {
                        self.answer(answer, now, event_loop);
                    }
                    return;
                }
                // Escape and F1 leave the list of keys even during text input.
                let leaves = matches!(event.logical_key, Key::Named(NamedKey::Escape | NamedKey::F1));
                if pressed
                    && (typing || in_menu && is_for_menu(&event.logical_key, modifiers))
                    && !(leaves && self.help.open)
                {
                    return;
                }
                if pressed {
                    self.reaction.asked(now);
                }
                if let Some(action) = self.input.key(event.physical_key, &event.logical_key, pressed, event.repeat, now)
                {
                    self.act(action);
                    self.palette.pressed(event.text.as_deref());
                }
            }
            WindowEvent::CursorMoved { position, .. } => {
                let mouse = DVec2::new(position.x, position.y) / self.scale();
                if self.handles.grab_body(mouse) {
                    self.input.drop_drag();
                    self.session.send(Command::Edit(Edit::Begin));
                }
                self.input.set_focuses(self.focus_follows() && !response.consumed);
                self.input.cursor(position.x, position.y);
                if self.input.is_dragging() || self.handles.is_grabbed() {
                    self.reaction.asked(now);
                }
                if self.hover(now) | self.brush.mouse_at(self.input.place()) {
                    self.repaint_at = Some(now);
                }
                let (mouse, snap) = (self.mouse(), self.input.modifiers().control_key());
                let (command, news) = self.handles.mouse_at(mouse, snap);
                if let Some(command) = command {
                    self.session.send(command);
                }
                let [x, y] = self.input.place();
                // Nothing lies in the sky at which to aim.
                if let Some(light) = self.handles.aimed().filter(|_| self.session.entity_at(x, y).is_some()) {
                    self.session.send(Command::Edit(Edit::AimAt { id: light.to_bits(), x, y }));
                }
                if news {
                    self.repaint_at = Some(now);
                }
            }
            // It closes the menu, and does nothing else.
            WindowEvent::MouseInput { state, .. } if state.is_pressed() && in_menu => self.repaint_at = Some(now),
            WindowEvent::MouseInput { state, button: MouseButton::Left, .. }
                if state.is_pressed() && !response.consumed && self.brush.press(self.input.place()) =>
            {
                self.repaint_at = Some(now);
            }
            WindowEvent::MouseInput { state, button: MouseButton::Left, .. }
                if !state.is_pressed() && self.brush.is_drawing() =>
            {
                if let Some(region) = self.brush.release(self.input.size()).flatten() {
                    self.session.send(Command::SetRegion { region: Some(region) });
                }
                self.repaint_at = Some(now);
            }
            WindowEvent::MouseInput { state, button: MouseButton::Left, .. }
                if !state.is_pressed() && self.handles.release() =>
            {
                self.session.send(Command::Edit(Edit::End));
                self.repaint_at = Some(now);
            }
            WindowEvent::MouseInput { state, button: MouseButton::Left, .. }
                if state.is_pressed() && !response.consumed && self.handles.grab(self.mouse()) =>
            {
                self.session.send(Command::Edit(Edit::Begin));
            }
            WindowEvent::MouseInput { state, button, .. } if !(state.is_pressed() && response.consumed) => {
                let is_plain = self.input.modifiers().is_empty() && !self.input.is_captured();
                if button == MouseButton::Left && state.is_pressed() && is_plain && self.is_body_at_mouse() {
                    self.handles.press_body(self.mouse());
                }
                let is_shift = self.input.modifiers() == ModifiersState::SHIFT && !self.input.is_captured();
                let focuses = is_shift && !self.input.shift_selects();
                let is_selected = !self.session.world().resource::<Selection>().0.is_empty();
                if button == MouseButton::Left && state.is_pressed() && focuses && is_selected {
                    // Elsewhere that is how one selects several.
                    self.toasts.add(Tone::News, "focused here; Ctrl+click adds to the selection", now);
                }
                if self.input.button(button, state.is_pressed(), now) {
                    self.open_menu_here();
                }
                self.reaction.asked(now);
                // The selection is an overlay and does not change the image.
                self.repaint_at = Some(now);
            }
            // Beside a menu, somebody wants to scroll that.
            WindowEvent::MouseWheel { delta, .. } if !response.consumed && !in_menu => {
                // Shift turns a vertical wheel into a horizontal one on some systems.
                let notches = match delta {
                    MouseScrollDelta::LineDelta(x, y) => f64::from(x + y),
                    MouseScrollDelta::PixelDelta(by) => (by.x + by.y) / PIXELS_PER_NOTCH,
                };
                if self.input.wheel(notches, now) {
                    self.toasts.add(Tone::News, format!("speed ×{:.2}", self.input.speed()), now);
                }
            }
            _ => {}
        }
    }

    fn device_event(&mut self, _: &ActiveEventLoop, _: DeviceId, event: DeviceEvent) {
        if let DeviceEvent::MouseMotion { delta: (x, y) } = event
            && self.input.is_captured()
        {
            self.input.mouse_moved(x, y);
            self.reaction.asked(Instant::now());
            self.needs_tick = true;
        }
    }

    fn new_events(&mut self, _: &ActiveEventLoop, cause: StartCause) {
        if let StartCause::ResumeTimeReached { .. } = cause {
            self.wake_at = None;
            self.needs_tick = true;
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        let now = Instant::now();
        if self.needs_tick {
            match self.last_tick.map(|then| then + FRAME).filter(|soon| *soon > now) {
                Some(soon) => self.wake_at = Some(soon),
                None => self.tick(now, event_loop),
            }
        }
        event_loop.set_control_flow(self.wake_at.map_or(ControlFlow::Wait, ControlFlow::WaitUntil));
    }

    fn exiting(&mut self, _: &ActiveEventLoop) {
        // The device must be dropped before the display.
        self.presenter = None;
        self.window = None;
    }
}

impl App {
    /// Whether what is under the mouse is selected, and a drag moves it.
    fn is_body_at_mouse(&self) -> bool {
        let [x, y] = self.input.place();
        let is_selected = !self.session.world().resource::<Selection>().0.is_empty();
        is_selected && self.session.entity_at(x, y).is_some_and(|entity| self.handles.is_body(entity))
    }

    /// Outlines what is under the mouse; returns whether that is news.
    fn hover(&mut self, now: Instant) -> bool {
        let is_elsewhere = self.over_widgets
            || self.input.is_dragging()
            || self.input.is_captured()
            || self.handles.is_lit()
            || self.brush.is_armed();
        self.outlines.mouse_at((!is_elsewhere && self.overlays).then(|| self.input.place()), now)
    }

    /// Whether the open list of keys takes a key press, see [`Help::answer`]; called before overlays see the event.
    fn help_takes(&mut self, event: &WindowEvent, now: Instant) -> bool {
        let WindowEvent::KeyboardInput { event, is_synthetic: false, .. } = event else { return false };
        let Some(presenter) = &self.presenter else { return false };
        let context = presenter.egui_context();
        let is_asked = self.help.open && event.state.is_pressed() && self.leaving.question.is_none();
        if !is_asked || context.wants_keyboard_input() {
            return false;
        }
        let navigation = self.input.navigation();
        match Help::answer(navigation, event.physical_key, &event.logical_key, self.input.modifiers()) {
            ListKey::Pass => return false,
            ListKey::Search => Help::begin_search(context),
            ListKey::Letter if !event.repeat => {
                self.toasts.add(Tone::News, "list of keys: / searches it, H closes it", now);
            }
            ListKey::Letter | ListKey::Nothing => {}
        }
        true
    }
}

fn is_tab(event: &WindowEvent) -> bool {
    matches!(event, WindowEvent::KeyboardInput { event, .. } if event.logical_key == Key::Named(NamedKey::Tab))
}

/// Whether an open menu takes a key: those that move in it, choose, and close it, and letters, which are meant for one
/// of its lines.
fn is_for_menu(key: &Key, modifiers: ModifiersState) -> bool {
    use NamedKey::{ArrowDown, ArrowLeft, ArrowRight, ArrowUp, Enter, Escape, Space, Tab};
    let Key::Named(key) = key else { return !modifiers.control_key() && !modifiers.alt_key() };
    [ArrowDown, ArrowLeft, ArrowRight, ArrowUp, Enter, Escape, Space, Tab].contains(key)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_menu_takes_letters_and_leaves_shortcuts() {
        let (none, letter) = (ModifiersState::empty(), Key::Character("m".into()));
        assert!(is_for_menu(&letter, none) && is_for_menu(&letter, ModifiersState::SHIFT));
        assert!(!is_for_menu(&letter, ModifiersState::CONTROL) && !is_for_menu(&letter, ModifiersState::ALT));
        assert!(is_for_menu(&Key::Named(NamedKey::Escape), none));
        assert!(!is_for_menu(&Key::Named(NamedKey::F1), none));
    }
}
