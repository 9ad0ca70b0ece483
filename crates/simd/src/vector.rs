//! Sixteen vectors of three.

use super::number::{Bits, Float, select};
use super::simd::{Mask, Simd};
use glam::Vec3;
use std::ops::{Add, Mul, Neg, Sub};

/// Sixteen [`Vec3`], one register a coordinate; every operation rounds as glam's does.
#[derive(Clone, Copy)]
pub struct Vector<S: Simd> {
    pub x: Float<S>,
    pub y: Float<S>,
    pub z: Float<S>,
}

/// `a` where the bit is set, else `b`.
#[inline(always)]
pub fn select_vector<S: Simd>(mask: Mask, a: Vector<S>, b: Vector<S>) -> Vector<S> {
    Vector { x: select(mask, a.x, b.x), y: select(mask, a.y, b.y), z: select(mask, a.z, b.z) }
}

/// The axes across a unit normal; see `Frame::around` of `firstlight_kdtree::geometry`.
#[inline(always)]
pub fn frame_around<S: Simd>(normal: Vector<S>) -> [Vector<S>; 3] {
    let Vector { x, y, z } = normal;
    let sign = z.all(1.0).copysign(z);
    let a = z.all(-1.0) / (sign + z);
    let b = x * y * a;
    [
        Vector { x: sign * x * x * a + 1.0, y: sign * b, z: -sign * x },
        Vector { x: b, y: sign + y * y * a, z: -y },
        normal,
    ]
}

impl<S: Simd> Vector<S> {
    #[inline(always)]
    pub fn splat(s: S, v: Vec3) -> Self {
        Self { x: Float::splat(s, v.x), y: Float::splat(s, v.y), z: Float::splat(s, v.z) }
    }

    #[inline(always)]
    pub fn gather(from: &[Vec<f32>; 3], indices: Bits<S>) -> Self {
        Self {
            x: Float::gather(&from[0], indices),
            y: Float::gather(&from[1], indices),
            z: Float::gather(&from[2], indices),
        }
    }

    #[inline(always)]
    pub fn dot(self, other: Self) -> Float<S> {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    #[inline(always)]
    pub fn cross(self, other: Self) -> Self {
        Self {
            x: self.y * other.z - other.y * self.z,
            y: self.z * other.x - other.z * self.x,
            z: self.x * other.y - other.x * self.y,
        }
    }

    #[inline(always)]
    pub fn length_squared(self) -> Float<S> {
        self.dot(self)
    }

    #[inline(always)]
    pub fn length(self) -> Float<S> {
        self.dot(self).sqrt()
    }

    #[inline(always)]
    pub fn normalize(self) -> Self {
        self * (self.x.all(1.0) / self.length())
    }

    #[inline(always)]
    pub fn abs(self) -> Self {
        Self { x: self.x.abs(), y: self.y.abs(), z: self.z.abs() }
    }

    /// Coordinate by coordinate.
    #[inline(always)]
    pub fn times(self, other: Self) -> Self {
        Self { x: self.x * other.x, y: self.y * other.y, z: self.z * other.z }
    }

    /// Coordinate by coordinate.
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        Self { x: self.x.max(other.x), y: self.y.max(other.y), z: self.z.max(other.z) }
    }

    #[inline(always)]
    pub fn max_element(self) -> Float<S> {
        self.x.max(self.y).max(self.z)
    }

    /// Lanes that are zero in all coordinates.
    #[inline(always)]
    pub fn is_zero(self) -> Mask {
        self.x.is_zero() & self.y.is_zero() & self.z.is_zero()
    }

    /// From coordinates along these axes.
    #[inline(always)]
    pub fn to_world(self, axes: &[Self; 3]) -> Self {
        axes[0] * self.x + axes[1] * self.y + axes[2] * self.z
    }

    #[inline(always)]
    pub fn to_local(self, axes: &[Self; 3]) -> Self {
        Self { x: axes[0].dot(self), y: axes[1].dot(self), z: axes[2].dot(self) }
    }

    #[inline(always)]
    pub fn mul_all(self, x: f32) -> Self {
        Self { x: self.x * x, y: self.y * x, z: self.z * x }
    }

    /// The vector of one lane of stored coordinates.
    #[inline(always)]
    pub fn to_arrays(self) -> [[f32; super::LANES]; 3] {
        [self.x.to_array(), self.y.to_array(), self.z.to_array()]
    }

    #[inline(always)]
    pub fn from_arrays(s: S, arrays: &[[f32; super::LANES]; 3]) -> Self {
        Self { x: Float::load(s, &arrays[0]), y: Float::load(s, &arrays[1]), z: Float::load(s, &arrays[2]) }
    }
}

impl<S: Simd> Add for Vector<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { x: self.x + other.x, y: self.y + other.y, z: self.z + other.z }
    }
}

impl<S: Simd> Sub for Vector<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { x: self.x - other.x, y: self.y - other.y, z: self.z - other.z }
    }
}

impl<S: Simd> Mul<Float<S>> for Vector<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, x: Float<S>) -> Self {
        Self { x: self.x * x, y: self.y * x, z: self.z * x }
    }
}

impl<S: Simd> Neg for Vector<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { x: -self.x, y: -self.y, z: -self.z }
    }
}
