//! Materials of an OBJ file (MTL) as numbers and maps.
//!
//! `clean` checks each line, so that a bad one costs only itself; tobj splits the rest into materials.

use crate::model::material::{ImportedMaterial, PbrMaterial};
use crate::model::texture_map::{TextureMap, ignored_options};
use crate::obj::lines::decoded;
use firstlight_files::input_file::{FileKind, InputFile};
use firstlight_files::reference::References;
use firstlight_files::warnings::Warnings;
use glam::Vec3;
use std::collections::BTreeSet;
use std::io::Cursor;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

/// What follows a keyword.
enum KeywordValue {
    Name,
    /// Three numbers, none negative, or one for all three.
    Color,
    Number(RangeInclusive<f32>),
    Whole,
    /// Options and the name of an image.
    Map,
    /// The same, which no material uses.
    UnusedMap,
}

const SHARE: KeywordValue = KeywordValue::Number(0.0..=1.0);

/// The keywords, in the spelling of tobj.
const KEYWORDS: &[(&str, KeywordValue)] = &[
    ("newmtl", KeywordValue::Name),
    ("Ka", KeywordValue::Color),
    ("Kd", KeywordValue::Color),
    ("Ks", KeywordValue::Color),
    ("Ke", KeywordValue::Color),
    ("Tf", KeywordValue::Color),
    ("Ns", KeywordValue::Number(0.0..=1e6)),
    ("Ni", KeywordValue::Number(1e-3..=10.0)),
    ("d", SHARE),
    ("Tr", SHARE),
    ("illum", KeywordValue::Whole),
    ("Pr", SHARE),
    ("Pm", SHARE),
    ("Ps", SHARE),
    ("Pc", KeywordValue::Number(0.0..=1e3)),
    ("Pcr", SHARE),
    ("aniso", SHARE),
    ("anisor", KeywordValue::Number(0.0..=1e3)),
    ("map_Kd", KeywordValue::Map),
    ("map_Ke", KeywordValue::Map),
    ("map_d", KeywordValue::Map),
    ("map_Ns", KeywordValue::Map),
    ("map_refl", KeywordValue::Map),
    ("map_Pr", KeywordValue::Map),
    ("map_Pm", KeywordValue::Map),
    ("norm", KeywordValue::Map),
    ("map_Bump", KeywordValue::Map),
    ("bump", KeywordValue::Map),
    ("map_Ks", KeywordValue::UnusedMap),
    ("refl", KeywordValue::UnusedMap),
    ("disp", KeywordValue::UnusedMap),
    ("map_disp", KeywordValue::UnusedMap),
    ("decal", KeywordValue::UnusedMap),
    ("map_Ps", KeywordValue::UnusedMap),
    ("map_Pc", KeywordValue::UnusedMap),
    ("map_Pcr", KeywordValue::UnusedMap),
];

/// Keywords of images without a use that are other parameters to tobj.
const UNUSED: &[&str] = &["refl", "disp", "map_disp", "decal", "map_Ps", "map_Pc", "map_Pcr"];

