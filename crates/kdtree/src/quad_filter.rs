//! Conservative filter for quads, sixteen rays at a time: it finds which quads could be the closest hit.
//!
//! The watertight test of a quad is expensive, and in a room most quads are far from most rays. The filter intersects
//! each quad as a plane with two coordinates, in plain `f32`, and bounds how far rounding, here *and* in the watertight
//! test, can have moved the result. Only quads that the bound leaves undecided are tested exactly, so the results are
//! those of the watertight test, bit for bit.
//!
//! Bounds, with u the unit roundoff, m the centre of the quad, R the largest distance of a corner from it along an
//! axis, and |n|₁ = 1: the watertight test moves corners by at most `5u` of their distance from the origin and depths
//! by `8u` of it (`kdtree::surface`); corners are rounded by `2u` of their size; a dot product of rounded numbers is
//! off by `4u` of its largest terms, of differences by `5u`. Rays and quads of extreme sizes, and NaN, are left
//! undecided.

use super::simd::{KernelSimd, Mask};
use crate::geometry::robust::UNIT_ROUNDOFF;
use glam::{DVec3, Vec3};

/// A parallelogram as a plane with two coordinates.
#[derive(Debug)]
pub(super) struct FilteredQuad {
    middle: [f32; 3],
    /// Scaled so that the absolute values of its components sum to 1.
    normal: [f32; 3],
    /// Dot products with an offset from the centre give the coordinates: ±1 at the edges.
    rows: [[f32; 3]; 2],
    /// Bound on the error of the origin's height over the plane, metres along `normal`, without the part that grows
    /// with the distance.
    height_error: f32,
    /// Bound on the error of points on the plane, metres along each axis.
    place_error: f32,
    /// Coordinate change per metre, times three.
    growth: f32,
}

/// Sizes, in metres, within which none of the products here can overflow or underflow.
const SIZES: std::ops::Range<f64> = 1e-15..1e12;
/// Range of direction components in any unit, and limit on the distance of a ray's origin, for which `t` is finite.
const DIRECTIONS: std::ops::Range<f32> = 1e-15..1e10;
const FARTHEST: f32 = 1e15;

impl FilteredQuad {
    /// Returns `None` for a quad whose area is negligible, or that is too large or too small: such a quad is always
    /// tested.
    pub fn new(corner: Vec3, edge_u: Vec3, edge_v: Vec3) -> Option<Self> {
        let (c, u, v) = (corner.as_dvec3(), edge_u.as_dvec3(), edge_v.as_dvec3());
        let cross = u.cross(v);
        let normal = cross / cross.abs().element_sum();
        let rows = [v.cross(cross), cross.cross(u)].map(|across| across * (2.0 / cross.length_squared()));
        let middle = (c + 0.5 * (u + v)).as_vec3();
        let reach = 0.5 * (u.abs() + v.abs()).max_element();
        let size = c.abs() + u.abs() + v.abs();
        let growth = 3.0 * rows.iter().map(|row| row.abs().element_sum()).fold(0.0, f64::max);
        let unit = f64::from(UNIT_ROUNDOFF);
        let height_error = unit * (13.0 * reach + 3.0 * normal.abs().dot(size));
        let place_error = unit * (13.0 * reach + 4.0 * size.max_element());
        let is_sound = [normal, rows[0], rows[1]].iter().all(|v| v.is_finite())
            && SIZES.contains(&reach)
            && SIZES.contains(&size.max_element())
            && growth * SIZES.start < 1.0
            && growth * reach < 1e6;
        let narrow = |v: DVec3| v.as_vec3().to_array();
        // Bounds are rounded up.
        is_sound.then(|| Self {
            middle: middle.to_array(),
            normal: narrow(normal),
            rows: rows.map(narrow),
            height_error: (height_error as f32).next_up(),
            place_error: (place_error as f32).next_up(),
            growth: (growth as f32).next_up(),
        })
    }
}

/// Sixteen rays prepared for the filter.
pub(super) struct QuadFilterRays<S: KernelSimd> {
    origin: [S::F; 3],
    dir: [S::F; 3],
    /// The largest component of the direction.
    size: S::F,
    /// Slopes up to this size may have either sign.
    flat: S::F,
    /// Factor of `t` in `time_error`.
    drift: S::F,
}

/// Result of the filter for one quad.
pub(super) struct Filtered<S: KernelSimd> {
    /// No hit in front of the origin comes before this `t`; ∞ for a certain miss, −∞ if nothing is known.
    pub earliest: S::F,
    /// Lanes with a certain hit no later than `latest`.
    pub hits: Mask,
    pub latest: S::F,
}

