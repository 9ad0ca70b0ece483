//! Size of a scene: what "frame all" frames, and the scale of the flying speed.

use crate::format::placement::Placement;
use crate::mesh::procedural::icosphere;
use crate::scene::world::components::{Material, Shape};
use crate::scene::world::inputs::{ObjectInput, SceneInputs};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::collections::{HashMap, HashSet};

/// A sphere around the finite objects of a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Extent {
    /// Centre of the sphere in the world, metres.
    pub center: DVec3,
    /// Metres; 0 if nothing is finite.
    pub radius: f64,
}

/// Bounding boxes of meshes and groups of spheres in object space, cached.
#[derive(Clone, Debug, Default)]
pub struct ExtentCache(HashMap<usize, (Shape, (DVec3, DVec3))>);

impl ExtentCache {
    /// The extent of the visible objects, without outliers; light sources count only if there is nothing else.
    pub fn extent(&mut self, inputs: &SceneInputs) -> Extent {
        let boxes = self.near_boxes(inputs);
        let around =
            boxes.into_iter().reduce(|(min, max), (other_min, other_max)| (min.min(other_min), max.max(other_max)));
        match around {
            Some((min, max)) => Extent { center: 0.5 * min + 0.5 * max, radius: 0.5 * (max - min).length() },
            None => Extent::default(),
        }
    }

    /// Corners of the boxes that [`Self::extent`] includes, for framing.
    pub fn corners(&mut self, inputs: &SceneInputs) -> Vec<DVec3> {
        self.near_boxes(inputs).into_iter().flat_map(|(min, max)| corners_of(min, max)).collect()
    }

    /// Corners of the world-space box of one object; empty for infinite and invalid ones.
    pub fn corners_of(&mut self, object: &ObjectInput) -> Vec<DVec3> {
        self.world_box(object).map(|(min, max)| corners_of(min, max).to_vec()).unwrap_or_default()
    }

    /// Points of an object in the world between which it is seen from any side; empty for infinite and invalid ones.
    pub fn outermost_of(&self, object: &ObjectInput) -> Vec<DVec3> {
        let world = object.placement.affine();
        let points = outermost(&object.shape).into_iter().map(|point| world.transform_point3(point));
        points.filter(|point| point.is_finite()).collect()
    }

    fn near_boxes(&mut self, inputs: &SceneInputs) -> Vec<(DVec3, DVec3)> {
        let used: HashSet<usize> = inputs.objects.iter().filter_map(|object| key(&object.shape)).collect();
        self.0.retain(|key, _| used.contains(key));
        let glowing: HashSet<_> = (inputs.materials.iter())
            .filter(|material| matches!(material.material, Material::Emissive { .. }))
            .map(|material| material.entity)
            .collect();
        let is_light =
            |object: &&ObjectInput| !object.slots.is_empty() && object.slots.iter().all(|slot| glowing.contains(slot));
        let (lights, things): (Vec<_>, Vec<_>) = inputs.objects.iter().partition(is_light);
        let mut boxes = |objects: Vec<&ObjectInput>| -> Vec<(DVec3, DVec3)> {
            objects.into_iter().filter_map(|object| self.world_box(object)).collect()
        };
        let mut near = boxes(things);
        if near.is_empty() {
            near = boxes(lights);
        }
        leave_out_far(&mut near);
        near
    }

    /// The world-space bounding box of an object, metres; `None` for infinite and invalid ones.
    pub fn world_box(&mut self, object: &ObjectInput) -> Option<(DVec3, DVec3)> {
        let (min, max) = self.own_box(&object.shape)?;
        let world = object.placement.affine();
        let corners = corners_of(min, max).map(|corner| world.transform_point3(corner));
        box_of(corners).filter(|(min, max)| min.is_finite() && max.is_finite())
    }

    /// The object-space bounding box of a shape; `None` for infinite and invalid ones.
    pub fn own_box(&mut self, shape: &Shape) -> Option<(DVec3, DVec3)> {
        match shape {
            Shape::Plane { .. } => None,
            Shape::Sphere { radius } => Some((DVec3::splat(-radius), DVec3::splat(*radius))),
            Shape::Quad { edge_u, edge_v } => box_of([DVec3::ZERO, *edge_u, *edge_v, edge_u + edge_v]),
            Shape::Triangle { vertices } => box_of(*vertices),
            shape @ (Shape::Mesh(_) | Shape::Spheres(_)) => {
                let key = key(shape)?;
                match self.0.get(&key) {
                    Some((_, known)) => Some(*known),
                    None => {
                        let own = own_box(shape)?;
                        self.0.insert(key, (shape.clone(), own));
                        Some(own)
                    }
                }
            }
        }
    }
}

/// Removes the boxes that reach more than twice as far from the median centre as the median box: distant single objects
/// and very large grounds.
fn leave_out_far(boxes: &mut Vec<(DVec3, DVec3)>) {
    let median = |mut values: Vec<f64>| {
        values.sort_unstable_by(f64::total_cmp);
        values.get(values.len() / 2).copied().unwrap_or(0.0)
    };
    let middle =
        DVec3::from_array([0, 1, 2].map(|axis| median(boxes.iter().map(|(a, b)| 0.5 * (a[axis] + b[axis])).collect())));
    let reach = |(min, max): &(DVec3, DVec3)| (0.5 * (*min + *max) - middle).length() + 0.5 * (*max - *min).length();
    let limit = 2.0 * median(boxes.iter().map(reach).collect());
    boxes.retain(|bounds| reach(bounds) <= limit);
}

