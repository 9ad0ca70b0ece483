//! Values of a scene file with more than one notation.

use firstlight_render::decode_srgb;
use glam::Vec3;
use indexmap::IndexMap;
use indexmap::map::Entry;
use serde::de::{Error, MapAccess, SeqAccess, Visitor};
use serde::ser::{SerializeMap, SerializeTuple};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;
use std::marker::PhantomData;

/// A colour, linear Rec. 709: `0.5` for grey, `(0.8, 0.2, 0.1)`, `"#ccbbaa"` in sRGB, or the name of a texture.
#[derive(Clone, Debug, PartialEq)]
pub enum ColorValue {
    /// A colour, linear Rec. 709.
    Rgb(Vec3),
    /// A texture, by name.
    Texture(String),
}

/// A number, or the name of a texture whose red channel is used.
#[derive(Clone, Debug, PartialEq)]
pub enum ScalarValue {
    /// The same number everywhere.
    Number(f32),
    /// A texture, by name.
    Texture(String),
}

/// A colour that cannot be a texture: `0.5`, `(0.8, 0.2, 0.1)` or `"#ccbbaa"`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rgb(pub Vec3);

impl ColorValue {
    /// The same value in all three channels.
    pub const fn grey(value: f32) -> Self {
        Self::Rgb(Vec3::splat(value))
    }

    /// A colour from its channels, linear Rec. 709.
    pub const fn rgb(r: f32, g: f32, b: f32) -> Self {
        Self::Rgb(Vec3::new(r, g, b))
    }
}

impl From<Vec3> for ColorValue {
    fn from(rgb: Vec3) -> Self {
        Self::Rgb(rgb)
    }
}

impl From<f32> for ScalarValue {
    fn from(number: f32) -> Self {
        Self::Number(number)
    }
}

impl From<Vec3> for Rgb {
    fn from(rgb: Vec3) -> Self {
        Self(rgb)
    }
}

impl From<Rgb> for Vec3 {
    fn from(Rgb(rgb): Rgb) -> Self {
        rgb
    }
}

/// Deserialises any value, of which the types below accept some kinds.
struct AnyValue {
    textures: bool,
    colours: bool,
}

/// As `f32`. A finite value beyond its range is an error instead of infinity.
fn narrow<E: Error>(value: f64) -> Result<f32, E> {
    let narrow = value as f32;
    if value.is_finite() && narrow.is_infinite() {
        return Err(E::custom(format!("{value:e} is too large: the maximum is {:e}", f32::MAX)));
    }
    Ok(narrow)
}

/// The colour that `#rgb` or `#rrggbb` is in sRGB, as linear Rec. 709; `None` for any other text.
pub fn hex_color(text: &str) -> Option<Vec3> {
    let digits = text.strip_prefix('#').filter(|digits| digits.bytes().all(|byte| byte.is_ascii_hexdigit()))?;
    let channel = |i: usize| {
        let byte = match digits.len() {
            3 => u8::from_str_radix(&digits[i..=i], 16).ok()? * 0x11,
            6 => u8::from_str_radix(&digits[2 * i..2 * i + 2], 16).ok()?,
            _ => return None,
        };
        Some(decode_srgb(f64::from(byte) / 255.0) as f32)
    };
    Some(Vec3::new(channel(0)?, channel(1)?, channel(2)?))
}

enum FoundValue {
    Number(f32),
    Rgb(Vec3),
    Name(String),
}

