//! Cases that render: difficult materials, lights, lenses and long sums in scenes with a known radiance.

use crate::kdtree::Shape;
use crate::render::{
    BadSample, Camera, ColorInput, Environment, Film, Fresnel, Geometry, Material, Object, Prepared, RenderSettings,
    ScalarInput, Shading, Snapshot, advance, replay_sample,
};
use crate::stability::replay::{Replay, ReplayValue};
use crate::stability::tally::{Energy, Tally};
use glam::{UVec2, Vec3, vec3};

/// One small scene with a known image.
pub struct LightCase {
    pub name: String,
    pub scene: Prepared,
    pub settings: RenderSettings,
    pub width: u32,
    pub height: u32,
    pub spp: u32,
    /// Expected radiance of every pixel, or of the mean of all.
    pub expected: f64,
    /// Allowed relative error, in addition to the noise.
    pub allowed: f64,
    /// Allowed relative loss: larger where paths may be trapped beyond their longest life.
    pub allowed_loss: f64,
    /// Whether each pixel must have the expected value, or only their mean.
    pub every_pixel: bool,
}

impl LightCase {
    /// Renders the case; counts samples that are not finite, and measures the error of the radiance.
    pub fn run(&self, index: usize, spp: u32, tick: &(dyn Fn(u64) + Sync)) -> Tally {
        let mut film = Film::new(self.width, self.height);
        let report = advance(&self.scene, &self.settings, &mut film, spp, &|| false);
        let samples = self.samples(spp);
        tick(samples);
        let means: Vec<f64> = film.means().iter().map(|mean| f64::from(mean.element_sum()) / 3.0).collect();
        let n = means.len() as f64;
        let mean = means.iter().sum::<f64>() / n;
        let variance = means.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n * (n - 1.0).max(1.0));
        let error = if self.every_pixel {
            // Unlike `max`, keeps a NaN.
            means
                .iter()
                .map(|value| (value - self.expected).abs())
                .fold(0.0, |a, b| if b > a || b.is_nan() { b } else { a })
        } else {
            ((mean - self.expected).abs() - 4.0 * variance.sqrt()).max(0.0)
        };
        let is_loss = !self.every_pixel && mean < self.expected;
        let allowed = if is_loss { self.allowed_loss } else { self.allowed };
        let energy = Energy { error: error / self.expected, allowed };
        let mut tally = Tally {
            rays: samples,
            non_finite: report.n_bad,
            above: report.n_above,
            energy: Some(energy),
            ..Tally::default()
        };
        let severity = energy.error / energy.allowed;
        tally.offer(severity, index, 0, || format!("{}: mean {mean} for {}", self.name, self.expected));
        if let Some(&BadSample { x, y, sample }) = report.bad.first().or(report.above.first()) {
            let ray =
                (u64::from(sample) * u64::from(self.height) + u64::from(y)) * u64::from(self.width) + u64::from(x);
            tally.offer(1e9, index, ray, || format!("{}: pixel {x}, {y}, sample {sample} cannot be right", self.name));
        }
        tally
    }
}

pub fn camera(eye: Vec3, look_at: Vec3, vfov_deg: f32) -> Camera {
    Camera::looking_at(eye, look_at, (0.5 * vfov_deg.to_radians()).tan())
}

fn plain(shapes: Vec<(Shape, u32)>, materials: Vec<Material>, environment: Environment, camera: Camera) -> Prepared {
    let (shapes, objects) = shapes.into_iter().map(|(shape, material)| (shape, Object::plain(material))).unzip();
    prepared(shapes, objects, materials, environment, camera)
}

pub fn prepared(
    shapes: Vec<Shape>,
    objects: Vec<Object>,
    materials: Vec<Material>,
    environment: Environment,
    camera: Camera,
) -> Prepared {
    let geometry = Geometry::build(shapes, objects);
    let shading = Shading::new(materials, Vec::new(), environment);
    Prepared::new(Snapshot::new(geometry, shading, camera))
}

