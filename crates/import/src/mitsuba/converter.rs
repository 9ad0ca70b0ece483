//! A scene while it is converted: what its parts have in common.

use crate::mitsuba::graph::Graph;
use crate::mitsuba::meshes::MeshRequest;
use crate::model::mesh_budget::MeshBudget;
use crate::model::projection::LightImages;
use firstlight_files::reference::References;
use firstlight_files::warnings::Warnings;
use firstlight_format::names::Names;
use firstlight_format::parts::MaterialPart;
use firstlight_format::scene_file::SceneFile;
use glam::{DMat2, DMat4, DVec2};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// How a plugin reads a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Reads {
    Color,
    /// One number. A checkerboard then has its colours exchanged, in Mitsuba as here.
    Number,
    /// A colour at (1 − u, v).
    Mirrored,
    /// A colour at (u, 1 − v).
    UpsideDown,
    /// A colour at (1 − u, 1 − v).
    Turned,
}

impl Reads {
    /// The coordinates at which it reads: factors of u and v, and a shift.
    pub(crate) fn coordinates(self) -> (DMat2, DVec2) {
        let (u, v) = match self {
            Self::Color | Self::Number => (1.0, 1.0),
            Self::Mirrored => (-1.0, 1.0),
            Self::UpsideDown => (1.0, -1.0),
            Self::Turned => (-1.0, -1.0),
        };
        let signs = DVec2::new(u, v);
        (DMat2::from_diagonal(signs), 0.5 * (DVec2::ONE - signs))
    }
}

/// A BSDF in our words.
#[derive(Clone, Debug)]
pub(crate) struct Surface {
    pub part: MaterialPart,
    /// Whether its back is like its front; in Mitsuba, the back of other reflecting surfaces is black.
    pub two_sided: bool,
}

impl Surface {
    pub(crate) fn one_sided(part: MaterialPart) -> Self {
        Self { part, two_sided: false }
    }

    /// Of a surface that transmits, or is seen from both sides.
    pub(crate) fn two_sided(part: MaterialPart) -> Self {
        Self { part, two_sided: true }
    }
}

/// The material of a shape in the scene file.
#[derive(Clone, Debug)]
pub(crate) struct PlacedMaterial {
    pub name: String,
    /// Whether texture coordinates matter.
    pub is_textured: bool,
    pub needs_tangents: bool,
    /// Whether its back is seen through the front of a closed shape.
    pub has_holes: bool,
    /// Name of the mesh attribute that it reads, as in Mitsuba.
    pub attribute: Option<String>,
    /// Whether the back is like the front.
    pub two_sided: bool,
}

/// The index of a BSDF, that of an emitter, and whether a shape without a BSDF is the border of a medium.
pub(crate) type MaterialKey = (Option<usize>, Option<usize>, bool);

/// A scene while it is converted.
pub(crate) struct Converter<'a> {
    pub graph: &'a Graph,
    /// From Mitsuba's world to ours.
    pub world: DMat4,
    pub file: SceneFile,
    pub warnings: Warnings,
    pub references: References,
    /// Of the scene: paths are relative to it.
    pub folder: &'a Path,
    /// Names and values from the command line.
    pub defines: &'a [(String, String)],
    pub light_images: &'a LightImages,
    pub meshes: &'a MeshBudget,
    /// Of the scene in its folder.
    pub file_name: String,
    pub textures: HashMap<(usize, Reads), String>,
    /// Names of images that are read as numbers, with the index of their plugin.
    pub numbers: Vec<(String, usize)>,
    /// Of the textures that are being converted.
    pub texture_depth: u32,
    /// By the index of their BSDF.
    pub surfaces: HashMap<usize, Option<Surface>>,
    /// Number of shapes so far, with those of instances.
    pub n_shapes: usize,
    /// Number of their parameters and nested objects.
    pub n_parts: usize,
    pub materials: HashMap<MaterialKey, Option<PlacedMaterial>>,
    /// Meshes to be made, by their number in the scene.
    pub requests: HashMap<MeshRequest, u32>,
    /// Objects of meshes from files whose back is black in Mitsuba.
    pub one_sided: Vec<usize>,
    /// Whether the file of a mesh lacks normals.
    pub without_normals: HashMap<PathBuf, bool>,
    /// By the name of a material: the one that has a black back as well.
    pub backed: HashMap<String, String>,
    /// Attributes by the name of the texture that reads them.
    pub attributes: HashMap<String, String>,
    /// Meshes that need an attribute, and the shape of each.
    pub colored: HashMap<u32, usize>,
    pub has_environment: bool,
    pub names: Names,
    pub material_names: Names,
}
