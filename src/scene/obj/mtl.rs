//! Materials of an OBJ file (MTL), as numbers and paths.

use crate::scene::model::warnings::Warnings;
use crate::scene::{FileKind, InputFile};
use glam::Vec3;
use std::io::Cursor;
use std::path::{Path, PathBuf};

/// A material as its file states it; what is not stated is `None`. What it means is decided elsewhere.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImportedMaterial {
    /// Empty for faces without `usemtl`.
    pub name: String,
    /// `Kd`, diffuse colour; treated as linear.
    pub diffuse: Option<Vec3>,
    /// `Ks`, specular colour.
    pub specular: Option<Vec3>,
    /// `Ns`, exponent of the specular lobe, at least 0.
    pub shininess: Option<f32>,
    /// `Ke`, emitted radiance.
    pub emission: Option<Vec3>,
    /// `Ni`, index of refraction.
    pub ior: Option<f32>,
    /// `d`, or 1 − `Tr`: 1 is opaque.
    pub opacity: Option<f32>,
    /// `illum`, the illumination model: 3 and 5 mirror, 4, 6, 7 and 9 glass.
    pub illumination_model: Option<u8>,
    /// `map_Kd`, resolved against the folder of the MTL file.
    pub diffuse_texture: Option<PathBuf>,
    /// `map_Ke`, resolved likewise.
    pub emission_texture: Option<PathBuf>,
}

/// Reads one library; what cannot be used becomes a warning, and every other line still counts.
pub(super) fn load_library(path: &Path, max_bytes: u64, warnings: &mut Warnings) -> Vec<ImportedMaterial> {
    let mut warn = |problem: String| warnings.push(format!("{}: {problem}", path.display()));
    let bytes = match InputFile::open_within(path, FileKind::Library, max_bytes).and_then(InputFile::bytes) {
        Ok(bytes) => bytes,
        Err(problem) => {
            warn(format!("{problem}; its materials use default values"));
            return Vec::new();
        }
    };
    let text = clean(&String::from_utf8_lossy(&bytes), &mut warn);
    match tobj::load_mtl_buf(&mut Cursor::new(text)) {
        Ok((materials, _)) => {
            let folder = path.parent().unwrap_or(Path::new(""));
            materials.iter().map(|material| imported(material, folder, &mut warn)).collect()
        }
        Err(error) => {
            warn(format!("cannot be parsed: {error}; its materials use default values"));
            Vec::new()
        }
    }
}

/// Leaves only lines that tobj reads without an error, which would cost the whole file.
fn clean(text: &str, warn: &mut impl FnMut(String)) -> String {
    let mut out = String::with_capacity(text.len());
    let mut named = false;
    for (number, line) in text.lines().enumerate() {
        // Marks and spaces in any order: the keyword must come first.
        let line = line.trim_end().trim_start_matches(|c: char| c.is_whitespace() || c == '\u{feff}');
        let Some(keyword) = line.split_whitespace().next() else { continue };
        let value = line[keyword.len()..].trim();
        let numbers = || -> Vec<f64> {
            value.split_whitespace().map_while(|word| word.parse().ok().filter(|v: &f64| v.is_finite())).collect()
        };
        let rewritten = match keyword {
            "newmtl" => {
                // A name that is not there still separates its lines from the material above.
                named = true;
                Some(if value.is_empty() { "newmtl (unnamed)".into() } else { line.to_owned() })
            }
            "Ka" | "Kd" | "Ks" | "Ke" => match numbers()[..] {
                [r, g, b, ..] => Some(format!("{keyword} {r} {g} {b}")),
                // The format says that one number stands for all three.
                [grey] if value.split_whitespace().count() == 1 => Some(format!("{keyword} {grey} {grey} {grey}")),
                _ => None,
            },
            "Ns" | "Ni" | "d" | "Tr" => numbers().first().map(|number| format!("{keyword} {number}")),
            "illum" => value.split_whitespace().next().and_then(|v| v.parse::<u8>().ok()).map(|v| format!("illum {v}")),
            "map_Kd" | "map_Ke" => (!value.is_empty()).then(|| line.to_owned()),
            _ => continue,
        };
        match rewritten {
            Some(line) if named => {
                out.push_str(&line);
                out.push('\n');
            }
            Some(_) => warn(format!("line {}: `{keyword}` before any `newmtl` was ignored", number + 1)),
            None => warn(format!("line {}: `{line}` cannot be parsed and was ignored", number + 1)),
        }
    }
    out
}

