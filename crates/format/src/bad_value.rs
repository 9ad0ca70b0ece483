//! Values out of range and inconsistent values.

use thiserror::Error;

/// An invalid value: which field, its value, and what is allowed.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum BadValue {
    /// A field has a value outside of its range.
    #[error("`{field}` is {value}, but must {allowed}")]
    OutOfRange {
        /// Name of the field, as in a scene file.
        field: &'static str,
        /// Its value, as text.
        value: String,
        /// What is allowed, as the end of a sentence that begins with "must".
        allowed: String,
    },
    /// Values that are inconsistent with each other.
    #[error("{problem}")]
    Unfit {
        /// Name of the field, as in a scene file; `camera` for the camera as a whole.
        field: &'static str,
        /// What is wrong; lower case, no full stop.
        problem: String,
    },
}

impl BadValue {
    pub(crate) fn out_of_range(field: &'static str, value: String, allowed: impl Into<String>) -> Self {
        Self::OutOfRange { field, value, allowed: allowed.into() }
    }

    pub(crate) fn unfit(field: &'static str, problem: impl Into<String>) -> Self {
        Self::Unfit { field, problem: problem.into() }
    }

    /// Name of the field, as in a scene file; `camera` if the camera as a whole is incomplete or contradictory.
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
