//! Keys and commands that move the camera and set its lens.

use crate::frame::Command;
use crate::frame::navigation::Side;
use crate::viewer::keys::binding::{Action, KeyGroup, Menu, Motion, Trigger, Typed};
use crate::viewer::keys::build::{ctrl, hold, item, named, row, send, send_item, shifted, side, text};
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
        row!(
            "fly forward, left, back, right",
            hold(KeyCode::KeyW, Motion::Forward),
            hold(KeyCode::KeyA, Motion::Left),
            hold(KeyCode::KeyS, Motion::Back),
            hold(KeyCode::KeyD, Motion::Right)
        ),
        row!("fly up, down", hold(KeyCode::KeyE, Motion::Up), hold(KeyCode::KeyQ, Motion::Down)),
        row!("fly four times as fast, while held", Trigger::Mouse("Shift")),
        row!("change the flying speed", Trigger::Mouse("Ctrl+wheel"), Trigger::Mouse("wheel while flying")),
        row!("orbit; look around where the camera begins in a room", Trigger::Mouse("Drag")),
        row!(
            "play or pause what moves; where nothing does, switch the drag between look around and orbit",
            named(NamedKey::Space, Action::PlayOrDrag),
            item("Drag: look around or orbit", &[Menu::View], Action::ToggleDrag)
        ),
        row!(
            "capture the mouse to look around without a button; Enter or Esc releases it",
            named(NamedKey::Enter, Action::CaptureMouse),
            item("Capture the mouse", &[Menu::View], Action::CaptureMouse)
        ),
    ],
};

pub const ORBIT: KeyGroup = KeyGroup {
    title: "Orbit",
    bindings: &[
        row!(
            "orbit around the pivot",
            hold(KeyCode::ArrowLeft, Motion::OrbitLeft),
            hold(KeyCode::ArrowRight, Motion::OrbitRight),
            hold(KeyCode::ArrowUp, Motion::OrbitUp),
            hold(KeyCode::ArrowDown, Motion::OrbitDown)
        ),
        row!(
            "orbit around the pivot",
            Trigger::Mouse("Middle drag"),
            Trigger::Mouse("Alt+drag"),
            Trigger::Mouse("Ctrl+drag")
        ),
        row!("pan: move sideways, up, down", Trigger::Mouse("Right drag"), Trigger::Mouse("Shift+arrows")),
        row!(
            "move nearer to, farther from the pivot",
            send("+", DOLLY_IN),
            send("=", DOLLY_IN),
            send("-", DOLLY_OUT),
            Trigger::Mouse("Wheel"),
            send_item("Move nearer", &[], DOLLY_IN),
            send_item("Move farther", &[], DOLLY_OUT)
        ),
    ],
};

