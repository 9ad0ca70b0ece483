//! Converts parser errors to messages: what was found, what was expected, and the nearest known name.

use crate::error::{SceneError, suggestion};
use crate::expected::field_at;
use crate::locate::line_and_column;
use ron::error::{Error, SpannedError};
use std::path::Path;

/// Converts a parser error to a message with line and column.
pub fn explain(error: &SpannedError, text: &str, file: &Path) -> SceneError {
    if let Some((offset, message)) = wrong_brackets(error, text).or_else(|| wrong_form(error, text)) {
        return SceneError::at(file, line_and_column(text, offset), message);
    }
    let at = (error.span.start.line.max(1), error.span.start.col.max(1));
    let of = |outer: &Option<String>| outer.as_ref().map(|name| format!(" of `{}`", plain(name))).unwrap_or_default();
    let message = match &error.code {
        Error::NoSuchStructField { expected, found, outer } => {
            format!("unknown field `{found}`{}{}", of(outer), suggestion(found, expected.iter().copied()))
        }
        Error::NoSuchEnumVariant { expected, found, outer } => {
            let words = expected.iter().copied();
            let what = outer.as_ref().map_or("kind".to_owned(), |name| plain(name));
            format!("unknown {what} `{found}`{}", elsewhere(&what, found).unwrap_or_else(|| suggestion(found, words)))
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
    // The parser's position is after the word.
    let at = match &error.code {
        Error::NoSuchStructField { found, .. } | Error::NoSuchEnumVariant { found, .. } => word_before(text, at, found),
        _ => at,
    };
    SceneError::at(file, at, message)
}

/// Position and message of what is wrong around values: brackets, commas, comments, names of fields that are missing;
/// `None` for other errors.
fn wrong_brackets(error: &SpannedError, text: &str) -> Option<(usize, String)> {
    let offset = byte_offset(text, error.span.start.line, error.span.start.col);
    let rest = text[offset..].trim_start();
    let at = text.len() - rest.len();
    let word: String = rest.chars().take_while(|c| c.is_alphanumeric() || "_.-".contains(*c)).collect();
    match &error.code {
        Error::ExpectedAttribute | Error::ExpectedAttributeEnd if !text.trim_start().starts_with("#![") => {
            let start = text.find('#')?;
            return Some((start, "a comment begins with `//`, not with `#`".to_owned()));
        }
        Error::ExpectedDifferentStructName { .. } | Error::ExpectedStructLike | Error::ExpectedNamedStructLike(_)
            if field_at(text, offset).is_none() && rest[word.len()..].trim_start().starts_with(':') =>
        {
            let message =
                format!("a scene is in round brackets: put `(` before `{word}`, and `)` at the end of the file");
            return Some((at, message));
        }
        Error::ExpectedDifferentStructName { found, .. } if field_at(text, offset).is_none() && word == *found => {
            return Some((at, format!("a scene starts with `(`: remove `{found}`")));
        }
        Error::SuggestRawIdentifier(_) | Error::ExpectedIdentifier | Error::InvalidIdentifier(_) => {}
        _ => return None,
    }
    if rest.starts_with(',') {
        return Some((at, "unexpected comma: remove it, or write what is missing before it".to_owned()));
    }
    let Error::SuggestRawIdentifier(found) = &error.code else { return unnamed(text, at) };
    let from = text[..offset].rfind('\n').map_or(0, |line| line + 1);
    unnamed(text, from + text[from..].find(found.as_str())?)
}

/// Position and message of a value in brackets that has no name, such as `diffuse(0.5)`.
fn unnamed(text: &str, at: usize) -> Option<(usize, String)> {
    let before = text[..at].trim_end().strip_suffix('(')?.trim_end();
    let kind = before.rsplit(|c: char| !(c.is_alphanumeric() || c == '_')).next().unwrap_or_default();
    let value: String = text[at..].chars().take_while(|c| !",)\n".contains(*c)).collect();
    if kind.is_empty() || value.contains(':') {
        return None;
    }
    let example = match kind {
        "diffuse" => " such as `albedo: 0.5`,",
        "mirror" | "metal" => " such as `reflectance: 0.9`,",
        "emission" => " such as `radiance: 10`,",
        "glass" | "rough_glass" => " such as `ior: 1.5`,",
        _ => "",
    };
    Some((at, format!("`{kind}` has fields with names,{example} found `{value}` without one")))
}

/// Position and message of a name that does not belong there: some kinds have one value without a name, such as
/// `constant(0.5)`.
///
/// - `offset`: of the name, or of its value.
fn named_without_need(text: &str, offset: usize) -> Option<(usize, String)> {
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let behind = text[offset..].trim_start_matches(is_word);
    let is_name = behind.len() < text.len() - offset && behind.trim_start().starts_with(':');
    // Behind the colon, the field is that of the name.
    let inside = if is_name { text.len() - behind.trim_start().len() + 1 } else { offset };
    let field = field_at(text, inside)?;
    let before = text[..field.start].trim_end().strip_suffix(':')?.trim_end().strip_suffix(field.name)?;
    let kind = before.trim_end().strip_suffix('(')?.rsplit(|c| !is_word(c)).next()?;
    let value = field.quoted();
    matches!(kind, "constant" | "builtin" | "obj" | "ply" | "stl")
        .then(|| (before.len(), format!("the value of `{kind}` has no name: write `{kind}({value})`")))
}

/// Where a kind belongs that is unknown at its place, for messages.
fn elsewhere(what: &str, found: &str) -> Option<String> {
    match (what, found) {
        ("object", "point" | "spot" | "directional") => Some(": it belongs in `lights`".to_owned()),
        ("object", "cube" | "box") => Some(": it is a mesh, `mesh(source: builtin(\"cube\"))`".to_owned()),
        _ => None,
    }
}

/// Position of a value of the wrong form, and a message with the expected form; `None` for other errors.
fn wrong_form(error: &SpannedError, text: &str) -> Option<(usize, String)> {
    let offset = byte_offset(text, error.span.start.line, error.span.start.col);
    let end = byte_offset(text, error.span.end.line, error.span.end.col).max(offset);
    match &error.code {
        Error::SuggestRawIdentifier(found) => {
            let before = text[..end].rfind(found.as_str());
            let behind = text[offset..].find(found.as_str()).map(|at| offset + at);
            let is_field = |start: &usize| text[start + found.len()..].trim_start().starts_with(':');
            if let Some(start) = before.into_iter().chain(behind).find(is_field) {
                let hint = found.replace('-', "_");
                return Some((start, format!("unknown field `{found}` (did you mean `{hint}`?)")));
            }
        }
        Error::ExpectedComma
        | Error::ExpectedStructLikeEnd
        | Error::ExpectedOptionEnd
        | Error::ExpectedArrayEnd
        | Error::ExpectedMapEnd => {
            let rest = text[offset..].trim_start();
            let word: String = rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
            let is_field = !word.is_empty() && rest[word.len()..].trim_start().starts_with(':');
            if is_field || rest.starts_with('"') {
                let before = if is_field { format!("`{word}`") } else { "the text in quotes".to_owned() };
                return Some((text.len() - rest.len(), format!("a comma is missing before {before}")));
            }
        }
        Error::ExpectedArray
        | Error::ExpectedBoolean
        | Error::ExpectedChar
        | Error::ExpectedFloat
        | Error::ExpectedInteger
        | Error::ExpectedOption
        | Error::ExpectedMap
        | Error::ExpectedMapColon
        | Error::ExpectedDifferentStructName { .. }
        | Error::ExpectedStructLike
        | Error::ExpectedNamedStructLike(_)
        | Error::ExpectedUnit
        | Error::ExpectedString
        | Error::ExpectedStringEnd
        | Error::ExpectedIdentifier
        | Error::ExpectedStructName(_)
        | Error::ExpectedDifferentLength { .. }
        | Error::InvalidValueForType { .. }
        | Error::InvalidIdentifier(_)
        | Error::IntegerOutOfBounds
        | Error::InvalidIntegerDigit { .. }
        | Error::UnexpectedChar(_) => {}
        _ => return None,
    }
    let field = field_at(text, offset)?;
    if let Some(found) = named_without_need(text, offset) {
        return Some(found);
    }
    // Inside `constant(…)` and for unknown fields, the message names the expected type.
    let expectation = field.expectation().filter(|_| !field.is_within_kind(offset));
    // A value of the right form is followed by what does not belong there.
    let has_form = |(what, _): &(&str, _)| {
        (what.ends_with("in quotes") && field.value.starts_with('"'))
            || (what.ends_with("in square brackets") && field.value.starts_with('['))
    };
    if expectation.as_ref().is_some_and(has_form) {
        let rest = text[offset..].trim_start();
        let found: String = rest.chars().take_while(|c| *c != '\n').take(20).collect();
        let message = format!("a bracket or a comma is missing before `{}`", found.trim_end());
        return (!found.is_empty()).then(|| (text.len() - rest.len(), message));
    }
    let Some((what, example)) = expectation else {
        let Error::InvalidValueForType { expected, .. } = &error.code else { return None };
        return Some((field.start, format!("`{}`: expected {expected}, found `{}`", field.name, field.quoted())));
    };
    Some((
        field.start,
        format!("`{0}`: expected {what}, such as `{0}: {example}`, found `{1}`", field.name, field.quoted()),
    ))
}

/// Byte offset of a line and column of the parser, which are counted in characters from 1.
fn byte_offset(text: &str, line: usize, column: usize) -> usize {
    let line_start: usize = text.split_inclusive('\n').take(line.max(1) - 1).map(str::len).sum();
    let rest = &text[line_start..];
    line_start + rest.char_indices().nth(column.max(1) - 1).map_or(rest.len(), |(at, _)| at)
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
    let mut words = String::new();
    for (i, c) in name.char_indices() {
        if i > 0 && c.is_uppercase() {
            words.push(' ');
        }
        words.extend(c.to_lowercase());
    }
    words
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
