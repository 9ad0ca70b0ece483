//! The question of the first start: whose keys and gestures the user knows.

use crate::frame::Navigation;
use egui::{Align2, Button, Context, Label, RichText, Vec2, Window};

const CHOICES: [(Navigation, &str, &str); 3] = [
    (Navigation::Blender, "Blender", "Middle drag orbits. G, R, S: move, rotate, scale."),
    (Navigation::Maya, "Maya", "Alt+drag orbits. W, E, R: move, rotate, scale."),
    (
        Navigation::Firstlight,
        "Neither",
        "Drag orbits things, and looks around in a room. Right drag pans. W, A, S, D fly.",
    ),
];

/// Draws the question; returns the answer, which is firstlight's own preset when the question is closed.
pub fn show(context: &Context) -> Option<Navigation> {
    let mut answer = None;
    let mut open = true;
    Window::new("Which program do you know?")
        .open(&mut open)
        .anchor(
            Align2::CENTER_BOTTOM,
            Vec2::new(0.0, context.available_rect().bottom() - context.content_rect().bottom() - 12.0),
        )
        .collapsible(false)
        .resizable(false)
        .show(context, |ui| {
            ui.label("Its keys and gestures are used here too. The panel can change it later.");
            ui.add_space(6.0);
            let width = ((ui.ctx().content_rect().width() - 80.0) / 3.0).clamp(40.0, 150.0);
            ui.horizontal_top(|ui| {
                for (navigation, name, about) in CHOICES {
                    ui.vertical(|ui| {
                        ui.set_width(width);
                        let button = Button::new(RichText::new(name).size(15.0)).min_size(Vec2::new(width, 30.0));
                        if ui.add(button).clicked() {
                            answer = Some(navigation);
                        }
                        ui.add(Label::new(RichText::new(about).weak()).wrap());
                    });
                }
            });
        });
    answer.or((!open).then_some(Navigation::Firstlight))
}
