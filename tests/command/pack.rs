//! Scenes with all of their files in an archive: unpacked elsewhere, they render to the same bytes.

use super::parts::{does, equal, fails};
use crate::program::{Outcome, program};
use std::path::Path;

/// Names of the files of an archive, in order.
pub fn names_in(archive: &Path) -> Vec<String> {
    let archive = zip::ZipArchive::new(std::fs::File::open(archive).unwrap()).unwrap();
    let mut names: Vec<String> = archive.file_names().map(|name| name.unwrap().into_owned()).collect();
    names.sort();
    names
}

pub fn unpack(archive: &Path, folder: &Path) -> Vec<String> {
    let mut archive = zip::ZipArchive::new(std::fs::File::open(archive).unwrap()).unwrap();
    archive.extract(folder).unwrap();
    (0..archive.len()).map(|i| archive.by_index(i).unwrap().name().unwrap().into_owned()).collect()
}

/// A small environment image.
pub fn hdr() -> Vec<u8> {
    [b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n".to_vec(), [128, 120, 110, 129].repeat(8)].concat()
}

/// A model with a library and a texture below it, a texture beside the scene, and one that is named by its absolute path.
pub fn write_scene(path: &Path) {
    for folder in ["scenes", "models/maps", "far"] {
        std::fs::create_dir_all(path.join(folder)).unwrap();
    }
    for (name, grey) in [("models/maps/a b.png", 90), ("scenes/near.png", 200), ("far/far.png", 40)] {
        let image = image::RgbImage::from_fn(4, 4, |x, y| image::Rgb([grey, (60 * x) as u8, (60 * y) as u8]));
        image.save(path.join(name)).unwrap();
    }
    std::fs::write(path.join("models/m.mtl"), "newmtl a\nKd 1 1 1\nmap_Kd maps/a b.png\n").unwrap();
    let model = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl a\nf 1/1 2/2 3/3\n";
    std::fs::write(path.join("models/m.obj"), model).unwrap();
    let far = path.join("far/far.png").canonicalize().unwrap();
    let text = format!(
        "(camera: (eye: (0, 0, 4), look_at: (0, 0, 0)), environment: constant(1), film: (width: 24, height: 16),\n\
         // A comment.\n\
         textures: {{ \"near\": image(file: \"near.png\"), \"far\": image(file: {far:?}) }},\n\
         materials: {{ \"near\": diffuse(albedo: \"near\"), \"far\": diffuse(albedo: \"far\") }},\n\
         objects: [mesh(source: obj(\"../models/m.obj\")), sphere(center: (-1, 0, 0), radius: 0.5, material: \"near\"),\n\
         sphere(center: (1, -1, 0), radius: 0.5, material: \"far\")])"
    );
    std::fs::write(path.join("scenes/s.ron"), text).unwrap();
}

#[test]
fn a_packed_scene_renders_to_the_same_bytes_elsewhere() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    write_scene(path);
    does(path, "render scenes/s.ron -o here.exr --spp 2");
    let said = does(path, "pack scenes/s.ron -o s.zip");
    assert!(said.contains("open s.ron") && said.contains("packed as outside/2/far.png"), "{said}");
    does(path, "pack scenes/s.ron -o again.zip");
    equal(path, "s.zip", "again.zip");
    let there = tempfile::tempdir().unwrap();
    let mut names = unpack(&path.join("s.zip"), there.path());
    names.sort();
    let expected = [
        "SHA256SUMS",
        "near.png",
        "outside/1/m.mtl",
        "outside/1/m.obj",
        "outside/1/maps/a b.png",
        "outside/2/far.png",
        "s.ron",
    ];
    assert_eq!(names, expected);
    let text = std::fs::read_to_string(there.path().join("s.ron")).unwrap();
    assert!(text.contains("\"outside/2/far.png\"") && text.contains("\"outside/1/m.obj\""), "{text}");
    // The files are nowhere else any more.
    for gone in ["scenes", "models", "far"] {
        std::fs::remove_dir_all(path.join(gone)).unwrap();
    }
    does(there.path(), "render s.ron -o there.exr --spp 2");
    let [here, there_image] = [path.join("here.exr"), there.path().join("there.exr")].map(image::open);
    assert!(here.unwrap().into_rgb32f() == there_image.unwrap().into_rgb32f());
    // Packed again, everything keeps its name.
    does(there.path(), "pack s.ron -o again.zip");
    let twice = tempfile::tempdir().unwrap();
    let mut again = unpack(&there.path().join("again.zip"), twice.path());
    again.sort();
    assert_eq!(again, expected);
    #[cfg(target_os = "linux")]
    {
        let mut command = std::process::Command::new("sha256sum");
        let output = command.args(["--check", "--strict", "SHA256SUMS"]).current_dir(there.path()).output().unwrap();
        assert!(output.status.success(), "{output:?}");
    }
}

