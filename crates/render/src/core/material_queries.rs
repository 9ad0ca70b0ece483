//! Properties of materials in a snapshot for the renderer: transmissive, specular, emissive.

use crate::core::material::{ColorInput, Material, MaterialId, Param, SMALLEST_ALPHA, ScalarInput};
use crate::core::texture::{Texture, TextureId};
use glam::Vec3;

impl Material {
    /// Whether light can pass through the surface.
    pub(crate) fn is_clear(&self) -> bool {
        match self {
            Self::Glass { .. } | Self::RoughGlass { .. } => true,
            Self::Phong { transparency, .. } => *transparency > 0.0,
            Self::Principled { transmission, thin_walled, .. } | Self::Disney { transmission, thin_walled, .. } => {
                !thin_walled && can_be_above_zero(transmission)
            }
            _ => false,
        }
    }

    /// Whether it, or a part of it, is transmissive.
    pub(crate) fn has_clear_part(&self, materials: &[Self]) -> bool {
        match self {
            Self::Blend { a, b, .. } => [a, b].into_iter().any(|&id| materials[id as usize].has_clear_part(materials)),
            _ => self.is_clear(),
        }
    }

    /// Whether its inside absorbs light.
    pub(crate) fn absorbs(&self) -> bool {
        match self {
            Self::Glass { absorption, .. }
            | Self::RoughGlass { absorption, .. }
            | Self::Phong { absorption, .. }
            | Self::Principled { absorption, .. } => self.is_clear() && *absorption != Vec3::ZERO,
            _ => false,
        }
    }

    /// Whether its inside refracts red, green and blue light differently.
    pub(crate) fn disperses(&self) -> bool {
        match self {
            Self::Glass { dispersion, .. }
            | Self::RoughGlass { dispersion, .. }
            | Self::Principled { dispersion, .. } => self.is_clear() && *dispersion > 0.0,
            _ => false,
        }
    }

    /// Indices of refraction for red, green and blue light.
    ///
    /// A dispersion of 20 / V, where V is the Abbe number (n_d − 1) / (n_F − n_C), puts n_C and n_F at red and blue and
    /// n_d at green (`KHR_materials_dispersion`). No index crosses 1.
    ///
    /// - `ior`: for green, above 0; `dispersion`: 0 or more.
    pub fn iors(ior: f32, dispersion: f32) -> [f32; 3] {
        /// Difference of indices between green and red over that between green and 1.
        const HALF_SPREAD: f32 = 0.5 / 20.0;
        let half = (ior - 1.0) * (HALF_SPREAD * dispersion).min(1.0);
        [ior - half, ior, (ior + half).max(0.1 * ior)]
    }

    /// Whether it, or a part of it, is specular everywhere: a mirror or glass.
    pub(crate) fn is_specular(&self, materials: &[Self]) -> bool {
        match self {
            Self::Mirror { .. } | Self::Glass { .. } => true,
            Self::Metal { alpha, .. } | Self::RoughGlass { alpha, .. } => is_mirror(alpha),
            Self::Conductor { alpha, alpha_v, .. } => is_mirror(alpha) && is_mirror(alpha_v),
            Self::Phong { specular, transparency, .. } => {
                *transparency > 0.0 || !matches!(specular, ScalarInput::Constant(share) if *share <= 0.0)
            }
            Self::Blend { a, b, .. } => [a, b].into_iter().any(|&id| materials[id as usize].is_specular(materials)),
            Self::Principled { metallic, roughness, transmission, .. } => {
                // The main reflection of the base; the weak reflection of a dielectric or a coat is left to camera
                // paths.
                let is_smooth = matches!(roughness, ScalarInput::Constant(r) if r * r < SMALLEST_ALPHA);
                is_smooth && (can_be_above_zero(metallic) || can_be_above_zero(transmission))
            }
            // The weak reflections of a coat and of a pane, which does not bend light, are left to camera paths.
            Self::Plastic { .. } | Self::ThinGlass { .. } => false,
            Self::Diffuse { .. } | Self::Translucent { .. } | Self::Disney { .. } | Self::Emissive { .. } => false,
        }
    }

