//! What the importer shows, or tells, where pbrt's rules differ from ours.

use crate::model::foreign::{ForeignOptions, ForeignScene, LIGHT_SHARE};
use crate::model::projection::LightImages;
use firstlight_format::parts::{MaterialPart, ObjectPart};
use firstlight_format::placement::Placement;
use firstlight_format::scene_file::SceneFile;
use firstlight_format::sources::TextureSource;
use firstlight_format::value::{ColorValue, ScalarValue};
use firstlight_render::Encoding;
use glam::{DVec3, Vec2, Vec3};
use std::fmt::Write;
use std::sync::Arc;

pub(super) const SQUARE: &str = "Shape \"bilinearmesh\" \"point3 P\" [-1 -1 0 1 -1 0 -1 1 0 1 1 0]\n";
const TRIANGLES: &str =
    "Shape \"trianglemesh\" \"point3 P\" [-1 -1 0 1 -1 0 1 1 0 -1 1 0] \"integer indices\" [0 1 2 0 2 3]\n";
const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
    element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

/// The scene of this world, with images and meshes beside it; a scene file can say it.
fn read(world: &str) -> ForeignScene {
    read_text(&format!("WorldBegin\n{world}"))
}

pub(super) fn read_text(text: &str) -> ForeignScene {
    let folder = tempfile::tempdir().unwrap();
    for name in ["n.png", "m.png"] {
        image::RgbImage::from_pixel(2, 2, image::Rgb([128, 128, 255])).save(folder.path().join(name)).unwrap();
    }
    std::fs::write(folder.path().join("bare.ply"), PLY).unwrap();
    let path = folder.path().join("a.pbrt");
    std::fs::write(&path, text).unwrap();
    let light_images = LightImages::new(|_| None);
    let options = ForeignOptions { allow_outside: false, defines: Vec::new(), light_images, meshes: Arc::default() };
    let scene = super::read(&path, &options).unwrap_or_else(|error| panic!("{error}"));
    SceneFile::parse(&scene.file.to_ron(), "a.ron").unwrap_or_else(|error| panic!("{error}"));
    scene
}

pub(super) fn told(scene: &ForeignScene) -> Vec<String> {
    scene.warnings.iter().map(|it| it.to_string()).collect()
}

/// Whether exactly one thing is told, which has these words.
fn tells_only(scene: &ForeignScene, words: &[&str]) {
    let told = told(scene);
    assert!(told.len() == 1 && words.iter().all(|word| told[0].contains(word)), "{told:#?}");
}

fn named<'a>(scene: &'a ForeignScene, name: &str) -> &'a MaterialPart {
    scene.file.materials.get(name).unwrap()
}

/// The material of the first object.
pub(super) fn part(scene: &ForeignScene) -> &MaterialPart {
    named(scene, scene.file.objects[0].material().unwrap())
}

#[test]
fn a_mixture_has_the_normal_map_of_its_parts() {
    let mixed = |a: &str, b: &str| {
        read(&format!(
            "MakeNamedMaterial \"a\" \"string type\" \"diffuse\" {a}\n\
             MakeNamedMaterial \"b\" \"string type\" \"coateddiffuse\" {b}\n\
             Material \"mix\" \"string materials\" [\"a\" \"b\"]\n{SQUARE}"
        ))
    };
    let (n, m) = ("\"string normalmap\" \"n.png\"", "\"string normalmap\" \"m.png\"");
    let scene = mixed(n, n);
    let MaterialPart::Blend { a, b, normal_map, .. } = part(&scene) else { panic!("{:?}", part(&scene)) };
    assert_eq!((normal_map, told(&scene)), (&ColorValue::Texture("n".to_owned()), Vec::new()));
    // Without a blend of its own, which only the map needed.
    assert!(matches!(named(&scene, a), MaterialPart::Diffuse { .. }));
    assert!(matches!(named(&scene, b), MaterialPart::Plastic { .. }));
    for (scene, name) in [(mixed(n, m), "n"), (mixed("", m), "m")] {
        tells_only(&scene, &["material `mix`", "normal maps"]);
        let MaterialPart::Blend { normal_map, .. } = part(&scene) else { panic!() };
        assert_eq!(*normal_map, ColorValue::Texture(name.to_owned()));
    }
}

