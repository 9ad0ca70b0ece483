//! The real window on a desktop without a screen: opened, flown through, resized, hidden and closed by synthetic keys
//! and mouse, and looked at.
#![cfg(all(feature = "viewer", target_os = "linux"))]

use crate::desktop::{Desktop, Program, until};
use crate::program::does;
use crate::views::{camera, camera_when, target};
use firstlight::scene::file::{CameraPart, SceneFile};
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Presses the key and waits for the file.
fn keep(program: &Program, key: &str, path: &Path) {
    program.key(key);
    until(&format!("{} to be saved", path.display()), || path.is_file().then_some(()));
}

fn open_picture(path: &Path) -> image::RgbImage {
    image::open(path).unwrap_or_else(|error| panic!("{}: {error}", path.display())).to_rgb8()
}

/// How many colours there are, and how far they spread: a blank picture has one and 0.
fn content(picture: &image::RgbImage) -> (usize, f64) {
    let colours: HashSet<[u8; 3]> = picture.pixels().map(|pixel| pixel.0).collect();
    let values: Vec<f64> = picture.as_raw().iter().map(|&value| f64::from(value)).collect();
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / values.len() as f64;
    (colours.len(), variance.sqrt())
}

pub fn has_content(picture: &image::RgbImage) -> bool {
    let (colours, spread) = content(picture);
    colours > 600 && spread > 10.0
}

/// Mean difference of two pictures of one size, in 8-bit steps.
fn difference(a: &image::RgbImage, b: &image::RgbImage) -> f64 {
    assert_eq!(a.dimensions(), b.dimensions());
    let sum: f64 = a.as_raw().iter().zip(b.as_raw()).map(|(&a, &b)| f64::from(a.abs_diff(b))).sum();
    sum / a.as_raw().len() as f64
}

