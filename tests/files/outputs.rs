//! No command destroys what it reads, another of its outputs, or a film; and what is refused has not been touched.

use crate::program::{Outcome, does, fails, program, run};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Every file and its bytes.
fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.filter(|path| path.is_file()).map(|path| (path.clone(), std::fs::read(path).unwrap())).collect()
}

/// Runs a command that must be refused, with everything as it was; gives back what it says.
#[track_caller]
fn refused(folder: &Path, line: &str, status: i32) -> String {
    let before = contents(folder);
    let said = fails(folder, line, status);
    assert_eq!(said.lines().count(), 1, "{line}: {said}");
    let after = contents(folder);
    let names = |files: &BTreeMap<PathBuf, Vec<u8>>| files.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(&before), names(&after), "{line}");
    assert!(before == after, "{line}: a file has changed");
    said
}

const ROOM: &str = r#"(
    camera: (eye: (0.3, 1, 4), look_at: (0, 0.7, 0)),
    film: (width: 16, height: 12),
    textures: { "wall": image(file: "wall.png") },
    environment: constant(1),
    materials: { "red": diffuse(albedo: "wall") },
    objects: [mesh(source: obj("tent.obj"), material: "red")],
)"#;

/// A scene with a mesh, its library and a texture.
fn room() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("work");
    std::fs::create_dir(&path).unwrap();
    std::fs::write(path.join("room.ron"), ROOM).unwrap();
    let tent = "mtllib tent.mtl\nv 0 0 0\nv 1 0 0\nv 0 0 -1\nv 0 1 0\nusemtl a\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    std::fs::write(path.join("tent.obj"), tent).unwrap();
    std::fs::write(path.join("tent.mtl"), "newmtl a\nKd 0.5 0.5 0.5\n").unwrap();
    image::RgbImage::from_pixel(3, 2, image::Rgb([9, 200, 3])).save(path.join("wall.png")).unwrap();
    (folder, path)
}

#[test]
fn nothing_that_a_command_reads_is_written_over() {
    let (_folder, path) = room();
    std::fs::copy(path.join("wall.png"), path.join("wall-0002.png")).unwrap();
    std::fs::write(path.join("frames.ron"), ROOM.replace("wall.png", "wall-0002.png")).unwrap();
    does(&path, "render room.ron -o a.png --film a.exr --spp 2");
    does(&path, "render room.ron -o b.png --film b.exr --samples 2..3");
    does(&path, "pack room.ron -o room.zip");
    std::fs::create_dir(path.join("sub")).unwrap();
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("a.exr", path.join("link.exr")).unwrap();
        std::fs::hard_link(path.join("wall.png"), path.join("hard.png")).unwrap();
    }
    let mut lines = vec![
        // A film that is gone on with.
        "render a.exr --resume -o a.exr --spp 4",
        "render a.exr --resume -o sub/../a.exr --spp 4",
        "render room.ron --film a.exr --resume -o ./a.exr",
        "render a.exr --resume --error-image ./a.exr -o x.png --spp 4",
        // A picture, and what the scene is made of.
        "render a.png -o a.png",
        "render a.png -o x.png --film a.png",
        "render room.ron -o wall.png",
        "render room.ron -o x.exr --film y.exr --error-image x.exr",
        "render frames.ron -o wall.png --turntable 3",
        "render cornell --film ./c.exr -o c.exr",
        "render cornell -o c.exr --error-image sub/../c.exr",
        // Films that are added up.
        "merge a.exr b.exr -o a.exr",
        "merge a.exr b.exr -o c.exr --image c.exr",
        "merge a.exr b.exr -o c.exr --image ./b.exr",
        "merge a.exr b.exr -o c.exr --image wall.png",
        "merge a.exr b.exr -o c.exr --overwrite --image a.exr",
        "save room.ron -o ./room.ron",
        "simplify tent.obj -o sub/../tent.obj --ratio 0.5",
        "pack room.zip -o sub/../room.zip",
    ];
    if cfg!(unix) {
        lines.extend([
            "render a.exr --resume -o link.exr --spp 4",
            "render link.exr --resume -o a.exr --spp 4",
            "render room.ron -o hard.png",
        ]);
    }
    for line in lines {
        let said = refused(&path, line, 2);
        let why = [
            "is also an input of this command",
            "two outputs have the same name",
            "the name of a film must end in .exr",
        ];
        assert!(why.iter().any(|why| said.contains(why)), "{line}: {said}");
        assert!(why[1..].iter().any(|why| said.contains(why)) || said.contains("choose another output name"));
    }
}

