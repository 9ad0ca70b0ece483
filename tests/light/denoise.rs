//! Denoised pictures of scenes against references: better than the raw ones, from one sample to many.

use crate::common::*;
use firstlight::render::{
    ColorInput, Denoised, Environment, Film, GuideGatherer, Material, MovingFilter, MovingImage, Prepared, Relighting,
    RenderSettings, ScalarInput, SurfaceGuides, advance, denoise_film, gather_features, gather_guides, relight,
    smooth_film,
};
use glam::{UVec2, Vec3};

const SIZE: (u32, u32) = (64, 48);

fn denoised(scene: &Prepared, film: &Film) -> Denoised {
    let settings = RenderSettings::default();
    let guides = gather_guides(scene, &settings, UVec2::from(SIZE), 16, &|| false).expect("nothing stops it");
    denoise_film(film, &guides, &|| false).expect("nothing stops it")
}

fn relative_mse(colors: &[Vec3], reference: &[Vec3]) -> f64 {
    let of = |(color, truth): (&Vec3, &Vec3)| {
        let off = *color - *truth;
        f64::from((off * off / (*truth * *truth + 0.01)).element_sum())
    };
    colors.iter().zip(reference).map(of).sum::<f64>() / (3 * colors.len()) as f64
}

fn mirror() -> Material {
    Material::Mirror { reflectance: ColorInput::Constant(Vec3::splat(0.9)) }
}

/// A sphere that throws a shadow, a mirror, and a lamp that is seen.
fn room() -> Prepared {
    scene(
        vec![
            (plane(Vec3::Y * -1.0, Vec3::Y), 0),
            (plane(Vec3::Z * -4.0, Vec3::Z), 1),
            (sphere(Vec3::new(-0.8, -0.3, -2.0), 0.7), 1),
            (sphere(Vec3::new(1.0, -0.4, -2.2), 0.6), 2),
            (quad(Vec3::new(-0.5, 1.6, -3.0), Vec3::X, Vec3::Z * 0.8), 3),
        ],
        vec![diffuse(0.3), diffuse(0.7), mirror(), emissive(12.0)],
        Environment::Constant(Vec3::splat(0.05)),
        camera(Vec3::new(0.0, 0.5, 3.0), Vec3::new(0.0, 0.0, -2.0), 55.0),
    )
}

#[test]
fn no_number_of_samples_makes_it_worse_than_raw() {
    let scene = room();
    let mut reference = Film::new(SIZE.0, SIZE.1);
    let settings = RenderSettings { seed: 99, ..RenderSettings::default() };
    advance(&scene, &settings, &mut reference, 2048, &|| false);
    let reference = reference.means();
    let mut film = Film::new(SIZE.0, SIZE.1);
    for (spp, most) in [(1, 0.3), (3, 0.5), (4, 0.5), (16, 0.7), (40, 1.0), (128, 1.05)] {
        advance(&scene, &RenderSettings::default(), &mut film, spp, &|| false);
        let found = denoised(&scene, &film);
        let (raw, error) = (relative_mse(&film.means(), &reference), relative_mse(&found.color, &reference));
        assert!(error < most * raw, "{spp} samples: {error} of {raw}");
        let told = found.error / error.sqrt();
        println!("{spp}: {} told {told}", error / raw);
        assert!(spp < 16 || (0.65..1.5).contains(&told), "{spp} samples: told {} for {}", found.error, error.sqrt());
    }
}

