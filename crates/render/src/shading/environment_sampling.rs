//! Sampling of directions towards the environment: by its brightness, through portals, or both.

use crate::core::environment::EnvironmentSampler;
use crate::core::techniques::Techniques;
use crate::prepare::light::LightTable;
use crate::prepare::portals::Portals;
use crate::prepare::prepared::Prepared;
use firstlight_simd::{Float, Kernel, Mask, Real, Simd, Vector, Vector3, select, select_vector};
use glam::{Vec2, Vec3};

/// Share of directions through portals where the brightness is sampled as well.
const THROUGH_PORTALS: f32 = 0.5;

/// Least share of light samples for the environment and for the lights, where both can be seen: estimates know nothing
/// of what is in the way.
const LEAST: f32 = 0.125;

/// The techniques that sample the environment of a scene. Both have one pdf together, which [`Self::sample`] and
/// [`Self::pdf`] agree on.
#[derive(Clone, Copy)]
pub(crate) struct EnvironmentSampling<'a> {
    /// For environments that are not smooth.
    image: Option<&'a EnvironmentSampler>,
    portals: Option<&'a Portals>,
    lights: &'a LightTable,
}

impl<'a> EnvironmentSampling<'a> {
    /// Returns `None` if the environment is left to BSDF sampling.
    #[inline]
    pub fn of(scene: &'a Prepared, techniques: &Techniques) -> Option<Self> {
        let portals = scene.portals().filter(|_| techniques.portals);
        Self::with(scene, portals)
    }

    /// The same with these portals.
    #[inline]
    pub fn with(scene: &'a Prepared, portals: Option<&'a Portals>) -> Option<Self> {
        let image = scene.tables.environment_sampler.as_deref();
        (image.is_some() || portals.is_some()).then_some(Self { image, portals, lights: &scene.tables.lights })
    }

    /// Probability with which light sampling selects the environment rather than a finite light.
    ///
    /// - `normal`: as in [`Self::sample`].
    #[inline(always)]
    pub fn share<R: Real>(&self, position: Vector3<R>, normal: Vector3<R>) -> R {
        let one = position.x.all(1.0);
        if self.lights.is_empty() {
            return one;
        }
        let half = one.all(0.5);
        let Some(portals) = self.portals else { return half };
        let through = portals.estimate(position, normal);
        let Some(of_lights) = self.lights.selection.estimate(position, normal) else {
            return if self.image.is_some() { half } else { select(through.is_positive(), half, one.all(0.0)) };
        };
        let share = through / (through + of_lights);
        if self.image.is_some() {
            return select(through.is_positive(), share, half).at_least(LEAST).at_most(1.0 - LEAST);
        }
        let both = through.is_positive() & of_lights.is_positive();
        let alone = select(through.is_positive(), one, one.all(0.0));
        select(both, share.at_least(LEAST).at_most(1.0 - LEAST), alone)
    }

    /// Probability with which each technique is chosen: the brightness, and portals.
    #[inline(always)]
    fn shares(&self) -> [f32; 2] {
        match (self.image, self.portals) {
            (_, None) => [1.0, 0.0],
            (None, _) => [0.0, 1.0],
            _ => [1.0 - THROUGH_PORTALS, THROUGH_PORTALS],
        }
    }

    /// Samples a unit direction; returns it with its pdf per steradian.
    ///
    /// - `normal`: unit, of the side that is lit; zero if both sides are.
    /// - `u`: two independent uniform numbers in `[0, 1)`.
    #[inline]
    pub fn sample(&self, position: Vec3, normal: Vec3, mut u: Vec2) -> Option<(Vec3, f32)> {
        let (Some(portals), [_, share]) = (self.portals, self.shares()) else { return self.image?.sample(u) };
        let through = u.x < share;
        let wi = if through {
            u.x = (u.x / share).min(1.0f32.next_down());
            let (found, wi, _) = portals.sample(true, position.into(), normal.into(), u.into());
            found.then(|| wi.into())?
        } else {
            u.x = ((u.x - share) / (1.0 - share)).min(1.0f32.next_down());
            self.image?.sample(u)?.0
        };
        let pdf = self.pdf(position, normal, wi);
        (pdf > 0.0).then_some((wi, pdf))
    }

