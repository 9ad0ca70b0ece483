//! Rectangles seen from a point: their solid angle, and uniform sampling of it; for one point or sixteen.

use firstlight_simd::{Elementary, Real, Vector3, select};

/// A rectangle seen from a reference point, prepared for sampling by solid angle.
///
/// Source: Ureña, Fajardo and King 2013, "An Area-Preserving Parametrization for Spherical Rectangles". The solid
/// angle comes from van Oosterom and Strackee 1983 instead: a sum of four angles less 2π cancels when it is small.
#[derive(Clone, Copy, Debug)]
pub struct SphericalQuad<R> {
    /// First and opposite corner in the frame of the rectangle, relative to the reference point; `z` is not positive.
    x0: R,
    y0: R,
    z0: R,
    x1: R,
    y1: R,
    solid_angle: R,
}

impl<R: Elementary> SphericalQuad<R> {
    /// Prepares a rectangle.
    ///
    /// - `corner`: the first corner along the sides and the normal, relative to the reference point; on either side of
    ///   the plane;
    /// - `lengths`: of the sides, metres; `area`: their product.
    #[inline(always)]
    pub fn new(corner: Vector3<R>, [length_u, length_v]: [R; 2], area: R) -> Self {
        let (x0, y0, z0) = (corner.x, corner.y, -corner.z.abs());
        let (x1, y1) = (x0 + length_u, y0 + length_v);
        // In units of the distance to the first corner, so that products of six lengths stay in range.
        let unit = x0.all(1.0) / (x0 * x0 + y0 * y0 + z0 * z0).sqrt().at_least(f32::MIN_POSITIVE);
        let (ax, ay, bx, by, z) = (x0 * unit, y0 * unit, x1 * unit, y1 * unit, z0 * unit);
        let corner = [
            Vector3 { x: ax, y: ay, z },
            Vector3 { x: bx, y: ay, z },
            Vector3 { x: bx, y: by, z },
            Vector3 { x: ax, y: by, z },
        ];
        let length = [corner[0].length(), corner[1].length(), corner[2].length(), corner[3].length()];
        // The triple product of both halves: accurate to rounding, however small the rectangle appears.
        let triple = area * unit * unit * -z;
        let first = half(&corner, &length, [0, 1, 2]);
        let second = half(&corner, &length, [0, 2, 3]);
        // Each half is twice the angle of (denominator, triple); their product as complex numbers adds the angles.
        let solid_angle = (triple * (first + second)).atan2(first * second - triple * triple) * 2.0;
        Self { x0, y0, z0, x1, y1, solid_angle }
    }

    /// Solid angle in steradians.
    #[inline(always)]
    pub fn solid_angle(&self) -> R {
        self.solid_angle
    }

