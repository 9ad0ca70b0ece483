//! What foreign files hold does not act on a terminal: whatever a command reads and tells, on standard output or standard
//! error, has no control characters, no marks that turn the order of letters round, no forged lines and no endless names.

use crate::program::{Outcome, program};
use firstlight::scene::image_metadata::NOTE_KEY;
use std::ffi::OsStr;
use std::path::Path;

/// Escape sequences, a bell, line ends of three kinds, bidirectional controls, marks of no width, C1, DEL.
const ACTING: &str = "\u{1b}[2J\u{1b}]0;owned\u{7}\nerror: forged\r\u{b}\u{202e}txt\u{2066}\u{200f}\u{61c}\u{200b}\u{feff}\u{9b}31m\u{7f}";

/// The same in a string of RON.
fn acting_ron() -> String {
    ACTING.escape_default().to_string()
}

fn acts(c: char) -> bool {
    let marks = ['\u{200b}'..='\u{200f}', '\u{2028}'..='\u{202e}', '\u{2060}'..='\u{206f}', '\u{feff}'..='\u{feff}'];
    c != '\n' && c.is_control() || c == '\u{61c}' || marks.iter().any(|range| range.contains(&c))
}

impl Outcome {
    #[track_caller]
    fn check(&self, what: &str) {
        for (stream, text) in [("output", self.out()), ("error", &self.err)] {
            if let Some(c) = text.chars().find(|&c| acts(c)) {
                panic!("{what}: standard {stream} has {c:?}: {text:?}");
            }
            for line in text.lines() {
                assert!(!line.starts_with("error: forged") && !line.starts_with("forged"), "{what}: {text}");
                assert!(line.chars().count() <= 2000, "{what}: a line of {} characters", line.chars().count());
            }
        }
    }
}

fn run(folder: &Path, args: &[impl AsRef<OsStr>], log: Option<&str>) -> Outcome {
    let mut command = program(folder);
    command.args(args);
    if let Some(log) = log {
        command.env("RUST_LOG", log);
    }
    Outcome::of(&mut command)
}

/// Runs a line, and checks what it says; answers with it.
#[track_caller]
fn says(folder: &Path, line: &str, status: i32) -> Outcome {
    let said = run(folder, &line.split_whitespace().collect::<Vec<_>>(), None);
    said.check(line);
    assert_eq!(said.status, Some(status), "{line}: {}", said.err);
    said
}

const CAMERA: &str = "camera: (eye: (0, 0, 5), look_at: (0, 0, 0)), film: (width: 8, height: 8)";

#[test]
fn names_of_scene_files() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let write = |fields: &str| std::fs::write(path.join("a.ron"), format!("({CAMERA}, {fields})")).unwrap();
    let name = acting_ron();
    for fields in [
        format!("objects: [sphere(radius: 1, material: \"{name}\")]"),
        format!("materials: {{ \"{name}\": diffuse(albedo: 2) }}"),
        format!("materials: {{ \"{name}\": mirror(), \"{name}\": mirror() }}"),
        format!("materials: {{ \"a\": diffuse(albedo: \"{name}\") }}"),
        format!("objects: [mesh(source: obj(\"{name}\"))]"),
        format!("objects: [mesh(source: builtin(\"{name}\"))]"),
        format!("{ACTING}: 3"),
        format!("film: (width: \"{name}\")"),
    ] {
        write(&fields);
        assert!(says(path, "info a.ron", 1).err.contains("error: a.ron:"));
    }
    // What is told of a scene that lacks an image.
    for fields in [
        format!("textures: {{ \"{name}\": image(file: \"{name}\") }}"),
        format!("environment: image(file: \"{name}\")"),
    ] {
        write(&fields);
        assert!(says(path, "info a.ron", 0).err.contains("warning: a.ron:"));
    }
    // What is told of a scene that is good.
    write(&format!(
        "materials: {{ \"{name}\": emissive(radiance: 3) }}, \
         objects: [mesh(name: \"{name}\", source: builtin(\"cube\"), material: \"{name}\"), \
         spheres(name: \"{name}\", centers: [(2, 0, 0)], radii: all(0.5), material: \"{name}\")]"
    ));
    assert!(says(path, "info a.ron", 0).out().contains("\\u{1b}[2J"));
    assert!(says(path, "explain a.ron --pixel 4,4 --spp 4", 0).out().contains("\\u{1b}[2J"));
    // For machines the name is what it is.
    let json = run(path, &["info", "a.ron", "--json"], None);
    let told: serde_json::Value = serde_json::from_str(json.out()).unwrap();
    assert_eq!(told["parts"][0]["name"], ACTING);
    // A name of a megabyte.
    let long = "x".repeat(1 << 20);
    for fields in [
        format!("objects: [sphere(radius: 1, material: \"{long}\")]"),
        format!("objects: [mesh(source: obj(\"{long}\"))]"),
        format!("{long}: 3"),
        format!("film: (width: {long})"),
    ] {
        write(&fields);
        let said = says(path, "info a.ron", 1).err;
        assert!(said.len() < 4000 && (said.contains('…') || said.len() < 200), "{} bytes", said.len());
    }
    write(&format!("objects: [mesh(name: \"{long}\", source: builtin(\"cube\"))]"));
    assert!(says(path, "info a.ron", 0).out().len() < 4000);
    assert!(says(path, "explain a.ron --pixel 4,4 --spp 4", 0).out().len() < 4000);
}

