//! Disks that fill up, files that change, processes that are killed, memory that is not there.

use crate::program::{Outcome, fails, program};
use firstlight::frame::{Target, render_offline};
use firstlight::render::Film;
use firstlight::scene::obj::load_obj;
use firstlight::scene::{Extraction, LoadOptions, Rendering, SceneInputs, SceneSource, load};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const PROGRAM: &str = env!("CARGO_BIN_EXE_firstlight");

/// A picture that is there already, and its bytes.
fn old_picture(folder: &Path) -> Vec<u8> {
    let path = folder.join("out.png");
    image::RgbImage::from_pixel(3, 2, image::Rgb([1, 2, 3])).save(&path).unwrap();
    std::fs::read(path).unwrap()
}

/// The shell lets no file grow beyond 4 KiB, as a full disk would.
#[cfg(unix)]
#[test]
fn a_full_disk_leaves_the_old_picture_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let before = old_picture(folder.path());
    for name in ["out.png", "new.exr"] {
        let script =
            format!("trap '' XFSZ; ulimit -f 4; exec '{PROGRAM}' render cornell -o {name} --size 128x128 --spp 1");
        let output = Command::new("sh").args(["-c", &script]).current_dir(folder.path()).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.contains("error:") && said.contains(name) && said.contains("cannot be written"), "{said}");
    }
    assert_eq!(std::fs::read(folder.path().join("out.png")).unwrap(), before);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "something was left behind");
}

