//! Words that have a better one, in whatever users read: texts of the program, doc comments, and the documentation.

use crate::docs::page::{expect_none, files, read, without_code};
use std::collections::BTreeSet;

/// The files of the program and of the packages.
fn sources() -> impl Iterator<Item = String> {
    ["src", "crates", "python/src"].iter().flat_map(|folder| files(folder, &[".rs"]))
}

/// Words that have a better one; see the right column.
const RETIRED: [(&str, &str); 52] = [
    ("lamp", "light"),
    ("lamps", "lights"),
    ("ball", "sphere"),
    ("balls", "spheres"),
    ("matte", "diffuse"),
    ("eye", "camera"),
    ("eyes", "cameras"),
    ("surroundings", "environment"),
    ("sky", "environment"),
    ("skies", "environments"),
    ("picture", "image"),
    ("pictures", "images"),
    ("density", "pdf"),
    ("densities", "pdfs"),
    ("chance", "probability, or at random"),
    ("house", "architecture"),
    ("judge", "reference intersector"),
    ("verdict", "check result"),
    ("ladder", "convergence curve"),
    ("rung", "step"),
    ("rungs", "steps"),
    ("scouts", "pilot paths"),
    ("arrivals", "lens connections"),
    ("foretold", "predicted"),
    ("hasty", "preview"),
    ("sieve", "quad filter"),
    ("crowd", "many instances"),
    ("crowds", "many instances"),
    ("slack", "error bound"),
    ("wobble", "error bound"),
    ("paint", "colour parameter"),
    ("anew", "again"),
    ("whoever", "any"),
    ("lately", "recently"),
    ("begin again", "restart"),
    ("begins again", "restarts"),
    ("go on with", "resume"),
    ("goes on with", "resumes"),
    ("going on with", "resuming"),
    ("gone on with", "resumed"),
    ("take back", "undo"),
    ("taken back", "undone"),
    ("in earnest", "exactly"),
    ("samples a pixel", "samples per pixel"),
    ("sample a pixel", "sample per pixel"),
    ("bytes a pixel", "bytes per pixel"),
    ("rays a pixel", "rays per pixel"),
    ("rays a second", "rays per second"),
    ("paths a second", "paths per second"),
    ("frames a second", "frames per second"),
    ("ns a ray", "ns per ray"),
    ("visits a ray", "visits per ray"),
];

/// In the window the environment may be a sky.
const FINE_IN_THE_PROGRAM: [&str; 3] = ["sky", "skies", "house"];

/// Names of other renderers: a field of a medium, a material.
const OF_OTHER_RENDERERS: [&str; 2] = ["density", "matte"];

/// One kind of environment, which is called so, and the files that are about nothing else.
const CLEAR_SKY: [&str; 2] = ["clear sky", "sky and sun"];
const ABOUT_SKIES: [&str; 3] = ["docs/scene-sky.md", "crates/import/src/sky.rs", "crates/import/src/mitsuba/sunsky.rs"];

/// Names of scenes, which may have words that are retired elsewhere.
pub fn scene_names() -> BTreeSet<String> {
    let name = |path: &String| path.trim_start_matches("assets/scenes/").trim_end_matches(".ron").to_owned();
    files("assets/scenes", &[".ron"]).iter().map(name).filter(|name| name.contains('-')).collect()
}

/// Retired words of a line of prose, each with what to say instead.
pub fn retired_words(line: &str, scenes: &BTreeSet<String>) -> Vec<(&'static str, &'static str)> {
    let mut text = without_code(line).to_lowercase();
    if text.starts_with("<!--") || (text.starts_with('[') && text.contains("]: ")) {
        return Vec::new();
    }
    // Targets of links are names of files.
    while let Some(at) = text.find("](") {
        let end = text[at..].find(')').map_or(text.len(), |end| at + end + 1);
        text.replace_range(at..end, " ");
    }
    for name in scenes.iter().map(String::as_str).chain(CLEAR_SKY) {
        text = text.replace(name, " ");
    }
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let words: Vec<&str> = text.split(|c| !is_word(c)).filter(|word| !word.is_empty()).collect();
    let is_there = |phrase: &str| {
        let phrase: Vec<&str> = phrase.split(' ').collect();
        words.windows(phrase.len()).any(|found| found == phrase)
    };
    RETIRED.into_iter().filter(|(word, _)| is_there(word)).collect()
}

