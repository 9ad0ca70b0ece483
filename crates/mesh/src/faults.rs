//! Counts of triangles that add nothing to a surface; the single definition for all reports.

use super::{Mesh, Welding};

/// Numbers of faulty triangles by kind; the kinds are disjoint.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Faults {
    /// Triangles with two corners at one position.
    pub collapsed: usize,
    /// Triangles on the same three distinct positions as an earlier one, of either orientation.
    pub duplicates: usize,
    /// Triangles whose three distinct positions are collinear, except duplicates.
    pub flat: usize,
}

impl Faults {
    /// Counts the faults of a mesh in the time of a sort.
    pub fn of(mesh: &Mesh) -> Self {
        let welding = Welding::of(&mesh.positions);
        let places: Vec<[u32; 3]> = mesh.triangles.iter().map(|&triangle| welding.places(triangle)).collect();
        Self::in_places(mesh, &places)
    }

    /// Counts faults.
    ///
    /// - `places`: welded position indices of each triangle's corners.
    pub(super) fn in_places(mesh: &Mesh, places: &[[u32; 3]]) -> Self {
        let mut keys: Vec<([u32; 3], u32)> = (places.iter().zip(0..))
            .filter(|(corners, _)| distinct(corners))
            .map(|(&corners, t)| {
                let mut key = corners;
                key.sort_unstable();
                (key, t)
            })
            .collect();
        let collapsed = places.len() - keys.len();
        keys.sort_unstable();
        let kept = |i: usize| i == 0 || keys[i - 1].0 != keys[i].0;
        let firsts = (0..keys.len()).filter(|&i| kept(i));
        let (n_firsts, flat) = firsts.fold((0, 0), |(n, flat), i| {
            let no_area = mesh.doubled_area_normal(keys[i].1 as usize).length_squared() == 0.0;
            (n + 1, flat + usize::from(no_area))
        });
        Self { collapsed, duplicates: keys.len() - n_firsts, flat }
    }

    /// Returns a sentence for each kind that occurs.
    pub fn sentences(&self) -> impl Iterator<Item = String> {
        [
            (self.collapsed, "have two corners at one place"),
            (self.duplicates, "lie on the same three places as an earlier one"),
            (self.flat, "have three corners on one line"),
        ]
        .into_iter()
        .filter(|&(count, _)| count > 0)
        .map(|(count, what)| format!("{count} triangles {what}"))
    }
}

pub(super) fn distinct(&[a, b, c]: &[u32; 3]) -> bool {
    a != b && b != c && c != a
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DVec3, dvec3};

    #[test]
    fn each_faulty_triangle_is_counted_once() {
        // Vertex 3 is at the position of vertex 0, vertex 4 on a line with 0 and 1.
        let points = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::ZERO, dvec3(2.0, 0.0, 0.0), DVec3::Z];
        let triangles =
            vec![[0, 1, 2], [0, 1, 2], [2, 1, 3], [0, 0, 1], [0, 3, 1], [3, 0, 1], [0, 1, 4], [4, 1, 3], [0, 1, 5]];
        let mesh = Mesh::from_f64(&points, triangles).unwrap();
        let faults = Faults::of(&mesh);
        assert_eq!(faults, Faults { collapsed: 3, duplicates: 3, flat: 1 });
        assert_eq!(faults.sentences().count(), 3);
        assert_eq!(Faults::default().sentences().count(), 0);
    }
}
