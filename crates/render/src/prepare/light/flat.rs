//! Emissive quads and triangles, seen from one point or from sixteen.

use crate::sampling::{SphericalQuad, SphericalTriangle, uniform_triangle};
use firstlight_kdtree::geometry::robust::{gamma, offset_along};
use firstlight_simd::{Elementary, Real, Truth, Vector3, select};

/// Solid angle in steradians below which flat lights are sampled by area: the two pdfs hardly differ then, while the
/// inversion of angles loses its last digits. Both are exact; sampling and pdf agree on the choice.
const SMALL_SOLID_ANGLE: f32 = 1e-3;

/// Flat lights whose centre is farther away than this are sampled by area: squared distance over the sum of squared
/// edges. The variation of distance and cosine over such a light is small compared to other variation, and sampling by
/// area is faster: by 5 % of the time of a room with a light in its ceiling, at a 3 % larger error.
const NEAR: f32 = 1.5;

/// Solid angle above which (half a sphere) the spherical triangle formulas lose theirs.
const LARGE_SOLID_ANGLE: f32 = 6.0;

/// A parallelogram.
#[derive(Clone, Copy, Debug)]
pub(crate) struct QuadLight<R: Real> {
    pub corner: Vector3<R>,
    /// Unit vectors along the edges.
    pub units: [Vector3<R>; 2],
    /// Lengths of the edges, metres.
    pub lengths: [R; 2],
    /// Unit, on the emitting side.
    pub normal: Vector3<R>,
    /// Area in square metres.
    pub area: R,
    /// Bound on the error of its points along the normal, metres.
    pub lift: R,
    /// Whether its edges are perpendicular.
    pub is_rectangle: R::Mask,
}

/// A triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TriangleLight<R> {
    pub first: Vector3<R>,
    /// Edges from the first vertex to the others.
    pub edges: [Vector3<R>; 2],
    /// As in [`QuadLight`].
    pub normal: Vector3<R>,
    pub area: R,
    pub lift: R,
}

/// A sampled point.
pub(crate) struct FlatPoint<R: Real> {
    /// Whether there is a visible point.
    pub found: R::Mask,
    /// End of a shadow ray, offset from the light by the error bound.
    pub target: Vector3<R>,
    /// Unit, towards the light.
    pub wi: Vector3<R>,
    /// Pdf per steradian.
    pub pdf: R,
    /// Position along the edges, 0..1.
    pub uv: [R; 2],
}

impl QuadLight<f32> {
    /// The same quad in all lanes.
    #[inline(always)]
    pub fn in_all<R: Real>(&self, like: R) -> QuadLight<R> {
        let Self { corner, units: [u, v], lengths, normal, area, lift, is_rectangle } = *self;
        let zero = like.all(0.0);
        // No closures, which would not be compiled for the instruction set.
        QuadLight {
            corner: Vector3::in_all(like, corner.into()),
            units: [Vector3::in_all(like, u.into()), Vector3::in_all(like, v.into())],
            lengths: [like.all(lengths[0]), like.all(lengths[1])],
            normal: Vector3::in_all(like, normal.into()),
            area: like.all(area),
            lift: like.all(lift),
            is_rectangle: if is_rectangle { zero.is_zero() } else { zero.is_positive() },
        }
    }
}

impl<R: Elementary> QuadLight<R> {
    /// Samples a point of the front: uniformly over the solid angle for rectangles where that is stable and `by_angle`,
    /// otherwise over the area.
    ///
    /// - `asked`: lanes to sample; `u`: two independent uniform numbers in `[0, 1)`.
    #[inline(always)]
    pub fn sample(&self, by_angle: bool, asked: R::Mask, position: Vector3<R>, u: [R; 2]) -> FlatPoint<R> {
        let Self { corner, units, lengths, normal, .. } = *self;
        let relative = corner - position;
        let seen = asked & relative.dot(normal).is_negative();
        let (mut uv, mut angle) = (u, None);
        let near = self.is_near(relative);
        if by_angle && (near & seen).any() {
            let quad = self.seen_from(relative);
            let large = near & is_large(quad.solid_angle());
            if (large & seen).any() {
                let [x, y] = quad.sample(u);
                uv = [select(large, x, u[0]), select(large, y, u[1])];
            }
            angle = Some((large, quad.solid_angle()));
        }
        let point = corner + units[0] * (uv[0] * lengths[0]) + units[1] * (uv[1] * lengths[1]);
        flat_point([point, position, normal], uv, [self.area, self.lift], seen, angle)
    }

    /// Pdf of [`Self::sample`], per steradian.
    ///
    /// - `wi`, `distance`: to the point, unit and in metres.
    #[inline(always)]
    pub fn pdf(&self, by_angle: bool, position: Vector3<R>, wi: Vector3<R>, distance: R) -> R {
        let pdf = front_pdf(distance, -wi.dot(self.normal), self.area);
        let relative = self.corner - position;
        let near = self.is_near(relative);
        if !(by_angle && near.any()) {
            return pdf;
        }
        let angle = self.seen_from(relative).solid_angle();
        select(near & is_large(angle), angle.all(1.0) / angle, pdf)
    }

    /// Whether it is a rectangle that is sampled by solid angle from there; see [`NEAR`].
    ///
    /// - `relative`: the corner relative to the shading point.
    #[inline(always)]
    fn is_near(&self, relative: Vector3<R>) -> R::Mask {
        let [u, v] = self.lengths;
        let middle = relative + self.units[0] * (u * 0.5) + self.units[1] * (v * 0.5);
        self.is_rectangle & middle.length_squared().le((u * u + v * v) * NEAR)
    }

