//! What can be opened with a click: built-in scenes and recent files.

use crate::files::printable;
use crate::frame::{Command, Session};
use crate::scene::{BUILTIN_SCENES, builtin_text, text_to_path};
use egui::{Button, RichText, Ui};
use std::path::Path;

/// Recent files that are shown.
const MOST: usize = 12;

fn open(name: &str) -> Command {
    Command::Open { path: text_to_path(name) }
}

/// The built-in scenes, a line each.
pub fn scenes(ui: &mut Ui) -> Option<Command> {
    let mut chosen = None;
    for (name, about, _) in BUILTIN_SCENES {
        if ui.button(*name).on_hover_text(*about).clicked() {
            chosen = Some(open(name));
        }
    }
    chosen
}

/// The recent files except for the open one, each with its folder.
pub fn recent(ui: &mut Ui, session: &Session, recent: &[String]) -> Option<Command> {
    let mut chosen = None;
    let mut others = recent.iter().filter(|name| **name != session.status().scene).take(MOST).peekable();
    if others.peek().is_none() {
        ui.weak("no recent files");
    }
    for name in others {
        let (short, folder) = parts(name);
        let button = Button::new(&*printable::name(&short)).shortcut_text(RichText::new(folder).weak());
        if ui.add(button).on_hover_text(&*printable::line(name)).clicked() {
            chosen = Some(open(name));
        }
    }
    chosen
}

/// The name of a recent file, and the folder that tells it from others of that name.
fn parts(name: &str) -> (String, String) {
    let path = Path::new(name);
    let short = path.file_name().map_or(name.into(), |file| file.to_string_lossy()).into_owned();
    let folder = path.parent().and_then(Path::file_name).map(|folder| folder.to_string_lossy());
    let folder = match folder {
        Some(folder) => format!("in {}", printable::name(&folder)),
        None if builtin_text(name).is_some() => "built in".to_owned(),
        None => String::new(),
    };
    (short, folder)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_one_name_are_told_apart() {
        assert_eq!(parts("/models/duck/scene.glb"), ("scene.glb".to_owned(), "in duck".to_owned()));
        assert_eq!(parts("cornell"), ("cornell".to_owned(), "built in".to_owned()));
    }
}
