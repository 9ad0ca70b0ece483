//! Metals, plastics and Disney's materials at sixteen points; see [`crate::shading::metal`],
//! [`crate::shading::plastic`] and [`crate::shading::disney`].

use crate::prepare::layer_table::input;
use crate::prepare::material_table::{BECKMANN, COMPENSATE, NONLINEAR, SCHLICK};
use crate::shading::coat::{Coat, entries};
use crate::shading::disney_layers::{DisneyInputs, DisneyLayers, SeenLayers};
use crate::shading::metal::{Metal, SeenMetal, Tint};
use crate::shading::microfacets::Microfacets;
use crate::shading::plastic::{Plastic, SeenPlastic};
use crate::shading::simd::inputs::InputLanes;
use crate::shading::simd::surface::{HitGroup, SurfaceLanes};
use crate::shading::simd::tangents::TangentLanes;
use crate::shading::tangent::tangent_axes;
use firstlight_simd::{Bits, Float, Real, Simd, select};

#[inline(always)]
pub(crate) fn metals_of<S: Simd>(at: &HitGroup<S>, place: &SurfaceLanes<S>) -> SeenMetal<Float<S>> {
    let inputs = InputLanes::of(at, place);
    let flags = Bits::gather(&at.scene.tables.materials.flags, Bits::gather(at.materials, at.index));
    let along = inputs.share(input::ALPHA);
    let mut alpha = [along; 2];
    let mut index = None;
    if at.scene.tables.materials.layers.has_conductors {
        let across = inputs.share(input::ALPHA_V);
        alpha[1] = select(across.is_positive(), across, along);
        index = Some([inputs.color(input::ETA), inputs.color(input::K)]);
    }
    let facets = Microfacets { alpha, beckmann: at.mask & flags.has(BECKMANN) }.at_least_rough();
    let mut tangent = None;
    let TangentLanes { along_u, handedness, known, .. } = place.tangent;
    if known != 0 {
        tangent = Some(tangent_axes(along_u, handedness, place.normal)[0]);
    }
    let metal = Metal {
        facets,
        tangent,
        tint: Tint { color: inputs.color(input::COLOR), schlick: at.mask & flags.has(SCHLICK), index },
        compensate: at.mask & flags.has(COMPENSATE),
    };
    metal.seen(place.wo, place.normal)
}

#[inline(always)]
pub(crate) fn plastics_of<'a, S: Simd>(at: &HitGroup<'a, S>, place: &SurfaceLanes<S>) -> SeenPlastic<'a, Float<S>> {
    let inputs = InputLanes::of(at, place);
    let material = Bits::gather(at.materials, at.index);
    let flags = Bits::gather(&at.scene.tables.materials.flags, material);
    let table = &at.scene.tables.coats;
    let facets = Microfacets::isotropic(inputs.share(input::ALPHA), at.mask & flags.has(BECKMANN));
    let rows = [Float::gather(&table.first, material), Float::gather(&table.n_more, material)];
    let coat = Coat::new(inputs.scalar(input::IOR), facets, entries(table), rows);
    let nonlinear = flags.has(NONLINEAR);
    Plastic::new(inputs.shares(input::COLOR), nonlinear, inputs.share(input::SPECULAR), coat)
        .seen(place.wo, place.normal)
}

#[inline(always)]
pub(crate) fn disneys_of<S: Simd>(at: &HitGroup<S>, place: &SurfaceLanes<S>) -> SeenLayers<Float<S>> {
    let inputs = InputLanes::of(at, place);
    let mut layers = DisneyLayers::solid(&DisneyInputs {
        color: inputs.shares(input::COLOR),
        metallic: inputs.share(input::METALLIC),
        roughness: inputs.share(input::ROUGHNESS),
        anisotropic: inputs.share(input::ANISOTROPY),
        ior: inputs.scalar(input::IOR),
        specular_tint: inputs.share(input::SPECULAR_TINT),
        transmission: inputs.scalar(input::IOR) * 0.0,
        flatness: inputs.share(input::FLATNESS),
        sheen: inputs.share(input::SHEEN),
        sheen_tint: inputs.share(input::SHEEN_TINT),
        clearcoat: inputs.share(input::COAT),
        clearcoat_gloss: inputs.share(input::COAT_GLOSS),
    });
    let TangentLanes { along_u, handedness, known, .. } = place.tangent;
    if known != 0 {
        layers.tangent = Some(tangent_axes(along_u, handedness, place.normal)[0]);
    }
    layers.seen(place.wo, place.normal)
}
