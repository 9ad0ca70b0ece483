//! Menus of commands: that of the bar, and that of the image under the mouse.
//!
//! Their lines are those of the table of [`keys`](crate::viewer::keys), scenes and recent files aside.

use crate::files::printable;
use crate::frame::{Command, Edit, History, Navigation, NewThing, Selection, Session, active_part};
use crate::render::Integrator;
use crate::scene::{
    BUILTIN_MESHES, BUILTIN_SCENES, HiddenInputs, LightInput, LightKind, MaterialSlots, MeshSource, Rendering, library,
};
use crate::viewer::keys::{Action, Item, Menu, REDO, UNDO, items, menu, shortcut, with_key};
use crate::viewer::openable::{self, Recent};
use crate::viewer::submenu::{part, scrolled};
use crate::viewer::thumbnails::Thumbnails;
use bevy_ecs::name::Name;
use egui::{Button, Context, Id, LayerId, Popup, PopupAnchor, PopupKind, Pos2, RichText, SetOpenCommand, Ui};

/// What menus show.
pub struct MenuInput<'a> {
    pub session: &'a Session,
    pub navigation: Navigation,
    pub recent: Recent<'a>,
}

/// The parts of the menu of the bar that are menus themselves.
const PARTS: [(&str, Menu); 6] = [
    ("Edit", Menu::Edit),
    ("Add", Menu::Add),
    ("View", Menu::View),
    ("Lens", Menu::Lens),
    ("Image", Menu::Image),
    ("Inspect", Menu::Inspect),
];
/// Width of the sphere of a material, points.
const SPHERE: f32 = 20.0;

/// The menu of the bar; returns the command that was clicked.
pub fn main(ui: &mut Ui, input: &MenuInput) -> Option<Action> {
    let mut chosen = None;
    let mut choose = |action: Option<Action>| chosen = chosen.take().or(action);
    scrolled(ui, |ui| {
        for item in menu(Menu::File) {
            choose(line(ui, input, item));
            if item.action == Action::OpenDialog {
                part(ui, "Open recent", |ui| {
                    choose(openable::recent(ui, input.session, input.recent).map(Action::Send));
                });
                part(ui, "Scenes", |ui| choose(openable::scenes(ui, input.recent.thumbnails).map(Action::Send)));
            }
        }
        ui.separator();
        for (title, of) in PARTS {
            part(ui, title, |ui| {
                for item in menu(of) {
                    choose(line(ui, input, item));
                }
                if of == Menu::Add {
                    part(ui, "Built-in mesh", |ui| choose(built_in_mesh(ui)));
                }
            });
        }
        ui.separator();
        for item in menu(Menu::Window) {
            choose(line(ui, input, item));
        }
    });
    chosen
}

fn built_in_mesh(ui: &mut Ui) -> Option<Action> {
    let clicked = BUILTIN_MESHES.iter().find(|name| ui.button(**name).clicked())?;
    let source = MeshSource::Builtin((*clicked).to_owned());
    Some(Action::Send(Command::Edit(Edit::Add(NewThing::Mesh(source)))))
}

fn ready_material(ui: &mut Ui, thumbnails: &Thumbnails) -> Option<Action> {
    let mut chosen = None;
    for (i, ready) in library().iter().enumerate() {
        let name = &ready.name;
        let sphere = thumbnails.material(ui.ctx(), i, SPHERE);
        if ui.add(Button::image_and_text(sphere, name)).clicked() {
            chosen = Some(dress(name));
        }
    }
    chosen
}

fn dress(name: &str) -> Action {
    Action::Send(Command::Edit(Edit::Dress { name: name.to_owned() }))
}

fn line(ui: &mut Ui, input: &MenuInput, item: &Item) -> Option<Action> {
    let key = shortcut(input.navigation, &item.action).or_else(|| match item.action {
        // Where keys grab at once, handles have none.
        Action::Gizmo(Some(change)) => shortcut(input.navigation, &Action::Grab(change)),
        _ => None,
    });
    let key = key.unwrap_or_default();
    let button = Button::new(name_of(input.session, item)).shortcut_text(RichText::new(key).weak());
    let line = ui.add_enabled(is_possible(input.session, &item.action), button);
    let effect = effect_of(&item.action);
    let why_not = match &item.action {
        Action::Explain => "Phong follows no light paths: choose the integrator path",
        _ => effect,
    };
    let is_clicked = line.on_hover_text(effect).on_disabled_hover_text(why_not).clicked();
    is_clicked.then(|| item.action.clone())
}

/// The name, for undo and redo with what they are about.
fn name_of(session: &Session, item: &Item) -> String {
    let history = session.world().resource::<History>();
    let step = match &item.action {
        action if *action == UNDO => history.undo_label(),
        action if *action == REDO => history.redo_label(),
        _ => None,
    };
    step.map_or_else(|| item.name.to_owned(), |step| format!("{}: {step}", item.name))
}

fn effect_of(action: &Action) -> &'static str {
    items().find(|(item, _)| item.action == *action).map_or("", |(_, binding)| binding.effect)
}

/// Text about a command of the bar: its name, its key, and what it does.
pub fn hint(input: &MenuInput, action: &Action) -> String {
    let Some((item, binding)) = items().find(|(item, _)| item.action == *action) else { return String::new() };
    let name = name_of(input.session, item);
    let named = with_key(input.navigation, &name, action);
    if name.eq_ignore_ascii_case(binding.effect) || name != item.name {
        return named;
    }
    format!("{named}: {}", binding.effect)
}

