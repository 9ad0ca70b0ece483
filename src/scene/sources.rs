//! Where textures, meshes and the light of the environment come from: what a scene file says of them, and what the world
//! keeps to save them again.

use super::value::Rgb;
use crate::render::Wrap;
use glam::{DVec2, Vec3};
use serde::{Deserialize, Serialize};

/// Radiance from infinitely far away.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum EnvironmentSource {
    #[default]
    Black,
    Constant(Rgb),
    Gradient {
        zenith: Rgb,
        horizon: Rgb,
        ground: Rgb,
    },
    /// Equirectangular, HDR, EXR, PNG or JPEG.
    Image {
        file: String,
        #[serde(default = "white")]
        scale: Rgb,
        /// Degrees about +Y.
        #[serde(default, skip_serializing_if = "is_default")]
        rotate: f64,
    },
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum TextureSource {
    /// `squares` along u and v of the surface (0..1), or a metre on an infinite plane; (0, 0) lies in colour `a`.
    Checker {
        a: Rgb,
        b: Rgb,
        #[serde(default = "one_by_one", skip_serializing_if = "is_one_by_one")]
        squares: DVec2,
        #[serde(default, skip_serializing_if = "is_default")]
        offset: DVec2,
        /// Degrees.
        #[serde(default, skip_serializing_if = "is_default")]
        rotate: f64,
    },
    Image {
        file: String,
        /// How often the picture fits along u and v.
        #[serde(default = "one_by_one", skip_serializing_if = "is_one_by_one")]
        repeat: DVec2,
        #[serde(default, skip_serializing_if = "is_default")]
        offset: DVec2,
        /// Degrees.
        #[serde(default, skip_serializing_if = "is_default")]
        rotate: f64,
        #[serde(default, skip_serializing_if = "is_default")]
        wrap: Wrap,
        /// Bilinear between texels, or the nearest texel.
        #[serde(default = "yes")]
        smooth: bool,
    },
}

/// Where the triangles of a mesh come from.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MeshSource {
    /// Wavefront OBJ, relative to the scene file.
    Obj(String),
    /// A mesh that the program makes.
    Builtin(String),
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MeshShading {
    /// Normals of the file where it has them, else smooth.
    #[default]
    Auto,
    /// Area-weighted vertex normals, whatever the file says.
    Smooth,
    Flat,
}

fn white() -> Rgb {
    Rgb(Vec3::ONE)
}

fn one_by_one() -> DVec2 {
    DVec2::ONE
}

fn is_one_by_one(value: &DVec2) -> bool {
    *value == DVec2::ONE
}

fn yes() -> bool {
    true
}

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}
