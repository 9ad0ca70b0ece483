//! Folders of jobs: names that try to run commands, folders that are not new, and jobs from others.

use super::parts::{does, fails};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const SCENE: &str =
    "(camera: (eye: (0, 0, 4), look_at: (0, 0, 0)), environment: constant(1), film: (width: 8, height: 8))";

/// Stems of scenes that are dangerous in a shell, in YAML, in JSON or in a template.
fn hostile_stems() -> Vec<String> {
    let fragments = [
        "x'||touch PWNED;#@SUBFOLDER@",
        "$(touch PWNED)",
        "`touch PWNED`",
        "\n touch PWNED\n#",
        "\";touch PWNED;\"",
        "'; touch PWNED; '",
        "@FOLDER@@PARTS@ @NAME@",
        "{{Param.Folder}} {{ touch PWNED }}",
        "-rf --help",
        "a: b\n- c",
        "& touch PWNED &",
        "| touch PWNED",
        "\\'$(touch PWNED)\\",
        "!! ~ * ? [a] 日本語 é \u{202e}",
        "%s %2f",
        "\t\r",
    ];
    let doubled = fragments.windows(2).map(|two| format!("{}{}", two[1], two[0]));
    fragments.iter().map(|&stem| stem.to_owned()).chain(doubled).collect()
}

/// A folder with programs of an engine that write down in which folder they run.
fn engine(folder: &Path) -> PathBuf {
    let stub = folder.join("stub");
    std::fs::create_dir(&stub).unwrap();
    let record = folder.join("record");
    for (tool, answer) in
        [("sbatch", "echo 42"), ("kubectl", "[ \"$1\" = logs ] && echo done || echo job/x"), ("prog", ":")]
    {
        let text = format!("#!/bin/bash\nprintf '%s\\0' \"$PWD\" >> '{}'\n{answer}\n", record.display());
        std::fs::write(stub.join(tool), text).unwrap();
        let mode = std::os::unix::fs::PermissionsExt::from_mode(0o755);
        std::fs::set_permissions(stub.join(tool), mode).unwrap();
    }
    record
}

fn run(folder: &Path, program: &Path, args: &[&str]) -> Output {
    let paths = format!("{}:{}", folder.join("stub").display(), std::env::var("PATH").unwrap());
    Command::new(program).args(args).current_dir(folder).env("PATH", paths).output().unwrap()
}

/// The folders in which programs ran since the last call.
fn ran_in(record: &Path) -> Vec<String> {
    let text = std::fs::read_to_string(record).unwrap_or_default();
    let _ = std::fs::remove_file(record);
    let mut folders: Vec<String> = text.split_terminator('\0').map(str::to_owned).collect();
    folders.dedup();
    folders
}

/// Whether a file `PWNED` is anywhere below.
fn is_pwned(folder: &Path) -> bool {
    std::fs::read_dir(folder).unwrap().flatten().any(|entry| {
        let is_folder = entry.file_type().unwrap().is_dir();
        entry.file_name() == "PWNED" || (is_folder && is_pwned(&entry.path()))
    })
}

fn firstlight() -> PathBuf {
    assert_cmd::cargo::cargo_bin("firstlight")
}

/// The string after a key of a YAML file, which is one of JSON.
fn string_of(yaml: &str, key: &str) -> String {
    let line =
        yaml.lines().find_map(|line| line.trim_start().strip_prefix(key)).unwrap_or_else(|| panic!("{key}: {yaml}"));
    serde_json::from_str(line.trim().trim_start_matches('[').trim_end_matches(']'))
        .unwrap_or_else(|e| panic!("{e}: {line}"))
}

