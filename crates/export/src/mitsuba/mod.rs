//! Mitsuba 3: scenes in XML. Start reading at [`text`].
//!
//! Source: <https://mitsuba.readthedocs.io>

mod bsdf;
mod view;
mod xml;

use crate::common::albedo::Renderer;
use crate::common::environment::{FINE, round_image};
use crate::common::folder::Folder;
use crate::common::identifiers::Identifiers;
use crate::common::number::number;
use crate::common::objects::{Geometry, Placed, placed, radiance_of};
use crate::common::picture::exr;
use crate::common::projected::Projected;
use crate::common::scene::WholeScene;
use crate::common::surface::{Change, Color, Normals, Surface, Use};
use crate::mitsuba::xml::Xml;
use firstlight_files::printable;
use firstlight_files::warnings::Warnings;
use firstlight_files::whole_file::unwritable;
use firstlight_files::write_error::WriteError;
use firstlight_format::light::{ImageFrame, LightKind};
use firstlight_format::parts::LightPart;
use firstlight_format::scene_format::MAX_XML_ELEMENTS;
use firstlight_format::sources::{EnvironmentLayout, EnvironmentSource};
use firstlight_render::{Environment, Falloff};
use glam::{DAffine3, DMat3, DVec3, Vec2, Vec3};
use std::collections::HashMap;
use std::f32::consts::PI;
use std::f64::consts::FRAC_PI_2;
use std::path::Path;

/// Image files that Mitsuba reads.
const FORMATS: [&str; 10] = ["png", "jpg", "jpeg", "bmp", "tga", "exr", "hdr", "pfm", "ppm", "rgbe"];

/// From the axes of Mitsuba's sphere, whose texture has its poles at ±Z, to those of ours, with poles at ±Y.
const SPHERE_AXES: DMat3 = DMat3::from_cols(DVec3::NEG_X, DVec3::Z, DVec3::NEG_Y);

/// A scene that is being written.
struct Writer<'a> {
    scene: &'a WholeScene,
    folder: &'a mut Folder,
    warnings: &'a mut Warnings,
    xml: Xml,
    surfaces: HashMap<String, Surface>,
    /// Identifiers of materials.
    ids: HashMap<String, String>,
    /// Identifiers of everything. In Mitsuba, a period separates objects from their parameters, and `$` begins a
    /// parameter of the file.
    taken: Identifiers,
}

/// The text of a scene; its meshes and images go to the folder.
pub(crate) fn text(scene: &WholeScene, folder: &mut Folder, warnings: &mut Warnings) -> Result<String, WriteError> {
    let xml = Xml::default();
    let (surfaces, ids, taken) = (HashMap::new(), HashMap::new(), Identifiers::without(&['.', '$']));
    let mut writer = Writer { scene, folder, warnings, xml, surfaces, ids, taken };
    writer.xml.open("scene", &[("version", "3.0.0")]);
    writer.scene()?;
    writer.xml.close();
    if writer.xml.n_elements > MAX_XML_ELEMENTS {
        let told = format!("the scene has {} elements: firstlight opens {MAX_XML_ELEMENTS}", writer.xml.n_elements);
        writer.warnings.push(told);
    }
    Ok(writer.xml.text)
}

