//! The exposure of an image by its brightness.

use crate::render::{Film, luminance};

/// Radiance that half of the image is darker than, as the display shows it: a medium grey.
const GREY: f32 = 0.18;

/// Exposure in stops, to a third, with which the median of what is lit is a medium grey; `None` if nothing is lit.
pub fn usual_exposure(film: &Film) -> Option<f32> {
    let levels = film.means().into_iter().map(luminance);
    let mut lit: Vec<f32> = levels.filter(|level| *level > 0.0 && level.is_finite()).collect();
    if lit.is_empty() {
        return None;
    }
    let middle = lit.len() / 2;
    let median = *lit.select_nth_unstable_by(middle, f32::total_cmp).1;
    Some((3.0 * (GREY / median).log2()).round() / 3.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::core::offline::Target;
    use crate::frame::{Session, SessionOptions};
    use crate::scene::SceneSource;
    use std::time::Duration;

    #[test]
    fn half_of_what_is_lit_is_darker_than_grey() {
        let exposure_of = |radiance: f32| {
            let text = format!("(environment: constant({radiance}), camera: (eye: (0, 0, 5), look_at: (0, 0, 0)))");
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("even.ron");
            std::fs::write(&path, text).unwrap();
            let target = Target { spp: Some(1), ..Target::default() };
            let mut session =
                Session::new(SessionOptions { width: 16, height: 16, target, ..Default::default() }).unwrap();
            session.open(SceneSource::Scene(path));
            while !(session.status().done && session.is_idle()) {
                session.update(Duration::ZERO);
                std::thread::sleep(Duration::from_millis(1));
            }
            usual_exposure(&session.film_snapshot().unwrap())
        };
        assert_eq!(exposure_of(0.18), Some(0.0));
        assert_eq!(exposure_of(0.18 * 16.0), Some(-4.0));
        assert_eq!(exposure_of(0.18 / 2f32.powf(2.1)), Some(2.0));
        assert_eq!(exposure_of(0.0), None);
    }
}
