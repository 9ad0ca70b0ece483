//! Normal maps, and the tangents that they are relative to.
//!
//! With a mapped normal, a mirrored ray may point into the surface, which causes black fringes. The normal is bent
//! until the mirrored ray lies in the surface (Keller et al. 2017, "The Iray Light Transport Simulation and Rendering
//! System", appendix A.3). Light below the true surface is lost, so no energy is gained.

use firstlight_mesh::Mesh;
use firstlight_simd::{Real, Truth, Vector3, frame_around, select_vector};
use glam::{Affine3A, Vec2, Vec3};

/// The tangent frame of the first texture coordinates.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Tangent {
    /// Direction of increasing u, approximately in the surface, in metres of any length; zero if not needed.
    pub along_u: Vec3,
    /// 1 if `normal × along_u` is the direction of v for the normal of the front, otherwise -1.
    pub handedness: f32,
    /// Gradients of u and of v over the surface, per metre; zero if not needed.
    pub gradients: [Vec3; 2],
}

impl Tangent {
    pub fn new(along_u: Vec3, handedness: f32) -> Self {
        Self { along_u, handedness, gradients: [Vec3::ZERO; 2] }
    }

    /// Tangent of a surface by the derivatives of its points by u and v.
    pub fn of_derivatives(by_u: Vec3, by_v: Vec3) -> Self {
        Self { gradients: gradients([by_u, by_v], [Vec2::X, Vec2::Y]), ..Self::new(by_u, 1.0) }
    }

    /// Tangent of a triangle of a mesh: that of its vertices, or derived from its texture coordinates.
    ///
    /// - `weights`: barycentric; `normal`: of the front, unit.
    pub fn of_mesh(mesh: &Mesh, triangle: [usize; 3], weights: Vec3, map: &Affine3A, normal: Vec3) -> Self {
        let uv = |k: usize| mesh.uvs.get(triangle[k]).copied().unwrap_or([Vec2::ZERO, Vec2::X, Vec2::Y][k]);
        let [p, q] = [1, 2].map(|k| map.transform_vector3(mesh.positions[triangle[k]] - mesh.positions[triangle[0]]));
        let [a, b] = [1, 2].map(|k| uv(k) - uv(0));
        let gradients = gradients([p, q], [a, b]);
        let mirrored = if map.matrix3.determinant() < 0.0 { -1.0 } else { 1.0 };
        if !mesh.tangents.is_empty() {
            let [a, b, c] = triangle.map(|i| mesh.tangents[i]);
            let along = weights.x * a.truncate() + weights.y * b.truncate() + weights.z * c.truncate();
            return Self { gradients, ..Self::new(map.transform_vector3(along), mirrored * a.w) };
        }
        let area = a.perp_dot(b);
        if area == 0.0 || !area.is_finite() {
            return Self { gradients, ..Self::new(p, 1.0) };
        }
        // Derivatives of the position by u and by v, up to a positive factor.
        let along_u = (b.y * p - a.y * q) * area.signum();
        let along_v = (a.x * q - b.x * p) * area.signum();
        let handedness = if normal.cross(along_u).dot(along_v) < 0.0 { -1.0 } else { 1.0 };
        Self { gradients, ..Self::new(along_u, handedness) }
    }

    /// Returns a direction in the surface, unit.
    ///
    /// - `direction`: along u and v; `normal`: unit.
    pub fn along(&self, direction: Vec2, normal: Vec3) -> Vec3 {
        let [x, y] = tangent_axes(self.along_u.into(), self.handedness, normal.into()).map(Vec3::from);
        direction.x * x + direction.y * y
    }
}

/// Returns the axes along u and v, both unit and perpendicular to a normal of the front.
///
/// - `along_u`, `handedness`: of a [`Tangent`].
#[inline(always)]
pub(crate) fn tangent_axes<R: Real>(along_u: Vector3<R>, handedness: R, normal: Vector3<R>) -> [Vector3<R>; 2] {
    let x = (along_u - normal * normal.dot(along_u)).normalize_or(frame_around(normal)[1]);
    let y = normal.cross(x);
    [x, select_vector(handedness.is_negative(), -y, y)]
}

