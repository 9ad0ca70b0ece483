//! An image opens again as the scene that it shows, through the program: scenes with tracks, cuts, motion blur, cameras of
//! their own, models and archives. What is rendered of an image has the same bytes as the image.

use super::parts::{does, equal, fails, run_in};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use std::path::Path;

const SMALL: &str = "--size 48x32 --spp 4 --threads 2";

/// Tracks of everything, with a cut at 1 s.
const SCENE: &str = r#"(
    camera: (eye: (0, 1, 6), look_at: (0, 0.5, 0), lens_radius: 0.02),
    cameras: { "side": (eye: (6, 1, 0), look_at: (0, 0.5, 0)) },
    environment: gradient(zenith: 0.6, horizon: 0.4, ground: 0.1),
    materials: { "red": diffuse(albedo: (0.8, 0.1, 0.1)), "floor": diffuse(albedo: 0.5) },
    objects: [plane(material: "floor"), sphere(name: "ball", center: (0, 0.5, 0), radius: 0.5, material: "red")],
    lights: [point(name: "bulb", position: (2, 3, 2), intensity: 20)],
    animation: (
        fps: 4, shutter: 1,
        tracks: [
            camera(property: eye, interpolation: held, keys: [(0, (0, 1, 6)), (1, (3, 1, 5))]),
            camera(property: look_at, interpolation: smooth, keys: [(0, (0, 0.5, 0)), (2, (1, 0.5, 0))]),
            object(name: "ball", property: translate, keys: [(0, (0, 0.5, 0)), (2, (2, 0.5, 0))]),
            light(name: "bulb", property: intensity, keys: [(0, 20), (2, 5)]),
            material(name: "red", property: albedo, keys: [(0, (0.8, 0.1, 0.1)), (2, 0.4)]),
        ],
    ),
)"#;

/// A triangle that also changes its shape and a camera, which move for two seconds.
///
/// - `flight`: of the second camera, from where to where; it has the speed of the motion blur.
fn moving_model(flight: [f32; 6]) -> String {
    let numbers: Vec<f32> = [
        [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].as_slice(),
        &[0.0, 2.0],
        &[-1.0, 0.0, 0.0, 1.0, 0.5, 0.0],
        &flight,
        &[0.0, 0.0, -3.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0],
        &[0.0, 1.0],
    ]
    .concat();
    let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
    let view = |index: usize, length: usize| {
        format!(r#"{{"buffer":0,"byteOffset":{},"byteLength":{}}}"#, 4 * index, 4 * length)
    };
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0,1,2]}}],
        "nodes":[{{"name":"still","camera":0,"translation":[0,0,7]}},{{"name":"flying","camera":1,"translation":[0,0,4]}},{{"mesh":0}}],
        "cameras":[{{"name":"still","type":"perspective","perspective":{{"yfov":0.6,"znear":0.1}}}},
                   {{"name":"flying","type":"perspective","perspective":{{"yfov":0.8,"znear":0.1}}}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"targets":[{{"POSITION":4}}]}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}},
                     {{"bufferView":1,"componentType":5126,"count":2,"type":"SCALAR","min":[0],"max":[2]}},
                     {{"bufferView":2,"componentType":5126,"count":2,"type":"VEC3"}},
                     {{"bufferView":3,"componentType":5126,"count":2,"type":"VEC3"}},
                     {{"bufferView":4,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,-3],"max":[0,0.5,0]}},
                     {{"bufferView":5,"componentType":5126,"count":2,"type":"SCALAR"}}],
        "animations":[{{"channels":[{{"sampler":0,"target":{{"node":2,"path":"translation"}}}},
                                    {{"sampler":1,"target":{{"node":1,"path":"translation"}}}},
                                    {{"sampler":2,"target":{{"node":2,"path":"weights"}}}}],
                        "samplers":[{{"input":1,"output":2}},{{"input":1,"output":3}},{{"input":1,"output":5}}]}}],
        "bufferViews":[{},{},{},{},{},{}],
        "buffers":[{{"byteLength":{},"uri":"data:application/octet-stream;base64,{}"}}]}}"#,
        view(0, 9),
        view(9, 2),
        view(11, 6),
        view(17, 6),
        view(23, 9),
        view(32, 2),
        bytes.len(),
        STANDARD.encode(&bytes)
    )
}

const FLIGHT: [f32; 6] = [0.0, 0.0, 4.0, 1.0, 0.0, 5.0];

/// Rendering the image gives the image; so does, but for its note, the scene that is saved of it.
fn reopens(path: &Path, name: &str) {
    let said = does(path, &format!("render {name} -o again.exr --threads 2"));
    assert!(!said.contains("warning"), "{name}: {said}");
    equal(path, name, "again.exr");
}