#[test]
fn spectra_that_are_not_known_are_told() {
    let unknown = |name: &str| format!("\"spectrum {name}\" \"foo.spd\"");
    for (world, name) in [
        (format!("Material \"diffuse\" {}\n", unknown("reflectance")), "material `diffuse`"),
        (format!("Material \"diffusetransmission\" {}\n", unknown("transmittance")), "`transmittance`"),
        (
            format!(
                "Texture \"t\" \"spectrum\" \"checkerboard\" {}\nMaterial \"diffuse\" \"texture reflectance\" \"t\"\n",
                unknown("tex1")
            ),
            "texture `t`",
        ),
        (
            format!(
                "MakeNamedMedium \"m\" \"string type\" \"homogeneous\" \"rgb sigma_s\" [0 0 0] {}\n",
                unknown("sigma_a")
            ),
            "medium `m`",
        ),
    ] {
        tells_only(&read(&format!("{world}{SQUARE}")), &[name, "the spectrum `foo.spd`", "not known"]);
    }
}

#[test]
fn heights_have_the_encoding_of_their_image() {
    let encoding = |given: &str| {
        let scene = read(&format!(
            "Texture \"t\" \"float\" \"imagemap\" \"string filename\" \"n.png\" {given}\n\
             Material \"diffuse\" \"texture displacement\" \"t\"\n{SQUARE}"
        ));
        let relief = scene.file.textures.0.values().find_map(|source| match source {
            TextureSource::Image { relief: Some(_), encoding, .. } => Some(*encoding),
            _ => None,
        });
        relief.unwrap()
    };
    assert_eq!(encoding("\"string encoding\" \"linear\""), Encoding::Linear);
    assert_eq!(encoding(""), Encoding::Auto);
}

#[test]
fn negative_factors_are_depths_of_a_relief_and_black_as_colours() {
    let named = |name: &str, kind: &str, scale: f32, invert: bool| {
        format!(
            "Texture \"{name}\" \"{kind}\" \"imagemap\" \"string filename\" \"n.png\" \"float scale\" {scale} \
             \"bool invert\" {invert}\n"
        )
    };
    let image = |kind: &str, scale: f32, invert: bool| named("t", kind, scale, invert);
    let scaled = |kind: &str, scale: f32| {
        named("image", kind, scale, false)
            + &format!("Texture \"t\" \"{kind}\" \"scale\" \"texture tex\" \"image\" \"float scale\" -0.5\n")
    };
    let shown = |world: String, parameter: &str| {
        let scene = read(&format!("{world}Material \"diffuse\" \"texture {parameter}\" \"t\"\n{SQUARE}"));
        assert_eq!(told(&scene), Vec::<String>::new());
        match scene.file.textures.0.values().next() {
            Some(TextureSource::Image { relief, tint, invert, .. }) => (*relief, tint.0.x, *invert),
            other => panic!("{other:?}"),
        }
    };
    for (world, expected) in [
        (image("float", -0.5, false), (Some(-1.0), 0.5, false)),
        (scaled("float", 0.5), (Some(-1.0), 0.25, false)),
        (scaled("float", -0.5), (Some(1.0), 0.25, false)),
        // 1 + 0.5 x, and 1 − 0.5 x.
        (image("float", -0.5, true), (Some(1.0), 0.5, false)),
        (image("float", 0.5, true), (Some(1.0), 0.5, true)),
    ] {
        assert_eq!(shown(world.clone(), "displacement"), expected, "{world}");
    }
    assert_eq!(shown(scaled("spectrum", 1.0), "reflectance"), (None, 0.0, false));
    let checkers = "Texture \"squares\" \"spectrum\" \"checkerboard\"\n\
                    Texture \"t\" \"spectrum\" \"scale\" \"texture tex\" \"squares\" \"float scale\" -2\n";
    let scene = read(&format!("{checkers}Material \"diffuse\" \"texture reflectance\" \"t\"\n{SQUARE}"));
    let Some(TextureSource::Checker { a, b, .. }) = scene.file.textures.0.values().next() else { panic!() };
    assert_eq!((a.0, b.0), (Vec3::ZERO, Vec3::ZERO));
}

