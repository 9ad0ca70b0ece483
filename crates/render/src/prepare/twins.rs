//! Triangles of a mesh that may lie on each other, back to back.
//!
//! This is how one-sided surfaces are made visible from both sides: other triangles with the same corners face the other
//! way. Those of a polygon may divide it otherwise, but share edges. A ray that hits two at one distance is given one of
//! them; if that shows its back, which is invisible, the other one is hit.

use crate::core::snapshot::Geometry;
use firstlight_kdtree::Hit;
use firstlight_mesh::Mesh;
use glam::DVec3;
use rustc_hash::{FxHashMap, FxHasher};
use std::hash::{Hash, Hasher};
use std::sync::{Arc, OnceLock};

/// For each triangle those that share an edge with it and face away from where it faces.
type Opposites = FxHashMap<u32, Vec<u32>>;

/// See the [module](self). They are looked for once a ray hits the back of a one-sided surface of the object.
#[derive(Debug, Default)]
pub(crate) struct Twins {
    of_object: Vec<OnceLock<Arc<Opposites>>>,
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

    /// Hits of triangles that may lie where that of a hit does, and face away from where it faces: each at the point that
    /// is straight below.
    pub fn opposite(&self, geometry: &Geometry, hit: &Hit) -> impl Iterator<Item = Hit> {
        let mesh = geometry.objects[hit.object as usize].mesh.as_ref();
        let others = mesh.and_then(|mesh| {
            let opposites = self.of_object[hit.object as usize].get_or_init(|| Arc::new(opposites(mesh)));
            opposites.get(&hit.prim)
        });
        others.into_iter().flatten().filter_map(move |&prim| below(mesh?, hit, prim))
    }
}

/// The corners of a triangle, in the space of the object.
fn corners(mesh: &Mesh, prim: u32) -> [DVec3; 3] {
    mesh.triangles[prim as usize].map(|corner| mesh.positions[corner as usize].as_dvec3())
}

fn normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

/// The point of another triangle on its perpendicular through that of a hit; `None` outside of it.
fn below(mesh: &Mesh, hit: &Hit, prim: u32) -> Option<Hit> {
    let [u, v] = [hit.u, hit.v].map(f64::from);
    let [a, b, c] = corners(mesh, hit.prim);
    let point = (1.0 - u - v) * a + u * b + v * c;
    let [a, b, c] = corners(mesh, prim);
    let normal = normal([a, b, c]);
    let of_edge = |edge: DVec3| edge.dot(normal) / normal.length_squared();
    let [u, v] = [of_edge((point - a).cross(c - a)), of_edge((b - a).cross(point - a))];
    // The coordinates of the hit are rounded, so that a point on an edge may be beside it.
    let is_inside = u.min(v).min(1.0 - u - v) >= -f64::from(f32::EPSILON);
    is_inside.then(|| Hit { u: u.max(0.0) as f32, v: v.max(0.0) as f32, prim, ..*hit })
}

fn opposites(mesh: &Mesh) -> Opposites {
    /// Triangles at one edge beyond which they are not compared with each other.
    const MOST: usize = 64;
    // Both zeros are one place.
    let place = |corner: u32| (mesh.positions[corner as usize] + 0.0).to_array().map(f32::to_bits);
    let mut edges: Vec<(u64, u32)> = Vec::with_capacity(3 * mesh.triangles.len());
    for (triangle, &[a, b, c]) in (0..).zip(&mesh.triangles) {
        edges.extend([(a, b), (b, c), (c, a)].map(|(from, to)| {
            let mut ends = [place(from), place(to)];
            ends.sort_unstable();
            let mut hasher = FxHasher::default();
            ends.hash(&mut hasher);
            (hasher.finish(), triangle)
        }));
    }
    edges.sort_unstable();
    let mut opposites = Opposites::default();
    // Different edges of one hash cost a comparison, and no more.
    for edge in edges.chunk_by(|a, b| a.0 == b.0).filter(|edge| (2..=MOST).contains(&edge.len())) {
        for &(_, triangle) in edge {
            let facing = normal(corners(mesh, triangle));
            let others = edge.iter().map(|&(_, other)| other);
            let others = others.filter(|&other| normal(corners(mesh, other)).dot(facing) < 0.0);
            for other in others {
                let known = opposites.entry(triangle).or_default();
                if !known.contains(&other) {
                    known.push(other);
                }
            }
        }
    }
    opposites
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::snapshot::Object;
    use firstlight_kdtree::Shape;
    use glam::Vec3;

    #[test]
    fn each_triangle_finds_those_that_face_the_other_way_below_it() {
        let points = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Y, DVec3::ZERO, DVec3::X, DVec3::Z, DVec3::X + DVec3::Y];
        // The second is the first with other vertices, the third the same way round, the fourth upright; the last two are
        // the other halves of a square.
        let triangles = vec![[0, 1, 2], [3, 5, 4], [1, 2, 0], [0, 1, 6], [0, 7, 1], [0, 2, 7]];
        let mesh = Mesh::from_f64(&points, triangles).unwrap();
        let object = Object { mesh: Some(Arc::new(mesh.clone())), ..Object::plain(0) };
        let geometry = Geometry::build(vec![Shape::Sphere { center: Vec3::ZERO, radius: 1.0 }], vec![object]);
        let twins = Twins::of(&geometry, None);
        let at = |hit: &Hit| {
            let [a, b, c] = corners(&mesh, hit.prim);
            let [u, v] = [hit.u, hit.v].map(f64::from);
            (1.0 - u - v) * a + u * b + v * c
        };
        for (u, v, prim, expected) in [
            (0.5, 0.2, 0, vec![1, 4]),
            (0.2, 0.5, 0, vec![1, 5]),
            (0.2, 0.5, 1, vec![0, 2]),
            (0.0, 0.0, 0, vec![1, 4, 5]),
            (0.2, 0.5, 3, vec![]),
        ] {
            let hit = Hit { t: 1.0, u, v, prim, object: 0 };
            let found: Vec<Hit> = twins.opposite(&geometry, &hit).collect();
            let mut prims: Vec<u32> = found.iter().map(|hit| hit.prim).collect();
            prims.sort_unstable();
            assert_eq!(prims, expected, "{hit:?}");
            assert!(found.iter().all(|other| (at(other) - at(&hit)).length() < 1e-6), "{found:?}");
        }
    }
}
