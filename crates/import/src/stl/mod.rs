//! STL (stereolithography): unconnected triangles, in text or binary form.
//!
//! Corners with exactly equal positions become one vertex, so that the mesh is connected; facet normals are ignored,
//! since they are redundant. A facet that is broken is left out. Start reading at [`load_stl_with`].

mod binary;
mod soup;
mod text;

pub use crate::error::stl::StlProblem;

use crate::error::{ModelError, ModelProblem, Place};
use crate::model::assemble::{Indexed, assemble};
use crate::model::imported::{ImportedModel, ModelOptions};
use crate::model::material::ImportedMaterial;
use crate::stl::soup::{Soup, is_plain};
use firstlight_files::input_file::{FileKind, InputFile};
use firstlight_files::warnings::Warnings;
use firstlight_mesh::Welding;
use firstlight_render::decode_srgb;
use std::path::Path;

/// Loads all solids of an STL file as one mesh; detects from the contents whether it is text or binary.
///
/// # Errors
/// If the file cannot be read, or is not a model with surface area.
pub fn load_stl_with(path: &Path, options: &ModelOptions) -> Result<ImportedModel, ModelError> {
    let bytes = InputFile::open_within(path, FileKind::Model, options.max_bytes)
        .and_then(InputFile::bytes)
        .map_err(|error| ModelError::of(path, Place::File, error))?;
    let parsed = if is_text(&bytes) { text::parse(&bytes) } else { binary::parse(&bytes) };
    let Soup { corners, slots, colors, polygons, left_out, notes } =
        parsed.map_err(|(place, problem)| ModelError::of(path, place, problem))?;
    drop(bytes);
    let failed = |problem: StlProblem| ModelError::of(path, Place::File, ModelProblem::Stl(problem));
    if corners.is_empty() {
        return Err(failed(if left_out > 0 { StlProblem::NotFinite { facets: left_out } } else { StlProblem::Empty }));
    }
    if u32::try_from(corners.len()).is_err() {
        return Err(failed(StlProblem::TooMany));
    }
    let mut warnings = Warnings::default();
    if left_out > 0 {
        let what = "facets have a coordinate that is NaN or infinite, or fewer than three vertices, and were removed";
        warnings.push(format!("{}: {left_out} {what}", path.display()));
    }
    notes.into_iter().for_each(|note| warnings.push(format!("{}: {note}", path.display())));
    let welding = Welding::of_f64(&corners);
    let model = Indexed {
        positions: welding.first.iter().map(|&corner| corners[corner as usize]).collect(),
        triangles: welding.place.chunks_exact(3).map(|corners| [corners[0], corners[1], corners[2]]).collect(),
        slots,
        ..Indexed::default()
    };
    drop((corners, welding));
    let material = |color: &[u8; 3]| ImportedMaterial {
        name: hex(*color),
        diffuse: Some(color.map(|byte| decode_srgb(f64::from(byte) / 255.0) as f32).into()),
        ..ImportedMaterial::default()
    };
    let materials =
        if colors.is_empty() { vec![ImportedMaterial::default()] } else { colors.iter().map(material).collect() };
    let (mesh, normals_from_file) = assemble(path, model, options, &mut warnings)?;
    Ok(ImportedModel {
        mesh,
        materials,
        libraries: Vec::new(),
        normals_from_file,
        polygons,
        warnings,
        material_warnings: Warnings::default(),
    })
}

fn hex([r, g, b]: [u8; 3]) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// Text begins with `solid`, but so do the headers of many binary files: those are detected by their length, or by
/// bytes that text does not contain.
fn is_text(bytes: &[u8]) -> bool {
    if binary::has_right_length(bytes) {
        return false;
    }
    let mut start = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    while start.starts_with(b"#") {
        let end = start.iter().position(|&byte| byte == b'\n' || byte == b'\r').unwrap_or(start.len());
        start = start[end..].trim_ascii_start();
    }
    let begins_with = |word: &[u8]| start.get(..word.len()).is_some_and(|first| first.eq_ignore_ascii_case(word));
    (begins_with(b"solid") || begins_with(b"facet")) && bytes.iter().take(1024).all(is_plain)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn binary_files_that_begin_like_text_are_binary() {
        let mut binary = b"solid of a program".to_vec();
        binary.resize(80, b' ');
        binary.extend(1_u32.to_le_bytes());
        binary.extend([0; 50]);
        assert!(!is_text(&binary));
        binary.pop();
        assert!(!is_text(&binary), "a truncated file is still binary");
        assert!(is_text(b"solid a\nendsolid a\n") && is_text(b" SOLID\n") && is_text(b"facet normal 0 0 1"));
        assert!(is_text(b"# of a program\n# a part\nsolid a\nendsolid a\n"));
        assert!(!is_text(b"") && !is_text(b"ply\n"));
    }
}
