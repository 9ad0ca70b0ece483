//! `firstlight work FOLDER`: run by engines in the folder of a job created by `firstlight submit`: renders a part of a
//! round, merges a round, or prints the number of the next round.

use crate::cli::console::{inform, print};
use crate::cli::failure::Failure;
use crate::cli::merge::{FilmSet, note_of};
use crate::cli::number::{at_least_one, between, percent, samples_per_pixel};
use crate::cli::part;
use crate::cli::render::Command;
use crate::cli::stop::Stop;
use clap::Args;
use firstlight::cluster::coverage::{in_words, missing_in_words};
use firstlight::cluster::job::{Job, JobError, JobRound, ROUNDS, Rounds};
use firstlight::cluster::part::Part;
use firstlight::frame::{FilmFile, Print, read_film_summary, write_film_with_features};
use firstlight::scene::whole_file::{Replace, WholeFile};
use std::path::{Path, PathBuf};

#[derive(Args, Clone, Debug)]
pub struct WorkArgs {
    /// The folder of the job.
    #[arg(value_name = "FOLDER")]
    folder: PathBuf,
    /// Number of the round, from 1 [default: the one that is to be rendered now].
    #[arg(long, value_name = "N", value_parser = at_least_one)]
    round: Option<u32>,
    /// Render this part of the round: I/N, or auto for the task of an array job.
    #[arg(long, value_name = "I/N")]
    part: Option<String>,
    /// Add the parts of the round to the film of all, and decide whether another round follows.
    #[arg(long, conflicts_with = "part")]
    merge: bool,
    /// Merge although parts are missing.
    #[arg(long, requires = "merge")]
    allow_missing: bool,
    /// Print the number of the round that is to be rendered now, or nothing when all is done.
    #[arg(long, conflicts_with_all = ["part", "merge", "round"])]
    next: bool,
    /// Number of worker threads [default: all cores]; the image does not depend on it.
    #[arg(long, value_name = "N", value_parser = between::<u16>(1, 1024))]
    threads: Option<u16>,
}

/// The film of all merged rounds, and its image.
pub const ALL: [&str; 2] = ["all.exr", "all.png"];

impl From<JobError> for Failure {
    fn from(error: JobError) -> Self {
        if error.may_pass() { Self::Passing(error.to_string()) } else { Self::Failed(error.to_string()) }
    }
}

pub fn run(args: &WorkArgs, stop: &Stop) -> Result<(), Failure> {
    stop.is_of_part();
    let work = WorkOrder::open(&args.folder).map_err(|error| Failure::from(error).of_part())?;
    if args.next {
        return match work.rounds.open() {
            Some(round) => print(round.to_string()),
            None => Ok(()),
        };
    }
    let number = match args.round {
        Some(number) => number as usize,
        None => work.rounds.open().unwrap_or(work.rounds.0.len()),
    };
    let Some(round) = work.rounds.get(number) else {
        return match work.rounds.open() {
            Some(open) => Err(Failure::Retry(format!("error: round {number} begins when round {open} is merged"))),
            None => {
                inform(format_args!("round {number} is not needed: the job is done"));
                Ok(())
            }
        };
    };
    match (&args.part, args.merge) {
        (Some(part), _) => work.part(number, round, part, args.threads, stop),
        (None, true) => work.merge(number, round, args.allow_missing, stop).map_err(Failure::of_part),
        (None, false) => Err(Failure::Usage("say what to do: --part I/N, --merge or --next".to_owned())),
    }
}

/// A job, read from its folder.
struct WorkOrder {
    folder: PathBuf,
    job: Job,
    rounds: Rounds,
}

impl WorkOrder {
    fn open(folder: &Path) -> Result<Self, JobError> {
        Ok(Self { folder: folder.to_path_buf(), job: Job::read(folder)?, rounds: Rounds::read(folder)? })
    }

