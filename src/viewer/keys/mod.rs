//! Every key and mouse gesture, in one `table`.
//!
//! The window uses [`BINDINGS`] and, before it, the chosen preset. The overlay on H shows both, and `docs/keys.md` is
//! generated from them, so they cannot disagree. Movement keys are physical (WASD is the same block of keys on every
//! layout); all others are identified by the character that the key types.

mod binding;
mod build;
mod page;
mod presets;
mod table;
mod table_edit;
mod table_image;
mod table_view;
mod table_window;
mod words;

pub use binding::{Action, Binding, Chord, Item, KeyGroup, Menu, Motion, PlayEnd, Trigger, Typed};
pub use build::{REDO, UNDO};
pub use page::markdown;
pub use presets::shown;
pub use table::BINDINGS;
pub use words::finds;

use crate::frame::Navigation;
use winit::keyboard::{Key, KeyCode, ModifiersState, PhysicalKey};

fn triggers() -> impl Iterator<Item = &'static Trigger> {
    BINDINGS.iter().flat_map(|group| group.bindings).flat_map(|binding| binding.triggers)
}

/// Every command that can be clicked, in the order of the table, with its line.
pub fn items() -> impl Iterator<Item = (&'static Item, &'static Binding)> {
    BINDINGS.iter().flat_map(|group| group.bindings).flat_map(|binding| {
        binding.triggers.iter().filter_map(move |trigger| match trigger {
            Trigger::Item(item) => Some((item, binding)),
            _ => None,
        })
    })
}

/// The commands of a menu.
pub fn menu(of: Menu) -> impl Iterator<Item = &'static Item> {
    items().map(|(item, _)| item).filter(move |item| item.menus.contains(&of))
}

/// The first key that does this under a preset, for display.
pub fn shortcut(navigation: Navigation, wanted: &Action) -> Option<String> {
    presets::shown(navigation).into_iter().flat_map(|(_, bindings)| bindings).flat_map(|it| it.triggers).find_map(
        |trigger| match trigger {
            Trigger::Press(chord, action) if action == wanted => Some(chord.label()),
            _ => None,
        },
    )
}

/// A text with the key that does this under a preset, in parentheses; without one if there is none.
pub fn with_key(navigation: Navigation, text: &str, action: &Action) -> String {
    shortcut(navigation, action).map_or_else(|| text.to_owned(), |key| format!("{text} ({key})"))
}

/// The movement of a held key.
pub fn motion_of(key: PhysicalKey) -> Option<Motion> {
    triggers().find_map(|trigger| match trigger {
        Trigger::Hold(code, motion) if key == PhysicalKey::Code(*code) => Some(*motion),
        _ => None,
    })
}

/// The action of a key under a preset; digits are physical, because Shift changes what they type.
pub fn action_of(
    navigation: Navigation,
    physical: PhysicalKey,
    key: &Key,
    modifiers: ModifiersState,
) -> Option<Action> {
    let digit = digit_of(physical).filter(|_| !modifiers.super_key() && !modifiers.alt_key());
    let own = presets::groups_of(navigation).iter().flat_map(|group| group.bindings);
    own.flat_map(|binding| binding.triggers).chain(triggers()).find_map(|trigger| match trigger {
        Trigger::Press(chord, action) if chord.matches(physical, key, modifiers) => Some(action.clone()),
        Trigger::Digit { ctrl, shift, action }
            if (*ctrl, *shift) == (modifiers.control_key(), modifiers.shift_key()) =>
        {
            digit.map(action)
        }
        _ => None,
    })
}

