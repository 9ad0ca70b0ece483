//! From linear light on the film to the numbers a screen wants. A view of the film: it never changes it.

use super::Film;
use glam::Vec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::sync::OnceLock;

/// How bright light is squeezed into what a screen can show.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum ToneCurve {
    /// Clip at 1: what the numbers say.
    Linear,
    /// Khronos PBR Neutral: keeps colours true, rolls off highlights.
    #[default]
    Neutral,
    /// A filmic curve: Hill's fit of the ACES reference transform.
    Filmic,
}

/// Display settings; changing them keeps all samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Display {
    /// Factors of two.
    pub exposure_stops: f32,
    pub tone_curve: ToneCurve,
}

impl Display {
    /// Linear radiance to linear display light, 0..1 a channel.
    #[inline]
    pub fn tone_mapped(&self, radiance: Vec3) -> Vec3 {
        let exposed = (radiance * self.exposure_stops.exp2()).max(Vec3::ZERO);
        match self.tone_curve {
            ToneCurve::Linear => exposed.min(Vec3::ONE),
            ToneCurve::Neutral => pbr_neutral(exposed),
            ToneCurve::Filmic => aces_fitted(exposed),
        }
    }
}

/// One pixel as an sRGB-encoded byte triple.
#[inline]
pub fn develop_pixel(radiance: Vec3, display: &Display) -> [u8; 3] {
    display.tone_mapped(radiance).to_array().map(encode_srgb)
}

/// Fills `rgba` with `width * height` opaque pixels: the film itself, or, when the sizes differ, scaled bilinearly.
pub fn develop(film: &Film, display: &Display, width: u32, height: u32, rgba: &mut Vec<u8>) {
    let row_bytes = 4 * width as usize;
    rgba.resize(row_bytes * height as usize, 255);
    if (width, height) == (film.width(), film.height()) {
        return develop_rows(film, display, rgba);
    }
    let mut small = vec![255; 4 * (film.width() * film.height()) as usize];
    develop_rows(film, display, &mut small);
    let columns: Vec<_> = (0..width).map(|x| Tap::new(x, width, film.width())).collect();
    rgba.par_chunks_exact_mut(row_bytes).enumerate().for_each(|(y, row)| {
        let tap = Tap::new(y as u32, height, film.height());
        let stride = 4 * film.width();
        for (pixel, column) in row.chunks_exact_mut(4).zip(&columns) {
            let at = |x: u32, y: u32, c: usize| u32::from(small[(y * stride + 4 * x) as usize + c]);
            for (c, channel) in pixel.iter_mut().enumerate().take(3) {
                let above = column.mix(at(column.low, tap.low, c), at(column.high, tap.low, c));
                let below = column.mix(at(column.low, tap.high, c), at(column.high, tap.high, c));
                *channel = ((tap.mix(above, below) + (1 << 15)) >> 16) as u8;
            }
            pixel[3] = 255;
        }
    });
}

/// Two neighbours and how much of the second, out of 256.
struct Tap {
    low: u32,
    high: u32,
    weight: u32,
}

impl Tap {
    /// Pixel centre `i` of `n` in a row of `n_source`.
    fn new(i: u32, n: u32, n_source: u32) -> Self {
        let position = ((f64::from(i) + 0.5) * f64::from(n_source) / f64::from(n) - 0.5).max(0.0);
        let low = (position as u32).min(n_source - 1);
        let weight = ((position - f64::from(low)) * 256.0) as u32;
        Self { low, high: (low + 1).min(n_source - 1), weight: weight.min(256) }
    }

    /// 8 bits more than what goes in.
    fn mix(&self, a: u32, b: u32) -> u32 {
        a * (256 - self.weight) + b * self.weight
    }
}

fn develop_rows(film: &Film, display: &Display, rgba: &mut [u8]) {
    let row_bytes = 4 * film.width() as usize;
    rgba.par_chunks_exact_mut(row_bytes).enumerate().for_each(|(y, row)| {
        for (pixel, mean) in row.chunks_exact_mut(4).zip(film.row(y as u32)) {
            pixel[..3].copy_from_slice(&develop_pixel(mean, display));
            pixel[3] = 255;
        }
    });
}

