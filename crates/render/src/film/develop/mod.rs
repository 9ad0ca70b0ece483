//! Development of a film for the display: linear radiance to sRGB bytes. The film is never changed.
//!
//! The window develops every image that it shows on the processors that trace rays, so sixteen pixels are developed at
//! a time.

mod curve;
mod pixels;
mod scale;
mod srgb;

use crate::film::develop::pixels::write_pixels;
use crate::film::tiles::Film;
use firstlight_simd::{Float, InstructionSet, LANES, Real, Simd, Vector, Word, dispatch};
use glam::Vec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

pub use crate::film::develop::curve::ToneCurve;
pub use crate::film::develop::srgb::{decode_srgb, encode_srgb};

/// Display settings; changing them keeps all samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename = "DisplayPart", deny_unknown_fields, default)]
pub struct Display {
    /// Exposure in stops (factors of two).
    #[serde(rename = "exposure")]
    pub exposure_stops: f32,
    /// Map from exposed radiance to display light.
    pub tone_curve: ToneCurve,
}

impl Display {
    /// Converts linear radiance to linear display light, 0..1 per channel.
    #[inline]
    pub fn tone_mapped(&self, radiance: Vec3) -> Vec3 {
        self.tone_curve.apply((radiance * self.exposure()).max(Vec3::ZERO))
    }

    /// What radiance is multiplied by.
    pub fn exposure(&self) -> f32 {
        self.exposure_stops.exp2()
    }
}

/// Develops one pixel to three sRGB-encoded bytes.
#[inline]
pub fn develop_pixel(radiance: Vec3, display: &Display) -> [u8; 3] {
    display.tone_mapped(radiance).to_array().map(encode_srgb)
}

/// Develops a film to `width * height` opaque RGBA pixels, row by row from the top; scales bilinearly if the sizes
/// differ.
pub fn develop(film: &Film, display: &Display, width: u32, height: u32, rgba: &mut Vec<u8>) {
    develop_rows([film.width(), film.height()], display, [width, height], rgba, &|row, y| row.read(film, y));
}

/// Like [`develop`] for an image that is not a film: `colors` is the radiance of `from.0 * from.1` pixels, row by row
/// from the top.
///
/// # Panics
/// If `colors` has another length.
pub fn develop_colors(
    colors: &[Vec3],
    from: (u32, u32),
    display: &Display,
    (width, height): (u32, u32),
    rgba: &mut Vec<u8>,
) {
    assert_eq!(colors.len(), from.0 as usize * from.1 as usize, "pixels of an image of {} x {}", from.0, from.1);
    let row_of = |row: &mut Row, y: u32| row.take(&colors[y as usize * from.0 as usize..][..from.0 as usize]);
    develop_rows([from.0, from.1], display, [width, height], rgba, &row_of);
}

/// - `read`: fills a row with the radiance of a row of the image.
fn develop_rows(
    from: [u32; 2],
    display: &Display,
    to: [u32; 2],
    rgba: &mut Vec<u8>,
    read: &(dyn Fn(&mut Row, u32) + Sync),
) {
    let set = InstructionSet::detect();
    rgba.resize(4 * to[0] as usize * to[1] as usize, 255);
    let unscaled = |rgba: &mut [u8]| {
        rgba.par_chunks_exact_mut(4 * from[0] as usize).enumerate().for_each_init(Row::default, |row, (y, rgba)| {
            read(row, y as u32);
            row.develop(set, *display, rgba);
        });
    };
    if to == from {
        return unscaled(rgba);
    }
    let mut small = vec![255; 4 * from[0] as usize * from[1] as usize];
    unscaled(&mut small);
    scale::scale(set, &small, from, to, rgba);
}

/// Radiance of a row of pixels, one list per channel, padded to a multiple of sixteen.
#[derive(Default)]
struct Row([Vec<f32>; 3]);

