//! Rectangles around the places where lines cross: the openings of a room, from the rays that leave through them.
//!
//! Rays through one opening come close to its middle from all sides, so the point that most lines pass, as seen from
//! where they start, is in an opening. The plane of the opening is the one, among those parallel to surfaces of the
//! room, in which the lines cross within the smallest area; and where the crossings leave a gap, there are several.

use glam::{DMat3, DVec2, DVec3};
use std::ops::Range;

/// A ray that leaves the scene.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    pub from: DVec3,
    /// Unit.
    pub dir: DVec3,
    /// Luminance of the environment there, W·m⁻²·sr⁻¹.
    pub radiance: f64,
}

/// A rectangle whose front, the side of `edge_u` × `edge_v`, is the side that lines come from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rectangle {
    pub corner: DVec3,
    pub edge_u: DVec3,
    pub edge_v: DVec3,
    /// Mean over the lines that cross it.
    pub radiance: f64,
}

/// Fewest lines that make a rectangle.
const FEWEST: usize = 12;

/// Largest number of openings that are looked for.
const MOST: usize = 8;

/// Least cosine of the angle between parallel normals.
const PARALLEL: f64 = 0.999;

/// Pairs of lines whose closest points are tried as the middle of an opening.
const TRIES: usize = 96;

/// Largest sine of the angle at which a line passes the middle of its opening.
const BESIDE: f64 = 0.35;

/// A rectangle grows by up to this share of its size on each side, to all lines that cross there: light beside it is left
/// to BSDF sampling, whose noise is much worse than that of a rectangle that is too large.
const BEYOND: f64 = 0.15;

/// A gap between crossings that is this many times the widest that is expected of n even ones, ln n times their mean
/// distance, divides a rectangle.
const GAP: f64 = 2.0;

/// Share of the crossings at each end that the choice of a plane leaves out: some lines go through other openings.
const LEFT_OUT: f64 = 0.05;

/// Returns rectangles that most of the lines cross, those that more lines cross first.
///
/// - `surfaces`: points on surfaces and their unit normals; openings are parallel to some of them.
pub(super) fn rectangles(lines: &[Line], surfaces: &[(DVec3, DVec3)]) -> Vec<Rectangle> {
    let axes = axes_of(surfaces);
    let mut rest = lines.to_vec();
    let mut found = Vec::new();
    while found.len() < MOST && rest.len() >= FEWEST {
        let Some(middle) = middle_of(&rest) else { break };
        let Some(plane) = plane_at(middle, &rest, surfaces, &axes) else { break };
        let crossings: Vec<(DVec2, f64)> =
            near(middle, &rest).filter_map(|(line, _)| Some((plane.crossing(line)?, line.radiance))).collect();
        let mut parts = Vec::new();
        divide(crossings, &mut parts);
        let before = rest.len();
        for part in parts {
            let around = part.enlarged(BEYOND);
            let within = |line: &Line| plane.crossing(line).filter(|at| around.contains(*at));
            found.push(plane.rectangle(&part.with(rest.iter().filter_map(within))));
            rest.retain(|line| within(line).is_none());
        }
        if rest.len() == before {
            break;
        }
    }
    found
}

/// Directions that many normals have, up to their sign: most frequent first.
fn axes_of(surfaces: &[(DVec3, DVec3)]) -> Vec<DVec3> {
    const MOST_AXES: usize = 6;
    const MOST_TRIED: usize = 256;
    let mut axes: Vec<(DVec3, usize)> = Vec::new();
    for (_, normal) in surfaces {
        match axes.iter().position(|(axis, _)| axis.dot(*normal).abs() > PARALLEL) {
            Some(known) => axes[known].1 += 1,
            None if axes.len() < MOST_TRIED => axes.push((*normal, 1)),
            None => {}
        }
    }
    axes.sort_by_key(|(_, n)| std::cmp::Reverse(*n));
    axes.into_iter().take(MOST_AXES).map(|(axis, _)| axis).collect()
}

/// Lines that pass a point at a small angle, with weights that fall from 1 to 0 with the angle (Tukey's biweight).
fn near(middle: DVec3, lines: &[Line]) -> impl Iterator<Item = (&Line, f64)> {
    lines.iter().filter_map(move |line| {
        let to = middle - line.from;
        let along = to.dot(line.dir);
        let rest = 1.0 - (to.length_squared() - along * along) / (BESIDE * BESIDE * to.length_squared());
        (along > 0.0 && rest > 0.0).then_some((line, rest * rest))
    })
}

