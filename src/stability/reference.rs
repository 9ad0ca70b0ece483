//! The reference intersector: brute force over every primitive in `f64`, and the error bounds that results in `f32`
//! must satisfy.
//!
//! The geometry is the `f32` input, taken exactly. A hit at `t` is **right** if the point `origin + t · dir` lies
//! within the stated bound of the primitive that it names: [`TEST_ERROR`] of the distance to its farthest corner, which
//! covers the distance by which the watertight test may move a triangle (`kdtree::ray` derives 5 + 8 units of roundoff
//! per axis). A hit of the exact geometry is **sure** if no movement within that bound could make it a miss; a scene
//! that reports no hit, or a farther one, has missed it. Between the two, at exact edges, either neighbour is right,
//! and only the requirement of watertightness decides.

use crate::geometry::{Ray, quad_corners};
use crate::kdtree::{Hit, SceneTree, Shape};
use glam::{Affine3A, DAffine3, DVec3, Vec3};

/// Half the distance from 1 to the next `f32`.
const U: f64 = f32::EPSILON as f64 / 2.0;

/// Bound on the movement of a triangle by its test, relative to the distance to its farthest corner.
pub const TEST_ERROR: f64 = 32.0 * U;

#[derive(Clone, Copy, Debug)]
pub enum Solid {
    Triangle([DVec3; 3]),
    Quad([DVec3; 4]),
    Sphere { center: DVec3, radius: f64 },
    Plane { point: DVec3, normal: DVec3 },
}

#[derive(Clone, Copy, Debug)]
struct ReferenceItem {
    solid: Solid,
    /// Growth of relative errors by the transform into the space of an instance, and the size of its translations there
    /// and back; 0 for primitives in world space.
    condition: f64,
    reach: f64,
}

/// The primitives of one scene.
#[derive(Debug)]
pub struct ReferenceIntersector {
    items: Vec<ReferenceItem>,
    /// Start of each object in `items`.
    starts: Vec<usize>,
}

/// Result of checking one hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CheckResult {
    /// Distance from the named primitive over its bound: at most 1.
    Right(f64),
    /// The same ratio above 1, or the distance by which a nearer sure hit lies in front.
    WrongT(f64),
    /// No hit was reported, but there is a sure hit.
    Missed,
}

impl ReferenceIntersector {
    pub fn of(scene: &SceneTree) -> Self {
        let (mut items, mut starts) = (Vec::new(), Vec::new());
        for shape in scene.shapes() {
            starts.push(items.len());
            let mut push = |solid, map: Option<&Affine3A>| {
                let (condition, reach) = map.map_or((0.0, 0.0), cost_of_map);
                items.push(ReferenceItem { solid, condition, reach });
            };
            match shape {
                Shape::Triangle { vertices } => push(Solid::Triangle(vertices.map(Vec3::as_dvec3)), None),
                Shape::Quad { corner, edge_u, edge_v } => {
                    push(Solid::Quad(quad_corners(*corner, *edge_u, *edge_v).map(Vec3::as_dvec3)), None);
                }
                Shape::Sphere { center, radius } => {
                    push(Solid::Sphere { center: center.as_dvec3(), radius: f64::from(*radius) }, None);
                }
                Shape::Plane { point, normal } => {
                    push(Solid::Plane { point: point.as_dvec3(), normal: normal.as_dvec3().normalize() }, None);
                }
                Shape::Mesh { tree, world_from_object: map, .. } => {
                    let wide = widened(map);
                    for prim in 0..tree.n_triangles() as u32 {
                        let corners = tree.vertices(prim).map(|v| wide.transform_point3(v.as_dvec3()));
                        push(Solid::Triangle(corners), (*map != Affine3A::IDENTITY).then_some(map));
                    }
                }
                Shape::Spheres { tree, world_from_object: map } => {
                    let wide = widened(map);
                    for prim in 0..tree.len() as u32 {
                        let (center, radius) = tree.sphere(prim);
                        let center = wide.transform_point3(center.as_dvec3());
                        let radius = f64::from(radius) * wide.matrix3.x_axis.length();
                        push(Solid::Sphere { center, radius }, Some(map));
                    }
                }
            }
        }
        Self { items, starts }
    }

    pub fn solid(&self, hit: &Hit) -> &Solid {
        &self.item(hit).solid
    }

    fn item(&self, hit: &Hit) -> &ReferenceItem {
        &self.items[self.starts[hit.object as usize] + hit.prim as usize]
    }

