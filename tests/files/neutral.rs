//! `scripts/neutral_to_scene.py`: every field of the neutral form is carried over or refused by its name.

use crate::program::{Outcome, program};
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
            {
                "type": "instances", "obj": "tri.obj", "smooth": false, "material": "red", "matrices": [
                    [1, 0, 0, -1, 0, 1, 0, 1.5, 0, 0, 1, 0], [[0.5, 0, 0, 1], [0, 0.5, 0, 1], [0, 0, 0.5, 0]],
                ],
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

/// The scene file, or what the script says; then nothing has been written and the exit status is 1.
fn convert(folder: &Path, scene: &Value) -> Result<String, String> {
    convert_text(folder, &scene.to_string())
}

fn convert_text(folder: &Path, text: &str) -> Result<String, String> {
    let (source, target) = (folder.join("scene.json"), folder.join("scene.ron"));
    std::fs::write(&source, text).unwrap();
    let _ = std::fs::remove_file(&target);
    let files = || std::fs::read_dir(folder).unwrap().count();
    let before = files();
    let output = Command::new("python3").arg(SCRIPT).arg(&source).arg("-o").arg(&target).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    if output.status.success() {
        return Ok(std::fs::read_to_string(target).unwrap());
    }
    assert_eq!((output.status.code(), files()), (Some(1), before), "{said}");
    assert!(said.starts_with("error: ") && said.lines().count() == 1, "{said}");
    Err(said)
}

/// What the script says to each of many scenes that it has to refuse; Python starts once for all of them.
fn refusals(folder: &Path, scenes: &[Value]) -> Vec<String> {
    const ALL: &str = "
import contextlib, io, json, os, sys
sys.path.insert(0, os.path.dirname(sys.argv[1]))
sys.dont_write_bytecode = True
from neutral_to_scene import main
for path in sys.argv[2:]:
    sys.argv = ['', path]
    with contextlib.redirect_stderr(io.StringIO()) as said:
        code = main()
    print(json.dumps([code, said.getvalue()]))
";
    let paths: Vec<_> = (0..scenes.len()).map(|i| folder.join(format!("{i}.json"))).collect();
    for (path, scene) in paths.iter().zip(scenes) {
        std::fs::write(path, scene.to_string()).unwrap();
    }
    let files = || std::fs::read_dir(folder).unwrap().count();
    let before = files();
    let output = Command::new("python3").args(["-c", ALL, SCRIPT]).args(&paths).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let answers = String::from_utf8(output.stdout).unwrap();
    let answers: Vec<(i32, String)> = answers.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!((answers.len(), files()), (scenes.len(), before));
    let refusal = |(i, (code, said)): (usize, (i32, String))| {
        assert!(code == 1 && said.starts_with("error: ") && said.lines().count() == 1, "{}: {said}", scenes[i]);
        said
    };
    answers.into_iter().enumerate().map(refusal).collect()
}

/// The linear picture of a scene file after a few samples, and what was said meanwhile.
fn picture_of(scene: &Path) -> (image::Rgb32FImage, String) {
    let picture = scene.with_extension("exr");
    let mut command = program(scene.parent().expect("its folder"));
    let outcome = Outcome::of(command.arg("render").arg(scene).args(["--spp", "4", "-o"]).arg(&picture));
    assert_eq!(outcome.status, Some(0), "{outcome:?}");
    // The last line is the result.
    let warnings = outcome.err.lines().filter(|line| !line.starts_with(&*picture.to_string_lossy())).collect();
    (image::open(picture).unwrap().into_rgb32f(), warnings)
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
        "image(file: \"photo.png\", smooth: false, wrap: clamp)",
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
}

/// The picture of a converted scene is that of the same scene written by hand, to the last bit.
#[test]
fn a_converted_scene_is_the_scene_that_was_meant() {
    if !has_python() {
        return;
    }
    let folder = folder();
    convert(folder.path(), &everything()).unwrap();
    let by_hand = folder.path().join("by_hand.ron");
    std::fs::write(&by_hand, BY_HAND).unwrap();
    let (converted, said) = picture_of(&folder.path().join("scene.ron"));
    assert_eq!((converted.dimensions(), said.as_str()), ((48, 32), ""));
    assert!(converted == picture_of(&by_hand).0, "another picture");
    // The test would not notice a field that changes nothing.
    for (place, value) in [
        ("/camera/up", json!([0.1, 1, 0])),
        ("/camera/aperture_radius", json!(0)),
        ("/camera/focus_distance", json!(2)),
        ("/environment", json!(null)),
        ("/max_depth", json!(2)),
        ("/textures/squares/squares", json!([4, 5])),
        ("/materials/coat/weight", json!(0.9)),
        ("/materials/metal/alpha", json!(0.05)),
        ("/objects/5/smooth", json!(false)),
        ("/objects/5/rotate_y", json!(-30)),
        ("/objects/6/matrix/0/3", json!(0.6)),
        ("/objects/7/matrices/1/0/3", json!(1.1)),
        ("/objects/7/smooth", json!(true)),
    ] {
        let mut scene = everything();
        *scene.pointer_mut(place).unwrap() = value;
        convert(folder.path(), &scene).unwrap();
        assert!(converted != picture_of(&folder.path().join("scene.ron")).0, "{place} changes nothing");
    }
}

/// [`everything`], written with other words wherever the scene file has some.
const BY_HAND: &str = r#"(
    camera: (eye: (0, 1, 5), forward: (0, 0, -1), up: (0, 1, 0), vfov: 35.5, lens_radius: 0.05, focus_distance: 4.5),
    film: (width: 48, height: 32),
    max_depth: 64,
    environment: constant((0.1, 0.2, 0.3)),
    textures: {
        "chess": checker(a: (0.8, 0.8, 0.8), b: (0.1, 0.1, 0.1), squares: (4, 6)),
        "picture": image(file: "photo.png", smooth: false),
    },
    materials: {
        "lamp": emissive(radiance: (9, 8, 7)),
        "floor": diffuse(albedo: "chess"),
        "wall": diffuse(albedo: "picture"),
        "red": diffuse(albedo: (0.6, 0.1, 0.1)),
        "silver": mirror(reflectance: (0.9, 0.9, 0.9)),
        "gold": metal(alpha: 0.15, reflectance: (0.9, 0.7, 0.3)),
        "glass": glass(ior: 1.45),
        "coat": blend(weight: 0.2, a: "red", b: "gold"),
    },
    objects: [
        quad(corner: (-2, 0, 2), edge_u: (4, 0, 0), edge_v: (0, 0, -4), material: "floor"),
        quad(corner: (-2, 0, -2), edge_u: (4, 0, 0), edge_v: (0, 3, 0), material: "wall"),
        quad(corner: (-1, 3, -1), edge_u: (1, 0, 0), edge_v: (0, 0, 1), material: "lamp"),
        sphere(center: (0, 0.5, 0), radius: 0.5, material: "glass"),
        spheres(centers: [(1, 0.2, 0), (1, 0.2, 1)], radii: each([0.2, 0.1]), material: "silver"),
        mesh(
            source: obj("tri.obj"), shading: smooth, material: "coat",
            transform: (translate: (-1, 0, 0), rotate: (0, 30, 0), scale: (0.5, 0.5, 0.5)),
        ),
        mesh(source: obj("tri.obj"), shading: flat, material: "gold", transform: (translate: (0.5, 0, -1))),
        mesh(source: obj("tri.obj"), shading: flat, material: "red", transform: (translate: (-1, 1.5, 0))),
        mesh(source: obj("tri.obj"), shading: flat, material: "red", transform: (translate: (1, 1, 0), scale: 0.5)),
    ],
)"#;

