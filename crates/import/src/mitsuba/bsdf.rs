//! BSDFs as our materials: the one place that says which of ours stands for which of Mitsuba's, and what is told.
//!
//! Roughness is α in Mitsuba and its square root in `principled`. Start reading at [`Converter::material`].

use crate::mitsuba::converter::Reads;
use crate::mitsuba::converter::{Converter, Surface};
use crate::mitsuba::graph::{Node, Value};
use crate::mitsuba::spectrum::Use;
use crate::mitsuba::words::numbers;
use crate::model::foreign::{grey, n_lobes, tinted, tinted_glass};
use crate::model::ior;
use firstlight_files::printable;
use firstlight_format::error::{SceneError, suggestion};
use firstlight_format::parts::MaterialPart;
use firstlight_format::sources::TextureSource;
use firstlight_format::value::{ColorValue, ScalarValue};
use firstlight_render::{Fresnel, MAX_LOBES, Material};
use glam::Vec3;

/// Depth of nested BSDFs.
const MAX_DEPTH: u32 = 32;

/// Microfacets of a rough surface: α along u and v, and their distribution.
pub(crate) struct Microfacets {
    pub u: ScalarValue,
    pub v: ScalarValue,
    pub beckmann: bool,
}

impl Converter<'_> {
    /// The material of a BSDF; `None` for `null`, through which light passes.
    pub(crate) fn surface(&mut self, node: Node, depth: u32) -> Result<Option<Surface>, SceneError> {
        if let Some(known) = self.surfaces.get(&node.index) {
            return Ok(known.clone());
        }
        if depth > MAX_DEPTH {
            self.tell(node, &format!("BSDFs are nested more than {MAX_DEPTH} deep: the inner ones are grey"));
            return Ok(Some(Surface::two_sided(grey())));
        }
        let surface = self.surface_of(node, depth)?;
        self.surfaces.insert(node.index, surface.clone());
        Ok(surface)
    }

    fn surface_of(&mut self, node: Node, depth: u32) -> Result<Option<Surface>, SceneError> {
        let surface = match node.plugin() {
            "diffuse" => {
                let albedo = self.color(node, "reflectance", 0.5, Use::Reflectance)?;
                Surface::one_sided(Material::Diffuse { albedo })
            }
            "dielectric" | "roughdielectric" => self.dielectric(node)?,
            "thindielectric" => self.thin_dielectric(node)?,
            "conductor" | "roughconductor" => self.conductor(node)?,
            "plastic" | "roughplastic" => self.plastic(node)?,
            "pplastic" => {
                self.tell(node, "polarisation is not modelled: the surface is a roughplastic");
                self.plastic(node)?
            }
            "principled" | "principledthin" => self.principled(node)?,
            // From here to `disneymetal`, of other renderers that read these files.
            "mirror" => {
                let reflectance = self.color(node, "reflectance", 1.0, Use::Reflectance)?;
                Surface::two_sided(Material::Mirror { reflectance })
            }
            "glass" => self.dielectric(node)?,
            plugin @ ("disneybsdf" | "disneydiffuse" | "disneyglass" | "disneymetal") => {
                self.tell(node, &format!("a {plugin} is modelled as principled"));
                Surface { two_sided: true, ..self.principled(node)? }
            }
            // From here to `mixturebsdf`, of version 0.x.
            "roughdiffuse" => {
                self.tell(node, "the roughness of a diffuse surface is not modelled: it is smooth");
                node.ignore(&["alpha", "use_fast_approx"]);
                let albedo = self.color(node, "reflectance", 0.5, Use::Reflectance)?;
                Surface::one_sided(Material::Diffuse { albedo })
            }
            "phong" | "ward" => self.with_highlight(node)?,
            "difftrans" => {
                let transmittance = self.color(node, "transmittance", 0.5, Use::Reflectance)?;
                Surface::two_sided(Material::Translucent { reflectance: ColorValue::grey(0.0), transmittance })
            }
            "coating" | "roughcoating" => return self.coating(node, depth),
            "mixturebsdf" => return self.mixture(node, depth),
            "polarizer" | "circular" | "retarder" => self.polarizing_filter(node)?,
            "twosided" => return self.both_sides(node, depth),
            "mask" => return self.mask(node, depth),
            "blendbsdf" => match self.sheet(node)? {
                Some(sheet) => sheet,
                None => return self.blend(node, depth),
            },
            "normalmap" => return self.normal_map(node, depth),
            "bumpmap" => return self.bump_map(node, depth),
            "null" => return Ok(None),
            plugin => {
                // Variants of other people have such names: roughconductorGGX.
                let known = ["roughconductor", "roughdielectric", "roughplastic"];
                let known = known.into_iter().find(|known| plugin.starts_with(known));
                let plugin = printable::name(plugin).into_owned();
                if let Some(known) = known {
                    self.tell(node, &format!("BSDFs of type {plugin} are not modelled: it is a {known}"));
                    return Ok(Some(match known {
                        "roughconductor" => self.conductor(node)?,
                        "roughdielectric" => self.dielectric(node)?,
                        _ => self.plastic(node)?,
                    }));
                }
                self.tell(node, &format!("BSDFs of type {plugin} are not modelled: the surface is grey and diffuse"));
                node.skip();
                Surface::two_sided(grey())
            }
        };
        Ok(Some(surface))
    }

    /// The index of refraction of one side, by name or number.
    fn ior(&mut self, node: Node, name: &str, default: &str) -> Result<f64, SceneError> {
        let by_name = |wanted: &str| {
            ior::dielectric(wanted).ok_or_else(|| {
                let hint = suggestion(wanted, ior::dielectric_names());
                node.error(format!("there is no material `{}` for `{name}`{hint}", printable::name(wanted)))
            })
        };
        let found = match node.value(name) {
            Some(Value::Text(text)) => by_name(text)?,
            Some(_) => node.float_or(name, 1.5)?,
            None => by_name(default)?,
        };
        match found > 0.0 && found < 1e6 {
            true => Ok(found),
            false => Err(node.error(format!("`{name}` must be above 0"))),
        }
    }

    pub(crate) fn relative_ior(&mut self, node: Node, default: &str) -> Result<f32, SceneError> {
        let inside = self.ior(node, "int_ior", default)?;
        Ok((inside / self.ior(node, "ext_ior", "air")?) as f32)
    }

    /// Microfacets of a rough surface.
    pub(crate) fn microfacets(&mut self, node: Node) -> Result<Microfacets, SceneError> {
        // Beckmann's distribution is the default of Mitsuba.
        let distribution = node.text("distribution")?.map(str::to_ascii_lowercase);
        let beckmann = match distribution.as_deref() {
            None | Some("beckmann") => true,
            Some("ggx") => false,
            // Of version 0.x.
            Some("phong" | "as") => {
                self.tell(node, "Phong's distribution of microfacets is not modelled: it is Beckmann's");
                true
            }
            Some(_) => return Err(node.error("`distribution` must be beckmann or ggx")),
        };
        node.ignore(&["sample_visible"]);
        let mut alpha = |name: &str| self.scalar(node, name, 0.1).map(within_share);
        let (u, v) = if node.has("alpha_u") || node.has("alpha_v") {
            (alpha("alpha_u")?, alpha("alpha_v")?)
        } else {
            let alpha = alpha("alpha")?;
            (alpha.clone(), alpha)
        };
        Ok(Microfacets { u, v, beckmann })
    }

    /// Of a kind of surface that ours models with one width.
    pub(crate) fn isotropic(&mut self, node: Node) -> Result<(ScalarValue, bool), SceneError> {
        let Microfacets { u, v, beckmann } = self.microfacets(node)?;
        if u != v {
            self.tell(node, "anisotropy of this kind of surface is not modelled: its width along v is that along u");
        }
        Ok((u, beckmann))
    }

    fn dielectric(&mut self, node: Node) -> Result<Surface, SceneError> {
        let ior = self.relative_ior(node, "bk7")?;
        let transmittance = self.color(node, "specular_transmittance", 1.0, Use::Reflectance)?;
        let reflectance = self.color(node, "specular_reflectance", 1.0, Use::Reflectance)?;
        let (absorption, dispersion) = (Vec3::ZERO.into(), 0.0);
        let clear = if node.plugin().starts_with("rough") {
            let (alpha, beckmann) = self.isotropic(node)?;
            Material::RoughGlass { alpha, ior, absorption, dispersion, compensate: false, beckmann }
        } else {
            Material::Glass { ior, absorption, dispersion }
        };
        let part = tinted_glass(clear, transmittance, reflectance, |why| self.tell(node, why));
        Ok(Surface::two_sided(part))
    }

    fn thin_dielectric(&mut self, node: Node) -> Result<Surface, SceneError> {
        let ior = self.relative_ior(node, "bk7")?;
        let reflectance = self.color(node, "specular_reflectance", 1.0, Use::Reflectance)?;
        let transmittance = self.color(node, "specular_transmittance", 1.0, Use::Reflectance)?;
        Ok(Surface::two_sided(Material::ThinGlass { ior, reflectance, transmittance }))
    }

    /// A filter of polarised light: as in Mitsuba's variants without polarisation, light passes it straight on.
    fn polarizing_filter(&mut self, node: Node) -> Result<Surface, SceneError> {
        let plugin = node.plugin();
        let (share, lost) = if plugin == "retarder" { (1.0, "nothing") } else { (0.5, "half") };
        self.tell(node, &format!("polarisation is not modelled: light that passes a {plugin} loses {lost}"));
        node.ignore(&["theta", "delta", "left_handed", "polarizing"]);
        let transmittance = self.constant_color(node, "transmittance", 1.0, Use::Reflectance)?;
        let (transmittance, reflectance) = ((share * transmittance).into(), Vec3::ZERO.into());
        Ok(Surface::two_sided(Material::ThinGlass { ior: 1.0, reflectance, transmittance }))
    }

    fn conductor(&mut self, node: Node) -> Result<Surface, SceneError> {
        // Of variants, in place of an index of refraction: what is reflected at normal incidence.
        if node.has("r0") {
            let reflectance = self.color(node, "r0", 1.0, Use::Reflectance)?;
            let (alpha, _) = self.isotropic(node)?;
            let (fresnel, compensate) = (Fresnel::Schlick, false);
            return Ok(Surface::one_sided(Material::Metal { alpha, reflectance, fresnel, compensate }));
        }
        let reflectance = self.color(node, "specular_reflectance", 1.0, Use::Reflectance)?;
        let usual = if node.object().is_old { "Cu" } else { "none" };
        let material = node.text("material")?.unwrap_or(usual);
        let (eta, k) = if !node.has("eta") && !node.has("k") && material != "none" {
            ior::conductor(material).ok_or_else(|| {
                let hint = suggestion(material, ior::conductor_names());
                node.error(format!("there is no conductor `{}`{hint}", printable::name(material)))
            })?
        } else {
            (self.constant_color(node, "eta", 0.0, Use::Factor)?, self.constant_color(node, "k", 1.0, Use::Factor)?)
        };
        let outside = if node.has("ext_eta") { self.ior(node, "ext_eta", "air")? as f32 } else { 1.0 };
        let (eta, k) = (eta / outside, k / outside);
        let Microfacets { u, v, beckmann } = match node.plugin() {
            // Without a real part everything is reflected at every angle.
            "conductor" if eta == Vec3::ZERO => return Ok(Surface::one_sided(Material::Mirror { reflectance })),
            "conductor" => Microfacets { u: 0.0.into(), v: 0.0.into(), beckmann: false },
            _ => self.microfacets(node)?,
        };
        let (eta, k, compensate) = (eta.into(), k.into(), false);
        let (alpha_v, alpha) = (if u == v { 0.0.into() } else { v }, u);
        Ok(Surface::one_sided(Material::Conductor { alpha, alpha_v, beckmann, eta, k, reflectance, compensate }))
    }

    fn plastic(&mut self, node: Node) -> Result<Surface, SceneError> {
        let ior = self.relative_ior(node, "polypropylene")?;
        let diffuse = self.color(node, "diffuse_reflectance", 0.5, Use::Reflectance)?;
        let specular = within_share(self.scalar(node, "specular_reflectance", 1.0)?);
        let nonlinear = node.boolean_or("nonlinear", false)?;
        let (alpha, beckmann) = match node.plugin() {
            "plastic" => (0.0.into(), false),
            _ => self.isotropic(node)?,
        };
        Ok(Surface::one_sided(Material::Plastic { diffuse, alpha, ior, specular, nonlinear, beckmann }))
    }

    /// `principled` and `principledthin`.
    fn principled(&mut self, node: Node) -> Result<Surface, SceneError> {
        node.ignore(&[
            "clearcoat_sampling_rate",
            "diffuse_reflectance_sampling_rate",
            "diffuse_transmittance_sampling_rate",
            "main_specular_sampling_rate",
            "spec_reflectance_sampling_rate",
            "spec_trans_sampling_rate",
            "specular_reflectance_sampling_rate",
            "specular_transmittance_sampling_rate",
        ]);
        let plugin = node.plugin();
        let thin_walled = plugin == "principledthin";
        // Other renderers have other defaults, and names that are written out.
        let usual = |of: &str, default: f64| if plugin == of { 1.0 } else { default };
        let is_other = plugin.starts_with("disney");
        if is_other {
            node.ignore(&["specular"]);
        }
        let base_color = self.color(node, "base_color", 0.5, Use::Reflectance)?;
        let mut share = |name: &str, default: f64| {
            let written_out = match name {
                "spec_trans" => "specular_transmission",
                "spec_tint" => "specular_tint",
                "flatness" => "subsurface",
                name => name,
            };
            let name = if is_other && node.has(written_out) { written_out } else { name };
            self.scalar(node, name, default).map(within_share)
        };
        let transmission = share("spec_trans", usual("disneyglass", 0.0))?;
        let (roughness, anisotropic) = (share("roughness", 0.5)?, share("anisotropic", 0.0)?);
        let (specular_tint, flatness) = (share("spec_tint", 0.0)?, share("flatness", 0.0)?);
        let (sheen, sheen_tint) = (share("sheen", 0.0)?, share("sheen_tint", if is_other { 0.5 } else { 0.0 })?);
        let [mut metallic, mut clearcoat, mut clearcoat_gloss] = [0.0; 3].map(ScalarValue::Number);
        let mut diffuse_transmission = ScalarValue::Number(0.0);
        let ior = if thin_walled {
            diffuse_transmission = match self.scalar(node, "diff_trans", 0.0)? {
                ScalarValue::Number(number) => ScalarValue::Number(number.clamp(0.0, 2.0)),
                texture => texture,
            };
            self.constant_scalar(node, "eta", 1.5)?
        } else {
            (metallic, clearcoat) = (share("metallic", usual("disneymetal", 0.0))?, share("clearcoat", 0.0)?);
            clearcoat_gloss = share("clearcoat_gloss", if is_other { 1.0 } else { 0.0 })?;
            match node.float("eta")? {
                Some(eta) => eta,
                None if plugin == "disneydiffuse" => 1.0,
                None if is_other => 1.5,
                None => {
                    let transmits = transmission != ScalarValue::Number(0.0);
                    let specular = node.float_or("specular", 0.5)?.clamp(if transmits { 1e-3 } else { 0.0 }, 12.0);
                    2.0 / (1.0 - (0.08 * specular).sqrt()) - 1.0
                }
            }
        };
        let two_sided = thin_walled || transmission != ScalarValue::Number(0.0);
        let part = Material::Disney {
            base_color,
            metallic,
            roughness,
            anisotropic,
            ior: (ior as f32).clamp(1e-3, 1e3),
            specular_tint,
            transmission,
            thin_walled,
            diffuse_transmission,
            flatness,
            sheen,
            sheen_tint,
            clearcoat,
            clearcoat_gloss,
        };
        Ok(Surface { part, two_sided })
    }

    /// The nested BSDFs of an adapter, which has at least one.
    fn nested<'a>(&mut self, node: Node<'a>, count: usize) -> Result<Vec<Node<'a>>, SceneError> {
        let nested = node.children("bsdf")?;
        match nested.len() {
            0 => Err(node.error(format!("a {} contains no BSDF", node.plugin()))),
            n if n > count => {
                Err(node.error(format!("a {} contains {n} BSDFs, but may contain {count}", node.plugin())))
            }
            _ => Ok(nested),
        }
    }

    pub(crate) fn only_nested(&mut self, node: Node, depth: u32) -> Result<Option<Surface>, SceneError> {
        let nested = self.nested(node, 1)?[0];
        self.surface(nested, depth + 1)
    }

    fn both_sides(&mut self, node: Node, depth: u32) -> Result<Option<Surface>, SceneError> {
        let nested = self.nested(node, 2)?;
        let front = self.surface(nested[0], depth + 1)?;
        let Some(&back) = nested.get(1) else { return Ok(front.map(|front| Surface { two_sided: true, ..front })) };
        let (Some(front), Some(other)) = (front, self.surface(back, depth + 1)?) else { return Ok(None) };
        if n_lobes(&self.file, &front.part) + n_lobes(&self.file, &other.part) > MAX_LOBES {
            self.tell(node, &format!("two sides of more than {MAX_LOBES} lobes are not modelled: both are the first"));
            return Ok(Some(Surface { two_sided: true, ..front }));
        }
        let mut whole = by_side(String::new(), String::new());
        let is_told = !self.share_own(&mut whole, [&front.part, &other.part]);
        if is_told {
            self.tell(node, "normal maps that differ between two sides are not modelled: that of the first is on both");
            exchange_own(&mut front.part.clone(), &mut whole);
        }
        let sides =
            [(nested[0], front), (back, other)].map(|(node, side)| self.add_material(node, without_own(side.part)));
        Ok(Some(Surface::two_sided(with_parts(whole, sides))))
    }

    fn mask(&mut self, node: Node, depth: u32) -> Result<Option<Surface>, SceneError> {
        let wanted = within_share(self.scalar(node, "opacity", 0.5)?);
        let Some(surface) = self.only_nested(node, depth)? else { return Ok(None) };
        let mut part = self.whole(node, surface.part);
        if let Material::Blend { opacity, .. } = &mut part {
            *opacity = self.coverage(node, opacity.clone(), wanted);
        }
        Ok(Some(Surface { part, ..surface }))
    }

    /// The opacity of a mask in another one: their product.
    fn coverage(&mut self, node: Node, inner: ScalarValue, outer: ScalarValue) -> ScalarValue {
        let (factor, name) = match (inner, outer) {
            (ScalarValue::Number(a), ScalarValue::Number(b)) => return ScalarValue::Number(a * b),
            (ScalarValue::Number(factor), ScalarValue::Texture(name))
            | (ScalarValue::Texture(name), ScalarValue::Number(factor)) => (factor, name),
            (inner @ ScalarValue::Texture(_), ScalarValue::Texture(_)) => {
                self.tell(node, "a textured mask in another one is not modelled: only the inner one is");
                return inner;
            }
        };
        if factor == 1.0 {
            return ScalarValue::Texture(name);
        }
        ScalarValue::Texture(self.tinted(&name, Vec3::splat(factor)).unwrap_or(name))
    }

    /// The texture of this name with a factor; `None` if there is none.
    pub(crate) fn tinted(&mut self, name: &str, factor: Vec3) -> Option<String> {
        let source = self.file.textures.get(name).and_then(|source| tinted(source, factor))?;
        let new = self.names.free(&format!("{name}, tinted"));
        if let Some(attribute) = self.attributes.get(name).cloned() {
            self.attributes.insert(new.clone(), attribute);
        }
        if let Some(&(_, node)) = self.numbers.iter().find(|(number, _)| number == name) {
            self.numbers.push((new.clone(), node));
        }
        self.file.textures.0.insert(new.clone(), source);
        Some(new)
    }

    /// Moves holes and normals of two parts to the whole, if they are the same; returns whether they are.
    fn share_own(&self, whole: &mut MaterialPart, [a, b]: [&MaterialPart; 2]) -> bool {
        let is_same = own(a) == own(b);
        if is_same {
            exchange_own(&mut a.clone(), whole);
        }
        is_same
    }

    /// A surface that can have holes and normals of its own.
    fn whole(&mut self, node: Node, part: MaterialPart) -> MaterialPart {
        match part {
            Material::Blend { .. } => part,
            part => {
                let name = self.add_material(node, part);
                Material::blend(ScalarValue::Number(0.0), name.clone(), name)
            }
        }
    }

    fn blend(&mut self, node: Node, depth: u32) -> Result<Option<Surface>, SceneError> {
        let weight = within_share(self.scalar(node, "weight", 0.5)?);
        let nested = self.nested(node, 2)?;
        let [first, second] = nested[..] else { return Err(node.error("a blendbsdf contains two BSDFs")) };
        let parts = [self.surface(first, depth + 1)?, self.surface(second, depth + 1)?];
        Ok(self.blended(node, weight, [first, second], parts))
    }

    /// BSDFs with a weight each.
    fn mixture(&mut self, node: Node, depth: u32) -> Result<Option<Surface>, SceneError> {
        let (nested, weights) = (node.children("bsdf")?, node.text("weights")?.and_then(numbers).unwrap_or_default());
        if nested.is_empty() || nested.len() != weights.len() || weights.iter().any(|weight| *weight < 0.0) {
            return Err(node.error("`weights` of a mixturebsdf are one number of at least 0 for each of its BSDFs"));
        }
        let (mut whole, mut sum) = (self.surface(nested[0], depth + 1)?, weights[0]);
        for (&part, weight) in nested.iter().zip(weights).skip(1) {
            let other = self.surface(part, depth + 1)?;
            sum += weight;
            let share = if sum > 0.0 { (weight / sum) as f32 } else { 0.0 };
            whole = self.blended(node, share.into(), [node, part], [whole, other]);
        }
        // Thirds are written as 0.333.
        if sum < 0.999 {
            self.tell(node, "weights whose sum is below 1 are not modelled: they are shares");
        }
        Ok(whole)
    }

    /// The blend of the surfaces of two BSDFs.
    fn blended(
        &mut self,
        node: Node,
        weight: ScalarValue,
        [first, second]: [Node; 2],
        parts: [Option<Surface>; 2],
    ) -> Option<Surface> {
        let [a, b] = match parts {
            [Some(a), Some(b)] => [a, b],
            [a, b] => {
                self.tell(node, "a blend with a null BSDF is not modelled: it is the other part");
                return a.or(b);
            }
        };
        if n_lobes(&self.file, &a.part) + n_lobes(&self.file, &b.part) > MAX_LOBES {
            self.tell(node, &format!("a blend of more than {MAX_LOBES} lobes is not modelled: it is the first part"));
            return Some(a);
        }
        let mut whole = Material::blend(weight, String::new(), String::new());
        if !self.share_own(&mut whole, [&a.part, &b.part]) {
            self.tell(node, "holes and normal maps of the parts of a blend are not modelled: they have none");
        }
        let two_sided = a.two_sided && b.two_sided;
        let parts = [(first, a), (second, b)].map(|(node, side)| self.add_material(node, without_own(side.part)));
        Some(Surface { part: with_parts(whole, parts), two_sided })
    }

    /// Gives a surface a map of its normals.
    fn mapped(&mut self, node: Node, part: MaterialPart, map: ColorValue) -> Result<MaterialPart, SceneError> {
        let has_shadowing = node.boolean_or("use_shadowing_function", true)?;
        let turns_over = node.boolean_or("flip_invalid_normals", true)?;
        if has_shadowing != turns_over {
            self.tell(node, "use_shadowing_function and flip_invalid_normals are modelled together: there is neither");
        }
        if own(&part).1 != own(&grey()).1 {
            self.tell(node, "a map of normals in another one is not modelled: only the outer one is");
        }
        let mut part = self.whole(node, part);
        if let Material::Blend { normal_map, normal_shadowing, .. } = &mut part {
            (*normal_map, *normal_shadowing) = (map, has_shadowing && turns_over);
        }
        Ok(part)
    }

    fn bump_map(&mut self, node: Node, depth: u32) -> Result<Option<Surface>, SceneError> {
        let mut scale = node.float_or("scale", 1.0)? as f32;
        let Some(mut heights) = node.children("texture")?.first().copied() else {
            self.tell(node, "a bumpmap has no effect without a nested texture of heights");
            return self.only_nested(node, depth);
        };
        // Of version 0.x; depths have negative factors.
        for _ in 0..MAX_DEPTH {
            let Some((inner, factor)) = self.scaled(heights)? else { break };
            (heights, scale) = (inner, scale * factor.x as f32);
        }
        let heights = self.texture(heights, Use::Factor, Reads::Number)?;
        let Some(surface) = self.only_nested(node, depth)? else { return Ok(None) };
        // A constant is of one height everywhere.
        let ColorValue::Texture(heights) = heights else { return Ok(Some(surface)) };
        let mut source = self.file.textures.get(&heights).cloned();
        match &mut source {
            Some(TextureSource::Image { relief, .. }) => *relief = Some(scale),
            _ => {
                self.tell(node, "only images are modelled as bump maps: the surface is smooth");
                return Ok(Some(surface));
            }
        }
        let name = self.names.free(&format!("{heights} as relief"));
        if let Some(&(_, node)) = self.numbers.iter().find(|(number, _)| *number == heights) {
            self.numbers.push((name.clone(), node));
        }
        self.file.textures.0.extend(source.map(|source| (name.clone(), source)));
        let part = self.mapped(node, surface.part, ColorValue::Texture(name))?;
        Ok(Some(Surface { part, ..surface }))
    }

    fn normal_map(&mut self, node: Node, depth: u32) -> Result<Option<Surface>, SceneError> {
        // Of version 0.x, it has any name.
        let Some(map) = node.child("normalmap")?.or(node.children("texture")?.first().copied()) else {
            self.tell(node, "a normalmap has no effect without a nested texture called `normalmap`");
            return self.only_nested(node, depth);
        };
        let map = self.texture(map, Use::Factor, Reads::Color)?;
        let Some(surface) = self.only_nested(node, depth)? else { return Ok(None) };
        if map == ColorValue::Rgb(Vec3::new(0.5, 0.5, 1.0)) {
            node.ignore(&["flip_invalid_normals", "use_shadowing_function"]);
            return Ok(Some(surface));
        }
        let part = self.mapped(node, surface.part, map)?;
        Ok(Some(Surface { part, ..surface }))
    }
}

