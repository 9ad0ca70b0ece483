//! All requests to a session, as data.
//!
//! A window, a script or a recording produces commands; the session executes them, in order, at the next frame. No
//! command depends on a clock: the sender multiplies a rate by the time that a key is held and sends the amount, so the
//! same list of commands always gives the same image.

use crate::frame::core::denoising::{DenoiseFilter, Denoising};
use crate::frame::core::offline::Target;
use crate::frame::core::rig::{Rig, Side};
use crate::frame::{Bookmarks, Edit};
use crate::render::{Inspection, Integrator, SampleAllocation, ToneCurve};
use crate::scene::{BadValue, Lens, Projection, View, check_film_size};
use bevy_ecs::message::Message;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// One request. Directions are those of the image: right, up and forward are positive.
///
/// Positions in the image are fractions of its size, `(0, 0)` the upper left corner, `(1, 1)` the lower right, so that
/// they are independent of the resolution.
#[derive(Clone, Debug, PartialEq, Message, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Command {
    /// Turn the camera about its position, degrees; positive yaw turns to the right, positive pitch upwards.
    Turn {
        /// Degrees to the right.
        yaw_deg: f64,
        /// Degrees upwards.
        pitch_deg: f64,
    },
    /// Move along the view's axes, in strides (see [`crate::frame::navigation::stride`]), which scale with the scene's size.
    Fly {
        /// Strides to the right.
        right: f64,
        /// Strides upwards.
        up: f64,
        /// Strides forward.
        forward: f64,
    },
    /// Set the stride to half of the distance to the surface at this position in the image.
    PaceAt {
        /// Fraction of the width of the image, from the left.
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
    /// Move sideways, in image heights at the pivot's depth: points at that depth move with the mouse.
    Pan {
        /// Image heights to the right.
        right: f64,
        /// Image heights upwards.
        up: f64,
    },
    /// Multiply the distance to the pivot, which stays where it is; positive.
    Dolly {
        /// Above 1 moves away from the pivot.
        factor: f64,
    },
    /// Multiply the size of the visible area, by changing the field of view; positive.
    Zoom {
        /// Above 1 shows more of the scene.
        factor: f64,
    },
    /// Roll the camera to the right, degrees.
    Roll {
        /// Degrees, positive to the right.
        angle_deg: f64,
    },
    /// Remove the roll: the horizon is level again.
    Level,
    /// Look at the pivot from a side of the scene, at the same distance.
    ViewFrom(Side),
    /// Look at the pivot from the side opposite to this one.
    ViewFromBehind,
    /// Switch between turning about the vertical, which keeps the horizon, and turning freely about the image axes.
    ToggleTurntable,
    /// Return to the view with which the scene was opened; focus and aperture stay.
    Home,
    /// Keep the direction, move the camera so that the selection just fits into the image, or else the whole scene
    /// except for distant outliers, and focus on the centre.
    FrameAll,
    /// Set the pose of the camera.
    SetView(View),
    /// Set the field of view.
    SetProjection(Projection),
    /// Set aperture and focus.
    SetLens(Lens),
    /// Put the pivot at the depth of the middle of the selection, or else of the scene if the camera is outside of it.
    PivotOnMiddle,
    /// Put the pivot at the depth of the surface at this position in the image.
    PivotAt {
        /// Fraction of the width of the image, from the left.
        x: f64,
        /// Fraction of its height, from the top.
        y: f64,
    },
    /// Multiply the distance of the focal plane; positive.
    ScaleFocus {
        /// Above 1 moves the focal plane away.
        factor: f64,
    },
    /// Set the focus distance: metres along the view axis, positive, may be infinite.
    SetFocus {
        /// Focus distance in metres.
        distance: f64,
    },
    /// Focus on the surface at this position in the image.
    FocusAt {
        /// Fraction of the width of the image, from the left.
        x: f64,
        /// Fraction of its height, from the top.
        y: f64,
    },
    /// Multiply the radius of the aperture; switches depth of field on.
    ScaleAperture {
        /// Above 1 blurs more.
        factor: f64,
    },
    /// Set the radius of the aperture in metres, at least 0; switches depth of field on.
    SetAperture {
        /// Radius of the aperture in metres.
        radius: f64,
    },
    /// Switch depth of field on or off.
    ToggleDepthOfField,
    /// Add to the exposure, in stops.
    AdjustExposure {
        /// Positive for a brighter image.
        stops: f32,
    },
    /// Set the exposure, in stops.
    SetExposure {
        /// 0 for unscaled radiance; positive for a brighter image.
        stops: f32,
    },
    /// Set the tone curve.
    SetToneCurve(ToneCurve),
    /// Set the next tone curve of the list, cyclically.
    NextToneCurve,
    /// Set the image size. A size without pixels (a minimised window) keeps the film and pauses.
    Resize {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
    },
    /// Stop rendering until [`Command::Resume`]; changes are still displayed.
    Pause,
    /// End a pause.
    Resume,
    /// Discard all samples and restart.
    Restart,
    /// Set the integrator.
    SetIntegrator(Integrator),
    /// Set the sample allocation.
    SetAllocation(SampleAllocation),
    /// Set the number of worker threads.
    SetThreads {
        /// Number of threads; 0 for one per processor.
        threads: usize,
    },
    /// Save the scene as a scene file; replaces an existing file.
    SaveScene {
        /// The file to write.
        #[serde(with = "crate::scene::path_text")]
        path: PathBuf,
    },
    /// Show the animation at another time.
    SetMoment {
        /// Time in seconds; `None` for the stored pose of a glTF model.
        seconds: Option<f64>,
    },
    /// Advance the time of the animation, from the end of what plays on at its start. It is shown at whole frames; the rest
    /// of the time counts for the next one.
    AdvanceMoment {
        /// Seconds.
        seconds: f64,
    },
    /// Set which part of the animation plays.
    SetPlayRange {
        /// From when, until when; `None` for all of it.
        seconds: Option<[f64; 2]>,
    },
    /// Set when to stop.
    SetTarget(Target),
    /// Report that the image is not visible: rendering stops without being paused.
    SetWindowHidden {
        /// Whether the image is not visible.
        hidden: bool,
    },
    /// Set what is displayed in place of the image, see [`Inspection`].
    SetInspection(Inspection),
    /// Displays the image raw, denoised, or half and half.
    SetDenoising(Denoising),
    /// Sets the filter of denoised images.
    SetDenoiseFilter(DenoiseFilter),
    /// The next of denoised, raw and split; no inspection is displayed then.
    NextDenoising,
    /// Tint the pixels in focus, and draw the focal plane.
    SetSharpZone {
        /// Whether they are displayed.
        shown: bool,
    },
    /// Explain the pixel at this position in the image.
    ExplainAt {
        /// Fraction of the width of the image, from the left.
        x: f64,
        /// Fraction of its height, from the top.
        y: f64,
    },
    /// Remove the explanation of [`Command::ExplainAt`].
    ForgetExplanation,
    /// Give all samples to a region of the image, or to all of it again.
    SetRegion {
        /// Left, top, right and bottom as fractions of the image; `None` for all of it.
        region: Option<[f64; 4]>,
    },
    /// Lock the focal plane to the point that was focused on last, or to the camera again.
    ToggleFocusLock,
    /// Focus on whatever is at this position in the image, continuously.
    FocusFollows {
        /// Fraction of the width of the image, from the left.
        x: f64,
        /// Fraction of its height, from the top.
        y: f64,
    },
    /// Store the view under a number from 1 to 9.
    SetBookmark {
        /// From 1 to 9.
        slot: u8,
    },
    /// Set the camera to the view stored under a number from 1 to 9.
    GoToBookmark {
        /// From 1 to 9.
        slot: u8,
    },
    /// Replace all bookmarks.
    SetBookmarks(Box<Bookmarks>),
    /// Return to the previous position at which the camera rested.
    PreviousView,
    /// Return to the view before [`Command::PreviousView`].
    NextView,
    /// Look through the next camera of the scene, in the order of the file.
    NextCamera,
    /// Look through the previous camera of the scene.
    PreviousCamera,
    /// Edit the scene.
    Edit(Edit),
    /// Open a scene file, a model or, if there is no such file, the built-in scene of that name.
    Open {
        /// The file, or the name of a built-in scene.
        #[serde(with = "crate::scene::path_text")]
        path: PathBuf,
    },
}

