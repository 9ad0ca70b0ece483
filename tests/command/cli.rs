//! The program from outside: pictures, figures, and the same bytes for any number of threads.

use crate::program::{Outcome, does, fails, program};
use std::path::Path;

fn firstlight(folder: &Path, args: &[&str]) -> String {
    let outcome = Outcome::of(program(folder).args(args));
    assert_eq!(outcome.status, Some(0), "{args:?}: {}", outcome.err);
    outcome.out().to_owned()
}

#[test]
fn a_png_and_an_exr_show_the_same_light() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    std::fs::write(
        path.join("grey.ron"),
        "(camera: (eye: (0, 0, 5), look_at: (0, 0, 0)), environment: constant(0.5), display: (tone_curve: linear))",
    )
    .unwrap();
    firstlight(path, &["render", "grey.ron", "-o", "grey.png", "--size", "20x10", "--spp", "2"]);
    firstlight(path, &["render", "grey.ron", "-o", "grey.exr", "--size", "20x10", "--spp", "2", "--exposure", "3"]);
    let png = image::open(path.join("grey.png")).unwrap().into_rgb8();
    assert_eq!(png.dimensions(), (20, 10));
    assert!(png.pixels().all(|pixel| pixel.0 == [188; 3]), "half the light is byte 188 in sRGB");
    let exr = image::open(path.join("grey.exr")).unwrap().into_rgb32f();
    assert!(exr.pixels().all(|pixel| pixel.0 == [0.5; 3]), "linear, and exposure left out");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let mode = |name: &str| std::fs::metadata(path.join(name)).unwrap().permissions().mode() & 0o777;
        assert_eq!(mode("grey.png"), mode("grey.ron"), "readable by whom the user's mask lets");
    }
}

#[test]
fn a_denoised_picture_says_so_and_leaves_the_film_raw() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let render = |line: &str| firstlight(path, &line.split(' ').collect::<Vec<_>>());
    render("render cornell -o raw.exr --size 48x48 --spp 4 --film raw-film.exr");
    let told = render("render cornell -o denoised.exr --size 48x48 --spp 4 --film film.exr --denoise --json");
    let told: serde_json::Value = serde_json::from_str(told.lines().last().unwrap()).unwrap();
    let [raw_error, error] = ["estimated_error", "estimated_error_denoised"].map(|key| told[key].as_f64().unwrap());
    assert!(error > 0.0 && error < raw_error, "{told}");
    let pixels = |name: &str| image::open(path.join(name)).unwrap().into_rgb32f().into_raw();
    assert_ne!(pixels("raw.exr"), pixels("denoised.exr"));
    assert_eq!(pixels("raw-film.exr"), pixels("film.exr"), "the film is raw");
    let denoised_by = |name: &str| firstlight::scene::ImageMetadata::read(&path.join(name)).unwrap().denoised;
    assert_eq!(["raw.exr", "denoised.exr", "film.exr"].map(denoised_by), [None, Some("own".to_owned()), None]);
    render("render cornell -o denoised.png --size 48x48 --spp 1 --denoise --threads 1");
    assert_eq!(denoised_by("denoised.png"), Some("own".to_owned()));
}

#[test]
fn a_picture_that_found_no_light_does_not_know_its_error() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let scene = |environment: &str| {
        format!(
            "(camera: (eye: (0, 0, 5), look_at: (0, 0, 0)), environment: {environment}, materials: {{ \"m\": diffuse(albedo: 0.5), \
             \"l\": emissive(radiance: 1) }}, objects: [sphere(center: (0, 0, 9), radius: 1, material: \"l\"), \
             quad(corner: (-9, -9, 0), edge_u: (18, 0, 0), edge_v: (0, 18, 0), material: \"m\"), \
             quad(corner: (-9, -9, 7), edge_u: (18, 0, 0), edge_v: (0, 18, 0), material: \"m\")])"
        )
    };
    let run = |name: &str, json: &str| does(path, &format!("render {name} -o a.png --size 8x6 --spp 8 {json}"));
    // The light is behind a wall.
    std::fs::write(path.join("dark.ron"), scene("black")).unwrap();
    let told = run("dark.ron", "").err;
    assert!(told.contains("none of 8 samples") && !told.contains("estimated error"), "{told}");
    let json = run("dark.ron", "--json").json();
    assert!(json["estimated_error"].is_null(), "{json}");
    // Where nothing shines, black is right.
    std::fs::write(path.join("void.ron"), "(camera: (eye: (0, 0, 5), look_at: (0, 0, 0)), environment: black)")
        .unwrap();
    let told = run("void.ron", "").err;
    assert!(!told.contains("none of") && told.contains("estimated error 0 %"), "{told}");
}

