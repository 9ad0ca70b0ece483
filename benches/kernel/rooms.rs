//! Rooms of many meshes that stand still: each in a tree of its own, and all in one.

use crate::clock::{cpu_seconds, median};
#[cfg(unix)]
use crate::embree::Embree;
use crate::meshes::Mesh;
use crate::rays::{self, Random, RaySet};
use firstlight::kdtree::{BuildPreset, HitBatch, HitSpace, MeshTree, SceneTree, Shape};
use firstlight::mesh::procedural;
use firstlight::scene::{Extraction, LoadOptions, SceneInputs, SceneSource, load};
use glam::{Affine3A, Vec3, vec3};
use std::sync::Arc;

struct Room {
    name: String,
    /// Its meshes; what else is in it is left out.
    shapes: Vec<Shape>,
    /// As in [`Mesh::eye`].
    eye: Vec3,
}

/// A room of 300 things on its floor and its walls, by formula, and the scenes of `FIRSTLIGHT_ROOMS`, which separates
/// paths by `:`.
fn rooms(filter: &str) -> Vec<Room> {
    let mut rooms = vec![made()];
    if let Some(paths) = std::env::var_os("FIRSTLIGHT_ROOMS") {
        rooms.extend(std::env::split_paths(&paths).map(|path| loaded(&path)));
    }
    rooms.retain(|room| room.name.contains(filter));
    rooms
}

fn mesh(made: firstlight::mesh::Mesh, world_from_object: Affine3A) -> Shape {
    let tree = Arc::new(MeshTree::build(&made.positions, &made.triangles, BuildPreset::Best));
    Shape::Mesh { tree, world_from_object, space: HitSpace::World }
}

fn made() -> Room {
    let mut random = Random(3);
    let walls = Affine3A::from_scale_rotation_translation(vec3(5.0, 3.0, 4.0), glam::Quat::IDENTITY, Vec3::Y * 1.5);
    let mut shapes = vec![mesh(procedural::cuboid(glam::DVec3::ONE), walls)];
    for i in 0..300 {
        let made = match i % 3 {
            0 => procedural::icosphere(4 + i as u32 % 24),
            1 => procedural::torus(1.0, 0.3, 24 + i as u32 % 60, 12 + i as u32 % 30),
            _ => procedural::cuboid(glam::DVec3::ONE),
        };
        let size = 0.05 + 0.25 * random.unit() * random.unit();
        let at = vec3(5.0 * random.unit() - 2.5, size * (1.0 + 4.0 * random.unit()), 4.0 * random.unit() - 2.0) * 0.95;
        let turn = glam::Quat::from_rotation_y(6.0 * random.unit()) * glam::Quat::from_rotation_x(random.unit());
        shapes.push(mesh(made, Affine3A::from_scale_rotation_translation(Vec3::splat(size), turn, at)));
    }
    Room { name: "made".to_owned(), shapes, eye: vec3(0.8, 0.3, 0.7) }
}

fn loaded(path: &std::path::Path) -> Room {
    let source = SceneSource::parse(path).unwrap_or_else(|error| panic!("{error}"));
    let scene = load(&source, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    let mut world = bevy_ecs::world::World::new();
    scene.spawn(&mut world);
    let extraction = Extraction::new(&SceneInputs::of(&mut world), &scene.trees);
    let shapes = extraction.prepared.geometry.tree.shapes().iter();
    let shapes = shapes.filter(|shape| matches!(shape, Shape::Mesh { .. })).cloned().collect();
    let name = path.display().to_string();
    Room { name, shapes, eye: vec3(0.5, 0.1, 0.5) }
}

/// All triangles of a room as one mesh.
#[cfg(unix)]
fn merged_mesh(shapes: &[Shape]) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for shape in shapes {
        let Shape::Mesh { tree, world_from_object, .. } = shape else { continue };
        for prim in 0..tree.n_triangles() as u32 {
            let first = positions.len() as u32;
            positions.extend(tree.vertices(prim).map(|vertex| world_from_object.transform_point3(vertex)));
            triangles.push([first, first + 1, first + 2]);
        }
    }
    (positions, triangles)
}

