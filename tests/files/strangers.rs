//! glTF files as other programs write them, and files with one broken part: they open, that part is told once, and the
//! scene that `save` writes of them opens again.

use super::gltf_writer::{Writer, f32s, quad};
use firstlight::scene::file::MaterialPart;
use firstlight::scene::{
    ColorParam, ColorValue, Limits, LoadOptions, LoadedScene, Material, ModelChoice, ObjectInput, ScalarParam,
    ScalarValue, SceneInputs, SceneSource, Shape, SurfaceMaterial, load, read_picture_within, save_scene,
};
use glam::Vec3;
use serde_json::{Value, json};
use std::path::Path;

fn open(path: &Path) -> Result<LoadedScene, String> {
    let choice = ModelChoice::default();
    let options = LoadOptions { choice: Some(&choice), ..LoadOptions::default() };
    load(&SceneSource::parse(path).unwrap(), &options).map_err(|error| error.to_string())
}

fn n_triangles(scene: &LoadedScene) -> usize {
    let mut world = bevy_ecs::world::World::new();
    scene.spawn(&mut world);
    let inputs = SceneInputs::of(&mut world);
    let count = |object: &ObjectInput| match &object.shape {
        Shape::Mesh(mesh) => mesh.triangles.len(),
        _ => 0,
    };
    inputs.objects.iter().map(count).sum()
}

/// Saves a scene beside its model, and opens what was written.
fn saved(scene: &LoadedScene, folder: &Path) -> LoadedScene {
    let mut world = bevy_ecs::world::World::new();
    scene.spawn(&mut world);
    let file = folder.join("saved.ron");
    save_scene(&mut world, Some(scene), &file).unwrap();
    open(&file).unwrap_or_else(|error| panic!("{error}\n{}", std::fs::read_to_string(&file).unwrap()))
}

/// Two squares with texture coordinates and a textured material. The image is in the buffer.
fn two_squares() -> Writer {
    let mut writer = Writer::default();
    quad(&mut writer);
    let mut png = std::io::Cursor::new(Vec::new());
    image::RgbImage::from_pixel(2, 2, image::Rgb([200, 40, 40])).write_to(&mut png, image::ImageFormat::Png).unwrap();
    let image = writer.view(png.get_ref(), None);
    let uv = writer.floats("VEC2", &[0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0]);
    // For one of the cases.
    writer.indices(5123, &[0, 1, 2, 0, 2, 9]);
    writer.json["images"] = json!([{ "bufferView": image, "mimeType": "image/png" }]);
    writer.json["textures"] = json!([{ "source": 0 }]);
    writer.json["materials"] = json!([{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }]);
    let primitive = &mut writer.json["meshes"][0]["primitives"][0];
    (primitive["attributes"]["TEXCOORD_0"], primitive["material"]) = (json!(uv), json!(0));
    let mesh = writer.json["meshes"][0].clone();
    writer.json["meshes"] = json!([mesh, mesh]);
    writer.json["nodes"] = json!([{ "mesh": 0 }, { "mesh": 1, "translation": [2, 0, 0] }]);
    writer.json["scenes"] = json!([{ "nodes": [0, 1] }]);
    writer
}

/// What is written, how many of the four triangles remain, and a part of the only warning about it (none: no warning).
type Case = (&'static str, fn(&mut Writer), usize, &'static str);

