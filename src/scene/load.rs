//! From a name or a path to everything that a scene needs: text, meshes, images, trees. Runs on any thread.

use crate::files::input_file::{FileKind, InputFile};
use crate::files::printable;
use crate::files::relative::{absolute, path_to_text, relative_path, text_to_path};
use crate::files::stamp::Stamp;
use crate::files::warnings::Warnings;
use crate::format::animation::{AnimationPart, TrackPart};
use crate::format::bounds;
use crate::format::bounds::{check_moment, check_shutter_share};
use crate::format::choice::ModelChoice;
use crate::format::choice::UpAxis;
use crate::format::error::{Problem, SceneError, suggestion};
use crate::format::locate;
use crate::format::material_textures::emits;
use crate::format::model_format::ModelFormat;
use crate::format::parts::{ObjectPart, RadiiPart, ball_grid};
use crate::format::scene_file::SceneFile;
use crate::format::sources::{EnvironmentLayout, EnvironmentSource, MeshOptions, MeshSource, TextureSource};
use crate::import::documents::Documents;
use crate::import::environment_image::equirectangular;
use crate::import::gltf_motion::GltfMotion;
use crate::import::gltf_scene;
use crate::import::meshes::{LoadedMesh, load_mesh};
use crate::import::sky::clear_sky;
use crate::render::ImageTexture;
use crate::scene::animation::edited::show_time;
use crate::scene::builtin::{BUILTIN_SCENES, builtin_text};
use crate::scene::default_scene;
use crate::scene::extract::origin_of;
use crate::scene::hit_spaces::{StaticJob, own_trees};
use crate::scene::image_metadata::{ImageMetadata, MetadataError};
use crate::scene::known_meshes::KnownMeshes;
use crate::scene::load_meshes::{LostMesh, ObjectMeshes, load_meshes};
use crate::scene::load_stage::LoadStage;
use crate::scene::loaded::LoadedScene;
use crate::scene::memory::check_memory;
use crate::scene::model_light::{Model, light_as_in, light_model};
use crate::scene::source::SceneSource;
use crate::scene::thousands::thousands;
use crate::scene::world::components::{Balls, Shape};
use crate::scene::world::extent::{Extent, ExtentCache};
use crate::scene::world::inputs::SceneInputs;
use bevy_ecs::world::World;
use glam::DVec3;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// Options for loading.
#[derive(Clone, Copy, Default)]
pub struct LoadOptions<'a> {
    /// For models; `None`: guessed from the stability of the model on the ground.
    pub up: Option<UpAxis>,
    /// An image that replaces the environment of the scene.
    pub environment: Option<&'a Path>,
    /// Width over height of the image for which a model is framed; `None`: 16:9.
    pub aspect: Option<f64>,
    /// Camera, time and variant of a glTF model.
    pub choice: Option<&'a ModelChoice>,
    /// Whether large meshes first get trees that are faster to build, for a quick first image; see
    /// [`Trees::preview`](crate::scene::Trees::preview).
    pub preview: bool,
    /// The previous state of the scene: files that have not changed on disk are not read again.
    pub known: Option<&'a LoadedScene>,
    /// Images in memory by their paths in the scene, which are not read from files.
    pub images: Option<&'a HashMap<String, Arc<ImageTexture>>>,
    /// Called with a description of each step.
    pub progress: Option<&'a (dyn Fn(LoadStage, &str) + Sync)>,
}

impl LoadOptions<'_> {
    fn choice(&self) -> &ModelChoice {
        static NONE: ModelChoice = ModelChoice::DEFAULT;
        self.choice.unwrap_or(&NONE)
    }

    fn aspect(&self) -> f64 {
        self.aspect.unwrap_or(16.0 / 9.0)
    }

    pub(super) fn say(&self, stage: LoadStage, text: &str) {
        if let Some(progress) = self.progress {
            progress(stage, text);
        }
    }
}

