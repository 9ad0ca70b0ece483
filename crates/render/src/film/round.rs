//! Progress of the sample allocation: plain data that is stored in the film. `allocation.rs` decides it.

/// A step of the allocation from one budget to the next, in mean samples per pixel of the film.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Round {
    /// The budget at which the round was decided.
    pub from: u32,
    /// The budget at which it ends.
    pub to: u32,
    /// The budget spent so far: all samples that are due up to it have been taken.
    pub budget: u32,
    /// Whether all pixels get the same number of samples.
    pub even: bool,
    /// Whether the film has samples that no round allocated: those of a part, or of a region. Then its sample count
    /// does not suffice to reproduce it.
    pub irregular: bool,
}
