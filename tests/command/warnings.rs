//! Warnings of a model: each once, one line per kind, all with `-v`.

use crate::program::does;
use std::path::Path;

/// Standard error of a command that succeeds, line by line.
fn said(folder: &Path, line: &str) -> Vec<String> {
    does(folder, line).err.lines().map(str::to_owned).collect()
}

/// A glTF of `n` meshes with two triangles each, one of which uses a vertex twice, whose material has an image that is
/// not there, as colour and as normal map.
fn write_model(folder: &Path, n: usize) {
    let positions = [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let mut bytes: Vec<u8> = positions.iter().flatten().flat_map(|number| number.to_le_bytes()).collect();
    // Texture coordinates, and the indices of the two triangles.
    bytes.extend([0.0_f32, 0.0, 1.0, 0.0, 0.0, 1.0].iter().flat_map(|number| number.to_le_bytes()));
    bytes.extend([0_u16, 1, 2, 0, 0, 1].iter().flat_map(|index| index.to_le_bytes()));
    std::fs::write(folder.join("many.bin"), &bytes).unwrap();
    let primitive =
        serde_json::json!({ "attributes": { "POSITION": 0, "TEXCOORD_0": 1 }, "indices": 2, "material": 0 });
    let meshes: Vec<_> = (0..n).map(|_| serde_json::json!({ "primitives": [primitive] })).collect();
    let nodes: Vec<_> = (0..n).map(|i| serde_json::json!({ "mesh": i, "translation": [2 * i, 0, 0] })).collect();
    let model = serde_json::json!({
        "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": (0..n).collect::<Vec<_>>() }],
        "nodes": nodes, "meshes": meshes,
        "materials": [{
            "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } }, "normalTexture": { "index": 1 },
        }],
        "textures": [{ "source": 0 }, { "source": 0 }], "images": [{ "uri": "missing.png" }],
        "buffers": [{ "uri": "many.bin", "byteLength": bytes.len() }],
        "bufferViews": [
            { "buffer": 0, "byteOffset": 0, "byteLength": 36 }, { "buffer": 0, "byteOffset": 36, "byteLength": 24 },
            { "buffer": 0, "byteOffset": 60, "byteLength": 12 },
        ],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0] },
            { "bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2" },
            { "bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR" },
        ],
    });
    std::fs::write(folder.join("many.gltf"), model.to_string()).unwrap();
}

#[test]
fn a_kind_of_warning_is_one_line_and_none_is_told_twice() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    write_model(path, 5);
    let render = "render many.gltf --size 8x6 --spp 1 -o a.png";
    let lines = said(path, render);
    let of =
        |lines: &[String], word: &str| lines.iter().filter(|line| line.contains(word)).cloned().collect::<Vec<_>>();
    let twice = of(&lines, "use a vertex twice");
    assert!(twice.len() == 1 && twice[0].starts_with("warning: many.gltf: "), "{lines:#?}");
    assert!(twice[0].ends_with(" (and 4 more)"), "{lines:#?}");
    assert_eq!(of(&lines, "missing.png").len(), 1, "{lines:#?}");
    assert_eq!(of(&lines, "6 warnings, which -v lists").len(), 1, "{lines:#?}");
    // Added light is no fault.
    let light = of(&lines, "key light");
    assert!(light.len() == 1 && light[0].starts_with("note: "), "{lines:#?}");

    let all = said(path, &format!("-v {render}"));
    assert_eq!(of(&all, "use a vertex twice").len(), 5, "{all:#?}");
    let quiet = said(path, &format!("-q {render}"));
    assert!(quiet.iter().all(|line| line.starts_with("warning: ")) && quiet.len() == 2, "{quiet:#?}");
    let json: serde_json::Value = serde_json::from_slice(&does(path, "info many.gltf --json").bytes).unwrap();
    assert_eq!(
        (json["warnings"].as_array().unwrap().len(), json["notices"].as_array().unwrap().len()),
        (6, 1),
        "{json}"
    );
}
