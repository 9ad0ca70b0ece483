//! Executes commands: they become changes of components and resources.

use crate::format::bounds::MOST_STOPS;
use crate::frame::core::rig::{Rig, Turning};
use crate::frame::core::status::{MessageKind, Status};
use crate::frame::edit::EditQueue;
use crate::frame::focus::{Focus, FocusTarget};
use crate::frame::navigation;
use crate::frame::saving::Saving;
use crate::frame::scene_bounds::SceneBounds;
use crate::frame::scene_cameras::{beside, cameras_of};
use crate::frame::state::background::BackgroundTasks;
use crate::frame::state::explain::Explaining;
use crate::frame::state::resources::{
    Clock, CurrentScene, MAX_THREADS, Paused, PictureSize, PlayRange, RenderRegion, RenderState, Renderer, StopAt,
    Threads, ViewMode, WantedMoment, WindowHidden,
};
use crate::frame::state::selection::{Picked, Selection, pick};
use crate::frame::steer::steer;
use crate::frame::views::{Bookmarks, ViewTrail};
use crate::frame::walls::{around_walls, before_wall, frame_in_sight, is_in_room, within_walls};
use crate::frame::{Command, Projector, ViewOptions};
use crate::render::{Display, Inspection, RenderSettings, ToneCurve};
use crate::scene::{DisplaySettings, Lens, ModelChoice, Ordinal, Projection, Rendering, SceneSource, UpAxis, View};
use bevy_ecs::prelude::{DetectChangesMut, Entity, Mut, Query, Res, ResMut, Resource};
use bevy_ecs::system::SystemParam;
use glam::{DVec2, DVec3};

/// Commands for the next frame, in order.
#[derive(Resource, Default)]
pub struct CommandQueue(pub Vec<Command>);

/// Up axis of models; guessed if not given.
#[derive(Resource, Clone, Copy, Debug, Default)]
pub struct ModelUp(pub Option<UpAxis>);

type CameraParts = (Entity, Option<&'static Ordinal>, &'static mut View, &'static mut Projection, &'static mut Lens);

/// Everything that commands may change.
#[derive(SystemParam)]
pub struct CommandParams<'w, 's> {
    cameras: Query<'w, 's, CameraParts>,
    display_settings: ResMut<'w, DisplaySettings>,
    rendering: ResMut<'w, Rendering>,
    size: ResMut<'w, PictureSize>,
    paused: ResMut<'w, Paused>,
    threads: ResMut<'w, Threads>,
    hidden: ResMut<'w, WindowHidden>,
    stop_at: ResMut<'w, StopAt>,
    view_mode: ResMut<'w, ViewMode>,
    explaining: ResMut<'w, Explaining>,
    brush: ResMut<'w, RenderRegion>,
    focus: ResMut<'w, Focus>,
    bookmarks: ResMut<'w, Bookmarks>,
    trail: ResMut<'w, ViewTrail>,
    edits: ResMut<'w, EditQueue>,
    selection: Res<'w, Selection>,
    around: ResMut<'w, SceneBounds>,
    shown: ResMut<'w, RenderState>,
    status: ResMut<'w, Status>,
    beside: Res<'w, BackgroundTasks>,
    saving: ResMut<'w, Saving>,
    moment: ResMut<'w, WantedMoment>,
    range: ResMut<'w, PlayRange>,
    renderer: Res<'w, Renderer>,
    scene: Option<Res<'w, CurrentScene>>,
    clock: Res<'w, Clock>,
    up: Res<'w, ModelUp>,
}

/// Executes all queued commands. Equal values mark nothing as changed.
///
/// Reads [`CommandQueue`]; writes the first camera, settings, size; starts loads.
pub fn input(mut queue: ResMut<CommandQueue>, mut desk: CommandParams) {
    for command in queue.0.drain(..) {
        desk.carry_out(command);
    }
    if let Some(rig) = desk.rig() {
        let now = desk.clock.0;
        desk.trail.see(rig, now);
    }
}

