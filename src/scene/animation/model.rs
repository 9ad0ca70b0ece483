//! The animations of a glTF file on the entities of the scene that was made from it.

use crate::format::animation::ModelMotionPart;
use crate::format::camera::CameraPart;
use crate::format::light::LightKind;
use crate::format::placement::Placement;
use crate::format::sources::{MeshOptions, MeshSource, Seconds};
use crate::import::gltf_motion::GltfMotion;
use crate::scene::world::components::put;
use crate::scene::world::components::{MeshOrigin, Shape};
use crate::scene::world::inputs::SceneInputs;
use crate::scene::world::lights::{light_of, put_light};
use bevy_ecs::prelude::{Entity, World};
use std::collections::{BTreeMap, HashSet};
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

/// What a model moves, at a time.
#[derive(Default)]
pub(super) struct Moved {
    pub objects: BTreeMap<Entity, Placement>,
    pub lights: BTreeMap<Entity, (LightKind, Placement)>,
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
    /// The objects and lights that move.
    pub(super) fn moved(&self) -> impl Iterator<Item = Entity> {
        let animated = &self.motion.animated;
        let objects = self.objects.iter().zip(&animated.objects);
        let lights = self.lights.iter().zip(&animated.lights);
        objects.chain(lights).filter(|(_, moves)| **moves).map(|(entity, _)| *entity)
    }

    /// As in a scene file; `None` if nothing that moves is left.
    ///
    /// - `name`: of an object or light; `None` if it no longer exists.
    pub(super) fn to_part(&self, name: impl Fn(Entity) -> Option<String>) -> Option<ModelMotionPart> {
        let list = |entities: &[Entity], numbers: &[usize], moves: &[bool]| -> Vec<(String, usize)> {
            let all = entities.iter().zip(numbers).zip(moves).filter(|(_, moves)| **moves);
            all.filter_map(|((entity, number), _)| Some((name(*entity)?, *number))).collect()
        };
        let GltfMotion { file, objects, lights, camera, animated, .. } = &*self.motion;
        let part = ModelMotionPart {
            file: file.clone(),
            objects: list(&self.objects, objects, &animated.objects),
            lights: list(&self.lights, lights, &animated.lights),
            camera: camera.filter(|_| !self.holds_camera),
        };
        let is_left = !part.objects.is_empty() || !part.lights.is_empty() || part.camera.is_some();
        is_left.then_some(part)
    }

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
        let Some(moment) = self.motion.at(seconds) else { return part };
        let Some(camera) = moment.camera.clone() else { return part };
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

    /// Where the objects and lights are at a time.
    pub(super) fn at(&self, seconds: f64) -> Moved {
        let Some(moment) = self.motion.at(seconds) else { return Moved::default() };
        let object = |(i, placement): &(usize, Placement)| Some((*self.objects.get(*i)?, *placement));
        let light =
            |(i, kind, placement): &(usize, LightKind, Placement)| Some((*self.lights.get(*i)?, (*kind, *placement)));
        Moved {
            objects: moment.objects.iter().filter_map(object).collect(),
            lights: moment.lights.iter().filter_map(light).collect(),
        }
    }

    /// Moves nodes; meshes of skins and morph targets keep their shape.
    pub(super) fn set_inputs(&self, inputs: &mut SceneInputs, seconds: f64) {
        let Moved { objects, lights } = self.at(seconds);
        for object in &mut inputs.objects {
            if let Some(placement) = objects.get(&object.entity) {
                object.placement = *placement;
            }
        }
        for light in &mut inputs.lights {
            if let Some(&(kind, placement)) = lights.get(&light.entity) {
                (light.light, light.placement) = (kind, placement);
            }
        }
    }

    /// Moves nodes, and makes the meshes of skins and morph targets again.
    pub(super) fn set_world(&self, world: &mut World, seconds: f64) {
        let Moved { objects, lights } = self.at(seconds);
        for (entity, placement) in objects {
            // A deleted entity may be restored by undo.
            if world.get::<Shape>(entity).is_some() {
                put(world, entity, placement);
            }
        }
        for (entity, (light, placement)) in lights {
            if light_of(world, entity).is_some() {
                put_light(world, entity, light);
                put(world, entity, placement);
            }
        }
        for (i, mesh) in self.motion.meshes_at(seconds).iter() {
            let Some(&entity) = self.objects.get(*i) else { continue };
            // A mesh that was changed is not that of the file.
            let origin = world.get::<MeshOrigin>(entity).filter(|origin| origin.options == MeshOptions::default());
            let (Some(origin), Some(Shape::Mesh(_))) = (origin, world.get::<Shape>(entity)) else { continue };
            if let MeshSource::Gltf { file, mesh: index, node, at } = &origin.source
                && *at != Some(Seconds(seconds))
            {
                let source =
                    MeshSource::Gltf { file: file.clone(), mesh: *index, node: *node, at: Some(Seconds(seconds)) };
                let origin = MeshOrigin { source, ..origin.clone() };
                put(world, entity, Shape::Mesh(mesh.clone()));
                put(world, entity, origin);
            }
        }
    }
}
