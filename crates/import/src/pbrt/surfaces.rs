//! Materials and textures of a scene: described under their names, and converted when a shape has them.

use crate::model::foreign::cut;
use crate::pbrt::build::Builder;
use crate::pbrt::materials::{MaterialScope, emissive, material, with_layers};
use crate::pbrt::params::Params;
use crate::pbrt::state::{Described, MaterialRef, State};
use crate::pbrt::textures::Texture;
use firstlight_files::printable;
use firstlight_files::relative::{path_to_text, text_to_path};
use firstlight_format::material_textures::texture_names;
use firstlight_format::parts::MaterialPart;
use firstlight_format::sources::TextureSource;
use firstlight_format::value::{ColorValue, ScalarValue};
use firstlight_render::{Encoding, MAX_LOBES};
use glam::{DVec3, Vec3};
use std::rc::Rc;

/// Materials inside of one another.
const MAX_DEPTH: u32 = 8;

impl Builder<'_> {
    /// Defines a texture.
    pub(crate) fn define_texture(&mut self, name: &str, is_number: bool, class: &str, params: &Params) {
        if let Some(image) = params.string("filename") {
            // Tells what is wrong with it.
            self.file(image);
        }
        let mut told = Vec::new();
        let mut textures = std::mem::take(&mut self.textures);
        textures.define(cut(name), is_number, class, params, |name| self.named_file(name), |what| told.push(what));
        self.textures = textures;
        told.extend(params.complaints());
        told.into_iter().for_each(|what| self.tell(what));
    }

    /// Describes a material with a name.
    pub(crate) fn describe_material(&mut self, name: &str, params: Params) {
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
        let quantity = |name: &str| params.spectrum(name).and_then(|spectrum| spectrum.quantity().ok());
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
        let base = self.converted(&described, absorption);
        if opacity.is_none() && light.is_none() {
            return base;
        }
        let key = format!("{base:?} {opacity:?} {light:?}");
        if let Some(known) = self.material_of.get(&key) {
            return known.clone();
        }
        let base_name = base.clone().unwrap_or_else(|| "light".to_owned());
        let mut part = base.and_then(|name| self.part(&name));
        let mut others = Vec::new();
        if let Some((radiance, is_two_sided)) = light.clone() {
            let names = ["surface", "emitter"].map(|end| self.material_names.free(&format!("{base_name}: {end}")));
            let surface = emissive(part.as_ref(), radiance, is_two_sided, names.clone());
            others.extend(names.into_iter().zip(surface.others));
            part = Some(surface.part);
        }
        let mut part = part?;
        if let Some(value) = opacity {
            part = match with_layers(&part) {
                Some(layered) => layered,
                None if light.is_none() => MaterialPart::blend(0.0.into(), base_name.clone(), base_name.clone()),
                None => part,
            };
            if let MaterialPart::Principled { opacity, .. } | MaterialPart::Blend { opacity, .. } = &mut part {
                *opacity = value;
            } else {
                self.tell(format!("`alpha` of `{}` is not modelled with its material", printable::name(shape)));
            }
        }
        let name = self.material_names.free(&base_name);
        for (name, part) in others {
            self.add_material(name, part);
        }
        self.add_material(name.clone(), part);
        self.material_of.insert(key, Some(name.clone()));
        Some(name)
    }

    fn add_material(&mut self, name: String, part: MaterialPart) {
        let lobes = match &part {
            MaterialPart::Blend { a, b, .. } => [a, b].iter().filter_map(|name| self.lobes.get(*name)).sum(),
            plain => plain.n_lobes(),
        };
        self.lobes.insert(name.clone(), lobes);
        let is_textured = match &part {
            MaterialPart::Blend { a, b, .. } => [a, b].iter().any(|name| self.with_textures.contains(*name)),
            _ => false,
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
        for complaint in described.params.complaints() {
            self.tell(format!("material `{}`: {complaint}", printable::name(&wanted)));
        }
        if let Some(MaterialPart::Blend { a, b, .. }) = &part
            && [a, b].iter().filter_map(|name| self.lobes.get(*name)).sum::<usize>() > MAX_LOBES
        {
            let first = self.part(a);
            let what = "is a mixture of too many materials: the first is shown";
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

    /// The name of a texture, which is added on its first use.
    pub(super) fn texture_name(&mut self, wanted: &str, source: TextureSource) -> String {
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
            self.tell(&format!("there is no texture `{}`", printable::name(texture)));
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
        let described = self.builder.named.get(cut(name)).cloned()?;
        self.builder.converted(&described, Vec3::ZERO)
    }

    fn add(&mut self, part: MaterialPart) -> String {
        let name = self.builder.material_names.free(&self.name);
        self.builder.add_material(name.clone(), part);
        name
    }

    fn tell(&mut self, what: &str) {
        let name = printable::name(&self.name).into_owned();
        self.builder.tell(format!("material `{name}`: {what}"));
    }
}
