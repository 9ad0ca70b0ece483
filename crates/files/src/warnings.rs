//! What the user of a scene should know about how it was read: each thing once, things of one kind together.
//!
//! Readers push sentences. Two sentences are of one kind if they differ only in names, paths and numbers
//! ([`Warning::kind`]), so that a model with the same fault in fifty meshes gives one line.

use std::borrow::Borrow;
use std::collections::HashMap;
use std::fmt;
use std::ops::Deref;
use std::path::Path;

/// How serious a [`Warning`] is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Severity {
    /// Good to know: nothing is wrong or lost.
    Notice,
    /// Something of the file is missing, replaced or ignored.
    Warning,
}

/// One sentence about a scene.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Warning {
    /// How serious it is.
    pub severity: Severity,
    text: String,
    kind: String,
}

impl Warning {
    fn new(severity: Severity, text: String) -> Self {
        Self { severity, kind: kind_of(&text), text }
    }

    /// A sentence that is good to know.
    pub fn notice(text: impl Into<String>) -> Self {
        Self::new(Severity::Notice, text.into())
    }

    /// The sentence without what it is about: names in backticks, paths and numbers are left out.
    pub fn kind(&self) -> &str {
        &self.kind
    }
}

impl From<String> for Warning {
    fn from(text: String) -> Self {
        Self::new(Severity::Warning, text)
    }
}

impl From<&str> for Warning {
    fn from(text: &str) -> Self {
        text.to_owned().into()
    }
}

impl Deref for Warning {
    type Target = str;

    fn deref(&self) -> &str {
        &self.text
    }
}

impl Borrow<str> for Warning {
    fn borrow(&self) -> &str {
        self
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// Distinct warnings in the order in which they were found. Their number is limited, since a hostile file can cause a
/// million; the rest is counted.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Warnings {
    list: Vec<Warning>,
    kinds: HashMap<String, WarningKind>,
}

/// Numbers of warnings of one kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct WarningKind {
    listed: usize,
    more: usize,
}

impl Warnings {
    const MAX_OF_KIND: usize = 100;
    const MAX_KINDS: usize = 100;

    /// Adds a warning that is not in the list.
    pub fn push(&mut self, warning: impl Into<Warning>) {
        let mut warning = warning.into();
        if !self.kinds.contains_key(&warning.kind) && self.kinds.len() >= Self::MAX_KINDS {
            warning.kind.clear();
        }
        let kind = self.kinds.entry(warning.kind.clone()).or_default();
        if kind.listed == Self::MAX_OF_KIND {
            kind.more += 1;
        } else if !self.list.contains(&warning) {
            kind.listed += 1;
            self.list.push(warning);
        }
    }

    /// Adds a warning whose text takes time to make: where enough of its kind are listed, it is only counted.
    ///
    /// - `alike`: a sentence of the same kind.
    pub fn push_like(&mut self, alike: &str, make: impl FnOnce() -> String) {
        let kind = kind_of(alike);
        let is_listed = self.kinds.contains_key(&kind) || self.kinds.len() < Self::MAX_KINDS;
        match self.kinds.get_mut(if is_listed { kind.as_str() } else { "" }) {
            Some(kind) if kind.listed == Self::MAX_OF_KIND => kind.more += 1,
            _ => self.push(make()),
        }
    }

    /// Adds those of another list that are not in this one.
    pub fn append(&mut self, other: &Self) {
        self.extend(other.list.iter().cloned());
        for (name, kind) in other.kinds.iter().filter(|(_, kind)| kind.more > 0) {
            self.kinds.entry(name.clone()).or_default().more += kind.more;
        }
    }

    /// The same warnings with the path of the file that they are about.
    #[must_use]
    pub fn of_file(&self, path: &Path) -> Self {
        let mut all = Self::default();
        for warning in &self.list {
            let of_file = Warning::new(warning.severity, format!("{}: {warning}", path.display()));
            let kind = of_file.kind.clone();
            all.push(of_file);
            all.kinds.entry(kind).or_default().more = self.kinds.get(&warning.kind).map_or(0, |kind| kind.more);
        }
        all
    }

    /// Number of warnings, including those that are counted only.
    pub fn total(&self) -> usize {
        self.kinds.values().map(|kind| kind.listed + kind.more).sum()
    }

    /// One warning per kind: the first, with the number of the others.
    pub fn summary(&self) -> Vec<Warning> {
        let mut told = HashMap::new();
        let first = self.list.iter().filter(|warning| told.insert(&warning.kind, ()).is_none());
        let line = |warning: &Warning| {
            let more = self.kinds.get(&warning.kind).map_or(0, |kind| kind.listed + kind.more - 1);
            let text = if more == 0 { warning.to_string() } else { format!("{warning} (and {more} more)") };
            Warning { text, ..warning.clone() }
        };
        first.map(line).collect()
    }

    /// The other warnings of the kind of one of the [summary](Self::summary) that are listed.
    pub fn others_like(&self, first: &Warning) -> impl Iterator<Item = &Warning> {
        self.list.iter().filter(move |warning| warning.kind == first.kind).skip(1)
    }
}

impl Deref for Warnings {
    type Target = [Warning];

    fn deref(&self) -> &[Warning] {
        &self.list
    }
}

impl<W: Into<Warning>> Extend<W> for Warnings {
    fn extend<I: IntoIterator<Item = W>>(&mut self, warnings: I) {
        warnings.into_iter().for_each(|warning| self.push(warning));
    }
}

