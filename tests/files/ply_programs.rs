//! PLY files as programs write them: textures, values of corners and faces, and what is not quite of the format.

use firstlight::mesh::Mesh;
use firstlight::scene::model::{ImportedModel, ModelFormat, ModelOptions, load_model};
use firstlight::scene::{LoadOptions, SceneSource, load};
use glam::{DVec3, Vec2, Vec3, Vec4};
use std::path::Path;

/// A square of four vertices and two triangles, in text.
///
/// - `head`: lines of the header before the elements; `vertex` and `face`: further properties; `values`: what follows
///   the position of each vertex, and the indices of each face.
fn square(head: &str, [vertex, face]: [&str; 2], values: &[&str; 6]) -> String {
    let mut text = format!(
        "ply\nformat ascii 1.0\n{head}element vertex 4\nproperty float x\nproperty float y\nproperty float z\n{vertex}\
         element face 2\nproperty list uchar int vertex_indices\n{face}end_header\n"
    );
    let rows = ["0 0 0", "1 0 0", "1 1 0", "0 1 0", "3 0 1 2", "3 0 2 3"];
    for (row, value) in rows.iter().zip(values) {
        text += &format!("{row} {value}\n");
    }
    text
}

const ST: &str = "property float s\nproperty float t\n";
const CORNER: &str = "property list uchar float texcoord\n";
const CORNERS: [&str; 6] = ["", "", "", "", "6 0 0 1 0 1 1", "6 0.5 0 1 1 0 1"];

fn read(folder: &Path, text: &str) -> ImportedModel {
    let path = folder.join("model.ply");
    std::fs::write(&path, text).unwrap();
    load_model(&path, ModelFormat::Ply, &ModelOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// Position and texture coordinates of all corners.
fn corners(mesh: &Mesh) -> Vec<(DVec3, Vec2)> {
    let of = |v: &u32| (mesh.positions[*v as usize].as_dvec3() + mesh.center, mesh.uvs[*v as usize]);
    mesh.triangles.iter().flatten().map(of).collect()
}

/// A folder with two images.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for name in ["red 1.png", "b.png"] {
        image::RgbImage::from_pixel(2, 2, image::Rgb([255, 0, 0])).save(folder.path().join(name)).unwrap();
    }
    folder
}

#[test]
fn a_texture_that_a_comment_names_is_the_material() {
    let folder = folder();
    for name in ["red 1.png", " red 1.png ", "..\\other\\red 1.png", "/nowhere/red 1.png"] {
        let text = square(&format!("comment TextureFile {name}\n"), [ST, ""], &["0 0", "1 0", "1 1", "0 1", "", ""]);
        let model = read(folder.path(), &text);
        let image = &model.materials[0].diffuse_texture.as_ref().unwrap().path;
        assert_eq!(*image, folder.path().join("red 1.png"), "{name}");
        assert_eq!((model.mesh.uvs[2], model.materials.len()), (Vec2::ONE, 1));
        assert!(model.warnings.is_empty() && model.material_warnings.is_empty(), "{:?}", model.warnings);
        let scene = load(&SceneSource::Model(folder.path().join("model.ply")), &LoadOptions::default());
        assert!(scene.is_ok(), "{:?}", scene.err());
    }
    // The name of the file itself, as MeshLab writes it.
    std::fs::copy(folder.path().join("b.png"), folder.path().join("model_A.png")).unwrap();
    let text = square("comment TextureFile <this>_A.png\n", [ST, ""], &["0 0", "1 0", "1 1", "0 1", "", ""]);
    let model = read(folder.path(), &text);
    assert_eq!(model.materials[0].diffuse_texture.as_ref().unwrap().path, folder.path().join("model_A.png"));
    // Not what lies outside of the folder of the model.
    let inner = folder.path().join("inner");
    std::fs::create_dir(&inner).unwrap();
    let outside = square("comment TextureFile ../b.png\n", [ST, ""], &["0 0", "1 0", "1 1", "0 1", "", ""]);
    let model = read(&inner, &outside);
    assert_eq!(model.materials[0].diffuse_texture, None);
    assert!(model.material_warnings.iter().any(|warning| warning.contains("--allow-outside")));
    let missing = square("comment TextureFile no.png\n", [ST, ""], &["0 0", "1 0", "1 1", "0 1", "", ""]);
    let model = read(folder.path(), &missing);
    assert!(model.materials[0].diffuse_texture.is_none() && model.material_warnings[0].contains("no.png"));
    let bare = read(folder.path(), &square("comment TextureFile b.png\n", ["", ""], &[""; 6]));
    assert!(bare.material_warnings[0].contains("no texture coordinates"), "{:?}", bare.material_warnings);
}

#[test]
fn corners_of_faces_have_texture_coordinates_of_their_own() {
    let folder = folder();
    let model = read(folder.path(), &square("comment TextureFile b.png\n", ["", CORNER], &CORNERS));
    // Two vertices are split: those on the diagonal whose coordinates differ.
    assert_eq!(model.mesh.positions.len(), 5);
    let uvs = [(0., 0.), (1., 0.), (1., 1.), (0.5, 0.), (1., 1.), (0., 1.)].map(Vec2::from);
    let places = [(0., 0.), (1., 0.), (1., 1.), (0., 0.), (1., 1.), (0., 1.)].map(|(x, y)| DVec3::new(x, y, 0.));
    assert_eq!(corners(&model.mesh), places.into_iter().zip(uvs).collect::<Vec<_>>());
    assert!(model.warnings.is_empty(), "{:?}", model.warnings);
    let mut values = CORNERS;
    values[4] = "0";
    values[5] = "6 0.5 0 nan 1 0 1";
    let holes = read(folder.path(), &square("", ["", CORNER], &values));
    assert!(holes.warnings[0].contains("4 texture coordinates are missing"), "{:?}", holes.warnings);
    assert_eq!(corners(&holes.mesh)[3].1, Vec2::new(0.5, 0.0));
}

