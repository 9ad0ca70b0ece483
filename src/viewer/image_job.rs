//! A small image that one thread renders beside the window.

use crate::frame::Waker;
use crate::render::worker_threads;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError, channel};

/// Its rendering, which ends when this is dropped.
pub struct ImageJob {
    stop: Arc<AtomicBool>,
    receiver: Receiver<Option<Vec<u8>>>,
}

impl ImageJob {
    /// Starts rendering; `None` if the system gives no thread.
    ///
    /// - `waker`: called at the end.
    /// - `render`: returns the image, RGB; gets a function that says whether to stop.
    pub fn start(
        waker: Waker,
        render: impl FnOnce(&(dyn Fn() -> bool + Sync)) -> Option<Vec<u8>> + Send + 'static,
    ) -> Option<Self> {
        let ((sender, receiver), stop) = (channel(), Arc::new(AtomicBool::default()));
        let stopped = stop.clone();
        let work = move || {
            let stop = || stopped.load(Ordering::Relaxed);
            let pool = worker_threads().num_threads(1).build();
            let image = pool.ok().and_then(|pool| pool.install(|| render(&stop)));
            // If the window is gone, nobody waits for it.
            let _ = sender.send(image);
            waker();
        };
        std::thread::Builder::new().name("preview".to_owned()).spawn(work).ok()?;
        Some(Self { stop, receiver })
    }

    /// Ends it soon.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }

    /// What it has made, `None` inside if it was stopped or there is not enough memory; `None` as long as it runs.
    pub fn ended(&self) -> Option<Option<Vec<u8>>> {
        match self.receiver.try_recv() {
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(None),
            Ok(image) => Some(image),
        }
    }
}

impl Drop for ImageJob {
    fn drop(&mut self) {
        self.stop();
    }
}
