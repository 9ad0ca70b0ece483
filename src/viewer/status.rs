//! Text of the status line: what is on the image and how good it is, and settings; and how figures are written.

use crate::frame::{Aperture, DenoiseFilter, Denoising, Status, Target, f_number};
use crate::render::{Integrator, ToneCurve};

/// Seconds of rendering from which the time to go can be told.
const MIN_SECONDS: f64 = 0.5;

/// Seconds for which somebody may wait.
const PATIENCE: f64 = 1800.0;
/// In place of a figure.
const NOT_KNOWN: &str = "not known yet";
/// Error of an image that most people are content with: the goal that is told first.
const CLEAN: f64 = 0.01;

/// What is on the image, how good it is, and how long it will take: one noise, that of what is shown.
///
/// - `is_slow`: what is being built has taken long enough to be told.
pub fn line(status: &Status, target: Target, is_slow: bool) -> String {
    let is_told = is_slow || status.opening.is_some() || status.scene.is_empty();
    let loading = status.loading.as_ref().filter(|_| is_told).map(|loading| format!("{loading} …"));
    if let Some(loading) = &loading
        && (status.opening.is_some() || status.scene.is_empty())
    {
        return loading.clone();
    }
    let state = if status.paused {
        "paused, "
    } else if status.done {
        "finished, "
    } else {
        ""
    };
    let place = if status.region.is_some() { " in the region" } else { "" };
    let raw = status.estimated_error.map(percent);
    let error = |_| status.known_denoised_error().map_or(NOT_KNOWN.to_owned(), percent);
    let denoised = status.denoised_error.map(error).filter(|_| status.denoising != Denoising::Raw);
    let by = match status.denoised_by {
        DenoiseFilter::Own => String::new(),
        filter => format!(" by {}", filter.label()),
    };
    let noise = match (&raw, &denoised) {
        (Some(raw), Some(denoised)) if status.denoising == Denoising::Split => {
            format!("noise {raw} | denoised{by}: {denoised}")
        }
        (Some(_), Some(_)) if status.known_denoised_error().is_none() => match status.estimated_error {
            Some(error) if error <= 1.0 => {
                format!("denoised{by}, from an image with {raw} of noise{place}", raw = percent(error))
            }
            _ => format!("denoised{by}, few samples yet{place}"),
        },
        (_, Some(denoised)) => format!("noise {denoised}{place}, denoised{by}"),
        (Some(raw), None) => format!("noise {raw}{place}"),
        // While it moves, and until there are samples to compare.
        (None, None) if status.divider > 1 => "preview".to_owned(),
        (None, None) => "first samples".to_owned(),
    };
    let denoising = if status.awaits_denoised { ", denoising …" } else { "" };
    // Beside the noise of a denoised image, the goal of its samples would be another figure.
    let time = match status.estimated_error.filter(|error| denoised.is_none() && *error > CLEAN) {
        // The last bit takes longest, and few wait for it.
        Some(error) if target.error.is_some_and(|goal| goal < CLEAN) => {
            let seconds = seconds_to(status.seconds, error, CLEAN);
            Some(seconds).filter(|_| status.seconds >= MIN_SECONDS).map(|seconds| (seconds, percent(CLEAN)))
        }
        _ => time_to_go(status, target)
            .map(|seconds| (seconds, target.error.filter(|_| denoised.is_none()).map_or("go".to_owned(), percent))),
    };
    // Hours frighten, and an estimate of hours is a guess.
    let time = time.filter(|(seconds, _)| state.is_empty() && *seconds <= PATIENCE);
    let time = time.map(|(seconds, to)| format!(", {} to {to}", about(seconds)));
    let loading = loading.map(|loading| loading + "   ").unwrap_or_default();
    format!("{loading}{state}{noise}{denoising}{}", time.unwrap_or_default())
}

/// Seconds until the error has fallen to `goal`, as the square root of the samples grows.
fn seconds_to(seconds: f64, error: f64, goal: f64) -> f64 {
    seconds * ((error / goal).powi(2) - 1.0)
}

/// Seconds until the target is reached.
fn time_to_go(status: &Status, target: Target) -> Option<f64> {
    let seconds = Some(status.seconds).filter(|seconds| *seconds >= MIN_SECONDS)?;
    let by_error = target.error.zip(status.estimated_error).map(|(goal, error)| seconds_to(seconds, error, goal));
    let by_samples = target.spp.map(|goal| seconds * (f64::from(goal) / f64::from(status.spp.max(1)) - 1.0));
    let by_time = target.seconds.map(|goal| goal - seconds);
    let soonest = [by_error, by_samples, by_time].into_iter().flatten().min_by(f64::total_cmp)?;
    (soonest.is_finite() && soonest > 0.0).then_some(soonest)
}