#[test]
fn faces_choose_among_textures() {
    let folder = folder();
    let head = "comment TextureFile red 1.png\ncomment TextureFile b.png\n";
    let face = format!("{CORNER}property int texnumber\n");
    let of = |numbers: [i32; 2]| {
        let mut values = CORNERS.map(str::to_owned);
        values.iter_mut().skip(4).zip(numbers).for_each(|(value, number)| *value += &format!(" {number}"));
        let model = read(folder.path(), &square(head, ["", &face], &values.each_ref().map(String::as_str)));
        let names: Vec<String> = model.materials.iter().map(|material| material.name.clone()).collect();
        (names, model.mesh.slots)
    };
    assert_eq!(of([1, 0]), (vec!["b.png".to_owned(), "red 1.png".to_owned()], vec![0, 1]));
    assert_eq!(of([1, 1]), (vec!["b.png".to_owned()], vec![]));
    assert_eq!(of([0, -1]), (vec!["red 1.png".to_owned(), String::new()], vec![0, 1]));
    assert_eq!(of([7, -1]), (vec![String::new()], vec![]));
}

#[test]
fn colours_of_faces_are_those_of_their_corners() {
    let folder = folder();
    let colours = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    let of = |a: &str, b: &str| read(folder.path(), &square("", ["", colours], &["", "", "", "", a, b]));
    let one = of("255 0 0", "255 0 0");
    assert_eq!((one.materials[0].diffuse, one.materials[0].vertex_colors), (Some(Vec3::X), false));
    assert_eq!((one.mesh.positions.len(), one.mesh.colors.len()), (4, 0));
    let two = of("255 0 0", "0 0 255");
    assert_eq!((two.mesh.positions.len(), two.materials[0].vertex_colors), (6, true));
    let (red, blue) = (Vec4::new(1., 0., 0., 1.), Vec4::new(0., 0., 1., 1.));
    let found: Vec<Vec4> = two.mesh.triangles.iter().flatten().map(|&v| two.mesh.colors[v as usize]).collect();
    assert_eq!(found, [red, red, red, blue, blue, blue]);
    assert!(two.mesh.normals.iter().all(|&normal| normal == Vec3::Z));
    // Colours of vertices say more.
    let both = square("", [colours, colours], &["0 255 0", "0 255 0", "0 255 0", "0 255 0", "255 0 0", "0 0 255"]);
    let both = read(folder.path(), &both);
    assert_eq!(both.materials[0].diffuse, Some(Vec3::Y));
    assert!(both.warnings[0].contains("face property red"), "{:?}", both.warnings);
}

#[test]
fn what_is_broken_costs_only_itself() {
    let folder = folder();
    let unused =
        square("", ["", ""], &[""; 6]).replace("vertex 4", "vertex 5").replace("3 0 1 2 ", "nan nan nan\n3 0 1 2 ");
    let model = read(folder.path(), &unused);
    assert_eq!((model.mesh.triangles.len(), model.warnings.len()), (2, 0), "{:?}", model.warnings);
    for number in ["-nan(ind)", "1.#QNAN", "inf"] {
        let used = square("", ["", ""], &[""; 6]).replace("0 1 0 \n", &format!("0 {number} 0\n"));
        let model = read(folder.path(), &used);
        assert_eq!(model.mesh.triangles.len(), 1);
        assert!(model.warnings[0].contains("1 faces use a vertex whose position is not finite"), "{number}");
    }
    let long = read(folder.path(), &square("", ["", ""], &["", "", "", "", "9 1 1", ""]));
    assert_eq!(long.mesh.triangles.len(), 2);
    assert!(long.warnings[0].contains("1 lines have more numbers"), "{:?}", long.warnings);
    let head = "Created by a program - www.example.org\nsource file: a.blend\n";
    let titled = read(folder.path(), &square(head, ["", ""], &[""; 6]));
    assert!(titled.warnings[0].contains("2 lines of the header are not of the format"), "{:?}", titled.warnings);
}

#[test]
fn strips_beside_faces_keep_values_apart() {
    let folder = folder();
    let text = square("comment TextureFile b.png\n", ["", CORNER], &CORNERS);
    let strip = "element tristrips 1\nproperty list int int vertex_indices\n";
    let after = text.replace("end_header", &format!("{strip}end_header")) + "3 0 1 3\n";
    let (head, body) = text.split_once("element face").unwrap();
    let before = format!("{head}{strip}element face{body}").replace("3 0 1 2 ", "3 0 1 3\n3 0 1 2 ");
    for (text, first) in [(after, 0), (before, 3)] {
        let found = corners(&read(folder.path(), &text).mesh);
        assert_eq!((found.len(), found[first + 3].1), (9, Vec2::new(0.5, 0.0)));
        assert_eq!(found[(first + 6) % 9 + 1].1, Vec2::ZERO);
    }
}