#[test]
fn the_last_line_is_one_json_object() {
    let folder = tempfile::tempdir().unwrap();
    let args = ["render", "cornell", "-o", "c.png", "--size", "24x16", "--spp", "8", "--threads", "2", "--json"];
    let out = firstlight(folder.path(), &args);
    let json: serde_json::Value = serde_json::from_str(out.lines().last().unwrap()).unwrap();
    assert_eq!((json["width"].as_u64(), json["height"].as_u64()), (Some(24), Some(16)));
    assert_eq!((json["spp"].as_u64(), json["threads"].as_u64()), (Some(8), Some(2)));
    assert_eq!(json["rays"]["camera"].as_u64(), Some(24 * 16 * 8));
    assert_eq!(json["bad_samples"].as_u64(), Some(0));
    for key in ["load_s", "build_s", "render_s", "cpu_s", "mrays_per_s", "estimated_error"] {
        assert!(json[key].as_f64().is_some_and(|value| value >= 0.0), "{key}: {json}");
    }
}

#[test]
fn the_picture_does_not_depend_on_threads_but_on_the_seed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let render = |name: &str, threads: &str, seed: &str| {
        let args = ["render", "cornell-balls", "-o", name, "--size", "40x40", "--spp", "4"];
        firstlight(path, &[&args[..], &["--threads", threads, "--seed", seed]].concat());
        std::fs::read(path.join(name)).unwrap()
    };
    let one = render("one.exr", "1", "7");
    assert_eq!(one, render("three.exr", "3", "7"));
    assert_ne!(one, render("other.exr", "3", "8"));
}

#[test]
fn time_and_error_end_a_render() {
    let folder = tempfile::tempdir().unwrap();
    let spp = |limit: [&str; 2]| {
        let args = ["render", "dof-balls", "-o", "d.png", "--size", "32x24", "--json"];
        let out = firstlight(folder.path(), &[&args[..], &limit].concat());
        let json: serde_json::Value = serde_json::from_str(out.lines().last().unwrap()).unwrap();
        (json["spp"].as_u64().unwrap(), json["render_s"].as_f64().unwrap(), json["estimated_error"].as_f64())
    };
    let (samples, seconds, _) = spp(["--time", "0.2"]);
    assert!(samples >= 1 && (0.2..5.0).contains(&seconds), "{samples} samples in {seconds} s");
    let (samples, _, error) = spp(["--error", "0.05"]);
    assert!(samples >= 4 && error.is_some_and(|error| error <= 0.05), "{error:?} after {samples}");
    assert_eq!(spp(["--error", "5%"]).0, samples, "5% is not 0.05");
    // Who asked for an error and got another is told.
    for (limits, missed) in [(["--error", "1e-6", "--spp", "8"], true), (["--error", "0.05", "--spp", "9999"], false)] {
        let said = does(folder.path(), &format!("render dof-balls -o d.png --size 32x24 {}", limits.join(" "))).err;
        assert_eq!(said.contains("above the target of"), missed, "{limits:?}: {said}");
    }
}

#[test]
fn the_error_of_each_pixel_is_written_as_the_picture_tells_it() {
    let folder = tempfile::tempdir().unwrap();
    let line = "render cornell -o a.png --size 50x40 --spp 24 --error-image e.exr --json";
    let out = firstlight(folder.path(), &line.split(' ').collect::<Vec<_>>());
    let json: serde_json::Value = serde_json::from_str(out.lines().last().unwrap()).unwrap();
    let told = json["estimated_error"].as_f64().unwrap();
    let errors = image::open(folder.path().join("e.exr")).unwrap().into_rgb32f();
    assert_eq!(errors.dimensions(), (50, 40));
    let squares: f64 = errors.pixels().map(|pixel| f64::from(pixel[0]).powi(2)).sum();
    let mean = (squares / 2000.0).sqrt();
    assert!((mean / told - 1.0).abs() < 1e-4, "{mean} for {told}");
    assert!(errors.pixels().all(|pixel| pixel[0] >= 0.0 && pixel[0] == pixel[2]));
    for (name, why) in [("e.png", "must end in .exr"), ("b.exr", "two outputs have the same name")] {
        let line = format!("render cornell -o b.exr --spp 2 --error-image {name}");
        let said = fails(folder.path(), &line, 2);
        assert!(said.contains(why), "{said}");
        assert!(!folder.path().join("b.exr").exists());
    }
}