pub(crate) fn within_share(value: ScalarValue) -> ScalarValue {
    match value {
        ScalarValue::Number(number) => ScalarValue::Number(number.clamp(0.0, 1.0)),
        texture @ ScalarValue::Texture(_) => texture,
    }
}

/// Holes and normals of a surface, which parts of others have not: its opacity, its map, and whether that has
/// shadowing.
fn own(part: &MaterialPart) -> (ScalarValue, ColorValue, bool) {
    match part {
        Material::Blend { opacity, normal_map, normal_shadowing, .. } => {
            (opacity.clone(), normal_map.clone(), *normal_shadowing)
        }
        _ => own(&Material::blend(ScalarValue::Number(0.0), String::new(), String::new())),
    }
}

/// The same surface without holes and normals of its own.
pub(crate) fn without_own(mut part: MaterialPart) -> MaterialPart {
    exchange_own(&mut part, &mut Material::blend(ScalarValue::Number(0.0), String::new(), String::new()));
    part
}

/// A blend of two other materials.
pub(crate) fn with_parts(mut blend: MaterialPart, parts: [String; 2]) -> MaterialPart {
    if let Material::Blend { a, b, .. } = &mut blend {
        [*a, *b] = parts;
    }
    blend
}

/// Exchanges holes and normals of two surfaces, if both can have them.
pub(crate) fn exchange_own(one: &mut MaterialPart, other: &mut MaterialPart) {
    let (
        Material::Blend { opacity: a, normal_map: b, normal_shadowing: c, .. },
        Material::Blend { opacity: d, normal_map: e, normal_shadowing: f, .. },
    ) = (one, other)
    else {
        return;
    };
    std::mem::swap(a, d);
    std::mem::swap(b, e);
    std::mem::swap(c, f);
}

/// A material of its own for each side.
pub(crate) fn by_side(front: String, back: String) -> MaterialPart {
    let mut part = Material::blend(ScalarValue::Number(0.0), front, back);
    if let Material::Blend { by_side, .. } = &mut part {
        *by_side = true;
    }
    part
}
