//! glTF files that move: poses, animations, motion blur.

use super::gltf::{keep, meshes, open};
use super::gltf_writer::{Writer, animated};
use firstlight::frame::{Command, Session, SessionOptions};
use firstlight::scene::{
    Animation, Extraction, LoadOptions, ModelChoice, Moment, SceneInputs, SceneSource, Shape, load, save_scene,
    show_moment,
};
use glam::DVec3;
use serde_json::json;

#[test]
fn poses_are_those_of_the_moment() {
    let kept = keep("a.glb", &animated().glb());
    let at = |at: Option<f64>| {
        let choice = ModelChoice { at, ..ModelChoice::default() };
        let scene = open(&kept.1, &choice).unwrap();
        let found = meshes(&scene);
        let points = |i: usize| -> Vec<DVec3> {
            let (_, mesh, world) = &found[i];
            mesh.positions.iter().map(|p| world.transform_point3(p.as_dvec3() + mesh.center)).collect()
        };
        (points(0), points(1))
    };
    for (time, weight, z) in [(None, 0.25, 0.0), (Some(0.0), 0.0, 0.0), (Some(0.5), 0.25, 1.0), (Some(9.0), 1.0, 4.0)] {
        let (morphed, skinned) = at(time);
        assert!((morphed[0] - DVec3::new(0.0, 0.0, weight)).length() < 1e-6, "{time:?}: {}", morphed[0]);
        let expected = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, z], [0.0, 1.0, z]].map(DVec3::from);
        for (found, expected) in skinned.iter().zip(expected) {
            assert!((found - expected).length() < 1e-6, "{time:?}: {found} for {expected}");
        }
    }
    let facts = open(&kept.1, &ModelChoice::default()).unwrap().facts.unwrap();
    assert_eq!((facts.animations, facts.animation_length), (vec!["all".to_owned()], Some(2.0)));
    // A time beyond them has no effect of its own, and that is told.
    for (time, is_told) in [(9.0, true), (2.0, false), (0.5, false)] {
        let choice = ModelChoice { at: Some(time), ..ModelChoice::default() };
        let warnings = open(&kept.1, &choice).unwrap().warnings.join("; ");
        assert_eq!(
            warnings.contains(&format!("the animation ends at 2 s: {time} s shows its end")),
            is_told,
            "{warnings}"
        );
    }
}