/// Reads a library; invalid lines give warnings, and all other lines are used.
///
/// - `files`: what it may refer to.
pub(crate) fn load_library(
    path: &Path,
    files: &References,
    max_bytes: u64,
    warnings: &mut Warnings,
) -> Vec<ImportedMaterial> {
    let mut warn = |problem: String| warnings.push(format!("{}: {problem}", path.display()));
    let bytes = match InputFile::open_within(path, FileKind::Library, max_bytes).and_then(InputFile::bytes) {
        Ok(bytes) => bytes,
        Err(problem) => {
            warn(format!("{problem}; its materials use default values"));
            return Vec::new();
        }
    };
    let text = String::from_utf8_lossy(&decoded(&bytes)).into_owned();
    let mut unused = BTreeSet::new();
    let cleaned = clean(&text, &mut unused, &mut warn);
    let materials = match tobj::load_mtl_buf(&mut Cursor::new(cleaned)) {
        Ok((materials, _)) => materials,
        Err(error) => {
            warn(format!("cannot be parsed: {error}; its materials use default values"));
            return Vec::new();
        }
    };
    // MeshLab writes the opacity as `Tr`.
    let is_of_meshlab = text.lines().take(8).any(|line| line.to_ascii_lowercase().contains("converted by meshlab"));
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut file = |material: &str, name: &str| match files.resolve(folder, name) {
        _ if name.is_empty() || name.ends_with(['/', '\\']) => None,
        Ok(file) => {
            if let Some(difference) = file.difference(name) {
                warn(format!("material `{material}`: {difference}"));
            }
            Some(folder.join(file.path))
        }
        Err(outside) => {
            warn(format!("material `{material}`: {outside}; the texture is omitted"));
            None
        }
    };
    let beside = |material: &tobj::Material| -> Vec<PathBuf> {
        let names = UNUSED.iter().filter_map(|keyword| material.unknown_param.get(*keyword));
        let find = |name: &str| files.resolve(folder, name).ok().map(|file| folder.join(file.path));
        names.chain(&material.specular_texture).filter_map(|text| Some(TextureMap::parse(text, find)?.path)).collect()
    };
    let materials = materials
        .iter()
        .map(|material| ImportedMaterial { beside: beside(material), ..imported(material, is_of_meshlab, &mut file) });
    let mut materials: Vec<_> = materials.collect();
    for material in &mut materials {
        let is_plain = !material.is_of_blender();
        let maps = [
            ("map_Bump (heights)", &material.bump_texture, material.normal_map().is_none()),
            ("map_Ns", &material.shininess_texture, is_plain),
            ("map_refl", &material.reflection_texture, is_plain),
        ];
        let mut named = Vec::new();
        for (keyword, map, is_unused) in maps {
            let Some(map) = map else { continue };
            named.push(map.path.clone());
            if is_unused {
                unused.insert(format!("`{keyword}`"));
            }
        }
        material.beside.extend(named);
    }
    let is_unseen = |it: &ImportedMaterial| it.opacity == Some(0.0) && it.opacity_texture.is_none();
    // Some are meant, as those of shapes for collisions; but nobody stores a model that cannot be seen.
    if !materials.is_empty() && materials.iter().all(is_unseen) {
        warn("every material has `d 0`, so nothing would be seen: they are shown opaque".to_owned());
        for material in &mut materials {
            material.opacity = None;
            // Nor is it glass, by an `illum` that only says so, where it has a colour of its own.
            if material.diffuse.is_some_and(|diffuse| diffuse.max_element() > GLASS_AT_MOST) {
                material.illumination_model = None;
            }
        }
    }
    if !unused.is_empty() {
        warn(format!("not modelled and ignored: {}", unused.into_iter().collect::<Vec<_>>().join(", ")));
    }
    materials
}

/// Diffuse colour of what may be glass, at most.
const GLASS_AT_MOST: f32 = 0.2;

/// Only the lines that are valid, as tobj reads them: one that it cannot read would lose the whole file.
///
/// - `unused`: keywords and options that are valid and ignored.
fn clean(text: &str, unused: &mut BTreeSet<String>, warn: &mut impl FnMut(String)) -> String {
    let mut out = String::with_capacity(text.len());
    let mut named = false;
    for (number, line) in text.lines().enumerate() {
        // Byte order marks and spaces in any order: the keyword must come first.
        let line = line.trim_end().trim_start_matches(|c: char| c.is_whitespace() || c == '\u{feff}');
        let word = line.split_whitespace().next().unwrap_or_default();
        let Some((keyword, kind)) = KEYWORDS.iter().find(|(keyword, _)| keyword.eq_ignore_ascii_case(word)) else {
            continue;
        };
        let value = line[word.len()..].trim();
        let numbers: Vec<f32> =
            value.split_whitespace().map_while(|word| word.parse().ok().filter(|v: &f32| v.is_finite())).collect();
        let valid = match kind {
            KeywordValue::Name => {
                // A missing name still begins a new material.
                named = true;
                Ok(if value.is_empty() { "(unnamed)".to_owned() } else { value.to_owned() })
            }
            KeywordValue::Color => match numbers[..] {
                [r, g, b, ..] if r.min(g).min(b) >= 0.0 => Ok(format!("{r} {g} {b}")),
                [grey] if grey >= 0.0 && value.split_whitespace().count() == 1 => Ok(format!("{grey} {grey} {grey}")),
                [_, _, _, ..] => Err("must not be negative"),
                _ => Err("cannot be parsed"),
            },
            KeywordValue::Number(range) => match numbers.first() {
                Some(number) if range.contains(number) => Ok(number.to_string()),
                Some(_) => Err("is out of range"),
                None => Err("cannot be parsed"),
            },
            KeywordValue::Whole => match value.split_whitespace().next().and_then(|word| word.parse::<u8>().ok()) {
                Some(whole) => Ok(whole.to_string()),
                None => Err("cannot be parsed"),
            },
            KeywordValue::Map | KeywordValue::UnusedMap if value.is_empty() => Err("has no image"),
            KeywordValue::Map => {
                unused.extend(ignored_options(value).map(|option| format!("`{option}`")));
                Ok(value.to_owned())
            }
            KeywordValue::UnusedMap => {
                unused.insert(format!("`{keyword}`"));
                Ok(value.to_owned())
            }
        };
        match valid {
            Ok(value) if named => out.extend([keyword, " ", &value, "\n"]),
            Ok(_) => warn(format!("line {}: `{keyword}` before any `newmtl` was ignored", number + 1)),
            Err(problem) => warn(format!("line {}: `{line}` {problem} and was ignored", number + 1)),
        }
    }
    out
}

