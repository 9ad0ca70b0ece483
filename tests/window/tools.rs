//! What a person does with the tools of the real window, one after the other, by synthetic keys and mouse.
#![cfg(all(feature = "viewer", target_os = "linux"))]

use crate::desktop::{Desktop, Program, until};
use crate::views::{camera, camera_when, target};
use firstlight::scene::file::CameraPart;
use glam::DVec3;
use std::time::Duration;

fn focus(camera: &CameraPart) -> f64 {
    camera.focus_distance.expect("it is always printed")
}

/// A window with a picture of this scene.
fn open<'a>(desktop: &'a Desktop, scene: &str) -> Program<'a> {
    let program = desktop.open(&[scene, "--size", "640x360"], &[]);
    until("a picture to be seen", || {
        let picture = program.pixels();
        let first = *picture.get_pixel(320, 180);
        (picture.pixels().filter(|pixel| **pixel != first).count() > 5000).then_some(())
    });
    // Until the scene is read, the window has the camera of an empty one.
    let empty = DVec3::new(0.0, 0.0, 5.0);
    until("the camera of the scene", || (camera(&program).eye != empty).then_some(()));
    program
}

/// How many pixels of a part of the window differ plainly.
fn differing(a: &image::RgbImage, b: &image::RgbImage, [x, y, w, h]: [u32; 4]) -> usize {
    let apart = |x: u32, y: u32| {
        let (a, b) = (a.get_pixel(x, y).0, b.get_pixel(x, y).0);
        a.iter().zip(b).any(|(a, b)| a.abs_diff(b) > 40)
    };
    (y..y + h).flat_map(|y| (x..x + w).map(move |x| (x, y))).filter(|&(x, y)| apart(x, y)).count()
}

/// The picture once it stands still.
fn steady(program: &Program) -> image::RgbImage {
    until("the picture to stand still", || {
        let before = program.pixels();
        std::thread::sleep(Duration::from_millis(500));
        (before == program.pixels()).then_some(before)
    })
}

#[test]
fn the_mouse_looks_orbits_or_is_captured_and_flies_as_fast_as_what_is_under_it_is_far() {
    let Some(desktop) = Desktop::start() else { return };
    let program = open(&desktop, "gallery");
    let home = camera(&program);
    let go_home = || {
        program.key("Home");
        camera_when(&program, "the view home", |now| *now == home)
    };
    // First person: the camera stays. In orbit, as at first in front of things: what is looked at stays.
    program.key("space");
    program.drag(1, (300, 200), (50, 0));
    let looked = camera_when(&program, "the view to turn", |now| target(now) != target(&home));
    assert_eq!(looked.eye, home.eye);
    go_home();
    program.key("space");
    program.drag(1, (300, 200), (50, 0));
    let orbited = camera_when(&program, "the eye to orbit", |now| now.eye != home.eye);
    assert!((target(&orbited) - target(&home)).length() < 1e-4, "{orbited:?}");
    program.key("space");
    go_home();
    // Captured: no button is needed, and the mouse cannot leave.
    program.point_at(320, 180);
    program.key("Return");
    std::thread::sleep(Duration::from_millis(300));
    program.xdotool("mousemove_relative -- 30 0");
    program.xdotool("mousemove_relative -- 30 10");
    let turned = camera_when(&program, "the captured mouse to turn the view", |now| target(now) != target(&home));
    assert_eq!(turned.eye, home.eye);
    let right = (target(&home) - home.eye).cross(DVec3::Y);
    assert!((target(&turned) - target(&home)).dot(right) > 0.0, "to the right is to the right");
    program.key("Escape");
    std::thread::sleep(Duration::from_millis(300));
    program.xdotool("mousemove_relative -- -30 0");
    assert_eq!(camera_when(&program, "the view to stay", |_| true), turned, "let go, it only points");
    go_home();
    // A tap of W goes a share of the way to what is under the mouse; the wheel with Ctrl multiplies it.
    let step = |x: i32, y: i32| {
        program.point_at(x, y);
        std::thread::sleep(Duration::from_millis(100));
        program.key("w");
        let flown = camera_when(&program, "the eye to fly", |now| now.eye != home.eye);
        go_home();
        (flown.eye - home.eye).length()
    };
    let (near, far) = (step(320, 330), step(320, 110));
    assert!(far > 1.5 * near, "{near} to the floor, {far} to the horizon");
    program.xdotool("keydown ctrl");
    for _ in 0..4 {
        program.xdotool("click 4");
    }
    program.xdotool("keyup ctrl");
    let faster = step(320, 330);
    // A synthetic wheel has buttons and no axis: winit tells of their press and of their release, so each click counts twice.
    let expected = 1.25f64.powi(8);
    assert!((faster / near / expected - 1.0).abs() < 0.25, "{near}, then {faster}");
    program.key("ctrl+q");
    assert!(program.ended().success());
}

