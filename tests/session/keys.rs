//! Keys that are set in a session: they are what was shown, can be undone, and are in the file that is saved.

use crate::driver::{Drive, of_material};
use firstlight::frame::{Command, Edit, MessageKind, Property, Reel, Session, SessionOptions, Target, render_offline};
use firstlight::render::Film;
use firstlight::scene::animation::{Interpolation, KeyValue, LightProperty, ObjectProperty, Shutter};
use firstlight::scene::{Animation, Extraction, LoadOptions, Moment, Rendering, SceneInputs, SceneSource, load};
use glam::DVec3;
use std::path::Path;
use std::time::Instant;

const STILL: &str = r#"(
    camera: (eye: (0, 1, 6), look_at: (0, 0.5, 0)),
    environment: constant(1),
    materials: { "red": diffuse(albedo: 0.5) },
    objects: [sphere(name: "ball", center: (0, 0.5, 0), radius: 0.5, material: "red")],
    lights: [directional(name: "sun", direction: (0, -1, 0), irradiance: 1)],
)"#;

struct Driver {
    session: Session,
    start: Instant,
    id: u64,
}

const SPP: Target = Target { spp: Some(4), seconds: None, error: None };

impl Drive for Driver {
    fn session(&mut self) -> (&mut Session, Instant) {
        (&mut self.session, self.start)
    }
}

impl Driver {
    fn open(folder: &Path, name: &str, text: &str) -> Self {
        let path = folder.join(name);
        std::fs::write(&path, text).unwrap();
        let options =
            SessionOptions { width: 40, height: 30, threads: Some(2), target: SPP, ..SessionOptions::default() };
        let mut session = Session::new(options).unwrap();
        let source = if name.ends_with(".ron") { SceneSource::Scene(path) } else { SceneSource::Model(path) };
        session.open(source);
        let mut driver = Self { session, start: Instant::now(), id: 0 };
        driver.settle();
        driver.id = driver.inputs().objects[0].entity.to_bits();
        driver
    }

    fn go_to(&mut self, seconds: f64) {
        self.session.send(Command::SetMoment { seconds: Some(seconds) });
        self.frame();
    }

    fn inputs(&mut self) -> SceneInputs {
        SceneInputs::of(self.session.world_mut())
    }

    fn ball(&mut self) -> DVec3 {
        self.inputs().objects[0].placement.translation
    }

    fn animation(&self) -> Option<&Animation> {
        self.session.world().get_resource()
    }

    /// Property, times and interpolation of each track.
    fn tracks(&self) -> Vec<(&'static str, Vec<f64>, Interpolation)> {
        let tracks = self.animation().into_iter().flat_map(|animation| &animation.tracks);
        let times = |keys: &[(f64, KeyValue)]| keys.iter().map(|&(time, _)| time).collect();
        tracks.map(|track| (track.channel.property(), times(&track.curve.keys), track.curve.interpolation)).collect()
    }

    fn said(&self, kind: MessageKind) -> String {
        let messages = self.session.status().messages.iter().filter(|message| message.kind == kind);
        messages.map(|message| message.text.as_str()).collect::<Vec<_>>().join("\n")
    }

    fn save(&mut self, path: &Path) {
        self.session.send(Command::SaveScene { path: path.to_path_buf() });
        self.run_until(|session| session.status().messages.iter().any(|message| message.text.contains("saved")));
    }
}

const KEY: Edit = Edit::SetKeys { camera: false };

