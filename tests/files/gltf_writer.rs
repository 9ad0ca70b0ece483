//! Writes small glTF files for tests.

use serde_json::{Value, json};

/// A file to be: its JSON text, and the bytes of its buffer.
pub struct Writer {
    pub json: Value,
    pub bytes: Vec<u8>,
}

impl Default for Writer {
    fn default() -> Self {
        let json =
            json!({ "asset": { "version": "2.0" }, "accessors": [], "bufferViews": [], "nodes": [], "meshes": [] });
        Self { json, bytes: Vec::new() }
    }
}

fn list<'a>(json: &'a mut Value, name: &str) -> &'a mut Vec<Value> {
    json[name].as_array_mut().unwrap()
}

impl Writer {
    pub fn view(&mut self, bytes: &[u8], stride: Option<usize>) -> usize {
        let mut view = json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() });
        if let Some(stride) = stride {
            view["byteStride"] = json!(stride);
        }
        self.bytes.extend_from_slice(bytes);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        list(&mut self.json, "bufferViews").push(view);
        list(&mut self.json, "bufferViews").len() - 1
    }

    pub fn accessor(&mut self, accessor: Value) -> usize {
        list(&mut self.json, "accessors").push(accessor);
        list(&mut self.json, "accessors").len() - 1
    }

    pub fn floats(&mut self, kind: &str, numbers: &[f32]) -> usize {
        let each = match kind {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 16,
        };
        let view = self.view(&f32s(numbers), None);
        let count = numbers.len() / each;
        self.accessor(json!({ "bufferView": view, "componentType": 5126, "count": count, "type": kind }))
    }

    pub fn indices(&mut self, component: u32, indices: &[u32]) -> usize {
        let size = [1, 0, 2, 0, 4][component as usize - 5121];
        let bytes: Vec<u8> = indices.iter().flat_map(|index| index.to_le_bytes()[..size].to_vec()).collect();
        let view = self.view(&bytes, None);
        let count = indices.len();
        self.accessor(json!({ "bufferView": view, "componentType": component, "count": count, "type": "SCALAR" }))
    }

    /// Adds a mesh of one primitive and a node that has it.
    pub fn mesh(&mut self, primitive: Value) {
        list(&mut self.json, "meshes").push(json!({ "primitives": [primitive] }));
        let mesh = list(&mut self.json, "meshes").len() - 1;
        list(&mut self.json, "nodes").push(json!({ "mesh": mesh }));
    }

    /// The JSON text with its buffer, which has no uri yet.
    pub fn document(&self) -> Value {
        let mut json = self.json.clone();
        if json.get("buffers").is_none() {
            json["buffers"] = json!([{ "byteLength": self.bytes.len() }]);
        }
        json
    }

    pub fn glb(&self) -> Vec<u8> {
        let mut text = serde_json::to_vec(&self.document()).unwrap();
        text.resize(text.len().next_multiple_of(4), b' ');
        let total = 12 + 8 + text.len() + 8 + self.bytes.len();
        let word = |number: usize| (number as u32).to_le_bytes();
        [
            b"glTF",
            &word(2)[..],
            &word(total),
            &word(text.len()),
            b"JSON",
            &text,
            &word(self.bytes.len()),
            b"BIN\0",
            &self.bytes,
        ]
        .concat()
    }
}

pub fn f32s(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}

/// Adds a unit square in the plane z = 0 that faces +z, without normals.
pub fn quad(writer: &mut Writer) -> &mut Writer {
    let position = writer.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0]);
    let indices = writer.indices(5123, &[0, 1, 2, 0, 2, 3]);
    // Some tests lie about the buffer.
    writer.mesh(json!({ "attributes": { "POSITION": position }, "indices": indices }));
    writer
}

/// A square whose upper corners follow a joint, and that has a morph target; both are animated from 0 to 2 seconds.
pub fn animated() -> Writer {
    let mut writer = Writer::default();
    quad(&mut writer);
    let joints = writer.view(&[[0, 0, 0, 0], [0, 0, 0, 0], [1, 0, 0, 0], [1, 0, 0, 0]].concat(), None);
    let joints = writer.accessor(json!({ "bufferView": joints, "componentType": 5121, "count": 4, "type": "VEC4" }));
    let weights = writer.floats("VEC4", &[[1.0, 0.0, 0.0, 0.0]; 4].concat());
    let target = writer.floats("VEC3", &[0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let primitive = &mut writer.json["meshes"][0]["primitives"][0];
    primitive["targets"] = json!([{ "POSITION": target }]);
    let morphed = writer.json["meshes"][0].clone();
    let mut skinned = morphed.clone();
    skinned["primitives"][0]["attributes"]["JOINTS_0"] = json!(joints);
    skinned["primitives"][0]["attributes"]["WEIGHTS_0"] = json!(weights);
    writer.json["meshes"] = json!([morphed, skinned]);
    // The joint stands at (0, 1, 0) when the skin is bound.
    let mut inverse = [0.0_f32; 32];
    for i in [0, 5, 10, 15] {
        (inverse[i], inverse[16 + i]) = (1.0, 1.0);
    }
    inverse[16 + 13] = -1.0;
    let inverse = writer.floats("MAT4", &inverse);
    writer.json["skins"] = json!([{ "joints": [2, 3], "inverseBindMatrices": inverse }]);
    writer.json["nodes"] = json!([
        { "name": "morphed", "mesh": 0, "weights": [0.25] },
        { "name": "skinned", "mesh": 1, "skin": 0, "translation": [100, 0, 0] },
        { "name": "root", "children": [3] },
        { "name": "upper", "translation": [0, 1, 0] },
    ]);
    writer.json["scenes"] = json!([{ "nodes": [0, 1, 2] }]);
    let times = writer.floats("SCALAR", &[0.0, 2.0]);
    let weights = writer.floats("SCALAR", &[0.0, 1.0]);
    let moves = writer.floats("VEC3", &[0.0, 1.0, 0.0, 0.0, 1.0, 4.0]);
    writer.json["animations"] = json!([{ "name": "all", "samplers": [
        { "input": times, "output": weights },
        { "input": times, "output": moves },
    ], "channels": [
        { "sampler": 0, "target": { "node": 0, "path": "weights" } },
        { "sampler": 1, "target": { "node": 3, "path": "translation" } },
    ] }]);
    writer
}
