//! A scene that a program can change and render.

use crate::embed::threads::threads;
use crate::embed::{Error, Image, RenderOptions};
use crate::frame::{FeatureLayers, FeatureNames, check_film_source, compare, render_region_until, set_by_name};
use crate::render::{FEATURE_SAMPLES, Film, GuideGatherer, NoRoom, denoise_film, guide_samples};
use crate::scene::hit_spaces::StaticJob;
use crate::scene::{
    Animation, Description, DisplaySettings, Extraction, FilmSize, LoadOptions, LoadedScene, MetadataDraft, Moment,
    Rendering, SceneError, SceneInputs, SceneSource, SnapshotPart, Trees, Warning, load, origin_of,
};
use bevy_ecs::world::World;
use glam::{DVec3, UVec2};
use std::ffi::OsStr;
use std::sync::{Mutex, MutexGuard, PoisonError};

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
    state: Mutex<State>,
    loaded: Option<LoadedScene>,
}

#[derive(Debug, Default)]
struct State {
    world: World,
    /// Trees of this state of the world or of an earlier one.
    trees: Trees,
    rendered: Option<Rendered>,
}

/// What was rendered last, of which the next rendering keeps all that has not changed.
#[derive(Debug)]
struct Rendered {
    inputs: SceneInputs,
    extraction: Extraction,
}

impl Scene {
    /// Opens a model (`.obj`, `.ply`, `.stl`, `.glb`, `.gltf`, `.vrm`), a scene file (`.ron`), an image that firstlight
    /// saved (`.png`, `.exr`), or a built-in scene by its name.
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
        let loaded = threads(None)?.install(|| load(source, options))?;
        let mut state = State { trees: loaded.trees.clone(), ..State::default() };
        loaded.spawn(&mut state.world);
        Ok(Self { state: Mutex::new(state), loaded: Some(loaded) })
    }

    /// Creates an empty scene: spawn objects, materials, lights and a camera into [`world_mut`](Self::world_mut).
    pub fn new() -> Self {
        let mut state = State::default();
        state.world.init_resource::<Rendering>();
        state.world.init_resource::<DisplaySettings>();
        state.world.init_resource::<FilmSize>();
        Self { state: Mutex::new(state), loaded: None }
    }

    /// The entities and resources that the image depends on; see [`crate::scene`] for the components.
    pub fn world_mut(&mut self) -> &mut World {
        &mut self.state.get_mut().unwrap_or_else(PoisonError::into_inner).world
    }

    /// Warnings of opening: where the scene differs from the file, for example because an image is missing.
    pub fn warnings(&self) -> &[Warning] {
        self.loaded.as_ref().map_or(&[], |loaded| &loaded.warnings)
    }

    /// Returns the current content of the world as a scene file.
    pub fn to_ron(&self) -> String {
        Description::of(&mut self.state().world, self.loaded.as_ref()).file.to_ron()
    }

    /// Sets a property of what has a name: of a material, an object, a light that is no object, or of `camera`, as scene
    /// files name it. A number sets all three components.
    ///
    /// ```
    /// use firstlight::prelude::*;
    /// # fn main() -> Result<(), Error> {
    /// let mut scene = Scene::open("cornell-balls")?;
    /// scene.set("glass", "ior", DVec3::splat(1.4))?;
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// If nothing has this name or this property, or the value is out of range.
    pub fn set(&mut self, name: &str, property: &str, value: DVec3) -> Result<(), Error> {
        Ok(set_by_name(self.world_mut(), name, property, value)?)
    }

    /// Renders an image and returns when the target is reached. Uses all processors unless the options set a number of
    /// threads. What has not changed since the last rendering, such as trees, is not built again.
    ///
    /// # Errors
    /// If an option is out of range, the world has no camera, or there is not enough memory.
    pub fn render(&self, options: &RenderOptions) -> Result<Image, Error> {
        options.check()?;
        // Zero is one thread for each processor.
        threads(Some(options.threads.unwrap_or(0)))?.install(|| self.work(options))
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn work(&self, options: &RenderOptions) -> Result<Image, Error> {
        let mut state = self.state();
        state.rebuild()?;
        let State { world, rendered: Some(Rendered { inputs, extraction }), .. } = &mut *state else {
            unreachable!("it was rebuilt")
        };
        let of_scene = world.get_resource::<Rendering>().map(|of_scene| of_scene.0).unwrap_or_default();
        let shot = self.loaded.as_ref().and_then(|loaded| loaded.shot.as_ref());
        let settings = options.settings(of_scene, shot.map(|shot| shot.allocation));
        settings.check()?;
        let FilmSize { width, height } = world.get_resource::<FilmSize>().copied().unwrap_or_default();
        let (width, height) = options.size.unwrap_or((width, height));
        let mut display = world.get_resource::<DisplaySettings>().map(|of_scene| of_scene.0).unwrap_or_default();
        display.exposure_stops += options.exposure;
        world.insert_resource(Rendering(settings));
        let metadata = MetadataDraft::of(world, self.loaded.as_ref());
        world.insert_resource(Rendering(of_scene));
        let names = options.features.then(|| FeatureNames::of(extraction, inputs));
        let (prepared, warnings) = (extraction.prepared.clone(), extraction.problems.iter().cloned().collect());
        drop(state);

        let mut film = film(width, height, prepared.features().caustics)?;
        let stop = || options.is_stopped();
        let features = names.and_then(|names| {
            FeatureLayers::gather(&prepared, names, &settings, (width, height), FEATURE_SAMPLES, &stop)
        });
        let progress = |now| options.progress(&now);
        let report = render_region_until(&prepared, &settings, &mut film, None, options.target(), &stop, progress);
        let denoised = (options.denoise && film.spp() > 0).then(|| {
            let mut guides = GuideGatherer::default();
            guides.start(UVec2::new(width, height));
            // What was rendered until a stop is denoised: that takes less than a second.
            guides.gather(&prepared, &settings, guide_samples(film.spp()), &|| false);
            denoise_film(&film, guides.guides(), &|| false)
        });
        Ok(Image::new(film, display, metadata, report, warnings).with(features, denoised.flatten()))
    }
}

