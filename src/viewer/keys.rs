//! Every key and mouse gesture, in one table.
//!
//! The window obeys [`BINDINGS`], the overlay on H shows it, and `docs/keys.md` is written from it, so the three
//! cannot disagree. Keys that move are physical (WASD is the same block of keys on every layout); all others are
//! what the key types.

use crate::frame::{Command, Edit};
use crate::render::Inspection;
use std::fmt::Write as _;
use winit::keyboard::{Key, KeyCode, ModifiersState, NamedKey, PhysicalKey};

/// A line of the table: what to press and what it does.
pub struct Binding {
    pub triggers: &'static [Trigger],
    pub effect: &'static str,
}

/// A heading and its lines.
pub struct Group {
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
    /// The camera goes around by itself.
    ToggleSpin,
    TogglePanel,
    ToggleHelp,
    ToggleOverlays,
    ToggleFullscreen,
    /// Closes the help, or lets go of what is selected, or closes the window.
    Leave,
    Quit,
}

const fn hold(key: KeyCode, motion: Motion) -> Trigger {
    Trigger::Hold(key, motion)
}

const fn text(key: &'static str, action: Action) -> Trigger {
    Trigger::Press(Chord { key: Typed::Text(key), ctrl: false, shift: None }, action)
}

const fn named(key: NamedKey, action: Action) -> Trigger {
    Trigger::Press(Chord { key: Typed::Named(key), ctrl: false, shift: None }, action)
}

const fn shifted(key: Typed, shift: bool, action: Action) -> Trigger {
    Trigger::Press(Chord { key, ctrl: false, shift: Some(shift) }, action)
}

const fn ctrl(key: &'static str, action: Action) -> Trigger {
    Trigger::Press(Chord { key: Typed::Text(key), ctrl: true, shift: None }, action)
}

const fn ctrl_shifted(key: &'static str, shift: bool, action: Action) -> Trigger {
    Trigger::Press(Chord { key: Typed::Text(key), ctrl: true, shift: Some(shift) }, action)
}

const fn edit(key: &'static str, shift: Option<bool>, edit: Edit) -> Trigger {
    Trigger::Press(Chord { key: Typed::Text(key), ctrl: true, shift }, Action::Send(Command::Edit(edit)))
}

const fn inspect(key: &'static str, inspection: Inspection) -> Trigger {
    Trigger::Press(Chord { key: Typed::Text(key), ctrl: false, shift: Some(false) }, Action::Inspect(inspection))
}

const fn send(key: &'static str, command: Command) -> Trigger {
    text(key, Action::Send(command))
}

/// A press of a focus or aperture key multiplies by this or divides.
const LENS_STEP: f64 = 1.05;
/// A press of a dolly or zoom key multiplies by this or divides.
const ZOOM_STEP: f64 = 1.1;
/// Photographers count exposure in thirds.
const EXPOSURE_STEP: f32 = 1.0 / 3.0;

const NEARER: Command = Command::ScaleFocus { factor: 1.0 / LENS_STEP };
const FARTHER: Command = Command::ScaleFocus { factor: LENS_STEP };
const NARROWER: Command = Command::ScaleAperture { factor: 1.0 / LENS_STEP };
const WIDER: Command = Command::ScaleAperture { factor: LENS_STEP };
const DOLLY_IN: Command = Command::Dolly { factor: 1.0 / ZOOM_STEP };
const DOLLY_OUT: Command = Command::Dolly { factor: ZOOM_STEP };
const ZOOM_IN: Command = Command::Zoom { factor: 1.0 / ZOOM_STEP };
const ZOOM_OUT: Command = Command::Zoom { factor: ZOOM_STEP };

