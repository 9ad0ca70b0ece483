//! Layered materials in whole pictures: closed forms of holes, backs, emission and mapped normals, and one way of finding
//! light against another.

use crate::common::*;
use firstlight::kdtree::Shape;
use firstlight::render::{
    ColorInput, Environment, Fresnel, Geometry, Integrator, Material, Object, Prepared, RenderSettings, ScalarInput,
    Shading, Snapshot, Techniques, Texture, TexturePattern,
};
use glam::{Mat2, Vec2, Vec3};

/// A principled material of this colour, changed.
fn principled(color: f32, change: impl FnOnce(&mut Layers)) -> Material {
    let mut layers = Layers { color, ..Layers::default() };
    change(&mut layers);
    let mut material = Material::principled(ColorInput::Constant(Vec3::splat(layers.color)));
    if let Material::Principled {
        metallic,
        roughness,
        specular,
        transmission,
        thin_walled,
        clearcoat,
        sheen_color,
        emission,
        opacity,
        opacity_cutoff,
        normal_map,
        two_sided,
        ..
    } = &mut material
    {
        let constant = ScalarInput::Constant;
        (*metallic, *roughness) = (constant(layers.metallic), constant(layers.roughness));
        (*specular, *transmission) = (constant(layers.specular), constant(layers.transmission));
        (*thin_walled, *clearcoat) = (layers.thin_walled, constant(layers.clearcoat));
        *sheen_color = ColorInput::Constant(Vec3::splat(layers.sheen));
        *emission = ColorInput::Constant(Vec3::splat(layers.emission));
        (*opacity, *opacity_cutoff) = (layers.opacity, layers.cutoff);
        *normal_map = ColorInput::Constant(layers.normal);
        *two_sided = layers.two_sided;
    }
    material
}

struct Layers {
    color: f32,
    metallic: f32,
    roughness: f32,
    specular: f32,
    transmission: f32,
    thin_walled: bool,
    clearcoat: f32,
    sheen: f32,
    emission: f32,
    opacity: ScalarInput,
    cutoff: Option<f32>,
    normal: Vec3,
    two_sided: bool,
}

impl Default for Layers {
    fn default() -> Self {
        Self {
            color: 0.0,
            metallic: 0.0,
            roughness: 0.5,
            specular: 0.0,
            transmission: 0.0,
            thin_walled: false,
            clearcoat: 0.0,
            sheen: 0.0,
            emission: 0.0,
            opacity: ScalarInput::Constant(1.0),
            cutoff: None,
            normal: Vec3::new(0.5, 0.5, 1.0),
            two_sided: true,
        }
    }
}

/// Facing +Z at a height.
fn pane(z: f32) -> Shape {
    quad(Vec3::new(-50.0, -50.0, z), 100.0 * Vec3::X, 100.0 * Vec3::Y)
}

/// What a camera above sees of panes below it, the mean over the picture.
fn seen_from_above(panes: &[(f32, Material)], sky: f32, settings: RenderSettings, spp: u32) -> (f64, f64) {
    let shapes = panes.iter().zip(0..).map(|((z, _), material)| (pane(*z), material)).collect();
    let materials = panes.iter().map(|(_, material)| material.clone()).collect();
    let camera = camera(Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO, 20.0);
    let scene = scene(shapes, materials, Environment::Constant(Vec3::splat(sky)), camera);
    picture_mean(&render(&scene, &settings, 24, 24, spp).0)
}