/// Returns the normal of a normal map, unit.
///
/// - `coded`: 0..1 for −1..1 along tangent, bitangent and normal; `scale`: factor of the first two; `front`: unmapped
///   normal of the front, unit.
///   `axes`: of [`tangent_axes`].
#[inline(always)]
pub(crate) fn normal_of_map<R: Real>(
    coded: Vector3<R>,
    scale: R,
    [x, y]: [Vector3<R>; 2],
    front: Vector3<R>,
) -> Vector3<R> {
    let (along, across) = ((coded.x * 2.0 - 1.0) * scale, (coded.y * 2.0 - 1.0) * scale);
    (x * along + y * across + front * (coded.z * 2.0 - 1.0)).normalize_or(front)
}

/// Returns the normal of a surface with heights above it, unit: that of the points moved along their normals (Blinn
/// 1978, "Simulation of Wrinkled Surfaces").
///
/// - `slope`: derivatives of the height by u and v, metres; `front`: normal of the front, unit.
pub(crate) fn normal_of_relief(slope: Vec2, tangent: &Tangent, front: Vec3) -> Vec3 {
    let gradient = slope.x * tangent.gradients[0] + slope.y * tangent.gradients[1];
    (front - (gradient - front.dot(gradient) * front)).normalize_or(front)
}

/// Gradients of u and of v over a plane, per metre.
///
/// - `edges`: two vectors in the plane, metres; `changes`: of u and v along each.
fn gradients([p, q]: [Vec3; 2], [a, b]: [Vec2; 2]) -> [Vec3; 2] {
    let normal = p.cross(q);
    let [across_p, across_q] = [p, q].map(|edge| edge.cross(normal) / normal.length_squared());
    let of = |along_p: f32, along_q: f32| {
        let gradient = along_p * across_q - along_q * across_p;
        if gradient.is_finite() { gradient } else { Vec3::ZERO }
    };
    [of(a.x, b.x), of(a.y, b.y)]
}

/// Returns the normal closest to `normal`, in the plane of it and `wo`, for which the mirrored `wo` is not below
/// `surface`.
///
/// - All unit; `surface` faces `wo`.
#[inline(always)]
pub(crate) fn bent<R: Real>(normal: Vector3<R>, surface: Vector3<R>, wo: Vector3<R>) -> Vector3<R> {
    let mirrored = normal * (normal.dot(wo) * 2.0) - wo;
    let below = mirrored.dot(surface);
    let is_kept = below.all(0.0).le(below) & normal.dot(wo).is_positive();
    if !(!is_kept).any() {
        return normal;
    }
    // Moves along the normal up to the surface; for a normal that faces away from it the step is limited.
    let rise = normal.dot(surface).at_least(1e-3);
    let lifted = (mirrored - normal * (below / rise)).normalize_or(surface);
    let between = (wo + lifted).normalize_or(surface);
    let found = select_vector(between.dot(wo).is_positive(), between, surface);
    select_vector(is_kept, normal, found)
}

/// Returns a mapped normal that faces the viewer, as Mitsuba 3 has it: one that faces away is mirrored at the unmapped
/// normal.
///
/// - All unit; `surface`: the unmapped normal, on the side of `wo`.
pub(crate) fn turned_over(normal: Vec3, surface: Vec3, wo: Vec3) -> Vec3 {
    if normal.dot(wo) > 0.0 {
        return normal;
    }
    let other = 2.0 * normal.dot(surface) * surface - normal;
    if other.dot(wo) > 0.0 { other } else { surface }
}

/// Dims light that grazes a surface with a mapped normal, as if its microfacets, of the width that leads to such
/// normals, shadowed it (Estevez, Lecocq and Stein 2019, "A Microfacet-Based Shadowing Function to Solve the Bump
/// Terminator Problem").
#[derive(Clone, Copy, Debug)]
pub(crate) struct NormalShadowing {
    /// Unmapped, unit.
    surface: Vec3,
    /// Squared width.
    alpha2: f32,
}

impl NormalShadowing {
    /// - `normal`: mapped; `surface`: unmapped; both unit.
    pub fn new(normal: Vec3, surface: Vec3) -> Self {
        Self { surface, alpha2: (0.125 * tan2(normal.dot(surface))).min(1.0) }
    }