/// Returns the point that most lines pass.
fn middle_of(lines: &[Line]) -> Option<DVec3> {
    let pairs = (0..TRIES).map(|k| (k * 7919 % lines.len(), (k * 104_729 + lines.len() / 2) % lines.len()));
    let tries = pairs.filter_map(|(a, b)| {
        let (a, b) = (&lines[a], &lines[b]);
        // The closest points of both lines.
        let (cos, offset) = (a.dir.dot(b.dir), b.from - a.from);
        let sin2 = 1.0 - cos * cos;
        let t = (offset.dot(a.dir) - cos * offset.dot(b.dir)) / sin2;
        let s = (cos * offset.dot(a.dir) - offset.dot(b.dir)) / sin2;
        (sin2 > 0.01 && t > 0.0 && s > 0.0).then(|| 0.5 * (a.from + t * a.dir + b.from + s * b.dir))
    });
    let worth = |at: DVec3| near(at, lines).map(|(_, weight)| weight).sum::<f64>();
    let mut middle = tries.max_by(|a, b| worth(*a).total_cmp(&worth(*b)))?;
    for _ in 0..3 {
        // The point with the smallest sum of squared distances to the lines.
        let (mut matrix, mut sum) = (DMat3::ZERO, DVec3::ZERO);
        for (line, weight) in near(middle, lines) {
            let across =
                DMat3::IDENTITY - DMat3::from_cols(line.dir * line.dir.x, line.dir * line.dir.y, line.dir * line.dir.z);
            matrix += weight * across;
            sum += weight * across * line.from;
        }
        let next = matrix.inverse() * sum;
        if !next.is_finite() {
            break;
        }
        middle = next;
    }
    Some(middle)
}

/// A plane with axes.
struct Plane {
    origin: DVec3,
    u: DVec3,
    v: DVec3,
    /// u × v, against the lines.
    normal: DVec3,
}

/// A rectangle in a plane.
struct Part {
    min: DVec2,
    max: DVec2,
    radiance: f64,
}

impl Part {
    fn contains(&self, at: DVec2) -> bool {
        at.cmpge(self.min).all() && at.cmple(self.max).all()
    }

    /// The bounds of crossings, without single ones around.
    fn of(crossings: &[(DVec2, f64)]) -> Self {
        let radiance = crossings.iter().map(|(_, radiance)| radiance).sum::<f64>() / crossings.len() as f64;
        let [x, y] = [0, 1].map(|axis| dense_range(&sorted(crossings.iter().map(|(at, _)| at[axis]))));
        Self { min: DVec2::new(x[0], y[0]), max: DVec2::new(x[1], y[1]), radiance }
    }

    /// Grows to these crossings.
    fn with(&self, crossings: impl Iterator<Item = DVec2>) -> Self {
        let (min, max) = crossings.fold((self.min, self.max), |(min, max), at| (min.min(at), max.max(at)));
        Self { min, max, ..*self }
    }

    fn enlarged(&self, share: f64) -> Self {
        let margin = share * (self.max - self.min);
        Self { min: self.min - margin, max: self.max + margin, ..*self }
    }
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values
}

/// Returns the distance between two quantiles of sorted values.
///
/// - `left_out`: share of the values at each end.
fn range_within(values: &[f64], left_out: f64) -> f64 {
    let n = (left_out * values.len() as f64) as usize;
    values[values.len() - 1 - n] - values[n]
}

/// Returns the range of sorted values with the largest cubed number over its length: values at its ends are a third as
/// dense as within, so that single ones around are left out.
fn dense_range(values: &[f64]) -> [f64; 2] {
    let n = values.len();
    // Half of the values lie between the quartiles, whatever is around. Few ones are nowhere dense by chance.
    let mean = 2.0 * range_within(values, 0.25) / n as f64;
    let worth = |first: usize, last: usize| {
        ((last - first + 1) as f64).powi(3) / (values[last] - values[first] + 4.0 * mean).max(f64::MIN_POSITIVE)
    };
    let ranges = (0..n).flat_map(|first| (first..n).map(move |last| (first, last)));
    let best = ranges.max_by(|a, b| worth(a.0, a.1).total_cmp(&worth(b.0, b.1)));
    let (first, last) = best.unwrap_or((0, n - 1));
    // An edge lies beyond the last of some values, by the mean distance between them.
    let beyond = (values[last] - values[first]) / (last - first + 1) as f64;
    [values[first] - beyond, values[last] + beyond]
}

