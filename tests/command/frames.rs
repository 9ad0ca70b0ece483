//! `render --frames`: numbered images of an animation, their films, parts, and videos.

use super::parts::{does, equal, fails};
use crate::program::{Outcome, program};
use firstlight::scene::ImageMetadata;
use std::path::Path;
use std::time::SystemTime;

const SMALL: &str = "--size 48x27 --spp 2 --threads 2";

fn time(path: &Path, name: &str) -> SystemTime {
    std::fs::metadata(path.join(name)).unwrap().modified().unwrap()
}

#[test]
fn frames_are_moments_and_parts_are_the_same_frames() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let said = does(path, &format!("render carousel {SMALL} --frames 20..24 -o f.png --film f.exr"));
    assert!(said.contains("f-0020.png to f-0023.png: 4 frames"), "{said}");
    // Frame 21 of 24 per second is at 0.875 s.
    does(path, &format!("render carousel {SMALL} --at 0.875 -o at.png --film at.exr"));
    let pixels = |name: &str| image::open(path.join(name)).unwrap().to_rgb8().into_raw();
    assert_eq!(pixels("f-0021.png"), pixels("at.png"));
    assert!(pixels("f-0020.png") != pixels("f-0021.png") && pixels("f-0021.png") != pixels("f-0022.png"));
    equal(path, "f-0021.exr", "at.exr");
    // An image of a frame opens at its moment.
    does(path, "render f-0022.png -o again.png");
    assert_eq!(pixels("f-0022.png"), pixels("again.png"));
    let metadata = ImageMetadata::read(&path.join("f-0022.png")).unwrap();
    assert!(metadata.text.unwrap().contains("at: 0.9166"));

    for part in [3, 1, 2] {
        let line = format!("render carousel {SMALL} --frames 20..24 -o p.png --film p.exr --part {part}/3");
        does(path, &line);
    }
    for number in 20..24 {
        equal(path, &format!("f-00{number}.png"), &format!("p-00{number}.png"));
        equal(path, &format!("f-00{number}.exr"), &format!("p-00{number}.exr"));
    }
}

#[test]
fn what_is_complete_stays_and_the_rest_is_rendered() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let line = format!("render carousel {SMALL} --frames 4 -o f.png --film f.exr");
    does(path, &line);
    let names = || (0..4).flat_map(|number| ["png", "exr"].map(|end| format!("f-000{number}.{end}")));
    let bytes = || names().map(|name| std::fs::read(path.join(name)).unwrap()).collect::<Vec<_>>();
    let whole = bytes();
    let before = time(path, "f-0000.png");
    // As after an interruption, and after copying to a disk that was full.
    for name in ["f-0001.png", "f-0001.exr", "f-0002.png"] {
        std::fs::remove_file(path.join(name)).unwrap();
    }
    std::fs::write(path.join("f-0003.png"), &whole[6][..whole[6].len() - 5]).unwrap();
    let said = does(path, &line);
    assert!(said.contains("4 frames, 1 complete already, replacing 1 existing file"), "{said}");
    assert_eq!(time(path, "f-0000.png"), before);
    assert!(bytes() == whole);
    // Other samples, another speed: other frames, which would lose the films.
    let said = fails(path, &format!("{line} --fps 12"), 1);
    assert!(said.contains(".exr: a film with a different") && said.contains("would be lost"), "{said}");
    let said = does(path, &format!("{line} --fps 12 --overwrite"));
    assert!(said.contains("4 frames, replacing 4 existing files"), "{said}");
    does(path, &format!("render carousel {SMALL} --frames 2..3 -o at24.png"));
    let pixels = |name: &str| image::open(path.join(name)).unwrap().to_rgb8().into_raw();
    assert_eq!(pixels("f-0001.png"), pixels("at24-0002.png"));
}

#[test]
fn what_makes_no_frames_is_told_before_anything_is_rendered() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    for (line, status, told) in [
        ("render cornell --frames 0..2 -o f.png", 1, "cornell has no animation"),
        ("render carousel --frames 5..5 -o f.png", 2, "has no frames"),
        ("render carousel --frames 0..2 --at 1 -o f.png", 2, "cannot be used with"),
        ("render carousel --frames 0..2 --fps 0 -o f.png", 2, "between 0.001 and 10000"),
        ("render carousel --bookmarks 1,2 --frames 0..4 -o f.png", 2, "--bookmarks needs --frames N"),
        ("render carousel --bookmarks 1,2 -o f.png", 2, "--frames"),
        ("render carousel --frames 0..2 -o -", 2, "write the frames to files"),
        ("render carousel --frames 0..2 -o f.exr --video f.mp4", 2, "--video is made of .png images"),
        ("render carousel -o f.png --video f.mp4", 2, "--video needs a sequence"),
        ("render carousel --frames 0..2 -o f.png --video f", 2, "needs an extension"),
        ("render carousel --frames 0..2 -o f.png --part 1/3", 2, "3 parts of 2 frames"),
    ] {
        let said = fails(path, line, status);
        assert!(said.contains(told), "{line}: {said}");
    }
    assert_eq!(std::fs::read_dir(path).unwrap().count(), 0);
}

