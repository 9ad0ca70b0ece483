//! Materials taken apart into what other renderers have as well: plain surfaces, their mixtures, what they emit, where
//! they have holes, and their normals.
//!
//! `principled` becomes a mixture of metal, glass and an opaque base, `phong` one of diffuse, mirror and glass. Metals
//! and bases return as much light as here, although single scattering loses some. Start reading at [`Surface::of`].

use crate::common::albedo::{Base, Metallic, Renderer};
use crate::common::scene::WholeScene;
use firstlight_files::printable;
use firstlight_files::warnings::Warnings;
use firstlight_format::parts::{InFile, MaterialPart};
use firstlight_format::value::{ColorValue, Rgb, ScalarValue};
use firstlight_render::{Fresnel, MapParams, Material, Param, Params, Texture, TexturePattern};
use glam::{Mat2, Vec2, Vec3};

/// Depth of blends in blends.
const MAX_DEPTH: u32 = 32;

/// GGX widths below these are mirrors.
const SMOOTH: f32 = 1e-4;

/// GGX widths up to which a coat and the base below it lose a hundredth of the light.
const LOSSLESS: f32 = 0.04;

/// GGX widths up to which highlights of a coat are sharp enough to show how they increase at grazing angles.
const GLOSSY: f32 = 0.17;

/// What is done to the values of a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Change {
    Nothing,
    /// The roughness of `principled` as a GGX width.
    Squared,
    /// The inverse.
    Root,
    Times(f32),
    /// The albedo of a base that colours light at every bounce below its coat, for one that does once; the coat
    /// reflects this share inwards.
    BelowCoat(f32),
    /// 1 from this value on, else 0.
    From(f32),
    /// Normals with slopes multiplied by these.
    Slope(Vec2),
}

impl Change {
    pub(crate) fn of(self, value: Vec3) -> Vec3 {
        match self {
            Self::Nothing => value,
            Self::Squared => value * value,
            Self::Root => value.max(Vec3::ZERO).map(f32::sqrt),
            Self::Times(factor) => factor * value,
            Self::BelowCoat(inwards) => value.map(|albedo| albedo / (1.0 - inwards + albedo * inwards)),
            Self::From(least) => value.map(|value| if value >= least { 1.0 } else { 0.0 }),
            Self::Slope(factor) => {
                let normal = 2.0 * value - 1.0;
                let steeper = Vec3::new(factor.x * normal.x, factor.y * normal.y, normal.z);
                0.5 + 0.5 * steeper.normalize_or(Vec3::Z)
            }
        }
    }
}

/// A texture of the scene, with what is done to it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Use {
    pub name: String,
    pub change: Change,
}

/// A colour as it is written.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Color {
    Rgb(Vec3),
    Texture(Use),
}

/// A number as it is written.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Scalar {
    Number(f32),
    Texture(Use),
}

impl From<Vec3> for Color {
    fn from(rgb: Vec3) -> Self {
        Self::Rgb(rgb)
    }
}

impl From<f32> for Scalar {
    fn from(number: f32) -> Self {
        Self::Number(number)
    }
}

impl Color {
    /// With a factor, but for one of less than a hundredth of a texture, whose file stays as it is.
    fn times(self, factor: f32) -> Self {
        match self {
            Self::Rgb(rgb) => Self::Rgb(factor * rgb),
            Self::Texture(Use { name, change: Change::Nothing }) if (factor - 1.0).abs() >= 0.01 => {
                Self::Texture(Use { name, change: Change::Times(factor) })
            }
            same => same,
        }
    }
}

impl Scalar {
    /// The number after a change.
    fn changed(self, change: Change) -> Self {
        match self {
            Self::Number(number) => Self::Number(change.of(Vec3::splat(number)).x),
            Self::Texture(Use { name, change: Change::Nothing }) => Self::Texture(Use { name, change }),
            Self::Texture(Use { name, change: Change::Squared }) if change == Change::Root => {
                Self::Texture(Use { name, change: Change::Nothing })
            }
            texture @ Self::Texture(_) => texture,
        }
    }

    /// The square root of a GGX width.
    pub(crate) fn root(&self) -> Self {
        self.clone().changed(Change::Root)
    }
}

/// The parameters of a material as they are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Written;

