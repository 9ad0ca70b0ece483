//! PLY and STL files: every encoding gives the same mesh, and nothing that is wrong gets through.

use firstlight::mesh::{Mesh, Topology};
use firstlight::scene::model::{
    ImportedModel, ModelError, ModelFormat, ModelNormals, ModelOptions, ModelProblem, Place, load_model,
};
use firstlight::scene::ply::PlyProblem;
use firstlight::scene::stl::StlProblem;
use firstlight::scene::{LoadOptions, SceneSource, load};
use glam::{DVec3, Vec2, Vec3, Vec4, dvec3};
use proptest::prelude::*;
use std::path::{Path, PathBuf};

fn read(format: ModelFormat, bytes: &[u8], options: &ModelOptions) -> Result<ImportedModel, ModelError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model");
    std::fs::write(&path, bytes).unwrap();
    load_model(&path, format, options)
}

fn ply(bytes: &[u8]) -> ImportedModel {
    read(ModelFormat::Ply, bytes, &ModelOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn stl(bytes: &[u8]) -> ImportedModel {
    read(ModelFormat::Stl, bytes, &ModelOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// Where, and what.
fn problem(format: ModelFormat, bytes: &[u8]) -> (Place, ModelProblem) {
    match read(format, bytes, &ModelOptions::default()) {
        Err(ModelError::File { place, problem, .. }) => (place, problem),
        other => panic!("{:?}", other.map(|model| model.mesh.triangles)),
    }
}

fn ply_problem(bytes: &[u8]) -> (Place, PlyProblem) {
    match problem(ModelFormat::Ply, bytes) {
        (place, ModelProblem::Ply(problem)) => (place, problem),
        other => panic!("{other:?}"),
    }
}

fn stl_problem(bytes: &[u8]) -> (Place, StlProblem) {
    match problem(ModelFormat::Stl, bytes) {
        (place, ModelProblem::Stl(problem)) => (place, problem),
        other => panic!("{other:?}"),
    }
}

/// A model kept beside the project, if it is there.
fn kept(name: &str) -> Option<PathBuf> {
    let root = std::env::var_os("FIRSTLIGHT_MODELS")?;
    Some(Path::new(&root).join("../gltf/ply_stl").join(name)).filter(|path| path.exists())
}

fn places(mesh: &Mesh) -> Vec<[DVec3; 3]> {
    let place = |vertex: u32| mesh.positions[vertex as usize].as_dvec3() + mesh.center;
    mesh.triangles.iter().map(|triangle| triangle.map(place)).collect()
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Encoding {
    Ascii,
    Little,
    Big,
}

/// A PLY file that is written number by number.
struct Ply {
    encoding: Encoding,
    bytes: Vec<u8>,
}

impl Ply {
    /// - `header`: without its first and last lines.
    fn new(encoding: Encoding, header: &str) -> Self {
        let name = match encoding {
            Encoding::Ascii => "ascii",
            Encoding::Little => "binary_little_endian",
            Encoding::Big => "binary_big_endian",
        };
        let bytes = format!("ply\nformat {name} 1.0\n{header}\nend_header\n").into_bytes();
        Self { encoding, bytes }
    }

    /// A number of a type of the format.
    fn put(&mut self, kind: &str, value: f64) -> &mut Self {
        if self.encoding == Encoding::Ascii {
            self.bytes.extend(format!("{value} ").bytes());
            return self;
        }
        let mut bytes = match kind {
            "char" | "int8" => (value as i8).to_le_bytes().to_vec(),
            "uchar" | "uint8" => (value as u8).to_le_bytes().to_vec(),
            "short" | "int16" => (value as i16).to_le_bytes().to_vec(),
            "ushort" | "uint16" => (value as u16).to_le_bytes().to_vec(),
            "int" | "int32" => (value as i32).to_le_bytes().to_vec(),
            "uint" | "uint32" => (value as u32).to_le_bytes().to_vec(),
            "float" | "float32" => (value as f32).to_le_bytes().to_vec(),
            "double" | "float64" => value.to_le_bytes().to_vec(),
            _ => panic!("{kind}"),
        };
        if self.encoding == Encoding::Big {
            bytes.reverse();
        }
        self.bytes.extend(bytes);
        self
    }

    fn put_all(&mut self, kind: &str, values: &[f64]) -> &mut Self {
        for &value in values {
            self.put(kind, value);
        }
        self
    }

    fn end_row(&mut self) {
        if self.encoding == Encoding::Ascii {
            self.bytes.push(b'\n');
        }
    }
}

const ENCODINGS: [Encoding; 3] = [Encoding::Ascii, Encoding::Little, Encoding::Big];

/// A pyramid over a square, with every property out of order and others between.
fn pyramid(encoding: Encoding, real: &str, index: &str) -> Vec<u8> {
    let header = format!(
        "comment of a test\nobj_info anything at all\nelement camera 1\nproperty list ushort float matrix\nproperty int id\n\
         element vertex 6\nproperty uchar red\nproperty {real} t\nproperty {real} nz\nproperty {real} y\n\
         property short unknown\nproperty list uchar double more\nproperty {real} x\nproperty uchar blue\n\
         property {real} z\nproperty {real} nx\nproperty uchar green\nproperty {real} s\nproperty {real} ny\n\
         element edge 1\nproperty int vertex1\n\
         element face 5\nproperty uchar flags\nproperty list uchar {index} vertex_indices\nproperty float quality"
    );
    let mut file = Ply::new(encoding, &header);
    file.put("ushort", 2.0).put_all("float", &[0.5, -1.0]).put("int", -7.0).end_row();
    // The last vertex is not used, and far away.
    for (i, [x, y, z]) in
        [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.], [0.5, 0.5, 1.], [1e6, 0., 0.]].into_iter().enumerate()
    {
        file.put("uchar", 255.0).put(real, y).put(real, 2.0).put(real, y).put("short", -300.0);
        file.put("uchar", i as f64 % 3.0).put_all("double", &[1e300, 1e-300][..i % 3]);
        file.put(real, x).put("uchar", 0.0).put(real, z).put(real, 0.0).put("uchar", 0.0).put(real, x).put(real, 0.0);
        file.end_row();
    }
    file.put("int", 3.0).end_row();
    for face in [&[3., 2., 1., 0.][..], &[0., 1., 4.], &[1., 2., 4.], &[2., 3., 4.], &[3., 0., 4.]] {
        file.put("uchar", 1.0).put("uchar", face.len() as f64).put_all(index, face).put("float", 0.25).end_row();
    }
    file.bytes
}

#[test]
fn every_encoding_and_type_of_a_ply_file_gives_the_same_mesh() {
    let first = ply(&pyramid(Encoding::Ascii, "float", "int"));
    assert_eq!((first.mesh.triangles.len(), first.mesh.positions.len(), first.polygons), (6, 5, 1));
    assert!(Topology::of(&first.mesh).is_closed() && first.normals_from_file);
    assert!((first.mesh.signed_volume() - 1.0 / 3.0).abs() < 1e-6);
    assert!(first.mesh.normals.iter().all(|&normal| normal == Vec3::Z));
    assert_eq!(first.mesh.uvs, [(0., 0.), (1., 0.), (1., 1.), (0., 1.), (0.5, 0.5)].map(Vec2::from));
    let diffuse = first.materials[0].diffuse;
    assert_eq!((diffuse, first.material_warnings.len()), (Some(Vec3::X), 0), "one colour is a material");
    let warning = &first.warnings[0];
    for name in ["element camera", "element edge", "vertex property unknown", "vertex property more", "face property"] {
        assert!(warning.contains(name), "{warning}");
    }
    for encoding in ENCODINGS {
        for (real, index) in [("float", "uint"), ("double", "uchar"), ("float64", "int16"), ("float32", "char")] {
            let other = ply(&pyramid(encoding, real, index));
            assert_eq!(other.mesh, first.mesh, "{encoding:?} {real} {index}");
            assert_eq!(other.materials, first.materials);
        }
    }
}

#[test]
fn texture_coordinates_and_indices_go_by_all_of_their_names() {
    for [u, v] in [["s", "t"], ["u", "v"], ["texture_u", "texture_v"]] {
        for indices in ["vertex_index", "vertex_indices"] {
            let text = format!(
                "ply\r\nformat ascii 1.0\r\nelement vertex 3\r\nproperty float x\r\nproperty float y\r\n\
                 property float z\r\nproperty float {u}\r\nproperty float {v}\r\nelement face 1\r\n\
                 property list uchar int {indices}\r\nend_header\r\n0 0 0 .25 .5\r\n\r\n1 0 0 1 0\r\n0 1 0 0 1\r\n3 0 1 2"
            );
            assert_eq!(ply(text.as_bytes()).mesh.uvs[0], Vec2::new(0.25, 0.5));
            assert_eq!(ply(text.replace("\r\n", "\r").as_bytes()).mesh.uvs.len(), 3);
        }
    }
}

/// A header for `vertices` and `faces` without anything else, and what follows it.
fn plain(vertices: &str, faces: &str, body: &str) -> Vec<u8> {
    format!(
        "ply\nformat ascii 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {faces}\nproperty list uchar int vertex_indices\nend_header\n{body}"
    )
    .into_bytes()
}

const CORNERS: &str = "0 0 0\n1 0 0\n0 1 0\n";

#[test]
fn faces_before_vertices_polygons_strips_and_short_faces() {
    let text = "ply\nformat ascii 1.0\nelement face 3\nproperty list uchar int vertex_index\n\
                element tristrips 1\nproperty list int int vertex_indices\n\
                element vertex 6\nproperty double x\nproperty double y\nproperty double z\nend_header\n\
                4 0 1 2 3\n2 0 1\n0\n8 0 1 4 5 -1 1 0 4\n0 0 0\n2 -1 0\n.5 0 0\n2 1 0\n0 0 1\n2 -1 1\n";
    let model = ply(text.as_bytes());
    assert_eq!((model.mesh.triangles.len(), model.polygons), (5, 1));
    assert!(model.warnings[0].contains("2 faces have fewer than three corners"), "{:?}", model.warnings);
    // The concave quad is cut along its own diagonal.
    let arrow = places(&model.mesh)[..2].iter().map(|[a, b, c]| 0.5 * (b - a).cross(c - a).z).collect::<Vec<_>>();
    assert!(arrow.iter().all(|area| *area > 0.0) && (arrow.iter().sum::<f64>() - 0.5).abs() < 1e-6, "{arrow:?}");
}

#[test]
fn double_positions_keep_their_digits_far_from_the_origin() {
    let text = "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\n\
                element face 1\nproperty list uchar int vertex_indices\nend_header\n\
                5000000.001 4000000 0\n5000000.002 4000000 0\n5000000.001 4000000.001 0\n3 0 1 2\n";
    let [a, b, _] = places(&ply(text.as_bytes()).mesh)[0];
    assert!(((b - a).x - 0.001).abs() < 1e-9, "{}", (b - a).x);
}

#[test]
fn vertex_colours_that_differ_are_those_of_the_mesh() {
    let of = |kind: &str, [a, b]: [&str; 2]| {
        let text = format!(
            "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
             property {kind} red\nproperty {kind} green\nproperty {kind} blue\nproperty {kind} alpha\n\
             element face 1\nproperty list uchar int vertex_indices\nend_header\n\
             0 0 0 {a}\n1 0 0 {a}\n1 1 0 {b}\n0 1 0 {b}\n4 0 1 2 3\n"
        );
        ply(text.as_bytes())
    };
    let (bytes, floats) = (of("uchar", ["255 0 0 255", "0 0 0 255"]), of("float", ["1 0 0 1", "0 0 0 1"]));
    assert_eq!(bytes.materials, floats.materials);
    assert_eq!(bytes.materials[0].diffuse, Some(Vec3::new(0.5, 0.0, 0.0)));
    assert!(bytes.materials[0].vertex_colors && bytes.material_warnings.is_empty());
    let (red, black) = (Vec4::new(1.0, 0.0, 0.0, 1.0), Vec4::new(0.0, 0.0, 0.0, 1.0));
    assert_eq!(bytes.mesh.colors, [red, red, black, black]);
    assert_eq!(bytes.mesh.colors, floats.mesh.colors);
    assert!(bytes.warnings[0].contains("vertex property alpha"));
    let plain = of("uchar", ["188 188 188 255"; 2]);
    assert!(plain.mesh.colors.is_empty() && !plain.materials[0].vertex_colors);
    let grey = plain.materials[0].diffuse.unwrap();
    assert!((grey - Vec3::splat(0.503)).abs().max_element() < 1e-3, "decoded as sRGB: {grey}");
}

#[test]
fn normals_of_a_file_are_used_ignored_or_completed() {
    let text = |normal: &str| {
        format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
             property float nx\nproperty float ny\nproperty float nz\nelement face 1\n\
             property list uchar int vertex_indices\nend_header\n\
             0 0 0 0 3 4\n1 0 0 0 3 4\n0 1 0 {normal}\n3 0 1 2\n"
        )
    };
    let model = ply(text("0 3 4").as_bytes());
    assert!(
        model.normals_from_file && model.mesh.normals.iter().all(|n| (*n - Vec3::new(0., 0.6, 0.8)).length() < 1e-6)
    );
    for missing in ["0 0 0", "nan 0 1"] {
        let model = ply(text(missing).as_bytes());
        assert_eq!((model.normals_from_file, model.mesh.normals[2]), (false, Vec3::Z));
        assert!((model.mesh.normals[0] - Vec3::new(0., 0.6, 0.8)).length() < 1e-6);
    }
    let of = |normals| {
        let options = ModelOptions { normals, ..ModelOptions::default() };
        read(ModelFormat::Ply, text("0 3 4").as_bytes(), &options).unwrap().mesh.normals
    };
    assert_eq!((of(ModelNormals::Ignore), of(ModelNormals::OfPositions)), (vec![], vec![Vec3::Z; 3]));
}

#[test]
fn doubled_vertices_of_a_seam_are_smoothed_as_one() {
    // Two squares that meet at a right angle along the y axis, whose vertices are stored once a side; at the origin, the
    // second has two triangles.
    let body = "-1 0 0\n0 0 0\n0 1 0\n-1 1 0\n0 0 0\n0 0 -1\n0 1 -1\n0 1 0\n4 0 1 2 3\n4 4 5 6 7\n";
    let options = ModelOptions { normals: ModelNormals::OfPositions, ..ModelOptions::default() };
    let mesh = read(ModelFormat::Ply, &plain("8", "2", body), &options).unwrap().mesh;
    assert_eq!(mesh.normals[1], mesh.normals[4]);
    assert!((mesh.normals[1] - Vec3::new(2., 0., 1.).normalize()).length() < 1e-6);
}

/// What is broken costs only itself, as in OBJ.
#[test]
fn faces_of_ply_that_are_whole_are_shown() {
    let of = |body: &str| read(ModelFormat::Ply, &plain("3", "3", body), &ModelOptions::default()).unwrap();
    for (faces, told) in [
        ("3 0 1 2\n3 0 1 3\n3 0 2 1\n", "uses vertex 3"),
        ("3 0 1 2\n3 0 2 1\n", "the file ends in element `face` 2 of 3"),
        ("3 0 1 2\n3 0 2 1\n3 0 x 1\n", "`x`"),
    ] {
        let model = of(&format!("{CORNERS}{faces}"));
        assert_eq!(model.mesh.triangles.len(), 2, "{faces}");
        assert!(model.warnings.iter().any(|warning| warning.contains(told)), "{:?}", model.warnings);
    }
}

#[test]
fn bad_ply_files_are_refused_with_their_place() {
    let truncated = |element: &str, row, declared| PlyProblem::Truncated { element: element.to_owned(), row, declared };
    let of = |vertices, faces, body: &str| ply_problem(&plain(vertices, faces, body));
    let out = |index: &str| PlyProblem::OutOfRange { element: "face", row: 0, index: index.to_owned(), count: 3 };
    for index in ["3", "-1", "4294967295", "0.5"] {
        assert_eq!(of("3", "1", &format!("{CORNERS}3 0 1 {index}\n")), (Place::Line(13), out(index)));
    }
    for number in ["nan", "inf", "-1e999", "-nan(ind)"] {
        assert_eq!(
            of("3", "1", &format!("0 0 0\n1 {number} 0\n0 1 0\n3 0 1 2\n")),
            (Place::File, PlyProblem::NotFinite { faces: 1 })
        );
    }
    assert_eq!(of("3", "1", CORNERS), (Place::Line(12), truncated("face", 0, 1)));
    let text = "x".to_owned();
    assert_eq!(of("3", "1", "0 0 x\n1 0 0\n0 1 0\n3 0 1 2\n"), (Place::Line(10), PlyProblem::NotNumber { text }));
    for (line, found) in [("3 0 1", 3), ("9 0 1 2", 4)] {
        let numbers = PlyProblem::Numbers { element: "face".to_owned(), row: 0, found };
        assert_eq!(of("3", "1", &format!("{CORNERS}{line}\n")), (Place::Line(13), numbers));
    }
    for length in ["-1", "1.5"] {
        let length_problem = PlyProblem::Length { element: "face".to_owned(), row: 0, length: length.to_owned() };
        assert_eq!(of("3", "1", &format!("{CORNERS}{length} 0 1 2\n")), (Place::Line(13), length_problem));
    }
    assert_eq!(of("3", "0", CORNERS).1, PlyProblem::NoFaces);
    let flat = problem(ModelFormat::Ply, &plain("3", "1", &format!("{CORNERS}3 0 1 1\n"))).1;
    assert!(matches!(flat, ModelProblem::NoArea { triangles: 1 }), "{flat}");
    let line = problem(ModelFormat::Ply, &plain("3", "1", "0 0 0\n1 1 1\n2 2 2\n3 0 1 2\n")).1;
    assert!(matches!(line, ModelProblem::NoArea { triangles: 1 }), "{line}");
    assert_eq!(of("3", "1", &format!("{CORNERS}2 0 1\n")).1, PlyProblem::NoFaces, "all faces were short");
    let huge = problem(ModelFormat::Ply, &plain("3", "1", "0 0 0\n1e300 0 0\n0 1 0\n3 0 1 2\n")).1;
    assert!(matches!(huge, ModelProblem::Mesh(_)), "{huge}");
    let bare = b"ply\nformat ascii 1.0\nelement vertex 3\nelement face 1\nproperty list uchar int vertex_indices\n\
                 end_header\n3 0 1 2\n";
    assert_eq!(ply_problem(bare), (Place::File, PlyProblem::NoPositions));
    assert_eq!(ply_problem(b""), (Place::Line(1), PlyProblem::NotPly));
}

/// None of these takes memory or time that the file does not pay for.
#[test]
fn huge_counts_are_refused_before_anything_is_allocated() {
    for count in ["4000000000", "99999999999", "18446744073709551615"] {
        for encoding in ENCODINGS {
            for element in ["vertex", "face", "other"] {
                let counts = |name: &str| if name == element { count } else { "3" };
                let header = format!(
                    "element other {}\nproperty list uchar float l\nelement vertex {}\nproperty float x\nproperty float y\n\
                     property float z\nelement face {}\nproperty list int int vertex_indices",
                    counts("other"),
                    counts("vertex"),
                    counts("face")
                );
                let mut file = Ply::new(encoding, &header);
                (0..3).for_each(|_| file.put("uchar", 0.0).end_row());
                (0..3).for_each(|i| file.put_all("float", &[i.into(), f64::from(i % 2), 0.0]).end_row());
                (0..3).for_each(|_| file.put("int", 3.0).put_all("int", &[0.0, 1.0, 2.0]).end_row());
                if element == "face" {
                    // Those that are there are shown.
                    let model = ply(&file.bytes);
                    let told = model.warnings.iter().any(|warning| warning.contains("it is truncated"));
                    assert!(told && model.mesh.triangles.len() == 3, "{:?}", model.warnings);
                    continue;
                }
                let (_, found) = ply_problem(&file.bytes);
                let is_refused = matches!(found, PlyProblem::NoRoom { .. } | PlyProblem::TooManyVertices { .. });
                assert!(is_refused, "{encoding:?} {element}: {found}");
            }
        }
    }
    // A list that is as long as no file.
    for encoding in ENCODINGS {
        for (faces, n) in [("face", "vertex_indices"), ("tristrips", "vertex_indices"), ("face", "more")] {
            let header = format!(
                "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement {faces} 1\n\
                 property list uint int {n}\nproperty list uint int vertex_index"
            );
            let mut file = Ply::new(encoding, &header);
            (0..3).for_each(|i| file.put_all("float", &[i.into(), 1.0, 0.0]).end_row());
            file.put("uint", 4_294_967_295.0).put_all("int", &[0.0, 1.0]).end_row();
            let (_, found) = ply_problem(&file.bytes);
            assert!(
                matches!(found, PlyProblem::Truncated { .. } | PlyProblem::Numbers { .. }),
                "{encoding:?}: {found}"
            );
        }
    }
    // Rows without anything in them take no time either.
    let empty = plain("3", "1", &format!("{CORNERS}3 0 1 2\n"));
    let text =
        String::from_utf8(empty).unwrap().replace("element face", "element nothing 18446744073709551615\nelement face");
    assert_eq!(ply(text.as_bytes()).mesh.triangles.len(), 1);
    let stl = [&[0; 80][..], &u32::MAX.to_le_bytes(), &[0; 500]].concat();
    let flat = problem(ModelFormat::Stl, &stl).1;
    assert!(matches!(flat, ModelProblem::NoArea { triangles: 10 }), "{flat}");
}

#[test]
fn a_ply_file_that_is_cut_anywhere_is_told() {
    for encoding in ENCODINGS {
        let whole = pyramid(encoding, "float", "int");
        // Text may lose the end of its last line and still be a number.
        let last = if encoding == Encoding::Ascii { whole.len() - 8 } else { whole.len() };
        for length in 0..last {
            let told = match read(ModelFormat::Ply, &whole[..length], &ModelOptions::default()) {
                Err(_) => true,
                Ok(model) => model.warnings.iter().any(|warning| warning.contains("what comes before is shown")),
            };
            assert!(told, "{encoding:?}: {length} of {} bytes", whole.len());
        }
    }
}

fn tetrahedron() -> [[DVec3; 3]; 4] {
    let [a, b, c, d] = [dvec3(0.1, -0.0, 0.0), dvec3(1.0, 0.0, 0.25), dvec3(0.0, 1.0, 0.0), dvec3(0.0, 0.0, 1.0)];
    [[a, c, b], [a, b, d], [b, c, d], [c, a, d]].map(|corners| corners.map(|corner| corner.as_vec3().as_dvec3()))
}

fn binary_stl(header: &[u8], triangles: &[[DVec3; 3]]) -> Vec<u8> {
    let mut bytes = header.to_vec();
    bytes.resize(80, b' ');
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for corners in triangles {
        let numbers = [DVec3::NAN].iter().chain(corners).flat_map(|place| place.as_vec3().to_array());
        numbers.for_each(|number| bytes.extend(number.to_le_bytes()));
        bytes.extend([0, 0]);
    }
    bytes
}

fn text_stl(triangles: &[[DVec3; 3]]) -> String {
    let mut text = "solid facet of a test\n".to_owned();
    for corners in triangles {
        text += "  facet normal 0 nan 7\n    outer loop\n";
        corners.iter().for_each(|c| text += &format!("      vertex {} {:e} {}\n", c.x, c.y, c.z));
        text += "    endloop\n  endfacet\n";
    }
    text + "endsolid facet of a test\n"
}

#[test]
fn both_encodings_of_an_stl_file_give_the_same_connected_mesh() {
    let first = stl(&binary_stl(b"binary", &tetrahedron()));
    assert_eq!((first.mesh.positions.len() > 4, first.normals_from_file), (true, false), "creases split vertices");
    let topology = Topology::of(&first.mesh);
    assert!(topology.is_closed() && topology.vertices == 4 && first.warnings.is_empty());
    for (found, expected) in places(&first.mesh).iter().zip(tetrahedron()) {
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).length() < 1e-7), "{found:?} {expected:?}");
    }
    let text = text_stl(&tetrahedron());
    let others = [
        binary_stl(b"solid facet", &tetrahedron()),
        binary_stl(b"solid facet\nendsolid\n", &tetrahedron()),
        text.clone().into_bytes(),
        text.replace('\n', "\r\n").into_bytes(),
        text.replace('\n', "\r").into_bytes(),
        text.to_uppercase().replace("NAN", "x").into_bytes(),
        format!("\u{feff}{text}solid\nendsolid").into_bytes(),
        text.replace("\n      ", " ").into_bytes(),
    ];
    for (i, other) in others.iter().enumerate() {
        assert_eq!(stl(other).mesh, first.mesh, "{i}");
    }
    let options = ModelOptions { normals: ModelNormals::Ignore, ..ModelOptions::default() };
    let plain = read(ModelFormat::Stl, text.as_bytes(), &options).unwrap().mesh;
    assert_eq!((plain.positions.len(), plain.normals.len()), (4, 0));
}

