//! BSDFs, sixteen at a time; see [`crate::shading::bsdf`].

use crate::prepare::layer_table::input;
use crate::prepare::material_table::COATED;
use crate::sampling::warp::cosine_hemisphere;
use crate::sampling::{SamplerLanes, cosine_hemisphere_pdf};
use crate::shading::dielectric::{fresnel, reflect, refract};
use crate::shading::dimensions::{DIM_DIRECTION, DIM_LOBE};
use crate::shading::disney_layers::SeenLayers;
use crate::shading::interface::MediumId;
use crate::shading::medium::MediumSets;
use crate::shading::metal::SeenMetal;
use crate::shading::plastic::SeenPlastic;
use crate::shading::principled::seen::Seen;
use crate::shading::simd::bounce::{Bounce, colors_of};
use crate::shading::simd::coat::Coat;
use crate::shading::simd::glass::GlassLanes;
use crate::shading::simd::hints::HintLanes;
use crate::shading::simd::inputs::InputLanes;
use crate::shading::simd::lanes::{DIFFUSE, DISNEY, GLASS, METAL, PLASTIC, TRANSLUCENT};
use crate::shading::simd::layers::{EvalLayers, layers_of};
use crate::shading::simd::metals::{disneys_of, metals_of, plastics_of};
use crate::shading::simd::surface::{HitGroup, SurfaceLanes};
use crate::shading::translucent::Translucent;
use firstlight_simd::{Bits, Float, LANES, Mask, Real, Simd, Vector, frame_around, select, select_vector};

/// The BSDF of each lane.
pub(crate) struct SurfaceScatter<'a, S: Simd> {
    pub lobe: LobeLanes<'a, S>,
    /// Lanes for which light sampling can contribute.
    pub non_specular: Mask,
}

/// By the kind of the hits.
pub(crate) enum LobeLanes<'a, S: Simd> {
    /// Diffuse or mirror, with its albedo or reflectance.
    Plain(Vector<S>),
    Glass(GlassLanes<S>),
    Metal(SeenMetal<Float<S>>),
    Plastic(SeenPlastic<'a, Float<S>>),
    Disney(SeenLayers<Float<S>>),
    Translucent(Translucent<Float<S>>),
    Coated(Coat<S>),
    Layers(Seen<Float<S>>),
}

/// Evaluates the parameters of the surfaces; black and without a lobe only if the scalar code is, too.
///
/// - `media`: media of each path.
#[inline(always)]
pub(crate) fn surface_of<'a, S: Simd, const KIND: usize>(
    s: S,
    at: &HitGroup<'a, S>,
    place: &SurfaceLanes<S>,
    sets: &mut MediumSets,
    media: &[MediumId; LANES],
) -> SurfaceScatter<'a, S> {
    let (lobe, non_specular) = match KIND {
        METAL => {
            let metal = metals_of(at, place);
            let non_specular = metal.non_specular();
            (LobeLanes::Metal(metal), non_specular)
        }
        PLASTIC => {
            let plastic = plastics_of(at, place);
            let non_specular = plastic.non_specular();
            (LobeLanes::Plastic(plastic), non_specular)
        }
        DISNEY => (LobeLanes::Disney(disneys_of(at, place)), Mask::MAX),
        TRANSLUCENT => {
            let inputs = InputLanes::of(at, place);
            let surface = Translucent::new(inputs.color(input::COLOR), inputs.color(input::TRANSMITTANCE));
            (LobeLanes::Translucent(surface), Mask::MAX)
        }
        COATED => {
            let coat = Coat::new(s, at, place);
            let non_specular = coat.non_specular();
            (LobeLanes::Coated(coat), non_specular)
        }
        GLASS => (LobeLanes::Glass(GlassLanes::of(s, at, place.front, sets, media)), 0),
        _ => {
            let color = colors_of(s, at, place, Bits::gather(at.materials, at.index));
            (LobeLanes::Plain(color), if KIND == DIFFUSE { Mask::MAX } else { 0 })
        }
    };
    SurfaceScatter { lobe, non_specular }
}

/// Like [`surface_of`] for layered materials; turns the normals of surfaces with normal maps.
#[inline(always)]
pub(crate) fn layered_surface_of<'a, S: Simd>(
    s: S,
    at: &HitGroup<'a, S>,
    place: &mut SurfaceLanes<S>,
) -> SurfaceScatter<'a, S> {
    let layers = layers_of(s, at, place);
    let non_specular = layers.scatters();
    SurfaceScatter { lobe: LobeLanes::Layers(layers), non_specular }
}