/// A duration that is only estimated.
pub fn about(seconds: f64) -> String {
    match seconds {
        s if s < 9.5 => format!("about {:.0} s", s.max(1.0)),
        s if s < 95.0 => format!("about {:.0} s", (s / 5.0).round() * 5.0),
        s if s < 5400.0 => format!("about {:.0} min", s / 60.0),
        s if s < 48.0 * 3600.0 => format!("about {:.0} h", s / 3600.0),
        s => format!("about {:.0} days", s / 86_400.0),
    }
}

/// Settings that differ from the default: lens, exposure, tone curve, model.
pub fn settings(status: &Status) -> Vec<String> {
    let mut parts = Vec::new();
    if status.integrator == Integrator::Phong {
        parts.push("Phong".to_owned());
    }
    let lens = status.rig.lens;
    if lens.enabled {
        let aperture = match Aperture::of(lens.radius, &status.rig.projection) {
            Aperture::FNumber(stop) => f_number(stop),
            Aperture::Diameter(diameter) => format!("aperture {}", metres(diameter)),
        };
        parts.push(format!("focus {}, {aperture}", metres(lens.focus_distance)));
    }
    if status.display.exposure_stops != 0.0 {
        parts.push(format!("{:+.1} stops", status.display.exposure_stops));
    }
    if status.display.tone_curve != ToneCurve::default() {
        parts.push(tone_curve(status.display.tone_curve).to_owned());
    }
    parts
}

pub fn tone_curve(curve: ToneCurve) -> &'static str {
    match curve {
        ToneCurve::Linear => "linear",
        ToneCurve::Neutral => "neutral",
        ToneCurve::Filmic => "filmic",
    }
}

pub fn seconds(s: f64) -> String {
    if s < 60.0 {
        format!("{s:.1} s")
    } else if s < 3600.0 {
        format!("{}:{:02} min", (s / 60.0) as u64, s as u64 % 60)
    } else {
        format!("{}:{:02} h", (s / 3600.0) as u64, s as u64 / 60 % 60)
    }
}

/// Formats a percentage with about two significant digits.
pub fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    match percent {
        p if !p.is_finite() => "–".to_owned(),
        p if p > 100.0 => "over 100 %".to_owned(),
        p if p >= 10.0 => format!("{p:.0} %"),
        p if p >= 1.0 => format!("{p:.1} %"),
        p => format!("{p:.2} %"),
    }
}

/// Such as `64 samples per pixel`.
pub fn samples(spp: u32) -> String {
    let s = if spp == 1 { "" } else { "s" };
    format!("{spp} sample{s} per pixel")
}

/// Formats a length with a suitable unit.
pub fn metres(m: f64) -> String {
    match m {
        m if m.is_infinite() => "∞".to_owned(),
        m if m >= 1e5 => format!("{:.0} km", m / 1e3),
        m if m >= 1e3 => format!("{:.2} km", m / 1e3),
        m if m >= 1.0 => format!("{m:.2} m"),
        m if m >= 1e-2 => format!("{:.1} cm", m * 1e2),
        m if m >= 1e-4 => format!("{:.2} mm", m * 1e3),
        m => format!("{:.2} µm", m * 1e6),
    }
}

