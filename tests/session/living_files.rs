//! Files of a running session: saved, read again when they change, recorded and played.

use crate::driver::{Drive, Driver};
use crate::program::{Outcome, does, program};
use firstlight::frame::{Command, CurrentScene, Edit, MessageKind, Property, Session, SessionOptions, Target};
use firstlight::scene::{
    ColorParam, LoadOptions, Material, ModelChoice, Moment, SceneInputs, SceneSource, Shape, SurfaceMaterial, load,
};
use glam::{DVec3, Vec3};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

const ROOM: &str = r#"(
    // The room.
    camera: (eye: (0.3, 1, 4), look_at: (0, 0.7, 0)),
    environment: gradient(zenith: 1, horizon: 0.5, ground: 0.1),
    textures: { "tiles": image(file: "tiles.png") },
    materials: { "red": diffuse(albedo: (0.8, 0.2, 0.1)), "floor": diffuse(albedo: "tiles") },
    objects: [
        mesh(source: obj("tent.obj"), material: "red"),
        mesh(source: obj("other.obj"), material: "red"),
        plane(material: "floor"),
    ],
)"#;
const TENT: &str = "v 0 0 0\nv 1 0 0\nv 0 0 -1\nv 0 1 0\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";

fn write_room(folder: &Path) -> SceneSource {
    let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
    write("room.ron", ROOM);
    write("tent.obj", TENT);
    write("other.obj", &TENT.replace("v 0 1 0", "v 2 1 0"));
    image::RgbImage::from_pixel(2, 2, image::Rgb([200, 180, 160])).save(folder.join("tiles.png")).unwrap();
    SceneSource::Scene(folder.join("room.ron"))
}

impl Driver {
    fn open(source: SceneSource, threads: usize, spp: u32) -> Self {
        let target = Target { spp: Some(spp), ..Target::default() };
        let options = SessionOptions { width: 40, height: 30, threads: Some(threads), target, ..Default::default() };
        Self::new(options, source)
    }

    fn said(&self, kind: MessageKind) -> Vec<String> {
        let messages = self.session.status().messages.iter();
        messages.filter(|message| message.kind == kind).map(|message| message.text.clone()).collect()
    }

    #[track_caller]
    fn run_until_said(&mut self, kind: MessageKind, words: &str) {
        self.run_until(|session| {
            session.status().messages.iter().any(|message| message.kind == kind && message.text.contains(words))
        });
    }

    fn meshes(&mut self) -> Vec<Arc<firstlight::mesh::Mesh>> {
        let objects = SceneInputs::of(self.session.world_mut()).objects;
        let meshes = objects.into_iter().filter_map(|object| match object.shape {
            Shape::Mesh(mesh) => Some(mesh),
            _ => None,
        });
        meshes.collect()
    }

    fn eye(&mut self) -> DVec3 {
        SceneInputs::of(self.session.world_mut()).camera.unwrap().view.eye
    }
}

#[test]
fn a_film_opens_as_its_scene_only_if_it_is_whole() {
    let folder = tempfile::tempdir().unwrap();
    let film = folder.path().join("film.exr");
    let render = "render cornell -o a.png --film film.exr --size 16x16 --spp 2";
    does(folder.path(), render);
    let whole = std::fs::read(&film).unwrap();
    let place = whole.windows(7).position(|part| part == b"seed: 0").expect("the note has the seed");
    let mut edited = whole.clone();
    edited[place + 6] = b'1';
    std::fs::write(&film, edited).unwrap();
    let mut driver = Driver::open(SceneSource::Builtin("gallery".to_owned()), 2, 1);
    driver.settle();
    let open = || Command::Open { path: film.clone() };
    driver.session.send(open());
    driver.run_until_said(MessageKind::Error, "checksum mismatch");
    std::fs::write(&film, whole).unwrap();
    driver.session.send(open());
    driver.run_until(|session| session.status().scene.contains("cornell"));
}

