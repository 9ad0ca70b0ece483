//! Loop subdivision surfaces: each triangle becomes four, and vertices move to weighted means of their neighbours.
//!
//! Source: Loop 1987, with the weights of Warren for the interior and Hoppe et al. 1994 for the boundary. Vertices end
//! at their limit positions.

use crate::model::assemble::Indexed;
use crate::pbrt::params::Params;
use firstlight_files::limits::Limits;
use glam::DVec3;
use std::f64::consts::TAU;

/// Triangles that a surface may have after subdivision; three levels are always made.
const MAX_TRIANGLES: usize = 1 << 18;
const MAX_FACTOR: usize = 1 << (2 * 3);

/// Vertices and triangles between two steps.
struct Surface {
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
}

/// The neighbours of a vertex.
#[derive(Clone, Debug, Default)]
struct Ring {
    /// In order round the vertex; those at a boundary begin and end there.
    vertices: Vec<u32>,
    is_boundary: bool,
}

/// The subdivided surface of `loopsubdiv`.
///
/// - `most_triangles`: that there is room for.
pub(crate) fn subdivided(params: &Params, most_triangles: usize) -> Result<Indexed, String> {
    let positions = params.points("P");
    let indices = params.indices("indices");
    let (triangles, rest) = indices.as_chunks::<3>();
    if positions.is_empty() || triangles.is_empty() || !rest.is_empty() {
        return Err("it needs vertices `P` and `indices` in groups of 3".to_owned());
    }
    if let Some(index) = indices.iter().find(|&&index| index as usize >= positions.len()) {
        return Err(format!("it uses vertex {index}, counted from 0, of {}", positions.len()));
    }
    let is_triangle = |&[a, b, c]: &[u32; 3]| a != b && b != c && c != a;
    let mut surface = Surface { positions, triangles: triangles.iter().copied().filter(is_triangle).collect() };
    if surface.triangles.is_empty() {
        return Err("each of its triangles has one vertex twice".to_owned());
    }
    let most = MAX_TRIANGLES.max(surface.triangles.len().saturating_mul(MAX_FACTOR));
    // Version 2 says `nlevels`, which version 3 reads too.
    let levels = params.count("levels").or_else(|| params.count("nlevels"));
    for _ in 0..levels.unwrap_or(3) {
        // What is finer than this looks the same.
        if surface.triangles.len() > most / 4 {
            break;
        }
        if surface.triangles.len() > most_triangles / 4 {
            return Err(format!("it has too many triangles when subdivided: {}", Limits::advice()));
        }
        surface = surface.refined()?;
    }
    let rings = surface.rings()?;
    let limits: Vec<DVec3> = surface.positions.iter().zip(&rings).map(|(at, ring)| surface.limit(*at, ring)).collect();
    let normals = rings.iter().map(|ring| normal(&limits, ring).as_vec3()).collect();
    Ok(Indexed { positions: limits, normals, triangles: surface.triangles, ..Indexed::default() })
}

/// The weight of each neighbour of a vertex inside of the surface (Warren).
fn weight(valence: usize) -> f64 {
    if valence == 3 { 3.0 / 16.0 } else { 3.0 / (8.0 * valence as f64) }
}

impl Surface {
    /// The neighbours of each vertex, in the orientation of the triangles.
    fn rings(&self) -> Result<Vec<Ring>, String> {
        // Per corner of a triangle: its vertex, and the two others in order.
        let corners = |&[a, b, c]: &[u32; 3]| [[a, b, c], [b, c, a], [c, a, b]];
        let mut steps: Vec<[u32; 3]> = self.triangles.iter().flat_map(corners).collect();
        steps.sort_unstable();
        if steps.windows(2).any(|pair| pair[0][..2] == pair[1][..2]) {
            return Err("more than two of its triangles share an edge, or they face opposite ways".to_owned());
        }
        let mut rest = &steps[..];
        let ring = |vertex: u32| {
            let (own, others) = rest.split_at(rest.partition_point(|step| step[0] == vertex));
            rest = others;
            let mut targets: Vec<u32> = own.iter().map(|step| step[2]).collect();
            targets.sort_unstable();
            // Where a boundary begins, no triangle leads.
            let start = own.iter().map(|step| step[1]).find(|from| targets.binary_search(from).is_err());
            let mut ring = Ring { vertices: Vec::new(), is_boundary: start.is_some() };
            let Some(first) = start.or(own.first().map(|step| step[1])) else { return ring };
            let mut at = first;
            loop {
                ring.vertices.push(at);
                match own.binary_search_by_key(&at, |step| step[1]) {
                    Ok(i) if own[i][2] != first && ring.vertices.len() <= own.len() => at = own[i][2],
                    _ => return ring,
                }
            }
        };
        Ok((0..self.positions.len() as u32).map(ring).collect())
    }

    fn sum(&self, vertices: &[u32]) -> DVec3 {
        vertices.iter().map(|&vertex| self.positions[vertex as usize]).sum()
    }

    /// The ends of a boundary at a vertex.
    fn ends(&self, ring: &Ring) -> DVec3 {
        match ring.vertices[..] {
            [first, .., last] => self.sum(&[first, last]),
            _ => DVec3::ZERO,
        }
    }

    fn moved(&self, at: DVec3, ring: &Ring) -> DVec3 {
        match ring.vertices.len() {
            0 | 1 => at,
            _ if ring.is_boundary => 0.75 * at + 0.125 * self.ends(ring),
            valence => {
                let weight = weight(valence);
                (1.0 - valence as f64 * weight) * at + weight * self.sum(&ring.vertices)
            }
        }
    }

