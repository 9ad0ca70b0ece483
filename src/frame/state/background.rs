//! Background work: loading scenes and building trees on other threads, while the current image stays.

use crate::frame::Waker;
use crate::frame::image::film_file::check_film_source;
use crate::frame::state::remake::{ForWhom, Remade, Remake};
use crate::render::ImageTexture;
use crate::scene::hit_spaces::{BuiltStatics, StaticJob};
use crate::scene::{
    LoadOptions, LoadStage, LoadedScene, MeshBase, ModelChoice, SceneError, SceneSource, Shape, TextureSource, Trees,
    UpAxis, load, read_picture, text_to_path,
};
use bevy_ecs::prelude::{Entity, Resource};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// A result of background work.
pub enum Finished {
    Scene {
        source: SceneSource,
        /// Whether it is another state of the open scene rather than another scene.
        again: bool,
        result: Result<Box<LoadedScene>, SceneError>,
    },
    Trees(Trees),
    /// Trees that meshes share.
    Statics(BuiltStatics),
    Mesh(Box<Remade>),
    Picture {
        purpose: PicturePurpose,
        result: Result<ImageTexture, String>,
    },
}

/// What an image is read for.
pub enum PicturePurpose {
    /// The colour of this material.
    Texture(Entity, TextureSource),
    /// To light the scene from all around; its path as in scene files.
    Environment(String),
}

#[derive(Default)]
struct TaskBoard {
    finished: Vec<Finished>,
    /// Progress of the newest load.
    progress: Option<(LoadStage, String)>,
    /// Number of the newest load; results of older ones are dropped.
    newest_load: u64,
    building: usize,
    /// Requested meshes with their numbers, the oldest first. A newer request for the same object replaces an older
    /// one.
    remaking: Vec<(u64, Remake)>,
    newest_remake: u64,
    /// Whether the thread that makes meshes runs. It makes one after the other: in parallel, outdated requests of a
    /// slider would delay the current one.
    makes_meshes: bool,
    /// Number of images being read for materials.
    reading: usize,
    /// Input of the last mesh.
    base: Option<MeshBase>,
    /// Files that were read so far.
    read: BTreeSet<PathBuf>,
}

impl TaskBoard {
    /// Title of the mesh that is being made, for messages.
    fn mesh_in_the_making(&self) -> Option<String> {
        self.remaking.first().map(|(_, job)| job.title())
    }

    /// The oldest requested mesh; `None` ends the thread that makes them.
    fn next_remake(&mut self) -> Option<(u64, Remake)> {
        let next = self.remaking.first().cloned();
        self.makes_meshes = next.is_some();
        next
    }
}

/// Starts background work and collects the results.
#[derive(Resource, Clone)]
pub struct BackgroundTasks {
    board: Arc<Mutex<TaskBoard>>,
    waker: Option<Waker>,
}

impl BackgroundTasks {
    pub fn new(waker: Option<Waker>) -> Self {
        Self { board: Arc::default(), waker }
    }

