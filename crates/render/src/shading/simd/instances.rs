//! Hits on meshes and groups of spheres, which have their own spaces, sixteen at a time.
//!
//! The formulas are those of `kdtree/surface.rs` and [`crate::shading::vertex::Vertex`], operation by operation, and
//! are explained there. Data per object comes from an [`InstanceTable`], data per triangle or sphere is loaded lane by
//! lane.

use crate::prepare::instance_table::{Columns, InstanceTable};
use crate::shading::simd::lanes::lanes_of;
use crate::shading::simd::surface::{HitGroup, SurfaceLanes, ball_points};
use crate::shading::vertex::lift_of;
use firstlight_kdtree::geometry::robust::{UNIT_ROUNDOFF, gamma};
use firstlight_kdtree::{F64_ERROR, INSET, Shape};
use firstlight_simd::{Bits, Float, LANES, Mask, Real, Simd, Vector, select, select_vector, three, two};
use glam::Vec3;

/// Multiplies by a matrix per lane.
#[inline(always)]
pub(crate) fn times<S: Simd>(columns: &Columns, row: Bits<S>, v: Vector<S>) -> Vector<S> {
    let [x, y, z] = three!(|k| Vector::gather(&columns[k], row));
    x * v.x + y * v.y + z * v.z
}

/// Like [`times`], with the absolute values of the matrix.
#[inline(always)]
fn times_abs<S: Simd>(columns: &Columns, row: Bits<S>, v: Vector<S>) -> Vector<S> {
    let [x, y, z] = three!(|k| Vector::gather(&columns[k], row).abs());
    x * v.x + y * v.y + z * v.z
}

/// Points in the spaces in which their objects are tested.
struct LocalPoints<S: Simd> {
    position: Vector<S>,
    error: Vector<S>,
    normal: Vector<S>,
}

/// Vertices of triangles, in the spaces of their objects.
pub(crate) struct Corners<S: Simd> {
    /// Lanes whose mesh has vertex normals.
    smooth: Mask,
    pub positions: [Vector<S>; 3],
    normals: [[[f32; LANES]; 3]; 3],
    /// Barycentric weights.
    pub weights: [Float<S>; 3],
    /// Texture coordinates.
    pub uvs: [[Float<S>; 2]; 3],
}

#[inline(always)]
pub(crate) fn set_lane(arrays: &mut [[f32; LANES]; 3], lane: usize, v: Vec3) {
    (arrays[0][lane], arrays[1][lane], arrays[2][lane]) = (v.x, v.y, v.z);
}

