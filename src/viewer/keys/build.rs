//! How the lines of the table are written.

use crate::frame::navigation::Side;
use crate::frame::{Command, Edit, NewThing};
use crate::render::Inspection;
use crate::viewer::keys::binding::{Action, Chord, Item, Menu, Motion, Trigger, Typed};
use winit::keyboard::{KeyCode, NamedKey};

/// A line: its effect, and its triggers.
macro_rules! row {
    ($effect:literal, $($trigger:expr),+ $(,)?) => {
        $crate::viewer::keys::binding::Binding { triggers: &[$($trigger),+], effect: $effect }
    };
}
pub(super) use row;

pub const fn hold(key: KeyCode, motion: Motion) -> Trigger {
    Trigger::Hold(key, motion)
}

pub const fn text(key: &'static str, action: Action) -> Trigger {
    Trigger::Press(Chord { key: Typed::Text(key), ctrl: false, alt: false, shift: None }, action)
}

pub const fn named(key: NamedKey, action: Action) -> Trigger {
    Trigger::Press(Chord { key: Typed::Named(key), ctrl: false, alt: false, shift: None }, action)
}

pub const fn shifted(key: Typed, shift: bool, action: Action) -> Trigger {
    Trigger::Press(Chord { key, ctrl: false, alt: false, shift: Some(shift) }, action)
}

pub const fn alt(key: &'static str, action: Action) -> Trigger {
    Trigger::Press(Chord { key: Typed::Text(key), ctrl: false, alt: true, shift: Some(false) }, action)
}

/// - `name`: of the key, for display.
pub const fn pad(key: KeyCode, name: &'static str, action: Action) -> Trigger {
    Trigger::Press(Chord { key: Typed::Pad(key, name), ctrl: false, alt: false, shift: None }, action)
}

/// - `name`: of the key, for display.
pub const fn ctrl_pad(key: KeyCode, name: &'static str, action: Action) -> Trigger {
    Trigger::Press(Chord { key: Typed::Pad(key, name), ctrl: true, alt: false, shift: None }, action)
}

pub const fn side(side: Side) -> Action {
    Action::Send(Command::ViewFrom(side))
}

pub const fn ctrl(key: &'static str, action: Action) -> Trigger {
    Trigger::Press(Chord { key: Typed::Text(key), ctrl: true, alt: false, shift: None }, action)
}

pub const fn ctrl_shifted(key: &'static str, shift: bool, action: Action) -> Trigger {
    Trigger::Press(Chord { key: Typed::Text(key), ctrl: true, alt: false, shift: Some(shift) }, action)
}

pub const fn edit(key: &'static str, shift: Option<bool>, edit: Edit) -> Trigger {
    Trigger::Press(Chord { key: Typed::Text(key), ctrl: true, alt: false, shift }, Action::Send(Command::Edit(edit)))
}

pub const fn inspect(key: &'static str, inspection: Inspection) -> Trigger {
    Trigger::Press(
        Chord { key: Typed::Text(key), ctrl: false, alt: false, shift: Some(false) },
        Action::Inspect(inspection),
    )
}

pub const fn send(key: &'static str, command: Command) -> Trigger {
    text(key, Action::Send(command))
}

pub const fn item(name: &'static str, menus: &'static [Menu], action: Action) -> Trigger {
    Trigger::Item(Item { name, menus, action })
}

pub const fn send_item(name: &'static str, menus: &'static [Menu], command: Command) -> Trigger {
    item(name, menus, Action::Send(command))
}

pub const fn edit_item(name: &'static str, menus: &'static [Menu], edit: Edit) -> Trigger {
    send_item(name, menus, Command::Edit(edit))
}

pub const fn inspect_item(name: &'static str, inspection: Inspection) -> Trigger {
    item(name, &[Menu::Inspect], Action::Inspect(inspection))
}

pub const fn add_item(name: &'static str, thing: NewThing) -> Trigger {
    edit_item(name, &[Menu::Add], Edit::Add(thing))
}

/// A section of the panel, and the name of its line in the list of keys.
pub const fn section(name: &'static str, title: &'static str) -> Trigger {
    item(name, &[], Action::Section(title))
}

pub const UNDO: Action = Action::Send(Command::Edit(Edit::Undo));
pub const REDO: Action = Action::Send(Command::Edit(Edit::Redo));
