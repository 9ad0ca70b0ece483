//! Files that are no files: pipes, devices, sockets and folders in the place of everything that a command reads, and
//! what is too long. Each is refused by its name, at once and with status 1.
#![cfg(unix)]

use crate::program::{Outcome, run};
use std::path::Path;

#[derive(Clone, Copy, Debug)]
enum NoFile {
    Pipe,
    Device,
    Socket,
    Folder,
    Loop,
}

impl NoFile {
    const ALL: [Self; 5] = [Self::Pipe, Self::Device, Self::Socket, Self::Folder, Self::Loop];

    fn make(self, path: &Path) {
        use std::os::unix::fs::symlink;
        use std::os::unix::net::UnixListener;
        match self {
            Self::Pipe => {
                let status = std::process::Command::new("mkfifo").arg(path).status().expect("mkfifo is there");
                assert!(status.success());
            }
            Self::Device => symlink("/dev/zero", path).unwrap(),
            // It stays when the listener is gone.
            Self::Socket => drop(UnixListener::bind(path).unwrap()),
            Self::Folder => std::fs::create_dir(path).unwrap(),
            Self::Loop => symlink(path, path).unwrap(),
        }
    }
}

#[test]
fn nothing_but_regular_files_is_read() {
    // The file, and a command that reads it.
    let failing = [
        ("a.ron", "info a.ron"),
        ("a.ron", "render a.ron -o out.png --spp 1"),
        ("a.obj", "info a.obj"),
        ("a.obj", "simplify a.obj -o out.obj --ratio 0.5"),
        ("a.obj", "info uses-mesh.ron"),
        ("a.png", "info a.png"),
        ("a.exr", "render a.exr -o out.png --spp 1"),
        ("a.exr", "merge a.exr a.exr -o out.exr"),
        ("a.exr", "render a.exr --resume -o out.png --spp 1"),
        ("a.exr", "report cornell --reference a.exr --spp 1"),
        ("a.rec", "--replay a.rec -o out.png"),
    ];
    // A material library or an image of a scene that cannot be read is a warning.
    let warning =
        [("a.mtl", "info uses-library.obj"), ("a.jpg", "info uses-texture.ron"), ("a.hdr", "info uses-sky.ron")];
    let all = failing.map(|case| (case, 1)).into_iter().chain(warning.map(|case| (case, 0)));
    for ((name, line), expected) in all {
        for kind in NoFile::ALL {
            let folder = tempfile::tempdir().unwrap();
            let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
            let scene = |fields: &str| format!("(camera: (eye: (0, 0, 5), look_at: (0, 0, 0)),\n{fields})");
            write("uses-mesh.ron", &scene("objects: [mesh(source: obj(\"a.obj\"))]"));
            write("uses-texture.ron", &scene("textures: { \"t\": image(file: \"a.jpg\") }"));
            write("uses-sky.ron", &scene("environment: image(file: \"a.hdr\")"));
            write("uses-library.obj", "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n");
            kind.make(&folder.path().join(name));
            let Outcome { status, err: said, .. } = run(folder.path(), line);
            assert_eq!(status, Some(expected), "{kind:?} {line}: {said}");
            assert!(said.lines().any(|line| line.contains(name)), "{kind:?} {line}: {said}");
        }
    }
}

#[test]
fn settings_and_views_that_are_no_files_stop_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let bookmarks = folder.path().join(".home/firstlight/bookmarks");
    std::fs::create_dir_all(&bookmarks).unwrap();
    // The name holds a hash of the scene's name, which the message tells.
    let line = "render cornell --bookmarks 1 --frames 1 -o out.png --spp 1";
    let source = firstlight::scene::SceneSource::Builtin("cornell".to_owned());
    let store = firstlight::frame::SettingsStore::in_folder(bookmarks.parent().unwrap());
    store.keep_bookmarks(&source, &firstlight::frame::SceneBookmarks::default()).unwrap();
    let file = std::fs::read_dir(&bookmarks).unwrap().next().unwrap().unwrap().path();
    for kind in NoFile::ALL {
        if file.is_dir() {
            std::fs::remove_dir(&file).unwrap()
        } else {
            std::fs::remove_file(&file).unwrap()
        }
        kind.make(&file);
        let Outcome { status, err: said, .. } = run(folder.path(), line);
        assert!(status == Some(1) && said.contains("cannot be read"), "{kind:?}: {said}");
        assert!(said.contains("has no bookmark 1"), "{kind:?}: {said}");
    }
}

#[test]
fn what_is_too_long_is_refused_before_it_is_read() {
    let folder = tempfile::tempdir().unwrap();
    for (name, line) in [
        ("a.ron", "info a.ron"),
        ("a.obj", "info a.obj"),
        ("a.exr", "info a.exr"),
        ("a.exr", "merge a.exr a.exr -o out.exr"),
        ("a.exr", "report cornell --reference a.exr --spp 1"),
        ("a.rec", "--replay a.rec -o out.png"),
    ] {
        let file = std::fs::File::create(folder.path().join(name)).unwrap();
        // Sparse: it takes no room on the disk.
        file.set_len(1 << 40).unwrap();
        let Outcome { status, err: said, .. } = run(folder.path(), line);
        assert_eq!(status, Some(1), "{line}: {said}");
        assert!(said.contains("is larger than") && said.contains("FIRSTLIGHT_LIMITS"), "{line}: {said}");
    }
}

const HEADER: &str =
    "(format:1,program:\"firstlight 0.1.0\",scene:Builtin(\"cornell\"),up:None,width:16,height:16,seed:0)";

#[test]
fn recordings_with_endless_lines_are_refused_by_the_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.rec");
    let long = "x".repeat(10 << 20);
    for (text, expected) in [
        (long.clone(), "a.rec: is not a recording"),
        (format!("{HEADER}\n{long}"), "a.rec:2: the line is longer than"),
        (format!("{HEADER}\n{long}\nEnd(1,1)\n"), "a.rec:2: the line is longer than"),
        (format!("{HEADER}\nDo(1,0.0,Open(path:\"{long}\"))\nEnd(1,1)\n"), "a.rec:2: the line is longer than"),
        (format!("{HEADER}\nDo(1,0.0,Nothing)\nEnd(1,1)\n"), "a.rec:2: cannot be parsed"),
        (String::new(), "a.rec: is not a recording"),
    ] {
        std::fs::write(&path, text).unwrap();
        let Outcome { status, err: said, .. } = run(folder.path(), "--replay a.rec -o out.png");
        assert!(status == Some(1) && said.contains(expected), "{expected}: {said}");
        assert!(said.len() < 1000, "a message is for people: {} bytes", said.len());
        assert!(!folder.path().join("out.png").exists());
    }
    std::fs::write(&path, b"\xff\xfe(\n").unwrap();
    assert!(run(folder.path(), "--replay a.rec -o out.png").err.contains("a.rec: is not a recording"));
}

#[test]
fn a_recording_with_a_byte_order_mark_or_a_cut_end_is_played() {
    let folder = tempfile::tempdir().unwrap();
    let lines = "Opened(0,1,\"\")\nEnd(1,1)\n";
    for text in [format!("\u{feff}{HEADER}\r\n{lines}"), format!("{HEADER}\n{lines}Do(2,0.")] {
        std::fs::write(folder.path().join("a.rec"), text).unwrap();
        let Outcome { status, err: said, .. } = run(folder.path(), "--replay a.rec -o out.png");
        assert_eq!(status, Some(0), "{said}");
        std::fs::remove_file(folder.path().join("out.png")).unwrap();
    }
}
