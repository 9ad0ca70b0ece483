//! Textures through the whole way: scene file, pictures on disk, snapshot, both light models.

use crate::common::render;
use firstlight::render::{Integrator, RenderSettings, Techniques};
use firstlight::scene::{Extraction, LoadOptions, SceneInputs, SceneSource, load};
use glam::Vec3;
use std::path::Path;

/// Renders a scene file of `objects` seen from `camera` towards `look_at`; returns the colour in the middle.
fn middle(dir: &Path, objects: &str, eye: &str, look_at: &str, integrator: Integrator) -> Vec3 {
    let settings = RenderSettings { integrator, ..RenderSettings::default() };
    middle_with(dir, objects, eye, look_at, &settings, 64)
}

fn middle_with(dir: &Path, objects: &str, eye: &str, look_at: &str, settings: &RenderSettings, spp: u32) -> Vec3 {
    let text = format!(
        "(camera: (eye: {eye}, look_at: {look_at}, vfov: 0.01), environment: constant(1),
          textures: {{
              \"checker\": checker(a: (1, 0, 0), b: (0, 0, 1), squares: (4, 2)),
              \"turned\": checker(a: (1, 0, 0), b: (0, 0, 1), squares: (4, 2), rotate: 90),
              \"picture\": image(file: \"four.png\", smooth: false),
              \"photo\": image(file: \"green.jpg\"),
              \"bright\": image(file: \"bright.hdr\"),
              \"clamped\": image(file: \"four.png\", smooth: false, wrap: clamp),
              \"twice\": image(file: \"four.png\", smooth: false, repeat: (2, 2)),
          }},
          materials: {{
              \"checker\": emissive(radiance: \"checker\"),
              \"turned\": emissive(radiance: \"turned\"),
              \"picture\": emissive(radiance: \"picture\"),
              \"photo\": emissive(radiance: \"photo\"),
              \"bright\": emissive(radiance: \"bright\"),
              \"clamped\": emissive(radiance: \"clamped\"),
              \"twice\": emissive(radiance: \"twice\"),
              \"matte\": diffuse(albedo: \"picture\"),
              \"white\": diffuse(albedo: 0.8),
              \"polished\": metal(alpha: \"picture\", reflectance: 1),
          }},
          objects: [{objects}])"
    );
    let path = dir.join("scene.ron");
    std::fs::write(&path, text).unwrap();
    let scene = load(&SceneSource::Scene(path), &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    let mut world = bevy_ecs::world::World::new();
    scene.spawn(&mut world);
    let extraction = Extraction::new(&SceneInputs::of(&mut world), &scene.trees);
    assert!(extraction.problems.is_empty(), "{:?}", extraction.problems);
    render(&extraction.prepared, settings, 1, 1, spp).0.mean(0, 0)
}

/// Red, green above; blue, white below; a green photo; a bright HDR picture; a model with a material of its own.
fn folder() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let four = vec![255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255];
    image::RgbImage::from_raw(2, 2, four).unwrap().save(dir.path().join("four.png")).unwrap();
    image::RgbImage::from_pixel(16, 16, image::Rgb([0, 255, 0])).save(dir.path().join("green.jpg")).unwrap();
    image::Rgb32FImage::from_pixel(4, 4, image::Rgb([8.0, 4.0, 2.0])).save(dir.path().join("bright.hdr")).unwrap();
    let obj = "mtllib two.mtl\nv 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
               usemtl glow\nf 1/1 2/2 3/3\nusemtl paint\nf 1/1 3/3 4/4\n";
    std::fs::write(dir.path().join("two.obj"), obj).unwrap();
    std::fs::write(
        dir.path().join("two.mtl"),
        "newmtl glow\nmap_Ke four.png\nnewmtl paint\nKd 1 1 1\nmap_Kd four.png\n",
    )
    .unwrap();
    dir
}

const RED: Vec3 = Vec3::X;
const GREEN: Vec3 = Vec3::Y;
const BLUE: Vec3 = Vec3::Z;

