//! `firstlight render --turntable N` and `--bookmarks 1,2,3 --frames N`: numbered images of a moving camera.

use super::console::{inform, remark};
use super::failure::Failure;
use super::job::RenderJob;
use super::progress::Progress;
use super::render_args::RenderArgs;
use super::stop::Stop;
use firstlight::frame::navigation::Rig;
use firstlight::frame::{SettingsStore, Target, along, turntable};
use firstlight::scene::{ImageMetadata, ImageSamples};
use std::ffi::OsStr;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// The frames to render.
pub(super) struct Sequence {
    /// Frame indices, from 0.
    pub frames: Range<usize>,
    /// Whether existing frames are kept.
    pub is_part: bool,
    /// Number of existing images that are replaced.
    pub n_replaced: usize,
}

/// Renders every frame to `FILE-0001.png` and so on; each has its own metadata and opens like any other image.
pub(super) fn animate(
    args: &RenderArgs,
    mut job: RenderJob,
    mut progress: Progress,
    sequence: &Sequence,
    stop: &Stop,
) -> Result<(), Failure> {
    let rigs = way(args, &mut job)?;
    let target = job.target(args);
    let digits = digits(rigs.len());
    let replace = args.overwrite.replace();
    let frames = &sequence.frames;
    for (done, i) in frames.clone().enumerate() {
        progress.at(done as f64 / frames.len() as f64, format!("frame {} of {}", i + 1, rigs.len()));
        job.set_rig(&rigs[i]);
        let path = numbered(&args.output, i + 1, digits);
        if !(sequence.is_part && is_complete(&job, &path, target)?) {
            let film = job.picture(args, target)?;
            let features = job.features(args, None)?;
            let denoised = job.denoised(args, &film, &|| false);
            job.write(args, (&film, features.as_ref()), denoised.as_ref(), &path, replace)?;
        }
        stop.has_saved(format!("{} of {} frames are saved", done + 1, frames.len()));
    }
    progress.finish();
    let (first, last) = (numbered(&args.output, frames.start + 1, digits), numbered(&args.output, frames.end, digits));
    let replaced = match sequence.n_replaced {
        0 => String::new(),
        1 => ", replacing 1 existing file".to_owned(),
        n => format!(", replacing {n} existing files"),
    };
    inform(format_args!("{} to {}: {} frames{replaced}", first.display(), last.display(), frames.len()));
    Ok(())
}

/// Whether a frame exists already with the metadata that it would be rendered with.
fn is_complete(job: &RenderJob, path: &Path, target: Target) -> Result<bool, Failure> {
    let Ok(there) = ImageMetadata::read(path) else { return Ok(false) };
    let samples = ImageSamples { first: 0, spp: there.spp, uneven: there.uneven };
    let note = job.draft.note(path, job.size, samples, job.display.into());
    let ours = ImageMetadata::from_note(&note).map_err(|error| Failure::Failed(error.into()))?;
    Ok(ours == there && target.spp.is_none_or(|spp| spp == there.spp))
}

/// The names of all images of an animation; `None` for a single image.
pub(super) fn frames(args: &RenderArgs) -> Option<impl Iterator<Item = PathBuf>> {
    let n = args.turntable.or(args.bookmarks.as_ref().and(args.frames))? as usize;
    Some((1..=n).map(move |number| numbered(&args.output, number, digits(n))))
}

fn digits(n: usize) -> usize {
    n.to_string().len().max(4)
}

/// The camera of each frame.
fn way(args: &RenderArgs, job: &mut RenderJob) -> Result<Vec<Rig>, Failure> {
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
            Failure::Failed(format!("{} has no bookmark {number} (it has {known})", source.title()))
        })
    };
    let stops: Vec<Rig> = numbers.iter().map(stop).collect::<Result<_, _>>()?;
    Ok(along(&stops, args.frames.unwrap_or(1)))
}

/// Returns `FILE-0007.png` for `FILE.png`.
fn numbered(path: &Path, number: usize, digits: usize) -> PathBuf {
    let mut name = path.file_stem().map_or_else(|| "frame".into(), OsStr::to_os_string);
    name.push(format!("-{number:0digits$}."));
    name.push(path.extension().unwrap_or(OsStr::new("png")));
    path.with_file_name(name)
}