    /// Checks whether the hit lies on its primitive, in constant time.
    pub fn check_hit(&self, ray: &Ray, hit: &Hit) -> CheckResult {
        let item = self.item(hit);
        let (origin, dir) = (ray.origin.as_dvec3(), ray.dir.as_dvec3());
        // Relative to the origin of the ray: differences of `f32` numbers are exact in `f64`, sums far from zero are
        // not.
        let way = f64::from(hit.t) * dir;
        let ratio = item.seen_from(origin).distance(way) / item.bound(origin, way.length());
        // NaN is wrong as well.
        if hit.t > 0.0 && hit.t < ray.t_max && ratio <= 1.0 {
            CheckResult::Right(ratio)
        } else {
            CheckResult::WrongT(ratio)
        }
    }

    /// Like [`check_hit`](Self::check_hit), and checks by brute force whether there is anything in front.
    pub fn check(&self, ray: &Ray, hit: Option<&Hit>) -> CheckResult {
        let found = hit.map_or(f64::INFINITY, |hit| f64::from(hit.t));
        let length = ray.dir.as_dvec3().length();
        for item in &self.items {
            let Some((t, margin)) = item.sure_hit(ray) else { continue };
            if t + margin < found && t + margin < f64::from(ray.t_max) {
                return match hit {
                    None => CheckResult::Missed,
                    Some(_) => {
                        CheckResult::WrongT(1.0 + (found - t) * length / (margin * length).max(f64::MIN_POSITIVE))
                    }
                };
            }
        }
        hit.map_or(CheckResult::Right(0.0), |hit| self.check_hit(ray, hit))
    }

    /// Winding number of the closed surface around `point`: ±1 inside, 0 outside (van Oosterom and Strackee 1983).
    pub fn winding(&self, point: Vec3) -> f64 {
        let point = point.as_dvec3();
        let solid_angle = |[a, b, c]: [DVec3; 3]| {
            let [a, b, c] = [a - point, b - point, c - point];
            let (la, lb, lc) = (a.length(), b.length(), c.length());
            let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
            2.0 * f64::atan2(a.dot(b.cross(c)), below)
        };
        let total: f64 = (self.items.iter())
            .map(|item| match item.solid {
                Solid::Triangle(corners) => solid_angle(corners),
                Solid::Quad([a, b, c, d]) => solid_angle([a, b, c]) + solid_angle([a, c, d]),
                _ => 0.0,
            })
            .sum();
        total / (4.0 * std::f64::consts::PI)
    }

    /// Whether `point` is farther from all surfaces than a test from there may move them.
    pub fn is_clear(&self, point: Vec3) -> bool {
        let point = point.as_dvec3();
        self.items.iter().all(|item| item.distance(point) > 2.0 * item.bound(point, 0.0))
    }
}

impl ReferenceItem {
    fn seen_from(&self, origin: DVec3) -> Self {
        let solid = match self.solid {
            Solid::Triangle(corners) => Solid::Triangle(corners.map(|p| p - origin)),
            Solid::Quad(corners) => Solid::Quad(corners.map(|p| p - origin)),
            Solid::Sphere { center, radius } => Solid::Sphere { center: center - origin, radius },
            Solid::Plane { point, normal } => Solid::Plane { point: point - origin, normal },
        };
        Self { solid, ..*self }
    }

    /// Distance from the surface.
    fn distance(&self, point: DVec3) -> f64 {
        match self.solid {
            Solid::Triangle(corners) => (closest_on_triangle(point, &corners) - point).length(),
            Solid::Quad([a, b, c, d]) => {
                let of = |corners: [DVec3; 3]| (closest_on_triangle(point, &corners) - point).length();
                of([a, b, c]).min(of([a, c, d]))
            }
            Solid::Sphere { center, radius } => ((point - center).length() - radius).abs(),
            Solid::Plane { point: of_plane, normal } => (point - of_plane).dot(normal).abs(),
        }
    }

