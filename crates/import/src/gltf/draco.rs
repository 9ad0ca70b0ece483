//! `KHR_draco_mesh_compression`: the triangles and attributes of a primitive as one compressed stream.
//!
//! Streams are decoded while the file is read. The result is stored as new views and accessors, which replace those of
//! the primitive, so that no other code handles the compression. The crate `draco-core` decodes the streams within a
//! memory limit.

use crate::error::gltf::{GltfProblem, Located, place};
use crate::gltf::document::Document;
use crate::gltf::json::{Accessor, BufferView};
use draco_core::{DataType, DecodeLimits, DecoderBuffer, Mesh, MeshDecoder, PointAttribute, PointIndex};
use rayon::prelude::*;
use serde::Deserialize;
use std::collections::{BTreeMap, HashMap};

pub(crate) const NAME: &str = "KHR_draco_mesh_compression";

/// The extension object of a primitive.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Stream {
    buffer_view: u32,
    /// Id of each attribute in the stream.
    attributes: BTreeMap<String, u32>,
}

/// Packed values in the format of an accessor.
struct Values {
    component_type: u32,
    kind: &'static str,
    count: u64,
    bytes: Vec<u8>,
}

/// The contents of a stream, and what was made of them.
struct Decoded {
    mesh: Mesh,
    /// Accessor of the indices.
    indices: Option<u32>,
    /// Accessor of each attribute, by its id.
    accessors: HashMap<u32, u32>,
}

/// Bytes of the indices of a triangle.
const FACE: u64 = 12;

/// Bytes of streams that are decoded, per byte of the file.
const MOST_READ: u64 = 4;

impl Decoded {
    /// Bytes of the indices and of four numbers per point, as positions with an attribute have.
    fn n_bytes(&self) -> u64 {
        FACE * self.mesh.num_faces() as u64 + 16 * self.mesh.num_points() as u64
    }
}

impl Document {
    /// Decodes all streams and makes their primitives refer to the results; primitives of one stream share them. A
    /// primitive whose stream is damaged keeps its own accessors if it has some with data, else it loses its attributes.
    pub(crate) fn decode_draco(&mut self) {
        let mut streams: Vec<(u32, String)> = Vec::new();
        let mut known: HashMap<u32, usize> = HashMap::new();
        let mut users = Vec::new();
        for (mesh, json) in self.root.meshes.iter_mut().enumerate() {
            for (primitive, json) in json.primitives.iter_mut().enumerate() {
                let Some(extension) = json.extensions.remove(NAME) else { continue };
                let stream = Stream::deserialize(extension)
                    .map_err(|error| (at(mesh, primitive), GltfProblem::Json(format!("{NAME}: {error}"))));
                let use_of = stream.map(|stream| {
                    let number = *known.entry(stream.buffer_view).or_insert_with(|| {
                        streams.push((stream.buffer_view, at(mesh, primitive)));
                        streams.len() - 1
                    });
                    (number, stream.attributes)
                });
                users.push((mesh, primitive, use_of));
            }
        }
        let mut decoded: Vec<Result<Decoded, Option<Located>>> =
            self.decode_streams(&streams).into_iter().map(|decoded| decoded.map_err(Some)).collect();
        for (mesh, primitive, use_of) in users {
            let found = use_of.and_then(|(number, attributes)| match &mut decoded[number] {
                Ok(decoded) => {
                    self.accessors_of(decoded, &attributes).map_err(|problem| (at(mesh, primitive), problem))
                }
                Err(first) => Err(first.take().unwrap_or_else(|| {
                    let first = &streams[number].1;
                    (at(mesh, primitive), GltfProblem::Draco(format!("it is the stream of {first}, which is left out")))
                })),
            });
            let Some((indices, attributes)) = self.omissions.kept(&at(mesh, primitive), found) else {
                let json = &self.root.meshes[mesh].primitives[primitive];
                let position = json.attributes.get("POSITION").and_then(|&i| self.root.accessors.get(i as usize));
                if position.is_none_or(|position| position.buffer_view.is_none()) {
                    self.root.meshes[mesh].primitives[primitive].attributes.clear();
                }
                continue;
            };
            let mut named = self.root.meshes[mesh].primitives[primitive].attributes.clone();
            for (name, accessor) in attributes {
                let written = named.get(&name).and_then(|&written| self.root.accessors.get(written as usize));
                let normalized = written.is_some_and(|written| written.normalized);
                let accessor = if normalized { self.normalized(accessor) } else { accessor };
                named.insert(name, accessor);
            }
            let primitive = &mut self.root.meshes[mesh].primitives[primitive];
            (primitive.attributes, primitive.indices, primitive.mode) = (named, Some(indices), None);
        }
    }

    /// Decodes streams, given by their views and first primitives, a few at a time: together they have a limit, and none
    /// is kept beyond it.
    fn decode_streams(&self, streams: &[(u32, String)]) -> Vec<Result<Decoded, Located>> {
        let most = self.most_decoded();
        let (mut room, mut all) = (most, Vec::with_capacity(streams.len()));
        // Views may overlap: damaged ones must not take time without end.
        let mut unread = MOST_READ * self.n_bytes();
        for some in streams.chunks(2 * rayon::current_num_threads()) {
            let decode = |(view, part): &(u32, String)| {
                let bytes = self.view(*view)?.0;
                if bytes.len() as u64 > unread {
                    return Err((part.clone(), too_long(most)));
                }
                decoded(bytes, room).map_err(|problem| (part.clone(), problem))
            };
            let found: Vec<_> = some.par_iter().map(decode).collect();
            for (decoded, (view, part)) in found.into_iter().zip(some) {
                unread = unread.saturating_sub(self.view(*view).map_or(0, |(bytes, _)| bytes.len() as u64));
                all.push(decoded.and_then(|decoded| {
                    room = room.checked_sub(decoded.n_bytes()).ok_or_else(|| (part.clone(), too_long(most)))?;
                    Ok(decoded)
                }));
            }
        }
        all
    }

