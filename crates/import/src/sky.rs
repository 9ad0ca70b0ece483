//! A clear sky with the sun, as an environment image. Start reading at [`clear_sky`].
//!
//! Radiance is per nanometre: the mean over the spectrum, weighted by the CIE 1931 observer, as linear Rec. 709. A white
//! diffuse surface in full sun then has a radiance of about 0.5.
//!
//! Sky: Hošek and Wilkie 2012, "An Analytic Model for Full Spectral Sky-Dome Radiance", by the crate `hw-skymodel`.
//! Sun: a fit to Hošek and Wilkie 2013, see `sun_irradiance`.

use firstlight_format::sources::EnvironmentSource;
use firstlight_render::ImageTexture;
use glam::{DVec3, Vec3};
use hw_skymodel::rgb::{Channel, SkyParams, SkyState};
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// Height of the image in texels, half its width: a texel is a third of the sun's diameter.
const HEIGHT: usize = 1024;
const WIDTH: usize = 2 * HEIGHT;

/// Integral of the CIE 1931 ȳ over the wavelength, nm.
const Y_INTEGRAL: f64 = 106.750_259;

/// The image of a clear sky, equirectangular, with the sun above its middle column; `None` for other environments.
///
/// The sun has the radiance that gives its irradiance, over the texels that it covers and by the share of each.
pub fn clear_sky(source: &EnvironmentSource) -> Option<ImageTexture> {
    let &EnvironmentSource::Sky { elevation, turbidity, ground, sun, sky, sun_size, below, .. } = source else {
        return None;
    };
    let height = elevation.to_radians().clamp(0.0, 0.5 * PI);
    let to_sun = DVec3::new(0.0, height.sin(), -height.cos());
    let params = SkyParams {
        elevation: (height as f32).min(std::f32::consts::FRAC_PI_2),
        turbidity: turbidity as f32,
        albedo: ground.0.clamp(Vec3::ZERO, Vec3::ONE).to_array(),
    };
    let state = SkyState::new(&params).ok()?;
    // The sky is symmetric about the plane of the sun.
    let half_row = |y: usize| -> Vec<Vec3> {
        let polar = middle(y, HEIGHT) * PI;
        let radiance = |x: usize| {
            let gamma = direction(x, y).dot(to_sun).clamp(-1.0, 1.0).acos() as f32;
            let of = |channel| state.radiance(polar as f32, gamma, channel).max(0.0);
            Vec3::new(of(Channel::R), of(Channel::G), of(Channel::B)) * (sky / Y_INTEGRAL) as f32
        };
        (0..WIDTH / 2).map(radiance).collect()
    };
    let rows: Vec<Vec<Vec3>> = (0..HEIGHT / 2).into_par_iter().map(half_row).collect();
    let mut texels: Vec<Vec3> = rows.iter().flat_map(|row| row.iter().chain(row.iter().rev())).copied().collect();
    let covered = disc(to_sun, 0.5 * sun_size.to_radians());
    let solid_angle: f64 = covered.iter().map(|(_, y, share)| share * texel_size(*y)).sum();
    let radiance = (sun / solid_angle * sun_irradiance(elevation, turbidity)).as_vec3();
    for (x, y, share) in covered.into_iter().filter(|(_, y, _)| *y < HEIGHT / 2) {
        texels[y * WIDTH + x] += share as f32 * radiance;
    }
    let irradiance: DVec3 = (texels.par_chunks(WIDTH).enumerate())
        .map(|(y, row)| {
            let sum: DVec3 = row.iter().map(|texel| texel.as_dvec3()).sum();
            sum * (middle(y, HEIGHT) * PI).cos() * texel_size(y)
        })
        .collect::<Vec<_>>()
        .into_iter()
        .sum();
    let reflected = if below { ground.0 * (irradiance / PI).as_vec3() } else { Vec3::ZERO };
    texels.resize(WIDTH * HEIGHT, reflected);
    Some(ImageTexture::from_linear(WIDTH as u32, HEIGHT as u32, texels))
}