#[test]
fn a_light_reflects_like_its_material() {
    let light = |sides: &str, rest: &str| {
        read(&format!("AreaLightSource \"diffuse\" \"rgb L\" [2 2 2] \"bool twosided\" {sides}\n{rest}{SQUARE}"))
    };
    let image = "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"n.png\"\n";
    let textured = format!("{image}Material \"diffuse\" \"texture reflectance\" \"t\"\n");
    for rest in ["Material \"conductor\"\n", "Material \"coateddiffuse\"\n", &textured] {
        let scene = light("false", rest);
        let MaterialPart::Blend { weight, a, b, .. } = part(&scene) else { panic!("{:?}", part(&scene)) };
        assert_eq!((weight, told(&scene)), (&ScalarValue::Number(LIGHT_SHARE), Vec::new()));
        assert_ne!(named(&scene, a), named(&scene, b));
        let bright = ColorValue::grey(2.0 / LIGHT_SHARE);
        assert_eq!(named(&scene, b), &MaterialPart::Emissive { radiance: bright });
    }
    let scene = light("true", "Material \"conductor\"\n");
    let MaterialPart::Blend { b, .. } = part(&scene) else { panic!("{:?}", part(&scene)) };
    let MaterialPart::Principled { emission, two_sided: true, .. } = named(&scene, b) else { panic!() };
    assert_eq!(*emission, ColorValue::grey(2.0 / LIGHT_SHARE));
    // An emissive part allows no texture of weights.
    let mixed = "Texture \"w\" \"float\" \"imagemap\" \"string filename\" \"n.png\"\n\
        MakeNamedMaterial \"a\" \"string type\" \"conductor\"\nMaterial \"mix\" \"string materials\" [\"a\" \"a\"] \
        \"texture amount\" \"w\"\n";
    tells_only(&light("false", mixed), &["`bilinearmesh 1`", "it only emits"]);
}

#[test]
fn curves_have_their_alpha() {
    let curve = |alpha: &str| {
        read(&format!("Shape \"curve\" \"point3 P\" [0 0 0 1 0 0 2 0 0 3 0 0] \"float width\" 0.1 {alpha}\n"))
    };
    let scene = curve("\"float alpha\" 0.25");
    let MaterialPart::Principled { opacity, .. } = part(&scene) else { panic!("{:?}", part(&scene)) };
    assert_eq!(*opacity, ScalarValue::Number(0.25));
    assert!(matches!(part(&curve("")), MaterialPart::Diffuse { .. }));
}

#[test]
fn triangles_without_texture_coordinates_have_those_of_pbrt() {
    let image = "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"n.png\"\n\
        Material \"diffuse\" \"texture reflectance\" \"t\"\n";
    let scene = read(&format!("{image}{TRIANGLES}"));
    let mesh = &scene.parts[&0];
    let corners: Vec<Vec2> = mesh.triangles.iter().flatten().map(|&vertex| mesh.uvs[vertex as usize]).collect();
    assert_eq!(corners, [Vec2::ZERO, Vec2::X, Vec2::ONE].repeat(2));
    assert_eq!(told(&scene), Vec::<String>::new());
    // Without a texture its vertices stay shared.
    assert_eq!(read(TRIANGLES).parts[&0].positions.len(), 4);
    let ply = "Shape \"plymesh\" \"string filename\" \"bare.ply\"\n";
    tells_only(&read(&format!("{image}{ply}{ply}")), &["`bare.ply`", "no texture coordinates"]);
    assert!(told(&read(ply)).is_empty());
}

