//! What the robust forms cost against the naive ones: the watertight test against Möller and Trumbore 1997, surface points with
//! bounded errors against `origin + t · dir`, and bounded offsets against a fixed epsilon.
//!
//! ```text
//! cargo bench -p firstlight-benches --bench robustness
//! ```
//!
//! Everything runs on one thread; the forms take turns, and each figure is the median over the rounds.

use firstlight::geometry::{Ray, Shear, intersect_triangle, robust::offset_ray_origin};
use firstlight::kdtree::{BuildPreset, HitBatch, HitSpace, MeshTree, RayBatch, RayClass, SceneTree, Shape};
use firstlight::mesh::procedural::{SerpentKnot, serpent_knot};
use glam::{Affine3A, Vec3};
use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

const ROUNDS: usize = 15;

struct Random(u64);

impl Random {
    fn signed(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1u64 << 23) as f32 - 1.0
    }

    fn point(&mut self) -> Vec3 {
        Vec3::new(self.signed(), self.signed(), self.signed())
    }
}

/// The plain test: `t` of the hit, infinite for a miss.
#[inline(always)]
fn moller_trumbore(ray: &Ray, &[a, b, c]: &[Vec3; 3]) -> f32 {
    let (ab, ac) = (b - a, c - a);
    let p = ray.dir.cross(ac);
    let det = ab.dot(p);
    if det.abs() < 1e-12 {
        return f32::INFINITY;
    }
    let inv = 1.0 / det;
    let s = ray.origin - a;
    let u = s.dot(p) * inv;
    if !(0.0..=1.0).contains(&u) {
        return f32::INFINITY;
    }
    let q = s.cross(ab);
    let v = ray.dir.dot(q) * inv;
    if v < 0.0 || u + v > 1.0 { f32::INFINITY } else { ac.dot(q) * inv }
}

/// Nanoseconds an item of each form, medians over the rounds.
fn compare(n: usize, forms: &mut [&mut dyn FnMut()]) -> Vec<f64> {
    let mut times = vec![Vec::new(); forms.len()];
    for _ in 0..ROUNDS {
        for (form, times) in forms.iter_mut().zip(&mut times) {
            let start = Instant::now();
            form();
            times.push(start.elapsed().as_secs_f64() * 1e9 / n as f64);
        }
    }
    let median = |times: &mut Vec<f64>| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    };
    times.iter_mut().map(median).collect()
}

fn main() {
    let mut random = Random(1);
    let mesh = serpent_knot(&SerpentKnot::default());
    let tree = Arc::new(MeshTree::build(&mesh.positions, &mesh.triangles, BuildPreset::Best));
    let bounds = tree.bounds();
    let scene = SceneTree::build(vec![Shape::Mesh {
        tree: tree.clone(),
        world_from_object: Affine3A::IDENTITY,
        space: HitSpace::Object,
    }]);
    let rays: Vec<Ray> = (0..1 << 16)
        .map(|_| {
            let (from, to) = (random.point() * 3.0, random.point() * 0.5);
            let at = |p: Vec3| bounds.center() + 0.5 * p * bounds.size();
            Ray::new(at(from), (at(to) - at(from)).normalize())
        })
        .collect();
    let batch: RayBatch = rays.iter().collect();
    let mut hits = HitBatch::default();
    scene.closest_hits(&batch, RayClass::Incoherent, &mut hits);
    let found: Vec<_> = (0..rays.len()).filter_map(|i| Some((rays[i], hits.get(i)?))).collect();

    // One ray against triangles near what it hits: the mix of hits and near misses that leaves hold.
    let triangles: Vec<[Vec3; 3]> = found
        .iter()
        .take(4096)
        .flat_map(|(_, hit)| (0..4).map(|k| tree.vertices((hit.prim + k) % tree.n_triangles() as u32)))
        .collect();
    let near: Vec<(Ray, &[[Vec3; 3]])> = found.iter().zip(triangles.chunks(4)).map(|((ray, _), t)| (*ray, t)).collect();
    let (mut plain, mut watertight) = (0.0f32, 0.0f32);
    let mut run_plain = || {
        let t =
            |(ray, four): &(Ray, &[[Vec3; 3]])| four.iter().fold(f32::INFINITY, |t, v| t.min(moller_trumbore(ray, v)));
        plain = near.iter().map(t).filter(|t| t.is_finite()).sum();
        black_box(plain);
    };
    let mut run_watertight = || {
        let t = |(ray, four): &(Ray, &[[Vec3; 3]])| {
            let shear = Shear::new(ray.dir);
            let nearest =
                |t: f32, v: &[Vec3; 3]| intersect_triangle(ray.origin, &shear, v).map_or(t, |hit| t.min(hit.t));
            four.iter().fold(f32::INFINITY, nearest)
        };
        watertight = near.iter().map(t).filter(|t| t.is_finite()).sum();
        black_box(watertight);
    };
    let test = compare(near.len() * 4, &mut [&mut run_plain, &mut run_watertight]);
    assert!((plain / watertight - 1.0).abs() < 1e-3, "the two tests disagree: {plain} {watertight}");

    let mut sum = Vec3::ZERO;
    let mut run_naive = || {
        sum = Vec3::ZERO;
        for (ray, hit) in &found {
            let [a, b, c] = tree.vertices(hit.prim);
            let normal = (b - a).cross(c - a).normalize();
            sum += ray.at(hit.t) + 1e-4 * normal;
        }
        black_box(sum);
    };
    let mut bounded = Vec3::ZERO;
    let mut run_bounded = || {
        bounded = Vec3::ZERO;
        for (ray, hit) in &found {
            let point = scene.surface_point(ray, hit);
            bounded += offset_ray_origin(point.position, point.error, point.geometric_normal, point.geometric_normal);
        }
        black_box(bounded);
    };
    let point = compare(found.len(), &mut [&mut run_naive, &mut run_bounded]);

    let mut run_trace = || {
        scene.closest_hits(&batch, RayClass::Incoherent, &mut hits);
        black_box(&hits);
    };
    let trace = compare(rays.len(), &mut [&mut run_trace]);
    println!("triangle test: plain {:.1} ns, watertight {:.1} ns (one at a time)", test[0], test[1]);
    println!("surface point and offset: naive {:.1} ns, bounded {:.1} ns a hit", point[0], point[1]);
    println!("closest hit of the same rays, whole kernel: {:.0} ns a ray", trace[0]);
}