/// Outermost points of a shape in many directions, in object space.
fn outermost(shape: &Shape) -> Vec<DVec3> {
    /// Edges per edge of the icosahedron that has these directions: every 8° for spheres, every 32° for meshes.
    const OF_SPHERES: u32 = 8;
    const OF_MESHES: u32 = 2;
    let directions = |frequency: u32| icosphere(frequency).positions;
    match shape {
        Shape::Plane { .. } => Vec::new(),
        Shape::Sphere { radius } => {
            directions(OF_SPHERES).iter().map(|way| *radius * way.as_dvec3().normalize()).collect()
        }
        Shape::Quad { edge_u, edge_v } => vec![DVec3::ZERO, *edge_u, *edge_v, *edge_u + *edge_v],
        Shape::Triangle { vertices } => vertices.to_vec(),
        Shape::Mesh(mesh) => {
            let ways = directions(OF_MESHES);
            // Vertices of no triangle may lie anywhere.
            let mut is_used = vec![false; mesh.positions.len()];
            for &vertex in mesh.triangles.as_flattened() {
                is_used.get_mut(vertex as usize).into_iter().for_each(|used| *used = true);
            }
            let farthest = |mut best: Vec<(f32, Vec3)>, (point, is_used): (&Vec3, &bool)| {
                if *is_used {
                    for (best, way) in best.iter_mut().zip(&ways) {
                        let along = point.dot(*way);
                        *best = if along > best.0 { (along, *point) } else { *best };
                    }
                }
                best
            };
            let none = || vec![(f32::NEG_INFINITY, Vec3::ZERO); ways.len()];
            let better = |(a, b): ((f32, Vec3), (f32, Vec3))| if b.0 > a.0 { b } else { a };
            let both = |a: Vec<_>, b: Vec<_>| a.into_iter().zip(b).map(better).collect();
            let vertices = mesh.positions.par_iter().zip(&is_used).with_min_len(1 << 12);
            let found = vertices.fold(none, farthest).reduce(none, both);
            found.into_iter().map(|(_, point)| mesh.center + point.as_dvec3()).collect()
        }
        Shape::Spheres(_) => own_box(shape).map(|(min, max)| corners_of(min, max).to_vec()).unwrap_or_default(),
    }
}

/// Height of the lowest point of a shape in the world, metres; `None` for an infinite or empty one.
pub fn lowest_point(shape: &Shape, placement: &Placement) -> Option<f64> {
    let world = placement.affine();
    let height = |point: DVec3| world.transform_point3(point).y;
    let lowest = |points: &mut dyn Iterator<Item = DVec3>| points.map(height).min_by(f64::total_cmp);
    // A sphere reaches as far down as the row of its heights is long.
    let reach = world.matrix3.row(1).length();
    match shape {
        Shape::Plane { .. } => None,
        Shape::Sphere { radius } => Some(height(DVec3::ZERO) - radius * reach),
        Shape::Quad { edge_u, edge_v } => lowest(&mut [DVec3::ZERO, *edge_u, *edge_v, *edge_u + *edge_v].into_iter()),
        Shape::Triangle { vertices } => lowest(&mut vertices.iter().copied()),
        Shape::Mesh(mesh) => {
            let used = mesh.triangles.iter().flatten().filter_map(|&vertex| mesh.positions.get(vertex as usize));
            lowest(&mut used.map(|position| mesh.center + position.as_dvec3()))
        }
        Shape::Spheres(balls) => {
            let each = balls.centers.iter().zip(&balls.radii);
            let lows =
                each.map(|(center, radius)| height(balls.center + center.as_dvec3()) - f64::from(*radius) * reach);
            lows.min_by(f64::total_cmp)
        }
    }
}

fn key(shape: &Shape) -> Option<usize> {
    match shape {
        Shape::Mesh(mesh) => Some(std::sync::Arc::as_ptr(mesh) as usize),
        Shape::Spheres(balls) => Some(std::sync::Arc::as_ptr(balls) as usize),
        _ => None,
    }
}

fn own_box(shape: &Shape) -> Option<(DVec3, DVec3)> {
    let (center, (min, max)) = match shape {
        Shape::Mesh(mesh) => {
            let used = mesh.triangles.iter().flatten().filter_map(|&v| mesh.positions.get(v as usize));
            (mesh.center, box_of(used.map(|position| position.as_dvec3()))?)
        }
        Shape::Spheres(balls) => {
            let ends = balls.centers.iter().zip(&balls.radii).flat_map(|(center, &radius)| {
                let (center, radius) = (center.as_dvec3(), DVec3::splat(radius.into()));
                [center - radius, center + radius]
            });
            (balls.center, box_of(ends)?)
        }
        _ => return None,
    };
    Some((min + center, max + center))
}

fn corners_of(min: DVec3, max: DVec3) -> [DVec3; 8] {
    std::array::from_fn(|i| {
        let pick = |axis: usize| if i >> axis & 1 == 0 { min[axis] } else { max[axis] };
        DVec3::new(pick(0), pick(1), pick(2))
    })
}

fn box_of(points: impl IntoIterator<Item = DVec3>) -> Option<(DVec3, DVec3)> {
    points.into_iter().map(|point| (point, point)).reduce(|(min, max), (point, _)| (min.min(point), max.max(point)))
}