#[test]
fn without_a_display_the_scene_becomes_a_picture() {
    let folder = tempfile::tempdir().unwrap();
    let scene = "(camera: (eye: (0, 0, 5), look_at: (0, 0, 0)), film: (width: 8, height: 8))";
    std::fs::write(folder.path().join("dark.ron"), scene).unwrap();
    for name in ["firstlight-dark.png", "firstlight-dark-2.png"] {
        firstlight(folder.path(), &["dark.ron"]);
        assert_eq!(image::image_dimensions(folder.path().join(name)).unwrap(), (8, 8));
    }
}

#[test]
fn info_tells_what_is_in_a_scene_and_what_it_uses() {
    let folder = tempfile::tempdir().unwrap();
    let out = firstlight(folder.path(), &["info", "cornell-balls"]);
    for expected in ["2 × sphere", "6 × quad", "1 × glass", "pinhole", "512 x 512", "1 emissive object,"] {
        assert!(out.contains(expected), "expected {expected:?} in:\n{out}");
    }
    let uses = out.lines().find(|line| line.trim_start().starts_with("uses")).unwrap();
    assert!(uses.contains("glass") && !uses.contains("textures"), "{uses}");
}

#[test]
fn info_counts_lights_that_reflect() {
    let folder = tempfile::tempdir().unwrap();
    let scene = "<scene version=\"3.0.0\"><shape type=\"rectangle\"><emitter type=\"area\"/></shape></scene>";
    std::fs::write(folder.path().join("light.xml"), scene).unwrap();
    let out = firstlight(folder.path(), &["info", "light.xml"]);
    assert!(out.contains("1 emissive object,"), "{out}");
}

