//! Every built-in scene has the same mean whichever techniques look for its light.
//!
//! Each scene is rendered many times with seeds of their own: with all techniques and samples where the error is, and with
//! as few techniques as find its light at all and the same samples everywhere. Student's t for unequal variances (Welch 1947) compares the two, pixel by pixel and over the whole picture.
//!
//! Point lights are made larger first: plain paths that a mirror sends their way would hit the small spheres that they are
//! so seldom that a mean of thousands of samples lacks their light, a hundredth of some of the scenes.

use firstlight::render::{
    CausticPlan, ErrorMetric, Film, Integrator, Prepared, RenderSettings, SampleAllocation, Techniques, advance,
};
use firstlight::scene::{
    BUILTIN_SCENES, Extraction, LoadOptions, PointLight, Rendering, SceneInputs, SceneSource, load,
};
use rayon::prelude::*;

const WIDTH: u32 = 24;
const HEIGHT: u32 = 18;
const RENDERS: u32 = 24;

/// As few techniques as find the light of small lights.
const PLAIN: Techniques = Techniques {
    light_sampling: true,
    mis: true,
    even_samples: false,
    solid_angle: false,
    light_selection: false,
    portals: false,
    caustics: false,
    caustic_plan: None,
    resampling: false,
    roulette: false,
};

/// A number known by independent renders of it.
#[derive(Clone, Copy)]
struct Estimate {
    mean: f64,
    /// Of the mean.
    variance: f64,
}

impl Estimate {
    fn of(values: impl Iterator<Item = f64> + Clone) -> Self {
        let n = f64::from(RENDERS);
        let mean = values.clone().sum::<f64>() / n;
        Self { mean, variance: values.map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0) / n }
    }

    /// Welch's t.
    fn differs_by(self, other: Self) -> f64 {
        (self.mean - other.mean) / (self.variance + other.variance).sqrt()
    }
}

fn prepared(name: &str) -> (Prepared, RenderSettings) {
    let scene = load(&SceneSource::Builtin(name.to_owned()), &LoadOptions::default()).unwrap();
    let mut world = bevy_ecs::world::World::new();
    scene.spawn(&mut world);
    for mut light in world.query::<&mut PointLight>().iter_mut(&mut world) {
        light.radius = 1.5;
    }
    let prepared = Extraction::new(&SceneInputs::of(&mut world), &scene.trees).prepared;
    (prepared, RenderSettings { integrator: Integrator::Path, ..world.resource::<Rendering>().0 })
}

/// Mean of the channels of every pixel, of each render.
fn renders(scene: &Prepared, settings: RenderSettings, first_seed: u32, spp: u32) -> Vec<Vec<f64>> {
    (0..RENDERS)
        .into_par_iter()
        .map(|render| {
            let mut film = Film::new(WIDTH, HEIGHT);
            let settings = RenderSettings { seed: first_seed + render, ..settings };
            assert!(advance(scene, &settings, &mut film, spp, &|| false).completed);
            film.means().iter().map(|mean| mean.as_dvec3().element_sum() / 3.0).collect()
        })
        .collect()
}

/// Pixels, and last the whole picture.
fn estimates(renders: &[Vec<f64>]) -> Vec<Estimate> {
    let whole = |render: &Vec<f64>| render.iter().sum::<f64>() / render.len() as f64;
    let pixels = (0..renders[0].len()).map(|i| Estimate::of(renders.iter().map(move |render| render[i])));
    pixels.chain([Estimate::of(renders.iter().map(whole))]).collect()
}

#[test]
fn all_techniques_together_have_the_mean_of_the_plain_ones() {
    let mut names: Vec<&str> = BUILTIN_SCENES.iter().map(|(name, ..)| *name).collect();
    names.sort_unstable();
    assert!(names.len() >= 15);
    println!("{:<20} {:>8} {:>8} {:>8} {:>8} {:>8}", "scene", "error", "t", "mean t²", "|t| > 4", "largest");
    for name in &names {
        let (scene, settings) = prepared(name);
        // Plain paths find gathered light so seldom that in few samples most pixels lack some of it, and do not know.
        let [n_all, n_plain] = if scene.features().caustics { [32, 256] } else { [32, 32] };
        let allocation = SampleAllocation::Adaptive(ErrorMetric::RelativeMse);
        // Light paths and guiding both, whether or not they pay.
        let techniques = Techniques { caustic_plan: Some(CausticPlan::UNKNOWN), ..Techniques::ALL };
        let all = RenderSettings { techniques, allocation, ..settings };
        let all = estimates(&renders(&scene, all, 1000, n_all));
        let plain = estimates(&renders(&scene, RenderSettings { techniques: PLAIN, ..settings }, 2000, n_plain));
        let (whole, pixels) = (all.len() - 1, 0..all.len() - 1);
        // What shows the same in every render, such as a light that is seen alone, is equal to the last bits.
        let (t, error) = (
            all[whole].differs_by(plain[whole]),
            (all[whole].variance + plain[whole].variance).sqrt() / all[whole].mean,
        );
        let noisy = |i: &usize| all[*i].variance + plain[*i].variance > (1e-5 * all[*i].mean).powi(2);
        for i in pixels.clone().filter(|i| !noisy(i)) {
            let (all, plain) = (all[i].mean, plain[i].mean);
            assert!((all - plain).abs() <= 1e-4 * plain, "{name} {i}: {all} {plain}");
        }
        let ts: Vec<f64> = pixels.filter(noisy).map(|i| all[i].differs_by(plain[i])).collect();
        let squares = ts.iter().map(|t| t * t).sum::<f64>() / ts.len() as f64;
        let far = ts.iter().filter(|t| t.abs() > 4.0).count();
        let largest = ts.iter().fold(0.0, |most: f64, t| most.max(t.abs()));
        let summary = format!("{name:<20} {:>7.3} % {t:>8.2} {squares:>8.2} {far:>8} {largest:>8.1}", 100.0 * error);
        println!("{summary}");
        // One in a thousand runs of fifteen scenes would find a t beyond this by chance; noise of glass has longer tails
        // than the normal distribution, so some of the pixels may.
        assert!(t.abs() < 4.5 && error < 0.07, "{summary}");
        assert!(squares < 2.5 && far * 50 <= ts.len(), "{summary}");
    }
}
