//! The types of a material's parameters: in a snapshot, and by reference in any scene.

use crate::core::fresnel::Fresnel;
use crate::core::property::Value;
use crate::core::texture::TextureId;
use glam::Vec3;
use std::fmt::Debug;

/// Index into the materials of a snapshot.
pub type MaterialId = u32;

/// Types of a material's parameters and references.
pub trait Params {
    /// A colour, linear Rec. 709, constant or textured.
    type Color: Clone + Debug + PartialEq + From<Vec3>;
    /// A dimensionless number, constant or textured.
    type Scalar: Clone + Debug + PartialEq + From<f32>;
    /// A constant colour.
    type Rgb: Copy + Debug + Default + PartialEq + From<Vec3> + Into<Vec3>;
    /// Another material.
    type Material: Clone + Debug + PartialEq;
}

/// Parameters of a snapshot: references by index into its tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InSnapshot;

impl Params for InSnapshot {
    type Color = ColorInput;
    type Scalar = ScalarInput;
    type Rgb = Vec3;
    type Material = MaterialId;
}

/// A colour, linear Rec. 709, constant or textured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ColorInput {
    /// A constant colour.
    Constant(Vec3),
    /// The colour of a texture at the surface point.
    Texture(TextureId),
}

/// A dimensionless number, constant or the red channel of a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ScalarInput {
    /// A constant number.
    Constant(f32),
    /// The red channel of a texture at the surface point.
    Texture(TextureId),
}

impl From<Vec3> for ColorInput {
    fn from(rgb: Vec3) -> Self {
        Self::Constant(rgb)
    }
}

impl From<f32> for ScalarInput {
    fn from(value: f32) -> Self {
        Self::Constant(value)
    }
}

/// A parameter of a material, by the type of its value.
#[derive(Clone, Copy, Debug)]
pub enum Param<Color, Scalar, Number, Flag, Cutoff, Rgb, Word, Part> {
    /// A colour, possibly textured.
    Color(Color),
    /// A number, possibly textured.
    Scalar(Scalar),
    /// A constant number.
    Number(Number),
    /// On or off.
    Flag(Flag),
    /// A constant number, or none.
    Cutoff(Cutoff),
    /// A constant colour.
    Rgb(Rgb),
    /// Angular dependence of a metal's reflectance.
    Fresnel(Word),
    /// Another material, as a part of a blend.
    Part(Part),
}

/// A parameter by reference.
pub type ParamRef<'a, P> = Param<
    &'a <P as Params>::Color,
    &'a <P as Params>::Scalar,
    &'a f32,
    &'a bool,
    &'a Option<f32>,
    &'a <P as Params>::Rgb,
    &'a Fresnel,
    &'a <P as Params>::Material,
>;

/// A parameter by mutable reference.
pub type ParamMut<'a, P> = Param<
    &'a mut <P as Params>::Color,
    &'a mut <P as Params>::Scalar,
    &'a mut f32,
    &'a mut bool,
    &'a mut Option<f32>,
    &'a mut <P as Params>::Rgb,
    &'a mut Fresnel,
    &'a mut <P as Params>::Material,
>;

/// Whether a parameter has this value; a texture has none.
pub(super) fn has_value<P: Params>(param: &ParamRef<'_, P>, value: Value) -> bool {
    match (param, value) {
        (Param::Color(color), Value::Color(rgb)) => **color == P::Color::from(rgb),
        (Param::Scalar(scalar), Value::Number(number)) => **scalar == P::Scalar::from(number),
        (Param::Number(old), Value::Number(number)) => **old == number,
        (Param::Flag(old), Value::Flag(flag)) => **old == flag,
        (Param::Cutoff(cutoff), Value::Nothing) => cutoff.is_none(),
        (Param::Rgb(old), Value::Color(rgb)) => **old == P::Rgb::from(rgb),
        (Param::Fresnel(old), Value::Fresnel(fresnel)) => **old == fresnel,
        _ => false,
    }
}

/// Conversion of a material's references; see [`Material::map`](crate::core::material::Material::map).
pub trait MapParams<From: Params, To: Params> {
    /// Converts a colour.
    fn color(&mut self, color: &From::Color) -> To::Color;
    /// Converts a number.
    fn scalar(&mut self, scalar: &From::Scalar) -> To::Scalar;
    /// Converts a reference to another material.
    fn material(&mut self, material: &From::Material) -> To::Material;
}
