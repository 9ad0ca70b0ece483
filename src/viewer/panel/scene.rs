//! The scene: the list of objects, adding objects, and opening other scenes.

use crate::frame::{Edit, NewThing, Selection, Session};
use crate::scene::{MeshSource, ObjectEntry};
use crate::viewer::dialog::DialogPurpose;
use crate::viewer::keys::{Action, with_key};
use crate::viewer::openable;
use crate::viewer::panel::list::{Listed, Which, list};
use crate::viewer::panel::state::{Around, Asked, PanelState};
use crate::viewer::panel::widgets::selectable;
use bevy_ecs::prelude::Entity;
use egui::Ui;

impl Listed for ObjectEntry {
    fn listed(&self) -> (Entity, &str, &str) {
        (self.entity, &self.label, self.material.as_deref().unwrap_or(self.kind))
    }
}

pub fn objects(ui: &mut Ui, state: &mut PanelState, session: &Session, asked: &mut Asked) {
    let inventory = state.inventory(session);
    let selection = session.world().resource::<Selection>();
    let which = Which { id: "objects", revision: session.revision(), chosen: selection.active(), height: 0.0 };
    list(ui, &mut state.object_list, &which, &inventory.objects, |ui, entry| {
        selectable(ui, entry, session.world(), asked);
    });
}

/// Opening of a file by dialog, recent files, and the built-in scenes.
pub fn open(ui: &mut Ui, session: &Session, around: &Around, asked: &mut Asked) {
    let hint = with_key(around.navigation, "open a scene, a model or a saved image", &Action::OpenDialog);
    if ui.button("File …").on_hover_text(hint).clicked() {
        asked.dialog = Some(DialogPurpose::Open);
    }
    ui.weak("or drop a file on the window");
    if let Some(command) = openable::recent(ui, session, around.recent) {
        asked.send(command);
    }
    ui.collapsing("Built-in scenes", |ui| {
        if let Some(command) = openable::scenes(ui, around.recent.thumbnails) {
            asked.send(command);
        }
    });
}

pub fn add(ui: &mut Ui, path: &mut String, asked: &mut Asked) {
    ui.horizontal_wrapped(|ui| {
        for (label, thing) in NewThing::NAMED {
            if ui.button(label).clicked() {
                asked.edit(Edit::Add(thing));
            }
        }
    });
    ui.horizontal(|ui| {
        egui::ComboBox::from_id_salt("builtin mesh").selected_text("Mesh").show_ui(ui, |ui| {
            for name in crate::scene::BUILTIN_MESHES {
                if ui.selectable_label(false, *name).clicked() {
                    asked.edit(Edit::Add(NewThing::Mesh(MeshSource::Builtin((*name).to_owned()))));
                }
            }
        });
        let field = ui.add(egui::TextEdit::singleline(path).hint_text("model.obj").desired_width(72.0));
        let entered = field.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
        if ui.button("…").on_hover_text("choose a file").clicked() {
            asked.dialog = Some(DialogPurpose::AddMesh { at: None });
        }
        if (ui.button("Add").clicked() || entered) && !path.trim().is_empty() {
            asked.edit(Edit::Add(NewThing::Mesh(MeshSource::of_file(path.trim().to_owned()))));
        }
    });
}
