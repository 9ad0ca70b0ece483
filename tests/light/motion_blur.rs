//! Scenes that move while the shutter is open: closed forms, the mean over still frames, and the same bytes however the work
//! is divided.

use crate::caustics::error;
use crate::common::*;
use crate::determinism::{busy_scene, with_threads};
use firstlight::render::{
    Camera, CausticPlan, ColorInput, Environment, ErrorMetric, Exposed, Film, Material, Moments, PixelFilter, Prepared,
    RenderSettings, SampleAllocation, Techniques, advance, advance_region, explain, light_traced, moment_of_sample,
    replay_sample,
};
use glam::{DVec3, Quat, UVec2, Vec3};
use std::sync::atomic::{AtomicU32, Ordering};

const NEVER: fn() -> bool = || false;

fn settings(seed: u32) -> RenderSettings {
    RenderSettings { seed, ..RenderSettings::default() }
}

fn adaptive(seed: u32) -> RenderSettings {
    let allocation = SampleAllocation::Adaptive(ErrorMetric::RelativeMse);
    RenderSettings { allocation, ..settings(seed) }
}

/// Light paths and guiding whatever a pilot thinks of them.
fn with_light_paths(seed: u32) -> RenderSettings {
    let plan = Some(CausticPlan { light_path_stride: 2, guided: true });
    RenderSettings { techniques: Techniques { caustic_plan: plan, ..Techniques::ALL }, ..settings(seed) }
}

fn adaptive_with_light_paths(seed: u32) -> RenderSettings {
    RenderSettings { allocation: adaptive(0).allocation, ..with_light_paths(seed) }
}

fn blurred(moments: &dyn Moments, settings: &RenderSettings, (width, height): (u32, u32), spp: u32) -> Film {
    let mut film = Film::new(width, height);
    let middle = moments.at(0.5);
    let report = advance(Exposed::moving(&middle, moments), settings, &mut film, spp, &NEVER);
    assert!(report.completed && film.spp() == spp);
    assert_eq!((report.n_bad, report.n_above), (0, 0), "{:?} {:?}", report.bad, report.above);
    film
}

fn means(film: &Film) -> Vec<DVec3> {
    film.means().iter().map(|mean| mean.as_dvec3()).collect()
}

fn add(a: &[DVec3], b: &[DVec3]) -> Vec<DVec3> {
    a.iter().zip(b).map(|(a, b)| *a + *b).collect()
}

fn square_distance(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (*a - *b).length_squared()).sum()
}

/// What a bright quad leaves in a pixel that it moves across: the share of the time, a trapezoid, its mean over the pixel.
///
/// - `pixel`, `from`: left and right ends, of the quad when the shutter opens.
/// - `moves`: how far it comes.
fn coverage(pixel: [f64; 2], from: [f64; 2], moves: f64) -> f64 {
    const STEPS: u32 = 10_000;
    let at = |i: u32| pixel[0] + (f64::from(i) + 0.5) / f64::from(STEPS) * (pixel[1] - pixel[0]);
    let share = |x: f64| {
        // At which times its right end has passed, and its left end has not.
        let times = [(x - from[1]) / moves, (x - from[0]) / moves].map(|time| time.clamp(0.0, 1.0));
        times[1] - times[0]
    };
    (0..STEPS).map(|i| share(at(i))).sum::<f64>() / f64::from(STEPS)
}

/// Compares a film of bright and black with the shares that its columns should show.
fn assert_coverage(film: &Film, spp: u32, expected: impl Fn(u32) -> f64) {
    let n = f64::from(spp);
    for x in 0..film.width() {
        let share = expected(x);
        let mut mean = 0.0;
        for y in 0..film.height() {
            let seen = f64::from(film.mean(x, y).x);
            // What independent samples scatter by.
            let deviation = (share * (1.0 - share) / n).sqrt();
            assert!((seen - share).abs() < 4.5 * deviation + 1e-6, "{x},{y}: {seen}, expected {share} ± {deviation}");
            mean += seen / f64::from(film.height());
        }
        // All pixels have the same moments; even ones miss each of the two edges by less than one of them.
        let deviation = (share * (1.0 - share) / n / f64::from(film.height())).sqrt();
        assert!((mean - share).abs() < 2.0 / n + 3.0 * deviation + 1e-6, "column {x}: {mean}, expected {share}");
    }
}

