//! A desktop without a screen: an X server in memory, a window manager, and a hand on keys and mouse.
//!
//! Whatever is started here is ended here, by its own handle; everything that could hang has a deadline.
// No test needs all of it.
#![allow(dead_code)]

use std::fs::File;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::Mutex;
use std::time::{Duration, Instant};
use tempfile::TempDir;

mod clipboard;
mod drop;
mod loss;
mod scale;

// Nor does every test lose or scale anything.
#[allow(unused_imports)]
pub use {
    loss::{Losing, Loss},
    scale::Scale,
};

const TOOLS: &[&str] = &["Xvfb", "openbox", "xdotool", "wmctrl", "import"];
/// Far more than anything here takes, even where other work holds the processors.
const PATIENCE: Duration = Duration::from_secs(90);

pub struct Desktop {
    // Ended in this order.
    _window_manager: Ended,
    server: Mutex<Ended>,
    display: String,
    folder: TempDir,
}

/// A process that does not outlive its test.
pub struct Ended(Child);

impl Drop for Ended {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Desktop {
    /// `None`, with a line that says so, where the tools are missing; under CI that is a failure.
    pub fn start() -> Option<Self> {
        let folders: Vec<PathBuf> = std::env::split_paths(&std::env::var_os("PATH").unwrap_or_default()).collect();
        let is_there = |tool: &&&str| folders.iter().any(|folder| folder.join(tool).is_file());
        let missing: Vec<&str> = TOOLS.iter().filter(|tool| !is_there(tool)).copied().collect();
        if !missing.is_empty() {
            let advice = format!("window test: {} missing; scripts/test installs what it needs", missing.join(", "));
            assert!(std::env::var_os("CI").is_none_or(|ci| ci.is_empty() || ci == "false"), "{advice}");
            // Past the capture of the test harness, so that it is seen.
            let _ = writeln!(std::io::stderr(), "SKIPPED {advice}");
            return None;
        }
        let folder = tempfile::tempdir().expect("a folder for the test");
        // The question of the first start would cover what tests look at.
        let settings = folder.path().join("config/firstlight");
        std::fs::create_dir_all(&settings).expect("a folder for settings");
        std::fs::write(settings.join("settings.ron"), "(greeted: true)").expect("settings");
        let number_file = folder.path().join("display");
        // Without `-noreset` the server starts over when its last window goes.
        let server = Command::new("sh")
            .args(["-c", "exec Xvfb -displayfd 3 -screen 0 1600x1000x24 -nolisten tcp -noreset 3>\"$0\""])
            .arg(&number_file)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .map(Ended)
            .expect("Xvfb starts");
        let number = until("Xvfb to be ready", || {
            let number = std::fs::read_to_string(&number_file).ok()?;
            number.ends_with('\n').then(|| number.trim().to_owned())
        });
        let display = format!(":{number}");
        // A window without a manager has no focus, and gets no keys. A window that opens while the manager is starting
        // may never be shown; it runs this command when it is done.
        let ready_file = folder.path().join("manager");
        let mut manager = Command::new("openbox");
        manager.arg("--startup").arg(format!("touch '{}'", ready_file.display()));
        let window_manager = quiet(&mut manager, &display, &folder).spawn().map(Ended).expect("openbox starts");
        let desktop = Self { _window_manager: window_manager, server: Mutex::new(server), display, folder };
        until("openbox to be ready", || ready_file.exists().then_some(()));
        Some(desktop)
    }

    /// Where programs run, and keep their pictures.
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// Where the program keeps its settings and bookmarks.
    pub fn settings(&self) -> PathBuf {
        self.folder().join("config/firstlight")
    }

    /// The screen is gone, as when a cable is pulled or a session ends.
    pub fn lose(&self) {
        let mut server = self.server.lock().expect("nobody else holds it");
        server.0.kill().expect("the server can be ended");
        server.0.wait().expect("it has ended");
    }

    /// The text on the clipboard of the desktop.
    pub fn clipboard(&self) -> String {
        clipboard::text(&self.display)
    }

    /// What programs that are opened from now on ask for the scale of the screen.
    pub fn scale(&self) -> Scale {
        Scale::new(&self.display)
    }

    /// Starts the program and waits for its window.
    pub fn open(&self, arguments: &[&str], environment: &[(&str, &str)]) -> Program<'_> {
        let path = |name| self.folder().join(name);
        let create = |name| File::create(path(name)).expect("a file for what it says");
        let mut command = Command::new(env!("CARGO_BIN_EXE_firstlight"));
        quiet(&mut command, &self.display, &self.folder)
            .args(arguments)
            .envs(environment.iter().copied())
            .current_dir(self.folder())
            .stdout(create("stdout"))
            .stderr(create("stderr"));
        let child = command.spawn().map(Ended).expect("firstlight starts");
        let mut program = Program { desktop: self, child, window: String::new() };
        let process = program.child.0.id().to_string();
        program.window = until("the window to open", || {
            program.must_live();
            let found =
                self.tool("xdotool", &["search", "--onlyvisible", "--pid", &process, "--name", "firstlight"])?;
            found.lines().last().map(str::to_owned)
        });
        program.focus();
        program
    }

