//! Whatever the program has is described.

use super::commands::TempFolder;
use super::page::{expect_none, files, read};
use std::collections::BTreeSet;

/// The types that a scene file is read into; of the files without a list, all.
const GRAMMAR: [(&str, &[&str]); 12] = [
    ("crates/format/src/parts.rs", &[]),
    ("crates/format/src/scene_file.rs", &[]),
    ("crates/format/src/camera.rs", &[]),
    ("crates/format/src/animation.rs", &["AnimationPart", "EditedPart", "TrackPart"]),
    ("crates/format/src/key.rs", &["Interpolation"]),
    ("crates/format/src/sources.rs", &[]),
    ("crates/render/src/core/material.rs", &["Material", "Fresnel"]),
    ("crates/render/src/core/texture.rs", &["Wrap", "Channel"]),
    ("crates/render/src/core/image_texture.rs", &["Encoding"]),
    ("crates/render/src/core/filter.rs", &["PixelFilter"]),
    ("crates/render/src/core/settings.rs", &["Integrator"]),
    ("crates/render/src/film/develop/curve.rs", &["ToneCurve"]),
];

/// A table of properties, whose rows are `Name = "word": …`.
const TABLE: &str = "crates/format/src/property.rs";

/// Names that a scene file may have.
fn grammar_words() -> BTreeSet<String> {
    let row = |line: &str| {
        let (word, after) = line.split_once(" = \"")?.1.split_once('"')?;
        (after.starts_with(": ") && !line.trim_start().starts_with("//")).then(|| word.to_owned())
    };
    let mut words: BTreeSet<String> = read(TABLE).text.lines().filter_map(row).collect();
    assert!(words.contains("image_width") && words.contains("focus_distance"), "{words:?}");
    for (path, types) in GRAMMAR {
        let mut is_type = false;
        for line in read(path).text.lines() {
            if let Some(name) = line.strip_prefix("pub struct ").or_else(|| line.strip_prefix("pub enum ")) {
                let name: String = name.chars().take_while(|c| c.is_alphanumeric()).collect();
                is_type = types.is_empty() || types.contains(&name.as_str());
            }
            is_type &= line != "}";
            let line = line.trim().trim_start_matches("pub ");
            let name: String = line.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
            let after = &line[name.len()..];
            let is_field = after.starts_with(": ") && after.ends_with(',');
            let is_variant = name.starts_with(char::is_uppercase)
                && (after == "," || after.starts_with(" {") || after.starts_with('('));
            if is_type && !name.is_empty() && (is_field || is_variant) {
                words.insert(snake_case(&name));
            }
            // A variant on one line has its fields in braces.
            if let Some((_, fields)) = after.split_once("{ ").filter(|_| is_type && is_variant) {
                let names = fields.split(", ").filter_map(|field| field.split_once(": ")).map(|(name, _)| name);
                words.extend(names.map(str::to_owned));
            }
        }
    }
    words
}

fn snake_case(name: &str) -> String {
    let mut out = String::new();
    for c in name.chars() {
        if c.is_uppercase() && !out.is_empty() {
            out.push('_');
        }
        out.extend(c.to_lowercase());
    }
    out
}

#[test]
fn every_word_of_the_scene_file_is_described() {
    let book: String = [
        "scene-file",
        "scene-textures",
        "scene-materials",
        "scene-principled",
        "scene-disney",
        "scene-glass",
        "scene-objects",
        "scene-sky",
        "scene-animation",
    ]
    .map(|name| read(&format!("docs/{name}.md")).text)
    .concat();
    let words = grammar_words();
    assert!(words.len() > 80 && words.contains("pivot_distance") && words.contains("ball_grid"), "{words:?}");
    // In code, alone or with its value: `name`, `name(…)`.
    let is_there = |word: &str| ["`", "("].iter().any(|end| book.contains(&format!("`{word}{end}")));
    let in_heading =
        |word: &str| book.lines().any(|line| line.trim_start_matches('#').trim() == word && line.starts_with('#'));
    let missing = words.iter().filter(|word| !is_there(word) && !in_heading(word));
    expect_none(missing.map(|word| format!("docs/scene-*.md: `{word}` is not described")).collect());
}

#[test]
fn every_option_is_described() {
    let page = ["command-line", "cluster-options"].map(|name| read(&format!("docs/{name}.md")).text).concat();
    let folder = TempFolder::new("options");
    let mut problems = Vec::new();
    let commands = [
        "",
        "render",
        "info",
        "merge",
        "pack",
        "submit",
        "status",
        "work",
        "save",
        "explain",
        "scenes",
        "simplify",
        "stability",
        "report",
        "completions",
        "man",
    ];
    for command in commands {
        let words: Vec<String> =
            [command, "--help"].into_iter().filter(|word| !word.is_empty()).map(str::to_owned).collect();
        let output = folder.run(&words, &[]);
        let help = String::from_utf8_lossy(&output.stdout).into_owned();
        let words = help.lines().filter(|line| line.trim_start().starts_with('-')).flat_map(str::split_whitespace);
        for option in words.filter(|word| word.starts_with("--")).map(|word| word.trim_end_matches([',', ']'])) {
            if !page.contains(&format!("`{option}`")) && !page.contains(&format!("`{option} ")) {
                problems.push(format!("docs/command-line.md: `{option}` of `firstlight {command}` is not described"));
            }
        }
    }
    expect_none(problems);
}

#[test]
fn measurements_say_where_they_come_from() {
    let mut problems = Vec::new();
    for path in files("docs/measurements", &[".md"]).into_iter().filter(|path| !path.ends_with("README.md")) {
        let name = path.trim_start_matches("docs/measurements/");
        let date: String = name.chars().take(10).map(|c| if c.is_ascii_digit() { '0' } else { c }).collect();
        let text = read(&path).text;
        if date != "0000-00-00" {
            problems.push(format!("{path}: begin its name with the date: YYYY-MM-DD-topic.md"));
        }
        for row in ["| Processor |", "| Commit |"] {
            if !text.contains(row) {
                problems.push(format!("{path}: has no row `{row}`"));
            }
        }
    }
    expect_none(problems);
}
