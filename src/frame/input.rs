//! Carries out what a person asks for: commands become changes of components and resources.

use super::navigation::{self, Rig, Turning};
use super::saving::Saving;
use super::status::{MessageKind, Status};
use super::systems::{Around, Clock, Paused, PictureSize, Renderer, Shown, Threads};
use super::{Command, beside::Beside};
use crate::geometry::Ray;
use crate::render::ToneCurve;
use crate::scene::file::check_film_size;
use crate::scene::{Developing, Lens, Ordinal, Projection, Rendering, SceneSource, UpAxis, View};
use bevy_ecs::prelude::{DetectChangesMut, Entity, Mut, Query, Res, ResMut, Resource};
use bevy_ecs::system::SystemParam;
use glam::Vec3;

/// Commands that wait for the next frame, in order.
#[derive(Resource, Default)]
pub struct CommandQueue(pub Vec<Command>);

/// Which axis of models points up; guessed when not given.
#[derive(Resource, Clone, Copy, Debug, Default)]
pub struct ModelUp(pub Option<UpAxis>);

type CameraParts = (Entity, Option<&'static Ordinal>, &'static mut View, &'static mut Projection, &'static mut Lens);

/// Everything that commands may change.
#[derive(SystemParam)]
pub struct Desk<'w, 's> {
    cameras: Query<'w, 's, CameraParts>,
    developing: ResMut<'w, Developing>,
    rendering: ResMut<'w, Rendering>,
    size: ResMut<'w, PictureSize>,
    paused: ResMut<'w, Paused>,
    threads: ResMut<'w, Threads>,
    around: ResMut<'w, Around>,
    shown: ResMut<'w, Shown>,
    status: ResMut<'w, Status>,
    beside: Res<'w, Beside>,
    saving: ResMut<'w, Saving>,
    renderer: Res<'w, Renderer>,
    clock: Res<'w, Clock>,
    up: Res<'w, ModelUp>,
}

/// Empties the queue into the world. Equal values mark nothing as changed.
///
/// Reads [`CommandQueue`]; writes the first camera, settings, size; starts loads.
pub fn input(mut queue: ResMut<CommandQueue>, mut desk: Desk) {
    for command in queue.0.drain(..) {
        desk.carry_out(command);
    }
}

impl Desk<'_, '_> {
    fn carry_out(&mut self, command: Command) {
        let surroundings = self.around.surroundings(self.size.aspect());
        if let Some(rig) = self.rig()
            && let Some(steered) = navigation::steer(&rig, &command, &surroundings)
        {
            self.set_rig(steered);
            return;
        }
        match command {
            Command::PivotAt { x, y } => {
                if let (Some(rig), Some(depth)) = (self.rig(), self.depth_at(x, y)) {
                    self.set_rig(Rig { view: View { pivot_distance: depth, ..rig.view }, ..rig });
                }
            }
            Command::FocusAt { x, y } => {
                if let (Some(rig), Some(depth)) = (self.rig(), self.depth_at(x, y)) {
                    self.set_rig(Rig { lens: navigation::focus_at(&rig.lens, depth), ..rig });
                }
            }
            Command::ToggleTurntable => {
                self.around.turning = match self.around.turning {
                    Turning::Turntable => Turning::Free,
                    Turning::Free => Turning::Turntable,
                };
            }
            Command::AdjustExposure { stops } => {
                let stops = self.developing.0.exposure_stops + stops;
                self.set_exposure(stops);
            }
            Command::SetExposure { stops } => self.set_exposure(stops),
            Command::SetToneCurve(curve) => self.set_tone_curve(curve),
            Command::NextToneCurve => {
                let next = match self.developing.0.tone_curve {
                    ToneCurve::Linear => ToneCurve::Neutral,
                    ToneCurve::Neutral => ToneCurve::Filmic,
                    ToneCurve::Filmic => ToneCurve::Linear,
                };
                self.set_tone_curve(next);
            }
            Command::Resize { width, height } => self.resize(PictureSize { width, height }),
            Command::Pause => drop(self.paused.set_if_neq(Paused(true))),
            Command::Resume => drop(self.paused.set_if_neq(Paused(false))),
            Command::Restart => self.shown.restart = Some("asked for"),
            Command::SetIntegrator(integrator) => {
                let settings = crate::render::RenderSettings { integrator, ..self.rendering.0 };
                self.rendering.set_if_neq(Rendering(settings));
            }
            Command::SetThreads { threads } => drop(self.threads.set_if_neq(Threads(threads.min(1024)))),
            Command::Open { path } => match SceneSource::parse(&path.to_string_lossy()) {
                Ok(source) => self.beside.load(source, self.up.0, self.size.aspect(), self.renderer.0.pool()),
                Err(error) => self.status.say(self.clock.0, MessageKind::Error, error.to_string()),
            },
            Command::SaveScene { path } => self.saving.requests.push(path),
            // Everything else steers, and there is no camera to be steered.
            _ => {}
        }
    }

