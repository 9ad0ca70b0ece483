//! Sampling of light paths: from which light to start, and at which caster, a specular object that makes caustics, to
//! aim.
//!
//! A line from a light is sampled in three steps: a pair of light and caster by the flux between them, a point on the
//! light uniformly over its area (on a sphere: over the cap from which the caster is visible), and a direction
//! uniformly over the cone of the caster's bounding sphere. A line counts only if the caster that it was aimed at is
//! its first hit, so its pdf follows from light, point and that caster alone, without a sum over all cones that contain
//! it.
//!
//! Pdfs are per unit of étendue, cos θ · area · solid angle, which is the same at both ends of a line.

use crate::core::material::Material;
use crate::core::snapshot::Geometry;
use crate::core::texture::Texture;
use crate::prepare::bodies::Bodies;
use crate::prepare::delta_lines::{self, DeltaLine};
use crate::prepare::environment_lines::{EnvironmentLine, EnvironmentLines};
use crate::prepare::guide::Guide;
use crate::prepare::light::LightTable;
use crate::prepare::light::emitter::Light;
use crate::prepare::light::shape::LightShape;
use crate::prepare::outside::Outside;
use crate::prepare::plan_cache::PlanCache;
use crate::sampling::{AliasTable, Sampler, cosine_hemisphere, one_minus_cos_from_sin2, uniform_cone};
use firstlight_kdtree::geometry::{Frame, Ray, robust};
use firstlight_kdtree::{Hit, Shape};
use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, PI, TAU};
use std::sync::OnceLock;

/// No caster.
pub(crate) const NO_CASTER: u32 = u32::MAX;

/// Maximum number of pairs of light and caster that are weighted individually; above it, both are sampled
/// independently.
const MAX_PAIRS: usize = 1 << 16;

/// Sample dimensions of a line.
const DIM_POINT: u32 = 0;
const DIM_DIRECTION: u32 = 1;
const DIM_PAIR: u32 = 2;
pub(crate) const LINE_DIMENSIONS: u32 = 3;

/// All casters, and the sampling weights of their pairs with lights.
#[derive(Debug)]
pub(crate) struct CasterTable {
    casters: Vec<Caster>,
    /// Per object: the first of its casters, and whether each of its primitives is a caster.
    by_object: Vec<(u32, bool)>,
    /// The environment is the light after all others.
    pairs: Pairs,
    environment: Option<EnvironmentLines>,
    outside: Outside,
    /// Media that contain each delta light, indexed like all lights; see [`crate::prepare::bodies::Bodies::around`].
    /// Empty if there are none.
    media: Vec<Vec<u32>>,
    /// Built when first needed.
    pub(crate) guide: OnceLock<Guide>,
    /// Cached plans for caustics in images of the scene.
    pub(crate) plans: PlanCache,
}

/// Bounding sphere of a specular object; of infinite radius for a plane.
#[derive(Clone, Copy, Debug)]
struct Caster {
    center: Vec3,
    radius: f32,
}

#[derive(Debug)]
enum Pairs {
    /// For each light, all casters.
    Joint(AliasTable),
    Apart {
        lights: AliasTable,
        casters: AliasTable,
    },
}

/// A line from a light.
pub(crate) struct LightLine {
    pub ray: Ray,
    /// The caster that must be its first hit.
    pub caster: u32,
    /// Pdf per unit of étendue, 1 / (m² sr); for a delta light, per steradian or per square metre.
    pub density: f32,
    /// Radiance, W·m⁻²·sr⁻¹; for a delta light, W·sr⁻¹ or W·m⁻².
    pub radiance: Vec3,
    pub light: u32,
    /// Whether the light is a delta light, which no camera path finds.
    pub is_delta: bool,
    /// Whether it comes from outside of the scene: absorption by the air does not apply.
    pub is_far: bool,
}

impl CasterTable {
    /// Returns `None` if no light that lines start from can reach a specular surface.
    ///
    /// - `environment`: `None` if camera paths find it well enough.
    pub fn build(
        geometry: &Geometry,
        materials: &[Material],
        lights: &LightTable,
        environment: Option<EnvironmentLines>,
    ) -> Option<Self> {
        let mut casters = Vec::new();
        let is_specular: Vec<bool> = materials.iter().map(|material| material.is_specular(materials)).collect();
        let by_object = geometry
            .objects
            .iter()
            .zip(geometry.tree.shapes())
            .map(|(object, shape)| {
                if !object.materials.iter().any(|&id| is_specular[id as usize]) {
                    return (NO_CASTER, false);
                }
                let first = casters.len() as u32;
                match shape {
                    Shape::Spheres { tree, world_from_object } => {
                        let scale = world_from_object.matrix3.x_axis.length();
                        casters.extend((0..tree.len() as u32).map(|i| {
                            let (center, radius) = tree.sphere(i);
                            Caster { center: world_from_object.transform_point3(center), radius: radius * scale }
                        }));
                        (first, true)
                    }
                    _ => {
                        casters.push(Caster::around(geometry, object, shape));
                        (first, false)
                    }
                }
            })
            .collect();
        if casters.is_empty() {
            return None;
        }
        let pairs = Pairs::new(&casters, lights, environment.as_ref())?;
        let outside = Outside::of(&geometry.tree);
        Some(Self {
            casters,
            by_object,
            pairs,
            environment,
            outside,
            media: Vec::new(),
            guide: OnceLock::new(),
            plans: PlanCache::default(),
        })
    }

