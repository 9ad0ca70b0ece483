//! From the world to the flat snapshot that the workers read.
//!
//! Placements are `f64`; the snapshot is `f32` relative to an [`origin`](Extraction::origin) near the camera. Each part
//! is rebuilt on its own ([`SnapshotPart`]), and the kd-trees of meshes and groups of spheres are cached ([`Trees`]).

use crate::format::camera::render_camera;
use crate::format::light::LightKind;
use crate::format::placement::Placement;
use crate::format::view::{Lens, Projection, View};
use crate::kdtree::{self, HitSpace};
use crate::mesh::Mesh;
use crate::render::{
    self, Camera, ColorInput, Cone, DeltaLight, Geometry, InSnapshot, LightImage, MAX_LOBES, MapParams, MaterialId,
    Object, Prepared, ScalarInput, Shading, Snapshot, TextureId, TexturePattern,
};
use crate::scene::animation::Animation;
use crate::scene::hit_spaces::{about, hit_spaces, sound_affine};
use crate::scene::world::components::{ColorParam, GREY, InWorld, Material, ScalarParam, Shape, SurfaceTexture};
use crate::scene::world::inputs::{CameraInput, LightInput, ObjectInput, SceneInputs};
use crate::scene::world::inventory::emits;
use crate::scene::world::lights::LightTexture;
use crate::scene::world::trees::{Trees, address};
use bevy_ecs::prelude::Entity;
use glam::{DVec3, Mat3, Vec3};
use std::collections::HashMap;
use std::f64::consts::PI;
use std::sync::Arc;

/// Which part of a snapshot to rebuild; each includes the ones before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum SnapshotPart {
    /// The camera alone.
    Camera,
    /// Materials, textures and the light table.
    Shading,
    /// The kd-tree over the objects.
    Geometry,
}

/// A snapshot and the data needed to update parts of it.
#[derive(Clone, Debug)]
pub struct Extraction {
    /// Metres: the world-space position of the origin of the snapshot.
    pub origin: DVec3,
    /// The snapshot relative to `origin`, with its tables.
    pub prepared: Prepared,
    /// Objects and lights that were left out, and why.
    pub problems: Vec<String>,
    /// The entity of each object of the snapshot.
    pub entities: Vec<Entity>,
    /// The entity of each delta light, in the order of [`Shading::delta_lights`].
    pub delta_lights: Vec<Entity>,
    ids: HashMap<MaterialKey, MaterialId>,
    order: Vec<MaterialKey>,
}

/// The source of a material.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum MaterialKey {
    /// The material of objects without one.
    Grey,
    Material(Entity),
    /// The emission of a point light.
    Light(Entity),
}

impl Extraction {
    /// Builds everything. Objects whose tree is missing in `trees` are left out.
    pub fn new(inputs: &SceneInputs, trees: &Trees) -> Self {
        Self::about(origin_of(inputs), inputs, trees, None, None)
    }

