//! Pictures and films that can be gone on with, through the program: open, resume, merge, stop.

use crate::program::{does, fails, run};
use std::path::Path;

/// Two files hold the same bytes.
#[track_caller]
fn assert_equal(folder: &Path, a: &str, b: &str) {
    // Without the bytes themselves: nobody could read them.
    assert!(bytes(folder, a) == bytes(folder, b), "{a} and {b} differ");
}

fn bytes(folder: &Path, name: &str) -> Vec<u8> {
    std::fs::read(folder.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

const ROOM: &str = r#"(
    camera: (eye: (0.3, 1, 4), look_at: (0, 0.7, 0), lens_radius: 0.05),
    environment: gradient(zenith: 1, horizon: 0.5, ground: 0.1),
    materials: { "red": diffuse(albedo: (0.8, 0.2, 0.1)), "glow": emissive(radiance: 7) },
    objects: [
        mesh(source: obj("tent.obj"), material: "red"),
        sphere(center: (1, 2, 0), radius: 0.3, material: "glow"),
        plane(material: "red"),
    ],
)"#;

fn write_room(folder: &Path) {
    std::fs::create_dir_all(folder).unwrap();
    std::fs::write(folder.join("room.ron"), ROOM).unwrap();
    let tent = "v 0 0 0\nv 1 0 0\nv 0 0 -1\nv 0 1 0\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    std::fs::write(folder.join("tent.obj"), tent).unwrap();
}

#[test]
fn a_picture_opens_as_the_scene_that_it_shows_and_renders_to_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    write_room(&path.join("scenes"));
    let how = "--size 40x30 --spp 5 --seed 9 --exposure 0.7 --filter tent --max-depth 6";
    for kind in ["png", "exr"] {
        does(path, &format!("render scenes/room.ron -o first.{kind} {how}"));
        does(path, &format!("render first.{kind} -o again.{kind}"));
        assert_equal(path, &format!("first.{kind}"), &format!("again.{kind}"));
    }
    // A range of samples, a built-in scene and a model come back as well; so does a picture of a picture.
    std::fs::copy(path.join("scenes/tent.obj"), path.join("tent.obj")).unwrap();
    for scene in ["dof-balls --samples 3..7", "tent.obj --up z --spp 3", "first.png --spp 2"] {
        does(path, &format!("render {scene} -o a.exr --size 24x16 --seed 1"));
        does(path, "render a.exr -o b.exr");
        assert_equal(path, "a.exr", "b.exr");
    }
    // Twice the size is another picture of the same view, and more samples are more.
    does(path, "render first.png -o large.png --scale 2 --spp 1");
    assert_eq!(image::image_dimensions(path.join("large.png")).unwrap(), (80, 60));
    // Without a display the picture opens as a picture.
    does(path, "first.png --size 8x6");
    assert_eq!(image::image_dimensions(path.join("firstlight-first.png")).unwrap(), (8, 6));
    assert!(run(path, "info first.png").out().contains("40 x 30, tent filter"));

    // It is found beside the picture too, and missed when it is nowhere.
    std::fs::create_dir(path.join("elsewhere")).unwrap();
    std::fs::rename(path.join("first.png"), path.join("elsewhere/first.png")).unwrap();
    let said = fails(path, "render elsewhere/first.png -o c.png", 1);
    assert!(said.contains("scenes/room.ron was not found"), "{said}");
    write_room(&path.join("elsewhere"));
    let said = does(path, "render elsewhere/first.png -o elsewhere/c.png").err;
    assert!(!said.contains("changed"), "{said}");
}

#[test]
fn a_scene_that_has_changed_since_the_picture_is_noticed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    write_room(path);
    does(path, "render room.ron -o a.png --size 20x15 --spp 1");
    assert_eq!(does(path, "render a.png -o b.png").err.lines().count(), 1, "nothing but what was written");
    // Another camera or size in the file changes nothing: the picture has its own.
    std::fs::write(path.join("room.ron"), ROOM.replace("eye: (0.3, 1, 4)", "eye: (0.4, 1, 4)")).unwrap();
    assert_eq!(does(path, "render a.png -o b.png").err.lines().count(), 1, "nothing but what was written");
    assert_equal(path, "a.png", "b.png");
    std::fs::write(path.join("room.ron"), ROOM.replace("radiance: 7", "radiance: 8")).unwrap();
    assert!(does(path, "render a.png -o b.png").err.contains("room.ron has changed since the image was rendered"));
    // A vertex of the mesh moves.
    std::fs::write(path.join("room.ron"), ROOM).unwrap();
    assert_eq!(does(path, "render a.png -o b.png").err.lines().count(), 1, "nothing but what was written");
    let tent = std::fs::read_to_string(path.join("tent.obj")).unwrap().replace("v 0 1 0", "v 0 1.001 0");
    std::fs::write(path.join("tent.obj"), tent).unwrap();
    assert!(does(path, "render a.png -o b.png").err.contains("has changed since"));
    // What is no picture of ours says so.
    image::RgbImage::new(4, 4).save(path.join("plain.png")).unwrap();
    assert!(fails(path, "render plain.png -o b.png", 1).contains("plain.png: it has no embedded firstlight scene"));
    std::fs::write(path.join("text.png"), "text").unwrap();
    assert!(fails(path, "render text.png -o b.png", 1).contains("neither a PNG nor an OpenEXR image"));
}

