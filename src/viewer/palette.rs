//! The list of commands: found by typing, run by Enter or a click.

use crate::viewer::keys::{Action, finds};
use crate::viewer::overlay::KEY;
use egui::text_edit::TextEditState;
use egui::{Align2, Button, Context, Event, Id, Key, Modifiers, RichText, TextEdit, Vec2, Window};

/// A command: its name, what it does, its key, and the command itself.
type Line = (String, String, String, Action);

/// State of the list of commands.
#[derive(Default)]
pub struct Palette {
    pub open: bool,
    is_new: bool,
    /// What the key that opened the list types, which is no part of the search.
    opened_by: Option<String>,
    search: String,
    /// The line that Enter runs.
    chosen: usize,
}

impl Palette {
    /// - `search`: what is searched for at first.
    pub fn open(&mut self, search: &str) {
        *self = Self { open: true, is_new: true, search: search.to_owned(), ..Self::default() };
    }

    /// The key that has just been pressed types this: it may be the one that has opened the list.
    pub fn pressed(&mut self, text: Option<&str>) {
        if self.is_new {
            self.opened_by = text.map(str::to_owned);
        }
    }

    /// Draws the list of all commands; returns the one to run.
    pub fn show(&mut self, context: &Context, all: impl FnOnce() -> Vec<Line>) -> Option<Action> {
        if !self.open {
            return None;
        }
        let id = Id::new("search of the commands");
        if std::mem::take(&mut self.is_new) {
            self.take_letters(context, id);
        }
        let pressed = |key| context.input_mut(|input| input.consume_key(Modifiers::NONE, key));
        let (up, down, enter) = (pressed(Key::ArrowUp), pressed(Key::ArrowDown), pressed(Key::Enter));
        if pressed(Key::Escape) {
            self.open = false;
            return None;
        }
        let mut run = None;
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
                // Before the field is drawn, so that what has been typed already is not lost.
                ui.memory_mut(|memory| memory.request_focus(id));
                let field = TextEdit::singleline(&mut self.search).id(id);
                let field = ui.add(field.hint_text("what do you want to do?").desired_width(f32::INFINITY));
                if field.changed() {
                    self.chosen = 0;
                }
                // After the field has read the keys: letters and the Enter behind them may come in one frame.
                let found = matches(all(), &self.search);
                self.chosen =
                    (self.chosen + usize::from(down)).saturating_sub(usize::from(up)).min(found.len().max(1) - 1);
                run = found.get(self.chosen).filter(|_| enter).map(|(_, _, _, action)| action.clone());
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

    /// Takes what was typed before the list is drawn for the first time: its field reads no keys in that frame.
    fn take_letters(&mut self, context: &Context, field: Id) {
        TextEditState::default().store(context, field);
        let events = context.input_mut(|input| std::mem::take(&mut input.events));
        let mut rest = Vec::new();
        let mut opened_by = self.opened_by.take();
        for event in events {
            match event {
                Event::Text(letter) if opened_by.as_ref() == Some(&letter) => opened_by = None,
                Event::Text(letter) => self.search.push_str(&letter),
                other => rest.push(other),
            }
        }
        context.input_mut(|input| input.events = rest);
    }
}

/// The lines that a search finds: those whose name has it first.
fn matches(lines: Vec<Line>, search: &str) -> Vec<Line> {
    let is_named = |name: &str| finds(name, search);
    let (mut named, others): (Vec<_>, Vec<_>) = lines.into_iter().partition(|(name, ..)| is_named(name));
    named.extend(others.into_iter().filter(|(name, effect, ..)| finds(&format!("{name} {effect}"), search)));
    named
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::RawInput;

    /// A slow frame gets all that was typed since the last one, and Enter with it.
    #[test]
    fn enter_runs_what_was_typed_in_the_same_frame() {
        let lines = || {
            let line = |name: &str, action| (name.to_owned(), String::new(), String::new(), action);
            vec![line("Focus", Action::FocusHere), line("Play", Action::TogglePlay), line("Brush", Action::Brush)]
        };
        let (context, mut palette) = (Context::default(), Palette::default());
        palette.open("");
        palette.pressed(Some("/"));
        let enter = Event::Key {
            key: Key::Enter,
            physical_key: None,
            pressed: true,
            repeat: false,
            modifiers: Modifiers::NONE,
        };
        let letters = ["/", "B", "r", "u"].map(|letter| Event::Text(letter.to_owned()));
        let input = RawInput { events: letters.into_iter().chain([enter]).collect(), ..RawInput::default() };
        let mut run = None;
        let _ = context.run(input, |context| run = palette.show(context, lines));
        assert_eq!(run, Some(Action::Brush));
    }

    #[test]
    fn the_key_that_opens_the_list_is_no_part_of_the_search() {
        for (key, typed, expected) in [("A", &["A"][..], "add"), ("A", &["A", "A"], "addA"), ("/", &["x", "/"], "addx")]
        {
            let (context, mut palette) = (Context::default(), Palette::default());
            palette.open("add");
            palette.pressed(Some(key));
            let events = typed.iter().map(|letter| Event::Text((*letter).to_owned())).collect();
            let _ = context.run(RawInput { events, ..RawInput::default() }, |context| {
                palette.show(context, Vec::new);
            });
            assert_eq!(palette.search, expected);
        }
    }

    #[test]
    fn a_name_comes_before_what_only_mentions_it() {
        let line = |name: &str, effect: &str| (name.to_owned(), effect.to_owned(), String::new(), Action::Brush);
        let lines = vec![line("Save", "undo is lost"), line("Undo", "one step"), line("Redo", "again")];
        let names = |search| matches(lines.clone(), search).into_iter().map(|(name, ..)| name).collect::<Vec<_>>();
        assert_eq!(names("undo"), ["Undo", "Save"]);
        assert_eq!(names("").len(), 3);
    }
}
