//! The time line: which moment of an animation is shown, whether it plays, its keys and its shutter.

use crate::frame::{Command, CurrentScene, Edit, Property, Selection, Session};
use crate::scene::animation::{Interpolation, Shutter, Track};
use crate::scene::{Animation, Moment};
use crate::viewer::keys::{Action, with_key};
use crate::viewer::panel::state::{Around, Asked};
use crate::viewer::panel::widgets::{choices, number, row_with_hint, rows, slider};
use egui::Ui;
use glam::DVec3;

/// Seconds that can be chosen where there are no keys yet.
const FIRST_SECONDS: f64 = 5.0;
/// Keys this near to each other are one, seconds.
const SAME_TIME: f64 = 1e-6;

/// Seconds of the animations of the open glTF model, which is in the world only at a moment, not in its stored pose.
fn length_of_model(session: &Session) -> Option<f64> {
    session.world().get_resource::<CurrentScene>()?.0.model_length()
}

/// Whether there is anything to play.
pub fn can_play(session: &Session) -> bool {
    session.world().get_resource::<Animation>().is_some_and(Animation::moves) || length_of_model(session).is_some()
}

/// The time line of the animation of the scene or model; a scene without one has a time line to set keys on.
pub fn time_line(ui: &mut Ui, session: &Session, around: &Around, asked: &mut Asked) {
    let (animation, of_model) = (session.world().get_resource::<Animation>(), length_of_model(session));
    let moves = animation.is_some_and(Animation::moves);
    let is_stored_pose = of_model.is_some() && !moves;
    let length = if moves { animation.map_or(0.0, Animation::length) } else { of_model.unwrap_or(0.0) };
    let shown = session.world().get_resource::<Moment>().map_or(0.0, |moment| moment.0);
    let at = if is_stored_pose { 0.0 } else { shown };
    let fps = animation.map_or(24.0, |animation| animation.fps);
    let to_frame = |seconds: f64| (seconds * fps).round() / fps;
    if length > 0.0 {
        ui.horizontal(|ui| {
            let (label, hint) =
                if around.playing { ("Pause", "stop the animation") } else { ("Play", "play the animation") };
            if ui.button(label).on_hover_text(hint).clicked() {
                asked.action = Some(Action::TogglePlay);
            }
            if let Some(animation) = animation.filter(|animation| animation.moves()) {
                let frame = format!("frame {:.1} / {}", at * fps, animation.n_frames().saturating_sub(1));
                ui.weak(frame).on_hover_text("as numbered by render --frames");
            }
        });
    }
    rows(ui, "moment", |ui| {
        let hint = "seconds of the animation; stops at whole frames, or type any time";
        row_with_hint(ui, "time", hint, |ui| {
            let end = if length > 0.0 { length } else { FIRST_SECONDS };
            if let Some(seconds) = slider(ui, at, 0.0..=end.max(at), false) {
                let is_dragged = ui.input(|input| input.pointer.any_down() || input.pointer.any_released());
                let seconds = if is_dragged { to_frame(seconds) } else { seconds };
                asked.send(Command::SetMoment { seconds: Some(seconds) });
            }
        });
        if of_model.is_some() {
            row_with_hint(ui, "pose", "of the animations at that time, or as the file stores it", |ui| {
                if let Some(stored) = choices(ui, Some(is_stored_pose), [(true, "stored"), (false, "animated")]) {
                    asked.send(Command::SetMoment { seconds: (!stored).then_some(at) });
                }
            });
        }
        keys(ui, session, around, animation, at, asked);
        if !is_stored_pose {
            settings(ui, animation, length, asked);
        }
    });
}

