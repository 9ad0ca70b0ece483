//! Scenes that are saved read back as exactly the same world, and render to the same bits.

use bevy_ecs::prelude::World;
use firstlight::frame::{Target, render_offline};
use firstlight::render::{Falloff, Film, Texture, TexturePattern};
use firstlight::scene::{
    BUILTIN_SCENES, Description, DirectionalLight, DisplaySettings, Extraction, ImageFrame, Lens, LightInput,
    LightTexture, LoadOptions, LoadedScene, Material, Placement, PointLight, Projection, Rendering, Rgb, SceneInputs,
    SceneSource, Shape, SpotLight, SurfaceMaterial, SurfaceTexture, TextureSource, View, load, save_scene,
};
use glam::{DVec2, DVec3, Mat2, Vec2, Vec3};
use proptest::prelude::*;
use std::path::Path;
use std::sync::Arc;

fn open(source: SceneSource) -> (World, LoadedScene) {
    let scene = load(&source, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    let mut world = World::new();
    scene.spawn(&mut world);
    (world, scene)
}

fn builtin(name: &str) -> (World, LoadedScene) {
    open(SceneSource::Builtin(name.to_owned()))
}

/// Saves and reads again.
fn through_a_file(world: &mut World, scene: &LoadedScene, path: &Path) -> (World, LoadedScene) {
    save_scene(world, Some(scene), path).unwrap_or_else(|error| panic!("{error}"));
    open(SceneSource::Scene(path.to_path_buf()))
}

/// Everything that the picture depends on is equal, to the last bit.
#[track_caller]
fn assert_same(a: &mut World, b: &mut World, what: &str) {
    let (before, after) = (SceneInputs::of(a), SceneInputs::of(b));
    assert_eq!(before.objects.len(), after.objects.len(), "{what}");
    for (x, y) in before.objects.iter().zip(&after.objects) {
        assert_eq!((&x.name, x.placement, x.slots.len()), (&y.name, y.placement, y.slots.len()), "{what}");
        match (&x.shape, &y.shape) {
            (Shape::Mesh(x), Shape::Mesh(y)) => assert_eq!(x.positions, y.positions, "{what}"),
            (Shape::Spheres(x), Shape::Spheres(y)) => assert_eq!(x, y, "{what}"),
            (x, y) => assert_eq!(x, y, "{what}"),
        }
    }
    let slide = |light: &LightInput| light.texture.as_ref().map(|LightTexture(texture)| texture.part.clone());
    let lights =
        |inputs: &SceneInputs| inputs.lights.iter().map(|l| (l.light, l.placement, slide(l))).collect::<Vec<_>>();
    assert_eq!(lights(&before), lights(&after), "{what}");
    let camera = |inputs: &SceneInputs| inputs.camera.map(|c| (c.view, c.projection, c.lens));
    assert_eq!(camera(&before), camera(&after), "{what}");
    // The path of its picture may be another one.
    let around = |inputs: &SceneInputs| {
        let text = format!("{:?}", inputs.environment.part);
        (text.split("scale").last().unwrap().to_owned(), inputs.environment.air)
    };
    assert_eq!(around(&before), around(&after), "{what}");
    assert_eq!(before.materials.len(), after.materials.len(), "{what}");
    assert_eq!(a.resource::<Rendering>().0, b.resource::<Rendering>().0, "{what}");
    assert_eq!(a.resource::<DisplaySettings>(), b.resource::<DisplaySettings>(), "{what}");
}

fn picture(world: &mut World, scene: &LoadedScene) -> Vec<Vec3> {
    let extraction = Extraction::new(&SceneInputs::of(world), &scene.trees);
    let mut film = Film::new(24, 16);
    let target = Target { spp: Some(2), ..Target::default() };
    render_offline(&extraction.prepared, &world.resource::<Rendering>().0, &mut film, target, |_| true);
    film.means()
}

#[test]
fn every_builtin_scene_survives_being_saved() {
    let folder = tempfile::tempdir().unwrap();
    for (name, _, _) in BUILTIN_SCENES {
        let (mut world, scene) = builtin(name);
        let path = folder.path().join(format!("{name}.ron"));
        let (mut again, loaded) = through_a_file(&mut world, &scene, &path);
        assert_same(&mut world, &mut again, name);
        assert_eq!(picture(&mut world, &scene), picture(&mut again, &loaded), "{name}");
        // And once more: nothing creeps in.
        let text = std::fs::read_to_string(&path).unwrap();
        assert_eq!(save_scene(&mut again, Some(&loaded), &path).unwrap().text, text, "{name}");
    }
}

fn number() -> impl Strategy<Value = f64> {
    (any::<bool>(), -9.0..5.0_f64, 1.0..10.0_f64)
        .prop_map(|(negative, exponent, digits)| if negative { -1.0 } else { 1.0 } * digits * 10_f64.powf(exponent))
}

fn vector() -> impl Strategy<Value = DVec3> {
    (number(), number(), number()).prop_map(|(x, y, z)| DVec3::new(x, y, z))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn whatever_is_edited_survives_being_saved(
        eye in vector(), towards in vector(), up in vector(),
        (vfov, radius, focus) in (1.0..170.0_f64, 0.0..2.0_f64, 1e-3..1e9_f64),
        (enabled, blades) in (any::<bool>(), 0..9_u32),
        moved in vector(), turned in vector(),
        (ior, intensity, stops) in (1.0..3.0_f32, 0.0..1e6_f32, -9.0..9.0_f32),
    ) {
        let folder = tempfile::tempdir().unwrap();
        let (mut world, scene) = builtin("cornell-balls");
        let view = View::look_at(eye, eye + towards, up);
        prop_assume!(view.is_ok());
        let lens = Lens { radius, focus_distance: focus, enabled, blades, blade_rotation_deg: 0.1 + turned.x };
        let camera = SceneInputs::of(&mut world).camera.unwrap().entity;
        world.entity_mut(camera).insert((view.unwrap(), Projection::perspective(vfov), lens));
        let objects = SceneInputs::of(&mut world).objects;
        for (i, object) in objects.iter().enumerate() {
            let mut placement = world.get_mut::<Placement>(object.entity).unwrap();
            placement.translation += moved * i as f64;
            if i % 2 == 0 {
                let scale = DVec3::splat(1.0 + 0.01 * i as f64);
                placement.linear = firstlight::scene::Linear::Turned { rotation_deg: turned, scale };
            }
        }
        let glass = SceneInputs::of(&mut world).materials.into_iter();
        for material in glass {
            if let Some(mut material) = world.get_mut::<SurfaceMaterial>(material.entity)
                && let Material::Glass { ior: old, absorption, .. } = &mut material.0
            {
                (*old, *absorption) = (ior, Vec3::splat(intensity));
            }
        }
        world.spawn((
            PointLight { intensity: Vec3::new(intensity, 0.1, 1.0 / 3.0), radius: 0.1 + radius },
            Placement::at(moved),
        ));
        let linear = firstlight::scene::Linear::Turned { rotation_deg: turned, scale: DVec3::splat(radius + 1.0) };
        let place = Placement { linear, ..Placement::at(moved) };
        let (direction, irradiance) = (towards, Vec3::splat(intensity));
        let [inner_angle_deg, outer_angle_deg] = [0.4 * vfov, 0.5 * vfov];
        for placement in [place, Placement::at(eye)] {
            let falloff = Falloff::Linear;
            let image = ImageFrame { up: eye, width_deg: 0.3 * vfov, height_deg: 0.0, even: placement != place };
            let spot = SpotLight { intensity: irradiance, direction, inner_angle_deg, outer_angle_deg, falloff, image };
            let spot = world.spawn((spot, placement)).id();
            if placement == place {
                let (a, b) = (Rgb(Vec3::X), Rgb(Vec3::splat(intensity)));
                let (squares, offset) = (DVec2::splat(3.0), DVec2::X);
                let part = TextureSource::Checker { a, b, squares, offset, rotate: 5.0 };
                let texture = Texture {
                    uv_matrix: Mat2::from_diagonal(Vec2::splat(3.0)) * Mat2::from_angle(5.0_f64.to_radians() as f32),
                    uv_offset: Vec2::X,
                    ..Texture::new(TexturePattern::Checker { a: a.0, b: b.0 })
                };
                let slide = SurfaceTexture { name: "slide".to_owned(), part, texture };
                world.entity_mut(spot).insert(LightTexture(Arc::new(slide)));
            }
            world.spawn((DirectionalLight { irradiance, direction }, placement));
        }
        world.spawn((PointLight { intensity: irradiance, radius: 0.0 }, Placement::at(up)));
        let tip = Shape::Triangle { vertices: [DVec3::ZERO, DVec3::X + 1e-3 * moved, DVec3::Y + 1e-3 * turned] };
        let first = objects[0].slots.clone();
        world.spawn((tip, Placement::at(eye), firstlight::scene::MaterialSlots(first)));
        world.resource_mut::<DisplaySettings>().0.exposure_stops = stops;

        let path = folder.path().join("edited.ron");
        let saved = save_scene(&mut world, Some(&scene), &path);
        prop_assert!(saved.is_ok(), "{saved:?}");
        let (mut again, loaded) = open(SceneSource::Scene(path.clone()));
        assert_same(&mut world, &mut again, "edited");
        prop_assert_eq!(picture(&mut world, &scene), picture(&mut again, &loaded));
    }
}

#[test]
fn files_that_a_scene_points_at_are_found_from_its_new_place() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    std::fs::create_dir_all(path.join("old/parts")).unwrap();
    std::fs::create_dir_all(path.join("new")).unwrap();
    let picture_of = |name: &str| image::RgbImage::from_pixel(2, 2, image::Rgb([9, 99, 199])).save(path.join(name));
    for name in ["old/sky.png", "old/parts/tiles.png", "old/parts/skin.png"] {
        picture_of(name).unwrap();
    }
    let write = |name: &str, text: &str| std::fs::write(path.join(name), text).unwrap();
    write("old/parts/skin.mtl", "newmtl skin\nmap_Kd skin.png\nnewmtl glass\nillum 7\nNi 1.4\n");
    write(
        "old/parts/tent.obj",
        "mtllib skin.mtl\nv 0 0 0\nv 1 0 0\nv 0 0 -1\nv 0 1 0\nvt 0 0\nusemtl skin\nf 1/1 2/1 4/1\nf 2/1 3/1 4/1\nusemtl glass\nf 3/1 1/1 4/1\n",
    );
    write(
        "old/room.ron",
        r#"( // a comment
        camera: (eye: (0, 1, 4), look_at: (0, 0, 0)),
        environment: image(file: "sky.png", rotate: 30),
        textures: { "tiles": image(file: "parts/tiles.png"), "unused": checker(a: 0, b: 1) },
        materials: { "floor": diffuse(albedo: "tiles"), "spare": mirror() },
        objects: [
            mesh(name: "a", source: obj("parts/tent.obj")),
            mesh(name: "b", source: obj("parts/tent.obj"), material: "floor"),
            plane(material: "floor"),
        ])"#,
    );
    let (mut world, scene) = open(SceneSource::Scene(path.join("old/room.ron")));
    let (mut again, loaded) = through_a_file(&mut world, &scene, &path.join("new/room.ron"));
    assert_same(&mut world, &mut again, "moved");
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    let text = std::fs::read_to_string(path.join("new/room.ron")).unwrap();
    for expected in ["../old/parts/tent.obj", "../old/sky.png", "../old/parts/tiles.png", "\"unused\"", "\"spare\""] {
        assert!(text.contains(expected), "expected {expected} in:\n{text}");
    }
    assert!(!text.contains("skin"), "what the mesh's own file says stays there:\n{text}");
    assert_eq!(picture(&mut world, &scene), picture(&mut again, &loaded));

    // Over the old file: paths stay as they were written, and the loss of comments is said.
    let saved = save_scene(&mut world, Some(&scene), &path.join("old/room.ron")).unwrap();
    assert_eq!(saved.notes, ["comments of the previous file were removed"]);
    assert!(saved.text.contains("\"parts/tent.obj\""), "{}", saved.text);

    // A material of the mesh's own file is edited: all of them are then written, one for each slot.
    let slots = SceneInputs::of(&mut world).objects[0].slots.clone();
    world.entity_mut(slots[1]).insert(SurfaceMaterial(Material::Glass {
        ior: 1.7,
        absorption: Vec3::ZERO,
        dispersion: 0.0,
    }));
    let (mut again, loaded) = through_a_file(&mut world, &scene, &path.join("new/edited.ron"));
    assert_same(&mut world, &mut again, "edited slots");
    assert_eq!(picture(&mut world, &scene), picture(&mut again, &loaded));
}

