//! Stability tests: cases that are known to break renderers, run by the million, with findings that can be replayed.
//!
//! Rays are checked against an `f64` reference without a tree (`reference`), radiance against closed forms (`light`),
//! and scenes against their transformed copies (`anywhere`). Every ray is a function of case, test scene and index
//! alone: the counts do not depend on threads, and the worst ray can be replayed ([`Case::replay`]). Start reading at
//! [`CASES`].

mod anywhere;
mod bounces;
mod furnace;
mod light;
mod random;
mod reference;
mod replay;
mod surfaces;
mod tally;
mod test_scene;

pub use reference::{CheckResult, ReferenceIntersector, TEST_ERROR};
pub use replay::{Replay, ReplayError, ReplayValue};
pub use tally::{Energy, Tally, Worst};

use crate::stability::light::LightCase;
use crate::stability::surfaces::Plan;

/// One stability case.
#[derive(Clone, Copy)]
pub struct Case {
    pub name: &'static str,
    pub about: &'static str,
    /// Ratio of the rays of this case to the requested rays.
    share: f64,
    kind: CaseKind,
}

#[derive(Clone, Copy)]
enum CaseKind {
    RaySet(fn() -> Vec<Plan>),
    Pictures(fn() -> Vec<LightCase>),
    Bounces,
    Anywhere,
    Georeferenced,
}

pub const CASES: &[Case] = &[
    Case {
        name: "closed",
        about: "closed meshes hit at corners and edges from inside, sizes 10^-6 ... 10^6, 0 ... 10^7 sizes from the origin",
        share: 1.0,
        kind: CaseKind::RaySet(surfaces::closed),
    },
    Case {
        name: "georeferenced",
        about: "a model in map coordinates (500000, 4500000) against the same model at the origin",
        share: 0.01,
        kind: CaseKind::Georeferenced,
    },
    Case {
        name: "slivers",
        about: "crossing triangles 10^3 ... 10^6 times longer than wide",
        share: 0.1,
        kind: CaseKind::RaySet(surfaces::slivers),
    },
    Case {
        name: "degenerate",
        about: "triangles without area, repeated and coplanar ones",
        share: 0.1,
        kind: CaseKind::RaySet(surfaces::degenerate),
    },
    Case {
        name: "split-planes",
        about: "boxes and sheets along the axes, and rays within their planes, from corners, with -0, denormals, 10^±24",
        share: 0.1,
        kind: CaseKind::RaySet(surfaces::split_planes),
    },
    Case {
        name: "leaving",
        about: "rays that leave every kind of surface, down to 10^-4 rad",
        share: 0.2,
        kind: CaseKind::RaySet(surfaces::leaving),
    },
    Case {
        name: "tangent",
        about: "spheres that touch a floor, each other, and a floor that is a sphere of 10 km",
        share: 0.2,
        kind: CaseKind::RaySet(surfaces::tangent),
    },
    Case {
        name: "white-box",
        about: "paths of 10^5 bounces in closed boxes, many straight into edges and corners",
        share: 0.5,
        kind: CaseKind::Bounces,
    },
    Case {
        name: "glass",
        about: "nested and touching glass, indices 1, 1 ± 10^-6 and extreme, in a white furnace",
        share: 0.02,
        kind: CaseKind::Pictures(light::glass),
    },
    Case {
        name: "metal",
        about: "microfacets of alpha 0 ... 1 in a white furnace",
        share: 0.02,
        kind: CaseKind::Pictures(light::metal),
    },
    Case {
        name: "nested-media",
        about: "up to 100 shells of glass, shared walls, overlaps, blends, a camera at every level, in a white furnace",
        share: 0.1,
        kind: CaseKind::Pictures(furnace::nested),
    },
    Case {
        name: "random-furnaces",
        about: "random lossless scenes of every material and shape in a white furnace",
        share: 0.5,
        kind: CaseKind::Pictures(furnace::random),
    },
    Case {
        name: "lights",
        about: "tiny, huge and touching sphere lights over a floor, against the closed form",
        share: 0.02,
        kind: CaseKind::Pictures(light::lights),
    },
    Case {
        name: "cameras",
        about: "fields of view to 179.9 degrees, focus from 0+ to infinity, lenses larger than the scene",
        share: 0.02,
        kind: CaseKind::Pictures(light::cameras),
    },
    Case {
        name: "long-sums",
        about: "10^6 samples in one pixel, against the exact answer",
        share: 0.1,
        kind: CaseKind::Pictures(light::long_sums),
    },
    Case {
        name: "anywhere",
        about: "the same scene moved by 10^6 and scaled by 10^-3 ... 10^3: the same image within its noise",
        share: 0.05,
        kind: CaseKind::Anywhere,
    },
];

