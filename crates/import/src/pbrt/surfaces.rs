//! Materials and textures of a scene: described under their names, and converted when a shape has them.

use crate::model::foreign::{LIGHT_SHARE, cut, tinted, told_of_long};
use crate::pbrt::build::{Builder, FIRST_COUNTS};
use crate::pbrt::material_inputs::{MaterialScope, principled};
use crate::pbrt::materials::{material, with_layers, with_normals};
use crate::pbrt::params::Params;
use crate::pbrt::shapes::{has_uvs, with_own_uvs};
use crate::pbrt::spectrum::UnknownSpectrum;
use crate::pbrt::state::{Described, MaterialRef, State};
use crate::pbrt::textures::{TEXTURES, Texture, unknown_spectrum, without_negative};
use firstlight_files::printable;
use firstlight_files::relative::{path_to_text, text_to_path};
use firstlight_format::material_textures::texture_names;
use firstlight_format::parts::{MaterialPart, ObjectPart};
use firstlight_format::sources::{MeshSource, TextureSource};
use firstlight_format::value::{ColorValue, ScalarValue};
use firstlight_render::{Encoding, MAX_LOBES};
use glam::{DVec3, Vec3};
use std::collections::HashMap;
use std::rc::Rc;
use std::sync::Arc;

/// Materials inside of one another.
const MAX_DEPTH: u32 = 32;

/// Textures of numbers and of colours have names of their own.
const TEXTURE_KINDS: [&str; 2] = ["texture of colours", "texture of numbers"];

/// As in version 3.
const EACH_COUNTS: &str = "each counts for what follows it";

