//! Transforms of objects from object space to the world, in `f64`.

use crate::bounds::{MAX_COORDINATE, MIN_SIZE};
use crate::parts::{ScalePart, TransformPart};
use glam::{DAffine3, DMat3, DQuat, DVec3, EulerRot};

/// From object space to the world: `linear` is applied first, about `pivot`, then `translation`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "ecs", derive(bevy_ecs::component::Component))]
pub struct Placement {
    /// Metres.
    pub translation: DVec3,
    /// Rotation, scale and shear.
    pub linear: Linear,
    /// The point of object space that only `translation` moves.
    pub pivot: DVec3,
}

/// The linear part of a placement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Linear {
    /// Scaled along the axes of object space, then rotated.
    Turned {
        /// Degrees about the fixed axes X, then Y, then Z.
        rotation_deg: DVec3,
        /// Factors; negative ones mirror.
        scale: DVec3,
    },
    /// Any other matrix, including shear.
    Matrix(DMat3),
}

impl Default for Linear {
    fn default() -> Self {
        Self::Turned { rotation_deg: DVec3::ZERO, scale: DVec3::ONE }
    }
}

impl Linear {
    /// Rotation in degrees and scale as in [`Linear::Turned`]; `None` for a matrix with shear. Axes of a matrix that are
    /// perpendicular, or as long as each other, to the rounding of `f32` are so exactly here: files have such matrices.
    pub fn rotation_and_scale(&self) -> Option<(DVec3, DVec3)> {
        const ROUNDING: f64 = 16.0 * f32::EPSILON as f64;
        let matrix = match *self {
            Self::Turned { rotation_deg, scale } => return Some((rotation_deg, scale)),
            Self::Matrix(matrix) => matrix,
        };
        let axes = [matrix.x_axis, matrix.y_axis, matrix.z_axis];
        let lengths = DVec3::from_array(axes.map(DVec3::length));
        let units = [0, 1, 2].map(|i| axes[i] / lengths[i]);
        let is_square = [(0, 1), (1, 2), (2, 0)].iter().all(|&(i, j)| units[i].dot(units[j]).abs() <= ROUNDING);
        if !is_square {
            return None;
        }
        let is_even = lengths.max_element() - lengths.min_element() <= ROUNDING * lengths.max_element();
        let lengths = if is_even { DVec3::splat(lengths.element_sum() / 3.0) } else { lengths };
        // A mirrored one is turned after its X axis was flipped.
        let handedness = matrix.determinant().signum();
        let x = (handedness * units[0]).normalize();
        let y = (units[1] - x * units[1].dot(x)).normalize();
        let turn = DQuat::from_mat3(&DMat3::from_cols(x, y, x.cross(y)));
        let (z, y, x) = turn.to_euler(EulerRot::ZYX);
        Some((DVec3::new(x, y, z).map(tidy_degrees), lengths * DVec3::new(handedness, 1.0, 1.0)))
    }
}

/// Radians to degrees. A billionth of a degree is invisible, and rounding to it removes the rounding errors of right
/// angles.
pub fn tidy_degrees(angle: f64) -> f64 {
    (angle.to_degrees() * 1e9).round() / 1e9 + 0.0
}

impl Placement {
    /// At a point, without rotation or scale.
    pub fn at(translation: DVec3) -> Self {
        Self { translation, ..Self::default() }
    }

    /// Checks whether a scene file may have it.
    ///
    /// # Errors
    /// If it is not finite, is too far away, or flattens what it places: a sentence without a full stop.
    pub fn check(&self) -> Result<(), String> {
        let affine = self.affine();
        let determinant = affine.matrix3.determinant();
        if !affine.is_finite() || affine.translation.abs().max_element() > MAX_COORDINATE {
            return Err(format!("the transform must be finite and move by at most {MAX_COORDINATE:e} m"));
        }
        if !(MIN_SIZE.powi(3)..f64::INFINITY).contains(&determinant.abs()) {
            return Err("the transform flattens the object: no scale may be 0".to_owned());
        }
        Ok(())
    }

    /// The placement that a transform in a scene file describes.
    pub fn from_part(part: &TransformPart) -> Self {
        if let Some([x, y, z]) = part.matrix {
            let row = |row: [f64; 4]| DVec3::new(row[0], row[1], row[2]);
            let linear = DMat3::from_cols(row(x), row(y), row(z)).transpose();
            return Self { linear: Linear::Matrix(linear), ..Self::at(DVec3::new(x[3], y[3], z[3])) };
        }
        let scale = part.scale.map_or(DVec3::ONE, |scale| scale.0);
        Self {
            translation: part.translate.unwrap_or(DVec3::ZERO),
            linear: Linear::Turned { rotation_deg: part.rotate.unwrap_or(DVec3::ZERO), scale },
            pivot: part.pivot.unwrap_or(DVec3::ZERO),
        }
    }