pub static BINDINGS: &[Group] = &[
    Group {
        title: "Fly",
        bindings: &[
            Binding {
                triggers: &[
                    hold(KeyCode::KeyW, Motion::Forward),
                    hold(KeyCode::KeyA, Motion::Left),
                    hold(KeyCode::KeyS, Motion::Back),
                    hold(KeyCode::KeyD, Motion::Right),
                ],
                effect: "fly forward, left, back, right",
            },
            Binding {
                triggers: &[hold(KeyCode::KeyE, Motion::Up), hold(KeyCode::KeyQ, Motion::Down)],
                effect: "fly up, down",
            },
            Binding { triggers: &[Trigger::Mouse("Shift")], effect: "four times as fast, while held" },
            Binding { triggers: &[Trigger::Mouse("Wheel")], effect: "flying speed" },
            Binding { triggers: &[Trigger::Mouse("Drag")], effect: "look about" },
        ],
    },
    Group {
        title: "Orbit",
        bindings: &[
            Binding {
                triggers: &[
                    hold(KeyCode::ArrowLeft, Motion::OrbitLeft),
                    hold(KeyCode::ArrowRight, Motion::OrbitRight),
                    hold(KeyCode::ArrowUp, Motion::OrbitUp),
                    hold(KeyCode::ArrowDown, Motion::OrbitDown),
                ],
                effect: "move around the pivot",
            },
            Binding {
                triggers: &[Trigger::Mouse("Middle drag"), Trigger::Mouse("Alt+drag")],
                effect: "move around the pivot",
            },
            Binding {
                triggers: &[Trigger::Mouse("Right drag"), Trigger::Mouse("Shift+arrows")],
                effect: "move sideways",
            },
            Binding {
                triggers: &[
                    send("+", DOLLY_IN),
                    send("=", DOLLY_IN),
                    send("-", DOLLY_OUT),
                    Trigger::Mouse("Ctrl+wheel"),
                ],
                effect: "nearer to, farther from the pivot",
            },
        ],
    },
    Group {
        title: "View",
        bindings: &[
            Binding {
                triggers: &[
                    ctrl("=", Action::Send(ZOOM_IN)),
                    ctrl("+", Action::Send(ZOOM_IN)),
                    ctrl("-", Action::Send(ZOOM_OUT)),
                    Trigger::Mouse("Shift+wheel"),
                ],
                effect: "narrower, wider field of view",
            },
            Binding {
                triggers: &[hold(KeyCode::KeyZ, Motion::RollLeft), hold(KeyCode::KeyC, Motion::RollRight)],
                effect: "lean left, right",
            },
            Binding { triggers: &[send("x", Command::Level)], effect: "level the horizon" },
            Binding {
                triggers: &[send("t", Command::ToggleTurntable)],
                effect: "keep the horizon while turning, or turn freely",
            },
            Binding {
                triggers: &[named(NamedKey::Home, Action::Send(Command::Home))],
                effect: "the view that the scene opened with",
            },
            Binding {
                triggers: &[send("f", Command::FrameAll)],
                effect: "frame what is selected, or the whole scene, and focus on it",
            },
            Binding {
                triggers: &[
                    shifted(Typed::Named(NamedKey::Backspace), false, Action::Send(Command::PreviousView)),
                    shifted(Typed::Named(NamedKey::Backspace), true, Action::Send(Command::NextView)),
                ],
                effect: "back to the view before, and forth again",
            },
            Binding {
                triggers: &[Trigger::Digit {
                    ctrl: true,
                    shift: false,
                    action: |slot| Action::Send(Command::SetBookmark { slot }),
                }],
                effect: "keep this view under a number",
            },
            Binding {
                triggers: &[Trigger::Digit {
                    ctrl: false,
                    shift: true,
                    action: |slot| Action::Send(Command::GoToBookmark { slot }),
                }],
                effect: "go to the view of that number",
            },
            Binding { triggers: &[text("u", Action::ToggleSpin)], effect: "turntable: go around the pivot, or stop" },
            Binding { triggers: &[text("v", Action::PrintView)], effect: "print the view as a scene file's camera" },
        ],
    },
    Group {
        title: "Lens",
        bindings: &[
            Binding { triggers: &[send("[", NEARER), send("]", FARTHER)], effect: "focal plane nearer, farther" },
            Binding {
                triggers: &[send("{", NARROWER), send("}", WIDER), send(",", NARROWER), send(".", WIDER)],
                effect: "aperture narrower, wider",
            },
            Binding { triggers: &[send("o", Command::ToggleDepthOfField)], effect: "depth of field on, off" },
            Binding {
                triggers: &[Trigger::Mouse("Shift+click"), Trigger::Mouse("Shift+drag")],
                effect: "focus on what is under the mouse",
            },
            Binding { triggers: &[Trigger::Mouse("Double click")], effect: "focus there, and orbit at that depth" },
            Binding {
                triggers: &[send("l", Command::ToggleFocusLock)],
                effect: "focus stays with what was focused on, or moves with the camera",
            },
            Binding {
                triggers: &[text("y", Action::ToggleSharpZone)],
                effect: "show what is sharp to a pixel, and the focal plane",
            },
        ],
    },
    Group {
        title: "Select and edit",
        bindings: &[
            Binding { triggers: &[Trigger::Mouse("Click")], effect: "select what is under the mouse" },
            Binding {
                triggers: &[Trigger::Mouse("Ctrl+click")],
                effect: "select it beside the others, or leave it out",
            },
            Binding { triggers: &[edit("a", None, Edit::SelectAll)], effect: "select everything" },
            Binding {
                triggers: &[text("g", Action::NextGizmo)],
                effect: "handles to move, turn or scale what is selected, or none",
            },
            Binding {
                triggers: &[Trigger::Mouse("Ctrl, dragging a handle")],
                effect: "in steps: 15 degrees, a tenth of the size",
            },
            Binding { triggers: &[edit("d", None, Edit::Duplicate)], effect: "duplicate what is selected" },
            Binding {
                triggers: &[named(NamedKey::Delete, Action::Send(Command::Edit(Edit::Delete)))],
                effect: "delete what is selected",
            },
            Binding { triggers: &[edit("z", Some(false), Edit::Undo)], effect: "undo" },
            Binding { triggers: &[edit("z", Some(true), Edit::Redo), edit("y", None, Edit::Redo)], effect: "do again" },
            Binding {
                triggers: &[Trigger::Mouse("Panel: Add")],
                effect: "add a sphere, a plane, a cube, a light, a mesh",
            },
            Binding {
                triggers: &[Trigger::Mouse("Panel: Selected")],
                effect: "place, material, light and mesh of what is selected, by numbers",
            },
        ],
    },
    Group {
        title: "See what is going on",
        bindings: &[
            Binding { triggers: &[inspect("1", Inspection::Normals)], effect: "normals" },
            Binding { triggers: &[inspect("2", Inspection::Depth)], effect: "depth" },
            Binding { triggers: &[inspect("3", Inspection::Albedo)], effect: "albedo: colour without light" },
            Binding { triggers: &[inspect("4", Inspection::Error)], effect: "relative error of each pixel" },
            Binding { triggers: &[inspect("5", Inspection::Samples)], effect: "samples of each pixel" },
            Binding { triggers: &[inspect("6", Inspection::TreeSteps)], effect: "kd-tree nodes that a ray visits" },
            Binding {
                triggers: &[inspect("7", Inspection::TriangleTests)],
                effect: "blocks of triangles that a ray is tested against",
            },
            Binding { triggers: &[inspect("8", Inspection::Bounces)], effect: "bounces of a path" },
            Binding { triggers: &[inspect("9", Inspection::Luminance)], effect: "false colour: brightness in stops" },
            Binding { triggers: &[inspect("0", Inspection::Picture)], effect: "the picture" },
            Binding {
                triggers: &[text("j", Action::Explain)],
                effect: "why the pixel under the mouse looks as it does: its paths, and what each light brings",
            },
        ],
    },
    Group {
        title: "Picture",
        bindings: &[
            Binding {
                triggers: &[
                    named(NamedKey::PageUp, Action::Send(Command::AdjustExposure { stops: EXPOSURE_STEP })),
                    named(NamedKey::PageDown, Action::Send(Command::AdjustExposure { stops: -EXPOSURE_STEP })),
                ],
                effect: "brighter, darker by a third of a stop",
            },
            Binding { triggers: &[send("m", Command::NextToneCurve)], effect: "next tone curve" },
            Binding {
                triggers: &[text("i", Action::ToggleIntegrator)],
                effect: "path tracing or the classic Phong model",
            },
            Binding { triggers: &[text("p", Action::TogglePause)], effect: "pause, go on" },
            Binding {
                triggers: &[shifted(Typed::Text("b"), false, Action::Brush), Trigger::Mouse("then drag")],
                effect: "give all samples to a rectangle",
            },
            Binding {
                triggers: &[shifted(Typed::Text("b"), true, Action::ClearRegion)],
                effect: "give them to the whole picture again",
            },
            Binding { triggers: &[send("r", Command::Restart)], effect: "begin again" },
            Binding {
                triggers: &[
                    shifted(Typed::Named(NamedKey::F12), false, Action::Screenshot { linear: false }),
                    shifted(Typed::Text("k"), false, Action::Screenshot { linear: false }),
                ],
                effect: "keep the picture as a new PNG file",
            },
            Binding {
                triggers: &[
                    shifted(Typed::Named(NamedKey::F12), true, Action::Screenshot { linear: true }),
                    shifted(Typed::Text("k"), true, Action::Screenshot { linear: true }),
                ],
                effect: "keep its linear light as a new EXR file",
            },
            Binding {
                triggers: &[ctrl_shifted("s", false, Action::SaveScene { new: false })],
                effect: "save the scene file, or the scene as a new one",
            },
            Binding {
                triggers: &[ctrl_shifted("s", true, Action::SaveScene { new: true })],
                effect: "save the scene as a new scene file",
            },
            Binding {
                triggers: &[Trigger::Mouse("Drop a file")],
                effect: "open a scene (.ron), a model (.obj) or a picture that was kept (.png, .exr)",
            },
        ],
    },
    Group {
        title: "Window",
        bindings: &[
            Binding {
                triggers: &[text("h", Action::ToggleHelp), named(NamedKey::F1, Action::ToggleHelp)],
                effect: "show these keys, and find one by a word",
            },
            Binding { triggers: &[text("n", Action::TogglePanel)], effect: "panel: every setting, and figures" },
            Binding {
                triggers: &[named(NamedKey::Tab, Action::ToggleOverlays)],
                effect: "hide everything but the picture",
            },
            Binding { triggers: &[named(NamedKey::F11, Action::ToggleFullscreen)], effect: "full screen" },
            Binding {
                triggers: &[named(NamedKey::Escape, Action::Leave)],
                effect: "close this list or the explanation, or select nothing, or close the window",
            },
            Binding { triggers: &[ctrl("q", Action::Quit)], effect: "quit" },
        ],
    },
];

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

