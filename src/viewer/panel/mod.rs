//! The panel: every setting of the session and what it has to tell, at the right edge.
//!
//! It reads a session and answers with commands, as keys and mouse do, so that all of it can be undone, recorded and
//! done without it. It is drawn when there is a new picture or the mouse is in it, never for its own sake.
//!
//! | file | about |
//! |---|---|
//! | `picture` | rendering, display, what is shown in place of the picture |
//! | `camera` | pose, lens, saved views |
//! | `selected` | name, place, material and light of what is selected |
//! | `mesh` | its mesh: normals, simplification |
//! | `scene` | the list of objects, adding, opening |
//! | `materials`, `lights` | the lists of materials and of lights; the sky |
//! | `material`, `texture` | the editor of a material |
//! | `statistics` | figures |
//! | `list`, `swatch`, `widgets` | what the others are made of |

mod camera;
mod lights;
mod list;
mod material;
mod materials;
mod mesh;
mod picture;
mod scene;
mod selected;
mod statistics;
mod swatch;
mod texture;
mod widgets;

use super::change::PictureChange;
use super::dialog::DialogPurpose;
use super::reaction::Reaction;
use crate::frame::{Command, Edit, Navigation, Session, gizmo};
use crate::scene::Inventory;
use bevy_ecs::prelude::Entity;
use egui::{Context, RichText, Ui};
use list::ListState;
use std::rc::Rc;

/// What the panel itself remembers.
pub struct PanelState {
    pub shown: bool,
    /// The handles over what is selected.
    pub gizmo: Option<gizmo::Mode>,
    change: PictureChange,
    /// A file to be added.
    mesh_path: String,
    /// Pictures that are kept are so many times as wide and high as the window.
    pub scale: u32,
    /// The mouse went down in here and has not come up.
    pressed: bool,
    /// Lists of what is in the scene, and of which state of it they are.
    inventory: Option<(u64, Rc<Inventory>)>,
    object_list: ListState,
    material_list: ListState,
    light_list: ListState,
    /// The material whose editor is open in the list.
    material: Option<Entity>,
}

impl PanelState {
    /// Made anew only when somebody looks at it and the scene has changed.
    fn inventory(&mut self, session: &Session) -> Rc<Inventory> {
        let revision = session.revision();
        let known = self.inventory.take().filter(|(of, _)| *of == revision);
        let (_, inventory) = self.inventory.insert(known.unwrap_or_else(|| (revision, Rc::new(session.inventory()))));
        inventory.clone()
    }
}

impl Default for PanelState {
    fn default() -> Self {
        Self {
            shown: false,
            gizmo: None,
            change: PictureChange::default(),
            mesh_path: String::new(),
            scale: 1,
            pressed: false,
            inventory: None,
            object_list: ListState::default(),
            material_list: ListState::default(),
            light_list: ListState::default(),
            material: None,
        }
    }
}

/// What is shown besides the session.
pub struct Around<'a> {
    pub reaction: &'a Reaction,
    pub speed: f64,
    pub spinning: bool,
    /// A drag moves around the pivot.
    pub orbits: bool,
    /// Keys and gestures.
    pub navigation: Navigation,
    /// The mouse, in fractions of the picture.
    pub place: [f64; 2],
    /// Bytes of the process, where that can be known.
    pub memory: Option<u64>,
    /// The next drag is a rectangle.
    pub brush: bool,
    /// What was opened last comes first.
    pub recent: &'a [String],
}

/// What a click in the panel asks of the window itself.
#[derive(Default)]
pub struct Asked {
    pub commands: Vec<Command>,
    pub speed: Option<f64>,
    pub toggle_spin: bool,
    pub toggle_drag: bool,
    pub navigation: Option<Navigation>,
    pub screenshot: Option<bool>,
    pub toggle_brush: bool,
    /// A dialog for a file, and what it is for.
    pub dialog: Option<DialogPurpose>,
}

impl Asked {
    fn send(&mut self, command: Command) {
        self.commands.push(command);
    }

