//! Layered surfaces at sixteen points; see [`crate::shading::principled`].

use crate::prepare::layer_table::input;
use crate::prepare::material_table::{MAPPED, RICH};
use crate::shading::principled::layers::{BaseInputs, Principled};
use crate::shading::principled::seen::Seen;
use crate::shading::sheen;
use crate::shading::simd::inputs::InputLanes;
use crate::shading::simd::surface::{HitGroup, SurfaceLanes};
use crate::shading::tangent::tangent_axes;
use firstlight_simd::{Bits, Float, Kernel, Real, Simd, Vector, select_vector};

/// Prepares the surfaces as they are seen, and turns their normals by their maps.
#[inline(always)]
pub(crate) fn layers_of<S: Simd>(s: S, at: &HitGroup<S>, place: &mut SurfaceLanes<S>) -> Seen<Float<S>> {
    let layers = principled_of(s, at, place);
    Seen::new(layers, place.wo, place.normal)
}

/// Evaluates the parameters of the surfaces, and turns their normals by their maps.
#[inline(always)]
pub(crate) fn principled_of<S: Simd>(s: S, at: &HitGroup<S>, place: &mut SurfaceLanes<S>) -> Principled<Float<S>> {
    let inputs = InputLanes::of(at, place);
    let flags = Bits::gather(&at.scene.tables.materials.flags, Bits::gather(at.materials, at.index));
    let unmapped = place.unmapped_normal();
    let mut mapped = 0;
    if place.tangent.known != 0 {
        let scale = inputs.scalar(input::NORMAL_SCALE);
        mapped = place.turn_normals(at.mask & flags.has(MAPPED), inputs.color(input::NORMAL), scale);
    }
    let specular_color = inputs.color(input::SPECULAR_COLOR);
    let zero = Float::splat(s, 0.0);
    let base = BaseInputs {
        color: inputs.shares(input::COLOR),
        metallic: inputs.share(input::METALLIC),
        roughness: inputs.share(input::ROUGHNESS),
        specular: inputs.share(input::SPECULAR),
        specular_color: specular_color.max(Vector::all(zero)) * inputs.scalar(input::FACING),
    };
    let mut layers = Principled::of_base(&base, place.normal);
    if mapped != 0 {
        layers.true_normal = Some(select_vector(mapped, place.reach_normal, Vector::all(zero)));
    }
    if flags.has(RICH) != 0 {
        layers.sheen = inputs.shares(input::SHEEN_COLOR);
        layers.sheen_alpha = sheen::alpha_of(inputs.share(input::SHEEN_ROUGHNESS));
        layers.coat = inputs.share(input::COAT);
        let roughness = inputs.share(input::COAT_ROUGHNESS);
        layers.coat_alpha = roughness * roughness;
        layers.coat_normal = unmapped;
        let anisotropy = inputs.share(input::ANISOTROPY);
        let elongated = anisotropy.is_positive();
        let tangent = &place.tangent;
        if tangent.known != 0 && elongated != 0 {
            let map = inputs.shares(input::ANISOTROPY_MAP);
            layers.widen(anisotropy * map.z);
            let (cos, sin) = (inputs.scalar(input::TURN), inputs.scalar(input::TURN + 1));
            let (x, y) = (map.x * 2.0 - 1.0, map.y * 2.0 - 1.0);
            let across = Vector { x: cos * x - sin * y, y: sin * x + cos * y, z: zero };
            let across = across.normalize_or(Vector { x: zero + 1.0, y: zero, z: zero });
            let [along_u, along_v] = tangent_axes(tangent.along_u, tangent.handedness, place.normal);
            let direction = along_u * across.x + along_v * across.y;
            layers.tangent = Some(select_vector(elongated, direction, Vector::all(zero)));
        }
    }
    layers
}

/// Arguments of [`Seen::eval`], which has one copy for all of its callers.
pub(crate) struct EvalLayers<'a, S: Simd> {
    pub seen: &'a Seen<Float<S>>,
    pub wi: Vector<S>,
}

impl<S: Simd> Kernel<S> for EvalLayers<'_, S> {
    type Output = (Vector<S>, Float<S>);

    #[inline(always)]
    fn run(self, _: S) -> Self::Output {
        self.seen.eval(self.wi)
    }
}