    /// Runs the program, which is to leave by itself without a window; how, and what it said.
    pub fn fails(&self, arguments: &[&str], environment: &[(&str, &str)]) -> (ExitStatus, String) {
        let errors = self.folder().join("stderr");
        let mut command = Command::new(env!("CARGO_BIN_EXE_firstlight"));
        quiet(&mut command, &self.display, &self.folder).args(arguments).current_dir(self.folder());
        command.envs(environment.iter().copied());
        command.stderr(File::create(&errors).expect("a file for what it says"));
        let mut child = command.spawn().map(Ended).expect("firstlight starts");
        let status = wait(&mut child.0, PATIENCE).expect("it leaves by itself");
        (status, std::fs::read_to_string(errors).expect("what it said"))
    }

    /// What a tool prints; `None` if it fails or hangs.
    fn tool(&self, tool: &str, arguments: &[&str]) -> Option<String> {
        let mut command = Command::new(tool);
        quiet(&mut command, &self.display, &self.folder).args(arguments).stdout(Stdio::piped());
        let mut child = command.spawn().map(Ended).expect("a tool that was there a moment ago");
        let status = wait(&mut child.0, Duration::from_secs(20))?;
        let mut printed = String::new();
        std::io::Read::read_to_string(&mut child.0.stdout.take()?, &mut printed).ok()?;
        status.success().then_some(printed)
    }
}

/// A window of firstlight.
pub struct Program<'a> {
    desktop: &'a Desktop,
    child: Ended,
    window: String,
}

impl Drop for Program<'_> {
    /// A test that fails says what the program was doing.
    fn drop(&mut self) {
        if !std::thread::panicking() {
            return;
        }
        let process = self.child.0.id();
        let read = |path: &Path| std::fs::read_to_string(path).unwrap_or_default().trim_end().to_owned();
        eprintln!("window {}, keyboard {:?}", self.window, self.desktop.tool("xdotool", &["getwindowfocus"]));
        for task in std::fs::read_dir(format!("/proc/{process}/task")).into_iter().flatten().flatten() {
            let [stat, waits] = ["stat", "wchan"].map(|name| read(&task.path().join(name)));
            eprintln!("{}, {waits}", stat.split_whitespace().take(15).collect::<Vec<_>>().join(" "));
        }
        eprintln!("{}", self.errors());
    }
}