#[test]
fn a_quad_that_moves_leaves_a_trapezoid() {
    const SPP: u32 = 1024;
    let moments = |open: f64| {
        let corner = Vec3::new(-0.71 + 0.9 * open as f32, -5.0, 0.0);
        let eye = camera(Vec3::Z * 2.0, Vec3::ZERO, 53.130_1);
        scene(vec![(quad(corner, Vec3::X * 0.5, Vec3::Y * 10.0), 0)], vec![emissive(1.0)], Environment::Black, eye)
    };
    // Two metres of the plane of the quad are seen, in 24 columns.
    let film = blurred(&moments, &settings(1), (24, 24), SPP);
    let edge = |x: u32| f64::from(x) / 12.0 - 1.0;
    assert_coverage(&film, SPP, |x| coverage([edge(x), edge(x + 1)], [-0.71, -0.21], 0.9));
    let total: f64 = means(&film).iter().map(|mean| mean.x).sum::<f64>() / 24.0 / 12.0;
    assert!((total - 0.5).abs() < 1e-3, "the quad is 0.5 m wide, its blur {total} m");
}

#[test]
fn a_camera_that_moves_blurs_what_stands_still() {
    const SPP: u32 = 1024;
    for orthographic in [None, Some(1.0)] {
        let moments = |open: f64| {
            let to = Vec3::X * (0.6 * open as f32);
            let eye = Camera { orthographic, ..camera(Vec3::Z * 2.0 - to, -to, 53.130_1) };
            let bright = quad(Vec3::new(-0.4, -5.0, 0.0), Vec3::X * 0.3, Vec3::Y * 10.0);
            scene(vec![(bright, 0)], vec![emissive(1.0)], Environment::Black, eye)
        };
        let film = blurred(&moments, &settings(2), (24, 24), SPP);
        let edge = |x: u32| f64::from(x) / 12.0 - 1.0;
        assert_coverage(&film, SPP, |x| coverage([edge(x), edge(x + 1)], [-0.4, -0.1], 0.6));
    }
}

/// The mean over still frames at moments of their own, in even intervals.
fn mean_of_stills(
    moments: &dyn Moments,
    settings: &RenderSettings,
    size: (u32, u32),
    frames: u32,
    spp: u32,
) -> Vec<DVec3> {
    let jitter = |i: u32| moment_of_sample(&RenderSettings { seed: !settings.seed, ..*settings }, i);
    let mut sum = vec![DVec3::ZERO; (size.0 * size.1) as usize];
    for i in 0..frames {
        let still = moments.at((f64::from(i) + jitter(i)) / f64::from(frames));
        let settings = RenderSettings { seed: settings.seed + 1000 * i, ..*settings };
        sum = add(&sum, &means(&render(&still, &settings, size.0, size.1, spp).0));
    }
    sum.iter().map(|sum| *sum / f64::from(frames)).collect()
}

/// That the film converges to the mean over still frames: the two differ by no more than by what each scatters.
fn assert_is_mean_of_stills(name: &str, moments: &dyn Moments, settings_of: fn(u32) -> RenderSettings, spp: u32) {
    const SIZE: (u32, u32) = (32, 24);
    const RENDERS: u32 = 4;
    let ours: Vec<_> = (1..=RENDERS).map(|seed| means(&blurred(moments, &settings_of(seed), SIZE, spp))).collect();
    let stills: Vec<_> =
        (101..=100 + RENDERS).map(|seed| mean_of_stills(moments, &settings_of(seed), SIZE, spp / 4, 4)).collect();
    // Squared distance of a mean over the renders from the truth, as they tell it.
    let n = f64::from(RENDERS);
    let mean_and_scatter = |renders: &[Vec<DVec3>]| {
        let sum = renders.iter().fold(vec![DVec3::ZERO; renders[0].len()], |sum, render| add(&sum, render));
        let mean: Vec<_> = sum.iter().map(|sum| *sum / n).collect();
        let scatter = renders.iter().map(|render| square_distance(render, &mean)).sum::<f64>() / (n * (n - 1.0));
        (mean, scatter)
    };
    let ((a, of_a), (b, of_b)) = (mean_and_scatter(&ours), mean_and_scatter(&stills));
    let light = |of: &[DVec3]| of.iter().map(|mean| mean.element_sum()).sum::<f64>();
    let ratio = square_distance(&a, &b) / (of_a + of_b);
    let apart = light(&a) / light(&b) - 1.0;
    println!("{name}: squared distance over what scatter makes of it {ratio:.3}; total light differs by {apart:.5}");
    // Some hundred pixels count; few bright ones can count for many.
    assert!((0.4..1.7).contains(&ratio), "{name}: {ratio}");
    assert!(apart.abs() < 0.01, "{name}: {apart}");
    // There is something to be seen of the motion: a still frame is far off.
    let still = means(&render(&moments.at(0.5), &settings_of(50), SIZE.0, SIZE.1, spp).0);
    assert!(square_distance(&still, &b) > 20.0 * (of_a + of_b), "{name}");
}

