//! A system that moves a light while a session renders: `cargo run --release --example animate_light -- FOLDER`.
//!
//! The session finds out what changed by itself: a light that moved restarts the image and keeps every tree.

use firstlight::prelude::*;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Number of the image that is rendered now.
#[derive(Resource)]
struct Step(u32);

const N_STEPS: u32 = 4;

fn move_lights(step: Res<Step>, mut lights: Query<(&PointLight, &mut Placement)>) {
    let angle = std::f64::consts::TAU * f64::from(step.0) / f64::from(N_STEPS);
    for (_, mut placement) in &mut lights {
        let at = DVec3::new(2.0 * angle.cos(), 2.0, 2.0 * angle.sin());
        // Writing marks the component as changed, and only a change restarts the image.
        if placement.translation != at {
            placement.translation = at;
        }
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| ".".to_owned()));
    let target = Target { spp: Some(16), ..Target::default() };
    let mut session = Session::new(SessionOptions { width: 320, height: 240, target, ..SessionOptions::default() })?;
    session.open(SceneSource::parse("dof-balls")?);
    session.world_mut().insert_resource(Step(0));
    session.add_systems(move_lights.in_set(Stage::Edit));

    let start = Instant::now();
    let until_done = |session: &mut Session| {
        loop {
            session.update(start.elapsed());
            if session.status().done && session.is_idle() {
                return;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
    };
    until_done(&mut session);
    let light = PointLight { intensity: Vec3::splat(20.0), radius: 0.1 };
    session.world_mut().spawn((light, Placement::at(DVec3::Y)));
    for step in 0..N_STEPS {
        session.world_mut().resource_mut::<Step>().0 = step;
        until_done(&mut session);
        let film = session.film_snapshot().ok_or("there is no image")?;
        write_film(&film, &Display::default(), &folder.join(format!("light-{step}.png")))?;
    }
    Ok(())
}