#[test]
fn odd_stl_files_are_read_with_a_word_about_it() {
    let mut longer = binary_stl(b"", &tetrahedron());
    longer.extend(b"more");
    assert!(stl(&longer).warnings[0].contains("4 bytes after the last of 4 triangles"));
    let mut coloured = binary_stl(b"", &tetrahedron());
    *coloured.last_mut().unwrap() = 0x80;
    assert!(stl(&coloured).warnings[0].contains("attributes of triangles"));
    // Magics: that of the file, red, and green twice.
    let colours = |header: &[u8], attributes: [u16; 4]| {
        let mut file = binary_stl(header, &tetrahedron());
        for (i, attribute) in attributes.iter().enumerate() {
            file[84 + 50 * i + 48..][..2].copy_from_slice(&attribute.to_le_bytes());
        }
        let model = stl(&file);
        assert_eq!(model.warnings.len(), 0, "{:?}", model.warnings);
        let diffuse: Vec<Vec3> = model.materials.iter().filter_map(|material| material.diffuse).collect();
        (diffuse, model.mesh.slots)
    };
    let blue = b"COLOR=\x00\x00\xff\xff";
    assert_eq!(colours(blue, [0x8000, 0x001f, 0x03e0, 0x03e0]), (vec![Vec3::Z, Vec3::Y, Vec3::X], vec![0, 2, 1, 1]));
    assert_eq!(colours(blue, [0; 4]), (vec![Vec3::Z], Vec::new()));
    assert_eq!(colours(blue, [0x7fff; 4]), (vec![Vec3::ONE], Vec::new()));
    // A material without a name would be none.
    assert_eq!(stl(&binary_stl(blue, &tetrahedron())).materials[0].name, "#0000ff");
    let text = text_stl(&tetrahedron());
    let open = stl(text.strip_suffix("endsolid facet of a test\n").unwrap().as_bytes());
    assert!(open.warnings[0].contains("no `endsolid`"));
    // Two solids, one of a quad.
    let quad = "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nvertex 0 1 0\n\
                endloop\nendfacet\nendsolid\n";
    let two = stl(format!("{quad}{text}").as_bytes());
    assert_eq!((two.mesh.triangles.len(), two.polygons), (6, 1));
    // As viewers accept it: comments, and a facet without a normal.
    let loose = quad.replace(" normal 0 0 1", "");
    let loose = stl(format!("# of a program\n# with solid parts\n{loose}# more\n{text}").as_bytes());
    assert_eq!(loose.mesh.triangles, two.mesh.triangles);
}

