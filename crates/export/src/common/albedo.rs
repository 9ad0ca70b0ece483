//! How much light rough surfaces return, here and in other renderers, which lose what their microfacets scatter several
//! times. All of it is for light from everywhere, so that the brightness of a scene stays.
//!
//! Microfacets are those of GGX, integrated over visible normals (Dupuy and Benyoub 2023). Start reading at
//! [`Renderer::metal`] and [`Base`].

use firstlight_render::Fresnel;
use glam::{DVec3, Vec3};
use std::f64::consts::TAU;

/// Who reads the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Renderer {
    Mitsuba,
    Pbrt,
}

/// Cosines of directions, uniform in their squares; intervals of cosines with microfacets; normals per axis.
const N_DIRECTIONS: usize = 16;
const N_COS: usize = 256;
const N_NORMALS: usize = 16;

/// GGX widths below these are mirrors.
const SMOOTH: f64 = 1e-4;

/// The share of light from everywhere that microfacets return in one bounce, by the cosine with their normals.
struct Returned {
    /// Height-correlated masking, which is ours and pbrt's, and that of Mitsuba: each direction by itself.
    correlated: [f64; N_COS],
    separable: [f64; N_COS],
    /// `correlated`, times lost over returned light of each direction.
    lost: [f64; N_COS],
    /// The factor of all further bounces, see `with_further_bounces` of the renderer.
    again: f64,
}

impl Returned {
    fn new(alpha: f64) -> Self {
        let again = (alpha * 0.11 + 0.28) * alpha + 0.05;
        if alpha < SMOOTH {
            let mirror = std::array::from_fn(|i| 2.0 * middle(i) / N_COS as f64);
            return Self { correlated: mirror, separable: mirror, lost: [0.0; N_COS], again };
        }
        let [mut correlated, mut separable, mut lost] = [[0.0; N_COS]; 3];
        for wo in directions() {
            let mut bounced = Vec::with_capacity(N_NORMALS * N_NORMALS);
            for half in visible_normals(wo, alpha) {
                let cos = half.dot(wo);
                let wi = 2.0 * cos * half - wo;
                if wi.z > 0.0 {
                    let place = ((cos * N_COS as f64) as usize).min(N_COS - 1);
                    bounced.push((place, [true, false].map(|both| shadowing(wo, wi, alpha, both) / normals())));
                }
            }
            let returned: f64 = bounced.iter().map(|(_, [both, _])| both).sum();
            for (place, shares) in bounced {
                let [both, single] = shares.map(|share| share / N_DIRECTIONS as f64);
                correlated[place] += both;
                separable[place] += single;
                lost[place] += both * (1.0 - returned) / returned;
            }
        }
        Self { correlated, separable, lost, again }
    }

    /// What a renderer returns, by the Fresnel term at a cosine.
    fn in_renderer(&self, renderer: Renderer, fresnel: impl Fn(f64) -> f64) -> f64 {
        let shares = if renderer == Renderer::Mitsuba { &self.separable } else { &self.correlated };
        sum(shares, fresnel)
    }

    /// What a compensated metal returns here.
    ///
    /// - `mean`: of its reflectance over all directions.
    fn compensated(&self, fresnel: impl Fn(f64) -> f64, mean: f64) -> f64 {
        let further = mean * (1.0 - self.again) / (1.0 - mean * self.again);
        sum(&self.correlated, &fresnel) + further * sum(&self.lost, &fresnel)
    }
}

fn middle(i: usize) -> f64 {
    (i as f64 + 0.5) / N_COS as f64
}

fn sum(shares: &[f64; N_COS], fresnel: impl Fn(f64) -> f64) -> f64 {
    shares.iter().enumerate().map(|(i, share)| share * fresnel(middle(i))).sum()
}

fn normals() -> f64 {
    (N_NORMALS * N_NORMALS) as f64
}

/// Directions of uniform light.
fn directions() -> impl Iterator<Item = DVec3> {
    (0..N_DIRECTIONS).map(|i| {
        let square = (i as f64 + 0.5) / N_DIRECTIONS as f64;
        DVec3::new((1.0 - square).sqrt(), 0.0, square.sqrt())
    })
}

