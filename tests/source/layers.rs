//! Imports point down: from package to package, from folder to folder, and without cycles between the files of one package.
//!
//! Reads the `use` lines outside of tests, and all paths in the code; re-exports lead to the file that they stand for.
//! ARCHITECTURE.md draws the layers.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

const SIMD: &str = "crates/simd/src";
const KDTREE: &str = "crates/kdtree/src";
const GEOMETRY: &str = "crates/kdtree/src/geometry";
const MESH: &str = "crates/mesh/src";
const SAMPLING: &str = "crates/render/src/sampling";
const CORE: &str = "crates/render/src/core";
const PREPARE: &str = "crates/render/src/prepare";
const SHADING: &str = "crates/render/src/shading";
const INTEGRATORS: &str = "crates/render/src/integrators";
const FILM: &str = "crates/render/src/film";
const DENOISE: &str = "crates/render/src/denoise";
const DRIVER: &str = "crates/render/src/driver";
const RENDER: &str = "crates/render/src";
const FILES: &str = "crates/files/src";
const CONSOLE: &str = "src/console";
const FORMAT: &str = "crates/format/src";
const IMPORT: &str = "crates/import/src";
const EXPORT: &str = "crates/export/src";
const SCENE: &str = "src/scene";
const FRAME: &str = "src/frame";
const EMBED: &str = "src/embed";

/// Each folder, and what it may import from, lower layers first. A package of `crates/` imports no other package than those
/// of its line; in `src` they may be imported everywhere.
const LAYERS: [(&str, &[&str]); 28] = [
    (SIMD, &[]),
    (GEOMETRY, &[SIMD]),
    (KDTREE, &[SIMD, GEOMETRY]),
    (MESH, &[GEOMETRY]),
    (SAMPLING, &[SIMD, GEOMETRY]),
    (CORE, &[SIMD, KDTREE, GEOMETRY, MESH, SAMPLING]),
    (PREPARE, &[SIMD, KDTREE, GEOMETRY, MESH, SAMPLING, CORE]),
    (SHADING, &[SIMD, KDTREE, GEOMETRY, MESH, SAMPLING, CORE, PREPARE]),
    (INTEGRATORS, &[SIMD, KDTREE, GEOMETRY, MESH, SAMPLING, CORE, PREPARE, SHADING]),
    (FILM, &[SIMD, KDTREE, GEOMETRY, MESH, SAMPLING, CORE, PREPARE, SHADING, INTEGRATORS]),
    // It knows slices, and what the film says of its variance and of surfaces.
    (DENOISE, &[SIMD, SAMPLING, FILM]),
    (DRIVER, &[SIMD, KDTREE, GEOMETRY, MESH, SAMPLING, CORE, PREPARE, SHADING, INTEGRATORS, FILM, DENOISE]),
    // `lib.rs`, which shows what the folders have.
    (RENDER, &[KDTREE, CORE, PREPARE, INTEGRATORS, FILM, DENOISE, DRIVER]),
    (FILES, &[]),
    (FORMAT, &[FILES, RENDER]),
    (IMPORT, &[FILES, FORMAT, RENDER, MESH, KDTREE, GEOMETRY]),
    (EXPORT, &[FILES, FORMAT, RENDER, MESH, KDTREE, GEOMETRY]),
    (CONSOLE, &[FILES]),
    (SCENE, &[FILES, CONSOLE, FORMAT, IMPORT, EXPORT]),
    (FRAME, &[FILES, CONSOLE, FORMAT, IMPORT, SCENE]),
    ("src/cluster", &[FILES, CONSOLE, FORMAT, IMPORT, SCENE, FRAME]),
    ("src/report", &[FILES, CONSOLE, SCENE, FRAME]),
    ("src/stability", &[FILES, CONSOLE, SCENE, FRAME]),
    (EMBED, &[FILES, FORMAT, SCENE, FRAME]),
    ("src/prelude", &[SCENE, FRAME, EMBED]),
    ("src/viewer", &[FILES, CONSOLE, FORMAT, IMPORT, SCENE, FRAME]),
    // It sees the rest as the library `firstlight`, as other programs do.
    ("src/cli", &[]),
    ("src", &[FILES, CONSOLE, FORMAT, IMPORT, SCENE, FRAME, EMBED]),
];

