//! Materials of an OBJ file (MTL) as numbers and paths.

use crate::scene::warnings::Warnings;
use crate::scene::{FileKind, InputFile};
use glam::Vec3;
use std::io::Cursor;
use std::path::{Path, PathBuf};

/// A material as in its file; missing values are `None`. It is interpreted elsewhere.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImportedMaterial {
    /// Empty for faces without `usemtl`.
    pub name: String,
    /// `Kd`, diffuse colour; treated as linear.
    pub diffuse: Option<Vec3>,
    /// Whether vertex colours replace the diffuse colour, which is their mean.
    pub vertex_colors: bool,
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
    /// `map_Kd`, relative to the folder of the MTL file.
    pub diffuse_texture: Option<PathBuf>,
    /// `map_Ke`, likewise.
    pub emission_texture: Option<PathBuf>,
    /// `map_d`, likewise.
    pub opacity_texture: Option<PathBuf>,
    /// Parameters of the PBR extension; `None` if none of them is present.
    pub pbr: Option<PbrMaterial>,
}

/// The PBR extension of MTL (Clara.io 2013): `Pr`, `Pm`, `Ps`, `Pc`, `Pcr`, `aniso`, `anisor`, `norm` and their maps.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PbrMaterial {
    /// `Pr`, 0..1.
    pub roughness: Option<f32>,
    /// `Pm`, 0..1.
    pub metallic: Option<f32>,
    /// `Ps`, 0..1.
    pub sheen: Option<f32>,
    /// `Pc`, strength of the coat, at least 0: some programs write four times the reflectance.
    pub clearcoat: Option<f32>,
    /// `Pcr`, 0..1.
    pub clearcoat_roughness: Option<f32>,
    /// `aniso`, 0..1.
    pub anisotropy: Option<f32>,
    /// `anisor`, turns.
    pub anisotropy_rotation: Option<f32>,
    /// `map_Pr`, relative to the folder of the MTL file.
    pub roughness_texture: Option<PathBuf>,
    /// `map_Pm`, likewise.
    pub metallic_texture: Option<PathBuf>,
    /// `norm`, else `map_Bump`, likewise.
    pub normal_texture: Option<PathBuf>,
    /// The option `-bm` of that map.
    pub normal_scale: Option<f32>,
}

/// Reads a library; invalid lines give warnings, and all other lines are used.
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