impl<'de> Visitor<'de> for AnyValue {
    type Value = FoundValue;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match (self.colours, self.textures) {
            (true, true) => "a colour: a number, (red, green, blue), \"#rrggbb\" or the \"name\" of a texture",
            (true, false) => "a colour: a number, (red, green, blue) or \"#rrggbb\"",
            (false, _) => "a number or the \"name\" of a texture",
        })
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<FoundValue, E> {
        narrow(value).map(FoundValue::Number)
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<FoundValue, E> {
        Ok(FoundValue::Number(value as f32))
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<FoundValue, E> {
        Ok(FoundValue::Number(value as f32))
    }

    fn visit_str<E: Error>(self, value: &str) -> Result<FoundValue, E> {
        if let Some(color) = hex_color(value).filter(|_| self.colours) {
            Ok(FoundValue::Rgb(color))
        } else if self.textures {
            Ok(FoundValue::Name(value.to_owned()))
        } else {
            Err(E::invalid_type(serde::de::Unexpected::Str(value), &self))
        }
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<FoundValue, A::Error> {
        if !self.colours {
            return Err(A::Error::invalid_type(serde::de::Unexpected::Seq, &self));
        }
        let mut rgb = [0.0; 3];
        for (i, channel) in rgb.iter_mut().enumerate() {
            *channel = narrow(seq.next_element()?.ok_or_else(|| A::Error::invalid_length(i, &self))?)?;
        }
        if seq.next_element::<f32>()?.is_some() {
            return Err(A::Error::invalid_length(4, &self));
        }
        Ok(FoundValue::Rgb(Vec3::from_array(rgb)))
    }
}

impl<'de> Deserialize<'de> for ColorValue {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Ok(match deserializer.deserialize_any(AnyValue { textures: true, colours: true })? {
            FoundValue::Number(value) => Self::grey(value),
            FoundValue::Rgb(rgb) => Self::Rgb(rgb),
            FoundValue::Name(name) => Self::Texture(name),
        })
    }
}

impl<'de> Deserialize<'de> for ScalarValue {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Ok(match deserializer.deserialize_any(AnyValue { textures: true, colours: false })? {
            FoundValue::Name(name) => Self::Texture(name),
            FoundValue::Number(value) | FoundValue::Rgb(Vec3 { x: value, .. }) => Self::Number(value),
        })
    }
}

impl<'de> Deserialize<'de> for Rgb {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        match deserializer.deserialize_any(AnyValue { textures: false, colours: true })? {
            FoundValue::Number(value) => Ok(Self(Vec3::splat(value))),
            FoundValue::Rgb(rgb) => Ok(Self(rgb)),
            FoundValue::Name(name) => {
                Err(D::Error::invalid_type(serde::de::Unexpected::Str(&name), &"a colour without texture"))
            }
        }
    }
}

impl Serialize for Rgb {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Vec3 { x, y, z } = self.0;
        if x == y && y == z {
            return serializer.serialize_f32(x);
        }
        let mut tuple = serializer.serialize_tuple(3)?;
        for channel in [x, y, z] {
            tuple.serialize_element(&channel)?;
        }
        tuple.end()
    }
}

impl Serialize for ColorValue {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Rgb(rgb) => Rgb(*rgb).serialize(serializer),
            Self::Texture(name) => serializer.serialize_str(name),
        }
    }
}

impl Serialize for ScalarValue {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Number(value) => serializer.serialize_f32(*value),
            Self::Texture(name) => serializer.serialize_str(name),
        }
    }
}

/// A map that keeps the order of the file; duplicate names are an error.
#[derive(Clone, Debug, PartialEq)]
pub struct Named<T>(pub IndexMap<String, T>);

impl<T> Named<T> {
    /// The value of this name.
    pub fn get(&self, name: &str) -> Option<&T> {
        self.0.get(name)
    }

    /// All names, in the order of the file.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.0.keys().map(String::as_str)
    }

    /// Whether it has no entries.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// All names and values, in the order of the file.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &T)> {
        self.0.iter().map(|(name, value)| (name.as_str(), value))
    }
}

impl<T> Default for Named<T> {
    fn default() -> Self {
        Self(IndexMap::new())
    }
}

