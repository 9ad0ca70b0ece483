//! Sources of textures, meshes and the environment: their description in scene files, which the world keeps for saving.

use crate::defaults::{is_default, is_one, is_yes, one, yes};
use crate::model_format::ModelFormat;
use crate::value::Rgb;
use firstlight_render::{Channel, Encoding, Wrap};
use glam::{DVec2, Vec3};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The names for `builtin("…")`.
pub const BUILTIN_NAMES: &[&str] = &[
    "asteroid",
    "blob-in-bowl",
    "bored-block",
    "cube",
    "icosphere",
    "room",
    "serpent-knot",
    "slivers",
    "terrain",
    "torus",
];

/// Radiance from infinitely far away.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum EnvironmentSource {
    /// No light.
    #[default]
    Black,
    /// The same radiance from every direction, W·m⁻²·sr⁻¹.
    Constant(Rgb),
    /// A gradient of radiance between three directions, W·m⁻²·sr⁻¹.
    Gradient {
        /// From directly above (+Y).
        zenith: Rgb,
        /// From just above the horizon.
        horizon: Rgb,
        /// From everywhere below the horizon.
        ground: Rgb,
    },
    /// An image (HDR, EXR, PFM, PNG or JPEG).
    Image {
        /// Path of the image, relative to the scene file.
        file: String,
        /// Radiance of a texel of 1, W·m⁻²·sr⁻¹.
        #[serde(default = "white")]
        scale: Rgb,
        /// Degrees about +Y.
        #[serde(default, skip_serializing_if = "is_default")]
        rotate: f64,
        /// Which direction each texel stands for.
        #[serde(default, skip_serializing_if = "is_default")]
        layout: EnvironmentLayout,
        /// Rows of a matrix from directions of the world to those of the image, before `rotate`; the same if not given.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        axes: Option<[[f64; 3]; 3]>,
    },
    /// A clear sky with the sun, above a ground.
    Sky {
        /// Height of the sun above the horizon, 0 to 90 degrees.
        #[serde(default = "usual_elevation")]
        elevation: f64,
        /// Direction of the sun: degrees from −Z, clockwise as seen from above.
        #[serde(default, skip_serializing_if = "is_default")]
        azimuth: f64,
        /// Haze: 1 is pure air, 10 is hazy.
        #[serde(default = "usual_turbidity")]
        turbidity: f64,
        /// Albedo of the ground, which brightens the clear sky.
        #[serde(default = "usual_ground")]
        ground: Rgb,
        /// Factor of the light of the sun.
        #[serde(default = "one", skip_serializing_if = "is_one")]
        sun: f64,
        /// Factor of the light of the clear sky without the sun.
        #[serde(default = "one", skip_serializing_if = "is_one")]
        sky: f64,
        /// Angle that the sun fills, degrees; it gives the same light.
        #[serde(default = "usual_sun_size", skip_serializing_if = "is_usual_sun_size")]
        sun_size: f64,
        /// Whether the lit ground is seen below the horizon; otherwise that is black.
        #[serde(default = "yes", skip_serializing_if = "is_yes")]
        below: bool,
        /// Factor of all of it.
        #[serde(default = "white", skip_serializing_if = "is_white")]
        scale: Rgb,
    },
}

/// Which direction each texel of an environment image stands for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EnvironmentLayout {
    /// Longitude and latitude; the top row is +Y, the middle column −Z.
    #[default]
    Equirectangular,
    /// A square of equal areas, as pbrt has it: the middle is +Z, the corners are −Z.
    EqualArea,
    /// Longitude and latitude as in Mitsuba 3: colours are interpolated between texels, and the first and last row lie
    /// at the poles.
    Interpolated,
}

