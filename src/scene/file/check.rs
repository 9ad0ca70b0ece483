//! What the values of a scene file must satisfy before anything is built from them.

use super::parts::{
    CameraPart, EnvironmentPart, LightPart, MaterialPart, MeshSourcePart, ObjectPart, RadiiPart, SceneFile,
    TexturePart, TransformPart,
};
use super::value::{Amount, Paint, Rgb};
use crate::render::Film;
use crate::scene::components::{MAX_LOBES, PHONG_LOBES};
use crate::scene::error::suggestion;
use crate::scene::meshes::BUILTIN_NAMES;
use crate::scene::placement::Placement;
use glam::{DVec2, DVec3, Vec3};
use std::collections::{HashMap, HashSet};

/// Everything wrong with `file`, each with the path of the value (see [`super::locate`]).
pub fn check(file: &SceneFile) -> Vec<(String, String)> {
    let materials = file.materials.iter().collect();
    let mut check = Check { file, materials, problems: Vec::new() };
    check.camera(&file.camera);
    check.film();
    check.environment();
    for (name, texture) in file.textures.iter() {
        check.texture(&format!("textures/{name}"), texture);
    }
    for (name, material) in file.materials.iter() {
        check.material(name, material);
    }
    for (i, object) in file.objects.iter().enumerate() {
        check.object(&format!("objects/{i}"), object);
    }
    for (i, light) in file.lights.iter().enumerate() {
        let LightPart::Point { position, intensity, radius, .. } = light;
        check.point(&format!("lights/{i}/position"), *position);
        check.light(&format!("lights/{i}/intensity"), *intensity);
        check.size(&format!("lights/{i}/radius"), "the radius", *radius);
    }
    check.problems
}

struct Check<'a> {
    file: &'a SceneFile,
    materials: HashMap<&'a str, &'a MaterialPart>,
    problems: Vec<(String, String)>,
}

