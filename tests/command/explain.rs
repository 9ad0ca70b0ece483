//! Explanations of pixels, held against the film that they explain, and against light that can be told on paper.

use crate::common::*;
use crate::program::{Outcome, does, program};
use firstlight::frame::{Command, Explaining, Session, SessionOptions, Target};
use firstlight::render::{
    DeltaLight, Environment, Film, FoundBy, Integrator, LightSource, Place, Prepared, RenderSettings, advance, explain,
    light_traced, replay_sample,
};
use firstlight::scene::{Extraction, LoadOptions, Rendering, SceneInputs, SceneSource, load};
use glam::{DVec3, UVec2, Vec3};
use std::time::{Duration, Instant};

const NEVER: fn() -> bool = || false;

/// A built-in scene as the renderer sees it.
fn builtin(name: &str) -> (Prepared, RenderSettings) {
    let scene = load(&SceneSource::Builtin(name.to_owned()), &LoadOptions::default()).unwrap();
    let mut world = bevy_ecs::world::World::new();
    scene.spawn(&mut world);
    let extraction = Extraction::new(&SceneInputs::of(&mut world), &scene.trees);
    (extraction.prepared, world.resource::<Rendering>().0)
}

#[test]
fn an_explanation_has_the_samples_of_the_film_and_its_parts_add_up() {
    let size = UVec2::new(40, 32);
    let mut n_asked = 0;
    // A light alone; with caustics; through a lens; under a sky, with metals and blends; several lights.
    for name in ["cornell", "cornell-balls", "dof-balls", "gallery", "veach-mis"] {
        let (scene, of_scene) = builtin(name);
        for simd in [of_scene.simd, None] {
            let settings = RenderSettings { seed: 3, integrator: Integrator::Path, simd, ..of_scene };
            let n = if simd.is_some() { 16 } else { 4 };
            let mut film = Film::new(size.x, size.y);
            assert!(advance(&scene, &settings, &mut film, n, &NEVER).completed);
            for pixel in [(3, 3), (20, 16), (12, 25), (31, 27), (39, 31), (20, 2)].map(UVec2::from) {
                let told = explain(&scene, &settings, size, pixel, 0..n).unwrap();
                let at = format!("{name}, {pixel}, lanes {}", simd.is_some());
                for path in &told.paths {
                    let bad = firstlight::render::BadSample { x: pixel.x, y: pixel.y, sample: path.sample };
                    assert_eq!(path.radiance, replay_sample(&scene, &settings, size, bad), "{at}");
                    let parts: DVec3 = (path.vertices.iter())
                        .map(|vertex| vertex.radiance + vertex.asked.map_or(DVec3::ZERO, |asked| asked.radiance))
                        .sum();
                    assert!((parts - path.radiance.as_dvec3()).abs().max_element() < 1e-12, "{at}: {path:?}");
                    n_asked += path.vertices.iter().filter(|vertex| vertex.asked.is_some()).count();
                    let rim = |asked: firstlight::render::Asked| asked.source == LightSource::Rim;
                    assert!(!path.vertices.iter().any(|vertex| vertex.asked.is_some_and(rim)), "{at}: {path:?}");
                }
                let light_traced = film.light_traced(pixel.x, pixel.y);
                let whole = (told.mean() + light_traced).as_vec3();
                assert_eq!(
                    whole.to_array().map(f32::to_bits),
                    film.mean(pixel.x, pixel.y).to_array().map(f32::to_bits)
                );
                let sum: DVec3 = told.contributions().iter().map(|part| part.radiance).sum();
                assert!((sum - told.mean()).abs().max_element() <= 1e-14 * told.mean().max_element(), "{at}: {sum}");
            }
            if simd.is_some() {
                let pixel = UVec2::new(20, 25);
                let alone = light_traced(&scene, &settings, size, pixel, 0..n, &NEVER).unwrap();
                assert_eq!(alone, film.light_traced(pixel.x, pixel.y), "{name}");
            }
        }
    }
    assert!(n_asked > 300, "{n_asked} lamps were asked");
}