#[test]
fn what_changes_on_disk_is_read_again_and_nothing_else_is() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let mut driver = Driver::open(write_room(path), 2, 4);
    driver.settle();
    driver.session.send(Command::Orbit { yaw_deg: 30.0, pitch_deg: 0.0 });
    driver.session.send(Command::SetExposure { stops: 1.5 });
    driver.settle();
    let (eye, before) = (driver.eye(), driver.meshes());

    // One mesh moves; the other, with its tree, the camera and the exposure stay.
    std::fs::write(path.join("tent.obj"), TENT.replace("v 0 1 0", "v 0 1.5 0")).unwrap();
    driver.run_until_said(MessageKind::Note, "(changed on disk)");
    driver.settle();
    let after = driver.meshes();
    assert!(!Arc::ptr_eq(&before[0], &after[0]) && before[0].positions != after[0].positions);
    assert!(Arc::ptr_eq(&before[1], &after[1]), "what has not changed is not read again");
    assert_eq!(driver.session.status().restart_cause, "tent.obj reloaded");
    assert_eq!((driver.eye(), driver.session.status().display.exposure_stops), (eye, 1.5));

    // A file that cannot be read is a message, and everything stays as it was.
    let restarts = driver.session.status().restarts;
    std::fs::write(path.join("tent.obj"), "v 0 0\nf 1 2 3\n").unwrap();
    driver.run_until_said(MessageKind::Error, "(the scene is unchanged)");
    driver.settle();
    let errors = driver.said(MessageKind::Error);
    assert!(errors.iter().all(|error| error.contains("tent.obj: has no faces")), "{errors:?}");
    assert_eq!(driver.session.status().restarts, restarts);
    assert_eq!(driver.session.status().withdrawn, [""; 0]);

    // Mended; the text of the scene and a picture change as well, and the camera follows the file if that moved it.
    std::fs::write(path.join("tent.obj"), TENT).unwrap();
    image::RgbImage::from_pixel(2, 2, image::Rgb([20, 180, 160])).save(path.join("tiles.png")).unwrap();
    std::fs::write(path.join("room.ron"), ROOM.replace("(0.3, 1, 4)", "(0.5, 1, 4)")).unwrap();
    driver.run_until(|session| session.status().restarts > restarts);
    assert_eq!(driver.session.status().withdrawn, errors, "a window shows them no longer");
    driver.settle();
    driver.run_until(|session| session.is_idle());
    assert_eq!(driver.eye(), DVec3::new(0.5, 1.0, 4.0));
    assert!(Arc::ptr_eq(&before[1], &driver.meshes()[1]));
    // What is shown is what a new session would show.
    let fresh = load(&SceneSource::Scene(path.join("room.ron")), &LoadOptions::default()).unwrap();
    let shown = driver.session.world().resource::<firstlight::frame::CurrentScene>().0.clone();
    assert_eq!(shown.content_fingerprint(), fresh.content_fingerprint());
}

#[test]
fn the_scene_is_saved_beside_the_picture_and_edits_are_not_lost_to_the_disk() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let mut driver = Driver::open(write_room(path), 2, 4);
    driver.settle();
    let paint = |driver: &mut Driver, red: f32| {
        let world = driver.session.world_mut();
        let object = SceneInputs::of(world).objects[0].slots[0];
        world
            .entity_mut(object)
            .insert(SurfaceMaterial(Material::Diffuse { albedo: ColorParam::Rgb(Vec3::new(red, 0.2, 0.1)) }));
    };
    paint(&mut driver, 0.25);
    driver.settle();
    // Somebody else changes the file: what was done here is not thrown away.
    std::fs::write(path.join("room.ron"), ROOM.replace("zenith: 1", "zenith: 2")).unwrap();
    driver.run_until_said(MessageKind::Warning, "has unsaved changes");

    assert_eq!(driver.session.scene_file(), Some(path.join("room.ron")));
    let restarts = driver.session.status().restarts;
    driver.session.send(Command::SaveScene { path: path.join("room.ron") });
    driver.run_until_said(MessageKind::Saved, "comments of the previous file were removed");
    let text = std::fs::read_to_string(path.join("room.ron")).unwrap();
    assert!(text.contains("0.25") && text.contains("\"tent.obj\"") && !text.contains("zenith: 2"), "{text}");
    // Saving is no change: the samples stay, whatever the watch sees.
    std::thread::sleep(Duration::from_millis(700));
    driver.settle();
    assert_eq!(driver.session.status().restarts, restarts, "{:?}", driver.session.status().messages);

    // From there on the file and the scene are one again.
    std::fs::write(path.join("room.ron"), text.replace("0.25", "0.75")).unwrap();
    driver.run_until_said(MessageKind::Note, "(changed on disk)");
    driver.settle();
    let materials = SceneInputs::of(driver.session.world_mut()).materials;
    assert!(format!("{materials:?}").contains("0.75"), "{materials:?}");

    driver.session.send(Command::SaveScene { path: path.join("room.ron/other.ron") });
    driver.run_until_said(MessageKind::Error, "is not a folder");
}

