//! Overlays on the image: messages, and the legend of an inspection.

use crate::files::printable;
use crate::render::{Legend, scale_color};
use crate::scene::LoadStage;
use crate::viewer::keys::Action;
use crate::viewer::toasts::{Toast, Tone};
use egui::{Align2, Color32, Context, CornerRadius, Frame, Margin, Order, RichText, Stroke, Vec2};

/// Background of panels and lists, nearly opaque because they are read for longer.
pub const PANE: Color32 = Color32::from_rgba_premultiplied(19, 20, 23, 246);
/// Background of other overlays, dark so that text is readable on any image.
pub const GLASS: Color32 = Color32::from_rgba_premultiplied(9, 10, 12, 225);
pub const TEXT: Color32 = Color32::from_gray(228);
/// Colour of the names of keys.
pub const KEY: Color32 = Color32::from_rgb(250, 205, 125);
pub const PROBLEM: Color32 = Color32::from_rgb(255, 140, 120);
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

/// Style of a key's name.
pub fn style_key(key: &str) -> RichText {
    RichText::new(key).size(TEXT_SIZE - 1.0).color(KEY)
}

/// Draws the progress of opening a scene in the middle of the image; it ignores the mouse.
///
/// - `seconds`: since it began.
pub fn opening(context: &Context, stage: LoadStage, text: &str, seconds: u64) {
    let width = 320.0_f32.min(context.content_rect().width() - 40.0).max(60.0);
    egui::Area::new("opening".into())
        .order(Order::Foreground)
        .interactable(false)
        .anchor(Align2::CENTER_CENTER, Vec2::ZERO)
        .show(context, |ui| {
            glass().inner_margin(Margin::same(14)).show(ui, |ui| {
                ui.set_width(width);
                ui.label(RichText::new(&*printable::line(text)).size(TEXT_SIZE + 1.0));
                ui.add_space(4.0);
                let n = LoadStage::ALL.len() as f32;
                let done = LoadStage::ALL.iter().filter(|other| **other < stage).count() as f32;
                progress(ui, width, (done + 0.5) / n);
                ui.horizontal(|ui| {
                    for other in LoadStage::ALL {
                        let word = RichText::new(other.label()).size(TEXT_SIZE - 1.0);
                        ui.label(if other == stage { word.strong() } else { word.weak() });
                    }
                    ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                        ui.label(RichText::new(format!("{seconds} s")).size(TEXT_SIZE - 1.0));
                    });
                });
            });
        });
}

/// A bar that is filled to this share, 0..1.
pub fn progress(ui: &mut egui::Ui, width: f32, share: f32) {
    let (bar, _) = ui.allocate_exact_size(Vec2::new(width, 8.0), egui::Sense::hover());
    let part = egui::Rect::from_min_size(bar.min, Vec2::new(width * share, 8.0));
    ui.painter().rect_filled(bar, 3.0, Color32::from_gray(45));
    ui.painter().rect_filled(part, 3.0, ui.visuals().selection.bg_fill);
}

/// Draws messages in the upper left corner; they ignore the mouse, except for those with a button.
/// Returns the command that was clicked.
pub fn toasts(context: &Context, toasts: &[Toast]) -> Option<Action> {
    let mut chosen = None;
    let free = context.available_rect();
    let mut corner = free.left_top() + Vec2::splat(10.0);
    for (i, toast) in toasts.iter().enumerate() {
        let area = egui::Area::new(egui::Id::new(("toast", i, toast.button.is_some()))).order(Order::Foreground);
        let drawn = area.interactable(toast.button.is_some()).fixed_pos(corner).show(context, |ui| {
            ui.set_max_width((free.width() - 40.0).max(120.0));
            let color = if toast.tone == Tone::Problem { PROBLEM } else { TEXT };
            glass().show(ui, |ui| {
                ui.label(RichText::new(&toast.text).size(TEXT_SIZE + 1.0).color(color));
                if let Some((text, action)) = &toast.button
                    && ui.button(*text).clicked()
                {
                    chosen = Some(action.clone());
                }
            });
        });
        corner.y = drawn.response.rect.bottom() + 4.0;
    }
    chosen
}

/// Draws the legend of an inspection in the lower left corner; it ignores the mouse.
pub fn legend(context: &Context, title: &str, legend: Option<Legend>) {
    // Its position and its width depend on those in the last frame: each title has its own.
    egui::Area::new(egui::Id::new(("legend", title, legend.is_some())))
        .order(Order::Foreground)
        .interactable(false)
        .fixed_pos(context.available_rect().left_bottom() + Vec2::new(10.0, -7.0))
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
