//! Light samples for sixteen points, in SIMD where the lights support it; see
//! [`crate::shading::lights::choose_light_point`].

use crate::core::techniques::Techniques;
use crate::prepare::light::arrays::LightLanes;
use crate::prepare::light::emitter::LightSample;
use crate::prepare::prepared::Prepared;
use crate::sampling::warp::{shifted, shifted_single};
use crate::sampling::{Sampler, SamplerLanes};
use crate::shading::dimensions::{DIM_LIGHT, DIM_LIGHT_POINT};
use crate::shading::environment_sampling::EnvironmentSampling;
use crate::shading::lights::LightPoint;
use crate::shading::simd::lanes::lanes_of;
use firstlight_simd::{
    Bits, Float, InstructionSet, Kernel, LANES, Mask, Real, Simd, Vector, dispatch, select, select_vector,
};
use glam::Vec3;

/// A light sample per lane.
pub(crate) struct FoundLights<S: Simd> {
    pub found: Mask,
    /// Lanes whose light is infinitely far away.
    pub infinite: Mask,
    pub target: Vector<S>,
    pub wi: Vector<S>,
    pub pdf: Float<S>,
    pub radiance: Vector<S>,
}

/// Arguments for a light sample per lane of `mask`; all kinds of materials share the code of the kernel.
pub(crate) struct LightPoints<'a, S: Simd> {
    pub scene: &'a Prepared,
    pub techniques: &'a Techniques,
    pub mask: Mask,
    pub position: Vector<S>,
    /// Of the side that is lit.
    pub normal: Vector<S>,
    /// Whether the other side is lit too.
    pub both_sides: bool,
    pub sampler: &'a SamplerLanes<S>,
    pub dimension: u32,
    /// Number of the sample, if several are taken.
    pub candidate: u32,
}

impl<S: Simd> Kernel<S> for &LightPoints<'_, S> {
    type Output = FoundLights<S>;

    #[inline(always)]
    fn run(self, _: S) -> FoundLights<S> {
        light_points(self)
    }
}

#[inline(always)]
fn light_points<S: Simd>(asked: &LightPoints<S>) -> FoundLights<S> {
    let LightPoints { scene, techniques, mask, normal, both_sides, sampler, dimension, candidate, .. } = *asked;
    let environment = EnvironmentSampling::of(scene, techniques);
    if both_sides || environment.is_some() {
        // Apart: what most scenes do not need would make the rest slower.
        return asked.position.x.s.call(AllLights { asked, environment });
    }
    let u = shifted(sampler.pair(dimension + DIM_LIGHT_POINT), candidate);
    let mut u_select = u[0];
    if scene.tables.lights.selects_apart() {
        u_select = shifted_single(sampler.single(dimension + DIM_LIGHT), candidate);
    }
    points_on_lights(asked, mask, Some(normal), u_select, u)
}

/// - `mask`: lanes of those of `asked`; `normal`: of the side that is lit; both are if there is none.
#[inline(always)]
fn points_on_lights<S: Simd>(
    asked: &LightPoints<S>,
    mask: Mask,
    normal: Option<Vector<S>>,
    u_select: Float<S>,
    u: [Float<S>; 2],
) -> FoundLights<S> {
    let LightPoints { scene, techniques, position, .. } = *asked;
    let lights = &scene.tables.lights;
    match lights.sample_lanes(&scene.shading.textures, techniques, mask, (position, normal), u_select, u) {
        Some(LightLanes { found, target, wi, pdf, radiance, is_far, .. }) => {
            FoundLights { found, infinite: is_far, target, wi, pdf, radiance }
        }
        None => FoundLights::none(u[0]),
    }
}

/// Light samples where the environment is sampled as well, or both sides are lit.
struct AllLights<'a, 'b, S: Simd> {
    asked: &'a LightPoints<'b, S>,
    environment: Option<EnvironmentSampling<'b>>,
}

impl<S: Simd> Kernel<S> for AllLights<'_, '_, S> {
    type Output = FoundLights<S>;