#[test]
fn bad_stl_files_are_refused_with_their_place() {
    let whole = binary_stl(b"", &tetrahedron());
    for length in 0..whole.len() {
        if length >= 84 + 50 {
            // What is there is read.
            let cut = stl(&whole[..length]);
            let found = (length - 84) / 50;
            assert_eq!(cut.mesh.triangles.len(), found, "{length}");
            assert!(cut.warnings[0].contains(&format!("its length is that of {found}")), "{:?}", cut.warnings);
            continue;
        }
        let (place, found) = stl_problem(&whole[..length]);
        if length < 84 {
            assert_eq!((place, found), (Place::File, StlProblem::NotStl { bytes: length }));
        } else {
            assert!(matches!(found, StlProblem::Truncated { count: 4, expected: 284, .. }), "{length}: {found}");
        }
    }
    let page = [b"<!doctype html>".as_slice(), &[b' '; 400]].concat();
    assert!(matches!(stl_problem(&page).1, StlProblem::Truncated { bytes: 415, .. }), "a text is no binary file");
    assert_eq!(stl_problem(&binary_stl(b"", &[])), (Place::File, StlProblem::Empty));
    assert_eq!(stl_problem(b"solid nothing\nendsolid nothing\n"), (Place::File, StlProblem::Empty));
    let of = |text: &str| stl_problem(text.as_bytes());
    let (line, found) = of("solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 x\n");
    assert!(line == Place::Line(4) && found.to_string().contains("`x` found"), "{found}");
    for vertices in ["vertex 0 0 0\nvertex 0 1 0", "vertex 0 0 0\nvertex 0 1 0\nvertex 1 0 inf"] {
        let none = format!("solid\nfacet normal 0 0 1\nouter loop\n{vertices}\nendloop\nendfacet\nendsolid\n");
        assert_eq!(of(&none), (Place::File, StlProblem::NotFinite { facets: 1 }));
    }
    assert!(matches!(of("solid a\nv 0 0 0\n"), (Place::Line(2), StlProblem::Word { .. })));
    let text = text_stl(&tetrahedron()[..1]);
    let last = text.find("endfacet").unwrap();
    for end in 0..last {
        assert!(read(ModelFormat::Stl, &text.as_bytes()[..end], &ModelOptions::default()).is_err(), "{end}");
    }
}

