//! Vectors as one array per coordinate.

use glam::Vec3;

pub(crate) fn push(to: &mut [Vec<f32>; 3], v: Vec3) {
    to.iter_mut().zip(v.to_array()).for_each(|(array, x)| array.push(x));
}
