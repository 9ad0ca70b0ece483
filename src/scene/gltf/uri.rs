//! Resolves the URIs in a glTF file: data URIs, and files in its own folder and below.

use super::error::GltfProblem;
use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use std::borrow::Cow;
use std::path::{Component, Path, PathBuf};

/// A resolved URI.
pub(super) enum Uri {
    /// Embedded data.
    Data(Vec<u8>),
    /// A file.
    File {
        /// Relative to the folder of the model; absolute only if that is allowed.
        path: PathBuf,
        /// Whether the file differs from the URI by the case of letters.
        is_renamed: bool,
    },
}

/// Whether a URI contains its data.
pub(super) fn is_data(uri: &str) -> bool {
    uri.get(..5).is_some_and(|scheme| scheme.eq_ignore_ascii_case("data:"))
}

/// - `folder`: folder of the model.
/// - `outside`: whether local files outside of `folder` may be read.
///
/// # Errors
/// If it leaves the folder, refers to the network or is not a valid URI.
pub(super) fn resolve(uri: &str, folder: &Path, outside: bool) -> Result<Uri, GltfProblem> {
    if is_data(uri) {
        return data_uri(&uri[5..]).map(Uri::Data);
    }
    let refused = |why| Err(GltfProblem::Outside { uri: uri.to_owned(), why });
    let mut text = uri;
    if let Some((scheme, rest)) = uri.split_once(':') {
        // A single letter is a drive, which belongs to a path.
        if scheme.eq_ignore_ascii_case("file") {
            if !outside {
                return refused("a file: URI");
            }
            text = rest.strip_prefix("//").unwrap_or(rest);
            text = text.strip_prefix("localhost").unwrap_or(text);
        } else if scheme.len() > 1 && is_scheme(scheme) {
            return refused("an address of the network");
        } else if scheme.len() == 1 && !outside {
            return refused("an absolute path");
        }
    }
    if text.starts_with("//") || text.starts_with("\\\\") {
        return refused("an address of the network");
    }
    let decoded = percent_decoded(text);
    let path = PathBuf::from(&decoded);
    if outside {
        return Ok(existing(path, &decoded, folder));
    }
    if path.is_absolute() || decoded.starts_with(['/', '\\']) {
        return refused("an absolute path");
    }
    let leaves = path.components().any(|part| !matches!(part, Component::Normal(_) | Component::CurDir));
    if leaves || decoded.split(['/', '\\']).any(|part| part == "..") {
        return refused("a path out of the folder");
    }
    let file = existing(path, &decoded, folder);
    // A symbolic link may leave the folder too.
    if let Uri::File { path, .. } = &file
        && let (Ok(real), Ok(root)) = (folder.join(path).canonicalize(), real_folder(folder).canonicalize())
        && !real.starts_with(root)
    {
        return refused("a link out of the folder");
    }
    Ok(file)
}

/// The file that a URI means, which another system may have written: with `\` between folders, and without regard to
/// the case of letters. If several files differ by case alone, none of them is meant.
fn existing(path: PathBuf, decoded: &str, folder: &Path) -> Uri {
    let is_there = |path: &Path| folder.join(path).exists();
    let as_written = |path: PathBuf| Uri::File { path, is_renamed: false };
    if is_there(&path) {
        return as_written(path);
    }
    let slashed = PathBuf::from(decoded.replace('\\', "/"));
    if is_there(&slashed) {
        return as_written(slashed);
    }
    let mut found = PathBuf::new();
    for part in slashed.components() {
        let next = found.join(part);
        if is_there(&next) {
            found = next;
            continue;
        }
        let lower = |name: &std::ffi::OsStr| name.to_string_lossy().to_lowercase();
        let wanted = lower(part.as_os_str());
        let entries = real_folder(&folder.join(&found)).read_dir();
        let mut same = entries.into_iter().flatten().flatten().map(|entry| entry.file_name());
        let mut same = same.by_ref().filter(|name| lower(name) == wanted);
        match (same.next(), same.next()) {
            (Some(name), None) => found.push(name),
            _ => return as_written(path),
        }
    }
    Uri::File { path: found, is_renamed: true }
}

fn real_folder(folder: &Path) -> &Path {
    if folder.as_os_str().is_empty() { Path::new(".") } else { folder }
}

fn is_scheme(word: &str) -> bool {
    word.starts_with(|c: char| c.is_ascii_alphabetic())
        && word.chars().all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c))
}