#[test]
fn broken_stl_facets_are_left_out() {
    for number in [f64::NAN, f64::INFINITY] {
        let mut bad = tetrahedron();
        bad[2][1].y = number;
        let text = text_stl(&bad);
        for text in [text.clone(), text.replace("NaN", "-nan(ind)"), text.replace("facet normal 0 0 1", "facet normal")]
        {
            for model in [stl(&binary_stl(b"", &bad)), stl(text.as_bytes())] {
                assert_eq!(model.mesh.triangles.len(), 3);
                assert!(model.warnings[0].contains("1 facets have a coordinate"), "{:?}", model.warnings);
            }
        }
    }
    // Programs that do not know the number of triangles when they begin.
    let mut streamed = binary_stl(b"", &tetrahedron());
    for count in [0, 5, u32::MAX] {
        streamed[80..84].copy_from_slice(&count.to_le_bytes());
        let model = stl(&streamed);
        assert_eq!(model.mesh.triangles.len(), 4);
        assert!(model.warnings[0].contains(&format!("declares {count} triangles")), "{:?}", model.warnings);
    }
}

#[test]
fn messages_say_where_what_and_what_was_expected() {
    let folder = tempfile::tempdir().unwrap();
    let says = |name: &str, bytes: &[u8]| {
        std::fs::write(folder.path().join(name), bytes).unwrap();
        let error = load(&SceneSource::Model(folder.path().join(name)), &LoadOptions::default()).unwrap_err();
        error.to_string().replace(&*folder.path().to_string_lossy(), "")
    };
    let index = says("a.ply", &plain("3", "1", &format!("{CORNERS}3 0 1 3\n")));
    assert!(
        index.ends_with("a.ply:13: element `face` 0 uses vertex 3, but the file has 3 (counted from 0)"),
        "{index}"
    );
    let room = says("b.ply", &plain("3000000000", "1", CORNERS));
    assert!(room.contains("b.ply:9: the header declares 3000000000 of element `vertex`, but"), "{room}");
    let short = says("c.STL", &[0; 84 + 49].map(|byte: u8| byte | 1));
    assert!(short.contains("c.STL: at byte 80: declares 16843009 triangles"), "{short}");
    assert!(says("d.ply", b"OFF\n").ends_with("d.ply:1: is not a PLY file: its first line is not `ply`"));
    assert!(says("e.ply", &plain("3", "0", CORNERS)).contains("point clouds are not supported"));
}

