//! One image in many parts, through the program: what is complete is skipped, what was interrupted is resumed, and the films of
//! all parts add up to the film of one go, bit for bit.

use std::path::Path;
use std::process::{Command, Output};

const SMALL: &str = "--size 40x33";

pub fn run_in(folder: &Path, line: &str, variables: &[(&str, &str)]) -> Output {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin("firstlight"));
    command.current_dir(folder).args(line.split_whitespace()).env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
    for name in ["SLURM_ARRAY_TASK_ID", "JOB_COMPLETION_INDEX", "FIRSTLIGHT_PART", "FIRSTLIGHT_PARTS"] {
        command.env_remove(name);
    }
    command.envs(variables.iter().copied()).output().unwrap()
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned() + &String::from_utf8_lossy(&output.stdout)
}

pub fn does(folder: &Path, line: &str) -> String {
    let output = run_in(folder, line, &[]);
    assert!(output.status.success(), "{line}: {}", said(&output));
    said(&output)
}

pub fn fails(folder: &Path, line: &str, code: i32) -> String {
    let output = run_in(folder, line, &[]);
    assert_eq!(output.status.code(), Some(code), "{line}: {}", said(&output));
    said(&output)
}

pub fn equal(folder: &Path, a: &str, b: &str) {
    let [a_bytes, b_bytes] = [a, b].map(|name| std::fs::read(folder.join(name)).unwrap());
    assert!(a_bytes == b_bytes, "{a} and {b} differ");
}

#[test]
fn parts_add_up_to_the_film_of_one_go() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    // With light paths, and with a number of samples that is no power of two.
    for (scene, spp) in [("cornell-balls", 48), ("cornell", 21)] {
        let common = format!("{scene} {SMALL} --spp {spp}");
        does(path, &format!("render {common} --uniform -o whole.png --film {scene}.exr"));
        let names: Vec<String> = (1..=5)
            .map(|part| {
                does(path, &format!("render {common} --part {part}/5 --film {scene}-{{part}}.exr"));
                format!("{scene}-000{part}.exr")
            })
            .collect();
        does(path, &format!("merge {} -o {scene}-all.exr --samples 0..{spp}", names.join(" ")));
        equal(path, &format!("{scene}.exr"), &format!("{scene}-all.exr"));
    }
    // A part is a film as any other.
    let info = does(path, &format!("render cornell {SMALL} --spp 21 --part 2/5 --film cornell-0002.exr"));
    assert!(info.contains("part 2/5") && info.contains("is complete already"), "{info}");
}

#[test]
fn tiles_and_frames_are_parts_as_well() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let common = "cornell --size 100x70 --spp 4";
    does(path, &format!("render {common} --uniform -o whole.png --film whole.exr"));
    for part in 1..=5 {
        does(path, &format!("render {common} --part-by tiles --part {part}/5 --film t{part}.exr"));
    }
    let again = does(path, &format!("render {common} --part-by tiles --part 3/5 --film t3.exr"));
    assert!(again.contains("is complete already"), "{again}");
    fails(path, "merge t1.exr t2.exr t3.exr t4.exr -o four.exr", 1);
    does(path, "merge t4.exr t2.exr t3.exr t1.exr t5.exr -o all.exr");
    equal(path, "whole.exr", "all.exr");
    // Light paths fall on tiles of other parts.
    let caustics = "render cornell-balls --size 64x64 --spp 2 --part-by tiles --part 1/2 --film c.exr";
    assert!(fails(path, caustics, 2).contains("--part-by samples"));

    let sequence = "render cornell --size 24x16 --spp 2 --turntable 5";
    does(path, &format!("{sequence} -o whole/turn.png").replace("whole/", "w-"));
    for part in 1..=2 {
        does(path, &format!("{sequence} --part-by frames --part {part}/2 -o p-turn.png"));
    }
    for frame in 1..=5 {
        equal(path, &format!("w-turn-000{frame}.png"), &format!("p-turn-000{frame}.png"));
    }
    // A frame that is there stays, one that is gone or of other samples is rendered.
    let time = |frame: u32| std::fs::metadata(path.join(format!("p-turn-000{frame}.png"))).unwrap().modified().unwrap();
    let before = [time(1), time(2)];
    std::fs::remove_file(path.join("p-turn-0002.png")).unwrap();
    does(path, &format!("{sequence} --part-by frames --part 1/2 -o p-turn.png"));
    assert!(time(1) == before[0] && time(2) != before[1]);
    equal(path, "w-turn-0002.png", "p-turn-0002.png");
}

