//! The parts of a scene file, as written. Values and limits are checked in `check`.

use crate::defaults::{default_up, is_default};
use crate::key::KeyValue;
use crate::sources::{MeshOptions, MeshShading, MeshSource, TextureCoordinates};
use crate::value::{ColorValue, Rgb, ScalarValue};
use firstlight_render::{Falloff, Material, Params, PixelFilter};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Image size and reconstruction filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FilmPart {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Reconstruction filter.
    #[serde(default, skip_serializing_if = "is_default")]
    pub filter: PixelFilter,
}

impl Default for FilmPart {
    fn default() -> Self {
        Self { width: 1280, height: 720, filter: PixelFilter::default() }
    }
}

/// Parameter types of a scene file: references by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InFile;

impl Params for InFile {
    type Color = ColorValue;
    type Scalar = ScalarValue;
    type Rgb = Rgb;
    type Material = String;
}

/// A material as written in a scene file.
pub type MaterialPart = Material<InFile>;

/// An object with its geometry, metres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum ObjectPart {
    /// A sphere.
    Sphere {
        /// Its name in lists and reports.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        /// Whether it is left out of the image: not seen, and without light.
        #[serde(default, skip_serializing_if = "is_default")]
        hidden: bool,
        /// Centre; the origin when not given.
        #[serde(default, skip_serializing_if = "is_default")]
        center: DVec3,
        /// Radius, positive.
        radius: f64,
        /// Its material, by name.
        material: String,
        /// Object to world.
        #[serde(default, skip_serializing_if = "is_default")]
        transform: TransformPart,
    },
    /// An infinite plane.
    Plane {
        /// Its name in lists and reports.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        /// Whether it is left out of the image: not seen, and without light.
        #[serde(default, skip_serializing_if = "is_default")]
        hidden: bool,
        /// A point of the plane; the origin when not given.
        #[serde(default, skip_serializing_if = "is_default")]
        point: DVec3,
        /// Normal of the front side; +Y if not given.
        #[serde(default = "default_up")]
        normal: DVec3,
        /// Its material, by name.
        material: String,
        /// Object to world.
        #[serde(default, skip_serializing_if = "is_default")]
        transform: TransformPart,
    },
    /// A parallelogram; its front normal is `edge_u` × `edge_v`.
    Quad {
        /// Its name in lists and reports.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        /// Whether it is left out of the image: not seen, and without light.
        #[serde(default, skip_serializing_if = "is_default")]
        hidden: bool,
        /// The corner at `u = v = 0`; the origin when not given.
        #[serde(default, skip_serializing_if = "is_default")]
        corner: DVec3,
        /// Vector from the corner to the one at `u = 1`.
        edge_u: DVec3,
        /// Vector from the corner to the one at `v = 1`.
        edge_v: DVec3,
        /// Its material, by name.
        material: String,
        /// Object to world.
        #[serde(default, skip_serializing_if = "is_default")]
        transform: TransformPart,
    },
    /// A single triangle; its front is the side from which its vertices are counter-clockwise.
    Triangle {
        /// Its name in lists and reports.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        /// Whether it is left out of the image: not seen, and without light.
        #[serde(default, skip_serializing_if = "is_default")]
        hidden: bool,
        /// The vertices.
        vertices: [DVec3; 3],
        /// Its material, by name.
        material: String,
        /// Object to world.
        #[serde(default, skip_serializing_if = "is_default")]
        transform: TransformPart,
    },
    /// A triangle mesh.
    Mesh {
        /// Its name in lists and reports.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        /// Whether it is left out of the image: not seen, and without light.
        #[serde(default, skip_serializing_if = "is_default")]
        hidden: bool,
        /// Source of the triangles.
        source: MeshSource,
        /// How vertex normals are computed.
        #[serde(default, skip_serializing_if = "is_default")]
        shading: MeshShading,
        /// Where its texture coordinates come from.
        #[serde(default, skip_serializing_if = "is_default")]
        texture_coordinates: TextureCoordinates,
        /// Share of the faces to keep, (0, 1].
        #[serde(default, skip_serializing_if = "Option::is_none")]
        simplify: Option<f64>,
        /// Material of every slot; without it, the materials of the file (MTL) are used.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        material: Option<String>,
        /// Material per slot, in place of `material`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        materials: Option<Vec<String>>,
        /// Object to world.
        #[serde(default, skip_serializing_if = "is_default")]
        transform: TransformPart,
    },
    /// Spheres of one material in rows, layers or blocks: a sphere at `first`, repeated by each of the steps in turn.
    BallGrid {
        /// Its name in lists and reports.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        /// Whether it is left out of the image: not seen, and without light.
        #[serde(default, skip_serializing_if = "is_default")]
        hidden: bool,
        /// Centre of the first sphere; the origin when not given.
        #[serde(default, skip_serializing_if = "is_default")]
        first: DVec3,
        /// Up to three pairs: number of spheres, and vector from each to the next.
        steps: Vec<(u32, DVec3)>,
        /// Radius of each sphere, positive.
        radius: f64,
        /// Its material, by name.
        material: String,
        /// Object to world.
        #[serde(default, skip_serializing_if = "is_default")]
        transform: TransformPart,
    },
    /// Many spheres of one material.
    Spheres {
        /// Its name in lists and reports.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        /// Whether it is left out of the image: not seen, and without light.
        #[serde(default, skip_serializing_if = "is_default")]
        hidden: bool,
        /// Centre of each sphere.
        centers: Vec<DVec3>,
        /// Radius of the spheres.
        radii: RadiiPart,
        /// Its material, by name.
        material: String,
        /// Object to world.
        #[serde(default, skip_serializing_if = "is_default")]
        transform: TransformPart,
    },
}

