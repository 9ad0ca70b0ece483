//! The real window as a good guest: files dropped on it, sizes of nothing, a screen that goes away, and the processor
//! left to others when there is nothing to do.
#![cfg(all(feature = "viewer", target_os = "linux"))]

use crate::desktop::{Desktop, Losing, Loss, Program, until};
use std::path::Path;
use std::time::Duration;

/// More than one colour is on it.
fn has_content(program: &Program) -> bool {
    let picture = program.pixels();
    let first = *picture.get_pixel(picture.width() / 2, picture.height() / 2);
    picture.pixels().filter(|pixel| **pixel != first).count() > 50
}

/// By more than noise and figures.
fn differ(a: &image::RgbImage, b: &image::RgbImage) -> bool {
    let far = |(a, b): (&image::Rgb<u8>, &image::Rgb<u8>)| (0..3).any(|c| a.0[c].abs_diff(b.0[c]) > 48);
    20 * a.pixels().zip(b.pixels()).filter(|pair| far(*pair)).count() > a.pixels().len()
}

pub fn seen(program: &Program) {
    until("a picture to be seen", || has_content(program).then_some(()));
}

/// Keeps the picture under this name.
fn keep(program: &Program, path: &Path) {
    program.key("k");
    until(&format!("{} to be saved", path.display()), || path.is_file().then_some(()));
}

fn title_is(program: &Program, expected: &str) {
    until(&format!("the title {expected}"), || (program.title() == format!("firstlight — {expected}")).then_some(()));
}

#[test]
fn what_is_dropped_on_the_window_is_opened() {
    let Some(desktop) = Desktop::start() else { return };
    let folder = desktop.folder();
    let mut program = desktop.open(&["cornell", "--size", "320x240"], &[]);
    seen(&program);
    keep(&program, &folder.join("cornell-0001.png"));
    // A scene file, with a blank in its name, as file managers write it.
    let text = firstlight::scene::builtin_text("ball").expect("a built-in scene");
    std::fs::write(folder.join("my ball.ron"), text).expect("a file");
    program.drop_file(&folder.join("my%20ball.ron"));
    title_is(&program, "my ball.ron");
    // A model.
    std::fs::write(folder.join("tent.obj"), "v 0 0 0\nv 1 0 0\nv 0 0 -1\nv 0 1 0\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")
        .expect("a file");
    program.drop_file(&folder.join("tent.obj"));
    title_is(&program, "tent.obj");
    // A picture that was kept comes back as the scene that it shows, in the view that it shows.
    program.drop_file(&folder.join("cornell-0001.png"));
    title_is(&program, "cornell");
    // What cannot be opened changes nothing, and is told.
    std::fs::write(folder.join("notes.txt"), "hello").expect("a file");
    program.drop_file(&folder.join("notes.txt"));
    std::thread::sleep(Duration::from_millis(500));
    program.must_live();
    title_is(&program, "cornell");
    program.key("ctrl+q");
    assert!(program.ended().success());
    let settings = std::fs::read_to_string(desktop.settings().join("settings.ron")).expect("settings were kept");
    let order = ["cornell", "tent.obj", "my ball.ron"].map(|name| settings.find(name).expect(name));
    assert!(order.is_sorted(), "the latest first: {settings}");
}

#[test]
fn a_picture_of_a_scene_that_has_changed_says_so() {
    let Some(desktop) = Desktop::start() else { return };
    let folder = desktop.folder();
    let text = firstlight::scene::builtin_text("ball").expect("a built-in scene");
    std::fs::write(folder.join("room.ron"), text).expect("a file");
    let program = desktop.open(&["room.ron", "--size", "320x240"], &[]);
    seen(&program);
    keep(&program, &folder.join("room-0001.png"));
    program.key("ctrl+q");
    assert!(program.ended().success());
    let smaller = text.replace("radius: 2,", "radius: 1.5,");
    assert_ne!(smaller, text);
    std::fs::write(folder.join("room.ron"), smaller).expect("a file");
    let program = desktop.open(&["room-0001.png", "--size", "320x240"], &[("RUST_LOG", "info")]);
    until("it to say so", || program.errors().contains("has changed since the image was rendered").then_some(()));
    program.key("ctrl+q");
    // What it says on the way is no failure.
    assert!(program.left().0.success());
}

#[test]
fn a_window_of_nothing_is_survived() {
    let Some(desktop) = Desktop::start() else { return };
    let mut program = desktop.open(&["cornell", "--size", "320x240"], &[]);
    seen(&program);
    for (width, height) in [(1, 1), (2, 1), (1, 300), (600, 1), (3, 3), (16, 9), (1, 1)] {
        program.resize(width, height);
        std::thread::sleep(Duration::from_millis(150));
        program.must_live();
    }
    // The panel and the list of keys in a window that has no room for them.
    program.resize(24, 16);
    program.key("n");
    program.key("h");
    std::thread::sleep(Duration::from_millis(400));
    program.must_live();
    program.key("Escape");
    program.key("n");
    program.resize(400, 300);
    until("the old size", || (program.pixels().dimensions() == (400, 300)).then_some(()));
    seen(&program);
    program.key("ctrl+q");
    assert!(program.ended().success());
}

