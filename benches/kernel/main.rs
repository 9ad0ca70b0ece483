//! How fast the ray kernel is, and how fast others are on the same rays.
//!
//! ```text
//! cargo bench -p firstlight-benches --bench kernel -- [FILTER] [--class NAME] [--size N] [--rounds N] [--isa avx2] [--quick]
//!     [--small] [--crowd] [--rooms]
//! ```
//!
//! - `FIRSTLIGHT_MODELS`: a folder with OBJ files to use besides the made ones.
//! - `FIRSTLIGHT_EMBREE`: a libembree4 shared object to compare with (see `scripts/compare_embree.sh`).
//! - `--rooms`: rooms of many meshes, in separate trees, in one, and in Embree; `FIRSTLIGHT_ROOMS` adds scene files.
//! - `--isa avx2`: uses AVX2 where there is AVX-512, and Embree does too.
//! - `FIRSTLIGHT_EMBREE_ROBUST`: if set, Embree builds its scenes with the robust flag.
//!
//! Times are CPU time of one thread (but for building on all threads: that is time on the wall), engines take turns in every round, and the figure is the median over the rounds
//! of the ratio in the same round: the machine may be busy and its clock may wander. Before anything is timed,
//! every hit is checked: against the plain traversal for all rays, bit for bit, and against trying every
//! triangle for some.

mod clock;
mod crowd;
#[cfg(unix)]
mod embree;
mod meshes;
mod rays;
mod rooms;
mod small;

use clock::{cpu_seconds, median};
use firstlight::kdtree::{BuildPreset, HitBatch, HitSpace, InstructionSet, MeshTree, RayBatch, SceneTree, Shape};
use glam::Affine3A;
use rays::RaySet;
use std::sync::Arc;
use std::time::Instant;

/// Rays that are handed over at a time, as a wave of the integrator does.
const WAVE: usize = 4096;

struct Options {
    filter: String,
    /// Of rays; empty for all of them.
    class: String,
    /// Width and height of the picture that the rays belong to.
    size: u32,
    rounds: usize,
    preset: BuildPreset,
}

