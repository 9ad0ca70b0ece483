//! Maps from the unit square to discs, hemispheres, cones and triangles, with their densities.

use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_PI_4, PI, TAU};

/// Uniform on the unit disc; keeps neighbours together (Shirley and Chiu 1997).
#[inline]
pub fn uniform_disc(u: Vec2) -> Vec2 {
    let offset = 2.0 * u - Vec2::ONE;
    // The longer coordinate is the radius, the quotient of the two an eighth of a turn at most to either side.
    let across = offset.x.abs() > offset.y.abs();
    let (r, short) = if across { (offset.x, offset.y) } else { (offset.y, offset.x) };
    let (sin, cos) = sin_cos_eighth(FRAC_PI_4 * (short / if r == 0.0 { 1.0 } else { r }));
    if across { Vec2::new(r * cos, r * sin) } else { Vec2::new(r * sin, r * cos) }
}

/// Sine and cosine of an angle in `[−π/4, π/4]`, to 1e-7: Taylor's series, cut where the rest falls below rounding.
#[inline]
fn sin_cos_eighth(x: f32) -> (f32, f32) {
    let x2 = x * x;
    let sin = x * (1.0 - x2 * (1.0 / 6.0 - x2 * (1.0 / 120.0 - x2 * (1.0 / 5040.0 - x2 * (1.0 / 362_880.0)))));
    let cos = 1.0 - x2 * (0.5 - x2 * (1.0 / 24.0 - x2 * (1.0 / 720.0 - x2 * (1.0 / 40_320.0))));
    (sin, cos)
}

/// Uniform on the regular polygon with `blades` corners on the unit circle, the first at angle `rotation`.
#[inline]
pub fn polygon_disc(u: Vec2, blades: u32, rotation: f32) -> Vec2 {
    debug_assert!(blades >= 3, "{blades} blades enclose nothing");
    let scaled = u.x * blades as f32;
    let blade = scaled.floor().min(blades as f32 - 1.0);
    let corner = |k: f32| Vec2::from_angle(rotation + k * TAU / blades as f32);
    let weights = uniform_triangle(Vec2::new(scaled - blade, u.y));
    weights.x * corner(blade) + weights.y * corner(blade + 1.0)
}

/// Cosine-weighted on the hemisphere around +z; density [`cosine_hemisphere_pdf`].
#[inline]
pub fn cosine_hemisphere(u: Vec2) -> Vec3 {
    let p = uniform_disc(u);
    // Rounding may put the point just outside the circle.
    p.extend((1.0 - p.length_squared()).max(0.0).sqrt())
}

/// Per steradian.
#[inline]
pub fn cosine_hemisphere_pdf(cos_theta: f32) -> f32 {
    cos_theta.max(0.0) * (1.0 / PI)
}

/// 1 − cos θ for θ in `[0, π/2]` from sin²θ, exact for small cones where 1 − √(1 − sin²θ) would cancel.
#[inline]
pub fn one_minus_cos_from_sin2(sin2: f32) -> f32 {
    sin2 / (1.0 + (1.0 - sin2).max(0.0).sqrt())
}

/// Uniform in the cone around +z with half angle θ, given as 1 − cos θ; density [`cone_pdf`].
///
/// Returns the direction and 1 − cos of its own angle, which the caller may need without cancellation.
#[inline]
pub fn uniform_cone(u: Vec2, one_minus_cos_max: f32) -> (Vec3, f32) {
    let disc = uniform_disc(u);
    // The radius on the disc squared is uniform, and so is 1 − cos on the cap.
    let r2 = disc.length_squared().min(1.0);
    let one_minus_cos = r2 * one_minus_cos_max;
    let sin_over_r = (one_minus_cos_max * (2.0 - one_minus_cos)).max(0.0).sqrt();
    ((disc * sin_over_r).extend(1.0 - one_minus_cos), one_minus_cos)
}

/// Per steradian.
#[inline]
pub fn cone_pdf(one_minus_cos_max: f32) -> f32 {
    1.0 / (TAU * one_minus_cos_max)
}