    /// Pdf of [`Self::sample`] for a unit direction, per steradian.
    #[inline]
    pub fn pdf(&self, position: Vec3, normal: Vec3, wi: Vec3) -> f32 {
        let [by_brightness, through] = self.shares();
        let of_image = self.image.map_or(0.0, |image| by_brightness * image.pdf(wi));
        self.portals
            .map_or(of_image, |portals| of_image + through * portals.pdf(position.into(), normal.into(), wi.into()))
    }

    /// Like [`Self::sample`], for the lanes of `mask`; returns also those that have a direction.
    #[inline(always)]
    pub fn sample_lanes<S: Simd>(
        &self,
        mask: Mask,
        position: Vector<S>,
        normal: Option<Vector<S>>,
        mut u: [Float<S>; 2],
    ) -> (Mask, Vector<S>, Float<S>) {
        let zero = u[0].all(0.0);
        let Some(portals) = self.portals else {
            return match self.image {
                Some(image) => image.sample_lanes(u),
                None => (0, position, zero),
            };
        };
        let normal = match normal {
            Some(normal) => normal,
            None => Vector::all(zero),
        };
        let [_, share] = self.shares();
        let through = mask & u[0].lt(zero.all(share));
        let (of_portals, of_image) = (u[0] / share, (u[0] - share) / (1.0 - share).max(f32::MIN_POSITIVE));
        u[0] = select(through, of_portals, of_image).at_least(0.0).at_most(1.0f32.next_down());
        let (mut found, mut wi, known) = zero.s.call(PortalSample { portals, mask: through, position, normal, u });
        if let Some(image) = self.image {
            let (seen, dir, _) = image.sample_lanes(u);
            wi = select_vector(through, wi, dir);
            found |= mask & seen & !through;
        }
        let pdf = match (known, self.image) {
            (Some(pdf), None) => pdf,
            _ => self.pdf_lanes(position, normal, wi),
        };
        (found & pdf.is_positive(), wi, pdf)
    }

    /// Like [`Self::pdf`].
    #[inline(always)]
    pub fn pdf_lanes<S: Simd>(&self, position: Vector<S>, normal: Vector<S>, wi: Vector<S>) -> Float<S> {
        let [by_brightness, through] = self.shares();
        let mut pdf = wi.x.all(0.0);
        if let Some(image) = self.image {
            pdf = image.pdf_lanes(wi) * by_brightness;
        }
        match self.portals {
            Some(portals) => pdf + wi.x.s.call(PortalPdf { portals, position, normal, wi }) * through,
            None => pdf,
        }
    }
}

/// Arguments of [`Portals::sample`], whose code is shared by all that sample lights.
struct PortalSample<'a, S: Simd> {
    portals: &'a Portals,
    mask: Mask,
    position: Vector<S>,
    normal: Vector<S>,
    u: [Float<S>; 2],
}

impl<S: Simd> Kernel<S> for PortalSample<'_, S> {
    type Output = (Mask, Vector<S>, Option<Float<S>>);

    #[inline(always)]
    fn run(self, _: S) -> Self::Output {
        self.portals.sample(self.mask, self.position, self.normal, self.u)
    }
}

/// Arguments of [`Portals::pdf`], likewise.
struct PortalPdf<'a, S: Simd> {
    portals: &'a Portals,
    position: Vector<S>,
    normal: Vector<S>,
    wi: Vector<S>,
}

impl<S: Simd> Kernel<S> for PortalPdf<'_, S> {
    type Output = Float<S>;

    #[inline(always)]
    fn run(self, _: S) -> Float<S> {
        self.portals.pdf(self.position, self.normal, self.wi)
    }
}

/// Probability with which light sampling selects the environment rather than the finite lights; see
/// [`EnvironmentSampling::share`].
#[inline(always)]
pub(crate) fn environment_share<R: Real>(
    scene: &Prepared,
    techniques: &Techniques,
    position: Vector3<R>,
    normal: Vector3<R>,
) -> R {
    match EnvironmentSampling::of(scene, techniques) {
        Some(sampling) => sampling.share(position, normal),
        None => position.x.all(0.0),
    }
}

/// Whether vertices sample lights.
#[inline]
pub(crate) fn samples_lights(scene: &Prepared, techniques: &Techniques) -> bool {
    let has_some = scene.tables.features.light_sampling || EnvironmentSampling::of(scene, techniques).is_some();
    techniques.light_sampling && has_some
}
