//! A session as a window drives it: pictures come, changes cancel, loading goes on beside, and at the end it sleeps.

use firstlight::frame::{
    Command, Edit, History, MessageKind, Selection, Session, SessionOptions, Status, StopAt, Target, render_offline,
};
use firstlight::mesh::procedural::{SerpentKnot, serpent_knot};
use firstlight::render::Film;
use firstlight::scene::animation::Shutter;
use firstlight::scene::{
    Animation, Extraction, LoadOptions, Material, Rendering, SceneInputs, SceneSource, Shape, SurfaceMaterial, UpAxis,
    View, load,
};
use glam::DVec3;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// A session and the clock that drives it.
struct Driver {
    session: Session,
    start: Instant,
    /// How often the session has asked for a frame.
    calls: Arc<AtomicUsize>,
}

impl Driver {
    fn new(width: u32, height: u32, target: Target) -> Self {
        let calls = Arc::new(AtomicUsize::new(0));
        let waker = calls.clone();
        let session = Session::new(SessionOptions {
            width,
            height,
            threads: Some(2),
            target,
            waker: Some(Arc::new(move || _ = waker.fetch_add(1, Ordering::SeqCst))),
            ..SessionOptions::default()
        })
        .unwrap();
        Self { session, start: Instant::now(), calls }
    }

    fn open(&mut self, name: &str) {
        self.session.open(SceneSource::Builtin(name.to_owned()));
    }

    fn frame(&mut self) {
        self.session.update(self.start.elapsed());
    }

    /// Runs frames whenever the session asks for one, until `done`.
    #[track_caller]
    fn run_until(&mut self, done: impl Fn(&Session) -> bool) {
        let start = Instant::now();
        self.frame();
        while !done(&self.session) {
            let waits = Instant::now();
            let seen = self.calls.load(Ordering::SeqCst);
            while self.calls.load(Ordering::SeqCst) == seen && waits.elapsed() < Duration::from_millis(20) {
                std::thread::sleep(Duration::from_millis(1));
            }
            assert!(start.elapsed() < Duration::from_secs(120), "nothing came: {:?}", self.session.status());
            self.frame();
        }
    }

    fn say(&self, kind: MessageKind) -> Vec<&str> {
        let messages = self.session.status().messages.iter();
        messages.filter(|message| message.kind == kind).map(|message| message.text.as_str()).collect()
    }
}

/// The key for it does nothing where there is nothing to do: no sample is lost, and there is nothing to undo.
#[test]
fn levelling_a_level_view_is_no_change() {
    let mut driver = Driver::new(64, 48, spp(4));
    driver.open("cornell");
    driver.run_until(|session| session.is_idle() && session.status().spp == 4);
    driver.session.send(Command::Turn { yaw_deg: 12.0, pitch_deg: -20.0 });
    driver.run_until(|session| session.is_idle() && session.status().spp == 4);
    let view = driver.session.status().rig.view;
    let (restarts, revision) = (driver.session.status().restarts, History::revision(driver.session.world_mut()));
    driver.session.send(Command::Level);
    driver.frame();
    driver.frame();
    assert_eq!(driver.session.status().rig.view, view);
    assert_eq!(driver.session.status().restarts, restarts);
    assert_eq!(History::revision(driver.session.world_mut()), revision);
    driver.session.send(Command::Roll { angle_deg: 3.0 });
    driver.session.send(Command::Level);
    driver.frame();
    assert!((driver.session.status().rig.view.up - view.up).length() < 1e-12);
}

/// What opens needs the processor: until there is something to see, nothing is rendered or denoised.
#[test]
fn an_empty_session_renders_only_if_nothing_opens() {
    let mut driver = Driver::new(64, 48, spp(2));
    driver.open("models");
    driver.run_until(|session| {
        let is_empty = session.inputs().objects.is_empty();
        assert!(!is_empty || session.status().film_width == 0, "{:?}", session.status());
        !is_empty
    });
    driver.run_until(|session| session.is_idle() && session.status().spp == 2);
    let mut driver = Driver::new(64, 48, spp(2));
    driver.session.open(SceneSource::Scene("missing.ron".into()));
    driver.run_until(|session| session.is_idle() && session.status().spp == 2);
    assert_eq!(driver.say(MessageKind::Error).len(), 1);
}

