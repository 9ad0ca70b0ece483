//! Feature buffers of scenes with an answer on paper.

use crate::common::*;
use firstlight::kdtree::InstructionSet;
use firstlight::render::{
    ColorInput, Environment, FeatureBuffers, Fresnel, Integrator, Material, PixelFilter, Prepared, RenderSettings,
    ScalarInput, Techniques, gather_features, gather_features_and_ids,
};
use glam::{UVec2, Vec3};

fn gather(scene: &Prepared, size: (u32, u32), samples: u32) -> FeatureBuffers {
    let settings = RenderSettings::default();
    gather_features_and_ids(scene, &settings, size.into(), samples, &|| false).expect("nothing stops it")
}

fn mirror(reflectance: f32) -> Material {
    Material::Mirror { reflectance: ColorInput::Constant(Vec3::splat(reflectance)) }
}

fn glass(ior: f32, absorption: f32) -> Material {
    Material::Glass { ior, absorption: Vec3::splat(absorption), dispersion: 0.0 }
}

fn ahead(vfov: f32) -> firstlight::render::Camera {
    camera(Vec3::ZERO, Vec3::NEG_Z, vfov)
}

#[test]
fn a_wall_has_its_depth_normal_and_position() {
    let scene = scene(
        vec![(plane(Vec3::Z * -5.0, Vec3::Z), 0)],
        vec![diffuse(0.4)],
        Environment::Constant(Vec3::ONE),
        ahead(90.0),
    );
    let (width, height) = (150, 20);
    let found = gather(&scene, (width, height), 16);
    let ids = found.ids.as_ref().unwrap();
    for y in 0..height {
        for x in 0..width {
            let i = (y * width + x) as usize;
            assert!((found.depth[i] - 5.0).abs() < 1e-4, "{x},{y}: {}", found.depth[i]);
            assert_eq!((found.albedo[i], found.normal[i], found.coverage[i]), (Vec3::splat(0.4), Vec3::Z, 1.0));
            assert_eq!((found.variance.albedo[i], found.variance.normal[i]), (Vec3::ZERO, Vec3::ZERO));
            // A pixel is half a metre high there, and its samples lie all over it.
            let middle = Vec3::new(x as f32 + 0.5 - 75.0, 10.0 - (y as f32 + 0.5), -10.0) * 0.5;
            assert!((found.position[i] - middle).length() < 0.05, "{x},{y}: {} for {middle}", found.position[i]);
            // 1/12 of a square of a pixel for one sample, a sixteenth of it for the mean.
            let expected = 0.25 / 12.0 / 16.0;
            assert!((found.variance.position[i].x / expected - 1.0).abs() < 0.4, "{}", found.variance.position[i]);
            assert!(found.variance.position[i].z < 1e-9);
            assert_eq!(ids.objects[i].iter().collect::<Vec<_>>(), [(0, 16)]);
            assert_eq!(ids.materials[i].iter().collect::<Vec<_>>(), [(0, 16)]);
        }
    }
}

/// Between the camera and the mirror 3 m, from there back to the wall behind the camera 7 m.
#[test]
fn a_mirror_shows_the_features_of_what_it_shows_but_is_itself_an_object() {
    let scene = scene(
        vec![(plane(Vec3::Z * -3.0, Vec3::Z), 0), (plane(Vec3::Z * 4.0, Vec3::NEG_Z), 1)],
        vec![mirror(0.8), diffuse(0.5)],
        Environment::Black,
        ahead(60.0),
    );
    let found = gather(&scene, (24, 24), 8);
    for i in 0..24 * 24 {
        assert!((found.depth[i] - 10.0).abs() < 1e-4, "{}", found.depth[i]);
        assert!((found.albedo[i] - 0.4).abs().max_element() < 1e-6, "{}", found.albedo[i]);
        assert_eq!(found.normal[i], Vec3::NEG_Z);
        assert!((found.position[i].z - 4.0).abs() < 1e-5);
        let ids = found.ids.as_ref().unwrap();
        assert_eq!(ids.objects[i].iter().collect::<Vec<_>>(), [(0, 8)]);
    }
}

