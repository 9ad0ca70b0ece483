//! What a person does by mouse alone, with the buttons and menus of the real window.
#![cfg(all(feature = "viewer", target_os = "linux"))]

use crate::desktop::{Desktop, Program, until};
use crate::guest::seen;
use firstlight::format::parts::MaterialPart;
use firstlight::scene::ColorValue;
use firstlight::scene::file::SceneFile;
use std::path::Path;
use std::time::{Duration, Instant};

/// Height of the windows here.
const HEIGHT: i32 = 600;
/// A ball in front of a white sky, so that what is dark is a menu.
const ROOM: &str = "(camera: (eye: (0, 1, 6), look_at: (0, 1, 0), vfov: 40), environment: constant(1),
    materials: { \"grey\": diffuse(albedo: 0.5) }, objects: [
        sphere(name: \"ball\", center: (0, 1.5, 0), radius: 0.8, material: \"grey\"),
        plane(name: \"floor\", point: (0, 0, 0), normal: (0, 1, 0), material: \"grey\"),
    ])";

fn is_dark(program: &Program, (x, y): (i32, i32)) -> bool {
    program.pixels().get_pixel(x as u32, y as u32).0.iter().all(|value| *value < 70)
}

/// Clicks where there is a button, once the window has had time to see the mouse.
fn click(program: &Program, button: u32, at: (i32, i32)) {
    program.point_at(at.0, at.1);
    std::thread::sleep(Duration::from_millis(250));
    program.drag(button, at, (0, 0));
}

/// Clicks, and waits for a menu at another place; as a person does, again where nothing happens for seconds.
fn open(program: &Program, button: u32, at: (i32, i32), menu: (i32, i32)) {
    let mut clicked: Option<Instant> = None;
    until("the menu to open", || {
        if clicked.is_none_or(|then| then.elapsed() > Duration::from_secs(5)) {
            click(program, button, at);
            clicked = Some(Instant::now());
        }
        is_dark(program, menu).then_some(())
    });
    // It has its final place one frame later.
    std::thread::sleep(Duration::from_millis(300));
}

/// Clicks a line of a menu, and waits until the menu is gone; as a person does, again where nothing happens for seconds.
fn choose(program: &Program, at: (i32, i32), menu: (i32, i32)) {
    let mut clicked: Option<Instant> = None;
    until("the menu to close", || {
        if clicked.is_none_or(|then| then.elapsed() > Duration::from_secs(5)) {
            click(program, 1, at);
            clicked = Some(Instant::now());
        }
        (!is_dark(program, menu)).then_some(())
    });
}

/// A place in the lower left corner of the menu of the bar.
const MENU: (i32, i32) = (9, HEIGHT - 36);

fn open_menu(program: &Program) {
    open(program, 1, (34, HEIGHT - 13), MENU);
}

/// Chooses a line of the menu of the bar, by its distance from the lower edge of the window.
fn choose_in_menu(program: &Program, up: i32) {
    open_menu(program);
    choose(program, (60, HEIGHT - up), MENU);
}

fn title_is(program: &Program, expected: &str) {
    until(&format!("the title {expected}"), || (program.title() == format!("firstlight — {expected}")).then_some(()));
}

/// Saves the scene by the menu; returns what was written.
fn saved(program: &Program, path: &Path) -> SceneFile {
    std::fs::remove_file(path).expect("the file of the scene");
    choose_in_menu(program, 434);
    until("the scene to be saved", || SceneFile::parse(&std::fs::read_to_string(path).ok()?, path).ok())
}

#[test]
fn an_object_is_selected_dressed_copied_deleted_and_saved_by_mouse() {
    let Some(desktop) = Desktop::start() else { return };
    let path = desktop.folder().join("room.ron");
    std::fs::write(&path, ROOM).expect("a file");
    let program = desktop.open(&["room.ron", "--size", "800x600"], &[]);
    title_is(&program, "room.ron");
    seen(&program);
    let ball = (380, 200);
    // In the frame of the menu of the image, and its lines below the place of the right click.
    let frame = (ball.0 + 4, ball.1 + 30);
    let place = |line: i32| (ball.0 + 30, ball.1 + 43 + 21 * line);
    let here = |line: i32| {
        open(&program, 3, ball, frame);
        choose(&program, place(line), frame);
    };
    let [focus, copy, delete, material] = [1, 5, 6, 13];
    let undo = || click(&program, 1, (75, HEIGHT - 13));
    // Gold, the first of the ready materials: their menu ends at the lower edge of the window.
    open(&program, 3, ball, frame);
    open(&program, 1, place(material), (620, 128));
    choose(&program, (595, 54), frame);
    title_is(&program, "*room.ron");
    here(focus);
    let file = saved(&program, &path);
    assert_eq!(file.objects[0].material(), Some("gold"));
    assert!(file.materials.iter().any(|(name, _)| name == "gold"));
    let focus = file.camera.focus_distance.expect("what was clicked is in focus");
    assert!((focus - 5.25).abs() < 0.2, "{focus}");
    title_is(&program, "room.ron");
    here(copy);
    title_is(&program, "*room.ron");
    assert_eq!(saved(&program, &path).objects.len(), 3);
    title_is(&program, "room.ron");
    here(delete);
    title_is(&program, "*room.ron");
    undo();
    title_is(&program, "room.ron");
    // A picture, and away.
    choose_in_menu(&program, 392);
    until("the picture", || desktop.folder().join("room-0001.png").is_file().then_some(()));
    open_menu(&program);
    click(&program, 1, (60, HEIGHT - 38));
    assert!(program.ended().success());
}

#[test]
fn files_and_scenes_are_opened_by_mouse_where_the_desktop_has_no_dialog() {
    let Some(desktop) = Desktop::start() else { return };
    let folder = desktop.folder();
    std::fs::write(folder.join("room.ron"), ROOM).expect("a file");
    let tent = "v 0 0 0\nv 1 0 0\nv 0 0 -1\nv 0 1 0\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    std::fs::write(folder.join("a.obj"), tent).expect("a file");
    let program = desktop.open(&["room.ron", "--size", "800x600"], &[("PATH", "/nowhere")]);
    title_is(&program, "room.ron");
    seen(&program);
    open_menu(&program);
    let browser = (300, 450);
    open(&program, 1, (60, HEIGHT - 497), browser);
    until("the model to open", || {
        // Below the folder of the settings, once it has been read; and the button at the lower right.
        click(&program, 1, (230, 163));
        click(&program, 1, (710, 539));
        (program.title() == "firstlight — a.obj").then_some(())
    });
    until("the browser to close", || (!is_dark(&program, browser)).then_some(()));
    let other = (230, HEIGHT - 476);
    open_menu(&program);
    open(&program, 1, (60, HEIGHT - 476), other);
    choose(&program, (260, HEIGHT - 476), MENU);
    title_is(&program, "room.ron");
    open_menu(&program);
    open(&program, 1, (60, HEIGHT - 455), (230, HEIGHT - 455));
    // Where the menu was, the scene is dark, too.
    until("the scene to open", || {
        click(&program, 1, (300, HEIGHT - 428));
        (0..20)
            .any(|_| {
                std::thread::sleep(std::time::Duration::from_millis(100));
                program.title().contains("cornell")
            })
            .then_some(())
    });
    program.key("ctrl+q");
    assert!(program.ended().success());
}

/// The brightest channel of the emissive material.
fn emission(file: &SceneFile) -> f32 {
    let radiance = file.materials.iter().find_map(|(_, part)| match part {
        MaterialPart::Emissive { radiance: ColorValue::Rgb(radiance) } => Some(radiance.max_element()),
        _ => None,
    });
    radiance.expect("an emissive material")
}

/// The panel with these sections open, and no other.
fn keep_panel(desktop: &Desktop, open: &[&str]) {
    let sections = firstlight::viewer::keys::items().filter_map(|(item, _)| item.name.strip_prefix("Panel: "));
    let sections: Vec<String> = sections.map(|name| format!("{name:?}: {}", open.contains(&name))).collect();
    let text = format!("(greeted: true, panel: true, sections: {{{}}})", sections.join(", "));
    std::fs::write(desktop.settings().join("settings.ron"), text).expect("settings");
}

/// Does what changes the scene; again, if a menu that was still closing has taken the click.
fn until_changed(program: &Program, act: impl Fn()) {
    for _ in 0..4 {
        act();
        let start = Instant::now();
        while start.elapsed() < Duration::from_secs(20) {
            if program.title().ends_with("*room.ron") {
                return;
            }
            std::thread::sleep(Duration::from_millis(50));
        }
    }
    panic!("nothing has changed: {}", program.title());
}

#[test]
fn a_scene_is_framed_focused_lit_and_rendered_while_one_flies_on() {
    let Some(desktop) = Desktop::start() else { return };
    let path = desktop.folder().join("room.ron");
    std::fs::write(&path, ROOM.replace("environment:", "film: (width: 960, height: 540), environment:"))
        .expect("a file");
    keep_panel(&desktop, &["Lights", "Environment"]);
    let program = desktop.open(&["room.ron", "--size", "800x600"], &[]);
    title_is(&program, "room.ron");
    seen(&program);
    // The image is what the panel leaves free.
    let ball = (226, 200);
    let frame = (ball.0 + 4, ball.1 + 30);
    open(&program, 3, ball, frame);
    choose(&program, (ball.0 + 30, ball.1 + 43), frame);
    // The lens, in the menu of the bar: depth of field, then a wider aperture.
    for line in [131, 173] {
        open_menu(&program);
        open(&program, 1, (60, HEIGHT - 215), (230, HEIGHT - 131));
        choose(&program, (275, HEIGHT - line), MENU);
    }
    // In the panel: an area light, which is dimmed in its row, and less light from around.
    until_changed(&program, || click(&program, 1, (585, 326)));
    let before = emission(&saved(&program, &path));
    until_changed(&program, || program.drag(1, (600, 281), (-60, 0)));
    // Saved in between, so that the title tells when the next one has been seen.
    saved(&program, &path);
    until_changed(&program, || program.drag(1, (645, 304), (-60, 0)));
    let file = saved(&program, &path);
    let camera = &file.camera;
    let away = camera.eye.distance(glam::DVec3::new(0.0, 1.5, 0.0));
    assert!(away < 4.0, "the ball is framed: {camera:?}");
    assert!(camera.f_stop.is_some() || camera.lens_radius.is_some_and(|radius| radius > 0.0), "{camera:?}");
    let text = std::fs::read_to_string(&path).expect("the scene");
    let now = emission(&file);
    assert!(text.contains("quad(") && now < before, "a dimmer light: {before}, {now}");
    assert!(!text.contains("environment: constant(1"), "{text}");
    // An image with little noise, while the view goes on.
    let form = (300, 455);
    open_menu(&program);
    open(&program, 1, (60, HEIGHT - 328), form);
    // Keys are the form's as long as it is open.
    program.key("Delete");
    program.key("Return");
    until("the form to go", || (!is_dark(&program, form)).then_some(()));
    assert_eq!(program.title(), "firstlight — room.ron", "nothing was deleted behind it");
    program.hold("w", 300);
    let image = desktop.folder().join("room-0001.png");
    until("the image", || image.is_file().then_some(()));
    assert_eq!(image::image_dimensions(&image).expect("a PNG"), (960, 540));
    let shot = firstlight::scene::ImageMetadata::read(&image).expect("it opens again");
    // The camera may still have glided a little; flying goes much farther.
    let moved = shot.camera.eye.distance(camera.eye);
    assert!(moved < 0.01 && shot.denoised.as_deref() == Some("own"), "as it was seen: {moved} m");
    until("its path", || {
        (program.output() + &program.errors()).contains("room-0001.png (960 × 540, noise ").then_some(())
    });
    program.key("ctrl+q");
    assert!(program.ended().success());
}

#[test]
fn a_material_is_dropped_on_an_object_and_the_panel_keeps_clicks_from_what_is_behind() {
    let Some(desktop) = Desktop::start() else { return };
    let path = desktop.folder().join("room.ron");
    let red = "materials: { \"red\": diffuse(albedo: (0.7, 0.1, 0.1)), ";
    std::fs::write(&path, ROOM.replace("materials: { ", red)).expect("a file");
    keep_panel(&desktop, &["Materials"]);
    let program = desktop.open(&["room.ron", "--size", "800x600"], &[]);
    title_is(&program, "room.ron");
    seen(&program);
    // A finger has no way to the panel, and what is behind it is no choice of anybody's.
    program.point_at(100, 100);
    std::thread::sleep(Duration::from_millis(300));
    program.drag(1, (760, 560), (0, 0));
    program.key("Delete");
    std::thread::sleep(Duration::from_millis(500));
    assert_eq!(program.title(), "firstlight — room.ron", "the floor is not selected");
    // Neither is what the panel takes from the image once the mouse is back there.
    let place = (256, 300);
    program.point_at(760, 560);
    std::thread::sleep(Duration::from_millis(500));
    program.drag(3, place, (0, 0));
    let frame = (place.0 + 4, place.1 + 30);
    until("the menu of the image", || is_dark(&program, frame).then_some(()));
    program.key("Escape");
    until("the menu to close", || (!is_dark(&program, frame)).then_some(()));
    // The middle of the ball is that of what the panel leaves free.
    let (row, ball) = ((585, 263), (256, 200));
    program.drag(1, row, (ball.0 - row.0, ball.1 - row.1));
    title_is(&program, "*room.ron");
    let file = saved(&program, &path);
    assert_eq!([0, 1].map(|i| file.objects[i].material()), [Some("red"), Some("grey")]);
    program.key("ctrl+q");
    assert!(program.ended().success());
}

#[test]
fn what_is_copied_and_saved_is_there_for_other_programs() {
    use std::os::unix::fs::PermissionsExt as _;
    let Some(desktop) = Desktop::start() else { return };
    let folder = desktop.folder();
    std::fs::write(folder.join("room.ron"), ROOM).expect("a file");
    let manager = folder.join("xdg-open");
    std::fs::write(&manager, "#!/bin/sh\necho \"$1\" > asked\n").expect("a file");
    std::fs::set_permissions(&manager, std::fs::Permissions::from_mode(0o755)).expect("its mode");
    let search = format!("{}:{}", folder.display(), std::env::var("PATH").unwrap_or_default());
    let program = desktop.open(&["room.ron", "--size", "800x600"], &[("PATH", &search)]);
    title_is(&program, "room.ron");
    seen(&program);
    let camera = crate::views::camera(&program);
    until("the camera on the clipboard", || {
        let text = desktop.clipboard();
        let pasted = SceneFile::parse(&format!("({text})"), "clipboard").ok()?.camera;
        (text.starts_with("camera:") && pasted == camera).then_some(())
    });
    program.key("k");
    until("the image", || folder.join("room-0001.png").is_file().then_some(()));
    std::thread::sleep(Duration::from_millis(500));
    let list = (450, 400);
    program.key("slash");
    until("the list of commands", || is_dark(&program, list).then_some(()));
    program.type_text("Show what was saved");
    program.key("Return");
    let asked = until("the folder to be shown", || std::fs::read_to_string(folder.join("asked")).ok());
    assert_eq!(Path::new(asked.trim()), folder);
    program.key("ctrl+q");
    assert!(program.ended().success());
    // The next window shows it in the list of recent files.
    let images = std::fs::read_dir(desktop.settings().join("thumbnails")).expect("the images of recent files");
    let images: Vec<_> = images.map(|image| image::open(image.expect("a file").path())).collect();
    assert!(matches!(&images[..], [Ok(image)] if image.width() == 140), "{images:?}");
}

#[test]
fn a_command_is_found_by_its_name() {
    let Some(desktop) = Desktop::start() else { return };
    std::fs::write(desktop.folder().join("room.ron"), ROOM).expect("a file");
    let program = desktop.open(&["room.ron", "--size", "800x600"], &[]);
    title_is(&program, "room.ron");
    seen(&program);
    let list = (450, 400);
    program.key("slash");
    until("the list of commands", || is_dark(&program, list).then_some(()));
    program.type_text("delete");
    program.key("Escape");
    until("the list to close", || (!is_dark(&program, list)).then_some(()));
    program.key("slash");
    until("the list of commands", || is_dark(&program, list).then_some(()));
    // Faster than a frame.
    program.xdotool("key --delay 0 Q u i t Return");
    assert!(program.ended().success());
}

#[test]
fn a_selected_object_is_dragged_by_itself_and_the_scene_saved_under_another_name() {
    let Some(desktop) = Desktop::start() else { return };
    std::fs::write(desktop.folder().join("room.ron"), ROOM).expect("a file");
    let program = desktop.open(&["room.ron", "--size", "800x600"], &[]);
    title_is(&program, "room.ron");
    seen(&program);
    let before = crate::views::camera(&program);
    // The ball, away from the handles at its middle. A click with the handles shown is still one.
    let side = (430, 235);
    click(&program, 1, side);
    std::thread::sleep(Duration::from_millis(300));
    program.key("g");
    click(&program, 1, side);
    std::thread::sleep(Duration::from_millis(500));
    program.drag(1, side, (60, 0));
    title_is(&program, "*room.ron");
    assert_eq!(crate::views::camera(&program), before, "the camera stays");
    program.key("ctrl+shift+s");
    let browser = (300, 450);
    until("the browser to open", || is_dark(&program, browser).then_some(()));
    std::thread::sleep(Duration::from_millis(500));
    program.type_text("other");
    program.key("Return");
    title_is(&program, "other.ron");
    let text = std::fs::read_to_string(desktop.folder().join("other.ron")).expect("the scene");
    let file = SceneFile::parse(&text, "other.ron").expect("a scene");
    let center = moved_sphere(&file);
    assert!(center.x > 0.3 && center.x < 0.7 && (center.y - 1.5).abs() < 0.05, "to the right: {center}");
    program.key("ctrl+q");
    assert!(program.ended().success());
}

/// The centre of the first object, a sphere.
fn moved_sphere(file: &SceneFile) -> glam::DVec3 {
    match &file.objects[0] {
        firstlight::scene::file::ObjectPart::Sphere { center, .. } => *center,
        other => panic!("{other:?}"),
    }
}

#[test]
fn an_image_whose_goal_is_far_is_kept_as_it_stands() {
    let Some(desktop) = Desktop::start() else { return };
    std::fs::write(desktop.folder().join("room.ron"), ROOM).expect("a file");
    let program = desktop.open(&["room.ron", "--size", "800x600"], &[]);
    title_is(&program, "room.ron");
    seen(&program);
    program.key("ctrl+e");
    let form = (300, 455);
    until("the form", || is_dark(&program, form).then_some(()));
    std::thread::sleep(Duration::from_millis(500));
    // The goal in its row, typed over.
    click(&program, 1, (478, 366));
    std::thread::sleep(Duration::from_millis(500));
    program.key("ctrl+a");
    program.type_text("0.01");
    program.key("Return");
    std::thread::sleep(Duration::from_millis(300));
    // Again where a busy window has missed it; the other button is there as soon as every pixel has a sample.
    let (save, keep) = ((522, 471), (590, 551));
    let image = desktop.folder().join("room-0001.png");
    until("the image", || {
        click(&program, 1, if is_dark(&program, form) { save } else { keep });
        std::thread::sleep(Duration::from_secs(1));
        image.is_file().then_some(())
    });
    let shot = firstlight::scene::ImageMetadata::read(&image).expect("it opens again");
    let early = shot.ended_early.expect("it is said");
    assert!(early.starts_with("at noise ") && early.ends_with("asked for: noise 0.01 %"), "{early}");
    program.key("ctrl+q");
    assert!(program.ended().success());
}
