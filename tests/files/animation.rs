//! The section `animation` of a scene file: what it may say, what it makes of the world at a moment, and the way back.

use bevy_ecs::change_detection::DetectChanges;
use bevy_ecs::name::Name;
use bevy_ecs::prelude::{Entity, World};
use firstlight::format::animation::TrackPart;
use firstlight::scene::animation::{Channel, Interpolation};
use firstlight::scene::file::SceneFile;
use firstlight::scene::{
    Animation, Description, Extraction, LightKind, LoadOptions, LoadedScene, ModelChoice, Moment, Placement,
    SceneInputs, SceneSource, SurfaceMaterial, View, load, show_moment,
};
use glam::{DVec3, Vec3};
use std::path::Path;

const MOVING: &str = r#"(
    camera: (eye: (0, 1, 6), look_at: (0, 0.5, 0), vfov: 40, lens_radius: 0.01),
    film: (width: 32, height: 18),
    materials: { "red": diffuse(albedo: (0.8, 0.1, 0.1)), "satin": metal(alpha: 0.2, reflectance: 0.9) },
    objects: [
        plane(material: "satin"),
        sphere(name: "ball", center: (-2, 0.5, 0), radius: 0.5, material: "red"),
        mesh(name: "ring", source: builtin("cube"), material: "satin", transform: (translate: (1, 1, -2), scale: 0.5)),
    ],
    lights: [
        point(name: "lamp", position: (2, 3, 2), intensity: 20, radius: 0),
        spot(name: "spot", position: (0, 3, 0), direction: (0, -1, 0), intensity: 5, outer_angle: 30),
    ],
    animation: (
        fps: 10,
        shutter: 0.5,
        tracks: [
            camera(property: eye, interpolation: smooth, keys: [(0, (0, 1, 6)), (1, (2, 1, 5)), (4, (4, 2, 4))]),
            camera(property: vfov, keys: [(0, 40), (4, 20)]),
            object(name: "ball", property: translate, keys: [(1, (-2, 0.5, 0)), (3, (2, 0.5, 1))]),
            object(name: "ring", property: rotate, keys: [(0, (0, 0, 0)), (4, (0, 720, 0))]),
            object(name: "ring", property: scale, keys: [(0, 0.5), (4, (1, 0.5, 0.5))]),
            light(name: "lamp", property: intensity, interpolation: held, keys: [(0, 20), (2, (30, 20, 10))]),
            light(name: "spot", property: outer_angle, keys: [(0, 30), (2, 60)]),
            light(name: "spot", property: inner_angle, keys: [(0, 0), (2, 50)]),
            material(name: "red", property: albedo, keys: [(0, (0.8, 0.1, 0.1)), (2, 0.4)]),
        ],
    ),
)"#;

fn open_at(text: &str, at: Option<f64>) -> (World, LoadedScene) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.ron");
    std::fs::write(&path, text).unwrap();
    let choice = ModelChoice { at, ..ModelChoice::default() };
    let options = LoadOptions { choice: Some(&choice), ..LoadOptions::default() };
    let loaded = load(&SceneSource::Scene(path), &options).unwrap_or_else(|error| panic!("{error}"));
    // A moment after the end is told, and nothing else.
    let told = at.is_some_and(|at| at > 4.0);
    assert!(loaded.warnings.iter().all(|warning| told && warning.contains("ends at 4 s")), "{:?}", loaded.warnings);
    let mut world = World::new();
    loaded.spawn(&mut world);
    (world, loaded)
}

fn called(world: &mut World, wanted: &str) -> Entity {
    let mut names = world.query::<(Entity, &Name)>();
    names.iter(world).find(|(_, name)| name.as_str() == wanted).unwrap().0
}

fn errors(text: &str) -> String {
    SceneFile::parse(text, Path::new("a.ron")).map(|_| String::new()).unwrap_or_else(|error| error.to_string())
}

