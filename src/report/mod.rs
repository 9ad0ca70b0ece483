//! Convergence reports: error over time, the value of each technique, and the accuracy of the renderer's own error
//! estimate.
//!
//! [`measure_curve`] renders one scene at 1, 2, 4 … samples per pixel; a [`ReferenceStore`] supplies the reference
//! image; [`ConvergenceCurve::measure`] compares them; [`page()`] and [`csv`] format the results.

mod against;
mod convergence;
mod curve;
mod denoised;
mod difference;
mod flip;
mod metrics;
mod mismatch;
mod outcome;
mod page;
mod picture;
mod plot;
mod reference;
mod table;
mod trees;
mod z_test;

pub use against::{against_text, mean_ratio};
pub use convergence::{ConvergenceCurve, CurveLimits, CurveStep, Spent, Step, cpu_seconds, measure_curve};
pub use curve::{CurveSeconds, seconds_to, slope};
pub use denoised::{DenoisedCurve, DenoisedStep, denoised_curves, timed};
pub use difference::write_difference;
pub use flip::flip;
pub use metrics::{Distance, RELATIVE_FLOOR};
pub use mismatch::{foreign_share, is_another_scene};
pub use outcome::{Ablation, SceneOutcome};
pub use page::{denoised_text, is_page, page, summary_text};
pub use picture::LinearPicture;
pub use reference::{Made, ReferenceImage, ReferenceKey, ReferenceStore};
pub use table::{csv, is_csv};
pub use trees::{CountedVisits, MeanVisits, TreePlan, TreeRow, TreeTable, tree_plans};
pub use z_test::ZTest;
