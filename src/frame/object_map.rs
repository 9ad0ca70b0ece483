//! Which object each pixel shows, and the outline of some of them.
//!
//! Traced through the pixel centres and the centre of the lens, as [`pick`](crate::frame::pick) does. Knows no window:
//! a map is made on any thread, and gives lists of pixels.

use crate::kdtree::{Hit, HitBatch, RayBatch, RayClass};
use crate::render::Prepared;
use crate::scene::Extraction;
use bevy_ecs::prelude::Entity;
use glam::{UVec2, Vec2};
use std::collections::HashSet;

/// No object.
const NONE: u32 = u32::MAX;

/// Distance of what counts as in front, relative to that of what it hides: surfaces that meet are at about the same.
const NEARER: f32 = 0.995;

/// What a map is made of; shares the snapshot.
pub struct ObjectMapSource {
    scene: Prepared,
    entities: Vec<Entity>,
}

/// The object of each pixel.
#[derive(Clone, Debug)]
pub struct ObjectMap {
    size: UVec2,
    /// Row by row from the top: indices of `entities`, those of their materials, and distances in metres.
    objects: Vec<u32>,
    parts: Vec<u16>,
    distances: Vec<f32>,
    entities: Vec<Entity>,
}

/// Pixels with their opacities, in a rectangle of a map.
#[derive(Clone, Debug, PartialEq)]
pub struct Outline {
    /// Left and upper edge, pixels.
    pub start: UVec2,
    /// Width and height, pixels.
    pub size: UVec2,
    /// Row by row from the top: opacity of the line and of its dark rim, each 0..1.
    pub pixels: Vec<[f32; 2]>,
}

impl ObjectMapSource {
    pub(crate) fn of(extraction: &Extraction) -> Self {
        Self { scene: extraction.prepared.clone(), entities: extraction.entities.clone() }
    }

    /// Traces the map, on this thread; `None` if `stop`, which is called once a row, returned true.
    pub fn trace(self, size: UVec2, stop: &dyn Fn() -> bool) -> Option<ObjectMap> {
        let Self { scene, entities } = self;
        let (mut rays, mut hits) = (RayBatch::default(), HitBatch::default());
        let n = size.x as usize * size.y as usize;
        let (mut objects, mut parts) = (Vec::with_capacity(n), Vec::with_capacity(n));
        let mut distances = Vec::with_capacity(n);
        let part = |hit: Hit| scene.geometry.objects[hit.object as usize].slot_of(hit.prim) as u16;
        for y in 0..size.y {
            if stop() {
                return None;
            }
            rays.clear();
            for x in 0..size.x {
                let place = UVec2::new(x, y).as_vec2() + 0.5;
                rays.push(&scene.camera.middle_ray(place, size.as_vec2()));
            }
            scene.geometry.tree.closest_hits(&rays, RayClass::Coherent, &mut hits);
            for hit in (0..rays.len()).map(|i| hits.get(i)) {
                objects.push(hit.map_or(NONE, |hit| hit.object));
                parts.push(hit.map_or(0, part));
                distances.push(hit.map_or(f32::INFINITY, |hit| hit.t));
            }
        }
        Some(ObjectMap { size, objects, parts, distances, entities })
    }
}

impl ObjectMap {
    /// Pixels.
    pub fn size(&self) -> UVec2 {
        self.size
    }

    /// The object or light at a position in the image, fractions from the upper left corner.
    pub fn at(&self, x: f64, y: f64) -> Option<Entity> {
        let place = (Vec2::new(x as f32, y as f32) * self.size.as_vec2()).as_uvec2().min(self.size.max(UVec2::ONE) - 1);
        let object = *self.objects.get((place.y * self.size.x + place.x) as usize)?;
        self.entities.get(object as usize).copied()
    }

