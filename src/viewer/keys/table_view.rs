//! Keys and commands that move the camera and set its lens.

use crate::frame::Command;
use crate::viewer::keys::binding::{Action, Binding, KeyGroup, Menu, Motion, Trigger, Typed};
use crate::viewer::keys::build::{ctrl, hold, item, named, send, send_item, shifted, text};
use winit::keyboard::{KeyCode, NamedKey};

/// Factor per press of a dolly or zoom key.
const ZOOM_STEP: f64 = 1.1;
/// Factor per press of a focus or aperture key.
const LENS_STEP: f64 = 1.05;
const NEARER: Command = Command::ScaleFocus { factor: 1.0 / LENS_STEP };
const FARTHER: Command = Command::ScaleFocus { factor: LENS_STEP };
const NARROWER: Command = Command::ScaleAperture { factor: 1.0 / LENS_STEP };
const WIDER: Command = Command::ScaleAperture { factor: LENS_STEP };
const DOLLY_IN: Command = Command::Dolly { factor: 1.0 / ZOOM_STEP };
const DOLLY_OUT: Command = Command::Dolly { factor: ZOOM_STEP };
const ZOOM_IN: Command = Command::Zoom { factor: 1.0 / ZOOM_STEP };
const ZOOM_OUT: Command = Command::Zoom { factor: ZOOM_STEP };

pub const FLY: KeyGroup = KeyGroup {
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
        Binding {
            triggers: &[Trigger::Mouse("Ctrl+wheel"), Trigger::Mouse("wheel while flying")],
            effect: "change the flying speed",
        },
        Binding { triggers: &[Trigger::Mouse("Drag")], effect: "look around" },
        Binding {
            triggers: &[
                named(NamedKey::Space, Action::ToggleDrag),
                item("Drag: look around or orbit", &[Menu::View], Action::ToggleDrag),
            ],
            effect: "switch the drag between look around and orbit",
        },
        Binding {
            triggers: &[
                named(NamedKey::Enter, Action::CaptureMouse),
                item("Capture the mouse", &[Menu::View], Action::CaptureMouse),
            ],
            effect: "capture the mouse to look around without a button; Enter or Esc releases it",
        },
    ],
};

pub const ORBIT: KeyGroup = KeyGroup {
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
                Trigger::Mouse("Wheel"),
                send_item("Move nearer", &[], DOLLY_IN),
                send_item("Move farther", &[], DOLLY_OUT),
            ],
            effect: "move nearer to, farther from the pivot",
        },
    ],
};

pub const VIEW: KeyGroup = KeyGroup {
    title: "View",
    bindings: &[
        Binding {
            triggers: &[
                ctrl("=", Action::Send(ZOOM_IN)),
                ctrl("+", Action::Send(ZOOM_IN)),
                ctrl("-", Action::Send(ZOOM_OUT)),
                Trigger::Mouse("Shift+wheel"),
                send_item("Zoom in", &[], ZOOM_IN),
                send_item("Zoom out", &[], ZOOM_OUT),
            ],
            effect: "zoom: narrower, wider field of view",
        },
        Binding {
            triggers: &[hold(KeyCode::KeyZ, Motion::RollLeft), hold(KeyCode::KeyC, Motion::RollRight)],
            effect: "roll the camera left, right",
        },
        Binding {
            triggers: &[send("x", Command::Level), send_item("Level the horizon", &[Menu::View], Command::Level)],
            effect: "level the horizon",
        },
        Binding {
            triggers: &[
                send("t", Command::ToggleTurntable),
                send_item("Keep the horizon or turn freely", &[Menu::View], Command::ToggleTurntable),
            ],
            effect: "switch between turntable (level horizon) and free rotation",
        },
        Binding {
            triggers: &[
                named(NamedKey::Home, Action::Send(Command::Home)),
                send_item("Initial view", &[Menu::View], Command::Home),
            ],
            effect: "go to the initial view of the scene",
        },
        Binding {
            triggers: &[send("f", Command::FrameAll), send_item("Frame", &[Menu::View, Menu::Here], Command::FrameAll)],
            effect: "frame the selection, or the whole scene, and focus on it",
        },
        Binding {
            triggers: &[
                shifted(Typed::Named(NamedKey::Backspace), false, Action::Send(Command::PreviousView)),
                shifted(Typed::Named(NamedKey::Backspace), true, Action::Send(Command::NextView)),
                send_item("Previous view", &[Menu::View], Command::PreviousView),
                send_item("Next view", &[Menu::View], Command::NextView),
            ],
            effect: "go to the previous view, and forward again",
        },
        Binding {
            triggers: &[
                shifted(Typed::Named(NamedKey::F3), false, Action::Send(Command::NextCamera)),
                shifted(Typed::Named(NamedKey::F3), true, Action::Send(Command::PreviousCamera)),
                send_item("Next camera of the scene", &[Menu::View], Command::NextCamera),
                send_item("Previous camera of the scene", &[], Command::PreviousCamera),
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
            triggers: &[text("u", Action::ToggleSpin), item("Turntable", &[Menu::View], Action::ToggleSpin)],
            effect: "turntable: start or stop orbiting the pivot",
        },
        Binding {
            triggers: &[text("v", Action::PrintView), item("Print the camera", &[Menu::View], Action::PrintView)],
            effect: "print the view as the camera of a scene file",
        },
    ],
};

pub const LENS: KeyGroup = KeyGroup {
    title: "Lens",
    bindings: &[
        Binding {
            triggers: &[
                send("[", NEARER),
                send("]", FARTHER),
                send_item("Focus nearer", &[Menu::Lens], NEARER),
                send_item("Focus farther", &[Menu::Lens], FARTHER),
            ],
            effect: "move the focal plane nearer, farther",
        },
        Binding {
            triggers: &[
                send("{", NARROWER),
                send("}", WIDER),
                send(",", NARROWER),
                send(".", WIDER),
                send_item("Widen the aperture", &[Menu::Lens], WIDER),
                send_item("Narrow the aperture", &[Menu::Lens], NARROWER),
            ],
            effect: "narrow, widen the aperture",
        },
        Binding {
            triggers: &[
                send("o", Command::ToggleDepthOfField),
                send_item("Depth of field", &[Menu::Lens], Command::ToggleDepthOfField),
            ],
            effect: "switch depth of field on, off",
        },
        Binding {
            triggers: &[Trigger::Mouse("Shift+click"), Trigger::Mouse("Shift+drag")],
            effect: "focus on what is under the mouse",
        },
        Binding {
            triggers: &[Trigger::Mouse("Double click"), item("Focus here", &[Menu::Here], Action::FocusHere)],
            effect: "focus on it, and move the pivot there",
        },
        Binding {
            triggers: &[
                shifted(Typed::Text("l"), false, Action::Send(Command::ToggleFocusLock)),
                send_item("Focus stays on its point", &[Menu::Lens], Command::ToggleFocusLock),
            ],
            effect: "focus follows the point focused on last, or keeps its distance",
        },
        Binding {
            triggers: &[
                shifted(Typed::Text("l"), true, Action::FocusFollows),
                item("Focus follows the mouse", &[Menu::Lens], Action::FocusFollows),
            ],
            effect: "focus follows the mouse, or keeps its distance",
        },
        Binding {
            triggers: &[
                text("y", Action::ToggleSharpZone),
                item("Show what is sharp", &[Menu::Lens], Action::ToggleSharpZone),
            ],
            effect: "show what is sharp to within one pixel, and the focal plane",
        },
    ],
};
