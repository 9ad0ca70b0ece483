//! Guesses which side of a model is its front if the file does not say: the side of the head.
//!
//! Models are usually made to be seen from +Z, which is also where the front -Y of a model with Z up ends up, and
//! sometimes from -Z. Creatures and figures tell which of the two: their upper part, the head, is in front of the
//! centre of their surface; tail, back and shell are behind it. Models without a head are not rotated.

use firstlight_format::choice::UpAxis;
use firstlight_mesh::Mesh;
use glam::DVec3;

/// Height of the head, as a fraction of the height of the model.
const HEAD: f64 = 1.0 / 3.0;
/// Smaller offsets, as a fraction of the depth, are ignored: upright figures, busts and skulls have up to 0.088 to their
/// backs, the armadillo of Stanford 0.093 to its front.
const LEAN: f64 = 1.0 / 11.0;

/// Whether the front is at -Z once `up` points along +Y.
///
/// True if the centroid of the surface of the upper third is offset from that of the whole surface by at least an
/// eleventh of the depth towards -Z, and more towards -Z than to either side.
pub fn faces_away(mesh: &Mesh, up: UpAxis) -> bool {
    let point = |vertex: u32| {
        let p = mesh.positions[vertex as usize].as_dvec3();
        match up {
            UpAxis::Y => p,
            UpAxis::Z => DVec3::new(p.x, p.z, -p.y),
        }
    };
    let triangles = || mesh.triangles.iter().map(|corners| corners.map(point));
    let corners = triangles().flatten();
    let (min, max) =
        corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), corner| (min.min(corner), max.max(corner)));
    let level = max.y - HEAD * (max.y - min.y);
    let (mut whole, mut head) = (Posture::default(), Posture::default());
    for triangle in triangles() {
        whole.add(&triangle);
        head.add(&above(&triangle, level));
    }
    let (Some(center), Some(head)) = (whole.center(), head.center()) else { return false };
    let lean = head - center;
    -lean.z > lean.x.abs() && -lean.z > LEAN * (max.z - min.z)
}

/// Area and first moment of a surface. Both have a factor of 2, which cancels in the centroid.
#[derive(Default)]
struct Posture {
    area: f64,
    moment: DVec3,
}

impl Posture {
    /// Adds a planar convex polygon.
    fn add(&mut self, polygon: &[DVec3]) {
        for pair in polygon.get(1..).unwrap_or_default().windows(2) {
            let (a, b, c) = (polygon[0], pair[0], pair[1]);
            let area = (b - a).cross(c - a).length();
            self.area += area;
            self.moment += area * (a + b + c) / 3.0;
        }
    }

    fn center(&self) -> Option<DVec3> {
        (self.area > 0.0).then(|| self.moment / self.area)
    }
}

/// The part of a triangle above a height.
fn above(triangle: &[DVec3; 3], level: f64) -> Vec<DVec3> {
    let mut part = Vec::with_capacity(4);
    for i in 0..3 {
        let (a, b) = (triangle[i], triangle[(i + 1) % 3]);
        if a.y >= level {
            part.push(a);
        }
        if (a.y >= level) != (b.y >= level) {
            part.push(a.lerp(b, (level - a.y) / (b.y - a.y)));
        }
    }
    part
}

#[cfg(test)]
mod tests {
    use super::*;
    use firstlight_mesh::procedural::{cuboid, icosphere};

    /// Blocks: centre and size of each.
    fn blocks(parts: &[(DVec3, DVec3)], up: UpAxis, turned: bool) -> Mesh {
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        for &(center, size) in parts {
            let cube = cuboid(size);
            let first = positions.len() as u32;
            positions.extend(cube.positions.iter().map(|position| position.as_dvec3() + cube.center + center));
            triangles.extend(cube.triangles.iter().map(|corners| corners.map(|corner| corner + first)));
        }
        for p in &mut positions {
            let seen = if turned { DVec3::new(-p.x, p.y, -p.z) } else { *p };
            *p = if up == UpAxis::Z { DVec3::new(seen.x, -seen.z, seen.y) } else { seen };
        }
        Mesh::from_f64(&positions, triangles).unwrap()
    }

    /// It faces +Z: a body on four legs, a neck, a head, a tail.
    fn horse() -> Vec<(DVec3, DVec3)> {
        let mut parts = vec![
            (DVec3::new(0.0, 1.2, 0.0), DVec3::new(0.5, 0.5, 1.6)),
            (DVec3::new(0.0, 1.7, 0.8), DVec3::new(0.2, 0.7, 0.3)),
            (DVec3::new(0.0, 2.0, 1.1), DVec3::new(0.25, 0.25, 0.6)),
            (DVec3::new(0.0, 1.0, -0.9), DVec3::new(0.1, 0.7, 0.1)),
        ];
        parts.extend([(-0.2, -0.7), (0.2, -0.7), (-0.2, 0.7), (0.2, 0.7)].map(|(x, z)| {
            let middle = DVec3::new(x, 0.5, z);
            (middle, DVec3::new(0.12, 1.0, 0.12))
        }));
        parts
    }

    #[test]
    fn a_creature_is_seen_from_where_its_head_is() {
        for up in [UpAxis::Y, UpAxis::Z] {
            assert!(!faces_away(&blocks(&horse(), up, false), up));
            assert!(faces_away(&blocks(&horse(), up, true), up));
        }
        // An upright figure: arms to the sides, and a nose that decides.
        let figure = [
            (DVec3::new(0.0, 1.1, 0.0), DVec3::new(0.5, 0.8, 0.25)),
            (DVec3::new(0.0, 1.7, 0.1), DVec3::new(0.3, 0.35, 0.4)),
            (DVec3::new(-0.15, 0.35, 0.0), DVec3::new(0.2, 0.7, 0.25)),
            (DVec3::new(0.15, 0.35, 0.0), DVec3::new(0.2, 0.7, 0.25)),
        ];
        assert!(!faces_away(&blocks(&figure, UpAxis::Y, false), UpAxis::Y));
        assert!(faces_away(&blocks(&figure, UpAxis::Y, true), UpAxis::Y));
    }

    #[test]
    fn what_has_no_head_stays_as_its_file_has_it() {
        for mesh in [cuboid(DVec3::new(1.0, 2.0, 3.0)), icosphere(8)] {
            assert!(!faces_away(&mesh, UpAxis::Y) && !faces_away(&mesh, UpAxis::Z));
        }
        // A head to the side and slightly back: as likely a handle.
        let sideways: Vec<_> = horse()
            .into_iter()
            .map(|(p, s)| (DVec3::new(p.z, p.y, p.x - 0.2 * p.z), DVec3::new(s.z, s.y, s.x)))
            .collect();
        for turned in [false, true] {
            assert!(!faces_away(&blocks(&sideways, UpAxis::Y, turned), UpAxis::Y));
        }
        assert!(!faces_away(&Mesh::default(), UpAxis::Y));
    }

    #[test]
    fn what_is_cut_at_the_level_counts_in_part() {
        let triangle = [DVec3::ZERO, DVec3::new(2.0, 0.0, 0.0), DVec3::new(0.0, 2.0, 0.0)];
        let area = |polygon: &[DVec3]| {
            let mut skin = Posture::default();
            skin.add(polygon);
            0.5 * skin.area
        };
        assert_eq!(area(&above(&triangle, -1.0)), 2.0);
        assert_eq!(area(&above(&triangle, 1.0)), 0.5);
        assert_eq!(area(&above(&triangle, 3.0)), 0.0);
    }
}