/// A texture as a scene file describes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum TextureSource {
    /// A checkerboard: `squares` along u and v of the surface (0..1), or per metre on an infinite plane; (0, 0) has
    /// colour `a`.
    Checker {
        /// Colour of the squares whose integer coordinates have an even sum.
        a: Rgb,
        /// Colour of the others.
        b: Rgb,
        /// Number of squares along u and v.
        #[serde(default = "one_by_one", skip_serializing_if = "is_one_by_one")]
        squares: DVec2,
        /// Shift along u and v in squares, after rotation and scale.
        #[serde(default, skip_serializing_if = "is_default")]
        offset: DVec2,
        /// Degrees.
        #[serde(default, skip_serializing_if = "is_default")]
        rotate: f64,
    },
    /// An image from a file.
    Image {
        /// Path of the image, relative to the scene file.
        file: String,
        /// Factors of u and v before rotation.
        #[serde(default = "one_by_one", skip_serializing_if = "is_one_by_one")]
        stretch: DVec2,
        /// Number of repetitions along u and v.
        #[serde(default = "one_by_one", skip_serializing_if = "is_one_by_one")]
        repeat: DVec2,
        /// Shift along u and v in widths and heights of the image, after rotation and scale.
        #[serde(default, skip_serializing_if = "is_default")]
        offset: DVec2,
        /// Degrees.
        #[serde(default, skip_serializing_if = "is_default")]
        rotate: f64,
        /// The texture outside of the image.
        #[serde(default, skip_serializing_if = "is_default")]
        wrap: Wrap,
        /// The same along v, if it differs.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        wrap_v: Option<Wrap>,
        /// Bilinear between texels, or the nearest texel.
        #[serde(default = "yes")]
        smooth: bool,
        /// How the values of the image are interpreted.
        #[serde(default, skip_serializing_if = "is_default")]
        encoding: Encoding,
        /// The channel to use; `None`: the colour.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        channel: Option<Channel>,
        /// Factor of the colours.
        #[serde(default = "white", skip_serializing_if = "is_white")]
        tint: Rgb,
        /// Whether the colours, with their factor, are subtracted from 1.
        #[serde(default, skip_serializing_if = "is_default")]
        invert: bool,
        /// Set of texture coordinates of the mesh: 0 or 1.
        #[serde(default, skip_serializing_if = "is_default")]
        uv_set: u8,
        /// Whether colours are multiplied by the vertex colours.
        #[serde(default, skip_serializing_if = "is_default")]
        vertex_colors: bool,
        /// As a normal map: how far white is above black, metres; `None`: it has normals.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        relief: Option<f32>,
    },
    /// The vertex colours of a mesh; white if it has none.
    VertexColors {
        /// The channel to use; `None`: the colour.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        channel: Option<Channel>,
        /// Factor of the colours.
        #[serde(default = "white", skip_serializing_if = "is_white")]
        tint: Rgb,
    },
}

impl EnvironmentSource {
    /// A clear sky with usual values.
    pub fn clear_sky() -> Self {
        Self::Sky {
            elevation: usual_elevation(),
            azimuth: 0.0,
            turbidity: usual_turbidity(),
            ground: usual_ground(),
            sun: 1.0,
            sky: 1.0,
            sun_size: usual_sun_size(),
            below: true,
            scale: white(),
        }
    }

    /// An upright equirectangular image.
    pub fn image(file: String) -> Self {
        Self::Image { file, scale: white(), rotate: 0.0, layout: EnvironmentLayout::default(), axes: None }
    }
}

impl TextureSource {
    /// An image with default settings, once across the surface.
    pub fn image(file: String) -> Self {
        Self::Image {
            file,
            stretch: DVec2::ONE,
            repeat: DVec2::ONE,
            offset: DVec2::ZERO,
            rotate: 0.0,
            wrap: Wrap::Repeat,
            wrap_v: None,
            smooth: true,
            encoding: Encoding::Auto,
            channel: None,
            tint: white(),
            invert: false,
            uv_set: 0,
            vertex_colors: false,
            relief: None,
        }
    }

    /// The factor of its colours; white if it has none.
    pub fn factor(&self) -> Vec3 {
        match self {
            Self::Image { tint, .. } => tint.0,
            _ => Vec3::ONE,
        }
    }
}

/// The source of a mesh.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum MeshSource {
    /// A Wavefront OBJ file; path relative to the scene file.
    Obj(String),
    /// A PLY file, likewise.
    Ply(String),
    /// An STL file, likewise.
    Stl(String),
    /// A glTF 2.0 file.
    Gltf {
        /// Path of the model, relative to the scene file.
        file: String,
        /// Index of the mesh in the file, from 0; `None`: the whole scene of the file as one mesh.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        mesh: Option<u32>,
        /// Index of the node whose skin or morph weights deform the mesh.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        node: Option<u32>,
        /// Time in the animations; `None`: the pose stored in the file.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        at: Option<Seconds>,
    },
    /// A shape inside a scene of another renderer.
    Part {
        /// Path of the scene, relative to the scene file.
        file: String,
        /// Index of the shape in the scene, with the files that it includes, from 0.
        shape: u32,
        /// Names and values of parameters that the scene leaves open, on which its shapes depend.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        defines: Vec<(String, String)>,
    },
    /// A built-in mesh, by name.
    Builtin(String),
}