impl CommandParams<'_, '_> {
    fn carry_out(&mut self, command: Command) {
        if let Err(bad) = command.check() {
            self.status.say(self.clock.0, MessageKind::Error, bad);
            return;
        }
        let surroundings = self.around.surroundings(self.size.aspect());
        if let Some(rig) = self.rig()
            && let Some(steered) = steer(&self.turning_in_perspective(rig, &command), &command, &surroundings)
        {
            // Limits that also hold for recordings: cameras that cannot be rendered are rejected.
            if steered.check().is_err() {
                return;
            }
            // Focusing manually ends focus tracking.
            if steered.lens.focus_distance != rig.lens.focus_distance {
                self.focus.set_if_neq(Focus::default());
            }
            let view = self.shown.extraction.as_ref().map(|scene| match command {
                Command::ViewFrom(_) | Command::ViewFromBehind => within_walls(scene, &rig.view, steered.view),
                Command::Dolly { .. } => before_wall(scene, &rig.view, steered.view),
                Command::Orbit { .. } => {
                    let reach = self.around.reach.filter(|(view, _)| *view == rig.view);
                    let reach = reach.map_or(steered.view.pivot_distance, |(_, reach)| reach);
                    let view = around_walls(scene, &rig.view, steered.view, reach);
                    self.around.reach = (view.pivot_distance < reach).then_some((view, reach));
                    view
                }
                _ => steered.view,
            });
            self.set_rig(Rig { view: view.unwrap_or(steered.view), ..steered });
            return;
        }
        match command {
            Command::PivotAt { x, y } => {
                if let (Some(rig), Some(picked)) = (self.rig(), self.pick(x, y)) {
                    let depth = picked.depth;
                    self.set_rig(Rig { view: View { pivot_distance: depth, ..rig.view }, ..rig });
                }
            }
            Command::PivotOnMiddle => {
                let around = navigation::box_around(self.what_to_frame());
                if let (Some(rig), Some((min, max))) = (self.rig(), around) {
                    let depth = (0.5 * (min + max) - rig.view.eye).dot(rig.view.forward);
                    let in_room = self.shown.extraction.as_ref().is_some_and(|scene| is_in_room(scene, &rig.view));
                    if depth > 0.0 && (!in_room || !self.selection.0.is_empty()) {
                        self.set_rig(Rig { view: View { pivot_distance: depth, ..rig.view }, ..rig });
                    }
                }
            }
            Command::PaceAt { x, y } => self.around.pace = self.pick(x, y).map(|picked| picked.depth),
            Command::FocusAt { x, y } => {
                if let (Some(rig), Some(picked)) = (self.rig(), self.pick(x, y)) {
                    self.set_rig(Rig { lens: navigation::focus_at(&rig.lens, picked.depth), ..rig });
                    let target = match self.focus.target {
                        FocusTarget::Camera => FocusTarget::Camera,
                        _ => self.stuck_to(picked.entity, picked.point),
                    };
                    *self.focus = Focus { target, last: Some((picked.entity, picked.point)) };
                }
            }
            Command::FrameAll => {
                if let Some(rig) = self.rig() {
                    let points = self.what_to_frame();
                    let scene = self.shown.extraction.as_ref().filter(|_| !self.selection.0.is_empty());
                    let (framed, is_other_side) = match scene {
                        Some(scene) => frame_in_sight(scene, &rig, self.size.aspect(), &points),
                        None => (navigation::frame_rig(&rig, self.size.aspect(), &points), false),
                    };
                    if is_other_side {
                        self.note("framed from a side on which it is not hidden".to_owned());
                    }
                    let lens = navigation::focus_at(&rig.lens, framed.view.pivot_distance);
                    self.set_rig(Rig { lens, ..framed });
                    if lens.enabled && lens != rig.lens {
                        self.note("focus on what is framed".to_owned());
                    }
                }
            }
            Command::SetMoment { seconds } => *self.moment = WantedMoment { at: Some(seconds), advance: 0.0 },
            Command::AdvanceMoment { seconds } => self.moment.advance += seconds,
            Command::SetPlayRange { seconds } => *self.range = PlayRange(seconds),
            Command::SetTarget(target) => drop(self.stop_at.set_if_neq(StopAt(target))),
            Command::SetWindowHidden { hidden } => drop(self.hidden.set_if_neq(WindowHidden(hidden))),
            Command::SetInspection(inspection) => {
                self.set_view(ViewOptions { inspection, ..self.view_mode.0 });
            }
            Command::SetDenoising(denoising) => {
                self.set_view(ViewOptions { denoising, ..self.view_mode.0 });
            }
            Command::SetDenoiseFilter(filter) => {
                self.set_view(ViewOptions { filter, ..self.view_mode.0 });
            }
            Command::NextDenoising => {
                let denoising = self.view_mode.0.denoising.next();
                self.set_view(ViewOptions { inspection: Inspection::Picture, denoising, ..self.view_mode.0 });
            }
            Command::SetSharpZone { shown } => {
                self.set_view(ViewOptions { sharp_zone: shown, ..self.view_mode.0 });
            }
            Command::ExplainAt { x, y } => self.explaining.wanted = Some((x, y)),
            Command::ForgetExplanation => self.explaining.forget(),
            Command::SetRegion { region } => drop(self.brush.set_if_neq(RenderRegion(region))),
            Command::ToggleFocusLock => self.toggle_focus_lock(),
            Command::FocusFollows { x, y } if x.is_finite() && y.is_finite() => {
                if !matches!(self.focus.target, FocusTarget::Cursor(_)) {
                    self.note("focus follows the mouse".to_owned());
                }
                self.focus.target = FocusTarget::Cursor([x, y]);
            }
            Command::SetBookmark { slot } => {
                if let Some(rig) = self.rig()
                    && self.bookmarks.set(slot, rig)
                {
                    self.note(format!("bookmark {slot} is this view"));
                }
            }
            Command::GoToBookmark { slot } => match self.bookmarks.get(slot) {
                Some(rig) => self.set_rig(rig),
                None => self.note(format!("bookmark {slot} is empty: Ctrl+{slot} saves this view")),
            },
            Command::SetBookmarks(bookmarks) => drop(self.bookmarks.set_if_neq(*bookmarks)),
            Command::PreviousView => match self.trail.previous() {
                Some(rig) => self.set_rig(rig),
                None => self.note("no previous view".to_owned()),
            },
            Command::NextView => match self.trail.forth() {
                Some(rig) => self.set_rig(rig),
                None => self.note("no next view".to_owned()),
            },
            Command::NextCamera => self.look_through_camera(false),
            Command::PreviousCamera => self.look_through_camera(true),
            Command::Edit(edit) => self.edits.0.push(edit),
            Command::ToggleTurntable => {
                self.around.turning = match self.around.turning {
                    Turning::Turntable => Turning::Free,
                    Turning::Free => Turning::Turntable,
                };
            }
            Command::AdjustExposure { stops } => {
                let stops = self.display_settings.0.exposure_stops + stops;
                self.set_exposure(stops);
            }
            Command::SetExposure { stops } => self.set_exposure(stops),
            Command::SetToneCurve(curve) => self.set_tone_curve(curve),
            Command::NextToneCurve => {
                let next = match self.display_settings.0.tone_curve {
                    ToneCurve::Linear => ToneCurve::Neutral,
                    ToneCurve::Neutral => ToneCurve::Filmic,
                    ToneCurve::Filmic => ToneCurve::Linear,
                };
                self.set_tone_curve(next);
            }
            Command::Resize { width, height } => self.resize(PictureSize { width, height }),
            Command::Pause => drop(self.paused.set_if_neq(Paused(true))),
            Command::Resume => drop(self.paused.set_if_neq(Paused(false))),
            Command::Restart => self.shown.restart = Some("requested"),
            Command::SetIntegrator(integrator) => {
                self.set_rendering(RenderSettings { integrator, ..self.rendering.0 });
            }
            Command::SetAllocation(allocation) => {
                self.set_rendering(RenderSettings { allocation, ..self.rendering.0 });
            }
            Command::SetThreads { threads } => drop(self.threads.set_if_neq(Threads(threads.min(MAX_THREADS)))),
            Command::Open { path } => match SceneSource::parse(&path) {
                Ok(source) => {
                    let choice = ModelChoice::default();
                    let (how, aspect, pool) = ((self.up.0, None), self.size.aspect(), self.renderer.0.pool());
                    self.beside.load(source, how, choice, aspect, pool, None);
                }
                Err(error) => self.status.say(self.clock.0, MessageKind::Error, error.to_string()),
            },
            Command::SaveScene { path } => self.saving.requests.push(path),
            // All other commands move the camera, and there is none.
            _ => {}
        }
    }

