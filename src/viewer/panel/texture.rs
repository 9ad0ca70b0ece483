//! The texture of a material: its source and its parameters.

use crate::frame::{Edit, Property, Session};
use crate::render::Wrap;
use crate::scene::{ColorParam, Rgb, TextureSource};
use crate::viewer::dialog::DialogPurpose;
use crate::viewer::panel::state::Asked;
use crate::viewer::panel::widgets::{choices, color, number, row};
use egui::Ui;
use glam::{DVec2, DVec3, Vec3};

/// A menu of textures that can replace a colour.
///
/// - `property`: of the colour.
pub fn menu(ui: &mut Ui, session: &Session, id: u64, property: Property, paint: &ColorParam, asked: &mut Asked) {
    let mut names: Vec<&str> = (session.inputs().materials.iter())
        .filter_map(|material| match material.material.color()? {
            ColorParam::Texture(texture) => Some(texture.name.as_str()),
            ColorParam::Rgb(_) => None,
        })
        .collect();
    names.sort_unstable();
    names.dedup();
    ui.menu_button("texture", |ui| {
        for name in names {
            if ui.button(&*crate::files::printable::name(name)).clicked() {
                asked.edit(Edit::SetTexture { id, name: name.to_owned() });
                ui.close();
            }
        }
        ui.separator();
        if ui.button("new checker").clicked() {
            let a = if let ColorParam::Rgb(rgb) = paint { rgb.clamp(Vec3::ZERO, Vec3::ONE) } else { Vec3::splat(0.7) };
            let (squares, offset) = (DVec2::splat(8.0), DVec2::ZERO);
            let part = TextureSource::Checker { a: Rgb(a), b: Rgb(0.2 * a), squares, offset, rotate: 0.0 };
            asked.edit(Edit::Paint { id, part });
            ui.close();
        }
        if ui.button("image …").clicked() {
            asked.dialog = Some(DialogPurpose::Texture { id });
            ui.close();
        }
        if matches!(paint, ColorParam::Texture(_)) && ui.button("constant colour").clicked() {
            asked.edit(Edit::Set { id, property, value: DVec3::splat(0.5) });
            ui.close();
        }
    });
}

/// Mapping of the texture to the surface, and its colours.
pub fn numbers(ui: &mut Ui, id: u64, part: &TextureSource, asked: &mut Asked) {
    let mut new = part.clone();
    match &mut new {
        TextureSource::Checker { a, b, squares, offset, rotate } => {
            row(ui, "colours", |ui| {
                ui.vertical(|ui| {
                    for paint in [a, b] {
                        if let Some(value) = color(ui, paint.0, None) {
                            *paint = Rgb(value.as_vec3());
                        }
                    }
                })
            });
            lie(ui, "squares", squares, offset, rotate);
        }
        TextureSource::Image { repeat, offset, rotate, wrap, smooth, .. } => {
            lie(ui, "repeat", repeat, offset, rotate);
            row(ui, "wrap", |ui| {
                let all = [(Wrap::Repeat, "repeat"), (Wrap::Mirror, "mirror"), (Wrap::Clamp, "clamp")];
                *wrap = choices(ui, Some(*wrap), all).unwrap_or(*wrap);
            });
            row(ui, "smooth", |ui| ui.checkbox(smooth, ""));
        }
        TextureSource::VertexColors { .. } => {}
    }
    if new != *part {
        asked.edit(Edit::Paint { id, part: new });
    }
}

fn lie(ui: &mut Ui, name: &str, scale: &mut DVec2, offset: &mut DVec2, rotate: &mut f64) {
    let two = |ui: &mut Ui, name: &str, value: &mut DVec2, speed: f64| {
        row(ui, name, |ui| {
            ui.horizontal(|ui| {
                for axis in 0..2 {
                    if let Some(new) = number(ui, value[axis], speed, -1e6..=1e6, "") {
                        value[axis] = new;
                    }
                }
            })
        });
    };
    two(ui, name, scale, 0.05);
    two(ui, "offset", offset, 0.01);
    row(ui, "rotation", |ui| {
        if let Some(new) = number(ui, *rotate, 0.5, -360.0..=360.0, "°") {
            *rotate = new;
        }
    });
}
