//! From sixteen hits to surface interactions; see [`crate::shading::vertex::Vertex`].

use crate::core::texture::TexturePoint;
use crate::prepare::material_table::{BLACK_BACK, MORE_THAN_UV, TANGENTS, TEXTURED, TURNED};
use crate::prepare::prepared::Prepared;
use crate::prepare::surface_table::{BALL, CLOUD, FLAT, MESH, OTHER, PLANE, SurfaceTable};
use crate::shading::paths::PathBatch;
use crate::shading::simd::tangents::TangentLanes;
use crate::shading::tangent::Tangent;
use crate::shading::vertex::{Vertex, mesh_texture_point};
use firstlight_kdtree::geometry::robust::{UNIT_ROUNDOFF, offset_along};
use firstlight_kdtree::{F64_ERROR, HitBatch};
use firstlight_simd::{Bits, Float, Kernel, LANES, Mask, Real, Simd, Vector, select, select_vector, three, two};
use glam::{Vec2, Vec3};

/// Surface points, each seen along a ray.
#[derive(Clone, Copy)]
pub(crate) struct SurfaceLanes<S: Simd> {
    pub position: Vector<S>,
    /// Unit, on the side that the ray came from.
    pub geometric_normal: Vector<S>,
    pub normal: Vector<S>,
    /// Shading normal before it is turned by a map and towards the viewer.
    pub interpolated: Vector<S>,
    /// Determines whether light can reach the side of `wo`.
    pub reach_normal: Vector<S>,
    /// Origin of rays to the side of `wo`, before the offset.
    pub lifted: Vector<S>,
    /// Offset along the geometric normal in metres that prevents self-intersection.
    pub offset: Float<S>,
    pub front: Mask,
    pub wo: Vector<S>,
    pub uv: [Float<S>; 2],
    pub tangent: TangentLanes<S>,
}

/// A group of hits and their materials.
pub(crate) struct HitGroup<'a, S: Simd> {
    pub scene: &'a Prepared,
    pub paths: &'a PathBatch,
    pub hits: &'a HitBatch,
    pub materials: &'a [u32],
    /// Indices into the batches; only the lanes of `mask` are valid.
    pub index: Bits<S>,
    pub indices: &'a [u32; LANES],
    pub mask: Mask,
}

impl<S: Simd> HitGroup<'_, S> {
    /// Returns the vertex of hit `i` by the scalar code.
    #[inline(never)]
    pub fn vertex(&self, i: usize) -> Vertex {
        let hit = self.hits.get(i).expect("a hit is being shaded");
        Vertex::new(self.scene, &self.paths.rays.get(i), &hit, self.materials[i])
    }

    /// Returns the point of a lane for texture lookups.
    ///
    /// - `uv`: first texture coordinates of the lanes.
    #[inline]
    pub fn texture_point(&self, lane: usize, uv: &[[f32; LANES]; 2]) -> TexturePoint {
        let i = self.indices[lane] as usize;
        if self.scene.tables.materials.flags[self.materials[i] as usize] & MORE_THAN_UV != 0
            && let Some(hit) = self.hits.get(i)
            && let Some(mesh) = &self.scene.geometry.objects[hit.object as usize].mesh
        {
            return mesh_texture_point(mesh, &hit);
        }
        Vec2::new(uv[0][lane], uv[1][lane]).into()
    }

    /// Its lanes without those that hit a black back.
    #[inline(always)]
    pub fn without_black_backs(&self, place: &SurfaceLanes<S>) -> Mask {
        let table = &self.scene.tables.materials;
        if !table.has_black_backs {
            return self.mask;
        }
        let flags = Bits::gather(&table.flags, Bits::gather(self.materials, self.index));
        self.mask & (place.front | !flags.has(BLACK_BACK))
    }

    #[inline(always)]
    pub fn ray_origin(&self) -> Vector<S> {
        let rays = &self.paths.rays;
        let [x, y, z] = [&rays.origin_x, &rays.origin_y, &rays.origin_z];
        let (x, y) = (Float::gather(x, self.index), Float::gather(y, self.index));
        let z = Float::gather(z, self.index);
        Vector { x, y, z }
    }
}

/// Clamps to `least..=1 - least`.
#[inline(always)]
fn away_from_rim<S: Simd>(at: Float<S>, least: Float<S>) -> Float<S> {
    at.max(least).min(at.all(1.0) - least)
}

