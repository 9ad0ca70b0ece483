//! The meshes of a scene: from files or built in, shaded as specified, with the materials of their files.

use crate::documents::Documents;
use crate::error::together::MeshesTooLarge;
use crate::gltf::assembly::MeshKey;
use crate::gltf_mesh::GltfMesh;
use crate::load_model::load_model;
use crate::model::foreign::ForeignScene;
use crate::model::imported::{ImportedModel, ModelNormals, ModelOptions};
use crate::model::material::ImportedMaterial;
use crate::mtl_material::MtlMaterials;
use firstlight_files::relative::text_to_path;
use firstlight_files::stamp::{Stamp, stamp};
use firstlight_files::warnings::Warnings;
use firstlight_format::error::SceneError;
use firstlight_format::model_format::ModelFormat;
use firstlight_format::parts::MaterialPart;
use firstlight_format::sources::{MeshOptions, MeshShading, MeshSource, TextureCoordinates, TextureSource};
use firstlight_mesh::{Mesh, NormalWeight, procedural, simplify};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Crease angle for recomputed normals of glTF meshes, radians: edges are hard beyond it.
const CREASE: f32 = std::f32::consts::FRAC_PI_3;

/// The mesh of that name, and its crease angle in radians; `None` smooths every edge.
fn builtin_mesh(name: &str) -> Option<(Mesh, Option<f32>)> {
    let sharp = Some(40_f32.to_radians());
    Some(match name {
        "asteroid" => (procedural::displaced_sphere(&procedural::DisplacedSphere::default()), None),
        "blob-in-bowl" => (procedural::blob_in_bowl(), sharp),
        "bored-block" => (procedural::bored_block(64), sharp),
        "cube" => (procedural::cube(), sharp),
        "icosphere" => (procedural::icosphere(32), None),
        "room" => (procedural::room(), sharp),
        "serpent-knot" => (procedural::serpent_knot(&procedural::SerpentKnot::default()), None),
        "slivers" => (procedural::slivers(10_000, 1), sharp),
        "terrain" => (procedural::terrain(&procedural::Terrain::default()), None),
        "torus" => (procedural::torus(1.0, 0.35, 192, 64), None),
        _ => return None,
    })
}

/// A mesh and the materials that its file assigns to its slots.
#[derive(Clone, Debug)]
pub struct LoadedMesh {
    /// The triangles.
    pub mesh: Arc<Mesh>,
    /// One per slot; empty if the file has no materials.
    pub slots: Vec<(String, MaterialPart)>,
    /// The textures of `slots`, with the paths of their images.
    pub textures: Vec<(String, TextureSource, PathBuf)>,
    /// What was repaired or left out.
    pub warnings: Warnings,
    /// Warnings about `slots`, for objects that use them.
    pub material_warnings: Warnings,
    /// All files that were read for it, each with its stamp.
    pub files: Arc<[(PathBuf, Stamp)]>,
    /// Images that its materials name without a use.
    pub beside: Arc<[PathBuf]>,
}

/// Reads or generates a mesh, then simplifies and shades it and projects its textures.
///
/// # Errors
/// If it cannot be read, or the meshes that `documents` counts are too large together.
pub fn load_mesh(
    source: &MeshSource,
    options: MeshOptions,
    folder: &Path,
    documents: &Documents,
) -> Result<LoadedMesh, SceneError> {
    let budget = documents.mesh_budget();
    let too_large =
        |error| SceneError::in_file(folder.join(text_to_path(source.name())), MeshesTooLarge::to_string(&error));
    // Documents count their files.
    let length = match source {
        MeshSource::Obj(file) | MeshSource::Ply(file) | MeshSource::Stl(file) => {
            budget.before(&folder.join(text_to_path(file))).map_err(too_large)?
        }
        MeshSource::Gltf { .. } | MeshSource::Part { .. } | MeshSource::Builtin(_) => 0,
    };
    let loaded = load(source, options, folder, documents)?;
    // Meshes that a scene of another renderer has as they are were counted with it.
    if !matches!(source, MeshSource::Part { .. }) || options != MeshOptions::default() {
        budget.after(length, &loaded.mesh).map_err(too_large)?;
    }
    Ok(loaded)
}