fn lamp() -> firstlight::kdtree::Shape {
    quad(Vec3::new(-0.3, 2.6, -0.3), Vec3::X * 0.6, Vec3::Z * 0.6)
}

fn eye() -> Camera {
    camera(Vec3::new(0.3, 1.6, 4.0), Vec3::new(0.0, 0.4, 0.0), 40.0)
}

fn turning_blade(open: f64) -> Prepared {
    let turn = Quat::from_rotation_y(0.4 + 1.9 * open as f32) * Quat::from_rotation_z(open as f32);
    let blade = quad(turn * Vec3::new(-0.9, -0.3, 0.0) + Vec3::Y * 0.7, turn * Vec3::X * 1.8, turn * Vec3::Y * 0.6);
    let shapes = vec![(plane(Vec3::ZERO, Vec3::Y), 0), (lamp(), 1), (blade, 2)];
    scene(shapes, vec![diffuse(0.5), emissive(12.0), diffuse(0.8)], Environment::Constant(Vec3::splat(0.2)), eye())
}

/// So many lights that they are found through the tree of lights, one of which moves and grows brighter.
fn moving_light(open: f64) -> Prepared {
    let open = open as f32;
    let mut shapes = vec![(plane(Vec3::ZERO, Vec3::Y), 0), (sphere(Vec3::new(0.0, 0.4, 0.0), 0.4), 0)];
    shapes.push((sphere(Vec3::new(-1.5 + 3.0 * open, 1.5, 0.5), 0.15), 1));
    let others = (0..24).map(|i| Vec3::new((i % 6) as f32 * 0.6 - 1.5, 2.5, (i / 6) as f32 * 0.6 - 1.5));
    shapes.extend(others.map(|at| (sphere(at, 0.02), 2)));
    scene(shapes, vec![diffuse(0.7), emissive(5.0 + 20.0 * open), emissive(6.0)], Environment::Black, eye())
}

/// With a mirror, in which the caustic is seen: for those camera paths are guided.
fn moving_glass(open: f64) -> Prepared {
    let open = open as f32;
    let mirror = Material::Mirror { reflectance: ColorInput::Constant(Vec3::splat(0.9)) };
    let glass = Material::Glass { ior: 1.5, absorption: Vec3::new(0.1, 0.6, 0.9), dispersion: 0.0 };
    let back = quad(Vec3::new(-2.0, 0.0, -1.2), Vec3::X * 4.0, Vec3::Y * 3.0);
    let ball = sphere(Vec3::new(-0.6 + 1.2 * open, 0.5 + 0.4 * open, 0.1), 0.4);
    let shapes = vec![(plane(Vec3::ZERO, Vec3::Y), 0), (lamp(), 1), (back, 3), (ball, 2)];
    scene(shapes, vec![diffuse(0.6), emissive(15.0), glass, mirror], Environment::Black, eye())
}

#[test]
fn an_object_that_turns_is_the_mean_of_still_frames() {
    assert_is_mean_of_stills("blade", &turning_blade, settings, 256);
}

#[test]
fn a_light_that_moves_and_its_shadow_are_the_mean_of_still_frames() {
    assert_is_mean_of_stills("light", &moving_light, settings, 256);
}

#[test]
fn caustics_of_a_glass_ball_that_moves_are_the_mean_of_still_frames() {
    let film = blurred(&moving_glass, &with_light_paths(1), (32, 24), 8);
    assert!((0..24).any(|y| (0..32).any(|x| film.light_traced(x, y) != DVec3::ZERO)));
    assert_is_mean_of_stills("glass", &moving_glass, with_light_paths, 256);
}