/// A mesh that undo brings back gets its kd-tree beside the picture; a replay waits for it.
#[test]
fn a_replay_has_the_mesh_that_was_deleted_and_brought_back() {
    let folder = tempfile::tempdir().unwrap();
    let recording = folder.path().join("session.rec");
    let source = SceneSource::Builtin("gallery".to_owned());
    let mut driver = Driver::open(source.clone(), 2, 1);
    driver.session.record(&recording, &source, None, &ModelChoice::DEFAULT).unwrap();
    driver.settle();
    let before = driver.session.film_snapshot().unwrap();
    for command in [Command::Edit(Edit::SelectAll), Command::Edit(Edit::Delete), Command::Edit(Edit::Undo)] {
        driver.session.send(command);
        driver.frame();
    }
    driver.session.send(Command::SaveScene { path: folder.path().join("saved.ron") });
    driver.settle();
    let shown = driver.session.film_snapshot().unwrap();
    driver.session.end_record();
    assert!(shown.means() == before.means(), "undo brings all back");
    std::fs::remove_file(folder.path().join("saved.ron")).unwrap();
    let options = firstlight::frame::ReplayOptions { threads: Some(1), spp: None, allow_outside: false };
    let played = firstlight::frame::replay(&recording, options, &|| false).unwrap();
    assert!(played.film.means() == shown.means());
    assert!(played.warnings.len() == 1 && played.warnings[0].contains("not saved again"), "{:?}", played.warnings);
    assert!(!folder.path().join("saved.ron").exists());
}

/// The image of the sky that a session began with, and the parameters of its scene.
#[test]
fn a_replay_opens_what_the_recording_was_begun_with() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let scene = r#"<scene version="3.0.0"><default name="shade" value="0.1"/>
        <sensor type="perspective"><transform name="to_world"><lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/>
        </transform></sensor><shape type="sphere"><bsdf type="diffuse"><rgb name="reflectance" value="$shade"/></bsdf>
        </shape><emitter type="constant"/></scene>"#;
    std::fs::write(path.join("ball.xml"), scene).unwrap();
    image::RgbImage::from_fn(8, 4, |x, y| image::Rgb([30 * x as u8, 60 * y as u8, 90]))
        .save(path.join("sky.png"))
        .unwrap();
    std::fs::create_dir(path.join("elsewhere")).unwrap();
    let recording = path.join("elsewhere/session.rec");
    let (source, sky) = (SceneSource::Foreign(path.join("ball.xml")), path.join("sky.png"));
    let choice = ModelChoice { defines: vec![("shade".to_owned(), "0.8".to_owned())], ..ModelChoice::default() };
    let options = SessionOptions {
        width: 24,
        height: 16,
        target: Target { spp: Some(4), ..Target::default() },
        ..SessionOptions::default()
    };
    let mut session = Session::new(options).unwrap();
    session.record(&recording, &source, Some(&sky), &choice).unwrap();
    session.open_choice(source, Some(sky), choice);
    let mut driver = Driver { session, start: std::time::Instant::now() };
    driver.settle();
    let shown = driver.session.film_snapshot().unwrap();
    driver.session.end_record();
    let options = firstlight::frame::ReplayOptions::default();
    let played = firstlight::frame::replay(&recording, options, &|| false).unwrap();
    assert_eq!(played.warnings, Vec::<String>::new());
    assert!(played.film.means() == shown.means());
    let text = std::fs::read_to_string(&recording).unwrap();
    let unknown = text.replacen("choice:(", "choice:(allow_outside:true,", 1);
    assert!(unknown != text);
    std::fs::write(&recording, unknown).unwrap();
    let refused = firstlight::frame::replay(&recording, options, &|| false).map(|_| ()).unwrap_err();
    assert!(
        refused.contains("session.rec: the first line cannot be parsed: ") && refused.contains("allow_outside"),
        "{refused}"
    );
}

