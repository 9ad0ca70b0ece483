//! A job: an image that an engine renders in rounds of parts. Everything about it lies in one folder that all machines see.
//!
//! ```text
//! job.json     what is rendered, in how many parts, until when; written once
//! rounds.json  which samples each round has, and what its merge found
//! scene/       the scene with all of its files
//! parts/       a film for each part of each round
//! all.exr      the film of all rounds that are merged, all.png its image
//! ```
//!
//! Without a target error there is one round. With one, each round at most doubles the samples, so that all powers of two
//! are ends of rounds; after each merge the error estimate decides whether another follows.

use crate::cluster::job_option::JobOption;
use crate::cluster::part::Part;
use crate::files::whole_file::write_whole;
use crate::frame::is_whole_picture;
use crate::scene::{FileKind, InputFile, ReadError, WriteError};
use serde::{Deserialize, Serialize};
use std::collections::HashSet;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

/// A newer program that writes something else counts this up.
const FORMAT: u32 = 1;
/// The file of the rounds.
pub const ROUNDS: &str = "rounds.json";

/// What runs the parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Engine {
    /// Array jobs of Slurm.
    Slurm,
    /// Indexed jobs of Kubernetes.
    Kubernetes,
    /// Steps of an Open Job Description template.
    Openjd,
}

/// What is rendered, and how; the file `job.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Job {
    /// Of the file.
    pub format: u32,
    /// Name of the job, for engines: lower case letters, digits and `-`.
    pub name: String,
    /// What runs it.
    pub engine: Engine,
    /// How the program is called where parts run.
    pub program: String,
    /// A built-in scene, or a path from the folder.
    pub scene: String,
    /// Options of `render` for every part; paths count from the folder.
    pub options: Vec<JobOption>,
    /// Parts of each round, at most.
    pub parts: u32,
    /// Samples per pixel of the first round.
    pub spp: u32,
    /// Relative error at which no other round follows; one round without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<f64>,
    /// Samples per pixel after which no other round follows.
    pub max_spp: u32,
    /// Frames of an animation in place of one image: the first, and the one after the last. They have one round.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frames: Option<(u32, u32)>,
}

/// A range of samples that is divided into parts and merged.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JobRound {
    /// The first sample, and the one after the last.
    pub samples: (u32, u32),
    /// Seconds since 1970 when it could begin.
    pub since: u64,
    /// Whether it has been added to the film of all.
    pub merged: bool,
    /// Estimated relative error of the film then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<f64>,
}

impl JobRound {
    /// Of these samples, from now on.
    pub fn beginning(samples: Range<u32>) -> Self {
        let since = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |time| time.as_secs());
        Self { samples: (samples.start, samples.end), since, merged: false, error: None }
    }

    /// The samples.
    pub fn range(&self) -> Range<u32> {
        self.samples.0..self.samples.1
    }
}

/// All rounds so far; the file `rounds.json`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Rounds(pub Vec<JobRound>);

/// Why a folder is not a job.
#[derive(Debug, thiserror::Error)]
pub enum JobError {
    /// A file cannot be read.
    #[error("{}: {source}: expected the folder of a job that `firstlight submit` has written", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: ReadError,
    },
    /// A file is not what this program writes.
    #[error("{}: {reason}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// An output is a symbolic link.
    #[error("{}: is a symbolic link: a job writes only into its own folder; remove the link", path.display())]
    Link {
        /// The link.
        path: PathBuf,
    },
}

impl JobError {
    /// Whether the same may succeed later.
    pub fn may_pass(&self) -> bool {
        matches!(self, Self::Read { source, .. } if source.may_pass())
    }
}

fn read<T: for<'a> Deserialize<'a>>(path: PathBuf) -> Result<T, JobError> {
    let text = InputFile::open(&path, FileKind::Settings).and_then(InputFile::text);
    let text = text.map_err(|source| JobError::Read { path: path.clone(), source })?;
    serde_json::from_str(&text).map_err(|error| JobError::Content { path, reason: error.to_string() })
}

fn write(value: &impl Serialize, path: &Path) -> Result<(), WriteError> {
    // Plain structs, numbers and strings can always be written.
    let text = serde_json::to_string_pretty(value).expect("plain data");
    write_whole(path, (text + "\n").as_bytes())
}

impl Job {
    /// The version of the file that this program writes.
    pub const FORMAT: u32 = FORMAT;
    /// The largest number of parts of a round.
    pub const MOST_PARTS: u32 = Part::MOST;
    /// The largest number of frames.
    pub const MOST_FRAMES: u32 = 100_000;