/// Each sample is right by itself: the mean over many pictures of two samples is that of one of many.
#[test]
fn few_samples_have_the_right_mean() {
    const RENDERS: u32 = 600;
    for (name, moments, settings_of) in [
        ("light", moving_light as fn(f64) -> Prepared, settings as fn(u32) -> RenderSettings),
        ("glass", moving_glass, with_light_paths),
    ] {
        let mean = |film: &Film| means(film).iter().map(|mean| mean.element_sum() / 3.0).sum::<f64>() / (16.0 * 12.0);
        let few: Vec<f64> =
            (0..RENDERS).map(|k| mean(&blurred(&moments, &settings_of(500 + k), (16, 12), 2))).collect();
        let truth: Vec<f64> = (0..4).map(|k| mean(&blurred(&moments, &settings_of(k), (16, 12), 1024))).collect();
        let of = |values: &[f64]| {
            let n = values.len() as f64;
            let mean = values.iter().sum::<f64>() / n;
            (mean, values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n * (n - 1.0)))
        };
        let ((a, va), (b, vb)) = (of(&few), of(&truth));
        let z = (a - b) / (va + vb).sqrt();
        println!("{name}: {a:.5} of two samples, {b:.5}; {z:.2} standard deviations");
        assert!(z.abs() < 3.5, "{name}: {a} and {b}, {z} standard deviations");
        assert!(va.sqrt() < 0.02 * b, "{name}: too few renders to tell");
    }
}

/// What a film knows, to the last bit.
fn bits(film: &Film) -> (Vec<[u32; 3]>, Vec<u32>, Option<u64>) {
    let places = (0..film.height()).flat_map(|y| (0..film.width()).map(move |x| (x, y)));
    let pixels = film.means().iter().map(|mean| mean.to_array().map(f32::to_bits)).collect();
    let counts = places.map(|(x, y)| film.samples(x, y)).collect();
    (pixels, counts, film.error_estimate().map(|estimate| estimate.relative.to_bits()))
}

#[test]
fn a_scene_that_stands_still_has_the_same_bits_with_a_shutter() {
    for (name, still) in [("busy", busy_scene()), ("glass", moving_glass(0.3))] {
        let moments = |_: f64| Prepared::new((*still).clone());
        let gaussian = RenderSettings { filter: PixelFilter::Gaussian, ..with_light_paths(7) };
        for settings in [settings(3), adaptive(4), gaussian] {
            let mut plain = Film::new(75, 50);
            assert!(advance(&still, &settings, &mut plain, 24, &NEVER).completed);
            let film = blurred(&moments, &settings, (75, 50), 24);
            assert!(film.to_record() == plain.to_record(), "{name}, {settings:?}");
        }
    }
}

#[test]
fn threads_tiles_portions_and_stops_change_nothing() {
    let middle = moving_glass(0.5);
    let scene = Exposed::moving(&middle, &moving_glass);
    for settings in [settings(1), adaptive(2), with_light_paths(3), adaptive_with_light_paths(4)] {
        let film = |threads, tile_size, portions: &[u32]| {
            with_threads(threads, || {
                let mut film = Film::with_tile_size(75, 50, tile_size);
                for &target in portions {
                    // Stopped in the middle, kept, and taken up again.
                    let asked = AtomicU32::new(0);
                    let stop = || asked.fetch_add(1, Ordering::Relaxed) > 30 * target;
                    advance(scene, &settings, &mut film, target, &stop);
                    film = Film::from_record(&film.to_record()).unwrap();
                    assert!(advance(scene, &settings, &mut film, target, &NEVER).completed);
                    assert_eq!((film.spp(), film.max_spp()), (target, target));
                }
                film
            })
        };
        let expected = film(1, 32, &[40]);
        for (threads, portions) in [(2, &[40][..]), (3, &[1, 7, 20, 40]), (1, &[16, 33, 40]), (8, &[9, 40])] {
            assert!(film(threads, 32, portions).to_record() == expected.to_record(), "{threads} threads, {portions:?}");
        }
        // Which blocks get more samples is decided by levels of light, which tiles look at each for itself.
        let (pixels, counts, _) = bits(&expected);
        for tile_size in [8, 128].into_iter().filter(|_| settings.allocation == SampleAllocation::Uniform) {
            let (other_pixels, other_counts, _) = bits(&film(2, tile_size, &[40]));
            assert!(other_pixels == pixels && other_counts == counts, "tiles of {tile_size}");
        }
    }
}

