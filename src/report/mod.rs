//! Speed against error: how fast a picture gets right, what each technique is worth, and whether the renderer's own
//! estimate of its error can be believed.
//!
//! [`measure_curve`] renders one scene at 1, 2, 4 … samples per pixel; a [`ReferenceStore`] has the picture to measure
//! against; [`ConvergenceCurve::measure`] brings the two together; [`page()`] and [`csv`] say what came of it.

mod convergence;
mod curve;
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

pub use convergence::{ConvergenceCurve, CurveLimits, CurveStep, Spent, Step, cpu_seconds, measure_curve};
pub use curve::{Seconds, seconds_to, slope};
pub use flip::flip;
pub use metrics::{Distance, RELATIVE_FLOOR};
pub use mismatch::{foreign_share, is_another_scene};
pub use outcome::{Ablation, SceneOutcome};
pub use page::{page, summary_text};
pub use picture::LinearPicture;
pub use reference::{Key, Made, Reference, ReferenceStore};
pub use table::csv;
pub use trees::{CountedVisits, MeanVisits, TreePlan, TreeRow, TreeTable, tree_plans};
