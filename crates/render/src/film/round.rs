//! How far an allocation of samples is: plain data that a film keeps. `allocation.rs` decides it.

/// From one budget, in mean samples per pixel of the film, to the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Round {
    /// The budget at which it was decided.
    pub from: u32,
    /// That at which it ends.
    pub to: u32,
    /// What has been spent: everything that is due up to it is there.
    pub budget: u32,
    /// All pixels get as many samples.
    pub even: bool,
    /// The film has samples that no round gave it: those of a part, or of a region. Its number of samples does not say
    /// how to make it again.
    pub irregular: bool,
}
