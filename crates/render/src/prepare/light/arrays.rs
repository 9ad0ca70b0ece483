//! Light sampling for sixteen points at a time; only the textures of lights are read one at a time.
//!
//! The formulas are those of [`crate::prepare::light::shape`] and [`crate::prepare::light::selection`], and are
//! explained there.

use crate::prepare::light::delta::{DeltaSample, DeltaSource, SHARPNESS};
use crate::prepare::light::emitter::Light;
use crate::prepare::light::flat::{FlatPoint, QuadLight, TriangleLight, pdf_by_area};
use crate::prepare::light::shape::{CLOSE, LightShape, cos_at_center, sample_sphere};
use crate::sampling::warp::{cone_pdf, one_minus_cos_from_sin2, uniform_disc};
use firstlight_kdtree::geometry::robust::{gamma, offset_along};
use firstlight_simd::{
    Bits, Elementary, Float, LANES, Mask, Real, Simd, Vector, Vector3, frame_around, padded, select, select_vector,
};
use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, PI, TAU};

/// The lights as arrays for SIMD.
#[derive(Debug)]
pub(crate) struct LightArrays {
    pub n: usize,
    pub has_spheres: bool,
    pub has_quads: bool,
    pub has_triangles: bool,
    pub has_deltas: bool,
    pub has_varied: bool,
    pub flags: Vec<u32>,
    /// Corner, centre or first vertex.
    pub origin: [Vec<f32>; 3],
    /// Unit edges; for triangles, whole edges.
    pub unit_u: [Vec<f32>; 3],
    pub unit_v: [Vec<f32>; 3],
    pub normal: [Vec<f32>; 3],
    pub length_u: Vec<f32>,
    pub length_v: Vec<f32>,
    /// Radius of spheres.
    pub radius: Vec<f32>,
    pub area: Vec<f32>,
    /// Bound on a point's rounding error along the normal of a quad, metres.
    pub lift: Vec<f32>,
    pub radiance: [Vec<f32>; 3],
}

pub(crate) const SPHERE: u32 = 1;
pub(crate) const RECTANGLE: u32 = 2;
pub(crate) const TRIANGLE: u32 = 4;
/// With [`SPHERE`]: represents a point light.
pub(crate) const POINT: u32 = 8;
/// A delta light.
pub(crate) const DELTA: u32 = 16;
/// With [`DELTA`]: infinitely far away.
pub(crate) const IS_FAR: u32 = 32;
/// Its radiance varies over its surface.
pub(crate) const VARIED: u32 = 64;

/// Light samples for sixteen points; see [`crate::prepare::light::emitter::LightSample`].
#[derive(Clone, Copy)]
pub(crate) struct LightLanes<S: Simd> {
    /// Lanes with a sample.
    pub found: Mask,
    pub target: Vector<S>,
    pub wi: Vector<S>,
    pub pdf: Float<S>,
    pub radiance: Vector<S>,
    /// See [`crate::prepare::light::emitter::LightSample::is_far`].
    pub is_far: Mask,
    /// Position along the edges of flat lights, 0..1.
    pub uv: [Float<S>; 2],
}

