//! Scenes that are saved as files of pbrt and Mitsuba open again, with the same surfaces and the same light.

use bevy_ecs::prelude::World;
use firstlight::export::{ExportFormat, export};
use firstlight::format::property::SkyProperty;
use firstlight::format::value::{ColorValue, ScalarValue};
use firstlight::frame::{Target, render_offline};
use firstlight::render::{Film, Material};
use firstlight::scene::file::{MaterialPart, SceneFile};
use firstlight::scene::{
    BUILTIN_SCENES, Extraction, LoadOptions, LoadedScene, Rendering, SceneInputs, SceneSource, Shape, load, whole_scene,
};
use glam::Vec3;
use std::path::Path;

fn open(source: SceneSource) -> (World, LoadedScene) {
    // With trees that are built several times as fast.
    let options = LoadOptions { preview: true, ..LoadOptions::default() };
    let scene = load(&source, &options).unwrap_or_else(|error| panic!("{error}"));
    let mut world = World::new();
    scene.spawn(&mut world);
    (world, scene)
}

/// Writes a scene and opens it again; returns what was told as well.
fn there_and_back(from: SceneSource, format: ExportFormat, folder: &Path) -> (World, LoadedScene, Vec<String>) {
    let (mut world, scene) = open(from);
    let path = folder.join(format!("out.{}", format.file_extension()));
    let told = export(&whole_scene(&mut world, &scene), format, &path, true).unwrap();
    let (world, scene) = open(SceneSource::Foreign(path));
    (world, scene, told.warnings.iter().map(|warning| warning.to_string()).collect())
}

fn written(folder: &Path, text: &str) -> SceneSource {
    let path = folder.join("scene.ron");
    SceneFile::parse(text, &path).unwrap_or_else(|error| panic!("{error}"));
    std::fs::write(&path, text).unwrap();
    SceneSource::Scene(path)
}

#[test]
fn every_built_in_scene_is_written_and_opens_again() {
    let folder = tempfile::tempdir().unwrap();
    for (name, ..) in BUILTIN_SCENES {
        // Its many spheres are many files of nothing but time.
        if *name == "ten-thousand-balls" {
            continue;
        }
        let (mut world, scene) = open(SceneSource::Builtin((*name).to_owned()));
        let whole = whole_scene(&mut world, &scene);
        for format in ExportFormat::ALL {
            let path = folder.path().join(format!("{name}.{}", format.file_extension()));
            export(&whole, format, &path, false).unwrap_or_else(|error| panic!("{name}: {error}"));
            let again = export(&whole, format, &path, false).unwrap_err().to_string();
            assert!(again.contains("already exists"), "{again}");
            let read = open(SceneSource::Foreign(path)).1;
            let told: Vec<String> = read.warnings.iter().map(|warning| warning.to_string()).collect();
            assert!(!told.iter().any(|line| line.contains("left out") || line.contains("cannot")), "{name}: {told:?}");
            assert_eq!(read.file.max_depth.unwrap_or(1001), scene.file.max_depth.unwrap_or(1001), "{name}");
        }
    }
}

/// Surfaces that both say, those of Mitsuba alone, and those of pbrt alone.
const SURFACES: [&[&str]; 3] = [
    &[
        "diffuse(albedo: (0.1, 0.2, 0.3))",
        "plastic(diffuse: (0.5, 0.25, 0.125), ior: 1.4)",
        "plastic(diffuse: 0.5, alpha: 0.2)",
        "conductor(eta: (0.2, 0.9, 1.1), k: (3.9, 2.4, 2.1))",
        "conductor(alpha: 0.3, eta: (0.2, 0.9, 1.1), k: (3.9, 2.4, 2.1))",
        "glass(ior: 1.33)",
        "rough_glass(alpha: 0.25, ior: 1.7)",
        "thin_glass(ior: 1.6)",
    ],
    &[
        "plastic(diffuse: 0.5, alpha: 0.2, specular: 0.5, nonlinear: false)",
        "conductor(alpha: 0.3, reflectance: (0.5, 0.6, 0.7))",
        "mirror(reflectance: (0.9, 0.8, 0.7))",
        "thin_glass(ior: 1.6, reflectance: 0.5, transmittance: (0.5, 0.25, 1))",
        "emissive(radiance: (3, 2, 1))",
        "disney(base_color: (0.5, 0.25, 0.125), metallic: 0.25, roughness: 0.375, anisotropic: 0.5, ior: 1.75, \
         specular_tint: 0.75, flatness: 0.25, sheen: 0.5, sheen_tint: 1, clearcoat: 0.75, clearcoat_gloss: 0.5)",
        "disney(transmission: 0.5, ior: 1.25)",
        "disney(thin_walled: true, diffuse_transmission: 1.5, transmission: 0.5, ior: 1.25)",
    ],
    &[
        "translucent(reflectance: (0.2, 0.3, 0.4), transmittance: 0.25)",
        "glass(ior: 1.5, absorption: (0.5, 0.25, 2))",
        "rough_glass(alpha: 0.25, absorption: (0.5, 0.25, 2))",
    ],
];

