//! Scenes of Tungsten, written here: against the same scene of our own, and against closed forms.

use bevy_ecs::prelude::World;
use firstlight::render::{Film, Material, advance};
use firstlight::scene::file::{LightPart, ObjectPart, SceneFile};
use firstlight::scene::{
    ColorValue, EnvironmentSource, Extraction, LoadOptions, LoadedScene, MeshSource, Rendering, Rgb, SceneInputs,
    SceneSource, load,
};
use glam::{DVec3, Vec3};
use std::f32::consts::PI;
use std::path::Path;
use tempfile::TempDir;

const VIEW: &str = r#""camera": {"resolution": [40, 20], "fov": 90,
    "transform": {"position": [0, 0, 4], "look_at": [0, 0, 0], "up": [0, 1, 0]}}, "integrator": {"max_bounces": 6}"#;

fn opened(path: &Path) -> LoadedScene {
    load(&SceneSource::parse(path).unwrap(), &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// A scene of these BSDFs and primitives, in a folder of its own.
fn with(bsdfs: &str, primitives: &str) -> (TempDir, LoadedScene) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.json");
    let text = format!("{{{VIEW}, \"bsdfs\": [{bsdfs}], \"primitives\": [{primitives}]}}");
    std::fs::write(&path, text).unwrap();
    let scene = opened(&path);
    (folder, scene)
}

fn told(scene: &LoadedScene) -> Vec<String> {
    scene.warnings.iter().map(ToString::to_string).collect()
}

fn material(scene: &LoadedScene, name: &str) -> Material<firstlight::scene::file::InFile> {
    scene.file.materials.get(name).unwrap_or_else(|| panic!("{name} of {:?}", scene.file.materials)).clone()
}

#[test]
fn every_part_becomes_the_one_that_is_meant() {
    let (_folder, scene) = with(
        r#"{"name": "grey", "type": "lambert", "albedo": 0.25}"#,
        r#"{"name": "ball", "type": "sphere", "transform": {"position": [1, 2, 3], "scale": 0.5}, "bsdf": "grey"},
        {"type": "quad", "transform": {"position": [0, 1, 0], "scale": [4, 1, 6]}, "bsdf": "grey"},
        {"name": "light", "type": "quad", "transform": {"position": [0, 5, 0], "scale": 2, "rotation": [0, 0, 180]},
            "emission": [4, 2, 1], "bsdf": {"type": "null"}},
        {"type": "infinite_sphere", "emission": 0.125},
        {"name": "lamp", "type": "point", "transform": {"position": [1, 2, 3]}, "emission": 2}"#,
    );
    assert_eq!(told(&scene), [""; 0]);
    // A field of view of 90° along x is one of 2 atan(1/2) along y at twice the width.
    let vfov = 2.0 * 0.5_f64.atan().to_degrees();
    let ours = format!(
        r#"(
        camera: (eye: (0, 0, 4), forward: (0, 0, -1), up: (0, 1, 0), vfov: {vfov:?}),
        film: (width: 40, height: 20, filter: tent),
        max_depth: 7,
        environment: constant(0.125),
        materials: {{ "grey": diffuse(albedo: 0.25), "light": emissive(radiance: (4, 2, 1)),
            "BSDF": diffuse(albedo: 0) }},
        objects: [
            sphere(name: "ball", center: (1, 2, 3), radius: 0.5, material: "grey"),
            quad(name: "grey", corner: (-2, 1, -3), edge_u: (0, 0, 6), edge_v: (4, 0, 0), material: "grey"),
            quad(name: "light", corner: (1, 5, -1), edge_u: (0, 0, 2), edge_v: (-2, 0, 0), material: "light"),
        ],
        lights: [point(name: "lamp", position: (1, 2, 3), intensity: 2, radius: 0)],
    )"#
    );
    let mut ours = SceneFile::parse(&ours, "ours.ron").unwrap_or_else(|error| panic!("{error}"));
    let mut file = scene.file.clone();
    // The point about which the view orbits is no part of the image.
    file.camera.pivot_distance = None;
    // A rotation by half a turn is one to the last digit of its sine.
    for (theirs, ours) in file.objects.iter_mut().zip(&mut ours.objects) {
        if let (
            ObjectPart::Quad { corner: a, edge_u: b, edge_v: c, .. },
            ObjectPart::Quad { corner: d, edge_u: e, edge_v: f, .. },
        ) = (theirs, ours)
        {
            assert!([(*a, *d), (*b, *e), (*c, *f)].iter().all(|(a, b)| a.abs_diff_eq(*b, 1e-12)), "{a} {b} {c}");
            (*a, *b, *c) = (*d, *e, *f);
        }
    }
    file.materials.0.sort_keys();
    ours.materials.0.sort_keys();
    assert_eq!(file, ours);
}

