//! The mesh of the selection: faces, normals, and simplification.

use crate::frame::{Edit, MeshMeasure, Selection, Session, wanted_mesh};
use crate::scene::thousands;
use crate::scene::{MeshOptions, MeshOrigin, MeshShading, Shape, TextureCoordinates};
use crate::viewer::change::Difference;
use crate::viewer::panel::state::{Asked, PanelState};
use crate::viewer::panel::widgets::{row, rows};
use crate::viewer::status::{metres, percent};
use egui::Ui;

pub fn mesh(ui: &mut Ui, state: &mut PanelState, session: &Session, asked: &mut Asked) {
    let active = session.world().resource::<Selection>().active();
    let shape = active.and_then(|active| Some((active, session.world().get::<Shape>(active)?)));
    let Some((entity, Shape::Mesh(mesh))) = shape else {
        ui.weak("no mesh selected");
        return;
    };
    let id = entity.to_bits();
    rows(ui, "mesh", |ui| {
        row(ui, "faces", |ui| drop(ui.label(thousands(mesh.triangles.len()))));
        let Some(wanted) = wanted_mesh(session.world(), entity) else { return };
        let mut choice = |ui: &mut Ui, label: &str, options: MeshOptions| {
            if ui.selectable_label(wanted == options, label).clicked() && wanted != options {
                asked.edit(Edit::Remesh { id, options });
            }
        };
        row(ui, "normals", |ui| {
            ui.horizontal(|ui| {
                let kinds = [(MeshShading::Auto, "auto"), (MeshShading::Smooth, "smooth"), (MeshShading::Flat, "flat")];
                for (shading, label) in kinds {
                    choice(ui, label, MeshOptions { shading, ..wanted });
                }
            })
        });
        row(ui, "coordinates", |ui| {
            ui.horizontal(|ui| {
                for (texture_coordinates, label) in
                    [(TextureCoordinates::File, "file"), (TextureCoordinates::Box, "box")]
                {
                    choice(ui, label, MeshOptions { texture_coordinates, ..wanted });
                }
            })
        });
        row(ui, "simplify", |ui| {
            let ratio = wanted.simplify.unwrap_or(1.0);
            let mut percent = 100.0 * ratio;
            let scale = egui::Slider::new(&mut percent, 1.0..=100.0).logarithmic(true).suffix(" %").max_decimals(1);
            let response = ui.add(scale.update_while_editing(false));
            // The slider rounds to the displayed value, which is not an edit.
            let is_another = (10.0 * percent).round() != (1000.0 * ratio).round();
            if response.changed() && is_another {
                let simplify = Some((percent / 100.0).clamp(0.01, 1.0)).filter(|ratio| *ratio < 1.0);
                let is_whole =
                    session.world().get::<MeshOrigin>(entity).is_some_and(|origin| origin.options.simplify.is_none());
                state.change.begin(entity, is_whole, session);
                asked.edit(Edit::Remesh { id, options: MeshOptions { simplify, ..wanted } });
            }
        });
        if let Some(measure) = session.world().get::<MeshMeasure>(entity).filter(|m| m.faces == mesh.triangles.len()) {
            row(ui, "original", |ui| drop(ui.label(format!("{} faces", thousands(measure.whole_faces)))));
            if let Some(deviation) = measure.deviation {
                row(ui, "deviation", |ui| {
                    let hint = "distance between the two surfaces, at 20,000 points of each, before scaling";
                    let text = format!("mean {}, maximum {}", metres(deviation.mean()), metres(deviation.max()));
                    ui.label(text).on_hover_text(hint);
                });
                row(ui, "difference", |ui| match state.change.of(entity) {
                    Some(Difference { mean, plain, spp: [before, now] }) => {
                        let hint = format!(
                            "difference to the image with the original mesh ({before} samples, now {now}), noise \
                             included: mean, and share of pixels that differ by more than 5 %"
                        );
                        let text = format!("{} mean, {} of pixels", percent(mean), percent(plain));
                        ui.label(text).on_hover_text(hint);
                    }
                    None => drop(ui.weak("–").on_hover_text("the original mesh was not rendered from this view")),
                });
            }
        }
    });
}
