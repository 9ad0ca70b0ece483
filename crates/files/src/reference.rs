//! Names of other files in a model: which file of this computer is meant, and whether it may be read.
//!
//! One rule for all formats. A model may come from anywhere, so what it names stays in its own folder and below, unless
//! the user allows more; hidden files and addresses of the network are never meant. Names are spelt as programs of other
//! systems do: with `\`, with `%20`, in another case, or from the root of another computer.
//! Start reading at [`References::resolve`].

use crate::printable::name;
use crate::relative::{path_to_text, text_to_path};
use std::collections::HashMap;
use std::ffi::{OsStr, OsString};
use std::path::{Component, Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Bytes of a name, at most: no path is longer.
const LONGEST: usize = 4096;

/// Entries of a folder that are compared with names, at most.
const MAX_ENTRIES: usize = 20_000;

/// The same of all folders: through links, one folder has names without end.
const MAX_ENTRIES_OF_ALL: usize = 10 * MAX_ENTRIES;

/// Parts of a path whose case is looked at, at most: the time for each grows with those before it.
const MAX_PARTS: usize = 32;

/// What the names in a model may refer to: made once for each file that is read.
///
/// It lists a folder once, for all names. What comes into the folder later is found by its exact name only.
#[derive(Debug)]
pub struct References {
    /// The folder of the model.
    folder: PathBuf,
    allow_outside: bool,
    listings: Mutex<Listings>,
}

/// The folders that were listed.
#[derive(Debug, Default)]
struct Listings {
    /// By folder and name in lower case: the name, `None` if there are several.
    by_folder: HashMap<PathBuf, HashMap<String, Option<OsString>>>,
    n_entries: usize,
}

/// What a name refers to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Referred {
    /// Relative to the folder that the name counts from, or absolute where that is allowed; it need not exist.
    pub path: PathBuf,
    /// Whether it differs from the name by the case of letters.
    pub is_renamed: bool,
}

impl Referred {
    /// What the user is told if the file differs from its name in the model by case.
    pub fn difference(&self, name_in_model: &str) -> Option<String> {
        let [wanted, found] = [name_in_model, &path_to_text(&self.path)].map(|it| name(it).into_owned());
        self.is_renamed.then(|| format!("there is no `{wanted}`: `{found}` is read, which differs by case"))
    }
}

impl From<PathBuf> for Referred {
    fn from(path: PathBuf) -> Self {
        Self { path, is_renamed: false }
    }
}

/// A name that refers to a file that may not be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{}` is {why}: only files in the folder of the model and below are read; \
     --allow-outside reads others on this computer as well, never the network",
    name(name_in_model)
)]
pub struct Outside {
    /// The name in the model.
    pub name_in_model: String,
    /// In which way it is outside.
    pub why: &'static str,
}

impl References {
    /// - `model`: the file of the model.
    /// - `allow_outside`: whether files outside of its folder may be read.
    pub fn of(model: &Path, allow_outside: bool) -> Self {
        let folder = model.parent().unwrap_or(Path::new("")).to_owned();
        Self { folder, allow_outside, listings: Mutex::default() }
    }

    /// Whether files outside of the model's folder may be read.
    pub fn allow_outside(&self) -> bool {
        self.allow_outside
    }

    /// The file that is meant.
    ///
    /// - `base`: the folder that names count from: of the model, or of its material library.
    ///
    /// # Errors
    /// If it may not be read.
    pub fn resolve(&self, base: &Path, name: &str) -> Result<Referred, Outside> {
        let refused = |why| Err(Outside { name_in_model: name.to_owned(), why });
        if name.len() > LONGEST {
            return refused("too long for a path");
        }
        if name.starts_with("//") || name.starts_with("\\\\") {
            return refused("an address of the network");
        }
        let decoded = percent_decoded(name);
        let spellings = [&decoded, name, &decoded.replace('\\', "/"), &name.replace('\\', "/")].map(text_to_path);
        let last = &spellings[2];
        if self.allow_outside {
            return Ok(self.existing(base, &spellings));
        }
        if let Some(why) = spellings.iter().find_map(|path| self.leaves(base, path)) {
            // Files are moved together with the model; where they were on its computer is of no use here.
            let beside = last.file_name().map(PathBuf::from).filter(|file| self.leaves(base, file).is_none());
            return match beside {
                Some(file) if why == ABSOLUTE && (!last.exists() || base.join(&file).is_file()) => {
                    self.without_link(base, file.into(), name)
                }
                _ => refused(why),
            };
        }
        self.without_link(base, self.existing(base, &spellings), name)
    }

