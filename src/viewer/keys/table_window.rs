//! Keys and commands of the window, the sections of its panel, and related options of the command line.

use crate::viewer::keys::binding::{Action, Binding, KeyGroup, Menu, Trigger};
use crate::viewer::keys::build::{ctrl, item, named, section, text};
use winit::keyboard::NamedKey;

pub const WINDOW: KeyGroup = KeyGroup {
    title: "Window",
    bindings: &[
        Binding {
            triggers: &[
                text("h", Action::ToggleHelp),
                named(NamedKey::F1, Action::ToggleHelp),
                item("Help", &[Menu::Window], Action::ToggleHelp),
            ],
            effect: "show or hide this list of keys; / searches it",
        },
        Binding {
            triggers: &[text("/", Action::Palette), item("Find a command …", &[Menu::Window], Action::Palette)],
            effect: "find a command by its name or what it is about, and run it",
        },
        Binding {
            triggers: &[text("n", Action::TogglePanel), item("Panel", &[Menu::Window], Action::TogglePanel)],
            effect: "show or hide the panel: all settings and statistics",
        },
        Binding {
            triggers: &[
                named(NamedKey::Tab, Action::ToggleOverlays),
                item("Nothing but the image", &[Menu::Window], Action::ToggleOverlays),
            ],
            effect: "hide or show everything but the image",
        },
        Binding {
            triggers: &[
                named(NamedKey::F11, Action::ToggleFullscreen),
                item("Full screen", &[Menu::Window], Action::ToggleFullscreen),
            ],
            effect: "full screen on, off",
        },
        Binding {
            triggers: &[named(NamedKey::Escape, Action::Leave)],
            effect: "close this list, close the explanation, deselect; twice: quit",
        },
        Binding { triggers: &[ctrl("q", Action::Quit), item("Quit", &[Menu::Window], Action::Quit)], effect: "quit" },
    ],
};

pub const PANEL: KeyGroup = KeyGroup {
    title: "In the panel",
    bindings: &[
        Binding {
            triggers: &[section("Panel: Render", "Render")],
            effect: "integrator, when to stop (error, time, samples), threads, saving",
        },
        Binding {
            triggers: &[section("Panel: Animation", "Animation")],
            effect: "time: play, pause, choose; set, find and delete keys; shutter, duration, frames per second",
        },
        Binding {
            triggers: &[section("Panel: Camera", "Camera")],
            effect: "position, target, field of view, fly speed, drag, navigation preset (Blender, Maya)",
        },
        Binding {
            triggers: &[section("Panel: Views", "Views")],
            effect: "frame, home, level, previous and next view, turntable, bookmarks",
        },
        Binding {
            triggers: &[section("Panel: Lens", "Lens")],
            effect: "focus distance and what it follows, f-number, blades of the aperture",
        },
        Binding {
            triggers: &[section("Panel: Display", "Display")],
            effect: "exposure, tone curve, noise and what denoises, inspection view",
        },
        Binding {
            triggers: &[section("Panel: Add", "Add")],
            effect: "a sphere, a plane, a cube, a light, a built-in mesh or a model (glTF, OBJ, PLY, STL)",
        },
        Binding {
            triggers: &[
                section("Panel: Selected", "Selected"),
                item("Properties …", &[Menu::Here], Action::Section("Selected")),
            ],
            effect: "name, position, rotation, scale, material, texture and light of the selection, as numbers",
        },
        Binding {
            triggers: &[section("Panel: Mesh", "Mesh")],
            effect: "smooth or flat shading, simplify, and the resulting deviation",
        },
        Binding {
            triggers: &[section("Panel: Objects", "Objects")],
            effect: "all objects and lights: find by name, select",
        },
        Binding {
            triggers: &[section("Panel: Materials", "Materials")],
            effect: "all materials: edit for all objects that share one, select, assign",
        },
        Binding {
            triggers: &[section("Panel: Lights", "Lights")],
            effect: "all lights: colour and strength, select, add; strength of the environment",
        },
        Binding {
            triggers: &[section("Panel: Environment", "Environment")],
            effect: "colours of the sky, or strength and rotation of the environment image",
        },
        Binding { triggers: &[section("Panel: Open", "Open")], effect: "open a file by dialog, or a recent file" },
        Binding {
            triggers: &[section("Panel: Statistics", "Statistics")],
            effect: "samples, rays, error, discarded samples, latency, triangles, memory, undo, last restart",
        },
        Binding {
            triggers: &[section("Panel: Messages", "Messages")],
            effect: "warnings, errors and notes, the latest first",
        },
    ],
};

pub const COMMAND_LINE: KeyGroup = KeyGroup {
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
};
