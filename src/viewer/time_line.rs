//! The strip of an animation above the bar: play, the frame, its keys, and a button that renders the frames.

use crate::frame::{Command, CurrentScene, Session};
use crate::scene::{Animation, Moment};
use crate::viewer::keys::Action;
use crate::viewer::overlay::{GLASS, KEY, TEXT, TEXT_SIZE};
use egui::{Align, Align2, Color32, Context, FontId, Frame, Layout, Margin, Pos2, Rect, Sense, Stroke, TopBottomPanel};

/// Points.
const HEIGHT: f32 = 30.0;
/// Distance of two labels of frames, points.
const LABELS: f64 = 56.0;

/// An animation as the strip shows it.
#[derive(Clone, Debug, PartialEq)]
pub struct Strip {
    /// Frames per second.
    pub fps: f64,
    /// Number of frames, at least 1.
    pub n: u32,
    /// The frame that is shown; `None` for the pose that a model is stored in.
    pub frame: Option<f64>,
    /// Frames with a key.
    keys: Vec<f64>,
}

/// What is asked for on the strip.
pub enum Ask {
    Play,
    Send(Command),
    Act(Action),
}

impl Strip {
    /// `None` if nothing in the scene moves.
    pub fn of(session: &Session) -> Option<Self> {
        let world = session.world();
        let shown = world.get_resource::<Moment>().map_or(0.0, |moment| moment.0);
        if let Some(animation) = world.get_resource::<Animation>().filter(|animation| animation.moves()) {
            let fps = animation.fps;
            let keys = animation.key_times().iter().map(|time| time * fps).collect();
            return Some(Self { fps, n: animation.n_frames(), frame: Some(shown * fps), keys });
        }
        // A glTF model in its stored pose.
        let length = world.get_resource::<CurrentScene>()?.0.facts.as_ref()?.animation_length?;
        let fps = world.get_resource::<Animation>().map_or(24.0, |animation| animation.fps);
        let n = (length * fps - 1e-6).ceil().max(1.0) as u32;
        Some(Self { fps, n, frame: None, keys: Vec::new() })
    }

    /// Seconds of a frame.
    fn moment(&self, frame: f64) -> Command {
        Command::SetMoment { seconds: Some(frame / self.fps) }
    }

    /// The frame at a place of the track, 0..1; a whole one.
    fn frame_at(&self, place: f64) -> f64 {
        let last = f64::from(self.n.saturating_sub(1));
        (place.clamp(0.0, 1.0) * last).round()
    }

    /// Where a frame is on the track, 0..1.
    fn place_of(&self, frame: f64) -> f64 {
        let last = f64::from(self.n.saturating_sub(1)).max(1.0);
        (frame / last).clamp(0.0, 1.0)
    }

    /// Frames between two labels on a track of this width, points: a step of 1, 2 or 5 times a power of ten.
    fn step(&self, width: f32) -> u32 {
        let wanted = f64::from(self.n) * LABELS / f64::from(width.max(1.0));
        let power = 10f64.powf(wanted.max(1.0).log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|of| of * power).find(|step| *step >= wanted);
        step.unwrap_or(wanted).max(1.0) as u32
    }
}

/// Draws the strip.
pub fn show(context: &Context, strip: &Strip, is_playing: bool) -> Vec<Ask> {
    let mut asked = Vec::new();
    let frame = Frame::NONE.fill(GLASS).inner_margin(Margin::symmetric(5, 0));
    let panel = TopBottomPanel::bottom("time line").frame(frame).exact_height(HEIGHT).show_separator_line(false);
    panel.show(context, |ui| {
        ui.spacing_mut().item_spacing.x = 6.0;
        ui.horizontal_centered(|ui| {
            let (sign, hint) = if is_playing { ("⏸", "pause the animation") } else { ("▶", "play the animation") };
            if ui.button(sign).on_hover_text(hint).clicked() {
                if is_playing {
                    asked.push(Ask::Send(strip.moment(strip.frame.unwrap_or(0.0).round())));
                } else if strip.frame.is_none() {
                    asked.push(Ask::Send(strip.moment(0.0)));
                }
                asked.push(Ask::Play);
            }
            let shown = strip.frame.map_or("–".to_owned(), |frame| format!("{:.0}", frame.floor()));
            let last = strip.n.saturating_sub(1);
            // As wide as the last one, so that the track does not move.
            let width = 18.0 + 15.0 * last.to_string().len() as f32;
            let (label, _) = ui.allocate_exact_size(egui::vec2(width, HEIGHT), Sense::hover());
            let font = FontId::proportional(TEXT_SIZE);
            ui.painter().text(label.center(), Align2::CENTER_CENTER, format!("{shown} / {last}"), font, TEXT);
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                let hint = "render the frames to a folder in the background";
                if ui.button("Render frames …").on_hover_text(hint).clicked() {
                    asked.push(Ask::Act(Action::RenderTo { frames: true }));
                }
                let size = egui::vec2(ui.available_width() - 8.0, HEIGHT);
                if size.x < 40.0 {
                    return;
                }
                let (rect, track) = ui.allocate_exact_size(size, Sense::click_and_drag());
                draw_track(ui.painter(), rect, strip);
                let about = track.on_hover_text("drag: another frame; yellow marks are keys");
                if let Some(place) = about.interact_pointer_pos().filter(|_| about.is_pointer_button_down_on()) {
                    let frame = strip.frame_at(f64::from((place.x - rect.left()) / rect.width()));
                    if strip.frame != Some(frame) {
                        asked.push(Ask::Send(strip.moment(frame)));
                    }
                }
            });
        });
    });
    asked
}

