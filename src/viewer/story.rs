//! The story of a pixel, over the picture: its paths where they ran, and a table of what each light brought.
//!
//! Paths are drawn through everything, since what is behind a wall is often what one is looking for. A table that says
//! luminance is read at a glance; `firstlight explain` has the three channels.

use super::overlay::GLASS;
use super::status::percent;
use crate::frame::{End, PixelStory, Projector, brightness};
use egui::{Align2, Color32, Context, FontId, Frame, Margin, Order, Pos2, RichText, Stroke, Ui};
use glam::{DVec2, DVec3};

/// By segment, from the eye on; the last one is that of all further ones.
const SEGMENTS: [Color32; 6] = [
    Color32::from_rgb(240, 240, 240),
    Color32::from_rgb(255, 214, 92),
    Color32::from_rgb(255, 140, 66),
    Color32::from_rgb(240, 84, 110),
    Color32::from_rgb(190, 100, 230),
    Color32::from_rgb(96, 140, 255),
];
/// From a vertex to the lamp that it asked.
const ASKED: Color32 = Color32::from_rgb(140, 230, 150);
/// More would be a tangle.
const WAYS_SHOWN: usize = 24;
/// Lights in the table; the others are counted together.
const LIGHTS_SHOWN: usize = 9;
const TEXT_SIZE: f32 = 12.5;

/// Draws both; `reach`: how far a path that leaves the scene is drawn, metres.
pub fn draw(context: &Context, story: &PixelStory, projector: &Projector, reach: f64) {
    let painter = context.layer_painter(egui::LayerId::background());
    for way in story.ways.iter().take(WAYS_SHOWN) {
        let mut from = way.origin;
        for (segment, stop) in way.stops.iter().enumerate() {
            let to = point_of(&stop.end, from, reach);
            let color = SEGMENTS[segment.min(SEGMENTS.len() - 1)];
            // What brings no light is there, but does not catch the eye.
            let is_dark = way.radiance == DVec3::ZERO;
            line(&painter, projector, from, to, color.gamma_multiply(if is_dark { 0.25 } else { 0.75 }));
            if let Some((lamp, radiance)) = &stop.asked
                && brightness(*radiance) > 0.0
            {
                line(&painter, projector, to, point_of(lamp, to, reach), ASKED.gamma_multiply(0.45));
            }
            if let (End::At { .. }, Some(place)) = (&stop.end, projector.place(to)) {
                painter.circle_filled(pos(place), 2.0, color);
            }
            from = to;
        }
    }
    let first = story.ways.iter().find_map(|way| way.stops.first().map(|stop| point_of(&stop.end, way.origin, reach)));
    if let Some(place) = first.and_then(|point| projector.place(point)) {
        painter.circle_stroke(pos(place), 7.0, Stroke::new(3.0, Color32::from_black_alpha(140)));
        painter.circle_stroke(pos(place), 7.0, Stroke::new(1.5, Color32::WHITE));
    }
    table(context, story);
}

fn point_of(end: &End, from: DVec3, reach: f64) -> DVec3 {
    match end {
        End::At { point, .. } => *point,
        End::Sky { direction } => from + reach * *direction,
    }
}

fn line(painter: &egui::Painter, projector: &Projector, a: DVec3, b: DVec3, color: Color32) {
    if let Some([a, b]) = projector.segment(a, b) {
        painter.line_segment([pos(a), pos(b)], Stroke::new(1.2, color));
    }
}

fn pos(place: DVec2) -> Pos2 {
    Pos2::new(place.x as f32, place.y as f32)
}

