//! BSDFs as our materials: which kind stands for which, and what of it is lost.
//!
//! | Tungsten | ours |
//! |---|---|
//! | `lambert` | `diffuse` |
//! | `oren_nayar`, `phong` | `diffuse`, told |
//! | `plastic`, `rough_plastic` | `plastic` |
//! | `dielectric`, `rough_dielectric` | `glass`, `rough_glass`, or with an albedo `principled` |
//! | `thinsheet` | `thin_glass` |
//! | `conductor`, `rough_conductor` | `conductor` |
//! | `mirror` | `mirror` |
//! | `diffuse_transmission` | `translucent` |
//! | `mixed` | `blend` |
//! | `transparency` | the opacity of its base |
//! | `smooth_coat`, `rough_coat` | their substrate, told |
//! | `null` | black |
//! | `forward` | nothing: the surface is left out |
//!
//! Reflections are the same on both sides, and roughness is α.

use crate::model::foreign::{cut, grey, n_lobes, tinted, tinted_glass};
use crate::model::ior;
use crate::tungsten::converter::{Converter, Reads};
use crate::tungsten::fields::Fields;
use firstlight_files::printable;
use firstlight_format::error::suggestion;
use firstlight_format::parts::MaterialPart;
use firstlight_format::sources::TextureSource;
use firstlight_format::value::{ColorValue, Rgb, ScalarValue};
use firstlight_render::{MAX_LOBES, Material};
use glam::Vec3;
use serde_json::Value;

/// Depth of BSDFs in one another.
const MAX_DEPTH: u32 = 16;
/// The least α of a rough surface.
const MIN_ALPHA: f32 = 1e-3;

impl<'a> Converter<'a> {
    /// The name of the material of a BSDF, which is named or in place; `None` for a surface that light passes.
    ///
    /// - `of`: what has it; `medium`: the name of what is inside.
    pub(crate) fn surface(&mut self, of: &Fields<'a>, bsdf: Option<&'a Value>, medium: &str) -> Option<String> {
        self.surface_within(of, bsdf, medium, 0)
    }

    fn surface_within(&mut self, of: &Fields<'a>, bsdf: Option<&'a Value>, medium: &str, depth: u32) -> Option<String> {
        let bsdf = match bsdf {
            Some(Value::String(name)) => match self.bsdfs.get(name.as_str()) {
                Some(bsdf) => Some(*bsdf),
                None => {
                    of.tell(format!("there is no BSDF `{}`: grey is shown", printable::name(name)));
                    None
                }
            },
            other => other,
        };
        let key = (bsdf.map_or(std::ptr::null(), std::ptr::from_ref), medium.to_owned());
        if let Some(known) = self.surfaces.get(&key) {
            return known.clone();
        }
        let fields = Fields::of(bsdf, "BSDF", of.source);
        let found = match depth > MAX_DEPTH {
            true => {
                fields.tell(format!("BSDFs are nested more than {MAX_DEPTH} deep: the inner ones are grey"));
                Some(self.add(&fields, grey()))
            }
            false => self.converted(&fields, bsdf.is_some(), medium, depth),
        };
        self.surfaces.insert(key, found.clone());
        found
    }

