//! A layered surface seen along one direction.

use crate::core::color::luminance;
use crate::sampling::warp::{cosine_hemisphere, cosine_hemisphere_pdf};
use crate::shading::dielectric::{fresnel, reflect, refract};
use crate::shading::ggx::{anisotropic_distribution, anisotropic_lambda, sample_anisotropic_normal};
use crate::shading::interface::Interface;
use crate::shading::layer_albedo::{SchlickAlbedo, bounded_sheen, cosine_mean, hemisphere_mean, sheen_albedo};
use crate::shading::metal::{mean_reflectance, with_further_bounces};
use crate::shading::microfacets::Microfacets;
use crate::shading::principled::layers::{COAT_FACING, Inside, Principled, Transmission};
use crate::shading::rough_glass::RoughGlass;
use crate::shading::scatter::BsdfSample;
use firstlight_kdtree::geometry::Frame;
use glam::{Vec2, Vec3};

/// Lower limit of cosines with the normal.
const SMALLEST_COS: f32 = 1e-6;

/// The technique that samples a direction.
#[derive(Clone, Copy, PartialEq)]
enum Technique {
    /// Cosine-weighted, for the diffuse layer and the sheen.
    Cosine,
    /// Visible normals of the base.
    Reflection,
    /// Visible normals of the coat.
    Coat,
    Transmission,
}

const TECHNIQUES: [Technique; 4] = [Technique::Cosine, Technique::Reflection, Technique::Coat, Technique::Transmission];

/// Values that depend on the view direction.
pub(super) struct Seen<'a> {
    of: &'a Principled,
    /// Tangent, bitangent, and normal on the side of the viewer.
    frame: Frame,
    /// Direction to the viewer, in the frame.
    wo: Vec3,
    /// The coat, about its own normal.
    coat: Option<CoatSeen>,
    /// Transmittance of the sheen.
    past_sheen: f32,
    /// Transmittance of all layers towards the viewer.
    past_all: Vec3,
    /// Mean of `past_all` over all directions.
    mean_past_all: Vec3,
    /// Share of the light that reaches the metal.
    above_metal: f32,
    /// Factor that adds further bounces between microfacets of the metal.
    metal_gain: Vec3,
    /// Total over single-scattering transmittance of a rough pane.
    passed_again: Vec3,
    pmf: [f32; 4],
}

struct CoatSeen {
    frame: Frame,
    wo: Vec3,
    /// Transmittance of the coat.
    past: f32,
}

/// Evaluates GGX microfacets for two directions above them, both in the frame: half vector, value and pdf.
fn reflection(wo: Vec3, wi: Vec3, alpha: [f32; 2]) -> (Vec3, f32, f32) {
    let half = (wo + wi).normalize();
    let masking = 1.0 + anisotropic_lambda(wo.into(), alpha);
    let both = masking + anisotropic_lambda(wi.into(), alpha);
    let per_area = anisotropic_distribution(half.into(), alpha) / (4.0 * wo.z);
    (half, per_area / both, per_area / masking)
}

fn schlick(facing: Vec3, grazing: Vec3, cos: f32) -> Vec3 {
    facing.lerp(grazing, (1.0 - cos).clamp(0.0, 1.0).powi(5))
}

fn mirrored(wo: Vec3, normal: Vec3) -> Vec3 {
    reflect(wo.into(), normal.into()).into()
}