#[test]
fn a_part_is_told_by_engines_and_wrong_input_is_not_tried_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let line = format!("render cornell {SMALL} --spp 8 --part auto --film auto-{{part}}.exr");
    for variables in [
        &[("SLURM_ARRAY_TASK_ID", "11"), ("SLURM_ARRAY_TASK_MIN", "10"), ("SLURM_ARRAY_TASK_COUNT", "4")][..],
        &[("JOB_COMPLETION_INDEX", "1"), ("FIRSTLIGHT_PARTS", "4")],
        &[("FIRSTLIGHT_PART", "2"), ("FIRSTLIGHT_PARTS", "4")],
    ] {
        let output = run_in(path, &line, variables);
        assert!(output.status.success() && said(&output).contains("part 2/4, samples 2 to 3"), "{}", said(&output));
    }
    assert!(fails(path, &line, 2).contains("SLURM_ARRAY_TASK_ID"));
    std::fs::write(path.join("wrong.ron"), "(camera: 3)").unwrap();
    std::fs::write(path.join("other.exr"), "not a film").unwrap();
    let film = format!("cornell {SMALL} --spp 8 --film p.exr");
    for (line, why) in [
        ("render wrong.ron --spp 8 --part 1/2 --film p.exr".to_owned(), "wrong.ron"),
        ("render gone.ron --spp 8 --part 1/2 --film p.exr".to_owned(), "gone.ron"),
        (format!("render {film} --part 3/2"), "there is no part 3 of 2"),
        (format!("render {film} --part 1/9"), "9 parts of 8 samples"),
        (format!("render {film} --part 1/2 -o a.png"), "omit -o"),
        (format!("render cornell {SMALL} --spp 8 --part 1/2 --film other.exr"), "is not a firstlight film"),
        (format!("render cornell {SMALL} --spp 8 --part 1/2 --film gone/p.exr"), "there is no folder gone"),
        // A film of other samples, of another seed and of another scene.
        (format!("render cornell {SMALL} --spp 8 --part 1/4 --film auto-0002.exr"), "samples 2 to 3 of other parts"),
        (format!("render cornell {SMALL} --spp 8 --seed 7 --part 2/4 --film auto-0002.exr"), "a different seed"),
        (format!("render gallery {SMALL} --spp 8 --part 2/4 --film auto-0002.exr"), "a different scene"),
    ] {
        let said = fails(path, &line, 2);
        assert!(said.contains(why), "{line}: {said}");
    }
    // A damaged film is rendered again: what it had is lost.
    let whole = std::fs::read(path.join("auto-0002.exr")).unwrap();
    let mut damaged = whole.clone();
    let middle = damaged.len() / 2;
    damaged[middle] ^= 1;
    std::fs::write(path.join("auto-0002.exr"), damaged).unwrap();
    let said = does(path, &format!("render cornell {SMALL} --spp 8 --part 2/4 --film auto-0002.exr"));
    assert!(said.contains("damaged") && said.contains("rendered again"), "{said}");
    assert!(std::fs::read(path.join("auto-0002.exr")).unwrap() == whole);
}

