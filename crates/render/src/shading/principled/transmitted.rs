//! What a layered surface transmits, at one point.

use crate::shading::dielectric::{fresnel, reflect, refract};
use crate::shading::ggx::sample_visible_normal;
use crate::shading::interface::Interface;
use crate::shading::metal::schlick;
use crate::shading::microfacets::{Microfacets, Reflection};
use crate::shading::principled::layers::{Inside, Transmission};
use crate::shading::principled::seen::{Seen, facets, past_sheen, rest_of};
use crate::shading::rough_glass::RoughGlass;
use crate::shading::scatter::BsdfSample;
use firstlight_simd::Vector3;
use glam::{Vec2, Vec3};

impl Seen {
    /// f · |cos| and pdf of all that is not specular. `wi`: unit, in world space.
    pub fn eval_all(&self, wi: Vec3) -> (Vec3, f32) {
        let Some(transmission) = self.of.transmission else { return self.reflected(wi) };
        if !self.is_valid {
            return (Vec3::ZERO, 0.0);
        }
        let is_rough = self.of.is_transmission_rough();
        let local = Vector3::from(wi).to_local(&self.axes);
        if local.z < 0.0 {
            return match transmission.is_lit && is_rough {
                true => self.eval_through(&transmission, wi, local),
                false => (Vec3::ZERO, 0.0),
            };
        }
        let (mut value, mut pdf) = self.reflected(wi);
        if let Inside::Solid(interface) = transmission.inside
            && is_rough
            && self.pmf[3] > 0.0
            && local.z > 0.0
        {
            let below = self.below_coat(wi.into()) * self.past_sheen.min(past_sheen(&self.of, local.z));
            let (f, density) = self.rough_glass(interface).eval(wi);
            value += Vec3::splat(transmission.share * below * f);
            pdf += self.pmf[3] * density;
        }
        (value, pdf)
    }

    fn reflected(&self, wi: Vec3) -> (Vec3, f32) {
        let (value, pdf) = self.eval(wi.into());
        (value.into(), pdf)
    }

    fn in_world(&self, local: Vector3<f32>) -> Vec3 {
        local.to_world(&self.axes).normalize().into()
    }

    fn rough_glass(&self, interface: Interface) -> RoughGlass {
        let facets = Microfacets::isotropic(self.of.mean_alpha().min(1.0), false);
        RoughGlass::new(self.axes[2].into(), self.in_world(self.wo), facets, interface, true)
    }

    /// Light from the far side, if transmission is rough.
    fn eval_through(&self, transmission: &Transmission, wi: Vec3, local: Vector3<f32>) -> (Vec3, f32) {
        let above = Vector3 { z: -local.z, ..local };
        let below = self.below_coat(wi.into()) * self.past_sheen.min(past_sheen(&self.of, above.z));
        let (f, density) = match transmission.inside {
            Inside::Solid(interface) => {
                let (f, density) = self.rough_glass(interface).eval(wi);
                (Vec3::splat(f), density)
            }
            // The reflected lobe on the far side.
            Inside::Thin(_) => {
                let Reflection { half, value, pdf, .. } = facets(self.wo, above, self.of.alpha);
                (value * self.passed(self.wo.dot(half)) * self.passed_again(), pdf)
            }
        };
        (transmission.tint * (transmission.share * below) * f, self.pmf[3] * density)
    }

    /// Transmittance of a thin pane at an angle.
    fn passed(&self, cos: f32) -> Vec3 {
        rest_of(schlick(self.of.facing, self.of.grazing, cos)).into()
    }

    /// Total over single-scattering transmittance of a rough pane: all light that is not reflected is transmitted (as
    /// in Turquin 2019 for metals).
    fn passed_again(&self) -> Vec3 {
        let reflected = Vec3::from(self.of.dielectric_albedo(self.base));
        let once = Vec3::splat(self.base.whole()) - reflected;
        (Vec3::ONE - reflected) / once.max(Vec3::splat(1e-3))
    }