impl Params for Written {
    type Color = Color;
    type Scalar = Scalar;
    type Rgb = Rgb;
    type Material = String;
}

struct ToWritten;

impl MapParams<InFile, Written> for ToWritten {
    fn color(&mut self, color: &ColorValue) -> Color {
        match color {
            ColorValue::Rgb(rgb) => Color::Rgb(*rgb),
            ColorValue::Texture(name) => Color::Texture(Use { name: name.clone(), change: Change::Nothing }),
        }
    }

    fn scalar(&mut self, scalar: &ScalarValue) -> Scalar {
        match scalar {
            ScalarValue::Number(number) => Scalar::Number(*number),
            ScalarValue::Texture(name) => Scalar::Texture(Use { name: name.clone(), change: Change::Nothing }),
        }
    }

    fn material(&mut self, material: &String) -> String {
        material.clone()
    }
}

/// How a surface scatters light.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Bsdf {
    /// None of `principled`, `phong`, `emissive` and `blend`.
    Plain(Material<Written>),
    /// Glass whose transmitted light has a colour at each crossing.
    Tinted(Material<Written>, Color),
    /// With the share of the second.
    Mix(Scalar, Box<Self>, Box<Self>),
    /// Front and back.
    Sides(Box<Self>, Box<Self>),
}

impl Bsdf {
    pub(crate) fn black() -> Self {
        Self::Plain(Material::Diffuse { albedo: Color::Rgb(Vec3::ZERO) })
    }

    pub(crate) fn is_black(&self) -> bool {
        matches!(self, Self::Plain(Material::Diffuse { albedo: Color::Rgb(Vec3::ZERO) }))
    }

    /// Whether no light passes it.
    pub(crate) fn is_opaque(&self) -> bool {
        match self {
            Self::Plain(Material::Disney { transmission, thin_walled, .. }) => {
                !thin_walled && *transmission == Scalar::Number(0.0)
            }
            Self::Plain(
                Material::Glass { .. }
                | Material::ThinGlass { .. }
                | Material::RoughGlass { .. }
                | Material::Translucent { .. },
            )
            | Self::Tinted(..) => false,
            Self::Plain(_) => true,
            Self::Mix(_, a, b) | Self::Sides(a, b) => a.is_opaque() && b.is_opaque(),
        }
    }

    /// Whether it has textures, or highlights with a direction.
    fn is_textured(&self) -> bool {
        let of_material = |material: &Material<Written>| {
            material.is_anisotropic()
                || material.params().into_iter().any(|(_, param)| {
                    matches!(param, Param::Color(Color::Texture(_)) | Param::Scalar(Scalar::Texture(_)))
                })
        };
        match self {
            Self::Plain(material) => of_material(material),
            Self::Tinted(material, tint) => of_material(material) || matches!(tint, Color::Texture(_)),
            Self::Mix(share, a, b) => matches!(share, Scalar::Texture(_)) || a.is_textured() || b.is_textured(),
            Self::Sides(a, b) => a.is_textured() || b.is_textured(),
        }
    }

    fn mix(share: Scalar, a: Self, b: Self) -> Self {
        match share {
            Scalar::Number(share) if share <= 0.0 => a,
            Scalar::Number(share) if share >= 1.0 => b,
            share if a == b => {
                drop(share);
                a
            }
            share => Self::Mix(share, Box::new(a), Box::new(b)),
        }
    }

    /// A share of it, and black for the rest.
    fn dimmed(self, share: f32) -> Self {
        match self {
            Self::Plain(Material::Diffuse { albedo: Color::Rgb(albedo) }) => {
                Self::Plain(Material::Diffuse { albedo: Color::Rgb(share * albedo) })
            }
            other => Self::mix(Scalar::Number(1.0 - share), other, Self::black()),
        }
    }
}

