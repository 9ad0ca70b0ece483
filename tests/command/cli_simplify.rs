//! `firstlight simplify` from outside: what it writes, what it says, and what it makes of bad input.

use crate::program::{Outcome, does, program};
use firstlight::scene::obj::{ObjExtras, save_obj};
use std::path::Path;

fn simplify(folder: &Path, args: &[&str]) -> Outcome {
    Outcome::of(program(folder).arg("simplify").args(args))
}

/// Runs it with `--json` and reads the report, which is the last line.
fn report(folder: &Path, args: &[&str]) -> serde_json::Value {
    let outcome = simplify(folder, &[args, &["--json"]].concat());
    assert_eq!(outcome.status, Some(0), "{args:?}: {}", outcome.err);
    outcome.json()
}

/// A closed sphere of 8 · 4ⁿ triangles: an octahedron, split and rounded.
fn write_ball(path: &Path, splits: u32) {
    let mut triangles: Vec<[[f64; 3]; 3]> = Vec::new();
    for (x, y, z) in (0..8).map(|i| (f64::from(1 - (i & 2)), f64::from(1 - 2 * (i & 1)), f64::from(1 - (i & 4) / 2))) {
        let corners = [[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]];
        // Outwards, whatever the octant.
        triangles.push(if x * y * z > 0.0 { corners } else { [corners[0], corners[2], corners[1]] });
    }
    let middle = |a: [f64; 3], b: [f64; 3]| {
        let sum: [f64; 3] = std::array::from_fn(|k| a[k] + b[k]);
        let length = sum.iter().map(|v| v * v).sum::<f64>().sqrt();
        sum.map(|v| v / length)
    };
    for _ in 0..splits {
        triangles = triangles
            .iter()
            .flat_map(|&[a, b, c]| {
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    let mut points: Vec<[f64; 3]> = Vec::new();
    let mut numbers = std::collections::HashMap::new();
    let mut faces = String::new();
    for triangle in &triangles {
        faces.push('f');
        for point in triangle {
            // Adding zero makes one zero of both.
            let number = *numbers.entry(point.map(|v| (v + 0.0).to_bits())).or_insert_with(|| {
                points.push(*point);
                points.len()
            });
            faces.push_str(&format!(" {number}"));
        }
        faces.push('\n');
    }
    let vertices: String = points.iter().map(|[x, y, z]| format!("v {x} {y} {z}\n")).collect();
    std::fs::write(path, vertices + &faces).unwrap();
}

/// A strip of squares with texture coordinates and normals.
const STRIP: usize = 24;

fn strip(material: &str) -> String {
    let mut text = format!("mtllib paint.mtl\nusemtl {material}\n");
    for i in 0..=STRIP {
        let x = i as f64 / STRIP as f64;
        text.push_str(&format!("v {x} 0 0\nv {x} 0 -1\nvt {x} 0\nvt {x} 1\n"));
    }
    text.push_str("vn 0 1 0\n");
    for i in 0..STRIP {
        let [a, b, c, d] = [2 * i + 1, 2 * i + 3, 2 * i + 4, 2 * i + 2];
        text.push_str(&format!("f {a}/{a}/1 {b}/{b}/1 {c}/{c}/1\nf {a}/{a}/1 {c}/{c}/1 {d}/{d}/1\n"));
    }
    text
}

#[test]
fn ratio_faces_and_error_end_where_they_say() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    write_ball(&path.join("ball.obj"), 5);
    for method in ["quadric", "melax"] {
        let run = |target: [&str; 2]| {
            report(path, &["ball.obj", "-o", "small.obj", target[0], target[1], "--method", method])
        };
        for (target, most) in [(["--ratio", "0.1"], 819), (["--faces", "500"], 500)] {
            let json = run(target);
            let after = json["faces_after"].as_u64().unwrap();
            assert_eq!(json["faces_before"].as_u64(), Some(8192), "{json}");
            assert!((most - 1..=most).contains(&after), "{method} {target:?}: {after}");
            assert_eq!((json["closed"].as_bool(), json["manifold"].as_bool()), (Some(true), Some(true)), "{json}");
            assert_eq!(json["method"].as_str(), Some(method));
            for way in ["error_forward", "error_backward"] {
                let [mean, rms, max] = ["mean", "rms", "max"].map(|key| json[way][key].as_f64().unwrap());
                assert!(0.0 < mean && mean <= rms && rms <= max && max < 0.1, "{json}");
            }
            // What is written is what was counted.
            let text = std::fs::read_to_string(path.join("small.obj")).unwrap();
            assert_eq!(text.lines().filter(|line| line.starts_with("f ")).count() as u64, after);
        }
        let json = run(["--error", "0.01"]);
        assert!(json["hausdorff"].as_f64().unwrap() <= 0.0101, "{json}");
        assert!(json["faces_after"].as_u64().unwrap() < 4096, "{json}");
    }
}

#[test]
fn texture_coordinates_normals_and_materials_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    std::fs::write(path.join("paint.mtl"), "newmtl red\nKd 1 0 0\n").unwrap();
    std::fs::write(path.join("strip.obj"), strip("red")).unwrap();
    let json = report(path, &["strip.obj", "-o", "out.obj", "--faces", "2"]);
    assert_eq!(json["faces_after"].as_u64(), Some(2), "{json}");
    let text = std::fs::read_to_string(path.join("out.obj")).unwrap();
    let rows = |key: &str| -> Vec<Vec<f64>> {
        let rows = text.lines().filter_map(|line| line.strip_prefix(key));
        rows.map(|row| row.split_whitespace().map(|word| word.parse().unwrap()).collect()).collect()
    };
    assert!(text.contains("mtllib paint.mtl") && text.contains("usemtl red"), "{text}");
    let (places, uvs, normals) = (rows("v "), rows("vt "), rows("vn "));
    assert!(normals.iter().all(|normal| normal == &[0.0, 1.0, 0.0]), "{text}");
    assert_eq!(places.len(), 4, "{text}");
    // The strip is flat and its texture lies straight on it: the four corners keep both.
    for corner in text.lines().filter(|line| line.starts_with("f ")).flat_map(|line| line[2..].split(' ')) {
        let numbers: Vec<usize> = corner.split('/').map(|word| word.parse().unwrap()).collect();
        let (place, uv) = (&places[numbers[0] - 1], &uvs[numbers[1] - 1]);
        assert!((place[0] - uv[0]).abs() < 1e-5 && (-place[2] - uv[1]).abs() < 1e-5, "{place:?} {uv:?}");
    }
}

/// A model of somebody else may name any file as its library.
#[test]
fn a_library_outside_of_the_folder_is_read_only_where_that_is_allowed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    std::fs::create_dir(path.join("in")).unwrap();
    std::fs::write(path.join("paint.mtl"), "newmtl red\nKd 1 0 0\n").unwrap();
    std::fs::write(path.join("in/strip.obj"), strip("red").replace("paint.mtl", "../paint.mtl")).unwrap();
    for (options, is_read) in [(&[][..], false), (&["--allow-outside"], true)] {
        report(path, &[&["in/strip.obj", "-o", "in/out.obj", "--faces", "2"], options].concat());
        let text = std::fs::read_to_string(path.join("in/out.obj")).unwrap();
        assert_eq!([text.contains("paint.mtl"), text.contains("usemtl red")], [is_read; 2], "{text}");
    }
}

