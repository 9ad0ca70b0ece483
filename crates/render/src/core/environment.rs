//! Environments: radiance from infinitely far away.

use crate::core::color::luminance;
use crate::core::texture::ImageTexture;
use crate::sampling::PictureDistribution;
use firstlight_simd::{Real, Vector3, select_vector};
use glam::{Vec2, Vec3};
use std::f32::consts::{PI, TAU};
use std::sync::Arc;

/// Radiance that arrives from outside of the scene, W·m⁻²·sr⁻¹.
#[derive(Clone, Debug, Default)]
pub enum Environment {
    /// No light from outside.
    #[default]
    Black,
    /// The same radiance from every direction.
    Constant(Vec3),
    /// A smooth gradient: `horizon` to `zenith` above, `ground` below.
    Gradient {
        /// Radiance from straight above (+Y).
        zenith: Vec3,
        /// Radiance from just above the horizon.
        horizon: Vec3,
        /// Radiance from everywhere below the horizon.
        ground: Vec3,
    },
    /// Equirectangular image: its centre column is at −Z, its top row at +Y.
    Image {
        /// The image, which `scale` converts to radiance.
        image: Arc<ImageTexture>,
        /// Radiance of a texel of value 1, per channel.
        scale: Vec3,
        /// Rotation in radians about +Y.
        rotation: f32,
    },
}

impl Environment {
    /// Radiance arriving along `dir` (unit, from the scene outwards).
    #[inline]
    pub fn radiance(&self, dir: Vec3) -> Vec3 {
        match self {
            Self::Black => Vec3::ZERO,
            Self::Constant(radiance) => *radiance,
            Self::Gradient { zenith, horizon, ground } => {
                sky_gradient([*zenith, *horizon, *ground].map(Vector3::from), dir.y).into()
            }
            Self::Image { image, scale, rotation } => {
                let uv = direction_to_uv(dir, *rotation);
                let x = ((uv.x * image.width as f32) as u32).min(image.width - 1);
                let y = ((uv.y * image.height as f32) as u32).min(image.height - 1);
                *scale * image.linear((y * image.width + x) as usize)
            }
        }
    }
}

/// Returns the radiance of a gradient (zenith, horizon, ground) in a direction whose height is `y`.
#[inline(always)]
pub(crate) fn sky_gradient<R: Real>([zenith, horizon, ground]: [Vector3<R>; 3], y: R) -> Vector3<R> {
    // The air mass is largest at the horizon: most of the change lies in its lowest quarter.
    let rest = -y + 1.0;
    let share = -(rest * rest * rest) + 1.0;
    let above = horizon * (-share + 1.0) + zenith * share;
    select_vector(y.is_negative(), ground, above)
}

/// Importance sampling of an environment image.
///
/// Smooth environments need none: BSDF sampling finds them as well, and costs no shadow ray.
#[derive(Debug)]
pub(crate) struct EnvironmentSampler {
    distribution: PictureDistribution,
    rotation: f32,
}

impl EnvironmentSampler {
    pub fn build(environment: &Environment) -> Option<Self> {
        let Environment::Image { image, scale, rotation } = environment else { return None };
        let (width, height) = (image.width as usize, image.height as usize);
        let weights: Vec<f32> = (0..width * height)
            .map(|i| {
                let sin_theta = (PI * ((i / width) as f32 + 0.5) / height as f32).sin();
                luminance(*scale * image.linear(i)).max(0.0) * sin_theta
            })
            .collect();
        let distribution = PictureDistribution::new(width, height, &weights)?;
        Some(Self { distribution, rotation: *rotation })
    }

    /// Samples a unit direction; returns it with its pdf per steradian.
    #[inline]
    pub fn sample(&self, u: Vec2) -> Option<(Vec3, f32)> {
        let (uv, pdf) = self.distribution.sample(u);
        let (dir, sin_theta) = uv_to_direction(uv, self.rotation);
        (sin_theta > 0.0).then(|| (dir, pdf / (TAU * PI * sin_theta)))
    }

    /// Pdf per steradian.
    #[inline]
    pub fn pdf(&self, dir: Vec3) -> f32 {
        let sin_theta = (1.0 - dir.y * dir.y).max(0.0).sqrt();
        if sin_theta == 0.0 {
            return 0.0;
        }
        self.distribution.pdf(direction_to_uv(dir, self.rotation)) / (TAU * PI * sin_theta)
    }
}

/// `v` counts from the top.
#[inline]
fn direction_to_uv(dir: Vec3, rotation: f32) -> Vec2 {
    let u = 0.5 + (dir.x.atan2(-dir.z) + rotation) / TAU;
    Vec2::new(u - u.floor(), dir.y.clamp(-1.0, 1.0).acos() / PI)
}

#[inline]
fn uv_to_direction(uv: Vec2, rotation: f32) -> (Vec3, f32) {
    let (sin_phi, cos_phi) = ((uv.x - 0.5) * TAU - rotation).sin_cos();
    let (sin_theta, cos_theta) = (uv.y * PI).sin_cos();
    (Vec3::new(sin_theta * sin_phi, cos_theta, -sin_theta * cos_phi), sin_theta)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sampler;

    fn sun_and_sky() -> Environment {
        let (width, height) = (32, 16);
        let texels = (0..width * height)
            .map(|i| if i == 5 * width + 9 { Vec3::splat(500.0) } else { Vec3::new(0.2, 0.3, 0.5) })
            .collect();
        let image = Arc::new(ImageTexture::from_linear(width, height, texels));
        Environment::Image { image, scale: Vec3::splat(2.0), rotation: 0.7 }
    }

    #[test]
    fn coordinates_and_directions_are_inverse() {
        for i in 0..100 {
            let uv = Sampler::new(i, 0, 0, 0).pair(0) * 0.98 + Vec2::splat(0.01);
            let (dir, _) = uv_to_direction(uv, 0.7);
            assert!((direction_to_uv(dir, 0.7) - uv).length() < 1e-4);
        }
        assert!((direction_to_uv(Vec3::NEG_Z, 0.0) - Vec2::splat(0.5)).length() < 1e-6);
    }

    #[test]
    fn sampling_integrates_the_picture() {
        let environment = sun_and_sky();
        let sampler = EnvironmentSampler::build(&environment).unwrap();
        // ∫ L dω by uniform steps against the sampled estimate; the pdf must integrate to one.
        let (n, mut integral, mut pdf_integral) = (2000, 0.0_f64, 0.0_f64);
        for i in 0..n * n {
            let (z, phi) = (1.0 - 2.0 * ((i % n) as f32 + 0.5) / n as f32, TAU * ((i / n) as f32 + 0.5) / n as f32);
            let r = (1.0 - z * z).sqrt();
            let dir = Vec3::new(r * phi.cos(), z, r * phi.sin());
            let solid_angle = 4.0 * std::f64::consts::PI / f64::from(n * n);
            integral += f64::from(luminance(environment.radiance(dir))) * solid_angle;
            pdf_integral += f64::from(sampler.pdf(dir)) * solid_angle;
        }
        assert!((pdf_integral - 1.0).abs() < 0.02, "{pdf_integral}");
        let samples = 1 << 14;
        let mut sum = 0.0;
        for i in 0..samples {
            let (dir, pdf) = sampler.sample(Sampler::new(3, 0, 0, i).pair(0)).unwrap();
            assert!((sampler.pdf(dir) / pdf - 1.0).abs() < 0.02);
            sum += f64::from(luminance(environment.radiance(dir)) / pdf) / f64::from(samples);
        }
        assert!((sum / integral - 1.0).abs() < 0.02, "{sum} for {integral}");
    }
}
