//! Broken and unknown parts of a file that opens without them.
//!
//! A part never costs more than itself: the reader of the whole passes what it read of a part through
//! [`Omissions::kept`], which turns an error into a warning.

use crate::error::gltf::{GltfProblem, Located};
use std::collections::HashSet;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// What is told about a file; each part has one sentence.
#[derive(Debug, Default)]
pub(crate) struct Omissions(Mutex<ToldOmissions>);

#[derive(Debug, Default)]
struct ToldOmissions {
    parts: HashSet<String>,
    sentences: Vec<String>,
}

/// The sentence for a part that is left out.
///
/// - `part`: its place, such as `meshes[3]`.
pub(crate) fn omission(part: &str, (place, problem): &Located) -> String {
    match place.is_empty() || place == part {
        true => format!("{part} is left out: {problem}"),
        false => format!("{part} is left out: {place}: {problem}"),
    }
}

impl Omissions {
    /// What was read of a part; `None` if it is broken, which is told once.
    pub(crate) fn kept<T>(&self, part: &str, read: Result<T, Located>) -> Option<T> {
        read.map_err(|located| self.tell(part, omission(part, &located))).ok()
    }

    /// Adds a sentence about a part of the file, unless there is one.
    pub(crate) fn tell(&self, part: &str, sentence: String) {
        let mut told = self.lock();
        if told.parts.insert(part.to_owned()) {
            told.sentences.push(sentence);
        }
    }

    /// What has been told so far.
    pub(crate) fn sentences(&self) -> Vec<String> {
        self.lock().sentences.clone()
    }

    /// Why a file is refused that has nothing left to show.
    pub(crate) fn nothing_left(&self) -> Located {
        let told = self.lock();
        let problem = match &told.sentences[..] {
            [] => GltfProblem::NoTriangles,
            [first, others @ ..] => GltfProblem::NothingLeft { first: first.clone(), others: others.len() },
        };
        (String::new(), problem)
    }

    fn lock(&self) -> MutexGuard<'_, ToldOmissions> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
