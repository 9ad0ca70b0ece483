//! Light paths in SIMD; [`crate::integrators::caustics::trace`] is the scalar version.
//!
//! Diffuse and rough surfaces are handled where the shading normal is the true normal, because there the camera and the
//! light see the same surface; mirrors and glass are always handled.

use crate::core::camera::{Camera, Connection};
use crate::integrators::caustics::dimensions::{DIM_LENS, DIM_ROULETTE, most_kept};
use crate::integrators::caustics::lens_connections::LensConnections;
use crate::integrators::common::caustics_pass::CausticPass;
use crate::integrators::common::caustics_weight::etendue_gain;
use crate::integrators::simd::shade::scatters;
use crate::prepare::casters::NO_CASTER;
use crate::prepare::material_table::COATED;
use crate::prepare::surface_table::SurfaceTable;
use crate::sampling::SamplerLanes;
use crate::sampling::warp::uniform_disc;
use crate::shading::interface::MediumId;
use crate::shading::medium::MediumSets;
use crate::shading::paths::{PathBatch, PathLanes};
use crate::shading::simd::hints::HintLanes;
use crate::shading::simd::lane_group::LaneGroup;
use crate::shading::simd::lanes::{DIFFUSE, GLASS, METAL, MIRROR, PLASTIC, lanes_of, transmittance};
use crate::shading::simd::scatter::{LobeLanes, eval, sample, surface_of};
use crate::shading::simd::surface::{HitGroup, SurfaceLanes};
use firstlight_kdtree::{Hit, HitBatch, InstructionSet};
use firstlight_simd::{Bits, Float, LANES, Mask, Real, Simd, Vector, dispatch, select, select_vector};
use glam::{Vec2, Vec3};

/// Hits on one kind of material, and the outputs of their paths.
pub(crate) struct LightHits<'a> {
    pub pass: &'a CausticPass<'a>,
    /// Number of vertices including these.
    pub n_vertices: u32,
    /// First sample dimension of the vertices.
    pub dimension: u32,
    pub paths: &'a PathBatch,
    pub hits: &'a HitBatch,
    /// Material per hit.
    pub materials: &'a [u32],
    /// Indices of the hits.
    pub order: &'a [u32],
    pub next: &'a mut PathBatch,
    pub lens_connections: &'a mut LensConnections,
    pub sets: &'a mut MediumSets,
    /// Media of the camera.
    pub camera: MediumId,
}

/// Whether [`scatter`] handles a hit on a material of this kind.
pub(crate) fn know(kind: usize, surfaces: &SurfaceTable, hit: &Hit) -> bool {
    let is_here = [DIFFUSE, MIRROR, GLASS, METAL, PLASTIC, COATED].contains(&kind);
    is_here && (!scatters(kind) || surfaces.is_shaded_as_it_is(hit.object))
}

/// Connects the vertices to the lens, and continues the paths.
pub(crate) fn scatter(set: InstructionSet, kind: usize, group: LightHits) {
    match kind {
        DIFFUSE => dispatch!(set, scatter_kind::<_, DIFFUSE>(group: LightHits)),
        MIRROR => dispatch!(set, scatter_kind::<_, MIRROR>(group: LightHits)),
        GLASS => dispatch!(set, scatter_kind::<_, GLASS>(group: LightHits)),
        METAL => dispatch!(set, scatter_kind::<_, METAL>(group: LightHits)),
        PLASTIC => dispatch!(set, scatter_kind::<_, PLASTIC>(group: LightHits)),
        COATED => dispatch!(set, scatter_kind::<_, COATED>(group: LightHits)),
        _ => unreachable!("kind {kind} is not known here"),
    }
}