impl Plane {
    fn crossing(&self, line: &Line) -> Option<DVec2> {
        let t = (self.origin - line.from).dot(self.normal) / line.dir.dot(self.normal);
        let at = line.from + t * line.dir - self.origin;
        (t > 0.0 && line.dir.dot(self.normal) < 0.0).then(|| DVec2::new(at.dot(self.u), at.dot(self.v)))
    }

    fn rectangle(&self, part: &Part) -> Rectangle {
        let size = part.max - part.min;
        Rectangle {
            corner: self.origin + part.min.x * self.u + part.min.y * self.v,
            edge_u: size.x * self.u,
            edge_v: size.y * self.v,
            radiance: part.radiance,
        }
    }
}

/// Returns the plane near an opening in which its lines cross within the smallest area.
///
/// - `surfaces`: planes of some of them are tried, and planes at even distances.
fn plane_at(middle: DVec3, lines: &[Line], surfaces: &[(DVec3, DVec3)], axes: &[DVec3]) -> Option<Plane> {
    const STEPS: Range<i32> = -8..9;
    let members: Vec<Line> = near(middle, lines).map(|(line, _)| *line).collect();
    let mean = members.iter().map(|line| line.dir).sum::<DVec3>().normalize_or_zero();
    let spread = members.iter().map(|line| (middle - line.from).reject_from_normalized(line.dir).length_squared());
    let spread = (spread.sum::<f64>() / members.len() as f64).sqrt();
    let mut best: Option<(f64, Plane)> = None;
    for axis in axes.iter().filter(|axis| axis.dot(mean).abs() > 0.3) {
        let normal = -axis.dot(mean).signum() * *axis;
        let across = axes.iter().copied().find(|other| other.dot(normal).abs() < 0.1);
        let u = across.unwrap_or(normal.any_orthonormal_vector()).reject_from_normalized(normal).normalize();
        let v = normal.cross(u);
        let mut offsets = walls_near(middle, normal, 2.0 * spread, surfaces);
        offsets.extend(STEPS.map(|step| 0.25 * f64::from(step) * spread));
        for offset in offsets {
            let plane = Plane { origin: middle + offset * normal, u, v, normal };
            let crossings: Vec<DVec2> = members.iter().filter_map(|line| plane.crossing(line)).collect();
            if crossings.len() < FEWEST {
                continue;
            }
            let range = |axis: usize| range_within(&sorted(crossings.iter().map(|at| at[axis])), LEFT_OUT);
            // Lines that start beyond the plane are lost.
            let area = range(0) * range(1) * (members.len() as f64 / crossings.len() as f64).powi(2);
            if best.as_ref().is_none_or(|(least, _)| area < *least) {
                best = Some((area, plane));
            }
        }
    }
    best.map(|(_, plane)| plane)
}

/// Returns the distances along `normal` from a point to surfaces with that normal, up to `most` in both directions.
fn walls_near(middle: DVec3, normal: DVec3, most: f64, surfaces: &[(DVec3, DVec3)]) -> Vec<f64> {
    /// Points of a surface that count, and the share of `most` within which they are of one surface.
    const ENOUGH: usize = 4;
    const SAME: f64 = 0.01;
    let parallel = surfaces.iter().filter(|(_, other)| other.dot(normal).abs() > PARALLEL);
    let offsets = sorted(parallel.map(|(at, _)| (at - middle).dot(normal)).filter(|offset| offset.abs() < most));
    let walls = offsets.chunk_by(|a, b| b - a < SAME * most).filter(|wall| wall.len() >= ENOUGH);
    walls.map(|wall| wall[wall.len() / 2]).collect()
}