/// A session that does a bit of everything, and another one that plays it.
#[test]
fn a_recording_leads_to_the_same_bits_with_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let source = write_room(path);
    let recording = path.join("session.rec");
    let mut driver = Driver::open(SceneSource::Builtin("dof-balls".to_owned()), 2, 5);
    driver
        .session
        .record(&recording, &SceneSource::Builtin("dof-balls".to_owned()), None, &ModelChoice::DEFAULT)
        .unwrap();
    driver.settle();
    let send = |driver: &mut Driver, commands: Vec<Command>| {
        for command in commands {
            driver.session.send(command);
        }
        driver.frame();
    };
    send(&mut driver, vec![Command::Orbit { yaw_deg: 17.3, pitch_deg: 4.0 }, Command::FocusAt { x: 0.4, y: 0.6 }]);
    send(&mut driver, vec![Command::Resize { width: 33, height: 21 }, Command::ScaleAperture { factor: 1.7 }]);
    let SceneSource::Scene(room) = source else { unreachable!() };
    send(&mut driver, vec![Command::Open { path: room.clone() }, Command::Turn { yaw_deg: 5.0, pitch_deg: -3.0 }]);
    driver.run_until(|session| session.status().scene.ends_with("room.ron"));
    send(&mut driver, vec![Command::Fly { right: 0.1, up: 0.2, forward: 0.3 }, Command::SetExposure { stops: -0.7 }]);
    send(&mut driver, vec![Command::PivotAt { x: 0.5, y: 0.5 }, Command::SetAperture { radius: 0.03 }]);
    driver.settle();
    let shown = driver.session.film_snapshot().unwrap();
    driver.session.end_record();

    for threads in [1, 3] {
        let options = firstlight::frame::ReplayOptions { threads: Some(threads), spp: None, allow_outside: false };
        let played = firstlight::frame::replay(&recording, options, &|| false).unwrap();
        assert_eq!(played.warnings, Vec::<String>::new());
        assert_eq!((played.film.width(), played.film.height(), played.film.spp()), (33, 21, 5));
        assert!(played.film.means() == shown.means(), "{threads} threads");
        assert_eq!(played.display().exposure_stops, -0.7);
    }

    // Through the program, where the last line was cut short by a crash, and the scene has changed since.
    let text = std::fs::read_to_string(&recording).unwrap();
    let cut = &text[..text.trim_end().len() - 3];
    std::fs::write(&recording, cut).unwrap();
    let run = |args: &[&str]| {
        let outcome = Outcome::of(program(path).args(args));
        (outcome.status, outcome.err)
    };
    let (status, said) = run(&["--replay", "session.rec", "-o", "a.exr", "--spp", "5", "--threads", "1"]);
    let broken = "warning: the recording is incomplete: its last line is not the end of a session\n";
    // How many frames passed while the scene was loaded depends on the machine.
    let replayed = format!("{broken}a.exr: 33 x 21, 5 samples per pixel; replayed 10 commands in ");
    assert!(status == Some(0) && said.starts_with(&replayed), "{said}");
    assert!(said.ends_with(" frames from session.rec\n"), "{said}");
    let picture = image::open(path.join("a.exr")).unwrap().into_rgb32f();
    assert!(picture.pixels().zip(shown.means()).all(|(pixel, mean)| pixel.0 == mean.to_array()));
    // The picture at its end opens as any other.
    assert_eq!(run(&["render", "a.exr", "-o", "b.exr"]).0, Some(0));
    assert!(std::fs::read(path.join("a.exr")).unwrap() == std::fs::read(path.join("b.exr")).unwrap());
    std::fs::write(&room, ROOM.replace("zenith: 1", "zenith: 2")).unwrap();
    let (status, said) = run(&["--replay", "session.rec", "--spp", "1"]);
    assert!(status == Some(0) && said.contains("room.ron has changed since the recording"), "{said}");
    // A scene that was edited during the recording does not come again: it is played as it is now, and that is told.
    let edited = format!("{cut}\n").replace("End(", "Opened(99999,3,\"0123456789abcdef0123456789abcdef\")\nEnd(");
    std::fs::write(&recording, edited.lines().filter(|line| !line.starts_with("En")).collect::<Vec<_>>().join("\n"))
        .unwrap();
    let (status, said) = run(&["--replay", "session.rec", "--spp", "1"]);
    assert!(status == Some(0) && said.contains("was edited during the recording"), "{said}");
    // One that cannot be opened is no edited one.
    std::fs::remove_file(&room).unwrap();
    let (status, said) = run(&["--replay", "session.rec", "--spp", "1"]);
    assert!(status == Some(1) && said.contains("room.ron") && !said.contains("edited"), "{said}");
    std::fs::write(path.join("no.rec"), "hello").unwrap();
    let (status, said) = run(&["--replay", "no.rec"]);
    assert!(status == Some(1) && said.contains("no.rec: is not a recording"), "{said}");
}

