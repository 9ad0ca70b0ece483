//! The table of keys and gestures.

use crate::frame::{Command, Edit};
use crate::render::Inspection;
use crate::viewer::keys::binding::{Action, Binding, Chord, KeyGroup, Motion, Trigger, Typed};
use winit::keyboard::{KeyCode, NamedKey};

const fn hold(key: KeyCode, motion: Motion) -> Trigger {
    Trigger::Hold(key, motion)
}

pub(super) const fn text(key: &'static str, action: Action) -> Trigger {
    Trigger::Press(Chord { key: Typed::Text(key), ctrl: false, shift: None }, action)
}

pub(super) const fn named(key: NamedKey, action: Action) -> Trigger {
    Trigger::Press(Chord { key: Typed::Named(key), ctrl: false, shift: None }, action)
}

pub(super) const fn shifted(key: Typed, shift: bool, action: Action) -> Trigger {
    Trigger::Press(Chord { key, ctrl: false, shift: Some(shift) }, action)
}

const fn ctrl(key: &'static str, action: Action) -> Trigger {
    Trigger::Press(Chord { key: Typed::Text(key), ctrl: true, shift: None }, action)
}

const fn ctrl_shifted(key: &'static str, shift: bool, action: Action) -> Trigger {
    Trigger::Press(Chord { key: Typed::Text(key), ctrl: true, shift: Some(shift) }, action)
}

pub(super) const fn edit(key: &'static str, shift: Option<bool>, edit: Edit) -> Trigger {
    Trigger::Press(Chord { key: Typed::Text(key), ctrl: true, shift }, Action::Send(Command::Edit(edit)))
}

const fn inspect(key: &'static str, inspection: Inspection) -> Trigger {
    Trigger::Press(Chord { key: Typed::Text(key), ctrl: false, shift: Some(false) }, Action::Inspect(inspection))
}

pub(super) const fn send(key: &'static str, command: Command) -> Trigger {
    text(key, Action::Send(command))
}

/// Factor per press of a focus or aperture key.
const LENS_STEP: f64 = 1.05;
/// Factor per press of a dolly or zoom key.
const ZOOM_STEP: f64 = 1.1;
/// Exposure steps in thirds of a stop, as in photography.
const EXPOSURE_STEP: f32 = 1.0 / 3.0;

const NEARER: Command = Command::ScaleFocus { factor: 1.0 / LENS_STEP };
const FARTHER: Command = Command::ScaleFocus { factor: LENS_STEP };
const NARROWER: Command = Command::ScaleAperture { factor: 1.0 / LENS_STEP };
pub(super) const WIDER: Command = Command::ScaleAperture { factor: LENS_STEP };
const DOLLY_IN: Command = Command::Dolly { factor: 1.0 / ZOOM_STEP };
const DOLLY_OUT: Command = Command::Dolly { factor: ZOOM_STEP };
const ZOOM_IN: Command = Command::Zoom { factor: 1.0 / ZOOM_STEP };
const ZOOM_OUT: Command = Command::Zoom { factor: ZOOM_STEP };