    /// The line around all pixels that show one of these; `None` if no pixel does. Where something stands in front, there
    /// is none: around all that stands on a floor, it would say that all of that is meant.
    ///
    /// - `part`: an object of which only that part is meant, by the index of its material.
    /// - `radius`: half of its width, pixels; its rim is a pixel wide on either side.
    pub fn outline(&self, of: &HashSet<Entity>, part: Option<(Entity, usize)>, radius: f32) -> Option<Outline> {
        let (width, height) = (self.size.x as usize, self.size.y as usize);
        let entity_of = |i: usize| self.entities.get(self.objects[i] as usize).copied();
        let patch = part.map(|(entity, part)| {
            let is_in = |i: usize| entity_of(i) == Some(entity) && usize::from(self.parts[i]) == part;
            closed((0..width * height).map(is_in).collect(), width)
        });
        // What is meant there.
        let region = |x: usize, y: usize| match (&patch, part) {
            (Some(patch), Some((entity, _))) if patch[y * width + x] => Some(entity),
            (_, part) => entity_of(y * width + x)
                .filter(|entity| of.contains(entity) && part.is_none_or(|(parted, _)| parted != *entity)),
        };
        let mut border = Vec::new();
        let (mut min, mut max) = (UVec2::MAX, UVec2::ZERO);
        for y in 0..height {
            for x in 0..width {
                let own = region(x, y);
                if own.is_none() {
                    continue;
                }
                let place = UVec2::new(x as u32, y as u32);
                (min, max) = (min.min(place), max.max(place));
                // At the edge of the image there is no line: the object goes on.
                let nearest = NEARER * self.distances[y * width + x];
                let ends = |x: usize, y: usize| region(x, y) != own && self.distances[y * width + x] >= nearest;
                let differs = (x > 0 && ends(x - 1, y))
                    || (x + 1 < width && ends(x + 1, y))
                    || (y > 0 && ends(x, y - 1))
                    || (y + 1 < height && ends(x, y + 1));
                if differs {
                    border.push(place);
                }
            }
        }
        if min.x == u32::MAX {
            return None;
        }
        let reach = radius.ceil() as u32 + 2;
        let start = min.saturating_sub(UVec2::splat(reach));
        let size = (max + reach + 1).min(self.size) - start;
        let mut pixels = vec![[0.0_f32; 2]; size.x as usize * size.y as usize];
        for place in border {
            let low = place.saturating_sub(UVec2::splat(reach)).max(start);
            let high = (place + reach + 1).min(start + size);
            for y in low.y..high.y {
                for x in low.x..high.x {
                    let away = UVec2::new(x, y).as_vec2().distance(place.as_vec2());
                    let pixel = &mut pixels[((y - start.y) * size.x + x - start.x) as usize];
                    for (i, radius) in [radius, radius + 1.0].into_iter().enumerate() {
                        pixel[i] = pixel[i].max((radius + 0.5 - away).clamp(0.0, 1.0));
                    }
                }
            }
        }
        Some(Outline { start, size, pixels })
    }
}