/// Irradiance by the sun of a surface that faces it, per nanometre.
///
/// A fit to the solar radiance of Hošek and Wilkie 2013, "Adding a Solar-Radiance Function to the Hošek-Wilkie Skylight
/// Model", within 2 % from 10° above the horizon, 4 % from 4°: light that is attenuated by clean air, of a power of the
/// air mass because a channel has many wavelengths, and by aerosols, whose optical depth depends on the turbidity.
///
/// - `elevation`: degrees above the horizon; `turbidity`: 1 to 10.
fn sun_irradiance(elevation: f64, turbidity: f64) -> DVec3 {
    const ABOVE: DVec3 = DVec3::new(1.680, 1.588, 1.444);
    const CLEAN: DVec3 = DVec3::new(0.0658, 0.1732, 0.3189);
    const POWER: DVec3 = DVec3::new(1.0122, 0.8913, 0.9864);
    const AEROSOL: DVec3 = DVec3::new(0.9252, 1.0, 0.9495);
    /// By turbidity, from 1.
    const DEPTHS: [f64; 10] = [0.0, 0.0111, 0.0292, 0.0581, 0.0885, 0.1105, 0.1458, 0.2036, 0.3014, 0.4604];
    let place = (turbidity - 1.0).clamp(0.0, 9.0);
    let (low, high) = (DEPTHS[place.floor() as usize], DEPTHS[place.ceil() as usize]);
    let depth = low + (high - low) * place.fract();
    // Air mass (Kasten 1966).
    let zenith = 90.0 - elevation;
    let mass = 1.0 / (zenith.to_radians().cos() + 0.15 * (93.885 - zenith).powf(-1.253));
    let powers = DVec3::from_array(POWER.to_array().map(|power| mass.powf(power)));
    ABOVE * (-(CLEAN * powers + AEROSOL * (depth * mass))).exp()
}

/// The texels of a disc in the sky, each with its column, its row and the share that is covered.
///
/// - `radius`: radians.
fn disc(middle_of: DVec3, radius: f64) -> Vec<(usize, usize, f64)> {
    /// Along each side of a texel.
    const SAMPLES: usize = 16;
    let reach = radius + 2.0 * PI / HEIGHT as f64;
    let mut covered = Vec::new();
    let (near, inside) = (reach.cos(), radius.cos());
    for y in 0..HEIGHT {
        if (middle(y, HEIGHT) * PI - middle_of.y.acos()).abs() > reach {
            continue;
        }
        for x in (0..WIDTH).filter(|&x| direction(x, y).dot(middle_of) > near) {
            let is_inside = |i: usize| {
                let at = |cell: usize, k: usize| cell as f64 + (k as f64 + 0.5) / SAMPLES as f64 - 0.5;
                direction_at(at(x, i % SAMPLES), at(y, i / SAMPLES)).dot(middle_of) > inside
            };
            let n = (0..SAMPLES * SAMPLES).filter(|&i| is_inside(i)).count();
            if n > 0 {
                covered.push((x, y, n as f64 / (SAMPLES * SAMPLES) as f64));
            }
        }
    }
    covered
}

/// Middle of a texel, 0..1.
fn middle(i: usize, n: usize) -> f64 {
    (i as f64 + 0.5) / n as f64
}

/// Solid angle of a texel, steradians.
fn texel_size(y: usize) -> f64 {
    let polar = |y: usize| (PI * y as f64 / HEIGHT as f64).cos();
    TAU / WIDTH as f64 * (polar(y) - polar(y + 1))
}

fn direction(x: usize, y: usize) -> DVec3 {
    direction_at(x as f64, y as f64)
}

/// The direction of a place in the image, in texels from the middle of the first one.
fn direction_at(x: f64, y: f64) -> DVec3 {
    let ((sin, cos), (sin_polar, cos_polar)) =
        (((x + 0.5) / WIDTH as f64 * TAU - PI).sin_cos(), ((y + 0.5) / HEIGHT as f64 * PI).sin_cos());
    DVec3::new(sin_polar * sin, cos_polar, -sin_polar * cos)
}

#[cfg(test)]
mod tests {
    use super::*;
    use firstlight_format::value::Rgb;

    fn image(elevation: f64, turbidity: f64, albedo: f32, sun: f64, below: bool) -> ImageTexture {
        let sky = EnvironmentSource::Sky {
            elevation,
            azimuth: 0.0,
            turbidity,
            ground: Rgb(Vec3::splat(albedo)),
            sky: 1.0,
            sun,
            sun_size: 0.5358,
            below,
            scale: Rgb(Vec3::ONE),
        };
        clear_sky(&sky).unwrap()
    }

