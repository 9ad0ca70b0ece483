//! Mean luminance of emission textures: of the whole texture, and over a triangle.

use crate::core::color::luminance;
use crate::core::texture::{Texture, TextureId, TexturePoint};
use glam::Vec2;

/// Luminance of textures; the mean of an image is computed once, however many triangles show it.
pub(super) struct MeanLight<'a> {
    textures: &'a [Texture],
    whole: Vec<Option<f32>>,
}

/// Points of a triangle: barycentric weights of its second and third vertex.
const POINTS: [Vec2; 10] = [
    Vec2::new(0.33, 0.33),
    Vec2::new(0.05, 0.05),
    Vec2::new(0.9, 0.05),
    Vec2::new(0.05, 0.9),
    Vec2::new(0.5, 0.05),
    Vec2::new(0.05, 0.5),
    Vec2::new(0.45, 0.45),
    Vec2::new(0.2, 0.2),
    Vec2::new(0.6, 0.2),
    Vec2::new(0.2, 0.6),
];

/// Share of the whole texture's mean that is added for details between the points: no emissive triangle has probability
/// 0.
const LEAST_SHARE: f32 = 0.02;

impl<'a> MeanLight<'a> {
    pub fn new(textures: &'a [Texture]) -> Self {
        Self { textures, whole: vec![None; textures.len()] }
    }

    /// - `corners`: texture coordinates of a triangle; `None` for the whole texture.
    pub fn of(&mut self, id: TextureId, corners: Option<&[TexturePoint; 3]>) -> f32 {
        let texture = &self.textures[id as usize];
        let whole = *self.whole[id as usize].get_or_insert_with(|| luminance(texture.mean()));
        let Some(corners) = corners else { return whole };
        let sum: f32 = POINTS.iter().map(|&point| luminance(texture.eval(TexturePoint::between(corners, point)))).sum();
        sum / POINTS.len() as f32 + LEAST_SHARE * whole
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::texture::TexturePattern;
    use glam::Vec3;

    #[test]
    fn triangles_are_as_bright_as_what_they_show() {
        let textures = [Texture::new(TexturePattern::Checker { a: Vec3::ONE, b: Vec3::ZERO })];
        let mut means = MeanLight::new(&textures);
        let square =
            |x: f32| Some([Vec2::new(x, 0.1), Vec2::new(x + 0.8, 0.1), Vec2::new(x, 0.9)].map(TexturePoint::from));
        assert_eq!(means.of(0, None), 0.5);
        assert!((means.of(0, square(0.1).as_ref()) - 1.01).abs() < 1e-5, "in a bright square");
        assert!((means.of(0, square(1.1).as_ref()) - 0.01).abs() < 1e-5, "in a dark one");
    }
}