/// What is seen of a light without scattering is in the guides: its edges are sharp with few samples, in a mirror and in
/// glass too, where most samples take the other path.
#[test]
fn lights_that_are_seen_have_sharp_edges() {
    let glass = Material::Glass { ior: 1.5, absorption: Vec3::ZERO, dispersion: 0.0 };
    let scene = scene(
        vec![
            (plane(Vec3::Y * -1.0, Vec3::Y), 0),
            (quad(Vec3::new(-1.0, 1.5, -3.0), Vec3::X * 2.0, Vec3::Y * 0.5), 1),
            (quad(Vec3::new(-2.0, -0.9, -2.5), Vec3::X * 1.2, Vec3::new(0.0, 1.5, -1.0)), 2),
            (sphere(Vec3::new(0.6, -0.1, -1.0), 0.8), 3),
        ],
        vec![diffuse(0.3), emissive(4.0), mirror(), glass],
        Environment::Black,
        camera(Vec3::new(0.0, 0.5, 3.0), Vec3::new(0.0, 0.2, -2.0), 55.0),
    );
    let guides = gather_guides(&scene, &RenderSettings::default(), UVec2::from(SIZE), 64, &|| false).expect("no stop");
    let is_lit = |i: usize| guides.emitted[i] != Vec3::ZERO;
    let lit = (0..guides.emitted.len()).filter(|&i| is_lit(i));
    let (n_direct, n_lit) = (lit.clone().filter(|&i| guides.emitted[i].x > 3.99).count(), lit.clone().count());
    assert!(n_direct > 40 && n_lit > 2 * n_direct && n_lit < guides.emitted.len() / 3, "{n_direct} of {n_lit}");
    assert!(lit.clone().all(|i| guides.emitters[i]), "no light without an emitter");
    let mut reference = Film::new(SIZE.0, SIZE.1);
    advance(&scene, &RenderSettings { seed: 99, ..RenderSettings::default() }, &mut reference, 1024, &|| false);
    let of_lit = |colors: &[Vec3]| lit.clone().map(|i| colors[i]).collect::<Vec<_>>();
    let reference = of_lit(&reference.means());
    let mut film = Film::new(SIZE.0, SIZE.1);
    advance(&scene, &RenderSettings::default(), &mut film, 4, &|| false);
    let error_with = |guides: &SurfaceGuides| {
        let found = denoise_film(&film, guides, &|| false).expect("nothing stops it");
        relative_mse(&of_lit(&found.color), &reference)
    };
    let unlit = SurfaceGuides { emitted: vec![Vec3::ZERO; guides.emitted.len()], ..guides.clone() };
    let (error, unguided) = (error_with(&guides), error_with(&unlit));
    let raw = relative_mse(&of_lit(&film.means()), &reference);
    assert!(error < 0.25 * raw && error < 0.5 * unguided, "{error} of {raw}, {unguided} without");
}

/// Between two powers of two, the film knows what came since the last one beside the step of that one.
#[test]
fn what_came_since_the_last_doubling_is_the_change_of_the_mean() {
    let scene = room();
    let mut film = Film::new(SIZE.0, SIZE.1);
    let mut to = |spp| {
        advance(&scene, &RenderSettings::default(), &mut film, spp, &|| false);
        (film.means(), film.half_steps().expect("from two samples on"))
    };
    let ((of_two, _), (of_four, at_four), (of_six, at_six)) = (to(2), to(4), to(6));
    let is_near = |a: Vec3, b: Vec3| (a - b).abs().max_element() <= 1e-5 * (1.0 + b.abs().max_element());
    for pixel in 0..of_four.len() {
        assert!(is_near(at_four.steps[pixel], of_four[pixel] - of_two[pixel]), "{pixel}");
        assert!(is_near(at_four.late[pixel], Vec3::ZERO) && at_four.doubled[pixel] == 1.0, "{pixel}");
        assert_eq!(at_six.steps[pixel], at_four.steps[pixel]);
        assert!(is_near(at_six.late[pixel], of_six[pixel] - of_four[pixel]), "{pixel}");
        assert!((at_six.doubled[pixel] - 4.0 / 6.0).abs() < 1e-6);
    }
}

