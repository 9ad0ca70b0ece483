//! The dielectric coats of plastics, those that are alike once.

use crate::core::material::{Material, ScalarInput};
use firstlight_simd::padded;
use std::collections::HashMap;
use std::sync::OnceLock;

/// Rows of a coat of textured width, uniform in the root of the width.
pub(crate) const N_WIDTHS: usize = 17;

/// Entries by angle, uniform in the root of the cosine.
pub(crate) const N_COS: usize = 64;
/// Entries of a row: the transmitted share of light from outside, by angle; its mean for uniform light; the share of
/// uniform light from inside that is reflected.
pub(crate) const ROW: usize = N_COS + 2;

/// Coats by material, and what is tabulated for each of their rows.
#[derive(Debug, Default)]
pub(crate) struct CoatTable {
    /// Per material: number of its first row, and how many rows follow it: whole numbers, padded for gather operations.
    pub first: Vec<f32>,
    pub n_more: Vec<f32>,
    pub rows: Vec<CoatRow>,
    /// Per row: its entries, if the scene before has such a coat too.
    pub known: Vec<Option<[f32; ROW]>>,
    /// The entries of all rows, computed when first needed; see `shading/coat.rs`.
    pub entries: OnceLock<Vec<f32>>,
}

/// A coat of one width.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CoatRow {
    /// Index of refraction.
    pub ior: f32,
    pub alpha: f32,
    pub beckmann: bool,
}

impl CoatTable {
    /// - `before`: of a scene that may have some of the same coats.
    pub fn build(materials: &[Material], before: Option<&Self>) -> Self {
        let mut table = Self::default();
        let mut known = HashMap::new();
        for material in materials.iter().map(|material| material.scattering(materials)) {
            let (mut first, mut n_more) = (0, 0);
            if let Material::Plastic { alpha, ior, beckmann, .. } = *material {
                let constant = if let ScalarInput::Constant(alpha) = alpha { Some(alpha) } else { None };
                let key = (ior.to_bits(), constant.map(f32::to_bits), beckmann);
                first = *known.entry(key).or_insert(table.rows.len());
                n_more = if constant.is_some() { 0 } else { N_WIDTHS - 1 };
                if first == table.rows.len() {
                    let width = |i: usize| constant.unwrap_or((i as f32 / (N_WIDTHS - 1) as f32).powi(2));
                    table.rows.extend((0..=n_more).map(|i| CoatRow { ior, alpha: width(i), beckmann }));
                }
            }
            table.first.push(first as f32);
            table.n_more.push(n_more as f32);
        }
        let known = table.rows.iter().map(|row| before?.entries_of(row)).collect();
        Self { first: padded(table.first), n_more: padded(table.n_more), known, ..table }
    }

    fn entries_of(&self, row: &CoatRow) -> Option<[f32; ROW]> {
        let at = self.rows.iter().position(|known| known == row)?;
        let computed = self.entries.get().and_then(|entries| entries.as_chunks().0.get(at).copied());
        computed.or(self.known[at])
    }
}