#[test]
fn what_is_not_there_is_passed_in_proportion() {
    let settings = RenderSettings::default();
    let share = |opacity: f32| principled(0.0, |layers| layers.opacity = ScalarInput::Constant(opacity));
    for opacity in [0.0, 0.3, 1.0] {
        let (mean, error) = seen_from_above(&[(0.0, share(opacity)), (-1.0, emissive(2.0))], 0.0, settings, 256);
        let expected = 2.0 * (1.0 - f64::from(opacity));
        assert!((mean - expected).abs() <= 4.0 * error + 1e-6, "{opacity}: {mean} ± {error}");
        assert!(error < 0.01, "{error}");
    }
    // Two layers, one behind the other, decide by themselves.
    let (mean, error) =
        seen_from_above(&[(0.0, share(0.5)), (-0.5, share(0.5)), (-1.0, emissive(2.0))], 0.0, settings, 256);
    assert!((mean - 0.5).abs() <= 4.0 * error, "{mean} ± {error}");
    let cut = |opacity: f32, cutoff: f32| {
        principled(0.0, |layers| {
            (layers.opacity, layers.cutoff) = (ScalarInput::Constant(opacity), Some(cutoff));
        })
    };
    for (material, expected) in [(cut(0.5, 0.5), 0.0), (cut(0.49, 0.5), 2.0), (cut(1.0, 1.0), 0.0)] {
        let (mean, _) = seen_from_above(&[(0.0, material), (-1.0, emissive(2.0))], 0.0, settings, 4);
        assert_eq!(mean, expected);
    }
}

#[test]
fn shadows_of_what_is_half_there_are_half_as_dark() {
    // A small light above a pane that lets 70 % pass, above a floor that is seen from below the pane.
    let picture = |opacity: f32, integrator: Integrator, light_sampling: bool| {
        let shapes = vec![
            (plane(Vec3::ZERO, Vec3::Y), 0),
            (quad(Vec3::new(-9.0, 1.5, -9.0), 18.0 * Vec3::Z, 18.0 * Vec3::X), 1),
            (sphere(Vec3::new(0.0, 3.0, 0.0), 0.5), 2),
        ];
        let pane = principled(0.0, |layers| layers.opacity = ScalarInput::Constant(opacity));
        let eye = camera(Vec3::new(0.0, 1.0, 2.0), Vec3::new(0.0, 0.0, 0.0), 30.0);
        let scene = scene(shapes, vec![diffuse(0.5), pane, emissive(8.0)], Environment::Black, eye);
        let techniques = Techniques { light_sampling, ..Techniques::default() };
        let settings = RenderSettings { integrator, techniques, max_depth: 2, ..RenderSettings::default() };
        picture_mean(&render(&scene, &settings, 16, 16, 1024).0)
    };
    for integrator in [Integrator::Path, Integrator::Phong] {
        let ((bare, _), (half, error)) = (picture(0.0, integrator, true), picture(0.3, integrator, true));
        assert!((half - 0.7 * bare).abs() < 4.0 * error + 1e-3 * bare, "{integrator:?}: {half} ± {error} of {bare}");
        assert!(bare > 0.05 && error < 0.01 * bare);
    }
    let ((sampled, a), (found, b)) = (picture(0.3, Integrator::Path, true), picture(0.3, Integrator::Path, false));
    assert!((sampled - found).abs() < 4.0 * a.hypot(b), "{sampled} ± {a} for {found} ± {b}");
}

#[test]
fn a_surface_without_a_back_is_not_there_from_behind() {
    let settings = RenderSettings::default();
    let single = || principled(0.0, |layers| layers.two_sided = false);
    let turned = |material: Material| {
        // The front looks down.
        let shapes = vec![(quad(Vec3::new(-50.0, -50.0, 0.0), 100.0 * Vec3::Y, 100.0 * Vec3::X), 0), (pane(-1.0), 1)];
        let camera = camera(Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO, 20.0);
        let scene = scene(shapes, vec![material, emissive(2.0)], Environment::Black, camera);
        picture_mean(&render(&scene, &settings, 8, 8, 4).0).0
    };
    assert_eq!(turned(single()), 2.0);
    assert_eq!(turned(principled(0.0, |_| {})), 0.0);
    assert_eq!(seen_from_above(&[(0.0, single()), (-1.0, emissive(2.0))], 0.0, settings, 4).0, 0.0);
    // Glass has an inside, whose back is there.
    let glass = principled(1.0, |layers| {
        (layers.two_sided, layers.transmission, layers.specular) = (false, 1.0, 1.0);
    });
    assert!(turned(glass) < 1.99);
}