impl LightArrays {
    /// Returns `None` if there are none.
    pub fn build(lights: &[Light]) -> Option<Self> {
        if lights.is_empty() {
            return None;
        }
        let mut rows: [Vec<f32>; 20] = Default::default();
        let mut flags = Vec::new();
        for light in lights {
            let even = light.even_radiance();
            // What varies is a factor.
            let radiance = even.unwrap_or(Vec3::ONE);
            let (flag, origin, u, v, normal, rest) = match &light.shape {
                LightShape::Triangle { light, .. } => {
                    let [e1, e2] = light.edges;
                    (TRIANGLE, light.first, e1, e2, light.normal, [0.0, 0.0, 0.0, light.lift])
                }
                LightShape::Sphere { center, radius } => {
                    let nowhere = Vec3::ZERO.into();
                    (SPHERE, Vector3::from(*center), nowhere, nowhere, nowhere, [0.0, 0.0, *radius, 0.0])
                }
                LightShape::Quad { light, .. } => {
                    let ([u, v], [length_u, length_v]) = (light.units, light.lengths);
                    let flag = if light.is_rectangle { RECTANGLE } else { 0 };
                    (flag, light.corner, u, v, light.normal, [length_u, length_v, 0.0, light.lift])
                }
                delta @ (LightShape::Point { .. } | LightShape::Directional { .. }) => {
                    let source = delta.delta()?;
                    let flag = if source.is_far { DELTA | IS_FAR } else { DELTA };
                    let nowhere = Vec3::ZERO.into();
                    let [linear, cube] = source.falloff;
                    let rest = [source.outer, source.slope, linear, cube];
                    (flag, source.origin, nowhere, nowhere, source.axis, rest)
                }
            };
            let point = if light.is_point && flag & DELTA == 0 { POINT } else { 0 };
            flags.push(flag | point | if even.is_none() { VARIED } else { 0 });
            let [length_u, length_v, radius, lift] = rest;
            let vectors = [origin, u, v, normal, radiance.into()].map(|v| Vec3::from(v).to_array());
            let values = vectors.as_flattened().iter().copied();
            let values = values.chain([length_u, length_v, radius, light.shape.area(), lift]);
            rows.iter_mut().zip(values).for_each(|(row, value)| row.push(value));
        }
        let has_spheres = flags.iter().any(|&flag| flag & SPHERE != 0);
        let has_triangles = flags.iter().any(|&flag| flag & TRIANGLE != 0);
        let has_varied = flags.iter().any(|&flag| flag & VARIED != 0);
        let has_deltas = flags.iter().any(|&flag| flag & DELTA != 0);
        let has_quads = flags.iter().any(|&flag| flag & (SPHERE | TRIANGLE | DELTA) == 0);
        let [ox, oy, oz, ux, uy, uz, vx, vy, vz, nx, ny, nz, r, g, b, length_u, length_v, radius, area, lift] =
            rows.map(padded);
        Some(Self {
            n: lights.len(),
            has_spheres,
            has_quads,
            has_triangles,
            has_deltas,
            has_varied,
            flags: padded(flags),
            origin: [ox, oy, oz],
            unit_u: [ux, uy, uz],
            unit_v: [vx, vy, vz],
            normal: [nx, ny, nz],
            radiance: [r, g, b],
            length_u,
            length_v,
            radius,
            area,
            lift,
        })
    }
}

impl LightArrays {
    /// See [`crate::prepare::light::shape::sphere_as_point`].
    #[inline(always)]
    pub fn as_points<S: Simd>(&self, id: Bits<S>, mask: Mask, position: Vector<S>) -> LightLanes<S> {
        let (center, radius) = (Vector::gather(&self.origin, id), Float::gather(&self.radius, id));
        let offset = center - position;
        let distance = offset.length();
        let wi = offset * (distance.all(1.0) / distance);
        let found = mask & distance.is_positive() & radius.lt(distance);
        let n = wi.abs();
        let around = n.x + n.y + n.z;
        let lift = (n.dot(center.abs()) + around * radius) * gamma(6) + around * distance * gamma(16);
        let ratio = distance / radius;
        let target = offset_along(center - wi * radius, lift, -wi);
        let uv = [ratio.all(0.0); 2];
        LightLanes { found, target, wi, pdf: ratio * ratio * FRAC_1_PI, radiance: wi, is_far: 0, uv }
    }

    /// Replaces the lanes of delta lights.
    #[inline(always)]
    pub fn with_deltas<S: Simd>(
        &self,
        id: Bits<S>,
        mask: Mask,
        position: Vector<S>,
        lanes: LightLanes<S>,
    ) -> LightLanes<S> {
        let flags = Bits::gather(&self.flags, id);
        let deltas = mask & flags.has(DELTA);
        if deltas == 0 {
            return lanes;
        }
        let source = DeltaSource {
            origin: Vector::gather(&self.origin, id),
            axis: Vector::gather(&self.normal, id),
            outer: Float::gather(&self.length_u, id),
            slope: Float::gather(&self.length_v, id),
            falloff: [Float::gather(&self.radius, id), Float::gather(&self.lift, id)],
            is_far: flags.has(IS_FAR),
        };
        let DeltaSample { found, target, wi, scale } = source.seen_from(deltas, position);
        LightLanes {
            found: lanes.found & !deltas | found,
            target: select_vector(deltas, target, lanes.target),
            wi: select_vector(deltas, wi, lanes.wi),
            pdf: select(deltas, scale.all(SHARPNESS), lanes.pdf),
            radiance: select_vector(deltas, lanes.radiance * scale, lanes.radiance),
            is_far: found & source.is_far,
            uv: lanes.uv,
        }
    }

