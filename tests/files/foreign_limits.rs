//! Scenes of other renderers that were written to do harm: what they name outside of their folder is not read, and what
//! would take for ever, or all memory, is refused or cut short.

use bevy_ecs::prelude::World;
use firstlight::scene::file::ObjectPart;
use firstlight::scene::{LoadOptions, LoadedScene, MeshSource, SceneSource, load, whole_scene};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tempfile::TempDir;

/// A folder with these files in `in/`, and the path of the first.
fn folder(files: &[(&str, String)]) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let inner = folder.path().join("in");
    std::fs::create_dir(&inner).unwrap();
    files.iter().for_each(|(name, text)| std::fs::write(inner.join(name), text).unwrap());
    (folder, inner.join(files[0].0))
}

fn open(path: &Path) -> Result<LoadedScene, String> {
    load(&SceneSource::Foreign(path.to_owned()), &LoadOptions::default()).map_err(|error| error.to_string())
}

fn mitsuba(body: &str) -> Result<LoadedScene, String> {
    let scene =
        format!("<scene version=\"3.0.0\"><sensor type=\"perspective\"/><emitter type=\"constant\"/>\n{body}</scene>");
    open(&folder(&[("a.xml", scene)]).1)
}

fn pbrt(body: &str) -> Result<LoadedScene, String> {
    let scene = format!("Camera \"perspective\"\nWorldBegin\nLightSource \"infinite\"\n{body}");
    open(&folder(&[("a.pbrt", scene)]).1)
}

