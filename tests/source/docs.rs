//! The documentation: links lead somewhere, commands run, scenes open, every field and option is described, and lines,
//! pages and words keep to the rules.
//!
//! A block that cannot be run has a comment above it: `<!-- not run: reason -->`. Commands run in a folder per page, in
//! the order of the page, with small images and short times (see [`cheap`]). Start reading at [`Page`].

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Component, Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::Mutex;
use std::thread;

const MAX_COLUMNS: usize = 120;
const MAX_LINES: usize = 150;

/// Pages that may be longer than [`MAX_LINES`]: generated, or figures as they were measured.
const LONG: [&str; 2] = ["docs/keys.md", "docs/measurements/"];

/// Their words are those of the table of keys in the sources.
const GENERATED: &str = "docs/keys.md";

/// Words that have a better one; see the right column.
const RETIRED: [(&str, &str); 52] = [
    ("lamp", "light"),
    ("lamps", "lights"),
    ("ball", "sphere"),
    ("balls", "spheres"),
    ("matte", "diffuse"),
    ("eye", "camera"),
    ("eyes", "cameras"),
    ("surroundings", "environment"),
    ("sky", "environment"),
    ("skies", "environments"),
    ("picture", "image"),
    ("pictures", "images"),
    ("density", "pdf"),
    ("densities", "pdfs"),
    ("chance", "probability, or at random"),
    ("house", "architecture"),
    ("judge", "reference intersector"),
    ("verdict", "check result"),
    ("ladder", "convergence curve"),
    ("rung", "step"),
    ("rungs", "steps"),
    ("scouts", "pilot paths"),
    ("arrivals", "lens connections"),
    ("foretold", "predicted"),
    ("hasty", "preview"),
    ("sieve", "quad filter"),
    ("crowd", "many instances"),
    ("crowds", "many instances"),
    ("slack", "error bound"),
    ("wobble", "error bound"),
    ("paint", "colour parameter"),
    ("anew", "again"),
    ("whoever", "any"),
    ("lately", "recently"),
    ("begin again", "restart"),
    ("begins again", "restarts"),
    ("go on with", "resume"),
    ("goes on with", "resumes"),
    ("going on with", "resuming"),
    ("gone on with", "resumed"),
    ("take back", "undo"),
    ("taken back", "undone"),
    ("in earnest", "exactly"),
    ("samples a pixel", "samples per pixel"),
    ("sample a pixel", "sample per pixel"),
    ("bytes a pixel", "bytes per pixel"),
    ("rays a pixel", "rays per pixel"),
    ("rays a second", "rays per second"),
    ("paths a second", "paths per second"),
    ("frames a second", "frames per second"),
    ("ns a ray", "ns per ray"),
    ("visits a ray", "visits per ray"),
];

/// A Markdown file of the project.
struct Page {
    /// From the root, with `/`.
    path: String,
    text: String,
}

/// A fenced block.
struct Block {
    language: String,
    /// Of its fence, from 1.
    line: usize,
    text: String,
    /// A comment above it says that it is not run.
    is_skipped: bool,
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn read(path: &str) -> Page {
    let text = fs::read_to_string(root().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"));
    Page { path: path.to_owned(), text }
}

/// Files below `folder` whose name ends as asked, in order.
fn files(folder: &str, endings: &[&str]) -> Vec<String> {
    let mut found = Vec::new();
    let mut open = vec![root().join(folder)];
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.strip_prefix(root()).unwrap().to_string_lossy().replace('\\', "/");
            if path.is_dir() {
                open.push(path);
            } else if endings.iter().any(|ending| name.ends_with(ending)) {
                found.push(name);
            }
        }
    }
    found.sort();
    found
}

/// README and the book.
fn pages() -> Vec<Page> {
    let mut pages = vec![read("README.md")];
    pages.extend(files("docs", &[".md"]).iter().map(|path| read(path)));
    assert!(pages.len() > 10);
    pages
}

impl Page {
    /// Lines with their numbers from 1, and whether they belong to a fenced block.
    fn lines(&self) -> impl Iterator<Item = (usize, &str, bool)> {
        let mut is_code = false;
        self.text.lines().enumerate().map(move |(i, line)| {
            let is_fence = line.trim_start().starts_with("```");
            let was_code = is_code;
            is_code ^= is_fence;
            (i + 1, line, was_code || is_fence)
        })
    }

    /// Lines outside of fenced blocks.
    fn prose(&self) -> impl Iterator<Item = (usize, &str)> {
        self.lines().filter(|(.., is_code)| !is_code).map(|(number, line, _)| (number, line))
    }