    fn part(
        &self,
        number: usize,
        round: &JobRound,
        part: &str,
        threads: Option<u16>,
        stop: &Stop,
    ) -> Result<(), Failure> {
        let part = Part::parse(part).map_err(|error| Failure::Usage(format!("--part: {error}")))?;
        let Job { parts, .. } = self.job;
        if part.count != parts {
            return Err(Failure::Usage(format!("--part: the job has {parts} parts, not {}", part.count)));
        }
        let count = self.job.parts_of(&round.range());
        if part.index >= count || round.merged {
            let what = match self.job.frames {
                Some(_) => "frames".to_owned(),
                None => in_words(&[round.range()]),
            };
            let part = part.number();
            inform(format_args!("part {part}/{parts} of round {number}, {what}: there is nothing to do"));
            return Ok(());
        }
        self.check_outputs(number, Part { index: part.index, count })?;
        let mut words = render_words(&self.job);
        words.extend(["--part".to_owned(), format!("{}/{count}", part.number())]);
        words.extend(match self.job.frames {
            Some(_) => ["--spp".to_owned(), self.job.spp.to_string(), "-o".to_owned(), self.job.image_of(None)],
            None => {
                let samples = format!("{}..{}", round.samples.0, round.samples.1);
                ["--samples".to_owned(), samples, "--film".to_owned(), self.job.film_of(number, "{part}")]
            }
        });
        words.extend(threads.iter().flat_map(|threads| ["--threads".to_owned(), threads.to_string()]));
        // The paths of a job are relative to its folder.
        let moved = std::env::set_current_dir(&self.folder);
        moved.map_err(|error| Failure::Retry(format!("error: {}: {error}", self.folder.display())))?;
        let command = Command::parse(&words).map_err(|failure| failure.of_part())?;
        match command.part()? {
            Some(args) => part::run(&args, (number > 1).then_some(Path::new(ALL[0])), stop),
            None => unreachable!("the words have --part"),
        }
    }

    /// Refuses outputs of a part that lead out of the folder of the job.
    fn check_outputs(&self, number: usize, part: Part) -> Result<(), Failure> {
        let check = |name: &str| Job::output(&self.folder, name).map_err(|error| Failure::from(error).of_part());
        if self.job.frames.is_none() {
            return check(&self.job.film_of(number, &part.padded())).map(drop);
        }
        // Whichever of them the options of the job name.
        let frames = std::fs::read_dir(check("frames")?).into_iter().flatten().flatten();
        for frame in frames {
            if frame.path().is_symlink() {
                return Err(Failure::from(JobError::Link { path: frame.path() }).of_part());
            }
        }
        Ok(())
    }

    /// The existing films of the parts of a round, and the number of its parts.
    fn films(&self, number: usize, round: &JobRound) -> (Vec<PathBuf>, u32) {
        let count = self.job.parts_of(&round.range());
        let films = self.job.films_there(&self.folder, number, &round.range());
        (films.into_iter().map(|(_, path)| path).collect(), count)
    }

