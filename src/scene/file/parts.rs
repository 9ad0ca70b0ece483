//! The parts of a scene file, as written. Meaning and limits are checked in `check`.

use crate::render::{Display, Integrator, Material, Params, PixelFilter, ToneCurve};
use crate::scene::sources::{EnvironmentSource, MeshShading, MeshSource, TextureSource};
use crate::scene::value::{ColorValue, Named, Rgb, ScalarValue};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Everything that a scene file says. Only `camera` must be given.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneFile {
    /// From where the scene is seen, and through which lens.
    pub camera: CameraPart,
    /// Further views, by name, to choose from; `camera` is the one that is looked through.
    #[serde(default, skip_serializing_if = "Named::is_empty")]
    pub cameras: Named<CameraPart>,
    /// Size and pixel filter.
    #[serde(default)]
    pub film: FilmPart,
    /// The light model.
    #[serde(default)]
    pub integrator: Integrator,
    /// Longest path in segments; 1 shows emitters alone; unbounded when not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_depth: Option<u32>,
    /// Exposure and tone curve.
    #[serde(default)]
    pub display: DisplayPart,
    /// Light from infinitely far away.
    #[serde(default)]
    pub environment: EnvironmentSource,
    /// What the air absorbs, per metre. Light from the environment has passed it already.
    #[serde(default, skip_serializing_if = "is_default")]
    pub air: Rgb,
    /// Textures that materials use, by name.
    #[serde(default, skip_serializing_if = "Named::is_empty")]
    pub textures: Named<TextureSource>,
    /// Materials that objects use, by name.
    #[serde(default, skip_serializing_if = "Named::is_empty")]
    pub materials: Named<MaterialPart>,
    /// Objects, in the order in which they come to be spawned.
    #[serde(default)]
    pub objects: Vec<ObjectPart>,
    /// Lights that are no objects; everything else that emits is an object with an emissive material.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lights: Vec<LightPart>,
}

/// A thin-lens camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraPart {
    /// Centre of the lens, metres.
    pub eye: DVec3,
    /// What is in the middle of the picture, and what orbiting turns about.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub look_at: Option<DVec3>,
    /// In place of `look_at`: the direction of the view. A unit vector is taken as it is, to the last bit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub forward: Option<DVec3>,
    /// With `forward`: metres from the camera to what orbiting turns about; 1 when not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pivot_distance: Option<f64>,
    /// What is up in the picture; +Y when not given.
    #[serde(default = "default_up")]
    pub up: DVec3,
    /// Vertical field of view in perspective, degrees.
    #[serde(default = "default_vfov")]
    pub vfov: f64,
    /// Height of what an orthographic camera sees, metres; in perspective when not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub orthographic_height: Option<f64>,
    /// Metres; a pinhole when neither this nor `f_stop` is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lens_radius: Option<f64>,
    /// Focal length over aperture diameter, for a film 24 mm high.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub f_stop: Option<f64>,
    /// Metres from the camera to the focal plane along the view axis; the distance of `look_at` when not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub focus_distance: Option<f64>,
    /// Whether the lens blurs; when not given, it does if it has a radius.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub depth_of_field: Option<bool>,
    /// Straight edges of the aperture; below 3 it is round.
    #[serde(default, skip_serializing_if = "is_default")]
    pub blades: u32,
    /// Degrees.
    #[serde(default, skip_serializing_if = "is_default")]
    pub blade_rotation: f64,
}

impl CameraPart {
    /// A pinhole that looks at a point, with defaults for all the rest.
    pub fn looking_at(eye: DVec3, look_at: DVec3) -> Self {
        Self {
            eye,
            look_at: Some(look_at),
            forward: None,
            pivot_distance: None,
            up: default_up(),
            vfov: default_vfov(),
            orthographic_height: None,
            lens_radius: None,
            f_stop: None,
            focus_distance: None,
            depth_of_field: None,
            blades: 0,
            blade_rotation: 0.0,
        }
    }
}

/// Size of the picture and the weights within a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FilmPart {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Weights of the light around the middle of a pixel.
    #[serde(default, skip_serializing_if = "is_default")]
    pub filter: PixelFilter,
}

impl Default for FilmPart {
    fn default() -> Self {
        Self { width: 1280, height: 720, filter: PixelFilter::default() }
    }
}

/// How the picture is shown; no sample depends on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DisplayPart {
    /// Factors of two.
    pub exposure: f32,
    /// How bright light is brought into the range of the display.
    pub tone_curve: ToneCurve,
}

impl From<DisplayPart> for Display {
    fn from(part: DisplayPart) -> Self {
        Self { exposure_stops: part.exposure, tone_curve: part.tone_curve }
    }
}

impl From<Display> for DisplayPart {
    fn from(display: Display) -> Self {
        Self { exposure: display.exposure_stops, tone_curve: display.tone_curve }
    }
}

/// By name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InFile;

