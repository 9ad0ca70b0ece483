//! Checked construction of meshes from positions and indices of any origin.

use super::Mesh;
use glam::{DVec3, Vec3};

/// Reasons why data are not a valid mesh. Indices count from 0.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// The list of triangles is empty.
    #[error("the mesh has no triangles")]
    NoTriangles,
    /// A triangle refers to a vertex that does not exist.
    #[error("triangle {triangle} uses vertex {index}, but there are {count}")]
    IndexOutOfRange {
        /// Index of the triangle.
        triangle: usize,
        /// The index that it refers to.
        index: u32,
        /// Number of vertices.
        count: usize,
    },
    /// A vertex has a NaN coordinate, or an infinite one in [`Mesh::from_f64`]; or the centre is not finite.
    #[error("vertex {vertex} has a coordinate that is NaN or infinite")]
    NotFinite {
        /// Index of the vertex; 0 for the centre.
        vertex: usize,
    },
    /// Squared lengths or areas of the mesh's bounds overflow `f32`.
    #[error("the mesh is {size:e} across, more than single precision can hold")]
    TooLarge {
        /// Longest side of the bounds, metres.
        size: f64,
    },
    /// There are more vertices than a `u32` can index.
    #[error("the mesh has {count} vertices, more than 32-bit indices can name")]
    TooManyVertices {
        /// Number of vertices.
        count: usize,
    },
    /// A shading normal is not of unit length.
    #[error("the normal of vertex {vertex} is not of length 1")]
    NormalNotUnit {
        /// Index of the vertex.
        vertex: usize,
    },
    /// A texture coordinate is NaN or infinite.
    #[error("the texture coordinate of vertex {vertex} is NaN or infinite")]
    UvNotFinite {
        /// Index of the vertex.
        vertex: usize,
    },
    /// A vertex colour is negative, NaN or infinite.
    #[error("the color of vertex {vertex} is negative, NaN or infinite")]
    BadColor {
        /// Index of the vertex.
        vertex: usize,
    },
    /// A tangent is not of unit length, or its `w` is neither 1 nor -1.
    #[error("the tangent of vertex {vertex} is not of length 1 with a sign")]
    BadTangent {
        /// Index of the vertex.
        vertex: usize,
    },
    /// A list that is not empty has the wrong length.
    #[error("there are {found} {what}, but {expected} were expected")]
    WrongCount {
        /// Name of the list: normals, texture coordinates or material slots.
        what: &'static str,
        /// Length of the list.
        found: usize,
        /// Number of vertices, or of triangles for slots.
        expected: usize,
    },
}

impl Mesh {
    /// Creates a mesh from positions in file coordinates, stored relative to the centre of their bounds, and validates
    /// it.
    ///
    /// The error of a position is at most 2⁻²⁴ of half the size of the bounds, wherever the bounds lie.
    ///
    /// # Errors
    /// As [`Self::validate`].
    pub fn from_f64(positions: &[DVec3], triangles: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        if let Some(vertex) = positions.iter().position(|p| !p.is_finite()) {
            return Err(MeshError::NotFinite { vertex });
        }
        let min = positions.iter().copied().fold(DVec3::INFINITY, DVec3::min);
        let max = positions.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
        // Halved before adding: the sum of two huge coordinates may overflow.
        let center = if positions.is_empty() { DVec3::ZERO } else { 0.5 * min + 0.5 * max };
        let mesh = Self {
            positions: positions.iter().map(|p| (p - center).as_vec3()).collect(),
            center,
            triangles,
            ..Self::default()
        };
        mesh.validate()?;
        Ok(mesh)
    }