/// A time in seconds, finite. Equality compares the bits.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Seconds(pub f64);

impl PartialEq for Seconds {
    fn eq(&self, other: &Self) -> bool {
        self.0.to_bits() == other.0.to_bits()
    }
}

impl Eq for Seconds {}

impl std::hash::Hash for Seconds {
    fn hash<H: std::hash::Hasher>(&self, state: &mut H) {
        self.0.to_bits().hash(state);
    }
}

impl MeshSource {
    /// A model file of this format.
    pub fn model(format: ModelFormat, file: String) -> Self {
        match format {
            ModelFormat::Obj => Self::Obj(file),
            ModelFormat::Ply => Self::Ply(file),
            ModelFormat::Stl => Self::Stl(file),
            ModelFormat::Gltf => Self::Gltf { file, mesh: None, node: None, at: None },
        }
    }

    /// A model file of the format given by its extension, else OBJ.
    pub fn of_file(file: String) -> Self {
        Self::model(ModelFormat::of(Path::new(&file)).unwrap_or(ModelFormat::Obj), file)
    }

    /// Its format, if it is a model file.
    pub fn model_format(&self) -> Option<ModelFormat> {
        match self {
            Self::Obj(_) => Some(ModelFormat::Obj),
            Self::Ply(_) => Some(ModelFormat::Ply),
            Self::Stl(_) => Some(ModelFormat::Stl),
            Self::Gltf { .. } => Some(ModelFormat::Gltf),
            Self::Part { .. } | Self::Builtin(_) => None,
        }
    }

    /// The path, if it is a file.
    pub fn file(&self) -> Option<&str> {
        match self {
            Self::Obj(file) | Self::Ply(file) | Self::Stl(file) => Some(file),
            Self::Gltf { file, .. } | Self::Part { file, .. } => Some(file),
            Self::Builtin(_) => None,
        }
    }

    /// The path, if it is a file.
    pub fn file_mut(&mut self) -> Option<&mut String> {
        match self {
            Self::Obj(file) | Self::Ply(file) | Self::Stl(file) => Some(file),
            Self::Gltf { file, .. } | Self::Part { file, .. } => Some(file),
            Self::Builtin(_) => None,
        }
    }

    /// The path, or the name of the built-in mesh.
    pub fn name(&self) -> &str {
        match self {
            Self::Obj(name) | Self::Ply(name) | Self::Stl(name) | Self::Builtin(name) => name,
            Self::Gltf { file, .. } | Self::Part { file, .. } => file,
        }
    }
}

/// How the shading normals of a mesh are computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MeshShading {
    /// The normals of the file if it has them, else smooth ones.
    #[default]
    Auto,
    /// Area-weighted vertex normals, even if the file has normals.
    Smooth,
    /// No vertex normals: each triangle is shaded with its geometric normal.
    Flat,
}

/// Prefix of the names of images that need no file.
pub const BUILTIN_IMAGE: &str = "builtin:";

/// Names of the images that need no file, without [`BUILTIN_IMAGE`].
pub const BUILTIN_IMAGES: [&str; 4] = ["oak", "marble", "concrete", "linen"];

/// Where the first texture coordinates of a mesh come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TextureCoordinates {
    /// From its source; without any there, each triangle shows the image.
    #[default]
    File,
    /// Projection along the axis of the mesh that each triangle faces most: the image covers a square as wide as the
    /// longest side of the mesh's bounding box.
    Box,
}

/// What is done with a mesh after it is read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeshOptions {
    /// How its normals are computed.
    pub shading: MeshShading,
    /// Where its texture coordinates come from.
    pub texture_coordinates: TextureCoordinates,
    /// Share of the faces to keep, (0, 1]; `None`: all.
    pub simplify: Option<f64>,
}

fn white() -> Rgb {
    Rgb(Vec3::ONE)
}

fn is_white(value: &Rgb) -> bool {
    *value == white()
}

fn usual_elevation() -> f64 {
    45.0
}

fn usual_turbidity() -> f64 {
    3.0
}

fn usual_ground() -> Rgb {
    Rgb(Vec3::splat(0.3))
}

/// As in Mitsuba 3.
fn usual_sun_size() -> f64 {
    0.5358
}

fn is_usual_sun_size(value: &f64) -> bool {
    *value == usual_sun_size()
}

fn one_by_one() -> DVec2 {
    DVec2::ONE
}

fn is_one_by_one(value: &DVec2) -> bool {
    *value == DVec2::ONE
}
