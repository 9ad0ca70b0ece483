//! `firstlight render SCENE --part I/N --film part.exr`: renders one part of an image; may be run any number of times.
//!
//! A complete part is recognised and skipped; an interrupted one is resumed from its last film, which is saved every
//! minute by default. Exit status: 0 done, 75 try again, 2 wrong input.

use crate::cli::animate::animate;
use crate::cli::console::{inform, remark};
use crate::cli::failure::Failure;
use crate::cli::job::RenderJob;
use crate::cli::progress::RenderProgress;
use crate::cli::render_args::{PartBy, RenderArgs};
use crate::cli::sequence::Sequence;
use crate::cli::stop::Stop;
use firstlight::cluster::coverage::in_words;
use firstlight::cluster::part::Part;
use firstlight::frame::{
    FeatureLayers, Target, read_film_file, read_film_summary, render_region_until, write_film_with_features,
};
use firstlight::render::{Film, Region, worker_threads};
use firstlight::scene::whole_file::{Replace, WholeFile};
use firstlight::scene::{FileKind, Files, InputFile};
use glam::UVec2;
use std::mem::ManuallyDrop;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Placeholder for the number of the part in the name of a film.
const NUMBER: &str = "{part}";

/// Renders the part given by `args`.
///
/// - `merged`: the film of earlier rounds, which the part is added to.
pub fn run(args: &RenderArgs, merged: Option<&Path>, stop: &Stop) -> Result<(), Failure> {
    stop.is_of_part();
    // Uniform allocation: only a fixed number of samples can be divided in advance.
    let args = &RenderArgs { uniform: args.part_by() != PartBy::Frames || args.uniform, ..args.clone() };
    let part = args.part.as_deref().expect("only parts come here");
    let part = Part::parse(part).map_err(|error| Failure::Usage(format!("--part: {error}")))?;
    let pool = worker_threads()
        .num_threads(args.threads.map_or(0, usize::from))
        .build()
        .map_err(|error| Failure::Retry(format!("error: cannot start worker threads: {error}")))?;
    pool.install(|| match args.part_by() {
        PartBy::Frames => frames(args, part, stop),
        PartBy::Samples | PartBy::Tiles => film(args, part, merged, stop),
    })
}

/// Renders a part of a sequence.
fn frames(args: &RenderArgs, part: Part, stop: &Stop) -> Result<(), Failure> {
    let Some(sequence) = Sequence::of(args)? else {
        let message = "--part-by frames needs a sequence: --frames A..B, --turntable N or --bookmarks";
        return Err(Failure::Usage(message.to_owned()));
    };
    let n = sequence.len() as u32;
    let frames = part.frames(n).map_err(|error| Failure::Usage(format!("--part: {error}")))?;
    let sequence = sequence.part(frames);
    let args = &sequence.opened(&args.of_image()?)?;
    let mut files = args.overwrite.files();
    let progress = RenderProgress::new();
    let job = load(args, &mut files, &progress)?;
    animate(args, job, progress, &sequence, stop).map_err(Failure::of_part)
}

/// Renders a part of the samples or of the tiles of an image.
fn film(args: &RenderArgs, part: Part, merged: Option<&Path>, stop: &Stop) -> Result<(), Failure> {
    if args.is_sequence() {
        return Err(Failure::Usage("a sequence is divided into frames: use --part-by frames".to_owned()));
    }
    if args.denoise.denoise {
        let message =
            "a part is a film, which stays raw: denoise what `firstlight merge … --image IMAGE --denoise` makes";
        return Err(Failure::Usage(message.to_owned()));
    }
    let path = film_path(args, part)?;
    // It would be created, but not where the other machines look if a shared file system is not mounted.
    let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty() && !parent.is_dir());
    if let Some(parent) = parent {
        let message = format!("{}: there is no folder {}: create it for all parts", path.display(), parent.display());
        return Err(Failure::Failed(message).of_part());
    }
    let mut files = args.overwrite.files();
    let claim = files.go_on(&path).map_err(|error| Failure::from(error).of_part())?;
    let progress = RenderProgress::new();
    let job = load(args, &mut files, &progress)?;
    // The process ends after this: freeing a large scene would only take time.
    let mut job = ManuallyDrop::new(job);
    let all = samples(args, &job);
    let samples = match args.part_by() {
        PartBy::Tiles => all.clone(),
        _ => part.samples(all.clone()).map_err(|error| Failure::Usage(format!("--part: {error}")))?,
    };
    let args = &RenderArgs { samples: Some(samples.clone()), ..args.clone() };
    let (film, kept) = film_so_far(args, &job, &path).map_err(Failure::of_part)?;
    // A film that cannot be read is told by the merge.
    if let Some((merged, summary)) = merged.and_then(|path| Some((path, read_film_summary(path).ok()?)))
        && let Some(what) = job.differs_from(&film, &summary.shot, merged)?
    {
        let merged = merged.display();
        let message = format!("{merged}: the rounds before were rendered with a different {what}: submit a new job");
        return Err(Failure::Failed(message).of_part());
    }
    let region = match args.part_by() {
        PartBy::Tiles => Some(region(&film, part, &job)?),
        _ => None,
    };
    check_samples(&film, &samples, region.as_ref(), &path)?;
    // The features of all parts are equal: the first part stores them for the merged film.
    let features = if part.index == 0 { job.features(args, kept).map_err(Failure::of_part)? } else { None };
    let work = PartWork { args, job: &job, part, samples, region, features, path };
    work.render(film, claim, progress, stop)
}

