//! A value that nothing is made from.

use std::fmt;
use thiserror::Error;

/// A value that nothing is made from: which field, what it is, and what is allowed.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum BadValue {
    #[error("`{field}` is {value}, but must {allowed}")]
    OutOfRange { field: &'static str, value: String, allowed: String },
    /// Values that do not go together.
    #[error("{problem}")]
    Unfit { field: &'static str, problem: String },
}

impl BadValue {
    pub(super) fn out_of_range(field: &'static str, value: impl fmt::Display, allowed: impl Into<String>) -> Self {
        Self::OutOfRange { field, value: value.to_string(), allowed: allowed.into() }
    }

    pub(super) fn unfit(field: &'static str, problem: impl Into<String>) -> Self {
        Self::Unfit { field, problem: problem.into() }
    }

    /// As scene files call it; `camera` where the camera as a whole says too little.
    pub fn field(&self) -> &'static str {
        match self {
            Self::OutOfRange { field, .. } | Self::Unfit { field, .. } => field,
        }
    }
}

impl From<BadValue> for String {
    fn from(bad: BadValue) -> Self {
        bad.to_string()
    }
}
