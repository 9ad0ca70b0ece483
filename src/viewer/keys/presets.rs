//! Presets with keys and gestures of other programs. The bindings of a preset take precedence over those of the
//! [`table`](crate::viewer::keys::table) with the same key, and its first groups replace the table's [`REPLACED`] groups.

use crate::frame::navigation::Side;
use crate::frame::{Command, Edit, Navigation, gizmo};
use crate::viewer::keys::binding::{Action, Binding, KeyGroup, Trigger, Typed};
use crate::viewer::keys::build::{REDO, UNDO, alt, ctrl_pad, edit, named, pad, row, send, shifted, side, text};
use crate::viewer::keys::table::BINDINGS;
use winit::keyboard::{KeyCode, NamedKey};

/// Groups of the table that presets replace.
const REPLACED: [&str; 2] = ["Fly", "Orbit"];

/// Degrees per press.
const ORBIT_STEP: f64 = 15.0;

const fn orbit(yaw_deg: f64, pitch_deg: f64) -> Action {
    Action::Send(Command::Orbit { yaw_deg, pitch_deg })
}

const DELETE: Action = Action::Send(Command::Edit(Edit::Delete));
const HIDE: Action = Action::Send(Command::Edit(Edit::Hide { others: false }));
const HIDE_OTHERS: Action = Action::Send(Command::Edit(Edit::Hide { others: true }));

static BLENDER: &[KeyGroup] = &[
    KeyGroup {
        title: "Blender: navigate",
        bindings: &[
            row!(
                "orbit around the pivot",
                Trigger::Mouse("Middle drag"),
                Trigger::Mouse("Alt+drag"),
                Trigger::Mouse("Ctrl+drag")
            ),
            row!("pan: move sideways, up, down", Trigger::Mouse("Shift+middle drag"), Trigger::Mouse("Shift+Alt+drag")),
            row!(
                "zoom: move nearer to, farther from the pivot",
                Trigger::Mouse("Wheel"),
                Trigger::Mouse("Ctrl+middle drag"),
                Trigger::Mouse("Ctrl+Alt+drag")
            ),
            // Without Num Lock that key types Delete, which has another meaning below.
            row!(
                "frame the selection, or the whole scene",
                pad(KeyCode::NumpadDecimal, "Numpad .", Action::Send(Command::FrameAll))
            ),
            row!(
                "look from the front, the right, above, the opposite side",
                pad(KeyCode::Numpad1, "Numpad 1", side(Side::Front)),
                pad(KeyCode::Numpad3, "Numpad 3", side(Side::Right)),
                pad(KeyCode::Numpad7, "Numpad 7", side(Side::Top)),
                pad(KeyCode::Numpad9, "Numpad 9", Action::Send(Command::ViewFromBehind))
            ),
            row!(
                "look from the back, the left, below",
                ctrl_pad(KeyCode::Numpad1, "Numpad 1", side(Side::Back)),
                ctrl_pad(KeyCode::Numpad3, "Numpad 3", side(Side::Left)),
                ctrl_pad(KeyCode::Numpad7, "Numpad 7", side(Side::Bottom))
            ),
            row!(
                "orbit by 15°",
                pad(KeyCode::Numpad4, "Numpad 4", orbit(-ORBIT_STEP, 0.0)),
                pad(KeyCode::Numpad6, "Numpad 6", orbit(ORBIT_STEP, 0.0)),
                pad(KeyCode::Numpad8, "Numpad 8", orbit(0.0, ORBIT_STEP)),
                pad(KeyCode::Numpad2, "Numpad 2", orbit(0.0, -ORBIT_STEP))
            ),
            row!("go to the initial view of the scene", pad(KeyCode::Numpad0, "Numpad 0", Action::Send(Command::Home))),
            FLY,
            FLY_SPEED,
        ],
    },
    KeyGroup {
        title: "Blender: edit",
        bindings: &[
            row!(
                "move, rotate, scale the selection with the mouse",
                text("g", Action::Grab(gizmo::Mode::Move)),
                text("r", Action::Grab(gizmo::Mode::Turn)),
                text("s", Action::Grab(gizmo::Mode::Scale))
            ),
            row!(
                "lock an axis (with Shift: all but it); the amount",
                Trigger::Mouse("then X, Y, Z"),
                Trigger::Mouse("or a number")
            ),
            row!("keep, restore", Trigger::Mouse("Enter or click"), Trigger::Mouse("Esc or right click")),
            row!("delete the selection", text("x", DELETE), named(NamedKey::Delete, DELETE)),
            row!("hide the selection", shifted(Typed::Text("h"), false, HIDE)),
            row!("hide everything but the selection", shifted(Typed::Text("h"), true, HIDE_OTHERS)),
            row!("show all that is hidden", alt("h", Action::Send(Command::Edit(Edit::ShowAll)))),
            row!("show or hide this list of keys; / searches it", named(NamedKey::F1, Action::ToggleHelp)),
            row!("select everything", shifted(Typed::Text("a"), false, Action::Send(Command::Edit(Edit::SelectAll)))),
            row!("select nothing", alt("a", Action::Send(Command::Edit(Edit::SelectNone)))),
            row!("find what can be added", shifted(Typed::Text("a"), true, Action::PaletteOf("add "))),
            row!("set keys", text("i", Action::Send(Command::Edit(Edit::SetKeys { camera: false })))),
            row!(
                "duplicate the selection, and move the copy with the mouse",
                shifted(Typed::Text("d"), true, Action::GrabCopy)
            ),
            row!("duplicate the selection", edit("d", None, Edit::Duplicate)),
            ADD_TO_SELECTION,
            FOCUS,
        ],
    },
];