impl<W: Into<Warning>> FromIterator<W> for Warnings {
    fn from_iter<I: IntoIterator<Item = W>>(warnings: I) -> Self {
        let mut all = Self::default();
        all.extend(warnings);
        all
    }
}

impl<'a> IntoIterator for &'a Warnings {
    type Item = &'a Warning;
    type IntoIter = std::slice::Iter<'a, Warning>;

    fn into_iter(self) -> Self::IntoIter {
        self.list.iter()
    }
}

/// A sentence with names in backticks and paths replaced by `…`, numbers by `#`.
fn kind_of(text: &str) -> String {
    /// Bytes of a kind, which come from the program: what is longer is foreign.
    const LONGEST: usize = 400;
    let mut kind = String::new();
    for (i, part) in text.split('`').enumerate() {
        if i % 2 == 1 {
            kind.push('…');
            continue;
        }
        for clause in part.split_inclusive(": ") {
            // A path before a colon may have spaces.
            if clause.strip_suffix(": ").is_some_and(is_path) {
                kind.push_str("…: ");
                continue;
            }
            for word in clause.split_inclusive(' ') {
                match word.trim_end_matches([' ', ',', ';']) {
                    path if is_path(path) => kind.push_str("… "),
                    _ => push_without_numbers(&mut kind, word),
                }
            }
        }
        if kind.len() > LONGEST {
            break;
        }
    }
    let end = kind.char_indices().map(|(at, _)| at).find(|at| *at > LONGEST).unwrap_or(kind.len());
    kind.truncate(end);
    kind
}

/// Whether a text ends like a file name or has a separator of folders.
fn is_path(text: &str) -> bool {
    let has_extension = |(_, end): (&str, &str)| {
        (1..=8).contains(&end.len())
            && end.chars().all(|c| c.is_ascii_alphanumeric())
            && end.starts_with(|c: char| c.is_ascii_alphabetic())
    };
    text.contains(['/', '\\']) || text.rsplit_once('.').is_some_and(has_extension)
}

fn push_without_numbers(kind: &mut String, word: &str) {
    for c in word.chars() {
        if !c.is_ascii_digit() {
            kind.push(c);
        } else if !kind.ends_with('#') {
            kind.push('#');
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(warnings: &[Warning]) -> Vec<String> {
        warnings.iter().map(Warning::to_string).collect()
    }

    #[test]
    fn what_is_only_counted_is_not_made() {
        let (mut lazy, mut all) = (Warnings::default(), Warnings::default());
        let mut made = 0;
        for line in 0..1000 {
            let text = format!("a.xml:{line}:1: it is flat");
            all.push(text.clone());
            lazy.push_like("a.xml:1:1: it is flat", || {
                made += 1;
                text
            });
        }
        assert_eq!((made, lazy), (100, all));
    }

    #[test]
    fn the_same_is_kept_once_and_one_kind_is_one_line() {
        let mut all = Warnings::default();
        for mesh in (0..25).chain(0..25) {
            all.push(format!("a b.glb: meshes/{mesh}: {} triangles use a vertex twice and were removed", 1 + mesh % 3));
        }
        all.push("a b.glb: `red: 1`: the sheen is not modelled".to_owned());
        all.push("a b.glb: `blue`: the sheen is not modelled".to_owned());
        all.push(Warning::notice("a b.glb: has no light"));
        assert_eq!((all.len(), all.total()), (28, 28));
        assert_eq!(
            texts(&all.summary()),
            [
                "a b.glb: meshes/0: 1 triangles use a vertex twice and were removed (and 24 more)",
                "a b.glb: `red: 1`: the sheen is not modelled (and 1 more)",
                "a b.glb: has no light",
            ]
        );
        assert_eq!(all.summary()[2].severity, Severity::Notice);
    }

    #[test]
    fn kinds_leave_out_paths_and_numbers_and_nothing_else() {
        let same = [
            ("big wall.png: no such file; the texture is omitted", "x/y.jpg: no such file; the texture is omitted"),
            ("m.obj: 2 line elements were ignored", "/tmp/k.obj: 17 line elements were ignored"),
            ("m.mtl: line 3: `Kq` is not known", "m.mtl: line 14: `Ku 1 2` is not known"),
        ];
        for (a, b) in same {
            assert_eq!(Warning::from(a).kind(), Warning::from(b).kind());
        }
        let [a, b] = ["m.mtl: line 3: Kd is not known", "m.mtl: line 3: Ks is not known"].map(Warning::from);
        assert_ne!(a.kind(), b.kind());
    }

    #[test]
    fn a_million_warnings_are_counted() {
        let mut all = Warnings::default();
        for i in 0..1_000_000 {
            all.push(format!("vertex {i} is not finite"));
        }
        all.push("another");
        assert_eq!((all.len(), all.total()), (Warnings::MAX_OF_KIND + 1, 1_000_001));
        assert_eq!(all.summary()[0].to_string(), "vertex 0 is not finite (and 999999 more)");
        let others: Vec<String> = all.others_like(&all.summary()[0]).map(ToString::to_string).collect();
        assert_eq!((&others[0][..], others.len() + 1), ("vertex 1 is not finite", Warnings::MAX_OF_KIND));
        let mut others = Warnings::default();
        others.append(&all.of_file(Path::new("a.ply")));
        assert_eq!((others.len(), others.total()), (all.len(), all.total()));
        assert_eq!(others[0].to_string(), "a.ply: vertex 0 is not finite");
        let long: Warnings = (0..1000).map(|i| "x".repeat(i)).collect();
        assert!(long.kinds.len() <= Warnings::MAX_KINDS + 1 && long.total() == 1000);
    }
}
