//! Keys and commands of the image: what is shown, rendering, files.

use crate::frame::Command;
use crate::render::Inspection;
use crate::viewer::keys::binding::{Action, Binding, KeyGroup, Menu, Trigger, Typed};
use crate::viewer::keys::build::{
    ctrl, ctrl_shifted, inspect, inspect_item, item, named, send, send_item, shifted, text,
};
use winit::keyboard::NamedKey;

/// Exposure steps in thirds of a stop, as in photography.
const EXPOSURE_STEP: f32 = 1.0 / 3.0;

pub const INSPECT: KeyGroup = KeyGroup {
    title: "Inspect",
    bindings: &[
        Binding {
            triggers: &[inspect("1", Inspection::Normals), inspect_item("Normals", Inspection::Normals)],
            effect: "show normals",
        },
        Binding {
            triggers: &[inspect("2", Inspection::Depth), inspect_item("Depth", Inspection::Depth)],
            effect: "show depth",
        },
        Binding {
            triggers: &[inspect("3", Inspection::Albedo), inspect_item("Albedo", Inspection::Albedo)],
            effect: "show albedo: colour without light",
        },
        Binding {
            triggers: &[inspect("4", Inspection::Error), inspect_item("Error", Inspection::Error)],
            effect: "show the relative error of each pixel",
        },
        Binding {
            triggers: &[inspect("5", Inspection::Samples), inspect_item("Samples", Inspection::Samples)],
            effect: "show the samples per pixel",
        },
        Binding {
            triggers: &[inspect("6", Inspection::TreeSteps), inspect_item("Kd-tree nodes", Inspection::TreeSteps)],
            effect: "show kd-tree nodes visited per ray",
        },
        Binding {
            triggers: &[
                inspect("7", Inspection::TriangleTests),
                inspect_item("Triangle tests", Inspection::TriangleTests),
            ],
            effect: "show triangle tests per ray, in blocks",
        },
        Binding {
            triggers: &[inspect("8", Inspection::Bounces), inspect_item("Bounces", Inspection::Bounces)],
            effect: "show bounces per path",
        },
        Binding {
            triggers: &[inspect("9", Inspection::Luminance), inspect_item("Luminance", Inspection::Luminance)],
            effect: "show luminance in false colour, in stops",
        },
        Binding {
            triggers: &[inspect("0", Inspection::Picture), inspect_item("The image itself", Inspection::Picture)],
            effect: "show the image",
        },
        Binding {
            triggers: &[
                named(NamedKey::F2, Action::Send(Command::NextDenoising)),
                send_item("Denoised, raw, or both", &[Menu::Image], Command::NextDenoising),
            ],
            effect: "show the image denoised, raw on the left and denoised on the right, raw",
        },
        Binding {
            triggers: &[text("j", Action::Explain), item("Explain here", &[Menu::Here], Action::Explain)],
            effect: "explain the pixel under the mouse: its paths, and what each light contributes",
        },
    ],
};

pub const IMAGE: KeyGroup = KeyGroup {
    title: "Image",
    bindings: &[
        Binding {
            triggers: &[
                named(NamedKey::PageUp, Action::Send(Command::AdjustExposure { stops: EXPOSURE_STEP })),
                named(NamedKey::PageDown, Action::Send(Command::AdjustExposure { stops: -EXPOSURE_STEP })),
                send_item("Brighter", &[Menu::Image], Command::AdjustExposure { stops: EXPOSURE_STEP }),
                send_item("Darker", &[Menu::Image], Command::AdjustExposure { stops: -EXPOSURE_STEP }),
            ],
            effect: "increase, decrease the exposure by a third of a stop",
        },
        Binding {
            triggers: &[
                send("m", Command::NextToneCurve),
                send_item("Next tone curve", &[Menu::Image], Command::NextToneCurve),
            ],
            effect: "next tone curve",
        },
        Binding {
            triggers: &[
                text("i", Action::ToggleIntegrator),
                item("Path tracing or Phong", &[Menu::Image], Action::ToggleIntegrator),
            ],
            effect: "switch between path tracing and Phong",
        },
        Binding {
            triggers: &[text("p", Action::TogglePause), item("Pause or resume", &[Menu::Image], Action::TogglePause)],
            effect: "pause, resume",
        },
        Binding {
            triggers: &[
                shifted(Typed::Text("b"), false, Action::Brush),
                Trigger::Mouse("then drag"),
                item("Render a region …", &[Menu::Image], Action::Brush),
            ],
            effect: "region: render only a rectangle",
        },
        Binding {
            triggers: &[
                shifted(Typed::Text("b"), true, Action::ClearRegion),
                item("Render the whole image", &[Menu::Image], Action::ClearRegion),
            ],
            effect: "no region: render the whole image again",
        },
        Binding {
            triggers: &[send("r", Command::Restart), send_item("Restart", &[Menu::Image], Command::Restart)],
            effect: "restart: discard all samples",
        },
    ],
};

pub const FILES: KeyGroup = KeyGroup {
    title: "Files",
    bindings: &[
        Binding {
            triggers: &[ctrl("o", Action::OpenDialog), item("Open …", &[Menu::File], Action::OpenDialog)],
            effect: "choose a file to open",
        },
        Binding {
            triggers: &[Trigger::Mouse("Drop a file")],
            effect: "open a scene (.ron, .pbrt, .xml), a model (.obj, .ply, .stl, .glb, .gltf) or a saved image (.png, .exr)",
        },
        Binding {
            triggers: &[
                ctrl_shifted("s", false, Action::SaveScene { new: false }),
                item("Save the scene", &[Menu::File], Action::SaveScene { new: false }),
            ],
            effect: "save the scene",
        },
        Binding {
            triggers: &[
                ctrl_shifted("s", true, Action::SaveScene { new: true }),
                item("Save as a new scene", &[Menu::File], Action::SaveScene { new: true }),
            ],
            effect: "save the scene as a new scene file",
        },
        Binding {
            triggers: &[
                shifted(Typed::Named(NamedKey::F12), false, Action::Screenshot { linear: false }),
                shifted(Typed::Text("k"), false, Action::Screenshot { linear: false }),
                item("Screenshot", &[Menu::File], Action::Screenshot { linear: false }),
            ],
            effect: "screenshot: save the image as it is now as a new PNG file",
        },
        Binding {
            triggers: &[
                shifted(Typed::Named(NamedKey::F12), true, Action::Screenshot { linear: true }),
                shifted(Typed::Text("k"), true, Action::Screenshot { linear: true }),
                item("Screenshot, linear (EXR)", &[Menu::File], Action::Screenshot { linear: true }),
            ],
            effect: "save linear light (HDR) as it is now as a new EXR file",
        },
        Binding {
            triggers: &[
                ctrl("e", Action::RenderTo { frames: false }),
                item("Save image …", &[Menu::File], Action::RenderTo { frames: false }),
            ],
            effect: "render the image in any size and quality in the background, and save it",
        },
        Binding {
            triggers: &[item("Render frames …", &[Menu::File], Action::RenderTo { frames: true })],
            effect: "render the frames of the animation to a folder in the background",
        },
    ],
};
