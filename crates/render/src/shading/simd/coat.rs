//! Two parts in one surface, sixteen at a time: diffuse under a rough or mirroring coat, as blends and classic materials have it.
//!
//! The formulas are those of [`crate::shading::blend::Blend`]: light sampling asks both parts, a bounce is chosen from one
//! and weighted over both.

use crate::core::color::luminance_of;
use crate::sampling::cosine_hemisphere_pdf;
use crate::sampling::warp::cosine_hemisphere;
use crate::shading::dielectric::reflect;
use crate::shading::metal::Metal;
use crate::shading::simd::bounce::{Bounce, colors_of};
use crate::shading::simd::lanes::{DIFFUSE, METAL, MIRROR};
use crate::shading::simd::metal::metals;
use crate::shading::simd::surface::{HitGroup, SurfaceLanes};
use firstlight_simd::{Bits, Float, Mask, Real, Simd, Vector, frame_around, select, select_vector, two};

/// The parts of the surface of each lane, by what they do; of each kind there is one at most.
pub(crate) struct Coat<S: Simd> {
    matte: CoatPart<S>,
    rough: CoatPart<S>,
    mirror: CoatPart<S>,
    /// The rough parts; `None` where no lane has one.
    metal: Option<Metal<Float<S>>>,
    /// In the order of choice.
    kinds: [Bits<S>; 2],
    pmfs: [Float<S>; 2],
}

#[derive(Clone, Copy)]
struct CoatPart<S: Simd> {
    /// Lanes that have it.
    here: Mask,
    color: Vector<S>,
    weight: Float<S>,
    /// Of being sampled.
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
        // Chosen by what they reflect.
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
            metal = Some(metals(s, rough.here, place.normal, place.wo, alpha, rough.color, flags));
        }
        Self { matte, rough, mirror, metal, kinds, pmfs }
    }

    /// Lanes that light sampling can do something for.
    #[inline(always)]
    pub fn non_specular(&self) -> Mask {
        self.matte.here | self.rough.here
    }

    /// f · cos, and the density of finding `wi` by a bounce; zero for `wi` behind the normal.
    #[inline(always)]
    pub fn eval(&self, normal: Vector<S>, wi: Vector<S>) -> (Vector<S>, Float<S>) {
        let cos = normal.dot(wi);
        let above = cos.is_positive();
        let of_matte = select(self.matte.here, cosine_hemisphere_pdf(cos), cos.all(0.0));
        let mut value = self.matte.color * of_matte * self.matte.weight;
        let mut pdf = of_matte * self.matte.pmf;
        if let Some(metal) = &self.metal {
            let found = metal.eval(metal.local(wi));
            let valid = above & metal.facing() & self.rough.here;
            let of_rough = found.tint * found.value * self.rough.weight;
            value = select_vector(valid, value + of_rough, value);
            pdf = select(valid, pdf + found.pdf * self.rough.pmf, pdf);
        }
        (value, pdf)
    }

    /// Lanes that choose a part of this kind; `first`: those that choose the first.
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
            let [direction, local] = metal.sample(u);
            wi = select_vector(rough, direction, wi);
            go_on |= rough & metal.facing() & local.z.is_positive();
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

/// In the order of choice.
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
