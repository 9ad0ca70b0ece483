//! Sensors, films and integrators.

use crate::mitsuba::converter::Converter;
use crate::mitsuba::graph::Node;
use firstlight_files::printable;
use firstlight_format::camera::CameraPart;
use firstlight_format::error::SceneError;
use firstlight_render::PixelFilter;
use glam::{DMat4, DVec3};

/// Degrees; a camera has a field of view between these.
const FIELDS: std::ops::RangeInclusive<f64> = 0.01..=179.0;

/// Degrees, of cameras that say theirs otherwise: about that of a lens of 50 mm.
const UNKNOWN_FIELD: f64 = 40.0;

impl Converter<'_> {
    /// The transform of the sensor, before any of the scene.
    pub(crate) fn sensor_to_world(node: Node) -> Result<DMat4, SceneError> {
        node.transform("to_world")
    }

    /// Camera, film and filter of a sensor; `None` if there is no such camera.
    pub(crate) fn sensor(&mut self, node: Node) -> Result<Option<CameraPart>, SceneError> {
        node.ignore(&["near_clip", "far_clip", "srf", "shutter_open", "shutter_close"]);
        node.children("sampler")?.into_iter().for_each(Node::skip);
        let (film, size) = self.film(node)?;
        let aspect = size.0 / size.1;
        // The last is of version 0.x.
        let is_orthographic = matches!(node.plugin(), "orthographic" | "telecentric");
        let is_known = is_orthographic || matches!(node.plugin(), "perspective" | "thinlens");
        let is_perspective = !is_orthographic;
        if !is_known {
            // Others may be lenses, where these are no cameras.
            let is_meter = node.plugin().ends_with("meter") || node.plugin().ends_with("distant");
            let is_camera = node.has("to_world") && !is_meter;
            let other = if is_camera { "a perspective one" } else { "another one" };
            let plugin = printable::name(node.plugin()).into_owned();
            self.tell(node, &format!("sensors of type {plugin} are not modelled: the camera is {other}"));
            node.skip();
            if !is_camera {
                return Ok(None);
            }
        }
        let matrix = self.world * Self::sensor_to_world(node)?;
        let eye = matrix.w_axis.truncate();
        let (left, up, forward) = (matrix.x_axis.truncate(), matrix.y_axis.truncate(), matrix.z_axis.truncate());
        let Some(forward) = forward.try_normalize().filter(|forward| {
            eye.is_finite()
                && eye.abs().max_element() <= firstlight_format::bounds::MAX_COORDINATE
                && up.cross(*forward).try_normalize().is_some()
        }) else {
            return Err(node.error("`to_world` of the sensor has no direction of view, or no direction that is up"));
        };
        if up.cross(forward).dot(left) < 0.0 {
            self.tell(node, "a sensor that mirrors the image is not modelled: left and right are exchanged");
        }
        let mut camera = CameraPart {
            look_at: None,
            forward: Some(forward),
            up: up.normalize(),
            ..CameraPart::looking_at(eye, eye + forward)
        };
        let offsets = ["principal_point_offset_x", "principal_point_offset_y"];
        for name in offsets {
            if node.float_or(name, 0.0)? != 0.0 {
                self.tell(node, "a principal point off the middle is not modelled: it is the middle of the film");
            }
        }
        if is_perspective {
            let field = self.horizontal_field(node, aspect);
            let field = if is_known { field? } else { field.unwrap_or(UNKNOWN_FIELD) };
            let half = (0.5 * field.to_radians()).tan();
            // The part of the film that is shown.
            let share = film.1 / size.1;
            let vfov = 2.0 * (half / aspect * share).atan().to_degrees();
            camera.vfov = vfov.clamp(*FIELDS.start(), *FIELDS.end());
            if camera.vfov != vfov {
                self.tell(node, "a field of view beyond all cameras is not modelled: it is the nearest that is");
            }
        } else {
            let (x, y) = (left.length(), up.length());
            if (x - y).abs() > 1e-6 * x.max(y) {
                self.tell(node, "pixels of an orthographic sensor that are not square are not modelled");
            }
            camera.orthographic_height = Some(2.0 * x / aspect * film.1 / size.1);
        }
        if node.plugin() == "thinlens" {
            let missing = || node.error("a thinlens needs an `aperture_radius`");
            camera.lens_radius = Some(node.float("aperture_radius")?.ok_or_else(missing)?.max(0.0));
            camera.focus_distance = Some(node.float_or("focus_distance", 1e4)?);
        }
        // Of a pinhole it has no effect.
        node.ignore(&["focus_distance"]);
        Ok(Some(camera))
    }

    /// Degrees.
    pub(crate) fn horizontal_field(&mut self, node: Node, aspect: f64) -> Result<f64, SceneError> {
        let tangent = |degrees: f64| (0.5 * degrees.to_radians()).tan();
        let diagonal = |tangent: f64| tangent / (1.0 + 1.0 / (aspect * aspect)).sqrt();
        let half = match node.float("fov")? {
            Some(fov) => {
                let axis = node.text("fov_axis")?.unwrap_or("x").to_ascii_lowercase();
                match axis.as_str() {
                    "x" => tangent(fov),
                    "y" => tangent(fov) * aspect,
                    "smaller" if aspect > 1.0 => tangent(fov) * aspect,
                    "larger" if aspect <= 1.0 => tangent(fov) * aspect,
                    "smaller" | "larger" => tangent(fov),
                    "diagonal" => diagonal(tangent(fov)),
                    _ => return Err(node.error("`fov_axis` must be x, y, diagonal, smaller or larger")),
                }
            }
            None => {
                let text = node.text("focal_length")?.unwrap_or("50mm").trim();
                let length: Option<f64> = text.strip_suffix("mm").unwrap_or(text).trim().parse().ok();
                let length = length.filter(|length| *length > 0.0);
                let length = length.ok_or_else(|| node.error("`focal_length` must be millimetres, such as 50mm"))?;
                // Of a film of 36 mm × 24 mm, by its diagonal.
                diagonal((36.0_f64 * 36.0 + 24.0 * 24.0).sqrt() / (2.0 * length))
            }
        };
        match half > 0.0 && half.is_finite() {
            true => Ok(2.0 * half.atan().to_degrees()),
            false => Err(node.error("the field of view must be between 0° and 180°")),
        }
    }

    /// Sets size and filter of the image; returns what is shown of the film, and the size of the whole film, pixels.
    fn film(&mut self, node: Node) -> Result<((f64, f64), (f64, f64)), SceneError> {
        let Some(&film) = node.children("film")?.first() else {
            (self.file.film.width, self.file.film.height) = (768, 576);
            self.file.film.filter = PixelFilter::Gaussian;
            return Ok(((768.0, 576.0), (768.0, 576.0)));
        };
        film.ignore(&[
            "pixel_format",
            "component_format",
            "file_format",
            "banner",
            "gamma",
            "exposure",
            "tonemap_method",
            "attach_log",
            "high_quality_edges",
            "compensate",
            "sample_border",
            "key",
            "burn",
        ]);
        let side =
            |name: &str, default: i64| {
                let pixels = film.integer(name)?.unwrap_or(default);
                match (1..=i64::from(firstlight_format::bounds::MAX_FILM_SIDE)).contains(&pixels) {
                    true => Ok(pixels as u32),
                    false => Err(film
                        .error(format!("`{name}` must be 1 to {} pixels", firstlight_format::bounds::MAX_FILM_SIDE))),
                }
            };
        let (width, height) = (side("width", 768)?, side("height", 576)?);
        let (x, y) = (film.integer("crop_offset_x")?.unwrap_or(0), film.integer("crop_offset_y")?.unwrap_or(0));
        let rest = |size: u32, at: i64| i64::from(size).saturating_sub(at).max(1);
        let (crop_width, crop_height) = (side("crop_width", rest(width, x))?, side("crop_height", rest(height, y))?);
        let is_half = |at: i64, rest: i64| at.checked_mul(2) == Some(rest);
        let is_middle = is_half(x, i64::from(width) - i64::from(crop_width))
            && is_half(y, i64::from(height) - i64::from(crop_height));
        let shown = match is_middle {
            true => (crop_width, crop_height),
            false => {
                self.tell(film, "a crop window off the middle of the film is not modelled: the whole film is shown");
                (width, height)
            }
        };
        (self.file.film.width, self.file.film.height) = shown;
        self.file.film.filter = self.filter(film)?;
        let float = |(x, y): (u32, u32)| (f64::from(x), f64::from(y));
        Ok((float(shown), float((width, height))))
    }

    fn filter(&mut self, film: Node) -> Result<PixelFilter, SceneError> {
        let Some(&filter) = film.children("rfilter")?.first() else { return Ok(PixelFilter::Gaussian) };
        let is = |name: &str, usual: f64| Ok::<_, SceneError>((filter.float_or(name, usual)? - usual).abs() < 1e-6);
        let (found, is_exact) = match filter.plugin() {
            "box" => (PixelFilter::Box, true),
            "tent" => (PixelFilter::Tent, is("radius", 1.0)?),
            "gaussian" => (PixelFilter::Gaussian, is("stddev", 0.5)?),
            "mitchell" => (PixelFilter::Mitchell, is("A", 1.0 / 3.0)? && is("B", 1.0 / 3.0)?),
            "catmullrom" | "lanczos" => (PixelFilter::Mitchell, false),
            _ => (PixelFilter::Gaussian, false),
        };
        filter.ignore(&["radius", "stddev", "A", "B", "lobes"]);
        if !is_exact {
            self.tell(filter, "a pixel filter of this kind and width is not modelled: it is the most similar one");
        }
        Ok(found)
    }

    /// Path length and the kind of light transport.
    pub(crate) fn integrator(&mut self, node: Node, depth: u32) -> Result<(), SceneError> {
        if let Some(&nested) = node.children("integrator")?.first().filter(|_| depth < 8) {
            node.ignore(&["aovs"]);
            return self.integrator(nested, depth + 1);
        }
        node.ignore(&[
            "rr_depth",
            "samples_per_pass",
            "block_size",
            "timeout",
            "emitter_samples",
            "bsdf_samples",
            "shading_samples",
            "strict_normals",
            "sppi",
            "sppc",
            "sppp",
            "guiding",
            "proj_seed",
            "use_nee",
        ]);
        if node.boolean_or("hide_emitters", false)? {
            self.tell(node, "hide_emitters is not modelled: the camera sees lights");
        }
        let max_depth = match node.plugin() {
            "direct" | "direct_projective" => Some(2),
            "aov" | "depth" => return Ok(()),
            _ => node.integer("max_depth")?.filter(|depth| *depth >= 0),
        };
        // The same count: 1 is emitters only.
        self.file.max_depth = max_depth.map(|depth| depth.clamp(1, 1 << 16) as u32);
        Ok(())
    }
}

/// The camera that Mitsuba adds to a scene without one: it looks along +Z at all of the scene.
///
/// - `min`, `max`: corners of the box of the scene, metres.
pub(crate) fn default_camera(min: DVec3, max: DVec3) -> CameraPart {
    let half = (0.5 * 45_f64.to_radians()).tan();
    let distance = (max - min).max_element() / (2.0 * half);
    let eye = DVec3::new(
        0.5 * (min.x + max.x),
        0.5 * (min.y + max.y),
        min.z - distance.max(firstlight_format::bounds::MIN_SIZE),
    );
    CameraPart {
        look_at: None,
        forward: Some(DVec3::Z),
        // Of a film of 768 × 576 pixels.
        vfov: 2.0 * (half * 0.75).atan().to_degrees(),
        ..CameraPart::looking_at(eye, DVec3::ZERO)
    }
}
