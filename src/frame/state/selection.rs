//! Selection and picking.

use crate::frame::core::rig::Rig;
use crate::frame::state::resources::RenderState;
use crate::geometry::Ray;
use crate::render::Camera;
use crate::scene::light_of;
use crate::scene::{Extraction, MaterialSlots, Placement, Projection, View};
use bevy_ecs::prelude::{Entity, Resource, World};
use glam::{DAffine3, DVec2, DVec3, Vec2, Vec3};
use std::f64::consts::PI;

/// The selected objects and lights, in the order of selection; the last one is active.
#[derive(Resource, Clone, Debug, Default, PartialEq, Eq)]
pub struct Selection(pub Vec<Entity>);

impl Selection {
    /// The active entity: the last one selected.
    pub fn active(&self) -> Option<Entity> {
        self.0.last().copied()
    }

    /// Selects the entity alone; with `add`, adds it and makes it active, or removes it if it was active.
    pub fn choose(&mut self, entity: Entity, add: bool) {
        let was_active = self.active() == Some(entity);
        match add {
            false => self.0 = vec![entity],
            true => {
                self.0.retain(|&other| other != entity);
                if !was_active {
                    self.0.push(entity);
                }
            }
        }
    }
}

/// The part of an object that was clicked last, by the index of its material in
/// [`MaterialSlots`](crate::scene::MaterialSlots); `None` for all of it.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ActivePart(pub Option<(Entity, usize)>);

impl ActivePart {
    /// The part of an object with so many, if one was clicked.
    pub fn of(self, object: Entity, n_parts: usize) -> Option<usize> {
        self.0.filter(|(of, part)| *of == object && n_parts > 1 && *part < n_parts).map(|(_, part)| part)
    }
}

/// The part that is meant of the active object; `None` for all of it.
pub fn active_part(world: &World) -> Option<(Entity, usize)> {
    let active = world.resource::<Selection>().active()?;
    let n_parts = world.get::<MaterialSlots>(active)?.0.len();
    Some((active, world.resource::<ActivePart>().of(active, n_parts)?))
}

/// Result of picking at a position in the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Picked {
    /// The object or light.
    pub entity: Entity,
    /// The index of its material.
    pub part: usize,
    /// World position, metres.
    pub point: DVec3,
    /// Unit normal of the surface, on the side of the camera.
    pub normal: DVec3,
    /// Depth along the view axis, metres.
    pub depth: f64,
}

/// Picks at a position in the image (0..1 from the upper left), through the centre of the lens.
pub fn pick(scene: &Extraction, x: f64, y: f64, aspect: f64) -> Option<Picked> {
    hit(scene, &scene.prepared.camera, x, y, aspect)
}

/// Like [`pick`], for a camera that the snapshot does not have yet.
pub fn pick_along(
    scene: &Extraction,
    view: &View,
    projection: &Projection,
    x: f64,
    y: f64,
    aspect: f64,
) -> Option<Picked> {
    let camera = Camera {
        eye: (view.eye - scene.origin).as_vec3(),
        right: view.right().as_vec3(),
        up: view.up.as_vec3(),
        forward: view.forward.as_vec3(),
        tan_half_vfov: projection.tan_half_vfov() as f32,
        orthographic: projection.orthographic_height.map(|height| (0.5 * height) as f32),
        ..scene.prepared.camera
    };
    hit(scene, &camera, x, y, aspect)
}

fn hit(scene: &Extraction, camera: &Camera, x: f64, y: f64, aspect: f64) -> Option<Picked> {
    let ray = middle_ray(camera, x, y, aspect)?;
    let hit = scene.prepared.geometry.tree.closest_hit(&ray)?;
    let depth = f64::from(hit.t * ray.dir.dot(camera.forward));
    let point = scene.origin + ray.at(hit.t).as_dvec3();
    let normal = scene.prepared.geometry.tree.surface_point(&ray, &hit).geometric_normal.as_dvec3();
    let normal = if normal.dot(ray.dir.as_dvec3()) > 0.0 { -normal } else { normal };
    let entity = *scene.entities.get(hit.object as usize)?;
    let part = scene.prepared.geometry.objects.get(hit.object as usize)?.slot_of(hit.prim);
    (depth > 0.0 && depth.is_finite()).then_some(Picked { entity, part, point, normal, depth })
}

