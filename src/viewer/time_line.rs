//! The strip of an animation above the bar: play, the frame, its keys, what part of it plays, and a button that renders
//! the frames.

use crate::format::camera::camera;
use crate::frame::navigation::Rig;
use crate::frame::{Command, CurrentScene, Edit, PlayRange, Session, has_left_camera};
use crate::scene::{Animation, Moment};
use crate::viewer::keys::{Action, PlayEnd};
use crate::viewer::overlay::{GLASS, KEY, TEXT, TEXT_SIZE};
use egui::{
    Align, Align2, Color32, Context, CursorIcon, FontId, Frame, Layout, Margin, Pos2, Rect, Sense, Stroke,
    TopBottomPanel, Ui,
};

/// Points.
const HEIGHT: f32 = 30.0;
/// Seconds that the time line has at least where keys are set.
const ROOM: f64 = 5.0;
/// Distance of two labels of frames, points.
const LABELS: f64 = 56.0;
/// Why there is no strip.
pub const NOTHING_MOVES: &str = "nothing in this scene moves: Ctrl+K sets keys";
/// Of the line above the lower edge, and of a mark of what plays, points.
const LINE: f32 = 11.0;
const MARK: f32 = 9.0;

/// An animation as the strip shows it.
#[derive(Clone, Debug, PartialEq)]
pub struct Strip {
    /// Frames per second.
    pub fps: f64,
    /// Number of frames, at least 1.
    pub n: u32,
    /// Number of frames that can be shown, at least as many: keys may be set beyond the last one.
    reach: u32,
    /// The frame that is shown; `None` for the pose that a model is stored in.
    pub frame: Option<f64>,
    /// First and last frame of what plays.
    pub plays: [u32; 2],
    /// Frames with a key.
    keys: Vec<f64>,
    /// The camera of the animation, if it moves one.
    camera: Option<AnimatedCamera>,
}

/// A camera that an animation moves.
#[derive(Clone, Debug, PartialEq)]
struct AnimatedCamera {
    /// Where it is now.
    rig: Rig,
    /// The window looks through it.
    is_shown: bool,
}

impl AnimatedCamera {
    fn of(session: &Session, animation: &Animation, seconds: f64) -> Option<Self> {
        let is_shown = !has_left_camera(session)?;
        let (view, projection, lens) = camera(&animation.camera_at(seconds));
        Some(Self { rig: Rig { view, projection, lens }, is_shown })
    }

    /// A button that tells whether it is looked through, and goes back to it.
    fn show(&self, ui: &mut Ui) -> Vec<Ask> {
        let hint = match self.is_shown {
            true => "the animation moves the camera, until you move it",
            false => "look through the camera of the animation again",
        };
        if !ui.selectable_label(self.is_shown, "Camera").on_hover_text(hint).clicked() || self.is_shown {
            return Vec::new();
        }
        let Rig { view, projection, lens } = self.rig;
        [Command::SetView(view), Command::SetProjection(projection), Command::SetLens(lens)].map(Ask::Send).into()
    }
}

/// What is asked for on the strip.
pub enum Ask {
    Send(Command),
    Act(Action),
}

impl Strip {
    /// `None` if nothing in the scene moves.
    pub fn of(session: &Session) -> Option<Self> {
        let world = session.world();
        let shown = world.get_resource::<Moment>().map_or(0.0, |moment| moment.0);
        let range = world.resource::<PlayRange>().0;
        let plays = |fps: f64, n: u32| {
            let last = n.saturating_sub(1);
            let frame = |seconds: f64| (seconds * fps).round().clamp(0.0, f64::from(last)) as u32;
            // The last frame is shown until its end.
            range.map_or([0, last], |[from, until]| [frame(from), frame(until - 1.0 / fps)])
        };
        if let Some(animation) = world.get_resource::<Animation>().filter(|animation| animation.moves()) {
            let fps = animation.fps;
            let keys = animation.key_times().iter().map(|time| time * fps).collect();
            let n = animation.n_frames();
            // What has been made in files has its length.
            let more = if animation.can_grow() { Animation::frames_to_key(ROOM, fps) } else { 0 };
            let reach = n.max(more).max((shown * fps).ceil() as u32 + 1);
            let camera = AnimatedCamera::of(session, animation, shown);
            return Some(Self { fps, n, reach, frame: Some(shown * fps), plays: plays(fps, n), keys, camera });
        }
        // A glTF model in its stored pose.
        let length = world.get_resource::<CurrentScene>()?.0.model_length()?;
        let fps = world.get_resource::<Animation>().map_or(24.0, |animation| animation.fps);
        let n = Animation::frames_to_key(length, fps);
        Some(Self { fps, n, reach: n, frame: None, plays: plays(fps, n), keys: Vec::new(), camera: None })
    }

