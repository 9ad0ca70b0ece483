//! The cameras of the scene, in the order of the nodes. A camera looks along −z of its node.

use crate::error::gltf::{GltfProblem, Located, item, place};
use crate::gltf::document::Document;
use crate::gltf::nodes::Tree;
use firstlight_format::bounds;
use glam::DVec3;

/// The projection of a camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lens {
    /// Vertical field of view, radians.
    Perspective(f64),
    /// Half the height of the visible region, metres.
    Orthographic(f64),
}

/// A camera of a glTF file.
#[derive(Clone, Debug, PartialEq)]
pub struct GltfCamera {
    /// Name of the node, else of the camera, else its index; unique.
    pub name: String,
    /// Position, metres.
    pub eye: DVec3,
    /// View direction, unit vector.
    pub forward: DVec3,
    /// Up direction, unit vector.
    pub up: DVec3,
    /// Its projection.
    pub lens: Lens,
    /// Index of its node.
    pub node: u32,
}

impl Document {
    /// The cameras of the scene; those without a projection are left out.
    pub(crate) fn cameras(&self, tree: &Tree) -> Vec<GltfCamera> {
        let mut cameras: Vec<GltfCamera> = Vec::new();
        let mut names = firstlight_format::names::Names::default();
        for &node in &tree.scene {
            let json = &self.root.nodes[node as usize];
            let Some(index) = json.camera else { continue };
            let world = tree.worlds[node as usize];
            let camera = self.lens(index).and_then(|camera| match world.translation.abs().max_element() {
                far if far > bounds::MAX_COORDINATE => Err((place("nodes", node), GltfProblem::TooFar)),
                _ => Ok(camera),
            });
            let Some((named, lens)) = self.omissions.kept(&place("cameras", index), camera) else { continue };
            let forward = world.transform_vector3(DVec3::NEG_Z).normalize_or(DVec3::NEG_Z);
            let up = world.transform_vector3(DVec3::Y);
            let up = (up - up.dot(forward) * forward).normalize_or(forward.any_orthonormal_vector());
            let own = [&json.name, named].into_iter().flatten().find(|name| !name.is_empty()).cloned();
            let name = names.free(&own.unwrap_or_else(|| format!("camera {}", cameras.len() + 1)));
            cameras.push(GltfCamera { name, eye: world.translation, forward, up, lens, node });
        }
        cameras
    }

    /// Name and projection of a camera.
    fn lens(&self, index: u32) -> Result<(&Option<String>, Lens), Located> {
        let here = |problem| (place("cameras", index), problem);
        let camera = item(&self.root.cameras, "cameras", index).map_err(here)?;
        let lens = match (camera.kind.as_str(), camera.perspective, camera.orthographic) {
            ("perspective", Some(perspective), _) => Lens::Perspective(perspective.yfov),
            ("orthographic", _, Some(orthographic)) => Lens::Orthographic(orthographic.ymag.abs()),
            (found, ..) => {
                let expected = "perspective or orthographic, with numbers of its own";
                return Err(here(GltfProblem::Value { what: "type", found: found.to_owned(), expected }));
            }
        };
        let (Lens::Perspective(size) | Lens::Orthographic(size)) = lens;
        if !(size > 0.0 && size <= bounds::MAX_COORDINATE) {
            let (what, found) = ("yfov or ymag", size.to_string());
            return Err(here(GltfProblem::Value { what, found, expected: "a positive number" }));
        }
        Ok((&camera.name, lens))
    }
}