impl<'a> Seen<'a> {
    /// Prepares a surface for a view direction; `None` if it is seen from inside and not transmissive.
    ///
    /// - `normal`: unit; `wo`: unit, on its side, or beyond it for transmitted light.
    pub fn new(of: &'a Principled, wo: Vec3, normal: Vec3) -> Option<Self> {
        if normal.dot(wo) <= 0.0 {
            return None;
        }
        let tangent = of.tangent.map(|t| t - normal.dot(t) * normal).and_then(Vec3::try_normalize);
        let frame = match tangent {
            Some(x) => Frame { x, y: normal.cross(x), z: normal },
            None => Frame::around(normal),
        };
        let mut local = frame.to_local(wo);
        local.z = local.z.max(SMALLEST_COS);
        let coat = of.has_coat().then(|| {
            // A coat normal that faces away is replaced by that of the base.
            let normal = if of.coat_normal.dot(wo) > 0.0 { of.coat_normal } else { normal };
            let frame = Frame::around(normal);
            let mut wo = frame.to_local(wo);
            wo.z = wo.z.max(SMALLEST_COS);
            CoatSeen { frame, wo, past: past_coat(of, wo.z) }
        });
        let past_coat = coat.as_ref().map_or(1.0, |coat| coat.past);
        let past_sheen = past_sheen(of, local.z);
        let base = SchlickAlbedo::along(local, of.alpha);
        let reflected = of.dielectric_albedo(base);
        let past_all = past_coat * past_sheen * (Vec3::ONE - reflected).max(Vec3::ZERO);
        let is_diffuse = of.diffuse != Vec3::ZERO;
        let mean_past_all = if is_diffuse { mean_past_all(of) } else { Vec3::ONE };
        let metal_gain = if of.metallic > 0.0 && !of.is_smooth() { metal_gain(of, base) } else { Vec3::ONE };
        let upper = past_coat * past_sheen;
        let metal = (of.metal * base.facing + Vec3::splat(base.grazing)) * metal_gain;
        let transmitted = of.transmission.map_or(0.0, |transmission| match transmission.inside {
            Inside::Solid(_) => transmission.share,
            Inside::Thin(_) => transmission.share * luminance(transmission.tint * (Vec3::ONE - reflected)),
        });
        // All light that is not reflected is transmitted (as in Turquin 2019 for metals).
        let once = Vec3::splat(base.whole()) - reflected;
        let passed_again = (Vec3::ONE - reflected) / once.max(Vec3::splat(1e-3));
        let sheen = luminance(of.sheen);
        let strength = [
            luminance(of.diffuse * past_all)
                + if sheen > 0.0 { past_coat * sheen * sheen_albedo(local.z, of.sheen_alpha) } else { 0.0 },
            upper * luminance(of.dielectric * reflected + of.metallic * metal),
            1.0 - past_coat,
            upper * transmitted,
        ];
        let sum: f32 = strength.iter().sum();
        if sum.is_nan() || sum <= 0.0 {
            return None;
        }
        let pmf = strength.map(|one| one / sum);
        Some(Self {
            of,
            frame,
            wo: local,
            coat,
            past_sheen,
            past_all,
            mean_past_all,
            above_metal: upper,
            metal_gain,
            passed_again,
            pmf,
        })
    }

    /// Transmittance of the coat for light from one direction to the viewer.
    fn below_coat(&self, wi: Vec3) -> f32 {
        let Some(coat) = &self.coat else { return 1.0 };
        coat.past.min(past_coat(self.of, coat.frame.z.dot(wi).abs()))
    }

    /// f · |cos| and pdf of all non-specular layers. `wi`: unit, in world space.
    pub fn eval(&self, wi: Vec3) -> (Vec3, f32) {
        let Some(surface) = self.of.true_normal else { return self.eval_layers(wi) };
        if surface.dot(wi) <= 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        let (straight, mirrored) = (self.eval_layers(wi), self.eval_layers(wi - 2.0 * surface.dot(wi) * surface));
        (straight.0 + mirrored.0, straight.1 + mirrored.1)
    }

