//! The element `vertex`: positions, normals, texture coordinates and colours.

use crate::error::Place;
use crate::error::ply::PlyProblem;
use crate::model::assemble::Indexed;
use crate::model::material::ImportedMaterial;
use crate::ply::header::Element;
use crate::ply::rows::{Located, Rows, missing, skip_list};
use firstlight_render::decode_srgb;
use glam::{DVec2, DVec3, Vec2, Vec3};
use std::sync::LazyLock;

/// PlyVertices as in the file: positions may be anything.
#[derive(Debug, Default)]
pub(crate) struct PlyVertices {
    /// Without triangles.
    pub indexed: Indexed,
    pub colours: Colours,
    /// Number of texture coordinates that are not finite; they are 0.
    pub bad_uvs: usize,
}

/// Statistics of colours, linear Rec. 709.
#[derive(Debug, Default)]
pub(crate) struct Colours {
    first: Option<Vec3>,
    sum: DVec3,
    pub count: u64,
    pub differ: bool,
}

impl Colours {
    /// Counts a colour and returns it in linear form.
    ///
    /// - `encoded`: sRGB, with `white` as maximum.
    pub fn add(&mut self, encoded: [f64; 3], white: f64) -> Vec3 {
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

    /// The material: plain if all colours are equal, unnamed if there are no colours.
    pub fn material(&self) -> ImportedMaterial {
        let Some(first) = self.first else { return ImportedMaterial::default() };
        let diffuse = Some(if self.differ { (self.sum / self.count as f64).as_vec3() } else { first });
        let (name, vertex_colors) = ("vertex colors".to_owned(), self.differ);
        ImportedMaterial { name, diffuse, vertex_colors, ..ImportedMaterial::default() }
    }
}

/// Names of the properties that are used.
const ROLES: [&[&str]; N_ROLES] = [
    &["x"],
    &["y"],
    &["z"],
    &["nx", "normal_x"],
    &["ny", "normal_y"],
    &["nz", "normal_z"],
    &["s", "u", "texture_u", "texture_s"],
    &["t", "v", "texture_v", "texture_t"],
    RED,
    GREEN,
    BLUE,
];
const RED: &[&str] = &["red", "r", "diffuse_red"];
const GREEN: &[&str] = &["green", "g", "diffuse_green"];
const BLUE: &[&str] = &["blue", "b", "diffuse_blue"];
const N_ROLES: usize = 11;
/// First roles of normals, texture coordinates and colours.
const NORMAL: usize = 3;
const UV: usize = 6;
const COLOUR: usize = 8;

/// Indices of the properties of a colour, and its maximum.
pub(crate) fn colour_of(element: &Element) -> Option<([usize; 3], f64)> {
    let number = |names| element.property(names).filter(|&i| element.properties[i].length.is_none());
    let channels = [number(RED)?, number(GREEN)?, number(BLUE)?];
    Some((channels, element.properties[channels[2]].number.white()))
}

pub(crate) fn has_colours(element: &Element) -> bool {
    colour_of(element).is_some()
}

impl PlyVertices {
    /// Reads all rows; returns the number of those with more numbers than declared.
    ///
    /// - `ignored`: receives the indices of properties that are not used.
    pub fn read(
        &mut self,
        element: &Element,
        rows: &mut impl Rows,
        ignored: &mut Vec<usize>,
    ) -> Result<usize, Located> {
        // Role of each property.
        let mut role_of = vec![None; element.properties.len()];
        let mut has = [false; N_ROLES];
        for (role, names) in ROLES.iter().enumerate() {
            let found = element.property(names).filter(|&i| element.properties[i].length.is_none());
            has[role] = found.is_some();
            if let Some(i) = found {
                role_of[i] = Some(role);
            }
        }
        if !has[..NORMAL].iter().all(|&has| has) {
            return Err((Place::File, PlyProblem::NoPositions));
        }
        let [has_normals, has_uvs, has_colours] =
            [NORMAL..UV, UV..COLOUR, COLOUR..N_ROLES].map(|roles| has[roles].iter().all(|&has| has));
        let white = colour_of(element).map_or(1.0, |(_, white)| white);
        let is_used = |role: Option<usize>| match role {
            None => false,
            Some(0..NORMAL) => true,
            Some(NORMAL..UV) => has_normals,
            Some(UV..COLOUR) => has_uvs,
            Some(_) => has_colours,
        };
        ignored.extend((0..role_of.len()).filter(|&i| !is_used(role_of[i])));
        let (count, model) = (element.count as usize, &mut self.indexed);
        model.positions.reserve_exact(count);
        model.normals.reserve_exact(if has_normals { count } else { 0 });
        model.uvs.reserve_exact(if has_uvs { count } else { 0 });
        model.colors.reserve_exact(if has_colours { count } else { 0 });
        let (mut values, mut long_rows) = ([0.0; N_ROLES], 0);
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
            long_rows += usize::from(rows.end_row());
            let [x, y, z, nx, ny, nz, u, v, red, green, blue] = values;
            model.positions.push(DVec3::new(x, y, z));
            if has_normals {
                // Normals that are not finite count as missing too.
                model.normals.push(DVec3::new(nx, ny, nz).normalize_or_zero().as_vec3());
            }
            if has_uvs {
                let uv = DVec2::new(u, v).as_vec2();
                self.bad_uvs += usize::from(!uv.is_finite());
                model.uvs.push(if uv.is_finite() { uv } else { Vec2::ZERO });
            }
            if has_colours {
                model.colors.push(self.colours.add([red, green, blue], white).extend(1.0));
            }
        }
        if !self.colours.differ {
            model.colors = Vec::new();
        }
        Ok(long_rows)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