    /// - `base`: the same scene at another time of the exposure.
    /// - `before`: a snapshot whose tables are shared as far as they are equal.
    fn about(
        origin: DVec3,
        inputs: &SceneInputs,
        trees: &Trees,
        base: Option<&SceneInputs>,
        before: Option<&Prepared>,
    ) -> Self {
        let mut materials = MaterialIds::default();
        let mut problems = Vec::new();
        if let Some(bad) = inputs.camera.and_then(|camera| camera.check().err()) {
            problems.push(format!("the camera is ignored, and the default camera is used: {bad}"));
        }
        let mut geometry = (Vec::new(), Vec::new());
        let mut entities = Vec::new();
        let spaces = hit_spaces(inputs, trees, origin, base);
        for (object, space) in inputs.objects.iter().zip(spaces) {
            match shape_of(object, trees, origin, space) {
                Ok((shape, mesh)) => {
                    let mut keys: Vec<_> = object.slots.iter().map(|&slot| MaterialKey::Material(slot)).collect();
                    if keys.is_empty() {
                        keys.push(MaterialKey::Grey);
                    }
                    let n_slots =
                        mesh.as_ref().and_then(|mesh| mesh.slots.iter().max()).map_or(1, |&last| usize::from(last) + 1);
                    let last = keys[keys.len() - 1];
                    keys.resize(keys.len().max(n_slots), last);
                    geometry.0.push(shape);
                    let materials = keys.into_iter().map(|key| materials.id(key)).collect();
                    let turned = turned(object);
                    geometry.1.push(Object { mesh, materials, turned, is_point_light: false });
                    entities.push(object.entity);
                }
                // What is left out was told when it was loaded.
                Err(reason) if reason.is_empty() => {}
                Err(reason) => {
                    let name = object.name.clone().unwrap_or_else(|| object.entity.to_string());
                    problems.push(format!("object `{name}` is ignored: {reason}"));
                }
            }
        }
        let mut delta_lights = Vec::new();
        for light in &inputs.lights {
            if let Err(bad) = light.light.check(&light.placement) {
                problems.push(format!("{} {} is ignored: {bad}", light.light.name(), light.entity));
                continue;
            }
            if light.light.radius() == 0.0 {
                delta_lights.push(light.entity);
                continue;
            }
            let center = (light.placement.translation - origin).as_vec3();
            let radius = light.light.radius() as f32;
            geometry.0.push(kdtree::Shape::Sphere { center, radius });
            let glow = materials.id(MaterialKey::Light(light.entity));
            geometry.1.push(Object { is_point_light: true, ..Object::plain(glow) });
            entities.push(light.entity);
        }
        let geometry = Geometry::build_with(geometry.0, geometry.1, &trees.statics);
        let shading = shading_of(inputs, &mut materials, origin);
        let camera = camera_in(&camera_of(inputs), origin);
        let snapshot = Snapshot::new(geometry, shading, camera);
        let prepared = match before {
            None => Prepared::new(snapshot),
            Some(before) => before.with_snapshot(snapshot),
        };
        Self { origin, prepared, problems, entities, delta_lights, ids: materials.ids, order: materials.order }
    }

    /// The entity of each material of the snapshot: the material itself, or the light that emits; `None` for the
    /// material of objects without one.
    pub fn material_entities(&self) -> impl Iterator<Item = Option<Entity>> + '_ {
        self.order.iter().map(|key| match key {
            MaterialKey::Grey => None,
            MaterialKey::Material(entity) | MaterialKey::Light(entity) => Some(*entity),
        })
    }

    /// Replaces the trees of meshes by those in `trees`. Returns whether samples so far are those of the new ones: all
    /// trees of a mesh give the same hits, unless they are decided in another space.
    ///
    /// - `inputs`: the inputs that this was made of.
    pub fn take_trees(&mut self, inputs: &SceneInputs, trees: &Trees) -> bool {
        let spaces: HashMap<Entity, HitSpace> = inputs
            .objects
            .iter()
            .map(|object| object.entity)
            .zip(hit_spaces(inputs, trees, self.origin, None))
            .collect();
        let old = &self.prepared.geometry;
        let mut same_hits = true;
        let objects = old.tree.shapes().iter().zip(&old.objects).zip(&self.entities);
        let shapes = objects.map(|((shape, object), entity)| {
            let newer = object.mesh.as_ref().and_then(|mesh| trees.meshes.get(&address(mesh)));
            match (shape, newer) {
                (&kdtree::Shape::Mesh { world_from_object, space: old, .. }, Some((_, tree))) => {
                    let space = spaces.get(entity).copied().unwrap_or(old);
                    same_hits &= space == old;
                    kdtree::Shape::Mesh { tree: tree.clone(), world_from_object, space }
                }
                _ => shape.clone(),
            }
        });
        let geometry = Geometry::build_with(shapes.collect(), old.objects.clone(), &trees.statics);
        self.prepared = self.prepared.with_trees(Arc::new(geometry));
        same_hits
    }

    /// Moves the camera and keeps the rest, the origin too.
    pub(crate) fn follow_camera(&mut self, inputs: &SceneInputs) {
        self.prepared = self.prepared.with_camera(camera_in(&camera_of(inputs), self.origin));
    }

    /// Rebuilds one part and keeps the rest. If the camera has moved so far that the origin changes, everything is
    /// rebuilt; returns true then.
    pub fn update(&mut self, part: SnapshotPart, inputs: &SceneInputs, trees: &Trees) -> bool {
        let camera = camera_of(inputs);
        let moved = origin_for(&camera.view) != self.origin;
        if moved || part == SnapshotPart::Geometry {
            *self = Self::about(origin_of(inputs), inputs, trees, None, Some(&self.prepared));
            return moved;
        }
        if part == SnapshotPart::Shading {
            let mut materials =
                MaterialIds { ids: std::mem::take(&mut self.ids), order: std::mem::take(&mut self.order) };
            let shading = Arc::new(shading_of(inputs, &mut materials, self.origin));
            self.prepared = self.prepared.with_shading(shading);
            (self.ids, self.order) = (materials.ids, materials.order);
        }
        self.prepared = self.prepared.with_camera(camera_in(&camera, self.origin));
        false
    }
}

