//! The panel at the right edge: every setting of the session, and its figures.
//!
//! It reads a session and returns commands, like keys and mouse, so that everything can be undone, recorded and
//! scripted. It is drawn with a new image or while the mouse is in it, never on its own.
//!
//! | file | about |
//! |---|---|
//! | `picture` | rendering, display, inspections |
//! | `camera` | pose, lens, saved views |
//! | `selected` | name, placement, material and light of the selection |
//! | `mesh` | mesh of the selection: normals, simplification |
//! | `scene` | the list of objects, adding, opening |
//! | `materials`, `lights` | the lists of materials and of lights; the environment |
//! | `ready` | the library of ready materials |
//! | `material`, `texture` | the editor of a material |
//! | `statistics`, `messages` | figures; what was said |
//! | `sections` | their titles |
//! | `state` | what it remembers, shows and asks for |
//! | `sun` | the sun by the time of day |
//! | `list`, `swatch`, `temperature`, `widgets`, `hints` | building blocks |

mod animation;
mod camera;
mod hints;
mod lights;
mod list;
mod material;
mod materials;
mod mesh;
mod messages;
mod picture;
mod ready;
mod scene;
mod sections;
mod selected;
mod state;
mod statistics;
mod sun;
mod swatch;
mod temperature;
mod texture;
mod widgets;

pub use sections::SECTIONS;
pub use selected::NOTHING_SELECTED;
pub use state::{Around, Asked, DroppedMaterial, PanelState};
pub use widgets::select_number;

use crate::frame::{Command, Edit, Session};
use egui::{Context, RichText, Ui};

const WIDTH: f32 = 288.0;

/// Width of the panel in a window of this width, points.
pub fn width(window: f32) -> f32 {
    WIDTH.min(0.6 * window)
}

/// Draws the panel; requests are added to `asked`.
pub fn show(context: &Context, state: &mut PanelState, session: &Session, around: &Around, asked: &mut Asked) {
    // Opaque: the image ends beside it.
    let frame = egui::Frame::NONE.fill(crate::viewer::overlay::PANE.to_opaque()).inner_margin(egui::Margin {
        left: 10,
        right: 4,
        top: 8,
        bottom: 4,
    });
    let before = asked.commands.len();
    state.change.follow(session);
    let width = width(context.content_rect().width());
    let panel = egui::SidePanel::right("panel").frame(frame).resizable(false).exact_width(width);
    let response = panel.show(context, |ui| {
        style(ui);
        egui::ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            // Leaves space for the scroll bar.
            ui.set_width((ui.available_width() - 8.0).max(0.0));
            let (wanted, mut open_now) = (state.section.take(), std::mem::take(&mut state.open));
            let mut section = |ui: &mut Ui, title, open, contents: &mut dyn FnMut(&mut Ui)| {
                let is_open = open_now.entry(title).or_insert(open);
                self::section(ui, title, is_open, wanted == Some(title), contents);
            };
            let [render, animation, camera, views, lens, display, add, selected, mesh, ..] = SECTIONS;
            section(ui, render, true, &mut |ui| picture::render(ui, session, around, asked));
            section(ui, animation, animation::can_play(session), &mut |ui| {
                animation::time_line(ui, session, around, asked)
            });
            section(ui, camera, false, &mut |ui| camera::camera(ui, session, around, asked));
            section(ui, views, false, &mut |ui| camera::views(ui, session, around, asked));
            section(ui, lens, true, &mut |ui| camera::lens(ui, session, around, asked));
            section(ui, display, false, &mut |ui| picture::display(ui, session, asked));
            // Above the sections that change with the selection, so that its buttons do not move.
            section(ui, add, false, &mut |ui| scene::add(ui, &mut state.mesh_path, asked));
            section(ui, selected, true, &mut |ui| selected::selected(ui, state, session, around, asked));
            section(ui, mesh, true, &mut |ui| mesh::mesh(ui, state, session, asked));
            let [.., objects, materials, lights, sky, open, statistics, messages] = SECTIONS;
            section(ui, objects, true, &mut |ui| scene::objects(ui, state, session, asked));
            section(ui, materials, false, &mut |ui| materials::materials(ui, state, session, asked));
            section(ui, lights, true, &mut |ui| lights::lights(ui, state, session, asked));
            section(ui, sky, true, &mut |ui| lights::sky(ui, &mut state.sun, session, asked));
            section(ui, open, false, &mut |ui| scene::open(ui, session, around, asked));
            section(ui, statistics, false, &mut |ui| statistics::statistics(ui, session, around));
            section(ui, messages, true, &mut |ui| messages::messages(ui, session));
            state.open = open_now;
        });
    });
    // All edits between pressing and releasing a mouse button are one undo step, also if a colour picker or a menu
    // extends beyond the panel.
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

/// - `is_open`: changed by a click on the title.
/// - `wanted`: it is to be opened now, and seen.
fn section(ui: &mut Ui, title: &str, is_open: &mut bool, wanted: bool, contents: &mut dyn FnMut(&mut Ui)) {
    *is_open |= wanted;
    let header = egui::CollapsingHeader::new(RichText::new(title).strong());
    // Both, so that a section that is open at first does not unfold.
    let shown = header.default_open(*is_open).open(Some(*is_open)).show(ui, contents);
    if shown.header_response.clicked() {
        *is_open = !*is_open;
    }
    if wanted {
        shown.header_response.scroll_to_me(Some(egui::Align::TOP));
    }
}
