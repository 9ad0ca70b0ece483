//! How caustics are looked for: the same mean in each way, one choice for all parts of a picture, and a good one.

use crate::common::*;
use firstlight::kdtree::Shape;
use firstlight::render::{
    Camera, CausticPlan, DeltaLight, Environment, Film, Material, MergeError, Prepared, RenderSettings, Techniques,
    advance, caustic_choice, known_caustic_choice,
};
use glam::Vec3;

const SIZE: (u32, u32) = (48, 36);

fn settings(seed: u32, caustic_plan: Option<CausticPlan>) -> RenderSettings {
    RenderSettings { seed, techniques: Techniques { caustic_plan, ..Techniques::ALL }, ..RenderSettings::default() }
}

fn plan(light_path_stride: u32, guided: bool) -> CausticPlan {
    CausticPlan { light_path_stride, guided }
}

fn eye() -> Camera {
    camera(Vec3::new(0.3, 1.6, 4.0), Vec3::new(0.0, 0.4, 0.0), 40.0)
}

/// A glass sphere and a mirror on a floor, with a wall behind them.
fn still_life(light: Shape, radiance: f32, sky: f32) -> Prepared {
    let glass = Material::Glass { ior: 1.5, absorption: Vec3::ZERO, dispersion: 0.0 };
    let mirror = Material::Mirror { reflectance: firstlight::render::ColorInput::Constant(Vec3::splat(0.9)) };
    scene(
        vec![
            (plane(Vec3::ZERO, Vec3::Y), 0),
            (quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::X * 4.0, Vec3::Y * 3.0), 0),
            (sphere(Vec3::new(-0.4, 0.5, 0.0), 0.5), 2),
            (sphere(Vec3::new(0.7, 0.4, 0.3), 0.4), 3),
            (light, 1),
        ],
        vec![diffuse(0.6), emissive(radiance), glass, mirror],
        Environment::Constant(Vec3::splat(sky)),
        eye(),
    )
}

/// With caustics that camera paths hardly find.
fn small_light() -> Prepared {
    still_life(quad(Vec3::new(-0.1, 2.6, -0.1), Vec3::X * 0.2, Vec3::Z * 0.2), 200.0, 0.02)
}

/// Camera paths run into a light that fills much of the sky, behind glass or not.
fn large_light() -> Prepared {
    still_life(quad(Vec3::new(-8.0, 4.0, -8.0), Vec3::X * 16.0, Vec3::Z * 16.0), 1.0, 0.8)
}

/// Mean of the image over several seeds, and its standard error.
fn mean(scene: &Prepared, plan: Option<CausticPlan>, spp: u32) -> (f64, f64) {
    mean_of_renders(scene, settings(100, plan), SIZE, spp, 8)
}

#[test]
fn every_plan_has_the_same_mean() {
    let scene = small_light();
    let (expected, error) = mean(&scene, Some(plan(1, false)), 128);
    for other in [plan(0, false), plan(0, true), plan(2, true), plan(8, false), plan(32, true)] {
        let (found, of_found) = mean(&scene, Some(other), if other.has_light_paths() { 128 } else { 512 });
        println!("{other:?}: {found:.5} ± {of_found:.5} for {expected:.5} ± {error:.5}");
        let t = (found - expected) / error.hypot(of_found);
        assert!(t.abs() < 4.5, "{other:?}: {found} ± {of_found} for {expected} ± {error}");
    }
}

/// Sum over pixels of the squared distance to a reference, relative, of a picture of `spp` samples; mean over seeds.
fn error_of(scene: &Prepared, plan: CausticPlan, spp: u32, reference: &Film) -> f64 {
    let seeds = 0..6;
    let n = seeds.len() as f64;
    seeds
        .map(|seed| {
            let (film, _) = render(scene, &settings(seed, Some(plan)), SIZE.0, SIZE.1, spp);
            let pairs = film.means().into_iter().zip(reference.means());
            pairs.map(|(a, b)| ((a - b) * (a - b) / (b * b + 0.01)).element_sum() as f64).sum::<f64>()
        })
        .sum::<f64>()
        / n
}

#[test]
fn what_the_pilot_says_light_paths_save_is_what_they_save() {
    for side in [0.6, 1.2] {
        let light = quad(Vec3::new(-0.5 * side, 2.6, -0.5 * side), Vec3::X * side, Vec3::Z * side);
        let scene = still_life(light, 8.0 / (side * side), 0.02);
        let choice = caustic_choice(&scene, &settings(0, None), SIZE);
        assert!(choice.plan.has_light_paths(), "{choice}");
        let (reference, _) = render(&scene, &settings(77, Some(plan(1, true))), SIZE.0, SIZE.1, 1024);
        let without = CausticPlan { light_path_stride: 0, ..choice.plan };
        let [less, more] = [choice.plan, without].map(|plan| error_of(&scene, plan, 64, &reference));
        let saved = more / less;
        println!("side {side}, {choice}: saved {saved:.2}");
        let off = f64::from(choice.gain) / saved;
        assert!((0.45..2.2).contains(&off), "side {side}: {choice}, but it is {saved:.2}");
    }
}

