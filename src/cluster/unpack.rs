//! Opens the archive of a packed scene: unpacks it into a cache folder, once.
//!
//! Every file must be in the list of checksums and have its sum, and no name may lead out of the folder. The folder is
//! named after the archive's own checksum; one in which a file has changed since is left alone, and another one is made.

use crate::cluster::names::is_portable;
use crate::cluster::pack::{CHECKSUMS, ENVIRONMENT, OPENING, Opening, SCENE, hexadecimal};
use crate::files::printable;
use crate::files::whole_file::lock_file;
use crate::format::model_format::ModelFormat;
use crate::format::scene_format::SceneFormat;
use crate::scene::{FileKind, InputFile, Limits, ReadError, WriteError, path_to_text, text_to_path};
use sha2::{Digest, Sha256};
use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use zip::ZipArchive;

/// Number of places that are tried for one archive.
const MOST_PLACES: u32 = 1000;
/// Bytes of the list of checksums.
const MOST_SUMS: u64 = 64 << 20;
/// Compression ratio above which a file is refused; Deflate reaches 1032.
const MOST_RATIO: u64 = 1100;
/// Bytes of all files for each byte of the archive, above [`SMALL`].
const MOST_RATIO_OF_ALL: u64 = 200;
/// Bytes of all files that any archive may have.
const SMALL: u64 = 256 << 20;
/// Files of an archive.
const MOST_FILES: usize = 100_000;
/// Folders of an archive: one name can have two thousand.
const MOST_FOLDERS: usize = 20_000;
/// Folders of an archive that lie in one another.
const MOST_DEPTH: usize = 64;
/// Beginning of the names of folders that are being written.
const PART: &str = ".part-";

/// A scene from an archive.
#[derive(Clone, Debug, PartialEq)]
pub struct Unpacked {
    /// What is to be opened.
    pub scene: PathBuf,
    /// The image that lights the scene instead of its own environment.
    pub environment: Option<PathBuf>,
    /// How it is opened, where the user does not say otherwise.
    pub opening: Opening,
}

/// Why an archive is not opened. The text follows the path of the archive.
#[derive(Debug, thiserror::Error)]
pub enum UnpackError {
    /// It cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// It is no archive, or damaged.
    #[error("is not a readable archive: {0}")]
    Archive(#[from] zip::result::ZipError),
    /// Its options are none.
    #[error("has options that cannot be read ({0}): it was not made by `firstlight pack`")]
    Options(#[from] serde_json::Error),
    /// A name leads out of the folder, or is none that all systems know.
    #[error("`{}` in the archive does not stay in its folder: it was not made by `firstlight pack`", printable::name(.0))]
    Name(String),
    /// The list of checksums is missing, or not what it should be.
    #[error("has no valid list of checksums ({CHECKSUMS}): make it with `firstlight pack`")]
    NoSums,
    /// A file is damaged, or in one of archive and list only.
    #[error("`{}` in the archive is damaged or not in {CHECKSUMS}: copy the archive again", printable::name(.0))]
    Damaged(String),
    /// Two files have one place, or one is the folder of the other.
    #[error("`{}` in the archive takes the place of another file: it was not made by `firstlight pack`", printable::name(.0))]
    Twice(String),
    /// There are too many files.
    #[error("has {0} files, more than the {MOST_FILES} of the largest scenes")]
    TooMany(usize),
    /// There are too many folders.
    #[error("has {0} folders, more than the {MOST_FOLDERS} of the largest scenes")]
    TooManyFolders(usize),
    /// A file is in too many folders.
    #[error("`{}` in the archive is in more than {MOST_DEPTH} folders", printable::name(.0))]
    TooDeep(String),
    /// All files together are too large.
    #[error(
        "would take {size} bytes on the disk, above the limit of {limit} bytes for an archive of this size: {}",
        Limits::advice()
    )]
    TooLargeTogether {
        /// Bytes of all files.
        size: u64,
        /// Bytes that they may have.
        limit: u64,
    },
    /// A file is too large to be true.
    #[error("`{}` in the archive is implausibly large: it was not made by `firstlight pack`", printable::name(.0))]
    TooLarge(String),
    /// It does not say which scene is to be opened.
    #[error("does not say which scene to open: unpack it, and open one of its files")]
    NoScene,
    /// A file cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// Whether a path is named like an archive.
pub fn is_archive(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("zip"))
}

