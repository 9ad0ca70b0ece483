//! Work beside the picture: reading scenes and building trees on threads of their own, while the old picture stays.

use super::Waker;
use crate::scene::{LoadOptions, LoadedScene, SceneError, SceneSource, Shape, Trees, UpAxis, load};
use bevy_ecs::prelude::Resource;
use std::sync::{Arc, Mutex, PoisonError};

/// What has come of it.
pub enum Finished {
    Scene { source: SceneSource, result: Result<Box<LoadedScene>, SceneError> },
    Trees(Trees),
}

#[derive(Default)]
struct Board {
    finished: Vec<Finished>,
    /// What the newest load is doing.
    progress: Option<String>,
    /// The number of the newest load; an older one is dropped when it comes in.
    newest_load: u64,
    building: usize,
}

/// Starts such work and collects what comes of it.
#[derive(Resource, Clone)]
pub struct Beside {
    board: Arc<Mutex<Board>>,
    waker: Option<Waker>,
}

impl Beside {
    pub fn new(waker: Option<Waker>) -> Self {
        Self { board: Arc::default(), waker }
    }

    /// Reads a scene; an earlier reading that is still under way is forgotten.
    pub fn load(&self, source: SceneSource, up: Option<UpAxis>, aspect: f64, pool: Arc<rayon::ThreadPool>) {
        let number = self.with(|board| {
            board.newest_load += 1;
            board.progress = Some(format!("reading {}", source.title()));
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
            let options = LoadOptions { up, aspect: Some(aspect), progress: Some(&say), known: None };
            let result = guarded(|| pool.install(|| load(&source, &options)))
                .unwrap_or_else(|panic| Err(SceneError::in_file(source.title(), panic)));
            this.with(|board| {
                if board.newest_load == number {
                    board.progress = None;
                    board.finished.push(Finished::Scene { source, result: result.map(Box::new) });
                }
            });
            this.wake();
        };
        self.spawn("firstlight load", work, move |board, error| {
            board.progress = None;
            let error = SceneError::new(error);
            board
                .finished
                .push(Finished::Scene { source: SceneSource::Builtin("scene".to_owned()), result: Err(error) });
        });
    }

    /// Builds the trees of shapes that have none.
    pub fn build(&self, shapes: Vec<Shape>, pool: Arc<rayon::ThreadPool>) {
        self.with(|board| board.building += 1);
        let this = self.clone();
        let work = move || {
            let mut trees = Trees::default();
            for shape in &shapes {
                let built = guarded(|| pool.install(|| trees.add(shape)));
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

    /// What has come in since the last call.
    pub fn take(&self) -> Vec<Finished> {
        self.with(|board| std::mem::take(&mut board.finished))
    }

    /// What is being read or built now, for people.
    pub fn progress(&self) -> Option<String> {
        self.with(|board| {
            let building = (board.building > 0).then(|| "building a tree".to_owned());
            board.progress.clone().or(building)
        })
    }

    /// Nothing is under way and nothing waits to be taken.
    pub fn is_idle(&self) -> bool {
        self.with(|board| board.progress.is_none() && board.building == 0 && board.finished.is_empty())
    }

    fn spawn(&self, name: &str, work: impl FnOnce() + Send + 'static, on_error: impl FnOnce(&mut Board, String)) {
        if let Err(error) = std::thread::Builder::new().name(name.to_owned()).spawn(work) {
            self.with(|board| on_error(board, format!("no thread can be started: {error}")));
        }
    }

    fn with<T>(&self, use_it: impl FnOnce(&mut Board) -> T) -> T {
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
