//! What can be wrong with what a user gave us, said so that they can mend it.

use std::fmt;
use std::path::{Path, PathBuf};

/// One thing that is wrong: where, what, what was expected, what to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// The file, or the name of a built-in scene.
    pub file: Option<PathBuf>,
    /// Line and column, both counted from 1.
    pub at: Option<(usize, usize)>,
    /// Lower case, no full stop.
    pub message: String,
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(file) = &self.file {
            write!(f, "{}:", file.display())?;
        }
        if let Some((line, column)) = self.at {
            write!(f, "{line}:{column}:")?;
        }
        if self.file.is_some() || self.at.is_some() {
            f.write_str(" ")?;
        }
        f.write_str(&self.message)
    }
}

/// Why a scene could not be had: at least one problem, in the order of the file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub struct SceneError {
    pub problems: Vec<Problem>,
}

impl SceneError {
    /// One problem without a place.
    pub fn new(message: impl Into<String>) -> Self {
        Self { problems: vec![Problem { file: None, at: None, message: message.into() }] }
    }

    /// One problem with a whole file.
    pub fn in_file(file: impl AsRef<Path>, message: impl Into<String>) -> Self {
        let file = Some(file.as_ref().to_path_buf());
        Self { problems: vec![Problem { file, at: None, message: message.into() }] }
    }

    /// One problem at a line and column, counted from 1.
    pub fn at(file: impl AsRef<Path>, at: (usize, usize), message: impl Into<String>) -> Self {
        let file = Some(file.as_ref().to_path_buf());
        Self { problems: vec![Problem { file, at: Some(at), message: message.into() }] }
    }
}

impl fmt::Display for SceneError {
    /// One line a problem.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, problem) in self.problems.iter().enumerate() {
            if i > 0 {
                f.write_str("\n")?;
            }
            problem.fmt(f)?;
        }
        Ok(())
    }
}

/// ` (did you mean …?)` when one of `known` is close to `found`, else the list when it is short, else nothing.
pub fn suggestion<'a>(found: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let known: Vec<&str> = known.into_iter().collect();
    let close = known
        .iter()
        .map(|name| (strsim::damerau_levenshtein(&found.to_lowercase(), &name.to_lowercase()), *name))
        .filter(|(distance, name)| *distance <= (name.chars().count().max(found.chars().count()) / 3).max(1))
        .min();
    match close {
        Some((_, name)) => format!(" (did you mean `{name}`?)"),
        None if known.is_empty() => String::new(),
        None if known.len() <= 16 => format!(" (known: {})", known.join(", ")),
        None => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_problem_reads_like_a_compiler_message() {
        let error = SceneError::at("cornell.ron", (31, 7), "material `read` is not defined (did you mean `red`?)");
        assert_eq!(error.to_string(), "cornell.ron:31:7: material `read` is not defined (did you mean `red`?)");
        assert_eq!(SceneError::in_file("a.obj", "no faces").to_string(), "a.obj: no faces");
        assert_eq!(SceneError::new("no camera").to_string(), "no camera");
    }

    #[test]
    fn suggestions_are_close_or_a_short_list_or_nothing() {
        assert_eq!(suggestion("read", ["green", "red"]), " (did you mean `red`?)");
        assert_eq!(suggestion("Radus", ["center", "radius"]), " (did you mean `radius`?)");
        assert_eq!(suggestion("zebra", ["green", "red"]), " (known: green, red)");
        assert_eq!(suggestion("zebra", []), "");
        let many: Vec<String> = (0..40).map(|i| format!("material_{i}")).collect();
        assert_eq!(suggestion("zebra", many.iter().map(String::as_str)), "");
    }
}