/// The work on a part.
struct PartWork<'a> {
    args: &'a RenderArgs,
    job: &'a RenderJob,
    part: Part,
    samples: Range<u32>,
    region: Option<Region>,
    features: Option<FeatureLayers>,
    path: PathBuf,
}

impl PartWork<'_> {
    fn render(
        &self,
        mut film: Film,
        claim: WholeFile,
        mut progress: RenderProgress,
        stop: &Stop,
    ) -> Result<(), Failure> {
        let Self { args, job, samples, region, .. } = self;
        let (region, goal) = (region.as_ref(), samples.end - samples.start);
        let target = Target { spp: Some(goal), ..Target::default() };
        let before = film.spp_in(region);
        if before >= goal {
            progress.finish();
            inform(format_args!("{}: is complete already: {}", self.name(), self.path.display()));
            return Ok(());
        }
        if before > 0 {
            let path = self.path.display();
            progress
                .suspend(|| inform(format_args!("resuming {path}, which has {before} of {goal} samples per pixel")));
        }
        job.draft.prepare();
        // From here on, a stop saves the film.
        stop.attend();
        let (mut claim, mut wait) = (Some(claim), Duration::from_secs_f64(args.save_every));
        let bad_before = film.n_bad();
        while film.spp_in(region) < goal && !stop.is_asked() {
            let due = Instant::now() + wait;
            // A long pass is interrupted.
            let late = || stop.is_asked() || Instant::now() > due + wait / 2;
            let prepared = &job.extraction.prepared;
            let report = render_region_until(prepared, &job.settings, &mut film, region, target, &late, |now| {
                let share = f64::from(now.spp) / f64::from(goal);
                let mrays = now.rays.total() as f64 / now.seconds.max(1e-9) * 1e-6;
                progress.at(share, format!("{} of {goal} samples per pixel, {mrays:.1} Mrays/s", now.spp));
                Instant::now() < due
            });
            if report.n_above > 0 {
                let n_above = report.n_above;
                progress.suspend(|| {
                    remark(format_args!(
                        "warning: {n_above} samples are brighter than the scene allows: this is a bug"
                    ));
                });
            }
            if film.max_spp() == 0 {
                continue;
            }
            let start = Instant::now();
            claim = self.save(&film, claim.take())?;
            // Large films are saved less often: saving takes at most a twentieth of the time.
            wait = wait.max(20 * start.elapsed());
        }
        progress.finish();
        if film.n_bad() > bad_before {
            let n_bad = film.n_bad() - bad_before;
            remark(format_args!("warning: {n_bad} samples were not finite and were discarded"));
        }
        let (path, done) = (self.path.display(), film.spp_in(region));
        if done >= goal {
            inform(format_args!("{}: done, film saved to {path}", self.name()));
            return Ok(());
        }
        let saved =
            if film.max_spp() > 0 { format!("the film {path} is saved") } else { "nothing was saved".to_owned() };
        let message =
            format!("{}: stopped after {done} of {goal} samples per pixel; {saved}: run it again", self.name());
        Err(stop.failure(message))
    }

    /// Saves the film and claims its file again.
    fn save(&self, film: &Film, claim: Option<WholeFile>) -> Result<Option<WholeFile>, Failure> {
        // On a file system without locks, another process may have rendered more: its film is kept.
        if let Ok(there) = read_film_summary(&self.path)
            && there.layout != film.layout()
            && there.layout.has_all_of(&film.layout())
        {
            let message = format!("{}: another process has rendered more of this part", self.path.display());
            return Err(Failure::Retry(message));
        }
        let claim_again = || {
            let claimed = WholeFile::claim(&self.path, Replace::Anything);
            claimed.map_err(|error| Failure::from(error).of_part())
        };
        let claim = claim.map_or_else(claim_again, Ok)?;
        let note = self.job.note(film, &self.path);
        write_film_with_features(film, self.features.as_ref(), &note, claim)
            .map_err(|error| Failure::from(error).of_part())?;
        claim_again().map(Some)
    }

    /// Such as `part 3/64, samples 128 to 191`.
    fn name(&self) -> String {
        let Part { count, .. } = self.part;
        let what = match self.region {
            Some(Region { start, end }) => format!("pixels {},{} to {},{}", start.x, start.y, end.x - 1, end.y - 1),
            None => in_words(std::slice::from_ref(&self.samples)),
        };
        format!("part {}/{count}, {what}", self.part.number())
    }
}

