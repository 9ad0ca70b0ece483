//! What people of other programs try: completions, manual pages, pipes, several scenes, typing errors.

use crate::program::{Outcome, does, fails, program, run};

#[test]
fn every_shell_gets_completions_and_every_command_a_manual_page() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let outcome = does(path, &format!("completions {shell}"));
        let script = outcome.out();
        assert!(script.contains("turntable") && script.contains("simplify"), "{shell}");
    }
    assert!(does(path, "man").out().contains(".TH firstlight 1"));
    does(path, "man pages");
    does(path, "man pages");
    std::fs::create_dir(path.join("other")).unwrap();
    std::fs::write(path.join("other/firstlight-save.1"), "mine").unwrap();
    let said = fails(path, "man other", 1);
    assert!(said.contains("firstlight-save.1: exists and was not written by firstlight"), "{said}");
    assert_eq!(std::fs::read(path.join("other/firstlight-save.1")).unwrap(), b"mine");
    assert_eq!(std::fs::read_dir(path.join("other")).unwrap().count(), 1);
    let help = does(path, "help");
    let commands =
        help.out().lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    // Further lines of a description stand further to the right.
    let commands = commands.filter(|line| !line.starts_with("   "));
    for command in commands.filter_map(|line| line.split_whitespace().next()).filter(|name| *name != "help") {
        let page = std::fs::read_to_string(path.join(format!("pages/firstlight-{command}.1")));
        assert!(page.is_ok_and(|page| page.contains(".SH SYNOPSIS")), "{command}");
    }
}

#[test]
fn a_mistyped_command_is_named() {
    let folder = tempfile::tempdir().unwrap();
    for line in ["rendr", "rendr cornell", "rendr cornell -o a.png", "--quiet rendr cornell"] {
        let said = fails(folder.path(), line, 2);
        assert_eq!(said, "error: unknown command `rendr` (did you mean `render`?)\n", "{line}");
    }
    assert!(fails(folder.path(), "galery", 2).contains("did you mean `gallery`?"));
}

#[test]
fn a_second_scene_is_told_and_all_scenes_are_listed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let said = fails(path, "cornell gallery", 2);
    assert!(said.starts_with("error: a window shows one scene, and `gallery` follows `cornell`"), "{said}");
    assert!(said.contains("firstlight render cornell gallery -o FOLDER"), "{said}");
    assert_eq!(fails(path, "cornell info", 2), "error: the command comes first: firstlight info cornell\n");
    let list = does(path, "scenes").out().to_owned();
    assert!(list.lines().any(|line| line.starts_with("veach-mis ")), "{list}");
    let json: serde_json::Value = serde_json::from_slice(&does(path, "scenes --json").bytes).unwrap();
    assert_eq!(json.as_array().unwrap().len(), list.lines().count());
}

#[test]
fn missing_folders_of_an_output_are_created_once_there_is_something_to_write() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let options = "--size 8x6 --spp 1";
    does(path, &format!("render cornell {options} -o a/b/one.png --film c/one.exr"));
    assert!(path.join("a/b/one.png").is_file() && path.join("c/one.exr").is_file());
    does(path, &format!("render cornell ball {options} -o several/"));
    assert!(path.join("several/ball.png").is_file());
    does(path, "save cornell -o scenes/cornell.ron");
    assert!(path.join("scenes/cornell.ron").is_file());
    assert!(run(path, &format!("render none.obj {options} -o nowhere/deep/a.png")).status != Some(0));
    assert!(!path.join("nowhere").exists());
}

#[test]
fn an_image_can_be_a_jpeg() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let line = "render cornell --size 32x24 --spp 4 --exposure 2 -o";
    does(path, &format!("{line} a.jpg"));
    does(path, &format!("{line} a.png"));
    assert!(std::fs::read(path.join("a.jpg")).unwrap().starts_with(&[0xff, 0xd8, 0xff]));
    let [jpeg, png] = ["a.jpg", "a.png"].map(|name| image::open(path.join(name)).unwrap().into_rgb8());
    let difference: f64 = jpeg.iter().zip(png.iter()).map(|(a, b)| f64::from(a.abs_diff(*b))).sum();
    assert!(jpeg.dimensions() == (32, 24) && difference / (jpeg.len() as f64) < 10.0, "{difference}");
    let bytes = does(path, &format!("{line} - --format jpg")).bytes;
    assert!(bytes == std::fs::read(path.join("a.jpg")).unwrap());
    let said = run(path, "info a.jpg").err;
    assert!(said.starts_with("error: a.jpg: "), "{said}");
}

