//! Values that no picture comes of, in every place from which they can come: scene files, the notes of pictures and films,
//! recordings, kept views, settings, the command line, and the library. Each is refused by its name, never rendered.

use crate::program::{self, does};
use firstlight::frame::{
    Bookmarks, Command as Asked, Session, SessionOptions, SettingsStore, Target, navigation::Rig, read_film_file,
    write_film_file,
};
use firstlight::render::{Camera, Film, Prepared, RenderSettings, advance};
use firstlight::scene::file::{CameraPart, FilmPart, SceneFile};
use firstlight::scene::image_metadata::NOTE_KEY;
use firstlight::scene::{
    CameraInput, Extraction, ImageMetadata, Lens, LoadOptions, Projection, SceneInputs, SceneSource, View, load,
};
use glam::DVec3;
use std::path::Path;
use std::time::Duration;

/// Of the camera: its fields as a scene file and a note have them, and what the message names.
const CAMERAS: [(&str, &str); 24] = [
    ("eye: (NaN, 1, 5), look_at: (0, 1, 0)", "`eye` is (NaN, 1, 5)"),
    ("eye: (0, 1, 1e13), look_at: (0, 1, 0)", "`eye` is (0, 1, 1e13)"),
    ("eye: (0, 1, 5), look_at: (0, inf, 0)", "`look_at` is (0, inf, 0)"),
    ("eye: (0, 1, 5), look_at: (0, 1, 5)", "`eye` and `look_at` are the same point"),
    ("eye: (0, 1, 5)", "the camera has no direction"),
    ("eye: (0, 1, 5), forward: (0, 0, 0)", "`forward` is (0, 0, 0)"),
    ("eye: (0, 1, 5), forward: (0, NaN, 1)", "`forward` is (0, NaN, 1)"),
    ("eye: (0, 1, 5), forward: (0, 0, -1), look_at: (0, 1, 0)", "exclude each other"),
    ("eye: (0, 1, 5), forward: (0, 0, -1), pivot_distance: 0", "`pivot_distance` is 0"),
    ("eye: (0, 1, 5), look_at: (0, 1, 0), pivot_distance: 2", "`pivot_distance` needs `forward`"),
    ("eye: (0, 1, 5), look_at: (0, 1, 0), up: (0, 0, 0)", "`up` is (0, 0, 0)"),
    ("eye: (0, 1, 5), look_at: (0, 1, 0), up: (0, NaN, 0)", "`up` is (0, NaN, 0)"),
    ("eye: (0, 1, 5), look_at: (0, 1, 0), up: (0, 0, 3)", "`up` is parallel"),
    ("eye: (0, 1, 5), look_at: (0, 1, 0), vfov: NaN", "`vfov` is NaN"),
    ("eye: (0, 1, 5), look_at: (0, 1, 0), vfov: 0", "`vfov` is 0"),
    ("eye: (0, 1, 5), look_at: (0, 1, 0), vfov: 180", "`vfov` is 180"),
    ("eye: (0, 1, 5), look_at: (0, 1, 0), vfov: 1e-60", "`vfov` is 1e-60"),
    ("eye: (0, 1, 5), look_at: (0, 1, 0), lens_radius: -0.1", "`lens_radius` is -0.1"),
    ("eye: (0, 1, 5), look_at: (0, 1, 0), lens_radius: inf", "`lens_radius` is inf"),
    ("eye: (0, 1, 5), look_at: (0, 1, 0), f_stop: 1e-300", "`f_stop` is 1e-300"),
    ("eye: (0, 1, 5), look_at: (0, 1, 0), f_stop: NaN", "`f_stop` is NaN"),
    ("eye: (0, 1, 5), look_at: (0, 1, 0), focus_distance: 0", "`focus_distance` is 0"),
    ("eye: (0, 1, 5), look_at: (0, 1, 0), focus_distance: NaN", "`focus_distance` is NaN"),
    ("eye: (0, 1, 5), look_at: (0, 1, 0), blade_rotation: -inf", "`blade_rotation` is -inf"),
];

