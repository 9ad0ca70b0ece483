//! `Ctrl+S` in the real window, where the scene has no file of its own to save to, and where an animation moves the camera.
#![cfg(all(feature = "viewer", target_os = "linux"))]

use crate::desktop::{Desktop, Program, until};
use crate::guest::seen;
use crate::program::does;
use std::path::Path;
use std::time::Duration;

fn saved(program: &Program, path: &Path) -> String {
    program.key("ctrl+s");
    // Without a file of its own it asks for a name, and proposes one.
    std::thread::sleep(Duration::from_secs(1));
    assert!(!path.exists(), "nobody was asked");
    program.key("Return");
    until(&format!("{} to be saved", path.display()), || std::fs::read_to_string(path).ok())
}

#[test]
fn a_scene_of_an_archive_is_saved_to_a_file_of_its_own() {
    let Some(desktop) = Desktop::start() else { return };
    let (folder, cache) = (desktop.folder(), desktop.folder().join("cache"));
    does(folder, "pack cornell -o box.zip");
    let cache_text = cache.display().to_string();
    let program = desktop.open(&["box.zip", "--size", "320x240"], &[("XDG_CACHE_HOME", &cache_text)]);
    seen(&program);
    let unpacked = || -> Vec<String> {
        let folders = std::fs::read_dir(cache.join("firstlight/packed")).expect("it is unpacked").flatten();
        // Beside the folder of the archive there is a lock.
        let folders = folders.filter(|entry| entry.path().is_dir());
        folders.map(|folder| std::fs::read_to_string(folder.path().join("cornell.ron")).expect("the scene")).collect()
    };
    let before = unpacked();
    program.key("ctrl+a");
    program.key("Delete");
    let text = saved(&program, &folder.join("cornell-0001.ron"));
    assert!(!text.contains("quad("), "everything was deleted: {text}");
    until("the title", || (program.title() == "firstlight — cornell-0001.ron").then_some(()));
    // From now on it is the open file.
    program.key("ctrl+z");
    until("the title with a star", || program.title().contains('*').then_some(()));
    program.key("ctrl+s");
    until("the file to be replaced", || {
        std::fs::read_to_string(folder.join("cornell-0001.ron")).ok().filter(|text| text.contains("quad("))
    });
    program.key("ctrl+q");
    assert!(program.ended().success());
    assert_eq!(unpacked(), before);
    let settings = std::fs::read_to_string(desktop.settings().join("settings.ron")).expect("settings were kept");
    assert!(settings.contains("cornell-0001.ron") && !settings.contains("packed"), "{settings}");
}

#[test]
fn a_view_flown_away_from_its_tracks_comes_back() {
    let Some(desktop) = Desktop::start() else { return };
    let folder = desktop.folder();
    let program = desktop.open(&["carousel", "--size", "320x240"], &[]);
    seen(&program);
    program.hold("w", 400);
    // It glides to a stop.
    std::thread::sleep(Duration::from_secs(2));
    let text = saved(&program, &folder.join("carousel-0001.ron"));
    program.key("shift+F12");
    let image = folder.join("carousel-0001.exr");
    until("the image", || image.is_file().then_some(()));
    program.key("ctrl+q");
    assert!(program.ended().success());
    let view = text.find("edited: (").expect("the view");
    assert!(text.contains("property: eye"), "the track stays: {text}");
    // The image has the same view, and renders to its own bytes.
    let render = |scene: &str, output: &str| {
        does(folder, &format!("render {scene} -o {output} --size 64x48 --spp 2 -q"));
        image::open(folder.join(output)).expect("an image").into_rgb32f().into_raw()
    };
    let of_scene = render("carousel-0001.ron --uniform --seed 0", "a.exr");
    assert!(of_scene == render("carousel-0001.exr --uniform --seed 0", "b.exr"), "{}", &text[view..]);
    assert!(of_scene != render("carousel --uniform --seed 0", "c.exr"));
}
