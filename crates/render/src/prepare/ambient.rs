//! Ambient light of the classic model: irradiance of the environment as a smooth function of the normal, without
//! shadows.
//!
//! Irradiance is so smooth a function of direction that nine coefficients per channel represent it to about one per
//! cent of its mean for any environment, and exactly for constant ones: Ramamoorthi and Hanrahan 2001, "An Efficient
//! Representation for Irradiance Environment Maps".

use crate::core::environment::Environment;
use firstlight_simd::{Real, Vector3};
use glam::{DVec3, Vec3};
use std::f64::consts::{PI, TAU};

/// Irradiance over π: the radiance of a white diffuse surface that sees only the environment.
#[derive(Clone, Debug, Default)]
pub(crate) struct AmbientLight {
    /// Coefficients of spherical harmonics up to degree 2, convolved with the cosine lobe.
    coefficients: [Vec3; 9],
}

impl AmbientLight {
    pub fn of(environment: &Environment) -> Self {
        if matches!(environment, Environment::Black) {
            return Self::default();
        }
        // Uniform in height and azimuth, so that all steps have the same solid angle.
        const HEIGHTS: usize = 128;
        const ANGLES: usize = 256;
        let mut sums = [DVec3::ZERO; 9];
        for i in 0..HEIGHTS * ANGLES {
            let y = 1.0 - 2.0 * ((i / ANGLES) as f64 + 0.5) / HEIGHTS as f64;
            let (sin, cos) = (TAU * ((i % ANGLES) as f64 + 0.5) / ANGLES as f64).sin_cos();
            let r = (1.0 - y * y).sqrt();
            let dir = Vec3::new((r * cos) as f32, y as f32, (r * sin) as f32);
            let radiance = environment.radiance(dir).as_dvec3();
            for (sum, basis) in sums.iter_mut().zip(harmonics(dir.into())) {
                *sum += radiance * f64::from(basis);
            }
        }
        let step = 4.0 * PI / (HEIGHTS * ANGLES) as f64;
        // Factor of the clamped cosine per degree (their equation 8), over π.
        let lobe = |i: usize| [1.0, 2.0 / 3.0, 0.25][usize::from(i > 0) + usize::from(i > 3)];
        let mut coefficients = [Vec3::ZERO; 9];
        for (i, (coefficient, sum)) in coefficients.iter_mut().zip(sums).enumerate() {
            *coefficient = (sum * step * lobe(i)).as_vec3();
        }
        Self { coefficients }
    }

    /// Radiance for a unit normal; never negative.
    #[inline(always)]
    pub fn radiance<R: Real>(&self, normal: Vector3<R>) -> Vector3<R> {
        let nothing = Vector3::in_all(normal.x, Vec3::ZERO);
        let mut sum = nothing;
        for (coefficient, basis) in self.coefficients.iter().zip(harmonics(normal)) {
            sum = sum + Vector3::in_all(basis, *coefficient) * basis;
        }
        sum.max(nothing)
    }
}

/// Real spherical harmonics of degrees 0, 1, 1, 1, 2, 2, 2, 2, 2.
#[inline(always)]
fn harmonics<R: Real>(Vector3 { x, y, z }: Vector3<R>) -> [R; 9] {
    [
        x.all(0.282_094_8),
        y * 0.488_602_5,
        z * 0.488_602_5,
        x * 0.488_602_5,
        x * 1.092_548_4 * y,
        y * 1.092_548_4 * z,
        (z * 3.0 * z - 1.0) * 0.315_391_57,
        x * 1.092_548_4 * z,
        (x * x - y * y) * 0.546_274_2,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Sampler, cosine_hemisphere};
    use firstlight_kdtree::geometry::Frame;

    fn radiance(light: &AmbientLight, normal: Vec3) -> Vec3 {
        light.radiance(normal.into()).into()
    }

    #[test]
    fn constant_surroundings_are_exact() {
        let light = AmbientLight::of(&Environment::Constant(Vec3::new(0.2, 1.0, 3.0)));
        for normal in [Vec3::Y, Vec3::NEG_X, Vec3::new(0.6, 0.0, -0.8)] {
            assert!((radiance(&light, normal) - Vec3::new(0.2, 1.0, 3.0)).abs().max_element() < 1e-3);
        }
        assert_eq!(radiance(&AmbientLight::of(&Environment::Black), Vec3::Y), Vec3::ZERO);
    }

    #[test]
    fn a_sky_gives_what_sampling_it_gives() {
        let sky = Environment::Gradient {
            zenith: Vec3::new(0.2, 0.4, 1.0),
            horizon: Vec3::new(0.9, 0.9, 0.8),
            ground: Vec3::splat(0.25),
        };
        let light = AmbientLight::of(&sky);
        for normal in [Vec3::Y, Vec3::NEG_Y, Vec3::X, Vec3::new(0.48, 0.6, -0.64)] {
            let frame = Frame::around(normal);
            let n = 1 << 14;
            let direction = |i| frame.to_world(cosine_hemisphere(Sampler::new(4, 0, 0, i).pair(0)));
            let sampled: Vec3 = (0..n).map(|i| sky.radiance(direction(i))).sum::<Vec3>() / n as f32;
            let found = radiance(&light, normal);
            assert!((found - sampled).abs().max_element() < 0.03, "{normal}: {found} for {sampled}");
        }
    }
}
