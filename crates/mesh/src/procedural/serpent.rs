//! A serpent tied into a trefoil knot: the main subject of the gallery.
//!
//! One closed surface without self-intersection, with detail at four scales: the knot, the swept fins of the crest,
//! overlapping keeled scales and belly plates, and the grain of the skin. Everything is a function of two angles, so
//! any resolution gives the same sculpture.

use super::noise::{fractal_noise, ridged_noise};
use super::{built, closed_grid};
use crate::Mesh;
use glam::{DVec2, DVec3, dvec2, dvec3};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Resolution and relief of [`serpent_knot`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SerpentKnot {
    /// Segments along the body; `2 · along · around` triangles.
    pub along: u32,
    /// Segments around the body.
    pub around: u32,
    /// 0: a smooth knot; 1: the full relief.
    pub relief: f64,
    /// Seed of the noise in the relief.
    pub seed: u32,
}

impl Default for SerpentKnot {
    /// 344,064 triangles.
    fn default() -> Self {
        Self { along: 1344, around: 128, relief: 1.0, seed: 1 }
    }
}

/// Radius of the torus on which the body runs, and radius of that torus's tube. Metres, like all lengths here.
const KNOT: DVec2 = dvec2(1.0, 0.46);
/// Radius of the body.
const BODY: f64 = 0.24;
/// Fins of the crest; scale rows along the body (even: they are staggered); scales around it; belly plates.
const FINS: f64 = 72.0;
const SCALE_ROWS: u32 = 200;
const SCALES_AROUND: f64 = 20.0;
const BELLY_PLATES: f64 = 100.0;

/// Builds a knot about 3.4 metres wide and 1.5 high about the origin, lying flat, y up. Closed, manifold, genus 1.
///
/// # Panics
/// If there are fewer than 64 segments along or 8 around.
pub fn serpent_knot(shape: &SerpentKnot) -> Mesh {
    let SerpentKnot { along, around, .. } = *shape;
    assert!(along >= 64 && around >= 8, "the knot needs at least 64 × 8 segments, not {along} × {around}");
    let knot = ArcLength::new();
    let positions: Vec<DVec3> = (0..along * around)
        .into_par_iter()
        .map(|k| {
            let s = f64::from(k / around) / f64::from(along);
            let t = knot.parameter_at(s);
            let theta = TAU * f64::from(k % around) / f64::from(around);
            // Twice as many vertices on the back as on the belly, because the fins are the thinnest detail.
            surface_point(shape, s, t, theta - 0.5 * theta.sin())
        })
        .collect();
    built(&positions, closed_grid(along, around))
}

/// Returns a point of the surface.
///
/// - `s`: position along the body as a fraction of its length, `[0, 1)`.
/// - `t`: the same position as the knot's own parameter, `[0, 1)`.
/// - `angle`: around the body, radians, 0 on the back, π on the belly.
fn surface_point(shape: &SerpentKnot, s: f64, t: f64, angle: f64) -> DVec3 {
    let (center, tangent, back, side) = body_frame(t);
    let (sin, cos) = angle.sin_cos();
    let outward = cos * back + sin * side;
    let from_back = angle.min(TAU - angle);
    // The girth varies slightly, and the belly is flatter than the back.
    let girth = 1.0 + 0.05 * (3.0 * TAU * s).sin();
    let profile = 1.0 - 0.07 * (0.5 - 0.5 * cos).powi(2);
    let radius = BODY * girth * profile;

    let belly = smooth_step(1.95, 2.2, from_back);
    let spine = 1.0 - smooth_step(0.16, 0.34, from_back);
    let scales = scale_relief(s, angle);
    let plates = plate_relief(s * BELLY_PLATES);
    let skin = center + outward * radius;
    let grain = ridged_noise(skin * 19.0, 3, shape.seed) - 0.5;
    let soft = fractal_noise(skin * 3.0, 3, shape.seed ^ 0x3c6e);
    let relief =
        (1.0 - belly) * (1.0 - 0.8 * spine) * 0.034 * scales + belly * 0.024 * plates + 0.0016 * grain + 0.006 * soft;

    let (rise, sweep) = fin(s, from_back);
    let lift = shape.relief * (relief + rise);
    skin + outward * lift - tangent * (shape.relief * sweep)
}

/// Maps arc length along the centre line to the knot's parameter, which runs almost twice as fast on the outside.
struct ArcLength {
    /// Fraction of the length up to each of equal steps of the parameter, from 0 to 1.
    shares: Vec<f64>,
}

impl ArcLength {
    fn new() -> Self {
        let steps: u32 = 4096;
        let point = |i: u32| body_frame(f64::from(i) / f64::from(steps)).0;
        let mut shares = vec![0.0];
        for i in 0..steps {
            shares.push(shares[i as usize] + point(i).distance(point(i + 1)));
        }
        let length = shares[steps as usize];
        shares.iter_mut().for_each(|share| *share /= length);
        Self { shares }
    }

    fn parameter_at(&self, s: f64) -> f64 {
        let above = self.shares.partition_point(|&share| share <= s).clamp(1, self.shares.len() - 1);
        let (from, to) = (self.shares[above - 1], self.shares[above]);
        (above as f64 - 1.0 + (s - from) / (to - from)) / (self.shares.len() - 1) as f64
    }
}

/// Returns the centre line at parameter `s`, and its frame: along the body, towards its back, towards its side; tangent
/// × side is back.
fn body_frame(s: f64) -> (DVec3, DVec3, DVec3, DVec3) {
    // A (2, 3) torus knot: twice around the axis, three times around the tube. The torus's own normal gives a frame
    // that is periodic and orients every fin outwards.
    let (axis_angle, tube_angle) = (2.0 * TAU * s, 3.0 * TAU * s);
    let (sin_a, cos_a) = axis_angle.sin_cos();
    let (sin_t, cos_t) = tube_angle.sin_cos();
    let radial = dvec3(sin_a, 0.0, cos_a);
    let circling = dvec3(cos_a, 0.0, -sin_a);
    let ring = KNOT.x + KNOT.y * cos_t;
    let back = cos_t * radial + sin_t * DVec3::Y;
    let center = ring * radial + KNOT.y * sin_t * DVec3::Y;
    let tangent = (2.0 * ring * circling + 3.0 * KNOT.y * (cos_t * DVec3::Y - sin_t * radial)).normalize();
    (center, tangent, back, back.cross(tangent))
}

/// Height of overlapping scales, 0..1: each rises towards its rounded free end and carries a keel.
fn scale_relief(s: f64, angle: f64) -> f64 {
    let at = dvec2(s * f64::from(SCALE_ROWS), angle / TAU * SCALES_AROUND);
    let row = at.x.floor() as i64;
    let mut highest: f64 = 0.0;
    for near_row in row - 1..=row + 1 {
        let stagger = if near_row.rem_euclid(2) == 0 { 0.0 } else { 0.5 };
        let column = (at.y - stagger).round() + stagger;
        // Neighbours overlap across too, but the higher one always lies within half a width.
        let local = dvec2((at.x - near_row as f64 - 0.5) / 1.15, (at.y - column) / 0.56);
        highest = highest.max(one_scale(local));
    }
    highest
}

/// Height of one scale.
///
/// - `p`: position in the scale, which is the unit disc with its free end at −x.
fn one_scale(p: DVec2) -> f64 {
    let edge = p.length_squared();
    if edge >= 1.0 {
        return 0.0;
    }
    let slope = 0.5 - 0.42 * p.x;
    let rim = (1.0 - edge.powi(4)).sqrt();
    let keel = 0.22 * (1.0 - (p.y.abs() / 0.34).min(1.0)).powi(2) * (1.0 - edge);
    rim * slope + keel
}

/// Height of broad plates across the belly, 0..1, each overlapping the next; `x` counts plates.
fn plate_relief(x: f64) -> f64 {
    let u = x - x.floor();
    (1.0 - 0.75 * u) * (1.0 - (1.0 - u).powi(14))
}

/// Returns the height of the crest's fins and the distance by which they lean back, metres.
fn fin(s: f64, from_back: f64) -> (f64, f64) {
    let across = (-(from_back / 0.11).powi(2)).exp();
    let u = s * FINS - (s * FINS).floor();
    // Every third fin is the largest, which gives the crest a rhythm.
    let rhythm = 0.8 + 0.2 * (TAU * s * FINS / 3.0).cos();
    let blade = (0.5 - 0.5 * (TAU * u).cos()).powf(1.5);
    let base = 0.18;
    let height = 0.12 * rhythm * across * (base + (1.0 - base) * blade);
    (height, 0.6 * height * blade)
}

/// Smooth step: 0 below `from`, 1 above `to`, with zero slope at the ends.
fn smooth_step(from: f64, to: f64, x: f64) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Topology;

    #[test]
    fn the_serpent_is_one_closed_ring_of_the_promised_size() {
        let mesh = serpent_knot(&SerpentKnot::default());
        assert!(mesh.triangles.len() >= 200_000);
        let topology = Topology::of(&mesh);
        assert!(topology.is_closed() && topology.is_manifold(), "{topology:?}");
        assert_eq!((topology.genus(), topology.pieces, topology.degenerate_triangles), (1, 1, 0));
        assert!(mesh.signed_volume() > 0.0);
    }

    #[test]
    fn strands_keep_clear_of_each_other() {
        // Points of the finished surface far apart along the body must be far apart in space as well.
        let knot = ArcLength::new();
        let points: Vec<(f64, DVec3)> = (0..240)
            .flat_map(|i| (0..24).map(move |j| (f64::from(i) / 240.0, TAU * f64::from(j) / 24.0)))
            .map(|(s, angle)| (s, surface_point(&SerpentKnot::default(), s, knot.parameter_at(s), angle)))
            .collect();
        let mut nearest = f64::INFINITY;
        for (i, (s, p)) in points.iter().enumerate() {
            for (t, q) in &points[i + 1..] {
                let along = (s - t).abs();
                if along.min(1.0 - along) > 0.1 {
                    nearest = nearest.min(p.distance(*q));
                }
            }
        }
        assert!(nearest > 0.05, "strands come within {nearest}");
    }

    #[test]
    fn the_centre_line_is_closed_with_its_frame() {
        let (p, t, b, n) = body_frame(0.0);
        let (q, u, c, m) = body_frame(1.0);
        let gap = p.distance(q) + t.distance(u) + b.distance(c) + n.distance(m);
        assert!(gap < 1e-12, "{gap}");
        assert!((t.cross(n).dot(b) - 1.0).abs() < 1e-12 && t.dot(b).abs() < 1e-12);
        // Compared with a difference quotient.
        let step = (body_frame(0.3001).0 - body_frame(0.2999).0).normalize();
        assert!(step.distance(body_frame(0.3).1) < 1e-5);
    }
}
