//! Changes of a lens: focus distance and aperture.

use crate::scene::Lens;

/// Aperture radius of a lens that had none, relative to the focus distance: a visible but moderate blur.
const FIRST_APERTURE: f64 = 0.005;

/// Sets the focus distance in metres, if it is positive.
pub fn focus_at(lens: &Lens, distance: f64) -> Lens {
    if distance > 0.0 { Lens { focus_distance: distance, ..*lens } } else { *lens }
}

/// Multiplies the focus distance; from infinity it returns to `near`, metres.
pub fn scale_focus(lens: &Lens, factor: f64, near: f64) -> Lens {
    if lens.focus_distance.is_infinite() {
        return if factor < 1.0 { focus_at(lens, near) } else { *lens };
    }
    let distance = lens.focus_distance * factor;
    if distance.is_normal() { focus_at(lens, distance) } else { *lens }
}

/// Multiplies the aperture and switches depth of field on; a closed aperture opens first.
pub fn scale_aperture(lens: &Lens, factor: f64) -> Lens {
    let open = with_aperture(lens);
    if !lens.enabled {
        return open;
    }
    let radius = open.radius * factor;
    if radius.is_normal() { set_aperture(&open, radius) } else { *lens }
}

/// Sets the radius of the aperture, metres, and switches depth of field on; 0 switches it off.
pub fn set_aperture(lens: &Lens, radius: f64) -> Lens {
    if !(radius.is_finite() && radius >= 0.0) {
        return *lens;
    }
    Lens { radius, enabled: radius > 0.0, ..*lens }
}

/// Switches depth of field off, or on with its last aperture.
///
/// A lens without an aperture gets a radius of 0.5 % of the focus distance, or 5 mm for a focus at infinity.
pub fn toggle_depth_of_field(lens: &Lens) -> Lens {
    if lens.enabled { Lens { enabled: false, ..*lens } } else { with_aperture(lens) }
}

/// Switches depth of field on, with a non-zero aperture.
fn with_aperture(lens: &Lens) -> Lens {
    let radius = match (lens.radius > 0.0, lens.focus_distance.is_finite()) {
        (true, _) => lens.radius,
        (false, true) => FIRST_APERTURE * lens.focus_distance,
        // No reference length: 5 mm.
        (false, false) => FIRST_APERTURE,
    };
    Lens { radius, enabled: true, ..*lens }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn focus_and_aperture_go_by_factors_and_survive_the_ends() {
        let lens = Lens::pinhole(4.0);
        assert_eq!(scale_focus(&lens, 1.5, 1.0).focus_distance, 6.0);
        let far = focus_at(&lens, f64::INFINITY);
        assert_eq!(scale_focus(&far, 2.0, 3.0), far);
        assert_eq!(scale_focus(&far, 0.5, 3.0).focus_distance, 3.0);
        let on = toggle_depth_of_field(&lens);
        assert!(on.enabled && on.effective_radius() > 0.0, "a pinhole opens: {on:?}");
        assert_eq!(toggle_depth_of_field(&on).effective_radius(), 0.0);
        assert_eq!(toggle_depth_of_field(&toggle_depth_of_field(&on)), on);
        assert_eq!(scale_aperture(&lens, 2.0), on, "the first press shows the blur");
        assert_eq!(scale_aperture(&on, 2.0).radius, 2.0 * on.radius);
        assert!(!set_aperture(&on, 0.0).enabled);
        for nonsense in [f64::NAN, -1.0, 0.0, f64::INFINITY] {
            assert_eq!(scale_aperture(&on, nonsense), on);
            assert_eq!(scale_focus(&lens, nonsense, 1.0), lens);
        }
    }
}
