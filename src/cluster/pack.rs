//! A scene with all of its files, for other machines: every mesh, texture and image, under names that count from one folder,
//! with checksums.
//!
//! A package names no folder of this computer. What lies in the folder of the scene, or of the model that is opened, keeps
//! its place there; what a scene takes from elsewhere goes to `outside/1`, `outside/2` …, a folder for each model with
//! all that the model names, and the scene file is rewritten. Only what was read as what it is named for is packed. The
//! package of the same files has the same bytes. Start reading at [`Package::of`].

use crate::scene::file::SceneFile;
use crate::scene::whole_file::{WholeFile, unwritable, write_whole};
use crate::scene::{
    FileKind, InputFile, LoadedScene, ReadError, ReadFiles, SceneError, SceneSource, WriteError, builtin_text,
    each_path, path_to_text, text_to_path,
};
use sha2::{Digest, Sha256};
use std::collections::{BTreeMap, HashMap};
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
/// The folder of what is not in the folder of the scene.
const OUTSIDE: &str = "outside";

/// What is in a package.
#[derive(Clone, Debug)]
pub struct Package {
    /// What is to be opened in it: a name in the package.
    pub scene: String,
    /// The image that lights the scene instead of its own environment, likewise.
    pub environment: Option<String>,
    /// By name, with `/` between the parts.
    files: BTreeMap<String, Content>,
    /// Files from outside of the folder of the scene, with their names in the package.
    pub outside: Vec<(PathBuf, String)>,
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
    /// The scene in an image names files from outside, and is not to be rewritten.
    #[error(
        "{}: its scene has unsaved changes and files from outside of its folder: pack what `firstlight save` makes of it",
        .0.display()
    )]
    Image(PathBuf),
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
        let mut reads = scene.read_files();
        let opened = source.path().map(place);
        // The scene of an image lies where the image says.
        let scene_file = scene.source.path().map(place);
        let own: Vec<PathBuf> = opened.iter().chain(&scene_file).cloned().collect();
        let is_model = matches!(scene.source, SceneSource::Model(_));
        let mut home = common_folder(own.iter());
        if is_model {
            // Nothing in a model is rewritten: all that it names keeps its place.
            let of_model = reads.iter().flat_map(|read| &read.files).map(|path| place(path));
            home = common_folder(of_model.chain(own.iter().cloned()).collect::<Vec<_>>().iter());
        }
        let is_new = |path: &PathBuf| reads.iter().all(|read| read.files.first() != Some(path));
        if let Some(path) = scene.environment.clone().filter(is_new) {
            // Of the command line: no name in the scene stands for it.
            reads.push(ReadFiles { name: String::new(), files: vec![path] });
        }
        let mut names = Names::new(home, &reads, opened.is_some());
        let all: Vec<PathBuf> = reads.iter().flat_map(|read| &read.files).map(|path| place(path)).collect();
        let mut files = BTreeMap::new();
        // By the name in the scene.
        let mut named: HashMap<String, String> = HashMap::new();
        for read in &reads {
            let places: Vec<PathBuf> = read.files.iter().map(|path| place(path)).collect();
            let packed = names.of(&read.files, &places)?;
            named.insert(scene.path_of_name(&read.name).to_owned(), packed[0].clone());
            for (path, name) in read.files.iter().zip(packed) {
                let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
                if extension == "mtl" || extension == "gltf" {
                    check_names(path, all.iter())?;
                }
                files.insert(name, Content::File(path.clone()));
            }
        }
        let environment = match &scene.environment {
            Some(path) => Some(names.of(std::slice::from_ref(path), &[place(path)])?.remove(0)),
            None => None,
        };
        let mut content = |path: &Path, file: &Path| -> Result<String, PackError> {
            let name = names.at_home(&place(path))?;
            files.entry(name.clone()).or_insert_with(|| Content::File(file.to_path_buf()));
            Ok(name)
        };
        let mut scene_name = String::new();
        if let Some(path) = scene.source.path() {
            scene_name = content(path, path)?;
        }
        if let Some(path) = source.path().filter(|_| source != &scene.source) {
            scene_name = content(path, path)?;
        }
        if let SceneSource::Builtin(name) = source {
            scene_name = format!("{name}.ron");
            let text = builtin_text(name).unwrap_or_default().to_owned();
            files.insert(scene_name.clone(), Content::Text(text));
        }
        if let SceneSource::Scene(path) = &scene.source {
            let name = names.at_home(&place(path))?;
            if let Some(text) = renamed(path, &name, scene, &named)? {
                files.insert(name, Content::Text(text));
            }
        }
        if let (SceneSource::Picture(path), false) = (source, names.outside.is_empty())
            && scene.shot.as_ref().is_some_and(|shot| shot.text.is_some())
        {
            return Err(PackError::Image(path.clone()));
        }
        Ok(Self { scene: scene_name, environment, files, outside: names.outside })
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

