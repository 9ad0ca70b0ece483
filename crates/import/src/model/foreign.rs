//! A scene of another renderer, read: a scene file, and the meshes that stand inside of the foreign file.

use crate::model::mesh_budget::MeshBudget;
use crate::model::projection::LightImages;
use firstlight_files::printable;
use firstlight_files::stamp::Stamp;
use firstlight_files::warnings::Warnings;
use firstlight_format::parts::MaterialPart;
use firstlight_format::scene_file::SceneFile;
use firstlight_format::sources::TextureSource;
use firstlight_format::value::{ColorValue, ScalarValue};
use firstlight_mesh::Mesh;
use glam::Vec3;
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

/// Characters of a name that are kept: a name is stored with everything that uses it.
const MOST_OF_A_NAME: usize = 256;

/// The start of a long name.
pub(crate) fn cut(name: &str) -> &str {
    name.char_indices().nth(MOST_OF_A_NAME).map_or(name, |(end, _)| &name[..end])
}

/// What is told of a name that is longer.
pub(crate) fn told_of_long(name: &str) -> Option<String> {
    let is_long = name.chars().nth(MOST_OF_A_NAME).is_some();
    let told =
        || format!("names are told apart by their first {MOST_OF_A_NAME} characters: `{}`", printable::name(name));
    is_long.then(told)
}

/// Share of a surface that is a light where it emits and reflects otherwise than `principled` can: the rest reflects,
/// a thousandth less than it should, and the share is as many times brighter. A power of two, so that the product is
/// exact.
pub(crate) const LIGHT_SHARE: f32 = 1.0 / 1024.0;

/// Objects of a scene: instances of instances are quickly said.
pub(crate) const MAX_OBJECTS: usize = 1 << 20;

/// What stands for a surface that is not modelled.
pub(crate) fn grey() -> MaterialPart {
    MaterialPart::Diffuse { albedo: ColorValue::grey(0.5) }
}

/// Glass whose surface colours the light that it lets through and reflects, as `principled`; what is reflected less
/// passes.
///
/// - `tell`: receives why it stays clear.
pub(crate) fn tinted_glass(
    clear: MaterialPart,
    transmittance: ColorValue,
    reflectance: ColorValue,
    tell: impl FnOnce(&str),
) -> MaterialPart {
    if [&transmittance, &reflectance] == [&ColorValue::grey(1.0); 2] {
        return clear;
    }
    let (width, index, inside, dispersed) = match &clear {
        MaterialPart::Glass { ior, absorption, dispersion } => (0.0, *ior, *absorption, *dispersion),
        MaterialPart::RoughGlass { alpha: ScalarValue::Number(alpha), ior, absorption, dispersion, .. } => {
            (*alpha, *ior, *absorption, *dispersion)
        }
        // `principled` has the root of the width.
        _ => {
            tell("the colours of glass of textured roughness are not modelled: it is clear");
            return clear;
        }
    };
    let mut part = MaterialPart::principled(transmittance);
    if let MaterialPart::Principled {
        transmission,
        roughness,
        ior,
        absorption,
        dispersion,
        specular,
        specular_color,
        ..
    } = &mut part
    {
        (*transmission, *roughness) = (1.0.into(), width.sqrt().into());
        (*ior, *absorption, *dispersion) = (index, inside, dispersed);
        *specular = if reflectance == ColorValue::grey(0.0) { 0.0 } else { 1.0 }.into();
        *specular_color = reflectance;
    }
    part
}

/// Number of lobes of a material with all of its parts.
pub(crate) fn n_lobes(file: &SceneFile, part: &MaterialPart) -> usize {
    match part {
        MaterialPart::Blend { a, b, .. } => {
            [a, b].into_iter().filter_map(|name| file.materials.get(name)).map(|part| n_lobes(file, part)).sum()
        }
        part => part.n_lobes(),
    }
}

/// A texture times a colour; `None` if it cannot have a factor.
pub(crate) fn tinted(source: &TextureSource, factor: Vec3) -> Option<TextureSource> {
    let mut source = source.clone();
    match &mut source {
        TextureSource::Checker { a, b, .. } => (a.0, b.0) = (a.0 * factor, b.0 * factor),
        TextureSource::Image { tint, invert: false, .. } | TextureSource::VertexColors { tint, .. } => tint.0 *= factor,
        TextureSource::Image { .. } => return None,
    }
    Some(source)
}

/// Options for reading.
pub(crate) struct ForeignOptions {
    /// Whether files outside of the folder of the scene may be read.
    pub allow_outside: bool,
    /// Names and values of parameters that the scene leaves open.
    pub defines: Vec<(String, String)>,
    /// Whose proportions and brightness matter.
    pub light_images: LightImages,
    /// Of the scene that reads it.
    pub meshes: Arc<MeshBudget>,
}

/// A scene with everything that its text says.
#[derive(Debug)]
pub struct ForeignScene {
    /// Paths are relative to the folder of the scene; meshes in [`Self::parts`] are
    /// [`MeshSource::Part`](firstlight_format::sources::MeshSource::Part) of it.
    pub file: SceneFile,
    /// Meshes by the index of their shape in the text.
    pub parts: HashMap<u32, Arc<Mesh>>,
    /// The file that a mesh was read from, if it is one, with its stamp from before it was read.
    pub part_files: HashMap<u32, (PathBuf, Stamp)>,
    /// What is not shown as the file says, each kind once.
    pub warnings: Warnings,
    /// The scene, then the files that it includes, each with its stamp from before it was read.
    pub files: Arc<[(PathBuf, Stamp)]>,
}
