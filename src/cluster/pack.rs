//! A scene with all of its files, for other machines: every mesh, texture and image, under names that count from one folder,
//! with checksums.
//!
//! What lies in the folder of the scene, or of the model that is opened, keeps its place there; what a scene takes from
//! elsewhere, also by a symbolic link, goes to `outside/1`, `outside/2` …, a folder for each model with all that the model
//! names, and the scene file is rewritten, so that a package names no folder of this computer. Nothing in models and images
//! is rewritten: a scene from elsewhere that an image shows goes beside the image. Only what was read as what it is named
//! for is packed. The package of the same files has the same bytes. Start reading at [`Package::of`].

use crate::cluster::names::{
    ArchiveNames, NotUtf8, OUTSIDE, checksum_line, common_folder, is_portable, place, place_behind_link, place_in,
    turns_back,
};
use crate::files::printable;
use crate::files::relative::relative_by_name;
use crate::files::whole_file::{WholeFile, unwritable, write_whole};
use crate::format::SceneFile;
use crate::format::choice::{ModelChoice, UpAxis};
use crate::format::scene_format::SceneFormat;
use crate::scene::{
    FileKind, ImageMetadata, ImageScene, InputFile, LoadedScene, ReadError, ReadFiles, SceneError, SceneSource,
    WriteError, builtin_text, each_path, path_to_text, text_to_path,
};
use serde::{Deserialize, Serialize};
use serde_json::json;
use sha2::{Digest, Sha256};
use std::collections::{BTreeMap, HashMap};
use std::fmt::Write as _;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

/// The list of checksums in a package, as `sha256sum --check` reads it.
pub const CHECKSUMS: &str = "SHA256SUMS";
/// First words of the comment of an archive, before the name of the scene, and before that of the environment image.
pub(super) const SCENE: &str = "scene: ";
pub(super) const ENVIRONMENT: &str = "environment: ";
/// Likewise, before an [`Opening`] as JSON.
pub(super) const OPENING: &str = "options: ";

/// How a scene was opened that was packed: so it is opened again.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Opening {
    /// The up axis of a model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub up: Option<UpAxis>,
    /// What was chosen of it. Files outside of its folder are in the package, and never read.
    #[serde(flatten)]
    pub choice: ModelChoice,
}

/// What is in a package.
#[derive(Clone, Debug)]
pub struct Package {
    /// What is to be opened in it: a name in the package.
    pub scene: String,
    /// The image that lights the scene instead of its own environment, likewise.
    pub environment: Option<String>,
    /// How it is to be opened.
    pub opening: Opening,
    /// By name, with `/` between the parts.
    files: BTreeMap<String, PackedContent>,
    /// Files from outside of the folder of what was opened, with their names in the package.
    pub outside: Vec<(PathBuf, String)>,
}