fn load(
    source: &MeshSource,
    options: MeshOptions,
    folder: &Path,
    documents: &Documents,
) -> Result<LoadedMesh, SceneError> {
    if let MeshSource::Gltf { file, mesh, node, at } = source {
        let path = folder.join(text_to_path(file));
        let key = mesh.map(|mesh| MeshKey { mesh, node: *node });
        let read = GltfMesh { path: &path, key, at: at.map(|at| at.0), options };
        let base = read.base(documents).map_err(|error| SceneError::new(error.to_string()))?;
        let mesh = Arc::new(finish(base.mesh, source, options, Some(CREASE))?);
        let (slots, textures, files) = (base.slots, base.textures, base.files);
        let (warnings, material_warnings) = (base.warnings, base.material_warnings);
        let beside = Arc::default();
        return Ok(LoadedMesh { mesh, slots, textures, warnings, material_warnings, files, beside });
    }
    if let MeshSource::Part { file, shape, defines } = source {
        let path = folder.join(text_to_path(file));
        let scene = documents.scene(&path, defines)?;
        let mesh = part_of(&scene, &path, *shape)?;
        let mesh = if options == MeshOptions::default() {
            mesh.clone()
        } else {
            Arc::new(finish(part_base(mesh, options.shading), source, options, Some(CREASE))?)
        };
        let files = match scene.part_files.get(shape) {
            Some(own) => scene.files.iter().chain([own]).cloned().collect(),
            None => scene.files.clone(),
        };
        return Ok(LoadedMesh { mesh, ..LoadedMesh::empty(files) });
    }
    match (source.file(), source.model_format()) {
        (Some(file), Some(format)) => {
            let path = folder.join(text_to_path(file));
            read_file(source, format, &path, options, documents.allow_outside())
        }
        _ => {
            let mesh = MeshBase::read(source, options, folder)?.finish(options)?;
            Ok(LoadedMesh { mesh: Arc::new(mesh), ..LoadedMesh::empty(Arc::default()) })
        }
    }
}

/// The mesh of a shape of a scene of another renderer.
fn part_of<'a>(scene: &'a ForeignScene, path: &Path, shape: u32) -> Result<&'a Arc<Mesh>, SceneError> {
    let none = || match scene.part_files.get(&shape) {
        Some((file, _)) => SceneError::in_file(file, format!("the mesh of shape {shape} of this scene cannot be read")),
        None => SceneError::in_file(path, format!("shape {shape}, counted from 0, is no mesh of this scene")),
    };
    scene.parts.get(&shape).ok_or_else(none)
}

/// A mesh of a scene of another renderer before [`finish`]: without the normals that are to be computed.
fn part_base(mesh: &Mesh, shading: MeshShading) -> Mesh {
    let normals = if shading == MeshShading::Auto { mesh.normals.clone() } else { Vec::new() };
    Mesh { normals, ..mesh.clone() }
}

/// A mesh before simplification and shading, so that both can be changed without reading it again.
#[derive(Clone, Debug)]
pub struct MeshBase {
    source: MeshSource,
    options: MeshOptions,
    folder: PathBuf,
    mesh: Mesh,
    /// Crease angle of automatic shading, radians; `None` smooths every edge.
    crease: Option<f32>,
}