impl Builder<'_> {
    /// Whether nothing of this kind has this name before; tells of the second, which version 4 refuses.
    ///
    /// - `counts`: which one counts.
    pub(super) fn is_first(&mut self, kind: &'static str, name: &str, counts: &str) -> bool {
        let is_first = self.defined.insert((kind, cut(name).to_owned()));
        if !is_first {
            self.tell(format!("{kind} `{}` is defined more than once: {counts}", printable::name(name)));
        }
        is_first
    }

    /// Defines a texture.
    pub(crate) fn define_texture(&mut self, name: &str, is_number: bool, class: &str, params: &Params) {
        if let Some(image) = params.string("filename") {
            // Tells what is wrong with it.
            self.file(image);
        }
        for part in TEXTURES.into_iter().filter_map(|part| params.texture(part)) {
            let is_defined = |kind| self.defined.contains(&(kind, cut(part).to_owned()));
            if !TEXTURE_KINDS.into_iter().any(is_defined) {
                self.missing.insert(cut(part).to_owned());
            }
        }
        self.is_first(TEXTURE_KINDS[usize::from(is_number)], name, EACH_COUNTS);
        let mut told = Vec::new();
        let mut textures = std::mem::take(&mut self.textures);
        textures.define(cut(name), is_number, class, params, |name| self.named_file(name), |what| told.push(what));
        self.textures = textures;
        told.extend(params.complaints());
        told.extend(told_of_long(name));
        told.into_iter().for_each(|what| self.tell(what));
    }

    /// Describes a material with a name.
    pub(crate) fn describe_material(&mut self, name: &str, params: Params) {
        told_of_long(name).into_iter().for_each(|what| self.tell(what));
        match self.is_first("material", name, EACH_COUNTS) {
            true if self.is_known && self.named.contains_key(cut(name)) => return,
            true => {}
            false => drop(self.redefined.insert(cut(name).to_owned())),
        }
        let kind = params.string("type").unwrap_or("diffuse").to_owned();
        let described = self.described(cut(name), kind, params);
        self.named.insert(cut(name).to_owned(), described);
    }

    /// A material with a number of its own.
    pub(crate) fn described(&mut self, name: &str, kind: String, params: Params) -> Rc<Described> {
        self.n_described += 1;
        Rc::new(Described { number: self.n_described, name: name.to_owned(), kind, params })
    }

    /// A medium: only one that absorbs and does not scatter is modelled, inside of glass.
    pub(crate) fn describe_medium(&mut self, name: &str, params: &Params) {
        if !self.is_first("medium", name, FIRST_COUNTS) {
            return;
        }
        let quantity = |name: &str| params.spectrum(name).and_then(|spectrum| spectrum.quantity().ok());
        for coefficient in ["sigma_a", "sigma_s"] {
            if let Some(Err(UnknownSpectrum(spectrum))) = params.spectrum(coefficient).map(|it| it.quantity()) {
                let (name, spectrum) = (printable::name(name), printable::name(&spectrum));
                self.tell(format!("medium `{name}`: the spectrum `{spectrum}` of `{coefficient}` is not known"));
            }
        }
        let scale = params.number("scale").unwrap_or(1.0);
        let is_clear = params.string("type") == Some("homogeneous")
            && quantity("sigma_s") == Some(DVec3::ZERO)
            && !params.has("Le")
            && !params.has("preset");
        let absorption = quantity("sigma_a").unwrap_or(DVec3::new(0.0011, 0.0024, 0.014)) * scale;
        let absorption = is_clear.then(|| absorption.as_vec3().max(Vec3::ZERO)).filter(|it| it.is_finite());
        if absorption.is_none() {
            self.tell(format!("medium `{}` scatters light or emits it, which is not modelled", printable::name(name)));
        }
        told_of_long(name).into_iter().for_each(|what| self.tell(what));
        self.media.insert(cut(name).to_owned(), absorption);
    }

    /// The name of the material of a shape; `None` if nothing can be seen of it.
    pub(super) fn surface(
        &mut self,
        state: &State,
        opacity: Option<ScalarValue>,
        light: Option<(ColorValue, bool)>,
        shape: &str,
    ) -> Option<String> {
        let described = match &state.material {
            MaterialRef::Own(described) => described.clone(),
            MaterialRef::Named(name) => match self.named.get(name) {
                Some(described) => described.clone(),
                None => {
                    self.missing.insert(name.clone());
                    let (name, shape) = (printable::name(name).into_owned(), printable::name(shape));
                    self.tell(format!("there is no material `{name}`, which `{shape}` has: grey is shown"));
                    match State::default().material {
                        MaterialRef::Own(described) => described,
                        MaterialRef::Named(_) => return None,
                    }
                }
            },
        };
        let absorption = self.media.get(&state.inside).copied().flatten().unwrap_or(Vec3::ZERO);
        let has_medium = !state.inside.is_empty() && !matches!(self.media.get(&state.inside), Some(Some(Vec3::ZERO)));
        if has_medium && !self.media.contains_key(&state.inside) {
            self.missing.insert(state.inside.clone());
        }
        if has_medium && (described.kind != "dielectric" || !self.media.contains_key(&state.inside)) {
            let (medium, shape) = (printable::name(&state.inside).into_owned(), printable::name(shape));
            self.tell(match self.media.contains_key(&state.inside) {
                true => format!("`{shape}`: a medium is shown inside of `dielectric` only: `{medium}` is left out"),
                false => format!("there is no medium `{medium}`, which is inside of `{shape}`"),
            });
        }
        let base = self.converted(&described, absorption);
        if opacity.is_none() && light.is_none() {
            return base;
        }
        let key = format!("{base:?} {opacity:?} {light:?}");
        if let Some(known) = self.material_of.get(&key) {
            return known.clone();
        }
        let base_name = base.clone().unwrap_or_else(|| "light".to_owned());
        let mut part = match light {
            Some((radiance, is_two_sided)) => self.glowing(base.as_deref(), radiance, is_two_sided, shape),
            None => self.part(&base?)?,
        };
        if let Some(value) = opacity {
            part = match (with_layers(&part), &part) {
                (Some(layered), _) => layered,
                // Holes of a blend are its own.
                (None, MaterialPart::Blend { .. }) => part,
                (None, _) => {
                    let name = self.add_free(&base_name, part);
                    let other = self.add_free("black", MaterialPart::Diffuse { albedo: ColorValue::grey(0.0) });
                    MaterialPart::blend(0.0.into(), name, other)
                }
            };
            if let MaterialPart::Principled { opacity, .. } | MaterialPart::Blend { opacity, .. } = &mut part {
                *opacity = value;
            }
        }
        let name = self.material_names.free(&base_name);
        self.add_material(name.clone(), part);
        self.material_of.insert(key, Some(name.clone()));
        Some(name)
    }

    /// A material that emits; what the one of the name `base` reflects stays as far as it can.
    fn glowing(&mut self, base: Option<&str>, radiance: ColorValue, is_two_sided: bool, shape: &str) -> MaterialPart {
        let part = base.and_then(|name| self.part(name));
        let black = || {
            let mut part = principled(ColorValue::grey(0.0));
            if let MaterialPart::Principled { specular, .. } = &mut part {
                *specular = 0.0.into();
            }
            part
        };
        let emitter = |radiance: ColorValue, surface: Option<MaterialPart>| match is_two_sided {
            false => MaterialPart::Emissive { radiance },
            true => {
                let mut surface = surface.unwrap_or_else(black);
                if let MaterialPart::Principled { emission, .. } = &mut surface {
                    *emission = radiance;
                }
                surface
            }
        };
        let (Some(name), Some(part)) = (base, part) else { return emitter(radiance, None) };
        match (&part, &radiance) {
            (MaterialPart::Diffuse { albedo: ColorValue::Rgb(Vec3::ZERO) }, _) => return emitter(radiance, None),
            (part, _) if is_two_sided && with_layers(part).is_some() => return emitter(radiance, with_layers(part)),
            (MaterialPart::Diffuse { albedo: ColorValue::Rgb(albedo) }, ColorValue::Rgb(light))
                if albedo.max_element() < 1.0 =>
            {
                // A share of a brighter emitter, and the rest of a brighter surface: the same emission and reflection.
                let diffuse = albedo.max_element();
                let albedo = ColorValue::Rgb((*albedo / diffuse).min(Vec3::ONE));
                let emitter = emitter(ColorValue::Rgb(*light / (1.0 - diffuse)), None);
                let a = self.add_free(&format!("{name}: surface"), MaterialPart::Diffuse { albedo });
                let b = self.add_free(&format!("{name}: emitter"), emitter);
                return MaterialPart::blend(ScalarValue::Number(1.0 - diffuse), a, b);
            }
            _ => {}
        }
        let bright = match &radiance {
            ColorValue::Rgb(rgb) => Some(ColorValue::Rgb(*rgb / LIGHT_SHARE)),
            ColorValue::Texture(name) => {
                let source = self.used_textures.iter().find(|(used, _)| used == name).map(|(_, source)| source);
                let bright = source.and_then(|source| tinted(source, Vec3::splat(LIGHT_SHARE.recip())));
                bright.map(|source| ColorValue::Texture(self.texture_name("light", source)))
            }
        };
        let emitter_of = |radiance| emitter(radiance, None);
        let lobes = self.lobes.get(name).copied().unwrap_or(1);
        match bright.map(emitter_of).filter(|emitter| lobes + emitter.n_lobes() <= MAX_LOBES) {
            Some(bright) if !self.has_textured_weight(&part) => {
                let (normals, a) = self.without_normals(name.to_owned());
                let b = self.add_free(&format!("{name}: emitter"), bright);
                with_normals(MaterialPart::blend(LIGHT_SHARE.into(), a, b), normals)
            }
            _ => {
                let shape = printable::name(shape);
                self.tell(format!("`{shape}`: what a light of its material reflects is not modelled: it only emits"));
                emitter(radiance, None)
            }
        }
    }

    fn has_textured_weight(&self, part: &MaterialPart) -> bool {
        let MaterialPart::Blend { weight, a, b, .. } = part else { return false };
        let mut parts = [a, b].into_iter().filter_map(|name| self.part(name));
        matches!(weight, ScalarValue::Texture(_)) || parts.any(|part| self.has_textured_weight(&part))
    }

    /// The map of normals of a material with its factor, if it has one, and the name of the same without it.
    fn without_normals(&mut self, name: String) -> (Option<(ColorValue, f32)>, String) {
        match self.part(&name) {
            Some(
                MaterialPart::Principled { normal_map: map @ ColorValue::Texture(_), normal_scale, .. }
                | MaterialPart::Blend { normal_map: map @ ColorValue::Texture(_), normal_scale, .. },
            ) => {
                // What has only been made a blend for its map is a plain material again.
                let plain = match self.part(&name) {
                    Some(MaterialPart::Blend { a, b, .. }) if a == b => a,
                    _ => name,
                };
                (Some((map, normal_scale)), plain)
            }
            _ => (None, name),
        }
    }

    /// Adds a material under a name that is like this one; returns its name.
    fn add_free(&mut self, wanted: &str, part: MaterialPart) -> String {
        let name = self.material_names.free(wanted);
        self.add_material(name.clone(), part);
        name
    }

    fn add_material(&mut self, name: String, part: MaterialPart) {
        let lobes = match &part {
            MaterialPart::Blend { a, b, .. } => [a, b].iter().filter_map(|name| self.lobes.get(*name)).sum(),
            plain => plain.n_lobes(),
        };
        self.lobes.insert(name.clone(), lobes);
        let is_textured = match &part {
            MaterialPart::Blend { a, b, .. } => [a, b].iter().any(|name| self.with_textures.contains(*name)),
            _ => part.is_anisotropic(),
        };
        if is_textured || !texture_names(&part).is_empty() {
            self.with_textures.insert(name.clone());
        }
        self.place_of.insert(name.clone(), self.materials.len());
        self.materials.push((name, part));
    }

    pub(super) fn part(&self, name: &str) -> Option<MaterialPart> {
        self.place_of.get(name).map(|&place| self.materials[place].1.clone())
    }

    /// The name of a material as one of ours; `None` if nothing can be seen of it.
    fn converted(&mut self, described: &Rc<Described>, absorption: Vec3) -> Option<String> {
        let key = format!("{} {absorption}", described.number);
        if let Some(known) = self.material_of.get(&key) {
            return known.clone();
        }
        if self.depth >= MAX_DEPTH {
            let name = printable::name(&described.name).into_owned();
            self.tell(format!("material `{name}` lies more than {MAX_DEPTH} mixtures deep: it is left out"));
            return None;
        }
        // A mixture that contains itself finds nothing there.
        self.material_of.insert(key.clone(), None);
        self.depth += 1;
        let wanted = if described.name.is_empty() { described.kind.as_str() } else { &described.name };
        let wanted = cut(if wanted.is_empty() { "material" } else { wanted }).to_owned();
        let mut scope = Scope { builder: self, name: wanted.clone() };
        let mut part = material(&mut scope, &described.kind, &described.params, absorption);
        self.depth -= 1;
        // Of what is grey, nothing has an effect.
        let unused = described.params.unused().filter(|_| !matches!(&*described.kind, "hair" | "measured"));
        for complaint in described.params.complaints().into_iter().chain(unused) {
            self.tell(format!("material `{}`: {complaint}", printable::name(&wanted)));
        }
        if let Some(MaterialPart::Blend { a, b, .. }) = &part
            && [a, b].iter().filter_map(|name| self.lobes.get(*name)).sum::<usize>() > MAX_LOBES
        {
            let first = self.part(a);
            let what = format!("is a mixture of more than {MAX_LOBES} materials: the first is shown");
            self.tell(format!("material `{}` {what}", printable::name(&wanted)));
            part = first;
        }
        let name = part.map(|part| {
            let name = self.material_names.free(&wanted);
            self.add_material(name.clone(), part);
            name
        });
        self.material_of.insert(key, name.clone());
        name
    }

    /// Gives meshes without texture coordinates those of pbrt, where a texture of their material needs them.
    pub(crate) fn add_missing_uvs(&mut self) {
        let mut with_uvs: HashMap<String, bool> = HashMap::new();
        for index in 0..self.objects.len() {
            let ObjectPart::Mesh { source, material: Some(material), .. } = &self.objects[index] else { continue };
            if !self.with_textures.contains(material) {
                continue;
            }
            match source {
                MeshSource::Part { shape, .. } => {
                    let bare = self.parts.get_mut(shape).filter(|mesh| mesh.uvs.is_empty());
                    bare.into_iter().for_each(|mesh| *mesh = Arc::new(with_own_uvs(mesh)));
                }
                MeshSource::Ply(file) => {
                    let path = self.folder.join(text_to_path(file));
                    let name = printable::name(file).into_owned();
                    if !*with_uvs.entry(file.clone()).or_insert_with(|| has_uvs(&path)) {
                        self.tell(format!("`{name}` has no texture coordinates: in pbrt its textures lie otherwise"));
                    }
                }
                _ => {}
            }
        }
    }

    /// The name of a texture, which is added on its first use.
    pub(super) fn texture_name(&mut self, wanted: &str, source: TextureSource) -> String {
        let source = without_negative(source);
        let key = format!("{source:?}");
        if let Some(name) = self.texture_of.get(&key) {
            return name.clone();
        }
        let stem = match &source {
            TextureSource::Image { file, .. } => text_to_path(file).file_stem().map(|stem| path_to_text(stem.as_ref())),
            _ => None,
        };
        // A name that begins like a colour would be read as one.
        let wanted = stem.unwrap_or_else(|| wanted.to_owned()).replace('#', "_");
        let name = self.texture_names.free(cut(&wanted));
        self.texture_of.insert(key, name.clone());
        self.used_textures.push((name.clone(), source));
        name
    }
}

