//! Recording and replaying sessions.

use crate::files::whole_file::{Replace, WholeFile, unwritable};
use crate::frame::core::offline::{Target, render_region_until};
use crate::frame::core::status::MessageKind;
use crate::frame::input::ModelUp;
use crate::frame::recording::{FORMAT, RecordedLine, Recorder, RecordingHeader, SceneWord, check_recordable, read};
use crate::frame::state::background::BackgroundTasks;
use crate::frame::state::resources::{CurrentScene, PictureSize, RenderState, SceneGeneration, StopAt};
use crate::frame::{Command, Session, SessionOptions};
use crate::render::{ErrorMetric, Film, Room, SampleAllocation};
use crate::scene::{
    DisplaySettings, ModelChoice, Rendering, SceneSource, UpAxis, WriteError, absolute, check_film_size, relative_path,
    text_to_path,
};
use bevy_ecs::prelude::Mut;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

impl Session {
    /// Starts recording; must be called before the first frame, with the scene that is opened first and what
    /// [`Session::open_choice`] is called with.
    ///
    /// # Errors
    /// If the file cannot be created.
    pub fn record(
        &mut self,
        path: &Path,
        source: &SceneSource,
        environment: Option<&Path>,
        choice: &ModelChoice,
    ) -> Result<(), WriteError> {
        check_recordable(path)?;
        let mut out = WholeFile::claim(path, Replace::AllButFilms)?;
        let folder = folder_of(path);
        let scene = match source {
            SceneSource::Builtin(name) => SceneWord::Builtin(name.clone()),
            SceneSource::Scene(path)
            | SceneSource::Foreign(path)
            | SceneSource::Model(path)
            | SceneSource::Picture(path) => SceneWord::File(relative_path(&folder, path)),
        };
        let PictureSize { width, height } = *self.world().resource();
        let header = RecordingHeader {
            format: FORMAT,
            program: concat!(env!("CARGO_PKG_NAME"), " ", env!("CARGO_PKG_VERSION")).to_owned(),
            scene,
            environment: environment.map(|image| relative_path(&folder, image)),
            choice: choice.clone(),
            up: self.world().resource::<ModelUp>().0.map(|up| if up == UpAxis::Y { 'y' } else { 'z' }),
            width,
            height,
            seed: self.world().resource::<Rendering>().0.seed,
        };
        // Replaces an older recording only once the first line is complete; further lines are appended.
        let first = ron::to_string(&header).expect("a line is plain data") + "\n";
        out.write_all(first.as_bytes()).map_err(|error| unwritable(path, error))?;
        let file = out.finish_open()?;
        self.world_mut().insert_resource(Recorder { out: Some((file, path.to_path_buf())), ..Recorder::default() });
        Ok(())
    }

    /// Ends the recording with the present sample count; returns why it is not complete.
    pub fn end_record(&mut self) -> Option<String> {
        let status = self.status();
        let spp = if status.divider == 1 { status.spp } else { 0 };
        self.world_mut().resource_scope(|world, mut recorder: Mut<Recorder>| {
            // In the last frame, too.
            recorder.note_opened(world.resource::<SceneGeneration>(), world.get_resource::<CurrentScene>());
            let line = RecordedLine::End(recorder.frame, spp);
            recorder.write(&line);
            recorder.out = None;
            recorder.trouble.take()
        })
    }
}

/// Result of a replay.
pub struct Replayed {
    /// The session after the last frame; its workers are idle.
    pub session: Session,
    /// The film at its end.
    pub film: Film,
    /// Differences from the recorded session.
    pub warnings: Vec<String>,
    /// Number of the frame at which the recording ends.
    pub frames: u64,
    /// Number of commands that were replayed.
    pub commands: usize,
}

/// Options of a replay.
#[derive(Clone, Copy, Debug, Default)]
pub struct ReplayOptions {
    /// Number of worker threads; one per processor if not given.
    pub threads: Option<usize>,
    /// Samples per pixel at the end, instead of those of the recording.
    pub spp: Option<u32>,
    /// Whether the model that is opened first may read files outside of its folder, which no recording allows by itself.
    pub allow_outside: bool,
}