impl ObjectPart {
    /// A mesh as it is in its source.
    ///
    /// - `material`, `materials`: of all slots, or per slot; without either, those of the file.
    pub fn mesh(
        name: Option<String>,
        source: MeshSource,
        material: Option<String>,
        materials: Option<Vec<String>>,
        transform: TransformPart,
    ) -> Self {
        let MeshOptions { shading, texture_coordinates, simplify } = MeshOptions::default();
        let hidden = false;
        Self::Mesh { name, hidden, source, shading, texture_coordinates, simplify, material, materials, transform }
    }

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

    /// Whether it is left out of the image.
    pub fn is_hidden(&self) -> bool {
        match self {
            Self::Sphere { hidden, .. }
            | Self::Plane { hidden, .. }
            | Self::Quad { hidden, .. }
            | Self::Triangle { hidden, .. }
            | Self::Mesh { hidden, .. }
            | Self::BallGrid { hidden, .. }
            | Self::Spheres { hidden, .. } => *hidden,
        }
    }

    /// Name of its material; `None` for a mesh without a common material.
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

    /// What is done with the mesh after it is read; `None` if it is no mesh.
    pub fn mesh_options(&self) -> Option<MeshOptions> {
        match *self {
            Self::Mesh { shading, texture_coordinates, simplify, .. } => {
                Some(MeshOptions { shading, texture_coordinates, simplify })
            }
            _ => None,
        }
    }

    /// Materials per slot of a mesh, if given.
    pub fn slot_materials(&self) -> Option<&[String]> {
        match self {
            Self::Mesh { materials, .. } => materials.as_deref(),
            _ => None,
        }
    }

    /// Object to world.
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

/// One radius for all spheres, or one per sphere.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RadiiPart {
    /// The same radius for all, metres.
    All(f64),
    /// The radius of each sphere, metres, in the order of the centres.
    Each(Vec<f64>),
}

/// Transform from object to world: scale, then rotate, then translate; or a matrix.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TransformPart {
    /// Translation, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub translate: Option<DVec3>,
    /// Rotation, degrees about X, then Y, then Z, about fixed axes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotate: Option<DVec3>,
    /// Scale factors along the axes of the object; negative ones mirror.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scale: Option<ScalePart>,
    /// The point of the object about which it is rotated and scaled; the origin when not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pivot: Option<DVec3>,
    /// Three rows of four numbers; the last column is the translation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub matrix: Option<[[f64; 4]; 3]>,
}