    /// Checks everything that the rest of the program relies on: indices in range, finite positions whose bounds have a
    /// finite size and area in `f32`, unit normals, finite texture coordinates, list lengths.
    ///
    /// # Errors
    /// The first violation found.
    pub fn validate(&self) -> Result<(), MeshError> {
        let count = self.positions.len();
        if u32::try_from(count).is_err() {
            return Err(MeshError::TooManyVertices { count });
        }
        if self.triangles.is_empty() {
            return Err(MeshError::NoTriangles);
        }
        for (triangle, corners) in self.triangles.iter().enumerate() {
            if let Some(&index) = corners.iter().find(|&&i| i as usize >= count) {
                return Err(MeshError::IndexOutOfRange { triangle, index, count });
            }
        }
        if !self.center.is_finite() {
            return Err(MeshError::NotFinite { vertex: 0 });
        }
        if let Some(vertex) = self.positions.iter().position(|p| p.is_nan()) {
            return Err(MeshError::NotFinite { vertex });
        }
        let min = self.positions.iter().copied().fold(Vec3::INFINITY, Vec3::min).as_dvec3();
        let max = self.positions.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max).as_dvec3();
        let size = (max - min).max_element();
        // Squared lengths and areas of the bounds must stay finite in single precision.
        let square = 16.0 * size * size;
        if square.is_nan() || square > f64::from(f32::MAX) {
            return Err(MeshError::TooLarge { size });
        }
        self.validate_attributes()
    }

    fn validate_attributes(&self) -> Result<(), MeshError> {
        let lists = [
            ("normals", self.normals.len(), self.positions.len()),
            ("texture coordinates", self.uvs.len(), self.positions.len()),
            ("second texture coordinates", self.uvs2.len(), self.positions.len()),
            ("vertex colors", self.colors.len(), self.positions.len()),
            ("tangents", self.tangents.len(), self.positions.len()),
            ("material slots", self.slots.len(), self.triangles.len()),
        ];
        for (what, found, expected) in lists {
            if found != 0 && found != expected {
                return Err(MeshError::WrongCount { what, found, expected });
            }
        }
        if let Some(vertex) = self.normals.iter().position(|n| !n.is_normalized()) {
            return Err(MeshError::NormalNotUnit { vertex });
        }
        if let Some(vertex) = self.uvs.iter().position(|uv| !uv.is_finite()) {
            return Err(MeshError::UvNotFinite { vertex });
        }
        if let Some(vertex) = self.uvs2.iter().position(|uv| !uv.is_finite()) {
            return Err(MeshError::UvNotFinite { vertex });
        }
        if let Some(vertex) = self.colors.iter().position(|color| !color.is_finite() || color.min_element() < 0.0) {
            return Err(MeshError::BadColor { vertex });
        }
        if let Some(vertex) = self.tangents.iter().position(|t| !t.truncate().is_normalized() || t.w.abs() != 1.0) {
            return Err(MeshError::BadTangent { vertex });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;

    const CORNERS: [DVec3; 3] = [DVec3::ZERO, DVec3::X, DVec3::Y];

    #[test]
    fn a_far_mesh_keeps_the_digits_of_a_near_one() {
        let far = dvec3(5e6, -4.5e6, 500.0);
        let near = Mesh::from_f64(&CORNERS, vec![[0, 1, 2]]).unwrap();
        let moved = Mesh::from_f64(&CORNERS.map(|p| p + far), vec![[0, 1, 2]]).unwrap();
        assert_eq!(near.positions, moved.positions);
        assert_eq!(near.center + far, moved.center);
    }

    #[test]
    fn bad_numbers_are_named() {
        let of = |p: [DVec3; 3], t: [u32; 3]| Mesh::from_f64(&p, vec![t]).unwrap_err();
        assert_eq!(of(CORNERS, [0, 1, 3]), MeshError::IndexOutOfRange { triangle: 0, index: 3, count: 3 });
        assert_eq!(of([DVec3::ZERO, DVec3::NAN, DVec3::Y], [0, 1, 2]), MeshError::NotFinite { vertex: 1 });
        let huge = of([DVec3::ZERO, dvec3(1e300, 0.0, 0.0), DVec3::Y], [0, 1, 2]);
        assert!(matches!(huge, MeshError::TooLarge { .. }), "{huge}");
        let across = of([dvec3(-1e308, 0.0, 0.0), dvec3(1.7e308, 0.0, 0.0), DVec3::Y], [0, 1, 2]);
        assert!(matches!(across, MeshError::TooLarge { .. }), "{across}");
        assert_eq!(Mesh::from_f64(&[], Vec::new()), Err(MeshError::NoTriangles));
    }

    #[test]
    fn attribute_lists_must_fit() {
        let mesh = Mesh::from_f64(&CORNERS, vec![[0, 1, 2]]).unwrap();
        let short = Mesh { normals: vec![Vec3::Z], ..mesh.clone() };
        assert_eq!(short.validate(), Err(MeshError::WrongCount { what: "normals", found: 1, expected: 3 }));
        let long = Mesh { normals: vec![Vec3::Z, Vec3::ONE, Vec3::Z], ..mesh.clone() };
        assert_eq!(long.validate(), Err(MeshError::NormalNotUnit { vertex: 1 }));
        let uvs = vec![glam::Vec2::ZERO, glam::Vec2::NAN, glam::Vec2::ZERO];
        assert_eq!(Mesh { uvs, ..mesh }.validate(), Err(MeshError::UvNotFinite { vertex: 1 }));
    }
}
