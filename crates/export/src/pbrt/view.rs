//! Camera, film, filter and integrator.

use crate::pbrt::Writer;
use crate::pbrt::text::{List, numbers};
use firstlight_format::camera::camera;
use firstlight_render::{Integrator, PixelFilter};
use glam::{DVec3, Vec3};

/// Path length that stands for an unlimited one.
const LONGEST: u32 = 1000;
/// Samples per pixel that a scene asks for.
const SAMPLES: u32 = 64;

impl Writer<'_> {
    pub(crate) fn view(&mut self, image: &str) {
        let file = &self.scene.file;
        let (view, projection, lens) = camera(&file.camera);
        let (width, height) = (file.film.width, file.film.height);
        let aspect = f64::from(width) / f64::from(height);
        // A camera without roll says which direction is up in its world.
        let level = DVec3::Y.reject_from_normalized(view.forward).normalize_or_zero();
        let up = if level.dot(view.up) > 1.0 - 1e-12 { DVec3::Y } else { view.up };
        let target = view.eye + view.pivot_distance * view.forward;
        // pbrt is left-handed: mirrored, the world keeps its coordinates.
        self.text.line("Scale -1 1 1");
        let [eye, target, up] = [view.eye, target, up].map(|point| numbers(point.to_array()));
        self.text.line(&format!("LookAt {eye}  {target}  {up}"));
        let mut list = List::default();
        let kind = match projection.orthographic_height {
            Some(height) => {
                let (x, y) = (0.5 * height * aspect, 0.5 * height);
                list = list.floats("screenwindow", &[-x, x, -y, y]);
                "orthographic"
            }
            None => {
                // Of the shorter side.
                let half = (0.5 * projection.vfov_deg).to_radians().tan() * aspect.min(1.0);
                list = list.float("fov", 2.0 * half.atan().to_degrees());
                "perspective"
            }
        };
        if lens.enabled && lens.radius > 0.0 {
            list = list.float("lensradius", lens.radius);
            list = list.float("focaldistance", lens.focus_distance.min(1e6 * view.pivot_distance));
            if lens.blades >= 3 {
                self.warnings.push("the aperture of the camera is round");
            }
        }
        self.text.directive("Camera", &[kind], list);
        let mut film = List::default().integer("xresolution", width).integer("yresolution", height);
        if file.display.exposure_stops != 0.0 {
            film = film.float("iso", 100.0 * file.display.exposure_stops.exp2());
        }
        self.text.directive("Film", &["rgb"], film.string("filename", image));
        let (filter, radius) = match file.film.filter {
            PixelFilter::Box => ("box", 0.5),
            PixelFilter::Tent => ("triangle", 1.0),
            PixelFilter::Mitchell => ("mitchell", 2.0),
            PixelFilter::Gaussian => ("gaussian", 1.5),
            PixelFilter::BlackmanHarris => {
                self.warnings.push("the pixel filter is a Gaussian of nearly the same width");
                ("gaussian", 1.5)
            }
        };
        let filter_list = List::default().float("xradius", radius).float("yradius", radius);
        self.text.directive("PixelFilter", &[filter], filter_list);
        // A path of n segments has one reflection less.
        let depth = file.max_depth.map_or(LONGEST, |depth| depth.saturating_sub(1));
        self.text.directive("Integrator", &["volpath"], List::default().integer("maxdepth", depth));
        self.text.directive("Sampler", &["zsobol"], List::default().integer("pixelsamples", SAMPLES));
        if file.integrator != Integrator::default() {
            self.warnings.push("the integrator is path tracing");
        }
        if file.air.0 != Vec3::ZERO {
            self.warnings.push("the absorption of the air is left out");
        }
        if !file.cameras.is_empty() {
            self.warnings.push("a scene of pbrt has one camera: the others are left out");
        }
    }
}