/// Divides crossings at their gaps.
fn divide(mut crossings: Vec<(DVec2, f64)>, parts: &mut Vec<Part>) {
    if crossings.len() < FEWEST {
        return;
    }
    let n = crossings.len() as f64;
    for axis in 0..2 {
        crossings.sort_by(|(a, _), (b, _)| a[axis].total_cmp(&b[axis]));
        let gap = |i: &usize| crossings[*i].0[axis] - crossings[*i - 1].0[axis];
        let widest = (1..crossings.len()).max_by(|a, b| gap(a).total_cmp(&gap(b)));
        // Half of the crossings lie between the quartiles, whatever is far away.
        let mean = 2.0 * range_within(&sorted(crossings.iter().map(|(at, _)| at[axis])), 0.25) / n;
        if let Some(i) = widest.filter(|i| gap(i) > GAP * n.ln() * mean) {
            let other = crossings.split_off(i);
            divide(crossings, parts);
            return divide(other, parts);
        }
    }
    parts.push(Part::of(&crossings));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sampler;

    /// Lines from anywhere in a room of 6 × 3 × 4 m through openings in two of its walls and its roof, by area.
    fn lines(openings: &[Rectangle], n: u32) -> Vec<Line> {
        let numbers = |i: u32| (0..4).flat_map(move |k| Sampler::independent(3, i, 0, 0).pair(k).as_dvec2().to_array());
        (0..n)
            .map(|i| {
                let u: Vec<f64> = numbers(i).collect();
                let from = DVec3::new(6.0 * u[0], 3.0 * u[1], 4.0 * u[2]);
                let opening = &openings[i as usize % openings.len()];
                let to = opening.corner + u[3] * opening.edge_u + u[4] * opening.edge_v;
                Line { from, dir: (to - from).normalize(), radiance: opening.radiance }
            })
            .collect()
    }

    fn rectangle(corner: DVec3, edge_u: DVec3, edge_v: DVec3, radiance: f64) -> Rectangle {
        Rectangle { corner, edge_u, edge_v, radiance }
    }

    #[test]
    fn openings_are_found_from_the_lines_through_them() {
        let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
        let openings = [
            // Two in one wall, one in another, one in the roof.
            rectangle(DVec3::new(1.0, 1.0, 0.0), 1.2 * x, 1.4 * y, 2.0),
            rectangle(DVec3::new(4.0, 1.0, 0.0), 0.8 * x, 1.4 * y, 3.0),
            rectangle(DVec3::new(6.0, 0.0, 1.0), 1.0 * z, 2.1 * y, 1.0),
            rectangle(DVec3::new(2.0, 3.0, 1.5), 1.5 * z, 1.5 * x, 5.0),
        ];
        // A building that is turned.
        let turn = glam::DQuat::from_euler(glam::EulerRot::XYZ, 0.1, 0.7, 0.2);
        let surfaces: Vec<(DVec3, DVec3)> = [x, y, z].into_iter().map(|normal| (DVec3::ZERO, turn * normal)).collect();
        for (n, crossed, most_area) in [(200, 0.8, 2.6), (512, 0.85, 2.2), (2000, 0.9, 2.0)] {
            let lines: Vec<Line> =
                lines(&openings, n).iter().map(|l| Line { from: turn * l.from, dir: turn * l.dir, ..*l }).collect();
            let found = rectangles(&lines, &surfaces);
            assert!((4..=8).contains(&found.len()), "{found:?}");
            let crosses = |line: &Line, found: &Rectangle| {
                let (u, v) = (found.edge_u, found.edge_v);
                let normal = u.cross(v);
                let t = (found.corner - line.from).dot(normal) / line.dir.dot(normal);
                let at = line.from + t * line.dir - found.corner;
                let within = |edge: DVec3| (0.0..=1.0).contains(&(at.dot(edge) / edge.length_squared()));
                t > 0.0 && line.dir.dot(normal) < 0.0 && within(u) && within(v)
            };
            let through = lines.iter().filter(|line| found.iter().any(|found| crosses(line, found))).count();
            let area: f64 = found.iter().map(|found| found.edge_u.cross(found.edge_v).length()).sum();
            let true_area: f64 = openings.iter().map(|o| o.edge_u.cross(o.edge_v).length()).sum();
            assert!(through as f64 > crossed * lines.len() as f64, "{through} of {n}: {found:?}");
            assert!(area < most_area * true_area, "{area} for {true_area}: {found:?}");
        }
    }

    #[test]
    fn lines_without_an_opening_make_no_large_rectangles_in_vain() {
        assert!(rectangles(&[], &[(DVec3::ZERO, DVec3::X)]).is_empty());
        let line = Line { from: DVec3::ZERO, dir: DVec3::X, radiance: 1.0 };
        // The same line again and again has no middle.
        assert!(rectangles(&[line; 64], &[(DVec3::ZERO, DVec3::X)]).is_empty());
        assert!(rectangles(&lines(&[rectangle(DVec3::ZERO, DVec3::X, DVec3::Y, 1.0)], 64), &[]).is_empty());
    }
}
