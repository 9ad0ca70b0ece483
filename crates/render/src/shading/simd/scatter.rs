//! BSDFs, sixteen at a time; see [`crate::shading::bsdf`].

use crate::core::material::SMALLEST_ALPHA;
use crate::prepare::layer_table::LAYERED;
use crate::prepare::material_table::{COATED, TEXTURED};
use crate::sampling::warp::cosine_hemisphere;
use crate::sampling::{SamplerLanes, cosine_hemisphere_pdf};
use crate::shading::dielectric::{fresnel, reflect, refract};
use crate::shading::dimensions::{DIM_DIRECTION, DIM_LOBE};
use crate::shading::interface::MediumId;
use crate::shading::medium::MediumSets;
use crate::shading::metal::{Metal, tint};
use crate::shading::principled::seen::{Reflected, Seen};
use crate::shading::simd::bounce::{Bounce, colors_of};
use crate::shading::simd::coat::Coat;
use crate::shading::simd::glass::GlassLanes;
use crate::shading::simd::hints::HintLanes;
use crate::shading::simd::lanes::{DIFFUSE, GLASS, METAL, lanes_of};
use crate::shading::simd::layers::{EvalLayers, layers_of};
use crate::shading::simd::metal::metals;
use crate::shading::simd::surface::{HitGroup, SurfaceLanes};
use crate::shading::surface::scalar_at;
use firstlight_simd::{Bits, Float, LANES, Mask, Real, Simd, Vector, frame_around, select, select_vector};
use glam::Vec2;

/// The BSDF of each lane.
pub(crate) struct SurfaceScatter<S: Simd> {
    /// Albedo or reflectance.
    pub color: Vector<S>,
    pub metal: Option<Metal<Float<S>>>,
    pub coat: Option<Coat<S>>,
    pub layers: Option<Seen<Float<S>>>,
    pub glass: Option<GlassLanes<S>>,
    /// Lanes for which light sampling can contribute.
    pub non_specular: Mask,
}

/// Evaluates the parameters of the surfaces; black and without a lobe only if the scalar code is, too.
///
/// - `media`: media of each path.
#[inline(always)]
pub(crate) fn surface_of<S: Simd, const KIND: usize>(
    s: S,
    at: &HitGroup<S>,
    place: &SurfaceLanes<S>,
    sets: &mut MediumSets,
    media: &[MediumId; LANES],
) -> SurfaceScatter<S> {
    let table = &at.scene.tables.materials;
    if KIND == COATED {
        let coat = Coat::new(s, at, place);
        let (non_specular, zero) = (coat.non_specular(), Float::splat(s, 0.0));
        return SurfaceScatter {
            color: Vector { x: zero, y: zero, z: zero },
            metal: None,
            coat: Some(coat),
            layers: None,
            glass: None,
            non_specular,
        };
    }
    let material = Bits::gather(at.materials, at.index);
    let color = colors_of(s, at, place, material);
    if KIND == METAL {
        let flags = Bits::gather(&table.flags, material);
        let mut alpha = Float::gather(&table.alpha, material);
        let textured = at.mask & flags.has(TEXTURED);
        if at.scene.tables.features.textures && textured != 0 {
            let (us, vs) = (place.uv[0].to_array(), place.uv[1].to_array());
            let mut alphas = alpha.to_array();
            for lane in lanes_of(textured) {
                let material = at.materials[at.indices[lane] as usize];
                alphas[lane] = scalar_at(at.scene, material, Vec2::new(us[lane], vs[lane]));
            }
            alpha = Float::load(s, &alphas);
        }
        let metal = metals(s, at.mask, place.normal, place.wo, alpha, color, flags);
        let non_specular = Float::splat(s, SMALLEST_ALPHA).le(alpha);
        return SurfaceScatter { color, metal: Some(metal), coat: None, layers: None, glass: None, non_specular };
    }
    let glass = (KIND == GLASS).then(|| GlassLanes::of(s, at, place.front, sets, media));
    let non_specular = if KIND == DIFFUSE { Mask::MAX } else { 0 };
    SurfaceScatter { color, metal: None, coat: None, layers: None, glass, non_specular }
}

/// Like [`surface_of`] for layered materials; turns the normals of surfaces with normal maps.
#[inline(always)]
pub(crate) fn layered_surface_of<S: Simd>(s: S, at: &HitGroup<S>, place: &mut SurfaceLanes<S>) -> SurfaceScatter<S> {
    let layers = layers_of(s, at, place);
    let (non_specular, zero) = (layers.scatters(), Float::splat(s, 0.0));
    SurfaceScatter {
        color: Vector::all(zero),
        metal: None,
        coat: None,
        layers: Some(layers),
        glass: None,
        non_specular,
    }
}