#[test]
fn a_camera_that_moves_is_rendered_to_numbered_pictures() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    write_room(path);
    let run = |line: &str| {
        let outcome = Outcome::of(program(path).args(line.split(' ')).env("XDG_CONFIG_HOME", path.join("config")));
        (outcome.status, outcome.err)
    };
    let (status, said) = run("render room.ron -o turn.png --turntable 3 --size 20x15 --spp 2");
    assert_eq!(status, Some(0), "{said}");
    let read = |name: &str| std::fs::read(path.join(name)).unwrap();
    assert!(!path.join("turn.png").exists() && !path.join("turn-0004.png").exists());
    // The first is the picture of the scene itself; each can be opened and made again.
    assert_eq!(run("render room.ron -o still.png --size 20x15 --spp 2").0, Some(0));
    assert!(read("turn-0001.png") == read("still.png"));
    assert_eq!(run("render turn-0002.png -o again.png").0, Some(0));
    assert!(read("turn-0002.png") == read("again.png") && read("turn-0002.png") != read("turn-0003.png"));

    #[cfg(target_os = "linux")]
    {
        use firstlight::frame::SettingsStore;
        let (status, said) = run("render room.ron -o way.png --bookmarks 1,2 --frames 3 --size 20x15 --spp 2");
        assert!(status == Some(1) && said.contains("has no bookmark 1 (it has none)"), "{said}");
        let source = SceneSource::Scene(path.join("room.ron"));
        let store = SettingsStore::in_folder(&path.join("config/firstlight"));
        let mut bookmarks = store.bookmarks(&source).0;
        let scene = load(&source, &LoadOptions::default()).unwrap();
        let mut world = bevy_ecs::world::World::new();
        scene.spawn(&mut world);
        let camera = SceneInputs::of(&mut world).camera.unwrap();
        let mut rig =
            firstlight::frame::navigation::Rig { view: camera.view, projection: camera.projection, lens: camera.lens };
        bookmarks.views.insert(1, rig);
        rig.view.eye.x += 1.0;
        bookmarks.views.insert(2, rig);
        store.keep_bookmarks(&source, &bookmarks).unwrap();
        let (status, said) = run("render room.ron -o way.png --bookmarks 1,2 --frames 3 --size 20x15 --spp 2");
        assert_eq!(status, Some(0), "{said}");
        assert!(read("way-0001.png") == read("still.png") && read("way-0003.png") != read("way-0002.png"));
    }
}

