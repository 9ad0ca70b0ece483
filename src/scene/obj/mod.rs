//! Wavefront OBJ and MTL: any file in, one mesh with material slots out, or an error that names the line.
//!
//! The file is screened ([`screen`]), parsed by tobj in `f64`, and assembled: polygons are cut into triangles,
//! corners that share position, texture coordinate and normal share a vertex (across groups too), and normals that
//! the file lacks are computed. Start reading at [`load_obj`]; [`save_obj`] is
//! the way back.

mod error;
mod mtl;
mod polygon;
mod screen;
mod warnings;
mod write;

pub use error::{LineProblem, ObjError};
pub use mtl::ImportedMaterial;
pub(super) use write::{NewObj, save_new_obj};
pub use write::{ObjExtras, save_obj};

use self::warnings::Warnings;
use crate::mesh::{Mesh, NormalWeight};
use crate::scene::{FileKind, InputFile, Limits, text_to_path};
use glam::{DVec3, Vec2, Vec3};
use std::collections::HashMap;
use std::io::Cursor;
use std::path::{Path, PathBuf};

/// A model as its file has it.
#[derive(Clone, Debug)]
pub struct ImportedObj {
    /// Its `slots` index `materials`.
    pub mesh: Mesh,
    /// Only materials that faces use. One whose name the libraries lack has its name and nothing else.
    pub materials: Vec<ImportedMaterial>,
    /// The material libraries that were found.
    pub libraries: Vec<PathBuf>,
    /// Whether every corner had a usable normal in the file; otherwise they were computed.
    pub normals_from_file: bool,
    /// Faces of more than three corners; they were cut into triangles.
    pub polygons: usize,
    /// What was left out or replaced, one sentence each.
    pub warnings: Vec<String>,
    /// The same of the materials, which matter only to those who use them.
    pub material_warnings: Vec<String>,
}

/// Where shading normals come from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ObjNormals {
    /// From the file; where it has none, computed with angle weights. Computed edges stay hard where triangles
    /// meet at more than `crease_angle` radians.
    FileOrComputed { crease_angle: f32 },
    /// Area-weighted at each position of the file, whatever normals it has and however texture coordinates split
    /// its vertices.
    OfPositions,
    /// None: the mesh has no normals, and vertices are split only where texture coordinates differ.
    Ignore,
}

/// More `mtllib` lines than this are left out.
const MAX_LIBRARIES: usize = 256;

/// How to read, and how much at most.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjOptions {
    pub normals: ObjNormals,
    /// Larger files are refused. Loading takes up to about 25 bytes of memory for each byte of the file.
    pub max_bytes: u64,
    /// Larger material libraries are left out.
    pub max_library_bytes: u64,
}

impl Default for ObjOptions {
    /// A crease angle of 60°: the right angles of boxes stay hard, and curves come out smooth even when they are
    /// coarse (the faces of an icosahedron meet at 42°, those of an 8-sided column at 45°).
    fn default() -> Self {
        let normals = ObjNormals::FileOrComputed { crease_angle: 60_f32.to_radians() };
        let limits = Limits::of_this_process();
        Self { normals, max_bytes: limits.model_bytes, max_library_bytes: limits.library_bytes }
    }
}

/// [`load_obj_with`] and the default options.
pub fn load_obj(path: &Path) -> Result<ImportedObj, ObjError> {
    load_obj_with(path, &ObjOptions::default())
}

