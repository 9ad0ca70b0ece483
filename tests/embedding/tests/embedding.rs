//! firstlight within a program of somebody else, which `scripts/test` compiles without optimisation, too, as programs are
//! while they are written.
//!
//! Without optimisation the stack frames of the kernels are many times as large. A worker whose stack is too small ends
//! the whole program, and with it these tests.

use firstlight::frame::render_offline;
use firstlight::prelude::*;
use firstlight::render::{Film, InstructionSet, RenderSettings, worker_threads};
use firstlight::scene::{Extraction, LoadOptions, SceneInputs, load};
use std::time::{Duration, Instant};

/// Diffuse, mirror and smooth glass with paths from the lights; a wide lens.
const SCENES: [&str; 3] = ["cornell", "cornell-balls", "dof-balls"];

/// All other materials, one on each sphere.
const MATERIALS: &str = r#"(
    camera: (eye: (0, 1, 12), look_at: (0, 1, 0), vfov: 35),
    environment: gradient(zenith: 1, horizon: 0.5, ground: 0.2),
    textures: { "tiles": checker(a: 0.8, b: 0.1) },
    materials: {
        "floor": diffuse(albedo: "tiles"),
        "rough": rough_glass(ior: 1.5, alpha: 0.2),
        "metal": metal(reflectance: (0.9, 0.7, 0.3), alpha: 0.2),
        "layered": principled(base_color: (0.6, 0.2, 0.1), clearcoat: 1, sheen_color: 0.5),
        "blend": blend(weight: 0.5, a: "metal", b: "floor"),
        "light": emissive(radiance: 10),
    },
    objects: [
        plane(material: "floor"),
        sphere(center: (-3, 1, 0), radius: 1, material: "rough"),
        sphere(center: (-1, 1, 0), radius: 1, material: "metal"),
        sphere(center: (1, 1, 0), radius: 1, material: "layered"),
        sphere(center: (3, 1, 0), radius: 1, material: "blend"),
        quad(corner: (-1, 5, -1), edge_u: (2, 0, 0), edge_v: (0, 0, 2), material: "light"),
    ],
)"#;

fn options(integrator: Integrator) -> RenderOptions {
    RenderOptions::default().size(40, 32).spp(2).threads(2).integrator(integrator)
}

#[test]
fn scenes_render_with_either_integrator() {
    let mut scenes: Vec<Scene> = SCENES.map(|name| Scene::open(name).expect("a built-in scene")).into();
    let path = std::env::temp_dir().join(format!("firstlight-embedding-{}.ron", std::process::id()));
    std::fs::write(&path, MATERIALS).expect("a scene file");
    scenes.push(Scene::open(&path).unwrap_or_else(|error| panic!("{error}")));
    std::fs::remove_file(&path).expect("the scene file");
    for (i, scene) in scenes.iter().enumerate() {
        for integrator in [Integrator::Path, Integrator::Phong] {
            let image = scene.render(&options(integrator)).unwrap_or_else(|error| panic!("{error}"));
            assert!(image.spp() == 2 && image.pixels().iter().any(|value| *value > 0.0), "scene {i}, {integrator:?}");
        }
    }
}

/// So that the next kernel has room too: the workers get half the stack that they have in programs, with every
/// instruction set of this processor.
#[test]
fn half_of_the_stack_is_enough() {
    for name in SCENES {
        let source = SceneSource::parse(name).expect("a built-in scene");
        let loaded = load(&source, &LoadOptions::default()).expect("a built-in scene");
        let mut world = World::new();
        loaded.spawn(&mut world);
        let extraction = Extraction::new(&SceneInputs::of(&mut world), &loaded.trees);
        let pool = worker_threads().num_threads(2).stack_size(16 << 20).build().expect("two threads");
        let target = Target { spp: Some(2), ..Target::default() };
        for set in InstructionSet::available() {
            let settings = RenderSettings { simd: Some(set), ..world.resource::<Rendering>().0 };
            let mut film = Film::new(40, 32);
            pool.install(|| render_offline(&extraction.prepared, &settings, &mut film, target, |_| true));
            assert_eq!(film.spp(), 2, "{name} with {set:?}");
        }
    }
}

/// An embedder needs no `bevy_ecs` of its own for components and resources.
#[derive(Resource)]
struct Steps(u32);

fn count(mut steps: ResMut<Steps>, lights: Query<&PointLight>) {
    steps.0 += 1 + lights.iter().count() as u32;
}

#[test]
fn a_session_renders_and_runs_systems() {
    let target = Target { spp: Some(2), ..Target::default() };
    let options = SessionOptions { width: 40, height: 32, threads: Some(2), target, ..SessionOptions::default() };
    let mut session = Session::new(options).expect("a session");
    session.open(SceneSource::parse("cornell-balls").expect("a built-in scene"));
    session.world_mut().insert_resource(Steps(0));
    session.add_systems(count.in_set(Stage::Edit));
    let start = Instant::now();
    while !session.status().done {
        assert!(start.elapsed() < Duration::from_secs(300), "{:?}", session.status());
        session.update(start.elapsed());
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(session.world().resource::<Steps>().0 > 0);
}
