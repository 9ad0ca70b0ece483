//! Errors in the user's input, worded so that the user can correct them.

use firstlight_files::printable;
use std::fmt;
use std::path::{Path, PathBuf};

/// One problem: where, what, what was expected, and how to correct it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// The file, or the name of a built-in scene.
    pub file: Option<PathBuf>,
    /// Line and column, counted from 1.
    pub at: Option<(usize, usize)>,
    /// Lower case, no full stop.
    pub message: String,
}

impl fmt::Display for Problem {
    /// One line; control characters in names are escaped.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(file) = &self.file {
            write!(f, "{}:", printable::escape(&file.to_string_lossy()))?;
        }
        if let Some((line, column)) = self.at {
            write!(f, "{line}:{column}:")?;
        }
        if self.file.is_some() || self.at.is_some() {
            f.write_str(" ")?;
        }
        f.write_str(&printable::escape(&self.message))
    }
}

/// Why a scene could not be loaded: at least one problem, in the order of the file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub struct SceneError {
    /// All problems, in the order of the file.
    pub problems: Vec<Problem>,
}

impl SceneError {
    /// Number of problems that are reported: more are not useful, and each one is located by a search of the whole
    /// text.
    pub const MAX_TOLD: usize = 20;

    /// These problems, and a last line that gives the number of further problems in `file`.
    pub fn of(mut problems: Vec<Problem>, untold: usize, file: Option<&Path>) -> Self {
        if untold > 0 {
            let problem = if untold == 1 { "problem" } else { "problems" };
            let message = format!("and {untold} more {problem}");
            problems.push(Problem { file: file.map(Path::to_path_buf), at: None, message });
        }
        Self { problems }
    }

    /// One problem without a location.
    pub fn new(message: impl Into<String>) -> Self {
        Self { problems: vec![Problem { file: None, at: None, message: message.into() }] }
    }

    /// One problem that concerns a whole file.
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
    /// One line per problem.
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

/// ` (did you mean …?)` if one of `known` is similar to `found`, else the list if it is short, else nothing.
///
/// Names are compared in order until `MOST_CELLS` are used up; names excluded by their length alone cost nothing.
pub fn suggestion<'a>(found: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    suggestion_within(found, known, &mut { MOST_CELLS })
}

/// Cells of edit-distance tables that one suggestion may fill in: 65,000 names of eight letters, or at most half a
/// second for all reported problems together.
const MOST_CELLS: usize = 1 << 22;

/// - `cells`: remaining budget.
fn suggestion_within<'a>(found: &str, known: impl IntoIterator<Item = &'a str>, cells: &mut usize) -> String {
    const SHORT_LIST: usize = 16;
    let (lower, length) = (found.to_lowercase(), found.chars().count());
    let (mut names, mut close) = (Vec::new(), None);
    for name in known {
        if names.len() <= SHORT_LIST {
            names.push(name);
        }
        let other = name.chars().count();
        let allowed = (other.max(length) / 3).max(1);
        if other.abs_diff(length) > allowed {
            continue;
        }
        let Some(left) = cells.checked_sub((other + 1).saturating_mul(length + 1)) else { continue };
        *cells = left;
        let distance = strsim::damerau_levenshtein(&lower, &name.to_lowercase());
        if distance <= allowed && close.is_none_or(|best| (distance, name) < best) {
            close = Some((distance, name));
        }
    }
    match close {
        Some((_, name)) => format!(" (did you mean `{name}`?)"),
        None if names.is_empty() => String::new(),
        None if names.len() <= SHORT_LIST => format!(" (known: {})", names.join(", ")),
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

    #[test]
    fn a_suggestion_is_looked_for_within_bounds() {
        let names: Vec<String> = (0..100_000).map(|i| format!("material_{i}")).collect();
        let known = || names.iter().map(String::as_str);
        let spent = |found: &str| {
            let mut cells = MOST_CELLS;
            (suggestion_within(found, known(), &mut cells), MOST_CELLS - cells)
        };
        let (hint, cells) = spent("materal_7000");
        assert_eq!(hint, " (did you mean `material_7000`?)");
        assert!(cells <= MOST_CELLS);
        assert_eq!(spent("a name that is three times as long as any of those").1, 0, "no table is filled in");
        assert_eq!(spent(&"m".repeat(1 << 20)), (String::new(), 0));
        // Long names of similar length.
        let (long, other) = ("a".repeat(1 << 20), "b".repeat(1 << 20));
        let mut cells = MOST_CELLS;
        assert_eq!(suggestion_within(&long, [other.as_str(); 40], &mut cells), "");
        assert_eq!(cells, MOST_CELLS, "a table too large for the budget is not begun");
    }
}