    /// Whether it scatters no light, as far as that is the same everywhere: what lies beyond is seen in it or through it.
    pub(crate) fn is_purely_specular(&self, materials: &[Self]) -> bool {
        let whole = |input: &ScalarInput| !matches!(input, ScalarInput::Constant(share) if *share < 1.0);
        match self {
            Self::Phong { specular, transparency, .. } => {
                *transparency >= 1.0 || matches!(specular, ScalarInput::Constant(share) if *share >= 1.0)
            }
            Self::Blend { weight, a, b, .. } => {
                // A part without weight does not count.
                [(*a, 1.0), (*b, 0.0)].into_iter().all(|(id, without)| {
                    matches!(weight, ScalarInput::Constant(weight) if *weight == without)
                        || materials[id as usize].is_purely_specular(materials)
                })
            }
            Self::Principled { metallic, transmission, .. } => {
                self.is_specular(materials) && (whole(metallic) || whole(transmission))
            }
            _ => self.is_specular(materials),
        }
    }

    /// The material that scatters: of a blend that adds nothing but holes, a normal map or a black back to one opaque
    /// part, that part.
    pub(crate) fn scattering<'a>(&'a self, materials: &'a [Self]) -> &'a Self {
        let part = match self {
            Self::Blend { a, .. } if self.has_black_back(materials) => *a,
            Self::Blend { weight: ScalarInput::Constant(weight), a, b, by_side: false, .. }
                if !(0.0 < *weight && *weight < 1.0) =>
            {
                if *weight < 1.0 {
                    *a
                } else {
                    *b
                }
            }
            _ => return self,
        };
        let part = &materials[part as usize];
        let is_plain = match part {
            Self::Diffuse { .. } | Self::Mirror { .. } | Self::Metal { .. } | Self::Plastic { .. } => true,
            Self::Conductor { .. } => !part.asks_for_tangents(),
            Self::Translucent { .. } | Self::Disney { .. } => !part.asks_for_tangents() && self.normal_map().is_none(),
            _ => false,
        };
        if is_plain && !self.turns_normals_over() { part } else { self }
    }

    /// Whether its back neither scatters light nor emits any.
    pub(crate) fn has_black_back(&self, materials: &[Self]) -> bool {
        const BLACK: ColorInput = ColorInput::Constant(Vec3::ZERO);
        let Self::Blend { b, by_side: true, .. } = self else { return false };
        matches!(&materials[*b as usize], Self::Emissive { radiance: BLACK } | Self::Diffuse { albedo: BLACK })
    }

    /// Where its surfaces are, unless they are everywhere.
    pub(crate) fn cutout(&self) -> Option<Cutout> {
        let (opacity, cutoff, has_back) = match self {
            Self::Principled { two_sided, opacity, opacity_cutoff, .. } => {
                (*opacity, *opacity_cutoff, *two_sided || self.is_clear())
            }
            Self::Blend { opacity, opacity_cutoff, .. } => (*opacity, *opacity_cutoff, true),
            _ => return None,
        };
        let is_whole = matches!(opacity, ScalarInput::Constant(opacity) if opacity >= cutoff.unwrap_or(1.0));
        (!is_whole || !has_back).then_some(Cutout { opacity, cutoff, has_back })
    }

    /// Whether light can go straight on through it, or through a part of it, as through a pane without thickness.
    pub(crate) fn is_pane(&self, materials: &[Self]) -> bool {
        match self {
            Self::ThinGlass { .. } => true,
            Self::Principled { transmission, roughness, thin_walled: true, .. } => {
                let is_rough = matches!(roughness, ScalarInput::Constant(r) if r * r >= SMALLEST_ALPHA);
                can_be_above_zero(transmission) && !is_rough
            }
            Self::Blend { a, b, .. } => [a, b].into_iter().any(|&id| materials[id as usize].is_pane(materials)),
            _ => false,
        }
    }

