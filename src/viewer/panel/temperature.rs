//! The colour of a light by its temperature.

use crate::import::color_of_temperature;
use egui::{DragValue, Ui};
use glam::{DVec3, Vec3};
use std::sync::OnceLock;

/// Temperatures that can be set, kelvins.
const RANGE: [f64; 2] = [1000.0, 20_000.0];
/// The field's value for a colour that no black body has, kelvins.
const WHITE: f64 = 6500.0;
/// How far the channels of a colour may be from those of a black body: the white of the display is 0.07 from it.
const NEAR: f64 = 0.08;

/// A field of kelvins; the colour that was set, its largest channel 1.
///
/// - `hue`: linear, the largest channel 1.
pub fn kelvins(ui: &mut Ui, hue: Vec3) -> Option<DVec3> {
    let known = temperature_of(hue.as_dvec3());
    let mut new = known.unwrap_or(WHITE);
    let text = move |kelvins: f64| match known {
        None if kelvins == WHITE => "K".to_owned(),
        _ => format!("{kelvins:.0} K"),
    };
    let drag = DragValue::new(&mut new).speed(10.0).range(RANGE[0]..=RANGE[1]).max_decimals(0);
    let drag = drag.custom_formatter(move |kelvins, _| text(kelvins)).update_while_editing(false);
    let drag = drag.custom_parser(|text| text.trim().trim_end_matches(['K', 'k']).trim().parse().ok());
    let hint = "colour by temperature, kelvins: 1900 is a candle, 2700 warm, 4000 neutral, 6500 daylight";
    ui.add(drag).on_hover_text(hint).changed().then(|| color_of_temperature(new))
}

/// The temperature of a colour, to 10 kelvins; `None` if no black body has it.
fn temperature_of(hue: DVec3) -> Option<f64> {
    static COLORS: OnceLock<Vec<DVec3>> = OnceLock::new();
    const STEP: f64 = 100.0;
    let n = ((RANGE[1] - RANGE[0]) / STEP) as usize + 1;
    let at = |i: usize| RANGE[0] + STEP * i as f64;
    let colors = COLORS.get_or_init(|| (0..n).map(|i| color_of_temperature(at(i))).collect());
    // It rises with the temperature.
    let blueness = |color: DVec3| (color.y + color.z) / color.x.max(1e-6);
    let next = colors.partition_point(|color| blueness(*color) < blueness(hue)).clamp(1, n - 1);
    let [low, high] = [next - 1, next].map(|i| blueness(colors[i]));
    let share = ((blueness(hue) - low) / (high - low)).clamp(0.0, 1.0);
    let color = colors[next - 1].lerp(colors[next], share);
    let kelvins = ((at(next - 1) + STEP * share) / 10.0).round() * 10.0;
    (color - hue).abs().cmple(DVec3::splat(NEAR)).all().then_some(kelvins)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lights_have_the_temperature_that_was_set_and_paint_has_none() {
        for kelvins in [1000.0, 1900.0, 2700.0, 4000.0, 5030.0, 6500.0, 12_340.0, 20_000.0] {
            let found = temperature_of(color_of_temperature(kelvins)).unwrap();
            assert!((found / kelvins - 1.0).abs() < 0.01, "{found} for {kelvins}");
        }
        let warm = color_of_temperature(2700.0);
        assert!(warm.x == 1.0 && warm.y > 0.3 && warm.z < 0.2, "{warm}");
        assert!((6000.0..7000.0).contains(&temperature_of(DVec3::ONE).unwrap()), "the white of the display");
        for paint in [DVec3::Y, DVec3::new(1.0, 0.2, 0.9), DVec3::new(0.2, 1.0, 0.3)] {
            assert_eq!(temperature_of(paint), None, "{paint}");
        }
    }
}
