//! What the dielectric coat of a plastic transmits and reflects inwards.
//!
//! Both are integrals over the visible microfacets of a rough coat, tabulated per material: all other parameters of a
//! coat are constant over its surface, but its width may be textured.

use crate::core::material::{Material, MaterialId, SMALLEST_ALPHA, ScalarInput};
use crate::prepare::prepared::Prepared;
use crate::shading::dielectric::fresnel;
use crate::shading::glass_loss::scattered_once;
use crate::shading::integral_table::Between;
use crate::shading::microfacets::Microfacets;
use rayon::prelude::*;

/// Entries by angle, uniform in the root of the cosine.
const N_COS: usize = 64;
/// Rows of a coat of textured width, uniform in the root of the width.
const N_ALPHA: usize = 17;
/// Entries of a row: the transmitted share of light from outside, by angle; its mean for uniform light; the share of
/// uniform light from inside that is reflected.
const ROW: usize = N_COS + 2;

/// A coat at one point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Coat<'a> {
    /// Index of refraction.
    pub ior: f32,
    /// Isotropic.
    pub facets: Microfacets,
    /// One row, or [`N_ALPHA`] of them.
    rows: &'a [f32],
}

impl<'a> Coat<'a> {
    /// Returns the coat of a plastic; its table is computed if this is the first.
    pub fn at(scene: &'a Prepared, id: MaterialId, ior: f32, facets: Microfacets) -> Self {
        let rows = scene.tables.coats[id as usize].get_or_init(|| rows_of(&scene.shading.materials[id as usize]));
        Self::new(ior, facets, rows)
    }

    /// - `rows`: those of this index and width, or of all widths; see [`rows`].
    pub fn new(ior: f32, facets: Microfacets, rows: &'a [f32]) -> Self {
        Self { ior, facets, rows }
    }

    /// Whether it reflects like a mirror.
    #[inline]
    pub fn is_smooth(&self) -> bool {
        self.facets.is_smooth()
    }

    fn mean(&self, of: impl Fn(&[f32]) -> f32) -> f32 {
        match self.rows.len() / ROW {
            1 => of(self.rows),
            n => Between::new(self.facets.alpha[0].max(0.0).sqrt(), n).mean(|i| of(&self.rows[i * ROW..][..ROW])),
        }
    }

    /// Fresnel term at an angle with a microfacet.
    #[inline]
    pub fn reflected(&self, cos: f32) -> f32 {
        fresnel(cos.clamp(0.0, 1.0), 1.0 / self.ior).0
    }

    /// Share of light from one direction outside that is transmitted.
    #[inline]
    pub fn passed(&self, cos: f32) -> f32 {
        if self.is_smooth() {
            return 1.0 - self.reflected(cos);
        }
        let columns = Between::new(cos.max(0.0).sqrt(), N_COS);
        self.mean(|row| columns.mean(|i| row[i]))
    }

    /// Share of uniform light from outside that is transmitted.
    #[inline]
    pub fn mean_passed(&self) -> f32 {
        self.mean(|row| row[N_COS])
    }

    /// Share of uniform light from inside that is reflected, below 1.
    #[inline]
    pub fn reflected_inwards(&self) -> f32 {
        self.mean(|row| row[N_COS + 1])
    }
}

/// Computes the tables of all coats, on all threads.
pub(crate) fn compute(scene: &Prepared) {
    let tables = scene.tables.coats.par_iter().zip(&scene.shading.materials);
    tables.filter(|(_, material)| matches!(material, Material::Plastic { .. })).for_each(|(table, material)| {
        table.get_or_init(|| rows_of(material));
    });
}

fn rows_of(material: &Material) -> Vec<f32> {
    let Material::Plastic { alpha, ior, beckmann, .. } = *material else { return Vec::new() };
    rows(ior, alpha, beckmann)
}

/// The table of a coat of constant width, or of all widths.
pub(crate) fn rows(ior: f32, alpha: ScalarInput, beckmann: bool) -> Vec<f32> {
    match alpha {
        ScalarInput::Constant(alpha) => row(ior, alpha, beckmann).into(),
        ScalarInput::Texture(_) => {
            (0..N_ALPHA).flat_map(|i| row(ior, (i as f32 / (N_ALPHA - 1) as f32).powi(2), beckmann)).collect()
        }
    }
}

fn row(ior: f32, alpha: f32, beckmann: bool) -> [f32; ROW] {
    /// Points of a mean over all angles: more for smooth coats, which cost nothing.
    const N_MEAN: [u32; 2] = [1024, 48];
    let is_smooth = alpha < SMALLEST_ALPHA || ior == 1.0;
    // All that returns on both sides, and what is reflected.
    let shares = |cos: f32, eta: f32| {
        if is_smooth {
            (1.0, f64::from(fresnel(cos, eta).0))
        } else {
            // The frame is undefined at exactly grazing incidence; a value close to the limit is used.
            scattered_once(cos.max(1e-5), Microfacets::isotropic(alpha.min(1.0), beckmann), eta, [24, 16])
        }
    };
    // Uniform in the square of the cosine, by which directions are weighted.
    let mean = |eta: f32, of: fn((f64, f64)) -> f64| {
        let n = N_MEAN[usize::from(!is_smooth)];
        let at = |i| of(shares(((i as f32 + 0.5) / n as f32).sqrt(), eta));
        ((0..n).map(at).sum::<f64>() / f64::from(n)) as f32
    };
    let passed = |(kept, reflected): (f64, f64)| kept - reflected;
    std::array::from_fn(|i| match i {
        N_COS => mean(1.0 / ior, passed),
        i if i > N_COS => mean(ior, |(_, reflected)| reflected).min(1.0 - f32::EPSILON),
        i => passed(shares((i as f32 / (N_COS - 1) as f32).powi(2), 1.0 / ior)) as f32,
    })
}