/// Samples per pixel that a recording may ask for by itself.
const MOST_SAMPLES: u32 = 16_384;

/// Replays a recording without a window, as fast as possible, and renders the image at its end.
///
/// # Errors
/// If it cannot be read, or its scene cannot be opened.
pub fn replay(path: &Path, options: ReplayOptions, stop: &(dyn Fn() -> bool + Sync)) -> Result<Replayed, String> {
    let (header, lines) = read(path, stop)?;
    let failed = |reason: String| format!("{}: {reason}", path.display());
    if !lines.iter().any(|line| matches!(line, RecordedLine::Opened(..))) {
        let reason = "the recording ends before its scene was open: there is nothing to replay";
        return Err(failed(reason.to_owned()));
    }
    let source = match &header.scene {
        SceneWord::Builtin(name) => SceneSource::Builtin(name.clone()),
        SceneWord::File(file) => {
            let file = folder_of(path).join(text_to_path(file));
            SceneSource::parse(&file).map_err(|error| failed(error.to_string()))?
        }
    };
    let up = header.up.map(|up| if up == 'z' { UpAxis::Z } else { UpAxis::Y });
    // Intermediate images are not displayed: the minimum number of samples.
    let idle = Target { spp: Some(1), ..Target::default() };
    // Checked before the workers start an image that does not fit into memory.
    drop(
        Room::for_film(header.width.max(1), header.height.max(1), false, &[])
            .map_err(|error| failed(error.to_string()))?,
    );
    let mut session = Session::new(SessionOptions {
        width: header.width,
        height: header.height,
        threads: options.threads,
        seed: header.seed,
        // As in the window.
        allocation: SampleAllocation::Adaptive(ErrorMetric::RelativeMse),
        target: idle,
        up,
        yielding: false,
        waker: None,
    })?;
    let environment = header.environment.map(|image| folder_of(path).join(text_to_path(&image)));
    session.open_choice(source, environment, ModelChoice { allow_outside: options.allow_outside, ..header.choice });
    let mut player = Player { session, frame: 0, clock: Duration::ZERO, warnings: Vec::new(), edited: 0 };
    let (mut end, mut last, mut commands) = (None, 0, 0);
    for line in lines {
        if stop() {
            return Err(failed("the replay was stopped".to_owned()));
        }
        match line {
            RecordedLine::Do(frame, at, command) => {
                player.command(frame, at, command);
                (last, commands) = (frame, commands + 1);
            }
            RecordedLine::Opened(frame, number, print) => {
                player.wait_for_scene(frame, number, &print, stop).map_err(failed)?;
                last = frame;
            }
            RecordedLine::End(frame, spp) => (end, last) = (Some(spp), frame),
        }
    }
    player.update();
    let Player { mut session, mut warnings, clock, .. } = player;
    session.send(Command::Pause);
    // As after a rest, when what was moved shares its tree with what stands still, as it does when the image is opened.
    let rested = clock + Duration::from_secs(1);
    session.update(rested);
    while !session.world().resource::<BackgroundTasks>().is_idle() {
        if stop() {
            return Err(failed("the replay was stopped".to_owned()));
        }
        std::thread::sleep(Duration::from_millis(2));
        session.update(rested);
    }
    let spp = options.spp.or(end.map(|end| end.min(MOST_SAMPLES))).unwrap_or(0);
    if options.spp.is_none() && end > Some(MOST_SAMPLES) {
        let more = "--spp renders more";
        warnings
            .push(format!("the recording ends at more samples than {MOST_SAMPLES} per pixel: rendering those; {more}"));
    }
    if end.is_none() {
        warnings.push("the recording is incomplete: its last line is not the end of a session".to_owned());
    }
    if spp == 0 {
        warnings.push("the recording does not contain the number of samples: rendering 1 sample per pixel".to_owned());
    }
    let world = session.world();
    let PictureSize { width, height } = *world.resource();
    let extraction = world.resource::<RenderState>().extraction.as_ref();
    let prepared = extraction.map(|extraction| extraction.prepared.clone());
    let prepared = prepared.ok_or_else(|| failed("no scene is open".to_owned()))?;
    let settings = world.resource::<Rendering>().0;
    check_film_size(width, height).map_err(|bad| failed(bad.to_string()))?;
    let mut film = Film::try_new(width, height).map_err(|error| failed(error.to_string()))?;
    let target = Target { spp: Some(spp.max(1)), ..Target::default() };
    let pool = session.pool();
    pool.install(|| render_region_until(&prepared, &settings, &mut film, None, target, stop, |_| true));
    Ok(Replayed { session, film, warnings, frames: last, commands })
}