/// Also those that are named and not used.
#[test]
fn an_image_replaces_no_image_that_a_material_names() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let write = |name: &str, text: &str| std::fs::write(path.join(name), text).unwrap();
    write("a.obj", "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n");
    write(
        "a.mtl",
        "newmtl a\nKd 1 1 1\nmap_bump bump.png\nmap_Ks shine.png\nrefl sky.png\nmap_Ns -s 2 2 2 rough.png\n",
    );
    for input in ["bump.png", "shine.png", "sky.png", "rough.png"] {
        image::GrayImage::new(2, 2).save(path.join(input)).unwrap();
        let said = refused(path, &format!("render a.obj -o {input} --spp 1 --size 8x6"), 2);
        assert!(said.contains(input) && said.contains("is also an input of this command"), "{input}: {said}");
    }
    does(path, "render a.obj -o other.png --spp 1 --size 8x6");
}

/// A recording may come from anywhere: it does not say by itself what may be read.
#[test]
fn a_replay_reads_files_outside_if_it_is_allowed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    std::fs::create_dir(path.join("in")).unwrap();
    let write = |name: &str, text: &str| std::fs::write(path.join(name), text).unwrap();
    write("in/a.obj", "mtllib ../a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\nf 3 2 1\n");
    write("a.mtl", "newmtl a\nKd 1 0 0\n");
    let header = "(format:1,program:\"firstlight\",scene:File(\"in/a.obj\"),up:None,width:16,height:12,seed:0)";
    write("a.rec", &format!("{header}\nOpened(1,1,\"\")\nEnd(3,1)\n"));
    does(path, "--replay a.rec -o usual.png");
    does(path, "--replay a.rec --allow-outside -o outside.png");
    let pixels = |name: &str| image::open(path.join(name)).unwrap().to_rgb8();
    let is_red = |name: &str| pixels(name).pixels().any(|pixel| pixel.0[0] / 4 > pixel.0[1].max(8));
    assert_eq!([is_red("usual.png"), is_red("outside.png")], [false, true]);
}

/// Of several scenes, and of all that a recording opens and edits.
#[test]
fn an_image_replaces_no_input_of_another_scene_or_of_a_replay() {
    let (_folder, path) = room();
    does(&path, "render cornell -o photo.png --spp 1 --size 16x12");
    std::fs::create_dir(path.join("out")).unwrap();
    std::fs::copy(path.join("photo.png"), path.join("out/cornell.png")).unwrap();
    let lit =
        r#"(environment: image(file: "out/cornell.png"), objects: [], camera: (eye: (0, 0, 5), look_at: (0, 0, 0)))"#;
    std::fs::write(path.join("lit.ron"), lit).unwrap();
    let header = |scene: &str| {
        format!("(format:1,program:\"firstlight\",scene:File(\"{scene}\"),up:None,width:16,height:12,seed:0)")
    };
    let recordings = [
        ("image.rec", header("photo.png") + "\nOpened(1,1,\"\")\nEnd(3,1)\n"),
        (
            "light.rec",
            header("room.ron") + "\nOpened(1,1,\"\")\nDo(2,1.0,Edit(LightFrom(file:\"photo.png\")))\nEnd(9,1)\n",
        ),
        (
            "left.rec",
            header("room.ron") + "\nOpened(1,1,\"\")\nDo(2,1.0,Open(path:\"lit.ron\"))\nOpened(3,2,\"\")\nEnd(9,1)\n",
        ),
    ];
    for (name, text) in recordings {
        std::fs::write(path.join(name), text).unwrap();
    }
    let bytes = |name: &str| std::fs::read(path.join(name)).unwrap();
    for (line, input) in [
        ("render cornell lit.ron -o out --spp 1 --size 16x12", "out/cornell.png"),
        ("render lit.ron cornell -o out --spp 1 --size 16x12", "out/cornell.png"),
        ("--replay image.rec -o photo.png", "photo.png"),
        ("--replay light.rec -o photo.png", "photo.png"),
        ("--replay left.rec -o wall.png", "wall.png"),
    ] {
        let before = bytes(input);
        let said = refused(&path, line, 2);
        assert!(said.contains(input) && said.contains("is also an input of this command"), "{line}: {said}");
        assert!(bytes(input) == before, "{line}");
    }
    does(&path, "--replay left.rec -o other.png");
}