#[test]
fn a_moment_has_the_values_of_its_tracks() {
    let (mut world, _) = open_at(MOVING, Some(2.0));
    let (ball, ring, lamp) = (called(&mut world, "ball"), called(&mut world, "ring"), called(&mut world, "lamp"));
    let (spot, red) = (called(&mut world, "spot"), called(&mut world, "red"));
    assert_eq!(world.get::<Placement>(ball).unwrap().translation, DVec3::new(0.0, 0.5, 0.5));
    // Two turns in four seconds: one by now.
    let ring = world.get::<Placement>(ring).unwrap().to_part();
    assert_eq!((ring.rotate, ring.scale.unwrap().0), (Some(DVec3::new(0.0, 360.0, 0.0)), DVec3::new(0.75, 0.5, 0.5)));
    assert_eq!(firstlight::scene::light_of(&world, lamp).unwrap().strength(), Vec3::new(30.0, 20.0, 10.0));
    let Some(LightKind::Spot(spot)) = firstlight::scene::light_of(&world, spot) else { panic!() };
    assert_eq!((spot.inner_angle_deg, spot.outer_angle_deg), (50.0, 60.0));
    let material = SurfaceMaterial::of(&world, red).unwrap();
    assert_eq!(format!("{material:?}"), "Diffuse { albedo: Rgb(Vec3(0.4, 0.4, 0.4)) }");
    let camera = SceneInputs::of(&mut world).camera.unwrap();
    assert_eq!(camera.projection.vfov_deg, 30.0);
    // The pivot and the focus stay where they are.
    assert!((camera.view.pivot() - DVec3::new(0.0, 0.5, 0.0)).length() < 1e-12);
    assert_eq!(camera.lens.focus_distance, camera.view.pivot_distance);
}

#[test]
fn a_moment_depends_on_nothing_but_the_time() {
    let (mut wandered, _) = open_at(MOVING, None);
    for seconds in [0.3, 9.0, 1.7, 0.0, 2.9] {
        show_moment(&mut wandered, seconds);
        let (mut direct, _) = open_at(MOVING, Some(seconds));
        let (here, there) = (SceneInputs::of(&mut wandered), SceneInputs::of(&mut direct));
        assert_eq!((here.camera, &here.materials), (there.camera, &there.materials), "{seconds}");
        let placements = |inputs: &SceneInputs| inputs.objects.iter().map(|it| it.placement).collect::<Vec<_>>();
        assert_eq!(placements(&here), placements(&there));
        assert_eq!(here.lights, there.lights);
    }
}

#[test]
fn only_what_is_different_is_touched() {
    let (mut world, _) = open_at(MOVING, None);
    let (ball, ring) = (called(&mut world, "ball"), called(&mut world, "ring"));
    world.clear_trackers();
    let is_touched = |world: &World, entity: Entity| world.entity(entity).get_ref::<Placement>().unwrap().is_changed();
    // The ball rests until the first second.
    show_moment(&mut world, 0.5);
    assert!(is_touched(&world, ring) && !is_touched(&world, ball));
    world.clear_trackers();
    show_moment(&mut world, 0.5);
    assert!(!is_touched(&world, ring));
    assert!(!world.query::<bevy_ecs::prelude::Ref<View>>().iter(&world).any(|view| view.is_changed()));
}

#[test]
fn snapshots_of_a_moment_are_those_of_its_world() {
    let (mut world, loaded) = open_at(MOVING, None);
    let inputs = SceneInputs::of(&mut world);
    let base = Extraction::new(&inputs, &loaded.trees);
    let animation = world.resource::<Animation>().clone();
    for seconds in [0.0, 0.5, 1.5, 7.0] {
        let moment = base.at(&animation, &inputs, &loaded.trees, seconds);
        let (mut direct, loaded) = open_at(MOVING, Some(seconds));
        let direct = Extraction::new(&SceneInputs::of(&mut direct), &loaded.trees);
        assert_eq!(moment.camera, direct.prepared.camera, "{seconds}");
        assert_eq!(moment.shading.materials, direct.prepared.shading.materials);
        assert_eq!(moment.shading.delta_lights, direct.prepared.shading.delta_lights);
        let shapes = |prepared: &firstlight::render::Prepared| -> Vec<String> {
            let describe = |shape: &firstlight::kdtree::Shape| match shape {
                firstlight::kdtree::Shape::Mesh { world_from_object, .. } => format!("{world_from_object:?}"),
                shape => format!("{shape:?}"),
            };
            prepared.geometry.tree.shapes().iter().map(describe).collect()
        };
        assert_eq!(shapes(&moment), shapes(&direct.prepared));
    }
    // The world is left alone.
    assert_eq!(SceneInputs::of(&mut world), inputs);
}

