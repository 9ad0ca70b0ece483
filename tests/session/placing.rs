//! Where the camera stops.

use crate::driver::{Drive, Driver};
use firstlight::frame::{Command, Edit, SessionOptions, Target};
use firstlight::scene::{Placement, SceneSource, View};
use std::path::Path;

const PYRAMID: &str =
    "v -0.5 0 -0.5\nv 0.5 0 -0.5\nv 0.5 0 0.5\nv -0.5 0 0.5\nv 0 1 0\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\nf 1 4 3 2\n";

/// A model of this many metres, opened by itself.
fn model(folder: &Path, size: f64) -> Driver {
    let scaled = |word: &str| word.parse().map_or(word.to_owned(), |x: f64| (size * x).to_string());
    let lines = PYRAMID.lines().map(|line| match line.strip_prefix("v ") {
        Some(numbers) => format!("v {}\n", numbers.split(' ').map(scaled).collect::<Vec<_>>().join(" ")),
        None => format!("{line}\n"),
    });
    let path = folder.join("pyramid.obj");
    std::fs::write(&path, lines.collect::<String>()).unwrap();
    let target = Target { spp: Some(2), ..Target::default() };
    let options = SessionOptions { width: 48, height: 32, threads: Some(2), target, ..SessionOptions::default() };
    let mut driver = Driver::new(options, SceneSource::Model(path));
    driver.settle();
    driver
}

#[test]
fn an_orbit_about_a_model_stops_above_the_ground_it_stands_on() {
    let folder = tempfile::tempdir().unwrap();
    for size in [0.01, 1.0, 300.0] {
        let mut driver = model(folder.path(), size);
        let ground = driver.get::<Placement>("ground").translation.y;
        let below = |driver: &Driver| driver.session.status().rig.view.eye.y < ground;
        let orbit = |driver: &mut Driver| {
            for _ in 0..20 {
                driver.session.send(Command::Orbit { yaw_deg: 1.0, pitch_deg: -8.0 });
                driver.frame();
            }
        };
        orbit(&mut driver);
        let View { eye, pivot_distance, .. } = driver.session.status().rig.view;
        assert!(eye.y > ground && eye.y - ground < 0.02 * pivot_distance, "{eye} above {ground}");
        // Who wants to see the model from below takes the ground away.
        driver.select("ground");
        driver.edit([Edit::Delete]);
        orbit(&mut driver);
        assert!(below(&driver));
        // Below a ground, for whatever reason, one may go on, and go home.
        driver.edit([Edit::Undo]);
        driver.session.send(Command::Orbit { yaw_deg: 10.0, pitch_deg: -1.0 });
        driver.frame();
        assert!(below(&driver));
        driver.session.send(Command::Home);
        driver.frame();
        assert!(!below(&driver));
    }
}
