//! PLY (Stanford polygon files): ASCII and binary of both byte orders, any elements and properties in any order; also
//! compressed as a whole (`.ply.gz`).
//!
//! The header declares the rows of each element (`header`); values are read in sequence from text or bytes (`rows`),
//! and those of the mesh are kept: `vertices` with normals, texture coordinates and colours; `faces` and triangle
//! strips with texture coordinates of corners, textures and colours of their own. Memory for declared elements is
//! allocated only after checking that the file is long enough. Start reading at [`load_ply_with`].

pub(crate) mod faces;
pub(crate) mod header;
pub(crate) mod rows;
pub(crate) mod vertices;

pub use crate::error::ply::PlyProblem;

use crate::error::{ModelError, Place};
use crate::model::assemble::assemble;
use crate::model::imported::{ImportedModel, ModelOptions};
use crate::model::material::ImportedMaterial;
use crate::model::texture_map::TextureMap;
use crate::ply::faces::{Faces, NOWHERE};
use crate::ply::header::{Element, Encoding, Header};
use crate::ply::rows::{Bytes, Located, Rows, Text, skip_row};
use crate::ply::vertices::{ColourProperties, ColourSource, PlyVertices};
use firstlight_files::gzip::{decompressed, start_of_decompressed};
use firstlight_files::input_file::{FileKind, InputFile};
use firstlight_files::printable;
use firstlight_files::reference::References;
use firstlight_files::relative::path_to_text;
use firstlight_files::warnings::Warnings;
use std::io::Read;
use std::path::{Path, PathBuf};

/// Loads the faces and triangle strips of a PLY file as one mesh.
///
/// Normals of length zero count as missing. Colours are read as sRGB. Comments `TextureFile` name the images of the
/// materials. Faces that are broken are left out, with a warning; unsupported elements and properties give a warning.
///
/// # Errors
/// If the file cannot be read, or is not a model with surface area.
pub fn load_ply_with(path: &Path, options: &ModelOptions) -> Result<ImportedModel, ModelError> {
    load_ply_colored(path, options, ColourSource::Srgb)
}

/// Like [`load_ply_with`], with colours from elsewhere.
pub(crate) fn load_ply_colored(
    path: &Path,
    options: &ModelOptions,
    source: ColourSource,
) -> Result<ImportedModel, ModelError> {
    let bytes = InputFile::open_within(path, FileKind::Model, options.max_bytes)
        .and_then(InputFile::bytes)
        .and_then(|bytes| decompressed(bytes, FileKind::Model, options.max_bytes))
        .map_err(|error| ModelError::of(path, Place::File, error))?;
    let at = |(place, problem): Located| ModelError::of(path, place, problem);
    let header = Header::parse(&bytes).map_err(|(line, problem)| at((Place::Line(line), problem)))?;
    let Contents { vertices, mut faces, unused, long_rows } = Contents::of(&header, &bytes, source).map_err(at)?;
    drop(bytes);
    let mut warnings = Warnings::default();
    let mut warn = |text: String| warnings.push(format!("{}: {text}", path.display()));
    if let Some((line, count)) = &header.unknown {
        warn(format!("{count} lines of the header are not of the format and were ignored, such as `{line}`"));
    }
    if faces.too_short > 0 {
        warn(format!("{} faces have fewer than three corners and were removed", faces.too_short));
    }
    if long_rows > 0 {
        warn(format!("{long_rows} lines have more numbers than the properties in the header: the rest was ignored"));
    }
    if !unused.is_empty() {
        warn(format!("not modelled and ignored: {}", list(&unused)));
    }
    let told = |(place, problem): Located| ModelError::of(path, place, problem);
    if let Some(first) = faces.stray.take() {
        let stray = faces.leave_out(|vertex| vertex == NOWHERE);
        if faces.is_empty() {
            return Err(told(first));
        }
        warnings.push(format!("{}; {stray} faces with such a vertex were removed", told(first)));
    }
    if let Some(end) = faces.broken.take() {
        if faces.is_empty() {
            return Err(told(end));
        }
        warnings.push(format!("{}; what comes before is shown", told(end)));
    }
    let mut warn = |text: String| warnings.push(format!("{}: {text}", path.display()));
    let lost = faces.leave_out(|vertex| !vertices.indexed.positions[vertex as usize].is_finite());
    if lost > 0 && faces.is_empty() {
        return Err(ModelError::of(path, Place::File, PlyProblem::NotFinite { faces: lost }));
    }
    if lost > 0 {
        warn(format!("{lost} faces use a vertex whose position is not finite and were removed"));
    }
    if vertices.bad_uvs + faces.bad_uvs > 0 {
        let count = vertices.bad_uvs + faces.bad_uvs;
        warn(format!("{count} texture coordinates are missing or not finite: 0 is used"));
    }
    let has_uvs = !vertices.indexed.uvs.is_empty() || !faces.uvs.is_empty();
    let mut material_warnings = Warnings::default();
    let files = References::of(path, options.allow_outside);
    let images = images(path, &files, &header.textures, has_uvs, &mut material_warnings);
    let plain = if faces.colours.count > 0 { faces.colours.material() } else { vertices.colours.material() };
    let (materials, slots) = materials(plain, &images, faces.take_textures());
    let polygons = faces.polygons();
    let indexed = faces.meshed(vertices.indexed, slots);
    if indexed.triangles.is_empty() {
        return Err(ModelError::of(path, Place::File, PlyProblem::NoFaces));
    }
    let (mesh, normals_from_file) = assemble(path, indexed, options, &mut warnings)?;
    Ok(ImportedModel {
        mesh,
        materials,
        libraries: Vec::new(),
        normals_from_file,
        polygons,
        warnings,
        material_warnings,
    })
}

