//! Keys and gestures of other programs, and the list of keys, in the real window.
#![cfg(all(feature = "viewer", target_os = "linux"))]

use crate::desktop::{Desktop, Program, until};
use std::time::Duration;

fn part(program: &Program, [x, y, w, h]: [u32; 4]) -> image::RgbImage {
    image::imageops::crop_imm(&program.pixels(), x, y, w, h).to_image()
}

/// Mean difference of bytes.
fn difference(a: &image::RgbImage, b: &image::RgbImage) -> f64 {
    let sum: u64 = a.as_raw().iter().zip(b.as_raw()).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
    sum as f64 / a.as_raw().len() as f64
}

const MIDDLE: [u32; 4] = [160, 90, 320, 180];
const MESSAGES: [u32; 4] = [0, 0, 300, 60];

/// A paused window whose picture stands still.
fn resting<'a>(desktop: &'a Desktop, scene: &str) -> Program<'a> {
    let program = desktop.open(&[scene, "--size", "640x360"], &[]);
    until("a picture to be seen", || {
        let picture = part(&program, MIDDLE);
        let first = *picture.get_pixel(0, 0);
        (picture.pixels().filter(|pixel| **pixel != first).count() > 5000).then_some(())
    });
    std::thread::sleep(Duration::from_secs(1));
    program.pause_raw();
    until("the picture to stand still", || {
        let before = program.pixels();
        std::thread::sleep(Duration::from_millis(1500));
        (before == program.pixels()).then_some(())
    });
    program
}

#[test]
fn the_letter_that_opens_the_list_of_keys_closes_it_and_can_be_searched_for() {
    let Some(desktop) = Desktop::start() else { return };
    let program = resting(&desktop, "cornell");
    let bare = part(&program, MIDDLE);
    let is_open = |what: &str| until(what, || (difference(&bare, &part(&program, MIDDLE)) > 10.0).then_some(()));
    let is_closed = |what: &str| until(what, || (difference(&bare, &part(&program, MIDDLE)) == 0.0).then_some(()));
    for _ in 0..2 {
        program.key("h");
        is_open("the list");
        program.key("h");
        is_closed("the list to go");
    }
    // Two at once, before the list has been drawn.
    program.key("h h");
    std::thread::sleep(Duration::from_millis(700));
    is_closed("nothing to be left");
    // While it is open, no key is a command: the camera, the objects and the integrator stay.
    program.key("h");
    is_open("the list again");
    program.key("d r i Delete x ctrl+z Right");
    std::thread::sleep(Duration::from_millis(700));
    is_open("the list to stay");
    program.key("h");
    is_closed("the same picture behind it");
    // In a search it is a letter like any other, also as the first one, and typed before the list has been drawn.
    program.key("h slash h d r");
    is_open("the list with a search");
    std::thread::sleep(Duration::from_millis(700));
    is_open("the list to stay");
    let found = part(&program, MIDDLE);
    program.key("BackSpace BackSpace BackSpace");
    until("more lines", || (difference(&found, &part(&program, MIDDLE)) > 1.0).then_some(()));
    program.key("Escape");
    is_closed("the list to go at last");
    // That a picture is being saved is said before it is saved, and what was saved after it.
    let quiet = part(&program, MESSAGES);
    program.key("F12");
    until("the key to be answered", || (difference(&quiet, &part(&program, MESSAGES)) > 1.0).then_some(()));
    let path = desktop.folder().join("cornell-0001.png");
    until("the picture to be saved", || path.is_file().then_some(()));
    program.key("ctrl+q");
    assert!(program.ended().success());
}

#[test]
fn a_preset_is_kept_and_its_keys_are_obeyed() {
    let Some(desktop) = Desktop::start() else { return };
    std::fs::create_dir_all(desktop.settings()).expect("a folder");
    std::fs::write(desktop.settings().join("settings.ron"), "(navigation: blender)").expect("settings");
    let program = desktop.open(&["cornell-balls", "--size", "640x360"], &[]);
    let title_is = |expected: &str| until(expected, || (program.title() == expected).then_some(()));
    title_is("firstlight — cornell-balls");
    std::thread::sleep(Duration::from_secs(2));
    // A click selects, X deletes.
    program.drag(1, (250, 250), (0, 0));
    std::thread::sleep(Duration::from_millis(500));
    program.key("x");
    title_is("firstlight — *cornell-balls");
    program.key("ctrl+z");
    title_is("firstlight — cornell-balls");
    // The wheel comes nearer.
    let before = program.output().matches("camera:").count();
    let eye = |program: &Program, n: usize| {
        program.key("v");
        until("the camera to be printed", || {
            let output = program.output();
            let is_there = output.matches("camera:").count() == n && output.ends_with("),\n");
            is_there.then(|| output[output.rfind("eye:").expect("it has one")..].lines().next().map(str::to_owned))
        })
    };
    let home = eye(&program, before + 1);
    program.point_at(320, 180);
    program.xdotool("click 4");
    std::thread::sleep(Duration::from_millis(700));
    assert_ne!(eye(&program, before + 2), home, "the wheel moves the camera");
    program.key("ctrl+q");
    assert!(program.ended().success());
    let kept = std::fs::read_to_string(desktop.settings().join("settings.ron")).expect("settings");
    assert!(kept.contains("navigation: blender") && kept.contains("cornell-balls"), "{kept}");
}
