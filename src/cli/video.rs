//! A video of numbered images, encoded by `ffmpeg` where that is installed: its standard input gets raw RGB.

use crate::cli::failure::Failure;
use firstlight::scene::input_file::{FileKind, InputFile};
use firstlight::scene::whole_file::{Replace, check_writable};
use std::io::{BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

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
pub fn write(path: &Path, images: impl Iterator<Item = PathBuf>, fps: f64, replace: Replace) -> Result<(), Failure> {
    check_writable(path, replace)?;
    // Under another name until it is whole; the extension tells the format.
    let mut name = std::ffi::OsString::from(".unfinished-");
    name.push(path.file_name().unwrap_or_default());
    let unfinished = path.with_file_name(name);
    let result = encode(&unfinished, images, fps);
    if result.is_err() {
        let _ = std::fs::remove_file(&unfinished);
    }
    result?;
    std::fs::rename(&unfinished, path).map_err(|error| Failure::Failed(format!("{}: {error}", path.display())))
}

fn encode(path: &Path, images: impl Iterator<Item = PathBuf>, fps: f64) -> Result<(), Failure> {
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
    let output = child.wait_with_output().map_err(|error| failed(error.to_string()))?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
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
