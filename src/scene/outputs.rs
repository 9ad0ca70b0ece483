//! The files of one command, compared by what they are before work begins: nothing that is read is written over, no
//! two outputs are one file, and no film is lost.
//!
//! A command tells [`Files`] what it reads and writes, each as soon as it is known; the files of a scene once it is
//! loaded. What is refused here has not been touched.

use super::relative::absolute;
use super::whole_file::{Replace, WholeFile, check_replaceable, check_writable};
use super::write_error::WriteError;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// What a command reads and writes.
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
    /// A film that is gone on with.
    Both,
}

/// Why a file cannot be had.
#[derive(Debug, thiserror::Error)]
pub enum FilesError {
    /// One file stands for two things in the command.
    #[error("{0}")]
    Collision(String),
    /// The output may not be replaced, or cannot be written.
    #[error(transparent)]
    Unwritable(#[from] WriteError),
}

/// What makes two paths one file.
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
    /// No files yet; outputs may take the place of what `replace` says.
    pub fn new(replace: Replace) -> Self {
        Self { replace, ..Self::default() }
    }

    /// What outputs may take the place of.
    pub fn replace(&self) -> Replace {
        self.replace
    }

    /// A file that is read. To read one twice is no harm.
    ///
    /// # Errors
    /// When it is written as well.
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

    /// The same of many.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn read_all(&mut self, paths: impl IntoIterator<Item = PathBuf>) -> Result<(), FilesError> {
        paths.into_iter().try_for_each(|path| self.read(&path))
    }

    /// A file that is written.
    ///
    /// # Errors
    /// When it is read as well, is another output too, or cannot be written.
    pub fn write(&mut self, path: &Path) -> Result<(), FilesError> {
        self.add_output(path, Use::Written)?;
        check_writable(path, self.replace).map_err(FilesError::Unwritable)
    }

    /// Files in one folder, of which only the first is tried.
    ///
    /// # Errors
    /// As [`Self::write`].
    pub fn write_all(&mut self, paths: impl IntoIterator<Item = PathBuf>) -> Result<(), FilesError> {
        for (i, path) in paths.into_iter().enumerate() {
            if i == 0 {
                self.write(&path)?;
            } else {
                self.add_output(&path, Use::Written)?;
                check_replaceable(&path, self.replace).map_err(FilesError::Unwritable)?;
            }
        }
        Ok(())
    }

    /// A file that is written by no other process until this one is done with it.
    ///
    /// - `replace`: films say themselves what they may take the place of.
    ///
    /// # Errors
    /// As [`Self::write`], and when another process has it.
    pub fn claim(&mut self, path: &Path, replace: Replace) -> Result<WholeFile, FilesError> {
        self.add_output(path, Use::Written)?;
        WholeFile::claim(path, replace).map_err(FilesError::Unwritable)
    }

    /// A film that is read, gone on with, and written again; by no other process in between.
    ///
    /// # Errors
    /// As [`Self::claim`].
    pub fn go_on(&mut self, path: &Path) -> Result<WholeFile, FilesError> {
        self.add_output(path, Use::Both)?;
        WholeFile::claim(path, Replace::Anything).map_err(FilesError::Unwritable)
    }

    /// Outputs that take the place of a file that was there.
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
            assert!(matches!(files.write_all([spelling.clone()]), Err(FilesError::Collision(_))), "{spelling:?}");
            assert!(matches!(files.claim(spelling, Replace::Anything), Err(FilesError::Collision(_))), "{spelling:?}");
            // Also when the input is known later: the meshes of a scene.
            let mut files = Files::new(Replace::Anything);
            files.write(spelling).unwrap();
            assert!(
                files.read(&root.join("in.obj")).unwrap_err().to_string().contains("is also an input of this command")
            );
        }
        // A slash at the end makes no other file of it.
        for folder_like in ["in.obj/", "in.obj/.", "new.obj/"] {
            let path = PathBuf::from(format!("{}/{folder_like}", root.display()));
            let mut files = Files::new(Replace::Anything);
            files.read(&root.join("in.obj")).unwrap();
            let refused =
                [files.write(&path), files.claim(&path, Replace::Anything).map(drop), files.write_all([path])];
            assert!(refused.iter().all(Result::is_err), "{folder_like}: {refused:?}");
        }
        // What is not there yet.
        let mut files = Files::default();
        files.write(&root.join("new.png")).unwrap();
        let error = files.write(&root.join("sub/../new.png")).unwrap_err();
        assert!(error.to_string().contains("two outputs have the same name"), "{error}");
        files.write(&root.join("sub/new.png")).unwrap();
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