#[test]
fn a_colour_of_a_scene_can_be_hexadecimal() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let scene = r##"(camera: (eye: (0, 0, 3), look_at: (0, 0, 0)), environment: constant("#fff"),
        materials: { "clay": diffuse(albedo: "#ccbbaa") }, objects: [sphere(center: (0, 0, 0), radius: 1, material: "clay")])"##;
    std::fs::write(path.join("hex.ron"), scene).unwrap();
    does(path, "save hex.ron -o numbers.ron");
    let saved = std::fs::read_to_string(path.join("numbers.ron")).unwrap();
    assert!(saved.contains("0.6038") && !saved.contains('#'), "{saved}");
    std::fs::write(path.join("short.ron"), scene.replace("#ccbbaa", "#ccbb")).unwrap();
    let said = run(path, "info short.ron").err;
    assert!(said.contains("`#ccbb` is not defined; a colour, where one is expected, is `\"#rgb\"`"), "{said}");
}

#[test]
fn the_options_that_most_people_need_come_first() {
    let folder = tempfile::tempdir().unwrap();
    let [brief, help] =
        ["-h", "--help"].map(|option| does(folder.path(), &format!("render {option}")).out().to_owned());
    let at = |word: &str| help.find(word).unwrap_or_else(|| panic!("{word}: {help}"));
    let common = ["\nOptions:", "--output <", "--size <", "--spp <", "--time <", "--error <", "    --denoise"].map(at);
    let others = ["\nScene:", "\nOutput:", "\nRendering:", "\nAnimation:", "\nFilms and parts:"].map(at);
    assert!(common.is_sorted() && others.is_sorted() && common[common.len() - 1] < others[0], "{help}");
    assert!(brief.lines().count() < 62 && brief.contains("more with '--help'"), "{brief}");
    assert!(["--output", "--frames", "--film"].iter().all(|option| brief.contains(option)), "{brief}");
    assert!(["--part-by", "--error-metric"].iter().all(|option| help.contains(option) && !brief.contains(option)));
}

#[test]
fn a_picture_goes_to_standard_output() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let line = "render cornell --size 20x10 --spp 2 -o";
    for (options, file) in [("-", "a.png"), ("- --format exr", "a.exr")] {
        let Outcome { bytes, err, .. } = does(path, &format!("{line} {options}"));
        assert!(err.contains("standard output: 20 x 10"), "{err}");
        does(path, &format!("{line} {file}"));
        assert!(bytes == std::fs::read(path.join(file)).unwrap(), "the same bytes as those of a file");
    }
    assert!(fails(path, &format!("{line} - --json"), 2).contains("both write to standard output"));
    assert!(fails(path, &format!("{line} - --turntable 3"), 2).contains("takes one image"));
    assert!(fails(path, &format!("{line} b.png --format exr"), 2).contains("a name that ends in .exr"));
    assert!(!path.join("-").exists() && !path.join("b.png").exists());
}

#[test]
fn several_scenes_in_one_call() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    std::fs::create_dir(path.join("out")).unwrap();
    let options = "--size 8x6 --spp 1";
    does(path, &format!("render cornell ball {options} -o out"));
    does(path, &format!("render cornell {options} -o one.png"));
    assert!(path.join("out/ball.png").is_file());
    let pixels = |name: &str| image::open(path.join(name)).unwrap().into_rgb8();
    assert!(pixels("out/cornell.png") == pixels("one.png"));
    // Without a name, new files.
    does(path, &format!("render cornell ball {options}"));
    does(path, &format!("render cornell {options}"));
    for name in ["firstlight-cornell.png", "firstlight-ball.png", "firstlight-cornell-2.png"] {
        assert!(path.join(name).is_file(), "{name}");
    }
    let before = std::fs::read_dir(path.join("out")).unwrap().count();
    for (line, why) in [
        ("render cornell ball -o one.png", "is not a folder"),
        ("render cornell ball -o new.png", "is not a folder"),
        ("render cornell ball -o out --film out/a.exr", "--film works with one scene only"),
        ("render cornell cornell -o out", "same file"),
        ("render cornell bal -o out", "did you mean `ball`?"),
    ] {
        let said = fails(path, line, 2);
        assert!(said.contains(why), "{line}: {said}");
    }
    assert_eq!(std::fs::read_dir(path.join("out")).unwrap().count(), before, "nothing is rendered by mistake");
    let titles = does(path, "info cornell ball --json").out().to_owned();
    let titles = titles.lines().map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap()["scene"].clone());
    assert_eq!(titles.collect::<Vec<_>>(), ["cornell", "ball"]);
}