/// Like [`retired_words`], in a line of a file.
pub fn retired_words_in(path: &str, line: &str, scenes: &BTreeSet<String>) -> Vec<(&'static str, &'static str)> {
    let mut found = retired_words(line, scenes);
    found.retain(|(word, _)| !(ABOUT_SKIES.contains(&path) && ["sky", "skies"].contains(word)));
    found
}

/// The text literals of a source file before its tests, each with its line.
fn literals(source: &str) -> Vec<(usize, String)> {
    let source = source.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
    let (mut found, mut line, mut rest) = (Vec::new(), 1, source);
    while let Some(c) = rest.chars().next() {
        let length = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("'\"'") || rest.starts_with("b'\"'") {
            rest.find("\"'").map_or(1, |at| at + 2)
        } else if let Some(raw) = rest.strip_prefix("r#\"") {
            raw.find("\"#").map_or(rest.len(), |at| {
                found.push((line, raw[..at].to_owned()));
                at + 5
            })
        } else if c == '"' {
            let mut is_escaped = false;
            let end = rest[1..].find(|c| {
                let ends = c == '"' && !is_escaped;
                is_escaped = c == '\\' && !is_escaped;
                ends
            });
            let end = end.map_or(rest.len() - 1, |at| at + 1);
            // A text goes on in the next line behind a backslash.
            found.push((line, rest[1..end].split("\\\n").map(str::trim_start).collect::<Vec<_>>().join("")));
            end + 1
        } else {
            c.len_utf8()
        };
        let (read, after) = rest.split_at(length.min(rest.len()));
        line += read.matches('\n').count();
        rest = after;
    }
    found
}

/// Docstrings that the command line shows as help.
fn help(source: &str) -> Vec<(usize, String)> {
    let lines = source.lines().zip(1..);
    lines.filter_map(|(line, n)| Some((n, line.trim().strip_prefix("/// ")?.to_owned()))).collect()
}

/// Doc comments of public items and of modules, each with its line. Names of code, in backquotes, are left out later.
fn doc_comments(source: &str) -> Vec<(usize, String)> {
    let source = source.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
    let mut found = Vec::new();
    let mut pending: Vec<(usize, String)> = Vec::new();
    for (line, n) in source.lines().zip(1..) {
        let line = line.trim();
        if let Some(text) = line.strip_prefix("//!") {
            found.push((n, text.trim().to_owned()));
        } else if let Some(text) = line.strip_prefix("///") {
            pending.push((n, text.trim().to_owned()));
        } else if !line.starts_with("#[") && !line.is_empty() {
            // Fields and variants of public types have no `pub` of their own in enums: all that is not private is read.
            let is_private = ["fn ", "struct ", "enum ", "const ", "static ", "type ", "trait ", "mod "]
                .iter()
                .any(|word| line.starts_with(word));
            if !is_private {
                found.append(&mut pending);
            }
            pending.clear();
        }
    }
    found
}

/// A field, a scene or a part of a film by its name alone, or a whole scene.
fn is_grammar(text: &str) -> bool {
    ["eye", "ball", "balls"].contains(&text)
        || text.ends_with(".ron")
        || text.contains("camera: (")
        || text.contains("(eye: (")
}

/// `{lamp}` is a name in the source.
fn without_placeholders(text: &str) -> String {
    let parts = text.split('{').enumerate();
    parts.map(|(i, part)| if i == 0 { part } else { part.split_once('}').map_or("", |(_, rest)| rest) }).collect()
}

#[test]
fn texts_of_the_program_are_in_words_of_the_field() {
    let scenes = scene_names();
    let mut problems = Vec::new();
    for path in sources() {
        // The search for keys knows other words too.
        if path == "src/viewer/keys/words.rs" {
            continue;
        }
        let source = read(&path).text;
        let mut texts = literals(&source);
        if path.starts_with("src/cli/") {
            texts.extend(help(&source));
        }
        for (line, text) in
            texts.into_iter().filter(|(_, text)| !is_grammar(text) && !OF_OTHER_RENDERERS.contains(&&**text))
        {
            let text = without_placeholders(&text);
            for (word, better) in retired_words(&text, &scenes) {
                if !FINE_IN_THE_PROGRAM.contains(&word) {
                    problems.push(format!("{path}:{line}: `{word}`: say {better}: {text}"));
                }
            }
        }
    }
    expect_none(problems);
}

