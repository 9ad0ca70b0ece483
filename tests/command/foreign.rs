//! Scenes from somebody else are packed: what they name, or lead to by a link, is not carried away without a word.

use super::pack::{hdr, names_in, unpack, write_scene};
use super::parts::{does, fails};
use crate::program::{Outcome, program};
use firstlight::scene::image_metadata::NOTE_KEY;
use firstlight::scene::{ImageMetadata, ImageScene};
use std::path::Path;
use std::process::Command;

const SCENE: &str =
    "(camera: (eye: (0, 0, 4), look_at: (0, 0, 0)), environment: constant(1), film: (width: 8, height: 6))";

/// Makes an image say that it shows another scene.
fn shows(path: &Path, scene: ImageScene, text: Option<&str>) {
    let shot = ImageMetadata { scene, text: text.map(str::to_owned), ..ImageMetadata::read(path).unwrap() };
    let mut encoder = png::Encoder::new(std::fs::File::create(path).unwrap(), 1, 1);
    encoder.add_itxt_chunk(NOTE_KEY.to_owned(), shot.to_note()).unwrap();
    encoder.write_header().unwrap().write_image_data(&[0]).unwrap();
}

#[test]
fn an_image_carries_away_nothing_that_is_no_scene() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    for name in ["home/.ssh", "home/down"] {
        std::fs::create_dir_all(path.join(name)).unwrap();
    }
    let key = path.join("home/.ssh/id_rsa");
    std::fs::write(&key, "PRIVATE").unwrap();
    std::fs::write(path.join("home/down/notes.txt"), "PRIVATE").unwrap();
    let picture = path.join("home/down/c.png");
    does(path, "render cornell -o home/down/c.png --size 8x6 --spp 1");
    for file in ["../.ssh/id_rsa", key.to_str().unwrap(), "notes.txt"] {
        let model = ImageScene::Model { path: file.to_owned(), up: None, camera: None };
        for scene in [ImageScene::Scene(file.to_owned()), model] {
            shows(&picture, scene, Some(SCENE));
            let said = fails(path, "pack home/down/c.png -o c.zip", 1);
            assert!(
                said.contains("names as its scene was not read as one") && said.contains("firstlight save"),
                "{said}"
            );
            let said = fails(path, "submit slurm home/down/c.png --parts 2 --spp 4 --dry-run -o job", 1);
            assert!(said.contains("names as its scene was not read as one"), "{said}");
            assert!(!path.join("c.zip").exists() && !path.join("job").exists());
            let said = does(path, "info home/down/c.png");
            assert!(said.lines().any(|line| line == "home/down/c.png"), "{said}");
            assert!(said.contains("is not its scene"), "{said}");
            // What the image itself holds can be packed.
            does(path, "save home/down/c.png -o saved.ron --overwrite");
            does(path, "pack saved.ron -o saved.zip");
            assert_eq!(names_in(&path.join("saved.zip")), ["SHA256SUMS", "saved.ron"]);
        }
    }
    // An image of it names the same file, and carries away as little.
    does(path, "render home/down/c.png -o again.png --spp 1");
    let again = ImageMetadata::read(&path.join("again.png")).unwrap();
    assert!(
        matches!(&again.scene, ImageScene::Model { path, .. } if path == "home/down/notes.txt"),
        "{:?}",
        again.scene
    );
    fails(path, "pack again.png -o c.zip", 1);
}

