//! Triangles as seen from sixteen points; see [`crate::sampling::SphericalTriangle`].

use firstlight_simd::{Elementary, Float, Mask, Real, Simd, Vector, select, select_vector};

pub(crate) struct TriangleLanes<S: Simd> {
    /// Unit directions to the corners.
    corners: [Vector<S>; 3],
    pub solid_angle: Float<S>,
}

impl<S: Simd> TriangleLanes<S> {
    /// - `a`: the first corner, seen from the point; `e1`, `e2`: from there to the others.
    #[inline(always)]
    pub fn new(a: Vector<S>, e1: Vector<S>, e2: Vector<S>) -> Self {
        let (b, c) = (a + e1, a + e2);
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        let triple = a.dot(e1.cross(e2)).abs();
        let denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        let one = la.all(1.0);
        let corners = [a * (one / la), b * (one / lb), c * (one / lc)];
        Self { corners, solid_angle: triple.atan2(denominator) * 2.0 }
    }

    /// Unit directions uniform in the triangles, and the lanes whose triangle does not look like a line.
    #[inline(always)]
    pub fn sample(&self, [u, v]: [Float<S>; 2]) -> (Vector<S>, Mask) {
        let [a, b, c] = self.corners;
        let (one, zero) = (u.all(1.0), u.all(0.0));
        let (n_ab, n_ca) = (a.cross(b), a.cross(c));
        let (l_ab, l_ca) = (n_ab.length(), n_ca.length());
        // The angle at `a`, between the two edges that meet there.
        let (n_ab, n_ca) = (n_ab * (one / l_ab), n_ca * (one / l_ca));
        let (cos_alpha, sin_alpha) = (n_ab.dot(n_ca), n_ab.cross(n_ca).length());
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
        let nowhere = Vector { x: zero, y: zero, z: zero };
        let sideways = select_vector(length.is_positive(), sideways * (sin_theta / length), nowhere);
        let seen = l_ab.is_positive() & l_ca.is_positive() & l_across.is_positive();
        ((b * cos_theta + sideways).normalize(), seen)
    }
}