/// Colours of vertices need no library, and no material.
#[test]
fn vertex_colours_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    let (model, out) = (folder.path().join("a.obj"), folder.path().join("b.obj"));
    write_ball(&model, 3);
    let plain = std::fs::read_to_string(&model).unwrap();
    let colored = plain.lines().map(|line| match line.strip_prefix("v ") {
        Some(point) => format!("v {point} {}\n", if point.starts_with('-') { "1 0 0" } else { "0 0 1" }),
        None => format!("{line}\n"),
    });
    let colored: String = colored.collect();
    std::fs::write(&model, colored).unwrap();
    let said = simplify(folder.path(), &["a.obj", "-o", "b.obj", "--ratio", "50%"]);
    assert!(said.status == Some(0) && !said.err.contains("warning"), "{}", said.err);
    let text = std::fs::read_to_string(out).unwrap();
    let points: Vec<&str> = text.lines().filter(|line| line.starts_with("v ")).collect();
    assert!(
        points.len() > 50 && points.iter().all(|line| line.ends_with(" 1 0 0") || line.ends_with(" 0 0 1")),
        "{text}"
    );
    assert!(!text.contains("usemtl"));
}

#[test]
fn a_report_for_people_names_faces_seconds_and_errors() {
    let folder = tempfile::tempdir().unwrap();
    write_ball(&folder.path().join("ball.obj"), 3);
    let outcome = simplify(folder.path(), &["ball.obj", "-o", "small.obj", "--ratio", "0.5"]);
    assert_eq!(outcome.status, Some(0), "{}", outcome.err);
    for expected in
        ["512 -> 256 triangles in ", "original to result: mean ", "result to original: mean ", "RMS ", "maximum "]
    {
        assert!(outcome.out().contains(expected), "expected {expected:?} in:\n{}", outcome.out());
    }
}

