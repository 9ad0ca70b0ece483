//! Wavefront OBJ and MTL: reads a file as one mesh with material slots, and leaves out what it cannot use.
//!
//! The file is parsed in `f64` (`parse`; materials by tobj). Then polygons are triangulated, corners with the same
//! position, texture coordinate and normal share a vertex (across groups too), and missing normals are computed. Start
//! reading at [`load_obj`]; [`save_obj`] is the inverse.

pub(crate) mod colors;
pub(crate) mod lines;
pub(crate) mod mtl;
pub(crate) mod parse;
pub(crate) mod repair;
pub mod write;

pub use crate::error::obj::ObjError;
pub use crate::model::material::{ImportedMaterial, PbrMaterial};
pub use crate::model::texture_map::TextureMap;
pub use write::{ObjExtras, save_obj};

use crate::model::imported::{ImportedModel, ModelNormals, ModelOptions, has_area, with_normals};
use crate::model::polygon;
use crate::obj::parse::{Corner, ParsedObj};
use firstlight_files::input_file::{FileKind, InputFile};
use firstlight_files::reference::References;
use firstlight_files::warnings::Warnings;
use firstlight_mesh::Mesh;
use glam::{DVec2, DVec3, DVec4, Vec2, Vec3, Vec4};
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

/// Words of a name among several in an `mtllib` line.
const MOST_WORDS: usize = 8;

/// Further names in `mtllib` lines are ignored, with a warning.
const MAX_LIBRARIES: usize = 256;

/// [`load_obj_with`] with the default options.
///
/// # Errors
/// Like [`load_obj_with`].
pub fn load_obj(path: &Path) -> Result<ImportedModel, ObjError> {
    load_obj_with(path, &ModelOptions::default())
}

/// Loads a model and its material libraries.
///
/// The fourth coordinate of vertices, lines and points are ignored. Normals of length zero count as missing. What a face
/// can do without is repaired with a warning, and so are a missing library or material.
///
/// # Errors
/// If the file cannot be read or has no mesh.
pub fn load_obj_with(path: &Path, options: &ModelOptions) -> Result<ImportedModel, ObjError> {
    let bytes = read(path, options.max_bytes)?;
    let mut parsed = parse::parse(&bytes);
    if parsed.face_materials.is_empty() {
        return Err(ObjError::NoFaces { path: path.into(), reason: reason_of_no_faces(&bytes, &parsed) });
    }
    drop(bytes);
    if parsed.materials.len() > usize::from(u16::MAX) + 1 {
        return Err(ObjError::TooManyMaterials { path: path.into() });
    }
    let mut warnings = Warnings::default();
    for sentence in parsed.repairs.sentences() {
        warnings.push(format!("{}: {sentence}", path.display()));
    }
    if parsed.lines_and_points > 0 {
        warnings.push(format!("{}: {} line or point elements were ignored", path.display(), parsed.lines_and_points));
    }
    if !matches!(options.normals, ModelNormals::FileOrComputed { .. }) {
        parsed.normals.clear();
    }
    let mut corners = MeshCorners::of(&parsed);
    let (triangles, slots, dropped) = corners.triangles(&parsed);
    let polygons = parsed.arities.iter().filter(|&&corners| corners > 3).count();
    // Computing normals takes most memory: what is no longer needed goes before.
    parsed.leave_names();
    corners.vertices = Vec::new();
    if dropped > 0 {
        warnings.push(format!("{}: {dropped} triangles use a vertex twice and were removed", path.display()));
    }
    if triangles.is_empty() {
        return Err(ObjError::NoArea { path: path.into(), triangles: dropped });
    }
    let mesh_error = |source| ObjError::Mesh { path: path.into(), source };
    let mut mesh = Mesh::from_f64(&corners.positions, triangles).map_err(mesh_error)?;
    corners.positions = Vec::new();
    if !mesh.triangles.iter().any(|triangle| has_area(&mesh, *triangle)) {
        return Err(ObjError::NoArea { path: path.into(), triangles: mesh.triangles.len() });
    }
    // An empty list means slot 0 everywhere.
    mesh.slots = if parsed.materials.len() > 1 { slots } else { Vec::new() };
    (mesh.uvs, mesh.colors) = (corners.uvs, corners.colors);
    let (mut mesh, normals_from_file) = match options.normals {
        ModelNormals::FileOrComputed { crease_angle } => with_normals(mesh, &corners.normals, crease_angle),
        ModelNormals::OfPositions if corners.origins.is_empty() => (mesh.with_vertex_normals(), false),
        ModelNormals::OfPositions => (mesh.with_normals_of_vertices(|vertex| corners.origins[vertex as usize]), false),
        ModelNormals::Ignore => (mesh, false),
    };
    mesh.validate().map_err(mesh_error)?;
    let mut of_materials = Warnings::default();
    let (mut materials, libraries) = find_materials(path, parsed, options, &mut of_materials);
    if !mesh.colors.is_empty() && !use_vertex_colors(&mut materials, &mesh, &mut of_materials) {
        mesh.colors = Vec::new();
    }
    Ok(ImportedModel {
        mesh,
        materials,
        libraries,
        normals_from_file,
        polygons,
        warnings,
        material_warnings: of_materials,
    })
}

