//! Samples that go where the error is: the same bytes in whatever portions, kept and gone on with, and no more of them than
//! an even picture has.

use crate::common::*;
use crate::determinism::{busy_scene, with_threads};
use firstlight::render::{
    CausticPlan, Environment, ErrorMetric, Film, FilmRecord, Material, MergeError, Prepared, RenderSettings,
    SampleAllocation, Techniques, advance,
};
use glam::Vec3;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU32, Ordering};

const NEVER: fn() -> bool = || false;

fn adaptive() -> RenderSettings {
    let allocation = SampleAllocation::Adaptive(ErrorMetric::RelativeMse);
    RenderSettings { seed: 3, allocation, ..RenderSettings::default() }
}

/// Noisy under the ball, and nothing to be found out elsewhere.
fn half_empty() -> Prepared {
    let ball = sphere(Vec3::new(0.0, 0.5, 0.0), 0.5);
    let lamp = quad(Vec3::new(-0.3, 2.0, -0.3), Vec3::X * 0.6, Vec3::Z * 0.6);
    let floor = quad(Vec3::new(-1.0, 0.0, -1.0), Vec3::X * 2.0, Vec3::Z * 2.0);
    let eye = camera(Vec3::new(0.0, 1.5, 4.0), Vec3::new(0.0, 0.5, 0.0), 50.0);
    scene(vec![(floor, 0), (ball, 0), (lamp, 1)], vec![diffuse(0.7), emissive(8.0)], Environment::Black, eye)
}

fn rendered(scene: &Prepared, settings: &RenderSettings, spp: u32) -> Film {
    let mut film = Film::new(75, 50);
    assert!(advance(scene, settings, &mut film, spp, &NEVER).completed);
    film
}

/// Light in physical units, such as a sun of 100,000 lux: what is relative does not depend on the unit. Powers of two round
/// nothing.
#[test]
fn a_scene_of_another_unit_gets_the_same_samples() {
    let film = |power: i32| {
        let unit = 2.0_f32.powi(power);
        let ball = sphere(Vec3::new(0.0, 0.5, 0.0), 0.5);
        let lamp = quad(Vec3::new(-0.3, 2.0, -0.3), Vec3::X * 0.6, Vec3::Z * 0.6);
        let eye = camera(Vec3::new(0.0, 1.5, 4.0), Vec3::new(0.0, 0.5, 0.0), 50.0);
        let materials = vec![diffuse(0.7), emissive(300.0 * unit)];
        rendered(&scene(vec![(ball, 0), (lamp, 1)], materials, Environment::Black, eye), &adaptive(), 64)
    };
    let (small, large) = (film(7), film(17));
    let error = |film: &Film| film.error_estimate().map(|estimate| estimate.relative);
    assert_eq!(error(&small), error(&large));
    let counts = |film: &Film| (0..75 * 50).map(|i| film.samples(i % 75, i / 75)).collect::<Vec<_>>();
    assert!(counts(&small) == counts(&large));
    assert!(small.sample_counts().2 > small.sample_counts().0, "samples differ");
}

#[test]
fn samples_go_where_the_error_is_and_are_no_more_than_asked_for() {
    let scene = half_empty();
    for spp in [16, 24, 64] {
        let film = rendered(&scene, &adaptive(), spp);
        let (least, mean, most) = film.sample_counts();
        assert_eq!((film.spp(), film.max_spp()), (spp, spp));
        // A block is as small as a fiftieth of this picture.
        assert!((mean / f64::from(spp) - 1.0).abs() < 0.04, "{mean} for {spp}");
        assert!(least * 4 >= spp.next_power_of_two() / 2 && most >= 2 * least, "{least} to {most} for {spp}");
        let counts = (0..50).flat_map(|y| (0..75).map(move |x| (x, y)));
        for (x, y) in counts {
            let count = film.samples(x, y);
            assert!(count.is_power_of_two(), "{count}");
            assert_eq!(count, film.samples(x / 8 * 8, y / 8 * 8), "a block has the same samples");
        }
        // The corners show nothing, the shadow is noisy.
        assert_eq!(film.samples(2, 2), least);
        assert!(film.samples(37, 33) > least);
    }
    // What is even is left so.
    let nothing = self::scene(
        vec![(sphere(Vec3::new(0.0, 0.0, -50.0), 40.0), 0)],
        vec![diffuse(0.5)],
        Environment::Constant(Vec3::ONE),
        camera(Vec3::ZERO, -Vec3::Z, 20.0),
    );
    let (even, uniform) =
        (rendered(&nothing, &adaptive(), 40), RenderSettings { seed: 3, ..RenderSettings::default() });
    assert_eq!(even.sample_counts(), (40, 40.0, 40));
    assert!(even.means() == rendered(&nothing, &uniform, 40).means());
}

