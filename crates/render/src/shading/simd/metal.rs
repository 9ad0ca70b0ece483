//! Rough metal, sixteen points at a time: the formulas of [`crate::shading::ggx`] and of metal in `bsdf.rs`.

use crate::prepare::material_table::{COMPENSATE, SCHLICK};
use crate::sampling::warp::uniform_disc;
use crate::shading::ggx;
use firstlight_simd::{Bits, Float, LANES, Mask, Real, Simd, Vector, frame_around, select, select_vector};
use std::f32::consts::PI;

/// Metal as seen along `wo`.
#[derive(Clone, Copy)]
pub(crate) struct MetalLanes<S: Simd> {
    pub alpha: Float<S>,
    pub reflectance: Vector<S>,
    pub flags: Bits<S>,
    axes: [Vector<S>; 3],
    /// Along `axes`.
    wo: Vector<S>,
    lambda_o: Float<S>,
    /// What one bounce loses over what it returns.
    lost: Float<S>,
}

/// Of directions that a metal was asked about.
pub(crate) struct MetalValue<S: Simd> {
    pub tint: Vector<S>,
    /// f · cos over the tint.
    pub value: Float<S>,
    /// Per steradian.
    pub pdf: Float<S>,
    /// f · cos / pdf over the tint.
    pub weight: Float<S>,
}

impl<S: Simd> MetalLanes<S> {
    #[inline(always)]
    pub fn new(
        s: S,
        mask: Mask,
        normal: Vector<S>,
        wo: Vector<S>,
        alpha: Float<S>,
        reflectance: Vector<S>,
        flags: Bits<S>,
    ) -> Self {
        let axes = frame_around(normal);
        let wo = wo.to_local(&axes);
        let mut lost = Float::splat(s, 0.0);
        let compensated = mask & flags.has(COMPENSATE);
        if compensated != 0 {
            let (cos, alphas) = (wo.z.to_array(), alpha.to_array());
            let mut lanes = [0.0; LANES];
            for i in (0..LANES).filter(|i| compensated >> i & 1 != 0) {
                let albedo = ggx::single_scattering_albedo(cos[i], alphas[i]);
                lanes[i] = (1.0 - albedo) / albedo;
            }
            lost = Float::load(s, &lanes);
        }
        Self { alpha, reflectance, flags, axes, wo, lambda_o: lambda(wo, alpha), lost }
    }

    /// Lanes whose normal faces the viewer.
    #[inline(always)]
    pub fn facing(&self) -> Mask {
        self.wo.z.is_positive()
    }

    /// A direction in the world and along the axes.
    #[inline(always)]
    pub fn sample(&self, u: [Float<S>; 2]) -> [Vector<S>; 2] {
        let h = sample_visible_normal(self.wo, self.alpha, u);
        let local = (h * (self.wo.dot(h) * 2.0) - self.wo).normalize();
        [local.to_world(&self.axes).normalize(), local]
    }

    #[inline(always)]
    pub fn local(&self, wi: Vector<S>) -> Vector<S> {
        wi.to_local(&self.axes)
    }

    /// - `wi`: along the axes, above the surface.
    #[inline(always)]
    pub fn eval(&self, wi: Vector<S>) -> MetalValue<S> {
        let wo = self.wo;
        let h = (wo + wi).normalize();
        let a2 = self.alpha * self.alpha;
        let d = a2 * h.z * h.z + (h.x * h.x + h.y * h.y);
        let distribution = a2 / (d * d * PI);
        let masking = self.lambda_o + 1.0;
        let both = masking + lambda(wi, self.alpha);
        let per_area = distribution / (wo.z * 4.0);
        let tint = fresnel(self.flags, self.reflectance, wo.dot(h));
        let back = self.reflectance * self.lost;
        let one = Vector { x: back.x + 1.0, y: back.y + 1.0, z: back.z + 1.0 };
        MetalValue { tint: tint.times(one), value: per_area / both, pdf: per_area / masking, weight: masking / both }
    }
}

/// Reflectance under an angle.
#[inline(always)]
pub(crate) fn fresnel<S: Simd>(flags: Bits<S>, facing: Vector<S>, cos: Float<S>) -> Vector<S> {
    let schlick = flags.has(SCHLICK);
    if schlick == 0 {
        return facing;
    }
    let x = (-cos + 1.0).at_least(0.0).at_most(1.0);
    let x2 = x * x;
    let grazing = x2 * x2 * x;
    let white = Vector { x: -facing.x + 1.0, y: -facing.y + 1.0, z: -facing.z + 1.0 };
    select_vector(schlick, facing + white * grazing, facing)
}

#[inline(always)]
fn lambda<S: Simd>(w: Vector<S>, alpha: Float<S>) -> Float<S> {
    let tan2 = (w.x * w.x + w.y * w.y) / (w.z * w.z);
    let x = alpha * alpha * tan2;
    x * 0.5 / ((x + 1.0).sqrt() + 1.0)
}

/// See [`ggx::sample_visible_normal`]; the place on the cap comes from the disc, which keeps neighbours together and
/// takes no sine.
#[inline(always)]
fn sample_visible_normal<S: Simd>(wo: Vector<S>, alpha: Float<S>, u: [Float<S>; 2]) -> Vector<S> {
    let wo_std = stretched(wo, alpha).normalize();
    let [x, y] = uniform_disc(u);
    let one = x.all(1.0);
    // The square of the radius is uniform, and so is the height.
    let r2 = (x * x + y * y).at_most(1.0);
    let z = (one - r2) * (wo_std.z + 1.0) - wo_std.z;
    let sin_theta = (one - z * z).at_least(0.0).sqrt();
    let r = r2.sqrt();
    let middle = r2.is_zero();
    let scale = sin_theta / select(middle, one, r);
    let wi_std = Vector { x: select(middle, sin_theta, x * scale), y: y * scale, z };
    let h = stretched(wo_std + wi_std, alpha);
    let length = h.length();
    let up = Vector { x: x.all(0.0), y: x.all(0.0), z: one };
    select_vector(length.is_positive(), h * (one / length), up)
}

#[inline(always)]
fn stretched<S: Simd>(v: Vector<S>, alpha: Float<S>) -> Vector<S> {
    Vector { x: v.x * alpha, y: v.y * alpha, z: v.z }
}