    /// Determines the media of delta lights.
    pub fn with_media(mut self, geometry: &Geometry, bodies: &Bodies, lights: &LightTable) -> Self {
        self.media = (lights.lights.iter())
            .map(|light| match light.shape {
                LightShape::Point { position, .. } => bodies.around(geometry, position),
                _ => Vec::new(),
            })
            .collect();
        self
    }

    /// Whether lines start at the environment too.
    pub fn has_environment(&self) -> bool {
        self.environment.is_some()
    }

    /// Rows of the bodies that contain a delta light; empty for all other lights.
    pub fn media_of(&self, light: u32) -> &[u32] {
        self.media.get(light as usize).map_or(&[], Vec::as_slice)
    }

    /// Returns the caster of a hit, [`NO_CASTER`] if none.
    #[inline]
    pub fn of_hit(&self, hit: &Hit) -> u32 {
        match self.by_object[hit.object as usize] {
            (first, true) => first + hit.prim,
            (first, false) => first,
        }
    }

    /// Chooses a light and a caster by the flux between them; returns them with the probability. The light after all
    /// others is the environment.
    pub(crate) fn choose(&self, u: f32) -> (u32, u32, f32) {
        self.pairs.sample(self.casters.len(), u)
    }

    /// Center and radius of the bounding sphere of a caster, metres; the radius of a plane is infinite.
    pub(crate) fn bounds(&self, caster: u32) -> (Vec3, f32) {
        let Caster { center, radius } = self.casters[caster as usize];
        (center, radius)
    }

    /// Samples a line from some light towards some caster; `None` if it points into the light.
    pub(crate) fn sample(&self, lights: &LightTable, textures: &[Texture], sampler: &Sampler) -> Option<LightLine> {
        let (light_id, caster, pmf) = self.choose(sampler.single(DIM_PAIR));
        let line = if light_id as usize == lights.len() {
            let (of_direction, of_origin) = (sampler.pair(DIM_DIRECTION), sampler.pair(DIM_POINT));
            let line =
                self.environment.as_ref()?.sample(&self.outside, self.bounds(caster), of_direction, of_origin)?;
            let EnvironmentLine { ray, density, radiance } = line;
            LightLine { ray, caster, density: pmf * density, radiance, light: light_id, is_delta: false, is_far: true }
        } else if lights.light(light_id).shape.delta().is_some() {
            let u = sampler.pair(DIM_DIRECTION);
            let line = delta_lines::sample(lights.light(light_id), textures, &self.outside, self.bounds(caster), u)?;
            let DeltaLine { ray, density, strength: radiance, is_far } = line;
            LightLine { ray, caster, density: pmf * density, radiance, light: light_id, is_delta: true, is_far }
        } else {
            self.line_from_surface(lights, textures, sampler, (light_id, caster))?
        };
        (line.density > 0.0 && line.density.is_finite()).then_some(line)
    }

    /// Samples a line from a light with a surface towards a caster.
    fn line_from_surface(
        &self,
        lights: &LightTable,
        textures: &[Texture],
        sampler: &Sampler,
        (light_id, caster): (u32, u32),
    ) -> Option<LightLine> {
        let light = lights.light(light_id);
        let Caster { center, radius } = self.casters[caster as usize];
        let u = sampler.pair(DIM_POINT);
        let point = match light.shape {
            LightShape::Sphere { center: light_center, radius: light_radius } => {
                let cap = cap_height(light_center, light_radius, center, radius);
                // The cap is a cone of normals.
                let (local, _) = uniform_cap(u, cap);
                light.shape.at_normal(Frame::around((center - light_center).normalize_or(Vec3::Y)).to_world(local))
            }
            _ => light.shape.at_area(u),
        };
        let u = sampler.pair(DIM_DIRECTION);
        let to_center = center - point.position;
        let distance2 = to_center.length_squared();
        let dir = if distance2 > radius * radius {
            let one_minus_cos_max = one_minus_cos_from_sin2(radius * radius / distance2);
            Frame::around(to_center / distance2.sqrt()).to_world(uniform_cone(u.to_array(), one_minus_cos_max).0.into())
        } else {
            Frame::around(point.normal).to_world(cosine_hemisphere(u))
        }
        .normalize();
        let cos = dir.dot(point.normal);
        let density = self.density(lights, light_id, caster, point.position, cos);
        if !(cos > 0.0) {
            return None;
        }
        let radiance = light.radiance(textures, point.normal, point.uv);
        let origin = robust::offset_ray_origin(point.position, point.error, point.normal, dir);
        let ray = Ray::new(origin, dir);
        Some(LightLine { ray, caster, density, radiance, light: light_id, is_delta: false, is_far: false })
    }

