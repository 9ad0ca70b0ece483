//! Rules for the whole source: what the program may do in one place only.

use std::path::{Path, PathBuf};

/// Every file below `src`, `crates` and `python/src`, without its tests, which are the last thing in a file.
fn sources() -> Vec<(String, String)> {
    fn collect(folder: &Path, found: &mut Vec<PathBuf>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                collect(&path, found);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                found.push(path);
            }
        }
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut found = Vec::new();
    collect(&root.join("src"), &mut found);
    collect(&root.join("crates"), &mut found);
    collect(&root.join("python/src"), &mut found);
    found.sort();
    let read = |path: &PathBuf| {
        let text = std::fs::read_to_string(path).unwrap();
        let code = text.split("#[cfg(test)]\nmod ").next().unwrap_or_default().to_owned();
        (path.strip_prefix(root).unwrap().to_string_lossy().replace('\\', "/"), code)
    };
    found.iter().map(read).collect()
}

/// Lines of code, outside of the files that may, that have one of the patterns.
fn found(patterns: &[&str], allowed: &[&str]) -> Vec<String> {
    let sources = sources();
    for name in allowed {
        assert!(sources.iter().any(|(path, _)| path == name), "there is no {name}");
    }
    let outside = sources.iter().filter(|(path, _)| !allowed.contains(&path.as_str()));
    outside
        .flat_map(|(path, code)| code.lines().enumerate().map(move |(i, line)| (path, i + 1, line.trim())))
        .filter(|(_, _, line)| !line.starts_with("//") && patterns.iter().any(|pattern| has_word(line, pattern)))
        .map(|(path, number, line)| format!("{path}:{number}: {line}"))
        .collect()
}

/// Whether `pattern` stands there and is not the end of a longer name.
fn has_word(line: &str, pattern: &str) -> bool {
    let is_name = |c: char| c.is_alphanumeric() || c == '_';
    line.match_indices(pattern).any(|(at, _)| !line[..at].ends_with(is_name))
}

#[test]
fn files_are_read_through_the_bounded_reader_alone() {
    let patterns = [
        "File::open(",
        "File::options(",
        "fs::read(",
        "fs::read_to_string(",
        "read(true)",
        "ImageReader::open(",
        "image::open(",
        "read_from_file(",
        "from_file(",
    ];
    // `keys/page.rs` is a test; two open temporary files and folders to lock them, and read none.
    let allowed = [
        "crates/files/src/input_file.rs",
        "crates/files/src/new_folder.rs",
        "crates/files/src/whole_file.rs",
        "src/viewer/keys/page.rs",
    ];
    let others = found(&patterns, &allowed);
    assert!(others.is_empty(), "use scene::InputFile:\n{}", others.join("\n"));
    // The test would find one.
    assert!(!found(&["read(true)"], &[]).is_empty());
}

#[test]
fn all_that_is_said_goes_through_the_console() {
    let patterns = [
        "println!(",
        "eprintln!(",
        "print!(",
        "eprint!(",
        "dbg!(",
        "stdout()",
        "stderr()",
        "io::stdout",
        "io::stderr",
        "indicatif::",
        "ProgressBar",
    ];
    let others = found(&patterns, &["src/console.rs"]);
    assert!(others.is_empty(), "use console::print and console::remark:\n{}", others.join("\n"));
    assert!(!found(&["stdout()"], &[]).is_empty());
}

/// Texts that list the formats of scenes list all of them.
#[test]
fn lists_of_scene_formats_are_whole() {
    let whole = firstlight_format::scene_format::SceneFormat::extensions();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let pages = ["README.md", "docs/keys.md", "docs/command-line.md"].map(|name| {
        let text = std::fs::read_to_string(root.join(name)).unwrap_or_default();
        (name.to_owned(), text)
    });
    let lists = |(path, text): &(String, String)| {
        let wrong = |line: &&str| line.contains("(.ron, ") && !line.contains(&whole);
        text.lines().filter(wrong).map(|line| format!("{path}: {}", line.trim())).collect::<Vec<_>>()
    };
    let wrong: Vec<String> = sources().iter().chain(&pages).flat_map(lists).collect();
    assert!(wrong.is_empty(), "not {whole}:\n{}", wrong.join("\n"));
}