#[test]
fn models_images_and_built_in_scenes_are_packed_as_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    write_scene(path);
    std::fs::write(path.join("far/light.hdr"), hdr()).unwrap();
    let model = "models/m.obj --env far/light.hdr";
    does(path, &format!("render {model} -o here.png --size 24x16 --spp 2"));
    let said = does(path, &format!("pack {model} -o m.zip"));
    assert!(said.contains("open m.obj --env outside/1/light.hdr"), "{said}");
    let there = tempfile::tempdir().unwrap();
    unpack(&path.join("m.zip"), there.path());
    does(there.path(), "render m.obj --env outside/1/light.hdr -o there.png --size 24x16 --spp 2");
    let [here, there_image] = [path.join("here.png"), there.path().join("there.png")].map(image::open);
    assert!(here.unwrap().into_rgb8() == there_image.unwrap().into_rgb8());
    // An image, for the scene that it shows.
    does(path, "render scenes/s.ron -o shot.png --spp 1");
    does(path, "pack shot.png -o shot.zip");
    let there = tempfile::tempdir().unwrap();
    unpack(&path.join("shot.zip"), there.path());
    does(there.path(), "render shot.png -o again.png");
    assert!(std::fs::read(path.join("shot.png")).unwrap() == std::fs::read(there.path().join("again.png")).unwrap());
    does(path, "pack cornell -o cornell.zip");
    let there = tempfile::tempdir().unwrap();
    assert_eq!(unpack(&path.join("cornell.zip"), there.path()).len(), 2);
    does(there.path(), "render cornell.ron -o c.png --size 8x8 --spp 1");
    // What no other machine would find is refused.
    let texture = path.join("models/maps/a b.png").canonicalize().unwrap();
    std::fs::write(path.join("models/m.mtl"), format!("newmtl a\nmap_Kd {}\n", texture.display())).unwrap();
    let said = fails(path, "pack models/m.obj --allow-outside -o wrong.zip", 1);
    assert!(said.contains("m.mtl") && said.contains("absolute path"), "{said}");
    assert!(!path.join("wrong.zip").exists());
    fails(path, "pack models/m.obj -o wrong.tar", 2);
}

/// An archive with other contents; `None` removes a file.
fn forged(original: &Path, forgery: &Path, name: &str, content: Option<&[u8]>) {
    use std::io::{Read, Write};
    let mut archive = zip::ZipArchive::new(std::fs::File::open(original).unwrap()).unwrap();
    let mut out = zip::ZipWriter::new(std::fs::File::create(forgery).unwrap());
    let options = zip::write::SimpleFileOptions::default();
    for i in 0..archive.len() {
        let mut file = archive.by_index(i).unwrap();
        let own = file.name().unwrap().into_owned();
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).unwrap();
        if own != name {
            out.start_file(own, options).unwrap();
            out.write_all(&bytes).unwrap();
        }
    }
    if let Some(content) = content {
        out.start_file(name, options).unwrap();
        out.write_all(content).unwrap();
    }
    out.finish().unwrap();
}

