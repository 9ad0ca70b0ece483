//! What motion blur costs: `cargo bench -p firstlight-benches --bench motion_blur`.
//!
//! The first table has the time to prepare one moment of scenes with many instances of a mesh, all of which move. The second
//! renders each scene twice in turns, as a still and as a scene of which every moment is the same: the films must be the same,
//! and what it takes longer is the price of working sample by sample. `-- [SCENE]...` measures other scenes.

mod common;
#[path = "common/turns.rs"]
mod turns;

use common::{scenes, world_of};
use firstlight::kdtree::{BuildPreset, HitSpace, MeshTree, Shape};
use firstlight::mesh::procedural;
use firstlight::render::{
    Camera, ColorInput, Environment, Exposed, Geometry, Material, Object, Prepared, RenderSettings, SampleAllocation,
    Shading, Snapshot,
};
use firstlight::report::cpu_seconds;
use firstlight::scene::{BUILTIN_SCENES, Extraction, Rendering, SceneInputs};
use glam::{Affine3A, DVec3, Quat, Vec3};
use std::hint::black_box;
use std::sync::Arc;
use turns::{ROUNDS, compare, median};

const SPP: u32 = 64;

fn main() {
    println!("| instances that move | CPU ms a moment |");
    println!("|---:|---:|");
    for n in [1, 100, 10_000] {
        println!("| {n} | {:.3} |", 1e3 * preparation(n));
    }
    println!();
    let scenes = scenes(|| BUILTIN_SCENES.iter().map(|(name, _, _)| (*name).to_owned()).collect());
    println!("| scene | CPU s as a still | sample by sample | times as long |");
    println!("|---|---:|---:|---:|");
    for scene in &scenes {
        row(scene);
    }
}

/// CPU seconds for one moment of a scene with so many instances.
fn preparation(n: u32) -> f64 {
    let mesh = Arc::new(procedural::cuboid(DVec3::ONE).flat());
    let tree = Arc::new(MeshTree::build(&mesh.positions, &mesh.triangles, BuildPreset::Best));
    let object = Object { mesh: Some(mesh), ..Object::plain(0) };
    let grey = Material::Diffuse { albedo: ColorInput::Constant(Vec3::splat(0.5)) };
    let shading = Arc::new(Shading::new(vec![grey], Vec::new(), Environment::Constant(Vec3::ONE)));
    let moment = |open: f32, before: Option<&Prepared>| {
        let shape = |i: u32| {
            let place = Vec3::new((i % 100) as f32, 0.3 * open * (i % 7) as f32, (i / 100) as f32) * 2.0;
            let turn = Quat::from_rotation_y(open + i as f32);
            Shape::Mesh {
                tree: tree.clone(),
                world_from_object: Affine3A::from_rotation_translation(turn, place),
                space: HitSpace::Object,
            }
        };
        let geometry = Geometry::build((0..n).map(shape).collect(), vec![object.clone(); n as usize]);
        let snapshot = Snapshot { geometry: Arc::new(geometry), shading: shading.clone(), camera: eye() };
        match before {
            None => Prepared::new(snapshot),
            Some(before) => before.with_snapshot(snapshot),
        }
    };
    let middle = moment(0.5, None);
    let rounds = 200_000 / n.max(100);
    let mut times = Vec::new();
    for _ in 0..ROUNDS {
        let before = cpu_seconds().expect("a system that tells CPU time");
        (0..rounds).for_each(|i| drop(black_box(moment(i as f32 / rounds as f32, Some(&middle)))));
        times.push((cpu_seconds().expect("a system that tells CPU time") - before) / f64::from(rounds));
    }
    median(&mut times)
}

fn eye() -> Camera {
    Camera { eye: Vec3::new(0.0, 5.0, 10.0), tan_half_vfov: 0.5, ..Camera::default() }
}

fn row(name: &str) {
    let (scene, mut world) = world_of(name);
    let settings = RenderSettings { allocation: SampleAllocation::Uniform, ..world.resource::<Rendering>().0 };
    let still = Extraction::new(&SceneInputs::of(&mut world), &scene.trees).prepared;
    let moments = |_: f64| still.clone();
    let two = [Exposed::still(&still), Exposed::moving(&still, &moments)];
    let [still, moving, ratio] = compare(name, two, &settings, SPP);
    println!("| {name} | {still:.3} | {moving:.3} | {ratio:.3} |");
}
