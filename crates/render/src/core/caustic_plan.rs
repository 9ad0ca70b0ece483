//! Plans for caustics: which of the techniques are worth their cost in an image.

use serde::{Deserialize, Serialize};
use std::fmt;

/// The techniques for caustics in an image. All plans have the same expectation; they differ in noise and cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct CausticPlan {
    /// Camera paths per light path: one of [`Self::STRIDES`], or 0 for no light paths.
    pub light_path_stride: u32,
    /// Whether camera paths that light paths cannot replace are guided.
    pub guided: bool,
}

impl CausticPlan {
    /// Possible numbers of camera paths per light path: powers of two.
    pub const STRIDES: [u32; 6] = [1, 2, 4, 8, 16, 32];

    /// Unguided camera paths only.
    pub const NONE: Self = Self { light_path_stride: 0, guided: false };

    /// The plan before anything is known about an image.
    pub const UNKNOWN: Self = Self { light_path_stride: 4, guided: true };

    /// Whether any of the techniques is used.
    pub fn is_none(self) -> bool {
        self == Self::NONE
    }

    /// Whether there are light paths.
    pub fn has_light_paths(self) -> bool {
        self.light_path_stride > 0
    }

    /// Whether it can be the plan of an image.
    pub fn is_valid(self) -> bool {
        self.light_path_stride == 0 || Self::STRIDES.contains(&self.light_path_stride)
    }
}

/// Result of the pilot for an image: see `integrators/caustics/plan.rs`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CausticChoice {
    /// The chosen plan.
    pub plan: CausticPlan,
    /// Factor by which light paths increase the cost of a sample: those of the plan or, if it has none, the best
    /// candidate; 1 if nothing was measured.
    pub cost: f32,
    /// Factor by which they reduce its variance.
    pub gain: f32,
}

impl CausticChoice {
    /// The choice without alternatives.
    pub const NONE: Self = Self { plan: CausticPlan::NONE, cost: 1.0, gain: 1.0 };
}

impl fmt::Display for CausticChoice {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { plan, cost, gain } = *self;
        let measured = (cost, gain) != (1.0, 1.0);
        match plan.light_path_stride {
            0 if measured => write!(f, "no light paths: would cost {cost:.2}× and save {gain:.2}×")?,
            0 => f.write_str("no light paths")?,
            1 => f.write_str("1 light path per camera path")?,
            stride => write!(f, "1 light path per {stride} camera paths")?,
        }
        if plan.has_light_paths() && measured {
            write!(f, ", cost {cost:.2}×, save {gain:.2}×")?;
        }
        if plan.guided { f.write_str(", guided") } else { Ok(()) }
    }
}