/// Without refraction nothing is reflected, and 2 m of glass take their share.
#[test]
fn glass_tints_what_is_behind_it() {
    let scene = scene(
        vec![(sphere(Vec3::Z * -4.0, 1.0), 0), (plane(Vec3::Z * -9.0, Vec3::Z), 1)],
        vec![glass(1.0, 0.3), diffuse(0.5)],
        Environment::Black,
        ahead(0.1),
    );
    let found = gather(&scene, (8, 8), 4);
    for i in 0..64 {
        assert!((found.albedo[i].x - 0.5 * (-0.6_f32).exp()).abs() < 1e-5, "{}", found.albedo[i]);
        assert!((found.depth[i] - 9.0).abs() < 1e-4);
    }
}

/// All light that arrives is 1, so a sample of the picture is what its path has kept: the albedo of the same sample. The paths must
/// be the very same ones, through glass and off mirrors.
#[test]
fn in_an_evenly_white_world_the_picture_is_the_albedo() {
    let metal = Material::Metal {
        alpha: ScalarInput::Constant(0.0),
        reflectance: ColorInput::Constant(Vec3::new(0.9, 0.6, 0.3)),
        fresnel: Fresnel::Schlick,
        compensate: false,
    };
    for (name, material) in
        [("diffuse", diffuse(0.3)), ("mirror", mirror(0.7)), ("glass", glass(1.5, 0.2)), ("smooth metal", metal)]
    {
        for filter in [PixelFilter::Box, PixelFilter::Gaussian] {
            let scene = scene(
                vec![(sphere(Vec3::Z * -4.0, 1.3), 0)],
                vec![material.clone()],
                Environment::Constant(Vec3::ONE),
                ahead(50.0),
            );
            // Roulette is noise that features do not have.
            let techniques = Techniques { roulette: false, ..Techniques::ALL };
            let settings = RenderSettings { seed: 5, filter, techniques, ..RenderSettings::default() };
            let (film, _) = render(&scene, &settings, 40, 40, 16);
            let found = gather_features(&scene, &settings, UVec2::splat(40), 16, &|| false).unwrap();
            for (i, mean) in film.means().into_iter().enumerate() {
                let off = (mean - found.albedo[i]).abs().max_element();
                assert!(off < 2e-4, "{name}, {filter:?}, pixel {i}: {mean} for {}", found.albedo[i]);
            }
        }
    }
}

#[test]
fn emitters_keep_their_hue_and_the_environment_is_white() {
    let light = Material::Emissive { radiance: ColorInput::Constant(Vec3::new(8.0, 4.0, 0.0)) };
    let scene = scene(
        // Its front, and beside it the back of another, which is black.
        vec![
            (quad(Vec3::new(-4.0, -9.0, -3.0), Vec3::X * 4.0, Vec3::Y * 18.0), 0),
            (quad(Vec3::new(2.0, -9.0, -3.0), Vec3::Y * 18.0, Vec3::X * 4.0), 0),
        ],
        vec![light],
        Environment::Black,
        ahead(90.0),
    );
    let found = gather(&scene, (60, 20), 4);
    let at = |x: usize| 10 * 60 + x;
    assert_eq!(found.albedo[at(20)], Vec3::new(1.0, 0.5, 0.0));
    assert_eq!(found.albedo[at(45)], Vec3::ZERO);
    let between = at(32);
    assert_eq!((found.albedo[between], found.normal[between], found.coverage[between]), (Vec3::ONE, Vec3::ZERO, 0.0));
    assert_eq!(found.depth[between], f32::INFINITY);
    assert_eq!(found.ids.unwrap().objects[between].iter().count(), 0);
}

