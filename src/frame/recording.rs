//! A session as a text file: what was asked for, frame by frame, and played again without a window.
//!
//! The first line says which scene was open, how large the picture was and which seed it had; then comes one line an
//! event (RON), written at once, so that the file is whole up to the moment at which a program ended for whatever
//! reason. Commands depend on no clock and sums on no order, so playing them again leads to the same picture, bit for
//! bit, with any number of threads; times are kept for people.

use super::beside::Beside;
use super::input::CommandQueue;
use super::systems::{Adopted, Clock, CurrentScene, PictureSize, Shown, StopAt};
use super::{Command, MessageKind, Session, SessionOptions, Target, render_offline_until};
use crate::render::Film;
use crate::scene::{Developing, Rendering, SceneSource, UpAxis, absolute, relative_path};
use bevy_ecs::prelude::{Res, ResMut, Resource};
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// A newer program that writes something else counts this up.
const FORMAT: u32 = 1;

/// The first line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Header {
    format: u32,
    /// Name and version.
    program: String,
    scene: SceneWord,
    /// `y` or `z`, where it was asked for.
    #[serde(default)]
    up: Option<char>,
    width: u32,
    height: u32,
    seed: u32,
}

/// A built-in scene, or a file by its path from the recording.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
enum SceneWord {
    Builtin(String),
    File(String),
}

/// Any other line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
enum Line {
    /// In which frame, at what time (seconds), what was asked for.
    Do(u64, f64, Command),
    /// A scene that was asked for took its place in this frame: its number, and its fingerprint.
    Opened(u64, u64, String),
    /// The picture had so many samples when the session ended.
    End(u64, u32),
}

/// Writes down what a session is asked for.
#[derive(Resource, Default)]
pub struct Recorder {
    out: Option<(File, PathBuf)>,
    frame: u64,
    adopted: u64,
    trouble: Option<String>,
}

impl Recorder {
    fn write(&mut self, line: &impl Serialize) {
        let Some((file, path)) = &mut self.out else { return };
        // Plain enums, numbers and strings can always be written.
        let text = ron::to_string(line).expect("a line is plain data") + "\n";
        if let Err(error) = file.write_all(text.as_bytes()) {
            self.trouble = Some(format!("{}: the recording ends here: {error}", path.display()));
            self.out = None;
        }
    }
}

/// Writes down what this frame is asked for; runs before the commands are carried out.
///
/// Reads the queue of commands, [`Adopted`], [`Clock`]; writes [`Recorder`].
pub fn record(
    queue: Res<CommandQueue>,
    adopted: Res<Adopted>,
    clock: Res<Clock>,
    current: Option<Res<CurrentScene>>,
    mut recorder: ResMut<Recorder>,
    mut status: ResMut<super::Status>,
) {
    if recorder.out.is_none() {
        return;
    }
    recorder.frame += 1;
    // A scene takes its place after the commands of its frame.
    if adopted.0 > recorder.adopted {
        recorder.adopted = adopted.0;
        let print = current.map_or_else(String::new, |current| current.0.content_fingerprint().to_string());
        let line = Line::Opened(recorder.frame - 1, adopted.0, print);
        recorder.write(&line);
    }
    for command in &queue.0 {
        let line = Line::Do(recorder.frame, clock.0.as_secs_f64(), command.clone());
        recorder.write(&line);
    }
    if let Some(trouble) = recorder.trouble.take() {
        status.say(clock.0, MessageKind::Error, trouble);
    }
}

impl Session {
    /// Writes down from now on what this session is asked for; call it before the first frame, with the scene that is
    /// opened first.
    ///
    /// # Errors
    /// When the file cannot be made.
    pub fn record(&mut self, path: &Path, source: &SceneSource, up: Option<UpAxis>) -> Result<(), String> {
        let failed = |error: std::io::Error| format!("{}: cannot be written: {error}", path.display());
        let file = File::create(path).map_err(failed)?;
        let folder = folder_of(path);
        let scene = match source {
            SceneSource::Builtin(name) => SceneWord::Builtin(name.clone()),
            SceneSource::Scene(path) | SceneSource::Model(path) | SceneSource::Picture(path) => {
                SceneWord::File(relative_path(&folder, path))
            }
        };
        let PictureSize { width, height } = *self.world().resource();
        let header = Header {
            format: FORMAT,
            program: concat!(env!("CARGO_PKG_NAME"), " ", env!("CARGO_PKG_VERSION")).to_owned(),
            scene,
            up: up.map(|up| if up == UpAxis::Y { 'y' } else { 'z' }),
            width,
            height,
            seed: self.world().resource::<Rendering>().0.seed,
        };
        let mut recorder = Recorder { out: Some((file, path.to_path_buf())), ..Recorder::default() };
        recorder.write(&header);
        match recorder.trouble.take() {
            Some(trouble) => Err(trouble),
            None => {
                self.world_mut().insert_resource(recorder);
                Ok(())
            }
        }
    }

