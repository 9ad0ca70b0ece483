//! A scene: the one of the library behind a lock, so that Python's threads may share it.

use crate::arrays::{ImageArray, numbers, placements, points, slots, triangles, vec2s, vec3s, vec4s};
use crate::errors::{input, of_library, of_text};
use crate::image::Image;
use crate::render::{RenderArgs, render};
use firstlight::bevy_ecs::name::Name;
use firstlight::bevy_ecs::prelude::{Entity, With, World};
use firstlight::embed::threads;
use firstlight::glam::DVec3;
use firstlight::mesh::Mesh;
use firstlight::prelude::{FilmSize, MaterialSlots, Placement, SceneSource, Shape, SurfaceMaterial};
use firstlight::render::ImageTexture;
use firstlight::scene::{
    AddedParts, Balls, LoadOptions, LoadedScene, ModelChoice, SceneInputs, UpAxis, WithLight, camera_part, load_text,
};
use pyo3::prelude::*;
use std::collections::HashMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// Images of a text by the paths in it.
type Images = HashMap<String, ImageArray>;

/// Checks a part of a scene.
#[pyfunction]
pub fn check(py: Python<'_>, text: &str, images: Images) -> PyResult<()> {
    parts(py, text, images).map(drop)
}

/// The parts of a text that the package wrote.
fn parts(py: Python<'_>, text: &str, images: Images) -> PyResult<LoadedScene> {
    let image = |(name, image): (String, ImageArray)| Ok((name, Arc::new(image.image()?)));
    let images: HashMap<String, Arc<ImageTexture>> = images.into_iter().map(image).collect::<PyResult<_>>()?;
    let pool = threads(None).map_err(of_library)?;
    let load = || {
        let options = LoadOptions { images: Some(&images), ..LoadOptions::default() };
        load_text(text, Path::new(""), &options)
    };
    let loaded = py.detach(|| pool.install(load)).map_err(of_text)?;
    // A scene that was opened does without a missing image; one that is built wants it.
    match loaded.warnings.first() {
        Some(warning) => Err(input(warning.to_string())),
        None => Ok(loaded),
    }
}

#[pyclass(frozen, module = "firstlight._firstlight")]
pub struct Scene(Mutex<firstlight::Scene>);

impl Scene {
    /// Works on the scene without holding up Python's other threads while it waits for an image.
    fn with<T: Send>(&self, py: Python<'_>, work: impl FnOnce(&mut firstlight::Scene) -> T + Send) -> T {
        py.detach(|| work(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner)))
    }

    fn with_world<T: Send>(&self, py: Python<'_>, work: impl FnOnce(&mut World) -> T + Send) -> T {
        self.with(py, |scene| work(scene.world_mut()))
    }
}

#[pymethods]
impl Scene {
    #[new]
    fn new() -> Self {
        Self(Mutex::new(firstlight::Scene::new()))
    }

    #[staticmethod]
    #[pyo3(signature = (source, up=None, camera=None, at=None, variant=None, environment=None))]
    fn open(
        py: Python<'_>,
        source: OsString,
        up: Option<&str>,
        camera: Option<String>,
        at: Option<f64>,
        variant: Option<String>,
        environment: Option<PathBuf>,
    ) -> PyResult<Self> {
        let up = match up {
            None => None,
            Some("y") => Some(UpAxis::Y),
            Some("z") => Some(UpAxis::Z),
            Some(other) => return Err(input(format!("`up` is {other}, but must be y or z"))),
        };
        let choice = ModelChoice { camera, at, variant, ..ModelChoice::DEFAULT };
        let opened = py.detach(|| {
            let source = SceneSource::parse(source)?;
            let environment = environment.as_deref();
            let options = LoadOptions { up, choice: Some(&choice), environment, ..LoadOptions::default() };
            firstlight::Scene::open_with(&source, &options)
        });
        Ok(Self(Mutex::new(opened.map_err(of_library)?)))
    }

    fn warnings(&self, py: Python<'_>) -> Vec<String> {
        self.with(py, |scene| scene.warnings().iter().map(ToString::to_string).collect())
    }

    fn to_ron(&self, py: Python<'_>) -> String {
        self.with(py, |scene| scene.to_ron())
    }

    /// Adds parts; returns the materials, objects and lights that the text has.
    fn add(&self, py: Python<'_>, text: &str, images: Images) -> PyResult<(Vec<u64>, Vec<u64>, Vec<u64>)> {
        let parts = parts(py, text, images)?;
        let AddedParts { materials, objects, lights } = self.with_world(py, |world| parts.add_to(world));
        Ok((bits(materials), bits(objects), bits(lights)))
    }