/// Of folders as well: the first of two files can be written, the second one cannot.
#[cfg(unix)]
#[test]
fn a_full_disk_leaves_no_half_of_a_folder() {
    let folder = tempfile::tempdir().unwrap();
    let noise = |x: u32, y: u32| image::Rgb([x * 89 + y * 57, x * 13 + y * 31, x * y].map(|n| (n % 251) as u8));
    image::RgbImage::from_fn(2, 2, noise).save(folder.path().join("a.png")).unwrap();
    image::RgbImage::from_fn(64, 64, noise).save(folder.path().join("b.png")).unwrap();
    let text = "(camera: (eye: (0, 0, 3), look_at: (0, 0, 0)), \
        textures: {\"a\": image(file: \"a.png\"), \"b\": image(file: \"b.png\")}, \
        materials: {\"a\": diffuse(albedo: \"a\"), \"b\": diffuse(albedo: \"b\")}, \
        objects: [sphere(radius: 1, material: \"a\"), sphere(radius: 2, material: \"b\")])";
    std::fs::write(folder.path().join("s.ron"), text).unwrap();
    std::fs::create_dir(folder.path().join("there")).unwrap();
    let run = |line: &str, is_full: bool| {
        let limit = if is_full { "trap '' XFSZ; ulimit -f 4;" } else { "" };
        let script = format!("{limit} exec '{PROGRAM}' {line}");
        let mut command = Command::new("sh");
        command.args(["-c", &script]).current_dir(folder.path()).env("XDG_CACHE_HOME", folder.path().join("cache"));
        command.output().unwrap()
    };
    assert!(run("pack s.ron -o s.zip", false).status.success());
    // Unpacks it.
    assert!(run("info s.zip", false).status.success());
    let names = || {
        let names =
            |folder: &Path| std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        let [mut here, there]: [Vec<_>; 2] = [names(folder.path()), names(&folder.path().join("there"))];
        here.sort();
        (here, there)
    };
    let before = names();
    for (line, name) in [
        ("pack s.ron -o t.zip", "t.zip"),
        ("save s.zip -o x.ron", "x-files/b.png"),
        ("submit slurm s.ron --parts 2 --spp 4 --dry-run -o job", "job/scene/b.png"),
        ("submit slurm s.ron --parts 2 --spp 4 --dry-run -o there", "there/scene/b.png"),
    ] {
        let output = run(line, true);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{line}: {said}");
        assert!(said.starts_with(&format!("error: {name}: cannot be written")), "{line}: {said}");
        assert_eq!(said.lines().count(), 1, "{line}: {said}");
        assert_eq!(names(), before, "{line}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn help_that_cannot_be_written_is_a_failure() {
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let output = Command::new(PROGRAM).arg("--help").stdout(full).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("cannot write the help text"), "{said}");
}

#[cfg(target_os = "linux")]
#[test]
fn a_result_that_finds_a_full_disk_says_so() {
    for line in [
        "info cornell",
        "render cornell -o - --spp 1 --size 8x8",
        "render cornell -o - --format jpg --spp 1 --size 8x8",
    ] {
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let output = Command::new(PROGRAM).args(line.split(' ')).stdout(full).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{line}: {said}");
        assert!(said.contains("cannot write to standard output: the disk is full"), "{line}: {said}");
    }
}

#[test]
fn limits_that_are_no_number_are_told() {
    for (text, is_wrong) in [("2", false), (" 0.5 ", false), ("0", true), ("-1", true), ("two", true), ("NaN", true)] {
        let mut command = program(&std::env::temp_dir());
        let outcome = Outcome::of(command.args(["info", "cornell"]).env("FIRSTLIGHT_LIMITS", text));
        let said = &outcome.err;
        assert_eq!(outcome.status, Some(0), "{text}: {said}");
        assert_eq!(said.contains("FIRSTLIGHT_LIMITS"), is_wrong, "{text}: {said}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_folder_that_takes_no_files_is_named_before_anything_is_rendered() {
    let said = fails(&std::env::temp_dir(), "render cornell -o /proc/out.png", 1);
    assert!(said.contains("/proc/out.png: cannot be written"), "{said}");
}

/// Killed as soon as there is anything in the temporary file, and at a few moments after that.
#[cfg(unix)]
#[test]
fn killed_while_saving_the_old_picture_is_still_there() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.png");
    let before = old_picture(folder.path());
    let mut caught = 0;
    for delay in [0, 1, 3] {
        let mut child = Command::new(PROGRAM)
            .args(["render", "cornell", "-o", "out.png", "--size", "1500x1000", "--spp", "1", "--max-depth", "1"])
            .current_dir(folder.path())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let start = Instant::now();
        let is_saving = || {
            std::fs::read_dir(folder.path()).unwrap().flatten().any(|entry| {
                let is_part = entry.path().extension().is_some_and(|e| e == "part");
                is_part && entry.metadata().is_ok_and(|info| info.len() > 0)
            })
        };
        while !is_saving() && child.try_wait().unwrap().is_none() && start.elapsed() < Duration::from_secs(60) {
            std::thread::sleep(Duration::from_micros(200));
        }
        std::thread::sleep(Duration::from_millis(delay));
        child.kill().unwrap();
        caught += u32::from(!child.wait().unwrap().success());
        let now = std::fs::read(&path).unwrap();
        let whole = image::load_from_memory(&now).expect("a whole picture");
        assert!(now == before || (whole.width(), whole.height()) == (1500, 1000));
        std::fs::write(&path, &before).unwrap();
        for entry in std::fs::read_dir(folder.path()).unwrap().flatten().filter(|entry| entry.path() != path) {
            std::fs::remove_file(entry.path()).unwrap();
        }
    }
    assert!(caught > 0, "it was never killed while it saved");
}

#[test]
fn a_file_that_is_replaced_while_it_is_read_is_read_whole_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.obj");
    let model = |n: usize| {
        let vertices: String = (0..n).map(|i| format!("v {i} {} 0.5\n", i * i % 7)).collect();
        let faces: String = (1..n - 1).map(|i| format!("f {i} {} {}\n", i + 1, i + 2)).collect();
        vertices + &faces
    };
    let (small, large) = (model(40), model(4000));
    std::fs::write(&path, &small).unwrap();
    let done = std::sync::atomic::AtomicBool::new(false);
    let (mut good, mut refused) = (0, 0);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            while !done.load(std::sync::atomic::Ordering::Relaxed) {
                std::fs::write(&path, &large).unwrap();
                std::fs::write(&path, &small).unwrap();
            }
        });
        for _ in 0..150 {
            match load_obj(&path) {
                // What was cut off may still be sound: fewer vertices and no faces would not be.
                Ok(model) => good += u32::from(model.mesh.validate().is_ok()),
                Err(error) => refused += u32::from(error.to_string().contains("model.obj")),
            }
        }
        done.store(true, std::sync::atomic::Ordering::Relaxed);
    });
    assert_eq!(good + refused, 150);
}

#[test]
fn a_film_beyond_the_limit_is_refused_with_the_size_that_it_would_take() {
    let said = fails(&std::env::temp_dir(), "render cornell -o out.png --size 65000x65000", 2);
    assert!(said.contains("GiB"), "{said}");
}