impl Case {
    pub fn find(name: &str) -> Option<&'static Self> {
        CASES.iter().find(|case| case.name == name)
    }

    /// Approximate number of rays that this case traces for a request of `rays`.
    pub fn rays(&self, rays: u64) -> u64 {
        (rays as f64 * self.share) as u64
    }

    /// Runs the case with about [`Self::rays`] of `rays`; `tick` receives the number of rays traced since the last
    /// call.
    pub fn run(&self, rays: u64, tick: &(dyn Fn(u64) + Sync)) -> Tally {
        let n = self.rays(rays);
        match self.kind {
            CaseKind::RaySet(plans) => {
                let plans = plans();
                let each = rays_of_plan(n, &plans);
                let test_scenes = plans.iter().enumerate().filter_map(|(i, plan)| Some((i, (plan.build)()?)));
                test_scenes.map(|(i, test_scene)| test_scene.run(i, each, tick)).fold(Tally::default(), Tally::merged)
            }
            CaseKind::Pictures(pictures) => {
                let pictures = pictures();
                let run = |i: usize| pictures[i].run(i, spp_of_picture(n, &pictures, i), tick);
                (0..pictures.len()).map(run).fold(Tally::default(), Tally::merged)
            }
            CaseKind::Bounces => bounces::run(n, tick),
            CaseKind::Anywhere => anywhere::run(n, tick),
            CaseKind::Georeferenced => anywhere::georeferenced(n, tick),
        }
    }

    /// Whether [`Self::replay`] supports the rays that the tally of this case reports.
    pub fn can_replay(&self) -> bool {
        matches!(self.kind, CaseKind::RaySet(_) | CaseKind::Pictures(_))
    }

    /// Returns all details of one ray of the case.
    ///
    /// - `rays`: as for [`Self::run`]: it determines how many rays each test scene has, but not which ray an index is.
    pub fn replay(&self, test_scene: usize, ray: u64, rays: u64) -> Result<Replay, ReplayError> {
        let n = self.rays(rays);
        let no_scene = |count: usize| ReplayError::NoScene { test_scene, last: count - 1 };
        let check = |count: u64| {
            if ray < count { Ok(()) } else { Err(ReplayError::NoRay { test_scene, ray, last: count - 1 }) }
        };
        match self.kind {
            CaseKind::RaySet(plans) => {
                let plans = plans();
                let plan = plans.get(test_scene).ok_or(no_scene(plans.len()))?;
                check(rays_of_plan(n, &plans))?;
                Ok((plan.build)().ok_or(ReplayError::EmptyScene { test_scene })?.replay(test_scene, ray))
            }
            CaseKind::Pictures(pictures) => {
                let pictures = pictures();
                let picture = pictures.get(test_scene).ok_or(no_scene(pictures.len()))?;
                check(picture.samples(spp_of_picture(n, &pictures, test_scene)))?;
                Ok(picture.replay(ray))
            }
            _ => Err(ReplayError::NoRays),
        }
    }
}

/// Number of rays per test scene, for `n` rays of the case.
fn rays_of_plan(n: u64, plans: &[Plan]) -> u64 {
    n.div_ceil(plans.len() as u64).max(64)
}

/// Samples per pixel of image `i`, for `n` samples of the case.
fn spp_of_picture(n: u64, pictures: &[LightCase], i: usize) -> u32 {
    let usual: u64 = pictures.iter().map(|picture| picture.samples(picture.spp)).sum();
    // More rays reduce the noise; fewer than the default would make noise dominate.
    let spp = f64::from(pictures[i].spp);
    (spp * (n as f64 / usual as f64)).clamp(spp, 1e8) as u32
}