    /// Share of light to or from a direction that the layers above the transmissive one let pass.
    fn below(&self, wi: Vec3) -> f32 {
        let cos = self.axes[2].dot(wi.into()).abs();
        self.below_coat(wi.into()) * self.past_sheen.min(past_sheen(&self.of, cos))
    }

    /// See [`Scatter::straight`](crate::shading::scatter::Scatter::straight).
    pub fn straight(&self) -> Vec3 {
        match self.of.transmission {
            Some(Transmission { share, tint, inside: Inside::Thin(_), .. })
                if self.of.is_smooth() && self.is_valid && self.pmf[3] > 0.0 =>
            {
                tint * self.passed(self.wo.z) * (share * self.below(-self.in_world(self.wo)))
            }
            _ => Vec3::ZERO,
        }
    }

    /// Samples a direction on either side.
    ///
    /// - `wo`: that of the view, in world space; `u_lobe`: selects the technique; `u`: the direction.
    pub fn sample(&self, wo: Vec3, u_lobe: f32, u: Vec2) -> Option<BsdfSample> {
        let proposed = self.propose(u_lobe, u.to_array());
        if proposed.passes {
            return self.sample_transmission(wo, proposed.rest, u);
        }
        if !proposed.go_on {
            return None;
        }
        let (value, pdf) = self.eval_all(proposed.wi.into());
        self.weighted(&proposed, value.into(), pdf).reflected()
    }

    fn sample_transmission(&self, seen_from: Vec3, u_choice: f32, u: Vec2) -> Option<BsdfSample> {
        let transmission = self.of.transmission?;
        let pmf = self.pmf[3];
        let share = transmission.share / pmf;
        let specular = |probability: f32, wi: Vec3, weight: Vec3, passes: bool| {
            let through = passes.then(|| transmission.interface());
            let weight = weight * (share * self.below(wi));
            Some(BsdfSample { wi, weight, pdf: f32::INFINITY, probability: pmf * probability, through })
        };
        let wo = self.in_world(self.wo);
        match transmission.inside {
            Inside::Solid(interface) if self.of.is_transmission_rough() => {
                let found = self.rough_glass(interface).sample(u_choice, u)?;
                if !found.passes {
                    let (value, pdf) = self.eval_all(found.wi);
                    return (pdf > 0.0).then(|| BsdfSample {
                        wi: found.wi,
                        weight: value / pdf,
                        pdf,
                        probability: 1.0,
                        through: None,
                    });
                }
                let weight = transmission.tint * (found.weight * share * self.below(found.wi));
                let pdf = if transmission.is_lit { found.pdf * pmf } else { f32::INFINITY };
                Some(BsdfSample { wi: found.wi, weight, pdf, probability: 1.0, through: Some(interface) })
            }
            Inside::Solid(interface) => {
                let (reflectance, cos_t) = fresnel(self.wo.z.min(1.0), interface.eta);
                if u_choice < reflectance {
                    let wi = self.in_world(Vector3 { x: -self.wo.x, y: -self.wo.y, z: self.wo.z });
                    specular(reflectance, wi, Vec3::ONE, false)
                } else {
                    let wi = refract(wo.into(), self.axes[2], interface.eta, cos_t).into();
                    specular(
                        1.0 - reflectance,
                        wi,
                        transmission.tint * interface.radiance_eta * interface.radiance_eta,
                        true,
                    )
                }
            }
            Inside::Thin(_) if self.of.is_smooth() => {
                specular(1.0, -seen_from, transmission.tint * self.passed(self.wo.z), true)
            }
            Inside::Thin(_) => {
                let above = reflect(self.wo, sample_visible_normal(self.wo, self.of.alpha, u.to_array()));
                if above.z <= 0.0 {
                    return None;
                }
                let local = Vector3 { z: -above.z, ..above };
                let wi = self.in_world(local);
                let (value, pdf) = self.eval_through(&transmission, wi, local);
                let stated = if transmission.is_lit { pdf } else { f32::INFINITY };
                let through = Some(transmission.interface());
                (pdf > 0.0).then(|| BsdfSample { wi, weight: value / pdf, pdf: stated, probability: 1.0, through })
            }
        }
    }
}