/// One line that says what is wrong, and no file.
fn assert_refused(folder: &Path, args: &[&str], code: i32, expected: &[&str]) {
    let outcome = simplify(folder, args);
    assert_eq!(outcome.status, Some(code), "{args:?}: {}{}", outcome.out(), outcome.err);
    for words in expected {
        assert!(outcome.err.contains(words), "{args:?}: expected {words:?} in:\n{}", outcome.err);
    }
    assert!(!outcome.err.contains("panicked"), "{}", outcome.err);
    assert!(!folder.join("out.obj").exists(), "{args:?} left a file behind");
}

#[test]
fn targets_that_mean_nothing_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    write_ball(&path.join("ball.obj"), 2);
    let to = ["ball.obj", "-o", "out.obj"];
    for (target, expected) in [
        (&["--ratio", "0"][..], "above 0 and at most 1"),
        (&["--ratio", "1.5"], "above 0 and at most 1"),
        (&["--ratio", "NaN"], "above 0 and at most 1"),
        (&["--faces", "0"], "at least one triangle"),
        (&["--error", "0"], "above 0"),
        (&["--error", "inf"], "above 0"),
        (&[], "--ratio"),
        (&["--ratio", "0.5", "--faces", "3"], "cannot be used with"),
        (&["--ratio", "0.5", "--method", "quadrik"], "quadric"),
    ] {
        assert_refused(path, &[&to, target].concat(), 2, &[expected]);
    }
}

#[test]
fn files_that_hold_nothing_to_simplify_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    for (name, text, expected) in [
        ("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", "points.obj"),
        ("dots.obj", "v 0 0 0\nv 1 0 0\nf 1 1 1\nf 2 2 1\n", "dots.obj"),
        ("same.obj", "v 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3\n", "same.obj"),
        ("wild.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "wild.obj"),
        ("nan.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n", "nan.obj"),
    ] {
        std::fs::write(path.join(name), text).unwrap();
        assert_refused(path, &[name, "-o", "out.obj", "--ratio", "0.5"], 1, &[expected]);
    }
    assert_refused(path, &["none.obj", "-o", "out.obj", "--ratio", "0.5"], 1, &["none.obj"]);
}

#[test]
fn faults_of_a_mesh_are_named_and_survived() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    // Three walls at one edge, one of them twice; a square and a pentagon; a face that uses a vertex twice.
    let text = "v 0 0 0\nv 0 1 0\nv 1 0 0\nv -1 0 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 2 5\nf 2 1 5\n\
        v 5 0 0\nv 6 0 0\nv 6 1 0\nv 5 1 0\nf 6 7 8 9\n\
        v 7 0 0\nv 8 0 0\nv 8.5 1 0\nv 8 2 0\nv 7 2 0\nf 10 11 12 13 14\nf 1 1 2\n";
    std::fs::write(path.join("faulty.obj"), text).unwrap();
    let outcome = simplify(path, &["faulty.obj", "-o", "out.obj", "--ratio", "0.9", "--json"]);
    assert_eq!(outcome.status, Some(0), "{}", outcome.err);
    let json: serde_json::Value = outcome.json();
    // The square is two triangles, the pentagon three; of the walls three stay, and no face uses a vertex twice.
    assert!(json["faces_after"].as_u64().is_some_and(|faces| (3..=8).contains(&faces)), "{json}");
    assert_eq!((json["closed"].as_bool(), json["manifold"].as_bool()), (Some(false), Some(false)), "{json}");
    for expected in [
        "non-manifold edges (three or more triangles)",
        "on the same three places",
        "more than three corners",
        "use a vertex twice",
    ] {
        assert!(outcome.err.contains(expected), "expected {expected:?} in:\n{}", outcome.err);
    }
    // A second run has nothing left to complain of but the walls, which stay as they are.
    let again = simplify(path, &["out.obj", "-o", "again.obj", "--ratio", "0.9"]);
    assert!(again.status == Some(0) && !again.err.contains("same three places"), "{}", again.err);
}

