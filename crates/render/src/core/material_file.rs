//! Materials in files: the kind, and the parameters by name. What has its default is left out.

use crate::core::fresnel::Fresnel;
use crate::core::material::{Material, MaterialKind};
use crate::core::material_params::{Param, Params};
use crate::core::property::Property;
use glam::Vec3;
use serde::de::{Deserialize, DeserializeSeed, Deserializer, EnumAccess, Error, MapAccess, VariantAccess, Visitor};
use serde::ser::{Serialize, SerializeStructVariant, Serializer};
use std::fmt;
use std::marker::PhantomData;

impl<P: Params> Serialize for Material<P>
where
    P::Color: Serialize,
    P::Scalar: Serialize,
    P::Rgb: Serialize,
    P::Material: Serialize,
{
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let kind = self.kind();
        let params = self.given();
        let mut fields = serializer.serialize_struct_variant("Material", kind as u32, kind.name(), params.len())?;
        for (Property { name, .. }, param) in params {
            match param {
                Param::Color(value) => fields.serialize_field(name, value),
                Param::Scalar(value) => fields.serialize_field(name, value),
                Param::Number(value) => fields.serialize_field(name, value),
                Param::Flag(value) => fields.serialize_field(name, value),
                Param::Cutoff(value) => fields.serialize_field(name, value),
                Param::Rgb(value) => fields.serialize_field(name, value),
                Param::Fresnel(value) => fields.serialize_field(name, value),
                Param::Part(value) => fields.serialize_field(name, value),
            }?;
        }
        fields.end()
    }
}

/// What materials in files consist of.
pub trait FileParams<'de>:
    Params<Color: Deserialize<'de>, Scalar: Deserialize<'de>, Rgb: Deserialize<'de>, Material: Deserialize<'de> + Default>
{
}

impl<'de, P> FileParams<'de> for P where
    P: Params<
            Color: Deserialize<'de>,
            Scalar: Deserialize<'de>,
            Rgb: Deserialize<'de>,
            Material: Deserialize<'de> + Default,
        >
{
}

impl<'de, P: FileParams<'de>> Deserialize<'de> for Material<P> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_enum("Material", MaterialKind::NAMES, OfAnyKind(PhantomData))
    }
}

struct OfAnyKind<P>(PhantomData<P>);

impl<'de, P: FileParams<'de>> Visitor<'de> for OfAnyKind<P> {
    type Value = Material<P>;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a material with its kind")
    }

    fn visit_enum<A: EnumAccess<'de>>(self, data: A) -> Result<Material<P>, A::Error> {
        let (kind, fields) = data.variant::<MaterialKind>()?;
        fields.struct_variant(kind.property_names(), OfKind(kind, PhantomData))
    }
}

struct OfKind<P>(MaterialKind, PhantomData<P>);

impl<'de, P: FileParams<'de>> Visitor<'de> for OfKind<P> {
    type Value = Material<P>;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "the fields of `{}`", self.0.name())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Material<P>, A::Error> {
        let properties = self.0.properties();
        let mut given = vec![false; properties.len()];
        let mut material = Material::initial(self.0, &Vec3::ZERO.into(), P::Material::default);
        while let Some(i) = map.next_key_seed(Field(self.0))? {
            if std::mem::replace(&mut given[i], true) {
                return Err(A::Error::duplicate_field(properties[i].name));
            }
            match material.params_mut().swap_remove(i).1 {
                Param::Color(value) => *value = map.next_value()?,
                Param::Scalar(value) => *value = map.next_value()?,
                Param::Number(value) => *value = map.next_value()?,
                Param::Flag(value) => *value = map.next_value()?,
                Param::Cutoff(value) => *value = map.next_value()?,
                Param::Rgb(value) => *value = map.next_value()?,
                Param::Fresnel(value) => *value = map.next_value::<Fresnel>()?,
                Param::Part(value) => *value = map.next_value()?,
            }
        }
        let missing = properties.iter().zip(given).find(|(property, given)| property.default.is_none() && !given);
        missing.map_or(Ok(material), |(property, _)| Err(A::Error::missing_field(property.name)))
    }
}

/// Reads the name of a field as its index.
struct Field(MaterialKind);

impl<'de> DeserializeSeed<'de> for Field {
    type Value = usize;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<usize, D::Error> {
        deserializer.deserialize_identifier(self)
    }
}

impl Visitor<'_> for Field {
    type Value = usize;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "a field of `{}`", self.0.name())
    }

    fn visit_str<E: Error>(self, name: &str) -> Result<usize, E> {
        let names = self.0.property_names();
        names.iter().position(|known| *known == name).ok_or_else(|| E::unknown_field(name, names))
    }
}
