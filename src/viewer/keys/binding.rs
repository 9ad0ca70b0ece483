//! Triggers and what they do: the types of the table.

use crate::frame::{Command, LeftView, gizmo};
use crate::render::Inspection;
use winit::keyboard::{Key, KeyCode, ModifiersState, NamedKey, PhysicalKey};

/// A line of the table: triggers and their effect.
pub struct Binding {
    pub triggers: &'static [Trigger],
    pub effect: &'static str,
}

impl Binding {
    /// The text that a search looks in.
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
    /// Triggers once per press, and again on keyboard repeat.
    Press(Chord, Action),
    /// One of the keys 1 to 9, whatever it types.
    Digit { ctrl: bool, shift: bool, action: fn(u8) -> Action },
    /// A gesture, described in words; `input` implements it.
    Mouse(&'static str),
    /// A click in a menu, and a line of the list of commands.
    Item(Item),
}

/// A command by name, to be clicked.
pub struct Item {
    pub name: &'static str,
    /// The menus that show it; the list of commands has it in any case.
    pub menus: &'static [Menu],
    pub action: Action,
}

/// Where a command can be clicked: a part of the menu, or the menu of the image under the mouse.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Menu {
    File,
    Edit,
    Add,
    View,
    Lens,
    Image,
    Inspect,
    Window,
    /// Right click on the image.
    Here,
}

/// A key with its modifiers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chord {
    pub key: Typed,
    pub ctrl: bool,
    pub alt: bool,
    /// `None` if typing the character may or may not need Shift.
    pub shift: Option<bool>,
}

/// The result of typing a key.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Typed {
    Text(&'static str),
    Named(NamedKey),
    /// A key of the number pad, whatever it types, and its name.
    Pad(KeyCode, &'static str),
}

/// The movement of a held key.
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

/// The action of a pressed key.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    Send(Command),
    TogglePause,
    ToggleIntegrator,
    /// Saves the displayed image (PNG), or linear radiance (EXR).
    Screenshot {
        linear: bool,
    },
    /// Shows the form to render an image to a file, or the frames of the animation.
    RenderTo {
        frames: bool,
    },
    /// Saves as a scene file: the open one, or a new one whose name is asked for.
    SaveScene {
        new: bool,
    },
    /// Copies the camera block of a scene file, and prints it to the terminal.
    CopyView,
    /// Copies the displayed image.
    CopyImage,
    /// Opens the folder of what was saved last.
    ShowSaved,
    /// Shows this view again.
    ReturnTo(Box<LeftView>),
    /// Toggles between this inspection and the image.
    Inspect(Inspection),
    /// Sets the exposure by the brightness of the image.
    AutoExposure,
    /// Explains the pixel under the mouse.
    Explain,
    /// Focuses on what is under the mouse, and moves the pivot there.
    FocusHere,
    /// The next drag selects a rectangle that gets all samples.
    Brush,
    ClearRegion,
    ToggleSharpZone,
    /// Cycles through move, rotate, scale and none.
    NextGizmo,
    /// Shows these handles, or hides them if they are shown already.
    Gizmo(Option<gizmo::Mode>),
    /// Moves, rotates or scales the selection with the mouse at once.
    Grab(gizmo::Mode),
    /// Duplicate the selection, and move the copy with the mouse.
    GrabCopy,
    /// Starts or stops the animation.
    TogglePlay,
    /// Begins or ends what plays at the shown frame.
    PlayRange(PlayEnd),
    PlayAll,
    /// Starts or stops the turntable.
    ToggleSpin,
    /// Plays or pauses what moves; without that, as the next one.
    PlayOrDrag,
    /// Toggles whether a drag looks around or orbits the pivot.
    ToggleDrag,
    /// Captures the mouse, so that it moves the view without a button, or releases it.
    CaptureMouse,
    /// Toggles whether focus follows the mouse.
    FocusFollows,
    /// Shows a dialog to choose a file to open.
    OpenDialog,
    /// Opens an empty scene.
    NewScene,
    /// Shows a dialog to choose a model to add at a place of the image, fractions; `None`: in the middle.
    AddDialog(Option<[f64; 2]>),
    /// Shows a dialog to choose an environment image.
    EnvironmentDialog,
    TogglePanel,
    /// Opens the panel at this section.
    Section(&'static str),
    /// Shows the list of commands, with its search.
    Palette,
    /// The same, with this in its search.
    PaletteOf(&'static str),
    ToggleHelp,
    ToggleOverlays,
    ToggleFullscreen,
    /// Closes the help, or clears the selection, or closes the window.
    Leave,
    Quit,
}

/// An end of the part of an animation that plays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlayEnd {
    First,
    Last,
}

impl Motion {
    /// Whether it moves the camera along its own axes.
    pub fn flies(self) -> bool {
        matches!(self, Self::Forward | Self::Back | Self::Left | Self::Right | Self::Up | Self::Down)
    }
}

impl Chord {
    /// Whether one press may match both.
    pub(super) fn overlaps(&self, other: &Self) -> bool {
        let apart = self.shift.is_some() && other.shift.is_some() && self.shift != other.shift;
        self.key == other.key && (self.ctrl, self.alt) == (other.ctrl, other.alt) && !apart
    }

    pub(super) fn matches(&self, physical: PhysicalKey, key: &Key, modifiers: ModifiersState) -> bool {
        let same_key = match (self.key, key) {
            (Typed::Pad(code, _), _) => physical == PhysicalKey::Code(code),
            // With Shift or Caps Lock the letter is reported as a capital.
            (Typed::Text(text), Key::Character(typed)) => text.eq_ignore_ascii_case(typed),
            (Typed::Named(name), Key::Named(typed)) => name == *typed,
            _ => false,
        };
        // Other characters may need Alt to be typed.
        let is_letter = matches!(self.key, Typed::Text(text) if text.chars().all(|c| c.is_ascii_alphabetic()));
        same_key
            && self.ctrl == modifiers.control_key()
            && (self.alt == modifiers.alt_key() || (!self.alt && !is_letter))
            && self.shift.is_none_or(|shift| shift == modifiers.shift_key())
            && !modifiers.super_key()
    }
}
