//! Triangulation of polygons.

use glam::{DVec2, DVec3};

/// Polygons with more corners are halved recursively: ear clipping takes quadratic time, and a fan would have very many
/// thin triangles at one vertex, which is bad for all later algorithms.
const MAX_EARS: usize = 1024;

/// Cuts a polygon with at least 3 corners into `corners.len() - 2` triangles of the same orientation; pushes indices
/// into `corners`.
///
/// Convex polygons become fans. Others are cut by ear clipping (Meisters 1975) in the plane of their Newell normal;
/// self-intersecting and degenerate ones fall back to the fan, so that nothing fails. With more than [`MAX_EARS`]
/// corners the polygon is assumed to be convex: one triangle between its two halves, then recursively in each half.
pub(crate) fn triangulate(corners: &[DVec3], triangles: &mut Vec<[usize; 3]>) {
    let count = corners.len();
    let fan = |from: &[usize], out: &mut Vec<[usize; 3]>| {
        out.extend((1..from.len().saturating_sub(1)).map(|i| [from[0], from[i], from[i + 1]]));
    };
    if count == 3 {
        return triangles.push([0, 1, 2]);
    }
    let all: Vec<usize> = (0..count).collect();
    if count > MAX_EARS {
        return halve(0, count - 1, triangles);
    }
    // Relative to the first corner: far from the origin the products below would lose precision.
    let origin = corners[0];
    let normal: DVec3 = (0..count).map(|i| (corners[i] - origin).cross(corners[(i + 1) % count] - origin)).sum();
    let Some((x, y)) = normal.try_normalize().map(DVec3::any_orthonormal_pair) else {
        return fan(&all, triangles);
    };
    // `any_orthonormal_pair` is right-handed with the normal, so that areas are positive.
    let flat: Vec<DVec2> = corners.iter().map(|p| DVec2::new((p - origin).dot(x), (p - origin).dot(y))).collect();
    let turn = |a: usize, b: usize, c: usize| (flat[b] - flat[a]).perp_dot(flat[c] - flat[b]);
    if (0..count).all(|i| turn(i, (i + 1) % count, (i + 2) % count) >= 0.0) {
        return fan(&all, triangles);
    }
    let mut ring = all;
    // The next ear is most often near the last one.
    let mut first = 0;
    while ring.len() > 3 {
        let n = ring.len();
        let at = |i: usize| ring[i % n];
        let is_ear = |i: &usize| {
            let (a, b, c) = (at(i + n - 1), at(*i), at(i + 1));
            turn(a, b, c) > 0.0
                && !ring.iter().any(|&p| {
                    let apart = flat[p] != flat[a] && flat[p] != flat[b] && flat[p] != flat[c];
                    apart && turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0
                })
        };
        let Some(ear) = (first..n).chain(0..first.min(n)).find(is_ear) else { break };
        triangles.push([at(ear + n - 1), at(ear), at(ear + 1)]);
        ring.remove(ear);
        first = ear.saturating_sub(1);
    }
    fan(&ring, triangles);
}

/// Triangulates the polygon of the corners `first..=last`: each corner gets at most two triangles per level of
/// recursion.
fn halve(first: usize, last: usize, triangles: &mut Vec<[usize; 3]>) {
    if last - first >= 2 {
        let middle = first.midpoint(last);
        triangles.push([first, middle, last]);
        halve(first, middle, triangles);
        halve(middle, last, triangles);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(corners: &[DVec3]) -> (f64, Vec<[usize; 3]>) {
        let mut triangles = Vec::new();
        triangulate(corners, &mut triangles);
        let sum = triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|i| corners[i]);
                // All triangles must face up: a fan at a concave corner has one that faces down.
                assert!((b - a).cross(c - a).z >= -1e-12, "{t:?}");
                0.5 * (b - a).cross(c - a).length()
            })
            .sum();
        (sum, triangles)
    }

    #[test]
    fn concave_polygons_keep_their_area_from_any_starting_corner() {
        let arrow = [(0.0, 0.0), (2.0, -1.0), (0.5, 0.0), (2.0, 1.0)].map(|(x, y)| DVec3::new(x, y, 0.0));
        let comb: Vec<DVec3> = [
            (0., 0.),
            (5., 0.),
            (5., 3.),
            (4., 3.),
            (4., 1.),
            (3., 1.),
            (3., 3.),
            (2., 3.),
            (2., 1.),
            (1., 1.),
            (1., 3.),
            (0., 3.),
        ]
        .map(|(x, y)| DVec3::new(x + 5e6, y - 4e6, 7.0))
        .to_vec();
        for start in 0..4 {
            let mut corners = arrow;
            corners.rotate_left(start);
            assert!((area(&corners).0 - 0.5).abs() < 1e-12, "start {start}");
        }
        for start in 0..12 {
            let mut corners = comb.clone();
            corners.rotate_left(start);
            let (found, triangles) = area(&corners);
            assert!((found - 11.0).abs() < 1e-8, "start {start}: {found}");
            assert_eq!(triangles.len(), 10);
        }
    }

    #[test]
    fn a_polygon_of_very_many_corners_has_no_hub_and_keeps_its_area() {
        let count = 100_000;
        let corner = |i: usize| {
            let (sin, cos) = (std::f64::consts::TAU * i as f64 / count as f64).sin_cos();
            DVec3::new(cos + 3.0, sin - 2.0, 7.0)
        };
        let corners: Vec<DVec3> = (0..count).map(corner).collect();
        let (found, triangles) = area(&corners);
        assert!((found - std::f64::consts::PI).abs() < 1e-8, "{found}");
        assert_eq!(triangles.len(), count - 2);
        let mut valence = vec![0; count];
        triangles.iter().flatten().for_each(|&i| valence[i] += 1);
        assert!(valence.iter().all(|n| (1..=40).contains(n)), "{:?}", valence.iter().max());
        // Each side of the polygon belongs to one triangle, and all other edges to two, in opposite directions.
        let mut sides = std::collections::HashMap::new();
        for [a, b, c] in triangles {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                assert!(sides.insert((from, to), ()).is_none(), "{from} {to} twice");
            }
        }
        let open: Vec<_> = sides.keys().filter(|(a, b)| !sides.contains_key(&(*b, *a))).collect();
        assert!(open.len() == count && open.iter().all(|(a, b)| (a + 1) % count == *b));
    }

    #[test]
    fn hopeless_polygons_still_give_all_triangles() {
        let line: Vec<DVec3> = (0..6).map(|i| DVec3::X * f64::from(i)).collect();
        let bow = [(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)].map(|(x, y)| DVec3::new(x, y, 0.0));
        for corners in [&line[..], &bow, &[DVec3::ZERO; 5]] {
            let mut triangles = Vec::new();
            triangulate(corners, &mut triangles);
            assert_eq!(triangles.len(), corners.len() - 2);
        }
    }
}
