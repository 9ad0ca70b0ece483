//! glTF files: geometry of every encoding, nodes, poses, what becomes of a scene, and files that lie.

use super::gltf_writer::{Writer, animated, f32s, quad};
use firstlight::mesh::Mesh;
use firstlight::scene::file::{LightPart, MaterialPart, ObjectPart};
use firstlight::scene::model::{ModelFormat, ModelOptions, load_model};
use firstlight::scene::{
    EnvironmentSource, LoadOptions, LoadedScene, ModelChoice, SceneInputs, SceneSource, Shape, load, save_scene,
};
use glam::{DAffine3, DQuat, DVec3, Vec3};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A folder with a model in it.
pub struct Kept(pub tempfile::TempDir, pub PathBuf);

pub fn keep(name: &str, bytes: &[u8]) -> Kept {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    Kept(folder, path)
}

pub fn open(path: &Path, choice: &ModelChoice) -> Result<LoadedScene, String> {
    let options = LoadOptions { choice: Some(choice), ..LoadOptions::default() };
    load(&SceneSource::Model(path.to_owned()), &options).map_err(|error| error.to_string())
}

fn open_scene(path: &Path, camera: &str) -> Result<LoadedScene, String> {
    let choice = ModelChoice { camera: Some(camera.to_owned()), ..ModelChoice::default() };
    let options = LoadOptions { choice: Some(&choice), ..LoadOptions::default() };
    load(&SceneSource::Scene(path.to_owned()), &options).map_err(|error| error.to_string())
}

