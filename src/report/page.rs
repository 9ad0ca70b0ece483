//! The report as one self-contained HTML page with plots, tables and images.

use crate::files::printable;
use crate::render::{Display, develop_pixel};
use crate::report::curve::CurveSeconds;
use crate::report::outcome::{Ablation, SceneOutcome};
use crate::report::plot::{Band, Plot, Series, Style, escape, number};
use crate::report::{ConvergenceCurve, DenoisedCurve, LinearPicture};
use base64::Engine;
use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
use std::fmt::Write;

/// The errors for which times are reported.
const TARGETS: [f64; 3] = [0.10, 0.03, 0.01];

/// Factor by which an estimate may be off before the page highlights it.
const CALIBRATION: f64 = 1.25;

const TITLE: &str = "<title>Speed against error</title>";

/// Whether a text begins as a page does.
pub fn is_page(text: &str) -> bool {
    text.lines().take(8).any(|line| line == TITLE)
}

/// Builds the page. `command` is the command line, so that the report can be repeated. `interrupted` describes what is
/// missing if the report was stopped early.
pub fn page(outcomes: &[SceneOutcome], command: &str, interrupted: Option<&str>) -> String {
    let threads = outcomes.first().map_or(0, |outcome| outcome.curve.last().spent.threads);
    let mut html = format!(
        "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width\">\n{TITLE}\n\
         <style>\n{}</style>\n<h1>Speed against error</h1>\n\
         <p class=\"soft\">firstlight {} · {threads} threads · <code>{}</code></p>\n\
         <p>The error is √relMSE, the root of the mean of (x − ref)² / (ref² + 0.01) over pixels and channels of linear \
         light. CurveSeconds are CPU seconds per thread (wall time on an idle machine) spent on rendering alone. Times in \
         brackets lie beyond the measured steps and follow the slope, which is fitted to the later half of the steps. A slope \
         of −1 means: twice the time, half \
         the squared error. Predicted time: by the renderer, when a tenth of the time had passed, to the error that \
         it estimated at the end.</p>\n",
        include_str!("page.css"),
        env!("CARGO_PKG_VERSION"),
        escape(command),
    );
    if let Some(missing) = interrupted {
        let _ = writeln!(html, "<p class=\"bad\">This report was interrupted: {}.</p>", escape(missing));
    }
    html.push_str(&summary(outcomes));
    for outcome in outcomes {
        html.push_str(&section(outcome));
    }
    html.push_str("</html>\n");
    html
}

/// Errors that denoised images are compared by.
const DENOISED_TARGETS: [f64; 2] = [0.05, 0.02];

/// CurveSeconds to the same error raw and denoised, as plain text; empty if nothing was denoised.
pub fn denoised_text(outcomes: &[SceneOutcome]) -> String {
    let mut text = String::new();
    for outcome in outcomes {
        let Some(own) = outcome.denoised.first() else { continue };
        let _ = write!(text, "{}:", printable::name(&outcome.title));
        for target in DENOISED_TARGETS {
            let (raw, denoised) = (outcome.curve.seconds_to(target), own.seconds_to(target));
            let _ = write!(text, "  {}% in {} s raw, {} s denoised", 100.0 * target, seconds(raw), seconds(denoised));
            if let Some((raw, denoised)) = raw.zip(denoised) {
                let _ = write!(text, " ({:.2})", denoised.value() / raw.value());
            }
        }
        text.push('\n');
    }
    text
}

/// The key figures of each scene as plain text.
pub fn summary_text(outcomes: &[SceneOutcome]) -> String {
    let width =
        outcomes.iter().map(|outcome| printable::name(&outcome.title).chars().count()).max().unwrap_or(0).max(5);
    let mut text = format!("{:width$}  {:>9}", "scene", "size");
    for target in TARGETS {
        let _ = write!(text, "  {:>9}", format!("s to {}%", 100.0 * target));
    }
    let _ =
        writeln!(text, "  {:>6}  {:>8}  {:>7}  {:>9}  predicted/actual", "slope", "Mrays/s", "error %", "est./true");
    for outcome in outcomes {
        let curve = &outcome.curve;
        let _ = write!(
            text,
            "{:width$}  {:>9}",
            printable::name(&outcome.title),
            format!("{}x{}", outcome.width, outcome.height)
        );
        for target in TARGETS {
            let _ = write!(text, "  {:>9}", seconds(curve.seconds_to(target)));
        }
        let last = curve.last();
        let _ = writeln!(
            text,
            "  {:>6}  {:>8}  {:>7}  {:>9}  {}",
            curve.slope().map_or("-".to_owned(), |slope| format!("{slope:.2}")),
            number(last.spent.rays_per_second() * 1e-6),
            number(100.0 * last.error()),
            last.calibration().map_or("-".to_owned(), |ratio| format!("{ratio:.2}")),
            curve.foresight().map_or("-".to_owned(), |ratio| format!("{ratio:.2}")),
        );
    }
    text
}

