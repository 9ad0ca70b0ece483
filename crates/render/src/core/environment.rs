//! Environments: radiance from infinitely far away.

use crate::core::color::luminance;
use crate::core::texture::ImageTexture;
use crate::sampling::PictureDistribution;
use firstlight_simd::{Elementary, Float, LANES, Mask, Real, Simd, Vector, Vector3, select, select_vector};
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
                let [u, v] = direction_to_uv(dir.into(), *rotation);
                let x = ((u * image.width as f32) as u32).min(image.width - 1);
                let y = ((v * image.height as f32) as u32).min(image.height - 1);
                *scale * image.linear((y * image.width + x) as usize)
            }
        }
    }

    /// Radiance along sixteen directions; texels are read for the lanes of `mask`.
    #[inline(always)]
    pub(crate) fn radiance_lanes<S: Simd>(&self, mask: Mask, dir: Vector<S>) -> Vector<S> {
        let s = dir.x.s;
        match self {
            Self::Black => Vector::splat(s, Vec3::ZERO),
            Self::Constant(radiance) => Vector::splat(s, *radiance),
            Self::Gradient { zenith, horizon, ground } => {
                sky_gradient([Vector::splat(s, *zenith), Vector::splat(s, *horizon), Vector::splat(s, *ground)], dir.y)
            }
            Self::Image { image, scale, rotation } => {
                let [u, v] = direction_to_uv(dir, *rotation);
                let (width, height) = (image.width, image.height);
                let x = (u * width as f32).at_least(0.0).at_most((width - 1) as f32).truncate();
                let y = (v * height as f32).at_least(0.0).at_most((height - 1) as f32).truncate();
                let places = (y * width + x).to_array();
                let mut found = [[0.0; LANES]; 3];
                for lane in (0..LANES).filter(|lane| mask >> lane & 1 != 0) {
                    let light = image.linear(places[lane] as usize);
                    (found[0][lane], found[1][lane], found[2][lane]) = (light.x, light.y, light.z);
                }
                Vector::from_arrays(s, &found).times(Vector::splat(s, *scale))
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
    integral: f64,
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
        let sum: f64 = weights.iter().map(|&weight| f64::from(weight)).sum();
        let integral = sum * f64::from(TAU * PI) / (width * height) as f64;
        Some(Self { distribution, rotation: *rotation, integral })
    }

    /// Integral of the luminance over all directions, W·m⁻².
    pub fn integral(&self) -> f64 {
        self.integral
    }

    /// Samples a unit direction; returns it with its pdf per steradian.
    #[inline]
    pub fn sample(&self, u: Vec2) -> Option<(Vec3, f32)> {
        let (uv, pdf) = self.distribution.sample(u);
        let (dir, sin_theta) = uv_to_direction(uv.to_array(), self.rotation);
        (sin_theta > 0.0).then(|| (dir.into(), pdf / (TAU * PI * sin_theta)))
    }

    /// Sixteen directions and their pdfs, and the lanes that have them.
    #[inline(always)]
    pub fn sample_lanes<S: Simd>(&self, u: [Float<S>; 2]) -> (Mask, Vector<S>, Float<S>) {
        let (uv, pdf) = self.distribution.sample_lanes(u);
        let (dir, sin_theta) = uv_to_direction(uv, self.rotation);
        (sin_theta.is_positive(), dir, pdf / (sin_theta * (TAU * PI)))
    }

    /// Pdf per steradian of sixteen directions.
    #[inline(always)]
    pub fn pdf_lanes<S: Simd>(&self, dir: Vector<S>) -> Float<S> {
        let zero = dir.y.all(0.0);
        let sin_theta = (zero + 1.0 - dir.y * dir.y).at_least(0.0).sqrt();
        let pdf = self.distribution.pdf_lanes(direction_to_uv(dir, self.rotation));
        select(sin_theta.is_positive(), pdf / (sin_theta * (TAU * PI)), zero)
    }

    /// Pdf per steradian.
    #[inline]
    pub fn pdf(&self, dir: Vec3) -> f32 {
        let sin_theta = (1.0 - dir.y * dir.y).max(0.0).sqrt();
        if sin_theta == 0.0 {
            return 0.0;
        }
        self.distribution.pdf(direction_to_uv(dir.into(), self.rotation).into()) / (TAU * PI * sin_theta)
    }
}

/// `v` counts from the top.
#[inline(always)]
fn direction_to_uv<R: Elementary>(Vector3 { x, y, z }: Vector3<R>, rotation: f32) -> [R; 2] {
    let one = y.all(1.0);
    // At the poles any column is right.
    let north = select(x.is_zero() & z.is_zero(), one, -z);
    let u = (x.atan2(north) + rotation) / TAU + 0.5;
    let sin_theta = ((one - y) * (one + y)).at_least(0.0).sqrt();
    [u - u.floor(), sin_theta.atan2(y) / PI]
}

#[inline(always)]
fn uv_to_direction<R: Elementary>([u, v]: [R; 2], rotation: f32) -> (Vector3<R>, R) {
    let (sin_phi, cos_phi) = ((u - 0.5) * TAU - rotation).sin_cos();
    let (sin_theta, cos_theta) = (v * PI).sin_cos();
    (Vector3 { x: sin_theta * sin_phi, y: cos_theta, z: -sin_theta * cos_phi }, sin_theta)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sampler;
    use firstlight_simd::{InstructionSet, dispatch};

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
            let (dir, _) = uv_to_direction(uv.to_array(), 0.7);
            assert!((Vec2::from(direction_to_uv(dir, 0.7)) - uv).length() < 1e-4);
        }
        assert!((Vec2::from(direction_to_uv(Vec3::NEG_Z.into(), 0.0)) - Vec2::splat(0.5)).length() < 1e-6);
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
        assert!((sampler.integral() / integral - 1.0).abs() < 0.02, "{} for {integral}", sampler.integral());
    }

    #[inline(always)]
    fn of_lanes<S: Simd>(
        s: S,
        environment: &(Environment, EnvironmentSampler),
        u: &[[f32; LANES]; 2],
        out: &mut [[f32; LANES]; 8],
    ) {
        let (environment, sampler) = environment;
        let (found, dir, pdf) = sampler.sample_lanes([Float::load(s, &u[0]), Float::load(s, &u[1])]);
        let light = environment.radiance_lanes(Mask::MAX, dir);
        let numbers = [dir.x, dir.y, dir.z, pdf, sampler.pdf_lanes(dir), light.x, light.y, light.z];
        out.iter_mut().zip(numbers).for_each(|(out, number)| *out = number.to_array());
        assert_eq!(found, Mask::MAX);
    }

    #[test]
    fn sixteen_directions_are_sampled_like_one() {
        let environment = sun_and_sky();
        let sampler = EnvironmentSampler::build(&environment).unwrap();
        let both = (environment, sampler);
        let mut n_elsewhere = 0;
        for i in 0..500 {
            let pairs: [Vec2; LANES] = std::array::from_fn(|lane| Sampler::new(i, 0, 0, lane as u32).pair(0));
            let u = [pairs.map(|u| u.x), pairs.map(|u| u.y)];
            let run = |set| {
                let mut out = [[0.0; LANES]; 8];
                let (to, of, u) = (&mut out, &both, &u);
                dispatch!(
                    set,
                    of_lanes(
                        of: &(Environment, EnvironmentSampler),
                        u: &[[f32; LANES]; 2],
                        to: &mut [[f32; LANES]; 8],
                    )
                );
                out
            };
            let out = run(InstructionSet::detect());
            assert!(InstructionSet::available().into_iter().all(|set| run(set) == out));
            for (lane, &u) in pairs.iter().enumerate() {
                let (dir, pdf) = both.1.sample(u).unwrap();
                let [x, y, z, density, again, r, g, b] = out.map(|lanes| lanes[lane]);
                assert!((Vec3::new(x, y, z) - dir).length() < 1e-5, "{dir}");
                assert!((density / pdf - 1.0).abs() < 1e-4, "{density} for {pdf}");
                // Rounding may put a direction at the edge of a texel into the next one.
                let light = both.0.radiance(dir);
                let is_here = (Vec3::new(r, g, b) - light).length() < 1e-4 && (again / pdf - 1.0).abs() < 0.02;
                n_elsewhere += u32::from(!is_here);
            }
        }
        assert!(n_elsewhere < 16, "{n_elsewhere}");
    }
}