#[test]
fn long_names_are_told() {
    let name = "n".repeat(256);
    let world = |name: &str| {
        format!("MakeNamedMaterial \"{name}\" \"string type\" \"diffuse\"\nNamedMaterial \"{name}\"\n{SQUARE}")
    };
    assert!(told(&read(&world(&name))).is_empty());
    tells_only(&read(&world(&format!("{name}a"))), &["first 256 characters", "`nnn"]);
}

#[test]
fn a_mixture_of_five_has_holes() {
    let mut world = String::new();
    for i in 0..5 {
        writeln!(world, "MakeNamedMaterial \"m{i}\" \"string type\" \"diffuse\" \"rgb reflectance\" [0.{i} 0 0]")
            .unwrap();
    }
    let mut last = "m0".to_owned();
    for i in 1..5 {
        writeln!(
            world,
            "MakeNamedMaterial \"x{i}\" \"string type\" \"mix\" \"string materials\" [\"{last}\" \"m{i}\"]"
        )
        .unwrap();
        last = format!("x{i}");
    }
    let scene =
        read(&format!("{world}NamedMaterial \"x4\"\n{}", SQUARE.replace("\"point3", "\"float alpha\" 0.5 \"point3")));
    let MaterialPart::Blend { opacity, a, b, .. } = part(&scene) else { panic!("{:?}", part(&scene)) };
    assert_eq!((opacity, told(&scene)), (&ScalarValue::Number(0.5), Vec::new()));
    assert_ne!(a, b);
}

#[test]
fn a_texture_is_scaled_by_a_number_and_unknown_textures_are_told() {
    let scaled = |scale: &str| {
        read(&format!(
            "Texture \"f\" \"float\" \"constant\" \"float value\" 0.1\n\
             Texture \"t\" \"spectrum\" \"scale\" \"rgb tex\" [0.8 0.8 0.8] {scale}\n\
             Material \"diffuse\" \"texture reflectance\" \"t\"\n{SQUARE}"
        ))
    };
    for (scale, expected) in [("\"texture scale\" \"f\"", 0.8 * 0.1), ("\"float scale\" 0.5", 0.4), ("", 0.8)] {
        let scene = scaled(scale);
        let albedo = ColorValue::Rgb(Vec3::splat(expected));
        assert_eq!((part(&scene), told(&scene)), (&MaterialPart::Diffuse { albedo }, Vec::new()), "{scale}");
    }
    tells_only(&scaled("\"texture scale\" \"gone\""), &["texture `t`", "no texture `gone` for `scale`"]);
}

#[test]
fn the_old_names_of_attributes_save_materials_too() {
    let red = "Material \"diffuse\" \"rgb reflectance\" [1 0 0]\n";
    let scene = read(&format!("{red}TransformBegin\nMaterial \"conductor\"\nTransformEnd\n{SQUARE}"));
    let MaterialPart::Diffuse { .. } = part(&scene) else { panic!("{:?}", part(&scene)) };
}

#[test]
fn diffuse_transmission_has_a_scale() {
    let scene = read(&format!(
        "Material \"diffusetransmission\" \"rgb reflectance\" [0.5 0.5 0.5] \"float scale\" 0.5\n{SQUARE}"
    ));
    let MaterialPart::Translucent { reflectance, transmittance } = part(&scene) else { panic!("{:?}", part(&scene)) };
    assert_eq!((reflectance, transmittance), (&ColorValue::grey(0.25), &ColorValue::grey(0.125)));
}

#[test]
fn media_that_are_not_shown_are_told() {
    let medium =
        "MakeNamedMedium \"m\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [1 2 3] \"rgb sigma_s\" [0 0 0]\n";
    let inside = |material: &str, name: &str| {
        read(&format!("{SQUARE}{medium}MediumInterface \"{name}\" \"\"\nMaterial \"{material}\"\n{SQUARE}"))
    };
    for material in ["interface", "thindielectric", "diffusetransmission"] {
        tells_only(&inside(material, "m"), &["inside of `dielectric` only", "`m` is left out"]);
    }
    tells_only(&inside("dielectric", "gone"), &["no medium `gone`"]);
    assert_eq!(told(&inside("dielectric", "m")), Vec::<String>::new());
}

