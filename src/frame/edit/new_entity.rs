//! New entities: unique names, the last place in the order of the scene file.

use crate::scene::{Material, Ordinal, Placement, SurfaceMaterial};
use bevy_ecs::name::Name;
use bevy_ecs::prelude::{Entity, Has, World};
use glam::DVec3;

/// Scales a placement uniformly.
pub fn sized(placement: Placement, factor: f64) -> Placement {
    let linear = crate::scene::Linear::Turned { rotation_deg: DVec3::ZERO, scale: DVec3::splat(factor) };
    Placement { linear, ..placement }
}

/// The name of the first of some entities, and how many more there are; `None` without any.
pub fn first_and_more(world: &World, entities: &[Entity]) -> Option<String> {
    let name = world.get::<Name>(*entities.first()?).map_or("an object", |name| name.as_str());
    Some(match entities.len() {
        1 => name.to_owned(),
        n => format!("{name} and {} more", n - 1),
    })
}

/// Spawns an entity with a unique name, last in the order of the scene file.
pub fn spawn(world: &mut World, name: &str, bundle: impl bevy_ecs::bundle::Bundle) -> Entity {
    let (name, ordinal) = (free_name(world, name, false), next_ordinal(world));
    world.spawn((bundle, Name::new(name), ordinal)).id()
}

pub fn new_material(world: &mut World, name: &str, material: Material) -> Entity {
    let (name, ordinal) = (free_name(world, name, true), next_ordinal(world));
    world.spawn((SurfaceMaterial(material), Name::new(name), ordinal)).id()
}

/// Returns `name`, or the first of `name 2`, `name 3`, … that is free among the materials or among everything else.
pub fn free_name(world: &mut World, name: &str, of_materials: bool) -> String {
    let mut named = world.query::<(&Name, Has<SurfaceMaterial>)>();
    // Numbers in place of names: a recording may make thousands of one name.
    let number_of = |taken: &str| match taken.strip_prefix(name)? {
        "" => Some(1),
        rest => rest.strip_prefix(' ').filter(|digits| digits.starts_with(|c| matches!(c, '1'..='9')))?.parse().ok(),
    };
    let mut taken: Vec<u64> = (named.iter(world))
        .filter(|(_, is_material)| *is_material == of_materials)
        // `name 1` is another name.
        .filter_map(|(taken, _)| number_of(taken).filter(|&number| number > 1 || taken.as_str() == name))
        .collect();
    taken.sort_unstable();
    match taken.into_iter().fold(1, |free, number| if number == free { free + 1 } else { free }) {
        1 => name.to_owned(),
        free => format!("{name} {free}"),
    }
}

pub fn next_ordinal(world: &mut World) -> Ordinal {
    let last = world.query::<&Ordinal>().iter(world).map(|ordinal| ordinal.0).max();
    Ordinal(last.map_or(0, |last| last.saturating_add(1)))
}

/// Removes the number that [`free_name`] has appended.
pub fn plain_name(name: &str) -> &str {
    match name.rsplit_once(' ') {
        Some((plain, number)) if !plain.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit()) => plain,
        _ => name,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_numbered_and_copies_do_not_pile_up_numbers() {
        let mut world = World::new();
        for expected in ["ball", "ball 2", "ball 3"] {
            let entity = spawn(&mut world, "ball", Placement::default());
            assert_eq!(world.get::<Name>(entity).unwrap().as_str(), expected);
        }
        // Names that look like numbers, and are not those that would be given.
        for other in ["ball 1", "ball 04", "ball +4", "ball 4 ", "ball 99999999999999999999", "ball 6"] {
            world.spawn(Name::new(other));
        }
        for expected in ["ball 4", "ball 5", "ball 7"] {
            let entity = spawn(&mut world, "ball", Placement::default());
            assert_eq!(world.get::<Name>(entity).unwrap().as_str(), expected);
        }
        assert_eq!([plain_name("ball 17"), plain_name("tall ball"), plain_name("7")], ["ball", "tall ball", "7"]);
    }
}
