//! Quadric error metric: the sum of squared distances to planes, as a function of position.

use glam::DVec3;
use std::ops::AddAssign;

/// Q(p) = pᵀA p + 2 b·p + c, each plane weighted by the area it represents; symmetric A, stored as six numbers.
///
/// Source: Garland and Heckbert 1997, "Surface Simplification Using Quadric Error Metrics".
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Quadric {
    /// xx, yy, zz, xy, xz, yz of A.
    a: [f64; 6],
    b: DVec3,
    c: f64,
    /// Sum of the weights of all planes.
    weight: f64,
}

impl Quadric {
    /// Creates the quadric of the plane through `point` with a unit `normal`.
    pub fn of_plane(point: DVec3, normal: DVec3, weight: f64) -> Self {
        let scaled = weight * normal;
        let offset = -normal.dot(point);
        Self {
            a: [
                scaled.x * normal.x,
                scaled.y * normal.y,
                scaled.z * normal.z,
                scaled.x * normal.y,
                scaled.x * normal.z,
                scaled.y * normal.z,
            ],
            b: offset * scaled,
            c: weight * offset * offset,
            weight,
        }
    }

    /// Evaluates the quadric; never negative, although rounding can make a sum of squares negative.
    #[inline]
    pub fn at(&self, p: DVec3) -> f64 {
        let ap = self.times(p);
        (p.dot(ap + 2.0 * self.b) + self.c).max(0.0)
    }

    #[inline]
    fn times(&self, p: DVec3) -> DVec3 {
        let [xx, yy, zz, xy, xz, yz] = self.a;
        DVec3::new(xx * p.x + xy * p.y + xz * p.z, xy * p.x + yy * p.y + yz * p.z, xz * p.x + yz * p.y + zz * p.z)
    }

    /// Mean squared distance at `p` over the planes' weights.
    pub fn mean_at(&self, p: DVec3) -> f64 {
        if self.weight > 0.0 { self.at(p) / self.weight } else { 0.0 }
    }

    /// Returns the position of least error near `guess`.
    ///
    /// Where planes are nearly parallel their common point lies far away or does not exist. A regularisation towards
    /// `guess`, with a hundred-millionth of the weight, decides what the planes leave undetermined and does not affect
    /// the rest.
    #[inline]
    pub fn minimum_near(&self, guess: DVec3) -> DVec3 {
        let pull = 1e-8 * self.weight;
        let [xx, yy, zz, xy, xz, yz] = self.a;
        let (xx, yy, zz) = (xx + pull, yy + pull, zz + pull);
        // Solves for the step from the guess: (A + pull) step = −gradient / 2, by Cramer's rule.
        let r = -(self.times(guess) + self.b);
        let (c0, c1, c2) = (yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy);
        let determinant = xx * c0 + xy * c1 + xz * c2;
        if determinant.is_nan() || determinant <= 0.0 {
            return guess;
        }
        let (c3, c4, c5) = (xx * zz - xz * xz, xy * xz - xx * yz, xx * yy - xy * xy);
        let step =
            DVec3::new(c0 * r.x + c1 * r.y + c2 * r.z, c1 * r.x + c3 * r.y + c4 * r.z, c2 * r.x + c4 * r.y + c5 * r.z)
                / determinant;
        guess + step
    }
}

impl AddAssign for Quadric {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        for (a, b) in self.a.iter_mut().zip(other.a) {
            *a += b;
        }
        self.b += other.b;
        self.c += other.c;
        self.weight += other.weight;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;

    #[test]
    fn three_planes_meet_in_their_point_and_two_leave_the_guess_its_freedom() {
        let point = dvec3(0.3, -0.2, 0.7);
        let mut q = Quadric::default();
        for normal in [DVec3::X, dvec3(0.6, 0.8, 0.0), dvec3(0.0, 0.6, 0.8)] {
            q += Quadric::of_plane(point, normal, 0.5);
        }
        assert!(q.minimum_near(DVec3::ZERO).distance(point) < 1e-4);
        assert!(q.at(point) < 1e-15);
        let mut edge = Quadric::of_plane(point, DVec3::X, 1.0);
        edge += Quadric::of_plane(point, DVec3::Y, 1.0);
        let found = edge.minimum_near(dvec3(0.0, 0.0, 5.0));
        assert!(found.distance(dvec3(0.3, -0.2, 5.0)) < 1e-4, "{found}");
    }

    #[test]
    fn the_value_is_the_weighted_squared_distance() {
        let q = Quadric::of_plane(dvec3(1.0, 2.0, 3.0), dvec3(0.0, 0.6, 0.8), 2.0);
        let away = dvec3(1.0, 2.0, 3.0) + 0.5 * dvec3(0.0, 0.6, 0.8) + dvec3(7.0, 0.0, 0.0);
        assert!((q.at(away) - 0.5).abs() < 1e-12);
        assert!((q.mean_at(away) - 0.25).abs() < 1e-12);
    }
}