    /// Pdf of [`Self::sample`] for a line from the environment whose first hit is `caster`; per unit of étendue. `None`
    /// if there are no such lines.
    ///
    /// - `to_light`: unit.
    pub(crate) fn environment_density(&self, lights: &LightTable, caster: u32, to_light: Vec3) -> Option<f32> {
        let environment = self.environment.as_ref()?;
        let pmf = self.pairs.pmf(self.casters.len(), lights.len() as u32, caster);
        Some(if pmf > 0.0 { pmf * environment.density(self.casters[caster as usize].radius, to_light) } else { 0.0 })
    }

    /// Pdf of [`Self::sample`] for a line from `position` on a light, with cosine `cos` to its normal, whose first hit
    /// is `caster`; per unit of étendue.
    pub(crate) fn density(&self, lights: &LightTable, light_id: u32, caster: u32, position: Vec3, cos: f32) -> f32 {
        let pmf = self.pairs.pmf(self.casters.len(), light_id, caster);
        let Caster { center, radius } = self.casters[caster as usize];
        let area = match &lights.light(light_id).shape {
            LightShape::Sphere { center: light_center, radius: light_radius } => {
                TAU * light_radius * light_radius * cap_height(*light_center, *light_radius, center, radius)
            }
            flat => flat.area(),
        };
        let distance2 = position.distance_squared(center);
        let by_angle = if distance2 > radius * radius {
            1.0 / (TAU * one_minus_cos_from_sin2(radius * radius / distance2) * cos)
        } else {
            FRAC_1_PI
        };
        pmf / area * by_angle
    }
}

impl Caster {
    fn around(geometry: &Geometry, object: &crate::core::snapshot::Object, shape: &Shape) -> Self {
        let of_points = |center: Vec3, points: &mut dyn Iterator<Item = Vec3>| {
            // With a margin for the rounding of both ends.
            let reach2 = points.map(|p| p.distance_squared(center)).fold(0.0, f32::max);
            Self { center, radius: reach2.sqrt() * (1.0 + 8.0 * f32::EPSILON) }
        };
        match shape {
            Shape::Sphere { center, radius } => Self { center: *center, radius: *radius },
            Shape::Plane { point, .. } => Self { center: *point, radius: f32::INFINITY },
            Shape::Quad { corner, edge_u, edge_v } => of_points(
                *corner + 0.5 * (*edge_u + *edge_v),
                &mut [*corner, *corner + *edge_u, *corner + *edge_v, *corner + *edge_u + *edge_v].into_iter(),
            ),
            Shape::Triangle { vertices } => {
                of_points((vertices[0] + vertices[1] + vertices[2]) / 3.0, &mut vertices.iter().copied())
            }
            Shape::Mesh { tree, world_from_object, .. } => {
                let bounds = tree.bounds();
                let center = world_from_object.transform_point3(0.5 * (bounds.min + bounds.max));
                let mesh = object.mesh.as_ref().expect("a mesh shape brings its mesh");
                of_points(center, &mut mesh.positions.iter().map(|&p| world_from_object.transform_point3(p)))
            }
            Shape::Spheres { .. } => {
                let bounds = geometry.tree.bounds();
                of_points(0.5 * (bounds.min + bounds.max), &mut [bounds.min, bounds.max].into_iter())
            }
        }
    }

    /// An estimate of the étendue between a light and the sphere, zero only if no part of the light sees any part of
    /// it.
    fn coupling(&self, light: &LightShape) -> f64 {
        if light.delta().is_some() {
            return delta_lines::coupling(light, self.center, self.radius);
        }
        let light_area = light.area();
        if let LightShape::Sphere { center, radius } = light {
            let sin2 = (self.radius * self.radius / center.distance_squared(self.center)).min(1.0);
            return f64::from(PI * radius * radius * PI * sin2);
        }
        const SIDE: u32 = 4;
        let at = |i: u32| Vec2::new((i % SIDE) as f32 + 0.5, (i / SIDE) as f32 + 0.5) / SIDE as f32;
        let over_points = (0..SIDE * SIDE).map(|i| {
            let point = light.at_area(at(i));
            let offset = self.center - point.position;
            let distance = offset.length();
            if distance <= self.radius {
                return 1.0;
            }
            let (cos, sin) = (offset.dot(point.normal) / distance, self.radius / distance);
            // The form factor of a sphere, with a parabola where the horizon cuts it.
            f64::from(sin * sin * if cos >= sin { cos } else { (cos + sin).max(0.0).powi(2) / (4.0 * sin) })
        });
        f64::from(PI * light_area) * over_points.sum::<f64>() / f64::from(SIDE * SIDE)
    }
}