impl Row {
    fn read(&mut self, film: &Film, y: u32) {
        for channel in &mut self.0 {
            channel.resize((film.width() as usize).next_multiple_of(LANES), 0.0);
        }
        let [r, g, b] = &mut self.0;
        film.for_each_in_row(y, |x, mean| (r[x], g[x], b[x]) = mean.into());
    }

    fn take(&mut self, colors: &[Vec3]) {
        for (c, channel) in self.0.iter_mut().enumerate() {
            channel.clear();
            channel.extend(colors.iter().map(|color| color[c]));
            channel.resize(colors.len().next_multiple_of(LANES), 0.0);
        }
    }

    /// - `rgba`: as many pixels as the row has.
    fn develop(&self, set: InstructionSet, display: Display, rgba: &mut [u8]) {
        let row = &self.0;
        dispatch!(set, develop_row(row: &[Vec<f32>; 3], display: Display, rgba: &mut [u8]));
    }
}

#[inline(always)]
fn develop_row<S: Simd>(s: S, row: &[Vec<f32>; 3], display: Display, rgba: &mut [u8]) {
    let exposure = display.exposure();
    let encoder = srgb::Encoder::new(s);
    let [r, g, b] = row;
    let chunks = r.chunks_exact(LANES).zip(g.chunks_exact(LANES)).zip(b.chunks_exact(LANES));
    for (((r, g), b), rgba) in chunks.zip(rgba.chunks_mut(4 * LANES)) {
        let light = Vector { x: exposed(s, r, exposure), y: exposed(s, g, exposure), z: exposed(s, b, exposure) };
        let color = display.tone_curve.apply_lanes(light);
        let [r, g, b] = [encoder.encode(color.x), encoder.encode(color.y), encoder.encode(color.z)];
        write_pixels(r | g.shift_left(8) | b.shift_left(16) | (255 << 24), rgba);
    }
}

#[inline(always)]
fn exposed<S: Simd>(s: S, radiance: &[f32], exposure: f32) -> Float<S> {
    let radiance = radiance.first_chunk().expect("chunks are of sixteen");
    (Float::load(s, radiance) * exposure).at_least(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_is_what_its_pixels_are_one_at_a_time() {
        let values = [0.0, 1e-9, 1.6e-4, 0.003, 0.02, 0.079, 0.081, 0.3, 0.5, 0.7599, 0.76, 0.8, 0.99, 1.0, 1.3, 7.0];
        let odd = [-0.1, -1e-30, 1e4, 3e20, f32::MAX, f32::INFINITY, f32::NAN, f32::MIN_POSITIVE];
        let all: Vec<f32> = values.into_iter().chain(odd).collect();
        let n = all.len();
        let colors: Vec<Vec3> = (0..n * n * n)
            .map(|i| Vec3::new(all[i % n], all[i / n % n], all[i / n / n]))
            .chain((0..10_007).map(|i| Vec3::new(i as f32 / 5e3, i as f32 / 1e4, (i % 97) as f32 / 97.0)))
            .collect();
        let padded = colors.len().next_multiple_of(LANES);
        let mut row = Row(std::array::from_fn(|c| colors.iter().map(|color| color[c]).collect()));
        row.0.iter_mut().for_each(|channel| channel.resize(padded, 0.0));
        for tone_curve in [ToneCurve::Linear, ToneCurve::Neutral, ToneCurve::Filmic] {
            for exposure_stops in [0.0, -2.5, 3.25] {
                let display = Display { exposure_stops, tone_curve };
                for set in InstructionSet::available() {
                    let mut rgba = vec![0; 4 * colors.len()];
                    row.develop(set, display, &mut rgba);
                    for (color, pixel) in colors.iter().zip(rgba.chunks_exact(4)) {
                        let [r, g, b] = develop_pixel(*color, &display);
                        assert_eq!(pixel, [r, g, b, 255], "{color} {display:?} {set:?}");
                    }
                }
            }
        }
    }
}
