//! A session that is flown about at random, in a process of its own: its memory must not grow.
//!
//! `FIRSTLIGHT_SOAK_SECONDS`: how long it is flown, instead of a few seconds.

#[path = "common/random.rs"]
mod random;

use firstlight::frame::{Command as Do, MessageKind, Session, SessionOptions};
use firstlight::scene::SceneSource;
use random::Random;
use std::time::{Duration, Instant};

/// Resident memory in bytes.
#[cfg(target_os = "linux")]
fn resident() -> u64 {
    let text = std::fs::read_to_string("/proc/self/statm").unwrap();
    text.split_whitespace().nth(1).unwrap().parse::<u64>().unwrap() * 4096
}

/// One thing that somebody at the window may do, sensible or not.
fn whim(random: &mut Random) -> Do {
    let (a, b) = (f64::from(random.signed()), f64::from(random.signed()));
    let scenes = ["cornell", "glass-balls", "dof-balls", "veach-mis", "soft-shadow", "no-such-scene", "broken.obj"];
    match random.below(24) {
        0..3 => Do::Turn { yaw_deg: 400.0 * a, pitch_deg: 100.0 * b },
        3..6 => Do::Fly { right: a, up: b, forward: 10.0 * f64::from(random.signed()) },
        6..8 => Do::Orbit { yaw_deg: 90.0 * a, pitch_deg: 200.0 * b },
        8 => Do::Pan { right: a, up: b },
        9 => Do::Dolly { factor: (20.0 * a).exp() },
        10 => Do::Zoom { factor: (8.0 * a).exp() },
        11 => Do::Roll { angle_deg: 1e5 * a },
        12 => Do::FrameAll,
        13 => Do::Home,
        14 => Do::PivotAt { x: 2.0 * a, y: 2.0 * b },
        15 => Do::FocusAt { x: 0.5 + a, y: 0.5 + b },
        16 => Do::ScaleFocus { factor: (50.0 * a).exp() },
        17 => Do::SetAperture { radius: (30.0 * a).exp() },
        18 => Do::SetExposure { stops: 200.0 * a as f32 },
        19 => Do::NextToneCurve,
        20..22 => Do::Resize { width: random.below(130) as u32, height: random.below(90) as u32 },
        22 => Do::SetThreads { threads: 1 + random.below(4) },
        _ => Do::Open { path: scenes[random.below(scenes.len())].into() },
    }
}

#[test]
fn a_session_survives_whatever_is_done_to_it_without_growing() {
    let seconds = std::env::var("FIRSTLIGHT_SOAK_SECONDS").ok().and_then(|n| n.parse().ok()).unwrap_or(8.0);
    let options = SessionOptions { width: 96, height: 64, threads: Some(2), ..SessionOptions::default() };
    let mut session = Session::new(options).unwrap();
    session.open(SceneSource::Builtin("cornell".to_owned()));
    let mut random = Random(0x50A7);
    let (start, mut frames, mut pictures) = (Instant::now(), 0u64, 0u64);
    let (mut warm, mut last) = (0, 0);
    while start.elapsed().as_secs_f64() < seconds {
        for _ in 0..random.below(4) {
            session.send(whim(&mut random));
        }
        if random.below(40) == 0 {
            session
                .send([Do::Pause, Do::Resume, Do::Restart, Do::Level, Do::ToggleDepthOfField][random.below(5)].clone());
            session.send(Do::Resume);
        }
        session.update(start.elapsed());
        frames += 1;
        pictures = session.picture().number;
        // Most frames go by quickly; some pictures are waited for.
        std::thread::sleep(Duration::from_millis(if random.below(10) == 0 { 30 } else { 1 }));
        #[cfg(target_os = "linux")]
        {
            last = resident();
            // All scenes have been read once or twice by then.
            if start.elapsed().as_secs_f64() < 0.5 * seconds {
                warm = warm.max(last);
            }
        }
    }
    let rig = session.status().rig;
    assert!(rig.view.eye.is_finite() && rig.view.forward.is_finite(), "{rig:?}");
    // It still works.
    session.send(Do::Resize { width: 40, height: 30 });
    session.send(Do::Resume);
    session.send(Do::Open { path: "cornell".into() });
    let settled = Instant::now();
    let before = session.picture().number;
    while session.picture().number < before + 3 || session.picture().width != 40 {
        session.update(start.elapsed());
        std::thread::sleep(Duration::from_millis(2));
        assert!(settled.elapsed() < Duration::from_secs(60), "no picture any more: {:?}", session.status());
    }
    let errors = session.status().messages.iter().filter(|message| message.kind == MessageKind::Error).count();
    println!("{frames} frames, {pictures} pictures, {errors} messages; {} MiB, then {} MiB", warm >> 20, last >> 20);
    assert!(frames > 20 && pictures > 5, "{frames} frames, {pictures} pictures");
    assert!(last <= warm + (48 << 20), "grew from {warm} to {last} bytes");
}
