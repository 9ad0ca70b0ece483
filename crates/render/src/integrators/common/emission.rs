//! Emission that paths hit.

use crate::core::material_queries::Emission;
use crate::core::techniques::Techniques;
use crate::integrators::common::caustics_pass::CausticPass;
use crate::prepare::prepared::Prepared;
use crate::shading::lights::emitter_weight;
use crate::shading::paths::Path;
use crate::shading::vertex::Vertex;
use firstlight_kdtree::Hit;
use glam::Vec3;

/// Returns the light of a path that hits a surface with emission, with the MIS weight against all that could have
/// found it too.
pub(crate) fn emitted_light(
    scene: &Prepared,
    techniques: &Techniques,
    caustics: Option<&CausticPass>,
    path: &Path,
    hit: &Hit,
    vertex: &Vertex,
    emission: &Emission,
) -> Vec3 {
    if !vertex.front && !emission.two_sided {
        return Vec3::ZERO;
    }
    let light = path.throughput * vertex.emitted(scene, emission);
    if light == Vec3::ZERO {
        return light;
    }
    let with_light_paths = caustics.and_then(|pass| pass.camera_weight(&path.track, path.media, hit, vertex));
    light * with_light_paths.unwrap_or_else(|| emitter_weight(scene, techniques, path, hit, vertex))
}