#[test]
fn an_environment_image_lights_any_scene_and_the_picture_knows_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let white = image::Rgb32FImage::from_pixel(8, 4, image::Rgb([0.5, 0.5, 0.5]));
    image::DynamicImage::ImageRgb32F(white).save(path.join("sky.exr")).unwrap();
    let scene = "(camera: (eye: (0, 0, 5), look_at: (0, 0, 0)), display: (tone_curve: linear))";
    std::fs::write(path.join("empty.ron"), scene).unwrap();
    let tent = "v 0 0 0\nv 1 0 0\nv 0 0 -1\nv 0 1 0\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    std::fs::write(path.join("tent.obj"), tent).unwrap();
    let options = "--env sky.exr --size 16x8 --spp 4";
    does(path, &format!("render empty.ron {options} -o a.png"));
    let picture = image::open(path.join("a.png")).unwrap().into_rgb8();
    assert!(picture.pixels().all(|pixel| pixel.0 == [188; 3]), "half the light is byte 188 in sRGB");
    // A picture of it opens as what it shows, and so does a picture of that.
    for (from, to) in [("a.png", "b.png"), ("b.png", "c.png")] {
        let said = does(path, &format!("render {from} -o {to}")).err;
        assert!(!said.contains("warning"), "{said}");
        assert!(image::open(path.join(to)).unwrap().into_rgb8() == picture, "{to}");
    }
    // A model loses its light: all light is that of the image.
    let told: serde_json::Value =
        serde_json::from_slice(&does(path, "info tent.obj --env sky.exr --json").bytes).unwrap();
    assert_eq!((told["emissive_objects"].as_u64(), told["environment"].as_str()), (Some(0), Some("image, 8 x 4")));
    does(path, "save tent.obj --env sky.exr -o saved.ron");
    assert!(std::fs::read_to_string(path.join("saved.ron")).unwrap().contains("\"sky.exr\""));
    let said = fails(path, "info empty.ron --env none.hdr", 1);
    assert!(said.contains("none.hdr: cannot be read: no such file"), "{said}");
    std::fs::write(path.join("sky.hdr"), "").unwrap();
    assert!(run(path, "info sky.hdr").err.contains("--env FILE.hdr"));
}

#[test]
fn quiet_says_nothing_but_warnings_and_verbose_says_more() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let line = "render cornell --size 8x6 --spp 4 -o a.png";
    for quiet in [format!("--quiet {line}"), format!("{line} -q")] {
        assert_eq!(does(path, &quiet).err, "");
    }
    assert!(does(path, &format!("{line} -q --error 0.1%")).err.starts_with("warning: the estimated error is "));
    let said = does(path, &format!("-v {line}")).err;
    assert!(said.contains("cornell: loaded in") && said.contains("threads"), "{said}");
    fails(path, &format!("{line} -q -v"), 2);
}

#[test]
fn colours_are_left_out_where_they_are_not_wanted() {
    for (name, value, is_plain) in [("CLICOLOR_FORCE", "1", false), ("NO_COLOR", "1", true)] {
        let mut command = program(&std::env::temp_dir());
        let outcome = Outcome::of(command.arg("--help").env("CLICOLOR_FORCE", "1").env(name, value));
        assert_eq!(!outcome.bytes.contains(&0x1b), is_plain, "{name}");
    }
}

#[test]
fn a_deviation_in_percent_is_a_share_of_the_diagonal() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    // A large flat grid, whose unit says nothing of how large it is.
    let n = 12;
    let points = (0..=n).flat_map(|y| (0..=n).map(move |x| format!("v {} {} {}\n", 100 * x, 100 * y, (x * y) % 2)));
    let corner = |x: usize, y: usize| y * (n + 1) + x + 1;
    let faces = (0..n).flat_map(|y| {
        (0..n).map(move |x| {
            format!("f {} {} {} {}\n", corner(x, y), corner(x + 1, y), corner(x + 1, y + 1), corner(x, y + 1))
        })
    });
    std::fs::write(path.join("grid.obj"), points.chain(faces).collect::<String>()).unwrap();
    let after = |error: &str| {
        let json = does(path, &format!("simplify grid.obj -o out.obj --error {error} --json")).json();
        (json["faces_after"].as_u64().unwrap(), json["diagonal"].as_f64().unwrap())
    };
    let (faces, diagonal) = after("0.5%");
    assert!(faces < 2 * (n * n) as u64);
    assert_eq!(after(&format!("{}", 0.005 * diagonal)).0, faces);
    assert!(fails(path, "simplify grid.obj -o out.obj --error half%", 2).contains("percentage of the diagonal"));
}
