//! The editor of a material: its kind, its colour or texture, and its parameters.
//!
//! A material is shared by all objects that use it, and so is every edit. Callers of the editor show the number of
//! objects ([`shared_by`]).

use super::Asked;
use super::texture;
use super::widgets::{color, row, row_with_hint, rows, slider, vector};
use crate::frame::{Edit, Property, Session};
use crate::render::{Fresnel, MaterialKind, Param};
use crate::scene::{ColorParam, Inventory, Material, MaterialEntry, ObjectInput, ScalarParam, SurfaceMaterial};
use crate::viewer::status::thousands;
use bevy_ecs::prelude::Entity;
use egui::Ui;
use glam::DVec3;
use std::ops::RangeInclusive;

/// The material of an object, with its editor.
pub fn of_object(ui: &mut Ui, session: &Session, inventory: &Inventory, object: &ObjectInput, asked: &mut Asked) {
    let id = object.entity.to_bits();
    let slot = object.slots.first().copied();
    let current = slot.and_then(|slot| inventory.material(slot));
    rows(ui, "which material", |ui| {
        row(ui, "material", |ui| {
            let text = current.map_or("plain grey", |entry| entry.label.as_str());
            let combo = egui::ComboBox::from_id_salt("material").selected_text(text).width(150.0).truncate();
            combo.show_ui(ui, |ui| {
                for entry in &inventory.materials {
                    if ui.selectable_label(Some(entry.entity) == slot, &entry.label).clicked() {
                        asked.edit(Edit::Assign { id, material: entry.entity.to_bits() });
                    }
                }
            });
        });
    });
    if current.is_none_or(|entry| entry.users.len() > 1 || !entry.blends.is_empty()) {
        ui.horizontal_wrapped(|ui| {
            if let Some(current) = current {
                ui.weak(shared_by(current));
            }
            let hint = "give this object its own copy of the material, so that changes do not affect others";
            if ui.small_button("Make unique").on_hover_text(hint).clicked() {
                asked.edit(Edit::OwnMaterial { id });
            }
        });
    }
    let Some(current) = current else { return };
    if object.slots.len() > 1 {
        ui.weak(format!("the first of {}: see Materials for the others", object.slots.len()));
    }
    editor(ui, session, inventory, current.entity, asked);
}

/// Text that says how many objects an edit affects.
pub fn shared_by(entry: &MaterialEntry) -> String {
    match entry.users.len() {
        0 => "no object uses it".to_owned(),
        1 => "one object uses it".to_owned(),
        n => format!("shared by {} objects: edits show on all", thousands(n)),
    }
}

/// Draws kind, colour and parameters of a material, aligned with the rows above.
pub fn editor(ui: &mut Ui, session: &Session, inventory: &Inventory, entity: Entity, asked: &mut Asked) {
    let Some(material) = SurfaceMaterial::of(session.world(), entity) else { return };
    let id = entity.to_bits();
    ui.push_id(id, |ui| {
        rows(ui, "material", |ui| {
            row(ui, "kind", |ui| match material.kind() {
                MaterialKind::Blend => drop(ui.label(MaterialKind::Blend.name())),
                kind => {
                    egui::ComboBox::from_id_salt("kind").selected_text(kind.name()).width(104.0).show_ui(ui, |ui| {
                        for other in MaterialKind::PLAIN {
                            if ui.selectable_label(kind == other, other.name()).clicked() {
                                asked.edit(Edit::SetKind { id, kind: other });
                            }
                        }
                    });
                }
            });
            paint(ui, session, id, material, asked);
            numbers(ui, inventory, id, material, asked);
        });
    });
}

fn paint(ui: &mut Ui, session: &Session, id: u64, material: &Material, asked: &mut Asked) {
    let Some(paint) = material.color() else { return };
    let is_light = matches!(material, Material::Emissive { .. });
    row(ui, if is_light { "radiance" } else { "colour" }, |ui| {
        ui.horizontal(|ui| {
            match paint {
                ColorParam::Rgb(rgb) => {
                    if let Some(value) = color(ui, *rgb, is_light) {
                        asked.edit(Edit::Set { id, property: Property::Color, value });
                    }
                }
                ColorParam::Texture(texture) => drop(ui.label(&*crate::printable::name(&texture.name))),
            }
            texture::menu(ui, session, id, paint, asked);
        })
    });
    if let ColorParam::Texture(texture) = paint {
        texture::numbers(ui, id, &texture.part, asked);
    }
}