#[test]
fn both_sides_of_a_light_shine_alike_however_they_are_found() {
    // A sheet of light between two floors that see nothing else, and textured by holes.
    let shapes = |height: f32| {
        let floor = quad(Vec3::new(-4.0, height, -4.0), 8.0 * Vec3::Z, 8.0 * Vec3::X);
        let sheet = [
            quad(Vec3::new(-0.5, 0.0, -0.5), Vec3::Z, Vec3::X),
            Shape::Triangle {
                vertices: [Vec3::new(1.0, 0.0, 0.0), Vec3::new(1.0, 0.0, 1.0), Vec3::new(2.0, 0.0, 0.5)],
            },
        ];
        vec![(floor, 0), (sheet[0].clone(), 1), (sheet[1].clone(), 1)]
    };
    let holes = Texture {
        uv_matrix: Mat2::from_diagonal(Vec2::new(2.0, 1.0)),
        ..Texture::new(TexturePattern::Checker { a: Vec3::ONE, b: Vec3::splat(0.2) })
    };
    let picture = |height: f32, light_sampling: bool| {
        let light = principled(0.0, |layers| {
            (layers.emission, layers.opacity) = (5.0, ScalarInput::Texture(0));
        });
        let (shapes, objects) =
            shapes(height).into_iter().map(|(shape, material)| (shape, Object::plain(material))).unzip();
        let shading = Shading::new(vec![diffuse(0.8), light], vec![holes.clone()], Environment::Black);
        let eye = camera(Vec3::new(0.0, 0.4 * height, 3.0), Vec3::new(0.5, height, 0.0), 40.0);
        let scene = Prepared::new(Snapshot::new(Geometry::build(shapes, objects), shading, eye));
        let techniques = Techniques { light_sampling, ..Techniques::default() };
        let settings = RenderSettings { techniques, max_depth: 2, ..RenderSettings::default() };
        picture_mean(&render(&scene, &settings, 16, 16, if light_sampling { 1024 } else { 8192 }).0)
    };
    for height in [-1.0, 1.0] {
        let ((sampled, a), (found, b)) = (picture(height, true), picture(height, false));
        assert!((sampled - found).abs() < 4.0 * a.hypot(b), "{height}: {sampled} ± {a} for {found} ± {b}");
    }
    let ((below, a), (above, b)) = (picture(-1.0, true), picture(1.0, true));
    assert!((below - above).abs() < 4.0 * a.hypot(b) && below > 0.05, "{below} ± {a} for {above} ± {b}");
}

#[test]
fn a_mapped_normal_is_lit_by_its_own_cosine() {
    // A small light straight above; normals tilted by 30° along u see it under 30°.
    let (sin, cos) = 30f32.to_radians().sin_cos();
    let picture = |normal: Vec3| {
        let floor = principled(0.8, |layers| layers.normal = normal);
        let shapes = vec![(pane(0.0), 0), (sphere(Vec3::new(0.0, 0.0, 30.0), 0.5), 1)];
        let eye = camera(Vec3::new(0.0, -0.5, 1.0), Vec3::ZERO, 5.0);
        let scene = scene(shapes, vec![floor, emissive(1000.0)], Environment::Black, eye);
        let settings = RenderSettings { max_depth: 2, ..RenderSettings::default() };
        picture_mean(&render(&scene, &settings, 8, 8, 64).0).0
    };
    let flat = picture(Vec3::new(0.5, 0.5, 1.0));
    for tilted in [Vec3::new(sin, 0.0, cos), Vec3::new(0.0, -sin, cos)] {
        let ratio = picture(0.5 * tilted + 0.5) / flat;
        assert!((ratio - f64::from(cos)).abs() < 2e-3, "{tilted}: {ratio}");
    }
}