#[test]
fn parts_add_up_to_the_whole_and_regions_have_its_samples() {
    for settings in [settings(5), with_light_paths(6)] {
        let middle = moving_glass(0.5);
        let scene = Exposed::moving(&middle, &moving_glass);
        let part = |samples: std::ops::Range<u32>| {
            let mut film = Film::new(61, 47).starting_at(samples.start);
            assert!(advance(scene, &settings, &mut film, samples.end - samples.start, &NEVER).completed);
            film
        };
        let whole = part(0..48);
        let mut sum = part(32..48);
        sum.merge(&part(0..5)).unwrap();
        sum.merge(&part(5..32)).unwrap();
        assert!(bits(&sum).0 == bits(&whole).0);
        // Samples of one pixel alone are those of the film.
        let size = UVec2::new(61, 47);
        let mut total = DVec3::ZERO;
        for sample in 0..48 {
            let at = firstlight::render::BadSample { x: 30, y: 24, sample };
            total += replay_sample(scene, &settings, size, at).as_dvec3() / 48.0;
        }
        let traced = light_traced(scene, &settings, size, UVec2::new(30, 24), 0..48, &NEVER).unwrap();
        let seen = whole.mean(30, 24).as_dvec3();
        assert!((total + traced - seen).abs().max_element() < 1e-6, "{total} + {traced}, film {seen}");
        let explained = explain(scene, &settings, size, UVec2::new(30, 24), 0..48).unwrap();
        assert!((explained.mean() - total).abs().max_element() < 1e-6);
    }
    let (middle, settings) = (turning_blade(0.5), settings(8));
    let scene = Exposed::moving(&middle, &turning_blade);
    let whole = blurred(&turning_blade, &settings, (61, 47), 20);
    let mut film = blurred(&turning_blade, &settings, (61, 47), 4);
    let region = film.region(UVec2::new(33, 12), UVec2::new(50, 30)).unwrap();
    assert!(advance_region(scene, &settings, &mut film, Some(&region), 20, &NEVER).completed);
    assert!(film.mean(40, 20) == whole.mean(40, 20) && film.samples(3, 3) == 4);
    assert!(advance(scene, &settings, &mut film, 20, &NEVER).completed);
    assert!(film.to_record() == whole.to_record());
}

/// All pixels share their moments, and blur is smooth in time: the estimate must not take that for less or more error.
#[test]
fn the_error_estimate_holds_for_what_moves() {
    for (name, moments, settings_of) in [
        ("blade", turning_blade as fn(f64) -> Prepared, settings as fn(u32) -> RenderSettings),
        ("blade, adaptive", turning_blade, adaptive),
        ("shadow", moving_shadow, settings),
        ("quad", flying_quad, settings),
    ] {
        let truth = blurred(&moments, &settings(999), (48, 32), 2048);
        for spp in [32, 128] {
            let (mut told, mut actual) = (0.0, 0.0);
            for seed in 0..12 {
                let film = blurred(&moments, &settings_of(seed), (48, 32), spp);
                told += film.error_estimate().unwrap().relative.powi(2);
                actual += error(&film, &truth).powi(2);
            }
            let ratio = (told / actual).sqrt();
            println!("{name}, {spp} spp: estimate over error {ratio:.3}");
            assert!((0.8..1.25).contains(&ratio), "{name}, {spp} spp: {ratio}");
        }
    }
}

/// Of a lamp that passes over a ball.
fn moving_shadow(open: f64) -> Prepared {
    let lamp = sphere(Vec3::new(-1.5 + 3.0 * open as f32, 2.5, 0.5), 0.3);
    let shapes = vec![(plane(Vec3::ZERO, Vec3::Y), 0), (sphere(Vec3::new(0.0, 0.4, 0.0), 0.4), 0), (lamp, 1)];
    scene(shapes, vec![diffuse(0.7), emissive(5.0 + 10.0 * open as f32)], Environment::Black, eye())
}

/// Bright and fast, over grey: hardly any noise but that of moments.
fn flying_quad(open: f64) -> Prepared {
    let corner = Vec3::new(-1.2 + 1.4 * open as f32, 0.2, 0.5);
    let shapes = vec![(quad(corner, Vec3::X * 0.5, Vec3::Y * 0.8), 0)];
    scene(shapes, vec![emissive(2.0)], Environment::Constant(Vec3::splat(0.3)), eye())
}