#[inline(always)]
fn scatter_kind<S: Simd, const KIND: usize>(s: S, group: LightHits) {
    let LightHits { pass, n_vertices, dimension, paths, hits, materials, order, next, lens_connections, sets, camera } =
        group;
    let scene = pass.scene;
    for some in order.chunks(LANES) {
        let chunk = LaneGroup::of(some);
        let LaneGroup { indices, mask } = chunk;
        let index = Bits::load(s, &indices);
        let at = HitGroup { scene, paths, hits, materials, index, indices: &indices, mask };
        let place = SurfaceLanes::of(s, &at);
        let media = chunk.media(scene, paths);
        let mut throughput = Vector::gather(&paths.throughput, index);
        if scene.tables.features.media {
            let mut distance = Float::gather(&hits.t, index);
            if n_vertices == 1 {
                // From outside of the scene: `LightPath::is_far`.
                let is_far = Float::gather(&paths.position[0], index).is_positive();
                distance = select(is_far, distance.all(0.0), distance);
            }
            throughput = throughput.times(transmittance(s, sets, mask, &media, distance));
        }
        let (ratio, sampler) = (Float::gather(&paths.pdf, index), paths.sampler_lanes(index));
        let kept = Float::gather(&paths.normal[0], index);
        let step =
            LightPathLanes { pass, at: &at, place: &place, media: &media, throughput, ratio, kept, sampler, dimension };
        if scatters(KIND) && n_vertices > 1 {
            step.join::<KIND>(s, sets, camera, lens_connections);
        }
        if pass.goes_on(n_vertices) {
            step.go_on::<KIND>(s, sets, n_vertices, next);
        }
    }
}

/// One vertex of each of sixteen paths.
struct LightPathLanes<'a, S: Simd> {
    pass: &'a CausticPass<'a>,
    at: &'a HitGroup<'a, S>,
    /// As seen from the light.
    place: &'a SurfaceLanes<S>,
    media: &'a [MediumId; LANES],
    throughput: Vector<S>,
    ratio: Float<S>,
    /// Probability of having survived Russian roulette.
    kept: Float<S>,
    sampler: SamplerLanes<S>,
    dimension: u32,
}

