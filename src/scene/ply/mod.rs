//! PLY (Stanford polygon files): ASCII and binary of both byte orders, any elements and properties in any order.
//!
//! The header declares the rows of each element (`header`); values are read in sequence from text or bytes (`rows`),
//! and those of the mesh are kept: positions, normals, texture coordinates, colours, faces and triangle strips. Memory
//! for declared elements is allocated only after checking that the file is long enough. If all colours are equal, they
//! become a plain material. Start reading at [`load_ply`].

mod error;
mod header;
mod rows;

pub use error::PlyProblem;

use self::header::{Element, Encoding, Header};
use self::rows::{Bytes, Missing, Rows, Text};
use super::model::assemble::{Indexed, assemble};
use super::model::error::{ModelError, Place};
use super::model::imported::{ImportedModel, ModelOptions};
use super::model::polygon::triangulate;
use super::obj::ImportedMaterial;
use super::warnings::Warnings;
use crate::printable;
use crate::render::decode_srgb;
use crate::scene::input_file::{FileKind, InputFile};
use glam::{DVec2, DVec3, Vec3};
use std::path::Path;
use std::sync::LazyLock;

/// [`load_ply_with`] with the default options.
///
/// # Errors
/// Like [`load_ply_with`].
pub fn load_ply(path: &Path) -> Result<ImportedModel, ModelError> {
    load_ply_with(path, &ModelOptions::default())
}

/// Loads the faces and triangle strips of a PLY file as one mesh.
///
/// Normals of length zero count as missing. Colours are read as sRGB. Unsupported elements and properties give a
/// warning.
///
/// # Errors
/// If the file cannot be read, or is not a model with surface area.
pub fn load_ply_with(path: &Path, options: &ModelOptions) -> Result<ImportedModel, ModelError> {
    let bytes = InputFile::open_within(path, FileKind::Model, options.max_bytes)
        .and_then(InputFile::bytes)
        .map_err(|error| ModelError::of(path, Place::File, error))?;
    let at = |(place, problem): Located| ModelError::of(path, place, problem);
    let header = Header::parse(&bytes).map_err(|(line, problem)| at((Place::Line(line), problem)))?;
    let parsed = Parsed::of(&header, &bytes).map_err(at)?;
    drop(bytes);
    let mut warnings = Warnings::default();
    let mut warn = |text: String| warnings.push(format!("{}: {text}", path.display()));
    if parsed.short_faces > 0 {
        warn(format!("{} faces have fewer than three corners and were removed", parsed.short_faces));
    }
    if !parsed.unused.is_empty() {
        warn(format!("not modelled and ignored: {}", list(&parsed.unused)));
    }
    let material = parsed.colours.material();
    let polygons = parsed.arities.iter().filter(|&&corners| corners > 3).count();
    let indexed = parsed.triangulated();
    if indexed.triangles.is_empty() {
        return Err(ModelError::of(path, Place::File, PlyProblem::NoFaces));
    }
    let (mesh, normals_from_file) = assemble(path, indexed, options, &mut warnings)?;
    Ok(ImportedModel {
        mesh,
        materials: vec![material],
        libraries: Vec::new(),
        normals_from_file,
        polygons,
        warnings,
        material_warnings: Warnings::default(),
    })
}

type Located = (Place, PlyProblem);

/// The contents of a file.
#[derive(Debug, Default)]
struct Parsed {
    /// Without triangles: faces are not triangulated yet.
    vertices: Indexed,
    colours: Colours,
    /// Vertex indices of all faces in order.
    corners: Vec<u32>,
    /// Number of corners of each face.
    arities: Vec<u32>,
    short_faces: usize,
    /// Unsupported elements and properties.
    unused: Vec<String>,
}

/// Statistics of the vertex colours, linear Rec. 709.
#[derive(Debug, Default)]
struct Colours {
    first: Option<Vec3>,
    sum: DVec3,
    count: u64,
    differ: bool,
}

impl Colours {
    /// Counts a colour and returns it in linear form.
    ///
    /// - `encoded`: sRGB, with `white` as maximum.
    fn add(&mut self, encoded: [f64; 3], white: f64) -> Vec3 {
        // A table for bytes, the usual case: the transfer function would take longer than the rest of a vertex.
        static OF_BYTES: LazyLock<[f64; 256]> =
            LazyLock::new(|| std::array::from_fn(|byte| decode_srgb(byte as f64 / 255.0)));
        let linear = encoded.map(|value| match value as u8 {
            byte if white == 255.0 && f64::from(byte) == value => OF_BYTES[usize::from(byte)],
            _ if value.is_nan() => 0.0,
            _ => decode_srgb((value / white).clamp(0.0, 1.0)),
        });
        let linear = DVec3::from_array(linear).as_vec3();
        self.differ |= *self.first.get_or_insert(linear) != linear;
        self.sum += linear.as_dvec3();
        self.count += 1;
        linear
    }

