//! Objects as spheres, squares and meshes with a transform, and which of them share a mesh.

use crate::common::ply::OWN_UVS;
use crate::common::scene::WholeScene;
use firstlight_files::printable;
use firstlight_files::warnings::Warnings;
use firstlight_format::parts::{LightPart, ObjectPart, RadiiPart, ball_grid};
use firstlight_format::placement::Placement;
use firstlight_kdtree::geometry::Frame;
use firstlight_mesh::Mesh;
use glam::{DAffine3, DMat3, DVec3, Vec2, Vec3};
use std::collections::HashMap;
use std::f64::consts::PI;
use std::sync::Arc;

/// A plane reaches this many times farther than the scene, whose horizon is then less than a pixel off.
const REACH: f64 = 1000.0;

/// A surface in its own space.
#[derive(Clone, Debug)]
pub(crate) enum Geometry {
    /// About the origin, radius 1; textures have their poles at ±Y.
    Sphere,
    /// From −1 to 1 along X and Y, facing +Z; u runs along X and v along Y from 0 to 1.
    Square,
    /// The triangles of one material, about the centre of the mesh.
    Mesh(Arc<Mesh>, Option<u16>),
}

/// A surface of one material in the world.
#[derive(Clone, Debug)]
pub(crate) struct Placed {
    pub name: String,
    /// Its index in the scene file.
    pub object: usize,
    pub geometry: Geometry,
    pub material: String,
    pub world: DAffine3,
    /// The meshes that are placed as one several times, counted from 0.
    pub group: Option<usize>,
}

impl Placed {
    /// Whether both are parts of one object of a group.
    pub(crate) fn is_part_of(&self, other: &Self) -> bool {
        self.group.is_some() && self.object == other.object
    }

    /// The areas in the image on which textures are as they are, and on which they are mirrored.
    pub(crate) fn areas_by_handedness(&self) -> (f32, f32) {
        let Geometry::Mesh(mesh, slot) = &self.geometry else { return (1.0, 0.0) };
        let side = if self.world.matrix3.determinant() < 0.0 { -1.0 } else { 1.0 };
        let mut areas = (0.0, 0.0);
        for (i, triangle) in mesh.triangles.iter().enumerate() {
            let is_of_slot = slot.is_none_or(|slot| mesh.slots.get(i).copied().unwrap_or(0) == slot);
            let corner = |k: usize| mesh.uvs.get(triangle[k] as usize).copied().unwrap_or(OWN_UVS[k]);
            let corners: [Vec2; 3] = std::array::from_fn(corner);
            let area = side * (corners[1] - corners[0]).perp_dot(corners[2] - corners[0]);
            if is_of_slot {
                areas = (areas.0 + area.max(0.0), areas.1 + (-area).max(0.0));
            }
        }
        areas
    }
}