/// Normals of microfacets that `wo` can see, as often as it sees them.
fn visible_normals(wo: DVec3, alpha: f64) -> impl Iterator<Item = DVec3> {
    let stretch = DVec3::new(alpha, alpha, 1.0);
    let wo = (wo * stretch).normalize();
    let at = |i: usize| (i as f64 + 0.5) / N_NORMALS as f64;
    (0..N_NORMALS * N_NORMALS).map(move |i| {
        let z = (1.0 - at(i / N_NORMALS)) * (1.0 + wo.z) - wo.z;
        let (sin, cos) = (TAU * at(i % N_NORMALS)).sin_cos();
        let radius = (1.0 - z * z).max(0.0).sqrt();
        ((DVec3::new(radius * cos, radius * sin, z) + wo) * stretch).normalize()
    })
}

/// The share of light from a visible normal that is not hidden on its way out.
///
/// - `both`: height-correlated masking; else each direction by itself.
fn shadowing(wo: DVec3, wi: DVec3, alpha: f64, both: bool) -> f64 {
    let lambda = |w: DVec3| 0.5 * ((1.0 + alpha * alpha * (w.x * w.x + w.y * w.y) / (w.z * w.z)).sqrt() - 1.0);
    let (from, to) = (if both { lambda(wo) } else { 0.0 }, lambda(wi));
    (1.0 + from) / (1.0 + from + to)
}

/// Reflectance by that at normal incidence and at grazing angles.
fn schlick(facing: f64, grazing: f64, cos: f64) -> f64 {
    facing + (grazing - facing) * (1.0 - cos).powi(5)
}

/// Reflectance of a dielectric; `eta`: index on the far side over that on the near side.
fn dielectric(cos: f64, eta: f64) -> f64 {
    let sin2 = (1.0 - cos * cos) / (eta * eta);
    if sin2 >= 1.0 {
        return 1.0;
    }
    let far = (1.0 - sin2).sqrt();
    let (s, p) = ((cos - eta * far) / (cos + eta * far), (eta * cos - far) / (eta * cos + far));
    0.5 * (s * s + p * p)
}

/// Reflectance of a conductor of pbrt by that at normal incidence, below 1: its index is 1.
fn conductor(cos: f64, facing: f64) -> f64 {
    let k2 = 4.0 * facing / (1.0 - facing);
    let real = cos * cos - k2;
    let square = (real * real + 4.0 * k2).sqrt();
    let twice = 2.0 * (0.5 * (square + real)).max(0.0).sqrt() * cos;
    let (cos2, sin2) = (cos * cos, 1.0 - cos * cos);
    let share = |sum: f64, twice: f64| if sum + twice > 0.0 { (sum - twice) / (sum + twice) } else { 1.0 };
    let s = share(square + cos2, twice);
    0.5 * s * (1.0 + share(square * cos2 + sin2 * sin2, twice * sin2))
}

/// The reflectance of pbrt's conductors is at most this.
const MOST: f64 = 0.9999;

impl Renderer {
    /// The reflectance at normal incidence of a metal that returns a share of uniform light there. Above 1 in Mitsuba
    /// if its microfacets lose more than that; in pbrt no more than it has.
    fn facing(self, returned: &Returned, fresnel: Fresnel, wanted: f64) -> f64 {
        let there = |facing: f64| {
            returned.in_renderer(self, |cos| match (self, fresnel) {
                (Self::Pbrt, _) => conductor(cos, facing),
                (Self::Mitsuba, Fresnel::Schlick) => schlick(facing, 1.0, cos),
                (Self::Mitsuba, Fresnel::Constant) => facing,
            })
        };
        if self == Self::Mitsuba {
            // It is linear.
            let (none, all) = (there(0.0), there(1.0));
            return ((wanted - none) / (all - none)).max(0.0);
        }
        let (mut low, mut high) = (0.0, MOST);
        // To the precision of a colour.
        for _ in 0..24 {
            let facing = 0.5 * (low + high);
            if there(facing) < wanted { low = facing } else { high = facing }
        }
        0.5 * (low + high)
    }

    /// From this reflectance on, a metal cannot be brighter.
    pub(crate) fn most_of_metal(self) -> f32 {
        if self == Self::Mitsuba { f32::INFINITY } else { 0.9998 }
    }

