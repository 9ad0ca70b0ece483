//! A glTF file with its data: JSON text, buffers, and views into them.
//!
//! Reading opens only the file and its buffers; meshes, materials and nodes are read on request, by the modules beside
//! this one. Start reading at [`Document::read`].

use super::container::chunks;
use super::error::{GltfError, GltfProblem, Located, place};
use super::json::{BufferView, Root};
use super::meshopt;
use super::uri::{Uri, resolve};
use crate::scene::input_file::{FileKind, InputFile};
use crate::scene::limits::Limits;
use crate::scene::relative::path_to_text;
use serde::Deserialize;
use std::collections::HashMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Extensions that are supported, or that may be ignored even if the file requires them.
pub(super) const SUPPORTED: &[&str] = &[
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    "KHR_xmp_json_ld",
];

/// Options for reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReadOptions {
    /// Whether local files outside of the model's folder may be read.
    pub allow_outside: bool,
    /// Maximum total size of the file and all of its buffers, bytes.
    pub max_bytes: u64,
}

impl Default for ReadOptions {
    fn default() -> Self {
        Self { allow_outside: false, max_bytes: Limits::of_this_process().model_bytes }
    }
}

/// A range of shared bytes.
#[derive(Clone, Debug)]
pub(super) struct Bytes {
    data: Arc<Vec<u8>>,
    range: Range<usize>,
}

impl Bytes {
    fn get(&self) -> &[u8] {
        &self.data[self.range.clone()]
    }
}

/// A glTF file.
#[derive(Debug)]
pub struct Document {
    pub(super) path: PathBuf,
    pub(super) options: ReadOptions,
    pub(super) root: Root,
    /// `None` for the fallback buffer of a compression extension, which has no bytes.
    buffers: Vec<Option<Bytes>>,
    /// Decompressed views, by index.
    pub(super) decoded: HashMap<u32, Vec<u8>>,
    /// Total size of the buffers, bytes.
    n_bytes: u64,
    /// The file and the files of its buffers.
    pub(super) files: Vec<PathBuf>,
}

impl Document {
    /// Reads a file and its buffers.
    ///
    /// # Errors
    /// If it is not a glTF 2.0 file, or one of its buffers cannot be read.
    pub fn read(path: &Path, options: ReadOptions) -> Result<Self, GltfError> {
        let bytes = InputFile::open_within(path, FileKind::Model, options.max_bytes).and_then(InputFile::bytes);
        let bytes = bytes.map_err(|error| GltfError::at(path, (String::new(), error.into())))?;
        Self::of_bytes(path, bytes, options)
    }

    /// Like [`Self::read`], from bytes in memory; `path`: where they would be stored.
    ///
    /// # Errors
    /// Like [`Self::read`].
    pub fn of_bytes(path: &Path, bytes: Vec<u8>, options: ReadOptions) -> Result<Self, GltfError> {
        let whole = |problem: GltfProblem| GltfError::at(path, (String::new(), problem));
        let found = chunks(&bytes).map_err(whole)?;
        let root: Root = serde_json::from_slice(trimmed(&bytes[found.json]))
            .map_err(|error| whole(GltfProblem::Json(error.to_string())))?;
        let version = root.asset.min_version.as_ref().unwrap_or(&root.asset.version);
        if !version.starts_with("2.") && version != "2" {
            return Err(GltfError::at(path, ("asset".to_owned(), GltfProblem::Version(version.clone()))));
        }
        for extension in &root.extensions_required {
            if !SUPPORTED.contains(&extension.as_str()) {
                let problem = GltfProblem::Extension { extension: extension.clone(), advice: advice_for(extension) };
                return Err(GltfError::at(path, ("extensionsRequired".to_owned(), problem)));
            }
        }
        let binary = found.binary.map(|range| Bytes { data: Arc::new(bytes), range });
        let mut document = Self {
            path: path.to_owned(),
            options,
            root,
            buffers: Vec::new(),
            decoded: HashMap::new(),
            n_bytes: 0,
            files: vec![path.to_owned()],
        };
        let read = document.read_buffers(binary).and_then(|()| document.decode());
        read.and_then(|()| document.decode_draco()).map_err(|located| document.error(located))?;
        Ok(document)
    }

    /// The file that was read.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// All files that were read: the file itself, then those of its buffers.
    pub fn files(&self) -> &[PathBuf] {
        &self.files
    }

    pub(in crate::scene) fn error(&self, located: Located) -> GltfError {
        GltfError::at(&self.path, located)
    }

    /// Maximum number of elements of an accessor without a view: real vertices have data in some buffer.
    pub(super) fn most_elements(&self) -> u64 {
        const ALWAYS: u64 = 1 << 20;
        let decoded: u64 = self.decoded.values().map(|bytes| bytes.len() as u64).sum();
        (self.n_bytes + decoded).max(ALWAYS.min(self.most_numbers()))
    }

    /// Maximum number of vertices and indices of all meshes: a few bytes could refer to the same data many times.
    pub(in crate::scene) fn most_numbers(&self) -> u64 {
        const BYTES_A_NUMBER: u64 = 8;
        self.options.max_bytes / BYTES_A_NUMBER
    }