/// Reads a scene and all files that it refers to, and builds its trees.
///
/// # Errors
/// If the scene, or a file that it requires, is missing or invalid; see [`SceneError`].
pub fn load(source: &SceneSource, options: &LoadOptions) -> Result<LoadedScene, SceneError> {
    if let SceneSource::Picture(path) = source {
        return load_picture(path, options);
    }
    options.say(LoadStage::Reading, &format!("reading {}", source.title()));
    let start = Instant::now();
    let documents = Documents::new(options.choice());
    let mut model = None;
    let mut scene = match source {
        SceneSource::Builtin(name) => {
            let text = builtin_text(name).ok_or_else(|| {
                let hint = suggestion(name, BUILTIN_SCENES.iter().map(|(name, _, _)| *name));
                SceneError::new(format!("there is no built-in scene `{name}`{hint}"))
            })?;
            resolve(source, SceneFile::parse(text, name)?, Some(text), PathBuf::new(), options, &documents)?
        }
        SceneSource::Scene(path) => {
            let text = read_text(path)?;
            let folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
            resolve(source, SceneFile::parse(&text, path)?, Some(&text), folder, options, &documents)?
        }
        SceneSource::Foreign(path) => {
            let read = documents.scene(path, &options.choice().defines)?;
            let folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
            let mut scene = resolve(source, read.file.clone(), None, folder, options, &documents)?;
            let of_files = std::mem::replace(&mut scene.warnings, read.warnings.clone());
            scene.warnings.append(&of_files);
            scene.text_files = read.files.to_vec();
            let bounds = scene.look_at_middle();
            if !scene.has_light() {
                model = Some(Model { bounds, side: DVec3::ONE, emits: false, has_camera: true });
            }
            scene
        }
        SceneSource::Model(path) if ModelFormat::of(path) == Some(ModelFormat::Gltf) => {
            let file = path.file_name().map(|name| path_to_text(name.as_ref())).unwrap_or_default();
            let folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
            let wish = gltf_scene::Wish { file: &file, choice: options.choice(), aspect: options.aspect() };
            let made = gltf_scene::generate(&documents, path, &wish)?;
            let mut scene = resolve(source, made.file, None, folder, options, &documents)?;
            let of_objects = std::mem::replace(&mut scene.warnings, made.warnings);
            scene.warnings.append(&of_objects);
            scene.facts = Some(made.facts);
            scene.motion = made.motion.map(Arc::new);
            let (bounds, side) = (made.framing.bounds(), made.framing.side());
            model = Some(Model { bounds, side, emits: made.emits, has_camera: made.has_camera });
            scene
        }
        SceneSource::Model(path) => {
            let file = path.file_name().map(|name| path_to_text(name.as_ref())).unwrap_or_default();
            let folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
            let mesh_source = MeshSource::of_file(file);
            let kept = options.known.filter(|known| known.source == *source).and_then(LoadedScene::fresh_model);
            let mesh = kept.map_or_else(|| load_mesh(&mesh_source, MeshOptions::default(), &folder, &documents), Ok)?;
            let (file, framing) = default_scene::around(&mesh, &mesh_source, options.up, options.aspect());
            let emits = mesh.slots.iter().any(|(_, part)| emits(part));
            let (bounds, side) = (framing.bounds(), framing.side());
            model = Some(Model { bounds, side, emits, has_camera: false });
            let mut scene = around_mesh(source, file, folder, mesh, options, &documents);
            scene.up = options.up;
            if let Some(environment) = options.environment {
                scene.light_by(environment, options)?;
            }
            scene
        }
        SceneSource::Picture(_) => unreachable!("images were resolved above"),
    };
    if scene.facts.is_none() {
        scene.choose(options.choice())?;
    }
    scene.expose(options.choice())?;
    scene.load_seconds = start.elapsed().as_secs_f64();
    let start = Instant::now();
    scene.build_trees(options)?;
    scene.build_seconds = start.elapsed().as_secs_f64();
    if let Some(model) = model {
        match options.choice() {
            // Frames may be loaded apart: their light must not depend on their moment.
            choice if choice.at.is_some() && model.is_measured(&scene) => {
                let stored = ModelChoice { at: None, shutter: None, ..choice.clone() };
                let stored = load(source, &LoadOptions { choice: Some(&stored), ..*options })?;
                light_as_in(&mut scene, &stored);
            }
            _ => light_model(&mut scene, &model),
        }
    }
    Ok(scene)
}

