//! Meshes back into OBJ files.

use super::ObjError;
use crate::mesh::Mesh;
use crate::scene::whole_file::{WholeFile, unwritable};
use std::collections::HashMap;
use std::io::Write;
use std::path::{Path, PathBuf};

/// What stands around the mesh in its file.
#[derive(Clone, Copy, Debug, Default)]
pub struct ObjExtras<'a> {
    /// Name of each material slot; where one is missing or empty, nothing is written.
    pub materials: &'a [String],
    /// Material libraries, with paths that lead there from here.
    pub libraries: &'a [PathBuf],
    /// A line of comment for the top.
    pub comment: &'a str,
}

/// Writes a mesh in the coordinates of the file it came from: every number reads back as the one written.
///
/// Appears whole or not at all: it is written beside `path` under another name first, and a file that was there
/// stays until the new one is complete.
pub fn save_obj(path: &Path, mesh: &Mesh, extras: &ObjExtras) -> Result<(), ObjError> {
    let mut file = WholeFile::begin(path).map_err(ObjError::Write)?;
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    write(&mut file, mesh, extras, folder).map_err(|error| ObjError::Write(unwritable(path, &error)))?;
    file.finish().map_err(ObjError::Write)
}

fn write(out: &mut impl Write, mesh: &Mesh, extras: &ObjExtras, folder: &Path) -> std::io::Result<()> {
    for line in extras.comment.lines() {
        writeln!(out, "# {line}")?;
    }
    for library in extras.libraries {
        // A path from here would be wrong from the file's own folder.
        let beside = library.parent().is_some_and(|parent| same_folder(parent, folder));
        match library.file_name() {
            Some(name) if beside => writeln!(out, "mtllib {}", Path::new(name).display())?,
            _ => writeln!(out, "mtllib {}", std::path::absolute(library)?.display())?,
        }
    }
    // Vertices that differ in texture coordinate or normal alone share a place, so that a closed surface is closed for
    // whoever goes by the numbers of places.
    let places = Distinct::of(&mesh.positions);
    for place in &places.values {
        let [x, y, z] = (place.as_dvec3() + mesh.center).to_array();
        writeln!(out, "v {x} {y} {z}")?;
    }
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
            let numbers = [&places.numbers, &uvs.numbers, &normals.numbers].map(|numbers| numbers.get(vertex));
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

/// Values in the order in which they come first, and for each element the number of its own, from 1.
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
