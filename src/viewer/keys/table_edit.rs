//! Keys and commands of selecting and editing.

use crate::frame::{Command, Edit, NewThing, gizmo};
use crate::viewer::keys::binding::{Action, KeyGroup, Menu, PlayEnd, Trigger};
use crate::viewer::keys::build::{REDO, UNDO, add_item, alt, edit, edit_item, item, named, row, text};
use winit::keyboard::NamedKey;

const HANDLES: &[Menu] = &[Menu::Edit, Menu::Here];

pub const EDIT: KeyGroup = KeyGroup {
    title: "Select and edit",
    bindings: &[
        row!("select what is under the mouse", Trigger::Mouse("Click")),
        row!("select what is under the mouse, and show what can be done with it", Trigger::Mouse("Right click")),
        row!("add to, remove from the selection", Trigger::Mouse("Ctrl+click")),
        row!(
            "select everything",
            edit("a", None, Edit::SelectAll),
            edit_item("Select everything", &[Menu::Edit], Edit::SelectAll)
        ),
        row!("clear the selection", edit_item("Select nothing", &[Menu::Edit], Edit::SelectNone)),
        row!(
            "next handles: move, rotate, scale, none",
            text("g", Action::NextGizmo),
            item("Move", HANDLES, Action::Gizmo(Some(gizmo::Mode::Move))),
            item("Rotate", HANDLES, Action::Gizmo(Some(gizmo::Mode::Turn))),
            item("Scale", HANDLES, Action::Gizmo(Some(gizmo::Mode::Scale))),
            item("Next handles", &[], Action::NextGizmo)
        ),
        row!(
            "at once, without handles: X, Y, Z lock an axis, numbers can be typed; Enter keeps, Esc restores",
            item("Move with the mouse", &[], Action::Grab(gizmo::Mode::Move)),
            item("Rotate with the mouse", &[], Action::Grab(gizmo::Mode::Turn)),
            item("Scale with the mouse", &[], Action::Grab(gizmo::Mode::Scale))
        ),
        row!("with the handles to move: move the selected object in the plane of the image", Trigger::Mouse("Drag it")),
        row!("move in steps: 15 degrees, a tenth of the size", Trigger::Mouse("Ctrl, dragging a handle")),
        row!(
            "duplicate the selection",
            edit("d", None, Edit::Duplicate),
            edit("v", None, Edit::Duplicate),
            edit_item("Duplicate", &[Menu::Edit, Menu::Here], Edit::Duplicate)
        ),
        row!(
            "delete the selection",
            named(NamedKey::Delete, Action::Send(Command::Edit(Edit::Delete))),
            edit_item("Delete", &[Menu::Edit, Menu::Here], Edit::Delete)
        ),
        row!(
            "hide the selection: it is not seen and gives no light; the list of objects shows it again",
            edit("h", Some(false), Edit::Hide { others: false }),
            edit_item("Hide", &[Menu::Edit, Menu::Here], Edit::Hide { others: false })
        ),
        row!(
            "hide everything but the selection",
            alt("h", Action::Send(Command::Edit(Edit::Hide { others: true }))),
            edit_item("Hide all others", &[Menu::Edit], Edit::Hide { others: true })
        ),
        row!(
            "show all that is hidden",
            edit("h", Some(true), Edit::ShowAll),
            edit_item("Show all that is hidden", &[Menu::Edit], Edit::ShowAll)
        ),
        row!(
            "put the selection on what is below its middle: a table, or the floor",
            edit_item("Drop onto what is below", &[Menu::Edit, Menu::Here], Edit::StandOnGround)
        ),
        row!(
            "turn the selection upright, if its up is Z, and put it on what is below",
            edit_item("Turn upright", &[Menu::Edit], Edit::TurnUpright)
        ),
        row!(
            "set keys at the shown time: of what was changed, else of the selection, else of the camera",
            edit("k", Some(false), Edit::SetKeys { camera: false }),
            edit_item("Set keys", &[Menu::Edit], Edit::SetKeys { camera: false })
        ),
        row!(
            "set a key of the camera at the shown time",
            edit("k", Some(true), Edit::SetKeys { camera: true }),
            edit_item("Set a key of the camera", &[Menu::Edit], Edit::SetKeys { camera: true })
        ),
        row!(
            "play the animation, pause it; what plays, and is rendered, begins and ends at the shown frame",
            item("Play or pause the animation", &[Menu::View], Action::TogglePlay),
            item("Play from this frame on", &[], Action::PlayRange(PlayEnd::First)),
            item("Play up to this frame", &[], Action::PlayRange(PlayEnd::Last)),
            item("Play all frames", &[], Action::PlayAll)
        ),
        row!("undo", edit("z", Some(false), Edit::Undo), item("Undo", &[Menu::Edit, Menu::Here], UNDO)),
        row!(
            "redo",
            edit("z", Some(true), Edit::Redo),
            edit("y", None, Edit::Redo),
            item("Redo", &[Menu::Edit, Menu::Here], REDO)
        ),
        row!(
            "add it to the scene and select it (menu Add)",
            add_item("Sphere", NewThing::Sphere),
            add_item("Cube", NewThing::Cube),
            add_item("Ground plane", NewThing::Plane),
            add_item("Area light", NewThing::AreaLight),
            add_item("Point light", NewThing::PointLight),
            add_item("Spot light", NewThing::SpotLight),
            add_item("Directional light", NewThing::DirectionalLight),
            item("Model …", &[Menu::Add], Action::AddDialog(None))
        ),
    ],
};