    /// Reads the job in `folder`.
    ///
    /// # Errors
    /// When there is none, or a newer program has written it.
    pub fn read(folder: &Path) -> Result<Self, JobError> {
        let path = folder.join("job.json");
        let job: Self = read(path.clone())?;
        let content = |reason: &str| Err(JobError::Content { path, reason: reason.to_owned() });
        if job.format > FORMAT {
            return content("was written by a newer version of firstlight");
        }
        if job.frames.is_some_and(|(start, end)| start >= end) {
            return content("has no frames");
        }
        let n_frames = job.frames.map_or(0, |(start, end)| end - start);
        if job.parts > Self::MOST_PARTS || n_frames > Self::MOST_FRAMES {
            return content(&format!("has more than {} parts or {} frames", Self::MOST_PARTS, Self::MOST_FRAMES));
        }
        if job.error.is_some_and(|error| !(error > 0.0 && error.is_finite())) {
            return content("has an error target that is not above 0");
        }
        // Both are arguments of `render`.
        if job.scene.starts_with('-') {
            return content("has an option in place of a scene");
        }
        if job.parts == 0 || job.spp == 0 || job.max_spp < job.spp {
            return content("has no parts, or no samples");
        }
        Ok(job)
    }

    /// Writes the job, and its first round.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), WriteError> {
        write(self, &folder.join("job.json"))?;
        Rounds(vec![JobRound::beginning(0..self.spp)]).write(folder)
    }

    /// Parts of a round with these samples: no more than there are samples.
    pub fn parts_of(&self, samples: &Range<u32>) -> u32 {
        let n = self.frames.map_or(samples.len() as u32, |(start, end)| end - start);
        self.parts.min(n)
    }

    /// The image of a frame, as `render --frames` numbers it; of none, what all of them are called after.
    pub fn image_of(&self, frame: Option<u32>) -> String {
        let last = self.frames.map_or(0, |(_, end)| end.saturating_sub(1));
        let digits = last.to_string().len().max(4);
        frame.map_or_else(|| "frames/frame.png".to_owned(), |frame| format!("frames/frame-{frame:0digits$}.png"))
    }

    /// Frames whose images are not there, or were cut short.
    pub fn missing_frames(&self, folder: &Path) -> Vec<u32> {
        let (start, end) = self.frames.unwrap_or_default();
        (start..end).filter(|&frame| !is_whole_picture(&folder.join(self.image_of(Some(frame))))).collect()
    }

    /// The parts of a round with these samples whose films are there, ascending.
    pub fn films_there(&self, folder: &Path, round: usize, samples: &Range<u32>) -> Vec<(Part, PathBuf)> {
        let count = self.parts_of(samples);
        let names: HashSet<_> = std::fs::read_dir(folder.join("parts"))
            .map(|entries| entries.flatten().map(|entry| entry.file_name()).collect())
            .unwrap_or_default();
        let of_part = |index| {
            let part = Part { index, count };
            let name = self.film_of(round, &part.padded());
            let is_there = Path::new(&name).file_name().is_some_and(|name| names.contains(name));
            is_there.then(|| (part, folder.join(name)))
        };
        (0..count).filter_map(of_part).filter(|(_, path)| path.is_file()).collect()
    }

    /// The path of an output in the folder of the job.
    ///
    /// - `name`: from the folder.
    ///
    /// # Errors
    /// When it is, or lies behind, a symbolic link: the folder of somebody else could lead to any file.
    pub fn output(folder: &Path, name: &str) -> Result<PathBuf, JobError> {
        let mut path = folder.to_path_buf();
        for part in Path::new(name) {
            path.push(part);
            if path.is_symlink() {
                return Err(JobError::Link { path });
            }
        }
        Ok(path)
    }

    /// The film of one part of a round, or all of them with `{part}`.
    pub fn film_of(&self, round: usize, part: &str) -> String {
        format!("parts/round-{round:02}-part-{part}.exr")
    }

    /// How many rounds there can be at most.
    pub fn most_rounds(&self) -> usize {
        let mut rounds = 1;
        let mut spp = self.spp;
        while self.error.is_some() && spp < self.max_spp {
            spp = self.next_end(spp, None).unwrap_or(self.max_spp);
            rounds += 1;
        }
        rounds
    }

    /// The end of the round after one that ends with `spp` samples; `None` where no other follows.
    ///
    /// - `wanted`: samples per pixel that are expected to be enough; the least that any round may have when not given.
    pub fn next_end(&self, spp: u32, wanted: Option<u32>) -> Option<u32> {
        if self.error.is_none() || spp >= self.max_spp {
            return None;
        }
        // Too small a step would make more rounds than it saves samples.
        let least = spp.saturating_add(spp.div_ceil(2));
        Some(wanted.unwrap_or(least).clamp(least, spp.saturating_mul(2)).min(self.max_spp))
    }

    /// Samples of the first round where a target error is given: enough for every part, and for an estimate.
    pub fn first_round(parts: u32, max_spp: u32) -> u32 {
        parts.max(16).checked_next_power_of_two().unwrap_or(max_spp).min(max_spp)
    }
}