    /// The material; unnamed if there are no colours.
    fn material(&self) -> ImportedMaterial {
        let Some(first) = self.first else { return ImportedMaterial::default() };
        let diffuse = Some(if self.differ { (self.sum / self.count as f64).as_vec3() } else { first });
        let (name, vertex_colors) = ("vertex colors".to_owned(), self.differ);
        ImportedMaterial { name, diffuse, vertex_colors, ..ImportedMaterial::default() }
    }
}

/// Names of the vertex properties that are used.
const ROLES: [&[&str]; N_ROLES] = [
    &["x"],
    &["y"],
    &["z"],
    &["nx", "normal_x"],
    &["ny", "normal_y"],
    &["nz", "normal_z"],
    &["s", "u", "texture_u", "texture_s"],
    &["t", "v", "texture_v", "texture_t"],
    &["red", "r", "diffuse_red"],
    &["green", "g", "diffuse_green"],
    &["blue", "b", "diffuse_blue"],
];
const N_ROLES: usize = 11;
/// First roles of normals, texture coordinates and colours.
const NORMAL: usize = 3;
const UV: usize = 6;
const COLOUR: usize = 8;

impl Parsed {
    fn of(header: &Header, bytes: &[u8]) -> Result<Self, Located> {
        match header.encoding {
            Encoding::Ascii => Self::read(header, Text::new(&bytes[header.body..], header.lines)),
            Encoding::LittleEndian => Self::read(header, Bytes::<false>::new(bytes, header.body)),
            Encoding::BigEndian => Self::read(header, Bytes::<true>::new(bytes, header.body)),
        }
    }

    fn read(header: &Header, mut rows: impl Rows) -> Result<Self, Located> {
        let count_of = |name: &str| header.elements.iter().find(|element| element.name == name).map_or(0, |e| e.count);
        let n_vertices = count_of("vertex");
        let whole = |problem| (Place::File, problem);
        if count_of("face") == 0 && count_of("tristrips") == 0 {
            return Err(whole(PlyProblem::NoFaces));
        }
        if n_vertices > u64::from(u32::MAX) {
            return Err(whole(PlyProblem::TooManyVertices { count: n_vertices }));
        }
        let mut parsed = Self::default();
        // The rows of an element without properties are empty.
        for element in header.elements.iter().filter(|element| element.count > 0 && !element.properties.is_empty()) {
            let least = element.least_bytes(header.encoding);
            // The last line of a text may lack a line ending.
            let room = (rows.left() as u64 + 1) / least as u64;
            if element.count > room {
                let (element, declared) = (printable::name(&element.name).to_string(), element.count);
                return Err((rows.place(), PlyProblem::NoRoom { element, declared, room }));
            }
            match &*element.name {
                "vertex" => parsed.read_vertices(element, &mut rows)?,
                "face" => parsed.read_faces(element, &mut rows, n_vertices, "face")?,
                "tristrips" => parsed.read_faces(element, &mut rows, n_vertices, "tristrips")?,
                name => {
                    parsed.unused.push(format!("element {}", printable::name(name)));
                    for row in 0..element.count {
                        skip_row(element, row, &mut rows)?;
                    }
                }
            }
        }
        Ok(parsed)
    }