fn main() {
    let mut options =
        Options { filter: String::new(), class: String::new(), size: 384, rounds: 7, preset: BuildPreset::Best };
    let (mut only_small, mut only_crowd, mut only_rooms) = (false, false, false);
    // A part of Embree's device configuration.
    let mut isa = "";
    // Builds too run on this thread alone, whose clock is read.
    rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global().unwrap();
    let mut args = std::env::args().skip(1);
    while let Some(arg) = args.next() {
        match arg.as_str() {
            "--bench" => {}
            "--quick" => options.preset = BuildPreset::Quick,
            "--median" => options.preset = BuildPreset::Median,
            "--small" => only_small = true,
            "--crowd" => only_crowd = true,
            "--rooms" => only_rooms = true,
            "--class" => options.class = args.next().expect("--class wants a name"),
            "--size" => {
                let size: u32 = args.next().and_then(|n| n.parse().ok()).expect("--size wants a number of pixels");
                options.size = u32::max(size / 8 * 8, 8);
            }
            "--rounds" => options.rounds = args.next().and_then(|n| n.parse().ok()).expect("--rounds wants a number"),
            "--isa" => {
                assert_eq!(args.next().as_deref(), Some("avx2"), "--isa wants avx2");
                assert!(InstructionSet::Avx2.set_default(), "this processor has no AVX2");
                isa = ",isa=avx2";
            }
            filter => options.filter = filter.to_string(),
        }
    }
    if only_crowd {
        crowd::run(options.rounds);
        return;
    }
    if only_small || options.filter.is_empty() && !only_rooms {
        small::run(options.rounds);
    }
    if only_small {
        return;
    }
    #[cfg(unix)]
    let embree = std::env::var("FIRSTLIGHT_EMBREE").ok().map(|path| embree::Embree::open(&path, isa).unwrap());
    #[cfg(unix)]
    if embree.is_some() {
        println!("figures in ns a ray (x: how many times faster than Embree, one ray at a time)");
    }
    if only_rooms {
        #[cfg(unix)]
        rooms::run(&options.filter, options.rounds, options.size, embree.as_ref());
        #[cfg(not(unix))]
        rooms::run(&options.filter, options.rounds, options.size);
        return;
    }
    let all = rayon::ThreadPoolBuilder::new().build().expect("threads");
    let mut totals: Vec<Total> = Vec::new();
    for mesh in meshes::all(&options.filter) {
        let (mut build, mut build_on_all) = (Vec::new(), Vec::new());
        let mut tree = None;
        for _ in 0..3 {
            let make = || MeshTree::build(&mesh.positions, &mesh.triangles, options.preset);
            let start = cpu_seconds();
            tree = Some(make());
            build.push(cpu_seconds() - start);
            let start = Instant::now();
            let same = all.install(make);
            build_on_all.push(start.elapsed().as_secs_f64());
            assert!(tree.as_ref() == Some(&same), "{}: another tree on several threads", mesh.name);
        }
        let tree = Arc::new(tree.unwrap());
        let stats = tree.stats();
        print!(
            "{:10} {:7} tri  build {:.3} s, on {} threads {:.3} s  {:.1} MB  {:.2} refs/tri  depth {} ",
            mesh.name,
            mesh.triangles.len(),
            median(&mut build),
            all.current_num_threads(),
            median(&mut build_on_all),
            stats.bytes as f64 / 1e6,
            stats.references_per_primitive(),
            stats.depth
        );
        #[cfg(unix)]
        let rival = embree.as_ref().map(|embree| {
            let start = cpu_seconds();
            let scene = embree.scene(&mesh.positions, &mesh.triangles);
            print!(" embree {:.3} s {:.1} MB", cpu_seconds() - start, scene.bytes() as f64 / 1e6);
            scene
        });
        println!();
        let scene = SceneTree::build(vec![Shape::Mesh {
            tree: tree.clone(),
            world_from_object: Affine3A::IDENTITY,
            space: HitSpace::Object,
        }]);
        for set in rays::classes(&scene, &mesh, options.size) {
            if !options.class.is_empty() && options.class != set.name {
                continue;
            }
            check(&scene, &set);
            let mut hits = HitBatch::default();
            let mut occluded = Vec::new();
            #[cfg(unix)]
            let prepared = rival.as_ref().map(|rival| rival.prepare(&set));
            let (mut own, mut any, mut theirs, mut their_any, mut packets) = (vec![], vec![], vec![], vec![], vec![]);
            for _ in 0..options.rounds {
                let per_ray = |seconds: f64| 1e9 * seconds / set.len() as f64;
                let start = cpu_seconds();
                for wave in &set.waves {
                    scene.closest_hits(wave, set.class, &mut hits);
                    std::hint::black_box(&mut hits);
                }
                own.push(per_ray(cpu_seconds() - start));
                let start = cpu_seconds();
                for wave in &set.waves {
                    scene.any_hits(wave, set.class, &mut occluded);
                    std::hint::black_box(&mut occluded);
                }
                any.push(per_ray(cpu_seconds() - start));
                #[cfg(unix)]
                if let (Some(rival), Some(prepared)) = (&rival, &prepared) {
                    theirs.push(per_ray(rival.trace(prepared)));
                    their_any.push(per_ray(rival.trace_any(prepared)));
                    packets.push(per_ray(rival.trace_packets(prepared)));
                }
            }
            let ratio_of = |theirs: &[f64], own: &[f64]| {
                median(&mut theirs.iter().zip(own).map(|(theirs, own)| theirs / own).collect::<Vec<_>>())
            };
            let (ratio, any_ratio) = (ratio_of(&theirs, &own), ratio_of(&their_any, &any));
            let packet_ratio = ratio_of(&theirs, &packets);
            let visits = mean_visits(&tree, &set);
            print!(
                "    {:9} [{:4.1} {:4.2} {:4.2}] closest {:6.1}  any {:6.1}",
                set.name,
                visits[0],
                visits[1],
                visits[2],
                median(&mut own),
                median(&mut any)
            );
            if !theirs.is_empty() {
                print!(
                    "   x{ratio:.2}, any x{any_ratio:.2}   embree {:6.1}, any {:6.1}, packet 16 {:6.1} (x{packet_ratio:.2})",
                    median(&mut theirs),
                    median(&mut their_any),
                    median(&mut packets)
                );
                #[cfg(unix)]
                if let (Some(rival), Some(prepared)) = (&rival, &prepared) {
                    print!("   differ: {}", rival.differences(prepared, &scene, &set));
                }
                let logs = [ratio, any_ratio, packet_ratio].map(f64::ln);
                match totals.iter_mut().find(|total| total.name == set.name) {
                    Some(total) => total.add(logs, mesh.name == "slivers"),
                    None => {
                        let mut total =
                            Total { name: set.name, logs: [0.0; 3], n: 0, without_slivers: [0.0; 3], n_without: 0 };
                        total.add(logs, mesh.name == "slivers");
                        totals.push(total);
                    }
                }
            }
            println!();
        }
    }
    for total in totals {
        total.print();
    }
}