#[test]
fn a_person_flies_focuses_keeps_pictures_and_leaves() {
    let Some(desktop) = Desktop::start() else { return };
    let mut program = desktop.open(&["gallery", "--size", "640x360"], &[]);
    let file = |name: &str| -> PathBuf { desktop.folder().join(name) };
    until("the gallery to be seen", || has_content(&program.pixels()).then_some(()));
    until("the title", || (program.title() == "firstlight — gallery").then_some(()));
    keep(&program, "k", &file("gallery-0001.png"));
    let first = open_picture(&file("gallery-0001.png"));
    assert_eq!(first.dimensions(), (640, 360));
    assert!(has_content(&first), "{:?}", content(&first));
    let home = camera(&program);

    // Fly: the camera goes where it looks, and looks where it looked.
    program.hold("w", 300);
    let flown = camera_when(&program, "the eye to move", |now| now.eye != home.eye);
    let (step, ahead) = (flown.eye - home.eye, (target(&home) - home.eye).normalize());
    assert!(step.dot(ahead) > 0.1 * (target(&home) - home.eye).length(), "{step}");
    assert!(step.normalize().dot(ahead) > 1.0 - 1e-9, "{step}");
    assert!((target(&flown) - flown.eye).normalize().dot(ahead) > 1.0 - 1e-9);

    // Look about: the camera stays.
    program.key("space");
    program.drag(1, (300, 200), (60, 0));
    let looked = camera_when(&program, "the view to turn", |now| target(now) != target(&flown));
    assert_eq!(looked.eye, flown.eye);

    // Orbit by mouse and by key: the pivot and its distance stay.
    program.key("Home");
    let home_again = camera_when(&program, "the view home", |now| now.eye == home.eye);
    assert_eq!(home_again, home, "home is home, bit for bit");
    let distance = |camera: &CameraPart| (target(camera) - camera.eye).length();
    let same_pivot = |now: &CameraPart| {
        assert!((target(now) - target(&home)).length() < 1e-4, "the pivot stays: {now:?}");
        assert!((distance(now) - distance(&home)).abs() < 1e-4, "so does its distance: {now:?}");
    };
    program.drag(2, (300, 200), (80, 30));
    let orbited = camera_when(&program, "the eye to orbit", |now| now.eye != home.eye);
    same_pivot(&orbited);
    assert!(orbited.eye.y > home.eye.y, "what is dragged down shows its top");
    keep(&program, "k", &file("gallery-0002.png"));
    let second = open_picture(&file("gallery-0002.png"));
    assert!(has_content(&second), "{:?}", content(&second));
    assert!(difference(&first, &second) > 5.0, "{}", difference(&first, &second));
    program.hold("Left", 200);
    same_pivot(&camera_when(&program, "the eye to orbit on", |now| now.eye != orbited.eye));
    program.key("Home");
    camera_when(&program, "the view home again", |now| *now == home);

    // Focus and aperture, by steps and by a click.
    let focus = home.focus_distance.expect("it is always printed");
    program.key("bracketright bracketright bracketright");
    camera_when(&program, "the focal plane to move", |now| {
        now.focus_distance.is_some_and(|distance| (distance / focus - 1.05f64.powi(3)).abs() < 1e-5)
    });
    program.key("bracketleft");
    camera_when(&program, "the focal plane to come back", |now| {
        now.focus_distance.is_some_and(|distance| (distance / focus - 1.05f64.powi(2)).abs() < 1e-5)
    });
    let radius = home.lens_radius.expect("the gallery has a lens");
    program.key("braceright braceright");
    camera_when(&program, "the aperture to open", |now| {
        now.lens_radius.is_some_and(|wide| (wide / radius - 1.05f64.powi(2)).abs() < 1e-5)
    });
    program.key("o");
    camera_when(&program, "the depth of field to go", |now| now.lens_radius.is_none());
    program.key("o");
    camera_when(&program, "the depth of field to come", |now| now.lens_radius.is_some());
    let stepped = camera(&program).focus_distance;
    program.xdotool("keydown shift");
    program.drag(1, (320, 300), (0, 0));
    program.xdotool("keyup shift");
    let clicked = camera_when(&program, "the focus to go to the click", |now| now.focus_distance != stepped);
    let near = clicked.focus_distance.expect("it is always printed");
    assert!(near > 0.0 && near < 2.0 * distance(&home), "the floor in front is near: {near}");
    assert_eq!(clicked.eye, home.eye, "a click moves nothing");

    // Linear light; and nothing that is there is ever written over.
    keep(&program, "shift+k", &file("gallery-0001.exr"));
    let linear = image::open(file("gallery-0001.exr")).expect("an EXR file").to_rgb32f();
    assert_eq!(linear.dimensions(), (640, 360));
    assert!(linear.as_raw().iter().all(|value| value.is_finite() && *value >= 0.0));
    assert!(linear.as_raw().iter().any(|value| *value > 1.0), "linear light knows no white");
    std::fs::write(file("gallery-0003.png"), "somebody else's").expect("a file in the way");
    keep(&program, "F12", &file("gallery-0004.png"));
    assert_eq!(std::fs::read(file("gallery-0003.png")).expect("still there"), b"somebody else's");

    // The list of keys, shown and hidden, over a picture that stands still.
    program.pause_raw();
    let middle = |program: &Program| image::imageops::crop_imm(&program.pixels(), 160, 90, 320, 180).to_image();
    until("the picture to stand still", || {
        let before = middle(&program);
        std::thread::sleep(Duration::from_millis(400));
        (difference(&before, &middle(&program)) == 0.0).then_some(())
    });
    let bare = middle(&program);
    program.key("h");
    until("the list of keys", || (difference(&bare, &middle(&program)) > 10.0).then_some(()));
    program.key("Escape");
    until("the list to close", || (difference(&bare, &middle(&program)) == 0.0).then_some(()));
    let foot = |program: &Program| image::imageops::crop_imm(&program.pixels(), 0, 340, 640, 20).to_image();
    let written = foot(&program);
    program.key("Tab");
    until("the status line to go", || (difference(&written, &foot(&program)) > 10.0).then_some(()));
    program.key("Tab p");

    // Resizing is where windows hang.
    let mut state = 1u32;
    for _ in 0..60 {
        state = state.wrapping_mul(1664525).wrapping_add(1013904223);
        program.resize(80 + (state >> 8) % 900, 60 + (state >> 20) % 700);
    }
    program.must_live();
    program.resize(500, 300);
    until("a picture of the new size", || (program.pixels().dimensions() == (500, 300)).then_some(()));
    until("the gallery to be seen again", || has_content(&program.pixels()).then_some(()));
    keep(&program, "k", &file("gallery-0005.png"));
    assert_eq!(open_picture(&file("gallery-0005.png")).dimensions(), (500, 300));

    // Away and back.
    program.minimise();
    std::thread::sleep(Duration::from_millis(500));
    program.must_live();
    program.focus();
    until("the gallery to come back", || has_content(&program.pixels()).then_some(()));

    program.key("ctrl+q");
    assert!(program.ended().success());
    assert_eq!(std::fs::read(file("gallery-0003.png")).expect("still there"), b"somebody else's");
}

