//! A scene with all of its files, for other machines: every mesh, texture and image, under names that count from one folder,
//! with checksums.
//!
//! Files keep their places relative to each other, so what names them is not changed: model files name their own libraries
//! and images. Only a scene file that names files by absolute paths is rewritten. The package of the same files has the
//! same bytes.

use crate::scene::file::SceneFile;
use crate::scene::whole_file::{WholeFile, unwritable, write_whole};
use crate::scene::{
    FileKind, InputFile, LoadedScene, ReadError, SceneError, SceneSource, WriteError, builtin_text, each_path,
    path_to_text, relative_path, text_to_path,
};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{Read, Write};
use std::path::{Component, Path, PathBuf};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

/// The list of checksums in a package, as `sha256sum --check` reads it.
pub const CHECKSUMS: &str = "SHA256SUMS";
/// First words of the comment of an archive, before the name of the scene, and before that of the environment image.
pub(super) const SCENE: &str = "scene: ";
pub(super) const ENVIRONMENT: &str = "environment: ";

/// What is in a package.
#[derive(Clone, Debug)]
pub struct Package {
    /// What is to be opened in it: a name in the package.
    pub scene: String,
    /// The image that lights the scene instead of its own environment, likewise.
    pub environment: Option<String>,
    /// By name, with `/` between the parts.
    files: BTreeMap<String, Content>,
}

#[derive(Clone, Debug)]
enum Content {
    File(PathBuf),
    Text(String),
}

/// Why a scene is not packed.
#[derive(Debug, thiserror::Error)]
pub enum PackError {
    /// A file cannot be read.
    #[error("{}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: ReadError,
    },
    /// A scene file cannot be parsed.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A model names a file in a way that other machines do not know.
    #[error("{}: names {} by its absolute path: use a path relative to the model", model.display(), file.display())]
    Absolute {
        /// What names it.
        model: PathBuf,
        /// What is named.
        file: PathBuf,
    },
    /// A path is not UTF-8.
    #[error("{}: cannot be packed: its name is not UTF-8", .0.display())]
    Name(PathBuf),
    /// The package cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