#[derive(Clone, Debug)]
enum PackedContent {
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
    /// A model names a file by a way that a package does not have.
    #[error("{}: is named through a symbolic link and out of it again: name its own path", .0.display())]
    ThroughLink(PathBuf),
    /// A file has the name of the list of checksums.
    #[error("{}: would be `{CHECKSUMS}` in the package, the list of checksums: rename it", .0.display())]
    Reserved(PathBuf),
    /// The scene in an image names files that would not be found, and is not to be rewritten.
    #[error("{}: its scene would not find its files in a package: pack what `firstlight save` makes of it", .0.display())]
    Image(PathBuf),
    /// The file that an image names as its scene was not read as one.
    #[error(
        "{}: the file that it names as its scene was not read as one: pack what `firstlight save` makes of it",
        .0.display()
    )]
    NoScene(PathBuf),
    /// Two files have one name in the package.
    #[error("{} and {}: would both be `{}` in the package: rename one of them", first.display(), second.display(), name)]
    Twice {
        /// A file.
        first: PathBuf,
        /// Another one.
        second: PathBuf,
        /// The name.
        name: String,
    },
    /// A name is none for all systems.
    #[error(
        "`{}` cannot be in an archive: rename it without line breaks, other control characters, `\\` and `:`",
        printable::name(.0)
    )]
    Unportable(String),
    /// An archive has no place for so long options.
    #[error("the values of `-D` are too long for an archive: write them into the scene")]
    Options,
    /// A path is not UTF-8.
    #[error(transparent)]
    Name(#[from] NotUtf8),
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
        let home = source.path().map(|path| common_folder([place(path)].iter()));
        let has_text = scene.shot.as_ref().is_some_and(|shot| shot.text.is_some());
        // Nothing in a model is rewritten: all that it names keeps its place, wherever the user lets it read.
        let is_model = matches!(scene.source, SceneSource::Model(_) | SceneSource::Foreign(_)) && !has_text;
        let of_model = reads.iter().flat_map(|read| &read.files).map(|path| place(path)).filter(|_| is_model);
        let base = base_of(scene, source, home.clone(), of_model.collect())?;
        let is_new = |path: &PathBuf| reads.iter().all(|read| read.files.first() != Some(path));
        if let Some(path) = scene.environment.clone().filter(is_new) {
            // Of the command line: no name in the scene stands for it.
            reads.push(ReadFiles { name: String::new(), files: vec![path] });
        }
        let mut names = ArchiveNames::new(home, base, is_model, &reads);
        let all: Vec<PathBuf> = reads.iter().flat_map(|read| &read.files).map(|path| place(path)).collect();
        let mut files = BTreeMap::new();
        // By the name in the scene.
        let mut named: HashMap<String, String> = HashMap::new();
        for read in &reads {
            let packed = names.of(&read.files)?;
            if !read.name.is_empty() {
                named.insert(scene.path_of_name(&read.name).to_owned(), packed[0].clone());
            }
            // The names in a model are not rewritten.
            if let Some(path) = read.files.iter().skip(1).find(|path| place_behind_link(path).is_some()) {
                return Err(PackError::ThroughLink(path.clone()));
            }
            for (path, name) in read.files.iter().zip(packed) {
                let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
                if extension == "mtl" || extension == "gltf" || SceneFormat::of(path).is_some() {
                    check_names(path, all.iter())?;
                }
                put(&mut files, name, path)?;
            }
        }
        let environment = match &scene.environment {
            Some(path) => Some(names.of(std::slice::from_ref(path))?.remove(0)),
            None => None,
        };
        let mut scene_name = String::new();
        if let Some(path) = scene.source.path() {
            scene_name = names.keep(path)?;
            put(&mut files, scene_name.clone(), path)?;
        }
        if let SceneSource::Scene(path) = &scene.source
            && let Some(text) = renamed(path, &scene_name, scene, &named)?
        {
            files.insert(scene_name.clone(), PackedContent::Text(text));
        }
        match source {
            SceneSource::Builtin(name) => {
                scene_name = format!("{name}.ron");
                let text = builtin_text(name).unwrap_or_default().to_owned();
                files.insert(scene_name.clone(), PackedContent::Text(text));
            }
            SceneSource::Picture(path) => {
                let folder = Path::new(&scene_name).parent().unwrap_or(Path::new(""));
                let is_found = |(name, packed): (&String, &String)| {
                    !turns_back(name) && place_in(folder, name).as_ref() == Some(packed)
                };
                if has_text && !named.iter().all(is_found) {
                    return Err(PackError::Image(path.clone()));
                }
                scene_name = names.opened(path)?;
                put(&mut files, scene_name.clone(), path)?;
            }
            SceneSource::Scene(_) | SceneSource::Foreign(_) | SceneSource::Model(_) => {}
        }
        if let Some(PackedContent::File(path)) = files.get(CHECKSUMS) {
            return Err(PackError::Reserved(path.clone()));
        }
        Ok(Self { scene: scene_name, environment, opening: Opening::default(), files, outside: names.outside })
    }

    /// ArchiveNames of all files.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.files.keys().map(String::as_str)
    }

    /// Writes a zip archive.
    ///
    /// # Errors
    /// When a file cannot be read, or the archive cannot be written.
    pub fn write_zip(&self, mut out: WholeFile) -> Result<(), PackError> {
        if let Some(name) = self.names().find(|name| !is_portable(name)) {
            return Err(PackError::Unportable(name.to_owned()));
        }
        /// From here on sizes take eight bytes.
        const LARGE: u64 = u32::MAX as u64;
        let path = out.path().to_path_buf();
        let failed = |error: zip::result::ZipError| PackError::Write(unwritable(&path, error));
        let mut zip = ZipWriter::new_stream(UntilFailure { out: &mut out, has_failed: false });
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Deflated)
            .last_modified_time(zip::DateTime::default())
            .unix_permissions(0o644);
        let mut sums = String::new();
        for (name, content) in &self.files {
            let size = match content {
                PackedContent::File(path) => std::fs::metadata(path).map_or(0, |info| info.len()),
                PackedContent::Text(text) => text.len() as u64,
            };
            zip.start_file(name.as_str(), options.large_file(size >= LARGE)).map_err(failed)?;
            let sum = content.copy(&mut zip, &path)?;
            sums += &checksum_line(&sum, name);
        }
        zip.start_file(CHECKSUMS, options).map_err(failed)?;
        zip.write_all(sums.as_bytes()).map_err(|error| unwritable(&path, error))?;
        // What `unpack` opens, and what other programs show.
        let environment = self.environment.iter().map(|name| format!("\n{ENVIRONMENT}{name}"));
        let opening = (self.opening != Opening::default()).then(|| json!(self.opening));
        let opening = opening.iter().map(|opening| format!("\n{OPENING}{opening}"));
        let comment = format!("{SCENE}{}{}", self.scene, environment.chain(opening).collect::<String>());
        if comment.len() > usize::from(u16::MAX) {
            return Err(PackError::Options);
        }
        zip.set_comment(comment).map_err(failed)?;
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
            let mut out = WholeFile::begin(&path, crate::files::whole_file::Replace::Anything)?;
            let sum = content.copy(&mut out, &path)?;
            out.finish()?;
            sums += &checksum_line(&sum, name);
        }
        Ok(write_whole(&folder.join(CHECKSUMS), sums.as_bytes())?)
    }
}

