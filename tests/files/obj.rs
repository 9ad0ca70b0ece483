//! OBJ files from outside: what real exporters write, and what nobody should.

use firstlight::mesh::{Mesh, Topology};
use firstlight::scene::ReadError;
use firstlight::scene::model::{ImportedModel, ModelNormals, ModelOptions};
use firstlight::scene::obj::{ObjError, ObjExtras, load_obj, load_obj_with, save_obj};
use glam::{DVec3, Vec3, Vec4, dvec3};
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
    let wood = model.materials[1].diffuse_texture.as_ref().unwrap();
    assert_eq!(wood.path, folder.path().join("wood.png"));
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

/// As without any normals in the file: the edges of a box are sharp.
#[test]
fn what_has_no_normals_has_creases_beside_faces_that_have_some() {
    let v = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 1 0 -1\nv 1 1 -1\nv 0 2 0\nv 1 2 0\n";
    let model = load_text(&format!("{v}vn 0 0 2\nf 4//1 3//1 8//1 7//1\nf 1 2 3 4\nf 2 5 6 3\n"));
    for corners in &model.mesh.triangles {
        let [a, b, c] = corners.map(|vertex| model.mesh.positions[vertex as usize]);
        for vertex in corners {
            let off = model.mesh.normals[*vertex as usize] - (b - a).cross(c - a).normalize();
            assert!(off.length() < 1e-6, "{off}");
        }
    }
}