fn told(scene: &LoadedScene) -> String {
    scene.warnings.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

#[test]
fn images_outside_of_the_folder_are_not_read() {
    let image = |name: &str| {
        format!(
            "<shape type=\"sphere\"><bsdf type=\"diffuse\"><texture type=\"bitmap\" name=\"reflectance\">\
             <string name=\"filename\" value=\"{name}\"/></texture></bsdf></shape>\n"
        )
    };
    let (folder, path) = folder(&[("a.xml", String::new())]);
    let secret = folder.path().join("secret.png");
    image::RgbImage::from_pixel(1, 1, image::Rgb([255, 0, 0])).save(&secret).unwrap();
    image::RgbImage::new(1, 1).save(path.with_file_name("own.png")).unwrap();
    let names = ["../secret.png", secret.to_str().unwrap(), "x/../../secret.png", "..\\secret.png", "own.png"];
    let body: String = names.into_iter().map(image).collect();
    std::fs::write(&path, format!("<scene version=\"3.0.0\">{body}</scene>")).unwrap();
    let scene = open(&path).unwrap();
    let read: Vec<_> = scene.read_files().into_iter().map(|read| read.name).collect();
    assert!(read.iter().any(|name| name == "own.png") && !read.iter().any(|name| name.contains("secret")), "{read:?}");
    assert_eq!(scene.file.textures.names().count(), 1, "{read:?}");
    assert!(told(&scene).contains("a path out of the folder"), "{}", told(&scene));
}

#[test]
fn materials_that_double_themselves_are_read_at_once() {
    let doubled =
        |i: u32| format!("<bsdf type=\"twosided\" id=\"t{}\"><ref id=\"t{i}\"/><ref id=\"t{i}\"/></bsdf>", i + 1);
    let all: String = (0..30).map(doubled).collect();
    let scene =
        mitsuba(&format!("<bsdf type=\"diffuse\" id=\"t0\"/>{all}<shape type=\"sphere\"><ref id=\"t30\"/></shape>"));
    let scene = scene.unwrap();
    assert!(told(&scene).contains("more than 8 lobes"), "{}", told(&scene));
    assert!(scene.file.materials.names().count() < 100);
    let scene = pbrt(
        "MakeNamedMaterial \"m\" \"string type\" \"mix\" \"string materials\" [\"m\" \"m\"]\n\
         NamedMaterial \"m\"\nShape \"sphere\"\n",
    );
    let scene = scene.unwrap();
    assert!(told(&scene).contains("`m`: it has no two `materials` that can be mixed"), "{}", told(&scene));
    assert!(!told(&scene).contains("too many"), "{}", told(&scene));
}

#[test]
fn names_are_not_stored_in_full_with_everything_that_has_them() {
    let long = "a".repeat(100_000);
    let scene = mitsuba(&format!(
        "<shape type=\"shapegroup\" id=\"g\"><shape type=\"cube\" id=\"{long}\"/></shape>{}",
        "<shape type=\"instance\"><ref id=\"g\"/></shape>".repeat(3)
    ));
    let names: Vec<usize> = scene.unwrap().file.objects.iter().filter_map(ObjectPart::name).map(str::len).collect();
    assert!(names.len() == 3 && names.iter().all(|length| *length < 300), "{names:?}");
    // Cut alike where it is described and where it is used.
    let scene = pbrt(&format!(
        "MakeNamedMaterial \"{long}\" \"string type\" \"conductor\"\nNamedMaterial \"{long}\"\nShape \"sphere\"\n"
    ));
    assert!(!told(&scene.unwrap()).contains("there is no material"));
    let texture = "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\"";
    let scene = pbrt(&format!("{texture} \"{long}\"\nShape \"sphere\"\n")).unwrap();
    assert!(told(&scene).contains("too long for a path"), "{}", told(&scene));
}

#[test]
fn what_takes_the_square_of_its_length_is_refused() {
    let refused = |scene: Result<LoadedScene, String>, why: &str| {
        let said = scene.err().unwrap_or_else(|| panic!("it opens: {why}"));
        assert!(said.contains(why), "{said}");
    };
    let many = |n: usize, part: fn(usize) -> String| (0..n).map(part).collect::<String>();
    let spaces = many(100, |i| format!("<a xmlns:a{i}=\"b\">"));
    refused(mitsuba(&format!("{spaces}{}", "</a>".repeat(100))), "more than 64 namespaces");
    refused(mitsuba(&format!("<a {}/>", many(65, |i| format!("a{i}=\"\" ")))), "more than 64 attributes");
    refused(mitsuba(&many(17, |i| format!("<path value=\"f{i}\"/>"))), "name 16 folders");
    assert!(mitsuba(&"<path value=\"f\"/>".repeat(100)).is_ok());
    // A group is asked for all that is in it at each of its instances.
    let group = format!("<shape type=\"shapegroup\" id=\"g\">{}</shape>", "<ref id=\"x\"/>".repeat(4200));
    let instances = format!("<shape type=\"instance\">{}</shape>", "<ref id=\"g\"/>".repeat(4000));
    refused(mitsuba(&format!("<bsdf type=\"null\" id=\"x\"/>{group}{instances}")), "parts");
    let attribute = |i| format!("Attribute \"shape\" \"float a{i}\" 1\n");
    refused(pbrt(&(0..300).map(attribute).collect::<String>()), "more than 256 parameters");
    let numbers = "1 ".repeat(4000);
    refused(pbrt(&format!("Attribute \"shape\" \"point3 P\" [{numbers}]")), "bytes of them");
}

#[test]
fn surfaces_are_subdivided_as_far_as_there_is_room() {
    let surface = |levels: u32, indices: &str, points: &str| {
        let sphere = "Shape \"sphere\"\n";
        let surface = format!("Shape \"loopsubdiv\" \"integer levels\" {levels} \"integer indices\" [{indices}]");
        told(&pbrt(&format!("{sphere}{surface} \"point3 P\" [{points}]\n")).unwrap())
    };
    // Nothing would ever be so fine that it ends.
    assert!(surface(u32::MAX, "0 0 0", "0 0 0").contains("one vertex twice"));
    assert_eq!(surface(u32::MAX, "0 1 2", "0 0 0 1 0 0 0 1 0"), "");
    let side = 160;
    let corner = |x: u32, y: u32| x + y * (side + 1);
    let cells = (0..side * side).map(|i| (i % side, i / side));
    let indices = cells.map(|(x, y)| {
        let [a, b, c, d] = [corner(x, y), corner(x + 1, y), corner(x + 1, y + 1), corner(x, y + 1)];
        format!("{a} {b} {c} {a} {c} {d} ")
    });
    let points = (0..(side + 1) * (side + 1)).map(|i| format!("{} {} 0 ", i % (side + 1), i / (side + 1)));
    let told = surface(3, &indices.collect::<String>(), &points.collect::<String>());
    assert!(told.contains("too many triangles when subdivided"), "{told}");
}

#[test]
fn the_light_of_many_shapes_is_read_once() {
    // Half a minute if each shape evaluated the spectrum.
    let spectrum: String = (0..20_000).map(|i| format!("{} 1 ", 360.0 + 0.02 * f64::from(i))).collect();
    let shapes = "Shape \"sphere\"\n".repeat(20_000);
    let scene = pbrt(&format!("AreaLightSource \"diffuse\" \"spectrum L\" [{spectrum}]\n{shapes}")).unwrap();
    assert_eq!(scene.file.objects.len(), 20_000);
}

#[test]
fn a_scene_is_read_for_few_sets_of_parameters() {
    let scene = "<scene version=\"3.0.0\"><shape type=\"cube\"/></scene>".to_owned();
    let camera = "camera: (eye: (0, 0, 5), look_at: (0, 0, 0))";
    let opened = |n: usize| {
        let part = |i| {
            format!("mesh(source: part(file: \"a.xml\", shape: 0, defines: [(\"a\", \"{i}\")]), material: \"m\"), ")
        };
        let parts: String = (0..n).map(part).collect();
        let text = format!("({camera}, materials: {{ \"m\": mirror() }}, objects: [{parts}])");
        let (_folder, path) = folder(&[("s.ron", text), ("a.xml", scene.clone())]);
        load(&SceneSource::Scene(path), &LoadOptions::default()).map_err(|error| error.to_string())
    };
    assert_eq!(opened(16).unwrap().warnings.iter().count(), 0);
    let said = opened(40).map_or_else(|error| error, |scene| told(&scene));
    assert!(said.contains("more than 16 sets of parameters"), "{said}");
}

#[test]
fn a_scene_is_read_once_whatever_its_names_and_few_scenes_are_read() {
    let opened = |files: &[String]| {
        let part = |file: &String| format!("mesh(source: part(file: \"{file}\", shape: 0), material: \"m\"), ");
        let parts: String = files.iter().map(part).collect();
        let camera = "camera: (eye: (0, 0, 5), look_at: (0, 0, 0))";
        let text = format!("({camera}, materials: {{ \"m\": mirror() }}, objects: [{parts}])");
        let mut all = vec![("s.ron".to_owned(), text)];
        let square = "WorldBegin\nShape \"bilinearmesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0 1 1 0]\n";
        all.extend((0..40).map(|i| (format!("{i}.pbrt"), square.to_owned())));
        let all: Vec<(&str, String)> = all.iter().map(|(name, text)| (&**name, text.clone())).collect();
        let (_folder, path) = folder(&all);
        std::fs::create_dir(path.with_file_name("x")).unwrap();
        load(&SceneSource::Scene(path), &LoadOptions::default()).map_err(|error| error.to_string())
    };
    let names: Vec<String> = (0..40).map(|i| "x/../".repeat(i) + "0.pbrt").collect();
    assert_eq!(told(&opened(&names).unwrap()), "");
    let files: Vec<String> = (0..40).map(|i| format!("{i}.pbrt")).collect();
    let said = opened(&files).map_or_else(|error| error, |scene| told(&scene));
    assert!(said.contains("more than 32 scenes of other renderers"), "{said}");
}

/// A small archive that named one model in 800 ways took 4.8 GB.
#[test]
fn a_mesh_is_read_once_whatever_the_names_of_its_file() {
    let numbers: Vec<u8> =
        [0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|x| x.to_le_bytes()).collect();
    let gltf = r#"{"asset": {"version": "2.0"}, "buffers": [{"uri": "a.bin", "byteLength": 36}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}], "scenes": [{"nodes": [0]}], "scene": 0, "nodes": [{"mesh": 0}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "max": [1, 1, 0],
                       "min": [0, 0, 0]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}]}"#;
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
               element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    let stl = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n\
               endsolid a\n";
    let mut names: Vec<&str> = vec!["", "./", ".//./", "x/../", "../in/"];
    if cfg!(unix) {
        names.extend(["here/", "here/here/./"]);
    }
    let sources = ["obj(\"@a.obj\")", "ply(\"@a.ply\")", "stl(\"@a.stl\")", "gltf(file: \"@a.gltf\", mesh: 0)"];
    let part = |source: &str, name: &str| format!("mesh(source: {}, material: \"m\"), ", source.replace('@', name));
    let parts: String = sources.iter().flat_map(|source| names.iter().map(|name| part(source, name))).collect();
    let camera = "camera: (eye: (0, 0, 5), look_at: (0, 0, 0))";
    let (_folder, path) = folder(&[
        ("s.ron", format!("({camera}, materials: {{ \"m\": mirror() }}, objects: [{parts}])")),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".to_owned()),
        ("a.ply", ply.to_owned()),
        ("a.stl", stl.to_owned()),
        ("a.gltf", gltf.to_owned()),
    ]);
    std::fs::write(path.with_file_name("a.bin"), numbers).unwrap();
    std::fs::create_dir(path.with_file_name("x")).unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink(".", path.with_file_name("here")).unwrap();
    let scene = load(&SceneSource::Scene(path), &LoadOptions::default()).unwrap();
    assert_eq!(told(&scene), "");
    let mut world = World::new();
    scene.spawn(&mut world);
    let meshes = whole_scene(&mut world, &scene).meshes;
    assert_eq!(meshes.len(), sources.len() * names.len());
    for same in meshes.chunks(names.len()) {
        let [first, others @ ..] = same else { unreachable!() };
        let first = first.as_ref().unwrap();
        assert!(first.triangles.len() == 1 && others.iter().flatten().all(|mesh| Arc::ptr_eq(mesh, first)));
    }
}

