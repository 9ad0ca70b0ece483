//! Paths relative to another file, and lossless conversion of paths to text, even if they are not UTF-8.

use std::path::{Component, Path, PathBuf};

/// A path as text that converts back ([`text_to_path`]): unchanged if it is UTF-8. Bytes that are not UTF-8 become the
/// characters U+EF80 to U+EFFF, like in OPTU-8 (as do bytes that encode such characters).
pub fn path_to_text(path: &Path) -> String {
    bytes_to_text(path.as_os_str().as_encoded_bytes())
}

/// The same for a name in a file with system-specific bytes.
pub fn bytes_to_text(bytes: &[u8]) -> String {
    let mut text = String::with_capacity(bytes.len());
    let letter =
        |byte: u8| char::from_u32(FIRST_LETTER - 0x80 + u32::from(byte)).unwrap_or(char::REPLACEMENT_CHARACTER);
    for chunk in bytes.utf8_chunks() {
        for c in chunk.valid().chars() {
            if is_byte(c) {
                text.extend(c.encode_utf8(&mut [0; 4]).bytes().map(letter));
            } else {
                text.push(c);
            }
        }
        text.extend(chunk.invalid().iter().map(|&byte| letter(byte)));
    }
    text
}

/// The inverse of [`path_to_text`].
pub fn text_to_path(text: &str) -> PathBuf {
    if !text.contains(is_byte) {
        return PathBuf::from(text);
    }
    #[cfg(unix)]
    {
        use std::os::unix::ffi::OsStringExt;
        let mut bytes = Vec::with_capacity(text.len());
        for c in text.chars() {
            if is_byte(c) {
                bytes.push((c as u32 - FIRST_LETTER + 0x80) as u8);
            } else {
                bytes.extend(c.encode_utf8(&mut [0; 4]).bytes());
            }
        }
        PathBuf::from(std::ffi::OsString::from_vec(bytes))
    }
    // There, names are not bytes.
    #[cfg(not(unix))]
    PathBuf::from(text)
}

/// Represents the byte 0x80.
const FIRST_LETTER: u32 = 0xef80;

fn is_byte(c: char) -> bool {
    (FIRST_LETTER..FIRST_LETTER + 0x80).contains(&(c as u32))
}

/// For fields that are serialised as text: `#[serde(with = "path_text")]`.
pub mod path_text {
    use crate::relative::{path_to_text, text_to_path};
    use serde::{Deserialize, Deserializer, Serializer};
    use std::path::{Path, PathBuf};

    /// Writes a path like [`path_to_text`].
    pub fn serialize<S: Serializer>(path: &Path, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&path_to_text(path))
    }

    /// Reads a path like [`text_to_path`].
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<PathBuf, D::Error> {
        String::deserialize(deserializer).map(|text| text_to_path(&text))
    }
}

/// The absolute path without `..` and symbolic links, also of what does not exist yet: its missing folders will be made as
/// they are named, so a `..` behind them leads back.
pub fn absolute(path: &Path) -> PathBuf {
    if let Ok(path) = path.canonicalize() {
        return path;
    }
    /// The limit of common systems.
    const MAX_LINKS: usize = 40;
    let parts_of = |path: &Path| path.components().rev().map(|part| part.as_os_str().to_owned()).collect::<Vec<_>>();
    let mut ahead = parts_of(&std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf()));
    let (mut absolute, mut n_links) = (PathBuf::new(), 0);
    while let Some(part) = ahead.pop() {
        if part == ".." {
            absolute.pop();
            continue;
        }
        match std::fs::read_link(absolute.join(&part)) {
            Ok(target) if n_links < MAX_LINKS => {
                n_links += 1;
                ahead.extend(parts_of(&target));
            }
            // The root takes the place of what is before it.
            _ => absolute.push(part),
        }
    }
    // As the system writes the part that exists.
    let written = |folder: &Path| Some(folder.canonicalize().ok()?.join(absolute.strip_prefix(folder).ok()?));
    absolute.ancestors().find_map(written).unwrap_or(absolute)
}

/// The folder in which a file is found, from which other files are found that it names, and the file itself: the same
/// for all names of a file in one folder.
pub fn place(path: &Path) -> [PathBuf; 2] {
    [absolute(path.parent().unwrap_or(path)), absolute(path)]
}

/// `path` relative to `folder`, with `/` as separator; the absolute path if they have only the root in common.
pub fn relative_path(folder: &Path, path: &Path) -> String {
    let (folder, path) = (absolute(folder), absolute(path));
    let shared = || folder.components().zip(path.components()).take_while(|(a, b)| a == b);
    let shares_name = shared().any(|(component, _)| matches!(component, Component::Normal(_)));
    if !shares_name && folder.components().count() > shared().count() {
        return path_to_text(&path);
    }
    relative_by_name(&folder, &path)
}

