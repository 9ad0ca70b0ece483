//! Surfaces as BSDFs, and textures: the inverse of `bsdf` and `texture` of the reader.
//!
//! | here | Mitsuba |
//! |---|---|
//! | `diffuse`, `mirror` | `diffuse`, `conductor` |
//! | `plastic` | `plastic`, `roughplastic` |
//! | `metal` | `roughconductor`; `principled` for the Fresnel term of Schlick |
//! | `conductor` | `conductor`, `roughconductor` |
//! | `glass`, `rough_glass`, `thin_glass` | `dielectric`, `roughdielectric`, `thindielectric` |
//! | `translucent` | a `blendbsdf` of `diffuse` and a `principledthin` that only transmits |
//! | `disney` | `principled`, `principledthin` |
//! | `blend` | `blendbsdf`; by side two BSDFs of `twosided` |

use crate::common::surface::{Bsdf, Change, Color, Normals, Scalar, Surface, Use, Written, loses_light};
use crate::mitsuba::{FORMATS, Writer};
use firstlight_files::write_error::WriteError;
use firstlight_render::{Fresnel, Material, Param, TexturePattern, Wrap};
use glam::{DAffine3, DMat2, DMat3, DVec2, DVec3, Mat2, Vec3};

type Result<T = ()> = std::result::Result<T, WriteError>;

/// GGX width below which a surface is smooth.
const SMOOTH: f32 = 1e-4;

