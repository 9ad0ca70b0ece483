//! Time and error of simplification: `cargo bench --bench simplify -- [MODEL.obj]... [--ratio R]`.
//!
//! Without a model, the serpent knot. Each figure is the median of several runs with their range; the error is
//! measured on the result of the last run.

use firstlight::mesh::procedural::{SerpentKnot, serpent_knot};
use firstlight::mesh::simplify::{Method, Target, simplify};
use firstlight::mesh::{Deviation, Mesh, Topology};
use firstlight::scene::obj::{ObjNormals, ObjOptions, load_obj_with};
use std::path::Path;
use std::time::Instant;

fn main() {
    // Cargo itself adds `--bench`.
    let mut args = std::env::args().skip(1).filter(|arg| arg != "--bench");
    let (mut meshes, mut ratio) = (Vec::new(), 0.2);
    while let Some(arg) = args.next() {
        if arg == "--ratio" {
            ratio = args.next().and_then(|text| text.parse().ok()).expect("--ratio needs a number");
        } else {
            let options = ObjOptions { normals: ObjNormals::Ignore, ..ObjOptions::default() };
            let model = load_obj_with(Path::new(&arg), &options).unwrap_or_else(|error| panic!("{error}"));
            meshes.push((arg, model.mesh));
        }
    }
    if meshes.is_empty() {
        meshes.push(("serpent knot".to_owned(), serpent_knot(&SerpentKnot::default())));
    }
    println!("threads: {}", rayon::current_num_threads());
    println!("| mesh | method | triangles | kept | seconds (range) | mean | RMS | Hausdorff | closed |");
    println!("|---|---|---:|---:|---:|---:|---:|---:|---|");
    for (name, mesh) in &meshes {
        for (method, runs) in [(Method::Quadric, 15), (Method::Melax, 3)] {
            row(name, mesh, method, ratio, runs);
        }
    }
}

fn row(name: &str, mesh: &Mesh, method: Method, ratio: f64, runs: usize) {
    let mut seconds = Vec::new();
    let mut result = Mesh::default();
    for _ in 0..runs {
        let start = Instant::now();
        result = simplify(mesh, method, Target::Ratio(ratio)).expect("a sound mesh and ratio");
        seconds.push(start.elapsed().as_secs_f64());
    }
    seconds.sort_unstable_by(f64::total_cmp);
    let deviation = Deviation::between(mesh, &result, 200_000);
    let percent = 100.0 / mesh.bounds().size().as_dvec3().length();
    println!(
        "| {name} | {method:?} | {} | {} | {:.3} ({:.3}–{:.3}) | {:.4} % | {:.4} % | {:.3} % | {} |",
        mesh.triangles.len(),
        result.triangles.len(),
        seconds[runs / 2],
        seconds[0],
        seconds[runs - 1],
        deviation.mean() * percent,
        deviation.rms() * percent,
        deviation.max() * percent,
        if Topology::of(&result).is_closed() { "yes" } else { "no" }
    );
}
