//! All steps of all scenes as one CSV file (RFC 4180), for further analysis.

use crate::report::{ConvergenceCurve, DenoisedCurve, Distance, SceneOutcome, Step};
use std::fmt::Write;

const HEADER: &str = "scene,width,height,without,denoiser,spp,wall_s,cpu_s,threads,camera_paths,rays,relmse,rmse,flip,\
    estimated_error,estimated_low,estimated_high,reference_differs\n";

/// Whether a text is a table, also one of other columns.
pub fn is_csv(text: &str) -> bool {
    text.starts_with("scene,width,height,")
}

/// One row per step; `without` is the technique that is switched off, `denoiser` the one whose result is compared, with
/// the cost of the samples alone, `reference_differs` the share of the image that
/// differs from a given reference by more than noise can. Fields are empty if unknown.
pub fn csv(outcomes: &[SceneOutcome]) -> String {
    let mut text = HEADER.to_owned();
    for outcome in outcomes {
        write_curve(&mut text, outcome, "", &outcome.curve);
        for DenoisedCurve { name, steps } in &outcome.denoised {
            for (of, raw) in steps.iter().filter_map(|of| Some((of, outcome.curve.at(of.spp)?))) {
                let estimate = of.estimate.map(|(error, [low, high])| [error, low, high]);
                write_row(&mut text, outcome, ["", name], raw, &of.distance, estimate);
            }
        }
        for ablation in &outcome.ablations {
            write_curve(&mut text, outcome, ablation.technique, &ablation.curve);
        }
    }
    text
}

fn write_curve(text: &mut String, outcome: &SceneOutcome, without: &str, curve: &ConvergenceCurve) {
    for step in &curve.steps {
        let estimate = step.estimate.map(|estimate| [estimate.relative, estimate.low, estimate.high]);
        write_row(text, outcome, [without, ""], step, &step.distance, estimate);
    }
}

/// - `estimate`: the error that is told, and the bounds of its interval.
fn write_row(
    text: &mut String,
    outcome: &SceneOutcome,
    [without, denoiser]: [&str; 2],
    step: &Step,
    distance: &Distance,
    estimate: Option<[f64; 3]>,
) {
    let optional = |value: Option<f64>| value.map_or(String::new(), |value| format!("{value}"));
    let spent = step.spent;
    let _ = writeln!(
        text,
        "{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}",
        field(&outcome.title),
        outcome.width,
        outcome.height,
        field(without),
        field(denoiser),
        step.spp,
        spent.wall_seconds,
        optional(spent.cpu_seconds),
        spent.threads,
        spent.camera_paths,
        spent.rays,
        distance.relative_mse,
        distance.rmse,
        distance.flip,
        optional(estimate.map(|e| e[0])),
        optional(estimate.map(|e| e[1])),
        optional(estimate.map(|e| e[2])),
        optional(outcome.foreign_share),
    );
}

fn field(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_with_commas_and_quotes_stay_one_field() {
        assert_eq!(field("plain"), "plain");
        assert_eq!(field("a, \"b\".ron"), "\"a, \"\"b\"\".ron\"");
    }
}