#[test]
fn it_is_known_whether_edits_are_saved() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("saved.ron");
    let mut driver = Driver::new(64, 48, spp(2));
    driver.open("cornell-balls");
    driver.run_until(|session| session.is_idle() && session.status().spp == 2);
    assert!(!driver.session.has_unsaved_edits());
    driver.session.send(Command::Turn { yaw_deg: 12.0, pitch_deg: -20.0 });
    driver.session.send(Command::AdjustExposure { stops: 1.0 });
    driver.frame();
    assert!(!driver.session.has_unsaved_edits(), "a view is no edit");
    let delete = |driver: &mut Driver| {
        let entity = driver.session.inputs().objects.last().expect("it has objects").entity;
        driver.session.world_mut().resource_mut::<Selection>().0 = vec![entity];
        driver.session.send(Command::Edit(Edit::Delete));
        driver.frame();
    };
    delete(&mut driver);
    assert!(driver.session.has_unsaved_edits());
    let says = |text: &str| driver.session.status().messages.iter().any(|message| message.text.starts_with(text));
    assert!(says("deleted: "), "{:?}", driver.session.status().messages);
    driver.session.send(Command::Edit(Edit::Undo));
    driver.frame();
    assert!(!driver.session.has_unsaved_edits(), "what is undone is as it was");
    driver.session.send(Command::Edit(Edit::Redo));
    driver.frame();
    assert!(driver.session.has_unsaved_edits());
    driver.session.send(Command::SaveScene { path: path.clone() });
    assert!(driver.session.is_saving());
    driver.run_until(|session| !session.is_saving());
    assert!(!driver.session.has_unsaved_edits() && path.exists());
    driver.session.send(Command::Edit(Edit::Undo));
    driver.frame();
    assert!(driver.session.has_unsaved_edits(), "the file has it otherwise");
    // Another scene has nothing to be saved.
    driver.open("cornell");
    driver.run_until(|session| session.status().scene == "cornell" && session.is_idle());
    assert!(!driver.session.has_unsaved_edits());
}

fn spp(spp: u32) -> Target {
    Target { spp: Some(spp), ..Target::default() }
}

#[test]
fn a_scene_is_read_shown_and_finished_and_then_everything_sleeps() {
    let mut driver = Driver::new(64, 48, spp(16));
    driver.open("dof-balls");
    driver.run_until(|session| session.status().done && session.is_idle());
    let (picture, status) = (driver.session.picture(), driver.session.status());
    assert_eq!((picture.width, picture.height, picture.rgba.len()), (64, 48, 64 * 48 * 4));
    assert_eq!((status.spp, status.divider, status.scene.as_str()), (16, 1, "dof-balls"));
    assert!(picture.rgba.chunks(4).all(|pixel| pixel[3] == 255));
    let distinct: std::collections::HashSet<&[u8]> = picture.rgba.chunks(4).collect();
    assert!(distinct.len() > 200, "{} colours", distinct.len());
    assert!(status.estimated_error.is_some() && status.mrays() > 0.0 && status.threads == 2);
    assert_eq!(status.loading, None);

    // Nobody calls, and frames that nobody asked for find nothing.
    let (number, calls) = (picture.number, driver.calls.load(Ordering::SeqCst));
    std::thread::sleep(Duration::from_millis(100));
    driver.frame();
    assert_eq!(driver.session.picture().number, number);
    assert_eq!(driver.calls.load(Ordering::SeqCst), calls);
    assert!(driver.session.is_idle() && driver.session.next_wake(Duration::ZERO).is_none());

    // Another exposure is another picture of the same samples; more samples are added to them.
    let (restarts, bytes) = (driver.session.status().restarts, driver.session.picture().rgba.clone());
    driver.session.send(Command::SetExposure { stops: 2.0 });
    driver.run_until(|session| session.picture().number > number && session.is_idle());
    assert_ne!(driver.session.picture().rgba, bytes);
    assert_eq!((driver.session.status().restarts, driver.session.status().spp), (restarts, 16));
    driver.session.world_mut().resource_mut::<StopAt>().0 = spp(24);
    driver.run_until(|session| session.status().spp == 24 && session.is_idle());
    assert_eq!(driver.session.status().restarts, restarts);
}