/// A program in the place of ffmpeg that keeps its words and what it is sent.
#[cfg(unix)]
#[test]
fn a_video_is_made_of_the_frames_by_ffmpeg() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let line = format!("render carousel {SMALL} --frames 0..3 -o f.png --video f.mp4");
    let bin = path.join("bin");
    std::fs::create_dir(&bin).unwrap();
    let run = |line: &str| Outcome::of(program(path).args(line.split(' ')).env("PATH", &bin));
    let Outcome { status, err: said, .. } = run(&line);
    assert!(status != Some(0) && said.contains("--video needs the program ffmpeg, which was not found"), "{said}");
    assert!(!path.join("f-0000.png").exists());

    let program = bin.join("ffmpeg");
    let script =
        // More words than a pipe holds.
        "#!/bin/sh\n[ \"$1\" = -version ] && exit 0\necho \"$@\" > words\n/usr/bin/head -c 200000 /dev/zero >&2\n\
         for last; do :; done\n/bin/cat > \"$last\"\n";
    std::fs::write(&program, script).unwrap();
    // The temporary name of an older version, as the project of somebody else may have it.
    std::fs::write(path.join("thesis.txt"), "my only copy").unwrap();
    std::os::unix::fs::symlink("thesis.txt", path.join(".unfinished-f.mp4")).unwrap();
    std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).unwrap();
    let Outcome { status, err: said, .. } = run(&line);
    assert!(status == Some(0) && said.contains("f.mp4: 3 frames at 24 per second"), "{said}");
    let words = std::fs::read_to_string(path.join("words")).unwrap();
    assert!(words.contains("-f rawvideo -pix_fmt rgb24 -video_size 48x27 -framerate 24 -i -"), "{words}");
    assert_eq!(std::fs::read_to_string(path.join("thesis.txt")).unwrap(), "my only copy");
    std::fs::remove_file(path.join(".unfinished-f.mp4")).unwrap();
    let sent = std::fs::read(path.join("f.mp4")).unwrap();
    let frames = [0, 1, 2].map(|number| image::open(path.join(format!("f-000{number}.png"))).unwrap().to_rgb8());
    assert_eq!(sent, frames.map(|frame| frame.into_raw()).concat());
    // A failure is told in the words of ffmpeg, and leaves nothing that looks like a video.
    std::fs::write(&program, "#!/bin/sh\n[ \"$1\" = -version ] && exit 0\necho 'no such codec' >&2\nexit 1\n").unwrap();
    std::fs::remove_file(path.join("f.mp4")).unwrap();
    let Outcome { status, err: said, .. } = run(&line);
    assert!(status != Some(0) && said.contains("ffmpeg: no such codec"), "{said}");
    let left = || std::fs::read_dir(path).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let is_rest = |name: &String| name.contains("mp4") || name.contains(".part");
    assert_eq!(left().find(is_rest), None);
    // A stop ends it.
    let script = "#!/bin/sh\n[ \"$1\" = -version ] && exit 0\nfor last; do :; done\necho > \"$last\"\necho $$ > pid\nexec /bin/sleep 600\n";
    std::fs::write(&program, script).unwrap();
    let mut child = std::process::Command::new(assert_cmd::cargo::cargo_bin("firstlight"))
        .args(line.split(' '))
        .current_dir(path)
        .env("PATH", &bin)
        .spawn()
        .unwrap();
    let pid = loop {
        match std::fs::read_to_string(path.join("pid")) {
            Ok(pid) if pid.ends_with('\n') => break pid.trim().to_owned(),
            _ => assert!(child.try_wait().unwrap().is_none(), "ffmpeg was not run"),
        }
        std::thread::sleep(std::time::Duration::from_millis(10));
    };
    let signal = |name: &str, pid: &str| {
        let kill = std::process::Command::new("kill").args([name, pid]).stderr(std::process::Stdio::null()).status();
        kill.unwrap().success()
    };
    assert!(signal("-TERM", &child.id().to_string()));
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(!signal("-0", &pid), "ffmpeg still runs");
    assert_eq!(left().find(is_rest), None);
}
