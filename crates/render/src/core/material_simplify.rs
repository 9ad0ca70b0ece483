//! Replaces principled materials by equivalent simpler ones, which are shaded faster and support more techniques.

use crate::core::material::{ColorInput, Fresnel, Material, SMALLEST_ALPHA, ScalarInput};
use glam::Vec3;

impl Material {
    /// Returns an equivalent diffuse material, metal or glass, if a principled material has no other effects.
    ///
    /// Glass has exact Fresnel either way; a metal is equal to the principled one in all formulas.
    pub fn simplified(self) -> Self {
        let Self::Principled {
            base_color,
            metallic: ScalarInput::Constant(metallic),
            roughness,
            ior,
            specular,
            specular_color: _,
            transmission: ScalarInput::Constant(transmission),
            thin_walled: false,
            absorption,
            dispersion,
            anisotropy: ScalarInput::Constant(0.0),
            anisotropy_rotation: _,
            anisotropy_map: _,
            sheen_color: ColorInput::Constant(Vec3::ZERO),
            sheen_roughness: _,
            clearcoat: ScalarInput::Constant(0.0),
            clearcoat_roughness: _,
            clearcoat_normal_map: _,
            iridescence: ScalarInput::Constant(0.0),
            iridescence_ior: _,
            iridescence_min: _,
            iridescence_max: _,
            iridescence_map: _,
            emission: ColorInput::Constant(Vec3::ZERO),
            opacity: _,
            opacity_cutoff: _,
            normal_map,
            normal_scale: _,
            two_sided: _,
        } = self
        else {
            return self;
        };
        if self.cutout().is_some() || normal_map.is_normal_map() {
            return self;
        }
        let alpha = match roughness {
            ScalarInput::Constant(roughness) => roughness.clamp(0.0, 1.0).powi(2),
            ScalarInput::Texture(_) => {
                return if is_diffuse(metallic, transmission, specular) {
                    Self::Diffuse { albedo: base_color }
                } else {
                    self
                };
            }
        };
        if is_diffuse(metallic, transmission, specular) {
            Self::Diffuse { albedo: base_color }
        } else if metallic >= 1.0 {
            let alpha = ScalarInput::Constant(alpha);
            Self::Metal { alpha, reflectance: base_color, fresnel: Fresnel::Schlick, compensate: true }
        } else if metallic <= 0.0 && transmission >= 1.0 && base_color == ColorInput::Constant(Vec3::ONE) {
            if alpha < SMALLEST_ALPHA {
                Self::Glass { ior, absorption, dispersion }
            } else {
                let alpha = ScalarInput::Constant(alpha);
                Self::RoughGlass { alpha, ior, absorption, dispersion, compensate: true, beckmann: false }
            }
        } else {
            self
        }
    }
}

fn is_diffuse(metallic: f32, transmission: f32, specular: ScalarInput) -> bool {
    metallic <= 0.0 && transmission <= 0.0 && matches!(specular, ScalarInput::Constant(specular) if specular <= 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::material::Param;

    #[test]
    fn only_what_says_no_more_becomes_simpler() {
        let white = || Material::principled(ColorInput::Constant(Vec3::ONE));
        assert_eq!(white().simplified(), white());
        let with = |change: fn(&mut Material)| {
            let mut material = white();
            change(&mut material);
            material.simplified()
        };
        let constant = ScalarInput::Constant;
        let metal = with(|m| set(m, "metallic", 1.0));
        let expected = Material::Metal {
            alpha: constant(0.25),
            reflectance: ColorInput::Constant(Vec3::ONE),
            fresnel: Fresnel::Schlick,
            compensate: true,
        };
        assert_eq!(metal, expected);
        let glass = with(|m| {
            set(m, "transmission", 1.0);
            set(m, "roughness", 0.0);
        });
        assert_eq!(glass, Material::Glass { ior: 1.5, absorption: Vec3::ZERO, dispersion: 0.0 });
        let rough = with(|m| set(m, "transmission", 1.0));
        assert!(matches!(rough, Material::RoughGlass { alpha: ScalarInput::Constant(0.25), compensate: true, .. }));
        assert!(matches!(with(|m| set(m, "specular", 0.0)), Material::Diffuse { .. }));
        let coated = with(|m| {
            set(m, "metallic", 1.0);
            set(m, "clearcoat", 0.5);
        });
        assert!(matches!(coated, Material::Principled { .. }));
        let holes = with(|m| {
            set(m, "metallic", 1.0);
            set(m, "opacity", 0.5);
        });
        assert!(matches!(holes, Material::Principled { .. }));
    }

    fn set(material: &mut Material, name: &str, value: f32) {
        let mut params = material.params_mut().into_iter();
        let Some((_, Param::Scalar(scalar))) = params.find(|(property, _)| property.name == name) else {
            panic!("no number is called {name}");
        };
        *scalar = ScalarInput::Constant(value);
    }
}