#[test]
fn a_film_is_replaced_by_nothing_that_lacks_its_samples() {
    let (_folder, path) = room();
    does(&path, "render room.ron -o a.png --film a.exr --spp 4");
    does(&path, "render room.ron -o a.png --film b.exr --samples 4..8");
    does(&path, "render room.ron -o a.png --film c.exr --samples 8..12");
    does(&path, "render cornell -o a.png --film other.exr --spp 1 --size 16x12");
    does(&path, "merge a.exr b.exr -o ab.exr");
    for line in [
        "render room.ron -o a.exr --spp 1",
        "render room.ron -o x.png --error-image a.exr --spp 2",
        "render room.ron -o x.png --film a.exr --spp 1",
        "render cornell --film x.exr -o a.exr --spp 1",
        "merge a.exr b.exr -o x.exr --image other.exr",
        "merge a.exr b.exr -o other.exr",
        // It has samples that the two have not.
        "merge a.exr b.exr -o c.exr",
        "merge b.exr c.exr -o ab.exr",
    ] {
        let said = refused(&path, line, 1);
        assert!(said.contains("film") || said.contains("already exists"), "{line}: {said}");
        assert!(said.contains("--overwrite") && said.contains("another name"), "{line}: {said}");
    }
    // One that is whole is made again, and one that has fewer samples is replaced.
    let before = std::fs::read(path.join("ab.exr")).unwrap();
    does(&path, "merge b.exr a.exr -o ab.exr");
    assert!(std::fs::read(path.join("ab.exr")).unwrap() == before);
    does(&path, "merge ab.exr c.exr -o abc.exr");
    std::fs::copy(path.join("ab.exr"), path.join("grown.exr")).unwrap();
    does(&path, "merge ab.exr c.exr -o grown.exr");
    assert!(std::fs::read(path.join("grown.exr")).unwrap() == std::fs::read(path.join("abc.exr")).unwrap());
    // A film that is damaged may be of use to somebody; nobody knows what it had.
    let whole = std::fs::read(path.join("a.exr")).unwrap();
    std::fs::write(path.join("cut.exr"), &whole[..whole.len() - 9]).unwrap();
    refused(&path, "merge a.exr b.exr -o cut.exr", 1);
    refused(&path, "render room.ron -o cut.exr", 1);
    // Whoever means it is obeyed.
    does(&path, "merge a.exr b.exr -o cut.exr --overwrite");
    does(&path, "render room.ron -o a.exr --spp 1 --overwrite");
    does(&path, "render room.ron -o a.png --film b.exr --spp 1 --overwrite");
}

#[test]
fn a_render_says_what_it_replaces() {
    let (_folder, path) = room();
    let line = "render room.ron -o a.png --spp 2";
    assert!(!does(&path, line).err.contains("replaced"));
    assert!(does(&path, line).err.contains("replaced the existing a.png"));
    let json = run(&path, &format!("{line} --error-image e.exr --json")).json();
    assert_eq!(json["replaced"], serde_json::json!(["a.png"]));
    let said = does(&path, &format!("{line} --error-image e.exr")).err;
    assert!(said.contains("replaced the existing a.png, e.exr"), "{said}");
    std::fs::write(path.join("turn-0002.png"), "old").unwrap();
    let said = does(&path, "render room.ron -o turn.png --spp 1 --turntable 3").err;
    assert!(said.contains("3 frames, replacing 1 existing file"), "{said}");
}

#[cfg(unix)]
#[test]
fn links_are_kept_and_read_only_files_and_devices_are_refused() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let (_folder, path) = room();
    std::fs::create_dir(path.join("far")).unwrap();
    symlink("far/a.png", path.join("a.png")).unwrap();
    symlink("/dev/null", path.join("null.png")).unwrap();
    for _ in 0..2 {
        does(&path, "render room.ron -o a.png --spp 1");
        assert_eq!(std::fs::read_link(path.join("a.png")).unwrap(), Path::new("far/a.png"));
        assert_eq!(image::image_dimensions(path.join("far/a.png")).unwrap(), (16, 12));
    }
    // It opens through the link: its note counts from where it lies.
    does(&path, "render a.png -o again.png");
    assert!(refused(&path, "render room.ron -o null.png", 1).contains("null.png: is not a regular file"));
    std::fs::set_permissions(path.join("far/a.png"), PermissionsExt::from_mode(0o444)).unwrap();
    assert!(refused(&path, "render room.ron -o a.png", 1).contains("a.png: is read-only"));
}