    /// Samples points on lights with an area, without their radiance.
    #[inline(always)]
    pub fn points<S: Simd>(
        &self,
        by_angle: bool,
        id: Bits<S>,
        mask: Mask,
        position: Vector<S>,
        u: [Float<S>; 2],
    ) -> LightLanes<S> {
        let flags = Bits::gather(&self.flags, id);
        let spheres = if self.has_spheres { mask & flags.has(SPHERE) } else { 0 };
        let triangles = if self.has_triangles { mask & flags.has(TRIANGLE) } else { 0 };
        let deltas = if self.has_deltas { mask & flags.has(DELTA) } else { 0 };
        let quads = mask & !spheres & !triangles & !deltas;
        let zero = u[0].all(0.0);
        let (nowhere, uv) = (Vector::all(zero), [zero; 2]);
        let mut all =
            LightLanes { found: 0, target: nowhere, wi: nowhere, pdf: zero, radiance: nowhere, is_far: 0, uv };
        // Values are too large for an `Option` whose methods may not be inlined.
        if spheres != 0 {
            all = self.spheres(by_angle, id, spheres, position, u);
        }
        if triangles != 0 {
            let found = LightLanes::of(self.triangle(id).sample(by_angle, triangles, position, u));
            all = if spheres == 0 { found } else { found.over(triangles, all) };
        }
        if quads != 0 && self.has_quads {
            let found = LightLanes::of(self.quad(id).sample(by_angle, quads, position, u));
            all = if spheres | triangles == 0 { found } else { found.over(quads, all) };
        }
        all
    }

    /// See [`LightShape::pdf`].
    #[inline(always)]
    pub fn pdf<S: Simd>(
        &self,
        by_angle: bool,
        id: Bits<S>,
        position: Vector<S>,
        wi: Vector<S>,
        distance: Float<S>,
    ) -> Float<S> {
        let flags = Bits::gather(&self.flags, id);
        let origin = Vector::gather(&self.origin, id);
        let relative = origin - position;
        let zero = distance.all(0.0);
        let mut pdf = zero;
        if self.has_quads {
            pdf = self.quad(id).pdf(by_angle, position, wi, distance);
        }
        if self.has_triangles {
            let of_triangle = self.triangle(id).pdf(by_angle, position, wi, distance);
            pdf = select(flags.has(TRIANGLE), of_triangle, pdf);
        }
        if self.has_spheres {
            let radius = Float::gather(&self.radius, id);
            let (distance2, r2) = (relative.length_squared(), radius * radius);
            let of_sphere = if by_angle {
                cone_pdf(one_minus_cos_from_sin2(r2 / distance2))
            } else {
                let area = Float::gather(&self.area, id);
                let cos = wi.dot(relative - wi * distance) / radius;
                select(cos.is_positive(), pdf_by_area(distance, cos, area), zero)
            };
            pdf = select(flags.has(SPHERE), select(r2.lt(distance2), of_sphere, zero), pdf);
        }
        pdf
    }

    #[inline(always)]
    fn quad<S: Simd>(&self, id: Bits<S>) -> QuadLight<Float<S>> {
        QuadLight {
            corner: Vector::gather(&self.origin, id),
            units: [Vector::gather(&self.unit_u, id), Vector::gather(&self.unit_v, id)],
            lengths: [Float::gather(&self.length_u, id), Float::gather(&self.length_v, id)],
            normal: Vector::gather(&self.normal, id),
            area: Float::gather(&self.area, id),
            lift: Float::gather(&self.lift, id),
            is_rectangle: Bits::gather(&self.flags, id).has(RECTANGLE),
        }
    }

    #[inline(always)]
    fn triangle<S: Simd>(&self, id: Bits<S>) -> TriangleLight<Float<S>> {
        TriangleLight {
            first: Vector::gather(&self.origin, id),
            edges: [Vector::gather(&self.unit_u, id), Vector::gather(&self.unit_v, id)],
            normal: Vector::gather(&self.normal, id),
            area: Float::gather(&self.area, id),
            lift: Float::gather(&self.lift, id),
        }
    }

