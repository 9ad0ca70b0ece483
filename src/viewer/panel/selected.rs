//! Name, placement, material and light of the selection.

use crate::frame::{Edit, Property, Selection, Session, gizmo};
use crate::scene::animation::{LightProperty, ObjectProperty, PropertyInfo, Quantity};
use crate::scene::{LightInput, Shape};
use crate::viewer::panel::material;
use crate::viewer::panel::ready::library_of_materials;
use crate::viewer::panel::state::{Around, Asked, PanelState};
use crate::viewer::panel::widgets::{color, name_field, number, proportional, row, row_with_hint, rows, vector};
use bevy_ecs::name::Name;
use egui::Ui;
use glam::DVec3;

/// What to do about an empty selection.
pub const NOTHING_SELECTED: &str = "nothing selected: click an object";

pub fn selected(ui: &mut Ui, state: &mut PanelState, session: &Session, around: &Around, asked: &mut Asked) {
    let selection = session.world().resource::<Selection>();
    let Some(active) = selection.active() else {
        ui.weak(NOTHING_SELECTED);
        return;
    };
    let inputs = session.inputs();
    let object = inputs.objects.iter().find(|object| object.entity == active);
    let light = inputs.lights.iter().find(|light| light.entity == active);
    let id = active.to_bits();
    let name = session.world().get::<Name>(active).map(|name| name.as_str());
    ui.horizontal(|ui| {
        name_field(ui, id, name, asked);
        if selection.0.len() > 1 {
            ui.weak(format!("and {} more", selection.0.len() - 1));
        }
    });
    ui.horizontal_wrapped(|ui| {
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
        let hidden = object.is_none() && light.is_none();
        if ui.button(if hidden { "Show" } else { "Hide" }).clicked() {
            asked.edit(if hidden { Edit::SetHidden { id, hidden: false } } else { Edit::Hide { others: false } });
        }
    });
    if let Some(object) = object {
        rows(ui, "place", |ui| {
            for &property in ObjectProperty::ALL {
                // The translation is relative to the pivot, which edits move to the middle.
                let by_pivot = match property {
                    ObjectProperty::Translate => object.placement.position() - object.placement.translation,
                    _ => DVec3::ZERO,
                };
                let value = property.get(&object.placement).map(|value| value + by_pivot);
                if let Some(value) = property_field(ui, property.info(), value) {
                    let property = Property::Object(property);
                    asked.edit(Edit::Set { id, property, value: value - by_pivot });
                }
            }
            if let Shape::Sphere { radius } = object.shape {
                row(ui, "radius", |ui| {
                    if let Some(radius) = number(ui, radius, proportional(radius), 1e-9..=1e9, " m") {
                        let value = DVec3::splat(radius);
                        asked.edit(Edit::Set { id, property: Property::SphereRadius, value });
                    }
                });
            }
        });
        ui.collapsing("Material library", |ui| library_of_materials(ui, around.recent.thumbnails, asked))
            .header_response
            .on_hover_text("ready materials: gold, glass, porcelain …");
        let inventory = state.inventory(session);
        material::of_object(ui, session, &inventory, object, asked);
    }
    if let Some(LightInput { light, placement, .. }) = light {
        rows(ui, "light", |ui| {
            for property in LightProperty::of(light) {
                let value = property.get(light, placement);
                property_row(ui, id, Property::Light(property), property.info(), value, asked);
            }
        });
    }
}

/// The row of a property of an object, a light or the environment.
///
/// - `value`: `None` for the rotation and the scale of a matrix with shear.
pub fn property_row(
    ui: &mut Ui,
    id: u64,
    property: Property,
    info: &PropertyInfo,
    value: Option<DVec3>,
    asked: &mut Asked,
) {
    if let Some(value) = property_field(ui, info, value) {
        asked.edit(Edit::Set { id, property, value });
    }
}

/// The row of a property; the value that was set.
fn property_field(ui: &mut Ui, info: &PropertyInfo, value: Option<DVec3>) -> Option<DVec3> {
    row_with_hint(ui, info.label, info.help, |ui| {
        let Some(value) = value else {
            ui.weak("a matrix with shear");
            return None;
        };
        let [least, most] = info.range;
        match info.quantity {
            Quantity::Position | Quantity::Direction => vector(ui, value, 0.01),
            Quantity::Rotation => vector(ui, value, 0.5),
            // A uniform scale stays uniform: for spheres it must, and for most objects it should.
            Quantity::Factors if value.x == value.y && value.y == value.z => {
                number(ui, value.x, 0.005 * value.x.abs(), least..=most, info.unit).map(DVec3::splat)
            }
            Quantity::Factors => vector(ui, value, 0.005),
            Quantity::Color => color(ui, value.as_vec3(), Some(info.unit)),
            Quantity::Number => {
                let speed = if info.unit == "°" { 0.2 } else { proportional(value.x) };
                number(ui, value.x, speed, least..=most, info.unit).map(DVec3::splat)
            }
        }
    })
}
