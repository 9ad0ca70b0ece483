//! Points on spheres, quads and triangles seen from a shading point, by solid angle where that is stable.

use crate::core::delta_light::{Cone, Falloff};
use crate::prepare::light::delta::{DeltaSource, FAR, NO_CONE};
use crate::prepare::light::flat::{FlatPoint, QuadLight, TriangleLight, pdf_by_area};
use crate::sampling::{cone_pdf, one_minus_cos_from_sin2, uniform_cone, uniform_triangle};
use firstlight_kdtree::geometry::{Frame, robust};
use firstlight_simd::Real;
use glam::{Vec2, Vec3};

/// The surface of a light, which emits on its front only, or the position of a delta light.
#[derive(Clone, Debug)]
pub(crate) enum LightShape {
    Sphere {
        center: Vec3,
        radius: f32,
    },
    Quad {
        corner: Vec3,
        edge_u: Vec3,
        edge_v: Vec3,
        normal: Vec3,
        area: f32,
        /// The same in the form for sampling.
        light: QuadLight<f32>,
    },
    Triangle {
        vertices: [Vec3; 3],
        normal: Vec3,
        area: f32,
        /// The same in the form for sampling.
        light: TriangleLight<f32>,
    },
    /// A delta light at a point.
    Point {
        position: Vec3,
        /// Cone of a spot light.
        cone: Option<Cone>,
    },
    /// Infinitely far away.
    Directional {
        /// Unit, towards the light.
        to_light: Vec3,
        /// Radius of the scene, metres.
        reach: f32,
    },
}

/// A sampled point on a light.
pub(crate) struct LightPoint {
    pub target: Vec3,
    pub wi: Vec3,
    /// Pdf per steradian.
    pub pdf: f32,
    /// Unit normal at the point.
    pub normal: Vec3,
    /// Surface coordinates of flat lights, for textured emission; those of a sphere follow from its normal.
    pub uv: Vec2,
}

/// A point of a light, independent of the viewer.
pub(crate) struct SurfaceOfLight {
    pub position: Vec3,
    /// Bound on its error, metres per axis.
    pub error: Vec3,
    /// Unit normal.
    pub normal: Vec3,
    /// As in [`LightPoint`].
    pub uv: Vec2,
}

impl LightShape {
    pub fn quad(corner: Vec3, edge_u: Vec3, edge_v: Vec3) -> Self {
        let cross = edge_u.cross(edge_v);
        let area = cross.length();
        let (length_u, length_v) = (edge_u.length(), edge_v.length());
        let normal = cross / area;
        let error = robust::gamma(8) * (corner.abs() + edge_u.abs() + edge_v.abs());
        let light = QuadLight {
            corner: corner.into(),
            units: [(edge_u / length_u).into(), (edge_v / length_v).into()],
            lengths: [length_u, length_v],
            normal: normal.into(),
            area,
            lift: normal.abs().dot(error),
            // Perpendicular to within rounding.
            is_rectangle: edge_u.dot(edge_v).abs() <= 8.0 * f32::EPSILON * length_u * length_v,
        };
        Self::Quad { corner, edge_u, edge_v, normal, area, light }
    }

    pub fn triangle(vertices: [Vec3; 3]) -> Self {
        let [a, b, c] = vertices;
        let cross = (b - a).cross(c - a);
        let (normal, area) = (cross.normalize_or(Vec3::Z), 0.5 * cross.length());
        let error = robust::gamma(7) * (a.abs() + b.abs() + c.abs());
        let light = TriangleLight {
            first: a.into(),
            edges: [(b - a).into(), (c - a).into()],
            normal: normal.into(),
            area,
            lift: normal.abs().dot(error),
        };
        Self::Triangle { vertices, normal, area, light }
    }

    /// The form of delta lights for sampling; `None` for all others.
    #[inline]
    pub fn delta(&self) -> Option<DeltaSource<f32>> {
        let nowhere = Vec3::ZERO;
        let (mut falloff, no_cone) = (Falloff::Quadratic.coefficients(), (nowhere, NO_CONE));
        let (origin, (axis, (outer, slope)), is_far) = match *self {
            Self::Sphere { .. } | Self::Quad { .. } | Self::Triangle { .. } => return None,
            Self::Point { position, cone } => {
                falloff = cone.map_or(falloff, |cone| cone.falloff.coefficients());
                (position, cone.map_or(no_cone, |cone| (cone.axis, (cone.outer, cone.slope))), false)
            }
            Self::Directional { to_light, .. } => (to_light, no_cone, true),
        };
        Some(DeltaSource { origin: origin.into(), axis: axis.into(), outer, slope, falloff, is_far })
    }