#[test]
fn lines_and_names_of_models_and_libraries() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let acting = ACTING.replace(['\n', '\r', '\u{b}'], "\0");
    let long = "y".repeat(1 << 20);
    let v = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for word in [&acting, &long] {
        for text in
            [format!("{v}f 1 2 {word}\n"), format!("{v}v 1 2 {word}\nf 1 2 3\n"), format!("{v}f 1 2 3 {word}\n")]
        {
            std::fs::write(path.join("a.obj"), text).unwrap();
            // A broken line costs only itself, nothing is said of what no face uses; a model without faces is refused.
            let said = run(path, &["info", "a.obj"], None);
            said.check("a.obj");
            let (status, said) = (said.status, said.err);
            let begins = if status == Some(1) { "error: a.obj:" } else { "warning: a.obj:" };
            let is_quiet = status == Some(0) && said.is_empty();
            assert!(matches!(status, Some(0 | 1)) && (is_quiet || said.starts_with(begins)), "{status:?} {said:.200}");
            assert!(said.len() < 4000, "{} bytes", said.len());
        }
        let text = format!("mtllib a.mtl\nmtllib {word}.mtl\n{v}usemtl {word}\nf 1 2 3\nusemtl known\nf 1 2 3\n");
        std::fs::write(path.join("a.obj"), text).unwrap();
        let library =
            format!("newmtl known\nKd {word}\nNs {word}\nmap_Kd {word}.png\nnewmtl {word}\nKs -1 0 0\nd 7\nKd 1 1 1\n");
        std::fs::write(path.join("a.mtl"), library).unwrap();
        for line in ["info a.obj", "simplify a.obj -o b.obj --ratio 0.5"] {
            let said = says(path, line, 0).err;
            assert!(said.contains("warning: ") && said.len() < 12_000, "{line}: {} bytes", said.len());
        }
    }
}

fn write_png(path: &Path, note: &str) {
    let mut encoder = png::Encoder::new(std::fs::File::create(path).unwrap(), 1, 1);
    encoder.add_itxt_chunk(NOTE_KEY.to_owned(), note.to_owned()).unwrap();
    encoder.write_header().unwrap().write_image_data(&[0]).unwrap();
}

