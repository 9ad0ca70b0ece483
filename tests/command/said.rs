//! What commands say: of what they did, of what they could not do, and of options that have no effect.

use crate::program::{does, fails, run};

const TENT: &str = "v 0 0 0\nv 1 0 0\nv 0 0 -1\nv 0 2 0\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";

#[test]
fn info_has_one_line_for_all_instances_of_a_mesh_and_the_size_of_the_scene() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    std::fs::write(path.join("tent.obj"), TENT).unwrap();
    let tents: String = (0..500)
        .map(|i| {
            let (place, scale) = (i * 2, if i == 7 { 3 } else { 1 });
            format!("mesh(source: obj(\"tent.obj\"), material: \"a\", transform: (translate: ({place}, 0, 0), scale: {scale})),\n")
        })
        .collect();
    let scene = format!(
        "(camera: (eye: (0, 1, 9), look_at: (0, 0, 0)), materials: {{ \"a\": diffuse(albedo: 0.5) }}, objects: [{tents}
          sphere(name: \"moon\", center: (0, 10, 0), radius: 0.5, material: \"a\"), plane(name: \"sea\", material: \"a\")])"
    );
    std::fs::write(path.join("camp.ron"), scene).unwrap();
    let told = does(path, "info camp.ron").out().to_owned();
    assert!(told.lines().count() < 30, "{told}");
    for expected in [
        "500 × (no name): 3 triangles, 9 vertices, the largest 3 × 6 × 3 m",
        "moon: sphere, 1 × 1 × 1 m",
        "sea: plane, infinite",
        "size          1000 × 10.5 × 3.5 m, from (-0.5, 0, -3) to (999, 10.5, 0.5)",
        "not modelled  nothing that this scene contains",
    ] {
        assert!(told.contains(expected), "expected {expected:?} in:\n{told}");
    }
    let json: serde_json::Value = does(path, "info camp.ron --json").json();
    assert_eq!(json["parts"].as_array().unwrap().len(), 1);
    assert_eq!((json["parts"][0]["count"].as_u64(), json["parts"][0]["triangles"].as_u64()), (Some(500), Some(3)));
    assert_eq!(json["bounds"]["max"], serde_json::json!([999.0, 10.5, 0.5]));
    assert_eq!(json["not_modelled"], serde_json::json!([]));
    // What a file has that is not modelled is what is listed.
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        property float confidence\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
        0 0 0 1\n1 0 0 1\n0 1 0 1\n3 0 1 2\n";
    std::fs::write(path.join("scan.ply"), ply).unwrap();
    let not_modelled = |name: &str| {
        let told = does(path, &format!("info {name}")).out().to_owned();
        told.lines().find(|line| line.trim_start().starts_with("not modelled")).unwrap().to_owned()
    };
    let line = not_modelled("scan.ply");
    assert!(line.contains("confidence") && !line.contains("polarisation"), "{line}");
    let scene = "WorldBegin\nShape \"sphere\"\nShape \"plymesh\" \"string filename\" [\"absent.ply\"]\n";
    std::fs::write(path.join("half.pbrt"), scene).unwrap();
    assert!(not_modelled("half.pbrt").contains("left out"), "{}", not_modelled("half.pbrt"));
}

#[test]
fn a_region_is_told_with_its_own_samples_and_where_it_was_cut() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let line = "render cornell --size 96x64 -o a.png --spp 8";
    let said = does(path, &format!("{line} --region 32,0,40,20")).err;
    assert!(said.contains("8 samples per pixel in the region of 64 x 32 at 32,0, at least 1 elsewhere"), "{said}");
    assert!(!said.contains("warning"), "{said}");
    let told = does(path, &format!("{line} --region 32,0,40,20 --json")).out().to_owned();
    let told: serde_json::Value = serde_json::from_str(&told).unwrap();
    assert_eq!(told["region"], serde_json::json!({ "x": 32, "y": 0, "width": 64, "height": 32, "spp": 8 }));
    let said = does(path, &format!("{line} --region 80,50,40,20")).err;
    assert!(
        said.contains("warning: --region reaches beyond the image of 96 x 64 pixels: it is cut to 80,50,16,14"),
        "{said}"
    );
    assert!(said.contains("a.png: 96 x 64") && said.contains(", replaced the existing a.png"), "{said}");
    let said = does(path, "render cornell --size 8x8 -o one.png --spp 1").err;
    assert!(said.contains("1 sample per pixel in"), "{said}");
}

#[test]
fn a_film_that_needs_nothing_more_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let line = "render cornell --size 16x16 --spp 4 -o a.png --film a.exr";
    assert!(!does(path, line).err.contains("nothing to render"));
    let said = does(path, &format!("{line} --resume")).err;
    assert!(said.contains("nothing to render: the film has reached 4 samples per pixel"), "{said}");
    let said = does(path, "render a.exr --spp 6 -o a.png --resume").err;
    assert!(said.contains("a.png: 16 x 16, 6 samples per pixel") && !said.contains("nothing"), "{said}");
}