impl State {
    /// Brings the snapshot up to date: what has not changed since the last rendering is kept.
    fn rebuild(&mut self) -> Result<(), Error> {
        let Self { world, trees, rendered, .. } = self;
        let inputs = SceneInputs::of(world);
        inputs.camera.ok_or(Error::NoCamera)?.check()?;
        let part = match rendered {
            Some(rendered) => compare(&rendered.inputs, &inputs).part(),
            None => Some(SnapshotPart::Geometry),
        };
        let origin = origin_of(&inputs);
        if part == Some(SnapshotPart::Geometry) || rendered.as_ref().is_some_and(|it| it.extraction.origin != origin) {
            trees.keep_used(&inputs);
            add_trees(trees, &inputs);
            if let Some(job) = StaticJob::next(&inputs, trees, origin) {
                trees.take_statics(job.build(false));
            }
        }
        let mut extraction = match rendered.take() {
            None => Extraction::new(&inputs, trees),
            Some(Rendered { mut extraction, .. }) => {
                extraction.update(part.unwrap_or(SnapshotPart::Camera), &inputs, trees);
                extraction
            }
        };
        let seconds = world.get_resource::<Moment>().copied().unwrap_or_default().0;
        extraction.expose(world.get_resource::<Animation>(), seconds, &inputs, trees);
        *rendered = Some(Rendered { inputs, extraction });
        Ok(())
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
        trees.add_or_mark(&object.shape);
    }
}

fn film(width: u32, height: u32, has_light_paths: bool) -> Result<Film, NoRoom> {
    let mut film = Film::try_new(width, height)?;
    if has_light_paths {
        film.reserve_light()?;
    }
    Ok(film)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::procedural::cuboid;
    use crate::scene::{MaterialSlots, Placement, Shape, SurfaceMaterial};
    use bevy_ecs::prelude::{Entity, With};
    use std::sync::Arc;

    /// A built-in scene with a mesh that is no file's.
    fn scene() -> (Scene, Entity) {
        let mut scene = Scene::open("cornell-balls").unwrap();
        let world = scene.world_mut();
        let material = world.query_filtered::<Entity, With<SurfaceMaterial>>().iter(world).next().unwrap();
        let mesh = Arc::new(cuboid(DVec3::splat(0.4)));
        let object = world.spawn((Shape::Mesh(mesh), Placement::at(DVec3::Y), MaterialSlots(vec![material]))).id();
        (scene, object)
    }

    fn pixels(scene: &Scene) -> Vec<f32> {
        scene.render(&RenderOptions::default().size(16, 12).spp(2)).unwrap().pixels().to_vec()
    }

    #[test]
    fn an_image_does_not_tell_what_was_rendered_before() {
        let changes: [&dyn Fn(&mut Scene, Entity); 4] = [
            &|scene, _| scene.set("camera", "vfov", DVec3::splat(50.0)).unwrap(),
            &|scene, _| scene.set("glass", "ior", DVec3::splat(1.2)).unwrap(),
            &|scene, object| scene.world_mut().get_mut::<Placement>(object).unwrap().translation.y = 0.3,
            &|scene, object| assert!(scene.world_mut().despawn(object)),
        ];
        let (mut used, object) = scene();
        let mut before = pixels(&used);
        assert_eq!(before, pixels(&used), "nothing has changed");
        for n in 1..=changes.len() {
            let (mut fresh, fresh_object) = scene();
            changes[..n].iter().for_each(|change| change(&mut fresh, fresh_object));
            changes[n - 1](&mut used, object);
            let after = pixels(&used);
            assert!(after == pixels(&fresh), "change {n}");
            assert!(after != before, "change {n} is seen");
            before = after;
        }
    }
}