#[test]
fn parameters_of_any_number_are_found_at_once() {
    // Minutes if each were compared with all others.
    let many: String = (0..200_000).map(|i| format!("<default name=\"a{i:06}\" value=\"\"/>\n")).collect();
    let uses = |n: usize| format!("<string name=\"x\" value=\"{}\"/>", "$a$a0".repeat(n / 2));
    let known = "<default name=\"a\" value=\"\"/><default name=\"a0\" value=\"\"/>";
    let sphere = "<shape type=\"sphere\"/>";
    mitsuba(&format!("{many}{known}{}{sphere}", uses(1_000_000))).unwrap();
    let refused = |body: &str| mitsuba(body).err().unwrap_or_default();
    assert!(refused(&format!("{known}{}", uses((1 << 20) + 2))).contains("may use parameters 1048576 times"));
    let named = |name: &str| format!("<default name=\"{name}\" value=\"\"/>{sphere}");
    assert!(mitsuba(&named(&"é".repeat(128))).is_ok());
    for name in [&*"é".repeat(129), "a\\$b"] {
        assert!(refused(&named(name)).contains("at most 256 bytes and no `$`"), "{name}");
    }
}

#[test]
fn sizes_at_the_ends_of_their_range_are_sizes() {
    let film = |x: i64, y: i64| {
        let value = |name: &str, value: i64| format!("<integer name=\"{name}\" value=\"{value}\"/>");
        let offsets = value("crop_offset_x", x) + &value("crop_offset_y", y);
        let size = value("crop_width", 10) + &value("crop_height", 10);
        mitsuba(&format!("<sensor type=\"perspective\"><film type=\"hdrfilm\">{offsets}{size}</film></sensor>"))
    };
    for (x, y) in [(i64::MAX, i64::MIN), (i64::MIN, i64::MAX), (1 << 62, 1 << 62)] {
        assert!(told(&film(x, y).unwrap()).contains("off the middle"), "{x} {y}");
    }
}

