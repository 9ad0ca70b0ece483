//! Small files whose parts all refer to one large thing: it is read once, or the rest is told to be too much. Read again
//! for each part, these files take minutes.

use super::gltf_writer::{Writer, quad};
use firstlight::scene::file::ObjectPart;
use firstlight::scene::{LoadOptions, LoadedScene, ModelChoice, SceneSource, load};
use serde_json::{Value, json};
use std::path::Path;

fn open(path: &Path) -> Result<LoadedScene, String> {
    let choice = ModelChoice { at: Some(0.5), ..ModelChoice::default() };
    let options = LoadOptions { choice: Some(&choice), ..LoadOptions::default() };
    load(&SceneSource::parse(path).unwrap(), &options).map_err(|error| error.to_string())
}

fn opened(writer: &Writer) -> LoadedScene {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.glb");
    std::fs::write(&path, writer.glb()).unwrap();
    open(&path).unwrap()
}

#[test]
fn keys_that_many_channels_share_are_read_once() {
    const KEYS: usize = 300_000;
    const CHANNELS: usize = 20_000;
    let mut writer = Writer::default();
    quad(&mut writer);
    let view = writer.view(&vec![0; KEYS], None);
    let list = |writer: &mut Writer, kind: &str, count: usize| {
        let accessor = json!({ "bufferView": view, "componentType": 5121, "normalized": true, "count": count });
        let mut accessor = accessor;
        accessor["type"] = json!(kind);
        writer.accessor(accessor)
    };
    let times = list(&mut writer, "SCALAR", KEYS / 3);
    let values = list(&mut writer, "VEC3", KEYS / 3);
    let channels: Vec<Value> = (0..CHANNELS)
        .map(|i| {
            let path = if i % 2 == 0 { "translation" } else { "scale" };
            json!({ "sampler": i, "target": { "node": i / 2 + 1, "path": path } })
        })
        .collect();
    let nodes = writer.json["nodes"].as_array_mut().unwrap();
    nodes.extend(vec![json!({}); CHANNELS / 2 + 1]);
    writer.json["scenes"] = json!([{ "nodes": [0] }]);
    writer.json["animations"] =
        json!([{ "samplers": vec![json!({ "input": times, "output": values }); CHANNELS], "channels": channels }]);
    let facts = opened(&writer).facts.unwrap();
    assert_eq!(facts.animation_length, Some(0.0), "all keys are at 0");
}

#[test]
fn a_skin_that_many_nodes_use_is_posed_once() {
    const JOINTS: usize = 100_000;
    const NODES: usize = 3000;
    let mut writer = Writer::default();
    quad(&mut writer);
    writer.json["skins"] = json!([{ "joints": vec![0; JOINTS] }]);
    writer.json["nodes"] = json!(vec![json!({ "mesh": 0, "skin": 0 }); NODES]);
    writer.json["scenes"] = json!([{ "nodes": (0..NODES).collect::<Vec<_>>() }]);
    let scene = opened(&writer);
    let meshes = scene.file.objects.iter().filter(|object| matches!(object, ObjectPart::Mesh { .. })).count();
    assert_eq!(meshes, NODES);
}

#[test]
fn a_line_of_libraries_is_read_up_to_the_limit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.obj");
    let names: Vec<String> = (0..60_000).map(|i| format!("{i:x}")).collect();
    let text = format!("mtllib {}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", names.join(" "));
    std::fs::write(&path, text).unwrap();
    let scene = open(&path).unwrap();
    let warnings: Vec<String> = scene.warnings.iter().map(|warning| warning.to_string()).collect();
    assert!(warnings.iter().any(|text| text.contains("names more than 256 libraries")), "{warnings:?}");
}

#[test]
fn a_long_name_is_cut_and_lists_of_instances_are_compared_before_they_are_read() {
    const NODES: usize = 2000;
    let mut writer = Writer::default();
    quad(&mut writer);
    let many = writer.view(&vec![0; 1_200_000], None);
    let of =
        |kind: &str, count: usize| json!({ "bufferView": many, "componentType": 5126, "count": count, "type": kind });
    let (moves, turns) = (writer.accessor(of("VEC3", 100_000)), writer.accessor(of("VEC4", 3)));
    let broken = json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": moves, "ROTATION": turns } } });
    let whole = json!({ "EXT_mesh_gpu_instancing": { "attributes": { "ROTATION": turns } } });
    let mut nodes = vec![json!({ "mesh": 0, "extensions": broken }); NODES];
    nodes.push(json!({ "mesh": 0, "name": "n".repeat(1_000_000), "translation": [5, 0, 0], "extensions": whole }));
    let light = json!({ "name": "l".repeat(1_000_000), "type": "point" });
    writer.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [light] } });
    nodes.push(json!({ "extensions": { "KHR_lights_punctual": { "light": 0 } } }));
    writer.json["scenes"] = json!([{ "nodes": (0..nodes.len()).collect::<Vec<_>>() }]);
    writer.json["nodes"] = json!(nodes);
    let scene = opened(&writer);
    let names: Vec<usize> = scene.file.lights.iter().filter_map(|light| light.name()).map(str::len).collect();
    assert_eq!(names, [1024]);
    let names: Vec<usize> = scene.file.objects.iter().filter_map(|object| object.name()).map(str::len).collect();
    assert!(names.iter().any(|&length| length >= 1024), "the mesh with the long name is there: {names:?}");
    assert!(names.iter().all(|&length| length <= 1100), "{names:?}");
}