    fn converted(&mut self, of: &Fields<'a>, is_there: bool, medium: &str, depth: u32) -> Option<String> {
        let absorption = self.media.get(medium).copied().flatten();
        let is_shown = medium.is_empty() || of.kind().ends_with("dielectric") && absorption.is_some();
        if !is_shown {
            let medium = printable::name(medium);
            of.tell(format!("the medium `{medium}` inside is not modelled: only glass that absorbs light is"));
        }
        let absorption = absorption.unwrap_or(Vec3::ZERO).into();
        let ior = of.number("ior").unwrap_or(1.5).clamp(1e-3, 1e3) as f32;
        let (dispersion, compensate) = (0.0, false);
        let part = match of.kind() {
            "" if !is_there => grey(),
            "lambert" => Material::Diffuse { albedo: self.albedo(of) },
            "oren_nayar" | "phong" => {
                of.tell(format!("a surface of the kind `{}` is not modelled: it is diffuse", of.kind()));
                Material::Diffuse { albedo: self.albedo(of) }
            }
            "plastic" | "rough_plastic" => {
                let thickness = of.number("thickness").unwrap_or(1.0);
                if of.vector("sigma_a").is_some_and(|sigma| (sigma * thickness).max_element() > 0.0) {
                    of.tell("absorption in a coat is not modelled: it is clear");
                }
                let (alpha, beckmann) = match of.kind() {
                    "plastic" => (0.0.into(), false),
                    _ => self.roughness(of, 0.02),
                };
                let (diffuse, specular) = (self.albedo(of), 1.0.into());
                Material::Plastic { diffuse, alpha, ior, specular, nonlinear: true, beckmann }
            }
            "dielectric" | "rough_dielectric" => {
                if of.flag("enable_refraction") == Some(false) {
                    of.tell("glass without refraction is not modelled: light passes it");
                }
                let clear = match of.kind() {
                    "dielectric" => Material::Glass { ior, absorption, dispersion },
                    _ => {
                        let (alpha, beckmann) = self.roughness(of, 0.1);
                        Material::RoughGlass { alpha, ior, absorption, dispersion, compensate, beckmann }
                    }
                };
                let albedo = self.albedo(of);
                tinted_glass(clear, albedo.clone(), albedo, |why| of.tell(why))
            }
            "thinsheet" => {
                if of.flag("enable_interference") == Some(true) {
                    of.tell("interference in a thin sheet is not modelled: it has no colours of its own");
                }
                if of.vector("sigma_a").is_some_and(|sigma| sigma.max_element() > 0.0) {
                    of.tell("absorption in a thin sheet is not modelled: it is clear");
                }
                let albedo = self.albedo(of);
                Material::ThinGlass { ior, reflectance: albedo.clone(), transmittance: albedo }
            }
            "conductor" | "rough_conductor" => self.conductor(of),
            "mirror" => Material::Mirror { reflectance: self.albedo(of) },
            "diffuse_transmission" => {
                let share = of.number("transmittance").unwrap_or(0.5).clamp(0.0, 1.0) as f32;
                let albedo = self.albedo(of);
                let reflectance = self.scaled(&albedo, 1.0 - share);
                Material::Translucent { reflectance, transmittance: self.scaled(&albedo, share) }
            }
            "null" => Material::Diffuse { albedo: ColorValue::grey(0.0) },
            "mixed" => return self.mixed(of, medium, depth),
            "transparency" => return self.transparent(of, medium, depth),
            "smooth_coat" | "rough_coat" => {
                of.tell("coats are not modelled: the surface is the one below");
                return self.surface_within(of, of.get("substrate"), medium, depth + 1);
            }
            "forward" => return None,
            other => {
                let other = printable::name(other);
                of.tell(format!("BSDFs of the kind `{other}` are not modelled: the surface is grey and diffuse"));
                grey()
            }
        };
        Some(self.with_bump(of, part))
    }

    fn albedo(&mut self, of: &Fields) -> ColorValue {
        self.color(of, "albedo", 1.0, Reads::Color)
    }

    /// α, and whether the distribution is Beckmann's.
    fn roughness(&mut self, of: &Fields, default: f32) -> (ScalarValue, bool) {
        let alpha = match self.scalar(of, "roughness", default, Reads::Number) {
            ScalarValue::Number(alpha) => ScalarValue::Number(alpha.max(MIN_ALPHA)),
            texture @ ScalarValue::Texture(_) => texture,
        };
        match of.text("distribution").unwrap_or("ggx") {
            "ggx" => (alpha, false),
            "beckmann" => (alpha, true),
            other => {
                let other = printable::name(other);
                of.tell(format!("the distribution of microfacets `{other}` is not modelled: it is Beckmann's"));
                (alpha, true)
            }
        }
    }

    fn conductor(&mut self, of: &Fields) -> MaterialPart {
        let given = of.vector("eta").zip(of.vector("k"));
        let given = given.map(|(eta, k)| [eta, k].map(|it| it.as_vec3().clamp(Vec3::ZERO, Vec3::splat(1e3))));
        let name = of.text("material").filter(|name| !name.is_empty());
        let named = name.and_then(ior::conductor).map(|(eta, k)| [eta, k]);
        if let (Some(name), None) = (name, named) {
            let hint = suggestion(name, ior::conductor_names());
            of.tell(format!("there is no conductor `{}`{hint}: it is copper", printable::name(name)));
        }
        let copper = || ior::conductor("Cu").map(|(eta, k)| [eta, k]).expect("it is in the table");
        let [eta, k] = named.or(given).unwrap_or_else(copper).map(Rgb);
        let (alpha, beckmann) = match of.kind() {
            "conductor" => (0.0.into(), false),
            _ => self.roughness(of, 0.1),
        };
        let (reflectance, alpha_v, compensate) = (self.albedo(of), 0.0.into(), false);
        Material::Conductor { alpha, alpha_v, beckmann, eta, k, reflectance, compensate }
    }