fn opened(bytes: &[u8]) -> LoadedScene {
    open(&keep("a.glb", bytes).1, &ModelChoice::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn refusal(bytes: &[u8]) -> String {
    let name = if bytes.starts_with(b"glTF") { "a.glb" } else { "a.gltf" };
    match open(&keep(name, bytes).1, &ModelChoice::default()) {
        Ok(_) => panic!("it opens"),
        Err(error) => error.split_once(name).unwrap().1.to_owned(),
    }
}

/// Meshes that came from the file, with their placements.
pub fn meshes(scene: &LoadedScene) -> Vec<(String, Arc<Mesh>, DAffine3)> {
    let mut world = bevy_ecs::world::World::new();
    scene.spawn(&mut world);
    let inputs = SceneInputs::of(&mut world);
    let mesh = |object: &firstlight::scene::ObjectInput| match &object.shape {
        Shape::Mesh(mesh) => Some((object.name.clone().unwrap(), mesh.clone(), object.placement.affine())),
        _ => None,
    };
    inputs.objects.iter().filter_map(mesh).collect()
}

/// Corners of all triangles in the world, to a millionth, in a fixed order of triangles and of their corners.
fn corners(scene: &LoadedScene) -> Vec<[[i64; 3]; 3]> {
    let mut all = Vec::new();
    for (_, mesh, world) in meshes(scene) {
        let place = |vertex: u32| {
            let point = world.transform_point3(mesh.positions[vertex as usize].as_dvec3() + mesh.center);
            point.to_array().map(|x| (x * 1e6).round() as i64)
        };
        all.extend(mesh.triangles.iter().map(|triangle| {
            let mut corners = triangle.map(place);
            // The same turn, beginning with the least.
            let least = (0..3).min_by_key(|&i| corners[i]).unwrap();
            corners.rotate_left(least);
            corners
        }));
    }
    all.sort();
    all
}

#[test]
fn every_encoding_of_the_same_square_is_the_same_square() {
    let plain = corners(&opened(&quad(&mut Writer::default()).glb()));
    assert_eq!(plain.len(), 2);
    let points: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let of = |writer: &mut Writer, position: usize, indices: Option<usize>, mode: u32| {
        let mut primitive = json!({ "attributes": { "POSITION": position }, "mode": mode });
        if let Some(indices) = indices {
            primitive["indices"] = json!(indices);
        }
        writer.mesh(primitive);
        corners(&opened(&writer.glb()))
    };
    // Indices of each size.
    for kind in [5121, 5123, 5125] {
        let mut writer = Writer::default();
        let position = writer.floats("VEC3", points.as_flattened());
        let indices = writer.indices(kind, &[0, 1, 2, 0, 2, 3]);
        assert_eq!(of(&mut writer, position, Some(indices), 4), plain, "{kind}");
    }
    // A strip and a fan, with and without indices.
    for (mode, order) in [(5, [1, 2, 0, 3]), (6, [0, 1, 2, 3])] {
        let mut writer = Writer::default();
        let position = writer.floats("VEC3", points.as_flattened());
        let indices = writer.indices(5123, &order);
        assert_eq!(of(&mut writer, position, Some(indices), mode), plain, "{mode}");
        let mut writer = Writer::default();
        let sorted: Vec<f32> = order.iter().flat_map(|&i| points[i as usize]).collect();
        let position = writer.floats("VEC3", &sorted);
        assert_eq!(of(&mut writer, position, None, mode), plain, "{mode}");
    }
    // Interleaved with an odd stride, beginning at an odd offset.
    let mut writer = Writer::default();
    let mut bytes = vec![7; 6];
    for point in points {
        bytes.extend(f32s(&point));
        bytes.extend([9; 8]);
    }
    let view = writer.view(&bytes, Some(20));
    let position = writer.accessor(json!({
        "bufferView": view, "byteOffset": 6, "componentType": 5126, "count": 4, "type": "VEC3"
    }));
    let indices = writer.indices(5121, &[0, 1, 2, 0, 2, 3]);
    assert_eq!(of(&mut writer, position, Some(indices), 4), plain);
    // Quantized: normalised and plain integers of one and two bytes.
    for (component, normalized, unit) in [
        (5120, true, 127),
        (5121, true, 255),
        (5122, true, 32767),
        (5123, true, 65535),
        (5120, false, 1),
        (5123, false, 1),
    ] {
        let mut writer = Writer::default();
        let bytes: Vec<u8> = (points.iter())
            .flat_map(|point| {
                let mut bytes: Vec<u8> = point
                    .iter()
                    .flat_map(|&x| {
                        let number = (x as i32 * unit).to_le_bytes();
                        number[..if component < 5122 { 1 } else { 2 }].to_vec()
                    })
                    .collect();
                bytes.resize(8, 0);
                bytes
            })
            .collect();
        let view = writer.view(&bytes, Some(8));
        let position = writer.accessor(json!({
            "bufferView": view, "componentType": component, "normalized": normalized, "count": 4, "type": "VEC3"
        }));
        let indices = writer.indices(5121, &[0, 1, 2, 0, 2, 3]);
        writer.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
        assert_eq!(of(&mut writer, position, Some(indices), 4), plain, "{component} {normalized}");
    }
    // Sparse over zeros: only three of the corners are written.
    let mut writer = Writer::default();
    let places = writer.view(&[1, 2, 3], None);
    let values = writer.view(&f32s(points[1..].as_flattened()), None);
    let position = writer.accessor(json!({
        "componentType": 5126, "count": 4, "type": "VEC3",
        "sparse": {
            "count": 3,
            "indices": { "bufferView": places, "componentType": 5121 },
            "values": { "bufferView": values }
        }
    }));
    let indices = writer.indices(5121, &[0, 1, 2, 0, 2, 3]);
    assert_eq!(of(&mut writer, position, Some(indices), 4), plain);
}

#[test]
fn primitives_become_one_mesh_with_slots_and_share_their_vertices() {
    let mut writer = Writer::default();
    let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let position = writer.floats("VEC3", points.as_flattened());
    let [a, b, line] = [&[0, 1, 2][..], &[0, 2, 3, 3, 3, 1], &[0, 1]].map(|list| writer.indices(5123, list));
    writer.json["materials"] = json!([{ "name": "red" }, { "name": "red" }]);
    let primitive = |indices: usize, material: usize, mode: u32| json!({ "attributes": { "POSITION": position }, "indices": indices, "material": material, "mode": mode });
    writer.json["meshes"] = json!([{ "primitives": [primitive(a, 0, 4), primitive(b, 1, 4), primitive(line, 0, 1)] }]);
    writer.json["nodes"] = json!([{ "mesh": 0 }]);
    let scene = opened(&writer.glb());
    let [(_, mesh, _)] = &meshes(&scene)[..] else { panic!("one mesh") };
    assert_eq!((mesh.positions.len(), mesh.triangles.len(), &mesh.slots[..]), (4, 2, &[0, 1][..]));
    assert!(mesh.normals.is_empty(), "flat where the file has no normals");
    let names: Vec<&str> = scene.file.materials.names().collect();
    assert_eq!(names[..2], ["red", "red 2"], "names are used once");
    let told = scene.warnings.join("\n");
    assert!(
        told.contains("1 primitives of points or lines") && told.contains("1 triangles use a vertex twice"),
        "{told}"
    );
}

#[test]
fn texture_coordinates_grow_upwards_and_transforms_go_with_them() {
    let mut writer = Writer::default();
    quad(&mut writer);
    let uv = writer.floats("VEC2", &[0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.25, 0.75]);
    writer.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(uv);
    writer.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    let (angle, [sx, sy], [ox, oy]) = (0.4_f64, [2.0, 3.0], [0.1, 0.2]);
    writer.json["images"] = json!([{ "uri": "tile.png" }]);
    writer.json["textures"] = json!([{ "source": 0 }]);
    writer.json["materials"] = json!([{ "pbrMetallicRoughness": { "baseColorTexture": {
        "index": 0,
        "extensions": { "KHR_texture_transform": { "rotation": angle, "scale": [sx, sy], "offset": [ox, oy] } }
    } } }]);
    let kept = keep("a.glb", &writer.glb());
    image::RgbImage::from_pixel(2, 2, image::Rgb([9, 9, 9])).save(kept.0.path().join("tile.png")).unwrap();
    let scene = open(&kept.1, &ModelChoice::default()).unwrap();
    let (_, mesh, _) = &meshes(&scene)[0];
    assert_eq!(mesh.uvs[3], glam::Vec2::new(0.25, 0.25));
    let mut world = bevy_ecs::world::World::new();
    scene.spawn(&mut world);
    let inputs = SceneInputs::of(&mut world);
    let found = inputs.materials.iter().find_map(|material| match &material.material {
        firstlight::scene::Material::Principled {
            base_color: firstlight::scene::ColorParam::Texture(texture), ..
        } => Some(texture.texture.clone()),
        _ => None,
    });
    let texture = found.expect("a texture");
    let (sin, cos) = angle.sin_cos();
    for (u, v) in [(0.0, 0.0), (1.0, 0.0), (0.3, 0.8)] {
        // As the extension has it, v downwards.
        let (x, y) = (sx * u, sy * v);
        let (u2, v2) = (cos * x + sin * y + ox, -sin * x + cos * y + oy);
        let ours = texture.uv_matrix * glam::Vec2::new(u as f32, 1.0 - v as f32) + texture.uv_offset;
        let expected = glam::Vec2::new(u2 as f32, 1.0 - v2 as f32);
        assert!(ours.abs_diff_eq(expected, 1e-5), "({u}, {v}): {ours} for {expected}");
    }
    // A model is worth seeing without its pictures.
    std::fs::remove_file(kept.0.path().join("tile.png")).unwrap();
    let bare = open(&kept.1, &ModelChoice::default()).unwrap();
    assert!(bare.warnings.iter().any(|warning| warning.contains("the texture is omitted")), "{:?}", bare.warnings);
}

#[test]
fn nodes_multiply_and_instances_share_a_mesh() {
    let mut writer = Writer::default();
    quad(&mut writer);
    let turn = DQuat::from_rotation_y(0.7);
    let q = turn.to_array();
    let matrix = [0.0, 0.0, -2.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 5.0, 6.0, 7.0, 1.0];
    writer.json["nodes"] = json!([
        { "name": "top", "translation": [1, 2, 3], "scale": [2, 1, 1], "children": [1, 2] },
        { "name": "turned", "rotation": q, "mesh": 0, "children": [3] },
        { "name": "matrix", "matrix": matrix, "mesh": 0 },
        { "name": "mirrored", "scale": [-1, 1, 1], "mesh": 0 },
        { "name": "elsewhere", "mesh": 0 },
        { "name": "flat", "scale": [1, 0, 1], "mesh": 0 },
    ]);
    writer.json["scenes"] = json!([{ "nodes": [0, 5] }, { "nodes": [4] }]);
    writer.json["scene"] = json!(0);
    let scene = opened(&writer.glb());
    let found = meshes(&scene);
    let top = DAffine3::from_scale_rotation_translation(
        DVec3::new(2.0, 1.0, 1.0),
        DQuat::IDENTITY,
        DVec3::new(1.0, 2.0, 3.0),
    );
    let turned = top * DAffine3::from_quat(turn);
    let expected = [
        ("turned", turned),
        ("mirrored", turned * DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0))),
        ("matrix", top * DAffine3::from_mat4(glam::DMat4::from_cols_array(&matrix))),
    ];
    assert_eq!(found.len(), expected.len());
    for ((name, mesh, world), (wanted, place)) in found.iter().zip(&expected) {
        assert_eq!(name, wanted);
        assert!(world.abs_diff_eq(*place, 1e-12), "{name}: {world} for {place}");
        assert!(Arc::ptr_eq(mesh, &found[0].1), "one mesh, and one tree");
    }
    assert!(scene.warnings.iter().any(|warning| warning.contains("`flat` is flattened")), "{:?}", scene.warnings);
    // Ten thousand nodes within each other are a tree too.
    let mut nodes: Vec<Value> =
        (1..10_000).map(|child| json!({ "children": [child], "translation": [1, 0, 0] })).collect();
    nodes.push(json!({ "mesh": 0 }));
    writer.json["nodes"] = json!(nodes);
    writer.json["scenes"] = json!([{ "nodes": [0] }]);
    let (_, _, world) = &meshes(&opened(&writer.glb()))[0];
    assert_eq!(world.translation, DVec3::new(9999.0, 0.0, 0.0));
}

