//! One property of a material, by name.
//!
//! Names, limits and meanings are those of the table of materials, [`MaterialKind::properties`].

use crate::bad_value::BadValue;
use crate::bounds::number;
use crate::numbers::short;
use crate::quantity::Quantity;
use firstlight_render::{Domain, Fresnel, MaterialKind, Param, Params, Property, ValueType};
use glam::{DVec3, Vec3};
use serde::de::{EnumAccess, Error, VariantAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;
use std::sync::LazyLock;

/// A number, colour or choice of a material. A name means the same for all kinds of materials.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MaterialProperty(&'static str);

/// The names of all properties that can be set.
static NAMES: LazyLock<Vec<&'static str>> = LazyLock::new(|| {
    let all = MaterialKind::ALL.iter().flat_map(|kind| kind.properties());
    let mut names: Vec<_> = all.filter(|property| can_be_set(property)).map(|property| property.name).collect();
    names.sort_unstable();
    names.dedup();
    names
});

/// Whether its value consists of numbers, which are not data of an image.
fn can_be_set(property: &Property) -> bool {
    !matches!(property.domain, Domain::Map | Domain::Reference)
}

/// Checks a number, or the channels of a colour.
///
/// # Errors
/// If it is not among the values that the property may have.
pub fn check_value(property: &Property, channels: &[f32]) -> Result<(), BadValue> {
    let limits = property.domain.limits();
    if channels.iter().all(|channel| limits.contains(channel)) {
        return Ok(());
    }
    let value = match channels {
        [one] => number(short(*one)),
        channels => {
            format!("({})", channels.iter().map(|&channel| number(short(channel))).collect::<Vec<_>>().join(", "))
        }
    };
    Err(BadValue::out_of_range(property.name, value, property.domain.rule()))
}

impl MaterialProperty {
    /// The property of this name in scene files; `None` if no material has it, or if it is a map or a part.
    pub fn named(name: &str) -> Option<Self> {
        NAMES.binary_search(&name).ok().map(|i| Self(NAMES[i]))
    }

    /// The main colour of materials of a kind; `None` if they have none.
    pub fn main_color(kind: MaterialKind) -> Option<Self> {
        kind.main_property().map(Self)
    }

    /// The properties of a material that can be set.
    pub fn of<P: Params>(material: &firstlight_render::Material<P>) -> impl Iterator<Item = Self> + use<P> {
        material.kind().properties().iter().filter(|property| can_be_set(property)).map(|property| Self(property.name))
    }

    /// The properties of a material that may change in time.
    pub fn animatable<P: Params>(material: &firstlight_render::Material<P>) -> impl Iterator<Item = Self> + use<P> {
        Self::of(material).filter(|property| property.description().domain.is_animatable())
    }

    /// Name in scene files.
    pub fn name(self) -> &'static str {
        self.0
    }

    /// The type of its values in time.
    pub fn quantity(self) -> Quantity {
        match self.description().value {
            ValueType::Color | ValueType::Rgb => Quantity::Color,
            _ => Quantity::Number,
        }
    }

    /// Its description for the first kind that has it; type and domain are the same for all.
    pub fn description(self) -> &'static Property {
        let mut all = MaterialKind::ALL.iter().flat_map(|kind| kind.properties());
        all.find(|property| property.name == self.0).expect("it is in the table")
    }

    /// Sets the value, within the limits of its domain; a cutoff beyond them is none, and a choice is the second one
    /// if the number is not 0. `None` if materials of this kind do not have the property.
    pub fn set<P: Params>(self, material: &mut firstlight_render::Material<P>, value: DVec3) -> Option<()> {
        let (property, param) = material.params_mut().into_iter().find(|(property, _)| property.name == self.0)?;
        let (least, most) = property.domain.limits().into_inner();
        let number = value.x as f32;
        let (share, color) = (number.clamp(least, most), value.as_vec3().clamp(Vec3::splat(least), Vec3::splat(most)));
        match param {
            Param::Color(old) if can_be_set(property) => *old = color.into(),
            Param::Rgb(old) => *old = color.into(),
            Param::Scalar(old) => *old = share.into(),
            Param::Number(old) => *old = share,
            Param::Cutoff(old) => *old = property.domain.limits().contains(&number).then_some(number),
            Param::Flag(old) => *old = number != 0.0,
            Param::Fresnel(old) => *old = if number == 0.0 { Fresnel::Constant } else { Fresnel::Schlick },
            Param::Color(_) | Param::Part(_) => return None,
        }
        Some(())
    }
}

impl Serialize for MaterialProperty {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_unit_variant("MaterialProperty", 0, self.0)
    }
}

impl<'de> Deserialize<'de> for MaterialProperty {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_enum("MaterialProperty", &NAMES, Name)
    }
}

/// Reads the name, a word without quotes.
struct Name;

impl<'de> Visitor<'de> for Name {
    type Value = MaterialProperty;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("the name of a material's property")
    }

    fn visit_enum<A: EnumAccess<'de>>(self, data: A) -> Result<MaterialProperty, A::Error> {
        let (property, rest) = data.variant_seed(self)?;
        rest.unit_variant()?;
        Ok(property)
    }

    fn visit_str<E: Error>(self, name: &str) -> Result<MaterialProperty, E> {
        MaterialProperty::named(name).ok_or_else(|| E::unknown_variant(name, &NAMES))
    }
}

impl<'de> serde::de::DeserializeSeed<'de> for Name {
    type Value = MaterialProperty;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<MaterialProperty, D::Error> {
        deserializer.deserialize_identifier(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_means_the_same_for_all_kinds() {
        let all = || MaterialKind::ALL.iter().flat_map(|kind| kind.properties());
        for property in all() {
            for other in all().filter(|other| other.name == property.name) {
                assert_eq!(property.domain, other.domain, "{}", property.name);
                let is_color = |property: &Property| matches!(property.value, ValueType::Color | ValueType::Rgb);
                assert_eq!(is_color(property), is_color(other), "{}", property.name);
            }
        }
    }
}