#[test]
fn an_archive_opens_directly_and_only_whole() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    write_scene(path);
    let cache = path.join("cache");
    let run = |line: &str| {
        let outcome = Outcome::of(program(path).args(line.split(' ')).env("XDG_CACHE_HOME", &cache));
        (outcome.status, outcome.err)
    };
    let pixels = |name: &str| image::open(path.join(name)).unwrap().to_rgb8();
    does(path, "render scenes/s.ron -o here.png --spp 2");
    does(path, "pack scenes/s.ron -o s.zip");
    for gone in ["scenes", "models", "far"] {
        std::fs::remove_dir_all(path.join(gone)).unwrap();
    }
    let (code, said) = run("render s.zip -o there.png --spp 2");
    assert_eq!(code, Some(0), "{said}");
    assert!(pixels("here.png") == pixels("there.png"));
    // It is unpacked once; its image opens as its scene; a copy that somebody has changed is left alone.
    let entries = || std::fs::read_dir(cache.join("firstlight/packed")).unwrap().map(|it| it.unwrap().path());
    let folders = || entries().filter(|path| path.is_dir());
    let first = folders().next().unwrap();
    let scene = first.join("s.ron");
    assert_eq!(run("render there.png -o again.png").0, Some(0));
    assert!(pixels("again.png") == pixels("there.png"));
    let edited = std::fs::read_to_string(&scene).unwrap() + "// Edited.\n";
    std::fs::write(&scene, &edited).unwrap();
    assert_eq!(run("render s.zip -o third.png --spp 2").0, Some(0));
    assert!(pixels("third.png") == pixels("here.png") && std::fs::read_to_string(&scene).unwrap() == edited);
    assert_eq!(run("render s.zip -o fourth.png --spp 2").0, Some(0));
    assert_eq!(folders().count(), 2);

    let original = path.join("s.zip");
    let forgeries: [(&str, Option<&[u8]>, &str); 10] = [
        ("s.ron", Some(b"()"), "damaged"),
        ("outside/2/far.png", None, "damaged"),
        ("SHA256SUMS", None, "no valid list"),
        ("more.txt", Some(b"!"), "not in SHA256SUMS"),
        ("../out.txt", Some(b"!"), "does not stay"),
        ("/tmp/out.txt", Some(b"!"), "does not stay"),
        ("./s.ron", Some(b"!"), "does not stay"),
        ("outside//1/m.obj", Some(b"!"), "does not stay"),
        ("s.ron/x", Some(b"!"), "takes the place of another file"),
        ("outside", Some(b"!"), "takes the place of another file"),
    ];
    for (name, content, wanted) in forgeries {
        forged(&original, &path.join("forged.zip"), name, content);
        let (code, said) = run("render forged.zip -o no.png --spp 1");
        assert!(code == Some(1) && said.contains(wanted), "{name}: {code:?} {said}");
    }
    assert!(!cache.join("firstlight/out.txt").exists() && !cache.join("firstlight/packed/out.txt").exists());
    std::fs::write(path.join("cut.zip"), &std::fs::read(&original).unwrap()[..200]).unwrap();
    let (code, said) = run("info cut.zip");
    assert!(code == Some(1) && said.contains("not a readable archive"), "{code:?} {said}");
    assert_eq!(folders().count(), 2, "nothing is left of what was refused");
    // The list of checksums names only what is in the archive: neither is a file of this computer opened, nor is its
    // absence found at every opening anew.
    let outer = path.join("outer.ron");
    std::fs::write(&outer, "()").unwrap();
    let mut sums = String::new();
    let mut archive = zip::ZipArchive::new(std::fs::File::open(&original).unwrap()).unwrap();
    std::io::Read::read_to_string(&mut archive.by_name("SHA256SUMS").unwrap(), &mut sums).unwrap();
    for name in [outer.to_str().unwrap(), "../../../outer.ron", "SHA256SUMS"] {
        let listed = format!("{sums}{}  {name}\n", "0".repeat(64));
        forged(&original, &path.join("forged.zip"), "SHA256SUMS", Some(listed.as_bytes()));
        let (code, said) = run("render forged.zip -o no.png --spp 1");
        assert!(code == Some(1) && said.contains("damaged or not in"), "{name}: {code:?} {said}");
    }
    let twice = format!("{}  s.ron\n{sums}", "0".repeat(64));
    forged(&original, &path.join("forged.zip"), "SHA256SUMS", Some(twice.as_bytes()));
    let (code, said) = run("render forged.zip -o no.png --spp 1");
    assert!(code == Some(1) && said.contains("no valid list"), "{code:?} {said}");
    // What an interrupted process has left is removed.
    let left = cache.join("firstlight/packed/.part-abcdef");
    std::fs::create_dir(&left).unwrap();
    does(path, "pack cornell -o other.zip");
    assert_eq!(run("info other.zip").0, Some(0));
    assert!(!left.exists());
}