impl Params for InFile {
    type Color = ColorValue;
    type Scalar = ScalarValue;
    type Rgb = Rgb;
    type Material = String;
}

/// A material as a scene file writes it.
pub type MaterialPart = Material<InFile>;

/// An object and its place, metres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum ObjectPart {
    /// A sphere.
    Sphere {
        /// Its name in lists and reports.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        /// Centre; the origin when not given.
        #[serde(default, skip_serializing_if = "is_default")]
        center: DVec3,
        /// Radius, positive.
        radius: f64,
        /// Its material, by name.
        material: String,
        /// From these coordinates to the world.
        #[serde(default, skip_serializing_if = "is_default")]
        transform: TransformPart,
    },
    /// Infinite.
    Plane {
        /// Its name in lists and reports.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        /// A point of the plane; the origin when not given.
        #[serde(default, skip_serializing_if = "is_default")]
        point: DVec3,
        /// Direction of the front; +Y when not given.
        #[serde(default = "default_up")]
        normal: DVec3,
        /// Its material, by name.
        material: String,
        /// From these coordinates to the world.
        #[serde(default, skip_serializing_if = "is_default")]
        transform: TransformPart,
    },
    /// A parallelogram; its front looks along `edge_u` × `edge_v`.
    Quad {
        /// Its name in lists and reports.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        /// The corner at `u = v = 0`; the origin when not given.
        #[serde(default, skip_serializing_if = "is_default")]
        corner: DVec3,
        /// From the corner to the one at `u = 1`.
        edge_u: DVec3,
        /// From the corner to the one at `v = 1`.
        edge_v: DVec3,
        /// Its material, by name.
        material: String,
        /// From these coordinates to the world.
        #[serde(default, skip_serializing_if = "is_default")]
        transform: TransformPart,
    },
    /// A single triangle; its front is where its vertices run counter-clockwise.
    Triangle {
        /// Its name in lists and reports.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        /// The corners.
        vertices: [DVec3; 3],
        /// Its material, by name.
        material: String,
        /// From these coordinates to the world.
        #[serde(default, skip_serializing_if = "is_default")]
        transform: TransformPart,
    },
    /// A triangle mesh.
    Mesh {
        /// Its name in lists and reports.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        /// Where the triangles come from.
        source: MeshSource,
        /// How normals between vertices are found.
        #[serde(default, skip_serializing_if = "is_default")]
        shading: MeshShading,
        /// Share of the faces to keep, 0..1.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        simplify: Option<f64>,
        /// For every slot; without it the materials of the file (MTL) are used.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        material: Option<String>,
        /// One for each slot, in place of `material`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        materials: Option<Vec<String>>,
        /// From these coordinates to the world.
        #[serde(default, skip_serializing_if = "is_default")]
        transform: TransformPart,
    },
    /// Spheres of one material in rows, layers or blocks: one at `first`, then by each step in turn that many times.
    BallGrid {
        /// Its name in lists and reports.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        /// Centre of the first sphere; the origin when not given.
        #[serde(default, skip_serializing_if = "is_default")]
        first: DVec3,
        /// Up to three pairs: how many spheres in a row, and the way from each to the next.
        steps: Vec<(u32, DVec3)>,
        /// Radius of each sphere, positive.
        radius: f64,
        /// Its material, by name.
        material: String,
        /// From these coordinates to the world.
        #[serde(default, skip_serializing_if = "is_default")]
        transform: TransformPart,
    },
    /// Many spheres, one material.
    Spheres {
        /// Its name in lists and reports.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        /// Centre of each sphere.
        centers: Vec<DVec3>,
        /// Radius of the spheres.
        radii: RadiiPart,
        /// Its material, by name.
        material: String,
        /// From these coordinates to the world.
        #[serde(default, skip_serializing_if = "is_default")]
        transform: TransformPart,
    },
}

impl ObjectPart {
    /// Its name, if it has one.
    pub fn name(&self) -> Option<&str> {
        match self {
            Self::Sphere { name, .. }
            | Self::Plane { name, .. }
            | Self::Quad { name, .. }
            | Self::Triangle { name, .. }
            | Self::Mesh { name, .. }
            | Self::BallGrid { name, .. }
            | Self::Spheres { name, .. } => name.as_deref(),
        }
    }

    /// The name of its material; `None` for a mesh without one for all slots.
    pub fn material(&self) -> Option<&str> {
        match self {
            Self::Sphere { material, .. }
            | Self::Plane { material, .. }
            | Self::Quad { material, .. }
            | Self::Triangle { material, .. }
            | Self::BallGrid { material, .. }
            | Self::Spheres { material, .. } => Some(material),
            Self::Mesh { material, .. } => material.as_deref(),
        }
    }

    /// Of a mesh that names one material for each slot.
    pub fn slot_materials(&self) -> Option<&[String]> {
        match self {
            Self::Mesh { materials, .. } => materials.as_deref(),
            _ => None,
        }
    }

