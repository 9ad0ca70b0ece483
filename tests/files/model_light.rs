//! Models that are opened by themselves: the light of their file, the light that is generated, ground and exposure.

use super::gltf_writer::{Writer, quad};
use firstlight::scene::{
    ColorValue, EnvironmentSource, LoadOptions, LoadedScene, SceneSource, file::LightPart, file::MaterialPart,
    file::ObjectPart, load,
};
use serde_json::{Value, json};
use std::path::Path;

fn opened(name: &str, bytes: &[u8], environment: Option<&Path>) -> LoadedScene {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    let options = LoadOptions { environment, ..LoadOptions::default() };
    load(&SceneSource::Model(path), &options).unwrap_or_else(|error| panic!("{error}"))
}

/// A unit square, and a second one of another material, smaller by `scale`, to its right.
fn with_part(material: &Value, scale: f32) -> Vec<u8> {
    let mut writer = Writer::default();
    quad(quad(&mut writer));
    writer.json["meshes"][1]["primitives"][0]["material"] = json!(0);
    writer.json["materials"] = json!([material]);
    writer.json["nodes"][1] = json!({ "mesh": 1, "scale": [scale, scale, 1], "translation": [1.1, 0.5, 0] });
    writer.glb()
}

/// A unit square with a light in front of it.
fn with_light(light: &Value) -> Vec<u8> {
    let mut writer = Writer::default();
    quad(&mut writer);
    writer.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [light] } });
    let node = json!({ "extensions": { "KHR_lights_punctual": { "light": 0 } }, "translation": [0.5, 0.5, 1] });
    writer.json["nodes"] = json!([{ "mesh": 0 }, node]);
    writer.glb()
}

/// Red radiance of the generated key light; `None` without generated light.
fn generated(scene: &LoadedScene) -> Option<f32> {
    let key = scene.file.materials.iter().find(|(name, _)| *name == "key light").map(|(_, part)| part);
    assert_eq!(key.is_some(), matches!(scene.file.environment, EnvironmentSource::Gradient { .. }));
    match key {
        Some(MaterialPart::Emissive { radiance: ColorValue::Rgb(radiance) }) => Some(radiance.x),
        None => None,
        other => panic!("{other:?}"),
    }
}

fn has_ground(scene: &LoadedScene) -> bool {
    scene.file.objects.iter().any(|object| matches!(object, ObjectPart::Plane { .. }))
}

fn says(scene: &LoadedScene, text: &str) -> bool {
    scene.warnings.iter().any(|warning| warning.to_string().contains(text))
}

fn bare() -> f32 {
    let mut writer = Writer::default();
    let scene = opened("a.glb", &quad(&mut writer).glb(), None);
    assert!(has_ground(&scene) && says(&scene, "has no light") && scene.file.display.exposure_stops == 0.0);
    generated(&scene).unwrap()
}