fn summary(outcomes: &[SceneOutcome]) -> String {
    let mut rows = String::new();
    for outcome in outcomes {
        let (curve, last) = (&outcome.curve, outcome.curve.last());
        let times: String =
            TARGETS.iter().map(|&target| format!("<td>{}</td>", seconds(curve.seconds_to(target)))).collect();
        let _ = writeln!(
            rows,
            "<tr><td><a href=\"#{id}\">{}</a></td><td>{} × {}</td>{times}<td>{}</td><td>{}</td><td>{}</td>\
             <td>{}</td><td>{}</td><td>{}</td></tr>",
            escape(&outcome.title),
            outcome.width,
            outcome.height,
            curve.slope().map_or("–".to_owned(), |slope| format!("{slope:.2}")),
            number(last.spent.rays_per_second() * 1e-6),
            number(last.spent.paths_per_second() * 1e-6),
            last.spp,
            percent(last.error()),
            curve.foresight().map_or("–".to_owned(), |ratio| format!("{ratio:.2}")),
            id = anchor(&outcome.title),
        );
    }
    format!(
        "<div class=\"wide\"><table>\n<tr><th>scene</th><th>pixels</th><th>s to 10 %</th><th>s to 3 %</th>\
         <th>s to 1 %</th><th>slope</th><th>M rays/s</th><th>M camera paths/s</th><th>last spp</th>\
         <th>its error</th><th>time predicted / actual</th></tr>\n{rows}</table></div>\n"
    )
}

fn section(outcome: &SceneOutcome) -> String {
    let title = escape(&outcome.title);
    let mut html = format!("<h2 id=\"{}\">{title}</h2>\n", anchor(&outcome.title));
    html.push_str(&about_reference(outcome));
    let spp = |wanted: u32| outcome.curve.steps.iter().map(|step| step.spp).filter(|&spp| spp <= wanted).max();
    let last = outcome.curve.last();
    html.push_str("<div class=\"images\">\n");
    for (picture, caption) in [
        (&outcome.early, format!("{} samples per pixel", spp(4).unwrap_or(1))),
        (&outcome.last, format!("{} samples per pixel, error {}", last.spp, percent(last.error()))),
        (&outcome.reference, "reference".to_owned()),
    ] {
        let _ = writeln!(
            html,
            "<figure><img width=\"{}\" height=\"{}\" alt=\"{title}, {caption}\" src=\"{}\">\
             <figcaption>{caption}</figcaption></figure>",
            picture.width,
            picture.height,
            png_url(picture, &outcome.display)
        );
    }
    html.push_str("</div>\n<div class=\"pair\">\n");
    let mut plots = vec![error_plot(outcome)];
    if !outcome.ablations.is_empty() {
        plots.push(ablation_plot(outcome));
    }
    for plot in plots {
        let _ = write!(html, "<figure><h3>{}</h3>\n{}{}</figure>\n", escape(&plot.title), plot.svg(), plot.legend());
    }
    html.push_str("</div>\n");
    html.push_str(&steps_table(&outcome.curve));
    html.push_str(&denoised_table(outcome));
    if !outcome.ablations.is_empty() {
        html.push_str(&ablation_table(outcome));
    }
    html
}