#[test]
fn a_dense_screen_gets_fine_pictures_and_one_asked_for_on_the_way_out_is_kept() {
    let Some(desktop) = Desktop::start() else { return };
    let program = desktop.open(
        &["cornell", "--size", "240x180"],
        &[("WINIT_X11_SCALE_FACTOR", "2"), ("WAYLAND_DISPLAY", "nobody-listens")],
    );
    until("the box to be seen", || has_content(&program.pixels()).then_some(()));
    program.key("k");
    program.close();
    assert!(program.ended().success(), "closing the window is no failure");
    assert_eq!(open_picture(&desktop.folder().join("cornell-0001.png")).dimensions(), (480, 360));
}

#[test]
fn a_paused_window_sleeps() {
    let Some(desktop) = Desktop::start() else { return };
    let mut program = desktop.open(&["cornell", "--size", "160x120"], &[]);
    until("the box to be seen", || has_content(&program.pixels()).then_some(()));
    program.key("p");
    std::thread::sleep(Duration::from_secs(3));
    let before = program.cpu_seconds();
    std::thread::sleep(Duration::from_secs(2));
    let used = program.cpu_seconds() - before;
    assert!(used <= 0.1, "{used} CPU seconds in 2 s of doing nothing");
    // Whoever wants to get out of something loses no samples.
    program.key("Escape Escape Escape");
    std::thread::sleep(Duration::from_millis(300));
    program.must_live();
    program.key("ctrl+q");
    assert!(program.ended().success());
}

#[test]
fn a_person_edits_inspects_and_takes_it_back() {
    let Some(desktop) = Desktop::start() else { return };
    let program = desktop.open(&["cornell-balls", "--size", "640x360"], &[]);
    until("the box to be seen", || has_content(&program.pixels()).then_some(()));
    // Several samples per pixel: what comes back below is more than a first sample made again.
    std::thread::sleep(Duration::from_secs(1));
    program.pause_raw();
    let middle = |program: &Program| image::imageops::crop_imm(&program.pixels(), 150, 60, 200, 220).to_image();
    let steady = |program: &Program| {
        until("the picture to stand still", || {
            let before = middle(program);
            std::thread::sleep(Duration::from_millis(500));
            (difference(&before, &middle(program)) == 0.0).then_some(before)
        })
    };
    let picture = steady(&program);
    // Normals in its place, and back again without a sample lost.
    program.key("1");
    until("normals", || (difference(&picture, &middle(&program)) > 15.0).then_some(()));
    program.key("1");
    until("the picture again", || (difference(&picture, &middle(&program)) == 0.0).then_some(()));
    // The panel comes and goes, and the bare picture remains.
    let right = |program: &Program| image::imageops::crop_imm(&program.pixels(), 400, 0, 230, 330).to_image();
    let bare = right(&program);
    program.key("n");
    until("the panel", || (difference(&bare, &right(&program)) > 10.0).then_some(()));
    program.key("n");
    until("the panel to go", || (difference(&bare, &right(&program)) == 0.0).then_some(()));
    // A click selects: the corners of a box are drawn. Delete changes the picture, and Ctrl+Z gives it back.
    program.drag(1, (250, 250), (0, 0));
    until("what is selected to be marked", || (difference(&picture, &middle(&program)) > 0.05).then_some(()));
    let marked = middle(&program);
    program.key("Delete");
    until("it to go", || (difference(&marked, &middle(&program)) > 1.0).then_some(()));
    let gone = steady(&program);
    program.key("ctrl+z");
    until("it to come back", || (difference(&gone, &middle(&program)) > 1.0).then_some(()));
    program.key("ctrl+q");
    assert!(program.ended().success());
}

