//! Names of what a snapshot holds.

use crate::scene::{Extraction, SceneInputs};
use glam::DVec3;
use std::collections::BTreeMap;

/// Names of the objects of a snapshot, and its origin.
#[derive(Clone, Debug, Default)]
pub struct SnapshotNames {
    pub(crate) origin: DVec3,
    names: Vec<String>,
    pub(crate) materials: Vec<String>,
    /// Names of delta lights.
    lights: Vec<String>,
}

impl SnapshotNames {
    /// Collects the names of the objects and lights of an extraction from the inputs that it was made from.
    pub fn of(extraction: &Extraction, inputs: &SceneInputs) -> Self {
        let objects: BTreeMap<_, _> = inputs.objects.iter().map(|object| (object.entity, object)).collect();
        let lights: BTreeMap<_, _> = inputs.lights.iter().map(|light| (light.entity, light)).collect();
        let name = |(i, entity): (usize, _)| match (objects.get(entity), lights.get(entity)) {
            (Some(object), _) => object.name.clone().unwrap_or_else(|| format!("{} {i}", object.shape.kind())),
            (_, Some(light)) => light.name.clone().unwrap_or_else(|| format!("{} {i}", light.light.name())),
            _ => format!("object {i}"),
        };
        let names = extraction.entities.iter().enumerate().map(name).collect();
        let n_objects = extraction.entities.len();
        let lights =
            extraction.delta_lights.iter().enumerate().map(|(i, entity)| name((n_objects + i, entity))).collect();
        Self { origin: extraction.origin, names, materials: material_names(extraction, inputs), lights }
    }

    /// Names of all objects by index.
    pub fn objects(&self) -> &[String] {
        &self.names
    }

    /// Names of all materials by index.
    pub fn materials(&self) -> &[String] {
        &self.materials
    }

    pub(crate) fn object(&self, object: u32) -> String {
        self.names.get(object as usize).cloned().unwrap_or_else(|| "edge of a light".to_owned())
    }

    pub(crate) fn light(&self, light: u32) -> String {
        self.lights.get(light as usize).cloned().unwrap_or_else(|| "light".to_owned())
    }
}

/// Names by material of the snapshot; unnamed materials are called by their number.
fn material_names(extraction: &Extraction, inputs: &SceneInputs) -> Vec<String> {
    let of_materials = inputs.materials.iter().map(|material| (material.entity, &material.name));
    let of_lights = inputs.lights.iter().map(|light| (light.entity, &light.name));
    let names: BTreeMap<_, _> =
        of_materials.chain(of_lights).filter_map(|(entity, name)| Some((entity, name.as_ref()?))).collect();
    let name = |(i, entity): (usize, Option<_>)| match entity.and_then(|entity| names.get(&entity)) {
        Some(name) => (*name).clone(),
        None => format!("material {i}"),
    };
    extraction.material_entities().enumerate().map(name).collect()
}