/// Positions and faces count, and nothing else that an OBJ says.
#[test]
fn meshes_are_their_positions_and_faces() {
    if !has_python() {
        return;
    }
    let folder = folder();
    // A pyramid: one corner is shared by all its sides, and the seam of texture coordinates runs through it.
    let positions = "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nv 0 1.5 0\n";
    let plain = format!("{positions}f 1 5 2\nf 2 5 3\nf 3 5 4\nf 4 5 1\nf 1 2 3 4\n");
    let rich = format!(
        "mtllib gone.mtl\n{positions}vt 0 0\nvt 1 0\nvt 0.5 1\nvn 1 0 0\nvn 0 0 1\nusemtl one\nf 1/1/1 5/3/1 2/2/1\n\
         usemtl two\nf -4/1/2 -1/2/2 -3/3/2\ng side\nf 3/1/1 5/3/2 4/2/1\nf 4//2 5//1 1//2\nf -5/1/1 -4/2/1 -3/3/1 -2/1/1\n"
    );
    let mut pictures = Vec::new();
    for smooth in [true, false] {
        for text in [&plain, &rich] {
            std::fs::write(folder.path().join("tri.obj"), text).unwrap();
            let mut scene = everything();
            scene["objects"][5]["smooth"] = json!(smooth);
            convert(folder.path(), &scene).unwrap();
            let (picture, said) = picture_of(&folder.path().join("scene.ron"));
            assert_eq!(said, "", "smooth {smooth}");
            pictures.push(picture);
        }
    }
    assert!(pictures[0] == pictures[1], "what else the file says changes smooth meshes");
    assert!(pictures[2] == pictures[3], "what else the file says changes flat meshes");
    assert!(pictures[0] != pictures[2], "smooth or not is the same");
}

