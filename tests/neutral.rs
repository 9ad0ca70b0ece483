//! `scripts/neutral_to_scene.py`: every field of the neutral form is carried over or refused by its name.

use assert_cmd::Command;
use serde_json::{Value, json};
use std::path::Path;

const SCRIPT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scripts/neutral_to_scene.py");

/// A scene with every field and every kind that the form has.
fn everything() -> Value {
    json!({
        "name": "everything", "about": "two\nlines", "filter": "box", "environment": [0.1, 0.2, 0.3], "max_depth": 64,
        "ref": {"integrator": "path", "spp": 4},
        "camera": {
            "origin": [0, 1, 5], "look_at": [0, 1, 0], "up": [0, 1, 0], "vfov": 35.5, "width": 48, "height": 32,
            "aperture_radius": 0.05, "focus_distance": 4.5,
        },
        "textures": {
            "squares": {"type": "checker", "a": [0.8, 0.8, 0.8], "b": [0.1, 0.1, 0.1], "squares": [4, 6]},
            "photo": {"type": "image", "file": "photo.png"},
        },
        "materials": {
            "tiles": {"type": "diffuse", "albedo": {"texture": "squares"}},
            "poster": {"type": "diffuse", "albedo": {"texture": "photo"}},
            "red": {"type": "diffuse", "albedo": [0.6, 0.1, 0.1]},
            "mirror": {"type": "mirror", "reflectance": [0.9, 0.9, 0.9]},
            "metal": {"type": "metal", "alpha": 0.15, "reflectance": [0.9, 0.7, 0.3]},
            "glass": {"type": "glass", "ior": 1.45},
            "coat": {"type": "blend", "weight": 0.2, "a": "red", "b": "metal"},
            "lamp": {"type": "emissive", "radiance": [9, 8, 7]},
        },
        "objects": [
            {"type": "quad", "corner": [-2, 0, 2], "edge_u": [4, 0, 0], "edge_v": [0, 0, -4], "material": "tiles"},
            {"type": "quad", "corner": [-2, 0, -2], "edge_u": [4, 0, 0], "edge_v": [0, 3, 0], "material": "poster"},
            {"type": "quad", "corner": [-1, 3, -1], "edge_u": [1, 0, 0], "edge_v": [0, 0, 1], "material": "lamp"},
            {"type": "sphere", "center": [0, 0.5, 0], "radius": 0.5, "material": "glass"},
            {"type": "spheres", "centers": [1, 0.2, 0, 1, 0.2, 1], "radii": [0.2, 0.1], "material": "mirror"},
            {"type": "mesh", "obj": "tri.obj", "scale": 0.5, "rotate_y": 30, "translate": [-1, 0, 0], "smooth": true, "material": "coat"},
            {
                "type": "mesh", "obj": "tri.obj", "smooth": false, "material": "metal",
                "matrix": [[1, 0, 0, 0.5], [0, 1, 0, 0], [0, 0, 1, -1], [0, 0, 0, 1]],
            },
        ],
    })
}

/// A folder with the files that [`everything`] names.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 3 4\n";
    std::fs::write(folder.path().join("tri.obj"), triangle).unwrap();
    image::RgbImage::from_pixel(2, 2, image::Rgb([200, 100, 50])).save(folder.path().join("photo.png")).unwrap();
    folder
}

/// The scene file, or what the script says.
fn convert(folder: &Path, scene: &Value) -> Result<String, String> {
    let (source, target) = (folder.join("scene.json"), folder.join("scene.ron"));
    std::fs::write(&source, scene.to_string()).unwrap();
    let output = Command::new("python3").arg(SCRIPT).arg(&source).arg("-o").arg(&target).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    if output.status.success() { Ok(std::fs::read_to_string(target).unwrap()) } else { Err(said) }
}

fn has_python() -> bool {
    let found = std::process::Command::new("python3").arg("--version").output().is_ok();
    if !found {
        println!("skipped: there is no python3");
    }
    found
}