    /// Returns a camera with parallel rays for a view from a side as one in perspective, if the command turns it.
    fn turning_in_perspective(&mut self, rig: Rig, command: &Command) -> Rig {
        let has_parallel = rig.projection.orthographic_height.is_some();
        // Another view may have parallel rays of its own.
        let was_side_view = has_parallel && self.around.side_view == Some(rig.view.forward);
        match command {
            Command::ViewFrom(side) => {
                let forward = navigation::view_from(&rig.view, *side).forward;
                self.around.side_view = (was_side_view || !has_parallel).then_some(forward);
            }
            Command::SetProjection(_) => self.around.side_view = None,
            Command::Turn { .. } | Command::Orbit { .. } if was_side_view => {
                let turned = navigation::in_perspective(&rig);
                return match &self.shown.extraction {
                    Some(scene) => Rig { view: within_walls(scene, &rig.view, turned.view), ..turned },
                    None => turned,
                };
            }
            _ => {}
        }
        rig
    }

    /// The components of the first camera.
    fn camera(&mut self) -> Option<(Mut<'_, View>, Mut<'_, Projection>, Mut<'_, Lens>)> {
        let rank = |rank: Option<&Ordinal>| rank.map_or(u32::MAX, |rank| rank.0);
        self.cameras
            .iter_mut()
            .min_by_key(|(entity, ordinal, ..)| (rank(*ordinal), *entity))
            .map(|(_, _, view, projection, lens)| (view, projection, lens))
    }