#[test]
fn parts_add_up_to_the_whole_bit_for_bit_in_any_order() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let render = |name: &str, samples: &str| {
        // Sums of a light in the picture and of dark corners are those that rounding would tell apart.
        does(path, &format!("render cornell-balls -o {name}.png --film {name}.exr --size 40x33 --samples {samples}"));
    };
    render("whole", "0..128");
    render("a", "0..64");
    render("b", "64..128");
    does(path, "merge a.exr b.exr -o ab.exr --image ab.png");
    does(path, "merge b.exr a.exr -o ba.exr");
    assert_equal(path, "whole.exr", "ab.exr");
    assert_equal(path, "whole.exr", "ba.exr");
    assert_equal(path, "whole.png", "ab.png");

    // Odd cuts give the same light; what they cannot know is how fast the error fell between the powers of two.
    for (name, samples) in [("c", "0..7"), ("d", "100..128"), ("e", "7..100")] {
        render(name, samples);
    }
    does(path, "merge c.exr d.exr e.exr -o cde.exr --image cde.png");
    assert_equal(path, "whole.png", "cde.png");
    // Not a byte depends on the order in which they are named, nor on how each of them is shown.
    does(path, "render cornell-balls -o f.png --film f.exr --size 40x33 --samples 128..129 --exposure 2");
    let orders = ["c d e f", "f e d c", "e c f d", "d f c e"];
    for (i, order) in orders.iter().enumerate() {
        let names: String = order.split(' ').map(|name| format!("{name}.exr ")).collect();
        does(path, &format!("merge {names} -o order-{i}.exr --image order-{i}.png"));
        assert_equal(path, "order-0.exr", &format!("order-{i}.exr"));
        assert_equal(path, "order-0.png", &format!("order-{i}.png"));
    }

    // What cannot be added up is refused with the reason.
    for (line, expected) in [
        ("merge a.exr whole.exr -o x.exr", "both films have the samples 0 to 63"),
        ("merge a.exr none.exr -o x.exr", "none.exr: cannot be read: no such file"),
        ("merge a.exr whole.png -o x.exr", "whole.png: is not a firstlight film"),
    ] {
        let said = fails(path, line, 1);
        assert!(said.contains(expected), "{line}: {said}");
    }
    for (change, expected) in [
        ("--seed 1", "a different seed"),
        ("--size 40x32", "a different size"),
        ("--filter tent", "a different pixel filter"),
        ("--integrator phong", "a different integrator"),
        ("--max-depth 3", "a different maximum depth"),
    ] {
        let _ = std::fs::remove_file(path.join("other.exr"));
        let size = if change.contains("size") { "" } else { "--size 40x33" };
        does(path, &format!("render cornell-balls -o o.png --film other.exr --samples 200..201 {size} {change}"));
        let said = fails(path, "merge a.exr other.exr -o x.exr", 1);
        assert!(said.contains(expected), "{change}: {said}");
    }
    does(path, "render cornell -o o.png --film box.exr --samples 200..201 --size 40x33");
    assert!(fails(path, "merge a.exr box.exr -o x.exr", 1).contains("a different scene"));
    assert!(!path.join("x.exr").exists());
}

#[test]
fn a_film_is_gone_on_with_as_if_it_had_never_stopped() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    write_room(path);
    does(path, "render room.ron -o whole.png --film whole.exr --size 40x30 --seed 3 --spp 24");
    does(path, "render room.ron -o part.png --film part.exr --size 40x30 --seed 3 --spp 10");
    // Size, seed and the rest are as the film has them; the film names its scene as well.
    does(path, "render room.ron -o part.png --film part.exr --resume --spp 17");
    does(path, "render part.exr -o part.png --resume --spp 24");
    assert_equal(path, "whole.exr", "part.exr");
    assert_equal(path, "whole.png", "part.png");
    // A film shows its picture to everyone.
    let shown = image::open(path.join("part.exr")).unwrap().into_rgb32f();
    assert_eq!(shown.dimensions(), (40, 30));
    assert!(shown.pixels().all(|pixel| pixel.0.iter().all(|channel| *channel > 0.0)));

    // Nothing is lost by mistake.
    let before = bytes(path, "part.exr");
    for (line, expected) in [
        ("render room.ron -o p.png --film part.exr --spp 1", "part.exr: already exists: continue it with --resume"),
        ("render cornell -o p.png --film part.exr --resume", "part.exr: the film was rendered with a different scene"),
        (
            "render room.ron -o p.png --film part.exr --resume --seed 4",
            "part.exr: the film was rendered with a different seed",
        ),
        ("render room.ron -o p.png --film none.exr --resume", "none.exr: cannot be read: no such file"),
    ] {
        let said = fails(path, line, 1);
        assert!(said.contains(expected), "{line}: {said}");
    }
    std::fs::write(path.join("room.ron"), ROOM.replace("radiance: 7", "radiance: 8")).unwrap();
    let said = fails(path, "render room.ron -o p.png --film part.exr --resume", 1);
    assert!(said.contains("a different scene or version of the scene"), "{said}");
    assert!(bytes(path, "part.exr") == before, "nothing was lost");
    for line in ["render room.ron -o p.png --resume", "render room.ron -o p.png --film f.png"] {
        fails(path, line, 2);
    }
}

