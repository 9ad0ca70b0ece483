//! Text of the status line: quality of the image, and settings.

use crate::frame::{DenoiseFilter, Denoising, Status, f_number, f_stop};
use crate::render::{Integrator, ToneCurve};
use std::fmt::Write as _;

/// The figures: state, samples, seconds, speed, resolution, error, and the cause of the last restart.
pub fn figures(status: &Status) -> String {
    let mut line = String::new();
    if let Some(loading) = &status.loading {
        write!(line, "{loading}…   ").expect("a string takes all");
    }
    // Explains why the sample count does not grow.
    if status.paused {
        line += "paused   ";
    } else if status.done {
        line += "finished   ";
    }
    // With a region, its samples and its error: those of the whole image would not belong together.
    let of_region = status.region.map(|(_, spp)| spp);
    let (spp, place) = of_region.map_or((status.spp, ""), |spp| (spp, " in the region"));
    write!(
        line,
        "{spp} spp{place}   {}   {:.2} Mrays/s   {}×{}",
        seconds(status.seconds),
        status.mrays(),
        status.film_width,
        status.film_height
    )
    .expect("a string takes all");
    if status.divider > 1 {
        write!(line, " (1/{})", status.divider).expect("a string takes all");
    }
    let error = status.estimated_error.map_or("–".to_owned(), percent);
    write!(line, "   error {error}{place}").expect("a string takes all");
    if let Some(denoised) = status.denoised_error {
        // It may be older than the samples.
        let of = if status.denoised_spp == spp { String::new() } else { format!(" of {} spp", status.denoised_spp) };
        write!(line, " (denoised {}{of})", percent(denoised)).expect("a string takes all");
    }
    let shown = match (status.denoising, status.denoised_error) {
        (Denoising::Raw, _) => "   raw",
        // Only at full resolution, and only once it is done, is an image denoised with a known error.
        (Denoising::Denoised, None) => "   smoothed",
        (Denoising::Denoised, Some(_)) if status.mixes_raw => "   denoised, mixed with raw",
        (Denoising::Denoised, Some(_)) => "   denoised",
        (Denoising::Split, None) => "   raw | smoothed",
        (Denoising::Split, Some(_)) => "   raw | denoised",
    };
    line += shown;
    let is_denoised = status.denoising != Denoising::Raw && status.denoised_error.is_some();
    if is_denoised && status.denoised_by != DenoiseFilter::Own {
        write!(line, " by {}", status.denoised_by.label()).expect("a string takes all");
    }
    if status.awaits_denoised {
        line += ", denoising…";
    }
    if !status.restart_cause.is_empty() {
        write!(line, "   restarted: {}", status.restart_cause).expect("a string takes all");
    }
    line
}

/// Settings that differ from the default: lens, exposure, tone curve, model; and the key for help.
pub fn settings(status: &Status) -> String {
    let mut parts = Vec::new();
    if status.integrator == Integrator::Phong {
        parts.push("Phong".to_owned());
    }
    let lens = status.rig.lens;
    if lens.enabled {
        let aperture = f_number(f_stop(lens.radius, &status.rig.projection));
        parts.push(format!("focus {}, {aperture}", metres(lens.focus_distance)));
    }
    if status.display.exposure_stops != 0.0 {
        parts.push(format!("{:+.1} stops", status.display.exposure_stops));
    }
    if status.display.tone_curve != ToneCurve::default() {
        parts.push(tone_curve(status.display.tone_curve).to_owned());
    }
    parts.push("N: panel, H: keys".to_owned());
    parts.join("   ")
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
        p if p >= 10.0 => format!("{p:.0} %"),
        p if p >= 1.0 => format!("{p:.1} %"),
        p => format!("{p:.2} %"),
    }
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

