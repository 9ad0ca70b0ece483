//! The table of keys and gestures.

use super::{Action, Binding, Chord, KeyGroup, Motion, Trigger, Typed};
use crate::frame::{Command, Edit};
use crate::render::Inspection;
use winit::keyboard::{KeyCode, NamedKey};

const fn hold(key: KeyCode, motion: Motion) -> Trigger {
    Trigger::Hold(key, motion)
}

const fn text(key: &'static str, action: Action) -> Trigger {
    Trigger::Press(Chord { key: Typed::Text(key), ctrl: false, shift: None }, action)
}

const fn named(key: NamedKey, action: Action) -> Trigger {
    Trigger::Press(Chord { key: Typed::Named(key), ctrl: false, shift: None }, action)
}

const fn shifted(key: Typed, shift: bool, action: Action) -> Trigger {
    Trigger::Press(Chord { key, ctrl: false, shift: Some(shift) }, action)
}

const fn ctrl(key: &'static str, action: Action) -> Trigger {
    Trigger::Press(Chord { key: Typed::Text(key), ctrl: true, shift: None }, action)
}

const fn ctrl_shifted(key: &'static str, shift: bool, action: Action) -> Trigger {
    Trigger::Press(Chord { key: Typed::Text(key), ctrl: true, shift: Some(shift) }, action)
}

const fn edit(key: &'static str, shift: Option<bool>, edit: Edit) -> Trigger {
    Trigger::Press(Chord { key: Typed::Text(key), ctrl: true, shift }, Action::Send(Command::Edit(edit)))
}

const fn inspect(key: &'static str, inspection: Inspection) -> Trigger {
    Trigger::Press(Chord { key: Typed::Text(key), ctrl: false, shift: Some(false) }, Action::Inspect(inspection))
}

const fn send(key: &'static str, command: Command) -> Trigger {
    text(key, Action::Send(command))
}