/// The largest value of each channel that a texture shows; vertex colours count as white.
fn largest(texture: &Texture) -> Vec3 {
    match &texture.pattern {
        TexturePattern::White => texture.tint,
        TexturePattern::Checker { a, b } => a.max(*b),
        TexturePattern::Image { image, .. } => {
            let (width, height) = (image.width, image.height);
            let straight = Texture { uv_matrix: Mat2::IDENTITY, uv_offset: Vec2::ZERO, ..texture.clone() };
            let center = |i: u32| Vec2::new((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
            let at = |i| straight.eval(center(i) / Vec2::new(width as f32, height as f32));
            (0..width * height).map(at).fold(Vec3::ZERO, Vec3::max)
        }
    }
}

/// GGX width below which microfacets lose a thousandth.
const LEAST_LOSS: f32 = 0.05;

/// Whether the energy that single scattering loses is returned, which other renderers do not.
pub(crate) fn loses_light(material: &Material<Written>) -> bool {
    let (Material::Conductor { alpha, compensate, .. } | Material::RoughGlass { alpha, compensate, .. }) = material
    else {
        return false;
    };
    *compensate && !matches!(alpha, Scalar::Number(alpha) if *alpha < LEAST_LOSS)
}

/// Normals from an image.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Normals {
    pub map: Use,
    /// Whether the image has heights.
    pub is_relief: bool,
}

/// A material taken apart.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Surface {
    pub bsdf: Bsdf,
    /// What the front emits, W·m⁻²·sr⁻¹.
    pub radiance: Option<Color>,
    /// Whether the back emits as well.
    pub emits_behind: bool,
    /// Coverage; `None`: opaque.
    pub opacity: Option<Scalar>,
    pub normals: Option<Normals>,
    /// Absorption inside, per metre.
    pub absorption: Vec3,
}

impl Surface {
    /// The surface of a material of the scene; grey if there is none of this name.
    ///
    /// - `renderer`: whose materials have to return as much light.
    pub(crate) fn of(scene: &WholeScene, name: &str, renderer: Renderer, warnings: &mut Warnings) -> Self {
        let mut taking = Taking { scene, name, renderer, warnings, absorption: Vec3::ZERO, emits_behind: false };
        let grey = MaterialPart::Diffuse { albedo: ColorValue::grey(0.5) };
        let part = scene.file.materials.get(name).unwrap_or(&grey);
        let (bsdf, radiance) = taking.apart(part, 0);
        let (opacity, normals) = taking.whole(part);
        let (absorption, emits_behind) = (taking.absorption, taking.emits_behind);
        let is_dark = |color: &Color| matches!(color, Color::Rgb(rgb) if *rgb == Vec3::ZERO);
        Self { bsdf, radiance: radiance.filter(|color| !is_dark(color)), emits_behind, opacity, normals, absorption }
    }
}

impl Surface {
    /// Whether texture coordinates matter.
    pub(crate) fn is_textured(&self) -> bool {
        let of_scalar = |scalar: &Scalar| matches!(scalar, Scalar::Texture(_));
        let is_color = |color: &Color| matches!(color, Color::Texture(_));
        self.bsdf.is_textured()
            || self.radiance.as_ref().is_some_and(is_color)
            || self.opacity.as_ref().is_some_and(of_scalar)
            || self.normals.is_some()
    }
}

struct Taking<'a> {
    scene: &'a WholeScene,
    name: &'a str,
    renderer: Renderer,
    warnings: &'a mut Warnings,
    absorption: Vec3,
    emits_behind: bool,
}