#[test]
fn a_sphere_with_highlights_of_a_direction_has_the_poles_of_pbrt() {
    let sphere = |widths: &str| {
        let scene = read(&format!("Rotate 90 1 0 0\nMaterial \"conductor\" {widths}\nShape \"sphere\"\n"));
        matches!(scene.file.objects[0], ObjectPart::Mesh { .. })
    };
    assert!(sphere("\"float uroughness\" 0.05 \"float vroughness\" 0.4"));
    assert!(!sphere("\"float roughness\" 0.2"));
}

#[test]
fn a_file_that_is_cut_off_is_told() {
    tells_only(&read(&format!("{SQUARE}AttributeBegin\n{SQUARE}")), &["`AttributeBegin` is not ended", "cut off"]);
    let scene = read(&format!("{SQUARE}ObjectBegin \"o\"\n{SQUARE}AttributeBegin\n"));
    tells_only(&scene, &["`ObjectBegin` is not ended", "not shown"]);
    assert_eq!(scene.file.objects.len(), 1);
}

#[test]
fn options_have_no_type_and_an_end_too_many_is_told() {
    let options = "Option \"seed\" 42 Option \"disablepixeljitter\" true Option \"msereferenceout\" \"x\"\n";
    assert_eq!(told(&read(&format!("{options}{SQUARE}"))), Vec::<String>::new());
    let scene = read(&format!("AttributeEnd\n{SQUARE}"));
    tells_only(&scene, &["a.pbrt:2: ", "nothing was begun"]);
    assert_eq!(scene.file.objects.len(), 1);
}

/// One list, as in version 3.
#[test]
fn attributes_and_objects_may_end_in_any_order() {
    let object = format!("AttributeBegin\nTranslate 5 0 0\nObjectBegin \"o\"\nAttributeBegin\n{SQUARE}AttributeEnd\n");
    let scene = read(&format!("{object}AttributeEnd\nObjectEnd\nTranslate 0 7 0\nObjectInstance \"o\"\n{SQUARE}"));
    assert_eq!(told(&scene), Vec::<String>::new());
    let places = scene.file.objects.iter().map(|object| Placement::from_part(object.transform()).affine().translation);
    assert_eq!(places.collect::<Vec<_>>(), [DVec3::new(5.0, 7.0, 0.0), DVec3::new(0.0, 7.0, 0.0)]);
}

#[test]
fn invisible_lights_light() {
    let lit = |emits: &str| {
        let shape = "Shape \"sphere\" \"float alpha\" 0\n";
        read(&format!("AttributeBegin\n{emits}{shape}AttributeEnd\n{SQUARE}"))
    };
    let scene = lit("AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] \"float scale\" 10\n");
    tells_only(&scene, &["`sphere 1`", "invisible light"]);
    let MaterialPart::Emissive { radiance: ColorValue::Rgb(radiance) } = part(&scene) else { panic!() };
    assert!((*radiance - Vec3::splat(10.0)).abs().max_element() < 1e-3, "{radiance}");
    let scene = lit("");
    tells_only(&scene, &["`sphere 1`", "left out"]);
    assert_eq!(scene.file.objects.len(), 1);
}

#[test]
fn names_may_stand_before_what_they_name() {
    let scene = read(&format!(
        "NamedMaterial \"later\"\n{SQUARE}\
         MakeNamedMaterial \"later\" \"string type\" \"diffuse\" \"texture reflectance\" \"t\"\n\
         Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"n.png\"\n{SQUARE}"
    ));
    assert_eq!(told(&scene), Vec::<String>::new());
    assert!(matches!(part(&scene), MaterialPart::Diffuse { albedo: ColorValue::Texture(_) }), "{:?}", part(&scene));
    let materials: Vec<_> = scene.file.objects.iter().map(|object| object.material()).collect();
    assert_eq!(materials, [Some("later"); 2]);
    // Names that are nowhere are told once.
    tells_only(&read(&format!("NamedMaterial \"never\"\n{SQUARE}")), &["there is no material `never`"]);
}

