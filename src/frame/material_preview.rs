//! An image of a sphere of one material of a scene, in front of the backdrop of the ready materials: what a list of
//! materials shows. Made on any thread; knows no window.

use crate::frame::core::offline::{Target, render_region_until};
use crate::render::{Display, Film, RenderSettings, develop};
use crate::scene::{
    Extraction, LoadOptions, Material, MaterialSlots, SceneInputs, Shape, SurfaceMaterial, Trees, library_stage,
    load_text,
};
use bevy_ecs::prelude::{Entity, World};
use std::path::Path;

/// Samples per pixel: little noise is left in some dozen pixels.
const SPP: u32 = 32;
/// Blends nested deeper than this are not followed.
const MAX_NESTING: usize = 8;

/// A material with those that it is a blend of, itself first. Equal if its image is.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialPreview(Vec<(Entity, Material)>);

impl MaterialPreview {
    /// `None` if the entity has no material.
    pub fn of(world: &World, entity: Entity) -> Option<Self> {
        let mut parts: Vec<(Entity, Material)> = Vec::new();
        let mut open = vec![(entity, 0)];
        while let Some((entity, nesting)) = open.pop() {
            if parts.iter().any(|(known, _)| *known == entity) {
                continue;
            }
            let material = SurfaceMaterial::of(world, entity)?.clone();
            if let Material::Blend { a, b, .. } = &material {
                (nesting < MAX_NESTING).then_some(())?;
                open.extend([(*a, nesting + 1), (*b, nesting + 1)]);
            }
            parts.push((entity, material));
        }
        Some(Self(parts))
    }

    /// Renders the sphere: `side` × `side` pixels of sRGB, three bytes each, row by row from the top. `None` if `stop`,
    /// which is called often, returned true.
    pub fn render(&self, side: u32, stop: &(dyn Fn() -> bool + Sync)) -> Option<Vec<u8>> {
        let stage = library_stage().to_ron();
        let stage = load_text(&stage, Path::new("preview"), &LoadOptions::default()).expect("a test renders it");
        let mut world = World::new();
        stage.spawn(&mut world);
        let copies: Vec<(Entity, Entity)> = self.0.iter().map(|(of, _)| (*of, world.spawn_empty().id())).collect();
        let copy_of = |of: Entity| copies.iter().find(|(known, _)| *known == of).map_or(of, |(_, copy)| *copy);
        for (of, material) in &self.0 {
            let mut material = material.clone();
            if let Material::Blend { a, b, .. } = &mut material {
                (*a, *b) = (copy_of(*a), copy_of(*b));
            }
            world.entity_mut(copy_of(*of)).insert(SurfaceMaterial(material));
        }
        for (shape, mut slots) in world.query::<(&Shape, &mut MaterialSlots)>().iter_mut(&mut world) {
            if matches!(shape, Shape::Sphere { .. }) {
                slots.0 = vec![copies[0].1];
            }
        }
        let extraction = Extraction::new(&SceneInputs::of(&mut world), &Trees::default());
        let mut film = Film::new(side, side);
        let target = Target { spp: Some(SPP), ..Target::default() };
        let settings = RenderSettings::default();
        render_region_until(&extraction.prepared, &settings, &mut film, None, target, stop, |_| true);
        if stop() {
            return None;
        }
        let mut rgba = Vec::new();
        develop(&film, &Display::default(), side, side, &mut rgba);
        Some(rgba.chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy_ecs::name::Name;

    /// Mean colour of the middle of the sphere.
    fn middle(world: &World, entity: Entity) -> [u32; 3] {
        let image = MaterialPreview::of(world, entity).unwrap().render(24, &|| false).unwrap();
        let of = |channel: usize| {
            (0..9).map(|i| u32::from(image[3 * (24 * (9 + i / 3 * 2) + 9 + i % 3 * 2) + channel])).sum()
        };
        [of(0), of(1), of(2)]
    }

    #[test]
    fn a_sphere_shows_its_material_and_a_blend_both_of_its_parts() {
        let text = "(camera: (eye: (0, 0, 5), look_at: (0, 0, 0)), materials: {
            \"red\": diffuse(albedo: (0.7, 0.02, 0.02)), \"blue\": diffuse(albedo: (0.02, 0.02, 0.7)),
            \"both\": blend(a: \"red\", b: \"blue\", weight: 0.5) }, objects: [])";
        let mut world = World::new();
        load_text(text, Path::new("test"), &LoadOptions::default()).unwrap().spawn(&mut world);
        let named = |world: &mut World, name: &str| {
            let mut all = world.query::<(Entity, &Name)>();
            all.iter(world).find(|(_, known)| known.as_str() == name).unwrap().0
        };
        let [red, blue, both] = ["red", "blue", "both"].map(|name| named(&mut world, name));
        let [r, _, b] = middle(&world, red);
        assert!(r > 2 * b, "{r} {b}");
        let [r, _, b] = middle(&world, blue);
        assert!(b > 2 * r, "{r} {b}");
        let [r, g, b] = middle(&world, both);
        assert!(r.abs_diff(b) < r / 3 && g < r / 2, "{r} {g} {b}");
        assert_ne!(MaterialPreview::of(&world, red), MaterialPreview::of(&world, blue));
        assert!(MaterialPreview::of(&world, blue).unwrap().render(24, &|| true).is_none());
    }
}
