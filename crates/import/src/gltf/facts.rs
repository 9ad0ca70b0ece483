//! Summary of the contents of a glTF file, for reports.

use crate::gltf::assembly::Assembly;
use crate::gltf::document::{Document, SUPPORTED};
use crate::gltf::surfaces::Surfaces;
use serde_json::Value;

/// Summary of the contents of a glTF file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GltfFacts {
    /// Names of the cameras, in order.
    pub cameras: Vec<String>,
    /// Names and kinds of the lights, in order.
    pub lights: Vec<String>,
    /// Names of the material variants, in order.
    pub variants: Vec<String>,
    /// Names of the animations, in order.
    pub animations: Vec<String>,
    /// Time at which the last animation ends, seconds.
    pub animation_length: Option<f64>,
    /// Number of meshes in the file.
    pub meshes: usize,
    /// Number of placed meshes in the scene.
    pub instances: usize,
    /// Extensions that the file uses, in order.
    pub extensions: Vec<String>,
    /// Extensions among them that are not supported.
    pub unknown_extensions: Vec<String>,
    /// Unsupported features of its materials: name of the material, and the feature.
    pub notes: Vec<(String, String)>,
}

impl Document {
    /// Names of the material variants.
    pub(crate) fn variants(&self) -> Vec<String> {
        let list = self.root.extensions.get("KHR_materials_variants").and_then(|extension| extension.get("variants"));
        let named = |(i, variant): (usize, &Value)| {
            let name = variant.get("name").and_then(Value::as_str).unwrap_or_default();
            if name.is_empty() { format!("variant {i}") } else { name.to_owned() }
        };
        list.and_then(Value::as_array).into_iter().flatten().enumerate().map(named).collect()
    }

    pub(crate) fn facts(&self, assembly: &Assembly, surfaces: &Surfaces) -> GltfFacts {
        let named = |(i, name): (usize, &Option<String>)| {
            name.clone().filter(|name| !name.is_empty()).unwrap_or_else(|| format!("animation {i}"))
        };
        let kind = |light: &crate::gltf::assembly::PlacedLight| match light.light.kind {
            crate::gltf::lights::GltfLightKind::Point => "point",
            crate::gltf::lights::GltfLightKind::Spot { .. } => "spot",
            crate::gltf::lights::GltfLightKind::Directional => "directional",
        };
        let occluded = surfaces.materials.iter().filter(|surface| surface.has_occlusion);
        let occluded = occluded.map(|surface| {
            (surface.name.clone(), "its occlusion map is not used: paths find what is occluded".to_owned())
        });
        let notes = surfaces
            .materials
            .iter()
            .flat_map(|surface| surface.notes.iter().map(|note| (surface.name.clone(), note.clone())));
        let is_unknown = |name: &&String| !SUPPORTED.contains(&name.as_str());
        GltfFacts {
            cameras: assembly.cameras.iter().map(|camera| camera.name.clone()).collect(),
            lights: (assembly.lights.iter().enumerate())
                .map(|(i, light)| {
                    let name = light.name.clone().unwrap_or_else(|| format!("light {}", i + 1));
                    format!("{name} ({})", kind(light))
                })
                .collect(),
            variants: self.variants(),
            animations: self.root.animations.iter().map(|animation| &animation.name).enumerate().map(named).collect(),
            animation_length: self.animation_length(),
            meshes: self.root.meshes.len(),
            instances: assembly.meshes.len(),
            extensions: self.root.extensions_used.clone(),
            unknown_extensions: self.root.extensions_used.iter().filter(is_unknown).cloned().collect(),
            notes: notes.chain(occluded).collect(),
        }
    }
}