/// Returns f · cos, and the pdf of sampling `wi`; zero for `wi` behind the normal.
#[inline(always)]
pub(crate) fn eval<S: Simd, const KIND: usize>(
    surface: &SurfaceScatter<S>,
    place: &SurfaceLanes<S>,
    wi: Vector<S>,
) -> (Vector<S>, Float<S>) {
    if let Some(coat) = &surface.coat
        && KIND == COATED
    {
        return coat.eval(place.normal, wi);
    }
    if let Some(seen) = &surface.layers
        && KIND > COATED
    {
        return wi.x.s.call(EvalLayers { seen, wi });
    }
    let cos = place.normal.dot(wi);
    if let Some(metal) = &surface.metal
        && KIND == METAL
    {
        let found = metal.eval(metal.local(wi));
        let valid = cos.is_positive() & metal.facing();
        let value = found.tint * found.value;
        let pdf = select(valid, found.pdf, cos.all(0.0));
        return (value, pdf);
    }
    let pdf = cosine_hemisphere_pdf(cos);
    (surface.color * pdf, pdf)
}

#[inline(always)]
pub(crate) fn sample<S: Simd, const KIND: usize>(
    at: &HitGroup<S>,
    surface: &SurfaceScatter<S>,
    place: &SurfaceLanes<S>,
    hints: &HintLanes,
    sampler: &SamplerLanes<S>,
    dimension: u32,
) -> Bounce<S> {
    let s = at.index.s;
    let infinite = Float::splat(s, f32::INFINITY);
    let normal = place.normal;
    let cos_o = normal.dot(place.wo);
    match KIND {
        COATED => {
            let coat = surface.coat.as_ref().expect("a coated surface has its parts");
            coat.sample(at.mask, place, hints.u_lobe(sampler, dimension), sampler.pair(dimension + DIM_DIRECTION))
        }
        LAYERED => {
            let seen = surface.layers.as_ref().expect("a layered surface has its layers");
            let u = sampler.pair(dimension + DIM_DIRECTION);
            let proposed = seen.propose(hints.u_lobe(sampler, dimension), u);
            let (value, pdf) = eval::<S, KIND>(surface, place, proposed.wi);
            let Reflected { go_on, weight, pdf, .. } = seen.weighted(&proposed, value, pdf);
            Bounce { go_on, wi: proposed.wi, weight, pdf, transmitted: 0 }
        }
        DIFFUSE => {
            let local = cosine_hemisphere(sampler.pair(dimension + DIM_DIRECTION));
            let wi = local.to_world(&frame_around(normal));
            let go_on = local.z.is_positive();
            Bounce { go_on, wi, weight: surface.color, pdf: cosine_hemisphere_pdf(local.z), transmitted: 0 }
        }
        METAL => {
            let metal = surface.metal.as_ref().expect("metal has metal parameters");
            let [wi, local] = metal.sample(sampler.pair(dimension + DIM_DIRECTION));
            let found = metal.eval(local);
            let go_on = metal.facing() & local.z.is_positive();
            let mut bounce = Bounce { go_on, wi, weight: found.tint * found.weight, pdf: found.pdf, transmitted: 0 };
            if !surface.non_specular & at.mask != 0 {
                let non_specular = surface.non_specular;
                let facing = tint(metal.schlick, metal.reflectance, cos_o);
                bounce.go_on |= !non_specular;
                bounce.wi = select_vector(non_specular, bounce.wi, reflect(place.wo, normal));
                bounce.weight = select_vector(non_specular, bounce.weight, facing);
                bounce.pdf = select(non_specular, bounce.pdf, infinite);
            }
            bounce
        }
        GLASS => {
            let glass = surface.glass.as_ref().expect("glass has its two sides");
            let eta = glass.eta;
            let one = eta.all(1.0);
            let (reflectance, cos_t) = fresnel(cos_o.at_least(0.0).at_most(1.0), eta);
            let reflected = sampler.single(dimension + DIM_LOBE).lt(reflectance);
            let refracted = refract(place.wo, normal, eta, cos_t);
            let wi = select_vector(reflected, reflect(place.wo, normal), refracted);
            let radiance_eta = select(reflected, one, glass.radiance_eta * glass.radiance_eta);
            let weight = Vector { x: radiance_eta, y: radiance_eta, z: radiance_eta };
            Bounce { go_on: Mask::MAX, wi, weight, pdf: infinite, transmitted: !reflected }
        }
        _ => {
            let wi = reflect(place.wo, normal);
            Bounce { go_on: Mask::MAX, wi, weight: surface.color, pdf: infinite, transmitted: 0 }
        }
    }
}
