//! Commands that pages show are carried out.

use super::page::{Page, expect_none, pages, root};
use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};
use std::sync::Mutex;
use std::thread;

/// A folder that is removed in the end.
pub struct TempFolder(pub PathBuf);

impl TempFolder {
    pub fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("firstlight-docs-{}-{name}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    /// With the files that pages speak of: `model.obj`, `scene.ron`, `scene.pbrt`, `scene.xml`,
    /// `scene.json`, `wood.png` and `environment.hdr`.
    pub fn with_files(name: &str) -> Self {
        let folder = Self::new(name);
        fs::write(folder.0.join("model.obj"), octahedron()).unwrap();
        fs::write(folder.0.join("scene.pbrt"), "WorldBegin\nLightSource \"infinite\"\nShape \"sphere\"").unwrap();
        let mitsuba = "<scene version=\"3.0.0\"><default name=\"spp\" value=\"4\"/><emitter type=\"constant\"/>\
                       <shape type=\"sphere\"/></scene>";
        fs::write(folder.0.join("scene.xml"), mitsuba).unwrap();
        let tungsten = "{\"primitives\": [{\"type\": \"sphere\"}]}";
        fs::write(folder.0.join("scene.json"), tungsten).unwrap();
        fs::copy(root().join("assets/scenes/cornell.ron"), folder.0.join("scene.ron")).unwrap();
        let mut hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n".to_vec();
        hdr.extend([128, 120, 110, 129].repeat(8));
        fs::write(folder.0.join("environment.hdr"), hdr).unwrap();
        folder.expect("render cornell -o wood.png --size 16x16 --spp 1");
        folder
    }

    pub fn run(&self, words: &[String], environment: &[(String, String)]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_firstlight"));
        command.current_dir(&self.0).args(words).stdin(Stdio::null());
        // No window opens, and nobody's settings are read or changed.
        for name in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET", "RUST_LOG"] {
            command.env_remove(name);
        }
        for name in ["XDG_CONFIG_HOME", "XDG_CACHE_HOME", "XDG_RUNTIME_DIR", "HOME"] {
            command.env(name, self.0.join("home"));
        }
        command.envs(environment.iter().map(|(name, value)| (name, value)));
        command.output().unwrap()
    }

    pub fn expect(&self, line: &str) {
        let words: Vec<String> = line.split_whitespace().map(str::to_owned).collect();
        let output = self.run(&words, &[]);
        assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
    }
}

impl Drop for TempFolder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// A closed model of triangles.
pub fn octahedron() -> String {
    let corners = ["1 0 0", "0 1 0", "0 0 1", "-1 0 0", "0 -1 0", "0 0 -1"];
    let faces = ["1 2 3", "2 4 3", "4 5 3", "5 1 3", "2 1 6", "4 2 6", "5 4 6", "1 5 6"];
    let corners = corners.iter().map(|corner| format!("v {corner}\n"));
    corners.chain(faces.iter().map(|face| format!("f {face}\n"))).collect()
}

/// The commands of a block: lines without comments, those that end in `\` joined.
pub fn commands(text: &str) -> Vec<String> {
    let joined = text.replace("\\\n", " ");
    let lines = joined.lines().map(|line| line.split(" #").next().unwrap_or_default().trim());
    lines.filter(|line| !line.is_empty() && !line.starts_with('#')).map(str::to_owned).collect()
}

/// The words behind the program's name, and what is set in the environment; `None` for another program.
pub fn words_of(command: &str) -> Option<(Vec<String>, Vec<(String, String)>)> {
    let mut words: Vec<String> = command.split_whitespace().map(str::to_owned).collect();
    let is_name = |name: &str| !name.is_empty() && name.chars().all(|c| c.is_ascii_uppercase() || c == '_');
    let mut environment = Vec::new();
    while let Some((name, value)) =
        words.first().and_then(|word| word.split_once('=')).filter(|(name, _)| is_name(name))
    {
        environment.push((name.to_owned(), value.to_owned()));
        words.remove(0);
    }
    if words.first().is_some_and(|word| word == "firstlight") {
        words.remove(0);
    } else if command.starts_with("cargo run --release -- ") {
        words.drain(..4);
    } else {
        return None;
    }
    Some((words, environment))
}