const CASES: &[Case] = &[
    ("whole", |_| {}, 4, ""),
    // Nodes.
    (
        "a child with two parents",
        |w| w.json["nodes"] = json!([{ "children": [1, 2] }, { "mesh": 0 }, { "children": [1], "mesh": 1 }]),
        4,
        "",
    ),
    (
        "a child named twice",
        |w| w.json["nodes"] = json!([{ "children": [1, 1] }, { "mesh": 0, "children": [] }]),
        2,
        "nodes[1] is a child more than once",
    ),
    (
        "a root of the scene below another",
        |w| w.json["nodes"][0]["children"] = json!([1]),
        4,
        "nodes[1] is a root of the scene and a child as well",
    ),
    (
        "a root below a node outside of the scene",
        |w| w.json["nodes"].as_array_mut().unwrap().push(json!({ "children": [0] })),
        4,
        "",
    ),
    ("a root named twice", |w| w.json["scenes"] = json!([{ "nodes": [0, 1, 0] }]), 4, ""),
    ("a cycle in the scene", |w| w.json["nodes"][0]["children"] = json!([0]), 4, "nodes[0]"),
    (
        "a cycle outside of the scene",
        |w| w.json["nodes"].as_array_mut().unwrap().extend([json!({ "children": [3] }), json!({ "children": [2] })]),
        4,
        "",
    ),
    (
        "a child that does not exist",
        |w| w.json["nodes"][0]["children"] = json!([9]),
        4,
        "nodes[0].children[0] is left out",
    ),
    (
        "a root that does not exist",
        |w| w.json["scenes"] = json!([{ "nodes": [0, 9] }]),
        2,
        "scenes[0].nodes[1] is left out",
    ),
    ("a scene that does not exist", |w| w.json["scene"] = json!(5), 4, "scene is left out"),
    (
        "a rounded matrix",
        |w| w.json["nodes"][0]["matrix"] = json!([1, 0, 0, 1e-9, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0.99999994]),
        4,
        "",
    ),
    (
        "a matrix of perspective",
        |w| w.json["nodes"][0]["matrix"] = json!([1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]),
        4,
        "the last row of its matrix",
    ),
    ("a rotation of length 0", |w| w.json["nodes"][0]["rotation"] = json!([0, 0, 0, 0]), 4, "which is no turn"),
    ("a matrix of two numbers", |w| w.json["nodes"][0]["matrix"] = json!([1, 2]), 4, "nodes[0].matrix is left out"),
    ("a node that is a number", |w| w.json["nodes"][1] = json!(7), 2, "nodes[1] is left out"),
    ("integers with a fraction", |w| w.json["scene"] = json!(0.0), 4, ""),
    ("a node that is flattened", |w| w.json["nodes"][1]["scale"] = json!([1, 0, 1]), 2, "is flattened"),
    // Cameras, lights, skins, animations.
    (
        "a camera of size 0",
        |w| {
            w.json["cameras"] = json!([{ "type": "perspective", "perspective": { "yfov": 0 } }]);
            w.json["nodes"][0]["camera"] = json!(0);
        },
        4,
        "cameras[0] is left out",
    ),
    ("a camera that does not exist", |w| w.json["nodes"][0]["camera"] = json!(3), 4, "cameras[3] is left out"),
    (
        "a light that does not exist",
        |w| w.json["nodes"][0]["extensions"] = json!({ "KHR_lights_punctual": { "light": 4 } }),
        4,
        "nodes[0].light is left out",
    ),
    ("a skin that does not exist", |w| w.json["nodes"][1]["skin"] = json!(3), 4, "skins[3] is left out"),
    (
        "an animation of nothing",
        |w| {
            w.json["animations"] = json!([{ "channels": [{ "sampler": 9, "target": { "node": 0, "path": "scale" } }] }])
        },
        4,
        "",
    ),
    // Meshes.
    ("a mesh that does not exist", |w| w.json["nodes"][1]["mesh"] = json!(9), 2, "nodes[1].mesh is left out"),
    ("no POSITION", |w| w.json["meshes"][1]["primitives"][0]["attributes"] = json!({}), 2, "POSITION is missing"),
    ("an unknown mode", |w| w.json["meshes"][1]["primitives"][0]["mode"] = json!(9), 2, "mode is `9`"),
    (
        "an accessor that does not exist",
        |w| w.json["meshes"][1]["primitives"][0]["indices"] = json!(99),
        2,
        "accessors[99]",
    ),
    (
        "normals that do not exist",
        |w| w.json["meshes"][1]["primitives"][0]["attributes"]["NORMAL"] = json!(99),
        4,
        "primitives[0].NORMAL is left out",
    ),
    (
        "coordinates of another length",
        |w| w.json["meshes"][1]["primitives"][0]["attributes"]["TEXCOORD_1"] = json!(1),
        4,
        "primitives[0].TEXCOORD_1 is left out",
    ),
    ("a stride of 0", |w| w.json["bufferViews"][0]["byteStride"] = json!(0), 4, ""),
    (
        "a vertex that is no number, unused",
        |w| {
            w.bytes[40..44].copy_from_slice(&f32::NAN.to_le_bytes());
            w.json["accessors"][1]["count"] = json!(3);
        },
        2,
        "",
    ),
    (
        "a vertex that is no number",
        |w| w.bytes[40..44].copy_from_slice(&f32::NAN.to_le_bytes()),
        2,
        "meshes[1]: 1 triangles have a corner that does not exist, or is NaN",
    ),
    (
        "an index out of range",
        |w| w.json["meshes"][1]["primitives"][0]["indices"] = json!(3),
        3,
        "have a corner that does not exist",
    ),
    // Materials and images.
    ("a material that does not exist", |w| w.json["meshes"][1]["primitives"][0]["material"] = json!(9), 4, ""),
    (
        "a texture that does not exist",
        |w| w.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"] = json!(9),
        4,
        "textures[9] is left out",
    ),
    ("an image that does not exist", |w| w.json["textures"][0]["source"] = json!(9), 4, "textures[0] is left out"),
    (
        "an image of the network",
        |w| w.json["images"] = json!([{ "uri": "http://localhost/a.png" }]),
        4,
        "images[0] is left out",
    ),
    (
        "an image outside of the folder",
        |w| w.json["images"] = json!([{ "uri": "../a.png" }]),
        4,
        "images[0] is left out",
    ),
    ("an image without a file", |w| w.json["images"] = json!([{ "uri": "none.png" }]), 4, "the texture is omitted"),
    ("an image that is cut off", |w| w.json["bufferViews"][2]["byteLength"] = json!(40), 4, "the texture is omitted"),
    (
        "an image in no known format",
        |w| w.json["images"] = json!([{ "uri": "data:image/jp2;base64,AAAA" }]),
        4,
        "the texture is omitted",
    ),
    ("an image without data", |w| w.json["images"] = json!([{}]), 4, "the texture is omitted"),
    (
        "a color that is a word",
        |w| w.json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = json!("red"),
        4,
        "materials[0].pbrMetallicRoughness is left out",
    ),
    ("light beyond all numbers", |w| w.json["materials"][0]["emissiveFactor"] = json!([1e300, 1e300, 1e300]), 4, ""),
    // Buffers and extensions.
    (
        "a buffer that nothing reads",
        |w| {
            w.json = w.document();
            w.json["buffers"]
                .as_array_mut()
                .unwrap()
                .extend([json!({ "byteLength": 9 }), json!({ "uri": "none.bin", "byteLength": 9 })]);
        },
        4,
        "",
    ),
    (
        "a buffer without its end",
        |w| {
            w.json = w.document();
            w.json["buffers"][0]["byteLength"] = json!(1_u64 << 40);
        },
        4,
        "buffers[0] has 1099511627776 bytes, but",
    ),
    (
        "an unknown extension",
        |w| w.json["extensionsRequired"] = json!(["EXT_from_the_future"]),
        4,
        "needs the extension `EXT_from_the_future`",
    ),
    (
        "a broken compressed stream",
        |w| w.json["bufferViews"][0]["extensions"] = json!({ "KHR_meshopt_compression": { "buffer": 0, "byteLength": 8, "byteStride": 12, "count": 4, "mode": "ATTRIBUTES" } }),
        4,
        "bufferViews[0] is left out",
    ),
];