/// Whether the vertices of a file have normals, by its header; `None` if it has no good header.
pub(crate) fn has_normals(path: &Path) -> Option<bool> {
    /// Longer headers are rare, and not read for this.
    const MOST: u64 = 1 << 16;
    let mut start = Vec::new();
    InputFile::open(path, FileKind::Model).ok()?.take(MOST).read_to_end(&mut start).ok()?;
    let header = Header::parse(&start_of_decompressed(start, MOST)).ok()?;
    let vertex = header.elements.iter().find(|element| element.name == "vertex")?;
    Some(vertex.properties.iter().any(|property| property.name == "nx"))
}

/// The image of each texture that the header names; `None` if it cannot be used.
fn images(
    path: &Path,
    files: &References,
    names: &[String],
    has_uvs: bool,
    warnings: &mut Warnings,
) -> Vec<Option<(String, PathBuf)>> {
    if !names.is_empty() && !has_uvs {
        warnings.push(format!("{}: names a texture, but has no texture coordinates", path.display()));
        return Vec::new();
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut missing = Vec::new();
    // As MeshLab writes a name that begins like that of the file.
    let own = path.file_stem().map(|stem| path_to_text(stem.as_ref())).unwrap_or_default();
    let found = names.iter().map(|name| {
        let name = &name.replace("<this>", &own);
        let resolve = |name: &str| files.resolve(folder, name);
        // A path of another computer.
        let beside = name.rsplit(['/', '\\']).next().and_then(|last| resolve(last).ok());
        let named = resolve(name);
        let mut found = named.as_ref().ok().cloned().into_iter().chain(beside);
        let image = found.find(|file| folder.join(&file.path).is_file());
        match (&image, named) {
            (Some(file), _) => {
                let difference = file.difference(name).map(|it| format!("{}: {it}", path.display()));
                warnings.extend(difference);
            }
            (None, Err(outside)) => warnings.push(format!("{}: {outside}; shown without", path.display())),
            (None, Ok(_)) => missing.push(format!("`{}`", printable::name(name))),
        }
        image.map(|file| (name.clone(), folder.join(file.path)))
    });
    let found = found.collect();
    if !missing.is_empty() {
        warnings.push(format!("{}: no such texture, shown without: {}", path.display(), list(&missing)));
    }
    found
}

/// The materials that faces use, and the slot of each face if there are several.
///
/// - `plain`: of faces without a texture; `textures`: index of the image of each face, empty for the first one.
fn materials(
    plain: ImportedMaterial,
    images: &[Option<(String, PathBuf)>],
    textures: Vec<u16>,
) -> (Vec<ImportedMaterial>, Vec<u16>) {
    let of = |texture: u16| match images.get(usize::from(texture)) {
        Some(Some((name, image))) => ImportedMaterial {
            name: name.clone(),
            diffuse_texture: Some(TextureMap::of(image.clone())),
            ..ImportedMaterial::default()
        },
        _ => plain.clone(),
    };
    if textures.is_empty() {
        return (vec![of(0)], Vec::new());
    }
    // Textures that cannot be used share the plain material.
    let mut slot_of = vec![None; images.len() + 1];
    let mut materials = Vec::new();
    let slots = textures.into_iter().map(|texture| {
        let is_there = images.get(usize::from(texture)).is_some_and(Option::is_some);
        let key = if is_there { usize::from(texture) } else { images.len() };
        *slot_of[key].get_or_insert_with(|| {
            materials.push(of(key as u16));
            (materials.len() - 1) as u16
        })
    });
    let slots: Vec<u16> = slots.collect();
    let slots = if materials.len() > 1 { slots } else { Vec::new() };
    (materials, slots)
}

/// The contents of a file.
#[derive(Debug, Default)]
struct Contents {
    vertices: PlyVertices,
    faces: Faces,
    /// Unsupported elements and properties.
    unused: Vec<String>,
    /// Number of lines with more numbers than declared.
    long_rows: usize,
}

impl Contents {
    fn of(header: &Header, bytes: &[u8], source: ColourSource) -> Result<Self, Located> {
        match header.encoding {
            Encoding::Ascii => Self::read(header, Text::new(&bytes[header.body..], header.lines), source),
            Encoding::LittleEndian => Self::read(header, Bytes::<false>::new(bytes, header.body), source),
            Encoding::BigEndian => Self::read(header, Bytes::<true>::new(bytes, header.body), source),
        }
    }

    fn read(header: &Header, mut rows: impl Rows, source: ColourSource) -> Result<Self, Located> {
        let element = |name: &str| header.elements.iter().find(|element| element.name == name);
        let count_of = |name: &str| element(name).map_or(0, |element| element.count);
        let n_vertices = count_of("vertex");
        let whole = |problem| (Place::File, problem);
        if count_of("face") == 0 && count_of("tristrips") == 0 {
            return Err(whole(PlyProblem::NoFaces));
        }
        if element("vertex").is_some_and(|vertex| vertex.count > 0 && vertex.properties.is_empty()) {
            return Err(whole(PlyProblem::NoPositions));
        }
        if n_vertices > u64::from(u32::MAX) {
            return Err(whole(PlyProblem::TooManyVertices { count: n_vertices }));
        }
        let mut contents = Self::default();
        let n_textures = header.textures.len();
        contents.faces.n_vertices = n_vertices;
        // Colours of vertices say more than those of faces.
        let of_vertices = element("vertex").and_then(|vertex| ColourProperties::of(vertex, source));
        let of_faces = Some(source).filter(|_| of_vertices.is_none());
        // The rows of an element without properties are empty.
        for element in header.elements.iter().filter(|element| element.count > 0 && !element.properties.is_empty()) {
            let least = element.least_bytes(header.encoding);
            // The last line of a text may lack a line ending.
            let room = (rows.left() as u64 + 1) / least as u64;
            if element.count > room && !has_faces(element) {
                let (element, declared) = (printable::name(&element.name).to_string(), element.count);
                return Err((rows.place(), PlyProblem::NoRoom { element, declared, room }));
            }
            let mut ignored = Vec::new();
            contents.long_rows += match &*element.name {
                "vertex" => contents.vertices.read(element, &mut rows, source, &mut ignored)?,
                _ if contents.faces.broken.is_some() => break,
                "face" => contents.faces.read(element, &mut rows, n_textures, of_faces, &mut ignored)?,
                "tristrips" => contents.faces.read_strips(element, &mut rows, &mut ignored)?,
                name => {
                    contents.unused.push(format!("element {}", printable::name(name)));
                    for row in 0..element.count {
                        skip_row(element, row, &mut rows)?;
                    }
                    0
                }
            };
            let name = printable::name(&element.name);
            let property = |i: usize| format!("{name} property {}", printable::name(&element.properties[i].name));
            contents.unused.extend(ignored.into_iter().map(property));
        }
        // The vertices may come after the faces.
        match contents.faces.broken.take_if(|_| contents.vertices.indexed.positions.is_empty()) {
            Some(end) => Err(end),
            None => Ok(contents),
        }
    }
}

/// Faces are read as far as they are there.
fn has_faces(element: &Element) -> bool {
    ["face", "tristrips"].contains(&&*element.name)
}

/// The first names, and the number of further ones.
fn list(names: &[String]) -> String {
    const TOLD: usize = 8;
    let more = if names.len() > TOLD { format!(" and {} more", names.len() - TOLD) } else { String::new() };
    names[..names.len().min(TOLD)].join(", ") + &more
}