#[test]
fn surfaces_come_back_with_all_their_numbers() {
    for (format, own) in [(ExportFormat::Mitsuba, 1), (ExportFormat::Pbrt, 2)] {
        let surfaces: Vec<&str> = SURFACES[0].iter().chain(SURFACES[own]).copied().collect();
        let materials: String = surfaces.iter().enumerate().map(|(i, it)| format!("\"m{i}\": {it},")).collect();
        let ball = |i| format!("sphere(center: ({}, 1, 0), radius: 0.25, material: \"m{i}\"),", i);
        let balls: String = (0..surfaces.len()).map(ball).collect();
        let text = format!(
            "(camera: (eye: (0, 1, 5), look_at: (0, 1, 0)), materials: {{{materials}}}, objects: [{balls}], \
             environment: constant(0.5))"
        );
        let folder = tempfile::tempdir().unwrap();
        let from = written(folder.path(), &text);
        let before = SceneFile::parse(&text, "a.ron").unwrap();
        let (_, after, told) = there_and_back(from, format, folder.path());
        assert!(told.is_empty(), "{told:?}");
        let part = |file: &SceneFile, i: usize| -> MaterialPart {
            file.materials.get(file.objects[i].material().unwrap()).unwrap().clone()
        };
        for (i, surface) in surfaces.iter().enumerate() {
            let (wanted, found) = (part(&before, i), part(&after.file, i));
            assert!(format!("{wanted:?}") == format!("{found:?}"), "{format:?}, {surface}: {found:?}");
        }
    }
}

/// Other renderers have no cutoff: the image of the coverage is written as 0 and 1.
#[test]
fn holes_come_back_as_they_are_cut() {
    let image = image::GrayImage::from_fn(2, 2, |x, y| image::Luma([[[100, 200], [120, 140]][y as usize][x as usize]]));
    for format in ExportFormat::ALL {
        for (opacity, share) in [("\"image\"", 0.5), ("\"squares\"", 0.5), ("0.4", 0.0)] {
            let leaf = |kind: &str| format!("{kind}, opacity: {opacity}, opacity_cutoff: 0.5)");
            let text = format!(
                "(camera: (eye: (0, 1, 5), look_at: (0, 1, 0)), environment: constant(0.5), textures: {{\"image\": \
                 image(file: \"image.png\", encoding: linear), \"squares\": checker(a: 0.9, b: 0.3)}}, materials: \
                 {{\"a\": diffuse(albedo: 0.5), \"layered\": {}, \"blended\": {}}}, objects: [\
                 quad(corner: (0, 0, 0), edge_u: (1, 0, 0), edge_v: (0, 1, 0), material: \"layered\"), \
                 quad(corner: (2, 0, 0), edge_u: (1, 0, 0), edge_v: (0, 1, 0), material: \"blended\"), \
                 sphere(center: (0, 1, 0), radius: 0.25, material: \"a\")])",
                leaf("principled(base_color: 0.5"),
                leaf("blend(weight: 0, a: \"a\", b: \"a\"")
            );
            let folder = tempfile::tempdir().unwrap();
            image.save(folder.path().join("image.png")).unwrap();
            let from = written(folder.path(), &text);
            let (mut world, after, _) = there_and_back(from, format, folder.path());
            let whole = whole_scene(&mut world, &after);
            let shown = whole.file.objects.iter().filter_map(|object| whole.file.materials.get(object.material()?));
            let opacities = shown.filter_map(|part| match part {
                Material::Principled { opacity, .. } | Material::Blend { opacity, .. } => Some(opacity),
                _ => None,
            });
            let opacities: Vec<f32> = opacities
                .map(|opacity| match opacity {
                    ScalarValue::Number(number) => *number,
                    ScalarValue::Texture(name) => whole.textures[name].texture.mean().x,
                })
                .filter(|opacity| *opacity < 1.0)
                .collect();
            // In pbrt, what is a hole everywhere is left out.
            assert!(opacities.iter().all(|found| *found == share), "{format:?} {opacity}: {opacities:?}");
            assert_eq!(opacities.len(), if share > 0.0 { 2 } else { opacities.len() }, "{format:?} {opacity}");
        }
    }
}

/// Mitsuba has no surface that scatters diffusely to both sides: a share of a leaf is diffuse, the other only transmits,
/// each with a colour that is above 1 in the channels in which it returns more than its share.
#[test]
fn a_translucent_surface_comes_back_from_a_blend_of_mitsuba() {
    let image = image::Rgb32FImage::from_fn(2, 1, |x, _| image::Rgb([0.9, 0.5 * x as f32, 0.0]));
    for (given, wanted) in [
        ("reflectance: (0.25, 0.125, 0.5), transmittance: 0.5", [[0.25, 0.125, 0.5], [0.5; 3]]),
        ("reflectance: (0.9, 0.05, 0.05), transmittance: (0.05, 0.9, 0.9)", [[0.9, 0.05, 0.05], [0.05, 0.9, 0.9]]),
        ("reflectance: 0, transmittance: (0.5, 0, 0)", [[0.0; 3], [0.5, 0.0, 0.0]]),
        // Scaled, as it is shown.
        ("reflectance: (1, 0.5, 0), transmittance: (1, 0, 0.5)", [[0.5, 0.5, 0.0], [0.5, 0.0, 0.5]]),
        ("reflectance: \"image\", transmittance: (0.1, 0.25, 1)", [[0.9, 0.25, 0.0], [0.1, 0.25, 1.0]]),
        ("reflectance: \"squares\", transmittance: (0.1, 0.2, 0.9)", [[0.9, 0.4, 0.05], [0.1, 0.2, 0.9]]),
    ] {
        let text = format!(
            "(camera: (eye: (0, 1, 5), look_at: (0, 1, 0)), environment: constant(0.5), textures: {{\"image\": \
             image(file: \"image.exr\"), \"squares\": checker(a: (0.9, 0.8, 0), b: (0.9, 0, 0.1))}}, materials: \
             {{\"leaf\": translucent({given})}}, objects: [sphere(center: (0, 1, 0), radius: 0.25, material: \"leaf\")])"
        );
        let folder = tempfile::tempdir().unwrap();
        image.save(folder.path().join("image.exr")).unwrap();
        let from = written(folder.path(), &text);
        let (mut world, after, told) = there_and_back(from, ExportFormat::Mitsuba, folder.path());
        assert!(told.is_empty() && after.warnings.is_empty(), "{given}: {told:?} {:?}", after.warnings);
        let whole = whole_scene(&mut world, &after);
        let part = whole.file.materials.get(whole.file.objects[0].material().unwrap()).unwrap();
        let Material::Translucent { reflectance, transmittance } = part else { panic!("{given}: {part:?}") };
        let mean = |color: &ColorValue| match color {
            ColorValue::Rgb(rgb) => *rgb,
            ColorValue::Texture(name) => whole.textures[name].texture.mean(),
        };
        for (found, wanted) in [reflectance, transmittance].map(mean).into_iter().zip(wanted) {
            assert!(found.abs_diff_eq(Vec3::from(wanted), 2e-3), "{given}: {part:?}, {found}");
        }
    }
}