/// The scene that was made around a mesh.
pub(super) fn around_mesh(
    source: &SceneSource,
    file: SceneFile,
    folder: PathBuf,
    mesh: LoadedMesh,
    options: &LoadOptions,
    documents: &Documents,
) -> LoadedScene {
    let mut scene = LoadedScene::empty(source, file, folder);
    scene.meshes = scene.file.objects.iter().map(|_| None).collect();
    scene.balls = scene.file.objects.iter().map(|_| None).collect();
    scene.warnings.append(&mesh.warnings);
    scene.warnings.append(&mesh.material_warnings);
    let place = scene.file.objects.iter().position(|object| matches!(object, ObjectPart::Mesh { .. }));
    scene.meshes[place.expect("a showcase shows its mesh")] = Some(mesh);
    scene.add_mesh_pictures(options, documents);
    scene
}

/// Like [`load`], for the text of a scene file; its trees are not built. Paths in it are relative to the working
/// directory.
///
/// - `name`: for messages.
///
/// # Errors
/// As for [`load`].
pub fn load_text(text: &str, name: &Path, options: &LoadOptions) -> Result<LoadedScene, SceneError> {
    let (source, documents) = (SceneSource::Scene(name.to_path_buf()), Documents::new(options.choice()));
    resolve(&source, SceneFile::parse(text, name)?, Some(text), PathBuf::new(), options, &documents)
}

/// The scene of an image, with the camera of the image.
fn load_picture(path: &Path, options: &LoadOptions) -> Result<LoadedScene, SceneError> {
    let failed = |error: MetadataError| SceneError::in_file(path, error);
    let shot = ImageMetadata::read(path).map_err(failed)?;
    let source = shot.source(path).map_err(failed)?;
    let options = LoadOptions { up: options.up.or(shot.up()), ..*options };
    let mut scene = match (&shot.text, source) {
        (Some(text), source) => {
            let start = Instant::now();
            // Its paths are relative to the folder of the scene.
            let own = SceneSource::Picture(path.to_path_buf());
            let source = source.unwrap_or_else(|| own.clone());
            let folder = match &source {
                SceneSource::Builtin(_) => PathBuf::new(),
                file => file.path().and_then(Path::parent).map(Path::to_path_buf).unwrap_or_default(),
            };
            let documents = Documents::new(options.choice());
            let file = SceneFile::parse(text, path)?;
            let mut scene = resolve(&own, file, Some(text), folder, &options, &documents)?;
            match source {
                source if scene.has_read(&source, &documents) => scene.source = source,
                source => scene.warnings.push(format!(
                    "{}: {} is not its scene: what is saved in the image is shown",
                    path.display(),
                    source.title()
                )),
            }
            scene.load_seconds = start.elapsed().as_secs_f64();
            scene
        }
        (None, Some(source)) => load(&source, &options)?,
        (None, None) => return Err(SceneError::in_file(path, "its metadata names no scene")),
    };
    if scene.content_fingerprint().to_string() != shot.fingerprint {
        let what = match &scene.source {
            SceneSource::Picture(_) => "a file of its scene".to_owned(),
            source => source.title(),
        };
        scene.warnings.push(format!("{}: {what} has changed since the image was rendered", path.display()));
    }
    shot.apply(&mut scene.file);
    if scene.facts.is_none() {
        scene.choose(options.choice())?;
    }
    scene.expose(options.choice())?;
    let start = Instant::now();
    scene.build_trees(&options)?;
    scene.build_seconds += start.elapsed().as_secs_f64();
    if scene.choice.camera.is_none() {
        scene.choice.camera = shot.model_camera().map(str::to_owned);
    }
    scene.shot = Some(shot);
    Ok(scene)
}

