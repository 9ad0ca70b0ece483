//! The elements of a `<transform>` as matrices.
//!
//! A camera or light looks along +Z of its own space, and +X points to its left.

use glam::{DMat3, DMat4, DVec3, DVec4};

/// A rotation about an axis, degrees.
///
/// - `old`: the file is of version 0.x, which scales axes to unit length. Mitsuba 3 does not: about an axis of another
///   length, cos · I + sin · [a]ₓ + (1 − cos) · a aᵀ is no rotation.
pub(crate) fn rotation(axis: DVec3, degrees: f64, old: bool) -> Result<DMat4, String> {
    let unit = axis.try_normalize().ok_or("the axis of a rotation is zero")?;
    let axis = if old { unit } else { axis };
    // Quarter turns are exact: walls of boxes stay where they are.
    let (sin, cos) = match degrees.rem_euclid(360.0) {
        0.0 => (0.0, 1.0),
        90.0 => (1.0, 0.0),
        180.0 => (0.0, -1.0),
        270.0 => (-1.0, 0.0),
        _ => degrees.to_radians().sin_cos(),
    };
    let column = |v: DVec3| (v * cos + axis.cross(v) * sin + axis * (axis.dot(v) * (1.0 - cos))).extend(0.0);
    Ok(DMat4::from_cols(column(DVec3::X), column(DVec3::Y), column(DVec3::Z), DVec4::W))
}

/// From the space of a camera at `origin` that looks at `target`.
pub(crate) fn look_at(origin: DVec3, target: DVec3, up: DVec3) -> Result<DMat4, String> {
    let forward = (target - origin).try_normalize().ok_or("`origin` and `target` of a lookat are the same point")?;
    let up = if up == DVec3::ZERO { forward.any_orthonormal_vector() } else { up };
    let left = up.cross(forward).try_normalize().ok_or("`up` of a lookat lies along the view direction")?;
    let up = forward.cross(left);
    Ok(DMat4::from_cols(left.extend(0.0), up.extend(0.0), forward.extend(0.0), origin.extend(1.0)))
}

/// Rows of 16 or 9 numbers.
pub(crate) fn matrix(numbers: &[f64]) -> Result<DMat4, String> {
    match *numbers {
        [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p] => {
            Ok(DMat4::from_cols_array(&[a, e, i, m, b, f, j, n, c, g, k, o, d, h, l, p]))
        }
        [a, b, c, d, e, f, g, h, i] => {
            Ok(DMat4::from_cols_array(&[a, d, g, 0.0, b, e, h, 0.0, c, f, i, 0.0, 0.0, 0.0, 0.0, 1.0]))
        }
        _ => Err("a matrix has 16 numbers, or 9".to_owned()),
    }
}

/// The rotation, with a mirror if the matrix has one, that is nearest to the axes of a matrix: of the first axis exactly;
/// `None` if it is flat. Matrices in files are rounded.
pub(crate) fn orthonormal(matrix: DMat3) -> Option<DMat3> {
    let x = matrix.x_axis.try_normalize()?;
    let z = x.cross(matrix.y_axis).try_normalize()?;
    let mirror = 1_f64.copysign(matrix.determinant());
    (matrix.determinant() != 0.0).then(|| DMat3::from_cols(x, z.cross(x), mirror * z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_looks_along_its_z_and_x_is_left() {
        let matrix = look_at(DVec3::new(0.0, 0.0, 5.0), DVec3::ZERO, DVec3::Y).unwrap();
        assert_eq!(matrix.transform_point3(DVec3::Z), DVec3::new(0.0, 0.0, 4.0));
        assert_eq!(matrix.transform_vector3(DVec3::Y), DVec3::Y);
        // To the right of a camera that looks along -Z is +X.
        assert_eq!(matrix.transform_vector3(DVec3::X), DVec3::NEG_X);
        assert!(matrix.determinant() > 0.0);
    }

    #[test]
    fn rotations_are_counter_clockwise_and_quarters_exact() {
        let quarter = rotation(DVec3::new(0.0, 0.0, 7.0), 90.0, true).unwrap();
        assert_eq!(quarter.transform_vector3(DVec3::X), DVec3::Y);
        let some = rotation(DVec3::new(1.0, 2.0, -0.5), 33.0, true).unwrap();
        let expected = DMat4::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 33_f64.to_radians());
        assert!(some.abs_diff_eq(expected, 1e-15));
        assert!(rotation(DVec3::ZERO, 1.0, true).is_err());
        // `ScalarTransform4f().rotate([0, 1, 1], 15)` of Mitsuba 3.9.1.
        let rows = [
            [0.9659258, -0.258_819_04, 0.258_819_04],
            [0.258_819_04, 1.0, 0.034_074_19],
            [-0.258_819_04, 0.034_074_19, 1.0],
        ];
        let found = DMat3::from_mat4(rotation(DVec3::new(0.0, 1.0, 1.0), 15.0, false).unwrap());
        assert!(found.transpose().abs_diff_eq(DMat3::from_cols_array_2d(&rows), 1e-7), "{found}");
    }
}