impl<S: Simd> SurfaceLanes<S> {
    /// Sets points on meshes, with the faces' normals; returns the lanes that are so close to an edge that they need
    /// the scalar code.
    ///
    /// - `row`: rows of the objects in the [`InstanceTable`].
    #[inline(always)]
    pub(crate) fn set_meshes(&mut self, s: S, at: &HitGroup<S>, row: Bits<S>, mask: Mask) -> (Corners<S>, Mask) {
        let geometry = &*at.scene.geometry;
        let table = &at.scene.surfaces.instances;
        let mut corners = [[[0.0; LANES]; 3]; 3];
        let mut normals = [[[0.0; LANES]; 3]; 3];
        let mut uvs = [[[0.0; LANES]; 2]; 3];
        let (mut smooth, mut with_uvs) = (0, 0);
        for lane in lanes_of(mask) {
            let i = at.indices[lane] as usize;
            let object = &geometry.objects[at.hits.object[i] as usize];
            let mesh = object.mesh.as_ref().expect("a mesh shape has a mesh");
            let triangle = mesh.triangles[at.hits.prim[i] as usize].map(|vertex| vertex as usize);
            for (k, &vertex) in triangle.iter().enumerate() {
                set_lane(&mut corners[k], lane, mesh.positions[vertex]);
            }
            if !mesh.normals.is_empty() {
                smooth |= 1 << lane;
                for (k, &vertex) in triangle.iter().enumerate() {
                    set_lane(&mut normals[k], lane, mesh.normals[vertex]);
                }
            }
            if !mesh.uvs.is_empty() {
                with_uvs |= 1 << lane;
                for (k, &vertex) in triangle.iter().enumerate() {
                    let uv = mesh.uvs[vertex];
                    (uvs[k][0][lane], uvs[k][1][lane]) = (uv.x, uv.y);
                }
            }
        }
        let positions = three!(|k| Vector::from_arrays(s, &corners[k]));
        let side = Float::gather(&table.side, row);
        let placed = mask & !side.is_zero();
        let mut tested = positions;
        if placed != 0 {
            let offset = Vector::gather(&table.world_offset, row);
            let in_world = three!(|k| times(&table.world_from_object, row, positions[k]) + offset);
            tested = three!(|k| select_vector(placed, in_world[k], positions[k]));
        }
        let [a, b, c] = tested;
        let (u, v) = (Float::gather(&at.hits.u, at.index), Float::gather(&at.hits.v, at.index));
        let w = u.all(1.0) - u - v;
        let condition = Float::gather(&table.condition, row);
        let position = a * w + b * u + c * v;
        let size = a.abs() * w.abs() + b.abs() * u + c.abs() * v;
        let reach = (a - position).abs().max((b - position).abs()).max((c - position).abs()).max_element();
        let slab = (condition * 4.0 + 16.0) * UNIT_ROUNDOFF * reach;
        let error = size.mul_all(gamma(7)) + Vector { x: slab, y: slab, z: slab };
        let (cross, doubled_area) = wide_cross(s, b - a, c - a);
        let longest = (b - a).abs().max((c - a).abs()).max_element() * 4.0;
        let inset = (error.max_element() + Float::gather(&table.rim, row)) * INSET;
        let near_rim = mask & (u.min(v).min(w) * doubled_area).lt(inset * longest);
        if placed != mask {
            self.carry_to_world(table, row, mask & !placed, LocalPoints { position, error, normal: cross });
        }
        if placed != 0 {
            let normal = cross.normalize() * side;
            self.position = select_vector(placed, position, self.position);
            self.geometric_normal = select_vector(placed, normal, self.geometric_normal);
            self.offset = select(placed, normal.abs().dot(error), self.offset);
        }
        let (zero, one) = (u.all(0.0), u.all(1.0));
        let (mut uv, mut corner_uvs) = ([u, v], [[zero, zero], [one, zero], [zero, one]]);
        if with_uvs != 0 {
            for (to, from) in corner_uvs.as_flattened_mut().iter_mut().zip(uvs.as_flattened()) {
                *to = select(with_uvs, Float::load(s, from), *to);
            }
            uv = two!(|k| {
                let [a, b, c] = three!(|corner| corner_uvs[corner][k]);
                select(with_uvs, a * w + b * u + c * v, uv[k])
            });
        }
        self.uv = two!(|k| select(mask, uv[k], self.uv[k]));
        (Corners { smooth, positions, normals, weights: [w, u, v], uvs: corner_uvs }, near_rim)
    }

    /// Sets normals and lift for meshes with vertex normals, once the sides of the faces are known.
    #[inline(always)]
    pub(crate) fn smooth_meshes(&mut self, s: S, at: &HitGroup<S>, row: Bits<S>, corners: &Corners<S>) {
        if corners.smooth == 0 {
            return;
        }
        let table = &at.scene.surfaces.instances;
        let normals = three!(|k| Vector::from_arrays(s, &corners.normals[k]));
        let weights = corners.weights;
        let object = normals[0] * weights[0] + normals[1] * weights[1] + normals[2] * weights[2];
        // A normal of length zero is replaced by that of the face, on the front.
        let front = select_vector(self.front, self.geometric_normal, -self.geometric_normal);
        let smooth = times(&table.cofactors, row, object).normalize_or(front);
        let turned = smooth.dot(self.geometric_normal).is_negative();
        let facing = select_vector(turned, -smooth, smooth);
        let seen = facing.dot(self.wo).is_positive();
        let normal = select_vector(seen, facing, self.geometric_normal);
        self.interpolated = select_vector(corners.smooth, facing, self.interpolated);
        let towards = three!(|k| select_vector(turned, -normals[k], normals[k]));
        let lift = times(&table.world_from_object, row, lift_of(&corners.positions, &towards, &weights));
        let lifted = corners.smooth & !lift.is_zero();
        self.normal = select_vector(corners.smooth, normal, self.normal);
        self.reach_normal = select_vector(lifted, normal, self.reach_normal);
        self.lifted = select_vector(lifted, self.position + lift, self.lifted);
    }

