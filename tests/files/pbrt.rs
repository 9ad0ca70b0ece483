//! Scenes of pbrt, version 4, written here: against closed forms, and against the same scene of our own.

use bevy_ecs::prelude::World;
use firstlight::render::{Film, RenderSettings, advance};
use firstlight::scene::file::{LightPart, MaterialPart, ObjectPart};
use firstlight::scene::{
    ColorValue, EnvironmentSource, Extraction, LoadOptions, LoadedScene, MeshSource, ModelChoice, Rendering, Rgb,
    SceneInputs, SceneSource, TextureSource, load, save_scene,
};
use flate2::Compression;
use flate2::write::GzEncoder;
use glam::{DVec3, Vec3};
use std::io::Write;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

fn folder(files: &[(&str, &str)]) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }
    let path = folder.path().join(files[0].0);
    (folder, path)
}

fn open(path: &Path) -> LoadedScene {
    load(&SceneSource::parse(path).unwrap(), &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// A scene whose world is this text, seen along −z from (0, 0, 4) by an ordinary right-handed camera.
fn with(world: &str) -> LoadedScene {
    const VIEW: &str = "Integrator \"path\" \"integer maxdepth\" 1\nFilm \"rgb\" \"integer xresolution\" 8 \
        \"integer yresolution\" 8\nPixelFilter \"box\"\nScale -1 1 1\nLookAt 0 0 4  0 0 0  0 1 0\n\
        Camera \"perspective\" \"float fov\" 20\nWorldBegin\n";
    let (_folder, path) = folder(&[("a.pbrt", &format!("{VIEW}{world}"))]);
    open(&path)
}

fn pixels(scene: &LoadedScene, spp: u32) -> Vec<Vec3> {
    let mut world = World::new();
    scene.spawn(&mut world);
    let extraction = Extraction::new(&SceneInputs::of(&mut world), &scene.trees);
    let settings: RenderSettings = world.resource::<Rendering>().0;
    let mut film = Film::new(scene.file.film.width, scene.file.film.height);
    advance(&extraction.prepared, &settings, &mut film, spp, &|| false);
    film.means()
}

fn told(scene: &LoadedScene) -> Vec<String> {
    scene.warnings.iter().map(ToString::to_string).collect()
}

/// Mean of the four pixels in the middle.
fn middle(scene: &LoadedScene) -> Vec3 {
    let pixels = pixels(scene, 64);
    [27, 28, 35, 36].map(|i| pixels[i]).iter().sum::<Vec3>() / 4.0
}

const SQUARE: &str =
    "Shape \"trianglemesh\" \"point3 P\" [-2 -2 0  2 -2 0  2 2 0  -2 2 0] \"integer indices\" [0 1 2 0 2 3]\n";

#[test]
fn an_emitter_shines_on_the_side_of_its_normal_with_its_radiance() {
    let light = "AreaLightSource \"diffuse\" \"rgb L\" [3 2 1] \"float scale\" 0.5 ";
    let black = "\nMaterial \"diffuse\" \"rgb reflectance\" [0 0 0]\n";
    let seen = Vec3::new(1.5, 1.0, 0.5);
    let down = SQUARE.replace("\"integer", "\"normal N\" [0 0 -1  0 0 -1  0 0 -1  0 0 -1] \"integer");
    for (before, square, expected) in [
        // Counter-clockwise for the camera, so the normal comes towards it.
        ("", SQUARE, seen),
        ("ReverseOrientation\n", SQUARE, Vec3::ZERO),
        // The normal of the space of the shape, as it goes through a mirror.
        ("Scale -1 1 1\n", SQUARE, seen),
        ("Scale 1 1 -1\n", SQUARE, Vec3::ZERO),
        ("Scale 1 1 -1\nReverseOrientation\n", SQUARE, seen),
        ("", &*down, Vec3::ZERO),
        ("ReverseOrientation\n", &*down, seen),
    ] {
        let scene = with(&format!("{light}{black}{before}{square}"));
        assert!((middle(&scene) - expected).abs().max_element() < 1e-6, "{before}{square}: {}", middle(&scene));
        let both = with(&format!("{light}\"bool twosided\" true{black}{before}{square}"));
        assert!((middle(&both) - seen).abs().max_element() < 1e-6, "{before}: {}", middle(&both));
        assert_eq!(told(&scene).len() + told(&both).len(), 0, "{:?}", told(&scene));
    }
}

#[test]
fn an_emitter_keeps_what_it_reflects() {
    // A small light of radiance 1 in all directions beside a square that glows with 0.25 and reflects a half: seen from
    // the front 0.25 + 0.5, from behind 0.5.
    let world = |turned: &str| {
        format!(
            "LightSource \"infinite\" \"rgb L\" [1 1 1]\nAreaLightSource \"diffuse\" \"rgb L\" [0.25 0.25 0.25]\n\
             Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5]\n{turned}{SQUARE}"
        )
    };
    for (turned, expected) in [("", 0.75), ("ReverseOrientation\n", 0.5)] {
        let scene = with(&world(turned));
        assert!((middle(&scene) - expected).abs().max_element() < 0.02, "{turned}: {}", middle(&scene));
    }
}

#[test]
fn power_is_spread_over_the_area() {
    // Φ = π A L: over the 16 square metres of two triangles, each of which is a light of that power.
    let power = "AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] \"float power\" 10\n";
    let scene = with(&format!("{power}{SQUARE}"));
    let radiance = |scene: &LoadedScene| {
        let emitter = scene.file.materials.iter().find_map(|(_, part)| match part {
            MaterialPart::Emissive { radiance: ColorValue::Rgb(radiance) } => Some(radiance.x),
            _ => None,
        });
        f64::from(emitter.expect("an emitter"))
    };
    let black = "Material \"diffuse\" \"rgb reflectance\" [0 0 0]\n";
    assert!((radiance(&with(&format!("{black}{power}{SQUARE}"))) - 20.0 / (16.0 * std::f64::consts::PI)).abs() < 1e-6);
    let ball = format!("{black}{power}Scale 2 2 2\nShape \"sphere\" \"float radius\" 0.5\n");
    assert!((radiance(&with(&ball)) - 10.0 / (4.0 * std::f64::consts::PI.powi(2))).abs() < 1e-6);
    // Its reflection stays beside it.
    assert_eq!(scene.file.materials.iter().filter(|(_, part)| matches!(part, MaterialPart::Blend { .. })).count(), 1);
}

#[test]
fn the_camera_sees_what_pbrt_says() {
    let view = |size: (u32, u32), camera: &str, before: &str| {
        let (width, height) = size;
        let text = format!(
            "Film \"rgb\" \"integer xresolution\" {width} \"integer yresolution\" {height} \"float iso\" 400\n{before}\n\
             Camera {camera}\nWorldBegin\nShape \"sphere\""
        );
        let (_folder, path) = folder(&[("a.pbrt", &text)]);
        open(&path).file
    };
    let half = |vfov: f64| (0.5 * vfov).to_radians().tan();
    let look = "LookAt 1 2 3  1 2 9  0 1 0";
    // `fov` is that of the shorter side.
    let wide = view((200, 100), "\"perspective\" \"float fov\" 60", look);
    assert!((wide.camera.vfov - 60.0).abs() < 1e-9);
    let tall = view((100, 200), "\"perspective\" \"float fov\" 60", look);
    assert!((half(tall.camera.vfov) - 2.0 * half(60.0)).abs() < 1e-9);
    let window = view((200, 100), "\"perspective\" \"float fov\" 60 \"float screenwindow\" [-1 1 -0.5 0.5]", look);
    assert!((half(window.camera.vfov) - 0.5 * half(60.0)).abs() < 1e-9);
    // The world is left-handed: mirrored in z, the camera looks along −z.
    assert_eq!((wide.camera.eye, wide.camera.forward), (DVec3::new(1.0, 2.0, -3.0), Some(DVec3::NEG_Z)));
    // Z up becomes Y up.
    let upright = view((100, 100), "\"perspective\"", "LookAt 0 -5 1  0 0 1  0 0 1");
    assert_eq!(upright.camera.up, DVec3::Y);
    assert_eq!((upright.camera.eye, upright.camera.forward), (DVec3::new(0.0, 1.0, -5.0), Some(DVec3::Z)));
    // Lengths of the camera are scaled with it; ISO 400 is two stops.
    let lens =
        view((100, 100), "\"perspective\" \"float lensradius\" 0.1 \"float focaldistance\" 3", "Scale 0.5 0.5 0.5");
    let (radius, focus) = (lens.camera.lens_radius.unwrap(), lens.camera.focus_distance.unwrap());
    assert!((radius - 0.2).abs() < 1e-12 && (focus - 6.0).abs() < 1e-12 && lens.display.exposure_stops == 2.0);
    let flat = view((200, 100), "\"orthographic\" \"float screenwindow\" [-6 6 -3 3]", look);
    assert_eq!(flat.camera.orthographic_height, Some(6.0));
    assert_eq!(flat.max_depth, Some(6));
}

/// What is to the left and above in pbrt's image is there in ours.
#[test]
fn images_are_not_mirrored() {
    for before in
        ["Scale -1 1 1\nLookAt 0 0 4  0 0 0  0 1 0", "LookAt 0 0 -4  0 0 0  0 1 0", "LookAt 0 -4 0  0 0 0  0 0 1"]
    {
        // In the coordinates of the camera, +x is to the right and +y above.
        let world = "CoordSysTransform \"camera\"\nTranslate -0.3 0.4 4\n\
            AreaLightSource \"diffuse\"\nShape \"sphere\" \"float radius\" 0.1";
        let text = format!(
            "Film \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 8\n{before}\n\
             Camera \"perspective\" \"float fov\" 20\nWorldBegin\n{world}"
        );
        let (_folder, path) = folder(&[("a.pbrt", &text)]);
        let pixels = pixels(&open(&path), 16);
        let weight = |of: fn(usize) -> f32| {
            (0..64).map(|i| of(i) * pixels[i].x).sum::<f32>() / pixels.iter().map(|p| p.x).sum::<f32>()
        };
        // At distance 4, tan 10° is 0.705 m: pixel (4 − 4 · 0.3 / 0.705, 4 − 4 · 0.4 / 0.705).
        let (x, y) = (weight(|i| (i % 8) as f32 + 0.5), weight(|i| (i / 8) as f32 + 0.5));
        assert!((x - 2.30).abs() < 0.2 && (y - 1.73).abs() < 0.2, "{before}: {x} {y}");
    }
}

/// The same scene in our own words gives the same image, bit by bit.
#[test]
fn the_same_scene_of_our_own_renders_to_the_same_bits() {
    let world = "LightSource \"infinite\" \"rgb L\" [0.2 0.3 0.4]\n\
        LightSource \"point\" \"rgb I\" [5 5 5] \"point3 from\" [1 2 2]\n\
        MakeNamedMaterial \"red\" \"string type\" \"diffuse\" \"rgb reflectance\" [0.8 0.1 0.1]\n\
        AttributeBegin\nMaterial \"dielectric\" \"float eta\" 1.5\nTranslate 0.25 0 0.5\nShape \"sphere\" \"float radius\" 0.5\n\
        AttributeEnd\nNamedMaterial \"red\"\nTranslate 0 0 -1\nObjectBegin \"o\"\nScale 0.5 0.5 0.5\n\
        Shape \"plymesh\" \"string filename\" \"square.ply\"\nObjectEnd\nIdentity\nTranslate 0 0.25 0\nObjectInstance \"o\"\n";
    let view = "Film \"rgb\" \"integer xresolution\" 24 \"integer yresolution\" 16\nPixelFilter \"triangle\" \"float xradius\" 1\n\
        Integrator \"path\" \"integer maxdepth\" 7\nScale -1 1 1\nLookAt 0 0 4  0 0 0  0 1 0\n\
        Camera \"perspective\" \"float fov\" 40\nWorldBegin\n";
    let square = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
        element face 1\nproperty list uchar int vertex_indices\nend_header\n-3 -3 0\n3 -3 0\n3 3 0\n-3 3 0\n4 0 1 2 3\n";
    let own = "(camera: (eye: (0, 0, 4), look_at: (0, 0, 0), vfov: 40), film: (width: 24, height: 16, filter: tent),\n\
        max_depth: 8, environment: constant((0.2, 0.3, 0.4)),\n\
        materials: { \"red\": diffuse(albedo: (0.8, 0.1, 0.1)), \"glass\": glass(ior: 1.5) },\n\
        objects: [sphere(center: (0.25, 0, 0.5), radius: 0.5, material: \"glass\"),\n\
        mesh(source: ply(\"square.ply\"), shading: flat, material: \"red\",\n\
        transform: (translate: (0, 0.25, -1), scale: 0.5))],\n\
        lights: [point(position: (1, 2, 2), intensity: 5, radius: 0)])";
    let (folder, path) = folder(&[("a.pbrt", &format!("{view}{world}")), ("own.ron", own), ("square.ply", square)]);
    let (foreign, own) = (open(&path), open(&folder.path().join("own.ron")));
    assert_eq!(told(&foreign), Vec::<String>::new());
    let (a, b) = (pixels(&foreign, 8), pixels(&own, 8));
    assert!(a.iter().any(|pixel| pixel.x > 0.0));
    assert_eq!(a, b);
}

#[test]
fn a_scene_is_saved_as_ours_and_opened_again() {
    let world = "AreaLightSource \"diffuse\" \"rgb L\" [2 2 2]\nTranslate 0 0 1\nShape \"disk\" \"float radius\" 0.2\n\
         AttributeBegin\nScale 1 2 1\nShape \"sphere\" \"float radius\" 0.1\nAttributeEnd\nInclude \"inner/more.pbrt\"\n";
    let view = "Film \"rgb\" \"integer xresolution\" 16 \"integer yresolution\" 16\nLookAt 0 0 4  0 0 0  0 1 0\n\
        Camera \"perspective\" \"float fov\" 30\nWorldBegin\n";
    let more = format!("AttributeBegin\n{SQUARE}AttributeEnd\n");
    let (folder, path) = folder(&[("scene/a.pbrt", &format!("{view}{world}")), ("scene/inner/more.pbrt", &more)]);
    let scene = open(&path);
    assert_eq!(scene.file.objects.len(), 3);
    let include = folder.path().join("scene/inner/more.pbrt");
    assert!(scene.files().contains(&include), "{:?}", scene.files());
    let read: Vec<PathBuf> = scene.read_files().into_iter().flat_map(|read| read.files).collect();
    assert!(read.contains(&include) && read.contains(&path), "{read:?}");
    let mut world = World::new();
    scene.spawn(&mut world);
    let copy = folder.path().join("copy.ron");
    let saved = save_scene(&mut world, Some(&scene), &copy).unwrap();
    let again = open(&copy);
    let part = |shape| MeshSource::Part { file: "scene/a.pbrt".to_owned(), shape, defines: Vec::new() };
    let sources = again.file.objects.iter().map(|object| match object {
        ObjectPart::Mesh { source, .. } => source.clone(),
        other => panic!("{other:?}"),
    });
    assert_eq!(sources.collect::<Vec<_>>(), [part(0), part(1), part(2)], "{}", saved.text);
    assert_eq!(pixels(&scene, 4), pixels(&again, 4));
    assert_eq!(scene.content_fingerprint(), again.content_fingerprint());
    // A shape that is none any more is left out, and told.
    std::fs::write(&include, "").unwrap();
    let fewer = open(&copy);
    assert!(told(&fewer).iter().any(|text| text.contains("shape 2, counted from 0, is no mesh")), "{:?}", told(&fewer));
}

#[test]
fn errors_name_the_file_the_line_and_the_column() {
    for (text, expected) in [
        ("WorldBegin\nShap \"sphere\"", "a.pbrt:2:1: there is no directive `Shap` (did you mean `Shape`?)"),
        ("WorldBegin\n  Shape sphere", "a.pbrt:2:9: expected a string in quotes, found `sphere`"),
        (
            "WorldBegin\nShape \"sphere\" \"float radius\" [1 x]",
            "a.pbrt:2:34: expected a value of the same kind, or `]`",
        ),
        ("WorldBegin\nShape \"sphere\" \"radius\" 1", "a.pbrt:2:16: expected a type and a name"),
        ("Translate 1 2\nWorldBegin", "a.pbrt:2:1: expected 3 finite numbers, found `WorldBegin`"),
        ("Shape \"sphere\"", "a.pbrt:1:1: `Shape` stands before `WorldBegin`"),
        ("WorldBegin\nCamera \"perspective\"", "a.pbrt:2:1: `Camera` stands after `WorldBegin`"),
        ("WorldBegin \"", "a.pbrt:1:12: the string does not end"),
        ("WorldBegin\nInclude \"b.pbrt\"", "b.pbrt:2:1: there is no directive `Nonsense`"),
        ("WorldBegin\nInclude \"c.pbrt\"", "c.pbrt:1:1: files include one another more than 32 deep"),
        ("Include \"d.pbrt\"", "has no `WorldBegin`"),
        ("WorldBegin", "has no shape that can be shown"),
        // Its environment alone would look as if that were the scene.
        (
            "WorldBegin\nLightSource \"infinite\"\nShape \"plymesh\" \"string filename\" \"../far.ply\"",
            "has no shape that can be shown: ",
        ),
        ("WorldBegin\nShape \"curve\"", "make no curve of degree 3"),
    ] {
        let (_folder, path) =
            folder(&[("a.pbrt", text), ("b.pbrt", "\nNonsense"), ("c.pbrt", "Include \"c.pbrt\""), ("d.pbrt", "")]);
        let error = load(&SceneSource::parse(&path).unwrap(), &LoadOptions::default()).unwrap_err().to_string();
        assert!(error.contains(expected), "{text}: {error}");
    }
}

/// As in version 3.
#[test]
fn a_material_that_is_described_again_counts_for_what_names_it_then() {
    let described = |rgb: &str| {
        format!(
            "MakeNamedMaterial \"m\" \"string type\" \"diffuse\" \"rgb reflectance\" [{rgb}]\n\
             NamedMaterial \"m\"\nShape \"sphere\"\n"
        )
    };
    let scene = with(&format!("{}{}", described("1 0 0"), described("0 1 0")));
    let albedos = scene.file.objects[..2].iter().map(|object| {
        let Some(MaterialPart::Diffuse { albedo }) = scene.file.materials.get(object.material().unwrap()) else {
            panic!("a diffuse material")
        };
        albedo.clone()
    });
    assert_eq!(albedos.collect::<Vec<_>>(), [Vec3::X, Vec3::Y].map(ColorValue::Rgb));
}

#[test]
fn what_is_not_shown_is_told_once_and_the_rest_is_shown() {
    let world = format!(
        "{SQUARE}MakeNamedMedium \"fog\" \"string type\" \"homogeneous\"\nShape \"curve\"\n\
         Shape \"plymesh\" \"string filename\" \"none.ply\"\nShape \"plymesh\" \"string filename\" \"gone.ply\"\n\
         Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"none.png\"\n\
         Material \"diffuse\" \"texture reflectance\" \"t\"\n{SQUARE}\
         Material \"hair\"\n{SQUARE}LightSource \"goniometric\"\nLightSource \"point\" \"float scale\" [1 2]\n\
         Include \"../outside.pbrt\"\nInclude \"none.pbrt\" \"float of\" 1\nInclude \"parts/a.pbrt\"\nMaterial \"interface\"\n{SQUARE}"
    );
    let scene = with(&world);
    let told = told(&scene);
    for expected in [
        "medium `fog` scatters light",
        "`curve 2` is left out: 0 points `P` make no curve of degree 3",
        "none.ply: cannot be read: no such file; `none` is left out",
        "gone.ply: cannot be read: no such file; `gone` is left out",
        "none.png: cannot be read: no such file; the texture is omitted",
        "material `hair`: materials of the kind `hair` are not modelled",
        "lights of the kind `goniometric` are not modelled",
        "`float scale` is ignored: expected one number",
        "../outside.pbrt` is a path out of the folder",
        "none.pbrt: cannot be read: no such file; the included file is left out",
        // The scene itself has this name.
        "there is no `parts/a.pbrt`; the included file is left out",
    ] {
        assert_eq!(told.iter().filter(|text| text.contains(expected)).count(), 1, "{expected}: {told:#?}");
    }
    assert_eq!(told.len(), 11, "{told:#?}");
    // Squares with a material, and the two objects whose files are missing.
    assert_eq!(scene.file.objects.len(), 5);
    let albedo = |name: &str| match scene.file.materials.get(name) {
        Some(MaterialPart::Diffuse { albedo: ColorValue::Rgb(albedo) }) => albedo.x,
        other => panic!("{name}: {other:?}"),
    };
    assert_eq!([albedo("diffuse"), albedo("diffuse 2"), albedo("hair")], [0.5; 3]);
}

#[test]
fn files_outside_are_read_where_that_is_allowed() {
    let (folder, path) = folder(&[
        ("scene/a.pbrt", "WorldBegin\nLightSource \"point\"\nInclude \"../b.pbrt\"\nShape \"sphere\""),
        ("b.pbrt", "LightSource \"point\"\nShape \"sphere\" \"float radius\" 2"),
    ]);
    assert_eq!(open(&path).file.objects.len(), 1);
    let choice = ModelChoice { allow_outside: true, ..ModelChoice::default() };
    let options = LoadOptions { choice: Some(&choice), ..LoadOptions::default() };
    assert_eq!(load(&SceneSource::Foreign(path), &options).unwrap().file.objects.len(), 2);
    drop(folder);
}

#[test]
fn lights_have_the_units_of_pbrt() {
    let scene = with(&format!(
        "LightSource \"point\" \"rgb I\" [1 2 3] \"float scale\" 2 \"point3 from\" [1 0 0]\n\
         LightSource \"point\" \"float power\" 10\nLightSource \"distant\" \"rgb L\" [1 1 1] \"float illuminance\" 5 \
         \"point3 from\" [0 2 0] \"point3 to\" [0 0 0]\nLightSource \"infinite\" \"float illuminance\" 3\n\
         LightSource \"infinite\" \"blackbody L\" 6500 \"float scale\" 0.5\n{SQUARE}"
    ));
    let near = |found: Rgb, expected: Vec3| assert!((found.0 - expected).abs().max_element() < 1e-5, "{}", found.0);
    let [a, b, c] = &scene.file.lights[..] else { panic!("{:?}", scene.file.lights) };
    match (a, b, c) {
        (
            LightPart::Point { intensity: a, position, radius: 0.0, .. },
            LightPart::Point { intensity: b, .. },
            LightPart::Directional { irradiance, direction, .. },
        ) => {
            near(*a, Vec3::new(2.0, 4.0, 6.0));
            near(*b, Vec3::splat(10.0 / (4.0 * std::f32::consts::PI)));
            near(*irradiance, Vec3::splat(5.0));
            assert_eq!((*position, *direction), (DVec3::X, DVec3::NEG_Y));
        }
        other => panic!("{other:?}"),
    }
    // Both together; a black body of 6500 K is nearly white, with luminance 1.
    let EnvironmentSource::Constant(Rgb(sky)) = scene.file.environment else { panic!("{:?}", scene.file.environment) };
    let luminance = sky.dot(Vec3::new(0.2126, 0.7152, 0.0722));
    assert!((luminance - (3.0 / std::f32::consts::PI + 0.5)).abs() < 2e-3, "{sky}");
}

#[test]
fn neighbouring_curves_of_one_material_are_one_mesh() {
    let curve =
        |x: f64| format!("Shape \"curve\" \"point3 P\" [{x} 0 0 {x} 1 0 {x} 2 0 {x} 3 0] \"float width\" 0.1\n");
    let world = format!(
        "{}{}Material \"diffuse\" \"rgb reflectance\" [1 0 0]\n{SQUARE}{}{}Translate 1 0 0\n{}\
         LightSource \"point\"\nMaterial \"hair\"\n{}",
        curve(0.0),
        curve(1.0),
        curve(2.0),
        curve(3.0),
        curve(4.0),
        curve(5.0)
    );
    let scene = with(&world);
    let told = told(&scene);
    assert!(told.len() == 1 && told[0].contains("hair"), "{told:?}");
    let shapes = scene.file.objects.iter().map(|object| match object {
        ObjectPart::Mesh { source: MeshSource::Part { shape, .. }, .. } => *shape,
        other => panic!("{other:?}"),
    });
    assert_eq!(shapes.collect::<Vec<_>>(), [0, 2, 3, 5, 6]);
    // One curve has 8 steps of four sides.
    let mut world = World::new();
    scene.spawn(&mut world);
    let objects = SceneInputs::of(&mut world).objects;
    let triangles = objects.iter().map(|object| match &object.shape {
        firstlight::scene::Shape::Mesh(mesh) => mesh.triangles.len(),
        other => panic!("{other:?}"),
    });
    assert_eq!(triangles.collect::<Vec<_>>(), [128, 2, 128, 64, 64]);
}

#[test]
fn a_projection_is_a_spot_with_an_image() {
    let folder = tempfile::tempdir().unwrap();
    image::RgbImage::from_pixel(4, 2, image::Rgb([255, 255, 255])).save(folder.path().join("slide.png")).unwrap();
    let light = "LightSource \"projection\" \"string filename\" \"slide.png\" \"float fov\" 90 \"float power\" 100";
    let text = format!("LookAt 0 0 -5  0 0 0  0 1 0\nCamera \"perspective\"\nWorldBegin\n{light}\n{SQUARE}");
    let path = folder.path().join("a.pbrt");
    std::fs::write(&path, text).unwrap();
    let scene = load(&SceneSource::Foreign(path), &LoadOptions::default()).unwrap();
    assert_eq!(told(&scene), Vec::<String>::new());
    let [LightPart::Spot { texture: Some(name), image_width, image_height, intensity, even: false, .. }] =
        &scene.file.lights[..]
    else {
        panic!("{:?}", scene.file.lights)
    };
    assert!(scene.file.textures.get(name).is_some());
    // The field of view is that of the shorter side.
    assert!((image_height - 90.0).abs() < 1e-9 && (image_width - 2.0 * 2_f64.atan().to_degrees()).abs() < 1e-9);
    // The mean of cos³ over the pixels times the area of the image, 8.
    let cubed = |x: f64, y: f64| (1.0 + x * x + y * y).powf(-1.5);
    let flux = 8.0 * 0.5 * (cubed(0.5, 0.5) + cubed(1.5, 0.5));
    assert!((f64::from(intensity.0.x) / (100.0 / flux) - 1.0).abs() < 1e-5, "{intensity:?} for {}", 100.0 / flux);
}

#[test]
fn roughness_textures_and_metals_become_those_of_ours() {
    let scene = with(&format!(
        "LightSource \"point\"\nTexture \"checks\" \"spectrum\" \"checkerboard\" \"float uscale\" 4 \"float vdelta\" 0.5 \"rgb tex1\" [1 0 0]\n\
         Texture \"dark\" \"spectrum\" \"scale\" \"texture tex\" \"checks\" \"float scale\" 0.5\n\
         Material \"conductor\" \"float roughness\" 0.04 \"rgb eta\" [0.2 0.9 1.1] \"rgb k\" [3.9 2.45 2.14]\n{SQUARE}\
         Material \"conductor\" \"float roughness\" 0.04 \"bool remaproughness\" false\n{SQUARE}\
         Material \"dielectric\" \"float roughness\" 0.25 \"spectrum eta\" \"glass-F11\"\n{SQUARE}\
         Material \"dielectric\"\n{SQUARE}Material \"diffuse\" \"texture reflectance\" \"dark\"\n{SQUARE}\
         Material \"conductor\" \"float uroughness\" 0.09 \"float vroughness\" 0.04\n{SQUARE}"
    ));
    assert_eq!(told(&scene), Vec::<String>::new());
    let parts: Vec<&MaterialPart> = scene.file.materials.iter().map(|(_, part)| part).collect();
    let number = |value: &firstlight::scene::ScalarValue| match value {
        firstlight::scene::ScalarValue::Number(number) => *number,
        other => panic!("{other:?}"),
    };
    match parts[..] {
        [
            MaterialPart::Conductor { alpha: a, eta, k, .. },
            MaterialPart::Conductor { alpha: b, .. },
            MaterialPart::RoughGlass { alpha: c, ior, .. },
            MaterialPart::Glass { ior: plain, .. },
            MaterialPart::Diffuse { albedo: ColorValue::Texture(name) },
            MaterialPart::Conductor { alpha: u, alpha_v: v, .. },
        ] => {
            assert!((number(u) - 0.3).abs() < 1e-6 && (number(v) - 0.2).abs() < 1e-6, "{u:?} {v:?}");
            // The square root; colours are taken channel by channel.
            assert!(
                (number(a) - 0.2).abs() < 1e-6 && (number(b) - 0.04).abs() < 1e-7 && (number(c) - 0.5).abs() < 1e-6
            );
            let near = |found: &Rgb, expected: Vec3| (found.0 - expected).abs().max_element() < 1e-4;
            assert!(near(eta, Vec3::new(0.2, 0.9, 1.1)) && near(k, Vec3::new(3.9, 2.45, 2.14)), "{eta:?} {k:?}");
            assert!((ior - 1.78472).abs() < 1e-5 && *plain == 1.5);
            let TextureSource::Checker { a, b, squares, offset, .. } = scene.file.textures.get(name).unwrap() else {
                panic!("{:?}", scene.file.textures)
            };
            assert_eq!((a.0, b.0), (Vec3::new(0.5, 0.0, 0.0), Vec3::ZERO));
            assert_eq!((squares.to_array(), offset.to_array()), ([4.0, 1.0], [0.0, 0.5]));
        }
        _ => panic!("{parts:#?}"),
    }
}

#[test]
fn compressed_meshes_and_includes_are_read() {
    let packed = |text: &str| {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(text.as_bytes()).unwrap();
        encoder.finish().unwrap()
    };
    let (folder, path) = folder(&[("a.pbrt", "WorldBegin\nInclude \"b.pbrt.gz\"")]);
    std::fs::write(
        folder.path().join("b.pbrt.gz"),
        packed("LightSource \"point\"\nShape \"plymesh\" \"string filename\" \"c.ply.gz\""),
    )
    .unwrap();
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    std::fs::write(folder.path().join("c.ply.gz"), packed(ply)).unwrap();
    let scene = open(&path);
    assert_eq!(told(&scene), Vec::<String>::new());
    match &scene.file.objects[..] {
        [ObjectPart::Mesh { source: MeshSource::Ply(file), .. }] => assert_eq!(file, "c.ply.gz"),
        other => panic!("{other:?}"),
    }
    assert!(open(&folder.path().join("c.ply.gz")).file.objects.iter().any(|it| it.name() == Some("model")));
}

#[test]
fn a_scene_without_light_is_lit_like_a_model_and_told() {
    let scene = with(SQUARE);
    assert!(matches!(scene.file.environment, EnvironmentSource::Gradient { .. }));
    assert!(told(&scene).iter().any(|text| text.contains("has no light: an environment and a key light are added")));
}

/// In an image of equal areas the direction of each texel counts, whatever the transform of the light is.
#[test]
fn an_environment_image_stands_where_pbrt_has_it() {
    // 2 × 2 texels: the middle is +z of the light, and the four are its quadrants of x and y; rows from the bottom.
    let texels: [[f32; 3]; 4] = [[0.0, 0.0, 1.0], [1.0, 1.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let mut pfm = b"PF\n2 2\n-1\n".to_vec();
    pfm.extend(texels.iter().flatten().flat_map(|number| number.to_le_bytes()));
    let text = "Film \"rgb\" \"integer xresolution\" 4 \"integer yresolution\" 4\nPixelFilter \"box\"\n\
        Scale -1 1 1\nLookAt 0 0 4  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" 60\nWorldBegin\n\
        LightSource \"infinite\" \"string filename\" \"sky.pfm\" \"float scale\" 2\n\
        Translate 0 -100 0\nShape \"sphere\" \"float radius\" 0.1\n";
    let (folder, path) = folder(&[("a.pbrt", text)]);
    std::fs::write(folder.path().join("sky.pfm"), pfm).unwrap();
    let scene = open(&path);
    assert_eq!(told(&scene), Vec::<String>::new());
    let pixels = pixels(&scene, 4);
    // The camera looks along −z: x to the right, y above. v grows with y of the light, and rows count from the top, so
    // the top row of the image is −y. Upper left is x < 0, y > 0: lower left texel of the image.
    for (pixel, expected) in [(0, [0.0, 0.0, 2.0]), (3, [2.0, 2.0, 2.0]), (12, [2.0, 0.0, 0.0]), (15, [0.0, 2.0, 0.0])]
    {
        assert!((pixels[pixel] - Vec3::from_array(expected)).abs().max_element() < 0.05, "{pixel}: {}", pixels[pixel]);
    }
}
