//! Camera, film and integrator.

use crate::tungsten::converter::Converter;
use crate::tungsten::fields::Fields;
use firstlight_files::printable;
use firstlight_format::bounds;
use firstlight_format::camera::CameraPart;
use firstlight_format::parts::FilmPart;
use firstlight_render::PixelFilter;
use glam::DVec3;
use serde_json::Value;

/// Reflections of a path, where a scene does not say it.
const USUAL_BOUNCES: f64 = 64.0;

impl Converter<'_> {
    pub(crate) fn view(&mut self) {
        let camera = self.fields(self.root.get("camera"), "camera");
        let film = film(&camera);
        self.file.camera = eye(&camera, f64::from(film.width) / f64::from(film.height));
        self.file.film = film;
        let integrator = self.fields(self.root.get("integrator"), "integrator");
        // A path of n reflections has one segment more.
        let bounces = integrator.number("max_bounces").unwrap_or(USUAL_BOUNCES).clamp(0.0, 1e6);
        self.file.max_depth = Some(bounces as u32 + 1);
        if integrator.number("min_bounces").is_some_and(|least| least > 0.0) {
            integrator.tell("light of few reflections is not left out, as `min_bounces` says");
        }
    }
}

fn film(camera: &Fields) -> FilmPart {
    let size = match camera.get("resolution") {
        None => Some([1000.0, 563.0]),
        Some(Value::Array(list)) => match &list[..] {
            [width, height] => width.as_f64().zip(height.as_f64()).map(Into::into),
            _ => None,
        },
        Some(side) => side.as_f64().map(|side| [side; 2]),
    };
    let size = size.filter(|size| size.iter().all(|side| (1.0..=65_536.0).contains(side))).unwrap_or_else(|| {
        camera.tell("`resolution` is not one or two numbers of pixels: it is 1000 × 563");
        [1000.0, 563.0]
    });
    let filter = match camera.text("reconstruction_filter").unwrap_or("tent") {
        "box" => PixelFilter::Box,
        "tent" => PixelFilter::Tent,
        "gaussian" => PixelFilter::Gaussian,
        "mitchell_netravali" => PixelFilter::Mitchell,
        other => {
            let other = printable::name(other);
            camera.tell(format!("the filter `{other}` is not modelled: a Blackman–Harris filter is used"));
            PixelFilter::BlackmanHarris
        }
    };
    let [width, height] = size.map(|side| side as u32);
    FilmPart { width, height, filter }
}

/// - `aspect`: width over height of the image.
fn eye(camera: &Fields, aspect: f64) -> CameraPart {
    let placed = match camera.get("transform") {
        Some(_) => camera.transform("transform"),
        None => glam::DAffine3::from_translation(2.0 * DVec3::Z),
    };
    let eye = placed.translation.clamp(-DVec3::splat(bounds::MAX_COORDINATE), DVec3::splat(bounds::MAX_COORDINATE));
    let forward = placed.matrix3.z_axis.try_normalize().unwrap_or(DVec3::Z);
    let up = placed.matrix3.y_axis.try_normalize().unwrap_or(DVec3::Y);
    if placed.matrix3.determinant() < 0.0 {
        camera.tell("a camera that mirrors the world is not modelled: it does not mirror it");
    }
    let mut part =
        CameraPart { look_at: None, forward: Some(forward), up, ..CameraPart::looking_at(eye, eye + forward) };
    let kind = camera.kind();
    if !["", "pinhole", "thinlens"].contains(&kind) {
        let kind = printable::name(kind);
        camera.tell(format!("cameras of the kind `{kind}` are not modelled: a perspective one is used"));
    }
    // The field is that of the width.
    let half = (0.5 * camera.number("fov").unwrap_or(60.0).clamp(1e-3, 179.0)).to_radians();
    part.vfov = (2.0 * (half.tan() / aspect).atan()).to_degrees().clamp(1e-3, 179.0);
    if kind == "thinlens" {
        let radius = camera.number("aperture_size").unwrap_or(1e-3).clamp(0.0, 1e6);
        let focus = camera.number("focus_distance").unwrap_or(1.0);
        part.lens_radius = Some(radius);
        part.focus_distance = Some(focus.clamp(bounds::MIN_SIZE, bounds::MAX_COORDINATE));
        for name in ["cateye", "focus_pivot"] {
            if camera.get(name).is_some_and(|value| value.as_f64() != Some(0.0) && value.as_str() != Some("")) {
                camera.tell(format!("`{name}` is not modelled"));
            }
        }
        let aperture = Fields::of(camera.get("aperture"), "aperture", camera.source);
        match aperture.kind() {
            "blade" => part.blades = aperture.number("blades").unwrap_or(6.0).clamp(0.0, 32.0) as u32,
            "" | "disk" => {}
            _ => aperture.tell("an image as aperture is not modelled: it is round"),
        }
    }
    part
}
