//! Triangles seen from a point: their solid angle, and uniform sampling of it; for one point or sixteen.

use firstlight_simd::{Elementary, Vector3, select, select_vector};

/// A triangle seen from a reference point, prepared for sampling by solid angle.
///
/// Source: Arvo 1995, "Stratified Sampling of Spherical Triangles"; solid angle by van Oosterom and Strackee 1983.
#[derive(Clone, Copy, Debug)]
pub struct SphericalTriangle<R> {
    /// Unit directions to the vertices.
    corners: [Vector3<R>; 3],
    solid_angle: R,
}

impl<R: Elementary> SphericalTriangle<R> {
    /// Prepares a triangle.
    ///
    /// - `a`: the first vertex, relative to the reference point; `e1`, `e2`: edges from there to the others. No vertex
    ///   coincides with the reference point.
    #[inline(always)]
    pub fn new(a: Vector3<R>, e1: Vector3<R>, e2: Vector3<R>) -> Self {
        let (b, c) = (a + e1, a + e2);
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        // Computed from the edges: the product of the directions would cancel.
        let triple = a.dot(e1.cross(e2)).abs();
        let denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        let one = la.all(1.0);
        let corners = [a * (one / la), b * (one / lb), c * (one / lc)];
        Self { corners, solid_angle: triple.atan2(denominator) * 2.0 }
    }

    /// Solid angle in steradians.
    #[inline(always)]
    pub fn solid_angle(&self) -> R {
        self.solid_angle
    }

    /// Samples a unit direction uniformly in the triangle, and returns whether there is one: not if the triangle
    /// appears as a line.
    #[inline(always)]
    pub fn sample(&self, [u, v]: [R; 2]) -> (Vector3<R>, R::Mask) {
        let [a, b, c] = self.corners;
        let (one, zero) = (u.all(1.0), u.all(0.0));
        let (n_ab, n_ca) = (a.cross(b), a.cross(c));
        let (l_ab, l_ca) = (n_ab.length(), n_ca.length());
        // The angle α at `a`, between its two edges.
        let (n_ab, n_ca) = (n_ab * (one / l_ab), n_ca * (one / l_ca));
        let (cos_alpha, sin_alpha) = (n_ab.dot(n_ca), n_ab.cross(n_ca).length());
        // The smaller triangle with vertex `a` and the share u of the area: its angles sum to β' + γ' = share − α + π.
        // Sine and cosine of (area + π − α) − π, with the signs included.
        let (sin, cos) = (u * self.solid_angle).sin_cos();
        let (sin_phi, cos_phi) = (sin * cos_alpha - cos * sin_alpha, cos * cos_alpha + sin * sin_alpha);
        let k1 = cos_phi - cos_alpha;
        let k2 = sin_phi + sin_alpha * a.dot(b);
        let denominator = (k2 * sin_phi + k1 * cos_phi) * sin_alpha;
        let cos_b = ((k2 * cos_phi - k1 * sin_phi) * cos_alpha - k2) / denominator;
        let cos_b = select(denominator.is_zero(), one, cos_b.at_least(-1.0).at_most(1.0));
        let sin_b = (one - cos_b * cos_b).at_least(0.0).sqrt();
        let across = c - a * c.dot(a);
        let l_across = across.length();
        let corner = a * cos_b + across * (sin_b / l_across);
        let cos_theta = one - v * (one - corner.dot(b));
        let sin_theta = (one - cos_theta * cos_theta).at_least(0.0).sqrt();
        let sideways = corner - b * corner.dot(b);
        let length = sideways.length();
        let sideways = select_vector(length.is_positive(), sideways * (sin_theta / length), Vector3::all(zero));
        let seen = l_ab.is_positive() & l_ca.is_positive() & l_across.is_positive();
        ((b * cos_theta + sideways).normalize(), seen)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Vec2, Vec3};

    fn triangle([a, b, c]: [Vec3; 3]) -> SphericalTriangle<f32> {
        SphericalTriangle::new(a.into(), (b - a).into(), (c - a).into())
    }

    const CASES: [[Vec3; 3]; 3] = [
        [Vec3::new(-1.0, 0.0, 2.0), Vec3::new(1.0, 0.0, 2.0), Vec3::new(0.3, 1.5, 2.5)],
        [Vec3::X, Vec3::Y, Vec3::Z],
        [Vec3::new(0.5, 0.1, 0.2), Vec3::new(-2.0, 3.0, 0.1), Vec3::new(1.0, 2.0, -3.0)],
    ];

    #[test]
    fn octant_has_an_eighth_of_the_sphere() {
        let triangle = triangle([Vec3::X, Vec3::Y, Vec3::Z]);
        assert!((triangle.solid_angle() - std::f32::consts::FRAC_PI_2).abs() < 1e-6);
    }

    #[test]
    fn directions_are_uniform_and_inside() {
        for corners in CASES {
            let triangle = triangle(corners);
            // The mean direction of the solid angle is a line integral over the edges (Lambert's formula without the
            // cosine: half the sum of edge angle times edge normal), independent of the sampling code.
            let [a, b, c] = corners.map(Vec3::normalize);
            let orientation = a.dot(b.cross(c)).signum();
            let edge = |p: Vec3, q: Vec3| 0.5 * p.angle_between(q) * p.cross(q).normalize();
            let expected = orientation * (edge(a, b) + edge(b, c) + edge(c, a)) / triangle.solid_angle();
            let n = 256;
            let mut sum = Vec3::ZERO;
            for i in 0..n * n {
                let u = Vec2::new((i % n) as f32 + 0.5, (i / n) as f32 + 0.5) / n as f32;
                let (d, seen) = triangle.sample(u.to_array());
                assert!(seen, "{corners:?} looks like a line");
                let d = Vec3::from(d);
                for (p, q) in [(a, b), (b, c), (c, a)] {
                    assert!(orientation * d.dot(p.cross(q)) > -1e-5, "{d} lies outside {corners:?}");
                }
                sum += d;
            }
            let mean = sum / (n * n) as f32;
            assert!((mean - expected).length() < 2e-3, "{mean} for {expected}");
        }
    }
}