pub fn grey(value: f32) -> ColorInput {
    ColorInput::Constant(Vec3::splat(value))
}

pub fn diffuse(albedo: f32) -> Material {
    Material::Diffuse { albedo: grey(albedo) }
}

fn emissive(radiance: f32) -> Material {
    Material::Emissive { radiance: grey(radiance) }
}

fn ball(center: Vec3, radius: f32) -> Shape {
    Shape::Sphere { center, radius }
}

fn floor() -> Shape {
    Shape::Plane { point: Vec3::ZERO, normal: Vec3::Y }
}

/// A white furnace: in a uniform environment, lossless objects are invisible.
fn furnace(name: impl Into<String>, shapes: Vec<(Shape, u32)>, materials: Vec<Material>, allowed: f64) -> LightCase {
    let eye = camera(vec3(0.0, 0.4, 4.0), Vec3::ZERO, 40.0);
    LightCase {
        name: name.into(),
        settings: RenderSettings::default(),
        scene: plain(shapes, materials, Environment::Constant(Vec3::ONE), eye),
        width: 16,
        height: 16,
        spp: 64,
        expected: 1.0,
        allowed,
        allowed_loss: allowed,
        every_pixel: true,
    }
}

/// Nested glass, coincident surfaces, indices next to 1, and angles close to total reflection.
pub fn glass() -> Vec<LightCase> {
    let glass = |ior: f32| Material::Glass { ior, absorption: Vec3::ZERO, dispersion: 0.0 };
    let mut pictures = vec![
        furnace(
            "four nested spheres",
            (0..4).map(|i| (ball(Vec3::ZERO, 1.0 - 0.15 * i as f32), i)).collect(),
            [1.5, 1.2, 1.8, 1.0].map(glass).into(),
            1e-4,
        ),
        furnace(
            "two spheres that touch",
            vec![(ball(Vec3::X * 0.5, 0.5), 0), (ball(Vec3::X * -0.5, 0.5), 1)],
            vec![glass(1.5), glass(1.33)],
            1e-4,
        ),
        furnace(
            "two spheres that share a surface",
            vec![(ball(Vec3::ZERO, 0.8), 0), (ball(Vec3::ZERO, 0.8), 1)],
            vec![glass(1.5), glass(1.5)],
            1e-4,
        ),
        furnace(
            "a sphere in a sphere that touches it",
            vec![(ball(Vec3::ZERO, 0.8), 0), (ball(Vec3::Y * 0.4, 0.4), 1)],
            vec![glass(1.5), glass(1.2)],
            1e-4,
        ),
    ];
    // Between several shells a few paths bounce dozens of times; roulette, from the 64th bounce on, ends them as whole
    // samples. Only the mean is free of that noise.
    pictures
        .iter_mut()
        .for_each(|picture| (picture.every_pixel, picture.allowed, picture.allowed_loss) = (false, 1e-3, 1e-3));
    for ior in [1.0, 1.0 + 1e-6, 1.0 - 1e-6, 1.0 + 1e-4, 1e-3, 0.5, 1.5, 10.0] {
        pictures.push(furnace(format!("index {ior}"), vec![(ball(Vec3::ZERO, 1.0), 0)], vec![glass(ior)], 2e-4));
    }
    // Four in a thousand paths enter, and hardly one of them leaves before roulette: the mean has their noise.
    let mut dense = furnace("index 1000", vec![(ball(Vec3::ZERO, 1.0), 0)], vec![glass(1e3)], 5e-3);
    dense.every_pixel = false;
    pictures.push(dense);
    // From inside a sphere, at the radius where the most oblique rays just reach the angle of total reflection.
    // Radiance from outside is multiplied by n² there.
    let mut inside = furnace("inside a sphere of glass", vec![(ball(Vec3::ZERO, 1.0), 0)], vec![glass(1.5)], 1e-3);
    // Total reflection traps some paths until roulette ends them.
    inside.every_pixel = false;
    inside.scene = inside.scene.with_camera(camera(vec3(0.666_66, 0.0, 0.0), vec3(0.7, 1.0, 0.0), 150.0));
    inside.expected = 2.25;
    pictures.push(inside);
    pictures
}

