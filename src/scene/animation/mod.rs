//! Scenes that move: keys in time for camera, objects, lights and materials, and what they say at a moment.
//!
//! The tracks of a world are its resource [`Animation`]; the moment that it shows is the resource [`Moment`]. What is
//! seen at a moment is a pure function of both: [`Animation::inputs_at`] leaves the world alone, and [`show_moment`]
//! changes those components of the world that are different then, and no others.
//!
//! [`Curve`] has the formulas, [`Channel`] lists what may have one.

mod described;
mod key;
mod moment;
mod property;
mod set;
mod written;

pub(super) use described::Moved;
pub use key::{Curve, Interpolation, Key, KeyValue};
pub use moment::{Moment, show_moment};
pub(super) use moment::{place, rest_camera};
pub use property::{CameraProperty, LightProperty, MaterialProperty, ObjectProperty, Quantity};
pub(super) use written::{Entities, of_part};

use super::file::CameraPart;
use bevy_ecs::prelude::{Entity, Resource};
use std::ops::RangeInclusive;

/// What moves in a scene, and how its frames follow each other.
#[derive(Resource, Clone, Debug, PartialEq)]
pub struct Animation {
    /// Frames per second: frame i is at i / fps.
    pub fps: f64,
    /// Seconds from the first frame to the end; up to the last key when not given.
    pub duration: Option<f64>,
    /// How long the shutter is open.
    pub shutter: Shutter,
    /// What of the camera has no keys, as a scene file says it.
    pub camera: CameraPart,
    /// No two of the same property.
    pub tracks: Vec<Track>,
}

/// How long the shutter is open: half of it before the moment of the image, and half after it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shutter {
    /// Share of the time of a frame, 0..1.
    Share(f64),
    /// Seconds.
    Seconds(f64),
}

impl Default for Shutter {
    /// Not at all: everything stands still in an image.
    fn default() -> Self {
        Self::Share(0.0)
    }
}

/// A property and its values in time.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    /// What changes.
    pub channel: Channel,
    /// Its values.
    pub curve: Curve,
}

/// A property of something in the world.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Channel {
    /// Of the first camera.
    Camera(CameraProperty),
    /// Of an object.
    Object(Entity, ObjectProperty),
    /// Of a light that is no object.
    Light(Entity, LightProperty),
    /// Of a material.
    Material(Entity, MaterialProperty),
}

impl Channel {
    /// What its keys hold.
    pub fn quantity(self) -> Quantity {
        match self {
            Self::Camera(property) => property.quantity(),
            Self::Object(_, property) => property.quantity(),
            Self::Light(_, property) => property.quantity(),
            Self::Material(_, property) => property.quantity(),
        }
    }
}

impl Channel {
    /// Its property as in a scene file.
    pub fn property(self) -> &'static str {
        match self {
            Self::Camera(property) => property.name(),
            Self::Object(_, property) => property.name(),
            Self::Light(_, property) => property.name(),
            Self::Material(_, property) => property.name(),
        }
    }
}

impl Track {
    /// The value at a time; a number is repeated three times.
    pub fn at(&self, seconds: f64) -> glam::DVec3 {
        self.curve.at(self.channel.quantity(), seconds)
    }
}

impl Animation {
    /// Seconds from the first frame to the end.
    pub fn length(&self) -> f64 {
        let ends = self.tracks.iter().filter_map(|track| track.curve.keys.last().map(|&(time, _)| time));
        self.duration.unwrap_or_else(|| ends.fold(0.0, f64::max))
    }

    /// Seconds at which a frame is.
    pub fn moment_of(&self, frame: u32) -> f64 {
        f64::from(frame) / self.fps
    }

    /// Frames from the first one up to the end; one at least.
    pub fn n_frames(&self) -> u32 {
        // What rounding adds to a whole number is no frame.
        (self.length() * self.fps - 1e-6).ceil().clamp(1.0, f64::from(u32::MAX)) as u32
    }

    /// When the shutter is open for the image of a moment, seconds; `None` when it has no length, or when nothing moves
    /// in the meantime.
    pub fn open_shutter(&self, seconds: f64) -> Option<RangeInclusive<f64>> {
        let length = match self.shutter {
            Shutter::Share(share) => share / self.fps,
            Shutter::Seconds(length) => length,
        };
        let open = seconds - 0.5 * length..=seconds + 0.5 * length;
        (length > 0.0 && self.is_moving_during(open.clone())).then_some(open)
    }

    /// Whether anything may look different at two moments of these seconds. In doubt yes, never no.
    pub fn is_moving_during(&self, seconds: RangeInclusive<f64>) -> bool {
        self.tracks.iter().any(|track| track.curve.is_moving_during(&seconds))
    }
}