/// Loads the files that the objects, textures and environment of a checked file refer to.
pub(super) fn resolve(
    source: &SceneSource,
    file: SceneFile,
    text: Option<&str>,
    folder: PathBuf,
    options: &LoadOptions,
    documents: &Documents,
) -> Result<LoadedScene, SceneError> {
    let mut scene = LoadedScene::empty(source, file, folder);
    scene.choice = options.choice().clone();
    scene.pictures = options.images.cloned().unwrap_or_default();
    if let Some(environment) = options.environment {
        scene.light_by(environment, options)?;
    }
    let title = PathBuf::from(source.title());
    let (mut problems, mut untold) = (Vec::new(), 0);
    // An error inside a referenced file names that file, after the location in the scene.
    let mut note = |path: String, error: &SceneError| {
        for problem in &error.problems {
            if problems.len() < SceneError::MAX_TOLD {
                let at = text.map(|text| locate(text, &path));
                problems.push(Problem { file: Some(title.clone()), at, message: problem.to_string() });
            } else {
                untold += 1;
            }
        }
    };
    let before = options.known.map(KnownMeshes::new);
    let ObjectMeshes { meshes, lost } = load_meshes(
        &scene.file,
        &scene.folder,
        documents,
        |object| before.as_ref()?.fresh_mesh(&scene.folder, object),
        |source| options.say(LoadStage::Reading, &format!("reading {}", source.name())),
    );
    for mesh in meshes.iter().flatten() {
        scene.warnings.append(&mesh.warnings);
    }
    let is_left = |mesh: &Option<LoadedMesh>| mesh.as_ref().is_none_or(|mesh| !mesh.mesh.triangles.is_empty());
    let is_anything_left = meshes.iter().any(is_left);
    let mut n_left_out = 0;
    for LostMesh { object, error } in lost {
        let path = format!("objects/{object}/source");
        // Without any object there is nothing to open; and a scene that is shown stays while a file of it is broken.
        let was_there = before.as_ref().is_some_and(|before| before.has_mesh(&scene.file.objects[object]));
        if is_anything_left && !was_there {
            n_left_out += 1;
            if n_left_out <= SceneError::MAX_TOLD {
                let name = scene.file.objects[object].name().map_or_else(|| "the object".to_owned(), quoted);
                scene.warnings.push(format!("{}{error}; {name} is left out", at(text, &title, &path)));
            }
        } else {
            note(path, &error);
        }
    }
    if n_left_out > SceneError::MAX_TOLD {
        let more = n_left_out - SceneError::MAX_TOLD;
        scene.warnings.push(format!("{}: meshes of {more} more objects are left out", title.display()));
    }
    for object in &scene.file.objects {
        let mut balls = None;
        match object {
            ObjectPart::BallGrid { .. } | ObjectPart::Spheres { .. }
                if let Some(same) = before.as_ref().and_then(|before| before.same_balls(object)) =>
            {
                balls = Some(same);
            }
            ObjectPart::BallGrid { first, steps, radius, .. } => {
                let centers = ball_grid(*first, steps);
                balls = Some(Arc::new(Balls::new(&centers, centers.iter().map(|_| *radius))));
            }
            ObjectPart::Spheres { centers, radii, .. } => {
                balls = Some(Arc::new(match radii {
                    RadiiPart::All(radius) => Balls::new(centers, centers.iter().map(|_| *radius)),
                    RadiiPart::Each(radii) => Balls::new(centers, radii.iter().copied()),
                }));
            }
            _ => {}
        }
        scene.balls.push(balls);
    }
    scene.meshes = meshes;
    let mut wanted: Vec<(String, String)> = Vec::new();
    for (name, texture) in scene.file.textures.iter() {
        if let TextureSource::Image { file, .. } = texture {
            wanted.push((format!("textures/{name}/file"), file.clone()));
        }
    }
    const ENVIRONMENT: &str = "environment/file";
    if let EnvironmentSource::Image { file, .. } = &scene.file.environment {
        wanted.push((ENVIRONMENT.to_owned(), file.clone()));
    }
    scene.decode_ahead(wanted.iter().map(|(_, file)| file.as_str()), options, documents);
    let mut lost = HashSet::new();
    for (place, file) in wanted {
        let path = scene.folder.join(text_to_path(&file));
        // A scene is still useful if an image is missing.
        let at = || at(text, &title, &place);
        let is_environment = place == ENVIRONMENT;
        match scene.add_picture(&file, &path, options, documents) {
            Err(error) if text.is_some() && options.known.is_some_and(|known| known.pictures.contains_key(&file)) => {
                note(place.clone(), &error);
            }
            Err(error) if is_environment => {
                scene.warnings.push(format!("{}{error}; an environment of one colour is shown", at()));
                lost.insert(file);
            }
            Err(error) if !lost.contains(&file) => {
                scene.warnings.push(format!("{}{error}; the texture is omitted", at()));
                lost.insert(file);
            }
            _ => {}
        }
    }
    if let Some(file) = scene.environment_without_room() {
        let place = at(text, &title, ENVIRONMENT);
        let name = printable::name(&file);
        scene.warnings.push(format!("{place}`{name}`: not enough memory; an environment of one colour is shown"));
        lost.insert(file);
    }
    check_memory(&scene, text.map_or(0, str::len)).map_err(|message| SceneError::in_file(&title, message))?;
    scene.leave_out_pictures(&lost);
    if let EnvironmentSource::Image { file, layout, axes, .. } = &scene.file.environment
        && (*layout != EnvironmentLayout::default() || axes.is_some())
        && let Some(image) = scene.pictures.get(file)
    {
        scene.environment_image = Some(Arc::new(equirectangular(image, *layout, *axes)));
    }
    if matches!(scene.file.environment, EnvironmentSource::Sky { .. }) {
        let known = options.known.filter(|known| known.file.environment == scene.file.environment);
        let known = known.and_then(|known| known.environment_image.clone());
        scene.environment_image = known.or_else(|| clear_sky(&scene.file.environment).map(Arc::new));
    }
    scene.add_mesh_pictures(options, documents);
    let mut of_materials = Warnings::default();
    scene.meshes_with_own_materials().for_each(|mesh| of_materials.append(&mesh.material_warnings));
    scene.warnings.append(&of_materials);
    scene.find_motion(documents);
    if problems.is_empty() { Ok(scene) } else { Err(SceneError::of(problems, untold, Some(&title))) }
}

