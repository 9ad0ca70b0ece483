//! pbrt, version 4: scenes in text. Start reading at [`text()`].
//!
//! Source: the description of the format, "pbrt-v4 Input File Format".

mod materials;
mod text;
mod view;

use crate::common::albedo::Renderer;
use crate::common::environment::square_image;
use crate::common::folder::Folder;
use crate::common::identifiers::Identifiers;
use crate::common::objects::{Geometry, Placed, placed, radiance_of};
use crate::common::picture::exr;
use crate::common::projected::Projected;
use crate::common::scene::WholeScene;
use crate::common::surface::{Color, Scalar, Surface, Use};
use crate::pbrt::text::{List, MARKS, Text, quoted};
use firstlight_files::printable;
use firstlight_files::warnings::Warnings;
use firstlight_files::whole_file::unwritable;
use firstlight_files::write_error::WriteError;
use firstlight_format::light::LightKind;
use firstlight_format::parts::LightPart;
use firstlight_format::sources::{EnvironmentLayout, EnvironmentSource};
use firstlight_render::{Environment, Falloff};
use glam::{DAffine3, DMat3, DVec3, Mat2, Vec2, Vec3};
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// Image files that pbrt reads.
const FORMATS: [&str; 8] = ["png", "jpg", "jpeg", "bmp", "tga", "exr", "hdr", "pfm"];

/// From the axes of pbrt's sphere, whose texture has its poles at ±Z, to those of ours, with poles at ±Y.
const SPHERE_AXES: DMat3 = DMat3::from_cols(DVec3::NEG_X, DVec3::Z, DVec3::Y);

/// A scene that is being written.
struct Writer<'a> {
    scene: &'a WholeScene,
    folder: &'a mut Folder,
    warnings: &'a mut Warnings,
    text: Text,
    surfaces: HashMap<String, Surface>,
    /// Names of materials in pbrt.
    ids: HashMap<String, String>,
    taken: Identifiers,
    /// Names of textures by what they are.
    textures: HashMap<String, String>,
    texture_names: Identifiers,
}

/// The text of a scene; its meshes and images go to the folder.
pub(crate) fn text(
    scene: &WholeScene,
    folder: &mut Folder,
    warnings: &mut Warnings,
    image: &str,
) -> Result<String, WriteError> {
    let mut writer = Writer {
        scene,
        folder,
        warnings,
        text: Text::default(),
        surfaces: HashMap::new(),
        ids: HashMap::new(),
        taken: Identifiers::without(&MARKS),
        textures: HashMap::new(),
        texture_names: Identifiers::without(&MARKS),
    };
    writer.view(image);
    writer.text.line("\nWorldBegin\n");
    writer.world()?;
    Ok(writer.text.text)
}