#[test]
fn files_that_other_programs_wrote() {
    for (name, triangles, has_normals) in [
        ("teapot_binary_le_colour_normal.ply", 6320, true),
        ("teapot_binary_be.ply", 6320, true),
        ("torus_ascii_quads_uv.ply", 1024, true),
        ("teapot_binary.stl", 6320, false),
        ("teapot_decimated_ascii.stl", 1260, false),
    ] {
        let Some(path) = kept(name) else { continue };
        let format = ModelFormat::of(&path).unwrap();
        let model = load_model(&path, format, &ModelOptions::default()).unwrap_or_else(|error| panic!("{error}"));
        let found = model.mesh.triangles.len();
        assert!(found.abs_diff(triangles) <= triangles / 20, "{name}: {found} triangles");
        assert_eq!(model.normals_from_file, has_normals, "{name}");
        assert_eq!(model.mesh.uvs.is_empty(), !name.starts_with("torus"), "{name}");
        assert_eq!(model.materials[0].diffuse.is_some(), name.contains("colour"), "{name}");
    }
}

/// Vertices on a coarse grid, so that faces share places, and faces of three to six corners.
fn polygons() -> impl Strategy<Value = (Vec<[i8; 3]>, Vec<Vec<u8>>)> {
    (3_usize..20).prop_flat_map(|n| {
        let face = prop::collection::vec(0..n as u8, 3..7);
        (prop::collection::vec(prop::array::uniform3(-4_i8..5), n), prop::collection::vec(face, 1..20))
    })
}

