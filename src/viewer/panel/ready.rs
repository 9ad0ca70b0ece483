//! The library of ready materials: a ball of each, given to the selection by a click.

use crate::frame::Edit;
use crate::scene::{LIBRARY_BALLS, library};
use crate::viewer::panel::state::Asked;
use egui::{
    Align, Button, ColorImage, Image, Label, Layout, Rect, RichText, TextureHandle, TextureOptions, Ui, pos2, vec2,
};

/// Width of a ball, points.
const BALL: f32 = 42.0;

/// Draws the library.
///
/// - `balls`: their image, uploaded when it is shown first.
pub fn library_of_materials(ui: &mut Ui, balls: &mut Option<TextureHandle>, asked: &mut Asked) {
    let balls = balls.get_or_insert_with(|| {
        let image = image::load_from_memory(LIBRARY_BALLS).map(|image| image.to_rgb8()).unwrap_or_default();
        let size = [image.width() as usize, image.height() as usize];
        ui.ctx().load_texture("material balls", ColorImage::from_rgb(size, image.as_raw()), TextureOptions::LINEAR)
    });
    let n = library().len() as f32;
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = vec2(1.0, 4.0);
        for (i, (name, _)) in library().iter().enumerate() {
            let left = i as f32 / n;
            let uv = Rect::from_min_max(pos2(left, 0.0), pos2(left + 1.0 / n, 1.0));
            // All of one size, however long the name is.
            ui.allocate_ui_with_layout(vec2(BALL + 14.0, BALL + 16.0), Layout::top_down(Align::Center), |ui| {
                ui.set_min_width(BALL + 14.0);
                ui.spacing_mut().item_spacing.y = 0.0;
                ui.spacing_mut().button_padding = vec2(1.0, 1.0);
                let ball = Button::image(Image::new((balls.id(), vec2(BALL, BALL))).uv(uv));
                if ui.add(ball).on_hover_text(format!("give the selection {name}")).clicked() {
                    asked.edit(Edit::Dress { name: name.clone() });
                }
                ui.add(Label::new(RichText::new(name).size(9.5)).truncate());
            });
        }
    });
}