#[test]
fn a_white_ball_under_a_sky_gets_all_of_its_light_from_one_bounce() {
    let camera = camera(Vec3::Z * 4.0, Vec3::ZERO, 40.0);
    let sky = Environment::Constant(Vec3::splat(0.5));
    let ball = scene(vec![(sphere(Vec3::ZERO, 1.0), 0)], vec![diffuse(0.8)], sky, camera);
    let (size, settings) = (UVec2::new(31, 31), RenderSettings::default());
    let told = explain(&ball, &settings, size, UVec2::new(15, 15), 5..69).unwrap();
    let [part] = told.contributions()[..] else { panic!("{:?}", told.contributions()) };
    assert_eq!((part.source, part.bounces), (LightSource::Sky, 1));
    assert!((part.radiance - DVec3::splat(0.8 * 0.5)).abs().max_element() < 1e-6, "{part:?}");
    assert!(told.deviation().max_element() < 1e-7, "a constant sky has no noise: {}", told.deviation());
    assert_eq!(told.paths[0].sample, 5);
    for path in &told.paths {
        let [first, second] = &path.vertices[..] else { panic!("{path:?}") };
        let Place::Surface { position, object: 0 } = first.place else { panic!("{first:?}") };
        assert!((position.length() - 1.0).abs() < 1e-5 && position.z > 0.9);
        assert!(matches!(second.place, Place::Sky { direction } if direction.dot(position) > -1e-3), "{second:?}");
    }
    // Beside it there is nothing but sky.
    let told = explain(&ball, &settings, size, UVec2::ZERO, 0..8).unwrap();
    let [part] = told.contributions()[..] else { panic!("{:?}", told.contributions()) };
    assert_eq!((part.source, part.bounces, part.found_by), (LightSource::Sky, 0, FoundBy::Itself));
    assert_eq!(part.radiance, DVec3::splat(0.5));
}

#[test]
fn lights_are_told_apart_and_one_behind_a_wall_brings_nothing() {
    let camera = camera(Vec3::new(0.0, 1.0, 5.0), Vec3::new(0.0, 0.0, 0.0), 30.0);
    let shapes = vec![
        (plane(Vec3::ZERO, Vec3::Y), 0),
        (quad(Vec3::new(-2.0, 3.0, -1.0), Vec3::X, Vec3::Z), 1),
        (sphere(Vec3::new(1.5, 3.0, 0.0), 0.3), 1),
        // The light in the box of the wall is the third light.
        (sphere(Vec3::new(0.0, 3.0, 0.0), 0.2), 1),
        (sphere(Vec3::new(0.0, 3.0, 0.0), 0.5), 2),
    ];
    let black = diffuse(0.0);
    let room = scene(shapes, vec![diffuse(0.5), emissive(9.0), black], Environment::Black, camera);
    let settings = RenderSettings { max_depth: 3, ..RenderSettings::default() };
    let told = explain(&room, &settings, UVec2::splat(16), UVec2::new(8, 10), 0..256).unwrap();
    let sources: std::collections::BTreeSet<LightSource> =
        told.contributions().iter().map(|part| part.source).collect();
    assert_eq!(sources, [LightSource::Object(1), LightSource::Object(2)].into());
    // Each alone gives what its row says.
    let both: DVec3 = told.contributions().iter().map(|part| part.radiance).sum();
    assert!((both - told.mean()).length() < 1e-12);
    for path in &told.paths {
        for asked in path.vertices.iter().filter_map(|vertex| vertex.asked) {
            let Place::Surface { position, object } = asked.place else { panic!("{asked:?}") };
            assert_eq!(asked.source, LightSource::Object(object));
            let on_ball = ((position - Vec3::new(1.5, 3.0, 0.0)).length() - 0.3).abs() < 1e-4;
            let on_quad = (position.y - 3.0).abs() < 1e-4 && (-2.0..=-1.0).contains(&position.x);
            assert_eq!((on_ball, on_quad), (object == 2, object == 1), "{asked:?}");
        }
    }
}

