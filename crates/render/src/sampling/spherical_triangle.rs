//! A triangle as seen from a point: its solid angle, and directions uniform in it.

use glam::{Vec2, Vec3};

/// A triangle seen from a reference point, ready to be sampled by solid angle.
///
/// Source: Arvo 1995, "Stratified Sampling of Spherical Triangles"; solid angle by van Oosterom and Strackee 1983.
#[derive(Clone, Copy, Debug)]
pub struct SphericalTriangle {
    /// Unit directions to the corners.
    corners: [Vec3; 3],
    solid_angle: f32,
}

impl SphericalTriangle {
    /// `corners` are relative to the reference point, and none lies in it.
    #[inline]
    pub fn new(corners: [Vec3; 3]) -> Self {
        let [a, b, c] = corners;
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        // b − a and c − a are computed first: the product of the directions themselves would cancel.
        let triple = a.dot((b - a).cross(c - a)).abs();
        let denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        Self { corners: [a / la, b / lb, c / lc], solid_angle: 2.0 * triple.atan2(denominator) }
    }

    /// Steradians.
    #[inline]
    pub fn solid_angle(&self) -> f32 {
        self.solid_angle
    }

    /// A unit direction uniform in the triangle, or `None` when the triangle looks like a line.
    #[inline]
    pub fn sample(&self, u: Vec2) -> Option<Vec3> {
        let [a, b, c] = self.corners;
        let n_ab = a.cross(b).try_normalize()?;
        let n_ca = c.cross(a).try_normalize()?;
        let alpha = n_ab.angle_between(-n_ca);
        let (sin_alpha, cos_alpha) = alpha.sin_cos();
        // The smaller triangle that keeps corner `a` and has the share u.x of the area: its angles sum to β' + γ' =
        // share − α + π.
        let (sin_phi, cos_phi) = {
            let (s, c) = (u.x * self.solid_angle).sin_cos();
            // sin and cos of (area + π − α) − π, signs folded in.
            (s * cos_alpha - c * sin_alpha, c * cos_alpha + s * sin_alpha)
        };
        let cos_c = a.dot(b);
        let k1 = cos_phi - cos_alpha;
        let k2 = sin_phi + sin_alpha * cos_c;
        let denominator = (k2 * sin_phi + k1 * cos_phi) * sin_alpha;
        let cos_b = if denominator == 0.0 {
            1.0
        } else {
            (((k2 * cos_phi - k1 * sin_phi) * cos_alpha - k2) / denominator).clamp(-1.0, 1.0)
        };
        let sin_b = (1.0 - cos_b * cos_b).sqrt();
        let corner = cos_b * a + sin_b * (c - c.dot(a) * a).try_normalize()?;
        let cos_theta = 1.0 - u.y * (1.0 - corner.dot(b));
        let sin_theta = (1.0 - cos_theta * cos_theta).max(0.0).sqrt();
        let sideways = (corner - corner.dot(b) * b).try_normalize().unwrap_or(Vec3::ZERO);
        Some((cos_theta * b + sin_theta * sideways).normalize())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CASES: [[Vec3; 3]; 3] = [
        [Vec3::new(-1.0, 0.0, 2.0), Vec3::new(1.0, 0.0, 2.0), Vec3::new(0.3, 1.5, 2.5)],
        [Vec3::X, Vec3::Y, Vec3::Z],
        [Vec3::new(0.5, 0.1, 0.2), Vec3::new(-2.0, 3.0, 0.1), Vec3::new(1.0, 2.0, -3.0)],
    ];

    #[test]
    fn octant_has_an_eighth_of_the_sphere() {
        let triangle = SphericalTriangle::new([Vec3::X, Vec3::Y, Vec3::Z]);
        assert!((triangle.solid_angle() - std::f32::consts::FRAC_PI_2).abs() < 1e-6);
    }

    #[test]
    fn directions_are_uniform_and_inside() {
        for corners in CASES {
            let triangle = SphericalTriangle::new(corners);
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
                let d = triangle.sample(u).unwrap();
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