    /// Area of the emitting side, square metres. For delta lights, the factor from their strength to power as for a
    /// sphere: irradiance corresponds to a point as far away as the scene is wide.
    pub fn area(&self) -> f32 {
        match self {
            Self::Sphere { radius, .. } => 4.0 * std::f32::consts::PI * radius * radius,
            Self::Quad { area, .. } | Self::Triangle { area, .. } => *area,
            Self::Point { .. } => 4.0,
            Self::Directional { reach, .. } => 4.0 * reach * reach,
        }
    }

    /// Normal at a point of the surface, unit; of delta lights any.
    pub fn normal_at(&self, point: Vec3) -> Vec3 {
        match self {
            Self::Sphere { center, .. } => (point - *center).normalize_or(Vec3::Z),
            Self::Quad { normal, .. } | Self::Triangle { normal, .. } => *normal,
            Self::Point { .. } | Self::Directional { .. } => Vec3::Z,
        }
    }

    /// Centre of a sphere or quad, some point inside of a triangle; far away for directional light.
    pub fn center(&self) -> Vec3 {
        match self {
            Self::Sphere { center, .. } => *center,
            Self::Quad { corner, edge_u, edge_v, .. } => *corner + 0.5 * (*edge_u + *edge_v),
            Self::Triangle { vertices: [a, b, c], .. } => (*a + *b + *c) / 3.0,
            Self::Point { position, .. } => *position,
            Self::Directional { to_light, .. } => FAR * *to_light,
        }
    }

    /// Returns a point uniformly over the area of a flat light; of a sphere, the point with the normal given by
    /// [`uniform_sphere`].
    pub fn at_area(&self, u: Vec2) -> SurfaceOfLight {
        match self {
            Self::Sphere { .. } => self.at_normal(uniform_sphere(u)),
            Self::Quad { corner, edge_u, edge_v, normal, .. } => SurfaceOfLight {
                position: *corner + u.x * *edge_u + u.y * *edge_v,
                error: robust::gamma(4) * (corner.abs() + edge_u.abs() + edge_v.abs()),
                normal: *normal,
                uv: u,
            },
            Self::Triangle { vertices: [a, b, c], normal, .. } => {
                let weights = Vec2::from(uniform_triangle(u.to_array()));
                SurfaceOfLight {
                    position: *a + weights.x * (*b - *a) + weights.y * (*c - *a),
                    error: robust::gamma(7) * (a.abs() + b.abs() + c.abs()),
                    normal: *normal,
                    uv: weights,
                }
            }
            Self::Point { .. } | Self::Directional { .. } => {
                SurfaceOfLight { position: self.center(), error: Vec3::ZERO, normal: Vec3::Z, uv: Vec2::ZERO }
            }
        }
    }

    /// Returns the point of a sphere with this outward normal; the centre of a flat light, which has a single normal.
    pub fn at_normal(&self, outwards: Vec3) -> SurfaceOfLight {
        match self {
            Self::Sphere { center, radius } => SurfaceOfLight {
                position: *center + *radius * outwards,
                error: robust::gamma(6) * (center.abs() + Vec3::splat(*radius)),
                normal: outwards,
                uv: Vec2::ZERO,
            },
            _ => self.at_area(Vec2::splat(0.5)),
        }
    }

    /// Samples a point of the front visible from `position`, `None` if there is none; for lights with an area.
    ///
    /// - `by_angle`: uniformly over the solid angle where that is stable, otherwise over the area.
    /// - `u`: two independent uniform numbers in `[0, 1)`.
    #[inline]
    pub(crate) fn sample(&self, position: Vec3, by_angle: bool, u: Vec2) -> Option<LightPoint> {
        match *self {
            Self::Sphere { center, radius } if by_angle => sample_sphere(center, radius, position, u),
            Self::Sphere { center, radius } => sample_sphere_area(center, radius, position, u),
            Self::Quad { light, normal, .. } => {
                LightPoint::of(light.sample(by_angle, true, position.into(), u.to_array()), normal)
            }
            Self::Triangle { light, normal, .. } => {
                LightPoint::of(light.sample(by_angle, true, position.into(), u.to_array()), normal)
            }
            Self::Point { .. } | Self::Directional { .. } => None,
        }
    }

