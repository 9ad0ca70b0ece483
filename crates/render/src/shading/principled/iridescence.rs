//! Colours of thin films: light reflected at the top of a film interferes with light reflected at its bottom.
//!
//! Source: Belcour and Barla 2017, "A Practical Extension to Microfacet Theory for the Modeling of Varying
//! Iridescence", with the formulas that `KHR_materials_iridescence` gives. The spectrum is integrated in Fourier space,
//! to third order.

use glam::{Mat3, Vec3};
use std::f32::consts::{PI, TAU};

/// A thin film on a surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct ThinFilm {
    /// Share of the surface with the film, 0..1.
    pub share: f32,
    /// Index of refraction, above 0.
    pub ior: f32,
    /// Thickness in metres.
    pub thickness: f32,
}

impl ThinFilm {
    /// Returns the reflectance at normal incidence for which Schlick's approximation gives that of the film at this
    /// angle.
    ///
    /// - `facing`: reflectance of the surface below without the film; `cos`: cosine of the view angle, 0..1.
    pub fn tint(&self, facing: Vec3, cos: f32) -> Vec3 {
        let grazing = (1.0 - cos).clamp(0.0, 1.0).powi(5);
        if self.share <= 0.0 || self.thickness <= 0.0 || grazing > 0.999 {
            return facing;
        }
        let seen = self.reflectance(facing, cos);
        let head_on = ((seen - grazing) / (1.0 - grazing)).clamp(Vec3::ZERO, Vec3::ONE);
        facing.lerp(head_on, self.share)
    }

    /// Reflectance per channel, 0..1.
    fn reflectance(&self, facing: Vec3, cos: f32) -> Vec3 {
        // A film that gets thinner vanishes continuously.
        let t = (self.thickness / 30e-9).clamp(0.0, 1.0);
        let ior = 1.0 + (self.ior - 1.0) * t * t * (3.0 - 2.0 * t);
        let cos2 = 1.0 - (1.0 - cos * cos) / (ior * ior);
        if cos2 < 0.0 {
            return Vec3::ONE;
        }
        let cos_inside = cos2.sqrt();
        // The top of the film, in air, and its bottom, at the surface below.
        let top = schlick(head_on(ior, 1.0), cos);
        let passed = 1.0 - top;
        let below = facing.min(Vec3::splat(0.9999)).map(|f| (1.0 + f.sqrt()) / (1.0 - f.sqrt()));
        let bottom = below.map(|below| schlick(head_on(below, ior), cos_inside));
        let turn_at_top = if ior < 1.0 { 0.0 } else { PI };
        let phase = below.map(|below| turn_at_top + if below < ior { PI } else { 0.0 });
        let way = 2.0 * ior * self.thickness * cos_inside;
        let both = (top * bottom).clamp(Vec3::splat(1e-5), Vec3::splat(0.9999));
        let returned = passed * passed * bottom / (1.0 - both);
        let mut sum = Vec3::splat(top) + returned;
        let mut order = returned - passed;
        for m in 1..=2 {
            order *= both.map(f32::sqrt);
            sum += order * 2.0 * interference(m as f32 * way, m as f32 * phase);
        }
        sum.max(Vec3::ZERO)
    }
}

/// Reflectance at normal incidence between two media.
fn head_on(to: f32, from: f32) -> f32 {
    ((to - from) / (to + from)).powi(2)
}

fn schlick(facing: f32, cos: f32) -> f32 {
    facing + (1.0 - facing) * (1.0 - cos).clamp(0.0, 1.0).powi(5)
}

/// Returns the CIE colour matching functions at the frequency of a path difference, in linear Rec. 709.
///
/// - `way`: path difference, metres; `phase`: phase shift of the reflections, radians, per channel.
fn interference(way: f32, phase: Vec3) -> Vec3 {
    // Gaussian fits of the colour matching functions: height, position and width over the wave number; the fourth one
    // is the second peak of x, at the blue end.
    const HEIGHTS: [f32; 4] = [5.4856e-13, 4.4201e-13, 5.2481e-13, 9.7470e-14];
    const PLACES: [f32; 4] = [1.6810e6, 1.7953e6, 2.2084e6, 2.2399e6];
    const WIDTHS: [f32; 4] = [4.3278e9, 9.3046e9, 6.6121e9, 4.5282e9];
    const WHOLE: f32 = 1.0685e-7;
    let at = TAU * way;
    let lobe = |k: usize, phase: f32| {
        HEIGHTS[k] * (TAU * WIDTHS[k]).sqrt() * (PLACES[k] * at + phase).cos() * (-WIDTHS[k] * at * at).exp() / WHOLE
    };
    let xyz = Vec3::new(lobe(0, phase.x) + lobe(3, phase.x), lobe(1, phase.y), lobe(2, phase.z));
    // CIE XYZ to linear Rec. 709.
    let rec709 = Mat3::from_cols(
        Vec3::new(3.240_454, -0.969_266, 0.055_643_4),
        Vec3::new(-1.537_138_5, 1.876_010_8, -0.204_025_9),
        Vec3::new(-0.498_531_4, 0.041_556, 1.057_225_2),
    );
    rec709 * xyz
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two-beam interference, summed over the spectrum, has its maxima where the path difference is an integer number
    /// of wavelengths: red and blue at different thicknesses.
    #[test]
    fn colors_follow_the_path_difference() {
        let film = |nm: f32| ThinFilm { share: 1.0, ior: 1.33, thickness: nm * 1e-9 };
        let seen = |nm: f32, cos: f32| film(nm).reflectance(Vec3::splat(0.04), cos);
        // Head-on, light of 550 nm in a film of water on glass is bright at half a wavelength, dark at a quarter.
        let (bright, dark) = (seen(550.0 / 1.33 / 2.0, 1.0).y, seen(550.0 / 1.33 / 4.0, 1.0).y);
        assert!(bright > 0.035 && dark < 0.015, "{bright} {dark}");
        // Seen at an angle, the same film looks like a thinner one.
        let bluer = seen(450.0, 0.6) - seen(450.0, 1.0);
        assert!(bluer.abs().max_element() > 0.01, "{bluer}");
        // Thick films lose their colour.
        let thick = seen(20_000.0, 1.0);
        assert!((thick - Vec3::splat(thick.y)).abs().max_element() < 0.01, "{thick}");
    }

    #[test]
    fn no_film_changes_nothing_and_none_gives_more_than_all() {
        let facing = Vec3::new(0.9, 0.5, 0.04);
        for nm in [0.0, 10.0, 100.0, 300.0, 1000.0] {
            for cos in [0.0, 0.01, 0.3, 0.7, 1.0] {
                for ior in [1.0, 1.3, 2.0, 0.8] {
                    let film = ThinFilm { share: 1.0, ior, thickness: nm * 1e-9 };
                    let tint = film.tint(facing, cos);
                    assert!(tint.is_finite() && tint.min_element() >= 0.0 && tint.max_element() <= 1.0, "{tint}");
                    assert_eq!(ThinFilm { share: 0.0, ..film }.tint(facing, cos), facing);
                }
            }
        }
    }
}