    /// Bound on the distance between the surface as seen by a ray from `origin` and the true one.
    ///
    /// - `travelled`: distance to the hit, metres.
    fn bound(&self, origin: DVec3, travelled: f64) -> f64 {
        let reach = match self.solid {
            Solid::Triangle(corners) => farthest(origin, &corners) * TEST_ERROR,
            Solid::Quad(corners) => farthest(origin, &corners) * TEST_ERROR,
            // Computed in f64 and rounded once, along the ray; the second term is the rounding of f64.
            Solid::Sphere { center, radius } => 2.0 * U * travelled + 1e-13 * ((center - origin).length() + radius),
            Solid::Plane { point, .. } => 2.0 * U * travelled + 1e-13 * (point - origin).length(),
        };
        let size = travelled + origin.abs().max_element() + self.reach;
        reach + 16.0 * U * self.condition * size + f64::from(f32::MIN_POSITIVE)
    }

    /// Returns `t` of the first intersection in front that exists under every movement of the surface within its bound,
    /// and the bound on the error of `t`.
    fn sure_hit(&self, ray: &Ray) -> Option<(f64, f64)> {
        let (origin, dir) = (ray.origin.as_dvec3(), ray.dir.as_dvec3());
        match self.solid {
            Solid::Triangle(corners) => self.sure_triangle(origin, dir, &corners),
            Solid::Quad([a, b, c, d]) => {
                self.sure_triangle(origin, dir, &[a, b, c]).or_else(|| self.sure_triangle(origin, dir, &[a, c, d]))
            }
            Solid::Sphere { center, radius } => {
                let (length, to_center) = (dir.length(), center - origin);
                let unit = dir / length;
                let middle = to_center.dot(unit);
                let half_squared = radius * radius - (to_center - middle * unit).length_squared();
                let bound = self.bound(origin, to_center.length() + radius);
                // Moved by the bound, the sphere is still hit.
                if half_squared <= 4.0 * radius * bound {
                    return None;
                }
                let half = half_squared.sqrt();
                let margin = 2.0 * bound * radius / half;
                let near = if middle - half > margin { middle - half } else { middle + half };
                (near > margin && (middle - half).abs() > margin).then(|| (near / length, margin / length))
            }
            Solid::Plane { point, normal } => {
                let (height, speed) = ((point - origin).dot(normal), dir.dot(normal));
                let (t, length) = (height / speed, dir.length());
                let bound = self.bound(origin, t.abs() * length);
                let margin = bound / speed.abs();
                (t.is_finite() && t > margin && speed.abs() > 1e-9 * length).then_some((t, margin))
            }
        }
    }

    fn sure_triangle(&self, origin: DVec3, dir: DVec3, corners: &[DVec3; 3]) -> Option<(f64, f64)> {
        let [a, b, c] = corners.map(|p| p - origin);
        let length = dir.length();
        let normal = (b - a).cross(c - a).try_normalize()?;
        let cos = normal.dot(dir) / length;
        let t = a.dot(normal) / (cos * length);
        let margin = self.bound(origin, t.abs() * length) / cos.abs();
        if !(t.is_finite() && t * length > margin) {
            return None;
        }
        let point = t * dir;
        let inside = [(a, b), (b, c), (c, a)].into_iter().all(|(p, q)| {
            let inwards = normal.cross(q - p).normalize_or_zero();
            (point - p).dot(inwards) > margin
        });
        inside.then_some((t, margin / length))
    }
}

fn farthest(origin: DVec3, corners: &[DVec3]) -> f64 {
    corners.iter().fold(0.0, |farthest, corner| f64::max(farthest, (*corner - origin).length()))
}

fn widened(map: &Affine3A) -> DAffine3 {
    DAffine3::from_mat3_translation(map.matrix3.as_dmat3(), map.translation.as_dvec3())
}

/// Returns the condition number of the matrix, and the size of the translation there and back, in world units.
fn cost_of_map(map: &Affine3A) -> (f64, f64) {
    let there = widened(map);
    let back = there.inverse();
    let size = |m: &DAffine3| {
        let (x, y, z) = (m.matrix3.x_axis.abs(), m.matrix3.y_axis.abs(), m.matrix3.z_axis.abs());
        (x + y + z).max_element()
    };
    let reach = there.translation.abs().max_element() + size(&there) * back.translation.abs().max_element();
    (size(&there) * size(&back), reach)
}

/// The closest point of a triangle. Source: Ericson 2005, "Real-Time Collision Detection", section 5.1.5.
fn closest_on_triangle(p: DVec3, &[a, b, c]: &[DVec3; 3]) -> DVec3 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    // Inside: only the plane matters, and its normal avoids the cancellation of areas of a needle.
    let normal = ab.cross(ac).normalize_or_zero();
    p - normal * ap.dot(normal)
}
