//! The model formats: the one table for opening, naming and listing them.

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
    /// glTF 2.0, binary or text, with materials, lights and cameras.
    Gltf,
}

impl ModelFormat {
    /// All formats, in the order of listing.
    pub const ALL: [Self; 4] = [Self::Obj, Self::Ply, Self::Stl, Self::Gltf];

    /// File extensions, in lower case and without the dot.
    pub fn file_extensions(self) -> &'static [&'static str] {
        match self {
            Self::Obj => &["obj"],
            Self::Ply => &["ply"],
            Self::Stl => &["stl"],
            Self::Gltf => &["glb", "gltf", "vrm"],
        }
    }

    /// The format for the extension of a path, case-insensitive; a PLY file may be compressed (`.ply.gz`).
    pub fn of(path: &Path) -> Option<Self> {
        let extension = path.extension()?;
        if extension.eq_ignore_ascii_case("gz") {
            return Self::of(Path::new(path.file_stem()?)).filter(|format| *format == Self::Ply);
        }
        let has = |format: &Self| format.file_extensions().iter().any(|known| extension.eq_ignore_ascii_case(known));
        Self::ALL.into_iter().find(has)
    }

    /// List of extensions for messages: `.obj, .ply, .stl, .glb, .gltf, .vrm`.
    pub fn extensions() -> String {
        Self::each(".").join(", ")
    }

    /// List of shell patterns: `*.obj *.ply *.stl *.glb *.gltf *.vrm`.
    pub fn patterns() -> String {
        Self::each("*.").join(" ")
    }

    fn each(before: &str) -> Vec<String> {
        let extensions = Self::ALL.into_iter().flat_map(Self::file_extensions);
        extensions.map(|extension| format!("{before}{extension}")).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_tell_formats_whatever_their_case() {
        assert_eq!(ModelFormat::of(Path::new("a/b.PLY")), Some(ModelFormat::Ply));
        assert_eq!(ModelFormat::of(Path::new("a.gltf")), Some(ModelFormat::Gltf));
        assert_eq!(ModelFormat::of(Path::new("avatar.vrm")), Some(ModelFormat::Gltf));
        assert_eq!(ModelFormat::of(Path::new("a/b.ply.gz")), Some(ModelFormat::Ply));
        assert_eq!(ModelFormat::of(Path::new("a.obj.gz")), None);
        assert_eq!(ModelFormat::of(Path::new("stl")), None);
        assert_eq!(ModelFormat::extensions(), ".obj, .ply, .stl, .glb, .gltf, .vrm");
        assert_eq!(ModelFormat::patterns(), "*.obj *.ply *.stl *.glb *.gltf *.vrm");
    }
}
