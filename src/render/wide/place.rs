//! From sixteen hits to what shading needs to know of the places; see [`super::super::surface::Vertex`].

use super::super::Snapshot;
use super::super::paths::PathBatch;
use super::super::surface::Vertex;
use super::tables::{BALL, FLAT, SurfaceTable};
use crate::geometry::robust::UNIT_ROUNDOFF;
use crate::kdtree::HitBatch;
use crate::lanes::{Bits, Float, LANES, Mask, Simd, Vector, select, select_vector};
use glam::Vec3;

/// Points on surfaces, each seen along a ray.
#[derive(Clone, Copy)]
pub(super) struct Place<S: Simd> {
    pub position: Vector<S>,
    /// On the side that the ray came from.
    pub geometric_normal: Vector<S>,
    pub normal: Vector<S>,
    /// What decides whether light can meet the side of `wo`.
    pub reach_normal: Vector<S>,
    /// Where rays to the side of `wo` start, before the offset.
    pub lifted: Vector<S>,
    /// Metres along the geometric normal that keep a ray from meeting its own surface.
    pub offset: Float<S>,
    pub front: Mask,
    pub wo: Vector<S>,
    pub uv: [Float<S>; 2],
}

/// Which hits, and of which materials.
pub(super) struct At<'a, S: Simd> {
    pub scene: &'a Snapshot,
    pub paths: &'a PathBatch,
    pub hits: &'a HitBatch,
    pub materials: &'a [u32],
    /// Indices into them all; only the lanes of `mask` count.
    pub index: Bits<S>,
    pub indices: &'a [u32; LANES],
    pub mask: Mask,
}

/// Between `least` and as far from 1.
#[inline(always)]
fn away_from_rim<S: Simd>(at: Float<S>, least: Float<S>) -> Float<S> {
    at.max(least).min(at.all(1.0) - least)
}

impl<S: Simd> Place<S> {
    #[inline(always)]
    pub fn new(s: S, at: &At<S>) -> Self {
        let (rays, hits, table) = (&at.paths.rays, at.hits, &at.scene.geometry.surfaces);
        let dir = Vector {
            x: Float::gather(&rays.dir_x, at.index),
            y: Float::gather(&rays.dir_y, at.index),
            z: Float::gather(&rays.dir_z, at.index),
        };
        let wo = -dir;
        let object = Bits::gather(&hits.object, at.index);
        let kind = Bits::gather(&table.kind, object);
        let (flat, mut ball) = (kind.equals(FLAT) & at.mask, kind.equals(BALL) & at.mask);
        let mut other = at.mask & !flat & !ball;
        if at.scene.shading.features.textures {
            let material = Bits::gather(at.materials, at.index);
            let textured = Bits::gather(&at.scene.shading.material_table.flags, material).has(super::tables::TEXTURED);
            other |= ball & textured;
            ball &= !textured;
        }
        let zero = Float::splat(s, 0.0);
        let nowhere = Vector { x: zero, y: zero, z: zero };
        let mut place = Self {
            position: nowhere,
            geometric_normal: nowhere,
            normal: nowhere,
            reach_normal: nowhere,
            lifted: nowhere,
            offset: zero,
            front: 0,
            wo,
            uv: [zero, zero],
        };
        if flat != 0 {
            place.set_flat(table, object, [Float::gather(&hits.u, at.index), Float::gather(&hits.v, at.index)]);
        }
        if ball != 0 {
            place.set_balls(s, at, table, object, dir, ball);
        }
        place.front = Float::splat(s, 0.0).le(wo.dot(place.geometric_normal));
        place.geometric_normal = select_vector(place.front, place.geometric_normal, -place.geometric_normal);
        place.normal = place.geometric_normal;
        place.reach_normal = place.geometric_normal;
        place.lifted = place.position;
        if other != 0 {
            place.set_others(s, at, other);
        }
        place
    }

    #[inline(always)]
    fn set_flat(&mut self, table: &SurfaceTable, object: Bits<S>, [u, v]: [Float<S>; 2]) {
        let (a, b) = (Vector::gather(&table.a, object), Vector::gather(&table.b, object));
        let c = Vector::gather(&table.c, object);
        let least = [Float::gather(&table.least[0], object), Float::gather(&table.least[1], object)];
        self.position = a + b * away_from_rim(u, least[0]) + c * away_from_rim(v, least[1]);
        self.geometric_normal = Vector::gather(&table.normal, object);
        self.offset = Float::gather(&table.offset, object);
        self.uv = [u, v];
    }

