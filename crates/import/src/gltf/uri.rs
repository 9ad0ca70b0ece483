//! Resolves the URIs in a glTF file: data URIs, and files in its own folder and below.

use crate::error::gltf::GltfProblem;
use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use firstlight_files::reference::{Outside, References, Referred, percent_decoded};
use std::borrow::Cow;
use std::path::Path;

/// A resolved URI.
pub(crate) enum Uri {
    /// Embedded data.
    Data(Vec<u8>),
    /// A file.
    File(Referred),
}

/// Whether a URI contains its data.
pub(crate) fn is_data(uri: &str) -> bool {
    uri.get(..5).is_some_and(|scheme| scheme.eq_ignore_ascii_case("data:"))
}

/// - `files`: what the model may refer to.
/// - `folder`: folder of the model.
///
/// # Errors
/// If it leaves the folder, refers to the network or is not a valid URI.
pub(crate) fn resolve(uri: &str, files: &References, folder: &Path) -> Result<Uri, GltfProblem> {
    if is_data(uri) {
        return data_uri(&uri[5..]).map(Uri::Data);
    }
    let refused = |why| Err(Outside { name_in_model: uri.to_owned(), why }.into());
    let mut text = uri;
    // A single letter is a drive, which belongs to a path.
    if let Some((scheme, rest)) = uri.split_once(':').filter(|(scheme, _)| scheme.len() > 1 && is_scheme(scheme)) {
        if !scheme.eq_ignore_ascii_case("file") {
            return refused("an address of the network");
        }
        if !files.allow_outside() {
            return refused("a file: URI");
        }
        text = rest.strip_prefix("//").unwrap_or(rest);
        text = text.strip_prefix("localhost").unwrap_or(text);
    }
    Ok(Uri::File(files.resolve(folder, text)?))
}

fn is_scheme(word: &str) -> bool {
    word.starts_with(|c: char| c.is_ascii_alphabetic())
        && word.chars().all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c))
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
        match resolve(uri, &References::of(Path::new("nowhere/a.gltf"), outside), Path::new("nowhere")) {
            Ok(Uri::File(Referred { path, .. })) => Some(path.to_string_lossy().into_owned()),
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
            "file:///etc/passwd",
            "FILE:///etc/passwd",
            "http://example.com/a.bin",
            "https://example.com/a.bin",
            "ftp:a",
            "//server/share/a.bin",
            "\\\\server\\a.bin",
        ] {
            let found = resolve(uri, &References::of(Path::new("nowhere/a.gltf"), false), Path::new("nowhere"));
            let error = found.err().expect(uri).to_string();
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
        let model = folder.path().join("a.gltf");
        let found = |uri: &str| match resolve(uri, &References::of(&model, false), folder.path()) {
            Ok(Uri::File(file)) => (file.path.to_string_lossy().into_owned(), file.is_renamed),
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
        let data = |uri: &str| match resolve(uri, &References::of(Path::new("a.gltf"), false), Path::new("")) {
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