    /// Why a path is not one in the folder of the model, by its text.
    fn leaves(&self, base: &Path, path: &Path) -> Option<&'static str> {
        let is_drive =
            matches!(path.as_os_str().as_encoded_bytes(), [letter, b':', ..] if letter.is_ascii_alphabetic());
        if path.is_absolute() || path.has_root() || is_drive {
            return Some(ABSOLUTE);
        }
        let mut depth = base.strip_prefix(&self.folder).map_or(0, |below| below.components().count());
        for part in path.components() {
            match part {
                Component::CurDir => {}
                Component::ParentDir if depth == 0 => return Some(OUT),
                Component::ParentDir => depth -= 1,
                // With `.\\` it is here, as its spelling with `/` says.
                Component::Normal(part) if part.as_encoded_bytes().starts_with(b".\\") => {}
                Component::Normal(part) if part.as_encoded_bytes().starts_with(b"..\\") => return Some(OUT),
                Component::Normal(part) if is_hidden(part) => return Some("a hidden file"),
                Component::Normal(_) => depth += 1,
                Component::Prefix(_) | Component::RootDir => return Some(ABSOLUTE),
            }
        }
        None
    }

    /// Refuses what a symbolic link leads to: out of the folder, or to a hidden file.
    fn without_link(&self, base: &Path, referred: Referred, name: &str) -> Result<Referred, Outside> {
        let folder = or_here(&self.folder);
        // `model.glb#3` is an image inside a model.
        let full = base.join(&referred.path);
        let file = full.to_str().filter(|_| !full.exists()).and_then(|text| text.rsplit_once('#'));
        let file = file.map_or(full.as_path(), |(file, _)| Path::new(file));
        let (Ok(real), Ok(folder)) = (file.canonicalize(), folder.canonicalize()) else { return Ok(referred) };
        let refused = |why| Err(Outside { name_in_model: name.to_owned(), why });
        match real.strip_prefix(&folder) {
            Err(_) => refused("a link out of the folder"),
            Ok(below) if below.components().any(|part| is_hidden(part.as_os_str())) => {
                refused("a link to a hidden file")
            }
            Ok(_) => Ok(referred),
        }
    }

    /// The first of these paths that exists, where a folder that is not there may be left out (`missing/../a.png`), or
    /// what differs from the last one by case, or the file of its name beside the model, if its folder was not passed on.
    fn existing(&self, base: &Path, spellings: &[PathBuf; 4]) -> Referred {
        let last = &spellings[2];
        let direct = direct(last);
        match spellings.iter().chain([&direct]).find(|path| base.join(path).exists()) {
            Some(path) => path.clone().into(),
            None => match self.in_any_case(base, &direct) {
                Some(path) => Referred { path, is_renamed: true },
                None => {
                    let beside = last.file_name().map(PathBuf::from).filter(|file| base.join(file).is_file());
                    beside.unwrap_or_else(|| last.clone()).into()
                }
            },
        }
    }

    /// The file below `base` whose name differs in upper and lower case only. If there are several, none of them is
    /// meant.
    fn in_any_case(&self, base: &Path, path: &Path) -> Option<PathBuf> {
        if path.components().nth(MAX_PARTS).is_some() {
            return None;
        }
        let mut listings = self.listings.lock().unwrap_or_else(PoisonError::into_inner);
        let mut found = PathBuf::new();
        for part in path.components() {
            let here = base.join(&found);
            match part {
                Component::Normal(wanted) if !here.join(wanted).exists() => {
                    found.push(listings.in_any_case(here, wanted.to_str()?)?);
                }
                part => found.push(part),
            }
        }
        base.join(&found).exists().then_some(found)
    }
}

impl Listings {
    /// The only entry of the folder that differs from this name by case alone.
    fn in_any_case(&mut self, folder: PathBuf, name: &str) -> Option<&OsString> {
        let entries = self.by_folder.entry(folder).or_insert_with_key(|folder| {
            let left = MAX_ENTRIES.min(MAX_ENTRIES_OF_ALL - self.n_entries);
            let mut entries = HashMap::new();
            for entry in std::fs::read_dir(or_here(folder)).into_iter().flatten().take(left) {
                self.n_entries += 1;
                let Ok(name) = entry.map(|entry| entry.file_name()) else { continue };
                if let Some(lower) = name.to_str().map(str::to_lowercase) {
                    entries.entry(lower).and_modify(|known| *known = None).or_insert(Some(name));
                }
            }
            entries
        });
        entries.get(&name.to_lowercase())?.as_ref()
    }
}

