//! The threads of scenes and images: one pool for all of them.

use crate::embed::Error;
use crate::render::worker_threads;
use rayon::ThreadPool;
use std::sync::{Arc, Mutex, PoisonError};

/// A pool of this process.
struct Known {
    process: u32,
    /// As it was asked for: 0 is one thread per processor.
    n: usize,
    pool: Arc<ThreadPool>,
}

/// The pool of `n` threads, 0 for one per processor, which is kept until another number is asked for; `None`: any pool.
///
/// A process that was forked has none of the threads of its parent, nor those of rayon's own pool: it gets a new one.
///
/// # Errors
/// If the threads cannot be started.
pub fn threads(n: Option<usize>) -> Result<Arc<ThreadPool>, Error> {
    static LAST: Mutex<Option<Known>> = Mutex::new(None);
    let process = std::process::id();
    let mut last = LAST.lock().unwrap_or_else(PoisonError::into_inner);
    let is_fit = |known: &&Known| known.process == process && n.is_none_or(|n| n == known.n);
    if let Some(known) = last.as_ref().filter(is_fit) {
        return Ok(known.pool.clone());
    }
    let n = n.unwrap_or(0);
    let pool = Arc::new(worker_threads().num_threads(n).build()?);
    let before = last.replace(Known { process, n, pool: pool.clone() });
    if let Some(of_parent) = before.filter(|known| known.process != process) {
        // It has no thread that could be ended.
        std::mem::forget(of_parent);
    }
    Ok(pool)
}