/// The folders in which no files may import each other in a circle.
const PACKAGES: [&str; 9] = [SIMD, KDTREE, MESH, RENDER, FILES, FORMAT, IMPORT, EXPORT, "src"];

/// The path of a module below `src`, in its parts.
type Module = Vec<String>;

struct Import {
    /// From the root of the package; with what is imported from the module at the end.
    path: Vec<String>,
    is_public: bool,
}

struct Package {
    files: BTreeMap<Module, PathBuf>,
    imports: BTreeMap<Module, Vec<Import>>,
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn rust_files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            rust_files(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

/// `a::{b, c::{d, e as f}}` as `a::b`, `a::c::d` and `a::c::e`.
fn expand(tree: &str) -> Vec<String> {
    let Some(open) = tree.find('{') else {
        return vec![tree.split(" as ").next().unwrap_or_default().trim().to_owned()];
    };
    let (mut parts, mut depth) = (vec![String::new()], 0);
    for c in tree[open + 1..].chars() {
        match c {
            '}' if depth == 0 => break,
            ',' if depth == 0 => {
                parts.push(String::new());
                continue;
            }
            '{' => depth += 1,
            '}' => depth -= 1,
            _ => {}
        }
        parts.last_mut().unwrap().push(c);
    }
    let prefix = tree[..open].trim();
    let parts = parts.iter().filter(|part| !part.trim().is_empty());
    parts.flat_map(|part| expand(&format!("{prefix}{}", part.trim()))).collect()
}

/// The code of a file without comments and tests, with as many lines.
fn code_of(text: &str) -> String {
    let text = text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
    text.lines().map(|line| line.split("//").next().unwrap_or_default().to_owned() + "\n").collect()
}

/// All `use` lines: where, whether they are public, and each path.
fn use_lines(code: &str) -> Vec<(usize, bool, String)> {
    let mut found = Vec::new();
    let mut at = 0;
    for line in code.split_inclusive('\n') {
        let start = line.trim_start();
        let rest = start.strip_prefix("pub").map_or(start, |rest| match rest.strip_prefix('(') {
            Some(scope) => scope.split_once(')').map_or("", |(_, rest)| rest),
            None => rest,
        });
        if let Some(first) = rest.trim_start().strip_prefix("use ") {
            let from = at + line.len() - first.len();
            let body = code[from..].split(';').next().unwrap_or_default();
            let body = body.split_whitespace().collect::<Vec<_>>().join(" ");
            let number = code[..at].matches('\n').count() + 1;
            found.extend(expand(&body).into_iter().map(|path| (number, start.starts_with("pub"), path)));
        }
        at += line.len();
    }
    found
}

/// The code with its `use` lines left out.
fn without_use(code: &str) -> String {
    let mut kept = String::new();
    let mut rest = code;
    while let Some(at) = rest.match_indices("use ").map(|(at, _)| at).find(|&at| {
        let line = rest[..at].rsplit('\n').next().unwrap_or_default().trim_start();
        line.is_empty() || line.starts_with("pub")
    }) {
        kept += &rest[..at];
        rest = rest[at..].split_once(';').map_or("", |(_, after)| after);
    }
    kept + rest
}

/// All paths in code, such as `super::ray::Ray::new`.
fn inline_paths(code: &str) -> Vec<String> {
    let is_name = |c: char| c.is_alphanumeric() || c == '_';
    let mut found = Vec::new();
    let mut rest = code;
    while let Some(at) = rest.find("::") {
        let start = rest[..at].rfind(|c| !is_name(c)).map_or(0, |i| i + 1);
        let before = &rest[..start];
        let end = rest[start..].find(|c| !is_name(c) && c != ':').map_or(rest.len(), |i| start + i);
        if start < at && !before.ends_with('$') && !before.ends_with("(in ") {
            found.push(rest[start..end].trim_end_matches(':').to_owned());
        }
        rest = &rest[end..];
    }
    found
}

impl Package {
    fn read(name: &str) -> Self {
        Self::read_folder(&root().join(name))
    }

    fn read_folder(folder: &Path) -> Self {
        let mut paths = Vec::new();
        rust_files(folder, &mut paths);
        let mut files = BTreeMap::new();
        for path in paths.into_iter().filter(|path| !path.ends_with("main.rs") && !path.ends_with("tests.rs")) {
            let below = path.strip_prefix(folder).unwrap().with_extension("");
            let mut module: Module = below.iter().map(|part| part.to_string_lossy().into_owned()).collect();
            if matches!(module.last().map(String::as_str), Some("mod" | "lib")) {
                module.pop();
            }
            files.insert(module, path);
        }
        let mut package = Self { files, imports: BTreeMap::new() };
        for (module, path) in &package.files {
            let code = code_of(&std::fs::read_to_string(path).unwrap());
            let imports = use_lines(&code).into_iter().filter_map(|(_, is_public, path)| {
                let path = package.rooted(module, &path)?;
                Some(Import { path, is_public })
            });
            let mut imports: Vec<Import> = imports.collect();
            for path in inline_paths(&without_use(&code)) {
                let (first, below) = path.split_once("::").unwrap_or((&path, ""));
                let of_import = imports.iter().find(|import| {
                    import.path.last().is_some_and(|name| name == first) && package.files.contains_key(&import.path)
                });
                let path = match of_import {
                    Some(import) => {
                        Some([import.path.clone(), below.split("::").map(str::to_owned).collect()].concat())
                    }
                    None => package.rooted(module, &path),
                };
                imports.extend(path.map(|path| Import { path, is_public: false }));
            }
            package.imports.insert(module.clone(), imports);
        }
        package
    }

    /// A path in `module` from the root of the package, if it stays in the package.
    fn rooted(&self, module: &Module, path: &str) -> Option<Vec<String>> {
        let mut parts = path.split("::").map(str::to_owned).peekable();
        let first = parts.peek()?.clone();
        let mut base = module.clone();
        match first.as_str() {
            "crate" => {
                base.clear();
                parts.next();
            }
            "super" | "self" => {
                while let Some("super" | "self") = parts.peek().map(String::as_str) {
                    if parts.next()? == "super" {
                        base.pop();
                    }
                }
            }
            _ => {
                base.push(first);
                if !self.files.contains_key(&base) {
                    return None;
                }
                base.pop();
            }
        }
        base.extend(parts);
        Some(base)
    }

    /// The file in which what a path leads to is written.
    fn home(&self, path: &[String]) -> Option<Module> {
        let depth = (0..=path.len()).rev().find(|&n| self.files.contains_key(&path[..n]))?;
        let module = path[..depth].to_vec();
        let exported = path.get(depth).and_then(|name| {
            let mut imports = self.imports.get(&module)?.iter();
            imports.find(|import| import.is_public && import.path.last() == Some(name) && import.path != path)
        });
        match exported {
            Some(import) => self.home(&[&import.path, &path[depth + 1..]].concat()),
            None => Some(module),
        }
    }

    /// For each file, those that it imports from.
    fn arrows(&self) -> BTreeMap<Module, BTreeSet<Module>> {
        let of = |module: &Module| {
            let imports = self.imports[module].iter().filter_map(|import| {
                let home = self.home(&import.path)?;
                // A folder shows what is in it: that makes nothing depend on it.
                let shows_its_own = import.is_public && home.starts_with(module);
                // `lib.rs` holds nothing: what leads there is another package.
                (home != *module && !home.is_empty() && !shows_its_own).then_some(home)
            });
            imports.collect()
        };
        self.files.keys().map(|module| (module.clone(), of(module))).collect()
    }

    /// The largest set of files each of which leads to each other one; empty where there is no cycle.
    fn largest_knot(&self) -> Vec<Module> {
        let arrows = self.arrows();
        let reached = |from: &Module| {
            let (mut found, mut open) = (BTreeSet::new(), vec![from.clone()]);
            while let Some(module) = open.pop() {
                open.extend(arrows[&module].iter().filter(|&next| found.insert(next.clone())).cloned());
            }
            found
        };
        let reached: BTreeMap<&Module, BTreeSet<Module>> = arrows.keys().map(|from| (from, reached(from))).collect();
        let knot = |module: &Module| -> Vec<Module> {
            reached[module].iter().filter(|&other| reached[other].contains(module)).cloned().collect()
        };
        arrows.keys().map(knot).max_by_key(Vec::len).unwrap_or_default()
    }
}

impl Package {
    /// The folders that import from each other, with an arrow each way.
    fn mutual_folders(&self) -> Vec<String> {
        let folder = |module: &Module| self.files[module].parent().map(Path::to_owned).unwrap_or_default();
        let mut between: BTreeMap<(PathBuf, PathBuf), String> = BTreeMap::new();
        for (module, others) in self.arrows() {
            for other in others {
                let (from, to) = (folder(&module), folder(&other));
                if from != to {
                    let arrow = format!("{} → {}", module.join("/"), other.join("/"));
                    between.entry((from, to)).or_insert(arrow);
                }
            }
        }
        let both = between.iter().filter(|((a, b), _)| a < b);
        both.filter_map(|((a, b), there)| Some(format!("{there}, {}", between.get(&(b.clone(), a.clone()))?))).collect()
    }
}

/// The first layer of [`LAYERS`] that holds a place: a folder, or a file of that name.
fn layer_of(place: &str) -> Option<usize> {
    let holds =
        |layer: &str| place.strip_prefix(layer).is_some_and(|rest| rest.is_empty() || rest.starts_with(['/', '.']));
    let found = LAYERS.iter().enumerate().filter(|(_, (layer, _))| holds(layer));
    found.max_by_key(|(_, (layer, _))| layer.len()).map(|(i, _)| i)
}

/// The layer that a path leads to: `crate::scene::…` or `firstlight_kdtree::geometry::…`.
fn place_of(package: &str, path: &str) -> Option<String> {
    let (first, rest) = path.split_once("::")?;
    let package = match first {
        "crate" => package.to_owned(),
        other => format!("crates/{}/src", other.strip_prefix("firstlight_")?),
    };
    let below = format!("{package}/{}", rest.split("::").next().unwrap_or_default());
    Some(if layer_of(&below).is_some_and(|i| LAYERS[i].0 == below) { below } else { package })
}

/// What breaks the rule of [`LAYERS`] in a file.
fn wrong_arrows(package: &str, file: &str, code: &str) -> Vec<String> {
    let Some((own, allowed)) = layer_of(file).map(|i| LAYERS[i]) else { return Vec::new() };
    let is_name = |c: char| c.is_alphanumeric() || c == '_';
    let in_line = code.lines().enumerate().flat_map(|(i, line)| {
        let starts = line.match_indices("crate::").chain(line.match_indices("firstlight_"));
        let starts = starts.filter(move |&(at, _)| !line[..at].ends_with(|c| is_name(c) || c == '$'));
        let path = move |(at, _)| line[at..].split(|c| !is_name(c) && c != ':').next().unwrap_or_default().to_owned();
        starts.map(move |start| (i + 1, path(start)))
    });
    let in_use = use_lines(code).into_iter().map(|(line, _, path)| (line, path));
    // A path in full or the start of one: `crate::{` leads nowhere yet.
    let paths: BTreeSet<_> = in_use.chain(in_line).filter(|(_, path)| !path.ends_with("::")).collect();
    let mut wrong = BTreeSet::new();
    for (line, path) in paths {
        let Some(place) = place_of(package, &path) else { continue };
        // The whole engine is there for the root package, whose `lib.rs` only shows what the folders have.
        let is_below = own == place || place == "src" || allowed.contains(&place.as_str());
        let is_engine = package == "src" && place.starts_with("crates/");
        if !(is_below || is_engine) {
            let text = code.lines().nth(line - 1).unwrap_or_default().trim();
            wrong.insert(format!("{file}:{line}: {own} must not import from {place}: {text}"));
        }
    }
    wrong.into_iter().collect()
}

#[test]
fn imports_point_down() {
    let mut wrong = Vec::new();
    for package in PACKAGES {
        let mut files = Vec::new();
        rust_files(&root().join(package), &mut files);
        for path in files {
            let file = path.strip_prefix(root()).unwrap().to_string_lossy().replace('\\', "/");
            wrong.extend(wrong_arrows(package, &file, &code_of(&std::fs::read_to_string(&path).unwrap())));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn no_files_import_each_other_in_a_circle() {
    let mut wrong = Vec::new();
    for name in PACKAGES {
        let knot = Package::read(name).largest_knot();
        if !knot.is_empty() {
            let names: Vec<String> = knot.iter().map(|module| module.join("/")).collect();
            wrong.push(format!("{name}: {} files import each other in a circle: {}", knot.len(), names.join(" ")));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn no_folders_import_from_each_other() {
    let wrong: Vec<String> = PACKAGES.iter().flat_map(|name| Package::read(name).mutual_folders()).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// A circle through a name that a folder shows, one through `super`, and one through paths in the code.
#[test]
fn a_circle_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let write = |file: &str, text: &str| std::fs::write(folder.path().join(file), text).unwrap();
    std::fs::create_dir(folder.path().join("tree")).unwrap();
    write("lib.rs", "mod ray;\nmod tree;\n");
    write("tree/mod.rs", "mod leaf;\nmod node;\npub use leaf::Leaf;\n");
    write("tree/leaf.rs", "use crate::ray::Ray;\npub struct Leaf(Ray);\n");
    write("tree/node.rs", "use super::leaf::Leaf;\n");
    write("ray.rs", "pub struct Ray;\n");
    assert!(Package::read_folder(folder.path()).largest_knot().is_empty());
    write("ray.rs", "use crate::tree::Leaf;\npub struct Ray;\n");
    let names = |knot: Vec<Module>| knot.iter().map(|module| module.join("/")).collect::<Vec<_>>();
    assert_eq!(names(Package::read_folder(folder.path()).largest_knot()), ["ray", "tree/leaf"]);
    write("ray.rs", "pub struct Ray;\n");
    write("tree/leaf.rs", "use super::node::Node;\npub struct Leaf;\n");
    assert_eq!(names(Package::read_folder(folder.path()).largest_knot()), ["tree/leaf", "tree/node"]);
    write("tree/leaf.rs", "pub struct Leaf(super::node::Node);\n");
    assert_eq!(names(Package::read_folder(folder.path()).largest_knot()), ["tree/leaf", "tree/node"]);
    write("tree/leaf.rs", "use super::node;\npub fn leaf() { node::grow::<u8>(); }\n");
    assert_eq!(names(Package::read_folder(folder.path()).largest_knot()), ["tree/leaf", "tree/node"]);
    assert!(Package::read_folder(folder.path()).mutual_folders().is_empty());
    write("tree/node.rs", "pub fn grow() { crate::ray::cast() }\n");
    write("ray.rs", "pub fn cast() { crate::tree::node::grow() }\n");
    assert_eq!(Package::read_folder(folder.path()).mutual_folders(), ["ray → tree/node, tree/node → ray"]);
}

#[test]
fn a_wrong_arrow_is_named() {
    let wrong = wrong_arrows(
        "src",
        "src/scene/load.rs",
        "use std::fmt;\nuse crate::{\n    viewer::App,\n    frame::Film,\n};\n",
    );
    assert_eq!(wrong.len(), 2, "{wrong:?}");
    let one = |package, file, code: &str| wrong_arrows(package, file, code).join("\n");
    let found = one("src", "src/scene/load.rs", "use std::fmt;\nuse crate::viewer::App;\n");
    assert_eq!(found, "src/scene/load.rs:2: src/scene must not import from src/viewer: use crate::viewer::App;");
    let found = one("crates/mesh/src", "crates/mesh/src/weld.rs", "use firstlight_render::Film;");
    assert!(found.starts_with("crates/mesh/src/weld.rs:1: crates/mesh/src must not import from crates/render/src"));
    let found = one("crates/render/src", "crates/render/src/core/camera.rs", "use crate::film::tiles::Film;");
    assert!(found.contains("crates/render/src/core must not import from crates/render/src/film"), "{found}");
    let found = one("crates/render/src", "crates/render/src/core/camera.rs", "use crate::Film;");
    assert!(
        found.contains("must not import from crates/render/src:"),
        "a name of lib.rs hides where it leads: {found}"
    );
    assert!(
        one("crates/kdtree/src", "crates/kdtree/src/geometry/ray.rs", "use crate::Hit;").contains("must not import")
    );
    assert_eq!(one("crates/kdtree/src", "crates/kdtree/src/build.rs", "use crate::geometry::Aabb;"), "");
    assert_eq!(one("src", "src/viewer/app/mod.rs", "use firstlight_render::Film; use crate::frame::Session;"), "");
}
