//! Gradient noise in space, and sums of it.

use glam::{DVec2, DVec3};

/// Smooth noise with one feature per unit length, within about ±1; zero at every lattice point.
///
/// Perlin 2002, "Improving Noise", with hashed gradients instead of a table, so that it does not repeat.
pub fn gradient_noise(point: DVec3, seed: u32) -> f64 {
    noise_of_lattice(point, seed, |corner| corner)
}

/// - `lattice`: the corner of which the gradient is taken.
fn noise_of_lattice(point: DVec3, seed: u32, lattice: impl Fn([u32; 3]) -> [u32; 3]) -> f64 {
    let cell = point.floor();
    let inside = point - cell;
    let fade = inside * inside * inside * (inside * (inside * 6.0 - 15.0) + 10.0);
    let [x, y, z] = cell.to_array().map(|v| v as i64 as u32);
    let corner = |dx: u32, dy: u32, dz: u32| {
        let h = hash(lattice([x.wrapping_add(dx), y.wrapping_add(dy), z.wrapping_add(dz)]), seed);
        let [px, py, pz] = (inside - DVec3::new(f64::from(dx), f64::from(dy), f64::from(dz))).to_array();
        // The twelve directions to the edges of a cube, four of them twice.
        let (u, v) = match h & 15 {
            0..=3 => (px, py),
            4..=7 => (px, pz),
            8..=11 => (py, pz),
            12 | 14 => (px, py),
            _ => (py, pz),
        };
        (if h & 1 == 0 { u } else { -u }) + (if h & 2 == 0 { v } else { -v })
    };
    let mix = |a: f64, b: f64, t: f64| a + t * (b - a);
    let along_x = |dy, dz| mix(corner(0, dy, dz), corner(1, dy, dz), fade.x);
    let along_y = |dz| mix(along_x(0, dz), along_x(1, dz), fade.y);
    mix(along_y(0), along_y(1), fade.z)
}

/// A sum of `octaves` noises, each twice as fine and half as strong as the one before; within about ±2.
pub fn fractal_noise(point: DVec3, octaves: u32, seed: u32) -> f64 {
    (0..octaves)
        .map(|octave| {
            let scale = f64::from(1_u32 << octave);
            gradient_noise(point * scale, seed.wrapping_add(octave)) / scale
        })
        .sum()
}

/// Like [`fractal_noise`] in a plane, repeated in squares of 1 × 1.
///
/// - `cells`: features of the first octave along x and y of a square.
pub fn tiled_noise(place: DVec2, cells: [u32; 2], octaves: u32, seed: u32) -> f64 {
    (0..octaves)
        .map(|octave| {
            let [nx, ny] = cells.map(|n| n << octave);
            let point = (place * DVec2::new(f64::from(nx), f64::from(ny))).extend(0.5);
            let tiled = |[x, y, z]: [u32; 3]| [x % nx, y % ny, z];
            noise_of_lattice(point, seed.wrapping_add(octave), tiled) / f64::from(1_u32 << octave)
        })
        .sum()
}

/// Sharp crests between round hollows, within about 0..1; finer crests appear only on the flanks of coarse ones
/// (Musgrave's ridged multifractal: Ebert et al. 2003, "Texturing and Modeling", chapter 16).
pub fn ridged_noise(point: DVec3, octaves: u32, seed: u32) -> f64 {
    let (mut sum, mut total, mut weight) = (0.0, 0.0, 1.0);
    for octave in 0..octaves {
        let scale = f64::from(1_u32 << octave);
        let crest = 1.0 - gradient_noise(point * scale, seed.wrapping_add(octave)).abs().min(1.0);
        sum += weight * crest * crest / scale;
        total += 1.0 / scale;
        weight = (crest * crest * weight * 1.5).min(1.0);
    }
    sum / total
}

/// Returns a number in `[0, 1)` for a lattice point.
pub fn lattice_unit(point: [u32; 3], seed: u32) -> f64 {
    f64::from(hash(point, seed)) / (f64::from(u32::MAX) + 1.0)
}

/// Jarzynski and Olano 2020, "Hash Functions for GPU Rendering": PCG3D, with the seed added to one coordinate.
fn hash(point: [u32; 3], seed: u32) -> u32 {
    let [mut x, mut y, mut z] = [point[0], point[1], point[2].wrapping_add(seed.wrapping_mul(0x9e37_79b9))]
        .map(|v| v.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
    for round in 0..2 {
        x = x.wrapping_add(y.wrapping_mul(z));
        y = y.wrapping_add(z.wrapping_mul(x));
        z = z.wrapping_add(x.wrapping_mul(y));
        if round == 0 {
            (x, y, z) = (x ^ (x >> 16), y ^ (y >> 16), z ^ (z >> 16));
        }
    }
    // The low bits are the weakest, and they select the gradient.
    (x ^ (x >> 16)).rotate_right(7)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_centred_bounded_and_continuous() {
        let (mut sum, mut squares) = (0.0, 0.0);
        let count = 20_000_u32;
        for i in 0..count {
            let t = f64::from(i);
            let point = DVec3::new(t * 0.137, t * 0.071 - 500.0, t * 0.0913);
            let value = gradient_noise(point, 3);
            assert!(value.abs() <= 1.1, "{value} at {point}");
            assert!((gradient_noise(point + DVec3::splat(1e-6), 3) - value).abs() < 1e-4);
            sum += value;
            squares += value * value;
        }
        let mean = sum / f64::from(count);
        assert!(mean.abs() < 0.02, "mean {mean}");
        assert!(squares / f64::from(count) > 0.02, "flat");
        assert!(gradient_noise(DVec3::new(5.0, -7.0, 9.0), 1).abs() < 1e-12);
        assert_ne!(gradient_noise(DVec3::splat(0.4), 1), gradient_noise(DVec3::splat(0.4), 2));
    }

    #[test]
    fn tiles_join_without_a_seam() {
        for i in 0..200 {
            let t = f64::from(i) / 200.0;
            for (a, b) in [(DVec2::new(0.0, t), DVec2::new(1.0, t)), (DVec2::new(t, 0.0), DVec2::new(t, 1.0))] {
                let [a, b] = [a, b].map(|place| tiled_noise(place, [3, 7], 4, 5));
                assert!((a - b).abs() < 1e-9, "{a} and {b}");
            }
        }
        assert_ne!(tiled_noise(DVec2::new(0.1, 0.3), [3, 7], 4, 5), tiled_noise(DVec2::new(0.6, 0.3), [3, 7], 4, 5));
    }

    #[test]
    fn ridges_stay_within_the_unit_range() {
        for i in 0..5_000 {
            let value = ridged_noise(DVec3::new(f64::from(i) * 0.171, 0.3, f64::from(i) * -0.043), 5, 9);
            assert!((0.0..=1.0).contains(&value), "{value}");
        }
    }
}
