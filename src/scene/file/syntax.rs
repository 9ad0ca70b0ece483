//! Converts parser errors to messages: what was found, what was expected, and the nearest known name.

use crate::scene::error::{SceneError, suggestion};
use ron::error::{Error, SpannedError};
use std::path::Path;

/// Converts a parser error to a message with line and column.
pub fn explain(error: &SpannedError, text: &str, file: &Path) -> SceneError {
    let at = (error.span.start.line.max(1), error.span.start.col.max(1));
    let of = |outer: &Option<String>| outer.as_ref().map(|name| format!(" of `{}`", plain(name))).unwrap_or_default();
    let message = match &error.code {
        Error::NoSuchStructField { expected, found, outer } => {
            format!("unknown field `{found}`{}{}", of(outer), suggestion(found, expected.iter().copied()))
        }
        Error::NoSuchEnumVariant { expected, found, .. } => {
            // Capitalised names are those of older versions: accepted, but not suggested.
            let words = expected.iter().copied().filter(|word| word.starts_with(char::is_lowercase));
            format!("unknown kind `{found}`{}", suggestion(found, words))
        }
        Error::MissingStructField { field, outer } => format!("field `{field}`{} is missing", of(outer)),
        Error::DuplicateStructField { field, outer } => {
            format!("field `{field}`{} is given twice: remove one", of(outer))
        }
        Error::ExceededRecursionLimit => "brackets are nested too deeply".to_owned(),
        Error::Eof => "unexpected end of file: a bracket or a quote is not closed".to_owned(),
        Error::TrailingCharacters => "unexpected text after the end of the scene".to_owned(),
        other => own_names(&lower_first(&other.to_string())),
    };
    // The parser's position is behind the word.
    let at = match &error.code {
        Error::NoSuchStructField { found, .. } | Error::NoSuchEnumVariant { found, .. } => word_before(text, at, found),
        _ => at,
    };
    SceneError::at(file, at, message)
}

/// Returns the position at which `word` starts, if the parser's position is within it or directly behind it.
fn word_before(text: &str, (line, column): (usize, usize), word: &str) -> (usize, usize) {
    let Some(content) = text.lines().nth(line - 1) else { return (line, column) };
    let chars: Vec<char> = content.chars().collect();
    let word: Vec<char> = word.chars().collect();
    (0..column.min(chars.len()))
        .rev()
        .find(|&start| chars[start..].starts_with(&word))
        .map_or((line, column), |start| (line, start + 1))
}

/// Converts type names to plain names: `CameraPart` to camera.
fn plain(name: &str) -> String {
    let name = if name == "SceneFile" { "scene" } else { name.trim_end_matches("Part") };
    name.to_lowercase()
}

/// Replaces quoted type names in a message of the parser by plain names.
fn own_names(message: &str) -> String {
    let is_ours = |word: &str| word == "SceneFile" || word.ends_with("Part");
    let words = message.split('`').map(|word| if is_ours(word) { plain(word) } else { word.to_owned() });
    words.collect::<Vec<_>>().join("`").replace("struct `", "`")
}

fn lower_first(text: &str) -> String {
    let mut chars = text.chars();
    chars.next().map(|first| first.to_lowercase().collect::<String>() + chars.as_str()).unwrap_or_default()
}
