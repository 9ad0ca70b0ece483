//! Stored views: bookmarks, and the positions at which the camera rested.

use crate::frame::core::rig::Rig;
use bevy_ecs::prelude::Resource;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::time::Duration;

/// Views under the numbers 1 to 9.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Bookmarks(pub [Option<Rig>; 9]);

impl Bookmarks {
    /// The view under a number from 1 to 9.
    pub fn get(&self, slot: u8) -> Option<Rig> {
        *self.0.get(usize::from(slot).checked_sub(1)?)?
    }

    /// Stores a view under a number from 1 to 9; false for any other number.
    pub fn set(&mut self, slot: u8, rig: Rig) -> bool {
        let place = usize::from(slot).checked_sub(1).and_then(|i| self.0.get_mut(i));
        place.map(|place| *place = Some(rig)).is_some()
    }
}

/// The views at which the camera rested, oldest first, and the current position among them.
#[derive(Resource, Clone, Debug, Default)]
pub struct ViewTrail {
    back: VecDeque<Rig>,
    ahead: Vec<Rig>,
    now: Option<Rig>,
    moved_at: Duration,
}

impl ViewTrail {
    const MAX: usize = 64;
    /// Time of rest after which a view is recorded.
    const REST: Duration = Duration::from_millis(600);

    /// Removes all views, because another scene was opened.
    pub fn forget(&mut self) {
        *self = Self::default();
    }

    /// Must be called with the camera of every frame; records a view when the camera leaves it.
    pub fn see(&mut self, rig: Rig, now: Duration) {
        let Some(before) = self.now.replace(rig) else { return };
        // Only pose and projection make a view; the lens has separate settings.
        if before.view == rig.view && before.projection == rig.projection {
            return;
        }
        if now.saturating_sub(self.moved_at) >= Self::REST {
            self.back.push_back(before);
            if self.back.len() > Self::MAX {
                self.back.pop_front();
            }
            self.ahead.clear();
        }
        self.moved_at = now;
    }

    /// The previous view; it becomes the current one.
    pub fn previous(&mut self) -> Option<Rig> {
        let rig = self.back.pop_back()?;
        self.ahead.extend(self.now.replace(rig));
        Some(rig)
    }

    /// The next view; it becomes the current one.
    pub fn forth(&mut self) -> Option<Rig> {
        let rig = self.ahead.pop()?;
        self.back.extend(self.now.replace(rig));
        Some(rig)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::View;
    use glam::DVec3;

    fn at(x: f64) -> Rig {
        Rig { view: View { eye: DVec3::X * x, ..View::default() }, ..Rig::default() }
    }

    #[test]
    fn the_trail_has_the_stops_and_not_the_way() {
        let mut trail = ViewTrail::default();
        let ms = Duration::from_millis;
        trail.see(at(0.0), ms(0));
        // Two seconds of rest, motion over many frames, another rest, another motion.
        for i in 1..=50 {
            trail.see(at(f64::from(i)), ms(2000 + 16 * u64::from(i as u32)));
        }
        for i in 51..=80 {
            trail.see(at(f64::from(i)), ms(5000 + 16 * u64::from(i as u32)));
        }
        assert_eq!(trail.previous(), Some(at(50.0)));
        trail.see(at(50.0), ms(9000));
        assert_eq!(trail.previous(), Some(at(0.0)));
        assert_eq!(trail.previous(), None);
        assert_eq!([trail.forth(), trail.forth(), trail.forth()], [Some(at(50.0)), Some(at(80.0)), None]);
        // New motion from there.
        trail.see(at(80.0), ms(10_000));
        trail.see(at(7.0), ms(12_000));
        assert_eq!(trail.previous(), Some(at(80.0)));
    }

    #[test]
    fn bookmarks_have_nine_places() {
        let mut bookmarks = Bookmarks::default();
        assert!(!bookmarks.set(0, at(1.0)) && !bookmarks.set(10, at(1.0)));
        assert!(bookmarks.set(9, at(9.0)));
        assert_eq!(
            (bookmarks.get(9), bookmarks.get(1), bookmarks.get(0), bookmarks.get(10)),
            (Some(at(9.0)), None, None, None)
        );
    }
}