#[test]
fn a_still_scene_gets_an_animation_by_moving_things_and_setting_keys() {
    let folder = tempfile::tempdir().unwrap();
    let mut driver = Driver::open(folder.path(), "s.ron", STILL);
    let id = driver.id;
    driver.go_to(2.0);
    assert!(!driver.session.has_unsaved_edits() && driver.animation().is_none());
    driver.edit([Edit::Select { id, add: false }, Edit::Move { by: DVec3::X }, KEY]);
    assert_eq!(driver.tracks(), [("translate", vec![0.0, 2.0], Interpolation::Linear)]);
    assert!(driver.said(MessageKind::Note).contains("keys at frame 48: translate of `ball`"));
    assert!(driver.session.has_unsaved_edits());
    driver.go_to(1.0);
    assert_eq!(driver.ball(), DVec3::new(0.5, 0.5, 0.0));

    // The key alone is undone, then the motion; both come back, and the key is the same when it is set again.
    driver.go_to(2.0);
    driver.edit([Edit::Undo]);
    driver.edit([Edit::Undo]);
    assert!(driver.animation().is_none());
    assert_eq!(driver.ball(), DVec3::new(1.0, 0.5, 0.0));
    driver.edit([KEY]);
    assert_eq!(driver.tracks(), [("translate", vec![0.0, 2.0], Interpolation::Linear)]);
    driver.edit([Edit::Undo, Edit::Undo]);
    assert_eq!(driver.ball(), DVec3::new(0.0, 0.5, 0.0));
    assert!(!driver.session.has_unsaved_edits());
    driver.edit([Edit::Redo, Edit::Redo]);
    assert_eq!(driver.tracks().len(), 1);

    // Numbers of materials and lights, and the camera where nothing else was changed.
    let material = driver.inputs().materials[0].entity.to_bits();
    let sun = driver.inputs().lights[0].entity.to_bits();
    let set = |id, property, value: f64| Edit::Set { id, property, value: DVec3::splat(value) };
    driver.edit([
        set(material, of_material("albedo"), 0.7),
        set(sun, Property::Light(LightProperty::Irradiance), 3.0),
        KEY,
    ]);
    driver.session.send(Command::Orbit { yaw_deg: 30.0, pitch_deg: 5.0 });
    driver.edit([Edit::SelectNone, KEY]);
    let names: Vec<&str> = driver.tracks().iter().map(|(name, ..)| *name).collect();
    assert_eq!(names, ["translate", "irradiance", "albedo", "eye", "look_at"]);
    driver.edit([Edit::Interpolate { how: Interpolation::Smooth }, set(0, Property::FramesPerSecond, 10.0)]);
    driver.go_to(0.8);
    driver.settle();
    let shown = driver.inputs();

    // The file that is saved says the same.
    let path = folder.path().join("saved.ron");
    driver.save(&path);
    assert!(!driver.session.has_unsaved_edits());
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(text.contains("0.7") && !text.contains("0.69999"), "{text}");
    let mut again = Driver::open(folder.path(), "again.ron", &text);
    assert_eq!(again.tracks(), driver.tracks());
    let inputs = again.inputs();
    assert_eq!(inputs.objects[0].placement, shown.objects[0].placement);
    assert_eq!(inputs.materials[0].material, shown.materials[0].material);
    let camera = |inputs: &SceneInputs| inputs.camera.map(|it| (it.view, it.projection, it.lens));
    assert_eq!((&inputs.lights[0].light, camera(&inputs)), (&shown.lights[0].light, camera(&shown)));
    assert!(again.session.film_snapshot().unwrap().means() == driver.session.film_snapshot().unwrap().means());

    // Keys are deleted where they are.
    driver.edit([Edit::DeleteKeys]);
    assert!(driver.said(MessageKind::Warning).contains("there are no keys at frame 8"));
    driver.go_to(0.0);
    driver.edit([Edit::Select { id, add: false }, Edit::DeleteKeys]);
    assert_eq!(driver.tracks()[0].1, [2.0]);
}

#[test]
fn with_an_open_shutter_what_has_got_a_key_is_blurred_as_in_the_saved_file() {
    let folder = tempfile::tempdir().unwrap();
    let mut driver = Driver::open(folder.path(), "s.ron", STILL);
    let id = driver.id;
    let shutter = |share: f64| Edit::Set { id: 0, property: Property::Shutter, value: DVec3::splat(share) };
    let rate = Edit::Set { id: 0, property: Property::FramesPerSecond, value: DVec3::ONE };
    driver.edit([shutter(1.0), rate]);
    assert_eq!(driver.animation().unwrap().shutter, Shutter::Share(1.0));
    driver.go_to(1.0);
    driver.edit([Edit::Select { id, add: false }, Edit::Move { by: DVec3::X }, KEY]);
    driver.go_to(0.5);
    driver.settle();
    let film_of = |path: &Path| {
        let scene = load(&SceneSource::Scene(path.to_path_buf()), &LoadOptions::default()).unwrap();
        let mut world = bevy_ecs::world::World::new();
        scene.spawn(&mut world);
        assert_eq!(world.resource::<Moment>().0, 0.5);
        let inputs = SceneInputs::of(&mut world);
        let extraction = Extraction::of_world(&mut world, &inputs, &scene.trees);
        let mut film = Film::new(40, 30);
        render_offline(&extraction.prepared, &world.resource::<Rendering>().0, &mut film, SPP, |_| true);
        film.means()
    };
    let save = |driver: &mut Driver, name: &str| {
        let path = folder.path().join(name);
        driver.session.send(Command::SaveScene { path: path.clone() });
        driver.run_until(|_| path.exists());
        driver.settle();
        film_of(&path)
    };
    let blurred = save(&mut driver, "blurred.ron");
    assert!(driver.session.film_snapshot().unwrap().means() == blurred);
    // Another key at the shown moment, while the shutter is open, restarts with the new motion.
    driver.edit([Edit::Move { by: 2.0 * DVec3::Y }, KEY]);
    driver.settle();
    let other = save(&mut driver, "other.ron");
    assert!(other != blurred && driver.session.film_snapshot().unwrap().means() == other);
    driver.edit([shutter(0.0)]);
    driver.settle();
    let sharp = save(&mut driver, "sharp.ron");
    assert!(sharp != other && driver.session.film_snapshot().unwrap().means() == sharp);
}