/// One factor, or one per axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScalePart(pub DVec3);

/// A light that is no object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum LightPart {
    /// A small sphere light, or a point light, that emits uniformly in all directions.
    Point {
        /// Its name in lists and reports.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        /// Whether it is left out of the image: not seen, and without light.
        #[serde(default, skip_serializing_if = "is_default")]
        hidden: bool,
        /// Centre of the light, metres.
        position: DVec3,
        /// Radiant intensity, W·sr⁻¹.
        intensity: Rgb,
        /// Radius in metres, which determines the softness of shadows. With 0 it is a point, which is invisible.
        #[serde(default = "default_light_radius")]
        radius: f64,
    },
    /// A point light that emits into a cone.
    Spot {
        /// Its name in lists and reports.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        /// Whether it is left out of the image: not seen, and without light.
        #[serde(default, skip_serializing_if = "is_default")]
        hidden: bool,
        /// The tip of the cone; the origin when not given.
        #[serde(default, skip_serializing_if = "is_default")]
        position: DVec3,
        /// Direction of the cone's axis; any length except 0.
        direction: DVec3,
        /// Radiant intensity within the inner cone, W·sr⁻¹.
        intensity: Rgb,
        /// Angle from the axis in degrees from which on the intensity falls off.
        #[serde(default, skip_serializing_if = "is_default")]
        inner_angle: f64,
        /// Angle from the axis in degrees, at most 90, beyond which there is no light.
        #[serde(default = "default_outer_angle")]
        outer_angle: f64,
        /// How it falls off between the two.
        #[serde(default, skip_serializing_if = "is_default")]
        falloff: Falloff,
        /// The texture whose image it projects.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        texture: Option<String>,
        /// Upwards in the image; any length except 0. Any direction if the light shines along it.
        #[serde(default = "default_up", skip_serializing_if = "is_up")]
        up: DVec3,
        /// Angle in degrees, below 180, that the image fills horizontally. With 0 it follows from the height and the
        /// proportions of the image; if both are 0 the image is a square around the cone.
        #[serde(default, skip_serializing_if = "is_default")]
        image_width: f64,
        /// The same vertically.
        #[serde(default, skip_serializing_if = "is_default")]
        image_height: f64,
        /// Whether a wall that faces the light is lit evenly, as by a projector.
        #[serde(default, skip_serializing_if = "is_default")]
        even: bool,
        /// Object to world; scaling does not affect the intensity.
        #[serde(default, skip_serializing_if = "is_default")]
        transform: TransformPart,
    },
    /// Parallel light from infinitely far away.
    Directional {
        /// Its name in lists and reports.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        /// Whether it is left out of the image: not seen, and without light.
        #[serde(default, skip_serializing_if = "is_default")]
        hidden: bool,
        /// Direction in which the light travels; any length except 0.
        direction: DVec3,
        /// Irradiance on a surface that faces the light, W·m⁻².
        irradiance: Rgb,
        /// Object to world; only its rotation is used.
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

    /// Whether it is left out of the image.
    pub fn is_hidden(&self) -> bool {
        match self {
            Self::Point { hidden, .. } | Self::Spot { hidden, .. } | Self::Directional { hidden, .. } => *hidden,
        }
    }
}

impl<'de> Deserialize<'de> for ScalePart {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Ok(Self(KeyValue::deserialize(deserializer)?.three()))
    }
}

impl Serialize for ScalePart {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let DVec3 { x, y, z } = self.0;
        if x == y && y == z { serializer.serialize_f64(x) } else { (x, y, z).serialize(serializer) }
    }
}

fn default_light_radius() -> f64 {
    0.01
}

pub(crate) fn default_outer_angle() -> f64 {
    45.0
}

fn is_up(value: &DVec3) -> bool {
    *value == DVec3::Y
}