    /// Ends the recording with how far the picture is.
    pub fn end_record(&mut self) {
        let status = self.status();
        let spp = if status.divider == 1 { status.spp } else { 0 };
        let mut recorder = self.world_mut().resource_mut::<Recorder>();
        let line = Line::End(recorder.frame, spp);
        recorder.write(&line);
        recorder.out = None;
    }
}

/// What came of playing a recording.
pub struct Replayed {
    /// As it was after the last frame; its workers rest.
    pub session: Session,
    /// The picture at its end.
    pub film: Film,
    /// What was different from when it was recorded.
    pub warnings: Vec<String>,
}

/// How to play a recording.
#[derive(Clone, Copy, Debug, Default)]
pub struct ReplayOptions {
    pub threads: Option<usize>,
    /// Samples per pixel at the end, in place of those of the recording.
    pub spp: Option<u32>,
}

/// Plays a recording without a window, as fast as it goes, and renders the picture at its end.
///
/// # Errors
/// When it cannot be read, or its scene cannot be opened.
pub fn replay(path: &Path, options: ReplayOptions, stop: &(dyn Fn() -> bool + Sync)) -> Result<Replayed, String> {
    let (header, lines) = read(path)?;
    let failed = |reason: String| format!("{}: {reason}", path.display());
    let source = match &header.scene {
        SceneWord::Builtin(name) => SceneSource::Builtin(name.clone()),
        SceneWord::File(file) => {
            let file = folder_of(path).join(file);
            SceneSource::parse(&file.to_string_lossy()).map_err(|error| failed(error.to_string()))?
        }
    };
    let up = header.up.map(|up| if up == 'z' { UpAxis::Z } else { UpAxis::Y });
    // Nobody looks at the pictures in between: the fewest samples there can be.
    let idle = Target { spp: Some(1), ..Target::default() };
    let mut session = Session::new(SessionOptions {
        width: header.width,
        height: header.height,
        threads: options.threads,
        seed: header.seed,
        target: idle,
        up,
        yielding: false,
        waker: None,
    })?;
    session.open(source);
    let mut player = Player { session, frame: 0, clock: Duration::ZERO, warnings: Vec::new(), edited: 0 };
    let mut end = None;
    for line in lines {
        if stop() {
            return Err(failed("the replay was stopped".to_owned()));
        }
        match line {
            Line::Do(frame, at, command) => player.command(frame, at, command),
            Line::Opened(frame, number, print) => player.wait_for_scene(frame, number, &print, stop).map_err(failed)?,
            Line::End(_, spp) => end = Some(spp),
        }
    }
    player.update();
    let Player { mut session, mut warnings, .. } = player;
    session.send(Command::Pause);
    session.update(Duration::MAX);
    let spp = options.spp.or(end).unwrap_or(0);
    if spp == 0 {
        warnings.push("the recording does not say how many samples its picture had: one each is taken".to_owned());
    }
    let world = session.world();
    let PictureSize { width, height } = *world.resource();
    let extraction = world.resource::<Shown>().extraction.as_ref();
    let snapshot = extraction.map(|extraction| extraction.snapshot.clone());
    let snapshot = snapshot.ok_or_else(|| failed("nothing is open".to_owned()))?;
    let settings = world.resource::<Rendering>().0;
    let mut film = Film::try_new(width.max(1), height.max(1)).map_err(|error| failed(error.to_string()))?;
    let target = Target { spp: Some(spp.max(1)), ..Target::default() };
    let pool = session.pool();
    pool.install(|| render_offline_until(&snapshot, &settings, &mut film, target, stop, |_| true));
    Ok(Replayed { session, film, warnings })
}

