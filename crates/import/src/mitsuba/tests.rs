//! What the importer shows, or tells, where Mitsuba's rules differ from ours.

use crate::mitsuba::read_scene;
use crate::model::foreign::{ForeignOptions, ForeignScene, LIGHT_SHARE};
use crate::model::projection::LightImages;
use firstlight_files::input_file::{FileKind, InputFile};
use firstlight_format::parts::{MaterialPart, ObjectPart, TransformPart};
use firstlight_format::placement::Placement;
use firstlight_format::scene_file::SceneFile;
use firstlight_format::sources::{EnvironmentSource, TextureSource};
use firstlight_format::value::{ColorValue, Rgb, ScalarValue};
use firstlight_render::{Channel, Encoding, ImageTexture, Material};
use glam::{DVec3, Vec3};
use std::fmt::Write;
use std::sync::Arc;

const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
    element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

/// The scene of these elements, with images and meshes beside it; a scene file can say it.
fn read(version: &str, body: &str) -> ForeignScene {
    let folder = tempfile::tempdir().unwrap();
    let save = |name: &str, color: [u8; 4]| {
        image::RgbaImage::from_pixel(2, 2, image::Rgba(color)).save(folder.path().join(name)).unwrap();
    };
    save("red.png", [255, 0, 0, 255]);
    save("grey.png", [100, 100, 100, 255]);
    save("n.png", [128, 128, 255, 255]);
    save("m.png", [100, 128, 250, 255]);
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("bare.ply", PLY);
    let normals = "property float nx\nproperty float ny\nproperty float nz\nelement face";
    write("full.ply", &PLY.replace("element face", normals).replace(" 0\n", " 0 0 0 1\n"));
    write("cut.ply", &PLY.replace("face 1", "face 2"));
    let backwards = PLY.replace("element face", normals).replace(" 0\n", " 0 0 0 -1\n");
    write("turned.ply", &backwards);
    write("turned.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 -1\nf 1//1 2//1 3//1\n");
    write("bare.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    write("nan.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 nan 0\nf 1 2 3\nf 1 2 4\n");
    let path = folder.path().join("a.xml");
    std::fs::write(&path, format!("<scene version=\"{version}\">\n{body}\n</scene>\n")).unwrap();
    let light_images = LightImages::new(|path| {
        let bytes = InputFile::open(path, FileKind::Image).and_then(InputFile::bytes).ok()?;
        let image = image::load_from_memory(&bytes).ok()?.into_rgb32f();
        let texels = image.pixels().map(|pixel| Vec3::from(pixel.0)).collect();
        Some(ImageTexture::from_linear(image.width(), image.height(), texels))
    });
    let options = ForeignOptions { allow_outside: false, defines: Vec::new(), light_images, meshes: Arc::default() };
    let scene = read_scene(&path, &options).unwrap_or_else(|error| panic!("{error}"));
    SceneFile::parse(&scene.file.to_ron(), "a.ron").unwrap_or_else(|error| panic!("{error}"));
    scene
}

/// What is told of a scene, without the lack of a camera.
fn told(scene: &ForeignScene) -> Vec<String> {
    scene.warnings.iter().map(|it| it.to_string()).filter(|it| !it.contains("has no sensor")).collect()
}

/// Whether exactly one thing is told, which has these words.
fn tells_only(scene: &ForeignScene, words: &[&str]) {
    let told = told(scene);
    assert!(told.len() == 1 && words.iter().all(|word| told[0].contains(word)), "{told:#?}");
}

fn named<'a>(scene: &'a ForeignScene, name: &str) -> &'a MaterialPart {
    scene.file.materials.get(name).unwrap()
}

/// The material of an object.
fn part(scene: &ForeignScene, object: usize) -> &MaterialPart {
    named(scene, scene.file.objects[object].material().unwrap())
}

/// A rectangle with this surface.
fn surface(inside: &str) -> ForeignScene {
    read("3.0.0", &format!("<shape type=\"rectangle\">{inside}</shape>"))
}

fn image(name: &str, file: &str, more: &str) -> String {
    format!("<texture type=\"bitmap\" name=\"{name}\"><string name=\"filename\" value=\"{file}\"/>{more}</texture>")
}

fn normal_map(file: &str, inside: &str) -> String {
    format!(
        "<bsdf type=\"normalmap\">{}{inside}</bsdf>",
        image("normalmap", file, "<boolean name=\"raw\" value=\"true\"/>")
    )
}

const DIFFUSE: &str = "<bsdf type=\"diffuse\"/>";

#[test]
fn a_colour_image_as_a_number_is_its_green_channel_and_told() {
    let channel = |scene: &ForeignScene| match scene.file.textures.0.values().next() {
        Some(TextureSource::Image { channel, .. }) => *channel,
        other => panic!("{other:?}"),
    };
    let masked = |file: &str| surface(&format!("<bsdf type=\"mask\">{}{DIFFUSE}</bsdf>", image("opacity", file, "")));
    let coloured = masked("red.png");
    tells_only(&coloured, &["`bitmap`", "luminance"]);
    assert_eq!(channel(&coloured), Some(Channel::G));
    let grey = masked("grey.png");
    assert_eq!((channel(&grey), told(&grey)), (None, Vec::new()));
    // As a colour, it is one.
    let colour = surface(&format!("<bsdf type=\"diffuse\">{}</bsdf>", image("reflectance", "red.png", "")));
    assert_eq!((channel(&colour), told(&colour)), (None, Vec::new()));
    let relief = image("heights", "red.png", "");
    let bumpy = surface(&format!("<bsdf type=\"bumpmap\">{relief}{DIFFUSE}</bsdf>"));
    tells_only(&bumpy, &["luminance"]);
    let is_green = |it: &TextureSource| matches!(it, TextureSource::Image { channel: Some(Channel::G), .. });
    assert!(bumpy.file.textures.0.values().all(is_green));
}

