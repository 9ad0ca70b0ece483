//! The library of ready materials: a sphere of each, given to the selection by a click.

use crate::frame::Edit;
use crate::scene::library;
use crate::viewer::panel::state::{Asked, DroppedMaterial};
use crate::viewer::thumbnails::Thumbnails;
use egui::{Align, Button, Label, Layout, RichText, Sense, Ui, vec2};

/// Width of a sphere, points.
const SIDE: f32 = 42.0;

pub fn library_of_materials(ui: &mut Ui, thumbnails: &Thumbnails, asked: &mut Asked) {
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = vec2(1.0, 4.0);
        for (i, ready) in library().iter().enumerate() {
            let name = &ready.name;
            // All of one size, however long the name is.
            ui.allocate_ui_with_layout(vec2(SIDE + 14.0, SIDE + 16.0), Layout::top_down(Align::Center), |ui| {
                ui.set_min_width(SIDE + 14.0);
                ui.spacing_mut().item_spacing.y = 0.0;
                ui.spacing_mut().button_padding = vec2(1.0, 1.0);
                let image = thumbnails.material(ui.ctx(), i, SIDE);
                let sphere = ui.add(Button::image(image.clone()).sense(Sense::click_and_drag()));
                asked.drag(&sphere, Some(image), || DroppedMaterial::Ready(name.clone()));
                if sphere.on_hover_text(format!("click: give the selection {name}; or drag it to an object")).clicked()
                {
                    asked.edit(Edit::Dress { name: name.clone() });
                }
                ui.add(Label::new(RichText::new(name).size(9.5)).truncate());
            });
        }
    });
}