/// Loads a model and the material libraries it names.
///
/// The fourth number of a vertex and vertex colours are ignored, as are lines and points. Normals of length zero
/// count as missing. A missing library or material is a warning.
pub fn load_obj_with(path: &Path, options: &ObjOptions) -> Result<ImportedObj, ObjError> {
    let bytes = read(path, options.max_bytes)?;
    let screened =
        screen::screen(&bytes).map_err(|(line, problem)| ObjError::Line { path: path.into(), line, problem })?;
    if screened.face_materials.is_empty() {
        return Err(ObjError::NoFaces { path: path.into() });
    }
    if screened.materials.len() > usize::from(u16::MAX) + 1 {
        return Err(ObjError::TooManyMaterials { path: path.into() });
    }
    let bad_number = || {
        let (line, problem) = screen::find_bad_number(&bytes)?;
        Some(ObjError::Line { path: path.into(), line, problem })
    };
    let mut parsed = parse(&screened.text)
        .map_err(|source| bad_number().unwrap_or(ObjError::Parser { path: path.into(), source }))?;
    if [&parsed.positions, &parsed.normals, &parsed.texcoords].iter().any(|list| list.iter().any(|v| !v.is_finite())) {
        return Err(
            bad_number().unwrap_or(ObjError::Parser { path: path.into(), source: tobj::LoadError::PositionParseError })
        );
    }

    let mut warnings = Warnings::default();
    if screened.lines_and_points > 0 {
        warnings.push(format!("{}: {} lines or points were left out", path.display(), screened.lines_and_points));
    }
    if !matches!(options.normals, ObjNormals::FileOrComputed { .. }) {
        parsed.normals.clear();
        parsed.normal_indices.clear();
    }
    let corners = Corners::of(&parsed);
    let (triangles, slots, dropped) = corners.triangles(&parsed, &screened.face_materials);
    if dropped > 0 {
        warnings.push(format!("{}: {dropped} triangles use a vertex twice and were left out", path.display()));
    }
    if triangles.is_empty() {
        return Err(ObjError::NoArea { path: path.into(), triangles: dropped });
    }
    let mesh_error = |source| ObjError::Mesh { path: path.into(), source };
    let mut mesh = Mesh::from_f64(&corners.positions, triangles).map_err(mesh_error)?;
    if !mesh.triangles.iter().any(|triangle| has_area(&mesh, *triangle)) {
        return Err(ObjError::NoArea { path: path.into(), triangles: mesh.triangles.len() });
    }
    // Slot 0 is what an empty list means.
    mesh.slots = if screened.materials.len() > 1 { slots } else { Vec::new() };
    mesh.uvs = corners.uvs;
    let (mesh, normals_from_file) = match options.normals {
        ObjNormals::FileOrComputed { crease_angle } => with_normals(mesh, &corners.normals, crease_angle),
        ObjNormals::OfPositions if corners.origins.is_empty() => (mesh.with_vertex_normals(), false),
        ObjNormals::OfPositions => (mesh.with_normals_of_vertices(|vertex| corners.origins[vertex as usize]), false),
        ObjNormals::Ignore => (mesh, false),
    };
    mesh.validate().map_err(mesh_error)?;
    let mut of_materials = Warnings::default();
    let (materials, libraries) = find_materials(path, screened, options.max_library_bytes, &mut of_materials);
    let polygons = parsed.face_arities.iter().filter(|&&corners| corners > 3).count();
    let (warnings, material_warnings) = (warnings.into_list(), of_materials.into_list());
    Ok(ImportedObj { mesh, materials, libraries, normals_from_file, polygons, warnings, material_warnings })
}

/// Differences and products of `f32` numbers are exact enough in `f64` for corners on a line to give exactly nothing.
fn has_area(mesh: &Mesh, triangle: [u32; 3]) -> bool {
    let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize].as_dvec3());
    (b - a).cross(c - a) != DVec3::ZERO
}

fn read(path: &Path, limit: u64) -> Result<Vec<u8>, ObjError> {
    InputFile::open_within(path, FileKind::Model, limit)
        .and_then(InputFile::bytes)
        .map_err(|source| ObjError::Read { path: path.into(), source })
}

fn parse(text: &[u8]) -> Result<tobj::Mesh, tobj::LoadError> {
    // Polygons are cut here and not by tobj, whose fans turn concave ones inside out.
    let options = tobj::LoadOptions { single_index: false, triangulate: false, ..Default::default() };
    let (mut models, _) =
        tobj::load_obj_buf(&mut Cursor::new(text), &options, |_| Err(tobj::LoadError::OpenFileFailed))?;
    models.pop().map(|model| model.mesh).ok_or(tobj::LoadError::GenericFailure)
}

/// One vertex for each different (position, texture coordinate, normal) that corners use.
struct Corners {
    /// The vertex of each corner, in file order.
    vertices: Vec<u32>,
    positions: Vec<DVec3>,
    /// Which position of the file each vertex has; empty where they are the same.
    origins: Vec<u32>,
    uvs: Vec<Vec2>,
    /// As the file has them: any length, zero where missing.
    normals: Vec<Vec3>,
}

impl Corners {
    fn of(parsed: &tobj::Mesh) -> Self {
        let position = |i: u32| DVec3::from_slice(&parsed.positions[3 * i as usize..]);
        if parsed.texcoords.is_empty() && parsed.normals.is_empty() {
            let count = parsed.positions.len() as u32 / 3;
            let positions = (0..count).map(position).collect();
            let vertices = parsed.indices.clone();
            return Self { vertices, positions, origins: Vec::new(), uvs: Vec::new(), normals: Vec::new() };
        }
        let mut found: HashMap<(u32, u32, u32), u32> = HashMap::with_capacity(parsed.positions.len() / 3);
        let mut corners = Self {
            vertices: Vec::new(),
            positions: Vec::new(),
            origins: Vec::new(),
            uvs: Vec::new(),
            normals: Vec::new(),
        };
        for (k, &index) in parsed.indices.iter().enumerate() {
            let uv = parsed.texcoord_indices.get(k).copied();
            let normal = parsed.normal_indices.get(k).copied();
            let next = found.len() as u32;
            let vertex = *found.entry((index, uv.unwrap_or(0), normal.unwrap_or(0))).or_insert(next);
            corners.vertices.push(vertex);
            if vertex == next {
                corners.positions.push(position(index));
                corners.origins.push(index);
                if let Some(i) = uv {
                    let at = 2 * i as usize;
                    corners.uvs.push(Vec2::new(parsed.texcoords[at] as f32, parsed.texcoords[at + 1] as f32));
                }
                if let Some(i) = normal {
                    let normal = DVec3::from_slice(&parsed.normals[3 * i as usize..]);
                    corners.normals.push(normal.normalize_or_zero().as_vec3());
                }
            }
        }
        corners
    }

