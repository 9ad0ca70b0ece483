//! Edits of the scene: the list of edits, and their execution.
//!
//! Every edit is data, so that a window, a script and a recording can request it, and every edit changes ordinary
//! components, so that the smallest reset follows by change detection. Nothing here implements undo: [`crate::frame::state::history`]
//! detects what has changed and stores the previous state.
//!
//! | file | contents |
//! |---|---|
//! | `mod` | the list of edits, and the system that executes the queue |
//! | `property` | parameters of materials, lights and shapes |
//! | `named` | the same by the names of scene files |
//! | `sky` | colours, strength and rotation of the environment |
//! | `texture` | textures in place of colours |
//! | `projection` | texture coordinates for meshes without any |
//! | `dress` | ready materials |
//! | `place` | moving, rotating and scaling the selection |
//! | `aim` | spot lights aimed at a place of the image |
//! | `standing` | the selection upright, and on what is below it |
//! | `visibility` | hiding, and showing again |
//! | `keys` | keys and settings of the animation |
//! | `add`, `new_entity`, `spot`, `aside` | new objects, their names and positions, copies, removal |
//! | `add_model` | the objects and materials of a model |
//! | `remesh` | meshes made again, and models read, in the background |

mod add;
mod add_model;
mod aim;
mod aside;
mod dress;
mod keys;
mod named;
pub(crate) mod new_entity;
mod place;
mod projection;
mod property;
pub(crate) mod remesh;
mod set;
mod sky;
mod spot;
mod standing;
mod texture;
mod visibility;

pub use add::NewThing;
pub use named::{PropertyError, set_by_name};
pub use property::Property;
pub use sky::strength as sky_strength;
pub(super) use texture::take as take_picture;
pub use texture::textures;

use crate::frame::core::status::{MessageKind, Status};
use crate::frame::state::history::History;
use crate::frame::state::resources::{Clock, PictureSize, RenderState};
use crate::frame::state::seen_lights::light_at;
use crate::frame::state::selection::{ActivePart, Selection, pick};
use crate::render::MaterialKind;
use crate::scene::animation::{Interpolation, off_their_tracks};
use crate::scene::{MeshOptions, TextureSource, users_of};
use bevy_ecs::name::Name;
use bevy_ecs::prelude::{Entity, Resource, World};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// An entity as a number, see [`Entity::to_bits`].
pub type Id = u64;

/// One change of the scene, or of the selection.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Edit {
    /// Select what is at this position in the image, fractions as in [`crate::frame::Command`]. With `add`, adds to the
    /// selection, or removes from it.
    PickAt {
        /// Fraction of the width of the image, from the left.
        x: f64,
        /// Fraction of its height, from the top.
        y: f64,
        /// Keep the rest of the selection.
        add: bool,
    },
    /// Select an entity.
    Select {
        /// The entity.
        id: Id,
        /// Keep the rest of the selection; deselects the entity if it is the active one.
        add: bool,
    },
    /// Select all objects and lights.
    SelectAll,
    /// Select nothing.
    SelectNone,
    /// Select all objects that use this material, directly or in a blend.
    SelectUsers {
        /// The material.
        material: Id,
    },
    /// Start a step that ends with [`Edit::End`]: it is undone as one, and the amounts of [`Edit::Move`],
    /// [`Edit::Turn`] and [`Edit::Scale`] are relative to its start.
    Begin,
    /// End the step of [`Edit::Begin`].
    End,
    /// End it, and restore what was there.
    Cancel,
    /// Undo the last step.
    Undo,
    /// Redo the last undone step.
    Redo,
    /// Remove the selection.
    Delete,
    /// Leave the selection out of the image: it is not seen and gives no light.
    Hide {
        /// Everything but the selection instead.
        others: bool,
    },
    /// Show all that is hidden, and select it.
    ShowAll,
    /// Hide an object or a light, or show it.
    SetHidden {
        /// The object or light.
        id: Id,
        /// Whether it is left out of the image.
        hidden: bool,
    },
    /// Copy the selection to its right, and select the copies.
    Duplicate,
    /// Copy it where it is, for copies that are moved next.
    DuplicateInPlace,
    /// Aim a spot light at what is seen at a position in the image, 0..1 from its upper left corner.
    AimAt {
        /// The light.
        id: Id,
        /// Fraction of the width.
        x: f64,
        /// Fraction of the height.
        y: f64,
    },
    /// Add an object or a light in the middle of the image, and select it.
    Add(NewThing),
    /// The same at a position in the image, 0..1 from the upper left corner; a light goes beside what is selected.
    AddAt {
        /// What is added.
        thing: NewThing,
        /// Fraction of the width.
        x: f64,
        /// Fraction of the height.
        y: f64,
    },
    /// Move the selection, metres in world space.
    Move {
        /// Translation in world space.
        by: DVec3,
    },
    /// Put the selection, as one, on what is below its middle.
    StandOnGround,
    /// Turn the selected objects by a quarter about X, from Z upwards to Y upwards, and put them on what is below.
    TurnUpright,
    /// Rotate the selection about the centre of the active entity; `axis` in world space.
    Turn {
        /// Any length except 0.
        axis: DVec3,
        /// Counter-clockwise about the axis, degrees.
        angle_deg: f64,
    },
    /// Scale the selection about the centre of the active entity, its lowest point kept at its height: along its own axes
    /// if it is single, uniformly for several entities or a sphere.
    Scale {
        /// Factor per axis, above 0; 1 keeps the size.
        factors: DVec3,
    },
    /// Set one number or one colour of an entity.
    Set {
        /// The entity; ignored for properties of the environment and of the animation.
        id: Id,
        /// The property.
        property: Property,
        /// The value, in the unit of the property.
        value: DVec3,
    },
    /// Change the kind of a material, keeping what both kinds have in common.
    SetKind {
        /// The material.
        id: Id,
        /// The new kind.
        kind: MaterialKind,
    },
    /// Replace a material's colour by an existing texture.
    SetTexture {
        /// The material.
        id: Id,
        /// Name of the texture.
        name: String,
    },
    /// Replace a material's colour by a texture of this description; an image is loaded in the background.
    Paint {
        /// The material.
        id: Id,
        /// The texture.
        part: TextureSource,
    },
    /// Light the scene by an image, which is loaded in the background.
    LightFrom {
        /// Its path, as in scene files.
        file: String,
    },
    /// Choose a part of an object, which materials are given to then.
    ChoosePart {
        /// The object.
        id: Id,
        /// Index of its material; `None` for all parts.
        part: Option<u32>,
    },
    /// Assign an existing material to an object, or to the part of it that was clicked.
    Assign {
        /// The object.
        id: Id,
        /// The material.
        material: Id,
    },
    /// Give the selected objects a material of the [`library`](crate::scene::library), the same to all that ask for it.
    Dress {
        /// Name of the material in the library.
        name: String,
    },
    /// Give an object its own copy of its material.
    OwnMaterial {
        /// The object.
        id: Id,
    },
    /// Rename an entity.
    Rename {
        /// The entity.
        id: Id,
        /// The name.
        name: String,
    },
    /// Set keys of the animation at the current time.
    SetKeys {
        /// Of the camera only; otherwise of what has been changed since the time was set, else of the selection, or else
        /// of the camera.
        camera: bool,
    },
    /// Delete the keys at the current time: of the selection, or of everything if nothing is selected.
    DeleteKeys,
    /// Set the interpolation of the tracks of the selection, or of all tracks if nothing is selected.
    Interpolate {
        /// Between two keys.
        how: Interpolation,
    },
    /// Make an object's mesh again from its source, in the background.
    Remesh {
        /// The object.
        id: Id,
        /// What is done with it.
        options: MeshOptions,
    },
}

