//! Every key and mouse gesture, in one `table`.
//!
//! The window obeys [`BINDINGS`] and, before it, the preset that was chosen; the overlay on H shows both, and `docs/keys.md` is written from it, so these
//! cannot disagree. Keys that move are physical (WASD is the same block of keys on every layout); all others are
//! what the key types.

mod page;
mod presets;
mod table;
mod words;

pub use page::markdown;
pub use presets::shown;
pub use table::BINDINGS;
pub use words::finds;

use crate::frame::{Command, Navigation, gizmo};
use crate::render::Inspection;
use winit::keyboard::{Key, KeyCode, ModifiersState, NamedKey, PhysicalKey};

/// A line of the table: what to press and what it does.
pub struct Binding {
    pub triggers: &'static [Trigger],
    pub effect: &'static str,
}

impl Binding {
    /// All that a search looks at.
    pub fn line(&self, title: &str) -> String {
        format!("{title} {} {}", self.keys(), self.effect)
    }
}

/// A heading and its lines.
pub struct KeyGroup {
    pub title: &'static str,
    pub bindings: &'static [Binding],
}

pub enum Trigger {
    /// Moves for as long as the key is down.
    Hold(KeyCode, Motion),
    /// Happens once a press, and again as the keyboard repeats.
    Press(Chord, Action),
    /// One of the keys 1 to 9, whatever it types.
    Digit { ctrl: bool, shift: bool, action: fn(u8) -> Action },
    /// A gesture, told in words; `input` knows how.
    Mouse(&'static str),
}

/// A key with its modifiers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chord {
    pub key: Typed,
    pub ctrl: bool,
    /// `None` where typing the character may need Shift or not.
    pub shift: Option<bool>,
}

/// What a key types.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Typed {
    Text(&'static str),
    Named(NamedKey),
}

/// What a held key does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    Forward,
    Back,
    Left,
    Right,
    Up,
    Down,
    OrbitLeft,
    OrbitRight,
    OrbitUp,
    OrbitDown,
    RollLeft,
    RollRight,
}

/// What a pressed key does.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    Send(Command),
    TogglePause,
    ToggleIntegrator,
    /// As seen (PNG), or the linear light (EXR).
    Screenshot {
        linear: bool,
    },
    /// As a scene file: the one that is open, or a new one.
    SaveScene {
        new: bool,
    },
    PrintView,
    /// Shows this in place of the picture, or the picture again.
    Inspect(Inspection),
    /// Why what is under the mouse looks as it does.
    Explain,
    /// The next drag is a rectangle that gets all samples.
    Brush,
    ClearRegion,
    ToggleSharpZone,
    /// Moves, turns or scales; then none.
    NextGizmo,
    /// These handles, or none where they are shown already.
    Gizmo(Option<gizmo::Mode>),
    /// The camera goes around by itself.
    ToggleSpin,
    /// A drag looks about, or moves around the pivot.
    ToggleDrag,
    /// The mouse moves the view without a button, or points again.
    CaptureMouse,
    /// What is under the mouse is sharp, wherever it goes; or not any more.
    FocusFollows,
    /// Asks for a file to open.
    OpenDialog,
    TogglePanel,
    ToggleHelp,
    ToggleOverlays,
    ToggleFullscreen,
    /// Closes the help, or lets go of what is selected, or closes the window.
    Leave,
    Quit,
}

fn triggers() -> impl Iterator<Item = &'static Trigger> {
    BINDINGS.iter().flat_map(|group| group.bindings).flat_map(|binding| binding.triggers)
}

/// What holding this key moves.
pub fn motion_of(key: PhysicalKey) -> Option<Motion> {
    triggers().find_map(|trigger| match trigger {
        Trigger::Hold(code, motion) if key == PhysicalKey::Code(*code) => Some(*motion),
        _ => None,
    })
}

impl Motion {
    /// Moves the camera along its own axes.
    pub fn flies(self) -> bool {
        matches!(self, Self::Forward | Self::Back | Self::Left | Self::Right | Self::Up | Self::Down)
    }
}

/// What pressing this key does under a preset; digits count where they are on the keyboard, since Shift types something else there.
pub fn action_of(
    navigation: Navigation,
    physical: PhysicalKey,
    key: &Key,
    modifiers: ModifiersState,
) -> Option<Action> {
    let digit = digit_of(physical).filter(|_| !modifiers.super_key() && !modifiers.alt_key());
    let own = presets::groups_of(navigation).iter().flat_map(|group| group.bindings);
    own.flat_map(|binding| binding.triggers).chain(triggers()).find_map(|trigger| match trigger {
        Trigger::Press(chord, action) if chord.matches(key, modifiers) => Some(action.clone()),
        Trigger::Digit { ctrl, shift, action }
            if (*ctrl, *shift) == (modifiers.control_key(), modifiers.shift_key()) =>
        {
            digit.map(action)
        }
        _ => None,
    })
}

/// 1 to 9.
fn digit_of(key: PhysicalKey) -> Option<u8> {
    use KeyCode::{Digit1, Digit2, Digit3, Digit4, Digit5, Digit6, Digit7, Digit8, Digit9};
    let keys = [Digit1, Digit2, Digit3, Digit4, Digit5, Digit6, Digit7, Digit8, Digit9];
    (1..).zip(keys).find_map(|(digit, code)| (key == PhysicalKey::Code(code)).then_some(digit))
}

impl Chord {
    /// Whether a press may be both.
    fn overlaps(&self, other: &Self) -> bool {
        let apart = self.shift.is_some() && other.shift.is_some() && self.shift != other.shift;
        self.key == other.key && self.ctrl == other.ctrl && !apart
    }

    fn matches(&self, key: &Key, modifiers: ModifiersState) -> bool {
        let same_key = match (self.key, key) {
            // With Shift or Caps Lock the same letter comes as a capital.
            (Typed::Text(text), Key::Character(typed)) => text.eq_ignore_ascii_case(typed),
            (Typed::Named(name), Key::Named(typed)) => name == *typed,
            _ => false,
        };
        same_key
            && self.ctrl == modifiers.control_key()
            && self.shift.is_none_or(|shift| shift == modifiers.shift_key())
            && !modifiers.super_key()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Edit;

    #[test]
    fn the_list_tells_of_every_part_of_the_panel() {
        for title in crate::viewer::panel::SECTIONS {
            let wanted = format!("Panel: {title}");
            assert!(triggers().any(|trigger| matches!(trigger, Trigger::Mouse(name) if *name == wanted)), "{wanted}");
        }
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
        // A held letter must not type a command as well.
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
        assert_eq!(pressed(key("}"), ModifiersState::SHIFT), Some(Action::Send(table::WIDER)));
        assert_eq!(pressed(Key::Named(NamedKey::Escape), none), Some(Action::Leave));
        assert_eq!(motion_of(PhysicalKey::Code(KeyCode::KeyW)), Some(Motion::Forward));
        assert_eq!(motion_of(PhysicalKey::Code(KeyCode::KeyH)), None);
    }
}
