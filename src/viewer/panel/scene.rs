//! What is in the scene: the list of things, new ones, and the sky.

use super::{Asked, color, row, rows};
use crate::frame::{Command, Edit, NewThing, Property, Selection, Session};
use crate::render::Environment;
use crate::scene::Shape;
use crate::scene::file::MeshSourcePart;
use crate::viewer::dialog::Purpose;
use bevy_ecs::prelude::Entity;
use egui::{RichText, Ui};
use std::path::Path;

pub fn objects(ui: &mut Ui, session: &Session, asked: &mut Asked) {
    let (inputs, selection) = (session.inputs(), session.world().resource::<Selection>());
    let things: Vec<(Entity, Option<&str>, &str)> = (inputs.objects.iter())
        .map(|object| (object.entity, object.name.as_deref(), kind(&object.shape)))
        .chain(inputs.lights.iter().map(|light| (light.entity, light.name.as_deref(), "point light")))
        .collect();
    let height = ui.text_style_height(&egui::TextStyle::Body) + 4.0;
    let list = egui::ScrollArea::vertical().id_salt("objects").max_height(9.0 * height).auto_shrink([false, true]);
    // Only the rows that are seen are made, so that a thousand cost no more than ten.
    list.show_rows(ui, height, things.len(), |ui, range| {
        for &(entity, name, kind) in &things[range] {
            ui.horizontal(|ui| {
                ui.set_height(height);
                let name = name.map_or_else(|| entity.to_string(), str::to_owned);
                let is_selected = selection.0.contains(&entity);
                if ui.selectable_label(is_selected, name).clicked() {
                    let add = ui.input(|input| input.modifiers.command || input.modifiers.shift);
                    asked.edit(Edit::Select { id: entity.to_bits(), add });
                }
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    ui.label(RichText::new(kind).small().weak());
                });
            });
        }
    });
}

fn kind(shape: &Shape) -> &'static str {
    match shape {
        Shape::Sphere { .. } => "sphere",
        Shape::Plane { .. } => "plane",
        Shape::Quad { .. } => "quad",
        Shape::Triangle { .. } => "triangle",
        Shape::Mesh(_) => "mesh",
        Shape::Spheres(_) => "balls",
    }
}

/// A file by dialog, or what was opened before, which a click opens again.
pub fn open(ui: &mut Ui, session: &Session, recent: &[String], asked: &mut Asked) {
    if ui.button("File …").on_hover_text("a scene, a model, or a picture that was kept (Ctrl+O)").clicked() {
        asked.dialog = Some(Purpose::Open);
    }
    let mut others = recent.iter().filter(|name| **name != session.status().scene).take(8).peekable();
    if others.peek().is_none() {
        ui.weak("nothing else so far: drop a file on the window");
    }
    for name in others {
        let short = Path::new(name).file_name().map_or(name.into(), |file| file.to_string_lossy());
        if ui.selectable_label(false, short).on_hover_text(name).clicked() {
            asked.send(Command::Open { path: name.into() });
        }
    }
}

pub fn add(ui: &mut Ui, path: &mut String, asked: &mut Asked) {
    ui.horizontal_wrapped(|ui| {
        for (label, thing) in [
            ("Sphere", NewThing::Sphere),
            ("Plane", NewThing::Plane),
            ("Cube", NewThing::Cube),
            ("Area light", NewThing::AreaLight),
            ("Point light", NewThing::PointLight),
        ] {
            if ui.button(label).clicked() {
                asked.edit(Edit::Add(thing));
            }
        }
    });
    ui.horizontal(|ui| {
        egui::ComboBox::from_id_salt("builtin mesh").selected_text("Mesh").show_ui(ui, |ui| {
            for name in crate::scene::BUILTIN_MESHES {
                if ui.selectable_label(false, *name).clicked() {
                    asked.edit(Edit::Add(NewThing::Mesh(MeshSourcePart::Builtin((*name).to_owned()))));
                }
            }
        });
        let field = ui.add(egui::TextEdit::singleline(path).hint_text("model.obj").desired_width(72.0));
        let entered = field.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
        if ui.button("…").on_hover_text("choose a file").clicked() {
            asked.dialog = Some(Purpose::AddMesh);
        }
        if (ui.button("Add").clicked() || entered) && !path.trim().is_empty() {
            asked.edit(Edit::Add(NewThing::Mesh(MeshSourcePart::Obj(path.trim().to_owned()))));
        }
    });
}

pub fn sky(ui: &mut Ui, session: &Session, asked: &mut Asked) {
    let mut edit = |property, value| asked.edit(Edit::Set { id: 0, property, value });
    rows(ui, "sky", |ui| match &session.inputs().environment.light {
        Environment::Black => row(ui, "sky", |ui| {
            if let Some(value) = color(ui, glam::Vec3::ZERO, true) {
                edit(Property::Sky, value);
            }
        }),
        Environment::Constant(radiance) => row(ui, "sky", |ui| {
            if let Some(value) = color(ui, *radiance, true) {
                edit(Property::Sky, value);
            }
        }),
        Environment::Gradient { zenith, horizon, ground } => {
            for (name, property, value) in [
                ("zenith", Property::Zenith, zenith),
                ("horizon", Property::Horizon, horizon),
                ("ground", Property::Ground, ground),
            ] {
                row(ui, name, |ui| {
                    ui.horizontal(|ui| {
                        if let Some(value) = color(ui, *value, true) {
                            edit(property, value);
                        }
                    })
                });
            }
        }
        Environment::Image { .. } => row(ui, "sky", |ui| drop(ui.label("a picture"))),
    });
}