/// A folder as the system names it.
fn or_here(folder: &Path) -> &Path {
    if folder.as_os_str().is_empty() { Path::new(".") } else { folder }
}

const ABSOLUTE: &str = "an absolute path";
const OUT: &str = "a path out of the folder";

fn is_hidden(name: &OsStr) -> bool {
    name.as_encoded_bytes().starts_with(b".")
}

/// A path without the folders that it enters and leaves again.
fn direct(path: &Path) -> PathBuf {
    let mut direct = PathBuf::new();
    for part in path.components() {
        match (part, direct.components().next_back()) {
            (Component::ParentDir, Some(Component::Normal(_))) => drop(direct.pop()),
            (part, _) => direct.push(part),
        }
    }
    direct
}

/// Decodes `%20` and the like; sequences that are invalid, not UTF-8 or zero stay unchanged.
pub fn percent_decoded(text: &str) -> String {
    let bytes = text.as_bytes();
    let mut out = Vec::with_capacity(bytes.len());
    let mut i = 0;
    while i < bytes.len() {
        let hex = |byte: u8| char::from(byte).to_digit(16);
        if bytes[i] == b'%'
            && let Some(Some(high)) = bytes.get(i + 1).map(|&byte| hex(byte))
            && let Some(Some(low)) = bytes.get(i + 2).map(|&byte| hex(byte))
            && high * 16 + low != 0
        {
            out.push((high * 16 + low) as u8);
            i += 3;
        } else {
            out.push(bytes[i]);
            i += 1;
        }
    }
    String::from_utf8(out).unwrap_or_else(|_| text.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn resolve(model: &Path, base: &Path, name: &str, allow_outside: bool) -> Result<String, &'static str> {
        let found = References::of(model, allow_outside).resolve(base, name);
        found.map(|found| found.path.to_string_lossy().into_owned()).map_err(|outside| outside.why)
    }

    #[test]
    fn only_paths_within_the_folder_are_read() {
        let at = |name: &str| resolve(Path::new("nowhere/a.obj"), Path::new("nowhere"), name, false);
        for (name, path) in [
            ("a.bin", "a.bin"),
            ("textures/a b.png", "textures/a b.png"),
            ("a%20b/%E7%BA%B9.png", "a b/纹.png"),
            ("./a.bin", "./a.bin"),
            ("a/../b.bin", "a/../b.bin"),
            ("100%.png", "100%.png"),
            ("maps\\a.png", "maps/a.png"),
            ("C:\\art\\a.png", "a.png"),
            ("/no such folder/a.png", "a.png"),
        ] {
            assert_eq!(at(name), Ok(path.to_owned()), "{name}");
        }
        for name in [
            "../a.bin",
            "a/../../b.bin",
            "%2e%2e/a.bin",
            "..\\a.bin",
            "a\\..\\..\\b",
            "..%5ca.bin",
            "/etc/passwd",
            "//server/share/a.bin",
            "\\\\server\\a.bin",
            ".ssh/id_rsa",
            ".env",
            "maps/.env",
            "a/%2eenv",
            "/tmp/..",
        ] {
            let error = at(name).expect_err(name);
            assert!(!error.is_empty());
        }
    }

    #[test]
    fn names_count_from_a_library_and_stay_in_the_folder_of_the_model() {
        let at = |name: &str| resolve(Path::new("m/a.obj"), Path::new("m/lib"), name, false);
        assert_eq!(at("../maps/a.png"), Ok("../maps/a.png".to_owned()));
        assert_eq!(at("../../maps/a.png"), Err("a path out of the folder"));
    }

    #[test]
    fn the_network_is_never_read_and_other_files_where_that_is_allowed() {
        let at = |name: &str| resolve(Path::new("m/a.obj"), Path::new("m"), name, true);
        assert_eq!(at("../a.bin"), Ok("../a.bin".to_owned()));
        assert_eq!(at("/a/b%20c.bin"), Ok("/a/b c.bin".to_owned()));
        assert_eq!(at("//server/a.bin"), Err("an address of the network"));
    }

    #[cfg(unix)]
    #[test]
    fn files_are_found_in_any_case_and_not_through_links_out_of_the_folder() {
        let outer = tempfile::tempdir().unwrap();
        let inner = outer.path().join("inner");
        std::fs::create_dir_all(inner.join("Maps")).unwrap();
        for file in ["Maps/Wood.PNG", "moved.png", "100%25.png", "../secret.png"] {
            std::fs::write(inner.join(file), "").unwrap();
        }
        std::os::unix::fs::symlink(outer.path().join("secret.png"), inner.join("link.png")).unwrap();
        std::os::unix::fs::symlink(outer.path(), inner.join("up")).unwrap();
        std::fs::write(outer.path().join("secret.glb"), "").unwrap();
        std::os::unix::fs::symlink(outer.path().join("secret.glb"), inner.join("link.glb")).unwrap();
        let model = inner.join("a.obj");
        let at = |name: &str| resolve(&model, &inner, name, false);
        assert_eq!(at("maps\\wood.png"), Ok("Maps/Wood.PNG".to_owned()));
        assert!(References::of(&model, false).resolve(&inner, "MOVED.png").unwrap().is_renamed);
        for name in ["/elsewhere/moved.png", "textures/moved.png", "textures\\moved.png"] {
            assert_eq!(at(name), Ok("moved.png".to_owned()), "{name}");
        }
        assert_eq!(resolve(&model, &inner, "/elsewhere/moved.png", true), Ok("moved.png".to_owned()));
        assert_eq!(at("textures/link.png"), Err("a link out of the folder"));
        assert_eq!(at(outer.path().join("moved.png").to_str().unwrap()), Ok("moved.png".to_owned()));
        assert_eq!(at("100%25.png"), Ok("100%25.png".to_owned()));
        assert_eq!(at(".\\moved.png"), Ok("./moved.png".to_owned()));
        assert_eq!(at(".\\.moved.png"), Err("a hidden file"));
        assert_eq!(at("..\\secret.png"), Err("a path out of the folder"));
        std::fs::create_dir(inner.join(".ssh")).unwrap();
        std::fs::write(inner.join(".ssh/id_rsa"), "").unwrap();
        std::os::unix::fs::symlink(".ssh/id_rsa", inner.join("mesh.bin")).unwrap();
        std::os::unix::fs::symlink(".ssh", inner.join("ssh")).unwrap();
        for link in ["mesh.bin", "ssh/id_rsa"] {
            assert_eq!(at(link), Err("a link to a hidden file"), "{link}");
        }
        for link in ["link.png", "up/secret.png", "LINK.png", "/away/link.png", "link.glb#0", "up/secret.glb#12"] {
            assert_eq!(at(link), Err("a link out of the folder"), "{link}");
        }
    }

    #[test]
    fn many_names_are_looked_for_in_a_large_folder_at_once() {
        let folder = tempfile::tempdir().unwrap();
        (0..5_000).for_each(|i| drop(std::fs::File::create(folder.path().join(format!("Wood {i}"))).unwrap()));
        let model = folder.path().join("a.obj");
        let files = References::of(&model, false);
        // Minutes if the folder were listed for each.
        for i in 0..20_000 {
            let found = files.resolve(folder.path(), &format!("wood {i}")).unwrap();
            let name = if i < 5_000 { format!("Wood {i}") } else { format!("wood {i}") };
            assert_eq!(found, Referred { path: name.into(), is_renamed: i < 5_000 });
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_folder_of_endless_names_is_listed_a_few_times() {
        let folder = tempfile::tempdir().unwrap();
        (0..5_000).for_each(|i| drop(std::fs::File::create(folder.path().join(format!("W{i}"))).unwrap()));
        for link in ["a", "b"] {
            std::os::unix::fs::symlink(".", folder.path().join(link)).unwrap();
        }
        let files = References::of(&folder.path().join("a.obj"), false);
        let resolve = |name: &str| files.resolve(folder.path(), name).unwrap();
        // Links as the digits of a number.
        let through = |i: u32| (0..15).map(|k| if i >> k & 1 == 0 { "a/" } else { "b/" }).collect::<String>();
        assert_eq!(resolve(&format!("{}w1", through(0))).path, Path::new(&format!("{}W1", through(0))));
        (0..20_000).for_each(|i| drop(resolve(&format!("{}x{i}", through(i)))));
        assert!(files.listings.lock().unwrap().n_entries <= MAX_ENTRIES_OF_ALL);
        assert!(!resolve(&format!("{}W1", through(20_000))).is_renamed);
        let deep = "a/".repeat(MAX_PARTS);
        assert_eq!(resolve(&format!("{deep}w1")).path, Path::new(&format!("{deep}w1")), "too deep to be looked for");
    }
}