#[test]
fn no_picture_waits_for_what_is_made_beside_it() {
    let mut driver = Driver::new(64, 48, spp(4));
    driver.open("dof-balls");
    driver.run_until(|session| session.status().done && session.is_idle());
    // Something takes all threads that trees are built on.
    let pool = driver.session.pool();
    let (release, held) = std::sync::mpsc::channel::<()>();
    let held = std::sync::Mutex::new(held);
    let (begun, has_begun) = std::sync::mpsc::channel();
    let busy = std::thread::spawn(move || {
        pool.broadcast(|_| {
            begun.send(()).expect("the test listens");
            // Ends when the other side is dropped.
            let _ = held.lock().unwrap().recv();
        })
    });
    (0..2).for_each(|_| has_begun.recv_timeout(Duration::from_secs(60)).expect("a thread"));
    let restarts = driver.session.status().restarts;
    driver.session.send(Command::Orbit { yaw_deg: 20.0, pitch_deg: 3.0 });
    driver.run_until(|session| session.status().restarts > restarts && session.status().done);
    drop(release);
    busy.join().expect("no thread has panicked");
}

#[test]
fn the_window_and_the_command_line_render_the_same_bits() {
    let mut driver = Driver::new(48, 48, spp(8));
    driver.open("cornell-balls");
    driver.run_until(|session| session.status().done && session.is_idle());
    let shown = driver.session.film_snapshot().unwrap();

    let scene = load(&SceneSource::Builtin("cornell-balls".to_owned()), &LoadOptions::default()).unwrap();
    let mut world = bevy_ecs::world::World::new();
    scene.spawn(&mut world);
    let extraction = Extraction::new(&SceneInputs::of(&mut world), &scene.trees);
    let mut film = Film::new(48, 48);
    let settings = world.resource::<Rendering>().0;
    render_offline(&extraction.prepared, &settings, &mut film, spp(8), |_| true);
    assert_eq!(shown.means(), film.means());

    // Away and back again: the same view, the same bits.
    driver.session.send(Command::Orbit { yaw_deg: 20.0, pitch_deg: 3.0 });
    driver.run_until(|session| session.picture().generation > 1 && session.status().done);
    assert_ne!(driver.session.film_snapshot().unwrap().means(), film.means());
    driver.session.send(Command::Home);
    let generation = driver.session.picture().generation;
    driver.run_until(|session| session.picture().generation > generation && session.status().done && session.is_idle());
    assert_eq!(driver.session.film_snapshot().unwrap().means(), film.means());
}

#[test]
fn no_frame_waits_for_the_picture_and_a_change_cancels_what_is_under_way() {
    // A pass of this film takes a good while.
    let mut driver = Driver::new(1600, 1200, Target::default());
    driver.open("cornell-balls");
    driver.run_until(|session| session.picture().number > 0);
    let mut frames = Vec::new();
    for i in 0..30 {
        driver.session.send(Command::Turn { yaw_deg: 0.3, pitch_deg: 0.0 });
        let before = Instant::now();
        driver.frame();
        frames.push(before.elapsed());
        std::thread::sleep(Duration::from_millis(3 * (i % 5)));
    }
    // No frame waits for the renderer; the median, since other programs may take the processor for a while.
    frames.sort();
    assert!(frames[15] < Duration::from_millis(50), "frames took {frames:?}");
    let moved = driver.session.status().restarts;
    driver.run_until(|session| session.picture().generation == moved);
    let picture = driver.session.picture();
    assert!(picture.divider > 1, "it is coarse first, not by {}", picture.divider);
    // Then it sharpens.
    driver.run_until(|session| session.picture().divider == 1);
}

#[test]
fn a_scene_that_cannot_be_read_is_a_message_and_the_picture_stays() {
    let mut driver = Driver::new(32, 32, spp(4));
    driver.open("cornell");
    driver.run_until(|session| session.status().done && session.is_idle());
    let before = (driver.session.picture().clone(), driver.session.status().restarts);
    let folder = tempfile::tempdir().unwrap();
    let broken = folder.path().join("broken.ron");
    std::fs::write(&broken, "(camera: (eye: (0, 0, 5), look_att: (0, 0, 0)))").unwrap();
    for (path, expected) in [
        (broken, "did you mean `look_at`?"),
        (folder.path().join("none.obj"), "no such file"),
        ("cornel".into(), "did you mean `cornell`?"),
    ] {
        driver.session.send(Command::Open { path });
        driver.run_until(|session| session.is_idle());
        let said = driver.say(MessageKind::Error);
        assert!(said.last().is_some_and(|text| text.contains(expected)), "{said:?}");
    }
    assert_eq!((driver.session.picture().clone(), driver.session.status().restarts), before);
    assert_eq!(driver.session.status().scene, "cornell");
}

