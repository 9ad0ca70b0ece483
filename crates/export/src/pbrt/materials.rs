//! Surfaces as materials, and textures: the inverse of `materials` and `textures` of the reader.
//!
//! | here | pbrt |
//! |---|---|
//! | `diffuse` | `diffuse` |
//! | `plastic` | `coateddiffuse` |
//! | `mirror`, `metal`, `conductor` | `conductor` |
//! | `glass`, `rough_glass`, `thin_glass` | `dielectric`, `thindielectric` |
//! | `translucent` | `diffusetransmission` |
//! | `blend` | `mix` |

use crate::common::albedo::inner_reflectance;
use crate::common::picture::is_periodic;
use crate::common::surface::{Bsdf, Change, Color, Normals, Scalar, Surface, Use, Written, loses_light};
use crate::pbrt::text::List;
use crate::pbrt::{FORMATS, Writer, inside_of};
use firstlight_files::write_error::WriteError;
use firstlight_render::{Fresnel, Material, TexturePattern, Wrap};
use glam::{DVec2, Vec3};

type Result<T = ()> = std::result::Result<T, WriteError>;

/// Thickness of a coat: that of pbrt absorbs light, that of ours has none.
const THIN: f64 = 1e-6;

impl Writer<'_> {
    /// Writes a material; returns its name in pbrt.
    pub(crate) fn surface(&mut self, surface: &Surface, name: &str) -> Result<String> {
        let id = self.bsdf(&surface.bsdf, surface.normals.as_ref(), name)?;
        if surface.absorption != Vec3::ZERO {
            let list = List::default().string("type", "homogeneous").rgb("sigma_a", surface.absorption);
            let list = list.rgb("sigma_s", Vec3::ZERO);
            self.text.directive("MakeNamedMedium", &[&inside_of(&id)], list);
        }
        Ok(id)
    }

    fn bsdf(&mut self, bsdf: &Bsdf, normals: Option<&Normals>, name: &str) -> Result<String> {
        let list = match bsdf {
            Bsdf::Mix(share, a, b) => {
                let [a, b] = [self.bsdf(a, normals, name)?, self.bsdf(b, normals, name)?];
                let list = List::default().string("type", "mix").strings("materials", &[&a, &b]);
                self.scalar(list, "amount", share)?
            }
            Bsdf::Sides(front, _) => {
                self.tell(name, "its back is like its front");
                return self.bsdf(front, normals, name);
            }
            Bsdf::Tinted(material, tint) => {
                if *tint != Color::Rgb(Vec3::ONE) {
                    self.tell(name, "the colour of the light that passes its surface is left out");
                }
                let list = self.plain(material, name)?;
                self.with_normals(list, normals)?
            }
            Bsdf::Plain(material) => {
                let list = self.plain(material, name)?;
                self.with_normals(list, normals)?
            }
        };
        let id = self.taken.free(name);
        self.text.directive("MakeNamedMaterial", &[&id], list);
        Ok(id)
    }

    fn with_normals(&mut self, list: List, normals: Option<&Normals>) -> Result<List> {
        match normals {
            None => Ok(list),
            Some(Normals { map, is_relief: true }) => {
                let height = self.scene.textures[&map.name].texture.relief.unwrap_or(1.0);
                let height = if let Change::Times(factor) = map.change { factor * height } else { height };
                let map = Use { change: Change::Times(height), ..map.clone() };
                Ok(list.texture("displacement", &self.texture(&map, true)?))
            }
            Some(Normals { map, .. }) => {
                if !is_periodic(&self.scene.textures[&map.name].texture) {
                    self.tell(&map.name, "its part between 0 and 1 repeats: pbrt does not place normal maps");
                }
                let file = self.folder.square(self.scene, map, &FORMATS)?;
                Ok(list.string("normalmap", &file))
            }
        }
    }

    fn plain(&mut self, material: &Material<Written>, name: &str) -> Result<List> {
        let list = |kind: &str| List::default().string("type", kind);
        match material {
            Material::Diffuse { albedo } => self.color(list("diffuse"), "reflectance", albedo),
            Material::Plastic { diffuse, alpha, ior, specular, nonlinear, beckmann } => {
                self.tell_of_beckmann(*beckmann, name);
                if *specular != Scalar::Number(1.0) {
                    self.tell(name, "the reflection of its coat has its full strength");
                }
                let width = if let Scalar::Number(alpha) = alpha { *alpha } else { 0.0 };
                let below = Change::BelowCoat(inner_reflectance(*ior, width));
                let diffuse = match diffuse {
                    Color::Rgb(albedo) if !nonlinear => Color::Rgb(below.of(*albedo)),
                    Color::Texture(Use { name, change: Change::Nothing }) if !nonlinear => {
                        Color::Texture(Use { name: name.clone(), change: below })
                    }
                    same => same.clone(),
                };
                let list = self.color(list("coateddiffuse"), "reflectance", &diffuse)?;
                let list = self.width(list, alpha)?;
                Ok(list.float("eta", *ior).float("thickness", THIN))
            }
            Material::Translucent { reflectance, transmittance } => {
                let list = self.color(list("diffusetransmission"), "reflectance", reflectance)?;
                self.color(list, "transmittance", transmittance)
            }
            Material::Mirror { reflectance } => {
                if *reflectance != Color::Rgb(Vec3::ONE) {
                    self.tell(name, "its reflectance rises at grazing angles, as that of a metal");
                }
                self.color(list("conductor"), "reflectance", reflectance)
            }
            Material::Metal { alpha, reflectance, fresnel, .. } => {
                if *fresnel == Fresnel::Constant {
                    self.tell(name, "its reflectance rises at grazing angles, as that of a metal");
                }
                let list = self.color(list("conductor"), "reflectance", reflectance)?;
                self.width(list, alpha)
            }
            Material::Conductor { alpha, alpha_v, beckmann, eta, k, reflectance, .. } => {
                self.tell_of_beckmann(*beckmann, name);
                if *reflectance != Color::Rgb(Vec3::ONE) {
                    self.tell(name, "the factor of its reflection is left out");
                }
                self.tell_of_loss(material, name);
                let metal = list("conductor").rgb("eta", eta.0).rgb("k", k.0);
                if *alpha_v == Scalar::Number(0.0) {
                    return self.width(metal, alpha);
                }
                let metal = self.scalar(metal, "uroughness", alpha)?;
                Ok(self.scalar(metal, "vroughness", alpha_v)?.flag("remaproughness", false))
            }
            Material::Glass { ior, .. } => Ok(list("dielectric").float("eta", *ior)),
            Material::RoughGlass { alpha, ior, beckmann, .. } => {
                self.tell_of_beckmann(*beckmann, name);
                self.tell_of_loss(material, name);
                self.width(list("dielectric").float("eta", *ior), alpha)
            }
            Material::ThinGlass { ior, reflectance, transmittance } => {
                if [reflectance, transmittance].into_iter().any(|factor| *factor != Color::Rgb(Vec3::ONE)) {
                    self.tell(name, "the colour of its pane is left out");
                }
                Ok(list("thindielectric").float("eta", *ior))
            }
            Material::Principled { .. }
            | Material::Disney { .. }
            | Material::Phong { .. }
            | Material::Emissive { .. }
            | Material::Blend { .. } => unreachable!("it was taken apart"),
        }
    }

    /// Tells of the energy that single scattering loses.
    fn tell_of_loss(&mut self, material: &Material<Written>, name: &str) {
        if loses_light(material) {
            self.tell(name, "the light that its microfacets scatter several times is lost");
        }
    }

    fn tell_of_beckmann(&mut self, beckmann: bool, name: &str) {
        if beckmann {
            self.tell(name, "its microfacets are those of GGX, with longer tails than Beckmann's");
        }
    }

    /// A GGX width, used as it is.
    fn width(&mut self, list: List, alpha: &Scalar) -> Result<List> {
        Ok(self.scalar(list, "roughness", alpha)?.flag("remaproughness", false))
    }

    fn color(&mut self, list: List, name: &str, color: &Color) -> Result<List> {
        Ok(match color {
            Color::Rgb(rgb) => list.rgb(name, *rgb),
            Color::Texture(wanted) => list.texture(name, &self.texture(wanted, false)?),
        })
    }

    fn scalar(&mut self, list: List, name: &str, scalar: &Scalar) -> Result<List> {
        Ok(match scalar {
            Scalar::Number(number) => list.float(name, *number),
            Scalar::Texture(wanted) => list.texture(name, &self.texture(wanted, true)?),
        })
    }

    /// The name of a texture, which is written on its first use.
    pub(crate) fn texture(&mut self, wanted: &Use, is_number: bool) -> Result<String> {
        let key = format!("{is_number} {wanted:?}");
        if let Some(known) = self.textures.get(&key) {
            return Ok(known.clone());
        }
        let scene = self.scene;
        let texture = &scene.textures[&wanted.name].texture;
        if texture.uv_set != 0 {
            self.tell(&wanted.name, "the second texture coordinates are left out: it uses the first");
        }
        let matrix = texture.uv_matrix;
        let is_straight = matrix.x_axis.y.abs() + matrix.y_axis.x.abs() <= 1e-6 * matrix.x_axis.length();
        if !is_straight {
            self.tell(&wanted.name, "pbrt does not rotate textures");
        }
        let scale = match is_straight {
            true => DVec2::new(matrix.x_axis.x.into(), matrix.y_axis.y.into()),
            false => DVec2::new(matrix.x_axis.length().into(), matrix.y_axis.length().into()),
        };
        let offset = texture.uv_offset.as_dvec2();
        let place = |list: List| {
            let list = if scale == DVec2::ONE { list } else { list.float("uscale", scale.x).float("vscale", scale.y) };
            if offset == DVec2::ZERO { list } else { list.float("udelta", offset.x).float("vdelta", offset.y) }
        };
        let constant = |list: List, name: &str, color: Vec3| match is_number {
            true => list.float(name, color.x),
            false => list.rgb(name, color),
        };
        let (class, list) = match &texture.pattern {
            TexturePattern::White => {
                self.tell(&wanted.name, "pbrt has no colours of vertices: they are white");
                ("constant", constant(List::default(), "value", wanted.change.of(texture.tint)))
            }
            TexturePattern::Checker { a, b } => {
                let [a, b] = [*a, *b].map(|color| wanted.change.of(color));
                if !is_number && a.max(b).max_element() > 1.0 {
                    self.tell(&wanted.name, "colours above 1 are 1 in pbrt");
                }
                ("checkerboard", place(constant(constant(List::default(), "tex1", a), "tex2", b)))
            }
            TexturePattern::Image { wrap, smooth, .. } => {
                if texture.vertex_colors {
                    self.tell(&wanted.name, "the vertex colours that it is multiplied by are left out");
                }
                if wrap[0] != wrap[1] || wrap[0] == Wrap::Mirror {
                    self.tell(&wanted.name, "outside of its image it repeats, or its edge continues");
                }
                let picture = self.folder.picture(scene, wanted, is_number, &FORMATS)?;
                let mut list = place(List::default().string("filename", &picture.file));
                if wrap[0] == Wrap::Clamp {
                    list = list.string("wrap", "clamp");
                }
                if picture.is_linear {
                    list = list.string("encoding", "linear");
                }
                if !smooth {
                    list = list.string("filter", "point");
                }
                ("imagemap", list)
            }
        };
        let name = self.texture_names.free(&wanted.name);
        self.text.directive("Texture", &[&name, if is_number { "float" } else { "spectrum" }, class], list);
        self.textures.insert(key, name.clone());
        Ok(name)
    }
}