#[test]
fn an_environment_alone_is_a_scene_and_an_index_may_be_a_colour() {
    let scene = read("LightSource \"infinite\" \"rgb L\" [1 2 3]\n");
    assert_eq!((scene.file.objects.len(), told(&scene)), (0, Vec::new()));
    let scene = read(&format!("Material \"dielectric\" \"rgb eta\" [1.25 1.25 1.25]\n{SQUARE}"));
    let MaterialPart::Glass { ior, .. } = part(&scene) else { panic!("{:?}", part(&scene)) };
    assert_eq!((*ior, told(&scene)), (1.25, Vec::new()));
    let coated = format!("Material \"coateddiffuse\" \"rgb albedo\" [0.5 0.5 0.5]\n{SQUARE}");
    tells_only(&read(&coated), &["medium in its coat"]);
}

#[test]
fn parameters_of_materials_that_nothing_uses_are_told() {
    let scene = read(&format!("Material \"diffuse\" \"rgb Kd\" [1 0 0] \"rgb reflectance\" [0 1 0]\n{SQUARE}"));
    tells_only(&scene, &["`rgb Kd` has no effect"]);
    let scene = read(&format!("Material \"hair\" \"float eumelanin\" 1\n{SQUARE}"));
    tells_only(&scene, &["not modelled"]);
}

#[test]
fn textures_of_later_textures_have_their_colours() {
    let scene = read(&format!(
        "Material \"diffuse\" \"texture reflectance\" \"A\"\n{SQUARE}\n\
         Texture \"A\" \"spectrum\" \"scale\" \"texture tex\" \"B\"\n\
         Texture \"B\" \"spectrum\" \"constant\" \"rgb value\" [0.5 0.25 0.125]\n"
    ));
    let MaterialPart::Diffuse { albedo } = part(&scene) else { panic!("{:?}", part(&scene)) };
    assert_eq!((albedo, told(&scene)), (&ColorValue::Rgb(Vec3::new(0.5, 0.25, 0.125)), Vec::new()));
}

#[test]
fn instances_may_stand_before_their_object() {
    let object = format!("ObjectBegin \"o\"\n{SQUARE}ObjectEnd\n");
    let scene = read(&format!("Translate 1 2 3 ObjectInstance \"o\" Identity\n{object}ObjectInstance \"o\"\n"));
    assert_eq!((scene.file.objects.len(), told(&scene)), (2, Vec::new()));
    let first = read(&format!("{object}Translate 1 2 3 ObjectInstance \"o\"\n")).file.objects;
    assert!(scene.file.objects.contains(&first[0]), "{first:?}");
    tells_only(&read(&format!("ObjectInstance \"never\"\n{SQUARE}")), &["there is no object `never`"]);
}

#[test]
fn words_and_commas_of_older_versions_are_read() {
    let corners = "\"point3 P\" [1 0 0, 0 1 0, 0 0 1, -1 0 0] \"integer indices\" [0 1 2 0, 2, 3]";
    for (levels, n) in [("\"integer nlevels\" [1]", 8), ("\"integer levels\" [0]", 2)] {
        let scene = read(&format!("Shape \"loopsubdiv\" {corners} {levels}\n"));
        assert_eq!(told(&scene), Vec::<String>::new());
        assert_eq!(scene.parts.values().next().unwrap().triangles.len(), n);
    }
    let [commas, none] = [", ", " "].map(|gap| read(&format!("Translate 1{gap}2{gap}3\n{SQUARE}")).file.objects);
    assert_eq!(commas, none);
}

