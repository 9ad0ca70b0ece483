//! Work beside the picture: reading scenes and building trees on threads of their own, while the old picture stays.

use super::Waker;
use super::film_file::check_film_source;
use super::remake::{ForWhom, Remade, Remake};
use crate::render::ImageTexture;
use crate::scene::{
    LoadOptions, LoadedScene, MeshBase, ModelChoice, SceneError, SceneSource, Shape, TextureSource, Trees, UpAxis,
    load, read_picture,
};
use bevy_ecs::prelude::{Entity, Resource};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

/// What has come of it.
pub enum Finished {
    Scene {
        source: SceneSource,
        /// It is the open scene as it is in another way, and not another one.
        again: bool,
        result: Result<Box<LoadedScene>, SceneError>,
    },
    Trees(Trees),
    Mesh(Box<Remade>),
    /// For a material.
    Picture {
        entity: Entity,
        part: TextureSource,
        result: Result<ImageTexture, String>,
    },
}

#[derive(Default)]
struct TaskBoard {
    finished: Vec<Finished>,
    /// What the newest load is doing.
    progress: Option<String>,
    /// The number of the newest load; an older one is dropped when it comes in.
    newest_load: u64,
    building: usize,
    /// Meshes that are wanted, with their numbers; the oldest first. A newer one for the same takes the place of an older.
    remaking: Vec<(u64, Remake)>,
    newest_remake: u64,
    /// There is a thread that makes them, one after the other: side by side, those that a slider left behind would keep the wanted one waiting.
    makes_meshes: bool,
    /// Pictures that are being read for materials.
    reading: usize,
    /// What the last mesh was made from.
    base: Option<MeshBase>,
}

impl TaskBoard {
    /// What the mesh that comes next is, for people.
    fn mesh_in_the_making(&self) -> Option<String> {
        self.remaking.first().map(|(_, job)| job.title())
    }

    /// The oldest mesh that is wanted; `None` ends the thread that makes them.
    fn next_remake(&mut self) -> Option<(u64, Remake)> {
        let next = self.remaking.first().cloned();
        self.makes_meshes = next.is_some();
        next
    }
}

/// Starts such work and collects what comes of it.
#[derive(Resource, Clone)]
pub struct BackgroundTasks {
    board: Arc<Mutex<TaskBoard>>,
    waker: Option<Waker>,
}

impl BackgroundTasks {
    pub fn new(waker: Option<Waker>) -> Self {
        Self { board: Arc::default(), waker }
    }

    /// Reads a scene; an earlier reading that is still under way is forgotten.
    ///
    /// - `how`: which axis of models points up, and the image that takes the place of the environment.
    /// - `choice`: what of a model is shown.
    /// - `known`: the open scene, if it is read again to be shown in another way.
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
            board.progress = Some(format!("loading {}", source.title()));
            board.newest_load
        });
        let this = self.clone();
        let work = move || {
            let say = |text: &str| {
                this.with(|board| {
                    if board.newest_load == number {
                        board.progress = Some(text.to_owned());
                    }
                });
                this.wake();
            };
            let options = LoadOptions {
                up,
                environment: environment.as_deref(),
                aspect: Some(aspect),
                hasty: true,
                progress: Some(&say),
                known: known.as_deref(),
                choice: Some(&choice),
            };
            let result = guarded(|| {
                pool.install(|| {
                    check_film_source(&source).map_err(SceneError::new)?;
                    load(&source, &options)
                })
            })
            .unwrap_or_else(|panic| Err(SceneError::in_file(source.title(), panic)));
            this.with(|board| {
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

    /// Builds the trees of shapes that have none; with `hasty`, those of large meshes in a hurry.
    pub fn build(&self, shapes: Vec<Shape>, hasty: bool, pool: Arc<rayon::ThreadPool>) {
        self.with(|board| board.building += 1);
        let this = self.clone();
        let work = move || {
            let mut trees = Trees::default();
            for shape in &shapes {
                let build = || if hasty { trees.add_hastily(shape) } else { trees.add(shape) };
                let built = guarded(|| pool.install(build));
                if let Err(reason) | Ok(Err(reason)) = built {
                    trees.mark_unfit(shape, reason);
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

    /// Makes a mesh anew; an earlier one for the same object is forgotten.
    pub fn remake(&self, job: Remake, pool: Arc<rayon::ThreadPool>) {
        let makes_meshes = self.with(|board| {
            board.newest_remake += 1;
            board.remaking.retain(|(_, other)| other.for_whom != job.for_whom);
            board.remaking.push((board.newest_remake, job));
            std::mem::replace(&mut board.makes_meshes, true)
        });
        if makes_meshes {
            return;
        }
        let this = self.clone();
        let work = move || {
            // A slider asks faster than meshes are made: what is outdated before it began is not begun.
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

    /// What the mesh of an object is about to become.
    pub fn wanted(&self, entity: Entity) -> Option<Remake> {
        let is_it = |job: &Remake| job.for_whom == ForWhom::Object(entity);
        self.with(|board| board.remaking.iter().map(|(_, job)| job).find(|job| is_it(job)).cloned())
    }

    /// Forgets the newest mesh that is wanted, if it was asked for at this revision of the history or later; tells which.
    pub fn forget_mesh(&self, since: u64) -> Option<Remake> {
        self.with(|board| board.remaking.pop_if(|(_, job)| job.revision >= since)).map(|(_, job)| job)
    }

    /// What the mesh that comes next is, for people.
    pub fn mesh_in_the_making(&self) -> Option<String> {
        self.with(|board| board.mesh_in_the_making())
    }

    /// Reads a picture for a material.
    pub fn read_picture(&self, entity: Entity, part: TextureSource, path: PathBuf) {
        self.with(|board| board.reading += 1);
        let this = self.clone();
        let work = move || {
            let result = guarded(|| read_picture(&path)).and_then(|read| read.map_err(String::from));
            let result = result.map(|(picture, _)| picture).map_err(|reason| format!("{}: {reason}", path.display()));
            this.with(|board| {
                board.reading -= 1;
                board.finished.push(Finished::Picture { entity, part, result });
            });
            this.wake();
        };
        self.spawn("firstlight picture", work, |board, _| board.reading -= 1);
    }

    /// Returns whether a mesh, an image or a kd-tree that an edit needs is still under way, or waits to be taken.
    pub fn is_editing(&self) -> bool {
        self.with(|board| {
            let waits = |finished: &Finished| !matches!(finished, Finished::Scene { .. });
            board.building > 0 || board.reading > 0 || !board.remaking.is_empty() || board.finished.iter().any(waits)
        })
    }

    /// What has come in since the last call.
    pub fn take(&self) -> Vec<Finished> {
        self.with(|board| std::mem::take(&mut board.finished))
    }

    /// What is being read or built now, for people.
    pub fn progress(&self) -> Option<String> {
        self.with(|board| {
            let building = (board.building > 0).then(|| "building a kd-tree".to_owned());
            board.progress.clone().or_else(|| board.mesh_in_the_making()).or(building)
        })
    }

    /// Whether a scene is being read.
    pub fn is_loading(&self) -> bool {
        self.with(|board| board.progress.is_some())
    }

    /// Nothing is under way and nothing waits to be taken.
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

/// A bug in a reader or a builder becomes a message; the picture stays.
fn guarded<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    std::panic::catch_unwind(std::panic::AssertUnwindSafe(work)).map_err(|panic| {
        let text = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
        format!("this is a bug in firstlight: {}", text.unwrap_or("no reason given"))
    })
}