/// Whatever the size, a picture is rendered or refused with what it would take: the process never ends in an allocation.
#[cfg(target_os = "linux")]
#[test]
fn a_picture_beyond_the_memory_of_the_process_is_refused_with_the_size_that_it_would_take() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("grey.ron"), "(camera: (eye: (0, 0, 5), look_at: (0, 0, 0)))").unwrap();
    let render = |args: &str, limit_kib: u32| {
        let line = format!("ulimit -v {limit_kib}; exec {PROGRAM} render {args} --spp 1 --threads 2");
        let output = Command::new("bash").args(["-c", &line]).current_dir(folder.path()).output().unwrap();
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    for args in ["grey.ron -o a.png", "glass-balls -o a.png", "grey.ron -o a.exr", "grey.ron -o a.png --film film.exr"]
    {
        let (code, said) = render(&format!("{args} --size 16000x16000"), 2_000_000);
        assert!(code == Some(1) && said.contains("16000 x 16000") && said.contains("GiB"), "{args}: {code:?} {said}");
        assert!(!said.contains("panicked"), "{args}: {said}");
    }
    // From what fits to what does not, past the edge where the film fits and something else might not.
    let mut codes = Vec::new();
    for side in (600..=3000).step_by(300) {
        for output in ["a.png", "a.exr", "b.png --film film.exr"] {
            let _ = std::fs::remove_file(folder.path().join("film.exr"));
            let (code, said) = render(&format!("grey.ron -o {output} --size {side}x{side}"), 700_000);
            let refused = code == Some(1) && said.contains(&format!("{side} x {side}")) && said.contains("iB");
            assert!(code == Some(0) || refused, "{side}, {output}: {code:?} {said}");
            codes.push(code);
        }
    }
    assert!(codes.contains(&Some(0)) && codes.contains(&Some(1)), "{codes:?}");
    assert_eq!(
        std::fs::read_dir(folder.path())
            .unwrap()
            .filter(|entry| {
                let name = entry.as_ref().unwrap().file_name();
                name.to_string_lossy().starts_with(".firstlight-")
            })
            .count(),
        0,
        "nothing temporary is left"
    );
}

#[test]
fn one_thread_and_sixty_four_render_the_same_bits() {
    let render = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let scene = load(&SceneSource::Builtin("everything".to_owned()), &LoadOptions::default()).unwrap();
            let mut world = bevy_ecs::world::World::new();
            scene.spawn(&mut world);
            let extraction = Extraction::new(&SceneInputs::of(&mut world), &scene.trees);
            let mut film = Film::new(70, 50);
            let target = Target { spp: Some(2), ..Target::default() };
            let settings = world.resource::<Rendering>().0;
            render_offline(&extraction.prepared, &settings, &mut film, target, |_| true);
            film.means()
        })
    };
    assert_eq!(render(1), render(64));
}

/// A few letters ask for many triangles: what all shapes of this kind take together is limited, and the rest is told.
#[test]
fn shapes_of_formulas_end_where_their_bytes_do() {
    let folder = tempfile::tempdir().unwrap();
    let shape = "Shape \"sphere\" \"float zmax\" 0.9\nShape \"loopsubdiv\" \"integer levels\" 4 \"point3 P\" \
                 [0 0 0 1 0 0 0 1 0 0 0 1] \"integer indices\" [0 2 1 0 1 3 1 2 3 0 3 2]\n";
    let scene = format!("Camera \"perspective\"\nWorldBegin\nLightSource \"infinite\"\n{}", shape.repeat(40));
    std::fs::write(folder.path().join("many.pbrt"), scene).unwrap();
    let mut command = program(folder.path());
    let outcome = Outcome::of(command.args(["info", "--json", "many.pbrt"]).env("FIRSTLIGHT_LIMITS", "0.01"));
    assert_eq!(outcome.status, Some(0), "{outcome:?}");
    let said = format!("{}{}", outcome.err, outcome.out());
    assert!(said.contains("there are too many shapes like it") && said.contains("FIRSTLIGHT_LIMITS"), "{said}");
}