impl Writer<'_> {
    fn scene(&mut self) -> Result<(), WriteError> {
        let names = self.scene.used_materials();
        for name in &names {
            let surface = Surface::of(self.scene, name, Renderer::Mitsuba, self.warnings);
            if surface.absorption != Vec3::ZERO {
                self.tell(name, "its absorption is a medium, which firstlight leaves out when it opens the file");
            }
            self.surfaces.insert(name.clone(), surface);
        }
        let emits = |name: &str| self.surfaces.get(name).is_some_and(|surface| surface.radiance.is_some());
        let all = placed(self.scene, emits, self.warnings);
        self.view();
        self.environment()?;
        for light in &self.scene.file.lights {
            self.light(light)?;
        }
        for name in names {
            let id = self.taken.free(&name);
            let surface = self.surfaces[&name].clone();
            self.surface(&surface, &id, &name)?;
            self.ids.insert(name, id);
        }
        let mut known_groups: HashMap<usize, String> = HashMap::new();
        for (i, placed) in all.iter().enumerate() {
            let Some(group) = placed.group else {
                self.shape(placed)?;
                continue;
            };
            if i > 0 && placed.is_part_of(&all[i - 1]) {
                continue;
            }
            let known = known_groups.get(&group).cloned();
            let is_new = known.is_none();
            let id = known.unwrap_or_else(|| self.taken.free("group"));
            if is_new {
                known_groups.insert(group, id.clone());
                self.xml.open("shape", &[("type", "shapegroup"), ("id", &id)]);
                for part in all[i..].iter().take_while(|part| part.is_part_of(placed)) {
                    self.shape(&Placed { world: DAffine3::IDENTITY, ..part.clone() })?;
                }
                self.xml.close();
            }
            if placed.world.matrix3.determinant() < 0.0 && self.has_normal_map(&all[i..]) {
                self.tell(&placed.name, "its normal map is upside down on a mirrored copy");
            }
            self.xml.open("shape", &[("type", "instance")]);
            self.xml.transform("to_world", &placed.world);
            self.xml.leaf("ref", &[("id", &id)]);
            self.xml.close();
        }
        Ok(())
    }

    fn tell(&mut self, name: &str, what: &str) {
        self.warnings.push(format!("`{}`: {what}", printable::name(name)));
    }

    fn shape(&mut self, placed: &Placed) -> Result<(), WriteError> {
        let plugin = match &placed.geometry {
            Geometry::Sphere => "sphere",
            Geometry::Square => "rectangle",
            Geometry::Mesh(..) => "ply",
        };
        let is_textured = self.surfaces.get(&placed.material).is_some_and(Surface::is_textured);
        let is_mirrored = placed.world.matrix3.determinant() < 0.0;
        let mirror = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
        self.xml.open("shape", &[("type", plugin)]);
        match &placed.geometry {
            Geometry::Sphere => {
                if is_textured {
                    // Its texture runs the other way round, so it is mirrored and would be inside out.
                    self.xml.transform("to_world", &(placed.world * DAffine3::from_mat3(SPHERE_AXES)));
                    self.xml.value("boolean", "flip_normals", if is_mirrored { "false" } else { "true" });
                } else {
                    self.xml.vector("point", "center", placed.world.translation);
                    self.xml.float("radius", placed.world.matrix3.determinant().abs().cbrt());
                }
            }
            Geometry::Square => self.xml.transform("to_world", &placed.world),
            Geometry::Mesh(mesh, slot) => {
                let file = self.folder.mesh(mesh, *slot, [is_mirrored, is_textured], &placed.name)?;
                self.xml.value("string", "filename", &file);
                if mesh.normals.is_empty() {
                    self.xml.value("boolean", "face_normals", "true");
                }
                let world = if is_mirrored { placed.world * mirror } else { placed.world };
                self.xml.transform("to_world", &world);
            }
        }
        let surface = self.surfaces.get(&placed.material).cloned();
        match surface.as_ref().and_then(|surface| self.with_turned_normals(surface, placed)) {
            Some(turned) => self.surface(&turned, "", &placed.material)?,
            None => {
                if let Some(id) = self.ids.get(&placed.material) {
                    self.xml.leaf("ref", &[("id", id)]);
                }
            }
        }
        if let Some(Surface { radiance, absorption, .. }) = surface {
            if absorption != Vec3::ZERO {
                self.xml.open("medium", &[("name", "interior"), ("type", "homogeneous")]);
                // A colour is at most 1.
                self.xml.rgb("sigma_t", absorption / absorption.max_element());
                self.xml.float("scale", absorption.max_element());
                self.xml.rgb("albedo", Vec3::ZERO);
                self.xml.close();
            }
            if let Some(radiance) = radiance {
                self.xml.open("emitter", &[("type", "area")]);
                self.color("radiance", &radiance)?;
                self.xml.close();
            }
        }
        self.xml.close();
        Ok(())
    }

    /// Whether a part of the first object has one.
    fn has_normal_map(&self, all: &[Placed]) -> bool {
        let parts = all.iter().take_while(|part| part.is_part_of(&all[0]));
        parts.filter_map(|part| self.surfaces.get(&part.material)?.normals.as_ref()).any(|normals| !normals.is_relief)
    }

    /// The surface where textures are mirrored on it: Mitsuba's second tangent is normal × tangent there, too.
    fn with_turned_normals(&mut self, surface: &Surface, placed: &Placed) -> Option<Surface> {
        let normals = surface.normals.as_ref().filter(|normals| !normals.is_relief)?;
        let (right, mirrored) = placed.areas_by_handedness();
        if mirrored > 0.0 && right > 0.0 {
            let told = "its normal map is upside down where its texture is mirrored, or where it is not";
            self.tell(&placed.name, told);
        }
        let change = match normals.map.change {
            Change::Slope(slope) => Change::Slope(slope * Vec2::new(1.0, -1.0)),
            _ => Change::Slope(Vec2::new(1.0, -1.0)),
        };
        let map = Use { change, ..normals.map.clone() };
        let normals = Some(Normals { map, is_relief: false });
        (mirrored > right).then(|| Surface { normals, ..surface.clone() })
    }

    fn light(&mut self, light: &LightPart) -> Result<(), WriteError> {
        let (kind, placement) = LightKind::from_part(light);
        let direction = kind.direction(&placement);
        let name = light.name().unwrap_or("light");
        if let Some((center, radius, radiance)) = radiance_of(light) {
            self.xml.open("shape", &[("type", "sphere")]);
            self.xml.vector("point", "center", center);
            self.xml.float("radius", radius);
            self.xml.open("bsdf", &[("type", "diffuse")]);
            self.xml.rgb("reflectance", Vec3::ZERO);
            self.xml.close();
            self.xml.open("emitter", &[("type", "area")]);
            self.xml.rgb("radiance", radiance);
            self.xml.close();
            self.xml.close();
            return Ok(());
        }
        if let Some(projected) = Projected::of(self.scene, light) {
            return self.projector(name, &projected);
        }
        match (kind, direction) {
            (LightKind::Point(light), _) => {
                self.xml.open("emitter", &[("type", "point")]);
                self.xml.vector("point", "position", placement.translation);
                self.xml.rgb("intensity", light.intensity);
                self.xml.close();
            }
            (LightKind::Spot(light), Some(direction)) => {
                if light.falloff != Falloff::Linear && light.inner_angle_deg < light.outer_angle_deg {
                    self.tell(name, "the edge of its cone falls off as Mitsuba has it, by angles");
                }
                self.xml.open("emitter", &[("type", "spot")]);
                let (x, y) = direction.any_orthonormal_pair();
                let axes = DMat3::from_cols(x, y, direction);
                self.xml.transform("to_world", &DAffine3::from_mat3_translation(axes, placement.translation));
                self.xml.rgb("intensity", light.intensity);
                self.xml.float("cutoff_angle", light.outer_angle_deg);
                self.xml.float("beam_width", light.inner_angle_deg);
                self.xml.close();
            }
            (LightKind::Directional(light), Some(direction)) => {
                self.xml.open("emitter", &[("type", "directional")]);
                self.xml.vector("vector", "direction", direction);
                self.xml.rgb("irradiance", light.irradiance);
                self.xml.close();
            }
            (LightKind::Spot(_) | LightKind::Directional(_), None) => {
                self.tell(name, "a light without a direction is left out");
            }
        }
        Ok(())
    }

    /// A spot with a texture, if that is what it is; else a projector.
    fn projector(&mut self, name: &str, projected: &Projected) -> Result<(), WriteError> {
        let light = &projected.light;
        if let (Some(texture), ImageFrame { width_deg: 0.0, height_deg: 0.0, even: false, .. }) =
            (&projected.texture, light.image)
        {
            if light.falloff != Falloff::Linear && light.inner_angle_deg < light.outer_angle_deg {
                self.tell(name, "the edge of its cone falls off as Mitsuba has it, by angles");
            }
            self.xml.open("emitter", &[("type", "spot")]);
            self.xml.transform("to_world", &projected.world(1.0, 1.0));
            self.xml.rgb("intensity", light.intensity);
            self.color("texture", &Color::Texture(texture.clone()))?;
            self.xml.float("cutoff_angle", light.outer_angle_deg);
            self.xml.float("beam_width", light.inner_angle_deg);
            self.xml.close();
            return Ok(());
        }
        if projected.is_cut() {
            self.tell(name, "the cone that cuts its image is left out");
        }
        if !light.image.even {
            self.tell(name, "its image is brighter off the middle, so that a wall that faces it is lit evenly");
        }
        self.xml.open("emitter", &[("type", "projector")]);
        // Its image runs against its axes, and has the proportions of its pixels.
        let squeezed = projected.half.y * projected.aspect / projected.half.x;
        self.xml.transform("to_world", &projected.world(-1.0, -squeezed));
        self.xml.float("fov", 2.0 * projected.half.x.atan().to_degrees());
        match &projected.texture {
            None => self.xml.rgb("irradiance", light.intensity / PI),
            Some(texture) => {
                let scale = light.intensity.max_element();
                if light.intensity != Vec3::splat(scale) {
                    self.tell(name, "the colour that tints its image is left out");
                }
                self.xml.float("scale", scale / PI);
                self.color("irradiance", &Color::Texture(texture.clone()))?;
            }
        }
        self.xml.close();
        Ok(())
    }

    fn environment(&mut self) -> Result<(), WriteError> {
        // Below its horizon, the sky of Mitsuba is black.
        if let EnvironmentSource::Sky { elevation, azimuth, turbidity, ground, sun, sky, sun_size, below: false, scale } =
            &self.scene.file.environment
            && scale.0 == Vec3::splat(scale.0.x)
        {
            let ((sin, cos), (sin_azimuth, cos_azimuth)) =
                (elevation.to_radians().sin_cos(), azimuth.to_radians().sin_cos());
            self.xml.open("emitter", &[("type", "sunsky")]);
            self.xml.vector("vector", "sun_direction", DVec3::new(cos * sin_azimuth, sin, -cos * cos_azimuth));
            self.xml.float("turbidity", *turbidity);
            self.xml.rgb("albedo", ground.0);
            self.xml.float("sun_scale", sun * f64::from(scale.0.x));
            self.xml.float("sky_scale", sky * f64::from(scale.0.x));
            self.xml.float("sun_aperture", *sun_size);
            // Its zenith is +Z.
            self.xml.transform("to_world", &DAffine3::from_rotation_x(-FRAC_PI_2));
            self.xml.close();
            return Ok(());
        }
        match &self.scene.environment {
            Environment::Black => return Ok(()),
            Environment::Constant(radiance) => {
                self.xml.open("emitter", &[("type", "constant")]);
                self.xml.rgb("radiance", *radiance);
                self.xml.close();
                return Ok(());
            }
            Environment::Gradient { .. } | Environment::Image { .. } => {}
        }
        let copied = match (&self.scene.file.environment, &self.scene.environment_file) {
            (EnvironmentSource::Image { scale, rotate, layout, axes: None, .. }, Some(file))
                if is_interpolated(*layout, &self.scene.environment) && scale.0 == Vec3::splat(scale.0.x) =>
            {
                let extension = file.extension().and_then(|it| it.to_str()).map(str::to_ascii_lowercase);
                extension.filter(|it| FORMATS.contains(&it.as_str())).map(|it| (file.clone(), it, scale.0.x, *rotate))
            }
            _ => None,
        };
        let (file, scale, rotate) = match copied {
            Some((file, extension, scale, rotate)) => (self.folder.copy(&file, &extension)?, scale, rotate),
            None => {
                let (width, height, texels) = round_image(&self.scene.environment);
                let bytes = exr(width, height, &texels).map_err(|error| unwritable(Path::new("environment"), error))?;
                (self.folder.add("environment", "exr", &bytes)?, 1.0, 0.0)
            }
        };
        self.xml.open("emitter", &[("type", "envmap")]);
        self.xml.value("string", "filename", &file);
        if scale != 1.0 {
            self.xml.float("scale", scale);
        }
        // The middle of the image is in direction +Z there, −Z here.
        self.xml.open("transform", &[("name", "to_world")]);
        self.xml.leaf("rotate", &[("y", "1"), ("angle", &number(rotate + 180.0))]);
        self.xml.close();
        self.xml.close();
        Ok(())
    }
}

/// Whether the image of an environment looks the same if its colours are interpolated.
fn is_interpolated(layout: EnvironmentLayout, environment: &Environment) -> bool {
    match layout {
        EnvironmentLayout::Interpolated => true,
        EnvironmentLayout::Equirectangular => {
            matches!(environment, Environment::Image { image, .. } if image.height >= FINE)
        }
        EnvironmentLayout::EqualArea => false,
    }
}