    /// The parts of the first camera.
    fn camera(&mut self) -> Option<(Mut<'_, View>, Mut<'_, Projection>, Mut<'_, Lens>)> {
        let rank = |rank: Option<&Ordinal>| rank.map_or(u32::MAX, |rank| rank.0);
        self.cameras
            .iter_mut()
            .min_by_key(|(entity, ordinal, ..)| (rank(*ordinal), *entity))
            .map(|(_, _, view, projection, lens)| (view, projection, lens))
    }

    fn rig(&mut self) -> Option<Rig> {
        // Reading through `Mut` marks nothing.
        let (view, projection, lens) = self.camera()?;
        Some(Rig { view: *view, projection: *projection, lens: *lens })
    }

    fn set_rig(&mut self, rig: Rig) {
        if let Some((mut view, mut projection, mut lens)) = self.camera() {
            view.set_if_neq(rig.view);
            projection.set_if_neq(rig.projection);
            lens.set_if_neq(rig.lens);
        }
    }

    fn set_exposure(&mut self, stops: f32) {
        /// Beyond this, everything is black or white.
        const LIMIT: f32 = 64.0;
        if !stops.is_nan() {
            let exposure_stops = stops.clamp(-LIMIT, LIMIT);
            let display = crate::render::Display { exposure_stops, ..self.developing.0 };
            self.developing.set_if_neq(Developing(display));
        }
    }

    fn set_tone_curve(&mut self, tone_curve: ToneCurve) {
        let display = crate::render::Display { tone_curve, ..self.developing.0 };
        self.developing.set_if_neq(Developing(display));
    }

    fn resize(&mut self, size: PictureSize) {
        match check_film_size(size.width.max(1), size.height.max(1)) {
            Ok(()) => drop(self.size.set_if_neq(size)),
            Err(message) => self.status.say(self.clock.0, MessageKind::Error, message),
        }
    }

    /// Metres along the view axis to what is at this place in the picture (0..1 from the upper left), if anything.
    fn depth_at(&mut self, x: f64, y: f64) -> Option<f64> {
        let aspect = self.size.aspect() as f32;
        let extraction = self.shown.extraction.as_ref()?;
        let camera = extraction.snapshot.camera;
        let (across, upwards) = (2.0 * x as f32 - 1.0, 1.0 - 2.0 * y as f32);
        let dir = camera.forward
            + camera.right * (across * aspect * camera.tan_half_vfov)
            + camera.up * (upwards * camera.tan_half_vfov);
        let dir = if dir.is_finite() { dir.normalize_or_zero() } else { Vec3::ZERO };
        if dir == Vec3::ZERO {
            return None;
        }
        let hit = extraction.snapshot.geometry.tree.closest_hit(&Ray::new(camera.eye, dir))?;
        let depth = f64::from(hit.t * dir.dot(camera.forward));
        (depth > 0.0 && depth.is_finite()).then_some(depth)
    }
}
