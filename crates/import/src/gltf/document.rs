//! A glTF file with its data: JSON text, buffers, and views into them.
//!
//! Reading opens only the file and those of its buffers that views refer to; meshes, materials and nodes are read on
//! request, by the modules beside this one. Broken parts are left out ([`crate::gltf::omissions`]). Start reading at
//! [`Document::read`].

use crate::error::gltf::{GltfError, GltfProblem, Located, item, place};
use crate::gltf::container::chunks;
use crate::gltf::json::{BufferView, Root, first_equal_images};
use crate::gltf::lenient;
use crate::gltf::meshopt;
use crate::gltf::omissions::Omissions;
use crate::gltf::uri::{Uri, resolve};
use firstlight_files::input_file::{FileKind, InputFile};
use firstlight_files::limits::Limits;
use firstlight_files::reference::{References, Referred};
use firstlight_files::relative::path_to_text;
use std::collections::HashMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

/// Extensions that are supported, or that change nothing that is shown.
pub(crate) const SUPPORTED: &[&str] = &[
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
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_node_visibility",
    "KHR_texture_basisu",
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
pub(crate) struct Bytes {
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
    pub(crate) path: PathBuf,
    pub(crate) options: ReadOptions,
    pub(crate) root: Root,
    /// What is left out of it.
    pub(crate) omissions: Omissions,
    /// `None` for those that nothing reads, and those that cannot be read.
    buffers: Vec<Option<Bytes>>,
    /// Decompressed views, by index.
    pub(crate) decoded: HashMap<u32, Vec<u8>>,
    /// For each image the first one with the same bytes.
    pub(crate) first_equal_image: Vec<u32>,
    /// For each material the texture coordinates that its textures use, once something needs them.
    pub(crate) uv_sets: Vec<OnceLock<[bool; 2]>>,
    /// Total size of the buffers, bytes.
    n_bytes: u64,
    /// The file and the files of its buffers.
    pub(crate) files: Vec<PathBuf>,
    /// Where its URIs lead.
    references: References,
}

impl Document {
    /// Reads a file and its buffers.
    ///
    /// # Errors
    /// If it is not a glTF 2.0 file.
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
        let (root, omitted) = lenient::parse(trimmed(&bytes[found.json])).map_err(whole)?;
        let version = root.asset.min_version.as_ref().unwrap_or(&root.asset.version);
        if !version.is_empty() && !version.starts_with("2.") && version != "2" {
            return Err(GltfError::at(path, ("asset".to_owned(), GltfProblem::Version(version.clone()))));
        }
        let binary = found.binary.map(|range| Bytes { data: Arc::new(bytes), range });
        let first_equal_image = first_equal_images(&root);
        let uv_sets = vec![OnceLock::new(); root.materials.len()];
        let mut document = Self {
            first_equal_image,
            uv_sets,
            path: path.to_owned(),
            options,
            root,
            omissions: Omissions::default(),
            buffers: Vec::new(),
            decoded: HashMap::new(),
            n_bytes: 0,
            files: vec![path.to_owned()],
            references: References::of(path, options.allow_outside),
        };
        for (part, problem) in omitted {
            document.omissions.kept::<()>(&part, Err(problem));
        }
        for name in document.root.extensions_required.iter().filter(|name| !SUPPORTED.contains(&name.as_str())) {
            let sentence = format!(
                "needs the extension `{}`, which is not modelled: what depends on it is wrong or missing",
                firstlight_files::printable::name(name)
            );
            document.omissions.tell(name, sentence);
        }
        document.read_buffers(binary);
        document.decode();
        document.decode_draco();
        Ok(document)
    }

    /// Whether the file says that it is wrong without this extension.
    pub(crate) fn requires(&self, extension: &str) -> bool {
        self.root.extensions_required.iter().any(|name| name == extension)
    }

    /// The file that was read.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// All files that were read: the file itself, then those of its buffers.
    pub fn files(&self) -> &[PathBuf] {
        &self.files
    }

    pub(crate) fn error(&self, located: Located) -> GltfError {
        GltfError::at(&self.path, located)
    }

    /// Maximum number of elements of an accessor without a view: real vertices have data in some buffer.
    pub(crate) fn most_elements(&self) -> u64 {
        const ALWAYS: u64 = 1 << 20;
        let decoded: u64 = self.decoded.values().map(|bytes| bytes.len() as u64).sum();
        (self.n_bytes + decoded).max(ALWAYS.min(self.most_numbers()))
    }

    /// Maximum number of vertices and indices of all meshes with their instances.
    pub(crate) fn most_numbers(&self) -> u64 {
        const BYTES_A_NUMBER: u64 = 8;
        self.options.max_bytes / BYTES_A_NUMBER
    }

    /// Maximum number of vertices and indices of all meshes, which take their space in memory: a few bytes could refer
    /// to the same data many times.
    pub(crate) fn most_own_numbers(&self) -> u64 {
        /// Several for each byte, since skins share meshes and primitives share attributes.
        const A_BYTE: u64 = 8;
        const ALWAYS: u64 = 1 << 22;
        let decoded: u64 = self.decoded.values().map(|bytes| bytes.len() as u64).sum();
        (ALWAYS + A_BYTE * self.n_bytes + decoded).min(self.most_numbers())
    }

    /// Number of bytes of all buffers that were read.
    pub(crate) fn n_bytes(&self) -> u64 {
        self.n_bytes
    }

    /// Maximum number of bytes of all compressed streams.
    pub(crate) fn most_decoded(&self) -> u64 {
        Limits::most_unpacked(self.n_bytes).min(self.options.max_bytes)
    }

    /// Reads the buffers that views refer to.
    fn read_buffers(&mut self, binary: Option<Bytes>) {
        let mut is_read = vec![false; self.root.buffers.len()];
        for view in &self.root.buffer_views {
            // The buffer of a compressed view may have no bytes: it stands for the decompressed ones.
            let buffer = match meshopt::of_view(&view.extensions) {
                Some(Ok(compressed)) => compressed.buffer,
                _ => view.buffer,
            };
            if let Some(is_read) = is_read.get_mut(buffer as usize) {
                *is_read = true;
            }
        }
        let mut room = self.options.max_bytes;
        for (i, is_read) in is_read.into_iter().enumerate() {
            let bytes = is_read.then(|| self.read_buffer(i, binary.as_ref(), &mut room));
            let bytes = bytes.and_then(|read| {
                let part = place("buffers", i);
                self.omissions.kept(&part, read.map_err(|problem| (part.clone(), problem)))
            });
            self.n_bytes += bytes.as_ref().map_or(0, |bytes| bytes.get().len() as u64);
            self.buffers.push(bytes);
        }
    }

    /// - `room`: bytes that may still be read.
    fn read_buffer(&mut self, i: usize, binary: Option<&Bytes>, room: &mut u64) -> Result<Bytes, GltfProblem> {
        let buffer = &self.root.buffers[i];
        let needed = buffer.byte_length;
        let (mut bytes, within) = match (&buffer.uri, binary) {
            (Some(uri), _) => {
                let (data, file) = self.read_uri(uri, &place("buffers", i), *room)?;
                let within = if file.is_some() { "its file" } else { "its data URI" };
                self.files.extend(file);
                let length = data.len();
                *room = room.saturating_sub(length as u64);
                (Bytes { data: Arc::new(data), range: 0..length }, within)
            }
            (None, Some(bytes)) if i == 0 => (bytes.clone(), "the BIN chunk"),
            (None, _) => return Err(GltfProblem::Missing("the uri of the buffer, or the BIN chunk of a GLB,")),
        };
        let found = bytes.get().len() as u64;
        if found < needed {
            let part = place("buffers", i);
            let sentence = format!("{part} has {needed} bytes, but {within} ends after {found}: the rest is missing");
            self.omissions.tell(&part, sentence);
        }
        bytes.range.end = bytes.range.start + needed.min(found) as usize;
        Ok(bytes)
    }

    /// The bytes of a URI, and the file that they were read from, if any.
    fn read_uri(&self, uri: &str, part: &str, room: u64) -> Result<(Vec<u8>, Option<PathBuf>), GltfProblem> {
        match self.resolved(uri, part)? {
            Uri::Data(data) => Ok((data, None)),
            Uri::File(Referred { path, .. }) => {
                let full = self.folder().join(&path);
                let read = InputFile::open_within(&full, FileKind::Model, room).and_then(InputFile::bytes);
                let data = read.map_err(|error| GltfProblem::File { file: path_to_text(&path), error })?;
                Ok((data, Some(full)))
            }
        }
    }

    /// What a URI means.
    ///
    /// - `part`: the part that has it.
    ///
    /// # Errors
    /// If it may not be read, or is no URI.
    pub(crate) fn resolved(&self, uri: &str, part: &str) -> Result<Uri, GltfProblem> {
        let resolved = resolve(uri, &self.references, self.folder())?;
        if let Uri::File(file) = &resolved
            && let Some(difference) = file.difference(uri)
        {
            self.omissions.tell(&format!("{part}.uri"), format!("{part}: {difference}"));
        }
        Ok(resolved)
    }

    /// The folder of the model.
    pub(crate) fn folder(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new(""))
    }

    /// Decompresses the compressed views. The bytes of those that are damaged may be in a buffer as well.
    fn decode(&mut self) {
        let mut room = self.most_decoded();
        for (i, view) in self.root.buffer_views.iter().enumerate() {
            let Some(compressed) = meshopt::of_view(&view.extensions) else { continue };
            let decode = |compressed: meshopt::MeshoptView| {
                let inner = BufferView {
                    buffer: compressed.buffer,
                    byte_offset: compressed.byte_offset,
                    byte_length: compressed.byte_length,
                    ..BufferView::default()
                };
                meshopt::decode(&compressed, self.slice(&inner)?, room)
            };
            let part = place("bufferViews", i);
            let decoded = compressed.and_then(decode).map_err(|problem| (part.clone(), problem));
            if let Some(decoded) = self.omissions.kept(&part, decoded) {
                room -= decoded.len() as u64;
                self.decoded.insert(i as u32, decoded);
            }
        }
    }

    /// The bytes of a view, and its stride if it has one.
    pub(crate) fn view(&self, index: u32) -> Result<(&[u8], Option<u64>), Located> {
        let here = |problem| (place("bufferViews", index), problem);
        let view = item(&self.root.buffer_views, "bufferViews", index).map_err(here)?;
        let bytes = match self.decoded.get(&index) {
            Some(bytes) => bytes,
            None => self.slice(view).map_err(here)?,
        };
        // Some programs write 0 where they mean that elements follow each other.
        Ok((bytes, view.byte_stride.filter(|&stride| stride > 0)))
    }

    fn slice(&self, view: &BufferView) -> Result<&[u8], GltfProblem> {
        let buffer = item(&self.buffers, "buffers", view.buffer)?;
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
