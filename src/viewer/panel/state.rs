//! What the panel remembers, what it is shown beside the session, and what it asks for.

use crate::frame::{Command, DenoiseFilter, Edit, Navigation, Session, gizmo};
use crate::scene::Inventory;
use crate::viewer::change::PictureChange;
use crate::viewer::dialog::DialogPurpose;
use crate::viewer::keys::Action;
use crate::viewer::openable::Recent;
use crate::viewer::panel::list::ListState;
use crate::viewer::panel::sections::SECTIONS;
use crate::viewer::panel::sun::SunPlace;
use crate::viewer::previews::Previews;
use crate::viewer::reaction::Reaction;
use bevy_ecs::prelude::Entity;
use egui::{Area, Image, Order, Pos2, Response, vec2};
use std::collections::BTreeMap;
use std::rc::Rc;

/// State of the panel.
#[derive(Default)]
pub struct PanelState {
    pub shown: bool,
    /// Which sections are open, as far as they have been shown.
    pub open: BTreeMap<&'static str, bool>,
    /// The section to open and to scroll to.
    pub section: Option<&'static str>,
    /// The handles over the selection.
    pub gizmo: Option<gizmo::Mode>,
    pub change: PictureChange,
    /// Path of a file to be added.
    pub mesh_path: String,
    /// The mouse was pressed in the panel and has not been released.
    pub pressed: bool,
    /// Lists of the scene's items, with the revision of the scene.
    pub inventory: Option<(u64, Rc<Inventory>)>,
    pub object_list: ListState,
    pub material_list: ListState,
    pub light_list: ListState,
    pub sun: SunPlace,
    pub previews: Previews,
    /// The material whose editor is open in the list.
    pub material: Option<Entity>,
}

impl PanelState {
    /// The panel as an earlier window left it.
    ///
    /// - `open`: which sections are open, by their titles.
    pub fn remembered(shown: bool, open: &BTreeMap<String, bool>) -> Self {
        let open = SECTIONS.iter().filter_map(|title| Some((*title, *open.get(*title)?))).collect();
        Self { shown, open, ..Self::default() }
    }

    /// Returns the inventory, rebuilt only if it is shown and the scene has changed.
    pub fn inventory(&mut self, session: &Session) -> Rc<Inventory> {
        let revision = session.revision();
        let known = self.inventory.take().filter(|(of, _)| *of == revision);
        let (_, inventory) = self.inventory.insert(known.unwrap_or_else(|| (revision, Rc::new(session.inventory()))));
        inventory.clone()
    }

    /// What the list of objects calls an object or a light; `None` if it is not there.
    pub fn label_of(&mut self, session: &Session, entity: Entity) -> Option<String> {
        let inventory = self.inventory(session);
        inventory.objects.iter().find(|entry| entry.entity == entity).map(|entry| entry.label.clone())
    }
}

/// Values shown besides the session.
pub struct Around<'a> {
    pub reaction: &'a Reaction,
    pub speed: f64,
    pub spinning: bool,
    /// Whether the animation plays.
    pub playing: bool,
    /// Whether a drag orbits the pivot.
    pub orbits: bool,
    /// The preset of keys and gestures.
    pub navigation: Navigation,
    /// The mouse position as a fraction of the image.
    pub place: [f64; 2],
    /// Memory of the process in bytes, if known.
    pub memory: Option<u64>,
    /// Whether the next drag selects a rectangle.
    pub brush: bool,
    pub recent: Recent<'a>,
}

/// Requests of the panel.
#[derive(Default)]
pub struct Asked {
    pub commands: Vec<Command>,
    pub speed: Option<f64>,
    pub navigation: Option<Navigation>,
    pub save_layers: bool,
    /// A command of the table.
    pub action: Option<Action>,
    /// The filter of denoised images, which may not be installed.
    pub filter: Option<DenoiseFilter>,
    /// A file dialog to show, with its purpose.
    pub dialog: Option<DialogPurpose>,
    /// A material that was dropped at this place of the window, points.
    pub dropped: Option<(DroppedMaterial, Pos2)>,
}

/// A material that is dragged to an object.
pub enum DroppedMaterial {
    /// A ready one, by its name.
    Ready(String),
    /// One of the scene.
    Own(Entity),
}

impl Asked {
    pub fn send(&mut self, command: Command) {
        self.commands.push(command);
    }

    pub fn edit(&mut self, edit: Edit) {
        self.commands.push(Command::Edit(edit));
    }

    /// Lets a sphere be dragged to an object: it follows the mouse, and is dropped where the button is released.
    ///
    /// - `sphere`: what is dragged, which senses drags; `image`: what follows the mouse.
    pub fn drag(&mut self, sphere: &Response, image: Option<Image>, material: impl FnOnce() -> DroppedMaterial) {
        let Some(place) = sphere.interact_pointer_pos().filter(|place| !sphere.rect.contains(*place)) else { return };
        if sphere.drag_stopped() {
            self.dropped = Some((material(), place));
        } else if sphere.dragged() {
            let area = Area::new(sphere.id.with("dragged")).order(Order::Tooltip).interactable(false);
            area.fixed_pos(place + vec2(6.0, 6.0)).show(&sphere.ctx, |ui| {
                match image {
                    Some(image) => ui.add(image),
                    None => ui.label("material"),
                };
            });
        }
    }
}