    fn read_vertices(&mut self, element: &Element, rows: &mut impl Rows) -> Result<(), Located> {
        // Role of each property.
        let mut role_of = vec![None; element.properties.len()];
        let mut white = 1.0;
        let mut has = [false; N_ROLES];
        for (role, names) in ROLES.iter().enumerate() {
            let found = element.property(names).filter(|&i| element.properties[i].length.is_none());
            has[role] = found.is_some();
            if let Some(i) = found {
                role_of[i] = Some(role);
                if role >= COLOUR {
                    white = element.properties[i].number.white();
                }
            }
        }
        if !has[..NORMAL].iter().all(|&has| has) {
            return Err((Place::File, PlyProblem::NoPositions));
        }
        let [has_normals, has_uvs, has_colours] =
            [NORMAL..UV, UV..COLOUR, COLOUR..N_ROLES].map(|roles| has[roles].iter().all(|&has| has));
        let is_used = |role: Option<usize>| match role {
            None => false,
            Some(0..NORMAL) => true,
            Some(NORMAL..UV) => has_normals,
            Some(UV..COLOUR) => has_uvs,
            Some(_) => has_colours,
        };
        self.note_unused("vertex", element, |i| is_used(role_of[i]));
        let count = element.count as usize;
        self.vertices.positions.reserve_exact(count);
        self.vertices.normals.reserve_exact(if has_normals { count } else { 0 });
        self.vertices.uvs.reserve_exact(if has_uvs { count } else { 0 });
        self.vertices.colors.reserve_exact(if has_colours { count } else { 0 });
        let mut values = [0.0; N_ROLES];
        for row in 0..element.count {
            let missing = |problem, rows: &_| missing(problem, element, row, rows);
            rows.begin_row().map_err(|problem| missing(problem, rows))?;
            for (property, role) in element.properties.iter().zip(&role_of) {
                match (property.length, role) {
                    (Some(_), _) => skip_list(element, row, property, rows)?,
                    (None, Some(role)) => {
                        values[*role] = rows.next(property.number).map_err(|problem| missing(problem, rows))?;
                    }
                    (None, None) => rows.skip(property.number, 1).map_err(|problem| missing(problem, rows))?,
                }
            }
            rows.end_row().map_err(|problem| missing(problem, rows))?;
            let [x, y, z, nx, ny, nz, u, v, red, green, blue] = values;
            let not_finite = |what| (rows.place(), PlyProblem::NotFinite { what, vertex: row });
            let (position, uv) = (DVec3::new(x, y, z), DVec2::new(u, v).as_vec2());
            if !position.is_finite() {
                return Err(not_finite("position"));
            }
            self.vertices.positions.push(position);
            if has_normals {
                // Normals that are not finite count as missing too.
                self.vertices.normals.push(DVec3::new(nx, ny, nz).normalize_or_zero().as_vec3());
            }
            if has_uvs {
                if !uv.is_finite() {
                    return Err(not_finite("texture coordinate"));
                }
                self.vertices.uvs.push(uv);
            }
            if has_colours {
                self.vertices.colors.push(self.colours.add([red, green, blue], white).extend(1.0));
            }
        }
        if !self.colours.differ {
            self.vertices.colors = Vec::new();
        }
        Ok(())
    }

    /// - `n_vertices`: number declared in the header, wherever the vertices are.
    fn read_faces(
        &mut self,
        element: &Element,
        rows: &mut impl Rows,
        n_vertices: u64,
        name: &'static str,
    ) -> Result<(), Located> {
        let is_list = |i: &usize| element.properties[*i].length.is_some() && element.properties[*i].number.is_whole();
        let indices = element.property(&["vertex_indices", "vertex_index"]).filter(is_list);
        let indices = indices.ok_or((Place::File, PlyProblem::NoIndices { element: name }))?;
        self.note_unused(name, element, |i| i == indices);
        let is_strip = name == "tristrips";
        let mut strip = Strip::default();
        for row in 0..element.count {
            let missing = |problem, rows: &_| missing(problem, element, row, rows);
            rows.begin_row().map_err(|problem| missing(problem, rows))?;
            for (i, property) in element.properties.iter().enumerate() {
                let Some(number) = property.length else {
                    rows.skip(property.number, 1).map_err(|problem| missing(problem, rows))?;
                    continue;
                };
                if i != indices {
                    skip_list(element, row, property, rows)?;
                    continue;
                }
                let length = rows.next(number).map_err(|problem| missing(problem, rows))?;
                let length = length_of(length, element, row, rows)?;
                let start = self.corners.len();
                strip.restart();
                for _ in 0..length {
                    let index = rows.next(property.number).map_err(|problem| missing(problem, rows))?;
                    if is_strip && index == -1.0 {
                        strip.restart();
                        continue;
                    }
                    let is_vertex = index >= 0.0 && index < n_vertices as f64 && index.fract() == 0.0;
                    if !is_vertex {
                        let (index, count) = (index.to_string(), n_vertices);
                        return Err((rows.place(), PlyProblem::OutOfRange { element: name, row, index, count }));
                    }
                    if !is_strip {
                        self.corners.push(index as u32);
                    } else if let Some(triangle) = strip.next(index as u32) {
                        self.corners.extend(triangle);
                        self.arities.push(3);
                    }
                }
                if !is_strip {
                    if length < 3 {
                        self.corners.truncate(start);
                        self.short_faces += 1;
                    } else {
                        self.arities.push((self.corners.len() - start) as u32);
                    }
                }
            }
            rows.end_row().map_err(|problem| missing(problem, rows))?;
        }
        Ok(())
    }

    fn note_unused(&mut self, name: &str, element: &Element, is_used: impl Fn(usize) -> bool) {
        let unused = element.properties.iter().enumerate().filter(|(i, _)| !is_used(*i));
        self.unused.extend(unused.map(|(_, property)| format!("{name} property {}", printable::name(&property.name))));
    }