    /// [`Self::eval`] without the light that is mirrored at the true surface.
    fn eval_layers(&self, wi: Vec3) -> (Vec3, f32) {
        let of = self.of;
        let local = self.frame.to_local(wi);
        if local.z < 0.0 {
            return match of.transmission.filter(|t| t.is_lit && of.is_transmission_rough()) {
                Some(transmission) => self.eval_through(&transmission, wi, local),
                None => (Vec3::ZERO, 0.0),
            };
        }
        if local.z == 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        let below_coat = self.below_coat(wi);
        let past_sheen_i = past_sheen(of, local.z);
        let below = below_coat * self.past_sheen.min(past_sheen_i);
        let (mut value, mut pdf) = (Vec3::ZERO, 0.0);
        if self.pmf[0] > 0.0 {
            let cosine = cosine_hemisphere_pdf(local.z);
            pdf += self.pmf[0] * cosine;
            if of.diffuse != Vec3::ZERO {
                let reflected = of.dielectric_albedo(SchlickAlbedo::along(local, of.alpha));
                let coat = self.coat.as_ref().map_or(1.0, |coat| past_coat(of, coat.frame.z.dot(wi).abs()));
                let past_all_i = coat * past_sheen_i * (Vec3::ONE - reflected).max(Vec3::ZERO);
                value += of.diffuse * cosine * self.past_all * past_all_i / self.mean_past_all;
            }
            if of.sheen != Vec3::ZERO {
                let half = (self.wo + local).normalize();
                let sheen = bounded_sheen(self.wo.z, local.z, half.z, of.sheen_alpha);
                value += of.sheen * (below_coat * sheen * local.z);
            }
        }
        if self.pmf[1] > 0.0 && !of.is_smooth() {
            let (half, f, density) = reflection(self.wo, local, of.alpha);
            value += self.tint(self.wo.dot(half), below) * f;
            pdf += self.pmf[1] * density;
        }
        if let Some(coat) = self.coat.as_ref().filter(|_| !of.is_coat_smooth()) {
            let local = coat.frame.to_local(wi);
            if local.z > 0.0 {
                let (half, f, density) = reflection(coat.wo, local, [of.coat_alpha; 2]);
                let tint = schlick(Vec3::splat(COAT_FACING), Vec3::ONE, coat.wo.dot(half));
                value += tint * (of.coat * f);
                pdf += self.pmf[2] * density;
            }
        }
        if let Some(transmission) = of.transmission.filter(|_| self.pmf[3] > 0.0 && of.is_transmission_rough())
            && let Inside::Solid(interface) = transmission.inside
        {
            let (f, density) = self.rough_glass(interface).eval(wi);
            value += Vec3::splat(transmission.share * below * f);
            pdf += self.pmf[3] * density;
        }
        (value, pdf)
    }

    fn rough_glass(&self, interface: Interface) -> RoughGlass {
        let wo = self.frame.to_world(self.wo).normalize();
        let facets = Microfacets::isotropic(self.of.mean_alpha().min(1.0), false);
        RoughGlass::new(self.frame.z, wo, facets, interface, true)
    }

    /// Light from the far side, if transmission is rough.
    fn eval_through(&self, transmission: &Transmission, wi: Vec3, local: Vec3) -> (Vec3, f32) {
        let above = Vec3::new(local.x, local.y, -local.z);
        let below = self.below_coat(wi) * self.past_sheen.min(past_sheen(self.of, above.z));
        let (f, density) = match transmission.inside {
            Inside::Solid(interface) => {
                let (f, density) = self.rough_glass(interface).eval(wi);
                (Vec3::splat(f), density)
            }
            // The reflected lobe on the far side.
            Inside::Thin(_) => {
                let (half, f, density) = reflection(self.wo, above, self.of.alpha);
                (f * self.passed(self.wo.dot(half)) * self.passed_again, density)
            }
        };
        (transmission.tint * (transmission.share * below) * f, self.pmf[3] * density)
    }

    /// Reflectance of the base below the upper layers, at an angle with its microfacets.
    ///
    /// - `below`: transmittance of the upper layers for both directions; for metal that of the viewer counts, so that
    ///   a white one returns all light.
    fn tint(&self, cos: f32, below: f32) -> Vec3 {
        let of = self.of;
        let dielectric = of.dielectric * below * schlick(of.facing, of.grazing, cos);
        if of.metallic == 0.0 {
            return dielectric;
        }
        let metal = schlick(of.metal, Vec3::ONE, cos) * self.metal_gain;
        dielectric + of.metallic * self.above_metal * metal
    }

    /// Transmittance of a thin pane at an angle.
    fn passed(&self, cos: f32) -> Vec3 {
        (Vec3::ONE - schlick(self.of.facing, self.of.grazing, cos)).max(Vec3::ZERO)
    }

