//! Several points on lights that compete for a shadow ray, and roulette of shadow rays: the same mean, with less noise or
//! fewer rays.

use crate::common::*;
use firstlight::render::{
    ColorInput, Environment, ErrorMetric, Film, Fresnel, Material, Prepared, RenderSettings, SampleAllocation,
    ScalarInput, Techniques, advance,
};
use glam::Vec3;
use rayon::prelude::*;

const SIZE: (u32, u32) = (48, 36);

fn allocated(allocation: SampleAllocation) -> RenderSettings {
    RenderSettings { allocation, ..RenderSettings::default() }
}

/// Mean of the channels of every pixel in renders with different seeds, and shadow rays per other ray.
fn renders(scene: &Prepared, settings: RenderSettings, spp: u32, n: u32) -> (Vec<Vec<f64>>, f64) {
    let found: Vec<_> = (0..n)
        .into_par_iter()
        .map(|seed| {
            let mut film = Film::new(SIZE.0, SIZE.1);
            let report = advance(scene, &RenderSettings { seed, ..settings }, &mut film, spp, &|| false);
            assert!(report.completed);
            let pixels = film.means().iter().map(|mean| mean.as_dvec3().element_sum() / 3.0).collect();
            (pixels, report.rays.shadow as f64 / (report.rays.camera + report.rays.bounce) as f64)
        })
        .collect();
    let shadows = found.iter().map(|(_, shadows)| shadows).sum::<f64>() / f64::from(n);
    (found.into_iter().map(|(pixels, _)| pixels).collect(), shadows)
}

fn means_of_images(renders: &[Vec<f64>]) -> Vec<f64> {
    renders.iter().map(|pixels| pixels.iter().sum::<f64>() / pixels.len() as f64).collect()
}

/// Variance per pixel relative to the squared level, mean over `pixels`.
fn noise(renders: &[Vec<f64>], pixels: impl Iterator<Item = usize> + Clone) -> f64 {
    let of_pixel = |i: usize| {
        let values: Vec<f64> = renders.iter().map(|render| render[i]).collect();
        let (mean, error) = mean_of(&values);
        if mean > 0.0 { error * error * values.len() as f64 / (mean * mean) } else { 0.0 }
    };
    pixels.clone().map(of_pixel).sum::<f64>() / pixels.count() as f64
}

fn assert_same(a: &[Vec<f64>], b: &[Vec<f64>]) {
    let ((a, of_a), (b, of_b)) = (mean_of(&means_of_images(a)), mean_of(&means_of_images(b)));
    assert!((a - b).abs() < 4.0 * of_a.hypot(of_b), "{a} ± {of_a}, {b} ± {of_b}");
}

/// A rough ball on a matte floor, under a quad light, a ball of light and the sky.
fn metal_ball(alpha: f32) -> Prepared {
    let reflectance = ColorInput::Constant(Vec3::new(0.9, 0.7, 0.4));
    let alpha = ScalarInput::Constant(alpha);
    let metal = Material::Metal { alpha, reflectance, fresnel: Fresnel::Constant, compensate: false };
    scene(
        vec![
            (plane(Vec3::ZERO, Vec3::Y), 0),
            (sphere(Vec3::new(0.0, 0.7, 0.0), 0.7), 2),
            (quad(Vec3::new(0.2, 2.4, -0.4), Vec3::X * 0.8, Vec3::Z * 0.8), 1),
            (sphere(Vec3::new(-1.6, 1.5, 1.0), 0.2), 1),
        ],
        vec![diffuse(0.5), emissive(8.0), metal],
        Environment::Constant(Vec3::splat(0.1)),
        camera(Vec3::new(0.5, 1.4, 4.0), Vec3::new(0.0, 0.6, 0.0), 36.0),
    )
}

#[test]
fn competing_light_samples_keep_the_mean_and_lower_the_noise_of_metal() {
    for (alpha, at_most) in [(0.05, 0.95), (0.15, 0.85), (0.4, 0.97)] {
        let scene = metal_ball(alpha);
        let with = |resampling, simd| {
            let techniques = Techniques { resampling, ..Techniques::ALL };
            let settings = RenderSettings { techniques, ..RenderSettings::default() };
            renders(&scene, if simd { settings } else { RenderSettings { simd: None, ..settings } }, 16, 32).0
        };
        let (one, several) = (with(false, true), with(true, true));
        assert_same(&one, &several);
        // The scalar code takes the same samples.
        assert_same(&with(true, false), &several);
        let pixels = 0..one[0].len();
        let gain = noise(&several, pixels.clone()) / noise(&one, pixels);
        println!("alpha {alpha}: {gain:.3}");
        assert!(gain < at_most, "alpha {alpha}: {gain}");
    }
}

/// A closed room with a small light, and a dark corner behind a screen.
fn room() -> Prepared {
    let wall = |corner: Vec3, u: Vec3, v: Vec3| (quad(corner, u, v), 0);
    let (x, y, z) = (Vec3::X * 4.0, Vec3::Y * 3.0, Vec3::Z * 4.0);
    scene(
        vec![
            wall(Vec3::new(-2.0, 0.0, -2.0), z, x),
            wall(Vec3::new(-2.0, 3.0, -2.0), x, z),
            wall(Vec3::new(-2.0, 0.0, -2.0), x, y),
            wall(Vec3::new(-2.0, 0.0, 2.0), y, x),
            wall(Vec3::new(-2.0, 0.0, -2.0), y, z),
            wall(Vec3::new(2.0, 0.0, -2.0), z, y),
            (quad(Vec3::new(0.4, 0.0, -2.0), Vec3::Y * 2.6, Vec3::Z * 2.4), 2),
            (quad(Vec3::new(-1.2, 2.9, -0.4), Vec3::X * 0.3, Vec3::Z * 0.3), 1),
        ],
        vec![diffuse(0.7), emissive(60.0), diffuse(0.02)],
        Environment::Black,
        camera(Vec3::new(0.2, 1.5, 1.9), Vec3::new(0.3, 1.3, -1.0), 80.0),
    )
}

#[test]
fn roulette_of_shadow_rays_saves_rays_and_keeps_the_mean() {
    let scene = room();
    let adaptive = SampleAllocation::Adaptive(ErrorMetric::RelativeMse);
    let (plain, all) = renders(&scene, allocated(SampleAllocation::Uniform), 64, 24);
    let (saving, some) = renders(&scene, allocated(adaptive), 64, 24);
    println!("shadow rays per ray: {all:.3}, {some:.3}");
    assert_same(&plain, &saving);
    assert!(some < 0.85 * all, "{some} of {all}");
    // The image pays for that with little noise, and so does its darkest tenth, which also has fewer samples.
    let levels: Vec<f64> = (0..plain[0].len()).map(|i| plain.iter().map(|render| render[i]).sum::<f64>()).collect();
    let mut by_level: Vec<usize> = (0..levels.len()).collect();
    by_level.sort_by(|&a, &b| levels[a].total_cmp(&levels[b]));
    for (pixels, at_most) in [(&by_level[..], 1.1), (&by_level[..levels.len() / 10], 1.3)] {
        let gain = noise(&saving, pixels.iter().copied()) / noise(&plain, pixels.iter().copied());
        println!("noise of {} pixels: {gain:.3}", pixels.len());
        assert!(gain < at_most, "{gain}");
    }
}