/// Pictures of 8 bits a sample, whatever their samples stand for; where they can be seen through counts nowhere.
#[test]
fn eight_bit_pictures_are_taken_and_others_refused() {
    if !has_python() {
        return;
    }
    let folder = folder();
    let photo = folder.path().join("photo.png");
    let (grey, gray_image) = (image::Luma([90_u8]), |x, y| image::Luma([if x == y { 90_u8 } else { 200 }]));
    let mut pictures = Vec::new();
    let mut show = |what: &str| {
        convert(folder.path(), &everything()).unwrap_or_else(|refusal| panic!("{what}: {refusal}"));
        pictures.push(picture_of(&folder.path().join("scene.ron")).0);
    };
    image::GrayImage::from_fn(2, 2, gray_image).save(&photo).unwrap();
    show("grey");
    let rgb = image::RgbImage::from_fn(2, 2, |x, y| image::Rgb([gray_image(x, y).0[0]; 3]));
    rgb.save(&photo).unwrap();
    show("rgb");
    image::RgbaImage::from_fn(2, 2, |x, y| {
        let [level] = gray_image(x, y).0;
        image::Rgba([level, level, level, if x == 0 { 10 } else { 255 }])
    })
    .save(&photo)
    .unwrap();
    show("with alpha");
    // Two bits an index, two colours of eight bits a sample: made by zlib and CRC of Python.
    let palette = "import struct, sys, zlib\n\
        def chunk(name, data): return struct.pack('>I', len(data)) + name + data + struct.pack('>I', zlib.crc32(name + data))\n\
        rows = zlib.compress(bytes([0, 0b00010000, 0, 0b01000000]))\n\
        open(sys.argv[1], 'wb').write(b'\\x89PNG\\r\\n\\x1a\\n' + chunk(b'IHDR', struct.pack('>IIBBBBB', 2, 2, 2, 3, 0, 0, 0)) \
        + chunk(b'PLTE', bytes([90] * 3 + [200] * 3)) + chunk(b'IDAT', rows) + chunk(b'IEND', b''))\n";
    Command::new("python3").arg("-c").arg(palette).arg(&photo).assert().success();
    show("palette");
    assert!(pictures.windows(2).all(|pair| pair[0] == pair[1]), "the same grey in other words is another picture");

    let refused = |what: &str, name: &str| match convert(folder.path(), &everything()) {
        Err(refusal) => assert!(refusal.contains("textures.photo") && refusal.contains(name), "{what}: {refusal}"),
        Ok(_) => panic!("{what} went through"),
    };
    image::ImageBuffer::from_pixel(2, 2, image::Luma([9_u16])).save(&photo).unwrap();
    refused("16 bits", "16 bits");
    let sound = std::fs::read({
        rgb.save(&photo).unwrap();
        &photo
    });
    let sound = sound.unwrap();
    std::fs::write(&photo, &sound[..sound.len() - 6]).unwrap();
    refused("a cut file", "cut short");
    let mut flipped = sound.clone();
    flipped[20] ^= 1;
    std::fs::write(&photo, flipped).unwrap();
    refused("a flipped bit", "damaged");
    image::GrayImage::from_pixel(2, 2, grey).save_with_format(&photo, image::ImageFormat::Jpeg).unwrap();
    refused("a JPEG", "not a PNG");
    std::fs::write(&photo, "").unwrap();
    refused("nothing", "not a PNG");
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
    let cases = cases.into_iter().chain([
        ("/name", json!(3), "name"),
        ("/about", json!(["a"]), "about"),
        ("/ref", json!("path"), "ref"),
        ("/ref/denoiser", json!("none"), "denoiser"),
        ("/ref/spp", json!(0.5), "ref.spp"),
        ("/environment", json!([0.1, -0.2, 0.3]), "environment"),
        ("/environment", json!([1e39, 0, 0]), "environment"),
        ("/environment", json!(0.5), "environment"),
        ("/max_depth", json!("64"), "max_depth"),
        ("/max_depth", json!(true), "max_depth"),
        ("/camera", json!(null), "camera"),
        ("/camera/vfov", json!(0), "camera.vfov"),
        ("/camera/vfov", json!(180), "camera.vfov"),
        ("/camera/vfov", json!(null), "camera.vfov"),
        ("/camera/width", json!(70_000), "camera.width"),
        ("/camera/width", json!(48.0), "camera.width"),
        ("/camera/height", json!(-1), "camera.height"),
        ("/camera/look_at", json!([0, 1, 5]), "camera.look_at"),
        ("/camera/up", json!([0, 0, 0]), "camera.up"),
        ("/camera/up", json!([0, 0, 2]), "camera.up"),
        ("/camera/origin", json!([0, 1, 1e13]), "camera.origin"),
        ("/camera/origin", json!([0, 1, true]), "camera.origin"),
        ("/camera/aperture_radius", json!(-0.1), "camera.aperture_radius"),
        ("/camera/aperture_radius", json!("0"), "camera.aperture_radius"),
        ("/camera/focus_distance", json!(0), "camera.focus_distance"),
        ("/camera/focus_distance", json!(null), "camera.focus_distance"),
        ("/textures/squares/type", json!(["checker"]), "textures.squares"),
        ("/textures/squares/squares", json!([4.5, 6]), "textures.squares.squares"),
        ("/textures/squares/squares", json!([0, 6]), "textures.squares.squares"),
        ("/textures/squares/squares", json!([4]), "textures.squares.squares"),
        ("/textures/squares/squares", json!(4), "textures.squares.squares"),
        ("/textures/squares/a", json!([1.2, 0, 0]), "textures.squares.a"),
        ("/textures/photo/file", json!(3), "textures.photo.file"),
        ("/textures/photo/smooth", json!(true), "smooth"),
        ("/materials/red/type", json!(null), "materials.red.type"),
        ("/materials/red/albedo", json!([0.6, 0.1]), "materials.red.albedo"),
        ("/materials/red/albedo", json!([0.6, 0.1, 1.1]), "materials.red.albedo"),
        ("/materials/red/albedo", json!([0.6, 0.1, -0.1]), "materials.red.albedo"),
        ("/materials/red/albedo", json!({"texture": ["squares"]}), "materials.red.albedo"),
        ("/materials/red/albedo", json!({"texture": "squares", "scale": 2}), "scale"),
        ("/materials/mirror/reflectance", json!([2, 1, 1]), "materials.mirror.reflectance"),
        ("/materials/mirror/reflectance", json!({"texture": "squares"}), "materials.mirror.reflectance"),
        ("/materials/metal/reflectance", json!([-1, 1, 1]), "materials.metal.reflectance"),
        ("/materials/metal/alpha", json!(0), "materials.metal.alpha"),
        ("/materials/metal/alpha", json!(1.5), "materials.metal.alpha"),
        ("/materials/metal/alpha", json!([0.1, 0.2]), "materials.metal.alpha"),
        ("/materials/glass/ior", json!(0), "materials.glass.ior"),
        ("/materials/glass/ior", json!("1.5"), "materials.glass.ior"),
        ("/materials/coat/weight", json!(1.01), "materials.coat.weight"),
        ("/materials/coat/weight", json!(-0.5), "materials.coat.weight"),
        ("/materials/coat/a", json!(["red"]), "materials.coat.a"),
        ("/materials/coat/a", json!("coat"), "materials.coat"),
        ("/materials/lamp/radiance", json!([-1, 0, 0]), "materials.lamp.radiance"),
        ("/materials/lamp/radiance", json!({"texture": "squares"}), "materials.lamp.radiance"),
        ("/materials/two", json!({"type": "blend", "weight": 0.5, "a": "lamp", "b": "lamp"}), "materials.two"),
        ("/objects", json!({}), "objects"),
        ("/objects/0", json!("quad"), "objects[0]"),
        ("/objects/0/material", json!(["red"]), "objects[0].material"),
        ("/objects/0/edge_v", json!([0.1, 0, -4]), "objects[0].edge_v"),
        ("/objects/0/edge_v", json!([0, 0, 0]), "objects[0].edge_v"),
        ("/objects/0/edge_v", json!([2, 0, 0]), "0.00 degrees"),
        ("/objects/0/edge_u", json!([4, 0, 4]), "135.00 degrees"),
        ("/objects/3/radius", json!(0), "objects[3].radius"),
        ("/objects/3/radius", json!(-1), "objects[3].radius"),
        ("/objects/3/center", json!("here"), "objects[3].center"),
        ("/objects/4/radii", json!([0.2, -0.1]), "objects[4].radii"),
        ("/objects/4/radii", json!(0.2), "objects[4].radii"),
        ("/objects/4/centers", json!([[1, 2, 3], [1, 2, 3]]), "objects[4].centers"),
        ("/objects/4/centers", json!([1, 0.2, 0, 1, 0.2, "1"]), "objects[4].centers"),
        ("/objects/4/centers", json!([]), "objects[4].centers"),
        ("/objects/5/smooth", json!("false"), "objects[5].smooth"),
        ("/objects/5/smooth", json!(1), "objects[5].smooth"),
        ("/objects/5/smooth", json!(null), "objects[5].smooth"),
        ("/objects/5/rotate_y", json!([]), "objects[5].rotate_y"),
        ("/objects/5/rotate_y", json!([0, 30, 0]), "objects[5].rotate_y"),
        ("/objects/7/matrices", json!([]), "objects[7].matrices"),
        ("/objects/7/matrices", json!(null), "objects[7].matrices"),
        ("/objects/7/matrices/0", json!([1, 0, 0]), "objects[7].matrices[0]"),
        ("/objects/7/obj", json!("none.obj"), "none.obj"),
        ("/objects/7/scale", json!(2), "scale"),
        ("/objects/5/scale", json!(0), "objects[5].scale"),
        ("/objects/5/scale", json!([1, 0, 1]), "objects[5].scale"),
        ("/objects/5/scale", json!("2"), "objects[5].scale"),
        ("/objects/5/translate", json!(1), "objects[5].translate"),
        ("/objects/5/obj", json!(["tri.obj"]), "objects[5].obj"),
        ("/objects/5/obj", json!("photo.png"), "objects[5].obj"),
        ("/objects/6/matrix", json!(3), "objects[6].matrix"),
        ("/objects/6/matrix", json!([[1, 0, 0, 0], [0, 1, 0, 0], [1, 1, 0, 0]]), "objects[6].matrix"),
        ("/objects/6/matrix", json!([[1, 0, 0, 0], [0, 0, 0, 0], [0, 0, 1, 0]]), "objects[6].matrix"),
        ("/objects/6/matrix", json!([[1, 0, 0, "0"], [0, 1, 0, 0], [0, 0, 1, 0]]), "objects[6].matrix"),
    ]);
    let with_value = |(place, value, name): (&str, Value, &'static str)| {
        let mut scene = everything();
        let (parent, key) = place.rsplit_once('/').unwrap();
        match scene.pointer_mut(parent).unwrap() {
            Value::Array(list) => list[key.parse::<usize>().unwrap()] = value.clone(),
            parent => parent[key] = value.clone(),
        }
        (format!("{place} = {value}"), scene, name)
    };
    let without = ["camera", "materials", "objects"].map(|missing| {
        let mut scene = everything();
        scene.as_object_mut().unwrap().remove(missing);
        (format!("without {missing}"), scene, missing)
    });
    let cases: Vec<_> = cases.map(with_value).chain(without).collect();
    let scenes: Vec<_> = cases.iter().map(|(_, scene, _)| scene.clone()).collect();
    for ((case, _, name), refusal) in cases.iter().zip(refusals(folder.path(), &scenes)) {
        assert!(refusal.contains(name), "{case}: {refusal}");
    }
}