/// The digit of a key, 1 to 9.
fn digit_of(key: PhysicalKey) -> Option<u8> {
    use KeyCode::{Digit1, Digit2, Digit3, Digit4, Digit5, Digit6, Digit7, Digit8, Digit9};
    let keys = [Digit1, Digit2, Digit3, Digit4, Digit5, Digit6, Digit7, Digit8, Digit9];
    (1..).zip(keys).find_map(|(digit, code)| (key == PhysicalKey::Code(code)).then_some(digit))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::{Command, Edit};
    use crate::render::Inspection;
    use winit::keyboard::NamedKey;

    #[test]
    fn the_list_tells_of_every_part_of_the_panel() {
        for title in crate::viewer::panel::SECTIONS {
            let wanted = format!("Panel: {title}");
            assert!(items().any(|(item, _)| item.name == wanted && item.action == Action::Section(title)), "{wanted}");
        }
    }

    #[test]
    fn what_a_key_does_can_also_be_clicked() {
        // Escape leaves whatever is open, and those have a button of their own; Space does one of two that have.
        for trigger in triggers() {
            let Trigger::Press(chord, action) = trigger else { continue };
            let is_known =
                matches!(action, Action::Leave | Action::PlayOrDrag) || items().any(|(item, _)| item.action == *action);
            assert!(is_known, "{} is no command of the menus", chord.label());
        }
        let names: Vec<&str> = items().map(|(item, _)| item.name).collect();
        for (i, name) in names.iter().enumerate() {
            assert!(!names[i + 1..].contains(name), "{name} is there twice");
        }
        assert!(menu(Menu::Here).any(|item| item.name == "Delete"));
        assert_eq!(shortcut(Navigation::Firstlight, &UNDO).as_deref(), Some("Ctrl+Z"));
        let handles = Action::Gizmo(Some(crate::frame::gizmo::Mode::Move));
        assert_eq!(shortcut(Navigation::Maya, &handles).as_deref(), Some("W"));
        let grab = Action::Grab(crate::frame::gizmo::Mode::Move);
        assert_eq!(shortcut(Navigation::Blender, &grab).as_deref(), Some("G"));
        assert_eq!(shortcut(Navigation::Firstlight, &handles), None);
        // R, which restarts, rotates in Blender.
        assert_eq!(shortcut(Navigation::Blender, &Action::Send(Command::Restart)), None);
    }

    #[test]
    fn no_press_means_two_things() {
        let all: Vec<&Trigger> = triggers().collect();
        for (i, one) in all.iter().enumerate() {
            for other in &all[i + 1..] {
                match (one, other) {
                    (Trigger::Hold(a, _), Trigger::Hold(b, _)) => assert_ne!(a, b),
                    (Trigger::Press(a, _), Trigger::Press(b, _)) => {
                        assert!(!a.overlaps(b), "{a:?} is there twice");
                    }
                    _ => {}
                }
            }
        }
        // A held letter must not trigger a command as well.
        for trigger in &all {
            let Trigger::Press(Chord { key: Typed::Text(text), ctrl: false, .. }, _) = trigger else { continue };
            let label = text.to_uppercase();
            assert!(
                !all.iter()
                    .any(|t| matches!(t, Trigger::Hold(code, _) if format!("{code:?}") == format!("Key{label}")))
            );
        }
    }

    #[test]
    fn presses_find_their_actions() {
        let none = ModifiersState::empty();
        let key = |text: &str| Key::Character(text.into());
        let pressed =
            |key: Key, modifiers| action_of(Navigation::Firstlight, PhysicalKey::Code(KeyCode::F24), &key, modifiers);
        let digit = |modifiers, typed: &str| {
            action_of(Navigation::Firstlight, PhysicalKey::Code(KeyCode::Digit3), &key(typed), modifiers)
        };
        assert_eq!(digit(none, "3"), Some(Action::Inspect(Inspection::Albedo)));
        assert_eq!(digit(ModifiersState::CONTROL, "3"), Some(Action::Send(Command::SetBookmark { slot: 3 })));
        assert_eq!(digit(ModifiersState::SHIFT, "§"), Some(Action::Send(Command::GoToBookmark { slot: 3 })));
        assert_eq!(
            pressed(key("Z"), ModifiersState::CONTROL | ModifiersState::SHIFT),
            Some(Action::Send(Command::Edit(Edit::Redo)))
        );
        assert_eq!(pressed(key("z"), ModifiersState::CONTROL), Some(Action::Send(Command::Edit(Edit::Undo))));
        assert_eq!(pressed(key("O"), ModifiersState::SHIFT), Some(Action::Send(Command::ToggleDepthOfField)));
        assert_eq!(pressed(key("k"), none), Some(Action::Screenshot { linear: false }));
        assert_eq!(pressed(key("K"), ModifiersState::SHIFT), Some(Action::Screenshot { linear: true }));
        assert_eq!(pressed(key("q"), none), None, "Q alone flies");
        assert_eq!(pressed(key("q"), ModifiersState::CONTROL), Some(Action::Quit));
        assert_eq!(
            pressed(key("}"), ModifiersState::SHIFT),
            Some(Action::Send(Command::ScaleAperture { factor: 1.05 }))
        );
        assert_eq!(pressed(Key::Named(NamedKey::Escape), none), Some(Action::Leave));
        assert_eq!(motion_of(PhysicalKey::Code(KeyCode::KeyW)), Some(Motion::Forward));
        assert_eq!(motion_of(PhysicalKey::Code(KeyCode::KeyH)), None);
    }
}