/// Copies beside the scene, wherever that is to be and whatever the files are called: the cache may be deleted.
#[test]
fn a_scene_that_is_saved_from_an_archive_needs_the_cache_no_more() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    image::RgbImage::new(2, 2).save_with_format(path.join("t.ron"), image::ImageFormat::Png).unwrap();
    let text = "(camera: (eye: (0, 0, 3), look_at: (0, 0, 0)), textures: {\"t\": image(file: \"t.ron\")}, \
                materials: {\"m\": diffuse(albedo: \"t\")}, objects: [sphere(radius: 1, material: \"m\")])";
    std::fs::write(path.join("s.ron"), text).unwrap();
    does(path, "pack s.ron -o s.zip");
    let cache = path.join("cache");
    let variables = [("XDG_CACHE_HOME", cache.to_str().unwrap())];
    for name in ["new/x.ron", "far/z/../x.ron"] {
        let output = super::parts::run_in(path, &format!("save s.zip -o {name}"), &variables);
        assert!(output.status.success(), "{name}: {output:?}");
    }
    std::fs::remove_dir_all(cache).unwrap();
    for name in ["new", "far"] {
        let text = std::fs::read_to_string(path.join(name).join("x.ron")).unwrap();
        assert!(text.contains("\"x-files/t.ron\""), "{text}");
        let image = std::fs::read(path.join(name).join("x-files/t.ron")).unwrap();
        assert!(image == std::fs::read(path.join("t.ron")).unwrap());
    }
}

#[test]
fn the_environment_image_of_an_archive_counts() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    write_scene(path);
    std::fs::write(path.join("far/light.hdr"), hdr()).unwrap();
    let model = "models/m.obj --env far/light.hdr";
    does(path, &format!("render {model} -o here.png --size 24x16 --spp 2"));
    does(path, &format!("pack {model} -o m.zip"));
    crate::program::does(path, "render m.zip -o there.png --size 24x16 --spp 2");
    let [here, there] = ["here.png", "there.png"].map(|name| image::open(path.join(name)).unwrap().to_rgb8());
    assert!(here == there);
}

#[test]
fn files_that_a_foreign_model_names_are_neither_read_nor_packed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    for name in ["home/.ssh", "home/down"] {
        std::fs::create_dir_all(path.join(name)).unwrap();
    }
    std::fs::write(path.join("home/.ssh/id_rsa"), "newmtl a\nPRIVATE\n").unwrap();
    std::fs::write(path.join("home/notes.txt"), "private").unwrap();
    std::fs::write(path.join("home/down/notes.txt"), "private").unwrap();
    let mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\n";
    let texture = "newmtl a\nKd 1 1 1\nmap_Kd notes.txt\nnewmtl b\nmap_Kd ../notes.txt\n";
    std::fs::write(path.join("home/down/m.mtl"), texture).unwrap();
    let absolute = path.join("home/.ssh/id_rsa").canonicalize().unwrap();
    for library in ["../.ssh/id_rsa", absolute.to_str().unwrap(), "..\\.ssh\\id_rsa", "notes.txt", "m.mtl"] {
        std::fs::write(path.join("home/down/chair.obj"), format!("mtllib {library}\n{mesh}")).unwrap();
        let said = does(path, "pack home/down/chair.obj -o c.zip");
        let is_outside = library.contains("id_rsa");
        assert_eq!(said.contains("--allow-outside"), is_outside || library == "m.mtl", "{library}: {said}");
        let there = tempfile::tempdir().unwrap();
        let mut names = unpack(&path.join("c.zip"), there.path());
        names.retain(|name| name != "m.mtl");
        names.sort();
        assert_eq!(names, ["SHA256SUMS", "chair.obj"], "{library}");
        does(path, "submit slurm home/down/chair.obj --parts 2 --spp 4 --dry-run -o job");
        let private = ["id_rsa", "notes.txt"].map(|name| path.join("job/scene").join(name).exists());
        assert_eq!(private, [false, false], "{library}");
        std::fs::remove_dir_all(path.join("job")).unwrap();
    }
    // A user who means it, means it.
    std::fs::write(path.join("home/look.mtl"), "newmtl a\nKd 1 0 0\n").unwrap();
    std::fs::write(path.join("home/down/chair.obj"), format!("mtllib ../look.mtl\n{mesh}")).unwrap();
    let said = does(path, "pack home/down/chair.obj --allow-outside -o c.zip");
    assert!(said.contains("look.mtl is not in the folder of the scene, and is packed as look.mtl"), "{said}");
    assert_eq!(said.matches("is packed as").count(), 1, "{said}");
    let there = tempfile::tempdir().unwrap();
    let mut names = unpack(&path.join("c.zip"), there.path());
    names.sort();
    assert_eq!(names, ["SHA256SUMS", "down/chair.obj", "look.mtl"]);
}

