//! The table of keys, gestures and commands: the menus, the list of commands, the list of keys and `docs/keys.md` are
//! made from it.

use crate::viewer::keys::binding::KeyGroup;
use crate::viewer::keys::{table_edit as edit, table_image as image, table_view as view, table_window as window};

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
