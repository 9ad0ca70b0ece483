//! Spectra of pbrt as linear Rec. 709 colours.
//!
//! A reflectance becomes the colour of a surface in daylight (D65), a light the colour of its chromaticity with the
//! luminance that pbrt gives it. pbrt divides every light by the luminance of its spectrum, so that `rgb L [1 1 1]`,
//! `blackbody L 6500` and `spectrum L "stdillum-D65"` all have luminance 1; and its film (`sensor "cie1931"`) shows
//! luminance 1 as 1.

use crate::model::cie::{daylight, planck, rgb_of_xyz, xyz_of};
use crate::pbrt::named_spectra::{conductor_data, glass_data};
use glam::DVec3;

/// A spectrum as a parameter says it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Spectrum {
    /// Linear Rec. 709.
    Rgb(DVec3),
    /// Wavelengths in nm, ascending, with their values.
    Sampled(Vec<(f64, f64)>),
    /// Temperature, kelvins.
    Blackbody(f64),
    /// One of pbrt's own, or the name of a file.
    Named(String),
}

/// A spectrum that is not known.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct UnknownSpectrum(pub String);

impl Spectrum {
    /// The share of light that is reflected or transmitted.
    pub(crate) fn albedo(&self) -> Result<DVec3, UnknownSpectrum> {
        let color = match self {
            Self::Rgb(rgb) => *rgb,
            Self::Sampled(samples) => albedo_of(|nm| interpolated(samples, nm)),
            Self::Blackbody(_) => return Err(UnknownSpectrum("blackbody".to_owned())),
            Self::Named(name) => return Err(UnknownSpectrum(name.clone())),
        };
        Ok(color.clamp(DVec3::ZERO, DVec3::ONE))
    }

    /// The radiance of a light, before factors such as `scale`.
    pub(crate) fn light(&self) -> Result<DVec3, UnknownSpectrum> {
        let color = match self {
            Self::Rgb(rgb) => *rgb,
            Self::Sampled(samples) => light_of(|nm| interpolated(samples, nm)),
            Self::Blackbody(kelvins) => light_of(|nm| planck(nm, *kelvins)),
            Self::Named(name) => match name.as_str() {
                "stdillum-D65" => DVec3::ONE,
                // Illuminant A is a black body of this temperature.
                "stdillum-A" => light_of(|nm| planck(nm, 2856.0)),
                _ => return Err(UnknownSpectrum(name.clone())),
            },
        };
        Ok(if color.is_finite() { color.max(DVec3::ZERO) } else { DVec3::ZERO })
    }

    /// A quantity for each of red, green and blue, such as an absorption coefficient.
    pub(crate) fn quantity(&self) -> Result<DVec3, UnknownSpectrum> {
        match self {
            Self::Rgb(rgb) => Ok(*rgb),
            Self::Sampled(samples) => Ok(albedo_of(|nm| interpolated(samples, nm)).max(DVec3::ZERO)),
            Self::Blackbody(_) => Err(UnknownSpectrum("blackbody".to_owned())),
            Self::Named(name) => Err(UnknownSpectrum(name.clone())),
        }
    }

    /// Index of refraction at 587.6 nm and dispersion (20 / Abbe number).
    pub(crate) fn ior(&self) -> Result<(f64, f64), UnknownSpectrum> {
        match self {
            Self::Rgb(rgb) => Ok((rgb.y, 0.0)),
            Self::Sampled(samples) => {
                // The Fraunhofer lines F, d and C.
                let [blue, yellow, red] = [486.1, 587.6, 656.3].map(|nm| interpolated(samples, nm));
                Ok((yellow, (20.0 * (blue - red) / (yellow - 1.0)).max(0.0)))
            }
            Self::Blackbody(_) => Err(UnknownSpectrum("blackbody".to_owned())),
            Self::Named(name) => glass_data(name).ok_or_else(|| UnknownSpectrum(name.clone())),
        }
    }
}

