//! Scene formats of other renderers: the one table for opening, naming and listing them.

use std::path::Path;

/// Number of elements of a scene of Mitsuba, with those of included files: a file may be included again and again.
pub const MAX_XML_ELEMENTS: usize = 1 << 22;

/// A format of scenes that can be opened, besides our own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SceneFormat {
    /// pbrt, version 4: text with meshes, and PLY files beside it.
    Pbrt,
    /// Mitsuba 3: XML with meshes in files of their own.
    Mitsuba,
    /// Tungsten: JSON with meshes in files of their own.
    Tungsten,
}

impl SceneFormat {
    /// All formats, in the order of listing.
    pub const ALL: [Self; 3] = [Self::Pbrt, Self::Mitsuba, Self::Tungsten];

    /// File extension, in lower case and without the dot.
    pub fn file_extension(self) -> &'static str {
        match self {
            Self::Pbrt => "pbrt",
            Self::Mitsuba => "xml",
            Self::Tungsten => "json",
        }
    }

    /// The format for the extension of a path, case-insensitive.
    pub fn of(path: &Path) -> Option<Self> {
        let extension = path.extension()?;
        Self::ALL.into_iter().find(|format| extension.eq_ignore_ascii_case(format.file_extension()))
    }

    /// List of extensions for messages, with that of our own scenes: `.ron, .pbrt, .xml, .json`.
    pub fn extensions() -> String {
        Self::each(".").join(", ")
    }

    /// List of shell patterns, likewise: `*.ron *.pbrt *.xml *.json`.
    pub fn patterns() -> String {
        Self::each("*.").join(" ")
    }

    fn each(before: &str) -> Vec<String> {
        let all = std::iter::once("ron").chain(Self::ALL.into_iter().map(Self::file_extension));
        all.map(|extension| format!("{before}{extension}")).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_tell_formats_whatever_their_case() {
        assert_eq!(SceneFormat::of(Path::new("a/b.PBRT")), Some(SceneFormat::Pbrt));
        assert_eq!(SceneFormat::of(Path::new("a.ron")), None);
        assert_eq!(SceneFormat::of(Path::new("pbrt")), None);
        assert!(SceneFormat::extensions().starts_with(".ron, .pbrt"));
        assert!(SceneFormat::patterns().starts_with("*.ron *.pbrt"));
    }
}
