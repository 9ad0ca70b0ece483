//! The formats of models: the one table that everything goes by which opens, names or offers them.

use std::path::Path;

/// A format of models that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ModelFormat {
    /// Wavefront OBJ, with materials from MTL files.
    Obj,
    /// PLY: ASCII, binary little-endian or big-endian.
    Ply,
    /// STL: ASCII or binary.
    Stl,
}

impl ModelFormat {
    /// All of them, in the order in which they are named.
    pub const ALL: [Self; 3] = [Self::Obj, Self::Ply, Self::Stl];

    /// How names of such files end, in lower case and without the dot.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Obj => "obj",
            Self::Ply => "ply",
            Self::Stl => "stl",
        }
    }

    /// The format that the name of a file tells, whatever the case of its letters.
    pub fn of(path: &Path) -> Option<Self> {
        let extension = path.extension()?;
        Self::ALL.into_iter().find(|format| extension.eq_ignore_ascii_case(format.extension()))
    }

    /// Extensions as sentences name them: `.obj, .ply, .stl`.
    pub fn extensions() -> String {
        Self::ALL.map(|format| format!(".{}", format.extension())).join(", ")
    }

    /// Patterns of names, as shells write them: `*.obj *.ply *.stl`.
    pub fn patterns() -> String {
        Self::ALL.map(|format| format!("*.{}", format.extension())).join(" ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_tell_formats_whatever_their_case() {
        assert_eq!(ModelFormat::of(Path::new("a/b.PLY")), Some(ModelFormat::Ply));
        assert_eq!(ModelFormat::of(Path::new("stl")), None);
        assert_eq!(ModelFormat::extensions(), ".obj, .ply, .stl");
        assert_eq!(ModelFormat::patterns(), "*.obj *.ply *.stl");
    }
}