#[test]
fn gpu_instances_stand_in_their_node() {
    let mut writer = Writer::default();
    quad(&mut writer);
    let moves = writer.floats("VEC3", &[1.0, 0.0, 0.0, 0.0, 2.0, 0.0]);
    let scales = writer.floats("VEC3", &[1.0, 1.0, 1.0, 3.0, 3.0, 3.0]);
    writer.json["nodes"] = json!([{ "mesh": 0, "translation": [0, 0, 5], "extensions": {
        "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": moves, "SCALE": scales } }
    } }]);
    let found = meshes(&opened(&writer.glb()));
    let places: Vec<DVec3> = found.iter().map(|(.., world)| world.transform_point3(DVec3::X)).collect();
    assert_eq!(places, [DVec3::new(2.0, 0.0, 5.0), DVec3::new(3.0, 2.0, 5.0)]);
}

#[test]
fn equal_meshes_at_one_place_count_once() {
    let mut writer = Writer::default();
    quad(&mut writer);
    // Without a view: all are zero.
    let moves = writer.accessor(json!({ "componentType": 5126, "count": 1 << 20, "type": "VEC3" }));
    let nodes = (0..5000).map(|i| json!({ "mesh": 0, "translation": [0, 0, i % 2] }));
    let instances = json!({ "mesh": 0, "translation": [0, 0, 7], "extensions": {
        "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": moves } }
    } });
    writer.json["nodes"] = Value::Array(nodes.chain([instances]).collect());
    let scene = opened(&writer.glb());
    assert_eq!(meshes(&scene).len(), 3);
    let left_out = (1 << 20) - 1 + 4998;
    let expected = format!("{left_out} meshes lie exactly where an equal one is already");
    assert!(scene.warnings.iter().any(|warning| warning.contains(&expected)), "{:?}", scene.warnings);
}

