//! The time line: which moment of an animation is shown, and whether it plays.

use super::widgets::{row_with_hint, rows, slider};
use super::{Around, Asked};
use crate::frame::{Command, CurrentScene, Session};
use crate::scene::{Animation, Moment};
use egui::Ui;

/// The animation that is in the world.
fn animation_of(session: &Session) -> Option<&Animation> {
    session.world().get_resource::<Animation>().filter(|animation| animation.moves())
}

/// Seconds of the animations of the open glTF model, which is in the world only at a moment, not in its stored pose.
fn length_of_model(session: &Session) -> Option<f64> {
    session.world().get_resource::<CurrentScene>()?.0.facts.as_ref()?.animation_length
}

/// Whether there is anything to play.
pub fn exists(session: &Session) -> bool {
    animation_of(session).is_some() || length_of_model(session).is_some()
}

/// The time line of the animation of the scene or model, if it has one.
pub fn time_line(ui: &mut Ui, session: &Session, around: &Around, asked: &mut Asked) {
    let (animation, of_model) = (animation_of(session), length_of_model(session));
    let Some(length) = animation.map(Animation::length).or(of_model) else { return };
    // `None` is the stored pose of a model.
    let at = animation.map(|_| session.world().resource::<Moment>().0);
    ui.horizontal(|ui| {
        let (label, hint) =
            if around.playing { ("Pause", "stop the animation") } else { ("Play", "play the animation") };
        if ui.button(label).on_hover_text(hint).clicked() {
            asked.toggle_play = true;
            if at.is_none() && !around.playing {
                asked.send(Command::SetMoment { seconds: Some(0.0) });
            }
        }
        if let Some((animation, at)) = animation.zip(at) {
            let frame = format!("frame {:.1} of {}", at * animation.fps, animation.n_frames());
            ui.weak(frame).on_hover_text("as numbered by render --frames");
        }
    });
    rows(ui, "moment", |ui| {
        row_with_hint(ui, "time", "seconds of the animation", |ui| {
            if let Some(seconds) = slider(ui, at.unwrap_or(0.0), 0.0..=length.max(1e-3), false) {
                asked.send(Command::SetMoment { seconds: Some(seconds) });
            }
        });
        if of_model.is_some() {
            row_with_hint(ui, "pose", "of the animations at that time, or as the file stores it", |ui| {
                ui.horizontal(|ui| {
                    for (label, seconds) in [("stored", None), ("animated", Some(at.unwrap_or(0.0)))] {
                        let is_chosen = at.is_none() == seconds.is_none();
                        if ui.selectable_label(is_chosen, label).clicked() && !is_chosen {
                            asked.send(Command::SetMoment { seconds });
                        }
                    }
                })
            });
        }
    });
}