    /// - `u_lobe`: selects the technique; `u`: the direction.
    pub fn sample(&self, u_lobe: f32, u: Vec2) -> Option<BsdfSample> {
        let mut rest = u_lobe;
        let chosen = (0..4)
            .find(|&k| {
                let here = rest < self.pmf[k];
                if !here {
                    rest -= self.pmf[k];
                }
                here
            })
            .or_else(|| (0..4).rev().find(|&k| self.pmf[k] > 0.0))?;
        let pmf = self.pmf[chosen];
        let fresh = (rest / pmf).clamp(0.0, 1.0f32.next_down());
        match TECHNIQUES[chosen] {
            Technique::Cosine => {
                let local: Vec3 = cosine_hemisphere(u.to_array()).into();
                self.reflected(local, &self.frame)
            }
            Technique::Reflection => self.sample_reflection(u, pmf),
            Technique::Coat => self.sample_coat(u, pmf),
            Technique::Transmission => self.sample_transmission(fresh, u, pmf),
        }
    }

    /// A reflected direction, mirrored at the true surface if it is below.
    fn above_surface(&self, wi: Vec3) -> Vec3 {
        match self.of.true_normal {
            Some(surface) if surface.dot(wi) < 0.0 => wi - 2.0 * surface.dot(wi) * surface,
            _ => wi,
        }
    }

    /// All non-specular layers could have sampled this direction: one-sample estimate over their mixture.
    fn reflected(&self, local: Vec3, frame: &Frame) -> Option<BsdfSample> {
        if local.z <= 0.0 {
            return None;
        }
        let wi = self.above_surface(frame.to_world(local).normalize());
        let (value, pdf) = self.eval(wi);
        (pdf > 0.0).then(|| BsdfSample { wi, weight: value / pdf, pdf, probability: 1.0, through: None })
    }

    fn sample_reflection(&self, u: Vec2, pmf: f32) -> Option<BsdfSample> {
        if self.of.is_smooth() {
            let wi = self.above_surface(self.frame.to_world(mirrored(self.wo, Vec3::Z)).normalize());
            let below = self.below_coat(wi) * self.past_sheen;
            let weight = self.tint(self.wo.z, below) / pmf;
            return Some(BsdfSample { wi, weight, pdf: f32::INFINITY, probability: pmf, through: None });
        }
        let half: Vec3 = sample_anisotropic_normal(self.wo.into(), self.of.alpha, u.to_array()).into();
        self.reflected(mirrored(self.wo, half), &self.frame)
    }

    fn sample_coat(&self, u: Vec2, pmf: f32) -> Option<BsdfSample> {
        let coat = self.coat.as_ref()?;
        if self.of.is_coat_smooth() {
            let wi = self.above_surface(coat.frame.to_world(mirrored(coat.wo, Vec3::Z)).normalize());
            let tint = schlick(Vec3::splat(COAT_FACING), Vec3::ONE, coat.wo.z);
            let weight = tint * (self.of.coat / pmf);
            return Some(BsdfSample { wi, weight, pdf: f32::INFINITY, probability: pmf, through: None });
        }
        let half: Vec3 = sample_anisotropic_normal(coat.wo.into(), [self.of.coat_alpha; 2], u.to_array()).into();
        let local = mirrored(coat.wo, half);
        if local.z <= 0.0 || self.frame.z.dot(coat.frame.to_world(local)) <= 0.0 {
            return None;
        }
        self.reflected(local, &coat.frame)
    }