/// Of all else: the name of the field, its value, and what the message names.
const OTHERS: [(&str, &str, &str); 7] = [
    ("film", "(width: 0, height: 16)", "a film of 0 x 16 has no pixels"),
    ("film", "(width: 16, height: 0)", "a film of 16 x 0 has no pixels"),
    ("film", "(width: 4000000000, height: 4000000000)", "GiB"),
    ("max_depth", "0", "a path of 0 segments sees nothing"),
    ("display", "(exposure: NaN)", "`exposure` is NaN"),
    ("display", "(exposure: 1e30)", "`exposure` is 1"),
    ("display", "(exposure: -inf)", "`exposure` is -inf"),
];

const CAMERA: &str = "eye: (0, 1, 5), look_at: (0, 1, 0)";

/// Fields of a scene file or a note, each with one bad value among good ones, and what the message must name.
fn bad_fields() -> Vec<(String, &'static str)> {
    let of_camera = CAMERAS.iter().map(|(fields, expected)| (format!("camera: ({fields})"), *expected));
    let others =
        OTHERS.iter().map(|(name, value, expected)| (format!("camera: ({CAMERA}), {name}: {value}"), *expected));
    of_camera.chain(others).collect()
}

/// A note with these fields, which leaves out what they say.
fn note(fields: &str) -> String {
    let mut text = format!(
        "(format: 1, program: \"firstlight 0.1.0\", scene: builtin(\"cornell\"), \
         fingerprint: \"921ed9f2953d11a3ea043b8ca3f65ea3\", {fields}, integrator: path, seed: 0, first_sample: 0, spp: 1"
    );
    for (name, value) in [("film", "(width: 16, height: 16)"), ("display", "()")] {
        if !fields.contains(&format!("{name}: ")) {
            text += &format!(", {name}: {value}");
        }
    }
    text + ")"
}

fn write_png(path: &Path, note: &str) {
    let mut encoder = png::Encoder::new(std::fs::File::create(path).unwrap(), 1, 1);
    encoder.add_itxt_chunk(NOTE_KEY.to_owned(), note.to_owned()).unwrap();
    encoder.write_header().unwrap().write_image_data(&[0]).unwrap();
}

fn write_exr(path: &Path, note: &str) {
    use exr::prelude::{AttributeValue, Image, SpecificChannels, Text, WritableImage};
    let pixels = SpecificChannels::rgb(|_| (0_f32, 0_f32, 0_f32));
    let mut image = Image::from_channels((1, 1), pixels);
    image.attributes.other.insert(Text::from(NOTE_KEY), AttributeValue::Text(Text::from(note)));
    image.write().non_parallel().to_file(path).unwrap();
}

/// Runs a command that must fail, and gives back what it says.
#[track_caller]
fn fails(folder: &Path, line: &str, status: i32) -> String {
    let said = program::fails(folder, line, status);
    assert!(!folder.join("out.png").exists(), "{line} wrote a picture");
    said
}

#[test]
fn scene_files() {
    for (fields, expected) in bad_fields() {
        let found = SceneFile::parse(&format!("({fields})"), "scene.ron").map(drop).unwrap_err().to_string();
        assert!(found.starts_with("scene.ron:1:") && found.contains(expected), "{fields}: {found}");
    }
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.ron"), "(camera: (eye: (0, 0, NaN), look_at: (0, 0, 0)))").unwrap();
    assert!(fails(folder.path(), "render a.ron -o out.png --spp 1", 1).contains("a.ron:1:"));
}

#[test]
fn notes_of_pictures_and_films() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    assert!(ImageMetadata::from_note(&note(&format!("camera: ({CAMERA})"))).is_ok(), "what is good is taken");
    let film = Film::new(16, 16);
    for (i, (fields, expected)) in bad_fields().into_iter().enumerate() {
        let note = note(&fields);
        let check = |said: String| {
            assert!(said.contains("metadata is invalid") && said.contains(expected), "{fields}: {said}");
        };
        check(ImageMetadata::from_note(&note).unwrap_err().to_string());
        let damaged = path.join(format!("film-{i}.exr"));
        write_film_file(&film, &note, &damaged).unwrap();
        check(read_film_file(&damaged).map(drop).unwrap_err().to_string());
        std::fs::copy(&damaged, path.join("film.exr")).unwrap();
        // Reading is the same for all; the program itself takes its time.
        if i % 3 == 0 {
            write_png(&path.join("a.png"), &note);
            write_exr(&path.join("a.exr"), &note);
            for line in [
                "render a.png -o out.png --spp 1",
                "explain a.png --pixel 1,1",
                "info a.exr",
                "save a.png -o out.ron",
                "render film.exr --resume -o out.png --spp 1",
                "merge film.exr film.exr -o out.exr",
            ] {
                check(fails(path, line, 1));
            }
        }
    }
    for (field, expected) in [
        ("spp: 4294967295", "sample numbers must be below"),
        ("first_sample: 2147483648", "sample numbers must be below"),
        ("scene: model(path: \"a.obj\", up: 'x')", "`up` is 'x'"),
    ] {
        let good = note(&format!("camera: ({CAMERA})"));
        let name = field.split(':').next().unwrap();
        let old = [": 0", ": 1", ": builtin(\"cornell\")"].map(|value| format!("{name}{value}"));
        let old = old.iter().find(|old| good.contains(*old)).unwrap();
        let found = ImageMetadata::from_note(&good.replace(old, field)).unwrap_err().to_string();
        assert!(found.contains(expected), "{field}: {found}");
    }
}