/// Edits for the next frame, in order.
#[derive(Resource, Default)]
pub struct EditQueue(pub Vec<Edit>);

/// Executes the queued edits.
///
/// Reads [`EditQueue`]; writes entities, [`Selection`], [`History`], [`Status`].
pub fn edit_scene(world: &mut World) {
    let edits = std::mem::take(&mut world.resource_mut::<EditQueue>().0);
    let known = (!edits.is_empty()).then(|| off_their_tracks(world));
    for edit in edits {
        // With nothing to do it on, an edit does no harm.
        let kind = match edit {
            Edit::Undo
            | Edit::Redo
            | Edit::SelectUsers { .. }
            | Edit::Dress { .. }
            | Edit::Hide { .. }
            | Edit::ShowAll => MessageKind::Note,
            _ => MessageKind::Warning,
        };
        if let Err(problem) = carry_out(world, edit) {
            let now = world.resource::<Clock>().0;
            world.resource_mut::<Status>().say(now, kind, problem);
        }
    }
    if let Some(known) = known {
        keys::tell_what_needs_keys(world, &known);
    }
    // Removed entities are deselected.
    let gone: Vec<Entity> =
        world.resource::<Selection>().0.iter().copied().filter(|&entity| !add::is_thing(world, entity)).collect();
    if !gone.is_empty() {
        world.resource_mut::<Selection>().0.retain(|entity| !gone.contains(entity));
    }
}

