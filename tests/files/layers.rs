//! Pictures with layers, read back by the library that other programs use too, and films that keep what layers are made
//! of.

use crate::program::{does, run};
use exr::prelude::{AttributeValue, FlatSamples, ReadChannels, ReadLayers, read};
use std::collections::BTreeMap;
use std::path::Path;

#[track_caller]
fn refused(folder: &Path, line: &str) -> String {
    let outcome = run(folder, line);
    assert_ne!(outcome.status, Some(0), "{line}");
    outcome.err
}

/// Channels by name, and the texts of the header.
fn layers_of(path: &Path) -> (BTreeMap<String, Vec<f32>>, BTreeMap<String, String>) {
    let image = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
    let layer = image.from_file(path).unwrap().layer_data;
    let channels = layer.channel_data.list.iter().map(|channel| match &channel.sample_data {
        FlatSamples::F32(numbers) => (channel.name.to_string(), numbers.clone()),
        other => panic!("{}: {other:?}", channel.name),
    });
    let texts = layer.attributes.other.iter().filter_map(|(name, value)| match value {
        AttributeValue::Text(text) => Some((name.to_string(), text.to_string())),
        _ => None,
    });
    (channels.collect(), texts.collect())
}

const ALL: &str = "albedo,normal,depth,position,coverage,object,material,variance,samples,error";

/// The raw image with the denoised one beside it: the same numbers as with `--denoise`; without a scene there is none.
#[test]
fn the_denoised_layer_is_the_denoised_image() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let scene = "render cornell --size 24x16 --spp 4";
    does(path, &format!("{scene} -o both.exr --layers denoised --film film.exr"));
    does(path, &format!("{scene} -o denoised.exr --denoise"));
    // The option adds the layer to others.
    does(path, &format!("{scene} -o option.exr --layers albedo --denoise"));
    does(path, &format!("{scene} -o layer.exr --layers albedo,denoised"));
    assert!(layers_of(&path.join("option.exr")).0 == layers_of(&path.join("layer.exr")).0);
    does(path, &format!("{scene} -o raw.exr"));
    let [both, denoised, raw] = ["both.exr", "denoised.exr", "raw.exr"].map(|name| layers_of(&path.join(name)).0);
    for channel in ["R", "G", "B"] {
        assert_eq!(both[channel], raw[channel]);
        assert_eq!(both[&format!("denoised.{channel}")], denoised[channel]);
        assert_ne!(both[channel], denoised[channel]);
    }
    let note_of = |name: &str| std::fs::read(path.join(name)).unwrap();
    let has = |bytes: &[u8], text: &str| bytes.windows(text.len()).any(|window| window == text.as_bytes());
    let (of_both, of_raw) = (note_of("both.exr"), note_of("raw.exr"));
    assert!(has(&of_both, "denoised_layer") && !has(&of_raw, "denoised"));
}

/// A film that is read, or added up from parts, denoises as well as the one that was rendered, and its errors are known.
#[test]
fn a_film_that_is_opened_again_denoises_to_the_same_image() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let of = |name: &str| layers_of(&path.join(name)).0;
    let layers = "--layers denoised,error";
    // Light paths in one scene; samples after the last doubling in the other.
    for (scene, spp) in [("cornell-balls", 8), ("cornell", 6)] {
        let scene = format!("render {scene} --size 40x24");
        does(path, &format!("{scene} --spp {spp} -o at-once.exr {layers} --film film.exr --overwrite"));
        does(path, &format!("render film.exr --spp {spp} --resume -o again.exr {layers} --overwrite"));
        assert!(of("again.exr") == of("at-once.exr"), "{scene}");
    }
    let scene = "render cornell-balls --size 40x24";
    does(path, &format!("{scene} --samples 0..8 -o at-once.exr {layers} --film film.exr --overwrite"));
    does(path, &format!("{scene} --samples 0..4 -o part.exr --film part-1.exr"));
    does(path, &format!("{scene} --samples 4..8 -o part.exr --film part-2.exr --overwrite"));
    does(path, "merge part-2.exr part-1.exr -o merged.exr");
    assert!(std::fs::read(path.join("merged.exr")).unwrap() == std::fs::read(path.join("film.exr")).unwrap());
    does(path, &format!("render merged.exr --spp 8 --resume -o again.exr {layers} --overwrite"));
    assert!(of("again.exr") == of("at-once.exr"), "merged");
    let merge = "merge part-2.exr part-1.exr --overwrite -o merged.exr --image image.exr";
    does(path, &format!("{merge} {layers}"));
    assert!(of("image.exr") == of("at-once.exr"), "by merge");
    let message = refused(path, &format!("{merge} --denoiser own"));
    assert!(message.contains("--layers denoised"), "{message}");
}

