//! The input and output files of one command, compared by identity before work begins: no input is overwritten, no two
//! outputs are the same file, and no film is lost.
//!
//! A command registers its inputs and outputs in [`Files`] as soon as they are known; the files of a scene once it is
//! loaded. A rejected file has not been modified.

use crate::relative::absolute;
use crate::whole_file::{Replace, WholeFile, check_replaceable, check_writable};
use crate::write_error::WriteError;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// The inputs and outputs of a command.
#[derive(Debug, Default)]
pub struct Files {
    replace: Replace,
    known: HashMap<Identity, (PathBuf, Use)>,
    replaced: Vec<PathBuf>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Use {
    Read,
    Written,
    /// A film that is resumed.
    Both,
}

/// Why a file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum FilesError {
    /// One file is used twice in the command.
    #[error("{0}")]
    Collision(String),
    /// The output may not be replaced, or cannot be written.
    #[error(transparent)]
    Unwritable(#[from] WriteError),
}

/// Two paths with the same identity are the same file.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
enum Identity {
    #[cfg(unix)]
    Inode(u64, u64),
    Path(PathBuf),
}

impl Identity {
    fn of(path: &Path) -> Self {
        #[cfg(unix)]
        {
            use std::os::unix::fs::MetadataExt;
            if let Ok(info) = std::fs::metadata(path) {
                return Self::Inode(info.dev(), info.ino());
            }
        }
        Self::Path(absolute(path))
    }
}

impl Files {
    /// No files; `replace`: what outputs may overwrite.
    pub fn new(replace: Replace) -> Self {
        Self { replace, ..Self::default() }
    }

    /// What outputs may overwrite.
    pub fn replace(&self) -> Replace {
        self.replace
    }

    /// Registers an input. The same file may be read more than once.
    ///
    /// # Errors
    /// If it is also an output.
    pub fn read(&mut self, path: &Path) -> Result<(), FilesError> {
        let id = Identity::of(path);
        match self.known.get(&id) {
            Some((output, Use::Written)) => Err(is_read(output, path)),
            Some(_) => Ok(()),
            None => {
                self.known.insert(id, (path.to_path_buf(), Use::Read));
                Ok(())
            }
        }
    }

    /// Registers several inputs.
    ///
    /// # Errors
    /// Like [`Self::read`].
    pub fn read_all(&mut self, paths: impl IntoIterator<Item = PathBuf>) -> Result<(), FilesError> {
        paths.into_iter().try_for_each(|path| self.read(&path))
    }

    /// Registers an output.
    ///
    /// # Errors
    /// If it is also an input or another output, or cannot be written.
    pub fn write(&mut self, path: &Path) -> Result<(), FilesError> {
        self.add_output(path, Use::Written)?;
        check_writable(path, self.replace).map_err(FilesError::Unwritable)
    }

    /// Registers outputs in one folder; only the first one is tested for writing.
    ///
    /// - `replace`: what they may overwrite.
    ///
    /// # Errors
    /// Like [`Self::write`].
    pub fn write_all(&mut self, paths: impl IntoIterator<Item = PathBuf>, replace: Replace) -> Result<(), FilesError> {
        let mut check: fn(&Path, Replace) -> Result<(), WriteError> = check_writable;
        for path in paths {
            self.add_output(&path, Use::Written)?;
            check(&path, replace).map_err(FilesError::Unwritable)?;
            check = check_replaceable;
        }
        Ok(())
    }

    /// Registers an output that no other process can write until this one has finished.
    ///
    /// - `replace`: what a film may overwrite.
    ///
    /// # Errors
    /// Like [`Self::write`], and if another process has claimed it.
    pub fn claim(&mut self, path: &Path, replace: Replace) -> Result<WholeFile, FilesError> {
        self.add_output(path, Use::Written)?;
        WholeFile::claim(path, replace).map_err(FilesError::Unwritable)
    }

    /// Registers a film that is read, resumed and written again; no other process can write it in the meantime.
    ///
    /// # Errors
    /// Like [`Self::claim`].
    pub fn go_on(&mut self, path: &Path) -> Result<WholeFile, FilesError> {
        self.add_output(path, Use::Both)?;
        WholeFile::claim(path, Replace::Anything).map_err(FilesError::Unwritable)
    }

    /// Outputs that replace an existing file.
    pub fn replaced(&self) -> &[PathBuf] {
        &self.replaced
    }

