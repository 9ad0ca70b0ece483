//! The bar at the lower edge: buttons that are always there, and between them what is on the image.

use crate::files::printable;
use crate::viewer::keys::{Action, REDO, UNDO};
use crate::viewer::menu::{self, MenuInput};
use crate::viewer::overlay::{GLASS, TEXT, TEXT_SIZE};
use egui::{Align, Button, Color32, Context, FontId, Frame, Layout, Margin, Pos2, TopBottomPanel, Ui};

/// Points.
const HEIGHT: f32 = 27.0;
/// Width of a window below which the buttons that the menu has too are left out, points.
const NARROW: f32 = 360.0;

/// The texts of the bar.
#[derive(Default, PartialEq, Eq)]
pub struct Figures {
    /// What is on the image and how good it is; cut where there is no room.
    pub left: String,
    /// Settings and hints, from the most important one; those without room are left out.
    pub right: Vec<String>,
}

/// Draws the bar; returns the command that was clicked.
///
/// - `panel`: whether the panel is shown.
pub fn show(context: &Context, input: &MenuInput, panel: bool, figures: &Figures) -> Option<Action> {
    let mut chosen = None;
    let frame = Frame::NONE.fill(GLASS).inner_margin(Margin::symmetric(5, 0));
    let bar = TopBottomPanel::bottom("bar").frame(frame).exact_height(HEIGHT).show_separator_line(false);
    bar.show(context, |ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        let is_wide = ui.available_width() >= NARROW;
        ui.horizontal_centered(|ui| {
            ui.menu_button("☰ Menu", |ui| chosen = chosen.take().or(menu::main(ui, input)));
            if is_wide {
                for (sign, action) in [("⟲", UNDO), ("⟳", REDO)] {
                    let button = ui.add_enabled(menu::is_possible(input.session, &action), Button::new(sign));
                    let hint = menu::hint(input, &action);
                    if button.on_hover_text(&hint).on_disabled_hover_text(hint).clicked() {
                        chosen = Some(action);
                    }
                }
            }
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                for (name, action, is_on) in
                    [("Help", Action::ToggleHelp, false), ("Panel", Action::TogglePanel, panel)]
                {
                    let button = ui.add(Button::new(name).selected(is_on));
                    if button.on_hover_text(menu::hint(input, &action)).clicked() {
                        chosen = Some(action);
                    }
                }
                texts(ui, &figures.left, &figures.right);
            });
        });
    });
    if chosen.is_some() {
        egui::Popup::close_all(context);
    }
    chosen
}

fn texts(ui: &mut Ui, left: &str, right: &[String]) {
    let room = ui.available_rect_before_wrap().shrink2(egui::vec2(8.0, 0.0));
    if room.width() < 30.0 {
        return;
    }
    let font = FontId::proportional(TEXT_SIZE);
    let weak = Color32::from_gray(165);
    let layout = |text: &str, color, width: f32| {
        let mut job =
            egui::text::LayoutJob::simple_singleline((*printable::line(text)).to_owned(), font.clone(), color);
        job.wrap = egui::text::TextWrapping::truncate_at_width(width);
        ui.ctx().fonts_mut(|fonts| fonts.layout_job(job))
    };
    let left = layout(left, TEXT, room.width());
    let top = room.center().y - 0.5 * left.size().y;
    let mut free = room.width() - left.size().x;
    ui.painter().galley(Pos2::new(room.left(), top), left, TEXT);
    // Whole: a part of a word is of no use.
    let mut end = room.right();
    for text in right {
        let galley = layout(text, weak, f32::INFINITY);
        let width = galley.size().x + 20.0;
        if width > free {
            break;
        }
        (free, end) = (free - width, end - width);
        ui.painter().galley(Pos2::new(end + 20.0, top), galley, weak);
    }
}