#[test]
fn where_light_paths_bring_little_there_are_none() {
    let scene = large_light();
    let choice = caustic_choice(&scene, &settings(0, None), SIZE);
    assert_eq!(choice.plan, CausticPlan::NONE, "{choice}");
    assert!(choice.cost > 1.0 && choice.to_string().contains("would cost"), "{choice}");
    let (film, _) = render(&scene, &settings(0, None), SIZE.0, SIZE.1, 2);
    assert_eq!(film.caustic_plan(), Some(CausticPlan::NONE));
    // But a light without size is found by them alone.
    let with_point = with_lights(&scene, vec![DeltaLight::Point { position: Vec3::Y, intensity: Vec3::splat(1e-3) }]);
    let choice = caustic_choice(&with_point, &settings(0, None), SIZE);
    assert!(choice.plan.has_light_paths(), "{choice}");
}

#[test]
fn a_choice_is_the_same_for_all_parts_of_a_picture() {
    let of = |n_threads: usize, settings: &RenderSettings| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
        pool.install(|| [small_light(), large_light()].map(|scene| caustic_choice(&scene, settings, SIZE)))
    };
    let expected = of(1, &settings(0, None));
    assert_eq!(of(3, &settings(0, None)), expected);
    assert_eq!(of(2, &settings(9, None)), expected, "another seed");
    assert_eq!(of(1, &RenderSettings { simd: None, ..settings(0, None) }), expected, "one path at a time");
    // Parts of a picture that are rendered from scenes of their own.
    let mut whole = Film::new(SIZE.0, SIZE.1);
    assert!(advance(&small_light(), &settings(5, None), &mut whole, 4, &|| false).completed);
    let mut first = Film::new(SIZE.0, SIZE.1);
    assert!(advance(&small_light(), &settings(5, None), &mut first, 1, &|| false).completed);
    let mut rest = Film::new(SIZE.0, SIZE.1).starting_at(1);
    assert!(advance(&small_light(), &settings(5, None), &mut rest, 3, &|| false).completed);
    first.merge(&rest).unwrap();
    assert!(first.means() == whole.means());
    assert_eq!(first.caustic_plan(), whole.caustic_plan());
}

#[test]
fn a_film_keeps_its_plan() {
    let scene = small_light();
    let mut film = Film::new(SIZE.0, SIZE.1);
    assert_eq!(film.caustic_plan(), None);
    let old = plan(32, false);
    assert!(advance(&scene, &settings(5, Some(old)), &mut film, 1, &|| false).completed);
    let mut read = Film::from_record(&film.to_record()).unwrap();
    assert_eq!(read.caustic_plan(), Some(old));
    // Whoever goes on with it.
    assert!(advance(&scene, &settings(5, None), &mut read, 2, &|| false).completed);
    assert!(advance(&scene, &settings(5, Some(old)), &mut film, 2, &|| false).completed);
    assert!(read.means() == film.means());
    // Films of two plans do not add up: weights of the one do not fit the light paths of the other.
    let mut other = Film::new(SIZE.0, SIZE.1).starting_at(2);
    assert!(advance(&scene, &settings(5, Some(plan(4, true))), &mut other, 1, &|| false).completed);
    assert_eq!(film.merge(&other), Err(MergeError::LightPaths(32, 4)));
    film.clear();
    assert_eq!(film.caustic_plan(), None);
    // A record with light paths and without a plan for them, or with a wrong one, is refused.
    let mut record = other.to_record();
    for wrong in [None, Some(plan(0, true)), Some(plan(3, true)), Some(plan(1 << 20, false))] {
        record.layout.caustics = wrong;
        assert!(Film::from_record(&record).is_err(), "{wrong:?}");
    }
}

#[test]
fn nothing_is_measured_for_a_preview() {
    let (scene, settings) = (small_light(), settings(0, None));
    let mut film = Film::new(SIZE.0, SIZE.1);
    film.set_preview(true);
    assert!(advance(&scene, &settings, &mut film, 1, &|| false).completed);
    assert_eq!(known_caustic_choice(&scene, &settings, SIZE), None);
    // Guiding would wait for its own paths.
    assert_eq!(film.caustic_plan(), Some(CausticPlan { guided: false, ..CausticPlan::UNKNOWN }));
    // What was found out of another view will do.
    let (wide, _) = render(&large_light(), &settings, SIZE.0, SIZE.1, 1);
    assert_eq!(wide.caustic_plan(), Some(CausticPlan::NONE));
    let scene = large_light();
    caustic_choice(&scene, &settings, SIZE);
    let mut film = Film::new(12, 9);
    film.set_preview(true);
    assert!(advance(&scene, &settings, &mut film, 1, &|| false).completed);
    assert_eq!(film.caustic_plan(), Some(CausticPlan::NONE));
    // And so will what was found out before a change of the scene.
    let moved = scene.with_snapshot((*small_light()).clone());
    let changed = moved.with_snapshot((*moved).clone());
    let mut film = Film::new(12, 9);
    film.set_preview(true);
    assert!(advance(&changed, &settings, &mut film, 1, &|| false).completed);
    assert_eq!(film.caustic_plan(), Some(CausticPlan::NONE));
    assert_eq!(known_caustic_choice(&changed, &settings, SIZE), None);
}