#[test]
fn doc_comments_are_in_words_of_the_field() {
    let scenes = scene_names();
    let mut problems = Vec::new();
    for path in sources() {
        let source = read(&path).text;
        let mut in_code = false;
        for (line, text) in doc_comments(&source) {
            if text.starts_with("```") {
                in_code = !in_code;
                continue;
            }
            if in_code {
                continue;
            }
            for (word, better) in retired_words_in(&path, &text, &scenes) {
                problems.push(format!("{path}:{line}: `{word}`: say {better}: {text}"));
            }
        }
    }
    expect_none(problems);
}

/// Words that no name of the code has as a part, of types, variables, parameters and functions alike.
const RETIRED_NAMES: [(&str, &str); 14] = [
    ("lamp", "light"),
    ("chance", "probability"),
    ("house", "architecture"),
    ("judge", "reference"),
    ("verdict", "check result"),
    ("rung", "step"),
    ("climb", "step"),
    ("scout", "pilot"),
    ("arrival", "lens connection"),
    ("hasty", "preview"),
    ("slack", "tolerance, or error bound"),
    ("wobble", "error bound"),
    ("squeeze", "radiance_eta"),
    ("developing", "display settings"),
];

/// The names in code, with their line; neither of strings nor of comments.
fn names(code: &str) -> Vec<(usize, String)> {
    let mut found = Vec::new();
    for (i, line) in code.lines().enumerate() {
        let mut is_text = false;
        let mut plain = String::new();
        let mut before = ' ';
        for c in line.split("//").next().unwrap_or_default().chars() {
            is_text ^= c == '"' && before != '\\';
            plain.push(if is_text { ' ' } else { c });
            before = c;
        }
        let words = plain.split(|c: char| !(c.is_alphanumeric() || c == '_')).filter(|word| !word.is_empty());
        found.extend(words.map(|word| (i + 1, word.to_owned())));
    }
    found
}

/// The words of a name in lower case: of `LensArrivals` and `lens_arrivals`, `lens` and `arrivals`.
fn parts(name: &str) -> Vec<String> {
    let mut parts = vec![String::new()];
    for c in name.chars() {
        if c == '_' || c.is_uppercase() {
            parts.push(String::new());
        }
        if c != '_' {
            parts.last_mut().unwrap().extend(c.to_lowercase());
        }
    }
    parts
}

#[test]
fn names_in_the_code_are_in_words_of_the_field() {
    let is = |part: &str, retired: &str| part == retired || part.strip_suffix('s') == Some(retired);
    let mut wrong = BTreeSet::new();
    for path in sources() {
        let text = read(&path).text;
        for (line, name) in names(&text) {
            for part in parts(&name) {
                if let Some((_, better)) = RETIRED_NAMES.iter().find(|(retired, _)| is(&part, retired)) {
                    wrong.insert(format!("{path}:{line}: `{name}`: {better}"));
                }
            }
        }
    }
    expect_none(wrong.into_iter().collect());
    assert_eq!(parts("LensArrivals_of"), ["", "lens", "arrivals", "of"]);
    let code = "let is_scout = \"a lamp\"; // chance";
    assert_eq!(names(code), [(1, "let".to_owned()), (1, "is_scout".to_owned())]);
}

#[test]
fn doc_comments_of_public_items_are_found() {
    let source = "//! Of a module.\n\n/// Of a lamp.\n#[derive(Debug)]\npub struct A {\n    /// A field.\n    pub a: u32,\n}\n\n\
                  /// Private.\nfn f() {}\n// No doc.\n/// A variant.\nB,\n";
    let found = doc_comments(source);
    let texts: Vec<&str> = found.iter().map(|(_, text)| text.as_str()).collect();
    assert_eq!(texts, ["Of a module.", "Of a lamp.", "A field.", "A variant."]);
    assert_eq!(found[1].0, 3);
}

#[test]
fn texts_are_found() {
    let source = "let a = \"one \\\"two\\\" \\\n    three\"; // \"not\"\nlet c = '\"'; f(r#\"four\"#);\n\n#[cfg(test)]\nmod tests { \"x\" }";
    let texts: Vec<(usize, String)> = literals(source);
    assert_eq!(texts, [(1, "one \\\"two\\\" three".to_owned()), (3, "four".to_owned())]);
}
