//! The scene file as written: its parts by name.

use crate::animation::AnimationPart;
use crate::bounds::MAX_OBJECTS;
use crate::camera::CameraPart;
use crate::defaults::is_default;
use crate::parts::{FilmPart, LightPart, MaterialPart, ObjectPart};
use crate::sources::{EnvironmentSource, TextureSource};
use crate::value::{Named, Rgb, list_within};
use firstlight_render::{Display, Integrator};
use serde::{Deserialize, Serialize};

/// The contents of a scene file. Only `camera` is required.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneFile {
    /// The camera that is used.
    pub camera: CameraPart,
    /// Further cameras by name, which the user can select.
    #[serde(default, skip_serializing_if = "Named::is_empty")]
    pub cameras: Named<CameraPart>,
    /// Size and pixel filter.
    #[serde(default)]
    pub film: FilmPart,
    /// The integrator.
    #[serde(default)]
    pub integrator: Integrator,
    /// Maximum path length in segments; 1 shows emitters only; unlimited if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_depth: Option<u32>,
    /// Exposure and tone curve.
    #[serde(default)]
    pub display: Display,
    /// The environment: radiance from infinitely far away.
    #[serde(default)]
    pub environment: EnvironmentSource,
    /// Absorption of the air, per metre. It does not affect the environment.
    #[serde(default, skip_serializing_if = "is_default")]
    pub air: Rgb,
    /// Textures that materials use, by name.
    #[serde(default, skip_serializing_if = "Named::is_empty")]
    pub textures: Named<TextureSource>,
    /// Materials that objects use, by name.
    #[serde(default, skip_serializing_if = "Named::is_empty")]
    pub materials: Named<MaterialPart>,
    /// Objects, in the order in which they are spawned.
    #[serde(default, deserialize_with = "list_within::<_, _, { MAX_OBJECTS }>")]
    pub objects: Vec<ObjectPart>,
    /// Lights that are no objects; all other emitters are objects with an emissive material.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lights: Vec<LightPart>,
    /// The animation: keys over time for properties of the scene.
    #[serde(default, skip_serializing_if = "is_default")]
    pub animation: AnimationPart,
}

impl SceneFile {
    /// A scene without anything but a camera.
    pub fn new(camera: CameraPart) -> Self {
        Self {
            camera,
            cameras: Named::default(),
            film: FilmPart::default(),
            integrator: Integrator::default(),
            max_depth: None,
            display: Display::default(),
            environment: EnvironmentSource::default(),
            air: Rgb::default(),
            textures: Named::default(),
            materials: Named::default(),
            objects: Vec::new(),
            lights: Vec::new(),
            animation: AnimationPart::default(),
        }
    }
}
