//! The list of keys: its search, its drawing, and what a key press does while it is open.
//!
//! While the list is open no key runs a command. `/`, Tab, Ctrl+F or a click begin a search, and then letters belong to
//! the search field, H among them; before that, H closes the list that it opened.

use crate::frame::Navigation;
use crate::viewer::keys::{Action, Binding, action_of, finds, shown};
use crate::viewer::overlay::{KEY, TEXT_SIZE};
use egui::{Align2, Context, Id, RichText, Vec2};
use winit::keyboard::{Key, ModifiersState, NamedKey, PhysicalKey};

/// State of the list of keys.
#[derive(Default)]
pub struct Help {
    pub open: bool,
    /// Only lines that match all of these words are shown.
    search: String,
}

/// What a key press does while the list is open and its search field has no focus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ListKey {
    /// Letters go to the search field from here on.
    Search,
    /// What it does without the list too: it closes the list, or the window.
    Pass,
    /// A letter, which would be a command without the list.
    Letter,
    Nothing,
}

impl Help {
    pub fn toggle(&mut self) {
        *self = Self { open: !self.open, search: String::new() };
    }

    /// What the press of a key does, see [`ListKey`].
    pub fn answer(navigation: Navigation, physical: PhysicalKey, key: &Key, modifiers: ModifiersState) -> ListKey {
        let is = |text: &str| matches!(key, Key::Character(typed) if typed.eq_ignore_ascii_case(text));
        let is_plain = !modifiers.control_key() && !modifiers.alt_key() && !modifiers.super_key();
        if is_plain && (is("/") || *key == Key::Named(NamedKey::Tab)) || modifiers.control_key() && is("f") {
            return ListKey::Search;
        }
        match action_of(navigation, physical, key, modifiers) {
            Some(Action::ToggleHelp | Action::Leave | Action::Quit) => ListKey::Pass,
            _ if is_plain && matches!(key, Key::Character(_)) => ListKey::Letter,
            _ => ListKey::Nothing,
        }
    }

    /// Gives the search field the keyboard.
    pub fn begin_search(context: &Context) {
        context.memory_mut(|memory| memory.request_focus(Self::field()));
    }

    fn field() -> Id {
        Id::new("search of the list of keys")
    }
}

/// Draws the list of keys in the middle, with search field and scroll bar.
pub fn draw(context: &Context, help: &mut Help, navigation: Navigation) {
    let screen = context.content_rect();
    let column_width = 430.0_f32.min(screen.width() - 60.0).max(120.0);
    let columns = if screen.width() >= 2.0 * column_width + 80.0 { 2 } else { 1 };
    let height = (screen.height() - 130.0).max(60.0);
    let Help { open, search } = help;
    egui::Window::new("Keys and mouse")
        .open(open)
        .anchor(Align2::CENTER_CENTER, Vec2::new(0.0, -8.0))
        .collapsible(false)
        .resizable(false)
        .fixed_size(Vec2::new(columns as f32 * column_width + 20.0, height))
        .show(context, |ui| {
            let searches = ui.memory(|memory| memory.has_focus(Help::field()));
            let hint = if searches { "blur, undo, video … (Esc closes)" } else { "/ to search, H to close" };
            ui.add(egui::TextEdit::singleline(search).id(Help::field()).hint_text(hint).desired_width(220.0));
            ui.add_space(4.0);
            let mut groups = shown(navigation);
            for (title, bindings) in &mut groups {
                bindings.retain(|binding| finds(&binding.line(title), search));
            }
            groups.retain(|(_, found)| !found.is_empty());
            egui::ScrollArea::vertical().auto_shrink([false, false]).max_height(height - 36.0).show(ui, |ui| {
                if groups.is_empty() {
                    ui.weak("no matches");
                }
                ui.horizontal_top(|ui| {
                    for (i, groups) in in_columns(&groups, columns).into_iter().enumerate() {
                        ui.vertical(|ui| {
                            ui.set_width(column_width);
                            groups_grid(ui, i, groups, column_width);
                        });
                    }
                });
            });
        });
}

/// Splits the groups into columns of about equal length.
fn in_columns<'a>(groups: &'a [(&'a str, Vec<&'a Binding>)], columns: usize) -> Vec<&'a [(&'a str, Vec<&'a Binding>)]> {
    if columns < 2 {
        return vec![groups];
    }
    let lines = |groups: &[(&str, Vec<&Binding>)]| groups.iter().map(|(_, found)| found.len() + 2).sum::<usize>();
    let longer = |split: usize| lines(&groups[..split]).max(lines(&groups[split..]));
    let split = (0..=groups.len()).min_by_key(|&split| longer(split)).unwrap_or(0);
    vec![&groups[..split], &groups[split..]]
}

fn groups_grid(ui: &mut egui::Ui, id: usize, groups: &[(&str, Vec<&Binding>)], width: f32) {
    let keys_width = 0.38 * width;
    for (title, bindings) in groups {
        ui.label(RichText::new(*title).size(TEXT_SIZE + 2.0).strong());
        egui::Grid::new(("keys", id, title)).num_columns(2).spacing([14.0, 3.0]).show(ui, |ui| {
            for binding in bindings {
                // Both columns wrap rather than displace each other.
                ui.scope(|ui| {
                    ui.set_width(keys_width);
                    ui.add(egui::Label::new(RichText::new(binding.keys()).size(TEXT_SIZE).color(KEY)).wrap());
                });
                ui.scope(|ui| {
                    ui.set_width(width - keys_width - 24.0);
                    ui.add(egui::Label::new(RichText::new(binding.effect).size(TEXT_SIZE)).wrap());
                });
                ui.end_row();
            }
        });
        ui.add_space(10.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use winit::keyboard::KeyCode;

    #[test]
    fn no_key_runs_a_command_while_the_list_is_open() {
        let of = |key: Key, modifiers| {
            Help::answer(Navigation::Firstlight, PhysicalKey::Code(KeyCode::F24), &key, modifiers)
        };
        let text = |text: &str| Key::Character(text.into());
        let (none, ctrl, shift) = (ModifiersState::empty(), ModifiersState::CONTROL, ModifiersState::SHIFT);
        for (key, modifiers) in [(text("/"), none), (text("/"), shift), (text("f"), ctrl)] {
            assert_eq!(of(key, modifiers), ListKey::Search);
        }
        assert_eq!(of(Key::Named(NamedKey::Tab), none), ListKey::Search, "not the key that hides the overlays");
        for (key, modifiers) in [(text("h"), none), (text("H"), shift), (text("q"), ctrl)] {
            assert_eq!(of(key, modifiers), ListKey::Pass);
        }
        for key in [NamedKey::Escape, NamedKey::F1] {
            assert_eq!(of(Key::Named(key), none), ListKey::Pass);
        }
        for letter in ["d", "r", "x", "g", "1", "p", "D"] {
            assert_eq!(of(text(letter), none), ListKey::Letter, "{letter}");
        }
        for (key, modifiers) in [(text("z"), ctrl), (text("s"), ctrl)] {
            assert_eq!(of(key, modifiers), ListKey::Nothing);
        }
        for key in [NamedKey::Delete, NamedKey::F12, NamedKey::ArrowLeft, NamedKey::Space] {
            assert_eq!(of(Key::Named(key), none), ListKey::Nothing);
        }
    }
}