/// A triangle that goes one metre to the right in two seconds, before a camera.
pub(super) fn moving_triangle() -> String {
    let numbers: [f32; 17] = [0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 2., 0., 0., 0., 1., 0., 0.];
    let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
    let data = base64::Engine::encode(&base64::engine::general_purpose::STANDARD, bytes);
    format!(
        r#"{{
        "asset": {{ "version": "2.0" }},
        "buffers": [{{ "byteLength": 68, "uri": "data:application/octet-stream;base64,{data}" }}],
        "bufferViews": [{{ "buffer": 0, "byteLength": 68 }}],
        "accessors": [
            {{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" }},
            {{ "bufferView": 0, "byteOffset": 36, "componentType": 5126, "count": 2, "type": "SCALAR" }},
            {{ "bufferView": 0, "byteOffset": 44, "componentType": 5126, "count": 2, "type": "VEC3" }}
        ],
        "meshes": [{{ "primitives": [{{ "attributes": {{ "POSITION": 0 }} }}] }}],
        "cameras": [{{ "type": "perspective", "perspective": {{ "yfov": 0.6 }} }}],
        "nodes": [{{ "mesh": 0, "name": "mover" }}, {{ "camera": 0, "translation": [0, 0, 5] }}],
        "animations": [{{
            "channels": [{{ "sampler": 0, "target": {{ "node": 0, "path": "translation" }} }}],
            "samplers": [{{ "input": 1, "output": 2 }}]
        }}],
        "scenes": [{{ "nodes": [0, 1] }}]
    }}"#
    )
}

#[test]
fn another_moment_moves_the_model_and_keeps_the_view() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("moving.gltf");
    std::fs::write(&path, moving_triangle()).unwrap();
    let mut driver = Driver::open(SceneSource::Model(path), 1, 2);
    driver.run_until(|session| session.world().contains_resource::<CurrentScene>() && session.status().spp >= 2);
    let place = |driver: &mut Driver| {
        let inputs = SceneInputs::of(driver.session.world_mut());
        inputs
            .objects
            .iter()
            .find(|object| object.name.as_deref() == Some("mover"))
            .unwrap()
            .placement
            .affine()
            .translation
    };
    assert_eq!(place(&mut driver), DVec3::ZERO);
    driver.session.send(Command::Orbit { yaw_deg: 20.0, pitch_deg: 5.0 });
    driver.frame();
    let view = driver.session.status().rig.view;
    let at = |session: &Session| session.world().resource::<CurrentScene>().0.choice.at;
    // The last of several is what counts.
    for seconds in [0.25, 0.5, 1.0] {
        driver.session.send(Command::SetMoment { seconds: Some(seconds) });
    }
    driver.run_until(|session| at(session) == Some(1.0));
    assert_eq!(place(&mut driver), DVec3::new(0.5, 0.0, 0.0));
    assert_eq!(driver.session.status().rig.view, view);
    driver.session.send(Command::SetMoment { seconds: None });
    driver.run_until(|session| at(session).is_none());
    assert_eq!(place(&mut driver), DVec3::ZERO);

    // Edits that are not saved are not lost by it.
    let id = SceneInputs::of(driver.session.world_mut()).objects[0].entity.to_bits();
    driver.session.send(Command::Edit(Edit::Select { id, add: false }));
    driver.session.send(Command::Edit(Edit::Move { by: DVec3::Y }));
    driver.frame();
    driver.session.send(Command::SetMoment { seconds: Some(2.0) });
    let told = |session: &Session| session.status().messages.iter().any(|told| told.text.contains("unsaved changes"));
    driver.run_until(told);
    assert_eq!(place(&mut driver), DVec3::Y);
}

const MOVING: &str = r#"(
    camera: (eye: (0, 1, 6), look_at: (0, 0.5, 0)),
    environment: constant(1),
    materials: { "red": diffuse(albedo: 0.5) },
    objects: [sphere(name: "ball", center: (-2, 0, 0), radius: 0.5, material: "red")],
    animation: (tracks: [
        object(name: "ball", property: translate, keys: [(0, (-2, 0, 0)), (2, (2, 0, 0))]),
        camera(property: vfov, keys: [(0, 40), (2, 20)]),
    ]),
)"#;

