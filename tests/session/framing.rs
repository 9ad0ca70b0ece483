//! Models and selections are framed for the size of the image; views from a side.

use crate::driver::{Drive, Driver};
use firstlight::frame::navigation::{Rig, Side};
use firstlight::frame::{Command, PictureSize, Projector, SessionOptions, Target};
use firstlight::scene::{Projection, SceneSource, View};
use glam::{DVec2, DVec3};
use std::path::{Path, PathBuf};

/// The leftmost and the rightmost place of a wide bar, as fractions of the width of the image.
fn seen(driver: &Driver) -> (f64, f64) {
    let aspect = driver.session.world().resource::<PictureSize>().aspect();
    let projector = Projector::new(&driver.session.status().rig, DVec2::new(aspect, 1.0));
    let corner = |i: u32| DVec3::new(f64::from(i & 1) * 8.0, f64::from(i >> 1 & 1), f64::from(i >> 2 & 1));
    let places = (0..8).map(|i| projector.place(corner(i)).expect("it is in front of the camera").x / aspect);
    places.fold((1.0, 0.0), |(left, right), x| (x.min(left), x.max(right)))
}

/// A bar of 8 m × 1 m × 1 m, closed on all sides.
fn bar(folder: &Path) -> PathBuf {
    let path = folder.join("bar.obj");
    let corners = ["0 0 0", "8 0 0", "8 1 0", "0 1 0", "0 0 1", "8 0 1", "8 1 1", "0 1 1"].map(|v| format!("v {v}\n"));
    std::fs::write(&path, corners.concat() + "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 4 8 7 3\nf 1 5 8 4\nf 2 3 7 6\n")
        .unwrap();
    path
}

fn opened(path: &Path) -> Driver {
    opened_scene(SceneSource::Model(path.to_owned()))
}

fn opened_scene(source: SceneSource) -> Driver {
    let options = SessionOptions {
        width: 64,
        height: 32,
        threads: Some(2),
        target: Target { spp: Some(1), ..Target::default() },
        ..SessionOptions::default()
    };
    let mut driver = Driver::new(options, source);
    driver.settle();
    driver
}

#[test]
fn what_is_opened_or_framed_fills_the_image() {
    let folder = tempfile::tempdir().unwrap();
    let path = bar(folder.path());
    let mut driver = opened(&path);
    let is_framed = |driver: &Driver| {
        let (left, right) = seen(driver);
        assert!(left > 0.0 && left < 0.15 && right > 0.85 && right < 1.0, "{left} to {right}");
    };
    is_framed(&driver);
    // As when a panel is opened beside it.
    driver.session.send(Command::Resize { width: 38, height: 32 });
    driver.session.send(Command::FrameAll);
    driver.frame();
    is_framed(&driver);
    driver.session.send(Command::Resize { width: 26, height: 32 });
    let before = driver.session.n_adopted();
    driver.session.send(Command::Open { path });
    driver.run_until(|session| session.n_adopted() > before && session.is_idle());
    is_framed(&driver);
}

/// Where the camera is when a scene is seen from a side.
fn view_from(driver: &mut Driver, eye: DVec3, pivot: DVec3, side: Side) -> DVec3 {
    driver.session.send(Command::SetView(View::look_at(eye, pivot, DVec3::Y).unwrap()));
    driver.session.send(Command::ViewFrom(side));
    driver.frame();
    let view = driver.session.status().rig.view;
    assert!((view.pivot() - pivot).length() < 1e-9);
    view.eye
}