/// Whether a command would do anything now.
pub fn is_possible(session: &Session, action: &Action) -> bool {
    let history = session.world().resource::<History>();
    match action {
        action if *action == UNDO => history.undo_label().is_some(),
        action if *action == REDO => history.redo_label().is_some(),
        Action::Gizmo(Some(_))
        | Action::Grab(_)
        | Action::GrabCopy
        | Action::Send(Command::Edit(
            Edit::Delete
            | Edit::Duplicate
            | Edit::Hide { .. }
            | Edit::SelectNone
            | Edit::StandOnGround
            | Edit::TurnUpright,
        )) => !session.world().resource::<Selection>().0.is_empty(),
        Action::Send(Command::Edit(Edit::ShowAll)) => session.inputs().hidden != HiddenInputs::default(),
        Action::Explain => session.world().resource::<Rendering>().0.integrator != Integrator::Phong,
        _ => true,
    }
}

/// Says which part of an object gets a material.
fn material_title(session: &Session) -> String {
    let world = session.world();
    let of_part =
        active_part(world).and_then(|(object, part)| world.get::<MaterialSlots>(object)?.0.get(part).copied());
    let name = of_part.map(|slot| world.get::<Name>(slot).map_or("this part", |name| name.as_str()));
    name.map_or("Material".to_owned(), |name| format!("Material of {}", printable::name(name)))
}

/// The spot lights of the scene and their names.
fn spot_lights(session: &Session) -> Vec<(u64, String)> {
    let lights = session.inputs().lights.iter().filter(|light| matches!(light.light, LightKind::Spot(_)));
    let name = |light: &LightInput| {
        light.name.as_deref().map_or_else(|| "spot light".to_owned(), |name| printable::name(name).into_owned())
    };
    lights.map(|light| (light.entity.to_bits(), name(light))).collect()
}

/// The menu of the image at the place of a right click.
#[derive(Default)]
pub struct HereMenu {
    /// Where it was asked for, points, and the same as a fraction of the image.
    at: Option<(Pos2, [f64; 2])>,
    is_new: bool,
}

impl HereMenu {
    pub fn open(&mut self, point: Pos2, place: [f64; 2]) {
        (self.at, self.is_new) = (Some((point, place)), true);
    }

    pub fn is_open(&self) -> bool {
        self.at.is_some()
    }

    /// Draws the menu while it is open; returns the command that was clicked, and the place that it is about.
    ///
    /// - `name`: of what is selected.
    pub fn show(&mut self, context: &Context, input: &MenuInput, name: Option<&str>) -> Option<(Action, [f64; 2])> {
        let (point, place) = self.at?;
        let mut chosen = None;
        let open = std::mem::take(&mut self.is_new).then_some(SetOpenCommand::Bool(true));
        let id = Id::new("menu of the image");
        let popup = Popup::new(id, context.clone(), PopupAnchor::Position(point), LayerId::background());
        let popup = popup.kind(PopupKind::Menu).layout(egui::Layout::top_down_justified(egui::Align::Min));
        let shown = popup.style(egui::containers::menu::menu_style).open_memory(open).show(|ui| {
            scrolled(ui, |ui| {
                ui.label(RichText::new(name.unwrap_or("nothing here")).strong());
                ui.separator();
                for item in menu(Menu::Here) {
                    chosen = chosen.take().or(line(ui, input, item));
                }
                let spots = spot_lights(input.session);
                if !spots.is_empty() {
                    part(ui, "Aim a spot light here", |ui| {
                        for (id, name) in &spots {
                            let [x, y] = place;
                            let aim = Action::Send(Command::Edit(Edit::AimAt { id: *id, x, y }));
                            chosen = chosen.take().or(ui.button(name).clicked().then_some(aim));
                        }
                    });
                }
                part(ui, &material_title(input.session), |ui| {
                    chosen = chosen.take().or(ready_material(ui, input.recent.thumbnails))
                });
                part(ui, "Add", |ui| {
                    for item in menu(Menu::Add) {
                        chosen = chosen.take().or(line(ui, input, item));
                    }
                });
            });
        });
        if chosen.is_some() {
            // Also where it was chosen in a menu of the menu.
            Popup::close_all(context);
        }
        if shown.is_none() || chosen.is_some() {
            self.at = None;
        }
        chosen.map(|action| (action, place))
    }
}

/// A command of the menu of the image: what it adds goes to its place.
pub fn at(action: Action, [x, y]: [f64; 2]) -> Action {
    match action {
        Action::Send(Command::Edit(Edit::Add(thing))) => Action::Send(Command::Edit(Edit::AddAt { thing, x, y })),
        Action::AddDialog(_) => Action::AddDialog(Some([x, y])),
        other => other,
    }
}

/// Every line of the list of commands: what can be clicked, ready materials, built-in scenes and recent files.
///
/// Name, what it does, key.
pub fn all(input: &MenuInput) -> Vec<(String, String, String, Action)> {
    let lines = items().map(|(item, binding)| {
        let key = shortcut(input.navigation, &item.action).unwrap_or_default();
        (item.name.to_owned(), binding.effect.to_owned(), key, item.action.clone())
    });
    let open = |name: &str| Action::Send(Command::Open { path: crate::scene::text_to_path(name) });
    let scenes = BUILTIN_SCENES
        .iter()
        .map(|(name, about, _)| (format!("Scene: {name}"), (*about).to_owned(), String::new(), open(name)));
    let files =
        input.recent.names.iter().map(|name| (format!("Open: {name}"), String::new(), String::new(), open(name)));
    let materials = library().iter().map(|ready| {
        let name = &ready.name;
        (format!("Material: {name}"), "give it to the selection".to_owned(), String::new(), dress(name))
    });
    lines.chain(materials).chain(scenes).chain(files).collect()
}