/// Returns the distance in metres from a world position along a unit direction to the closest hit.
pub fn distance(scene: &Extraction, from: DVec3, direction: DVec3) -> Option<f64> {
    let ray = Ray::new((from - scene.origin).as_vec3(), direction.as_vec3());
    scene.prepared.geometry.tree.closest_hit(&ray).map(|hit| f64::from(hit.t))
}

/// So many directions, evenly over the sphere above a height: a spiral from its pole, whose turns are as far apart as its
/// points.
///
/// - `lowest`: of the end of a direction, −1 for all of the sphere.
pub fn directions(n: u32, lowest: f64) -> impl Iterator<Item = DVec3> {
    let golden = PI * (3.0 - 5.0f64.sqrt());
    (0..n).map(move |i| {
        let y = 1.0 - (1.0 - lowest) * (f64::from(i) + 0.5) / f64::from(n);
        let (sin, cos) = (f64::from(i) * golden).sin_cos();
        let across = (1.0 - y * y).sqrt();
        DVec3::new(cos * across, y, sin * across)
    })
}

/// Like [`distance`], through some objects.
///
/// - `skin`: what is nearer than this behind one of them is not found, metres.
pub fn distance_past(scene: &Extraction, from: DVec3, direction: DVec3, objects: &[Entity], skin: f64) -> Option<f64> {
    /// Of surfaces of the objects themselves.
    const MOST: u32 = 1000;
    let (mut ray, mut passed) = (Ray::new((from - scene.origin).as_vec3(), direction.as_vec3()), 0.0);
    for _ in 0..MOST {
        let hit = scene.prepared.geometry.tree.closest_hit(&ray)?;
        if !objects.contains(scene.entities.get(hit.object as usize)?) {
            return Some(passed + f64::from(hit.t));
        }
        passed += f64::from(hit.t) + skin;
        ray.origin = (from + passed * direction - scene.origin).as_vec3();
    }
    None
}

fn middle_ray(camera: &Camera, x: f64, y: f64, aspect: f64) -> Option<Ray> {
    // A film of height 1.
    let size = Vec2::new(aspect as f32, 1.0);
    let ray = camera.middle_ray(Vec2::new(x as f32, y as f32) * size, size);
    (ray.dir.is_finite() && ray.origin.is_finite() && ray.dir != Vec3::ZERO).then_some(ray)
}

/// The box around an object, along its own axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OwnBox {
    /// Lower corner in the space of the box.
    pub min: DVec3,
    /// Upper corner in the space of the box.
    pub max: DVec3,
    /// Map from the space of the box to the world.
    pub world_from_box: DAffine3,
}

impl OwnBox {
    /// Corner `i` has its maximum along axis `a` where bit `a` of `i` is set.
    pub fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|i| {
            let pick = |axis: usize| if i >> axis & 1 == 0 { self.min[axis] } else { self.max[axis] };
            self.world_from_box.transform_point3(DVec3::new(pick(0), pick(1), pick(2)))
        })
    }

    /// The centre of the box in world space, metres.
    pub fn middle(&self) -> DVec3 {
        self.world_from_box.transform_point3(0.5 * (self.min + self.max))
    }

    /// Whether what is inside is a floor, a wall or an infinite plane: flat, and as large as the scene.
    ///
    /// - `radius`: of the scene, metres.
    pub fn is_backdrop(&self, radius: f64) -> bool {
        /// Thickness of what is flat, relative to its length.
        const FLAT: f64 = 0.02;
        let sides: [f64; 3] =
            std::array::from_fn(|a| (self.max[a] - self.min[a]) * self.world_from_box.matrix3.col(a).length());
        let (thin, long) = sides.iter().fold((f64::INFINITY, 0.0_f64), |(low, high), &x| (low.min(x), high.max(x)));
        // An infinite one has a box without a size.
        long == 0.0 || thin <= FLAT * long && long >= radius
    }
}