    /// Loads a scene; the result of an earlier load that is still running is dropped.
    ///
    /// - `how`: up axis of models, and an image that replaces the environment.
    /// - `choice`: which camera, time and variant of a model to show.
    /// - `known`: the open scene, if it is loaded again to be shown differently.
    pub fn load(
        &self,
        source: SceneSource,
        how: (Option<UpAxis>, Option<PathBuf>),
        choice: ModelChoice,
        aspect: f64,
        pool: Arc<rayon::ThreadPool>,
        known: Option<Arc<LoadedScene>>,
    ) {
        let again = known.is_some();
        let (up, environment) = how;
        let number = self.with(|board| {
            board.newest_load += 1;
            board.progress = Some((LoadStage::Reading, format!("reading {}", source.title())));
            board.newest_load
        });
        let this = self.clone();
        let work = move || {
            let say = |stage: LoadStage, text: &str| {
                this.with(|board| {
                    if board.newest_load == number {
                        board.progress = Some((stage, text.to_owned()));
                    }
                });
                this.wake();
            };
            let options = LoadOptions {
                up,
                environment: environment.as_deref(),
                aspect: Some(aspect),
                preview: true,
                progress: Some(&say),
                known: known.as_deref(),
                images: None,
                choice: Some(&choice),
            };
            let result = guarded(|| {
                pool.install(|| {
                    check_film_source(&source).map_err(SceneError::new)?;
                    load(&source, &options)
                })
            })
            .unwrap_or_else(|panic| Err(SceneError::in_file(source.title(), panic)));
            let of_scene = result.as_ref().map_or_else(|_| Vec::new(), LoadedScene::files);
            this.with(|board| {
                board.read.extend(of_scene);
                board.read.extend(source.path().map(Path::to_path_buf).into_iter().chain(environment));
                if board.newest_load == number {
                    board.progress = None;
                    board.finished.push(Finished::Scene { source, again, result: result.map(Box::new) });
                }
            });
            this.wake();
        };
        self.spawn("firstlight load", work, move |board, error| {
            board.progress = None;
            let error = SceneError::new(error);
            let source = SceneSource::Builtin("scene".to_owned());
            board.finished.push(Finished::Scene { source, again, result: Err(error) });
        });
    }

    /// Builds the missing trees of shapes; with `preview`, preview trees for large meshes.
    ///
    /// - `known`: trees of the scene, some of which may be deferred.
    pub fn build(&self, shapes: Vec<Shape>, known: Trees, preview: bool, pool: Arc<rayon::ThreadPool>) {
        self.with(|board| board.building += 1);
        let this = self.clone();
        let work = move || {
            let mut trees = Trees::default();
            for shape in &shapes {
                match guarded(|| pool.install(|| known.built(shape, preview))) {
                    Ok(Ok(built)) => trees.extend(built),
                    Err(reason) | Ok(Err(reason)) => trees.mark_unfit(shape, reason),
                }
            }
            this.with(|board| {
                board.building -= 1;
                board.finished.push(Finished::Trees(trees));
            });
            this.wake();
        };
        self.spawn("firstlight trees", work, |board, _| board.building -= 1);
    }

    /// Builds trees that meshes share.
    ///
    /// - `preview`: see [`StaticJob::build`].
    pub fn build_statics(&self, job: StaticJob, preview: bool, pool: Arc<rayon::ThreadPool>) {
        self.with(|board| board.building += 1);
        let this = self.clone();
        let work = move || {
            let built = guarded(|| pool.install(|| job.build(preview)));
            this.with(|board| {
                board.building -= 1;
                board.finished.extend(built.ok().map(Finished::Statics));
            });
            this.wake();
        };
        self.spawn("firstlight static trees", work, |board, _| board.building -= 1);
    }

    /// Makes a mesh again; an earlier request for the same object is dropped.
    pub fn remake(&self, job: Remake, pool: Arc<rayon::ThreadPool>) {
        let makes_meshes = self.with(|board| {
            board.newest_remake += 1;
            board.remaking.retain(|(_, other)| other.for_whom != job.for_whom);
            board.read.extend(job.source.file().map(|file| job.folder.join(text_to_path(file))));
            board.remaking.push((board.newest_remake, job));
            std::mem::replace(&mut board.makes_meshes, true)
        });
        if makes_meshes {
            return;
        }
        let this = self.clone();
        let work = move || {
            // A slider sends requests faster than meshes are made: requests that are outdated by then are never
            // started.
            std::thread::sleep(std::time::Duration::from_millis(30));
            let mut base = this.with(|board| board.base.take());
            while let Some((number, job)) = this.with(TaskBoard::next_remake) {
                let result =
                    guarded(|| pool.install(|| job.run(&mut base))).unwrap_or_else(|panic| Err(SceneError::new(panic)));
                this.with(|board| {
                    if board.remaking.iter().any(|(other, _)| *other == number) {
                        board.remaking.retain(|(other, _)| *other != number);
                        board.finished.push(Finished::Mesh(Box::new(Remade { job, result })));
                    }
                });
                this.wake();
            }
            this.with(|board| board.base = base);
        };
        self.spawn("firstlight mesh", work, |board, _| {
            board.remaking.clear();
            board.makes_meshes = false;
        });
    }