#[cfg(target_os = "linux")]
#[test]
fn names_of_scenes_run_nothing_and_name_the_right_folder() {
    let folder = tempfile::tempdir().unwrap();
    let path = &folder.path().canonicalize().unwrap();
    let record = engine(path);
    let program = format!("{}/it's $(touch PWNED) @PARTS@", path.display());
    std::fs::copy(path.join("stub/prog"), &program).unwrap();
    for stem in hostile_stems() {
        let scene = format!("./{stem}.ron").replace('\r', "");
        std::fs::write(path.join(&scene), SCENE).unwrap();
        let stem = scene.strip_prefix("./").unwrap().strip_suffix(".ron").unwrap();
        let job = path.join(format!("firstlight-job-{stem}"));
        let args = ["submit", "slurm", &scene, "--parts", "2", "--spp", "4", "--program", &program];
        let output = run(path, &firstlight(), &args);
        assert!(output.status.success(), "{stem:?}: {output:?}");
        assert_eq!(ran_in(&record), [job.to_str().unwrap()], "{stem:?}");
        for script in ["part.sbatch", "merge.sbatch"] {
            let script = job.join(script);
            let output = run(&job, Path::new("bash"), &[script.to_str().unwrap(), "1"]);
            assert!(output.status.success(), "{stem:?}: {output:?}");
            assert_eq!(ran_in(&record), [job.to_str().unwrap()], "{stem:?}");
        }
        std::fs::remove_dir_all(&job).unwrap();
        // What is printed may be copied into a shell.
        let [image, claim] = ["image", "claim"].map(|option| format!("--{option}={stem}"));
        let args = ["submit", "kubernetes", &scene, "--parts", "2", "--spp", "4", &image, &claim];
        let output = run(path, &firstlight(), &args);
        assert!(output.status.success(), "{stem:?}: {output:?}");
        let output = run(path, Path::new("bash"), &[job.join("submit.sh").to_str().unwrap()]);
        assert!(output.status.success(), "{stem:?}: {output:?}");
        assert_eq!(ran_in(&record), [job.to_str().unwrap()], "{stem:?}");
        for name in ["parts.yaml", "merge.yaml"] {
            let yaml = std::fs::read_to_string(job.join(name)).unwrap();
            assert_eq!(string_of(&yaml, "subPath:"), job.file_name().unwrap().to_str().unwrap());
            assert_eq!(
                (string_of(&yaml, "image:"), string_of(&yaml, "claimName:")),
                (stem.to_owned(), stem.to_owned())
            );
        }
        std::fs::remove_dir_all(&job).unwrap();
        let args = ["submit", "openjd", &scene, "--parts", "2", "--spp", "4", "--program", &program];
        let output = run(path, &firstlight(), &args);
        assert!(output.status.success(), "{stem:?}: {output:?}");
        let yaml = std::fs::read_to_string(job.join("template.yaml")).unwrap();
        assert_eq!(string_of(&yaml, "default:"), program);
        std::fs::remove_dir_all(&job).unwrap();
        assert!(!is_pwned(path), "{stem:?}");
    }
    let args = ["submit", "slurm", "cornell", "--parts", "2", "--spp", "4", "-o=-x", "--camera=-y"];
    let output = run(path, &firstlight(), &args);
    assert!(output.status.success(), "{output:?}");
    assert_eq!(ran_in(&record), [path.join("-x").to_str().unwrap()]);
    let output = run(path, &firstlight(), &["submit", "slurm", "cornell", "--parts", "2", "--slurm=--a\ntouch PWNED"]);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
}

#[test]
fn a_job_gets_a_new_or_empty_folder() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    std::fs::create_dir(path.join("mine")).unwrap();
    std::fs::write(path.join("mine/submit.sh"), "mine").unwrap();
    let line = "submit slurm cornell --parts 2 --spp 4 --dry-run -o";
    let said = fails(path, &format!("{line} mine"), 1);
    assert!(said.contains("submit.sh") && said.contains("empty folder"), "{said}");
    assert_eq!(std::fs::read_to_string(path.join("mine/submit.sh")).unwrap(), "mine");
    #[cfg(unix)]
    {
        std::fs::create_dir_all(path.join("far")).unwrap();
        std::fs::create_dir(path.join("linked")).unwrap();
        std::os::unix::fs::symlink("../far", path.join("linked/scene")).unwrap();
        let said = fails(path, &format!("{line} linked"), 1);
        assert!(said.contains("such as scene") && said.contains("empty folder"), "{said}");
    }
    std::fs::create_dir(path.join("empty")).unwrap();
    does(path, &format!("{line} empty"));
    let said = fails(path, &format!("{line} empty"), 1);
    assert!(said.contains("has a job already"), "{said}");
}

#[test]
fn numbers_and_words_in_the_jobs_of_others_are_checked() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    does(path, "submit slurm cornell --parts 2 --spp 4 --dry-run -o job");
    let file = path.join("job/job.json");
    let text = std::fs::read_to_string(&file).unwrap();
    for (from, to, expected) in [
        ("\"parts\": 2", "\"parts\": 4294967295", "more than 1000000 parts"),
        ("\"parts\": 2", "\"frames\": [0, 4294967295], \"parts\": 2", "100000 frames"),
        ("\"scene\": \"cornell\"", "\"scene\": \"-h\"", "an option in place of a scene"),
        ("\"parts\": 2", "\"error\": -1, \"parts\": 2", "an error target that is not above 0"),
    ] {
        assert!(text.contains(from), "{text}");
        std::fs::write(&file, text.replace(from, to)).unwrap();
        for line in ["status job", "work job --merge", "work job --part 1/2"] {
            let output = super::parts::run_in(path, line, &[]);
            let said = String::from_utf8_lossy(&output.stderr).into_owned();
            assert!(!output.status.success() && said.contains(expected), "{line}: {said}");
        }
    }
    // Only options that `submit` writes: none that names an output, or that ends the options.
    let outer = path.join("outer");
    for option in
        ["--", "--film=../outer.exr", "--overwrite", "-o=../outer.png", "--frames=0..2", "--size", "--env=../e.hdr"]
    {
        std::fs::write(&file, text.replace("\"options\": []", &format!("\"options\": [{option:?}]"))).unwrap();
        for line in ["status job", "work job --merge", "work job --part 1/2"] {
            let output = super::parts::run_in(path, line, &[]);
            let said = String::from_utf8_lossy(&output.stderr).into_owned();
            assert!(said.contains(&format!("`{option}` is no option")), "{line}: {said}");
            let code = if line.starts_with("work") { 2 } else { 1 };
            assert_eq!(output.status.code(), Some(code), "{line}: {said}");
        }
        assert!(!outer.with_extension("exr").exists() && !outer.with_extension("png").exists(), "{option}");
    }
    // A million parts are counted at once.
    let many = text.replace("\"parts\": 2", "\"parts\": 1000000").replace("\"spp\": 4", "\"spp\": 1000000");
    let rounds = "[{\"samples\": [0, 1000000], \"since\": 0, \"merged\": false}]";
    std::fs::write(&file, many.replace("\"max_spp\": 16384", "\"max_spp\": 1000000")).unwrap();
    std::fs::write(path.join("job/rounds.json"), rounds).unwrap();
    let said = does(path, "status job");
    assert!(said.contains("0 of 1000000 parts done"), "{said}");
}