#[test]
fn what_a_program_spawned_is_saved_as_well() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("made.ron");
    let mut world = World::new();
    let mesh = firstlight::mesh::procedural::torus(1.0, 0.3, 24, 12);
    world.spawn((Shape::Mesh(mesh.into()), Placement::at(DVec3::new(0.0, 1.0, -5.0))));
    world.spawn(Shape::Plane { normal: DVec3::Y });
    world.spawn(View { eye: DVec3::new(0.1, 1.0, 2.0), forward: DVec3::NEG_Z, up: DVec3::Y, pivot_distance: 3.0 });
    let saved = save_scene(&mut world, None, &path).unwrap();
    assert_eq!(saved.notes, ["a mesh without a file was saved as made-mesh-1.obj"]);
    let (mut again, loaded) = open(SceneSource::Scene(path));
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    let inputs = SceneInputs::of(&mut again);
    assert_eq!(inputs.camera.unwrap().view.eye, DVec3::new(0.1, 1.0, 2.0));
    let is_torus = |shape: &Shape| matches!(shape, Shape::Mesh(mesh) if mesh.triangles.len() == 2 * 24 * 12);
    assert_eq!(inputs.objects.iter().filter(|object| is_torus(&object.shape)).count(), 1);
    // Surfaces without a material are grey, and stay so.
    let Material::Diffuse { albedo } = &inputs.materials[0].material else { panic!("{:?}", inputs.materials) };
    assert_eq!(format!("{albedo:?}"), "Rgb(Vec3(0.5, 0.5, 0.5))");
}

