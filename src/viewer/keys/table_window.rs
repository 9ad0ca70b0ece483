//! Keys and commands of the window, the sections of its panel, and related options of the command line.

use crate::viewer::keys::binding::{Action, KeyGroup, Menu, Trigger};
use crate::viewer::keys::build::{ctrl, item, named, row, section, text};
use winit::keyboard::NamedKey;

pub const WINDOW: KeyGroup = KeyGroup {
    title: "Window",
    bindings: &[
        row!(
            "show or hide this list of keys; / searches it",
            text("h", Action::ToggleHelp),
            named(NamedKey::F1, Action::ToggleHelp),
            item("Help", &[Menu::Window], Action::ToggleHelp)
        ),
        row!(
            "find a command by its name or what it is about, and run it",
            text("/", Action::Palette),
            item("Find a command …", &[Menu::Window], Action::Palette)
        ),
        row!(
            "show or hide the panel: all settings and statistics",
            text("n", Action::TogglePanel),
            item("Panel", &[Menu::Window], Action::TogglePanel)
        ),
        row!(
            "hide or show everything but the image",
            named(NamedKey::Tab, Action::ToggleOverlays),
            item("Nothing but the image", &[Menu::Window], Action::ToggleOverlays)
        ),
        row!(
            "full screen on, off",
            named(NamedKey::F11, Action::ToggleFullscreen),
            item("Full screen", &[Menu::Window], Action::ToggleFullscreen)
        ),
        row!("close this list, close the explanation, deselect", named(NamedKey::Escape, Action::Leave)),
        row!("quit", ctrl("q", Action::Quit), item("Quit", &[Menu::Window], Action::Quit)),
    ],
};

pub const PANEL: KeyGroup = KeyGroup {
    title: "In the panel",
    bindings: &[
        row!("integrator, when to stop (error, time, samples), threads, saving", section("Panel: Render", "Render")),
        row!(
            "time: play, pause, choose; set, find and delete keys; shutter, duration, frames per second",
            section("Panel: Animation", "Animation")
        ),
        row!(
            "position, target, perspective or orthographic, field of view, fly speed, drag, navigation preset (Blender, Maya)",
            section("Panel: Camera", "Camera")
        ),
        row!("frame, home, level, previous and next view, turntable, bookmarks", section("Panel: Views", "Views")),
        row!("focus distance and what it follows, f-number, blades of the aperture", section("Panel: Lens", "Lens")),
        row!("exposure, tone curve, noise and what denoises, inspection view", section("Panel: Display", "Display")),
        row!(
            "a sphere, a plane, a cube, a light, a built-in mesh or a model (glTF, OBJ, PLY, STL)",
            section("Panel: Add", "Add")
        ),
        row!(
            "name, position, rotation, scale, material, texture and light of the selection, as numbers",
            section("Panel: Selected", "Selected"),
            item("Properties …", &[Menu::Here], Action::Section("Selected"))
        ),
        row!("smooth or flat shading, simplify, and the resulting deviation", section("Panel: Mesh", "Mesh")),
        row!("all objects and lights: find by name, select", section("Panel: Objects", "Objects")),
        row!(
            "all materials: edit for all objects that share one, select, assign",
            section("Panel: Materials", "Materials")
        ),
        row!(
            "all lights: colour and strength, select, add; strength of the environment",
            section("Panel: Lights", "Lights")
        ),
        row!(
            "colours of the sky, a clear sky with the sun, or strength and rotation of the environment image",
            section("Panel: Environment", "Environment")
        ),
        row!("open a file by dialog, or a recent file", section("Panel: Open", "Open")),
        row!(
            "samples, rays, error, discarded samples, latency, triangles, memory, undo, last restart",
            section("Panel: Statistics", "Statistics")
        ),
        row!("warnings, errors and notes, the latest first", section("Panel: Messages", "Messages")),
    ],
};

pub const COMMAND_LINE: KeyGroup = KeyGroup {
    title: "Command line",
    bindings: &[
        row!(
            "render numbered frames of a turntable, for a video",
            Trigger::Mouse("render SCENE -o frame.png --turntable 120")
        ),
        row!(
            "render numbered frames of a camera path through bookmarks",
            Trigger::Mouse("render … --bookmarks 1,2,3 --frames 120")
        ),
        row!(
            "save the render state and resume it later",
            Trigger::Mouse("render … --film FILE.exr"),
            Trigger::Mouse("--resume")
        ),
        row!("record a session, and render it again", Trigger::Mouse("--record FILE"), Trigger::Mouse("--replay FILE")),
    ],
};