#[cfg(unix)]
#[test]
fn a_job_writes_through_no_link() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    does(path, "submit slurm cornell --size 8x8 --parts 2 --spp 4 --dry-run -o job");
    std::fs::write(path.join("mine.png"), "mine").unwrap();
    for part in [1, 2] {
        does(path, &format!("work job --part {part}/2"));
    }
    let link = path.join("job/all.png");
    std::os::unix::fs::symlink(path.join("mine.png"), &link).unwrap();
    let said = fails(path, "work job --merge", 2);
    assert!(said.contains("all.png") && said.contains("symbolic link"), "{said}");
    assert_eq!(std::fs::read_to_string(path.join("mine.png")).unwrap(), "mine");
    std::fs::remove_file(&link).unwrap();
    does(path, "work job --merge");
    // Frames of a job have no films, whatever it says.
    does(path, "submit slurm carousel --frames 0..2 --size 8x6 --parts 2 --spp 4 --dry-run -o moving");
    let file = path.join("moving/job.json");
    let text = std::fs::read_to_string(&file).unwrap();
    let forged = text.replace("\"options\": [", "\"options\": [\"--film=f.exr\",");
    assert!(forged != text && !text.contains("--frames"), "{text}");
    std::os::unix::fs::symlink("../mine.png", path.join("moving/f-0000.exr")).unwrap();
    std::fs::write(&file, forged).unwrap();
    let said = fails(path, "work moving --part 1/2", 2);
    assert!(said.contains("`--film=f.exr` is no option"), "{said}");
    assert_eq!(std::fs::read_to_string(path.join("mine.png")).unwrap(), "mine");
    std::fs::write(&file, text).unwrap();
    does(path, "work moving --part 1/2");
    assert!(path.join("moving/frames/frame-0000.png").is_file());
    // A folder that is a link leads out as well.
    std::fs::rename(path.join("job/parts"), path.join("elsewhere")).unwrap();
    std::os::unix::fs::symlink(path.join("elsewhere"), path.join("job/parts")).unwrap();
    std::fs::write(path.join("job/rounds.json"), "[{\"samples\": [0, 4], \"since\": 0, \"merged\": false}]").unwrap();
    let output = super::parts::run_in(path, "work job --part 1/2", &[]);
    assert!(
        !output.status.success() && String::from_utf8_lossy(&output.stderr).contains("symbolic link"),
        "{output:?}"
    );
}

/// A part that is rendered later would be of another scene.
#[test]
fn an_image_of_what_is_there_replaces_nothing_that_the_scene_reads() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    does(path, "render cornell -o t.png --spp 1 --size 8x8");
    std::fs::write(path.join("a.ron"), SCENE.replace("constant(1)", "image(file: \"t.png\")")).unwrap();
    does(path, "submit slurm a.ron --parts 2 --spp 4 -o job --dry-run");
    does(path, "work job --part 1/2");
    let texture = path.join("job/scene/t.png");
    let before = std::fs::read(&texture).unwrap();
    let said = fails(path, "status job --image job/scene/t.png", 2);
    assert!(said.contains("is also an input of this command"), "{said}");
    assert!(std::fs::read(&texture).unwrap() == before);
    for _ in 0..2 {
        does(path, "status job --image so-far.png");
    }
}

/// Samples of two scenes are not added up, and no time is spent on those of the second.
#[test]
fn a_later_round_renders_no_other_scene() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let ball = "materials: { \"m\": diffuse(albedo: 0.5) }, \
                objects: [sphere(center: (0, 0, 0), radius: 1, material: \"m\")], film:";
    std::fs::write(path.join("a.ron"), SCENE.replace("film:", ball)).unwrap();
    does(path, "submit slurm a.ron --size 8x8 --parts 1 --spp 4 --error 1e-9 -o job --dry-run");
    does(path, "work job --part 1/1");
    let said = does(path, "work job --merge");
    assert!(said.contains("round 2"), "{said}");
    let scene = path.join("job/scene/a.ron");
    let text = std::fs::read_to_string(&scene).unwrap();
    let changed = text.replace("constant(1)", "constant(2)");
    assert!(changed != text);
    std::fs::write(&scene, changed).unwrap();
    let said = fails(path, "work job --part 1/1", 2);
    assert!(said.contains("all.exr: the rounds before were rendered with a different scene"), "{said}");
    std::fs::write(&scene, text).unwrap();
    does(path, "work job --part 1/1");
}