impl LoadedScene {
    /// Whether what an image names as its scene is one. A foreign image may name any file of the computer.
    fn has_read(&self, source: &SceneSource, documents: &Documents) -> bool {
        match source {
            SceneSource::Builtin(_) | SceneSource::Picture(_) => true,
            SceneSource::Scene(path) => read_text(path).and_then(|text| SceneFile::parse(&text, path)).is_ok(),
            SceneSource::Foreign(path) | SceneSource::Model(path) => {
                let wanted = absolute(path);
                let is_mesh = self.mesh_files().into_iter().any(|(file, _)| absolute(file) == wanted);
                // A scene of spheres alone has none.
                let is_foreign = matches!(source, SceneSource::Foreign(_));
                is_mesh || is_foreign && documents.scene(path, &self.choice.defines).is_ok()
            }
        }
    }

    /// Finds what a glTF file moves.
    fn find_motion(&mut self, documents: &Documents) {
        let Some(part) = &self.file.animation.model else { return };
        let by_name: HashMap<&str, usize> =
            self.file.objects.iter().enumerate().filter_map(|(i, object)| Some((object.name()?, i))).collect();
        let mesh = |(name, _): &(String, usize)| {
            let loaded = self.meshes.get(*by_name.get(name.as_str())?)?.as_ref()?;
            Some(&*loaded.mesh)
        };
        let path = self.folder.join(text_to_path(&part.file));
        match GltfMotion::of_part(documents, &path, part, part.objects.iter().map(mesh)) {
            Ok(motion) => self.motion = Some(Arc::new(motion)),
            Err(problem) => self.warnings.push(format!("{problem}; its animation is left out")),
        }
    }

    /// Sets the chosen exposure time; warns if nothing can move.
    fn expose(&mut self, choice: &ModelChoice) -> Result<(), SceneError> {
        let Some(share) = choice.shutter else { return Ok(()) };
        check_shutter_share(share).map_err(|bad| SceneError::in_file(self.source.title(), bad))?;
        let animation = &mut self.file.animation;
        if !animation.tracks.is_empty() || self.motion.is_some() {
            (animation.shutter, animation.shutter_seconds) = (Some(share), None);
        } else if share > 0.0 {
            let reason = match self.model_length() {
                Some(_) => "shows its stored pose without --at",
                None => "has no animation",
            };
            self.warnings.push(format!("{} {reason}: the shutter has no effect", self.source.title()));
        }
        Ok(())
    }