impl Writer<'_> {
    fn world(&mut self) -> Result<(), WriteError> {
        let names = self.scene.used_materials();
        for name in &names {
            let surface = Surface::of(self.scene, name, Renderer::Pbrt, self.warnings);
            self.surfaces.insert(name.clone(), surface);
        }
        let emits = |name: &str| self.surfaces.get(name).is_some_and(|surface| surface.radiance.is_some());
        let all = placed(self.scene, emits, self.warnings);
        self.environment()?;
        for light in &self.scene.file.lights {
            self.light(light)?;
        }
        for name in names {
            let surface = self.surfaces[&name].clone();
            let id = self.surface(&surface, &name)?;
            self.ids.insert(name, id);
        }
        let mut known_groups = HashSet::new();
        for (i, placed) in all.iter().enumerate() {
            let Some(group) = placed.group else {
                self.shape(placed)?;
                continue;
            };
            if i > 0 && placed.is_part_of(&all[i - 1]) {
                continue;
            }
            let name = format!("group {}", group + 1);
            if known_groups.insert(group) {
                self.text.begin(&format!("ObjectBegin {}", quoted(&name)));
                for part in all[i..].iter().take_while(|part| part.is_part_of(placed)) {
                    self.shape(&Placed { world: DAffine3::IDENTITY, ..part.clone() })?;
                }
                self.text.end("ObjectEnd");
            }
            self.text.begin("AttributeBegin");
            self.text.transform(&placed.world);
            self.text.directive("ObjectInstance", &[&name], List::default());
            self.text.end("AttributeEnd");
        }
        Ok(())
    }

    fn tell(&mut self, name: &str, what: &str) {
        self.warnings.push(format!("`{}`: {what}", printable::name(name)));
    }

    fn shape(&mut self, placed: &Placed) -> Result<(), WriteError> {
        let surface = self.surfaces.get(&placed.material).cloned();
        let mut list = List::default();
        self.text.begin("AttributeBegin");
        if let Some(surface) = &surface {
            if let Some(id) = self.ids.get(&placed.material) {
                if surface.absorption != Vec3::ZERO {
                    self.text.directive("MediumInterface", &[&inside_of(id), ""], List::default());
                }
                self.text.directive("NamedMaterial", &[id], List::default());
            }
            if let Some(radiance) = &surface.radiance {
                let light = match radiance {
                    Color::Rgb(rgb) => List::default().rgb("L", *rgb),
                    Color::Texture(wanted) => self.glow(wanted, placed)?,
                };
                let both = surface.emits_behind;
                let light = if both { light.flag("twosided", true) } else { light };
                self.text.directive("AreaLightSource", &["diffuse"], light);
            }
            list = match &surface.opacity {
                None => list,
                Some(Scalar::Number(opacity)) => list.float("alpha", *opacity),
                Some(Scalar::Texture(wanted)) => {
                    let texture = self.texture(wanted, true)?;
                    list.texture("alpha", &texture)
                }
            };
        }
        let is_textured = surface.as_ref().is_some_and(Surface::is_textured);
        let kind = match &placed.geometry {
            Geometry::Sphere => {
                let radius = placed.world.matrix3.determinant().abs().cbrt();
                let linear = match is_textured {
                    true => placed.world.matrix3 * (1.0 / radius) * SPHERE_AXES,
                    false => DMat3::IDENTITY,
                };
                self.text.transform(&DAffine3::from_mat3_translation(linear, placed.world.translation));
                list = list.float("radius", radius);
                "sphere"
            }
            Geometry::Square => {
                let corner = |x: f64, y: f64| placed.world.transform_point3(DVec3::new(x, y, 0.0));
                let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0)];
                list = list.points("P", &corners);
                "bilinearmesh"
            }
            Geometry::Mesh(mesh, slot) => {
                self.text.transform(&placed.world);
                let file = self.folder.mesh(mesh, *slot, [false, is_textured], &placed.name)?;
                list = list.string("filename", &file);
                "plymesh"
            }
        };
        self.text.directive("Shape", &[kind], list);
        self.text.end("AttributeEnd");
        Ok(())
    }

    /// The light of an image: pbrt has it on rectangles alone.
    fn glow(&mut self, wanted: &Use, placed: &Placed) -> Result<List, WriteError> {
        let mean = || wanted.change.of(self.scene.textures[&wanted.name].texture.mean());
        if !matches!(placed.geometry, Geometry::Square) {
            let mean = mean();
            self.tell(&placed.name, "the texture of its light becomes its mean");
            return Ok(List::default().rgb("L", mean));
        }
        let file = self.folder.square(self.scene, wanted, &FORMATS)?;
        Ok(List::default().string("filename", &file))
    }

    fn light(&mut self, light: &LightPart) -> Result<(), WriteError> {
        let (kind, placement) = LightKind::from_part(light);
        let direction = kind.direction(&placement);
        let name = light.name().unwrap_or("light");
        if let Some((center, radius, radiance)) = radiance_of(light) {
            self.text.begin("AttributeBegin");
            self.text.directive("Material", &["diffuse"], List::default().rgb("reflectance", Vec3::ZERO));
            self.text.directive("AreaLightSource", &["diffuse"], List::default().rgb("L", radiance));
            self.text.transform(&DAffine3::from_translation(center));
            self.text.directive("Shape", &["sphere"], List::default().float("radius", radius));
            self.text.end("AttributeEnd");
            return Ok(());
        }
        match Projected::of(self.scene, light) {
            Some(Projected { texture: None, .. }) => self.tell(name, "the frame of its white image is left out"),
            Some(projected) => return self.projection(name, &projected),
            None => {}
        }
        let from = placement.translation;
        match (kind, direction) {
            (LightKind::Point(light), _) => {
                let list = List::default().rgb("I", light.intensity).points("from", &[from]);
                self.text.directive("LightSource", &["point"], list);
            }
            (LightKind::Spot(light), Some(direction)) => {
                if light.falloff != Falloff::Smooth && light.inner_angle_deg < light.outer_angle_deg {
                    self.tell(name, "the edge of its cone falls off as pbrt has it");
                }
                let list = List::default().rgb("I", light.intensity).points("from", &[from]);
                let list = list.points("to", &[from + direction]).float("coneangle", light.outer_angle_deg);
                let list = list.float("conedeltaangle", light.outer_angle_deg - light.inner_angle_deg);
                self.text.directive("LightSource", &["spot"], list);
            }
            (LightKind::Directional(light), Some(direction)) => {
                let list = List::default().rgb("L", light.irradiance);
                let list = list.points("from", &[DVec3::ZERO]).points("to", &[direction]);
                self.text.directive("LightSource", &["distant"], list);
            }
            (LightKind::Spot(_) | LightKind::Directional(_), None) => {
                self.tell(name, "a light without a direction is left out");
            }
        }
        Ok(())
    }

    fn projection(&mut self, name: &str, projected: &Projected) -> Result<(), WriteError> {
        let Some(texture) = &projected.texture else { return Ok(()) };
        let light = &projected.light;
        if projected.is_cut() {
            self.tell(name, "the cone that cuts its image is left out");
        }
        if light.image.even {
            self.tell(name, "its image is darker off the middle, by its cosine cubed");
        }
        let image = &self.scene.textures[&texture.name].texture;
        if (image.uv_matrix, image.uv_offset) != (Mat2::IDENTITY, Vec2::ZERO) {
            self.tell(name, "the transform of its texture is left out");
        }
        let scale = light.intensity.max_element();
        if light.intensity != Vec3::splat(scale) {
            self.tell(name, "the colour that tints its image is left out");
        }
        let picture = self.folder.picture(self.scene, texture, false, &FORMATS)?;
        // Its image has the proportions of its pixels, and the field of view is that of the shorter side.
        let squeezed = projected.half.y * projected.aspect / projected.half.x;
        let half = if projected.aspect > 1.0 { projected.half.x / projected.aspect } else { projected.half.x };
        self.text.begin("AttributeBegin");
        self.text.transform(&projected.world(1.0, squeezed));
        let list = List::default().string("filename", &picture.file).float("scale", scale);
        let list = list.float("fov", 2.0 * half.atan().to_degrees());
        self.text.directive("LightSource", &["projection"], list);
        self.text.end("AttributeEnd");
        Ok(())
    }

    fn environment(&mut self) -> Result<(), WriteError> {
        let world = match &self.scene.environment {
            Environment::Black => return Ok(()),
            Environment::Constant(radiance) => {
                self.text.directive("LightSource", &["infinite"], List::default().rgb("L", *radiance));
                return Ok(());
            }
            Environment::Gradient { .. } | Environment::Image { .. } => DMat3::IDENTITY,
        };
        let copied = match (&self.scene.file.environment, &self.scene.environment_file) {
            (
                EnvironmentSource::Image { scale, rotate: 0.0, layout: EnvironmentLayout::EqualArea, axes, .. },
                Some(file),
            ) if scale.0 == Vec3::splat(scale.0.x) => {
                let extension = file.extension().and_then(|it| it.to_str()).map(str::to_ascii_lowercase);
                let extension = extension.filter(|it| FORMATS.contains(&it.as_str()));
                extension.map(|extension| (file.clone(), extension, scale.0.x, *axes))
            }
            _ => None,
        };
        let (file, scale, world) = match copied {
            Some((file, extension, scale, axes)) => {
                // Rows of the inverse of an orthonormal matrix are its columns.
                let world = axes.map_or(DMat3::IDENTITY, |rows| DMat3::from_cols_array_2d(&rows).transpose().inverse());
                (self.folder.copy(&file, &extension)?, scale, world)
            }
            None => {
                let (side, texels) = square_image(&self.scene.environment);
                let bytes = exr(side, side, &texels).map_err(|error| unwritable(Path::new("environment"), error))?;
                (self.folder.add("environment", "exr", &bytes)?, 1.0, world)
            }
        };
        self.text.begin("AttributeBegin");
        self.text.transform(&DAffine3::from_mat3(world));
        let list = List::default().string("filename", &file);
        let list = if scale == 1.0 { list } else { list.float("scale", scale) };
        self.text.directive("LightSource", &["infinite"], list);
        self.text.end("AttributeEnd");
        Ok(())
    }
}

/// The medium that a body of this material is full of.
fn inside_of(material: &str) -> String {
    format!("inside of {material}")
}