#[test]
fn every_field_is_carried_over() {
    if !has_python() {
        return;
    }
    let folder = folder();
    let scene = convert(folder.path(), &everything()).unwrap();
    for said in [
        "// everything",
        "// two",
        "// lines",
        "eye: (0, 1, 5)",
        "look_at: (0, 1, 0)",
        "up: (0, 1, 0)",
        "vfov: 35.5",
        "lens_radius: 0.05",
        "focus_distance: 4.5",
        "width: 48, height: 32",
        "max_depth: 64",
        "environment: constant((0.1, 0.2, 0.3))",
        "squares: (4, 6)",
        "image(file: \"photo.png\", smooth: false)",
        "\"tiles\": diffuse(albedo: \"squares\")",
        "mirror(reflectance: (0.9, 0.9, 0.9))",
        "fresnel: constant",
        "compensate: false",
        "alpha: 0.15",
        "glass(ior: 1.45)",
        "blend(weight: 0.2, a: \"red\", b: \"metal\")",
        "emissive(radiance: (9, 8, 7))",
        "edge_v: (0, 0, -4)",
        "sphere(center: (0, 0.5, 0), radius: 0.5",
        "radii: each([0.2, 0.1])",
        "shading: smooth",
        "shading: flat",
        "scale: 0.5, rotate: (0, 30, 0), translate: (-1, 0, 0)",
        "matrix: ((1, 0, 0, 0.5), (0, 1, 0, 0), (0, 0, 1, -1))",
    ] {
        assert!(scene.contains(said), "`{said}` is missing:\n{scene}");
    }
    // And the program takes it.
    let picture = folder.path().join("out.exr");
    let mut program = Command::cargo_bin("firstlight").unwrap();
    program.arg("render").arg(folder.path().join("scene.ron")).args(["--spp", "1", "-o"]).arg(&picture);
    program.assert().success();
    assert_eq!(image::image_dimensions(&picture).unwrap(), (48, 32));
}

#[test]
fn what_cannot_be_said_is_refused_by_its_name() {
    if !has_python() {
        return;
    }
    let folder = folder();
    // Where, what is put there, and what the refusal has to name.
    let cases = [
        ("/filter", json!("gauss"), "filter"),
        ("/fog", json!(1), "fog"),
        ("/environment", json!({"file": "sky.exr"}), "environment"),
        ("/max_depth", json!(0), "max_depth"),
        ("/max_depth", json!(2.5), "max_depth"),
        ("/camera/shutter", json!(1), "shutter"),
        ("/camera/width", json!("48"), "camera.width"),
        ("/camera/height", json!(0), "camera.height"),
        ("/camera/vfov", json!("wide"), "camera.vfov"),
        ("/camera/origin", json!([0, 1]), "camera.origin"),
        ("/textures", json!([1]), "textures"),
        ("/textures/squares/type", json!("stripes"), "textures.squares"),
        ("/textures/squares/offset", json!(1), "offset"),
        ("/textures/photo/file", json!("none.png"), "none.png"),
        ("/textures/photo", json!(3), "textures.photo"),
        ("/materials/red", json!([1, 0, 0]), "materials.red"),
        ("/materials/red/type", json!("velvet"), "velvet"),
        ("/materials/red/roughness", json!(0.2), "roughness"),
        ("/materials/red/albedo", json!(0.5), "albedo"),
        ("/materials/red/albedo", json!({"texture": "none"}), "none"),
        ("/materials/metal/alpha", json!({"texture": "squares"}), "alpha"),
        ("/materials/metal/fresnel", json!("schlick"), "fresnel"),
        ("/materials/glass/absorption", json!([1, 1, 1]), "absorption"),
        ("/materials/coat/a", json!("gone"), "gone"),
        ("/materials/coat/weight", json!({"texture": "squares"}), "weight"),
        ("/materials/lamp/two_sided", json!(true), "two_sided"),
        ("/objects/0/type", json!("torus"), "torus"),
        ("/objects/0/material", json!("gone"), "gone"),
        ("/objects/0/uv", json!([0, 1]), "uv"),
        ("/objects/3/material", json!("tiles"), "tiles"),
        ("/objects/4/radii", json!([0.2]), "radii"),
        ("/objects/4/centers", json!([1, 2]), "centers"),
        ("/objects/5/material", json!("poster"), "poster"),
        ("/objects/5/obj", json!("none.obj"), "none.obj"),
        ("/objects/5/rotate_x", json!(10), "rotate_x"),
        ("/objects/6/scale", json!(2), "matrix"),
        ("/objects/6/matrix", json!([[1, 0, 0], [0, 1, 0], [0, 0, 1]]), "matrix"),
        ("/objects/6/matrix", json!([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [5, 0, 0, 1]]), "matrix"),
    ];
    for (place, value, name) in cases {
        let mut scene = everything();
        let (parent, key) = place.rsplit_once('/').unwrap();
        let parent = if parent.is_empty() { &mut scene } else { scene.pointer_mut(parent).unwrap() };
        parent[key] = value.clone();
        let refusal = match convert(folder.path(), &scene) {
            Err(refusal) => refusal,
            Ok(_) => panic!("{place} = {value} went through"),
        };
        assert!(refusal.starts_with("error: ") && refusal.contains(name), "{place} = {value}: {refusal}");
        assert!(!refusal.contains("Traceback"), "{refusal}");
    }
    for missing in ["camera", "materials", "objects"] {
        let mut scene = everything();
        scene.as_object_mut().unwrap().remove(missing);
        assert!(convert(folder.path(), &scene).unwrap_err().contains(missing));
    }
}
