//! A test scene: geometry, difficult rays, and checks of the hits.

use crate::geometry::{Ray, robust::offset_ray_origin};
use crate::kdtree::{Hit, HitBatch, RayBatch, RayClass, SceneTree};
use crate::stability::random::Random;
use crate::stability::reference::{CheckResult, ReferenceIntersector, Solid};
use crate::stability::replay::{Replay, ReplayValue};
use crate::stability::tally::{Tally, hex, hex3};
use glam::Vec3;
use rayon::prelude::*;

/// One scene with its rays.
pub struct TestScene {
    pub name: String,
    pub scene: SceneTree,
    pub reference: ReferenceIntersector,
    /// Generates the ray of an index.
    pub rays: RaySet,
    /// Every n-th ray is checked against every primitive; 1 for all.
    pub brute_every: u64,
}

pub type RaySet = Box<dyn Fn(&mut Random) -> Probe + Send + Sync>;

/// One ray and its expected properties.
#[derive(Clone, Copy, Debug)]
pub struct Probe {
    pub ray: Ray,
    /// Whether it starts inside a closed surface, so that it cannot escape.
    pub must_hit: bool,
}

/// Rays per batch query.
const BATCH: u64 = 2048;

impl TestScene {
    /// Traces rays `0..n` and counts findings.
    pub fn run(&self, index: usize, n: u64, tick: &(dyn Fn(u64) + Sync)) -> Tally {
        (0..n.div_ceil(BATCH))
            .into_par_iter()
            .map(|batch| {
                let (first, end) = (batch * BATCH, n.min((batch + 1) * BATCH));
                let tally = self.run_batch(index, first, end);
                tick(end - first);
                tally
            })
            .reduce(Tally::default, Tally::merged)
    }

    fn probe(&self, test_scene: usize, ray: u64) -> (Probe, Random) {
        let mut random = Random::new(test_scene as u64, ray);
        ((self.rays)(&mut random), random)
    }

    fn run_batch(&self, test_scene: usize, first: u64, end: u64) -> Tally {
        let mut tally = Tally { rays: end - first, ..Tally::default() };
        let (probes, mut randoms): (Vec<Probe>, Vec<Random>) = (first..end).map(|i| self.probe(test_scene, i)).unzip();
        let rays: RayBatch = probes.iter().map(|probe| &probe.ray).collect();
        // Alternates between both traversals.
        let class = if (first / BATCH).is_multiple_of(2) { RayClass::Incoherent } else { RayClass::Coherent };
        let (mut hits, mut occluded) = (HitBatch::default(), Vec::new());
        self.scene.closest_hits(&rays, class, &mut hits);
        self.scene.any_hits(&rays, class, &mut occluded);
        let (mut second, mut sources) = (RayBatch::default(), Vec::new());
        for (k, probe) in probes.iter().enumerate() {
            let (ray, index) = (&probe.ray, first + k as u64);
            let hit = hits.get(k);
            if occluded[k] != hit.is_some() {
                tally.missed += 1;
                tally
                    .offer(1e9, test_scene, index, || format!("any-hit says {}: {}", occluded[k], describe(ray, &hit)));
            }
            match &hit {
                None if probe.must_hit => {
                    tally.leaks += 1;
                    tally.offer(1e9, test_scene, index, || format!("leak: {}", describe(ray, &hit)));
                }
                _ => self.check_ray(&mut tally, test_scene, index, ray, &hit),
            }
            // Rays that leave must not hit the same flat primitive again, nor a sphere from outside.
            if let Some(hit) = hit {
                let next = self.leaving(ray, &hit, &mut randoms[k]);
                second.push(&next);
                sources.push((index, hit, *ray));
            }
        }
        tally.rays += second.len() as u64;
        self.scene.closest_hits(&second, RayClass::Incoherent, &mut hits);
        for (k, (index, from, ray)) in sources.iter().enumerate() {
            let (next, again) = (second.get(k), hits.get(k));
            if let Some(found) = self.self_hit(ray, from, &next, &again) {
                let count = if found == "leak" { &mut tally.leaks } else { &mut tally.acne };
                *count += 1;
                tally.offer(1e9, test_scene, *index, || format!("{found}: {}", describe(&next, &again)));
            }
        }
        tally
    }

