//! Watches files on a separate thread, and reports when one has changed and is stable.
//!
//! Sizes and modification times are polled several times per second: that needs no operating system service, works on
//! every file system, and detects files that editors replace.

use crate::files::stamp::stamp;
use crate::scene::Stamp;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::Duration;

/// Polling interval. A change must be the same in two polls, so that no file is read half-written.
const PAUSE: Duration = Duration::from_millis(150);

/// A watch on files; dropping it ends the thread.
pub struct Watch {
    sender: Option<Sender<Vec<(PathBuf, Stamp)>>>,
    thread: Option<JoinHandle<()>>,
}

impl Watch {
    /// Starts watching; `changed` is called with the files that have changed and are stable.
    ///
    /// # Errors
    /// If no thread can be started.
    pub fn start(changed: impl Fn(Vec<PathBuf>) + Send + 'static) -> Result<Self, String> {
        let (sender, receiver) = channel::<Vec<(PathBuf, Stamp)>>();
        let work = move || {
            // Per file: the known stamp, and the one that was seen last.
            let mut files: BTreeMap<PathBuf, (Stamp, Stamp)> = BTreeMap::new();
            loop {
                let news = if files.is_empty() {
                    receiver.recv().map_err(|_| RecvTimeoutError::Disconnected)
                } else {
                    receiver.recv_timeout(PAUSE)
                };
                match news {
                    Ok(paths) => {
                        let with_stamps = |(path, now): (PathBuf, Stamp)| {
                            let known = files.get(&path).copied().unwrap_or((now, now));
                            (path, known)
                        };
                        files = paths.into_iter().map(with_stamps).collect();
                        continue;
                    }
                    Err(RecvTimeoutError::Timeout) => {}
                    Err(RecvTimeoutError::Disconnected) => return,
                }
                let mut moving = false;
                for (path, (_, seen)) in &mut files {
                    let now = stamp(path);
                    moving |= now != *seen;
                    *seen = now;
                }
                let is_new = |(known, seen): &(Stamp, Stamp)| known != seen && seen.is_some();
                let new: Vec<PathBuf> =
                    files.iter().filter(|(_, stamps)| is_new(stamps)).map(|(path, _)| path.clone()).collect();
                if !moving && !new.is_empty() {
                    for (known, seen) in files.values_mut() {
                        *known = *seen;
                    }
                    changed(new);
                }
            }
        };
        let thread = std::thread::Builder::new()
            .name("firstlight watch".to_owned())
            .spawn(work)
            .map_err(|error| format!("cannot start a thread: {error}"))?;
        Ok(Self { sender: Some(sender), thread: Some(thread) })
    }

    /// Replaces the watched files. The present state of those that are new is the reference; the others may have changed
    /// since it was reported, while they were read.
    pub fn set(&self, paths: Vec<PathBuf>) {
        if let Some(sender) = &self.sender {
            // Stamped here: the thread of a busy machine would take a change of the next moment for the present state.
            let stamped = |path: PathBuf| {
                let now = stamp(&path);
                (path, now)
            };
            // The thread ends only when the sender is dropped.
            let _ = sender.send(paths.into_iter().map(stamped).collect());
        }
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        self.sender = None;
        if let Some(thread) = self.thread.take() {
            // A panic of the thread has been reported already.
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Instant;

    #[test]
    fn a_change_while_the_file_is_read_is_reported_too() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.ron");
        let write = |text: &str| std::fs::write(&path, text).unwrap();
        write("1");
        let (sender, receiver) = channel();
        let watch = Watch::start(move |paths| sender.send(paths).unwrap()).unwrap();
        watch.set(vec![path.clone()]);
        let patience = Duration::from_secs(60);
        for text in ["12", "123"] {
            write(text);
            // The scene that was read is watched from now on.
            watch.set(vec![path.clone()]);
            let start = Instant::now();
            assert_eq!(receiver.recv_timeout(patience), Ok(vec![path.clone()]), "{:?}", start.elapsed());
        }
    }
}