    fn merge(&self, number: usize, round: &JobRound, allow_missing: bool, stop: &Stop) -> Result<(), Failure> {
        if round.merged {
            inform(format_args!("round {number} is merged already"));
            self.tell_next(&self.rounds);
            return Ok(());
        }
        for output in [ALL[0], ALL[1], ROUNDS] {
            Job::output(&self.folder, output)?;
        }
        if let Some((start, end)) = self.job.frames {
            return self.count_frames(number, end - start, allow_missing);
        }
        let all = self.folder.join(ALL[0]);
        let claim = WholeFile::claim(&all, Replace::Anything)?;
        let (films, count) = self.films(number, round);
        // After a merge that was killed when it had written the film, the parts must not be added again.
        let is_in_all = |path: &Path| {
            let summary = read_film_summary(path).ok()?;
            let mut blocks = summary.layout.tiles.iter().flat_map(|tile| &tile.blocks);
            Some(blocks.all(|block| block.samples.iter().any(|&(_, end)| end > round.samples.0)))
        };
        let added = is_in_all(&all) == Some(true);
        if films.is_empty() && !added {
            return Err(Failure::Retry(format!("error: round {number}: none of its {count} parts is there yet")));
        }
        let before = (number > 1 || added).then(|| all.clone());
        let films = if added { Vec::new() } else { films };
        let set = FilmSet::read(before.into_iter().chain(films).collect())?;
        let missing = set.missing(Some(0..round.samples.1));
        if !missing.is_empty() && !allow_missing {
            let missing = missing_in_words(&missing);
            let message = format!("error: round {number}: {missing}: their parts are not done yet");
            return Err(Failure::Retry(message));
        }
        let FilmFile { film, shot, features, .. } = set.add_up(&|done, n| inform_of(done, n))?;
        if stop.is_asked() {
            return Err(stop.failure("stopped before the merged film was saved".to_owned()));
        }
        let first = &set.films[0];
        if !added {
            write_film_with_features(&film, features.as_ref(), &note_of(&film, shot.clone(), first, &all), claim)?;
        }
        let picture = self.folder.join(ALL[1]);
        let (size, note) = ((film.width(), film.height()), note_of(&film, shot.clone(), first, &picture));
        let display = shot.display;
        Print { film: &film, display: &display, size, note: Some(&note), denoised: None }
            .write(&picture, Replace::AllButFilms)?;
        let estimate = film.error_estimate();
        let mut rounds = self.rounds.clone();
        let error = estimate.map(|estimate| estimate.relative);
        rounds.0[number - 1] = JobRound { merged: true, error, ..round.clone() };
        let told = error.map_or_else(String::new, |error| format!(", estimated error {}", percent(error)));
        inform(format_args!("round {number}: {}{told}: {}", samples_per_pixel(film.spp()), all.display()));
        let is_good = self.job.error.zip(error).is_some_and(|(target, error)| error <= target);
        let wanted = self.job.error.zip(estimate).map(|(target, estimate)| estimate.spp_for(target));
        let end = self.job.next_end(round.samples.1, Some(wanted.unwrap_or(u32::MAX))).filter(|_| !is_good);
        if let Some(end) = end.filter(|_| number == rounds.0.len()) {
            rounds.0.push(JobRound::beginning(round.samples.1..end));
        }
        rounds.write(&self.folder)?;
        self.tell_next(&rounds);
        Ok(())
    }

    /// Images of frames need no merge: the round is done when all are there.
    fn count_frames(&self, number: usize, n: u32, allow_missing: bool) -> Result<(), Failure> {
        let missing = self.job.missing_frames(&self.folder);
        if let Some(first) = missing.first().filter(|_| !allow_missing) {
            let n_missing = missing.len();
            let message = format!("error: {n_missing} of {n} frames are missing, the first is frame {first}");
            return Err(Failure::Retry(message));
        }
        let mut rounds = self.rounds.clone();
        rounds.0[number - 1].merged = true;
        rounds.write(&self.folder)?;
        inform(format_args!("{} of {n} frames are there", n as usize - missing.len()));
        self.tell_next(&rounds);
        Ok(())
    }

    fn tell_next(&self, rounds: &Rounds) {
        match rounds.open().and_then(|number| Some((number, rounds.get(number)?))) {
            Some((number, round)) => {
                inform(format_args!("next: round {number}, {}", in_words(&[round.range()])));
            }
            None => inform("done"),
        }
    }
}

fn inform_of(done: usize, n: usize) {
    if done.is_multiple_of(50) {
        inform(format_args!("{done} of {n} films are added up"));
    }
}

/// The arguments of `render` that are common to all parts of a job.
pub fn render_words(job: &Job) -> Vec<String> {
    let frames = job.frames.map(|(start, end)| format!("--frames={start}..{end}"));
    [job.scene.clone()].into_iter().chain(job.options.iter().cloned().map(String::from)).chain(frames).collect()
}