/// A world that goes from moment to moment is the one that is loaded at the last: nodes, the camera, lights, skins and
/// morph targets. What does not move is left alone.
#[test]
fn a_scene_goes_through_its_animations_without_being_read_again() {
    let mut writer = animated();
    let moves = writer.floats("VEC3", &[0.0, 0.0, 0.0, 4.0, 2.0, 0.0]);
    let turns = writer.floats("VEC4", &[0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0]);
    let times = writer.floats("SCALAR", &[0.0, 2.0]);
    writer.json["cameras"] = json!([{ "type": "perspective", "perspective": { "yfov": 0.8, "znear": 0.1 } }]);
    writer.json["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    writer.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [
        { "type": "spot", "intensity": 5.0, "spot": { "outerConeAngle": 0.5 } },
        { "type": "point", "intensity": 3.0 },
    ] } });
    let nodes = writer.json["nodes"].as_array_mut().unwrap();
    nodes.extend([
        json!({ "name": "carrier", "children": [5, 6, 7] }),
        json!({ "name": "plain", "mesh": 0, "translation": [1, 0, 0] }),
        json!({ "name": "eye", "camera": 0, "translation": [0, 0, 9] }),
        json!({ "name": "spot", "extensions": { "KHR_lights_punctual": { "light": 0 } } }),
        json!({ "name": "still", "mesh": 0, "translation": [7, 0, 0] }),
        json!({ "name": "lamp", "extensions": { "KHR_lights_punctual": { "light": 1 } } }),
    ]);
    writer.json["scenes"] = json!([{ "nodes": [0, 1, 2, 4, 8, 9] }]);
    let animation = &mut writer.json["animations"][0];
    animation["samplers"]
        .as_array_mut()
        .unwrap()
        .extend([json!({ "input": times, "output": moves }), json!({ "input": times, "output": turns })]);
    animation["channels"].as_array_mut().unwrap().extend([
        json!({ "sampler": 2, "target": { "node": 4, "path": "translation" } }),
        json!({ "sampler": 3, "target": { "node": 4, "path": "rotation" } }),
    ]);
    let kept = keep("a.glb", &writer.glb());
    let at = |seconds: f64| {
        let scene = open(&kept.1, &ModelChoice { at: Some(seconds), ..ModelChoice::default() }).unwrap();
        let mut world = bevy_ecs::world::World::new();
        scene.spawn(&mut world);
        (world, scene)
    };
    let (mut world, scene) = at(0.0);
    let still =
        SceneInputs::of(&mut world).objects.iter().find(|it| it.name.as_deref() == Some("still")).unwrap().entity;
    for seconds in [0.5, 1.75, 0.25, 9.0] {
        world.clear_trackers();
        show_moment(&mut world, seconds);
        let touched = world.entity(still).get_ref::<firstlight::scene::Placement>().unwrap();
        assert!(!bevy_ecs::change_detection::DetectChanges::is_changed(&touched));
        let (mut direct, loaded) = at(seconds);
        let (here, there) = (SceneInputs::of(&mut world), SceneInputs::of(&mut direct));
        // Its pivot is the middle of the boxes, of which skins and morph targets have those of the first moment.
        let seen = |inputs: &SceneInputs| {
            inputs.camera.map(|it| (it.view.eye, it.view.forward, it.view.up, it.projection.vfov_deg)).unwrap()
        };
        assert_eq!(seen(&here), seen(&there));
        let lights = |inputs: &SceneInputs| inputs.lights.iter().map(|it| (it.light, it.placement)).collect::<Vec<_>>();
        assert_eq!(lights(&here), lights(&there), "{seconds}");
        // The light that is added is the same at every moment.
        assert_eq!(here.objects.len(), there.objects.len());
        let mut n_meshes = 0;
        for (a, b) in here.objects.iter().zip(&there.objects) {
            let (Shape::Mesh(mesh), Shape::Mesh(other)) = (&a.shape, &b.shape) else {
                assert_eq!((&a.shape, a.placement), (&b.shape, b.placement));
                continue;
            };
            n_meshes += 1;
            assert_eq!((a.placement, &mesh.positions, &mesh.normals), (b.placement, &other.positions, &other.normals));
        }
        assert_eq!(n_meshes, 4);
        // A scene file that is saved of it shows this moment, and goes through the others as well.
        let part = firstlight::scene::Description::of(&mut world, Some(&scene));
        let expected = firstlight::scene::Description::of(&mut direct, Some(&loaded));
        assert_eq!(part.file.objects, expected.file.objects);
        assert_eq!(part.file.animation, expected.file.animation);
        let path = kept.0.path().join("saved.ron");
        save_scene(&mut world, Some(&scene), &path).unwrap();
        let saved = load(&SceneSource::Scene(path), &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
        let mut again = bevy_ecs::world::World::new();
        saved.spawn(&mut again);
        for later in [seconds, 1.25] {
            show_moment(&mut again, later);
            let (mut direct, _) = at(later);
            let (here, there) = (SceneInputs::of(&mut again), SceneInputs::of(&mut direct));
            let eye = |inputs: &SceneInputs| inputs.camera.map(|it| (it.view.eye, it.view.forward, it.view.up));
            assert_eq!((lights(&here), eye(&here)), (lights(&there), eye(&there)), "{seconds} {later}");
            for (a, b) in here.objects.iter().zip(&there.objects) {
                let of = |shape: &Shape| match shape {
                    Shape::Mesh(mesh) => Some(mesh.positions.clone()),
                    _ => None,
                };
                assert_eq!((&a.name, a.placement, of(&a.shape)), (&b.name, b.placement, of(&b.shape)), "{later}");
            }
        }
        // Without touching a world, all but the vertices.
        let (mut base, _) = at(0.0);
        let inputs = SceneInputs::of(&mut base);
        let then = base.resource::<Animation>().inputs_at(&inputs, seconds);
        assert_eq!((lights(&then), seen(&then)), (lights(&there), seen(&there)));
        assert!(then.objects.iter().zip(&there.objects).all(|(a, b)| a.placement == b.placement));
    }
    let animation = world.resource::<Animation>();
    assert_eq!((animation.length(), animation.n_frames()), (2.0, 49));
    assert!(animation.is_moving_during(1.0..=1.1) && !animation.is_moving_during(2.0..=3.0));
    // The stored pose is no moment.
    let stored = open(&kept.1, &ModelChoice::default()).unwrap();
    let mut world = bevy_ecs::world::World::new();
    stored.spawn(&mut world);
    assert!(world.get_resource::<Animation>().is_none());
}

