//! Numbers of arrays, which Python passes as bytes in the order of the machine.

use crate::errors::input;
use firstlight::glam::{DAffine3, DMat3, DVec3, Vec2, Vec3, Vec4};
use firstlight::render::{ImageTexture, Texels};
use firstlight::scene::Placement;
use pyo3::prelude::*;
use pyo3::types::PyByteArray;

/// All groups of `N` numbers of eight bytes.
fn doubles<const N: usize>(bytes: &[u8]) -> impl Iterator<Item = [f64; N]> + '_ {
    let number = |bytes: &[u8]| f64::from_ne_bytes(bytes.try_into().expect("eight bytes"));
    bytes.chunks_exact(8 * N).map(move |group| std::array::from_fn(|i| number(&group[8 * i..8 * i + 8])))
}

/// All groups of `N` numbers of four bytes.
fn floats<const N: usize>(bytes: &[u8]) -> impl Iterator<Item = [f32; N]> + '_ {
    let number = |bytes: &[u8]| f32::from_ne_bytes(bytes.try_into().expect("four bytes"));
    bytes.chunks_exact(4 * N).map(move |group| std::array::from_fn(|i| number(&group[4 * i..4 * i + 4])))
}

pub fn numbers(bytes: &[u8]) -> Vec<f64> {
    doubles::<1>(bytes).map(|[number]| number).collect()
}

pub fn points(bytes: &[u8]) -> Vec<DVec3> {
    doubles(bytes).map(DVec3::from_array).collect()
}

pub fn vec2s(bytes: &[u8]) -> Vec<Vec2> {
    floats(bytes).map(Vec2::from_array).collect()
}

pub fn vec3s(bytes: &[u8]) -> Vec<Vec3> {
    floats(bytes).map(Vec3::from_array).collect()
}

pub fn vec4s(bytes: &[u8]) -> Vec<Vec4> {
    floats(bytes).map(Vec4::from_array).collect()
}

/// Triangles, by three indices of four bytes.
pub fn triangles(bytes: &[u8]) -> Vec<[u32; 3]> {
    let index = |bytes: &[u8]| u32::from_ne_bytes(bytes.try_into().expect("four bytes"));
    bytes.chunks_exact(12).map(|group| std::array::from_fn(|i| index(&group[4 * i..4 * i + 4]))).collect()
}

pub fn slots(bytes: &[u8]) -> Vec<u16> {
    bytes.chunks_exact(2).map(|pair| u16::from_ne_bytes([pair[0], pair[1]])).collect()
}

/// Placements, each by three rows of four numbers: rotation, scale and shear, and the translation last.
pub fn placements(bytes: &[u8]) -> Vec<Placement> {
    let placement = |m: [f64; 12]| {
        let row = |i: usize| DVec3::new(m[4 * i], m[4 * i + 1], m[4 * i + 2]);
        let matrix3 = DMat3::from_cols(row(0), row(1), row(2)).transpose();
        Placement::from(DAffine3 { matrix3, translation: DVec3::new(m[3], m[7], m[11]) })
    };
    doubles(bytes).map(placement).collect()
}

/// An image of a texture: width, height, channels, and its numbers: one byte each, or four for a floating-point number.
#[derive(FromPyObject)]
pub struct ImageArray(u32, u32, usize, Vec<u8>);

impl ImageArray {
    pub fn image(self) -> PyResult<ImageTexture> {
        let Self(width, height, channels, data) = self;
        let n = width as usize * height as usize;
        if n == 0 {
            return Err(input("an image needs pixels"));
        }
        if data.len() == n * channels && (1..=4).contains(&channels) {
            return Ok(ImageTexture { width, height, texels: Texels::U8 { channels, data } });
        }
        let texels: Vec<Vec3> = vec3s(&data);
        if channels != 3 || texels.len() != n {
            return Err(input("an image has one to four channels of bytes, or three of floating-point numbers"));
        }
        match texels.iter().position(|texel| !texel.is_finite() || texel.min_element() < 0.0) {
            Some(i) => Err(input(format!("pixel {i} of the image is negative, NaN or infinite"))),
            None => Ok(ImageTexture::from_linear(width, height, texels)),
        }
    }
}

/// Numbers of four bytes for numpy, which takes the memory over.
pub fn bytes_of<'py, const N: usize>(
    py: Python<'py>,
    n: usize,
    values: impl Iterator<Item = [[u8; 4]; N]>,
) -> PyResult<Bound<'py, PyByteArray>> {
    PyByteArray::new_with(py, 4 * N * n, |bytes| {
        for (group, value) in bytes.chunks_exact_mut(4 * N).zip(values) {
            group.copy_from_slice(value.as_flattened());
        }
        Ok(())
    })
}