/// Path of the film of the part.
fn film_path(args: &RenderArgs, part: Part) -> Result<PathBuf, Failure> {
    let path = args.film.as_deref().ok_or_else(|| Failure::Usage("--part needs --film FILE.exr".to_owned()))?;
    let path = numbered(path, part);
    match path.extension() {
        Some(extension) if extension.eq_ignore_ascii_case("exr") => Ok(path),
        _ => Err(Failure::Usage(format!("{}: the name of a film must end in .exr", path.display()))),
    }
}

/// A path with `{part}` replaced by the number of the part.
pub fn numbered(path: &Path, part: Part) -> PathBuf {
    match path.to_str() {
        Some(text) => PathBuf::from(text.replace(NUMBER, &part.padded())),
        None => path.to_path_buf(),
    }
}

/// Loads the scene; its errors are permanent unless its file is temporarily unreachable.
fn load(args: &RenderArgs, files: &mut Files, progress: &RenderProgress) -> Result<RenderJob, Failure> {
    RenderJob::new(args, None, files, progress).map_err(|failure| match &args.scene.source() {
        Ok(source) if let Some(path) = source.path() => match InputFile::open_within(path, FileKind::Film, u64::MAX) {
            Err(error) if error.may_pass() => Failure::Retry(format!("error: {}: {error}", path.display())),
            _ => failure.of_part(),
        },
        _ => failure.of_part(),
    })
}

/// The range of all samples, which is divided into parts.
fn samples(args: &RenderArgs, job: &RenderJob) -> Range<u32> {
    args.samples.clone().unwrap_or_else(|| {
        let first = job.scene.shot.as_ref().map_or(0, |shot| shot.first_sample);
        first..first.saturating_add(job.target(args).spp.unwrap_or(0)).min(Film::MAX_SAMPLES)
    })
}

/// The existing film with its features, or an empty film.
fn film_so_far(args: &RenderArgs, job: &RenderJob, path: &Path) -> Result<(Film, Option<FeatureLayers>), Failure> {
    let empty = || Ok((job.film(args, None)?, None));
    if !path.exists() {
        return empty();
    }
    match read_film_file(path) {
        Ok(mut kept) => {
            let features = kept.features.take();
            Ok((job.film(args, Some((kept, path)))?, features))
        }
        // The samples of a damaged film are lost in any case.
        Err(error) if error.is_damaged() => {
            remark(format_args!("warning: {error}: this part is rendered again"));
            empty()
        }
        Err(error) => Err(error.into()),
    }
}

/// The tiles of a part.
fn region(film: &Film, part: Part, job: &RenderJob) -> Result<Region, Failure> {
    if job.extraction.prepared.features().caustics {
        let message = "this scene has caustics from light paths, which fall on any tile: use --part-by samples";
        return Err(Failure::Usage(message.to_owned()));
    }
    let side = film.tile_size();
    let tiles = [film.width().div_ceil(side), film.height().div_ceil(side)];
    let [start, end] = part.tiles(tiles).map_err(|error| Failure::Usage(format!("--part: {error}")))?;
    let (start, end) = (UVec2::from_array(start) * side, UVec2::from_array(end) * side);
    Ok(film.region(start, end).expect("a part has a tile at least"))
}

/// Rejects a film that has samples of another part.
fn check_samples(film: &Film, samples: &Range<u32>, region: Option<&Region>, path: &Path) -> Result<(), Failure> {
    let layout = film.layout();
    let tiles_x = film.width().div_ceil(film.tile_size());
    for (i, tile) in (0..).zip(&layout.tiles) {
        let at = UVec2::new(i % tiles_x, i / tiles_x) * film.tile_size();
        let is_ours = region.is_none_or(|region| region.contains(at.x, at.y));
        let others = tile
            .blocks
            .iter()
            .flat_map(|block| &block.samples)
            .find(|(start, end)| start < end && !(is_ours && samples.start <= *start && *end <= samples.end));
        if let Some(&(start, end)) = others {
            let message = format!(
                "{}: has {} of other parts: choose another --film for each part, such as part-{NUMBER}.exr",
                path.display(),
                in_words(&[start..end])
            );
            return Err(Failure::Input(vec![message]));
        }
    }
    Ok(())
}
