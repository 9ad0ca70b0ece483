//! Scenes of Mitsuba: what becomes of each part, equality with scenes of our own, and files that lie.

use firstlight::render::{Falloff, Material, PixelFilter, Wrap};
use firstlight::scene::file::{LightPart, MaterialPart, ObjectPart, SceneFile};
use firstlight::scene::{
    ColorValue, EnvironmentSource, LoadOptions, LoadedScene, MeshSource, ModelChoice, ScalarValue, SceneSource,
    TextureSource, load,
};
use glam::{DVec2, DVec3, Vec3};
use std::path::Path;

fn open_file(path: &Path, choice: &ModelChoice) -> Result<LoadedScene, String> {
    let options = LoadOptions { choice: Some(choice), ..LoadOptions::default() };
    load(&SceneSource::Foreign(path.to_owned()), &options).map_err(|error| error.to_string())
}

fn try_open(body: &str, choice: &ModelChoice) -> Result<LoadedScene, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.xml");
    std::fs::write(&path, format!("<scene version=\"3.0.0\">\n{body}\n</scene>\n")).unwrap();
    open_file(&path, choice).map_err(|error| error.replace(&format!("{}/", folder.path().display()), ""))
}

/// The scene of these elements.
fn opened(body: &str) -> LoadedScene {
    try_open(body, &ModelChoice::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn refusal(body: &str) -> String {
    try_open(body, &ModelChoice::default()).err().unwrap_or_else(|| panic!("it opens"))
}

fn told(scene: &LoadedScene) -> Vec<String> {
    scene.warnings.iter().map(|warning| warning.to_string()).collect()
}

/// A sphere with this BSDF, and a light, so that nothing is added.
fn material(bsdf: &str) -> (MaterialPart, Vec<String>) {
    let scene = opened(&format!(
        "<sensor type=\"perspective\"/><emitter type=\"constant\"/><shape type=\"sphere\" id=\"ball\">{bsdf}</shape>"
    ));
    let ObjectPart::Sphere { material, .. } = &scene.file.objects[0] else { panic!("it is a sphere") };
    (scene.file.materials.get(material).unwrap().clone(), told(&scene))
}

#[test]
fn a_scene_is_the_same_as_in_our_own_words_to_the_last_bit() {
    let scene = opened(
        r#"
        <integrator type="path"><integer name="max_depth" value="7"/></integrator>
        <sensor type="perspective">
            <float name="fov" value="90"/>
            <transform name="to_world"><lookat origin="0 0 4" target="0 0 0" up="0 1 0"/></transform>
            <film type="hdrfilm">
                <integer name="width" value="40"/><integer name="height" value="20"/><rfilter type="box"/>
            </film>
        </sensor>
        <bsdf type="twosided" id="grey"><bsdf type="diffuse"><rgb name="reflectance" value="0.25"/></bsdf></bsdf>
        <shape type="sphere" id="ball">
            <point name="center" x="1" y="2" z="3"/><float name="radius" value="0.5"/><ref id="grey"/>
        </shape>
        <shape type="rectangle" id="wall">
            <transform name="to_world"><scale x="2" y="3"/><translate z="-1"/></transform><ref id="grey"/>
        </shape>
        <shape type="rectangle" id="light">
            <transform name="to_world"><rotate x="1" angle="90"/><translate y="5"/></transform>
            <emitter type="area" id="glow"><rgb name="radiance" value="4, 2, 1"/></emitter>
        </shape>
        <emitter type="constant"><rgb name="radiance" value="0.125"/></emitter>
        <emitter type="point" id="lamp"><point name="position" value="1 2 3"/><rgb name="intensity" value="2"/></emitter>
        <emitter type="directional" id="sun">
            <vector name="direction" value="0 -1 0"/><rgb name="irradiance" value="3"/>
        </emitter>
        "#,
    );
    // A field of view of 90° along x is one of 2 atan(1/2) along y at twice the width.
    let vfov = 2.0 * 0.5_f64.atan().to_degrees();
    let ours = format!(
        r#"(
        camera: (eye: (0, 0, 4), forward: (0, 0, -1), up: (0, 1, 0), vfov: {vfov:?}),
        film: (width: 40, height: 20),
        max_depth: 7,
        environment: constant(0.125),
        materials: {{ "grey": diffuse(albedo: 0.25), "glow": emissive(radiance: (4, 2, 1)) }},
        objects: [
            sphere(name: "ball", center: (1, 2, 3), radius: 0.5, material: "grey"),
            quad(name: "wall", corner: (-2, -3, -1), edge_u: (4, 0, 0), edge_v: (0, 6, 0), material: "grey"),
            quad(name: "light", corner: (-1, 5, -1), edge_u: (2, 0, 0), edge_v: (0, 0, 2), material: "glow"),
        ],
        lights: [
            point(name: "lamp", position: (1, 2, 3), intensity: 2, radius: 0),
            directional(name: "sun", direction: (0, -1, 0), irradiance: 3),
        ],
    )"#
    );
    let mut file = scene.file.clone();
    // The point about which the view orbits is no part of the image.
    file.camera.pivot_distance = None;
    assert_eq!(file, SceneFile::parse(&ours, "ours.ron").unwrap_or_else(|error| panic!("{error}")));
    let saved = SceneFile::parse(&scene.file.to_ron(), "saved.ron").unwrap();
    assert_eq!(saved, scene.file);
}

#[test]
fn the_field_of_view_is_along_the_axis_that_is_named() {
    let vfov = |sensor: &str| {
        let film =
            r#"<film type="hdrfilm"><integer name="width" value="30"/><integer name="height" value="20"/></film>"#;
        let body = format!(
            "<shape type=\"sphere\"/><emitter type=\"constant\"/><sensor type=\"perspective\">{sensor}{film}</sensor>"
        );
        let camera = opened(&body).file.camera;
        (0.5 * camera.vfov.to_radians()).tan()
    };
    let fov = |axis: &str| vfov(&format!(r#"<float name="fov" value="90"/><string name="fov_axis" value="{axis}"/>"#));
    let diagonal = 1.0 / (1.0 + 1.5_f64.powi(2)).sqrt();
    for (axis, expected) in
        [("x", 1.0 / 1.5), ("y", 1.0), ("smaller", 1.0), ("larger", 1.0 / 1.5), ("diagonal", diagonal)]
    {
        assert!((fov(axis) - expected).abs() < 1e-12, "{axis}: {}", fov(axis));
    }
    // 36 mm × 24 mm has the shape of this film.
    let normal = vfov(r#"<string name="focal_length" value="36mm"/>"#);
    assert!((normal - 1.0 / 3.0).abs() < 1e-12, "{normal}");
    let crop = r#"<float name="fov" value="90"/><film type="hdrfilm"><integer name="width" value="60"/>
        <integer name="height" value="40"/><integer name="crop_width" value="30"/><integer name="crop_height" value="20"/>
        <integer name="crop_offset_x" value="15"/><integer name="crop_offset_y" value="10"/></film>"#;
    assert!((vfov(crop) - 0.5 / 1.5).abs() < 1e-12, "{}", vfov(crop));
}

#[test]
fn parameters_includes_and_references_are_resolved() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    std::fs::create_dir(folder.path().join("parts")).unwrap();
    write(
        "a.xml",
        r#"<scene version="3.0.0">
            <default name="size" value="2"/><default name="sizes" value="3"/><default name="what" value="sphere"/>
            <path value="parts"/>
            <include filename="parts/b.xml"/>
            <shape type="$what"><float name="radius" value="$sizes"/><ref id="other"/></shape>
            <shape type="$what"><float name="radius" value="$size"/><string name="id" value="\$x"/></shape>
            <shape type="ply"><string name="filename" value="t.ply"/></shape>
        </scene>"#,
    );
    write(
        "parts/b.xml",
        r#"<scene version="3.0.0">
            <include filename="c.xml"/>
            <bsdf type="diffuse" id="red"><rgb name="reflectance" value="0.5 0.1 0.1"/></bsdf>
            <alias id="red" as="other"/>
        </scene>"#,
    );
    write("parts/c.xml", r#"<emitter version="3.0.0" type="constant"/>"#);
    write(
        "parts/t.ply",
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
         element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
    );
    let path = folder.path().join("a.xml");
    let radii = |choice: &ModelChoice| {
        let scene = open_file(&path, choice).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(scene.file.objects.len(), 3, "{:?}", told(&scene));
        assert_eq!(scene.file.objects[0].material(), Some("red"));
        let radius = |object: &ObjectPart| match object {
            ObjectPart::Sphere { radius, .. } => *radius,
            _ => 0.0,
        };
        (scene.file.objects.iter().map(radius).collect::<Vec<_>>(), told(&scene))
    };
    let (usual, warnings) = radii(&ModelChoice::default());
    assert_eq!(usual, [3.0, 2.0, 0.0]);
    assert!(warnings.iter().any(|line| line.contains("id of the shape sphere is not known")), "{warnings:?}");
    let defines = [("size", "7"), ("none", "1")].map(|(name, value)| (name.to_owned(), value.to_owned())).to_vec();
    let (given, warnings) = radii(&ModelChoice { defines, ..ModelChoice::default() });
    assert_eq!(given, [3.0, 7.0, 0.0]);
    assert!(warnings.iter().any(|line| line.contains("`$none`")), "{warnings:?}");
    let mut scene = open_file(&path, &ModelChoice::default()).unwrap();
    let files: Vec<String> =
        scene.files().iter().map(|file| file.file_name().unwrap().to_string_lossy().into_owned()).collect();
    for file in ["a.xml", "b.xml", "c.xml", "t.ply"] {
        assert!(files.iter().any(|known| known == file), "{file} is not watched: {files:?}");
    }
    scene.file.objects.clear();
}

#[test]
fn errors_have_a_line_and_a_column() {
    for (body, expected) in [
        (
            "<shape type=\"sphere\">\n  <float name=\"radius\" value=\"one\"/></shape>",
            "a.xml:3:3: `one` is not a number",
        ),
        ("<bsdf/>", "a.xml:2:1: `<bsdf>` lacks `type`"),
        (
            "<shape type=\"sphere\"><ref id=\"gras\"/></shape><bsdf type=\"diffuse\" id=\"grass\"/>",
            "a.xml:2:22: there is no object with the id `gras` (did you mean `grass`?)",
        ),
        ("<thing type=\"a\"/>", "a.xml: has no shape that can be shown: a.xml:2:1: `<thing>` is not known"),
        (
            "<shape type=\"sphere\"><transform name=\"to_world\"><rotate y=\"1\" angle=\"?\"/></transform></shape>",
            "a.xml:2:49: `angle` must be a number",
        ),
        ("<shape type=\"sphere\">", "a.xml:3:1: not valid XML: "),
        ("<shape type=\"$kind\"/>", "a.xml:2:1: `$kind` has no value"),
        ("<bsdf type=\"diffuse\" id=\"a\"/>\n<bsdf type=\"diffuse\" id=\"a\"/>", "a.xml:3:1: the id `a` is used twice"),
        ("<include filename=\"none.xml\"/>", "a.xml:2:1: `none.xml`: no such file"),
        ("<include filename=\"../b.xml\"/>", "a.xml:2:1: `../b.xml` is a path out of the folder"),
        (
            "<shape type=\"sphere\"><transform name=\"to_world\"><matrix value=\"1 2\"/></transform></shape>",
            "a.xml:2:49: a matrix has 16 numbers",
        ),
        (
            "<shape type=\"sphere\"><bsdf type=\"dielectric\"><string name=\"int_ior\" value=\"watr\"/></bsdf></shape>",
            "did you mean `water`?",
        ),
        (
            "<shape type=\"sphere\"><bsdf type=\"conductor\"><string name=\"material\" value=\"Aux\"/></bsdf></shape>",
            "there is no conductor `Aux`",
        ),
    ] {
        let error = refusal(body);
        assert!(error.contains(expected), "{body}: {error}");
    }
}

#[test]
fn what_is_not_modelled_is_told_with_its_name_and_the_rest_opens() {
    let scene = opened(
        r#"<emitter type="constant"/><mode type="final"><shape type="sphere"/></mode>
        <shape type="sphere"><bsdf type="hair" id="wig"/><medium name="interior" type="homogeneous"/></shape>
        <shape type="sphere"><bsdf type="measured" id="silk"><string name="filename" value="a"/></bsdf></shape>
        <shape type="linearcurve" id="strand"/>
        <shape type="obj"><string name="filename" value="gone.obj"/></shape>
        <emitter type="volprim" id="cloud"/>
        <emitter type="timed_sunsky" id="noon"/>"#,
    );
    let told = told(&scene).join("\n");
    for part in [
        "`wig`: BSDFs of type hair",
        "`silk`: BSDFs of type measured",
        "media are not modelled",
        "`strand`: shapes of type linearcurve",
        "`cloud`: emitters of type volprim",
        "`noon`: emitters of type timed_sunsky",
        "`gone.obj`: no such file",
        "`<mode>` is not known",
    ] {
        assert!(told.contains(part), "{part}: {told}");
    }
    assert_eq!(scene.file.objects.len(), 2);
}

#[test]
fn materials_are_those_of_the_docs() {
    let close = |a: f32, b: f64| (f64::from(a) / b - 1.0).abs() < 1e-6;
    let (part, _) = material(r#"<bsdf type="dielectric"><string name="int_ior" value="water"/></bsdf>"#);
    assert!(matches!(part, Material::Glass { ior, .. } if close(ior, 1.333 / 1.000277)), "{part:?}");
    let rough = r#"<bsdf type="roughdielectric"><string name="distribution" value="ggx"/><float name="alpha" value="0.3"/>
        <float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/></bsdf>"#;
    let (part, warnings) = material(rough);
    assert!(
        matches!(part, Material::RoughGlass { alpha: ScalarValue::Number(0.3), ior: 1.5, .. }) && warnings.is_empty(),
        "{part:?} {warnings:?}"
    );
    let metal = r#"<bsdf type="roughconductor"><float name="alpha_u" value="0.25"/><float name="alpha_v" value="0.05"/>
        <string name="material" value="Al"/></bsdf>"#;
    let (part, warnings) = material(metal);
    let Material::Conductor { alpha, alpha_v, beckmann: true, compensate: false, .. } = &part else {
        panic!("{part:?}")
    };
    assert_eq!((alpha, alpha_v), (&ScalarValue::Number(0.25), &ScalarValue::Number(0.05)));
    assert!(warnings.is_empty(), "{warnings:?}");
    let layered = r#"<bsdf type="principled"><rgb name="base_color" value="0.5, 0.25, 0.125"/>
        <float name="roughness" value="0.25"/><float name="anisotropic" value="0.5"/><float name="spec_tint" value="0.75"/>
        <float name="specular" value="0.5"/><float name="sheen" value="0.375"/><float name="clearcoat" value="1"/>
        <float name="flatness" value="0.625"/></bsdf>"#;
    let (part, warnings) = material(layered);
    let wanted = "(camera: (eye: (0, 0, 4), look_at: (0, 0, 0)), materials: { \"m\": disney(base_color: \
                  (0.5, 0.25, 0.125), roughness: 0.25, anisotropic: 0.5, specular_tint: 0.75, sheen: 0.375, \
                  clearcoat: 1, flatness: 0.625) })";
    let wanted = SceneFile::parse(wanted, "wanted.ron").unwrap().materials.get("m").unwrap().clone();
    // `specular` of 1/2 is an index of 1.5.
    assert!((part == wanted) && warnings.is_empty(), "{part:?} {warnings:?}");
    let (part, warnings) = material(r#"<bsdf type="principledthin"><float name="diff_trans" value="1.5"/></bsdf>"#);
    let Material::Disney { thin_walled: true, diffuse_transmission, .. } = &part else { panic!("{part:?}") };
    assert!(*diffuse_transmission == ScalarValue::Number(1.5) && warnings.is_empty(), "{warnings:?}");
    // Without polarisation, a filter lets half of the light pass, straight on.
    let (part, warnings) = material(r#"<bsdf type="polarizer"><rgb name="transmittance" value="0.5, 1, 1"/></bsdf>"#);
    let Material::ThinGlass { ior: 1.0, transmittance, .. } = &part else { panic!("{part:?}") };
    assert_eq!(*transmittance, ColorValue::Rgb(Vec3::new(0.25, 0.5, 0.5)));
    assert!(warnings.len() == 1 && warnings[0].contains("loses half"), "{warnings:?}");
    let mapped = r#"<bsdf type="normalmap"><texture name="normalmap" type="rawconstant">
        <vector name="value" value="0.5, 0.7, 1"/></texture><bsdf type="principled"/></bsdf>"#;
    let (part, _) = material(mapped);
    assert!(matches!(part, Material::Blend { normal_shadowing: true, .. }), "{part:?}");
    let (part, _) = material(r#"<bsdf type="conductor"/>"#);
    assert_eq!(part, Material::Mirror { reflectance: ColorValue::grey(1.0) });
    let (part, _) = material(r#"<bsdf type="twosided"><bsdf type="diffuse"/></bsdf>"#);
    assert_eq!(part, Material::Diffuse { albedo: ColorValue::grey(0.5) });
    let mask = r#"<bsdf type="mask"><float name="opacity" value="0.25"/><bsdf type="diffuse"/></bsdf>"#;
    let (part, _) = material(mask);
    assert!(matches!(part, Material::Blend { opacity: ScalarValue::Number(0.25), .. }), "{part:?}");
    let scene = opened(
        "<emitter type=\"constant\"/><shape type=\"sphere\"><bsdf type=\"null\"/></shape><shape type=\"cube\"/>",
    );
    assert_eq!(scene.file.objects.len(), 1);
}

#[test]
fn the_back_of_an_open_surface_is_black_unless_it_is_twosided() {
    let scene = opened(
        r#"<emitter type="constant"/>
        <bsdf type="plastic" id="plain"/><bsdf type="twosided" id="both"><ref id="plain"/></bsdf>
        <shape type="rectangle"><ref id="plain"/></shape><shape type="disk"><ref id="both"/></shape>
        <shape type="cube"><ref id="plain"/></shape>"#,
    );
    let part = |i: usize| scene.file.materials.get(scene.file.objects[i].material().unwrap()).unwrap();
    let Material::Blend { a, b, by_side: true, .. } = part(0) else { panic!("{:?}", part(0)) };
    assert!(matches!(scene.file.materials.get(a), Some(Material::Plastic { nonlinear: false, .. })));
    assert_eq!(scene.file.materials.get(b), Some(&Material::Diffuse { albedo: ColorValue::grey(0.0) }));
    assert!([1, 2].into_iter().all(|i| matches!(part(i), Material::Plastic { .. })));
}

#[test]
fn the_back_of_a_body_is_black_where_it_is_seen() {
    let is_backed = |sensor: &str, shape: &str| {
        let scene = opened(&format!("<emitter type=\"constant\"/>{sensor}<shape type=\"cube\">{shape}</shape>"));
        let part = scene.file.materials.get(scene.file.objects[0].material().unwrap()).unwrap().clone();
        matches!(part, Material::Blend { by_side: true, .. })
    };
    let sensor_at = |z: f64| {
        let look = format!("<lookat origin=\"0,0,{z}\" target=\"0,0,-9\" up=\"0,1,0\"/>");
        format!("<sensor type=\"perspective\"><transform name=\"to_world\">{look}</transform></sensor>")
    };
    assert!(!is_backed("", "") && !is_backed(&sensor_at(4.0), ""));
    assert!(is_backed(&sensor_at(0.5), ""), "the camera is inside");
    assert!(is_backed("", "<boolean name=\"flip_normals\" value=\"true\"/>"));
    let moved = "<transform name=\"to_world\"><translate z=\"4\"/></transform>";
    assert!(is_backed(&sensor_at(4.0), moved) && !is_backed(&sensor_at(0.5), moved));
}

#[test]
fn metals_and_skies_of_old_versions_have_their_own_defaults() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("old.xml");
    let body = r#"<scene version="0.6.0"><shape type="sphere"><bsdf type="conductor"/></shape>
        <emitter type="sunsky"><vector name="sunDirection" x="0" y="0.7" z="0.3"/></emitter></scene>"#;
    std::fs::write(&path, body).unwrap();
    let scene = load(&SceneSource::Foreign(path), &LoadOptions::default()).unwrap();
    let metal = scene.file.materials.iter().next().unwrap().1;
    // Copper.
    assert!(matches!(metal, Material::Conductor { eta, .. } if eta.0.x < 0.4), "{metal:?}");
    let EnvironmentSource::Sky { elevation, sun, .. } = &scene.file.environment else { panic!() };
    assert!((elevation - 0.7f64.atan2(0.3).to_degrees()).abs() < 1e-6 && *sun == 1.0, "{elevation}");
}

#[test]
fn textures_keep_their_place() {
    let scene = opened(
        r#"<emitter type="constant"/>
        <shape type="rectangle"><bsdf type="diffuse"><texture name="reflectance" type="checkerboard" id="squares">
            <transform name="to_uv"><scale x="5" y="3"/><translate x="0.25"/></transform>
        </texture></bsdf></shape>
        <shape type="rectangle"><bsdf type="roughconductor"><texture name="alpha" type="checkerboard" id="widths">
            <float name="color0" value="0.1"/><float name="color1" value="0.2"/>
        </texture></bsdf></shape>
        <shape type="rectangle"><bsdf type="diffuse"><texture name="reflectance" type="bitmap" id="photo">
            <string name="filename" value="none.png"/><string name="wrap_mode" value="mirror"/>
            <transform name="to_uv"><scale value="2"/><translate x="0.5" y="0.25"/></transform>
        </texture></bsdf></shape>"#,
    );
    let Some(TextureSource::Checker { squares, offset, a, .. }) = scene.file.textures.get("squares") else { panic!() };
    assert_eq!((*squares, *offset, a.0), (DVec2::new(10.0, 6.0), DVec2::new(0.5, 0.0), Vec3::splat(0.4)));
    // Where a number is read, Mitsuba exchanges the two.
    let Some(TextureSource::Checker { a, b, .. }) = scene.file.textures.get("widths") else { panic!() };
    assert_eq!((a.0.x, b.0.x), (0.2, 0.1));
    // The image is missing: told, and a plain colour.
    assert!(told(&scene).iter().any(|line| line.contains("none.png")), "{:?}", told(&scene));
    assert!(scene.file.textures.get("photo").is_none());
}

#[test]
fn images_are_the_other_way_up() {
    let folder = tempfile::tempdir().unwrap();
    image::RgbImage::from_pixel(2, 2, image::Rgb([200, 100, 50])).save(folder.path().join("p.png")).unwrap();
    let body = r#"<scene version="3.0.0"><emitter type="constant"/>
        <shape type="rectangle"><bsdf type="diffuse"><texture name="reflectance" type="bitmap" id="photo">
            <string name="filename" value="p.png"/><string name="wrap_mode" value="mirror"/>
            <transform name="to_uv"><scale value="2"/><translate x="0.5" y="0.25"/></transform>
        </texture></bsdf></shape></scene>"#;
    std::fs::write(folder.path().join("a.xml"), body).unwrap();
    let scene = open_file(&folder.path().join("a.xml"), &ModelChoice::default()).unwrap();
    let Some(TextureSource::Image { repeat, offset, wrap, .. }) = scene.file.textures.get("photo") else { panic!() };
    // v of the image is 1 - (2 v + 0.25).
    assert_eq!((*repeat, *offset, *wrap), (DVec2::new(2.0, -2.0), DVec2::new(0.5, 0.75), Wrap::Mirror));
}

#[test]
fn instances_share_a_mesh_and_mirrored_cameras_turn_the_scene() {
    let scene = opened(
        r#"<emitter type="constant"/>
        <shape type="shapegroup" id="group"><shape type="cube"/><shape type="disk"/></shape>
        <shape type="instance"><ref id="group"/></shape>
        <shape type="instance"><ref id="group"/><transform name="to_world"><translate x="3"/></transform></shape>
        <sensor type="perspective"><transform name="to_world">
            <scale x="-1"/><lookat origin="0 0 5" target="0 0 0" up="0 1 0"/>
        </transform></sensor>"#,
    );
    let shapes: Vec<u32> = scene
        .file
        .objects
        .iter()
        .map(|object| match object {
            ObjectPart::Mesh { source: MeshSource::Part { shape, .. }, .. } => *shape,
            other => panic!("{other:?}"),
        })
        .collect();
    assert_eq!(shapes, [2, 3, 2, 3]);
    let Some(matrix) = scene.file.objects[2].transform().matrix else { panic!() };
    assert_eq!((matrix[0][0], matrix[0][3]), (-1.0, -3.0));
    assert_eq!(scene.file.camera.eye, DVec3::new(0.0, 0.0, 5.0));
    assert!(told(&scene).is_empty(), "{:?}", told(&scene));
}

#[test]
fn the_sun_stands_where_mitsuba_has_it() {
    // Directions of Mitsuba 3.9.1, with the zenith at +Z; turned so that it is at +Y.
    for (parameters, direction) in [
        ("", DVec3::new(0.0513854, 0.691748, 0.720308)),
        (
            r#"<float name="latitude" value="48"/><float name="longitude" value="9"/><float name="timezone" value="1"/>
            <integer name="year" value="2024"/><integer name="month" value="3"/><integer name="day" value="20"/>
            <float name="hour" value="9"/><float name="minute" value="30"/>"#,
            DVec3::new(0.521715, -0.711402, 0.470873),
        ),
        (r#"<vector name="sun_direction" x="0" y="-1" z="1"/>"#, DVec3::new(0.0, -1.0, 1.0).normalize()),
    ] {
        let scene = opened(&format!(
            r#"<shape type="sphere"><point name="center" x="1" y="2" z="3"/></shape>
            <emitter type="sunsky">{parameters}<float name="turbidity" value="5"/></emitter>"#
        ));
        let EnvironmentSource::Sky { elevation, azimuth, turbidity: 5.0, below: false, .. } = scene.file.environment
        else {
            panic!("{:?}", scene.file.environment)
        };
        let (sin, cos) = elevation.to_radians().sin_cos();
        let found = DVec3::new(cos * azimuth.to_radians().sin(), sin, -cos * azimuth.to_radians().cos());
        let expected = DVec3::new(direction.x, direction.z, -direction.y);
        // Mitsuba computes in single precision: the days since 2000 alone take most of it.
        assert!((found - expected).length() < 3e-3, "{found} for {expected}");
        let ObjectPart::Sphere { center, .. } = &scene.file.objects[0] else { panic!() };
        assert!((*center - DVec3::new(1.0, 3.0, -2.0)).length() < 1e-9, "{center}");
    }
    // A scene that is upright already stays as it is.
    let scene = opened(
        r#"<shape type="sphere"><point name="center" x="1" y="2" z="3"/></shape>
        <emitter type="sunsky"><vector name="sun_direction" x="1" y="1" z="0"/>
            <transform name="to_world"><rotate x="1" angle="-90"/></transform></emitter>"#,
    );
    let EnvironmentSource::Sky { elevation, azimuth, .. } = scene.file.environment else { panic!() };
    assert!((elevation - 45.0).abs() < 1e-9 && (azimuth - 90.0).abs() < 1e-9, "{elevation} {azimuth}");
    let ObjectPart::Sphere { center, .. } = &scene.file.objects[0] else { panic!() };
    assert!((*center - DVec3::new(1.0, 2.0, 3.0)).length() < 1e-9, "{center}");
}

#[test]
fn environments_are_turned_and_spots_keep_their_angles() {
    let scene = opened(
        r#"<shape type="sphere"><point name="center" x="1" y="2" z="3"/></shape>
        <emitter type="spot" id="beam"><float name="cutoff_angle" value="40"/><float name="beam_width" value="40"/>
            <transform name="to_world"><lookat origin="0 3 0" target="0 0 0"/></transform></emitter>
        <emitter type="constant"/>"#,
    );
    let LightPart::Spot { inner_angle, outer_angle, direction, falloff: Falloff::Linear, .. } = &scene.file.lights[0]
    else {
        panic!("{:?}", scene.file.lights)
    };
    assert_eq!((*inner_angle, *outer_angle, *direction), (40.0, 40.0, DVec3::NEG_Y));
    assert!(matches!(scene.file.environment, EnvironmentSource::Constant(_)));
    let scene = opened(
        r#"<sensor type="perspective"/><shape type="sphere"/><emitter type="projector"><float name="fov" value="90"/><float name="scale" value="2"/>
            <transform name="to_world"><lookat origin="0 3 0" target="0 0 0" up="0 0 1"/></transform></emitter>"#,
    );
    let LightPart::Spot { intensity, up, image_width, image_height, even: true, direction, .. } = &scene.file.lights[0]
    else {
        panic!("{:?}", scene.file.lights)
    };
    assert!((intensity.0.x - std::f32::consts::TAU).abs() < 1e-5 && told(&scene).is_empty(), "{intensity:?}");
    assert!((*image_width - 90.0).abs() < 1e-9 && (*image_height - 90.0).abs() < 1e-9);
    assert_eq!((*direction, *up), (DVec3::NEG_Y, DVec3::Z));
    let folder = tempfile::tempdir().unwrap();
    image::Rgb32FImage::from_pixel(4, 2, image::Rgb([1.0, 1.0, 1.0])).save(folder.path().join("e.exr")).unwrap();
    let body = r#"<scene version="3.0.0"><emitter type="envmap"><string name="filename" value="e.exr"/>
        <transform name="to_world"><rotate x="1" angle="90"/></transform></emitter>
        <shape type="sphere"><point name="center" x="1" y="2" z="3"/></shape></scene>"#;
    std::fs::write(folder.path().join("a.xml"), body).unwrap();
    let scene = open_file(&folder.path().join("a.xml"), &ModelChoice::default()).unwrap();
    // The poles of the image, at ±Z of the scene, are at ±Y here.
    let ObjectPart::Sphere { center, .. } = &scene.file.objects[0] else { panic!() };
    assert_eq!(*center, DVec3::new(1.0, 3.0, -2.0));
    assert_eq!(scene.file.film.filter, PixelFilter::Gaussian);
}
