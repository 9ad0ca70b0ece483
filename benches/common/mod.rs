//! Scenes by their names, for benches.

use bevy_ecs::world::World;
use firstlight::scene::{LoadOptions, LoadedScene, SceneSource, load};

/// The scenes named on the command line, or else these.
pub fn scenes(usual: impl FnOnce() -> Vec<String>) -> Vec<String> {
    // Cargo itself adds `--bench`.
    let named: Vec<String> = std::env::args().skip(1).filter(|arg| arg != "--bench").collect();
    if named.is_empty() { usual() } else { named }
}

/// A built-in scene or a file, and the world that holds it.
pub fn world_of(name: &str) -> (LoadedScene, World) {
    let source = SceneSource::parse(name).unwrap_or_else(|error| panic!("{error}"));
    let scene = load(&source, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    let mut world = World::new();
    scene.spawn(&mut world);
    (scene, world)
}
