//! The hard cases of `firstlight stability` at the size of a test run: every count is 0.
//!
//! `FIRSTLIGHT_RAYS`: rays of the largest case instead of the usual number.

use firstlight::stability::{CASES, Case, ReplayError, ReplayValue};

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
    assert_sound("closed", 4_000_000);
}

#[test]
fn needles_flat_things_and_split_planes_are_hit_where_they_are() {
    for name in ["slivers", "degenerate", "split-planes"] {
        assert_sound(name, 400_000);
    }
}

#[test]
fn rays_that_leave_do_not_come_back_at_once() {
    for name in ["leaving", "tangent"] {
        assert_sound(name, 800_000);
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

/// However glass is nested, shared, open or blended, from whatever side and by whichever integrator.
#[test]
fn nothing_lossless_shows_in_a_white_furnace() {
    for name in ["nested-media", "random-furnaces"] {
        assert_sound(name, 40_000);
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
    let closed = Case::find("closed").unwrap();
    let replay = closed.replay(0, 7, 10_000_000).unwrap();
    assert_eq!(replay.get("result"), Some(&ReplayValue::Text("right".to_owned())), "{replay}");
    assert_eq!(replay, closed.replay(0, 7, 1_000_000_000).unwrap(), "a ray is the same one in a longer run");
}

#[test]
fn what_is_not_there_cannot_be_replayed() {
    let replay =
        |name: &str, test_scene, ray, rays| Case::find(name).unwrap().replay(test_scene, ray, rays).unwrap_err();
    assert!(matches!(replay("closed", 1_000_000, 7, 10_000_000), ReplayError::NoScene { test_scene: 1_000_000, .. }));
    assert_eq!(replay("white-box", 0, 0, 10_000_000), ReplayError::NoRays);
    for name in ["closed", "glass"] {
        let case = Case::find(name).unwrap();
        let ReplayError::NoRay { last, .. } = replay(name, 0, u64::MAX, 1) else { panic!("{name} has rays") };
        assert!(case.replay(0, last, 1).is_ok(), "{name}: the last one is {last}");
        assert_eq!(replay(name, 0, last + 1, 1), ReplayError::NoRay { test_scene: 0, ray: last + 1, last });
        assert!(case.replay(0, last + 1, 10_000_000_000).is_ok(), "{name}: more rays have it");
    }
}