#[test]
fn lights_without_size_are_told_apart() {
    let camera = camera(Vec3::new(0.0, 1.0, 5.0), Vec3::ZERO, 30.0);
    let (at, direction) = (Vec3::new(1.0, 2.0, 0.5), Vec3::new(0.3, -1.0, 0.2).normalize());
    let (intensity, irradiance) = (Vec3::splat(4.0), Vec3::ONE);
    let shapes = vec![(plane(Vec3::ZERO, Vec3::Y), 0), (sphere(Vec3::new(-1.0, 2.0, 0.0), 0.2), 1)];
    let room = scene(shapes, vec![diffuse(0.5), emissive(9.0)], Environment::Black, camera);
    let beside = DeltaLight::Point { position: at + Vec3::X, intensity };
    let lights =
        [beside, DeltaLight::Point { position: at, intensity }, DeltaLight::Directional { direction, irradiance }];
    let room = with_lights(&room, lights.to_vec());
    let settings = RenderSettings { max_depth: 2, ..RenderSettings::default() };
    let told = explain(&room, &settings, UVec2::splat(16), UVec2::new(8, 10), 0..256).unwrap();
    let sources: std::collections::BTreeSet<LightSource> =
        told.contributions().iter().map(|part| part.source).collect();
    assert_eq!(
        sources,
        [LightSource::Object(1), LightSource::Delta(0), LightSource::Delta(1), LightSource::Delta(2)].into()
    );
    for asked in told.paths.iter().flat_map(|path| &path.vertices).filter_map(|vertex| vertex.asked) {
        match asked.source {
            LightSource::Delta(2) => assert_eq!(asked.place, Place::Sky { direction: -direction }),
            LightSource::Delta(i) => {
                let Place::Light { position, light } = asked.place else { panic!("{asked:?}") };
                let expected = if i == 0 { at + Vec3::X } else { at };
                assert!(light == i && (position - expected).length() < 1e-4, "{asked:?}");
            }
            _ => assert_eq!(asked.source, LightSource::Object(1)),
        }
    }
}

#[test]
fn the_classic_model_has_no_paths() {
    let (scene, of_scene) = builtin("cornell");
    let settings = RenderSettings { integrator: Integrator::Phong, ..of_scene };
    assert!(explain(&scene, &settings, UVec2::splat(8), UVec2::ONE, 0..4).is_none());
}

#[test]
fn a_session_tells_the_story_of_a_pixel_with_names_and_keeps_it_while_the_camera_moves() {
    let mut session = Session::new(SessionOptions {
        width: 48,
        height: 48,
        threads: Some(2),
        target: Target { spp: Some(64), ..Target::default() },
        ..SessionOptions::default()
    })
    .unwrap();
    session.open(SceneSource::Builtin("cornell-balls".to_owned()));
    let start = Instant::now();
    let run_until = |session: &mut Session, done: &dyn Fn(&Session) -> bool| {
        session.update(start.elapsed());
        while !done(session) {
            assert!(start.elapsed() < Duration::from_secs(120), "nothing came: {:?}", session.status());
            std::thread::sleep(Duration::from_millis(2));
            session.update(start.elapsed());
        }
    };
    // Asked before there is a picture, it waits for one.
    session.send(Command::ExplainAt { x: 0.5, y: 0.9 });
    run_until(&mut session, &|session| session.status().done && session.is_idle());
    session.send(Command::ExplainAt { x: 0.5, y: 0.9 });
    run_until(&mut session, &|session| session.is_idle());
    let story = session.world().resource::<Explaining>().story.clone().expect("it was asked for");
    assert_eq!((story.pixel, story.samples.clone(), story.ways.len()), (UVec2::new(24, 43), 0..64, 64));
    let film = session.film_snapshot().unwrap();
    assert_eq!(story.total().as_vec3(), film.mean(24, 43), "all samples that the picture has");
    assert!(story.lights.iter().any(|light| light.name.contains("lamp") || light.name.contains("light")));
    let by_light: DVec3 = story.lights.iter().map(|light| light.total()).sum();
    let by_bounces: DVec3 = story.by_bounces.iter().sum();
    for sum in [by_light, by_bounces, story.by_itself + story.by_asking, story.parts().iter().sum()] {
        assert!((sum - story.mean).abs().max_element() < 1e-12, "{sum} {}", story.mean);
    }
    session.send(Command::Orbit { yaw_deg: 5.0, pitch_deg: 0.0 });
    run_until(&mut session, &|session| session.status().restarts > 1 && session.status().done && session.is_idle());
    assert_eq!(session.world().resource::<Explaining>().story.as_ref(), Some(&story));
    session.send(Command::ForgetExplanation);
    run_until(&mut session, &|session| session.is_idle());
    assert_eq!(session.world().resource::<Explaining>().story, None);
}