/// Keeps only lines that tobj can read, since an error would lose the whole file.
fn clean(text: &str, warn: &mut impl FnMut(String)) -> String {
    let mut out = String::with_capacity(text.len());
    let mut named = false;
    for (number, line) in text.lines().enumerate() {
        // Byte order marks and spaces in any order: the keyword must come first.
        let line = line.trim_end().trim_start_matches(|c: char| c.is_whitespace() || c == '\u{feff}');
        let Some(keyword) = line.split_whitespace().next() else { continue };
        let value = line[keyword.len()..].trim();
        let numbers = || -> Vec<f64> {
            value.split_whitespace().map_while(|word| word.parse().ok().filter(|v: &f64| v.is_finite())).collect()
        };
        let rewritten = match keyword {
            "newmtl" => {
                // A missing name still begins a new material.
                named = true;
                Some(if value.is_empty() { "newmtl (unnamed)".into() } else { line.to_owned() })
            }
            "Ka" | "Kd" | "Ks" | "Ke" => match numbers()[..] {
                [r, g, b, ..] => Some(format!("{keyword} {r} {g} {b}")),
                // According to the format, a single number stands for all three.
                [grey] if value.split_whitespace().count() == 1 => Some(format!("{keyword} {grey} {grey} {grey}")),
                _ => None,
            },
            "Ns" | "Ni" | "d" | "Tr" => numbers().first().map(|number| format!("{keyword} {number}")),
            "illum" => value.split_whitespace().next().and_then(|v| v.parse::<u8>().ok()).map(|v| format!("illum {v}")),
            "Pr" | "Pm" | "Ps" | "Pc" | "Pcr" | "aniso" | "anisor" => {
                numbers().first().map(|number| format!("{keyword} {number}"))
            }
            "map_Kd" | "map_Ke" | "map_d" | "map_Pr" | "map_Pm" | "norm" | "map_Bump" | "map_bump" | "bump" => {
                let keyword =
                    if keyword.eq_ignore_ascii_case("map_bump") || keyword == "bump" { "map_Bump" } else { keyword };
                (!value.is_empty()).then(|| format!("{keyword} {value}"))
            }
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
    // Either of the two number types of tobj, which a feature of another crate may select.
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
    let stated = |keyword: &str| material.unknown_param.get(keyword).map(String::as_str);
    let path = |keyword: &str| {
        // tobj parses some maps itself.
        let known = match keyword {
            "map_d" => material.dissolve_texture.as_deref(),
            "map_Bump" | "norm" => material.normal_texture.as_deref().filter(|_| keyword == "map_Bump"),
            _ => None,
        };
        stated(keyword).or(known).and_then(|value| texture_path(value, folder))
    };
    let mut share =
        |keyword: &str, most: f32| number(keyword, stated(keyword).and_then(|value| value.parse().ok()), 0.0..=most);
    let pbr = PbrMaterial {
        roughness: share("Pr", 1.0),
        metallic: share("Pm", 1.0),
        sheen: share("Ps", 1.0),
        clearcoat: share("Pc", 1e3),
        clearcoat_roughness: share("Pcr", 1.0),
        anisotropy: share("aniso", 1.0),
        anisotropy_rotation: share("anisor", 1e3),
        roughness_texture: path("map_Pr"),
        metallic_texture: path("map_Pm"),
        normal_texture: path("norm"),
        normal_scale: None,
    };
    // Bump maps are height maps, but programs that write this extension store normal maps in them.
    let pbr = (pbr != PbrMaterial::default()).then(|| PbrMaterial {
        normal_scale: stated("map_Bump").or(material.normal_texture.as_deref()).and_then(bump_scale),
        normal_texture: pbr.normal_texture.clone().or_else(|| path("map_Bump")),
        ..pbr
    });
    let opacity_texture = path("map_d");
    let transparency = material.unknown_param.get("Tr").and_then(|v| v.parse::<f32>().ok());
    ImportedMaterial {
        name: name.clone(),
        diffuse,
        vertex_colors: false,
        specular,
        shininess: number("Ns", material.shininess.map(single), 0.0..=1e6),
        emission,
        ior: number("Ni", material.optical_density.map(single), 1e-3..=10.0),
        opacity: number("d", material.dissolve.map(single), 0.0..=1.0)
            .or_else(|| number("Tr", transparency, 0.0..=1.0).map(|tr| 1.0 - tr)),
        illumination_model: material.illumination_model,
        diffuse_texture: material.diffuse_texture.as_deref().and_then(|value| texture_path(value, folder)),
        emission_texture: material.unknown_param.get("map_Ke").and_then(|value| texture_path(value, folder)),
        opacity_texture,
        pbr,
    }
}

/// The value of the option `-bm` of a map.
fn bump_scale(value: &str) -> Option<f32> {
    let mut words = value.split_whitespace().skip_while(|word| *word != "-bm").skip(1);
    words.next()?.parse().ok().filter(|scale: &f32| scale.is_finite())
}

/// The file name after the options of a `map_` line; `\` counts as `/`.
///
/// A path from another computer (with a drive, or absolute and missing) is replaced by the file of that name in the
/// folder of the MTL file.
fn texture_path(value: &str, folder: &Path) -> Option<PathBuf> {
    let mut left = value.trim();
    while left.starts_with('-') {
        let mut words = left.split_whitespace();
        let option = words.next().unwrap_or_default();
        let (least, most) = match option {
            "-o" | "-s" | "-t" => (1, 3),
            "-mm" => (2, 2),
            "-blendu" | "-blendv" | "-boost" | "-bm" | "-cc" | "-clamp" | "-imfchan" | "-texres" | "-type" => (1, 1),
            // Not an option: a file name that starts with a dash.
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

    fn parse(text: &str) -> (Vec<ImportedMaterial>, Warnings) {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        let mut warnings = Warnings::default();
        (load_library(file.path(), 1 << 20, &mut warnings), warnings)
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
            ..ImportedMaterial::default()
        };
        assert_eq!(materials[0], expected);
        assert_eq!(materials[1], ImportedMaterial { name: "b".into(), opacity: Some(0.5), ..Default::default() });
    }

    #[test]
    fn the_pbr_extension_is_read_with_folders_of_any_name() {
        let (materials, warnings) = parse(
            "newmtl a\nPr 0.25\nPm 1\nPs 0.5\nPc 4.0\nPcr 0.03\naniso 0.7\nanisor 0.1\nmap_Pr größe 纹理/rauh.png\n\
             map_Pm m.png\nmap_d d.png\nmap_Bump -bm 0.5 my normals.png\nnewmtl b\nPr 0.5\nnorm n.png\nmap_Bump h.png\n\
             newmtl c\nKd 1 1 1\nmap_Bump h.png\nnewmtl d\nPr 7\n",
        );
        assert_eq!(warnings.len(), 1, "{warnings:?}");
        let folder = std::env::temp_dir();
        let expected = PbrMaterial {
            roughness: Some(0.25),
            metallic: Some(1.0),
            sheen: Some(0.5),
            clearcoat: Some(4.0),
            clearcoat_roughness: Some(0.03),
            anisotropy: Some(0.7),
            anisotropy_rotation: Some(0.1),
            roughness_texture: Some(folder.join("größe 纹理/rauh.png")),
            metallic_texture: Some(folder.join("m.png")),
            normal_texture: Some(folder.join("my normals.png")),
            normal_scale: Some(0.5),
        };
        assert_eq!(materials[0].pbr, Some(expected));
        assert_eq!(materials[0].opacity_texture, Some(folder.join("d.png")));
        assert_eq!(materials[1].pbr.as_ref().unwrap().normal_texture, Some(folder.join("n.png")));
        assert_eq!((&materials[2].pbr, &materials[3].pbr), (&None, &None), "heights alone, and nothing usable");
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
        assert_eq!(warnings.len(), 2);
    }
}