#[test]
fn another_scale_of_the_screen_changes_the_window_while_it_runs() {
    let Some(desktop) = Desktop::start() else { return };
    let scale = desktop.scale();
    let mut program = desktop.open(&["cornell", "--size", "320x240"], &[]);
    seen(&program);
    // The panel too, since its text is what the scale is for.
    program.key("n");
    for (dpi, size) in [(192, (640, 480)), (144, (480, 360)), (96, (320, 240))] {
        scale.set_dpi(dpi);
        until(&format!("{dpi} dots an inch"), || (program.pixels().dimensions() == size).then_some(()));
        seen(&program);
        program.must_live();
    }
    // The picture has as many pixels as the window.
    program.key("n");
    scale.set_dpi(192);
    until("a window of twice the size", || (program.pixels().dimensions() == (640, 480)).then_some(()));
    let path = desktop.folder().join("cornell-0001.png");
    keep(&program, &path);
    assert_eq!(image::image_dimensions(&path).expect("a picture"), (640, 480));
    program.key("ctrl+q");
    assert!(program.ended().success());
}

#[test]
fn a_screen_that_goes_away_ends_the_program_and_leaves_the_settings() {
    let Some(desktop) = Desktop::start() else { return };
    let program = desktop.open(&["cornell", "--size", "320x240"], &[]);
    seen(&program);
    program.key("ctrl+2");
    program.resize(432, 234);
    let settings = desktop.settings().join("settings.ron");
    until("the new size to be kept", || std::fs::read_to_string(&settings).ok()?.contains("432").then_some(()));
    desktop.lose();
    let (status, errors) = program.left();
    assert!(!status.success(), "it cannot have been asked to leave");
    // Ours, or one of two of Xlib, whoever sees it first.
    let why = errors.to_lowercase();
    assert!(["connection", "display", "x server"].iter().any(|word| why.contains(word)), "it says why: {errors}");
    assert!(!errors.contains("panicked"), "{errors}");
    let kept = std::fs::read_to_string(&settings).expect("settings are there");
    assert!(kept.contains("432") && kept.contains("234") && kept.contains("cornell"), "{kept}");
    let files = std::fs::read_dir(desktop.settings()).expect("the folder of settings");
    assert!(files.count() >= 2, "the bookmark was kept as well");
}

#[test]
fn at_its_target_the_window_sleeps() {
    let Some(desktop) = Desktop::start() else { return };
    // Few pixels, and light that is found at once: the target is reached within seconds.
    let program = desktop.open(&["ball", "--size", "96x64"], &[]);
    seen(&program);
    until("the target to be reached", || {
        let before = program.cpu_seconds();
        std::thread::sleep(Duration::from_secs(2));
        (program.cpu_seconds() - before <= 0.01).then_some(())
    });
    let (before, seconds) = (program.cpu_seconds(), 6.0);
    std::thread::sleep(Duration::from_secs_f64(seconds));
    let used = program.cpu_seconds() - before;
    assert!(used < 0.01 * seconds, "{used} CPU seconds in {seconds} s at the target");
    // It is not dead: a movement is answered.
    program.hold("Right", 200);
    until("it to go on", || (program.cpu_seconds() - before > 0.1).then_some(()));
    program.key("ctrl+q");
    assert!(program.ended().success());
}

#[test]
fn the_number_of_threads_is_that_of_the_panel_at_once() {
    let Some(desktop) = Desktop::start() else { return };
    let program = desktop.open(&["cornell", "--size", "1280x720", "--threads", "2"], &[]);
    seen(&program);
    let workers = |program: &Program| {
        let names = program.threads();
        let is_worker = |name: &&String| name.strip_prefix("firstlight ").is_some_and(|n| n.parse::<u32>().is_ok());
        names.iter().filter(is_worker).count()
    };
    assert_eq!(workers(&program), 2, "{:?}", program.threads());
    program.key("n");
    std::thread::sleep(Duration::from_secs(3));
    // The number in the row of threads: clicked, it is typed over.
    program.drag(1, (1124, 149), (0, 0));
    std::thread::sleep(Duration::from_millis(700));
    program.key("ctrl+a");
    program.type_text("3");
    program.key("Return");
    until("three workers", || (workers(&program) == 3).then_some(()));
    program.key("ctrl+q");
    assert!(program.ended().success());
}

#[test]
fn a_driver_that_loses_the_window_or_itself_costs_no_samples() {
    let Some(desktop) = Desktop::start() else { return };
    let losing = Losing::new(desktop.folder());
    let environment = losing.environment();
    let mut environment: Vec<(&str, &str)> = environment.iter().map(|(name, value)| (*name, value.as_str())).collect();
    environment.push(("RUST_LOG", "error,firstlight::frame=debug"));
    let mut program = desktop.open(&["ball", "--size", "320x240"], &environment);
    seen(&program);
    // Done, and all messages gone.
    until("the window to rest", || {
        let before = program.pixels();
        std::thread::sleep(Duration::from_millis(1500));
        (program.pixels() == before).then_some(())
    });
    let (shown, restarts) = (program.pixels(), program.errors().matches("restart ").count());
    for loss in [Loss::OutOfDate, Loss::Surface, Loss::Device, Loss::Surface] {
        losing.lose_next(loss);
        // It draws: what is asked for now is to be seen.
        program.key("h");
        losing.has_lost();
        until(&format!("the keys to be shown after {loss:?}"), || differ(&shown, &program.pixels()).then_some(()));
        program.key("Escape");
        until("the keys to go", || (!differ(&shown, &program.pixels())).then_some(()));
        program.must_live();
        let now = program.errors().matches("restart ").count();
        assert_eq!(now, restarts, "{loss:?}: all samples stay\n{}", program.errors());
    }
    program.key("ctrl+q");
    let (status, said) = program.left();
    assert!(status.success() && !said.contains("panicked"), "{said}");
}
