//! The description of a property of a scene: its name, its values and its meaning, for everything that reads, checks,
//! writes, animates, shows or documents it.

use crate::core::fresnel::Fresnel;
use glam::Vec3;
use std::ops::RangeInclusive;

/// One property, as in the table of its owner; see [`MaterialKind::properties`](crate::core::material::MaterialKind::properties).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Property {
    /// Name in scene files.
    pub name: &'static str,
    /// The type of its value.
    pub value: ValueType,
    /// The values that it may have.
    pub domain: Domain,
    /// The value where a scene file has none; `None` if there must be one.
    pub default: Option<Value>,
    /// Name in the window.
    pub label: &'static str,
    /// What it means, a phrase.
    pub help: &'static str,
}

/// The type of a property's value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ValueType {
    /// A colour, possibly textured.
    Color,
    /// A number, possibly textured.
    Scalar,
    /// A constant number.
    Number,
    /// On or off.
    Flag,
    /// A constant number, or none.
    Cutoff,
    /// A constant colour.
    Rgb,
    /// A word: the angular dependence of a metal's reflectance.
    Fresnel,
    /// The name of something else.
    Part,
}

/// A value of a property that is no reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// A number, or an index of refraction and the like.
    Number(f32),
    /// A colour, linear Rec. 709.
    Color(Vec3),
    /// On or off.
    Flag(bool),
    /// Angular dependence of a metal's reflectance.
    Fresnel(Fresnel),
    /// No value.
    Nothing,
}

/// A set of values: their limits, their unit, and how far sliders reach.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Domain {
    /// A share of light per channel, 0..1.
    Reflectance,
    /// A share, 0..1.
    Share,
    /// The width of a GGX lobe, 0..1. People choose its square root, the roughness of other programs.
    Width,
    /// A factor or a strength, 0 or more.
    Factor,
    /// Radiance, W·sr⁻¹·m⁻², 0 or more.
    Radiance,
    /// Absorption, per metre, 0 or more.
    Absorption,
    /// Index of refraction, above 0.
    Ior,
    /// 20 divided by the Abbe number, 0 or more.
    Dispersion,
    /// Exponent of a highlight, 0 or more.
    Exponent,
    /// Nanometres, 0 or more.
    Nanometres,
    /// An angle of any size, degrees.
    Degrees,
    /// Any finite factor.
    Scale,
    /// Data in the channels of an image, 0..1, which is neither edited nor animated as a colour.
    Map,
    /// On or off, or one of a few words.
    Choice,
    /// The name of something else.
    Reference,
}

impl Domain {
    /// The finite values that it has, per channel.
    pub fn limits(self) -> RangeInclusive<f32> {
        match self {
            Self::Reflectance | Self::Share | Self::Width | Self::Map | Self::Choice | Self::Reference => 0.0..=1.0,
            Self::Ior => f32::MIN_POSITIVE..=f32::MAX,
            Self::Factor | Self::Radiance | Self::Absorption | Self::Dispersion | Self::Exponent | Self::Nanometres => {
                0.0..=f32::MAX
            }
            Self::Degrees | Self::Scale => f32::MIN..=f32::MAX,
        }
    }

    /// The rule for its values, as the end of a sentence that begins with "must".
    pub fn rule(self) -> &'static str {
        match self {
            Self::Reflectance => "lie between 0 and 1: it is a share of light",
            Self::Share | Self::Width | Self::Map => "lie between 0 and 1",
            Self::Factor | Self::Radiance | Self::Absorption | Self::Nanometres => "be finite and not negative",
            Self::Ior => "be finite and positive: 1.5 is glass",
            Self::Dispersion => "be finite and not negative: 20 / Abbe number",
            Self::Exponent => "be finite and not negative: 20 is dull, 200 sharp",
            Self::Degrees | Self::Scale => "be finite",
            Self::Choice | Self::Reference => "be one of the known words",
        }
    }

    /// The range of a slider, in the unit that it shows, within which the window sets it. `None` for what is no number.
    pub fn slider(self) -> Option<RangeInclusive<f64>> {
        match self {
            Self::Share => Some(0.0..=1.0),
            Self::Width => Some(0.032..=1.0),
            Self::Factor | Self::Dispersion => Some(0.0..=10.0),
            Self::Ior => Some(1.0..=2.5),
            Self::Exponent => Some(1.0..=10_000.0),
            Self::Nanometres => Some(0.0..=1500.0),
            Self::Degrees => Some(-180.0..=180.0),
            Self::Scale => Some(-2.0..=2.0),
            Self::Reflectance | Self::Radiance | Self::Absorption | Self::Map | Self::Choice | Self::Reference => None,
        }
    }

    /// Whether sliders are logarithmic.
    pub fn is_logarithmic(self) -> bool {
        matches!(self, Self::Exponent)
    }

    /// Whether its values may change gradually in time.
    pub fn is_animatable(self) -> bool {
        !matches!(self, Self::Map | Self::Choice | Self::Reference)
    }
}
