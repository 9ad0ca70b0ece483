//! Integrator, sensors and film.

use crate::mitsuba::Writer;
use firstlight_format::camera::{CameraPart, camera};
use firstlight_format::view::{Lens, Projection, View};
use firstlight_render::{Integrator, PixelFilter};
use glam::{DAffine3, DMat3, DVec3};

/// Samples per pixel that a scene asks for.
const SAMPLES: &str = "64";

impl Writer<'_> {
    pub(crate) fn view(&mut self) {
        let file = &self.scene.file;
        // Only `volpath` knows what absorbs light.
        let has_media = self.surfaces.values().any(|surface| surface.absorption != glam::Vec3::ZERO);
        self.xml.open("integrator", &[("type", if has_media { "volpath" } else { "path" })]);
        // The same count: 1 shows emitters only.
        let depth = file.max_depth.map_or_else(|| "-1".to_owned(), |depth| depth.to_string());
        self.xml.value("integer", "max_depth", &depth);
        self.xml.close();
        if file.integrator != Integrator::default() {
            self.warnings.push("the integrator is path tracing");
        }
        if file.air.0 != glam::Vec3::ZERO {
            self.warnings.push("the absorption of the air is left out");
        }
        if file.display.exposure_stops != 0.0 {
            self.warnings.push("the exposure is left out: images of Mitsuba are linear");
        }
        self.sensor(&file.camera, "camera");
        for (name, part) in file.cameras.iter() {
            self.sensor(part, name);
        }
    }

    fn sensor(&mut self, part: &CameraPart, name: &str) {
        let id = self.taken.free(name);
        let (view, projection, lens) = camera(part);
        let View { eye, forward, up, pivot_distance } = view;
        let (Projection { vfov_deg, orthographic_height }, film) = (projection, self.scene.file.film);
        let Lens { radius, focus_distance, enabled, blades, .. } = lens;
        let has_lens = enabled && radius > 0.0;
        let plugin = match (orthographic_height, has_lens) {
            (Some(_), has_lens) => {
                if has_lens {
                    self.tell(name, "an orthographic camera has no lens in Mitsuba");
                }
                "orthographic"
            }
            (None, true) => "thinlens",
            (None, false) => "perspective",
        };
        if has_lens && blades >= 3 {
            self.tell(name, "the aperture is round");
        }
        self.xml.open("sensor", &[("type", plugin), ("id", &id)]);
        let axes = DMat3::from_cols(up.cross(forward), up, forward);
        // The film is as wide as the square from −1 to 1.
        let wide =
            orthographic_height.map_or(1.0, |height| 0.5 * height * f64::from(film.width) / f64::from(film.height));
        let axes = axes * DMat3::from_diagonal(DVec3::new(wide, wide, 1.0));
        self.xml.transform("to_world", &DAffine3::from_mat3_translation(axes, eye));
        if orthographic_height.is_none() {
            self.xml.value("string", "fov_axis", "y");
            self.xml.float("fov", vfov_deg);
        }
        if plugin == "thinlens" {
            self.xml.float("aperture_radius", radius);
            self.xml.float("focus_distance", focus_distance.min(1e6 * pivot_distance));
        }
        // Mitsuba shows nothing nearer or farther.
        self.xml.float("near_clip", 1e-4 * pivot_distance);
        self.xml.float("far_clip", 1e6 * pivot_distance);
        self.xml.open("film", &[("type", "hdrfilm")]);
        self.xml.value("integer", "width", &film.width.to_string());
        self.xml.value("integer", "height", &film.height.to_string());
        self.xml.value("string", "component_format", "float32");
        let filter = match film.filter {
            PixelFilter::Box => "box",
            PixelFilter::Tent => "tent",
            PixelFilter::Mitchell => "mitchell",
            PixelFilter::Gaussian => "gaussian",
            PixelFilter::BlackmanHarris => {
                self.warnings.push("the pixel filter is a Gaussian of nearly the same width");
                "gaussian"
            }
        };
        self.xml.leaf("rfilter", &[("type", filter)]);
        self.xml.close();
        self.xml.open("sampler", &[("type", "independent")]);
        self.xml.value("integer", "sample_count", SAMPLES);
        self.xml.close();
        self.xml.close();
    }
}
