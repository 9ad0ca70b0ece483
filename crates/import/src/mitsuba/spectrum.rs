//! Spectra: as written, from `.spd` files, and as linear Rec. 709 as Mitsuba's RGB variants have them.
//!
//! Source: <https://mitsuba.readthedocs.io/en/stable/src/generated/plugins_spectra.html>

use crate::mitsuba::graph::Spectrum;
use crate::model::cie::{GREEN, daylight, planck, rgb_of_xyz, xyz_of};
use firstlight_files::input_file::{FileKind, InputFile};
use firstlight_format::error::SceneError;
use glam::DVec3;
use std::path::Path;

/// What a spectrum is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Use {
    /// A share of light, at most 1.
    Reflectance,
    /// A number without an upper limit, such as an index of refraction.
    Factor,
    /// Radiance, intensity or irradiance.
    Emission,
}

/// One number, or `wavelength:value` pairs.
pub(crate) fn parse(text: &str) -> Result<Spectrum, String> {
    let words: Vec<&str> = text.split([' ', ',', '\t', '\r', '\n']).filter(|word| !word.is_empty()).collect();
    let finite = |word: &str| word.trim().parse().ok().filter(|number: &f64| number.is_finite());
    if let [single] = words[..]
        && !single.contains(':')
    {
        return finite(single).map(Spectrum::Uniform).ok_or("a number".to_owned());
    }
    let pair = |word: &&str| {
        let (wavelength, value) = word.split_once(':')?;
        Some((finite(wavelength)?, finite(value)?))
    };
    let pairs: Option<Vec<(f64, f64)>> = words.iter().map(pair).collect();
    sampled(pairs.ok_or("a list of wavelength:value")?)
}

pub(crate) fn sampled(pairs: Vec<(f64, f64)>) -> Result<Spectrum, String> {
    match pairs.len() >= 2 && pairs.is_sorted_by(|a, b| a.0 < b.0) {
        true => Ok(Spectrum::Sampled(pairs.into())),
        false => Err("a spectrum of at least two increasing wavelengths".to_owned()),
    }
}

/// A wavelength in nm and a value per line; lines with `#` are comments.
pub(crate) fn read_file(path: &Path) -> Result<Spectrum, SceneError> {
    let read = InputFile::open(path, FileKind::Library).and_then(InputFile::text);
    let text = read.map_err(|error| SceneError::in_file(path, error.to_string()))?;
    let mut pairs = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or("");
        let mut words = line.split_whitespace().map(str::parse::<f64>);
        match (words.next(), words.next()) {
            (None, _) => {}
            (Some(Ok(wavelength)), Some(Ok(value))) if wavelength.is_finite() && value.is_finite() => {
                pairs.push((wavelength, value));
            }
            _ => return Err(SceneError::at(path, (i + 1, 1), "expected a wavelength in nm and a value")),
        }
    }
    sampled(pairs).map_err(|why| SceneError::in_file(path, format!("is not {why}")))
}

/// Planck's law, W·m⁻²·sr⁻¹·nm⁻¹.
pub(crate) fn blackbody(kelvin: f64) -> Spectrum {
    /// First radiation constant, with the wavelength of [`planck`]'s unit in nm.
    const C1: f64 = 1.191_042_972e20;
    let radiance = |nm: f64| C1 / GREEN.powi(5) * planck(nm, kelvin);
    Spectrum::Sampled((360..=830).map(f64::from).map(|nm| (nm, radiance(nm))).collect())
}

impl Spectrum {
    /// The same times a number.
    pub(crate) fn scaled(&self, factor: f64) -> Self {
        match self {
            Self::Uniform(value) => Self::Uniform(factor * value),
            Self::Sampled(samples) => Self::Sampled(samples.iter().map(|(nm, value)| (*nm, factor * value)).collect()),
        }
    }