#[test]
fn focus_goes_where_it_is_clicked_dragged_or_pointed() {
    let Some(desktop) = Desktop::start() else { return };
    let program = open(&desktop, "gallery");
    let home = camera(&program);
    let distance = (target(&home) - home.eye).length();
    // Held, a drag pulls the focus along: the floor nears towards the lower edge.
    program.xdotool("keydown shift");
    program.drag(1, (320, 230), (0, 100));
    program.xdotool("keyup shift");
    let dragged = camera_when(&program, "the focus to be dragged", |now| focus(now) != focus(&home));
    assert!(focus(&dragged) < 0.8 * distance, "{} of {distance}", focus(&dragged));
    // It stays with that point when the camera goes back.
    program.key("l");
    program.key("minus minus");
    let back = camera_when(&program, "the camera to go back", |now| now.eye != home.eye);
    let ahead = (target(&home) - home.eye).normalize();
    let moved = (home.eye - back.eye).dot(ahead);
    assert!(moved > 0.1 && (focus(&back) - focus(&dragged) - moved).abs() < 1e-3, "{moved} {}", focus(&back));
    program.key("l");
    program.key("Home");
    // With the mouse, wherever it goes.
    program.point_at(320, 330);
    program.key("shift+l");
    let near = camera_when(&program, "the focus under the mouse", |now| focus(now) < 0.8 * distance);
    program.point_at(320, 200);
    let far = camera_when(&program, "the focus to follow", |now| focus(now) != focus(&near));
    assert!(focus(&far) > focus(&near), "{} {}", focus(&near), focus(&far));
    // The mouse stays and the camera goes: what is under the mouse is sharp again.
    program.key("plus plus");
    camera_when(&program, "the focus to follow the camera's move", |now| {
        now.eye != home.eye && focus(now) < focus(&far)
    });
    program.key("shift+l");
    program.point_at(320, 330);
    let kept = camera(&program);
    assert_eq!(camera_when(&program, "the focus to stay", |_| true), kept);
    program.key("ctrl+q");
    assert!(program.ended().success());
}

#[test]
fn a_pixel_is_explained_and_a_rectangle_gets_all_samples() {
    let Some(desktop) = Desktop::start() else { return };
    // Without glass, no traced light falls outside of a rectangle.
    let program = open(&desktop, "cornell");
    program.pause_raw();
    program.point_at(330, 300);
    // Until the first messages are gone.
    std::thread::sleep(Duration::from_secs(8));
    let bare = steady(&program);
    program.key("j");
    // The table is in the upper left corner, paths are all over the picture.
    until("the table", || (differing(&bare, &program.pixels(), [10, 50, 300, 60]) > 300).then_some(()));
    let told = program.pixels();
    assert!(differing(&bare, &told, [200, 150, 250, 180]) > 50, "paths are drawn");
    program.key("Escape");
    until("the picture again", || (program.pixels() == bare).then_some(()));
    // A rectangle is drawn, stays outlined, and only in it anything changes.
    program.key("b");
    program.drag(1, (230, 200), (96, 64));
    program.point_at(600, 20);
    program.key("p");
    std::thread::sleep(Duration::from_secs(2));
    program.key("p");
    let brushed = steady(&program);
    assert!(brushed != bare);
    let outside = [[4, 160, 200, 150], [400, 40, 230, 280]];
    assert_eq!(outside.map(|part| differing(&bare, &brushed, part)), [0, 0], "what is outside waits");
    program.key("shift+b");
    until("the outline to go", || (differing(&brushed, &program.pixels(), [200, 180, 160, 110]) > 100).then_some(()));
    program.key("ctrl+q");
    assert!(program.ended().success());
}

#[test]
fn views_are_kept_under_numbers_and_come_back_with_the_scene() {
    let Some(desktop) = Desktop::start() else { return };
    let program = open(&desktop, "cornell");
    let home = camera(&program);
    program.hold("Right", 300);
    let there = camera_when(&program, "the eye to orbit", |now| now.eye != home.eye);
    program.key("ctrl+4");
    // A view counts when it was looked through for a moment.
    std::thread::sleep(Duration::from_secs(1));
    program.key("Home");
    camera_when(&program, "home", |now| *now == home);
    program.key("BackSpace");
    camera_when(&program, "the view before", |now| *now == there);
    program.key("shift+BackSpace");
    camera_when(&program, "forth again", |now| *now == home);
    program.key("shift+4");
    camera_when(&program, "the kept view", |now| *now == there);
    program.key("ctrl+q");
    assert!(program.ended().success());
    // The next run knows it.
    let program = open(&desktop, "cornell");
    assert_eq!(camera(&program), home);
    program.key("shift+4");
    camera_when(&program, "the view of the run before", |now| *now == there);
    // A turntable goes around by itself.
    program.key("u");
    std::thread::sleep(Duration::from_millis(700));
    program.key("u");
    let turned = camera_when(&program, "it to stop", |now| now.eye != there.eye);
    assert!((target(&turned) - target(&there)).length() < 1e-4, "{turned:?}");
    program.key("ctrl+q");
    assert!(program.ended().success());
}

/// The dialog is a program of the desktop: here one that answers at once.
#[test]
fn a_file_is_chosen_in_the_dialog_of_the_desktop() {
    use std::os::unix::fs::PermissionsExt as _;
    let Some(desktop) = Desktop::start() else { return };
    let folder = desktop.folder();
    let dialog = folder.join("zenity");
    std::fs::write(&dialog, format!("#!/bin/sh\necho \"$@\" > '{0}/asked'\necho '{0}/tent.obj'\n", folder.display()))
        .expect("a file");
    std::fs::set_permissions(&dialog, std::fs::Permissions::from_mode(0o755)).expect("its mode");
    std::fs::write(folder.join("tent.obj"), "v 0 0 0\nv 1 0 0\nv 0 0 -1\nv 0 1 0\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")
        .expect("a file");
    let path = format!("{}:{}", folder.display(), std::env::var("PATH").unwrap_or_default());
    let program = desktop.open(&["cornell", "--size", "320x240"], &[("PATH", &path)]);
    until("a picture", || (program.title() == "firstlight — cornell").then_some(()));
    std::thread::sleep(Duration::from_millis(500));
    program.key("ctrl+o");
    until("the model to open", || (program.title() == "firstlight — tent.obj").then_some(()));
    let asked = std::fs::read_to_string(folder.join("asked")).expect("it was asked");
    assert!(asked.contains("--file-selection") && asked.contains("*.obj"), "{asked}");
    program.key("ctrl+q");
    assert!(program.ended().success());
}