/// An archive that a few bytes make large.
#[test]
fn archives_have_limits_for_all_files_together() {
    use std::io::Write;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let mut out = zip::ZipWriter::new(std::fs::File::create(path.join("bomb.zip")).unwrap());
    let options = zip::write::SimpleFileOptions::default();
    let zeros = vec![0; 1 << 20];
    let sums: String = (0..3).map(|i| format!("{}  {i}.bin\n", "0".repeat(64))).collect();
    for i in 0..3 {
        out.start_file(format!("{i}.bin"), options).unwrap();
        for _ in 0..100 {
            out.write_all(&zeros).unwrap();
        }
    }
    out.start_file("SHA256SUMS", options).unwrap();
    out.write_all(sums.as_bytes()).unwrap();
    out.finish().unwrap();
    let said = || crate::program::fails(path, "info bomb.zip", 1);
    assert!(said().contains("would take 314573") && said().contains("268435456 bytes"), "{}", said());
    // Two files of the directory that share their data: the second one points to the first.
    let mut bytes = std::fs::read(path.join("bomb.zip")).unwrap();
    let entries: Vec<usize> = (0..bytes.len() - 4).filter(|&i| bytes[i..].starts_with(b"PK\x01\x02")).collect();
    assert_eq!(entries.len(), 4);
    let first = bytes[entries[0] + 42..entries[0] + 46].to_vec();
    bytes[entries[1] + 42..entries[1] + 46].copy_from_slice(&first);
    std::fs::write(path.join("bomb.zip"), bytes).unwrap();
    assert!(said().contains("damaged"), "{}", said());
    // The second one lies inside of the first.
    let stored = options.compression_method(zip::CompressionMethod::Stored);
    let archive = |files: &[(&str, &[u8])]| {
        let mut out = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
        for (name, bytes) in files {
            out.start_file(*name, stored).unwrap();
            out.write_all(bytes).unwrap();
        }
        out.finish().unwrap().into_inner()
    };
    let inner = archive(&[("1.bin", b"inner")]);
    let mut bytes = archive(&[("0.bin", &inner), ("1.bin", b"inner"), ("SHA256SUMS", b"")]);
    let entries: Vec<usize> = (0..bytes.len() - 4).filter(|&i| bytes[i..].starts_with(b"PK\x01\x02")).collect();
    // Behind the header of the first: 30 bytes and its name. Among the entries is the one inside.
    let inside = 30 + "0.bin".len() as u32;
    bytes[entries[2] + 42..entries[2] + 46].copy_from_slice(&inside.to_le_bytes());
    std::fs::write(path.join("bomb.zip"), bytes).unwrap();
    assert!(said().contains("1.bin") && said().contains("damaged"), "{}", said());
}