/// A saved scene has its shutter and the same motion blur; the stored pose is at no moment, and that is told.
#[test]
fn a_saved_scene_moves_as_its_model() {
    let kept = keep("a.glb", &animated().glb());
    for (at, shutter) in [(Some(1.0), Some(1.0)), (Some(1.0), None), (None, None)] {
        let scene = open(&kept.1, &ModelChoice { at, shutter, ..ModelChoice::default() }).unwrap();
        let mut world = bevy_ecs::world::World::new();
        scene.spawn(&mut world);
        let path = kept.0.path().join("b.ron");
        let saved = save_scene(&mut world, Some(&scene), &path).unwrap();
        let notes = saved.notes.join("; ");
        assert_eq!(notes.contains("keeps the stored pose of the model, not its animation"), at.is_none(), "{notes}");
        let again = load(&SceneSource::Scene(path), &LoadOptions::default()).unwrap();
        assert!(again.warnings.is_empty(), "{:?}", again.warnings);
        assert_eq!(again.content_fingerprint(), scene.content_fingerprint(), "{at:?} {shutter:?}");
        again.spawn(&mut world);
        let animation = world.get_resource::<Animation>();
        assert_eq!(animation.map(Animation::length), at.map(|_| 2.0));
        assert_eq!(animation.and_then(|it| it.open_shutter(1.0)).is_some(), shutter.is_some());
    }
    // Skins and morph targets of another moment have their trees.
    let path = kept.0.path().join("b.ron");
    let scene = open(&kept.1, &ModelChoice { at: Some(1.0), ..ModelChoice::default() }).unwrap();
    let mut world = bevy_ecs::world::World::new();
    scene.spawn(&mut world);
    let text = save_scene(&mut world, Some(&scene), &path).unwrap().text;
    let choice = ModelChoice { at: Some(0.25), ..ModelChoice::default() };
    let options = LoadOptions { choice: Some(&choice), ..LoadOptions::default() };
    let moved = load(&SceneSource::Scene(path.clone()), &options).unwrap();
    moved.spawn(&mut world);
    let extraction = Extraction::new(&SceneInputs::of(&mut world), &moved.trees);
    assert!(extraction.problems.is_empty(), "{:?}", extraction.problems);
    // Without its file, or with one that places less, it stands still.
    for (from, to, told) in [
        ("model: (\n            file: \"a.glb\"", "model: (\n            file: \"b.glb\"", "b.glb"),
        ("(\"morphed\", 0)", "(\"morphed\", 7)", "fewer objects"),
    ] {
        let changed = text.replace(from, to);
        assert_ne!(changed, text, "{text}");
        std::fs::write(&path, changed).unwrap();
        let again = load(&SceneSource::Scene(path.clone()), &LoadOptions::default()).unwrap();
        let warnings = again.warnings.join("; ");
        assert!(warnings.contains(told) && warnings.contains("its animation is left out"), "{warnings}");
    }
    for (from, to, told) in [
        ("(\"morphed\", 0)", "(\"nobody\", 0)", "there is no object `nobody`"),
        ("(\"morphed\", 0)", "(\"skinned\", 0)", "object `skinned` is listed twice"),
    ] {
        std::fs::write(&path, text.replace(from, to)).unwrap();
        let error = load(&SceneSource::Scene(path.clone()), &LoadOptions::default()).err().unwrap().to_string();
        assert!(error.contains(told), "{error}");
    }
}