/// Deletes the sphere in front, and waits until the title says that there are changes.
fn delete_something(program: &Program, title: &str) {
    until("the box to be seen", || has_content(&program.pixels()).then_some(()));
    until("a clean title", || (program.title() == format!("firstlight — {title}")).then_some(()));
    program.drag(1, (250, 250), (0, 0));
    std::thread::sleep(Duration::from_millis(500));
    program.key("Delete");
    until("the title to tell of changes", || (program.title() == format!("firstlight — *{title}")).then_some(()));
}

fn objects_in(path: &Path) -> usize {
    let text = std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    SceneFile::parse(&text, path).unwrap_or_else(|error| panic!("{error}")).objects.len()
}

#[test]
fn a_window_with_unsaved_changes_asks_before_it_closes() {
    let Some(desktop) = Desktop::start() else { return };
    let source = firstlight::scene::SceneSource::Builtin("cornell-balls".to_owned());
    let whole = firstlight::scene::load(&source, &Default::default()).expect("a built-in scene").file.objects.len();
    let mut program = desktop.open(&["cornell-balls", "--size", "640x360"], &[]);
    delete_something(&program, "cornell-balls");
    program.pause_raw();
    let middle = |program: &Program| image::imageops::crop_imm(&program.pixels(), 180, 120, 280, 120).to_image();
    let asks = |program: &Program, bare: &image::RgbImage| {
        until("the question", || (difference(bare, &middle(program)) > 15.0).then_some(()));
    };
    // Pausing may take a while on a busy machine.
    let mut bare = middle(&program);
    until("the image to stand still", || {
        std::thread::sleep(Duration::from_millis(1500));
        let before = std::mem::replace(&mut bare, middle(&program));
        (difference(&before, &bare) < 0.5).then_some(())
    });
    // However it is closed, it asks; Esc goes on as if nothing had been.
    for way in 0..2 {
        match way {
            0 => program.close(),
            _ => program.key("ctrl+q"),
        }
        asks(&program, &bare);
        program.must_live();
        program.key("Escape");
        until("the question to go", || (difference(&bare, &middle(&program)) < 5.0).then_some(()));
        program.must_live();
    }
    // What is undone is not unsaved, and what is done again is.
    program.key("ctrl+z");
    until("a clean title", || (program.title() == "firstlight — cornell-balls").then_some(()));
    program.key("ctrl+y");
    until("changes again", || (program.title() == "firstlight — *cornell-balls").then_some(()));
    program.key("ctrl+q");
    asks(&program, &bare);
    program.key("Return");
    assert!(program.ended().success());
    assert_eq!(objects_in(&desktop.folder().join("cornell-balls-0001.ron")), whole - 1);
    // Not saved at the person's wish: nothing is written, and nothing is offered later.
    let mut program = desktop.open(&["cornell-balls", "--size", "640x360"], &[]);
    delete_something(&program, "cornell-balls");
    program.close();
    std::thread::sleep(Duration::from_millis(700));
    // A letter alone may have been meant for something else.
    program.key("d");
    std::thread::sleep(Duration::from_millis(300));
    program.must_live();
    program.key("ctrl+d");
    assert!(program.ended().success());
    assert!(!desktop.folder().join("cornell-balls-0002.ron").exists());
    assert_eq!(left_behind(&desktop), 0);
}

/// Scenes that are kept for the next start.
fn left_behind(desktop: &Desktop) -> usize {
    let Ok(entries) = std::fs::read_dir(desktop.settings().join("recovery")) else { return 0 };
    let paths = entries.map(|entry| entry.expect("a folder that can be read").path());
    paths.filter(|path| path.extension().is_some_and(|extension| extension == "ron")).count()
}

