//! glTF files whose triangles are compressed with Draco.

use super::gltf_writer::Writer;
use draco_core::{
    DataType, EncoderBuffer, EncoderOptions, FaceIndex, GeometryAttributeType, Mesh as DracoMesh, MeshEncoder,
    PointAttribute, PointIndex,
};
use firstlight::mesh::{Mesh, procedural};
use firstlight::scene::model::{ImportedModel, ModelFormat, ModelOptions, load_model};
use serde_json::json;

fn attribute(kind: GeometryAttributeType, n: u8, values: &[f32]) -> PointAttribute {
    let mut attribute = PointAttribute::new();
    attribute.init(kind, n, DataType::Float32, false, values.len() / usize::from(n));
    let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
    attribute.buffer_mut().write(0, &bytes);
    attribute
}

/// The stream, and the numbers of positions, normals and texture coordinates in it.
fn encoded(mesh: &Mesh, level: i32) -> (Vec<u8>, [u32; 3]) {
    let mut draco = DracoMesh::new();
    let flat = |list: &[glam::Vec3]| list.iter().flat_map(|v| v.to_array()).collect::<Vec<f32>>();
    let uvs: Vec<f32> = mesh.positions.iter().flat_map(|p| [p.x, p.z]).collect();
    let ids = [
        (GeometryAttributeType::Position, 3, flat(&mesh.positions)),
        (GeometryAttributeType::Normal, 3, flat(&mesh.normals)),
        (GeometryAttributeType::TexCoord, 2, uvs),
    ]
    .map(|(kind, n, values)| draco.add_attribute(attribute(kind, n, &values)));
    draco.set_num_faces(mesh.triangles.len());
    for (face, triangle) in (0..).zip(&mesh.triangles) {
        draco.set_face(FaceIndex(face), triangle.map(PointIndex));
    }
    let unique = ids.map(|id| draco.attribute(id).unique_id());
    let mut options = EncoderOptions::new();
    options.set_compression_level(level);
    ids.iter().for_each(|&id| options.set_attribute_quantization(id, 16));
    let mut encoder = MeshEncoder::new();
    encoder.set_mesh(draco);
    let mut out = EncoderBuffer::new();
    encoder.encode(&options, &mut out).unwrap();
    (out.data().to_vec(), unique)
}

/// A file with two primitives of the same stream.
fn glb(stream: &[u8], [position, normal, uv]: [u32; 3]) -> Vec<u8> {
    let mut writer = Writer::default();
    let view = writer.view(stream, None);
    // What the accessors say is what a reader without the extension would need.
    let of = |kind: &str| json!({ "componentType": 5126, "count": 3, "type": kind });
    let [p, n, t] = ["VEC3", "VEC3", "VEC2"].map(|kind| writer.accessor(of(kind)));
    let indices = writer.accessor(json!({ "componentType": 5125, "count": 3, "type": "SCALAR" }));
    let primitive = json!({
        "attributes": { "POSITION": p, "NORMAL": n, "TEXCOORD_0": t }, "indices": indices, "mode": 4,
        "extensions": { "KHR_draco_mesh_compression": {
            "bufferView": view, "attributes": { "POSITION": position, "NORMAL": normal, "TEXCOORD_0": uv }
        } }
    });
    writer.json["meshes"] = json!([{ "primitives": [primitive.clone(), primitive] }]);
    writer.json["nodes"] = json!([{ "mesh": 0 }]);
    writer.json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
    writer.glb()
}

fn read(bytes: &[u8]) -> Result<ImportedModel, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    std::fs::write(&path, bytes).unwrap();
    load_model(&path, ModelFormat::Gltf, &ModelOptions::default()).map_err(|error| error.to_string())
}

/// Corners of triangles in tens of thousandths, in an order of their own.
fn corners(mesh: &Mesh) -> Vec<[i64; 8]> {
    let mut all: Vec<[i64; 8]> = (mesh.triangles.iter().flatten())
        .map(|&vertex| {
            let vertex = vertex as usize;
            let (p, n) = (mesh.positions[vertex].as_dvec3() + mesh.center, mesh.normals[vertex].as_dvec3());
            let uv = mesh.uvs[vertex].as_dvec2();
            [p.x, p.y, p.z, 0.1 * n.x, 0.1 * n.y, 0.1 * n.z, uv.x, uv.y].map(|x| (x * 500.0).round() as i64)
        })
        .collect();
    all.sort_unstable();
    all
}

fn shape() -> Mesh {
    let mut mesh = procedural::torus(1.0, 0.4, 40, 20).with_vertex_normals();
    mesh.uvs = mesh.positions.iter().map(|p| glam::Vec2::new(p.x, 1.0 - p.z)).collect();
    mesh
}

#[test]
fn compressed_triangles_are_those_that_were_written() {
    let mesh = shape();
    // Sequential, edgebreaker, and edgebreaker by valence.
    for level in [0, 3, 10] {
        let (stream, ids) = encoded(&mesh, level);
        assert!(level == 0 || stream.len() < 12 * mesh.triangles.len(), "{} bytes at level {level}", stream.len());
        let model = read(&glb(&stream, ids)).unwrap_or_else(|error| panic!("level {level}: {error}"));
        assert!(model.normals_from_file && model.mesh.triangles.len() == 2 * mesh.triangles.len());
        let (found, expected) = (corners(&model.mesh), corners(&mesh));
        // Rounding of a number that lies on the edge of a step may go either way.
        let near = |a: &[i64; 8], b: &[i64; 8]| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1);
        let far = expected.iter().filter(|corner| !found.iter().any(|other| near(corner, other))).count();
        assert_eq!(far, 0, "level {level}");
    }
}

#[test]
fn damaged_streams_are_refused_with_their_place() {
    let (stream, ids) = encoded(&shape(), 3);
    let error = read(&glb(&stream[..stream.len() / 2], ids)).err().unwrap();
    assert!(error.contains("meshes[0].primitives[0] is left out: the Draco stream cannot be used"), "{error}");
    let error = read(&glb(&stream, [ids[0], ids[1], 77])).err().unwrap();
    assert!(error.contains("it has no attribute 77"), "{error}");
    // Whatever a changed byte means, it is a mesh or an error.
    let mut state = 1_u64;
    for _ in 0..400 {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let mut bytes = stream.clone();
        let at = (state >> 33) as usize % bytes.len();
        bytes[at] = (state >> 20) as u8;
        // Most of what matters stands at the beginning.
        let front = (state >> 45) as usize % 64;
        bytes[front] ^= 1 << (state >> 8 & 7);
        if let Ok(model) = read(&glb(&bytes, ids)) {
            model.mesh.validate().unwrap();
        }
    }
}
