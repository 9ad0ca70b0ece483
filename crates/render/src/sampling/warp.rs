//! Maps from the unit square to discs, hemispheres, cones and triangles, with their pdfs; for one point or sixteen.

use firstlight_simd::{Real, Vector3, select, sin_cos_eighth};
use glam::Vec2;
use std::f32::consts::{FRAC_1_PI, FRAC_PI_4, TAU};

/// Samples the unit disc uniformly; preserves stratification (Shirley and Chiu 1997).
#[inline(always)]
pub(crate) fn uniform_disc<R: Real>([u, v]: [R; 2]) -> [R; 2] {
    let (x, y) = (u * 2.0 - 1.0, v * 2.0 - 1.0);
    // The longer coordinate is the radius; the quotient of the two gives an angle of at most an eighth of a turn to
    // either side.
    let across = y.abs().lt(x.abs());
    let (r, short) = (select(across, x, y), select(across, y, x));
    let divisor = select(r.is_zero(), r.all(1.0), r);
    let (sin, cos) = sin_cos_eighth(short / divisor * FRAC_PI_4);
    let (long, short) = (r * cos, r * sin);
    [select(across, long, short), select(across, short, long)]
}

/// Samples the regular polygon with `blades` corners on the unit circle uniformly, the first corner at angle
/// `rotation`, radians.
#[inline]
pub fn polygon_disc(u: Vec2, blades: u32, rotation: f32) -> Vec2 {
    debug_assert!(blades >= 3, "{blades} blades enclose nothing");
    let scaled = u.x * blades as f32;
    let blade = scaled.floor().min(blades as f32 - 1.0);
    let corner = |k: f32| Vec2::from_angle(rotation + k * TAU / blades as f32);
    let [a, b] = uniform_triangle([scaled - blade, u.y]);
    a * corner(blade) + b * corner(blade + 1.0)
}

/// Samples the hemisphere about +z by cosine; pdf [`cosine_hemisphere_pdf`].
#[inline(always)]
pub(crate) fn cosine_hemisphere<R: Real>(u: [R; 2]) -> Vector3<R> {
    let [x, y] = uniform_disc(u);
    // Rounding may put the point just outside of the circle.
    let z = (x.all(1.0) - (x * x + y * y)).at_least(0.0).sqrt();
    Vector3 { x, y, z }
}

/// Pdf per steradian; 0 below the horizon.
#[inline(always)]
pub fn cosine_hemisphere_pdf<R: Real>(cos_theta: R) -> R {
    cos_theta.at_least(0.0) * FRAC_1_PI
}

/// Returns 1 − cos θ for θ in `[0, π/2]` from sin²θ, accurate for small cones where 1 − √(1 − sin²θ) would cancel.
#[inline(always)]
pub fn one_minus_cos_from_sin2<R: Real>(sin2: R) -> R {
    sin2 / ((sin2.all(1.0) - sin2).at_least(0.0).sqrt() + 1.0)
}

/// Samples the cone about +z with half angle θ, given as 1 − cos θ, uniformly; pdf [`cone_pdf`].
///
/// Returns the direction and 1 − cos of its own angle, without cancellation.
#[inline(always)]
pub fn uniform_cone<R: Real>(u: [R; 2], one_minus_cos_max: R) -> (Vector3<R>, R) {
    let [x, y] = uniform_disc(u);
    // The squared radius on the disc is uniform, and so is 1 − cos on the cap.
    let one_minus_cos = (x * x + y * y).at_most(1.0) * one_minus_cos_max;
    let sin_over_r = (one_minus_cos_max * (-one_minus_cos + 2.0)).at_least(0.0).sqrt();
    (Vector3 { x: x * sin_over_r, y: y * sin_over_r, z: -one_minus_cos + 1.0 }, one_minus_cos)
}

/// Pdf per steradian.
#[inline(always)]
pub fn cone_pdf<R: Real>(one_minus_cos_max: R) -> R {
    one_minus_cos_max.all(1.0) / (one_minus_cos_max * TAU)
}

/// Samples a triangle uniformly; returns the barycentric weights of the first two vertices (Heitz 2019, low
/// distortion).
#[inline(always)]
pub fn uniform_triangle<R: Real>([u, v]: [R; 2]) -> [R; 2] {
    let halves = [u * 0.5, v * 0.5];
    let below = u.lt(v);
    [select(below, halves[0], u - halves[1]), select(below, v - halves[0], halves[1])]
}

/// Point `k` of a two-dimensional low-discrepancy sequence, shifted by `u` on the torus: the R₂ sequence (Roberts 2018).
/// Each point alone is as uniform as `u`; point 0 is `u`.
#[inline(always)]
pub(crate) fn shifted<R: Real>([u, v]: [R; 2], k: u32) -> [R; 2] {
    if k == 0 {
        return [u, v];
    }
    [shifted_by(u, k, 0.754_877_666_246_693), shifted_by(v, k, 0.569_840_290_998_053)]
}

/// The same in one dimension, with the golden ratio.
#[inline(always)]
pub(crate) fn shifted_single<R: Real>(u: R, k: u32) -> R {
    if k == 0 { u } else { shifted_by(u, k, 0.618_033_988_749_895) }
}

#[inline(always)]
fn shifted_by<R: Real>(u: R, k: u32, step: f64) -> R {
    let moved = u + (f64::from(k) * step).fract() as f32;
    let wrapped = select(moved.lt(moved.all(1.0)), moved, moved - 1.0);
    wrapped.at_most(1.0f32.next_down())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Sampler, cosine_hemisphere, uniform_disc};
    use crate::test_statistics::ChiSquared;
    use glam::Vec3;
    use std::f32::consts::PI;

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
                let (d, one_minus_cos) = uniform_cone(u.into(), one_minus_cos_max);
                let d = Vec3::from(d);
                assert!((d.length() - 1.0).abs() < 1e-6);
                let ring = (one_minus_cos / one_minus_cos_max * 8.0).min(7.0) as usize;
                let sector = ((d.truncate().to_angle() + PI) / TAU * 16.0).min(15.0) as usize;
                counts[ring * 16 + sector] += 1;
                // The angle in the plane must agree with 1 − cos: this fails if either cancels.
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
            let b = Vec2::from(uniform_triangle(u.into()));
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