impl Rounds {
    /// Reads the rounds in `folder`.
    ///
    /// # Errors
    /// When there are none, or their numbers are not what a merge writes.
    pub fn read(folder: &Path) -> Result<Self, JobError> {
        let path = folder.join(ROUNDS);
        let rounds: Self = read(path.clone())?;
        let is_right = |round: &JobRound| {
            round.samples.0 < round.samples.1 && round.error.is_none_or(|error| error >= 0.0 && error.is_finite())
        };
        if rounds.0.is_empty() || !rounds.0.iter().all(is_right) {
            let reason = "has no rounds, or one without samples or with an error that is none".to_owned();
            return Err(JobError::Content { path, reason });
        }
        Ok(rounds)
    }

    /// Writes them, whole or not at all.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), WriteError> {
        write(self, &folder.join(ROUNDS))
    }

    /// The round with this number, from 1.
    pub fn get(&self, number: usize) -> Option<&JobRound> {
        self.0.get(number.checked_sub(1)?)
    }

    /// The number of the round that is to be rendered now; `None` when all are merged.
    pub fn open(&self) -> Option<usize> {
        self.0.iter().position(|round| !round.merged).map(|i| i + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cluster::job_option::OptionName;

    fn job(error: Option<f64>) -> Job {
        Job {
            format: FORMAT,
            name: "cornell".to_owned(),
            engine: Engine::Slurm,
            program: "firstlight".to_owned(),
            scene: "cornell".to_owned(),
            options: vec![OptionName::Seed.with(3)],
            parts: 12,
            spp: Job::first_round(12, 1000),
            error,
            max_spp: 1000,
            frames: None,
        }
    }

    #[test]
    fn rounds_end_by_themselves_and_at_powers_of_two() {
        let job = job(Some(0.01));
        assert_eq!((job.spp, Job::first_round(64, 4096), Job::first_round(300, 256)), (16, 64, 256));
        // Without an end in sight they double.
        let mut ends = vec![job.spp];
        while let Some(end) = job.next_end(ends[ends.len() - 1], Some(u32::MAX)) {
            ends.push(end);
        }
        assert_eq!(ends, [16, 32, 64, 128, 256, 512, 1000]);
        // A target that is near shortens the last, but not by more than it is worth.
        assert_eq!(job.next_end(64, Some(100)), Some(100));
        assert_eq!(job.next_end(64, Some(70)), Some(96));
        assert!(job.most_rounds() >= ends.len());
        assert_eq!(super::tests::job(None).next_end(16, Some(32)), None);
        assert_eq!(super::tests::job(None).most_rounds(), 1);
    }

    #[test]
    fn frames_are_divided_and_counted_by_their_images() {
        let folder = tempfile::tempdir().unwrap();
        let job = Job { frames: Some((8, 12)), ..job(None) };
        assert_eq!((job.parts_of(&(0..16)), job.image_of(Some(9))), (4, "frames/frame-0009.png".to_owned()));
        assert_eq!(Job { frames: Some((0, 20_000)), ..job.clone() }.image_of(Some(9)), "frames/frame-00009.png");
        std::fs::create_dir(folder.path().join("frames")).unwrap();
        let pixels = image::RgbImage::new(2, 2);
        [9, 10].iter().for_each(|&frame| pixels.save(folder.path().join(job.image_of(Some(frame)))).unwrap());
        assert_eq!(job.missing_frames(folder.path()), [8, 11]);
        // One that was cut short while it was copied.
        let path = folder.path().join(job.image_of(Some(10)));
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(path, &bytes[..bytes.len() - 1]).unwrap();
        assert_eq!(job.missing_frames(folder.path()), [8, 10, 11]);
    }

    #[test]
    fn a_job_reads_back_as_it_was_written() {
        let folder = tempfile::tempdir().unwrap();
        let job = job(Some(0.01));
        assert!(Job::read(folder.path()).unwrap_err().to_string().contains("job.json"));
        job.write(folder.path()).unwrap();
        assert_eq!(Job::read(folder.path()).unwrap(), job);
        let mut rounds = Rounds::read(folder.path()).unwrap();
        assert_eq!(
            (rounds.open(), rounds.get(1).unwrap().range(), rounds.get(0), rounds.get(2)),
            (Some(1), 0..16, None, None)
        );
        rounds.0[0].merged = true;
        assert_eq!(rounds.open(), None);
        rounds.0[0].error = Some(-1.0);
        rounds.write(folder.path()).unwrap();
        assert!(Rounds::read(folder.path()).is_err());
        std::fs::write(folder.path().join("rounds.json"), "[]").unwrap();
        assert!(Rounds::read(folder.path()).is_err());
    }
}
