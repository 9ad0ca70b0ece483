//! Explanation of a pixel in the scene's names and world space: requested by a command, computed by the workers.
//!
//! It stays until another one is requested, so that the camera can move around its paths.

use crate::frame::core::status::{MessageKind, Status};
use crate::frame::image::snapshot_names::SnapshotNames;
use crate::frame::state::resources::{Clock, RenderState, Renderer};
use crate::frame::worker::{Answer, Question};
use crate::render::{Explanation, FoundBy, Integrator, LightSource, Place, SeenSurface};
use bevy_ecs::prelude::{Res, ResMut, Resource};
use glam::{DVec3, UVec2};
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Mutex;
use std::sync::mpsc::{Receiver, TryRecvError};

/// Explanation of a pixel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PixelStory {
    /// The pixel, x and y from the upper left corner of the film.
    pub pixel: UVec2,
    /// Width and height of the film in pixels.
    pub film_size: UVec2,
    /// Numbers of the traced samples.
    pub samples: Range<u32>,
    /// Number of samples that were not finite; they are excluded from all figures.
    pub n_bad: usize,
    /// Contributions per light, the brightest first, W·m⁻²·sr⁻¹.
    pub lights: Vec<LightRow>,
    /// Sum over all lights: directly visible, after one bounce, after two…
    pub by_bounces: Vec<DVec3>,
    /// Contribution of BSDF sampling (paths that hit a light), W·m⁻²·sr⁻¹.
    pub by_itself: DVec3,
    /// Contribution of light sampling, W·m⁻²·sr⁻¹.
    pub by_asking: DVec3,
    /// Mean radiance of the paths, all lights.
    pub mean: DVec3,
    /// Standard deviation of `mean`.
    pub deviation: DVec3,
    /// Additional contribution of light paths, if known.
    pub light_traced: Option<DVec3>,
    /// The path of each sample.
    pub ways: Vec<PathRecord>,
    /// The surface in the middle of the pixel; `None` for the environment.
    pub seen: Option<SeenObject>,
}

/// The surface that a pixel shows, in world space.
#[derive(Clone, Debug, PartialEq)]
pub struct SeenObject {
    /// Name of the object.
    pub object: String,
    /// Name of its material at this point.
    pub material: String,
    /// Whether its front is seen.
    pub front: bool,
    /// World position, metres.
    pub point: DVec3,
    /// Shading normal on the side that is seen, unit.
    pub normal: DVec3,
    /// From the camera, metres.
    pub distance: f64,
}

/// Contribution of one light.
#[derive(Clone, Debug, PartialEq)]
pub struct LightRow {
    /// Name of the object or light, or its kind and number.
    pub name: String,
    /// Directly visible, after one bounce, after two… W·m⁻²·sr⁻¹.
    pub by_bounces: Vec<DVec3>,
}

/// One path, in world space, metres.
#[derive(Clone, Debug, PartialEq)]
pub struct PathRecord {
    /// Sample number.
    pub sample: u32,
    /// Contribution to the pixel, W·m⁻²·sr⁻¹.
    pub radiance: DVec3,
    /// Point on the lens.
    pub origin: DVec3,
    /// End points of its segments, in order.
    pub stops: Vec<Stop>,
}

/// A vertex of a path: the end of a segment.
#[derive(Clone, Debug, PartialEq)]
pub struct Stop {
    /// Where the segment ends.
    pub end: End,
    /// Path throughput from here to the pixel.
    pub throughput: DVec3,
    /// Contribution of emission at this vertex.
    pub radiance: DVec3,
    /// The light sample taken here, and its contribution.
    pub asked: Option<(End, DVec3)>,
}

/// End point or direction of a segment.
#[derive(Clone, Debug, PartialEq)]
pub enum End {
    /// A point on a surface.
    At {
        /// World position, metres.
        point: DVec3,
        /// Name of the object or light.
        what: String,
    },
    /// The environment.
    Sky {
        /// Unit direction, away from the scene.
        direction: DVec3,
    },
}

impl LightRow {
    /// Sum over all bounces, W·m⁻²·sr⁻¹.
    pub fn total(&self) -> DVec3 {
        self.by_bounces.iter().sum()
    }

    /// Directly visible, after one bounce, after more.
    pub fn parts(&self) -> [DVec3; 3] {
        parts(&self.by_bounces)
    }
}

/// Directly visible, after one bounce, after more.
fn parts(by_bounces: &[DVec3]) -> [DVec3; 3] {
    let at = |bounces: usize| by_bounces.get(bounces).copied().unwrap_or_default();
    [at(0), at(1), by_bounces.iter().skip(2).sum()]
}

impl SnapshotNames {
    fn seen(&self, seen: &SeenSurface) -> SeenObject {
        SeenObject {
            object: self.object(seen.object),
            material: self.materials.get(seen.material as usize).cloned().unwrap_or_default(),
            front: seen.front,
            point: self.origin + seen.position.as_dvec3(),
            normal: seen.normal.as_dvec3(),
            distance: f64::from(seen.distance),
        }
    }

    fn source(&self, source: LightSource) -> String {
        match source {
            LightSource::Delta(light) => self.light(light),
            LightSource::Object(object) => self.object(object),
            LightSource::Sky => "sky".to_owned(),
            LightSource::Rim => self.object(u32::MAX),
        }
    }

    fn end(&self, place: Place) -> End {
        match place {
            Place::Surface { position, object } => {
                End::At { point: self.origin + position.as_dvec3(), what: self.object(object) }
            }
            Place::Light { position, light } => {
                End::At { point: self.origin + position.as_dvec3(), what: self.light(light) }
            }
            Place::Sky { direction } => End::Sky { direction: direction.as_dvec3() },
        }
    }
}