    #[inline(always)]
    fn run(self, _: S) -> FoundLights<S> {
        let Self { asked, environment } = self;
        let &LightPoints { scene, mask, position, normal, both_sides, sampler, dimension, candidate, .. } = asked;
        let u = shifted(sampler.pair(dimension + DIM_LIGHT_POINT), candidate);
        let mut u_select = u[0];
        if scene.tables.lights.selects_apart() || environment.is_some() {
            u_select = shifted_single(sampler.single(dimension + DIM_LIGHT), candidate);
        }
        let zero = u[0].all(0.0);
        let (side, normal) = if both_sides { (Vector::all(zero), None) } else { (normal, Some(normal)) };
        let share = match &environment {
            Some(environment) => environment.share(position, side),
            None => zero,
        };
        let outside = mask & u_select.lt(share);
        let inside = mask & !outside;
        let mut points = FoundLights::none(zero);
        if inside != 0 {
            let rest = (u_select - share) / (zero.all(1.0) - share);
            points = points_on_lights(asked, inside, normal, rest.at_least(0.0).at_most(1.0f32.next_down()), u);
            points.pdf = points.pdf * (zero.all(1.0) - share);
        }
        let Some(environment) = environment.filter(|_| outside != 0) else { return points };
        let (found, wi, pdf) = environment.sample_lanes(outside, position, normal, u);
        let radiance = scene.shading.environment.radiance_lanes(outside, wi);
        FoundLights {
            found: points.found | found & outside,
            infinite: points.infinite | outside,
            target: select_vector(outside, wi, points.target),
            wi: select_vector(outside, wi, points.wi),
            pdf: select(outside, pdf * share, points.pdf),
            radiance: select_vector(outside, radiance, points.radiance),
        }
    }
}

impl<S: Simd> FoundLights<S> {
    #[inline(always)]
    fn none(any: Float<S>) -> Self {
        let zero = any.all(0.0);
        let nowhere = Vector::all(zero);
        Self { found: 0, infinite: 0, target: nowhere, wi: nowhere, pdf: zero, radiance: nowhere }
    }
}

/// A place on a surface that asks for a point on a light: its position, its normal, which is zero for light on both
/// sides, and the sampler of its path.
pub(crate) type LitPlace = (Vec3, Vec3, Sampler);

/// As [`crate::shading::lights::choose_light_point`] for each place, with the same result.
pub(crate) fn choose_light_points(
    set: InstructionSet,
    scene: &Prepared,
    techniques: &Techniques,
    dimension: u32,
    candidate: u32,
    places: &[Option<LitPlace>; LANES],
) -> [Option<LightPoint>; LANES] {
    let mut points = [None; LANES];
    // Those that are lit from one side, and from both.
    let mut groups = [false, true].map(|both_sides| LitLanes { both_sides, ..LitLanes::default() });
    for (lane, place) in places.iter().enumerate() {
        if let Some((position, normal, sampler)) = place {
            groups[usize::from(*normal == Vec3::ZERO)].push(lane, *position, *normal, sampler);
        }
    }
    for lanes in groups.iter().filter(|lanes| lanes.mask != 0) {
        let points = &mut points;
        dispatch!(
            set,
            choose(
                scene: &Prepared,
                techniques: &Techniques,
                dimension: u32,
                candidate: u32,
                lanes: &LitLanes,
                points: &mut [Option<LightPoint>; LANES],
            )
        );
    }
    points
}

/// Places by component.
#[derive(Default)]
struct LitLanes {
    mask: Mask,
    both_sides: bool,
    positions: [[f32; LANES]; 3],
    normals: [[f32; LANES]; 3],
    samplers: [[u32; LANES]; 3],
}

impl LitLanes {
    fn push(&mut self, lane: usize, position: Vec3, normal: Vec3, sampler: &Sampler) {
        self.mask |= 1 << lane;
        for k in 0..3 {
            self.positions[k][lane] = position[k];
            self.normals[k][lane] = normal[k];
            self.samplers[k][lane] = sampler.parts()[k];
        }
    }
}