    /// Pdf of [`Self::sample`] for the point `distance` metres along `wi`; per steradian.
    #[inline]
    pub(crate) fn pdf(&self, position: Vec3, by_angle: bool, wi: Vec3, distance: f32) -> f32 {
        match *self {
            Self::Sphere { center, radius } => {
                let distance2 = (center - position).length_squared();
                let r2 = radius * radius;
                if distance2 <= r2 {
                    0.0
                } else if by_angle {
                    cone_pdf(one_minus_cos_from_sin2(r2 / distance2))
                } else {
                    let normal = (position + distance * wi - center) / radius;
                    area_pdf(distance, wi, normal, self.area()).unwrap_or(0.0)
                }
            }
            Self::Quad { light, .. } => light.pdf(by_angle, position.into(), wi.into(), distance),
            Self::Triangle { light, .. } => light.pdf(by_angle, position.into(), wi.into(), distance),
            Self::Point { .. } | Self::Directional { .. } => 0.0,
        }
    }
}

impl LightPoint {
    /// Returns `None` if the point is not visible.
    #[inline]
    fn of(FlatPoint { found, target, wi, pdf, uv }: FlatPoint<f32>, normal: Vec3) -> Option<Self> {
        found.then(|| Self { target: target.into(), wi: wi.into(), pdf, normal, uv: uv.into() })
    }
}

pub(crate) fn sample_sphere(center: Vec3, radius: f32, position: Vec3, u: Vec2) -> Option<LightPoint> {
    let to_center = center - position;
    let distance2 = to_center.length_squared();
    let r2 = radius * radius;
    if distance2 <= r2 {
        // Inside: the sphere emits outwards.
        return None;
    }
    let sin2_max = r2 / distance2;
    let one_minus_cos_max = one_minus_cos_from_sin2(sin2_max);
    let (local, one_minus_cos) = uniform_cone(u.to_array(), one_minus_cos_max);
    let local = Vec3::from(local);
    let frame = Frame::around(to_center / distance2.sqrt());
    if distance2 < CLOSE * r2 {
        return Some(sphere_from_close_by(center, radius, position, frame.to_world(local), one_minus_cos_max));
    }
    let sin2 = (one_minus_cos * (2.0 - one_minus_cos)).max(0.0);
    let cos = 1.0 - one_minus_cos;
    let cos_alpha = cos_at_center(sin2, cos, sin2_max);
    let sin_alpha = (1.0 - cos_alpha * cos_alpha).max(0.0).sqrt();
    let around = local.truncate().normalize_or(Vec2::X);
    let normal = frame.to_world((around * sin_alpha).extend(-cos_alpha));
    let point = center + radius * normal;
    let error = robust::gamma(6) * (center.abs() + Vec3::splat(radius));
    let (wi, distance) = direction(position, point)?;
    Some(LightPoint {
        target: lifted(point, error, normal, distance),
        wi,
        pdf: cone_pdf(one_minus_cos_max),
        normal,
        uv: Vec2::ZERO,
    })
}

/// Squared distance from the centre, in squared radii, below which points of a sphere are computed by
/// [`sphere_from_close_by`].
pub(crate) const CLOSE: f32 = 2.0;

/// Intersection of the direction `wi` (towards the centre) with a sphere that fills much of the field of view.
///
/// Directly above the surface all visible points lie within an angle at the centre that `f32` cannot resolve, so the
/// vector to the surface is computed instead, with its length from the power of the point, which does not cancel.
#[cold]
fn sphere_from_close_by(center: Vec3, radius: f32, position: Vec3, wi: Vec3, one_minus_cos_max: f32) -> LightPoint {
    let (to_center, dir, r) = (center.as_dvec3() - position.as_dvec3(), wi.as_dvec3().normalize(), f64::from(radius));
    let middle = to_center.dot(dir);
    let power = to_center.length_squared() - r * r;
    let distance = power / (middle + (middle * middle - power).max(0.0).sqrt());
    let normal = (distance * dir - to_center).normalize();
    let point = (center.as_dvec3() + r * normal).as_vec3();
    let error = 2.0 * robust::UNIT_ROUNDOFF * point.abs();
    let normal = normal.as_vec3();
    LightPoint {
        target: lifted(point, error, normal, distance as f32),
        wi,
        pdf: cone_pdf(one_minus_cos_max),
        normal,
        uv: Vec2::ZERO,
    }
}