#[cfg(unix)]
#[test]
fn a_part_that_is_stopped_is_resumed_from_its_last_film() {
    use std::process::Stdio;
    use std::time::{Duration, Instant};
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let line = "render cornell-balls --size 64x64 --spp 4096 --part 2/2 --film part.exr --save-every 0.1 --threads 1";
    let whole = line.replace("part.exr", "whole.exr");
    does(path, &whole);
    let spawn = || {
        let mut command = Command::new(assert_cmd::cargo::cargo_bin("firstlight"));
        command.current_dir(path).args(line.split(' ')).stderr(Stdio::piped()).spawn().unwrap()
    };
    // A film appears while it is rendered; killing the process loses what came after it, and nothing else.
    let wait_for_news = |child: &mut std::process::Child| {
        let start = Instant::now();
        let seen = std::fs::metadata(path.join("part.exr")).and_then(|info| info.modified()).ok();
        while child.try_wait().unwrap().is_none() && start.elapsed() < Duration::from_secs(60) {
            let now = std::fs::metadata(path.join("part.exr")).and_then(|info| info.modified()).ok();
            if now != seen {
                return;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
    };
    let mut codes = Vec::new();
    for signal in ["-KILL", "-TERM"] {
        let mut child = spawn();
        wait_for_news(&mut child);
        let _ = Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
        let output = child.wait_with_output().unwrap();
        codes.push((signal, output.status.code(), said(&output)));
    }
    assert!(codes[0].1.is_none(), "{codes:?}");
    let (_, code, said) = &codes[1];
    assert_eq!(*code, Some(75), "{said}");
    assert!(said.contains("stopped after") && said.contains("part.exr is saved"), "{said}");
    let said = does(path, line);
    assert!(said.contains("resuming part.exr"), "{said}");
    equal(path, "whole.exr", "part.exr");
    // Nobody else may work on it in the meantime.
    std::fs::remove_file(path.join("part.exr")).unwrap();
    let mut child = spawn();
    wait_for_news(&mut child);
    let busy = fails(path, line, 75);
    assert!(busy.contains("another process"), "{busy}");
    child.kill().unwrap();
    child.wait().unwrap();
}

/// Peak memory of a command, bytes.
#[cfg(target_os = "linux")]
fn peak_of(folder: &Path, line: &str) -> u64 {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin("firstlight"));
    let mut child = command.current_dir(folder).args(line.split(' ')).arg("--json").spawn().unwrap();
    let status = format!("/proc/{}/status", child.id());
    let mut peak = 0;
    while child.try_wait().unwrap().is_none() {
        let text = std::fs::read_to_string(&status).unwrap_or_default();
        let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let kilobytes = line.and_then(|line| line.split_whitespace().next()?.parse::<u64>().ok());
        peak = peak.max(kilobytes.unwrap_or(0) << 10);
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    assert!(child.wait().unwrap().success(), "{line}");
    peak
}

#[test]
fn two_hundred_parts_are_merged_at_once_or_in_groups() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let common = "cornell --size 33x20 --spp 240";
    does(path, &format!("render {common} --uniform -o whole.png --film whole.exr"));
    let parts = || (1..=240).map(|part| format!("p{part:04}.exr"));
    std::thread::scope(|scope| {
        for half in 0..2 {
            scope.spawn(move || {
                for part in (1..=240).filter(|part| part % 2 == half) {
                    does(path, &format!("render {common} --part {part}/240 --film p{{part}}.exr --threads 1"));
                }
            });
        }
    });
    let all: Vec<String> = parts().collect();
    does(path, &format!("merge {} -o all.exr --image all.png", all.join(" ")));
    equal(path, "whole.exr", "all.exr");
    equal(path, "whole.png", "all.png");
    // As an array job does it, with more groups than there is work for.
    let names = all.join(" ");
    for group in 1..=12 {
        does(path, &format!("merge {names} --part {group}/12 -o group-{{part}}.exr"));
    }
    let groups: Vec<String> = (1..=12).map(|group| format!("group-{group:04}.exr")).collect();
    let groups: Vec<String> = groups.into_iter().filter(|name| path.join(name).exists()).collect();
    assert!(groups.len() > 6, "{groups:?}");
    does(path, &format!("merge {} -o tree.exr", groups.join(" ")));
    equal(path, "whole.exr", "tree.exr");

    // What is missing and what is there twice is named.
    let without: Vec<&str> =
        all.iter().enumerate().filter(|(i, _)| ![7, 8, 100].contains(i)).map(|(_, name)| name.as_str()).collect();
    let said = fails(path, &format!("merge {} -o some.exr", without.join(" ")), 1);
    assert!(said.contains("samples 7 to 8 and 100 are missing") && said.contains("--allow-missing"), "{said}");
    let said = does(path, &format!("merge {} -o some.exr --allow-missing --json", without.join(" ")));
    assert!(said.contains("\"spp\":237") && said.contains("[7,9]") && said.contains("[100,101]"), "{said}");
    std::fs::copy(path.join("p0003.exr"), path.join("again.exr")).unwrap();
    let said = fails(path, &format!("merge {} again.exr -o some.exr", all.join(" ")), 1);
    assert!(said.contains("p0003.exr and again.exr") && said.contains("samples 2 to 2"), "{said}");
    let said = fails(path, &format!("merge {} -o short.exr --samples 0..256", all.join(" ")), 1);
    assert!(said.contains("samples 240 to 255 are missing"), "{said}");
}

/// A film of 1.5 million pixels has some 180 megabytes in memory: a third film beside the two that are added up would show.
#[cfg(target_os = "linux")]
#[test]
fn merging_many_films_takes_no_more_memory_than_merging_two() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    std::fs::write(
        path.join("grey.ron"),
        "(camera: (eye: (0, 0, 5), look_at: (0, 0, 0)), environment: constant(0.5), film: (width: 500, height: 350))",
    )
    .unwrap();
    for part in 1..=12 {
        does(path, &format!("render grey.ron --spp 12 --part {part}/12 --film p{part}.exr"));
    }
    let peak = |n: u32| {
        let names: Vec<String> = (1..=n).map(|part| format!("p{part}.exr")).collect();
        peak_of(path, &format!("merge {} -o all-{n}.exr", names.join(" ")))
    };
    let [two, all] = [peak(2), peak(12)];
    eprintln!("peak memory of merging 2 films: {two} bytes, of 12: {all} bytes");
    // A film of that size has 76 bytes per pixel in memory.
    assert!(all < two + 500 * 350 * 76, "{two} and {all} bytes");
}
