//! Resolves the URIs in a glTF file: data URIs, and files in its own folder and below.

use super::error::GltfProblem;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use std::path::{Component, Path, PathBuf};

/// A resolved URI.
pub(super) enum Uri {
    /// Embedded data.
    Data(Vec<u8>),
    /// A file, relative to the folder of the model; absolute only if that is allowed.
    File(PathBuf),
}

/// - `folder`: folder of the model.
/// - `outside`: whether local files outside of `folder` may be read.
///
/// # Errors
/// If it leaves the folder, refers to the network or is not a valid URI.
pub(super) fn resolve(uri: &str, folder: &Path, outside: bool) -> Result<Uri, GltfProblem> {
    if let Some(data) = uri.strip_prefix("data:") {
        return data_uri(data).map(Uri::Data);
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
        return Ok(Uri::File(path));
    }
    if path.is_absolute() || decoded.starts_with(['/', '\\']) {
        return refused("an absolute path");
    }
    let leaves = path.components().any(|part| !matches!(part, Component::Normal(_) | Component::CurDir));
    if leaves || decoded.split(['/', '\\']).any(|part| part == "..") {
        return refused("a path out of the folder");
    }
    // A symbolic link may leave the folder too.
    if let (Ok(real), Ok(root)) = (folder.join(&path).canonicalize(), real_folder(folder).canonicalize())
        && !real.starts_with(root)
    {
        return refused("a link out of the folder");
    }
    Ok(Uri::File(path))
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

/// Decodes the text after `data:`.
fn data_uri(data: &str) -> Result<Vec<u8>, GltfProblem> {
    let (head, body) = data.split_once(',').ok_or(GltfProblem::DataUri("there is no comma in it"))?;
    if !head.ends_with(";base64") {
        return Err(GltfProblem::DataUri("expected base64"));
    }
    STANDARD.decode(body).map_err(|_| GltfProblem::DataUri("the text is no base64"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(uri: &str, outside: bool) -> Option<String> {
        match resolve(uri, Path::new("nowhere"), outside) {
            Ok(Uri::File(path)) => Some(path.to_string_lossy().into_owned()),
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
    fn data_uris_are_decoded_or_refused() {
        let data = |uri: &str| match resolve(uri, Path::new(""), false) {
            Ok(Uri::Data(bytes)) => Some(bytes),
            _ => None,
        };
        assert_eq!(data("data:application/octet-stream;base64,AAEC/w=="), Some(vec![0, 1, 2, 255]));
        assert_eq!(data("data:;base64,"), Some(vec![]));
        assert_eq!(data("data:text/plain,abc"), None);
        assert_eq!(data("data:;base64,@"), None);
    }
}