/// Returns a sphere as a point light at its centre: π r² of radiance over distance².
///
/// `None` from inside of it.
#[inline]
pub(crate) fn sphere_as_point(center: Vec3, radius: f32, position: Vec3) -> Option<LightPoint> {
    let (wi, distance) = direction(position, center)?;
    if distance <= radius {
        return None;
    }
    let error = robust::gamma(6) * (center.abs() + Vec3::splat(radius));
    Some(LightPoint {
        target: lifted(center - radius * wi, error, -wi, distance),
        wi,
        pdf: (distance / radius).powi(2) / std::f32::consts::PI,
        normal: -wi,
        uv: Vec2::ZERO,
    })
}

/// Samples uniformly over the whole sphere: at least half of the points lie on the invisible side.
fn sample_sphere_area(center: Vec3, radius: f32, position: Vec3, u: Vec2) -> Option<LightPoint> {
    let normal = uniform_sphere(u);
    let point = center + radius * normal;
    let (wi, distance) = direction(position, point)?;
    let pdf = area_pdf(distance, wi, normal, 4.0 * std::f32::consts::PI * radius * radius)?;
    let error = robust::gamma(6) * (center.abs() + Vec3::splat(radius));
    Some(LightPoint { target: lifted(point, error, normal, distance), wi, pdf, normal, uv: Vec2::ZERO })
}

/// Samples uniformly over all directions.
fn uniform_sphere(u: Vec2) -> Vec3 {
    let z = 1.0 - 2.0 * u.x;
    let (sin_phi, cos_phi) = (std::f32::consts::TAU * u.y).sin_cos();
    let r = (1.0 - z * z).max(0.0).sqrt();
    Vec3::new(r * cos_phi, r * sin_phi, z)
}

/// Longitude and latitude of a unit vector, both 0..1; v = 1 at +Y, u increases counter-clockwise from −X seen from +Y.
#[inline]
pub(crate) fn sphere_uv(normal: Vec3) -> Vec2 {
    use std::f32::consts::{PI, TAU};
    Vec2::new(0.5 + (-normal.z).atan2(normal.x) / TAU, 1.0 - normal.y.clamp(-1.0, 1.0).acos() / PI)
}

/// Returns the end of a shadow ray that does not hit the light itself.
///
/// The offset has two parts: the light's own error, and the error of the kernel for a ray from `distance` metres away:
/// at most a few roundings of numbers of that size, for every shape.
#[inline]
fn lifted(point: Vec3, error: Vec3, normal: Vec3, distance: f32) -> Vec3 {
    robust::offset_ray_origin(point, error + Vec3::splat(robust::gamma(16) * distance), normal, normal)
}

#[inline]
fn direction(from: Vec3, to: Vec3) -> Option<(Vec3, f32)> {
    let offset = to - from;
    let distance = offset.length();
    (distance > 0.0).then(|| (offset / distance, distance))
}

/// Converts a pdf per square metre to one per steradian; `None` if the front is not visible.
#[inline]
fn area_pdf(distance: f32, wi: Vec3, normal: Vec3, area: f32) -> Option<f32> {
    let cos = -wi.dot(normal);
    (cos > 0.0 && area > 0.0).then(|| pdf_by_area(distance, cos, area))
}