#[test]
fn equal_images_are_decoded_once() {
    let mut writer = Writer::default();
    quad(&mut writer);
    let mut png = std::io::Cursor::new(Vec::new());
    image::GrayImage::new(64, 64).write_to(&mut png, image::ImageFormat::Png).unwrap();
    let view = writer.view(png.get_ref(), None);
    let same = json!({ "buffer": 0, "byteOffset": writer.json["bufferViews"][view]["byteOffset"],
        "byteLength": png.get_ref().len() });
    writer.json["bufferViews"].as_array_mut().unwrap().push(same);
    let uv = writer.floats("VEC2", &[0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0]);
    let views = [view, view, view + 1];
    let images = views.map(|view| json!({ "bufferView": view, "mimeType": "image/png" }));
    writer.json["images"] = json!(images);
    writer.json["textures"] = json!([{ "source": 0 }, { "source": 1 }, { "source": 2 }]);
    let textured = |i: usize| json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": i } } });
    writer.json["materials"] = json!([textured(0), textured(1), textured(2)]);
    let mut primitive = writer.json["meshes"][0]["primitives"][0].clone();
    primitive["attributes"]["TEXCOORD_0"] = json!(uv);
    writer.json["meshes"][0]["primitives"] = (0..3)
        .map(|material| {
            primitive["material"] = json!(material);
            primitive.clone()
        })
        .collect();
    assert_eq!(opened(&writer.glb()).picture_bytes(), 64 * 64);
}

#[test]
fn cameras_are_chosen_by_name() {
    let mut writer = Writer::default();
    quad(&mut writer);
    writer.json["cameras"] = json!([
        { "type": "perspective", "perspective": { "yfov": 0.5, "znear": 0.1 } },
        { "type": "orthographic", "orthographic": { "xmag": 2.0, "ymag": 1.0, "zfar": 9.0, "znear": 0.0 } },
    ]);
    writer.json["nodes"] = json!([
        { "mesh": 0 },
        { "name": "near", "camera": 0, "translation": [0.5, 0.5, 4.0] },
        { "name": "near", "camera": 1, "translation": [0.5, 0.5, 2.0] },
    ]);
    writer.json["scenes"] = json!([{ "nodes": [0, 1, 2] }]);
    let kept = keep("a.glb", &writer.glb());
    let named = |camera: Option<&str>| {
        let choice = ModelChoice { camera: camera.map(str::to_owned), ..ModelChoice::default() };
        open(&kept.1, &choice)
    };
    let first = named(None).unwrap().file;
    assert_eq!((first.camera.eye, first.camera.forward), (DVec3::new(0.5, 0.5, 4.0), Some(DVec3::NEG_Z)));
    assert!((first.camera.vfov - 0.5_f64.to_degrees()).abs() < 1e-12 && first.camera.pivot_distance == Some(4.0));
    assert_eq!(first.cameras.names().collect::<Vec<_>>(), ["near", "near 2"]);
    let second = named(Some("near 2")).unwrap();
    assert_eq!((first.camera.orthographic_height, second.file.camera.orthographic_height), (None, Some(2.0)));
    // Seen in perspective, the square would be as high.
    assert!(((0.5 * second.file.camera.vfov.to_radians()).tan() * 2.0 - 1.0).abs() < 1e-12);
    // A saved scene keeps them.
    let saved = kept.0.path().join("b.ron");
    std::fs::write(&saved, first.to_ron()).unwrap();
    assert_eq!(open_scene(&saved, "near 2").unwrap().file.camera, second.file.camera);
    let error = named(Some("nera")).err().unwrap();
    assert!(error.contains("there is no camera `nera`") && error.contains("`near`"), "{error}");
    assert!(
        !first.objects.iter().any(|object| matches!(object, ObjectPart::Plane { .. })),
        "no ground before a camera"
    );
}