#[test]
fn every_shape_and_format_shows_its_texture_where_it_should() {
    let dir = folder();
    let quad = |material: &str| {
        format!("quad(corner: (0, 0, 0), edge_u: (2, 0, 0), edge_v: (0, 2, 0), material: \"{material}\")")
    };
    let plane = |material: &str| format!("plane(normal: (0, 0, 1), material: \"{material}\")");
    // Material, place in the plane z = 0 and colour there, for a quad of two metres.
    let on_quad = [
        ("checker", (0.25, 0.5), RED),
        ("checker", (0.75, 0.5), BLUE),
        ("checker", (0.25, 1.5), BLUE),
        ("picture", (0.5, 1.5), RED),
        ("picture", (1.5, 1.5), GREEN),
        ("picture", (0.5, 0.5), BLUE),
        ("picture", (1.5, 0.5), Vec3::ONE),
        ("twice", (0.75, 0.75), GREEN),
        ("twice", (1.75, 1.25), Vec3::ONE),
        ("bright", (1.0, 1.0), Vec3::new(8.0, 4.0, 2.0)),
    ];
    for (material, (x, y), expected) in on_quad {
        for integrator in [Integrator::Path, Integrator::Phong] {
            let (eye, at) = (format!("({x}, {y}, 3)"), format!("({x}, {y}, 0)"));
            let found = middle(dir.path(), &quad(material), &eye, &at, integrator);
            assert!((found - expected).abs().max_element() < 0.02, "{material} at {x}, {y}: {found}");
        }
    }
    let photo = middle(dir.path(), &quad("photo"), "(1, 1, 3)", "(1, 1, 0)", Integrator::Path);
    assert!(photo.y > 0.9 && photo.x < 0.1, "{photo}");
    // Rotating by 90 degrees swaps the sides of the squares: two rows up become two columns.
    let at = |material: &str, x: f64| {
        let (eye, target) = (format!("({x}, 0.3, 3)"), format!("({x}, 0.3, 0)"));
        middle(dir.path(), &quad(material), &eye, &target, Integrator::Path)
    };
    assert_eq!(at("turned", 0.3), at("turned", 0.9));
    assert_ne!(at("turned", 0.3), at("turned", 1.3));
    // A plane repeats its picture for ever, unless it is told to clamp.
    let far = |material: &str| {
        middle(dir.path(), &plane(material), "(50.25, 70.25, 3)", "(50.25, 70.25, 0)", Integrator::Path)
    };
    assert!([RED, GREEN, BLUE, Vec3::ONE].contains(&far("picture")));
    let near = |x: f64| {
        let (eye, target) = (format!("({x}, 0.25, 3)"), format!("({x}, 0.25, 0)"));
        middle(dir.path(), &plane("picture"), &eye, &target, Integrator::Path)
    };
    assert_eq!(near(0.25), near(7.25));
    assert_ne!(near(0.25), near(0.75));
    assert_eq!(
        far("clamped"),
        middle(dir.path(), &plane("clamped"), "(9.9, 3.3, 3)", "(9.9, 3.3, 0)", Integrator::Path)
    );
}

#[test]
fn spheres_turn_their_texture_with_them() {
    let dir = folder();
    let shapes = [
        "sphere(radius: 1, material: \"picture\", transform: (rotate: (0, ANGLE, 0)))",
        "spheres(centers: [(0, 0, 0)], radii: all(1), material: \"picture\", transform: (rotate: (0, ANGLE, 0)))",
    ];
    for shape in shapes {
        let seen = |angle: &str, eye: &str| {
            middle(dir.path(), &shape.replace("ANGLE", angle), eye, "(0, 0.3, 0)", Integrator::Path)
        };
        // The upper half is red on one side and green on the other.
        let (front, back) = (seen("0", "(0.5, 2, 5)"), seen("0", "(-0.5, 2, -5)"));
        assert!(front != back && [RED, GREEN].contains(&front) && [RED, GREEN].contains(&back), "{front} {back}");
        assert_eq!(seen("180", "(0.5, 2, 5)"), back, "{shape}");
        assert_eq!(seen("180", "(-0.5, 2, -5)"), front, "{shape}");
        assert_eq!(seen("360", "(0.5, 2, 5)"), front, "{shape}");
        // A half turn about the view axis puts the lower half up.
        let upside_down = shape.replace("(0, ANGLE, 0)", "(0, 0, 180)");
        let turned = middle(dir.path(), &upside_down, "(0.5, 2, 5)", "(0, 0.3, 0)", Integrator::Path);
        assert!([BLUE, Vec3::ONE].contains(&turned), "{turned}");
    }
}