    fn read_buffers(&mut self, binary: Option<Bytes>) -> Result<(), Located> {
        let mut room = self.options.max_bytes;
        for i in 0..self.root.buffers.len() {
            let buffer = &self.root.buffers[i];
            let here = |problem| (place("buffers", i), problem);
            let needed = buffer.byte_length;
            let bytes = match &buffer.uri {
                Some(uri) => {
                    let data = self.read_uri(uri, room).map_err(here)?;
                    let (data, found) = match data {
                        (data, None) => (data, "its data URI"),
                        (data, Some(path)) => {
                            self.files.push(path);
                            (data, "its file")
                        }
                    };
                    let length = data.len();
                    room = room.saturating_sub(length as u64);
                    Some((Bytes { data: Arc::new(data), range: 0..length }, found))
                }
                None if i == 0 && binary.is_some() => binary.clone().map(|bytes| (bytes, "the BIN chunk")),
                None if buffer.extensions.contains_key(meshopt::NAME) => None,
                None => return Err(here(GltfProblem::Missing("the uri of the buffer, or the BIN chunk of a GLB,"))),
            };
            let bytes = match bytes {
                None => None,
                Some((mut bytes, within)) => {
                    let found = bytes.get().len() as u64;
                    if found < needed {
                        let within = within.to_owned();
                        return Err(here(GltfProblem::Bounds { needed: u128::from(needed), within, found }));
                    }
                    bytes.range.end = bytes.range.start + needed as usize;
                    self.n_bytes += needed;
                    Some(bytes)
                }
            };
            self.buffers.push(bytes);
        }
        Ok(())
    }

    /// The bytes of a URI, and the file that they were read from, if any.
    fn read_uri(&self, uri: &str, room: u64) -> Result<(Vec<u8>, Option<PathBuf>), GltfProblem> {
        match resolve(uri, self.folder(), self.options.allow_outside)? {
            Uri::Data(data) => Ok((data, None)),
            Uri::File(path) => {
                let full = self.folder().join(&path);
                let read = InputFile::open_within(&full, FileKind::Model, room).and_then(InputFile::bytes);
                let data = read.map_err(|error| GltfProblem::File { file: path_to_text(&path), error })?;
                Ok((data, Some(full)))
            }
        }
    }

    /// The folder of the model.
    pub(super) fn folder(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new(""))
    }

    /// Decompresses the compressed views.
    fn decode(&mut self) -> Result<(), Located> {
        for i in 0..self.root.buffer_views.len() {
            let view = &self.root.buffer_views[i];
            let Some(extension) = view.extensions.get(meshopt::NAME) else { continue };
            let here = |problem| (place("bufferViews", i), problem);
            let wrong = |error: serde_json::Error| here(GltfProblem::Json(format!("{}: {error}", meshopt::NAME)));
            let compressed = meshopt::View::deserialize(extension).map_err(wrong)?;
            let inner = BufferView {
                buffer: compressed.buffer,
                byte_offset: compressed.byte_offset,
                byte_length: compressed.byte_length,
                ..BufferView::default()
            };
            let decoded = self.slice(&inner).and_then(|bytes| meshopt::decode(&compressed, bytes)).map_err(here)?;
            self.decoded.insert(i as u32, decoded);
        }
        Ok(())
    }

    /// The bytes of a view, and its stride if it has one.
    pub(super) fn view(&self, index: u32) -> Result<(&[u8], Option<u64>), Located> {
        let here = |problem| (place("bufferViews", index), problem);
        let view = self.root.buffer_views.get(index as usize);
        let count = self.root.buffer_views.len();
        let view = view.ok_or_else(|| here(GltfProblem::Index { list: "bufferViews", index, count }))?;
        let bytes = match self.decoded.get(&index) {
            Some(bytes) => bytes,
            None => self.slice(view).map_err(here)?,
        };
        Ok((bytes, view.byte_stride))
    }

    fn slice(&self, view: &BufferView) -> Result<&[u8], GltfProblem> {
        let count = self.buffers.len();
        let buffer = self.buffers.get(view.buffer as usize);
        let buffer = buffer.ok_or(GltfProblem::Index { list: "buffers", index: view.buffer, count })?;
        let buffer = buffer.as_ref().ok_or(GltfProblem::Missing("the data of its buffer"))?.get();
        let needed = u128::from(view.byte_offset) + u128::from(view.byte_length);
        if needed > buffer.len() as u128 {
            let within = place("buffers", view.buffer);
            return Err(GltfProblem::Bounds { needed, within, found: buffer.len() as u64 });
        }
        Ok(&buffer[view.byte_offset as usize..needed as usize])
    }
}

/// Removes the byte order mark and the zero padding that some exporters write.
fn trimmed(json: &[u8]) -> &[u8] {
    let mut json = json.strip_prefix("\u{feff}".as_bytes()).unwrap_or(json);
    while let Some(rest) = json.strip_suffix(b"\0") {
        json = rest;
    }
    json
}

fn advice_for(extension: &str) -> &'static str {
    match extension {
        "KHR_texture_basisu" => "export the file again with PNG, JPEG or WebP textures",
        _ => "export the file again without it",
    }
}
