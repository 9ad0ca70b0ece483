//! Keys and commands of selecting and editing.

use crate::frame::{Command, Edit, NewThing, gizmo};
use crate::viewer::keys::binding::{Action, Binding, KeyGroup, Menu, Trigger};
use crate::viewer::keys::build::{REDO, UNDO, add_item, edit, edit_item, item, named, text};
use winit::keyboard::NamedKey;

const HANDLES: &[Menu] = &[Menu::Edit, Menu::Here];

pub const EDIT: KeyGroup = KeyGroup {
    title: "Select and edit",
    bindings: &[
        Binding { triggers: &[Trigger::Mouse("Click")], effect: "select what is under the mouse" },
        Binding {
            triggers: &[Trigger::Mouse("Right click")],
            effect: "select what is under the mouse, and show what can be done with it",
        },
        Binding { triggers: &[Trigger::Mouse("Ctrl+click")], effect: "add to, remove from the selection" },
        Binding {
            triggers: &[
                edit("a", None, Edit::SelectAll),
                edit_item("Select everything", &[Menu::Edit], Edit::SelectAll),
            ],
            effect: "select everything",
        },
        Binding {
            triggers: &[edit_item("Select nothing", &[Menu::Edit], Edit::SelectNone)],
            effect: "clear the selection",
        },
        Binding {
            triggers: &[
                text("g", Action::NextGizmo),
                item("Move", HANDLES, Action::Gizmo(Some(gizmo::Mode::Move))),
                item("Rotate", HANDLES, Action::Gizmo(Some(gizmo::Mode::Turn))),
                item("Scale", HANDLES, Action::Gizmo(Some(gizmo::Mode::Scale))),
                item("Next handles", &[], Action::NextGizmo),
            ],
            effect: "next handles: move, rotate, scale, none",
        },
        Binding {
            triggers: &[
                item("Move with the mouse", &[], Action::Grab(gizmo::Mode::Move)),
                item("Rotate with the mouse", &[], Action::Grab(gizmo::Mode::Turn)),
                item("Scale with the mouse", &[], Action::Grab(gizmo::Mode::Scale)),
            ],
            effect: "at once, without handles: X, Y, Z lock an axis, numbers can be typed; Enter keeps, Esc restores",
        },
        Binding {
            triggers: &[Trigger::Mouse("Ctrl, dragging a handle")],
            effect: "move in steps: 15 degrees, a tenth of the size",
        },
        Binding {
            triggers: &[
                edit("d", None, Edit::Duplicate),
                edit_item("Duplicate", &[Menu::Edit, Menu::Here], Edit::Duplicate),
            ],
            effect: "duplicate the selection",
        },
        Binding {
            triggers: &[
                named(NamedKey::Delete, Action::Send(Command::Edit(Edit::Delete))),
                edit_item("Delete", &[Menu::Edit, Menu::Here], Edit::Delete),
            ],
            effect: "delete the selection",
        },
        Binding {
            triggers: &[
                edit("k", Some(false), Edit::SetKeys { camera: false }),
                edit_item("Set keys", &[Menu::Edit], Edit::SetKeys { camera: false }),
            ],
            effect: "set keys at the shown time: of what was changed, else of the selection, else of the camera",
        },
        Binding {
            triggers: &[
                edit("k", Some(true), Edit::SetKeys { camera: true }),
                edit_item("Set a key of the camera", &[Menu::Edit], Edit::SetKeys { camera: true }),
            ],
            effect: "set a key of the camera at the shown time",
        },
        Binding {
            triggers: &[edit("z", Some(false), Edit::Undo), item("Undo", &[Menu::Edit, Menu::Here], UNDO)],
            effect: "undo",
        },
        Binding {
            triggers: &[
                edit("z", Some(true), Edit::Redo),
                edit("y", None, Edit::Redo),
                item("Redo", &[Menu::Edit, Menu::Here], REDO),
            ],
            effect: "redo",
        },
        Binding {
            triggers: &[
                add_item("Sphere", NewThing::Sphere),
                add_item("Cube", NewThing::Cube),
                add_item("Plane", NewThing::Plane),
                add_item("Area light", NewThing::AreaLight),
                add_item("Point light", NewThing::PointLight),
                add_item("Spot light", NewThing::SpotLight),
                add_item("Directional light", NewThing::DirectionalLight),
                item("Model …", &[Menu::Add], Action::AddDialog),
            ],
            effect: "add it to the scene and select it (menu Add)",
        },
    ],
};