impl Package {
    /// Of a scene that was opened as `source`.
    ///
    /// # Errors
    /// When a file cannot be read, or would not be found on another machine.
    pub fn of(scene: &LoadedScene, source: &SceneSource) -> Result<Self, PackError> {
        let mut paths: Vec<PathBuf> = scene.files().into_iter().filter(|path| path.is_file()).collect();
        paths.extend(source.path().map(Path::to_path_buf));
        paths.extend(scene.environment.clone());
        let paths: BTreeMap<PathBuf, PathBuf> = paths.into_iter().map(|path| (place(&path), path)).collect();
        let root = common_folder(paths.keys());
        let name_of = |place: &Path| {
            let name = place.strip_prefix(&root).unwrap_or(place);
            name.to_str().map(|_| path_to_text(name)).ok_or_else(|| PackError::Name(place.to_path_buf()))
        };
        let mut files = BTreeMap::new();
        for (place, path) in &paths {
            let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
            if extension == "mtl" || extension == "gltf" {
                check_names(path, paths.keys())?;
            }
            files.insert(name_of(place)?, Content::File(path.clone()));
        }
        let environment = scene.environment.as_deref().map(|path| name_of(&self::place(path))).transpose()?;
        let scene = match source {
            SceneSource::Builtin(name) => {
                let name_of_scene = format!("{name}.ron");
                let text = builtin_text(name).unwrap_or_default().to_owned();
                files.insert(name_of_scene.clone(), Content::Text(text));
                name_of_scene
            }
            SceneSource::Scene(path) | SceneSource::Model(path) | SceneSource::Picture(path) => {
                name_of(&self::place(path))?
            }
        };
        let scene_files: Vec<(String, PathBuf)> = (paths.iter())
            .filter(|(place, _)| place.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("ron")))
            .map(|(place, path)| Ok((name_of(place)?, path.clone())))
            .collect::<Result<_, PackError>>()?;
        for (name, path) in scene_files {
            if let Some(text) = with_relative_paths(&path)? {
                files.insert(name, Content::Text(text));
            }
        }
        Ok(Self { scene, environment, files })
    }

    /// Names of all files.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.files.keys().map(String::as_str)
    }

    /// Writes a zip archive.
    ///
    /// # Errors
    /// When a file cannot be read, or the archive cannot be written.
    pub fn write_zip(&self, mut out: WholeFile) -> Result<(), PackError> {
        /// From here on sizes take eight bytes.
        const LARGE: u64 = u32::MAX as u64;
        let path = out.path().to_path_buf();
        let failed = |error: zip::result::ZipError| PackError::Write(unwritable(&path, error));
        let mut zip = ZipWriter::new_stream(&mut out);
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Deflated)
            .last_modified_time(zip::DateTime::default())
            .unix_permissions(0o644);
        let mut sums = String::new();
        for (name, content) in &self.files {
            let size = match content {
                Content::File(path) => std::fs::metadata(path).map_or(0, |info| info.len()),
                Content::Text(text) => text.len() as u64,
            };
            zip.start_file(name.as_str(), options.large_file(size >= LARGE)).map_err(failed)?;
            let sum = content.copy(&mut zip, &path)?;
            let _ = writeln!(sums, "{sum}  {name}");
        }
        zip.start_file(CHECKSUMS, options).map_err(failed)?;
        zip.write_all(sums.as_bytes()).map_err(|error| unwritable(&path, error))?;
        // What `unpack` opens, and what other programs show.
        let environment = self.environment.iter().map(|name| format!("\n{ENVIRONMENT}{name}"));
        zip.set_comment(format!("{SCENE}{}{}", self.scene, environment.collect::<String>())).map_err(failed)?;
        zip.finish().map_err(failed)?;
        Ok(out.finish()?)
    }

    /// Writes the files into a folder, which is made where it is not there.
    ///
    /// # Errors
    /// When a file cannot be read or written.
    pub fn write_folder(&self, folder: &Path) -> Result<(), PackError> {
        let mut sums = String::new();
        for (name, content) in &self.files {
            let path = folder.join(text_to_path(name));
            if let Some(parent) = path.parent() {
                let no_folder = |source| WriteError::NoFolder { folder: parent.to_path_buf(), source };
                std::fs::create_dir_all(parent).map_err(no_folder)?;
            }
            let mut out = WholeFile::begin(&path, crate::scene::whole_file::Replace::Anything)?;
            let sum = content.copy(&mut out, &path)?;
            out.finish()?;
            let _ = writeln!(sums, "{sum}  {name}");
        }
        Ok(write_whole(&folder.join(CHECKSUMS), sums.as_bytes())?)
    }
}

impl Content {
    /// Copies it to `out`, and answers with its checksum in hexadecimal.
    ///
    /// - `path`: of the output, for messages.
    fn copy(&self, out: &mut impl Write, path: &Path) -> Result<String, PackError> {
        let mut sum = Sha256::new();
        let mut write = |bytes: &[u8]| {
            sum.update(bytes);
            out.write_all(bytes).map_err(|error| PackError::Write(unwritable(path, error)))
        };
        match self {
            Self::Text(text) => write(text.as_bytes())?,
            Self::File(path) => {
                let failed = |source| PackError::Read { path: path.clone(), source };
                let mut file = InputFile::open_within(path, FileKind::Film, u64::MAX).map_err(failed)?;
                let mut buffer = vec![0; 1 << 16];
                loop {
                    match file.read(&mut buffer).map_err(|error| failed(error.into()))? {
                        0 => break,
                        n => write(&buffer[..n])?,
                    }
                }
            }
        }
        Ok(hexadecimal(sum))
    }
}