proptest! {
    /// What all encodings of PLY, and OBJ, make of the same polygons is the same, or an error of the same kind.
    #[test]
    fn encodings_agree((vertices, faces) in polygons()) {
        let header = format!(
            "element vertex {}\nproperty float x\nproperty float y\nproperty float z\nelement face {}\n\
             property list uchar ushort vertex_indices", vertices.len(), faces.len()
        );
        let of = |encoding| {
            let mut file = Ply::new(encoding, &header);
            vertices.iter().for_each(|p| file.put_all("float", &p.map(|x| f64::from(x) * 0.125)).end_row());
            for face in &faces {
                let corners: Vec<f64> = face.iter().map(|&vertex| f64::from(vertex)).collect();
                file.put("uchar", corners.len() as f64).put_all("ushort", &corners).end_row();
            }
            read(ModelFormat::Ply, &file.bytes, &ModelOptions::default())
        };
        let mut obj = String::new();
        vertices.iter().for_each(|p| { let [x, y, z] = p.map(|x| f64::from(x) * 0.125); obj += &format!("v {x} {y} {z}\n") });
        for face in &faces {
            obj += "f";
            face.iter().for_each(|vertex| obj += &format!(" {}", u32::from(*vertex) + 1));
            obj += "\n";
        }
        let obj = read(ModelFormat::Obj, obj.as_bytes(), &ModelOptions::default());
        match (of(Encoding::Little), of(Encoding::Big), of(Encoding::Ascii), obj) {
            (Ok(little), Ok(big), Ok(ascii), Ok(obj)) => {
                prop_assert_eq!(&little.mesh, &big.mesh);
                prop_assert_eq!(&little.mesh, &ascii.mesh);
                // Vertices of OBJ come in the order of their use.
                prop_assert_eq!(places(&ascii.mesh), places(&obj.mesh));
                prop_assert_eq!(ascii.polygons, obj.polygons);
            }
            (Err(_), Err(_), Err(_), Err(_)) => {}
            other => prop_assert!(false, "{other:?}"),
        }
    }

    /// The same triangles as text and as bytes.
    #[test]
    fn texts_and_bytes_of_stl_agree((vertices, faces) in polygons()) {
        let place = |vertex: u8| DVec3::from_array(vertices[usize::from(vertex)].map(|x| f64::from(f32::from(x) * 0.1)));
        let triangles: Vec<_> = faces.iter().map(|face| [place(face[0]), place(face[1]), place(face[2])]).collect();
        let binary = read(ModelFormat::Stl, &binary_stl(b"", &triangles), &ModelOptions::default());
        let text = read(ModelFormat::Stl, text_stl(&triangles).as_bytes(), &ModelOptions::default());
        match (binary, text) {
            (Ok(binary), Ok(text)) => prop_assert_eq!(binary.mesh, text.mesh),
            (Err(binary), Err(text)) => prop_assert_eq!(binary.to_string().len(), text.to_string().len()),
            other => prop_assert!(false, "{other:?}"),
        }
    }

    /// Any bytes in the place of any others: an error or a sound mesh.
    #[test]
    fn damaged_files_are_refused_or_sound(
        kind in 0_usize..5, at in 0.0..1.0, bytes in prop::collection::vec(any::<u8>(), 1..6)
    ) {
        let (format, mut file) = match kind {
            0..3 => (ModelFormat::Ply, pyramid(ENCODINGS[kind], "float", "int")),
            3 => (ModelFormat::Stl, binary_stl(b"solid", &tetrahedron())),
            _ => (ModelFormat::Stl, text_stl(&tetrahedron()).into_bytes()),
        };
        let at = (at * (file.len() - bytes.len()) as f64) as usize;
        file[at..at + bytes.len()].copy_from_slice(&bytes);
        match read(format, &file, &ModelOptions::default()) {
            Ok(model) => prop_assert_eq!(model.mesh.validate(), Ok(())),
            Err(error) => prop_assert!(!error.to_string().is_empty()),
        }
    }
}
