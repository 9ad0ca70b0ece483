//! Triangles of a mesh that lie on each other, back to back.
//!
//! This is how one-sided surfaces are made visible from both sides: a second triangle with the same corners faces the
//! other way. A ray that hits both at one distance is given one of them; if that shows its back, which is invisible, the
//! other one is hit.

use crate::core::snapshot::Geometry;
use firstlight_kdtree::Hit;
use firstlight_mesh::Mesh;
use rustc_hash::{FxHashMap, FxHasher};
use std::hash::{Hash, Hasher};
use std::sync::{Arc, OnceLock};

/// For each triangle that has one, the triangle that faces the other way.
type TwinTriangles = FxHashMap<u32, u32>;

/// See the [module](self). They are looked for once a ray hits the back of a one-sided surface of the object.
#[derive(Debug, Default)]
pub(crate) struct Twins {
    of_object: Vec<OnceLock<Arc<TwinTriangles>>>,
}

impl Twins {
    /// - `before`: another scene, which may have some of the same meshes at the same indices.
    pub fn of(geometry: &Geometry, before: Option<(&Geometry, &Self)>) -> Self {
        let mesh_of = |geometry: &Geometry, i: usize| geometry.objects.get(i).and_then(|object| object.mesh.clone());
        let known = |i: usize| {
            let (other, twins) = before?;
            let is_same = Arc::ptr_eq(&mesh_of(geometry, i)?, &mesh_of(other, i)?);
            twins.of_object.get(i).filter(|_| is_same).cloned()
        };
        Self { of_object: (0..geometry.objects.len()).map(|i| known(i).unwrap_or_default()).collect() }
    }

    /// The hit of the triangle that faces the other way; `None` if there is none.
    pub fn facing(&self, geometry: &Geometry, hit: &Hit) -> Option<Hit> {
        let mesh = geometry.objects[hit.object as usize].mesh.as_ref()?;
        let twins = self.of_object[hit.object as usize].get_or_init(|| Arc::new(twin_triangles(mesh)));
        let prim = *twins.get(&hit.prim)?;
        let corners = |prim: u32| mesh.triangles[prim as usize].map(|corner| mesh.positions[corner as usize]);
        let (own, others) = (corners(hit.prim), corners(prim));
        let weights = [1.0 - hit.u - hit.v, hit.u, hit.v];
        let [_, u, v] = others.map(|other| own.iter().position(|own| *own == other).map_or(0.0, |k| weights[k]));
        Some(Hit { u, v, prim, ..*hit })
    }
}

fn twin_triangles(mesh: &Mesh) -> TwinTriangles {
    /// Corners in one order, and whether that takes an odd number of exchanges.
    fn sorted(mut corners: [[u32; 3]; 3]) -> ([[u32; 3]; 3], bool) {
        let mut is_odd = false;
        for (a, b) in [(0, 1), (1, 2), (0, 1)] {
            if corners[a] > corners[b] {
                corners.swap(a, b);
                is_odd = !is_odd;
            }
        }
        (corners, is_odd)
    }
    // Both zeros are one place.
    let place = |corner: u32| (mesh.positions[corner as usize] + 0.0).to_array().map(f32::to_bits);
    let corners = |triangle: u32| sorted(mesh.triangles[triangle as usize].map(place));
    let mut all: Vec<(u64, u32)> = (0..mesh.triangles.len() as u32)
        .map(|triangle| {
            let mut hasher = FxHasher::default();
            corners(triangle).0.hash(&mut hasher);
            (hasher.finish(), triangle)
        })
        .collect();
    all.sort_unstable();
    let mut twins = TwinTriangles::default();
    for group in all.chunk_by(|a, b| a.0 == b.0).filter(|group| group.len() > 1) {
        for &(_, triangle) in group {
            let (places, is_odd) = corners(triangle);
            let faces_away = |other: &&(u64, u32)| corners(other.1) == (places, !is_odd);
            twins.extend(group.iter().find(faces_away).map(|&(_, other)| (triangle, other)));
        }
    }
    twins
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::snapshot::Object;
    use firstlight_kdtree::Shape;
    use glam::{DVec3, Vec3};

    #[test]
    fn each_triangle_finds_the_one_that_faces_the_other_way() {
        let points = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Y, DVec3::ZERO, DVec3::X, DVec3::Z];
        // The second is the first with other vertices, the third the same way round, the last two flat.
        let triangles = vec![[0, 1, 2], [3, 5, 4], [1, 2, 0], [0, 1, 6], [2, 3, 0], [3, 2, 0]];
        let mesh = Mesh::from_f64(&points, triangles).unwrap();
        let twins = twin_triangles(&mesh);
        let mut found: Vec<(u32, u32)> = twins.into_iter().filter(|(triangle, _)| *triangle < 4).collect();
        found.sort_unstable();
        assert_eq!(found, [(0, 1), (1, 0), (2, 1)]);
        // The same place on both.
        let at = |prim: u32, u: f32, v: f32| {
            let corners = mesh.triangles[prim as usize].map(|corner| mesh.positions[corner as usize]);
            (1.0 - u - v) * corners[0] + u * corners[1] + v * corners[2]
        };
        let object = Object { mesh: Some(Arc::new(mesh.clone())), ..Object::plain(0) };
        let geometry = Geometry::build(vec![Shape::Sphere { center: Vec3::ZERO, radius: 1.0 }], vec![object]);
        let twins = Twins::of(&geometry, None);
        let hit = Hit { t: 1.0, u: 0.2, v: 0.3, prim: 0, object: 0 };
        let other = twins.facing(&geometry, &hit).unwrap();
        assert_eq!((other.prim, other.t), (1, 1.0));
        assert!((at(0, 0.2, 0.3) - at(1, other.u, other.v)).length() < 1e-6, "{other:?}");
        assert_eq!(twins.facing(&geometry, &Hit { prim: 3, ..hit }), None);
    }
}