/// Unpacks an archive into a folder below `cache`, unless it is there already.
///
/// # Errors
/// If it cannot be read, is damaged or was not made by `firstlight pack`, or if files cannot be written.
pub fn unpack(archive: &Path, cache: &Path) -> Result<Unpacked, UnpackError> {
    let open = || InputFile::open_within(archive, FileKind::Film, u64::MAX);
    let sum = sum_of(&mut open()?)?;
    let mut zip = ZipArchive::new(open()?)?;
    let sums = sums_of(&mut zip)?;
    check_entries(&mut zip, &sums, std::fs::metadata(archive).map_or(0, |info| info.len()))?;
    let scene = scene_in(zip.comment(), &sums)?;
    for number in 1..MOST_PLACES {
        let name = &sum[..32];
        let folder = cache.join(if number == 1 { name.to_owned() } else { format!("{name}-{number}") });
        let is_there = folder.exists();
        if is_there && !holds(&folder, &sums) {
            continue;
        }
        if !is_there {
            extract(&mut zip, &sums, cache, &folder)?;
        }
        let place = |name: &String| folder.join(text_to_path(name));
        let environment = scene.1.as_ref().map(place);
        return Ok(Unpacked { scene: place(&scene.0), environment, opening: opening_in(zip.comment())? });
    }
    Err(UnpackError::NoScene)
}

/// Writes all files into a folder beside the wanted one, which then gets its name.
fn extract(
    zip: &mut ZipArchive<InputFile>,
    sums: &BTreeMap<String, String>,
    cache: &Path,
    folder: &Path,
) -> Result<(), UnpackError> {
    let no_folder = |folder: &Path| {
        let folder = folder.to_path_buf();
        move |source| WriteError::NoFolder { folder, source }
    };
    std::fs::create_dir_all(cache).map_err(no_folder(cache))?;
    let _lock = lock(cache);
    let part = tempfile::Builder::new().prefix(PART).tempdir_in(cache).map_err(no_folder(cache))?;
    // A message names where the file would have been, which is what the user can look up.
    let told = |path: &Path| folder.join(path.strip_prefix(part.path()).unwrap_or(path));
    for i in 0..zip.len() {
        let mut file = zip.by_index(i)?;
        let name = name_of(&file)?;
        if name == CHECKSUMS {
            continue;
        }
        let expected = sums.get(&name).ok_or_else(|| UnpackError::Damaged(name.clone()))?;
        let most = file.compressed_size().saturating_mul(MOST_RATIO).saturating_add(1 << 16);
        if file.size() > most {
            return Err(UnpackError::TooLarge(name));
        }
        let path = part.path().join(text_to_path(&name));
        let parent = path.parent().unwrap_or(part.path());
        std::fs::create_dir_all(parent).map_err(no_folder(&told(parent)))?;
        let failed = |error| crate::files::whole_file::unwritable(&told(&path), error);
        let mut out = std::fs::File::create_new(&path).map_err(failed)?;
        // No more than what the archive says is written.
        let size = file.size();
        let mut sum = Sha256::new();
        let mut limited = (&mut file).take(size);
        let mut buffer = vec![0; 1 << 16];
        loop {
            // A wrong CRC is an error of the last read.
            match limited.read(&mut buffer).map_err(|_| UnpackError::Damaged(name.clone()))? {
                0 => break,
                n => {
                    sum.update(&buffer[..n]);
                    out.write_all(&buffer[..n]).map_err(failed)?;
                }
            }
        }
        if hexadecimal(sum) != *expected {
            return Err(UnpackError::Damaged(name));
        }
    }
    if let Some(missing) = sums.keys().find(|name| !part.path().join(text_to_path(name)).is_file()) {
        return Err(UnpackError::Damaged(missing.clone()));
    }
    let part = part.keep();
    if let Err(source) = std::fs::rename(&part, folder) {
        let _ = std::fs::remove_dir_all(&part);
        // Another process was faster.
        if !holds(folder, sums) {
            return Err(WriteError::NoFolder { folder: folder.to_path_buf(), source }.into());
        }
    }
    Ok(())
}

