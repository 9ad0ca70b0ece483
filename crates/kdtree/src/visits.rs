//! What one ray costs, counted.

/// What one ray looked at in one tree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Visits {
    /// Nodes with two children.
    pub inner: usize,
    /// Leaves with something in them.
    pub leaves: usize,
    /// Blocks of primitives in these leaves.
    pub blocks: usize,
}