/// The way from a folder to a place, both relative or both absolute, by their names alone, with `/` as separator.
pub fn relative_by_name(folder: &Path, place: &Path) -> String {
    let (from, to): (Vec<_>, Vec<_>) = (folder.components().collect(), place.components().collect());
    let shared = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    let up = std::iter::repeat_n("..".to_owned(), from.len() - shared);
    let down = to[shared..].iter().map(|part| path_to_text(part.as_ref()));
    up.chain(down).collect::<Vec<_>>().join("/")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_way_from_a_folder_is_told_by_names() {
        assert_eq!(relative_by_name(Path::new("a/b"), Path::new("a/d/e")), "../d/e");
        assert_eq!(relative_by_name(Path::new(""), Path::new("c/d")), "c/d");
    }

    #[cfg(unix)]
    #[test]
    fn every_path_has_words_that_lead_back_to_it() {
        use std::ffi::OsStr;
        use std::os::unix::ffi::OsStrExt;
        assert_eq!(path_to_text(Path::new("a/b é.obj")), "a/b é.obj");
        let names: [&[u8]; 7] = [
            b"a\xff",
            b"\xffa",
            b"\xc3/\xa9",
            "\u{ef80}".as_bytes(),
            b"\xef\xbe",
            b"\x80\xef\xbe\x80\x80",
            "\u{efff}\u{e000}é".as_bytes(),
        ];
        for name in names {
            let path = Path::new(OsStr::from_bytes(name));
            assert_eq!(text_to_path(&path_to_text(path)), path, "{name:?}");
        }
        let folder = tempfile::tempdir().unwrap();
        let odd = folder.path().join(OsStr::from_bytes(b"odd\xfe"));
        std::fs::create_dir(&odd).unwrap();
        let words = relative_path(folder.path(), &odd.join("a.obj"));
        assert_eq!(folder.path().join(text_to_path(&words)), odd.join("a.obj"));
    }

    #[test]
    fn paths_lead_from_one_folder_to_the_other() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        for name in ["a/b", "c"] {
            std::fs::create_dir_all(root.join(name)).unwrap();
        }
        for (from, to, expected) in [
            ("a", "a/room.ron", "room.ron"),
            ("a", "a/b/room.ron", "b/room.ron"),
            ("a/b", "c/new.ron", "../../c/new.ron"),
            ("", "c/new.ron", "c/new.ron"),
        ] {
            let relative = relative_path(&root.join(from), &root.join(to));
            assert_eq!(relative, expected);
            assert_eq!(absolute(&root.join(from).join(relative)), absolute(&root.join(to)));
        }
        #[cfg(unix)]
        assert_eq!(relative_path(Path::new("/proc"), Path::new("/etc/none")), "/etc/none");
    }

    /// What a path means before its folders are made is what it leads to once they are there.
    #[cfg(unix)]
    #[test]
    fn folders_that_are_made_later_lie_where_they_were_expected() {
        use std::os::unix::fs::symlink;
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().canonicalize().unwrap();
        std::fs::create_dir_all(root.join("deep/x/y")).unwrap();
        symlink("deep/x/y", root.join("link")).unwrap();
        symlink("deep/later/z", root.join("broken")).unwrap();
        symlink("round", root.join("round")).unwrap();
        for (path, place) in [
            ("new/a.ron", "new/a.ron"),
            ("new/../cache/a.png", "cache/a.png"),
            ("n/m/../../a.ron", "a.ron"),
            ("link/n1/n2/a.ron", "deep/x/y/n1/n2/a.ron"),
            ("link/../n1/a.ron", "deep/x/n1/a.ron"),
            ("new/../link/../n1/n2/a.ron", "deep/x/n1/n2/a.ron"),
            ("broken/n1/a.ron", "deep/later/z/n1/a.ron"),
            ("round/a.ron", "round/a.ron"),
        ] {
            let before = absolute(&root.join(path));
            assert_eq!(before, root.join(place), "{path}");
            let parent = before.parent().unwrap();
            if !path.starts_with("round") {
                std::fs::create_dir_all(parent).unwrap();
                assert_eq!(parent.canonicalize().unwrap(), parent, "{path}");
                std::fs::remove_dir_all(root.join("new")).unwrap_or_default();
            }
        }
        std::fs::remove_dir_all(root.join("deep/x/y/n1")).unwrap();
        assert_eq!(relative_path(&root.join("link/n1/n2"), &root.join("t.png")), "../../../../../t.png");
    }
}
