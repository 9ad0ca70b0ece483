//! Whose back is seen: that of every mesh but closed bodies with the front outside and no camera within.

use crate::mitsuba::converter::Converter;
use crate::model::placing::corners_of;
use firstlight_format::parts::ObjectPart;
use firstlight_format::placement::Placement;
use firstlight_format::sources::MeshSource;
use firstlight_mesh::Mesh;
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::Arc;

impl Converter<'_> {
    /// Gives a black back to what only reflects, where it is seen.
    ///
    /// - `parts`: the meshes of the shapes.
    /// - `has_camera`: else, the camera will be outside of everything.
    pub(crate) fn blacken_backs(&mut self, parts: &HashMap<u32, Arc<Mesh>>, has_camera: bool) {
        let mut bodies: HashMap<u32, bool> = HashMap::new();
        for index in std::mem::take(&mut self.one_sided) {
            let object = &self.file.objects[index];
            let ObjectPart::Mesh { source: MeshSource::Part { shape, .. }, material: Some(name), .. } = object else {
                continue;
            };
            let Some(mesh) = parts.get(shape) else { continue };
            let is_body = *bodies.entry(*shape).or_insert_with(|| is_body(mesh));
            if !is_body || has_camera && self.is_around_a_camera(mesh, object) {
                let backed = self.with_black_back(&name.clone());
                if let ObjectPart::Mesh { material, .. } = &mut self.file.objects[index] {
                    *material = Some(backed);
                }
            }
        }
    }

    /// Whether a camera may be inside.
    fn is_around_a_camera(&self, mesh: &Mesh, object: &ObjectPart) -> bool {
        let local = Placement::from_part(object.transform()).affine().inverse();
        let (min, max) = corners_of(mesh);
        let others = self.file.cameras.iter().map(|(_, camera)| camera);
        others.chain([&self.file.camera]).any(|camera| {
            let eye = local.transform_point3(camera.eye);
            eye.cmpge(min).all() && eye.cmple(max).all()
        })
    }
}

/// Whether triangles enclose a body, with their front outside: each side is one of two triangles, in both directions.
fn is_body(mesh: &Mesh) -> bool {
    // Equal positions are one point, and one of -0 is at 0.
    let point = |vertex: u32| {
        let at = mesh.positions[vertex as usize].to_array();
        at.into_iter().fold(0, |hash, x| mixed(hash, u64::from((x + 0.0).to_bits())))
    };
    // Of one direction, the negative of that of the other: the sum is zero by chance for one mesh of 2⁶⁴.
    let side = |a: u64, b: u64| mixed(a, b).wrapping_sub(mixed(b, a));
    let of_triangle = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(point);
        let [p, q, r] = triangle.map(|vertex| mesh.positions[vertex as usize].as_dvec3());
        (side(a, b).wrapping_add(side(b, c)).wrapping_add(side(c, a)), p.dot(q.cross(r)))
    };
    let add = |a: (u64, f64), b: (u64, f64)| (a.0.wrapping_add(b.0), a.1 + b.1);
    let (sides, volume) = mesh.triangles.par_iter().map(of_triangle).reduce(|| (0, 0.0), add);
    sides == 0 && volume > 0.0
}

/// A hash of two numbers in this order (the finaliser of SplitMix64, Steele et al. 2014).
fn mixed(a: u64, b: u64) -> u64 {
    let x = a.rotate_left(23).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ b.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let x = (x ^ x >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let x = (x ^ x >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
    x ^ x >> 31
}

#[cfg(test)]
mod tests {
    use super::*;
    use firstlight_mesh::procedural::icosphere;

    #[test]
    fn bodies_are_closed_and_face_outwards() {
        let ball = icosphere(2);
        assert!(is_body(&ball));
        let turned = Mesh { triangles: ball.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect(), ..ball.clone() };
        assert!(!is_body(&turned), "it faces inwards");
        let torn = Mesh { triangles: ball.triangles[1..].to_vec(), ..ball.clone() };
        assert!(!is_body(&torn));
        // Every vertex of every triangle on its own, as files have them.
        let positions = ball.triangles.iter().flatten().map(|&vertex| ball.positions[vertex as usize]).collect();
        let triangles = (0..ball.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        assert!(is_body(&Mesh { positions, triangles, normals: Vec::new(), ..ball.clone() }));
        // A tube: its areas sum to zero, and it is open at both ends.
        let band = |t: &&[u32; 3]| t.iter().all(|&vertex| ball.positions[vertex as usize].z.abs() < 0.6);
        let tube = Mesh { triangles: ball.triangles.iter().filter(band).copied().collect(), ..ball.clone() };
        assert!(!tube.triangles.is_empty() && !is_body(&tube));
    }
}