    fn blocks(&self) -> Vec<Block> {
        let mut blocks: Vec<Block> = Vec::new();
        let (mut before, mut is_open) = ("", false);
        for (i, line) in self.text.lines().enumerate() {
            match line.trim_start().strip_prefix("```") {
                Some(_) if is_open => is_open = false,
                Some(language) => {
                    is_open = true;
                    let is_skipped = before.starts_with("<!-- not run: ");
                    blocks.push(Block { language: language.to_owned(), line: i + 1, text: String::new(), is_skipped });
                }
                None if is_open => {
                    let block = blocks.last_mut().unwrap();
                    block.text.push_str(line);
                    block.text.push('\n');
                }
                None => {}
            }
            if !line.trim().is_empty() {
                before = line.trim();
            }
        }
        assert!(!is_open, "{}: a block is not closed", self.path);
        blocks
    }

    /// What `#…` may name: headings as GitHub turns them into anchors.
    fn anchors(&self) -> BTreeSet<String> {
        let mut seen: BTreeMap<String, usize> = BTreeMap::new();
        let headings = self.prose().filter_map(|(_, line)| line.strip_prefix('#')).map(|line| {
            let plain = line.trim_start_matches('#').trim().to_lowercase();
            let kept = plain.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
            kept.map(|c| if c == ' ' { '-' } else { c }).collect::<String>()
        });
        let number = |anchor: String| {
            let n = seen.entry(anchor.clone()).or_default();
            *n += 1;
            if *n == 1 { anchor } else { format!("{anchor}-{}", *n - 1) }
        };
        headings.map(number).collect()
    }

    /// Targets of links and images, with their lines.
    fn links(&self) -> Vec<(usize, String)> {
        let mut links = Vec::new();
        for (number, line) in self.prose() {
            let line = without_code(line);
            for (at, _) in line.match_indices("](") {
                let target = line[at + 2..].split(')').next().unwrap_or_default();
                links.push((number, target.split_whitespace().next().unwrap_or_default().to_owned()));
            }
            if let Some(target) = line.starts_with('[').then(|| line.split_once("]: ")).flatten() {
                links.push((number, target.1.trim().to_owned()));
            }
        }
        links
    }
}

/// A line without its code spans.
fn without_code(line: &str) -> String {
    line.split('`').step_by(2).collect::<Vec<_>>().join(" ")
}

/// A path without `.` and `..`.
fn plain_path(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => {
                plain.pop();
            }
            Component::CurDir => {}
            part => plain.push(part),
        }
    }
    plain
}

/// Fails with all problems at once.
fn expect_none(problems: Vec<String>) {
    assert!(problems.is_empty(), "\n{}\n", problems.join("\n"));
}

/// What a relative link that leads nowhere is called.
fn broken_link(page: &Page, target: &str) -> Option<String> {
    if target.contains("://") || target.starts_with("mailto:") {
        return None;
    }
    let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
    let folder = Path::new(&page.path).parent().unwrap();
    let path = if file.is_empty() { PathBuf::from(&page.path) } else { plain_path(&folder.join(file)) };
    if !root().join(&path).exists() {
        return Some(format!("there is no {}", path.display()));
    }
    let path = path.to_string_lossy().replace('\\', "/");
    let is_known = anchor.is_empty() || read(&path).anchors().contains(anchor);
    (!is_known).then(|| format!("{path} has no heading #{anchor}"))
}

#[test]
fn links_lead_somewhere() {
    let mut pages = pages();
    pages.push(read("ARCHITECTURE.md"));
    let mut problems = Vec::new();
    for page in &pages {
        for (line, target) in page.links() {
            problems.extend(broken_link(page, &target).map(|why| format!("{}:{line}: {target}: {why}", page.path)));
        }
    }
    expect_none(problems);
}

#[test]
fn a_broken_link_would_be_found() {
    let text = "# A b\n[x](#a-b) [y](README.md) ![z](docs/none.jpg) `[v](none)`\n\n[w]: README.md#none\n";
    let page = Page { path: "README.md".to_owned(), text: text.to_owned() };
    let broken: Vec<String> = page.links().into_iter().filter_map(|(_, target)| broken_link(&page, &target)).collect();
    // The page on disk has no heading `A b`.
    assert_eq!(broken.len(), 3, "{broken:?}");
    assert!(page.anchors().contains("a-b"));
}

