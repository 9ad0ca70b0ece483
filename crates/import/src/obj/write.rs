//! Writing of meshes as OBJ files.

use crate::error::obj::ObjError;
use firstlight_files::input_file::{FileKind, InputFile};
use firstlight_files::whole_file::{Replace, WholeFile, unwritable};
use firstlight_mesh::Mesh;
use firstlight_render::encode_srgb;
use glam::Vec3;
use std::collections::HashMap;
use std::ffi::OsStr;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

/// Additional contents of the file.
#[derive(Clone, Copy, Debug, Default)]
pub struct ObjExtras<'a> {
    /// Name of each material slot; missing and empty names are not written.
    pub materials: &'a [String],
    /// Paths of material libraries, relative to the working directory.
    pub libraries: &'a [PathBuf],
    /// A comment for the first line.
    pub comment: &'a str,
}

/// Writes a mesh in the coordinates of its original file; all numbers read back exactly, colours with 8 bits.
///
/// Writes atomically: under a temporary name first, so that an existing file stays until the new one is complete.
///
/// # Errors
/// If the file cannot be written.
pub fn save_obj(path: &Path, mesh: &Mesh, extras: &ObjExtras) -> Result<(), ObjError> {
    let mut file = WholeFile::begin(path, Replace::AllButFilms)?;
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    write(&mut file, mesh, extras, folder).map_err(|error| unwritable(path, error))?;
    Ok(file.finish()?)
}

/// Result of [`save_new_obj`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NewObj {
    /// Written as it is.
    Written,
    /// The existing file is exactly this mesh.
    Same,
    /// Another file has this name.
    Taken,
}

/// Like [`save_obj`], but replaces no existing file.
pub fn save_new_obj(path: &Path, mesh: &Mesh, extras: &ObjExtras) -> Result<NewObj, ObjError> {
    if !path.exists() {
        return save_obj(path, mesh, extras).map(|()| NewObj::Written);
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut bytes = Vec::new();
    write(&mut bytes, mesh, extras, folder).map_err(|error| unwritable(path, error))?;
    let old = InputFile::open_within(path, FileKind::Model, u64::MAX).map_err(std::io::Error::other).and_then(|file| {
        let mut old = Vec::new();
        // One more byte detects a longer file.
        file.take(bytes.len() as u64 + 1).read_to_end(&mut old).map(|_| old)
    });
    Ok(if old.is_ok_and(|old| old == bytes) { NewObj::Same } else { NewObj::Taken })
}

fn write(out: &mut impl Write, mesh: &Mesh, extras: &ObjExtras, folder: &Path) -> std::io::Result<()> {
    for line in extras.comment.lines() {
        writeln!(out, "# {line}")?;
    }
    for library in extras.libraries {
        // A relative path would be wrong from the folder of the file.
        let beside = library.parent().is_some_and(|parent| same_folder(parent, folder));
        match library.file_name() {
            Some(name) if beside => mtllib(out, name)?,
            _ => mtllib(out, std::path::absolute(library)?.as_os_str())?,
        }
    }
    // Vertices that differ only in texture coordinate or normal share a position, so that a closed surface stays closed
    // in terms of position indices.
    let places = write_positions(out, mesh)?;
    let uvs = Distinct::of(&mesh.uvs);
    for [u, v] in uvs.values.iter().map(|uv| uv.to_array()) {
        writeln!(out, "vt {u} {v}")?;
    }
    let normals = Distinct::of(&mesh.normals);
    for [x, y, z] in normals.values.iter().map(|normal| normal.to_array()) {
        writeln!(out, "vn {x} {y} {z}")?;
    }
    let mut current = None;
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let slot = mesh.slots.get(t).copied().unwrap_or(0);
        if current != Some(slot) {
            current = Some(slot);
            if let Some(name) = extras.materials.get(usize::from(slot)).filter(|name| !name.is_empty()) {
                writeln!(out, "usemtl {name}")?;
            }
        }
        write!(out, "f")?;
        for vertex in triangle.map(|vertex| vertex as usize) {
            let numbers = [&places, &uvs.numbers, &normals.numbers].map(|numbers| numbers.get(vertex));
            match numbers {
                [Some(v), None, None] => write!(out, " {v}")?,
                [Some(v), Some(vt), None] => write!(out, " {v}/{vt}")?,
                [Some(v), None, Some(vn)] => write!(out, " {v}//{vn}")?,
                [Some(v), Some(vt), Some(vn)] => write!(out, " {v}/{vt}/{vn}")?,
                [None, ..] => unreachable!("a mesh's triangles name its vertices"),
            }
        }
        writeln!(out)?;
    }
    Ok(())
}

/// Returns the number of each vertex's position, from 1.
fn write_positions(out: &mut impl Write, mesh: &Mesh) -> std::io::Result<Vec<u32>> {
    let in_file = |position: Vec3| (position.as_dvec3() + mesh.center).to_array();
    if mesh.colors.is_empty() {
        let places = Distinct::of(&mesh.positions);
        for [x, y, z] in places.values.iter().map(|&position| in_file(position)) {
            writeln!(out, "v {x} {y} {z}")?;
        }
        return Ok(places.numbers);
    }
    let byte = |linear: f32| f32::from(encode_srgb(linear)) / 255.0;
    let points: Vec<[f32; 6]> = (mesh.positions.iter().zip(&mesh.colors))
        .map(|(position, color)| [position.x, position.y, position.z, byte(color.x), byte(color.y), byte(color.z)])
        .collect();
    let places = Distinct::of(&points);
    for &[x, y, z, r, g, b] in &places.values {
        let [x, y, z] = in_file(Vec3::new(x, y, z));
        writeln!(out, "v {x} {y} {z} {r} {g} {b}")?;
    }
    Ok(places.numbers)
}

/// Writes the bytes of the name, whatever their encoding.
fn mtllib(out: &mut impl Write, name: &OsStr) -> std::io::Result<()> {
    out.write_all(b"mtllib ")?;
    out.write_all(name.as_encoded_bytes())?;
    writeln!(out)
}

/// Distinct values in the order of first occurrence, and the index of each element's value, from 1.
struct Distinct<V> {
    values: Vec<V>,
    numbers: Vec<u32>,
}

impl<V: Copy> Distinct<V> {
    fn of<const N: usize>(list: &[V]) -> Self
    where
        V: Into<[f32; N]>,
    {
        let mut known = HashMap::new();
        let mut values = Vec::new();
        let number = |&value: &V| {
            *known.entry(value.into().map(f32::to_bits)).or_insert_with(|| {
                values.push(value);
                values.len() as u32
            })
        };
        let numbers = list.iter().map(number).collect();
        Self { values, numbers }
    }
}

fn same_folder(a: &Path, b: &Path) -> bool {
    let canonical = |path: &Path| if path.as_os_str().is_empty() { Path::new(".") } else { path }.canonicalize();
    matches!((canonical(a), canonical(b)), (Ok(a), Ok(b)) if a == b)
}