static MAYA: &[KeyGroup] = &[
    KeyGroup {
        title: "Maya: navigate",
        bindings: &[
            row!("orbit around the pivot", Trigger::Mouse("Alt+drag"), Trigger::Mouse("Ctrl+drag")),
            row!(
                "pan: move sideways, up, down",
                Trigger::Mouse("Alt+middle drag"),
                Trigger::Mouse("Ctrl+middle drag"),
                Trigger::Mouse("Middle drag")
            ),
            row!(
                "zoom: move nearer to, farther from the pivot",
                Trigger::Mouse("Wheel"),
                Trigger::Mouse("Alt+right drag"),
                Trigger::Mouse("Ctrl+right drag")
            ),
            FLY,
            FLY_SPEED,
        ],
    },
    KeyGroup {
        title: "Maya: edit",
        bindings: &[
            row!("handles: none", text("q", Action::Gizmo(None))),
            row!("handles: move", text("w", Action::Gizmo(Some(gizmo::Mode::Move)))),
            row!("handles: rotate", text("e", Action::Gizmo(Some(gizmo::Mode::Turn)))),
            row!("handles: scale", text("r", Action::Gizmo(Some(gizmo::Mode::Scale)))),
            row!("frame the selection, or the whole scene", send("a", Command::FrameAll)),
            row!("undo", shifted(Typed::Text("z"), false, UNDO)),
            row!("redo", shifted(Typed::Text("z"), true, REDO)),
            row!(
                "set keys",
                shifted(Typed::Text("s"), false, Action::Send(Command::Edit(Edit::SetKeys { camera: false })))
            ),
            ADD_TO_SELECTION,
            FOCUS,
        ],
    },
];

const FLY: Binding = row!(
    "look around and fly; Shift: four times as fast",
    Trigger::Mouse("Right drag"),
    Trigger::Mouse("with W A S D Q E")
);
const ADD_TO_SELECTION: Binding =
    row!("add to, remove from the selection", Trigger::Mouse("Shift+click"), Trigger::Mouse("Ctrl+click"));
const FOCUS: Binding = row!("focus on what is under the mouse", Trigger::Mouse("Shift+drag"));
const FLY_SPEED: Binding =
    row!("change the flying speed", Trigger::Mouse("Right drag + wheel"), Trigger::Mouse("Ctrl+wheel"));

/// The groups of a preset.
pub fn groups_of(navigation: Navigation) -> &'static [KeyGroup] {
    match navigation {
        Navigation::Firstlight => &[],
        Navigation::Blender => BLENDER,
        Navigation::Maya => MAYA,
    }
}

/// Every key and gesture that is active under a preset, for display.
pub fn shown(navigation: Navigation) -> Vec<(&'static str, Vec<&'static Binding>)> {
    let own = groups_of(navigation);
    let chords: Vec<_> = own.iter().flat_map(|group| group.bindings).flat_map(chords_of).collect();
    let gestures: Vec<_> = own.iter().flat_map(|group| group.bindings).flat_map(gestures_of).collect();
    let is_taken = |binding: &&Binding| {
        chords_of(binding).any(|chord| chords.iter().any(|other| chord.overlaps(other)))
            || gestures_of(binding).any(|gesture| gestures.contains(&gesture))
    };
    let rest = BINDINGS
        .iter()
        .filter(|group| own.is_empty() || !REPLACED.contains(&group.title))
        .map(|group| (group.title, group.bindings.iter().filter(|binding| !is_taken(binding)).collect()));
    own.iter().map(|group| (group.title, group.bindings.iter().collect())).chain(rest).collect()
}

fn gestures_of(binding: &Binding) -> impl Iterator<Item = &'static str> {
    binding.triggers.iter().filter_map(|trigger| match trigger {
        Trigger::Mouse(gesture) => Some(*gesture),
        _ => None,
    })
}