#[test]
fn the_index_leads_to_every_page() {
    let names = |path: &str| -> BTreeSet<String> {
        let page = read(path);
        let folder = Path::new(path).parent().unwrap().to_owned();
        let target = |(_, link): (usize, String)| {
            let file = link.split('#').next().unwrap_or_default();
            plain_path(&folder.join(file)).to_string_lossy().replace('\\', "/")
        };
        page.links().into_iter().map(target).collect()
    };
    let (book, runs) = (names("docs/README.md"), names("docs/measurements/README.md"));
    let is_missing = |path: &String| !path.ends_with("README.md") && !book.contains(path) && !runs.contains(path);
    expect_none(
        files("docs", &[".md"]).into_iter().filter(is_missing).map(|path| format!("no index has {path}")).collect(),
    );
}

#[test]
fn what_the_source_calls_by_name_is_there() {
    let mut problems = Vec::new();
    for folder in ["src", "crates", "tests", "benches", "scripts", "examples"] {
        for path in files(folder, &[".rs", ".sh", ".py"]) {
            let text = fs::read_to_string(root().join(&path)).unwrap();
            for (at, _) in text.match_indices("docs/") {
                let is_name = |c: char| c.is_alphanumeric() || "-_./".contains(c);
                let name: String = text[at..].chars().take_while(|c| is_name(*c)).collect();
                let is_page = name.ends_with(".md") && path != "tests/source/docs.rs";
                if is_page && !root().join(&name).exists() {
                    problems.push(format!("{path}: there is no {name}"));
                }
            }
        }
    }
    expect_none(problems);
}

#[test]
fn lines_and_pages_are_short() {
    // ARCHITECTURE.md and CHANGELOG.md are not held to it yet.
    let mut problems = Vec::new();
    for page in pages() {
        let n = page.text.lines().count();
        if n > MAX_LINES && !LONG.iter().any(|long| page.path.starts_with(long)) {
            problems.push(format!("{}: {n} lines: split it at {MAX_LINES}", page.path));
        }
        for (number, line, _) in page.lines() {
            let columns = line.chars().count();
            if columns > MAX_COLUMNS && page.path != GENERATED {
                problems.push(format!("{}:{number}: {columns} columns: wrap it at {MAX_COLUMNS}", page.path));
            }
        }
    }
    expect_none(problems);
}

/// Names of scenes, which may have words that are retired elsewhere.
fn scene_names() -> BTreeSet<String> {
    let name = |path: &String| path.trim_start_matches("assets/scenes/").trim_end_matches(".ron").to_owned();
    files("assets/scenes", &[".ron"]).iter().map(name).filter(|name| name.contains('-')).collect()
}

/// Retired words of a line of prose, each with what to say instead.
fn retired_words(line: &str, scenes: &BTreeSet<String>) -> Vec<(&'static str, &'static str)> {
    let mut text = without_code(line).to_lowercase();
    if text.starts_with("<!--") || (text.starts_with('[') && text.contains("]: ")) {
        return Vec::new();
    }
    // Targets of links are names of files.
    while let Some(at) = text.find("](") {
        let end = text[at..].find(')').map_or(text.len(), |end| at + end + 1);
        text.replace_range(at..end, " ");
    }
    for name in scenes {
        text = text.replace(name, " ");
    }
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let words: Vec<&str> = text.split(|c| !is_word(c)).filter(|word| !word.is_empty()).collect();
    let is_there = |phrase: &str| {
        let phrase: Vec<&str> = phrase.split(' ').collect();
        words.windows(phrase.len()).any(|found| found == phrase)
    };
    RETIRED.into_iter().filter(|(word, _)| is_there(word)).collect()
}

#[test]
fn words_are_those_of_the_field() {
    let scenes = scene_names();
    let mut problems = Vec::new();
    for page in pages().iter().filter(|page| page.path != GENERATED) {
        for (number, line) in page.prose() {
            for (word, better) in retired_words(line, &scenes) {
                problems.push(format!("{}:{number}: `{word}`: say {better}", page.path));
            }
        }
    }
    expect_none(problems);
}

#[test]
fn a_retired_word_would_be_found() {
    let scenes = scene_names();
    let found = |line| retired_words(line, &scenes).into_iter().map(|(word, _)| word).collect::<Vec<_>>();
    assert_eq!(found("The Lamp shines; 16 samples a pixel."), ["lamp", "samples a pixel"]);
    assert!(found("The scene cornell-balls, `lamp`, [lights](lamp.md), clamp").is_empty());
}

/// A folder that is removed in the end.
struct TempFolder(PathBuf);

