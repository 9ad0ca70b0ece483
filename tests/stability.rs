//! The hard cases of `firstlight stability` at the size of a test run: every count is 0.
//!
//! `FIRSTLIGHT_RAYS`: rays of the largest case instead of the usual number.

use firstlight::stability::{CASES, Case};

fn rays(usual: u64) -> u64 {
    std::env::var("FIRSTLIGHT_RAYS").ok().and_then(|n| n.parse::<f64>().ok()).map_or(usual, |n| n as u64)
}

#[track_caller]
fn assert_sound(name: &str, usual: u64) {
    let case = Case::find(name).unwrap_or_else(|| panic!("no case {name}"));
    let tally = case.run(rays(usual), &|_| ());
    assert!(tally.rays > 0, "{name} traced nothing");
    assert_eq!(tally.findings(), 0, "{name}: {tally:#?}");
}

/// Ten million rays at the corners and edges of closed meshes.
#[test]
fn no_ray_gets_through_a_closed_mesh() {
    assert_sound("closed", 10_000_000);
}

#[test]
fn needles_flat_things_and_split_planes_are_hit_where_they_are() {
    for name in ["slivers", "degenerate", "split-planes"] {
        assert_sound(name, 1_000_000);
    }
}

#[test]
fn rays_that_leave_do_not_come_back_at_once() {
    for name in ["leaving", "tangent"] {
        assert_sound(name, 2_000_000);
    }
}

#[test]
fn nothing_gets_out_of_a_closed_box() {
    assert_sound("white-box", 2_000_000);
}

#[test]
fn no_light_is_lost_and_no_sample_is_bad() {
    for name in ["glass", "metal", "lights", "cameras"] {
        assert_sound(name, 1_000_000);
    }
}

#[test]
fn a_million_samples_sum_up() {
    assert_sound("long-sums", 1_000_000);
}

#[test]
fn the_same_scene_elsewhere_is_the_same_picture() {
    for name in ["anywhere", "georeferenced"] {
        assert_sound(name, 1_000_000);
    }
}

#[test]
fn counts_do_not_depend_on_threads() {
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| Case::find("slivers").unwrap().run(20_000, &|_| ()))
    };
    assert_eq!(run(1), run(64));
}

#[test]
fn names_are_unique_and_rays_can_be_replayed() {
    for (i, case) in CASES.iter().enumerate() {
        assert!(CASES[..i].iter().all(|other| other.name != case.name), "{} twice", case.name);
    }
    let told = Case::find("closed").unwrap().replay(0, 7).unwrap();
    assert!(told.contains("0x1") && told.contains("Right"), "{told}");
    assert_eq!(told, Case::find("closed").unwrap().replay(0, 7).unwrap());
    assert!(Case::find("closed").unwrap().replay(1_000_000, 7).is_none());
}