    /// From its coordinates to the world.
    pub fn transform(&self) -> &TransformPart {
        match self {
            Self::Sphere { transform, .. }
            | Self::Plane { transform, .. }
            | Self::Quad { transform, .. }
            | Self::Triangle { transform, .. }
            | Self::Mesh { transform, .. }
            | Self::BallGrid { transform, .. }
            | Self::Spheres { transform, .. } => transform,
        }
    }
}

/// The centres of a [`ObjectPart::BallGrid`].
pub fn ball_grid(first: DVec3, steps: &[(u32, DVec3)]) -> Vec<DVec3> {
    steps.iter().fold(vec![first], |centers, &(count, step)| {
        let row = |center: DVec3| (0..count).map(move |i| center + f64::from(i) * step);
        centers.into_iter().flat_map(row).collect()
    })
}

/// One radius for all spheres or one for each.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RadiiPart {
    /// The same radius for all, metres.
    All(f64),
    /// The radius of each, metres, in the order of the centres.
    Each(Vec<f64>),
}

/// From the object's own space to the world: scale, then rotate, then translate; or a matrix.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TransformPart {
    /// Metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub translate: Option<DVec3>,
    /// Degrees about X, then Y, then Z, the axes standing still.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotate: Option<DVec3>,
    /// Factors along the axes of the object; negative ones mirror.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scale: Option<ScalePart>,
    /// Three rows of four: the last column translates.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub matrix: Option<[[f64; 4]; 3]>,
}

/// One factor or one an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScalePart(pub DVec3);

/// A light that is no object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum LightPart {
    /// A small glowing sphere, or a point, that shines evenly into all directions.
    Point {
        /// Its name in lists and reports.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        /// Centre of the light, metres.
        position: DVec3,
        /// Radiant intensity, W·sr⁻¹.
        intensity: Rgb,
        /// Metres; shadows are as soft as the sphere is large. With 0 it is a point, which no camera sees.
        #[serde(default = "default_light_radius")]
        radius: f64,
    },
    /// A point that shines into a cone.
    Spot {
        /// Its name in lists and reports.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        /// The tip of the cone; the origin when not given.
        #[serde(default, skip_serializing_if = "is_default")]
        position: DVec3,
        /// Along the axis of the cone, away from its tip; any length but 0.
        direction: DVec3,
        /// Radiant intensity within the inner cone, W·sr⁻¹.
        intensity: Rgb,
        /// Degrees from the axis; the intensity falls off from here on.
        #[serde(default, skip_serializing_if = "is_default")]
        inner_angle: f64,
        /// Degrees from the axis, up to 90; no light beyond.
        #[serde(default = "default_outer_angle")]
        outer_angle: f64,
        /// From these coordinates to the world; scale leaves the intensity as it is.
        #[serde(default, skip_serializing_if = "is_default")]
        transform: TransformPart,
    },
    /// Parallel light from infinitely far away.
    Directional {
        /// Its name in lists and reports.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        /// Where the light goes; any length but 0.
        direction: DVec3,
        /// On a surface that faces the light, W·m⁻².
        irradiance: Rgb,
        /// From these coordinates to the world; only its rotation counts.
        #[serde(default, skip_serializing_if = "is_default")]
        transform: TransformPart,
    },
}

impl LightPart {
    /// Its name, if it has one.
    pub fn name(&self) -> Option<&str> {
        match self {
            Self::Point { name, .. } | Self::Spot { name, .. } | Self::Directional { name, .. } => name.as_deref(),
        }
    }
}

impl<'de> Deserialize<'de> for ScalePart {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NumberOrThree;
        impl<'de> serde::de::Visitor<'de> for NumberOrThree {
            type Value = DVec3;

            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("a factor or (x, y, z)")
            }

            fn visit_f64<E>(self, value: f64) -> Result<DVec3, E> {
                Ok(DVec3::splat(value))
            }

            fn visit_i64<E>(self, value: i64) -> Result<DVec3, E> {
                Ok(DVec3::splat(value as f64))
            }

            fn visit_u64<E>(self, value: u64) -> Result<DVec3, E> {
                Ok(DVec3::splat(value as f64))
            }

            fn visit_seq<A: serde::de::SeqAccess<'de>>(self, mut seq: A) -> Result<DVec3, A::Error> {
                let mut next =
                    |i| seq.next_element::<f64>()?.ok_or_else(|| serde::de::Error::invalid_length(i, &"three factors"));
                Ok(DVec3::new(next(0)?, next(1)?, next(2)?))
            }
        }
        deserializer.deserialize_any(NumberOrThree).map(Self)
    }
}

impl Serialize for ScalePart {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let DVec3 { x, y, z } = self.0;
        if x == y && y == z { serializer.serialize_f64(x) } else { (x, y, z).serialize(serializer) }
    }
}

fn default_up() -> DVec3 {
    DVec3::Y
}

fn default_vfov() -> f64 {
    40.0
}

fn default_light_radius() -> f64 {
    0.01
}

fn default_outer_angle() -> f64 {
    45.0
}

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}
