//! Scenes that pages show are opened.

use super::commands::{TempFolder, for_each_page};
use super::page::{Page, expect_none, pages};
use std::fs;

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
