//! The panel: every setting of the session and what it has to tell, at the right edge.
//!
//! It reads a session and answers with commands, as keys and mouse do, so that all of it can be undone, recorded and
//! done without it. It is drawn when there is a new picture or the mouse is in it, never for its own sake.
//!
//! | file | about |
//! |---|---|
//! | `picture` | rendering, display, what is shown in place of the picture |
//! | `camera` | pose, lens, kept views |
//! | `scene` | the list of things, adding, sky |
//! | `selected` | place, material, light and mesh of what is selected |
//! | `texture` | the texture of a material |
//! | `statistics` | figures |

mod camera;
mod picture;
mod scene;
mod selected;
mod statistics;
mod texture;

use super::change::PictureChange;
use super::dialog::Purpose;
use super::reaction::Reaction;
use crate::frame::{Command, Edit, Session, gizmo};
use bevy_ecs::prelude::Entity;
use egui::{Context, RichText, Ui};
use glam::DVec3;

/// What the panel itself remembers.
pub struct PanelState {
    pub shown: bool,
    /// The handles over what is selected.
    pub gizmo: Option<gizmo::Mode>,
    /// The ratio that the slider asks for while it is dragged.
    ratio: Option<(Entity, f64)>,
    change: PictureChange,
    /// A file to be added.
    mesh_path: String,
    /// Pictures that are kept are so many times as wide and high as the window.
    pub scale: u32,
    /// The mouse went down in here and has not come up.
    pressed: bool,
}

impl Default for PanelState {
    fn default() -> Self {
        Self {
            shown: false,
            gizmo: None,
            ratio: None,
            change: PictureChange::default(),
            mesh_path: String::new(),
            scale: 1,
            pressed: false,
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
    pub screenshot: Option<bool>,
    pub toggle_brush: bool,
    /// A dialog for a file, and what it is for.
    pub dialog: Option<Purpose>,
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
pub const SECTIONS: [&str; 10] =
    ["Render", "View", "Lens", "Display", "Selected", "Objects", "Open", "Add", "Sky", "Statistics"];

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
            let [render, view, lens, display, selected, objects, open, add, sky, statistics] = SECTIONS;
            section(ui, render, true, |ui| picture::render(ui, &mut state.scale, session, around, asked));
            section(ui, view, false, |ui| camera::view(ui, session, around, asked));
            section(ui, lens, true, |ui| camera::lens(ui, session, around, asked));
            section(ui, display, false, |ui| picture::display(ui, session, asked));
            section(ui, selected, true, |ui| selected::selected(ui, state, session, asked));
            section(ui, objects, true, |ui| scene::objects(ui, session, asked));
            section(ui, open, false, |ui| scene::open(ui, session, around.recent, asked));
            section(ui, add, false, |ui| scene::add(ui, &mut state.mesh_path, asked));
            section(ui, sky, false, |ui| scene::sky(ui, session, asked));
            section(ui, statistics, true, |ui| statistics::statistics(ui, session, around));
        });
    });
    // From pressing a button of the mouse to letting go is one step to undo.
    let (pressed, released) = context.input(|input| (input.pointer.any_pressed(), input.pointer.any_released()));
    if pressed && context.pointer_latest_pos().is_some_and(|place| response.response.rect.contains(place)) {
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

/// Rows of a name and what it names, aligned through the panel.
fn rows<R>(ui: &mut Ui, id: &str, contents: impl FnOnce(&mut Ui) -> R) -> R {
    egui::Grid::new(id).num_columns(2).min_col_width(74.0).spacing([8.0, 4.0]).show(ui, contents).inner
}

fn row<R>(ui: &mut Ui, name: &str, contents: impl FnOnce(&mut Ui) -> R) -> R {
    ui.label(RichText::new(name).color(egui::Color32::from_gray(170)));
    let result = contents(ui);
    ui.end_row();
    result
}

/// A number that is dragged or typed. Typing takes effect at the end, dragging at once.
fn number(ui: &mut Ui, value: f64, speed: f64, range: std::ops::RangeInclusive<f64>, suffix: &str) -> Option<f64> {
    let mut new = value;
    let drag = egui::DragValue::new(&mut new)
        .speed(speed)
        .range(range)
        .suffix(suffix)
        .max_decimals(4)
        .update_while_editing(false);
    ui.add(drag).changed().then_some(new)
}

/// A whole number, in the same way.
fn whole(ui: &mut Ui, value: u32, range: std::ops::RangeInclusive<u32>) -> Option<u32> {
    let mut new = value;
    let drag = egui::DragValue::new(&mut new).speed(0.05).range(range).update_while_editing(false);
    ui.add(drag).changed().then_some(new)
}

/// Three numbers; the speed of dragging suits `scale`.
fn vector(ui: &mut Ui, value: DVec3, speed: f64) -> Option<DVec3> {
    let mut new = value;
    let mut changed = false;
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 3.0;
        ui.spacing_mut().interact_size.x = 52.0;
        for axis in 0..3 {
            let drag = egui::DragValue::new(&mut new[axis]).speed(speed).max_decimals(3).update_while_editing(false);
            changed |= ui.add(drag).changed();
        }
    });
    changed.then_some(new)
}

/// A number on a sliding scale.
fn slider(ui: &mut Ui, value: f64, range: std::ops::RangeInclusive<f64>, logarithmic: bool) -> Option<f64> {
    let mut new = value;
    let slider = egui::Slider::new(&mut new, range)
        .logarithmic(logarithmic)
        .update_while_editing(false)
        .max_decimals(4)
        .smart_aim(true);
    ui.add(slider).changed().then_some(new)
}

/// A linear colour. What is brighter than white is a colour and a strength beside it.
fn color(ui: &mut Ui, value: glam::Vec3, bright: bool) -> Option<DVec3> {
    let strength = if bright { value.max_element().max(1.0) } else { 1.0 };
    let mut rgb = (value / strength).to_array();
    let changed_color = egui::color_picker::color_edit_button_rgb(ui, &mut rgb).changed();
    let mut new_strength = f64::from(strength);
    let mut changed_strength = false;
    if bright {
        let drag = egui::DragValue::new(&mut new_strength).speed(0.02 * strength).range(1.0..=1e6).prefix("× ");
        changed_strength = ui.add(drag.max_decimals(3).update_while_editing(false)).changed();
    }
    (changed_color || changed_strength).then(|| glam::Vec3::from(rgb).as_dvec3() * new_strength)
}