#[test]
fn lights_of_the_file_are_those_of_the_scene() {
    let mut writer = Writer::default();
    quad(&mut writer);
    let punctual = json!({ "lights": [
        { "type": "spot", "intensity": 3.0, "color": [1, 0.5, 0], "spot": { "innerConeAngle": 0.2, "outerConeAngle": 0.4 } },
        { "type": "directional", "intensity": 2.0, "name": "sun" },
        { "type": "point", "intensity": 4.0 },
    ] });
    writer.json["extensions"] = json!({ "KHR_lights_punctual": punctual });
    let lamp = |light: usize| json!({ "extensions": { "KHR_lights_punctual": { "light": light } } });
    let (mut spot, sun, point) = (lamp(0), lamp(1), lamp(2));
    spot["rotation"] = json!(DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2).to_array());
    spot["translation"] = json!([0, 3, 0]);
    writer.json["nodes"] = json!([{ "mesh": 0 }, spot, sun, point]);
    writer.json["scenes"] = json!([{ "nodes": [0, 1, 2, 3] }]);
    let lit = opened(&writer.glb());
    assert_eq!((lit.file.environment.clone(), lit.file.objects.len()), (EnvironmentSource::Black, 1));
    let [
        LightPart::Spot { position, direction, intensity, inner_angle, outer_angle, .. },
        LightPart::Directional { name, direction: sun, irradiance, .. },
        LightPart::Point { radius, intensity: bulb, .. },
    ] = &lit.file.lights[..]
    else {
        panic!("{:?}", lit.file.lights)
    };
    assert!((*direction - DVec3::NEG_Y).length() < 1e-12 && *position == DVec3::new(0.0, 3.0, 0.0));
    assert_eq!(intensity.0, Vec3::new(3.0, 1.5, 0.0));
    assert!((inner_angle - 0.2_f64.to_degrees()).abs() < 1e-12 && (outer_angle - 0.4_f64.to_degrees()).abs() < 1e-12);
    assert_eq!((name.as_deref(), *sun, irradiance.0), (Some("sun"), DVec3::NEG_Z, Vec3::splat(2.0)));
    assert_eq!((*radius, bulb.0), (0.0, Vec3::splat(4.0)));
    // What emits is a part of the material.
    let mut writer = Writer::default();
    quad(&mut writer);
    writer.json["materials"] = json!([{ "emissiveFactor": [1, 1, 1], "extensions": {
        "KHR_materials_emissive_strength": { "emissiveStrength": 5.0 }
    } }]);
    writer.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    let glowing = opened(&writer.glb());
    let Some((_, MaterialPart::Principled { emission, .. })) = glowing.file.materials.iter().next() else {
        panic!("a principled material")
    };
    assert_eq!(*emission, firstlight::scene::ColorValue::grey(5.0));
}

#[test]
fn hidden_nodes_hide_what_is_below_them() {
    let mut writer = Writer::default();
    quad(&mut writer);
    let visible = |is: bool| json!({ "KHR_node_visibility": { "visible": is } });
    writer.json["extensionsUsed"] = json!(["KHR_node_visibility", "KHR_lights_punctual"]);
    writer.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [{ "type": "point", "intensity": 4.0 }] } });
    writer.json["nodes"] = json!([
        { "mesh": 0, "extensions": visible(true) },
        { "children": [2, 3], "extensions": visible(false) },
        { "mesh": 0, "translation": [900, 0, 0], "extensions": visible(true) },
        { "extensions": { "KHR_lights_punctual": { "light": 0 } } },
    ]);
    writer.json["scenes"] = json!([{ "nodes": [0, 1] }]);
    let scene = opened(&writer.glb());
    let objects = scene.file.objects.iter().filter(|object| matches!(object, ObjectPart::Mesh { .. }));
    assert_eq!(objects.map(ObjectPart::is_hidden).collect::<Vec<_>>(), [false, true]);
    let is_of_file = |light: &&LightPart| matches!(light, LightPart::Point { .. });
    assert!(scene.file.lights.iter().find(is_of_file).is_some_and(LightPart::is_hidden));
    assert!(!scene.warnings.join("\n").contains("KHR_node_visibility"));
    let eye = scene.file.camera.eye;
    assert!(eye.length() < 20.0, "what is hidden is not framed: the camera is at {eye}");
    // A file that shows nothing shows all.
    writer.json["scenes"] = json!([{ "nodes": [1] }]);
    let scene = opened(&writer.glb());
    assert!(!scene.file.objects[0].is_hidden() && scene.warnings.join("\n").contains("all of its meshes are hidden"));
}