    /// Triangles, their slots, and how many were left out because two corners are one vertex of the file.
    fn triangles(&self, parsed: &tobj::Mesh, face_materials: &[u32]) -> (Vec<[u32; 3]>, Vec<u16>, usize) {
        let mut triangles = Vec::with_capacity(self.vertices.len() / 3);
        let mut slots = Vec::with_capacity(self.vertices.len() / 3);
        let (mut dropped, mut start) = (0, 0);
        let (mut polygon, mut cut) = (Vec::new(), Vec::new());
        for (face, &material) in face_materials.iter().enumerate() {
            let count = parsed.face_arities.get(face).map_or(3, |&count| count as usize);
            cut.clear();
            if count == 3 {
                cut.push([0, 1, 2]);
            } else {
                polygon.clear();
                polygon.extend((start..start + count).map(|k| self.positions[self.vertices[k] as usize]));
                polygon::triangulate(&polygon, &mut cut);
            }
            for corners in &cut {
                let [a, b, c] = corners.map(|k| parsed.indices[start + k]);
                if a == b || b == c || c == a {
                    dropped += 1;
                } else {
                    triangles.push(corners.map(|k| self.vertices[start + k]));
                    slots.push(material as u16);
                }
            }
            start += count;
        }
        (triangles, slots, dropped)
    }
}

/// Uses the file's normals where they have a length, computed ones elsewhere; says whether all were the file's.
fn with_normals(mesh: Mesh, from_file: &[Vec3], crease_angle: f32) -> (Mesh, bool) {
    let missing = from_file.iter().filter(|n| **n == Vec3::ZERO).count();
    if from_file.is_empty() || missing == from_file.len() {
        return (mesh.with_smooth_normals(NormalWeight::Angle, Some(crease_angle)), false);
    }
    if missing == 0 {
        return (Mesh { normals: from_file.to_vec(), ..mesh }, true);
    }
    // A crease would split vertices whose normals the file has given.
    let mut mesh = mesh.with_smooth_normals(NormalWeight::Angle, None);
    for (normal, &given) in mesh.normals.iter_mut().zip(from_file) {
        if given != Vec3::ZERO {
            *normal = given;
        }
    }
    (mesh, false)
}

fn find_materials(
    path: &Path,
    screened: screen::Screened,
    max_bytes: u64,
    warnings: &mut Warnings,
) -> (Vec<ImportedMaterial>, Vec<PathBuf>) {
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut known: HashMap<String, ImportedMaterial> = HashMap::new();
    let mut seen = Vec::new();
    for line in screened.libraries.iter().take(MAX_LIBRARIES) {
        // A name may hold spaces, and a line may hold several names.
        let whole = line.replace('\\', "/");
        let names: Vec<&str> =
            if folder.join(text_to_path(&whole)).exists() { vec![&whole] } else { whole.split_whitespace().collect() };
        for name in names {
            let library = folder.join(text_to_path(name));
            if !seen.contains(&library) {
                let materials = mtl::load_library(&library, max_bytes, warnings);
                known.extend(materials.into_iter().map(|material| (material.name.clone(), material)));
                seen.push(library);
            }
        }
    }
    let mut missing = Vec::new();
    let mut find = |name: String| match known.get(&name) {
        Some(material) => material.clone(),
        None => {
            if !name.is_empty() {
                missing.push(name.clone());
            }
            ImportedMaterial { name, ..ImportedMaterial::default() }
        }
    };
    let materials = screened.materials.into_iter().map(&mut find).collect();
    if !missing.is_empty() {
        let more = if missing.len() > 3 { ", …" } else { "" };
        warnings.push(format!(
            "{}: {} materials were not found and get default values: {}{more}",
            path.display(),
            missing.len(),
            missing[..missing.len().min(3)].join(", ")
        ));
    }
    seen.retain(|library| library.is_file());
    (materials, seen)
}