fn read(path: &Path, limit: u64) -> Result<Vec<u8>, ObjError> {
    InputFile::open_within(path, FileKind::Model, limit)
        .and_then(InputFile::bytes)
        .map_err(|source| ObjError::Read { path: path.into(), source })
}

/// What a file without usable faces has instead, and what to do.
fn reason_of_no_faces(bytes: &[u8], parsed: &ParsedObj) -> String {
    let problems: Vec<String> = parsed.repairs.sentences().collect();
    if !problems.is_empty() {
        return format!(" that can be used: {}", problems.join("; "));
    }
    if parsed.lines_and_points > 0 {
        return format!(": its {} line or point elements have no surface", parsed.lines_and_points);
    }
    if bytes.iter().take(16).filter(|&&byte| byte == 0).count() > 4 {
        return ": it looks like UTF-16 without a byte order mark; save it as UTF-8".to_owned();
    }
    ": is it a Wavefront OBJ file?".to_owned()
}

/// Lets vertex colours replace the diffuse colours of materials without a texture; returns whether there are any.
///
/// With a texture they would darken it: photogrammetry writes the same colours in both.
fn use_vertex_colors(materials: &mut [ImportedMaterial], mesh: &Mesh, warnings: &mut Warnings) -> bool {
    let mean = mesh.colors.iter().map(|color| color.as_dvec4()).sum::<DVec4>() / mesh.colors.len() as f64;
    let mut used = false;
    for material in materials.iter_mut() {
        // ZBrush names an image that few people pass on.
        if let Some(lost) = material.diffuse_texture.take_if(|map| !map.path.exists()) {
            let path = lost.path.display();
            warnings.push(format!("{path}: cannot be read: no such file; the vertex colours are shown instead"));
        }
    }
    for material in materials.iter_mut().filter(|material| material.diffuse_texture.is_none()) {
        (used, material.vertex_colors, material.diffuse) = (true, true, Some(mean.truncate().as_vec3()));
        if material.name.is_empty() {
            material.name = "vertex colors".to_owned();
        }
    }
    used
}

/// One vertex for each distinct (position, texture coordinate, normal) of the corners.
struct MeshCorners {
    /// The vertex of each corner, in file order.
    vertices: Vec<u32>,
    positions: Vec<DVec3>,
    /// Index of the position in the file for each vertex; empty if they are the same.
    origins: Vec<u32>,
    uvs: Vec<Vec2>,
    /// Linear Rec. 709; empty if the file has none.
    colors: Vec<Vec4>,
    /// As in the file: any length, zero if missing.
    normals: Vec<Vec3>,
}

impl MeshCorners {
    /// Without unused values, in the order of first use.
    fn of(parsed: &ParsedObj) -> Self {
        let (has_uvs, has_normals) = (!parsed.uvs.is_empty(), !parsed.normals.is_empty());
        let mut corners = Self {
            vertices: Vec::with_capacity(parsed.corners.len()),
            positions: Vec::new(),
            origins: Vec::new(),
            uvs: Vec::new(),
            colors: Vec::new(),
            normals: Vec::new(),
        };
        let colors = colors::vertex_colors(parsed);
        // By index in the file: its index among the used positions.
        let mut used = vec![u32::MAX; parsed.positions.len()];
        let mut n_used = 0;
        let mut found: HashMap<Corner, u32> = HashMap::new();
        for &[position, uv, normal] in &parsed.corners {
            let number = &mut used[position as usize - 1];
            let is_new = *number == u32::MAX;
            if is_new {
                (*number, n_used) = (n_used, n_used + 1);
            }
            let next = corners.positions.len() as u32;
            if !has_uvs && !has_normals {
                corners.vertices.push(*number);
                if is_new {
                    corners.positions.push(parsed.positions[position as usize - 1]);
                    corners.colors.extend(colors.get(position as usize - 1));
                }
                continue;
            }
            let normal = if has_normals { normal } else { 0 };
            let vertex = *found.entry([position, uv, normal]).or_insert(next);
            corners.vertices.push(vertex);
            if vertex == next {
                corners.positions.push(parsed.positions[position as usize - 1]);
                corners.origins.push(*number);
                corners.colors.extend(colors.get(position as usize - 1));
                if has_uvs {
                    let uv = (uv as usize).checked_sub(1).map_or(DVec2::ZERO, |i| parsed.uvs[i]);
                    corners.uvs.push(uv.as_vec2());
                }
                if has_normals {
                    let normal = (normal as usize).checked_sub(1).map_or(DVec3::ZERO, |i| parsed.normals[i]);
                    corners.normals.push(normal.normalize_or_zero().as_vec3());
                }
            }
        }
        corners
    }