/// Logarithms of a ray class's ratios to Embree's single rays, summed over meshes: closest hit, any hit, and Embree's packets.
struct Total {
    name: &'static str,
    logs: [f64; 3],
    n: usize,
    without_slivers: [f64; 3],
    n_without: usize,
}

impl Total {
    fn add(&mut self, logs: [f64; 3], are_slivers: bool) {
        (0..3).for_each(|i| self.logs[i] += logs[i]);
        self.n += 1;
        if !are_slivers {
            (0..3).for_each(|i| self.without_slivers[i] += logs[i]);
            self.n_without += 1;
        }
    }

    fn print(&self) {
        let mean = |logs: [f64; 3], n: usize| logs.map(|log| format!("x{:.2}", (log / n as f64).exp())).join(" ");
        print!("geometric means, {:9} closest, any, Embree's packets: ", self.name);
        print!("{} over {} meshes", mean(self.logs, self.n), self.n);
        if self.n_without > 0 && self.n_without < self.n {
            print!(", {} without slivers", mean(self.without_slivers, self.n_without));
        }
        println!();
    }
}

/// Inner nodes of the binary tree, leaves and blocks a ray.
fn mean_visits(tree: &MeshTree, set: &RaySet) -> [f64; 3] {
    let mut sum = [0.0; 3];
    let mut n = 0.0;
    for wave in &set.waves {
        for i in (0..wave.len()).step_by(7) {
            let visits = tree.count_visits(&wave.get(i));
            for (sum, count) in sum.iter_mut().zip([visits.inner, visits.leaves, visits.blocks]) {
                *sum += count as f64;
            }
            n += 1.0;
        }
    }
    sum.map(|sum| sum / f64::max(n, 1.0))
}

/// Every hit of every ray against the plain traversal, and some against no tree at all.
fn check(scene: &SceneTree, set: &RaySet) {
    let mut hits = HitBatch::default();
    let mut occluded = Vec::new();
    for (w, wave) in set.waves.iter().enumerate() {
        scene.closest_hits(wave, set.class, &mut hits);
        scene.any_hits(wave, set.class, &mut occluded);
        for (i, &occluded) in occluded.iter().enumerate() {
            let expected = scene.closest_hit(&wave.get(i));
            assert_eq!(hits.get(i), expected, "{} {:?}", set.name, wave.get(i));
            assert_eq!(occluded, expected.is_some(), "{} {:?}", set.name, wave.get(i));
            if (w * WAVE + i).is_multiple_of(20_011) {
                assert_eq!(expected, scene.closest_hit_naive(&wave.get(i)), "{} {:?}", set.name, wave.get(i));
            }
        }
    }
}

/// The rays of a set in one piece.
#[cfg(unix)]
fn all_rays(set: &RaySet) -> impl Iterator<Item = firstlight::geometry::Ray> {
    set.waves.iter().flat_map(|wave: &RayBatch| (0..wave.len()).map(|i| wave.get(i)))
}