/// Views, fields of view and lenses that are no such thing, and what the message names.
fn bad_rigs() -> Vec<(Rig, &'static str)> {
    let good = Rig::default();
    let view = |change: fn(&mut View)| {
        let mut view = good.view;
        change(&mut view);
        Rig { view, ..good }
    };
    let lens = |change: fn(&mut Lens)| {
        let mut lens = Lens::thin(0.1, 3.0);
        change(&mut lens);
        Rig { lens, ..good }
    };
    let vfov = |vfov_deg| Rig { projection: Projection::perspective(vfov_deg), ..good };
    vec![
        (view(|view| view.eye.x = f64::NAN), "`eye` is (NaN, 0, 5)"),
        (view(|view| view.eye.y = 1e13), "`eye` is (0, 1e13, 5)"),
        (view(|view| view.forward = DVec3::ZERO), "`forward` is (0, 0, 0)"),
        (view(|view| view.forward = DVec3::NEG_Z * 2.0), "`forward` is (0, 0, -2)"),
        (view(|view| view.up = DVec3::splat(f64::NAN)), "`up` is (NaN, NaN, NaN)"),
        (view(|view| view.up = DVec3::Z), "`up` is not perpendicular"),
        (view(|view| view.pivot_distance = -1.0), "`pivot_distance` is -1"),
        (view(|view| view.pivot_distance = f64::INFINITY), "`pivot_distance` is inf"),
        (vfov(0.0), "`vfov` is 0"),
        (vfov(-30.0), "`vfov` is -30"),
        (vfov(180.0), "`vfov` is 180"),
        (vfov(f64::NAN), "`vfov` is NaN"),
        (lens(|lens| lens.radius = -1.0), "`lens_radius` is -1"),
        (lens(|lens| lens.radius = f64::INFINITY), "`lens_radius` is inf"),
        (lens(|lens| lens.focus_distance = 0.0), "`focus_distance` is 0"),
        (lens(|lens| lens.focus_distance = f64::NAN), "`focus_distance` is NaN"),
        (lens(|lens| lens.blade_rotation_deg = f64::NAN), "`blade_rotation` is NaN"),
    ]
}

/// What sets a part of a rig, and all of it.
fn commands_of(rig: &Rig) -> Vec<Asked> {
    let mut bookmarks = Bookmarks::default();
    bookmarks.set(3, *rig);
    vec![
        Asked::SetView(rig.view),
        Asked::SetProjection(rig.projection),
        Asked::SetLens(rig.lens),
        Asked::SetBookmarks(Box::new(bookmarks)),
    ]
}

const HEADER: &str =
    "(format:1,program:\"firstlight 0.1.0\",scene:Builtin(\"cornell\"),up:None,width:16,height:16,seed:0)";

