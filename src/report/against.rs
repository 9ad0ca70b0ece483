//! An image against a reference that another program made, in a few words.

use crate::report::{LinearPicture, SceneOutcome, ZTest};
use glam::DVec3;
use std::fmt::Write;

/// Means of an image over those of another one, per channel; NaN where both are black.
pub fn mean_ratio(picture: &LinearPicture, reference: &LinearPicture) -> DVec3 {
    let sum = |picture: &LinearPicture| picture.pixels.iter().map(|pixel| pixel.as_dvec3()).sum::<DVec3>();
    sum(picture) / sum(reference)
}

/// Ratio of the means, relMSE and FLIP of the last step of a scene, and the result of a z-test.
pub fn against_text(outcome: &SceneOutcome, test: Option<&ZTest>) -> String {
    let (step, ratio) = (outcome.curve.last(), mean_ratio(&outcome.last, &outcome.reference));
    let mut text = format!(
        "against the reference, {} samples per pixel: mean {:.4} {:.4} {:.4} (red, green, blue), relMSE {:.3e}, \
         FLIP {:.4}\n",
        step.spp, ratio.x, ratio.y, ratio.z, step.distance.relative_mse, step.distance.flip
    );
    if let Some(test) = test {
        let _ = writeln!(
            text,
            "z-test: {:.2} % of the values lie within {:.2} standard deviations, the largest at {:.1}: {}",
            100.0 * test.share,
            test.limit,
            test.largest,
            if test.passes() { "passed" } else { "failed, 99.75 % are needed" }
        );
    }
    text
}