#[test]
fn a_broken_part_costs_only_itself_and_is_told_once() {
    for &(name, change, triangles, told) in CASES {
        let mut writer = two_squares();
        change(&mut writer);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.glb");
        std::fs::write(&path, writer.glb()).unwrap();
        let scene = open(&path).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(n_triangles(&scene), triangles, "{name}");
        let warnings: Vec<String> = scene.warnings.iter().map(|warning| warning.to_string()).collect();
        let about = warnings.iter().filter(|warning| !told.is_empty() && warning.contains(told)).count();
        assert_eq!(about, usize::from(!told.is_empty()), "{name}: {warnings:#?}");
        let again = saved(&scene, folder.path());
        assert_eq!(n_triangles(&again), triangles, "{name}");
        assert_eq!(again.content_fingerprint(), scene.content_fingerprint(), "{name}");
    }
}

/// The same for the images of OBJ and PLY files.
#[test]
fn models_with_broken_images_can_be_saved() {
    let obj = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3\n";
    let ply = "ply\nformat ascii 1.0\ncomment TextureFile a.png\nelement vertex 3\nproperty float x\nproperty float y\n\
               property float z\nproperty float s\nproperty float t\nelement face 1\n\
               property list uchar int vertex_indices\nend_header\n0 0 0 0 0\n1 0 0 1 0\n0 1 0 0 1\n3 0 1 2\n";
    for (file, text) in [("a.obj", obj), ("a.ply", ply)] {
        for image in [None, Some(&b""[..]), Some(b"\x89PNG\r\n\x1a\nnothing"), Some(b"no image")] {
            let folder = tempfile::tempdir().unwrap();
            std::fs::write(folder.path().join(file), text).unwrap();
            let maps = "newmtl m\nKd 0.8 0.2 0.2\nmap_Kd a.png\nmap_d a.png\nmap_Bump b.png\n";
            std::fs::write(folder.path().join("a.mtl"), maps).unwrap();
            if let Some(image) = image {
                std::fs::write(folder.path().join("a.png"), image).unwrap();
            }
            let scene = open(&folder.path().join(file)).unwrap();
            let again = saved(&scene, folder.path());
            assert_eq!(n_triangles(&again), 1);
            assert_eq!(again.content_fingerprint(), scene.content_fingerprint(), "{file}");
        }
    }
}