/// Index of refraction and extinction coefficient of a conductor, per channel.
///
/// Colours are used channel by channel. Of spectra, the reflectance at normal incidence is integrated wavelength by
/// wavelength; the index is that of a wavelength of the channel, and the coefficient gives that reflectance.
pub(crate) fn conductor_index(eta: &Spectrum, k: &Spectrum) -> Result<(DVec3, DVec3), UnknownSpectrum> {
    if let (Spectrum::Rgb(eta), Spectrum::Rgb(k)) = (eta, k) {
        return Ok((*eta, *k));
    }
    // Every name is tried before the integral.
    let index = DVec3::new(at(eta, true, 610.0)?, at(eta, true, 550.0)?, at(eta, true, 460.0)?);
    at(k, false, 550.0)?;
    let reflectance = |nm: f64| normal_reflectance(at(eta, true, nm).unwrap_or(1.0), at(k, false, nm).unwrap_or(0.0));
    let r = albedo_of(reflectance).clamp(DVec3::ZERO, DVec3::splat(0.9999));
    let (plus, minus) = ((index + 1.0) * (index + 1.0), (index - 1.0) * (index - 1.0));
    Ok((index, ((r * plus - minus) / (1.0 - r)).max(DVec3::ZERO).map(f64::sqrt)))
}

/// A spectrum of a conductor at a wavelength in nm: its index of refraction or its extinction coefficient.
fn at(spectrum: &Spectrum, is_eta: bool, nm: f64) -> Result<f64, UnknownSpectrum> {
    match spectrum {
        // Any smooth spectrum of this colour is as good as another.
        Spectrum::Rgb(rgb) => Ok(match nm {
            ..490.0 => rgb.z,
            490.0..590.0 => rgb.y,
            _ => rgb.x,
        }),
        Spectrum::Sampled(samples) => Ok(interpolated(samples, nm)),
        Spectrum::Blackbody(_) => Err(UnknownSpectrum("blackbody".to_owned())),
        Spectrum::Named(name) => {
            // Version 3 names a file of its scenes instead, such as `spds/Au.eta.spd`.
            let file = name.strip_suffix(".spd").map(|path| path.rsplit('/').next().unwrap_or(path));
            let ends = if is_eta { ["-eta", ".eta"] } else { ["-k", ".k"] };
            let data = match file {
                Some(file) => file.strip_suffix(ends[1]),
                None => name.strip_prefix("metal-").and_then(|name| name.strip_suffix(ends[0])),
            };
            let data = data.and_then(conductor_data).ok_or_else(|| UnknownSpectrum(name.clone()))?;
            let column = |&(nm, eta, k): &(f64, f64, f64)| (nm, if is_eta { eta } else { k });
            Ok(interpolated(&data.iter().map(column).collect::<Vec<_>>(), nm))
        }
    }
}

/// Fresnel reflectance of an interface from air at normal incidence.
pub(crate) fn normal_reflectance(eta: f64, k: f64) -> f64 {
    let k2 = k * k;
    let reflectance = ((eta - 1.0).powi(2) + k2) / ((eta + 1.0).powi(2) + k2);
    if reflectance.is_finite() { reflectance.clamp(0.0, 1.0) } else { 0.0 }
}

/// Colour of a surface with this reflectance, in daylight; a white one is (1, 1, 1).
fn albedo_of(reflectance: impl Fn(f64) -> f64) -> DVec3 {
    let white = xyz_of(daylight);
    rgb_of_xyz(xyz_of(|nm| daylight(nm) * reflectance(nm)) / white.y)
}

/// Colour of a light of luminance 1 with this spectrum.
fn light_of(spectrum: impl Fn(f64) -> f64) -> DVec3 {
    let xyz = xyz_of(spectrum);
    if xyz.y > 0.0 { rgb_of_xyz(xyz / xyz.y).max(DVec3::ZERO) } else { DVec3::ZERO }
}

/// Luminance of a black body whose spectrum has a peak of 1, beside one that is 1 everywhere.
pub(crate) fn peak_luminance(kelvins: f64) -> f64 {
    /// Wien's displacement constant, nm·K (CODATA 2018).
    const WIEN: f64 = 2.897_771_955e6;
    let peak = planck(WIEN / kelvins, kelvins);
    let luminance = xyz_of(|nm| planck(nm, kelvins) / peak).y / xyz_of(|_| 1.0).y;
    if luminance.is_finite() { luminance } else { 0.0 }
}