#[test]
fn info_tells_machines_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let out = firstlight(folder.path(), &["info", "cornell-balls", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(json["objects"], serde_json::json!({ "quad": 6, "sphere": 2 }));
    assert_eq!((json["width"].as_u64(), json["emissive_objects"].as_u64()), (Some(512), Some(1)));
    let list = |key: &str| json[key].as_array().unwrap().iter().map(|name| name.as_str().unwrap()).collect::<Vec<_>>();
    assert!(list("uses").contains(&"glass") && list("not_used").contains(&"textures"), "{json}");
}

#[test]
fn whoever_closes_the_pipe_has_read_enough() {
    let folder = tempfile::tempdir().unwrap();
    for args in [
        &["info", "cornell"][..],
        &["info", "cornell", "--json"],
        &["render", "cornell", "-o", "c.png", "--size", "8x8", "--spp", "1", "--json"],
        &["--help"],
    ] {
        let mut child = std::process::Command::new(assert_cmd::cargo::cargo_bin("firstlight"))
            .current_dir(folder.path())
            .args(args)
            .stdout(std::process::Stdio::piped())
            .stderr(std::process::Stdio::piped())
            .spawn()
            .unwrap();
        // Long before the program has anything to say, and for its remarks as well.
        drop((child.stdout.take(), child.stderr.take()));
        assert_eq!(child.wait().unwrap().code(), Some(0), "{args:?}");
    }
}

#[test]
fn without_a_display_a_scene_that_is_not_there_is_one_error() {
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(fails(folder.path(), "missing.obj", 1), "error: missing.obj: cannot be read: no such file\n");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn a_model_alone_is_framed_and_lit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    // A small tetrahedron far from the origin, as surveyors have them.
    let at = |x: f64, y: f64, z: f64| format!("v {} {} {}\n", 5e5 + x, 4.5e6 + y, 120.0 + z);
    let obj = at(0.0, 0.0, 0.0) + &at(1.0, 0.0, 0.0) + &at(0.0, 0.0, -1.0) + &at(0.3, 1.0, -0.3);
    std::fs::write(path.join("tent.obj"), obj + "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n").unwrap();
    firstlight(path, &["render", "tent.obj", "-o", "tent.png", "--size", "64x48", "--spp", "16", "--up", "y"]);
    let picture = image::open(path.join("tent.png")).unwrap().into_rgb8();
    let [mut warm, mut all] = [0_u32, 0];
    for pixel in
        picture.enumerate_pixels().filter(|(x, y, _)| (16..48).contains(x) && (12..36).contains(y)).map(|p| p.2)
    {
        all += 1;
        // Clay is redder than ground and sky.
        warm += u32::from(i32::from(pixel.0[0]) > i32::from(pixel.0[2]) + 15);
    }
    assert!(warm * 4 > all, "the model fills the middle: {warm} of {all} pixels");
}

#[test]
fn every_built_in_scene_opens_by_its_name_alone() {
    // A command of the same name would come first.
    let folder = tempfile::tempdir().unwrap();
    let help = firstlight(folder.path(), &["help"]);
    let part = |from: &str, to: &str| {
        let lines = help.lines().skip_while(move |line| !line.starts_with(from)).skip(1);
        lines.take_while(move |line| !line.starts_with(to)).filter_map(|line| line.split_whitespace().next()).collect()
    };
    let (commands, scenes): (Vec<&str>, Vec<&str>) = (part("Commands:", "Arguments:"), part("Built-in scenes:", "@"));
    assert!(commands.len() >= 8 && scenes.contains(&"gallery") && scenes.len() >= 15, "{help}");
    assert!(scenes.iter().all(|scene| !commands.contains(scene)), "{help}");
}

/// What `firstlight stability` says, and how it ends.
fn stability(args: &[&str]) -> (Option<i32>, String, String) {
    let outcome = Outcome::of(program(&std::env::temp_dir()).arg("stability").args(args));
    (outcome.status, outcome.out().to_owned(), outcome.err)
}

#[test]
fn a_ray_is_replayed_for_people_and_for_machines() {
    let args = ["--case", "closed", "--replay", "0:7"];
    let (code, told, _) = stability(&args);
    assert_eq!(code, Some(0));
    let rows: Vec<(&str, &str)> = told.lines().map(|line| line.split_once("  ").unwrap()).collect();
    let value = |label: &str| rows.iter().find(|(known, _)| known.trim() == label).unwrap().1.trim();
    let (code, json, _) = stability(&[&args[..], &["--json"]].concat());
    assert_eq!(code, Some(0));
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!((json["case"].as_str(), json["replay"].as_str()), (Some("closed"), Some("0:7")));
    // The same numbers to the last bit.
    let bits = |numbers: Vec<f32>| numbers.into_iter().map(f32::to_bits).collect::<Vec<_>>();
    for label in ["origin", "direction", "point", "normal", "next_direction"] {
        let of_text = value(label).split(", ").map(|x| x.parse::<f32>().unwrap()).collect();
        let of_json = json[label].as_array().unwrap().iter().map(|x| x.as_f64().unwrap() as f32).collect();
        assert_eq!(bits(of_text), bits(of_json), "{label}:\n{told}");
    }
    assert_eq!(value("t").parse::<f32>().unwrap(), json["t"].as_f64().unwrap() as f32);
    assert_eq!((value("result"), json["result"].as_str()), ("right", Some("right")));
    assert_eq!((value("must_hit"), json["must_hit"].as_bool()), ("yes", Some(true)));
    for (args, expected) in [
        (&["--case", "closed", "--replay", "0:99999999999"][..], "test scene 0 has no ray 99999999999, only 0 to "),
        (&["--case", "closed", "--replay", "5000:1"], "there is no test scene 5000"),
        (&["--case", "glass", "--replay", "0:99999999999"], "test scene 0 has no ray 99999999999"),
        (&["--case", "white-box", "--replay", "0:0"], "has no rays to replay"),
        (&["--case", "closed", "--case", "glass", "--replay", "0:0"], "needs exactly one --case"),
        (&["--replay", "0:0"], "--case"),
        (&["--list", "--case", "closed"], "cannot be used with"),
    ] {
        let (code, told, said) = stability(args);
        assert!(code == Some(2) && said.contains(expected) && told.is_empty(), "{args:?}: {said}{told}");
    }
}

#[test]
fn the_cases_of_stability_are_listed_for_machines_too() {
    let (code, json, _) = stability(&["--list", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    let names: Vec<&str> =
        json["cases"].as_array().unwrap().iter().map(|case| case["case"].as_str().unwrap()).collect();
    let (_, text, _) = stability(&["--list"]);
    let listed: Vec<&str> = text.lines().map(|line| line.split(' ').next().unwrap()).collect();
    assert!(code == Some(0) && names.len() > 10 && names == listed, "{names:?} {listed:?}");
}

#[test]
fn info_lists_the_materials_with_what_differs_from_their_defaults() {
    let folder = tempfile::tempdir().unwrap();
    let text = firstlight(folder.path(), &["info", "cornell", "--materials"]);
    let rows: Vec<&str> = text.lines().filter(|line| line.trim_start().starts_with("material ")).collect();
    assert!(rows.iter().any(|row| row.contains("`red`: diffuse, albedo (0.63")), "{text}");
    let json = firstlight(folder.path(), &["info", "cornell", "--materials", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["material_list"].as_array().unwrap().len(), rows.len(), "{json}");
}