#[test]
fn an_image_has_its_scene_beside_it_in_a_package() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    write_scene(path);
    does(path, "render scenes/s.ron -o renders/shot.png --spp 2");
    let said = does(path, "pack renders/shot.png -o shot.zip");
    // The folder of the image is what is asked for: the scene and all of its files are told.
    for name in
        ["s.ron", "near.png", "outside/1/m.obj", "outside/1/m.mtl", "outside/1/maps/a b.png", "outside/2/far.png"]
    {
        assert!(said.contains(&format!("is packed as {name}\n")), "{name}: {said}");
    }
    let there = tempfile::tempdir().unwrap();
    assert!(unpack(&path.join("shot.zip"), there.path()).contains(&"shot.png".to_owned()));
    does(there.path(), "render shot.png -o again.png");
    let [here, again] = [path.join("renders/shot.png"), there.path().join("again.png")].map(image::open);
    assert!(here.unwrap().into_rgb8() == again.unwrap().into_rgb8());
    // So is a model, with its library and texture below it.
    does(path, "render models/m.obj -o renders/m.png --size 8x6 --spp 1");
    does(path, "pack renders/m.png -o m.zip");
    assert_eq!(names_in(&path.join("m.zip")), ["SHA256SUMS", "m.mtl", "m.obj", "m.png", "maps/a b.png"]);
    // Unless a file of it has the name of the image.
    std::fs::copy(path.join("models/maps/a b.png"), path.join("models/m.png")).unwrap();
    std::fs::write(path.join("models/m.mtl"), "newmtl a\nKd 1 1 1\nmap_Kd m.png\n").unwrap();
    let said = fails(path, "pack renders/m.png -o m.zip", 1);
    assert!(said.contains("would both be `m.png` in the package: rename one of them"), "{said}");
    // And a scene with changes that were not saved, as long as its files are found.
    let text = |texture: &str| {
        let of_camera = SCENE.trim_end_matches(')');
        format!("{of_camera}), textures: {{ \"t\": image(file: {texture:?}) }})")
    };
    let shot = path.join("renders/shot.png");
    let scene = ImageScene::Scene("../scenes/s.ron".to_owned());
    shows(&shot, scene.clone(), Some(&text("near.png")));
    does(path, "pack renders/shot.png -o shot.zip");
    let there = tempfile::tempdir().unwrap();
    unpack(&path.join("shot.zip"), there.path());
    does(there.path(), "render shot.png -o again.png --spp 1");
    shows(&shot, scene, Some(&text("../far/far.png")));
    let said = fails(path, "pack renders/shot.png -o shot.zip", 1);
    assert!(said.contains("would not find its files") && said.contains("firstlight save"), "{said}");
}

#[cfg(unix)]
#[test]
fn links_out_of_the_folder_are_outside() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    for name in ["private", "down/maps"] {
        std::fs::create_dir_all(path.join(name)).unwrap();
    }
    std::fs::write(path.join("private/light.hdr"), hdr()).unwrap();
    std::fs::write(path.join("down/maps/own.hdr"), hdr()).unwrap();
    std::fs::write(path.join("private/secret.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let links = [
        ("../private/light.hdr", "light.hdr"),
        ("../private", "up"),
        ("../private/secret.obj", "m.obj"),
        ("maps/own.hdr", "own.hdr"),
    ];
    for (target, link) in links {
        std::os::unix::fs::symlink(target, path.join("down").join(link)).unwrap();
    }
    let of_camera = SCENE.replace("constant(1)", "image(file: \"light.hdr\")");
    let scene = format!(
        "{}, textures: {{ \"own\": image(file: \"own.hdr\") }}, materials: {{ \"m\": diffuse(albedo: \"own\") }},\n\
         objects: [mesh(source: obj(\"m.obj\"), material: \"m\"), mesh(source: obj(\"up/secret.obj\"), material: \"m\")])",
        of_camera.trim_end_matches(')').to_owned() + ")"
    );
    std::fs::write(path.join("down/s.ron"), scene).unwrap();
    does(path, "render down/s.ron -o here.png --spp 1");
    let said = does(path, "pack down/s.ron -o s.zip");
    let real = path.canonicalize().unwrap();
    for (file, name) in [
        ("private/light.hdr", "outside/1/light.hdr"),
        ("private/secret.obj", "outside/1/m.obj"),
        ("private/secret.obj", "outside/2/secret.obj"),
    ] {
        let told = format!("{} is not in the folder of the scene, and is packed as {name}", real.join(file).display());
        assert!(said.contains(&told), "{told}: {said}");
    }
    assert_eq!(said.matches("is packed as").count(), 3, "{said}");
    let there = tempfile::tempdir().unwrap();
    unpack(&path.join("s.zip"), there.path());
    let expected = ["SHA256SUMS", "outside/1/light.hdr", "outside/1/m.obj", "outside/2/secret.obj", "own.hdr", "s.ron"];
    assert_eq!(names_in(&path.join("s.zip")), expected);
    does(there.path(), "render s.ron -o there.png --spp 1");
    let [here, there] = [path.join("here.png"), there.path().join("there.png")].map(image::open);
    assert!(here.unwrap().into_rgb8() == there.unwrap().into_rgb8());
    let said = does(path, "submit slurm down/s.ron --parts 2 --spp 4 --dry-run -o job");
    assert_eq!(said.matches("is packed as").count(), 3, "{said}");
    assert!(path.join("job/scene/outside/2/secret.obj").is_file() && !path.join("job/scene/up").exists());
}