#[test]
fn names_may_be_followed_by_comments_or_look_like_them() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.obj");
    let libraries = [("my paint.mtl", "newmtl red\nKd 1 0 0\n"), ("b #2.mtl", "newmtl blue #1\nKd 0 0 1\n")];
    libraries.iter().for_each(|(name, text)| std::fs::write(folder.path().join(name), text).unwrap());
    std::fs::write(folder.path().join("c.mtl"), "newmtl green\nKd 0 1 0\n").unwrap();
    for (obj, wanted) in [
        ("usemtl green\nf 1 2 3\nmtllib none.mtl my paint.mtl c.mtl\nusemtl red\nf 1 2 3\n", [Vec3::Y, Vec3::X]),
        ("mtllib c.mtl my\\ paint.mtl\nusemtl red\nf 1 2 3\nusemtl green\nf 1 2 3\n", [Vec3::X, Vec3::Y]),
    ] {
        std::fs::write(&path, format!("v 0 0 0\nv 1 0 0\nv 0 1 0\n{obj}")).unwrap();
        let materials = load_obj(&path).unwrap().materials;
        assert_eq!(materials.iter().filter_map(|it| it.diffuse).collect::<Vec<_>>(), wanted, "{obj}");
    }
    let obj = "mtllib my paint.mtl # the paint\nmtllib b #2.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\n\
               usemtl red # as blood\nf 1 2 3\nusemtl blue #1\nf 1 2 3\n";
    std::fs::write(&path, obj).unwrap();
    let model = load_obj(&path).unwrap();
    assert_eq!(model.materials.iter().map(|it| it.diffuse).collect::<Vec<_>>(), [Some(Vec3::X), Some(Vec3::Z)]);
    assert!(model.material_warnings.is_empty(), "{:?}", model.material_warnings);
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
fn refusals_name_the_file_and_what_was_expected() {
    let v = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let message = |text: &str| load_bytes(text.as_bytes()).unwrap_err().to_string();
    let cases = [
        (String::new(), "no faces"),
        (v.to_owned(), "no faces"),
        (
            format!("{v}f 1 2 4\n"),
            "no faces (lines starting with `f`) that can be used: 1 faces have a corner that is no",
        ),
        (format!("{v}f 1 2 -9\n"), "vertex of the file and were removed (line 4)"),
        (format!("{v}f 1 2\nf\n"), "that can be used: 2 faces have fewer than three corners and were removed (line 4)"),
        (
            format!("{v}v 1 nan 0\nf 1 2 4\nf 1 x\n"),
            "have a corner that is no vertex of the file and were removed (line 6); ",
        ),
        (
            format!("{v}v 1 1e999 0\nf 1 2 4\n"),
            "1 faces use a position that is not three finite numbers and were removed",
        ),
        (
            format!("{v}l 1 2\np 1\n"),
            "no faces (lines starting with `f`): its 2 line or point elements have no surface",
        ),
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
fn a_broken_part_costs_only_itself_and_is_told_once() {
    let square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvn 0 0 2\n";
    let cases = [
        (
            "f 1//2 2//7 3//9\nf 1 3 4\n",
            Some("3 corners use a normal that the file does not have; it was computed (line 8)"),
        ),
        (
            "f 1/1 2/2 3/5\nf 1/0 3 4\n",
            Some("2 corners use a texture coordinate that the file does not have; it is (0, 0)"),
        ),
        ("f 1 2\nf\nf 1 2 3 4\nf 3\n", Some("3 faces have fewer than three corners and were removed (line 8)")),
        (
            "f 1 2 3 4\nf 1 2 9\nf x 1 2\nf 1 0 2\n",
            Some("3 faces have a corner that is no vertex of the file and were"),
        ),
        (
            "vn 1 2\nf 1//2 2//2 3//1\nf 1 3 4\n",
            Some("1 normals are not three finite numbers and were computed (line 8)"),
        ),
        ("vn -nan(ind) 0 1\nf 1//2 2//2 3//1\nf 1 3 4\n", Some("1 normals are not three finite numbers")),
        (
            "vt 0 1.#INF\nf 1/3 2 3\nf 1 3 4\n",
            Some("1 texture coordinates are not finite numbers and are (0, 0) (line 8)"),
        ),
        ("v nan 0 0\nf 1 2 3\nf 1 3 4\n", None),
        (
            "v nan 0 0\nf 1 2 3\nf 1 3 4\nf 1 2 5\nf 5 2 1\n",
            Some("2 faces use a position that is not three finite numbers"),
        ),
    ];
    for (lines, warning) in cases {
        let model = load_text(&format!("{square}{lines}"));
        assert_eq!(model.mesh.triangles.len(), 2, "{lines}");
        model.mesh.validate().unwrap();
        assert!(model.mesh.normals.iter().all(|&normal| normal == Vec3::Z), "{lines}: {:?}", model.mesh.normals);
        assert_eq!(model.warnings.len(), usize::from(warning.is_some()), "{lines}: {:?}", model.warnings);
        assert!(warning.is_none_or(|warning| model.warnings[0].contains(warning)), "{lines}: {:?}", model.warnings);
    }
}

#[test]
fn utf_16_is_read() {
    let text = "\u{feff}v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl größe\nf 1 2 3\n";
    let bytes = |to: fn(u16) -> [u8; 2]| text.encode_utf16().flat_map(to).collect::<Vec<u8>>();
    for bytes in [bytes(u16::to_le_bytes), bytes(u16::to_be_bytes)] {
        let model = load_bytes(&bytes).unwrap();
        assert_eq!((model.mesh.triangles.len(), &*model.materials[0].name), (1, "größe"));
        let error = load_bytes(&bytes[2..]).unwrap_err().to_string();
        assert!(error.contains("UTF-16 without a byte order mark"), "{error}");
    }
}

#[test]
fn vertex_colours_replace_diffuse_colours_but_not_textures() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.obj");
    std::fs::write(folder.path().join("m.mtl"), "newmtl a\nKd 1 1 1\nmap_Kd a.png\nnewmtl b\nKd 0 1 0\n").unwrap();
    let image = folder.path().join("a.png");
    std::fs::write(&image, "").unwrap();
    let v = "mtllib m.mtl\nv 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 0 0 1\n";
    let load = |faces: &str| {
        std::fs::write(&path, format!("{v}{faces}")).unwrap();
        load_obj(&path).unwrap()
    };
    let both = load("usemtl a\nf 1 2 3\nusemtl b\nf 1 2 3\n");
    assert_eq!(both.mesh.colors, [Vec4::new(1., 0., 0., 1.), Vec4::new(1., 0., 0., 1.), Vec4::new(0., 0., 1., 1.)]);
    assert_eq!([both.materials[0].vertex_colors, both.materials[1].vertex_colors], [false, true]);
    assert!(load("usemtl a\nf 1 2 3\n").mesh.colors.is_empty());
    // Where the texture is missing, they are all that there is.
    std::fs::remove_file(&image).unwrap();
    let without = load("usemtl a\nf 1 2 3\n");
    assert!(without.materials[0].vertex_colors && without.material_warnings.iter().any(|it| it.contains("a.png")));
    let unnamed = load("vn 0 0 1\nf 1//1 2//1 3//1\n");
    assert_eq!((&*unnamed.materials[0].name, unnamed.mesh.colors.len()), ("vertex colors", 3));
    let mut dark = unnamed.mesh.clone();
    dark.colors[0] = Vec4::new(0.25, 0.5, 0.0, 1.0);
    save_obj(&path, &dark, &ObjExtras::default()).unwrap();
    let again = load_obj(&path).unwrap().mesh;
    assert!(again.colors.iter().zip(&dark.colors).all(|(a, b)| a.abs_diff_eq(*b, 4e-3)), "{:?}", again.colors);
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
    let error = load_bytes(b"v 0 0 0\nf 1 2 1000000000\n").unwrap_err().to_string();
    assert!(error.contains("1 faces have a corner that is no vertex of the file and were removed (line 2)"), "{error}");
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
