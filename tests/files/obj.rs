//! OBJ files from outside: what real exporters write, and what nobody should.

use firstlight::mesh::{Mesh, Topology};
use firstlight::scene::ReadError;
use firstlight::scene::model::{ImportedModel, ModelNormals, ModelOptions};
use firstlight::scene::obj::{LineProblem, ObjError, load_obj, load_obj_with};
use glam::{DVec3, Vec3, dvec3};
use proptest::prelude::*;
use std::path::{Path, PathBuf};

fn load_bytes(bytes: &[u8]) -> Result<ImportedModel, ObjError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.obj");
    std::fs::write(&path, bytes).unwrap();
    load_obj(&path)
}

fn load_text(text: &str) -> ImportedModel {
    load_bytes(text.as_bytes()).unwrap_or_else(|error| panic!("{error}"))
}

fn file_positions(mesh: &Mesh) -> Vec<DVec3> {
    mesh.positions.iter().map(|p| p.as_dvec3() + mesh.center).collect()
}

/// A model kept beside the project, if it is there.
fn model(name: &str) -> Option<PathBuf> {
    let root = std::env::var_os("FIRSTLIGHT_MODELS")?;
    Some(Path::new(&root).join(name)).filter(|path| path.exists())
}

#[test]
fn all_kinds_of_faces_and_line_ends() {
    let obj = "v 0 0 0 1.0\r\nv 1 0 0\r\nv 1 1 0\r\nv 0 1 0\r\nvt 0 0\r\nvt 1 0\r\nvt 1 1\r\nvn 0 0 1\r\n\
               g one\r\nf 1/1/1 2/2/1 3/3/1\r\ng two\r\nf -4//-1 -2//1 -1//1 # all behind\r\n";
    let model = load_text(obj);
    assert_eq!(model.mesh.triangles.len(), 2);
    assert!(model.normals_from_file);
    assert!(model.mesh.normals.iter().all(|&n| n == Vec3::Z));
    assert_eq!(model.mesh.uvs.len(), model.mesh.positions.len());
    let topology = Topology::of(&model.mesh);
    assert_eq!((topology.vertices, topology.boundary_edges, topology.pieces), (4, 4, 1), "groups stay joined");
}

#[test]
fn concave_polygons_long_lines_and_continuations() {
    let arrow = load_text("v 0 0 0\nv 2 -1 0\nv .5 0 0\nv 2 1 0\nf 2 3 \\\n 4 1\n");
    assert!((arrow.mesh.area() - 0.5).abs() < 1e-6);
    let mut disc = String::new();
    let corners = 900;
    for i in 0..corners {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(i) / f64::from(corners)).sin_cos();
        disc += &format!("v {cos} 0 {}\n", -sin);
    }
    disc += "f";
    (1..=corners).for_each(|i| disc += &format!(" {i}"));
    let mesh = load_text(&disc).mesh;
    assert_eq!(mesh.triangles.len(), 898);
    assert!((mesh.area() - std::f64::consts::PI).abs() < 1e-3);
}

#[test]
fn a_far_model_keeps_its_digits() {
    let write = |at: DVec3| {
        let points = [DVec3::ZERO, dvec3(0.001, 0.0, 0.0), dvec3(0.0, 0.002, 0.0)];
        points.iter().map(|p| format!("v {} {} {}\n", p.x + at.x, p.y + at.y, p.z + at.z)).collect::<String>()
            + "f 1 2 3\n"
    };
    let near = load_text(&write(DVec3::ZERO)).mesh;
    let far = load_text(&write(dvec3(5e6, 4.5e6, -300.0))).mesh;
    for (p, q) in near.positions.iter().zip(&far.positions) {
        // The text itself has numbers spaced 2⁻³⁰ apart out there.
        assert!((p - q).abs().max_element() < 1e-9, "{p} {q}");
    }
    assert_eq!(near.normals, far.normals);
}