    /// - `relative`: the corner relative to the shading point.
    #[inline(always)]
    fn seen_from(&self, relative: Vector3<R>) -> SphericalQuad<R> {
        let (x, y) = (relative.dot(self.units[0]), relative.dot(self.units[1]));
        SphericalQuad::new(Vector3 { x, y, z: relative.dot(self.normal) }, self.lengths, self.area)
    }
}

impl<R: Elementary> TriangleLight<R> {
    /// Like [`QuadLight::sample`].
    #[inline(always)]
    pub fn sample(&self, by_angle: bool, asked: R::Mask, position: Vector3<R>, u: [R; 2]) -> FlatPoint<R> {
        let Self { first, edges: [e1, e2], normal, area, .. } = *self;
        let (relative, one) = (first - position, area.all(1.0));
        let mut seen = asked & relative.dot(normal).is_negative();
        let (mut uv, mut angle) = (uniform_triangle(u), None);
        let near = self.is_near(relative);
        if by_angle && (near & seen).any() {
            let triangle = SphericalTriangle::new(relative, e1, e2);
            let stable = near & is_stable(triangle.solid_angle());
            if (stable & seen).any() {
                let (dir, has_area) = triangle.sample(u);
                seen &= !stable | has_area;
                // Intersection of the direction with the plane (Möller and Trumbore 1997).
                let p = dir.cross(e2);
                let per_determinant = one / p.dot(e1);
                let from = -relative;
                let b1 = (from.dot(p) * per_determinant).at_least(0.0).at_most(1.0);
                let b2 = (dir.dot(from.cross(e1)) * per_determinant).at_least(0.0).at_most(1.0);
                let over = (b1 + b2).at_least(1.0);
                uv = [select(stable, b1 / over, uv[0]), select(stable, b2 / over, uv[1])];
            }
            angle = Some((stable, triangle.solid_angle()));
        }
        let point = first + e1 * uv[0] + e2 * uv[1];
        flat_point([point, position, normal], uv, [area, self.lift], seen, angle)
    }

    /// Like [`QuadLight::pdf`].
    #[inline(always)]
    pub fn pdf(&self, by_angle: bool, position: Vector3<R>, wi: Vector3<R>, distance: R) -> R {
        let pdf = front_pdf(distance, -wi.dot(self.normal), self.area);
        let relative = self.first - position;
        let near = self.is_near(relative);
        if !(by_angle && near.any()) {
            return pdf;
        }
        let angle = SphericalTriangle::new(relative, self.edges[0], self.edges[1]).solid_angle();
        select(near & is_stable(angle), angle.all(1.0) / angle, pdf)
    }

    /// Like [`QuadLight::is_near`], relative to the first vertex.
    #[inline(always)]
    fn is_near(&self, relative: Vector3<R>) -> R::Mask {
        let [u, v] = self.edges;
        let middle = relative + (u + v) * self.area.all(1.0 / 3.0);
        middle.length_squared().le((u.length_squared() + v.length_squared()) * NEAR)
    }
}

/// Converts a sampled point to a light sample seen from `position`.
///
/// - `angle`: whether it was sampled by solid angle, and that.
#[inline(always)]
fn flat_point<R: Real>(
    [point, position, normal]: [Vector3<R>; 3],
    uv: [R; 2],
    [area, lift]: [R; 2],
    seen: R::Mask,
    angle: Option<(R::Mask, R)>,
) -> FlatPoint<R> {
    let offset = point - position;
    let distance = offset.length();
    let one = distance.all(1.0);
    let wi = offset * (one / distance);
    let cos = -wi.dot(normal);
    let front = cos.is_positive() & area.is_positive();
    let (mut pdf, mut valid) = (pdf_by_area(distance, cos, area), front);
    if let Some((by_angle, solid_angle)) = angle {
        (pdf, valid) = (select(by_angle, one / solid_angle, pdf), by_angle | front);
    }
    // The rounding of the point, and the error of the kernel for rays from this distance that end at the light.
    let lift = lift + distance * gamma(16) * (normal.x.abs() + normal.y.abs() + normal.z.abs());
    let found = seen & distance.is_positive() & valid;
    FlatPoint { found, target: offset_along(point, lift, normal), wi, pdf, uv }
}

/// [`pdf_by_area`] for the front; 0 for the back.
#[inline(always)]
fn front_pdf<R: Real>(distance: R, cos: R, area: R) -> R {
    select(cos.is_positive() & area.is_positive(), pdf_by_area(distance, cos, area), distance.all(0.0))
}

/// Pdf per steradian of points that are uniform over an area.
///
/// - `distance`: metres; `cos`: cosine at the light; `area`: square metres.
#[inline(always)]
pub(crate) fn pdf_by_area<R: Real>(distance: R, cos: R, area: R) -> R {
    distance * distance / (cos * area)
}

#[inline(always)]
fn is_large<R: Real>(solid_angle: R) -> R::Mask {
    solid_angle.all(SMALL_SOLID_ANGLE).le(solid_angle)
}

#[inline(always)]
fn is_stable<R: Real>(solid_angle: R) -> R::Mask {
    is_large(solid_angle) & solid_angle.le(solid_angle.all(LARGE_SOLID_ANGLE))
}