    fn sample_transmission(&self, u_choice: f32, u: Vec2, pmf: f32) -> Option<BsdfSample> {
        let transmission = self.of.transmission?;
        let share = transmission.share / pmf;
        let below = |wi: Vec3| {
            let cos = self.frame.z.dot(wi).abs();
            self.below_coat(wi) * self.past_sheen.min(past_sheen(self.of, cos))
        };
        let specular = |probability: f32, wi: Vec3, weight: Vec3, passes: bool| {
            let through = passes.then(|| transmission.interface());
            let weight = weight * (share * below(wi));
            Some(BsdfSample { wi, weight, pdf: f32::INFINITY, probability: pmf * probability, through })
        };
        let wo = self.frame.to_world(self.wo).normalize();
        match transmission.inside {
            Inside::Solid(interface) if self.of.is_transmission_rough() => {
                let found = self.rough_glass(interface).sample(u_choice, u)?;
                if !found.passes {
                    let (value, pdf) = self.eval(found.wi);
                    return (pdf > 0.0).then(|| BsdfSample {
                        wi: found.wi,
                        weight: value / pdf,
                        pdf,
                        probability: 1.0,
                        through: None,
                    });
                }
                let weight = transmission.tint * (found.weight * share * below(found.wi));
                let pdf = if transmission.is_lit { found.pdf * pmf } else { f32::INFINITY };
                Some(BsdfSample { wi: found.wi, weight, pdf, probability: 1.0, through: Some(interface) })
            }
            Inside::Solid(interface) => {
                let (reflectance, cos_t) = fresnel(self.wo.z.min(1.0), interface.eta);
                if u_choice < reflectance {
                    let wi = self.frame.to_world(mirrored(self.wo, Vec3::Z)).normalize();
                    specular(reflectance, wi, Vec3::ONE, false)
                } else {
                    let wi = refract(wo.into(), self.frame.z.into(), interface.eta, cos_t).into();
                    specular(
                        1.0 - reflectance,
                        wi,
                        transmission.tint * interface.radiance_eta * interface.radiance_eta,
                        true,
                    )
                }
            }
            Inside::Thin(_) if self.of.is_smooth() => {
                specular(1.0, -wo, transmission.tint * self.passed(self.wo.z), true)
            }
            Inside::Thin(_) => {
                let half: Vec3 = sample_anisotropic_normal(self.wo.into(), self.of.alpha, u.to_array()).into();
                let above = mirrored(self.wo, half);
                if above.z <= 0.0 {
                    return None;
                }
                let local = Vec3::new(above.x, above.y, -above.z);
                let wi = self.frame.to_world(local).normalize();
                let (value, pdf) = self.eval_through(&transmission, wi, local);
                let stated = if transmission.is_lit { pdf } else { f32::INFINITY };
                let through = Some(transmission.interface());
                (pdf > 0.0).then(|| BsdfSample { wi, weight: value / pdf, pdf: stated, probability: 1.0, through })
            }
        }
    }
}

/// Transmittance of the coat at an angle.
fn past_coat(of: &Principled, cos: f32) -> f32 {
    let albedo = SchlickAlbedo::new(cos, of.coat_alpha);
    1.0 - of.coat * (COAT_FACING * albedo.facing + albedo.grazing)
}

/// Transmittance of the sheen at an angle.
fn past_sheen(of: &Principled, cos: f32) -> f32 {
    if of.sheen == Vec3::ZERO {
        return 1.0;
    }
    (1.0 - of.sheen.max_element() * sheen_albedo(cos, of.sheen_alpha)).max(0.0)
}

/// Factor of single scattering that adds further bounces between the microfacets of a metal.
///
/// - `base`: albedo of the microfacets in the direction of the viewer.
fn metal_gain(of: &Principled, base: SchlickAlbedo) -> Vec3 {
    let [x, y] = of.alpha;
    let alpha = if x == y { x } else { (0.5 * (x * x + y * y)).sqrt() };
    let returned = base.whole();
    with_further_bounces(mean_reflectance(true, of.metal.into()), (1.0 - returned) / returned, alpha).into()
}

/// Mean transmittance of all layers over all directions; not 0.
fn mean_past_all(of: &Principled) -> Vec3 {
    let least = Vec3::splat(1e-6);
    if !of.has_coat() && of.sheen == Vec3::ZERO {
        return (Vec3::ONE - of.dielectric_albedo(SchlickAlbedo::mean(of.alpha))).max(least);
    }
    let past = |w: Vec3, k: usize| {
        let coat = if of.has_coat() { past_coat(of, w.z) } else { 1.0 };
        let reflected = of.dielectric_albedo(SchlickAlbedo::along(w, of.alpha));
        coat * past_sheen(of, w.z) * (1.0 - reflected[k]).max(0.0)
    };
    let is_isotropic = of.alpha[0] == of.alpha[1];
    let channel = |k: usize| {
        if is_isotropic {
            cosine_mean(|cos| past(Vec3::new(0.0, 0.0, cos), k))
        } else {
            hemisphere_mean(|w| past(w, k))
        }
    };
    Vec3::new(channel(0), channel(1), channel(2)).max(least)
}