#[test]
fn materials_become_slots() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.obj");
    std::fs::write(
        folder.path().join("my materials.mtl"),
        "newmtl red\nKd 1 0 0\nmap_Kd wood.png\nnewmtl b\nKd 0 0 1\n",
    )
    .unwrap();
    let triangle = "f 1 2 3\n";
    let obj = format!(
        "mtllib my materials.mtl\nmtllib gone.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\n{triangle}usemtl red\n{triangle}\
         usemtl nowhere\n{triangle}usemtl red\n{triangle}usemtl unused\n"
    );
    std::fs::write(&path, obj).unwrap();
    let model = load_obj(&path).unwrap();
    assert_eq!(model.mesh.slots, [0, 1, 2, 1]);
    let names: Vec<&str> = model.materials.iter().map(|m| m.name.as_str()).collect();
    assert_eq!(names, ["", "red", "nowhere"]);
    assert_eq!(model.materials[1].diffuse, Some(Vec3::X));
    assert_eq!(model.materials[1].diffuse_texture, Some(folder.path().join("wood.png")));
    assert_eq!(model.materials[2].diffuse, None);
    assert_eq!((model.warnings.len(), model.material_warnings.len()), (0, 2), "{:?}", model.material_warnings);
}

#[test]
fn normals_of_length_zero_count_as_missing() {
    let v = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let zero = load_text(&format!("{v}vn 0 0 0\nf 1//1 2//1 3//1\n"));
    assert!(!zero.normals_from_file);
    assert!(zero.mesh.normals.iter().all(|&n| n == Vec3::Z));
    let mixed = load_text(&format!("{v}vn 0 3 0\nf 1//1 2 3\n"));
    assert_eq!(mixed.mesh.normals, [Vec3::Y, Vec3::Z, Vec3::Z]);
    assert!(!mixed.normals_from_file);
}

#[test]
fn corners_without_texture_coordinates_do_not_shift_the_others() {
    let model = load_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvt .1 .2\nvt .3 .4\nf 1 2/1 3\nf 2/1 4/2 3\n");
    let at = |p: DVec3| file_positions(&model.mesh).iter().position(|&q| q == p).unwrap();
    assert_eq!(model.mesh.uvs[at(dvec3(1.0, 0.0, 0.0))].to_array(), [0.1, 0.2]);
    assert_eq!(model.mesh.uvs[at(dvec3(1.0, 1.0, 0.0))].to_array(), [0.3, 0.4]);
    assert_eq!(model.mesh.uvs[at(DVec3::ZERO)].to_array(), [0.0, 0.0]);
}

#[test]
fn normals_can_be_ignored_so_that_file_vertices_stay_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.obj");
    std::fs::write(
        &path,
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 0 0 1\nvn 1 0 0\nf 1//1 2//1 3//1\nf 1//2 3//2 4//2\n",
    )
    .unwrap();
    let options = ModelOptions { normals: ModelNormals::Ignore, ..ModelOptions::default() };
    let mesh = load_obj_with(&path, &options).unwrap().mesh;
    assert_eq!((mesh.positions.len(), mesh.normals.len()), (4, 0));
    assert_eq!(load_obj(&path).unwrap().mesh.positions.len(), 6);
}

#[test]
fn refusals_name_the_file_the_line_and_what_was_expected() {
    let v = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let message = |text: &str| load_bytes(text.as_bytes()).unwrap_err().to_string();
    let cases = [
        (String::new(), "no faces"),
        (v.to_owned(), "no faces"),
        (format!("{v}f 1 2 4\n"), "model.obj:4: the face uses vertex 4, but the file has 3"),
        (format!("{v}f 1 2 -9\n"), "model.obj:4: the face uses vertex -9, but the file has 3"),
        (format!("{v}f 1/7 2/7 3/7\n"), "model.obj:4: the face uses texture coordinate 7, but the file has 0"),
        (format!("{v}f 1 2\n"), "model.obj:4: the face has 2 corners"),
        (format!("{v}f 1 2 x\n"), "model.obj:4: `x` is not a face corner"),
        (format!("{v}v 1 nan 0\nf 1 2 4\n"), "model.obj:4: `nan` is not a finite number"),
        (format!("{v}\nv 1 1e999 0\nf 1 2 4\n"), "model.obj:5: `1e999` is not a finite number"),
        (format!("{v}v 1 2\nf 1 2 3\n"), "model.obj:4: expected 3 numbers after `v`"),
        (format!("{v}v 1 two 3\nf 1 2 4\n"), "model.obj:4: `two` is not a finite number"),
        (format!("{v}v 1e300 0 0\nf 1 2 4\n"), "more than single precision"),
        (format!("{v}f 1 1 2\n"), "all 1 triangles are degenerate"),
    ];
    for (text, expected) in cases {
        let found = message(&text);
        assert!(found.contains(expected), "`{found}` should say `{expected}`");
    }
    let missing = load_obj(Path::new("no/such/model.obj")).unwrap_err();
    assert!(matches!(missing, ObjError::Read { .. }), "{missing}");
    let folder = load_obj(&std::env::temp_dir()).unwrap_err();
    assert!(matches!(folder, ObjError::Read { source: ReadError::Folder, .. }), "{folder}");
}

