//! What can be opened with a click: built-in scenes and recent files.

use crate::files::printable;
use crate::frame::{Command, Session};
use crate::scene::{BUILTIN_SCENES, builtin_text, text_to_path};
use crate::viewer::thumbnails::Thumbnails;
use egui::{Button, RichText, Ui};
use std::path::Path;

/// Recent files that are shown.
const MOST: usize = 12;

/// The recent scenes, the latest first, and their images.
#[derive(Clone, Copy)]
pub struct Recent<'a> {
    pub names: &'a [String],
    pub thumbnails: &'a Thumbnails,
}

fn open(name: &str) -> Command {
    Command::Open { path: text_to_path(name) }
}

/// The built-in scenes, a line and an image each.
pub fn scenes(ui: &mut Ui, thumbnails: &Thumbnails) -> Option<Command> {
    let mut chosen = None;
    for (i, (name, about, _)) in BUILTIN_SCENES.iter().enumerate() {
        let line = Button::image_and_text(thumbnails.builtin(ui.ctx(), i), *name);
        if ui.add(line).on_hover_text(*about).clicked() {
            chosen = Some(open(name));
        }
    }
    chosen
}

/// The recent files except for the open one, each with its image and its folder.
pub fn recent(ui: &mut Ui, session: &Session, recent: Recent) -> Option<Command> {
    let mut chosen = None;
    let mut others = recent.names.iter().filter(|name| **name != session.status().scene).take(MOST).peekable();
    if others.peek().is_none() {
        ui.weak("no recent files");
    }
    for name in others {
        let (short, folder) = parts(name);
        let image = recent.thumbnails.image(ui.ctx(), name);
        let button =
            Button::image_and_text(image, &*printable::name(&short)).shortcut_text(RichText::new(folder).weak());
        if ui.add(button).on_hover_text(&*printable::line(name)).clicked() {
            chosen = Some(open(name));
        }
    }
    chosen
}

/// The name of a recent file, and the folder that tells it from others of that name.
fn parts(name: &str) -> (String, String) {
    let folder = Path::new(name).parent().and_then(Path::file_name).map(|folder| folder.to_string_lossy());
    let folder = match folder {
        Some(folder) => format!("in {}", printable::name(&folder)),
        None if builtin_text(name).is_some() => "built in".to_owned(),
        None => String::new(),
    };
    (short_name(name), folder)
}

/// The name of a scene without its folder.
pub fn short_name(scene: &str) -> String {
    Path::new(scene).file_name().map_or(scene.into(), |name| name.to_string_lossy()).into_owned()
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