#[inline(always)]
fn choose<S: Simd>(
    s: S,
    scene: &Prepared,
    techniques: &Techniques,
    dimension: u32,
    candidate: u32,
    lanes: &LitLanes,
    points: &mut [Option<LightPoint>; LANES],
) {
    let [stream, reversed_index, screen] = lanes.samplers.each_ref().map(|part| Bits::load(s, part));
    let sampler = &SamplerLanes { stream, reversed_index, screen };
    let [position, normal] = [&lanes.positions, &lanes.normals].map(|values| Vector::from_arrays(s, values));
    let LitLanes { mask, both_sides, .. } = *lanes;
    let asked = LightPoints { scene, techniques, mask, position, normal, both_sides, sampler, dimension, candidate };
    let found = s.call(&asked);
    let [target, wi, radiance] = [found.target, found.wi, found.radiance].map(|values| values.to_arrays());
    let pdf = found.pdf.to_array();
    for lane in lanes_of(found.found & lanes.mask) {
        let at = |values: &[[f32; LANES]; 3]| Vec3::new(values[0][lane], values[1][lane], values[2][lane]);
        let is_far = found.infinite & (1 << lane) != 0;
        let sample = LightSample { target: at(&target), wi: at(&wi), pdf: pdf[lane], radiance: at(&radiance), is_far };
        points[lane] = Some(((!is_far).then_some(sample.target), sample));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::environment::Environment;
    use crate::core::material::{ColorInput, Material};
    use crate::core::snapshot::Object;
    use crate::shading::lights::choose_light_point;
    use crate::test_scene::prepared;
    use firstlight_kdtree::Shape;

    /// Spheres and quads that emit light, `n` of them.
    fn scene_of(n: u32) -> Prepared {
        let materials = vec![Material::Emissive { radiance: ColorInput::Constant(Vec3::new(3.0, 2.0, 1.0)) }];
        let shapes = (0..n).map(|i| {
            let u = Sampler::new(3, i, 0, 0).pair(0);
            let at = Vec3::new(6.0 * u.x - 3.0, 4.0 + i as f32 % 3.0, 6.0 * u.y - 3.0);
            match i % 2 {
                0 => Shape::Sphere { center: at, radius: 0.1 + 0.2 * u.x },
                _ => Shape::Quad { corner: at, edge_u: Vec3::X * (0.2 + u.y), edge_v: Vec3::Z * 0.5 },
            }
        });
        let objects = (0..n).map(|_| Object::plain(0)).collect();
        prepared(shapes.collect(), objects, materials, Environment::Black)
    }

    #[test]
    fn points_for_sixteen_places_are_those_for_each_place() {
        let techniques = Techniques::default();
        // One light, a few, which are selected by estimates, and many, which are selected by the tree.
        for n in [1, 5, 40] {
            let scene = scene_of(n);
            let mut n_found = 0;
            for first in 0..40 {
                let places: [Option<LitPlace>; LANES] = std::array::from_fn(|lane| {
                    let sampler = Sampler::new(11, first, lane as u32, 0);
                    let (u, v) = (sampler.pair(20), sampler.pair(21));
                    let position = Vec3::new(8.0 * u.x - 4.0, 3.0 * v.x, 8.0 * u.y - 4.0);
                    // Some ask for light on both sides, some for none.
                    let normal =
                        if lane % 5 == 3 { Vec3::ZERO } else { Vec3::new(u.y - 0.5, 0.7, v.y - 0.5).normalize() };
                    (lane % 7 != 6).then_some((position, normal, sampler))
                });
                let candidate = first % 4;
                let points = choose_light_points(InstructionSet::detect(), &scene, &techniques, 3, candidate, &places);
                for set in InstructionSet::available() {
                    let again = choose_light_points(set, &scene, &techniques, 3, candidate, &places);
                    assert_eq!(format!("{points:?}"), format!("{again:?}"), "{set:?}");
                }
                for (place, point) in places.iter().zip(points) {
                    let expected = place.and_then(|(position, normal, sampler)| {
                        choose_light_point(&scene, &techniques, [position, normal], &sampler, 3, candidate)
                    });
                    assert_eq!(point.is_some(), expected.is_some());
                    let (Some((target, sample)), Some((expected_target, expected))) = (point, expected) else {
                        continue;
                    };
                    n_found += 1;
                    assert_eq!(target.is_some(), expected_target.is_some());
                    assert!((sample.pdf / expected.pdf - 1.0).abs() < 1e-3, "{} for {}", sample.pdf, expected.pdf);
                    assert!(sample.wi.distance(expected.wi) < 1e-3, "{} for {}", sample.wi, expected.wi);
                    assert!(sample.radiance.distance(expected.radiance) < 1e-4);
                }
            }
            assert!(n_found > 300, "{n} lights: {n_found}");
        }
    }
}
