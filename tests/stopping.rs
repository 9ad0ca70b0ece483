//! Ctrl+C is obeyed wherever a command is, at once where there is nothing to save; and what is wrong many times over with a
//! large file is told in a time that grows with the file alone.

use firstlight::scene::file::SceneFile;
use std::fmt::Write;
#[cfg(unix)]
use std::path::Path;
#[cfg(unix)]
use std::sync::atomic::{AtomicUsize, Ordering};
#[cfg(unix)]
use std::time::Duration;
use std::time::Instant;

const CAMERA: &str = "camera: (eye: (0, 0, 300), look_at: (0, 0, 0)), film: (width: 32, height: 32)";

/// Spheres that each stand for themselves, so many along a side.
#[cfg(unix)]
fn many_objects(side: u32) -> String {
    let mut text =
        format!("({CAMERA}, environment: constant(1), materials: {{ \"m\": diffuse(albedo: 0.5) }}, objects: [\n");
    for i in 0..side * side * side {
        let (x, y, z) = (i % side, i / side % side, i / side / side);
        let _ = writeln!(text, "sphere(center: ({x}, {y}, {z}), radius: 0.3, material: \"m\"),");
    }
    text + "])\n"
}

/// A wavy sheet of `2 side²` triangles.
#[cfg(unix)]
fn sheet(side: u32) -> String {
    let mut text = String::new();
    for i in 0..=side {
        for j in 0..=side {
            let (x, y) = (f64::from(i), f64::from(j));
            let _ = writeln!(text, "v {x} {y} {:.6}", 3.0 * (0.11 * x).sin() * (0.07 * y).cos());
        }
    }
    for i in 0..side {
        for j in 1..=side {
            let [a, b] = [i * (side + 1) + j, (i + 1) * (side + 1) + j];
            let _ = writeln!(text, "f {a} {b} {} {}", b + 1, a + 1);
        }
    }
    text
}

#[cfg(unix)]
#[test]
fn ctrl_c_ends_a_command_at_once_whatever_it_is_doing() {
    let (many, sheet) = (many_objects(100), sheet(1000));
    let cases = [
        ("render many.ron -o out.png --spp 1", &[0.2, 1.0, 2.5, 5.0][..]),
        ("info many.ron", &[0.5, 3.0]),
        ("save many.ron -o out.ron", &[4.0, 7.0]),
        ("render sheet.obj -o out.png --spp 1000000", &[0.3, 1.5, 4.0]),
        ("render sheet.obj -o out.png --turntable 1000 --spp 64", &[6.0]),
        ("simplify sheet.obj -o out.obj --ratio 0.1", &[0.5, 2.0, 5.0]),
        ("explain many.ron --pixel 3,4", &[1.5]),
        ("info --tree sheet.obj", &[3.0]),
        ("stability", &[1.0]),
    ];
    let (next, stopped) = (AtomicUsize::new(0), AtomicUsize::new(0));
    // Most of it is waiting.
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                let folder = tempfile::tempdir().unwrap();
                std::fs::write(folder.path().join("many.ron"), &many).unwrap();
                std::fs::write(folder.path().join("sheet.obj"), &sheet).unwrap();
                while let Some((line, delays)) = cases.get(next.fetch_add(1, Ordering::Relaxed)) {
                    for &delay in *delays {
                        let is_stopped = is_stopped(folder.path(), line, delay);
                        stopped.fetch_add(usize::from(is_stopped), Ordering::Relaxed);
                    }
                }
            });
        }
    });
    let stopped = stopped.into_inner();
    assert!(stopped >= 12, "only {stopped} were stopped: the files are too small for this machine");
}

/// Whether a command was interrupted when it had run so many seconds, at once and without a trace, or had ended.
#[cfg(unix)]
fn is_stopped(folder: &Path, line: &str, delay: f64) -> bool {
    let mut child = std::process::Command::new(assert_cmd::cargo::cargo_bin("firstlight"))
        .current_dir(folder)
        .args(line.split(' '))
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(Duration::from_secs_f64(delay));
    let pressed = Instant::now();
    // A command that is done already has obeyed.
    let _ = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    let status = child.wait().unwrap();
    let seconds = pressed.elapsed().as_secs_f64();
    let said = std::io::read_to_string(child.stderr.take().unwrap()).unwrap();
    eprintln!("{line}: after {delay} s, ended {seconds:.3} s later: {status}");
    assert!(seconds < 2.0, "{line}, after {delay} s: {seconds} s\n{said}");
    let is_stopped = status.code() == Some(130);
    if is_stopped {
        assert!(said.contains("stopped"), "{line}, after {delay} s: {said}");
    } else {
        // On a slow machine it has not come to its handler of signals, and ends as any other program.
        let has_not_begun = std::os::unix::process::ExitStatusExt::signal(&status) == Some(2) && said.is_empty();
        assert!(status.success() || has_not_begun, "{line}, after {delay} s: {status}\n{said}");
    }
    // Files are whole or not there.
    for entry in std::fs::read_dir(folder).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        assert!(!name.contains(".part"), "{line}, after {delay} s: {name} is left");
    }
    is_stopped
}

/// Seconds to read a scene with so many materials and as many objects that misspell them.
fn seconds_of_misspelt(n: usize) -> f64 {
    let mut text = format!("({CAMERA}, materials: {{\n");
    (0..n).for_each(|i| writeln!(text, "\"material_{i}\": diffuse(albedo: \"texure_{i}\"),").unwrap());
    text += "}, textures: {\n";
    (0..n).for_each(|i| writeln!(text, "\"texture_{i}\": checker(a: 0, b: 1),").unwrap());
    text += "}, objects: [\n";
    (0..n).for_each(|i| writeln!(text, "sphere(radius: 1, material: \"materal_{i}\"),").unwrap());
    text += "])\n";
    let start = Instant::now();
    let error = SceneFile::parse(&text, "scene.ron").unwrap_err();
    let seconds = start.elapsed().as_secs_f64();
    let said = error.to_string();
    assert!(said.contains("texture `texure_7` is not defined (did you mean `texture_7`?)"), "{said}");
    assert!(said.ends_with(&format!("and {} more problems", 2 * n - 20)), "{said}");
    seconds
}

#[test]
fn twenty_thousand_misspelt_names_are_told_soon() {
    let [few, many] = [5_000, 20_000].map(seconds_of_misspelt);
    // Four times as many, of each: a product would take sixteen times as long.
    assert!(many < 12.0 * few.max(0.1), "{few} s, {many} s");
}

#[test]
fn a_file_that_is_missing_for_many_objects_is_told_soon() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.ron");
    let seconds = [2_000, 8_000].map(|n| {
        let mut text = format!("({CAMERA}, objects: [\n");
        (0..n).for_each(|i| writeln!(text, "mesh(source: obj(\"gone-{}.obj\")),", i / 2).unwrap());
        std::fs::write(&path, text + "])\n").unwrap();
        let source = firstlight::scene::SceneSource::Scene(path.clone());
        let start = Instant::now();
        let error = firstlight::scene::load(&source, &Default::default()).unwrap_err();
        let seconds = start.elapsed().as_secs_f64();
        assert_eq!(error.problems.len(), 21, "{error}");
        // Each file once.
        assert!(error.to_string().ends_with(&format!("and {} more problems", n / 2 - 20)), "{error}");
        seconds
    });
    assert!(seconds[1] < 12.0 * seconds[0].max(0.1), "{seconds:?}");
}