/// Barycentric weights of the first two corners of a uniform point in a triangle (Heitz 2019, low distortion).
#[inline]
pub fn uniform_triangle(u: Vec2) -> Vec2 {
    if u.x < u.y {
        let b0 = 0.5 * u.x;
        Vec2::new(b0, u.y - b0)
    } else {
        let b1 = 0.5 * u.y;
        Vec2::new(u.x - b1, b1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sampler;
    use crate::test_statistics::ChiSquared;

    fn points(n: u32) -> impl Iterator<Item = Vec2> {
        // Hashed points, not Sobol': χ² needs independent draws.
        (0..n).map(|i| {
            let sampler = Sampler::new(i, 17, 4, 0);
            sampler.pair(9)
        })
    }

    /// χ² over `counts` with equal expectation; 1 % over 5 cases (Šidák) is 2.9 σ of the normal approximation.
    fn assert_even(name: &str, counts: &[u32]) {
        let expected = f64::from(counts.iter().sum::<u32>()) / counts.len() as f64;
        let counts: Vec<f64> = counts.iter().map(|&count| f64::from(count)).collect();
        ChiSquared::of(&counts, &vec![expected; counts.len()], 0.0).assert_below(2.9, name);
    }

    #[test]
    fn short_series_is_as_good_as_the_library() {
        for i in -1000..=1000 {
            let x = FRAC_PI_4 * i as f32 / 1000.0;
            let (sin, cos) = sin_cos_eighth(x);
            assert!((sin - x.sin()).abs() < 1.5e-7 && (cos - x.cos()).abs() < 1.5e-7, "{x}: {sin} {cos}");
        }
    }

    #[test]
    fn disc_is_even() {
        // Bins of equal area: rings of equal r², sectors of equal angle.
        let mut counts = vec![0; 8 * 16];
        for u in points(64 * 1024) {
            let p = uniform_disc(u);
            let ring = (p.length_squared() * 8.0).min(7.0) as usize;
            let sector = ((p.to_angle() + PI) / TAU * 16.0).min(15.0) as usize;
            counts[ring * 16 + sector] += 1;
        }
        assert_even("disc", &counts);
    }

    #[test]
    fn polygon_is_even_and_inside() {
        let mut inside = 0;
        let mut counts = vec![0; 16 * 16];
        for u in points(64 * 1024) {
            let p = polygon_disc(u, 6, 0.0);
            assert!(p.length() <= 1.0 + 1e-6, "{p} lies outside");
            // The square inscribed in the hexagon.
            let q = (p + Vec2::splat(0.5)) * 16.0;
            if q.min_element() >= 0.0 && q.max_element() < 16.0 {
                counts[q.y as usize * 16 + q.x as usize] += 1;
                inside += 1;
            }
        }
        let share = f64::from(inside) / 65536.0;
        let expected = 1.0 / (1.5 * 3f64.sqrt());
        assert!((share - expected).abs() < 4.0 * (expected * (1.0 - expected) / 65536.0).sqrt(), "share {share}");
        assert_even("polygon", &counts);
    }

    #[test]
    fn hemisphere_is_cosine_weighted() {
        // sin²θ of a cosine-weighted direction is uniform.
        let mut counts = vec![0; 8 * 16];
        for u in points(64 * 1024) {
            let d = cosine_hemisphere(u);
            assert!((d.length() - 1.0).abs() < 1e-6 && d.z >= 0.0);
            let ring = ((1.0 - d.z * d.z) * 8.0).min(7.0) as usize;
            let sector = ((d.truncate().to_angle() + PI) / TAU * 16.0).min(15.0) as usize;
            counts[ring * 16 + sector] += 1;
        }
        assert_even("hemisphere", &counts);
    }

    #[test]
    fn cone_is_even_from_tiny_to_half_sphere() {
        for one_minus_cos_max in [1e-12_f32, 1e-6, 0.01, 1.0] {
            let mut counts = vec![0; 8 * 16];
            for u in points(64 * 1024) {
                let (d, one_minus_cos) = uniform_cone(u, one_minus_cos_max);
                assert!((d.length() - 1.0).abs() < 1e-6);
                let ring = (one_minus_cos / one_minus_cos_max * 8.0).min(7.0) as usize;
                let sector = ((d.truncate().to_angle() + PI) / TAU * 16.0).min(15.0) as usize;
                counts[ring * 16 + sector] += 1;
                // The angle in the plane must say the same as 1 − cos: this fails when either cancels.
                let sin2 = d.truncate().length_squared();
                let from_sin = one_minus_cos_from_sin2(sin2);
                assert!((from_sin - one_minus_cos).abs() <= 2e-3 * one_minus_cos_max, "{from_sin} {one_minus_cos}");
            }
            assert_even("cone", &counts);
        }
    }

    #[test]
    fn triangle_is_even() {
        let mut counts = vec![0; 16];
        for u in points(64 * 1024) {
            let b = uniform_triangle(u);
            assert!(b.min_element() >= 0.0 && b.x + b.y <= 1.0 + 1e-6);
            // Sixteen equal triangles: four rows of 7, 5, 3, 1.
            let (i, j) = ((b.x * 4.0).min(3.0), (b.y * 4.0).min(3.0));
            let upper = (b.x * 4.0).fract() + (b.y * 4.0).fract() > 1.0;
            let row = i as usize;
            let first = [0, 7, 12, 15][row];
            counts[(first + 2 * j as usize + usize::from(upper)).min(15)] += 1;
        }
        assert_even("triangle", &counts);
    }
}