    fn at(image: &ImageTexture, elevation: f64, azimuth: f64) -> Vec3 {
        let x = (azimuth + 180.0) / 360.0 * WIDTH as f64;
        let y = (90.0 - elevation) / 180.0 * HEIGHT as f64;
        image.linear(y as usize * WIDTH + x as usize)
    }

    /// Values of Mitsuba 3.9.1, `sunsky` with `sun_scale` 0.
    #[test]
    fn the_sky_is_that_of_mitsuba() {
        for (elevation, turbidity, albedo, expected) in [
            (60.0, 3.0, 0.3, [[0.03411, 0.06186, 0.12203], [0.03736, 0.07115, 0.13812], [0.14539, 0.19491, 0.24266]]),
            (10.0, 3.0, 0.3, [[0.01644, 0.02905, 0.0444], [0.03094, 0.0487, 0.06617], [0.09202, 0.0995, 0.07098]]),
            (45.0, 6.0, 0.3, [[0.04651, 0.0705, 0.11672], [0.0456, 0.07677, 0.12988], [0.14173, 0.16188, 0.18311]]),
            (45.0, 2.0, 1.0, [[0.03942, 0.07595, 0.14847], [0.05485, 0.10235, 0.18656], [0.22449, 0.31099, 0.36974]]),
        ] {
            let image = image(elevation, turbidity, albedo, 0.0, false);
            for ((elevation, azimuth), expected) in
                [(45.0, 90.0), (30.0, -179.9), (2.0, 120.0)].into_iter().zip(expected)
            {
                let (found, expected) = (at(&image, elevation, azimuth), Vec3::from(expected));
                assert!(((found - expected) / expected).abs().max_element() < 0.02, "{found} for {expected}");
            }
            assert_eq!(at(&image, -30.0, 10.0), Vec3::ZERO);
        }
    }

    /// Values of Mitsuba 3.9.1: radiance of the disc times its solid angle.
    #[test]
    fn the_sun_is_nearly_that_of_mitsuba() {
        for (elevation, turbidity, expected) in [
            (60.0, 3.0, [1.49857, 1.25486, 0.96642]),
            (30.0, 3.0, [1.39251, 1.09547, 0.72928]),
            (10.0, 3.0, [0.99551, 0.60367, 0.21574]),
            (45.0, 6.0, [1.32494, 1.07626, 0.79722]),
            (45.0, 2.0, [1.50011, 1.23494, 0.90822]),
        ] {
            let (found, expected) = (sun_irradiance(elevation, turbidity), DVec3::from_array(expected));
            assert!(((found - expected) / expected).abs().max_element() < 0.02, "{found} for {expected}");
        }
    }

    #[test]
    fn the_sun_gives_its_irradiance_wherever_it_is() {
        for elevation in [1.0, 20.0, 47.3, 89.9, 90.0] {
            let (with, without) = (image(elevation, 4.0, 0.2, 1.0, false), image(elevation, 4.0, 0.2, 0.0, false));
            let sum: DVec3 =
                (0..with.len()).map(|i| (with.linear(i) - without.linear(i)).as_dvec3() * texel_size(i / WIDTH)).sum();
            let expected = sun_irradiance(elevation, 4.0);
            assert!(((sum - expected) / expected).abs().max_element() < 1e-3, "{elevation}: {sum} for {expected}");
        }
    }

    /// The ground is lit by the upper half: its radiance is its albedo times the irradiance over π.
    #[test]
    fn the_ground_reflects_sun_and_sky() {
        let lit = image(40.0, 3.0, 0.5, 1.0, true);
        let sky: f64 = (0..lit.len() / 2)
            .map(|i| f64::from(lit.linear(i).y) * (middle(i / WIDTH, HEIGHT) * PI).cos() * texel_size(i / WIDTH))
            .sum();
        let found = f64::from(at(&lit, -20.0, 0.0).y);
        assert!((found / (0.5 * sky / PI) - 1.0).abs() < 1e-4, "{found}");
        assert!((0.3..0.6).contains(&(sky / PI)), "a white surface is about half white: {sky}");
    }
}