#[test]
fn threads_and_tiles_change_nothing() {
    let scene = busy_scene();
    let display = SampleAllocation::Adaptive(ErrorMetric::Display { exposure_stops: 0.5 });
    for settings in [adaptive(), RenderSettings { allocation: display, ..adaptive() }] {
        let render = |threads, tile_size| {
            with_threads(threads, || {
                let mut film = Film::with_tile_size(75, 50, tile_size);
                advance(&scene, &settings, &mut film, 24, &NEVER);
                let counts: Vec<u32> = (0..75 * 50).map(|i| film.samples(i % 75, i / 75)).collect();
                (film.means(), counts)
            })
        };
        let expected = render(1, 32);
        assert!(expected.1.iter().any(|count| *count != expected.1[0]));
        for (threads, tile_size) in [(2, 32), (3, 8), (1, 16), (4, 128)] {
            assert!(render(threads, tile_size) == expected, "{threads} threads, tiles of {tile_size}");
        }
    }
}

#[test]
fn portions_interruptions_and_the_way_over_the_disk_change_nothing() {
    let (scene, settings) = (busy_scene(), adaptive());
    let whole = rendered(&scene, &settings, 40);
    let mut portions = Film::new(75, 50);
    for (i, target) in [3, 8, 9, 17, 20, 32, 33, 40].into_iter().enumerate() {
        // Stopped after a while, a different while each time; kept, and gone on with.
        let asked = AtomicU32::new(0);
        let stop = || asked.fetch_add(1, Ordering::Relaxed) > 40 * i as u32;
        advance(&scene, &settings, &mut portions, target, &stop);
        portions = Film::from_record(&portions.to_record()).unwrap();
        assert!(advance(&scene, &settings, &mut portions, target, &NEVER).completed);
        assert_eq!((portions.spp(), portions.max_spp()), (target, target));
    }
    assert!(portions.to_record() == whole.to_record());
    assert_eq!(portions.error_estimate(), whole.error_estimate());
}

/// Light paths are of the whole image: a film that is kept among those of one sample goes on with the next batch.
#[test]
fn a_film_kept_among_the_light_paths_of_a_sample_goes_on_with_the_rest() {
    let scene = busy_scene();
    let caustic_plan = Some(CausticPlan { light_path_stride: 1, guided: false });
    let techniques = Techniques { caustic_plan, ..Techniques::ALL };
    with_threads(1, || {
        for settings in [adaptive(), RenderSettings { allocation: SampleAllocation::Uniform, ..adaptive() }] {
            let settings = RenderSettings { techniques, ..settings };
            // Several batches of light paths per sample.
            let new = || Film::new(160, 110);
            let mut whole = new();
            assert!(advance(&scene, &settings, &mut whole, 3, &NEVER).completed);
            let whole = whole.to_record();
            let batches = |record: &FilmRecord| -> u64 {
                let light = record.layout.light_traced.as_ref().expect("light paths");
                light.batches.iter().map(|(first, end)| end - first).sum()
            };
            let per_sample = batches(&whole) / 3;
            let mut n_among = 0;
            for patience in (0..400).step_by(9) {
                let asked = AtomicU32::new(0);
                let mut film = new();
                advance(&scene, &settings, &mut film, 3, &|| asked.fetch_add(1, Ordering::Relaxed) >= patience);
                let kept = film.to_record();
                n_among += usize::from(kept.layout.light_traced.is_some() && batches(&kept) % per_sample > 0);
                let mut film = Film::from_record(&kept).unwrap();
                assert!(advance(&scene, &settings, &mut film, 3, &NEVER).completed);
                assert!(film.to_record() == whole, "{patience}");
            }
            assert!(n_among >= 3, "{n_among} stops fell among the light paths of a sample");
        }
    });
}

