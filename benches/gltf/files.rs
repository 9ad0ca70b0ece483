//! Large files by formula.

use firstlight::glam::{Vec2, Vec3};
use serde_json::{Value, json};
use std::f32::consts::TAU;
use std::fmt::Write as _;
use std::io::Cursor;

/// A torus with waves, as a grid.
pub struct Torus {
    pub positions: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    pub uvs: Vec<Vec2>,
    pub triangles: Vec<[u32; 3]>,
}

/// - `n`: squares around and across, two triangles each.
pub fn torus([n, m]: [u32; 2]) -> Torus {
    let mut torus = Torus { positions: vec![], normals: vec![], uvs: vec![], triangles: vec![] };
    let at = |u: f32, v: f32| {
        let (around, across) = (TAU * u, TAU * v);
        let radius = 0.4 + 0.02 * (12.0 * around).sin() * (7.0 * across).cos();
        let far = 1.0 + radius * across.cos();
        Vec3::new(far * around.cos(), radius * across.sin(), far * around.sin())
    };
    for j in 0..=m {
        for i in 0..=n {
            let (u, v) = (i as f32 / n as f32, j as f32 / m as f32);
            const STEP: f32 = 1e-3;
            let normal = (at(u, v + STEP) - at(u, v - STEP)).cross(at(u + STEP, v) - at(u - STEP, v));
            torus.positions.push(at(u, v));
            torus.normals.push(normal.normalize());
            torus.uvs.push(Vec2::new(u * 8.0, v * 3.0));
        }
    }
    for j in 0..m {
        for i in 0..n {
            let a = j * (n + 1) + i;
            let [b, c, d] = [a + 1, a + n + 2, a + n + 1];
            torus.triangles.extend([[a, c, b], [a, d, c]]);
        }
    }
    torus
}

/// A picture by formula: sums of waves in each channel.
///
/// - `seed`: another one gives another picture.
pub fn png(size: u32, seed: u32, normals: bool) -> Vec<u8> {
    let wave = |x: u32, y: u32, k: u32| {
        let (x, y) = (x as f32 / size as f32, y as f32 / size as f32);
        let turn = (seed * 7 + k * 3) as f32;
        0.5 + 0.25 * (TAU * (9.0 * x + 4.0 * y) + turn).sin() + 0.25 * (TAU * (5.0 * y - 13.0 * x * y) + turn).cos()
    };
    let byte = |value: f32| (255.0 * value.clamp(0.0, 1.0)).round() as u8;
    let picture = image::RgbImage::from_fn(size, size, |x, y| {
        if normals {
            let tilt = Vec3::new(wave(x, y, 0) - 0.5, wave(x, y, 1) - 0.5, 1.0).normalize();
            image::Rgb((0.5 * tilt + 0.5).to_array().map(byte))
        } else {
            image::Rgb([0, 1, 2].map(|k| byte(wave(x, y, k))))
        }
    });
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, image::ImageFormat::Png).expect("memory does not fail");
    bytes.into_inner()
}

/// The torus in one buffer with its pictures: base colour, roughness and metallic, normals.
///
/// - `pictures`: none for a plain material; the third, normals, may be missing.
pub fn glb(torus: &Torus, pictures: &[Vec<u8>]) -> Vec<u8> {
    let (mut bytes, mut views) = (Vec::new(), Vec::<Value>::new());
    let mut view = |part: &[u8]| {
        views.push(json!({ "buffer": 0, "byteOffset": bytes.len(), "byteLength": part.len() }));
        bytes.extend_from_slice(part);
        bytes.resize(bytes.len().next_multiple_of(4), 0);
    };
    view(bytemuck::cast_slice(&torus.positions));
    view(bytemuck::cast_slice(&torus.normals));
    view(bytemuck::cast_slice(&torus.uvs));
    view(bytemuck::cast_slice(&torus.triangles));
    pictures.iter().for_each(|picture| view(picture));
    let count = torus.positions.len();
    let least = torus.positions.iter().fold(Vec3::INFINITY, |a, &b| a.min(b)).to_array();
    let most = torus.positions.iter().fold(Vec3::NEG_INFINITY, |a, &b| a.max(b)).to_array();
    let mut material = match pictures.is_empty() {
        true => json!({ "pbrMetallicRoughness": { "baseColorFactor": [0.5, 0.5, 0.5, 1], "metallicFactor": 0.5,
            "roughnessFactor": 0.5 } }),
        false => json!({
            "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 }, "metallicRoughnessTexture": { "index": 1 } }
        }),
    };
    if pictures.len() > 2 {
        material["normalTexture"] = json!({ "index": 2 });
    }
    let document = json!({
        "asset": { "version": "2.0" },
        "buffers": [{ "byteLength": bytes.len() }],
        "bufferViews": views,
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": count, "type": "VEC3", "min": least, "max": most },
            { "bufferView": 1, "componentType": 5126, "count": count, "type": "VEC3" },
            { "bufferView": 2, "componentType": 5126, "count": count, "type": "VEC2" },
            { "bufferView": 3, "componentType": 5125, "count": 3 * torus.triangles.len(), "type": "SCALAR" }
        ],
        "meshes": [{ "primitives": [{
            "attributes": { "POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2 }, "indices": 3, "material": 0
        }] }],
        "materials": [material],
        "nodes": [{ "mesh": 0 }],
        "scenes": [{ "nodes": [0] }],
        "scene": 0,
        "images": (0..pictures.len()).map(|i| json!({ "bufferView": 4 + i, "mimeType": "image/png" })).collect::<Vec<_>>(),
        "textures": (0..pictures.len()).map(|i| json!({ "source": i })).collect::<Vec<_>>(),
    });
    let mut text = serde_json::to_vec(&document).expect("JSON");
    text.resize(text.len().next_multiple_of(4), b' ');
    let word = |number: usize| (number as u32).to_le_bytes();
    let total = 12 + 8 + text.len() + 8 + bytes.len();
    let (head, body) = ([b"glTF", &word(2)[..], &word(total)].concat(), [&word(bytes.len())[..], b"BIN\0"].concat());
    [&head, &word(text.len())[..], b"JSON", &text, &body, &bytes].concat()
}

/// Positions and triangles alone.
pub fn obj(torus: &Torus) -> String {
    let mut text = String::new();
    for p in &torus.positions {
        writeln!(text, "v {:.6} {:.6} {:.6}", p.x, p.y, p.z).expect("memory does not fail");
    }
    for [a, b, c] in &torus.triangles {
        writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1).expect("memory does not fail");
    }
    text
}