#[test]
fn what_is_invisible_is_not_framed_unless_all_is() {
    let mut writer = Writer::default();
    quad(&mut writer);
    let eye = |writer: &Writer| opened(&writer.glb()).file.camera.eye;
    let alone = eye(&writer);
    writer.json["materials"] =
        json!([{ "alphaMode": "BLEND", "pbrMetallicRoughness": { "baseColorFactor": [1, 1, 1, 0] } }]);
    let mut hole = writer.json["meshes"][0].clone();
    hole["primitives"][0]["material"] = json!(0);
    writer.json["meshes"].as_array_mut().unwrap().push(hole);
    writer.json["nodes"] = json!([{ "mesh": 0 }, { "mesh": 1, "scale": [900, 900, 900] }]);
    writer.json["scenes"] = json!([{ "nodes": [0, 1] }]);
    assert_eq!(eye(&writer), alone);
    writer.json["scenes"] = json!([{ "nodes": [1] }]);
    assert!(eye(&writer).length() > 100.0 * alone.length());
}

/// Those of version 0 of the format look along -Z.
#[test]
fn avatars_are_seen_from_the_front() {
    let mut writer = Writer::default();
    quad(&mut writer);
    for (extension, is_away) in [("VRM", true), ("VRMC_vrm", false)] {
        writer.json["extensionsUsed"] = json!([extension]);
        assert_eq!(opened(&writer.glb()).file.camera.eye.z < 0.0, is_away, "{extension}");
    }
}

#[test]
fn variants_and_what_is_not_modelled_are_told() {
    let mut writer = Writer::default();
    quad(&mut writer);
    writer.json["extensions"] =
        json!({ "KHR_materials_variants": { "variants": [{ "name": "day" }, { "name": "night" }] } });
    writer.json["extensionsUsed"] = json!(["KHR_materials_variants", "EXT_from_the_future"]);
    writer.json["materials"] = json!([
        { "name": "white" },
        { "name": "black", "extensions": { "KHR_materials_dispersion": { "dispersion": 1.0 } } },
    ]);
    let primitive = &mut writer.json["meshes"][0]["primitives"][0];
    primitive["material"] = json!(0);
    primitive["extensions"] = json!({ "KHR_materials_variants": { "mappings": [{ "material": 1, "variants": [1] }] } });
    let kept = keep("a.glb", &writer.glb());
    let with =
        |variant: &str| open(&kept.1, &ModelChoice { variant: Some(variant.to_owned()), ..ModelChoice::default() });
    let material = |scene: &LoadedScene| scene.file.objects[0].material().map(str::to_owned);
    let (day, night) = (with("day").unwrap(), with("night").unwrap());
    assert_eq!((material(&day).as_deref(), material(&night).as_deref()), (Some("white"), Some("black")));
    let told = night.warnings.join("\n");
    assert!(
        told.contains("`black`: its dispersion is not used: it has no volume")
            && told.contains("`EXT_from_the_future`"),
        "{told}"
    );
    assert!(with("dusk").err().unwrap().contains("there is no variant `dusk`"));
}

#[test]
fn a_saved_scene_and_its_model_say_the_same() {
    let kept = keep("a.glb", &animated().glb());
    let choice = ModelChoice { at: Some(1.0), ..ModelChoice::default() };
    let scene = open(&kept.1, &choice).unwrap();
    let mut world = bevy_ecs::world::World::new();
    scene.spawn(&mut world);
    let file = kept.0.path().join("b.ron");
    save_scene(&mut world, Some(&scene), &file).unwrap();
    let again = load(&SceneSource::Scene(file.clone()), &LoadOptions::default()).unwrap();
    let none = open_scene(&file, "none");
    assert!(none.unwrap_err().contains("there is no camera `none`"));
    assert_eq!(again.content_fingerprint(), scene.content_fingerprint());
    assert_eq!(corners(&again), corners(&scene));
}

#[test]
fn the_whole_scene_is_a_mesh_too() {
    let mut writer = Writer::default();
    quad(&mut writer);
    writer.json["nodes"] = json!([{ "mesh": 0, "translation": [5, 0, 0] }, { "mesh": 0, "scale": [-1, 1, 1] }]);
    writer.json["scenes"] = json!([{ "nodes": [0, 1] }]);
    let kept = keep("a.glb", &writer.glb());
    let model = load_model(&kept.1, ModelFormat::Gltf, &ModelOptions::default()).unwrap();
    assert_eq!((model.mesh.triangles.len(), model.materials.len()), (4, 1));
    let area: f64 = (model.mesh.triangles.iter())
        .map(|corners| {
            let [a, b, c] = corners.map(|vertex| model.mesh.positions[vertex as usize].as_dvec3());
            // A mirrored mesh keeps its front.
            0.5 * (b - a).cross(c - a).z
        })
        .sum();
    assert!((area - 2.0).abs() < 1e-6, "{area}");
}

