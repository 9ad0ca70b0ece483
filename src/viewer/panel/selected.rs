//! Name, place, material and light of what is selected.

use super::widgets::{color, name_field, number, proportional, row, rows, vector};
use super::{Asked, PanelState, material};
use crate::frame::{Edit, Property, Selection, Session, gizmo};
use crate::scene::{Linear, Placement, Shape};
use egui::Ui;
use glam::DVec3;

pub fn selected(ui: &mut Ui, state: &mut PanelState, session: &Session, asked: &mut Asked) {
    let selection = session.world().resource::<Selection>();
    let Some(active) = selection.active() else {
        ui.weak("nothing selected: click an object");
        return;
    };
    let inputs = session.inputs();
    let object = inputs.objects.iter().find(|object| object.entity == active);
    let light = inputs.lights.iter().find(|light| light.entity == active);
    let id = active.to_bits();
    let name = object.and_then(|object| object.name.as_deref()).or(light.and_then(|light| light.name.as_deref()));
    ui.horizontal(|ui| {
        name_field(ui, id, name, asked);
        if selection.0.len() > 1 {
            ui.weak(format!("and {} more", selection.0.len() - 1));
        }
    });
    ui.horizontal(|ui| {
        for mode in gizmo::Mode::ALL {
            let on = state.gizmo == Some(mode);
            if ui.selectable_label(on, mode.label()).clicked() {
                state.gizmo = (!on).then_some(mode);
            }
        }
        ui.add_space(2.0);
        if ui.button("Duplicate").clicked() {
            asked.edit(Edit::Duplicate);
        }
        if ui.button("Delete").clicked() {
            asked.edit(Edit::Delete);
        }
    });
    if let Some(object) = object {
        place(ui, id, &object.placement, asked);
        if let Shape::Sphere { radius } = &object.shape {
            rows(ui, "sphere", |ui| {
                row(ui, "radius", |ui| set_number(ui, id, Property::Radius, *radius, " m", asked));
            });
        }
        let inventory = state.inventory(session);
        material::of_object(ui, session, &inventory, object, asked);
    }
    if let Some(light) = light {
        rows(ui, "light", |ui| {
            row(ui, "position", |ui| {
                if let Some(value) = vector(ui, light.placement.translation, 0.01) {
                    asked.edit(Edit::Set { id, property: Property::Translation, value });
                }
            });
            row(ui, "intensity", |ui| {
                ui.horizontal(|ui| {
                    if let Some(value) = color(ui, light.light.intensity, true) {
                        asked.edit(Edit::Set { id, property: Property::Intensity, value });
                    }
                })
            });
            row(ui, "radius", |ui| {
                set_number(ui, id, Property::Radius, light.light.radius, " m", asked);
            });
        });
    }
}

fn set_number(ui: &mut Ui, id: u64, property: Property, value: f64, suffix: &str, asked: &mut Asked) {
    if let Some(value) = number(ui, value, proportional(value), 1e-9..=1e9, suffix) {
        asked.edit(Edit::Set { id, property, value: DVec3::splat(value) });
    }
}

fn place(ui: &mut Ui, id: u64, placement: &Placement, asked: &mut Asked) {
    rows(ui, "place", |ui| {
        row(ui, "position", |ui| {
            if let Some(value) = vector(ui, placement.translation, 0.01) {
                asked.edit(Edit::Set { id, property: Property::Translation, value });
            }
        });
        match placement.linear {
            Linear::Turned { rotation_deg, scale } => {
                row(ui, "rotation °", |ui| {
                    if let Some(value) = vector(ui, rotation_deg, 0.5) {
                        asked.edit(Edit::Set { id, property: Property::Rotation, value });
                    }
                });
                row(ui, "scale", |ui| {
                    let even = scale.x == scale.y && scale.y == scale.z;
                    // What was even stays even: spheres must be, and most else is meant to be.
                    let value = if even {
                        number(ui, scale.x, 0.005 * scale.x.abs(), 1e-6..=1e6, "").map(DVec3::splat)
                    } else {
                        vector(ui, scale, 0.005)
                    };
                    if let Some(value) = value {
                        asked.edit(Edit::Set { id, property: Property::Scale, value });
                    }
                });
            }
            Linear::Matrix(_) => row(ui, "rotation", |ui| drop(ui.weak("defined by a matrix"))),
        }
    });
}