    /// The placement as in a scene file.
    pub fn to_part(&self) -> TransformPart {
        let differs = |value: DVec3, from: DVec3| (value != from).then_some(value);
        match self.linear {
            Linear::Turned { rotation_deg, scale } => TransformPart {
                translate: differs(self.translation, DVec3::ZERO),
                rotate: differs(rotation_deg, DVec3::ZERO),
                scale: differs(scale, DVec3::ONE).map(ScalePart),
                pivot: differs(self.pivot, DVec3::ZERO),
                matrix: None,
            },
            Linear::Matrix(linear) => {
                let (rows, translation) = (linear.transpose(), self.affine().translation);
                let row = |i: usize| {
                    let DVec3 { x, y, z } = rows.col(i);
                    [x, y, z, translation[i]]
                };
                TransformPart { matrix: Some([row(0), row(1), row(2)]), ..TransformPart::default() }
            }
        }
    }

    /// The linear part as a matrix.
    pub fn linear(&self) -> DMat3 {
        match self.linear {
            Linear::Turned { rotation_deg, scale } => {
                let [about_x, about_y, about_z] = rotation_deg.to_array().map(sin_cos_deg);
                let ((sx, cx), (sy, cy), (sz, cz)) = (about_x, about_y, about_z);
                let x = DMat3::from_cols(DVec3::X, DVec3::new(0.0, cx, sx), DVec3::new(0.0, -sx, cx));
                let y = DMat3::from_cols(DVec3::new(cy, 0.0, -sy), DVec3::Y, DVec3::new(sy, 0.0, cy));
                let z = DMat3::from_cols(DVec3::new(cz, sz, 0.0), DVec3::new(-sz, cz, 0.0), DVec3::Z);
                z * y * x * DMat3::from_diagonal(scale)
            }
            Linear::Matrix(linear) => linear,
        }
    }

    /// The whole transform.
    pub fn affine(&self) -> DAffine3 {
        let matrix3 = self.linear();
        // Without a pivot, to the last bit.
        let by_pivot = if self.pivot == DVec3::ZERO { DVec3::ZERO } else { self.pivot - matrix3 * self.pivot };
        DAffine3 { matrix3, translation: self.translation + by_pivot }
    }

    /// Where the origin of the object is, or would be if it were not rotated, metres. Unlike the translation, it stays as it
    /// is when an object that is not rotated gets another pivot, and when one turns about its pivot.
    pub fn position(&self) -> DVec3 {
        match self.linear {
            Linear::Turned { scale, .. } => self.translation + self.pivot - scale * self.pivot,
            Linear::Matrix(_) => self.translation,
        }
    }

    /// The same placement with another pivot.
    pub fn with_pivot(&self, pivot: DVec3) -> Self {
        if pivot == self.pivot {
            return *self;
        }
        let DAffine3 { matrix3, translation } = self.affine();
        Self { translation: translation + matrix3 * pivot - pivot, pivot, ..*self }
    }

    /// The scale factor, if it is the same in all directions.
    pub fn even_scale(&self) -> Option<f64> {
        let linear = self.linear();
        let squared = linear.x_axis.length_squared();
        // Rounding in a rotation changes dot products of the axes by a few parts in 10¹⁶.
        let tolerance = 1e-12 * squared;
        let even =
            [linear.y_axis, linear.z_axis].iter().all(|axis| (axis.length_squared() - squared).abs() <= tolerance);
        let square = [(linear.x_axis, linear.y_axis), (linear.y_axis, linear.z_axis), (linear.z_axis, linear.x_axis)]
            .iter()
            .all(|(a, b)| a.dot(*b).abs() <= tolerance);
        (even && square && squared > 0.0).then(|| squared.sqrt())
    }
}

impl From<DAffine3> for Placement {
    fn from(affine: DAffine3) -> Self {
        // What only moves is described by its position in scene files.
        let is_moved = affine.matrix3 == DMat3::IDENTITY;
        let linear = if is_moved { Linear::default() } else { Linear::Matrix(affine.matrix3) };
        Self { linear, ..Self::at(affine.translation) }
    }
}

