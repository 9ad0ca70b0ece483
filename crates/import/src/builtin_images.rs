//! Images by formula, for the ready materials. Each repeats without a seam.

use firstlight_format::sources::BUILTIN_IMAGE;
use firstlight_mesh::procedural::noise::{lattice_unit, tiled_noise};
use firstlight_render::{ImageTexture, Texels};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};
use std::sync::{Arc, OnceLock};

/// Width and height, pixels.
const SIDE: usize = 512;

/// Names without [`BUILTIN_IMAGE`], each with its sRGB colour at a place of the unit square.
const IMAGES: [(&str, fn(DVec2) -> DVec3); 4] =
    [("oak", oak), ("marble", marble), ("concrete", concrete), ("linen", linen)];

/// The image of a name that begins with [`BUILTIN_IMAGE`], made when first asked for; `None` if there is none.
pub fn builtin_image(name: &str) -> Option<Arc<ImageTexture>> {
    static MADE: [OnceLock<Arc<ImageTexture>>; IMAGES.len()] = [const { OnceLock::new() }; IMAGES.len()];
    let name = name.strip_prefix(BUILTIN_IMAGE)?;
    let place = IMAGES.iter().position(|(known, _)| *known == name)?;
    Some(MADE[place].get_or_init(|| Arc::new(drawn(IMAGES[place].1))).clone())
}

fn drawn(color: fn(DVec2) -> DVec3) -> ImageTexture {
    let middle = |i: usize| (i as f64 + 0.5) / SIDE as f64;
    let pixel = |i: usize| {
        let srgb = color(DVec2::new(middle(i % SIDE), middle(i / SIDE))).clamp(DVec3::ZERO, DVec3::ONE);
        srgb.to_array().map(|value| (255.0 * value).round() as u8)
    };
    let data = (0..SIDE * SIDE).into_par_iter().flat_map_iter(pixel).collect();
    ImageTexture { width: SIDE as u32, height: SIDE as u32, texels: Texels::U8 { channels: 3, data } }
}

/// Planed wood: rings that are cut lengthwise along x, fibres and pores.
fn oak(at: DVec2) -> DVec3 {
    const RINGS: f64 = 9.0;
    let bent = at.y * RINGS + 1.1 * tiled_noise(at, [1, 3], 3, 11) + 0.12 * tiled_noise(at, [3, 24], 2, 12);
    let (ring, inside) = (bent.floor().rem_euclid(RINGS), bent.rem_euclid(1.0));
    // Early wood is light, and late wood dark up to its sharp end.
    let late = inside.powi(3) * (1.0 - ((inside - 0.94) / 0.06).clamp(0.0, 1.0));
    let of_ring = lattice_unit([ring as u32, 0, 0], 13) - 0.5;
    let fibre = tiled_noise(at, [4, 96], 2, 14);
    let pores = ((tiled_noise(at, [10, 128], 1, 15) - 0.3) / 0.3).clamp(0.0, 1.0) * (1.0 - 0.6 * inside);
    let dark = 0.5 * late + 0.16 * of_ring + 0.22 * fibre + 0.35 * pores + 0.15;
    DVec3::new(0.80, 0.64, 0.45).lerp(DVec3::new(0.42, 0.27, 0.15), dark.clamp(0.0, 1.0))
}

/// White marble with grey veins.
fn marble(at: DVec2) -> DVec3 {
    let turbulence = tiled_noise(at, [3, 3], 6, 21);
    let vein = |along: f64, seed: u32, sharpness: i32| {
        let wave = (PI * (along + 1.4 * turbulence + 0.5 * tiled_noise(at, [5, 5], 4, seed))).sin().abs();
        (1.0 - wave).powi(sharpness)
    };
    let thick = vein(at.x + 2.0 * at.y, 22, 7) * (0.55 + 0.6 * tiled_noise(at, [4, 4], 2, 24)).clamp(0.0, 1.0);
    let thin = vein(3.0 * at.x - at.y, 23, 16);
    let cloud = 0.5 + 0.5 * tiled_noise(at, [2, 2], 5, 25);
    let grey = (0.75 * thick + 0.35 * thin + 0.16 * cloud).clamp(0.0, 1.0);
    DVec3::new(0.95, 0.94, 0.92).lerp(DVec3::new(0.40, 0.41, 0.44), grey)
}

