//! Tangents and normal maps at sixteen points; see [`crate::shading::tangent`].

use crate::shading::simd::instances::{Corners, set_lane, times};
use crate::shading::simd::lanes::lanes_of;
use crate::shading::simd::surface::{HitGroup, SurfaceLanes};
use crate::shading::simd::tangents::TangentLanes;
use crate::shading::tangent::{bent, normal_of_map, tangent_axes};
use firstlight_simd::{Bits, Float, LANES, Mask, Real, Simd, Vector, select, select_vector, three};

impl<S: Simd> SurfaceLanes<S> {
    /// Returns the tangents of meshes.
    ///
    /// - `row`: rows of the objects in the instance table; `mask`: lanes that need them.
    #[inline(always)]
    pub(crate) fn mesh_tangents(
        &self,
        s: S,
        at: &HitGroup<S>,
        row: Bits<S>,
        corners: &Corners<S>,
        mask: Mask,
    ) -> TangentLanes<S> {
        let table = &at.scene.surfaces.instances;
        let mut given = [[[0.0; LANES]; 3]; 3];
        let (mut signs, mut with_tangents) = ([1.0; LANES], 0);
        for lane in lanes_of(mask) {
            let i = at.indices[lane] as usize;
            let object = &at.scene.geometry.objects[at.hits.object[i] as usize];
            let mesh = object.mesh.as_ref().expect("a mesh shape has a mesh");
            if mesh.tangents.is_empty() {
                continue;
            }
            with_tangents |= 1 << lane;
            for (k, vertex) in mesh.triangles[at.hits.prim[i] as usize].into_iter().enumerate() {
                let tangent = mesh.tangents[vertex as usize];
                set_lane(&mut given[k], lane, tangent.truncate());
                if k == 0 {
                    signs[lane] = tangent.w;
                }
            }
        }
        let one = Float::splat(s, 1.0);
        let [a, b, c] = corners.positions;
        let (p, q) = (times(&table.world_from_object, row, b - a), times(&table.world_from_object, row, c - a));
        // Changes of u and v along both edges.
        let [[ua, va], [ub, vb], [uc, vc]] = corners.uvs;
        let (by_p, by_q) = ([ub - ua, vb - va], [uc - ua, vc - va]);
        let area = by_p[0] * by_q[1] - by_p[1] * by_q[0];
        let is_flat = area.is_zero() | !area.abs().lt(one.all(f32::INFINITY));
        let sign = one.copysign(area);
        let along_u = (p * by_q[1] - q * by_p[1]) * sign;
        let along_v = (q * by_p[0] - p * by_q[0]) * sign;
        let front = select_vector(self.front, self.interpolated, -self.interpolated);
        let is_left = front.cross(along_u).dot(along_v).is_negative() & !is_flat;
        let mut found = TangentLanes {
            along_u: select_vector(is_flat, p, along_u),
            handedness: select(is_left, -one, one),
            known: mask,
            is_final: 0,
            is_mapped: 0,
        };
        if with_tangents != 0 {
            let [a, b, c] = three!(|k| Vector::from_arrays(s, &given[k]));
            let [wa, wb, wc] = corners.weights;
            let along = times(&table.world_from_object, row, a * wa + b * wb + c * wc);
            let [x, y, z] = three!(|k| Vector::gather(&table.world_from_object[k], row));
            let mirrored = x.dot(y.cross(z)).is_negative();
            let sign = Float::load(s, &signs);
            found.along_u = select_vector(with_tangents, along, found.along_u);
            found.handedness = select(with_tangents, select(mirrored, -sign, sign), found.handedness);
        }
        found
    }

    /// The shading normal without normal mapping.
    #[inline(always)]
    pub(crate) fn unmapped_normal(&self) -> Vector<S> {
        select_vector(self.interpolated.dot(self.wo).is_positive(), self.interpolated, self.geometric_normal)
    }

    /// Turns the shading normals by a map; returns the lanes in which the map turns them.
    ///
    /// - `mask`: lanes with a map; `coded`, `scale`: as of [`normal_of_map`].
    #[inline(always)]
    pub(crate) fn turn_normals(&mut self, mask: Mask, coded: Vector<S>, scale: Float<S>) -> Mask {
        let TangentLanes { along_u, handedness, known, is_final, is_mapped } = self.tangent;
        if known == 0 {
            return 0;
        }
        let one = scale.all(1.0);
        let side = select(self.front, one, -one);
        let front = self.interpolated * side;
        let turned = normal_of_map(coded, scale, tangent_axes(along_u, handedness, front), front) * side;
        let mapped = mask & !is_final & !(turned - self.interpolated).is_zero();
        self.normal = select_vector(mapped, bent(turned, self.unmapped_normal(), self.wo), self.normal);
        mapped | is_mapped & is_final
    }
}
