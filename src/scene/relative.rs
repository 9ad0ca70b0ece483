//! Paths as a file says them that lies somewhere else, and as text: those that are no UTF-8 too, without loss.

use std::path::{Component, Path, PathBuf};

/// A path in words that lead back to it ([`text_to_path`]): itself, if it is UTF-8. Of any other, the bytes that are
/// not are written as letters of their own, U+EF80 to U+EFFF, as OPTU-8 does (and bytes that would be such letters too).
pub fn path_to_text(path: &Path) -> String {
    bytes_to_text(path.as_os_str().as_encoded_bytes())
}

/// The same of a name in a file whose bytes are those of the system.
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

/// The path that [`path_to_text`] gave the words for.
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
    // Names are no bytes there.
    #[cfg(not(unix))]
    PathBuf::from(text)
}

/// Stands for the byte 0x80.
const FIRST_LETTER: u32 = 0xef80;

fn is_byte(c: char) -> bool {
    (FIRST_LETTER..FIRST_LETTER + 0x80).contains(&(c as u32))
}

/// For fields that are written as text: `#[serde(with = "path_text")]`.
pub mod path_text {
    use super::{path_to_text, text_to_path};
    use serde::{Deserialize, Deserializer, Serializer};
    use std::path::{Path, PathBuf};

    /// Writes a path as the text of [`path_to_text`].
    pub fn serialize<S: Serializer>(path: &Path, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&path_to_text(path))
    }

    /// Reads a path from the text of [`path_to_text`].
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<PathBuf, D::Error> {
        String::deserialize(deserializer).map(|text| text_to_path(&text))
    }
}

/// The path with everything that leads to it, links resolved as far as they lead.
pub fn absolute(path: &Path) -> PathBuf {
    if let Ok(path) = path.canonicalize() {
        return path;
    }
    /// As many as systems follow.
    const MAX_LINKS: usize = 40;
    // It need not be there yet; its folder is.
    let mut absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    for _ in 0..MAX_LINKS {
        match (std::fs::read_link(&absolute), absolute.parent()) {
            (Ok(target), Some(folder)) => absolute = folder.join(target),
            _ => break,
        }
    }
    match (absolute.parent().and_then(|folder| folder.canonicalize().ok()), absolute.file_name()) {
        (Some(folder), Some(name)) => folder.join(name),
        _ => absolute,
    }
}

/// How to get from `folder` to `path`, with `/` between the parts; the whole path where they share no more than the
/// root.
pub fn relative_path(folder: &Path, path: &Path) -> String {
    let (folder, path) = (absolute(folder), absolute(path));
    let (from, to): (Vec<Component>, Vec<Component>) = (folder.components().collect(), path.components().collect());
    let shared = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    let is_name = |component: &&Component| matches!(component, Component::Normal(_));
    if !from[..shared].iter().any(|component| is_name(&component)) && !from[shared..].is_empty() {
        return path_to_text(&path);
    }
    let up = std::iter::repeat_n("..".to_owned(), from.len() - shared);
    let down = to[shared..].iter().map(|component| path_to_text(component.as_ref()));
    up.chain(down).collect::<Vec<_>>().join("/")
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