    /// Share of the light from `wi`.
    pub fn share(&self, wi: Vec3) -> f32 {
        2.0 / (1.0 + (1.0 + self.alpha2 * tan2(self.surface.dot(wi))).sqrt())
    }
}

/// Squared tangent of an angle, finite.
fn tan2(cos: f32) -> f32 {
    let cos2 = cos * cos;
    (1.0 - cos2).max(0.0) / cos2.max(1e-12)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Sampler, cosine_hemisphere};

    #[test]
    fn turned_normals_face_the_viewer_and_their_shadows_are_those_of_microfacets() {
        for i in 0..2000 {
            let sampler = Sampler::new(i, 2, 0, 0);
            let [normal, wo, wi] =
                [0, 1, 2].map(|k| cosine_hemisphere(sampler.pair(k)).max(Vec3::new(-1.0, -1.0, 1e-3)));
            let [normal, wo, wi] = [normal, wo, wi].map(Vec3::normalize);
            let found = turned_over(normal, Vec3::Z, wo);
            assert!(found.dot(wo) > 0.0, "{normal}, {wo}: {found}");
            let is_whole = normal.dot(wo) > 0.0;
            assert!((found.z - normal.z).abs() < 1e-5 || found == Vec3::Z, "{found} for {normal}");
            assert!((found.truncate() - normal.truncate()).length() < 1e-5 || !is_whole, "{found} for {normal}");
            // G1 of GGX microfacets whose squared width is an eighth of the squared slope of the normal.
            let alpha = (normal.truncate().length() / normal.z / 8_f32.sqrt()).min(1.0);
            let expected = 1.0 / (1.0 + crate::shading::ggx::lambda(wi.into(), alpha));
            let share = NormalShadowing::new(normal, Vec3::Z).share(wi);
            assert!((share - expected).abs() < 1e-3 * expected, "{normal}, {wi}: {share} for {expected}");
        }
    }

    /// The height u²/10 + v/5 over a skewed plane, against the normal of its points.
    #[test]
    fn a_relief_has_the_normal_of_its_points() {
        let (by_u, by_v) = (Vec3::new(2.0, 0.3, 0.0), Vec3::new(-0.5, 0.7, 0.0));
        let height = |u: f32, v: f32| 0.1 * u * u + 0.2 * v;
        let point = |u: f32, v: f32| u * by_u + v * by_v + height(u, v) * Vec3::Z;
        for (u, v) in [(0.0, 0.0), (1.0, 0.5), (-2.0, 3.0)] {
            let step = 1e-2;
            let across = point(u + step, v) - point(u - step, v);
            let expected = across.cross(point(u, v + step) - point(u, v - step)).normalize();
            let tangent = Tangent::of_derivatives(by_u, by_v);
            let found = normal_of_relief(Vec2::new(0.2 * u, 0.2), &tangent, Vec3::Z);
            assert!((found - expected).length() < 1e-4, "{u}, {v}: {found} for {expected}");
        }
    }

    /// For any normal and view direction, the mirrored ray leaves the surface, and normals that need no bending are
    /// unchanged.
    #[test]
    fn bent_normals_reflect_to_the_side_of_the_surface() {
        let (mut kept, mut turned) = (0, 0);
        for i in 0..10_000 {
            let sampler = Sampler::new(3, 0, 0, i);
            let wo = (cosine_hemisphere(sampler.pair(0)) + Vec3::new(0.0, 0.0, 1e-4)).normalize();
            let normal = (cosine_hemisphere(sampler.pair(2)) + Vec3::new(0.0, 0.0, 0.05)).normalize();
            let found = Vec3::from(bent(normal.into(), Vec3::Z.into(), wo.into()));
            assert!(found.is_normalized() && found.dot(wo) > 0.0, "{found} {wo}");
            let mirrored = 2.0 * found.dot(wo) * found - wo;
            assert!(mirrored.z > -1e-5, "{normal} seen along {wo}: {mirrored}");
            if (2.0 * normal.dot(wo) * normal - wo).z >= 0.0 && normal.dot(wo) > 0.0 {
                assert_eq!(found, normal);
                kept += 1;
            } else {
                turned += 1;
            }
        }
        assert!(kept > 1000 && turned > 1000, "{kept} {turned}");
    }
}