    fn check_ray(&self, tally: &mut Tally, test_scene: usize, index: u64, ray: &Ray, hit: &Option<Hit>) {
        let check = if index.is_multiple_of(self.brute_every) {
            self.reference.check(ray, hit.as_ref())
        } else {
            hit.as_ref().map_or(CheckResult::Right(0.0), |hit| self.reference.check_hit(ray, hit))
        };
        let severity = match check {
            CheckResult::Right(ratio) => ratio,
            CheckResult::WrongT(ratio) => {
                tally.wrong_t += 1;
                ratio.max(1.0).next_up()
            }
            CheckResult::Missed => {
                tally.missed += 1;
                1e9
            }
        };
        tally.offer(severity, test_scene, index, || describe(ray, hit));
    }

    /// Returns a ray that leaves the hit on either side.
    fn leaving(&self, ray: &Ray, hit: &Hit, random: &mut Random) -> Ray {
        let point = self.scene.surface_point(ray, hit);
        let side = if random.below(2) == 0 { 1.0 } else { -1.0 };
        let dir = random.leaving(side * point.geometric_normal);
        Ray::new(offset_ray_origin(point.position, point.error, point.geometric_normal, dir), dir)
    }

    /// Returns the finding for a ray that has just left `from`, if any.
    fn self_hit(&self, ray: &Ray, from: &Hit, next: &Ray, again: &Option<Hit>) -> Option<&'static str> {
        let is_same = again.is_some_and(|again| (again.object, again.prim) == (from.object, from.prim));
        match self.reference.solid(from) {
            Solid::Sphere { radius, .. } => {
                // From inside, the far side is one chord away and must be hit.
                let point = self.scene.surface_point(ray, from);
                let cos = f64::from(-next.dir.dot(point.geometric_normal));
                let chord = 2.0 * radius * cos;
                if cos < 0.0 {
                    return is_same.then_some("acne");
                }
                let error = f64::from(point.geometric_normal.abs().dot(point.error));
                match again {
                    // If the chord is within the rounding of the origin, no check is possible.
                    _ if chord * cos < 64.0 * error => None,
                    None => Some("leak"),
                    Some(again) if is_same && f64::from(again.t) < 0.5 * chord => Some("acne"),
                    _ => None,
                }
            }
            _ => is_same.then_some("acne"),
        }
    }

    /// Returns all details of one ray.
    pub fn replay(&self, test_scene: usize, index: u64) -> Replay {
        let (Probe { ray, must_hit }, mut random) = self.probe(test_scene, index);
        let hit = self.scene.closest_hit(&ray);
        let mut replay = Replay::default();
        replay.push("test_scene", ReplayValue::Text(self.name.clone()));
        replay.push_ray("", &ray);
        replay.push("must_hit", ReplayValue::Flag(must_hit));
        replay.push("any_hit", ReplayValue::Flag(self.scene.any_hit(&ray)));
        replay.push_hit("", hit.as_ref());
        replay.push_hit("naive_", self.scene.closest_hit_naive(&ray).as_ref());
        replay.push_check(self.reference.check(&ray, hit.as_ref()));
        if let Some(hit) = &hit {
            let point = self.scene.surface_point(&ray, hit);
            replay.push("point", ReplayValue::Vector(point.position));
            replay.push("point_error", ReplayValue::Vector(point.error));
            replay.push("normal", ReplayValue::Vector(point.geometric_normal));
            let next = self.leaving(&ray, hit, &mut random);
            replay.push_ray("next_", &next);
            replay.push_hit("next_", self.scene.closest_hit(&next).as_ref());
        }
        replay
    }
}

/// Describes a ray with all its bits, and its hit.
pub fn describe(ray: &Ray, hit: &Option<Hit>) -> String {
    let met = match hit {
        Some(hit) => format!("t {} ({}), object {}, primitive {}", hex(hit.t), hit.t, hit.object, hit.prim),
        None => "nothing".to_owned(),
    };
    format!("origin {} dir {} t_max {} -> {met}", hex3(ray.origin), hex3(ray.dir), hex(ray.t_max))
}

/// Returns a ray from `origin` towards `target` with unit direction, along x if they coincide.
pub fn towards(origin: Vec3, target: Vec3) -> Ray {
    Ray::new(origin, (target - origin).as_dvec3().normalize_or(glam::DVec3::X).as_vec3())
}
