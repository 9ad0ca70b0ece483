//! The animations of a glTF file on the entities of the scene that was made from it.

use crate::format::camera::CameraPart;
use crate::format::sources::{MeshSource, Seconds};
use crate::import::gltf_motion::GltfMotion;
use crate::scene::world::components::put;
use crate::scene::world::components::{MeshOrigin, Shape};
use crate::scene::world::inputs::SceneInputs;
use crate::scene::world::lights::{light_of, put_light};
use bevy_ecs::prelude::{Entity, World};
use std::collections::{HashMap, HashSet};
use std::ops::RangeInclusive;
use std::sync::Arc;

/// Which entities the nodes of a file are.
#[derive(Clone, Debug)]
pub(in crate::scene) struct ModelMotion {
    pub motion: Arc<GltfMotion>,
    /// Those that are meshes of the file, in the order of the scene.
    pub objects: Vec<Entity>,
    /// Those that are lights of the file, in the order of the scene.
    pub lights: Vec<Entity>,
    /// Whether the camera stands still, even if that of the file moves.
    pub holds_camera: bool,
}

impl PartialEq for ModelMotion {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.motion, &other.motion)
            && self.objects == other.objects
            && self.lights == other.lights
            && self.holds_camera == other.holds_camera
    }
}

impl ModelMotion {
    /// Seconds to the end of the last animation.
    pub(super) fn length(&self) -> f64 {
        self.motion.length
    }

    pub(super) fn is_moving_during(&self, seconds: &RangeInclusive<f64>) -> bool {
        *seconds.end() > 0.0 && *seconds.start() < self.motion.length
    }

    pub(super) fn moves_camera(&self) -> bool {
        self.motion.camera.is_some() && !self.holds_camera
    }

    /// Leaves these entities, and perhaps the camera, where they are from now on.
    pub(super) fn hold(&mut self, camera: bool, entities: &HashSet<Entity>) {
        self.holds_camera |= camera;
        for entity in self.objects.iter_mut().chain(&mut self.lights) {
            if entities.contains(entity) {
                *entity = Entity::PLACEHOLDER;
            }
        }
    }

    /// `part` where the camera of the file is at a time; the lens stays.
    pub(super) fn camera_at(&self, part: CameraPart, seconds: f64) -> CameraPart {
        let Some(camera) = self.motion.at(seconds).and_then(|moment| moment.camera) else { return part };
        CameraPart {
            eye: camera.eye,
            look_at: camera.look_at,
            forward: camera.forward,
            pivot_distance: camera.pivot_distance,
            up: camera.up,
            vfov: camera.vfov,
            orthographic_height: camera.orthographic_height,
            ..part
        }
    }

    /// Moves nodes; meshes of skins and morph targets keep their shape.
    pub(super) fn set_inputs(&self, inputs: &mut SceneInputs, seconds: f64) {
        let Some(moment) = self.motion.at(seconds) else { return };
        let objects: HashMap<Entity, _> =
            moment.objects.iter().filter_map(|(i, placement)| Some((*self.objects.get(*i)?, placement))).collect();
        for object in &mut inputs.objects {
            if let Some(placement) = objects.get(&object.entity) {
                object.placement = **placement;
            }
        }
        let lights =
            moment.lights.iter().filter_map(|(i, kind, placement)| Some((*self.lights.get(*i)?, (*kind, *placement))));
        let lights: HashMap<Entity, _> = lights.collect();
        for light in &mut inputs.lights {
            if let Some(&(kind, placement)) = lights.get(&light.entity) {
                (light.light, light.placement) = (kind, placement);
            }
        }
    }

    /// Moves nodes, and makes the meshes of skins and morph targets again.
    pub(super) fn set_world(&self, world: &mut World, seconds: f64) {
        let Some(moment) = self.motion.at(seconds) else { return };
        for (i, placement) in moment.objects {
            if let Some(&entity) = self.objects.get(i) {
                put(world, entity, placement);
            }
        }
        for (i, light, placement) in moment.lights {
            let Some(&entity) = self.lights.get(i) else { continue };
            if light_of(world, entity).is_some() {
                put_light(world, entity, light);
                put(world, entity, placement);
            }
        }
        for (i, mesh) in self.motion.meshes_at(seconds) {
            let Some(&entity) = self.objects.get(i) else { continue };
            // A simplified mesh, or one that is shaded in another way, is not that of the file.
            let origin =
                world.get::<MeshOrigin>(entity).filter(|it| it.simplify.is_none() && it.shading == Default::default());
            let (Some(origin), Some(Shape::Mesh(_))) = (origin, world.get::<Shape>(entity)) else { continue };
            if let MeshSource::Gltf { file, mesh: index, node, at } = &origin.source
                && *at != Some(Seconds(seconds))
            {
                let source =
                    MeshSource::Gltf { file: file.clone(), mesh: *index, node: *node, at: Some(Seconds(seconds)) };
                let origin = MeshOrigin { source, ..origin.clone() };
                put(world, entity, Shape::Mesh(mesh));
                put(world, entity, origin);
            }
        }
    }
}