/// Setting, deleting and finding keys.
fn keys(ui: &mut Ui, session: &Session, around: &Around, animation: Option<&Animation>, at: f64, asked: &mut Asked) {
    let key_of = |text: &str, camera: bool| {
        with_key(around.navigation, text, &Action::Send(Command::Edit(Edit::SetKeys { camera })))
    };
    let hint = "at this time: what was changed, else the selection, else the camera";
    row_with_hint(ui, "keys", hint, |ui| {
        ui.horizontal(|ui| {
            if ui.button("Set key").on_hover_text(key_of(hint, false)).clicked() {
                asked.edit(Edit::SetKeys { camera: false });
            }
            if ui.button("Set view").on_hover_text(key_of("key of the camera at this time", true)).clicked() {
                asked.edit(Edit::SetKeys { camera: true });
            }
        })
    });
    let Some(animation) = animation.filter(|animation| !animation.tracks.is_empty()) else { return };
    let times = animation.key_times();
    let before = times.iter().rev().find(|time| **time < at - SAME_TIME);
    let after = times.iter().find(|time| **time > at + SAME_TIME);
    let is_at_key = times.iter().any(|time| (time - at).abs() <= SAME_TIME);
    row_with_hint(ui, "", "", |ui| {
        ui.horizontal(|ui| {
            for (label, hint, time) in [("<", "previous key", before), (">", "next key", after)] {
                let button = egui::Button::new(label);
                if ui.add_enabled(time.is_some(), button).on_hover_text(hint).clicked() {
                    asked.send(Command::SetMoment { seconds: time.copied() });
                }
            }
            let hint = "the keys at this time: of the selection, or all if nothing is selected";
            if ui.add_enabled(is_at_key, egui::Button::new("Delete")).on_hover_text(hint).clicked() {
                asked.edit(Edit::DeleteKeys);
            }
        })
    });
    let hint = "between two keys: of the selection, or of everything if nothing is selected";
    let selected = &session.world().resource::<Selection>().0;
    let is_meant =
        |track: &&Track| selected.is_empty() || track.channel.entity().is_some_and(|entity| selected.contains(&entity));
    let mut meant = animation.tracks.iter().filter(is_meant).map(|track| track.curve.interpolation);
    let Some(first) = meant.next() else { return };
    let of_all = meant.all(|other| other == first).then_some(first);
    row_with_hint(ui, "between", hint, |ui| {
        let all = [Interpolation::Linear, Interpolation::Smooth, Interpolation::Held];
        if let Some(how) = choices(ui, of_all, all.map(|how| (how, how.name()))) {
            asked.edit(Edit::Interpolate { how });
        }
    });
}

/// Shutter, duration and rate.
fn settings(ui: &mut Ui, animation: Option<&Animation>, length: f64, asked: &mut Asked) {
    let fps = animation.map_or(24.0, |animation| animation.fps);
    let share = match animation.map(|animation| animation.shutter).unwrap_or_default() {
        Shutter::Share(share) => share,
        Shutter::Seconds(seconds) => (seconds * fps).min(1.0),
    };
    let mut set = |property: Property, value: f64| {
        asked.edit(Edit::Set { id: 0, property, value: DVec3::splat(value) });
    };
    let hint = "share of the time of a frame during which the shutter is open: motion blur; 0.5 is 180 degrees";
    row_with_hint(ui, "shutter", hint, |ui| {
        if let Some(share) = slider(ui, share, 0.0..=1.0, false) {
            set(Property::Shutter, share);
        }
    });
    row_with_hint(ui, "duration", "seconds; 0: up to the last key", |ui| {
        let duration = animation.and_then(|animation| animation.duration);
        ui.horizontal(|ui| {
            if let Some(seconds) = number(ui, duration.unwrap_or(0.0), 0.05, 0.0..=1e6, " s") {
                set(Property::Duration, seconds);
            }
            if duration.is_none() && length > 0.0 {
                ui.weak(format!("to the last key, {length:.2} s"));
            }
        })
    });
    row_with_hint(ui, "frames", "per second", |ui| {
        if let Some(fps) = number(ui, fps, 0.1, 1e-3..=1e4, " / s") {
            set(Property::FramesPerSecond, fps);
        }
    });
}
