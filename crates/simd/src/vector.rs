//! Three-component vectors, one or sixteen at a time.

use super::number::{Bits, Float};
use super::real::{Real, select};
use super::simd::Simd;
use glam::Vec3;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A [`Vec3`], or sixteen with one register per coordinate; every operation rounds like glam's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vector3<R> {
    /// Coordinate along x.
    pub x: R,
    /// Coordinate along y.
    pub y: R,
    /// Coordinate along z.
    pub z: R,
}

/// Sixteen [`Vec3`].
pub type Vector<S> = Vector3<Float<S>>;

impl From<Vec3> for Vector3<f32> {
    #[inline(always)]
    fn from(Vec3 { x, y, z }: Vec3) -> Self {
        Self { x, y, z }
    }
}

impl From<Vector3<f32>> for Vec3 {
    #[inline(always)]
    fn from(Vector3 { x, y, z }: Vector3<f32>) -> Self {
        Self { x, y, z }
    }
}

/// `a` where the mask is true, else `b`.
#[inline(always)]
pub fn select_vector<R: Real>(mask: R::Mask, a: Vector3<R>, b: Vector3<R>) -> Vector3<R> {
    Vector3 { x: select(mask, a.x, b.x), y: select(mask, a.y, b.y), z: select(mask, a.z, b.z) }
}

/// Returns a right-handed orthonormal basis whose last axis is the given unit normal.
///
/// Source: Duff et al. 2017, "Building an Orthonormal Basis, Revisited".
#[inline(always)]
pub fn frame_around<R: Real>(normal: Vector3<R>) -> [Vector3<R>; 3] {
    let Vector3 { x, y, z } = normal;
    let sign = z.all(1.0).copysign(z);
    let a = z.all(-1.0) / (sign + z);
    let b = x * y * a;
    [
        Vector3 { x: sign * x * x * a + 1.0, y: sign * b, z: -sign * x },
        Vector3 { x: b, y: sign + y * y * a, z: -y },
        normal,
    ]
}

impl<R: Real> Vector3<R> {
    /// The same vector in all lanes; `like` determines the number of lanes.
    #[inline(always)]
    pub fn in_all(like: R, v: Vec3) -> Self {
        Self { x: like.all(v.x), y: like.all(v.y), z: like.all(v.z) }
    }

    /// The vector with the same number in all three coordinates.
    #[inline(always)]
    pub fn all(x: R) -> Self {
        Self { x, y: x, z: x }
    }

    /// Dot product.
    #[inline(always)]
    pub fn dot(self, other: Self) -> R {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    /// Cross product.
    #[inline(always)]
    pub fn cross(self, other: Self) -> Self {
        Self {
            x: self.y * other.z - other.y * self.z,
            y: self.z * other.x - other.z * self.x,
            z: self.x * other.y - other.x * self.y,
        }
    }

    /// Squared Euclidean length.
    #[inline(always)]
    pub fn length_squared(self) -> R {
        self.dot(self)
    }

    /// Euclidean length.
    #[inline(always)]
    pub fn length(self) -> R {
        self.dot(self).sqrt()
    }

    /// The vector scaled to unit length; not finite for the zero vector.
    #[inline(always)]
    pub fn normalize(self) -> Self {
        self * (self.x.all(1.0) / self.length())
    }

    /// The vector scaled to unit length; `other` where its length is zero or not finite.
    #[inline(always)]
    pub fn normalize_or(self, other: Self) -> Self {
        let per_length = self.x.all(1.0) / self.length();
        let has_length = per_length.is_positive() & per_length.lt(per_length.all(f32::INFINITY));
        select_vector(has_length, self * per_length, other)
    }

    /// Absolute values of the coordinates.
    #[inline(always)]
    pub fn abs(self) -> Self {
        Self { x: self.x.abs(), y: self.y.abs(), z: self.z.abs() }
    }

    /// Componentwise product.
    #[inline(always)]
    pub fn times(self, other: Self) -> Self {
        Self { x: self.x * other.x, y: self.y * other.y, z: self.z * other.z }
    }

    /// Componentwise maximum.
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        Self { x: self.x.max(other.x), y: self.y.max(other.y), z: self.z.max(other.z) }
    }

    /// Componentwise quotient.
    #[inline(always)]
    pub fn over(self, other: Self) -> Self {
        Self { x: self.x / other.x, y: self.y / other.y, z: self.z / other.z }
    }

    /// Componentwise minimum.
    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        Self { x: self.x.min(other.x), y: self.y.min(other.y), z: self.z.min(other.z) }
    }

    /// The largest coordinate.
    #[inline(always)]
    pub fn max_element(self) -> R {
        self.x.max(self.y).max(self.z)
    }

    /// Whether all coordinates are zero.
    #[inline(always)]
    pub fn is_zero(self) -> R::Mask {
        self.x.is_zero() & self.y.is_zero() & self.z.is_zero()
    }

    /// Converts from coordinates along these axes.
    #[inline(always)]
    pub fn to_world(self, axes: &[Self; 3]) -> Self {
        axes[0] * self.x + axes[1] * self.y + axes[2] * self.z
    }

    /// Converts to coordinates along these axes.
    #[inline(always)]
    pub fn to_local(self, axes: &[Self; 3]) -> Self {
        Self { x: axes[0].dot(self), y: axes[1].dot(self), z: axes[2].dot(self) }
    }

    /// The vector times a number shared by all lanes.
    #[inline(always)]
    pub fn mul_all(self, x: f32) -> Self {
        Self { x: self.x * x, y: self.y * x, z: self.z * x }
    }
}

impl<S: Simd> Vector<S> {
    /// `v` in all lanes.
    #[inline(always)]
    pub fn splat(s: S, v: Vec3) -> Self {
        Self { x: Float::splat(s, v.x), y: Float::splat(s, v.y), z: Float::splat(s, v.z) }
    }

    /// Looks up one vector per index in tables of x, y and z; see [`Simd::gather`].
    #[inline(always)]
    pub fn gather(from: &[Vec<f32>; 3], indices: Bits<S>) -> Self {
        Self {
            x: Float::gather(&from[0], indices),
            y: Float::gather(&from[1], indices),
            z: Float::gather(&from[2], indices),
        }
    }

    /// The x, y and z of all lanes as three arrays.
    #[inline(always)]
    pub fn to_arrays(self) -> [[f32; super::LANES]; 3] {
        [self.x.to_array(), self.y.to_array(), self.z.to_array()]
    }

    /// Creates vectors from arrays of x, y and z, one lane per entry.
    #[inline(always)]
    pub fn from_arrays(s: S, arrays: &[[f32; super::LANES]; 3]) -> Self {
        Self { x: Float::load(s, &arrays[0]), y: Float::load(s, &arrays[1]), z: Float::load(s, &arrays[2]) }
    }
}

impl<R: Real> Add for Vector3<R> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { x: self.x + other.x, y: self.y + other.y, z: self.z + other.z }
    }
}

impl<R: Real> Sub for Vector3<R> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { x: self.x - other.x, y: self.y - other.y, z: self.z - other.z }
    }
}

impl<R: Real> Mul<R> for Vector3<R> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, x: R) -> Self {
        Self { x: self.x * x, y: self.y * x, z: self.z * x }
    }
}

impl<R: Real> Div<R> for Vector3<R> {
    type Output = Self;
    #[inline(always)]
    fn div(self, x: R) -> Self {
        Self { x: self.x / x, y: self.y / x, z: self.z / x }
    }
}

impl<R: Real> Neg for Vector3<R> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { x: -self.x, y: -self.y, z: -self.z }
    }
}
