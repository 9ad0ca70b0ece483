//! The list of commands: found by typing, run by Enter or a click.

use crate::viewer::keys::{Action, finds};
use crate::viewer::menu::{self, MenuInput};
use crate::viewer::overlay::KEY;
use egui::{Align2, Button, Context, Event, Id, Key, Modifiers, RichText, TextEdit, Vec2, Window};

/// State of the list of commands.
#[derive(Default)]
pub struct Palette {
    pub open: bool,
    is_new: bool,
    search: String,
    /// The line that Enter runs.
    chosen: usize,
}

impl Palette {
    pub fn open(&mut self) {
        *self = Self { open: true, is_new: true, ..Self::default() };
    }

    /// Draws the list; returns the command to run.
    pub fn show(&mut self, context: &Context, input: &MenuInput) -> Option<Action> {
        if !self.open {
            return None;
        }
        let is_new = std::mem::take(&mut self.is_new);
        if is_new {
            // The key that opened the list is no part of the search.
            let is_key = |event: &Event| matches!(event, Event::Text(text) if text == "/");
            context.input_mut(|input| input.events.retain(|event| !is_key(event)));
        }
        let pressed = |key| context.input_mut(|input| input.consume_key(Modifiers::NONE, key));
        let (up, down, enter) = (pressed(Key::ArrowUp), pressed(Key::ArrowDown), pressed(Key::Enter));
        if pressed(Key::Escape) {
            self.open = false;
            return None;
        }
        let found = matches(menu::all(input), &self.search);
        self.chosen = (self.chosen + usize::from(down)).saturating_sub(usize::from(up)).min(found.len().max(1) - 1);
        let mut run = found.get(self.chosen).filter(|_| enter).map(|(_, _, _, action)| action.clone());
        let screen = context.content_rect();
        let width = 460.0_f32.min(screen.width() - 30.0).max(60.0);
        let mut open = true;
        Window::new("Commands")
            .open(&mut open)
            .anchor(Align2::CENTER_TOP, Vec2::new(0.0, 0.08 * screen.height()))
            .collapsible(false)
            .resizable(false)
            .fixed_size(Vec2::new(width, 0.6 * screen.height()))
            .show(context, |ui| {
                let id = Id::new("search of the commands");
                // Before the field is drawn, so that what has been typed already is not lost.
                ui.memory_mut(|memory| memory.request_focus(id));
                let field = TextEdit::singleline(&mut self.search).id(id);
                let field = ui.add(field.hint_text("what do you want to do?").desired_width(f32::INFINITY));
                if field.changed() {
                    self.chosen = 0;
                }
                ui.add_space(4.0);
                egui::ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
                    if found.is_empty() {
                        ui.weak("no matches");
                    }
                    for (i, (name, effect, key, action)) in found.iter().enumerate() {
                        let button =
                            Button::new(name.as_str()).selected(i == self.chosen).frame_when_inactive(i == self.chosen);
                        let button =
                            button.shortcut_text(RichText::new(key).color(KEY)).min_size(Vec2::new(width, 0.0));
                        let line = ui.add(button);
                        if i == self.chosen && (up || down) {
                            line.scroll_to_me(None);
                        }
                        let line = if effect.is_empty() { line } else { line.on_hover_text(effect) };
                        if line.clicked() {
                            run = Some(action.clone());
                        }
                    }
                });
            });
        self.open = open && run.is_none();
        run
    }
}

/// The lines that a search finds: those whose name has it first.
fn matches(lines: Vec<(String, String, String, Action)>, search: &str) -> Vec<(String, String, String, Action)> {
    let is_named = |name: &str| finds(name, search);
    let (mut named, others): (Vec<_>, Vec<_>) = lines.into_iter().partition(|(name, ..)| is_named(name));
    named.extend(others.into_iter().filter(|(name, effect, ..)| finds(&format!("{name} {effect}"), search)));
    named
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_comes_before_what_only_mentions_it() {
        let line = |name: &str, effect: &str| (name.to_owned(), effect.to_owned(), String::new(), Action::Brush);
        let lines = vec![line("Save", "undo is lost"), line("Undo", "one step"), line("Redo", "again")];
        let names = |search| matches(lines.clone(), search).into_iter().map(|(name, ..)| name).collect::<Vec<_>>();
        assert_eq!(names("undo"), ["Undo", "Save"]);
        assert_eq!(names("").len(), 3);
    }
}
