//! The textures of each material that do not fit into the cache of a core.

use crate::core::material::Material;
use crate::core::texture::{Texture, TextureId};

/// Smaller images stay in the cache while hits are shaded: half of the usual second-level cache.
const LARGE: usize = 512 << 10;

/// Textures whose texels are usually not in the cache, by material.
#[derive(Debug)]
pub(crate) struct LargeTextures {
    of_material: Vec<Box<[TextureId]>>,
    is_empty: bool,
}

impl LargeTextures {
    pub fn build(materials: &[Material], textures: &[Texture]) -> Self {
        let of_material = |material: &Material| {
            let mut found: Vec<TextureId> = Vec::new();
            material.for_each_texture(materials, |id| {
                let texture = &textures[id as usize];
                let is_new = || found.iter().all(|&other| !textures[other as usize].has_texels_of(texture));
                if texture.bytes() > LARGE && is_new() {
                    found.push(id);
                }
            });
            found.into_boxed_slice()
        };
        let of_material: Vec<_> = materials.iter().map(of_material).collect();
        Self { is_empty: of_material.iter().all(|textures| textures.is_empty()), of_material }
    }

    /// The large textures of a material, each set of texels once.
    #[inline]
    pub fn of(&self, material: u32) -> &[TextureId] {
        &self.of_material[material as usize]
    }

    /// Whether no material has any.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.is_empty
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::material::ColorInput;
    use crate::core::texture::{Channel, Encoding, ImageTexture, Texels, TexturePattern, Wrap};
    use glam::Vec2;
    use std::sync::Arc;

    fn image(size: u32) -> Texture {
        let data = vec![7; (size * size) as usize];
        let image = Arc::new(ImageTexture { width: size, height: size, texels: Texels::U8 { channels: 1, data } });
        let encoding = Encoding::Auto;
        Texture::new(TexturePattern::Image { image, encoding, wrap: [Wrap::Repeat; 2], smooth: true })
    }

    #[test]
    fn each_large_image_is_listed_once_for_each_way_of_reading_it() {
        let large = image(1024);
        let textures = [
            image(16),
            large.clone(),
            Texture { channel: Some(Channel::G), ..large.clone() },
            Texture { uv_offset: Vec2::X, ..large },
        ];
        let diffuse = |id| Material::Diffuse { albedo: ColorInput::Texture(id) };
        let blend = |a, b| Material::blend(crate::core::material::ScalarInput::Texture(2), a, b);
        let materials = [diffuse(0), diffuse(1), diffuse(3), blend(0, 1), blend(3, 2)];
        let table = LargeTextures::build(&materials, &textures);
        let lists = [&[][..], &[1], &[3], &[2], &[2, 3]];
        for (material, expected) in (0..).zip(lists) {
            let mut found = table.of(material).to_vec();
            found.sort_unstable();
            assert_eq!(found, expected, "material {material}");
        }
        assert!(!table.is_empty());
        assert!(LargeTextures::build(&materials[..1], &textures).is_empty());
    }
}