#[test]
fn meshes_are_where_and_as_large_as_the_scene_says() {
    let (folder, _) = with("", r#"{"type": "infinite_sphere", "emission": 1}"#);
    let square = include_bytes!("../../fuzz/seeds/tungsten/square.wo3");
    std::fs::write(folder.path().join("square.wo3"), square).unwrap();
    let path = folder.path().join("b.json");
    let text = r#"{"bsdfs": [{"name": "a", "type": "lambert"}, {"name": "b", "type": "mirror"}], "primitives": [
        {"type": "mesh", "file": "square.wo3", "smooth": true, "bsdf": ["a", "b"], "transform": {"scale": 3}},
        {"type": "mesh", "file": "square.wo3", "bsdf": "a", "power": 18, "transform": {"scale": [2, 3, 1]}},
        {"type": "cube", "transform": {"position": [5, 0, 0], "scale": [1, 2, 3]}},
        {"type": "mesh", "file": "gone.wo3"},
        {"type": "cylinder"}, {"type": "disk"}]}"#;
    std::fs::write(&path, text).unwrap();
    let scene = opened(&path);
    let places: Vec<(String, Option<Vec<String>>)> = (scene.file.objects.iter())
        .map(|object| match object {
            ObjectPart::Mesh { name, materials, .. } => (name.clone().unwrap(), materials.clone()),
            other => panic!("{other:?}"),
        })
        .collect();
    let both = Some(vec!["a".to_owned(), "b".to_owned()]);
    let names: Vec<&str> = places.iter().map(|(name, _)| &**name).collect();
    assert_eq!(names, ["square", "square", "cube", "cylinder", "disk"]);
    assert_eq!(places[0].1, both);
    let Material::Emissive { radiance } = material(&scene, "mesh") else { panic!() };
    let ColorValue::Rgb(radiance) = radiance else { panic!() };
    assert!((radiance - 18.0 / (6.0 * PI)).abs().max_element() < 1e-6, "of 6 m²: {radiance}");
    let told = told(&scene);
    assert!(told.iter().any(|it| it.contains("gone.wo3") && it.contains("left out")), "{told:?}");
}