/// The colour of the first material in the world, and what it emits.
fn first_colors(scene: &LoadedScene) -> [ColorParam; 2] {
    let mut world = bevy_ecs::world::World::new();
    scene.spawn(&mut world);
    let inputs = SceneInputs::of(&mut world);
    let material = &world.get::<SurfaceMaterial>(inputs.objects[0].slots[0]).unwrap().0;
    let emission = match material {
        Material::Principled { emission, .. } => emission.clone(),
        _ => ColorParam::Rgb(Vec3::ZERO),
    };
    [material.color().unwrap().clone(), emission]
}

#[test]
fn where_an_image_is_missing_the_colour_beside_it_is_shown() {
    let folder = tempfile::tempdir().unwrap();
    let orange = Vec3::new(1.0, 0.5, 0.25);
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("a.mtl", "newmtl a\nKd 1 0.5 0.25\nmap_Kd none.png\n");
    write("a.obj", "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\n");
    let scene = open(&folder.path().join("a.obj")).unwrap();
    assert_eq!(first_colors(&scene)[0], ColorParam::Rgb(orange));
    assert!(scene.warnings.iter().any(|told| told.contains("the colour beside it")), "{:?}", scene.warnings);
    let path = folder.path().join("a.glb");
    for is_unlit in [false, true] {
        let mut writer = two_squares();
        writer.json["images"] = json!([{ "uri": "none.png" }]);
        writer.json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = json!([1.0, 0.5, 0.25, 1.0]);
        if is_unlit {
            writer.json["extensionsUsed"] = json!(["KHR_materials_unlit"]);
            writer.json["materials"][0]["extensions"] = json!({ "KHR_materials_unlit": {} });
        }
        std::fs::write(&path, writer.glb()).unwrap();
        let [color, emission] = first_colors(&open(&path).unwrap());
        let [shown, black] = if is_unlit { [emission, color] } else { [color, emission] };
        assert_eq!([shown, black], [ColorParam::Rgb(orange), ColorParam::Rgb(Vec3::ZERO)], "unlit: {is_unlit}");
    }
}

