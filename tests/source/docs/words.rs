//! Length of lines and pages, and words that have a better one.

use super::page::{expect_none, files, pages, without_code};
use std::collections::BTreeSet;

const MAX_COLUMNS: usize = 120;
const MAX_LINES: usize = 150;

/// Pages that may be longer than [`MAX_LINES`]: generated, or figures as they were measured.
const LONG: [&str; 2] = ["docs/keys.md", "docs/measurements/"];

/// Their words are those of the table of keys in the sources.
const GENERATED: &str = "docs/keys.md";

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

#[test]
fn lines_and_pages_are_short() {
    // ARCHITECTURE.md and CHANGELOG.md are not held to it yet.
    let mut problems = Vec::new();
    for page in pages() {
        let n = page.text.lines().count();
        if n > MAX_LINES && !LONG.iter().any(|long| page.path.starts_with(long)) {
            problems.push(format!("{}: {n} lines: split it at {MAX_LINES}", page.path));
        }
        for (number, line, _) in page.lines() {
            let columns = line.chars().count();
            if columns > MAX_COLUMNS && page.path != GENERATED {
                problems.push(format!("{}:{number}: {columns} columns: wrap it at {MAX_COLUMNS}", page.path));
            }
        }
    }
    expect_none(problems);
}

/// Names of scenes, which may have words that are retired elsewhere.
fn scene_names() -> BTreeSet<String> {
    let name = |path: &String| path.trim_start_matches("assets/scenes/").trim_end_matches(".ron").to_owned();
    files("assets/scenes", &[".ron"]).iter().map(name).filter(|name| name.contains('-')).collect()
}

/// Retired words of a line of prose, each with what to say instead.
fn retired_words(line: &str, scenes: &BTreeSet<String>) -> Vec<(&'static str, &'static str)> {
    let mut text = without_code(line).to_lowercase();
    if text.starts_with("<!--") || (text.starts_with('[') && text.contains("]: ")) {
        return Vec::new();
    }
    // Targets of links are names of files.
    while let Some(at) = text.find("](") {
        let end = text[at..].find(')').map_or(text.len(), |end| at + end + 1);
        text.replace_range(at..end, " ");
    }
    for name in scenes {
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

#[test]
fn words_are_those_of_the_field() {
    let scenes = scene_names();
    let mut problems = Vec::new();
    for page in pages().iter().filter(|page| page.path != GENERATED) {
        for (number, line) in page.prose() {
            for (word, better) in retired_words(line, &scenes) {
                problems.push(format!("{}:{number}: `{word}`: say {better}", page.path));
            }
        }
    }
    expect_none(problems);
}

#[test]
fn a_retired_word_would_be_found() {
    let scenes = scene_names();
    let found = |line| retired_words(line, &scenes).into_iter().map(|(word, _)| word).collect::<Vec<_>>();
    assert_eq!(found("The Lamp shines; 16 samples a pixel."), ["lamp", "samples a pixel"]);
    assert!(found("The scene cornell-balls, `lamp`, [lights](lamp.md), clamp").is_empty());
}
