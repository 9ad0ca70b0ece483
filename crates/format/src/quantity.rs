//! Types of the values of properties.

/// Type of a key's value: determines the number of components and the interpolation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Three coordinates, metres; smooth curves may overshoot their keys.
    Position,
    /// Three coordinates, not all 0; like [`Self::Position`].
    Direction,
    /// Degrees about X, then Y, then Z.
    Rotation,
    /// One factor or three; stays within the range of the keys.
    Factors,
    /// One number or three, linear Rec. 709; stays within the range of the keys.
    Color,
    /// One number; stays within the range of the keys.
    Number,
}

impl Quantity {
    /// Whether smooth curves stay within the range of their keys, and so within the limits of the value.
    pub(crate) fn is_limited(self) -> bool {
        matches!(self, Self::Factors | Self::Color | Self::Number)
    }
}
