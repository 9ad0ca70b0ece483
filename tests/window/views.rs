//! The view of the real window, as it prints it.
#![cfg(all(feature = "viewer", target_os = "linux"))]

use crate::desktop::{Program, until};
use firstlight::scene::file::{CameraPart, SceneFile};
use std::time::Duration;

/// The view as the program prints it on V.
pub fn camera(program: &Program) -> CameraPart {
    let before = program.output().matches("camera:").count();
    program.key("v");
    let text = until("the camera to be printed", || {
        let output = program.output();
        let complete = output.matches("camera:").count() > before && output.ends_with("),\n");
        complete.then(|| output[output.rfind("camera:").expect("just counted")..].to_owned())
    });
    SceneFile::parse(&format!("({text})"), "printed").unwrap_or_else(|error| panic!("{error}\n{text}")).camera
}

/// What it looks at.
pub fn target(camera: &CameraPart) -> glam::DVec3 {
    camera.look_at.expect("V prints what the camera looks at")
}

/// Asks for the view until it is as it should be and has come to rest: a movement waits for the image of the one before
/// it, so the end of a drag may take effect some frames later.
pub fn camera_when(program: &Program, what: &str, is_right: impl Fn(&CameraPart) -> bool) -> CameraPart {
    until(what, || {
        let now = camera(program);
        std::thread::sleep(Duration::from_millis(400));
        (is_right(&now) && camera(program) == now).then_some(now)
    })
}
