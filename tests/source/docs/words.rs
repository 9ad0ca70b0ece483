//! Length of lines and pages, and words that have a better one.

use super::page::{Page, expect_none, pages, read};
use crate::words::{retired_words, retired_words_in, scene_names};

const MAX_COLUMNS: usize = 120;
const MAX_LINES: usize = 150;

/// Pages that may be longer than [`MAX_LINES`]: generated, figures as they were measured, or history.
const LONG: [&str; 3] = ["docs/keys.md", "docs/measurements/", "CHANGELOG.md"];

/// Their words are those of the table of keys in the sources.
const GENERATED: &str = "docs/keys.md";

/// All pages, and what changed.
fn pages_and_changelog() -> Vec<Page> {
    let mut pages = pages();
    pages.push(read("CHANGELOG.md"));
    pages
}

#[test]
fn lines_and_pages_are_short() {
    let mut problems = Vec::new();
    for page in pages_and_changelog() {
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

#[test]
fn words_are_those_of_the_field() {
    let scenes = scene_names();
    let mut problems = Vec::new();
    for page in pages_and_changelog().iter().filter(|page| page.path != GENERATED) {
        for (number, line) in page.prose() {
            for (word, better) in retired_words_in(&page.path, line, &scenes) {
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
