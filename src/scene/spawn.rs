//! From a loaded scene to entities.

use crate::format::animation::AnimationPart;
use crate::format::camera::{camera, unit};
use crate::format::film_size::FilmSize;
use crate::format::light::LightKind;
use crate::format::material_textures::without_lost_textures;
use crate::format::parts::{InFile, LightPart, MaterialPart, ObjectPart};
use crate::format::placement::Placement;
use crate::format::sources::{EnvironmentSource, MeshSource, TextureSource};
use crate::format::units::radians;
use crate::format::value::{ColorValue, ScalarValue};
use crate::format::view::View;
use crate::render::{Environment, ImageTexture, MapParams, RenderSettings, Texture, TexturePattern};
use crate::scene::animation::Animation;
use crate::scene::animation::edited::Edited;
use crate::scene::animation::edited::shown_camera;
use crate::scene::animation::moment::{Moment, show_first};
use crate::scene::animation::written::{Entities, model_of, of_part};
use crate::scene::loaded::LoadedScene;
use crate::scene::world::components::{
    ColorParam, DisplaySettings, Hidden, InWorld, MaterialSlots, MeshOrigin, Ordinal, Rendering, ScalarParam,
    SceneEnvironment, Shape, SurfaceMaterial, SurfaceTexture,
};
use crate::scene::world::inputs::SceneInputs;
use crate::scene::world::lights::{LightTexture, WithLight, put_light};
use bevy_ecs::name::Name;
use bevy_ecs::prelude::{Entity, Or, With, World};
use glam::{DVec2, DVec3, Mat2, Vec2, Vec3};
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// The entities of parts that were added to a scene, in the order of their file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AddedParts {
    /// Its materials, also those that were there already.
    pub materials: Vec<Entity>,
    /// Its objects.
    pub objects: Vec<Entity>,
    /// Its lights that are no objects.
    pub lights: Vec<Entity>,
}

impl LoadedScene {
    /// Replaces the scene in `world`, if any, by this one. The seed of [`Rendering`] stays unless an opened image
    /// brings its own.
    pub fn spawn(&self, world: &mut World) {
        clear(world);
        let mut ordinals = (0..).map(Ordinal);
        let mut next = move || ordinals.next().expect("fewer entities than numbers");
        let (entities, _) = self.spawn_parts(world, HashMap::new(), &mut next);
        let (view, projection, lens) = camera(&shown_camera(&self.file));
        world.spawn((view, projection, lens, Name::new("camera"), next()));
        self.put_environment(world);
        self.put_settings(world);
        self.animate(world, &entities);
    }

    /// Adds its materials, objects and lights to the scene in `world`, behind all that is there. A material that has the
    /// name of one of the world is not added: that one is used.
    pub fn add_to(&self, world: &mut World) -> AddedParts {
        let known: HashMap<String, Entity> = world
            .query_filtered::<(Entity, &Name), With<SurfaceMaterial>>()
            .iter(world)
            .map(|(entity, name)| (name.as_str().to_owned(), entity))
            .collect();
        let names = self.file.materials.names();
        let known = names.filter_map(|name| Some((name, *known.get(name)?))).collect();
        self.add(world, known)
    }

    /// Like [`Self::add_to`], with materials of its own, whatever their names: those of its meshes are among them.
    pub fn add_anew(&self, world: &mut World) -> AddedParts {
        let mut added = self.add(world, HashMap::new());
        for &object in &added.objects {
            let slots = world.get::<MaterialSlots>(object).map(|slots| slots.0.clone()).unwrap_or_default();
            added.materials.extend(slots);
        }
        let mut seen = HashSet::new();
        added.materials.retain(|material| seen.insert(*material));
        added
    }

