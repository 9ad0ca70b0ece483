//! Runs the frames of a session, as a window does.

use firstlight::frame::{Command, Edit, Property, Session, SessionOptions};
use firstlight::scene::{MaterialProperty, SceneSource};
use std::time::{Duration, Instant};

/// What has a session, and when that began.
pub trait Drive {
    fn session(&mut self) -> (&mut Session, Instant);

    fn frame(&mut self) {
        let (session, start) = self.session();
        session.update(start.elapsed());
    }

    #[track_caller]
    fn run_until(&mut self, done: impl Fn(&Session) -> bool) {
        let start = Instant::now();
        self.frame();
        while !done(self.session().0) {
            std::thread::sleep(Duration::from_millis(3));
            let waits = start.elapsed() < Duration::from_secs(120);
            assert!(waits, "nothing came: {:?}", self.session().0.status());
            self.frame();
        }
    }

    /// Each in a frame of its own.
    fn edit(&mut self, edits: impl IntoIterator<Item = Edit>) {
        for edit in edits {
            self.session().0.send(Command::Edit(edit));
            self.frame();
        }
    }

    #[track_caller]
    fn settle(&mut self) {
        self.run_until(|session| session.status().done && session.is_idle());
    }
}

/// A session with a clock of its own.
pub struct Driver {
    pub session: Session,
    pub start: Instant,
}

impl Drive for Driver {
    fn session(&mut self) -> (&mut Session, Instant) {
        (&mut self.session, self.start)
    }
}

impl Driver {
    /// Begins to open a scene.
    pub fn new(options: SessionOptions, source: SceneSource) -> Self {
        let mut session = Session::new(options).unwrap();
        session.open(source);
        Self { session, start: Instant::now() }
    }
}

/// A property of materials, by its name in scene files.
pub fn of_material(name: &str) -> Property {
    Property::Material(MaterialProperty::named(name).expect("it is in the table"))
}
