//! Why a glTF file could not be opened: which file, which part of it, what was expected.

use crate::mesh::MeshError;
use crate::printable::name;
use crate::scene::input_file::ReadError;
use crate::scene::limits::Limits;
use std::path::{Path, PathBuf};

/// Why a glTF file could not be opened.
#[derive(Debug, thiserror::Error)]
#[error("{}: {}{problem}", path.display(), if place.is_empty() { String::new() } else { format!("{place}: ") })]
pub struct GltfError {
    /// The file, or a file that it names.
    pub path: PathBuf,
    /// The part of it, as `accessors[3]`; empty for the file as a whole.
    pub place: String,
    /// What is wrong there.
    #[source]
    pub problem: GltfProblem,
}

impl GltfError {
    pub(super) fn at(path: &Path, (place, problem): Located) -> Self {
        Self { path: path.to_owned(), place, problem }
    }
}

/// A part of the file, and what is wrong there.
pub(in crate::scene) type Located = (String, GltfProblem);

/// `list[index]`.
pub(super) fn place(list: &str, index: impl std::fmt::Display) -> String {
    format!("{list}[{index}]")
}

/// What is wrong with a glTF file.
#[derive(Debug, thiserror::Error)]
pub enum GltfProblem {
    /// It cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The first bytes are neither those of a GLB nor JSON.
    #[error("is no glTF file: expected `glTF` or a JSON text at its beginning")]
    NotGltf,
    /// The version of the container or of the asset is another.
    #[error("glTF version {0} is not supported: expected 2; export it again as glTF 2.0")]
    Version(String),
    /// The file ends before what its lengths promise.
    #[error("the file is truncated: {what} needs {needed} bytes, but {found} are there")]
    Truncated {
        /// What is cut.
        what: &'static str,
        /// Bytes that it needs.
        needed: u64,
        /// Bytes that are there.
        found: u64,
    },
    /// The chunk of a GLB with the JSON text is not the first.
    #[error("the first chunk of a GLB must be JSON")]
    NoJson,
    /// The JSON text is not what the format asks for.
    #[error("the JSON text is wrong: {0}")]
    Json(String),
    /// An index points at nothing.
    #[error("names {list}[{index}], but there are {count}")]
    Index {
        /// The list.
        list: &'static str,
        /// The index.
        index: u32,
        /// Length of the list.
        count: usize,
    },
    /// A range of bytes does not lie within what it is part of.
    #[error("needs {needed} bytes, but {within} has {found}")]
    Bounds {
        /// Bytes from the beginning of `within` that would be needed.
        needed: u128,
        /// What it is part of.
        within: String,
        /// Bytes that are there.
        found: u64,
    },
    /// A number of elements for which the file has no bytes.
    #[error("{count} elements are more than a file of this size can have")]
    Count {
        /// The number.
        count: u64,
    },
    /// The file asks for more memory than models may.
    #[error("its meshes have more than {limit} vertices and indices together: {}", Limits::advice())]
    TooLarge {
        /// The most that is read.
        limit: u64,
    },
    /// A word or number that the format does not know.
    #[error("{what} is `{}`: expected {expected}", name(found))]
    Value {
        /// What it is.
        what: &'static str,
        /// What the file has.
        found: String,
        /// What it may be.
        expected: &'static str,
    },
    /// Something that must be there is not.
    #[error("{0} is missing")]
    Missing(&'static str),
    /// A number is NaN or infinite.
    #[error("element {element} has a number that is NaN or infinite")]
    NotFinite {
        /// Its place in the accessor.
        element: u64,
    },
    /// An index of a primitive names no vertex.
    #[error("index {index} is out of range: there are {count} vertices")]
    Vertex {
        /// The index.
        index: u32,
        /// Number of vertices.
        count: usize,
    },
    /// A stream of compressed triangles is damaged, or holds what glTF has no use for.
    #[error("the Draco stream cannot be used: {}", name(_0))]
    Draco(String),
    /// Two lists that belong together have different lengths.
    #[error("{what} has {found} elements: expected {expected}")]
    Length {
        /// What it is.
        what: String,
        /// Elements that it has.
        found: u64,
        /// Elements that it must have.
        expected: u64,
    },
    /// The nodes are no tree.
    #[error("is named as a child more than once, or is its own descendant: the nodes must be trees")]
    NotTree,
    /// A file that the model names may not be read.
    #[error(
        "`{}` is {why}: only files in the folder of the model and below are read; \
         --allow-outside reads others on this computer as well, never the network",
        name(uri)
    )]
    Outside {
        /// What the file says.
        uri: String,
        /// In what way it is outside.
        why: &'static str,
    },
    /// A data URI that is none.
    #[error("its data URI is wrong: {0}")]
    DataUri(&'static str),
    /// Another file cannot be read.
    #[error("`{}` {error}", name(file))]
    File {
        /// The file, as the model names it.
        file: String,
        /// Why.
        #[source]
        error: ReadError,
    },
    /// An extension without which the file has no meaning.
    #[error("needs the extension `{}`, which is not supported: {advice}", name(extension))]
    Extension {
        /// Its name.
        extension: String,
        /// What to do.
        advice: &'static str,
    },
    /// Compressed bytes that do not decode.
    #[error("the compressed data is wrong: {0}")]
    Compressed(&'static str),
    /// The file has nothing with area.
    #[error("has no triangles")]
    NoTriangles,
    /// What was asked for by name is not there.
    #[error("there is no {what} `{}`{}", name(asked), known(names))]
    Name {
        /// What kind of thing.
        what: &'static str,
        /// The name that was asked for.
        asked: String,
        /// Those that are there.
        names: Vec<String>,
    },
    /// The triangles are no mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
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