impl TempFolder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("firstlight-docs-{}-{name}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    /// With the files that pages speak of: `model.obj`, `scene.ron`, `wood.png` and `environment.hdr`.
    fn with_files(name: &str) -> Self {
        let folder = Self::new(name);
        fs::write(folder.0.join("model.obj"), octahedron()).unwrap();
        fs::copy(root().join("assets/scenes/cornell.ron"), folder.0.join("scene.ron")).unwrap();
        let mut hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n".to_vec();
        hdr.extend([128, 120, 110, 129].repeat(8));
        fs::write(folder.0.join("environment.hdr"), hdr).unwrap();
        folder.expect("render cornell -o wood.png --size 16x16 --spp 1");
        folder
    }

    fn run(&self, words: &[String], environment: &[(String, String)]) -> Output {
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

    fn expect(&self, line: &str) {
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
fn octahedron() -> String {
    let corners = ["1 0 0", "0 1 0", "0 0 1", "-1 0 0", "0 -1 0", "0 0 -1"];
    let faces = ["1 2 3", "2 4 3", "4 5 3", "5 1 3", "2 1 6", "4 2 6", "5 4 6", "1 5 6"];
    let corners = corners.iter().map(|corner| format!("v {corner}\n"));
    corners.chain(faces.iter().map(|face| format!("f {face}\n"))).collect()
}

/// The commands of a block: lines without comments, those that end in `\` joined.
fn commands(text: &str) -> Vec<String> {
    let joined = text.replace("\\\n", " ");
    let lines = joined.lines().map(|line| line.split(" #").next().unwrap_or_default().trim());
    lines.filter(|line| !line.is_empty() && !line.starts_with('#')).map(str::to_owned).collect()
}

/// The words behind the program's name, and what is set in the environment; `None` for another program.
fn words_of(command: &str) -> Option<(Vec<String>, Vec<(String, String)>)> {
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
fn cheap(mut words: Vec<String>) -> Vec<String> {
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
        "info" | "merge" | "save" | "explain" | "simplify" | "stability" | "help" => {}
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
fn missing_file(command: &str) -> Option<String> {
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
fn failures(page: &Page) -> Vec<String> {
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
fn for_each_page(pages: Vec<Page>, work: fn(&Page) -> Vec<String>) -> Vec<String> {
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

/// A whole scene from what a page shows: top-level fields get a camera, and the names that they use.
fn whole_scene(text: &str) -> String {
    if text.trim_start().starts_with('(') {
        return text.to_owned();
    }
    let has = |field: &str| text.lines().any(|line| line.starts_with(field));
    let mut scene = format!("(\n{text}\n");
    if !has("camera:") {
        scene.push_str("camera: (eye: (0, 1, 5), look_at: (0, 0, 0)),\n");
    }
    if !has("materials:") {
        scene.push_str("materials: { \"white\": diffuse(albedo: 0.7), \"light\": emissive(radiance: 10) },\n");
    }
    if !has("environment:") {
        scene.push_str("environment: constant(1),\n");
    }
    scene + ")\n"
}

/// What goes wrong when the scenes of a page are opened.
fn bad_scenes(page: &Page) -> Vec<String> {
    let mut problems = Vec::new();
    let mut folder = None;
    for block in page.blocks().iter().filter(|block| block.language == "ron" && !block.is_skipped) {
        let name = format!("scenes-{}", page.path.replace(['/', '.'], "-"));
        let folder = folder.get_or_insert_with(|| TempFolder::with_files(&name));
        fs::write(folder.0.join("block.ron"), whole_scene(&block.text)).unwrap();
        for line in ["info block.ron", "render block.ron -o block.png --size 16x9 --spp 1"] {
            let words: Vec<String> = line.split(' ').map(str::to_owned).collect();
            let output = folder.run(&words, &[]);
            let said = String::from_utf8_lossy(&output.stderr);
            if !output.status.success() || said.contains("warning:") {
                problems.push(format!("{}:{}: {line}: {}", page.path, block.line, said.trim()));
                break;
            }
        }
    }
    problems
}

#[test]
fn every_scene_opens() {
    expect_none(for_each_page(pages(), bad_scenes));
}

#[test]
fn a_wrong_scene_would_be_found() {
    let text = "```ron\nobjects: [sphere(radius: 1, material: \"white\")],\n```\n\
                ```ron\nobjects: [sphere(radius: 1, materiel: \"white\")],\n```\n";
    let found = bad_scenes(&Page { path: "wrong.md".to_owned(), text: text.to_owned() });
    assert_eq!(found.len(), 1, "{found:?}");
}

/// The types that a scene file is read into; of the files without a list, all.
const GRAMMAR: [(&str, &[&str]); 7] = [
    ("src/scene/file/parts.rs", &[]),
    ("src/scene/sources.rs", &[]),
    ("crates/render/src/core/material.rs", &["Material", "Fresnel"]),
    ("crates/render/src/core/texture.rs", &["Wrap"]),
    ("crates/render/src/core/filter.rs", &["PixelFilter"]),
    ("crates/render/src/core/settings.rs", &["Integrator"]),
    ("crates/render/src/film/develop/curve.rs", &["ToneCurve"]),
];

/// Names that a scene file may have.
fn grammar_words() -> BTreeSet<String> {
    let mut words = BTreeSet::new();
    for (path, types) in GRAMMAR {
        let mut is_type = false;
        for line in read(path).text.lines() {
            if let Some(name) = line.strip_prefix("pub struct ").or_else(|| line.strip_prefix("pub enum ")) {
                let name: String = name.chars().take_while(|c| c.is_alphanumeric()).collect();
                is_type = types.is_empty() || types.contains(&name.as_str());
            }
            is_type &= line != "}";
            let line = line.trim().trim_start_matches("pub ");
            let name: String = line.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
            let after = &line[name.len()..];
            let is_field = after.starts_with(": ") && after.ends_with(',');
            let is_variant = name.starts_with(char::is_uppercase)
                && (after == "," || after.starts_with(" {") || after.starts_with('('));
            if is_type && !name.is_empty() && (is_field || is_variant) {
                words.insert(snake_case(&name));
            }
            // A variant on one line has its fields in braces.
            if let Some((_, fields)) = after.split_once("{ ").filter(|_| is_type && is_variant) {
                let names = fields.split(", ").filter_map(|field| field.split_once(": ")).map(|(name, _)| name);
                words.extend(names.map(str::to_owned));
            }
        }
    }
    words
}

fn snake_case(name: &str) -> String {
    let mut out = String::new();
    for c in name.chars() {
        if c.is_uppercase() && !out.is_empty() {
            out.push('_');
        }
        out.extend(c.to_lowercase());
    }
    out
}

#[test]
fn every_word_of_the_scene_file_is_described() {
    let book: String =
        ["scene-file", "scene-materials", "scene-objects"].map(|name| read(&format!("docs/{name}.md")).text).concat();
    let words = grammar_words();
    assert!(words.len() > 80 && words.contains("pivot_distance") && words.contains("ball_grid"), "{words:?}");
    // In code, alone or with its value: `name`, `name(…)`.
    let is_there = |word: &str| ["`", "("].iter().any(|end| book.contains(&format!("`{word}{end}")));
    let in_heading =
        |word: &str| book.lines().any(|line| line.trim_start_matches('#').trim() == word && line.starts_with('#'));
    let missing = words.iter().filter(|word| !is_there(word) && !in_heading(word));
    expect_none(missing.map(|word| format!("docs/scene-*.md: `{word}` is not described")).collect());
}

#[test]
fn every_option_is_described() {
    let page = read("docs/command-line.md").text;
    let folder = TempFolder::new("options");
    let mut problems = Vec::new();
    let commands = ["", "render", "info", "merge", "save", "explain", "simplify", "stability", "report"];
    for command in commands {
        let words: Vec<String> =
            [command, "--help"].into_iter().filter(|word| !word.is_empty()).map(str::to_owned).collect();
        let output = folder.run(&words, &[]);
        let help = String::from_utf8_lossy(&output.stdout).into_owned();
        let words = help.lines().filter(|line| line.trim_start().starts_with('-')).flat_map(str::split_whitespace);
        for option in words.filter(|word| word.starts_with("--")).map(|word| word.trim_end_matches(',')) {
            if !page.contains(&format!("`{option}`")) && !page.contains(&format!("`{option} ")) {
                problems.push(format!("docs/command-line.md: `{option}` of `firstlight {command}` is not described"));
            }
        }
    }
    expect_none(problems);
}

#[test]
fn measurements_say_where_they_come_from() {
    let mut problems = Vec::new();
    for path in files("docs/measurements", &[".md"]).into_iter().filter(|path| !path.ends_with("README.md")) {
        let name = path.trim_start_matches("docs/measurements/");
        let date: String = name.chars().take(10).map(|c| if c.is_ascii_digit() { '0' } else { c }).collect();
        let text = read(&path).text;
        if date != "0000-00-00" {
            problems.push(format!("{path}: begin its name with the date: YYYY-MM-DD-topic.md"));
        }
        for row in ["| Processor |", "| Commit |"] {
            if !text.contains(row) {
                problems.push(format!("{path}: has no row `{row}`"));
            }
        }
    }
    expect_none(problems);
}