pub const VIEW: KeyGroup = KeyGroup {
    title: "View",
    bindings: &[
        row!(
            "zoom: narrower, wider field of view",
            ctrl("=", Action::Send(ZOOM_IN)),
            ctrl("+", Action::Send(ZOOM_IN)),
            ctrl("-", Action::Send(ZOOM_OUT)),
            Trigger::Mouse("Shift+wheel"),
            send_item("Zoom in", &[], ZOOM_IN),
            send_item("Zoom out", &[], ZOOM_OUT)
        ),
        row!(
            "roll the camera left, right",
            hold(KeyCode::KeyZ, Motion::RollLeft),
            hold(KeyCode::KeyC, Motion::RollRight)
        ),
        row!(
            "level the horizon",
            send("x", Command::Level),
            send_item("Level the horizon", &[Menu::View], Command::Level)
        ),
        row!(
            "switch between turntable (level horizon) and free rotation",
            send("t", Command::ToggleTurntable),
            send_item("Keep the horizon or turn freely", &[Menu::View], Command::ToggleTurntable)
        ),
        row!(
            "go to the initial view of the scene",
            named(NamedKey::Home, Action::Send(Command::Home)),
            send_item("Initial view", &[Menu::View], Command::Home)
        ),
        row!(
            "look at the pivot from a side, with parallel rays until one turns: a model faces its front",
            item("View from the front", &[Menu::View], side(Side::Front)),
            item("View from the right", &[Menu::View], side(Side::Right)),
            item("View from above", &[Menu::View], side(Side::Top)),
            item("View from the back", &[], side(Side::Back)),
            item("View from the left", &[], side(Side::Left)),
            item("View from below", &[], side(Side::Bottom)),
            send_item("View from the opposite side", &[Menu::View], Command::ViewFromBehind)
        ),
        row!(
            "frame the selection, or the whole scene, and focus on it",
            send("f", Command::FrameAll),
            send_item("Frame", &[Menu::View, Menu::Here], Command::FrameAll)
        ),
        row!(
            "go to the previous view, and forward again",
            shifted(Typed::Named(NamedKey::Backspace), false, Action::Send(Command::PreviousView)),
            shifted(Typed::Named(NamedKey::Backspace), true, Action::Send(Command::NextView)),
            send_item("Previous view", &[Menu::View], Command::PreviousView),
            send_item("Next view", &[Menu::View], Command::NextView)
        ),
        row!(
            "look through the next camera of the scene, the previous one",
            shifted(Typed::Named(NamedKey::F3), false, Action::Send(Command::NextCamera)),
            shifted(Typed::Named(NamedKey::F3), true, Action::Send(Command::PreviousCamera)),
            send_item("Next camera of the scene", &[Menu::View], Command::NextCamera),
            send_item("Previous camera of the scene", &[], Command::PreviousCamera)
        ),
        row!(
            "save the view as bookmark 1 to 9",
            Trigger::Digit { ctrl: true, shift: false, action: |slot| Action::Send(Command::SetBookmark { slot }) }
        ),
        row!(
            "go to the view saved as bookmark 1 to 9",
            Trigger::Digit { ctrl: false, shift: true, action: |slot| Action::Send(Command::GoToBookmark { slot }) }
        ),
        row!(
            "turntable: start or stop orbiting the pivot",
            text("u", Action::ToggleSpin),
            item("Turntable", &[Menu::View], Action::ToggleSpin)
        ),
        row!(
            "copy the view to the clipboard, as the camera of a scene file, and print it to the terminal",
            text("v", Action::CopyView),
            item("Copy the camera", &[Menu::View], Action::CopyView)
        ),
    ],
};

pub const LENS: KeyGroup = KeyGroup {
    title: "Lens",
    bindings: &[
        row!(
            "move the focal plane nearer, farther",
            send("[", NEARER),
            send("]", FARTHER),
            send_item("Focus nearer", &[Menu::Lens], NEARER),
            send_item("Focus farther", &[Menu::Lens], FARTHER)
        ),
        row!(
            "make the aperture smaller, larger",
            send("{", NARROWER),
            send("}", WIDER),
            send(",", NARROWER),
            send(".", WIDER),
            send_item("Larger aperture", &[Menu::Lens], WIDER),
            send_item("Smaller aperture", &[Menu::Lens], NARROWER)
        ),
        row!(
            "switch depth of field on, off",
            send("o", Command::ToggleDepthOfField),
            send_item("Depth of field", &[Menu::Lens], Command::ToggleDepthOfField)
        ),
        row!("focus on what is under the mouse", Trigger::Mouse("Shift+click"), Trigger::Mouse("Shift+drag")),
        row!(
            "focus on it, and move the pivot there",
            Trigger::Mouse("Double click"),
            item("Focus here", &[Menu::Here], Action::FocusHere)
        ),
        row!(
            "focus follows what is selected, else the point focused on last; or keeps its distance",
            shifted(Typed::Text("l"), false, Action::Send(Command::ToggleFocusLock)),
            send_item("Focus stays on its point", &[Menu::Lens], Command::ToggleFocusLock)
        ),
        row!(
            "focus follows the mouse, or keeps its distance",
            shifted(Typed::Text("l"), true, Action::FocusFollows),
            item("Focus follows the mouse", &[Menu::Lens], Action::FocusFollows)
        ),
        row!(
            "show what is sharp to within one pixel, and the focal plane",
            text("y", Action::ToggleSharpZone),
            item("Show what is sharp", &[Menu::Lens], Action::ToggleSharpZone)
        ),
    ],
};