/// Microfacets from a mirror to maximal roughness: none may gain energy, and with compensation none may lose any.
pub fn metal() -> Vec<LightCase> {
    let mut pictures = Vec::new();
    for alpha in [0.0, 1e-20, 1e-8, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.05, 0.1, 0.2, 0.3, 0.5, 1.0] {
        let metal = Material::Metal {
            alpha: ScalarInput::Constant(alpha),
            reflectance: grey(1.0),
            fresnel: Fresnel::Constant,
            compensate: true,
        };
        let mut picture = furnace(format!("alpha {alpha:e}"), vec![(ball(Vec3::ZERO, 1.0), 0)], vec![metal], 1e-3);
        picture.every_pixel = alpha < 1e-3;
        picture.spp = 256;
        pictures.push(picture);
    }
    pictures
}

/// Sphere lights over a floor: tiny and bright, huge, and touching it. A floor point at distance d from the centre of a
/// sphere of radius r has radiance albedo · L · (r/d)² · cos θ if the whole sphere is above its horizon.
pub fn lights() -> Vec<LightCase> {
    let cases: [(&str, f32, f32, f32); 9] = [
        ("a sphere of 1 µm", 1e-6, 1.0, 0.3),
        ("a sphere of 0.1 mm", 1e-4, 1.0, 0.3),
        ("a sphere of 1 mm at 1 km", 1e-3, 1e3, 10.0),
        ("a sphere of 100 m", 100.0, 150.0, 20.0),
        ("a sphere of 10 km", 1e4, 1.5e4, 200.0),
        ("a sphere that touches, near", 1.0, 1.0, 0.01),
        ("a sphere that touches, far", 1.0, 1.0, 3.0),
        ("a sphere of 10 km that touches", 1e4, 1e4, 1e3),
        ("a sphere slightly above", 1.0, 1.000_001, 0.001),
    ];
    cases
        .into_iter()
        .map(|(name, radius, height, x)| {
            let d2 = f64::from(x).powi(2) + f64::from(height).powi(2);
            let share = f64::from(radius).powi(2) / d2 * f64::from(height) / d2.sqrt();
            // Emission for a floor radiance of about 1.
            let radiance = (2.0 / share) as f32;
            // A grazing view, so that the sphere does not block it; a small field of view, so that all pixels have
            // equal radiance.
            let eye_height = (1e-3 * x).min(0.1);
            let eye = vec3(x, eye_height, eye_height);
            let materials = vec![diffuse(0.5), emissive(radiance)];
            let shapes = vec![(floor(), 0), (ball(vec3(0.0, height, 0.0), radius), 1)];
            let view = camera(eye, vec3(x, 0.0, 0.0), 0.01);
            LightCase {
                name: name.to_owned(),
                settings: RenderSettings::default(),
                scene: plain(shapes, materials, Environment::Black, view),
                width: 8,
                height: 8,
                spp: 256,
                expected: 0.5 * f64::from(radiance) * share,
                allowed: 3e-3,
                allowed_loss: 3e-3,
                every_pixel: false,
            }
        })
        .collect()
}