#[test]
fn textures_drive_albedo_and_roughness() {
    let dir = folder();
    let quad = |material: &str| {
        format!(
            "quad(corner: (0, 0, 0), edge_u: (2, 0, 0), edge_v: (0, 2, 0), material: \"{material}\"),
             sphere(center: (0.5, 0.5, 2), radius: 0.2, material: \"photo\")"
        )
    };
    // Diffuse under surroundings of one: the colour itself, but for what the small green light adds or covers.
    let seen = |material: &str, x: f64, y: f64| {
        let (eye, target) = (format!("({x}, {y}, 3)"), format!("({x}, {y}, 0)"));
        middle(dir.path(), &quad(material), &eye, &target, Integrator::Path)
    };
    let red = seen("matte", 0.5, 1.5);
    assert!(red.x > 0.9 && red.y == 0.0 && red.z == 0.0, "{red}");
    // The red channel is the width of the lobe: 0 on the green quarter, a mirror that shows the sky as it is.
    assert_eq!(seen("polished", 1.5, 1.5), Vec3::ONE);
    let dull = seen("polished", 0.5, 1.5);
    assert!(dull.x < 1.0, "{dull}");
}

#[test]
fn materials_of_a_model_bring_their_pictures() {
    let dir = folder();
    let model = "mesh(source: obj(\"two.obj\"))";
    let at = |x: f64, y: f64| {
        let (eye, target) = (format!("({x}, {y}, 3)"), format!("({x}, {y}, 0)"));
        middle(dir.path(), model, &eye, &target, Integrator::Path)
    };
    // Lower right triangle glows by map_Ke, upper left one is painted by map_Kd, under surroundings of one. Texels are
    // blended between their centres, which lie a quarter in.
    for ((x, y), expected) in [((1.5, 0.5), Vec3::ONE), ((1.52, 1.48), GREEN), ((0.5, 1.5), RED), ((0.48, 0.52), BLUE)]
    {
        let found = at(x, y);
        assert!((found - expected).abs().max_element() < 0.05, "at {x}, {y}: {found} for {expected}");
    }
}

#[test]
fn a_checker_to_the_horizon_converges_to_its_mean() {
    let dir = folder();
    // Almost along the plane, squares of a quarter metre: thousands of them in one pixel.
    let found = middle(dir.path(), "plane(material: \"checker\")", "(0, 0.02, 0)", "(300, 0, 41)", Integrator::Path);
    assert!((found.x - 0.5).abs() < 0.2 && (found.z - 0.5).abs() < 0.2, "{found}");
}

/// A light that is a mesh with a picture, mirrored or not, over a diffuse quad in the dark corner beside it: those that ask the
/// light find the light of those that run into it.
#[test]
fn textured_lights_of_meshes_send_what_is_seen_of_them() {
    let dir = folder();
    for placed in
        ["rotate: (90, 0, 0), translate: (0, 1, -1)", "rotate: (90, 0, 0), scale: (-1, 1, 1), translate: (2, 1, -1)"]
    {
        let objects = format!(
            "mesh(source: obj(\"two.obj\"), material: \"picture\", transform: ({placed})),
             quad(corner: (-1, 0, 1), edge_u: (4, 0, 0), edge_v: (0, 0, -4), material: \"white\")"
        );
        let seen = |light_sampling| {
            let techniques = Techniques { light_sampling, ..Techniques::default() };
            let settings = RenderSettings { techniques, ..RenderSettings::default() };
            middle_with(dir.path(), &objects, "(0.3, 0.5, 3)", "(0.3, 0, -0.5)", &settings, 1 << 15)
        };
        let (asked, met) = (seen(true), seen(false));
        assert!((asked - met).abs().max_element() < 0.02 * met.max_element(), "{placed}: {asked} and {met}");
        // The picture is not grey: green and white lie on one side.
        assert!((met.x - met.y).abs() > 0.05 * met.max_element(), "{met}");
    }
}
