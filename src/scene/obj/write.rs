//! Meshes back into OBJ files.

use super::ObjError;
use crate::mesh::Mesh;
use crate::scene::whole_file::{WholeFile, unwritable};
use std::fmt::Display;
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
    for position in &mesh.positions {
        let [x, y, z] = (position.as_dvec3() + mesh.center).to_array();
        writeln!(out, "v {x} {y} {z}")?;
    }
    for [u, v] in mesh.uvs.iter().map(|uv| uv.to_array()) {
        writeln!(out, "vt {u} {v}")?;
    }
    for [x, y, z] in mesh.normals.iter().map(|normal| normal.to_array()) {
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
        let [a, b, c] = triangle.map(|vertex| vertex + 1);
        match (mesh.uvs.is_empty(), mesh.normals.is_empty()) {
            (true, true) => writeln!(out, "f {a} {b} {c}")?,
            (false, true) => writeln!(out, "f {a}/{a} {b}/{b} {c}/{c}")?,
            (true, false) => writeln!(out, "f {a}//{a} {b}//{b} {c}//{c}")?,
            (false, false) => writeln!(out, "f {} {} {}", all(a), all(b), all(c))?,
        }
    }
    Ok(())
}

fn all(vertex: u32) -> impl Display {
    std::fmt::from_fn(move |f| write!(f, "{vertex}/{vertex}/{vertex}"))
}

fn same_folder(a: &Path, b: &Path) -> bool {
    let canonical = |path: &Path| if path.as_os_str().is_empty() { Path::new(".") } else { path }.canonicalize();
    matches!((canonical(a), canonical(b)), (Ok(a), Ok(b)) if a == b)
}
