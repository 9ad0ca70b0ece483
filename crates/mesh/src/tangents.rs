//! Tangents from texture coordinates, as normal maps expect them.
//!
//! Source: MikkTSpace, see [`super::mikktspace`].

use super::Mesh;
use super::mikktspace::corner_tangents;
use glam::{Vec3, Vec4};

impl Mesh {
    /// Adds tangents for the first texture coordinate; vertices whose corners differ in their tangent are split.
    ///
    /// A mesh without normals or texture coordinates is returned unchanged.
    pub fn with_tangents(mut self) -> Self {
        if self.normals.len() != self.positions.len() || self.uvs.len() != self.positions.len() {
            return self;
        }
        // Where the texture coordinates have no direction, an arbitrary tangent is used.
        let along = |normal: &Vec3| normal.any_orthonormal_vector();
        let mut corners = corner_tangents(&self);
        for (tangent, &vertex) in corners.iter_mut().zip(self.triangles.as_flattened()) {
            let direction = tangent.truncate().try_normalize().filter(|direction| direction.is_finite());
            let direction = direction.unwrap_or_else(|| along(&self.normals[vertex as usize]));
            *tangent = direction.extend(if tangent.w < 0.0 { -1.0 } else { 1.0 });
        }
        let keys: Vec<[u32; 4]> = corners.iter().map(|tangent| tangent.to_array().map(f32::to_bits)).collect();
        self.tangents.clear();
        let tangents = self.split_by(&keys);
        let tangent = |(key, normal): (&Option<[u32; 4]>, &Vec3)| {
            key.map_or_else(|| along(normal).extend(1.0), |bits| Vec4::from(bits.map(f32::from_bits)))
        };
        self.tangents = tangents.iter().zip(&self.normals).map(tangent).collect();
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DVec3, Vec2};

    /// Two triangles of a square; `u` runs along `direction`, mirrored on the second triangle if `mirrored`.
    fn square(angle: f32, mirrored: bool) -> Mesh {
        let points = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
        let positions: Vec<DVec3> = points.iter().map(|&(x, y)| DVec3::new(x, y, 0.0)).collect();
        let turn = glam::Mat2::from_angle(-angle);
        let uv = |(i, &(x, y)): (usize, &(f64, f64))| {
            let uv = turn * Vec2::new(x as f32, y as f32);
            if mirrored && i >= 3 { Vec2::new(-uv.x, uv.y) } else { uv }
        };
        let mut mesh = Mesh::from_f64(&positions, vec![[0, 1, 2], [3, 4, 5]]).unwrap();
        mesh.uvs = points.iter().enumerate().map(uv).collect();
        mesh.normals = vec![Vec3::Z; 6];
        mesh
    }

    #[test]
    fn tangents_follow_the_first_texture_coordinate() {
        for angle in [0.0, 0.7, 2.5] {
            let mesh = square(angle, false).with_tangents();
            mesh.validate().unwrap();
            for tangent in &mesh.tangents {
                let expected = Vec3::new(angle.cos(), angle.sin(), 0.0);
                assert!(tangent.truncate().abs_diff_eq(expected, 1e-5) && tangent.w == 1.0, "{angle}: {tangent}");
            }
        }
    }

    #[test]
    fn mirrored_coordinates_have_the_other_sign() {
        let mesh = square(0.3, true).with_tangents();
        mesh.validate().unwrap();
        let of = |triangle: usize| mesh.triangles[triangle].map(|vertex| mesh.tangents[vertex as usize]);
        let along = Vec3::new(0.3_f32.cos(), 0.3_f32.sin(), 0.0);
        assert!(of(0).iter().all(|t| t.truncate().abs_diff_eq(along, 1e-5) && t.w == 1.0));
        assert!(of(1).iter().all(|t| t.truncate().abs_diff_eq(-along, 1e-5) && t.w == -1.0));
    }

    #[test]
    fn corners_that_share_a_vertex_are_split_where_their_tangents_differ() {
        let mut mesh = square(0.0, true);
        mesh.triangles[1] = [0, 2, 5];
        mesh.uvs2 = mesh.uvs.clone();
        let before = mesh.clone();
        let mesh = mesh.with_tangents();
        mesh.validate().unwrap();
        for (triangle, old) in mesh.triangles.iter().zip(&before.triangles) {
            for (&vertex, &old) in triangle.iter().zip(old) {
                assert_eq!(mesh.positions[vertex as usize], before.positions[old as usize]);
                assert_eq!(mesh.uvs2[vertex as usize], before.uvs2[old as usize]);
            }
        }
        assert_eq!(before.clone().with_tangents(), mesh, "the same each time");
    }

    #[test]
    fn without_normals_or_coordinates_nothing_happens() {
        let bare = Mesh { normals: Vec::new(), ..square(0.0, false) };
        assert!(bare.with_tangents().tangents.is_empty());
    }
}