#[test]
fn recordings() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let replay = |text: &str| {
        std::fs::write(path.join("a.rec"), text).unwrap();
        fails(path, "--replay a.rec -o out.png", 1)
    };
    let refused = |command: &Asked, expected: &str| {
        let line = format!("Do(1,0.0,{})", ron::to_string(command).unwrap());
        let said = replay(&format!("{HEADER}\nOpened(0,1,\"\")\n{line}\nEnd(1,1)\n"));
        assert!(said.contains("a.rec:3: ") && said.contains(expected), "{line}: {said}");
    };
    for (rig, expected) in bad_rigs() {
        for command in commands_of(&rig).iter().filter(|command| command.check().is_err()) {
            refused(command, expected);
        }
    }
    refused(&Asked::Resize { width: 4_000_000_000, height: 1 }, "GiB");
    refused(&Asked::SetTarget(Target { error: Some(f64::NAN), ..Target::default() }), "`error` is NaN");
    refused(&Asked::SetTarget(Target { seconds: Some(-1.0), ..Target::default() }), "`seconds` is -1");
    for (from, to, expected) in [
        ("width:16,height:16", "width:4000000000,height:4000000000", "a.rec:1: a film of"),
        ("width:16,height:16", "width:65536,height:65536", "a.rec:1: a film of"),
        ("width:16,height:16", "width:0,height:16", "a film of 0 x 16 has no pixels"),
        ("up:None", "up:Some('q')", "a.rec:1: `up` is 'q'"),
    ] {
        let said = replay(&format!("{}\nOpened(0,1,\"\")\nEnd(1,1)\n", HEADER.replace(from, to)));
        assert!(said.contains(expected), "{to}: {said}");
    }
}

#[test]
fn settings_and_kept_views() {
    let folder = tempfile::tempdir().unwrap();
    let store = SettingsStore::in_folder(folder.path());
    for (text, expected) in [
        ("(window: (0, 600))", "has no pixels"),
        ("(window: (4000000000, 600))", "GiB"),
        ("(display: (exposure: NaN))", "`exposure` is NaN"),
        ("(display: (exposure: 65))", "`exposure` is 65"),
    ] {
        std::fs::write(folder.path().join("settings.ron"), text).unwrap();
        let (settings, trouble) = store.settings();
        assert_eq!(settings, Default::default());
        let trouble = trouble.unwrap();
        assert!(trouble.contains(expected) && trouble.contains("settings.broken"), "{trouble}");
    }
    let source = SceneSource::Builtin("cornell".to_owned());
    for (rig, expected) in bad_rigs() {
        let mut bookmarks = store.bookmarks(&source).0;
        bookmarks.views.insert(1, rig);
        store.keep_bookmarks(&source, &bookmarks).unwrap();
        let (kept, trouble) = store.bookmarks(&source);
        assert!(kept.views.is_empty() && trouble.unwrap().contains(expected));
    }
}

#[test]
fn the_command_line() {
    let folder = tempfile::tempdir().unwrap();
    for (args, expected) in [
        ("--size 0x16", "has no pixels"),
        ("--size 4000000000x16", "GiB"),
        ("--scale 1e9", "GiB"),
        ("--scale nan", "must be a positive number"),
        ("--max-depth 0", "must be a whole number, at least 1"),
        ("--exposure nan", "must be a finite number of stops"),
        ("--exposure 1e30", "must be a finite number of stops"),
        ("--time nan", "must be a positive number"),
        ("--error nan", "must be a positive number"),
    ] {
        let said = fails(folder.path(), &format!("render cornell -o out.png --spp 1 {args}"), 2);
        assert!(said.contains(expected), "{args}: {said}");
    }
}