impl Extraction {
    /// The snapshot at another time, relative to the same origin; objects and materials have the same indices unless
    /// one of them is invalid at that time. Parts that do not change are shared: see [`SnapshotPart`].
    ///
    /// - `inputs`: the inputs that this was made of.
    /// - `seconds`: the time.
    pub fn at(&self, animation: &Animation, inputs: &SceneInputs, trees: &Trees, seconds: f64) -> Prepared {
        let then = animation.inputs_at(inputs, seconds);
        if then.objects != inputs.objects || !same_shapes(&then.lights, &inputs.lights) {
            return Self::about(self.origin, &then, trees, Some(inputs), Some(&self.prepared)).prepared;
        }
        let mut prepared = self.prepared.clone();
        if then.lights != inputs.lights || then.materials != inputs.materials {
            let mut materials = MaterialIds { ids: self.ids.clone(), order: self.order.clone() };
            prepared = prepared.with_shading(Arc::new(shading_of(&then, &mut materials, self.origin)));
        }
        if then.camera != inputs.camera {
            prepared = prepared.with_camera(camera_in(&camera_of(&then), self.origin));
        }
        prepared
    }
}

/// Whether the same lights are spheres, with equal positions and radii.
fn same_shapes(a: &[LightInput], b: &[LightInput]) -> bool {
    let shape = |light: &LightInput| {
        let radius = light.light.radius();
        light.light.check(&light.placement).map(|()| (radius > 0.0).then_some((radius, light.placement.translation)))
    };
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| shape(a) == shape(b))
}

/// The origin for a camera: a corner of a grid with cells 512 to 1024 viewing distances wide.
///
/// A point at the viewing distance is then at most 887 viewing distances away, where `f32` rounds by 887 · 2⁻²⁴ of that
/// distance: a fifteenth of a pixel of an image 1000 pixels high with a field of view of 45 degrees. The origin depends
/// on the view alone, so that a view always gives the same bits, however it was reached; near the origin of the world
/// it is zero, and ordinary moves keep it.
pub fn origin_for(view: &View) -> DVec3 {
    let cell = (512.0 * view.pivot_distance.clamp(1e-9, 1e12)).log2().ceil().exp2();
    let origin = (view.eye / cell).round() * cell;
    if origin.is_finite() { origin } else { DVec3::ZERO }
}

/// The origin for the camera of a scene.
pub(crate) fn origin_of(inputs: &SceneInputs) -> DVec3 {
    origin_for(&camera_of(inputs).view)
}

fn camera_of(inputs: &SceneInputs) -> CameraInput {
    inputs.camera.filter(|camera| camera.check().is_ok()).unwrap_or(CameraInput {
        entity: Entity::PLACEHOLDER,
        view: View::default(),
        projection: Projection::default(),
        lens: Lens::default(),
    })
}

fn camera_in(CameraInput { view, projection, lens, .. }: &CameraInput, origin: DVec3) -> Camera {
    render_camera(view, projection, lens, origin)
}