    fn put_camera(&self, py: Python<'_>, text: &str) -> PyResult<()> {
        let parts = parts(py, text, Images::new())?;
        self.with_world(py, |world| parts.put_camera(world));
        Ok(())
    }

    fn put_environment(&self, py: Python<'_>, text: &str, images: Images) -> PyResult<()> {
        let parts = parts(py, text, images)?;
        self.with_world(py, |world| parts.put_environment(world));
        Ok(())
    }

    fn put_settings(&self, py: Python<'_>, text: &str) -> PyResult<()> {
        let parts = parts(py, text, Images::new())?;
        self.with_world(py, |world| parts.put_settings(world));
        Ok(())
    }

    /// The camera as JSON; none if there is none.
    fn camera(&self, py: Python<'_>) -> PyResult<Option<String>> {
        let camera = self.with_world(py, |world| SceneInputs::of(world).camera);
        let part = camera.map(|camera| camera_part(&camera.view, &camera.projection, &camera.lens, None));
        part.map(|part| serde_json::to_string(&part)).transpose().map_err(input)
    }

    fn size(&self, py: Python<'_>) -> (u32, u32) {
        let size = self.with_world(py, |world| world.get_resource::<FilmSize>().copied().unwrap_or_default());
        (size.width, size.height)
    }

    /// Adds a mesh; returns the object.
    ///
    /// - `mesh`: its positions and triangles, then normals, texture coordinates, colours and slots, which may be empty.
    fn add_mesh(
        &self,
        py: Python<'_>,
        name: Option<String>,
        mesh: (Vec<u8>, Vec<u8>, Vec<u8>, Vec<u8>, Vec<u8>, Vec<u8>),
        materials: Vec<u64>,
        placement: &[u8],
    ) -> PyResult<u64> {
        let (mesh, slots, placement) = (mesh_of(&mesh)?, entities(&materials)?, first_placement(placement)?);
        let spawn = |world: &mut World| {
            spawn_object(world, name.as_deref(), (Shape::Mesh(Arc::new(mesh)), placement), slots).to_bits()
        };
        Ok(self.with_world(py, spawn))
    }

    /// Replaces the mesh of an object.
    fn put_mesh(
        &self,
        py: Python<'_>,
        object: u64,
        mesh: (Vec<u8>, Vec<u8>, Vec<u8>, Vec<u8>, Vec<u8>, Vec<u8>),
    ) -> PyResult<()> {
        let (object, mesh) = (entity(object)?, mesh_of(&mesh)?);
        self.with_world(py, |world| {
            let mut shape = world.get_mut::<Shape>(object).ok_or_else(gone)?;
            *shape = Shape::Mesh(Arc::new(mesh));
            Ok(())
        })
    }

    /// Adds a group of spheres; returns the object.
    fn add_spheres(
        &self,
        py: Python<'_>,
        name: Option<String>,
        spheres: (Vec<u8>, Vec<u8>),
        materials: Vec<u64>,
        placement: &[u8],
    ) -> PyResult<u64> {
        let (centers, radii) = spheres;
        let balls = Balls::new(&points(&centers), numbers(&radii));
        balls.check().map_err(input)?;
        let (slots, placement) = (entities(&materials)?, first_placement(placement)?);
        let spawn = |world: &mut World| {
            spawn_object(world, name.as_deref(), (Shape::Spheres(Arc::new(balls)), placement), slots).to_bits()
        };
        Ok(self.with_world(py, spawn))
    }

    /// Adds objects with the shape and, unless materials are given, the materials of another; returns them.
    fn add_copies(&self, py: Python<'_>, of: u64, places: &[u8], materials: Vec<u64>) -> PyResult<Vec<u64>> {
        let (of, places, own) = (entity(of)?, checked(placements(places))?, entities(&materials)?);
        self.with_world(py, |world| {
            let shape = world.get::<Shape>(of).cloned().ok_or_else(gone)?;
            let slots = match world.get::<MaterialSlots>(of) {
                Some(slots) if own.is_empty() => slots.0.clone(),
                _ => own,
            };
            let spawn = |placement| spawn_object(world, None, (shape.clone(), placement), slots.clone()).to_bits();
            Ok(places.into_iter().map(spawn).collect())
        })
    }

    /// Moves objects and lights.
    fn place(&self, py: Python<'_>, objects: Vec<u64>, places: &[u8]) -> PyResult<()> {
        let (objects, places) = (entities(&objects)?, checked(placements(places))?);
        if objects.len() != places.len() {
            return Err(input(format!("there are {} objects and {} transforms", objects.len(), places.len())));
        }
        self.with_world(py, |world| {
            for (object, placement) in objects.into_iter().zip(places) {
                let mut old = world.get_mut::<Placement>(object).ok_or_else(gone)?;
                if *old != placement {
                    *old = placement;
                }
            }
            Ok(())
        })
    }

