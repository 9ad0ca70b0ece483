//! Everything that a scene file can say, from text to entities to the snapshot, and back to text.

use bevy_ecs::prelude::World;
use firstlight::kdtree;
use firstlight::render::{ColorInput, Environment, Material, TexturePattern};
use firstlight::scene::file::SceneFile;
use firstlight::scene::{Extraction, FilmSize, Lens, LoadOptions, LoadedScene, SceneInputs, SceneSource, load};
use glam::{Vec2, Vec3};
use std::path::Path;

const EVERYTHING: &str = r#"
/* Every field of every part. */
(
    camera: (
        eye: (0, 1, 6), look_at: (0, 1, 0), up: (0.1, 1, 0), vfov: 35,
        f_stop: 2.0, focus_distance: 5.5, blades: 6, blade_rotation: 15,
    ),
    film: (width: 320, height: 200),
    integrator: path,
    max_depth: 64,
    display: (exposure: -0.5, tone_curve: filmic),
    environment: image(file: "sky.png", scale: (2, 1, 0.5), rotate: 90),
    textures: {
        "tiles": checker(a: 0.9, b: (0.1, 0.2, 0.3), squares: (4, 2), offset: (0.5, 0), rotate: 90),
        "sky": image(file: "sky.png", repeat: (2, 2), wrap: mirror, smooth: false),
    },
    materials: {
        "tiled": diffuse(albedo: "tiles"),
        "mirror": mirror(reflectance: (0.9, 0.8, 0.7)),
        "satin": metal(alpha: "sky", reflectance: 0.7, fresnel: schlick, compensate: true),
        "bottle": glass(ior: 1.4, absorption: (2, 1, 3)),
        "coat": blend(weight: 0.25, a: "tiled", b: "mirror"),
        "glow": emissive(radiance: (4, 5, 6)),
    },
    objects: [
        sphere(name: "a ball", center: (1, 0, 0), radius: 0.5, material: "bottle",
            transform: (scale: 2, rotate: (0, 90, 0), translate: (0, 1, 0))),
        plane(point: (0, -1, 0), normal: (0, 2, 0), material: "tiled"),
        quad(corner: (-1, 3, -1), edge_u: (2, 0, 0), edge_v: (0, 0, 2), material: "glow"),
        triangle(vertices: ((0, 0, 0), (1, 0, 0), (0, 1, 0)), material: "satin"),
        mesh(name: "tent", source: obj("tent.obj"), shading: flat, material: "coat",
            transform: (matrix: ((0, 0, 1, 5), (0, 1, 0, 6), (-1, 0, 0, 7)))),
        mesh(source: builtin("torus"), shading: smooth, simplify: 0.25, material: "mirror"),
        spheres(centers: [(0, 0, 0), (3, 0, 0)], radii: each([0.25, 0.5]), material: "mirror"),
        spheres(centers: [(0, 2, 0)], radii: all(0.125), material: "mirror"),
    ],
    lights: [
        point(name: "bulb", position: (0, 2, 0), intensity: (3, 2, 1), radius: 0.5),
        point(position: (0, 3, 0), intensity: 4, radius: 0),
        spot(name: "lamp", position: (1, 0, 0), direction: (0, 0, -2), intensity: 5, inner_angle: 10, outer_angle: 20,
            transform: (rotate: (0, 90, 0), translate: (0, 1, 0))),
        directional(name: "sun", direction: (0, -3, 0), irradiance: (6, 5, 4), transform: (rotate: (0, 0, 90))),
    ],
)
"#;

