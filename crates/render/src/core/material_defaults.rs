//! Defaults of material parameters in a scene file, and tests for them.

use glam::Vec3;

macro_rules! defaults {
    ($($value:ident, $is_value:ident: $kind:path = $number:expr;)*) => {
        $(
            pub(super) fn $value<T: From<$kind>>() -> T {
                $number.into()
            }

            pub(super) fn $is_value<T: From<$kind> + PartialEq>(value: &T) -> bool {
                *value == $value()
            }
        )*
    };
}

defaults! {
    white, is_white: Vec3 = Vec3::ONE;
    black, is_black: Vec3 = Vec3::ZERO;
    flat, is_flat: Vec3 = Vec3::new(0.5, 0.5, 1.0);
    along_tangent, is_along_tangent: Vec3 = Vec3::new(1.0, 0.5, 1.0);
    zero, is_zero: f32 = 0.0;
    half, is_half: f32 = 0.5;
    one_scalar, is_one: f32 = 1.0;
    film_ior, is_film_ior: f32 = 1.3;
    thin, is_thin: f32 = 100.0;
    thick, is_thick: f32 = 400.0;
}

pub(super) fn light_grey<C: From<Vec3>>() -> C {
    Vec3::splat(0.8).into()
}

pub(super) fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

pub(super) fn yes() -> bool {
    true
}

pub(super) fn is_yes(value: &bool) -> bool {
    *value
}

pub(super) fn one() -> f32 {
    1.0
}

pub(super) fn is_one_number(value: &f32) -> bool {
    *value == 1.0
}

pub(super) fn glass_ior() -> f32 {
    1.5
}

pub(super) fn dull() -> f32 {
    20.0
}
