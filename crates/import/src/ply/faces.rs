//! The elements `face` and `tristrips`: vertex indices, and what corners and faces have of their own.

use crate::error::Place;
use crate::error::ply::PlyProblem;
use crate::model::assemble::Indexed;
use crate::model::polygon::triangulate;
use crate::model::unused::keep;
use crate::ply::header::{Element, Property};
use crate::ply::rows::{Located, Rows, missing, next_length, skip_list};
use crate::ply::vertices::{ColourProperties, ColourSource, Colours};
use glam::{Vec2, Vec3};
use rayon::slice::ParallelSliceMut;

/// Faces as in the file, with at least three corners each.
#[derive(Debug, Default)]
pub(crate) struct Faces {
    /// Number of vertices in the header, wherever they are.
    pub n_vertices: u64,
    /// Vertex indices of all faces in order.
    corners: Vec<u32>,
    /// Number of corners of each face.
    arities: Vec<u32>,
    /// Texture coordinates of the corners; empty if they have none of their own.
    pub uvs: Vec<Vec2>,
    /// Index of the texture of each face, [`NO_TEXTURE`] without; empty if they do not say.
    textures: Vec<u16>,
    /// Colour of each face, linear; empty if they have none that is used.
    colors: Vec<Vec3>,
    pub colours: Colours,
    /// Number of faces with fewer than three corners.
    pub too_short: usize,
    /// Number of corners without finite texture coordinates; they are 0.
    pub bad_uvs: usize,
    /// The first index that no vertex has: its corner is [`NOWHERE`].
    pub stray: Option<Located>,
    /// What ended the faces before their number was reached.
    pub broken: Option<Located>,
}

/// Index of a corner that is no vertex; files have fewer.
pub(crate) const NOWHERE: u32 = u32::MAX;

/// What a face has beside its corners.
#[derive(Default)]
struct OfFace {
    uvs: Vec<f32>,
    channels: [f64; 3],
    texture: u16,
}

/// An index that no texture has.
const NO_TEXTURE: u16 = u16::MAX;

/// What a property of a face is.
#[derive(Clone, Copy, PartialEq)]
enum FaceRole {
    Indices,
    Uvs,
    Texture,
    Channel,
    Ignored,
}

impl Faces {
    pub fn is_empty(&self) -> bool {
        self.arities.is_empty()
    }

    /// Number of faces with more than three corners.
    pub fn polygons(&self) -> usize {
        self.arities.iter().filter(|&&corners| corners > 3).count()
    }

    /// The texture of each face; empty if faces do not say.
    pub fn take_textures(&mut self) -> Vec<u16> {
        std::mem::take(&mut self.textures)
    }

