//! The only way to a terminal: results on standard output, all else on standard error, every line of it fit to be
//! printed ([`printable`]).
//!
//! What is said is a [`Message`], whose lines are known: a line end within a line came from a foreign name, and is
//! escaped like anything else that does not print. JSON goes out as it is. `tests/source/gates.rs` looks for any other way.

use crate::files::printable;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::backtrace::{Backtrace, BacktraceStatus};
use std::fmt;
use std::io::{self, ErrorKind, IsTerminal, Write};
use std::panic::PanicHookInfo;
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether only warnings and errors are printed beside results.
static QUIET: AtomicBool = AtomicBool::new(false);

/// Whether everything is listed that is otherwise summarised.
static VERBOSE: AtomicBool = AtomicBool::new(false);

/// From now on, [`is_verbose`] is true.
pub fn be_verbose() {
    VERBOSE.store(true, Ordering::Relaxed);
}

/// Whether the user wants details.
pub fn is_verbose() -> bool {
    VERBOSE.load(Ordering::Relaxed)
}

/// From now on, [`inform`] prints nothing and no [`Bar`] is shown.
pub fn be_quiet() {
    QUIET.store(true, Ordering::Relaxed);
}

/// Something that can be said.
pub trait Message {
    /// Its lines, fit to be printed, with line ends between them.
    fn text(&self) -> String;
}

impl Message for str {
    fn text(&self) -> String {
        printable::line(self).into_owned()
    }
}

impl Message for String {
    fn text(&self) -> String {
        self.as_str().text()
    }
}

impl Message for fmt::Arguments<'_> {
    fn text(&self) -> String {
        self.to_string().text()
    }
}

/// A line each.
impl Message for Vec<String> {
    fn text(&self) -> String {
        self.iter().map(|line| printable::line(line)).collect::<Vec<_>>().join("\n")
    }
}

/// For machines: one line, in which the format itself escapes what would end it.
impl Message for serde_json::Value {
    fn text(&self) -> String {
        printable::json(&self.to_string()).into_owned()
    }
}

impl<M: Message + ?Sized> Message for &M {
    fn text(&self) -> String {
        (**self).text()
    }
}

/// The lines of a text whose line ends are the program's own.
pub fn lines(text: &str) -> Vec<String> {
    text.lines().map(str::to_owned).collect()
}

/// Prints a part of a command's result.
///
/// A closed pipe (`| head`) is not an error.
pub fn print(message: impl Message) -> io::Result<()> {
    let mut out = io::stdout().lock();
    match writeln!(out, "{}", message.text()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error),
        _ => Ok(()),
    }
}

/// Writes a result that is no text to standard output: as it is, with nothing around it.
///
/// # Errors
/// As [`print`].
pub fn print_bytes(bytes: &[u8]) -> io::Result<()> {
    let mut out = io::stdout().lock();
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error),
        _ => Ok(()),
    }
}

/// Whether standard output is a terminal, which should not receive the bytes of an image.
pub fn prints_to_terminal() -> bool {
    io::stdout().is_terminal()
}

/// Prints something beside the result that is good to know, unless the program is to [`be_quiet`].
pub fn inform(message: impl Message) {
    if !QUIET.load(Ordering::Relaxed) {
        remark(message);
    }
}

/// Prints a warning or an error beside the result.
pub fn remark(message: impl Message) {
    // If stderr is closed, there is nowhere to report the error.
    let _ = writeln!(io::stderr().lock(), "{}", message.text());
}

/// Prints panic messages through [`remark`], so that names from foreign files are escaped.
pub fn tell_panics() {
    std::panic::set_hook(Box::new(|panic| remark(panic_lines(panic, &Backtrace::capture()))));
}

fn panic_lines(panic: &PanicHookInfo, trace: &Backtrace) -> Vec<String> {
    let thread = std::thread::current();
    let name = thread.name().unwrap_or("without a name");
    let place = panic.location().map_or(String::new(), |place| format!(" at {place}"));
    let message = panic.payload_as_str().unwrap_or("no message");
    let mut told = vec![
        format!("error: the program has a fault, please report it: thread {name} panicked{place}"),
        message.to_owned(),
    ];
    match trace.status() {
        BacktraceStatus::Captured => told.extend(lines(&trace.to_string())),
        _ => told.push("set RUST_BACKTRACE=1 to see where it came from".to_owned()),
    }
    told
}