/// Fills gaps: where two surfaces are in one place, pixels show the one or the other by chance.
fn closed(mut pixels: Vec<bool>, width: usize) -> Vec<bool> {
    /// Half of the width of what is filled, pixels.
    const REACH: usize = 3;
    // Grown along both axes, then shrunk by as much; beyond the edge of the image, everything goes on as it is there.
    for value in [true, false] {
        for stride in [1, width] {
            let before = pixels.clone();
            for (i, pixel) in pixels.iter_mut().enumerate() {
                let (at, n) = if stride == 1 { (i % width, width) } else { (i / width, before.len() / width) };
                let line = i - at * stride;
                let near = at.saturating_sub(REACH)..(at + REACH + 1).min(n);
                if before[i] != value && near.into_iter().any(|at| before[line + at * stride] == value) {
                    *pixel = value;
                }
            }
        }
    }
    pixels
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy_ecs::world::World;

    fn map(rows: &[&str]) -> (ObjectMap, [Entity; 2]) {
        let mut world = World::new();
        let entities = [world.spawn_empty().id(), world.spawn_empty().id()];
        let objects = rows.iter().flat_map(|row| row.chars()).map(|c| c.to_digit(10).unwrap_or(NONE)).collect();
        let size = UVec2::new(rows[0].len() as u32, rows.len() as u32);
        let (distances, parts) = (vec![1.0; (size.x * size.y) as usize], vec![0; (size.x * size.y) as usize]);
        (ObjectMap { size, objects, parts, distances, entities: entities.to_vec() }, entities)
    }

    #[test]
    fn a_place_has_the_object_of_its_pixel() {
        let (map, [a, b]) = map(&["..0", ".11"]);
        assert_eq!(
            [map.at(0.1, 0.1), map.at(0.99, 0.2), map.at(0.5, 0.9), map.at(1.0, 1.0)],
            [None, Some(a), Some(b), Some(b)]
        );
    }

    #[test]
    fn the_line_follows_the_border_and_not_the_edge_of_the_image() {
        let rows = [".........", ".........", "000000...", "000000...", "000000...", "000000...", "000000..."];
        let (map, [a, b]) = map(&rows);
        let outline = map.outline(&HashSet::from([a]), None, 0.5).unwrap();
        let line =
            |x: u32, y: u32| outline.pixels[((y - outline.start.y) * outline.size.x + x - outline.start.x) as usize];
        assert_eq!(line(2, 2), [1.0, 1.0], "its upper row");
        assert_eq!(line(5, 5), [1.0, 1.0], "its right column");
        assert_eq!(line(2, 1)[0], 0.0);
        assert!(line(2, 1)[1] > 0.4, "the rim is beside the line");
        assert_eq!([line(0, 5), line(2, 5)], [[0.0; 2]; 2], "not inside, nor at the edge of the image");
        assert_eq!(map.outline(&HashSet::from([b]), None, 0.5), None);
    }

    #[test]
    fn there_is_no_line_around_what_stands_in_front() {
        let rows = [".........", "000000000", "000111000", "000111000", "000000000"];
        let (mut map, [floor, ball]) = map(&rows);
        for (distance, object) in map.distances.iter_mut().zip(&map.objects) {
            *distance = if *object == 1 { 0.9 } else { 1.0 };
        }
        let lines = |of: Entity| {
            let outline = map.outline(&HashSet::from([of]), None, 0.5).unwrap();
            outline.pixels.iter().filter(|[line, _]| *line == 1.0).count()
        };
        assert_eq!([lines(floor), lines(ball)], [9, 6], "the horizon alone, and all of what is in front");
    }

    #[test]
    fn each_of_several_objects_has_its_line() {
        let (map, [a, b]) = map(&["000111", "000111"]);
        let outline = map.outline(&HashSet::from([a, b]), None, 0.5).unwrap();
        let row: Vec<bool> = outline.pixels[..6].iter().map(|[line, _]| *line == 1.0).collect();
        assert_eq!(row, [false, false, true, true, false, false]);
    }

    #[test]
    fn a_part_has_a_line_of_its_own() {
        let (mut map, [a, _]) = map(&["00000000000000000000"; 2]);
        map.parts = (0..40).map(|i| u16::from(i % 20 >= 10)).collect();
        let line = |part| {
            let outline = map.outline(&HashSet::from([a]), part, 0.5)?;
            let at = |x: usize| outline.start.x + x as u32;
            Some((0..outline.size.x as usize).filter(|x| outline.pixels[*x][0] == 1.0).map(at).collect::<Vec<_>>())
        };
        assert_eq!([line(Some((a, 0))), line(Some((a, 1))), line(None)], [Some(vec![9]), Some(vec![10]), Some(vec![])]);
        assert_eq!(line(Some((a, 2))), None, "it is not seen");
    }

    #[test]
    fn a_part_in_the_place_of_another_is_whole() {
        let rows = ["00000000000000000000"; 20];
        let (mut map, [a, _]) = map(&rows);
        // Every other pixel of a square, as two walls in one place show.
        for (i, part) in map.parts.iter_mut().enumerate() {
            let (x, y) = (i % 20, i / 20);
            *part = u16::from((5..15).contains(&x) && (5..15).contains(&y) && (x + y) % 2 == 0);
        }
        let outline = map.outline(&HashSet::from([a]), Some((a, 1)), 0.5).unwrap();
        let width = outline.size.x;
        let lines = (0..).zip(&outline.pixels).filter(|(_, [line, _])| *line == 1.0);
        let places: Vec<UVec2> = lines.map(|(i, _)| outline.start + UVec2::new(i % width, i / width)).collect();
        assert!((32..=36).contains(&places.len()), "{places:?}");
        // Corners may be cut.
        let is_at_border = |place: &UVec2| place.x.min(place.y) <= 6 || place.x.max(place.y) >= 13;
        assert!(places.iter().all(is_at_border), "{places:?}");
    }

    #[test]
    fn a_map_shows_what_a_pick_finds() {
        use crate::scene::{LoadOptions, SceneInputs, SceneSource, load};
        let loaded = load(&SceneSource::Builtin("ball".to_owned()), &LoadOptions::default()).unwrap();
        let mut world = World::new();
        loaded.spawn(&mut world);
        let extraction = Extraction::new(&SceneInputs::of(&mut world), &loaded.trees);
        let size = UVec2::new(16, 12);
        let map = ObjectMapSource::of(&extraction).trace(size, &|| false).unwrap();
        let mut seen = HashSet::new();
        for y in 0..size.y {
            for x in 0..size.x {
                let place = (UVec2::new(x, y).as_dvec2() + 0.5) / size.as_dvec2();
                let picked = crate::frame::pick(&extraction, place.x, place.y, 16.0 / 12.0).map(|it| it.entity);
                assert_eq!(map.at(place.x, place.y), picked, "{x} {y}");
                seen.extend(picked);
            }
        }
        assert!(!seen.is_empty());
        assert!(ObjectMapSource::of(&extraction).trace(size, &|| true).is_none());
    }
}