/// Empty files in folders that nothing else needs: each is an entry of the file system.
#[test]
fn an_archive_has_few_folders() {
    use std::io::Write;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let refused = |names: &[String]| {
        let mut out = zip::ZipWriter::new(std::fs::File::create(path.join("many.zip")).unwrap());
        let options = zip::write::SimpleFileOptions::default();
        let empty = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";
        let mut sums = String::new();
        for name in names {
            out.start_file(name.as_str(), options).unwrap();
            sums += &format!("{empty}  {name}\n");
        }
        out.start_file("SHA256SUMS", options).unwrap();
        out.write_all(sums.as_bytes()).unwrap();
        out.finish().unwrap();
        let mut command = assert_cmd::Command::cargo_bin("firstlight").unwrap();
        let output = command.args(["info", "many.zip"]).current_dir(path).env("XDG_CACHE_HOME", path).output().unwrap();
        assert_eq!(output.status.code(), Some(1));
        let unpacked = path.join("firstlight/packed").exists();
        (String::from_utf8_lossy(&output.stderr).into_owned(), unpacked)
    };
    let deep = |i: usize, depth: usize| format!("{i:04}/{}s.ron", "a/".repeat(depth - 1));
    let (said, unpacked) = refused(&[deep(0, 65)]);
    assert!(said.contains("is in more than 64 folders") && !unpacked, "{said}");
    let (said, unpacked) = refused(&(0..400).map(|i| deep(i, 60)).collect::<Vec<_>>());
    assert!(said.contains("has 24000 folders, more than the 20000") && !unpacked, "{said}");
    // Folders of several files count once; what is opened here is no scene, which is another error.
    let shared: Vec<String> = (0..1000).map(|i| format!("{}{i}.ron", "a/".repeat(64))).collect();
    let (said, _) = refused(&shared);
    assert!(said.contains("does not say which scene to open"), "{said}");
}

/// With what it includes, and the meshes and images that are named there; as a scene of ours that refers to it, too.
#[test]
fn a_packed_scene_of_pbrt_takes_its_files_along() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    std::fs::create_dir_all(path.join("p/parts")).unwrap();
    let write = |name: &str, text: &str| std::fs::write(path.join(name), text).unwrap();
    write(
        "p/a.pbrt",
        "Film \"rgb\" \"integer xresolution\" 24 \"integer yresolution\" 16\n\
        LookAt 0 0 4  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" 40\nWorldBegin\nInclude \"parts/b.pbrt\"\n",
    );
    write(
        "p/parts/b.pbrt",
        "LightSource \"infinite\"\n\
        Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"parts/t.png\"\n\
        Material \"diffuse\" \"texture reflectance\" \"t\"\nShape \"plymesh\" \"string filename\" \"parts/m.ply\"\n\
        Shape \"disk\"\nShape \"plymesh\" \"string filename\" \"parts/none.ply\"\n",
    );
    write(
        "p/parts/m.ply",
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
    );
    image::RgbImage::from_pixel(2, 2, image::Rgb([200, 100, 50])).save(path.join("p/parts/t.png")).unwrap();
    does(path, "save p/a.pbrt -o p/own.ron");
    for (scene, more) in [("a.pbrt", None), ("own.ron", Some("own.ron"))] {
        does(path, &format!("render p/{scene} -o here.exr --spp 2 --overwrite"));
        does(path, &format!("pack p/{scene} -o s.zip"));
        let there = tempfile::tempdir().unwrap();
        let mut names = unpack(&path.join("s.zip"), there.path());
        names.sort();
        let all = ["SHA256SUMS", "a.pbrt"].into_iter().chain(more);
        let expected: Vec<&str> = all.chain(["parts/b.pbrt", "parts/m.ply", "parts/t.png"]).collect();
        assert_eq!(names, expected);
        does(there.path(), &format!("render {scene} -o there.exr --spp 2"));
        let [here, there_image] = [path.join("here.exr"), there.path().join("there.exr")].map(image::open);
        assert!(here.unwrap().into_rgb32f() == there_image.unwrap().into_rgb32f());
    }
    // An image names the scene that it shows.
    does(path, "render p/a.pbrt -o p/seen.png --spp 1");
    let said = does(path, "info p/seen.png");
    assert!(said.contains("2 × mesh") || said.contains("3 × mesh"), "{said}");
}
