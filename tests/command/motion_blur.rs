//! Motion blur through the program: films know their exposure, and stop, resume and add up as films of stills do.

use crate::parts::{does, equal, fails};
use std::path::Path;

const COMMON: &str = "carousel --size 40x33 --at 0.5";

fn pixels(folder: &Path, name: &str) -> Vec<u8> {
    image::open(folder.join(name)).unwrap().into_rgb8().into_raw()
}

#[test]
fn blurred_films_resume_and_add_up_and_refuse_another_exposure() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    does(path, &format!("render {COMMON} --shutter 0.8 --uniform --spp 12 -o whole.png --film whole.exr"));
    does(path, &format!("render {COMMON} --shutter 0.8 --uniform --spp 5 -o a.png --film a.exr"));
    for other in ["--shutter 0.4", "--shutter 0", "--shutter 0.8 --at 0.6"] {
        let line = format!("render {COMMON} {other} --uniform --spp 12 -o b.png --film a.exr --resume");
        let line = if other.contains("--at") { line.replacen(" --at 0.5", "", 1) } else { line };
        assert!(fails(path, &line, 1).contains("different scene"), "{other}");
    }
    does(path, &format!("render {COMMON} --shutter 0.8 --uniform --spp 12 -o a.png --film a.exr --resume"));
    equal(path, "a.exr", "whole.exr");
    assert!(pixels(path, "a.png") == pixels(path, "whole.png"));

    for part in 1..=3 {
        does(path, &format!("render {COMMON} --shutter 0.8 --spp 12 --part {part}/3 --film p{part}.exr"));
    }
    does(path, "merge p3.exr p1.exr p2.exr -o all.exr");
    equal(path, "all.exr", "whole.exr");
    does(path, &format!("render {COMMON} --shutter 0.4 --samples 12..16 -o c.png --film c.exr"));
    assert!(!crate::parts::run_in(path, "merge whole.exr c.exr -o d.exr", &[]).status.success());

    // An image with blur opens as one.
    does(path, "render whole.png -o again.png --uniform --spp 12");
    assert!(pixels(path, "again.png") == pixels(path, "whole.png"));
    does(path, &format!("render {COMMON} --uniform --spp 12 -o sharp.png"));
    assert!(pixels(path, "sharp.png") != pixels(path, "whole.png"));
}

#[test]
fn what_stands_still_is_the_same_with_a_shutter() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    // Long after the last key.
    for shutter in ["0", "1"] {
        let line = format!("render carousel --at 9 --size 40x33 --spp 4 --shutter {shutter} -o s{shutter}.png");
        does(path, &line);
    }
    assert!(pixels(path, "s0.png") == pixels(path, "s1.png"));
    assert!(does(path, "render cornell --size 8x8 --spp 1 --shutter 0.5 -o c.png").contains("has no animation"));
    fails(path, "render carousel --shutter 1.5 -o c.png", 2);
}