/// A scalar parameter with the name and the meaning shown to users.
struct Scale {
    name: &'static str,
    hint: &'static str,
    property: Property,
    range: RangeInclusive<f64>,
}

/// Points.
const SLIDER_WIDTH: f32 = 84.0;

impl Scale {
    /// `None` for properties that are not scalar.
    fn of(property: Property) -> Option<Self> {
        let (name, hint, range) = match property {
            Property::Alpha => {
                ("roughness", "0: mirror, 1: rough; its square is the width α of the GGX lobe", 0.032..=1.0)
            }
            Property::Ior => ("IOR", "index of refraction: water 1.33, glass 1.5, diamond 2.4", 1.0..=2.5),
            Property::Dispersion => {
                ("dispersion", "20 / Abbe number: glass 0.3 to 0.8, diamond 0.36; more exaggerates", 0.0..=10.0)
            }
            Property::Ambient => ("ambient", "ambient reflectance", 0.0..=1.0),
            Property::Specular => ("specular", "specular reflectance", 0.0..=1.0),
            Property::Shininess => ("shininess", "Phong exponent", 1.0..=10_000.0),
            Property::Transparency => ("transparency", "transmittance", 0.0..=1.0),
            Property::Weight => ("weight", "0: only the first, 1: only the second", 0.0..=1.0),
            Property::Metallic => ("metallic", "0: dielectric, 1: metal", 0.0..=1.0),
            Property::Roughness => ("roughness", "0: mirror, 1: rough", 0.0..=1.0),
            Property::Transmission => ("transmission", "0: opaque, 1: glass", 0.0..=1.0),
            Property::Anisotropy => ("anisotropy", "how much wider highlights are in one direction", 0.0..=1.0),
            Property::AnisotropyRotation => ("anisotropy angle", "degrees from the tangent", -180.0..=180.0),
            Property::SheenRoughness => ("sheen roughness", "0: sharp at the rim, 1: wide", 0.0..=1.0),
            Property::Clearcoat => ("clearcoat", "strength of the coat", 0.0..=1.0),
            Property::ClearcoatRoughness => ("coat roughness", "0: mirror, 1: rough", 0.0..=1.0),
            Property::Iridescence => ("iridescence", "strength of the colours of a thin film", 0.0..=1.0),
            Property::FilmIor => ("film IOR", "index of refraction of the film", 1.0..=2.5),
            Property::FilmThickness => ("film thickness", "nanometres", 0.0..=1500.0),
            Property::FilmThinnest => ("film at least", "nanometres, where the map of the film is black", 0.0..=1500.0),
            Property::Opacity => ("opacity", "0: fully transparent, 1: opaque", 0.0..=1.0),
            Property::NormalScale => ("normal scale", "strength of the normal map", -2.0..=2.0),
            _ => return None,
        };
        Some(Self { name, hint, property, range })
    }

    fn show(self, ui: &mut Ui, id: u64, value: f64, asked: &mut Asked) {
        let is_alpha = self.property == Property::Alpha;
        // The displayed roughness is the root of the lobe's width.
        let shown = if is_alpha { value.sqrt() } else { value };
        let logarithmic = *self.range.end() > 10.0;
        row_with_hint(ui, self.name, self.hint, |ui| {
            // The longest names leave less room.
            ui.spacing_mut().slider_width = SLIDER_WIDTH;
            if let Some(new) = slider(ui, shown, self.range, logarithmic) {
                let value = if is_alpha { new * new } else { new };
                asked.edit(Edit::Set { id, property: self.property, value: DVec3::splat(value) });
            }
        });
    }
}

/// A switch: its property, its label and its hint.
fn switch(name: &str) -> Option<(Property, &'static str, &'static str)> {
    let property = Property::of_param(name)?;
    Some(match property {
        Property::ThinWalled => (property, "thin walled", "light passes straight, as through a pane"),
        Property::TwoSided => (property, "two-sided", "off: back faces are invisible"),
        _ => return None,
    })
}

