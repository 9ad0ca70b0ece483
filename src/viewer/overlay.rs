//! Overlays on the image: the status line, messages, and the legend of an inspection.

use crate::files::printable;
use crate::render::{Legend, scale_color};
use crate::viewer::toasts::{Toast, Tone};
use egui::{Align2, Color32, Context, CornerRadius, FontId, Frame, Margin, Order, RichText, Stroke, Vec2};

/// Background of panels and lists, nearly opaque because they are read for longer.
pub const PANE: Color32 = Color32::from_rgba_premultiplied(19, 20, 23, 246);
/// Background of other overlays, dark so that text is readable on any image.
pub const GLASS: Color32 = Color32::from_rgba_premultiplied(9, 10, 12, 225);
const TEXT: Color32 = Color32::from_gray(228);
/// Colour of the names of keys.
pub const KEY: Color32 = Color32::from_rgb(250, 205, 125);
const PROBLEM: Color32 = Color32::from_rgb(255, 140, 120);
/// Points.
pub const TEXT_SIZE: f32 = 13.0;

/// Sets the style of overlays, once.
pub fn style(context: &Context) {
    context.options_mut(|options| {
        options.theme_preference = egui::ThemePreference::Dark;
        // Ctrl with + and - controls the field of view.
        options.zoom_with_keyboard = false;
    });
    context.all_styles_mut(|style| {
        style.visuals.override_text_color = Some(TEXT);
        style.visuals.window_fill = PANE;
        style.visuals.window_stroke = Stroke::new(1.0, Color32::from_gray(60));
        style.interaction.selectable_labels = false;
    });
}

/// Draws the status line at the lower edge; it ignores the mouse.
pub fn status_line(context: &Context, left: &str, right: &str) {
    let (left, right) = (&*printable::line(left), &*printable::line(right));
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
            // Settings that do not fit beside the figures are omitted as a whole: a partial word is useless.
            let right = layout(right, Color32::from_gray(165), f32::INFINITY);
            if right.size().x <= room {
                let at = rect.right_top() + Vec2::new(-margin - right.size().x, 4.0);
                ui.painter().galley(at, right, TEXT);
            }
        });
}

/// Style of a key's name.
pub fn style_key(key: &str) -> RichText {
    RichText::new(key).size(TEXT_SIZE - 1.0).color(KEY)
}

/// Draws messages in the upper left corner; they ignore the mouse.
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

/// Draws the legend of an inspection in the lower left corner; it ignores the mouse.
pub fn legend(context: &Context, title: &str, legend: Option<Legend>) {
    // Its position depends on its height in the last frame.
    egui::Area::new(egui::Id::new(("legend", legend.is_some())))
        .order(Order::Foreground)
        .interactable(false)
        .fixed_pos(context.content_rect().left_bottom() + Vec2::new(10.0, -34.0))
        .pivot(Align2::LEFT_BOTTOM)
        .show(context, |ui| {
            glass().show(ui, |ui| {
                ui.label(RichText::new(title).size(TEXT_SIZE).strong());
                let Some(Legend { low, high, unit }) = legend else { return };
                let (rect, _) = ui.allocate_exact_size(Vec2::new(190.0, 10.0), egui::Sense::hover());
                let n = 38;
                for i in 0..n {
                    let [r, g, b] = scale_color((i as f32 + 0.5) / n as f32);
                    let left = rect.left() + rect.width() * i as f32 / n as f32;
                    let cell = egui::Rect::from_min_size(
                        egui::pos2(left, rect.top()),
                        Vec2::new(rect.width() / n as f32 + 0.5, 10.0),
                    );
                    ui.painter().rect_filled(cell, 0.0, Color32::from_rgb(r, g, b));
                }
                ui.horizontal(|ui| {
                    ui.set_width(190.0);
                    ui.label(RichText::new(format!("{} {unit}", short(low))).size(TEXT_SIZE - 1.0));
                    ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                        ui.label(RichText::new(format!("{} {unit}", short(high))).size(TEXT_SIZE - 1.0));
                    });
                });
            });
        });
}

/// Formats with three significant digits.
fn short(value: f32) -> String {
    match value.abs() {
        v if v >= 100.0 || v.fract() == 0.0 => format!("{value:.0}"),
        v if v >= 10.0 => format!("{value:.1}"),
        v if v >= 0.1 => format!("{value:.2}"),
        _ => format!("{value:.3}"),
    }
}

fn glass() -> Frame {
    Frame::NONE.fill(GLASS).corner_radius(CornerRadius::same(4)).inner_margin(Margin::symmetric(9, 5))
}