/// The shape for the kd-tree, relative to `origin`, or why it is invalid.
fn shape_of(
    object: &ObjectInput,
    trees: &Trees,
    origin: DVec3,
    space: HitSpace,
) -> Result<(kdtree::Shape, Option<Arc<Mesh>>), String> {
    let placement = &object.placement;
    let world = sound_affine(placement).ok_or("its transform is not finite or flattens it")?;
    let point = |p: DVec3| (world.transform_point3(p) - origin).as_vec3();
    let vector = |v: DVec3| world.transform_vector3(v).as_vec3();
    let even = |placement: &Placement| placement.even_scale().ok_or("spheres need a uniform scale".to_owned());
    let shape = match &object.shape {
        Shape::Sphere { radius } => {
            let radius = (radius * even(placement)?) as f32;
            if !(radius.is_normal() && radius > 0.0) {
                return Err(format!("its radius is {radius}"));
            }
            kdtree::Shape::Sphere { center: point(DVec3::ZERO), radius }
        }
        Shape::Plane { normal } => {
            // Normals are transformed by the inverse transpose, which keeps them on the front side under reflections.
            let normal = (world.matrix3.inverse().transpose() * *normal).normalize_or_zero().as_vec3();
            if normal == Vec3::ZERO || !normal.is_finite() {
                return Err("its normal has no length".to_owned());
            }
            kdtree::Shape::Plane { point: point(DVec3::ZERO), normal }
        }
        Shape::Quad { edge_u, edge_v } => {
            let (edge_u, edge_v) = (vector(*edge_u), vector(*edge_v));
            if !has_area(edge_u, edge_v) {
                return Err("it has no area".to_owned());
            }
            kdtree::Shape::Quad { corner: point(DVec3::ZERO), edge_u, edge_v }
        }
        Shape::Triangle { vertices } => {
            let vertices = vertices.map(point);
            if !has_area(vertices[1] - vertices[0], vertices[2] - vertices[0]) {
                return Err("it has no area".to_owned());
            }
            kdtree::Shape::Triangle { vertices }
        }
        Shape::Mesh(mesh) => {
            let (_, tree) = trees.meshes.get(&address(mesh)).ok_or_else(|| trees.reason(&object.shape))?;
            let world_from_object = about(world, mesh.center, origin);
            return Ok((kdtree::Shape::Mesh { tree: tree.clone(), world_from_object, space }, Some(mesh.clone())));
        }
        Shape::Spheres(balls) => {
            even(placement)?;
            let (_, tree) = trees.balls.get(&address(balls)).ok_or_else(|| trees.reason(&object.shape))?;
            kdtree::Shape::Spheres { tree: tree.clone(), world_from_object: about(world, balls.center, origin) }
        }
    };
    Ok((shape, None))
}

/// Rotation of the texture of a single sphere; `None`: none.
fn turned(object: &ObjectInput) -> Option<Mat3> {
    let Shape::Sphere { .. } = object.shape else { return None };
    let m = object.placement.affine().matrix3;
    let object_from_world = (m * object.placement.even_scale()?.recip()).transpose().as_mat3();
    (object_from_world != Mat3::IDENTITY).then_some(object_from_world)
}

fn has_area(u: Vec3, v: Vec3) -> bool {
    let area = u.as_dvec3().cross(v.as_dvec3()).length();
    area.is_finite() && area > 0.0
}

/// The materials that a snapshot needs, numbered in the order of first use.
#[derive(Default)]
struct MaterialIds {
    ids: HashMap<MaterialKey, MaterialId>,
    order: Vec<MaterialKey>,
}

impl MaterialIds {
    fn id(&mut self, key: MaterialKey) -> MaterialId {
        *self.ids.entry(key).or_insert_with(|| {
            self.order.push(key);
            (self.order.len() - 1) as MaterialId
        })
    }
}

/// The shading for the materials in `table`; materials that blends refer to are added to it.
fn shading_of(inputs: &SceneInputs, table: &mut MaterialIds, origin: DVec3) -> Shading {
    let by_entity: HashMap<Entity, &Material> = inputs.materials.iter().map(|m| (m.entity, &m.material)).collect();
    let lights: HashMap<Entity, LightKind> = inputs.lights.iter().map(|light| (light.entity, light.light)).collect();
    let mut textures = TextureTable::default();
    let mut materials = Vec::new();
    // Blends add to the table during the loop.
    while materials.len() < table.order.len() {
        let key = table.order[materials.len()];
        materials.push(match key {
            MaterialKey::Grey => material_of(&GREY, table, &mut textures, &by_entity),
            MaterialKey::Material(entity) => {
                let material = by_entity.get(&entity).copied().unwrap_or(&GREY);
                material_of(material, table, &mut textures, &by_entity)
            }
            MaterialKey::Light(entity) => render::Material::Emissive {
                radiance: ColorInput::Constant(lights.get(&entity).map_or(
                    Vec3::ZERO,
                    // A sphere of radiance L and radius r has the radiant intensity π r² L in all directions.
                    |light| light.strength() * (1.0 / (PI * light.radius().powi(2))) as f32,
                )),
            },
        });
    }
    let (environment, air) = (inputs.environment.light.clone(), inputs.environment.air);
    let delta_lights = inputs.lights.iter().filter_map(|light| delta_light(light, origin, &mut textures)).collect();
    Shading { air, delta_lights, ..Shading::new(materials, textures.textures, environment) }
}