#[test]
fn gamma_and_channel_of_old_images_count() {
    let read_as = |more: &str| {
        let image = image("opacity", "red.png", more);
        let scene =
            read("0.6.0", &format!("<shape type=\"sphere\"><bsdf type=\"mask\">{image}{DIFFUSE}</bsdf></shape>"));
        match scene.file.textures.0.values().next() {
            Some(&TextureSource::Image { channel, encoding, .. }) => (channel, encoding, told(&scene).len()),
            other => panic!("{other:?}"),
        }
    };
    let gamma =
        |value: &str| format!("<float name=\"gamma\" value=\"{value}\"/><string name=\"channel\" value=\"a\"/>");
    assert_eq!(read_as(&gamma("1.0")), (Some(Channel::A), Encoding::Linear, 0));
    assert_eq!(read_as(&gamma("-1")), (Some(Channel::A), Encoding::Auto, 0));
    assert_eq!(read_as(&gamma("2.2")), (Some(Channel::A), Encoding::Auto, 1));
    assert_eq!(read_as("<string name=\"channel\" value=\"x\"/>").2, 2);
    assert_eq!(read_as("<string name=\"channel\" value=\"a\"/><string name=\"wrapMode\" value=\"zero\"/>").2, 1);
}

#[test]
fn the_back_of_a_twosided_light_reflects() {
    let light = "<emitter type=\"area\"><rgb name=\"radiance\" value=\"2\"/></emitter>";
    let scene = surface(&format!("<bsdf type=\"twosided\">{DIFFUSE}</bsdf>{light}"));
    let Material::Blend { a, b, by_side: true, .. } = part(&scene, 0) else { panic!("{:?}", part(&scene, 0)) };
    let Material::Principled { emission, .. } = named(&scene, a) else { panic!("{:?}", named(&scene, a)) };
    assert_eq!((emission, told(&scene)), (&ColorValue::grey(2.0), Vec::new()));
    assert_eq!(named(&scene, b), &Material::Diffuse { albedo: ColorValue::grey(0.5) });
    // What `principled` cannot say is a share of a brighter light.
    let scene = surface(&format!("<bsdf type=\"twosided\"><bsdf type=\"plastic\"/></bsdf>{light}"));
    let Material::Blend { weight, a, b, by_side: false, .. } = part(&scene, 0) else { panic!("{:?}", part(&scene, 0)) };
    assert!(matches!(named(&scene, a), Material::Plastic { .. }) && told(&scene).is_empty());
    assert_eq!(*weight, ScalarValue::Number(LIGHT_SHARE));
    assert_eq!(named(&scene, b), &Material::Emissive { radiance: ColorValue::grey(2.0 / LIGHT_SHARE) });
}

#[test]
fn maps_of_normals_that_cannot_be_shown_are_told() {
    let map_of = |scene: &ForeignScene| match part(scene, 0) {
        Material::Blend { normal_map: ColorValue::Texture(name), .. } => match scene.file.textures.get(name) {
            Some(TextureSource::Image { file, .. }) => file.clone(),
            other => panic!("{other:?}"),
        },
        other => panic!("{other:?}"),
    };
    let (n, m) = (normal_map("n.png", DIFFUSE), normal_map("m.png", DIFFUSE));
    let scene = surface(&format!("<bsdf type=\"twosided\">{n}{m}</bsdf>"));
    tells_only(&scene, &["`twosided`", "differ between two sides"]);
    assert_eq!(map_of(&scene), "n.png");
    let scene = surface(&format!("<bsdf type=\"twosided\">{}</bsdf>", normal_map("m.png", &n)));
    tells_only(&scene, &["`normalmap`", "in another one"]);
    assert_eq!(map_of(&scene), "m.png");
    // Two parts with one map.
    let named = |body: &str| {
        read("3.0.0", &format!("{}{body}", image("map", "n.png", "").replace(" name=\"map\"", " id=\"map\"")))
    };
    let by_name =
        |inside: &str| format!("<bsdf type=\"normalmap\"><ref name=\"normalmap\" id=\"map\"/>{inside}</bsdf>");
    let (a, b) = (by_name(DIFFUSE), by_name("<bsdf type=\"plastic\"/>"));
    let scene = named(&format!("<shape type=\"sphere\"><bsdf type=\"blendbsdf\">{a}{b}</bsdf></shape>"));
    assert_eq!((map_of(&scene), told(&scene)), ("n.png".to_owned(), Vec::new()));
}

#[test]
fn masks_multiply_and_show_the_black_back_of_closed_shapes() {
    let mask = |opacity: &str, inside: &str| format!("<bsdf type=\"mask\">{opacity}{inside}</bsdf>");
    let half = "<float name=\"opacity\" value=\"0.5\"/>";
    let shapes = |bsdf: &str| format!("<shape type=\"sphere\">{bsdf}</shape><shape type=\"cube\">{bsdf}</shape>");
    let scene = read("3.0.0", &shapes(&mask(half, &mask(half, DIFFUSE))));
    for object in 0..2 {
        let Material::Blend { opacity, b, by_side: true, .. } = part(&scene, object) else { panic!() };
        assert_eq!(*opacity, ScalarValue::Number(0.25));
        assert_eq!(named(&scene, b), &Material::Diffuse { albedo: ColorValue::grey(0.0) });
    }
    let textured = image("opacity", "grey.png", "");
    let scene = surface(&mask(half, &mask(&textured, DIFFUSE)));
    let Material::Blend { opacity: ScalarValue::Texture(name), .. } = part(&scene, 0) else { panic!() };
    let Some(TextureSource::Image { tint, .. }) = scene.file.textures.get(name) else { panic!() };
    assert_eq!((*tint, told(&scene)), (Rgb(Vec3::splat(0.5)), Vec::new()));
    tells_only(&surface(&mask(&textured, &mask(&textured, DIFFUSE))), &["`mask`", "in another one"]);
}