/// Whether opacity is a mask, and the opacity from which the surface exists.
fn cutoff_row(ui: &mut Ui, id: u64, cutoff: Option<f32>, asked: &mut Asked) {
    /// The default of glTF.
    const DEFAULT: f32 = 0.5;
    /// Out of range, which makes opacity a blend factor again.
    const NONE: f64 = 2.0;
    let mut set = |value: f64| {
        asked.edit(Edit::Set { id, property: Property::OpacityCutoff, value: DVec3::splat(value) });
    };
    row_with_hint(ui, "cutoff", "the surface is invisible where opacity is less; off: opacity is a share", |ui| {
        ui.horizontal(|ui| {
            let mut on = cutoff.is_some();
            if ui.checkbox(&mut on, "").changed() {
                set(if on { f64::from(DEFAULT) } else { NONE });
            }
            ui.spacing_mut().slider_width = SLIDER_WIDTH - 22.0;
            if let Some(cutoff) = cutoff
                && let Some(new) = slider(ui, f64::from(cutoff), 0.0..=1.0, false)
            {
                set(new);
            }
        });
    });
}

fn numbers(ui: &mut Ui, inventory: &Inventory, id: u64, material: &Material, asked: &mut Asked) {
    if let Material::Blend { a, b, .. } = material {
        let name = |part: &Entity| inventory.material(*part).map_or("?", |entry| entry.label.as_str());
        row(ui, "of", |ui| {
            let text = format!("{} and {}", name(a), name(b));
            ui.add(egui::Label::new(text).truncate()).on_hover_text("edit them in the list of materials");
        });
    }
    for (name, param) in material.params() {
        let value = match param {
            Param::Share(ScalarParam::Number(value))
            | Param::Number(value)
            | Param::Thickness(value)
            | Param::Dispersion(value)
            | Param::ConstantShare(value)
            | Param::Ior(value)
            | Param::Exponent(value) => *value,
            Param::Absorption(absorption) => {
                row_with_hint(ui, "absorption", "red, green and blue, per metre (Beer–Lambert)", |ui| {
                    if let Some(value) = vector(ui, absorption.as_dvec3(), 0.02) {
                        asked.edit(Edit::Set { id, property: Property::Absorption, value });
                    }
                });
                continue;
            }
            Param::Flag(flag) => {
                let Some((property, label, hint)) = switch(name) else { continue };
                row(ui, label, |ui| {
                    let mut on = *flag;
                    if ui.checkbox(&mut on, "").on_hover_text(hint).changed() {
                        let value = DVec3::splat(f64::from(u8::from(on)));
                        asked.edit(Edit::Set { id, property, value });
                    }
                });
                continue;
            }
            Param::Cutoff(cutoff) => {
                cutoff_row(ui, id, *cutoff, asked);
                continue;
            }
            Param::Reflectance(ColorParam::Rgb(rgb))
            | Param::Radiance(ColorParam::Rgb(rgb))
            | Param::Factor(ColorParam::Rgb(rgb)) => {
                let property = Property::of_param(name);
                let (Some(property), false) = (property, property == Some(Property::Color)) else { continue };
                row(ui, &name.replace('_', " "), |ui| {
                    let is_bright = matches!(property, Property::Emission | Property::SpecularColor);
                    ui.horizontal(|ui| {
                        if let Some(value) = color(ui, *rgb, is_bright) {
                            asked.edit(Edit::Set { id, property, value });
                        }
                    })
                });
                continue;
            }
            // Colours have their own row; textures of scalars and parts are not editable here.
            _ => continue,
        };
        if let Some(scale) = Property::of_param(name).and_then(Scale::of) {
            scale.show(ui, id, f64::from(value), asked);
        }
    }
    if let Material::Metal { fresnel, .. } = material {
        row(ui, "Fresnel", |ui| {
            let mut schlick = *fresnel == Fresnel::Schlick;
            let hint = "brighter at grazing angles, by Schlick's approximation";
            if ui.checkbox(&mut schlick, "Schlick").on_hover_text(hint).changed() {
                let value = DVec3::splat(f64::from(u8::from(schlick)));
                asked.edit(Edit::Set { id, property: Property::Schlick, value });
            }
        });
    }
}
