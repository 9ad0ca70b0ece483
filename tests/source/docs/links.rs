//! Links lead somewhere, and whatever is named is there.

use super::page::{Page, expect_none, files, pages, plain_path, read, root};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// What a relative link that leads nowhere is called.
fn broken_link(page: &Page, target: &str) -> Option<String> {
    if target.contains("://") || target.starts_with("mailto:") {
        return None;
    }
    let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
    let folder = Path::new(&page.path).parent().unwrap();
    let path = if file.is_empty() { PathBuf::from(&page.path) } else { plain_path(&folder.join(file)) };
    if !root().join(&path).exists() {
        return Some(format!("there is no {}", path.display()));
    }
    let path = path.to_string_lossy().replace('\\', "/");
    let is_known = anchor.is_empty() || read(&path).anchors().contains(anchor);
    (!is_known).then(|| format!("{path} has no heading #{anchor}"))
}

#[test]
fn links_lead_somewhere() {
    let mut pages = pages();
    pages.push(read("ARCHITECTURE.md"));
    let mut problems = Vec::new();
    for page in &pages {
        for (line, target) in page.links() {
            problems.extend(broken_link(page, &target).map(|why| format!("{}:{line}: {target}: {why}", page.path)));
        }
    }
    expect_none(problems);
}

#[test]
fn a_broken_link_would_be_found() {
    let text = "# A b\n[x](#a-b) [y](README.md) ![z](docs/none.jpg) `[v](none)`\n\n[w]: README.md#none\n";
    let page = Page { path: "README.md".to_owned(), text: text.to_owned() };
    let broken: Vec<String> = page.links().into_iter().filter_map(|(_, target)| broken_link(&page, &target)).collect();
    // The page on disk has no heading `A b`.
    assert_eq!(broken.len(), 3, "{broken:?}");
    assert!(page.anchors().contains("a-b"));
}

#[test]
fn the_index_leads_to_every_page() {
    let names = |path: &str| -> BTreeSet<String> {
        let page = read(path);
        let folder = Path::new(path).parent().unwrap().to_owned();
        let target = |(_, link): (usize, String)| {
            let file = link.split('#').next().unwrap_or_default();
            plain_path(&folder.join(file)).to_string_lossy().replace('\\', "/")
        };
        page.links().into_iter().map(target).collect()
    };
    let (book, runs) = (names("docs/README.md"), names("docs/measurements/README.md"));
    let is_missing = |path: &String| !path.ends_with("README.md") && !book.contains(path) && !runs.contains(path);
    expect_none(
        files("docs", &[".md"]).into_iter().filter(is_missing).map(|path| format!("no index has {path}")).collect(),
    );
}

#[test]
fn what_the_source_calls_by_name_is_there() {
    let mut problems = Vec::new();
    for folder in ["src", "crates", "tests", "benches", "scripts", "examples"] {
        for path in files(folder, &[".rs", ".sh", ".py"]) {
            let text = fs::read_to_string(root().join(&path)).unwrap();
            for (at, _) in text.match_indices("docs/") {
                let is_name = |c: char| c.is_alphanumeric() || "-_./".contains(c);
                let name: String = text[at..].chars().take_while(|c| is_name(*c)).collect();
                let is_page = name.ends_with(".md") && path != "tests/source/docs.rs";
                if is_page && !root().join(&name).exists() {
                    problems.push(format!("{path}: there is no {name}"));
                }
            }
        }
    }
    expect_none(problems);
}