/// - `embree`: traces the same rays through the same triangles, as one mesh.
pub fn run(filter: &str, rounds: usize, size: u32, #[cfg(unix)] embree: Option<&Embree>) {
    println!("rooms, ns a ray (closest, any): each mesh in its own tree, all in one, and how many times faster");
    for Room { name, shapes, eye } in rooms(filter) {
        let in_space = |wanted: HitSpace| {
            let mut shapes = shapes.clone();
            for shape in &mut shapes {
                if let Shape::Mesh { space, tree, .. } = shape {
                    *space = wanted;
                    if wanted == HitSpace::Object {
                        tree.ensure_built();
                    }
                }
            }
            let start = cpu_seconds();
            (SceneTree::build(shapes), cpu_seconds() - start)
        };
        let ((separate, _), (merged, build)) = (in_space(HitSpace::Object), in_space(HitSpace::World));
        let triangles: usize =
            shapes.iter().map(|shape| if let Shape::Mesh { tree, .. } = shape { tree.n_triangles() } else { 0 }).sum();
        println!("{name}: {} meshes, {triangles} triangles, one tree in {build:.2} s", shapes.len());
        #[cfg(unix)]
        let rival = embree.map(|embree| {
            let (positions, triangles) = merged_mesh(&shapes);
            let start = cpu_seconds();
            let scene = embree.scene(&positions, &triangles);
            println!("    built by Embree in {:.2} s", cpu_seconds() - start);
            scene
        });
        let seen = Mesh { name: name.clone(), positions: Vec::new(), triangles: Vec::new(), eye };
        let mut gains = Vec::new();
        for set in rays::classes(&merged, &seen, size) {
            let mut times: [Vec<f64>; 4] = Default::default();
            #[cfg(unix)]
            let mut ratios: [Vec<f64>; 2] = Default::default();
            #[cfg(unix)]
            let prepared = rival.as_ref().map(|rival| rival.prepare(&set));
            for _ in 0..rounds {
                for (scene, to) in [(&separate, 0), (&merged, 2)] {
                    let [closest, any] = seconds(scene, &set);
                    times[to].push(closest);
                    times[to + 1].push(any);
                }
                #[cfg(unix)]
                if let (Some(rival), Some(prepared)) = (&rival, &prepared) {
                    let theirs = [rival.trace(prepared), rival.trace_any(prepared)];
                    for (k, theirs) in theirs.into_iter().enumerate() {
                        ratios[k].push(1e9 * theirs / set.len() as f64 / times[2 + k].last().expect("just pushed"));
                    }
                }
            }
            let [closest, any, one_closest, one_any] = times.map(|mut times| median(&mut times));
            print!(
                "    {:9} {closest:7.1} {any:7.1}   {one_closest:7.1} {one_any:7.1}   x{:.2} x{:.2}",
                set.name,
                closest / one_closest,
                any / one_any
            );
            #[cfg(unix)]
            if rival.is_some() {
                let [closest, any] = ratios.map(|mut ratios| median(&mut ratios));
                print!("   Embree x{closest:.2} x{any:.2}");
            }
            println!();
            gains.push([closest / one_closest, any / one_any]);
        }
        let mean = |k: usize| (gains.iter().map(|gain| gain[k].ln()).sum::<f64>() / gains.len() as f64).exp();
        println!("    geometric mean x{:.2} x{:.2}", mean(0), mean(1));
    }
}

/// ns per ray, closest hit and any hit.
fn seconds(scene: &SceneTree, set: &RaySet) -> [f64; 2] {
    let (mut hits, mut occluded) = (HitBatch::default(), Vec::new());
    let per_ray = |start: f64| 1e9 * (cpu_seconds() - start) / set.len() as f64;
    let start = cpu_seconds();
    set.waves.iter().for_each(|wave| scene.closest_hits(wave, set.class, &mut hits));
    let closest = per_ray(start);
    let start = cpu_seconds();
    set.waves.iter().for_each(|wave| scene.any_hits(wave, set.class, &mut occluded));
    [closest, per_ray(start)]
}