#[test]
fn layers_that_say_no_more_look_like_the_simpler_material() {
    let whole = |material: Material| {
        let shapes = vec![(sphere(Vec3::ZERO, 1.0), 0)];
        let eye = camera(Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO, 30.0);
        let sky = Environment::Gradient { zenith: Vec3::ONE, horizon: Vec3::splat(0.4), ground: Vec3::splat(0.1) };
        let scene = scene(shapes, vec![material], sky, eye);
        picture_mean(&render(&scene, &RenderSettings::default(), 32, 32, 256).0).0
    };
    let constant = ScalarInput::Constant;
    let metal = |color: f32| Material::Metal {
        alpha: constant(0.16),
        reflectance: ColorInput::Constant(Vec3::splat(color)),
        fresnel: Fresnel::Schlick,
        compensate: true,
    };
    let glass = Material::RoughGlass {
        alpha: constant(0.16),
        ior: 1.5,
        absorption: Vec3::ZERO,
        dispersion: 0.0,
        compensate: true,
        beckmann: false,
    };
    let pairs = [
        (principled(0.7, |l| (l.metallic, l.roughness) = (1.0, 0.4)), metal(0.7)),
        (principled(0.7, |_| {}), diffuse(0.7)),
        (principled(1.0, |l| (l.transmission, l.roughness) = (1.0, 0.4)), glass),
    ];
    for (layers, plain) in pairs {
        let (found, expected) = (whole(layers.clone()), whole(plain.clone()));
        assert!((found / expected - 1.0).abs() < 4e-3, "{found} for {expected}: {plain:?}");
        let simple = layers.simplified();
        assert!(simple == plain || matches!(simple, Material::Metal { .. } | Material::RoughGlass { .. }));
    }
}

#[test]
fn nothing_makes_light_in_a_furnace() {
    let all = [
        ("plain", principled(1.0, |l| l.specular = 1.0)),
        ("coated", principled(1.0, |l| (l.specular, l.clearcoat, l.roughness) = (1.0, 1.0, 0.3))),
        ("velvet", principled(1.0, |l| (l.specular, l.sheen) = (1.0, 1.0))),
        ("thin", principled(1.0, |l| (l.specular, l.transmission, l.thin_walled) = (1.0, 1.0, true))),
        ("part glass", principled(1.0, |l| (l.specular, l.transmission, l.roughness) = (1.0, 0.5, 0.3))),
        ("bumpy", principled(1.0, |l| (l.specular, l.normal) = (1.0, Vec3::new(0.85, 0.4, 0.8)))),
        ("holes", principled(1.0, |l| (l.specular, l.opacity) = (1.0, ScalarInput::Constant(0.5)))),
    ];
    for (name, material) in all {
        let shapes = vec![(sphere(Vec3::ZERO, 1.0), 0)];
        let eye = camera(Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO, 22.0);
        let scene = scene(shapes, vec![material], Environment::Constant(Vec3::ONE), eye);
        let (mean, error) = picture_mean(&render(&scene, &RenderSettings::default(), 32, 32, 256).0);
        assert!(mean <= 1.0 + 3.0 * error + 2e-3, "{name}: {mean} ± {error}");
        let least = match name {
            "bumpy" => 0.8,
            "coated" | "velvet" => 0.95,
            _ => 0.99,
        };
        assert!(mean >= least, "{name}: {mean} ± {error}");
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let light = principled(0.5, |l| (l.emission, l.opacity) = (2.0, ScalarInput::Constant(0.6)));
    let thin =
        principled(0.9, |l| (l.transmission, l.thin_walled, l.opacity) = (0.5, true, ScalarInput::Constant(0.7)));
    let shapes = vec![(plane(Vec3::ZERO, Vec3::Y), 0), (pane(-1.0), 1), (sphere(Vec3::new(0.0, 1.0, 1.0), 0.7), 2)];
    let eye = camera(Vec3::new(0.0, 1.5, 5.0), Vec3::new(0.0, 0.7, 0.0), 40.0);
    let scene = scene(shapes, vec![diffuse(0.6), light, thin], Environment::Constant(Vec3::splat(0.2)), eye);
    let picture = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| render(&scene, &RenderSettings::default(), 40, 30, 8).0.means())
    };
    assert_eq!(picture(1), picture(3));
}
