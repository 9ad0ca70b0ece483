//! Simple shapes with known volumes.

use super::{built, open_grid};
use crate::Mesh;
use glam::{DVec3, Vec2, dvec3};
use std::f64::consts::TAU;

/// A box about the origin, 12 triangles on 8 vertices; `size` in metres along each axis.
pub fn cuboid(size: DVec3) -> Mesh {
    let corner = |i: u32| {
        let sign = |bit: u32| if i >> bit & 1 == 0 { -0.5 } else { 0.5 };
        size * dvec3(sign(0), sign(1), sign(2))
    };
    let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    built(&(0..8).map(corner).collect::<Vec<_>>(), triangles)
}

/// A cube of 1 m about the origin, with the whole texture on each side, upright on those around the y axis.
pub fn cube() -> Mesh {
    let sides = [
        (DVec3::X, DVec3::NEG_Z, DVec3::Y),
        (DVec3::NEG_X, DVec3::Z, DVec3::Y),
        (DVec3::Z, DVec3::X, DVec3::Y),
        (DVec3::NEG_Z, DVec3::NEG_X, DVec3::Y),
        (DVec3::Y, DVec3::X, DVec3::NEG_Z),
        (DVec3::NEG_Y, DVec3::X, DVec3::Z),
    ];
    Mesh { normals: Vec::new(), ..cube_of(&sides) }
}

/// A cube of 1 m about the origin, with the whole texture on each side; vertices are duplicated along the edges.
///
/// - `sides`: the normal of each, outwards, and the directions in which u and v grow.
pub fn cube_of(sides: &[(DVec3, DVec3, DVec3); 6]) -> Mesh {
    let (mut positions, mut normals, mut uvs, mut triangles) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for &(normal, along_u, along_v) in sides {
        let first = positions.len() as u32;
        for [u, v] in [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]] {
            positions.push(0.5 * normal + (u - 0.5) * along_u + (v - 0.5) * along_v);
            normals.push(normal.as_vec3());
            uvs.push(Vec2::new(u as f32, v as f32));
        }
        // Counter-clockwise seen from outside, whatever the handedness of the texture.
        let is_right = along_u.cross(along_v).dot(normal) > 0.0;
        for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
            triangles.push(if is_right {
                [first + a, first + b, first + c]
            } else {
                [first + a, first + c, first + b]
            });
        }
    }
    Mesh { normals, uvs, ..built(&positions, triangles) }
}

/// A torus about the y axis of `nu` segments around the axis and `nv` around the tube, each at least 3.
///
/// Texture coordinates run 0..1 around both; vertices are duplicated at the seams.
///
/// # Panics
/// If there are fewer than 3 segments around either.
pub fn torus(radius: f64, tube_radius: f64, nu: u32, nv: u32) -> Mesh {
    assert!(nu >= 3 && nv >= 3, "a torus needs 3 segments each way, not {nu} and {nv}");
    let mut positions = Vec::new();
    let mut uvs = Vec::new();
    for i in 0..=nu {
        for j in 0..=nv {
            // The seam must close exactly: the last row repeats the first bit for bit.
            let (phi, theta) = (TAU * f64::from(i % nu) / f64::from(nu), TAU * f64::from(j % nv) / f64::from(nv));
            let ring = radius + tube_radius * theta.cos();
            positions.push(dvec3(ring * phi.sin(), tube_radius * theta.sin(), ring * phi.cos()));
            uvs.push(Vec2::new(i as f32 / nu as f32, j as f32 / nv as f32));
        }
    }
    Mesh { uvs, ..built(&positions, open_grid(nu, nv)) }
}

/// A square block (2 × 2, 1 high) with a round hole of diameter 1 along the y axis, as exported by CAD programs: long
/// needles along the bore, fans of thin triangles on the faces.
///
/// - `segments`: of the hole, a multiple of 4.
///
/// # Panics
/// If `segments` is 0 or not a multiple of 4.
pub fn bored_block(segments: u32) -> Mesh {
    assert!(segments >= 4 && segments.is_multiple_of(4), "segments must be a multiple of 4, not {segments}");
    let corners = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)];
    let mut positions = Vec::new();
    for y in [-0.5, 0.5] {
        positions.extend(corners.map(|(x, z)| dvec3(x, y, z)));
        positions.extend((0..segments).map(|i| {
            let (sin, cos) = (TAU * f64::from(i) / f64::from(segments)).sin_cos();
            dvec3(0.5 * cos, y, 0.5 * sin)
        }));
    }
    let level = 4 + segments;
    let rim = |i: u32| 4 + i % segments;
    let quarter = segments / 4;
    let mut triangles = Vec::new();
    for q in 0..4 {
        // Corner q is connected to the arc of the quarter around it; two corners meet in one triangle at the arc's end.
        for i in q * quarter..(q + 1) * quarter {
            triangles.push([q, rim(i), rim(i + 1)]);
            triangles.push([level + q, level + rim(i + 1), level + rim(i)]);
        }
        let (next, end) = ((q + 1) % 4, rim((q + 1) * quarter));
        triangles.push([q, end, next]);
        triangles.push([level + q, level + next, level + end]);
        triangles.extend([[q, next, level + next], [q, level + next, level + q]]);
    }
    for i in 0..segments {
        let (a, b) = (rim(i), rim(i + 1));
        triangles.extend([[b, a, level + a], [b, level + a, level + b]]);
    }
    // The triangles above are oriented as seen from inside.
    triangles.iter_mut().for_each(|t| t.swap(1, 2));
    built(&positions, triangles)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Topology;
    use std::f64::consts::PI;

    #[test]
    fn shapes_are_closed_and_have_the_volumes_of_the_formulas() {
        let cases = [
            ("cuboid", cuboid(dvec3(1.0, 2.0, 3.0)), 6.0, 1e-6, 0),
            ("cube", cube(), 1.0, 1e-6, 0),
            ("torus", torus(2.0, 0.5, 300, 100), 2.0 * PI * PI * 2.0 * 0.25, 2e-3, 1),
            ("bored block", bored_block(256), 4.0 - PI / 4.0, 1e-3, 1),
        ];
        for (name, mesh, volume, tolerance, genus) in cases {
            let topology = Topology::of(&mesh);
            assert!(topology.is_closed() && topology.is_manifold(), "{name}: {topology:?}");
            assert_eq!((topology.genus(), topology.degenerate_triangles), (genus, 0), "{name}");
            let relative = mesh.signed_volume() / volume - 1.0;
            assert!(relative.abs() < tolerance, "{name}: {} against {volume}", mesh.signed_volume());
        }
    }

    #[test]
    fn an_image_lies_upright_and_not_mirrored_on_each_side_of_a_cube() {
        let cube = cube();
        for corners in &cube.triangles {
            let [a, b, c] = corners.map(|vertex| cube.positions[vertex as usize]);
            let uv = corners.map(|vertex| cube.uvs[vertex as usize]);
            assert_eq!((uv[1] - uv[0]).perp_dot(uv[2] - uv[0]), 1.0, "half of the image, as seen from outside");
            let is_around = (b - a).cross(c - a).y == 0.0;
            for (corner, uv) in [a, b, c].into_iter().zip(uv).filter(|_| is_around) {
                assert_eq!(uv.y, corner.y + 0.5);
            }
        }
    }
}
