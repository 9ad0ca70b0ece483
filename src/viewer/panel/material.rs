//! The editor of a material: its kind, its colour or texture, and its parameters.
//!
//! A material is shared by all objects that use it, and so is every edit. Callers of the editor show the number of
//! objects ([`shared_by`]).

use crate::frame::{self, Edit, Session, active_part};
use crate::render::{Domain, Fresnel, MaterialKind, Param, ParamRef, Property};
use crate::scene::thousands;
use crate::scene::{
    ColorParam, InWorld, Inventory, Material, MaterialEntry, MaterialProperty, ObjectInput, ScalarParam,
    SurfaceMaterial,
};
use crate::viewer::panel::state::Asked;
use crate::viewer::panel::texture;
use crate::viewer::panel::widgets::{RADIANCE, color, row, row_with_hint, rows, slider, vector};
use bevy_ecs::prelude::Entity;
use egui::Ui;
use glam::DVec3;

/// The material of an object, with its editor.
pub fn of_object(ui: &mut Ui, session: &Session, inventory: &Inventory, object: &ObjectInput, asked: &mut Asked) {
    let id = object.entity.to_bits();
    let part = active_part(session.world()).filter(|(active, _)| *active == object.entity).map(|(_, part)| part);
    let slot = object.slots.get(part.unwrap_or(0)).copied();
    let label = |slot: Entity| inventory.material(slot).map_or("plain grey", |entry| entry.label.as_str());
    let current = slot.and_then(|slot| inventory.material(slot));
    rows(ui, "which material", |ui| {
        if object.slots.len() > 1 {
            let hint = "the part of the object that gets a material: click one in the image to choose it";
            row_with_hint(ui, "part", hint, |ui| {
                let all = format!("all {}", thousands(object.slots.len()));
                let text = part.map_or(all.clone(), |part| format!("{}: {}", part + 1, label(object.slots[part])));
                let combo = egui::ComboBox::from_id_salt("part").selected_text(text).width(150.0).truncate();
                combo.show_ui(ui, |ui| {
                    if ui.selectable_label(part.is_none(), all).clicked() {
                        asked.edit(Edit::ChoosePart { id, part: None });
                    }
                    for (i, slot) in object.slots.iter().enumerate() {
                        if ui.selectable_label(part == Some(i), format!("{}: {}", i + 1, label(*slot))).clicked() {
                            asked.edit(Edit::ChoosePart { id, part: Some(i as u32) });
                        }
                    }
                });
            });
        }
        row(ui, "material", |ui| {
            let text = match part {
                None if object.slots.len() > 1 => "several",
                _ => slot.map_or("plain grey", label),
            };
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
    if part.is_none() && object.slots.len() > 1 {
        ui.weak("click a part in the image to change its material");
        return;
    }
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
                        for other in MaterialKind::plain() {
                            if ui.selectable_label(kind == other, other.name()).clicked() {
                                asked.edit(Edit::SetKind { id, kind: other });
                            }
                        }
                    });
                }
            });
            parts(ui, inventory, material);
            let main = material.kind().main_property();
            let (first, others): (Vec<_>, Vec<_>) =
                material.params().into_iter().partition(|(property, _)| Some(property.name) == main);
            for (property, param) in first {
                property_row(ui, id, property, param, Some(session), asked);
            }
            if let Some(ColorParam::Texture(texture)) = material.color() {
                texture::numbers(ui, id, &texture.part, asked);
            }
            for (property, param) in others {
                property_row(ui, id, property, param, None, asked);
            }
        });
    });
}

/// The materials of a blend.
fn parts(ui: &mut Ui, inventory: &Inventory, material: &Material) {
    let Material::Blend { a, b, .. } = material else { return };
    let name = |part: &Entity| inventory.material(*part).map_or("?", |entry| entry.label.as_str());
    row(ui, "of", |ui| {
        let text = format!("{} and {}", name(a), name(b));
        ui.add(egui::Label::new(text).truncate()).on_hover_text("edit them in the list of materials");
    });
}

/// The row of one property; nothing for what cannot be changed here: textures of numbers, maps and parts.
///
/// - `texture_of`: offers the textures of this session for a colour.
fn property_row(
    ui: &mut Ui,
    id: u64,
    property: &Property,
    param: ParamRef<'_, InWorld>,
    texture_of: Option<&Session>,
    asked: &mut Asked,
) {
    let Some(name) = MaterialProperty::named(property.name) else { return };
    let set = |asked: &mut Asked, value: DVec3| {
        asked.edit(Edit::Set { id, property: frame::Property::Material(name), value });
    };
    let labelled =
        |ui: &mut Ui, contents: &mut dyn FnMut(&mut Ui)| row_with_hint(ui, property.label, property.help, contents);
    match param {
        Param::Color(paint) => {
            let unit = match property.domain {
                Domain::Radiance => Some(RADIANCE),
                Domain::Factor => Some(""),
                _ => None,
            };
            labelled(ui, &mut |ui| {
                let shown = |ui: &mut Ui| match paint {
                    ColorParam::Rgb(rgb) => color(ui, *rgb, unit),
                    ColorParam::Texture(texture) => {
                        ui.label(&*crate::files::printable::name(&texture.name));
                        None
                    }
                };
                // The strength of a light, and textures, have lines of their own.
                ui.vertical(|ui| {
                    let chosen = if unit.is_some() { shown(ui) } else { ui.horizontal(shown).inner };
                    if let Some(value) = chosen {
                        set(asked, value);
                    }
                    if let Some(session) = texture_of {
                        texture::menu(ui, session, id, frame::Property::Material(name), paint, asked);
                    }
                });
            });
        }
        Param::Rgb(rgb) => labelled(ui, &mut |ui| {
            if let Some(value) = vector(ui, rgb.as_dvec3(), 0.02) {
                set(asked, value);
            }
        }),
        Param::Scalar(ScalarParam::Number(number)) | Param::Number(number) => labelled(ui, &mut |ui| {
            if let Some(value) = domain_slider(ui, property.domain, f64::from(*number)) {
                set(asked, DVec3::splat(value));
            }
        }),
        Param::Flag(on) => labelled(ui, &mut |ui| {
            let mut on = *on;
            if ui.checkbox(&mut on, "").changed() {
                set(asked, DVec3::splat(f64::from(u8::from(on))));
            }
        }),
        Param::Fresnel(fresnel) => labelled(ui, &mut |ui| {
            let mut schlick = *fresnel == Fresnel::Schlick;
            if ui.checkbox(&mut schlick, "Schlick").changed() {
                set(asked, DVec3::splat(f64::from(u8::from(schlick))));
            }
        }),
        Param::Cutoff(cutoff) => labelled(ui, &mut |ui| {
            if let Some(value) = cutoff_slider(ui, *cutoff) {
                set(asked, DVec3::splat(value));
            }
        }),
        Param::Scalar(ScalarParam::Texture(_)) | Param::Part(_) => {}
    }
}