    /// Triangles, their slots, and the number of triangles that were removed because two corners have the same position
    /// index.
    fn triangles(&self, parsed: &ParsedObj) -> (Vec<[u32; 3]>, Vec<u16>, usize) {
        let mut triangles = Vec::with_capacity(self.vertices.len() / 3);
        let mut slots = Vec::with_capacity(self.vertices.len() / 3);
        let (mut dropped, mut start) = (0, 0);
        let (mut polygon, mut cut) = (Vec::new(), Vec::new());
        for (&count, &material) in parsed.arities.iter().zip(&parsed.face_materials) {
            let count = count as usize;
            cut.clear();
            if count == 3 {
                cut.push([0, 1, 2]);
            } else {
                polygon.clear();
                polygon.extend((start..start + count).map(|k| self.positions[self.vertices[k] as usize]));
                polygon::triangulate(&polygon, &mut cut);
            }
            for corners in &cut {
                let [a, b, c] = corners.map(|k| parsed.corners[start + k][0]);
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

fn find_materials(
    path: &Path,
    parsed: ParsedObj,
    options: &ModelOptions,
    warnings: &mut Warnings,
) -> (Vec<ImportedMaterial>, Vec<PathBuf>) {
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut known: HashMap<String, ImportedMaterial> = HashMap::new();
    let files = References::of(path, options.allow_outside);
    let (mut seen, mut has_materials, mut n_names) = (HashSet::new(), Vec::new(), 0);
    for line in &parsed.libraries {
        // A name may contain spaces, and a line may contain several names, and a comment.
        let is_file = |name: &str| files.resolve(folder, name).is_ok_and(|file| folder.join(file.path).exists());
        let names = match [line, before_comment(line)].into_iter().find(|name| is_file(name)) {
            Some(name) => vec![name.to_owned()],
            None => names_of(before_comment(line), is_file),
        };
        for name in &names {
            n_names += 1;
            if n_names > MAX_LIBRARIES {
                warnings.push(format!(
                    "{}: names more than {MAX_LIBRARIES} libraries: only these are read",
                    path.display()
                ));
                return with_materials(path, parsed, known, has_materials, warnings);
            }
            let library = match files.resolve(folder, name) {
                Ok(file) => {
                    if let Some(difference) = file.difference(name) {
                        warnings.push(format!("{}: {difference}", path.display()));
                    }
                    folder.join(file.path)
                }
                Err(outside) => {
                    warnings.push(format!("{}: {outside}; its materials use default values", path.display()));
                    continue;
                }
            };
            if seen.insert(library.clone()) {
                let materials = mtl::load_library(&library, &files, options.max_library_bytes, warnings);
                // Any text can be named here; only what has materials is a library.
                has_materials.extend((!materials.is_empty()).then(|| library.clone()));
                known.extend(materials.into_iter().map(|material| (material.name.clone(), material)));
            }
        }
    }
    with_materials(path, parsed, known, has_materials, warnings)
}

/// Several names, separated by spaces, which they may have too: the longest that are files. A space may follow a
/// backslash.
fn names_of(line: &str, is_file: impl Fn(&str) -> bool) -> Vec<String> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let (mut names, mut rest) = (Vec::new(), &words[..]);
    while !rest.is_empty() && names.len() <= MAX_LIBRARIES {
        let name = |n: usize| rest[..n].join(" ").replace("\\ ", " ");
        let n = (2..=rest.len().min(MOST_WORDS)).rev().find(|n| is_file(&name(*n))).unwrap_or(1);
        names.push(name(n));
        rest = &rest[n..];
    }
    names
}

/// What is before a comment at the end of a line, which names of 3ds Max look like: `Mat #1`.
fn before_comment(text: &str) -> &str {
    text.split_once(" #").map_or(text, |(before, _)| before.trim_end())
}

/// The materials of the faces, as far as the libraries have them.
fn with_materials(
    path: &Path,
    parsed: ParsedObj,
    known: HashMap<String, ImportedMaterial>,
    libraries: Vec<PathBuf>,
    warnings: &mut Warnings,
) -> (Vec<ImportedMaterial>, Vec<PathBuf>) {
    let mut missing = Vec::new();
    let mut find = |name: String| match known.get(&name).or_else(|| known.get(before_comment(&name))) {
        Some(material) => material.clone(),
        None => {
            if !name.is_empty() {
                missing.push(name.clone());
            }
            ImportedMaterial { name, ..ImportedMaterial::default() }
        }
    };
    let materials = parsed.materials.into_iter().map(&mut find).collect();
    if !missing.is_empty() {
        let more = if missing.len() > 3 { ", …" } else { "" };
        let names = missing[..missing.len().min(3)].join(", ");
        let what = match missing.len() {
            1 => "1 material was not found and uses default values".to_owned(),
            n => format!("{n} materials were not found and use default values"),
        };
        warnings.push(format!("{}: {what}: {names}{more}", path.display()));
    }
    (materials, libraries)
}
