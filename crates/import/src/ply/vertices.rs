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
    /// - `encoded`: sRGB, with `white` as maximum; linear without.
    pub fn add(&mut self, encoded: [f64; 3], white: Option<f64>) -> Vec3 {
        // A table for bytes, the usual case: the transfer function would take longer than the rest of a vertex.
        static OF_BYTES: LazyLock<[f64; 256]> =
            LazyLock::new(|| std::array::from_fn(|byte| decode_srgb(byte as f64 / 255.0)));
        let linear = encoded.map(|value| match (value as u8, white) {
            (byte, Some(255.0)) if f64::from(byte) == value => OF_BYTES[usize::from(byte)],
            (_, Some(white)) if !value.is_nan() => decode_srgb((value / white).clamp(0.0, 1.0)),
            (_, None) if (value as f32).is_finite() => value,
            _ => 0.0,
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
];
const RED: &[&str] = &["red", "r", "diffuse_red"];
const GREEN: &[&str] = &["green", "g", "diffuse_green"];
const BLUE: &[&str] = &["blue", "b", "diffuse_blue"];
const N_ROLES: usize = 8;
/// First roles of normals and texture coordinates.
const NORMAL: usize = 3;
const UV: usize = 6;

/// What is read as colours.
#[derive(Clone, Copy, Debug)]
pub(crate) enum ColourSource<'a> {
    /// Red, green and blue, sRGB: of vertices, otherwise of faces.
    Srgb,
    /// An attribute of Mitsuba, linear: three properties, or one for all channels.
    Attribute { of_faces: bool, name: &'a str },
}

/// The properties of a colour.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ColourProperties {
    /// Index of each channel.
    channels: [usize; 3],
    /// Maximum of an sRGB colour; `None` of a linear one.
    pub white: Option<f64>,
}

impl ColourProperties {
    /// `None` if the element has no such colours.
    pub fn of(element: &Element, source: ColourSource) -> Option<Self> {
        let number = |names: &[&str]| element.property(names).filter(|&i| element.properties[i].length.is_none());
        let rgb = || Some([number(RED)?, number(GREEN)?, number(BLUE)?]);
        match source {
            ColourSource::Srgb => {
                let channels = rgb()?;
                Some(Self { channels, white: Some(element.properties[channels[2]].number.white()) })
            }
            ColourSource::Attribute { of_faces, name } => {
                let part = |prefix: &str, end: &str| number(&[&format!("{prefix}_{end}")]);
                // The endings of Mitsuba; it adds `_color` to the name of what ends with r, g and b.
                let of_color = name.strip_suffix("_color").map(|prefix| (prefix, ["r", "g", "b"]));
                let endings = [["0", "1", "2"], ["1", "2", "3"], ["x", "y", "z"]].map(|ends| (name, ends));
                let attribute = endings.into_iter().chain(of_color).find_map(|(prefix, ends)| {
                    let first = part(prefix, ends[0])?;
                    Some(match (part(prefix, ends[1]), part(prefix, ends[2])) {
                        (Some(second), Some(third)) => [first, second, third],
                        _ => [first; 3],
                    })
                });
                let is_here = of_faces == (element.name == "face");
                let channels = attribute.or_else(|| rgb().filter(|_| name == "color")).filter(|_| is_here)?;
                Some(Self { channels, white: None })
            }
        }
    }

    /// Stores the value of a property where it belongs.
    #[inline]
    pub fn store(&self, property: usize, value: f64, color: &mut [f64; 3]) {
        (0..3).filter(|&channel| self.channels[channel] == property).for_each(|channel| color[channel] = value);
    }

    #[inline]
    pub fn contains(&self, property: usize) -> bool {
        self.channels.contains(&property)
    }
}

impl PlyVertices {
    /// Reads all rows; returns the number of those with more numbers than declared.
    ///
    /// - `source`: of the colours; `ignored`: receives the indices of properties that are not used.
    pub fn read(
        &mut self,
        element: &Element,
        rows: &mut impl Rows,
        source: ColourSource,
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
        let [has_normals, has_uvs] = [NORMAL..UV, UV..N_ROLES].map(|roles| has[roles].iter().all(|&has| has));
        let colour = ColourProperties::of(element, source);
        let is_used = |i: usize| match role_of[i] {
            None => colour.is_some_and(|colour| colour.contains(i)),
            Some(0..NORMAL) => true,
            Some(NORMAL..UV) => has_normals,
            Some(_) => has_uvs,
        };
        ignored.extend((0..role_of.len()).filter(|&i| !is_used(i)));
        let (count, model) = (element.count as usize, &mut self.indexed);
        model.positions.reserve_exact(count);
        model.normals.reserve_exact(if has_normals { count } else { 0 });
        model.uvs.reserve_exact(if has_uvs { count } else { 0 });
        model.colors.reserve_exact(if colour.is_some() { count } else { 0 });
        let (mut values, mut channels, mut long_rows) = ([0.0; N_ROLES], [0.0; 3], 0);
        for row in 0..element.count {
            let missing = |problem, rows: &_| missing(problem, element, row, rows);
            rows.begin_row().map_err(|problem| missing(problem, rows))?;
            for (i, (property, role)) in element.properties.iter().zip(&role_of).enumerate() {
                match (property.length, role) {
                    (Some(_), _) => skip_list(element, row, property, rows)?,
                    (None, Some(role)) => {
                        values[*role] = rows.next(property.number).map_err(|problem| missing(problem, rows))?;
                    }
                    (None, None) if let Some(colour) = colour.filter(|colour| colour.contains(i)) => {
                        let value = rows.next(property.number).map_err(|problem| missing(problem, rows))?;
                        colour.store(i, value, &mut channels);
                    }
                    (None, None) => rows.skip(property.number, 1).map_err(|problem| missing(problem, rows))?,
                }
            }
            long_rows += usize::from(rows.end_row());
            let [x, y, z, nx, ny, nz, u, v] = values;
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
            if let Some(ColourProperties { white, .. }) = colour {
                model.colors.push(self.colours.add(channels, white).extend(1.0));
            }
        }
        // A material says what is the same everywhere; attributes are asked for by name.
        if !self.colours.differ && matches!(source, ColourSource::Srgb) {
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
        colours.add([1.0, 0.0, f64::NAN], Some(1.0));
        assert_eq!((colours.differ, colours.material().diffuse), (false, Some(Vec3::X)));
        colours.add([-1.0, 0.0, 300.0], Some(255.0));
        assert_eq!((colours.differ, colours.material().diffuse), (true, Some(Vec3::new(0.5, 0.0, 0.5))));
    }
}