#[test]
fn text_that_is_not_one_scene_is_refused() {
    if !has_python() {
        return;
    }
    let folder = folder();
    let text = everything().to_string();
    let with = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        text.replacen(from, to, 1)
    };
    for (broken, name) in [
        (String::new(), "line 1"),
        (text[..text.len() - 1].to_owned(), "delimiter"),
        (with("\"max_depth\":64", "\"max_depth\":64,\"max_depth\":2"), "`max_depth`|field `max_depth` stands twice"),
        (with("\"vfov\":35.5", "\"vfov\":35.5,\"vfov\":35.5"), "vfov"),
        (with("35.5", "NaN"), "NaN"),
        (with("35.5", "Infinity"), "Infinity"),
        (with("35.5", "1e999"), "camera.vfov"),
        (with("35.5", &"9".repeat(400)), "camera.vfov"),
        (with("35.5", &"9".repeat(5000)), "digits"),
        (with("35.5", &format!("{}{}", "[".repeat(100_000), "]".repeat(100_000))), "nested"),
        (with("\"materials\":{", "\"materials\":{\"a\\tb\":{\"type\":\"glass\",\"ior\":1.5},"), "cannot stand"),
        ("[]".to_owned(), "scene"),
    ] {
        let refusal = convert_text(folder.path(), &broken).expect_err(name);
        assert!(name.split('|').any(|name| refusal.contains(name)), "{name}: {refusal}");
    }
    // Blends that grow without end, or come to more plain materials than the program takes.
    let mut scene = everything();
    for i in 0..12 {
        let part = |k: i32| if i == 0 { json!("red") } else { json!(format!("b{}", i - k)) };
        scene["materials"][format!("b{i}")] = json!({"type": "blend", "weight": 0.5, "a": part(1), "b": part(1)});
    }
    let refusal = convert(folder.path(), &scene).unwrap_err();
    assert!(refusal.contains("materials.b") && refusal.contains('8'), "{refusal}");
    // A mirror image is a placement like any other.
    let mut scene = everything();
    scene["objects"][6]["matrix"] = json!([-1, 0, 0, 0.5, 0, 1, 0, 0, 0, 0, 1, -1]);
    assert!(convert(folder.path(), &scene).unwrap().contains("((-1, 0, 0, 0.5), (0, 1, 0, 0), (0, 0, 1, -1))"));
    picture_of(&folder.path().join("scene.ron"));
}