#[test]
fn a_mirrored_mesh_without_normals_is_turned_inside_out() {
    let fronts = |plugin: &str, file: &str, more: &str| {
        let shape = |x: &str| {
            format!(
                "<shape type=\"{plugin}\"><string name=\"filename\" value=\"{file}\"/>{more}\
                 <transform name=\"to_world\"><scale x=\"{x}\"/></transform></shape>"
            )
        };
        let scene = read("3.0.0", &(shape("1") + &shape("-1")));
        let mut shapes: Vec<u32> = scene.parts.keys().copied().collect();
        shapes.sort_unstable();
        shapes.iter().map(|shape| scene.parts[shape].doubled_area_normal(0).z.signum()).collect::<Vec<f64>>()
    };
    assert_eq!(fronts("ply", "bare.ply", ""), [1.0, -1.0]);
    assert_eq!(fronts("obj", "bare.obj", ""), [1.0, -1.0]);
    // Its normals say where the front is: one mesh.
    assert_eq!(fronts("ply", "full.ply", ""), [1.0]);
    assert_eq!(fronts("ply", "full.ply", "<boolean name=\"face_normals\" value=\"true\"/>"), [1.0, -1.0]);
    assert_eq!(fronts("cube", "bare.ply", "").len(), 1);
}

#[test]
fn broken_meshes_are_told() {
    for (plugin, file, word) in
        [("ply", "cut.ply", "what comes before is shown"), ("obj", "nan.obj", "not three finite")]
    {
        let shape = format!("<shape type=\"{plugin}\"><string name=\"filename\" value=\"{file}\"/></shape>");
        let scene = read("3.0.0", &shape);
        tells_only(&scene, &[file, word]);
        assert_eq!(scene.parts.len(), 1);
    }
}

#[test]
fn a_blend_of_many_lobes_opens_on_an_open_shape() {
    let mut blend = DIFFUSE.to_owned();
    for weight in 0..7 {
        let mut outer = format!("<bsdf type=\"blendbsdf\"><float name=\"weight\" value=\"0.{weight}\"/>");
        write!(outer, "{DIFFUSE}{blend}</bsdf>").unwrap();
        blend = outer;
    }
    tells_only(&surface(&blend), &["the black back of `blendbsdf", "8 lobes"]);
}

#[test]
fn a_rough_conductor_without_a_material_reflects_everything() {
    let Material::Blend { a, .. } = part(&surface("<bsdf type=\"roughconductor\"/>"), 0).clone() else { panic!() };
    let scene = surface("<bsdf type=\"roughconductor\"/>");
    let Material::Conductor { eta, k, .. } = named(&scene, &a) else { panic!() };
    assert_eq!((eta.0, k.0), (Vec3::ZERO, Vec3::ONE));
}

#[test]
fn old_black_bodies_open_and_environments_and_turbidities_are_told() {
    let body = "<emitter type=\"constant\"><blackbody name=\"radiance\" temperature=\"3000K\"/></emitter><shape type=\"sphere\"/>";
    let scene = read("0.6.0", body);
    let EnvironmentSource::Constant(Rgb(light)) = scene.file.environment else { panic!() };
    assert!(light.x > light.y && light.y > light.z && told(&scene).is_empty(), "{light}");
    let twice =
        read("3.0.0", "<emitter type=\"constant\"/><emitter type=\"constant\" id=\"b\"/><shape type=\"sphere\"/>");
    tells_only(&twice, &["`b`", "second environment"]);
    let hazy = "<emitter type=\"sunsky\"><float name=\"turbidity\" value=\"20\"/></emitter><shape type=\"sphere\"/>";
    tells_only(&read("3.0.0", hazy), &["`sunsky`", "turbidity"]);
}

#[test]
fn a_sphere_with_highlights_of_a_direction_has_the_poles_of_mitsuba() {
    let turned = |widths: &str| {
        let bsdf = format!("<bsdf type=\"twosided\"><bsdf type=\"roughconductor\">{widths}</bsdf></bsdf>");
        let scene = read("3.0.0", &format!("<shape type=\"sphere\">{bsdf}</shape>"));
        let ObjectPart::Sphere { transform, .. } = &scene.file.objects[0] else { panic!() };
        *transform != TransformPart::default()
    };
    let float = |name: &str, value: f32| format!("<float name=\"{name}\" value=\"{value}\"/>");
    assert!(turned(&(float("alpha_u", 0.05) + &float("alpha_v", 0.4))));
    assert!(!turned(&float("alpha", 0.2)));
}

#[test]
fn a_mirrored_sphere_is_told() {
    let sphere = |inside: &str| {
        let to_world = "<transform name=\"to_world\"><scale x=\"-1\" y=\"1\" z=\"1\"/></transform>";
        read("3.0.0", &format!("<shape type=\"sphere\">{to_world}{inside}</shape>"))
    };
    tells_only(&sphere(""), &["normals point inwards"]);
    assert_eq!(told(&sphere("<boolean name=\"flip_normals\" value=\"true\"/>")), Vec::<String>::new());
}