impl<S: Simd> Kernel<S> for &HitGroup<'_, S> {
    type Output = SurfaceLanes<S>;

    #[inline(always)]
    fn run(self, s: S) -> SurfaceLanes<S> {
        SurfaceLanes::new(s, self)
    }
}

impl<S: Simd> SurfaceLanes<S> {
    /// A large function used by all kinds of materials, which share one copy of it.
    #[inline(always)]
    pub fn of(s: S, at: &HitGroup<S>) -> Self {
        s.call(at)
    }

    #[inline(always)]
    fn new(s: S, at: &HitGroup<S>) -> Self {
        let (rays, hits, table) = (&at.paths.rays, at.hits, &at.scene.surfaces);
        let dir = Vector {
            x: Float::gather(&rays.dir_x, at.index),
            y: Float::gather(&rays.dir_y, at.index),
            z: Float::gather(&rays.dir_z, at.index),
        };
        let wo = -dir;
        let object = Bits::gather(&hits.object, at.index);
        let kind = Bits::gather(&table.kind, object);
        let (flat, plane) = (kind.equals(FLAT) & at.mask, kind.equals(PLANE) & at.mask);
        let (mesh, mut cloud) = (kind.equals(MESH) & at.mask, kind.equals(CLOUD) & at.mask);
        let mut ball = kind.equals(BALL) & at.mask;
        let mut other = kind.equals(OTHER) & at.mask;
        if at.scene.tables.features.textures && ball | cloud != 0 {
            // These need longitude and latitude.
            let material = Bits::gather(at.materials, at.index);
            let textured = Bits::gather(&at.scene.tables.materials.flags, material).has(TEXTURED);
            other |= (ball | cloud) & textured;
            ball &= !textured;
            cloud &= !textured;
        }
        let mut with_tangents = 0;
        if at.scene.tables.materials.layers.has_tangents {
            let material = Bits::gather(at.materials, at.index);
            with_tangents = at.mask & Bits::gather(&at.scene.tables.materials.flags, material).has(TANGENTS);
            other |= with_tangents & !mesh;
        }
        if at.scene.tables.materials.has_turned {
            let material = Bits::gather(at.materials, at.index);
            other |= at.mask & Bits::gather(&at.scene.tables.materials.flags, material).has(TURNED);
        }
        let zero = Float::splat(s, 0.0);
        let nowhere = Vector { x: zero, y: zero, z: zero };
        let mut place = Self {
            position: nowhere,
            geometric_normal: nowhere,
            normal: nowhere,
            interpolated: nowhere,
            reach_normal: nowhere,
            lifted: nowhere,
            offset: zero,
            front: 0,
            wo,
            uv: [zero, zero],
            tangent: TangentLanes::none(zero),
        };
        if flat != 0 {
            place.set_flat(table, object, [Float::gather(&hits.u, at.index), Float::gather(&hits.v, at.index)]);
        }
        if ball != 0 {
            place.set_balls(s, at, table, object, dir, ball);
        }
        if plane != 0 {
            place.set_planes(s, at, table, object, dir, plane);
        }
        let mut corners = None;
        let mut row = object;
        if mesh | cloud != 0 {
            row = Bits::gather(&table.row, object);
        }
        if mesh != 0 {
            let (found, near_rim) = place.set_meshes(s, at, row, mesh);
            corners = Some(found);
            other |= near_rim;
        }
        if cloud != 0 {
            place.set_clouds(s, at, row, dir, cloud);
        }
        place.front = Float::splat(s, 0.0).le(wo.dot(place.geometric_normal));
        place.geometric_normal = select_vector(place.front, place.geometric_normal, -place.geometric_normal);
        place.normal = place.geometric_normal;
        place.interpolated = place.geometric_normal;
        place.reach_normal = place.geometric_normal;
        place.lifted = place.position;
        if let Some(corners) = &corners {
            place.smooth_meshes(s, at, row, corners);
            if with_tangents != 0 {
                place.tangent = place.mesh_tangents(s, at, row, corners, mesh & with_tangents);
            }
        }
        if other != 0 {
            place.set_others(s, at, other, with_tangents);
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

    #[inline(always)]
    fn set_balls(&mut self, s: S, at: &HitGroup<S>, table: &SurfaceTable, object: Bits<S>, dir: Vector<S>, mask: Mask) {
        let (center, radius) = (Vector::gather(&table.a, object), Float::gather(&table.offset, object));
        let t = Float::gather(&at.hits.t, at.index);
        let [position, normal] = ball_points(s, [at.ray_origin(), dir], t, center, radius);
        let (n, error) = (normal.abs(), Float::gather(&table.least[0], object));
        let offset = n.dot(position.abs().mul_all(2.0 * UNIT_ROUNDOFF)) + (n.x + n.y + n.z) * error;
        self.position = select_vector(mask, position, self.position);
        self.geometric_normal = select_vector(mask, normal, self.geometric_normal);
        self.offset = select(mask, offset, self.offset);
    }

    /// In `f64`, as in the scalar code.
    #[inline(always)]
    fn set_planes(
        &mut self,
        s: S,
        at: &HitGroup<S>,
        table: &SurfaceTable,
        object: Bits<S>,
        dir: Vector<S>,
        mask: Mask,
    ) {
        let (point, normal) = (Vector::gather(&table.a, object), Vector::gather(&table.normal, object));
        let t = s.widen(Float::gather(&at.hits.t, at.index).v);
        let (origin, dir, from, n) = (widened(at.ray_origin()), widened(dir), widened(point), widened(normal));
        let near = three!(|k| s.add_d(origin[k], s.mul_d(t, dir[k])));
        let away = three!(|k| s.sub_d(near[k], from[k]));
        let height = s.div_d(dot_d(s, away, n), dot_d(s, n, n));
        let [x, y, z] = three!(|k| Float { s, v: s.narrow(s.sub_d(near[k], s.mul_d(n[k], height))) });
        let position = Vector { x, y, z };
        // All bounds except rounding have a margin of a power of two.
        let error = (point.abs().max_element() + position.abs().max_element()) * F64_ERROR as f32;
        let each = Vector { x: error, y: error, z: error };
        let offset = normal.abs().dot(position.abs().mul_all(2.0 * UNIT_ROUNDOFF) + each);
        let local = position - point;
        let axes = [&table.b, &table.c];
        self.position = select_vector(mask, position, self.position);
        self.geometric_normal = select_vector(mask, normal, self.geometric_normal);
        self.offset = select(mask, offset, self.offset);
        self.uv = two!(|k| select(mask, local.dot(Vector::gather(axes[k], object)), self.uv[k]));
    }

    /// Sets single triangles, textured spheres and points near the edge of a triangle by the scalar code.
    #[inline(always)]
    fn set_others(&mut self, s: S, at: &HitGroup<S>, mask: Mask, with_tangents: Mask) {
        let mut vectors = [
            self.position.to_arrays(),
            self.geometric_normal.to_arrays(),
            self.normal.to_arrays(),
            self.reach_normal.to_arrays(),
            self.lifted.to_arrays(),
            self.interpolated.to_arrays(),
            [[0.0; LANES]; 3],
        ];
        let mut scalars = [self.offset.to_array(), self.uv[0].to_array(), self.uv[1].to_array(), [1.0; LANES]];
        let mut is_mapped = 0;
        self.front &= !mask;
        for (lane, &i) in at.indices.iter().enumerate() {
            if mask >> lane & 1 == 0 {
                continue;
            }
            let vertex = at.vertex(i as usize);
            let reach = vertex.reach_normal();
            let values = [
                vertex.position,
                vertex.geometric_normal,
                vertex.normal,
                reach,
                vertex.position + vertex.lift,
                vertex.interpolated,
                vertex.tangent.along_u,
            ];
            for (arrays, value) in vectors.iter_mut().zip(values) {
                (arrays[0][lane], arrays[1][lane], arrays[2][lane]) = (value.x, value.y, value.z);
            }
            scalars[0][lane] = vertex.geometric_normal.abs().dot(vertex.error);
            let uv = vertex.texture_point.uv[0];
            (scalars[1][lane], scalars[2][lane], scalars[3][lane]) = (uv.x, uv.y, vertex.tangent.handedness);
            is_mapped |= Mask::from(vertex.is_mapped()) << lane;
            self.front |= Mask::from(vertex.front) << lane;
        }
        let [position, geometric_normal, normal, reach_normal, lifted, interpolated, along_u] = &vectors;
        self.position = Vector::from_arrays(s, position);
        self.geometric_normal = Vector::from_arrays(s, geometric_normal);
        self.normal = Vector::from_arrays(s, normal);
        self.reach_normal = Vector::from_arrays(s, reach_normal);
        self.lifted = Vector::from_arrays(s, lifted);
        self.interpolated = Vector::from_arrays(s, interpolated);
        self.offset = Float::load(s, &scalars[0]);
        self.uv = [Float::load(s, &scalars[1]), Float::load(s, &scalars[2])];
        let (along_u, handedness) = (Vector::from_arrays(s, along_u), Float::load(s, &scalars[3]));
        let of_others = TangentLanes { along_u, handedness, known: mask, is_final: mask, is_mapped };
        if self.tangent.known != 0 {
            self.tangent = of_others.over(mask, &self.tangent);
        } else if with_tangents & mask != 0 {
            self.tangent = of_others;
        }
    }

    #[inline(always)]
    pub(crate) fn stored(&self) -> StoredPlaces {
        StoredPlaces {
            position: self.position.to_arrays(),
            geometric_normal: self.geometric_normal.to_arrays(),
            normal: self.normal.to_arrays(),
            wo: self.wo.to_arrays(),
            uv: [self.uv[0].to_array(), self.uv[1].to_array()],
            front: self.front,
        }
    }

    /// Origin of a ray that stays on the side of `wo`.
    #[inline(always)]
    pub fn leaving(&self) -> Vector<S> {
        offset_along(self.lifted, self.offset, self.geometric_normal)
    }

    /// Origin of a ray to the far side.
    #[inline(always)]
    pub fn passing(&self) -> Vector<S> {
        offset_along(self.position, self.offset, -self.geometric_normal)
    }
}

/// Surface points in memory, for access lane by lane.
pub(crate) struct StoredPlaces {
    position: [[f32; LANES]; 3],
    geometric_normal: [[f32; LANES]; 3],
    normal: [[f32; LANES]; 3],
    wo: [[f32; LANES]; 3],
    uv: [[f32; LANES]; 2],
    front: Mask,
}

impl StoredPlaces {
    /// First texture coordinates.
    pub fn uv(&self) -> &[[f32; LANES]; 2] {
        &self.uv
    }

    /// Returns the vertex of a lane, without the origins of rays.
    #[inline]
    pub fn vertex(&self, lane: usize) -> Vertex {
        let at = |arrays: &[[f32; LANES]; 3]| Vec3::new(arrays[0][lane], arrays[1][lane], arrays[2][lane]);
        Vertex {
            position: at(&self.position),
            error: Vec3::ZERO,
            geometric_normal: at(&self.geometric_normal),
            normal: at(&self.normal),
            smooth_normal: at(&self.normal),
            interpolated: at(&self.normal),
            tangent: Tangent::default(),
            texture_point: Vec2::new(self.uv[0][lane], self.uv[1][lane]).into(),
            front: self.front >> lane & 1 != 0,
            wo: at(&self.wo),
            lift: Vec3::ZERO,
            turns_over: false,
        }
    }
}

/// Projects hits onto spheres, in `f64` as in the scalar code; returns positions and outward normals.
#[inline(always)]
pub(crate) fn ball_points<S: Simd>(
    s: S,
    [origin, dir]: [Vector<S>; 2],
    t: Float<S>,
    center: Vector<S>,
    radius: Float<S>,
) -> [Vector<S>; 2] {
    let (t, radius) = (s.widen(t.v), s.widen(radius.v));
    let (origin, dir, center) = (widened(origin), widened(dir), widened(center));
    let out = three!(|k| s.sub_d(s.add_d(origin[k], s.mul_d(t, dir[k])), center[k]));
    let inverse = s.div_d(s.splat_d(1.0), s.sqrt_d(dot_d(s, out, out)));
    let normal = three!(|k| s.mul_d(out[k], inverse));
    let [x, y, z] = three!(|k| Float { s, v: s.narrow(s.add_d(center[k], s.mul_d(radius, normal[k]))) });
    let position = Vector { x, y, z };
    let [x, y, z] = three!(|k| Float { s, v: s.narrow(normal[k]) });
    [position, Vector { x, y, z }]
}

#[inline(always)]
fn widened<S: Simd>(v: Vector<S>) -> [S::D; 3] {
    let s = v.x.s;
    [s.widen(v.x.v), s.widen(v.y.v), s.widen(v.z.v)]
}

#[inline(always)]
fn dot_d<S: Simd>(s: S, a: [S::D; 3], b: [S::D; 3]) -> S::D {
    s.add_d(s.add_d(s.mul_d(a[0], b[0]), s.mul_d(a[1], b[1])), s.mul_d(a[2], b[2]))
}
