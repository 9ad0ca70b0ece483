//! Angular dependence of a metal's reflectance.

use serde::{Deserialize, Serialize};

/// Angular dependence of a metal's reflectance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fresnel {
    /// The reflectance is the same at every angle.
    #[default]
    Constant,
    /// The reflectance rises to 1 at grazing angles by Schlick's approximation (Schlick 1994).
    Schlick,
}

/// Reflectance at normal incidence of a dielectric in air.
pub(crate) fn reflectance_of(ior: f32) -> f32 {
    ((ior - 1.0) / (ior + 1.0)).powi(2)
}