/// Returns f · cos, and the pdf of sampling `wi`; zero for `wi` behind the normal, unless the surface is
/// translucent.
#[inline(always)]
pub(crate) fn eval<S: Simd, const KIND: usize>(
    surface: &SurfaceScatter<S>,
    place: &SurfaceLanes<S>,
    wi: Vector<S>,
) -> (Vector<S>, Float<S>) {
    match &surface.lobe {
        LobeLanes::Layers(seen) if KIND > COATED => wi.x.s.call(EvalLayers { seen, wi }),
        LobeLanes::Coated(coat) if KIND == COATED => coat.eval(place.normal, wi),
        LobeLanes::Metal(metal) if KIND == METAL => metal.eval(wi),
        LobeLanes::Plastic(plastic) if KIND == PLASTIC => plastic.eval(wi),
        LobeLanes::Disney(layers) if KIND == DISNEY => layers.eval(wi),
        LobeLanes::Translucent(surface) if KIND == TRANSLUCENT => {
            surface.eval(place.normal.dot(place.wo), place.normal.dot(wi))
        }
        LobeLanes::Plain(color) => {
            let pdf = cosine_hemisphere_pdf(place.normal.dot(wi));
            (*color * pdf, pdf)
        }
        _ => unreachable!("surfaces are of the kind of the hits"),
    }
}

#[inline(always)]
pub(crate) fn sample<S: Simd, const KIND: usize>(
    surface: &SurfaceScatter<S>,
    place: &SurfaceLanes<S>,
    mask: Mask,
    hints: &HintLanes,
    sampler: &SamplerLanes<S>,
    dimension: u32,
) -> Bounce<S> {
    let normal = place.normal;
    let infinite = normal.x.all(f32::INFINITY);
    let u = sampler.pair(dimension + DIM_DIRECTION);
    match &surface.lobe {
        LobeLanes::Coated(coat) if KIND == COATED => coat.sample(mask, place, hints.u_lobe(sampler, dimension), u),
        LobeLanes::Layers(seen) if KIND > COATED => {
            let proposed = seen.propose(hints.u_lobe(sampler, dimension), u);
            let (value, pdf) = eval::<S, KIND>(surface, place, proposed.wi);
            seen.weighted(&proposed, value, pdf).into()
        }
        LobeLanes::Metal(metal) if KIND == METAL => metal.sample(u).into(),
        LobeLanes::Plastic(plastic) if KIND == PLASTIC => plastic.sample(hints.u_lobe(sampler, dimension), u).into(),
        LobeLanes::Disney(layers) if KIND == DISNEY => layers.sample(hints.u_lobe(sampler, dimension), u).into(),
        LobeLanes::Translucent(surface) if KIND == TRANSLUCENT => {
            let (sampled, transmitted) = surface.sample(normal, hints.u_lobe(sampler, dimension), u);
            Bounce { transmitted, ..sampled.into() }
        }
        LobeLanes::Plain(color) if KIND == DIFFUSE => {
            let local = cosine_hemisphere(u);
            let wi = local.to_world(&frame_around(normal));
            let go_on = local.z.is_positive();
            Bounce { go_on, wi, weight: *color, pdf: cosine_hemisphere_pdf(local.z), transmitted: 0 }
        }
        LobeLanes::Plain(color) => {
            let wi = reflect(place.wo, normal);
            Bounce { go_on: Mask::MAX, wi, weight: *color, pdf: infinite, transmitted: 0 }
        }
        LobeLanes::Glass(glass) if KIND == GLASS => {
            let eta = glass.eta;
            let (reflectance, cos_t) = fresnel(normal.dot(place.wo).at_least(0.0).at_most(1.0), eta);
            let reflected = sampler.single(dimension + DIM_LOBE).lt(reflectance);
            let refracted = refract(place.wo, normal, eta, cos_t);
            let wi = select_vector(reflected, reflect(place.wo, normal), refracted);
            let radiance_eta = select(reflected, eta.all(1.0), glass.radiance_eta * glass.radiance_eta);
            let weight = Vector { x: radiance_eta, y: radiance_eta, z: radiance_eta };
            Bounce { go_on: Mask::MAX, wi, weight, pdf: infinite, transmitted: !reflected }
        }
        _ => unreachable!("surfaces are of the kind of the hits"),
    }
}
