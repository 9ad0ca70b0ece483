//! `firstlight render --turntable N` and `--bookmarks 1,2,3 --frames N`: numbered pictures of a camera that moves.

use super::Failure;
use super::console::remark;
use super::progress::Progress;
use super::render::{Job, RenderArgs};
use super::stop::Stop;
use firstlight::frame::navigation::Rig;
use firstlight::frame::{SettingsStore, along, turntable};
use std::path::{Path, PathBuf};

/// Renders every frame to `FILE-0001.png` and so on; each is a picture as any other, and opens as one.
pub(super) fn animate(args: &RenderArgs, mut job: Job, mut progress: Progress, stop: &Stop) -> Result<(), Failure> {
    let rigs = way(args, &mut job)?;
    let target = job.target(args);
    let digits = rigs.len().to_string().len().max(4);
    for (i, rig) in rigs.iter().enumerate() {
        progress.at(i as f64 / rigs.len() as f64, format!("picture {} of {}", i + 1, rigs.len()));
        job.set_rig(rig);
        let film = job.picture(args, target, stop)?;
        if stop.is_asked() {
            progress.finish();
            return Err(Failure::Stopped(format!("stopped after {i} of {} pictures", rigs.len())));
        }
        job.write(&film, &numbered(&args.output, i + 1, digits))?;
    }
    progress.finish();
    let (first, last) = (numbered(&args.output, 1, digits), numbered(&args.output, rigs.len(), digits));
    remark(format_args!("{} to {}: {} pictures", first.display(), last.display(), rigs.len()));
    Ok(())
}

/// Where the camera is in each frame.
fn way(args: &RenderArgs, job: &mut Job) -> Result<Vec<Rig>, Failure> {
    let rig = job.rig().ok_or_else(|| Failure::Failed("the scene has no camera".to_owned()))?;
    if let Some(n) = args.turntable {
        return Ok(turntable(&rig, n));
    }
    let source = &job.scene.source;
    let (bookmarks, trouble) = SettingsStore::of_platform().bookmarks(source);
    if let Some(trouble) = trouble {
        remark(format_args!("warning: {trouble}"));
    }
    let numbers = args.bookmarks.as_deref().unwrap_or_default();
    let stop = |number: &u8| {
        bookmarks.views.get(number).copied().ok_or_else(|| {
            let known: Vec<String> = bookmarks.views.keys().map(u8::to_string).collect();
            let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
            Failure::Failed(format!("{} has no view under {number} (there are: {known})", source.title()))
        })
    };
    let stops: Vec<Rig> = numbers.iter().map(stop).collect::<Result<_, _>>()?;
    Ok(along(&stops, args.frames.unwrap_or(1)))
}

/// `FILE-0007.png` of `FILE.png`.
fn numbered(path: &Path, number: usize, digits: usize) -> PathBuf {
    let stem = path.file_stem().map_or("frame".into(), |stem| stem.to_string_lossy());
    let extension = path.extension().map_or("png".into(), |extension| extension.to_string_lossy());
    path.with_file_name(format!("{stem}-{number:0digits$}.{extension}"))
}