/// A light that paths find through glass by BSDF sampling alone: few of them bring all of the light of a spot. A block that
/// has met one gets more samples, which dilute it; that makes pictures of few samples a little too dark, and must vanish as
/// samples come in, faster than noise.
#[test]
fn a_rare_caustic_keeps_its_mean() {
    const RENDERS: u32 = 120;
    let lamp = sphere(Vec3::new(0.4, 2.4, 0.3), 0.3);
    let glass = Material::Glass { ior: 1.5, absorption: Vec3::ZERO, dispersion: 0.0 };
    let shapes = vec![(plane(Vec3::ZERO, Vec3::Y), 0), (lamp, 1), (sphere(Vec3::new(0.0, 0.5, 0.0), 0.5), 2)];
    let eye = camera(Vec3::new(0.3, 1.6, 4.0), Vec3::new(0.0, 0.3, 0.0), 30.0);
    let scene = scene(shapes, vec![diffuse(0.6), emissive(10.0), glass], Environment::Black, eye);
    let techniques = Techniques { caustics: false, ..Techniques::ALL };
    // Mean of the picture, and its variance over renders.
    let mean_of = |allocation, first_seed, spp| {
        let settings = RenderSettings { allocation, techniques, ..RenderSettings::default() };
        let means: Vec<f64> = (0..RENDERS)
            .into_par_iter()
            .map(|render| {
                let mut film = Film::new(48, 32);
                let settings = RenderSettings { seed: first_seed + render, ..settings };
                assert!(advance(&scene, &settings, &mut film, spp, &NEVER).completed);
                film.means().iter().map(|mean| f64::from(mean.y)).sum::<f64>() / (48.0 * 32.0)
            })
            .collect();
        let n = f64::from(RENDERS);
        let mean = means.iter().sum::<f64>() / n;
        (mean, means.iter().map(|of| (of - mean).powi(2)).sum::<f64>() / (n - 1.0))
    };
    for (spp, most) in [(32, 0.01), (128, 0.004)] {
        let (a, va) = mean_of(adaptive().allocation, 5000, spp);
        let (b, vb) = mean_of(SampleAllocation::Uniform, 9000, spp);
        let (bias, error) = ((a - b) / b, ((va + vb) / f64::from(RENDERS)).sqrt() / b);
        let noise = vb.sqrt() / b;
        println!("{spp} spp: bias {bias:.5} ± {error:.5}, noise of an even picture's mean {noise:.5}");
        assert!(bias.abs() < most && bias.abs() < noise, "{spp} spp: {bias} ± {error}, noise {noise}");
    }
}

#[test]
fn parts_add_up_to_an_adaptive_film_exactly() {
    let (scene, settings) = (half_empty(), adaptive());
    let uniform = RenderSettings { allocation: SampleAllocation::Uniform, ..settings };
    let film = rendered(&scene, &settings, 32);
    let most = film.sample_counts().2;
    let mut part = Film::new(75, 50).starting_at(most);
    assert!(advance(&scene, &uniform, &mut part, 8, &NEVER).completed);
    let (mut ours, mut theirs) = (film.clone(), part.clone());
    ours.merge(&part).unwrap();
    theirs.merge(&film).unwrap();
    assert!(ours.to_record() == theirs.to_record());
    assert_eq!(ours.spp(), 40);
    for (x, y) in [(2, 2), (37, 33), (74, 49)] {
        assert_eq!(ours.samples(x, y), film.samples(x, y) + 8);
        let (n, m) = (f64::from(film.samples(x, y)), 8.0);
        let expected = (film.mean(x, y).as_dvec3() * n + part.mean(x, y).as_dvec3() * m) / (n + m);
        assert!((ours.mean(x, y).as_dvec3() - expected).abs().max_element() < 1e-6);
    }
    // It goes on from there, and a block that both have is refused.
    let before = ours.to_record();
    assert!(advance(&scene, &settings, &mut ours, 64, &NEVER).completed);
    assert_eq!(ours.spp(), 64);
    let mut again = Film::from_record(&before).unwrap();
    advance(&scene, &settings, &mut again, 48, &NEVER);
    assert!(advance(&scene, &settings, &mut again, 64, &NEVER).completed);
    assert!(again.to_record() == ours.to_record());
    assert!(matches!(ours.merge(&part), Err(MergeError::SharedSamples { .. })));
}
