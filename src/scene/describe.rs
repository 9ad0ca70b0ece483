//! From entities back to a scene file: the inverse of `spawn`.
//!
//! The description is exact: spawning it gives equal components in the same order. Scene files cannot express three
//! things: meshes that came from no file are listed, to be written beside the scene; groups of spheres made by a
//! program are listed sphere by sphere; surfaces without a material get a grey one. Comments and formatting of the
//! original file are lost.

use crate::files::relative::path_to_text;
use crate::format::camera::{camera, camera_part};
use crate::format::film_size::FilmSize;
use crate::format::material_textures::without_lost_textures;
use crate::format::names::Names;
use crate::format::parts::{FilmPart, InFile, LightPart, MaterialPart, ObjectPart, RadiiPart, TransformPart};
use crate::format::placement::Placement;
use crate::format::scene_file::SceneFile;
use crate::format::sources::{EnvironmentSource, MeshOptions, MeshSource, TextureSource};
use crate::format::units::radians;
use crate::format::value::Named;
use crate::format::value::{ColorValue, Rgb, ScalarValue, hex_color};
use crate::import::meshes::LoadedMesh;
use crate::mesh::Mesh;
use crate::render::{Environment, MapParams};
use crate::scene::animation::Animation;
use crate::scene::animation::described::Moved;
use crate::scene::animation::moment::Moment;
use crate::scene::loaded::LoadedScene;
use crate::scene::texture_names::ByTextureName;
use crate::scene::world::components::{
    Balls, ColorParam, DisplaySettings, GREY, Hidden, InWorld, Material, MeshOrigin, Ordinal, Rendering, ScalarParam,
    SceneEnvironment, Shape, SurfaceMaterial, SurfaceTexture,
};
use crate::scene::world::inputs::SceneInputs;
use crate::scene::world::lights::LightTexture;
use crate::scene::world::trees::address;
use bevy_ecs::name::Name;
use bevy_ecs::prelude::{Entity, World};
use glam::{DVec3, Vec3};
use std::collections::{HashMap, HashSet};
use std::path::PathBuf;
use std::sync::Arc;

/// A scene file for a world, with the data that it refers to.
#[derive(Clone, Debug)]
pub struct Description {
    /// Paths are relative to [`folder`](Self::folder).
    pub file: SceneFile,
    /// The folder that `file` is to be saved in.
    pub folder: PathBuf,
    /// Meshes that came from no file: index of the object, whose `source` has an empty name, and the mesh.
    pub loose_meshes: Vec<(usize, Arc<Mesh>)>,
    /// What could not be expressed.
    pub losses: Vec<String>,
}

impl Description {
    /// Describes the contents of `world`; `loaded`: the scene that was opened into it, if any.
    pub fn of(world: &mut World, loaded: Option<&LoadedScene>) -> Self {
        Self::with_textures(world, loaded, false).0
    }