#[test]
fn the_library() {
    for (rig, expected) in bad_rigs() {
        let found = rig.check().unwrap_err().to_string();
        assert!(found.contains(expected), "{rig:?}: {found}");
        assert!(commands_of(&rig).iter().any(|command| command.check().is_err()));
    }
    // A session keeps the camera that it had, and says why.
    let scene = load(&SceneSource::Builtin("cornell".to_owned()), &LoadOptions::default()).unwrap();
    let options = SessionOptions { width: 16, height: 16, ..SessionOptions::default() };
    let mut session = Session::new(options.clone()).unwrap();
    session.adopt(scene.clone());
    session.update(Duration::ZERO);
    for (rig, expected) in bad_rigs() {
        for command in commands_of(&rig) {
            session.send(command);
        }
        session.update(Duration::ZERO);
        let said = session.status().messages.iter().any(|message| message.text.contains(expected));
        assert!(said, "{expected}: {:?}", session.status().messages);
        session.rendered().unwrap().0.camera.check().unwrap();
    }
    // Also when it is written into the world.
    let mut cameras = session.world_mut().query::<(&mut View, &mut Projection)>();
    let (mut view, mut projection) = cameras.single_mut(session.world_mut()).unwrap();
    (view.eye.x, projection.vfov_deg) = (f64::NAN, 0.0);
    session.update(Duration::ZERO);
    session.rendered().unwrap().0.camera.check().unwrap();
    assert!(session.status().messages.iter().any(|message| message.text.starts_with("the camera was not changed")));

    for (width, height) in [(4_000_000_000, 4_000_000_000), (1, 65_537), (65_536, 65_536)] {
        assert!(Session::new(SessionOptions { width, height, ..options.clone() }).is_err());
    }
    // An extraction leaves out what no picture can be taken with.
    let mut world = bevy_ecs::world::World::new();
    scene.spawn(&mut world);
    let mut inputs = SceneInputs::of(&mut world);
    for (rig, expected) in bad_rigs() {
        let Rig { view, projection, lens } = rig;
        inputs.camera = inputs.camera.map(|camera| CameraInput { view, projection, lens, ..camera });
        let extraction = Extraction::new(&inputs, &scene.trees);
        assert!(extraction.problems.iter().any(|problem| problem.contains(expected)), "{expected}");
        extraction.prepared.camera.check().unwrap();
    }
    // The core takes none of it.
    let prepared = Extraction::new(&SceneInputs::of(&mut world), &scene.trees).prepared;
    let black = RenderSettings { max_depth: 0, ..RenderSettings::default() };
    let render = |settings: RenderSettings, prepared: &Prepared| {
        let prepared = prepared.clone();
        std::panic::catch_unwind(move || advance(&prepared, &settings, &mut Film::new(4, 4), 1, &|| false).completed)
    };
    assert!(render(RenderSettings::default(), &prepared).unwrap());
    assert!(render(black, &prepared).is_err());
    let blind = prepared.with_camera(Camera { tan_half_vfov: f32::NAN, ..prepared.camera });
    assert!(render(RenderSettings::default(), &blind).is_err());

    // What a scene file would refuse, no scene file is made of.
    let mut file = scene.file.clone();
    file.camera = CameraPart { vfov: f64::NAN, ..file.camera };
    file.film = FilmPart { width: 0, ..file.film };
    file.max_depth = Some(0);
    assert_eq!(file.check().unwrap_err().problems.len(), 3);
}

/// Numbers that are finite and that single precision has not: refused by their place, or reduced where they are angles.
#[test]
fn numbers_beyond_single_precision() {
    let parse = |fields: &str| SceneFile::parse(&format!("(\n    camera: ({CAMERA}),\n    {fields},\n)"), "a.ron");
    for (fields, expected) in [
        ("environment: constant(1e300)", "1e300 is too large"),
        ("environment: constant((1, 1e39, 1))", "1e39 is too large"),
        ("environment: gradient(zenith: -1e60, horizon: 1, ground: 1)", "-1e60 is too large"),
        ("environment: image(file: \"a.hdr\", scale: 1e300)", "1e300 is too large"),
        ("air: 1e300", "1e300 is too large"),
        ("materials: { \"a\": diffuse(albedo: 1e300) }", "1e300 is too large"),
        ("materials: { \"a\": metal(alpha: 1e300, reflectance: 1) }", "1e300 is too large"),
        ("materials: { \"a\": glass(ior: 1e300) }", "`ior` is inf"),
        ("materials: { \"a\": phong(diffuse: 1, specular: 0, shininess: 1e300) }", "`shininess` is inf"),
        ("materials: { \"a\": emissive(radiance: 1e300) }", "1e300 is too large"),
        ("textures: { \"a\": checker(a: 0, b: 1, squares: (1e300, 1)) }", "`squares` is (1e300, 1)"),
        ("textures: { \"a\": checker(a: 0, b: 1, squares: (1e-300, 1)) }", "`squares` is (1e-300, 1)"),
        ("textures: { \"a\": checker(a: 0, b: 1, offset: (0, 1e300)) }", "`offset` is (0, 1e300)"),
        ("textures: { \"a\": image(file: \"a.png\", repeat: (1, 1e300)) }", "`repeat` is (1, 1e300)"),
        ("objects: [plane(material: \"a\", point: (1e300, 0, 0))]", "(1e300, 0, 0) must be finite and within"),
        ("objects: [sphere(material: \"a\", radius: 1e300)]", "the radius is 1e300"),
        ("objects: [quad(material: \"a\", edge_u: (1e300, 0, 0), edge_v: (0, 1, 0))]", "`edge_u` is (1e300, 0, 0)"),
        ("lights: [point(position: (0, 0, 0), intensity: 1e300)]", "1e300 is too large"),
        ("display: (exposure: 1e300)", "`exposure` is inf"),
    ] {
        let found = parse(fields).map(drop).unwrap_err().to_string();
        assert!(found.starts_with("a.ron:3:") && found.contains(expected), "{fields}: {found}");
    }
    // Angles, and directions, whose length means nothing.
    let good = "materials: { \"a\": diffuse(albedo: 0.5) }, environment: image(file: \"a.hdr\", rotate: 1e300), \
                textures: { \"t\": checker(a: 0, b: 1, rotate: -1e300) }, \
                objects: [plane(material: \"a\", normal: (0, 1e300, 0), transform: (rotate: (1e300, 0, -1e300)))]";
    assert!(parse(good).is_ok(), "{:?}", parse(good));
    let text = "(camera: (eye: (0, 1, 5), forward: (0, 0, -1e300), up: (0, 1e300, 1e299), lens_radius: 0.2, blades: 5, \
                blade_rotation: 1e300, focus_distance: 5), film: (width: 8, height: 8), environment: constant(0.5), \
                textures: { \"t\": checker(a: 0.2, b: 1, rotate: 1e300) }, materials: { \"a\": diffuse(albedo: \"t\") }, \
                objects: [plane(material: \"a\", normal: (0, 1e300, 0))])";
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ron");
    std::fs::write(&path, text).unwrap();
    let scene = load(&SceneSource::Scene(path), &LoadOptions::default()).unwrap();
    let mut world = bevy_ecs::world::World::new();
    scene.spawn(&mut world);
    let extraction = Extraction::new(&SceneInputs::of(&mut world), &scene.trees);
    assert!(extraction.problems.is_empty(), "{:?}", extraction.problems);
    let mut film = Film::new(8, 8);
    let report = advance(&extraction.prepared, &RenderSettings::default(), &mut film, 4, &|| false);
    assert_eq!(report.n_bad, 0);
    assert!(film.means().iter().all(|mean| mean.is_finite() && mean.min_element() > 0.0), "{:?}", film.means());
}

