//! The section `animation` of a scene file.

use crate::camera::CameraPart;
use crate::defaults::is_default;
use crate::key::{Interpolation, Key, KeyValue};
use crate::material_property::MaterialProperty;
use crate::property::{CameraProperty, LightProperty, ObjectProperty};
use glam::DVec3;
use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;

/// Keys over time for properties of the scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AnimationPart {
    /// Time that is shown when the scene is opened, seconds.
    #[serde(default, skip_serializing_if = "is_default")]
    pub at: f64,
    /// Frames per second: frame i is at i / fps.
    #[serde(default = "default_fps")]
    pub fps: f64,
    /// Seconds from the first frame to the end; `None`: up to the last key.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub duration: Option<f64>,
    /// Exposure time as a fraction of the frame duration, centred at the time of the image.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shutter: Option<f64>,
    /// Exposure time in seconds, instead of `shutter`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shutter_seconds: Option<f64>,
    /// One per animated property.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tracks: Vec<TrackPart>,
    /// What moves as a glTF file says; a track of the same property takes its place.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model: Option<ModelMotionPart>,
    /// What is not as its tracks say at `at`.
    #[serde(default, skip_serializing_if = "is_default")]
    pub edited: EditedPart,
}

impl Default for AnimationPart {
    fn default() -> Self {
        Self {
            at: 0.0,
            fps: default_fps(),
            duration: None,
            shutter: None,
            shutter_seconds: None,
            tracks: Vec::new(),
            model: None,
            edited: EditedPart::default(),
        }
    }
}

/// What the animations of a glTF file move.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelMotionPart {
    /// Path of the file, relative to the scene file.
    pub file: String,
    /// Unique names of objects, each with the number of its mesh among those that the file places, from 0.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub objects: Vec<(String, usize)>,
    /// Unique names of lights, each with the number of its light among those that the file places, from 0.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lights: Vec<(String, usize)>,
    /// Number of the camera of the file that the camera of the scene follows, from 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<usize>,
}

/// What is shown as it is stated, not as its tracks say, until another time is shown. It stands still during the exposure.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct EditedPart {
    /// The camera that is shown; the tracks move the one of the scene.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub camera: Option<CameraPart>,
    /// Names of objects.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub objects: Vec<String>,
    /// Names of lights.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub lights: Vec<String>,
    /// Names of materials.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub materials: Vec<String>,
}

/// A property over time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum TrackPart {
    /// Of the camera.
    Camera {
        /// A property of `camera`.
        property: CameraProperty,
        /// Interpolation between the keys.
        #[serde(default, skip_serializing_if = "is_default")]
        interpolation: Interpolation,
        /// Pairs of a time in seconds and a value, in ascending order.
        keys: Vec<Key>,
    },
    /// Of an object.
    Object {
        /// Unique name of the object.
        name: String,
        /// A property of a transform.
        property: ObjectProperty,
        /// Interpolation between the keys.
        #[serde(default, skip_serializing_if = "is_default")]
        interpolation: Interpolation,
        /// Pairs of a time in seconds and a value, in ascending order.
        keys: Vec<Key>,
    },
    /// Of a light that is not an object.
    Light {
        /// Unique name of the light.
        name: String,
        /// A property of the light.
        property: LightProperty,
        /// Interpolation between the keys.
        #[serde(default, skip_serializing_if = "is_default")]
        interpolation: Interpolation,
        /// Pairs of a time in seconds and a value, in ascending order.
        keys: Vec<Key>,
    },
    /// Of a material.
    Material {
        /// Name of the material.
        name: String,
        /// A property of the material.
        property: MaterialProperty,
        /// Interpolation between the keys.
        #[serde(default, skip_serializing_if = "is_default")]
        interpolation: Interpolation,
        /// Pairs of a time in seconds and a value, in ascending order.
        keys: Vec<Key>,
    },
}

impl TrackPart {
    /// Its keys, in the order of the file.
    pub fn keys(&self) -> &[Key] {
        match self {
            Self::Camera { keys, .. }
            | Self::Object { keys, .. }
            | Self::Light { keys, .. }
            | Self::Material { keys, .. } => keys,
        }
    }

    /// Interpolation between the keys.
    pub fn interpolation(&self) -> Interpolation {
        match self {
            Self::Camera { interpolation, .. }
            | Self::Object { interpolation, .. }
            | Self::Light { interpolation, .. }
            | Self::Material { interpolation, .. } => *interpolation,
        }
    }
}

impl<'de> Deserialize<'de> for KeyValue {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NumberOrThree;
        impl<'de> Visitor<'de> for NumberOrThree {
            type Value = KeyValue;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a number or (x, y, z)")
            }

            fn visit_f64<E>(self, value: f64) -> Result<KeyValue, E> {
                Ok(KeyValue::Number(value))
            }

            fn visit_i64<E>(self, value: i64) -> Result<KeyValue, E> {
                Ok(KeyValue::Number(value as f64))
            }

            fn visit_u64<E>(self, value: u64) -> Result<KeyValue, E> {
                Ok(KeyValue::Number(value as f64))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<KeyValue, A::Error> {
                let mut three = [0.0; 3];
                for (i, number) in three.iter_mut().enumerate() {
                    *number = seq.next_element()?.ok_or_else(|| A::Error::invalid_length(i, &self))?;
                }
                match seq.next_element::<f64>()? {
                    Some(_) => Err(A::Error::invalid_length(4, &self)),
                    None => Ok(KeyValue::Three(DVec3::from_array(three))),
                }
            }
        }
        deserializer.deserialize_any(NumberOrThree)
    }
}

impl Serialize for KeyValue {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Number(number) => serializer.serialize_f64(*number),
            Self::Three(three) => three.serialize(serializer),
        }
    }
}

fn default_fps() -> f64 {
    24.0
}
