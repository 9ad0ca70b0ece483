//! Which paths are drawn, and in which colours.

use crate::frame::{End, PathRecord, PixelStory, brightness};
use egui::Color32;

/// Colours by segment, from the camera; the last one is used for all further segments.
pub const SEGMENTS: [Color32; 6] = [
    Color32::from_rgb(240, 240, 240),
    Color32::from_rgb(255, 214, 92),
    Color32::from_rgb(255, 140, 66),
    Color32::from_rgb(240, 84, 110),
    Color32::from_rgb(190, 100, 230),
    Color32::from_rgb(96, 140, 255),
];
/// Selection of the paths that are drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct PathFilter {
    /// Number of the strongest paths to draw; `None` for all, including those without contribution.
    pub strongest: Option<usize>,
    /// Only light of this name.
    pub light: Option<String>,
    /// Only light after this number of bounces.
    pub bounces: Option<usize>,
}

impl Default for PathFilter {
    fn default() -> Self {
        Self { strongest: Some(Self::STRONGEST[1]), light: None, bounces: None }
    }
}

impl PathFilter {
    pub const STRONGEST: [usize; 3] = [3, 12, 32];

    pub fn is_filtered(&self) -> bool {
        self.light.is_some() || self.bounces.is_some()
    }

    /// Clears filters that do not apply to this pixel.
    pub fn fit(&mut self, story: &PixelStory) {
        self.light = self.light.take().filter(|name| story.lights.iter().any(|light| light.name == *name));
        self.bounces = self.bounces.filter(|bounces| *bounces < story.by_bounces.len());
    }

    /// Brightness of the part of a path that passes the filters.
    pub fn strength(&self, path: &PathRecord) -> f64 {
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
    pub fn of<'a>(&self, story: &'a PixelStory) -> Vec<&'a PathRecord> {
        let mut paths: Vec<(f64, &PathRecord)> = story.ways.iter().map(|path| (self.strength(path), path)).collect();
        if self.is_filtered() {
            paths.retain(|(strength, _)| *strength > 0.0);
        }
        paths.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        let n = self.strongest.unwrap_or(paths.len()).min(paths.len());
        paths.split_off(paths.len() - n).into_iter().map(|(_, path)| path).collect()
    }
}