#[test]
fn a_file_with_nothing_left_is_refused_with_the_reason() {
    for (change, expected) in [
        (
            (|w: &mut Writer| w.json["accessors"][0]["count"] = json!(1_000_000)) as fn(&mut Writer),
            "accessors[0]: needs 12000000 bytes",
        ),
        (|w| w.json["meshes"] = json!([]), "nodes[0].mesh is left out"),
        (|w| w.json["nodes"] = json!([]), "scenes[0].nodes[0] is left out"),
        (|w| w.bytes[..48].copy_from_slice(&f32s(&[5.0; 12])), "has no area: all of its triangles are of zero size"),
        (
            |w| {
                for mesh in 0..2 {
                    w.json["meshes"][mesh]["primitives"][0]["mode"] = json!(1)
                }
            },
            "has only points or lines",
        ),
        (
            |w| {
                w.json = w.document();
                w.json["buffers"][0]["uri"] = json!("none.bin");
            },
            "`none.bin` cannot be read: no such file",
        ),
    ] {
        let mut writer = two_squares();
        change(&mut writer);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.glb");
        std::fs::write(&path, writer.glb()).unwrap();
        let error = open(&path).err().unwrap_or_else(|| panic!("it opens: {expected}"));
        assert!(error.contains("nothing of it can be shown") && error.contains(expected), "{error} for {expected}");
    }
}

#[test]
fn the_first_version_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.gltf");
    std::fs::write(&path, r#"{ "asset": { "version": "1.0" }, "meshes": { "a": {} }, "nodes": { "b": {} } }"#).unwrap();
    let error = open(&path).err().unwrap();
    assert!(error.contains("glTF version 1.0 is not supported"), "{error}");
}

/// Specular and glossiness are the colour and the roughness of a dielectric.
#[test]
fn specular_and_glossiness_become_a_dielectric() {
    let mut writer = two_squares();
    writer.json["extensionsRequired"] = json!(["KHR_materials_pbrSpecularGlossiness"]);
    writer.json["materials"] = json!([{ "alphaMode": "BLEND", "extensions": { "KHR_materials_pbrSpecularGlossiness": {
        "diffuseFactor": [0.5, 0.25, 0, 0.75], "specularFactor": [0.04, 0.4, 1], "glossinessFactor": 0.75,
    } } }]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    std::fs::write(&path, writer.glb()).unwrap();
    let principled = |scene: &LoadedScene| scene.file.materials.iter().next().map(|(_, part)| part.clone()).unwrap();
    let scene = open(&path).unwrap();
    let MaterialPart::Principled { base_color, metallic, roughness, specular_color, opacity, ior, .. } =
        principled(&scene)
    else {
        panic!("a principled material")
    };
    assert_eq!(base_color, ColorValue::rgb(0.5, 0.25, 0.0));
    assert_eq!((metallic, roughness, ior), (ScalarValue::Number(0.0), ScalarValue::Number(0.25), 1.5));
    assert_eq!(opacity, ScalarValue::Number(0.75));
    // An index of 1.5 reflects 4 % where it faces the light.
    let ColorValue::Rgb(color) = specular_color else { panic!("a color") };
    assert!((0.04 * color).abs_diff_eq(Vec3::new(0.04, 0.4, 1.0), 1e-6), "{color}");
    // With textures, roughness is 1 less glossiness.
    let glossy = &mut writer.json["materials"][0]["extensions"]["KHR_materials_pbrSpecularGlossiness"];
    glossy["specularGlossinessTexture"] = json!({ "index": 0 });
    glossy["diffuseTexture"] = json!({ "index": 0 });
    std::fs::write(&path, writer.glb()).unwrap();
    let scene = open(&path).unwrap();
    let mut world = bevy_ecs::world::World::new();
    scene.spawn(&mut world);
    let inputs = SceneInputs::of(&mut world);
    let found = inputs.materials.iter().find_map(|material| match &material.material {
        Material::Principled { roughness: ScalarParam::Texture(texture), .. } => Some(texture.texture.clone()),
        _ => None,
    });
    // The image has no alpha, which counts as 1.
    assert!(found.unwrap().eval(glam::Vec2::splat(0.5)).abs_diff_eq(Vec3::splat(0.25), 1e-6));
    assert_eq!(saved(&scene, folder.path()).content_fingerprint(), scene.content_fingerprint());
}

/// A textured surface without texture coordinates shows the texel at (0, 0), not the whole image on each triangle.
#[test]
fn without_texture_coordinates_there_is_one_texel() {
    let mut writer = two_squares();
    writer.json["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().remove("TEXCOORD_0");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    std::fs::write(&path, writer.glb()).unwrap();
    let scene = open(&path).unwrap();
    let mut world = bevy_ecs::world::World::new();
    scene.spawn(&mut world);
    let inputs = SceneInputs::of(&mut world);
    let Shape::Mesh(mesh) = &inputs.objects[0].shape else { panic!("a mesh") };
    assert_eq!(mesh.uvs, [glam::Vec2::new(0.0, 1.0); 4]);
}

/// Names of files as Windows allows them.
#[test]
fn names_of_files_may_differ_by_case_and_slash() {
    let mut writer = Writer::default();
    quad(&mut writer);
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("sub")).unwrap();
    std::fs::write(folder.path().join("sub/data.bin"), &writer.bytes).unwrap();
    let path = folder.path().join("a.gltf");
    let with = |uri: &str| {
        let mut json: Value = writer.document();
        json["buffers"][0]["uri"] = json!(uri);
        std::fs::write(&path, serde_json::to_vec(&json).unwrap()).unwrap();
        open(&path).map(|scene| scene.warnings.iter().filter(|warning| warning.contains("differs by case")).count())
    };
    assert_eq!([with("sub/data.bin"), with("sub\\data.bin"), with("SUB\\Data.bin")], [Ok(0), Ok(0), Ok(1)]);
    let data = base64::Engine::encode(&base64::engine::general_purpose::STANDARD, &writer.bytes);
    let lines: Vec<&str> = data.as_bytes().chunks(76).map(|line| std::str::from_utf8(line).unwrap()).collect();
    assert_eq!(with(&format!("data:application/octet-stream;base64,{}", lines.join("\r\n"))), Ok(0));
}

/// In other formats too: material libraries, their textures and those of PLY.
#[test]
fn names_that_differ_by_case_are_told_in_every_format() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    image::RgbImage::new(1, 1).save(folder.path().join("image.png")).unwrap();
    write("library.mtl", "newmtl a\nmap_Kd IMAGE.png\n");
    write("a.obj", "mtllib Library.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\n");
    write(
        "a.ply",
        "ply\nformat ascii 1.0\ncomment TextureFile Image.png\nelement vertex 3\nproperty float x\nproperty float y\n\
         property float z\nproperty float s\nproperty float t\nelement face 1\nproperty list uchar int vertex_indices\n\
         end_header\n0 0 0 0 0\n1 0 0 0 0\n0 1 0 0 0\n3 0 1 2\n",
    );
    for (model, names) in [("a.obj", vec!["Library.mtl", "IMAGE.png"]), ("a.ply", vec!["Image.png"])] {
        let warnings = open(&folder.path().join(model)).unwrap().warnings;
        let told: Vec<_> = warnings.iter().filter(|warning| warning.contains("differs by case")).collect();
        assert_eq!(told.len(), names.len(), "{warnings:?}");
        assert!(names.iter().all(|name| told.iter().any(|it| it.contains(name))), "{told:?}");
    }
}