impl Command {
    /// Checks the values against the limits of scene files. Amounts of camera motion need no check, since invalid ones
    /// have no effect.
    ///
    /// # Errors
    /// If a value is out of range.
    pub fn check(&self) -> Result<(), BadValue> {
        match self {
            Self::SetView(view) => view.check(),
            Self::SetProjection(projection) => projection.check(),
            Self::SetLens(lens) => lens.check(),
            Self::SetBookmarks(bookmarks) => bookmarks.0.iter().flatten().try_for_each(Rig::check),
            // A size of zero is a minimised window.
            Self::Resize { width, height } => check_film_size((*width).max(1), (*height).max(1)),
            Self::SetTarget(target) => target.check(),
            Self::SetMoment { seconds: Some(seconds) } | Self::AdvanceMoment { seconds } if !seconds.is_finite() => {
                let allowed = "be a finite number of seconds".to_owned();
                Err(BadValue::OutOfRange { field: "at", value: seconds.to_string(), allowed })
            }
            Self::SetPlayRange { seconds: Some([from, until]) }
                if !(0.0 <= *from && from < until && until.is_finite()) =>
            {
                let allowed = "begin at 0 s or later, and end after that".to_owned();
                Err(BadValue::OutOfRange { field: "range", value: format!("{from} to {until}"), allowed })
            }
            _ => Ok(()),
        }
    }
}
