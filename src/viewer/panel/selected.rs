//! Name, placement, material and light of the selection.

use super::lights::strength_of;
use super::widgets::{color, name_field, number, proportional, row, row_with_hint, rows, vector};
use super::{Asked, PanelState, material};
use crate::frame::{Edit, Property, Selection, Session, gizmo};
use crate::scene::{DirectionalLight, LightInput, LightKind, Linear, Placement, Shape, SpotLight};
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
        rows(ui, "light", |ui| light_rows(ui, id, light, asked));
    }
}

fn light_rows(ui: &mut Ui, id: u64, input: &LightInput, asked: &mut Asked) {
    let mut edit = |property, value: Option<DVec3>| {
        if let Some(value) = value {
            asked.edit(Edit::Set { id, property, value });
        }
    };
    let LightInput { light, placement, .. } = input;
    if !matches!(light, LightKind::Directional(_)) {
        row(ui, "position", |ui| edit(Property::Translation, vector(ui, placement.translation, 0.01)));
    }
    if let LightKind::Spot(SpotLight { direction, .. }) | LightKind::Directional(DirectionalLight { direction, .. }) =
        light
    {
        row(ui, "direction", |ui| edit(Property::Direction, vector(ui, *direction, 0.01)));
        match placement.linear {
            Linear::Turned { rotation_deg, .. } => {
                row(ui, "rotation °", |ui| edit(Property::Rotation, vector(ui, rotation_deg, 0.5)));
            }
            Linear::Matrix(_) => row(ui, "rotation", |ui| drop(ui.weak("defined by a matrix"))),
        }
    }
    let (name, property) = strength_of(light);
    row(ui, name, |ui| ui.horizontal(|ui| edit(property, color(ui, light.strength(), true))));
    let mut degrees = |ui: &mut Ui, name: &str, property, angle_deg: f64| {
        row(ui, name, |ui| edit(property, number(ui, angle_deg, 0.2, 0.0..=90.0, "°").map(DVec3::splat)));
    };
    match light {
        LightKind::Point(light) => {
            row_with_hint(ui, "radius", "0: a point, which no camera sees", |ui| {
                let radius = number(ui, light.radius, proportional(light.radius), 0.0..=1e9, " m");
                // A radius too small for a sphere makes a point.
                edit(Property::Radius, radius.map(|r| DVec3::splat(if r < 1e-9 { 0.0 } else { r })));
            });
        }
        LightKind::Spot(light) => {
            degrees(ui, "inner angle", Property::InnerAngle, light.inner_angle_deg);
            degrees(ui, "outer angle", Property::OuterAngle, light.outer_angle_deg);
        }
        LightKind::Directional(_) => {}
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
                    // A uniform scale stays uniform: for spheres it must, and for most objects it should.
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