    /// Where a vertex ends after infinitely many steps.
    fn limit(&self, at: DVec3, ring: &Ring) -> DVec3 {
        match ring.vertices.len() {
            0 | 1 => at,
            _ if ring.is_boundary => 0.6 * at + 0.2 * self.ends(ring),
            valence => {
                let weight = 1.0 / (valence as f64 + 3.0 / (8.0 * self::weight(valence)));
                (1.0 - valence as f64 * weight) * at + weight * self.sum(&ring.vertices)
            }
        }
    }

    /// One step.
    fn refined(&self) -> Result<Self, String> {
        let rings = self.rings()?;
        let mut positions: Vec<DVec3> =
            self.positions.iter().zip(&rings).map(|(at, ring)| self.moved(*at, ring)).collect();
        // Each edge, with its ends in ascending order, and the vertex across it in each of its triangles.
        let edge = |a: u32, b: u32| [a.min(b), a.max(b)];
        let sides = |&[a, b, c]: &[u32; 3]| [(edge(a, b), c), (edge(b, c), a), (edge(c, a), b)];
        let mut sides: Vec<([u32; 2], u32)> = self.triangles.iter().flat_map(sides).collect();
        sides.sort_unstable();
        let edges: Vec<[u32; 2]> = sides.chunk_by(|a, b| a.0 == b.0).map(|group| group[0].0).collect();
        let first = positions.len();
        positions.extend(sides.chunk_by(|a, b| a.0 == b.0).map(|group| {
            let ends = self.sum(&group[0].0);
            match group {
                [(_, a), (_, b)] => 0.375 * ends + 0.125 * self.sum(&[*a, *b]),
                _ => 0.5 * ends,
            }
        }));
        let middle = |a: u32, b: u32| {
            let rank = edges.binary_search(&edge(a, b)).expect("each edge of a triangle is listed");
            (first + rank) as u32
        };
        let mut triangles = Vec::with_capacity(4 * self.triangles.len());
        for &[a, b, c] in &self.triangles {
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        Ok(Self { positions, triangles })
    }
}

/// The normal at a vertex, from the tangents of the limit surface (Hoppe et al. 1994).
fn normal(positions: &[DVec3], ring: &Ring) -> DVec3 {
    let n = ring.vertices.len();
    let weighted = |weight: &dyn Fn(f64) -> f64| -> DVec3 {
        let at = |(i, vertex): (usize, &u32)| weight(TAU * i as f64 / n as f64) * positions[*vertex as usize];
        ring.vertices.iter().enumerate().map(at).sum()
    };
    if ring.is_boundary {
        // Computed from the triangles instead.
        return DVec3::ZERO;
    }
    weighted(&f64::cos).cross(weighted(&f64::sin)).normalize_or_zero()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pbrt::params::{Param, Values};

    fn surface(levels: f64) -> Indexed {
        // An octahedron, whose limit is round and keeps its symmetry.
        let p = [1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, -1.0];
        let faces: [[u32; 3]; 8] =
            [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
        let param = |kind: &str, name: &str, numbers: Vec<f64>| Param {
            kind: kind.to_owned(),
            name: name.to_owned(),
            values: Values::Numbers(numbers),
        };
        let indices = faces.iter().flatten().map(|&index| f64::from(index)).collect();
        let list = vec![
            param("point3", "P", p.to_vec()),
            param("integer", "indices", indices),
            param("integer", "levels", vec![levels]),
        ];
        subdivided(&Params::new(list), usize::MAX).unwrap()
    }

    #[test]
    fn a_corner_goes_to_its_limit_at_once_and_stays_there() {
        // Valence 4: the weight is 3/32, that of the limit 1 / (4 + 4); the neighbours of a corner add up to zero.
        let expected = 0.5;
        for levels in [0.0, 1.0, 4.0] {
            let surface = surface(levels);
            assert!((surface.positions[0] - DVec3::new(expected, 0.0, 0.0)).length() < 1e-12, "{levels}");
            assert_eq!(surface.triangles.len(), 8 << (2 * levels as u32));
            let outwards = |(at, normal): (&DVec3, &glam::Vec3)| at.dot(normal.as_dvec3()) > 0.0;
            assert!(surface.positions.iter().zip(&surface.normals).all(outwards));
        }
    }

    #[test]
    fn a_flat_sheet_stays_flat_and_its_straight_edges_straight() {
        let param = |name: &str, numbers: &[f64]| Param {
            kind: "float".to_owned(),
            name: name.to_owned(),
            values: Values::Numbers(numbers.to_vec()),
        };
        let list = vec![
            param("P", &[0.0, 0.0, 2.0, 2.0, 0.0, 2.0, 2.0, 2.0, 2.0, 0.0, 2.0, 2.0, 1.0, 1.0, 2.0]),
            param("indices", &[0.0, 1.0, 4.0, 1.0, 2.0, 4.0, 2.0, 3.0, 4.0, 3.0, 0.0, 4.0]),
        ];
        let sheet = subdivided(&Params::new(list), usize::MAX).unwrap();
        assert!(sheet.positions.iter().all(|at| (at.z - 2.0).abs() < 1e-12 && at.min_element() >= -1e-12));
        assert!((sheet.positions[4] - DVec3::new(1.0, 1.0, 2.0)).length() < 1e-12);
    }
}