#[test]
fn a_view_from_a_side_stays_in_the_room() {
    let folder = tempfile::tempdir().unwrap();
    let mut driver = opened(&bar(folder.path()));
    let (inside, pivot) = (DVec3::new(1.0, 0.5, 0.5), DVec3::new(6.0, 0.5, 0.5));
    for (side, expected) in [
        (Side::Top, pivot + 0.475 * DVec3::Y),
        (Side::Bottom, pivot - 0.475 * DVec3::Y),
        (Side::Right, pivot + 1.9 * DVec3::X),
        (Side::Left, pivot - 5.0 * DVec3::X),
    ] {
        let eye = view_from(&mut driver, inside, pivot, side);
        assert!((eye - expected).length() < 1e-6, "{side:?}: {eye}");
    }
    // With parallel rays, of as much as before; in perspective, of as much, when one turns.
    let camera = |driver: &mut Driver, command: Command| {
        driver.session.send(command);
        driver.frame();
        driver.session.status().rig
    };
    let height = |rig: &Rig| 2.0 * rig.projection.half_height(rig.view.pivot_distance);
    camera(&mut driver, Command::SetProjection(Projection::default()));
    let before = camera(&mut driver, Command::SetView(View::look_at(inside, pivot, DVec3::Y).unwrap()));
    let plan = camera(&mut driver, Command::ViewFrom(Side::Right));
    assert!(plan.projection.orthographic_height.is_some() && (height(&plan) - height(&before)).abs() < 1e-9);
    let closer = camera(&mut driver, Command::Dolly { factor: 0.25 });
    assert!((height(&closer) - 0.25 * height(&before)).abs() < 1e-9);
    let turned = camera(&mut driver, Command::Orbit { yaw_deg: 1.0, pitch_deg: 0.0 });
    assert_eq!(turned.projection, before.projection);
    assert!((height(&turned) - height(&closer)).abs() < 1e-9 && (turned.view.pivot() - pivot).length() < 1e-9);
    // Parallel rays of another view stay.
    let parallel = Projection { orthographic_height: Some(1.0), ..before.projection };
    camera(&mut driver, Command::SetProjection(parallel));
    camera(&mut driver, Command::SetBookmark { slot: 1 });
    camera(&mut driver, Command::SetProjection(before.projection));
    camera(&mut driver, Command::ViewFrom(Side::Top));
    camera(&mut driver, Command::GoToBookmark { slot: 1 });
    let turned = camera(&mut driver, Command::Orbit { yaw_deg: 1.0, pitch_deg: 0.0 });
    assert_eq!(turned.projection, parallel, "that of the bookmark");
    // What somebody chose stays.
    camera(&mut driver, Command::SetProjection(parallel));
    camera(&mut driver, Command::ViewFrom(Side::Right));
    let turned = camera(&mut driver, Command::Orbit { yaw_deg: 1.0, pitch_deg: 0.0 });
    assert_eq!(turned.projection, parallel);
}

#[test]
fn from_outside_the_walls_of_a_room_are_what_a_view_from_a_side_shows() {
    let folder = tempfile::tempdir().unwrap();
    let mut driver = opened(&bar(folder.path()));
    let outside = DVec3::new(4.0, 0.5, 20.0);
    for (side, expected) in [(Side::Top, DVec3::Y), (Side::Right, DVec3::X), (Side::Back, -DVec3::Z)] {
        let eye = view_from(&mut driver, outside, DVec3::new(4.0, 0.5, 0.5), side);
        assert!((eye - DVec3::new(4.0, 0.5, 0.5) - 19.5 * expected).length() < 1e-6, "{side:?}: {eye}");
    }
}

#[test]
fn what_is_hidden_is_framed_from_another_side() {
    let folder = tempfile::tempdir().unwrap();
    let wall = "quad(corner: (-3, -3, 0.45), edge_u: (6, 0, 0), edge_v: (0, 6, 0), material: \"grey\"),";
    for (wall, is_hidden) in [("", false), (wall, true)] {
        let text = format!(
            "(camera: (eye: (0, 0, 6), look_at: (0, 0, 0)), environment: constant(1),
              materials: {{ \"grey\": diffuse(albedo: 0.5) }},
              objects: [{wall} sphere(name: \"ball\", center: (0, 0, 0), radius: 0.2, material: \"grey\")])"
        );
        let path = folder.path().join("scene.ron");
        std::fs::write(&path, text).unwrap();
        let mut driver = opened_scene(SceneSource::Scene(path));
        driver.select("ball");
        driver.session.send(Command::FrameAll);
        driver.frame();
        let eye = driver.session.status().rig.view.eye;
        assert_eq!(eye.z < 0.45, is_hidden, "{eye}");
        assert!(eye.length() < 2.0, "{eye}");
    }
}