    /// Linear Rec. 709.
    pub(crate) fn rgb(&self, of: Use) -> DVec3 {
        match self {
            // Equal energy is no white of Rec. 709.
            Self::Uniform(value) if of == Use::Emission => {
                *value * DVec3::from_array(rgb_of_xyz(DVec3::ONE).to_array())
            }
            Self::Uniform(value) => DVec3::splat(*value),
            Self::Sampled(samples) => {
                let light = if of == Use::Emission { Light::Equal } else { Light::D65 };
                let rgb = DVec3::from_array(linear_rgb(samples, light));
                if of == Use::Reflectance { rgb.min(DVec3::ONE) } else { rgb }
            }
        }
    }
}

/// The light that a spectrum is seen under.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Light {
    /// Equal energy at all wavelengths: of emission.
    Equal,
    /// Daylight, the white of Rec. 709: of reflectance.
    D65,
}

/// The colour of a spectrum that is linear between samples and 0 outside, negative channels as 0. A spectrum of 1 has
/// the luminance 1.
///
/// - `samples`: wavelengths in nm, increasing, with values.
pub(crate) fn linear_rgb(samples: &[(f64, f64)], light: Light) -> [f64; 3] {
    let power = |nm: f64| if light == Light::D65 { daylight(nm) } else { 1.0 };
    let color = xyz_of(|nm| value_at(samples, nm) * power(nm)) / xyz_of(power).y;
    rgb_of_xyz(color).max(DVec3::ZERO).to_array()
}

fn value_at(samples: &[(f64, f64)], wavelength: f64) -> f64 {
    let after = samples.partition_point(|(at, _)| *at <= wavelength);
    match (after.checked_sub(1).map(|i| samples[i]), samples.get(after)) {
        (Some((a, va)), Some(&(b, vb))) => va + (vb - va) * (wavelength - a) / (b - a),
        (Some((a, va)), None) if a == wavelength => va,
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spectra_are_a_number_or_pairs() {
        assert_eq!(parse(" 0.5 "), Ok(Spectrum::Uniform(0.5)));
        assert_eq!(parse("400:0.1, 500:.2"), Ok(Spectrum::Sampled([(400.0, 0.1), (500.0, 0.2)].into())));
        for wrong in ["", "a", "400:1", "500:1 400:1", "400:1 500", "400:nan 500:1"] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn colours_are_those_of_mitsuba() {
        // mi.spectrum_list_to_srgb of Mitsuba 3.9.1, whose sums of a thousand steps are off by as much.
        let grey = parse("400:0.78, 500:0.78, 600:0.78, 700:0.78").unwrap().rgb(Use::Reflectance);
        assert!(grey.abs_diff_eq(DVec3::new(0.77637, 0.77981, 0.77603), 2e-3), "{grey}");
        let light = parse("400:0, 500:8, 600:15.6, 700:18.4").unwrap().rgb(Use::Emission);
        assert!(light.abs_diff_eq(DVec3::new(20.711, 10.855, 2.771), 1e-2), "{light}");
    }

    #[test]
    fn a_grey_surface_in_daylight_is_grey_and_equal_energy_is_not() {
        let flat = [(300.0, 0.5), (900.0, 0.5)];
        for channel in linear_rgb(&flat, Light::D65) {
            assert!((channel - 0.5).abs() < 1e-3, "{channel}");
        }
        // The white of equal energy, (1, 1, 1) in XYZ, is reddish in Rec. 709.
        let equal = linear_rgb(&flat, Light::Equal).map(|channel| 2.0 * channel);
        for (channel, expected) in equal.into_iter().zip([1.2048, 0.9483, 0.9087]) {
            assert!((channel - expected).abs() < 2e-3, "{equal:?}");
        }
    }

    #[test]
    fn outside_of_its_samples_a_spectrum_is_dark() {
        assert_eq!(value_at(&[(400.0, 1.0), (500.0, 3.0)], 450.0), 2.0);
        assert_eq!([399.0, 501.0].map(|at| value_at(&[(400.0, 1.0), (500.0, 3.0)], at)), [0.0; 2]);
        assert_eq!(value_at(&[(400.0, 1.0), (500.0, 3.0)], 500.0), 3.0);
    }
}