/// Guides can be had at once and be made better later.
#[test]
fn guides_in_steps_are_those_of_one_pass_and_of_feature_buffers() {
    let scene = room();
    for simd in [RenderSettings::default().simd, None] {
        let settings = RenderSettings { simd, ..RenderSettings::default() };
        let size = UVec2::new(150, 61);
        let gather = |samples| gather_guides(&scene, &settings, size, samples, &|| false).expect("nothing stops it");
        let mut steps = GuideGatherer::default();
        // What a view leaves behind is not seen by the next one.
        for size in [UVec2::new(64, 40), size] {
            steps.start(size);
            assert!(steps.gather(&scene, &RenderSettings { seed: 3, ..settings }, 2, &|| false));
        }
        for is_stopped in [false, true] {
            if is_stopped {
                assert!(!steps.gather(&scene, &settings, 100, &|| true), "it is told to stop");
                assert_eq!(steps.samples(), 0);
            }
            steps.start(size);
            for samples in [1, 4, 4, 7, 16, 18, 64] {
                assert!(steps.gather(&scene, &settings, samples, &|| false));
                assert_eq!(steps.samples(), samples);
                assert_eq!(*steps.guides(), gather(samples), "{samples} samples, {simd:?}");
            }
        }
        // The seed of the guides differs from that of the image.
        let other = RenderSettings { seed: settings.seed ^ 0x9e37_79b9, ..settings };
        let features = |samples| gather_features(&scene, &other, size, samples, &|| false).expect("nothing stops it");
        let (guides, of_all) = (gather(16), features(16));
        assert_eq!(guides.albedo, of_all.albedo);
        assert_eq!(guides.normal, of_all.normal);
        assert_eq!(guides.depth, of_all.depth);
        // Further samples of those pixels only that need them, but of all that do.
        let (better, of_all) = (steps.guides(), features(64));
        let n_better = (0..better.depth.len()).filter(|&i| better.depth[i] != guides.depth[i]).count();
        assert!(n_better > 100 && n_better < better.depth.len() / 3, "{n_better}");
        let mut n_off = 0;
        for i in 0..better.depth.len() {
            let is_better = better.depth[i] != guides.depth[i];
            assert!(!is_better || better.albedo[i] == of_all.albedo[i] && better.normal[i] == of_all.normal[i], "{i}");
            let off = better.albedo[i] - of_all.albedo[i];
            n_off += usize::from(off.length() > 0.06 * of_all.albedo[i].length());
        }
        // What none of the first samples has seen.
        assert!(n_off < better.depth.len() / 200, "{n_off}");
        let n_emitters = guides.emitters.iter().filter(|emits| **emits).count();
        assert!(n_emitters > 0 && n_emitters < guides.emitters.len() / 4, "{n_emitters}");
    }
}

/// An image of a moving camera: one sample per pixel, and what its own paths note of surfaces.
#[test]
fn a_coarse_film_is_smoothed_from_its_first_sample_on() {
    let scene = room();
    let settings = RenderSettings::default();
    let mut reference = Film::new(SIZE.0, SIZE.1);
    advance(&scene, &RenderSettings { seed: 99, ..settings }, &mut reference, 512, &|| false);
    let mut filter = MovingFilter::default();
    for simd in [settings.simd, None] {
        let settings = RenderSettings { simd, ..settings };
        let mut plain = Film::new(SIZE.0, SIZE.1);
        advance(&scene, &settings, &mut plain, 1, &|| false);
        assert_eq!(smooth_film(&mut filter, &scene, &settings, &plain, &|| false), None, "nothing was noted");
        let mut film = Film::new(SIZE.0, SIZE.1);
        film.note_surfaces();
        advance(&scene, &settings, &mut film, 1, &|| false);
        assert_eq!(film.means(), plain.means(), "noting changes no sample");
        let smooth = smooth_film(&mut filter, &scene, &settings, &film, &|| false).expect("surfaces are noted");
        let (raw, error) = (relative_mse(&film.means(), &reference.means()), relative_mse(smooth, &reference.means()));
        assert!(error < 0.4 * raw, "{error} of {raw}");
        assert_eq!(smooth_film(&mut filter, &scene, &settings, &film, &|| true), None);
        film.clear();
        assert_eq!(
            smooth_film(&mut filter, &scene, &settings, &film, &|| false),
            None,
            "a film that is cleared notes nothing"
        );
    }
}