#[test]
fn files_outside_of_the_folder_are_read_only_when_that_is_allowed() {
    let outer = tempfile::tempdir().unwrap();
    let inner = outer.path().join("inner");
    std::fs::create_dir(&inner).unwrap();
    let mut writer = Writer::default();
    quad(&mut writer);
    let (mut json, bytes) = (writer.document(), writer.bytes.clone());
    std::fs::write(outer.path().join("a b.bin"), &bytes).unwrap();
    std::fs::write(inner.join("a b.bin"), &bytes).unwrap();
    let path = inner.join("a.gltf");
    let mut with = |uri: &str, allow_outside: bool| {
        json["buffers"][0]["uri"] = json!(uri);
        std::fs::write(&path, serde_json::to_vec(&json).unwrap()).unwrap();
        open(&path, &ModelChoice { allow_outside, ..ModelChoice::default() }).map(|scene| corners(&scene).len())
    };
    assert_eq!(with("a%20b.bin", false), Ok(2));
    let error = with("../a%20b.bin", false).unwrap_err();
    assert!(error.contains("buffers[0]") && error.contains("--allow-outside"), "{error}");
    assert_eq!(with("../a%20b.bin", true), Ok(2));
    assert!(with("http://localhost/a.bin", true).unwrap_err().contains("network"));
    assert!(with("none.bin", false).unwrap_err().contains("no such file"));
    let data = base64::Engine::encode(&base64::engine::general_purpose::STANDARD, &bytes);
    assert_eq!(with(&format!("data:application/octet-stream;base64,{data}"), false), Ok(2));
}

#[test]
fn files_whose_only_mesh_lies_are_refused_with_what_and_where() {
    let broken = |change: &dyn Fn(&mut Value)| {
        let mut writer = Writer::default();
        quad(&mut writer);
        writer.json = writer.document();
        change(&mut writer.json);
        refusal(&writer.glb())
    };
    for (change, expected) in [
        (
            &(|json: &mut Value| json["accessors"][0]["count"] = json!(1_000_000)) as &dyn Fn(&mut Value),
            "accessors[0]: needs 12000000 bytes",
        ),
        (&|json| json["accessors"][0]["byteOffset"] = json!(u64::MAX), "accessors[0]: needs"),
        (&|json| json["accessors"][0]["bufferView"] = json!(77), "bufferViews[77]"),
        (&|json| json["accessors"][1]["bufferView"] = Value::Null, ""),
        (
            &|json| json["accessors"][0] = json!({ "componentType": 5126, "count": u32::MAX, "type": "VEC4" }),
            "accessors[0]",
        ),
        (&|json| json["bufferViews"][0]["byteStride"] = json!(4), "byteStride"),
        (&|json| json["bufferViews"][0]["byteLength"] = json!(u64::MAX), "bufferViews[0]: needs"),
        (&|json| json["meshes"][0]["primitives"][0]["attributes"] = json!({}), "POSITION is missing"),
        (&|json| json["meshes"][0]["primitives"][0]["mode"] = json!(9), "mode is `9`"),
        (&|json| json["meshes"][0]["primitives"] = json!([]), "has no triangles"),
        (&|json| json["nodes"][0]["mesh"] = json!(4), "meshes[4]"),
        (&|json| json["asset"]["version"] = json!("1.0"), "glTF version 1.0"),
        (&|json| json["buffers"] = json!([]), "buffers[0]"),
    ] {
        let error = if expected.is_empty() { continue } else { broken(change) };
        assert!(error.contains(expected), "{error} for {expected}");
    }
    // What is cut anywhere.
    let mut writer = Writer::default();
    let whole = quad(&mut writer).glb();
    for length in (0..whole.len()).step_by(7) {
        refusal(&[b"glTF", &whole[4.min(length)..length]].concat());
    }
}

/// A file beside the reference models, where those are.
fn kept_beside(name: &str) -> Option<PathBuf> {
    let root = std::env::var_os("FIRSTLIGHT_MODELS")?;
    Some(Path::new(&root).join("../gltf").join(name)).filter(|path| path.exists())
}

#[test]
fn files_that_other_programs_wrote() {
    for (name, instances, triangles) in [
        ("01_pbr_spheres.glb", 28, 38_006),
        ("02_textured/02_textured.gltf", 6, 13_104),
        ("03_glass.glb", 8, 133_502),
        ("05_punctual.glb", 5, 29_178),
        ("06_instances.glb", 202, 800_004),
        ("06_instances_meshopt.glb", 202, 800_004),
        ("06_instances_quantized.glb", 202, 800_004),
        ("09_animated.glb", 6, 6_610),
    ] {
        let Some(path) = kept_beside(name) else { continue };
        let scene = open(&path, &ModelChoice::default()).unwrap_or_else(|error| panic!("{error}"));
        let found = meshes(&scene);
        let sum: usize = found.iter().map(|(_, mesh, _)| mesh.triangles.len()).sum();
        assert_eq!((found.len(), sum), (instances, triangles), "{name}");
    }
}