/// Names as other programs expect them; sizes, ranges and sums as they must be.
#[test]
fn layers_have_the_names_and_numbers_that_other_programs_expect() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let scene = "render cornell-balls --size 48x32 --spp 4";
    does(path, &format!("{scene} -o all.exr --layers {ALL}"));
    let (channels, texts) = layers_of(&path.join("all.exr"));
    let mut expected: Vec<String> =
        ["R", "G", "B", "depth.Z", "depth_variance.Z", "coverage.Y", "samples.Y", "error.Y"].map(str::to_owned).into();
    for (layer, names) in [("albedo", "RGB"), ("normal", "XYZ"), ("position", "XYZ")] {
        expected.extend(names.chars().flat_map(|c| [format!("{layer}.{c}"), format!("{layer}_variance.{c}")]));
    }
    for layer in ["CryptoObject", "CryptoMaterial"] {
        expected.extend((0..3).flat_map(|k| "RGBA".chars().map(move |c| format!("{layer}{k:02}.{c}"))));
    }
    expected.sort();
    assert_eq!(channels.keys().cloned().collect::<Vec<_>>(), expected);
    let get = |name: &str| &channels[name];
    assert!(get("samples.Y").iter().all(|&n| n == 4.0));
    assert!(channels.values().flatten().all(|number| number.is_finite()));
    // The middle of the back wall, which is white and faces the camera.
    let at = 6 * 48 + 24;
    assert_eq!([get("normal.X")[at], get("normal.Y")[at], get("normal.Z")[at]], [0.0, 0.0, 1.0]);
    assert!((get("position.Z")[at] - (4.9 - get("depth.Z")[at])).abs() < 1e-4, "the camera stands at 4.9 m");
    // Masks: shares sum to what is seen, and the id of a name is its hash (of another implementation).
    for (layer, key, name, id) in
        [("CryptoObject", "3ae39a5", "floor", 0x7819_c83c_u32), ("CryptoMaterial", "be359d6", "white", 0xdb8f_0013)]
    {
        let attribute = |what: &str| texts[&format!("cryptomatte/{key}/{what}")].as_str();
        assert_eq!(
            [attribute("name"), attribute("hash"), attribute("conversion")],
            [layer, "MurmurHash3_32", "uint32_to_float32"]
        );
        let manifest: BTreeMap<String, String> = serde_json::from_str(attribute("manifest")).unwrap();
        assert_eq!(manifest[name], format!("{id:08x}"));
        let ids: Vec<u32> = manifest.values().map(|hash| u32::from_str_radix(hash, 16).unwrap()).chain([0]).collect();
        let mut sums = vec![0.0_f32; 48 * 32];
        let mut of_name = 0.0;
        for k in 0..3 {
            for (of_id, of_share) in [("R", "G"), ("B", "A")] {
                let channel = |c: &str| get(&format!("{layer}{k:02}.{c}"));
                for ((found, share), sum) in channel(of_id).iter().zip(channel(of_share)).zip(&mut sums) {
                    assert!(ids.contains(&found.to_bits()), "{:08x}", found.to_bits());
                    *sum += share;
                    of_name += if found.to_bits() == id { *share } else { 0.0 };
                }
            }
        }
        assert!(of_name > 100.0, "{name} covers {of_name} pixels");
        let is_whole = |sum: f32| (sum - 1.0).abs() < 1e-6 || sum == 0.0;
        assert!(sums.iter().filter(|sum| !is_whole(**sum)).count() < 160, "only along the outline of the room");
        assert_eq!(sums[at], 1.0);
    }
    // Fewer layers are fewer channels, and the light is the same with layers and without.
    does(path, &format!("{scene} -o some.exr --layers depth,samples"));
    does(path, &format!("{scene} -o none.exr"));
    let (some, texts) = layers_of(&path.join("some.exr"));
    assert_eq!(some.keys().collect::<Vec<_>>(), ["B", "G", "R", "depth.Z", "samples.Y"]);
    assert!(!texts.keys().any(|name| name.starts_with("cryptomatte")));
    let (none, _) = layers_of(&path.join("none.exr"));
    assert!("RGB".chars().map(String::from).all(|c| none[&c] == channels[&c] && none[&c] == some[&c]));
    assert_eq!(some["depth.Z"], channels["depth.Z"]);
}

