//! Explanation of a pixel, over the image: its paths in the scene, and a [`table`] of the contribution of each light.
//!
//! Paths are drawn through surfaces, because what is behind a wall is often of interest. All of them at once are
//! unreadable, so the strongest are shown, optionally of one light or of one number of bounces.

mod table;

use crate::frame::{End, PathRecord, PixelStory, Projector, brightness};
use egui::{Color32, Context, Pos2, Stroke};
use glam::{DVec2, DVec3};

/// Colours by segment, from the camera; the last one is used for all further segments.
const SEGMENTS: [Color32; 6] = [
    Color32::from_rgb(240, 240, 240),
    Color32::from_rgb(255, 214, 92),
    Color32::from_rgb(255, 140, 66),
    Color32::from_rgb(240, 84, 110),
    Color32::from_rgb(190, 100, 230),
    Color32::from_rgb(96, 140, 255),
];
/// Colour of the connection from a vertex to the sampled light.
const LIGHT_SAMPLE: Color32 = Color32::from_rgb(140, 230, 150);

/// Selection of the paths that are drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct PathFilter {
    /// Number of the strongest paths to draw; `None` for all, including those without contribution.
    strongest: Option<usize>,
    /// Only light of this name.
    light: Option<String>,
    /// Only light after this number of bounces.
    bounces: Option<usize>,
}

impl Default for PathFilter {
    fn default() -> Self {
        Self { strongest: Some(Self::STRONGEST[1]), light: None, bounces: None }
    }
}

impl PathFilter {
    const STRONGEST: [usize; 3] = [3, 12, 32];

    fn is_filtered(&self) -> bool {
        self.light.is_some() || self.bounces.is_some()
    }

    /// Clears filters that do not apply to this pixel.
    fn fit(&mut self, story: &PixelStory) {
        self.light = self.light.take().filter(|name| story.lights.iter().any(|light| light.name == *name));
        self.bounces = self.bounces.filter(|bounces| *bounces < story.by_bounces.len());
    }

    /// Brightness of the part of a path that passes the filters.
    fn strength(&self, path: &PathRecord) -> f64 {
        let is_asked_for = |end: &End, bounces: usize| {
            let light = match end {
                End::At { what, .. } => what.as_str(),
                End::Sky { .. } => "sky",
            };
            self.light.as_ref().is_none_or(|name| name == light) && self.bounces.is_none_or(|n| n == bounces)
        };
        let parts = path.stops.iter().enumerate().flat_map(|(i, stop)| {
            let itself = (&stop.end, i, stop.radiance);
            let asked = stop.asked.as_ref().map(|(light, radiance)| (light, i + 1, *radiance));
            [Some(itself), asked].into_iter().flatten()
        });
        parts.filter(|(end, bounces, _)| is_asked_for(end, *bounces)).map(|(.., radiance)| brightness(radiance)).sum()
    }

    /// Returns the paths to draw, the strongest last so that nothing hides them.
    fn of<'a>(&self, story: &'a PixelStory) -> Vec<&'a PathRecord> {
        let mut paths: Vec<(f64, &PathRecord)> = story.ways.iter().map(|path| (self.strength(path), path)).collect();
        if self.is_filtered() {
            paths.retain(|(strength, _)| *strength > 0.0);
        }
        paths.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        let n = self.strongest.unwrap_or(paths.len()).min(paths.len());
        paths.split_off(paths.len() - n).into_iter().map(|(_, path)| path).collect()
    }
}

/// Draws paths and table; `reach`: length of a segment that leaves the scene, metres.
pub fn draw(context: &Context, story: &PixelStory, shown: &mut PathFilter, projector: &Projector, reach: f64) {
    shown.fit(story);
    let painter = context.layer_painter(egui::LayerId::background());
    for path in shown.of(story) {
        let mut from = path.origin;
        for (segment, stop) in path.stops.iter().enumerate() {
            let to = point_of(&stop.end, from, reach);
            let color = SEGMENTS[segment.min(SEGMENTS.len() - 1)];
            // Paths without contribution are drawn faintly.
            let is_dark = path.radiance == DVec3::ZERO;
            line(&painter, projector, from, to, color.gamma_multiply(if is_dark { 0.25 } else { 0.75 }));
            if let Some((light, radiance)) = &stop.asked
                && brightness(*radiance) > 0.0
            {
                line(&painter, projector, to, point_of(light, to, reach), LIGHT_SAMPLE.gamma_multiply(0.45));
            }
            if let (End::At { .. }, Some(place)) = (&stop.end, projector.place(to)) {
                painter.circle_filled(pos(place), 2.0, color);
            }
            from = to;
        }
    }
    let first =
        story.ways.iter().find_map(|path| path.stops.first().map(|stop| point_of(&stop.end, path.origin, reach)));
    if let Some(place) = first.and_then(|point| projector.place(point)) {
        painter.circle_stroke(pos(place), 7.0, Stroke::new(3.0, Color32::from_black_alpha(140)));
        painter.circle_stroke(pos(place), 7.0, Stroke::new(1.5, Color32::WHITE));
    }
    table::draw(context, story, shown);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Stop;

    /// A path that hits `light` after its bounces, with this radiance.
    fn path(light: &str, bounces: usize, radiance: f64) -> PathRecord {
        let stop = |what: &str, radiance: f64| Stop {
            end: End::At { point: DVec3::ZERO, what: what.to_owned() },
            throughput: DVec3::ONE,
            radiance: DVec3::splat(radiance),
            asked: None,
        };
        let mut stops: Vec<Stop> = (0..bounces).map(|_| stop("wall", 0.0)).collect();
        stops.push(stop(light, radiance));
        PathRecord { sample: 0, radiance: DVec3::splat(radiance), origin: DVec3::ZERO, stops }
    }

    #[test]
    fn the_strongest_paths_of_a_light_or_of_a_bounce_are_shown() {
        let mut asked = path("sky", 1, 0.0);
        asked.stops[0].asked = Some((End::Sky { direction: DVec3::Y }, DVec3::splat(7.0)));
        let story = PixelStory {
            ways: vec![path("light", 1, 2.0), path("light", 2, 5.0), path("bulb", 1, 9.0), path("bulb", 1, 0.0), asked],
            ..PixelStory::default()
        };
        let strengths = |shown: &PathFilter| -> Vec<f64> {
            shown.of(&story).into_iter().map(|path| shown.strength(path).round()).collect()
        };
        let all = PathFilter { strongest: None, light: None, bounces: None };
        assert_eq!(strengths(&all), [0.0, 2.0, 5.0, 7.0, 9.0]);
        assert_eq!(strengths(&PathFilter { strongest: Some(2), ..all.clone() }), [7.0, 9.0]);
        let of_light = PathFilter { light: Some("light".to_owned()), ..all.clone() };
        assert_eq!(strengths(&of_light), [2.0, 5.0]);
        assert_eq!(strengths(&PathFilter { bounces: Some(1), ..of_light }), [2.0]);
        assert_eq!(strengths(&PathFilter { light: Some("sky".to_owned()), ..all }), [7.0], "what was asked counts");
    }
}
