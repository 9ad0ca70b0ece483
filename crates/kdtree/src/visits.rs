//! Counts of traversal steps of one ray.

/// Steps of one ray in one tree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Visits {
    /// Nodes with two children.
    pub inner: usize,
    /// Leaves with at least one primitive.
    pub leaves: usize,
    /// Blocks of primitives in these leaves.
    pub blocks: usize,
}