    fn add<'a>(&'a self, world: &mut World, known: HashMap<&'a str, Entity>) -> AddedParts {
        let last = world.query::<&Ordinal>().iter(world).max().map_or(0, |Ordinal(last)| last + 1);
        let mut ordinals = (last..).map(Ordinal);
        let mut next = move || ordinals.next().expect("fewer entities than numbers");
        let (entities, objects) = self.spawn_parts(world, known, &mut next);
        let materials = self.file.materials.names().map(|name| entities.materials[name]).collect();
        AddedParts { materials, objects, lights: entities.all_lights }
    }

    /// Sets the camera of the scene in `world` to its own.
    pub fn put_camera(&self, world: &mut World) {
        let components = camera(&self.file.camera);
        match SceneInputs::of(world).camera {
            Some(old) => drop(world.entity_mut(old.entity).insert(components)),
            None => drop(world.spawn((components, Name::new("camera")))),
        }
    }

    /// - `materials`: those that are there already.
    fn spawn_parts<'a>(
        &'a self,
        world: &mut World,
        mut materials: HashMap<&'a str, Entity>,
        next: &mut impl FnMut() -> Ordinal,
    ) -> (Entities<'a>, Vec<Entity>) {
        let (mut textures, mut lost): (HashMap<&str, Arc<SurfaceTexture>>, HashMap<&str, Vec3>) = Default::default();
        let own_textures = self.meshes.iter().flatten().flat_map(|mesh| &mesh.textures);
        for (name, part) in self.file.textures.iter().chain(own_textures.map(|(name, part, _)| (name.as_str(), part))) {
            if let Some(texture) = texture_of(part, |file| self.pictures.get(file).cloned()) {
                let texture = SurfaceTexture { name: name.to_owned(), part: part.clone(), texture };
                textures.entry(name).or_insert_with(|| Arc::new(texture));
            } else {
                lost.insert(name, part.factor());
            }
        }

        // Entities are created first, so that blends can refer to later materials.
        let added: Vec<_> = self.file.materials.iter().filter(|(name, _)| !materials.contains_key(name)).collect();
        for (name, _) in &added {
            materials.insert(name, world.spawn((Name::new((*name).to_owned()), next())).id());
        }
        for (name, part) in added {
            world.entity_mut(materials[name]).insert(material(part, &textures, &lost, &materials));
        }

        let mut own_materials: HashMap<usize, Vec<Entity>> = HashMap::new();
        let mut objects: HashMap<&str, Entity> = HashMap::new();
        let (mut all_objects, mut meshes) = (Vec::new(), Vec::new());
        for (i, object) in self.file.objects.iter().enumerate() {
            let slots = match (object.material(), &self.meshes[i]) {
                _ if object.slot_materials().is_some() => {
                    object.slot_materials().into_iter().flatten().map(|name| materials[name.as_str()]).collect()
                }
                (Some(name), _) => vec![materials[name]],
                (None, Some(mesh)) => own_materials
                    .entry(Arc::as_ptr(&mesh.mesh) as usize)
                    .or_insert_with(|| {
                        let spawn = |(name, part): &(String, MaterialPart)| {
                            let material = material(part, &textures, &lost, &materials);
                            world.spawn((Name::new(name.clone()), next(), material)).id()
                        };
                        mesh.slots.iter().map(spawn).collect()
                    })
                    .clone(),
                (None, None) => Vec::new(),
            };
            let (shape, placement) = self.shape(i, object);
            let mut entity = world.spawn((shape, placement, MaterialSlots(slots), next()));
            all_objects.push(entity.id());
            if object.is_hidden() {
                entity.insert(Hidden);
            }
            if let Some(name) = object.name() {
                entity.insert(Name::new(name.to_owned()));
                objects.insert(name, entity.id());
            }
            if let ObjectPart::Mesh { source: MeshSource::Gltf { .. }, .. } = object {
                meshes.push(entity.id());
            }
            if let ObjectPart::Mesh { source, material, materials, .. } = object {
                entity.insert(MeshOrigin {
                    source: source.clone(),
                    options: object.mesh_options().unwrap_or_default(),
                    own_materials: material.is_none() && materials.is_none(),
                });
            }
        }
        let mut entities = Entities { objects, materials, meshes, ..Entities::default() };
        for part in &self.file.lights {
            let (light, placement) = LightKind::from_part(part);
            let mut entity = world.spawn((placement, next()));
            if part.is_hidden() {
                entity.insert(Hidden);
            }
            if let Some(name) = part.name() {
                entity.insert(Name::new(name.to_owned()));
            }
            if let LightPart::Spot { texture: Some(name), .. } = part
                && let Some(texture) = textures.get(name.as_str())
            {
                entity.insert(LightTexture(texture.clone()));
            }
            let entity = entity.id();
            put_light(world, entity, light);
            entities.lights.extend(part.name().map(|name| (name, entity)));
            entities.all_lights.push(entity);
        }
        (entities, all_objects)
    }

    /// Adds the animation of the file and sets the time that the file specifies.
    fn animate(&self, world: &mut World, entities: &Entities) {
        let part = &self.file.animation;
        let model = self.motion.as_ref().map(|motion| model_of(motion, part.model.as_ref(), entities));
        let animation = Animation { model, ..of_part(part, &self.file.camera, entities) };
        if part.model.is_none() && animation.has_model() {
            world.insert_resource(animation);
            // It is loaded at this moment.
            world.insert_resource(Moment(self.choice.at.unwrap_or_default()));
            return;
        }
        if *part == AnimationPart::default() {
            world.remove_resource::<Animation>();
            world.insert_resource(Moment::default());
            return;
        }
        let edited = Edited::of_part(&part.edited, entities);
        let shown = animation.without(&edited);
        show_first(world, animation, &shown, part.at);
    }

    /// Sets the environment of the scene in `world` to its own.
    pub fn put_environment(&self, world: &mut World) {
        let file = &self.file;
        world.insert_resource(SceneEnvironment {
            light: self.environment(),
            part: file.environment.clone(),
            air: file.air.0,
        });
    }

    /// Sets size, filter, integrator, depth and display of the scene in `world` to its own.
    pub fn put_settings(&self, world: &mut World) {
        let file = &self.file;
        world.insert_resource(FilmSize { width: file.film.width, height: file.film.height });
        let of_world = world.get_resource::<Rendering>().map(|rendering| rendering.0).unwrap_or_default();
        let (seed, allocation) = match &self.shot {
            Some(shot) => (shot.seed, shot.allocation),
            None => (of_world.seed, of_world.allocation),
        };
        world.insert_resource(Rendering(RenderSettings {
            integrator: file.integrator,
            max_depth: file.max_depth.unwrap_or(u32::MAX),
            seed,
            filter: file.film.filter,
            allocation,
            ..RenderSettings::default()
        }));
        world.insert_resource(DisplaySettings(file.display));
    }

    fn environment(&self) -> Environment {
        match &self.file.environment {
            EnvironmentSource::Black => Environment::Black,
            EnvironmentSource::Constant(radiance) => Environment::Constant(radiance.0),
            EnvironmentSource::Gradient { zenith, horizon, ground } => {
                Environment::Gradient { zenith: zenith.0, horizon: horizon.0, ground: ground.0 }
            }
            EnvironmentSource::Image { file, scale, rotate, .. } => match self.environment_image(file) {
                Some(image) => Environment::Image { image: image.clone(), scale: scale.0, rotation: radians(*rotate) },
                None => Environment::Black,
            },
            part @ EnvironmentSource::Sky { .. } => {
                self.environment_image.clone().map_or(Environment::Black, |image| sky_light(part, image))
            }
        }
    }

    fn environment_image(&self, file: &str) -> Option<&Arc<ImageTexture>> {
        self.environment_image.as_ref().or_else(|| self.pictures.get(file))
    }

    /// The surface of an object and its placement.
    fn shape(&self, i: usize, object: &ObjectPart) -> (Shape, Placement) {
        let placement = Placement::from_part(object.transform());
        // Shapes with a position are stored relative to it, so that rotating the object keeps it in place.
        // What has a point of its own turns about it.
        let at = |point: DVec3| match point == DVec3::ZERO {
            true => placement,
            false => {
                Placement { linear: placement.linear, ..Placement::at(placement.affine().transform_point3(point)) }
            }
        };
        match object {
            ObjectPart::Sphere { center, radius, .. } => (Shape::Sphere { radius: *radius }, at(*center)),
            ObjectPart::Plane { point, normal, .. } => (Shape::Plane { normal: unit(*normal) }, at(*point)),
            ObjectPart::Quad { corner, edge_u, edge_v, .. } => {
                (Shape::Quad { edge_u: *edge_u, edge_v: *edge_v }, at(*corner))
            }
            ObjectPart::Triangle { vertices, .. } => {
                let first = vertices[0];
                (Shape::Triangle { vertices: vertices.map(|vertex| vertex - first) }, at(first))
            }
            ObjectPart::Mesh { .. } => {
                let mesh = self.meshes[i].as_ref().expect("every mesh object has been loaded");
                (Shape::Mesh(mesh.mesh.clone()), placement)
            }
            ObjectPart::BallGrid { .. } | ObjectPart::Spheres { .. } => {
                (Shape::Spheres(self.balls[i].clone().expect("every cloud has been made")), placement)
            }
        }
    }
}