fn carry_out(world: &mut World, edit: Edit) -> Result<(), String> {
    match edit {
        Edit::PickAt { x, y, add } => {
            let aspect = world.resource::<PictureSize>().aspect();
            let shown = world.resource::<RenderState>();
            if let Some(light) = light_at(shown, [x, y], aspect) {
                world.resource_mut::<Selection>().choose(light, add);
                world.resource_mut::<ActivePart>().0 = None;
                return Ok(());
            }
            let picked = shown.extraction.as_ref().and_then(|scene| pick(scene, x, y, aspect));
            world.resource_mut::<ActivePart>().0 = picked.map(|picked| (picked.entity, picked.part));
            let mut selection = world.resource_mut::<Selection>();
            match picked {
                Some(picked) => selection.choose(picked.entity, add),
                None if !add => selection.0.clear(),
                None => {}
            }
        }
        Edit::Select { id, add } => {
            let entity = thing(world, id)?;
            world.resource_mut::<Selection>().choose(entity, add);
            world.resource_mut::<ActivePart>().0 = None;
        }
        Edit::ChoosePart { id, part } => {
            let entity = thing(world, id)?;
            world.resource_mut::<ActivePart>().0 = part.map(|part| (entity, part as usize));
        }
        Edit::SelectAll => {
            let all = world.resource::<RenderState>().inputs.entities().collect();
            world.resource_mut::<Selection>().0 = all;
        }
        Edit::SelectUsers { material } => {
            let material = existing(world, material)?;
            let users = users_of(world, &world.resource::<RenderState>().inputs, material);
            if users.is_empty() {
                return Err("no object uses this material".to_owned());
            }
            world.resource_mut::<Selection>().0 = users;
        }
        Edit::SelectNone => world.resource_mut::<Selection>().0.clear(),
        Edit::Begin => History::begin(world),
        Edit::End => History::end(world),
        Edit::Cancel => History::cancel(world),
        Edit::Undo => {
            if crate::frame::edit::remesh::take_back(world).is_none() {
                History::step_back(world).ok_or("nothing to undo")?;
                let label = world.resource::<History>().redo_label().map(|label| format!("undone: {label}"));
                label.into_iter().for_each(|text| keys::say(world, text));
            }
        }
        Edit::Redo => {
            History::step_on(world).ok_or("nothing to redo")?;
            let label = world.resource::<History>().undo_label().map(|label| format!("done again: {label}"));
            label.into_iter().for_each(|text| keys::say(world, text));
        }
        Edit::Delete => add::delete(world),
        Edit::Hide { others } => visibility::hide(world, others)?,
        Edit::ShowAll => visibility::show_all(world)?,
        Edit::SetHidden { id, hidden } => {
            let entity = thing(world, id)?;
            visibility::set_hidden(world, entity, hidden);
        }
        Edit::AimAt { id, x, y } => aim::aim(world, existing(world, id)?, [x, y])?,
        Edit::StandOnGround => standing::stand_on_ground(world),
        Edit::TurnUpright => standing::turn_upright(world),
        Edit::Duplicate => {
            let aside = aside::step_aside(world);
            add::duplicate(world, aside);
        }
        Edit::DuplicateInPlace => add::duplicate(world, DVec3::ZERO),
        Edit::Add(new) => add::add(world, &new, spot::MIDDLE),
        Edit::AddAt { thing, x, y } => add::add(world, &thing, [x, y]),
        Edit::Move { by } => place::displace(world, |_| place::Change::Move(by)),
        Edit::Turn { axis, angle_deg } => {
            let axis =
                axis.try_normalize().filter(|_| angle_deg.is_finite()).ok_or("invalid rotation axis or angle")?;
            place::displace(world, |center| place::Change::Turn { center, axis, angle_deg });
        }
        Edit::Scale { factors } => {
            // Flat or mirrored results are never intended.
            if !(factors.is_finite() && factors.min_element() > 0.0) {
                return Err("scale factors must be above 0".to_owned());
            }
            place::displace(world, |center| place::Change::Scale { center, factors });
        }
        Edit::Set { id, property, value } => set::set(world, Entity::try_from_bits(id), property, value)?,
        Edit::SetKind { id, kind } => set::set_kind(world, existing(world, id)?, kind)?,
        Edit::SetTexture { id, name } => texture::set_texture(world, existing(world, id)?, &name)?,
        Edit::Paint { id, part } => texture::paint(world, existing(world, id)?, part)?,
        Edit::LightFrom { file } => texture::light_from(world, file),
        Edit::Assign { id, material } => {
            let (object, material) = (thing(world, id)?, existing(world, material)?);
            dress::give(world, object, material);
        }
        Edit::Dress { name } => dress::dress(world, &name)?,
        Edit::OwnMaterial { id } => {
            let object = thing(world, id)?;
            add::own_material(world, object)?;
        }
        Edit::Rename { id, name } => {
            let entity = existing(world, id)?;
            let name = name.trim();
            match name.is_empty() {
                true => drop(world.entity_mut(entity).remove::<Name>()),
                false => drop(world.entity_mut(entity).insert(Name::new(name.to_owned()))),
            }
        }
        Edit::SetKeys { camera } => keys::set(world, camera)?,
        Edit::DeleteKeys => keys::delete(world)?,
        Edit::Interpolate { how } => keys::interpolate(world, how)?,
        Edit::Remesh { id, options } => crate::frame::edit::remesh::start(world, thing(world, id)?, options)?,
    }
    Ok(())
}

fn existing(world: &World, id: Id) -> Result<Entity, String> {
    let entity = Entity::try_from_bits(id).filter(|&entity| world.get_entity(entity).is_ok());
    entity.ok_or_else(|| "the object no longer exists".to_owned())
}

/// Returns an entity if it is an object or a light of the scene.
fn thing(world: &World, id: Id) -> Result<Entity, String> {
    let entity = existing(world, id)?;
    if add::is_thing(world, entity) { Ok(entity) } else { Err("the object no longer exists".to_owned()) }
}
