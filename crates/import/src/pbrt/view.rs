//! Camera, film, filter and integrator of pbrt.

use crate::pbrt::params::Params;
use crate::pbrt::transforms::world_for;
use firstlight_files::printable;
use firstlight_format::bounds;
use firstlight_format::camera::CameraPart;
use firstlight_format::parts::FilmPart;
use firstlight_render::{Display, PixelFilter};
use glam::{DAffine3, DMat3, DVec3};

/// What is before `WorldBegin`.
#[derive(Debug, Default)]
pub(crate) struct ViewOptions {
    pub camera: Option<(String, Params)>,
    pub film: Option<(String, Params)>,
    pub filter: Option<(String, Params)>,
    pub integrator: Option<(String, Params)>,
    pub camera_from_world: DAffine3,
    /// The direction that is up, if `LookAt` says it.
    pub up: Option<DVec3>,
}

/// The same in our words.
pub(crate) struct ViewParts {
    pub camera: CameraPart,
    pub film: FilmPart,
    pub display: Display,
    pub max_depth: u32,
    /// From the world of the file to ours.
    pub world: DMat3,
}

impl ViewOptions {
    /// - `tell`: called with what is not shown.
    pub(crate) fn parts(&self, mut tell: impl FnMut(String)) -> ViewParts {
        let (film, aspect) = self.film(&mut tell);
        let camera_from_world = self.camera_from_world;
        let is_regular = camera_from_world.is_finite() && camera_from_world.inverse().is_finite();
        if !is_regular {
            tell("the transform of the camera has no inverse: the camera is at the origin".to_owned());
        }
        let camera_from_world = if is_regular { camera_from_world } else { DAffine3::IDENTITY };
        let world_from_camera = camera_from_world.inverse();
        let up = self.up.unwrap_or(world_from_camera.matrix3.y_axis);
        let world = world_for(&camera_from_world, up);
        let camera = self.camera(&(DAffine3::from_mat3(world) * world_from_camera), aspect, &mut tell);
        // A path of n reflections has one segment more.
        let of_integrator = self.integrator.as_ref().and_then(|(_, params)| params.count("maxdepth"));
        let max_depth = of_integrator.unwrap_or(5).saturating_add(1);
        ViewParts { camera, film, display: self.display(&mut tell), max_depth, world }
    }

    /// - `world_from_camera`: in our world, for a camera that looks along +z.
    fn camera(&self, world_from_camera: &DAffine3, aspect: f64, tell: &mut impl FnMut(String)) -> CameraPart {
        let none = ("perspective".to_owned(), Params::default());
        let (kind, params) = self.camera.as_ref().unwrap_or(&none);
        let axes = world_from_camera.matrix3;
        let size = axes.determinant().abs().cbrt();
        let (eye, forward, up) = (world_from_camera.translation, axes.z_axis.normalize(), axes.y_axis.normalize());
        let [width, height] = match params.numbers("screenwindow") {
            &[x0, x1, y0, y1] if x1 > x0 && y1 > y0 => {
                if x0 + x1 != 0.0 || y0 + y1 != 0.0 {
                    tell("a `screenwindow` beside the middle is not modelled: the view is centred".to_owned());
                }
                [x1 - x0, y1 - y0]
            }
            _ => {
                let aspect = params.number("frameaspectratio").filter(|aspect| *aspect > 0.0).unwrap_or(aspect);
                [2.0 * aspect.max(1.0), 2.0 / aspect.min(1.0)]
            }
        };
        if (width / height / aspect - 1.0).abs() > 1e-3 {
            tell("pixels that are not square are not modelled: the height of the view counts".to_owned());
        }
        let mut camera =
            CameraPart { look_at: None, forward: Some(forward), up, ..CameraPart::looking_at(eye, eye + forward) };
        if kind == "orthographic" {
            camera.orthographic_height = Some((height * size).clamp(bounds::MIN_SIZE, bounds::MAX_COORDINATE));
        } else {
            if kind != "perspective" {
                tell(format!(
                    "cameras of the kind `{}` are not modelled: a perspective one is used",
                    printable::name(kind)
                ));
            }
            let of_half = params.number("halffov").map(|half| 2.0 * half);
            let fov = params.number("fov").or(of_half).unwrap_or(90.0).clamp(1e-3, 179.0).to_radians();
            // `fov` belongs to the side of the window that reaches from -1 to 1.
            camera.vfov = (2.0 * (0.5 * height * (0.5 * fov).tan()).atan()).to_degrees().clamp(1e-3, 179.0);
        }
        let lens = params.number("lensradius").unwrap_or(0.0) * size;
        if lens > 0.0 {
            camera.lens_radius = Some(lens.min(1e6));
            let focus = params.number("focaldistance").unwrap_or(1e6) * size;
            camera.focus_distance = Some(focus.clamp(bounds::MIN_SIZE, bounds::MAX_COORDINATE));
        }
        camera
    }

