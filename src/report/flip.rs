//! LDR-FLIP: the perceived difference when flipping between two images.
//!
//! Andersson et al. 2020, "FLIP: A Difference Evaluator for Alternating Images". Two pipelines: colours are filtered
//! with the contrast sensitivity of human vision and compared in a perceptual space; edges and points are compared by
//! position. Where features differ, the colour difference is amplified. All filters are sums of separable products.

use glam::{Mat3, Vec3};
use rayon::prelude::*;
use std::f32::consts::PI;

/// Pixels per degree of the visual field: a 0.7 m wide screen of 3840 pixels, seen from 0.7 m (the paper's choice).
const PIXELS_PER_DEGREE: f32 = 67.020_64;

/// Mean FLIP of two images of the same size, `width` pixels wide, in linear Rec. 709 display light, 0..1.
pub fn flip(reference: &[Vec3], test: &[Vec3], width: usize) -> f64 {
    assert!(width > 0 && reference.len() == test.len() && reference.len().is_multiple_of(width), "sizes differ");
    let map = flip_map(reference, test, width);
    map.iter().map(|&e| f64::from(e)).sum::<f64>() / map.len() as f64
}

/// FLIP per pixel, 0..1.
fn flip_map(reference: &[Vec3], test: &[Vec3], width: usize) -> Vec<f32> {
    let opponent = |picture: &[Vec3]| picture.iter().map(|&rgb| opponent_from_linear(rgb)).collect::<Vec<_>>();
    let (reference, test) = (opponent(reference), opponent(test));
    let color = color_difference(&reference, &test, width);
    let feature = feature_difference(&reference, &test, width);
    color.iter().zip(&feature).map(|(&color, &feature)| color.powf(1.0 - feature)).collect()
}

/// Matrix whose columns are the CIE XYZ of the Rec. 709 primaries, scaled so that white has Y = 1 (D65).
fn xyz_from_rgb() -> Mat3 {
    Mat3::from_cols(
        Vec3::new(10_135_552.0 / 24_577_794.0, 2_613_072.0 / 12_288_897.0, 1_425_312.0 / 73_733_382.0),
        Vec3::new(8_788_810.0 / 24_577_794.0, 8_788_810.0 / 12_288_897.0, 8_788_810.0 / 73_733_382.0),
        Vec3::new(4_435_075.0 / 24_577_794.0, 887_015.0 / 12_288_897.0, 70_074_185.0 / 73_733_382.0),
    )
}

fn white() -> Vec3 {
    xyz_from_rgb() * Vec3::ONE
}

/// YCxCz: achromatic, red to green, blue to yellow; linear in light.
fn opponent_from_linear(rgb: Vec3) -> Vec3 {
    let n = xyz_from_rgb() * rgb / white();
    Vec3::new(116.0 * n.y - 16.0, 500.0 * (n.x - n.y), 200.0 * (n.y - n.z))
}

fn linear_from_opponent(c: Vec3) -> Vec3 {
    let y = (c.x + 16.0) / 116.0;
    xyz_from_rgb().inverse() * (Vec3::new(y + c.y / 500.0, y, y - c.z / 200.0) * white())
}

/// CIE L*a*b*, with a* and b* scaled by lightness (Hunt effect: dark colours look less colourful).
fn hunt_lab(rgb: Vec3) -> Vec3 {
    let delta = 6.0 / 29.0_f32;
    let curve = |t: f32| if t > delta.powi(3) { t.cbrt() } else { t / (3.0 * delta * delta) + 4.0 / 29.0 };
    let n = xyz_from_rgb() * rgb / white();
    let (x, y, z) = (curve(n.x), curve(n.y), curve(n.z));
    let lightness = 116.0 * y - 16.0;
    Vec3::new(lightness, 0.01 * lightness * 500.0 * (x - y), 0.01 * lightness * 200.0 * (y - z))
}

/// HyAB distance (Abasi, Amani Tehran and Fairchild 2020): city block in lightness, Euclidean in colour.
fn hyab(a: Vec3, b: Vec3) -> f32 {
    let d = a - b;
    d.x.abs() + d.y.hypot(d.z)
}