/// Two processes that go on with one film would each lose what the other one adds.
#[cfg(unix)]
#[test]
fn a_film_has_one_process_at_a_time() {
    use std::process::{Command, Stdio};
    use std::time::{Duration, Instant};
    let (_folder, path) = room();
    let program = assert_cmd::cargo::cargo_bin("firstlight");
    for line in ["render room.ron -o a.png --film a.exr --time 600", "render a.exr -o a.png --resume --time 600"] {
        let mut first =
            Command::new(&program).current_dir(&path).args(line.split(' ')).stderr(Stdio::null()).spawn().unwrap();
        let claimed = || {
            let entries = std::fs::read_dir(&path).unwrap().flatten();
            entries.into_iter().any(|entry| entry.path().extension().is_some_and(|e| e == "part"))
        };
        let start = Instant::now();
        while !claimed() {
            assert!(start.elapsed() < Duration::from_secs(60), "it never began");
            std::thread::sleep(Duration::from_millis(5));
        }
        // Also by another name, and as an output of another kind.
        for other in ["--film ./a.exr -o b.png", "--film a.exr --resume -o b.png", "-o a.exr"] {
            let said = fails(&path, &format!("render room.ron --spp 1 {other}"), 1);
            let expected = said.contains("is being written by another process") || said.contains("is a film");
            assert!(expected || said.contains("already exists"), "{said}");
        }
        let kill = Command::new("kill").args(["-INT", &first.id().to_string()]).status().unwrap();
        assert!(kill.success());
        first.wait().unwrap();
        // Where it was stopped too early there is no film yet.
        if !path.join("a.exr").exists() {
            does(&path, "render room.ron -o a.png --film a.exr --spp 1");
        }
        assert!(!claimed(), "nothing is left");
    }
    // What a killed process leaves is not in the way of the next, and goes.
    let mut killed = Command::new(&program)
        .current_dir(&path)
        .args("render a.exr -o a.png --resume --time 600".split(' '))
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let parts = || {
        let entries = std::fs::read_dir(&path).unwrap().flatten();
        entries.into_iter().filter(|entry| entry.path().extension().is_some_and(|e| e == "part")).count()
    };
    let start = Instant::now();
    while parts() == 0 {
        assert!(start.elapsed() < Duration::from_secs(60), "it never began");
        std::thread::sleep(Duration::from_millis(5));
    }
    killed.kill().unwrap();
    killed.wait().unwrap();
    assert!(parts() > 0);
    does(&path, "render a.exr -o a.png --resume --time 0.1");
    assert_eq!(parts(), 0);
}

/// What a full disk says is about the file that was asked for.
#[cfg(unix)]
#[test]
fn a_full_disk_is_told_of_the_output_and_not_of_a_temporary_file() {
    let (_folder, path) = room();
    let program = assert_cmd::cargo::cargo_bin("firstlight");
    for (line, name) in [
        ("render room.ron -o new.png --spp 1 --size 128x128", "new.png"),
        ("render room.ron -o new.exr --spp 1 --size 128x128", "new.exr"),
        ("save many.obj -o new.ron", "new.ron"),
        ("simplify many.obj -o less.obj --ratio 0.9", "less.obj"),
    ] {
        let vertices: String = (0..2000).map(|i| format!("v {} {} 0.5\n", i / 2, i % 2)).collect();
        let faces: String = (1..1999).map(|i| format!("f {i} {} {}\n", i + 1, i + 2)).collect();
        std::fs::write(path.join("many.obj"), vertices + &faces).unwrap();
        let script = format!("trap '' XFSZ; ulimit -f 1; exec '{}' {line}", program.display());
        let output = std::process::Command::new("sh").args(["-c", &script]).current_dir(&path).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.contains(&format!("error: {name}: cannot be written: ")), "{said}");
        assert!(!said.contains(".part"), "{said}");
    }
}

