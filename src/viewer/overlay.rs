//! What is written over the picture: the status line, messages, and the list of keys.

use super::keys::{BINDINGS, Group};
use super::toasts::{Toast, Tone};
use egui::{Align2, Color32, Context, CornerRadius, FontId, Frame, Margin, Order, RichText, Stroke, Vec2};

/// Dark glass, so that text reads on any picture.
const GLASS: Color32 = Color32::from_rgba_premultiplied(9, 10, 12, 225);
const TEXT: Color32 = Color32::from_gray(228);
const KEY: Color32 = Color32::from_rgb(250, 205, 125);
const PROBLEM: Color32 = Color32::from_rgb(255, 140, 120);
const TEXT_SIZE: f32 = 13.0;

/// Sets up how overlays look, once.
pub fn style(context: &Context) {
    context.options_mut(|options| {
        options.theme_preference = egui::ThemePreference::Dark;
        // Ctrl with + and - belongs to the field of view.
        options.zoom_with_keyboard = false;
    });
    context.all_styles_mut(|style| {
        style.visuals.override_text_color = Some(TEXT);
        style.visuals.window_fill = GLASS;
        style.visuals.window_stroke = Stroke::new(1.0, Color32::from_gray(60));
        style.interaction.selectable_labels = false;
    });
}

/// The line at the lower edge; it takes no mouse.
pub fn status_line(context: &Context, left: &str, right: &str) {
    let screen = context.content_rect();
    egui::Area::new("status".into())
        .order(Order::Foreground)
        .interactable(false)
        .fixed_pos(screen.left_bottom())
        .pivot(Align2::LEFT_BOTTOM)
        .show(context, |ui| {
            let font = FontId::proportional(TEXT_SIZE);
            let (margin, gap) = (8.0, 24.0);
            let width = screen.width();
            let layout = |text: &str, color, room: f32| {
                let mut job = egui::text::LayoutJob::simple(text.to_owned(), font.clone(), color, room.max(0.0));
                job.wrap = egui::text::TextWrapping::truncate_at_width(room.max(0.0));
                context.fonts_mut(|fonts| fonts.layout_job(job))
            };
            let left = layout(left, TEXT, width - 2.0 * margin);
            let room = width - 2.0 * margin - gap - left.size().x;
            let height = left.size().y + 8.0;
            let (rect, _) = ui.allocate_exact_size(Vec2::new(width, height), egui::Sense::hover());
            ui.painter().rect_filled(rect, 0.0, GLASS);
            ui.painter().galley(rect.left_top() + Vec2::new(margin, 4.0), left, TEXT);
            // What does not fit beside the figures is left out whole: half a word helps nobody.
            let right = layout(right, Color32::from_gray(165), f32::INFINITY);
            if right.size().x <= room {
                let at = rect.right_top() + Vec2::new(-margin - right.size().x, 4.0);
                ui.painter().galley(at, right, TEXT);
            }
        });
}

/// Messages in the upper left corner; they take no mouse.
pub fn toasts(context: &Context, toasts: &[Toast]) {
    egui::Area::new("toasts".into())
        .order(Order::Foreground)
        .interactable(false)
        .fixed_pos(context.content_rect().left_top() + Vec2::splat(10.0))
        .show(context, |ui| {
            ui.set_max_width((context.content_rect().width() - 40.0).max(120.0));
            for toast in toasts {
                let color = if toast.tone == Tone::Problem { PROBLEM } else { TEXT };
                glass().show(ui, |ui| ui.label(RichText::new(&toast.text).size(TEXT_SIZE + 1.0).color(color)));
                ui.add_space(4.0);
            }
        });
}

/// The list of keys, in the middle; `open` becomes false when its cross is clicked.
pub fn help(context: &Context, open: &mut bool) {
    let screen = context.content_rect();
    let column_width = 430.0;
    let columns = if screen.width() >= 2.0 * column_width + 80.0 { 2 } else { 1 };
    let room = Vec2::new(screen.width() - 50.0, screen.height() - 110.0).max(Vec2::splat(60.0));
    egui::Window::new("Keys and mouse")
        .open(open)
        .anchor(Align2::CENTER_CENTER, Vec2::ZERO)
        .collapsible(false)
        .auto_sized()
        .show(context, |ui| {
            egui::ScrollArea::both().max_width(room.x).max_height(room.y).show(ui, |ui| {
                ui.horizontal_top(|ui| {
                    // The first groups fill the left column, the rest the right one.
                    let split = BINDINGS.len().div_ceil(columns);
                    for (i, groups) in BINDINGS.chunks(split).enumerate() {
                        ui.vertical(|ui| {
                            ui.set_width(column_width);
                            groups_grid(ui, i, groups);
                        });
                    }
                });
            });
        });
}

fn groups_grid(ui: &mut egui::Ui, id: usize, groups: &[Group]) {
    egui::Grid::new(("keys", id)).num_columns(2).spacing([14.0, 3.0]).show(ui, |ui| {
        for group in groups {
            ui.label(RichText::new(group.title).size(TEXT_SIZE + 2.0).strong());
            ui.end_row();
            for binding in group.bindings {
                ui.label(RichText::new(binding.keys()).size(TEXT_SIZE).color(KEY));
                ui.label(RichText::new(binding.effect).size(TEXT_SIZE));
                ui.end_row();
            }
            // An empty row parts the groups.
            ui.label("");
            ui.end_row();
        }
    });
}

fn glass() -> Frame {
    Frame::NONE.fill(GLASS).corner_radius(CornerRadius::same(4)).inner_margin(Margin::symmetric(9, 5))
}
