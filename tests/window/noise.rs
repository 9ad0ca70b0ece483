//! The noise of the image in a real window: denoised at first, then as it was left.
#![cfg(all(feature = "viewer", target_os = "linux"))]

use crate::desktop::{Desktop, Program, until};
use crate::window::has_content;
use std::time::Duration;

/// Mean difference of neighbours in the middle of the window, where the back wall is.
fn roughness(program: &Program) -> f64 {
    let wall = image::imageops::crop_imm(&program.pixels(), 270, 90, 100, 60).to_image();
    let pairs = wall.enumerate_pixels().filter(|(x, _, _)| *x > 0);
    let apart = |(x, y, pixel): (u32, u32, &image::Rgb<u8>)| {
        let left = wall.get_pixel(x - 1, y);
        pixel.0.iter().zip(left.0).map(|(a, b)| f64::from(a.abs_diff(b))).sum::<f64>()
    };
    pairs.map(apart).sum::<f64>() / f64::from(3 * 99 * 60)
}

#[test]
fn a_window_begins_denoised_and_the_next_one_as_it_was_left() {
    let Some(desktop) = Desktop::start() else { return };
    let open = || {
        let program = desktop.open(&["cornell", "--size", "640x360"], &[]);
        until("the box to be seen", || has_content(&program.pixels()).then_some(()));
        // Few samples per pixel, so that there is noise.
        program.key("p");
        program
    };
    let leave = |program: Program| {
        program.key("ctrl+q");
        assert!(program.ended().success());
    };
    let program = open();
    program.key("F2 F2");
    let raw = until("noise", || Some(roughness(&program)).filter(|raw| *raw > 1.0));
    program.key("F2");
    until("a denoised image", || (roughness(&program) < 0.5 * raw).then_some(()));
    leave(program);
    let program = open();
    until("a denoised image in the next window", || (roughness(&program) < 0.5 * raw).then_some(()));
    program.key("F2 F2");
    until("noise", || (roughness(&program) > 1.0).then_some(()));
    leave(program);
    let program = open();
    until("noise in the last window", || (roughness(&program) > 1.0).then_some(()));
    // Time enough for a denoised image, if there were to be one.
    std::thread::sleep(Duration::from_secs(3));
    assert!(roughness(&program) > 1.0, "the noise stays");
    leave(program);
}