    #[inline(always)]
    pub fn spheres<S: Simd>(
        &self,
        by_angle: bool,
        id: Bits<S>,
        mask: Mask,
        position: Vector<S>,
        u: [Float<S>; 2],
    ) -> LightLanes<S> {
        let (center, radius) = (Vector::gather(&self.origin, id), Float::gather(&self.radius, id));
        let to_center = center - position;
        let distance2 = to_center.length_squared();
        let r2 = radius * radius;
        let one = r2.all(1.0);
        let zero = r2.all(0.0);
        let (normal, cone) = if by_angle {
            let sin2_max = r2 / distance2;
            let one_minus_cos_max = one_minus_cos_from_sin2(sin2_max);
            let [x, y] = uniform_disc(u);
            let disc2 = x * x + y * y;
            let one_minus_cos = disc2.at_most(1.0) * one_minus_cos_max;
            let sin2 = (one_minus_cos * (-one_minus_cos + 2.0)).at_least(0.0);
            let cos = one - one_minus_cos;
            let cos_alpha = cos_at_center(sin2, cos, sin2_max);
            let sin_alpha = (one - cos_alpha * cos_alpha).at_least(0.0).sqrt();
            // The direction on the disc, unit; any at the centre.
            let middle = disc2.is_zero();
            let scale = sin_alpha / select(middle, one, disc2.sqrt());
            let local = Vector { x: select(middle, sin_alpha, x * scale), y: y * scale, z: -cos_alpha };
            let axes = frame_around(to_center * (one / distance2.sqrt()));
            (local.to_world(&axes), one_minus_cos_max)
        } else {
            let z = one - u[0] * 2.0;
            let (sin, cos) = (u[1] * TAU).sin_cos();
            let r = (one - z * z).at_least(0.0).sqrt();
            (Vector { x: r * cos, y: r * sin, z }, zero)
        };
        let point = center + normal * radius;
        let offset = point - position;
        let distance = offset.length();
        let wi = offset * (one / distance);
        let mut found = mask & zero.lt(distance);
        let pdf = if by_angle {
            found &= r2.lt(distance2);
            cone_pdf(cone)
        } else {
            let cos = -wi.dot(normal);
            found &= zero.lt(cos);
            distance * distance / (cos * r2 * (4.0 * PI))
        };
        let size = center.abs();
        let n = normal.abs();
        let around = n.x + n.y + n.z;
        let lift = (n.dot(size) + around * radius) * gamma(6) + around * distance * gamma(16);
        let target = offset_along(point, lift, normal);
        let lanes = LightLanes { found, target, wi, pdf, radiance: wi, is_far: 0, uv: [zero; 2] };
        let close = found & distance2.lt(r2 * CLOSE);
        if by_angle && close != 0 { spheres_close_by(close, center, radius, position, u, lanes) } else { lanes }
    }
}

impl<S: Simd> LightLanes<S> {
    #[inline(always)]
    fn of(FlatPoint { found, target, wi, pdf, uv }: FlatPoint<Float<S>>) -> Self {
        Self { found, target, wi, pdf, radiance: wi, is_far: 0, uv }
    }

    /// Selects `self` where the bit is set, otherwise `other`.
    #[inline(always)]
    pub fn over(self, mask: Mask, other: Self) -> Self {
        Self {
            found: self.found | other.found,
            target: select_vector(mask, self.target, other.target),
            wi: select_vector(mask, self.wi, other.wi),
            pdf: select(mask, self.pdf, other.pdf),
            radiance: other.radiance,
            is_far: self.is_far | other.is_far,
            uv: [select(mask, self.uv[0], other.uv[0]), select(mask, self.uv[1], other.uv[1])],
        }
    }
}

/// Replaces the lanes of `close` by [`sample_sphere`].
#[cold]
fn spheres_close_by<S: Simd>(
    close: Mask,
    center: Vector<S>,
    radius: Float<S>,
    position: Vector<S>,
    u: [Float<S>; 2],
    mut lanes: LightLanes<S>,
) -> LightLanes<S> {
    let s = radius.s;
    let [center, position] = [center, position].map(|v| v.to_arrays());
    let (radius, u) = (radius.to_array(), u.map(|u| u.to_array()));
    let (mut target, mut wi, mut pdf) = (lanes.target.to_arrays(), lanes.wi.to_arrays(), lanes.pdf.to_array());
    for lane in (0..LANES).filter(|lane| close >> lane & 1 != 0) {
        let at = |v: &[[f32; LANES]; 3]| Vec3::from_array([v[0][lane], v[1][lane], v[2][lane]]);
        let point = sample_sphere(at(&center), radius[lane], at(&position), Vec2::new(u[0][lane], u[1][lane]));
        let Some(point) = point else {
            lanes.found &= !(1 << lane);
            continue;
        };
        for axis in 0..3 {
            (target[axis][lane], wi[axis][lane]) = (point.target[axis], point.wi[axis]);
        }
        pdf[lane] = point.pdf;
    }
    lanes.target = Vector::from_arrays(s, &target);
    lanes.wi = Vector::from_arrays(s, &wi);
    lanes.pdf = Float::load(s, &pdf);
    lanes
}