#[test]
fn the_time_line_shows_a_moment_which_is_undone_and_no_change_of_the_scene() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("moving.ron");
    std::fs::write(&path, MOVING).unwrap();
    let mut driver = Driver::open(SceneSource::Scene(path.clone()), 1, 2);
    driver.run_until(|session| session.world().contains_resource::<CurrentScene>() && session.status().spp >= 2);
    driver.settle();
    let shown = |driver: &mut Driver| {
        let inputs = SceneInputs::of(driver.session.world_mut());
        let seconds = driver.session.world().resource::<Moment>().0;
        (seconds, inputs.objects[0].placement.translation.x, inputs.camera.unwrap().projection.vfov_deg)
    };
    assert_eq!(shown(&mut driver), (0.0, -2.0, 40.0));
    driver.session.send(Command::SetMoment { seconds: Some(0.5) });
    driver.frame();
    assert_eq!(shown(&mut driver), (0.5, -1.0, 35.0));
    // It converges as any other, and nothing has to be saved.
    driver.settle();
    assert!(driver.session.status().spp >= 2 && !driver.session.has_unsaved_edits());
    // Playing adds up, and starts over at the end.
    for seconds in [0.25, 0.75] {
        driver.session.send(Command::AdvanceMoment { seconds });
        driver.frame();
    }
    assert_eq!(shown(&mut driver), (1.5, 1.0, 25.0));
    driver.session.send(Command::AdvanceMoment { seconds: 1.0 });
    driver.frame();
    assert_eq!(shown(&mut driver), (0.5, -1.0, 35.0));
    assert!(!driver.session.has_unsaved_edits());
    // Of a part of it that plays, too, until all of it plays again.
    driver.session.send(Command::SetPlayRange { seconds: Some([0.25, 1.0]) });
    for (seconds, at) in [(0.25, 0.75), (0.375, 0.375), (0.75, 0.375)] {
        driver.session.send(Command::AdvanceMoment { seconds });
        driver.frame();
        assert_eq!(shown(&mut driver).0, at);
    }
    driver.session.send(Command::SetPlayRange { seconds: None });
    driver.session.send(Command::AdvanceMoment { seconds: 2.125 });
    driver.frame();
    assert_eq!(shown(&mut driver), (0.5, -1.0, 35.0));
    // At whole frames, of which there are 24 a second: what is left of a step counts for the next one.
    for (seconds, at) in [(0.03, 12.0 / 24.0), (0.03, 13.0 / 24.0), (0.03, 14.0 / 24.0), (-0.0901, 11.0 / 24.0)] {
        driver.session.send(Command::AdvanceMoment { seconds });
        driver.frame();
        assert_eq!(shown(&mut driver).0, at);
    }
    driver.session.send(Command::SetMoment { seconds: Some(0.5) });
    driver.frame();
    assert_eq!(shown(&mut driver), (0.5, -1.0, 35.0));
    // All of that is one step.
    driver.session.send(Command::Edit(Edit::Undo));
    driver.frame();
    assert_eq!(shown(&mut driver), (0.0, -2.0, 40.0));
    driver.session.send(Command::Edit(Edit::Redo));
    driver.frame();
    assert_eq!(shown(&mut driver), (0.5, -1.0, 35.0));
    // A file that changes is shown at the same moment.
    std::fs::write(&path, MOVING.replace("(2, (2, 0, 0))", "(2, (6, 0, 0))")).unwrap();
    driver.run_until(|session| session.status().messages.iter().any(|told| told.text.contains("reloaded")));
    assert_eq!(shown(&mut driver), (0.5, 0.0, 35.0));
    // An edit has to be saved, at whatever moment: no track takes it back.
    let id = SceneInputs::of(driver.session.world_mut()).objects[0].entity.to_bits();
    let (property, value) = (Property::SphereRadius, DVec3::splat(0.75));
    let larger = Command::Edit(Edit::Set { id, property, value });
    driver.session.send(larger.clone());
    driver.frame();
    assert!(driver.session.has_unsaved_edits());
    driver.session.send(Command::SetMoment { seconds: Some(1.0) });
    driver.frame();
    assert!(driver.session.has_unsaved_edits());
    // Also one of the very frame in which the moment changes.
    driver.session.send(Command::Edit(Edit::Undo));
    driver.session.send(Command::Edit(Edit::Undo));
    driver.frame();
    assert!(!driver.session.has_unsaved_edits());
    driver.session.send(larger);
    driver.session.send(Command::SetMoment { seconds: Some(1e300) });
    driver.frame();
    assert!(driver.session.has_unsaved_edits());
    assert_eq!(shown(&mut driver).0, 1e6);
}
