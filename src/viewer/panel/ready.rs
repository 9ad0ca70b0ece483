//! The library of ready materials: a sphere of each, given to the selection by a click.

use crate::frame::Edit;
use crate::scene::{LIBRARY_IMAGE, library};
use crate::viewer::panel::state::Asked;
use egui::{
    Align, Button, ColorImage, Image, Label, Layout, Rect, RichText, TextureHandle, TextureOptions, Ui, pos2, vec2,
};

/// Width of a sphere, points.
const SIDE: f32 = 42.0;

/// Draws the library.
///
/// - `spheres`: their image, uploaded when it is shown first.
pub fn library_of_materials(ui: &mut Ui, spheres: &mut Option<TextureHandle>, asked: &mut Asked) {
    let spheres = spheres.get_or_insert_with(|| {
        let image = image::load_from_memory(LIBRARY_IMAGE).map(|image| image.to_rgb8()).unwrap_or_default();
        let size = [image.width() as usize, image.height() as usize];
        ui.ctx().load_texture("material spheres", ColorImage::from_rgb(size, image.as_raw()), TextureOptions::LINEAR)
    });
    let n = library().len() as f32;
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = vec2(1.0, 4.0);
        for (i, (name, _)) in library().iter().enumerate() {
            let left = i as f32 / n;
            let uv = Rect::from_min_max(pos2(left, 0.0), pos2(left + 1.0 / n, 1.0));
            // All of one size, however long the name is.
            ui.allocate_ui_with_layout(vec2(SIDE + 14.0, SIDE + 16.0), Layout::top_down(Align::Center), |ui| {
                ui.set_min_width(SIDE + 14.0);
                ui.spacing_mut().item_spacing.y = 0.0;
                ui.spacing_mut().button_padding = vec2(1.0, 1.0);
                let sphere = Button::image(Image::new((spheres.id(), vec2(SIDE, SIDE))).uv(uv));
                if ui.add(sphere).on_hover_text(format!("give the selection {name}")).clicked() {
                    asked.edit(Edit::Dress { name: name.clone() });
                }
                ui.add(Label::new(RichText::new(name).size(9.5)).truncate());
            });
        }
    });
}
