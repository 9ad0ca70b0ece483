//! Surfaces of two parts, sixteen at a time: diffuse under a rough or mirroring coat, as in blends and classic
//! materials.
//!
//! The formulas are those of [`crate::shading::surface::blend::Blend`]: light sampling evaluates both parts, BSDF sampling
//! selects one and weights over both.

use crate::core::color::luminance_of;
use crate::prepare::material_table::{COMPENSATE, SCHLICK};
use crate::sampling::cosine_hemisphere_pdf;
use crate::sampling::warp::cosine_hemisphere;
use crate::shading::dielectric::reflect;
use crate::shading::metal::{Metal, SeenMetal, Tint};
use crate::shading::microfacets::Microfacets;
use crate::shading::simd::bounce::{Bounce, colors_of};
use crate::shading::simd::lanes::{DIFFUSE, METAL, MIRROR};
use crate::shading::simd::surface::{HitGroup, SurfaceLanes};
use firstlight_simd::{Bits, Float, Mask, Real, Simd, Vector, frame_around, select, select_vector, two};

/// The parts of the surface per lane, by kind; at most one of each kind.
pub(crate) struct Coat<S: Simd> {
    matte: CoatPart<S>,
    rough: CoatPart<S>,
    mirror: CoatPart<S>,
    /// The rough parts; `None` if no lane has one.
    metal: Option<SeenMetal<Float<S>>>,
    /// Kinds in the order of selection.
    kinds: [Bits<S>; 2],
    pmfs: [Float<S>; 2],
}

#[derive(Clone, Copy)]
struct CoatPart<S: Simd> {
    /// Lanes that have this part.
    here: Mask,
    color: Vector<S>,
    weight: Float<S>,
    /// Probability of being sampled.
    pmf: Float<S>,
}

impl<S: Simd> Coat<S> {
    #[inline(always)]
    pub fn new(s: S, at: &HitGroup<S>, place: &SurfaceLanes<S>) -> Self {
        let table = &at.scene.tables.materials;
        let material = Bits::gather(at.materials, at.index);
        let rows = two!(|k| Bits::gather(&table.parts[k], material));
        let weights = two!(|k| Float::gather(&table.weights[k], material));
        let kinds = two!(|k| Bits::gather(&table.kinds.of_material, rows[k]));
        let colors = two!(|k| colors_of(s, at, place, rows[k]));
        // Selected in proportion to their reflected light.
        let strengths = two!(|k| luminance_of(colors[k]) * weights[k]);
        let sum = strengths[0] + strengths[1];
        let pmfs = two!(|k| select(sum.is_positive(), strengths[k] / sum, sum.all(0.5)));
        let all = CoatParts { kinds, colors, weights, pmfs };
        let matte = all.of_kind(at.mask, DIFFUSE);
        let (rough, mirror) = (all.of_kind(at.mask, METAL), all.of_kind(at.mask, MIRROR));
        let mut metal = None;
        if rough.here != 0 {
            let first = kinds[0].equals(METAL as u32);
            let row = Bits { s, v: s.select_u(first, rows[0].v, rows[1].v) };
            let alpha = select(rough.here, Float::gather(&table.alpha, row), Float::splat(s, 1.0));
            let flags = Bits::gather(&table.flags, row);
            let tint = Tint { color: rough.color, schlick: flags.has(SCHLICK), index: None };
            let compensate = rough.here & flags.has(COMPENSATE);
            let facets = Microfacets::isotropic(alpha, 0);
            metal = Some(Metal { facets, tangent: None, tint, compensate }.seen(place.wo, place.normal));
        }
        Self { matte, rough, mirror, metal, kinds, pmfs }
    }

    /// Lanes for which light sampling can contribute.
    #[inline(always)]
    pub fn non_specular(&self) -> Mask {
        self.matte.here | self.rough.here
    }

    /// Returns f · cos, and the pdf of sampling `wi`; zero for `wi` behind the normal.
    #[inline(always)]
    pub fn eval(&self, normal: Vector<S>, wi: Vector<S>) -> (Vector<S>, Float<S>) {
        let cos = normal.dot(wi);
        let of_matte = select(self.matte.here, cosine_hemisphere_pdf(cos), cos.all(0.0));
        let mut value = self.matte.color * of_matte * self.matte.weight;
        let mut pdf = of_matte * self.matte.pmf;
        if let Some(metal) = &self.metal {
            let (of_rough, density) = metal.eval(wi);
            value = select_vector(self.rough.here, value + of_rough * self.rough.weight, value);
            pdf = select(self.rough.here, pdf + density * self.rough.pmf, pdf);
        }
        (value, pdf)
    }

    /// Lanes that select a part of this kind; `first`: lanes that select the first part.
    #[inline(always)]
    fn chosen(&self, first: Mask, kind: usize) -> Mask {
        let kind = kind as u32;
        (first & self.kinds[0].equals(kind)) | (!first & self.kinds[1].equals(kind))
    }

    #[inline(always)]
    pub fn sample(&self, mask: Mask, place: &SurfaceLanes<S>, u_lobe: Float<S>, u: [Float<S>; 2]) -> Bounce<S> {
        let first = u_lobe.lt(self.pmfs[0]) | self.pmfs[1].is_zero();
        let (rough, mirror) = (mask & self.chosen(first, METAL), mask & self.chosen(first, MIRROR));
        let local = cosine_hemisphere(u);
        let mut wi = local.to_world(&frame_around(place.normal));
        let mut go_on = mask & self.chosen(first, DIFFUSE) & local.z.is_positive();
        if let Some(metal) = &self.metal
            && rough != 0
        {
            let sampled = metal.sample(u);
            wi = select_vector(rough, sampled.wi, wi);
            go_on |= rough & sampled.go_on;
        }
        let (value, mut pdf) = self.eval(place.normal, wi);
        go_on &= pdf.is_positive();
        let mut weight = Vector { x: value.x / pdf, y: value.y / pdf, z: value.z / pdf };
        if mirror != 0 {
            go_on |= mirror;
            wi = select_vector(mirror, reflect(place.wo, place.normal), wi);
            weight = select_vector(mirror, self.mirror.color * (self.mirror.weight / self.mirror.pmf), weight);
            pdf = select(mirror, pdf.all(f32::INFINITY), pdf);
        }
        Bounce { go_on, wi, weight, pdf, transmitted: 0 }
    }
}

/// Both parts, in the order of selection.
struct CoatParts<S: Simd> {
    kinds: [Bits<S>; 2],
    colors: [Vector<S>; 2],
    weights: [Float<S>; 2],
    pmfs: [Float<S>; 2],
}

impl<S: Simd> CoatParts<S> {
    #[inline(always)]
    fn of_kind(&self, mask: Mask, kind: usize) -> CoatPart<S> {
        let (first, second) = (self.kinds[0].equals(kind as u32), self.kinds[1].equals(kind as u32));
        CoatPart {
            here: mask & (first | second),
            color: select_vector(first, self.colors[0], self.colors[1]),
            weight: select(first, self.weights[0], self.weights[1]),
            pmf: select(first, self.pmfs[0], self.pmfs[1]),
        }
    }
}