#[test]
fn a_dome_that_is_a_light_shines_inwards() {
    let light = "<emitter type=\"area\"><rgb name=\"radiance\" value=\"1\"/></emitter>";
    let flipped = "<boolean name=\"flip_normals\" value=\"true\"/><float name=\"radius\" value=\"9\"/>";
    let scene = read("3.0.0", &format!("<shape type=\"sphere\">{flipped}{light}</shape>"));
    assert_eq!(told(&scene), Vec::<String>::new());
    let [(_, mesh)] = &scene.parts.iter().collect::<Vec<_>>()[..] else { panic!("a mesh") };
    let volume = mesh.signed_volume() / (4.0 / 3.0 * std::f64::consts::PI);
    assert!((volume + 1.0).abs() < 0.003, "its front is inside: {volume}");
    assert!(matches!(part(&scene, 0), MaterialPart::Emissive { .. }));
}

/// Version 0.x has no surface there; version 3 has a grey one.
#[test]
fn the_border_of_a_medium_is_no_surface_in_old_scenes() {
    let medium = "<medium type=\"homogeneous\" name=\"interior\"/>";
    let body = format!("<shape type=\"sphere\">{medium}</shape><shape type=\"sphere\"/>");
    let scenes = ["0.5.0", "3.0.0"].map(|version| read(version, &body));
    assert_eq!(scenes.each_ref().map(|scene| scene.file.objects.len()), [1, 2]);
    // That of a scene in which nothing else is, too.
    tells_only(&scenes[0], &["media are not modelled", "left out"]);
}

#[test]
fn glass_has_its_colours_and_unknown_variants_are_what_they_begin_with() {
    let colour = |name: &str| format!("<rgb name=\"{name}\" value=\"0.75 0.5 0.25\"/>");
    let read_as = |bsdf: String| read("0.6.0", &format!("<shape type=\"sphere\">{bsdf}</shape>"));
    let expected = ColorValue::Rgb(Vec3::new(0.75, 0.5, 0.25));
    let alpha = "<float name=\"alpha\" value=\"0.25\"/>";
    for (plugin, name, width) in [
        ("dielectric", "specularTransmittance", 0.0),
        ("roughdielectric", "specularTransmittance", 0.5),
        ("dielectric", "specularReflectance", 0.0),
    ] {
        let alpha = if width > 0.0 { alpha } else { "" };
        let scene = read_as(format!("<bsdf type=\"{plugin}\">{}{alpha}</bsdf>", colour(name)));
        assert_eq!(told(&scene), Vec::<String>::new());
        let Material::Principled { base_color, transmission, roughness, ior, specular_color, .. } = part(&scene, 0)
        else {
            panic!("{:?}", part(&scene, 0))
        };
        let white = ColorValue::grey(1.0);
        let [through, reflected] = [("specularTransmittance", base_color), ("specularReflectance", specular_color)]
            .map(|(of, color)| *color == if of == name { expected.clone() } else { white.clone() });
        assert!(through && reflected, "{base_color:?} {specular_color:?}");
        assert_eq!([transmission, roughness], [&1.0.into(), &width.into()]);
        assert!((ior - 1.5046).abs() < 1e-3);
    }
    let variant = read_as(format!("<bsdf type=\"roughconductorGGX\">{alpha}</bsdf>"));
    tells_only(&variant, &["roughconductorggx", "it is a roughconductor"]);
    let usual = |more: &str| {
        let scene = read_as(format!("<bsdf type=\"roughconductor\">{alpha}{more}</bsdf>"));
        assert_eq!(told(&scene), Vec::<String>::new());
        part(&scene, 0).clone()
    };
    assert_eq!(part(&variant, 0), &usual(""));
    let gold = "<rgb name=\"R0\" value=\"0.9 0.6 0.25\"/>";
    let scene = read_as(format!("<bsdf type=\"roughconductorGGX\">{alpha}{gold}</bsdf>"));
    let Material::Metal { reflectance: ColorValue::Rgb(color), .. } = part(&scene, 0) else { panic!() };
    assert_eq!(*color, Vec3::new(0.9, 0.6, 0.25));
    let (in_air, in_water) =
        (usual("<float name=\"extEta\" value=\"1\"/>"), usual("<float name=\"extEta\" value=\"2\"/>"));
    let [Material::Conductor { k, .. }, Material::Conductor { k: half, .. }] = [&in_air, &in_water] else { panic!() };
    assert_eq!((k.0, &in_air), (2.0 * half.0, &usual("")));
}

#[test]
fn a_transform_without_a_name_is_that_of_the_shape() {
    let scene = read("2.0.0", "<shape type=\"sphere\"><transform><translate x=\"2\"/></transform></shape>");
    tells_only(&scene, &["`<transform>` without a name: it is `to_world`"]);
    assert!(matches!(scene.file.objects[0], ObjectPart::Sphere { center, .. } if center.x.abs() == 2.0));
}

#[test]
fn old_colours_and_animations_open() {
    let spectrum = |value: &str| format!("<spectrum name=\"reflectance\" value=\"{value}\"/>");
    let body = |value: &str| {
        format!(
            "<shape type=\"sphere\"><animation name=\"toWorld\"><transform time=\"0\"><translate x=\"2\"/></transform>\
             <transform time=\"1\"><translate x=\"5\"/></transform></animation>\
             <bsdf type=\"diffuse\">{}</bsdf></shape>",
            spectrum(value)
        )
    };
    for value in ["0.25 0.5 0.75", "0.25, 0.5, 0.75"] {
        let scene = read("0.6.0", &body(value));
        tells_only(&scene, &["`<animation>`", "where it begins"]);
        let ObjectPart::Sphere { center, transform, .. } = &scene.file.objects[0] else { panic!() };
        let at = Placement::from_part(transform).affine().transform_point3(*center);
        assert_eq!(at, DVec3::new(2.0, 0.0, 0.0));
        let Material::Diffuse { albedo } = part(&scene, 0) else { panic!() };
        assert_eq!(*albedo, ColorValue::Rgb(Vec3::new(0.25, 0.5, 0.75)));
    }
}

