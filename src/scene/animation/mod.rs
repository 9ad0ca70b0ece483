//! Animation of scenes: keys over time for camera, objects, lights and materials.
//!
//! The tracks of a world are its resource [`Animation`]; its current time is the resource [`Moment`]. The state at a
//! time is a pure function of both: [`Animation::inputs_at`] computes it without changing the world, and
//! [`show_moment`] changes only those components of the world that differ.
//!
//! [`Curve`] implements the interpolation, [`Channel`] lists the properties that can be animated, and [`set_keys`] turns
//! the state of a world into keys.

pub(crate) mod described;
pub(crate) mod edited;
pub(crate) mod keying;
pub(crate) mod model;
pub(crate) mod moment;
pub(crate) mod written;

pub use crate::format::key::{Curve, Interpolation, Key, KeyValue};
pub use crate::format::property::{CameraProperty, LightProperty, ObjectProperty, PropertyInfo};
pub use crate::format::quantity::Quantity;
pub use keying::{KeysOf, animation_or_new, delete_keys, follow_tracks, set_keys};
pub(super) use model::ModelMotion;
pub use moment::{Moment, camera_follows, off_their_tracks, show_moment, show_moment_from_here};

use crate::format::camera::CameraPart;
use crate::format::material_property::MaterialProperty;
use bevy_ecs::prelude::{Entity, Resource};
use std::ops::RangeInclusive;

/// The animation of a scene and its frame rate.
#[derive(Resource, Clone, Debug, PartialEq)]
pub struct Animation {
    /// Frames per second: frame i is at i / fps.
    pub fps: f64,
    /// Seconds from the first frame to the end; `None`: up to the last key.
    pub duration: Option<f64>,
    /// Exposure time.
    pub shutter: Shutter,
    /// The camera as in the scene file, for the properties without tracks.
    pub camera: CameraPart,
    /// At most one per property.
    pub tracks: Vec<Track>,
    /// Animations of the glTF file that the scene was made from.
    pub(in crate::scene) model: Option<ModelMotion>,
}

/// Exposure time, centred at the time of the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shutter {
    /// Fraction of the frame duration, 0..1.
    Share(f64),
    /// Seconds.
    Seconds(f64),
}

impl Default for Shutter {
    /// 0: no motion blur.
    fn default() -> Self {
        Self::Share(0.0)
    }
}

/// A property and its values over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    /// The property.
    pub channel: Channel,
    /// Its values.
    pub curve: Curve,
}

/// A property of an entity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Channel {
    /// Of the first camera.
    Camera(CameraProperty),
    /// Of an object.
    Object(Entity, ObjectProperty),
    /// Of a light that is not an object.
    Light(Entity, LightProperty),
    /// Of a material.
    Material(Entity, MaterialProperty),
}

impl Channel {
    /// The type of its values.
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
    /// The object, light or material; `None` for the camera.
    pub fn entity(self) -> Option<Entity> {
        match self {
            Self::Camera(_) => None,
            Self::Object(entity, _) | Self::Light(entity, _) | Self::Material(entity, _) => Some(entity),
        }
    }

    /// Name of the property in scene files.
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
    /// The value at a time; a single number is returned three times.
    pub fn at(&self, seconds: f64) -> glam::DVec3 {
        self.curve.at(self.channel.quantity(), seconds)
    }
}

impl Animation {
    /// Whether anything changes in time.
    pub fn moves(&self) -> bool {
        !self.tracks.is_empty() || self.model.is_some()
    }

    /// Whether what a channel moves moves as a glTF file says, without a track of its own.
    pub fn follows_model(&self, channel: Channel) -> bool {
        let Some(model) = &self.model else { return false };
        match channel {
            Channel::Camera(_) => model.moves_camera() && !self.has_camera_track(),
            Channel::Object(entity, _) | Channel::Light(entity, _) => {
                let has_track = self.tracks.iter().any(|track| track.channel.entity() == Some(entity));
                !has_track && model.moved().any(|moved| moved == entity)
            }
            Channel::Material(..) => false,
        }
    }

    /// Whether it moves as a glTF file says.
    pub fn has_model(&self) -> bool {
        self.model.is_some()
    }

    /// Seconds from the first frame to the end.
    pub fn length(&self) -> f64 {
        let ends = self.tracks.iter().filter_map(|track| track.curve.keys.last().map(|&(time, _)| time));
        let model = self.model.as_ref().map_or(0.0, ModelMotion::length);
        self.duration.unwrap_or_else(|| ends.fold(model, f64::max))
    }

    /// Number of frames, at least 1: those before the end of the duration, or those up to the last key with its own.
    pub fn n_frames(&self) -> u32 {
        match self.duration {
            // Tolerance for rounding of a whole number of frames.
            Some(duration) => (duration * self.fps - 1e-6).ceil().clamp(1.0, f64::from(u32::MAX)) as u32,
            None => Self::frames_to_key(self.length(), self.fps),
        }
    }

    /// Whether a key beyond the last one makes it longer.
    pub fn can_grow(&self) -> bool {
        self.duration.is_none() && self.model.is_none()
    }

    /// Number of frames from 0 s to that of a key at this time, seconds.
    pub fn frames_to_key(last: f64, fps: f64) -> u32 {
        (last * fps + 1e-6).floor().clamp(0.0, f64::from(u32::MAX - 1)) as u32 + 1
    }

    /// The exposure interval of an image at this time, seconds; `None` if its length is 0 or nothing moves in it.
    pub fn open_shutter(&self, seconds: f64) -> Option<RangeInclusive<f64>> {
        let length = match self.shutter {
            Shutter::Share(share) => share / self.fps,
            Shutter::Seconds(length) => length,
        };
        let open = seconds - 0.5 * length..=seconds + 0.5 * length;
        (length > 0.0 && self.is_moving_during(open.clone())).then_some(open)
    }

    /// Whether anything may change within this range of seconds; never false if something does.
    pub fn is_moving_during(&self, seconds: RangeInclusive<f64>) -> bool {
        let by_model = self.model.as_ref().is_some_and(|model| model.is_moving_during(&seconds));
        by_model || self.tracks.iter().any(|track| track.curve.is_moving_during(&seconds))
    }
}
