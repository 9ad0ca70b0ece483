//! Parameters of a layered surface at one point.

use crate::core::color::luminance;
use crate::core::material::SMALLEST_ALPHA;
use crate::shading::interface::{Interface, MediumId};
use crate::shading::layer_albedo::SchlickAlbedo;
use crate::shading::rough_glass;
use glam::Vec3;

/// Reflectance of the coat at normal incidence, for an index of 1.5.
pub(crate) const COAT_FACING: f32 = 0.04;

/// All parameters at one point of a surface.
#[derive(Clone, Debug)]
pub(crate) struct Principled {
    /// Share of the dielectric's reflection, 0..1.
    pub dielectric: f32,
    /// Reflectance of the dielectric at normal incidence and at grazing angles.
    pub facing: Vec3,
    pub grazing: Vec3,
    /// Albedo of the diffuse layer below the dielectric, times its share.
    pub diffuse: Vec3,
    /// Share of metal, 0..1, and its reflectance at normal incidence.
    pub metallic: f32,
    pub metal: Vec3,
    /// GGX widths along `tangent` and across.
    pub alpha: [f32; 2],
    /// Unit, approximately in the surface; `None` if the direction does not matter.
    pub tangent: Option<Vec3>,
    /// Normal of the true surface where that of shading is from a map, unit, on the side from which the surface was hit:
    /// light that would be scattered below it is mirrored at it. `None` for transmissive surfaces too.
    pub true_normal: Option<Vec3>,
    pub transmission: Option<Transmission>,
    /// Strength of the sheen, and its width.
    pub sheen: Vec3,
    pub sheen_alpha: f32,
    pub coat: f32,
    pub coat_alpha: f32,
    /// Unit, on the side from which the surface was hit.
    pub coat_normal: Vec3,
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

impl Principled {
    /// Isotropic width for transmitted light.
    pub fn mean_alpha(&self) -> f32 {
        if self.alpha[0] == self.alpha[1] { self.alpha[0] } else { (self.alpha[0] * self.alpha[1]).sqrt() }
    }

    pub fn is_smooth(&self) -> bool {
        self.alpha[0].min(self.alpha[1]) < SMALLEST_ALPHA
    }

    pub fn reflects(&self) -> bool {
        self.metallic > 0.0 || (self.dielectric > 0.0 && self.grazing.max(self.facing) != Vec3::ZERO)
    }

    pub fn has_coat(&self) -> bool {
        self.coat > 0.0
    }

    pub fn is_coat_smooth(&self) -> bool {
        self.coat_alpha < SMALLEST_ALPHA
    }

    /// Approximate reflected or transmitted share of light.
    pub fn albedo_estimate(&self) -> f32 {
        let transmitted = self.transmission.map_or(0.0, |transmission| transmission.share);
        let reflected = self.dielectric * self.facing + self.metallic * self.metal;
        luminance(self.diffuse + reflected + self.sheen) + transmitted + COAT_FACING * self.coat
    }

    /// Albedo of the dielectric's reflection, per channel.
    pub fn dielectric_albedo(&self, albedo: SchlickAlbedo) -> Vec3 {
        self.facing * albedo.facing + self.grazing * albedo.grazing
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