#[test]
fn what_the_parser_of_mitsuba_passes_over_is_no_error() {
    let body = "<!-- a -- b --->\n<shape type=\"sphere\" id=\"a & <b>\"/>\n<?foo?> text & more <![CDATA[<]]>";
    let scene = read("3.0.0", body);
    assert_eq!((scene.file.objects.len(), told(&scene)), (1, Vec::new()));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.xml");
    let options = || {
        let light_images = LightImages::new(|_| None);
        ForeignOptions { allow_outside: false, defines: Vec::new(), light_images, meshes: Arc::default() }
    };
    let text = "\n<?xml version=\"1.0\" encoding=\"ISO-8859-1\"?><!DOCTYPE scene>\n<scene version=\"3.0.0\">\n\
                <!-- ä --> <shape type=\"cone\"/>\n</scene> end\0";
    let utf16 = std::iter::once(0xfeff).chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect();
    for bytes in [text.as_bytes().to_vec(), text.chars().map(|c| c as u8).collect(), utf16] {
        std::fs::write(&path, bytes).unwrap();
        tells_only(&read_scene(&path, &options()).unwrap(), &["a.xml:4:12: ", "cone"]);
    }
    std::fs::write(&path, "<!DOCTYPE scene [<!ENTITY a \"b\">]>\n<scene version=\"3.0.0\"/>").unwrap();
    assert!(read_scene(&path, &options()).unwrap_err().to_string().contains("DTD"));
    std::fs::write(&path, "<scene version=\"3.0.0\" version=\"3\"/>").unwrap();
    let error = read_scene(&path, &options()).unwrap_err().to_string();
    assert!(error.contains("a.xml:1:24: not valid XML: attribute 'version' is already defined"), "{error}");
}

#[test]
fn the_front_of_a_mesh_is_where_the_normals_of_its_file_point() {
    let front = |file: &str, more: &str| {
        let scene = read(
            "3.0.0",
            &format!(
                "<shape type=\"{}\"><string name=\"filename\" value=\"{file}\"/>{more}</shape>",
                file.split_once('.').unwrap().1
            ),
        );
        let mesh = &scene.parts[&0];
        (mesh.doubled_area_normal(0).z.signum(), mesh.normals.first().map(|normal| normal.z))
    };
    let flat = "<boolean name=\"face_normals\" value=\"true\"/>";
    let flipped = "<boolean name=\"flip_normals\" value=\"true\"/>";
    for file in ["turned.obj", "turned.ply"] {
        assert_eq!(front(file, ""), (-1.0, Some(-1.0)), "{file}");
        assert_eq!(front(file, flipped), (1.0, Some(1.0)), "{file}");
        assert_eq!(front(file, flat), (1.0, None), "{file}");
    }
}

#[test]
fn a_scene_that_is_mirrored_as_a_whole_has_its_own_sides() {
    let scene = |sensor: &str, envmap: &str, more: &str| {
        let mirrored = |by: &str| format!("<transform name=\"to_world\"><scale x=\"{by}\"/></transform>");
        let emitter = format!("<string name=\"filename\" value=\"red.png\"/>{}", mirrored(envmap));
        read(
            "3.0.0",
            &format!(
                "<sensor type=\"perspective\">{}</sensor><emitter type=\"envmap\">{emitter}</emitter>\
                 <shape type=\"sphere\"><point name=\"center\" x=\"2\" y=\"0\" z=\"0\"/></shape>{more}",
                mirrored(sensor)
            ),
        )
    };
    for (sensor, envmap, x, is_mirrored) in
        [("1", "1", 2.0, false), ("1", "-1", 2.0, true), ("-1", "1", -2.0, true), ("-1", "-1", -2.0, false)]
    {
        let scene = scene(sensor, envmap, "");
        assert_eq!(told(&scene), Vec::<String>::new());
        let ObjectPart::Sphere { center, transform, .. } = &scene.file.objects[0] else { panic!() };
        assert_eq!(Placement::from_part(transform).affine().transform_point3(*center).x, x, "{sensor} {envmap}");
        let EnvironmentSource::Image { axes, .. } = &scene.file.environment else { panic!() };
        assert_eq!(axes.is_some(), is_mirrored, "{sensor} {envmap}");
        assert!(axes.is_none_or(|rows| rows == [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]));
    }
    // A textured rectangle keeps its texture: a mesh, where a quad from its other side would have it mirrored.
    let bsdf =
        format!("<bsdf type=\"twosided\"><bsdf type=\"diffuse\">{}</bsdf></bsdf>", image("reflectance", "n.png", ""));
    for (sensor, is_mesh) in [("1", false), ("-1", true)] {
        let scene = scene(sensor, "1", &format!("<shape type=\"rectangle\">{bsdf}</shape>"));
        assert_eq!(told(&scene), Vec::<String>::new());
        assert_eq!(matches!(scene.file.objects[1], ObjectPart::Mesh { .. }), is_mesh);
    }
}