impl Pairs {
    fn new(casters: &[Caster], lights: &LightTable, environment: Option<&EnvironmentLines>) -> Option<Self> {
        let lights: Vec<_> = (0..lights.len() as u32).map(|id| lights.light(id)).collect();
        if (lights.len() + 1) * casters.len() <= MAX_PAIRS {
            let flux = lights.iter().flat_map(|light| {
                casters.iter().map(|caster| f64::from(light.mean_radiance) * caster.coupling(&light.shape))
            });
            let of_environment = casters.iter().filter_map(|caster| Some(environment?.flux(caster.radius)));
            let flux: Vec<f64> = flux.chain(of_environment).collect();
            return flux.iter().any(|&flux| flux > 0.0).then(|| Self::Joint(AliasTable::new(&flux)));
        }
        let mut powers: Vec<f64> =
            lights.iter().map(|light| f64::from(light.mean_radiance) * f64::from(light.shape.area())).collect();
        let is_far = |light: &Light| matches!(light.shape, LightShape::Directional { .. });
        let near = lights.iter().zip(&powers).filter(|(light, _)| !is_far(light));
        let near_total: f64 = near.clone().map(|(_, &power)| power).sum();
        let middle = near.map(|(light, &power)| light.shape.center().as_dvec3() * (power / near_total));
        let middle = middle.sum::<glam::DVec3>().as_vec3();
        let share = |caster: &Caster| {
            let distance2 = caster.center.distance_squared(middle);
            f64::from(if caster.radius.is_finite() {
                (caster.radius * caster.radius / distance2).min(1.0)
            } else {
                1.0
            })
        };
        let shares: Vec<f64> = casters.iter().map(share).collect();
        if let Some(environment) = environment {
            // The flux of a light is estimated as π times its power times all shares.
            let flux: f64 = casters.iter().map(|caster| environment.flux(caster.radius)).sum();
            powers.push(flux / (f64::from(PI) * shares.iter().sum::<f64>()));
        }
        if !(powers.iter().sum::<f64>() > 0.0) {
            return None;
        }
        let casters = AliasTable::new(&shares);
        Some(Self::Apart { lights: AliasTable::new(&powers), casters })
    }

    /// Returns light, caster and the probability of the choice.
    fn sample(&self, n_casters: usize, u: f32) -> (u32, u32, f32) {
        match self {
            Self::Joint(table) => {
                let (pair, pmf, _) = table.sample(u);
                (pair / n_casters as u32, pair % n_casters as u32, pmf)
            }
            Self::Apart { lights, casters } => {
                let (light, light_pmf, u) = lights.sample(u);
                let (caster, caster_pmf, _) = casters.sample(u);
                (light, caster, light_pmf * caster_pmf)
            }
        }
    }

    fn pmf(&self, n_casters: usize, light: u32, caster: u32) -> f32 {
        match self {
            Self::Joint(table) => table.pmf(light * n_casters as u32 + caster),
            Self::Apart { lights, casters } => lights.pmf(light) * casters.pmf(caster),
        }
    }
}

/// Height over radius of the cap of a light from which a part of a sphere is visible; 0..2.
fn cap_height(light_center: Vec3, light_radius: f32, center: Vec3, radius: f32) -> f32 {
    let distance = light_center.distance(center);
    if radius.is_infinite() || distance <= (light_radius - radius).abs() {
        return 2.0;
    }
    // With a margin, so that rounding excludes nothing.
    (1.0 - (light_radius - radius) / distance + 8.0 * f32::EPSILON).clamp(0.0, 2.0)
}

/// Samples uniformly over the cap of the unit sphere about +z, up to the whole sphere.
fn uniform_cap(u: Vec2, height: f32) -> (Vec3, f32) {
    let one_minus_cos = u.x * height;
    let sin = (one_minus_cos * (2.0 - one_minus_cos)).max(0.0).sqrt();
    let (sin_phi, cos_phi) = (TAU * u.y).sin_cos();
    (Vec3::new(sin * cos_phi, sin * sin_phi, 1.0 - one_minus_cos), one_minus_cos)
}