/// The text of a scene file with the names of a package; `None` where none differs.
///
/// - `name`: of the scene file in the package.
/// - `named`: the name in the package of what a name in the scene stands for.
fn renamed(
    path: &Path,
    name: &str,
    scene: &LoadedScene,
    named: &HashMap<String, String>,
) -> Result<Option<String>, PackError> {
    let failed = |source| PackError::Read { path: path.to_path_buf(), source };
    let text = InputFile::open(path, FileKind::Scene).and_then(InputFile::text).map_err(failed)?;
    let mut file = SceneFile::parse(&text, path)?;
    let folder = Path::new(name).parent().unwrap_or(Path::new(""));
    let mut has_changed = false;
    each_path(&mut file, |name| {
        let path = scene.path_of_name(name);
        let inside = match named.get(path) {
            // Where it is, it is found under its own name.
            Some(packed) if place_in(folder, path).as_deref() == Some(packed) => return,
            Some(packed) => packed.clone(),
            // Not read, because another image lights the scene.
            None if place_in(folder, path).is_some() => return,
            None => {
                let last = text_to_path(path).file_name().map(|name| path_to_text(name.as_ref()));
                format!("{OUTSIDE}/{}", last.unwrap_or_default())
            }
        };
        let renamed = relative_to(folder, Path::new(&inside)) + &name[path.len()..];
        *name = renamed;
        has_changed = true;
    });
    Ok(has_changed.then(|| file.to_ron()))
}

/// Where a name in `folder` leads in a package; `None` out of it.
fn place_in(folder: &Path, name: &str) -> Option<String> {
    let mut place = PathBuf::new();
    for part in folder.join(text_to_path(name)).components() {
        match part {
            Component::Normal(part) => place.push(part),
            Component::CurDir => {}
            Component::ParentDir if place.pop() => {}
            _ => return None,
        }
    }
    Some(path_to_text(&place))
}

/// How to get from one place in a package to another.
fn relative_to(folder: &Path, place: &Path) -> String {
    let (from, to): (Vec<_>, Vec<_>) = (folder.components().collect(), place.components().collect());
    let shared = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    let up = std::iter::repeat_n("..".to_owned(), from.len() - shared);
    let down = to[shared..].iter().map(|part| path_to_text(part.as_ref()));
    up.chain(down).collect::<Vec<_>>().join("/")
}

/// Names of files in a package.
struct Names {
    /// What lies below keeps its place.
    home: PathBuf,
    /// Whether there is a folder that the scene was read from.
    has_home: bool,
    /// Folders elsewhere, with their names.
    folders: HashMap<PathBuf, String>,
    /// The number of the last such name.
    last: usize,
    /// Numbers that files of the home have already, as an unpacked package does.
    taken: Vec<PathBuf>,
    outside: Vec<(PathBuf, String)>,
}

impl Names {
    fn new(home: PathBuf, reads: &[ReadFiles], has_home: bool) -> Self {
        let all = reads.iter().flat_map(|read| &read.files).map(|path| place(path));
        let taken = all.filter_map(|place| Some(place.strip_prefix(&home).ok()?.to_path_buf()));
        let taken = taken.filter(|name| has_home && name.starts_with(OUTSIDE)).collect();
        Self { home, has_home, folders: HashMap::new(), last: 0, taken, outside: Vec::new() }
    }

    /// - `place`: below the home.
    fn at_home(&self, place: &Path) -> Result<String, PackError> {
        text_of(place.strip_prefix(&self.home).unwrap_or(place), place)
    }

    /// Names for a file and those that it names, which stay in their places relative to each other.
    fn of(&mut self, paths: &[PathBuf], places: &[PathBuf]) -> Result<Vec<String>, PackError> {
        if self.has_home && places.iter().all(|place| place.starts_with(&self.home)) {
            return places.iter().map(|place| self.at_home(place)).collect();
        }
        let root = common_folder(places.iter());
        let folder = match self.folders.get(&root) {
            Some(folder) => folder.clone(),
            None => {
                let folder = loop {
                    self.last += 1;
                    let folder = format!("{OUTSIDE}/{}", self.last);
                    if !self.taken.iter().any(|name| name.starts_with(&folder)) {
                        break folder;
                    }
                };
                self.folders.insert(root.clone(), folder.clone());
                folder
            }
        };
        let mut names = Vec::new();
        for (path, place) in paths.iter().zip(places) {
            let name = format!("{folder}/{}", text_of(place.strip_prefix(&root).unwrap_or(place), place)?);
            if !self.outside.iter().any(|(_, known)| *known == name) {
                self.outside.push((path.clone(), name.clone()));
            }
            names.push(name);
        }
        Ok(names)
    }
}

fn text_of(name: &Path, place: &Path) -> Result<String, PackError> {
    name.to_str().map(|_| path_to_text(name)).ok_or_else(|| PackError::Name(place.to_path_buf()))
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
        assert_eq!(relative_to(Path::new("a/b"), Path::new("a/d/e")), "../d/e");
        assert_eq!(relative_to(Path::new(""), Path::new("c/d")), "c/d");
        assert_eq!(place_in(Path::new("a"), "../b/./c"), Some("b/c".to_owned()));
        assert_eq!((place_in(Path::new("a"), "../../b"), place_in(Path::new("a"), "/b")), (None, None));
    }
}