/// An image of a moving camera: light of a quarter of the resolution on surfaces of all of it.
#[test]
fn coarse_light_is_put_on_surfaces_of_the_full_resolution() {
    let scene = room();
    let settings = RenderSettings::default();
    let mut reference = Film::new(SIZE.0, SIZE.1);
    advance(&scene, &RenderSettings { seed: 99, ..settings }, &mut reference, 512, &|| false);
    let (width, height) = (SIZE.0.div_ceil(4), SIZE.1.div_ceil(4));
    let mut film = Film::new(width, height);
    film.note_surfaces();
    advance(&scene, &settings, &mut film, 16, &|| false);
    let mut image = MovingImage::default();
    let coarse = smooth_film(&mut image.filter, &scene, &settings, &film, &|| false).expect("surfaces are noted");
    let pixels = (0..SIZE.1).flat_map(|y| (0..SIZE.0).map(move |x| y / 4 * width + x / 4));
    let enlarged: Vec<Vec3> = pixels.map(|i| coarse[i as usize]).collect();
    let window = SIZE.into();
    let how = Relighting { surfaces: window, weight: 1.0, window, exposure: 1.0 };
    assert_eq!(relight(&mut image, &scene, &settings, &film, &how, &|| true), None);
    let (relit, size) = relight(&mut image, &scene, &settings, &film, &how, &|| false).expect("nothing stops it");
    assert_eq!(size, window);
    let [coarse, error] = [&enlarged[..], relit].map(|colors| relative_mse(colors, &reference.means()));
    assert!(error < 0.4 * coarse, "{error} of {coarse}");
}

/// What its paths meet after it scatters them, here nothing, is not what is seen in it.
#[test]
fn a_surface_that_reflects_a_share_of_the_light_is_no_mirror() {
    let phong = Material::Phong {
        diffuse: ColorInput::Constant(Vec3::splat(0.5)),
        ambient: 0.0,
        specular: ScalarInput::Constant(0.1),
        shininess: 20.0,
        transparency: 0.0,
        ior: 1.5,
        absorption: Vec3::ZERO,
    };
    let over = camera(Vec3::new(0.0, 3.0, 0.1), Vec3::ZERO, 40.0);
    for (material, takes_part) in [(phong, true), (mirror(), false)] {
        let floor = vec![(plane(Vec3::ZERO, Vec3::Y), 0)];
        let scene = scene(floor, vec![material], Environment::Constant(Vec3::ONE), over);
        let mut film = Film::new(SIZE.0, SIZE.1);
        film.note_surfaces();
        advance(&scene, &RenderSettings::default(), &mut film, 1, &|| false);
        let mut filter = MovingFilter::default();
        smooth_film(&mut filter, &scene, &RenderSettings::default(), &film, &|| false).expect("surfaces are noted");
        let pixels = (0..SIZE.1 as usize).flat_map(|y| (0..SIZE.0 as usize).map(move |x| (x, y)));
        assert!(pixels.into_iter().all(|(x, y)| filter.takes_part(x, y) == takes_part), "{takes_part}");
    }
}

/// The same samples in other tiles, in two films, and by other threads.
#[test]
fn parts_tiles_and_threads_change_no_byte() {
    let scene = room();
    let settings = RenderSettings::default();
    let mut whole = Film::new(SIZE.0, SIZE.1);
    advance(&scene, &settings, &mut whole, 8, &|| false);
    let expected = denoised(&scene, &whole);

    let mut other_tiles = Film::with_tile_size(SIZE.0, SIZE.1, 16);
    advance(&scene, &settings, &mut other_tiles, 8, &|| false);
    // The scale of the variance is a mean over tiles, in their order.
    let off = |found: &Denoised| {
        let pairs = expected.color.iter().zip(&found.color);
        pairs.map(|(a, b)| (*a - *b).abs().max_element()).fold(0.0, f32::max)
    };
    assert!(off(&denoised(&scene, &other_tiles)) < 0.05);

    let mut parts = [0, 4].map(|first| {
        let mut film = Film::new(SIZE.0, SIZE.1).starting_at(first);
        advance(&scene, &settings, &mut film, 4, &|| false);
        film
    });
    let (first, second) = parts.split_at_mut(1);
    first[0].merge(&second[0]).unwrap();
    assert_eq!(denoised(&scene, &first[0]), expected);

    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(pool.install(|| denoised(&scene, &whole)), expected);
}