    /// Whether the film is that of version 3, which has no exposure, and another filter where none is given.
    fn is_of_version_3(&self) -> bool {
        self.film.as_ref().is_some_and(|(kind, _)| kind == "image")
    }

    /// Size and filter, and width over height.
    fn film(&self, tell: &mut impl FnMut(String)) -> (FilmPart, f64) {
        let none = (String::new(), Params::default());
        let (_, params) = self.film.as_ref().unwrap_or(&none);
        let size = |name: &str, default| params.count(name).filter(|size| *size > 0).unwrap_or(default);
        let (width, height) = (size("xresolution", 1280), size("yresolution", 720));
        if params.has("cropwindow") || params.has("pixelbounds") {
            tell("a part of the film is not modelled: the whole image is rendered".to_owned());
        }
        let (kind, filter) = self.filter.as_ref().unwrap_or(&none);
        let radius = |default| filter.number("xradius").or(filter.number("xwidth")).unwrap_or(default);
        let (filter, radius) = match kind.as_str() {
            "box" => (PixelFilter::Box, radius(0.5)),
            "" if self.is_of_version_3() => (PixelFilter::Box, 0.5),
            "triangle" => (PixelFilter::Tent, radius(2.0)),
            "mitchell" => (PixelFilter::Mitchell, radius(2.0)),
            "" | "gaussian" => (PixelFilter::Gaussian, radius(if self.is_of_version_3() { 2.0 } else { 1.5 })),
            other => {
                tell(format!(
                    "the filter `{}` is not modelled: a Blackman–Harris filter is used",
                    printable::name(other)
                ));
                (PixelFilter::BlackmanHarris, f64::from(PixelFilter::BlackmanHarris.radius()))
            }
        };
        if radius != f64::from(filter.radius()) {
            tell(format!("the filter has a radius of {} pixels, not {radius}", filter.radius()));
        }
        (FilmPart { width, height, filter }, f64::from(width) / f64::from(height))
    }

    /// The sensor as an exposure. With `cie1931` luminance 1 is shown as 1 times the exposure time and ISO / 100.
    fn display(&self, tell: &mut impl FnMut(String)) -> Display {
        let Some((_, film)) = &self.film else { return Display::default() };
        if self.is_of_version_3() {
            let scale = film.number("scale").filter(|scale| *scale > 0.0).unwrap_or(1.0);
            return Display { exposure_stops: scale.log2().clamp(-64.0, 64.0) as f32, ..Display::default() };
        }
        if let Some(sensor) = film.string("sensor").filter(|sensor| *sensor != "cie1931") {
            tell(format!("the sensor `{}` is not modelled: colours are those of `cie1931`", printable::name(sensor)));
        }
        let shutter =
            |name: &str, default| self.camera.as_ref().and_then(|(_, params)| params.number(name)).unwrap_or(default);
        let seconds = shutter("shutterclose", 1.0) - shutter("shutteropen", 0.0);
        let ratio = seconds * film.number("iso").unwrap_or(100.0) / 100.0;
        let stops = if ratio > 0.0 && ratio != 1.0 { ratio.log2().clamp(-64.0, 64.0) } else { 0.0 };
        Display { exposure_stops: stops as f32, ..Display::default() }
    }
}