/// A press of a focus or aperture key multiplies by this or divides.
const LENS_STEP: f64 = 1.05;
/// A press of a dolly or zoom key multiplies by this or divides.
const ZOOM_STEP: f64 = 1.1;
/// Photographers count exposure in thirds.
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
            Binding { triggers: &[Trigger::Mouse("Shift")], effect: "four times as fast, while held" },
            Binding { triggers: &[Trigger::Mouse("Wheel")], effect: "flying speed" },
            Binding { triggers: &[Trigger::Mouse("Drag")], effect: "look around" },
            Binding {
                triggers: &[named(NamedKey::Space, Action::ToggleDrag)],
                effect: "a drag orbits around the pivot, or looks around again",
            },
            Binding {
                triggers: &[named(NamedKey::Enter, Action::CaptureMouse)],
                effect: "capture the mouse, which then needs no button; Esc or again lets it go",
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
                triggers: &[Trigger::Mouse("Middle drag"), Trigger::Mouse("Alt+drag")],
                effect: "orbit around the pivot",
            },
            Binding {
                triggers: &[Trigger::Mouse("Right drag"), Trigger::Mouse("Shift+arrows")],
                effect: "move sideways",
            },
            Binding {
                triggers: &[
                    send("+", DOLLY_IN),
                    send("=", DOLLY_IN),
                    send("-", DOLLY_OUT),
                    Trigger::Mouse("Ctrl+wheel"),
                ],
                effect: "nearer to, farther from the pivot",
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
                effect: "narrower, wider field of view",
            },
            Binding {
                triggers: &[hold(KeyCode::KeyZ, Motion::RollLeft), hold(KeyCode::KeyC, Motion::RollRight)],
                effect: "roll (lean) left, right",
            },
            Binding { triggers: &[send("x", Command::Level)], effect: "level the horizon" },
            Binding {
                triggers: &[send("t", Command::ToggleTurntable)],
                effect: "keep the horizon while turning, or turn freely",
            },
            Binding {
                triggers: &[named(NamedKey::Home, Action::Send(Command::Home))],
                effect: "the view that the scene opened with",
            },
            Binding {
                triggers: &[send("f", Command::FrameAll)],
                effect: "frame what is selected, or the whole scene, and focus on it",
            },
            Binding {
                triggers: &[
                    shifted(Typed::Named(NamedKey::Backspace), false, Action::Send(Command::PreviousView)),
                    shifted(Typed::Named(NamedKey::Backspace), true, Action::Send(Command::NextView)),
                ],
                effect: "back to the view before, and forth again",
            },
            Binding {
                triggers: &[Trigger::Digit {
                    ctrl: true,
                    shift: false,
                    action: |slot| Action::Send(Command::SetBookmark { slot }),
                }],
                effect: "save this view under a number",
            },
            Binding {
                triggers: &[Trigger::Digit {
                    ctrl: false,
                    shift: true,
                    action: |slot| Action::Send(Command::GoToBookmark { slot }),
                }],
                effect: "go to the view that is saved under that number",
            },
            Binding { triggers: &[text("u", Action::ToggleSpin)], effect: "turntable: go around the pivot, or stop" },
            Binding { triggers: &[text("v", Action::PrintView)], effect: "print the view as a scene file's camera" },
        ],
    },
    KeyGroup {
        title: "Lens",
        bindings: &[
            Binding { triggers: &[send("[", NEARER), send("]", FARTHER)], effect: "focal plane nearer, farther" },
            Binding {
                triggers: &[send("{", NARROWER), send("}", WIDER), send(",", NARROWER), send(".", WIDER)],
                effect: "aperture narrower, wider",
            },
            Binding { triggers: &[send("o", Command::ToggleDepthOfField)], effect: "depth of field on, off" },
            Binding {
                triggers: &[Trigger::Mouse("Shift+click"), Trigger::Mouse("Shift+drag")],
                effect: "focus on what is under the mouse",
            },
            Binding { triggers: &[Trigger::Mouse("Double click")], effect: "focus there, and orbit at that depth" },
            Binding {
                triggers: &[shifted(Typed::Text("l"), false, Action::Send(Command::ToggleFocusLock))],
                effect: "focus tracks what was focused on, or keeps its distance",
            },
            Binding {
                triggers: &[shifted(Typed::Text("l"), true, Action::FocusFollows)],
                effect: "focus tracks what is under the mouse, or stays where it is",
            },
            Binding {
                triggers: &[text("y", Action::ToggleSharpZone)],
                effect: "show what is sharp to a pixel, and the focal plane",
            },
        ],
    },
    KeyGroup {
        title: "Select and edit",
        bindings: &[
            Binding { triggers: &[Trigger::Mouse("Click")], effect: "select what is under the mouse" },
            Binding { triggers: &[Trigger::Mouse("Ctrl+click")], effect: "add it to the selection, or take it out" },
            Binding { triggers: &[edit("a", None, Edit::SelectAll)], effect: "select everything" },
            Binding {
                triggers: &[text("g", Action::NextGizmo)],
                effect: "handles to move, turn (rotate) or scale what is selected, or none",
            },
            Binding {
                triggers: &[Trigger::Mouse("Ctrl, dragging a handle")],
                effect: "in steps: 15 degrees, a tenth of the size",
            },
            Binding { triggers: &[edit("d", None, Edit::Duplicate)], effect: "duplicate what is selected" },
            Binding {
                triggers: &[named(NamedKey::Delete, Action::Send(Command::Edit(Edit::Delete)))],
                effect: "delete what is selected",
            },
            Binding { triggers: &[edit("z", Some(false), Edit::Undo)], effect: "undo" },
            Binding { triggers: &[edit("z", Some(true), Edit::Redo), edit("y", None, Edit::Redo)], effect: "redo" },
        ],
    },
    KeyGroup {
        title: "See what is going on",
        bindings: &[
            Binding { triggers: &[inspect("1", Inspection::Normals)], effect: "normals" },
            Binding { triggers: &[inspect("2", Inspection::Depth)], effect: "depth" },
            Binding { triggers: &[inspect("3", Inspection::Albedo)], effect: "albedo: colour without light" },
            Binding { triggers: &[inspect("4", Inspection::Error)], effect: "relative error of each pixel" },
            Binding { triggers: &[inspect("5", Inspection::Samples)], effect: "samples of each pixel" },
            Binding { triggers: &[inspect("6", Inspection::TreeSteps)], effect: "kd-tree nodes that a ray visits" },
            Binding {
                triggers: &[inspect("7", Inspection::TriangleTests)],
                effect: "blocks of triangles that a ray is tested against",
            },
            Binding { triggers: &[inspect("8", Inspection::Bounces)], effect: "bounces of a path" },
            Binding { triggers: &[inspect("9", Inspection::Luminance)], effect: "false colour: brightness in stops" },
            Binding { triggers: &[inspect("0", Inspection::Picture)], effect: "the picture" },
            Binding {
                triggers: &[text("j", Action::Explain)],
                effect: "why the pixel under the mouse looks as it does: its paths, and what each light brings",
            },
        ],
    },
    KeyGroup {
        title: "Picture",
        bindings: &[
            Binding {
                triggers: &[
                    named(NamedKey::PageUp, Action::Send(Command::AdjustExposure { stops: EXPOSURE_STEP })),
                    named(NamedKey::PageDown, Action::Send(Command::AdjustExposure { stops: -EXPOSURE_STEP })),
                ],
                effect: "brighter, darker by a third of a stop",
            },
            Binding { triggers: &[send("m", Command::NextToneCurve)], effect: "next tone curve" },
            Binding {
                triggers: &[text("i", Action::ToggleIntegrator)],
                effect: "path tracing or the classic Phong model",
            },
            Binding { triggers: &[text("p", Action::TogglePause)], effect: "pause, resume" },
            Binding {
                triggers: &[shifted(Typed::Text("b"), false, Action::Brush), Trigger::Mouse("then drag")],
                effect: "region: give all samples to a rectangle",
            },
            Binding {
                triggers: &[shifted(Typed::Text("b"), true, Action::ClearRegion)],
                effect: "no region: give them to the whole picture again",
            },
            Binding { triggers: &[send("r", Command::Restart)], effect: "restart: drop all samples and begin again" },
            Binding {
                triggers: &[
                    shifted(Typed::Named(NamedKey::F12), false, Action::Screenshot { linear: false }),
                    shifted(Typed::Text("k"), false, Action::Screenshot { linear: false }),
                ],
                effect: "save the picture as a new PNG file (screenshot)",
            },
            Binding {
                triggers: &[
                    shifted(Typed::Named(NamedKey::F12), true, Action::Screenshot { linear: true }),
                    shifted(Typed::Text("k"), true, Action::Screenshot { linear: true }),
                ],
                effect: "save its linear light as a new EXR file",
            },
            Binding {
                triggers: &[ctrl_shifted("s", false, Action::SaveScene { new: false })],
                effect: "save the scene file, or the scene as a new one",
            },
            Binding {
                triggers: &[ctrl_shifted("s", true, Action::SaveScene { new: true })],
                effect: "save the scene as a new scene file",
            },
            Binding {
                triggers: &[ctrl("o", Action::OpenDialog)],
                effect: "ask for a file to open, where the system has a dialog (zenity or kdialog)",
            },
            Binding {
                triggers: &[Trigger::Mouse("Drop a file")],
                effect: "open a scene (.ron), a model (.obj) or a picture that was saved (.png, .exr)",
            },
        ],
    },
    KeyGroup {
        title: "Window",
        bindings: &[
            Binding {
                triggers: &[text("h", Action::ToggleHelp), named(NamedKey::F1, Action::ToggleHelp)],
                effect: "show these keys, and find one by a word",
            },
            Binding { triggers: &[text("n", Action::TogglePanel)], effect: "panel: every setting, and figures" },
            Binding {
                triggers: &[named(NamedKey::Tab, Action::ToggleOverlays)],
                effect: "hide everything but the picture",
            },
            Binding { triggers: &[named(NamedKey::F11, Action::ToggleFullscreen)], effect: "full screen" },
            Binding {
                triggers: &[named(NamedKey::Escape, Action::Leave)],
                effect: "close this list or the explanation, or select nothing, or close the window",
            },
            Binding { triggers: &[ctrl("q", Action::Quit)], effect: "quit" },
        ],
    },
    KeyGroup {
        title: "In the panel",
        bindings: &[
            Binding {
                triggers: &[Trigger::Mouse("Panel: Render")],
                effect: "light model, when to stop (error, time, samples), threads, size of pictures that are saved",
            },
            Binding {
                triggers: &[Trigger::Mouse("Panel: Camera")],
                effect: "position, what it looks at, field of view, fly speed, what a drag does",
            },
            Binding {
                triggers: &[Trigger::Mouse("Panel: Views")],
                effect: "frame, home, level, previous and next view, turntable, saved views",
            },
            Binding {
                triggers: &[Trigger::Mouse("Panel: Lens")],
                effect: "focus distance and what it tracks, f-stop, radius, blades of the aperture",
            },
            Binding {
                triggers: &[Trigger::Mouse("Panel: Display")],
                effect: "exposure, tone curve, what is shown in place of the picture",
            },
            Binding {
                triggers: &[Trigger::Mouse("Panel: Add")],
                effect: "a sphere, a plane, a cube, a light, a built-in mesh or an OBJ file",
            },
            Binding {
                triggers: &[Trigger::Mouse("Panel: Selected")],
                effect: "name, position, rotation, scale, material, texture and light of what is selected, by numbers",
            },
            Binding {
                triggers: &[Trigger::Mouse("Panel: Mesh")],
                effect: "of what is selected: smooth or flat, simplified, and what that changes",
            },
            Binding {
                triggers: &[Trigger::Mouse("Panel: Objects")],
                effect: "all objects and lights: find one by name, select it",
            },
            Binding {
                triggers: &[Trigger::Mouse("Panel: Materials")],
                effect: "all materials: edit one for all objects that share it, select or assign",
            },
            Binding {
                triggers: &[Trigger::Mouse("Panel: Lights")],
                effect: "everything that emits light: colour and strength, select, add; strength of the sky",
            },
            Binding {
                triggers: &[Trigger::Mouse("Panel: Sky")],
                effect: "colours of the surroundings, or strength and rotation of their picture",
            },
            Binding { triggers: &[Trigger::Mouse("Panel: Open")], effect: "a file by dialog, or what was open before" },
            Binding {
                triggers: &[Trigger::Mouse("Panel: Statistics")],
                effect: "samples, rays, error, samples left out, reaction, triangles, memory, undo, last restart",
            },
        ],
    },
    KeyGroup {
        title: "Without the window",
        bindings: &[
            Binding {
                triggers: &[Trigger::Mouse("render SCENE -o frame.png --turntable 120")],
                effect: "numbered pictures of a camera that goes around the pivot, for a video",
            },
            Binding {
                triggers: &[Trigger::Mouse("render … --bookmarks 1,2,3 --frames 120")],
                effect: "numbered pictures of a camera that goes through saved views",
            },
            Binding {
                triggers: &[Trigger::Mouse("render … --film FILE.exr"), Trigger::Mouse("--resume")],
                effect: "a picture that can be gone on with later",
            },
            Binding {
                triggers: &[Trigger::Mouse("--record FILE"), Trigger::Mouse("--replay FILE")],
                effect: "write down what is done in the window, and render it again",
            },
        ],
    },
];
