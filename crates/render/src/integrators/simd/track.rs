//! MIS states of sixteen paths against light paths; see [`crate::integrators::common::caustics_pass::CausticPass::follow`].

use crate::core::camera::Camera;
use crate::core::material::Material;
use crate::integrators::common::caustics_pass::CausticPass;
use crate::integrators::common::caustics_weight::etendue_gain;
use crate::prepare::casters::NO_CASTER;
use crate::prepare::material_table::{COATED, MORE_THAN_UV, TANGENTS, TURNED};
use crate::sampling::cosine_hemisphere_pdf;
use crate::shading::interface::MediumId;
use crate::shading::mis_state::MisState;
use crate::shading::scatter::Scatter;
use crate::shading::simd::bounce::Bounce;
use crate::shading::simd::hints::HintLanes;
use crate::shading::simd::lanes::{DIFFUSE, GLASS, MIRROR, lanes_of};
use crate::shading::simd::surface::{HitGroup, SurfaceLanes};
use crate::shading::surface::{blend_at, lobe_at};
use firstlight_simd::{Float, LANES, Mask, Real, Simd, Vector, select};
use glam::Vec3;

/// The continuations of sixteen paths.
pub(crate) struct BounceMisStates<'a, S: Simd> {
    pub pass: &'a CausticPass<'a>,
    pub at: &'a HitGroup<'a, S>,
    pub place: &'a SurfaceLanes<S>,
    pub hints: &'a HintLanes<'a>,
    pub bounce: &'a Bounce<S>,
    /// Media after the bounce.
    pub media: &'a [MediumId; LANES],
}

impl<S: Simd> BounceMisStates<'_, S> {
    /// Appends the MIS states of the lanes of `go_on`; `is_first`: their hits are those of camera rays.
    #[inline(always)]
    pub fn append<const KIND: usize>(&self, s: S, go_on: Mask, is_first: bool, tracks: &mut Vec<MisState>) {
        let Self { pass, at, place, hints, bounce, media } = *self;
        let (wo, wi, normal) = (place.wo, bounce.wi, place.geometric_normal);
        let (cos_o, along) = (wo.dot(normal), wi.dot(normal));
        let mut reversible = !bounce.transmitted & along.is_positive();
        if KIND == GLASS {
            for lane in lanes_of(go_on & bounce.transmitted) {
                let before = at.paths.media_of(at.indices[lane] as usize);
                reversible |= Mask::from(before != media[lane]) << lane;
            }
        }
        let specular = bounce.pdf.all(f32::MAX).lt(bounce.pdf);
        let lost = bounce.pdf.all(f32::NAN);
        let weights = bounce.weight.to_arrays();
        let mut old = [MisState::default(); LANES];
        lanes_of(go_on).for_each(|lane| old[lane] = hints.track(at, lane, &weights));
        let ratio = if is_first {
            let joined = self.join_ratio(s, cos_o, along.abs());
            select(specular, lost, joined)
        } else {
            let mut ratios = [f32::NAN; LANES];
            lanes_of(go_on).for_each(|lane| ratios[lane] = old[lane].ratio());
            let ratio = Float::load(s, &ratios);
            let scattered = if KIND == MIRROR || KIND == GLASS {
                lost
            } else {
                let known = !ratio.is_nan() & go_on & reversible & !specular;
                ratio * self.reverse_pdf::<KIND>(s, known) * along.abs() / (cos_o * bounce.pdf)
            };
            select(specular, ratio / etendue_gain(normal, place.normal, wi, wo), scattered)
        };
        let ratio = select(reversible, ratio, lost);
        let ratios = ratio.to_array();
        let gathered = specular & !ratio.is_nan();
        tracks.extend(lanes_of(go_on).map(|lane| {
            let caster = if gathered >> lane & 1 != 0 {
                pass.caster_of(&at.hits.get(at.indices[lane] as usize).expect("a hit is being shaded"))
            } else {
                NO_CASTER
            };
            MisState::new(ratios[lane], caster, old[lane].gain)
        }));
    }

    /// See [`CausticPass::join_ratio`].
    #[inline(always)]
    fn join_ratio(&self, s: S, cos_o: Float<S>, cos_i: Float<S>) -> Float<S> {
        let Camera { forward, .. } = self.at.scene.camera;
        let cos_lens = -self.place.wo.dot(Vector::splat(s, forward));
        let distance2 = (self.place.position - self.at.ray_origin()).length_squared();
        self.pass.join_ratio(distance2, cos_lens, cos_o, cos_i, self.bounce.pdf)
    }

    /// Pdf of the surface for the reverse direction; see [`crate::integrators::caustics`].
    #[inline(always)]
    fn reverse_pdf<const KIND: usize>(&self, s: S, mask: Mask) -> Float<S> {
        let Self { at, place, bounce, .. } = *self;
        if KIND == DIFFUSE {
            return cosine_hemisphere_pdf(place.normal.dot(place.wo));
        }
        let mut pdfs = [0.0; LANES];
        if mask != 0 {
            let (vertices, wi) = (place.stored(), bounce.wi.to_arrays());
            for lane in lanes_of(mask) {
                let i = at.indices[lane] as usize;
                let wi = Vec3::new(wi[0][lane], wi[1][lane], wi[2][lane]);
                let material = at.materials[i];
                let flags = at.scene.tables.materials.flags[material as usize];
                // Layers may need normals that are not mapped.
                let needs_more = KIND > COATED || flags & (TANGENTS | MORE_THAN_UV | TURNED) != 0;
                let vertex = if needs_more { at.vertex(i) } else { vertices.vertex(lane) };
                pdfs[lane] = match at.scene.shading.materials[material as usize] {
                    Material::Blend { .. } | Material::Phong { .. } | Material::Principled { .. } => {
                        blend_at(at.scene, material, &vertex, None)
                            .map_or(0.0, |blend| blend.eval(wi, vertex.wo, vertex.normal).1)
                    }
                    _ => lobe_at(at.scene, material, &vertex, None)
                        .map_or(0.0, |lobe| lobe.eval(wi, vertex.wo, vertex.normal).1),
                };
            }
        }
        Float::load(s, &pdfs)
    }
}
