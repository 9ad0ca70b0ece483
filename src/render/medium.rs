//! Which glass is a path inside of? Nested solids each bring an index and an absorption of their own.

use super::{Material, MaterialId, Snapshot};
use glam::Vec3;

/// The glasses that a path has entered and not left, outermost first.
///
/// Four deep: a drink with ice and a bubble in a glass. What is nested deeper is treated as lying in the fourth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct MediumStack([MaterialId; DEPTH]);

const DEPTH: usize = 4;
const NONE: MaterialId = MaterialId::MAX;

impl Default for MediumStack {
    fn default() -> Self {
        Self([NONE; DEPTH])
    }
}

impl MediumStack {
    fn top(&self) -> Option<MaterialId> {
        self.0.iter().rev().copied().find(|&id| id != NONE)
    }

    #[inline]
    pub fn is_empty(&self) -> bool {
        self.0[0] == NONE
    }

    /// After passing through the surface of `id`: into it from the front, out of it from the back.
    pub fn crossed(mut self, id: MaterialId, front: bool) -> Self {
        if front {
            if let Some(free) = self.0.iter_mut().find(|slot| **slot == NONE) {
                *free = id;
            }
        } else if let Some(at) = self.0.iter().rposition(|&slot| slot == id) {
            self.0[at..].rotate_left(1);
            self.0[DEPTH - 1] = NONE;
        }
        self
    }

    /// Index on the side of the ray over the index beyond the surface of glass `id`.
    #[inline]
    pub fn eta(&self, scene: &Snapshot, id: MaterialId, front: bool) -> f32 {
        let own = ior(scene, Some(id));
        let here = ior(scene, self.top());
        if front {
            here / own
        } else if self.0.contains(&id) {
            // Where surfaces touch, rounding may swap the order in which they are met: then the path is inside of
            // another glass before and after, and nothing bends.
            here / ior(scene, self.crossed(id, false).top())
        } else {
            // The eye began inside.
            own / here
        }
    }

    /// Index of refraction where the path is.
    #[inline]
    pub fn ior(&self, scene: &Snapshot) -> f32 {
        ior(scene, self.top())
    }

    /// What is left of light after `distance` metres (Beer–Lambert).
    #[inline]
    pub fn transmittance(&self, scene: &Snapshot, distance: f32) -> Vec3 {
        let absorption = match self.top().map(|id| &scene.shading.materials[id as usize]) {
            Some(Material::Glass { absorption, .. } | Material::Phong { absorption, .. }) => *absorption,
            Some(_) => Vec3::ZERO,
            None => scene.shading.air,
        };
        if absorption == Vec3::ZERO {
            return Vec3::ONE;
        }
        // 0 · ∞ would be NaN: a channel without absorption keeps everything, however far.
        Vec3::select(absorption.cmpgt(Vec3::ZERO), (-absorption * distance).exp(), Vec3::ONE)
    }
}

fn ior(scene: &Snapshot, id: Option<MaterialId>) -> f32 {
    match id.map(|id| &scene.shading.materials[id as usize]) {
        Some(Material::Glass { ior, .. } | Material::Phong { ior, .. }) => *ior,
        _ => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaving_removes_the_glass_that_was_left() {
        let inside = MediumStack::default().crossed(7, true).crossed(3, true);
        assert_eq!(inside.top(), Some(3));
        assert_eq!(inside.crossed(3, false).top(), Some(7));
        // Solids that overlap are left in the order in which they were entered.
        assert_eq!(inside.crossed(7, false).top(), Some(3));
        assert!(inside.crossed(3, false).crossed(7, false).is_empty());
        // Leaving what was never entered (the eye began inside) changes nothing.
        assert_eq!(inside.crossed(9, false), inside);
    }

    #[test]
    fn more_than_four_do_not_break_it() {
        let mut stack = MediumStack::default();
        for id in 0..6 {
            stack = stack.crossed(id, true);
        }
        assert_eq!(stack.top(), Some(3));
        for id in (0..6).rev() {
            stack = stack.crossed(id, false);
        }
        assert!(stack.is_empty());
    }
}
