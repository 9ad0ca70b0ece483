//! Numbered images: `firstlight render --frames A..B` of an animation, `--turntable N`, and `--bookmarks 1,2,3 --frames N`.

use crate::cli::console::{inform, remark};
use crate::cli::failure::Failure;
use crate::cli::frames::FramesArg;
use crate::cli::job::RenderJob;
use crate::cli::number::counted;
use crate::cli::progress::RenderProgress;
use crate::cli::render_args::RenderArgs;
use crate::cli::sequence::{Sequence, SequenceMotion};
use crate::cli::stop::Stop;
use crate::cli::video;
use firstlight::frame::navigation::Rig;
use firstlight::frame::{
    SettingsStore, Target, along, check_replaced_film, is_whole_picture, read_film_file, turntable,
    write_film_with_features,
};
use firstlight::render::GuideGatherer;
use firstlight::scene::whole_file::{Replace, WholeFile};
use firstlight::scene::{ImageMetadata, ImageSamples};
use std::path::Path;

/// Renders every frame to `FILE-0001.png` and so on; each is an image as any other, and opens as one. What is there
/// already, as it would be rendered, stays.
pub(super) fn animate(
    args: &RenderArgs,
    mut job: RenderJob,
    mut progress: RenderProgress,
    sequence: &Sequence,
    stop: &Stop,
) -> Result<(), Failure> {
    let rigs = match sequence.motion {
        SequenceMotion::Animation => {
            job.set_fps(args)?;
            None
        }
        _ => Some(way(args, &mut job)?),
    };
    let target = job.target(args);
    let replace = args.overwrite.replace();
    let (n, last) = (sequence.len(), sequence.numbers.end.saturating_sub(1));
    let (mut n_kept, mut n_replaced) = (0, 0);
    for (done, number) in sequence.numbers.clone().enumerate() {
        progress.at(done as f64 / n as f64, format!("frame {number} ({} of {n})", done + 1));
        match &rigs {
            Some(rigs) => job.set_rig(&rigs[number as usize - 1]),
            None => job.set_frame(args, number)?,
        }
        let path = sequence.path(&args.output, number);
        let film_path = args.film.as_deref().map(|film| sequence.path(film, number));
        if is_complete(args, &job, &path, film_path.as_deref(), target)? {
            n_kept += 1;
        } else {
            n_replaced += usize::from(path.exists());
            let film = job.picture(args, target)?;
            let features = job.features(args, None)?;
            if let Some(path) = &film_path {
                let claim = WholeFile::claim(path, Replace::Anything)?;
                let note = job.note(&film, path);
                if replace == Replace::AllButFilms {
                    check_replaced_film(&film, features.as_ref(), &note, path)?;
                }
                write_film_with_features(&film, features.as_ref(), &note, claim)?;
            }
            let denoised = job.denoised(&film, &mut GuideGatherer::default(), &|| false)?;
            job.write(args, (&film, features.as_ref()), denoised.as_ref(), &path, replace)?;
        }
        stop.has_saved(format!("{} of {n} frames are saved", done + 1));
    }
    progress.finish();
    let (first, last) = (sequence.path(&args.output, sequence.numbers.start), sequence.path(&args.output, last));
    let replaced = match n_replaced {
        0 => String::new(),
        1 => ", replacing 1 existing file".to_owned(),
        n => format!(", replacing {n} existing files"),
    };
    let kept = if n_kept > 0 { format!(", {n_kept} complete already") } else { String::new() };
    let frames = counted(n, "frame");
    inform(format_args!("{} to {}: {frames}{kept}{replaced}", first.display(), last.display()));
    if let Some(path) = &args.video {
        let images = sequence.numbers.clone().map(|number| sequence.path(&args.output, number));
        video::write(path, images, job.fps(args), replace, stop)?;
        inform(format_args!("{}: {frames} at {} per second", path.display(), job.fps(args)));
    }
    Ok(())
}

/// Whether a frame is there already, as it would be rendered.
fn is_complete(
    args: &RenderArgs,
    job: &RenderJob,
    path: &Path,
    film: Option<&Path>,
    target: Target,
) -> Result<bool, Failure> {
    // Its metadata says how many samples an image has, not how long it took, nor which layers it has.
    let is_told = target.seconds.is_none() && target.error.is_none() && args.layers.is_empty();
    if args.part.is_none() && !is_told {
        return Ok(false);
    }
    let Ok(there) = ImageMetadata::read(path) else { return Ok(false) };
    let samples = ImageSamples { first: 0, spp: there.spp, uneven: there.uneven };
    let note = job.draft.note(path, job.size, samples, job.display);
    let ours = ImageMetadata::from_note(&note).map_err(|error| Failure::Failed(error.into()))?;
    let ours = ImageMetadata { denoised: args.denoise.denoise.then(|| args.denoise.name()), ..ours };
    if ours != there || target.spp.is_some_and(|spp| spp != there.spp) || !is_whole_picture(path) {
        return Ok(false);
    }
    let Some(film) = film else { return Ok(true) };
    // An image is written after its film: what is missing is a film that was not asked for then, or deleted.
    Ok(ImageMetadata::read(film).is_ok_and(|there| ours.differs_from(&there).is_none() && there.spp == ours.spp)
        && read_film_file(film).is_ok())
}

/// Where the camera is in each frame.
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
    let n = match args.frames {
        Some(FramesArg::Count(n)) => n,
        _ => 1,
    };
    Ok(along(&stops, n))
}