/// The same command with a small image and little time.
pub fn cheap(mut words: Vec<String>) -> Vec<String> {
    let has = |words: &[String], option: &str| words.iter().any(|word| word == option);
    let set = |words: &mut Vec<String>, option: &str, value: &str| {
        if let Some(i) = words.iter().position(|word| word == option) {
            words[i + 1] = value.to_owned();
        }
    };
    if has(&words, "--help") || has(&words, "--version") {
        return words;
    }
    let first = words.first().cloned().unwrap_or_default();
    match first.as_str() {
        // Everything before `--help` is parsed.
        "stability" if !has(&words, "--list") => words.push("--help".to_owned()),
        "info" if has(&words, "--tree") => words.push("--help".to_owned()),
        "info" | "merge" | "pack" | "save" | "explain" | "simplify" | "stability" | "help" => {}
        _ => {
            for (option, value) in
                [("--time", "0.1"), ("--turntable", "2"), ("--frames", "2"), ("--region", "0,0,16,9")]
            {
                set(&mut words, option, value);
            }
            let keeps_size = has(&words, "--scale") || has(&words, "--resume");
            if has(&words, "--size") {
                set(&mut words, "--size", "32x18");
            } else if !keeps_size {
                words.extend(["--size".to_owned(), "32x18".to_owned()]);
            }
            if first == "report" {
                set(&mut words, "--spp", "2");
            }
        }
    }
    words
}

/// What is wrong with a command of another program: a script, bench, test or example that is not there.
pub fn missing_file(command: &str) -> Option<String> {
    let words: Vec<&str> = command.split_whitespace().collect();
    let script = words.iter().map(|word| word.trim_start_matches("./")).find(|word| word.starts_with("scripts/"));
    let named = |option: &str| words.windows(2).find(|pair| pair[0] == option).map(|pair| pair[1]);
    let candidates = [
        script.map(|script| vec![script.to_owned()]),
        named("--example").map(|name| vec![format!("examples/{name}.rs")]),
        named("--test").map(|name| vec![format!("tests/{name}.rs"), format!("tests/{name}/main.rs")]),
        named("--bench").map(|name| vec![format!("benches/{name}.rs"), format!("benches/{name}/main.rs")]),
        named("--manifest-path").map(|path| vec![path.to_owned()]),
    ];
    let missing = |paths: &Vec<String>| !paths.iter().any(|path| root().join(path).exists());
    candidates.into_iter().flatten().find(missing).map(|paths| format!("there is no {}", paths.join(" or ")))
}

/// What goes wrong when the commands of a page are carried out.
pub fn failures(page: &Page) -> Vec<String> {
    let mut problems = Vec::new();
    let mut folder = None;
    for block in page.blocks().iter().filter(|block| block.language == "sh") {
        let place = format!("{}:{}", page.path, block.line);
        for command in commands(&block.text) {
            let Some((words, environment)) = words_of(&command) else {
                problems.extend(missing_file(&command).map(|why| format!("{place}: {command}: {why}")));
                continue;
            };
            if block.is_skipped {
                continue;
            }
            let name = page.path.replace(['/', '.'], "-");
            let folder = folder.get_or_insert_with(|| TempFolder::with_files(&name));
            let output = folder.run(&cheap(words), &environment);
            if !output.status.success() {
                problems.push(format!("{place}: {command}: {}", String::from_utf8_lossy(&output.stderr).trim()));
            }
        }
    }
    problems
}

/// `work` for each of some pages, side by side.
pub fn for_each_page(pages: Vec<Page>, work: fn(&Page) -> Vec<String>) -> Vec<String> {
    let (open, problems) = (Mutex::new(pages), Mutex::new(Vec::new()));
    let next = || open.lock().unwrap().pop();
    thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                while let Some(page) = next() {
                    let found = work(&page);
                    problems.lock().unwrap().extend(found);
                }
            });
        }
    });
    problems.into_inner().unwrap()
}

#[test]
fn every_command_runs() {
    expect_none(for_each_page(pages(), failures));
}

#[test]
fn a_wrong_command_would_be_found() {
    let text = "```sh\nfirstlight render cornell -o a.png --sp 4   # no such option\nfirstlight info nothing\n\
                scripts/nothing\ncargo test --test nothing\nfirstlight info cornell\n```\n\
                <!-- not run: a reason -->\n```sh\nfirstlight nothing\n```\n";
    let found = failures(&Page { path: "wrong.md".to_owned(), text: text.to_owned() });
    assert_eq!(found.len(), 4, "{found:?}");
}