/// Formats 1234567 as 1,234,567.
pub fn thousands(n: usize) -> String {
    let digits = n.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::Region;
    use crate::scene::Lens;
    use glam::UVec2;

    #[test]
    fn figures_say_what_matters() {
        let mut status = Status { spp: 37, seconds: 12.34, bounce_mrays: 4.567, ..Status::default() };
        (status.film_width, status.film_height, status.divider) = (320, 180, 4);
        (status.estimated_error, status.restart_cause) = (Some(0.0234), "camera moved".to_owned());
        assert_eq!(
            figures(&status),
            "37 spp   12.3 s   4.57 Mrays/s   320×180 (1/4)   error 2.3 %   raw   restarted: camera moved"
        );
        (status.estimated_error, status.divider) = (None, 1);
        assert!(figures(&status).contains("320×180   error –"));
        // What gets all samples is what the figures are about.
        let region = Region { start: UVec2::ZERO, end: UVec2::splat(32) };
        status.region = Some((region, 512));
        status.estimated_error = Some(0.012);
        assert!(figures(&status).starts_with("512 spp in the region   12.3 s"));
        assert!(figures(&status).contains("error 1.2 % in the region"));
        status.region = None;
        (status.denoising, status.estimated_error, status.denoised_error) =
            (Denoising::Denoised, Some(0.02), Some(0.004));
        status.denoised_spp = status.spp;
        assert!(
            figures(&status).contains("error 2.0 % (denoised 0.40 %)   denoised   restarted"),
            "{}",
            figures(&status)
        );
        status.denoised_by = DenoiseFilter::Oidn;
        assert!(figures(&status).contains("   denoised by Open Image Denoise   "), "{}", figures(&status));
        status.denoised_by = DenoiseFilter::Own;
        status.denoising = Denoising::Split;
        assert!(figures(&status).contains("   raw | denoised   "));
        status.denoised_error = None;
        assert!(figures(&status).contains("   raw | smoothed   "));
        (status.denoising, status.awaits_denoised) = (Denoising::Denoised, true);
        assert!(figures(&status).contains("   smoothed, denoising…   "));
        status.denoising = Denoising::Raw;
        assert!(figures(&status).contains("%   raw, denoising…   "));
        status.awaits_denoised = false;
        (status.denoising, status.denoised_error) = (Denoising::Denoised, Some(0.03));
        (status.denoised_spp, status.mixes_raw) = (8, true);
        assert!(figures(&status).contains("(denoised 3.0 % of 8 spp)   denoised, mixed with raw   "));
        status.done = true;
        assert!(figures(&status).starts_with("finished   37 spp"));
        status.paused = true;
        assert!(figures(&status).starts_with("paused   37 spp"));
    }

    #[test]
    fn settings_tell_only_what_is_unusual() {
        let mut status = Status::default();
        assert_eq!(settings(&status), "N: panel, H: keys");
        status.rig.lens = Lens::thin(0.01, 2.5);
        status.display.exposure_stops = -1.0 / 3.0;
        assert_eq!(settings(&status), "focus 2.50 m, f/1.6   -0.3 stops   N: panel, H: keys");
    }

    #[test]
    fn units_suit_their_numbers() {
        assert_eq!([seconds(0.04), seconds(61.0), seconds(7325.0)], ["0.0 s", "1:01 min", "2:02 h"]);
        assert_eq!([percent(0.5), percent(0.012), percent(0.0001)], ["50 %", "1.2 %", "0.01 %"]);
        assert_eq!(percent(f64::INFINITY), "–");
        let lengths = [metres(f64::INFINITY), metres(5e6), metres(1234.0), metres(0.5), metres(0.002), metres(2e-6)];
        assert_eq!(lengths, ["∞", "5000 km", "1.23 km", "50.0 cm", "2.00 mm", "2.00 µm"]);
    }

    #[test]
    fn large_numbers_are_grouped() {
        assert_eq!([0, 999, 1000, 1_234_567].map(thousands), ["0", "999", "1,000", "1,234,567"]);
    }
}