impl PixelStory {
    /// Converts an explanation to world space, with the names of its objects.
    ///
    /// - `seen`: the surface in the middle of the pixel.
    pub fn new(
        explanation: &Explanation,
        light_traced: Option<DVec3>,
        seen: Option<SeenSurface>,
        names: &SnapshotNames,
    ) -> Self {
        let contributions = explanation.contributions();
        let mut by_light: BTreeMap<LightSource, Vec<DVec3>> = BTreeMap::new();
        let (mut by_bounces, mut by_itself, mut by_asking) = (Vec::new(), DVec3::ZERO, DVec3::ZERO);
        for part in &contributions {
            let bounces = part.bounces as usize;
            for row in [by_light.entry(part.source).or_default(), &mut by_bounces] {
                row.resize(row.len().max(bounces + 1), DVec3::ZERO);
                row[bounces] += part.radiance;
            }
            match part.found_by {
                FoundBy::Itself => by_itself += part.radiance,
                FoundBy::Asking => by_asking += part.radiance,
            }
        }
        let row = |(source, by_bounces): (&LightSource, &Vec<DVec3>)| LightRow {
            name: names.source(*source),
            by_bounces: by_bounces.clone(),
        };
        let mut lights: Vec<LightRow> = by_light.iter().map(row).collect();
        lights.sort_by(|a, b| brightness(b.total()).total_cmp(&brightness(a.total())));
        let ways = explanation.paths.iter().map(|path| PathRecord {
            sample: path.sample,
            radiance: path.radiance.as_dvec3(),
            origin: names.origin + path.origin.as_dvec3(),
            stops: (path.vertices.iter())
                .map(|vertex| Stop {
                    end: names.end(vertex.place),
                    throughput: vertex.throughput.as_dvec3(),
                    radiance: vertex.radiance,
                    asked: vertex.asked.map(|asked| (names.end(asked.place), asked.radiance)),
                })
                .collect(),
        });
        Self {
            pixel: explanation.pixel,
            film_size: explanation.film_size,
            samples: explanation.samples.clone(),
            n_bad: explanation.n_bad(),
            lights,
            by_bounces,
            by_itself,
            by_asking,
            mean: explanation.mean(),
            deviation: explanation.deviation(),
            light_traced,
            ways: ways.collect(),
            seen: seen.map(|seen| names.seen(&seen)),
        }
    }

    /// Mean radiance including light paths.
    pub fn total(&self) -> DVec3 {
        self.mean + self.light_traced.unwrap_or_default()
    }

    /// Directly visible, after one bounce, after more.
    pub fn parts(&self) -> [DVec3; 3] {
        parts(&self.by_bounces)
    }
}

/// Luminance of linear Rec. 709.
pub fn brightness(radiance: DVec3) -> f64 {
    radiance.dot(DVec3::new(0.2126, 0.7152, 0.0722))
}

/// State of pixel explanations.
#[derive(Resource, Default)]
pub struct Explaining {
    /// The requested position, in fractions of the image.
    pub(crate) wanted: Option<(f64, f64)>,
    waiting: Option<PendingExplanation>,
    /// The last answer, until another question is asked or it is removed.
    pub story: Option<PixelStory>,
}

/// A pending question.
struct PendingExplanation {
    // A receiver is not `Sync`, but a resource must be.
    answer: Mutex<Receiver<Answer>>,
    generation: u64,
    names: SnapshotNames,
    place: (f64, f64),
}

impl Explaining {
    /// Number of samples that are explained.
    pub const SAMPLES: u32 = 64;

    pub(crate) fn is_idle(&self) -> bool {
        self.wanted.is_none() && self.waiting.is_none()
    }

    pub(crate) fn forget(&mut self) {
        *self = Self::default();
    }
}

/// Sends questions to the workers, and takes their answers.
///
/// Reads [`RenderState`]; writes [`Explaining`], [`Status`], and to the [`Renderer`]. Runs after the workers got their
/// job.
pub fn explain_pixel(
    shown: Res<RenderState>,
    renderer: Res<Renderer>,
    clock: Res<Clock>,
    mut explaining: ResMut<Explaining>,
    mut status: ResMut<Status>,
) {
    if explaining.wanted.is_none() && explaining.waiting.is_none() {
        return;
    }
    let explaining = &mut *explaining;
    if let Some(waiting) = &explaining.waiting {
        let answer = waiting.answer.lock().map_or(Err(TryRecvError::Disconnected), |answer| answer.try_recv());
        match answer {
            Ok(Answer { explanation, light_traced, seen }) => {
                explaining.story = Some(PixelStory::new(&explanation, light_traced, seen, &waiting.names));
                explaining.waiting = None;
            }
            Err(TryRecvError::Empty) => {}
            Err(TryRecvError::Disconnected) => {
                // The view has changed meanwhile: asks again for the same position in the new one.
                let outdated = waiting.generation != shown.generation();
                explaining.wanted = explaining.wanted.or(outdated.then_some(waiting.place));
                explaining.waiting = None;
            }
        }
    }
    let (Some(place), Some(extraction)) = (explaining.wanted.take(), &shown.extraction) else { return };
    if shown.integrator() != Integrator::Path {
        status.say(clock.0, MessageKind::Note, "Phong follows no light paths to explain: choose the integrator `path`");
        return;
    }
    let generation = shown.generation();
    let question = Question { generation, x: place.0, y: place.1, n_samples: Explaining::SAMPLES };
    let names = SnapshotNames::of(extraction, &shown.inputs);
    let answer = Mutex::new(renderer.0.ask(question));
    explaining.waiting = Some(PendingExplanation { answer, generation, names, place });
}