impl Replayed {
    /// All files that were read: of the scenes that were open, and of edits.
    pub fn files(&self) -> Vec<PathBuf> {
        self.session.world().resource::<BackgroundTasks>().files_read()
    }

    /// Display settings at the end.
    pub fn display(&self) -> crate::render::Display {
        self.session.world().resource::<DisplaySettings>().0
    }
}

struct Player {
    session: Session,
    /// The frame whose commands are being collected.
    frame: u64,
    clock: Duration,
    warnings: Vec<String>,
    /// Number of file edits during the recording.
    edited: u64,
}

impl Player {
    fn command(&mut self, frame: u64, at: f64, command: Command) {
        if frame != self.frame {
            self.update();
            self.frame = frame;
        }
        self.clock = self.clock.max(Duration::try_from_secs_f64(at).unwrap_or_default());
        match command {
            // Opening is part of the replay; commands that change the disk or the timing are not.
            Command::SaveScene { .. } => {
                let told = "scenes that were saved during the recording are not saved again";
                if !self.warnings.iter().any(|warning| warning == told) {
                    self.warnings.push(told.to_owned());
                }
            }
            Command::SetThreads { .. } | Command::Pause | Command::Resume => {}
            other => self.session.send(other),
        }
    }

    fn update(&mut self) {
        self.session.world_mut().insert_resource(StopAt(Target { spp: Some(1), ..Target::default() }));
        self.session.update(self.clock);
        // Background work of an edit is finished before the next command: a mesh that undo restores is invisible until
        // it has a tree.
        while self.session.world().resource::<BackgroundTasks>().is_editing() {
            std::thread::sleep(Duration::from_millis(2));
            self.session.update(self.clock);
        }
    }

