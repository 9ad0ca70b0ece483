//! Changes of the selection that follow the mouse at once: their keys and buttons take precedence over all others.

use crate::frame::gizmo::Mode;
use crate::frame::{Command, Edit};
use crate::viewer::app::App;
use crate::viewer::grab::{Answer, Grab};
use crate::viewer::toasts::Tone;
use std::time::Instant;
use winit::event::{MouseButton, WindowEvent};

impl App {
    pub(super) fn begin_grab(&mut self, mode: Mode, now: Instant) {
        // The selection may be newer than what was drawn.
        let (projector, free) = self.projector();
        self.handles.update(&mut self.session, self.panel.gizmo, projector, free);
        let Some((gizmo, projector)) = self.handles.gizmo_of(&self.session, mode) else {
            self.toasts.add(Tone::News, format!("{}: select something in view first (click it)", mode.label()), now);
            return;
        };
        self.session.send(Command::Edit(Edit::Begin));
        self.grab = Some(Grab::new(gizmo, projector, self.mouse()));
    }

    /// Moves a copy of the selection, in one step with its making.
    pub(super) fn grab_copy(&mut self, now: Instant) {
        self.begin_grab(Mode::Move, now);
        if self.grab.is_some() {
            self.session.send(Command::Edit(Edit::DuplicateInPlace));
        }
    }

    /// Ends a change: keeps it, or restores what was there.
    pub(super) fn end_grab(&mut self, keep: bool, now: Instant) {
        if self.grab.take().is_none() {
            return;
        }
        self.session.send(Command::Edit(if keep { Edit::End } else { Edit::Cancel }));
        (self.repaint_at, self.needs_tick) = (Some(now), true);
    }

    /// Whether a change of the selection takes this event; called before overlays see it.
    pub(super) fn grab_takes(&mut self, event: &WindowEvent, now: Instant) -> bool {
        if self.grab.is_none() {
            return false;
        }
        match event {
            WindowEvent::KeyboardInput { event, is_synthetic: false, .. } if event.state.is_pressed() => {
                let shift = self.input.modifiers().shift_key();
                match self.grab.as_mut().map(|grab| grab.key(&event.logical_key, shift)) {
                    Some(Answer::Changed) => self.send_grab(now),
                    Some(Answer::Keep) => self.end_grab(true, now),
                    Some(Answer::Restore) => self.end_grab(false, now),
                    _ => {}
                }
                true
            }
            WindowEvent::MouseInput { state, button, .. } => {
                match button {
                    MouseButton::Left if state.is_pressed() => self.end_grab(true, now),
                    MouseButton::Right if state.is_pressed() => self.end_grab(false, now),
                    _ => {}
                }
                true
            }
            WindowEvent::CursorMoved { position, .. } => {
                self.input.cursor(position.x, position.y);
                let (mouse, snap) = (self.mouse(), self.input.modifiers().control_key());
                if let Some(grab) = &mut self.grab {
                    grab.mouse_at(mouse, snap);
                }
                self.send_grab(now);
                true
            }
            WindowEvent::MouseWheel { .. } => true,
            WindowEvent::Focused(false) => {
                self.end_grab(false, now);
                false
            }
            _ => false,
        }
    }

    fn send_grab(&mut self, now: Instant) {
        let edit = self.grab.as_ref().map(|grab| grab.edit().unwrap_or_else(Grab::identity));
        if let Some(edit) = edit {
            self.reaction.asked(now);
            self.session.send(Command::Edit(edit));
        }
        (self.repaint_at, self.needs_tick) = (Some(now), true);
    }
}
