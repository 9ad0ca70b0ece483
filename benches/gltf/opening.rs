//! What it takes to open large files: a million triangles as GLB and as OBJ, and fifty pictures of 4096 x 4096.

use super::files::{Torus, glb, obj, png, torus};
use firstlight::report::cpu_seconds;
use firstlight::scene::model::{ModelFormat, ModelOptions, load_model};
use firstlight::scene::obj::load_obj;
use firstlight::scene::{LoadOptions, SceneSource, load};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::Instant;

const ROUNDS: usize = 5;

/// Squares of the torus: 1,000,000 triangles.
const SQUARES: [u32; 2] = [1000, 500];

pub fn run(folder: Option<&Path>) {
    let temporary = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.unwrap_or(temporary.path());
    std::fs::create_dir_all(folder).expect("a folder for the files");
    let large = torus(SQUARES);
    println!("threads: {}", rayon::current_num_threads());
    println!("| what | wall s | CPU s |\n|---|---:|---:|");

    let triangles = large.triangles.len();
    // Normals ask for tangents, which the file does not have.
    for (name, pictures) in [("million.glb", 2), ("million-normals.glb", 3)] {
        let pictures: Vec<Vec<u8>> = (0..pictures).map(|seed| png(2048, seed, seed == 2)).collect();
        let model = made(folder, name, || glb(&large, &pictures));
        timed("`gltf` and `image` alone", || assert_eq!(alone(&model), triangles));
        timed("geometry alone", || {
            load_model(&model, ModelFormat::Gltf, &ModelOptions::default()).expect("a model");
        });
        opened(&model);
    }
    let text = made(folder, "million.obj", || obj(&large).into_bytes());
    timed("a million triangles, OBJ", || assert_eq!(load_obj(&text).expect("a model").mesh.triangles.len(), triangles));
    opened(&text);
    let pictures = made(folder, "pictures.gltf", || many_pictures(folder, &torus([60, 30])));
    opened(&pictures);
}

/// The file, written if it is not there.
fn made(folder: &Path, name: &str, bytes: impl FnOnce() -> Vec<u8>) -> PathBuf {
    let path = folder.join(name);
    if !path.exists() {
        std::fs::write(&path, bytes()).expect("a file that can be written");
    }
    println!("| `{name}`, {:.0} MB | | |", std::fs::metadata(&path).expect("a file").len() as f64 / 1e6);
    path
}

/// Median of several runs.
fn timed(what: &str, run: impl Fn()) {
    let mut seconds: [Vec<f64>; 2] = Default::default();
    for _ in 0..ROUNDS {
        let (start, before) = (Instant::now(), cpu_seconds());
        run();
        seconds[0].push(start.elapsed().as_secs_f64());
        seconds[1].push(cpu_seconds().zip(before).map_or(f64::NAN, |(after, before)| after - before));
    }
    let [wall, cpu] = seconds.map(|mut times| {
        times.sort_unstable_by(f64::total_cmp);
        times[ROUNDS / 2]
    });
    println!("| {what} | {wall:.3} | {cpu:.3} |");
}

/// What the program does when it opens a file.
fn opened(path: &Path) {
    let source = SceneSource::parse(path).unwrap_or_else(|error| panic!("{error}"));
    let scene = load(&source, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    println!("| `{name}` opened: read and decoded | {:.3} | |", scene.load_seconds);
    println!("| `{name}` opened: trees | {:.3} | |", scene.build_seconds);
    println!("| `{name}` opened: textures in memory, MiB | {} | |", scene.picture_bytes() >> 20);
}

/// Reads all that the file has by the crates `gltf` and `image`, as a viewer would that does nothing else; how many triangles.
fn alone(path: &Path) -> usize {
    let bytes = std::fs::read(path).expect("a file");
    let gltf::Gltf { document, blob } = gltf::Gltf::from_slice(&bytes).expect("a glTF file");
    let blob = blob.expect("a GLB");
    let mut triangles = 0;
    for primitive in document.meshes().flat_map(|mesh| mesh.primitives()) {
        let reader = primitive.reader(|buffer| (buffer.index() == 0).then_some(&blob[..]));
        let positions: Vec<[f32; 3]> = reader.read_positions().expect("positions").collect();
        let normals: Vec<[f32; 3]> = reader.read_normals().expect("normals").collect();
        let uvs: Vec<[f32; 2]> = reader.read_tex_coords(0).expect("texture coordinates").into_f32().collect();
        let indices: Vec<u32> = reader.read_indices().expect("indices").into_u32().collect();
        assert!(positions.len() == normals.len() && normals.len() == uvs.len());
        triangles += indices.len() / 3;
    }
    for picture in document.images() {
        let gltf::image::Source::View { view, .. } = picture.source() else { panic!("a picture in the file") };
        let part = &blob[view.offset()..view.offset() + view.length()];
        assert!(image::load_from_memory(part).expect("a picture").into_rgb8().width() > 0);
    }
    triangles
}

/// A scene of 25 materials with two pictures each, which lie beside it.
fn many_pictures(folder: &Path, small: &Torus) -> Vec<u8> {
    const COUNT: usize = 50;
    let names: Vec<String> = (0..COUNT).map(|i| format!("picture{i}.png")).collect();
    for (seed, name) in names.iter().enumerate() {
        std::fs::write(folder.join(name), png(4096, seed as u32, false)).expect("a file that can be written");
    }
    std::fs::write(folder.join("pictures.glb"), glb(small, &[])).expect("a file that can be written");
    let bytes = std::fs::read(folder.join("pictures.glb")).expect("a file");
    let length = u32::from_le_bytes(bytes[12..16].try_into().expect("four bytes")) as usize;
    let mut document: serde_json::Value = serde_json::from_slice(&bytes[20..20 + length]).expect("JSON");
    let buffer = &bytes[28 + length..];
    std::fs::write(folder.join("pictures.bin"), buffer).expect("a file that can be written");
    document["buffers"] = json!([{ "byteLength": buffer.len(), "uri": "pictures.bin" }]);
    document["images"] = names.iter().map(|name| json!({ "uri": name })).collect();
    document["textures"] = (0..COUNT).map(|i| json!({ "source": i })).collect();
    let material = |i: usize| json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 2 * i } , "metallicRoughnessTexture": { "index": 2 * i + 1 } } });
    document["materials"] = (0..COUNT / 2).map(material).collect();
    let primitive = document["meshes"][0]["primitives"][0].clone();
    let mesh = |i: usize| {
        let mut primitive = primitive.clone();
        primitive["material"] = json!(i);
        json!({ "primitives": [primitive] })
    };
    document["meshes"] = (0..COUNT / 2).map(mesh).collect();
    document["nodes"] =
        (0..COUNT / 2).map(|i| json!({ "mesh": i, "translation": [3 * (i % 5), 0, 3 * (i / 5)] })).collect();
    document["scenes"] = json!([{ "nodes": (0..COUNT / 2).collect::<Vec<_>>() }]);
    serde_json::to_vec(&document).expect("JSON")
}