fn draw_track(painter: &egui::Painter, rect: Rect, strip: &Strip) {
    let x = |frame: f64| rect.left() + rect.width() * strip.place_of(frame) as f32;
    let line = rect.bottom() - 11.0;
    painter.rect_filled(
        Rect::from_min_max(Pos2::new(rect.left(), line - 1.5), Pos2::new(rect.right(), line + 1.5)),
        1.5,
        Color32::from_gray(70),
    );
    let step = strip.step(rect.width());
    let weak = Color32::from_gray(150);
    for frame in (0..strip.n).step_by(step as usize) {
        let at = x(f64::from(frame));
        painter.vline(at, line - 4.0..=line + 4.0, Stroke::new(1.0, weak));
        // The last one would be cut.
        if at < rect.right() - 12.0 {
            painter.text(
                Pos2::new(at + 3.0, rect.top() + 1.0),
                Align2::LEFT_TOP,
                frame,
                FontId::proportional(10.0),
                weak,
            );
        }
    }
    for frame in &strip.keys {
        let at = Pos2::new(x(*frame), line);
        let corners = [(0.0, -4.5), (4.5, 0.0), (0.0, 4.5), (-4.5, 0.0)].map(|(dx, dy)| at + egui::vec2(dx, dy));
        painter.add(egui::Shape::convex_polygon(corners.to_vec(), KEY, Stroke::new(1.0, Color32::BLACK)));
    }
    if let Some(frame) = strip.frame {
        let at = x(frame);
        painter.vline(at, rect.top() + 3.0..=rect.bottom() - 3.0, Stroke::new(3.0, Color32::from_black_alpha(160)));
        painter.vline(at, rect.top() + 3.0..=rect.bottom() - 3.0, Stroke::new(1.5, Color32::from_rgb(120, 180, 255)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn strip(n: u32) -> Strip {
        Strip { fps: 24.0, n, frame: Some(0.0), keys: Vec::new() }
    }

    #[test]
    fn places_are_whole_frames_and_back() {
        let strip = strip(61);
        assert_eq!(
            [strip.frame_at(-1.0), strip.frame_at(0.0), strip.frame_at(0.503), strip.frame_at(2.0)],
            [0.0, 0.0, 30.0, 60.0]
        );
        assert_eq!(strip.place_of(30.0), 0.5);
        assert_eq!(strip.moment(12.0), Command::SetMoment { seconds: Some(0.5) });
    }

    #[test]
    fn labels_of_frames_do_not_touch() {
        assert_eq!([strip(1).step(500.0), strip(24).step(700.0), strip(250).step(500.0)], [1, 2, 50]);
        for n in [3, 99, 1_000, 123_456] {
            let step = strip(n).step(600.0);
            assert!(f64::from(step) * 600.0 / f64::from(n) >= LABELS * 0.99, "{n}: {step}");
        }
    }

    #[test]
    fn a_still_scene_has_no_strip_and_one_with_keys_shows_them() {
        use crate::frame::SessionOptions;
        use crate::scene::{LoadOptions, SceneSource, load};
        let strip = |name: &str| {
            let mut session =
                Session::new(SessionOptions { width: 8, height: 8, ..SessionOptions::default() }).unwrap();
            session.adopt(load(&SceneSource::Builtin(name.to_owned()), &LoadOptions::default()).unwrap());
            Strip::of(&session)
        };
        assert_eq!(strip("ball"), None);
        let carousel = strip("carousel").unwrap();
        assert!(carousel.n > 1 && carousel.keys.len() > 1 && carousel.frame.is_some(), "{carousel:?}");
    }
}