    fn rig(&mut self) -> Option<Rig> {
        // Reading through `Mut` does not mark a change.
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

    /// Looks through the camera of the scene after or before the present one.
    fn look_through_camera(&mut self, backwards: bool) {
        let cameras = self.scene.as_deref().map(|scene| cameras_of(&scene.0)).unwrap_or_default();
        let Some(rig) = self.rig() else { return };
        if cameras.len() < 2 && cameras.first().is_none_or(|camera| camera.rig.view == rig.view) {
            self.note("the scene has no other camera".to_owned());
        } else if let Some(camera) = beside(cameras, &rig, backwards) {
            self.set_rig(camera.rig);
            self.note(camera.announcement());
        }
    }

    fn set_view(&mut self, options: ViewOptions) {
        self.view_mode.set_if_neq(ViewMode(options));
    }

    fn set_rendering(&mut self, settings: RenderSettings) {
        self.rendering.set_if_neq(Rendering(settings));
    }

    fn set_exposure(&mut self, stops: f32) {
        if !stops.is_nan() {
            let exposure_stops = stops.clamp(-MOST_STOPS, MOST_STOPS);
            let display = Display { exposure_stops, ..self.display_settings.0 };
            self.display_settings.set_if_neq(DisplaySettings(display));
        }
    }

    fn set_tone_curve(&mut self, tone_curve: ToneCurve) {
        let display = Display { tone_curve, ..self.display_settings.0 };
        self.display_settings.set_if_neq(DisplaySettings(display));
    }

    fn resize(&mut self, size: PictureSize) {
        self.size.set_if_neq(size);
    }

    /// Returns what is at this position in the image (0..1 from the upper left), if anything.
    fn pick(&self, x: f64, y: f64) -> Option<Picked> {
        pick(self.shown.extraction.as_ref()?, x, y, self.size.aspect())
    }

    /// Outermost points of the selection, or else corners of the boxes of the scene.
    fn what_to_frame(&mut self) -> Vec<DVec3> {
        let RenderState { inputs, extents, .. } = &mut *self.shown;
        let selected: Vec<DVec3> = (self.selection.0.iter())
            .flat_map(|entity| {
                let object = inputs.objects.iter().find(|object| object.entity == *entity);
                let light = inputs.lights.iter().find(|light| light.entity == *entity);
                let outermost = object.map(|object| extents.outermost_of(object)).unwrap_or_default();
                outermost.into_iter().chain(light.map(|light| light.placement.translation))
            })
            .collect();
        if selected.is_empty() { self.around.corners.clone() } else { selected }
    }

    fn toggle_focus_lock(&mut self) {
        let Some(rig) = self.rig() else { return };
        let selected = self.selected_point(&rig);
        self.focus.target = match (self.focus.target, selected.or(self.focus.last)) {
            (FocusTarget::Camera, Some((entity, point))) => self.stuck_to(entity, point),
            (FocusTarget::Camera, None) => {
                FocusTarget::Point(rig.view.eye + rig.view.forward * rig.lens.focus_distance)
            }
            _ => FocusTarget::Camera,
        };
        self.note(match self.focus.target {
            FocusTarget::Camera => "focus at a fixed distance".to_owned(),
            FocusTarget::Point(_) => "focus locked to a point".to_owned(),
            FocusTarget::Object(..) => "focus locked to the object".to_owned(),
            FocusTarget::Cursor(_) => "focus follows the mouse".to_owned(),
        });
    }

    /// What is in focus of the active object: the point that was focused on last, else what is seen in its middle, else
    /// that; `None` without an object, or for one without an end.
    fn selected_point(&mut self, rig: &Rig) -> Option<(Entity, DVec3)> {
        let active = self.selection.active()?;
        if let Some(last) = self.focus.last.filter(|(entity, _)| *entity == active) {
            return Some(last);
        }
        let RenderState { inputs, extents, .. } = &mut *self.shown;
        let object = inputs.objects.iter().find(|object| object.entity == active)?;
        let (min, max) = navigation::box_around(extents.corners_of(object))?;
        let middle = 0.5 * (min + max);
        let place = Projector::new(rig, DVec2::new(self.size.aspect(), 1.0)).place(middle);
        let seen = place.and_then(|place| self.pick(place.x / self.size.aspect(), place.y));
        let point = seen.filter(|picked| picked.entity == active).map_or(middle, |picked| picked.point);
        Some((active, point))
    }

    /// Converts a point of an object to a focus target.
    fn stuck_to(&self, entity: Entity, point: DVec3) -> FocusTarget {
        let object = self.shown.inputs.objects.iter().find(|object| object.entity == entity);
        match object.map(|object| object.placement.affine().inverse().transform_point3(point)) {
            Some(local) if local.is_finite() => FocusTarget::Object(entity, local),
            _ => FocusTarget::Point(point),
        }
    }

    fn note(&mut self, text: String) {
        self.status.say(self.clock.0, MessageKind::Note, text);
    }
}