/// Difference of the colours that the eye resolves, 0..1.
fn color_difference(reference: &[Vec3], test: &[Vec3], width: usize) -> Vec<f32> {
    // Most visible differences take most of the range; the rest is compressed into the remainder (section 4.1.2).
    const EXPONENT: f32 = 0.7;
    const KNEE_IN: f32 = 0.4;
    const KNEE_OUT: f32 = 0.95;
    let largest = hyab(hunt_lab(Vec3::Y), hunt_lab(Vec3::Z)).powf(EXPONENT);
    let knee = KNEE_IN * largest;
    let (reference, test) = (as_seen(reference, width), as_seen(test, width));
    let mapped = |(&a, &b): (&Vec3, &Vec3)| {
        let error = hyab(a, b).powf(EXPONENT);
        if error < knee {
            error * KNEE_OUT / knee
        } else {
            KNEE_OUT + (error - knee) / (largest - knee) * (1.0 - KNEE_OUT)
        }
    };
    reference.par_iter().zip(&test).map(mapped).collect()
}

/// Filters each opponent channel with the contrast sensitivity of the eye (Johnson and Fairchild 2003), then converts
/// to perceptual colours.
fn as_seen(opponent: &[Vec3], width: usize) -> Vec<Vec3> {
    // Amplitude and width of one or two Gaussians per channel, in degrees.
    const ACHROMATIC: &[(f32, f32)] = &[(1.0, 0.0047)];
    const RED_GREEN: &[(f32, f32)] = &[(1.0, 0.0053)];
    const BLUE_YELLOW: &[(f32, f32)] = &[(34.1, 0.04), (13.5, 0.025)];
    let widest = 0.04_f32;
    let radius = (3.0 * (widest / (2.0 * PI * PI)).sqrt() * PIXELS_PER_DEGREE).ceil() as i32;
    let blurred = [(0, ACHROMATIC), (1, RED_GREEN), (2, BLUE_YELLOW)].map(|(channel, gaussians)| {
        let plane: Vec<f32> = opponent.iter().map(|c| c[channel]).collect();
        let terms: Vec<(f32, Vec<f32>)> = gaussians
            .iter()
            .map(|&(amplitude, b)| {
                let at = |i: i32| (-(PI * i as f32 / PIXELS_PER_DEGREE).powi(2) / b).exp();
                (amplitude * (PI / b).sqrt(), (-radius..=radius).map(at).collect())
            })
            .collect();
        let total: f32 = terms.iter().map(|(scale, row)| scale * row.iter().sum::<f32>().powi(2)).sum();
        let mut sum = vec![0.0; plane.len()];
        for (scale, row) in &terms {
            let part = convolve(&plane, width, row, row);
            sum.iter_mut().zip(part).for_each(|(sum, value)| *sum += scale / total * value);
        }
        sum
    });
    let [y, cx, cz] = &blurred;
    (0..opponent.len())
        .into_par_iter()
        .map(|i| hunt_lab(linear_from_opponent(Vec3::new(y[i], cx[i], cz[i])).clamp(Vec3::ZERO, Vec3::ONE)))
        .collect()
}

/// Difference of edges or of points, whichever is larger, 0..1.
fn feature_difference(reference: &[Vec3], test: &[Vec3], width: usize) -> Vec<f32> {
    /// Width of the filters in degrees: the distance between peaks of the eye's sensitivity to edges.
    const FEATURE_WIDTH: f32 = 0.082;
    let sigma = 0.5 * FEATURE_WIDTH * PIXELS_PER_DEGREE;
    let radius = (3.0 * sigma).ceil() as i32;
    let row = |f: &dyn Fn(f32) -> f32| -> Vec<f32> {
        (-radius..=radius).map(|i| f(i as f32) * (-0.5 * (i as f32 / sigma).powi(2)).exp()).collect()
    };
    let across = scaled_by_sign(row(&|_| 1.0));
    let edge = scaled_by_sign(row(&|x| -x));
    let point = scaled_by_sign(row(&|x| (x / sigma).powi(2) - 1.0));
    let features = |opponent: &[Vec3]| {
        let luminance: Vec<f32> = opponent.iter().map(|c| (c.x + 16.0) / 116.0).collect();
        [&edge, &point].map(|filter| {
            let (x, y) = (convolve(&luminance, width, filter, &across), convolve(&luminance, width, &across, filter));
            x.iter().zip(&y).map(|(x, y)| x.hypot(*y)).collect::<Vec<f32>>()
        })
    };
    let [edge_a, point_a] = features(reference);
    let [edge_b, point_b] = features(test);
    let difference = |i: usize| {
        let most = (edge_a[i] - edge_b[i]).abs().max((point_a[i] - point_b[i]).abs());
        (most * std::f32::consts::FRAC_1_SQRT_2).sqrt().min(1.0)
    };
    (0..reference.len()).map(difference).collect()
}

