//! Pages of the documentation, and the blocks, links and headings on them.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Component, Path, PathBuf};

/// A Markdown file of the project.
pub struct Page {
    /// From the root, with `/`.
    pub path: String,
    pub text: String,
}

/// A fenced block.
pub struct Block {
    pub language: String,
    /// Of its fence, from 1.
    pub line: usize,
    pub text: String,
    /// A comment above it says that it is not run.
    pub is_skipped: bool,
}

pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

pub fn read(path: &str) -> Page {
    let text = fs::read_to_string(root().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"));
    Page { path: path.to_owned(), text }
}

/// Files below `folder` whose name ends as asked, in order.
pub fn files(folder: &str, endings: &[&str]) -> Vec<String> {
    let mut found = Vec::new();
    let mut open = vec![root().join(folder)];
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.strip_prefix(root()).unwrap().to_string_lossy().replace('\\', "/");
            if path.is_dir() {
                // Packages of their own are built in theirs.
                if !path.ends_with("target") {
                    open.push(path);
                }
            } else if endings.iter().any(|ending| name.ends_with(ending)) {
                found.push(name);
            }
        }
    }
    found.sort();
    found
}

/// The pages that a visitor sees first, and the book.
pub fn pages() -> Vec<Page> {
    let mut pages: Vec<Page> = ["README.md", "CONTRIBUTING.md", "SECURITY.md"].map(read).into();
    pages.extend(files("docs", &[".md"]).iter().map(|path| read(path)));
    assert!(pages.len() > 10);
    pages
}

impl Page {
    /// Lines with their numbers from 1, and whether they belong to a fenced block.
    pub fn lines(&self) -> impl Iterator<Item = (usize, &str, bool)> {
        let mut is_code = false;
        self.text.lines().enumerate().map(move |(i, line)| {
            let is_fence = line.trim_start().starts_with("```");
            let was_code = is_code;
            is_code ^= is_fence;
            (i + 1, line, was_code || is_fence)
        })
    }

    /// Lines outside of fenced blocks.
    pub fn prose(&self) -> impl Iterator<Item = (usize, &str)> {
        self.lines().filter(|(.., is_code)| !is_code).map(|(number, line, _)| (number, line))
    }

    pub fn blocks(&self) -> Vec<Block> {
        let mut blocks: Vec<Block> = Vec::new();
        let (mut before, mut is_open) = ("", false);
        for (i, line) in self.text.lines().enumerate() {
            match line.trim_start().strip_prefix("```") {
                Some(_) if is_open => is_open = false,
                Some(language) => {
                    is_open = true;
                    let is_skipped = before.starts_with("<!-- not run: ");
                    blocks.push(Block { language: language.to_owned(), line: i + 1, text: String::new(), is_skipped });
                }
                None if is_open => {
                    let block = blocks.last_mut().unwrap();
                    block.text.push_str(line);
                    block.text.push('\n');
                }
                None => {}
            }
            if !line.trim().is_empty() {
                before = line.trim();
            }
        }
        assert!(!is_open, "{}: a block is not closed", self.path);
        blocks
    }

    /// What `#…` may name: headings as GitHub turns them into anchors.
    pub fn anchors(&self) -> BTreeSet<String> {
        let mut seen: BTreeMap<String, usize> = BTreeMap::new();
        let headings = self.prose().filter_map(|(_, line)| line.strip_prefix('#')).map(|line| {
            let plain = line.trim_start_matches('#').trim().to_lowercase();
            let kept = plain.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
            kept.map(|c| if c == ' ' { '-' } else { c }).collect::<String>()
        });
        let number = |anchor: String| {
            let n = seen.entry(anchor.clone()).or_default();
            *n += 1;
            if *n == 1 { anchor } else { format!("{anchor}-{}", *n - 1) }
        };
        headings.map(number).collect()
    }

    /// Targets of links and images, with their lines.
    pub fn links(&self) -> Vec<(usize, String)> {
        let mut links = Vec::new();
        for (number, line) in self.prose() {
            let line = without_code(line);
            for (at, _) in line.match_indices("](") {
                let target = line[at + 2..].split(')').next().unwrap_or_default();
                links.push((number, target.split_whitespace().next().unwrap_or_default().to_owned()));
            }
            if let Some(target) = line.starts_with('[').then(|| line.split_once("]: ")).flatten() {
                links.push((number, target.1.trim().to_owned()));
            }
        }
        links
    }
}

/// A line without its code spans.
pub fn without_code(line: &str) -> String {
    line.split('`').step_by(2).collect::<Vec<_>>().join(" ")
}

/// A path without `.` and `..`.
pub fn plain_path(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => {
                plain.pop();
            }
            Component::CurDir => {}
            part => plain.push(part),
        }
    }
    plain
}

/// Fails with all problems at once.
pub fn expect_none(problems: Vec<String>) {
    assert!(problems.is_empty(), "\n{}\n", problems.join("\n"));
}