#[test]
fn a_name_that_is_defined_again_counts_for_what_follows() {
    let red = "\"rgb reflectance\" [1 0 0]";
    let twice = |more: &str| {
        read(&format!(
            "MakeNamedMaterial \"m\" \"string type\" \"diffuse\" {red}\n\
             NamedMaterial \"m\"\n{SQUARE}MakeNamedMaterial \"m\" \"string type\" \"diffuse\"\n{SQUARE}{more}"
        ))
    };
    // The second reading finds the same as the first.
    for more in ["", "MakeNamedMaterial \"n\" \"string type\" \"diffuse\"\n"] {
        let early = if more.is_empty() { String::new() } else { format!("NamedMaterial \"n\"\n{SQUARE}") };
        let scene = twice(&format!("{early}{more}"));
        tells_only(&scene, &["material `m` is defined more than once: each counts for what follows it"]);
        let MaterialPart::Diffuse { albedo: ColorValue::Rgb(color) } = named(&scene, "m") else { panic!() };
        assert_eq!(*color, Vec3::X);
    }
    let texture = |kind: &str, value: &str| format!("Texture \"t\" \"{kind}\" \"constant\" {value}\n");
    let (color, number) = (texture("spectrum", "\"rgb value\" [1 0 0]"), texture("float", "\"float value\" 0.5"));
    let shown = format!("Material \"diffuse\" \"texture reflectance\" \"t\"\n{SQUARE}");
    // Textures of numbers have names of their own.
    assert_eq!(told(&read(&format!("{color}{number}{shown}"))), Vec::<String>::new());
    let scene = read(&format!("{color}{}{shown}", texture("spectrum", "\"rgb value\" [0 1 0]")));
    tells_only(&scene, &["`t` is defined more than once"]);
    let MaterialPart::Diffuse { albedo: ColorValue::Rgb(color) } = part(&scene) else { panic!() };
    assert_eq!(*color, Vec3::Y);
    // What stands before the second keeps the first.
    let [red, green] = ["1 0 0", "0 1 0"].map(|rgb| texture("spectrum", &format!("\"rgb value\" [{rgb}]")));
    let scene = read(&format!("{red}{shown}{green}{shown}"));
    let colors: Vec<&MaterialPart> = scene.file.materials.iter().map(|(_, part)| part).collect();
    let is = |part: &MaterialPart, wanted| matches!(part, MaterialPart::Diffuse { albedo } if *albedo == ColorValue::Rgb(wanted));
    assert!(colors.len() == 2 && is(colors[0], Vec3::X) && is(colors[1], Vec3::Y), "{colors:?}");
    let object = |shape: &str| format!("ObjectBegin \"o\"\n{shape}ObjectEnd\n");
    let scene = read(&format!("{}{}ObjectInstance \"o\"\n", object(SQUARE), object("Shape \"sphere\"\n")));
    tells_only(&scene, &["object `o` is defined more than once"]);
    assert!(matches!(scene.file.objects[..], [ObjectPart::Mesh { .. }]));
    let medium = "MakeNamedMedium \"a\" \"string type\" \"homogeneous\" \"rgb sigma_s\" [0 0 0]\n";
    tells_only(&read(&format!("{medium}{medium}{SQUARE}")), &["medium `a` is defined more than once"]);
}

#[test]
fn deep_mixtures_are_told_by_what_they_are() {
    let mixtures = |n: u32| {
        let mix = |i: u32| {
            format!("MakeNamedMaterial \"m{i}\" \"string type\" \"mix\" \"string materials\" [\"m{}\" \"m0\"]\n", i - 1)
        };
        let all: String = (1..=n).rev().map(mix).collect();
        read(&format!("MakeNamedMaterial \"m0\" \"string type\" \"diffuse\"\n{all}NamedMaterial \"m{n}\"\n{SQUARE}"))
    };
    assert_eq!(told(&mixtures(7)), Vec::<String>::new());
    for n in [8, 9, 30] {
        let told = told(&mixtures(n));
        assert!(!told.is_empty() && told.iter().all(|told| told.contains("mixture of more than 8")), "{told:#?}");
    }
    let told = told(&mixtures(40));
    assert!(told.iter().any(|told| told.contains("more than 32 mixtures deep")), "{told:#?}");
}