    /// The same with the textures in use and their names.
    ///
    /// - `names_all`: whether materials that come with the file of a mesh are named as well.
    pub(super) fn with_textures(
        world: &mut World,
        loaded: Option<&LoadedScene>,
        names_all: bool,
    ) -> (Self, Vec<(Arc<SurfaceTexture>, String)>) {
        let inputs = SceneInputs::of(world).with_hidden();
        let mut writer = Writer { names_all, ..Writer::new(loaded) };
        let animation = world.get_resource::<Animation>().cloned();
        let moved = Moved::of(animation.as_ref(), &inputs);
        let objects = writer.objects(world, &inputs, &moved);
        writer.name_materials(world, &objects, &moved);
        let parts = objects.iter().map(|object| writer.object(object)).collect();
        let materials = writer.materials();
        let at = world.get_resource::<Moment>().copied().unwrap_or_default().0;
        let animation_part = animation.as_ref().map_or_else(Default::default, |animation| {
            moved.part((animation, at), (world, &inputs), &writer.names, &mut writer.losses)
        });
        if animation.is_none() && loaded.is_some_and(|it| it.model_length().is_some()) {
            let loss =
                "the scene keeps the stored pose of the model, not its animation: show a moment of it to keep both";
            writer.losses.push(loss.to_owned());
        }
        let environment = writer.environment(&inputs.environment);
        let rendering = world.get_resource::<Rendering>().copied().unwrap_or_default().0;
        let FilmSize { width, height } = world.get_resource::<FilmSize>().copied().unwrap_or_default();
        let display = world.get_resource::<DisplaySettings>().copied().unwrap_or_default().0;
        let lights = inputs.lights.iter().map(|light| {
            let name = moved.name(light.entity).cloned().or_else(|| light.name.clone());
            let mut part = light.light.to_part(name, is_hidden(world, light.entity), &light.placement);
            if let (LightPart::Spot { texture, .. }, Some(LightTexture(image))) = (&mut part, &light.texture) {
                *texture = Some(writer.texture_name(image));
            }
            part
        });
        let lights = lights.collect();
        let (view, projection, lens) =
            inputs.camera.map_or_else(Default::default, |camera| (camera.view, camera.projection, camera.lens));
        let file = SceneFile {
            camera: match &animation {
                // The one that the tracks move; the one that is shown, if it is another one, is in `animation`.
                Some(animation) if animation.has_camera_track() => animation.camera.clone(),
                Some(animation) => {
                    let (kept, then) = (&animation.camera, animation.camera_at(at));
                    let is_kept = camera(kept) == (view, projection, lens);
                    camera_part(&view, &projection, &lens, Some(if is_kept { kept } else { &then }))
                }
                None => camera_part(&view, &projection, &lens, loaded.map(|loaded| &loaded.file.camera)),
            },
            cameras: loaded.map(|loaded| loaded.file.cameras.clone()).unwrap_or_default(),
            film: FilmPart { width, height, filter: rendering.filter },
            integrator: rendering.integrator,
            max_depth: (rendering.max_depth < u32::MAX).then_some(rendering.max_depth),
            display,
            environment,
            air: Rgb(inputs.environment.air),
            textures: writer.textures(),
            materials,
            objects: parts,
            lights,
            animation: animation_part,
        };
        let folder = loaded.map(|loaded| loaded.folder.clone()).unwrap_or_default();
        (Self { file, folder, loose_meshes: writer.loose_meshes, losses: writer.losses }, writer.textures)
    }
}

/// An object with its components.
struct DescribedItem {
    name: Option<String>,
    hidden: bool,
    shape: Shape,
    placement: Placement,
    slots: Vec<Entity>,
    origin: Option<MeshOrigin>,
    /// Whether its materials are those of the file of its mesh.
    own: bool,
}

#[derive(Default)]
struct Writer<'a> {
    loaded: Option<&'a LoadedScene>,
    /// Whether materials that come with the file of a mesh are named as well.
    names_all: bool,
    /// Loaded meshes and groups of spheres by address, and textures by name.
    loaded_meshes: HashMap<usize, &'a LoadedMesh>,
    loaded_balls: HashMap<usize, &'a ObjectPart>,
    loaded_textures: HashMap<&'a str, &'a TextureSource>,
    /// All materials with a name, in order.
    named: Vec<(Entity, String, Material)>,
    names: HashMap<Entity, String>,
    /// Name of the grey material, if anything uses it.
    grey: Option<String>,
    /// Textures in use, in the order of first use.
    textures: Vec<(Arc<SurfaceTexture>, String)>,
    /// Their names by address.
    texture_names: HashMap<usize, String>,
    taken_by_textures: Names,
    loose_meshes: Vec<(usize, Arc<Mesh>)>,
    n_objects: usize,
    losses: Vec<String>,
}

impl<'a> Writer<'a> {
    fn new(loaded: Option<&'a LoadedScene>) -> Self {
        let mut writer = Self { loaded, ..Self::default() };
        let Some(loaded) = loaded else { return writer };
        for mesh in loaded.meshes.iter().flatten() {
            writer.loaded_meshes.entry(address(&mesh.mesh)).or_insert(mesh);
        }
        for (balls, object) in loaded.balls.iter().zip(&loaded.file.objects) {
            if let Some(balls) = balls {
                writer.loaded_balls.entry(address(balls)).or_insert(object);
            }
        }
        writer.loaded_textures = loaded.file.textures.iter().collect();
        writer
    }