/// All meshes of a scene have a limit together, also one file that is read for many attributes.
#[test]
fn meshes_of_a_scene_end_where_their_bytes_do() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let header = "ply\nformat ascii 1.0\nelement vertex 4000\nproperty float x\nproperty float y\nproperty float z\n\
                  element face 3000\nproperty list uchar int vertex_indices\nend_header\n";
    let vertices = (0..4_000).map(|i| format!("{} {} 0\n", i % 200, i / 200));
    let faces = (0..3_000).map(|i| format!("3 {} {} {}\n", i, i + 1, i + 200));
    let mesh: String = std::iter::once(header.to_owned()).chain(vertices).chain(faces).collect();
    let all = |shape: &dyn Fn(usize) -> String| (0..12).map(shape).collect::<String>();
    for i in 0..12 {
        std::fs::write(path.join(format!("m{i}.ply")), &mesh).unwrap();
    }
    let of_ron = all(&|i| format!("mesh(source: ply(\"m{i}.ply\"), material: \"a\"),\n"));
    let of_ron = format!(
        "(camera: (eye: (0, 0, 5), look_at: (0, 0, 0)), materials: {{\"a\": diffuse(albedo: 0.5)}}, \
         environment: constant(1), objects: [{of_ron}])"
    );
    let of_xml = all(&|i| {
        format!(
            "<shape type=\"ply\"><string name=\"filename\" value=\"m0.ply\"/><bsdf type=\"diffuse\">\
             <texture type=\"mesh_attribute\" name=\"reflectance\"><string name=\"name\" value=\"vertex_a{i}\"/>\
             </texture></bsdf></shape>\n"
        )
    });
    let of_xml = format!("<scene version=\"3.0.0\"><sensor type=\"perspective\"/>{of_xml}</scene>");
    // Meshes that emit are read with the scene, others with the files.
    let of_pbrt = all(&|i| {
        let light = if i % 2 == 0 { "AreaLightSource \"diffuse\"" } else { "" };
        format!("AttributeBegin {light} Shape \"plymesh\" \"string filename\" \"m{i}.ply\" AttributeEnd\n")
    });
    let of_pbrt = format!("Camera \"perspective\"\nWorldBegin\n{of_pbrt}");
    // So that a file is within the limit of one, and all of them are not within that of all.
    let factor = 1.6 * mesh.len() as f64 / f64::from(1 << 30);
    for (name, text) in [("many.ron", of_ron), ("many.xml", of_xml), ("many.pbrt", of_pbrt)] {
        std::fs::write(path.join(name), text).unwrap();
        let mut command = program(path);
        let outcome = Outcome::of(command.args(["info", "--json", name]).env("FIRSTLIGHT_LIMITS", factor.to_string()));
        assert_eq!(outcome.status, Some(0), "{outcome:?}");
        let said = format!("{}{}", outcome.err, outcome.out());
        assert!(said.contains("the meshes of the scene take more than 0 MiB together"), "{said}");
    }
}

/// What a scene takes beyond the memory of the process is refused or left out, with its size; nothing is aborted.
#[cfg(target_os = "linux")]
#[test]
fn a_scene_beyond_the_memory_of_the_process_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let camera = "camera: (eye: (0, 0, 5), look_at: (0, 0, 0))";
    image::GrayImage::from_pixel(4096, 4096, image::Luma([99])).save(folder.path().join("sky.png")).unwrap();
    let sky = format!("({camera}, environment: image(file: \"sky.png\"))");
    let sphere = "sphere(radius: 1, material: \"m\"), ";
    let spheres = format!(
        "({camera}, environment: constant(1), materials: {{ \"m\": mirror() }}, objects: [{}])",
        sphere.repeat(100_000)
    );
    std::fs::write(folder.path().join("sky.ron"), sky).unwrap();
    let own: String = (0..50_000).map(|i| format!("sphere(radius: 1, material: \"m{i}\"), ")).collect();
    let materials: String = (0..50_000).map(|i| format!("\"m{i}\": mirror(), ")).collect();
    let own = format!("({camera}, environment: constant(1), materials: {{ {materials} }}, objects: [{own}])");
    std::fs::write(folder.path().join("spheres.ron"), spheres).unwrap();
    std::fs::write(folder.path().join("materials.ron"), own).unwrap();
    let grid = "ball_grid(first: (0, 0, 0), steps: [(100, (1, 0, 0)), (100, (0, 1, 0)), (100, (0, 0, 1))], radius: 0.3, \
                material: \"m\")";
    let light = "materials: { \"m\": emissive(radiance: 1) }";
    let lit = format!("({camera}, environment: constant(1), {light}, objects: [{grid}])");
    std::fs::write(folder.path().join("lights.ron"), lit).unwrap();
    for (scene, code, expected) in [
        ("lights.ron", 1, "1000000 emissive triangles and spheres take about 667 MiB to render"),
        ("sky.ron", 0, "`sky.png`: not enough memory; an environment of one colour is shown"),
        ("spheres.ron", 1, "its 100000 objects, 1 materials, 0 textures and 0 emissive"),
        (
            "materials.ron",
            1,
            "50000 materials, 0 textures and 0 emissive triangles and spheres take about 500 MiB to render, more",
        ),
    ] {
        let line =
            format!("ulimit -v 700000; exec {PROGRAM} render {scene} -o {scene}.png --spp 1 --size 8x6 --threads 2");
        let output = Command::new("bash").args(["-c", &line]).current_dir(folder.path()).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(code) && said.contains(expected), "{:?} {said}", output.status);
    }
}