/// Scales the positive values to a sum of 1 and the negative ones to −1.
fn scaled_by_sign(mut row: Vec<f32>) -> Vec<f32> {
    let positive: f32 = row.iter().filter(|w| **w > 0.0).sum();
    let negative: f32 = row.iter().filter(|w| **w < 0.0).sum();
    row.iter_mut().for_each(|w| *w /= if *w > 0.0 { positive } else { negative.abs().max(f32::MIN_POSITIVE) });
    row
}

/// Correlates with `row` along x and `column` along y, both of odd length; border pixels are repeated.
fn convolve(plane: &[f32], width: usize, row: &[f32], column: &[f32]) -> Vec<f32> {
    let height = plane.len() / width;
    let tap = |at: usize, k: usize, n: usize, len: usize| {
        (at as isize + k as isize - (n / 2) as isize).clamp(0, len as isize - 1) as usize
    };
    let along_x: Vec<f32> = (0..plane.len())
        .into_par_iter()
        .map(|i| {
            let (x, start) = (i % width, i - i % width);
            row.iter().enumerate().map(|(k, w)| w * plane[start + tap(x, k, row.len(), width)]).sum()
        })
        .collect();
    (0..plane.len())
        .into_par_iter()
        .map(|i| {
            let (x, y) = (i % width, i / width);
            column.iter().enumerate().map(|(k, w)| w * along_x[tap(y, k, column.len(), height) * width + x]).sum()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn opponent_space_is_left_as_it_was_entered() {
        for rgb in [Vec3::new(0.1, 0.7, 0.3), Vec3::X, Vec3::ZERO, Vec3::ONE] {
            let back = linear_from_opponent(opponent_from_linear(rgb));
            assert!((back - rgb).length() < 1e-5, "{rgb} came back as {back}");
        }
        // White is L* = 100 without colour.
        assert!((hunt_lab(Vec3::ONE) - Vec3::new(100.0, 0.0, 0.0)).length() < 1e-3);
    }

    #[test]
    fn even_pictures_have_the_value_worked_out_by_hand() {
        let (width, n) = (8, 64);
        let black = vec![Vec3::ZERO; n];
        assert_eq!(flip(&black, &black, width), 0.0);
        // Black to white is 100 in L* and nothing in colour, no feature differs: 100^0.7 = 25.1189. Green to blue, from
        // their L*a*b*: (87.735, −86.183, 83.180) and (32.299, 79.190, −107.861), scaled by lightness (−75.61, 72.98)
        // and (25.58, −34.84): 55.436 + √(101.19² + 107.82²) = 203.30, ^0.7 = 41.27; knee 16.51.
        let expected = 0.95 + (25.1189 - 16.51) / (41.27 - 16.51) * 0.05;
        let found = flip(&black, &vec![Vec3::ONE; n], width);
        assert!((found - expected).abs() < 1e-4, "{found} for {expected}");
        // A step of grey below the knee: L* 50 and 52 have Y = ((L + 16) / 116)³; 2^0.7 = 1.6245.
        let grey = |lightness: f32| vec![Vec3::splat(((lightness + 16.0) / 116.0).powi(3)); n];
        let found = flip(&grey(50.0), &grey(52.0), width);
        assert!((found - 1.6245 * 0.95 / 16.51).abs() < 1e-4, "{found}");
    }

    /// A ramp with a checkered blue channel, a red spot, a green cast and a bright line. The expected values are those
    /// of the authors' own program (flip-evaluator 1.7) for the same images.
    #[test]
    fn a_picture_with_everything_agrees_with_the_authors_program() {
        let (width, height) = (24, 16);
        let (mut reference, mut test) = (Vec::new(), Vec::new());
        for i in 0..width * height {
            let (x, y) = (i % width, i / width);
            let blue = if (x / 4 + y / 4) % 2 == 0 { 0.7 } else { 0.2 };
            let color = Vec3::new(0.2 + 0.6 * x as f32 / width as f32, 0.1 + 0.5 * y as f32 / height as f32, blue);
            reference.push(color);
            let spot = (5..8).contains(&y) && (6..9).contains(&x);
            let mut other = if spot { Vec3::new(0.9, 0.1, 0.1) } else { color };
            other.y *= 0.9;
            test.push(if y == 12 { (other * 1.5).min(Vec3::ONE) } else { other });
        }
        let map = flip_map(&reference, &test, width);
        for ((x, y), expected) in [((7, 6), 0.581_080), ((0, 0), 0.107_874), ((20, 12), 0.331_673)] {
            let found = map[y * width + x];
            assert!((found - expected).abs() < 2e-4, "pixel {x}, {y}: {found} for {expected}");
        }
        let mean = flip(&reference, &test, width);
        assert!((mean - 0.218_354).abs() < 2e-4, "{mean}");
    }
}