#[test]
fn textures_of_basis_universal_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let mut writer = two_squares();
    let view = writer.view(&uastc(), None);
    writer.json["images"] = json!([{ "bufferView": view, "mimeType": "image/ktx2" }]);
    writer.json["textures"] = json!([{ "extensions": { "KHR_texture_basisu": { "source": 0 } } }]);
    writer.json["extensionsRequired"] = json!(["KHR_texture_basisu"]);
    let path = folder.path().join("a.glb");
    std::fs::write(&path, writer.glb()).unwrap();
    let scene = open(&path).unwrap();
    assert!(!scene.warnings.iter().any(|warning| warning.contains("texture")), "{:?}", scene.warnings);
    let image = folder.path().join("a.ktx2");
    std::fs::write(&image, uastc()).unwrap();
    let (picture, _) = read_picture_within(&image, &Limits::USUAL).unwrap();
    assert_eq!((picture.width, picture.height), (4, 4));
    assert!((0..16).all(|i| picture.linear(i).abs_diff_eq(Vec3::X, 1e-3)), "{}", picture.linear(0));
    // Whatever is changed, nothing panics.
    for at in 12..uastc().len() {
        for byte in [0, 1, 0x7f, 0xff] {
            let mut bytes = uastc();
            bytes[at] = byte;
            std::fs::write(&image, &bytes).unwrap();
            let _ = read_picture_within(&image, &Limits::USUAL);
        }
    }
    // Nor where parts of the file wrap around or overlap.
    for at in (44..104).step_by(4) {
        for first in [1, 12, 150, 0x7fff_ffff, u32::MAX - 7, u32::MAX] {
            for second in [0, 1, 20, 0x8000_0000, u32::MAX] {
                let mut bytes = uastc();
                bytes[at..at + 4].copy_from_slice(&first.to_le_bytes());
                bytes[at + 4..at + 8].copy_from_slice(&second.to_le_bytes());
                std::fs::write(&image, &bytes).unwrap();
                let _ = read_picture_within(&image, &Limits::USUAL);
            }
        }
    }
    assert_eq!(saved(&scene, folder.path()).content_fingerprint(), scene.content_fingerprint());
}