#[test]
fn a_map_of_normals_without_its_texture_has_no_effect_and_is_told() {
    for plugin in ["bumpmap", "normalmap"] {
        let scene = surface(&format!("<bsdf type=\"twosided\"><bsdf type=\"{plugin}\">{DIFFUSE}</bsdf></bsdf>"));
        tells_only(&scene, &[plugin, "without a nested texture"]);
        assert_eq!(part(&scene, 0), &Material::Diffuse { albedo: ColorValue::grey(0.5) });
    }
    let any = image("other", "n.png", "");
    let scene =
        read("0.6.0", &format!("<shape type=\"sphere\"><bsdf type=\"normalmap\">{any}{DIFFUSE}</bsdf></shape>"));
    assert!(told(&scene).is_empty() && !scene.file.textures.0.is_empty());
}

/// The parts and the weight of the second one of a blend.
fn blended(scene: &ForeignScene) -> (&MaterialPart, &MaterialPart, f32) {
    let Material::Blend { weight: ScalarValue::Number(weight), a, b, .. } = part(scene, 0) else {
        panic!("{:?}", part(scene, 0))
    };
    (named(scene, a), named(scene, b), *weight)
}

#[test]
fn highlights_of_old_versions_are_added_to_diffuse_surfaces() {
    let of = |plugin: &str, diffuse: &str, specular: &str, rest: &str| {
        let colors = format!(
            "<rgb name=\"diffuseReflectance\" value=\"{diffuse}\"/>\
             <rgb name=\"specularReflectance\" value=\"{specular}\"/>{rest}"
        );
        read("0.6.0", &format!("<shape type=\"sphere\"><bsdf type=\"{plugin}\">{colors}</bsdf></shape>"))
    };
    let exponent = "<float name=\"exponent\" value=\"48\"/>";
    let widths = "<float name=\"alphaU\" value=\"0.1\"/><float name=\"alphaV\" value=\"0.3\"/>";
    for (scene, width, along_v) in [
        (of("phong", "0.6 0.3 0", "0.1 0.1 0.2", exponent), 0.1, 0.0),
        (of("ward", "0.6 0.3 0", "0.1 0.1 0.2", widths), 0.1, 0.3),
        // More than there is: two thirds of each.
        (of("phong", "0.9 0.45 0", "0.6 0.6 0.6", exponent), 0.1, 0.0),
    ] {
        assert_eq!(told(&scene), Vec::<String>::new());
        let (base, highlight, weight) = blended(&scene);
        let Material::Diffuse { albedo: ColorValue::Rgb(albedo) } = base else { panic!("{base:?}") };
        let Material::Conductor { alpha, alpha_v, eta, reflectance: ColorValue::Rgb(reflectance), .. } = highlight
        else {
            panic!("{highlight:?}")
        };
        let is_near = |a: Vec3, b: Vec3| a.abs_diff_eq(b, 1e-6);
        assert!(is_near((1.0 - weight) * *albedo, Vec3::new(0.6, 0.3, 0.0)), "{albedo}");
        let specular = weight * *reflectance;
        assert!([Vec3::new(0.1, 0.1, 0.2), Vec3::splat(0.4)].iter().any(|it| is_near(specular, *it)));
        assert!(albedo.max_element() <= 1.0 && reflectance.max_element() <= 1.0 && *eta == Rgb(Vec3::ZERO));
        assert_eq!((alpha, alpha_v), (&ScalarValue::Number(width), &ScalarValue::Number(along_v)));
    }
    let plain = of("phong", "0.6 0.3 0", "0 0 0", exponent);
    assert!(matches!(part(&plain, 0), Material::Diffuse { .. }));
    let mirror = of("ward", "0 0 0", "0.9 0.9 0.9", widths);
    assert!(matches!(part(&mirror, 0), Material::Conductor { .. }));
    // The means of both are those of the file, whatever the image.
    let textured = image("diffuseReflectance", "grey.png", "");
    let specular = "<rgb name=\"specularReflectance\" value=\"0.25 0.25 0.25\"/>";
    let bsdf = format!("<bsdf type=\"phong\">{textured}{specular}</bsdf>");
    let scene = read("0.6.0", &format!("<shape type=\"sphere\">{bsdf}</shape>"));
    let (Material::Diffuse { albedo: ColorValue::Texture(name) }, _, weight) = blended(&scene) else { panic!() };
    let TextureSource::Image { tint, .. } = scene.file.textures.get(name).unwrap() else { panic!("{name}") };
    assert_eq!((weight, tint.0), (0.25, Vec3::splat(1.0 / 0.75)));
}