impl<S: KernelSimd> QuadFilterRays<S> {
    #[inline(always)]
    pub fn new(s: S, origin: &[S::F; 3], dir: &[S::F; 3]) -> Self {
        let size = s.max(s.abs(dir[0]), s.max(s.abs(dir[1]), s.abs(dir[2])));
        let farthest = s.splat(FARTHEST);
        let is_near = s.le(s.abs(origin[0]), farthest) & s.le(s.abs(origin[1]), farthest);
        let is_near = is_near & s.le(s.abs(origin[2]), farthest);
        let is_sound = is_near & s.le(s.splat(DIRECTIONS.start), size) & s.le(size, s.splat(DIRECTIONS.end));
        let flat = s.mul(size, s.splat(64.0 * UNIT_ROUNDOFF));
        Self {
            origin: *origin,
            dir: *dir,
            size,
            flat: s.select(is_sound, flat, s.splat(f32::INFINITY)),
            drift: s.mul(size, s.splat(16.0 * UNIT_ROUNDOFF)),
        }
    }

    /// Filters a quad.
    ///
    /// - `SURE`: whether [`Filtered::hits`] and `latest` are needed.
    #[inline(always)]
    pub fn filter<const SURE: bool>(&self, s: S, quad: &FilteredQuad) -> Filtered<S> {
        let from = [
            s.sub(s.splat(quad.middle[0]), self.origin[0]),
            s.sub(s.splat(quad.middle[1]), self.origin[1]),
            s.sub(s.splat(quad.middle[2]), self.origin[2]),
        ];
        let away = s.max(s.abs(from[0]), s.max(s.abs(from[1]), s.abs(from[2])));
        let (height, slope) = (dot(s, &quad.normal, &from), dot(s, &quad.normal, &self.dir));
        let inv = s.reciprocal_about(slope);
        let t = s.mul(height, inv);
        let (zero, one) = (s.splat(0.0), s.splat(1.0));
        let distance_error = s.mul(away, s.splat(18.0 * UNIT_ROUNDOFF));
        let height_error = s.add(distance_error, s.splat(quad.height_error));
        let place_error = s.add(distance_error, s.splat(quad.place_error));
        let time_error = s.mul(s.abs(inv), s.mul_add_about(self.drift, s.abs(t), place_error));

        let mut far = zero;
        for row in &quad.rows {
            // `from` points from the ray's origin to the centre, hence the negative sign.
            let coordinate = s.neg_mul_add_about(dot(s, row, &self.dir), t, dot(s, row, &from));
            far = s.max(s.abs(coordinate), far);
        }
        let margin = s.mul(s.mul(time_error, self.size), s.splat(quad.growth));
        // Written so that NaN leaves the result undecided.
        let certain_slope = s.lt(self.flat, s.abs(slope));
        let certain_side = s.lt(height_error, s.abs(height));
        let outside = s.lt(s.add(one, margin), far);
        let never = certain_slope & (outside | certain_side & s.lt(t, zero));
        let step = s.mul(time_error, s.splat(1.25));
        let earliest = s.select(certain_slope, s.sub(t, step), s.splat(f32::NEG_INFINITY));
        let earliest = s.select(never, s.splat(f32::INFINITY), earliest);
        let (mut hits, mut latest) = (0, t);
        if SURE {
            latest = s.add(t, step);
            hits = certain_slope & certain_side & s.lt(zero, t) & s.le(s.add(far, margin), one);
        }
        Filtered { earliest, hits, latest }
    }
}

