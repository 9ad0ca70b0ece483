//! Microfacets by the distribution of their normals: GGX or Beckmann's, with one width or two.
//!
//! Beckmann's has no long tails: slopes are distributed normally, D = exp(−tan² θ / α²) / (π α² cos⁴ θ). For both, Λ and
//! the visible normals are exact, so that [`Reflection`] has the same formulas. All vectors are unit and in the shading
//! frame, with the normal along +z.

use crate::core::material::SMALLEST_ALPHA;
use crate::shading::dielectric::reflect;
use crate::shading::ggx;
use firstlight_simd::{Real, Truth, Vector3, frame_around, select, select_vector};
use std::f32::consts::PI;
use std::f64::consts::PI as PI_64;

/// Microfacets of a rough surface, at one point or sixteen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Microfacets<R: Real = f32> {
    /// Widths along x and y of the frame, dimensionless.
    pub alpha: [R; 2],
    /// Beckmann's distribution, otherwise GGX; its integrals are evaluated lane by lane.
    pub beckmann: R::Mask,
}

#[cfg(test)]
impl Microfacets {
    pub fn ggx(alpha: f32) -> Self {
        Self::isotropic(alpha, false)
    }
}

impl<R: Real> Microfacets<R> {
    /// With the same width in all directions.
    #[inline(always)]
    pub fn isotropic(alpha: R, beckmann: R::Mask) -> Self {
        Self { alpha: [alpha; 2], beckmann }
    }

    /// Whether the surface is a mirror.
    #[inline(always)]
    pub fn is_smooth(&self) -> R::Mask {
        let alpha = self.alpha[0].max(self.alpha[1]);
        alpha.lt(alpha.all(SMALLEST_ALPHA))
    }

    /// Neither width narrower than what `f32` resolves, unless both are.
    #[inline(always)]
    pub fn at_least_rough(self) -> Self {
        let ([x, y], smooth) = (self.alpha, self.is_smooth());
        let [wide_x, wide_y] = [x.at_least(SMALLEST_ALPHA), y.at_least(SMALLEST_ALPHA)];
        Self { alpha: [select(smooth, x, wide_x), select(smooth, y, wide_y)], ..self }
    }

    #[inline(always)]
    pub fn is_isotropic(&self) -> R::Mask {
        self.alpha[0].equals(self.alpha[1])
    }

    /// Distribution of normals D, per steradian.
    #[inline(always)]
    pub fn distribution(&self, h: Vector3<R>) -> R {
        let [ax, ay] = self.alpha;
        let mut found = ggx::distribution(h, ax);
        let elongated = !self.is_isotropic();
        if elongated.any() {
            found = select(elongated, ggx::anisotropic_distribution(h, self.alpha), found);
        }
        if self.beckmann.any() {
            let (x, y, cos2) = (h.x / (ax * h.z), h.y / (ay * h.z), h.z * h.z);
            let peak = h.z.all(1.0) / (ax * ay * cos2 * cos2 * PI);
            // Of vertical normals the peak is infinite, and the exponential has underflowed.
            let of_beckmann = R::each(self.beckmann, [x * x + y * y, peak], |[slope2, peak]| {
                if slope2 < -f32::MIN_POSITIVE.ln() { peak * (-slope2).exp() } else { 0.0 }
            });
            found = select(self.beckmann, of_beckmann, found);
        }
        found
    }

    /// Smith's Λ (Heitz 2014, "Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs").
    #[inline(always)]
    pub fn lambda(&self, w: Vector3<R>) -> R {
        let [ax, ay] = self.alpha;
        let mut found = ggx::lambda(w, ax);
        let elongated = !self.is_isotropic();
        if elongated.any() {
            found = select(elongated, ggx::anisotropic_lambda(w, self.alpha), found);
        }
        if self.beckmann.any() {
            let of_beckmann = R::each(self.beckmann, [ax * w.x, ay * w.y, w.z], lambda_of_beckmann);
            found = select(self.beckmann, of_beckmann, found);
        }
        found
    }