#[test]
fn coatings_lie_on_diffuse_surfaces_and_metals() {
    let of = |plugin: &str, inner: &str| {
        let layer = "<float name=\"intIOR\" value=\"1.5\"/><float name=\"extIOR\" value=\"1\"/>\
             <float name=\"thickness\" value=\"2\"/><rgb name=\"sigmaA\" value=\"0 0.1 0.2\"/>\
             <float name=\"alpha\" value=\"0.04\"/>";
        read("0.6.0", &format!("<shape type=\"sphere\"><bsdf type=\"{plugin}\">{layer}{inner}</bsdf></shape>"))
    };
    let diffuse = "<bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"0.5 0.5 0.5\"/></bsdf>";
    let scene = of("roughcoating", diffuse);
    let Material::Plastic { diffuse, alpha, ior, nonlinear, .. } = part(&scene, 0) else { panic!() };
    // 0.596 of diffuse light is reflected inwards at an index of 1.5.
    let passed = Vec3::new(0.0, -0.4, -0.8).exp();
    let ColorValue::Rgb(diffuse) = diffuse else { panic!("{diffuse:?}") };
    assert!(diffuse.abs_diff_eq(0.5 * 0.404 * passed, 0.002), "{diffuse}");
    assert_eq!((alpha, *ior, *nonlinear), (&ScalarValue::Number(0.04), 1.5, false));
    let metal = "<bsdf type=\"roughconductor\"><float name=\"alpha\" value=\"0.06\"/>\
         <float name=\"eta\" value=\"0.2\"/><float name=\"k\" value=\"3\"/></bsdf>";
    let scene = of("roughcoating", metal);
    let Material::Principled { base_color, metallic, roughness, clearcoat, clearcoat_roughness, .. } = part(&scene, 0)
    else {
        panic!("{:?}", part(&scene, 0))
    };
    let ColorValue::Rgb(color) = base_color else { panic!("{base_color:?}") };
    assert!(color.abs_diff_eq(9.64 / 10.44 * passed, 1e-5), "{color}");
    let number =
        |value: &ScalarValue| if let ScalarValue::Number(number) = value { *number } else { panic!("{value:?}") };
    let numbers = [metallic, roughness, clearcoat, clearcoat_roughness].map(number);
    for (found, wanted) in numbers.into_iter().zip([1.0, 0.3, 1.0, 0.2]) {
        assert!((found - wanted).abs() < 1e-6, "{numbers:?}");
    }
    let glass = of("roughcoating", "<bsdf type=\"dielectric\"/>");
    assert!(matches!(part(&glass, 0), Material::Glass { .. }));
    tells_only(&glass, &["coatings of surfaces other than metals and diffuse ones"]);
}

/// Some write no version, and elements of their own.
#[test]
fn scenes_of_other_renderers_open() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.xml");
    let ball = "<transform name=\"toWorld\"><hide/><translate value=\"1, 2, 3\"/></transform>";
    let text = format!("<scene><mode/>{}</scene>", ["mirror", "glass"].map(|plugin| {
        format!("<shape type=\"sphere\">{ball}<bsdf type=\"{plugin}\"><float name=\"intIOR\" value=\"1.4\"/></bsdf></shape>")
    }).concat());
    std::fs::write(&path, text).unwrap();
    let options = ForeignOptions {
        allow_outside: false,
        defines: Vec::new(),
        light_images: LightImages::new(|_| None),
        meshes: Arc::default(),
    };
    let scene = read_scene(&path, &options).unwrap();
    assert!(matches!(part(&scene, 0), Material::Mirror { .. }), "{:?}", part(&scene, 0));
    assert!(
        matches!(part(&scene, 1), Material::Glass { ior, .. } if (1.39..1.41).contains(ior)),
        "{:?}",
        part(&scene, 1)
    );
    let center = |object: &ObjectPart| match object {
        ObjectPart::Sphere { center, transform, .. } => {
            Placement::from_part(transform).affine().transform_point3(*center)
        }
        _ => DVec3::NAN,
    };
    assert!(scene.file.objects.iter().all(|object| center(object).abs_diff_eq(DVec3::new(1.0, 2.0, 3.0), 1e-9)));
    let told = told(&scene).join("\n");
    assert!(told.contains("`<mode>` is not known") && told.contains("`<hide>` is no part of a transform"), "{told}");
}

/// Names and defaults are those of lajolla.
#[test]
fn bsdfs_of_other_renderers_are_principled() {
    let of = |plugin: &str, rest: &str| {
        let scene = read("0.5.0", &format!("<shape type=\"sphere\"><bsdf type=\"{plugin}\">{rest}</bsdf></shape>"));
        tells_only(&scene, &[plugin, "principled"]);
        let part = part(&scene, 0);
        let Material::Disney { metallic, ior, transmission, flatness, clearcoat_gloss, .. } = part else {
            panic!("{part:?}")
        };
        let number = |value: &ScalarValue| if let ScalarValue::Number(number) = value { *number } else { panic!() };
        [number(metallic), *ior, number(transmission), number(flatness), number(clearcoat_gloss)]
    };
    let given = "<float name=\"specularTransmission\" value=\"0.25\"/><float name=\"subsurface\" value=\"0.75\"/>\
         <float name=\"specular\" value=\"0.5\"/><float name=\"eta\" value=\"1.4\"/>";
    assert_eq!(of("disneybsdf", given), [0.0, 1.4, 0.25, 0.75, 1.0]);
    assert_eq!(of("disneymetal", ""), [1.0, 1.5, 0.0, 0.0, 1.0]);
    assert_eq!(of("disneyglass", ""), [0.0, 1.5, 1.0, 0.0, 1.0]);
    assert_eq!(of("disneydiffuse", ""), [0.0, 1.0, 0.0, 0.0, 1.0]);
}

#[test]
fn distributions_of_any_case_and_of_old_versions_open() {
    let of = |name: &str| {
        let bsdf = format!("<bsdf type=\"roughconductor\"><string name=\"distribution\" value=\"{name}\"/></bsdf>");
        let scene = read("0.6.0", &format!("<shape type=\"sphere\">{bsdf}</shape>"));
        let Material::Conductor { beckmann, .. } = part(&scene, 0) else { panic!("{:?}", part(&scene, 0)) };
        (*beckmann, told(&scene).len())
    };
    assert_eq!([of("GGX"), of("Beckmann"), of("phong"), of("as")], [(false, 0), (true, 0), (true, 1), (true, 1)]);
}

