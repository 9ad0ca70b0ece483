//! Bad input: a clear error with place and advice, the right exit status, and nothing half-written.

use crate::program::{Outcome, program};
use bevy_ecs::world::World;
use firstlight::scene::file::SceneFile;
use firstlight::scene::{EnvironmentSource, Extraction, LoadOptions, Rgb, SceneInputs, SceneSource, load, save_scene};
use std::path::Path;

const CAMERA: &str = "camera: (eye: (0, 0, 5), look_at: (0, 0, 0))";

/// The message for a scene file with this text.
fn message(text: &str) -> String {
    match SceneFile::parse(text, "scene.ron") {
        Ok(_) => panic!("no error for: {text}"),
        Err(error) => error.to_string(),
    }
}

/// The message for a scene with a good camera, and these fields beside it, each on a line of its own.
fn with(fields: &[&str]) -> String {
    message(&format!("(\n    {CAMERA},\n    {},\n)", fields.join(",\n    ")))
}

#[track_caller]
fn assert_says(found: &str, expected: &[&str]) {
    for part in expected {
        assert!(found.contains(part), "expected {part:?} in: {found}");
    }
}

#[test]
fn wrong_words_are_named_with_line_column_and_the_nearest_known() {
    let red = r#"materials: { "red": diffuse(albedo: (0.6, 0.1, 0.1)) }"#;
    let cases: &[(&[&str], &[&str])] = &[
        (&["film: (width: 3, hieght: 4)"], &["scene.ron:3:22:", "unknown field `hieght`", "did you mean `height`?"]),
        (&["objets: []"], &["scene.ron:3:5:", "`objets`", "did you mean `objects`?"]),
        (&["objects: [\n        spere(radius: 1, material: \"red\")]"], &["scene.ron:4:9:", "did you mean `sphere`?"]),
        (
            &[red, r#"objects: [sphere(radius: 1, material: "read")]"#],
            &["scene.ron:4:", "material `read` is not defined (did you mean `red`?)"],
        ),
        (
            &[r#"materials: { "a": diffuse(albedo: "tiels") }"#, r#"textures: { "tiles": checker(a: 0, b: 1) }"#],
            &["texture `tiels`", "did you mean `tiles`?"],
        ),
        (&[r#"objects: [mesh(source: builtin("serpent-not"))]"#], &["did you mean `serpent-knot`?"]),
        (&["objects: [sphere(radius: 1)]"], &["scene.ron:3:", "`material`", "missing"]),
        (&["integrator: pathh"], &["scene.ron:3:", "did you mean `path`?"]),
        (&["film: (width: 3, width: 4, height: 2)"], &["`width`", "twice"]),
        (&[r#"materials: { "a": mirror(), "a": mirror() }"#], &["scene.ron:3:", "`a` is defined twice"]),
        (&["film: (width: -3, height: 4)"], &["scene.ron:3:"]),
        (&["film: (width: 3.5, height: 4)"], &["scene.ron:3:"]),
        (&[r#"environment: constant("blue")"#], &["scene.ron:3:", "colour"]),
        (&["environment: constant((1, 2))"], &["scene.ron:3:"]),
    ];
    for (fields, expected) in cases {
        assert_says(&with(fields), expected);
    }
    assert_says(&message("(camera: (eye: (0, 0, 5)"), &["scene.ron:1:"]);
    assert_says(&message(""), &["scene.ron:1:"]);
    assert_says(&message("()"), &["`camera`", "missing"]);
    assert_says(&message(&"(camera: ".repeat(5000)), &["scene.ron:1:"]);
}

#[test]
fn values_of_the_wrong_form_are_named_with_what_is_expected_and_an_example() {
    let red = r#"materials: { "red": diffuse(albedo: (0.6, 0.1, 0.1)) }"#;
    let object = |text: &str| with(&[red, &format!("objects: [\n        {text}]")]);
    let mut problems = Vec::new();
    for (found, expected) in [
        (
            with(&["film: (width: 3, height: 4, filter: blackman-harris)"]),
            "scene.ron:3:41: `filter`: expected one of box, tent, gaussian, blackman_harris and mitchell, such as \
             `filter: blackman_harris`, found `blackman-harris`",
        ),
        (
            object(r#"mesh(source: builtin("cube"), material: "red", transform: (rotate: 30))"#),
            "scene.ron:5:76: `rotate`: expected three angles in degrees, about x, y and z, such as \
             `rotate: (0, 30, 0)`, found `30`",
        ),
        (
            message("(\n camera: (eye: [0, 0, 5], look_at: (0, 0, 0)))"),
            "scene.ron:2:16: `eye`: expected a point in round brackets, such as `eye: (0, 1, 4)`, found `[0, 0, 5]`",
        ),
        (
            with(&[r#"environment: "sky.png""#]),
            "scene.ron:3:18: `environment`: expected a kind of environment, such as \
             `environment: image(file: \"sky.png\")`, found `\"sky.png\"`",
        ),
        (
            object("sphere(radius: 1, material: red)"),
            "scene.ron:5:37: `material`: expected text in quotes, such as `material: \"red\"`, found `red`",
        ),
        (
            object("sphere(radius: \"1\", material: \"red\")"),
            "scene.ron:5:24: `radius`: expected a length in metres, such as `radius: 0.5`, found `\"1\"`",
        ),
        (
            with(&["materials: [diffuse(albedo: 1)]"]),
            "scene.ron:3:16: `materials`: expected materials with their names in curly brackets, such as",
        ),
        (with(&["materials: { red: diffuse(albedo: 1) }"]), "scene.ron:3:"),
        (
            with(&["materials: { \"red\": diffuse(albedo: tiles) }"]),
            "scene.ron:3:41: `albedo`: expected a colour, or the name of a texture in quotes, such as \
             `albedo: \"tiles\"`, found `tiles`",
        ),
        (with(&["film: (width: 3.5, height: 4)"]), "scene.ron:3:19: `width`: expected a whole number, such as"),
        (with(&["film: (width: -3, height: 4)"]), "scene.ron:3:19: `width`: expected a whole number, such as"),
        (with(&["film: [640, 480]"]), "scene.ron:3:11: `film`: expected the size of the image in round brackets"),
        (
            message("(camera: (eye: (0, 0, 5) look_at: (0, 0, 0)))"),
            "scene.ron:1:26: a comma is missing before `look_at`",
        ),
        (
            message("(camera: (eye: (0, 0, 5), look-at: (0, 0, 0)))"),
            "scene.ron:1:27: unknown field `look-at` (did you mean `look_at`?)",
        ),
        (
            message("(camera: (eye: (0, 0), look_at: (0, 0, 0)))"),
            "scene.ron:1:16: `eye`: expected a point in round brackets, such as",
        ),
        (with(&["depth_of_field: 1"]), "unknown field `depth_of_field`"),
        (
            with(&[red, "objects: sphere(radius: 1, material: \"red\")"]),
            "scene.ron:4:14: `objects`: expected a list of objects in square brackets, such as",
        ),
        (with(&["environment: constant(blue)"]), "scene.ron:3:"),
    ] {
        // In words of scene files, not of the parser or of types.
        let foreign = ["struct", "DVec3", "Vec3", "opening", "identifier", "Part", "option", "tuple", "raw"];
        let foreign = foreign.into_iter().find(|word| found.contains(word));
        if !found.contains(expected) || foreign.is_some() {
            problems.push(format!("expected {expected:?}, without {foreign:?}, in: {found}"));
        }
    }
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

#[test]
fn values_out_of_range_are_named_with_what_is_expected() {
    let red = r#"materials: { "red": diffuse(albedo: (0.6, 0.1, 0.1)) }"#;
    let object = |text: &str| with(&[red, &format!("objects: [\n        {text}]")]);
    let material = |text: &str| with(&[&format!("materials: {{\n        \"m\": {text} }}")]);
    for (found, expected) in [
        (object(r#"sphere(radius: 0, material: "red")"#), "the radius is 0, but must lie between"),
        (object(r#"sphere(radius: -1, material: "red")"#), "the radius is -1"),
        (object(r#"sphere(radius: NaN, material: "red")"#), "the radius is NaN"),
        (object(r#"sphere(center: (inf, 0, 0), radius: 1, material: "red")"#), "must be finite"),
        (object(r#"sphere(center: (1e300, 0, 0), radius: 1, material: "red")"#), "must be finite and within"),
        (
            object(r#"sphere(radius: 1, material: "red", transform: (scale: (1, 2, 1)))"#),
            "spheres need a uniform scale",
        ),
        (object(r#"sphere(radius: 1, material: "red", transform: (scale: 0))"#), "flattens the object"),
        (object(r#"plane(normal: (0, 0, 0), material: "red")"#), "the normal is (0, 0, 0)"),
        (object(r#"quad(edge_u: (1, 0, 0), edge_v: (2, 0, 0), material: "red")"#), "the quad has no area"),
        (object(r#"triangle(vertices: ((0, 0, 0), (1, 0, 0), (2, 0, 0)), material: "red")"#), "triangle has no area"),
        (object(r#"spheres(centers: [], radii: all(1), material: "red")"#), "there are no spheres"),
        (object(r#"spheres(centers: [(0, 0, 0)], radii: each([1, 2]), material: "red")"#), "2 radii for 1 centres"),
        (object(r#"mesh(source: builtin("cube"), material: "red", simplify: 0)"#), "`simplify` is 0"),
        (
            object(r#"mesh(source: builtin("cube"), transform: (matrix: ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 0, 0))))"#),
            "flat",
        ),
        (material("diffuse(albedo: 1.5)"), "but must lie between 0 and 1: it is a share of light"),
        (material("diffuse(albedo: (0.5, NaN, 0.5))"), "between 0 and 1"),
        (material("metal(alpha: 2, reflectance: 1)"), "`alpha` is 2"),
        (material("glass(ior: 0)"), "`ior` is 0, but must be finite and positive"),
        (material("emissive(radiance: (1, -1, 0))"), "not negative"),
        (material("blend(weight: 0.5, a: \"m\", b: \"m\")"), "contains itself"),
        (with(&["film: (width: 0, height: 4)"]), "has no pixels"),
        (with(&["film: (width: 60000, height: 60000)"]), "GiB"),
        (with(&["film: (width: 4000000000, height: 4000000000)"]), "GiB"),
        (with(&["max_depth: 0"]), "use at least 1"),
        (with(&["environment: gradient(zenith: 1, horizon: inf, ground: 0)"]), "must be finite"),
        (with(&["lights: [point(position: (0, 0, 0), intensity: 1, radius: -1)]"]), "`radius` is -1, but must be 0 or"),
        (with(&["lights: [spot(direction: (0, 0, 0), intensity: 1)]"]), "`direction` is (0, 0, 0), but must be finite"),
        (
            with(&["lights: [spot(direction: (0, 1, 0), intensity: 1, inner_angle: 50)]"]),
            "`inner_angle` is 50, but must lie between 0 and `outer_angle`, which is 45 degrees",
        ),
        (
            with(&["lights: [spot(direction: (0, 1, 0), intensity: 1, outer_angle: 91)]"]),
            "`outer_angle` is 91, but must lie above 0 and at most at 90 degrees",
        ),
        (with(&["lights: [spot(direction: (0, 1, 0), intensity: 1, outer_angle: 0)]"]), "`outer_angle` is 0, but must"),
        (
            with(&["lights: [spot(direction: (0, 1, 0), intensity: 1, inner_angle: -1)]"]),
            "`inner_angle` is -1, but must",
        ),
        (
            with(&["lights: [spot(direction: (0, 1, 0), intensity: 1, image_width: 180)]"]),
            "`image_width` is 180, but must be 0, or lie between",
        ),
        (with(&["lights: [spot(direction: (0, 1, 0), intensity: 1, up: (0, 0, 0))]"]), "`up` is (0, 0, 0), but must"),
        (
            with(&["lights: [spot(direction: (0, 1, 0), intensity: 1, texture: \"slide\")]"]),
            "texture `slide` is not defined",
        ),
        (with(&["environment: sky(elevation: -1)"]), "`elevation` is -1, but must lie between 0 and 90"),
        (with(&["environment: sky(turbidity: inf)"]), "`turbidity` is inf, but must lie between 1 and 10"),
        (with(&["environment: sky(ground: 2)"]), "`ground` is an albedo: its channels must lie between 0 and 1"),
        (
            with(&["lights: [spot(direction: (0, 1, 0), intensity: -1)]"]),
            "(-1, -1, -1) must be finite and not negative",
        ),
        (
            with(&["lights: [directional(direction: (0, 0, 0), irradiance: 1)]"]),
            "`direction` is (0, 0, 0), but must be",
        ),
        (with(&["lights: [directional(direction: (0, 1, 0), irradiance: -2)]"]), "(-2, -2, -2) must be finite"),
        (
            with(&["lights: [directional(direction: (0, 1, 0), irradiance: 1, transform: (scale: 0))]"]),
            "the transform flattens the object",
        ),
    ] {
        assert_says(&found, &["scene.ron:", expected]);
    }
    let camera = |fields: &str| message(&format!("(\n    camera: ({fields}),\n)"));
    for (fields, expected) in [
        ("eye: (1, 2, 3), look_at: (1, 2, 3)", "`eye` and `look_at` are the same point"),
        ("eye: (0, 5, 0), look_at: (0, 0, 0)", "`up` is parallel to the view direction"),
        ("eye: (0, 0, 5), look_at: (0, 0, 0), up: (0, 0, 0)", "`up` is (0, 0, 0)"),
        ("eye: (0, NaN, 5), look_at: (0, 0, 0)", "must be finite"),
        ("eye: (0, 0, 5), look_at: (0, 0, 0), vfov: 180", "above 0 and below 180"),
        ("eye: (0, 0, 5), look_at: (0, 0, 0), lens_radius: -1", "must be 0 or positive"),
        ("eye: (0, 0, 5), look_at: (0, 0, 0), f_stop: 0", "`f_stop` is 0"),
        ("eye: (0, 0, 5), look_at: (0, 0, 0), f_stop: 2, lens_radius: 1", "exclude each other"),
        ("eye: (0, 0, 5), look_at: (0, 0, 0), focus_distance: 0", "`focus_distance` is 0"),
    ] {
        assert_says(&camera(fields), &["scene.ron:2:", expected]);
    }
}

/// Brackets, commas, comments and names of fields: what is told is what is wrong, where it is wrong.
#[test]
fn what_is_wrong_around_values_is_told_where_it_is() {
    let view = "camera: (eye: (0, 1, 4), look_at: (0, 0, 0))";
    let clay = "materials: { \"clay\": diffuse(albedo: 0.5) }";
    let scene = |rest: &str| format!("(\n    {view},\n    {rest}\n)");
    for (text, expected) in [
        (scene(&format!("{clay},\n    objects: [sphere(radius: 1,, material: \"clay\")],")), "4:32: unexpected comma"),
        (
            scene(&format!("{clay},\n    objects: [sphere(radius: 1, material: \"clay\"],")),
            "4:49: a bracket or a comma is missing before `],`",
        ),
        (
            scene("materials: { \"clay\": diffuse(0.5) },"),
            "3:34: `diffuse` has fields with names, such as `albedo: 0.5`, found `0.5` without one",
        ),
        (
            scene("environment: constant(color: (1, 1, 1)),"),
            "3:27: the value of `constant` has no name: write `constant((1, 1, 1))`",
        ),
        (
            scene(&format!("{clay},\n    objects: [mesh(source: ply(file: \"a.ply\"), material: \"clay\")],")),
            "4:32: the value of `ply` has no name: write `ply(\"a.ply\")`",
        ),
        ("(camera: \u{feff}(0, 1))".to_owned(), "1:"),
        (format!("# comment\n({view})"), "1:1: a comment begins with `//`, not with `#`"),
        (format!("{view},\n{clay},\n"), "1:1: a scene is in round brackets: put `(` before `camera`"),
        (format!("scene({view})"), "1:1: a scene starts with `(`: remove `scene`"),
        (
            scene("materials: { \"clay\": principled(base_color: 0.5, two_sided: 1) },"),
            "`two_sided`: expected true or false",
        ),
        (scene(&format!("{clay},\n    objects: [cube(size: 1)],")), "4:15: unknown object `cube`: it is a mesh"),
        (
            scene(&format!("{clay},\n    objects: [point(intensity: 1)],")),
            "unknown object `point`: it belongs in `lights`",
        ),
        (scene("materials: { \"clay\": diffuse(albedo: \"#ff88\") },"), "is `\"#rgb\"` or `\"#rrggbb\"`"),
        (scene("materials: { \"clay\": diffuse(albedo: \"0.5\") },"), "numbers have no quotes"),
    ] {
        assert_says(&message(&text), &["scene.ron:", expected]);
    }
    let down = message("(camera: (eye: (0, 5, 0), look_at: (0, 0, 0)))");
    assert_says(&down, &["set it, such as `up: (0, 0, -1)`"]);
}

#[test]
fn all_mistakes_of_a_file_are_told_at_once() {
    let found =
        with(&["film: (width: 0, height: 0)", "max_depth: 0", r#"objects: [sphere(radius: 0, material: "none")]"#]);
    assert_eq!(found.lines().count(), 4, "{found}");
}

#[test]
fn hostile_text_is_refused_quickly() {
    // Blends that double at every level, and a long chain of them.
    let doubling: String =
        (0..40).map(|i| format!("\"m{i}\": blend(weight: 0.5, a: \"m{0}\", b: \"m{0}\"),", i + 1)).collect();
    let found = with(&[&format!("materials: {{ {doubling} \"m40\": mirror() }}")]);
    assert_says(&found, &["more than 8 plain materials"]);
    let chain: String =
        (0..20_000).map(|i| format!("\"m{i}\": blend(weight: 0.5, a: \"m{}\", b: \"w\"),", i + 1)).collect();
    let found = with(&[&format!("materials: {{ {chain} \"m20000\": mirror(), \"w\": mirror() }}")]);
    assert_says(&found, &["more than 8 plain materials"]);
}

#[test]
fn files_that_a_scene_points_at_are_named_together_with_the_line_that_does() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    let open = |fields: &str| {
        write("scene.ron", &format!("(\n{CAMERA},\n{fields})"));
        load(&SceneSource::Scene(folder.path().join("scene.ron")), &LoadOptions::default()).unwrap_err().to_string()
    };
    assert_says(&open(r#"objects: [mesh(source: obj("none.obj"))]"#), &["scene.ron:3:", "none.obj", "no such file"]);
    write("empty.obj", "v 0 0 0\n");
    assert_says(&open(r#"objects: [mesh(source: obj("empty.obj"))]"#), &["scene.ron:3:", "empty.obj", "no faces"]);
    write("range.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n");
    assert_says(
        &open(r#"objects: [mesh(source: obj("range.obj"))]"#),
        &["range.obj: has no faces", "no vertex", "line 4"],
    );
    write("nan.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n");
    assert_says(&open(r#"objects: [mesh(source: obj("nan.obj"))]"#), &["nan.obj: has no faces", "finite", "line 2"]);
    std::fs::write(folder.path().join("bytes.ron"), b"(\xff\xfe)").unwrap();
    let bytes = load(&SceneSource::Scene(folder.path().join("bytes.ron")), &LoadOptions::default());
    assert_says(&bytes.unwrap_err().to_string(), &["bytes.ron", "UTF-8"]);
}

/// A broken part costs only itself; a scene of it alone is refused, see above.
#[test]
fn a_missing_mesh_or_image_is_left_out_and_told_with_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write(
        "flat.ply",
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 1 1\n2 2 2\n3 0 1 2\n",
    );
    write("sky.hdr", "#?RADIANCE\nnonsense");
    let scene = folder.path().join("scene.ron");
    let objects = "sphere(radius: 1, material: \"m\"), mesh(source: ply(\"flat.ply\"), name: \"flat\"),\n\
        mesh(source: ply(\"flat.ply\")), mesh(source: obj(\"none.obj\"), name: \"none\")";
    write(
        "scene.ron",
        &format!(
            "({CAMERA}, environment: image(file: \"sky.hdr\", scale: 0.5),\n\
        textures: {{ \"t\": image(file: \"none.png\") }}, materials: {{ \"m\": diffuse(albedo: \"t\") }},\n\
        objects: [{objects}])"
        ),
    );
    let loaded = load(&SceneSource::Scene(scene.clone()), &LoadOptions::default()).unwrap();
    let told: Vec<String> = loaded.warnings.iter().map(ToString::to_string).collect();
    for (line, what) in [
        (3, "flat.ply: all 1 triangles are degenerate (zero area); `flat` is left out"),
        (4, "none.obj: cannot be read: no such file; `none` is left out"),
        (1, "sky.hdr: cannot be decoded"),
        (2, "none.png: cannot be read: no such file; the texture is omitted"),
    ] {
        let is_told = |text: &&String| text.contains(&format!("scene.ron:{line}:")) && text.contains(what);
        assert_eq!(told.iter().filter(is_told).count(), 1, "{what}: {told:?}");
    }
    assert_eq!(told.len(), 4, "{told:?}");
    // What cannot be read may appear later, and is watched.
    let files = loaded.files();
    assert!(["flat.ply", "none.obj", "none.png"].iter().all(|name| files.contains(&folder.path().join(name))));
    let mut world = World::new();
    loaded.spawn(&mut world);
    let inputs = SceneInputs::of(&mut world);
    let shown = Extraction::new(&inputs, &loaded.trees);
    assert_eq!((inputs.objects.len(), shown.entities.len()), (4, 1));
    assert!(shown.problems.is_empty(), "{:?}", shown.problems);
    // It is saved with its objects, and opened again.
    let copy = folder.path().join("copy.ron");
    save_scene(&mut world, Some(&loaded), &copy).unwrap();
    let again = load(&SceneSource::Scene(copy), &LoadOptions::default()).unwrap();
    assert_eq!((again.file.objects.len(), again.warnings.len()), (4, 2), "{:?}", again.warnings);
    assert_eq!(again.file.environment, EnvironmentSource::Constant(Rgb(glam::Vec3::splat(0.5))));
}

#[test]
fn a_model_of_nothing_but_lines_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flat.obj");
    // Two triangles, and in each of them three corners on one line, away from the origin.
    std::fs::write(&path, "v 5 5 5\nv 6 6.5 7\nv 7 8 9\nv 5 5 5\nf 1 2 3\nf 1 4 2\n").unwrap();
    let error = load(&SceneSource::Model(path.clone()), &LoadOptions::default()).unwrap_err().to_string();
    assert_says(&error, &["flat.obj: all 2 triangles are degenerate"]);
    // Faces that name one corner twice.
    std::fs::write(&path, "v 5 5 5\nv 6 6.5 7\nv 7 8 9.5\nf 1 1 2\nf 3 2 3\nf 3 3 3\n").unwrap();
    let error = load(&SceneSource::Model(path.clone()), &LoadOptions::default()).unwrap_err().to_string();
    assert_says(&error, &["flat.obj: all 3 triangles are degenerate"]);
    // One thin triangle among them is a model.
    std::fs::write(&path, "v 5 5 5\nv 6 6.5 7\nv 7 8 9\nv 5 5 5.000001\nf 1 2 3\nf 1 4 2\n").unwrap();
    assert!(load(&SceneSource::Model(path), &LoadOptions::default()).is_ok());
}

/// Runs a command that must fail, and gives back what it says.
#[track_caller]
fn fails(folder: &Path, args: &[&str], status: i32) -> String {
    let Outcome { status: found, err, .. } = Outcome::of(program(folder).args(args));
    assert_eq!(found, Some(status), "{args:?}: {err}");
    err
}

#[test]
fn the_command_line_fails_with_the_right_status_and_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    std::fs::create_dir(path.join("folder.png")).unwrap();
    std::fs::write(path.join("notes.txt"), "hello").unwrap();
    let entries = || std::fs::read_dir(path).unwrap().count();
    let before = entries();
    // Usage.
    for args in [
        &["render", "cornell", "-o"][..],
        &["render", "cornell", "-o", "a.png", "--spp", "0"],
        &["render", "cornell", "-o", "a.png", "--spp", "many"],
        &["render", "cornell", "-o", "a.png", "--size", "0x10"],
        &["render", "cornell", "-o", "a.png", "--size", "640"],
        &["render", "cornell", "-o", "a.png", "--time", "-1"],
        &["render", "cornell", "-o", "a.png", "--threads", "0"],
        &["render", "cornell", "-o", "a.png", "--integrator", "magic"],
        &["rendr", "cornell", "--nothing"],
    ] {
        fails(path, args, 2);
    }
    for (args, expected) in [
        (&["render", "cornel", "-o", "a.png"][..], "did you mean `cornell`?"),
        (&["info", "cornel"], "did you mean `cornell`?"),
        (&["render", "cornell", "-o", "a.gif"], "use .png, .jpg or .exr"),
        (&["render", "cornell", "-o", "a"], "missing file extension: use .png, .jpg or .exr"),
        (&["render", "cornell", "-o", "a.png", "--spp", "-3"], "must be between 1 and 2147483648"),
        (&["render", "cornell", "-o", "a.png", "--error", "-0.1"], "must be a positive number"),
        (&["simplify", "none.obj", "-o", "a.txt", "--ratio", "0.5"], "must end in .obj"),
    ] {
        let said = fails(path, args, 2);
        assert!(said.contains(expected) && !said.contains("tip:"), "{args:?}: {said}");
    }
    // Failure, each before any ray is traced.
    for (args, expected) in [
        (&["render", "none.ron", "-o", "a.png"][..], "no such file"),
        (&["render", "none.obj", "-o", "a.png"], "no such file"),
        (&["render", "notes.txt", "-o", "a.png"], "a model (.obj, .ply, .stl, .glb, .gltf, .vrm)"),
        (&["render", "cornell", "-o", "notes.txt/a.png"], "notes.txt is not a folder"),
        (&["render", "cornell", "-o", "folder.png"], "is a folder"),
        (&["info", "none.ron"], "no such file"),
        (&["simplify", "none.obj", "-o", "nowhere/a.obj", "--ratio", "0.5"], "no such file"),
        (&["simplify", "none.obj", "-o", "a.obj", "--ratio", "0.5"], "no such file"),
    ] {
        let said = fails(path, args, 1);
        assert!(!said.contains(".firstlight-"), "temporary names are nobody's business: {said}");
        assert!(said.starts_with("error: ") && said.contains(expected), "{args:?}: {said}");
    }
    assert_eq!(entries(), before, "nothing was written");
}

/// The model and the scene are not there, so whoever looked for them first would say that.
#[test]
fn numbers_out_of_range_are_refused_before_anything_is_loaded() {
    let folder = tempfile::tempdir().unwrap();
    let simplify = ["simplify", "none.obj", "-o", "a.obj"];
    for (args, expected) in [
        (["--ratio", "1.5"], "above 0 and at most 1, not 1.5"),
        (["--ratio", "0"], "above 0 and at most 1"),
        (["--ratio", "nan"], "above 0 and at most 1"),
        (["--ratio", "half"], "above 0 and at most 1"),
        (["--faces", "0"], "at least one triangle"),
        (["--faces", "-3"], "at least 1"),
        (["--error", "-1"], "above 0, not -1"),
        (["--error", "inf"], "above 0"),
        (["--error", "much"], "above 0"),
    ] {
        let said = fails(folder.path(), &[&simplify[..], &args].concat(), 2);
        assert!(said.contains(expected) && said.contains(args[0]), "{args:?}: {said}");
    }
    let render = &["render", "none.ron", "-o", "a.png"][..];
    let explain = &["explain", "none.ron"][..];
    let report = &["report", "none.ron"][..];
    let show = &["none.ron"][..];
    let stability = &["stability"][..];
    for (command, args, expected) in [
        (render, &["--threads", "0"][..], "must be between 1 and 1024"),
        (render, &["--threads", "1025"], "must be between 1 and 1024"),
        (render, &["--spp", "0"], "must be between 1 and 2147483648"),
        (render, &["--spp", "2147483649"], "must be between 1 and 2147483648"),
        (render, &["--seed", "-1"], "must be between 0 and 4294967295"),
        (render, &["--size", "0x0"], "must be at least 1"),
        (render, &["--size", "100000x100000"], "GiB"),
        (render, &["--scale", "0"], "must be a positive number"),
        (render, &["--time", "nan"], "must be a positive number"),
        (render, &["--error", "0"], "must be a positive number"),
        (render, &["--exposure", "nan"], "must be a finite number of stops"),
        (render, &["--max-depth", "0"], "must be a whole number, at least 1"),
        (render, &["--samples", "5..5"], "the range 5..5 is empty"),
        (render, &["--region", "1,1,0,5"], "not a rectangle"),
        (render, &["--turntable", "0"], "must be between 1 and 100000"),
        (explain, &["--pixel", "9,3", "--size", "9x9"], "9,3 is outside of the image"),
        (explain, &["--pixel", "9"], "not a pixel"),
        (explain, &["--spp", "0", "--pixel", "1,1"], "must be between 1 and 1048576"),
        (report, &["--threads", "-1"], "must be between 1 and 1024"),
        (report, &["--spp", "0"], "must be between 1 and 1048576"),
        (show, &["--threads", "0"], "must be between 1 and 1024"),
        (show, &["--size", "0x0"], "must be at least 1"),
        (stability, &["--rays", "0"], "from 1 to 1e15"),
        (stability, &["--rays", "-1"], "from 1 to 1e15"),
        (stability, &["--threads", "-1"], "must be between 1 and 1024"),
    ] {
        let said = fails(folder.path(), &[command, args].concat(), 2);
        assert!(said.contains(expected) && said.contains(args[0]), "{args:?}: {said}");
    }
}
