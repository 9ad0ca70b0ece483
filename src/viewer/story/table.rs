//! The table of a pixel: the contribution of each light and each number of bounces, and the selection of paths.
//!
//! The table shows luminance for readability; `firstlight explain` has the three channels.

use crate::frame::{PixelStory, brightness};
use crate::viewer::overlay::GLASS;
use crate::viewer::status::percent;
use crate::viewer::story::filter::{PathFilter, SEGMENTS};
use egui::{Align2, Color32, Context, FontId, Frame, Margin, Order, RichText, Sense, Ui};
use glam::DVec3;

/// Lights in the table; the others are summed up.
const LIGHTS_SHOWN: usize = 9;
const TEXT_SIZE: f32 = 12.5;
const WEAK: Color32 = Color32::from_gray(165);

/// Draws the table in the upper left corner, below the messages.
pub fn draw(context: &Context, story: &PixelStory, shown: &mut PathFilter) {
    let all = brightness(story.total());
    egui::Area::new("story".into())
        .order(Order::Middle)
        .fixed_pos(context.content_rect().left_top() + egui::vec2(10.0, 44.0))
        .show(context, |ui| {
            Frame::NONE.fill(GLASS).corner_radius(4.0).inner_margin(Margin::symmetric(10, 7)).show(ui, |ui| {
                let (x, y, n) = (story.pixel.x, story.pixel.y, story.samples.len());
                text(ui, format!("pixel {x}, {y}: {n} samples, luminance {all:.4}"), true);
                if let Some(seen) = &story.seen {
                    let [object, material] =
                        [&seen.object, &seen.material].map(|name| crate::files::printable::name(name));
                    let side = if seen.front { "front" } else { "back" };
                    text(ui, format!("{object}, material {material}, {side}"), false);
                    if all == 0.0 {
                        text(ui, "no light reaches it".to_owned(), true);
                    }
                }
                ui.add_space(3.0);
                egui::Grid::new("story").num_columns(6).spacing([14.0, 2.0]).show(ui, |ui| {
                    for title in ["light", "visible", "direct", "indirect", "total", "share"] {
                        cell(ui, title.to_owned(), title != "light", WEAK);
                    }
                    ui.end_row();
                    for light in story.lights.iter().take(LIGHTS_SHOWN) {
                        let chosen = shown.light.as_ref() == Some(&light.name);
                        if row(ui, &crate::files::printable::name(&light.name), light.parts(), all, Some(chosen)) {
                            shown.light = (!chosen).then(|| light.name.clone());
                        }
                    }
                    let others = story.lights.get(LIGHTS_SHOWN..).unwrap_or_default();
                    if !others.is_empty() {
                        let sum = |part: usize| others.iter().map(|light| light.parts()[part]).sum();
                        row(ui, &format!("{} others", others.len()), [sum(0), sum(1), sum(2)], all, None);
                    }
                    if let Some(light_traced) = story.light_traced.filter(|light| *light != DVec3::ZERO) {
                        let total = brightness(light_traced);
                        cell(ui, "by light tracing".to_owned(), false, Color32::from_gray(228));
                        (0..3).for_each(|_| drop(ui.label("")));
                        cell(ui, figure(total), true, Color32::from_gray(228));
                        cell(ui, percent(total / all), true, Color32::from_gray(228));
                        ui.end_row();
                    }
                });
                ui.add_space(4.0);
                bounces(ui, story, shown);
                path_controls(ui, shown);
                if story.n_bad > 0 {
                    text(ui, format!("{} samples were not finite and were discarded", story.n_bad), false);
                }
            });
        });
}

/// Draws a row; returns whether its name was clicked. `chosen` is `None` for rows that cannot be chosen.
fn row(ui: &mut Ui, name: &str, parts: [DVec3; 3], all: f64, chosen: Option<bool>) -> bool {
    let parts = parts.map(brightness);
    let total: f64 = parts.iter().sum();
    // Names may be of any length.
    let name: String =
        if name.chars().count() > 24 { name.chars().take(23).chain(['…']).collect() } else { name.into() };
    let clicked = match chosen {
        Some(chosen) => {
            let text = RichText::new(name).size(TEXT_SIZE).color(Color32::from_gray(228));
            let label =
                ui.selectable_label(chosen, text).on_hover_text("draw only paths from this light, or all paths");
            label.clicked()
        }
        None => {
            cell(ui, name, false, Color32::from_gray(228));
            false
        }
    };
    for part in parts {
        let color = Color32::from_gray(if part == 0.0 { 110 } else { 228 });
        cell(ui, figure(part), true, color);
    }
    cell(ui, figure(total), true, Color32::from_gray(228));
    cell(ui, percent(total / all), true, Color32::from_gray(228));
    ui.end_row();
    clicked
}