/// Smooth concrete with clouds, grains and small holes.
fn concrete(at: DVec2) -> DVec3 {
    let cloud = tiled_noise(at, [3, 3], 6, 31);
    let grain = tiled_noise(at, [128, 128], 2, 32);
    let hole = ((tiled_noise(at, [40, 40], 1, 33) - 0.52) / 0.08).clamp(0.0, 1.0);
    DVec3::new(0.62, 0.61, 0.59) * (1.0 + 0.14 * cloud + 0.06 * grain - 0.4 * hole)
}

/// Plain weave of uneven threads.
fn linen(at: DVec2) -> DVec3 {
    const THREADS: f64 = 48.0;
    let bent = at * THREADS + 0.25 * DVec2::new(tiled_noise(at, [6, 12], 2, 41), tiled_noise(at, [12, 6], 2, 42));
    let (cell, inside) = (bent.floor().rem_euclid(DVec2::splat(THREADS)), bent - bent.floor());
    // The thread above runs along x in every second cell, and bends down at the ends of it.
    let is_weft = (cell.x + cell.y).rem_euclid(2.0) < 1.0;
    let (across, along, thread) = if is_weft { (inside.y, inside.x, cell.y) } else { (inside.x, inside.y, cell.x) };
    let round = (PI * across).sin().max(0.0).sqrt() * (0.75 + 0.25 * (PI * along).sin());
    let of_thread = lattice_unit([thread as u32, u32::from(is_weft), 0], 43) - 0.5;
    let twist = 0.06 * (TAU * (2.0 * along + across)).sin();
    DVec3::new(0.86, 0.82, 0.73) * (0.45 + 0.5 * round + 0.16 * of_thread + twist)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn images_have_contrast_and_no_seam() {
        for (name, _) in IMAGES {
            let image = builtin_image(&format!("{BUILTIN_IMAGE}{name}")).unwrap();
            assert!(Arc::ptr_eq(&image, &builtin_image(&format!("{BUILTIN_IMAGE}{name}")).unwrap()), "made once");
            let at = |x: usize, y: usize| image.linear(y % SIDE * SIDE + x % SIDE);
            let all: Vec<Vec3> = (0..SIDE * SIDE).map(|i| image.linear(i)).collect();
            let mean = all.iter().sum::<Vec3>() / all.len() as f32;
            let spread = all.iter().map(|color| (color.x - mean.x).abs()).sum::<f32>() / all.len() as f32;
            assert!(spread > 0.02 && mean.min_element() > 0.05 && mean.max_element() < 0.95, "{name}: {mean} {spread}");
            // Steps across the edge are as large as those inside.
            let step = |x: usize| (0..SIDE).map(|y| (at(x, y) - at(x + 1, y)).abs().x).sum::<f32>();
            let down = |y: usize| (0..SIDE).map(|x| (at(x, y) - at(x, y + 1)).abs().x).sum::<f32>();
            let most = |of: &dyn Fn(usize) -> f32| (0..SIDE - 1).map(of).fold(0.0, f32::max);
            assert!(step(SIDE - 1) <= 1.2 * most(&step) && down(SIDE - 1) <= 1.2 * most(&down), "{name}");
        }
        assert!(builtin_image("oak").is_none() && builtin_image("builtin:cheese").is_none());
    }

    #[test]
    fn their_names_are_those_of_scene_files() {
        let names: Vec<&str> = IMAGES.iter().map(|(name, _)| *name).collect();
        assert_eq!(names, firstlight_format::sources::BUILTIN_IMAGES);
    }
}