impl Check<'_> {
    fn wrong(&mut self, path: &str, message: impl Into<String>) {
        self.problems.push((path.to_owned(), message.into()));
    }

    fn camera(&mut self, camera: &CameraPart) {
        self.point("camera/eye", camera.eye);
        self.vector("camera/up", "`up`", camera.up);
        let view = match (camera.look_at, camera.forward) {
            (Some(look_at), None) => {
                self.point("camera/look_at", look_at);
                look_at - camera.eye
            }
            (None, Some(forward)) => {
                self.vector("camera/forward", "`forward`", forward);
                forward
            }
            (None, None) => {
                return self
                    .wrong("camera", "the camera looks nowhere: give `look_at`, a point, or `forward`, a direction");
            }
            (Some(_), Some(_)) => {
                return self.wrong("camera/forward", "`look_at` and `forward` say the same thing: give one of them");
            }
        };
        if let Some(distance) = camera.pivot_distance {
            if camera.forward.is_none() {
                self.wrong("camera/pivot_distance", "`pivot_distance` goes with `forward`: here `look_at` says it");
            } else {
                self.size("camera/pivot_distance", "`pivot_distance`", distance);
            }
        }
        if camera.look_at.is_some() && view.is_finite() && view.length() < SceneFile::MIN_SIZE {
            self.wrong("camera/look_at", "`eye` and `look_at` are the same point: move one of them");
        } else if view.is_finite() && camera.up.is_finite() {
            let sine = view.normalize().cross(camera.up.normalize_or_zero()).length();
            if camera.up != DVec3::ZERO && sine < 1e-9 {
                self.wrong("camera/up", "`up` is parallel to the view direction: tilt one of them");
            }
        }
        if !(camera.vfov > 0.0 && camera.vfov < 180.0) {
            self.wrong("camera/vfov", format!("`vfov` is {}, but must lie above 0 and below 180 degrees", camera.vfov));
        }
        if camera.lens_radius.is_some() && camera.f_stop.is_some() {
            self.wrong("camera/f_stop", "`lens_radius` and `f_stop` say the same thing: give one of them");
        }
        if let Some(radius) = camera.lens_radius
            && !(0.0..=SceneFile::MAX_COORDINATE).contains(&radius)
        {
            self.wrong("camera/lens_radius", format!("`lens_radius` is {radius}, but must be 0 or positive"));
        }
        if let Some(f_stop) = camera.f_stop
            && !is_positive(f_stop)
        {
            self.wrong("camera/f_stop", format!("`f_stop` is {f_stop}, but must be positive"));
        }
        if let Some(distance) = camera.focus_distance
            && !is_positive(distance)
        {
            self.wrong("camera/focus_distance", format!("`focus_distance` is {distance}, but must be positive"));
        }
        self.finite("camera/blade_rotation", camera.blade_rotation);
    }

    fn film(&mut self) {
        if let Err(message) = check_film_size(self.file.film.width, self.file.film.height) {
            self.wrong("film", message);
        }
        if self.file.max_depth == Some(0) {
            self.wrong("max_depth", "a path of 0 segments sees nothing: use at least 1, or leave it out for no limit");
        }
        if !self.file.display.exposure.is_finite() {
            self.wrong("display/exposure", "`exposure` must be a finite number of stops");
        }
    }

    fn environment(&mut self) {
        self.light("air", self.file.air);
        match &self.file.environment {
            EnvironmentPart::Black => {}
            EnvironmentPart::Constant(radiance) => self.light("environment", *radiance),
            EnvironmentPart::Gradient { zenith, horizon, ground } => {
                self.light("environment/zenith", *zenith);
                self.light("environment/horizon", *horizon);
                self.light("environment/ground", *ground);
            }
            EnvironmentPart::Image { scale, rotate, .. } => {
                self.light("environment/scale", *scale);
                self.finite("environment/rotate", *rotate);
            }
        }
    }

    fn texture(&mut self, path: &str, texture: &TexturePart) {
        let (size, offset, rotate) = match texture {
            TexturePart::Checker { a, b, squares, offset, rotate } => {
                self.light(&format!("{path}/a"), *a);
                self.light(&format!("{path}/b"), *b);
                (("squares", *squares), *offset, *rotate)
            }
            TexturePart::Image { repeat, offset, rotate, .. } => (("repeat", *repeat), *offset, *rotate),
        };
        let (field, DVec2 { x, y }) = size;
        if !(x.is_finite() && y.is_finite() && x != 0.0 && y != 0.0) {
            self.wrong(&format!("{path}/{field}"), format!("`{field}` must be two finite numbers other than 0"));
        }
        if !offset.is_finite() {
            self.wrong(&format!("{path}/offset"), "`offset` must be finite");
        }
        self.finite(&format!("{path}/rotate"), rotate);
    }

    fn material(&mut self, name: &str, material: &MaterialPart) {
        let path = format!("materials/{name}");
        match material {
            MaterialPart::Diffuse { albedo } => self.share(&path, "albedo", albedo),
            MaterialPart::Mirror { reflectance } => self.share(&path, "reflectance", reflectance),
            MaterialPart::Metal { alpha, reflectance, .. } => {
                self.amount(&path, "alpha", alpha);
                self.share(&path, "reflectance", reflectance);
            }
            MaterialPart::Glass { ior, absorption } => {
                self.ior(&path, *ior);
                self.light(&format!("{path}/absorption"), *absorption);
            }
            MaterialPart::Phong { diffuse, ambient, specular, shininess, transparency, ior, absorption } => {
                self.share(&path, "diffuse", diffuse);
                self.amount(&path, "specular", specular);
                for (field, value) in [("ambient", ambient), ("transparency", transparency)] {
                    if !(0.0..=1.0).contains(value) {
                        self.wrong(&format!("{path}/{field}"), format!("`{field}` is {value}, but must lie in 0..1"));
                    }
                }
                if !(shininess.is_finite() && *shininess >= 0.0) {
                    let message =
                        format!("`shininess` is {shininess}, but must be 0 or positive: 20 is dull, 200 sharp");
                    self.wrong(&format!("{path}/shininess"), message);
                }
                self.ior(&path, *ior);
                self.light(&format!("{path}/absorption"), *absorption);
            }
            MaterialPart::Blend { weight, a, b } => {
                self.amount(&path, "weight", weight);
                for (field, part) in [("a", a), ("b", b)] {
                    let path = format!("{path}/{field}");
                    self.material_name(&path, part);
                    if self.reaches(part, name) {
                        let message = format!("material `{name}` blends itself: a blend must end in plain materials");
                        self.wrong(&path, message);
                        return;
                    }
                }
                let (lobes, glowing) = self.lobes(name);
                if lobes > MAX_LOBES {
                    self.wrong(&path, format!("the blend has more than {MAX_LOBES} plain materials: nest fewer"));
                } else if glowing > 1 {
                    self.wrong(&path, "the blend has more than one emissive part: keep one of them");
                } else if glowing == 1 && matches!(weight, Amount::Texture(_)) {
                    self.wrong(&format!("{path}/weight"), "with an emissive part, `weight` must be a number");
                }
            }
            MaterialPart::Emissive { radiance } => match radiance {
                Paint::Rgb(rgb) => self.light(&format!("{path}/radiance"), Rgb(*rgb)),
                Paint::Texture(texture) => self.texture_name(&format!("{path}/radiance"), texture),
            },
        }
    }

    fn ior(&mut self, path: &str, ior: f32) {
        if !(ior.is_finite() && ior > 0.0) {
            self.wrong(&format!("{path}/ior"), format!("`ior` is {ior}, but must be positive: 1.5 is glass"));
        }
    }

    /// Whether the blend `from` leads to material `to`, within as many steps as a blend that is not refused has.
    fn reaches(&self, from: &str, to: &str) -> bool {
        let (mut seen, mut open) = (HashSet::new(), vec![from]);
        while let Some(name) = open.pop() {
            if name == to {
                return true;
            }
            if let Some(MaterialPart::Blend { a, b, .. }) = self.materials.get(name)
                && seen.len() < 2 * MAX_LOBES
                && seen.insert(name)
            {
                open.extend([a.as_str(), b.as_str()]);
            }
        }
        false
    }

    /// How many plain materials `name` comes to, and how many of them are emissive; stops counting when it is too many.
    fn lobes(&self, name: &str) -> (usize, usize) {
        let (mut lobes, mut glowing, mut open) = (0, 0, vec![name]);
        let mut steps = 0;
        while let Some(name) = open.pop() {
            steps += 1;
            if lobes > MAX_LOBES || steps > 4 * MAX_LOBES {
                return (MAX_LOBES + 1, glowing);
            }
            match self.materials.get(name) {
                Some(MaterialPart::Blend { a, b, .. }) => open.extend([a.as_str(), b.as_str()]),
                Some(MaterialPart::Emissive { .. }) => (lobes, glowing) = (lobes + 1, glowing + 1),
                Some(MaterialPart::Phong { .. }) => lobes += PHONG_LOBES,
                _ => lobes += 1,
            }
        }
        (lobes, glowing)
    }

    fn object(&mut self, path: &str, object: &ObjectPart) {
        if let Some(name) = object.material() {
            self.material_name(&format!("{path}/material"), name);
        }
        let placement = self.transform(&format!("{path}/transform"), object.transform());
        let must_scale_evenly =
            matches!(object, ObjectPart::Sphere { .. } | ObjectPart::BallGrid { .. } | ObjectPart::Spheres { .. });
        if must_scale_evenly && placement.is_some_and(|placement| placement.even_scale().is_none()) {
            self.wrong(
                &format!("{path}/transform"),
                "balls stay round: scale them by one factor, or use a mesh for an ellipsoid",
            );
        }
        match object {
            ObjectPart::Sphere { center, radius, .. } => {
                self.point(&format!("{path}/center"), *center);
                self.size(&format!("{path}/radius"), "the radius", *radius);
            }
            ObjectPart::Plane { point, normal, .. } => {
                self.point(&format!("{path}/point"), *point);
                self.vector(&format!("{path}/normal"), "the normal", *normal);
            }
            ObjectPart::Quad { corner, edge_u, edge_v, .. } => {
                self.point(&format!("{path}/corner"), *corner);
                self.vector(&format!("{path}/edge_u"), "`edge_u`", *edge_u);
                self.vector(&format!("{path}/edge_v"), "`edge_v`", *edge_v);
                self.area(path, "quad", *edge_u, *edge_v);
            }
            ObjectPart::Triangle { vertices: [a, b, c], .. } => {
                for (i, vertex) in [a, b, c].into_iter().enumerate() {
                    self.point(&format!("{path}/vertices/{i}"), *vertex);
                }
                self.area(path, "triangle", b - a, c - a);
            }
            ObjectPart::Mesh { source, simplify, material, materials, .. } => {
                if material.is_some() && materials.is_some() {
                    self.wrong(&format!("{path}/materials"), "`material` and `materials` say the same thing: give one");
                }
                for (i, name) in materials.iter().flatten().enumerate() {
                    self.material_name(&format!("{path}/materials/{i}"), name);
                }
                if let MeshSourcePart::Builtin(name) = source
                    && !BUILTIN_NAMES.contains(&name.as_str())
                {
                    let hint = suggestion(name, BUILTIN_NAMES.iter().copied());
                    self.wrong(&format!("{path}/source"), format!("there is no built-in mesh `{name}`{hint}"));
                }
                if let Some(ratio) = simplify
                    && !(*ratio > 0.0 && *ratio <= 1.0)
                {
                    self.wrong(
                        &format!("{path}/simplify"),
                        format!("`simplify` is {ratio}, but is the share of faces to keep: above 0, at most 1"),
                    );
                }
            }
            ObjectPart::BallGrid { first, steps, radius, .. } => {
                self.size(&format!("{path}/radius"), "the radius", *radius);
                self.steps(path, *first, steps);
            }
            ObjectPart::Spheres { centers, radii, .. } => self.balls(path, centers, radii),
        }
    }

    fn steps(&mut self, path: &str, first: DVec3, steps: &[(u32, DVec3)]) {
        let n: u64 = steps.iter().map(|(count, _)| u64::from(*count)).fold(1, u64::saturating_mul);
        let reach = steps.iter().map(|(count, step)| f64::from(*count) * step.abs()).fold(first.abs(), |a, b| a + b);
        if n == 0 || n > SceneFile::MAX_GRID_BALLS || steps.len() > 3 {
            let message =
                format!("a grid has one to three rows and up to {} balls, not {n}", SceneFile::MAX_GRID_BALLS);
            self.wrong(&format!("{path}/steps"), message);
        } else {
            self.point(&format!("{path}/first"), first);
            self.point(&format!("{path}/steps"), reach);
        }
    }

    fn balls(&mut self, path: &str, centers: &[DVec3], radii: &RadiiPart) {
        if centers.is_empty() {
            self.wrong(&format!("{path}/centers"), "there are no balls: give at least one centre");
        }
        if let Some(i) = centers.iter().position(|center| !is_coordinate(*center)) {
            self.point(&format!("{path}/centers/{i}"), centers[i]);
        }
        match radii {
            RadiiPart::All(radius) => self.size(&format!("{path}/radii"), "the radius", *radius),
            RadiiPart::Each(radii) if radii.len() != centers.len() => self.wrong(
                &format!("{path}/radii"),
                format!("there are {} radii for {} centres: give one each, or all(radius)", radii.len(), centers.len()),
            ),
            RadiiPart::Each(radii) => {
                if let Some(i) = radii.iter().position(|radius| !is_size(*radius)) {
                    self.size(&format!("{path}/radii/{i}"), "the radius", radii[i]);
                }
            }
        }
    }

    /// The placement that the transform means, when it means one.
    fn transform(&mut self, path: &str, part: &TransformPart) -> Option<Placement> {
        if part.matrix.is_some() && (part.translate.is_some() || part.rotate.is_some() || part.scale.is_some()) {
            self.wrong(&format!("{path}/matrix"), "a matrix says all: remove `translate`, `rotate` and `scale`, or it");
            return None;
        }
        let placement = Placement::from_part(part);
        let affine = placement.affine();
        let determinant = affine.matrix3.determinant();
        if !affine.is_finite() || affine.translation.abs().max_element() > SceneFile::MAX_COORDINATE {
            self.wrong(
                path,
                format!("the transform must be finite and move by at most {:e} m", SceneFile::MAX_COORDINATE),
            );
            None
        } else if !(SceneFile::MIN_SIZE.powi(3)..f64::INFINITY).contains(&determinant.abs()) {
            self.wrong(path, "the transform squeezes the object flat: no scale may be 0");
            None
        } else {
            Some(placement)
        }
    }

    fn material_name(&mut self, path: &str, name: &str) {
        if !self.materials.contains_key(name) {
            let hint = suggestion(name, self.file.materials.names());
            self.wrong(path, format!("material `{name}` is not defined{hint}"));
        }
    }

    fn texture_name(&mut self, path: &str, name: &str) {
        if self.file.textures.get(name).is_none() {
            let hint = suggestion(name, self.file.textures.names());
            self.wrong(path, format!("texture `{name}` is not defined{hint}"));
        }
    }

    /// A share of the light in each channel: 0..1.
    fn share(&mut self, path: &str, field: &str, paint: &Paint) {
        let path = format!("{path}/{field}");
        match paint {
            Paint::Texture(name) => self.texture_name(&path, name),
            Paint::Rgb(rgb) if !(rgb.cmpge(Vec3::ZERO).all() && rgb.cmple(Vec3::ONE).all()) => {
                let Vec3 { x, y, z } = rgb;
                self.wrong(&path, format!("`{field}` is ({x}, {y}, {z}), but is a share of light: between 0 and 1"));
            }
            Paint::Rgb(_) => {}
        }
    }

    fn amount(&mut self, path: &str, field: &str, amount: &Amount) {
        let path = format!("{path}/{field}");
        match amount {
            Amount::Texture(name) => self.texture_name(&path, name),
            Amount::Number(value) if !(0.0..=1.0).contains(value) => {
                self.wrong(&path, format!("`{field}` is {value}, but must lie between 0 and 1"));
            }
            Amount::Number(_) => {}
        }
    }

    /// Light or absorption: finite, not negative.
    fn light(&mut self, path: &str, Rgb(rgb): Rgb) {
        if !(rgb.is_finite() && rgb.cmpge(Vec3::ZERO).all()) {
            let Vec3 { x, y, z } = rgb;
            self.wrong(path, format!("({x}, {y}, {z}) must be finite and nowhere negative"));
        }
    }

    fn finite(&mut self, path: &str, value: f64) {
        if !value.is_finite() {
            self.wrong(path, format!("{value} is not a finite number"));
        }
    }

    fn point(&mut self, path: &str, point: DVec3) {
        if !is_coordinate(point) {
            let DVec3 { x, y, z } = point;
            let limit = SceneFile::MAX_COORDINATE;
            self.wrong(path, format!("({x}, {y}, {z}) must be finite and within {limit:e} m of the origin"));
        }
    }

    fn vector(&mut self, path: &str, what: &str, vector: DVec3) {
        if !is_coordinate(vector) || vector.length() < SceneFile::MIN_SIZE {
            let DVec3 { x, y, z } = vector;
            self.wrong(path, format!("{what} is ({x}, {y}, {z}), but must be finite and have a length"));
        }
    }

    fn size(&mut self, path: &str, what: &str, size: f64) {
        if !is_size(size) {
            let (least, most) = (SceneFile::MIN_SIZE, SceneFile::MAX_COORDINATE);
            self.wrong(path, format!("{what} is {size}, but must lie between {least:e} and {most:e} m"));
        }
    }

    fn area(&mut self, path: &str, what: &str, edge_u: DVec3, edge_v: DVec3) {
        let sine = edge_u.normalize_or_zero().cross(edge_v.normalize_or_zero()).length();
        let both = edge_u.length() >= SceneFile::MIN_SIZE && edge_v.length() >= SceneFile::MIN_SIZE;
        if both && edge_u.is_finite() && edge_v.is_finite() && sine <= 1e-9 {
            self.wrong(path, format!("the {what} has no area: its edges are parallel"));
        }
    }
}

