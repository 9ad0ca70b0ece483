//! What is known of the portals of a view.

use crate::core::settings::RenderSettings;
use crate::integrators::portals::prepare_portals;
use crate::prepare::prepared::Prepared;

/// Number of portals through which an image of this view samples the environment; looks for them if that has not been
/// done, which takes some milliseconds.
pub fn portal_count(scene: &Prepared, settings: &RenderSettings) -> usize {
    prepare_portals(scene, settings);
    known_portal_count(scene)
}

/// Like [`portal_count`] for a view of which an image has samples; looks for nothing.
pub fn known_portal_count(scene: &Prepared) -> usize {
    scene.portals().map_or(0, |portals| portals.len())
}