#[test]
fn bsdfs_and_textures_of_old_versions_keep_their_colours() {
    let read_as = |bsdf: &str| read("0.6.0", &format!("<shape type=\"sphere\">{bsdf}</shape>"));
    let colour = |name: &str| format!("<rgb name=\"{name}\" value=\"0.75 0.5 0.25\"/>");
    let expected = ColorValue::Rgb(Vec3::new(0.75, 0.5, 0.25));
    let diffuse = Material::Diffuse { albedo: expected.clone() };
    let alpha = "<float name=\"alpha\" value=\"0.3\"/>";
    let scene = read_as(&format!("<bsdf type=\"roughdiffuse\">{}{alpha}</bsdf>", colour("reflectance")));
    assert_eq!(part(&scene, 0), &diffuse);
    tells_only(&scene, &["roughness", "not modelled"]);
    let inner = format!("<bsdf type=\"diffuse\">{}</bsdf>", colour("reflectance"));
    let scene = read_as(&format!("<bsdf type=\"difftrans\">{}</bsdf>", colour("transmittance")));
    assert_eq!(part(&scene, 0), &Material::Translucent { reflectance: ColorValue::grey(0.0), transmittance: expected });
    let weights = "<string name=\"weights\" value=\"0.25, 0.25, 0.5\"/>";
    let scene = read_as(&format!("<bsdf type=\"mixturebsdf\">{weights}{inner}{inner}{inner}</bsdf>"));
    let Material::Blend { weight, a, .. } = part(&scene, 0) else { panic!("{:?}", part(&scene, 0)) };
    let Material::Blend { weight: inside, .. } = named(&scene, a) else { panic!("{:?}", named(&scene, a)) };
    let half = ScalarValue::Number(0.5);
    assert_eq!((weight, inside, told(&scene)), (&half, &half, Vec::new()));
    // A factor of a texture, which may be negative for heights.
    let scaled = |name: &str, factor: f32| {
        let image = image("inner", "grey.png", "");
        format!("<texture type=\"scale\" name=\"{name}\">{image}<float name=\"scale\" value=\"{factor}\"/></texture>")
    };
    let tints = |bsdf: String, wanted: Option<f32>| -> Vec<f32> {
        let scene = read_as(&bsdf);
        assert_eq!(told(&scene), Vec::<String>::new());
        let tint = |source: &TextureSource| match source {
            TextureSource::Image { relief, tint, .. } if *relief == wanted => Some(tint.0.x),
            _ => None,
        };
        scene.file.textures.0.values().filter_map(tint).collect()
    };
    assert!(tints(format!("<bsdf type=\"diffuse\">{}</bsdf>", scaled("reflectance", 0.25)), None).contains(&0.25));
    let bumpy = format!("<bsdf type=\"bumpmap\">{}{DIFFUSE}</bsdf>", scaled("heights", -2.0));
    assert_eq!(tints(bumpy, Some(-2.0)), [1.0]);
    let scene = read_as(&format!("{inner}</shape><shape type=\"sphere\"><subsurface type=\"dipole\"/>"));
    tells_only(&scene, &["subsurface scattering"]);
}

#[test]
fn a_camera_of_another_kind_is_a_perspective_one_in_its_place() {
    let looks = |plugin: &str, more: &str| {
        let body = format!("<sensor type=\"{plugin}\">{more}</sensor><shape type=\"sphere\"/>");
        let scene = read("3.0.0", &body);
        tells_only(&scene, &[plugin]);
        (scene.file.camera.eye, scene.file.camera.vfov)
    };
    let placed = "<transform name=\"to_world\"><lookat origin=\"1, 2, 9\" target=\"0, 0, 0\" up=\"0, 1, 0\"/></transform>\
                  <string name=\"focal_length\" value=\"long\"/>";
    let (eye, vfov) = looks("realisticlens", placed);
    assert_eq!(eye, DVec3::new(1.0, 2.0, 9.0));
    assert!((30.0..31.0).contains(&vfov), "{vfov}");
    let with_fov = format!("{placed}<float name=\"fov\" value=\"90\"/><string name=\"fov_axis\" value=\"y\"/>");
    assert_eq!(looks("codedperspective", &with_fov).1.round(), 90.0);
    assert_ne!(looks("irradiancemeter", placed).0, DVec3::new(1.0, 2.0, 9.0));
}

#[test]
fn sheets_of_two_parts_tell_colours_above_one_alone() {
    let sheet = |reflectance: f32| {
        surface(&format!(
            "<bsdf type=\"blendbsdf\"><float name=\"weight\" value=\"0.5\"/>\
             <bsdf type=\"twosided\"><bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"{reflectance}\"/></bsdf></bsdf>\
             <bsdf type=\"principledthin\"><float name=\"eta\" value=\"1\"/><float name=\"diff_trans\" value=\"2\"/>\
             <float name=\"roughness\" value=\"0.3\"/><float name=\"anisotropic\" value=\"0.5\"/>\
             <rgb name=\"base_color\" value=\"0.5\"/></bsdf></bsdf>"
        ))
    };
    for (reflectance, kept) in [(1.5, 0.75), (3.0, 1.0)] {
        let scene = sheet(reflectance);
        let transmittance = ColorValue::grey(0.25);
        assert_eq!(*part(&scene, 0), Material::Translucent { reflectance: ColorValue::grey(kept), transmittance });
        match kept < 1.0 {
            true => assert_eq!(told(&scene), Vec::<String>::new()),
            false => tells_only(&scene, &["`reflectance`", "above 1"]),
        }
    }
}

#[test]
fn bsdfs_in_too_many_others_are_grey() {
    let masks = |n: usize| {
        let (begin, end) = ("<bsdf type=\"twosided\">".repeat(n), "</bsdf>".repeat(n));
        surface(&format!("{begin}<bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"0.25\"/></bsdf>{end}"))
    };
    assert_eq!(told(&masks(20)), Vec::<String>::new());
    tells_only(&masks(60), &["BSDFs are nested more than 32 deep"]);
}