    /// Selects the chosen camera; warns about choices that only glTF models support.
    fn choose(&mut self, choice: &ModelChoice) -> Result<(), SceneError> {
        let title = self.source.title();
        // Only an image of it comes here.
        let is_gltf = self.source.path().is_some_and(|path| ModelFormat::of(path) == Some(ModelFormat::Gltf));
        if choice.variant.is_some() && is_gltf {
            let problem = format!("the image shows the model as it was; open {title} for its variants");
            return Err(SceneError::in_file(title, problem));
        }
        if choice.variant.is_some() {
            self.warnings.push(format!("{title}: only glTF models have variants"));
        }
        let moves = !self.file.animation.tracks.is_empty() || self.motion.is_some();
        match choice.at {
            Some(_) if !moves && is_gltf => {
                let problem = format!("the image shows the stored pose of the model; open {title} for moments");
                return Err(SceneError::in_file(title, problem));
            }
            Some(at) if !moves => {
                let at = bounds::number(at);
                self.warnings.push(format!("{title} has no animation: {at} s shows what any moment does"));
            }
            Some(at) => {
                let wrong = |bad| SceneError::in_file(self.source.title(), bad);
                check_moment("--at", at).map_err(wrong)?;
                let of_tracks = self.file.animation.tracks.iter().filter_map(|track| track.keys().last());
                let of_model = self.motion.as_ref().map_or(0.0, |motion| motion.length);
                let end =
                    self.file.animation.duration.unwrap_or_else(|| of_tracks.map(|key| key.0).fold(of_model, f64::max));
                if let Some(ignored) = gltf_scene::beyond_animation(at.max(0.0), Some(end)) {
                    self.warnings.push(format!("{}: {ignored}", self.source.title()));
                }
                show_time(&mut self.file, at);
            }
            None => {}
        }
        let Some(wanted) = &choice.camera else { return Ok(()) };
        let Some((_, camera)) = self.file.cameras.iter().find(|(name, _)| name == wanted) else {
            let hint = suggestion(wanted, self.file.cameras.names());
            let wanted = crate::files::printable::name(wanted);
            return Err(SceneError::in_file(self.source.title(), format!("there is no camera `{wanted}`{hint}")));
        };
        self.file.camera = camera.clone();
        let tracks = &mut self.file.animation.tracks;
        let n_tracks = tracks.len();
        tracks.retain(|track| !matches!(track, TrackPart::Camera { .. }));
        let of_model = self.file.animation.model.as_mut().and_then(|model| model.camera.take());
        if tracks.len() < n_tracks || of_model.is_some() {
            let title = self.source.title();
            self.warnings.push(format!("{title}: camera `{wanted}` stands still: the animation moves `camera`"));
        }
        self.file.animation.edited.camera = None;
        Ok(())
    }

    /// Uses an image as the environment instead of that of the scene.
    fn light_by(&mut self, path: &Path, options: &LoadOptions) -> Result<(), SceneError> {
        // Paths are relative to the folder of the scene, or to the working directory if it has none.
        let is_here = self.folder.as_os_str().is_empty();
        let file = if is_here { path_to_text(path) } else { relative_path(&self.folder, path) };
        self.add_picture(&file, path, options, &Documents::default())?;
        self.file.environment = EnvironmentSource::image(file);
        self.environment = Some(path.to_path_buf());
        Ok(())
    }

    /// Whether anything emits light.
    fn has_light(&self) -> bool {
        let of_meshes = self.meshes_with_own_materials().flat_map(|mesh| &mesh.slots).map(|(_, part)| part);
        self.file.environment != EnvironmentSource::Black
            || !self.file.lights.is_empty()
            || self.file.materials.iter().map(|(_, part)| part).chain(of_meshes).any(emits)
    }

    /// Sets the pivot of a camera without one to the distance of the middle of the scene. Returns the box of the scene.
    fn look_at_middle(&mut self) -> (DVec3, DVec3) {
        let mut world = World::new();
        self.spawn(&mut world);
        let Extent { center, radius } = ExtentCache::default().extent(&SceneInputs::of(&mut world));
        let camera = &mut self.file.camera;
        if let (None, Some(forward)) = (camera.pivot_distance, camera.forward) {
            let depth = (center - camera.eye).dot(forward);
            camera.pivot_distance =
                Some(depth).filter(|depth| (bounds::MIN_SIZE..bounds::MAX_COORDINATE).contains(depth));
        }
        (center - DVec3::splat(radius), center + DVec3::splat(radius))
    }

    /// All files that this scene was read from.
    pub fn files(&self) -> Vec<PathBuf> {
        let own = match &self.source {
            SceneSource::Scene(path) | SceneSource::Foreign(path) | SceneSource::Model(path) => Some(path.clone()),
            SceneSource::Builtin(_) | SceneSource::Picture(_) => None,
        };
        let of_text = self.text_files.iter().map(|(path, _)| path.clone());
        let of_meshes = self.mesh_files().into_iter().map(|(path, _)| path.clone());
        let of_meshes = of_meshes.chain(self.meshes.iter().flatten().flat_map(|mesh| mesh.beside.iter().cloned()));
        let of_pictures = self.picture_files.values().map(|(path, _)| path.clone());
        let mut files: Vec<PathBuf> = own.into_iter().chain(of_text).chain(of_meshes).chain(of_pictures).collect();
        files.sort();
        files.dedup();
        files
    }

