//! Which media a path is inside of, and what it finds where they end.

/// A set of media, by its place in the [`crate::shading::medium::MediumSets`] of one worker.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(crate) struct MediumId(pub u32);

impl MediumId {
    /// Inside of no body.
    pub const OUTSIDE: Self = Self(0);
}

/// What a path finds at the surface of a transparent body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Interface {
    /// Index on the side of the path over the index beyond.
    pub eta: f32,
    /// Its square multiplies radiance from beyond: η of the two media.
    pub squeeze: f32,
    /// What the path is inside of once it has passed.
    pub beyond: MediumId,
}

impl Interface {
    /// Seen from its other side, but for what lies beyond.
    #[inline]
    pub fn reversed(self) -> Self {
        Self { eta: 1.0 / self.eta, squeeze: 1.0 / self.squeeze, ..self }
    }
}