/// An exporter reserved them and never filled them.
#[test]
fn vertex_colours_of_zeros_alone_are_left_out() {
    let mut writer = two_squares();
    let colors = writer.floats("VEC4", &[0.0; 16]);
    writer.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(colors);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    std::fs::write(&path, writer.glb()).unwrap();
    let scene = open(&path).unwrap();
    assert!(scene.warnings.iter().any(|warning| warning.contains("COLOR_0 is left out")), "{:?}", scene.warnings);
    assert_eq!(n_triangles(&scene), 4);
}

/// A few bytes refer to the same data very often.
#[test]
fn shared_data_is_counted_before_it_is_built() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    let refused = |writer: &Writer| {
        std::fs::write(&path, writer.glb()).unwrap();
        let start = std::time::Instant::now();
        let error = open(&path).err().unwrap_or_default();
        assert!(start.elapsed().as_secs() < 20, "{:?}", start.elapsed());
        error
    };
    // Meshes that differ only in their names.
    let mut writer = Writer::default();
    let positions = writer.accessor(json!({ "componentType": 5126, "count": 1 << 20, "type": "VEC3" }));
    for _ in 0..200 {
        writer.mesh(json!({ "attributes": { "POSITION": positions } }));
    }
    let error = refused(&writer);
    assert!(error.contains("vertices and indices together"), "{error}");
    // Nodes with a million equal instances each.
    let mut writer = Writer::default();
    quad(&mut writer);
    let moves = writer.accessor(json!({ "componentType": 5126, "count": 1 << 20, "type": "VEC3" }));
    let instances = json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": moves } } });
    let node = json!({ "mesh": 0, "extensions": instances });
    writer.json["nodes"] = json!(vec![node; 500]);
    writer.json["scenes"] = json!([{ "nodes": (0..500).collect::<Vec<_>>() }]);
    let error = refused(&writer);
    assert!(error.contains("more than a file of this size can have"), "{error}");
}

/// A KTX2 file of 4 x 4 red pixels: one block of UASTC in its mode of a single colour.
fn uastc() -> Vec<u8> {
    let words = |list: &[u32]| list.iter().flat_map(|word| word.to_le_bytes()).collect::<Vec<u8>>();
    let (descriptor, data) = (104_u32, 160_u32);
    let mut bytes = b"\xabKTX 20\xbb\r\n\x1a\n".to_vec();
    // Format, size of a type, width, height, depth, layers, faces, levels, supercompression.
    bytes.extend(words(&[0, 1, 4, 4, 0, 0, 1, 1, 0]));
    bytes.extend(words(&[descriptor, 44, 0, 0, 0, 0, 0, 0]));
    bytes.extend(words(&[data, 0, 16, 0, 16, 0]));
    // The descriptor: UASTC (166), Rec. 709, sRGB, blocks of 4 x 4 with 16 bytes, one sample of RGB.
    bytes.extend(words(&[44, 0, 2 | 40 << 16, 166 | 1 << 8 | 2 << 16, 3 | 3 << 8, 16, 0, 127 << 16, 0, 0, u32::MAX]));
    bytes.resize(data as usize, 0);
    // Five bits of the mode, then red, green, blue and alpha.
    let block: u128 = 0b10111 | 0xff << 5 | 0xff << 29;
    bytes.extend(block.to_le_bytes());
    bytes
}