#[test]
fn materials_are_what_they_stand_for() {
    let (_folder, scene) = with(
        r#"{"name": "mixed", "type": "mixed", "bsdf0": "a", "bsdf1": "b", "ratio": 0.25},
        {"name": "a", "type": "plastic", "ior": 1.4, "albedo": [0.5, 0.25, 0.125]}, {"name": "b", "type": "conductor"},
        {"name": "lace", "type": "transparency", "base": "a", "alpha": 0.5},
        {"name": "bottle", "type": "dielectric", "ior": 1.4, "albedo": [0.5, 0.25, 0.125]},
        {"name": "leaf", "type": "diffuse_transmission", "albedo": 0.5, "transmittance": 0.25},
        {"name": "loop", "type": "mixed", "bsdf0": "loop", "bsdf1": "a"}"#,
        r#"{"type": "quad", "bsdf": "mixed"}, {"type": "quad", "bsdf": "lace"}, {"type": "quad", "bsdf": "leaf"},
        {"type": "quad", "bsdf": "bottle"}, {"type": "quad", "bsdf": "loop"}, {"type": "quad", "bsdf": "gone"}, {"type": "quad", "bsdf": {"type": "forward"}},
        {"type": "infinite_sphere_cap", "cap_angle": 1, "power": 2}"#,
    );
    // The ratio is the share of the first, ours that of the second.
    let expected = Material::blend(0.25.into(), "b".to_owned(), "a".to_owned());
    assert_eq!(material(&scene, "mixed"), expected);
    let Material::Principled { base_color, specular_color, transmission, ior, .. } = material(&scene, "bottle") else {
        panic!()
    };
    let amber = ColorValue::rgb(0.5, 0.25, 0.125);
    assert_eq!((base_color, specular_color, transmission, ior), (amber.clone(), amber, 1.0.into(), 1.4));
    assert_eq!(scene.file.objects.len(), 6, "light passes a forward BSDF");
    let Material::Blend { opacity, .. } = material(&scene, "lace") else { panic!() };
    assert_eq!(opacity, 0.5.into());
    let Material::Translucent { reflectance, transmittance } = material(&scene, "leaf") else { panic!() };
    assert_eq!((reflectance, transmittance), (ColorValue::grey(0.375), ColorValue::grey(0.125)));
    let [LightPart::Directional { direction, irradiance: Rgb(irradiance), .. }] = &scene.file.lights[..] else {
        panic!("{:?}", scene.file.lights)
    };
    assert_eq!(*direction, DVec3::NEG_Y);
    assert!((irradiance.x - 2.0).abs() < 1e-3, "all of its power over 1 m²: {irradiance}");
    let told = told(&scene);
    for part in ["there is no BSDF `gone`", "nested more than 16 deep", "its shadows are sharp"] {
        assert!(told.iter().any(|it| it.contains(part)), "{part}: {told:?}");
    }
}

#[test]
fn an_environment_image_is_where_it_was() {
    let folder = tempfile::tempdir().unwrap();
    // The column in the middle, from +X toward +Z, is red.
    let image =
        image::Rgb32FImage::from_fn(8, 4, |x, _| image::Rgb(if x == 4 { [2.0, 0.0, 0.0] } else { [0.0, 0.0, 1.0] }));
    image.save(folder.path().join("sky.exr")).unwrap();
    let seen = |toward: DVec3, rotation: &str| {
        let path = folder.path().join("a.json");
        let text = format!(
            r#"{{"camera": {{"resolution": 1, "fov": 1, "transform": {{"look_at": [{}, {}, {}]}}}},
            "primitives": [{{"type": "infinite_sphere", "emission": "sky.exr", "transform": {{"rotation": {rotation}}}}}]}}"#,
            toward.x, toward.y, toward.z
        );
        std::fs::write(&path, text).unwrap();
        let scene = opened(&path);
        assert!(matches!(scene.file.environment, EnvironmentSource::Image { .. }) && scene.file.textures.is_empty());
        let mut world = World::new();
        scene.spawn(&mut world);
        let extraction = Extraction::new(&SceneInputs::of(&mut world), &scene.trees);
        let mut film = Film::new(1, 1);
        advance(&extraction.prepared, &world.resource::<Rendering>().0, &mut film, 16, &|| false);
        film.means()[0]
    };
    let at = |turns: f64| {
        let (sin, cos) = (std::f64::consts::TAU * turns).sin_cos();
        DVec3::new(cos, 0.0, sin)
    };
    let (red, blue) = (Vec3::new(2.0, 0.0, 0.0), Vec3::Z);
    for (turns, color) in [(0.0625, red), (-0.0625, blue), (0.1875, blue), (0.5, blue)] {
        assert!((seen(at(turns), "0") - color).abs().max_element() < 0.02, "{turns}: {}", seen(at(turns), "0"));
    }
    // Turned by a quarter about Y, as Tungsten turns it: +X becomes +Z.
    assert!((seen(at(0.3125), "[0, 90, 0]") - red).abs().max_element() < 0.02, "{}", seen(at(0.3125), "[0, 90, 0]"));
}

