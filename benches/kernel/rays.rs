//! The ray classes: what a path tracer asks, bounce by bounce, and segments at random.

use crate::WAVE;
use crate::meshes::Mesh;
use firstlight::geometry::{Frame, Ray, robust::offset_ray_origin};
use firstlight::kdtree::{RayBatch, RayClass, SceneTree};
use glam::{Vec3, vec3};

pub struct RaySet {
    pub name: &'static str,
    pub class: RayClass,
    pub waves: Vec<RayBatch>,
}

impl RaySet {
    fn new(name: &'static str, class: RayClass, rays: &[Ray]) -> Self {
        Self { name, class, waves: rays.chunks(WAVE).map(|wave| wave.iter().collect()).collect() }
    }

    pub fn len(&self) -> usize {
        self.waves.iter().map(RayBatch::len).sum()
    }
}

/// - `size`: width and height of the picture, a multiple of 8.
pub fn classes(scene: &SceneTree, mesh: &Mesh, size: u32) -> Vec<RaySet> {
    let bounds = scene.bounds();
    let (center, half) = (bounds.center(), 0.5 * bounds.size());
    let eye = center + half * mesh.eye;
    // Closed rooms and stadiums are seen from inside, along the floor.
    let inside = mesh.eye.abs().max_element() < 1.0;
    let target = if inside && mesh.name == "stadium" { Vec3::ZERO } else { center };
    let forward = (target - eye).normalize();
    let frame = Frame::around(forward);
    let spread = if inside { 0.6 } else { half.length() / (target - eye).length() };
    let mut random = Random(1);
    let primary: Vec<Ray> = tiles(size)
        .map(|(x, y)| {
            let sx = (x as f32 + random.unit()) / size as f32 * 2.0 - 1.0;
            let sy = (y as f32 + random.unit()) / size as f32 * 2.0 - 1.0;
            Ray::new(eye, (forward + spread * (sx * frame.x + sy * frame.y)).normalize())
        })
        .collect();
    let light = center + half * vec3(0.6, if inside { 0.8 } else { 2.0 }, -0.4);
    let (mut shadow, mut diffuse, mut diffuse2) = (vec![], vec![], vec![]);
    for ray in &primary {
        let Some((point, error, normal)) = surface(scene, ray) else { continue };
        let to_light = light - point;
        let origin = offset_ray_origin(point, error, normal, to_light);
        shadow.push(Ray { t_max: (light - origin).length(), ..Ray::new(origin, (light - origin).normalize()) });
        let bounce = random.cosine(normal);
        let ray = Ray::new(offset_ray_origin(point, error, normal, bounce), bounce);
        diffuse.push(ray);
        if let Some((point, error, normal)) = surface(scene, &ray) {
            let bounce = random.cosine(normal);
            diffuse2.push(Ray::new(offset_ray_origin(point, error, normal, bounce), bounce));
        }
    }
    let random: Vec<Ray> = (0..primary.len())
        .map(|_| {
            let mut point = || bounds.min + bounds.size() * vec3(random.unit(), random.unit(), random.unit());
            let (a, b) = (point(), point());
            Ray { t_max: (b - a).length(), ..Ray::new(a, (b - a).normalize()) }
        })
        .collect();
    vec![
        RaySet::new("primary", RayClass::Coherent, &primary),
        RaySet::new("shadow", RayClass::Coherent, &shadow),
        RaySet::new("diffuse", RayClass::Incoherent, &diffuse),
        RaySet::new("diffuse2", RayClass::Incoherent, &diffuse2),
        RaySet::new("random", RayClass::Incoherent, &random),
    ]
}

/// Pixels in tiles of 8 by 8, each as sixteens of 4 by 4.
pub fn tiles(size: u32) -> impl Iterator<Item = (u32, u32)> {
    let tile = move |n: u32| (n % (size / 8) * 8, n / (size / 8) * 8);
    let quarter = |n: u32| (n % 2 * 4, n / 2 * 4);
    (0..size * size).map(move |i| {
        let ((tx, ty), (qx, qy)) = (tile(i / 64), quarter(i / 16 % 4));
        (tx + qx + i % 4, ty + qy + i / 4 % 4)
    })
}

/// Point, error and the normal on the side of the ray.
fn surface(scene: &SceneTree, ray: &Ray) -> Option<(Vec3, Vec3, Vec3)> {
    let hit = scene.closest_hit(ray)?;
    let point = scene.surface_point(ray, &hit);
    let normal = point.geometric_normal;
    Some((point.position, point.error, if normal.dot(ray.dir) > 0.0 { -normal } else { normal }))
}

pub struct Random(pub u64);

impl Random {
    /// In 0..1.
    pub fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1u64 << 24) as f32
    }

    /// In the unit box.
    pub fn point(&mut self) -> Vec3 {
        vec3(self.unit(), self.unit(), self.unit())
    }

    pub fn cosine(&mut self, normal: Vec3) -> Vec3 {
        let (r, phi) = (self.unit().sqrt(), std::f32::consts::TAU * self.unit());
        Frame::around(normal).to_world(vec3(r * phi.cos(), r * phi.sin(), (1.0 - r * r).max(0.0).sqrt()))
    }
}
