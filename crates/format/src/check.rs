//! Checks the values of a scene file before anything is built from them.

use crate::bad_value::BadValue;
use crate::bounds;
use crate::bounds::{
    check_cone, check_film_size, check_image_angle, check_light_radius, check_max_depth, check_stops, coordinate_rule,
    is_coordinate, is_size, number, size_rule, triple,
};
use crate::camera::CameraPart;
use crate::error::suggestion;
use crate::material_property::check_value;
use crate::parts::{InFile, LightPart, MaterialPart, ObjectPart, RadiiPart, TransformPart};
use crate::placement::Placement;
use crate::property::{PropertyInfo, SkyProperty};
use crate::scene_file::SceneFile;
use crate::sources::{BUILTIN_IMAGE, BUILTIN_IMAGES, BUILTIN_NAMES};
use crate::sources::{EnvironmentSource, MeshSource, TextureSource};
use crate::value::{ColorValue, Rgb, ScalarValue};
use crate::view::unit_direction;
use firstlight_render::{MAX_LOBES, Param, ParamRef, Property};
use glam::{DMat3, DVec2, DVec3, Vec3};
use std::collections::{HashMap, HashSet};

/// Problems of a file.
#[derive(Debug, Default)]
pub struct Found {
    /// The first problems, each with the path of the value (see [`crate::locate`]) and a message.
    pub told: Vec<(String, String)>,
    /// Number of further problems.
    pub untold: usize,
}

/// Whether a matrix is finite and turns no direction into nothing.
fn is_regular(rows: &[[f64; 3]; 3]) -> bool {
    let determinant = DMat3::from_cols_array_2d(rows).determinant();
    rows.iter().flatten().all(|number| number.is_finite()) && determinant.is_finite() && determinant != 0.0
}

/// Returns the first `most` problems of `file`, and the number of further ones.
pub fn check(file: &SceneFile, most: usize) -> Found {
    let (materials, textures) = (file.materials.iter().collect(), file.textures.names().collect());
    let mut check = Check { file, materials, textures, most, found: Found::default() };
    check.camera("camera", &file.camera);
    for (name, camera) in file.cameras.iter() {
        check.camera(&format!("cameras/{name}"), camera);
    }
    check.film();
    check.environment();
    for (name, texture) in file.textures.iter() {
        check.texture(&format!("textures/{name}"), texture);
    }
    for (name, material) in file.materials.iter() {
        check.material(name, material);
    }
    check.totals();
    for (i, object) in file.objects.iter().enumerate() {
        check.object(&format!("objects/{i}"), object);
    }
    for (i, light) in file.lights.iter().enumerate() {
        check.light_part(&format!("lights/{i}"), light);
    }
    check.animation();
    check.found
}

pub(crate) struct Check<'a> {
    pub(crate) file: &'a SceneFile,
    pub(crate) materials: HashMap<&'a str, &'a MaterialPart>,
    textures: HashSet<&'a str>,
    /// Maximum number of listed problems; others are only counted.
    most: usize,
    found: Found,
}

