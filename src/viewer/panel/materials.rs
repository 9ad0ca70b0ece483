//! The list of materials, with the editor of the chosen one.

use crate::frame::{Edit, Selection, Session};
use crate::scene::thousands;
use crate::scene::{Inventory, MaterialEntry, SurfaceMaterial};
use crate::viewer::panel::list::{Listed, Which, list};
use crate::viewer::panel::material::{editor, shared_by};
use crate::viewer::panel::state::{Asked, DroppedMaterial, PanelState};
use crate::viewer::panel::swatch::swatch;
use crate::viewer::panel::widgets::{choice, name_field};
use crate::viewer::previews::Previews;
use bevy_ecs::name::Name;
use bevy_ecs::prelude::Entity;
use egui::{Image, RichText, Sense, Ui, vec2};

/// Width of the sphere of a material, points.
const SPHERE: f32 = 26.0;

impl Listed for MaterialEntry {
    fn listed(&self) -> (Entity, &str, &str) {
        (self.entity, &self.label, "material")
    }
}

pub fn materials(ui: &mut Ui, state: &mut PanelState, session: &Session, asked: &mut Asked) {
    let inventory = state.inventory(session);
    let chosen = state.material;
    let which = Which { id: "materials", revision: session.revision(), chosen, height: SPHERE };
    let mut clicked = None;
    let previews = &mut state.previews;
    list(ui, &mut state.material_list, &which, &inventory.materials, |ui, entry| {
        sphere(ui, session, previews, entry.entity);
        let kind = kind_of(session, entry.entity);
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            let text = format!("{kind}, {}", uses(entry.users.len()));
            ui.label(RichText::new(text).size(11.0).weak());
            let row = choice(ui, chosen == Some(entry.entity), &entry.label);
            let row = row.interact(Sense::drag());
            let image =
                previews.of(session, entry.entity).map(|sphere| Image::new((sphere.id(), vec2(SPHERE, SPHERE))));
            asked.drag(&row, image, || DroppedMaterial::Own(entry.entity));
            if row.on_hover_text(format!("{}; drag it to an object", shared_by(entry))).clicked() {
                clicked = Some(entry.entity);
            }
        });
    });
    if let Some(clicked) = clicked {
        // A second click closes the editor.
        state.material = Some(clicked).filter(|_| chosen != Some(clicked));
    }
    match state.material.and_then(|entity| inventory.material(entity)) {
        Some(entry) => open(ui, session, &inventory, &mut state.previews, entry, asked),
        None => state.material = None,
    }
}

/// The editor of one material, and actions on the objects that use it.
fn open(
    ui: &mut Ui,
    session: &Session,
    inventory: &Inventory,
    previews: &mut Previews,
    entry: &MaterialEntry,
    asked: &mut Asked,
) {
    let id = entry.entity.to_bits();
    egui::Frame::group(ui.style()).show(ui, |ui| {
        ui.set_width(ui.available_width());
        ui.horizontal(|ui| {
            sphere(ui, session, previews, entry.entity);
            name_field(ui, id, session.world().get::<Name>(entry.entity).map(|name| name.as_str()), asked);
        });
        ui.weak(shared_by(entry));
        if !entry.blends.is_empty() {
            let names = entry.blends.iter().filter_map(|blend| Some(inventory.material(*blend)?.label.as_str()));
            ui.weak(format!("part of {}", names.collect::<Vec<_>>().join(", ")));
        }
        ui.horizontal_wrapped(|ui| {
            let users = ui.add_enabled(!entry.users.is_empty(), egui::Button::new("Select users"));
            if users.on_hover_text("select all objects with this material").clicked() {
                asked.edit(Edit::SelectUsers { material: id });
            }
            let selected = &session.world().resource::<Selection>().0;
            let give = ui.add_enabled(!selected.is_empty(), egui::Button::new("Assign to selected"));
            if give.on_hover_text("assign this material to the selection").clicked() {
                for object in selected {
                    asked.edit(Edit::Assign { id: object.to_bits(), material: id });
                }
            }
        });
        editor(ui, session, inventory, entry.entity, asked);
    });
}

/// A rendered sphere of a material; until there is one, its colour.
fn sphere(ui: &mut Ui, session: &Session, previews: &mut Previews, material: Entity) {
    match previews.of(session, material) {
        Some(texture) => drop(ui.add(Image::new((texture.id(), vec2(SPHERE, SPHERE))))),
        None => swatch(ui, session.world(), material, SPHERE),
    }
}

fn kind_of(session: &Session, entity: Entity) -> &'static str {
    SurfaceMaterial::of(session.world(), entity).map_or("", |material| material.kind().name())
}

fn uses(n: usize) -> String {
    match n {
        0 => "unused".to_owned(),
        1 => "1 object".to_owned(),
        n => format!("{} objects", thousands(n)),
    }
}