#[test]
fn a_new_mesh_is_prepared_beside_the_old_picture() {
    let mut driver = Driver::new(40, 30, spp(4));
    driver.open("cornell");
    driver.run_until(|session| session.status().done && session.is_idle());
    let mesh = Arc::new(serpent_knot(&SerpentKnot { along: 512, around: 64, ..SerpentKnot::default() }));
    let restarts = driver.session.status().restarts;
    let entity = driver.session.world_mut().spawn(Shape::Mesh(mesh)).id();
    driver.frame();
    assert!(!driver.session.is_idle(), "the frame did not wait for its tree");
    assert_eq!(driver.session.status().restarts, restarts, "the old picture stays");
    driver.run_until(|session| session.status().restarts > restarts && session.status().done && session.is_idle());
    assert!(driver.session.status().restart_cause.contains("added"), "{}", driver.session.status().restart_cause);
    driver.session.world_mut().despawn(entity);
    driver.frame();
    assert!(driver.session.status().restart_cause.contains("removed"));
}

#[test]
fn a_hasty_tree_gives_way_to_a_better_one_and_no_sample_is_lost() {
    let source = SceneSource::Builtin("gallery".to_owned());
    let hasty = load(&source, &LoadOptions { preview: true, ..LoadOptions::default() }).unwrap();
    let best = load(&source, &LoadOptions::default()).unwrap();
    assert!(hasty.trees.is_preview() && !best.trees.is_preview(), "the serpent is large");
    assert_ne!(hasty.trees.bytes(), best.trees.bytes());

    let mut driver = Driver::new(64, 48, spp(24));
    driver.session.adopt(hasty);
    driver.frame();
    let (bytes, restarts) = (driver.session.tree_bytes(), driver.session.status().restarts);
    driver.run_until(|session| session.tree_bytes() != bytes);
    driver.run_until(|session| session.status().done && session.is_idle());
    assert_eq!(driver.session.tree_bytes(), best.trees.bytes());
    assert_eq!(driver.session.status().restarts, restarts, "{}", driver.session.status().restart_cause);

    let mut world = bevy_ecs::world::World::new();
    best.spawn(&mut world);
    let extraction = Extraction::new(&SceneInputs::of(&mut world), &best.trees);
    let mut film = Film::new(64, 48);
    let settings = world.resource::<Rendering>().0;
    render_offline(&extraction.prepared, &settings, &mut film, spp(24), |_| true);
    assert_eq!(driver.session.film_snapshot().unwrap().means(), film.means(), "the hits are the same");
    // What has its better tree keeps it.
    driver.session.send(Command::Orbit { yaw_deg: 3.0, pitch_deg: 0.0 });
    driver.run_until(|session| session.status().done && session.is_idle());
    assert_eq!(driver.session.tree_bytes(), best.trees.bytes());
}

#[test]
fn the_number_of_threads_changes_live_and_nothing_else_does() {
    let mut driver = Driver::new(48, 48, spp(32));
    driver.open("cornell-balls");
    // The scene's own picture, not that of the empty world before it.
    let is_there =
        |status: &Status| status.scene.contains("cornell-balls") && status.loading.is_none() && status.spp > 0;
    driver.run_until(|session| is_there(session.status()));
    let restarts = driver.session.status().restarts;
    for (step, threads) in [1, 3, 2, 1, 2].into_iter().enumerate() {
        // Also when there is nothing left to do.
        if step == 3 {
            driver.run_until(|session| session.status().done && session.is_idle());
        }
        driver.session.send(Command::SetThreads { threads });
        driver.run_until(|session| {
            session.status().threads == threads && session.pool().current_num_threads() == threads
        });
    }
    driver.run_until(|session| session.status().done && session.is_idle());
    assert_eq!(driver.session.status().restarts, restarts);
    let shown = driver.session.film_snapshot().unwrap().means();
    let mut other = Driver::new(48, 48, spp(32));
    other.open("cornell-balls");
    other.run_until(|session| session.status().done && session.is_idle());
    assert_eq!(other.session.film_snapshot().unwrap().means(), shown);
}

