//! The dielectric coats of plastics, those that are alike once.

use crate::core::material::{Material, ScalarInput};
use firstlight_simd::padded;
use std::collections::HashMap;
use std::sync::OnceLock;

/// Rows of a coat of textured width, uniform in the root of the width.
pub(crate) const N_WIDTHS: usize = 17;

/// Coats by material, and what is tabulated for each of their rows.
#[derive(Debug, Default)]
pub(crate) struct CoatTable {
    /// Per material: number of its first row, and how many rows follow it: whole numbers, padded for gather operations.
    pub first: Vec<f32>,
    pub n_more: Vec<f32>,
    pub rows: Vec<CoatRow>,
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
    pub fn build(materials: &[Material]) -> Self {
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
        Self { first: padded(table.first), n_more: padded(table.n_more), ..table }
    }
}
