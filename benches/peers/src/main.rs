//! The ray kernel beside the crates `obvhs` and `bvh`, on the rays of `benches/kernel`.
//!
//! ```text
//! cargo run --release --manifest-path benches/peers/Cargo.toml -- [FILTER] [--rounds N]
//! ```
//!
//! `FIRSTLIGHT_MODELS` names a folder with OBJ files to use besides the made ones. Times are CPU time of one thread; all
//! engines take turns in every round, and a figure is the median over the rounds. Before anything is timed, every ray
//! is traced by all of them, and where one differs from firstlight, whose answers `benches/kernel` and the tests
//! hold against brute force, that is counted and printed.

#[path = "../../kernel/clock.rs"]
mod clock;
mod engines;
#[path = "../../kernel/meshes.rs"]
mod meshes;
// Made for more than is asked of it here.
#[allow(dead_code)]
#[path = "../../kernel/rays.rs"]
mod rays;

use clock::{cpu_seconds, median};
use engines::{Bvh, Engine, Firstlight, ObvhsBinary, ObvhsWide};
use firstlight::geometry::Ray;
use firstlight::kdtree::{RayBatch, RayClass};
use rays::RaySet;

/// Rays that are handed over at a time, as a wave of the integrator does.
const WAVE: usize = 4096;

fn main() {
    // Builds too run on this thread alone, whose clock is read.
    rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global().unwrap();
    let (mut filter, mut rounds) = (String::new(), 5);
    let mut args = std::env::args().skip(1);
    while let Some(arg) = args.next() {
        match arg.as_str() {
            "--rounds" => rounds = args.next().and_then(|n| n.parse().ok()).expect("--rounds wants a number"),
            _ => filter = arg,
        }
    }
    let mut logarithms: Vec<(&str, [f64; 3], usize)> = Vec::new();
    for mesh in meshes::all(&filter) {
        let own = Firstlight::build(&mesh.positions, &mesh.triangles);
        let peers: [Box<dyn Engine>; 3] = [
            Box::new(ObvhsBinary::build(&mesh.positions, &mesh.triangles)),
            Box::new(ObvhsWide::build(&mesh.positions, &mesh.triangles)),
            Box::new(Bvh::build(&mesh.positions, &mesh.triangles)),
        ];
        print!("{} {} triangles, build: {} {:.3} s", mesh.name, mesh.triangles.len(), own.name(), own.build_seconds());
        peers.iter().for_each(|peer| print!(", {} {:.3} s", peer.name(), peer.build_seconds()));
        println!();
        for set in rays::classes(&own.scene, &mesh) {
            let reference = distances(&own, &set);
            let differ = peers.each_ref().map(|peer| count_differences(&reference, &distances(peer.as_ref(), &set)));
            let mut times: [Vec<f64>; 4] = Default::default();
            for _ in 0..rounds {
                times[0].push(seconds(&own, &set));
                for (times, peer) in times[1..].iter_mut().zip(&peers) {
                    times.push(seconds(peer.as_ref(), &set));
                }
            }
            let ratio = |k: usize| {
                median(&mut times[0].iter().zip(&times[k]).map(|(own, other)| own / other).collect::<Vec<_>>())
            };
            let ratios = [1, 2, 3].map(ratio);
            let nanoseconds = 1e9 * median(&mut times[0].clone()) / set.len() as f64;
            print!("    {:9} {nanoseconds:6.1} ns", set.name);
            for ((peer, ratio), differ) in peers.iter().zip(ratios).zip(differ) {
                print!("   {} x{ratio:.2}, {differ} differ", peer.name());
            }
            println!();
            let logs = ratios.map(f64::ln);
            match logarithms.iter_mut().find(|(name, ..)| *name == set.name) {
                Some((_, sum, n)) => (*sum, *n) = (std::array::from_fn(|k| sum[k] + logs[k]), *n + 1),
                None => logarithms.push((set.name, logs, 1)),
            }
        }
    }
    println!("speed of the others, firstlight being 1, geometric mean over the meshes:");
    for (name, sum, n) in logarithms {
        let [binary, wide, bvh] = sum.map(|sum| (sum / n as f64).exp());
        println!("    {name:9} obvhs Bvh2 {binary:.2}, obvhs CwBvh {wide:.2}, bvh {bvh:.2}");
    }
}

/// CPU seconds for the closest hits of all rays of a set.
fn seconds(engine: &dyn Engine, set: &RaySet) -> f64 {
    let mut found = Vec::with_capacity(WAVE);
    let start = cpu_seconds();
    for wave in &set.waves {
        engine.closest(wave, set.class, &mut found);
        std::hint::black_box(&mut found);
    }
    cpu_seconds() - start
}

fn distances(engine: &dyn Engine, set: &RaySet) -> Vec<f32> {
    let mut found = Vec::with_capacity(WAVE);
    let waves = set.waves.iter().flat_map(|wave| {
        engine.closest(wave, set.class, &mut found);
        found.clone()
    });
    waves.collect()
}

fn count_differences(own: &[f32], other: &[f32]) -> usize {
    let same = |(a, b): (&f32, &f32)| a == b || (a - b).abs() <= 1e-4 * a.abs();
    own.iter().zip(other).filter(|pair| !same(*pair)).count()
}

/// The rays of a batch one by one.
fn each(wave: &RayBatch) -> impl Iterator<Item = Ray> {
    (0..wave.len()).map(|i| wave.get(i))
}