pub static BINDINGS: &[KeyGroup] = &[
    KeyGroup {
        title: "Fly",
        bindings: &[
            Binding {
                triggers: &[
                    hold(KeyCode::KeyW, Motion::Forward),
                    hold(KeyCode::KeyA, Motion::Left),
                    hold(KeyCode::KeyS, Motion::Back),
                    hold(KeyCode::KeyD, Motion::Right),
                ],
                effect: "fly forward, left, back, right",
            },
            Binding {
                triggers: &[hold(KeyCode::KeyE, Motion::Up), hold(KeyCode::KeyQ, Motion::Down)],
                effect: "fly up, down",
            },
            Binding { triggers: &[Trigger::Mouse("Shift")], effect: "fly four times as fast, while held" },
            Binding { triggers: &[Trigger::Mouse("Wheel")], effect: "change the flying speed" },
            Binding { triggers: &[Trigger::Mouse("Drag")], effect: "look around" },
            Binding {
                triggers: &[named(NamedKey::Space, Action::ToggleDrag)],
                effect: "switch the drag between look around and orbit",
            },
            Binding {
                triggers: &[named(NamedKey::Enter, Action::CaptureMouse)],
                effect: "capture the mouse to look around without a button; Enter or Esc releases it",
            },
        ],
    },
    KeyGroup {
        title: "Orbit",
        bindings: &[
            Binding {
                triggers: &[
                    hold(KeyCode::ArrowLeft, Motion::OrbitLeft),
                    hold(KeyCode::ArrowRight, Motion::OrbitRight),
                    hold(KeyCode::ArrowUp, Motion::OrbitUp),
                    hold(KeyCode::ArrowDown, Motion::OrbitDown),
                ],
                effect: "orbit around the pivot",
            },
            Binding {
                triggers: &[Trigger::Mouse("Middle drag"), Trigger::Mouse("Alt+drag"), Trigger::Mouse("Ctrl+drag")],
                effect: "orbit around the pivot",
            },
            Binding {
                triggers: &[Trigger::Mouse("Right drag"), Trigger::Mouse("Shift+arrows")],
                effect: "pan: move sideways, up, down",
            },
            Binding {
                triggers: &[
                    send("+", DOLLY_IN),
                    send("=", DOLLY_IN),
                    send("-", DOLLY_OUT),
                    Trigger::Mouse("Ctrl+wheel"),
                ],
                effect: "move nearer to, farther from the pivot",
            },
        ],
    },
    KeyGroup {
        title: "View",
        bindings: &[
            Binding {
                triggers: &[
                    ctrl("=", Action::Send(ZOOM_IN)),
                    ctrl("+", Action::Send(ZOOM_IN)),
                    ctrl("-", Action::Send(ZOOM_OUT)),
                    Trigger::Mouse("Shift+wheel"),
                ],
                effect: "zoom: narrower, wider field of view",
            },
            Binding {
                triggers: &[hold(KeyCode::KeyZ, Motion::RollLeft), hold(KeyCode::KeyC, Motion::RollRight)],
                effect: "roll the camera left, right",
            },
            Binding { triggers: &[send("x", Command::Level)], effect: "level the horizon" },
            Binding {
                triggers: &[send("t", Command::ToggleTurntable)],
                effect: "switch between turntable (level horizon) and free rotation",
            },
            Binding {
                triggers: &[named(NamedKey::Home, Action::Send(Command::Home))],
                effect: "go to the initial view of the scene",
            },
            Binding {
                triggers: &[send("f", Command::FrameAll)],
                effect: "frame the selection, or the whole scene, and focus on it",
            },
            Binding {
                triggers: &[
                    shifted(Typed::Named(NamedKey::Backspace), false, Action::Send(Command::PreviousView)),
                    shifted(Typed::Named(NamedKey::Backspace), true, Action::Send(Command::NextView)),
                ],
                effect: "go to the previous view, and forward again",
            },
            Binding {
                triggers: &[
                    shifted(Typed::Named(NamedKey::F3), false, Action::Send(Command::NextCamera)),
                    shifted(Typed::Named(NamedKey::F3), true, Action::Send(Command::PreviousCamera)),
                ],
                effect: "look through the next camera of the scene, the previous one",
            },
            Binding {
                triggers: &[Trigger::Digit {
                    ctrl: true,
                    shift: false,
                    action: |slot| Action::Send(Command::SetBookmark { slot }),
                }],
                effect: "save the view as bookmark 1 to 9",
            },
            Binding {
                triggers: &[Trigger::Digit {
                    ctrl: false,
                    shift: true,
                    action: |slot| Action::Send(Command::GoToBookmark { slot }),
                }],
                effect: "go to the view saved as bookmark 1 to 9",
            },
            Binding {
                triggers: &[text("u", Action::ToggleSpin)],
                effect: "turntable: start or stop orbiting the pivot",
            },
            Binding {
                triggers: &[text("v", Action::PrintView)],
                effect: "print the view as the camera of a scene file",
            },
        ],
    },
    KeyGroup {
        title: "Lens",
        bindings: &[
            Binding {
                triggers: &[send("[", NEARER), send("]", FARTHER)],
                effect: "move the focal plane nearer, farther",
            },
            Binding {
                triggers: &[send("{", NARROWER), send("}", WIDER), send(",", NARROWER), send(".", WIDER)],
                effect: "narrow, widen the aperture",
            },
            Binding { triggers: &[send("o", Command::ToggleDepthOfField)], effect: "switch depth of field on, off" },
            Binding {
                triggers: &[Trigger::Mouse("Shift+click"), Trigger::Mouse("Shift+drag")],
                effect: "focus on what is under the mouse",
            },
            Binding { triggers: &[Trigger::Mouse("Double click")], effect: "focus on it, and move the pivot there" },
            Binding {
                triggers: &[shifted(Typed::Text("l"), false, Action::Send(Command::ToggleFocusLock))],
                effect: "focus follows the point focused on last, or keeps its distance",
            },
            Binding {
                triggers: &[shifted(Typed::Text("l"), true, Action::FocusFollows)],
                effect: "focus follows the mouse, or keeps its distance",
            },
            Binding {
                triggers: &[text("y", Action::ToggleSharpZone)],
                effect: "show what is sharp to within one pixel, and the focal plane",
            },
        ],
    },
    KeyGroup {
        title: "Select and edit",
        bindings: &[
            Binding { triggers: &[Trigger::Mouse("Click")], effect: "select what is under the mouse" },
            Binding { triggers: &[Trigger::Mouse("Ctrl+click")], effect: "add to, remove from the selection" },
            Binding { triggers: &[edit("a", None, Edit::SelectAll)], effect: "select everything" },
            Binding { triggers: &[text("g", Action::NextGizmo)], effect: "next handles: move, rotate, scale, none" },
            Binding {
                triggers: &[Trigger::Mouse("Ctrl, dragging a handle")],
                effect: "move in steps: 15 degrees, a tenth of the size",
            },
            Binding { triggers: &[edit("d", None, Edit::Duplicate)], effect: "duplicate the selection" },
            Binding {
                triggers: &[named(NamedKey::Delete, Action::Send(Command::Edit(Edit::Delete)))],
                effect: "delete the selection",
            },
            Binding {
                triggers: &[edit("k", Some(false), Edit::SetKeys { camera: false })],
                effect: "set keys at the shown time: of what was changed, else of the selection, else of the camera",
            },
            Binding {
                triggers: &[edit("k", Some(true), Edit::SetKeys { camera: true })],
                effect: "set a key of the camera at the shown time",
            },
            Binding { triggers: &[edit("z", Some(false), Edit::Undo)], effect: "undo" },
            Binding { triggers: &[edit("z", Some(true), Edit::Redo), edit("y", None, Edit::Redo)], effect: "redo" },
        ],
    },
    KeyGroup {
        title: "Inspect",
        bindings: &[
            Binding { triggers: &[inspect("1", Inspection::Normals)], effect: "show normals" },
            Binding { triggers: &[inspect("2", Inspection::Depth)], effect: "show depth" },
            Binding { triggers: &[inspect("3", Inspection::Albedo)], effect: "show albedo: colour without light" },
            Binding { triggers: &[inspect("4", Inspection::Error)], effect: "show the relative error of each pixel" },
            Binding { triggers: &[inspect("5", Inspection::Samples)], effect: "show the samples per pixel" },
            Binding { triggers: &[inspect("6", Inspection::TreeSteps)], effect: "show kd-tree nodes visited per ray" },
            Binding {
                triggers: &[inspect("7", Inspection::TriangleTests)],
                effect: "show triangle tests per ray, in blocks",
            },
            Binding { triggers: &[inspect("8", Inspection::Bounces)], effect: "show bounces per path" },
            Binding {
                triggers: &[inspect("9", Inspection::Luminance)],
                effect: "show luminance in false colour, in stops",
            },
            Binding { triggers: &[inspect("0", Inspection::Picture)], effect: "show the image" },
            Binding {
                triggers: &[named(NamedKey::F2, Action::Send(Command::NextDenoising))],
                effect: "show the image denoised, raw on the left and denoised on the right, raw",
            },
            Binding {
                triggers: &[text("j", Action::Explain)],
                effect: "explain the pixel under the mouse: its paths, and what each light contributes",
            },
        ],
    },
    KeyGroup {
        title: "Image",
        bindings: &[
            Binding {
                triggers: &[
                    named(NamedKey::PageUp, Action::Send(Command::AdjustExposure { stops: EXPOSURE_STEP })),
                    named(NamedKey::PageDown, Action::Send(Command::AdjustExposure { stops: -EXPOSURE_STEP })),
                ],
                effect: "increase, decrease the exposure by a third of a stop",
            },
            Binding { triggers: &[send("m", Command::NextToneCurve)], effect: "next tone curve" },
            Binding {
                triggers: &[text("i", Action::ToggleIntegrator)],
                effect: "switch between path tracing and Phong",
            },
            Binding { triggers: &[text("p", Action::TogglePause)], effect: "pause, resume" },
            Binding {
                triggers: &[shifted(Typed::Text("b"), false, Action::Brush), Trigger::Mouse("then drag")],
                effect: "region: render only a rectangle",
            },
            Binding {
                triggers: &[shifted(Typed::Text("b"), true, Action::ClearRegion)],
                effect: "no region: render the whole image again",
            },
            Binding { triggers: &[send("r", Command::Restart)], effect: "restart: discard all samples" },
            Binding {
                triggers: &[
                    shifted(Typed::Named(NamedKey::F12), false, Action::Screenshot { linear: false }),
                    shifted(Typed::Text("k"), false, Action::Screenshot { linear: false }),
                ],
                effect: "save a screenshot as a new PNG file",
            },
            Binding {
                triggers: &[
                    shifted(Typed::Named(NamedKey::F12), true, Action::Screenshot { linear: true }),
                    shifted(Typed::Text("k"), true, Action::Screenshot { linear: true }),
                ],
                effect: "save linear light (HDR) as a new EXR file",
            },
            Binding {
                triggers: &[ctrl_shifted("s", false, Action::SaveScene { new: false })],
                effect: "save the scene",
            },
            Binding {
                triggers: &[ctrl_shifted("s", true, Action::SaveScene { new: true })],
                effect: "save the scene as a new scene file",
            },
            Binding {
                triggers: &[ctrl("o", Action::OpenDialog)],
                effect: "open a file by dialog (needs zenity or kdialog)",
            },
            Binding {
                triggers: &[Trigger::Mouse("Drop a file")],
                effect: "open a scene (.ron, .pbrt), a model (.obj, .ply, .stl, .glb, .gltf) or a saved image (.png, .exr)",
            },
        ],
    },
    KeyGroup {
        title: "Window",
        bindings: &[
            Binding {
                triggers: &[text("h", Action::ToggleHelp), named(NamedKey::F1, Action::ToggleHelp)],
                effect: "show or hide this list of keys; / searches it",
            },
            Binding {
                triggers: &[text("n", Action::TogglePanel)],
                effect: "show or hide the panel: all settings and statistics",
            },
            Binding {
                triggers: &[named(NamedKey::Tab, Action::ToggleOverlays)],
                effect: "hide or show everything but the image",
            },
            Binding { triggers: &[named(NamedKey::F11, Action::ToggleFullscreen)], effect: "full screen on, off" },
            Binding {
                triggers: &[named(NamedKey::Escape, Action::Leave)],
                effect: "close this list, close the explanation, deselect; twice: quit",
            },
            Binding { triggers: &[ctrl("q", Action::Quit)], effect: "quit" },
        ],
    },
    KeyGroup {
        title: "In the panel",
        bindings: &[
            Binding {
                triggers: &[Trigger::Mouse("Panel: Render")],
                effect: "integrator, when to stop (error, time, samples), threads, size of saved images",
            },
            Binding {
                triggers: &[Trigger::Mouse("Panel: Animation")],
                effect: "time: play, pause, choose; set, find and delete keys; shutter, duration, frames per second",
            },
            Binding {
                triggers: &[Trigger::Mouse("Panel: Camera")],
                effect: "position, target, field of view, fly speed, drag, navigation preset (Blender, Maya)",
            },
            Binding {
                triggers: &[Trigger::Mouse("Panel: Views")],
                effect: "frame, home, level, previous and next view, turntable, bookmarks",
            },
            Binding {
                triggers: &[Trigger::Mouse("Panel: Lens")],
                effect: "focus distance and what it follows, f-number, blades of the aperture",
            },
            Binding {
                triggers: &[Trigger::Mouse("Panel: Display")],
                effect: "exposure, tone curve, noise and what denoises, inspection view",
            },
            Binding {
                triggers: &[Trigger::Mouse("Panel: Add")],
                effect: "a sphere, a plane, a cube, a light, a built-in mesh or a model (glTF, OBJ, PLY, STL)",
            },
            Binding {
                triggers: &[Trigger::Mouse("Panel: Selected")],
                effect: "name, position, rotation, scale, material, texture and light of the selection, as numbers",
            },
            Binding {
                triggers: &[Trigger::Mouse("Panel: Mesh")],
                effect: "smooth or flat shading, simplify, and the resulting deviation",
            },
            Binding {
                triggers: &[Trigger::Mouse("Panel: Objects")],
                effect: "all objects and lights: find by name, select",
            },
            Binding {
                triggers: &[Trigger::Mouse("Panel: Materials")],
                effect: "all materials: edit for all objects that share one, select, assign",
            },
            Binding {
                triggers: &[Trigger::Mouse("Panel: Lights")],
                effect: "all lights: colour and strength, select, add; strength of the environment",
            },
            Binding {
                triggers: &[Trigger::Mouse("Panel: Environment")],
                effect: "colours of the sky, or strength and rotation of the environment image",
            },
            Binding { triggers: &[Trigger::Mouse("Panel: Open")], effect: "open a file by dialog, or a recent file" },
            Binding {
                triggers: &[Trigger::Mouse("Panel: Statistics")],
                effect: "samples, rays, error, discarded samples, latency, triangles, memory, undo, last restart",
            },
            Binding {
                triggers: &[Trigger::Mouse("Panel: Messages")],
                effect: "warnings, errors and notes, the latest first",
            },
        ],
    },
    KeyGroup {
        title: "Command line",
        bindings: &[
            Binding {
                triggers: &[Trigger::Mouse("render SCENE -o frame.png --turntable 120")],
                effect: "render numbered frames of a turntable, for a video",
            },
            Binding {
                triggers: &[Trigger::Mouse("render … --bookmarks 1,2,3 --frames 120")],
                effect: "render numbered frames of a camera path through bookmarks",
            },
            Binding {
                triggers: &[Trigger::Mouse("render … --film FILE.exr"), Trigger::Mouse("--resume")],
                effect: "save the render state and resume it later",
            },
            Binding {
                triggers: &[Trigger::Mouse("--record FILE"), Trigger::Mouse("--replay FILE")],
                effect: "record a session, and render it again",
            },
        ],
    },
];