#[test]
fn a_change_that_tracks_would_take_back_is_told_at_once_and_nothing_is_unsaved_when_it_is_gone() {
    let folder = tempfile::tempdir().unwrap();
    let tracks = "animation: (tracks: [object(name: \"ball\", property: translate, \
                  keys: [(0, (0, 0.5, 0)), (2, (2, 0.5, 0))])])";
    let text = STILL.trim_end().trim_end_matches(')').to_owned() + tracks + ")";
    let mut driver = Driver::open(folder.path(), "s.ron", &text);
    let id = driver.id;
    let told = |driver: &Driver| driver.said(MessageKind::Note).matches("Set key (Ctrl+K) keeps").count();
    driver.go_to(1.0);
    // Its size has no track.
    let radius = |value: f64| Edit::Set { id, property: Property::SphereRadius, value: DVec3::splat(value) };
    driver.edit([Edit::Select { id, add: false }, radius(0.4), radius(0.5)]);
    assert_eq!(told(&driver), 0);
    driver.edit([Edit::Begin, Edit::Move { by: DVec3::Y }]);
    assert_eq!(told(&driver), 1, "{}", driver.said(MessageKind::Note));
    driver.edit([Edit::Move { by: 2.0 * DVec3::Y }, Edit::End]);
    assert!(told(&driver) == 1 && driver.session.has_unsaved_edits(), "a file can hold it");
    assert!(driver.session.needs_keys());
    driver.go_to(2.0);
    assert!(
        driver.said(MessageKind::Note).contains("`ball` follows its animation again: Ctrl+Z brings your change back")
    );
    assert!(!driver.session.needs_keys());
    assert_eq!(driver.ball(), DVec3::new(2.0, 0.5, 0.0));
    assert!(!driver.session.has_unsaved_edits());
    driver.edit([Edit::Undo]);
    assert_eq!(driver.ball(), DVec3::new(1.0, 2.5, 0.0), "one step back, it is there again");
    driver.edit([KEY]);
    assert_eq!(driver.tracks(), [("translate", vec![0.0, 1.0, 2.0], Interpolation::Linear)]);
    // What stays is unsaved.
    driver.edit([Edit::Undo, Edit::Undo, radius(0.4), Edit::Move { by: DVec3::Y }]);
    driver.go_to(2.0);
    assert!(driver.session.has_unsaved_edits());
}

#[test]
fn keys_that_no_file_could_hold_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mut driver = Driver::open(folder.path(), "s.ron", STILL);
    driver.go_to(1.0);
    let sun = driver.inputs().lights[0].entity.to_bits();
    driver.edit([Edit::Set { id: sun, property: Property::Light(LightProperty::Direction), value: DVec3::Y }, KEY]);
    let said = driver.said(MessageKind::Warning);
    assert!(said.contains("`direction` is opposite to the key before"), "{said}");
    assert!(driver.animation().is_none());
    // The stored pose of a model is at no time.
    let mut driver = Driver::open(folder.path(), "m.gltf", &super::living_files::moving_triangle());
    driver.edit([KEY]);
    let said = driver.said(MessageKind::Warning);
    assert!(said.contains("the stored pose of the model has no time") && driver.animation().is_none(), "{said}");
}