#[test]
fn files_that_mean_harm_are_refused_with_their_place() {
    for (name, expected) in [
        ("truncated_json.glb", "the file is truncated"),
        ("accessor_out_of_bounds.glb", "accessors[0]: needs 12000000 bytes"),
        ("index_out_of_range.glb", "index 65000 is out of range"),
        ("offset_overflow.glb", "bufferViews[0]: needs 4294967316 bytes"),
        ("path_traversal.gltf", "is a path out of the folder"),
        ("nan_positions.glb", "accessors[0]: element 1 has a number that is NaN"),
    ] {
        let Some(path) = kept_beside(&format!("hostile/{name}")) else { continue };
        let error = open(&path, &ModelChoice::default()).err().unwrap_or_else(|| panic!("{name} opens"));
        assert!(error.contains(expected), "{name}: {error}");
    }
    // Ten thousand nodes within each other are allowed; a node is shown once, however often it is named; colours that
    // would need terabytes are left out.
    for name in ["deep_nodes.glb", "cyclic_nodes.glb", "node_dag_doubling.glb", "base64_bomb.gltf"] {
        let Some(path) = kept_beside(&format!("hostile/{name}")) else { continue };
        assert_eq!(meshes(&open(&path, &ModelChoice::default()).unwrap()).len(), 1, "{name}");
    }
}

/// Writes `fuzz/seeds/gltf` anew: run it with `--ignored` when the writer has learned something.
#[test]
#[ignore = "it writes into the source tree"]
fn the_seeds_of_the_fuzzer() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds/gltf");
    std::fs::create_dir_all(&folder).unwrap();
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.join(name), bytes).unwrap();
    write("animated.glb", &animated().glb());
    let mut writer = Writer::default();
    quad(&mut writer);
    let mut json = writer.document();
    let data = base64::Engine::encode(&base64::engine::general_purpose::STANDARD, &writer.bytes);
    json["buffers"][0]["uri"] = json!(format!("data:application/octet-stream;base64,{data}"));
    json["materials"] = json!([{
        "pbrMetallicRoughness": { "baseColorFactor": [1, 0.5, 0, 1], "baseColorTexture": { "index": 0 } },
        "alphaMode": "MASK", "doubleSided": true, "emissiveFactor": [0, 1, 0],
        "extensions": { "KHR_materials_transmission": { "transmissionFactor": 0.5 }, "KHR_materials_unlit": {} }
    }]);
    json["images"] = json!([{ "uri": "data:image/png;base64,AAAA" }]);
    json["textures"] = json!([{ "source": 0, "sampler": 0 }]);
    json["samplers"] = json!([{ "wrapS": 33071, "magFilter": 9728 }]);
    json["meshes"][0]["primitives"][0]["material"] = json!(0);
    json["cameras"] = json!([{ "type": "perspective", "perspective": { "yfov": 0.5 } }]);
    json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [{ "type": "spot", "spot": {} }] } });
    json["nodes"] = json!([
        { "mesh": 0, "camera": 0, "children": [1], "extensions": { "KHR_lights_punctual": { "light": 0 } } },
        { "mesh": 0, "matrix": [1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1] }
    ]);
    write("materials.gltf", &serde_json::to_vec(&json).unwrap());
    // Sparse over zeros, instances, and a compressed sequence of indices.
    let mut writer = Writer::default();
    quad(&mut writer);
    let packed = [0xd1, 0, 4, 4, 8 | 1, 4, 4, 0, 0, 0, 0];
    let view = writer.view(&packed, None);
    writer.json["bufferViews"][1]["extensions"] = json!({ "EXT_meshopt_compression": {
        "buffer": 0, "byteOffset": writer.json["bufferViews"][view]["byteOffset"], "byteLength": packed.len(),
        "byteStride": 2, "count": 6, "mode": "INDICES"
    } });
    let places = writer.view(&[1, 2], None);
    let values = writer.view(&f32s(&[5.0; 6]), None);
    writer.json["accessors"][0]["sparse"] = json!({
        "count": 2,
        "indices": { "bufferView": places, "componentType": 5121 },
        "values": { "bufferView": values }
    });
    let moves = writer.floats("VEC3", &[1.0, 0.0, 0.0, 0.0, 2.0, 0.0]);
    writer.json["nodes"][0]["extensions"] =
        json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": moves } } });
    write("packed.glb", &writer.glb());
}
