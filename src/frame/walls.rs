//! Views from a side that stay in the room.

use crate::frame::state::selection::distance;
use crate::scene::{Extraction, View};

/// Part of the way to a wall.
const SHORT_OF: f64 = 0.95;

/// Moves a view of the same pivot from another side, `to`, nearer to it where the camera would leave the room: behind a
/// wall, it would show nothing but its back. In a room, a camera has walls on both sides.
pub fn within_walls(scene: &Extraction, from: &View, to: View) -> View {
    let outwards = -to.forward;
    let wall = distance(scene, from.eye, outwards).filter(|_| distance(scene, from.eye, -outwards).is_some());
    // What is in front of the pivot is a thing in the room.
    let room = wall.map(|wall| wall + (from.eye - to.pivot()).dot(outwards)).filter(|room| *room > 0.0);
    let pivot_distance = room.map_or(to.pivot_distance, |room| to.pivot_distance.min(SHORT_OF * room));
    View { eye: to.pivot() + pivot_distance * outwards, pivot_distance, ..to }
}