#[cfg(unix)]
#[test]
fn a_name_that_is_none_everywhere_is_not_packed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let run = |args: &[&str]| {
        let outcome = Outcome::of(program(path).args(args));
        (outcome.status, outcome.err)
    };
    for name in ["a\nb.ron", "a\rb.ron", "a\\b.ron", "a:b.ron"] {
        std::fs::write(path.join(name), SCENE).unwrap();
        let (code, said) = run(&["pack", name, "-o", "s.zip"]);
        assert!(code == Some(1) && said.contains("cannot be in an archive: rename it"), "{name:?}: {code:?} {said}");
        assert!(!path.join("s.zip").exists());
        // The folder of a job takes it, with a list that `sha256sum` reads.
        let (code, said) = run(&["submit", "slurm", name, "--parts", "2", "--spp", "4", "--dry-run", "-o", "job"]);
        assert_eq!(code, Some(0), "{said}");
        #[cfg(target_os = "linux")]
        {
            let mut command = Command::new("sha256sum");
            let output =
                command.args(["--check", "--strict", "SHA256SUMS"]).current_dir(path.join("job/scene")).output();
            assert!(output.as_ref().unwrap().status.success(), "{name:?}: {output:?}");
        }
        std::fs::remove_dir_all(path.join("job")).unwrap();
    }
}

#[test]
fn the_values_of_parameters_stay_with_the_shapes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let mesh = |width: f64| {
        let header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                      element face 1\nproperty list uchar int vertex_indices\nend_header\n";
        format!("{header}-{width} -1 0\n{width} -1 0\n0 1 0\n3 0 1 2\n")
    };
    std::fs::write(path.join("wide.ply"), mesh(1.0)).unwrap();
    std::fs::write(path.join("narrow.ply"), mesh(0.2)).unwrap();
    let scene = "<scene version=\"3.0.0\"><default name=\"mesh\" value=\"wide.ply\"/><emitter type=\"constant\"/>\
                 <shape type=\"ply\"><string name=\"filename\" value=\"$mesh\"/></shape></scene>";
    std::fs::write(path.join("s.xml"), scene).unwrap();
    let how = "--size 8x6 --spp 2 --seed 1";
    does(path, &format!("render s.xml -D mesh=narrow.ply -o narrow.png {how}"));
    does(path, &format!("render s.xml -o wide.png {how}"));
    does(path, "save s.xml -D mesh=narrow.ply -o saved.ron");
    does(path, &format!("render saved.ron -o saved.png {how}"));
    let said = does(path, &format!("render narrow.png -o again.png {how}"));
    assert!(!said.contains("has changed"), "{said}");
    let pixels = |name: &str| image::open(path.join(name)).unwrap().into_rgb8();
    assert!(pixels("narrow.png") != pixels("wide.png"));
    assert!(pixels("narrow.png") == pixels("saved.png") && pixels("narrow.png") == pixels("again.png"));
    // An archive has the one mesh and its parameter; another value of it wins.
    let said = does(path, "pack s.xml -D mesh=narrow.ply -o narrow.zip");
    assert!(said.contains("open s.xml '--define=mesh=narrow.ply'"), "{said}");
    does(path, &format!("render narrow.zip -o packed.png {how}"));
    does(path, "pack narrow.zip -o twice.zip");
    does(path, &format!("render twice.zip -o twice.png {how}"));
    assert!(pixels("narrow.png") == pixels("packed.png") && pixels("narrow.png") == pixels("twice.png"));
    let other = Outcome::of(program(path).args(["info", "narrow.zip", "-D", "mesh=wide.ply"]));
    assert!(other.err.contains("wide.ply"), "{}", other.err);
    does(path, "submit slurm narrow.zip --parts 2 --spp 4 --dry-run -o job");
    assert!(std::fs::read_to_string(path.join("job/job.json")).unwrap().contains("--define=mesh=narrow.ply"));
}

#[test]
fn an_image_of_a_foreign_scene_without_meshes_has_its_scene() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let scene = "<scene version=\"3.0.0\"><emitter type=\"constant\"/><shape type=\"sphere\"/></scene>";
    std::fs::write(path.join("s.xml"), scene).unwrap();
    does(path, "render s.xml -o s.png --size 8x6 --spp 1");
    let said = does(path, "info s.png");
    assert!(!said.contains("is not its scene"), "{said}");
    does(path, "pack s.png -o s.zip");
}
