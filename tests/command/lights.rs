//! Each emissive triangle of each instance of a mesh is a light: few letters that ask for many are refused, in all formats.

use crate::program::{Outcome, program};
use std::path::Path;

/// Lights that are allowed in these tests, besides one for eight bytes.
const LIMITS: (&str, &str) = ("FIRSTLIGHT_LIMITS", "0.0005");

/// What is said of a scene that is refused; `None` if it opens.
fn refused(folder: &Path, scene: &str) -> Option<String> {
    let (name, value) = LIMITS;
    let line = format!("render {scene} -o {scene}.png --spp 1 --size 8x6");
    let outcome = Outcome::of(program(folder).args(line.split(' ')).env(name, value));
    (outcome.status != Some(0)).then_some(outcome.err)
}

fn own(materials: &str, object: &str, n: usize) -> String {
    let camera = "camera: (eye: (0, 0, 5), look_at: (0, 0, 0))";
    format!("({camera}, materials: {{{materials}}}, objects: [{}])", format!("{object},").repeat(n))
}

/// A binary STL of so many triangles.
fn stl(n: u32) -> Vec<u8> {
    let mut bytes = vec![0; 80];
    bytes.extend(n.to_le_bytes());
    for i in 0..n {
        let x = i as f32;
        let corners = [0.0, 0.0, 1.0, x, 0.0, 0.0, x + 1.0, 0.0, 0.0, x, 1.0, 0.0];
        bytes.extend(corners.iter().flat_map(|value| value.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

/// A glTF file and its buffer: a mesh of fans, and nodes that show it.
fn gltf(path: &Path, n_triangles: usize, n_nodes: usize) {
    let mut bytes: Vec<u8> = Vec::new();
    for i in 0..=128 {
        let angle = i as f32 / 50.0;
        bytes.extend([angle.cos(), angle.sin(), i as f32].iter().flat_map(|value| value.to_le_bytes()));
    }
    let n_positions = bytes.len();
    let pair = |i: usize| [0, 1 + (i % 127) as u8, 2 + (i % 127) as u8];
    bytes.extend((0..n_triangles).flat_map(pair));
    std::fs::write(path.join("lamp.bin"), &bytes).unwrap();
    let indices: Vec<String> = (0..n_nodes).map(|i| i.to_string()).collect();
    let text = format!(
        r#"{{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [{}]}}], "nodes": [{}],
        "materials": [{{"emissiveFactor": [1, 1, 1]}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "indices": 1, "material": 0}}]}}],
        "buffers": [{{"uri": "lamp.bin", "byteLength": {}}}],
        "bufferViews": [{{"buffer": 0, "byteLength": {n_positions}}},
            {{"buffer": 0, "byteOffset": {n_positions}, "byteLength": {}}}],
        "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 129, "type": "VEC3", "min": [-1, -1, 0],
            "max": [1, 1, 128]}},
            {{"bufferView": 1, "componentType": 5121, "count": {}, "type": "SCALAR"}}]}}"#,
        indices.join(","),
        (0..n_nodes).map(|i| format!(r#"{{"mesh": 0, "translation": [{i}, 0, 0]}}"#)).collect::<Vec<_>>().join(","),
        bytes.len(),
        3 * n_triangles,
        3 * n_triangles,
    );
    std::fs::write(path.join("lamps.gltf"), text).unwrap();
}

#[test]
fn few_letters_that_ask_for_many_lights_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let write = |name: &str, text: &str| std::fs::write(path.join(name), text).unwrap();
    std::fs::write(path.join("lamp.stl"), stl(4_000)).unwrap();
    let glow = "\"m\": emissive(radiance: 1)";
    let both = "\"m\": principled(emission: 1, two_sided: true)";
    let blend = "\"m\": blend(a: \"dark\", b: \"glow\", weight: 0.5), \"dark\": diffuse(albedo: 0), \
                 \"glow\": emissive(radiance: 1)";
    let mesh = |of: &str| format!("mesh(source: {of}, material: \"m\")");
    let slots = "mesh(source: stl(\"lamp.stl\"), materials: [\"m\", \"m\"])";
    let (lamp, cube, sphere) = (mesh("stl(\"lamp.stl\")"), mesh("builtin(\"cube\")"), mesh("builtin(\"icosphere\")"));
    let grid = "ball_grid(first: (0, 0, 0), steps: [(90, (1, 0, 0)), (90, (0, 1, 0))], radius: 0.3, material: \"m\")";
    write("once.ron", &own(glow, &lamp, 1));
    write("lamps.ron", &own(glow, &lamp, 10));
    write("slots.ron", &own(glow, slots, 10));
    write("cubes.ron", &own(glow, &cube, 80));
    write("both.ron", &own(both, &cube, 80));
    write("blend.ron", &own(blend, &sphere, 1));
    write("dark.ron", &own("\"m\": diffuse(albedo: 0.5)", &sphere, 10));
    write("grid.ron", &own(glow, grid, 1));
    let shape = "<shape type=\"cylinder\"><emitter type=\"area\"/></shape>";
    let mitsuba = format!("<scene version=\"3.0.0\"><sensor type=\"perspective\"/>{}</scene>", shape.repeat(40));
    write("a.xml", &mitsuba);
    let cylinder = r#"{"type": "cylinder", "emission": 1, "bsdf": {"type": "null"}}"#;
    write("a.json", &format!(r#"{{"camera": {{}}, "primitives": [{}]}}"#, [cylinder; 40].join(",")));
    gltf(path, 600, 20);
    for scene in ["once.ron", "cubes.ron", "dark.ron"] {
        assert_eq!(refused(path, scene), None, "{scene}");
    }
    for (scene, lights) in [
        ("lamps.ron", "40000"),
        ("slots.ron", "40000"),
        ("both.ron", "1920"),
        ("blend.ron", "20480"),
        ("grid.ron", "8100"),
        ("a.xml", "40960"),
        ("a.json", ""),
        ("lamps.gltf", "12000"),
    ] {
        let said = refused(path, scene).unwrap_or_else(|| panic!("{scene} is refused"));
        let told = format!("{lights} emissive triangles and spheres are too many lights");
        assert!(said.contains(&told) && said.contains("1048 are allowed"), "{scene}: {said}");
    }
}