/// Khronos 2024, "PBR Neutral tone mapper" specification.
fn pbr_neutral(color: Vec3) -> Vec3 {
    const START: f32 = 0.8 - 0.04;
    const DESATURATION: f32 = 0.15;
    let low = color.min_element();
    let offset = if low < 0.08 { low - 6.25 * low * low } else { 0.04 };
    let color = color - Vec3::splat(offset);
    let peak = color.max_element();
    if peak < START {
        return color;
    }
    let d = 1.0 - START;
    let new_peak = 1.0 - d * d / (peak + d - START);
    let grey = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    // Infinite light is white, not NaN.
    if !peak.is_finite() { Vec3::ONE } else { (color * (new_peak / peak)).lerp(Vec3::splat(new_peak), grey) }
}

/// Hill's fit of the ACES reference rendering and output transforms for sRGB.
fn aces_fitted(color: Vec3) -> Vec3 {
    let into = glam::Mat3::from_cols(
        Vec3::new(0.59719, 0.07600, 0.02840),
        Vec3::new(0.35458, 0.90834, 0.13383),
        Vec3::new(0.04823, 0.01566, 0.83777),
    );
    let out = glam::Mat3::from_cols(
        Vec3::new(1.60475, -0.10208, -0.00327),
        Vec3::new(-0.53108, 1.10813, -0.07276),
        Vec3::new(-0.07367, -0.00605, 1.07602),
    );
    // Past this the curve is flat, and the quotient of two squares would overflow.
    let v = (into * color).min(Vec3::splat(1e6));
    let curve = (v * (v + 0.024_578_6) - 0.000_090_537) / (v * (0.983_729 * v + 0.432_951) + 0.238_081);
    (out * curve).clamp(Vec3::ZERO, Vec3::ONE)
}

/// The sRGB transfer function (IEC 61966-2-1), rounded to the nearest of 256 values, exactly.
///
/// A table gives a guess that is at most one off; the exact borders between the 256 values decide.
#[inline]
pub fn encode_srgb(linear: f32) -> u8 {
    static TABLES: OnceLock<([u8; 1025], [f32; 257])> = OnceLock::new();
    let (guesses, borders) = TABLES.get_or_init(|| {
        let mut borders = [0.0; 257];
        for (i, border) in borders.iter_mut().enumerate().skip(1) {
            *border = decode_srgb((i as f64 - 0.5) / 255.0) as f32;
        }
        borders[256] = f32::INFINITY;
        let guess = |i: usize| borders[1..].partition_point(|&b| b <= (i as f32 / 1024.0).powi(2)).min(255) as u8;
        (std::array::from_fn(guess), borders)
    });
    let x = linear.clamp(0.0, 1.0);
    let mut value = usize::from(guesses[(x.sqrt() * 1024.0) as usize]);
    while x >= borders[value + 1] {
        value += 1;
    }
    while x < borders[value] {
        value -= 1;
    }
    value as u8
}

/// Inverse of the sRGB transfer function, 0..1 to 0..1.
pub fn decode_srgb(encoded: f64) -> f64 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn encoding_rounds_to_the_nearest_byte() {
        for i in 0..200_000 {
            let x = i as f32 / 199_999.0;
            let exact = f64::from(x);
            let encoded =
                if exact <= 0.003_130_8 { 12.92 * exact } else { 1.055 * exact.powf(1.0 / 2.4) - 0.055 } * 255.0;
            let byte = f64::from(encode_srgb(x));
            assert!((byte - encoded).abs() <= 0.5 + 1e-3, "{x}: {byte} for {encoded}");
        }
        assert_eq!((encode_srgb(-1.0), encode_srgb(7.0), encode_srgb(f32::NAN)), (0, 255, 0));
        assert!((0..=255).all(|b| encode_srgb(decode_srgb(f64::from(b) / 255.0) as f32) == b));
    }

    #[test]
    fn curves_stay_in_range_and_grow() {
        for tone_curve in [ToneCurve::Linear, ToneCurve::Neutral, ToneCurve::Filmic] {
            let display = Display { exposure_stops: 0.0, tone_curve };
            let mut before = -1.0;
            for i in 0..400 {
                let x = 1e-4 * 1.06_f32.powi(i);
                let mapped = display.tone_mapped(Vec3::splat(x)).x;
                assert!((0.0..=1.0).contains(&mapped) && mapped >= before - 1e-6, "{tone_curve:?} at {x}: {mapped}");
                before = mapped;
            }
            assert!(display.tone_mapped(Vec3::splat(f32::INFINITY)).is_finite());
        }
    }

    #[test]
    fn neutral_keeps_plain_colours() {
        let color = Vec3::new(0.5, 0.3, 0.2);
        let mapped = Display::default().tone_mapped(color);
        assert!((mapped - (color - Vec3::splat(0.04))).length() < 1e-6);
    }
}
