//! How caustics are looked for: which of the techniques are worth their cost in a picture.

use serde::{Deserialize, Serialize};
use std::fmt;

/// Which techniques look for caustics in a picture. Each plan has the same mean; they differ in noise and in cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct CausticPlan {
    /// Camera paths for each path from the lights: one of [`Self::STRIDES`], or 0 for no such paths.
    pub light_path_stride: u32,
    /// Camera paths that light paths are of no use to are guided to where caustics come from.
    pub guided: bool,
}

impl CausticPlan {
    /// Camera paths for each light path that may be chosen: powers of two.
    pub const STRIDES: [u32; 6] = [1, 2, 4, 8, 16, 32];

    /// Camera paths alone, by themselves.
    pub const NONE: Self = Self { light_path_stride: 0, guided: false };

    /// What is used before anything is known of a picture.
    pub const UNKNOWN: Self = Self { light_path_stride: 4, guided: true };

    /// Whether any of the techniques is used.
    pub fn is_none(self) -> bool {
        self == Self::NONE
    }

    /// Whether there are light paths.
    pub fn has_light_paths(self) -> bool {
        self.light_path_stride > 0
    }

    /// Whether it can be the plan of a picture.
    pub fn is_valid(self) -> bool {
        self.light_path_stride == 0 || Self::STRIDES.contains(&self.light_path_stride)
    }
}

/// What a pilot has found out about a picture: see `integrators/caustics/plan.rs`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CausticChoice {
    /// What is used.
    pub plan: CausticPlan,
    /// By how much light paths make a sample more expensive, those of the plan or, where it has none, the best that there
    /// could be; 1 where nothing was measured.
    pub cost: f32,
    /// By how much they make its variance smaller.
    pub gain: f32,
}

impl CausticChoice {
    /// Nothing to choose.
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