/// A delta light relative to `origin`; `None` for lights with a radius and for invalid ones.
fn delta_light(input: &LightInput, origin: DVec3, textures: &mut TextureTable) -> Option<DeltaLight> {
    let LightInput { light, placement, .. } = input;
    light.check(placement).ok()?;
    let position = (placement.translation - origin).as_vec3();
    Some(match light {
        LightKind::Point(light) if light.radius > 0.0 => return None,
        LightKind::Point(light) => DeltaLight::Point { position, intensity: light.intensity },
        LightKind::Spot(spot) => {
            let axis = light.direction(placement)?.as_vec3().normalize();
            let [inner, outer] = [spot.inner_angle_deg, spot.outer_angle_deg].map(f64::to_radians);
            let cone = Cone::new(axis, inner, outer, spot.falloff);
            let texture = input.texture.as_ref().map(|LightTexture(texture)| texture);
            let image = (texture.is_some() || spot.image.is_shaped()).then(|| {
                let aspect = match texture.map(|texture| &texture.texture.pattern) {
                    Some(TexturePattern::Image { image, .. }) => f64::from(image.width) / f64::from(image.height),
                    _ => 1.0,
                };
                let [right, up] = spot.image.axes(placement, axis.as_dvec3().normalize()).map(|it| it.as_vec3());
                LightImage {
                    texture: texture.map(|texture| textures.id(texture)),
                    axes: [right, up, axis],
                    half: spot.image.half(spot.outer_angle_deg, aspect).as_vec2(),
                    even: spot.image.even,
                }
            });
            DeltaLight::Spot { position, intensity: spot.intensity, cone, image }
        }
        LightKind::Directional(directional) => DeltaLight::Directional {
            direction: light.direction(placement)?.as_vec3().normalize(),
            irradiance: directional.irradiance,
        },
    })
}

fn material_of(
    material: &Material,
    table: &mut MaterialIds,
    textures: &mut TextureTable,
    by_entity: &HashMap<Entity, &Material>,
) -> render::Material {
    // Blends that are cyclic or have too many parts become grey.
    let is_unfit = matches!(material, Material::Blend { .. }) && !is_fit(material, by_entity);
    let material = if is_unfit { &GREY } else { material };
    material.map(&mut WorldToSnapshot { materials: table, textures }).simplified()
}

/// The tables of a snapshot, to which the references of a material are added.
struct WorldToSnapshot<'a> {
    materials: &'a mut MaterialIds,
    textures: &'a mut TextureTable,
}

impl MapParams<InWorld, InSnapshot> for WorldToSnapshot<'_> {
    fn color(&mut self, color: &ColorParam) -> ColorInput {
        match color {
            ColorParam::Rgb(rgb) => ColorInput::Constant(*rgb),
            ColorParam::Texture(texture) => ColorInput::Texture(self.textures.id(texture)),
        }
    }

    fn scalar(&mut self, scalar: &ScalarParam) -> ScalarInput {
        match scalar {
            ScalarParam::Number(value) => ScalarInput::Constant(*value),
            ScalarParam::Texture(texture) => ScalarInput::Texture(self.textures.id(texture)),
        }
    }

    fn material(&mut self, material: &Entity) -> MaterialId {
        self.materials.id(MaterialKey::Material(*material))
    }
}

/// Whether a blend resolves to few enough plain materials, at most one of them emissive and then with constant weights.
fn is_fit(blend: &Material, by_entity: &HashMap<Entity, &Material>) -> bool {
    let (mut lobes, mut glowing, mut textured) = (0, 0, false);
    let mut open = vec![Some(blend)];
    // A binary tree with n leaves has fewer than 2 n nodes; more steps mean a cycle.
    for _ in 0..2 * MAX_LOBES {
        match open.pop() {
            Some(Some(Material::Blend { weight, a, b, .. })) => {
                textured |= matches!(weight, ScalarParam::Texture(_));
                open.extend([by_entity.get(a).copied(), by_entity.get(b).copied()]);
            }
            Some(Some(plain)) => {
                lobes += plain.n_lobes();
                glowing += u32::from(emits(plain));
            }
            Some(None) => lobes += 1,
            None => break,
        }
    }
    open.is_empty() && lobes <= MAX_LOBES && (glowing == 0 || glowing == 1 && !textured)
}

/// Each texture once, however many materials use it.
#[derive(Default)]
struct TextureTable {
    ids: HashMap<usize, TextureId>,
    textures: Vec<render::Texture>,
}

impl TextureTable {
    fn id(&mut self, texture: &Arc<SurfaceTexture>) -> TextureId {
        *self.ids.entry(address(texture)).or_insert_with(|| {
            self.textures.push(texture.texture.clone());
            (self.textures.len() - 1) as TextureId
        })
    }
}
