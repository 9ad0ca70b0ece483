//! Curves of pbrt as thin tubes of triangles. Start reading at [`tube`].

use crate::model::assemble::Indexed;
use crate::pbrt::params::Params;
use glam::{DAffine3, DVec3, Vec2};
use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

/// Sides of a tube.
const SIDES: u32 = 4;

/// Meshes of curves while they are read.
#[derive(Debug, Default)]
pub(crate) struct Strands {
    /// By the number of their first shape.
    meshes: BTreeMap<u32, Indexed>,
    /// Number, material and transform of the latest.
    latest: Option<(u32, String, DAffine3)>,
}

impl Strands {
    /// Begins another mesh with the next curve.
    pub(crate) fn part(&mut self) {
        self.latest = None;
    }

    /// All meshes, by the number of their first shape.
    pub(crate) fn take(&mut self) -> BTreeMap<u32, Indexed> {
        std::mem::take(&mut self.meshes)
    }

    /// Adds a tube to the latest mesh, if it is of the same kind; otherwise returns `false` and begins a mesh.
    pub(crate) fn add(&mut self, number: u32, tube: Indexed, material: &str, ctm: &DAffine3) -> bool {
        if let Some((first, of, transform)) = &self.latest
            && (of.as_str(), transform) == (material, ctm)
            && let Some(mesh) = self.meshes.get_mut(first)
        {
            let start = mesh.positions.len() as u32;
            mesh.triangles.extend(tube.triangles.iter().map(|triangle| triangle.map(|vertex| start + vertex)));
            mesh.positions.extend(tube.positions);
            mesh.normals.extend(tube.normals);
            mesh.uvs.extend(tube.uvs);
            return true;
        }
        self.latest = Some((number, material.to_owned(), *ctm));
        self.meshes.insert(number, tube);
        false
    }
}

/// The tube of a curve, with normals and with u along it; or why there is none.
///
/// Its cross-section is a regular polygon whose mean width over all directions is that of pbrt's circle or ribbon: by
/// Cauchy's formula its perimeter over π.
pub(crate) fn tube(params: &Params) -> Result<Indexed, String> {
    let points = params.points("P");
    let degree = params.count("degree").unwrap_or(3);
    let is_spline = match params.string("basis").unwrap_or("bezier") {
        "bezier" => false,
        "bspline" => true,
        _ => return Err("the `basis` of a curve must be bezier or bspline".to_owned()),
    };
    let order = match degree {
        2 | 3 => degree as usize,
        _ => return Err("the `degree` of a curve must be 2 or 3".to_owned()),
    };
    // Segments share an end, or all points but one.
    let step = if is_spline { 1 } else { order };
    if points.len() <= order || !(points.len() - 1 - order).is_multiple_of(step) {
        return Err(format!("{} points `P` make no curve of degree {order}", points.len()));
    }
    let n_segments = (points.len() - 1 - order) / step + 1;
    let width = params.number("width").unwrap_or(1.0);
    let [first, last] = ["width0", "width1"].map(|name| params.number(name).unwrap_or(width).max(0.0));
    if !(first > 0.0 || last > 0.0) {
        return Err("its width is not positive".to_owned());
    }
    // Many segments follow a curve closely by themselves.
    let n_steps = if n_segments < 4 { 8 } else { 2 };
    let per_segment = |i: usize| &points[i * step..=i * step + order];
    let mut out = Indexed::default();
    let mut side = DVec3::ZERO;
    let n_rings = n_segments * n_steps;
    for ring in 0..=n_rings {
        let segment = (ring / n_steps).min(n_segments - 1);
        let t = (ring - segment * n_steps) as f64 / n_steps as f64;
        let (center, tangent) = at(per_segment(segment), is_spline, t);
        let u = ring as f64 / n_rings as f64;
        // Without turning about the curve: the last side, made perpendicular.
        side = side.reject_from(tangent).try_normalize().unwrap_or_else(|| tangent.any_orthonormal_vector());
        let across = tangent.cross(side);
        let radius = 0.5 * (first + u * (last - first)) * PI / (f64::from(SIDES) * (PI / f64::from(SIDES)).sin());
        for k in 0..=SIDES {
            let (sin, cos) = (TAU * f64::from(k % SIDES) / f64::from(SIDES)).sin_cos();
            let normal = cos * side + sin * across;
            out.positions.push(center + radius * normal);
            out.normals.push(normal.as_vec3());
            out.uvs.push(Vec2::new(u as f32, k as f32 / SIDES as f32));
        }
    }
    if out.positions.iter().any(|point| !point.is_finite()) {
        return Err("it has points that are not finite".to_owned());
    }
    let at = |ring: usize, k: u32| ring as u32 * (SIDES + 1) + k;
    for (ring, k) in (0..n_rings).flat_map(|ring| (0..SIDES).map(move |k| (ring, k))) {
        out.triangles.push([at(ring, k), at(ring, k + 1), at(ring + 1, k + 1)]);
        out.triangles.push([at(ring, k), at(ring + 1, k + 1), at(ring + 1, k)]);
    }
    Ok(out)
}