/// A dot product with unspecified rounding.
#[inline(always)]
fn dot<S: KernelSimd>(s: S, a: &[f32; 3], b: &[S::F; 3]) -> S::F {
    s.mul_add_about(s.splat(a[0]), b[0], s.mul_add_about(s.splat(a[1]), b[1], s.mul(s.splat(a[2]), b[2])))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::robust::{fixed_cases, offset_ray_origin};
    use crate::geometry::{Shear, intersect_quad, quad_corners};
    use crate::simd::{InstructionSet, LANES, dispatch};
    use crate::surface::quad_rim;
    use glam::vec3;
    use proptest::prelude::*;

    /// Result for one ray and one quad in all lanes: whether it may hit, whether it does, earliest and latest `t`.
    type Answer = (bool, bool, f32, f32);

    #[inline(always)]
    fn filter_once<S: KernelSimd>(s: S, quad: &FilteredQuad, ray: [Vec3; 2], out: &mut Answer) {
        let [origin, dir] = ray.map(|v| [s.splat(v.x), s.splat(v.y), s.splat(v.z)]);
        let seen = QuadFilterRays::new(s, &origin, &dir).filter::<true>(s, quad);
        let (mut earliest, mut latest) = ([0.0; LANES], [0.0; LANES]);
        s.store(seen.earliest, &mut earliest);
        s.store(seen.latest, &mut latest);
        *out = (!(earliest[0] == f32::INFINITY), seen.hits & 1 != 0, earliest[0], latest[0]);
    }

    fn filter(set: InstructionSet, quad: &FilteredQuad, ray: [Vec3; 2]) -> Answer {
        let mut answer = (false, false, 0.0, 0.0);
        let out = &mut answer;
        dispatch!(set, filter_once(quad: &FilteredQuad, ray: [Vec3; 2], out: &mut Answer));
        answer
    }

    fn point() -> impl Strategy<Value = Vec3> {
        // Small integers hit edges, corners and planes; the others cover the general case.
        let whole = (-3i8..=3, -3i8..=3, -3i8..=3).prop_map(|(x, y, z)| vec3(x.into(), y.into(), z.into()));
        let any = (-3.0f32..3.0, -3.0f32..3.0, -3.0f32..3.0).prop_map(|(x, y, z)| vec3(x, y, z));
        prop_oneof![whole, any]
    }

    proptest! {
        #![proptest_config(fixed_cases(60_000))]

        #[test]
        fn what_it_claims_is_what_the_watertight_test_finds(
            corner in point(), edge_u in point(), edge_v in point(), far in point(), at in point(), way in 0u8..6,
            [a, b] in prop::array::uniform2(-0.1f32..1.1), lift in -40i32..40, scale in -30i32..30, shift in 0u8..3,
        ) {
            let scale = 2.0f32.powi(scale);
            let shift = [Vec3::ZERO, vec3(100.0, -70.0, 30.0), vec3(1e4, 3e4, -2e4)][usize::from(shift)];
            let [corner, u, v] = [(corner + shift) * scale, edge_u * scale, edge_v * scale];
            let Some(quad) = FilteredQuad::new(corner, u, v) else { return Ok(()) };
            let far = (far + shift) * scale;
            let on = corner + a * u + b * v;
            // Towards a point of the quad, away from one, towards a corner, away from one, along the plane, arbitrary.
            let ray = match way {
                0 => [far, on - far],
                1 => [on + u.cross(v).normalize() * (scale * lift as f32 * 1e-8), far - on],
                2 => [far, corner + u - far],
                3 => [corner + v, far - corner],
                4 => [on, u * at.x + v * at.y + u.cross(v) * (lift as f32 * 1e-9 / scale)],
                _ => [far, at],
            };
            prop_assume!(ray[1] != Vec3::ZERO);
            let exact = intersect_quad(ray[0], &Shear::new(ray[1]), &quad_corners(corner, u, v));
            let in_front = exact.filter(|hit| hit.t > 0.0);
            for set in InstructionSet::available() {
                let (may_hit, hits, earliest, latest) = filter(set, &quad, ray);
                if let Some(hit) = in_front {
                    prop_assert!(may_hit && earliest <= hit.t, "{set:?}: {hit:?}, {may_hit} from {earliest}");
                    prop_assert!(!hits || hit.t <= latest, "{set:?}: {hit:?} is later than {latest}");
                } else {
                    prop_assert!(!hits, "{set:?}: {exact:?}");
                }
            }
        }

        /// The property that makes the filter worthwhile.
        #[test]
        fn a_ray_does_not_look_back_at_the_quad_that_it_leaves(
            corner in point(), edge_u in point(), edge_v in point(), away in point(),
            [a, b] in prop::array::uniform2(0.0f32..1.0),
        ) {
            prop_assume!(edge_u.cross(edge_v).length() > 1e-3);
            let rim = quad_rim(corner, edge_u, edge_v);
            prop_assume!(away.dot(rim.normal).abs() > 1e-3);
            let quad = FilteredQuad::new(corner, edge_u, edge_v).expect("a sound quad");
            let on = corner + a * edge_u + b * edge_v;
            let origin = offset_ray_origin(on, rim.error, rim.normal, away);
            for set in InstructionSet::available() {
                prop_assert!(!filter(set, &quad, [origin, away]).0, "{set:?}");
            }
        }
    }

    #[test]
    fn what_is_no_number_is_left_open() {
        let quad = FilteredQuad::new(Vec3::ZERO, Vec3::X, Vec3::Z).expect("a sound quad");
        let inside = vec3(0.5, 1.0, 0.5);
        let odd = [f32::NAN, f32::INFINITY, 1e38];
        for set in InstructionSet::available() {
            let rays =
                odd.map(|x| [[inside * x, -Vec3::Y], [inside, Vec3::new(0.0, -x, 0.0)], [inside, Vec3::splat(x)]]);
            for ray in rays.into_iter().flatten() {
                let (_, hits, ..) = filter(set, &quad, ray);
                assert!(!hits, "{set:?}: {ray:?}");
            }
            for dir in [Vec3::X, Vec3::ZERO, vec3(0.0, -1e38, 0.0), vec3(0.0, -1e-38, 0.0), Vec3::NAN] {
                let (may_hit, ..) = filter(set, &quad, [vec3(0.5, 0.0, 0.5), dir]);
                assert!(may_hit, "{set:?}: {dir}");
            }
        }
        for size in [0.0, 1e-30, 1e30, f32::INFINITY, f32::NAN] {
            assert!(FilteredQuad::new(Vec3::ZERO, Vec3::X * size, Vec3::Z * size).is_none(), "{size}");
        }
        assert!(FilteredQuad::new(Vec3::ZERO, Vec3::X, Vec3::X * 2.0).is_none(), "no area");
        assert!(FilteredQuad::new(Vec3::ZERO, Vec3::X, Vec3::Z * 1e-9).is_none(), "a needle");
    }
}