/// Formats a size of memory.
pub fn bytes(n: u64) -> String {
    match n as f64 {
        n if n >= 1e9 => format!("{:.2} GB", n / 1e9),
        n if n >= 1e6 => format!("{:.0} MB", n / 1e6),
        n => format!("{:.0} kB", n / 1e3),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::RenderProgress;
    use crate::render::Region;
    use crate::scene::Lens;
    use glam::UVec2;

    #[test]
    fn the_line_has_one_noise_that_of_what_is_shown() {
        let progress = RenderProgress { spp: 37, seconds: 10.0, divider: 4, ..RenderProgress::default() };
        let mut status = Status { progress, ..Status::default() };
        let target = Target { error: Some(0.005), ..Target::default() };
        let line = |status: &Status| line(status, target, true);
        assert_eq!(line(&status), "preview");
        status.progress.divider = 1;
        assert_eq!(line(&status), "first samples");
        // Twice the error takes four times the samples.
        status.progress.estimated_error = Some(0.01);
        assert_eq!(line(&status), "noise 1.0 %, about 30 s to 0.50 %");
        (status.progress.denoising, status.progress.awaits_denoised) = (Denoising::Denoised, true);
        assert_eq!(line(&status), "noise 1.0 %, denoising …, about 30 s to 0.50 %");
        (status.progress.awaits_denoised, status.progress.denoised_error) = (false, Some(0.004));
        assert_eq!(line(&status), "noise 0.40 %, denoised, about 30 s to go");
        status.progress.denoised_by = DenoiseFilter::Oidn;
        assert_eq!(line(&status), "noise 0.40 %, denoised by Open Image Denoise, about 30 s to go");
        (status.progress.denoised_by, status.progress.denoising) = (DenoiseFilter::Own, Denoising::Split);
        assert_eq!(line(&status), "noise 1.0 % | denoised: 0.40 %, about 30 s to go");
        // Two halves of the samples may lack the same light, such as that of rare, bright paths.
        status.progress.estimated_error = Some(1.4);
        assert_eq!(line(&status), "noise over 100 % | denoised: not known yet");
        status.progress.denoising = Denoising::Denoised;
        assert_eq!(line(&status), "denoised, few samples yet");
        (status.progress.estimated_error, status.progress.denoising) = (Some(0.01), Denoising::Split);
        // A denoised image that is there but not shown does not matter.
        status.progress.denoising = Denoising::Raw;
        let region = Region { start: UVec2::ZERO, end: UVec2::splat(32) };
        status.progress.region = Some((region, 512));
        assert_eq!(line(&status), "noise 1.0 % in the region, about 30 s to 0.50 %");
        (status.progress.region, status.done) = (None, true);
        assert_eq!(line(&status), "finished, noise 1.0 %");
        status.paused = true;
        assert_eq!(line(&status), "paused, noise 1.0 %");
        status.loading = Some("reading duck.glb".to_owned());
        assert_eq!(line(&status), "reading duck.glb …", "no figures of what is not there yet");
        (status.scene, status.loading) = ("duck.glb".to_owned(), Some("building a kd-tree".to_owned()));
        assert_eq!(line(&status), "building a kd-tree …   paused, noise 1.0 %");
        assert_eq!(super::line(&status, target, false), "paused, noise 1.0 %");
    }

    #[test]
    fn the_time_to_go_is_that_of_the_first_limit_to_be_reached() {
        let of = |progress: RenderProgress| Status { progress, ..Status::default() };
        let none = RenderProgress::default;
        let status = of(RenderProgress { spp: 100, seconds: 50.0, estimated_error: Some(0.02), ..none() });
        let target = |spp, seconds, error| time_to_go(&status, Target { spp, seconds, error });
        assert_eq!(target(None, None, Some(0.01)), Some(150.0));
        assert_eq!(target(Some(300), None, Some(0.01)), Some(100.0));
        assert_eq!(target(Some(300), Some(60.0), Some(0.01)), Some(10.0));
        assert_eq!(target(None, None, None), None);
        assert_eq!(target(None, None, Some(0.05)), None, "reached");
        let target = Target { error: Some(0.005), ..Target::default() };
        let near = RenderProgress { spp: 9, seconds: 10.0, estimated_error: Some(0.05), ..none() };
        assert_eq!(
            line(&of(near.clone()), target, true),
            "noise 5.0 %, about 4 min to 1.0 %",
            "what most are content with"
        );
        let clean = RenderProgress { estimated_error: Some(0.009), ..near.clone() };
        assert_eq!(line(&of(clean), target, true), "noise 0.90 %, about 20 s to 0.50 %");
        let far = RenderProgress { estimated_error: Some(0.5), ..near };
        assert_eq!(line(&of(far.clone()), target, true), "noise 50 %", "hours away");
        let denoised = RenderProgress { denoising: Denoising::Denoised, denoised_error: Some(0.05), ..far };
        assert_eq!(line(&of(denoised), target, true), "noise 5.0 %, denoised");
        assert_eq!([0.2, 43.0, 200.0].map(about), ["about 1 s", "about 45 s", "about 3 min"]);
        assert_eq!([5000.0, 1e4, 1e6].map(about), ["about 83 min", "about 3 h", "about 12 days"]);
    }

    #[test]
    fn settings_tell_only_what_is_unusual() {
        let mut status = Status::default();
        assert!(settings(&status).is_empty());
        status.rig.lens = Lens::thin(0.01, 2.5);
        status.display.exposure_stops = -1.0 / 3.0;
        assert_eq!(settings(&status), ["focus 2.50 m, f/1.6", "-0.3 stops"]);
        status.rig.lens = Lens::thin(3.0, 300.0);
        assert_eq!(settings(&status)[0], "focus 300.00 m, aperture 6.00 m", "a model in millimetres");
    }

    #[test]
    fn units_suit_their_numbers() {
        assert_eq!([seconds(0.04), seconds(61.0), seconds(7325.0)], ["0.0 s", "1:01 min", "2:02 h"]);
        assert_eq!([percent(0.5), percent(0.012), percent(0.0001)], ["50 %", "1.2 %", "0.01 %"]);
        assert_eq!(percent(f64::INFINITY), "–");
        let lengths = [metres(f64::INFINITY), metres(5e6), metres(1234.0), metres(0.5), metres(0.002), metres(2e-6)];
        assert_eq!(lengths, ["∞", "5000 km", "1.23 km", "50.0 cm", "2.00 mm", "2.00 µm"]);
    }
}
