//! Explanation of a pixel, over the image: its paths in the scene, and a [`table`] of the contribution of each light.
//!
//! Paths are drawn through surfaces, because what is behind a wall is often of interest. All of them at once are
//! unreadable, so the strongest are shown, optionally of one light or of one number of bounces.

mod filter;
mod table;

pub use filter::PathFilter;

use filter::SEGMENTS;

use crate::frame::{End, PixelStory, Projector, brightness};
use egui::{Color32, Context, Pos2, Stroke};
use glam::{DVec2, DVec3};

/// Colour of the connection from a vertex to the sampled light.
const LIGHT_SAMPLE: Color32 = Color32::from_rgb(140, 230, 150);

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
    use crate::frame::PathRecord;
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