#[test]
fn an_edge_shares_a_pixel_between_two_objects() {
    // The edge runs a quarter into each pixel of column 3: pixels are a metre wide at 5 m.
    let scene = scene(
        vec![
            (quad(Vec3::new(-50.0, -50.0, -5.0), Vec3::X * 49.25, Vec3::Y * 100.0), 0),
            (plane(Vec3::Z * -9.0, Vec3::Z), 1),
        ],
        vec![diffuse(0.8), diffuse(0.2)],
        Environment::Black,
        ahead(90.0),
    );
    let found = gather(&scene, (8, 10), 64);
    let ids = found.ids.as_ref().unwrap();
    for y in 0..10 {
        let row = &ids.objects[8 * y..8 * y + 8];
        assert_eq!(row[2].iter().collect::<Vec<_>>(), [(0, 64)]);
        assert_eq!(row[4].iter().collect::<Vec<_>>(), [(1, 64)]);
        // Even samples split a pixel evenly.
        assert_eq!(row[3].iter().collect::<Vec<_>>(), [(1, 48), (0, 16)], "row {y}");
        assert!((found.albedo[8 * y + 3].x - 0.35).abs() < 1e-6);
        assert!(found.variance.albedo[8 * y + 3].x > 0.0);
    }
}

fn everything() -> Prepared {
    let checker = diffuse(0.6);
    scene(
        vec![
            (plane(Vec3::Y * -1.0, Vec3::Y), 0),
            (sphere(Vec3::new(-1.2, 0.0, -4.0), 1.0), 1),
            (sphere(Vec3::new(1.2, 0.0, -4.0), 1.0), 2),
            (sphere(Vec3::new(0.0, 0.4, -6.0), 1.2), 3),
            (quad(Vec3::new(-1.0, 3.0, -5.0), Vec3::X * 2.0, Vec3::Z * 2.0), 4),
            (sphere(Vec3::new(1.2, 0.0, -4.0), 0.4), 0),
        ],
        vec![checker, mirror(0.9), glass(1.5, 0.1), Material::blend(ScalarInput::Constant(0.3), 0, 1), emissive(3.0)],
        Environment::Constant(Vec3::ONE),
        ahead(60.0),
    )
}

#[test]
fn threads_instruction_sets_and_integrators_give_the_same_bits() {
    let scene = everything();
    let size = UVec2::new(150, 43);
    let reference = gather(&scene, size.into(), 5);
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        assert!(pool.install(|| gather(&scene, size.into(), 5)) == reference, "{threads} threads");
    }
    let sets = [None, Some(InstructionSet::Portable), Some(InstructionSet::detect())];
    for (simd, integrator) in
        sets.into_iter().flat_map(|simd| [Integrator::Path, Integrator::Phong].map(|integrator| (simd, integrator)))
    {
        let settings = RenderSettings { simd, integrator, ..RenderSettings::default() };
        let found = gather_features_and_ids(&scene, &settings, size, 5, &|| false).unwrap();
        assert!(found == reference, "{simd:?}, {integrator:?}");
    }
    let plain = gather_features(&scene, &RenderSettings::default(), size, 5, &|| false).unwrap();
    assert!(plain == FeatureBuffers { ids: None, ..reference }, "ids change nothing else");
    assert!(gather_features(&scene, &RenderSettings::default(), size, 5, &|| true).is_none());
}

/// One sample is the first of many, and the mean of many is the mean of the samples.
#[test]
fn one_sample_is_what_a_single_path_sees() {
    let scene = everything();
    let one = gather(&scene, (40, 30), 1);
    assert!(one.variance.albedo.iter().all(|variance| *variance == Vec3::ZERO));
    assert!(one.coverage.iter().all(|coverage| [0.0, 1.0].contains(coverage)));
    assert!(one.normal.iter().zip(&one.coverage).all(|(n, c)| (n.length() - c).abs() < 1e-5));
    // Depth is along the axis: behind no mirror or glass it follows from the position.
    for (i, object) in one.ids.as_ref().unwrap().objects.iter().enumerate() {
        if object.iter().any(|(id, _)| [0, 4].contains(&id)) {
            assert!((one.depth[i] + one.position[i].z).abs() < 1e-4 * one.depth[i], "{}", one.depth[i]);
        }
    }
}
