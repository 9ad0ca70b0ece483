//! Choosing a file inside the window: to open it, where the desktop has no dialog, and to save.

use crate::viewer::dialog::DialogPurpose;
use crate::viewer::file_preview::FilePreview;
use egui::Context;
use egui_file_dialog::{DialogState, FileDialog};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The browser of files, while it is open.
#[derive(Default)]
pub struct Browser {
    open: Option<(DialogPurpose, Box<FileDialog>)>,
    preview: FilePreview,
}

impl Browser {
    /// Opens the browser in a folder.
    ///
    /// - `name`: of the file to be saved, as a proposal; of one that is shown, if files are to be opened.
    pub fn open(&mut self, purpose: DialogPurpose, folder: &Path, name: &str, screen: egui::Vec2) {
        let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_path_buf());
        let first = (!name.is_empty()).then(|| folder.join(name));
        // Long names and lists have room in a large window.
        let wanted = egui::vec2(720.0, 440.0).max(0.7 * screen);
        let size = wanted.min(screen - egui::vec2(40.0, 90.0)).max(egui::vec2(120.0, 80.0));
        let mut dialog = FileDialog::new()
            .title(purpose.title())
            .initial_directory(folder)
            .default_size(size)
            .min_size(egui::vec2(120.0, 80.0))
            .anchor(egui::Align2::CENTER_CENTER, egui::Vec2::ZERO)
            // Creating folders is no part of choosing a file to open.
            .show_new_folder_button(purpose.saves())
            .default_file_name(name)
            .show_left_panel(screen.x >= 560.0);
        for (i, (name, extensions)) in purpose.kinds().into_iter().enumerate() {
            if i == 0 {
                dialog = dialog.default_file_filter(name);
            }
            if let (DialogPurpose::SaveScene, [extension]) = (purpose, &extensions[..]) {
                dialog = dialog.add_save_extension(name, extension).default_save_extension(name);
            }
            dialog = dialog.add_file_filter(name, Arc::new(move |path: &Path| is_one(path, &extensions)));
        }
        match purpose {
            DialogPurpose::SaveScene | DialogPurpose::SaveImage => dialog.save_file(),
            DialogPurpose::SaveFrames => dialog.pick_directory(),
            _ => dialog.pick_file(),
        }
        dialog.set_right_panel_width(FilePreview::WIDTH);
        (self.open, self.preview) = (Some((purpose, Box::new(dialog))), FilePreview::new(first));
    }

    pub fn is_open(&self) -> bool {
        self.open.is_some()
    }

    /// Draws the browser; returns the file that was chosen.
    pub fn show(&mut self, context: &Context) -> Option<(DialogPurpose, PathBuf)> {
        // At once, also from the field of the name; but a menu of its own first.
        if context.input(|input| input.key_pressed(egui::Key::Escape)) && !egui::Popup::is_any_open(context) {
            self.open = None;
        }
        let (purpose, dialog) = self.open.as_mut()?;
        // What is to be saved is no image that is there.
        let has_preview = !purpose.saves() && context.content_rect().width() >= FilePreview::LEAST_WINDOW;
        if has_preview {
            let preview = &mut self.preview;
            dialog.update_with_right_panel_ui(context, &mut |ui, dialog| {
                preview.show(ui, dialog.selected_entry().map(egui_file_dialog::DirectoryEntry::as_path));
            });
        } else {
            dialog.update(context);
        }
        let chosen = dialog.take_picked().map(|path| (*purpose, path));
        if chosen.is_some() || *dialog.state() != DialogState::Open {
            self.open = None;
        }
        chosen
    }
}

/// Whether a file has one of these extensions.
fn is_one(path: &Path, extensions: &[String]) -> bool {
    path.extension().is_some_and(|extension| extensions.iter().any(|known| extension.eq_ignore_ascii_case(known)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn escape_closes_it_at_once() {
        let (context, folder) = (Context::default(), tempfile::tempdir().unwrap());
        let mut browser = Browser::default();
        browser.open(DialogPurpose::SaveScene, folder.path(), "a.ron", egui::vec2(800.0, 600.0));
        let frame = |browser: &mut Browser, events| {
            let input = egui::RawInput { events, ..egui::RawInput::default() };
            let _ = context.run(input, |context| assert_eq!(browser.show(context), None));
        };
        for _ in 0..3 {
            frame(&mut browser, Vec::new());
        }
        assert!(browser.is_open());
        let key = egui::Key::Escape;
        let (modifiers, physical_key) = (egui::Modifiers::NONE, None);
        frame(&mut browser, vec![egui::Event::Key { key, physical_key, pressed: true, repeat: false, modifiers }]);
        assert!(!browser.is_open());
    }

    #[test]
    fn files_of_any_case_are_shown_and_others_are_not() {
        let (_, extensions) = DialogPurpose::Open.kinds().swap_remove(0);
        for (name, shown) in
            [("a.obj", true), ("A.GLB", true), ("room.ron", true), ("notes.txt", false), ("obj", false)]
        {
            assert_eq!(is_one(Path::new(name), &extensions), shown, "{name}");
        }
    }
}