    fn triangulated(self) -> Indexed {
        let mut model = self.vertices;
        model.triangles.reserve_exact(self.corners.len().saturating_sub(2 * self.arities.len()));
        let (mut polygon, mut cut, mut start) = (Vec::new(), Vec::new(), 0);
        for &count in &self.arities {
            let corners = &self.corners[start..start + count as usize];
            if let &[a, b, c] = corners {
                model.triangles.push([a, b, c]);
            } else {
                polygon.clear();
                polygon.extend(corners.iter().map(|&vertex| model.positions[vertex as usize]));
                cut.clear();
                triangulate(&polygon, &mut cut);
                model.triangles.extend(cut.iter().map(|triangle| triangle.map(|k| corners[k])));
            }
            start += count as usize;
        }
        model
    }
}

/// Triangles of a strip: each vertex forms one with the two before it; every other triangle is reversed.
#[derive(Default)]
struct Strip {
    last: [u32; 2],
    length: u64,
}

impl Strip {
    fn restart(&mut self) {
        self.length = 0;
    }

    fn next(&mut self, vertex: u32) -> Option<[u32; 3]> {
        let [a, b] = self.last;
        self.last = [b, vertex];
        self.length += 1;
        // Strips contain degenerate triangles to change direction.
        let is_triangle = self.length >= 3 && a != b && b != vertex && vertex != a;
        is_triangle.then_some(if self.length % 2 == 1 { [a, b, vertex] } else { [b, a, vertex] })
    }
}

fn skip_row(element: &Element, row: u64, rows: &mut impl Rows) -> Result<(), Located> {
    rows.begin_row().map_err(|problem| missing(problem, element, row, rows))?;
    for property in &element.properties {
        if property.length.is_some() {
            skip_list(element, row, property, rows)?;
        } else {
            rows.skip(property.number, 1).map_err(|problem| missing(problem, element, row, rows))?;
        }
    }
    rows.end_row().map_err(|problem| missing(problem, element, row, rows))
}

fn skip_list(element: &Element, row: u64, property: &header::Property, rows: &mut impl Rows) -> Result<(), Located> {
    let number = property.length.unwrap_or(property.number);
    let length = rows.next(number).map_err(|problem| missing(problem, element, row, rows))?;
    let length = length_of(length, element, row, rows)?;
    rows.skip(property.number, length).map_err(|problem| missing(problem, element, row, rows))
}

/// Up to 2³² − 1; longer lists exceed any file.
fn length_of(length: f64, element: &Element, row: u64, rows: &impl Rows) -> Result<u64, Located> {
    if length >= 0.0 && length <= f64::from(u32::MAX) && length.fract() == 0.0 {
        return Ok(length as u64);
    }
    let element = printable::name(&element.name).to_string();
    Err((rows.place(), PlyProblem::Length { element, row, length: length.to_string() }))
}

fn missing(problem: Missing, element: &Element, row: u64, rows: &impl Rows) -> Located {
    let name = || printable::name(&element.name).to_string();
    let problem = match problem {
        Missing::End => PlyProblem::Truncated { element: name(), row, declared: element.count },
        Missing::Line(found) => PlyProblem::Numbers { element: name(), row, found },
        Missing::Problem(problem) => problem,
    };
    (rows.place(), problem)
}

/// The first names, and the number of further ones.
fn list(names: &[String]) -> String {
    const TOLD: usize = 8;
    let more = if names.len() > TOLD { format!(" and {} more", names.len() - TOLD) } else { String::new() };
    names[..names.len().min(TOLD)].join(", ") + &more
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_turn_every_other_triangle_around_and_begin_again() {
        let mut strip = Strip::default();
        let mut of = |vertices: &[i32]| -> Vec<[u32; 3]> {
            strip.restart();
            let mut found = Vec::new();
            for &vertex in vertices {
                if vertex < 0 {
                    strip.restart();
                } else {
                    found.extend(strip.next(vertex as u32));
                }
            }
            found
        };
        assert_eq!(of(&[0, 1, 2, 3]), [[0, 1, 2], [2, 1, 3]]);
        assert_eq!(of(&[0, 1, 2, -1, 3, 4, 5]), [[0, 1, 2], [3, 4, 5]]);
        assert_eq!(of(&[0, 1, 2, 2, 3, 4]), [[0, 1, 2], [3, 2, 4]]);
    }

    #[test]
    fn colours_are_decoded_and_their_mean_is_that_of_light() {
        let mut colours = Colours::default();
        assert!(colours.material().name.is_empty());
        colours.add([1.0, 0.0, f64::NAN], 1.0);
        assert_eq!((colours.differ, colours.material().diffuse), (false, Some(Vec3::X)));
        colours.add([-1.0, 0.0, 300.0], 255.0);
        assert_eq!((colours.differ, colours.material().diffuse), (true, Some(Vec3::new(0.5, 0.0, 0.5))));
    }
}