/// Points. The longest labels leave no more room.
const SLIDER_WIDTH: f32 = 84.0;

/// Returns the new value if it was changed.
fn domain_slider(ui: &mut Ui, domain: Domain, value: f64) -> Option<f64> {
    let range = domain.slider()?;
    ui.spacing_mut().slider_width = SLIDER_WIDTH;
    match domain {
        // People know the root of the lobe's width as roughness.
        // 0 is a mirror, or the other width.
        Domain::Width if value == 0.0 => {
            slider(ui, 0.0, 0.0..=*range.end(), false).map(|roughness| roughness * roughness)
        }
        Domain::Width => slider(ui, value.sqrt(), range, false).map(|roughness| roughness * roughness),
        _ => slider(ui, value, range, domain.is_logarithmic()),
    }
}

/// A number that may be absent; returns the new value if it was changed.
fn cutoff_slider(ui: &mut Ui, cutoff: Option<f32>) -> Option<f64> {
    /// The default of glTF.
    const DEFAULT: f64 = 0.5;
    /// Out of range: no cutoff.
    const NONE: f64 = 2.0;
    ui.horizontal(|ui| {
        let mut on = cutoff.is_some();
        let switched = ui.checkbox(&mut on, "").changed().then_some(if on { DEFAULT } else { NONE });
        ui.spacing_mut().slider_width = SLIDER_WIDTH - 22.0;
        let moved = cutoff.and_then(|cutoff| slider(ui, f64::from(cutoff), 0.0..=1.0, false));
        switched.or(moved)
    })
    .inner
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render;
    use glam::Vec3;

    /// What is wider than the panel makes all of its rows wider, and cuts them.
    #[test]
    fn the_rows_of_an_area_light_are_no_wider_than_the_panel() {
        use crate::frame::{NewThing, Selection, SessionOptions};
        use crate::scene::{LoadOptions, SceneSource, load};
        let mut session = Session::new(SessionOptions { width: 8, height: 8, ..SessionOptions::default() }).unwrap();
        session.adopt(load(&SceneSource::Builtin("ball".to_owned()), &LoadOptions::default()).unwrap());
        session.update(std::time::Duration::ZERO);
        session.send(frame::Command::Edit(Edit::Add(NewThing::AreaLight)));
        session.update(std::time::Duration::ZERO);
        let active = session.world().resource::<Selection>().active().unwrap();
        let object = session.inputs().objects.iter().find(|object| object.entity == active).unwrap();
        let context = egui::Context::default();
        let mut width = 0.0;
        for _ in 0..3 {
            let _ = context.run(egui::RawInput::default(), |context| {
                egui::Window::new("w").show(context, |ui| {
                    // That of the panel, its margins, its scroll bar and the indent of a section less.
                    ui.set_max_width(248.0);
                    of_object(ui, &session, &session.inventory(), object, &mut Asked::default());
                    width = ui.min_rect().width();
                });
            });
        }
        assert!(width <= 248.0, "{width}");
    }

    #[test]
    fn every_property_that_can_be_set_has_a_row_with_its_label() {
        for kind in MaterialKind::plain() {
            let material: Material = render::Material::of_kind(kind, ColorParam::Rgb(Vec3::splat(0.5))).unwrap();
            let context = egui::Context::default();
            let output = context.run(egui::RawInput::default(), |context| {
                egui::CentralPanel::default().show(context, |ui| {
                    rows(ui, "material", |ui| {
                        for (property, param) in material.params() {
                            property_row(ui, 0, property, param, None, &mut Asked::default());
                        }
                    });
                });
            });
            let shown: Vec<String> = (output.shapes.iter())
                .filter_map(|shape| match &shape.shape {
                    egui::Shape::Text(text) => Some(text.galley.text().to_owned()),
                    _ => None,
                })
                .collect();
            for (property, _) in material.params() {
                let can_be_set = MaterialProperty::named(property.name).is_some();
                assert_eq!(shown.iter().any(|text| text == property.label), can_be_set, "{kind:?} {}", property.name);
            }
        }
    }
}