    /// Sets points on groups of spheres, with outward normals.
    #[inline(always)]
    pub(crate) fn set_clouds(&mut self, s: S, at: &HitGroup<S>, row: Bits<S>, dir: Vector<S>, mask: Mask) {
        let geometry = &*at.scene.geometry;
        let table = &at.scene.surfaces.instances;
        let (mut centers, mut radii) = ([[0.0; LANES]; 3], [1.0; LANES]);
        for lane in lanes_of(mask) {
            let i = at.indices[lane] as usize;
            let Shape::Spheres { tree, .. } = &geometry.tree.shapes()[at.hits.object[i] as usize] else {
                continue;
            };
            let (center, radius) = tree.sphere(at.hits.prim[i]);
            set_lane(&mut centers, lane, center);
            radii[lane] = radius;
        }
        let (center, radius) = (Vector::from_arrays(s, &centers), Float::load(s, &radii));
        let origin = times(&table.object_from_world, row, at.ray_origin()) + Vector::gather(&table.object_offset, row);
        let dir = times(&table.object_from_world, row, dir);
        let t = Float::gather(&at.hits.t, at.index);
        let [position, normal] = ball_points(s, [origin, dir], t, center, radius);
        // All bounds except rounding have a margin of a power of two.
        let of_ball = (center.abs().max_element() + radius) * F64_ERROR as f32;
        let along = of_ball + Float::gather(&table.condition, row) * gamma(4) * radius;
        let error = position.abs().mul_all(2.0 * UNIT_ROUNDOFF) + Vector { x: along, y: along, z: along };
        self.carry_to_world(table, row, mask, LocalPoints { position, error, normal });
    }

    #[inline(always)]
    fn carry_to_world(&mut self, table: &InstanceTable, row: Bits<S>, mask: Mask, local: LocalPoints<S>) {
        let position = times(&table.world_from_object, row, local.position) + Vector::gather(&table.world_offset, row);
        let spread = local.position.abs().mul_all(gamma(4)) + local.error;
        let mapped = times_abs(&table.world_from_object, row, spread);
        let back = times(&table.round_trip, row, position.abs()) + Vector::gather(&table.round_trip_offset, row);
        let error = mapped + back.mul_all(gamma(8));
        let normal = times(&table.normal_from_object, row, local.normal).normalize();
        let offset = normal.abs().dot(error);
        self.position = select_vector(mask, position, self.position);
        self.geometric_normal = select_vector(mask, normal, self.geometric_normal);
        self.offset = select(mask, offset, self.offset);
    }
}

/// Returns the cross product scaled so that its largest component is 1, and that component; both zero for degenerate
/// triangles.
#[inline(always)]
fn wide_cross<S: Simd>(s: S, a: Vector<S>, b: Vector<S>) -> (Vector<S>, Float<S>) {
    let (ax, ay, az) = (s.widen(a.x.v), s.widen(a.y.v), s.widen(a.z.v));
    let (bx, by, bz) = (s.widen(b.x.v), s.widen(b.y.v), s.widen(b.z.v));
    let cross = [
        s.sub_d(s.mul_d(ay, bz), s.mul_d(by, az)),
        s.sub_d(s.mul_d(az, bx), s.mul_d(bz, ax)),
        s.sub_d(s.mul_d(ax, by), s.mul_d(bx, ay)),
    ];
    let largest = s.max_d(s.abs_d(cross[0]), s.max_d(s.abs_d(cross[1]), s.abs_d(cross[2])));
    let zero = Float::splat(s, 0.0);
    let flat = s.le_d(largest, s.splat_d(0.0));
    let [x, y, z] = three!(|k| Float { s, v: s.narrow(s.div_d(cross[k], largest)) });
    let scaled = select_vector(flat, Vector { x: zero, y: zero, z: zero }, Vector { x, y, z });
    (scaled, Float { s, v: s.narrow(largest) })
}