    fn objects(&self, world: &mut World, inputs: &SceneInputs, moved: &Moved) -> Vec<DescribedItem> {
        let item = |object: &crate::scene::world::inputs::ObjectInput| {
            let origin = world.get::<MeshOrigin>(object.entity).cloned();
            let own = !self.names_all
                && origin.as_ref().is_some_and(|origin| origin.own_materials)
                && !object.slots.iter().any(|&slot| moved.has_material(slot))
                && self.has_own_materials(world, &object.shape, &object.slots);
            DescribedItem {
                name: moved.name(object.entity).or(object.name.as_ref()).filter(|name| !name.is_empty()).cloned(),
                hidden: is_hidden(world, object.entity),
                shape: object.shape.clone(),
                placement: object.placement,
                slots: object.slots.clone(),
                origin,
                own,
            }
        };
        inputs.objects.iter().map(item).collect()
    }

    /// Whether the slots of a mesh still hold the materials of its file.
    fn has_own_materials(&self, world: &World, shape: &Shape, slots: &[Entity]) -> bool {
        let Shape::Mesh(mesh) = shape else { return false };
        let Some(loaded) = self.loaded else { return false };
        let Some(known) = self.loaded_meshes.get(&address(mesh)) else { return false };
        let sources: HashMap<&str, &TextureSource> =
            known.textures.iter().map(|(name, source, _)| (name.as_str(), source)).collect();
        let lost = |name: &str| match sources.get(name) {
            Some(source @ TextureSource::Image { file, .. }) => {
                (!loaded.pictures.contains_key(file)).then(|| source.factor())
            }
            Some(_) => None,
            None => Some(Vec3::ONE),
        };
        let same = |written: &MaterialPart, now: &Material| {
            without_lost_textures(written, lost) == now.map(&mut ByTextureName(&sources))
        };
        known.slots.len() == slots.len()
            && known.slots.iter().zip(slots).all(|((name, part), slot)| {
                world.get::<SurfaceMaterial>(*slot).is_some_and(|now| same(part, &now.0))
                    && world.get::<Name>(*slot).is_some_and(|now| now.as_str() == name)
            })
    }

    /// Gives each material a unique name, except those that come with the file of a mesh.
    fn name_materials(&mut self, world: &mut World, objects: &[DescribedItem], moved: &Moved) {
        let own: HashSet<Entity> = objects.iter().filter(|item| item.own).flat_map(|item| item.slots.clone()).collect();
        let mut needed: HashSet<Entity> =
            objects.iter().filter(|item| !item.own).flat_map(|item| item.slots.clone()).collect();
        let mut all: Vec<_> = world
            .query::<(Entity, Option<&Ordinal>, Option<&Name>, &SurfaceMaterial)>()
            .iter(world)
            .map(|(entity, rank, name, material)| {
                let name = name.map_or_else(String::new, |name| name.as_str().to_owned());
                (rank.map_or(u32::MAX, |rank| rank.0), entity, name, material.0.clone())
            })
            .collect();
        all.sort_by_key(|(rank, entity, ..)| (*rank, *entity));
        for (.., material) in &all {
            if let Material::Blend { a, b, .. } = material {
                needed.extend([*a, *b]);
            }
        }
        let mut taken = Names::default();
        for (_, entity, name, material) in all {
            if own.contains(&entity) && !needed.contains(&entity) && !moved.has_material(entity) {
                continue;
            }
            let name = taken.free(if name.is_empty() { "material" } else { &name });
            self.names.insert(entity, name.clone());
            self.named.push((entity, name, material));
        }
    }

    /// The name of a material, or of the grey one.
    fn material_name(&mut self, entity: Option<Entity>) -> String {
        if let Some(name) = entity.and_then(|entity| self.names.get(&entity)) {
            return name.clone();
        }
        let names = &self.names;
        let new = || Names::taken(names.values().cloned()).free("grey");
        self.grey.get_or_insert_with(new).clone()
    }

    fn materials(&mut self) -> Named<MaterialPart> {
        let named = std::mem::take(&mut self.named);
        let mut parts: Named<MaterialPart> =
            named.into_iter().map(|(_, name, material)| (name, material.map(self))).collect();
        if let Some(grey) = self.grey.clone() {
            parts.0.insert(grey, GREY.map(self));
        }
        parts
    }