impl<S: Simd> LightPathLanes<'_, S> {
    /// Appends shadow rays to points of the lens, with film positions and contributions.
    #[inline(always)]
    fn join<const KIND: usize>(
        &self,
        s: S,
        sets: &mut MediumSets,
        camera: MediumId,
        lens_connections: &mut LensConnections,
    ) {
        let &Self { pass, at, place, media, throughput, ratio, .. } = self;
        let scene = pass.scene;
        let mut open = at.mask;
        if scene.tables.features.glass {
            lanes_of(at.mask).for_each(|lane| open &= !(Mask::from(media[lane].of_all_channels() != camera) << lane));
        }
        let offsets = self.lens_offsets(s, &scene.camera);
        let Connection { lens, film: [film_x, film_y], depth } =
            scene.camera.connections(offsets, place.position, pass.size);
        let way = place.position - lens;
        open &= depth.is_positive();
        let least = depth.all(0.5 - pass.filter.radius());
        let rim = pass.filter.radius() - 0.5;
        open &= least.le(film_x) & film_x.lt(depth.all(pass.size.x + rim));
        open &= least.le(film_y) & film_y.lt(depth.all(pass.size.y + rim));
        if open == 0 {
            return;
        }
        let distance2 = way.length_squared();
        let distance = distance2.sqrt();
        let cos_lens = depth / distance;
        let seen = SurfaceLanes { wo: way * (depth.all(-1.0) / distance), ..*place };
        let (cos_o, cos_i) = (seen.wo.dot(place.geometric_normal), place.wo.dot(place.geometric_normal));
        let surface = surface_of::<S, KIND>(s, at, &seen, sets, media);
        let (value, pdf) = eval::<S, KIND>(&surface, &seen, place.wo);
        open &= surface.non_specular & cos_o.is_positive() & cos_i.is_positive() & pdf.is_positive();
        let importance = scene.camera.spread(distance2, cos_lens);
        // `CausticPass::join_ratio`, rounded in a different order.
        let ratio = ratio * importance * pass.density_scale() * cos_i / (cos_o * pdf);
        let weight = if pass.is_measured { ratio.all(1.0) } else { pass.light_path_weight(ratio) };
        let light = throughput.times(value) * (weight * cos_o / (importance * pass.pixel_area) / cos_i);
        open &= !light.is_zero();
        if open == 0 {
            return;
        }
        let light = if scene.tables.features.media {
            light.times(transmittance(s, sets, open, media, distance))
        } else {
            light
        };
        let start = place.leaving();
        lens_connections.append(open, [start, lens - start], [film_x, film_y], light, [ratio, self.kept]);
    }

    /// Lens points along the film axes, metres.
    #[inline(always)]
    fn lens_offsets(&self, s: S, camera: &Camera) -> [Float<S>; 2] {
        let zero = Float::splat(s, 0.0);
        if camera.lens_radius <= 0.0 {
            return [zero, zero];
        }
        let u = self.sampler.pair(self.dimension + DIM_LENS);
        if camera.has_round_lens() {
            let [x, y] = uniform_disc(u);
            return [x * camera.lens_radius, y * camera.lens_radius];
        }
        let (mut xs, mut ys) = (u[0].to_array(), u[1].to_array());
        for (x, y) in xs.iter_mut().zip(&mut ys) {
            [*x, *y] = camera.lens_offset(Vec2::new(*x, *y)).to_array();
        }
        [Float::load(s, &xs), Float::load(s, &ys)]
    }

    /// Samples the continuation of the paths, with Russian roulette.
    #[inline(always)]
    fn go_on<const KIND: usize>(&self, s: S, sets: &mut MediumSets, n_vertices: u32, next: &mut PathBatch) {
        let &Self { at, place, ref sampler, dimension, .. } = self;
        let normal = place.geometric_normal;
        let surface = surface_of::<S, KIND>(s, at, place, sets, self.media);
        let bounce = sample::<S, KIND>(&surface, place, at.mask, &HintLanes::NONE, sampler, dimension);
        let (along, wi) = (bounce.wi.dot(normal), bounce.wi);
        let specular = bounce.pdf.all(f32::MAX).lt(bounce.pdf);
        let reached = along.is_positive() & wi.dot(place.reach_normal).is_positive();
        let mut go_on = at.mask & bounce.go_on;
        go_on &= (bounce.transmitted & along.is_negative()) | (!bounce.transmitted & reached);
        // A path that scatters before any specular vertex is left to camera paths.
        if n_vertices == 1 {
            go_on &= specular;
        }
        let mut media = *self.media;
        if let LobeLanes::Glass(glass) = &surface.lobe
            && KIND == GLASS
        {
            for lane in lanes_of(go_on & bounce.transmitted) {
                media[lane] = glass.beyond[lane];
                // A path from the other end could not do the same.
                go_on &= !(Mask::from(media[lane] == self.media[lane]) << lane);
            }
        }
        let (cos_i, cos_o) = (place.wo.dot(normal), along.abs());
        let gain = etendue_gain(normal, place.normal, place.wo, wi);
        // Radiance scales with n² on entering glass, flux does not.
        let white = Vector::splat(s, Vec3::ONE);
        let mut factor = if KIND == GLASS { white } else { bounce.weight } * gain;
        let mut ratio = self.ratio / gain;
        if scatters(KIND) && n_vertices > 1 {
            let seen = SurfaceLanes { wo: wi, ..*place };
            let surface = surface_of::<S, KIND>(s, at, &seen, sets, self.media);
            let (value, pdf) = eval::<S, KIND>(&surface, &seen, place.wo);
            go_on &= specular | (pdf.is_positive() & cos_i.is_positive());
            factor = select_vector(specular, factor, value * (cos_o / (cos_i * bounce.pdf)));
            ratio = select(specular, ratio, self.ratio * bounce.pdf * cos_i / (cos_o * pdf));
        }
        let (mut throughput, mut all_kept) = (self.throughput.times(factor), self.kept);
        let mut at_stake = 0;
        let (one, mut most) = (ratio.all(1.0), ratio.all(1.0));
        for (kept, lanes) in
            [(most_kept(at.scene, n_vertices, true), specular), (most_kept(at.scene, n_vertices, false), !specular)]
        {
            if let Some(kept) = kept {
                most = select(lanes, one.all(kept), most);
                at_stake |= go_on & lanes;
            }
        }
        let survival = factor.abs().max_element().min(most);
        at_stake &= survival.lt(one);
        if at_stake != 0 {
            let survives = sampler.single(dimension + DIM_ROULETTE).lt(survival);
            go_on &= !at_stake | survives;
            throughput = throughput * select(at_stake, one / survival, one);
            all_kept = all_kept * select(at_stake, survival, one);
        }
        go_on &= !throughput.is_zero();
        if go_on == 0 {
            return;
        }
        let mut origin = place.leaving();
        if KIND == GLASS {
            origin = select_vector(bounce.transmitted, place.passing(), origin);
        }
        let slot = Bits::splat(s, NO_CASTER);
        let (position, normal) = (place.position, Vector { x: all_kept, ..place.normal });
        let path = PathLanes { throughput, pdf: ratio, position, normal, sampler: *sampler, slot };
        next.append(go_on, origin, wi, &path);
        if let Some(next_media) = &mut next.media {
            next_media.extend(lanes_of(go_on).map(|lane| media[lane]));
        }
    }
}