/// Controls for the selection of paths.
fn path_controls(ui: &mut Ui, shown: &mut PathFilter) {
    ui.horizontal(|ui| {
        text(ui, "paths drawn:".to_owned(), false);
        let strongest = PathFilter::STRONGEST.map(|n| (Some(n), format!("strongest {n}")));
        for (n, label) in strongest.into_iter().chain([(None, "all".to_owned())]) {
            if ui.selectable_label(shown.strongest == n, RichText::new(label).size(TEXT_SIZE)).clicked() {
                shown.strongest = n;
            }
        }
    });
    let bounces = shown.bounces.map(|n| format!("after {n} bounces"));
    let light = shown.light.as_ref().map(|name| format!("from {name}"));
    let filter: Vec<String> = light.into_iter().chain(bounces).collect();
    match filter.is_empty() {
        true => text(
            ui,
            "click a light or a number of bounces to filter the paths; J: other pixel, Esc: close".to_owned(),
            false,
        ),
        false => text(ui, format!("only {}: click again to show all", filter.join(", ")), true),
    }
}

/// Contributions by number of bounces, as a bar in the colours of the paths: directly visible light has the colour of
/// the first segment.
fn bounces(ui: &mut Ui, story: &PixelStory, shown: &mut PathFilter) {
    let parts: Vec<f64> = story.by_bounces.iter().map(|part| brightness(*part).max(0.0)).collect();
    let sum: f64 = parts.iter().sum();
    if sum <= 0.0 {
        return;
    }
    let size = egui::vec2(ui.min_rect().width().max(220.0), 15.0);
    let (rect, _) = ui.allocate_exact_size(size, Sense::hover());
    let mut left = rect.left();
    for (bounces, part) in parts.iter().enumerate() {
        let width = rect.width() * (part / sum) as f32;
        let color = SEGMENTS[bounces.min(SEGMENTS.len() - 1)];
        let bar = egui::Rect::from_min_size(egui::pos2(left, rect.top()), egui::vec2(width, rect.height()));
        let chosen = shown.bounces == Some(bounces);
        let response = ui.interact(bar, ui.id().with(("bounces", bounces)), Sense::click());
        let is_dim = shown.bounces.is_some() && !chosen;
        ui.painter().rect_filled(bar, 0.0, color.gamma_multiply(if is_dim { 0.35 } else { 0.85 }));
        let share = percent(part / sum);
        let response =
            response.on_hover_text(format!("{share} after {bounces} bounces: draw only these paths, or all paths"));
        if response.clicked() {
            shown.bounces = (!chosen).then_some(bounces);
        }
        if width > 16.0 {
            let font = FontId::proportional(TEXT_SIZE - 1.5);
            ui.painter().text(bar.center(), Align2::CENTER_CENTER, bounces.to_string(), font, Color32::BLACK);
        }
        left += width;
    }
    let (itself, asked) = (brightness(story.by_itself) / sum, brightness(story.by_asking) / sum);
    let noise = percent(brightness(story.deviation) / brightness(story.mean));
    text(
        ui,
        format!(
            "bounces   BSDF sampling {}   light sampling {}   noise of the mean {noise}",
            percent(itself),
            percent(asked)
        ),
        false,
    );
}

fn cell(ui: &mut Ui, content: String, is_figure: bool, color: Color32) {
    let text = RichText::new(content).size(TEXT_SIZE).color(color);
    if is_figure {
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| ui.label(text));
    } else {
        ui.label(text);
    }
}

fn text(ui: &mut Ui, content: String, strong: bool) {
    let text = RichText::new(content).size(TEXT_SIZE);
    ui.label(if strong { text.strong() } else { text.color(WEAK) });
}

fn figure(value: f64) -> String {
    match value {
        0.0 => "–".to_owned(),
        v if v.abs() >= 100.0 => format!("{v:.0}"),
        v if v.abs() >= 0.01 => format!("{v:.3}"),
        v => format!("{v:.1e}"),
    }
}