    /// The frame, and the last one of the animation unless it lies beyond that.
    fn label(&self) -> String {
        let last = self.n.saturating_sub(1);
        match self.frame.map(whole_frame) {
            None => format!("– / {last}"),
            Some(frame) if last > 0 && frame <= f64::from(last) => format!("{frame} / {last}"),
            Some(frame) => frame.to_string(),
        }
    }

    /// Begins or ends what plays at a frame; the other end gives way.
    pub fn with_end(&self, end: PlayEnd, frame: f64) -> Command {
        let frame = frame.clamp(0.0, f64::from(self.n.saturating_sub(1))) as u32;
        let [first, last] = match end {
            PlayEnd::First => [frame, self.plays[1].max(frame)],
            PlayEnd::Last => [self.plays[0].min(frame), frame],
        };
        let is_all = first == 0 && last + 1 >= self.n;
        let seconds = [f64::from(first) / self.fps, f64::from(last + 1) / self.fps];
        Command::SetPlayRange { seconds: (!is_all).then_some(seconds) }
    }

    /// Where playing begins, stops or goes on: commands before it.
    pub fn before_play(&self, is_playing: bool) -> Option<Command> {
        match self.frame {
            // It stops at a whole frame.
            Some(frame) if is_playing => Some(self.moment(frame.round())),
            None if !is_playing => Some(self.moment(f64::from(self.plays[0]))),
            _ => None,
        }
    }

    /// Seconds of a frame.
    fn moment(&self, frame: f64) -> Command {
        Command::SetMoment { seconds: Some(frame / self.fps) }
    }

    /// The frame at a place of the track, 0..1; a whole one.
    fn frame_at(&self, place: f64) -> f64 {
        let last = f64::from(self.reach.saturating_sub(1));
        (place.clamp(0.0, 1.0) * last).round()
    }

    /// Where a frame is on the track, 0..1.
    fn place_of(&self, frame: f64) -> f64 {
        let last = f64::from(self.reach.saturating_sub(1)).max(1.0);
        (frame / last).clamp(0.0, 1.0)
    }

    /// The key next to a frame, as far as `reach` of the track; else the frame.
    fn key_near(&self, frame: f64, reach: f32) -> f64 {
        let away = |key: &f64| (self.place_of(*key) - self.place_of(frame)).abs();
        let nearest = self.keys.iter().copied().min_by(|a, b| away(a).total_cmp(&away(b)));
        nearest.filter(|key| away(key) <= f64::from(reach)).unwrap_or(frame)
    }

    /// Frames between two labels on a track of this width, points: a step of 1, 2 or 5 times a power of ten.
    fn step(&self, width: f32) -> u32 {
        let wanted = f64::from(self.reach) * LABELS / f64::from(width.max(1.0));
        let power = 10f64.powf(wanted.max(1.0).log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|of| of * power).find(|step| *step >= wanted);
        step.unwrap_or(wanted).max(1.0) as u32
    }
}

/// The frame that is shown at a time between two of them: seconds times a rate may be a little less than its number.
fn whole_frame(frame: f64) -> f64 {
    let nearest = frame.round();
    if (frame - nearest).abs() < 1e-6 { nearest } else { frame.floor() }
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
                asked.push(Ask::Act(Action::TogglePlay));
            }
            let last = strip.reach.saturating_sub(1);
            // As wide as the last one, so that the track does not move.
            let width = 18.0 + 15.0 * last.to_string().len() as f32;
            let (label, _) = ui.allocate_exact_size(egui::vec2(width, HEIGHT), Sense::hover());
            let font = FontId::proportional(TEXT_SIZE);
            ui.painter().text(label.center(), Align2::CENTER_CENTER, strip.label(), font, TEXT);
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                let hint = "render the frames to a folder in the background";
                if ui.button("Render frames …").on_hover_text(hint).clicked() {
                    asked.push(Ask::Act(Action::RenderTo { frames: true }));
                }
                if let Some(camera) = &strip.camera {
                    asked.extend(camera.show(ui));
                }
                let size = egui::vec2(ui.available_width() - 8.0, HEIGHT);
                if size.x < 40.0 {
                    return;
                }
                let (whole, track) = ui.allocate_exact_size(size, Sense::click_and_drag());
                let rect = whole.shrink2(egui::vec2(MARK, 0.0));
                draw_track(ui.painter(), rect, strip);
                let about = track.on_hover_text("drag: another frame; yellow marks are keys: right click");
                let frame_at = |place: Pos2| strip.frame_at(f64::from((place.x - rect.left()) / rect.width()));
                about.context_menu(|ui| asked.extend(key_menu(ui, strip)));
                // A button that is released in the frame in which it was pressed was never seen down.
                let is_meant = about.is_pointer_button_down_on() || about.clicked() || about.secondary_clicked();
                let is_for_keys = about.secondary_clicked() || ui.input(|input| input.pointer.secondary_down());
                if let Some(place) = about.interact_pointer_pos().filter(|_| is_meant) {
                    let frame = match is_for_keys {
                        true => strip.key_near(frame_at(place), MARK / rect.width()),
                        false => frame_at(place),
                    };
                    if strip.frame != Some(frame) {
                        asked.push(Ask::Send(strip.moment(frame)));
                    }
                }
                for end in [PlayEnd::First, PlayEnd::Last] {
                    asked.extend(mark(ui, rect, strip, end, frame_at).map(Ask::Send));
                }
            });
        });
    });
    asked
}

