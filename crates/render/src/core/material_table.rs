//! Makes the types of materials from the table in [`crate::core::material`].
//!
//! A row of the table is `name: type, Param(Domain) = default, "label";` below its help. `Param` is the variant of
//! [`Param`](crate::core::material_params::Param) for that type; without `= default`, scene files must give a value.

/// A default as a [`Value`](crate::core::property::Value).
macro_rules! value_of {
    () => {
        None
    };
    (Color $value:expr) => {
        Some(Value::Color($value))
    };
    (Rgb $value:expr) => {
        Some(Value::Color($value))
    };
    (Scalar $value:expr) => {
        Some(Value::Number($value))
    };
    (Number $value:expr) => {
        Some(Value::Number($value))
    };
    (Flag $value:expr) => {
        Some(Value::Flag($value))
    };
    (Fresnel $value:expr) => {
        Some(Value::Fresnel($value))
    };
    (Cutoff $value:expr) => {
        Some(Value::Nothing)
    };
}

/// What a parameter of a new material is: its default, or else `color` or `part`.
macro_rules! initial {
    ($color:ident $part:ident Color) => {
        $color.clone()
    };
    ($color:ident $part:ident Scalar) => {
        0.0.into()
    };
    ($color:ident $part:ident Part) => {
        $part()
    };
    ($color:ident $part:ident Color $value:expr) => {
        $value.into()
    };
    ($color:ident $part:ident Rgb $value:expr) => {
        $value.into()
    };
    ($color:ident $part:ident Scalar $value:expr) => {
        $value.into()
    };
    ($color:ident $part:ident $param:ident $value:expr) => {
        $value
    };
}

/// A parameter with converted references.
macro_rules! mapped {
    ($to:ident Color $value:ident) => {
        $to.color($value)
    };
    ($to:ident Scalar $value:ident) => {
        $to.scalar($value)
    };
    ($to:ident Part $value:ident) => {
        $to.material($value)
    };
    ($to:ident Rgb $value:ident) => {
        Q::Rgb::from((*$value).into())
    };
    ($to:ident $param:ident $value:ident) => {
        *$value
    };
}

macro_rules! materials {
    ($(
        $(#[doc = $about:literal])*
        $kind:ident $name:literal $(($main:ident))? {
            $(
                $(#[doc = $help:literal])*
                $field:ident: $type:ty, $param:ident($domain:ident) $(= $default:expr)?, $label:literal;
            )*
        }
    )*) => {
        /// A closed set of materials; all are two-sided except for emission.
        #[derive(Clone, Debug, PartialEq)]
        pub enum Material<P: Params = InSnapshot> {
            $(
                $(#[doc = $about])*
                $kind { $($(#[doc = $help])* $field: $type,)* },
            )*
        }

        /// The kinds of [`Material`].
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
        pub enum MaterialKind {
            $($(#[doc = $about])* #[serde(rename = $name)] $kind,)*
        }

        impl MaterialKind {
            /// All kinds.
            pub const ALL: &'static [Self] = &[$(Self::$kind,)*];

            /// The names of all kinds in scene files.
            pub(super) const NAMES: &'static [&'static str] = &[$($name,)*];

            /// Name in scene files.
            pub fn name(self) -> &'static str {
                Self::NAMES[self as usize]
            }

            /// What it is, a phrase or some sentences.
            pub fn about(self) -> &'static str {
                match self { $(Self::$kind => concat!($($about),*).trim_ascii_start(),)* }
            }

            /// The properties of materials of this kind, in the order of [`Material::params`].
            pub fn properties(self) -> &'static [Property] {
                match self {
                    $(Self::$kind => const { &[$(Property {
                        name: stringify!($field),
                        value: ValueType::$param,
                        domain: Domain::$domain,
                        default: value_of!($($param $default)?),
                        label: $label,
                        help: concat!($($help),*).trim_ascii_start(),
                    },)*] },)*
                }
            }

            /// Name of the property with the main colour, in brackets in the table; `None` if there is none.
            pub fn main_property(self) -> Option<&'static str> {
                match self { $(Self::$kind => <[&'static str]>::first(&[$(stringify!($main))?]).copied(),)* }
            }

            /// The names of its properties.
            pub(super) fn property_names(self) -> &'static [&'static str] {
                match self { $(Self::$kind => &[$(stringify!($field),)*],)* }
            }
        }

        impl<P: Params> Material<P> {
            /// Returns the same material with converted references.
            pub fn map<Q: Params>(&self, to: &mut impl MapParams<P, Q>) -> Material<Q> {
                match self {
                    $(Self::$kind { $($field),* } => Material::$kind { $($field: mapped!(to $param $field),)* },)*
                }
            }

            /// Its parameters with their descriptions.
            pub fn params(&self) -> Vec<(&'static Property, ParamRef<'_, P>)> {
                let values = match self { $(Self::$kind { $($field),* } => vec![$(Param::$param($field),)*],)* };
                self.kind().properties().iter().zip(values).collect()
            }

            /// Its parameters for modification, otherwise as in [`Self::params`].
            pub fn params_mut(&mut self) -> Vec<(&'static Property, ParamMut<'_, P>)> {
                let properties = self.kind().properties();
                let values = match self { $(Self::$kind { $($field),* } => vec![$(Param::$param($field),)*],)* };
                properties.iter().zip(values).collect()
            }

            /// Its kind.
            #[inline]
            pub fn kind(&self) -> MaterialKind {
                match self { $(Self::$kind { .. } => MaterialKind::$kind,)* }
            }

            /// The main colour: albedo, reflectance, diffuse colour or radiance; `None` if there is none.
            #[inline]
            pub fn color(&self) -> Option<&P::Color> {
                match self {
                    $($(Self::$kind { $main, .. } => Some($main),)?)*
                    _ => None,
                }
            }

            /// See [`Self::color`].
            pub fn color_mut(&mut self) -> Option<&mut P::Color> {
                match self {
                    $($(Self::$kind { $main, .. } => Some($main),)?)*
                    _ => None,
                }
            }

            /// A material with defaults, and with these in place of colours and parts that have none.
            pub(super) fn initial(kind: MaterialKind, color: &P::Color, part: impl Fn() -> P::Material) -> Self {
                match kind {
                    $(MaterialKind::$kind => Self::$kind {
                        $($field: initial!(color part $param $($default)?),)*
                    },)*
                }
            }
        }
    };
}

pub(super) use {initial, mapped, materials, value_of};