    /// The accessors of the indices and of these attributes of a stream, which are added on first use.
    fn accessors_of(
        &mut self,
        decoded: &mut Decoded,
        attributes: &BTreeMap<String, u32>,
    ) -> Result<(u32, Vec<(String, u32)>), GltfProblem> {
        let mut found = Vec::with_capacity(attributes.len());
        for (name, &id) in attributes {
            let accessor = match decoded.accessors.get(&id) {
                Some(&accessor) => accessor,
                None => {
                    let attribute = decoded.mesh.attribute_by_unique_id(id);
                    let attribute = attribute.ok_or_else(|| GltfProblem::Draco(format!("it has no attribute {id}")))?;
                    let accessor = self.add(values(attribute, decoded.mesh.num_points())?);
                    decoded.accessors.insert(id, accessor);
                    accessor
                }
            };
            found.push((name.clone(), accessor));
        }
        let indices = match decoded.indices {
            Some(accessor) => accessor,
            None => *decoded.indices.insert(self.add(indices(&decoded.mesh))),
        };
        Ok((indices, found))
    }

    /// The same accessor, normalized.
    fn normalized(&mut self, accessor: u32) -> u32 {
        let accessor = Accessor { normalized: true, ..self.root.accessors[accessor as usize].clone() };
        self.root.accessors.push(accessor);
        self.root.accessors.len() as u32 - 1
    }

    /// Adds a view and an accessor for the values; returns the index of the accessor.
    fn add(&mut self, values: Values) -> u32 {
        let Values { component_type, kind, count, bytes } = values;
        let view = self.root.buffer_views.len() as u32;
        self.root.buffer_views.push(BufferView { byte_length: bytes.len() as u64, ..BufferView::default() });
        self.decoded.insert(view, bytes);
        let kind = kind.to_owned();
        let buffer_view = Some(view);
        self.root.accessors.push(Accessor { buffer_view, component_type, count, kind, ..Accessor::default() });
        self.root.accessors.len() as u32 - 1
    }
}

fn at(mesh: usize, primitive: usize) -> String {
    format!("{}.{}", place("meshes", mesh), place("primitives", primitive))
}

fn too_long(most: u64) -> GltfProblem {
    GltfProblem::Draco(format!("all streams together have more than {most} bytes"))
}

/// - `most_bytes`: maximum size of the decoded attributes.
fn decoded(bytes: &[u8], most_bytes: u64) -> Result<Decoded, GltfProblem> {
    let limits = DecodeLimits::default()
        .with_max_points(u64::from(u32::MAX))
        .with_max_faces(most_bytes / FACE)
        .with_max_decoded_bytes(most_bytes);
    let mut mesh = Mesh::new();
    let mut buffer = DecoderBuffer::new(bytes).with_limits(limits);
    MeshDecoder::new().decode(&mut buffer, &mut mesh).map_err(|error| GltfProblem::Draco(error.to_string()))?;
    Ok(Decoded { mesh, indices: None, accessors: HashMap::new() })
}

/// Three indices per triangle.
fn indices(mesh: &Mesh) -> Values {
    Values {
        component_type: 5125,
        kind: "SCALAR",
        count: 3 * mesh.num_faces() as u64,
        bytes: mesh.faces().iter().flatten().flat_map(|point| point.0.to_le_bytes()).collect(),
    }
}

/// One element per point.
fn values(attribute: &PointAttribute, n_points: usize) -> Result<Values, GltfProblem> {
    let component_type = match attribute.data_type() {
        DataType::Int8 => 5120,
        DataType::Uint8 => 5121,
        DataType::Int16 => 5122,
        DataType::Uint16 => 5123,
        DataType::Uint32 => 5125,
        DataType::Float32 => 5126,
        other => return Err(GltfProblem::Draco(format!("an attribute has numbers of the type {other:?}"))),
    };
    let n = attribute.num_components();
    let kind = match n {
        1 => "SCALAR",
        2 => "VEC2",
        3 => "VEC3",
        4 => "VEC4",
        n => return Err(GltfProblem::Draco(format!("an attribute has {n} numbers a vertex"))),
    };
    let (stride, width) = (attribute.byte_stride() as usize, usize::from(n) * attribute.data_type().byte_length());
    let data = attribute.buffer().data();
    let mut bytes = Vec::with_capacity(n_points * width);
    for point in 0..n_points as u32 {
        let start = (attribute.mapped_index(PointIndex(point)).0 as usize).checked_mul(stride);
        let value = start.and_then(|start| data.get(start..start.checked_add(width)?));
        bytes.extend(value.ok_or_else(|| GltfProblem::Draco(format!("vertex {point} has no value")))?);
    }
    Ok(Values { component_type, kind, count: n_points as u64, bytes })
}
