//! Everything that a person can ask of a session, as data.
//!
//! A window, a script or a recording produces commands; the session carries them out, in order, at the next frame.
//! No command depends on a clock: whoever holds a key down multiplies the rate by the seconds and sends the amount,
//! so the same list of commands always leads to the same picture.

use super::rig::Rig;
use super::{Bookmarks, Edit, Target};
use crate::render::{Inspection, Integrator, SampleAllocation, ToneCurve};
use crate::scene::{BadValue, Lens, Projection, View, check_film_size};
use bevy_ecs::message::Message;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// One request. Signs follow the picture: right, up and forward are positive.
///
/// Positions in the picture are fractions of its size, `(0, 0)` the upper left corner, `(1, 1)` the lower right, so
/// that they mean the same at any resolution.
#[derive(Clone, Debug, PartialEq, Message, Serialize, Deserialize)]
pub enum Command {
    /// Look about from where the camera is, degrees; positive yaw looks to the right, positive pitch upwards.
    Turn {
        /// Degrees to the right.
        yaw_deg: f64,
        /// Degrees upwards.
        pitch_deg: f64,
    },
    /// Move along the view's own axes, in strides (see [`super::navigation::stride`]), which fit the scene's size.
    Fly {
        /// Strides to the right.
        right: f64,
        /// Strides upwards.
        up: f64,
        /// Strides forward.
        forward: f64,
    },
    /// From now on a stride is half of the way to what is at this place in the picture.
    PaceAt {
        /// Fraction of the width of the picture, from the left.
        x: f64,
        /// Fraction of its height, from the top.
        y: f64,
    },
    /// Move the camera around the pivot, degrees; positive yaw moves it to the right, positive pitch upwards.
    Orbit {
        /// Degrees to the right.
        yaw_deg: f64,
        /// Degrees upwards.
        pitch_deg: f64,
    },
    /// Move sideways, in heights of the picture at the pivot: what lies there moves with the mouse.
    Pan {
        /// Heights of the picture to the right.
        right: f64,
        /// Heights of the picture upwards.
        up: f64,
    },
    /// Multiply the distance to the pivot, which stays where it is; positive.
    Dolly {
        /// Above 1 moves away from the pivot.
        factor: f64,
    },
    /// Multiply the size of what the picture takes in, by changing the field of view; positive.
    Zoom {
        /// Above 1 takes in more of the scene.
        factor: f64,
    },
    /// Lean the head to the right, degrees.
    Roll {
        /// Degrees, positive to the right.
        angle_deg: f64,
    },
    /// Take the roll out: the horizon is level again.
    Level,
    /// Turn about the vertical, keeping the horizon, or freely about the picture's own axes.
    ToggleTurntable,
    /// The camera as it was when the scene was opened.
    Home,
    /// Keep the direction, place the camera so that what is selected just fits into the picture, or else the whole scene
    /// but for what lies far off, and focus on its middle.
    FrameAll,
    /// Set the pose of the camera.
    SetView(View),
    /// Set the field of view.
    SetProjection(Projection),
    /// Set aperture and focus.
    SetLens(Lens),
    /// Put the pivot at the depth of what is at this place in the picture.
    PivotAt {
        /// Fraction of the width of the picture, from the left.
        x: f64,
        /// Fraction of its height, from the top.
        y: f64,
    },
    /// Multiply the distance of the focal plane; positive.
    ScaleFocus {
        /// Above 1 moves the focal plane away.
        factor: f64,
    },
    /// Metres along the view axis, positive, may be infinite.
    SetFocus {
        /// Distance of the focal plane.
        distance: f64,
    },
    /// Put the focal plane through what is at this place in the picture.
    FocusAt {
        /// Fraction of the width of the picture, from the left.
        x: f64,
        /// Fraction of its height, from the top.
        y: f64,
    },
    /// Multiply the radius of the aperture; switches depth of field on.
    ScaleAperture {
        /// Above 1 blurs more.
        factor: f64,
    },
    /// Metres, at least 0; switches depth of field on.
    SetAperture {
        /// Radius of the aperture.
        radius: f64,
    },
    /// Switch depth of field on or off.
    ToggleDepthOfField,
    /// Add to the exposure, factors of two.
    AdjustExposure {
        /// Positive for a brighter picture.
        stops: f32,
    },
    /// Set the exposure, factors of two.
    SetExposure {
        /// 0 shows the light as it is; positive for a brighter picture.
        stops: f32,
    },
    /// Set the tone curve.
    SetToneCurve(ToneCurve),
    /// The next tone curve of the list, and after the last the first.
    NextToneCurve,
    /// The size of the picture in pixels. A size without pixels (a minimised window) keeps the film and pauses.
    Resize {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
    },
    /// Rest until [`Command::Resume`]; what changes is still shown.
    Pause,
    /// End a pause.
    Resume,
    /// Drop all samples and begin again.
    Restart,
    /// Set the light model.
    SetIntegrator(Integrator),
    /// Set how samples are spread over the pixels.
    SetAllocation(SampleAllocation),
    /// Worker threads; 0 is one for each processor.
    SetThreads {
        /// How many; 0 for one per processor.
        threads: usize,
    },
    /// Save the scene as a scene file; one that is there is replaced.
    SaveScene {
        /// The file to write.
        #[serde(with = "crate::scene::path_text")]
        path: PathBuf,
    },
    /// Show the animations of the open glTF model at another moment.
    SetMoment {
        /// Seconds; `None` is the pose that the file stores.
        seconds: Option<f64>,
    },
    /// When the picture is good enough.
    SetTarget(Target),
    /// Nobody can see the picture: rest, without being paused.
    SetHidden {
        /// Whether the picture is out of sight.
        hidden: bool,
    },
    /// What is shown in place of the picture, see [`Inspection`].
    SetInspection(Inspection),
    /// Tint what is sharp, and draw the focal plane.
    SetSharpZone {
        /// Whether it is shown.
        shown: bool,
    },
    /// Tell why what is at this place in the picture looks as it does.
    ExplainAt {
        /// Fraction of the width of the picture, from the left.
        x: f64,
        /// Fraction of its height, from the top.
        y: f64,
    },
    /// Forget the explanation of [`Command::ExplainAt`].
    ForgetExplanation,
    /// Give all samples to a part of the picture (left, top, right, bottom), or to all of it again.
    SetRegion {
        /// Left, top, right and bottom as fractions of the picture; `None` for all of it.
        region: Option<[f64; 4]>,
    },
    /// The focal plane stays with the point that was focused on last, or moves with the camera again.
    ToggleFocusLock,
    /// The focal plane goes to what is at this place in the picture, and stays with whatever comes there.
    FocusFollows {
        /// Fraction of the width of the picture, from the left.
        x: f64,
        /// Fraction of its height, from the top.
        y: f64,
    },
    /// Keep the view under a number from 1 to 9.
    SetBookmark {
        /// From 1 to 9.
        slot: u8,
    },
    /// Set the camera to the view kept under a number from 1 to 9.
    GoToBookmark {
        /// From 1 to 9.
        slot: u8,
    },
    /// All of them at once, as they were kept before.
    SetBookmarks(Box<Bookmarks>),
    /// To where the camera rested before.
    PreviousView,
    /// To where the camera was before [`Command::PreviousView`].
    NextView,
    /// Change what the scene is made of.
    Edit(Edit),
    /// Open a scene file, a model or, when there is no such file, the built-in scene of that name.
    Open {
        /// The file, or the name of a built-in scene.
        #[serde(with = "crate::scene::path_text")]
        path: PathBuf,
    },
}

impl Command {
    /// Whether it can be carried out, whoever sends it: the same limits as those of scene files. Amounts that a camera is
    /// moved by need none, for what makes no sense moves nothing.
    ///
    /// # Errors
    /// When it sets something to a value that nothing is made from.
    pub fn check(&self) -> Result<(), BadValue> {
        match self {
            Self::SetView(view) => view.check(),
            Self::SetProjection(projection) => projection.check(),
            Self::SetLens(lens) => lens.check(),
            Self::SetBookmarks(bookmarks) => bookmarks.0.iter().flatten().try_for_each(Rig::check),
            // A window without pixels is a minimised one.
            Self::Resize { width, height } => check_film_size((*width).max(1), (*height).max(1)),
            Self::SetTarget(target) => target.check(),
            Self::SetMoment { seconds: Some(seconds) } if !seconds.is_finite() => {
                let allowed = "be a finite number of seconds".to_owned();
                Err(BadValue::OutOfRange { field: "at", value: seconds.to_string(), allowed })
            }
            _ => Ok(()),
        }
    }
}