#[test]
fn spectra_are_files_of_the_scene() {
    let spectrum = "<bsdf type=\"diffuse\"><spectrum name=\"reflectance\" filename=\"a.spd\"/></bsdf>";
    let scene = format!("<scene version=\"3.0.0\"><shape type=\"sphere\">{spectrum}</shape></scene>");
    let (_folder, path) = folder(&[("a.xml", scene), ("a.spd", "400 0.5\n700 0.5\n".to_owned())]);
    let scene = open(&path).unwrap();
    let names: Vec<_> = scene
        .read_files()
        .iter()
        .flat_map(|read| &read.files)
        .map(|file| file.file_name().unwrap().to_owned())
        .collect();
    assert_eq!(names, ["a.xml", "a.spd"]);
}

/// A saved scene names a mesh by its number, which is the same whether or not others may be read.
#[test]
fn a_mesh_of_mitsuba_has_its_number_whatever_must_not_be_read() {
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let number = |first: &str| {
        let shape = |file: &str| format!("<shape type=\"obj\"><string name=\"filename\" value=\"{file}\"/></shape>");
        let scene = format!(
            "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><emitter type=\"constant\"/>{}{}</scene>",
            shape(first),
            shape("a.obj")
        );
        let (folder, path) =
            folder(&[("a.xml", scene), ("a.obj", triangle.to_owned()), ("b.obj", triangle.to_owned())]);
        std::fs::write(folder.path().join("outside.obj"), triangle).unwrap();
        let of_mesh = |object: &ObjectPart| match object {
            ObjectPart::Mesh { source: MeshSource::Part { shape, .. }, .. } => Some(*shape),
            _ => None,
        };
        open(&path).unwrap().file.objects.iter().filter_map(of_mesh).next_back().expect("the triangle")
    };
    assert_eq!(["b.obj", "gone.obj", "../outside.obj"].map(number), [1; 3]);
}