impl MeshBase {
    /// Reads or generates the mesh: the first step of `load_mesh`.
    ///
    /// # Errors
    /// If there is no such mesh, or its file cannot be read.
    pub fn read(source: &MeshSource, options: MeshOptions, folder: &Path) -> Result<Self, SceneError> {
        let (mesh, crease) = match source {
            MeshSource::Gltf { file, mesh, node, at } => {
                let path = folder.join(text_to_path(file));
                let key = mesh.map(|mesh| MeshKey { mesh, node: *node });
                let read = GltfMesh { path: &path, key, at: at.map(|at| at.0), options };
                let base = read.base(&Documents::default()).map_err(|error| SceneError::new(error.to_string()))?;
                (base.mesh, Some(CREASE))
            }
            MeshSource::Part { file, shape, defines } => {
                let path = folder.join(text_to_path(file));
                let scene = Documents::default().scene(&path, defines)?;
                (part_base(part_of(&scene, &path, *shape)?, options.shading), Some(CREASE))
            }
            MeshSource::Obj(file) | MeshSource::Ply(file) | MeshSource::Stl(file) => {
                let path = folder.join(text_to_path(file));
                let format = source.model_format().expect("it is a model file");
                // Materials, which may lie elsewhere, are not used here.
                let (imported, crease) = read_base(&path, format, options, false)?;
                (imported.mesh, crease)
            }
            MeshSource::Builtin(name) => {
                builtin_mesh(name).ok_or_else(|| SceneError::new(format!("there is no built-in mesh `{name}`")))?
            }
        };
        let (source, folder) = (source.clone(), folder.to_owned());
        Ok(Self { source, options, folder, mesh, crease })
    }

    /// Whether [`Self::read`] would give the same for these arguments.
    pub fn serves(&self, source: &MeshSource, options: MeshOptions, folder: &Path) -> bool {
        let normals = |options: MeshOptions| (options.shading, options.simplify.is_some());
        (&self.source, normals(self.options), &*self.folder) == (source, normals(options), folder)
    }

    /// Simplifies and shades the mesh and projects its textures: the last step of `load_mesh`.
    ///
    /// # Errors
    /// If it cannot be simplified by this ratio.
    pub fn finish(&self, options: MeshOptions) -> Result<Mesh, SceneError> {
        finish(self.mesh.clone(), &self.source, options, self.crease)
    }

    /// The mesh before [`Self::finish`].
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }
}

fn finish(mesh: Mesh, source: &MeshSource, options: MeshOptions, crease: Option<f32>) -> Result<Mesh, SceneError> {
    let mesh = shaded_as_specified(mesh, source, options, crease)?;
    Ok(match options.texture_coordinates {
        TextureCoordinates::File => mesh,
        TextureCoordinates::Box => mesh.with_box_coordinates(),
    })
}

fn shaded_as_specified(
    mesh: Mesh,
    source: &MeshSource,
    MeshOptions { shading, simplify, .. }: MeshOptions,
    crease: Option<f32>,
) -> Result<Mesh, SceneError> {
    let had_tangents = !mesh.tangents.is_empty();
    let is_flat_without_normals = matches!(source, MeshSource::Gltf { .. } | MeshSource::Part { .. });
    let mesh = simplified(mesh, simplify)?;
    if is_flat_without_normals && shading == MeshShading::Auto && simplify.is_none() {
        return Ok(mesh);
    }
    // The normals of an imported mesh are already the specified ones.
    let keeps = shading != MeshShading::Flat && source.file().is_some() && !mesh.normals.is_empty();
    let mesh = if keeps { mesh } else { shaded(mesh, shading, crease) };
    Ok(if had_tangents && mesh.tangents.is_empty() { mesh.with_tangents() } else { mesh })
}

fn read_file(
    source: &MeshSource,
    format: ModelFormat,
    path: &Path,
    options: MeshOptions,
    allow_outside: bool,
) -> Result<LoadedMesh, SceneError> {
    // Taken before reading, so that a change in the meantime is noticed.
    let before = stamp(path);
    let (mut imported, crease) = read_base(path, format, options, allow_outside)?;
    imported.mesh = finish(imported.mesh, source, options, crease)?;
    let mesh = Arc::new(imported.mesh);
    let files = std::iter::once((path.to_owned(), before))
        .chain(imported.libraries.iter().map(|library| (library.clone(), stamp(library))))
        .collect();
    let (slots, textures) = (Vec::new(), Vec::new());
    let (warnings, mut material_warnings) = (imported.warnings, imported.material_warnings);
    for material in &mut imported.materials {
        if let Some(path) = material.take_lost_image() {
            let path = path.display();
            material_warnings.push(format!("{path}: cannot be read: no such file; the colour beside it is shown"));
        }
    }
    let beside = imported.materials.iter().flat_map(|material| material.beside.iter().cloned()).collect();
    let mut loaded = LoadedMesh { mesh, slots, textures, warnings, material_warnings, files, beside };
    // If the file has no materials, the slots stay empty.
    if imported.materials.iter().any(|material| !material.name.is_empty()) {
        let mut converted = MtlMaterials::default();
        let slot = |material: &ImportedMaterial| (material.name.clone(), converted.part(material));
        loaded.slots = imported.materials.iter().map(slot).collect();
        loaded.textures = converted.textures;
    }
    Ok(loaded)
}

