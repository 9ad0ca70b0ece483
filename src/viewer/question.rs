//! Questions before something is lost: a small modal dialog, answered by mouse or by key.

use crate::files::printable;
use crate::frame::{Command, LeftBehind};
use crate::viewer::openable::short_name;
use crate::viewer::overlay::style_key;
use egui::{Align, Context, Frame, Id, Layout, Modal, RichText};
use winit::keyboard::{Key, ModifiersState, NamedKey};

/// A question to the user.
#[derive(Debug)]
pub enum Prompt {
    /// The scene of this name has unsaved edits, and another scene or closing the window is about to replace it.
    ///
    /// - `file`: the file that saving writes; `renders`: an image is being rendered to a file.
    Leave { title: String, file: String, renders: bool, then: Option<Command> },
    /// An earlier window ended with unsaved edits.
    Restore(LeftBehind),
}

/// The user's answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PromptAnswer {
    /// Save and leave; or restore the edits.
    Yes,
    /// Leave without saving; or discard the edits.
    No,
    /// Cancel the question.
    Later,
}

impl Prompt {
    fn text(&self) -> (String, String) {
        match self {
            Self::Leave { title, file, renders, then } => {
                let before = match then {
                    Some(Command::Open { path }) => {
                        format!("{} opens", printable::name(&short_name(&path.to_string_lossy())))
                    }
                    Some(_) => "another scene opens".to_owned(),
                    None => "the window closes".to_owned(),
                };
                let kept = match *renders && then.is_none() {
                    true => " Images that are being rendered are kept as they stand, and frames that are finished.",
                    false => "",
                };
                (
                    format!("Save the changes to {title} before {before}?"),
                    format!("They will be saved to {file}. Otherwise they are lost.{kept}"),
                )
            }
            Self::Restore(left) => (
                format!("Restore the changes to {}?", left.title),
                "firstlight ended before they were saved. They are restored to a new scene file.".to_owned(),
            ),
        }
    }

    fn choices(&self) -> [(&'static str, &'static str, PromptAnswer); 3] {
        match self {
            Self::Leave { .. } => [
                ("Save", "Enter", PromptAnswer::Yes),
                ("Don't save", "Ctrl+D", PromptAnswer::No),
                ("Cancel", "Esc", PromptAnswer::Later),
            ],
            Self::Restore(_) => [
                ("Restore", "Enter", PromptAnswer::Yes),
                ("Discard", "Ctrl+D", PromptAnswer::No),
                ("Later", "Esc", PromptAnswer::Later),
            ],
        }
    }

    /// The answer of a pressed key. What is lost is lost by no letter alone: one may be typing.
    pub fn key(key: &Key, modifiers: ModifiersState) -> Option<PromptAnswer> {
        match key {
            Key::Named(NamedKey::Enter) => Some(PromptAnswer::Yes),
            Key::Named(NamedKey::Escape) => Some(PromptAnswer::Later),
            Key::Character(text) if text.eq_ignore_ascii_case("d") && modifiers.control_key() => Some(PromptAnswer::No),
            _ => None,
        }
    }

    /// Draws the question; returns the answer when a button is pressed.
    pub fn show(&self, context: &Context) -> Option<PromptAnswer> {
        let (heading, explanation) = self.text();
        let mut answer = None;
        let frame = Frame::window(&context.style()).inner_margin(16.0);
        Modal::new(Id::new("question")).frame(frame).show(context, |ui| {
            ui.set_width(360.0_f32.min(context.content_rect().width() - 40.0));
            ui.label(RichText::new(heading).size(16.0).strong());
            ui.add_space(6.0);
            ui.label(explanation);
            ui.add_space(14.0);
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                for (label, key, meaning) in self.choices() {
                    let button = ui.button(label);
                    ui.label(style_key(key));
                    ui.add_space(6.0);
                    if button.clicked() {
                        answer = Some(meaning);
                    }
                }
            });
        });
        answer
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_question_names_what_is_about_to_open() {
        let question = |then| {
            let (title, file) = ("gallery".to_owned(), "gallery-0001.ron".to_owned());
            Prompt::Leave { title, file, renders: false, then }.text().0
        };
        let open = |path: &str| Some(Command::Open { path: path.into() });
        assert_eq!(question(open("cornell")), "Save the changes to gallery before cornell opens?");
        assert_eq!(question(open("some/folder/a.glb")), "Save the changes to gallery before a.glb opens?");
        assert_eq!(question(None), "Save the changes to gallery before the window closes?");
    }

    #[test]
    fn every_choice_has_the_key_that_stands_beside_it() {
        let (title, file) = ("gallery".to_owned(), "gallery-0001.ron".to_owned());
        let question = Prompt::Leave { title, file, renders: false, then: None };
        let none = ModifiersState::empty();
        for (_, name, answer) in question.choices() {
            let (key, modifiers) = match name {
                "Enter" => (Key::Named(NamedKey::Enter), none),
                "Esc" => (Key::Named(NamedKey::Escape), none),
                "Ctrl+D" => (Key::Character("d".into()), ModifiersState::CONTROL),
                other => panic!("{other}"),
            };
            assert_eq!(Prompt::key(&key, modifiers), Some(answer), "{name}");
        }
        assert_eq!(Prompt::key(&Key::Named(NamedKey::Space), none), None);
        assert_eq!(Prompt::key(&Key::Character("d".into()), none), None, "one may be typing");
    }
}