    /// Runs frames until the scene with this number is open. A reload caused by an edited file is not repeated: the
    /// file already has its latest contents.
    fn wait_for_scene(
        &mut self,
        frame: u64,
        number: u64,
        print: &str,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<(), String> {
        /// Timeout of loading a scene.
        const PATIENCE: Duration = Duration::from_secs(600);
        self.frame = frame;
        let start = Instant::now();
        let mut was_edited = false;
        loop {
            self.update();
            let world = self.session.world();
            if world.resource::<SceneGeneration>().0 + self.edited >= number {
                break;
            }
            let nothing_comes =
                world.contains_resource::<CurrentScene>() && world.resource::<BackgroundTasks>().is_idle();
            if stop() {
                return Err("the replay was stopped".to_owned());
            }
            let errors = self.session.status().messages.iter().filter(|message| message.kind == MessageKind::Error);
            let lines: Vec<&str> = errors.map(|message| message.text.as_str()).collect();
            if !lines.is_empty() && self.session.status().loading.is_none() {
                return Err(lines.join("; ").replace('\n', "; "));
            }
            if nothing_comes {
                (self.edited, was_edited) = (self.edited + 1, true);
                break;
            }
            if start.elapsed() > PATIENCE {
                return Err("the scene was not loaded".to_owned());
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        // The next frame belongs to the following commands.
        self.frame = frame + 1;
        let current = self.session.world().resource::<CurrentScene>();
        let now = current.0.content_fingerprint().to_string();
        let title = current.0.source.title();
        if now != print && was_edited {
            self.warnings.push(format!(
                "{title} was edited during the recording and is replayed as it is now: the image may differ"
            ));
        } else if now != print {
            self.warnings.push(format!("{title} has changed since the recording: the image may differ"));
        }
        Ok(())
    }
}

fn folder_of(path: &Path) -> PathBuf {
    absolute(path).parent().map(Path::to_path_buf).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn session() -> Session {
        Session::new(SessionOptions { width: 16, height: 12, threads: Some(1), ..SessionOptions::default() }).unwrap()
    }

    #[test]
    fn a_recording_replaces_an_older_one_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let (scene, target) = (folder.path().join("s.ron"), folder.path().join("a.rec"));
        let text = "(camera: (eye: (0, 0, 5), look_at: (0, 0, 0)))\n";
        std::fs::write(&scene, text).unwrap();
        let source = SceneSource::Scene(scene.clone());
        let mut first = session();
        assert!(
            first
                .record(&scene, &source, None, &ModelChoice::DEFAULT)
                .unwrap_err()
                .to_string()
                .contains("s.ron: exists and is not a recording")
        );
        assert_eq!(std::fs::read_to_string(&scene).unwrap(), text);
        // While it is being written, no other process may write it.
        first.record(&target, &source, None, &ModelChoice::DEFAULT).unwrap();
        let begun = std::fs::read_to_string(&target).unwrap();
        assert!(begun.lines().count() == 1 && begun.contains("File(\"s.ron\")"), "{begun}");
        assert!(
            session()
                .record(&target, &source, None, &ModelChoice::DEFAULT)
                .unwrap_err()
                .to_string()
                .contains("is being written by another process")
        );
        first.send(Command::Pause);
        first.update(Duration::ZERO);
        first.end_record();
        assert_eq!(read(&target, &|| false).unwrap().1.len(), 2, "a command and the end");
        let mut second = session();
        second.record(&target, &source, None, &ModelChoice::DEFAULT).unwrap();
        second.end_record();
        assert_eq!(read(&target, &|| false).unwrap().1.len(), 1);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2, "nothing temporary is left");
    }

    /// A small scene is open, rendered and left within a frame.
    #[test]
    fn a_recording_that_ends_in_the_frame_of_its_scene_has_it() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("a.rec");
        let source = SceneSource::Builtin("ball".to_owned());
        let mut session = session();
        session.record(&target, &source, None, &ModelChoice::DEFAULT).unwrap();
        session.open(source);
        for _ in 0..2000 {
            session.update(Duration::ZERO);
            if session.world().contains_resource::<CurrentScene>() {
                break;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        assert_eq!(session.end_record(), None);
        let lines = read(&target, &|| false).unwrap().1;
        assert!(matches!(&lines[..], [RecordedLine::Opened(..), RecordedLine::End(..)]), "{} lines", lines.len());
    }

    /// As on a full disk: when it happens, and at the end.
    #[cfg(target_os = "linux")]
    #[test]
    fn a_recording_that_cannot_be_written_says_so() {
        let full = || std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let recorder = || Recorder { out: Some((full(), PathBuf::from("a.rec"))), ..Recorder::default() };
        let mut session = session();
        session.world_mut().insert_resource(recorder());
        let stopped = session.end_record().unwrap();
        assert!(stopped.starts_with("a.rec: recording stopped: "), "{stopped}");
        session.world_mut().insert_resource(recorder());
        session.send(Command::Pause);
        session.update(Duration::ZERO);
        assert!(session.status().messages.iter().any(|message| message.text == stopped));
        assert_eq!(session.end_record(), Some(stopped));
        assert_eq!(session.end_record(), None);
    }

    /// File names of arbitrary bytes are recorded, too.
    #[cfg(target_os = "linux")]
    #[test]
    fn a_command_with_a_name_that_is_no_utf_8_is_played_as_it_was_given() {
        use std::os::unix::ffi::OsStringExt;
        let path = PathBuf::from(std::ffi::OsString::from_vec(b"r\xffm.ron".to_vec()));
        for command in [Command::SaveScene { path: path.clone() }, Command::Open { path }] {
            let line = ron::to_string(&RecordedLine::Do(1, 0.5, command.clone())).unwrap();
            assert_eq!(ron::from_str::<RecordedLine>(&line).unwrap(), RecordedLine::Do(1, 0.5, command));
        }
    }
}