impl Writer<'_> {
    /// The BSDF of a material, with holes and normals.
    pub(crate) fn surface(&mut self, surface: &Surface, id: &str, name: &str) -> Result {
        if surface.emits_behind {
            self.tell(name, "only its front emits light");
        }
        let mut n_open = 0;
        let mut attributes = vec![("id", id)];
        if let Some(opacity) = &surface.opacity {
            self.xml.open("bsdf", &[&[("type", "mask")], &attributes[..]].concat());
            self.scalar("opacity", opacity)?;
            attributes.clear();
            n_open += 1;
        }
        // A coloured back needs no other side; a black one none at all.
        let (bsdf, is_two_sided) = match &surface.bsdf {
            Bsdf::Sides(front, back) if back.is_black() && front.is_opaque() => (&**front, false),
            bsdf => (bsdf, bsdf.is_opaque() && !bsdf.is_black()),
        };
        if is_two_sided {
            self.xml.open("bsdf", &[&[("type", "twosided")], &attributes[..]].concat());
            attributes.clear();
            n_open += 1;
        }
        let sides: Vec<&Bsdf> = match bsdf {
            Bsdf::Sides(front, back) if is_two_sided => vec![front, back],
            bsdf => vec![bsdf],
        };
        for side in sides {
            let mut n_inside = 0;
            let mut attributes = std::mem::take(&mut attributes);
            if let Some(Normals { map, is_relief }) = &surface.normals {
                let plugin = if *is_relief { "bumpmap" } else { "normalmap" };
                self.xml.open("bsdf", &[&[("type", plugin)], &attributes[..]].concat());
                attributes.clear();
                self.texture(if *is_relief { "" } else { "normalmap" }, map, *is_relief)?;
                if let Some(height) = self.scene.textures[&map.name].texture.relief.filter(|_| *is_relief) {
                    self.xml.float("scale", height);
                }
                self.xml.value("boolean", "use_shadowing_function", "false");
                n_inside += 1;
            }
            self.bsdf(side, &attributes, !is_two_sided && !surface.bsdf.is_opaque(), name)?;
            (0..n_inside).for_each(|_| self.xml.close());
        }
        (0..n_open).for_each(|_| self.xml.close());
        Ok(())
    }

    /// - `wrap`: whether opaque parts get a back of their own.
    fn bsdf(&mut self, bsdf: &Bsdf, attributes: &[(&str, &str)], wrap: bool, name: &str) -> Result {
        if wrap && bsdf.is_opaque() && !bsdf.is_black() {
            self.xml.open("bsdf", &[&[("type", "twosided")], attributes].concat());
            self.bsdf(bsdf, &[], false, name)?;
            self.xml.close();
            return Ok(());
        }
        match bsdf {
            Bsdf::Mix(share, a, b) => {
                self.xml.open("bsdf", &[&[("type", "blendbsdf")], attributes].concat());
                self.scalar("weight", share)?;
                self.bsdf(a, &[], wrap, name)?;
                self.bsdf(b, &[], wrap, name)?;
                self.xml.close();
                Ok(())
            }
            Bsdf::Sides(front, back) => {
                if !back.is_black() {
                    self.tell(name, "its back is like its front");
                }
                self.bsdf(front, attributes, wrap, name)
            }
            Bsdf::Plain(material) => self.plain(material, &Color::Rgb(Vec3::ONE), attributes, name),
            Bsdf::Tinted(material, tint) => self.plain(material, tint, attributes, name),
        }
    }

    fn plain(&mut self, material: &Material<Written>, tint: &Color, attributes: &[(&str, &str)], name: &str) -> Result {
        let smooth = |alpha: &Scalar| matches!(alpha, Scalar::Number(alpha) if *alpha < SMOOTH);
        let open = |writer: &mut Self, plugin: &str| {
            writer.xml.open("bsdf", &[&[("type", plugin)], attributes].concat());
        };
        match material {
            Material::Diffuse { albedo } => {
                open(self, "diffuse");
                self.share("reflectance", albedo)?;
            }
            Material::Plastic { diffuse, alpha, ior, specular, nonlinear, beckmann } => {
                open(self, if smooth(alpha) { "plastic" } else { "roughplastic" });
                self.share("diffuse_reflectance", diffuse)?;
                self.iors(*ior);
                if *specular != Scalar::Number(1.0) {
                    self.scalar("specular_reflectance", specular)?;
                }
                self.xml.value("boolean", "nonlinear", if *nonlinear { "true" } else { "false" });
                if !smooth(alpha) {
                    let alpha = match alpha {
                        Scalar::Number(alpha) => *alpha,
                        Scalar::Texture(Use { name: texture, change }) => {
                            self.tell(name, "the texture of the roughness of its coat becomes its mean");
                            change.of(self.scene.textures[texture].texture.mean()).x
                        }
                    };
                    self.width(&Scalar::Number(alpha.max(SMOOTH)), *beckmann)?;
                }
            }
            Material::Translucent { reflectance, transmittance } => {
                return self.translucent(reflectance, transmittance, attributes);
            }
            Material::Disney { thin_walled, ior, .. } => {
                open(self, if *thin_walled { "principledthin" } else { "principled" });
                let of_solids = ["metallic", "clearcoat", "clearcoat_gloss"];
                for (property, param) in material.params() {
                    match (property.name, param) {
                        (name, _) if *thin_walled && of_solids.contains(&name) => {}
                        ("base_color", Param::Color(color)) => self.color("base_color", color)?,
                        (_, Param::Scalar(scalar)) if *scalar == Scalar::Number(0.0) => {}
                        ("diffuse_transmission", _) if !thin_walled => {}
                        ("specular_tint", Param::Scalar(scalar)) => self.scalar("spec_tint", scalar)?,
                        ("transmission", Param::Scalar(scalar)) => self.scalar("spec_trans", scalar)?,
                        ("diffuse_transmission", Param::Scalar(scalar)) => self.scalar("diff_trans", scalar)?,
                        (name, Param::Scalar(scalar)) => self.scalar(name, scalar)?,
                        _ => {}
                    }
                }
                self.xml.float("eta", *ior);
            }
            Material::Mirror { reflectance } => {
                open(self, "conductor");
                self.xml.value("string", "material", "none");
                self.factor("specular_reflectance", reflectance)?;
            }
            Material::Metal { alpha, reflectance, fresnel: Fresnel::Schlick, .. } => {
                open(self, "principled");
                self.share("base_color", reflectance)?;
                self.xml.float("metallic", 1.0);
                self.scalar("roughness", &alpha.root())?;
            }
            Material::Metal { alpha, reflectance, .. } => {
                open(self, if smooth(alpha) { "conductor" } else { "roughconductor" });
                self.xml.value("string", "material", "none");
                self.share("specular_reflectance", reflectance)?;
                if !smooth(alpha) {
                    self.width(alpha, false)?;
                }
            }
            Material::Conductor { alpha, alpha_v, beckmann, eta, k, reflectance, .. } => {
                self.tell_of_loss(material, name);
                let is_even = *alpha_v == Scalar::Number(0.0);
                let is_smooth = smooth(alpha) && (is_even || smooth(alpha_v));
                open(self, if is_smooth { "conductor" } else { "roughconductor" });
                self.xml.rgb("eta", eta.0);
                self.xml.rgb("k", k.0);
                self.factor("specular_reflectance", reflectance)?;
                if !is_smooth && is_even {
                    self.width(alpha, *beckmann)?;
                } else if !is_smooth {
                    self.xml.value("string", "distribution", distribution(*beckmann));
                    self.scalar("alpha_u", alpha)?;
                    self.scalar("alpha_v", alpha_v)?;
                }
            }
            Material::Glass { ior, .. } => {
                open(self, "dielectric");
                self.iors(*ior);
                self.factor("specular_transmittance", tint)?;
            }
            Material::RoughGlass { alpha, ior, beckmann, .. } => {
                self.tell_of_loss(material, name);
                open(self, if smooth(alpha) { "dielectric" } else { "roughdielectric" });
                self.iors(*ior);
                if !smooth(alpha) {
                    self.width(alpha, *beckmann)?;
                }
                self.factor("specular_transmittance", tint)?;
            }
            Material::ThinGlass { ior, reflectance, transmittance } => {
                open(self, "thindielectric");
                self.iors(*ior);
                self.factor("specular_reflectance", reflectance)?;
                self.factor("specular_transmittance", transmittance)?;
            }
            Material::Principled { .. }
            | Material::Phong { .. }
            | Material::Emissive { .. }
            | Material::Blend { .. } => unreachable!("it was taken apart"),
        }
        self.xml.close();
        Ok(())
    }

    /// Tells of the energy that single scattering loses.
    fn tell_of_loss(&mut self, material: &Material<Written>, name: &str) {
        if loses_light(material) {
            self.tell(name, "the light that its microfacets scatter several times is lost");
        }
    }

    /// Two shares of a surface: one reflects, the other is a thin surface of Disney, whose diffuse transmission is even.
    /// Each has its colour divided by its share, which may be above 1 in one channel and not in another.
    fn translucent(&mut self, reflectance: &Color, transmittance: &Color, attributes: &[(&str, &str)]) -> Result {
        let strength = |color: &Color| match color {
            Color::Rgb(rgb) => rgb.max_element(),
            Color::Texture(Use { name, .. }) => self.scene.textures[name].texture.mean().max_element(),
        };
        let [back, through] = [reflectance, transmittance].map(strength);
        let share = if back + through > 0.0 { through / (back + through) } else { 0.5 };
        let of_part = |color: &Color, share: f32| {
            // A part without a share is black.
            let factor = if share > 0.0 { 1.0 / share } else { 0.0 };
            match color {
                Color::Rgb(rgb) => Color::Rgb(factor * *rgb),
                Color::Texture(Use { name, .. }) => {
                    Color::Texture(Use { name: name.clone(), change: Change::Times(factor) })
                }
            }
        };
        self.xml.open("bsdf", &[&[("type", "blendbsdf")], attributes].concat());
        self.xml.float("weight", share);
        self.xml.open("bsdf", &[("type", "twosided")]);
        self.xml.open("bsdf", &[("type", "diffuse")]);
        self.share("reflectance", &of_part(reflectance, 1.0 - share))?;
        self.xml.close();
        self.xml.close();
        self.xml.open("bsdf", &[("type", "principledthin")]);
        self.share("base_color", &of_part(transmittance, share))?;
        self.xml.float("eta", 1.0);
        self.xml.float("diff_trans", 2.0);
        self.xml.close();
        self.xml.close();
        Ok(())
    }

    fn iors(&mut self, ior: f32) {
        // Mitsuba refuses two equal ones.
        self.xml.float("int_ior", if ior == 1.0 { 1.000_001 } else { ior });
        self.xml.float("ext_ior", 1.0);
    }

    fn width(&mut self, alpha: &Scalar, beckmann: bool) -> Result {
        self.xml.value("string", "distribution", distribution(beckmann));
        self.scalar("alpha", alpha)
    }

    /// A factor, which is 1 if it is not given.
    fn factor(&mut self, name: &str, color: &Color) -> Result {
        if *color == Color::Rgb(Vec3::ONE) { Ok(()) } else { self.color(name, color) }
    }

    /// A share of light that may be above 1: of a metal, where it makes up for what microfacets lose, and of a part.
    fn share(&mut self, name: &str, color: &Color) -> Result {
        match color {
            Color::Rgb(rgb) => self.unbounded(name, *rgb),
            Color::Texture(_) => self.color(name, color)?,
        }
        Ok(())
    }

    /// A colour where Mitsuba expects a share: it refuses one above 1 that does not say so.
    fn unbounded(&mut self, name: &str, rgb: Vec3) {
        if rgb.max_element() <= 1.0 {
            return self.xml.rgb(name, rgb);
        }
        self.xml.open("texture", &[("name", name), ("type", "srgb")]);
        self.xml.rgb("color", rgb);
        self.xml.value("boolean", "unbounded", "true");
        self.xml.close();
    }

    pub(crate) fn color(&mut self, name: &str, color: &Color) -> Result {
        match color {
            Color::Rgb(rgb) => self.xml.rgb(name, *rgb),
            Color::Texture(wanted) => self.texture(name, wanted, false)?,
        }
        Ok(())
    }

    fn scalar(&mut self, name: &str, scalar: &Scalar) -> Result {
        match scalar {
            Scalar::Number(number) => self.xml.float(name, *number),
            Scalar::Texture(wanted) => self.texture(name, wanted, true)?,
        }
        Ok(())
    }

    /// - `name`: of the parameter, empty for one without a name; `is_number`: whether a number is read from it.
    fn texture(&mut self, name: &str, wanted: &Use, is_number: bool) -> Result {
        let scene = self.scene;
        let texture = &scene.textures[&wanted.name].texture;
        if texture.uv_set != 0 {
            self.tell(&wanted.name, "the second texture coordinates are left out: it uses the first");
        }
        let (matrix, offset) = (texture.uv_matrix, texture.uv_offset);
        match &texture.pattern {
            TexturePattern::White => {
                self.xml.open("texture", &[("name", name), ("type", "mesh_attribute")]);
                self.xml.value("string", "name", "vertex_color");
                let tint = wanted.change.of(texture.tint);
                let scale = tint.element_sum() / 3.0;
                if tint != Vec3::splat(tint.x) {
                    self.tell(&wanted.name, "the colour that tints the vertex colours is left out");
                }
                if scale != 1.0 {
                    self.xml.float("scale", scale);
                }
            }
            TexturePattern::Checker { a, b } => {
                self.xml.open("texture", &[("name", name), ("type", "checkerboard")]);
                let [a, b] = [*a, *b].map(|color| wanted.change.of(color));
                // Mitsuba exchanges them where it reads a number.
                let (first, second) = if is_number { (b, a) } else { (a, b) };
                self.unbounded("color0", first);
                self.unbounded("color1", second);
                // Its squares have sides of 1/2.
                self.transform_uv(0.5 * matrix, 0.5 * offset.as_dvec2());
            }
            TexturePattern::Image { wrap, smooth, .. } => {
                if texture.vertex_colors {
                    self.tell(&wanted.name, "the vertex colours that it is multiplied by are left out");
                }
                if wrap[0] != wrap[1] {
                    self.tell(&wanted.name, "it continues along v as along u");
                }
                let picture = self.folder.picture(scene, wanted, is_number, &FORMATS)?;
                self.xml.open("texture", &[("name", name), ("type", "bitmap")]);
                self.xml.value("string", "filename", &picture.file);
                if picture.is_linear {
                    self.xml.value("boolean", "raw", "true");
                }
                match wrap[0] {
                    Wrap::Repeat => {}
                    Wrap::Mirror => self.xml.value("string", "wrap_mode", "mirror"),
                    Wrap::Clamp => self.xml.value("string", "wrap_mode", "clamp"),
                }
                if !smooth {
                    self.xml.value("string", "filter_type", "nearest");
                }
                // The top row is at v = 0 there, at v = 1 here.
                let flip = Mat2::from_cols_array(&[1.0, 0.0, 0.0, -1.0]);
                let offset = offset.as_dvec2();
                self.transform_uv(flip * matrix, DVec2::new(offset.x, 1.0 - offset.y));
            }
        }
        self.xml.close();
        Ok(())
    }

    fn transform_uv(&mut self, matrix: Mat2, offset: DVec2) {
        let DMat2 { x_axis: x, y_axis: y } = matrix.as_dmat2();
        let linear = DMat3::from_cols(x.extend(0.0), y.extend(0.0), DVec3::Z);
        self.xml.transform("to_uv", &DAffine3::from_mat3_translation(linear, offset.extend(0.0)));
    }
}

/// Name of a distribution of microfacets.
fn distribution(beckmann: bool) -> &'static str {
    if beckmann { "beckmann" } else { "ggx" }
}