    /// The files of all meshes, and of what moves them: those of a file with many meshes once.
    pub(super) fn mesh_files(&self) -> Vec<&(PathBuf, Stamp)> {
        let mut seen = HashSet::new();
        let of_motion = self.motion.as_ref().map(|motion| &motion.opened.files);
        let lists = self.meshes.iter().flatten().map(|mesh| &mesh.files).chain(of_motion);
        lists.filter(|files| seen.insert(Arc::as_ptr(files))).flat_map(|files| files.iter()).collect()
    }

    /// The mesh of a model, if its files have not changed.
    fn fresh_model(&self) -> Option<LoadedMesh> {
        self.meshes.iter().flatten().find(|mesh| mesh.is_fresh()).cloned()
    }

    pub(super) fn build_trees(&mut self, options: &LoadOptions) -> Result<(), SceneError> {
        // Trees are keyed by their geometry, so those of unchanged geometry are reused.
        if let Some(known) = options.known {
            self.trees = known.trees.clone();
        }
        // Skins and morph targets of another moment than that of the file.
        let deformed = match (&self.motion, &self.file.animation) {
            (Some(motion), AnimationPart { model: Some(_), at, .. }) => motion.meshes_at(*at),
            _ => Default::default(),
        };
        let shapes = (self.meshes.iter().flatten().map(|mesh| Shape::Mesh(mesh.mesh.clone())))
            .chain(deformed.iter().map(|(_, mesh)| Shape::Mesh(mesh.clone())))
            .chain(self.balls.iter().flatten().map(|balls| Shape::Spheres(balls.clone())));
        let shapes: Vec<Shape> = shapes.collect();
        for shape in shapes {
            if matches!(&shape, Shape::Mesh(mesh) if mesh.triangles.is_empty()) {
                // The user was told why.
                self.trees.mark_unfit(&shape, String::new());
                continue;
            }
            if let Shape::Spheres(balls) = &shape
                && !self.trees.has(&shape)
            {
                let n = thousands(balls.centers.len());
                options.say(LoadStage::Trees, &format!("building a kd-tree over {n} spheres"));
            }
            let added = if options.preview { self.trees.add_preview(&shape) } else { self.trees.add(&shape) };
            added.map_err(|reason| SceneError::in_file(self.source.title(), reason))?;
        }
        let mut world = World::new();
        self.spawn(&mut world);
        let inputs = SceneInputs::of(&mut world);
        if let Some(job) = StaticJob::next(&inputs, &self.trees, origin_of(&inputs)) {
            let (triangles, meshes) = (job.n_triangles(), job.n_meshes());
            let of = if meshes == 1 { String::new() } else { format!(" of {meshes} meshes") };
            let triangles = thousands(triangles);
            options.say(LoadStage::Trees, &format!("building a kd-tree over {triangles} triangles{of}"));
            self.trees.take_statics(job.build(options.preview));
        }
        // The others have trees of their own, which many objects may share.
        for tree in own_trees(&inputs, &self.trees).into_iter().filter(|tree| !tree.is_built()) {
            let n = thousands(tree.n_triangles());
            options.say(LoadStage::Trees, &format!("building a kd-tree over {n} triangles"));
            tree.ensure_built();
        }
        Ok(())
    }
}

/// Where in the text of a scene a remark belongs; empty for a scene without one.
fn at(text: Option<&str>, title: &Path, path: &str) -> String {
    text.map_or_else(String::new, |text| {
        let (line, column) = locate(text, path);
        format!("{}:{line}:{column}: ", title.display())
    })
}

fn quoted(name: &str) -> String {
    format!("`{}`", printable::name(name))
}

/// The text of a scene file, within its length limit.
fn read_text(path: &Path) -> Result<String, SceneError> {
    InputFile::open(path, FileKind::Scene)
        .and_then(InputFile::text)
        .map_err(|error| SceneError::in_file(path, error.to_string()))
}