/// A material that is being converted.
struct Scope<'a, 'b> {
    builder: &'a mut Builder<'b>,
    name: String,
}

impl Scope<'_, '_> {
    fn parameter(&mut self, is_number: bool, params: &Params, name: &str) -> Option<Texture> {
        let found = self.builder.textures.parameter(is_number, params, name);
        if found.is_none()
            && let Some(texture) = params.texture(name)
        {
            self.builder.missing.insert(texture.to_owned());
            self.tell(&format!("there is no texture `{}`", printable::name(texture)));
        }
        if !is_number && let Some(spectrum) = unknown_spectrum(params, name) {
            self.tell(&spectrum);
        }
        found
    }
}

impl MaterialScope for Scope<'_, '_> {
    fn number(&mut self, params: &Params, name: &str) -> Option<Texture> {
        self.parameter(true, params, name)
    }

    fn color(&mut self, params: &Params, name: &str) -> Option<Texture> {
        self.parameter(false, params, name)
    }

    fn color_value(&mut self, texture: Texture) -> ColorValue {
        match texture {
            Texture::Constant(color) => ColorValue::Rgb(color),
            Texture::Varying(source) => ColorValue::Texture(self.builder.texture_name(&self.name, source)),
        }
    }

    fn scalar_value(&mut self, texture: Texture) -> ScalarValue {
        match texture {
            Texture::Constant(value) => ScalarValue::Number(value.x.clamp(0.0, 1.0)),
            Texture::Varying(source) => ScalarValue::Texture(self.builder.texture_name(&self.name, source)),
        }
    }

    fn image(&mut self, name: &str) -> Option<ColorValue> {
        let mut source = TextureSource::image(self.builder.file(name)?);
        if let TextureSource::Image { encoding, .. } = &mut source {
            *encoding = Encoding::Linear;
        }
        Some(ColorValue::Texture(self.builder.texture_name(&self.name, source)))
    }

    fn material(&mut self, name: &str) -> Option<String> {
        let Some(described) = self.builder.named.get(cut(name)).cloned() else {
            self.builder.missing.insert(cut(name).to_owned());
            self.tell(&format!("there is no material `{}`", printable::name(name)));
            return None;
        };
        self.builder.converted(&described, Vec3::ZERO)
    }

    fn without_normals(&mut self, name: String) -> (Option<(ColorValue, f32)>, String) {
        self.builder.without_normals(name)
    }

    fn add(&mut self, part: MaterialPart) -> String {
        self.builder.add_free(&self.name.clone(), part)
    }

    fn tell(&mut self, what: &str) {
        let name = printable::name(&self.name).into_owned();
        self.builder.tell(format!("material `{name}`: {what}"));
    }
}