/// Why a film cannot have this size, if it cannot.
pub fn check_film_size(width: u32, height: u32) -> Result<(), String> {
    let pixels = u64::from(width) * u64::from(height);
    if width == 0 || height == 0 {
        Err(format!("a film of {width} x {height} has no pixels: width and height must be at least 1"))
    } else if width > SceneFile::MAX_FILM_SIDE
        || height > SceneFile::MAX_FILM_SIDE
        || pixels > SceneFile::MAX_FILM_PIXELS
    {
        let gib = pixels as f64 * Film::BYTES_A_PIXEL as f64 / f64::from(1 << 30);
        Err(format!(
            "a film of {width} x {height} would take {gib:.1} GiB: use at most {} pixels, {} a side",
            SceneFile::MAX_FILM_PIXELS,
            SceneFile::MAX_FILM_SIDE
        ))
    } else {
        Ok(())
    }
}

fn is_coordinate(point: DVec3) -> bool {
    point.abs().max_element() <= SceneFile::MAX_COORDINATE && point.is_finite()
}

/// Infinity is; NaN is not.
fn is_positive(value: f64) -> bool {
    value > 0.0
}

fn is_size(size: f64) -> bool {
    (SceneFile::MIN_SIZE..=SceneFile::MAX_COORDINATE).contains(&size)
}