    /// Whether it scatters transmitted light, so that light is sampled on both sides.
    pub(crate) fn scatters_through(&self) -> bool {
        match self {
            Self::RoughGlass { .. } | Self::Translucent { .. } => true,
            Self::Principled { transmission, .. } => can_be_above_zero(transmission),
            Self::Disney { transmission, thin_walled, diffuse_transmission, .. } => {
                can_be_above_zero(transmission) || (*thin_walled && can_be_above_zero(diffuse_transmission))
            }
            _ => false,
        }
    }

    /// Whether transmitted light takes one of several paths, so that only BSDF sampling finds it. Layers of smooth glass
    /// alone have one.
    pub(crate) fn is_blended(&self) -> bool {
        match self {
            Self::Principled { roughness, clearcoat, sheen_color, .. } => {
                let is_smooth = matches!(roughness, ScalarInput::Constant(r) if r * r < SMALLEST_ALPHA);
                !is_smooth || can_be_above_zero(clearcoat) || *sheen_color != ColorInput::Constant(Vec3::ZERO)
            }
            Self::Blend { .. } => true,
            _ => false,
        }
    }

    /// Whether it has normal maps or anisotropy, and so needs tangents.
    pub(crate) fn asks_for_tangents(&self) -> bool {
        let of_layers = match self {
            Self::Principled { clearcoat_normal_map, anisotropy, .. } => {
                clearcoat_normal_map.is_normal_map() || can_be_above_zero(anisotropy)
            }
            Self::Conductor { alpha_v: width, .. } | Self::Disney { anisotropic: width, .. } => {
                can_be_above_zero(width)
            }
            _ => false,
        };
        of_layers || self.normal_map().is_some()
    }

    /// The map of its shading normal, and the factor of its slope.
    pub(crate) fn normal_map(&self) -> Option<(ColorInput, f32)> {
        match self {
            Self::Principled { normal_map, normal_scale, .. } | Self::Blend { normal_map, normal_scale, .. } => {
                normal_map.is_normal_map().then_some((*normal_map, *normal_scale))
            }
            _ => None,
        }
    }

    /// Whether normals of its map are those of [`crate::shading::tangent::turned_over`], not bent.
    pub(crate) fn turns_normals_over(&self) -> bool {
        matches!(self, Self::Blend { normal_shadowing: true, .. })
    }

    /// Whether it, or a part of it, needs tangents.
    pub(crate) fn has_tangents(&self, materials: &[Self]) -> bool {
        match self {
            Self::Blend { a, b, .. } => {
                self.asks_for_tangents() || [a, b].into_iter().any(|&id| materials[id as usize].has_tangents(materials))
            }
            _ => self.asks_for_tangents(),
        }
    }

    /// Whether it, or a part of it, is textured.
    pub(crate) fn is_textured(&self, materials: &[Self]) -> bool {
        self.any_texture(materials, &mut |_| true)
    }

    /// Whether a texture of it, or of a part of it, needs more than the first texture coordinates.
    pub(crate) fn asks_for_more_than_uv(&self, materials: &[Self], textures: &[Texture]) -> bool {
        self.any_texture(materials, &mut |id| textures[id as usize].asks_for_more_than_uv())
    }

    /// Calls `visit` with each texture of it and of its parts; one that it uses twice comes twice.
    pub(crate) fn for_each_texture(&self, materials: &[Self], mut visit: impl FnMut(TextureId)) {
        self.any_texture(materials, &mut |id| {
            visit(id);
            false
        });
    }

    fn any_texture(&self, materials: &[Self], is_so: &mut impl FnMut(TextureId) -> bool) -> bool {
        self.params().into_iter().any(|(_, param)| match param {
            Param::Color(ColorInput::Texture(id)) | Param::Scalar(ScalarInput::Texture(id)) => is_so(*id),
            Param::Part(part) => materials[*part as usize].any_texture(materials, is_so),
            _ => false,
        })
    }
}

