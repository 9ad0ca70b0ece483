//! The example for Bevy, which only a workflow of its own compiles: the worlds of both must be of the same
//! bevy_ecs, and the names that the example uses must be there.

use std::collections::BTreeSet;
use std::path::Path;

fn read(path: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The versions of a crate that a lock file has.
fn versions<'a>(lock: &'a str, name: &str) -> BTreeSet<&'a str> {
    let entry = format!("name = \"{name}\"\nversion = \"");
    lock.split(entry.as_str()).skip(1).filter_map(|rest| rest.split('"').next()).collect()
}

#[test]
fn the_example_for_bevy_has_our_bevy_ecs_and_glam() {
    let (ours, of_example) = (read("Cargo.lock"), read("examples/bevy/Cargo.lock"));
    for name in ["bevy_ecs", "glam"] {
        let ours = versions(&ours, name);
        assert_eq!(ours.len(), 1, "{name}: {ours:?}");
        assert_eq!(ours, versions(&of_example, name), "{name} in examples/bevy: `cargo update` there");
    }
}

#[test]
fn the_example_for_bevy_uses_names_of_the_prelude() {
    let (example, prelude) = (read("examples/bevy/src/firstlight_plugin.rs"), read("src/prelude.rs"));
    let is_end = |c: char| !c.is_alphanumeric() && c != '_';
    let there: BTreeSet<&str> = prelude.split(is_end).collect();
    let used: BTreeSet<&str> = example.split("fl::").skip(1).filter_map(|rest| rest.split(is_end).next()).collect();
    assert!(used.len() > 10, "{used:?}");
    let missing: Vec<_> = used.difference(&there).collect();
    assert!(missing.is_empty(), "not in the prelude: {missing:?}");
}
