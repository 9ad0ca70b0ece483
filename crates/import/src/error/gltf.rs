//! Errors of glTF files: which file, which part of it, what was expected.

use crate::error::together::MeshesTooLarge;
use firstlight_files::input_file::ReadError;
use firstlight_files::limits::Limits;
use firstlight_files::printable::name;
use firstlight_files::reference::Outside;
use firstlight_mesh::MeshError;
use std::path::{Path, PathBuf};

/// Why a glTF file could not be opened.
#[derive(Debug, thiserror::Error)]
#[error("{}: {}{problem}", path.display(), if place.is_empty() { String::new() } else { format!("{place}: ") })]
pub struct GltfError {
    /// The file, or a file that it refers to.
    pub path: PathBuf,
    /// The part of it, such as `accessors[3]`; empty for the file as a whole.
    pub place: String,
    /// The problem there.
    #[source]
    pub problem: GltfProblem,
}

impl GltfError {
    pub(crate) fn at(path: &Path, (place, problem): Located) -> Self {
        Self { path: path.to_owned(), place, problem }
    }
}

/// A part of the file and its problem.
pub(crate) type Located = (String, GltfProblem);

/// `list[index]`.
pub(crate) fn place(list: &str, index: impl std::fmt::Display) -> String {
    format!("{list}[{index}]")
}

/// Returns the item of a list of a file that another part of it names.
pub(crate) fn item<'a, T>(list: &'a [T], name: &'static str, index: u32) -> Result<&'a T, GltfProblem> {
    list.get(index as usize).ok_or(GltfProblem::Index { list: name, index, count: list.len() })
}

/// A problem of a glTF file.
#[derive(Debug, thiserror::Error)]
pub enum GltfProblem {
    /// The file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// With it, the meshes of the scene are too large.
    #[error(transparent)]
    Together(#[from] MeshesTooLarge),
    /// The file is neither a GLB nor JSON.
    #[error("is no glTF file: expected `glTF` or a JSON text at its beginning")]
    NotGltf,
    /// The version of the container or of the asset is not supported.
    #[error("glTF version {0} is not supported: expected 2; export it again as glTF 2.0")]
    Version(String),
    /// The file is shorter than its lengths say.
    #[error("the file is truncated: {what} needs {needed} bytes, but {found} are there")]
    Truncated {
        /// The truncated part.
        what: &'static str,
        /// Bytes that it needs.
        needed: u64,
        /// Bytes that are present.
        found: u64,
    },
    /// The first chunk of a GLB is not the JSON text.
    #[error("the first chunk of a GLB must be JSON")]
    NoJson,
    /// The JSON text is invalid.
    #[error("the JSON text is wrong: {0}")]
    Json(String),
    /// An index is out of range.
    #[error("names {list}[{index}], but there are {count}")]
    Index {
        /// The list.
        list: &'static str,
        /// The index.
        index: u32,
        /// Length of the list.
        count: usize,
    },
    /// A byte range exceeds its container.
    #[error("needs {needed} bytes, but {within} has {found}")]
    Bounds {
        /// Bytes needed, from the beginning of `within`.
        needed: u128,
        /// The container.
        within: String,
        /// Bytes that are present.
        found: u64,
    },
    /// The file has too few bytes for a number of elements.
    #[error("{count} elements are more than a file of this size can have")]
    Count {
        /// The number.
        count: u64,
    },
    /// The meshes of the file exceed the memory limit for models.
    #[error("its meshes have more than {limit} vertices and indices together: {}", Limits::advice())]
    TooLarge {
        /// Maximum number of vertices and indices.
        limit: u64,
    },
    /// A keyword or number is not in the format.
    #[error("{what} is `{}`: expected {expected}", name(found))]
    Value {
        /// The property.
        what: &'static str,
        /// The value in the file.
        found: String,
        /// The allowed values.
        expected: &'static str,
    },
    /// A required property is missing.
    #[error("{0} is missing")]
    Missing(&'static str),
    /// A light or camera is outside of the coordinates that scenes can have.
    #[error("is too far away")]
    TooFar,
    /// A number is NaN or infinite.
    #[error("element {element} has a number that is NaN or infinite")]
    NotFinite {
        /// Its index in the accessor.
        element: u64,
    },
    /// A vertex index of a primitive is out of range.
    #[error("index {index} is out of range: there are {count} vertices")]
    Vertex {
        /// The index.
        index: u32,
        /// Number of vertices.
        count: usize,
    },
    /// A Draco stream is damaged or unsupported by glTF.
    #[error("the Draco stream cannot be used: {}", name(_0))]
    Draco(String),
    /// Two corresponding lists have different lengths.
    #[error("{what} has {found} elements: expected {expected}")]
    Length {
        /// The list.
        what: String,
        /// Its number of elements.
        found: u64,
        /// The required number.
        expected: u64,
    },
    /// The model refers to a file that may not be read.
    #[error(transparent)]
    Outside(#[from] Outside),
    /// A data URI is invalid.
    #[error("its data URI is wrong: {0}")]
    DataUri(&'static str),
    /// Another file cannot be read.
    #[error("`{}` {error}", name(file))]
    File {
        /// The file, as in the model.
        file: String,
        /// The reason.
        #[source]
        error: ReadError,
    },
    /// Compressed data is invalid.
    #[error("the compressed data is wrong: {0}")]
    Compressed(&'static str),
    /// There are no triangles.
    #[error("has no triangles")]
    NoTriangles,
    /// Points and lines alone have no surface.
    #[error("has only points or lines, which have no area")]
    OnlyLines,
    /// All triangles are points or lines.
    #[error("has no area: all of its triangles are of zero size")]
    NoArea,
    /// Nothing of the file could be read.
    #[error("nothing of it can be shown: {first}{}", more(*others))]
    NothingLeft {
        /// What was left out first, and why.
        first: String,
        /// Number of other parts that were left out.
        others: usize,
    },
    /// There is nothing of the given name.
    #[error("there is no {what} `{}`{}", name(asked), known(names))]
    Name {
        /// Kind of the missing item.
        what: &'static str,
        /// The given name.
        asked: String,
        /// The existing names.
        names: Vec<String>,
    },
    /// The triangles do not form a valid mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

fn more(others: usize) -> String {
    if others > 0 { format!("; and {others} more") } else { String::new() }
}

fn known(names: &[String]) -> String {
    const TOLD: usize = 12;
    if names.is_empty() {
        return ": the file has none".to_owned();
    }
    let list: Vec<String> = names.iter().take(TOLD).map(|each| format!("`{}`", name(each))).collect();
    let more = if names.len() > TOLD { ", …" } else { "" };
    format!(": there are {}{more}", list.join(", "))
}
