//! Textured colours: checkers for all lanes at once, images one lane at a time.

use crate::core::material::ColorInput;
use crate::core::texture::{TexturePattern, is_even_square};
use crate::prepare::prepared::Prepared;
use crate::shading::simd::lanes::lanes_of;
use crate::shading::simd::surface::SurfaceLanes;
use firstlight_simd::{Bits, Mask, Simd, Vector, select_vector};
use glam::Vec2;

/// Returns `color`, replaced in the lanes of `textured` by the textures of their rows in `inputs`.
#[inline(always)]
pub(crate) fn looked_up<S: Simd>(
    s: S,
    scene: &Prepared,
    inputs: &[ColorInput],
    row: Bits<S>,
    textured: Mask,
    place: &SurfaceLanes<S>,
    color: Vector<S>,
) -> Vector<S> {
    if textured == 0 {
        return color;
    }
    let rows = row.to_array();
    let first = rows[textured.trailing_zeros() as usize];
    let (mut color, mut rest) = (color, textured);
    if let ColorInput::Texture(id) = inputs[first as usize] {
        let texture = &scene.shading.textures[id as usize];
        if let TexturePattern::Checker { a, b } = &texture.pattern
            && texture.is_plain()
        {
            let even = is_even_square(texture.pattern_coordinates(place.uv));
            let alike = textured & row.equals(first);
            let found = select_vector(even, Vector::splat(s, *a), Vector::splat(s, *b));
            color = select_vector(alike, found, color);
            rest &= !alike;
        }
    }
    if rest == 0 {
        return color;
    }
    let (us, vs) = (place.uv[0].to_array(), place.uv[1].to_array());
    let mut colors = color.to_arrays();
    for lane in lanes_of(rest) {
        let found = inputs[rows[lane] as usize].eval(scene, Vec2::new(us[lane], vs[lane]));
        (colors[0][lane], colors[1][lane], colors[2][lane]) = (found.x, found.y, found.z);
    }
    Vector::from_arrays(s, &colors)
}