/// Clears the line of a terminal in which a bar was; errors are ignored.
pub fn clear_line() {
    let mut out = io::stderr().lock();
    if out.is_terminal() {
        let _ = write!(out, "\r\x1b[K");
    }
}

/// Where a log goes: each write is an event, and becomes a line.
#[derive(Clone, Copy, Debug, Default)]
pub struct LogWriter;

impl Write for LogWriter {
    fn write(&mut self, event: &[u8]) -> io::Result<usize> {
        let text = String::from_utf8_lossy(event);
        remark(text.trim_end_matches('\n'));
        Ok(event.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        io::stderr().flush()
    }
}

/// How far something is: a bar on a terminal, nothing in a pipe or a log.
#[derive(Clone, Debug)]
pub struct Bar(ProgressBar);

impl Bar {
    /// Whether there is somebody who could look at one.
    pub fn is_watched() -> bool {
        !QUIET.load(Ordering::Relaxed) && io::stderr().is_terminal()
    }

    pub fn new(length: u64) -> Self {
        let target = if Self::is_watched() { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let style = ProgressStyle::with_template("{bar:32} {percent:>3} %  {msg}  {elapsed} (left: {eta})")
            .expect("the template is well formed");
        Self(ProgressBar::with_draw_target(Some(length.max(1)), target).with_style(style))
    }

    /// What is being done.
    pub fn set_message(&self, message: impl Message) {
        self.0.set_message(message.text());
    }

    pub fn set_position(&self, position: u64) {
        self.0.set_position(position);
    }

    pub fn inc(&self, by: u64) {
        self.0.inc(by);
    }

    /// Prints past the bar.
    pub fn suspend<T>(&self, print: impl FnOnce() -> T) -> T {
        self.0.suspend(print)
    }

    pub fn finish_and_clear(&self) {
        self.0.finish_and_clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_has_the_lines_that_the_program_gave_it() {
        assert_eq!("one\ntwo".text(), "one\\u{a}two");
        assert_eq!(format_args!("{}\x1b", 1).text(), "1\\u{1b}");
        assert_eq!(vec!["one\r".to_owned(), "two\u{202e}".to_owned()].text(), "one\\u{d}\ntwo\\u{202e}");
        assert_eq!(lines("one\ntwo\n").text(), "one\ntwo");
    }

    #[test]
    fn a_panic_is_told_in_lines_that_print() {
        static TOLD: std::sync::Mutex<Option<String>> = std::sync::Mutex::new(None);
        let usual = std::panic::take_hook();
        // Other tests panic side by side, on purpose.
        std::panic::set_hook(Box::new(move |panic| match std::thread::current().name() {
            Some("\u{1b}[31m") => {
                *TOLD.lock().unwrap() = Some(panic_lines(panic, &Backtrace::disabled()).text());
            }
            _ => usual(panic),
        }));
        let thread = std::thread::Builder::new().name("\u{1b}[31m".to_owned());
        let name = "a\u{202e}b\nerror: forged";
        assert!(thread.spawn(move || panic!("no mesh `{name}`")).unwrap().join().is_err());
        let _ = std::panic::take_hook();
        let told = TOLD.lock().unwrap().take().unwrap();
        let mut told = told.lines();
        let first = told.next().unwrap();
        assert!(first.contains("thread \\u{1b}[31m panicked at src/console.rs:"), "{first}");
        assert_eq!(told.next(), Some("no mesh `a\\u{202e}b\\u{a}error: forged`"));
        assert_eq!(told.count(), 1);
    }

    #[test]
    fn json_is_exact() {
        let value = serde_json::json!({ "name": "a\u{202e}\u{1b}\n".repeat(9999) });
        assert_eq!(serde_json::from_str::<serde_json::Value>(&value.text()).unwrap(), value);
    }
}