#[test]
fn a_part_that_emits_does_not_switch_the_light_off() {
    let usual = bare();
    let emissive = json!({ "emissiveFactor": [1, 1, 1] });
    let speck = opened("a.glb", &with_part(&emissive, 0.02), None);
    assert!(has_ground(&speck) && generated(&speck).unwrap() > 0.95 * usual, "as without it");
    let bright = json!({ "emissiveFactor": [1, 1, 1],
        "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 20.0 } } });
    // It lights what stands around it, though not the square, which lies in its plane.
    let glowing = opened("a.glb", &with_part(&bright, 0.5), None);
    assert!(has_ground(&glowing) && generated(&glowing).is_some());
    let unlit = json!({ "extensions": { "KHR_materials_unlit": {} } });
    let labels = opened("a.glb", &with_part(&unlit, 1.0), None);
    assert!(has_ground(&labels) && generated(&labels) == Some(usual) && says(&labels, "has no light"));
}

/// A box, two units wide, whose camera looks from one wall at the opposite one; the ceiling emits `radiance`.
fn room(radiance: f64) -> Vec<u8> {
    room_of(radiance, 1.0)
}

/// The same, of which all reflection has this factor.
fn room_of(radiance: f64, grey: f64) -> Vec<u8> {
    room_in(Writer::default(), radiance, grey)
}

/// The same beside what is there already.
fn room_in(mut writer: Writer, radiance: f64, grey: f64) -> Vec<u8> {
    let before = writer.json["nodes"].as_array().map_or(0, Vec::len);
    // The square of each wall is moved to the unit square about the origin, then turned to face inwards.
    let turns = [
        [0.0, 0.0, 0.0, 1.0],
        [0.0, 1.0, 0.0, 0.0],
        [0.0, 0.707, 0.0, 0.707],
        [0.0, -0.707, 0.0, 0.707],
        [-0.707, 0.0, 0.0, 0.707],
        [0.707, 0.0, 0.0, 0.707],
    ];
    for (i, turn) in turns.iter().enumerate() {
        let corner = |x: f32, y: f32| [x, y, -1.0];
        let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)].concat();
        let position = writer.floats("VEC3", &corners);
        let indices = writer.indices(5123, &[0, 1, 2, 0, 2, 3]);
        writer.mesh(json!({ "attributes": { "POSITION": position }, "indices": indices, "material": i / 5 }));
        writer.json["nodes"][before + i]["rotation"] = json!(turn);
    }
    let base = json!({ "metallicFactor": 0, "baseColorFactor": [grey, grey, grey, 1] });
    let specular = json!({ "specularFactor": grey });
    writer.json["materials"] = json!([{ "name": "wall", "pbrMetallicRoughness": base,
          "extensions": { "KHR_materials_specular": specular } },
        { "name": "ceiling", "pbrMetallicRoughness": base, "emissiveFactor": [1, 1, 1],
          "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": radiance },
            "KHR_materials_specular": specular } }]);
    writer.json["cameras"] = json!([{ "type": "perspective", "perspective": { "yfov": 1.2, "znear": 0.1 } }]);
    writer.json["nodes"].as_array_mut().unwrap().push(json!({ "camera": 0, "translation": [0, 0, 0.9] }));
    writer.glb()
}

#[test]
fn a_room_under_its_own_ceiling_gets_no_other_light() {
    let lit = opened("a.glb", &room(2.0), None);
    assert!(
        generated(&lit).is_none() && !has_ground(&lit) && lit.file.display.exposure_stops == 0.0,
        "{:?}",
        lit.warnings
    );
    let glaring = opened("a.glb", &room(2000.0), None);
    assert!(generated(&glaring).is_none() && (-14.0..=-9.0).contains(&glaring.file.display.exposure_stops));
    assert!(says(&glaring, "exposure"));
}

/// The file without its camera.
fn without_camera(mut file: Vec<u8>) -> Vec<u8> {
    // The same length, so that the chunk stays whole.
    let at = file.windows(10).position(|part| part == b"\"camera\":0").unwrap();
    file[at..at + 10].copy_from_slice(b"\"kamera\":0");
    file
}

/// Seen from its own camera, or from outside through the backs of its walls, alone or on a terrace in the light.
#[test]
fn a_closed_room_is_lit_inside() {
    let inside = opened("a.glb", &room(0.0), None);
    let outside = opened("a.glb", &without_camera(room(0.0)), None);
    let mut writer = Writer::default();
    let position = writer.floats("VEC3", &[-2.5, -1.1, 2.5, 2.5, -1.1, 2.5, 2.5, -1.1, -2.5, -2.5, -1.1, -2.5]);
    let indices = writer.indices(5123, &[0, 1, 2, 0, 2, 3]);
    writer.mesh(json!({ "attributes": { "POSITION": position }, "indices": indices, "material": 0 }));
    let terrace = opened("a.glb", &without_camera(room_in(writer, 0.0, 1.0)), None);
    for scene in [&inside, &outside, &terrace] {
        assert!(generated(scene).is_some() && says(scene, "a light is added inside"), "{:?}", scene.warnings);
        let [LightPart::Point { position, .. }] = &scene.file.lights[..] else { panic!("one light inside") };
        assert!(position.abs().max_element() < 0.9, "{position}");
        assert!(!says(scene, "hardly any light reaches"), "{:?}", scene.warnings);
    }
    // A wall that is open needs none.
    assert!(opened("a.glb", &with_part(&json!({}), 0.5), None).file.lights.is_empty());
}