    fn mixed(&mut self, of: &Fields<'a>, medium: &str, depth: u32) -> Option<String> {
        let ratio = self.scalar(of, "ratio", 0.5, Reads::Number);
        let parts = ["bsdf0", "bsdf1"].map(|name| self.surface_within(of, of.get(name), medium, depth + 1));
        let [first, second] = match parts {
            [Some(first), Some(second)] => [first, second],
            [first, second] => {
                of.tell("a mixture with a surface that light passes is not modelled: it is the other one");
                return first.or(second);
            }
        };
        let [first, second] = [first, second].map(|part| self.without_own(of, part));
        // The ratio is the share of the first.
        let part = Material::blend(ratio, second, first.clone());
        if n_lobes(&self.file, &part) > MAX_LOBES {
            of.tell(format!("a mixture of more than {MAX_LOBES} lobes is not modelled: it is the first part"));
            return Some(first);
        }
        Some(self.with_bump(of, part))
    }

    fn transparent(&mut self, of: &Fields<'a>, medium: &str, depth: u32) -> Option<String> {
        let alpha = self.scalar(of, "alpha", 1.0, Reads::Opacity);
        let base = self.surface_within(of, of.get("base"), medium, depth + 1)?;
        if alpha == ScalarValue::Number(0.0) {
            return None;
        }
        let base_part = self.file.materials.get(&base).cloned()?;
        let mut part = whole(base, base_part);
        if let Material::Blend { opacity, .. } = &mut part {
            if *opacity != ScalarValue::Number(1.0) {
                of.tell("transparency in another one is not modelled: only the outer one is");
            }
            *opacity = alpha;
        }
        Some(self.with_bump(of, part))
    }

    /// A material without holes and normals of its own: a part of another one has none.
    fn without_own(&mut self, of: &Fields, name: String) -> String {
        let Some(Material::Blend { opacity, normal_map, weight, a, b, .. }) = self.file.materials.get(&name) else {
            return name;
        };
        if *opacity == ScalarValue::Number(1.0) && matches!(normal_map, ColorValue::Rgb(_)) {
            return name;
        }
        of.tell("holes and bumps of the parts of a mixture are not modelled: they have none");
        match a == b {
            true => a.clone(),
            false => {
                let plain = Material::blend(weight.clone(), a.clone(), b.clone());
                self.add(of, plain)
            }
        }
    }

    /// Adds a material, with the bumps of its BSDF.
    fn with_bump(&mut self, of: &Fields, part: MaterialPart) -> String {
        if of.get("bump").is_none() {
            return self.add(of, part);
        }
        let heights = match self.color(of, "bump", 0.0, Reads::Number) {
            // A constant is of one height everywhere.
            ColorValue::Rgb(_) => return self.add(of, part),
            ColorValue::Texture(heights) => heights,
        };
        let mut source = self.file.textures.get(&heights).cloned();
        let Some(TextureSource::Image { relief, tint, .. }) = &mut source else {
            of.tell("only images are modelled as bumps: the surface is smooth");
            return self.add(of, part);
        };
        (*relief, tint.0) = (Some(tint.0.x), Vec3::ONE);
        let map = source.map(|source| self.add_texture(&format!("{heights} as relief"), source));
        let mut part = match part {
            Material::Blend { .. } => part,
            part => {
                let name = self.add(of, part.clone());
                whole(name, part)
            }
        };
        if let (Material::Blend { normal_map, .. }, Some(map)) = (&mut part, map) {
            *normal_map = map;
        }
        self.add(of, part)
    }

    pub(crate) fn scaled(&mut self, color: &ColorValue, factor: f32) -> ColorValue {
        match color {
            ColorValue::Rgb(rgb) => ColorValue::Rgb(*rgb * factor),
            ColorValue::Texture(name) => {
                let source = self.file.textures.get(name).and_then(|it| tinted(it, Vec3::splat(factor)));
                source.map_or_else(|| color.clone(), |source| self.add_texture(name, source))
            }
        }
    }

    pub(crate) fn add(&mut self, of: &Fields, part: MaterialPart) -> String {
        let name = self.material_names.free(cut(of.name()));
        self.file.materials.0.insert(name.clone(), part);
        name
    }
}

/// The same surface as one that can have holes and normals of its own.
fn whole(name: String, part: MaterialPart) -> MaterialPart {
    match part {
        Material::Blend { .. } => part,
        _ => Material::blend(0.0.into(), name.clone(), name),
    }
}