#[test]
fn changes_that_could_not_be_saved_are_offered_at_the_next_start() {
    let Some(desktop) = Desktop::start() else { return };
    // Killed, and told to end: what was edited is kept in either case.
    for (signal, code, number) in [("KILL", None, 1), ("TERM", Some(130), 2)] {
        let program = desktop.open(&["cornell-balls", "--size", "640x360"], &[]);
        delete_something(&program, "cornell-balls");
        if signal == "KILL" {
            until("the changes to be kept", || (left_behind(&desktop) == 1).then_some(()));
        }
        program.signal(signal);
        let (status, said) = program.left();
        assert_eq!(status.code(), code, "{said}");
        assert_eq!(left_behind(&desktop), 1, "{said}");
        let program = desktop.open(&["cornell", "--size", "640x360"], &[]);
        until("the box to be seen", || has_content(&program.pixels()).then_some(()));
        let name = format!("cornell-balls-{number:04}.ron");
        // The question comes some time after the scene.
        until("the scene to come back", || {
            program.key("Return");
            std::thread::sleep(Duration::from_millis(700));
            (program.title() == format!("firstlight — {name}")).then_some(())
        });
        assert_eq!(left_behind(&desktop), 0);
        program.key("ctrl+q");
        assert!(program.ended().success());
        let [restored, first] =
            [name.as_str(), "cornell-balls-0001.ron"].map(|name| objects_in(&desktop.folder().join(name)));
        assert_eq!(restored, first);
    }
}

#[test]
fn a_hidden_window_rests() {
    let Some(desktop) = Desktop::start() else { return };
    let program = desktop.open(&["cornell", "--size", "320x240"], &[]);
    until("the box to be seen", || has_content(&program.pixels()).then_some(()));
    program.minimise();
    std::thread::sleep(Duration::from_secs(2));
    let before = program.cpu_seconds();
    std::thread::sleep(Duration::from_secs(2));
    let used = program.cpu_seconds() - before;
    assert!(used <= 0.1, "{used} CPU seconds in 2 s of not being seen");
    program.focus();
    let before = program.cpu_seconds();
    until("it to go on", || (program.cpu_seconds() - before > 0.1).then_some(()));
    program.key("ctrl+q");
    assert!(program.ended().success());
}

#[test]
fn a_scene_that_is_not_there_is_told_in_the_terminal() {
    let Some(desktop) = Desktop::start() else { return };
    let folder = desktop.folder();
    std::fs::write(folder.join("broken.ron"), "(camera: (eye: (0, 0, 0), look_at: (0, 0, 0)))").expect("a file");
    for (scene, expected, code) in
        [("broken.ron", "broken.ron:1", 1), ("galery", "did you mean `gallery`", 2), ("no.obj", "no.obj", 1)]
    {
        let (status, errors) = desktop.fails(&[scene], &[]);
        assert_eq!(status.code(), Some(code), "{scene}: {errors}");
        assert!(errors.contains(expected) && !errors.contains("panicked"), "{scene}: {errors}");
    }
}

#[test]
fn without_a_graphics_driver_the_way_out_is_told() {
    let Some(desktop) = Desktop::start() else { return };
    let nowhere = [("VK_ICD_FILENAMES", "/nowhere"), ("VK_DRIVER_FILES", "/nowhere"), ("WGPU_BACKEND", "vulkan")];
    let (status, errors) = desktop.fails(&["cornell"], &nowhere);
    assert_eq!(status.code(), Some(1), "{errors}");
    assert!(errors.contains("install one") && errors.contains("firstlight render"), "{errors}");
    assert!(!errors.contains("panicked"), "{errors}");
}

#[test]
fn without_a_display_the_scene_is_rendered_to_a_picture() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let errors = does(folder.path(), "cornell --size 48x32").err;
    assert!(errors.contains("no display"), "{errors}");
    let picture = open_picture(&folder.path().join("firstlight-cornell.png"));
    assert_eq!(picture.dimensions(), (48, 32));
    assert!(content(&picture).1 > 10.0, "{:?}", content(&picture));
}