/// Linear between samples, constant beyond them.
fn interpolated(samples: &[(f64, f64)], nm: f64) -> f64 {
    let next = samples.partition_point(|(wavelength, _)| *wavelength < nm);
    match (next.checked_sub(1).and_then(|i| samples.get(i)), samples.get(next)) {
        (Some((a, at_a)), Some((b, at_b))) => at_a + (at_b - at_a) * (nm - a) / (b - a),
        (Some((_, value)), None) | (None, Some((_, value))) => *value,
        (None, None) => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn conductor_reflectance(eta: &Spectrum, k: &Spectrum) -> Result<DVec3, UnknownSpectrum> {
        let (eta, k) = conductor_index(eta, k)?;
        let channel = |i: usize| normal_reflectance(eta[i], k[i]);
        Ok(DVec3::new(channel(0), channel(1), channel(2)))
    }

    fn near(found: DVec3, expected: DVec3, tolerance: f64) {
        assert!((found - expected).abs().max_element() < tolerance, "{found} for {expected}");
    }

    #[test]
    fn white_is_white_however_it_is_said() {
        near(Spectrum::Sampled(vec![(400.0, 0.5), (700.0, 0.5)]).albedo().unwrap(), DVec3::splat(0.5), 2e-3);
        near(Spectrum::Named("stdillum-D65".to_owned()).light().unwrap(), DVec3::ONE, 1e-12);
        // A black body of 6504 K is nearly daylight.
        near(Spectrum::Blackbody(6504.0).light().unwrap(), DVec3::ONE, 0.05);
    }

    #[test]
    fn black_bodies_have_luminance_one_and_the_colour_of_their_temperature() {
        let luminance = DVec3::new(0.2126, 0.7152, 0.0722);
        // Chromaticities of the Planckian locus (Wyszecki and Stiles 1982, table 1(3.11)).
        for (kelvins, x, y) in [(3000.0, 0.4369, 0.4041), (5000.0, 0.3451, 0.3516), (10000.0, 0.2807, 0.2884)] {
            let rgb = Spectrum::Blackbody(kelvins).light().unwrap();
            assert!((rgb.dot(luminance) - 1.0).abs() < 2e-3, "{rgb}");
            near(rgb, rgb_of_xyz(DVec3::new(x / y, 1.0, (1.0 - x - y) / y)), 8e-3);
        }
    }

    #[test]
    fn lights_have_luminance_one_whatever_the_unit_of_their_spectrum() {
        let light = |factor: f64| Spectrum::Sampled(vec![(400.0, factor), (700.0, 2.0 * factor)]).light().unwrap();
        near(light(1.0), light(1e3), 1e-12);
        assert!(light(1.0).x > light(1.0).z);
    }

    #[test]
    fn metals_have_the_reflectance_of_their_handbooks() {
        let named = |name: &str| {
            let part = |end| Spectrum::Named(format!("metal-{name}-{end}"));
            conductor_reflectance(&part("eta"), &part("k")).unwrap()
        };
        // Handbook of Chemistry and Physics: reflectance at 650, 550 and 450 nm, of which a colour is a mean.
        near(named("Ag"), DVec3::new(0.97, 0.96, 0.92), 0.06);
        near(named("Al"), DVec3::new(0.91, 0.92, 0.92), 0.02);
        near(named("Au"), DVec3::new(0.99, 0.77, 0.34), 0.06);
        near(named("Cu"), DVec3::new(0.95, 0.64, 0.54), 0.05);
        let by_channel = conductor_reflectance(
            &Spectrum::Rgb(DVec3::new(0.200438, 0.924033, 1.102212)),
            &Spectrum::Rgb(DVec3::new(3.912949, 2.452848, 2.142188)),
        );
        near(by_channel.unwrap(), DVec3::new(0.952_4, 0.619_7, 0.510_7), 0.02);
        let unknown = Spectrum::Named("metal-Unobtainium-k".to_owned());
        assert!(conductor_reflectance(&Spectrum::Rgb(DVec3::ONE), &unknown).is_err());
    }

    #[test]
    fn glass_has_the_index_of_its_catalogue() {
        let (ior, dispersion) = Spectrum::Named("glass-BK7".to_owned()).ior().unwrap();
        assert!((ior - 1.5168).abs() < 1e-4 && (20.0 / dispersion - 64.17).abs() < 0.01);
        // Cauchy's equation for a made-up glass: n = 1.5 + 5000 nm² / λ².
        let samples = (40..=70).map(|i| 10.0 * f64::from(i)).map(|nm| (nm, 1.5 + 5000.0 / (nm * nm))).collect();
        let (ior, dispersion) = Spectrum::Sampled(samples).ior().unwrap();
        let n = |nm: f64| 1.5 + 5000.0 / (nm * nm);
        let abbe = (n(587.6) - 1.0) / (n(486.1) - n(656.3));
        assert!((ior - n(587.6)).abs() < 1e-4 && (20.0 / dispersion / abbe - 1.0).abs() < 0.02);
    }
}