#[test]
fn the_program_explains_a_pixel() {
    let folder = tempfile::tempdir().unwrap();
    let run = |args: &[&str]| {
        let outcome = Outcome::of(program(folder.path()).arg("explain").args(args));
        (outcome.status, outcome.out().to_owned(), outcome.err)
    };
    let scene = ["cornell", "--size", "64x48", "--pixel", "32,40", "--spp", "16"];
    let (code, text, errors) = run(&scene);
    assert_eq!(code, Some(0), "{errors}");
    for word in ["pixel 32,40 of 64 x 48", "samples 0 to 15", "visible", "direct", "indirect", "by bounces", "100.0 %"]
    {
        assert!(text.contains(word), "{word}: {text}");
    }
    let (_, text, _) = run(&["cornell", "--size", "64x48", "--pixel", "20,45", "--spp", "4"]);
    assert!(text.contains("shows        `floor`, material `") && text.contains(", front\n"), "{text}");
    assert!(text.contains(", normal (0, 1, 0)") && !text.contains("no light"), "{text}");
    let (_, text, _) = run(&[&scene[..], &["--json"]].concat());
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let numbers = |value: &serde_json::Value| -> Vec<f64> {
        value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
    };
    let total = numbers(&json["radiance"]);
    let lights = json["lights"].as_array().unwrap();
    let lamps = numbers(&json["by_paths_from_the_lamps"]);
    for channel in 0..3 {
        let sum: f64 = lights.iter().map(|light| numbers(&light["radiance"])[channel]).sum();
        assert!((sum + lamps[channel] - total[channel]).abs() < 1e-12 && total[channel] > 0.0, "{json}");
    }
    assert_eq!(json["paths"].as_array().unwrap().len(), 16);
    let (code, _, errors) = run(&["cornell", "--size", "64x48", "--pixel", "64,0"]);
    assert!(code == Some(2) && errors.contains("the last pixel is 63,47"), "{code:?} {errors}");
    let (code, _, errors) = run(&["cornell", "--pixel", "middle"]);
    assert!(code == Some(2) && errors.contains("X,Y"), "{code:?} {errors}");
}

/// A closed box that is seen from within, as a model of a room whose lamps are missing.
#[test]
fn a_black_pixel_is_named_and_told_to_be_unlit() {
    let folder = tempfile::tempdir().unwrap();
    let scene = r#"(
        camera: (eye: (0, 0, 3), look_at: (0, 0, 0), vfov: 40), film: (width: 16, height: 16), environment: constant(1),
        materials: { "paint": diffuse(albedo: 0.8) },
        objects: [sphere(name: "shell", center: (0, 0, 0), radius: 4, material: "paint")],
    )"#;
    std::fs::write(folder.path().join("closed.ron"), scene).unwrap();
    let outcome = does(folder.path(), "explain closed.ron --pixel 8,8 --spp 8");
    let text = outcome.out();
    for expected in
        ["`shell`, material `paint`, back", "at           7 m, ", "no light reaches it: none of 8 samples found any"]
    {
        assert!(text.contains(expected), "{expected}: {text}");
    }
}