/// Names that are no UTF-8 are names as any other, in files that the program writes too.
#[cfg(target_os = "linux")]
#[test]
fn names_of_any_bytes_are_read_and_written() {
    use std::ffi::{OsStr, OsString};
    use std::os::unix::ffi::{OsStrExt, OsStringExt};
    let (folder, plain) = room();
    let path = folder.path().join(OsStr::from_bytes(b"w\xfe"));
    std::fs::rename(plain, &path).unwrap();
    // `?` stands for a byte that is no letter.
    let odd = |text: &str| {
        let bytes = text.bytes().map(|byte| if byte == b'?' { 0xff } else { byte });
        OsString::from_vec(bytes.collect())
    };
    let run = |line: &str, status: i32| {
        let Outcome { status: found, err: said, .. } = Outcome::of(program(&path).args(line.split(' ').map(odd)));
        assert_eq!(found, Some(status), "{line}: {said}");
        assert!(!said.contains("warning"), "{line}: {said}");
        said
    };
    let library = [b"mtllib t\xff.mtl\n".as_slice(), &std::fs::read(path.join("tent.obj")).unwrap()[16..]].concat();
    std::fs::write(path.join(odd("t?.obj")), library).unwrap();
    std::fs::rename(path.join("tent.mtl"), path.join(odd("t?.mtl"))).unwrap();
    std::fs::rename(path.join("room.ron"), path.join(odd("r?.ron"))).unwrap();
    for line in [
        "render r?.ron -o a?.png --film a?.exr --spp 2",
        "render r?.ron -o b?.png --film b?.exr --samples 2..4 --error-image e?.exr",
        "render a?.exr --resume -o a?.png --film a?.exr --spp 2",
        "render t?.obj -o m?.png --spp 1 --size 16x12",
        "render m?.png -o m2?.png",
        "merge a?.exr b?.exr -o ab?.exr --image ab?.png",
        "render ab?.exr -o c?.exr --spp 3",
        "save t?.obj -o s?.ron",
        "render s?.ron -o s?.png --spp 1 --size 16x12",
        "simplify t?.obj -o u?.obj --ratio 1",
        "info u?.obj",
        "info m?.png",
        "explain s?.ron --pixel 3,3 --spp 1",
        "render r?.ron -o turn?.png --spp 1 --turntable 2",
        "report r?.ron --output rep? --spp 4 --no-ablation --size 8x6",
        "r?.ron --size 8x6",
    ] {
        run(line, 0);
    }
    for name in
        ["a?.png", "e?.exr", "m2?.png", "ab?.png", "u?.obj", "turn?-0002.png", "rep?/index.html", "firstlight-r?.png"]
    {
        assert!(path.join(odd(name)).is_file(), "{name}");
    }
    assert!(std::fs::read(path.join(odd("m?.png"))).unwrap() == std::fs::read(path.join(odd("m2?.png"))).unwrap());
    assert!(run("render r?.ron -o ./a?.exr --film a?.exr --resume", 2).contains("is also an input of this command"));
    // From another folder, through the notes.
    std::fs::create_dir(path.join(odd("sub?"))).unwrap();
    run("render a?.png -o sub?/a.png", 0);
    run("render sub?/a.png -o again.png", 0);
    assert!(std::fs::read(path.join(odd("a?.png"))).unwrap() == std::fs::read(path.join("again.png")).unwrap());
    // What is not there is said, without a panic.
    assert!(run("render none?.ron -o x.png", 1).contains("none\u{fffd}.ron: cannot be read: no such file"));
    assert!(run("render none? -o x.png", 2).contains("no such file or built-in scene"));
    // Nothing has been written under a name that only looks the same.
    let mut names = std::fs::read_dir(&path).unwrap().map(|entry| entry.unwrap().file_name());
    assert!(names.all(|name| !name.to_string_lossy().contains('\u{fffd}') || name.to_str().is_none()));
}

#[test]
fn an_error_that_is_meant_in_per_cent_is_not_taken_for_a_share() {
    let (_folder, path) = room();
    let said = run(&path, "render room.ron -o a.png --error 5").err;
    assert!(said.contains("5 means 500 %: write 5% for 5 percent"), "{said}");
    assert!(!path.join("a.png").exists());
    does(&path, "render room.ron -o a.png --error 5%");
}
