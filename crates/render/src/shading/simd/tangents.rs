//! Tangents at sixteen points.

use firstlight_simd::{Float, Mask, Simd, Vector, select, select_vector};

/// Tangents; see [`crate::shading::tangent::Tangent`].
#[derive(Clone, Copy)]
pub(crate) struct TangentLanes<S: Simd> {
    pub along_u: Vector<S>,
    pub handedness: Float<S>,
    /// Lanes whose normal the scalar code has turned already, if there is a map, and those where there is one.
    pub is_final: Mask,
    pub is_mapped: Mask,
}

impl<S: Simd> TangentLanes<S> {
    /// These in some lanes, and others elsewhere.
    #[inline(always)]
    pub(crate) fn over(self, mask: Mask, others: &Self) -> Self {
        Self {
            along_u: select_vector(mask, self.along_u, others.along_u),
            handedness: select(mask, self.handedness, others.handedness),
            ..self
        }
    }
}