/// Decodes `%20` and the like; sequences that are invalid, not UTF-8 or zero stay unchanged.
fn percent_decoded(text: &str) -> String {
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

/// Decodes the text after `data:`. As browsers do, without regard to white space and to missing padding.
fn data_uri(data: &str) -> Result<Vec<u8>, GltfProblem> {
    const BASE64: GeneralPurpose = GeneralPurpose::new(
        &STANDARD,
        GeneralPurposeConfig::new()
            .with_decode_padding_mode(DecodePaddingMode::Indifferent)
            .with_decode_allow_trailing_bits(true),
    );
    let (head, body) = data.split_once(',').ok_or(GltfProblem::DataUri("there is no comma in it"))?;
    if !head.trim_end().to_ascii_lowercase().ends_with(";base64") {
        return Err(GltfProblem::DataUri("expected base64"));
    }
    let mut body = Cow::Borrowed(body);
    if body.contains('%') {
        body = Cow::Owned(percent_decoded(&body));
    }
    if body.contains(|c: char| c.is_ascii_whitespace()) {
        body = Cow::Owned(body.split_ascii_whitespace().collect());
    }
    BASE64.decode(body.as_bytes()).map_err(|_| GltfProblem::DataUri("the text is no base64"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(uri: &str, outside: bool) -> Option<String> {
        match resolve(uri, Path::new("nowhere"), outside) {
            Ok(Uri::File { path, .. }) => Some(path.to_string_lossy().into_owned()),
            _ => None,
        }
    }

    #[test]
    fn only_paths_within_the_folder_are_read() {
        for (uri, path) in [
            ("a.bin", "a.bin"),
            ("textures/a b.png", "textures/a b.png"),
            ("a%20b/%E7%BA%B9.png", "a b/纹.png"),
            ("./a.bin", "./a.bin"),
            ("a:b.bin/..", "?"),
            ("100%.png", "100%.png"),
        ] {
            assert_eq!(file(uri, false), (path != "?").then(|| path.to_owned()), "{uri}");
        }
        for uri in [
            "../a.bin",
            "a/../../b.bin",
            "%2e%2e/a.bin",
            "..\\a.bin",
            "/etc/passwd",
            "\\a.bin",
            "C:\\a.bin",
            "file:///etc/passwd",
            "FILE:///etc/passwd",
            "http://example.com/a.bin",
            "https://example.com/a.bin",
            "ftp:a",
            "//server/share/a.bin",
            "\\\\server\\a.bin",
        ] {
            let error = resolve(uri, Path::new("nowhere"), false).err().expect(uri).to_string();
            assert!(error.contains("--allow-outside"), "{uri}: {error}");
        }
    }

    #[test]
    fn the_network_is_never_read() {
        assert_eq!(file("../a.bin", true).as_deref(), Some("../a.bin"));
        assert_eq!(file("/a/b%20c.bin", true).as_deref(), Some("/a/b c.bin"));
        assert_eq!(file("file:///a.bin", true).as_deref(), Some("/a.bin"));
        for uri in ["http://example.com/a.bin", "//server/a.bin", "file:////server/a.bin", "ftp:a"] {
            assert_eq!(file(uri, true), None, "{uri}");
        }
    }

    #[test]
    fn files_that_another_system_named_are_found() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("Sub")).unwrap();
        for name in ["Sub/Data.bin", "twice.png", "Twice.png"] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        let found = |uri: &str| match resolve(uri, folder.path(), false) {
            Ok(Uri::File { path, is_renamed }) => (path.to_string_lossy().into_owned(), is_renamed),
            _ => panic!("{uri}"),
        };
        for (uri, path, is_renamed) in [
            ("Sub/Data.bin", "Sub/Data.bin", false),
            ("Sub\\Data.bin", "Sub/Data.bin", false),
            ("sub\\DATA.bin", "Sub/Data.bin", true),
            ("./SUB/data.BIN", "./Sub/Data.bin", true),
            ("twice.png", "twice.png", false),
            ("none.png", "none.png", false),
        ] {
            assert_eq!(found(uri), (path.to_owned(), is_renamed), "{uri}");
        }
        // Where both are there, neither is meant.
        if std::fs::read_dir(folder.path()).unwrap().count() == 3 {
            assert_eq!(found("TWICE.png"), ("TWICE.png".to_owned(), false));
        }
    }

    #[test]
    fn data_uris_are_decoded_or_refused() {
        let data = |uri: &str| match resolve(uri, Path::new(""), false) {
            Ok(Uri::Data(bytes)) => Some(bytes),
            _ => None,
        };
        assert_eq!(data("data:application/octet-stream;base64,AAEC/w=="), Some(vec![0, 1, 2, 255]));
        assert_eq!(data("data:;base64,"), Some(vec![]));
        assert_eq!(data("DATA:;BASE64,AAEC\n  /w"), Some(vec![0, 1, 2, 255]));
        assert_eq!(data("data:;base64,AAEC%2Fw%3D%3D"), Some(vec![0, 1, 2, 255]));
        assert_eq!(data("data:text/plain,abc"), None);
        assert_eq!(data("data:;base64,@"), None);
    }
}