/// Checks names, number and sizes of all files before the first is written.
///
/// - `length`: of the archive, bytes.
fn check_entries(
    zip: &mut ZipArchive<InputFile>,
    sums: &BTreeMap<String, String>,
    length: u64,
) -> Result<(), UnpackError> {
    if zip.len() > MOST_FILES {
        return Err(UnpackError::TooMany(zip.len()));
    }
    let (mut names, mut places) = (HashSet::new(), BTreeSet::new());
    // Where the bytes of each file begin and end, with its name.
    let mut spans = Vec::new();
    let mut size = 0_u64;
    for i in 0..zip.len() {
        let file = zip.by_index_raw(i)?;
        let name = name_of(&file)?;
        let Some(data) = file.data_start() else { return Err(UnpackError::Damaged(name)) };
        spans.push((file.header_start(), data.saturating_add(file.compressed_size()), name.clone()));
        // Two names may be spellings of one.
        if !places.insert(text_to_path(&name)) {
            return Err(UnpackError::Twice(name));
        }
        names.insert(name);
        size = size.saturating_add(file.size());
    }
    // The same bytes for several files.
    spans.sort_unstable();
    if let Some([_, (.., shared)]) = spans.array_windows().find(|[(_, end, _), (next, ..)]| next < end) {
        return Err(UnpackError::Damaged(shared.clone()));
    }
    // What is below a file follows it.
    let mut pairs = places.iter().zip(places.iter().skip(1));
    if let Some((_, below)) = pairs.find(|(file, next)| next.starts_with(file)) {
        return Err(UnpackError::Twice(path_to_text(below)));
    }
    let n_folders = count_folders(&places)?;
    if n_folders > MOST_FOLDERS {
        return Err(UnpackError::TooManyFolders(n_folders));
    }
    // In the list there may be any path of this computer.
    if let Some(missing) = sums.keys().find(|name| !names.contains(*name) || *name == CHECKSUMS) {
        return Err(UnpackError::Damaged(missing.clone()));
    }
    let limit = Limits::of_this_process().archive_bytes.min(length.saturating_mul(MOST_RATIO_OF_ALL).max(SMALL));
    if size > limit { Err(UnpackError::TooLargeTogether { size, limit }) } else { Ok(()) }
}

/// Number of folders that files have.
fn count_folders(files: &BTreeSet<PathBuf>) -> Result<usize, UnpackError> {
    let mut n_folders = 0;
    let mut before = Path::new("");
    for file in files {
        let folder = file.parent().unwrap_or(Path::new(""));
        let depth = folder.components().count();
        if depth > MOST_DEPTH {
            return Err(UnpackError::TooDeep(path_to_text(file)));
        }
        // What is in one folder follows one another.
        n_folders += depth - folder.components().zip(before.components()).take_while(|(a, b)| a == b).count();
        before = folder;
    }
    Ok(n_folders)
}

/// Locks the cache for writing, shared with other processes that unpack. Where there are none, what interrupted ones have
/// left is removed first. Without a lock, as on file systems that have none, nothing is removed.
fn lock(cache: &Path) -> Option<std::fs::File> {
    let file = lock_file(&cache.join(".lock")).ok()?;
    if file.try_lock().is_ok() {
        for entry in std::fs::read_dir(cache).into_iter().flatten().flatten() {
            if entry.file_name().as_encoded_bytes().starts_with(PART.as_bytes()) {
                let _ = std::fs::remove_dir_all(entry.path());
            }
        }
        file.unlock().ok()?;
    }
    file.lock_shared().ok().map(|()| file)
}

/// Whether a folder has exactly these contents in these files.
fn holds(folder: &Path, sums: &BTreeMap<String, String>) -> bool {
    sums.iter().all(|(name, sum)| {
        let file = InputFile::open_within(&folder.join(text_to_path(name)), FileKind::Film, u64::MAX);
        file.and_then(|mut file| sum_of(&mut file)).is_ok_and(|found| found == *sum)
    })
}

fn sum_of(file: &mut InputFile) -> Result<String, ReadError> {
    let mut sum = Sha256::new();
    let mut buffer = vec![0; 1 << 16];
    loop {
        match file.read(&mut buffer)? {
            0 => return Ok(hexadecimal(sum)),
            n => sum.update(&buffer[..n]),
        }
    }
}

/// The name of a regular file that stays in its folder.
fn name_of<R: Read>(file: &zip::read::ZipFile<R>) -> Result<String, UnpackError> {
    let name = file.name()?.into_owned();
    if is_portable(&name) && !file.is_symlink() && !file.is_dir() { Ok(name) } else { Err(UnpackError::Name(name)) }
}