#[test]
fn still_times_are_known() {
    let (world, _) = open_at(MOVING, None);
    let animation = world.resource::<Animation>();
    assert!(animation.is_moving_during(0.0..=0.1) && !animation.is_moving_during(4.0..=9.0));
    assert_eq!(animation.open_shutter(1.0), Some(0.975..=1.025));
    assert_eq!(animation.open_shutter(5.0), None);
    assert_eq!((animation.length(), animation.n_frames()), (4.0, 41));
}

#[test]
fn an_animation_is_saved_as_it_was_read() {
    let written = SceneFile::parse(MOVING, "a.ron").unwrap();
    for at in [0.0, 1.25, 9.0] {
        let (mut world, loaded) = open_at(MOVING, Some(at));
        let description = Description::of(&mut world, Some(&loaded));
        assert_eq!(description.losses, Vec::<String>::new());
        let text = description.file.to_ron();
        let again = SceneFile::parse(&text, "b.ron").unwrap_or_else(|error| panic!("{error}\n{text}"));
        assert_eq!(again, description.file);
        assert_eq!((&again.animation.tracks, again.animation.at), (&written.animation.tracks, at), "{text}");
        assert_eq!(again.animation.shutter, Some(0.5));
        assert_eq!((again.camera.look_at, again.camera.lens_radius), (written.camera.look_at, Some(0.01)));
        // What is read from it shows the same moment.
        let (mut other, _) = open_at(&text, None);
        assert_eq!(other.resource::<Moment>().0, at);
        let (here, there) = (SceneInputs::of(&mut world), SceneInputs::of(&mut other));
        assert_eq!(
            (here.camera.map(|c| c.view), here.lights.len()),
            (there.camera.map(|c| c.view), there.lights.len())
        );
    }
}

#[test]
fn what_moves_keeps_its_keys_under_a_new_name() {
    let (mut world, loaded) = open_at(MOVING, None);
    let (ball, ring, red) = (called(&mut world, "ball"), called(&mut world, "ring"), called(&mut world, "red"));
    // The same name twice, and none.
    world.entity_mut(ball).insert(Name::new("ring"));
    world.entity_mut(ring).remove::<Name>();
    world.entity_mut(red).insert(Name::new("ruby"));
    let text = Description::of(&mut world, Some(&loaded)).file.to_ron();
    let (mut again, _) = open_at(&text, None);
    let animation = again.resource::<Animation>().clone();
    assert_eq!(animation.tracks.len(), 9);
    show_moment(&mut again, 3.0);
    let ball = called(&mut again, "ring");
    assert_eq!(again.get::<Placement>(ball).unwrap().translation, DVec3::new(2.0, 0.5, 1.0));
    assert!(animation.tracks.iter().any(|track| matches!(track.channel, Channel::Material(..))));
    // A material of another kind has no such number any more: that is told.
    world.entity_mut(red).insert(SurfaceMaterial(firstlight::scene::Material::Glass {
        ior: 1.5,
        absorption: Vec3::ZERO,
        dispersion: 0.0,
    }));
    let description = Description::of(&mut world, Some(&loaded));
    assert_eq!(description.losses.len(), 1, "{:?}", description.losses);
    assert!(description.losses[0].contains("`albedo`") && description.losses[0].contains("`ruby`"));
    assert_eq!(description.file.animation.tracks.len(), 8);
}

#[test]
fn many_things_that_move_are_described_at_once() {
    // Minutes if each were looked for among all others.
    const N: usize = 30_000;
    let all = |line: &dyn Fn(usize) -> String| -> String { (0..N).map(line).collect() };
    let spheres = all(&|i| format!("sphere(name: \"s{i}\", center: ({i}, 0, 0), radius: 0.1, material: \"m\"),\n"));
    let lights = all(&|i| format!("point(name: \"p{i}\", position: ({i}, 3, 0), intensity: 1, radius: 0),\n"));
    let tracks = all(&|i| {
        format!(
            "object(name: \"s{i}\", property: translate, keys: [(0, ({i}, 0, 0)), (1, ({i}, 1, 0))]),\n\
             light(name: \"p{i}\", property: intensity, keys: [(0, 1), (1, 2)]),\n"
        )
    });
    let (mut world, loaded) = open_at(
        &format!(
            "(camera: (eye: (0, 1, 6), look_at: (0, 0, 0)), materials: {{ \"m\": diffuse(albedo: 0.5) }},\n\
             objects: [{spheres}], lights: [{lights}], animation: (tracks: [{tracks}]))"
        ),
        None,
    );
    let part = Description::of(&mut world, Some(&loaded)).file.animation;
    assert_eq!(part.tracks, loaded.file.animation.tracks);
    // Those that have one name get numbers, those without one as well.
    for entity in SceneInputs::of(&mut world).objects.iter().map(|object| object.entity) {
        world.entity_mut(entity).insert(Name::new("s"));
    }
    for entity in SceneInputs::of(&mut world).lights.iter().map(|light| light.entity) {
        world.entity_mut(entity).remove::<Name>();
    }
    let part = Description::of(&mut world, Some(&loaded)).file.animation;
    let wanted = (0..N).flat_map(|i| [format!("s {}", i + 2), format!("light {}", i + 2)]);
    let named = |track: &TrackPart| match track {
        TrackPart::Object { name, .. } | TrackPart::Light { name, .. } => name.clone(),
        other => panic!("{other:?}"),
    };
    assert!(part.tracks.iter().map(named).eq(wanted));
}