/// A file that only moves things is one of those that a scene needs.
#[test]
fn what_moves_other_objects_belongs_to_the_files_of_a_scene() {
    let kept = keep("a.glb", &animated().glb());
    let path = kept.0.path().join("c.ron");
    let text = r#"(
        camera: (eye: (0, 1, 6), look_at: (0, 0, 0)),
        materials: {"m": diffuse(albedo: 0.7)},
        objects: [sphere(name: "ball", center: (0, 0, 0), radius: 1, material: "m")],
        animation: (model: (file: "a.glb", objects: [("ball", 0)])),
    )"#;
    std::fs::write(&path, text).unwrap();
    let scene = load(&SceneSource::Scene(path.clone()), &LoadOptions::default()).unwrap();
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    let names: Vec<String> = scene.read_files().into_iter().map(|read| read.name).collect();
    assert_eq!(names, ["a.glb"]);
    assert_eq!(scene.files(), [kept.1.clone(), path]);
}

/// While the trees of a moment are awaited, no other one takes its place, or none would ever be seen.
#[test]
fn every_moment_that_plays_is_rendered() {
    let n = 40_u32;
    let mut writer = Writer::default();
    let along = (0..n * n).map(|i| (i % n, i / n));
    let flat: Vec<f32> = along.clone().flat_map(|(x, y)| [x as f32, y as f32, 0.0]).collect();
    let lift: Vec<f32> = along.clone().flat_map(|(x, y)| [0.0, 0.0, (x * y) as f32 / 100.0]).collect();
    let inner = along.filter(|(x, y)| x + 1 < n && y + 1 < n);
    let corners: Vec<u32> = inner.flat_map(|(x, y)| [0, 1, n + 1, 0, n + 1, n].map(|step| y * n + x + step)).collect();
    let (flat, lift, corners) =
        (writer.floats("VEC3", &flat), writer.floats("VEC3", &lift), writer.indices(5125, &corners));
    let targets = json!([{ "POSITION": lift }]);
    writer.mesh(json!({ "attributes": { "POSITION": flat }, "indices": corners, "targets": targets }));
    writer.json["nodes"] = json!([{ "name": "sheet", "mesh": 0 }]);
    writer.json["scenes"] = json!([{ "nodes": [0] }]);
    let times = writer.floats("SCALAR", &[0.0, 4.0]);
    let weights = writer.floats("SCALAR", &[0.0, 1.0]);
    writer.json["animations"] = json!([{ "samplers": [{ "input": times, "output": weights }], "channels": [
        { "sampler": 0, "target": { "node": 0, "path": "weights" } },
    ] }]);
    let kept = keep("sheet.glb", &writer.glb());
    let mut session = Session::new(SessionOptions { width: 8, height: 8, ..SessionOptions::default() }).unwrap();
    session.adopt(open(&kept.1, &ModelChoice { at: Some(0.0), ..ModelChoice::default() }).unwrap());
    let start = std::time::Instant::now();
    let frame = |session: &mut Session| {
        session.update(start.elapsed());
        assert!(start.elapsed().as_secs() < 300, "{:?}", session.status());
    };
    while session.status().spp == 0 {
        frame(&mut session);
    }
    let restarts = session.status().restarts;
    let (mut n_moments, mut shown) = (0, 0.0);
    while session.status().restarts < restarts + 20 {
        session.send(Command::AdvanceMoment { seconds: 1.0 / 24.0 });
        frame(&mut session);
        let moment = session.world().resource::<Moment>().0;
        n_moments += u64::from(moment != shown);
        shown = moment;
    }
    // The last one may be awaited.
    assert!((20..=21).contains(&n_moments), "{n_moments}");
}