    /// In `f64`, as for one ball.
    #[inline(always)]
    fn set_balls(&mut self, s: S, at: &At<S>, table: &SurfaceTable, object: Bits<S>, dir: Vector<S>, mask: Mask) {
        let rays = &at.paths.rays;
        let center = Vector::gather(&table.a, object);
        let radius = s.widen(Float::gather(&table.offset, object).v);
        let t = s.widen(Float::gather(&at.hits.t, at.index).v);
        let origin = [&rays.origin_x, &rays.origin_y, &rays.origin_z];
        let (ox, oy) = (Float::gather(origin[0], at.index), Float::gather(origin[1], at.index));
        let oz = Float::gather(origin[2], at.index);
        let (x, cx) = outwards(s, ox, t, dir.x, center.x);
        let (y, cy) = outwards(s, oy, t, dir.y, center.y);
        let (z, cz) = outwards(s, oz, t, dir.z, center.z);
        let squared = s.add_d(s.add_d(s.mul_d(x, x), s.mul_d(y, y)), s.mul_d(z, z));
        let inverse = s.div_d(s.splat_d(1.0), s.sqrt_d(squared));
        let (x, y, z) = (s.mul_d(x, inverse), s.mul_d(y, inverse), s.mul_d(z, inverse));
        let position = Vector {
            x: Float { s, v: s.narrow(s.add_d(cx, s.mul_d(radius, x))) },
            y: Float { s, v: s.narrow(s.add_d(cy, s.mul_d(radius, y))) },
            z: Float { s, v: s.narrow(s.add_d(cz, s.mul_d(radius, z))) },
        };
        let normal =
            Vector { x: Float { s, v: s.narrow(x) }, y: Float { s, v: s.narrow(y) }, z: Float { s, v: s.narrow(z) } };
        let (n, error) = (normal.abs(), Float::gather(&table.least[0], object));
        let offset = n.dot(position.abs().mul_all(2.0 * UNIT_ROUNDOFF)) + (n.x + n.y + n.z) * error;
        self.position = select_vector(mask, position, self.position);
        self.geometric_normal = select_vector(mask, normal, self.geometric_normal);
        self.offset = select(mask, offset, self.offset);
    }

    /// Meshes, clouds of balls and planes, one at a time.
    #[inline(always)]
    fn set_others(&mut self, s: S, at: &At<S>, mask: Mask) {
        let mut vectors = [
            self.position.to_arrays(),
            self.geometric_normal.to_arrays(),
            self.normal.to_arrays(),
            self.reach_normal.to_arrays(),
            self.lifted.to_arrays(),
        ];
        let mut scalars = [self.offset.to_array(), self.uv[0].to_array(), self.uv[1].to_array()];
        self.front &= !mask;
        for (lane, &i) in at.indices.iter().enumerate() {
            if mask >> lane & 1 == 0 {
                continue;
            }
            let vertex = vertex_at(at.scene, at.paths, at.hits, at.materials, i as usize);
            let reach = if vertex.lift == Vec3::ZERO { vertex.geometric_normal } else { vertex.normal };
            let values =
                [vertex.position, vertex.geometric_normal, vertex.normal, reach, vertex.position + vertex.lift];
            for (arrays, value) in vectors.iter_mut().zip(values) {
                (arrays[0][lane], arrays[1][lane], arrays[2][lane]) = (value.x, value.y, value.z);
            }
            scalars[0][lane] = vertex.geometric_normal.abs().dot(vertex.error);
            (scalars[1][lane], scalars[2][lane]) = (vertex.uv.x, vertex.uv.y);
            self.front |= Mask::from(vertex.front) << lane;
        }
        let [position, geometric_normal, normal, reach_normal, lifted] = &vectors;
        self.position = Vector::from_arrays(s, position);
        self.geometric_normal = Vector::from_arrays(s, geometric_normal);
        self.normal = Vector::from_arrays(s, normal);
        self.reach_normal = Vector::from_arrays(s, reach_normal);
        self.lifted = Vector::from_arrays(s, lifted);
        self.offset = Float::load(s, &scalars[0]);
        self.uv = [Float::load(s, &scalars[1]), Float::load(s, &scalars[2])];
    }

    /// Where a ray starts that stays on the side of `wo`.
    #[inline(always)]
    pub fn leaving(&self) -> Vector<S> {
        offset_origin(self.lifted, self.offset, self.geometric_normal)
    }

    /// Where a ray starts that goes to the far side.
    #[inline(always)]
    pub fn passing(&self) -> Vector<S> {
        offset_origin(self.position, self.offset, -self.geometric_normal)
    }
}

/// One coordinate of a hit as seen from the centre, and of the centre.
#[inline(always)]
fn outwards<S: Simd>(s: S, origin: Float<S>, t: S::D, dir: Float<S>, center: Float<S>) -> (S::D, S::D) {
    let center = s.widen(center.v);
    let near = s.add_d(s.widen(origin.v), s.mul_d(t, s.widen(dir.v)));
    (s.sub_d(near, center), center)
}

#[inline(never)]
fn vertex_at(scene: &Snapshot, paths: &PathBatch, hits: &HitBatch, materials: &[u32], i: usize) -> Vertex {
    let hit = hits.get(i).expect("a hit is being shaded");
    Vertex::new(scene, &paths.rays.get(i), &hit, materials[i])
}

/// See [`crate::geometry::robust::offset_ray_origin`]; `distance` metres along `normal`.
#[inline(always)]
pub(in crate::render) fn offset_origin<S: Simd>(point: Vector<S>, distance: Float<S>, normal: Vector<S>) -> Vector<S> {
    let offset = normal * distance;
    let sum = point + offset;
    Vector { x: rounded_away(sum.x, offset.x), y: rounded_away(sum.y, offset.y), z: rounded_away(sum.z, offset.z) }
}

#[inline(always)]
fn rounded_away<S: Simd>(sum: Float<S>, offset: Float<S>) -> Float<S> {
    let away = sum + (sum.abs() * (2.0 * UNIT_ROUNDOFF)).copysign(offset);
    select(offset.is_zero(), sum, away)
}