    /// Samples a direction uniformly in solid angle; returns its intersection with the rectangle, `[0, 1]²` along its
    /// sides.
    #[inline(always)]
    pub fn sample(&self, [u, v]: [R; 2]) -> [R; 2] {
        let Self { x0, y0, z0, x1, y1, solid_angle } = *self;
        let one = x0.all(1.0);
        // Heights of the four edge planes' normals; the angles between them are those of the spherical rectangle. For
        // each, 1 − height² is known without cancellation.
        let z2 = z0 * z0;
        let ((h0, r0), (b1, r1), (h3, r3)) = (height(z2, y0), height(z2, y1), height(z2, x0));
        let (b0, n3) = (-h0, -h3);
        // Cosine and sine of the two angles at the far side of x0, and of their sum.
        let (cos_2, sin_2) = (-(b1 * n3), (r1 + b1 * b1 * r3).sqrt());
        let (cos_3, sin_3) = (-(n3 * b0), (r0 + b0 * b0 * r3).sqrt());
        let (cos_sum, sin_sum) = (cos_2 * cos_3 - sin_2 * sin_3, sin_2 * cos_3 + cos_2 * sin_3);
        // The slice of the required area ends at the plane with angle u · area − sum (mod 2π).
        let (sin_part, cos_part) = (u * solid_angle).sin_cos();
        let cos_au = cos_part * cos_sum + sin_part * sin_sum;
        let sin_au = sin_part * cos_sum - cos_part * sin_sum;
        // cos · b0 − b1: all three may be near 1, and then only their differences to 1 distinguish them.
        let product = cos_au * b0;
        let (lack_0, lack_1) = (r0 / (b0.abs() + 1.0), r1 / (b1.abs() + 1.0));
        let lack_au = sin_au * sin_au / (cos_au.abs() + 1.0);
        let lacking = (lack_1 - lack_0 - lack_au + lack_0 * lack_au) * one.copysign(b1);
        let difference = select((product * b1).is_positive(), lacking, product - b1);
        let fu = difference / sin_au;
        // Intersection of that plane with the rectangle: cu = ±1 / √(fu² + b0²), written so that 1 − cu² does not
        // cancel. NaN becomes the lower end.
        let xu = (-z0).copysign(fu) / (fu * fu - r0).at_least(f32::MIN_POSITIVE).sqrt();
        let xu = xu.max(x0).min(x1);
        let d2 = xu * xu + z2;
        let h0 = y0 / (d2 + y0 * y0).sqrt();
        let h1 = y1 / (d2 + y1 * y1).sqrt();
        let hv = h0 + v * (h1 - h0);
        let hv2 = hv * hv;
        let yv = hv * d2.sqrt() / (one - hv2).sqrt();
        let yv = select(hv2.lt(one.all(1.0 - 1e-6)), yv, y1);
        [(xu - x0) / (x1 - x0), (yv.max(y0).min(y1) - y0) / (y1 - y0)]
    }
}

/// Denominator of the solid angle of half of the rectangle.
#[inline(always)]
fn half<R: Real>(corner: &[Vector3<R>; 4], length: &[R; 4], [p, q, r]: [usize; 3]) -> R {
    let (a, b, c) = (corner[p], corner[q], corner[r]);
    let (la, lb, lc) = (length[p], length[q], length[r]);
    la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb
}