impl Replayed {
    /// How the picture is shown.
    pub fn display(&self) -> crate::render::Display {
        self.session.world().resource::<Developing>().0
    }
}

struct Player {
    session: Session,
    /// The frame whose commands are being collected.
    frame: u64,
    clock: Duration,
    warnings: Vec<String>,
    /// How often a file was edited while it was recorded.
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
            // Opening is part of the replay; what changes the disk, or how long it takes, is not.
            Command::SaveScene { .. } | Command::SetThreads { .. } | Command::Pause | Command::Resume => {}
            other => self.session.send(other),
        }
    }

    fn update(&mut self) {
        self.session.world_mut().insert_resource(StopAt(Target { spp: Some(1), ..Target::default() }));
        self.session.update(self.clock);
        // What was asked for beside the picture comes before what is asked for next.
        while self.session.world().resource::<Beside>().is_editing() {
            std::thread::sleep(Duration::from_millis(2));
            self.session.update(self.clock);
        }
    }

    /// Runs frames until the scene with this number is there. One that was read again because its file was edited
    /// does not come again: the file is what it is now.
    fn wait_for_scene(
        &mut self,
        frame: u64,
        number: u64,
        print: &str,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<(), String> {
        /// Reading a scene may take long, but not for ever.
        const PATIENCE: Duration = Duration::from_secs(600);
        self.frame = frame;
        let start = Instant::now();
        let mut was_edited = false;
        loop {
            self.update();
            let world = self.session.world();
            if world.resource::<Adopted>().0 + self.edited >= number {
                break;
            }
            let nothing_comes = world.contains_resource::<CurrentScene>() && world.resource::<Beside>().is_idle();
            if stop() {
                return Err("the replay was stopped".to_owned());
            }
            let errors = self.session.status().messages.iter().filter(|message| message.kind == MessageKind::Error);
            let lines: Vec<&str> = errors.map(|message| message.text.as_str()).collect();
            if !lines.is_empty() && self.session.status().loading.is_none() {
                return Err(lines.join("\n"));
            }
            if nothing_comes {
                (self.edited, was_edited) = (self.edited + 1, true);
                break;
            }
            if start.elapsed() > PATIENCE {
                return Err("the scene did not come".to_owned());
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        // The frame after it belongs to the commands that come next.
        self.frame = frame + 1;
        let current = self.session.world().resource::<CurrentScene>();
        let now = current.0.content_fingerprint().to_string();
        let title = current.0.source.title();
        if now != print && was_edited {
            self.warnings.push(format!(
                "{title} was edited while it was recorded, and is played as it is now: the picture is another one"
            ));
        } else if now != print {
            self.warnings.push(format!("{title} has changed since the recording, so the picture is another one"));
        }
        Ok(())
    }
}

fn read(path: &Path) -> Result<(Header, Vec<Line>), String> {
    let failed = |reason: String| format!("{}: {reason}", path.display());
    let file =
        File::open(path).map_err(|error| failed(format!("cannot be read: {}", crate::scene::plain_io(&error))))?;
    let mut lines = BufReader::new(file).lines().enumerate();
    let no_recording = || failed("is no recording: those are written by --record FILE".to_owned());
    let (_, first) = lines.next().ok_or_else(no_recording)?;
    let first = first.map_err(|_| no_recording())?;
    let header: Header = ron::from_str(&first).map_err(|_| no_recording())?;
    if header.format > FORMAT {
        return Err(failed(format!("was written by {}, in a way that this program does not know", header.program)));
    }
    let mut events = Vec::new();
    let mut lines = lines.peekable();
    while let Some((number, line)) = lines.next() {
        let text = line.map_err(|error| failed(format!("cannot be read: {error}")))?;
        match ron::from_str(&text) {
            Ok(line) => events.push(line),
            // The program was ended while it wrote.
            Err(_) if lines.peek().is_none() => break,
            Err(error) => {
                return Err(format!("{}:{}: cannot be understood: {error}", path.display(), number + 1));
            }
        }
    }
    Ok((header, events))
}

fn folder_of(path: &Path) -> PathBuf {
    absolute(path).parent().map(Path::to_path_buf).unwrap_or_default()
}