    fn remove(&self, py: Python<'_>, entities: Vec<u64>) -> PyResult<()> {
        let entities = self::entities(&entities)?;
        self.with_world(py, |world| {
            for entity in entities {
                // What is gone already stays gone.
                let _ = world.try_despawn(entity);
            }
        });
        Ok(())
    }

    /// Names of all materials, objects and lights, each with its entity.
    fn names(&self, py: Python<'_>) -> [Vec<(String, u64)>; 3] {
        self.with_world(py, |world| {
            let mut materials = world.query_filtered::<(Entity, &Name), With<SurfaceMaterial>>();
            let mut objects = world.query_filtered::<(Entity, &Name), With<Shape>>();
            let mut lights = world.query_filtered::<(Entity, &Name), WithLight>();
            let named = |(entity, name): (Entity, &Name)| (name.as_str().to_owned(), entity.to_bits());
            [
                materials.iter(world).map(named).collect(),
                objects.iter(world).map(named).collect(),
                lights.iter(world).map(named).collect(),
            ]
        })
    }

    fn set(&self, py: Python<'_>, name: &str, property: &str, value: [f64; 3]) -> PyResult<()> {
        self.with(py, |scene| scene.set(name, property, DVec3::from_array(value))).map_err(of_library)
    }

    /// Gives a material the values of another, which stays as it is.
    fn copy_material(&self, py: Python<'_>, from: u64, to: u64) -> PyResult<()> {
        let (from, to) = (entity(from)?, entity(to)?);
        self.with_world(py, |world| {
            let material = world.get::<SurfaceMaterial>(from).cloned().ok_or_else(gone)?;
            world.get_mut::<SurfaceMaterial>(to).map(|mut old| *old = material).ok_or_else(gone)
        })
    }

    fn set_slots(&self, py: Python<'_>, object: u64, materials: Vec<u64>) -> PyResult<()> {
        let (object, slots) = (entity(object)?, entities(&materials)?);
        self.with_world(py, |world| {
            let mut old = world.get_mut::<MaterialSlots>(object).ok_or_else(gone)?;
            old.0 = slots;
            Ok(())
        })
    }

    /// Renders an image; returns it, and whether Ctrl+C ended it.
    fn render(&self, py: Python<'_>, args: RenderArgs, progress: Option<Bound<'_, PyAny>>) -> PyResult<(Image, bool)> {
        render(py, &self.0, args, progress)
    }
}

fn gone() -> PyErr {
    input("the object no longer exists")
}

fn bits(entities: Vec<Entity>) -> Vec<u64> {
    entities.into_iter().map(Entity::to_bits).collect()
}

fn entity(bits: u64) -> PyResult<Entity> {
    Entity::try_from_bits(bits).ok_or_else(gone)
}

fn entities(bits: &[u64]) -> PyResult<Vec<Entity>> {
    bits.iter().map(|&bits| entity(bits)).collect()
}

fn spawn_object(world: &mut World, name: Option<&str>, what: (Shape, Placement), slots: Vec<Entity>) -> Entity {
    let mut object = world.spawn((what, MaterialSlots(slots)));
    if let Some(name) = name {
        object.insert(Name::new(name.to_owned()));
    }
    object.id()
}

fn first_placement(bytes: &[u8]) -> PyResult<Placement> {
    Ok(checked(placements(bytes))?.first().copied().unwrap_or_default())
}

/// Placements that flatten nothing.
fn checked(placements: Vec<Placement>) -> PyResult<Vec<Placement>> {
    let is_sound = |placement: &Placement| {
        let (affine, volume) = (placement.affine(), placement.linear().determinant());
        affine.is_finite() && volume.is_finite() && volume != 0.0
    };
    match placements.iter().position(|placement| !is_sound(placement)) {
        Some(i) => Err(input(format!("transform {i} is not finite or flattens the object"))),
        None => Ok(placements),
    }
}

fn mesh_of(
    (positions, faces, normals, uvs, colors, of_faces): &(Vec<u8>, Vec<u8>, Vec<u8>, Vec<u8>, Vec<u8>, Vec<u8>),
) -> PyResult<Mesh> {
    let mesh = Mesh::from_f64(&points(positions), triangles(faces)).map_err(input)?;
    let mesh = Mesh { normals: vec3s(normals), uvs: vec2s(uvs), colors: vec4s(colors), slots: slots(of_faces), ..mesh };
    mesh.validate().map_err(input)?;
    Ok(mesh)
}