/// Sine and cosine; exact for multiples of 90 degrees.
fn sin_cos_deg(angle: f64) -> (f64, f64) {
    match angle.rem_euclid(360.0) {
        0.0 => (0.0, 1.0),
        90.0 => (1.0, 0.0),
        180.0 => (0.0, -1.0),
        270.0 => (-1.0, 0.0),
        other => other.to_radians().sin_cos(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scale_comes_first_then_x_y_z_then_the_move() {
        let placement = Placement {
            translation: DVec3::new(10.0, 0.0, 0.0),
            linear: Linear::Turned { rotation_deg: DVec3::new(90.0, 90.0, 0.0), scale: DVec3::new(1.0, 2.0, 3.0) },
            pivot: DVec3::ZERO,
        };
        // (0, 1, 0) → scaled (0, 2, 0) → about X (0, 0, 2) → about Y (2, 0, 0) → translated (12, 0, 0).
        let point = placement.affine().transform_point3(DVec3::Y);
        assert!(point.abs_diff_eq(DVec3::new(12.0, 0.0, 0.0), 1e-12), "{point}");
    }

    #[test]
    fn turning_agrees_with_quaternions() {
        for rotation_deg in
            [DVec3::new(10.0, 20.0, 30.0), DVec3::new(-100.0, 181.0, 720.5), DVec3::new(90.0, -90.0, 180.0)]
        {
            let DVec3 { x, y, z } = rotation_deg.map(f64::to_radians);
            let expected = DMat3::from_quat(DQuat::from_euler(EulerRot::ZYX, z, y, x));
            let linear = Linear::Turned { rotation_deg, scale: DVec3::ONE };
            let placement = Placement { linear, ..Placement::default() };
            assert!(placement.linear().abs_diff_eq(expected, 1e-12), "{rotation_deg}");
        }
    }

    #[test]
    fn a_matrix_says_the_same_as_its_parts() {
        let turned = Placement {
            translation: DVec3::new(1.0, 2.0, 3.0),
            linear: Linear::Turned { rotation_deg: DVec3::new(10.0, 20.0, 30.0), scale: DVec3::splat(0.5) },
            pivot: DVec3::new(0.5, -1.0, 2.0),
        };
        let matrix = Placement { linear: Linear::Matrix(turned.linear()), ..turned };
        assert_eq!(Placement::from_part(&matrix.to_part()).affine(), turned.affine());
        assert_eq!(Placement::from_part(&turned.to_part()), turned);
        // Its pivot is only moved.
        let at = turned.affine().transform_point3(turned.pivot);
        assert!(at.abs_diff_eq(turned.translation + turned.pivot, 1e-12), "{at}");
        let other = turned.with_pivot(DVec3::new(-3.0, 0.2, 1.0));
        assert!(other.affine().abs_diff_eq(turned.affine(), 1e-12));
        assert!(other.with_pivot(turned.pivot).translation.abs_diff_eq(turned.translation, 1e-12));
        assert!((turned.even_scale().unwrap() - 0.5).abs() < 1e-15);
    }

    #[test]
    fn a_matrix_without_shear_has_a_rotation_and_a_scale() {
        for rotation_deg in [DVec3::ZERO, DVec3::new(10.0, 20.0, 30.0), DVec3::new(-100.0, 90.0, 45.0)] {
            for scale in [DVec3::splat(0.01), DVec3::new(1.0, 2.0, 3.0), DVec3::new(-1.0, 2.0, 0.5)] {
                let turned = Placement { linear: Linear::Turned { rotation_deg, scale }, ..Placement::default() };
                let exact = turned.linear();
                // As in a file with `f32`.
                for matrix in [exact, exact.as_mat3().as_dmat3()] {
                    let (found, found_scale) = Linear::Matrix(matrix).rotation_and_scale().unwrap();
                    let parts = Linear::Turned { rotation_deg: found, scale: found_scale };
                    let again = Placement { linear: parts, ..turned }.linear();
                    assert!(again.abs_diff_eq(exact, 2e-6 * scale.length()), "{rotation_deg} {scale}: {found}");
                    assert_eq!(found_scale.min_element() == found_scale.max_element(), scale == DVec3::splat(0.01));
                }
            }
        }
        assert_eq!(Linear::Matrix(DMat3::from_rotation_y(0.5)).rotation_and_scale().unwrap().1, DVec3::ONE);
        let sheared = DMat3::from_cols(DVec3::X, DVec3::new(1e-4, 1.0, 0.0), DVec3::Z);
        assert_eq!(Linear::Matrix(sheared).rotation_and_scale(), None);
    }

    #[test]
    fn a_transform_becomes_a_placement() {
        let moved = Placement::at(DVec3::new(1.0, 2.0, 3.0));
        assert_eq!(Placement::from(moved.affine()), moved);
        let sheared = DMat3::from_cols(DVec3::X, DVec3::new(0.1, 1.0, 0.0), DVec3::Z);
        let affine = DAffine3 { matrix3: sheared, translation: DVec3::Y };
        assert_eq!(Placement::from(affine).affine(), affine);
    }

    #[test]
    fn stretched_or_sheared_is_not_even() {
        let stretched = Linear::Turned { rotation_deg: DVec3::splat(20.0), scale: DVec3::new(1.0, 1.0, 1.001) };
        assert_eq!(Placement { linear: stretched, ..Placement::default() }.even_scale(), None);
        let sheared = Linear::Matrix(DMat3::from_cols(DVec3::X, DVec3::new(0.1, 1.0, 0.0).normalize(), DVec3::Z));
        assert_eq!(Placement { linear: sheared, ..Placement::default() }.even_scale(), None);
    }
}