#[test]
fn broken_components_are_left_out_with_a_message_and_never_a_panic() {
    let mut driver = Driver::new(16, 16, spp(1));
    driver.open("cornell");
    driver.run_until(|session| session.status().done && session.is_idle());
    let world = driver.session.world_mut();
    let mut bad = firstlight::mesh::procedural::cuboid(DVec3::ONE);
    bad.triangles[3] = [0, 1, 1_000_000];
    world.spawn(Shape::Mesh(Arc::new(bad)));
    world.spawn(Shape::Mesh(Arc::default()));
    world.spawn(Shape::Sphere { radius: f64::NAN });
    world.spawn(Shape::Sphere { radius: -1.0 });
    world.spawn(Shape::Plane { normal: DVec3::ZERO });
    world.spawn(Shape::Quad { edge_u: DVec3::X, edge_v: DVec3::X });
    let mut circle = world.spawn_empty();
    let id = circle.id();
    circle.insert(SurfaceMaterial(Material::blend(firstlight::scene::ScalarParam::Number(0.5), id, id)));
    world.spawn((Shape::Sphere { radius: 0.1 }, firstlight::scene::MaterialSlots(vec![id])));
    driver.run_until(|session| session.status().done && session.is_idle());
    assert_eq!(driver.say(MessageKind::Warning).len(), 6, "{:?}", driver.say(MessageKind::Warning));
    assert_eq!(driver.say(MessageKind::Error), [] as [&str; 0]);
}

#[test]
fn clicking_finds_depths_and_framing_finds_the_scene() {
    let mut driver = Driver::new(64, 64, spp(1));
    driver.open("cornell");
    driver.run_until(|session| session.status().done && session.is_idle());
    // The middle of the picture is the front of the short block or the tall one: nearer than the wall at 5.9 m.
    driver.session.send(Command::FocusAt { x: 0.5, y: 0.5 });
    driver.session.send(Command::PivotAt { x: 0.5, y: 0.05 });
    driver.frame();
    let rig = driver.session.status().rig;
    assert!((3.5..5.9).contains(&rig.lens.focus_distance), "{rig:?}");
    assert!(rig.view.pivot_distance != 4.9 && rig.view.pivot_distance < 5.9, "{rig:?}");
    driver.session.send(Command::FrameAll);
    driver.frame();
    let View { eye, forward, pivot_distance, .. } = driver.session.status().rig.view;
    let pivot = eye + pivot_distance * forward;
    assert!(pivot.distance(DVec3::new(0.0, 1.0, 0.0)) < 0.05, "the box is about (0, 1, 0), not {pivot}");
}

#[test]
fn the_cameras_of_a_scene_follow_each_other_and_the_first_one_follows_the_last() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("views.ron");
    let scene = "(camera: (eye: (0, 0, 5), look_at: (0, 0, 0)), \
        cameras: { \"side\": (eye: (5, 0, 0), look_at: (0, 0, 0)), \
                   \"plan\": (eye: (0, 5, 0), look_at: (0, 0, 0), up: (0, 0, -1), orthographic_height: 4) }, \
        materials: { \"grey\": diffuse(albedo: 0.5) }, \
        objects: [ sphere(center: (0, 0, 0), radius: 1, material: \"grey\") ])";
    std::fs::write(&path, scene).unwrap();
    let mut driver = Driver::new(32, 32, spp(1));
    driver.session.open(SceneSource::Scene(path));
    driver.run_until(|session| session.status().done && session.is_idle());
    let mut eyes = Vec::new();
    for command in [Command::NextCamera, Command::NextCamera, Command::NextCamera, Command::PreviousCamera] {
        driver.session.send(command);
        driver.frame();
        eyes.push(driver.session.status().rig.view.eye.to_array());
    }
    assert_eq!(eyes, [[5.0, 0.0, 0.0], [0.0, 5.0, 0.0], [0.0, 0.0, 5.0], [0.0, 5.0, 0.0]]);
    assert!(driver.say(MessageKind::Note).contains(&"camera `plan`"), "{:?}", driver.session.status().messages);
    // From a view that is none of them, to the first one.
    driver.session.send(Command::Dolly { factor: 0.5 });
    driver.session.send(Command::NextCamera);
    driver.frame();
    assert_eq!(driver.session.status().rig.view.eye.to_array(), [0.0, 0.0, 5.0]);
    // A scene with one camera.
    driver.open("cornell");
    driver.run_until(|session| session.status().scene == "cornell" && session.status().done && session.is_idle());
    let view = driver.session.status().rig.view;
    driver.session.send(Command::NextCamera);
    driver.frame();
    assert_eq!(driver.session.status().rig.view, view);
    assert!(driver.say(MessageKind::Note).contains(&"the scene has no other camera"));
}