#[test]
fn a_byte_order_mark_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), format!("\u{feff}{text}")).unwrap();
    let text = format!("(camera: ({CAMERA}), objects: [mesh(source: obj(\"a.obj\"))])");
    write("a.ron", &text);
    write("a.obj", "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n");
    write("a.mtl", "newmtl red\nKd 1 0 0\n");
    for line in ["info a.ron", "info a.obj"] {
        let outcome = does(folder.path(), line);
        assert!(outcome.err.is_empty() && outcome.out().contains("1 triangle"), "{line}: {outcome:?}");
    }
    // Lines and columns are those of the text.
    assert_eq!(SceneFile::parse(&format!("\u{feff}{text}"), "a.ron"), SceneFile::parse(&text, "a.ron"));
    let places = ["\u{feff}", ""].map(|mark| SceneFile::parse(&format!("{mark}(objets: 3)"), "a.ron").unwrap_err());
    assert_eq!(places[0], places[1]);
}

/// What a few bytes could ask for very often has a limit for the whole scene.
#[test]
fn totals_of_a_scene_are_limited() {
    let of = |objects: &[String]| {
        let text =
            format!("({CAMERA_PART}, materials: {{\"m\": diffuse(albedo: 0.5)}}, objects: [{}])", objects.join(", "));
        SceneFile::parse(&text, Path::new("a.ron")).map(drop).map_err(|error| error.to_string())
    };
    let grid =
        |i: u32| format!("ball_grid(first: ({i}, 0, 0), steps: [(4000000, (1, 0, 0))], radius: 0.1, material: \"m\")");
    let grids: Vec<String> = (0..5).map(grid).collect();
    assert_eq!(of(&grids[..4]), Ok(()));
    assert!(of(&grids).unwrap_err().contains("all grids together may have up to 16000000 spheres"));
    let mesh =
        |i: u32| format!("mesh(source: builtin(\"torus\"), simplify: {}, material: \"m\")", 0.5 + f64::from(i) / 1e4);
    let meshes: Vec<String> = (0..257).map(mesh).collect();
    assert_eq!(of(&meshes[..256]), Ok(()));
    assert!(of(&meshes).unwrap_err().contains("may be simplified to up to 256 ratios"));
}

const CAMERA_PART: &str = "camera: (eye: (0, 1, 5), look_at: (0, 1, 0))";
