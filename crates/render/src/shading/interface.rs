//! Media on the two sides of a surface that a path meets.

/// A set of media, and the channel of a path that dispersion has limited to one: four times the index of the set in the
/// [`crate::shading::medium::MediumSets`] of one worker, plus 0 for all channels, or 1, 2, 3 for red, green, blue.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(crate) struct MediumId(pub u32);

impl MediumId {
    /// The empty set: outside of all bodies.
    pub const OUTSIDE: Self = Self(0);

    /// The same media for a path of all channels.
    #[inline]
    pub fn of_all_channels(self) -> Self {
        Self(self.0 & !3)
    }

    /// 0 for all channels, or 1, 2, 3.
    #[inline]
    pub fn channel(self) -> u32 {
        self.0 & 3
    }

    /// The same media for a path of this channel, 0 to 3.
    #[inline]
    pub fn in_channel(self, channel: u32) -> Self {
        Self(self.0 & !3 | channel)
    }
}

/// The interface that a path finds at the surface of a transparent body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Interface {
    /// Index of refraction on the side of the path over that on the far side.
    pub eta: f32,
    /// Relative index whose square scales radiance from the far side: η of the two media, or 1.
    pub radiance_eta: f32,
    /// Media of the path after passing.
    pub beyond: MediumId,
}

impl Interface {
    /// The interface of a surface without thickness, in these media.
    #[inline]
    pub fn thin(here: MediumId) -> Self {
        Self { eta: 1.0, radiance_eta: 1.0, beyond: here }
    }

    /// Returns the interface as seen from the far side, except for `beyond`.
    #[inline]
    pub fn reversed(self) -> Self {
        Self { eta: 1.0 / self.eta, radiance_eta: 1.0 / self.radiance_eta, ..self }
    }
}
