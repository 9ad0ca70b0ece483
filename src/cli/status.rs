//! `firstlight status FOLDER`: shows the progress of a job from the files in its folder.

use crate::cli::args::SceneArgs;
use crate::cli::console::{inform, print, remark};
use crate::cli::failure::Failure;
use crate::cli::merge::{FilmSet, note_of};
use crate::cli::number::{counted, percent, samples_per_pixel};
use crate::cli::work::ALL;
use clap::Args;
use firstlight::cluster::coverage::in_words;
use firstlight::cluster::job::{Job, JobRound, Rounds};
use firstlight::cluster::part::sample_ranges;
use firstlight::frame::{FilmFile, PictureFormat, Print, read_film_summary};
use firstlight::scene::Files;
use firstlight::scene::whole_file::Replace;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

#[derive(Args, Clone, Debug)]
pub struct StatusArgs {
    /// The folder of the job.
    #[arg(value_name = "FOLDER")]
    folder: PathBuf,
    /// Save an image of all samples that are there, .png, .jpg or .exr.
    #[arg(long, value_name = "FILE")]
    image: Option<PathBuf>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// Progress of the parts of a round.
#[derive(Default)]
struct JobParts {
    count: u32,
    done: u32,
    begun: u32,
    /// Samples per pixel of all parts together.
    samples: u64,
    films: Vec<PathBuf>,
}

impl JobParts {
    fn of(folder: &Path, job: &Job, number: usize, round: &JobRound) -> Self {
        let count = job.parts_of(&round.range());
        let mut parts = Self { count, ..Self::default() };
        let ranges = sample_ranges(round.range(), count);
        for (part, path) in job.films_there(folder, number, &round.range()) {
            let Ok(summary) = read_film_summary(&path) else { continue };
            let wanted = ranges[part.index as usize].len() as u32;
            let there = summary.shot.spp.min(wanted);
            parts.samples += u64::from(there);
            parts.done += u32::from(there == wanted);
            parts.begun += u32::from(there < wanted);
            parts.films.push(path);
        }
        parts
    }
}

pub fn run(args: &StatusArgs) -> Result<(), Failure> {
    let folder = &args.folder;
    let (job, rounds) = (Job::read(folder)?, Rounds::read(folder)?);
    if let Some((start, end)) = job.frames {
        return frames(args, &job, &rounds, end - start);
    }
    let (number, is_done) = rounds.open().map_or((rounds.0.len(), true), |number| (number, false));
    let round = rounds.get(number).expect("there is one at least");
    let parts = if is_done { JobParts::default() } else { JobParts::of(folder, &job, number, round) };
    let merged = rounds.0.iter().rev().find(|round| round.merged);
    let share = parts.samples as f64 / round.range().len() as f64;
    let now = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |time| time.as_secs());
    let so_far = now.saturating_sub(round.since) as f64;
    let left = (!is_done && share > 0.0).then(|| so_far * (1.0 - share) / share);
    if let Some(path) = &args.image {
        picture(folder, path, &parts.films, merged.is_some())?;
    }
    if args.json {
        return print(serde_json::json!({
            "done": is_done,
            "round": number,
            "samples": [round.samples.0, round.samples.1],
            "parts": parts.count,
            "parts_done": parts.done,
            "parts_begun": parts.begun,
            "spp": merged.map_or(0, |round| round.samples.1),
            "error": merged.and_then(|round| round.error),
            "target_error": job.error,
            "seconds_left_in_round": left,
        }));
    }
    let target = job.error.map_or_else(String::new, |error| format!(", to an error of {}", percent(error)));
    let parts_of_job = counted(job.parts as usize, "part");
    print(format!("{}: {} in {parts_of_job}{target}", folder.display(), job.scene))?;
    for (number, round) in (1..).zip(rounds.0.iter().filter(|round| round.merged)) {
        let error = round.error.map_or_else(String::new, |error| format!(", estimated error {}", percent(error)));
        print(format!("round {number}: {}{error}", samples_per_pixel(round.samples.1)))?;
    }
    if is_done {
        return print(format!("done: {}", folder.join(ALL[1]).display()));
    }
    let JobParts { count, done, begun, .. } = parts;
    let left = left.map_or_else(String::new, |seconds| format!(", about {} left in this round", duration(seconds)));
    let samples = in_words(&[round.range()]);
    print(format!(
        "round {number}, {samples}: {done} of {count} parts done, {begun} begun, {:.0} %{left}",
        100.0 * share
    ))
}

/// How many frames of an animation are there.
fn frames(args: &StatusArgs, job: &Job, rounds: &Rounds, n: u32) -> Result<(), Failure> {
    if args.image.is_some() {
        return Err(Failure::Usage("--image shows one image: the frames of this job are images themselves".to_owned()));
    }
    let folder = &args.folder;
    let missing = job.missing_frames(folder);
    let done = n - missing.len() as u32;
    let since = rounds.get(1).map_or(0, |round| round.since);
    let now = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |time| time.as_secs());
    let left = (done > 0).then(|| now.saturating_sub(since) as f64 * missing.len() as f64 / f64::from(done));
    if args.json {
        return print(serde_json::json!({
            "done": missing.is_empty(),
            "frames": n,
            "frames_done": done,
            "parts": job.parts,
            "spp": job.spp,
            "seconds_left_in_round": left.filter(|_| !missing.is_empty()),
        }));
    }
    let (frames, parts) = (counted(n as usize, "frame"), counted(job.parts as usize, "part"));
    print(format!("{}: {}, {frames} in {parts}", folder.display(), job.scene))?;
    let Some(next) = missing.first() else {
        return print(format!("done: {}", folder.join("frames").display()));
    };
    let left = left.map_or_else(String::new, |seconds| format!(", about {} left", duration(seconds)));
    print(format!("{done} of {n} frames done{left}; the first that is missing is frame {next}"))
}

/// Such as `40 s`, `12 min` or `3.5 h`.
fn duration(seconds: f64) -> String {
    match seconds {
        ..100.0 => format!("{seconds:.0} s"),
        ..6000.0 => format!("{:.0} min", seconds / 60.0),
        _ => format!("{:.1} h", seconds / 3600.0),
    }
}

/// Saves an image of all films together, even if some are missing.
fn picture(folder: &Path, path: &Path, films: &[PathBuf], has_merged: bool) -> Result<(), Failure> {
    PictureFormat::of(path).map_err(|error| Failure::Usage(error.into()))?;
    let all = has_merged.then(|| folder.join(ALL[0]));
    let films: Vec<PathBuf> = all.into_iter().chain(films.iter().cloned()).collect();
    if films.is_empty() {
        remark("warning: no part has a film yet: there is no image");
        return Ok(());
    }
    let mut files = Files::new(Replace::AllButFilms);
    files.read_all(SceneArgs::files_behind(&films[0], path))?;
    files.read_all(films.iter().cloned())?;
    files.write(path)?;
    let set = FilmSet::read(films)?;
    let FilmFile { film, shot, .. } = set.add_up(&|_, _| ())?;
    let note = note_of(&film, shot.clone(), &set.films[0], path);
    let (size, display) = ((film.width(), film.height()), shot.display);
    Print { film: &film, display: &display, size, note: Some(&note), denoised: None }
        .write(path, Replace::AllButFilms)?;
    let error = film.error_estimate().map(|error| format!(", estimated error {}", percent(error.relative)));
    inform(format_args!("{}: {}{}", path.display(), samples_per_pixel(film.spp()), error.unwrap_or_default()));
    Ok(())
}