#[test]
fn a_million_metres_away_is_the_same_picture() {
    let folder = tempfile::tempdir().unwrap();
    // The camera's numbers have no rounding at either place.
    let scene = |x: f64| {
        format!(
            "(camera: (eye: ({0}, 2, 6), look_at: ({1}, 0.5, 0)), environment: constant(0.4),
              materials: {{ \"m\": diffuse(albedo: 0.7), \"l\": emissive(radiance: 5) }},
              objects: [plane(point: ({1}, 0, 0), material: \"m\"), sphere(center: ({1}, 1, 0), radius: 1, material: \"m\"),
                        sphere(center: ({0}, 3, 1), radius: 0.5, material: \"l\")])",
            x + 1.0,
            x
        )
    };
    let means = |name: &str, x: f64| {
        let path = folder.path().join(name);
        std::fs::write(&path, scene(x)).unwrap();
        let scene =
            load(&SceneSource::Scene(path), &LoadOptions { up: Some(UpAxis::Y), ..Default::default() }).unwrap();
        let mut world = bevy_ecs::world::World::new();
        scene.spawn(&mut world);
        let extraction = Extraction::new(&SceneInputs::of(&mut world), &scene.trees);
        let mut film = Film::new(24, 24);
        render_offline(&extraction.prepared, &Default::default(), &mut film, spp(4), |_| true);
        (extraction.origin, film.means())
    };
    let (here, there) = (means("here.ron", 0.0), means("there.ron", 2.0_f64.powi(22)));
    assert_eq!((here.0.x, there.0.x), (0.0, 2.0_f64.powi(22)), "the origin goes along");
    assert_eq!(here.1, there.1);
}

#[test]
fn a_scene_with_a_shutter_is_blurred_as_on_the_command_line_and_restarts_when_the_shutter_changes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("moving.ron");
    let text = r#"(
        camera: (eye: (0, 0.5, 5), look_at: (0, 0.5, 0)),
        environment: constant(1),
        materials: {"m": diffuse(albedo: 0.2)},
        objects: [sphere(name: "s", center: (0, 0.5, 0), radius: 0.5, material: "m")],
        animation: (at: 0.5, fps: 1, shutter: 1, tracks: [
            object(name: "s", property: translate, keys: [(0, (-1, 0.5, 0)), (1, (1, 0.5, 0))]),
        ]),
    )"#;
    std::fs::write(&path, text).unwrap();
    let source = SceneSource::Scene(path);
    let film_of = |shutter| {
        let scene = load(&source, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
        let mut world = bevy_ecs::world::World::new();
        scene.spawn(&mut world);
        world.resource_mut::<Animation>().shutter = shutter;
        let inputs = SceneInputs::of(&mut world);
        let extraction = Extraction::of_world(&mut world, &inputs, &scene.trees);
        let mut film = Film::new(40, 30);
        let settings = world.resource::<Rendering>().0;
        render_offline(&extraction.prepared, &settings, &mut film, spp(8), |_| true);
        film.means()
    };
    let mut driver = Driver::new(40, 30, spp(8));
    driver.session.open(source.clone());
    driver.run_until(|session| session.status().done && session.is_idle());
    let blurred = film_of(Shutter::Share(1.0));
    assert!(driver.session.film_snapshot().unwrap().means() == blurred);

    let generation = driver.session.picture().generation;
    driver.session.world_mut().resource_mut::<Animation>().shutter = Shutter::Share(0.0);
    driver.run_until(|session| session.picture().generation > generation && session.status().done && session.is_idle());
    let sharp = film_of(Shutter::Share(0.0));
    assert!(driver.session.film_snapshot().unwrap().means() == sharp && sharp != blurred);
}