/// All objects, part by part; those of one object follow each other.
///
/// - `emits`: whether a material of this name emits light.
pub(crate) fn placed(scene: &WholeScene, emits: impl Fn(&str) -> bool, warnings: &mut Warnings) -> Vec<Placed> {
    let mut all = Vec::new();
    let mut groups: HashMap<(usize, Vec<String>), usize> = HashMap::new();
    let mut counts: Vec<usize> = Vec::new();
    for (i, object) in scene.file.objects.iter().enumerate() {
        let name = object.name().map_or_else(|| format!("object {}", i + 1), str::to_owned);
        let world = Placement::from_part(object.transform()).affine();
        let mut push = |geometry, material: &str, world: DAffine3, group| {
            all.push(Placed { name: name.clone(), object: i, geometry, material: material.to_owned(), world, group });
        };
        // Rotation without the scale of the object, whose radius it is.
        let ball = |center: DVec3, radius: f64| {
            let linear = world.matrix3 * radius;
            DAffine3::from_mat3_translation(linear, world.transform_point3(center))
        };
        match object {
            ObjectPart::Sphere { center, radius, material, .. } => {
                push(Geometry::Sphere, material, ball(*center, *radius), None);
            }
            ObjectPart::BallGrid { first, steps, radius, material, .. } => {
                for center in ball_grid(*first, steps) {
                    push(Geometry::Sphere, material, ball(center, *radius), None);
                }
            }
            ObjectPart::Spheres { centers, radii, material, .. } => {
                for (k, center) in centers.iter().enumerate() {
                    let radius = match radii {
                        RadiiPart::All(radius) => *radius,
                        RadiiPart::Each(radii) => radii.get(k).copied().unwrap_or_default(),
                    };
                    push(Geometry::Sphere, material, ball(*center, radius), None);
                }
            }
            ObjectPart::Quad { corner, edge_u, edge_v, material, .. } => {
                let [u, v] = [edge_u, edge_v].map(|edge| world.transform_vector3(*edge));
                let middle = world.transform_point3(*corner) + 0.5 * (u + v);
                if u.dot(v).abs() > 1e-6 * u.length() * v.length() {
                    let (geometry, center) = parallelogram(middle, u, v, [Vec2::ZERO, Vec2::ONE]);
                    push(geometry, material, DAffine3::from_translation(center), None);
                } else {
                    let linear = DMat3::from_cols(0.5 * u, 0.5 * v, u.cross(v).normalize_or(DVec3::Z));
                    push(Geometry::Square, material, DAffine3::from_mat3_translation(linear, middle), None);
                }
            }
            ObjectPart::Plane { point, normal, material, .. } => {
                warnings.push(format!("`{}`: an infinite plane becomes a large square", printable::name(&name)));
                let normal = (world.matrix3.inverse().transpose() * *normal).normalize_or(DVec3::Y);
                let point = world.transform_point3(*point);
                let frame = Frame::around(normal.as_vec3());
                let reach = REACH * extent(scene, point);
                let far = Vec2::splat(reach as f32);
                let [u, v] = [frame.x, frame.y].map(|axis: Vec3| 2.0 * reach * axis.as_dvec3());
                let (geometry, center) = parallelogram(point, u, v, [-far, far]);
                push(geometry, material, DAffine3::from_translation(center), None);
            }
            ObjectPart::Triangle { vertices, material, .. } => {
                let corners = vertices.map(|vertex| world.transform_point3(vertex));
                if let Ok(mesh) = Mesh::from_f64(&corners, vec![[0, 1, 2]]) {
                    let mesh = Mesh { uvs: vec![Vec2::ZERO, Vec2::X, Vec2::Y], ..mesh };
                    let world = DAffine3::from_translation(mesh.center);
                    push(Geometry::Mesh(Arc::new(mesh), None), material, world, None);
                }
            }
            ObjectPart::Mesh { material, materials, .. } => {
                // A mesh that was left out on reading has no triangles, which renderers refuse or stumble over.
                let Some(mesh) = scene.meshes[i].as_ref().filter(|mesh| !mesh.triangles.is_empty()) else { continue };
                let of_slot = |slot: u16| -> &str {
                    let list = materials.as_deref().unwrap_or_default();
                    list.get(usize::from(slot)).or(list.last()).or(material.as_ref()).map_or("", String::as_str)
                };
                let mut slots = mesh.slots.clone();
                slots.sort_unstable();
                slots.dedup();
                let slots: Vec<Option<u16>> =
                    if slots.len() < 2 { vec![None] } else { slots.into_iter().map(Some).collect() };
                let first = mesh.slots.first().copied().unwrap_or(0);
                let names: Vec<String> = slots.iter().map(|slot| of_slot(slot.unwrap_or(first)).to_owned()).collect();
                let world = world * DAffine3::from_translation(mesh.center);
                // A light must stand for itself.
                let group = (!names.iter().any(|name| emits(name))).then(|| {
                    let next = groups.len();
                    let group = *groups.entry((Arc::as_ptr(mesh) as usize, names.clone())).or_insert(next);
                    counts.resize(counts.len().max(group + 1), 0);
                    counts[group] += 1;
                    group
                });
                for (slot, material) in slots.iter().zip(&names) {
                    push(Geometry::Mesh(mesh.clone(), *slot), material, world, group);
                }
            }
        }
    }
    for placed in &mut all {
        placed.group = placed.group.filter(|group| counts[*group] > 1);
    }
    all
}

/// Two triangles with texture coordinates from one corner to the opposite one, and their centre.
fn parallelogram(middle: DVec3, u: DVec3, v: DVec3, [low, high]: [Vec2; 2]) -> (Geometry, DVec3) {
    let corner = |a: f64, b: f64| middle + a * u + b * v;
    let corners = [corner(-0.5, -0.5), corner(0.5, -0.5), corner(0.5, 0.5), corner(-0.5, 0.5)];
    let mesh = Mesh::from_f64(&corners, vec![[0, 1, 2], [0, 2, 3]]).expect("four corners make two triangles");
    let uvs = vec![low, Vec2::new(high.x, low.y), high, Vec2::new(low.x, high.y)];
    let center = mesh.center;
    (Geometry::Mesh(Arc::new(Mesh { uvs, ..mesh }), None), center)
}

/// How far the scene reaches from a point, metres: to the camera, and to positions of objects.
fn extent(scene: &WholeScene, point: DVec3) -> f64 {
    let far = |at: DVec3| (at - point).length();
    let of_object = |object: &ObjectPart| {
        let world = Placement::from_part(object.transform()).affine();
        match object {
            ObjectPart::Sphere { center, .. } => far(world.transform_point3(*center)),
            ObjectPart::Quad { corner, .. } => far(world.transform_point3(*corner)),
            ObjectPart::Plane { .. } => 0.0,
            _ => far(world.translation),
        }
    };
    let of_objects = scene.file.objects.iter().map(of_object).fold(0.0, f64::max);
    of_objects.max(far(scene.file.camera.eye)).max(1.0)
}

/// Radiance of a sphere with the intensity of a point light, W·m⁻²·sr⁻¹.
pub(crate) fn radiance_of(light: &LightPart) -> Option<(DVec3, f64, Vec3)> {
    match light {
        LightPart::Point { position, intensity, radius, .. } if *radius > 0.0 => {
            Some((*position, *radius, intensity.0 * (1.0 / (PI * radius * radius)) as f32))
        }
        _ => None,
    }
}