/// Mean radiance of the four quarters of an image of 64 × 48 pixels.
fn quarters(world: &mut World, scene: &LoadedScene) -> [Vec3; 4] {
    let inputs = SceneInputs::of(world);
    let extraction = Extraction::of_world(world, &inputs, &scene.trees);
    assert!(extraction.problems.is_empty(), "{:?}", extraction.problems);
    let settings = world.resource::<Rendering>().0;
    let mut film = Film::new(64, 48);
    let target = Target { spp: Some(128), ..Target::default() };
    render_offline(&extraction.prepared, &settings, &mut film, target, |_| true);
    let means = film.means();
    let quarter = |k: usize| {
        let of = |i: &usize| (i % 64 >= 32, i / 64 >= 24) == (k % 2 == 1, k >= 2);
        (0..64 * 48).filter(of).map(|i| means[i]).sum::<Vec3>() / 768.0
    };
    std::array::from_fn(quarter)
}

/// Everything that has a place or a direction: textures, mirrored and shared meshes, lens, environment, lights.
const PLACES: &str = r#"(
    camera: (eye: (0.5, 1.5, 6), look_at: (0, 0.8, 0), vfov: 40, lens_radius: 0.02, focus_distance: 6),
    film: (width: 64, height: 48),
    environment: image(file: "sky.png", scale: 0.5, rotate: 70),
    textures: {
        "squares": checker(a: (0.8, 0.2, 0.1), b: 0.05, squares: (4, 2), offset: (0.25, 0)),
        "image": image(file: "sky.png", repeat: (2, 1), offset: (0.3, 0.1), tint: (0.9, 0.8, 0.5)),
        "share": image(file: "sky.png", channel: g, encoding: linear),
        "holes": checker(a: 1, b: 0, squares: (6, 3)),
    },
    materials: {
        "floor": diffuse(albedo: "image"),
        "ball": diffuse(albedo: "squares"),
        "paint": plastic(diffuse: "image", ior: 1.5),
        "a": diffuse(albedo: (0.1, 0.5, 0.1)),
        "b": mirror(),
        "mixed": blend(weight: "share", a: "a", b: "b"),
        "grid": blend(weight: 0, a: "a", b: "a", opacity: "holes"),
        "lamp": emissive(radiance: (6, 5, 4)),
        "glow": blend(weight: 0.5, a: "a", b: "lamp"),
    },
    objects: [
        quad(name: "floor", corner: (-3, 0, 3), edge_u: (6, 0, 0), edge_v: (0, 0, -6), material: "floor"),
        quad(name: "slanted", corner: (-3, 0, -3), edge_u: (2, 0, 0), edge_v: (0.5, 2, 0), material: "paint"),
        quad(name: "wall", corner: (1, 0, -3), edge_u: (2, 0, 0), edge_v: (0, 2, 0), material: "mixed"),
        quad(name: "grid", corner: (1, 0.1, 2), edge_u: (1, 0, 0), edge_v: (0, 1, 0), material: "grid"),
        sphere(name: "ball", center: (-1, 0.6, 0), radius: 0.6, material: "ball", transform: (rotate: (30, 40, 50))),
        mesh(name: "one", source: builtin("torus"), material: "paint", transform: (translate: (1, 0.5, 0), scale: 0.5)),
        mesh(name: "two", source: builtin("torus"), material: "paint",
             transform: (translate: (1.5, 1.2, -1), rotate: (40, 0, 0), scale: (0.4, 0.4, -0.5))),
        mesh(name: "alone", source: builtin("cube"), material: "glow",
             transform: (translate: (0, 0.3, 1), rotate: (0, 30, 0), scale: (-0.3, 0.2, 0.2))),
        triangle(name: "tip", vertices: ((0, 2, 0), (0.5, 2, 0), (0, 2.5, 0)), material: "ball"),
    ],
    lights: [
        point(name: "bulb", position: (0, 3, 1), intensity: (2, 1, 1), radius: 0.1),
        spot(name: "spot", position: (2, 4, 2), direction: (-1, -2, -1), intensity: 9, inner_angle: 20,
             outer_angle: 20),
        directional(name: "sun", direction: (1, -2, -1), irradiance: (0.5, 0.5, 0.25)),
    ],
)"#;