#[test]
fn a_camera_that_was_moved_by_hand_keeps_what_has_no_keys() {
    let (mut world, _) = open_at(MOVING, None);
    let camera = SceneInputs::of(&mut world).camera.unwrap();
    let lens = firstlight::scene::Lens { radius: 0.2, focus_distance: 3.0, ..camera.lens };
    let view = View { eye: DVec3::new(9.0, 9.0, 9.0), ..camera.view };
    world.entity_mut(camera.entity).insert((lens, view));
    show_moment(&mut world, 4.0);
    let camera = SceneInputs::of(&mut world).camera.unwrap();
    assert_eq!((camera.lens.radius, camera.lens.focus_distance), (0.2, 3.0));
    // Its eye has keys.
    assert_eq!((camera.view.eye, camera.projection.vfov_deg), (DVec3::new(4.0, 2.0, 4.0), 20.0));
}

/// Neither the focus of a pinhole, nor an aperture that is closed, is an edit: what is written is the camera on its way.
#[test]
fn what_a_pinhole_hides_changes_nothing_of_a_camera_with_tracks() {
    let pinhole = MOVING.replace("lens_radius: 0.01", "lens_radius: 0.01, depth_of_field: false");
    let opening = MOVING.replace(", lens_radius: 0.01", ", focus_distance: 2").replace(
        "camera(property: vfov, keys: [(0, 40), (4, 20)])",
        "camera(property: lens_radius, keys: [(0.29, 0), (4, 1)])",
    );
    for (text, radius) in [(pinhole, 0.01), (opening, 0.373)] {
        let (mut world, loaded) = open_at(&text, Some(0.29));
        let camera = SceneInputs::of(&mut world).camera.unwrap();
        assert!(!camera.lens.enabled);
        let lens = firstlight::scene::Lens { radius, focus_distance: 3.7, ..camera.lens };
        world.entity_mut(camera.entity).insert(lens);
        let file = Description::of(&mut world, Some(&loaded)).file;
        assert_eq!((file.camera, file.animation.edited.camera), (loaded.file.camera.clone(), None));
    }
}

/// A scene with one track more, or another line in its animation.
fn with(line: &str) -> String {
    MOVING.replace("        tracks: [\n", &format!("        tracks: [\n            {line}\n"))
}

#[test]
fn keys_turn_and_scale_what_a_matrix_places_unless_it_is_sheared() {
    let placed = |matrix: &str| {
        let parts = "(translate: (1, 1, -2), scale: 0.5)";
        let scene = MOVING.replace(parts, &format!("(matrix: {matrix})"));
        scene.replace("object(name: \"ring\", property: scale, keys: [(0, 0.5), (4, (1, 0.5, 0.5))]),", "")
    };
    let plain = placed("((0.5, 0, 0, 1), (0, 0.25, 0, 1), (0, 0, 0.5, -2))");
    let (mut world, _) = open_at(&plain, Some(1.0));
    let ring = called(&mut world, "ring");
    // Half of a turn about the vertical.
    let found = world.get::<Placement>(ring).unwrap().affine().transform_point3(DVec3::new(2.0, 4.0, 0.0));
    assert!(found.abs_diff_eq(DVec3::new(0.0, 2.0, -2.0), 1e-12), "{found}");
    let error = errors(&placed("((0.5, 0.1, 0, 1), (0, 0.5, 0, 1), (0, 0, 0.5, -2))"));
    assert!(error.contains("`rotate` needs a transform without shear"), "{error}");
}

