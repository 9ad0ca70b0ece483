//! What the dielectric coat of a plastic transmits and reflects inwards, at one point or at sixteen.
//!
//! Both are integrals over the visible microfacets of a rough coat, tabulated by its index and width: all other
//! parameters of a coat are constant over its surface, but its width may be textured.

use crate::core::material::{MaterialId, SMALLEST_ALPHA};
use crate::prepare::coat_table::{CoatRow, CoatTable, N_COS, ROW};
use crate::shading::dielectric::fresnel;
use crate::shading::glass_loss::scattered_once;
use crate::shading::integral_table::Between;
use crate::shading::microfacets::Microfacets;
use firstlight_simd::{Real, Truth, select};
use rayon::prelude::*;

/// The coat of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Coat<'a, R: Real = f32> {
    /// Index of refraction.
    pub ior: R,
    /// Isotropic.
    pub facets: Microfacets<R>,
    table: &'a [f32],
    /// Index of the row of its width, and the weight of the next one.
    start: R,
    part: R,
}

impl<'a> Coat<'a> {
    /// Returns the coat of a plastic; all tables are computed if this is the first.
    pub fn at(table: &'a CoatTable, id: MaterialId, ior: f32, facets: Microfacets) -> Self {
        Self::new(ior, facets, entries(table), [table.first[id as usize], table.n_more[id as usize]])
    }
}

impl<'a, R: Real> Coat<'a, R> {
    /// - `table`: of [`entries`]; `rows`: the first row of this coat and the number of others, see [`CoatTable`].
    #[inline(always)]
    pub fn new(ior: R, facets: Microfacets<R>, table: &'a [f32], [first, n_more]: [R; 2]) -> Self {
        let at = facets.alpha[0].at_least(0.0).at_most(1.0).sqrt() * n_more;
        let row = at.whole().min(n_more - 1.0).at_least(0.0);
        Self { ior, facets, table, start: (first + row) * ROW as f32, part: at - row }
    }

    /// Whether it reflects like a mirror.
    #[inline(always)]
    pub fn is_smooth(&self) -> R::Mask {
        self.facets.is_smooth()
    }

    /// Fresnel term at an angle with a microfacet.
    #[inline(always)]
    pub fn reflected(&self, cos: R) -> R {
        fresnel(cos.at_least(0.0).at_most(1.0), cos.all(1.0) / self.ior).0
    }

    /// Share of light from one direction outside that is transmitted.
    #[inline(always)]
    pub fn passed(&self, cos: R) -> R {
        let smooth = self.is_smooth();
        let exact = cos.all(1.0) - self.reflected(cos);
        if !(!smooth).any() {
            return exact;
        }
        let columns = Between::new(cos.at_least(0.0).sqrt(), N_COS);
        let mut share = columns.in_row(self.table, self.start);
        if self.part.is_positive().any() {
            let next = columns.in_row(self.table, self.start + ROW as f32);
            share += self.part * (next - share);
        }
        select(smooth, exact, share)
    }

    /// Share of uniform light from outside that is transmitted.
    #[inline(always)]
    pub fn mean_passed(&self) -> R {
        self.entry(N_COS)
    }

    /// Share of uniform light from inside that is reflected, below 1.
    #[inline(always)]
    pub fn reflected_inwards(&self) -> R {
        self.entry(N_COS + 1)
    }

    #[inline(always)]
    fn entry(&self, column: usize) -> R {
        let first = self.start + column as f32;
        let (share, next) = (first.entry_of(self.table), (first + ROW as f32).entry_of(self.table));
        share + self.part * (next - share)
    }
}

/// Returns the entries of all coats; computes them on this thread if there are none yet.
pub(crate) fn entries(table: &CoatTable) -> &[f32] {
    table.entries.get_or_init(|| padded(table.rows.iter().zip(&table.known).flat_map(known_or_new).collect()))
}

/// Computes the entries of all coats on all threads.
pub(crate) fn compute(table: &CoatTable) {
    if table.entries.get().is_none() {
        let rows = table.rows.par_iter().zip(&table.known).flat_map_iter(known_or_new).collect();
        // Another thread may have set them first, to the same values.
        let _ = table.entries.set(padded(rows));
    }
}

/// With a row after the last one: lanes that do not interpolate read it as well.
fn padded(mut rows: Vec<f32>) -> Vec<f32> {
    rows.extend([0.0; ROW]);
    rows
}

fn known_or_new((of, known): (&CoatRow, &Option<[f32; ROW]>)) -> [f32; ROW] {
    known.unwrap_or_else(|| row(of))
}

fn row(&CoatRow { ior, alpha, beckmann }: &CoatRow) -> [f32; ROW] {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::material::Material;
    use glam::Vec3;

    fn plastics(coats: &[(f32, f32)]) -> Vec<Material> {
        let plastic = |&(ior, alpha): &(f32, f32)| Material::Plastic {
            diffuse: Vec3::splat(0.5).into(),
            alpha: alpha.into(),
            ior,
            specular: 1.0.into(),
            nonlinear: false,
            beckmann: false,
        };
        coats.iter().map(plastic).collect()
    }

    #[test]
    fn coats_of_the_scene_before_are_taken_over_and_others_computed() {
        let before = CoatTable::build(&plastics(&[(1.5, 0.1), (1.3, 0.2), (1.5, 0.3)]), None);
        compute(&before);
        let materials = plastics(&[(1.5, 0.3), (1.5, 0.2), (1.5, 0.1)]);
        let after = CoatTable::build(&materials, Some(&before));
        assert_eq!(after.known.iter().map(Option::is_some).collect::<Vec<_>>(), [true, false, true]);
        // Taken over once more before they were needed.
        let later = CoatTable::build(&materials, Some(&after));
        let new = CoatTable::build(&materials, None);
        compute(&after);
        assert_eq!(entries(&after), entries(&new));
        assert_eq!(entries(&later), entries(&new));
    }
}