fn write_scene(folder: &Path, text: &str) -> LoadedScene {
    let picture = image::RgbImage::from_fn(4, 2, |x, y| image::Rgb([60 * x as u8, 255 * y as u8, 0]));
    picture.save(folder.join("sky.png")).unwrap();
    std::fs::write(folder.join("tent.obj"), "v 0 0 0\nv 1 0 0\nv 0 0 -1\nv 0 1 0\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")
        .unwrap();
    std::fs::write(folder.join("all.ron"), text).unwrap();
    load(&SceneSource::Scene(folder.join("all.ron")), &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn extract(scene: &LoadedScene) -> (World, Extraction) {
    let mut world = World::new();
    scene.spawn(&mut world);
    let extraction = Extraction::new(&SceneInputs::of(&mut world), &scene.trees);
    assert_eq!(extraction.problems, [] as [String; 0]);
    (world, extraction)
}

#[test]
fn everything_that_a_file_can_say_reaches_the_renderer() {
    let folder = tempfile::tempdir().unwrap();
    let scene = write_scene(folder.path(), EVERYTHING);
    let (mut world, extraction) = extract(&scene);
    let prepared = &extraction.prepared;
    let shapes = prepared.geometry.tree.shapes();
    assert_eq!(shapes.len(), 9, "eight objects and a bulb");

    // Scaled about its own space's origin, turned a quarter about Y, then moved.
    let kdtree::Shape::Sphere { center, radius } = shapes[0] else { panic!("{:?}", shapes[0]) };
    assert_eq!((center, radius), (Vec3::new(0.0, 1.0, -2.0), 1.0));
    let kdtree::Shape::Plane { point, normal } = shapes[1] else { panic!("{:?}", shapes[1]) };
    assert_eq!((point, normal), (Vec3::NEG_Y, Vec3::Y));
    let kdtree::Shape::Mesh { world_from_object, .. } = &shapes[4] else { panic!("{:?}", shapes[4]) };
    let tent = prepared.geometry.objects[4].mesh.as_ref().unwrap();
    assert!(tent.normals.is_empty(), "flat");
    let corner = world_from_object.transform_point3(tent.positions[tent.triangles[0][1] as usize]);
    assert_eq!(corner, Vec3::new(5.0, 6.0, 6.0), "(1, 0, 0) by the matrix");
    let torus = prepared.geometry.objects[5].mesh.as_ref().unwrap();
    assert_eq!(torus.triangles.len(), 192 * 64 * 2 / 4, "a quarter is kept");
    assert_eq!(torus.normals.len(), torus.positions.len(), "smooth");
    let kdtree::Shape::Spheres { tree, world_from_object } = &shapes[6] else { panic!("{:?}", shapes[6]) };
    let (center, radius) = tree.sphere(1);
    assert_eq!((world_from_object.transform_point3(center), radius), (Vec3::new(3.0, 0.0, 0.0), 0.5));

    let material = |object: usize| &prepared.shading.materials[prepared.geometry.objects[object].materials[0] as usize];
    assert!(
        matches!(material(0), Material::Glass { ior: 1.4, absorption, .. } if *absorption == Vec3::new(2.0, 1.0, 3.0))
    );
    let Material::Diffuse { albedo: ColorInput::Texture(tiles) } = material(1) else { panic!("{:?}", material(1)) };
    let tiles = &prepared.shading.textures[*tiles as usize];
    assert!(matches!(tiles.pattern, TexturePattern::Checker { a, .. } if a == Vec3::splat(0.9)));
    // Turned by 90 degrees, then four squares along u and two along v.
    assert!((tiles.uv_matrix * Vec2::X).abs_diff_eq(Vec2::new(0.0, 2.0), 1e-6));
    assert_eq!(tiles.uv_offset, Vec2::new(0.5, 0.0));
    assert!(matches!(material(4), Material::Blend { .. }));
    // π r² L is the intensity of the bulb.
    let Material::Emissive { radiance: ColorInput::Constant(radiance) } = material(8) else { panic!() };
    assert!((*radiance * std::f32::consts::PI * 0.25).abs_diff_eq(Vec3::new(3.0, 2.0, 1.0), 1e-6));

    let Environment::Image { image, scale, rotation } = &prepared.shading.environment else { panic!() };
    assert_eq!((image.width, image.height, *scale), (4, 2, Vec3::new(2.0, 1.0, 0.5)));
    assert!((rotation - 90_f32.to_radians()).abs() < 1e-6);
    assert_eq!((world.resource::<FilmSize>().width, world.resource::<FilmSize>().height), (320, 200));
    // 24 mm of film, 35 degrees: a lens of 38 mm, and at f/2 an aperture of 19 mm.
    let lens = *world.query::<&Lens>().single(&world).unwrap();
    assert!((lens.radius - 0.25 * 0.024 / (2.0 * 17.5_f64.to_radians().tan())).abs() < 1e-9, "{lens:?}");
    assert_eq!((lens.focus_distance, lens.blades, lens.enabled), (5.5, 6, true));
}

#[test]
fn a_file_survives_being_written_and_read() {
    let scene = SceneFile::parse(EVERYTHING, "all.ron").unwrap();
    let text = scene.to_ron();
    assert_eq!(SceneFile::parse(&text, "again.ron").unwrap(), scene, "{text}");
    assert_eq!(SceneFile::parse(&text, "again.ron").unwrap().to_ron(), text);
}

#[test]
fn spawning_again_replaces_the_scene_and_keeps_its_order() {
    let folder = tempfile::tempdir().unwrap();
    let scene = write_scene(folder.path(), EVERYTHING);
    let (mut world, first) = extract(&scene);
    let n_entities = world.entities().count_spawned();
    scene.spawn(&mut world);
    assert_eq!(world.entities().count_spawned(), n_entities);
    let again = Extraction::new(&SceneInputs::of(&mut world), &scene.trees);
    let outline = |extraction: &Extraction| format!("{:?}", extraction.prepared.shading.materials);
    assert_eq!(outline(&first), outline(&again));
}

#[test]
fn unused_materials_and_textures_cost_nothing() {
    let text = r#"(camera: (eye: (0, 0, 5), look_at: (0, 0, 0)),
        textures: { "t": checker(a: 0, b: 1) },
        materials: { "used": diffuse(albedo: 0.5), "glass": glass(), "textured": diffuse(albedo: "t") },
        objects: [sphere(radius: 1, material: "used")])"#;
    let folder = tempfile::tempdir().unwrap();
    let (_, extraction) = extract(&write_scene(folder.path(), text));
    let shading = &extraction.prepared.shading;
    assert_eq!((shading.materials.len(), shading.textures.len(), extraction.prepared.features().glass), (1, 0, false));
}