fn saves(path: &Path, name: &str) {
    does(path, &format!("save {name} -o saved.ron --overwrite"));
    does(path, &format!("render saved.ron -o saved.exr {SMALL}"));
    let pixels = |name: &str| image::open(path.join(name)).unwrap().into_rgb32f().into_raw();
    assert!(pixels(name) == pixels("saved.exr"), "what is saved of {name} is another scene");
}

#[test]
fn an_image_opens_as_what_it_shows_whatever_its_tracks_say() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    std::fs::write(path.join("s.ron"), SCENE).unwrap();
    does(path, &format!("render carousel {SMALL} --turntable 3 -o t.exr"));
    does(path, &format!("render s.ron {SMALL} --turntable 3 --at 0.5 -o m.exr"));
    does(path, &format!("render s.ron {SMALL} --frames 3..6 -o f.exr"));
    does(path, &format!("render s.ron {SMALL} --at 0.5 --shutter 0.25 -o at.exr"));
    let said = does(path, &format!("render s.ron {SMALL} --camera side -o side.exr"));
    assert!(said.contains("camera `side` stands still"), "{said}");
    // Frame 4 is at the cut.
    for name in
        ["t-0001.exr", "t-0002.exr", "m-0003.exr", "f-0003.exr", "f-0004.exr", "f-0005.exr", "at.exr", "side.exr"]
    {
        reopens(path, name);
        saves(path, name);
    }
    // An image of an image; at another time the tracks count.
    does(path, "render t-0002.exr -o u.exr --spp 3");
    reopens(path, "u.exr");
    does(path, &format!("render t-0002.exr --at 1.25 -o a.exr {SMALL}"));
    does(path, &format!("render carousel --at 1.25 -o b.exr {SMALL}"));
    let pixels = |name: &str| image::open(path.join(name)).unwrap().into_rgb32f().into_raw();
    assert!(pixels("a.exr") == pixels("b.exr"), "the time that is asked for wins");
}

#[test]
fn an_image_of_a_moving_model_opens_as_what_it_shows() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    std::fs::write(path.join("m.gltf"), moving_model(FLIGHT)).unwrap();
    for (i, how) in [
        "",
        "--at 0.75",
        "--at 0.75 --shutter 1",
        "--camera flying",
        "--camera flying --at 0.75 --shutter 1",
        "--turntable 2 --at 0.75 --shutter 1",
        "--camera flying --frames 1..3 --fps 2 --shutter 1",
    ]
    .into_iter()
    .enumerate()
    {
        does(path, &format!("render m.gltf {SMALL} {how} -o {i}.exr"));
        let is_last_of_two = how.contains("turntable") || how.contains("frames");
        reopens(path, &if is_last_of_two { format!("{i}-0002.exr") } else { format!("{i}.exr") });
    }
}

/// At 0.75 s the camera of both versions is at the same place, and flies at another speed.
#[test]
fn another_motion_is_another_scene() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let slow = [0.1875, 0.0, 4.1875, 0.6875, 0.0, 4.6875];
    let how = "--camera flying --at 0.75 --shutter 1 --size 16x12 --threads 2";
    for (name, samples, flight) in [("a", "0..2", FLIGHT), ("b", "2..4", slow)] {
        std::fs::write(path.join("m.gltf"), moving_model(flight)).unwrap();
        does(path, &format!("render m.gltf {how} --samples {samples} --film {name}-film.exr -o {name}.exr"));
    }
    let said = fails(path, "merge a-film.exr b-film.exr -o c.exr", 1);
    assert!(said.contains("version of the scene"), "{said}");
    let said = does(path, "render a.exr -o again.exr --threads 2");
    assert!(said.contains("has changed since"), "{said}");
}

