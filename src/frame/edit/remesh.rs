//! Makes meshes in the background, simplified or with other normals, and loads models.
//!
//! The new mesh is made from its source by the same code that opens a scene, so that a saved scene opens with the same
//! triangles.

use crate::frame::core::status::{MessageKind, Status};
use crate::frame::edit::add_model::add_model;
use crate::frame::state::background::BackgroundTasks;
use crate::frame::state::history::History;
use crate::frame::state::remake::{ForWhom, Made, Remade, Remake};
use crate::frame::state::resources::{Clock, CurrentScene, Renderer};
use crate::scene::{MeshOptions, MeshOrigin, MeshSource, Shape};
use bevy_ecs::prelude::{Entity, World};
use glam::DVec3;

/// Starts to make an object's mesh again. An unfinished request for the same object is dropped.
pub fn start(world: &mut World, entity: Entity, options: MeshOptions) -> Result<(), String> {
    if let Some(ratio) = options.simplify.filter(|ratio| !(*ratio > 0.0 && *ratio <= 1.0)) {
        return Err(format!("the ratio of faces to keep is {ratio}, but must be above 0 and at most 1"));
    }
    let origin = world.get::<MeshOrigin>(entity).ok_or("the source of this mesh is unknown")?;
    let source = origin.source.clone();
    // A control that repeats the present or the pending value has no effect.
    if wanted_mesh(world, entity) != Some(options) {
        run(world, ForWhom::Object(entity), source, options);
    }
    Ok(())
}

/// Starts to load a model that will become new objects.
pub fn start_new(world: &mut World, source: MeshSource, place: DVec3, size: f64) {
    run(world, ForWhom::NewObject { place, size }, source, MeshOptions::default());
}

fn run(world: &mut World, for_whom: ForWhom, source: MeshSource, options: MeshOptions) {
    let folder = world.get_resource::<CurrentScene>().map(|scene| scene.0.folder.clone()).unwrap_or_default();
    let revision = History::revision(world);
    let job = Remake { for_whom, source, options, revision, folder };
    let pool = world.resource::<Renderer>().0.pool();
    world.resource::<BackgroundTasks>().remake(job, pool);
}

/// What is done with an object's mesh, as present or pending; `None` if its source is unknown.
pub fn wanted_mesh(world: &World, entity: Entity) -> Option<MeshOptions> {
    let origin = world.get::<MeshOrigin>(entity)?;
    let pending = world.resource::<BackgroundTasks>().wanted(entity);
    Some(pending.map_or(origin.options, |job| job.options))
}

/// Drops a pending mesh, if nothing was changed after its request: undo affects the newest change first.
pub fn take_back(world: &mut World) -> Option<()> {
    let revision = History::revision(world);
    let job = world.resource::<BackgroundTasks>().forget_mesh(revision)?;
    let now = world.resource::<Clock>().0;
    world.resource_mut::<Status>().say(now, MessageKind::Note, format!("{}: stopped", job.title()));
    Some(())
}

/// Puts a finished mesh or model into the world.
pub fn take(world: &mut World, remade: Remade) {
    let Remade { job, result } = remade;
    match (result, job.for_whom) {
        (Err(error), _) => {
            let now = world.resource::<Clock>().0;
            for problem in &error.problems {
                world.resource_mut::<Status>().say(now, MessageKind::Error, problem.to_string());
            }
        }
        (Ok(Made::Mesh(mesh, measure)), ForWhom::Object(entity)) => {
            let Some(origin) = world.get::<MeshOrigin>(entity).cloned() else { return };
            let origin = MeshOrigin { options: job.options, ..origin };
            world.entity_mut(entity).insert((Shape::Mesh(mesh), origin, measure));
        }
        (Ok(Made::Model(model)), ForWhom::NewObject { place, size }) => add_model(world, &model, place, size),
        (Ok(_), _) => unreachable!("objects get meshes, new objects come from models"),
    }
}