/// The texture that a scene file describes; `None` if `picture`, which is called with the path of its image, returns
/// `None`.
pub fn texture_of(part: &TextureSource, picture: impl FnOnce(&str) -> Option<Arc<ImageTexture>>) -> Option<Texture> {
    let placed = |pattern, scale: DVec2, offset: DVec2, rotate| Texture {
        uv_matrix: Mat2::from_diagonal(as_vec2(scale)) * Mat2::from_angle(radians(rotate)),
        uv_offset: as_vec2(offset),
        ..Texture::new(pattern)
    };
    Some(match part {
        TextureSource::Checker { a, b, squares, offset, rotate } => {
            placed(TexturePattern::Checker { a: a.0, b: b.0 }, *squares, *offset, *rotate)
        }
        &TextureSource::Image {
            ref file,
            stretch,
            repeat,
            offset,
            rotate,
            wrap,
            wrap_v,
            smooth,
            encoding,
            channel,
            tint,
            invert,
            uv_set,
            vertex_colors,
            relief,
        } => {
            let (image, wrap) = (picture(file)?, [wrap, wrap_v.unwrap_or(wrap)]);
            let pattern = TexturePattern::Image { image, encoding, wrap, smooth };
            let placed = placed(pattern, repeat, offset, rotate);
            let uv_matrix = placed.uv_matrix * Mat2::from_diagonal(as_vec2(stretch));
            Texture { channel, tint: tint.0, invert, uv_set, vertex_colors, relief, uv_matrix, ..placed }
        }
        TextureSource::VertexColors { channel, tint } => {
            Texture { channel: *channel, tint: tint.0, vertex_colors: true, ..Texture::new(TexturePattern::White) }
        }
    })
}