/// A checksum as text.
pub(super) fn hexadecimal(sum: Sha256) -> String {
    sum.finalize().iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}

/// Where a file lies, from the root of the system, without `.` and `..`; links in it are not followed, so that what is
/// named relative to it is found.
fn place(path: &Path) -> PathBuf {
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    let mut place = PathBuf::new();
    for part in absolute.components() {
        match part {
            Component::ParentDir => drop(place.pop()),
            Component::CurDir => {}
            part => place.push(part),
        }
    }
    // Behind a link, `..` leads elsewhere.
    match (place.canonicalize(), absolute.canonicalize()) {
        (Ok(a), Ok(b)) if a != b => b,
        _ => place,
    }
}

/// The innermost folder that all files are below.
fn common_folder<'a>(places: impl Iterator<Item = &'a PathBuf>) -> PathBuf {
    let mut common: Option<PathBuf> = None;
    for place in places {
        let folder = place.parent().unwrap_or(place);
        common = Some(match common {
            None => folder.to_path_buf(),
            Some(common) => {
                common.components().zip(folder.components()).take_while(|(a, b)| a == b).map(|(a, _)| a).collect()
            }
        });
    }
    common.unwrap_or_default()
}

/// Refuses a model or a library that names one of the files by its absolute path.
fn check_names<'a>(path: &Path, files: impl Iterator<Item = &'a PathBuf>) -> Result<(), PackError> {
    let failed = |source| PackError::Read { path: path.to_path_buf(), source };
    let text = InputFile::open(path, FileKind::Library).and_then(InputFile::bytes).map_err(failed)?;
    let text = String::from_utf8_lossy(&text);
    for file in files {
        if file.to_str().is_some_and(|file| text.contains(file)) {
            return Err(PackError::Absolute { model: path.to_path_buf(), file: file.clone() });
        }
    }
    Ok(())
}

/// The text of a scene file in which every absolute path counts from the file; `None` where there is none.
fn with_relative_paths(path: &Path) -> Result<Option<String>, PackError> {
    let failed = |source| PackError::Read { path: path.to_path_buf(), source };
    let text = InputFile::open(path, FileKind::Scene).and_then(InputFile::text).map_err(failed)?;
    let mut file = SceneFile::parse(&text, path)?;
    let place_of_file = place(path);
    let folder = place_of_file.parent().unwrap_or(Path::new("/"));
    let mut has_changed = false;
    each_path(&mut file, |name| {
        if text_to_path(name).is_absolute() {
            *name = relative_to(folder, &place(&text_to_path(name)));
            has_changed = true;
        }
    });
    Ok(has_changed.then(|| file.to_ron()))
}

/// How to get from one place to another; even where they share no more than the root, as they do in a package.
fn relative_to(folder: &Path, place: &Path) -> String {
    let (from, to): (Vec<_>, Vec<_>) = (folder.components().collect(), place.components().collect());
    let shared = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    if shared == 0 {
        return relative_path(folder, place);
    }
    let up = std::iter::repeat_n("..".to_owned(), from.len() - shared);
    let down = to[shared..].iter().map(|part| path_to_text(part.as_ref()));
    up.chain(down).collect::<Vec<_>>().join("/")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_have_one_name_and_one_folder_above_them() {
        assert_eq!(place(Path::new("/a/b/../c/./d")), Path::new("/a/c/d"));
        let places = ["/a/b/c.ron", "/a/d/e.obj", "/a/b/f/g.png"].map(PathBuf::from);
        assert_eq!(common_folder(places.iter()), Path::new("/a"));
        assert_eq!(common_folder(places[..1].iter()), Path::new("/a/b"));
        assert_eq!(relative_to(Path::new("/a/b"), Path::new("/a/d/e")), "../d/e");
        assert_eq!(relative_to(Path::new("/a/b"), Path::new("/c/d")), "../../c/d");
    }
}