impl Program<'_> {
    pub fn focus(&self) {
        until("the window to take the keyboard", || {
            self.desktop.tool("xdotool", &["windowactivate", &self.window]);
            let focused = self.desktop.tool("xdotool", &["getwindowfocus"])?;
            (focused.trim() == self.window).then_some(())
        });
    }

    /// Drops a file on the middle of the window.
    pub fn drop_file(&self, path: &Path) {
        drop::drop_file(&self.desktop.display, self.window.parse().expect("a window's number"), path);
    }

    /// Moves the mouse to this place of the window.
    pub fn point_at(&self, x: i32, y: i32) {
        self.xdotool(&format!("mousemove --window {} {x} {y}", self.window));
    }

    /// Types a text, as into a field.
    pub fn type_text(&self, text: &str) {
        assert!(self.desktop.tool("xdotool", &["type", "--delay", "20", text]).is_some(), "{}", self.errors());
    }

    /// Names of its threads.
    pub fn threads(&self) -> Vec<String> {
        let tasks = std::fs::read_dir(format!("/proc/{}/task", self.child.0.id())).expect("a live process");
        // A thread may end while it is looked at.
        let names = tasks.filter_map(|task| std::fs::read_to_string(task.ok()?.path().join("comm")).ok());
        names.map(|name| name.trim_end().to_owned()).collect()
    }

    /// Runs xdotool with these words.
    pub fn xdotool(&self, words: &str) {
        let words: Vec<&str> = words.split_whitespace().collect();
        assert!(self.desktop.tool("xdotool", &words).is_some(), "xdotool {words:?} failed\n{}", self.errors());
    }

    pub fn key(&self, keys: &str) {
        self.xdotool(&format!("key {keys}"));
    }

    /// Shows the raw image and pauses: a denoised one could still come, and change what stood still.
    pub fn pause_raw(&self) {
        self.key("F2 F2 p");
    }

    /// Holds a key for so many milliseconds.
    pub fn hold(&self, key: &str, ms: u64) {
        self.xdotool(&format!("keydown {key}"));
        std::thread::sleep(Duration::from_millis(ms));
        self.xdotool(&format!("keyup {key}"));
    }

    /// Drags with a button from here by so many pixels, in steps as a hand does.
    pub fn drag(&self, button: u32, from: (i32, i32), by: (i32, i32)) {
        self.xdotool(&format!("mousemove --window {} {} {} mousedown {button}", self.window, from.0, from.1));
        // What is under the pointer is known to the next frame, which may take long beside other tests.
        std::thread::sleep(Duration::from_millis(200));
        for step in 1..=5 {
            let (x, y) = (from.0 + by.0 * step / 5, from.1 + by.1 * step / 5);
            self.xdotool(&format!("mousemove --window {} {x} {y}", self.window));
            std::thread::sleep(Duration::from_millis(30));
        }
        self.xdotool(&format!("mouseup {button}"));
    }

    /// Tells the process something, such as `TERM`.
    pub fn signal(&self, name: &str) {
        let told = Command::new("kill").args([format!("-{name}"), self.child.0.id().to_string()]).status();
        assert!(told.expect("a command of every system").success(), "{}", self.errors());
    }

    pub fn resize(&self, width: u32, height: u32) {
        self.xdotool(&format!("windowsize {} {width} {height}", self.window));
    }

    pub fn minimise(&self) {
        self.xdotool(&format!("windowminimize {}", self.window));
    }

    /// The cross in the corner of the window.
    pub fn close(&self) {
        assert!(self.desktop.tool("wmctrl", &["-i", "-c", &self.window]).is_some(), "wmctrl failed");
    }

    /// What is on the screen where the window is.
    pub fn pixels(&self) -> image::RgbImage {
        let path = self.desktop.folder().join("screen.png");
        let target = path.to_str().expect("a temporary folder with a plain name");
        until("a picture of the window", || {
            self.desktop.tool("import", &["-window", &self.window, target])?;
            Some(image::open(&path).ok()?.to_rgb8())
        })
    }

    pub fn title(&self) -> String {
        self.desktop.tool("xdotool", &["getwindowname", &self.window]).unwrap_or_default().trim().to_owned()
    }

    /// All that was printed.
    pub fn output(&self) -> String {
        std::fs::read_to_string(self.desktop.folder().join("stdout")).unwrap_or_default()
    }

    pub fn errors(&self) -> String {
        std::fs::read_to_string(self.desktop.folder().join("stderr")).unwrap_or_default()
    }

    pub fn must_live(&mut self) {
        let ended = self.child.0.try_wait().expect("the state of a child");
        assert!(ended.is_none(), "firstlight ended with {ended:?}\n{}", self.errors());
    }

    /// Processor time used so far.
    pub fn cpu_seconds(&self) -> f64 {
        let stat = std::fs::read_to_string(format!("/proc/{}/stat", self.child.0.id())).expect("a live process");
        // The name, in brackets, may hold blanks; user and system time are the 12th and 13th field behind it.
        let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or("").split_whitespace().collect();
        let ticks: f64 = [fields[11], fields[12]].iter().map(|ticks| ticks.parse::<f64>().expect("a number")).sum();
        // Linux tells user space that a second has 100 of them, whatever the kernel counts in.
        ticks / 100.0
    }

    /// Waits for it to leave for whatever reason; how, and all that it said.
    pub fn left(mut self) -> (ExitStatus, String) {
        let Some(status) = wait(&mut self.child.0, PATIENCE) else { panic!("it does not leave\n{}", self.errors()) };
        (status, self.errors())
    }

    /// Waits for it to leave by itself.
    pub fn ended(mut self) -> ExitStatus {
        let Some(status) = wait(&mut self.child.0, PATIENCE) else { panic!("it does not quit\n{}", self.errors()) };
        let errors = self.errors();
        assert!(!errors.contains("panicked") && !errors.contains("error"), "{errors}");
        status
    }
}

/// A command on this display and no other, with nothing to read and nothing to say.
fn quiet<'a>(command: &'a mut Command, display: &str, folder: &TempDir) -> &'a mut Command {
    command
        .env("DISPLAY", display)
        .env("XDG_RUNTIME_DIR", folder.path())
        .env("XDG_CONFIG_HOME", folder.path().join("config"))
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("WAYLAND_SOCKET")
        .env_remove("RUST_LOG")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
}

/// Waits for a process, so long at most.
pub fn wait(child: &mut Child, patience: Duration) -> Option<ExitStatus> {
    let start = Instant::now();
    while start.elapsed() < patience {
        if let Some(status) = child.try_wait().expect("the state of a child") {
            return Some(status);
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    None
}

/// Asks again and again until there is an answer.
pub fn until<T>(what: &str, mut ask: impl FnMut() -> Option<T>) -> T {
    let start = Instant::now();
    loop {
        if let Some(answer) = ask() {
            return answer;
        }
        assert!(start.elapsed() < PATIENCE, "waited {PATIENCE:?} for {what}");
        std::thread::sleep(Duration::from_millis(30));
    }
}