    /// Samples a normal among those visible from `wo`; see [`ggx::sample_visible_normal`].
    #[inline(always)]
    pub fn sample(&self, wo: Vector3<R>, u: [R; 2]) -> Vector3<R> {
        let normal = ggx::sample_visible_normal(wo, self.alpha, u);
        if !self.beckmann.any() {
            return normal;
        }
        let (one, zero) = (wo.z.all(1.0), wo.z.all(0.0));
        let [ax, ay] = self.alpha;
        let (x, y) = (ax * wo.x, ay * wo.y);
        let sin = (x * x + y * y).sqrt();
        let tilted = sin.is_positive();
        let (cos_phi, sin_phi) = (select(tilted, x / sin, one), select(tilted, y / sin, zero));
        // Only slopes along the view change how much of a microfacet is seen; those across are independent of it.
        let along = R::each(self.beckmann, [wo.z, sin, u[0]], visible_slope);
        let across = R::each(self.beckmann, [one, zero, u[1]], visible_slope);
        let slopes = [along * cos_phi - across * sin_phi, along * sin_phi + across * cos_phi];
        let of_beckmann = Vector3 { x: ax * slopes[0], y: ay * slopes[1], z: one }.normalize();
        select_vector(self.beckmann, of_beckmann, normal)
    }

    /// Evaluates the reflection of `wo` to `wi`, both above the surface; `lambda_o`: [`Self::lambda`] of `wo`.
    #[inline(always)]
    pub fn reflection(&self, wo: Vector3<R>, lambda_o: R, wi: Vector3<R>) -> Reflection<R> {
        let half = (wo + wi).normalize();
        let masking = lambda_o + 1.0;
        let both = masking + self.lambda(wi);
        let per_area = self.distribution(half) / (wo.z * 4.0);
        Reflection { half, value: per_area / both, pdf: per_area / masking, weight: masking / both }
    }
}

/// Reflection of `wo` to `wi` at visible normals.
pub(crate) struct Reflection<R> {
    /// The half vector, unit.
    pub half: Vector3<R>,
    /// f · cos of single scattering divided by the reflectance; height-correlated masking and shadowing (Heitz 2014,
    /// equation 99).
    pub value: R,
    /// Pdf per steradian of sampling `wi` by visible normals.
    pub pdf: R,
    /// f · cos / pdf divided by the reflectance: G2 / G1.
    pub weight: R,
}

/// Microfacets seen along one direction.
#[derive(Clone, Copy)]
pub(crate) struct SeenMicrofacets<R: Real> {
    facets: Microfacets<R>,
    /// Shading frame in world space; the last axis is the normal.
    axes: [Vector3<R>; 3],
    /// Direction to the viewer in the frame.
    wo: Vector3<R>,
    lambda_o: R,
}

impl<R: Real> SeenMicrofacets<R> {
    /// - `normal`: unit; `tangent`: direction of the first width, in world space; any of isotropic ones.
    #[inline(always)]
    pub fn new(facets: Microfacets<R>, normal: Vector3<R>, tangent: Option<Vector3<R>>, wo: Vector3<R>) -> Self {
        let mut axes = frame_around(normal);
        if let Some(tangent) = tangent {
            let elongated = !facets.is_isotropic();
            let x = (tangent - normal * normal.dot(tangent)).normalize_or(axes[0]);
            axes = [select_vector(elongated, x, axes[0]), select_vector(elongated, normal.cross(x), axes[1]), normal];
        }
        let wo = wo.to_local(&axes);
        Self { facets, axes, wo, lambda_o: facets.lambda(wo) }
    }

    /// Whether the normal faces the viewer.
    #[inline(always)]
    pub fn facing(&self) -> R::Mask {
        self.wo.z.is_positive()
    }

    /// Direction to the viewer, in the frame.
    #[inline(always)]
    pub fn wo(&self) -> Vector3<R> {
        self.wo
    }

    /// Samples a direction; returns it in the frame; it may lie below the surface.
    #[inline(always)]
    pub fn sample(&self, u: [R; 2]) -> Vector3<R> {
        let smooth = self.facets.is_smooth();
        let zero = self.wo.z.all(0.0);
        let up = Vector3 { x: zero, y: zero, z: zero + 1.0 };
        reflect(self.wo, select_vector(smooth, up, self.facets.sample(self.wo, u)))
    }

    #[inline(always)]
    pub fn local(&self, wi: Vector3<R>) -> Vector3<R> {
        wi.to_local(&self.axes)
    }

    /// The inverse of [`Self::local`], unit.
    #[inline(always)]
    pub fn world(&self, local: Vector3<R>) -> Vector3<R> {
        local.to_world(&self.axes).normalize()
    }