    /// The pending request for the mesh of an object.
    pub fn wanted(&self, entity: Entity) -> Option<Remake> {
        let is_it = |job: &Remake| job.for_whom == ForWhom::Object(entity);
        self.with(|board| board.remaking.iter().map(|(_, job)| job).find(|job| is_it(job)).cloned())
    }

    /// Drops and returns the newest request for a mesh, if it was made at this revision of the history or later.
    pub fn forget_mesh(&self, since: u64) -> Option<Remake> {
        self.with(|board| board.remaking.pop_if(|(_, job)| job.revision >= since)).map(|(_, job)| job)
    }

    /// Title of the mesh that is being made, for messages.
    pub fn mesh_in_the_making(&self) -> Option<String> {
        self.with(|board| board.mesh_in_the_making())
    }

    /// Reads an image for an edit.
    pub fn read_picture(&self, purpose: PicturePurpose, path: PathBuf) {
        self.with(|board| {
            board.reading += 1;
            board.read.insert(path.clone());
        });
        let this = self.clone();
        let work = move || {
            let result = guarded(|| read_picture(&path)).and_then(|read| read.map_err(String::from));
            let result = result.map(|(picture, _)| picture).map_err(|reason| format!("{}: {reason}", path.display()));
            this.with(|board| {
                board.reading -= 1;
                board.finished.push(Finished::Picture { purpose, result });
            });
            this.wake();
        };
        self.spawn("firstlight image", work, |board, _| board.reading -= 1);
    }

    /// All files that scenes and edits have read so far.
    pub fn files_read(&self) -> Vec<PathBuf> {
        self.with(|board| board.read.iter().cloned().collect())
    }

    /// Returns whether a mesh, an image or a kd-tree that an edit needs is still under way, or waits to be taken.
    pub fn is_editing(&self) -> bool {
        self.with(|board| {
            let waits = |finished: &Finished| !matches!(finished, Finished::Scene { .. });
            board.building > 0 || board.reading > 0 || !board.remaking.is_empty() || board.finished.iter().any(waits)
        })
    }

    /// Returns the results since the last call.
    pub fn take(&self) -> Vec<Finished> {
        self.with(|board| std::mem::take(&mut board.finished))
    }

    /// What is being loaded or built now, for messages; and the stage of the scene that is opened, if one is.
    pub fn progress(&self) -> (Option<LoadStage>, Option<String>) {
        self.with(|board| {
            let building = (board.building > 0).then(|| "building a kd-tree".to_owned());
            let (stage, text) = board.progress.clone().unzip();
            (stage, text.or_else(|| board.mesh_in_the_making()).or(building))
        })
    }

    /// Whether a scene is being loaded.
    pub fn is_loading(&self) -> bool {
        self.with(|board| board.progress.is_some())
    }

    /// Whether nothing is running and no result is waiting.
    pub fn is_idle(&self) -> bool {
        self.with(|board| {
            let rests = board.progress.is_none() && board.building == 0 && board.remaking.is_empty();
            rests && board.reading == 0 && board.finished.is_empty()
        })
    }

    fn spawn(&self, name: &str, work: impl FnOnce() + Send + 'static, on_error: impl FnOnce(&mut TaskBoard, String)) {
        if let Err(error) = std::thread::Builder::new().name(name.to_owned()).spawn(work) {
            self.with(|board| on_error(board, format!("cannot start a thread: {error}")));
        }
    }

    fn with<T>(&self, use_it: impl FnOnce(&mut TaskBoard) -> T) -> T {
        use_it(&mut self.board.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn wake(&self) {
        if let Some(waker) = &self.waker {
            waker();
        }
    }
}

/// Converts a panic of a reader or a builder to an error message.
fn guarded<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    std::panic::catch_unwind(std::panic::AssertUnwindSafe(work)).map_err(|panic| {
        let text = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
        format!("this is a bug in firstlight: {}", text.unwrap_or("no reason given"))
    })
}