#[test]
fn every_command_counts_the_same_faults_and_what_is_left_out_is_gone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    // Vertex 4 is at the place of vertex 1, vertex 5 on a line with 1 and 2; a triangle and its back lie apart.
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 0\nv 2 0 0\nv 0 0 1\nv 5 0 0\nv 6 0 0\nv 5 1 0\n\
        f 1 2 3\nf 1 2 3\nf 3 2 4\nf 1 1 2\nf 1 4 2\nf 4 1 2\nf 1 2 5\nf 1 2 6\nf 7 8 9\nf 7 9 8\n";
    std::fs::write(path.join("faulty.obj"), text).unwrap();
    let json = report(path, &["faulty.obj", "-o", "out.obj", "--ratio", "1"]);
    // The loader leaves out what names a vertex twice; then two collapsed ones and three duplicates go.
    assert_eq!((json["faces_before"].as_u64(), json["faces_after"].as_u64()), (Some(9), Some(4)), "{json}");
    let said = simplify(path, &["faulty.obj", "-o", "out.obj", "--ratio", "1"]).err;
    let info = does(path, "info faulty.obj");
    let (told, warned) = (info.out(), &info.err);
    for fault in [
        "2 triangles have two corners at one place",
        "3 triangles lie on the same three places as an earlier one",
        "1 triangles have three corners on one line",
    ] {
        assert!(said.contains(fault) && told.contains(fault), "expected {fault:?} in:\n{said}{told}");
    }
    let twice = "1 triangles use a vertex twice and were removed";
    assert!(said.contains(twice) && warned.contains(twice), "{said}{warned}");
    let json: serde_json::Value = serde_json::from_slice(&does(path, "info faulty.obj --json").bytes).unwrap();
    let mesh = json["parts"].as_array().unwrap().iter().find(|part| part["triangles"] == 9).unwrap();
    let counts =
        ["collapsed_triangles", "duplicate_triangles", "flat_triangles"].map(|key| mesh[key].as_u64().unwrap());
    assert_eq!(counts, [2, 3, 1]);
    // Nothing but the flat one is left to complain of.
    let told = does(path, "info out.obj").out().to_owned();
    assert!(told.contains("1 triangles have") && !told.contains("place"), "{told}");
}

#[test]
fn a_closed_mesh_with_a_seam_is_closed_by_the_numbers_of_its_vertices() {
    let folder = tempfile::tempdir().unwrap();
    let (whole, few) = (folder.path().join("ring.obj"), folder.path().join("few.obj"));
    // Texture coordinates end at a seam each way around.
    let mesh = firstlight::mesh::procedural::torus(1.0, 0.4, 48, 32);
    assert!(!mesh.uvs.is_empty());
    save_obj(&whole, &mesh, &ObjExtras::default()).unwrap();
    report(folder.path(), &["ring.obj", "-o", "few.obj", "--ratio", "0.3"]);
    for path in [whole, few] {
        let text = std::fs::read_to_string(&path).unwrap();
        let mut sides = std::collections::HashMap::new();
        for face in text.lines().filter_map(|line| line.strip_prefix("f ")) {
            let places: Vec<u32> =
                face.split(' ').map(|corner| corner.split('/').next().unwrap().parse().unwrap()).collect();
            for k in 0..3 {
                let (a, b) = (places[k], places[(k + 1) % 3]);
                *sides.entry((a.min(b), a.max(b))).or_insert(0) += 1;
            }
        }
        assert!(sides.len() > 100 && sides.values().all(|faces| *faces == 2), "{}", path.display());
    }
}
