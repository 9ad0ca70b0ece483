//! A video of numbered images, encoded by `ffmpeg` where that is installed: its standard input gets raw RGB.

use crate::cli::failure::Failure;
use crate::cli::stop::Stop;
use firstlight::scene::NewFolder;
use firstlight::scene::input_file::{FileKind, InputFile};
use firstlight::scene::whole_file::{Replace, check_writable};
use std::ffi::{OsStr, OsString};
use std::io::{self, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

const PROGRAM: &str = "ffmpeg";

/// Whether there can be a video: before the first frame is rendered.
pub fn check(args: &crate::cli::render_args::RenderArgs) -> Result<(), Failure> {
    let Some(path) = &args.video else { return Ok(()) };
    if path.extension().is_none() {
        let message = "the name of a video needs an extension that says its format, such as .mp4 or .webm";
        return Err(Failure::Usage(format!("{}: {message}", path.display())));
    }
    if args.picture_format()? != firstlight::frame::PictureFormat::Png {
        return Err(Failure::Usage("--video is made of .png images: choose -o FILE.png".to_owned()));
    }
    let found = Command::new(PROGRAM).arg("-version").stdin(Stdio::null()).stdout(Stdio::null()).output();
    match found {
        Ok(output) if output.status.success() => Ok(()),
        _ => Err(Failure::Failed(format!(
            "--video needs the program {PROGRAM}, which was not found: install it, or render the frames without --video"
        ))),
    }
}

/// Encodes images in their order.
///
/// - `fps`: frames per second.
pub fn write(
    path: &Path,
    images: impl Iterator<Item = PathBuf>,
    fps: f64,
    replace: Replace,
    stop: &Stop,
) -> Result<(), Failure> {
    check_writable(path, replace)?;
    // In a folder of its own until it is whole: a name beside the images could be a link to any file. The extension
    // tells the format.
    let folder = NewFolder::begin(path)?;
    let name = OsString::from_iter([OsStr::new("video."), path.extension().unwrap_or_default()]);
    encode(&folder.part().join(&name), images, fps, stop)?;
    Ok(folder.finish_file(&name)?)
}

/// A program that runs; if this is dropped, or the command is abandoned, it is ended.
struct Encoder(Arc<Mutex<Child>>);

impl Encoder {
    fn new(child: Child, stop: &Stop) -> Self {
        let child = Arc::new(Mutex::new(child));
        let abandoned = child.clone();
        stop.undo(move || kill(&abandoned));
        Self(child)
    }

    /// Waits for its end.
    fn wait(&self) -> io::Result<ExitStatus> {
        loop {
            // Not locked for long, so that it can be ended meanwhile.
            if let Some(status) = self.0.lock().unwrap_or_else(PoisonError::into_inner).try_wait()? {
                return Ok(status);
            }
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

impl Drop for Encoder {
    fn drop(&mut self) {
        kill(&self.0);
    }
}

fn kill(child: &Mutex<Child>) {
    let mut child = child.lock().unwrap_or_else(PoisonError::into_inner);
    // It may have ended.
    let _ = child.kill();
    let _ = child.wait();
}

/// Reads all that a program says, which would else wait to be heard, and keeps the last kilobytes.
fn last_words(mut from: impl Read) -> String {
    const KEPT: usize = 1 << 14;
    let (mut kept, mut buffer) = (Vec::new(), vec![0; KEPT]);
    while let Ok(n @ 1..) = from.read(&mut buffer) {
        kept.extend_from_slice(&buffer[..n]);
        kept.drain(..kept.len().saturating_sub(KEPT));
    }
    String::from_utf8_lossy(&kept).into_owned()
}

fn encode(path: &Path, images: impl Iterator<Item = PathBuf>, fps: f64, stop: &Stop) -> Result<(), Failure> {
    let failed = |what: String| Failure::Failed(format!("{PROGRAM}: {what}"));
    let mut images = images.map(|path| rgb_of(&path)).peekable();
    let (width, height) = match images.peek() {
        Some(Ok((size, _))) => *size,
        _ => (0, 0),
    };
    let mut child = Command::new(PROGRAM)
        .args(["-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24"])
        .args(["-video_size", &format!("{width}x{height}"), "-framerate", &fps.to_string(), "-i", "-"])
        // Most players know nothing but 4:2:0, which needs even sides.
        .args(["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p"])
        .arg(path)
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|error| failed(error.to_string()))?;
    let mut input = child.stdin.take().expect("it was asked for");
    let errors = child.stderr.take().expect("it was asked for");
    let encoder = Encoder::new(child, stop);
    let said = std::thread::spawn(move || last_words(errors));
    let mut sent = Ok(());
    for image in images {
        let (size, rgb) = image?;
        if size != (width, height) {
            sent = Err(format!("a frame has {} x {} pixels, not {width} x {height}", size.0, size.1));
            break;
        }
        if let Err(error) = input.write_all(&rgb) {
            sent = Err(error.to_string());
            break;
        }
    }
    drop(input);
    let status = encoder.wait().map_err(|error| failed(error.to_string()))?;
    if !status.success() {
        let said = said.join().unwrap_or_default();
        return Err(failed(said.lines().last().unwrap_or("it failed without a message").to_owned()));
    }
    sent.map_err(failed)
}

/// Size and pixels of a PNG that this program has written.
fn rgb_of(path: &Path) -> Result<((u32, u32), Vec<u8>), Failure> {
    let failed = |error: &dyn std::fmt::Display| Failure::Failed(format!("{}: {error}", path.display()));
    let file = InputFile::open(path, FileKind::Image).map_err(|error| failed(&error))?;
    let mut reader = png::Decoder::new(BufReader::new(file)).read_info().map_err(|error| failed(&error))?;
    let info = reader.info();
    let size = (info.width, info.height);
    if (info.color_type, info.bit_depth) != (png::ColorType::Rgb, png::BitDepth::Eight) {
        return Err(failed(&"is not an 8-bit RGB image"));
    }
    let mut rgb = vec![0; size.0 as usize * size.1 as usize * 3];
    reader.next_frame(&mut rgb).map_err(|error| failed(&error))?;
    Ok((size, rgb))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Longer than a pipe holds.
    #[test]
    fn of_many_words_the_last_are_kept() {
        let words = "e\n".repeat(100_000) + "no such codec\n";
        let said = last_words(words.as_bytes());
        assert_eq!((said.lines().last(), said.len()), (Some("no such codec"), 1 << 14));
    }
}