#[test]
fn a_film_that_is_cut_short_or_damaged_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    does(path, "render dof-balls -o a.png --film a.exr --size 20x20 --spp 2");
    let whole = bytes(path, "a.exr");
    for length in [0, 3, 200, 1500, whole.len() / 2, whole.len() - 1] {
        std::fs::write(path.join("cut.exr"), &whole[..length]).unwrap();
        let said = fails(path, "render dof-balls -o b.png --film cut.exr --resume", 1);
        assert!(
            said.contains("cut.exr: is truncated") || said.contains("cut.exr: is not a firstlight film"),
            "{length}: {said}"
        );
        assert_eq!(said.lines().count(), 1, "{said}");
    }
    // One bit of the light itself: the compressed rows lie at the end.
    let mut damaged = whole.clone();
    let at = whole.len() - 40;
    damaged[at] ^= 4;
    std::fs::write(path.join("cut.exr"), &damaged).unwrap();
    let said = fails(path, "render dof-balls -o b.png --film cut.exr --resume", 1);
    assert!(said.contains("is truncated or damaged"), "{said}");
    // What is not light: the samples that it has, and the note.
    for (from, to) in [("samples:[(0,2)]", "samples:[(0,4)]"), ("seed: 0", "seed: 1"), ("spp: 2", "spp: 4")] {
        let place = whole.windows(from.len()).position(|part| part == from.as_bytes());
        let place = place.unwrap_or_else(|| panic!("{from} is not in the file"));
        let mut edited = whole.clone();
        edited.splice(place..place + from.len(), to.bytes());
        std::fs::write(path.join("cut.exr"), &edited).unwrap();
        let said = fails(path, "render dof-balls -o b.png --film cut.exr --resume", 1);
        assert!(said.contains("checksum mismatch"), "{from}: {said}");
    }
    // A picture without a film in it.
    does(path, "render dof-balls -o plain.exr --size 20x20 --spp 2");
    let said = fails(path, "render dof-balls -o b.png --film plain.exr --resume", 1);
    assert!(said.contains("plain.exr: is not a firstlight film"), "{said}");
}

#[cfg(unix)]
#[test]
fn ctrl_c_saves_what_is_there_and_it_can_be_gone_on_with() {
    use std::time::{Duration, Instant};
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let pressed_after = |seconds: f64| {
        let child = std::process::Command::new(assert_cmd::cargo::cargo_bin("firstlight"))
            .current_dir(path)
            .args("render cornell-balls -o a.png --film a.exr --size 64x64 --spp 1000000 --json".split(' '))
            .stdout(std::process::Stdio::piped())
            .stderr(std::process::Stdio::piped())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_secs_f64(seconds));
        let pressed = Instant::now();
        let kill = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
        assert!(kill.success());
        let output = child.wait_with_output().unwrap();
        assert!(pressed.elapsed() < Duration::from_secs(30), "{:?}", pressed.elapsed());
        output
    };
    // A busy machine may need a while for the first sample; before that there is nothing was saved, which is said.
    let mut waits = [1.0, 5.0, 25.0].into_iter();
    let output = loop {
        let output = pressed_after(waits.next().expect("a sample takes less than half a minute"));
        let said = String::from_utf8_lossy(&output.stderr);
        let nothing_yet = output.status.code().is_none() || said.contains("nothing was saved");
        if !nothing_yet {
            break output;
        }
        assert!(!path.join("a.exr").exists(), "nothing half-made is left");
    };
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(130), "{said}");
    assert!(said.contains("saved a.png and the film a.exr: continue with --resume"), "{said}");
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let spp = json["spp"].as_u64().unwrap();
    assert!(spp > 0 && json["stopped"] == true, "{json}");
    // Gone on with, it is as if nothing had happened.
    // Some pixels have a few samples more than others.
    let goal = 2 * (spp + 1).next_power_of_two();
    does(path, &format!("render a.exr -o a.png --resume --spp {goal}"));
    does(path, &format!("render cornell-balls -o b.png --film b.exr --size 64x64 --spp {goal}"));
    assert_equal(path, "a.exr", "b.exr");
}