impl ColorInput {
    /// Whether the map changes normals.
    pub(crate) fn is_normal_map(&self) -> bool {
        !matches!(self, Self::Constant(color) if *color == Vec3::new(0.5, 0.5, 1.0))
    }
}

/// Where the surfaces of a material are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cutout {
    pub opacity: ScalarInput,
    /// The opacity from which on the surface is present; `None` if opacity is a probability.
    pub cutoff: Option<f32>,
    /// Whether the surface can be hit from behind.
    pub has_back: bool,
}

/// Whether a parameter may be positive somewhere, without evaluating textures.
fn can_be_above_zero(scalar: &ScalarInput) -> bool {
    !matches!(scalar, ScalarInput::Constant(value) if *value <= 0.0)
}

/// Whether a surface of this width is a mirror everywhere.
fn is_mirror(alpha: &ScalarInput) -> bool {
    matches!(alpha, ScalarInput::Constant(alpha) if *alpha < SMALLEST_ALPHA)
}

/// The light that a material emits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emission {
    /// Radiance of the emissive material, W·m⁻²·sr⁻¹, before `scale`.
    pub radiance: ColorInput,
    /// Share of an emissive part in a blend.
    pub scale: f32,
    /// Whether the back emits as well.
    pub two_sided: bool,
    /// Opacity, and the cutoff from which on the surface is present.
    pub opacity: (ScalarInput, Option<f32>),
}

impl Emission {
    const WHOLE: (ScalarInput, Option<f32>) = (ScalarInput::Constant(1.0), None);

    /// Emitted radiance, if it is the same everywhere on the surface.
    pub(crate) fn even_radiance(&self) -> Option<Vec3> {
        let (ColorInput::Constant(radiance), (ScalarInput::Constant(opacity), cutoff)) = (self.radiance, self.opacity)
        else {
            return None;
        };
        let there = cutoff.map_or(opacity.clamp(0.0, 1.0), |cutoff| f32::from(opacity >= cutoff));
        Some(self.scale * there * radiance)
    }

    /// Emission of a front with constant radiance, W·m⁻²·sr⁻¹.
    pub(crate) fn even(radiance: Vec3) -> Self {
        Self { radiance: ColorInput::Constant(radiance), scale: 1.0, two_sided: false, opacity: Self::WHOLE }
    }

    /// Returns the emission of a material or of a part of a blend; `None` if there is none.
    pub fn of(materials: &[Material], id: MaterialId) -> Option<Self> {
        match &materials[id as usize] {
            Material::Emissive { radiance: ColorInput::Constant(Vec3::ZERO) } => None,
            Material::Emissive { radiance } => {
                Some(Self { radiance: *radiance, scale: 1.0, two_sided: false, opacity: Self::WHOLE })
            }
            Material::Principled { emission: ColorInput::Constant(Vec3::ZERO), .. } => None,
            Material::Principled { emission, two_sided, opacity, opacity_cutoff, .. } => Some(Self {
                radiance: *emission,
                scale: 1.0,
                two_sided: *two_sided,
                opacity: (*opacity, *opacity_cutoff),
            }),
            blend @ Material::Blend { by_side: true, a, .. } => {
                let opacity = blend.cutout().map_or(Self::WHOLE, |cutout| (cutout.opacity, cutout.cutoff));
                Self::of(materials, *a).map(|front| Self { opacity, two_sided: false, ..front })
            }
            blend @ Material::Blend { weight: ScalarInput::Constant(weight), a, b, .. } => {
                let part = |id, share: f32| {
                    let emission = Self::of(materials, id)?;
                    let opacity = blend.cutout().map_or(Self::WHOLE, |cutout| (cutout.opacity, cutout.cutoff));
                    (share > 0.0).then_some(Self { scale: share * emission.scale, opacity, ..emission })
                };
                part(*a, 1.0 - weight).or_else(|| part(*b, *weight))
            }
            _ => None,
        }
    }
}