#[test]
fn notes_and_recordings() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let name = acting_ron();
    let note = |format: u32, program: &str, scene: &str| {
        format!(
            "(format: {format}, program: \"{program}\", scene: {scene}, fingerprint: \"{program}\", camera: (eye: (0, 0, 5), \
             look_at: (0, 0, 0)), film: (width: 8, height: 8), integrator: path, display: (), seed: 0, first_sample: 0, spp: 1)"
        )
    };
    for text in [
        note(9, &name, "builtin(\"cornell\")"),
        note(1, &name, &format!("scene(\"{name}\")")),
        note(1, &name, &format!("builtin(\"{name}\")")),
        format!("({ACTING}: 1)"),
    ] {
        write_png(&path.join("a.png"), &text);
        assert!(says(path, "info a.png", 1).err.starts_with("error: "), "{text}");
    }
    write_png(&path.join("a.png"), &note(1, &name, "builtin(\"cornell\")"));
    assert!(says(path, "info a.png", 0).err.contains("has changed since the image was rendered"));
    let header = |format: u32, scene: &str| {
        format!("(format:{format},program:\"{name}\",scene:{scene},up:None,width:8,height:8,seed:0)")
    };
    for text in [
        header(9, "Builtin(\"cornell\")"),
        header(1, &format!("Builtin(\"{name}\")")) + "\nOpened(0,1,\"\")\n",
        header(1, &format!("File(\"{name}.ron\")")) + "\nOpened(0,1,\"\")\n",
        header(1, "Builtin(\"cornell\")") + &format!("\nDo(1,0.0,{})\nEnd(1,1)\n", ACTING.replace('\n', " ")),
    ] {
        std::fs::write(path.join("a.rec"), text).unwrap();
        assert!(says(path, "--replay a.rec -o out.png", 1).err.starts_with("error: a.rec"));
    }
    // What a session logs for those who look for it.
    let text =
        header(1, "Builtin(\"cornell\")") + &format!("\nOpened(0,1,\"\")\nDo(1,0.0,Open(path:\"{name}\"))\nEnd(2,1)\n");
    std::fs::write(path.join("a.rec"), text).unwrap();
    let said = run(path, &["--replay", "a.rec", "-o", "out.png"], Some("firstlight=trace"));
    said.check("a log");
    assert!(said.status == Some(0) && said.err.contains("Error: ") && said.err.contains("\\u{1b}[2J"), "{}", said.err);
}

#[test]
fn what_was_typed() {
    let folder = tempfile::tempdir().unwrap();
    let long = "z".repeat(100_000);
    std::fs::write(folder.path().join("file"), "no folder").unwrap();
    for word in [ACTING, &long] {
        let file = format!("{word}.ron");
        for args in [
            &[word][..],
            &["info", word],
            &["info", &file],
            &["render", "cornell", "-o", word],
            &["render", "cornell", "-o", "a.png", "--size", word],
            &["render", "cornell", "-o", "a.png", "--spp", word],
            &["render", "cornell", "-o", "a.png", "--region", word],
            &["render", "cornell", "-o", "a.png", "--integrator", word],
            &["render", "cornell", "-o", "a.png", word],
            &["render", "cornell", "-o", &format!("file/{word}/a.png")],
            &["explain", "cornell", "--pixel", word],
            &["stability", "--case", word],
            &["report", word],
            &["merge", word, word, "-o", "a.exr"],
            &["simplify", word, "-o", "a.obj", "--ratio", "0.5"],
            &["--replay", word],
            &["--threads", word],
            &[&format!("--{word}")],
        ] {
            let said = run(folder.path(), args, None);
            said.check(&format!("{:.200}", format!("{args:?}")));
            assert!(
                matches!(said.status, Some(1 | 2)) && said.err.starts_with("error: "),
                "{args:.200?}: {}",
                said.err
            );
            assert!(said.err.len() < 4000, "{:.200}: {} bytes", format!("{args:?}"), said.err.len());
        }
    }
}

#[cfg(unix)]
#[test]
fn file_names_and_what_is_not_utf_8() {
    use std::os::unix::ffi::OsStrExt;
    let folder = tempfile::tempdir().unwrap();
    let name = format!("{}.ron", ACTING.replace('/', "_"));
    std::fs::write(folder.path().join(&name), format!("({CAMERA}, film: 3)")).unwrap();
    let said = run(folder.path(), &["info", &name], None);
    said.check("a bad scene of that name");
    assert!(said.status == Some(1) && said.err.contains("\\u{1b}[2J"), "{}", said.err);
    std::fs::write(folder.path().join(&name), format!("({CAMERA})")).unwrap();
    let said = run(folder.path(), &["info", &name], None);
    said.check("a good scene of that name");
    assert!(said.status == Some(0) && said.out().starts_with("\\u{1b}[2J"), "{}", said.out());
    let odd = OsStr::from_bytes(b"a\xff\x1b[2J.png");
    run(folder.path(), &[OsStr::new("render"), OsStr::new("cornell"), OsStr::new("--size"), odd], None).check("a size");
    run(folder.path(), &[OsStr::new("info"), odd], None).check("a picture");
    let said = run(
        folder.path(),
        &[OsStr::new("render"), OsStr::new(&name), OsStr::new("-o"), odd, OsStr::new("--spp"), OsStr::new("1")],
        None,
    );
    said.check("a picture that is written");
    assert_eq!(said.status, Some(0), "{}", said.err);
}