    /// Returns the reflection and the cosine with the microfacets that reflect this way.
    ///
    /// - `wi`: in the frame, above the surface.
    #[inline(always)]
    pub fn eval(&self, wi: Vector3<R>) -> (Reflection<R>, R) {
        let found = self.facets.reflection(self.wo, self.lambda_o, wi);
        let cos = self.wo.dot(found.half);
        (found, cos)
    }
}

/// - `x`, `y`: of a direction times the widths; `z`: above 0.
fn lambda_of_beckmann([x, y, z]: [f32; 3]) -> f32 {
    let a = f64::from(z) / f64::from(x.hypot(y));
    if a.is_finite() { (0.5 * ((-a * a).exp() / (a * PI_64.sqrt()) - libm::erfc(a))).max(0.0) as f32 } else { 0.0 }
}

/// Returns the slope towards the viewer of a visible microfacet, in units of the width: its pdf is proportional to
/// `max(0, cos + s sin) exp(−s²)`.
///
/// - `cos`, `sin`: of the view with the normal, up to a common factor, above 0 and at least 0; `u`: uniform in `[0, 1)`.
///
/// The cumulative distribution is inverted as by Jakob 2014, "An Improved Visible Normal Sampling Routine for the
/// Beckmann Distribution", with the bracket of the root instead of a fit.
fn visible_slope(of: [f32; 3]) -> f32 {
    /// No `u` of 24 bits leads to larger slopes.
    const MOST: f64 = 6.0;
    let [cos, sin, u] = of.map(f64::from);
    let least = -cos / sin;
    let half_root = 0.5 * PI_64.sqrt();
    // ∫ from `least` to s.
    let below = |s: f64| {
        cos * half_root * (libm::erf(s) - libm::erf(least)) + 0.5 * sin * ((-least * least).exp() - (-s * s).exp())
    };
    let wanted = u * below(f64::INFINITY);
    let (mut low, mut high) = (least.max(-MOST), MOST);
    let mut s = 0.0_f64;
    // Newton's method; where it leaves the bracket, a bisection. Both end when `f32` has no slope in between.
    for _ in 0..64 {
        let excess = below(s) - wanted;
        *(if excess > 0.0 { &mut high } else { &mut low }) = s;
        let newton = s - excess / ((cos + s * sin) * (-s * s).exp());
        let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        if next as f32 == s as f32 {
            break;
        }
        s = next;
    }
    s as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sampler;
    use crate::test_statistics::ChiSquared;
    use glam::{Vec2, Vec3};
    use std::f32::consts::TAU;

    /// Both distributions, narrow and wide, and of two widths.
    fn all() -> impl Iterator<Item = Microfacets> {
        let widths = [[0.05; 2], [0.3; 2], [1.0; 2], [0.5, 0.1], [0.1, 0.6]];
        widths.into_iter().flat_map(|alpha| [false, true].map(|beckmann| Microfacets { alpha, beckmann }))
    }

    fn direction(cos: f32, phi: f32) -> Vec3 {
        let sin = (1.0 - cos * cos).sqrt();
        Vec3::new(sin * phi.cos(), sin * phi.sin(), cos)
    }

    fn seen_along(facets: Microfacets, wo: Vec3) -> SeenMicrofacets<f32> {
        SeenMicrofacets::new(facets, Vec3::Z.into(), Some(Vec3::X.into()), wo.into())
    }

    /// ∫ of a function over slopes of up to twelve widths: the plane of normals (x, y, 1).
    fn over_slopes(facets: &Microfacets, f: impl Fn(Vec3) -> f32) -> f64 {
        let n = 1200;
        let at = |i: i32| 24.0 * ((i as f32 + 0.5) / n as f32 - 0.5);
        let mut sum = 0.0;
        for (x, y) in (0..n).flat_map(|i| (0..n).map(move |k| (at(i), at(k)))) {
            let h = Vec3::new(x * facets.alpha[0], y * facets.alpha[1], 1.0).normalize();
            // dω = cos³ dx dy.
            sum += f64::from(f(h) * h.z.powi(3) * facets.alpha[0] * facets.alpha[1]);
        }
        sum * (24.0 / f64::from(n)).powi(2)
    }

    #[test]
    fn normals_of_beckmann_cover_the_surface_once_and_mask_what_faces_away() {
        for facets in all().filter(|facets| facets.beckmann) {
            let area = over_slopes(&facets, |h| facets.distribution(h.into()) * h.z);
            assert!((area - 1.0).abs() < 1e-4, "{facets:?}: {area}");
            for (cos, phi) in [(1.0, 0.0), (0.8, 0.3), (0.3, 2.0), (0.05, 1.2)] {
                // The visible area is cos θ: ∫ D max(0, ω·h) = (1 + Λ) cos θ.
                let w = direction(cos, phi);
                let seen = over_slopes(&facets, |h| facets.distribution(h.into()) * w.dot(h).max(0.0));
                let expected = f64::from((1.0 + facets.lambda(w.into())) * cos);
                assert!((seen - expected).abs() < 2e-4, "{facets:?}, {w}: {seen} for {expected}");
            }
        }
    }

    #[test]
    fn sampled_directions_follow_their_pdf() {
        // χ² test on directions, with the pdf integrated finely in each bin; significance 1 % over all cases (Šidák:
        // 3.9 σ).
        let views = [(0.95, 0.2), (0.5, 1.0), (0.08, 2.5), (0.02, 0.7)];
        let cases = all().filter(|facets| facets.alpha[0].min(facets.alpha[1]) > 0.05);
        for (case, (facets, (cos, phi))) in cases.flat_map(|facets| views.map(|view| (facets, view))).enumerate() {
            let wo = direction(cos, phi);
            let seen = seen_along(facets, wo);
            let wo = Vec3::from(seen.wo());
            let (nz, nphi, n) = (16usize, 32usize, 100_000u32);
            let mut counts = vec![0.0f64; nz * nphi + 1];
            for i in 0..n {
                let wi: Vec3 = seen.sample(Sampler::new(i, case as u32, 0, 0).pair(3).to_array()).into();
                let bin = if wi.z <= 0.0 {
                    nz * nphi
                } else {
                    let phi = (wi.y.atan2(wi.x) + PI) / TAU;
                    ((wi.z * nz as f32) as usize).min(nz - 1) * nphi + ((phi * nphi as f32) as usize).min(nphi - 1)
                };
                counts[bin] += 1.0;
                if wi.z > 1e-3 {
                    let (found, _) = seen.eval(wi.into());
                    assert!((found.weight * found.pdf - found.value).abs() < 1e-3 * found.value, "{facets:?}, {wo}");
                }
            }
            let fine = 32;
            let mut expected = vec![0.0f64; nz * nphi + 1];
            for (bin, slot) in expected.iter_mut().enumerate().take(nz * nphi) {
                for s in 0..fine * fine {
                    let z = ((bin / nphi) as f32 + ((s % fine) as f32 + 0.5) / fine as f32) / nz as f32;
                    let phi = ((bin % nphi) as f32 + ((s / fine) as f32 + 0.5) / fine as f32) / nphi as f32 * TAU - PI;
                    *slot += f64::from(seen.eval(direction(z, phi).into()).0.pdf);
                }
                *slot *= f64::from(n) * std::f64::consts::TAU / (nz * nphi * fine * fine) as f64;
            }
            expected[nz * nphi] = f64::from(n) - expected[..nz * nphi].iter().sum::<f64>();
            ChiSquared::of(&counts, &expected, 0.0).assert_below(3.9, &format!("{facets:?}, {wo}"));
        }
    }

    #[test]
    fn nothing_is_infinite_or_outweighs_its_light() {
        for facets in all().chain([1e-4, 1e-3].map(|alpha| Microfacets::isotropic(alpha, true))) {
            for (cos, i) in [1.0, 0.5, 1e-2, 1e-4, 1e-7].into_iter().flat_map(|cos| (0..500).map(move |i| (cos, i))) {
                let sampler = Sampler::new(i, 7, 0, 0);
                let u = if i < 4 {
                    [0.0, 1.0_f32.next_down()].map(|u| Vec2::new(u, sampler.single(1)))
                } else {
                    [sampler.pair(0); 2]
                };
                let seen = seen_along(facets, direction(cos, 0.4));
                for u in u {
                    let wi = seen.sample(u.to_array());
                    assert!((wi.length() - 1.0).abs() < 1e-4, "{facets:?}, {cos}: {wi:?}");
                    if wi.z <= 0.0 {
                        continue;
                    }
                    let (found, _) = seen.eval(wi);
                    let name = format!("{facets:?}, {cos}: {} {} {}", found.value, found.pdf, found.weight);
                    assert!(found.value >= 0.0 && found.pdf >= 0.0 && found.weight > 0.0, "{name}");
                    assert!(found.value.is_finite() && found.pdf.is_finite() && found.weight <= 1.0, "{name}");
                }
            }
        }
    }
}