#[test]
fn keys_take_the_place_of_what_a_model_does() {
    let folder = tempfile::tempdir().unwrap();
    let mut driver = Driver::open(folder.path(), "m.gltf", &super::living_files::moving_triangle());
    driver.go_to(1.0);
    driver.run_until(|session| session.world().get_resource::<Animation>().is_some());
    driver.settle();
    let mover = |driver: &mut Driver| {
        let inputs = driver.inputs();
        let found = inputs.objects.iter().find(|object| object.name.as_deref() == Some("mover")).unwrap();
        (found.entity.to_bits(), found.placement.translation)
    };
    let (id, there) = mover(&mut driver);
    assert_eq!(there.x, 0.5);
    // Without a key, another time takes the change back, which is told twice.
    driver.edit([Edit::Select { id, add: false }, Edit::Move { by: 3.0 * DVec3::Y }]);
    assert!(driver.session.needs_keys());
    assert!(driver.said(MessageKind::Note).contains("`mover` changes by its animation: Set key"));
    driver.go_to(0.5);
    assert!(driver.said(MessageKind::Note).contains("`mover` follows its animation again"));
    assert_eq!(mover(&mut driver).1, DVec3::new(0.25, 0.0, 0.0));
    driver.go_to(1.0);
    driver.edit([Edit::Move { by: 3.0 * DVec3::Y }, KEY]);
    assert!(!driver.session.needs_keys(), "{}", driver.said(MessageKind::Warning));
    let told = |driver: &Driver| driver.said(MessageKind::Note).matches("no longer as its file says").count();
    assert_eq!(told(&driver), 1);
    driver.edit([Edit::Move { by: DVec3::Y }, KEY, Edit::Undo, Edit::Undo]);
    assert_eq!(told(&driver), 1, "of the first key alone");
    assert_eq!(driver.tracks(), [("translate", vec![0.0, 1.0], Interpolation::Linear)]);
    driver.go_to(0.5);
    let half = DVec3::new(0.25, 1.5, 0.0);
    assert_eq!(mover(&mut driver).1, half);
    // The camera of the file, the model and the keys are saved, and without the keys it moves as before.
    let path = folder.path().join("saved.ron");
    driver.save(&path);
    let scene = load(&SceneSource::Scene(path), &LoadOptions::default()).unwrap();
    let mut world = bevy_ecs::world::World::new();
    scene.spawn(&mut world);
    let place = |world: &mut bevy_ecs::world::World| {
        let inputs = SceneInputs::of(world);
        inputs.objects.iter().find(|object| object.name.as_deref() == Some("mover")).unwrap().placement.translation
    };
    assert_eq!(place(&mut world), half);
    let mut animation = world.resource::<Animation>().clone();
    animation.tracks.clear();
    world.insert_resource(animation);
    firstlight::scene::show_moment(&mut world, 2.0);
    assert_eq!(place(&mut world), DVec3::X);
}

#[test]
fn edits_that_no_file_could_hold_change_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let mut driver = Driver::open(folder.path(), "s.ron", STILL);
    let before = driver.inputs().objects[0].clone();
    let id = before.entity.to_bits();
    let far = 1e13 * DVec3::X;
    driver.edit([
        Edit::Select { id, add: false },
        Edit::Move { by: far },
        Edit::Scale { factors: DVec3::splat(1e-200) },
    ]);
    driver.edit([Edit::Set { id, property: Property::Object(ObjectProperty::Translate), value: far }]);
    let said = driver.said(MessageKind::Warning);
    assert!(said.contains("move by at most 1e12 m"), "{said}");
    driver.edit([Edit::Set { id, property: Property::SphereRadius, value: far }]);
    let said = driver.said(MessageKind::Warning);
    assert!(said.contains("must lie between 1e-12 and 1e12 m"), "{said}");
    assert!(driver.inputs().objects[0] == before);
}

#[test]
fn frames_of_a_scene_without_one_of_its_meshes_have_the_rest() {
    let folder = tempfile::tempdir().unwrap();
    let text = STILL.replace("objects: [", "objects: [mesh(name: \"gone\", source: obj(\"gone.obj\")), ");
    let mut driver = Driver::open(folder.path(), "scene.ron", &text);
    let id = driver.inputs().objects.iter().find(|object| object.name.as_deref() == Some("ball")).unwrap().entity;
    driver.edit([Edit::Select { id: id.to_bits(), add: false }, KEY]);
    driver.go_to(1.0);
    driver.edit([Edit::Move { by: DVec3::Y }, KEY]);
    let mut reel = Reel::of(&mut driver.session).unwrap().open().unwrap();
    for seconds in [0.0, 1.0] {
        assert_eq!(reel.at(seconds).0.entities.len(), 1, "the ball");
    }
}

/// What was changed long before the first key is not what is meant by it.
#[test]
fn the_first_keys_are_of_what_is_selected() {
    let folder = tempfile::tempdir().unwrap();
    let mut driver = Driver::open(folder.path(), "still.ron", STILL);
    let sun = driver.inputs().lights[0].entity.to_bits();
    let strength = Property::Light(LightProperty::Irradiance);
    driver.edit([Edit::Set { id: sun, property: strength, value: DVec3::splat(3.0) }]);
    let id = driver.id;
    driver.edit([Edit::Select { id, add: false }, Edit::SetKeys { camera: false }]);
    let of: Vec<_> = driver.tracks().into_iter().map(|(property, ..)| property).collect();
    assert_eq!(of, ["translate", "rotate", "scale"]);
    driver.edit([Edit::Undo, Edit::SelectNone, Edit::SetKeys { camera: false }]);
    let of: Vec<_> = driver.tracks().into_iter().map(|(property, ..)| property).collect();
    assert_eq!(of, ["irradiance"], "nothing is selected");
}