/// In the upper left corner, under the messages; it takes no mouse.
fn table(context: &Context, story: &PixelStory) {
    let all = brightness(story.total());
    egui::Area::new("story".into())
        .order(Order::Middle)
        .interactable(false)
        .fixed_pos(context.content_rect().left_top() + egui::vec2(10.0, 44.0))
        .show(context, |ui| {
            Frame::NONE.fill(GLASS).corner_radius(4.0).inner_margin(Margin::symmetric(10, 7)).show(ui, |ui| {
                let (x, y, n) = (story.pixel.x, story.pixel.y, story.samples.len());
                text(ui, format!("pixel {x}, {y}: {n} samples, brightness {all:.4}"), true);
                ui.add_space(3.0);
                egui::Grid::new("story").num_columns(6).spacing([14.0, 2.0]).show(ui, |ui| {
                    for title in ["light", "seen", "direct", "indirect", "together", "share"] {
                        cell(ui, title.to_owned(), title != "light", Color32::from_gray(165));
                    }
                    ui.end_row();
                    for light in story.lights.iter().take(LIGHTS_SHOWN) {
                        row(ui, &light.name, light.parts(), all);
                    }
                    let others = story.lights.get(LIGHTS_SHOWN..).unwrap_or_default();
                    if !others.is_empty() {
                        let sum = |part: usize| others.iter().map(|light| light.parts()[part]).sum();
                        row(ui, &format!("{} others", others.len()), [sum(0), sum(1), sum(2)], all);
                    }
                    if let Some(from_lamps) = story.from_lamps.filter(|light| *light != DVec3::ZERO) {
                        let total = brightness(from_lamps);
                        cell(ui, "paths from the lamps".to_owned(), false, Color32::from_gray(228));
                        (0..3).for_each(|_| drop(ui.label("")));
                        cell(ui, figure(total), true, Color32::from_gray(228));
                        cell(ui, percent(total / all), true, Color32::from_gray(228));
                        ui.end_row();
                    }
                });
                ui.add_space(4.0);
                bounces(ui, story);
                if story.n_bad > 0 {
                    text(ui, format!("{} samples were not finite and are left out", story.n_bad), false);
                }
            });
        });
}

fn row(ui: &mut Ui, name: &str, parts: [DVec3; 3], all: f64) {
    let parts = parts.map(brightness);
    let total: f64 = parts.iter().sum();
    // Names are as long as people like.
    let name: String =
        if name.chars().count() > 24 { name.chars().take(23).chain(['…']).collect() } else { name.into() };
    cell(ui, name, false, Color32::from_gray(228));
    for part in parts {
        let color = Color32::from_gray(if part == 0.0 { 110 } else { 228 });
        cell(ui, figure(part), true, color);
    }
    cell(ui, figure(total), true, Color32::from_gray(228));
    cell(ui, percent(total / all), true, Color32::from_gray(228));
    ui.end_row();
}

/// What came after how many bounces, as a bar in the colours of the paths: light that the eye sees directly has the
/// colour of the first segment.
fn bounces(ui: &mut Ui, story: &PixelStory) {
    let parts: Vec<f64> = story.by_bounces.iter().map(|part| brightness(*part).max(0.0)).collect();
    let sum: f64 = parts.iter().sum();
    if sum <= 0.0 {
        return;
    }
    let (rect, _) = ui.allocate_exact_size(egui::vec2(ui.min_rect().width().max(220.0), 14.0), egui::Sense::hover());
    let mut left = rect.left();
    for (bounces, part) in parts.iter().enumerate() {
        let width = rect.width() * (part / sum) as f32;
        let color = SEGMENTS[bounces.min(SEGMENTS.len() - 1)];
        let bar = egui::Rect::from_min_size(egui::pos2(left, rect.top()), egui::vec2(width, rect.height()));
        ui.painter().rect_filled(bar, 0.0, color.gamma_multiply(0.85));
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
            "bounces   run into {}   asked for {}   noise of the mean {noise}   J: another, Esc: none",
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
    ui.label(if strong { text.strong() } else { text.color(Color32::from_gray(165)) });
}

fn figure(value: f64) -> String {
    match value {
        0.0 => "–".to_owned(),
        v if v.abs() >= 100.0 => format!("{v:.0}"),
        v if v.abs() >= 0.01 => format!("{v:.3}"),
        v => format!("{v:.1e}"),
    }
}