/// Fields of view of 1° … 170°, focus from 0⁺ to ∞, and lenses larger than the scene: in a uniform environment every
/// ray has radiance 1.
pub fn cameras() -> Vec<LightCase> {
    let mut pictures = Vec::new();
    for vfov in [1e-3, 1.0, 30.0, 120.0, 170.0, 179.9] {
        for focus in [f32::MIN_POSITIVE, 1e-30, 1e-21, 1e-6, 1.0, 1e6, 1e30, f32::MAX, f32::INFINITY] {
            for lens in [0.0, 1e-30, 1e-6, 0.05, 1e3, 1e12] {
                let mut view = camera(vec3(0.0, 0.4, 4.0), Vec3::ZERO, vfov);
                (view.focus_distance, view.lens_radius) = (focus, lens);
                let shapes = vec![(ball(Vec3::ZERO, 1.0), 0), (ball(vec3(0.3, 0.2, 1.5), 0.1), 1)];
                let materials = vec![Material::Mirror { reflectance: grey(1.0) }, emissive(1.0)];
                pictures.push(LightCase {
                    name: format!("{vfov}°, focus {focus:e} m, lens {lens:e} m"),
                    settings: RenderSettings::default(),
                    scene: plain(shapes, materials, Environment::Constant(Vec3::ONE), view),
                    width: 8,
                    height: 6,
                    spp: 16,
                    expected: 1.0,
                    allowed: 1e-6,
                    allowed_loss: 1e-6,
                    every_pixel: true,
                });
            }
        }
    }
    // The back of an emissive sphere is black: a lens that reaches into it would see that.
    pictures.iter_mut().filter(|p| p.scene.camera.lens_radius >= 1e3).for_each(|p| p.every_pixel = false);
    pictures
}

/// 10⁶ samples in one pixel of a room whose walls emit 1 − ρ and reflect ρ: the radiance is 1 everywhere, and a sum
/// that loses precision drifts away from it.
pub fn long_sums() -> Vec<LightCase> {
    [0.0f32, 0.5, 0.9]
        .into_iter()
        .map(|albedo| {
            // The blend consists of a black body of radiance 1 with weight w and a white surface with weight 1 − w.
            let blend = Material::blend(ScalarInput::Constant(1.0 - albedo), 0, 1);
            let materials = vec![diffuse(1.0), emissive(1.0), blend];
            let shapes = vec![
                (Shape::Plane { point: Vec3::Y, normal: Vec3::NEG_Y }, 2),
                (Shape::Plane { point: Vec3::NEG_Y, normal: Vec3::Y }, 2),
                (Shape::Plane { point: Vec3::X, normal: Vec3::NEG_X }, 2),
                (Shape::Plane { point: Vec3::NEG_X, normal: Vec3::X }, 2),
                (Shape::Plane { point: Vec3::Z, normal: Vec3::NEG_Z }, 2),
                (Shape::Plane { point: Vec3::NEG_Z, normal: Vec3::Z }, 2),
            ];
            let view = camera(vec3(0.1, 0.2, 0.3), vec3(1.0, 0.4, 0.2), 30.0);
            LightCase {
                name: format!("a glowing room of albedo {albedo}, one pixel"),
                settings: RenderSettings::default(),
                scene: plain(shapes, materials, Environment::Black, view),
                width: 1,
                height: 1,
                spp: 1_000_000,
                expected: 1.0,
                // Without noise the result is exact; otherwise about 6 standard errors at a million samples.
                allowed: if albedo == 0.0 { 1e-12 } else { 0.05 },
                allowed_loss: 0.05,
                every_pixel: true,
            }
        })
        .collect()
}

impl LightCase {
    /// Number of samples of the image at `spp` samples per pixel.
    pub fn samples(&self, spp: u32) -> u64 {
        u64::from(self.width) * u64::from(self.height) * u64::from(spp)
    }

    /// Replays one sample by the index that [`Self::run`] reports.
    pub fn replay(&self, ray: u64) -> Replay {
        let (x, row) = (ray % u64::from(self.width), ray / u64::from(self.width));
        let (y, sample) = (row % u64::from(self.height), row / u64::from(self.height));
        let at = BadSample { x: x as u32, y: y as u32, sample: sample as u32 };
        let size = UVec2::new(self.width, self.height);
        let radiance = replay_sample(&self.scene, &self.settings, size, at);
        let mut replay = Replay::default();
        replay.push("image", ReplayValue::Text(self.name.clone()));
        replay.push("pixel_x", ReplayValue::Count(x));
        replay.push("pixel_y", ReplayValue::Count(y));
        replay.push("sample", ReplayValue::Count(sample));
        replay.push("radiance", ReplayValue::Vector(radiance));
        replay.push("expected_mean", ReplayValue::Double(self.expected));
        replay
    }
}