/// What is moved has a tree of its own until it rests; an image is one of what rests. The focus of a pinhole whose eye has
/// a track is no edit: it still looks at its target when the image is opened.
#[test]
fn an_image_of_a_replay_opens_as_what_it_shows() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let camera = "camera: (eye: (0, 1.9, 6.2), look_at: (0, 0.6, 0), lens_radius: 0.05, depth_of_field: false)";
    let torus = "mesh(source: builtin(\"torus\"), material: \"m\", transform: (rotate: (90, 0, 0), scale: 0.7))";
    let track =
        "camera(property: eye, interpolation: smooth, keys: [(0, (-5, 1, 0)), (0.5, (0, 1.3, 5)), (1, (5, 1, 0))])";
    let rest =
        "environment: gradient(zenith: 0.6, horizon: 0.4, ground: 0.1), materials: { \"m\": diffuse(albedo: 0.5) }";
    let scene =
        format!("({camera}, {rest}, objects: [{torus}], animation: (fps: 24, shutter: 0.5, tracks: [{track}]))");
    std::fs::write(path.join("s.ron"), scene).unwrap();
    let moved = "Do(2,2.2,Edit(SelectAll))\nDo(3,2.3,Edit(Move(by:(-0.35,0.43,0.0))))";
    let focused = "Do(2,2.2,SetMoment(seconds:Some(0.2916666666666667)))\nDo(3,2.3,SetFocus(distance:3.7))";
    for (name, commands) in [("moved.exr", moved), ("focused.exr", focused)] {
        let header = "(format:1,program:\"firstlight\",scene:File(\"s.ron\"),up:None,width:40,height:30,seed:0)";
        std::fs::write(path.join("a.rec"), format!("{header}\nOpened(1,1,\"\")\n{commands}\nEnd(4,4)\n")).unwrap();
        does(path, &format!("--replay a.rec -o {name}"));
        reopens(path, name);
    }
}

/// The cache with the unpacked files may be deleted: what was saved is whole without it.
#[test]
fn a_scene_of_an_archive_is_saved_with_its_files() {
    let folder = tempfile::tempdir().unwrap();
    let (path, cache) = (folder.path(), folder.path().join("cache"));
    let with_cache = |line: &str| {
        let home = cache.display().to_string();
        let output = run_in(path, line, &[("XDG_CACHE_HOME", &home), ("HOME", &home), ("LOCALAPPDATA", &home)]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        (output.status.success(), said)
    };
    std::fs::create_dir_all(path.join("in/maps")).unwrap();
    image::RgbImage::from_pixel(2, 2, image::Rgb([200, 60, 40])).save(path.join("in/maps/a.png")).unwrap();
    std::fs::write(path.join("in/m.mtl"), "newmtl a\nKd 1 1 1\nmap_Kd maps/a.png\n").unwrap();
    let model = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl a\nf 1/1 2/2 3/3\n";
    std::fs::write(path.join("in/m.obj"), model).unwrap();
    let scene = r#"(camera: (eye: (0, 0, 4), look_at: (0, 0, 0)), environment: constant(1),
        objects: [mesh(source: obj("m.obj"))])"#;
    std::fs::write(path.join("in/s.ron"), scene).unwrap();
    does(path, "pack in/s.ron -o s.zip");
    assert!(with_cache(&format!("render s.zip -o a.exr {SMALL}")).0);
    for _ in 0..2 {
        let (is_done, said) = with_cache("save s.zip -o saved.ron --overwrite");
        assert!(is_done && said.contains("the files of the archive are in saved-files"), "{said}");
    }
    assert!(with_cache("render a.exr -o again.exr").0);
    equal(path, "a.exr", "again.exr");
    // Files of the same names that are others are left alone.
    std::fs::create_dir_all(path.join("other-files")).unwrap();
    std::fs::write(path.join("other-files/m.obj"), "mine").unwrap();
    assert!(with_cache("save s.zip -o other.ron").1.contains("are in other-files-2"));
    std::fs::remove_dir_all(&cache).unwrap();
    let (is_done, said) = with_cache("render a.exr -o again.exr");
    assert!(!is_done && said.contains("open the archive again"), "{said}");
    let pixels = |name: &str| image::open(path.join(name)).unwrap().into_rgb32f().into_raw();
    for name in ["saved", "other"] {
        does(path, &format!("render {name}.ron -o {name}.exr {SMALL}"));
        assert!(pixels("a.exr") == pixels(&format!("{name}.exr")), "{name}");
    }
    assert_eq!(std::fs::read(path.join("other-files/m.obj")).unwrap(), b"mine");
    assert!(!path.join("saved-files-2").exists());
}

/// An image of a model at a moment has all of them, and one variant.
#[test]
fn an_image_of_a_model_shows_its_other_moments() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    std::fs::write(path.join("m.gltf"), moving_model(FLIGHT)).unwrap();
    does(path, &format!("render m.gltf {SMALL} --at 0.5 -o a.png"));
    let said = fails(path, &format!("render a.png {SMALL} --variant red -o b.png"), 1);
    assert!(said.contains("open m.gltf for") && said.contains("variants"), "{said}");
    // There and back; the camera is that of the image.
    does(path, &format!("render a.png {SMALL} --at 1 -o b.png"));
    does(path, &format!("render b.png {SMALL} --at 0.5 -o c.png"));
    let pixels = |name: &str| image::open(path.join(name)).unwrap().into_rgb8().into_raw();
    assert!(pixels("a.png") == pixels("c.png") && pixels("a.png") != pixels("b.png"));
}