/// It would be a white disc in front of the model, or beside it.
#[test]
fn the_key_light_is_not_in_the_image_of_the_camera_of_the_file() {
    let mut found = Vec::new();
    for (turn, far) in
        [(glam::DVec3::new(-0.55, 0.75, 0.6), 3.0), (glam::DVec3::NEG_Z, 3.0), (glam::DVec3::NEG_Z, 60.0)]
    {
        let forward = turn.normalize();
        let (eye, rotation) =
            (0.5 - far * forward, glam::DQuat::from_rotation_arc(glam::DVec3::NEG_Z, forward).to_array());
        let mut writer = Writer::default();
        quad(&mut writer);
        writer.json["cameras"] = json!([{ "type": "perspective", "perspective": { "yfov": 0.5, "znear": 0.1 } }]);
        let camera = json!({ "camera": 0, "translation": eye.to_array(), "rotation": rotation });
        writer.json["nodes"].as_array_mut().unwrap().push(camera);
        let scene = opened("a.glb", &writer.glb(), None);
        let key = scene.file.objects.iter().find_map(|object| match object {
            ObjectPart::Sphere { center, radius, .. } => Some((*center, *radius)),
            _ => None,
        });
        let (center, radius) = key.expect("a key light");
        let away = (center - eye).angle_between(forward).to_degrees();
        assert!(away > 30.0 + (radius / (center - eye).length()).asin().to_degrees(), "{away}° from {forward}");
        found.push(center.x < 0.0 && center.z > 0.0);
    }
    assert_eq!(found, [false, true, true], "where it usually is, unless it is seen there");
}

/// Black is black in any light, and says nothing of it.
#[test]
fn a_black_model_is_not_taken_for_a_dark_room() {
    let scene = opened("a.glb", &room_of(0.0, 0.0), None);
    assert!(generated(&scene).is_some() && scene.file.lights.is_empty() && scene.file.display.exposure_stops == 0.0);
    assert!(!says(&scene, "hardly any light"), "{:?}", scene.warnings);
}

/// Its floor would be at the same place, and rays would find either.
#[test]
fn the_ground_is_below_the_floor_of_the_model() {
    let mut writer = Writer::default();
    quad(&mut writer);
    writer.json["nodes"][0]["rotation"] = json!([-0.5_f64.sqrt(), 0, 0, 0.5_f64.sqrt()]);
    let scene = opened("a.glb", &writer.glb(), None);
    let heights: Vec<f64> = (scene.file.objects.iter())
        .filter_map(|object| if let ObjectPart::Plane { point, .. } = object { Some(point.y) } else { None })
        .collect();
    assert!(matches!(heights[..], [y] if (-1e-3..-1e-4).contains(&y)), "{heights:?}");
}

