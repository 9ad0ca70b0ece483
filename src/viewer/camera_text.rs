//! A view as text: the camera block of a scene file.

use crate::frame::navigation::Rig;
use crate::scene::file::CameraPart;

/// What a scene file says to be seen from here; the pivot becomes `look_at`.
pub fn camera_text(rig: &Rig) -> String {
    let Rig { view, projection, lens } = rig;
    let radius = lens.effective_radius();
    let part = CameraPart {
        up: view.up,
        vfov: projection.vfov_deg,
        lens_radius: (radius > 0.0).then_some(radius),
        focus_distance: Some(lens.focus_distance),
        blades: lens.blades,
        blade_rotation: lens.blade_rotation_deg,
        ..CameraPart::looking_at(view.eye, view.pivot())
    };
    let style = ron::ser::PrettyConfig::new()
        .depth_limit(2)
        .indentor("    ")
        .extensions(ron::extensions::Extensions::IMPLICIT_SOME)
        .compact_arrays(true);
    // Without the line that switches the extension on: a scene file has it switched on already.
    let options = ron::Options::default().with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME);
    let text = options.to_string_pretty(&part, style).expect("numbers can be written");
    format!("camera: {text},")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::file::SceneFile;
    use crate::scene::{Lens, Projection, View};
    use glam::DVec3;

    #[test]
    fn a_printed_camera_is_what_a_scene_file_reads() {
        let view = View::look_at(DVec3::new(0.1, 2.0, -3.0), DVec3::new(1.0 / 3.0, 0.0, 5e6), DVec3::Y).unwrap();
        let lens = Lens { blades: 6, blade_rotation_deg: 15.0, ..Lens::thin(0.025, 1.75) };
        let rig = Rig { view, projection: Projection { vfov_deg: 33.3 }, lens };
        let text = format!("(\n{}\n)", camera_text(&rig));
        let camera = SceneFile::parse(&text, "printed").unwrap_or_else(|error| panic!("{error}\n{text}")).camera;
        assert_eq!((camera.eye, camera.look_at, camera.up), (view.eye, Some(view.pivot()), view.up));
        assert_eq!((camera.vfov, camera.lens_radius, camera.focus_distance), (33.3, Some(0.025), Some(1.75)));
        assert_eq!((camera.blades, camera.blade_rotation), (6, 15.0));

        let sharp = camera_text(&Rig { lens: Lens { enabled: false, ..lens }, ..rig });
        assert!(!sharp.contains("lens_radius"), "{sharp}");
    }
}