impl<T> FromIterator<(String, T)> for Named<T> {
    fn from_iter<I: IntoIterator<Item = (String, T)>>(entries: I) -> Self {
        Self(entries.into_iter().collect())
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Named<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Entries<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for Entries<T> {
            type Value = Named<T>;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("named entries: { \"name\": value, … }")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Named<T>, A::Error> {
                let mut entries = IndexMap::new();
                while let Some(name) = map.next_key::<String>()? {
                    match entries.entry(name) {
                        Entry::Vacant(entry) => entry.insert(map.next_value()?),
                        Entry::Occupied(entry) => {
                            let name = entry.key();
                            return Err(A::Error::custom(format!("`{name}` is defined twice: rename or remove one")));
                        }
                    };
                }
                Ok(Named(entries))
            }
        }
        deserializer.deserialize_map(Entries(PhantomData))
    }
}

impl<T: Serialize> Serialize for Named<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.0.len()))?;
        for (name, value) in &self.0 {
            map.serialize_entry(name, value)?;
        }
        map.end()
    }
}

/// Reads a list of at most `MOST` entries, and nothing beyond.
pub(crate) fn list_within<'de, D: Deserializer<'de>, T: Deserialize<'de>, const MOST: usize>(
    deserializer: D,
) -> Result<Vec<T>, D::Error> {
    struct List<T, const MOST: usize>(PhantomData<T>);
    impl<'de, T: Deserialize<'de>, const MOST: usize> Visitor<'de> for List<T, MOST> {
        type Value = Vec<T>;

        fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
            f.write_str("a sequence")
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut entries: A) -> Result<Vec<T>, A::Error> {
            let mut list = Vec::new();
            while let Some(entry) = entries.next_element()? {
                if list.len() == MOST {
                    return Err(A::Error::custom(format!("more than {MOST} entries: a scene may have up to {MOST}")));
                }
                list.push(entry);
            }
            Ok(list)
        }
    }
    deserializer.deserialize_seq(List::<T, MOST>(PhantomData))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_ends_where_it_may_have_no_more() {
        #[derive(Debug, PartialEq, Deserialize)]
        struct Two(#[serde(deserialize_with = "list_within::<_, _, 2>")] Vec<u32>);
        assert_eq!(ron::from_str("([1, 2])"), Ok(Two(vec![1, 2])));
        // What is not read need not be right.
        let error = ron::from_str::<Two>("([1, 2, 3, what])").unwrap_err().to_string();
        assert!(error.contains("more than 2 entries"), "{error}");
    }

    #[test]
    fn hexadecimal_colours_are_srgb() {
        let color = hex_color("#ccbbaa").unwrap();
        // IEC 61966-2-1: ((c + 0.055) / 1.055)^2.4.
        assert!((color - Vec3::new(0.603_827, 0.496_933, 0.401_978)).abs().max_element() < 1e-6, "{color}");
        assert_eq!(hex_color("#fff"), Some(Vec3::ONE));
        assert_eq!(hex_color("#cba"), hex_color("#CCBBAA"));
        for other in ["#cccc", "#ggg", "ccbbaa", "#", "#12345é", "#ccbbaa80"] {
            assert_eq!(hex_color(other), None, "{other}");
        }
    }

    #[test]
    fn colours_are_read_from_hexadecimal_and_saved_as_numbers() {
        let color: ColorValue = ron::from_str("\"#f00\"").unwrap();
        assert_eq!(color, ColorValue::rgb(1.0, 0.0, 0.0));
        assert_eq!(ron::to_string(&color).unwrap(), "(1.0,0.0,0.0)");
        assert_eq!(ron::from_str::<Rgb>("\"#0f0\"").unwrap(), Rgb(Vec3::Y));
        assert!(ron::from_str::<Rgb>("\"red\"").unwrap_err().to_string().contains("#rrggbb"));
        assert_eq!(ron::from_str::<ColorValue>("\"#tiles\"").unwrap(), ColorValue::Texture("#tiles".to_owned()));
    }
}