    /// Reads the rows of `face` up to the first that is broken; returns the number of those with more numbers than
    /// declared.
    ///
    /// - `n_textures`: number of textures in the header; `source`: of the colours, if they are read; `ignored`: receives
    ///   the indices of properties that are not used.
    pub fn read(
        &mut self,
        element: &Element,
        rows: &mut impl Rows,
        n_textures: usize,
        source: Option<ColourSource>,
        ignored: &mut Vec<usize>,
    ) -> Result<usize, Located> {
        let indices = index_list(element)?;
        let colour = source.and_then(|source| ColourProperties::of(element, source));
        let roles: Vec<FaceRole> = (0..element.properties.len())
            .map(|i| match &element.properties[i] {
                _ if i == indices => FaceRole::Indices,
                // As MeshLab writes them: six numbers per triangle.
                Property { name, length: Some(_), number } if name == "texcoord" && !number.is_whole() => FaceRole::Uvs,
                Property { name, length: None, .. } if name == "texnumber" && n_textures > 0 => FaceRole::Texture,
                _ if colour.is_some_and(|colour| colour.contains(i)) => FaceRole::Channel,
                _ => FaceRole::Ignored,
            })
            .collect();
        ignored.extend((0..roles.len()).filter(|&i| roles[i] == FaceRole::Ignored));
        let (has_uvs, has_textures) = (roles.contains(&FaceRole::Uvs), roles.contains(&FaceRole::Texture));
        // Strips that come before have neither.
        self.uvs.resize(if has_uvs { self.corners.len() } else { 0 }, Vec2::ZERO);
        self.textures.resize(if has_textures { self.arities.len() } else { 0 }, NO_TEXTURE);
        self.colors.resize(if colour.is_some() { self.arities.len() } else { 0 }, Vec3::ONE);
        let (mut face, mut long_rows) = (OfFace { texture: NO_TEXTURE, ..OfFace::default() }, 0);
        for row in 0..element.count {
            let start = self.corners.len();
            if let Err(located) = self.read_face(element, row, rows, &roles, colour, &mut face) {
                self.corners.truncate(start);
                self.broken = Some(located);
                break;
            }
            long_rows += usize::from(rows.end_row());
            let count = self.corners.len() - start;
            if count < 3 {
                self.corners.truncate(start);
                self.too_short += 1;
                continue;
            }
            self.arities.push(count as u32);
            if has_uvs {
                self.add_uvs(&face.uvs, count);
            }
            if has_textures {
                let is_there = usize::from(face.texture) < n_textures;
                self.textures.push(if is_there { face.texture } else { NO_TEXTURE });
            }
            if let Some(ColourProperties { white, .. }) = colour {
                self.colors.push(self.colours.add(face.channels, white));
            }
        }
        if !self.colours.differ && !matches!(source, Some(ColourSource::Attribute { .. })) {
            self.colors = Vec::new();
        }
        Ok(long_rows)
    }

    /// Reads one row of `face`: its corners, and the rest into `face`.
    fn read_face(
        &mut self,
        element: &Element,
        row: u64,
        rows: &mut impl Rows,
        roles: &[FaceRole],
        colour: Option<ColourProperties>,
        face: &mut OfFace,
    ) -> Result<(), Located> {
        let missing = |problem, rows: &_| missing(problem, element, row, rows);
        rows.begin_row().map_err(|problem| missing(problem, rows))?;
        for (i, (property, &role)) in element.properties.iter().zip(roles).enumerate() {
            match (role, property.length) {
                (FaceRole::Indices, Some(_)) => {
                    for _ in 0..next_length(element, row, property, rows)? {
                        let index = rows.next(property.number).map_err(|problem| missing(problem, rows))?;
                        let corner = self.corner(index, element, row, rows);
                        self.corners.push(corner);
                    }
                }
                (FaceRole::Uvs, Some(_)) => {
                    face.uvs.clear();
                    for _ in 0..next_length(element, row, property, rows)? {
                        face.uvs.push(rows.next(property.number).map_err(|problem| missing(problem, rows))? as f32);
                    }
                }
                (_, Some(_)) => skip_list(element, row, property, rows)?,
                (FaceRole::Texture, None) => {
                    let number = rows.next(property.number).map_err(|problem| missing(problem, rows))?;
                    let is_number = number >= 0.0 && number < f64::from(NO_TEXTURE);
                    face.texture = if is_number { number as u16 } else { NO_TEXTURE };
                }
                (FaceRole::Channel, None) => {
                    let value = rows.next(property.number).map_err(|problem| missing(problem, rows))?;
                    colour.iter().for_each(|colour| colour.store(i, value, &mut face.channels));
                }
                (_, None) => rows.skip(property.number, 1).map_err(|problem| missing(problem, rows))?,
            }
        }
        Ok(())
    }

    /// Adds the texture coordinates of a face.
    fn add_uvs(&mut self, numbers: &[f32], count: usize) {
        for corner in 0..count {
            let of_all = if numbers.len() == 2 * count { &numbers[2 * corner..2 * corner + 2] } else { &[] };
            let uv = match *of_all {
                [u, v] if u.is_finite() && v.is_finite() => Vec2::new(u, v),
                _ => {
                    self.bad_uvs += 1;
                    Vec2::ZERO
                }
            };
            self.uvs.push(uv);
        }
    }