    /// The reflectance at normal incidence with which a metal returns as much uniform light as a compensated one here.
    ///
    /// - `alpha`: GGX width; `color`: reflectance at normal incidence.
    pub(crate) fn metal(self, alpha: f32, fresnel: Fresnel, color: Vec3) -> Vec3 {
        let returned = Returned::new(alpha.into());
        color.map(|color| {
            let color = f64::from(color.clamp(0.0, 1.0));
            let wanted = match fresnel {
                Fresnel::Schlick => returned.compensated(|cos| schlick(color, 1.0, cos), color + (1.0 - color) / 21.0),
                Fresnel::Constant => returned.compensated(|_| color, color),
            };
            self.facing(&returned, fresnel, wanted) as f32
        })
    }
}

/// A diffuse surface below a dielectric one, the opaque base of `principled`: of uniform light it returns the share E
/// that its microfacets reflect, and the albedo times the rest.
pub(crate) struct Base {
    renderer: Renderer,
    alpha: f64,
    returned: Returned,
    /// E.
    reflected: f64,
}

/// A share of metal, and what is diffuse otherwise.
pub(crate) struct Metallic {
    pub share: f32,
    /// Reflectance of the metal at normal incidence.
    pub metal: f32,
    /// Factor of the albedo.
    pub diffuse: f32,
}

impl Base {
    /// - `alpha`: GGX width; `facing`, `grazing`: reflectance at normal incidence and at grazing angles.
    pub(crate) fn new(renderer: Renderer, alpha: f32, facing: f32, grazing: f32) -> Self {
        let returned = Returned::new(alpha.into());
        let reflected = sum(&returned.correlated, |cos| schlick(facing.into(), grazing.into(), cos));
        Self { renderer, alpha: alpha.into(), returned, reflected }
    }

    /// The albedo below a coat with which a plastic returns as much.
    pub(crate) fn below_coat(&self, ior: f32, albedo: Vec3) -> Vec3 {
        let coat = Coat::new(self.renderer, self.alpha, ior.into(), &self.returned);
        let reflected = self.returned.in_renderer(self.renderer, |cos| dielectric(cos, ior.into()));
        let diffuse = (albedo.as_dvec3() * (1.0 - self.reflected) + self.reflected - reflected) / coat.passed_twice;
        diffuse.max(DVec3::ZERO).as_vec3()
    }

    /// A mixture of a metal and a diffuse surface that returns as much, from each direction within some hundredths:
    /// the metal reflects the more light at grazing angles, the more of it there is, and what is diffuse is all the
    /// brighter.
    ///
    /// - `most`: the largest albedo, per channel and texel.
    pub(crate) fn metallic(&self, most: f32) -> Metallic {
        let passed = 1.0 - self.reflected;
        let white = match self.renderer {
            // It may reflect more than all light.
            Renderer::Mitsuba => 1.0,
            Renderer::Pbrt => self.returned.in_renderer(self.renderer, |cos| conductor(cos, MOST)),
        };
        let share = (1.0 - f64::from(most) * passed).clamp((self.reflected / white).min(1.0), 1.0);
        let metal = self.renderer.facing(&self.returned, Fresnel::Schlick, self.reflected / share);
        let rest = 1.0 - share;
        let diffuse = if rest > 0.0 { (passed / rest).min(1.0 / f64::from(most)) } else { 1.0 };
        Metallic { share: share as f32, metal: metal as f32, diffuse: diffuse as f32 }
    }
}

/// What a rough coat transmits.
struct Coat {
    /// Of uniform light, in and out again, with all reflections between the coat and a white base.
    passed_twice: f64,
}

impl Coat {
    fn new(renderer: Renderer, alpha: f64, ior: f64, returned: &Returned) -> Self {
        let both = renderer == Renderer::Pbrt;
        let of_direction = |wo: DVec3| {
            let through = visible_normals(wo, alpha).map(|half| {
                let cos = half.dot(wo);
                let far = (1.0 - (1.0 - cos * cos) / (ior * ior)).max(0.0).sqrt();
                let wi = (cos / ior - far) * half - wo / ior;
                if wi.z < 0.0 { (1.0 - dielectric(cos, ior)) * shadowing(wo, wi, alpha, both) } else { 0.0 }
            });
            through.sum::<f64>() / normals()
        };
        let passed = match alpha < SMOOTH {
            true => 1.0 - returned.in_renderer(renderer, |cos| dielectric(cos, ior)),
            false => directions().map(of_direction).sum::<f64>() / N_DIRECTIONS as f64,
        };
        let inwards = sum(&returned.correlated, |cos| dielectric(cos, 1.0 / ior));
        // Its mean over 64 cosines from 0 to 1 counts as many intervals, one too many.
        let inwards = if renderer == Renderer::Mitsuba { inwards * 63.0 / 64.0 } else { inwards };
        Self { passed_twice: passed * passed / (ior * ior * (1.0 - inwards)) }
    }
}