/// Fails once: after a failure, which has been told by then, an archive that is dropped tries to write its end, and
/// would complain in its own words.
struct UntilFailure<'a> {
    out: &'a mut WholeFile,
    has_failed: bool,
}

impl Write for UntilFailure<'_> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        if self.has_failed {
            return Ok(bytes.len());
        }
        let result = self.out.write(bytes);
        self.has_failed = result.as_ref().is_err_and(|error| error.kind() != std::io::ErrorKind::Interrupted);
        result
    }

    fn flush(&mut self) -> std::io::Result<()> {
        if self.has_failed { Ok(()) } else { self.out.flush() }
    }
}

impl PackedContent {
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

/// The folder whose files keep their places in the package.
///
/// - `home`: the folder of what was opened.
/// - `of_model`: the files of the scene, where it is a model.
fn base_of(
    scene: &LoadedScene,
    source: &SceneSource,
    home: Option<PathBuf>,
    of_model: Vec<PathBuf>,
) -> Result<Option<PathBuf>, PackError> {
    let SceneSource::Picture(path) = source else {
        let of_model = (!of_model.is_empty()).then(|| common_folder(of_model.iter().chain(&source.path().map(place))));
        return Ok(of_model.or(home));
    };
    let names_file = |shot: &ImageMetadata| matches!(shot.scene, ImageScene::Scene(_) | ImageScene::Model { .. });
    if scene.source == *source && scene.shot.as_ref().is_some_and(names_file) {
        return Err(PackError::NoScene(path.clone()));
    }
    // An image finds its scene where it was, or beside itself.
    let is_elsewhere = |file: &PathBuf| !home.as_ref().is_some_and(|home| file.starts_with(home));
    let scene_file = scene.source.path().map(place).filter(is_elsewhere);
    let base = scene_file.map(|file| common_folder([file].iter())).or(home);
    let is_lost = |path: &PathBuf| !base.as_ref().is_some_and(|base| path.starts_with(base));
    if of_model.iter().any(is_lost) { Err(PackError::Image(path.clone())) } else { Ok(base) }
}

/// Adds a file under its name in the package.
fn put(files: &mut BTreeMap<String, PackedContent>, name: String, path: &Path) -> Result<(), PackError> {
    if let Some(PackedContent::File(first)) = files.get(&name)
        && place(first) != place(path)
    {
        return Err(PackError::Twice { first: first.clone(), second: path.to_path_buf(), name });
    }
    files.insert(name, PackedContent::File(path.to_path_buf()));
    Ok(())
}

/// Refuses a model or a library that names one of the files by its absolute path.
fn check_names<'a>(path: &Path, files: impl Iterator<Item = &'a PathBuf>) -> Result<(), PackError> {
    let failed = |source| PackError::Read { path: path.to_path_buf(), source };
    let text = InputFile::open(path, FileKind::Scene).and_then(InputFile::bytes).map_err(failed)?;
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
            Some(packed) if !turns_back(path) && place_in(folder, path).as_deref() == Some(packed) => return,
            Some(packed) => packed.clone(),
            // Not read, because another image lights the scene.
            None if place_in(folder, path).is_some() => return,
            None => {
                let last = text_to_path(path).file_name().map(|name| path_to_text(name.as_ref()));
                format!("{OUTSIDE}/{}", last.unwrap_or_default())
            }
        };
        let renamed = relative_by_name(folder, Path::new(&inside)) + &name[path.len()..];
        *name = renamed;
        has_changed = true;
    });
    Ok(has_changed.then(|| file.to_ron()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{LoadOptions, load};

    /// The package of what is opened, in a folder elsewhere, and how many of its textures are found there.
    fn textures_of_packed(path: &Path) -> Result<usize, PackError> {
        let loaded = |path: &Path| {
            let source = SceneSource::parse(path).unwrap();
            (load(&source, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}")), source)
        };
        let (scene, source) = loaded(path);
        let package = Package::of(&scene, &source)?;
        let there = tempfile::tempdir().unwrap();
        package.write_folder(there.path())?;
        let reads = loaded(&there.path().join(&package.scene)).0.read_files();
        let is_texture = |path: &&PathBuf| path.extension().is_some_and(|extension| extension == "png");
        Ok(reads.iter().flat_map(|read| &read.files).filter(is_texture).count())
    }

    fn write(folder: &Path, name: &str, text: &str) -> PathBuf {
        std::fs::write(folder.join(name), text).unwrap();
        folder.join(name)
    }

    fn scene(texture: &str) -> String {
        format!(
            "(camera: (eye: (0, 0, 3), look_at: (0, 0, 0)), textures: {{\"t\": image(file: \"{texture}\")}}, \
             materials: {{\"m\": diffuse(albedo: \"t\")}}, objects: [sphere(radius: 1, material: \"m\")])"
        )
    }

    /// A package has files, and the folders that these are in: no others.
    #[test]
    fn names_that_lead_through_a_folder_and_back_are_found_in_a_package() {
        let root = tempfile::tempdir().unwrap();
        let home = root.path().join("home");
        std::fs::create_dir_all(home.join("x/y")).unwrap();
        let image = image::RgbImage::new(2, 2);
        for name in ["home/t.png", "home/SHA256SUMS.png", "t.png"] {
            image.save(root.path().join(name)).unwrap();
        }
        for name in ["t.png", "x/../t.png", "x/y/../../t.png", "../home/x/../t.png", "x/../../t.png"] {
            assert_eq!(textures_of_packed(&write(&home, "s.ron", &scene(name))).unwrap(), 1, "{name}");
        }
        let mesh = "mtllib x/../m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\n";
        let model = write(&home, "m.obj", mesh);
        for name in ["t.png", "x/../t.png", "x/y/../../t.png"] {
            write(&home, "m.mtl", &format!("newmtl a\nmap_Kd {name}\n"));
            assert_eq!(textures_of_packed(&model).unwrap(), 1, "{name}");
        }
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink("x/y", home.join("link")).unwrap();
            image.save(home.join("x/t.png")).unwrap();
            assert_eq!(textures_of_packed(&write(&home, "s.ron", &scene("link/../t.png"))).unwrap(), 1);
            write(&home, "m.mtl", "newmtl a\nmap_Kd link/../t.png\n");
            assert!(matches!(textures_of_packed(&model), Err(PackError::ThroughLink(_))));
        }
        std::fs::rename(home.join("SHA256SUMS.png"), home.join(CHECKSUMS)).unwrap();
        let reserved = textures_of_packed(&write(&home, "s.ron", &scene(CHECKSUMS)));
        assert!(reserved.unwrap_err().to_string().ends_with("the list of checksums: rename it"));
    }
}