    fn texture_name(&mut self, texture: &Arc<SurfaceTexture>) -> String {
        if let Some(name) = self.texture_names.get(&address(texture)) {
            return name.clone();
        }
        // Unused names of the file stay taken, since they are written too.
        if self.loaded_textures.get(&*texture.name).is_some_and(|part| **part != texture.part) {
            self.taken_by_textures.take(&texture.name);
        }
        let name = match &*texture.name {
            "" => self.taken_by_textures.free("texture"),
            // A scene file would read a colour.
            name if hex_color(name).is_some() => self.taken_by_textures.free(&format!("texture {name}")),
            name => self.taken_by_textures.free(name),
        };
        self.textures.push((texture.clone(), name.clone()));
        self.texture_names.insert(address(texture), name.clone());
        name
    }

    /// The textures of the file in its order, used or not, then all others.
    fn textures(&self) -> Named<TextureSource> {
        let mut textures = self.loaded.map(|loaded| loaded.file.textures.clone()).unwrap_or_default();
        for (texture, name) in &self.textures {
            if !self.loaded_textures.contains_key(&**name) {
                textures.0.insert(name.clone(), self.with_path_from_folder(texture));
            }
        }
        textures
    }

    /// The textures of a mesh's own materials have paths relative to the working directory: makes them absolute.
    fn with_path_from_folder(&self, texture: &SurfaceTexture) -> TextureSource {
        let mut part = texture.part.clone();
        if let TextureSource::Image { file, .. } = &mut part {
            let from_mesh = self.loaded.and_then(|loaded| {
                let textures = loaded.meshes.iter().flatten().flat_map(|mesh| &mesh.textures);
                let names_it =
                    |source: &TextureSource| matches!(source, TextureSource::Image { file: of, .. } if of == file);
                textures.clone().find(|(_, source, _)| names_it(source)).map(|(.., path)| path.clone())
            });
            if let Some(path) = from_mesh.and_then(|path| std::path::absolute(path).ok()) {
                *file = path_to_text(&path);
            }
        }
        part
    }

    fn environment(&mut self, SceneEnvironment { light, part, .. }: &SceneEnvironment) -> EnvironmentSource {
        let written = match part {
            EnvironmentSource::Image { rotate, .. } => Some(*rotate),
            EnvironmentSource::Sky { azimuth, .. } => Some(-azimuth),
            _ => None,
        };
        let angle_deg = match light {
            // The image was not found.
            Environment::Black if matches!(part, EnvironmentSource::Image { .. }) => return part.clone(),
            Environment::Image { .. } if written.is_none() => {
                self.losses.push("the image around the scene came from no file and is left out".to_owned());
                return EnvironmentSource::Black;
            }
            Environment::Image { rotation, .. } if written.map(radians) != Some(*rotation) => {
                Some(f64::from(*rotation).to_degrees())
            }
            _ => None,
        };
        environment_part(light, part, angle_deg)
    }

    fn object(&mut self, item: &DescribedItem) -> ObjectPart {
        let index = self.n_objects;
        self.n_objects += 1;
        let (name, hidden) = (item.name.clone(), item.hidden);
        // Shapes with a position of their own need no transform if they are neither rotated nor scaled.
        let plain = item.placement == Placement::at(item.placement.translation);
        let (point, transform) = match plain {
            true => (item.placement.translation, TransformPart::default()),
            false => (DVec3::ZERO, item.placement.to_part()),
        };
        let whole = item.placement.to_part();
        match &item.shape {
            Shape::Sphere { radius } => {
                let material = self.material_name(item.slots.first().copied());
                ObjectPart::Sphere { name, hidden, center: point, radius: *radius, material, transform }
            }
            Shape::Plane { normal } => {
                let material = self.material_name(item.slots.first().copied());
                ObjectPart::Plane { name, hidden, point, normal: *normal, material, transform }
            }
            Shape::Quad { edge_u, edge_v } => {
                let material = self.material_name(item.slots.first().copied());
                ObjectPart::Quad { name, hidden, corner: point, edge_u: *edge_u, edge_v: *edge_v, material, transform }
            }
            // Its vertices are relative to the first, so that a transform moves it without rounding.
            Shape::Triangle { vertices } => {
                let material = self.material_name(item.slots.first().copied());
                ObjectPart::Triangle { name, hidden, vertices: *vertices, material, transform: whole }
            }
            Shape::Spheres(balls) => {
                let material = self.material_name(item.slots.first().copied());
                self.cloud((name, hidden), balls, material, whole)
            }
            Shape::Mesh(mesh) => self.mesh(index, item, mesh),
        }
    }