/// The share of uniform light inside of a dielectric that its rough surface reflects back.
pub(crate) fn inner_reflectance(ior: f32, alpha: f32) -> f32 {
    sum(&Returned::new(alpha.into()).correlated, |cos| dielectric(cos, 1.0 / f64::from(ior))) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn glass_reflects_most_of_the_light_inside() {
        // Duderstadt's value for 1.5 is 0.596; a surface that is none reflects nothing.
        assert!((inner_reflectance(1.5, 0.0) - 0.5963).abs() < 1e-3, "{}", inner_reflectance(1.5, 0.0));
        assert!(inner_reflectance(1.0, 0.0).abs() < 1e-6);
    }
    /// A quarter of the light is lost at this width; firstlight returns it, and others have to be brighter.
    #[test]
    fn brighter_metals_make_up_for_what_is_lost() {
        let returned = Returned::new(0.49);
        assert!((returned.compensated(|_| 1.0, 1.0) - 1.0).abs() < 1e-9, "white returns all light");
        for renderer in [Renderer::Mitsuba, Renderer::Pbrt] {
            let once = returned.in_renderer(renderer, |_| 1.0);
            assert!((0.68..0.78).contains(&once), "{renderer:?}: {once}");
            for color in [0.05, 0.2, 0.6] {
                let metal = f64::from(renderer.metal(0.49, Fresnel::Constant, Vec3::splat(color)).x);
                let found = returned.in_renderer(renderer, |cos| match renderer {
                    Renderer::Mitsuba => metal,
                    Renderer::Pbrt => conductor(cos, metal),
                });
                let wanted = returned.compensated(|_| color.into(), color.into());
                assert!((found - wanted).abs() < 1e-6, "{renderer:?}, {color}: {found} for {wanted}");
            }
        }
        assert!(Renderer::Mitsuba.metal(1.0, Fresnel::Schlick, Vec3::splat(0.95)).x > 2.0);
        assert!(Renderer::Pbrt.metal(1.0, Fresnel::Schlick, Vec3::splat(0.95)).x >= Renderer::Pbrt.most_of_metal());
    }

    /// Both ways to write a base return what it returns: E + albedo (1 − E).
    #[test]
    fn bases_are_as_bright_as_they_were() {
        for (renderer, alpha, albedo) in [Renderer::Mitsuba, Renderer::Pbrt]
            .into_iter()
            .flat_map(|it| [0.1, 0.5, 1.0].map(|alpha| (it, alpha)))
            .flat_map(|(it, alpha)| [0.0, 0.3, 0.9].map(|albedo| (it, alpha, albedo)))
        {
            let base = Base::new(renderer, alpha, 0.04, 1.0);
            let wanted = base.reflected + f64::from(albedo) * (1.0 - base.reflected);
            let Metallic { share, metal, diffuse } = base.metallic(albedo);
            let metal = base.returned.in_renderer(renderer, |cos| match renderer {
                Renderer::Mitsuba => schlick(metal.into(), 1.0, cos),
                Renderer::Pbrt => conductor(cos, metal.into()),
            });
            let found = f64::from(share) * metal + f64::from((1.0 - share) * diffuse * albedo);
            assert!((found - wanted).abs() < 5e-3, "{renderer:?}, α {alpha}, {albedo}: {found} for {wanted}");
            let coat = Coat::new(renderer, alpha.into(), 1.5, &base.returned);
            let reflected = base.returned.in_renderer(renderer, |cos| dielectric(cos, 1.5));
            let below = base.below_coat(1.5, Vec3::splat(albedo)).x;
            let found = reflected + f64::from(below) * coat.passed_twice;
            assert!((found - wanted).abs() < 0.01, "{renderer:?}, α {alpha}, {albedo}: {found} for {wanted}");
        }
    }
}