fn chords_of(binding: &Binding) -> impl Iterator<Item = &crate::viewer::keys::Chord> {
    binding.triggers.iter().filter_map(|trigger| match trigger {
        Trigger::Press(chord, _) => Some(chord),
        _ => None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::viewer::keys::action_of;
    use crate::viewer::keys::binding::Typed;
    use winit::keyboard::{Key, ModifiersState, PhysicalKey};

    fn pressed(navigation: Navigation, key: &str, modifiers: ModifiersState) -> Option<Action> {
        action_of(navigation, PhysicalKey::Code(KeyCode::F24), &Key::Character(key.into()), modifiers)
    }

    #[test]
    fn hints_name_the_key_of_the_preset() {
        let frame = |navigation| crate::viewer::keys::with_key(navigation, "frame", &Action::Send(Command::FrameAll));
        let [own, blender, maya] = [Navigation::Firstlight, Navigation::Blender, Navigation::Maya].map(frame);
        assert_eq!([own.as_str(), maya.as_str()], ["frame (F)", "frame (A)"]);
        assert_ne!(blender, own);
        let none = crate::viewer::keys::with_key(Navigation::Firstlight, "pause", &Action::Send(Command::Pause));
        assert_eq!(none, "pause");
    }

    #[test]
    fn a_preset_takes_the_place_of_what_the_table_has() {
        let none = ModifiersState::empty();
        let modes = |navigation, keys: &str| -> Vec<Option<Action>> {
            keys.chars().map(|key| pressed(navigation, &key.to_string(), none)).collect()
        };
        assert_eq!(modes(Navigation::Blender, "grs"), gizmo::Mode::ALL.map(|mode| Some(Action::Grab(mode))));
        let handles = gizmo::Mode::ALL.map(|mode| Some(Action::Gizmo(Some(mode))));
        assert_eq!(modes(Navigation::Maya, "wer"), handles);
        assert_eq!(pressed(Navigation::Blender, "X", ModifiersState::SHIFT), Some(DELETE));
        assert_eq!(pressed(Navigation::Firstlight, "x", none), Some(Action::Send(Command::Level)));
        assert_eq!(pressed(Navigation::Maya, "x", none), Some(Action::Send(Command::Level)));
        let edit = |edit| Some(Action::Send(Command::Edit(edit)));
        assert_eq!(pressed(Navigation::Blender, "a", none), edit(Edit::SelectAll));
        assert_eq!(pressed(Navigation::Blender, "a", ModifiersState::ALT), edit(Edit::SelectNone));
        assert_eq!(pressed(Navigation::Blender, "i", none), edit(Edit::SetKeys { camera: false }));
        assert_eq!(pressed(Navigation::Firstlight, "i", ModifiersState::ALT), None, "another key");
        // Whether the number pad types or not.
        for key in [Key::Character(".".into()), Key::Named(NamedKey::Delete)] {
            let pressed = action_of(Navigation::Blender, PhysicalKey::Code(KeyCode::NumpadDecimal), &key, none);
            assert_eq!(pressed, Some(Action::Send(Command::FrameAll)));
        }
        let views = [
            (KeyCode::Numpad1, "1", none, side(Side::Front)),
            (KeyCode::Numpad1, "1", ModifiersState::CONTROL, side(Side::Back)),
            (KeyCode::Numpad7, "7", none, side(Side::Top)),
            (KeyCode::Numpad9, "9", none, Action::Send(Command::ViewFromBehind)),
            (KeyCode::Numpad4, "4", none, orbit(-ORBIT_STEP, 0.0)),
        ];
        for (code, typed, modifiers, action) in views {
            let pressed =
                action_of(Navigation::Blender, PhysicalKey::Code(code), &Key::Character(typed.into()), modifiers);
            assert_eq!(pressed, Some(action));
        }
        // Other keys are unchanged.
        for navigation in Navigation::ALL {
            assert_eq!(pressed(navigation, "k", none), Some(Action::Screenshot { linear: false }));
            let undo = Some(Action::Send(Command::Edit(Edit::Undo)));
            assert_eq!(pressed(navigation, "z", ModifiersState::CONTROL), undo);
        }
    }

    #[test]
    fn the_list_has_each_key_of_a_preset_once() {
        for navigation in Navigation::ALL {
            let shown = shown(navigation);
            let chords: Vec<_> = shown.iter().flat_map(|(_, bindings)| bindings).flat_map(|it| chords_of(it)).collect();
            for (i, one) in chords.iter().enumerate() {
                assert!(chords[i + 1..].iter().all(|other| !one.overlaps(other)), "{navigation:?}: {one:?}");
            }
            let has = |title: &str| shown.iter().any(|(known, _)| *known == title);
            assert_eq!(has("Fly"), navigation == Navigation::Firstlight);
            assert!(has("Window") && chords.iter().any(|chord| chord.key == Typed::Text("h")));
        }
    }
}
