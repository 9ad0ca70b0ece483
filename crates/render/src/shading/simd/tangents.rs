//! Tangents at sixteen points.

use firstlight_simd::{Float, Mask, Simd, Vector, select, select_vector};

/// Tangents; see [`crate::shading::tangent::Tangent`].
#[derive(Clone, Copy)]
pub(crate) struct TangentLanes<S: Simd> {
    pub along_u: Vector<S>,
    pub handedness: Float<S>,
    /// Lanes that have one; none where no material needs it.
    pub known: Mask,
    /// Lanes whose normal the scalar code has turned already, if there is a map, and those where there is one.
    pub is_final: Mask,
    pub is_mapped: Mask,
}

impl<S: Simd> TangentLanes<S> {
    #[inline(always)]
    pub(crate) fn none(zero: Float<S>) -> Self {
        Self { along_u: Vector::all(zero), handedness: zero, known: 0, is_final: 0, is_mapped: 0 }
    }

    /// These in some lanes, and others elsewhere.
    #[inline(always)]
    pub(crate) fn over(self, mask: Mask, others: &Self) -> Self {
        Self {
            along_u: select_vector(mask, self.along_u, others.along_u),
            handedness: select(mask, self.handedness, others.handedness),
            known: mask | others.known,
            ..self
        }
    }
}