/// - `is_of_meshlab`: whether `Tr` is the opacity.
/// - `file`: the image that a material names, by the names of both.
fn imported(
    material: &tobj::Material,
    is_of_meshlab: bool,
    file: &mut dyn FnMut(&str, &str) -> Option<PathBuf>,
) -> ImportedMaterial {
    // Either of the two number types of tobj, which a feature of another crate may select.
    let single = |number| f64::from(number) as f32;
    let color = |color: Option<[_; 3]>| color.map(|color| Vec3::from_array(color.map(single)));
    let other = |keyword: &str| material.unknown_param.get(keyword).map(String::as_str);
    let number = |keyword: &str| other(keyword).and_then(|value| value.parse::<f32>().ok());
    let mut map =
        |value: Option<&str>| value.and_then(|value| TextureMap::parse(value, |name| file(&material.name, name)));
    let pbr = PbrMaterial {
        roughness: number("Pr"),
        metallic: number("Pm"),
        sheen: number("Ps"),
        clearcoat: number("Pc"),
        clearcoat_roughness: number("Pcr"),
        anisotropy: number("aniso"),
        anisotropy_rotation: number("anisor"),
        roughness_texture: map(other("map_Pr")),
        metallic_texture: map(other("map_Pm")),
    };
    // Nobody stores a surface that is not there: `Tr` alone at its end means opaque, on either scale.
    let of_tr = |tr: f32| if is_of_meshlab && tr > 0.0 || tr == 1.0 { tr } else { 1.0 - tr };
    let filter = other("Tf").map(|value| value.split_whitespace().filter_map(|word| word.parse().ok()));
    ImportedMaterial {
        name: material.name.clone(),
        ambient: color(material.ambient),
        diffuse: color(material.diffuse),
        vertex_colors: false,
        specular: color(material.specular),
        shininess: material.shininess.map(single),
        emission: color(material.emissive),
        transmission: filter.map(|mut numbers| Vec3::from_array([(); 3].map(|()| numbers.next().unwrap_or(0.0)))),
        ior: material.optical_density.map(single),
        opacity: material.dissolve.map(single).or_else(|| number("Tr").map(of_tr)),
        illumination_model: material.illumination_model,
        diffuse_texture: map(material.diffuse_texture.as_deref()),
        emission_texture: map(other("map_Ke")),
        opacity_texture: map(material.dissolve_texture.as_deref()),
        shininess_texture: map(material.shininess_texture.as_deref()),
        reflection_texture: map(other("map_refl")),
        normal_texture: map(other("norm")),
        bump_texture: map(material.normal_texture.as_deref()),
        pbr: (pbr != PbrMaterial::default()).then_some(pbr),
        beside: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use firstlight_render::Channel;
    use glam::DVec2;

    fn parse(text: &str) -> (Vec<ImportedMaterial>, Warnings) {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        let mut warnings = Warnings::default();
        let files = References::of(file.path(), false);
        (load_library(file.path(), &files, 1 << 20, &mut warnings), warnings)
    }

    fn image(name: &str) -> TextureMap {
        TextureMap::of(std::env::temp_dir().join(name))
    }

    #[test]
    fn every_field_is_read() {
        let (materials, warnings) = parse(
            "newmtl red one\r\n\tKd 0.8 0.1 0.1\r\nKs 0.5\nNs 96\nKe 1 2 3\nNi 1.5\nTr 0.25\nillum 7\nTf 1 .5 0\n\
             map_kd -s 2 3 1 -clamp on -o .5 tex\\my wood.png\nmap_Ke C:\\art\\glow.png\nnorm n.png -bm 2\nnewmtl b\n\
             d 0.5\nmap_d -imfchan m \"a b.png\"\n",
        );
        assert!(warnings.is_empty(), "{warnings:?}");
        let wood = TextureMap {
            repeat: DVec2::new(2.0, 3.0),
            offset: DVec2::new(0.5, 0.0),
            clamp: true,
            ..image("tex/my wood.png")
        };
        let expected = ImportedMaterial {
            name: "red one".into(),
            diffuse: Some(Vec3::new(0.8, 0.1, 0.1)),
            specular: Some(Vec3::splat(0.5)),
            shininess: Some(96.0),
            emission: Some(Vec3::new(1.0, 2.0, 3.0)),
            transmission: Some(Vec3::new(1.0, 0.5, 0.0)),
            ior: Some(1.5),
            opacity: Some(0.75),
            illumination_model: Some(7),
            diffuse_texture: Some(wood),
            emission_texture: Some(image("glow.png")),
            normal_texture: Some(TextureMap { bump_scale: Some(2.0), ..image("n.png") }),
            ..ImportedMaterial::default()
        };
        assert_eq!(materials[0], expected);
        let mask = Some(TextureMap { channel: Some(Channel::A), ..image("a b.png") });
        let expected =
            ImportedMaterial { name: "b".into(), opacity: Some(0.5), opacity_texture: mask, ..Default::default() };
        assert_eq!(materials[1], expected);
    }

    #[test]
    fn the_pbr_extension_is_read_with_folders_of_any_name() {
        let (materials, warnings) = parse(
            "newmtl a\nPr 0.25\nPm 1\nPs 0.5\nPc 4.0\nPcr 0.03\naniso 0.7\nanisor 0.1\nmap_Pr größe 纹理/rauh.png\n\
             map_Pm m.png\nmap_d d.png\nmap_Bump -bm 0.5 my normals.png\nnewmtl b\nPr 0.5\nnorm n.png\nmap_Bump h.png\n\
             newmtl c\nKd 1 1 1\nmap_Bump h.png\nnewmtl d\nPr 7\n",
        );
        assert_eq!(warnings.len(), 2, "{warnings:?}");
        let expected = PbrMaterial {
            roughness: Some(0.25),
            metallic: Some(1.0),
            sheen: Some(0.5),
            clearcoat: Some(4.0),
            clearcoat_roughness: Some(0.03),
            anisotropy: Some(0.7),
            anisotropy_rotation: Some(0.1),
            roughness_texture: Some(image("größe 纹理/rauh.png")),
            metallic_texture: Some(image("m.png")),
        };
        assert_eq!(materials[0].pbr, Some(expected));
        assert_eq!(materials[0].opacity_texture, Some(image("d.png")));
        let normals = TextureMap { bump_scale: Some(0.5), ..image("my normals.png") };
        assert_eq!(materials[0].normal_map(), Some(&normals));
        assert_eq!(materials[1].normal_map(), Some(&image("n.png")));
        assert_eq!((&materials[2].pbr, &materials[3].pbr), (&None, &None), "heights alone, and nothing usable");
        assert_eq!(materials[2].normal_map(), None);
    }

    #[test]
    fn a_bad_line_costs_only_itself() {
        let (materials, warnings) = parse(
            "Kd 1 1 1\nnewmtl a\nKd 1 2\nKs x\nNs\nNi nan\nillum 999\nd 7\nKe -1 0 0\nmap_Kd\nKa 1\nnewmtl\nnewmtl c\nKd 1 0 0\n",
        );
        assert_eq!(warnings.len(), 9, "{warnings:#?}");
        assert_eq!(materials.last().unwrap().diffuse, Some(Vec3::X));
        let expected = ImportedMaterial { name: "a".into(), ambient: Some(Vec3::ONE), ..Default::default() };
        assert_eq!(materials[0], expected);
    }

    #[test]
    fn what_is_not_modelled_is_told_once() {
        let (_, warnings) = parse(
            "newmtl a\nmap_Ks k.png\nmap_bump -bm 1 -t 1 1 b.png\nmap_Kd -mm 0 1 -blendu on -cc off c.png\nnewmtl b\n\
             map_Ks k.png\nmap_Kd -texres 512 -t 0 d.png\n",
        );
        assert_eq!(warnings.len(), 1, "{warnings:?}");
        assert!(warnings[0].ends_with("ignored: `-t`, `map_Bump (heights)`, `map_Ks`"), "{warnings:?}");
    }

    #[test]
    fn tr_is_transparency_but_for_meshlab_and_opaque_at_its_ends() {
        let opacity = |text: &str| parse(&format!("{text}newmtl a\n")).0.len();
        assert_eq!(opacity(""), 1);
        let of = |comment: &str, lines: &str| parse(&format!("{comment}\nnewmtl a\n{lines}")).0[0].opacity.unwrap();
        let meshlab = "#\n# Wavefront material file\n# Converted by Meshlab Group\n#";
        assert_eq!(of("", "Tr 0.25"), 0.75);
        assert_eq!(of(meshlab, "Tr 0.25"), 0.25);
        assert_eq!(["Tr 1", "Tr 0", "Tr 1\nd 1", "Tr 0.7\nd 1"].map(|lines| of("", lines)), [1.0; 4]);
        assert_eq!(["Tr 1", "Tr 0"].map(|lines| of(meshlab, lines)), [1.0; 2]);
    }

    #[test]
    fn a_library_in_which_nothing_would_be_seen_is_opaque() {
        let (hidden, warnings) = parse("newmtl skin\nd 0\nKd 0.8 0.8 0.8\nnewmtl eyes\nd 0.0\n");
        assert_eq!(hidden.iter().map(|it| it.opacity).collect::<Vec<_>>(), [None, None]);
        assert!(warnings.len() == 1 && warnings[0].contains("shown opaque"), "{warnings:?}");
        // By Blender's `illum` of what is transparent.
        let (hidden, _) = parse("newmtl skin\nd 0\nKd 0.8 0.8 0.8\nNi 1.45\nillum 9\n");
        assert_eq!((hidden[0].opacity, hidden[0].illumination_model), (None, None));
        let (glass, _) = parse("newmtl glass\nd 0\nKd 0 0 0\nNi 1.5\nillum 7\n");
        assert_eq!(glass[0].illumination_model, Some(7));
        for seen in ["newmtl box\nd 0\nnewmtl floor\nd 1\n", "newmtl leaf\nd 0\nmap_d leaf.png\n"] {
            let (materials, warnings) = parse(seen);
            assert!(materials[0].opacity == Some(0.0) && warnings.is_empty(), "{seen}: {warnings:?}");
        }
    }

    #[test]
    fn materials_of_blender_are_known_by_their_set_of_values() {
        let is = |lines: &str| parse(&format!("newmtl a\n{lines}")).0[0].is_of_blender();
        let colors = "Ns 250\nKa 1 1 1\nKs 0.5 0.5 0.5\nKe 0 0 0\nNi 1.45\n";
        for lines in ["d 1\nillum 2", "d 1\nillum 3", "d 0.5\nillum 9", "d 0.5\nillum 6", "map_d a.png\nillum 2"] {
            assert!(is(&format!("{colors}{lines}")), "{lines}");
        }
        for lines in
            ["d 1\nillum 7", "d 1\nillum 9", "d 0.2\nillum 4", "illum 2", "d 1\nillum 2\nTf 1 1 1", "d 0.1\nillum 3"]
        {
            assert!(!is(&format!("{colors}{lines}")), "{lines}");
        }
        assert!(!is("Ns 1000\nKa 0 0 0\nKd 0 0 0\nKs 1 1 1\nNi 1.5\nd 1\nillum 3"), "a mirror of a textbook");
    }

    #[test]
    fn a_missing_library_is_a_warning() {
        let mut warnings = Warnings::default();
        let folder = std::env::temp_dir();
        for missing in [Path::new("no such.mtl"), &folder] {
            assert!(load_library(missing, &References::of(missing, false), 9, &mut warnings).is_empty());
        }
        assert_eq!(warnings.len(), 2);
    }
}
