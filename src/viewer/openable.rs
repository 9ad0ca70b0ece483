//! What can be opened with a click: built-in scenes and recent files.

use crate::files::printable;
use crate::frame::{Command, Session};
use crate::scene::{BUILTIN_SCENES, SCENES_IMAGE, builtin_text, text_to_path};
use egui::{
    Button, ColorImage, Context, Id, Image, Rect, RichText, TextureHandle, TextureOptions, Ui, Vec2, pos2, vec2,
};
use std::path::Path;

/// Recent files that are shown.
const MOST: usize = 12;
/// Size of the picture of a scene, points.
const PICTURE: Vec2 = vec2(35.0, 22.0);

fn open(name: &str) -> Command {
    Command::Open { path: text_to_path(name) }
}

/// The built-in scenes, a line and an image each.
pub fn scenes(ui: &mut Ui) -> Option<Command> {
    let mut chosen = None;
    let pictures = pictures(ui.ctx());
    let n = BUILTIN_SCENES.len() as f32;
    for (i, (name, about, _)) in BUILTIN_SCENES.iter().enumerate() {
        let left = i as f32 / n;
        let part = Rect::from_min_max(pos2(left, 0.0), pos2(left + 1.0 / n, 1.0));
        let picture = Image::new((pictures.id(), PICTURE)).uv(part);
        if ui.add(Button::image_and_text(picture, *name)).on_hover_text(*about).clicked() {
            chosen = Some(open(name));
        }
    }
    chosen
}

/// The pictures of the built-in scenes, uploaded when they are shown first.
fn pictures(context: &Context) -> TextureHandle {
    let id = Id::new("images of scenes");
    if let Some(known) = context.data(|data| data.get_temp::<TextureHandle>(id)) {
        return known;
    }
    let image = image::load_from_memory(SCENES_IMAGE).map(|image| image.to_rgb8()).unwrap_or_default();
    let size = [image.width() as usize, image.height() as usize];
    let image = ColorImage::from_rgb(size, image.as_raw());
    let pictures = context.load_texture("images of scenes", image, TextureOptions::LINEAR);
    context.data_mut(|data| data.insert_temp(id, pictures.clone()));
    pictures
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
    fn there_is_a_picture_of_each_scene() {
        let pictures = image::load_from_memory(SCENES_IMAGE).unwrap();
        assert_eq!(pictures.width() % BUILTIN_SCENES.len() as u32, 0);
        assert_eq!(pictures.width() / BUILTIN_SCENES.len() as u32 * 5, pictures.height() * 8);
    }

    #[test]
    fn files_of_one_name_are_told_apart() {
        assert_eq!(parts("/models/duck/scene.glb"), ("scene.glb".to_owned(), "in duck".to_owned()));
        assert_eq!(parts("cornell"), ("cornell".to_owned(), "built in".to_owned()));
    }
}