/// What can be done with the keys at the shown frame.
fn key_menu(ui: &mut Ui, strip: &Strip) -> Option<Ask> {
    ui.strong(format!("frame {}", strip.frame.map_or(0.0, whole_frame)));
    let lines = [("Set key", Edit::SetKeys { camera: false }), ("Delete keys here", Edit::DeleteKeys)];
    let chosen = lines.into_iter().find_map(|(name, edit)| ui.button(name).clicked().then_some(edit));
    chosen.map(|edit| Ask::Send(Command::Edit(edit)))
}

/// Draws an end of what plays below the line, and returns where it was dragged.
fn mark(ui: &Ui, rect: Rect, strip: &Strip, end: PlayEnd, frame_at: impl Fn(Pos2) -> f64) -> Option<Command> {
    let (frame, outward, hint) = match end {
        PlayEnd::First => {
            (strip.plays[0], -1.0, "drag: where playing and rendering begin; double click: at the first frame")
        }
        PlayEnd::Last => {
            (strip.plays[1], 1.0, "drag: where playing and rendering end; double click: at the last frame")
        }
    };
    let tip =
        Pos2::new(rect.left() + rect.width() * strip.place_of(f64::from(frame)) as f32, rect.bottom() - LINE + 2.0);
    let corners = [tip, tip + egui::vec2(0.0, MARK), tip + egui::vec2(outward * MARK, MARK)];
    let target = Rect::from_points(&corners).expand2(egui::vec2(3.0, 0.0));
    let response = ui.interact(target, ui.id().with(("end", outward > 0.0)), Sense::click_and_drag());
    let is_meant = response.hovered() || response.dragged();
    let color = if is_meant { Color32::WHITE } else { Color32::from_gray(170) };
    ui.painter().add(egui::Shape::convex_polygon(corners.to_vec(), color, Stroke::NONE));
    let response = response.on_hover_text(hint).on_hover_cursor(CursorIcon::ResizeHorizontal);
    if response.double_clicked() {
        return Some(strip.with_end(end, if end == PlayEnd::First { 0.0 } else { f64::from(strip.n) }));
    }
    let dragged = response.interact_pointer_pos().filter(|_| response.dragged()).map(frame_at);
    dragged.filter(|wanted| *wanted != f64::from(frame)).map(|wanted| strip.with_end(end, wanted))
}