impl Taking<'_> {
    fn tell(&mut self, what: &str) {
        self.warnings.push(format!("material `{}`: {what}", printable::name(self.name)));
    }

    /// Holes and normals.
    fn whole(&mut self, part: &MaterialPart) -> (Option<Scalar>, Option<Normals>) {
        let (Material::Principled { opacity, opacity_cutoff, normal_map, normal_scale, .. }
        | Material::Blend { opacity, opacity_cutoff, normal_map, normal_scale, .. }) = part
        else {
            return (None, None);
        };
        let opacity = ToWritten.scalar(opacity);
        let opacity = opacity_cutoff.map_or(opacity.clone(), |least| opacity.changed(Change::From(least)));
        let normals = match ToWritten.color(normal_map) {
            Color::Rgb(_) => None,
            Color::Texture(map) => {
                let is_relief = self.scene.textures.get(&map.name).is_some_and(|map| map.texture.relief.is_some());
                let change =
                    if *normal_scale == 1.0 { Change::Nothing } else { Change::Slope(Vec2::splat(*normal_scale)) };
                let heights = Change::Times(*normal_scale);
                let change = if is_relief && change != Change::Nothing { heights } else { change };
                Some(Normals { map: Use { change, ..map }, is_relief })
            }
        };
        (Some(opacity).filter(|opacity| *opacity != Scalar::Number(1.0)), normals)
    }

    fn apart(&mut self, part: &MaterialPart, depth: u32) -> (Bsdf, Option<Color>) {
        let written = part.map(&mut ToWritten);
        let plain = |bsdf| (bsdf, None);
        match written {
            Material::Emissive { radiance } => (Bsdf::black(), Some(radiance)),
            Material::Blend { weight, a, b, by_side, .. } => self.blend(weight, [&a, &b], by_side, depth),
            Material::Phong { diffuse, specular, transparency, ior, absorption, .. } => {
                self.absorb(absorption, 0.0);
                let mirror = Bsdf::Plain(Material::Mirror { reflectance: Color::Rgb(Vec3::ONE) });
                let glass = Material::Glass { ior, absorption, dispersion: 0.0 };
                let opaque = Bsdf::mix(specular, Bsdf::Plain(Material::Diffuse { albedo: diffuse }), mirror);
                plain(Bsdf::mix(Scalar::Number(transparency), opaque, Bsdf::Plain(glass)))
            }
            Material::Principled { .. } => self.principled(written),
            Material::Metal { alpha, reflectance, fresnel, compensate: true } => {
                plain(self.compensated(alpha, reflectance, fresnel))
            }
            Material::Translucent { reflectance, transmittance } => plain(self.translucent(reflectance, transmittance)),
            Material::Disney { .. } if self.renderer != Renderer::Mitsuba => self.disney(written),
            Material::Glass { absorption, dispersion, .. } | Material::RoughGlass { absorption, dispersion, .. } => {
                self.absorb(absorption, dispersion);
                plain(Bsdf::Plain(written))
            }
            other => plain(Bsdf::Plain(other)),
        }
    }

    /// Its mean, if it is a texture.
    fn width(&self, alpha: &Scalar) -> f32 {
        match alpha {
            Scalar::Number(alpha) => *alpha,
            Scalar::Texture(Use { name, change }) => change.of(self.scene.textures[name].texture.mean()).x,
        }
    }

    fn largest(&self, color: &Color) -> Vec3 {
        match color {
            Color::Rgb(rgb) => *rgb,
            Color::Texture(Use { name, .. }) => largest(&self.scene.textures[name].texture),
        }
    }

    /// Here, both are scaled where their sum is above 1; elsewhere they are not.
    fn translucent(&mut self, reflectance: Color, transmittance: Color) -> Bsdf {
        let sum = self.largest(&reflectance) + self.largest(&transmittance);
        let (reflectance, transmittance) = match (reflectance, transmittance) {
            (Color::Rgb(back), Color::Rgb(through)) => {
                let most = sum.max(Vec3::ONE);
                (Color::Rgb(back / most), Color::Rgb(through / most))
            }
            textured => {
                if sum.max_element() > 1.0 {
                    self.tell("where its reflectance and transmittance exceed 1 together, it is brighter");
                }
                textured
            }
        };
        Bsdf::Plain(Material::Translucent { reflectance, transmittance })
    }

    /// A metal without compensation that returns as much light as one with it.
    fn compensated(&mut self, alpha: Scalar, reflectance: Color, fresnel: Fresnel) -> Bsdf {
        let width = self.width(&alpha);
        // Conductors of pbrt reflect more at grazing angles, however smooth they are.
        if width < LEAST_LOSS && self.renderer == Renderer::Mitsuba {
            return Bsdf::Plain(Material::Metal { alpha, reflectance, fresnel, compensate: false });
        }
        let reflectance = match reflectance {
            Color::Rgb(color) => {
                let brighter = self.renderer.metal(width, fresnel, color);
                if width >= LEAST_LOSS && brighter.max_element() >= self.renderer.most_of_metal() {
                    self.tell("the light that its microfacets scatter several times is lost in part");
                }
                Color::Rgb(brighter)
            }
            Color::Texture(Use { name, change }) => {
                let mean = Vec3::splat(change.of(self.scene.textures[&name].texture.mean()).element_sum() / 3.0);
                let factor = if mean.x > 0.0 { self.renderer.metal(width, fresnel, mean).x / mean.x } else { 1.0 };
                Color::Texture(Use { name, change }).times(factor)
            }
        };
        Bsdf::Plain(Material::Metal { alpha, reflectance, fresnel, compensate: false })
    }

    /// The diffuse base of `principled` below its dielectric surface.
    ///
    /// - `ior`: of a coat that reflects `facing` at normal incidence.
    fn base(&mut self, alpha: Scalar, albedo: Color, ior: f32, [facing, grazing]: [f32; 2]) -> Bsdf {
        if (ior - 1.0).abs() < 1e-4 {
            return Bsdf::Plain(Material::Diffuse { albedo });
        }
        let width = self.width(&alpha);
        let coated = |diffuse: Color, alpha: Scalar| {
            let specular = 1.0.into();
            Bsdf::Plain(Material::Plastic { diffuse, alpha, ior, specular, nonlinear: false, beckmann: false })
        };
        if width < SMOOTH {
            return coated(albedo, alpha);
        }
        let base = Base::new(self.renderer, width, facing, grazing);
        if width <= GLOSSY {
            match &albedo {
                Color::Rgb(rgb) => {
                    let diffuse = base.below_coat(ior, *rgb);
                    if diffuse.max_element() <= 1.0 {
                        return coated(diffuse.into(), alpha);
                    }
                }
                // Texels may be above 1 there.
                Color::Texture(_) if self.renderer == Renderer::Mitsuba => {
                    let factor = 2.0 * base.below_coat(ior, Vec3::splat(0.5)).x;
                    return coated(albedo.times(factor), alpha);
                }
                Color::Texture(_) => {}
            }
        }
        if width <= LOSSLESS {
            return coated(albedo, alpha);
        }
        let most = self.largest(&albedo).max_element();
        let Metallic { share, metal, diffuse } = base.metallic(most.clamp(0.0, 1.0));
        let (reflectance, compensate) = (Vec3::splat(metal).into(), false);
        let metal = Material::Metal { alpha, reflectance, fresnel: Fresnel::Schlick, compensate };
        let diffuse = Material::Diffuse { albedo: albedo.times(diffuse) };
        Bsdf::mix(Scalar::Number(share), Bsdf::Plain(diffuse), Bsdf::Plain(metal))
    }

    fn absorb(&mut self, Rgb(absorption): Rgb, dispersion: f32) {
        self.absorption = self.absorption.max(absorption);
        if dispersion != 0.0 {
            self.tell("dispersion is left out");
        }
    }

    fn blend(&mut self, weight: Scalar, parts: [&str; 2], by_side: bool, depth: u32) -> (Bsdf, Option<Color>) {
        let [(a, light_a), (b, light_b)] = parts.map(|name| match self.scene.file.materials.get(name) {
            Some(part) if depth < MAX_DEPTH => self.apart(part, depth + 1),
            _ => (Bsdf::black(), None),
        });
        if by_side {
            return (Bsdf::Sides(Box::new(a), Box::new(b)), light_a);
        }
        let share = match weight {
            Scalar::Number(share) => share.clamp(0.0, 1.0),
            Scalar::Texture(_) => return (Bsdf::mix(weight, a, b), None),
        };
        // A part that only emits darkens the other one by its share.
        let radiance = match (light_a, light_b) {
            (Some(light), _) => Some((light, 1.0 - share)),
            (None, Some(light)) => Some((light, share)),
            (None, None) => None,
        };
        let radiance = radiance.map(|(light, share)| match light {
            Color::Rgb(rgb) => Color::Rgb(share * rgb),
            Color::Texture(Use { name, .. }) => Color::Texture(Use { name, change: Change::Times(share) }),
        });
        let bsdf = match (a.is_black(), b.is_black()) {
            (true, _) => b.dimmed(share),
            (_, true) => a.dimmed(1.0 - share),
            _ => Bsdf::mix(Scalar::Number(share), a, b),
        };
        (bsdf, radiance)
    }

    /// The principled material that is closest.
    fn disney(&mut self, material: Material<Written>) -> (Bsdf, Option<Color>) {
        let Material::Disney {
            base_color,
            metallic,
            roughness,
            ior,
            transmission,
            thin_walled,
            diffuse_transmission,
            sheen,
            clearcoat,
            anisotropic,
            ..
        } = material
        else {
            unreachable!("it is of Disney")
        };
        self.tell("the brighter rim, hues of reflections and flatness of Disney's model are left out");
        if thin_walled && diffuse_transmission != Scalar::Number(0.0) {
            self.tell("it transmits no diffuse light");
        }
        let (of_sheen, of_coat, of_highlights) = (sheen, clearcoat, anisotropic);
        let mut closest = Material::<Written>::principled(base_color);
        if let Material::Principled {
            metallic: a,
            roughness: b,
            ior: c,
            transmission: d,
            thin_walled: e,
            sheen_color,
            clearcoat,
            anisotropy,
            ..
        } = &mut closest
        {
            (*a, *b, *c, *d, *e) = (metallic, roughness, ior, transmission, thin_walled);
            (*clearcoat, *anisotropy) = (of_coat, of_highlights);
            if of_sheen != Scalar::Number(0.0) {
                *sheen_color = Color::Rgb(Vec3::ONE);
            }
        }
        self.principled(closest)
    }

    fn principled(&mut self, material: Material<Written>) -> (Bsdf, Option<Color>) {
        let Material::Principled {
            base_color,
            metallic,
            roughness,
            ior,
            specular,
            specular_color,
            transmission,
            thin_walled,
            absorption,
            dispersion,
            anisotropy,
            sheen_color,
            clearcoat,
            iridescence,
            emission,
            two_sided,
            ..
        } = material
        else {
            unreachable!("it is principled")
        };
        let zero = Scalar::Number(0.0);
        for (is_given, what) in [
            (clearcoat != zero, "its clear coat is left out"),
            (sheen_color != Color::Rgb(Vec3::ZERO), "its sheen is left out"),
            (iridescence != zero, "its iridescence is left out"),
            (anisotropy != zero, "its long highlights become round"),
            (!two_sided, "its back is visible"),
        ] {
            if is_given {
                self.tell(what);
            }
        }
        let alpha = roughness.changed(Change::Squared);
        // The index of a dielectric that reflects as much at normal incidence.
        let normal = ((ior - 1.0) / (ior + 1.0)).powi(2);
        let factor = match (&specular, &specular_color) {
            (Scalar::Number(share), Color::Rgb(color)) => {
                if color.x != color.y || color.y != color.z {
                    self.tell("the colour of its reflection becomes white");
                }
                share * (color.x + color.y + color.z) / 3.0
            }
            _ => {
                self.tell("the texture of the strength of its reflection is left out");
                1.0
            }
        };
        let root = (normal * factor).clamp(0.0, 0.98).sqrt();
        let coat = if factor == 1.0 { ior } else { (1.0 + root) / (1.0 - root) };
        let grazing = if let Scalar::Number(share) = specular { share } else { 1.0 };
        let full = Scalar::Number(1.0);
        // What nothing is seen of needs no words.
        let metal = if metallic == zero {
            Bsdf::black()
        } else {
            self.compensated(alpha.clone(), base_color.clone(), Fresnel::Schlick)
        };
        let opaque = if metallic == full || transmission == full {
            Bsdf::black()
        } else {
            self.base(alpha.clone(), base_color.clone(), coat, [root * root, grazing])
        };
        let glass = match (thin_walled, &alpha) {
            (true, alpha) => {
                if *alpha != zero {
                    self.tell("its rough pane becomes a clear one");
                }
                Bsdf::Plain(Material::ThinGlass { ior, reflectance: Vec3::ONE.into(), transmittance: base_color })
            }
            (false, Scalar::Number(alpha)) if *alpha < 1e-4 => {
                Bsdf::Tinted(Material::Glass { ior, absorption, dispersion }, base_color)
            }
            (false, alpha) => {
                let alpha = alpha.clone();
                let rough =
                    Material::RoughGlass { alpha, ior, absorption, dispersion, compensate: true, beckmann: false };
                Bsdf::Tinted(rough, base_color)
            }
        };
        if transmission != zero && metallic != Scalar::Number(1.0) && !thin_walled {
            self.absorb(absorption, dispersion);
        }
        self.emits_behind |= two_sided && emission != Color::Rgb(Vec3::ZERO);
        (Bsdf::mix(metallic, Bsdf::mix(transmission, opaque, glass), metal), Some(emission))
    }
}
