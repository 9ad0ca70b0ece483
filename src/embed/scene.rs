//! A scene that a program can change and render.

use crate::embed::{Error, Image, RenderOptions};
use crate::frame::{check_film_source, render_offline_until};
use crate::render::{Film, NoRoom, worker_threads};
use crate::scene::{
    Description, DisplaySettings, Extraction, FilmSize, LoadOptions, LoadedScene, MetadataDraft, Rendering, SceneError,
    SceneInputs, SceneSource, Trees, Warning, load,
};
use bevy_ecs::world::World;
use std::ffi::OsStr;
use std::sync::{Mutex, PoisonError};

/// A scene: an ECS world with the meshes, images and kd-trees that its entities use.
///
/// ```
/// use firstlight::prelude::*;
/// # fn main() -> Result<(), Error> {
/// # let out = std::env::temp_dir().join(format!("firstlight-doc-{}.png", std::process::id()));
/// let scene = Scene::open("cornell")?;
/// let image = scene.render(&RenderOptions::default().size(32, 32).spp(2))?;
/// assert_eq!(image.pixels().len(), 3 * 32 * 32);
/// image.save(&out)?;
/// # std::fs::remove_file(out).unwrap();
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Scene {
    /// In a mutex, because even read-only queries need `&mut World`.
    world: Mutex<World>,
    loaded: Option<LoadedScene>,
}

impl Scene {
    /// Opens a model (`.obj`, `.ply`, `.stl`, `.glb`, `.gltf`), a scene file (`.ron`), an image that firstlight saved
    /// (`.png`, `.exr`), or a built-in scene by its name.
    ///
    /// # Errors
    /// If there is no such file or scene, or it is not valid.
    pub fn open(source: impl AsRef<OsStr>) -> Result<Self, Error> {
        Self::open_with(&SceneSource::parse(source)?, &LoadOptions::default())
    }

    /// Like [`open`](Self::open), with options: up axis, the aspect ratio that a model is framed for, progress.
    ///
    /// # Errors
    /// As for [`open`](Self::open).
    pub fn open_with(source: &SceneSource, options: &LoadOptions) -> Result<Self, Error> {
        check_film_source(source).map_err(SceneError::new)?;
        let loaded = load(source, options)?;
        let mut world = World::new();
        loaded.spawn(&mut world);
        Ok(Self { world: Mutex::new(world), loaded: Some(loaded) })
    }

    /// Creates an empty scene: spawn objects, materials, lights and a camera into [`world_mut`](Self::world_mut).
    pub fn new() -> Self {
        let mut world = World::new();
        world.init_resource::<Rendering>();
        world.init_resource::<DisplaySettings>();
        world.init_resource::<FilmSize>();
        Self { world: Mutex::new(world), loaded: None }
    }

    /// The entities and resources that the image depends on; see [`crate::scene`] for the components.
    pub fn world_mut(&mut self) -> &mut World {
        self.world.get_mut().unwrap_or_else(PoisonError::into_inner)
    }

    /// Warnings of opening: where the scene differs from the file, for example because an image is missing.
    pub fn warnings(&self) -> &[Warning] {
        self.loaded.as_ref().map_or(&[], |loaded| &loaded.warnings)
    }

    /// Returns the current content of the world as a scene file.
    pub fn to_ron(&self) -> String {
        let mut world = self.world.lock().unwrap_or_else(PoisonError::into_inner);
        Description::of(&mut world, self.loaded.as_ref()).file.to_ron()
    }

    /// Renders an image and returns when the target is reached. Uses all processors unless the options set a number of
    /// threads.
    ///
    /// # Errors
    /// If an option is out of range, the world has no camera, or there is not enough memory.
    pub fn render(&self, options: &RenderOptions) -> Result<Image, Error> {
        options.check()?;
        // Zero is one thread for each processor.
        worker_threads().num_threads(options.threads.unwrap_or(0)).build()?.install(|| self.work(options))
    }

    fn work(&self, options: &RenderOptions) -> Result<Image, Error> {
        let mut world = self.world.lock().unwrap_or_else(PoisonError::into_inner);
        let inputs = SceneInputs::of(&mut world);
        inputs.camera.ok_or(Error::NoCamera)?.check()?;
        let mut trees = self.loaded.as_ref().map(|loaded| loaded.trees.clone()).unwrap_or_default();
        add_trees(&mut trees, &inputs);
        let extraction = Extraction::of_world(&mut world, &inputs, &trees);
        let of_scene = world.get_resource::<Rendering>().map(|of_scene| of_scene.0).unwrap_or_default();
        let shot = self.loaded.as_ref().and_then(|loaded| loaded.shot.as_ref());
        let settings = options.settings(of_scene, shot.map(|shot| shot.allocation));
        settings.check()?;
        let FilmSize { width, height } = world.get_resource::<FilmSize>().copied().unwrap_or_default();
        let (width, height) = options.size.unwrap_or((width, height));
        let mut display = world.get_resource::<DisplaySettings>().map(|of_scene| of_scene.0).unwrap_or_default();
        display.exposure_stops += options.exposure;
        world.insert_resource(Rendering(settings));
        let metadata = MetadataDraft::of(&mut world, self.loaded.as_ref());
        drop(world);

        let mut film = film(width, height, extraction.prepared.features().caustics)?;
        let stop = || options.is_stopped();
        let progress = |now| options.progress(&now);
        let report =
            render_offline_until(&extraction.prepared, &settings, &mut film, options.target(), &stop, progress);
        Ok(Image::new(film, display, metadata, report, extraction.problems.into_iter().collect()))
    }
}

impl Default for Scene {
    fn default() -> Self {
        Self::new()
    }
}

/// Builds the trees of shapes that were added to the world after the scene was opened.
fn add_trees(trees: &mut Trees, inputs: &SceneInputs) {
    for object in &inputs.objects {
        if let Err(reason) = trees.add(&object.shape) {
            trees.mark_unfit(&object.shape, reason);
        }
    }
}

fn film(width: u32, height: u32, has_light_paths: bool) -> Result<Film, NoRoom> {
    let mut film = Film::try_new(width, height)?;
    if has_light_paths {
        film.reserve_light()?;
    }
    Ok(film)
}