/// The name of such a mesh may be that of one which the scene reads, or of somebody's own.
#[test]
fn a_mesh_that_is_written_beside_a_scene_takes_the_place_of_no_other() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("made.ron");
    let other = folder.path().join("made-mesh-1.obj");
    std::fs::write(&other, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let mut world = World::new();
    world.spawn(Shape::Mesh(firstlight::mesh::procedural::torus(1.0, 0.3, 24, 12).into()));
    let saved = save_scene(&mut world, None, &path).unwrap();
    assert_eq!(saved.notes, ["a mesh without a file was saved as made-mesh-2.obj"]);
    assert!(saved.text.contains("made-mesh-2.obj"));
    assert_eq!(std::fs::metadata(&other).unwrap().len(), 32);
    // Saved again, it is there already.
    let again = save_scene(&mut world, None, &path).unwrap();
    assert_eq!((again.text, again.notes), (saved.text, vec![]));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 3);
}

#[test]
fn a_scene_that_cannot_be_saved_leaves_the_old_file_alone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("room.ron");
    let (mut world, scene) = builtin("cornell");
    save_scene(&mut world, Some(&scene), &path).unwrap();
    let before = std::fs::read(&path).unwrap();
    world.spawn((Shape::Sphere { radius: f64::NAN }, Placement::default()));
    let error = save_scene(&mut world, Some(&scene), &path).unwrap_err().to_string();
    assert!(error.contains("room.ron: cannot be saved") && error.contains("the radius is NaN"), "{error}");
    assert_eq!(std::fs::read(&path).unwrap(), before);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    let error = save_scene(&mut world, Some(&scene), &folder.path().join("gone/room.ron")).unwrap_err().to_string();
    assert!(error.contains("cannot be saved") || error.contains("there is no folder"), "{error}");
    let _ = Description::of(&mut world, None);
}