/// The environment of a clear sky; `image`: [`clear_sky`](crate::import::sky::clear_sky).
pub fn sky_light(part: &EnvironmentSource, image: Arc<ImageTexture>) -> Environment {
    match part {
        // The sun is above the middle of the image, and turning is counter-clockwise.
        EnvironmentSource::Sky { azimuth, scale, .. } => {
            Environment::Image { image, scale: scale.0, rotation: -radians(*azimuth) }
        }
        _ => Environment::Black,
    }
}

/// Removes all entities of the current scene.
fn clear(world: &mut World) {
    type OfAScene = Or<(With<Shape>, With<SurfaceMaterial>, WithLight, With<View>)>;
    let old: Vec<Entity> = world.query_filtered::<Entity, OfAScene>().iter(world).collect();
    for entity in old {
        world.despawn(entity);
    }
}

/// Converts a material of a scene file for the world.
///
/// - `lost`: the factors of textures that are missing, white for none.
pub(super) fn material(
    part: &MaterialPart,
    textures: &HashMap<&str, Arc<SurfaceTexture>>,
    lost: &HashMap<&str, Vec3>,
    materials: &HashMap<&str, Entity>,
) -> SurfaceMaterial {
    let lost = |name: &str| lost.get(name).copied().unwrap_or(Vec3::ONE);
    let part = without_lost_textures(part, |name| (!textures.contains_key(name)).then(|| lost(name)));
    SurfaceMaterial(part.map(&mut FileToWorld { textures, materials }))
}

/// The textures and materials of a file by name.
struct FileToWorld<'a> {
    textures: &'a HashMap<&'a str, Arc<SurfaceTexture>>,
    materials: &'a HashMap<&'a str, Entity>,
}

impl FileToWorld<'_> {
    fn texture(&self, name: &str) -> Arc<SurfaceTexture> {
        self.textures.get(name).expect("lost textures have been replaced").clone()
    }
}

impl MapParams<InFile, InWorld> for FileToWorld<'_> {
    fn color(&mut self, color: &ColorValue) -> ColorParam {
        match color {
            ColorValue::Rgb(rgb) => ColorParam::Rgb(*rgb),
            ColorValue::Texture(name) => ColorParam::Texture(self.texture(name)),
        }
    }

    fn scalar(&mut self, scalar: &ScalarValue) -> ScalarParam {
        match scalar {
            ScalarValue::Number(value) => ScalarParam::Number(*value),
            ScalarValue::Texture(name) => ScalarParam::Texture(self.texture(name)),
        }
    }

    fn material(&mut self, name: &String) -> Entity {
        self.materials[name.as_str()]
    }
}

fn as_vec2(value: DVec2) -> Vec2 {
    value.as_vec2()
}
