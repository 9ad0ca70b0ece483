//! The table of keys, gestures and commands: the menus, the list of commands, the list of keys and `docs/keys.md` are
//! made from it.

mod edit;
mod image;
mod view;
mod window;

use crate::viewer::keys::binding::KeyGroup;

pub static BINDINGS: &[KeyGroup] = &[
    view::FLY,
    view::ORBIT,
    view::VIEW,
    view::LENS,
    edit::EDIT,
    image::INSPECT,
    image::IMAGE,
    image::FILES,
    window::WINDOW,
    window::PANEL,
    window::COMMAND_LINE,
];