/// The checksums by name.
fn sums_of(zip: &mut ZipArchive<InputFile>) -> Result<BTreeMap<String, String>, UnpackError> {
    let mut text = String::new();
    let file = zip.by_name(CHECKSUMS).map_err(|_| UnpackError::NoSums)?;
    file.take(MOST_SUMS).read_to_string(&mut text).map_err(|_| UnpackError::NoSums)?;
    let mut sums = BTreeMap::new();
    for line in text.lines() {
        let (sum, name) = line.split_once("  ").filter(|(sum, _)| sum.len() == 64).ok_or(UnpackError::NoSums)?;
        if sums.insert(name.to_owned(), sum.to_owned()).is_some() {
            return Err(UnpackError::NoSums);
        }
    }
    Ok(sums)
}

/// The scene, and the environment image: as the comment says, or else the only scene file, scene of another renderer or
/// model.
fn scene_in(comment: &[u8], sums: &BTreeMap<String, String>) -> Result<(String, Option<String>), UnpackError> {
    let comment = String::from_utf8_lossy(comment);
    let named = |what: &str| comment.lines().find_map(|line| line.strip_prefix(what)).map(str::to_owned);
    let is_there = |name: &String| sums.contains_key(name);
    if let Some(scene) = named(SCENE).filter(is_there) {
        return Ok((scene, named(ENVIRONMENT).filter(is_there)));
    }
    let only = |wanted: &dyn Fn(&Path) -> bool| {
        let mut names = sums.keys().filter(|name| wanted(Path::new(name)));
        names.next().filter(|_| names.next().is_none()).cloned()
    };
    let is_scene = |path: &Path| path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("ron"));
    // Many a file is JSON that is no scene.
    let is_json = |path: &Path| SceneFormat::of(path) == Some(SceneFormat::Tungsten);
    let is_foreign = |path: &Path| SceneFormat::of(path).is_some() && !is_json(path);
    let is_model = |path: &Path| ModelFormat::of(path).is_some();
    let kinds: [&dyn Fn(&Path) -> bool; 4] = [&is_scene, &is_foreign, &is_model, &is_json];
    let kind = kinds.into_iter().find(|kind| sums.keys().any(|name| kind(Path::new(name))));
    let found = kind.and_then(only);
    found.map(|scene| (scene, None)).ok_or(UnpackError::NoScene)
}

/// How the scene is opened, as the comment says.
fn opening_in(comment: &[u8]) -> Result<Opening, UnpackError> {
    let comment = String::from_utf8_lossy(comment);
    let opening = comment.lines().find_map(|line| line.strip_prefix(OPENING));
    Ok(opening.map(serde_json::from_str).transpose()?.unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_archive_says_what_to_open_or_has_one_scene_or_model() {
        let sums = |names: &[&str]| names.iter().map(|name| ((*name).to_owned(), String::new())).collect();
        let open = |comment: &str, names: &[&str]| scene_in(comment.as_bytes(), &sums(names)).ok();
        let only = |name: &str| Some((name.to_owned(), None));
        assert_eq!(open("scene: a/b.obj", &["a/b.obj", "s.ron"]), only("a/b.obj"));
        let lit = open("scene: s.ron\nenvironment: e.hdr", &["e.hdr", "s.ron"]);
        assert_eq!(lit, Some(("s.ron".to_owned(), Some("e.hdr".to_owned()))));
        let camera = |comment: &[u8]| opening_in(comment).map(|opening| opening.choice.camera);
        assert_eq!(camera(b"scene: s.ron").unwrap(), None);
        assert_eq!(camera(b"scene: s.ron\noptions: {\"camera\":\"a\",\"allow_outside\":true}").unwrap().unwrap(), "a");
        assert!(camera(b"scene: s.ron\noptions: {").is_err());
        assert_eq!(open("scene: ../x.ron", &["m.glb", "s.ron"]), only("s.ron"));
        assert_eq!(open("", &["m.glb", "m.png"]), only("m.glb"));
        assert_eq!(open("", &["a.pbrt", "m.ply"]), only("a.pbrt"));
        assert_eq!(open("", &["a.ron", "b.ron", "m.glb"]), None);
    }
}
