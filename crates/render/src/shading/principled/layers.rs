//! Parameters of a layered surface at one point or at sixteen.

use crate::core::color::luminance_of;
use crate::core::material::SMALLEST_ALPHA;
use crate::shading::interface::{Interface, MediumId};
use crate::shading::layer_albedo::SchlickAlbedo;
use crate::shading::rough_glass;
use firstlight_simd::{Real, Vector3, select};
use glam::Vec3;

/// Reflectance of the coat at normal incidence, for an index of 1.5.
pub(crate) const COAT_FACING: f32 = 0.04;

/// All parameters at a point of a surface. What is optional is absent where no lane has it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Principled<R: Real = f32> {
    /// Share of the dielectric's reflection, 0..1.
    pub dielectric: R,
    /// Reflectance of the dielectric at normal incidence and at grazing angles.
    pub facing: Vector3<R>,
    pub grazing: R,
    /// Albedo of the diffuse layer below the dielectric, times its share.
    pub diffuse: Vector3<R>,
    /// Share of metal, 0..1, and its reflectance at normal incidence.
    pub metallic: R,
    pub metal: Vector3<R>,
    /// GGX widths along `tangent` and across.
    pub alpha: [R; 2],
    /// Unit, approximately in the surface; zero where the direction does not matter.
    pub tangent: Option<Vector3<R>>,
    /// Normal of the true surface where that of shading is from a map, unit, on the side from which the surface was hit:
    /// light that would be scattered below it is mirrored at it. Zero where there is no map, and `None` for transmissive
    /// surfaces too.
    pub true_normal: Option<Vector3<R>>,
    /// Of one lane only.
    pub transmission: Option<Transmission>,
    /// Strength of the sheen, and its width.
    pub sheen: Vector3<R>,
    pub sheen_alpha: R,
    pub coat: R,
    pub coat_alpha: R,
    /// Unit, on the side from which the surface was hit.
    pub coat_normal: Vector3<R>,
}

/// Inputs of the base: parameters of the material at a point, all of them 0..1.
pub(crate) struct BaseInputs<R> {
    pub color: Vector3<R>,
    pub metallic: R,
    pub roughness: R,
    pub specular: R,
    /// Reflectance at normal incidence by the index of refraction, times the colour of the reflection.
    pub specular_color: Vector3<R>,
}

/// The transmissive part.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Transmission {
    /// Share, 0..1.
    pub share: f32,
    /// Colour of transmitted light.
    pub tint: Vec3,
    pub inside: Inside,
    /// Whether light sampling includes light from the far side; otherwise only BSDF sampling finds it.
    pub is_lit: bool,
}

/// What is behind a transmissive surface.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Inside {
    /// Another medium.
    Solid(Interface),
    /// A pane without thickness, inside of this medium.
    Thin(MediumId),
}

impl Transmission {
    pub fn interface(&self) -> Interface {
        match self.inside {
            Inside::Solid(interface) => interface,
            Inside::Thin(here) => Interface::thin(here),
        }
    }
}

impl<R: Real> Principled<R> {
    /// A base without layers above it, opaque.
    ///
    /// - `normal`: that of shading.
    #[inline(always)]
    pub fn of_base(base: &BaseInputs<R>, normal: Vector3<R>) -> Self {
        let &BaseInputs { color, metallic, roughness, specular, specular_color } = base;
        let (zero, one) = (metallic.all(0.0), metallic.all(1.0));
        let opaque = one - metallic;
        let alpha = roughness * roughness;
        Self {
            dielectric: opaque,
            facing: specular_color.min(Vector3::all(one)) * specular,
            grazing: specular,
            diffuse: color * opaque,
            metallic,
            metal: color,
            alpha: [alpha; 2],
            tangent: None,
            true_normal: None,
            transmission: None,
            sheen: Vector3::all(zero),
            sheen_alpha: one,
            coat: zero,
            coat_alpha: zero,
            coat_normal: normal,
        }
    }

    /// Widens the lobe along one direction (`KHR_materials_anisotropy`), where `strength` is above 0.
    #[inline(always)]
    pub fn widen(&mut self, strength: R) {
        let alpha = self.alpha[0];
        let along = alpha + (alpha.all(1.0) - alpha) * strength * strength;
        // Else it is a mirror along one direction only.
        let is_rough = alpha.all(SMALLEST_ALPHA).le(along) & strength.is_positive();
        self.alpha = [along, select(is_rough, alpha.at_least(SMALLEST_ALPHA), alpha)];
    }

    #[inline(always)]
    pub fn is_smooth(&self) -> R::Mask {
        let alpha = self.alpha[0].min(self.alpha[1]);
        alpha.lt(alpha.all(SMALLEST_ALPHA))
    }

    #[inline(always)]
    fn reflects(&self) -> R::Mask {
        let white = self.facing.max_element().max(self.grazing);
        self.metallic.is_positive() | (self.dielectric.is_positive() & white.is_positive())
    }

    #[inline(always)]
    pub fn has_coat(&self) -> R::Mask {
        self.coat.is_positive()
    }

    #[inline(always)]
    pub fn is_coat_smooth(&self) -> R::Mask {
        self.coat_alpha.lt(self.coat_alpha.all(SMALLEST_ALPHA))
    }

    /// Whether some light is scattered by what is opaque.
    #[inline(always)]
    pub fn scatters(&self) -> R::Mask {
        !self.diffuse.is_zero()
            | !self.sheen.is_zero()
            | (self.reflects() & !self.is_smooth())
            | (self.has_coat() & !self.is_coat_smooth())
    }

    /// Approximate albedo of what reflects, without sheen and coat: its colour without lighting. The diffuse layer gets what the
    /// dielectric does not reflect at normal incidence.
    #[inline(always)]
    pub fn color(&self) -> Vector3<R> {
        let below = Vector3::all(self.metallic.all(1.0)) - self.facing;
        self.facing * self.dielectric + below.times(self.diffuse) + self.metal * self.metallic
    }

    /// Albedo of the dielectric's reflection, per channel.
    #[inline(always)]
    pub fn dielectric_albedo(&self, albedo: SchlickAlbedo<R>) -> Vector3<R> {
        self.facing * albedo.facing + Vector3::all(self.grazing * albedo.grazing)
    }
}

impl Principled {
    /// Isotropic width for transmitted light.
    pub fn mean_alpha(&self) -> f32 {
        if self.alpha[0] == self.alpha[1] { self.alpha[0] } else { (self.alpha[0] * self.alpha[1]).sqrt() }
    }

    /// Approximate reflected or transmitted share of light.
    pub fn albedo_estimate(&self) -> f32 {
        let transmitted = self.transmission.map_or(0.0, |transmission| transmission.share);
        let reflected = self.facing * self.dielectric + self.metal * self.metallic;
        luminance_of(self.diffuse + reflected + self.sheen) + transmitted + COAT_FACING * self.coat
    }

    /// Whether transmitted light is scattered rather than specular.
    pub fn is_transmission_rough(&self) -> bool {
        match self.transmission {
            Some(Transmission { inside: Inside::Solid(interface), .. }) => {
                !rough_glass::is_smooth(self.mean_alpha(), interface.eta)
            }
            Some(Transmission { inside: Inside::Thin(_), .. }) => !self.is_smooth(),
            None => false,
        }
    }
}
