//! Keys and commands of the image: what is shown, rendering, files.

use crate::frame::Command;
use crate::render::Inspection;
use crate::viewer::keys::binding::{Action, KeyGroup, Menu, Trigger, Typed};
use crate::viewer::keys::build::{
    ctrl, ctrl_shifted, inspect, inspect_item, item, named, row, send, send_item, shifted, text,
};
use winit::keyboard::NamedKey;

/// Exposure steps in thirds of a stop, as in photography.
const EXPOSURE_STEP: f32 = 1.0 / 3.0;

/// A line with the key and the menu item of an inspection.
macro_rules! inspection {
    ($effect:literal, $key:literal, $name:literal, $kind:ident) => {
        row!($effect, inspect($key, Inspection::$kind), inspect_item($name, Inspection::$kind))
    };
}

pub const INSPECT: KeyGroup = KeyGroup {
    title: "Inspect",
    bindings: &[
        inspection!("show normals", "1", "Normals", Normals),
        inspection!("show depth", "2", "Depth", Depth),
        inspection!("show albedo: colour without light", "3", "Albedo", Albedo),
        inspection!("show the relative error of each pixel", "4", "Error", Error),
        inspection!("show the samples per pixel", "5", "Samples", Samples),
        inspection!("show kd-tree nodes visited per ray", "6", "Kd-tree nodes", TreeSteps),
        inspection!("show triangle tests per ray, in blocks", "7", "Triangle tests", TriangleTests),
        inspection!("show bounces per path", "8", "Bounces", Bounces),
        inspection!("show luminance in false colour, in stops", "9", "Luminance", Luminance),
        inspection!("show the image", "0", "The image itself", Picture),
        row!(
            "show the image denoised, raw on the left and denoised on the right, raw",
            named(NamedKey::F2, Action::Send(Command::NextDenoising)),
            send_item("Denoised, raw, or both", &[Menu::Image], Command::NextDenoising)
        ),
        row!(
            "explain the pixel under the mouse: its paths, and what each light contributes",
            text("j", Action::Explain),
            item("Explain here", &[Menu::Here], Action::Explain)
        ),
    ],
};

pub const IMAGE: KeyGroup = KeyGroup {
    title: "Image",
    bindings: &[
        row!(
            "increase, decrease the exposure by a third of a stop",
            named(NamedKey::PageUp, Action::Send(Command::AdjustExposure { stops: EXPOSURE_STEP })),
            named(NamedKey::PageDown, Action::Send(Command::AdjustExposure { stops: -EXPOSURE_STEP })),
            send_item("Brighter", &[Menu::Image], Command::AdjustExposure { stops: EXPOSURE_STEP }),
            send_item("Darker", &[Menu::Image], Command::AdjustExposure { stops: -EXPOSURE_STEP })
        ),
        row!(
            "set the exposure by the brightness of the image, so that half of it is darker than a medium grey",
            item("Set the exposure automatically", &[Menu::Image], Action::AutoExposure)
        ),
        row!(
            "next tone curve",
            send("m", Command::NextToneCurve),
            send_item("Next tone curve", &[Menu::Image], Command::NextToneCurve)
        ),
        row!(
            "switch between path tracing and Phong",
            text("i", Action::ToggleIntegrator),
            item("Path tracing or Phong", &[Menu::Image], Action::ToggleIntegrator)
        ),
        row!(
            "pause, resume",
            text("p", Action::TogglePause),
            item("Pause or resume", &[Menu::Image], Action::TogglePause)
        ),
        row!(
            "region: render only a rectangle",
            shifted(Typed::Text("b"), false, Action::Brush),
            Trigger::Mouse("then drag"),
            item("Render a region …", &[Menu::Image], Action::Brush)
        ),
        row!(
            "no region: render the whole image again",
            shifted(Typed::Text("b"), true, Action::ClearRegion),
            item("Render the whole image", &[Menu::Image], Action::ClearRegion)
        ),
        row!(
            "restart: discard all samples",
            send("r", Command::Restart),
            send_item("Restart", &[Menu::Image], Command::Restart)
        ),
    ],
};

pub const FILES: KeyGroup = KeyGroup {
    title: "Files",
    bindings: &[
        row!("an empty scene", ctrl("n", Action::NewScene), item("New", &[Menu::File], Action::NewScene)),
        row!("choose a file to open", ctrl("o", Action::OpenDialog), item("Open …", &[Menu::File], Action::OpenDialog)),
        row!(
            "open a scene (.ron, .pbrt, .xml, .json), a model (.obj, .ply, .stl, .glb, .gltf, .vrm) or a saved image (.png, .exr)",
            Trigger::Mouse("Drop a file")
        ),
        row!(
            "choose an image that lights the scene from all around (.hdr, .exr, .png, .jpg)",
            item("Environment image …", &[], Action::EnvironmentDialog)
        ),
        row!(
            "save the scene",
            ctrl_shifted("s", false, Action::SaveScene { new: false }),
            item("Save the scene", &[Menu::File], Action::SaveScene { new: false })
        ),
        row!(
            "save the scene under a name of your choice",
            ctrl_shifted("s", true, Action::SaveScene { new: true }),
            item("Save the scene as …", &[Menu::File], Action::SaveScene { new: true })
        ),
        row!(
            "screenshot: save the image as it is now as a new PNG file",
            shifted(Typed::Named(NamedKey::F12), false, Action::Screenshot { linear: false }),
            shifted(Typed::Text("k"), false, Action::Screenshot { linear: false }),
            item("Screenshot", &[Menu::File], Action::Screenshot { linear: false })
        ),
        row!(
            "save linear light (HDR) as it is now as a new EXR file",
            shifted(Typed::Named(NamedKey::F12), true, Action::Screenshot { linear: true }),
            shifted(Typed::Text("k"), true, Action::Screenshot { linear: true }),
            item("Screenshot, linear (EXR)", &[Menu::File], Action::Screenshot { linear: true })
        ),
        row!(
            "copy the image as it is now to the clipboard",
            ctrl("c", Action::CopyImage),
            item("Copy the image", &[Menu::File], Action::CopyImage)
        ),
        row!(
            "render the image in any size and quality in the background, and save it",
            ctrl("e", Action::RenderTo { frames: false }),
            item("Save image …", &[Menu::File], Action::RenderTo { frames: false })
        ),
        row!(
            "render the frames of the animation to a folder in the background",
            item("Render frames …", &[Menu::File], Action::RenderTo { frames: true })
        ),
        row!(
            "open the folder of the image, the frames or the scene that was saved last",
            item("Show what was saved", &[], Action::ShowSaved)
        ),
    ],
};