/// The box around an object or a light as it is rendered; for infinite ones, its reference point.
pub fn box_of(world: &mut World, entity: Entity) -> Option<OwnBox> {
    if let Some(light) = light_of(world, entity) {
        let (min, max) = (DVec3::splat(-light.radius()), DVec3::splat(light.radius()));
        let at = world.get::<Placement>(entity)?.translation;
        return Some(OwnBox { min, max, world_from_box: DAffine3::from_translation(at) });
    }
    let shown = &mut *world.resource_mut::<RenderState>();
    let object = shown.inputs.objects.iter().find(|object| object.entity == entity)?;
    let (min, max) = shown.extents.own_box(&object.shape).unwrap_or_default();
    Some(OwnBox { min, max, world_from_box: object.placement.affine() })
}

/// Projection from the world to the window: a pinhole camera.
#[derive(Clone, Copy, Debug)]
pub struct Projector {
    eye: DVec3,
    right: DVec3,
    up: DVec3,
    forward: DVec3,
    /// Window units per metre at a depth of 1 m; for an orthographic camera at any depth.
    scale: f64,
    is_orthographic: bool,
    middle: DVec2,
}

impl Projector {
    /// - `size`: size of the image, in the units of projected points.
    pub fn new(rig: &Rig, size: DVec2) -> Self {
        let Rig { view, projection, .. } = rig;
        Self {
            eye: view.eye,
            right: view.right(),
            up: view.up,
            forward: view.forward,
            scale: 0.5 * size.y / projection.half_height(1.0),
            is_orthographic: projection.orthographic_height.is_some(),
            middle: 0.5 * size,
        }
    }

    /// Projects a point; `None` if it is not in front of the camera.
    pub fn place(&self, point: DVec3) -> Option<DVec2> {
        let offset = point - self.eye;
        let depth = offset.dot(self.forward);
        let place = self.middle + DVec2::new(offset.dot(self.right), -offset.dot(self.up)) / self.metres(depth);
        (depth > 0.0 && place.is_finite()).then_some(place)
    }

    /// Projects the part of a line segment that is in front of the camera.
    pub fn segment(&self, a: DVec3, b: DVec3) -> Option<[DVec2; 2]> {
        /// Depth at which a line is clipped, relative to the depth of its farther end: well outside of any window.
        const NEAR: f64 = 1.0 / 1024.0;
        let depth = |point: DVec3| (point - self.eye).dot(self.forward);
        let (depth_a, depth_b) = (depth(a), depth(b));
        let near = NEAR * depth_a.max(depth_b);
        let cut = |from: DVec3, depth_from: f64, to: DVec3, depth_to: f64| match depth_from >= near {
            true => from,
            false => from.lerp(to, (near - depth_from) / (depth_to - depth_from)),
        };
        let [a, b] = [cut(a, depth_a, b, depth_b), cut(b, depth_b, a, depth_a)];
        Some([self.place(a)?, self.place(b)?])
    }

    /// Unit direction in the window from its centre towards a point outside of it; `None` if the point is directly
    /// behind the camera.
    pub fn way_to(&self, point: DVec3) -> Option<DVec2> {
        let offset = point - self.eye;
        DVec2::new(offset.dot(self.right), -offset.dot(self.up)).try_normalize()
    }

    /// Returns the ray of a window position: its origin in metres, and its direction, not normalised.
    pub fn line(&self, place: DVec2) -> (DVec3, DVec3) {
        let offset = (place - self.middle) / self.scale;
        let across = offset.x * self.right - offset.y * self.up;
        match self.is_orthographic {
            true => (self.eye + across, self.forward),
            false => (self.eye, self.forward + across),
        }
    }