fn about_reference(outcome: &SceneOutcome) -> String {
    if let Some(mismatch) = outcome.mismatch() {
        return format!("<p class=\"bad\">{}</p>\n", escape(&mismatch));
    }
    let Some(made) = outcome.reference_made else {
        let path = outcome.reference_path.as_ref().map_or(String::new(), |path| path.display().to_string());
        return format!("<p>Reference: <code>{}</code>.</p>\n", escape(&path));
    };
    let own = made.relative_error.map_or(String::new(), |error| format!(", its error {}", percent(error)));
    let mut text = format!("<p>Reference: rendered with a different seed, {} samples per pixel{own}.", made.spp);
    if let Some(share) = outcome.share_of_reference().filter(|share| *share > 0.1) {
        let _ = write!(
            text,
            " Up to {:.0} % of the last step’s relMSE comes from the reference itself.",
            100.0 * share.min(1.0)
        );
    }
    text + "</p>\n"
}

fn error_plot(outcome: &SceneOutcome) -> Plot {
    let curve = &outcome.curve;
    let estimates = || curve.steps.iter().filter_map(|step| step.estimate.map(|e| (step.spent.seconds(), e)));
    let first = curve.steps.iter().find(|step| step.spp >= 4).unwrap_or(curve.last());
    let ideal = |seconds: f64| (seconds, first.distance.relative_mse * first.spent.seconds() / seconds);
    let series = |label: &str, color, style, points| Series { label: label.to_owned(), color, style, points };
    // At the time of the samples, without that of the denoiser.
    let seconds_of = |spp| curve.at(spp).map(|step| step.spent.seconds());
    let denoised = outcome.denoised.iter().enumerate().map(|(i, DenoisedCurve { name, steps })| {
        let points = steps.iter().filter_map(|step| Some((seconds_of(step.spp)?, step.distance.relative_mse)));
        series(name, 2 + i, Style::Thin, points.collect())
    });
    Plot {
        title: "relMSE against time".to_owned(),
        x_label: "seconds".to_owned(),
        y_label: "relMSE".to_owned(),
        series: [
            series("true error", 0, Style::Measured, curve.points()),
            series(
                "error estimate with its 95 % interval",
                1,
                Style::Dashed,
                estimates().map(|(seconds, e)| (seconds, e.relative.powi(2))).collect(),
            ),
            series("slope −1", 7, Style::Thin, vec![ideal(first.spent.seconds()), ideal(curve.last().spent.seconds())]),
        ]
        .into_iter()
        .chain(denoised)
        .collect(),
        band: Some(Band {
            color: 1,
            points: estimates().map(|(seconds, e)| (seconds, e.low.powi(2), e.high.powi(2))).collect(),
        }),
        levels: outcome
            .reference_made
            .and_then(|made| made.relative_error)
            .map(|error| (error * error, "error of the reference".to_owned()))
            .into_iter()
            .collect(),
    }
}

fn ablation_plot(outcome: &SceneOutcome) -> Plot {
    let all = Series { label: "all".to_owned(), color: 0, style: Style::Measured, points: outcome.curve.points() };
    let used = outcome.ablations.iter().enumerate().filter(|(_, ablation)| !ablation.is_unused);
    let without = used.map(|(i, Ablation { technique, curve, .. })| Series {
        label: format!("without {technique}"),
        color: 1 + i % 7,
        style: Style::Thin,
        points: curve.points(),
    });
    Plot {
        title: "Each technique disabled alone".to_owned(),
        x_label: "seconds".to_owned(),
        y_label: "relMSE".to_owned(),
        series: std::iter::once(all).chain(without).collect(),
        band: None,
        levels: vec![],
    }
}

fn steps_table(curve: &ConvergenceCurve) -> String {
    let mut rows = String::new();
    for step in &curve.steps {
        let estimate = step.estimate.map_or("<td>–</td><td>–</td>".to_owned(), |e| {
            let interval = format!("{} ({} – {})", percent(e.relative), percent(e.low), percent(e.high));
            let Some(ratio) = step.calibration() else { return format!("<td>{interval}</td><td>–</td>") };
            // Below 16 samples no accuracy is promised.
            let class = match (step.spp >= 16, (1.0 / CALIBRATION..=CALIBRATION).contains(&ratio)) {
                (false, _) => "soft",
                (true, true) => "good",
                (true, false) => "bad",
            };
            format!("<td>{interval}</td><td class=\"{class}\">{ratio:.2}</td>")
        });
        let _ = writeln!(
            rows,
            "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td>\
             <td>{}</td>{estimate}</tr>",
            step.spp,
            number(step.spent.wall_seconds),
            step.spent.cpu_seconds.map_or("–".to_owned(), number),
            number(step.spent.rays_per_second() * 1e-6),
            number(step.spent.paths_per_second() * 1e-6),
            number(step.distance.relative_mse),
            percent(step.error()),
            number(step.distance.rmse),
            number(step.distance.flip),
        );
    }
    format!(
        "<div class=\"wide\"><table>\n<tr><th>spp</th><th>wall s</th><th>CPU s</th><th>M rays/s</th>\
         <th>M paths/s</th><th>relMSE</th><th>error</th><th>RMSE</th><th>FLIP</th><th>estimated error (95 %)</th>\
         <th>estimated / true</th></tr>\n{rows}</table></div>\n"
    )
}