#[test]
fn a_file_above_the_limit_is_refused_before_it_is_read() {
    let file = tempfile::NamedTempFile::new().unwrap();
    // A sparse file: a gigabyte that takes no room.
    file.as_file().set_len(2 << 30).unwrap();
    let error = load_obj(file.path()).unwrap_err();
    assert!(matches!(error, ObjError::Read { source: ReadError::TooLong { limit: 0x4000_0000, .. }, .. }), "{error}");
}

#[test]
fn huge_claims_are_refused_at_once() {
    let error = load_bytes(b"v 0 0 0\nf 1 2 1000000000\n").unwrap_err();
    let LineProblem::OutOfRange { index, .. } = (match error {
        ObjError::Line { problem, line: 2, .. } => problem,
        other => panic!("{other}"),
    }) else {
        panic!("another problem")
    };
    assert_eq!(index, 1_000_000_000);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_bytes_give_a_mesh_or_an_error(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        let _ = load_bytes(&bytes);
    }

    #[test]
    fn any_mix_of_plausible_words_gives_a_valid_mesh_or_an_error(
        words in proptest::collection::vec(
            proptest::sample::select(vec![
                "v", "f", "vt", "vn", "usemtl", "mtllib", "g", "o", "l", "s", "\n", "\n", "\n", "\\\n", "#", "1", "2", "-1",
                "0", "1/1", "1//1", "2/1/1", "-1//-1", "1e-300", "1e38", "nan", "-inf", "3", "a b", "\r", "\u{fffd}",
            ]),
            0..200,
        )
    ) {
        let text = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n{}", words.join(" "));
        if let Ok(model) = load_bytes(text.as_bytes()) {
            model.mesh.validate().unwrap();
            prop_assert!(model.mesh.slots.iter().all(|&slot| usize::from(slot) < model.materials.len()));
        }
    }
}

#[test]
fn the_collection_of_real_models_loads_with_its_known_counts() {
    let expected = [
        ("horse.obj", 96_966, 0.34195),
        ("bunny.obj", 70_580, 7.5406e-4),
        ("kitten.obj", 49_912, 95773.0),
        ("armadillo.obj", 46_398, 0.54813),
        ("block.obj", 4_272, 7395.9),
        ("humanoid_tri.obj", 96, 174.96),
        ("cube.obj", 12, 1.0),
    ];
    for (name, faces, volume) in expected {
        let Some(path) = model(name) else { continue };
        let model = load_obj(&path).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(model.mesh.triangles.len(), faces, "{name}");
        assert!(Topology::of(&model.mesh).is_closed(), "{name}");
        assert!((model.mesh.signed_volume() / volume - 1.0).abs() < 2e-5, "{name}: {}", model.mesh.signed_volume());
    }
    for name in ["house.obj", "teapot.obj", "diamond.obj"] {
        let Some(path) = model(name) else { continue };
        let model = load_obj(&path).unwrap_or_else(|error| panic!("{error}"));
        assert!(!model.normals_from_file, "{name}");
        model.mesh.validate().unwrap();
    }
}