    fn cloud(
        &self,
        (name, hidden): (Option<String>, bool),
        balls: &Arc<Balls>,
        material: String,
        transform: TransformPart,
    ) -> ObjectPart {
        match self.loaded_balls.get(&address(balls)) {
            Some(ObjectPart::BallGrid { first, steps, radius, .. }) => {
                let (first, steps, radius) = (*first, steps.clone(), *radius);
                ObjectPart::BallGrid { name, hidden, first, steps, radius, material, transform }
            }
            Some(ObjectPart::Spheres { centers, radii, .. }) => {
                let (centers, radii) = (centers.clone(), radii.clone());
                ObjectPart::Spheres { name, hidden, centers, radii, material, transform }
            }
            _ => {
                let centers = balls.centers.iter().map(|center| center.as_dvec3() + balls.center).collect();
                let radii = RadiiPart::Each(balls.radii.iter().map(|&radius| f64::from(radius)).collect());
                ObjectPart::Spheres { name, hidden, centers, radii, material, transform }
            }
        }
    }

    fn mesh(&mut self, index: usize, item: &DescribedItem, mesh: &Arc<Mesh>) -> ObjectPart {
        let file_has_materials = self.loaded_meshes.get(&address(mesh)).is_some_and(|known| !known.slots.is_empty());
        let (material, materials) = match &item.slots[..] {
            _ if item.own => (None, None),
            [] if !file_has_materials && !self.names_all => (None, None),
            [] => (Some(self.material_name(None)), None),
            [slot] => (Some(self.material_name(Some(*slot))), None),
            slots => (None, Some(slots.iter().map(|slot| self.material_name(Some(*slot))).collect())),
        };
        let (source, options) = match &item.origin {
            Some(origin) => (origin.source.clone(), origin.options),
            None => {
                self.loose_meshes.push((index, mesh.clone()));
                (MeshSource::Obj(String::new()), MeshOptions::default())
            }
        };
        let (name, hidden, transform) = (item.name.clone(), item.hidden, item.placement.to_part());
        let MeshOptions { shading, texture_coordinates, simplify } = options;
        ObjectPart::Mesh {
            name,
            hidden,
            source,
            shading,
            texture_coordinates,
            simplify,
            material,
            materials,
            transform,
        }
    }
}

impl MapParams<InWorld, InFile> for Writer<'_> {
    fn color(&mut self, color: &ColorParam) -> ColorValue {
        match color {
            ColorParam::Rgb(rgb) => ColorValue::Rgb(*rgb),
            ColorParam::Texture(texture) => ColorValue::Texture(self.texture_name(texture)),
        }
    }

    fn scalar(&mut self, scalar: &ScalarParam) -> ScalarValue {
        match scalar {
            ScalarParam::Number(value) => ScalarValue::Number(*value),
            ScalarParam::Texture(texture) => ScalarValue::Texture(self.texture_name(texture)),
        }
    }

    fn material(&mut self, material: &Entity) -> String {
        self.material_name(Some(*material))
    }
}

/// Describes the environment for a scene file; an image keeps its file, and its rotation as written unless there is a
/// new one.
pub(crate) fn environment_part(
    light: &Environment,
    old: &EnvironmentSource,
    angle_deg: Option<f64>,
) -> EnvironmentSource {
    match (light, old) {
        (Environment::Black, _) => EnvironmentSource::Black,
        (Environment::Constant(radiance), _) => EnvironmentSource::Constant(Rgb(*radiance)),
        (Environment::Gradient { zenith, horizon, ground }, _) => {
            EnvironmentSource::Gradient { zenith: Rgb(*zenith), horizon: Rgb(*horizon), ground: Rgb(*ground) }
        }
        (Environment::Image { scale, .. }, EnvironmentSource::Image { file, rotate, layout, axes, .. }) => {
            let (file, scale, rotate) = (file.clone(), Rgb(*scale), angle_deg.unwrap_or(*rotate));
            EnvironmentSource::Image { file, scale, rotate, layout: *layout, axes: *axes }
        }
        (Environment::Image { scale, .. }, old) => {
            let mut part = old.clone();
            if let EnvironmentSource::Sky { azimuth, scale: factor, .. } = &mut part {
                (*factor, *azimuth) = (Rgb(*scale), angle_deg.map_or(*azimuth, |angle| -angle));
            }
            part
        }
    }
}

fn is_hidden(world: &World, entity: Entity) -> bool {
    world.get::<Hidden>(entity).is_some()
}
