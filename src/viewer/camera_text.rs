//! A view as the camera block of a scene file.

use crate::format::CameraPart;
use crate::frame::navigation::Rig;
use crate::scene::camera_part;

/// Returns the camera block of this view; the pivot becomes `look_at`.
pub fn camera_text(rig: &Rig) -> String {
    let Rig { view, projection, lens } = rig;
    let radius = lens.effective_radius();
    // A millionth of the viewing distance is a thousandth of a pixel.
    let place = |point: glam::DVec3| point.map(|value| rounded(value, view.pivot_distance));
    let part = CameraPart {
        up: view.up.map(|value| rounded(value, 1.0)),
        vfov: rounded(projection.vfov_deg, projection.vfov_deg),
        orthographic_height: projection.orthographic_height.map(|height| rounded(height, height)),
        lens_radius: (radius > 0.0).then_some(rounded(radius, radius)),
        focus_distance: Some(rounded(lens.focus_distance, lens.focus_distance)),
        eye: place(view.eye),
        look_at: Some(place(view.pivot())),
        forward: None,
        pivot_distance: None,
        depth_of_field: None,
        ..camera_part(view, projection, lens, None)
    };
    let style = ron::ser::PrettyConfig::new()
        .depth_limit(2)
        .indentor("    ")
        .extensions(ron::extensions::Extensions::IMPLICIT_SOME)
        .compact_arrays(true);
    // Without the line that enables the extension, because a scene file has it already.
    let options = ron::Options::default().with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME);
    let text = options.to_string_pretty(&part, style).expect("numbers can be written");
    format!("camera: {text},")
}

/// Rounds to a millionth of `scale`, in as few digits as possible.
fn rounded(value: f64, scale: f64) -> f64 {
    let step = 10f64.powf(6.0 - scale.abs().log10().floor());
    let rounded = (value * step).round() / step;
    // Adding 0 removes a negative zero. If rounding fails, for a scale near 0, the value is unchanged.
    if rounded.is_finite() { rounded + 0.0 } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::SceneFile;
    use crate::scene::{Lens, Projection, View};
    use glam::DVec3;

    #[test]
    fn a_printed_camera_is_what_a_scene_file_reads() {
        let view = View::look_at(DVec3::new(0.1, 2.0, -3.0), DVec3::new(1.0 / 3.0, 0.0, 5e6), DVec3::Y).unwrap();
        let lens = Lens { blades: 6, blade_rotation_deg: 15.0, ..Lens::thin(0.025, 1.75) };
        let rig = Rig { view, projection: Projection::perspective(33.3), lens };
        let text = format!("(\n{}\n)", camera_text(&rig));
        let camera = SceneFile::parse(&text, "printed").unwrap_or_else(|error| panic!("{error}\n{text}")).camera;
        let near = |a: DVec3, b: DVec3, scale: f64| assert!((a - b).abs().max_element() <= 1e-6 * scale, "{a} for {b}");
        near(camera.eye, view.eye, view.pivot_distance);
        near(camera.look_at.unwrap(), view.pivot(), view.pivot_distance);
        near(camera.up, view.up, 1.0);
        assert_eq!((camera.vfov, camera.lens_radius, camera.focus_distance), (33.3, Some(0.025), Some(1.75)));
        assert_eq!((camera.blades, camera.blade_rotation), (6, 15.0));

        let sharp = camera_text(&Rig { lens: Lens { enabled: false, ..lens }, ..rig });
        assert!(!sharp.contains("lens_radius"), "{sharp}");
    }
}