fn draw_track(painter: &egui::Painter, rect: Rect, strip: &Strip) {
    let x = |frame: f64| rect.left() + rect.width() * strip.place_of(frame) as f32;
    let line = rect.bottom() - LINE;
    let [first, last] = strip.plays.map(|frame| x(f64::from(frame)));
    for ([left, right], gray) in [([rect.left(), rect.right()], 60), ([first, last], 120)] {
        let part = Rect::from_min_max(Pos2::new(left, line - 1.5), Pos2::new(right, line + 1.5));
        painter.rect_filled(part, 1.5, Color32::from_gray(gray));
    }
    let step = strip.step(rect.width());
    let weak = Color32::from_gray(150);
    for frame in (0..strip.reach).step_by(step as usize) {
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
    if let Some(frame) = strip.frame {
        let at = x(frame);
        painter.vline(at, rect.top() + 3.0..=rect.bottom() - 3.0, Stroke::new(3.0, Color32::from_black_alpha(160)));
        painter.vline(at, rect.top() + 3.0..=rect.bottom() - 3.0, Stroke::new(1.5, Color32::from_rgb(120, 180, 255)));
    }
    for frame in &strip.keys {
        let at = Pos2::new(x(*frame), line);
        let corners = [(0.0, -4.5), (4.5, 0.0), (0.0, 4.5), (-4.5, 0.0)].map(|(dx, dy)| at + egui::vec2(dx, dy));
        painter.add(egui::Shape::convex_polygon(corners.to_vec(), KEY, Stroke::new(1.0, Color32::BLACK)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn strip(n: u32) -> Strip {
        Strip { fps: 24.0, n, reach: n, frame: Some(0.0), plays: [0, n - 1], keys: Vec::new(), camera: None }
    }

    #[test]
    fn places_are_whole_frames_and_back() {
        let strip = strip(61);
        assert_eq!(
            [strip.frame_at(-1.0), strip.frame_at(0.0), strip.frame_at(0.503), strip.frame_at(2.0)],
            [0.0, 0.0, 30.0, 60.0]
        );
        assert_eq!(strip.place_of(30.0), 0.5);
        let keyed = Strip { keys: vec![10.0, 40.5], ..strip.clone() };
        assert_eq!([30.0, 41.0, 39.0].map(|frame| keyed.key_near(frame, 0.02)), [30.0, 40.5, 39.0]);
        assert_eq!(strip.moment(12.0), Command::SetMoment { seconds: Some(0.5) });
        // At 30 a second, some whole frames are a little earlier than their number.
        assert!((0..1000).all(|i| whole_frame(f64::from(i) / 29.97 * 29.97) == f64::from(i)));
        assert_eq!(whole_frame(15.7), 15.0);
    }

    #[test]
    fn what_plays_has_ends_that_give_way_and_none_where_it_is_all() {
        let mut strip = strip(48);
        let range = |command| match command {
            Command::SetPlayRange { seconds } => seconds,
            other => panic!("{other:?}"),
        };
        assert_eq!(range(strip.with_end(PlayEnd::First, 12.0)), Some([0.5, 2.0]));
        strip.plays = [12, 23];
        assert_eq!(range(strip.with_end(PlayEnd::First, 36.0)), Some([1.5, 37.0 / 24.0]));
        assert_eq!(range(strip.with_end(PlayEnd::Last, 5.0)), Some([5.0 / 24.0, 0.25]));
        strip.plays = [0, 23];
        assert_eq!(range(strip.with_end(PlayEnd::Last, 48.0)), None);
    }

    /// Shows the strip, with a press and a release within a frame.
    fn click(strip: &Strip, at: Pos2, button: egui::PointerButton) -> Vec<f64> {
        let context = Context::default();
        let button =
            |pressed| egui::Event::PointerButton { pos: at, button, pressed, modifiers: egui::Modifiers::NONE };
        let mut frames = Vec::new();
        for events in [vec![], vec![egui::Event::PointerMoved(at), button(true), button(false)], vec![]] {
            let screen_rect = Some(Rect::from_min_size(Pos2::ZERO, egui::vec2(800.0, 100.0)));
            let input = egui::RawInput { events, screen_rect, ..egui::RawInput::default() };
            let _ = context.run(input, |context| {
                frames.extend(show(context, strip, false).into_iter().filter_map(|ask| match ask {
                    Ask::Send(Command::SetMoment { seconds }) => seconds.map(|seconds| (seconds * strip.fps).round()),
                    _ => None,
                }));
            });
        }
        frames
    }

    #[test]
    fn a_click_within_one_frame_goes_to_its_frame() {
        use egui::PointerButton::{Primary, Secondary};
        let (strip, at) = (strip(61), Pos2::new(400.0, 80.0));
        let frames = click(&strip, at, Primary);
        assert!(matches!(frames[..], [frame] if (10.0..50.0).contains(&frame)), "{frames:?}");
        // What the menu sets and deletes is there, or at the key beside it.
        assert_eq!(click(&strip, at, Secondary), frames);
        let keyed = Strip { keys: vec![frames[0] + 0.5], ..strip };
        assert_eq!(click(&keyed, at, Secondary), [(frames[0] + 0.5).round()]);
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
        // Where the first key is, there is room for the next one.
        let options = SessionOptions { width: 8, height: 8, ..SessionOptions::default() };
        let mut session = Session::new(options).unwrap();
        session.adopt(load(&SceneSource::Builtin("ball".to_owned()), &LoadOptions::default()).unwrap());
        session.send(Command::Edit(crate::frame::Edit::SelectAll));
        session.send(Command::Edit(crate::frame::Edit::SetKeys { camera: false }));
        session.update(std::time::Duration::ZERO);
        let one_key = Strip::of(&session).unwrap();
        assert_eq!((one_key.n, one_key.frame_at(1.0), one_key.plays), (1, 120.0, [0, 0]));
        let label = |frame| Strip { frame, ..strip("carousel").unwrap() }.label();
        let last = carousel.n - 1;
        assert_eq!([label(None), label(Some(7.0))], [format!("– / {last}"), format!("7 / {last}")]);
        assert_eq!([label(Some(1e6)), one_key.label()], ["1000000", "0"]);
    }
}