fn imported(material: &tobj::Material, folder: &Path, warn: &mut impl FnMut(String)) -> ImportedMaterial {
    let name = &material.name;
    // Whichever of the two number types some other crate asks tobj for.
    let single = |number| f64::from(number) as f32;
    let mut color = |keyword: &str, value: Option<[_; 3]>| {
        let value = Vec3::from_array(value?.map(single));
        let valid = value.is_finite() && value.min_element() >= 0.0;
        if !valid {
            warn(format!("material `{name}`: `{keyword}` must not be negative and was ignored"));
        }
        valid.then_some(value)
    };
    let diffuse = color("Kd", material.diffuse);
    let specular = color("Ks", material.specular);
    let emission = color("Ke", material.emissive);
    let mut number = |keyword: &str, value: Option<f32>, range: std::ops::RangeInclusive<f32>| {
        let value = value?;
        if !range.contains(&value) {
            warn(format!("material `{name}`: `{keyword}` {value} is out of range and was ignored"));
        }
        range.contains(&value).then_some(value)
    };
    let transparency = material.unknown_param.get("Tr").and_then(|v| v.parse::<f32>().ok());
    ImportedMaterial {
        name: name.clone(),
        diffuse,
        specular,
        shininess: number("Ns", material.shininess.map(single), 0.0..=1e6),
        emission,
        ior: number("Ni", material.optical_density.map(single), 1e-3..=10.0),
        opacity: number("d", material.dissolve.map(single), 0.0..=1.0)
            .or_else(|| number("Tr", transparency, 0.0..=1.0).map(|tr| 1.0 - tr)),
        illumination_model: material.illumination_model,
        diffuse_texture: material.diffuse_texture.as_deref().and_then(|value| texture_path(value, folder)),
        emission_texture: material.unknown_param.get("map_Ke").and_then(|value| texture_path(value, folder)),
    }
}

/// The file name after the options of a `map_` line; `\` in it counts as `/`.
///
/// A path of another machine (absolute, and not there) is looked for beside the MTL file.
fn texture_path(value: &str, folder: &Path) -> Option<PathBuf> {
    let mut left = value.trim();
    while left.starts_with('-') {
        let mut words = left.split_whitespace();
        let option = words.next().unwrap_or_default();
        let (least, most) = match option {
            "-o" | "-s" | "-t" => (1, 3),
            "-mm" => (2, 2),
            "-blendu" | "-blendv" | "-boost" | "-bm" | "-cc" | "-clamp" | "-imfchan" | "-texres" | "-type" => (1, 1),
            // Not an option: a file whose name starts with a dash.
            _ => break,
        };
        left = left[option.len()..].trim_start();
        for i in 0..most {
            let word = left.split_whitespace().next().unwrap_or_default();
            if i >= least && word.parse::<f64>().is_err() {
                break;
            }
            left = left[word.len()..].trim_start();
        }
    }
    let name = left.trim_matches('"').replace('\\', "/");
    let drive = name.as_bytes().get(1) == Some(&b':');
    let last = name.rsplit('/').next().unwrap_or_default();
    if name.is_empty() || last.is_empty() {
        return None;
    }
    let path = folder.join(&name);
    Some(if drive || (Path::new(&name).is_absolute() && !path.exists()) { folder.join(last) } else { path })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> (Vec<ImportedMaterial>, Vec<String>) {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        let mut warnings = Warnings::default();
        (load_library(file.path(), 1 << 20, &mut warnings), warnings.into_list())
    }

    #[test]
    fn every_field_is_read() {
        let (materials, warnings) = parse(
            "newmtl red one\r\n\tKd 0.8 0.1 0.1\r\nKs 0.5\nNs 96\nKe 1 2 3\nNi 1.5\nTr 0.25\nillum 7\n\
             map_Kd -s 2 2 1 -clamp on tex\\my wood.png\nmap_Ke C:\\art\\glow.png\nnewmtl b\nd 0.5\n",
        );
        assert!(warnings.is_empty(), "{warnings:?}");
        let folder = std::env::temp_dir();
        let expected = ImportedMaterial {
            name: "red one".into(),
            diffuse: Some(Vec3::new(0.8, 0.1, 0.1)),
            specular: Some(Vec3::splat(0.5)),
            shininess: Some(96.0),
            emission: Some(Vec3::new(1.0, 2.0, 3.0)),
            ior: Some(1.5),
            opacity: Some(0.75),
            illumination_model: Some(7),
            diffuse_texture: Some(folder.join("tex/my wood.png")),
            emission_texture: Some(folder.join("glow.png")),
        };
        assert_eq!(materials[0], expected);
        assert_eq!(materials[1], ImportedMaterial { name: "b".into(), opacity: Some(0.5), ..Default::default() });
    }

    #[test]
    fn a_bad_line_costs_only_itself() {
        let (materials, warnings) = parse(
            "Kd 1 1 1\nnewmtl a\nKd 1 2\nKs x\nNs\nNi nan\nillum 999\nd 7\nKe -1 0 0\nmap_Kd\nKa 1\nnewmtl\nnewmtl c\nKd 1 0 0\n",
        );
        assert_eq!(warnings.len(), 9, "{warnings:#?}");
        assert_eq!(materials.last().unwrap().diffuse, Some(Vec3::X));
        assert_eq!(materials[0], ImportedMaterial { name: "a".into(), ..Default::default() });
    }

    #[test]
    fn a_missing_library_is_a_warning() {
        let mut warnings = Warnings::default();
        assert!(load_library(Path::new("no such.mtl"), 9, &mut warnings).is_empty());
        assert!(load_library(&std::env::temp_dir(), 9, &mut warnings).is_empty());
        assert_eq!(warnings.into_list().len(), 2);
    }
}
