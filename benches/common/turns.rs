//! Two ways to render one image, in turns.

use firstlight::render::{Exposed, Film, RenderSettings, advance};
use firstlight::report::cpu_seconds;

pub const ROUNDS: usize = 9;

/// CPU seconds of each, and of the second per one of the first: medians over rounds. The films must be the same.
pub fn compare(name: &str, two: [Exposed; 2], settings: &RenderSettings, spp: u32) -> [f64; 3] {
    let mut figures = [vec![], vec![], vec![]];
    for round in 0..=ROUNDS {
        let [(a, first), (b, second)] = two.map(|scene| render(scene, settings, spp));
        assert!(first == second, "{name}: the films differ");
        // The first round warms up.
        if round > 0 {
            figures.iter_mut().zip([a, b, b / a]).for_each(|(figures, figure)| figures.push(figure));
        }
    }
    figures.map(|mut figures| median(&mut figures))
}

/// CPU seconds and the image, bit by bit.
fn render(scene: Exposed, settings: &RenderSettings, spp: u32) -> (f64, Vec<[u32; 3]>) {
    let mut film = Film::new(256, 192);
    let before = cpu_seconds().expect("a system that tells CPU time");
    advance(scene, settings, &mut film, spp, &|| false);
    let seconds = cpu_seconds().expect("a system that tells CPU time") - before;
    (seconds, film.means().iter().map(|mean| mean.to_array().map(f32::to_bits)).collect())
}

pub fn median(values: &mut [f64]) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values[values.len() / 2]
}
