//! Overlays on the image: the status line, messages, and the list of keys.

use super::keys::{Binding, finds, shown};
use super::toasts::{Toast, Tone};
use crate::frame::Navigation;
use crate::printable;
use crate::render::{Legend, scale_color};
use egui::{Align2, Color32, Context, CornerRadius, FontId, Frame, Margin, Order, RichText, Stroke, Vec2};

/// Background of panels and lists, nearly opaque because they are read for longer.
pub const PANE: Color32 = Color32::from_rgba_premultiplied(19, 20, 23, 246);
/// Background of other overlays, dark so that text is readable on any image.
pub const GLASS: Color32 = Color32::from_rgba_premultiplied(9, 10, 12, 225);
const TEXT: Color32 = Color32::from_gray(228);
const KEY: Color32 = Color32::from_rgb(250, 205, 125);
const PROBLEM: Color32 = Color32::from_rgb(255, 140, 120);
const TEXT_SIZE: f32 = 13.0;

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

/// State of the list of keys while it is open.
#[derive(Default)]
pub struct Help {
    pub open: bool,
    /// Only lines that match all of these words are shown.
    search: String,
    /// Just opened: the search field takes the focus.
    fresh: bool,
    /// The user has typed into the search field or clicked it: letters belong to it.
    touched: bool,
    /// The search field has the focus, perhaps only because the list was opened.
    focused: bool,
}

impl Help {
    pub fn toggle(&mut self) {
        *self = Self { open: !self.open, search: String::new(), fresh: true, touched: false, focused: false };
    }

    /// Records a typed letter, which the search field gets when it is drawn next.
    pub fn note_letter(&mut self) {
        self.touched |= self.open && (self.fresh || self.focused);
    }

    /// Whether the letter that opened it closes it: until letters belong to the search field.
    pub fn closes_by_its_letter(&self) -> bool {
        self.open && !self.touched && (self.fresh || self.focused)
    }

    /// Whether it has not been drawn since it was opened.
    pub fn is_fresh(&self) -> bool {
        self.open && self.fresh
    }
}

/// Draws the list of keys in the middle, with search field and scroll bar.
pub fn help(context: &Context, help: &mut Help, navigation: Navigation) {
    let screen = context.content_rect();
    let column_width = 430.0_f32.min(screen.width() - 60.0).max(120.0);
    let columns = if screen.width() >= 2.0 * column_width + 80.0 { 2 } else { 1 };
    let height = (screen.height() - 130.0).max(60.0);
    let Help { open, search, fresh, touched, focused } = help;
    egui::Window::new("Keys and mouse")
        .open(open)
        .anchor(Align2::CENTER_CENTER, Vec2::new(0.0, -8.0))
        .collapsible(false)
        .resizable(false)
        .fixed_size(Vec2::new(columns as f32 * column_width + 20.0, height))
        .show(context, |ui| {
            let field = egui::TextEdit::singleline(search)
                .hint_text("search: blur, undo, video … (H closes)")
                .desired_width(220.0);
            let field = ui.add(field);
            if std::mem::take(fresh) {
                field.request_focus();
            }
            *touched |= field.changed() || field.clicked();
            *focused = field.has_focus() || field.gained_focus();
            ui.add_space(4.0);
            let mut groups = shown(navigation);
            for (title, bindings) in &mut groups {
                bindings.retain(|binding| finds(&binding.line(title), search));
            }
            groups.retain(|(_, found)| !found.is_empty());
            egui::ScrollArea::vertical().auto_shrink([false, false]).max_height(height - 36.0).show(ui, |ui| {
                if groups.is_empty() {
                    ui.weak("no matches");
                }
                ui.horizontal_top(|ui| {
                    for (i, groups) in in_columns(&groups, columns).into_iter().enumerate() {
                        ui.vertical(|ui| {
                            ui.set_width(column_width);
                            groups_grid(ui, i, groups, column_width);
                        });
                    }
                });
            });
        });
}

/// Splits the groups into columns of about equal length.
fn in_columns<'a>(groups: &'a [(&'a str, Vec<&'a Binding>)], columns: usize) -> Vec<&'a [(&'a str, Vec<&'a Binding>)]> {
    if columns < 2 {
        return vec![groups];
    }
    let lines = |groups: &[(&str, Vec<&Binding>)]| groups.iter().map(|(_, found)| found.len() + 2).sum::<usize>();
    let longer = |split: usize| lines(&groups[..split]).max(lines(&groups[split..]));
    let split = (0..=groups.len()).min_by_key(|&split| longer(split)).unwrap_or(0);
    vec![&groups[..split], &groups[split..]]
}

fn groups_grid(ui: &mut egui::Ui, id: usize, groups: &[(&str, Vec<&Binding>)], width: f32) {
    let keys_width = 0.38 * width;
    for (title, bindings) in groups {
        ui.label(RichText::new(*title).size(TEXT_SIZE + 2.0).strong());
        egui::Grid::new(("keys", id, title)).num_columns(2).spacing([14.0, 3.0]).show(ui, |ui| {
            for binding in bindings {
                // Both columns wrap rather than displace each other.
                ui.scope(|ui| {
                    ui.set_width(keys_width);
                    ui.add(egui::Label::new(RichText::new(binding.keys()).size(TEXT_SIZE).color(KEY)).wrap());
                });
                ui.scope(|ui| {
                    ui.set_width(width - keys_width - 24.0);
                    ui.add(egui::Label::new(RichText::new(binding.effect).size(TEXT_SIZE)).wrap());
                });
                ui.end_row();
            }
        });
        ui.add_space(10.0);
    }
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