    /// The unit direction towards a point; `None` for the camera position itself.
    pub fn towards(&self, point: DVec3) -> Option<DVec3> {
        if self.is_orthographic { Some(self.forward) } else { (point - self.eye).try_normalize() }
    }

    /// Metres per window unit at the depth of `point`; `None` if it is not in front of the camera.
    pub fn metres_at(&self, point: DVec3) -> Option<f64> {
        let depth = (point - self.eye).dot(self.forward);
        (depth > 0.0).then(|| self.metres(depth))
    }

    /// Metres per window unit at a depth.
    fn metres(&self, depth: f64) -> f64 {
        if self.is_orthographic { self.scale.recip() } else { depth / self.scale }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::View;

    #[test]
    fn adding_toggles_and_the_last_one_is_active() {
        let mut world = World::new();
        let [a, b] = [world.spawn_empty().id(), world.spawn_empty().id()];
        let mut selection = Selection::default();
        selection.choose(a, false);
        selection.choose(b, true);
        assert_eq!((selection.0.clone(), selection.active()), (vec![a, b], Some(b)));
        selection.choose(a, true);
        assert_eq!(selection.0, [b, a], "one that was not active becomes so first");
        selection.choose(a, true);
        assert_eq!(selection.0, [b]);
        selection.choose(a, false);
        assert_eq!(selection.0, [a]);
    }

    #[test]
    fn a_place_and_its_direction_agree() {
        let view = View::look_at(DVec3::new(3.0, 2.0, 5e6), DVec3::new(0.0, 1.0, 5e6 - 4.0), DVec3::Y).unwrap();
        let of = |projection| Projector::new(&Rig { view, projection, ..Rig::default() }, DVec2::new(800.0, 600.0));
        let projector = of(Projection::default());
        let parallel = of(Projection { orthographic_height: Some(3.0), ..Projection::default() });
        for place in [DVec2::new(400.0, 300.0), DVec2::new(10.0, 580.0), DVec2::new(799.0, 0.0)] {
            for projector in [projector, parallel] {
                let (from, along) = projector.line(place);
                assert!((projector.place(from + 7.0 * along).unwrap() - place).length() < 1e-5);
            }
            assert_eq!(parallel.line(place).1, view.forward);
        }
        assert!((parallel.metres_at(view.pivot()).unwrap() - 3.0 / 600.0).abs() < 1e-12);
        assert_eq!(projector.place(view.eye - view.forward), None);
        // A point behind the camera and to its right is to the right.
        let behind = view.eye - 3.0 * view.forward + view.right();
        assert!((projector.way_to(behind).unwrap() - DVec2::X).length() < 1e-6);
        assert_eq!(projector.way_to(view.eye), None);
    }

    #[test]
    fn a_line_is_cut_where_it_leaves_the_front() {
        let projector = Projector::new(&Rig::default(), DVec2::new(800.0, 600.0));
        let view = View::default();
        let at = |right: f64, ahead: f64| view.eye + right * view.right() + ahead * view.forward;
        let [a, b] = projector.segment(at(-1.0, 4.0), at(1.0, 4.0)).unwrap();
        assert_eq!([a, b], [projector.place(at(-1.0, 4.0)).unwrap(), projector.place(at(1.0, 4.0)).unwrap()]);
        // Past the camera, to its right: the near end is far outside, on the same line in the window.
        let [a, b] = projector.segment(at(1.0, 4.0), at(1.0, -4.0)).unwrap();
        assert!(a.x < 800.0 && b.x > 10_000.0 && (a.y - b.y).abs() < 1e-6, "{a} {b}");
        assert_eq!(projector.segment(at(0.0, -1.0), at(1.0, -2.0)), None);
    }
}