/// relMSE of the raw image and of each denoiser, with estimated over true error; seconds until it is small, in which the
/// feature buffers and one denoising count.
fn denoised_table(outcome: &SceneOutcome) -> String {
    let curves = &outcome.denoised;
    let mut rows = String::new();
    for raw in &outcome.curve.steps {
        let cells = curves.iter().map(|curve| {
            let Some(step) = curve.steps.iter().find(|step| step.spp == raw.spp) else {
                return "<td>–</td><td>–</td>".to_owned();
            };
            let ratio = step.calibration().map_or("–".to_owned(), |ratio| format!("{ratio:.2}"));
            format!("<td>{}</td><td>{ratio}</td>", number(step.distance.relative_mse))
        });
        let cells: String = cells.collect();
        let _ = writeln!(rows, "<tr><td>{}</td><td>{}</td>{cells}</tr>", raw.spp, number(raw.distance.relative_mse));
    }
    for target in DENOISED_TARGETS {
        let cells = curves.iter().map(|curve| format!("<td>{}</td><td></td>", seconds(curve.seconds_to(target))));
        let _ = writeln!(
            rows,
            "<tr><td>s to {}</td><td>{}</td>{}</tr>",
            percent(target),
            seconds(outcome.curve.seconds_to(target)),
            cells.collect::<String>()
        );
    }
    let names = curves.iter().map(|curve| format!("<th>{}</th><th>estimated / true</th>", escape(curve.name)));
    format!(
        "<div class=\"wide\"><table>\n<tr><th>spp</th><th>raw relMSE</th>{}</tr>\n{rows}</table></div>\n",
        names.collect::<String>()
    )
}

fn ablation_table(outcome: &SceneOutcome) -> String {
    let mut rows = String::new();
    let all = outcome.curve.last();
    let row = |name: &str, step: &crate::report::Step, cost: String| {
        format!(
            "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{cost}</td></tr>\n",
            escape(name),
            step.spp,
            number(step.spent.seconds()),
            number(step.distance.relative_mse),
        )
    };
    rows.push_str(&row("all techniques", all, "1".to_owned()));
    for ablation in &outcome.ablations {
        let cost = if ablation.is_unused {
            "<span class=\"soft\">not used here</span>".to_owned()
        } else {
            format!("{:.2}", ablation.cost(&outcome.curve))
        };
        rows.push_str(&row(&format!("without {}", ablation.technique), ablation.curve.last(), cost));
    }
    format!(
        "<div class=\"wide\"><table>\n<tr><th></th><th>spp</th><th>seconds</th><th>relMSE</th>\
         <th>time factor for the same error</th></tr>\n{rows}</table></div>\n"
    )
}

fn seconds(time: Option<CurveSeconds>) -> String {
    match time {
        None => "–".to_owned(),
        Some(CurveSeconds::Interpolated(seconds)) => number(seconds),
        Some(CurveSeconds::Extrapolated(seconds)) => format!("({})", number(seconds)),
    }
}

fn percent(share: f64) -> String {
    format!("{} %", number(100.0 * share))
}

fn anchor(title: &str) -> String {
    title.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect()
}

/// A developed image as a PNG in a data URL.
fn png_url(picture: &LinearPicture, display: &Display) -> String {
    let rgb: Vec<u8> = picture.pixels.iter().flat_map(|&light| develop_pixel(light, display)).collect();
    let mut png = Vec::new();
    PngEncoder::new(&mut png)
        .write_image(&rgb, picture.width, picture.height, ExtendedColorType::Rgb8)
        .expect("an image in memory can be written to memory");
    format!("data:image/png;base64,{}", base64::engine::general_purpose::STANDARD.encode(png))
}