/// Height of an edge plane's normal, and 1 − height².
#[inline(always)]
fn height<R: Real>(z2: R, y: R) -> (R, R) {
    let h2 = z2 + y * y;
    (y / h2.sqrt(), z2 / h2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Vec2, Vec3};

    fn quad(corner: Vec3, u: Vec3, v: Vec3) -> SphericalQuad<f32> {
        let (unit_u, unit_v) = (u.normalize(), v.normalize());
        let corner = Vec3::new(corner.dot(unit_u), corner.dot(unit_v), corner.dot(unit_u.cross(unit_v)));
        SphericalQuad::new(corner.into(), [u.length(), v.length()], u.length() * v.length())
    }

    /// Solid angle in f64 by numerical integration.
    fn solid_angle_by_parts(corner: Vec3, u: Vec3, v: Vec3) -> f64 {
        let (corner, u, v) = (corner.as_dvec3(), u.as_dvec3(), v.as_dvec3());
        let n = 400;
        let normal = u.cross(v);
        let mut sum = 0.0;
        for i in 0..n * n {
            let (a, b) = ((f64::from(i % n) + 0.5) / f64::from(n), (f64::from(i / n) + 0.5) / f64::from(n));
            let p = corner + a * u + b * v;
            sum += p.dot(normal).abs() / p.length().powi(3);
        }
        sum / f64::from(n * n)
    }

    const CASES: [(Vec3, Vec3, Vec3); 5] = [
        (Vec3::new(-0.5, -0.5, -1.0), Vec3::X, Vec3::Y),
        (Vec3::new(2.0, 1.0, 0.5), Vec3::new(0.0, 0.0, 1.5), Vec3::new(0.0, 2.0, 0.0)),
        (Vec3::new(-3.0, 0.2, 1.0), Vec3::new(6.0, 0.0, 0.0), Vec3::new(0.0, 0.0, 2.0)),
        (Vec3::new(40.0, -30.0, 25.0), Vec3::new(0.6, 0.8, 0.0), Vec3::new(-0.8, 0.6, 0.0)),
        (Vec3::new(1000.0, 900.0, 800.0), Vec3::X, Vec3::Z),
    ];

    #[test]
    fn solid_angle_matches_the_sum_of_small_pieces() {
        for (corner, u, v) in CASES {
            let quad = quad(corner, u, v);
            let expected = solid_angle_by_parts(corner, u, v);
            let relative = (f64::from(quad.solid_angle()) - expected) / expected;
            assert!(relative.abs() < 2e-4, "{corner}: {} for {expected}", quad.solid_angle());
        }
    }

    #[test]
    fn points_follow_the_solid_angle() {
        for (corner, u, v) in &CASES[..4] {
            let quad = quad(*corner, *u, *v);
            // Stratified samples; their share in each cell against the cell's solid angle.
            let (n, cells) = (512, 4);
            let mut counts = [0.0f64; 16];
            for i in 0..n * n {
                let p = Vec2::from(quad.sample([((i % n) as f32 + 0.5) / n as f32, ((i / n) as f32 + 0.5) / n as f32]));
                let cell = (p * cells as f32).as_uvec2().min(glam::UVec2::splat(cells - 1));
                counts[(cell.y * cells + cell.x) as usize] += 1.0 / f64::from(n * n);
            }
            let total = solid_angle_by_parts(*corner, *u, *v);
            for (i, count) in counts.iter().enumerate() {
                let (x, y) = ((i as u32 % cells) as f32, (i as u32 / cells) as f32);
                let s = 1.0 / cells as f32;
                let part = solid_angle_by_parts(*corner + x * s * *u + y * s * *v, s * *u, s * *v) / total;
                assert!((count - part).abs() < 2e-3, "{corner}, cell {i}: {count} for {part}");
            }
        }
    }

    /// Mean direction over the solid angle in f64: half the sum of edge angle times edge normal, over the angle.
    fn mean_direction(corner: Vec3, u: Vec3, v: Vec3, solid_angle: f64) -> glam::DVec3 {
        let (corner, u, v) = (corner.as_dvec3(), u.as_dvec3(), v.as_dvec3());
        let corners = [corner, corner + u, corner + u + v, corner + v];
        let facing = corner.dot(u.cross(v)).signum();
        (0..4)
            .map(|i| {
                let (p, q) = (corners[i], corners[(i + 1) % 4]);
                let cross = p.cross(q);
                0.5 * cross.length().atan2(p.dot(q)) * cross.normalize()
            })
            .sum::<glam::DVec3>()
            * facing
            / solid_angle
    }

    #[test]
    fn directions_are_right_even_close_to_the_plane_of_the_rectangle() {
        for z in [1.0_f32, 0.1, 0.01, 1e-3, 1e-4, 1e-5] {
            // In front of it, beside it, beyond its corner.
            for corner in [Vec3::new(-0.7, -1.2, -z), Vec3::new(0.2, -0.4, -z), Vec3::new(z, 0.1, -z)] {
                let quad = quad(corner, Vec3::X * 2.0, Vec3::Y * 2.0);
                if quad.solid_angle() < 1e-3 {
                    continue;
                }
                let n = 512;
                let mut sum = glam::DVec3::ZERO;
                for i in 0..n * n {
                    let u = Vec2::new((i % n) as f32 + 0.5, (i / n) as f32 + 0.5) / n as f32;
                    let p = Vec2::from(quad.sample(u.to_array()));
                    sum += (corner + 2.0 * p.extend(0.0)).as_dvec3().normalize() / f64::from(n * n);
                }
                let expected = mean_direction(corner, Vec3::X * 2.0, Vec3::Y * 2.0, f64::from(quad.solid_angle()));
                let error = (sum - expected).length();
                assert!(error < 1e-3, "{corner}: {sum} for {expected}");
            }
        }
    }
}