/// A picture of layers opens as a scene, as any picture.
#[test]
fn a_picture_with_layers_can_be_rendered_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    does(path, "render cornell -o a.exr --size 16x16 --spp 2 --layers albedo,object");
    does(path, "render a.exr -o b.exr --layers albedo,object");
    assert!(std::fs::read(path.join("a.exr")).unwrap() == std::fs::read(path.join("b.exr")).unwrap());
    let stdout = run(path, "render a.exr -o - --format exr --layers albedo,object").bytes;
    assert!(
        layers_of(&path.join("a.exr")).0 == {
            std::fs::write(path.join("c.exr"), stdout).unwrap();
            layers_of(&path.join("c.exr")).0
        }
    );
}

#[test]
fn films_keep_layers_through_resuming_and_merging() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let bytes = |name: &str| std::fs::read(path.join(name)).unwrap();
    // Parts have the same samples in all pixels.
    let scene = "render cornell-balls --size 40x33 --uniform";
    does(path, &format!("{scene} --spp 4 -o whole.exr --film whole-film.exr --layers {ALL}"));
    let layers_told = |name: &str| -> Vec<String> {
        let told = run(path, &format!("info {name} --json")).bytes;
        serde_json::from_value(serde_json::from_slice::<serde_json::Value>(&told).unwrap()["layers"].take()).unwrap()
    };
    assert_eq!(layers_told("whole.exr").join(","), ALL);
    let kept: Vec<&str> = ALL.split(',').take(8).collect();
    assert_eq!(layers_told("whole-film.exr"), kept, "what comes from the film itself is no channel of it");
    assert!(layers_told("cornell").is_empty());
    // Resumed with the layers asked for again, and without.
    for (name, layers) in [("again", format!("--layers {ALL}")), ("kept", String::new())] {
        does(path, &format!("{scene} --spp 2 -o r.exr --film {name}.exr --layers albedo"));
        does(path, &format!("{scene} --spp 4 -o r.exr --film {name}.exr --resume {layers}"));
        assert!(bytes(&format!("{name}.exr")) == bytes("whole-film.exr"), "{name}");
    }
    // In parts, one of which looked at nothing, by different numbers of threads.
    does(path, &format!("{scene} --samples 0..1 -o p.exr --film a.exr --layers {ALL} --threads 1"));
    does(path, &format!("{scene} --samples 1..2 -o p.exr --film b.exr"));
    does(path, &format!("{scene} --samples 2..4 -o p.exr --film c.exr --layers albedo,object --threads 3"));
    for order in ["a.exr b.exr c.exr", "c.exr a.exr b.exr"] {
        does(path, &format!("merge {order} -o merged.exr --image merged-picture.exr --layers {ALL} --overwrite"));
        assert!(bytes("merged.exr") == bytes("whole-film.exr"), "{order}");
        assert!(layers_of(&path.join("merged-picture.exr")).0 == layers_of(&path.join("whole.exr")).0, "{order}");
    }
    let said = refused(path, "merge b.exr c.exr -o d.exr --layers albedo");
    assert!(said.contains("--image"), "{said}");
    does(path, &format!("{scene} --samples 2..3 -o p.exr --film d.exr"));
    let said = refused(path, "merge b.exr d.exr -o e.exr --image e-picture.exr --layers albedo");
    assert!(said.contains("have no such layers"), "{said}");
    // More samples for features take the place of fewer.
    does(path, &format!("{scene} --spp 2 -o r.exr --film more.exr --layers albedo --layer-samples 4"));
    let few = layers_of(&path.join("r.exr")).0;
    does(path, &format!("{scene} --spp 4 -o r.exr --film more.exr --resume --layers albedo"));
    assert!(bytes("more.exr") == bytes("whole-film.exr"));
    assert!(few["albedo.R"] != layers_of(&path.join("r.exr")).0["albedo.R"]);
}

#[test]
fn layers_that_cannot_be_had_are_refused_before_anything_is_rendered() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    for (line, expected) in [
        ("render cornell -o a.png --layers albedo", "only an .exr has layers"),
        ("render cornell -o a.exr --layers variance,samples", "add albedo, normal, depth or position"),
        ("render cornell -o a.exr --spp 1 --layers error", "at least two samples"),
        ("render cornell -o a.exr --layers colour", "albedo"),
        ("render cornell -o a.exr --layer-samples 4", "--layers"),
        ("render cornell -o a.exr --layers albedo --layer-samples 0", "must be between 1 and 65536"),
    ] {
        let said = refused(path, line);
        assert!(said.contains(expected), "{line}: {said}");
    }
    assert_eq!(std::fs::read_dir(path).unwrap().count(), 0);
    // Frames of a sequence have layers too.
    does(path, "render cornell -o turn.exr --size 12x12 --spp 1 --turntable 2 --layers depth");
    let [a, b] = [1, 2].map(|k| layers_of(&path.join(format!("turn-000{k}.exr"))).0);
    assert!(a["depth.Z"] != b["depth.Z"]);
}