impl Check<'_> {
    pub(crate) fn wrong(&mut self, path: &str, message: impl Into<String>) {
        if self.found.told.len() < self.most {
            self.found.told.push((path.to_owned(), message.into()));
        } else {
            self.found.untold += 1;
        }
    }

    /// Reports a name that is not `known`. Similar names are searched only if the message will be listed.
    pub(crate) fn misnamed<'k>(&mut self, path: &str, what: String, name: &str, known: impl Iterator<Item = &'k str>) {
        let hint = if self.found.told.len() < self.most { suggestion(name, known) } else { String::new() };
        self.wrong(path, what + &hint);
    }

    pub(crate) fn camera(&mut self, at: &str, camera: &CameraPart) {
        for bad in camera.components().err().into_iter().flatten() {
            let path = if bad.field() == "camera" { at.to_owned() } else { format!("{at}/{}", bad.field()) };
            self.wrong(&path, bad);
        }
    }

    fn film(&mut self) {
        let checks = [
            ("film", check_film_size(self.file.film.width, self.file.film.height)),
            ("max_depth", check_max_depth(self.file.max_depth)),
            ("display/exposure", check_stops(self.file.display.exposure_stops)),
        ];
        for (path, bad) in checks.into_iter().filter_map(|(path, result)| Some((path, result.err()?))) {
            self.wrong(path, bad);
        }
    }

    fn environment(&mut self) {
        self.light("air", self.file.air);
        match &self.file.environment {
            EnvironmentSource::Black => {}
            EnvironmentSource::Constant(radiance) => self.light("environment", *radiance),
            EnvironmentSource::Gradient { zenith, horizon, ground } => {
                self.light("environment/zenith", *zenith);
                self.light("environment/horizon", *horizon);
                self.light("environment/ground", *ground);
            }
            EnvironmentSource::Image { scale, rotate, axes, .. } => {
                if axes.is_some_and(|rows| !is_regular(&rows)) {
                    self.wrong("environment/axes", "`axes` must be finite and have an inverse");
                }
                self.light("environment/scale", *scale);
                self.finite("environment/rotate", *rotate);
            }
            sky @ EnvironmentSource::Sky { ground, scale, .. } => {
                for (property, value) in SkyProperty::ALL.iter().filter_map(|it| Some((it, it.get(sky)?))) {
                    let PropertyInfo { name, range: [least, most], .. } = *property.info();
                    if !(least..=most).contains(&value) {
                        let rule = format!("lie between {} and {}", number(least), number(most));
                        self.wrong(&format!("environment/{name}"), BadValue::out_of_range(name, number(value), rule));
                    }
                }
                if !(ground.0.min_element() >= 0.0 && ground.0.max_element() <= 1.0) {
                    self.wrong("environment/ground", "`ground` is an albedo: its channels must lie between 0 and 1");
                }
                self.light("environment/scale", *scale);
            }
        }
    }

    fn texture(&mut self, path: &str, texture: &TextureSource) {
        let (sizes, offset, rotate) = match texture {
            TextureSource::Checker { a, b, squares, offset, rotate } => {
                self.light(&format!("{path}/a"), *a);
                self.light(&format!("{path}/b"), *b);
                (vec![("squares", *squares)], *offset, *rotate)
            }
            TextureSource::Image { file, stretch, repeat, offset, rotate, tint, uv_set, relief, .. } => {
                if let Some(name) = file.strip_prefix(BUILTIN_IMAGE)
                    && !BUILTIN_IMAGES.contains(&name)
                {
                    let what = format!("there is no built-in image `{name}`");
                    self.misnamed(&format!("{path}/file"), what, name, BUILTIN_IMAGES.iter().copied());
                }
                if let Some(relief) = relief {
                    self.finite(&format!("{path}/relief"), f64::from(*relief));
                }
                self.light(&format!("{path}/tint"), *tint);
                if *uv_set > 1 {
                    let message = format!("`uv_set` is {uv_set}, but must be 0 or 1");
                    self.wrong(&format!("{path}/uv_set"), message);
                }
                (vec![("stretch", *stretch), ("repeat", *repeat)], *offset, *rotate)
            }
            TextureSource::VertexColors { tint, .. } => return self.light(&format!("{path}/tint"), *tint),
        };
        // Outside of this range, single precision has no such number.
        let (least, most) = (bounds::MIN_SIZE, bounds::MAX_COORDINATE);
        for (field, DVec2 { x, y }) in sizes {
            if ![x, y].iter().all(|size| (least..=most).contains(&size.abs())) {
                let allowed = format!("two finite numbers other than 0, from {least:e} to {most:e} either way");
                let message = format!("`{field}` is ({}, {}), but must be {allowed}", number(x), number(y));
                self.wrong(&format!("{path}/{field}"), message);
            }
        }
        if !(offset.abs().max_element() <= most && offset.is_finite()) {
            let (x, y) = (number(offset.x), number(offset.y));
            let message = format!("`offset` is ({x}, {y}), but must be finite and at most {most:e} either way");
            self.wrong(&format!("{path}/offset"), message);
        }
        self.finite(&format!("{path}/rotate"), rotate);
    }

    fn material(&mut self, name: &str, material: &MaterialPart) {
        let path = format!("materials/{name}");
        for (property, param) in material.params() {
            let path = format!("{path}/{}", property.name);
            if let Param::Part(part) = param {
                self.material_name(&path, part);
                if self.reaches(part, name) {
                    let message =
                        format!("material `{name}` contains itself: a blend must end in materials that are not blends");
                    self.wrong(&path, message);
                    return;
                }
            }
            self.param(&path, property, param);
        }
        if let MaterialPart::Blend { weight, .. } = material {
            let (lobes, glowing) = self.lobes(name);
            if lobes > MAX_LOBES {
                self.wrong(&path, format!("the blend has more than {MAX_LOBES} plain materials: nest fewer"));
            } else if glowing > 1 {
                self.wrong(&path, "the blend has more than one emissive part: keep one of them");
            } else if glowing == 1 && matches!(weight, ScalarValue::Texture(_)) {
                self.wrong(&format!("{path}/weight"), "with an emissive part, `weight` must be a number");
            }
        }
    }

    fn param(&mut self, path: &str, property: &Property, param: ParamRef<'_, InFile>) {
        match param {
            Param::Color(ColorValue::Texture(name)) | Param::Scalar(ScalarValue::Texture(name)) => {
                self.texture_name(path, name);
            }
            Param::Color(ColorValue::Rgb(rgb)) | Param::Rgb(Rgb(rgb)) => self.value(path, property, &rgb.to_array()),
            Param::Scalar(ScalarValue::Number(number)) | Param::Number(number) | Param::Cutoff(Some(number)) => {
                self.value(path, property, &[*number]);
            }
            Param::Cutoff(None) | Param::Flag(_) | Param::Fresnel(_) | Param::Part(_) => {}
        }
    }

    /// Checks a number, or the channels of a colour.
    pub(crate) fn value(&mut self, path: &str, property: &Property, channels: &[f32]) {
        if let Err(bad) = check_value(property, channels) {
            self.wrong(path, bad.to_string());
        }
    }

    /// Whether the blend `from` leads to material `to`, within as many steps as an accepted blend can have.
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

    /// Counts the plain materials of `name`, and the emissive ones among them; stops when there are too many.
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
                plain => lobes += plain.map_or(1, |material| material.n_lobes()),
            }
        }
        (lobes, glowing)
    }

    fn light_part(&mut self, path: &str, light: &LightPart) {
        match light {
            LightPart::Point { position, intensity, radius, .. } => {
                self.point(&format!("{path}/position"), *position);
                self.light(&format!("{path}/intensity"), *intensity);
                if let Err(bad) = check_light_radius(*radius) {
                    self.wrong(&format!("{path}/radius"), bad);
                }
            }
            LightPart::Spot {
                position,
                direction,
                intensity,
                inner_angle,
                outer_angle,
                texture,
                up,
                image_width,
                image_height,
                transform,
                ..
            } => {
                self.point(&format!("{path}/position"), *position);
                self.direction(&format!("{path}/direction"), "`direction`", *direction);
                self.light(&format!("{path}/intensity"), *intensity);
                if let Err(bad) = check_cone(*inner_angle, *outer_angle) {
                    self.wrong(&format!("{path}/{}", bad.field()), bad);
                }
                if let Some(texture) = texture {
                    self.texture_name(&format!("{path}/texture"), texture);
                }
                self.direction(&format!("{path}/up"), "`up`", *up);
                for (name, angle) in [("image_width", *image_width), ("image_height", *image_height)] {
                    if let Err(bad) = check_image_angle(name, angle) {
                        self.wrong(&format!("{path}/{name}"), bad);
                    }
                }
                self.transform(&format!("{path}/transform"), transform);
            }
            LightPart::Directional { direction, irradiance, transform, .. } => {
                self.direction(&format!("{path}/direction"), "`direction`", *direction);
                self.light(&format!("{path}/irradiance"), *irradiance);
                self.transform(&format!("{path}/transform"), transform);
            }
        }
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
                "spheres need a uniform scale: use one factor, or a mesh for an ellipsoid",
            );
        }
        match object {
            ObjectPart::Sphere { center, radius, .. } => {
                self.point(&format!("{path}/center"), *center);
                self.size(&format!("{path}/radius"), "the radius", *radius);
            }
            ObjectPart::Plane { point, normal, .. } => {
                self.point(&format!("{path}/point"), *point);
                self.direction(&format!("{path}/normal"), "the normal", *normal);
            }
            ObjectPart::Quad { corner, edge_u, edge_v, .. } => {
                self.point(&format!("{path}/corner"), *corner);
                self.edge(&format!("{path}/edge_u"), "`edge_u`", *edge_u);
                self.edge(&format!("{path}/edge_v"), "`edge_v`", *edge_v);
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
                    self.wrong(
                        &format!("{path}/materials"),
                        "`material` and `materials` exclude each other: set one of them",
                    );
                }
                for (i, name) in materials.iter().flatten().enumerate() {
                    self.material_name(&format!("{path}/materials/{i}"), name);
                }
                if let MeshSource::Gltf { at: Some(at), .. } = source {
                    self.finite(&format!("{path}/source/at"), at.0);
                }
                if let MeshSource::Builtin(name) = source
                    && !BUILTIN_NAMES.contains(&name.as_str())
                {
                    let what = format!("there is no built-in mesh `{name}`");
                    self.misnamed(&format!("{path}/source"), what, name, BUILTIN_NAMES.iter().copied());
                }
                if let Some(ratio) = simplify
                    && !(*ratio > 0.0 && *ratio <= 1.0)
                {
                    self.wrong(
                        &format!("{path}/simplify"),
                        format!(
                            "`simplify` is {ratio}, but must be above 0 and at most 1: it is the ratio of faces to keep"
                        ),
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

    /// What a few bytes could ask for very often.
    fn totals(&mut self) {
        let mut spheres = 0;
        let mut ratios: HashMap<&MeshSource, HashSet<u64>> = HashMap::new();
        for (i, object) in self.file.objects.iter().enumerate() {
            match object {
                ObjectPart::BallGrid { steps, .. } => {
                    spheres += number_of(steps).min(bounds::MAX_GRID_BALLS);
                    if spheres > bounds::MAX_BALLS {
                        let message = format!("all grids together may have up to {} spheres", bounds::MAX_BALLS);
                        return self.wrong(&format!("objects/{i}/steps"), message);
                    }
                }
                ObjectPart::Mesh { source, simplify: Some(ratio), .. } => {
                    let of_source = ratios.entry(source).or_default();
                    of_source.insert(ratio.to_bits());
                    if of_source.len() > bounds::MAX_RATIOS {
                        let most = bounds::MAX_RATIOS;
                        let message = format!("a mesh may be simplified to up to {most} ratios in one scene");
                        return self.wrong(&format!("objects/{i}/simplify"), message);
                    }
                }
                _ => {}
            }
        }
    }

    fn steps(&mut self, path: &str, first: DVec3, steps: &[(u32, DVec3)]) {
        let n = number_of(steps);
        let reach = steps.iter().map(|(count, step)| f64::from(*count) * step.abs()).fold(first.abs(), |a, b| a + b);
        if n == 0 || n > bounds::MAX_GRID_BALLS || steps.len() > 3 {
            let message = format!("a grid has one to three rows and up to {} spheres, not {n}", bounds::MAX_GRID_BALLS);
            self.wrong(&format!("{path}/steps"), message);
        } else {
            self.point(&format!("{path}/first"), first);
            self.point(&format!("{path}/steps"), reach);
        }
    }

    fn balls(&mut self, path: &str, centers: &[DVec3], radii: &RadiiPart) {
        if centers.is_empty() {
            self.wrong(&format!("{path}/centers"), "there are no spheres: add at least one centre");
        }
        if let Some(i) = centers.iter().position(|center| !is_coordinate(*center)) {
            self.point(&format!("{path}/centers/{i}"), centers[i]);
        }
        match radii {
            RadiiPart::All(radius) => self.size(&format!("{path}/radii"), "the radius", *radius),
            RadiiPart::Each(radii) if radii.len() != centers.len() => self.wrong(
                &format!("{path}/radii"),
                format!(
                    "there are {} radii for {} centres: use one per centre, or all(radius)",
                    radii.len(),
                    centers.len()
                ),
            ),
            RadiiPart::Each(radii) => {
                if let Some(i) = radii.iter().position(|radius| !is_size(*radius)) {
                    self.size(&format!("{path}/radii/{i}"), "the radius", radii[i]);
                }
            }
        }
    }

    /// Converts a transform to a placement, if it is valid.
    fn transform(&mut self, path: &str, part: &TransformPart) -> Option<Placement> {
        let is_described = part.translate.is_some() || part.rotate.is_some() || part.scale.is_some();
        if part.matrix.is_some() && (is_described || part.pivot.is_some()) {
            self.wrong(
                &format!("{path}/matrix"),
                "`matrix` excludes `translate`, `rotate`, `scale` and `pivot`: use one or the others",
            );
            return None;
        }
        let placement = Placement::from_part(part);
        match placement.check() {
            Ok(()) => Some(placement),
            Err(why) => {
                self.wrong(path, why);
                None
            }
        }
    }

    pub(crate) fn material_name(&mut self, path: &str, name: &str) {
        if !self.materials.contains_key(name) {
            self.misnamed(path, format!("material `{name}` is not defined"), name, self.file.materials.names());
        }
    }

    fn texture_name(&mut self, path: &str, name: &str) {
        if !self.textures.contains(name) {
            let hint = match name {
                _ if name.starts_with('#') => "a colour, where one is expected, is `\"#rgb\"` or `\"#rrggbb\"`",
                _ if name.trim().parse::<f64>().is_ok() => "numbers have no quotes, such as `0.2`",
                _ => {
                    return self.misnamed(
                        path,
                        format!("texture `{name}` is not defined"),
                        name,
                        self.file.textures.names(),
                    );
                }
            };
            self.wrong(path, format!("texture `{name}` is not defined; {hint}"));
        }
    }

    /// Checks radiance or absorption: finite, not negative.
    fn light(&mut self, path: &str, Rgb(rgb): Rgb) {
        if !(rgb.is_finite() && rgb.cmpge(Vec3::ZERO).all()) {
            let Vec3 { x, y, z } = rgb;
            self.wrong(path, format!("({x}, {y}, {z}) must be finite and not negative"));
        }
    }

    fn finite(&mut self, path: &str, value: f64) {
        if !value.is_finite() {
            self.wrong(path, format!("{} is not a finite number", number(value)));
        }
    }

    fn point(&mut self, path: &str, point: DVec3) {
        if !is_coordinate(point) {
            self.wrong(path, format!("{} must {}", triple(point), coordinate_rule()));
        }
    }

    /// Checks a direction: any length except 0.
    fn direction(&mut self, path: &str, what: &str, vector: DVec3) {
        if unit_direction(vector).is_none() {
            self.wrong(path, format!("{what} is {}, but must be finite and have a length", triple(vector)));
        }
    }

    fn edge(&mut self, path: &str, what: &str, vector: DVec3) {
        if !is_coordinate(vector) || vector.length() < bounds::MIN_SIZE {
            let (least, most) = (bounds::MIN_SIZE, bounds::MAX_COORDINATE);
            let allowed = format!("be finite and have a length between {least:e} and {most:e} m");
            self.wrong(path, format!("{what} is {}, but must {allowed}", triple(vector)));
        }
    }

    fn size(&mut self, path: &str, what: &str, size: f64) {
        if !is_size(size) {
            self.wrong(path, format!("{what} is {}, but must {}", number(size), size_rule()));
        }
    }

    fn area(&mut self, path: &str, what: &str, edge_u: DVec3, edge_v: DVec3) {
        let sine = edge_u.normalize_or_zero().cross(edge_v.normalize_or_zero()).length();
        let both = edge_u.length() >= bounds::MIN_SIZE && edge_v.length() >= bounds::MIN_SIZE;
        if both && edge_u.is_finite() && edge_v.is_finite() && sine <= 1e-9 {
            self.wrong(path, format!("the {what} has no area: its edges are parallel"));
        }
    }
}

/// Number of spheres of a grid.
fn number_of(steps: &[(u32, DVec3)]) -> u64 {
    steps.iter().map(|(count, _)| u64::from(*count)).fold(1, u64::saturating_mul)
}