#[test]
fn lights_are_exposed_for_their_level() {
    let sun = |lux: f64| opened("a.glb", &with_light(&json!({ "type": "directional", "intensity": lux })), None);
    let usual = sun(3.0);
    assert!(generated(&usual).is_none() && !has_ground(&usual) && usual.file.display.exposure_stops == 0.0);
    assert!(!says(&usual, "exposure"));
    let physical = sun(100_000.0);
    // White reflects 100,000 / π, and is to be white.
    let stops = (std::f64::consts::PI / 100_000.0).log2();
    assert!(
        (f64::from(physical.file.display.exposure_stops) - stops).abs() <= 0.5,
        "{}",
        physical.file.display.exposure_stops
    );
    let told = format!("the exposure is set to {:+} stops", physical.file.display.exposure_stops);
    assert!(generated(&physical).is_none() && says(&physical, &told), "{:?}", physical.warnings);
    assert!((2.0..=6.0).contains(&sun(0.05).file.display.exposure_stops));
    let feeble = sun(1e-4);
    assert!(generated(&feeble).is_some() && feeble.file.display.exposure_stops == 0.0);
    // A spot that points away.
    let spot = json!({ "type": "spot", "intensity": 500.0, "spot": { "outerConeAngle": 0.3 } });
    let mut writer = Writer::default();
    quad(&mut writer);
    writer.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [spot] } });
    let node = json!({ "extensions": { "KHR_lights_punctual": { "light": 0 } }, "translation": [0.5, 0.5, -1] });
    writer.json["nodes"] = json!([{ "mesh": 0 }, node]);
    let away = opened("a.glb", &writer.glb(), None);
    assert!(generated(&away).is_some() && says(&away, "too weak or does not reach"), "{:?}", away.warnings);
}

/// An image that is taller than wide opens again as it was, and so does one that is saved from a window.
#[test]
fn the_light_does_not_depend_on_the_size_of_the_image() {
    let folder = tempfile::tempdir().unwrap();
    let glow = json!({ "emissiveFactor": [1, 1, 1] });
    let one_sided = json!({ "doubleSided": false });
    for (i, bytes) in [with_part(&glow, 0.5), with_part(&glow, 3.0), with_part(&one_sided, 1.0)].iter().enumerate() {
        let path = folder.path().join(format!("{i}.glb"));
        std::fs::write(&path, bytes).unwrap();
        let with = |aspect| {
            let scene = load(&SceneSource::Model(path.clone()), &LoadOptions { aspect, ..LoadOptions::default() });
            let file = scene.unwrap().file;
            format!("{:?} {:?} {:?} {:?}", file.environment, file.display, file.materials, file.lights)
        };
        for aspect in [0.5, 1.0, 3.0] {
            assert_eq!(with(Some(aspect)), with(None), "model {i} at {aspect}");
        }
    }
}

#[test]
fn an_environment_of_choice_keeps_the_ground() {
    let folder = tempfile::tempdir().unwrap();
    let sky = folder.path().join("sky.png");
    image::RgbImage::from_pixel(4, 2, image::Rgb([200, 220, 255])).save(&sky).unwrap();
    let emissive = json!({ "emissiveFactor": [1, 1, 1] });
    let scene = opened("a.glb", &with_part(&emissive, 0.1), Some(&sky));
    assert!(has_ground(&scene) && matches!(scene.file.environment, EnvironmentSource::Image { .. }));
    assert!(!scene.file.materials.names().any(|name| name == "key light"));
}

/// A box that is open to the front, its ceiling of a material that emits.
const BOX: &str = "mtllib a.mtl
v -1 0 -1\nv 1 0 -1\nv 1 2 -1\nv -1 2 -1\nv -1 0 1\nv 1 0 1\nv 1 2 1\nv -1 2 1
usemtl wall\nf 1 2 3 4\nf 5 6 2 1\nf 1 4 8 5\nf 2 6 7 3\nusemtl ceiling\nf 4 3 7 8\n";

#[test]
fn materials_of_wavefront_files_count_as_well() {
    let folder = tempfile::tempdir().unwrap();
    let light = |emission: f64| {
        let wall = "newmtl wall\nKd 0.7 0.7 0.7\n";
        let ceiling = format!("newmtl ceiling\nKd 0.7 0.7 0.7\nKe {emission} {emission} {emission}\n");
        std::fs::write(folder.path().join("a.mtl"), format!("{wall}{ceiling}")).unwrap();
        let path = folder.path().join("a.obj");
        std::fs::write(&path, BOX).unwrap();
        load(&SceneSource::Model(path), &LoadOptions::default()).unwrap()
    };
    assert!(generated(&light(15.0)).is_none(), "the ceiling lights the box");
    let dim = light(0.2);
    assert!(has_ground(&dim) && generated(&dim).is_some());
}