#[test]
fn mistakes_have_a_place_and_a_name() {
    let line = MOVING.lines().position(|line| line.contains("tracks: [")).unwrap() + 2;
    let at = |column: usize| format!("a.ron:{line}:{column}: ");
    let cases = [
        (r#"object(name: "bal", property: scale, keys: [(0, 1)]),"#, at(20), "no object `bal` (did you mean `ball`?)"),
        (r#"object(name: "ball", property: scal, keys: [(0, 1)]),"#, at(44), "property `scal` (did you mean `scale`?)"),
        (r#"object(name: "ball", property: scale, kes: [(0, 1)]),"#, at(51), "unknown field `kes`"),
        (r#"object(name: "ball", property: scale, keys: []),"#, at(51), "there are no keys"),
        (r#"object(name: "ball", property: scale, keys: [(0, 1), (0, 2)]),"#, at(67), "keys go forwards in time"),
        (r#"object(name: "ball", property: scale, keys: [(-1, 1)]),"#, at(59), "lie between 0 and 1e6 s"),
        (r#"object(name: "ball", property: scale, keys: [(0, (1, 2, 1))]),"#, at(62), "uniform scale"),
        (r#"object(name: "ball", property: scale, keys: [(0, 1), (1, -1)]),"#, at(70), "passes 0"),
        (r#"object(name: "ball", property: rotate, keys: [(0, 5)]),"#, at(63), "`rotate` has three numbers"),
        (r#"object(name: "ball", property: translate, keys: [(0, (0, 0, 0))]),"#, String::new(), "has two tracks"),
        (r#"camera(property: lens_radius, keys: [(0, (1, 2, 3))]),"#, at(54), "`lens_radius` is a number"),
        (
            r#"camera(property: lens_radius, keys: [(0, 0.1), (1, -1)]),"#,
            at(64),
            "`lens_radius` is -1, but must be 0 or",
        ),
        (r#"camera(property: look_at, keys: [(0, (0, 0, 0)), (1, (2, 1, 5))]),"#, String::new(), "the same point"),
        (
            r#"light(name: "lamp", property: outer_angle, keys: [(0, 9)]),"#,
            at(33),
            "a point light has no `outer_angle`",
        ),
        (r#"light(name: "lamp", property: radius, keys: [(0, -9)]),"#, at(62), "`radius` is -9"),
        (r#"light(name: "spot", property: direction, keys: [(0, (0, 1, 0)), (1, (0, -1, 0))]),"#, at(81), "opposite"),
        (r#"material(name: "red", property: alpha, keys: [(0, 1)]),"#, at(35), "is diffuse and has no `alpha`"),
        (
            r#"material(name: "satin", property: alpha, keys: [(0, 1), (1, 2)]),"#,
            at(73),
            "`alpha` is 2, but must lie between",
        ),
        (r#"material(name: "rd", property: albedo, keys: [(0, 1)]),"#, at(22), "(did you mean `red`?)"),
        (
            r#"material(name: "satin", property: alpha, interpolation: smoth, keys: [(0, 1)]),"#,
            at(69),
            "(did you mean `smooth`?)",
        ),
    ];
    for (text, place, told) in cases {
        let error = errors(&with(text));
        assert!(error.contains(&place) && error.contains(told), "{text}\nexpected {place}{told}\nfound    {error}");
        assert_eq!(error.lines().count(), 1, "{error}");
    }
    let fields = [
        ("fps: 0", "`fps` is 0, but must lie between 0.001 and 10000"),
        ("fps: 10, shutter_seconds: 0.1", "`shutter` and `shutter_seconds` exclude each other"),
        ("fps: 10, duration: 0", "`duration` is 0"),
        ("fps: 10, at: inf", "`at` is inf"),
        ("fps: 10, edited: (objects: [\"plane\"])", "object `plane` has no track"),
        ("fps: 10, edited: (lights: [\"lam\"])", "light `lam` has no track (did you mean `lamp`?)"),
        ("fps: 10, edited: (camera: (eye: (0, 0, 1), look_at: (0, 0, 1)))", "are the same point"),
        ("fp: 10", "unknown field `fp` of `animation` (did you mean `fps`?)"),
    ];
    for (field, told) in fields {
        let error = errors(&MOVING.replace("fps: 10", field));
        assert!(error.contains(told), "{field}: {error}");
    }
    assert!(errors(&MOVING.replace("shutter: 0.5", "shutter: 1.5")).contains("`shutter` is 1.5"));
    let twice = MOVING.replace("plane(material", "sphere(name: \"ball\", radius: 1, material");
    assert!(errors(&twice).contains("2 objects are called `ball`"));
}

/// The keys of a material that no object uses are checked like all others.
#[test]
fn keys_of_a_lost_property_are_left_out_and_told() {
    let (mut world, _) = open_at(MOVING, Some(1.0));
    let (ball, red) = (called(&mut world, "ball"), called(&mut world, "red"));
    world.despawn(ball);
    let mirror = firstlight::scene::Material::Mirror { reflectance: Vec3::splat(0.5).into() };
    *world.get_mut::<SurfaceMaterial>(red).unwrap() = SurfaceMaterial(mirror);
    let part = Description::of(&mut world, None);
    part.file.check().unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(part.losses, ["the keys of `albedo` are left out: `red` has no `albedo` any more"]);
    assert_eq!(part.file.animation.edited, Default::default());
}

/// What was changed without a key is shown until another time is.
#[test]
fn edits_of_what_has_tracks_are_saved_beside_them() {
    let (mut world, _) = open_at(MOVING, Some(1.0));
    let (ball, lamp, red) = (called(&mut world, "ball"), called(&mut world, "lamp"), called(&mut world, "red"));
    world.get_mut::<Placement>(ball).unwrap().translation.y = 2.0;
    world.get_mut::<firstlight::scene::PointLight>(lamp).unwrap().intensity = Vec3::splat(3.0);
    let green = firstlight::scene::Material::Diffuse { albedo: Vec3::new(0.1, 0.7, 0.1).into() };
    *world.get_mut::<SurfaceMaterial>(red).unwrap() = SurfaceMaterial(green);
    for mut view in world.query::<&mut View>().iter_mut(&mut world) {
        view.eye.y = 3.0;
    }
    let part = Description::of(&mut world, None);
    let edited = &part.file.animation.edited;
    assert_eq!((&edited.objects[..], &edited.lights[..]), (&["ball".to_owned()][..], &["lamp".to_owned()][..]));
    assert_eq!(edited.materials, ["red"]);
    let text = part.file.to_ron();
    let inputs = |world: &mut World| {
        let SceneInputs { objects, lights, materials, camera, .. } = SceneInputs::of(world);
        let placements: Vec<_> = objects.iter().map(|object| object.placement).collect();
        let lights: Vec<_> = lights.iter().map(|light| (light.light, light.placement)).collect();
        let materials: Vec<_> = materials.into_iter().map(|material| material.material).collect();
        let camera = camera.unwrap();
        (placements, lights, materials, (camera.view, camera.projection, camera.lens))
    };
    let (mut again, _) = open_at(&text, None);
    assert_eq!(inputs(&mut again), inputs(&mut world));
    // At another time both are the same, too, and so is what is opened there.
    show_moment(&mut again, 2.0);
    show_moment(&mut world, 2.0);
    let there = inputs(&mut world);
    assert_eq!(inputs(&mut again), there);
    assert_eq!(inputs(&mut open_at(&text, Some(2.0)).0), there);
    assert_eq!(there.0, inputs(&mut open_at(MOVING, Some(2.0)).0).0);
}

#[test]
fn a_moment_beyond_reach_is_refused_and_one_without_tracks_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.ron");
    let open = |text: &str, at: f64| {
        std::fs::write(&path, text).unwrap();
        let choice = ModelChoice { at: Some(at), ..ModelChoice::default() };
        load(&SceneSource::Scene(path.clone()), &LoadOptions { choice: Some(&choice), ..LoadOptions::default() })
    };
    let error = open(MOVING, -1.0).err().unwrap().to_string();
    assert!(error.contains("`--at` is -1, but must lie between 0 and 1e6 s"), "{error}");
    let still = &MOVING[..MOVING.find("    animation:").unwrap()];
    let warnings = open(&format!("{still})"), 1.0).unwrap().warnings;
    assert!(warnings.len() == 1 && warnings[0].contains("no animation"), "{warnings:?}");
    // As an archive may say it.
    let warnings = open(&format!("{still})"), 1e300).unwrap().warnings;
    assert!(warnings.len() == 1 && warnings[0].contains("no animation: 1e300 s shows"), "{warnings:?}");
    assert_eq!(Interpolation::default(), Interpolation::Linear);
}