/// What pressing this key does; digits count where they are on the keyboard, since Shift types something else there.
pub fn action_of(physical: PhysicalKey, key: &Key, modifiers: ModifiersState) -> Option<Action> {
    let digit = digit_of(physical).filter(|_| !modifiers.super_key() && !modifiers.alt_key());
    triggers().find_map(|trigger| match trigger {
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

    fn label(&self) -> String {
        let key = match self.key {
            Typed::Text(text) => text.to_uppercase(),
            Typed::Named(NamedKey::Escape) => "Esc".to_owned(),
            Typed::Named(NamedKey::PageUp) => "Page Up".to_owned(),
            Typed::Named(NamedKey::PageDown) => "Page Down".to_owned(),
            Typed::Named(name) => format!("{name:?}"),
        };
        let ctrl = if self.ctrl { "Ctrl+" } else { "" };
        let shift = if self.shift == Some(true) { "Shift+" } else { "" };
        format!("{ctrl}{shift}{key}")
    }
}

impl Binding {
    /// The keys as the user reads them.
    pub fn keys(&self) -> String {
        let labels: Vec<String> = self
            .triggers
            .iter()
            .map(|trigger| match trigger {
                Trigger::Hold(code, _) => match code {
                    KeyCode::ArrowLeft => "⬅".to_owned(),
                    KeyCode::ArrowRight => "➡".to_owned(),
                    KeyCode::ArrowUp => "⬆".to_owned(),
                    KeyCode::ArrowDown => "⬇".to_owned(),
                    _ => format!("{code:?}").replace("Key", ""),
                },
                Trigger::Press(chord, _) => chord.label(),
                Trigger::Digit { ctrl, .. } => if *ctrl { "Ctrl+1…9" } else { "Shift+1…9" }.to_owned(),
                Trigger::Mouse(gesture) => (*gesture).to_owned(),
            })
            .collect();
        labels.join("  ")
    }
}

/// The whole of `docs/keys.md`.
pub fn markdown() -> String {
    let mut page = String::from(
        "# Keys and mouse\n\n\
         H shows this list in the window. It is written from the table in `src/viewer/keys.rs`, which the window obeys;\n\
         after a change there, `FIRSTLIGHT_BLESS=1 cargo test keys_page` writes it again.\n",
    );
    for group in BINDINGS {
        write!(page, "\n## {}\n\n| keys | what they do |\n|---|---|\n", group.title).expect("a string takes all");
        for binding in group.bindings {
            let keys = binding.keys();
            let keys: Vec<String> = keys.split("  ").map(|key| format!("`{key}`")).collect();
            writeln!(page, "| {} | {} |", keys.join(" "), binding.effect).expect("a string takes all");
        }
    }
    page
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_page_says_what_the_window_obeys() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/keys.md");
        if std::env::var_os("FIRSTLIGHT_BLESS").is_some() {
            std::fs::write(path, markdown()).expect("docs/keys.md can be written");
        }
        let page = std::fs::read_to_string(path).expect("docs/keys.md is there");
        assert!(page == markdown(), "docs/keys.md is out of date: run FIRSTLIGHT_BLESS=1 cargo test keys_page");
    }

    #[test]
    fn no_press_means_two_things() {
        let all: Vec<&Trigger> = triggers().collect();
        for (i, one) in all.iter().enumerate() {
            for other in &all[i + 1..] {
                match (one, other) {
                    (Trigger::Hold(a, _), Trigger::Hold(b, _)) => assert_ne!(a, b),
                    (Trigger::Press(a, _), Trigger::Press(b, _)) => {
                        let apart = a.shift.is_some() && b.shift.is_some() && a.shift != b.shift;
                        assert!(a.key != b.key || a.ctrl != b.ctrl || apart, "{a:?} is there twice");
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
        let pressed = |key: Key, modifiers| action_of(PhysicalKey::Code(KeyCode::F24), &key, modifiers);
        let digit = |modifiers, typed: &str| action_of(PhysicalKey::Code(KeyCode::Digit3), &key(typed), modifiers);
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
        assert_eq!(pressed(key("}"), ModifiersState::SHIFT), Some(Action::Send(WIDER)));
        assert_eq!(pressed(Key::Named(NamedKey::Escape), none), Some(Action::Leave));
        assert_eq!(motion_of(PhysicalKey::Code(KeyCode::KeyW)), Some(Motion::Forward));
        assert_eq!(motion_of(PhysicalKey::Code(KeyCode::KeyH)), None);
    }
}
