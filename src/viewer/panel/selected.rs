//! Place, material, light and mesh of what is selected.

use super::{Asked, PanelState, color, number, row, rows, slider, texture, vector};
use crate::frame::{Edit, MaterialKind, MeshMeasure, Property, Selection, Session, gizmo, paint_of};
use crate::render::Fresnel;
use crate::scene::file::MeshShadingPart;
use crate::scene::{Amount, Linear, Material, MeshOrigin, Paint, Placement, Shape};
use crate::viewer::change::Difference;
use crate::viewer::status::{metres, percent};
use bevy_ecs::prelude::Entity;
use egui::Ui;
use glam::DVec3;

pub fn selected(ui: &mut Ui, state: &mut PanelState, session: &Session, asked: &mut Asked) {
    let selection = session.world().resource::<Selection>();
    let Some(active) = selection.active() else {
        ui.weak("nothing: click on something");
        return;
    };
    let inputs = session.inputs();
    let object = inputs.objects.iter().find(|object| object.entity == active);
    let light = inputs.lights.iter().find(|light| light.entity == active);
    let id = active.to_bits();
    let name = object.and_then(|object| object.name.as_deref()).or(light.and_then(|light| light.name.as_deref()));
    ui.horizontal(|ui| {
        let old = name.unwrap_or_default();
        // What is being typed is kept by the field, and takes effect when it is left.
        let key = ui.id().with(("name", id));
        let mut text = ui.data(|data| data.get_temp::<String>(key)).unwrap_or_else(|| old.to_owned());
        let field = ui.add(egui::TextEdit::singleline(&mut text).hint_text("no name").desired_width(130.0));
        if field.has_focus() {
            ui.data_mut(|data| data.insert_temp(key, text));
        } else {
            ui.data_mut(|data| data.remove::<String>(key));
            if field.lost_focus() && text != old {
                asked.edit(Edit::Rename { id, name: text });
            }
        }
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
        ui.separator();
        if ui.button("Copy").clicked() {
            asked.edit(Edit::Duplicate);
        }
        if ui.button("Delete").clicked() {
            asked.edit(Edit::Delete);
        }
    });
    if let Some(object) = object {
        place(ui, id, &object.placement, asked);
        shape(ui, state, session, active, &object.shape, asked);
        material(ui, session, active, &object.slots, asked);
    }
    if let Some(light) = light {
        rows(ui, "light", |ui| {
            row(ui, "place", |ui| {
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
    if let Some(value) = number(ui, value, 0.01 * value.abs().max(1e-3), 1e-9..=1e9, suffix) {
        asked.edit(Edit::Set { id, property, value: DVec3::splat(value) });
    }
}

fn place(ui: &mut Ui, id: u64, placement: &Placement, asked: &mut Asked) {
    rows(ui, "place", |ui| {
        row(ui, "place", |ui| {
            if let Some(value) = vector(ui, placement.translation, 0.01) {
                asked.edit(Edit::Set { id, property: Property::Translation, value });
            }
        });
        match placement.linear {
            Linear::Turned { rotation_deg, scale } => {
                row(ui, "turned °", |ui| {
                    if let Some(value) = vector(ui, rotation_deg, 0.5) {
                        asked.edit(Edit::Set { id, property: Property::Rotation, value });
                    }
                });
                row(ui, "scale", |ui| {
                    let even = scale.x == scale.y && scale.y == scale.z;
                    // What was even stays even: balls must be, and most else is meant to be.
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
            Linear::Matrix(_) => row(ui, "turned", |ui| drop(ui.weak("by a matrix"))),
        }
    });
}

fn shape(ui: &mut Ui, state: &mut PanelState, session: &Session, entity: Entity, shape: &Shape, asked: &mut Asked) {
    let id = entity.to_bits();
    match shape {
        Shape::Sphere { radius } => rows(ui, "sphere", |ui| {
            row(ui, "radius", |ui| set_number(ui, id, Property::Radius, *radius, " m", asked));
        }),
        Shape::Mesh(mesh) => rows(ui, "mesh", |ui| {
            row(ui, "faces", |ui| drop(ui.label(thousands(mesh.triangles.len()))));
            let Some(origin) = session.world().get::<MeshOrigin>(entity) else { return };
            let ratio = origin.simplify.unwrap_or(1.0);
            row(ui, "normals", |ui| {
                ui.horizontal(|ui| {
                    let kinds = [
                        (MeshShadingPart::Auto, "auto"),
                        (MeshShadingPart::Smooth, "smooth"),
                        (MeshShadingPart::Flat, "flat"),
                    ];
                    for (shading, label) in kinds {
                        if ui.selectable_label(origin.shading == shading, label).clicked() && origin.shading != shading
                        {
                            asked.edit(Edit::Remesh { id, shading, ratio });
                        }
                    }
                })
            });
            row(ui, "simplify", |ui| {
                let shown = state.ratio.filter(|(of, _)| *of == entity).map_or(ratio, |(_, ratio)| ratio);
                let mut percent = 100.0 * shown;
                let scale = egui::Slider::new(&mut percent, 1.0..=100.0).logarithmic(true).suffix(" %").max_decimals(1);
                let response = ui.add(scale.update_while_editing(false));
                if response.changed() {
                    let ratio = (percent / 100.0).clamp(0.01, 1.0);
                    state.ratio = Some((entity, ratio));
                    state.change.begin(entity, origin.simplify.is_none(), session);
                    asked.edit(Edit::Remesh { id, shading: origin.shading, ratio });
                } else if !response.dragged() && session.status().loading.is_none() {
                    state.ratio = None;
                }
            });
            if let Some(measure) =
                session.world().get::<MeshMeasure>(entity).filter(|m| m.faces == mesh.triangles.len())
            {
                row(ui, "of", |ui| drop(ui.label(format!("{} faces", thousands(measure.whole_faces)))));
                if let Some(deviation) = measure.deviation {
                    row(ui, "distance", |ui| {
                        let hint = "between the two surfaces, measured at 20,000 points of each, before scaling";
                        let text = format!("mean {}, largest {}", metres(deviation.mean()), metres(deviation.max()));
                        ui.label(text).on_hover_text(hint);
                    });
                    row(ui, "picture", |ui| match state.change.of(entity) {
                        Some(Difference { mean, plain, spp: [before, now] }) => {
                            let hint = format!(
                                "difference to the picture with the whole mesh ({before} samples, now {now}), noise \
                                 included: mean, and pixels that differ by more than a twentieth of white"
                            );
                            let text = format!("{} mean, {} of pixels", percent(mean), percent(plain));
                            ui.label(text).on_hover_text(hint);
                        }
                        None => drop(ui.weak("–").on_hover_text("the whole mesh was not seen from here")),
                    });
                }
            }
        }),
        _ => {}
    }
}

fn material(ui: &mut Ui, session: &Session, object: Entity, slots: &[Entity], asked: &mut Asked) {
    let inputs = session.inputs();
    let slot = slots.first().copied();
    let current = slot.and_then(|slot| inputs.materials.iter().find(|material| material.entity == slot));
    let name =
        |material: &crate::scene::MaterialInput| material.name.clone().unwrap_or_else(|| material.entity.to_string());
    rows(ui, "material", |ui| {
        row(ui, "material", |ui| {
            ui.horizontal(|ui| {
                let text = current.map_or("plain grey".to_owned(), name);
                let combo = egui::ComboBox::from_id_salt("material").selected_text(text).width(104.0).truncate();
                combo.show_ui(ui, |ui| {
                    for material in &inputs.materials {
                        if ui.selectable_label(Some(material.entity) == slot, name(material)).clicked() {
                            let edit = Edit::Assign { id: object.to_bits(), material: material.entity.to_bits() };
                            asked.edit(edit);
                        }
                    }
                });
                if ui.small_button("own").on_hover_text("a copy of it, for this object alone").clicked() {
                    asked.edit(Edit::OwnMaterial { id: object.to_bits() });
                }
            })
        });
        let Some(current) = current else { return };
        let id = current.entity.to_bits();
        if let Some(kind) = MaterialKind::of(&current.material) {
            row(ui, "kind", |ui| {
                egui::ComboBox::from_id_salt("kind").selected_text(kind.label()).width(104.0).show_ui(ui, |ui| {
                    for other in MaterialKind::ALL {
                        if ui.selectable_label(kind == other, other.label()).clicked() {
                            asked.edit(Edit::SetKind { id, kind: other });
                        }
                    }
                })
            });
        }
        properties(ui, session, id, &current.material, asked);
    });
}

fn properties(ui: &mut Ui, session: &Session, id: u64, material: &Material, asked: &mut Asked) {
    if let Some(paint) = paint_of(material) {
        let name = if matches!(material, Material::Emissive { .. }) { "radiance" } else { "colour" };
        row(ui, name, |ui| {
            ui.horizontal(|ui| {
                match paint {
                    Paint::Rgb(rgb) => {
                        let bright = matches!(material, Material::Emissive { .. });
                        if let Some(value) = color(ui, *rgb, bright) {
                            asked.edit(Edit::Set { id, property: Property::Color, value });
                        }
                    }
                    Paint::Texture(texture) => drop(ui.label(&texture.name)),
                }
                texture::menu(ui, session, id, paint, asked);
            })
        });
        if let Paint::Texture(texture) = paint {
            texture::numbers(ui, id, &texture.part, asked);
        }
    }
    let mut amount = |ui: &mut Ui, name: &str, property: Property, value: f64, range: std::ops::RangeInclusive<f64>| {
        let logarithmic = *range.end() > 10.0 || property == Property::Alpha;
        row(ui, name, |ui| {
            if let Some(value) = slider(ui, value, range, logarithmic) {
                asked.edit(Edit::Set { id, property, value: DVec3::splat(value) });
            }
        });
    };
    let number = |amount: &Amount| if let Amount::Number(value) = amount { Some(f64::from(*value)) } else { None };
    match material {
        Material::Metal { alpha, fresnel, .. } => {
            if let Some(alpha) = number(alpha) {
                amount(ui, "GGX width", Property::Alpha, alpha, 1e-3..=1.0);
            }
            row(ui, "edges", |ui| {
                let mut schlick = *fresnel == Fresnel::Schlick;
                if ui.checkbox(&mut schlick, "brighter").on_hover_text("Schlick's approximation").changed() {
                    let value = DVec3::splat(f64::from(u8::from(schlick)));
                    asked.edit(Edit::Set { id, property: Property::Schlick, value });
                }
            });
        }
        Material::Glass { ior, absorption } => {
            amount(ui, "refraction", Property::Ior, f64::from(*ior), 1.0..=2.5);
            row(ui, "absorbs /m", |ui| {
                if let Some(value) = vector(ui, absorption.as_dvec3(), 0.02) {
                    asked.edit(Edit::Set { id, property: Property::Absorption, value });
                }
            });
        }
        Material::Phong { ambient, specular, shininess, transparency, ior, .. } => {
            amount(ui, "ambient", Property::Ambient, f64::from(*ambient), 0.0..=1.0);
            if let Some(specular) = number(specular) {
                amount(ui, "specular", Property::Specular, specular, 0.0..=1.0);
            }
            amount(ui, "shininess", Property::Shininess, f64::from(*shininess), 1.0..=10_000.0);
            amount(ui, "transparent", Property::Transparency, f64::from(*transparency), 0.0..=1.0);
            amount(ui, "refraction", Property::Ior, f64::from(*ior), 1.0..=2.5);
        }
        Material::Blend { weight, .. } => {
            if let Some(weight) = number(weight) {
                amount(ui, "second part", Property::Weight, weight, 0.0..=1.0);
            }
        }
        Material::Diffuse { .. } | Material::Mirror { .. } | Material::Emissive { .. } => {}
    }
}

/// 1234567 as 1,234,567.
pub fn thousands(n: usize) -> String {
    let digits = n.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::thousands;

    #[test]
    fn large_numbers_are_grouped() {
        assert_eq!([0, 999, 1000, 1_234_567].map(thousands), ["0", "999", "1,000", "1,234,567"]);
    }
}