/// Point and unit tangent of a segment, of degree 2 or 3, at `t` in 0..1.
fn at(points: &[DVec3], is_spline: bool, t: f64) -> (DVec3, DVec3) {
    let s = 1.0 - t;
    let weights: ([f64; 4], [f64; 4]) = match (points.len(), is_spline) {
        (3, false) => ([s * s, 2.0 * s * t, t * t, 0.0], [-s, s - t, t, 0.0]),
        (3, true) => ([0.5 * s * s, 0.5 + s * t, 0.5 * t * t, 0.0], [-s, s - t, t, 0.0]),
        (_, false) => (
            [s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t],
            [-s * s, s * s - 2.0 * s * t, 2.0 * s * t - t * t, t * t],
        ),
        (_, true) => (
            [s * s * s, 3.0 * t * t * (t - 2.0) + 4.0, 3.0 * s * s * (s - 2.0) + 4.0, t * t * t].map(|w| w / 6.0),
            [-s * s, t * (3.0 * t - 4.0), s * (4.0 - 3.0 * s), t * t],
        ),
    };
    let sum = |weights: [f64; 4]| points.iter().zip(weights).map(|(point, weight)| weight * *point).sum::<DVec3>();
    // Where control points coincide, towards the end of the segment.
    let chord = (points[points.len() - 1] - points[0]).normalize_or(DVec3::Z);
    (sum(weights.0), sum(weights.1).try_normalize().unwrap_or(chord))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pbrt::params::{Param, Values};

    fn params(basis: &str, degree: f64, numbers: &[(&str, &[f64])]) -> Params {
        let number = |(name, list): &(&str, &[f64])| Param {
            kind: "float".to_owned(),
            name: (*name).to_owned(),
            values: Values::Numbers(list.to_vec()),
        };
        let mut all: Vec<Param> = numbers.iter().map(number).collect();
        all.push(Param {
            kind: "string".to_owned(),
            name: "basis".to_owned(),
            values: Values::Strings(vec![basis.to_owned()]),
        });
        all.push(Param::number("degree", degree));
        Params::new(all)
    }

    /// A quarter of a circle of radius 1 by its usual cubic has the length π/2; the area of a tube is its length times
    /// the perimeter of its cross-section, π times the width.
    #[test]
    fn a_tube_has_the_length_and_the_width_of_its_curve() {
        const K: f64 = 0.552_284_75;
        let quarter: &[f64] = &[1.0, 0.0, 0.0, 1.0, K, 0.0, K, 1.0, 0.0, 0.0, 1.0, 0.0];
        let tube = tube(&params("bezier", 3.0, &[("P", quarter), ("width", &[0.02])])).unwrap();
        let area: f64 = (tube.triangles.iter())
            .map(|triangle| {
                let [a, b, c] = triangle.map(|vertex| tube.positions[vertex as usize]);
                let normal = (b - a).cross(c - a);
                assert!(normal.dot(tube.normals[triangle[0] as usize].as_dvec3()) > 0.0, "the front is outside");
                0.5 * normal.length()
            })
            .sum();
        assert!((area / (0.5 * PI * PI * 0.02) - 1.0).abs() < 0.01, "{area}");
        for (point, normal) in tube.positions.iter().zip(&tube.normals) {
            assert!((normal.length() - 1.0).abs() < 1e-6 && (point.length() - 1.0).abs() < 0.012);
        }
    }

    /// Splines and Bézier curves of the same parabola: the weights add up to 1 and derivatives are those of the points.
    #[test]
    fn all_bases_agree_on_a_parabola() {
        // Control points of (t, t², 0) over 0..1.
        let curve = |t: f64| DVec3::new(t, t * t, 0.0);
        let bezier2 = [DVec3::ZERO, DVec3::new(0.5, 0.0, 0.0), DVec3::new(1.0, 1.0, 0.0)];
        let bezier3 = [0.0, 1.0, 2.0, 3.0]
            .map(|i| DVec3::new(i / 3.0, if i < 2.0 { 0.0 } else { (i - 2.0) * 2.0 / 3.0 + 1.0 / 3.0 }, 0.0));
        // Polar forms: of degree 2 at (i − 1, i), of degree 3 at (i − 2, i − 1, i).
        let spline2 = [0.0, 1.0, 2.0].map(|i| DVec3::new((2.0 * i - 1.0) / 2.0, (i - 1.0) * i, 0.0));
        let spline3 = [0.0, 1.0, 2.0, 3.0]
            .map(|i| DVec3::new(i - 1.0, ((i - 2.0) * (i - 1.0) + (i - 1.0) * i + (i - 2.0) * i) / 3.0, 0.0));
        for (points, is_spline) in [(&bezier2[..], false), (&bezier3, false), (&spline2, true), (&spline3, true)] {
            for t in [0.0, 0.2, 0.7, 1.0] {
                let (point, tangent) = at(points, is_spline, t);
                let slope = DVec3::new(1.0, 2.0 * t, 0.0).normalize();
                assert!((point - curve(t)).length() < 1e-12, "{points:?} {t}: {point}");
                assert!((tangent - slope).length() < 1e-12, "{points:?} {t}: {tangent}");
            }
        }
    }

    #[test]
    fn broken_curves_say_what_is_wrong() {
        let points: &[f64] = &[0.0; 15];
        for (basis, degree, list, told) in [
            ("bezier", 3.0, &[][..], "make no curve"),
            ("bezier", 3.0, &[("P", points)][..], "5 points `P` make no curve"),
            ("hermite", 3.0, &[("P", points)][..], "bezier or bspline"),
            ("bspline", 4.0, &[("P", points)][..], "2 or 3"),
            ("bspline", 3.0, &[("P", points), ("width", &[0.0][..])][..], "width"),
        ] {
            let error = tube(&params(basis, degree, list)).unwrap_err();
            assert!(error.contains(told), "{error}");
        }
    }
}