/// The mesh as simplification needs it, and the crease angle for normals that are still to be computed.
fn read_base(
    path: &Path,
    format: ModelFormat,
    MeshOptions { shading, simplify, .. }: MeshOptions,
    allow_outside: bool,
) -> Result<(ImportedModel, Option<f32>), SceneError> {
    let read = |normals| {
        load_model(path, format, &ModelOptions { normals, allow_outside, ..ModelOptions::default() })
            .map_err(|error| SceneError::new(error.to_string()))
    };
    let computed = ModelOptions::default().normals;
    let ModelNormals::FileOrComputed { crease_angle } = computed else { return Ok((read(computed)?, None)) };
    let mut imported = read(match shading {
        MeshShading::Auto => computed,
        MeshShading::Smooth if simplify.is_none() => ModelNormals::OfPositions,
        MeshShading::Smooth | MeshShading::Flat => ModelNormals::Ignore,
    })?;
    // Computed normals would prevent simplification at creases: they are computed afterwards.
    if shading == MeshShading::Auto && simplify.is_some() && !imported.normals_from_file {
        imported.mesh = read(ModelNormals::Ignore)?.mesh;
    }
    Ok((imported, Some(crease_angle)))
}

fn simplified(mesh: Mesh, ratio: Option<f64>) -> Result<Mesh, SceneError> {
    match ratio {
        Some(ratio) if ratio < 1.0 => {
            let simple = simplify::simplify(&mesh, simplify::Method::default(), simplify::Target::Ratio(ratio))
                .map_err(|error| SceneError::new(format!("the mesh cannot be simplified: {error}")))?;
            Ok(simple.with_colors_of(&mesh))
        }
        _ => Ok(mesh),
    }
}

/// - `crease`: crease angle of automatic shading, radians; `None` smooths every edge.
fn shaded(mesh: Mesh, shading: MeshShading, crease: Option<f32>) -> Mesh {
    match shading {
        MeshShading::Auto => mesh.with_smooth_normals(NormalWeight::Angle, crease),
        MeshShading::Smooth => mesh.with_vertex_normals(),
        MeshShading::Flat => mesh.flat(),
    }
}

impl LoadedMesh {
    /// Without triangles, materials and warnings: of an object that cannot be shown, or to be filled.
    pub fn empty(files: Arc<[(PathBuf, Stamp)]>) -> Self {
        Self {
            mesh: Arc::default(),
            slots: Vec::new(),
            textures: Vec::new(),
            warnings: Warnings::default(),
            material_warnings: Warnings::default(),
            files,
            beside: Arc::default(),
        }
    }

    /// Whether the files that it was read from have not changed.
    pub fn is_fresh(&self) -> bool {
        self.files.iter().all(|(path, then)| then.is_some() && stamp(path) == *then)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use firstlight_format::sources::BUILTIN_NAMES;

    #[test]
    fn every_builtin_mesh_can_be_had() {
        for name in BUILTIN_NAMES {
            let source = MeshSource::Builtin((*name).to_owned());
            let loaded = load_mesh(&source, MeshOptions::default(), Path::new(""), &Documents::default()).unwrap();
            loaded.mesh.validate().unwrap_or_else(|error| panic!("{name}: {error}"));
        }
        assert!(BUILTIN_NAMES.is_sorted());
    }
}
