//! Which frames a sequence has, and what moves from one to the next.

use crate::cli::failure::Failure;
use crate::cli::frames::FramesArg;
use crate::cli::render_args::RenderArgs;
use firstlight::scene::SceneSource;
use firstlight::scene::model::ModelFormat;
use std::ffi::OsStr;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Frames per second where neither the command nor the scene says it.
pub const DEFAULT_FPS: f64 = 24.0;

/// What moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SequenceMotion {
    /// The camera, once around its pivot.
    Turntable,
    /// The camera, along bookmarks.
    Bookmarks,
    /// Whatever the animation of the scene moves.
    Animation,
}

/// The frames of a command.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sequence {
    pub motion: SequenceMotion,
    /// As in the names of files: of an animation frame i is at i / fps, others begin with 1.
    pub numbers: Range<u32>,
    digits: usize,
}

impl Sequence {
    /// The sequence that is asked for, if there is to be one.
    pub fn of(args: &RenderArgs) -> Result<Option<Self>, Failure> {
        let (motion, numbers) = match (args.turntable, &args.bookmarks, args.frames) {
            (Some(n), ..) => (SequenceMotion::Turntable, 1..n + 1),
            (None, Some(_), Some(FramesArg::Count(n))) => (SequenceMotion::Bookmarks, 1..n + 1),
            (None, Some(_), _) => {
                return Err(Failure::Usage("--bookmarks needs --frames N: a number of frames".to_owned()));
            }
            (None, None, Some(frames)) => (SequenceMotion::Animation, frames.range()),
            (None, None, None) => return Ok(None),
        };
        let digits = numbers.end.saturating_sub(1).to_string().len().max(4);
        Ok(Some(Self { motion, numbers, digits }))
    }

    pub fn len(&self) -> usize {
        self.numbers.len()
    }

    /// Frames `indices` of it, counted from 0, with the names that they have in the whole.
    pub fn part(&self, indices: Range<u32>) -> Self {
        let start = self.numbers.start;
        Self { numbers: start + indices.start..start + indices.end, ..self.clone() }
    }

    /// `FILE-0007.png` of `FILE.png`.
    pub fn path(&self, path: &Path, number: u32) -> PathBuf {
        let digits = self.digits;
        let mut name = path.file_stem().map_or_else(|| "frame".into(), OsStr::to_os_string);
        name.push(format!("-{number:0digits$}."));
        name.push(path.extension().unwrap_or(OsStr::new("png")));
        path.with_file_name(name)
    }

    /// The names of all of its files.
    ///
    /// - `path`: of the images, or of the films beside them.
    pub fn paths(&self, path: &Path) -> impl Iterator<Item = PathBuf> {
        self.numbers.clone().map(move |number| self.path(path, number))
    }

    /// What the scene is to be opened with: a glTF file at its first moment, whichever frames are rendered, so that all have
    /// the same camera, ground and lights where the file has none.
    pub fn opened(&self, args: &RenderArgs) -> Result<RenderArgs, Failure> {
        let mut args = args.clone();
        if self.motion == SequenceMotion::Animation
            && let SceneSource::Model(path) = args.scene.source()?
            && ModelFormat::of(&path) == Some(ModelFormat::Gltf)
        {
            args.scene.how.at = Some(0.0);
        }
        Ok(args)
    }
}