    /// Reads the rows of `tristrips` up to the first that is broken; returns the number of those with more numbers than
    /// declared.
    ///
    /// - `ignored`: receives the indices of properties that are not used.
    pub fn read_strips(
        &mut self,
        element: &Element,
        rows: &mut impl Rows,
        ignored: &mut Vec<usize>,
    ) -> Result<usize, Located> {
        let indices = index_list(element)?;
        ignored.extend((0..element.properties.len()).filter(|&i| i != indices));
        let (mut strip, mut long_rows) = (Strip::default(), 0);
        for row in 0..element.count {
            if let Err(located) = self.read_strip(element, row, rows, indices, &mut strip) {
                self.broken = Some(located);
                break;
            }
            long_rows += usize::from(rows.end_row());
        }
        // Strips have no values of their own.
        self.uvs.resize(if self.uvs.is_empty() { 0 } else { self.corners.len() }, Vec2::ZERO);
        self.textures.resize(if self.textures.is_empty() { 0 } else { self.arities.len() }, NO_TEXTURE);
        self.colors.resize(if self.colors.is_empty() { 0 } else { self.arities.len() }, Vec3::ONE);
        Ok(long_rows)
    }

    /// Reads one row of `tristrips`.
    fn read_strip(
        &mut self,
        element: &Element,
        row: u64,
        rows: &mut impl Rows,
        indices: usize,
        strip: &mut Strip,
    ) -> Result<(), Located> {
        let missing = |problem, rows: &_| missing(problem, element, row, rows);
        rows.begin_row().map_err(|problem| missing(problem, rows))?;
        for (i, property) in element.properties.iter().enumerate() {
            match property.length {
                None => rows.skip(property.number, 1).map_err(|problem| missing(problem, rows))?,
                Some(_) if i != indices => skip_list(element, row, property, rows)?,
                Some(_) => {
                    strip.restart();
                    for _ in 0..next_length(element, row, property, rows)? {
                        let index = rows.next(property.number).map_err(|problem| missing(problem, rows))?;
                        if index == -1.0 {
                            strip.restart();
                        } else if let Some(triangle) = strip.next(self.corner(index, element, row, rows)) {
                            self.corners.extend(triangle);
                            self.arities.push(3);
                        }
                    }
                }
            }
        }
        Ok(())
    }

    /// The corner of an index of the file.
    #[inline]
    fn corner(&mut self, index: f64, element: &Element, row: u64, rows: &impl Rows) -> u32 {
        if index >= 0.0 && index < self.n_vertices as f64 && index.fract() == 0.0 {
            return index as u32;
        }
        self.stray.get_or_insert_with(|| {
            let name = if element.name == "face" { "face" } else { "tristrips" };
            let (index, count) = (index.to_string(), self.n_vertices);
            (rows.place(), PlyProblem::OutOfRange { element: name, row, index, count })
        });
        NOWHERE
    }

    /// Removes the faces with such a vertex; returns their number.
    pub fn leave_out(&mut self, is_bad: impl Fn(u32) -> bool) -> usize {
        if !self.corners.iter().any(|&vertex| is_bad(vertex)) {
            return 0;
        }
        let mut start = 0;
        let kept: Vec<bool> = (self.arities.iter())
            .map(|&count| {
                start += count as usize;
                !self.corners[start - count as usize..start].iter().any(|&vertex| is_bad(vertex))
            })
            .collect();
        let of_corners = |arities: &[u32]| -> Vec<bool> {
            arities.iter().zip(&kept).flat_map(|(&count, &kept)| std::iter::repeat_n(kept, count as usize)).collect()
        };
        let corners_kept = of_corners(&self.arities);
        keep(&mut self.corners, &corners_kept);
        keep(&mut self.uvs, &corners_kept);
        keep(&mut self.textures, &kept);
        keep(&mut self.colors, &kept);
        keep(&mut self.arities, &kept);
        kept.iter().filter(|&&kept| !kept).count()
    }