    fn add_output(&mut self, path: &Path, kind: Use) -> Result<(), FilesError> {
        let id = Identity::of(path);
        match self.known.get(&id) {
            Some((_, Use::Read)) if kind == Use::Both => {}
            Some((input, Use::Read | Use::Both)) => return Err(is_read(path, input)),
            Some((other, Use::Written)) => {
                let (path, other) = (path.display(), other.display());
                let both =
                    if path.to_string() == other.to_string() { format!("{path}") } else { format!("{path}, {other}") };
                return Err(FilesError::Collision(format!("{both}: two outputs have the same name")));
            }
            None => {}
        }
        if kind == Use::Written && path.exists() {
            self.replaced.push(path.to_path_buf());
        }
        self.known.insert(id, (path.to_path_buf(), kind));
        Ok(())
    }
}

fn is_read(output: &Path, input: &Path) -> FilesError {
    let same = if output == input { String::new() } else { format!(", as {}", input.display()) };
    FilesError::Collision(format!(
        "{}: is also an input of this command{same}: choose another output name",
        output.display()
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_file_is_one_thing_whatever_it_is_called() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        std::fs::create_dir(root.join("sub")).unwrap();
        std::fs::write(root.join("in.obj"), "here").unwrap();
        let mut spellings = vec![root.join("in.obj"), root.join("sub/../in.obj"), root.join("./in.obj")];
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink("../in.obj", root.join("sub/link.obj")).unwrap();
            std::fs::hard_link(root.join("in.obj"), root.join("hard.obj")).unwrap();
            spellings.extend([root.join("sub/link.obj"), root.join("hard.obj")]);
        }
        for spelling in &spellings {
            let mut files = Files::default();
            files.read(&root.join("in.obj")).unwrap();
            files.read(spelling).unwrap();
            assert!(matches!(files.write(spelling), Err(FilesError::Collision(_))), "{spelling:?}");
            assert!(
                matches!(files.write_all([spelling.clone()], Replace::Anything), Err(FilesError::Collision(_))),
                "{spelling:?}"
            );
            assert!(matches!(files.claim(spelling, Replace::Anything), Err(FilesError::Collision(_))), "{spelling:?}");
            // Also if the input is registered later, like the meshes of a scene.
            let mut files = Files::new(Replace::Anything);
            files.write(spelling).unwrap();
            assert!(
                files.read(&root.join("in.obj")).unwrap_err().to_string().contains("is also an input of this command")
            );
        }
        // A trailing slash does not make it another file.
        for folder_like in ["in.obj/", "in.obj/.", "new.obj/"] {
            let path = PathBuf::from(format!("{}/{folder_like}", root.display()));
            let mut files = Files::new(Replace::Anything);
            files.read(&root.join("in.obj")).unwrap();
            let refused = [
                files.write(&path),
                files.claim(&path, Replace::Anything).map(drop),
                files.write_all([path], Replace::Anything),
            ];
            assert!(refused.iter().all(Result::is_err), "{folder_like}: {refused:?}");
        }
        // Files that do not exist yet.
        let mut files = Files::default();
        files.write(&root.join("new.png")).unwrap();
        let error = files.write(&root.join("sub/../new.png")).unwrap_err();
        assert!(error.to_string().contains("two outputs have the same name"), "{error}");
        files.write(&root.join("sub/new.png")).unwrap();
        // Nor their folders.
        files.write(&root.join("far/v/new.png")).unwrap();
        assert!(matches!(files.write(&root.join("far/z/../v/new.png")), Err(FilesError::Collision(_))));
        assert_eq!(files.replaced(), [] as [PathBuf; 0]);
        assert_eq!(std::fs::read_to_string(root.join("in.obj")).unwrap(), "here");
    }

    #[test]
    fn a_film_that_is_gone_on_with_is_read_and_written_but_by_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let film = folder.path().join("a.exr");
        std::fs::write(&film, "a film").unwrap();
        let mut files = Files::default();
        files.read(&film).unwrap();
        let claim = files.go_on(&film).unwrap();
        files.read(&film).unwrap();
        assert!(matches!(files.write(&film), Err(FilesError::Collision(_))));
        assert!(matches!(Files::default().go_on(&film), Err(FilesError::Unwritable(_))), "somebody else");
        drop(claim);
        Files::default().go_on(&film).unwrap();
    }
}
