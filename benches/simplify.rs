//! Time and error of simplification: `cargo bench -p firstlight-benches --bench simplify -- [MODEL.obj]... [--ratio R]`.
//!
//! Without a model, the serpent knot. Our two methods and meshoptimizer (by the crate `meshopt`) take turns; each
//! figure is the median of several runs with their range, and the error is that of the last run's result. CPU seconds
//! are those of all threads, the median as well.
//!
//! `--other NAME RESULT.obj SECONDS` adds a row for another program's result of the first model: its error is measured
//! here, its time is what it says. `scripts/compare_simplify.sh` does so for `fast-simplification`.

use firstlight::mesh::procedural::{SerpentKnot, serpent_knot};
use firstlight::mesh::simplify::{Method, Target, simplify};
use firstlight::mesh::{Deviation, Mesh, Topology};
use firstlight::report::cpu_seconds;
use firstlight::scene::model::{ModelNormals, ModelOptions};
use firstlight::scene::obj::load_obj_with;
use glam::Vec3;
use meshopt::{SimplifyOptions, VertexDataAdapter};
use std::path::Path;
use std::time::Instant;

fn main() {
    // Cargo itself adds `--bench`.
    let mut args = std::env::args().skip(1).filter(|arg| arg != "--bench");
    let (mut meshes, mut others, mut ratio) = (Vec::new(), Vec::new(), 0.2);
    while let Some(arg) = args.next() {
        let mut next = || args.next().unwrap_or_else(|| panic!("{arg} needs more words behind it"));
        match arg.as_str() {
            "--ratio" => ratio = next().parse().expect("--ratio needs a number"),
            "--other" => others.push((next(), load(&next()), next())),
            _ => meshes.push((arg.clone(), load(&arg))),
        }
    }
    if meshes.is_empty() {
        meshes.push(("serpent knot".to_owned(), serpent_knot(&SerpentKnot::default())));
    }
    println!("threads: {}", rayon::current_num_threads());
    println!("| mesh | method | triangles | kept | seconds (range) | CPU s | mean | RMS | Hausdorff | closed |");
    println!("|---|---|---:|---:|---:|---:|---:|---:|---:|---|");
    for (name, mesh) in &meshes {
        let ways: [(&str, usize, fn(&Mesh, f64) -> Mesh); 3] = [
            ("firstlight, quadric", 15, |mesh, ratio| ours(mesh, Method::Quadric, ratio)),
            ("firstlight, melax", 3, |mesh, ratio| ours(mesh, Method::Melax, ratio)),
            ("meshoptimizer", 15, meshoptimizer),
        ];
        let mut seconds: [Vec<f64>; 3] = Default::default();
        let mut cpu: [Vec<f64>; 3] = Default::default();
        let mut results = [const { None }; 3];
        for run in 0..15 {
            for (k, (_, _, way)) in ways.iter().enumerate().filter(|(_, way)| run < way.1) {
                let (start, before) = (Instant::now(), cpu_seconds());
                let result = way(mesh, ratio);
                seconds[k].push(start.elapsed().as_secs_f64());
                cpu[k].push(cpu_seconds().zip(before).map_or(f64::NAN, |(after, before)| after - before));
                results[k] = Some(result);
            }
        }
        for (k, ((way, ..), result)) in ways.iter().zip(results).enumerate() {
            let (seconds, cpu) = (&mut seconds[k], &mut cpu[k]);
            seconds.sort_unstable_by(f64::total_cmp);
            cpu.sort_unstable_by(f64::total_cmp);
            let (median, least, most) = (seconds[seconds.len() / 2], seconds[0], seconds[seconds.len() - 1]);
            let times = format!("{median:.3} ({least:.3}–{most:.3}) | {:.3}", cpu[cpu.len() / 2]);
            row(name, way, mesh, &result.expect("every way has a run"), &times);
        }
    }
    let (name, mesh) = &meshes[0];
    for (way, result, seconds) in &others {
        row(name, way, mesh, result, &format!("{seconds} | "));
    }
}

fn load(path: &str) -> Mesh {
    let options = ModelOptions { normals: ModelNormals::Ignore, ..ModelOptions::default() };
    load_obj_with(Path::new(path), &options).unwrap_or_else(|error| panic!("{error}")).mesh
}

fn ours(mesh: &Mesh, method: Method, ratio: f64) -> Mesh {
    simplify(mesh, method, Target::Ratio(ratio)).expect("a sound mesh and ratio")
}

/// With no limit on its error, as `fast-simplification` and we have none.
fn meshoptimizer(mesh: &Mesh, ratio: f64) -> Mesh {
    let bytes: &[u8] = bytemuck::cast_slice::<Vec3, u8>(&mesh.positions);
    let vertices = VertexDataAdapter::new(bytes, size_of::<Vec3>(), 0).expect("positions of twelve bytes");
    let wanted = (mesh.triangles.len() as f64 * ratio) as usize * 3;
    let indices = mesh.triangles.as_flattened();
    let left = meshopt::simplify(indices, &vertices, wanted, f32::MAX, SimplifyOptions::None, None);
    let triangles: Vec<[u32; 3]> = left.as_chunks::<3>().0.to_vec();
    Mesh { triangles, positions: mesh.positions.clone(), center: mesh.center, ..Mesh::default() }
}

/// - `times`: wall and CPU seconds, two cells.
fn row(name: &str, way: &str, mesh: &Mesh, result: &Mesh, times: &str) {
    let deviation = Deviation::between(mesh, result, 200_000);
    let percent = 100.0 / mesh.bounds().size().as_dvec3().length();
    println!(
        "| {name} | {way} | {} | {} | {times} | {:.4} % | {:.4} % | {:.3} % | {} |",
        mesh.triangles.len(),
        result.triangles.len(),
        deviation.mean() * percent,
        deviation.rms() * percent,
        deviation.max() * percent,
        if Topology::of(result).is_closed() { "yes" } else { "no" }
    );
}