    /// The vertices with the triangles of the faces; vertices are split where corners have values of their own.
    ///
    /// - `slots`: material of each face, or empty.
    pub fn meshed(mut self, mut vertices: Indexed, slots: Vec<u16>) -> Indexed {
        if !self.uvs.is_empty() || !self.colors.is_empty() {
            vertices = self.split(&vertices);
        }
        vertices.triangles.reserve_exact(self.corners.len().saturating_sub(2 * self.arities.len()));
        let (mut polygon, mut cut, mut start) = (Vec::new(), Vec::new(), 0);
        for (face, &count) in self.arities.iter().enumerate() {
            let corners = &self.corners[start..start + count as usize];
            let before = vertices.triangles.len();
            if let &[a, b, c] = corners {
                vertices.triangles.push([a, b, c]);
            } else {
                polygon.clear();
                polygon.extend(corners.iter().map(|&vertex| vertices.positions[vertex as usize]));
                cut.clear();
                triangulate(&polygon, &mut cut);
                vertices.triangles.extend(cut.iter().map(|triangle| triangle.map(|k| corners[k])));
            }
            if let Some(&slot) = slots.get(face) {
                vertices.slots.extend(std::iter::repeat_n(slot, vertices.triangles.len() - before));
            }
            start += count as usize;
        }
        vertices
    }

    /// One vertex for each combination of vertex, texture coordinates and colour that corners have; the corners are
    /// those of the new vertices.
    fn split(&mut self, vertices: &Indexed) -> Indexed {
        let face_of: Vec<u32> = match self.colors.is_empty() {
            true => Vec::new(),
            false => (0..).zip(&self.arities).flat_map(|(f, &n)| std::iter::repeat_n(f, n as usize)).collect(),
        };
        let color = |corner: u32| face_of.get(corner as usize).map(|&face| self.colors[face as usize]);
        let key = |&corner: &u32| {
            let uv = self.uvs.get(corner as usize).map(|uv| (uv + Vec2::ZERO).to_array().map(f32::to_bits));
            let color = color(corner).map(|color| color.to_array().map(f32::to_bits));
            (self.corners[corner as usize], uv, color)
        };
        let mut order: Vec<u32> = (0..self.corners.len() as u32).collect();
        order.par_sort_unstable_by_key(key);
        let mut found = Indexed::default();
        let mut numbers = vec![0; self.corners.len()];
        for group in order.chunk_by(|a, b| key(a) == key(b)) {
            let number = found.positions.len() as u32;
            group.iter().for_each(|&corner| numbers[corner as usize] = number);
            let vertex = self.corners[group[0] as usize] as usize;
            found.positions.push(vertices.positions[vertex]);
            found.normals.extend(vertices.normals.get(vertex));
            let uv = self.uvs.get(group[0] as usize).or_else(|| vertices.uvs.get(vertex));
            found.uvs.extend(uv);
            let of_face = color(group[0]).map(|color| color.extend(1.0));
            found.colors.extend(of_face.or_else(|| vertices.colors.get(vertex).copied()));
        }
        self.corners = numbers;
        found
    }
}

/// Index of the list of vertex indices.
fn index_list(element: &Element) -> Result<usize, Located> {
    let is_list = |i: &usize| element.properties[*i].length.is_some() && element.properties[*i].number.is_whole();
    let name = if element.name == "face" { "face" } else { "tristrips" };
    let found = element.property(&["vertex_indices", "vertex_index"]).filter(is_list);
    found.ok_or((Place::File, PlyProblem::NoIndices { element: name }))
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
}