#[test]
fn the_light_of_every_quarter_of_the_image_stays() {
    let folder = tempfile::tempdir().unwrap();
    // Brighter to the right and downwards, each in its own colour.
    let sky = image::RgbImage::from_fn(32, 16, |x, y| image::Rgb([8 * x as u8, 16 * y as u8, 100]));
    sky.save(folder.path().join("sky.png")).unwrap();
    let from = written(folder.path(), PLACES);
    let (mut world, scene) = open(from.clone());
    let wanted = quarters(&mut world, &scene);
    for format in ExportFormat::ALL {
        let (mut world, scene, told) = there_and_back(from.clone(), format, folder.path());
        let found = quarters(&mut world, &scene);
        for (k, (wanted, found)) in wanted.iter().zip(&found).enumerate() {
            let ratio = *found / *wanted;
            assert!((ratio - 1.0).abs().max_element() < 0.03, "{format:?}, quarter {k}: {ratio}, told {told:?}");
        }
    }
}

/// Meshes without texture coordinates show a texture in each triangle; checkers are turned, with unequal squares.
#[test]
fn patterns_stay_where_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let bare = "textures: {\"c\": checker(a: (0.9, 0.1, 0), b: (0, 0.2, 0.8), squares: (3, 4))}, objects: [ \
                mesh(source: builtin(\"cube\"), material: \"m\", transform: (rotate: (30, 40, 0))), \
                mesh(source: builtin(\"bored-block\"), material: \"m\", \
                     transform: (translate: (2.2, 0, 0), scale: (-0.8, 0.9, 0.7)))";
    let turned = |degrees: i32| {
        format!(
            "textures: {{\"c\": checker(a: (0.9, 0.1, 0), b: (0, 0.2, 0.8), squares: (1.5, 4), rotate: {degrees}, \
             offset: (0.2, 0.1))}}, objects: [quad(corner: (-1, -1, 0), edge_u: (3, 0, 0), edge_v: (0, 2, 0), \
             material: \"m\")"
        )
    };
    let all = ExportFormat::ALL.map(|format| (format, bare.to_owned()));
    let of_mitsuba = [30, 90, 130, -50].map(|degrees| (ExportFormat::Mitsuba, turned(degrees)));
    for (format, what) in all.into_iter().chain(of_mitsuba) {
        let text = format!(
            "(camera: (eye: (1, 0.5, 6), look_at: (0.8, 0, 0), vfov: 40), film: (width: 64, height: 48), max_depth: 2,
              environment: constant(1), materials: {{\"m\": diffuse(albedo: \"c\")}}, {what}])"
        );
        let from = written(folder.path(), &text);
        let (mut world, scene) = open(from.clone());
        let wanted = quarters(&mut world, &scene);
        let (mut world, scene, told) = there_and_back(from, format, folder.path());
        assert!(told.is_empty() && scene.warnings.is_empty(), "{what}: {told:?} {:?}", scene.warnings);
        let found = quarters(&mut world, &scene);
        for (k, (wanted, found)) in wanted.iter().zip(&found).enumerate() {
            let ratio = *found / *wanted;
            assert!((ratio - 1.0).abs().max_element() < 0.02, "{format:?} {what}, quarter {k}: {ratio}");
        }
    }
}

#[test]
fn what_firstlight_leaves_out_of_its_own_files_is_told() {
    for (material, expected) in [
        ("glass(absorption: (1, 0, 2))", "`m`: its absorption is a medium, which firstlight leaves out"),
        (
            "rough_glass(alpha: 0.2, absorption: (1, 0, 2))",
            "`m`: its absorption is a medium, which firstlight leaves out",
        ),
        ("translucent(reflectance: \"c\", transmittance: 0.2)", "exceed 1 together, it is brighter"),
    ] {
        let text = format!(
            "(camera: (eye: (0, 1, 5), look_at: (0, 1, 0)), environment: constant(0.5), textures: {{\"c\": \
             checker(a: 0.9, b: 0)}}, materials: {{\"m\": {material}}}, objects: [sphere(center: (0, 1, 0), \
             radius: 0.25, material: \"m\")])"
        );
        let folder = tempfile::tempdir().unwrap();
        let from = written(folder.path(), &text);
        let (_, _, told) = there_and_back(from, ExportFormat::Mitsuba, folder.path());
        assert!(told.len() == 1 && told[0].contains(expected), "{material}: {told:?}");
    }
}

#[test]
fn what_is_hidden_is_not_written() {
    let text = "(camera: (eye: (0, 1, 5), look_at: (0, 1, 0)), materials: {\"m\": diffuse(albedo: 0.5)}, objects: [\
                mesh(source: builtin(\"torus\"), hidden: true, material: \"m\"), mesh(name: \"seen\", source: \
                builtin(\"cube\"), material: \"m\")], lights: [point(hidden: true, position: (0, 3, 0), \
                intensity: 5, radius: 0), point(name: \"on\", position: (0, 3, 0), intensity: 5, radius: 0)])";
    for format in [ExportFormat::Mitsuba, ExportFormat::Pbrt] {
        let folder = tempfile::tempdir().unwrap();
        let (mut world, _, told) = there_and_back(written(folder.path(), text), format, folder.path());
        let inputs = SceneInputs::of(&mut world);
        let Shape::Mesh(mesh) = &inputs.objects[0].shape else { panic!("{:?}", inputs.objects[0].shape.kind()) };
        assert_eq!((inputs.objects.len(), inputs.lights.len(), mesh.triangles.len()), (1, 1, 12), "{format:?}");
        assert!(told[0].contains("2 of 4 objects and lights"), "{told:?}");
    }
}

/// Images of lights that the formats have: a projector and a spot of Mitsuba, a projector of pbrt.
#[test]
fn projected_images_stay_where_they_are() {
    let folder = tempfile::tempdir().unwrap();
    // Another colour in each corner.
    let slide = image::RgbImage::from_fn(4, 2, |x, y| image::Rgb([60 * x as u8, 200 * y as u8, 90]));
    slide.save(folder.path().join("slide.png")).unwrap();
    for (format, light) in [
        (ExportFormat::Mitsuba, "outer_angle: 60, inner_angle: 60, image_width: 70, image_height: 60, even: true"),
        (ExportFormat::Mitsuba, "outer_angle: 35, inner_angle: 10, falloff: linear"),
        (ExportFormat::Pbrt, "outer_angle: 60, inner_angle: 60, image_width: 70, image_height: 60"),
    ] {
        let text = format!(
            "(camera: (eye: (0, 4, 4), look_at: (0, 0, 0)), film: (width: 64, height: 48), max_depth: 2,
              textures: {{\"slide\": image(file: \"slide.png\", smooth: false)}},
              materials: {{\"floor\": diffuse(albedo: 0.8)}},
              objects: [quad(corner: (-3, 0, 3), edge_u: (6, 0, 0), edge_v: (0, 0, -6), material: \"floor\")],
              lights: [spot(position: (0.5, 3, 0), direction: (-0.2, -1, 0), up: (1, 0, -2), intensity: 20,
                            texture: \"slide\", {light})])"
        );
        let from = written(folder.path(), &text);
        let (mut world, scene) = open(from.clone());
        let wanted = quarters(&mut world, &scene);
        let (mut world, scene, told) = there_and_back(from, format, folder.path());
        let found = quarters(&mut world, &scene);
        for (k, (wanted, found)) in wanted.iter().zip(&found).enumerate() {
            let ratio = *found / *wanted;
            assert!((ratio - 1.0).abs().max_element() < 0.02, "{format:?} {light}, quarter {k}: {ratio}");
        }
        assert_eq!((told, scene.warnings.len()), (Vec::new(), 0), "{light}");
    }
}

#[test]
fn a_clear_sky_stays_one_or_becomes_an_image() {
    let folder = tempfile::tempdir().unwrap();
    let scene = |below: bool| {
        format!(
            "(camera: (eye: (0, 1, 4), look_at: (0, 0.5, 0)), film: (width: 64, height: 48), max_depth: 2,
              environment: sky(elevation: 40, azimuth: 60, turbidity: 4, ground: (0.1, 0.2, 0.3), sun: 0.5,
                               sun_size: 2, below: {below}, scale: 2),
              materials: {{\"white\": diffuse(albedo: 0.8)}},
              objects: [quad(corner: (-3, 0, 3), edge_u: (6, 0, 0), edge_v: (0, 0, -6), material: \"white\"),
                        sphere(center: (0, 0.7, 0), radius: 0.6, material: \"white\")])"
        )
    };
    let from = written(folder.path(), &scene(false));
    let (_, again, told) = there_and_back(from.clone(), ExportFormat::Mitsuba, folder.path());
    assert!(told.is_empty(), "{told:?}");
    let sky = open(from).1.file.environment;
    for property in SkyProperty::ALL {
        let [wanted, found] = [&sky, &again.file.environment].map(|sky| property.get(sky).unwrap());
        // Factors of all come back as those of sun and sky.
        let wanted = if matches!(property, SkyProperty::Sun | SkyProperty::Sky) { 2.0 * wanted } else { wanted };
        assert!((found - wanted).abs() < 1e-6, "{property:?}: {found} for {wanted}");
    }
    // pbrt has no such sky, and that of Mitsuba is black below.
    let from = written(folder.path(), &scene(true));
    let (mut world, loaded) = open(from.clone());
    let wanted = quarters(&mut world, &loaded);
    for format in ExportFormat::ALL {
        let (mut world, scene, _) = there_and_back(from.clone(), format, folder.path());
        let found = quarters(&mut world, &scene);
        for (k, (wanted, found)) in wanted.iter().zip(&found).enumerate() {
            let ratio = *found / *wanted;
            assert!((ratio - 1.0).abs().max_element() < 0.03, "{format:?}, quarter {k}: {ratio}");
        }
    }
}

/// Names mean nothing to the other program: not the parameters and paths of Mitsuba, not the marks of either grammar.
#[test]
fn scenes_with_any_names_open_again() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("m.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let names = ["$(x)", "$x", "a.b", "\\\"", "<&>", "\\n#", "[", "é 球"];
    let materials: String = names.iter().map(|name| format!("\"{name}\": diffuse(albedo: 0.6),\n")).collect();
    let object = |name: &&str| format!("mesh(source: obj(\"m.obj\"), name: \"{name}\", material: \"{name}\"),\n");
    let objects: String = names.iter().map(object).collect();
    let text = format!(
        "(camera: (eye: (0, 0, 3), look_at: (0, 0, 0)), environment: constant(1),\n\
         materials: {{ {materials} }}, objects: [ {objects} ])"
    );
    let (mut world, scene) = open(written(folder.path(), &text));
    for format in ExportFormat::ALL {
        let path = folder.path().join(format!("out $(y) \" &.{}", format.file_extension()));
        export(&whole_scene(&mut world, &scene), format, &path, true).unwrap();
        let again = open(SceneSource::Foreign(path)).1;
        assert!(again.warnings.is_empty(), "{format:?}: {:?}", again.warnings);
        assert_eq!((again.file.objects.len(), again.file.materials.names().count()), (names.len(), names.len()));
    }
}

/// What is in the folder that a scene would get may be a link to anything, or what the scene is read from.
#[test]
fn nothing_beside_a_scene_is_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    for beside in ["out-xml", "out-pbrt"] {
        std::fs::create_dir(at(beside)).unwrap();
        std::fs::write(at(&format!("{beside}/chair.obj")), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
        std::fs::write(at(&format!("{beside}/table.ply")), "mine").unwrap();
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(at("away"), at(&format!("{beside}-2"))).unwrap();
            std::os::unix::fs::symlink(at("notes"), at(&format!("{beside}/chair.ply"))).unwrap();
        }
    }
    std::fs::write(at("notes"), "mine").unwrap();
    let (mut world, scene) = open(written(
        folder.path(),
        "(camera: (eye: (0, 0, 3), look_at: (0, 0, 0)), environment: constant(1), materials: { \"m\": diffuse(albedo: 0.5) },
          objects: [ mesh(name: \"chair\", source: obj(\"out-xml/chair.obj\"), material: \"m\"),
                     mesh(name: \"table\", source: obj(\"out-pbrt/chair.obj\"), material: \"m\") ])",
    ));
    let whole = whole_scene(&mut world, &scene);
    for format in ExportFormat::ALL {
        let path = at(&format!("out.{}", format.file_extension()));
        let mut names = Vec::new();
        for _ in 0..2 {
            let exported = export(&whole, format, &path, true).unwrap();
            names.push(exported.folder.unwrap().file_name().unwrap().to_str().unwrap().to_owned());
            assert!(open(SceneSource::Foreign(path.clone())).1.warnings.is_empty());
        }
        let numbers = if cfg!(unix) { ["3", "4"] } else { ["2", "3"] };
        assert_eq!(names, numbers.map(|n| format!("out-{}-{n}", format.file_extension())));
    }
    for untouched in ["notes", "out-xml/table.ply", "out-pbrt/table.ply"] {
        assert_eq!(std::fs::read(at(untouched)).unwrap(), b"mine", "{untouched}");
    }
    assert!(at("out-xml/chair.obj").exists() && !at("away").exists());
}

#[test]
fn a_scene_that_cannot_be_written_leaves_no_folder() {
    let folder = tempfile::tempdir().unwrap();
    let (mut world, scene) = open(SceneSource::Builtin("models".into()));
    let whole = whole_scene(&mut world, &scene);
    for format in ExportFormat::ALL {
        let path = folder.path().join(format!("out.{}", format.file_extension()));
        std::fs::create_dir(&path).unwrap();
        assert!(export(&whole, format, &path, true).is_err());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
        std::fs::remove_dir(&path).unwrap();
    }
}

/// Files of meshes without triangles stop other renderers.
#[test]
fn a_mesh_that_was_left_out_is_not_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.pbrt");
    let text = "Camera \"perspective\"\nWorldBegin\nLightSource \"infinite\"\n\
                Shape \"plymesh\" \"string filename\" \"missing.ply\"\n\
                Shape \"trianglemesh\" \"point3 P\" [0 0 3 1 0 3 0 1 3] \"integer indices\" [0 1 2]\n";
    std::fs::write(&path, text).unwrap();
    for format in ExportFormat::ALL {
        let (_, after, _) = there_and_back(SceneSource::Foreign(path.clone()), format, folder.path());
        assert_eq!(after.file.objects.len(), 1, "{format:?}");
    }
}

#[test]
fn pbrt_has_no_checkers_above_1_which_is_told() {
    let folder = tempfile::tempdir().unwrap();
    for (a, n_told) in [(1.0, 0), (3.0, 1)] {
        let text = format!(
            "(camera: (eye: (0, 0, 9), look_at: (0, 0, 0)), textures: {{ \"c\": checker(a: ({a}, 1, 1), b: 0) }},\n\
             materials: {{ \"m\": diffuse(albedo: \"c\") }}, environment: constant(1),\n\
             objects: [ quad(corner: (0, 0, 0), edge_u: (1, 0, 0), edge_v: (0, 1, 0), material: \"m\") ])"
        );
        let told = there_and_back(written(folder.path(), &text), ExportFormat::Pbrt, folder.path()).2;
        assert_eq!(told.iter().filter(|line| line.contains("above 1")).count(), n_told, "{told:?}");
    }
}

/// Names that one of the grammars writes alike, has no letter for, or that our reader cuts.
#[test]
fn materials_and_textures_keep_apart_whose_names_are_written_alike() {
    let folder = tempfile::tempdir().unwrap();
    let long = "l".repeat(400);
    let others = [format!("{long}1"), format!("{long}2")];
    let names = ["a\\\"", "a_", "a\\u{1}", "a\\u{2}", "a\\u{ffff}", "a.", "a$", "a_ 2", "a\\\\", "", " ", "_"];
    let names: Vec<&str> = names.into_iter().chain(others.iter().map(String::as_str)).collect();
    let value = |i: usize| (i + 1) as f32 / 16.0;
    let all = |line: &dyn Fn(usize, &str) -> String| -> String {
        names.iter().enumerate().map(|(i, name)| line(i, name)).collect()
    };
    let textures = all(&|i, name| format!("\"{name}\": checker(a: {}, b: 0),\n", value(i)));
    let spheres = all(&|i, name| format!("sphere(center: ({i}, 0, 0), radius: 0.1, material: \"{name}\"),\n"));
    let absorbs = |i: usize| format!("glass(ior: 1.5, absorption: {})", value(i));
    for (format, surface) in [
        (ExportFormat::Mitsuba, &(|i, _: &str| format!("diffuse(albedo: {})", value(i))) as &dyn Fn(usize, &str) -> _),
        (ExportFormat::Pbrt, &|i, _: &str| absorbs(i)),
        (ExportFormat::Pbrt, &|_, name: &str| format!("diffuse(albedo: \"{name}\")")),
    ] {
        let materials = all(&|i, name| format!("\"{name}\": {},\n", surface(i, name)));
        let text = format!(
            "(camera: (eye: (0, 0, 9), look_at: (0, 0, 0)), environment: constant(1), textures: {{ {textures} }},\n\
             materials: {{ {materials} }}, objects: [ {spheres} ])"
        );
        let (_, after, told) = there_and_back(written(folder.path(), &text), format, folder.path());
        assert!(told.is_empty() && after.warnings.is_empty(), "{format:?}: {told:?}, {:?}", after.warnings);
        let shown = |file: &SceneFile, i: usize| {
            let part = file.materials.get(file.objects[i].material().unwrap()).unwrap();
            let texture = file.textures.names().find(|name| format!("{part:?}").contains(&format!("{name:?}")));
            match texture {
                Some(texture) => format!("{:?}", file.textures.get(texture).unwrap()),
                None => format!("{part:?}"),
            }
        };
        let before = SceneFile::parse(&text, "a.ron").unwrap();
        assert_eq!(after.file.objects.len(), names.len(), "{format:?}");
        for (i, name) in names.iter().enumerate() {
            assert_eq!(shown(&after.file, i), shown(&before, i), "{format:?}, {name}");
        }
    }
}

/// A view that a sphere fills, at all angles, in uniform light.
fn furnace(material: &str) -> String {
    format!(
        r#"(camera: (eye: (0, 0, 1.4), look_at: (0, 0, 0), vfov: 65), film: (width: 64, height: 48), max_depth: 2,
            environment: constant(1), textures: {{ "t": image(file: "t.png") }}, materials: {{ "m": {material} }},
            objects: [ sphere(center: (0, 0, 0), radius: 1, material: "m") ])"#
    )
}

/// Their coat loses light in both formats, and the metal does: as much as two thirds.
#[test]
fn layered_surfaces_are_as_bright_as_they_were() {
    let folder = tempfile::tempdir().unwrap();
    let white = |x: u32, y: u32| image::Rgb([255 * (x / 64 % 2) as u8, 255 * (y / 64 % 2) as u8, 128]);
    image::RgbImage::from_fn(512, 256, white).save(folder.path().join("t.png")).unwrap();
    let mut surfaces = Vec::new();
    for roughness in [0.15, 0.35, 0.6, 1.0] {
        for base in ["(0.6, 0.3, 0.05)", "0.95", "\"t\""] {
            surfaces.push((0, format!("principled(base_color: {base}, roughness: {roughness})")));
        }
        if roughness == 1.0 {
            // Metals of pbrt cannot be bright enough.
            continue;
        }
        surfaces.push((1, format!("principled(base_color: (0.6, 0.3, 0.2), roughness: {roughness}, metallic: 1)")));
        surfaces.push((
            1,
            format!("metal(reflectance: (0.5, 0.3, 0.2), alpha: {roughness}, fresnel: schlick, compensate: true)"),
        ));
    }
    surfaces.push((0, "principled(base_color: 0.5, roughness: 0.8, specular: 0.3, ior: 1.8)".into()));
    for (is_metal, surface) in surfaces {
        let from = written(folder.path(), &furnace(&surface));
        let (mut world, scene) = open(from.clone());
        let wanted = quarters(&mut world, &scene).iter().sum::<Vec3>();
        for format in ExportFormat::ALL {
            // The reader returns what metals of Mitsuba lose.
            if format == ExportFormat::Mitsuba && is_metal == 1 {
                continue;
            }
            let (mut world, scene, told) = there_and_back(from.clone(), format, folder.path());
            let ratio = quarters(&mut world, &scene).iter().sum::<Vec3>() / wanted;
            assert!(told.is_empty(), "{told:?}");
            // It cuts texels above 1, too.
            let most = match format {
                ExportFormat::Mitsuba if surface.contains("\"t\"") => 0.1,
                ExportFormat::Mitsuba => 0.08,
                ExportFormat::Pbrt => 0.03,
            };
            assert!((ratio - 1.0).abs().max_element() < most, "{format:?}, {surface}: {ratio}");
        }
    }
}

/// A quad whose texture is placed in some way, seen from the front.
fn placed_texture(texture: &str, material: &str) -> String {
    format!(
        r#"(camera: (eye: (0, 0, 4), look_at: (0, 0, 0), vfov: 26), film: (width: 64, height: 48), max_depth: 2,
            environment: constant(0.1), textures: {{ "t": {texture} }},
            materials: {{ "grey": diffuse(albedo: 0.7), "m": {material} }},
            lights: [ directional(direction: (1, -2, -1.5), irradiance: (2, 3, 4)) ],
            objects: [ quad(corner: (-1, -1, 0), edge_u: (2, 0, 0), edge_v: (0, 2, 0), material: "m") ])"#
    )
}

/// pbrt places neither the image of a light nor a normal map: what a quad shows of them is an image.
#[test]
fn images_of_lights_and_normals_stay_where_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let colors = image::RgbImage::from_fn(4, 4, |x, y| image::Rgb([60 * x as u8 + 40, 60 * y as u8 + 40, 200]));
    colors.save(folder.path().join("t.png")).unwrap();
    for texture in [
        "checker(a: (0.9, 0.4, 0.6), b: (0.3, 0.5, 0.9), squares: (1, 2), offset: (0.25, 0))",
        r#"image(file: "t.png", repeat: (1.5, 0.5), offset: (0.3, 0.1))"#,
        r#"image(file: "t.png", rotate: 90, tint: 0.9)"#,
        r#"image(file: "t.png", encoding: linear, repeat: (2, 2), wrap: clamp)"#,
    ] {
        for material in [r#"emissive(radiance: "t")"#, r#"blend(weight: 0, a: "grey", b: "grey", normal_map: "t")"#] {
            let from = written(folder.path(), &placed_texture(texture, material));
            let (mut world, scene) = open(from.clone());
            let wanted = quarters(&mut world, &scene);
            let (mut world, scene, told) = there_and_back(from, ExportFormat::Pbrt, folder.path());
            for (k, (wanted, found)) in wanted.iter().zip(&quarters(&mut world, &scene)).enumerate() {
                let ratio = *found / *wanted;
                let of = format!("{texture}, {material}, quarter {k}");
                assert!((ratio - 1.0).abs().max_element() < 0.03, "{of}: {ratio}, told {told:?}");
            }
        }
    }
}

/// Mitsuba's second tangent is that of a texture that is not mirrored.
#[test]
fn normal_maps_of_mirrored_meshes_stay_upright() {
    let folder = tempfile::tempdir().unwrap();
    let slanted = image::RgbImage::from_pixel(4, 4, image::Rgb([128, 215, 215]));
    slanted.save(folder.path().join("n.png")).unwrap();
    std::fs::write(
        folder.path().join("s.obj"),
        "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n",
    )
    .unwrap();
    let texture = r#"image(file: "n.png", encoding: linear)"#;
    let scene = placed_texture(texture, r#"blend(weight: 0, a: "grey", b: "grey", normal_map: "t")"#);
    let quad = r#"quad(corner: (-1, -1, 0), edge_u: (2, 0, 0), edge_v: (0, 2, 0), material: "m")"#;
    let mesh = r#"mesh(source: obj("s.obj"), material: "m", transform: (scale: (-1, 1, 1)))"#;
    assert!(scene.contains(quad));
    let from = written(folder.path(), &scene.replace(quad, mesh));
    let (mut world, scene) = open(from.clone());
    let wanted = quarters(&mut world, &scene)[0];
    for format in ExportFormat::ALL {
        let (mut world, scene, told) = there_and_back(from.clone(), format, folder.path());
        let ratio = quarters(&mut world, &scene)[0] / wanted;
        assert!((ratio - 1.0).abs().max_element() < 0.03, "{format:?}: {ratio}, told {told:?}");
    }
}

#[test]
fn scenes_that_cannot_be_opened_again_are_told() {
    let folder = tempfile::tempdir().unwrap();
    for (n, is_told) in [(10, false), (110, true)] {
        let text = format!(
            "(camera: (eye: (0, 0, 900), look_at: (0, 0, 0)), materials: {{ \"w\": diffuse(albedo: 0.6) }}, objects: [
              ball_grid(first: (0, 0, 0), steps: [({n}, (1, 0, 0)), (100, (0, 1, 0)), (100, (0, 0, 1))], radius: 0.3,
                        material: \"w\") ])"
        );
        let (mut world, scene) = open(written(folder.path(), &text));
        let whole = whole_scene(&mut world, &scene);
        let exported = export(&whole, ExportFormat::Mitsuba, &folder.path().join("g.xml"), true).unwrap();
        assert_eq!(exported.warnings.iter().any(|told| told.contains("firstlight opens 4194304")), is_told);
    }
}

/// A hidden folder would not be read again, nor one that lies elsewhere.
#[test]
fn folders_lie_beside_their_scenes_where_they_can_be_read() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("deep")).unwrap();
    let (mut world, scene) = open(written(
        folder.path(),
        r#"(camera: (eye: (0, 0, 3), look_at: (0, 0, 0)), materials: { "m": diffuse(albedo: 0.5) },
            objects: [ mesh(source: builtin("cube"), material: "m") ])"#,
    ));
    let whole = whole_scene(&mut world, &scene);
    let is_whole = |path: std::path::PathBuf| {
        !open(SceneSource::Foreign(path)).1.warnings.iter().any(|told| told.contains("left out"))
    };
    for format in ExportFormat::ALL {
        let extension = format.file_extension();
        let [hidden, link, target] =
            [".x", "link", "deep/scene"].map(|name| folder.path().join(format!("{name}.{extension}")));
        let exported = export(&whole, format, &hidden, false).unwrap();
        assert_eq!(exported.folder, Some(folder.path().canonicalize().unwrap().join(format!("x-{extension}"))));
        assert!(is_whole(hidden));
        #[cfg(unix)]
        {
            std::fs::write(&target, "").unwrap();
            std::os::unix::fs::symlink(&target, &link).unwrap();
            let told = export(&whole, format, &link, true).unwrap().warnings;
            assert!(told.iter().any(|told| told.contains("is a link")));
            assert!(folder.path().join(format!("deep/scene-{extension}")).is_dir());
            assert!(is_whole(target));
        }
    }
}