#[test]
fn all_missing_scenes_are_named_before_work_begins() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    for line in ["render cornell one.ron ball two.obj --size 8x8 --spp 1 -o .", "info cornell one.ron two.obj"] {
        let outcome = run(path, line);
        let said = &outcome.err;
        assert_eq!((outcome.status, outcome.bytes.len()), (Some(1), 0), "{line}: {said}");
        assert_eq!(
            said, "error: one.ron: cannot be read: no such file\nerror: two.obj: cannot be read: no such file\n",
            "{line}"
        );
    }
    assert_eq!(std::fs::read_dir(path).unwrap().count(), 0, "nothing was rendered");
}

#[test]
fn options_without_effect_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    std::fs::write(path.join("tent.obj"), TENT).unwrap();
    let said = does(path, "info cornell --up z").err;
    assert_eq!(said, "warning: cornell: --up has no effect on a built-in scene\n");
    assert_eq!(does(path, "info tent.obj --up z").err, "");
    assert_eq!(does(path, "info cornell").err, "");
    let moving = "(camera: (eye: (0, 0, 5), look_at: (0, 0, 0)),
        animation: (tracks: [camera(property: vfov, keys: [(0, 30), (2.5, 60)])]))";
    std::fs::write(path.join("moving.ron"), moving).unwrap();
    let said = does(path, "info moving.ron --at 99").err;
    assert_eq!(said, "warning: moving.ron: the animation ends at 2.5 s: 99 s shows its end\n");
    assert_eq!(does(path, "info moving.ron --at 2.5").err, "");
}

#[test]
fn numbers_out_of_range_are_told_their_range() {
    let folder = tempfile::tempdir().unwrap();
    for (line, expected) in [
        ("render cornell --spp 0", "'0' for '--spp <N>': must be between 1 and 2147483648"),
        ("render cornell --threads 5000", "'5000' for '--threads <N>': must be between 1 and 1024"),
        ("render cornell --spp many", "'many' for '--spp <N>': must be a whole number between 1 and 2147483648"),
        ("render cornell --max-depth 0", "'0' for '--max-depth <N>': must be a whole number, at least 1"),
    ] {
        let said = fails(folder.path(), line, 2);
        assert!(said.contains(expected), "{line}: {said}");
    }
}

#[test]
fn save_replaces_a_scene_file_only_when_it_is_told_to() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let by_hand = "( // by hand\n camera: (eye: (0, 0, 5), look_at: (0, 0, 0)))";
    std::fs::write(path.join("room.ron"), by_hand).unwrap();
    let said = fails(path, "save cornell -o room.ron", 1);
    assert!(said.starts_with("error: room.ron: already exists: replace it with --overwrite"), "{said}");
    assert_eq!(std::fs::read_to_string(path.join("room.ron")).unwrap(), by_hand);
    let said = does(path, "save cornell -o room.ron --overwrite").err;
    assert!(said.contains("replaced the existing room.ron") && said.contains("comments of the previous"), "{said}");
    assert!(std::fs::read_to_string(path.join("room.ron")).unwrap().contains("quad("));
}

#[test]
fn a_replay_says_what_it_replayed_and_refuses_a_recording_of_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let header = "(format:1,program:\"firstlight\",scene:Builtin(\"cornell\"),up:None,width:16,height:12,seed:0)";
    let write = |lines: &str| std::fs::write(path.join("a.rec"), format!("{header}\n{lines}")).unwrap();
    write("Do(1,0.1,Pause)\nEnd(3,8)\n");
    let said = fails(path, "--replay a.rec -o a.png", 1);
    assert!(said.contains("a.rec: the recording ends before its scene was open: there is nothing to replay"), "{said}");
    assert!(!path.join("a.png").exists());
    write("Opened(1,1,\"\")\nDo(2,0.5,Orbit(yaw_deg:5.0,pitch_deg:0.0))\nDo(3,0.6,ToggleDepthOfField)\nEnd(9,8)\n");
    let said = does(path, "--replay a.rec -o a.png").err;
    let expected = "a.png: 16 x 12, 8 samples per pixel; replayed 2 commands in 9 frames from a.rec\n";
    assert!(said.ends_with(expected), "{said}");
    assert!(does(path, "--replay a.rec -o a.png").err.ends_with(", replaced the existing a.png\n"));
}

#[test]
fn info_says_which_mesh_is_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let scene =
        "WorldBegin\nLightSource \"infinite\"\nShape \"plymesh\" \"string filename\" \"none.ply\"\nShape \"sphere\"\n";
    std::fs::write(path.join("a.pbrt"), scene).unwrap();
    let said = does(path, "info a.pbrt").out().to_owned();
    assert!(said.contains("none: left out\n") && !said.contains("infinite"), "{said}");
}