/// Everything of the seed of the fuzz target, and what is wrong with others.
#[test]
fn what_is_not_modelled_is_told_and_what_is_no_scene_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("room.json");
    let room = include_str!("../../fuzz/seeds/tungsten/room.json");
    std::fs::write(&path, room).unwrap();
    let scene = opened(&path);
    let said = told(&scene);
    for part in ["none.wo3", "curves", "coats are not modelled", "its shadows are sharp", "none.png"] {
        assert!(said.iter().any(|it| it.contains(part)), "{part}: {said:#?}");
    }
    std::fs::write(&path, room.replace("\"scale\": 4", "\"scale\": \"big\"").replace("\"fov\": 50", "\"fov\": []"))
        .unwrap();
    let said = told(&opened(&path));
    for part in ["`transform` is no transform", "`fov` is not a number"] {
        assert!(said.iter().any(|it| it.contains(part)), "{part}: {said:#?}");
    }
    for (text, part) in [
        ("{\n \"primitives\": [}", "room.json:2:17: is not JSON: expected value"),
        ("[1]", "is no scene of Tungsten"),
        ("{\"primitives\": []}", "has no primitive that can be shown"),
        (&format!("{{\"primitives\": [{}1]}}", "1,".repeat(1 << 20)), "has more than 1048576 primitives"),
    ] {
        std::fs::write(&path, text).unwrap();
        let error = load(&SceneSource::parse(&path).unwrap(), &LoadOptions::default()).err().unwrap().to_string();
        assert!(error.contains(part), "{part}: {error}");
    }
}

#[test]
fn what_has_no_name_is_told_as_what_it_is() {
    let (_folder, scene) = with("", r#"{"type": ""}, {"name": "", "type": "flame"}, {"type": "sphere"}"#);
    let told = told(&scene);
    assert!(told.iter().any(|it| it.ends_with("`primitive`: a primitive without a `type` is left out")), "{told:?}");
    assert!(told.iter().any(|it| it.contains("`flame`: primitives of the kind `flame`")), "{told:?}");
    assert!(!told.iter().any(|it| it.contains("``")), "{told:?}");
}

#[test]
fn a_damaged_mesh_that_a_scene_of_ours_names_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("bad.wo3", "no mesh");
    write("a.json", r#"{"primitives": [{"type": "mesh", "file": "bad.wo3"}, {"type": "sphere"}]}"#);
    let mesh = r#"mesh(source: part(file: "a.json", shape: 0), material: "m")"#;
    let materials = r#"materials: {"m": diffuse(albedo: 0.5)}"#;
    write("a.ron", &format!("(camera: (eye: (0, 0, 5), look_at: (0, 0, 0)), {materials}, objects: [{mesh}])"));
    let path = folder.path().join("a.ron");
    let error = load(&SceneSource::Scene(path), &LoadOptions::default()).err().unwrap().to_string();
    assert!(error.contains("bad.wo3: the mesh of shape 0 of this scene cannot be read"), "{error}");
}

/// A saved scene names a mesh by its number, which is the same whether or not others may be read.
#[test]
fn a_mesh_has_its_number_whatever_must_not_be_read() {
    let folder = tempfile::tempdir().unwrap();
    let square = include_bytes!("../../fuzz/seeds/tungsten/square.wo3");
    std::fs::write(folder.path().join("square.wo3"), square).unwrap();
    let number = |first: &str| {
        let path = folder.path().join("a.json");
        let mesh = |file: &str| format!("{{\"type\": \"mesh\", \"file\": \"{file}\"}}");
        std::fs::write(&path, format!("{{\"primitives\": [{}, {}]}}", mesh(first), mesh("square.wo3"))).unwrap();
        let scene = opened(&path);
        let of_mesh = |object: &ObjectPart| match object {
            ObjectPart::Mesh { source: MeshSource::Part { shape, .. }, .. } => Some(*shape),
            _ => None,
        };
        scene.file.objects.iter().filter_map(of_mesh).next_back().expect("the square")
    };
    assert_eq!([number("gone.wo3"), number("../outside.wo3")], [1; 2]);
}