/// Cosine of the angle at the centre of a sphere between a visible point and the viewer (Pharr et al., section 6.2.4),
/// in a form without cancellation for small spheres.
///
/// - `sin2`, `cos`: of the angle at the viewer; `sin2_max`: of that of the silhouette.
#[inline(always)]
pub(crate) fn cos_at_center<R: Real>(sin2: R, cos: R, sin2_max: R) -> R {
    let rest = (cos.all(1.0) - sin2 / sin2_max).at_least(0.0);
    (sin2 / sin2_max.sqrt() + cos * rest.sqrt()).at_most(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sampler;
    use std::f32::consts::PI;

    fn lights() -> Vec<LightShape> {
        let tilted = Vec3::new(0.3, -1.0, 0.2);
        vec![
            LightShape::Sphere { center: Vec3::new(0.5, 3.0, 0.2), radius: 1.0 },
            LightShape::Sphere { center: Vec3::new(0.5, 300.0, 0.2), radius: 0.5 },
            LightShape::quad(Vec3::new(-1.0, 2.0, -1.0), Vec3::X * 2.0, Vec3::Z * 2.0),
            LightShape::quad(Vec3::new(-1.0, 2.0, -1.0), Vec3::X * 0.05, Vec3::Z * 0.05),
            LightShape::quad(Vec3::new(-1.0, 2.0, -1.0), Vec3::new(2.0, 0.5, 0.0), Vec3::Z * 2.0),
            LightShape::triangle([tilted + 3.0 * Vec3::Y, Vec3::new(2.0, 2.0, 0.0), Vec3::new(0.0, 2.5, 2.0)]),
            LightShape::triangle([Vec3::Y * 9.0, Vec3::new(0.1, 9.0, 0.0), Vec3::new(0.0, 9.0, 0.1)]),
        ]
    }

    /// Every light, sampled in both ways.
    fn cases(lights: &[LightShape]) -> impl Iterator<Item = (bool, usize, &LightShape)> {
        [true, false]
            .into_iter()
            .flat_map(move |by_angle| lights.iter().enumerate().map(move |(case, shape)| (by_angle, case, shape)))
    }

    /// Irradiance of a floor point from radiance 1, by area sampling in f64.
    fn irradiance_by_area(shape: &LightShape) -> f64 {
        let n = 1500;
        let mut sum = 0.0;
        for i in 0..n * n {
            let (a, b) = ((f64::from(i % n) + 0.5) / f64::from(n), (f64::from(i / n) + 0.5) / f64::from(n));
            let (point, normal, area) = match *shape {
                LightShape::Sphere { center, radius } => {
                    let (z, phi) = (2.0 * a - 1.0, std::f64::consts::TAU * b);
                    let r = (1.0 - z * z).sqrt();
                    let normal = glam::DVec3::new(r * phi.cos(), r * phi.sin(), z);
                    (center.as_dvec3() + f64::from(radius) * normal, normal, f64::from(shape.area()))
                }
                LightShape::Quad { corner, edge_u, edge_v, normal, area, .. } => {
                    let point = corner.as_dvec3() + a * edge_u.as_dvec3() + b * edge_v.as_dvec3();
                    (point, normal.as_dvec3(), f64::from(area))
                }
                LightShape::Triangle { vertices, normal, area, .. } => {
                    let [p, q, r] = vertices.map(Vec3::as_dvec3);
                    let (s, t) = (1.0 - a.sqrt(), b * a.sqrt());
                    (p + s * (q - p) + t * (r - p), normal.as_dvec3(), f64::from(area))
                }
                LightShape::Point { .. } | LightShape::Directional { .. } => unreachable!("they have no area"),
            };
            let distance = point.length();
            let cos_light = (-point.dot(normal) / distance).max(0.0);
            sum += cos_light * (point.y / distance).max(0.0) / (distance * distance) * area;
        }
        sum / f64::from(n * n)
    }

    #[test]
    fn sampled_irradiance_matches_plain_area_sampling() {
        for (by_angle, case, shape) in cases(&lights()) {
            let n = 1 << 14;
            let mut sum = 0.0;
            for i in 0..n {
                if let Some(point) = shape.sample(Vec3::ZERO, by_angle, Sampler::new(1, case as u32, 0, i).pair(0)) {
                    assert!((point.wi.length() - 1.0).abs() < 1e-5);
                    sum += f64::from(point.wi.y.max(0.0) / point.pdf) / f64::from(n);
                }
            }
            let expected = irradiance_by_area(shape);
            assert!((sum / expected - 1.0).abs() < 2e-3, "light {case}: {sum} for {expected}");
        }
    }

    #[test]
    fn pdf_agrees_with_sampling() {
        for (by_angle, case, shape) in cases(&lights()) {
            for i in 0..256 {
                let position = Vec3::new(0.1 * (i % 16) as f32 - 0.8, 0.0, 0.1 * (i / 16) as f32 - 0.8);
                let Some(point) = shape.sample(position, by_angle, Sampler::new(1, 0, 0, i).pair(0)) else { continue };
                let pdf = shape.pdf(position, by_angle, point.wi, (point.target - position).length());
                // By area the normal is reconstructed from the point: a small, distant sphere leaves it few digits.
                let bound = if by_angle { 1e-3 } else { 1e-2 };
                assert!((pdf / point.pdf - 1.0).abs() < bound, "light {case}: {pdf} for {}", point.pdf);
            }
        }
    }

    #[test]
    fn nothing_shines_backwards() {
        let behind = Vec3::new(0.0, 5.0, 0.0);
        assert!(lights()[2].sample(behind, true, Vec2::splat(0.3)).is_none());
        assert!(lights()[0].sample(Vec3::new(0.5, 3.2, 0.2), true, Vec2::splat(0.3)).is_none());
        assert_eq!(lights()[0].pdf(Vec3::new(0.5, 3.2, 0.2), true, Vec3::Y, 0.8), 0.0);
        assert!((lights()[0].area() - 4.0 * PI).abs() < 1e-5);
    }
}