    fn edit(&mut self, edit: Edit) {
        self.commands.push(Command::Edit(edit));
    }
}

/// The parts of the panel, from above; the list of keys tells of each.
pub const SECTIONS: [&str; 14] = [
    "Render",
    "Camera",
    "Views",
    "Lens",
    "Display",
    "Add",
    "Selected",
    "Mesh",
    "Objects",
    "Materials",
    "Lights",
    "Environment",
    "Open",
    "Statistics",
];

const WIDTH: f32 = 288.0;
/// Room for the status line.
const FOOT: i8 = 30;

/// Draws the panel; `asked` is what came of it.
pub fn show(context: &Context, state: &mut PanelState, session: &Session, around: &Around, asked: &mut Asked) {
    let frame = egui::Frame::NONE.fill(super::overlay::PANE).inner_margin(egui::Margin {
        left: 10,
        right: 4,
        top: 8,
        bottom: FOOT,
    });
    let before = asked.commands.len();
    state.change.follow(session);
    let width = WIDTH.min(0.6 * context.content_rect().width());
    let panel = egui::SidePanel::right("panel").frame(frame).resizable(false).exact_width(width);
    let response = panel.show(context, |ui| {
        style(ui);
        egui::ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            // Beside the scroll bar.
            ui.set_width((ui.available_width() - 8.0).max(0.0));
            let [render, camera, views, lens, display, add, selected, mesh, ..] = SECTIONS;
            section(ui, render, true, |ui| picture::render(ui, &mut state.scale, session, around, asked));
            section(ui, camera, false, |ui| camera::camera(ui, session, around, asked));
            section(ui, views, false, |ui| camera::views(ui, session, around, asked));
            section(ui, lens, true, |ui| camera::lens(ui, session, around, asked));
            section(ui, display, false, |ui| picture::display(ui, session, asked));
            // Above what changes with the selection, so that its buttons stay where they are.
            section(ui, add, false, |ui| scene::add(ui, &mut state.mesh_path, asked));
            section(ui, selected, true, |ui| selected::selected(ui, state, session, asked));
            section(ui, mesh, true, |ui| mesh::mesh(ui, state, session, asked));
            let [.., objects, materials, lights, sky, open, statistics] = SECTIONS;
            section(ui, objects, true, |ui| scene::objects(ui, state, session, asked));
            section(ui, materials, false, |ui| materials::materials(ui, state, session, asked));
            section(ui, lights, false, |ui| lights::lights(ui, state, session, asked));
            section(ui, sky, false, |ui| lights::sky(ui, session, asked));
            section(ui, open, false, |ui| scene::open(ui, session, around.recent, asked));
            section(ui, statistics, true, |ui| statistics::statistics(ui, session, around));
        });
    });
    // From pressing a button of the mouse to letting go is one step to undo, also where a picker of colours or a menu
    // hangs out of the panel.
    let is_over = context.pointer_latest_pos().is_some_and(|place| {
        let in_panel = response.response.rect.contains(place);
        in_panel || egui::Popup::is_any_open(context) && context.is_pointer_over_area()
    });
    let (pressed, released) = context.input(|input| (input.pointer.any_pressed(), input.pointer.any_released()));
    if pressed && is_over {
        state.pressed = true;
        asked.commands.insert(before, Command::Edit(Edit::Begin));
    }
    if released && std::mem::take(&mut state.pressed) {
        asked.edit(Edit::End);
    }
}

fn style(ui: &mut Ui) {
    let style = ui.style_mut();
    style.spacing.slider_width = 118.0;
    style.spacing.interact_size.y = 18.0;
    style.spacing.item_spacing = egui::vec2(6.0, 4.0);
    style.spacing.combo_width = 90.0;
    for font in style.text_styles.values_mut() {
        font.size = font.size.min(13.0);
    }
}

fn section(ui: &mut Ui, title: &str, open: bool, contents: impl FnOnce(&mut Ui)) {
    egui::CollapsingHeader::new(RichText::new(title).strong()).default_open(open).show(ui, contents);
}
