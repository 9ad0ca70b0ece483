//! Transforms: a matrix, or a position with axes, scale and rotation.

use crate::tungsten::fields::{Fields, vector};
use glam::{DAffine3, DMat3, DVec3};
use serde_json::Value;

/// Squared length below which an axis counts as parallel to another.
const PARALLEL: f64 = 1e-5;

impl Fields<'_> {
    /// The placement of an object; the identity if it has none.
    pub(crate) fn transform(&self, name: &str) -> DAffine3 {
        let Some(value) = self.get(name) else { return DAffine3::IDENTITY };
        transform(value).unwrap_or_else(|| {
            self.tell(format!("`{name}` is no transform, and has no effect"));
            DAffine3::IDENTITY
        })
    }
}

fn transform(value: &Value) -> Option<DAffine3> {
    if let Some(rows) = value.as_array() {
        let rows: Vec<f64> = rows.iter().map(Value::as_f64).collect::<Option<_>>()?;
        let at = |row: usize, column: usize| rows[4 * row + column];
        let column = |column| DVec3::new(at(0, column), at(1, column), at(2, column));
        return (rows.len() == 16)
            .then(|| DAffine3 { matrix3: DMat3::from_cols(column(0), column(1), column(2)), translation: column(3) });
    }
    let map = value.as_object()?;
    let given = |name: &str| map.get(name).map(|value| vector(value).ok_or(()));
    let get = |name: &str| given(name).transpose();
    let position = get("position").ok()?.unwrap_or(DVec3::ZERO);
    let toward = get("look_at").ok()?.map(|point| point - position);
    let [x, y, z] = [get("x_axis").ok()?, get("y_axis").ok()?.or(get("up").ok()?), get("z_axis").ok()?.or(toward)];
    let mut matrix = axes(x, y, z);
    if let Some(scale) = get("scale").ok()? {
        matrix *= DMat3::from_diagonal(scale);
    }
    if let Some(degrees) = get("rotation").ok()? {
        matrix = rotation(degrees) * matrix;
    }
    Some(DAffine3 { matrix3: matrix, translation: position })
}

/// Three axes at right angles; those that are given count in the order in which Tungsten takes them.
fn axes(x: Option<DVec3>, y: Option<DVec3>, z: Option<DVec3>) -> DMat3 {
    let order = match [z.is_some(), y.is_some(), x.is_some()] {
        [false, false, true] => [0, 2, 1],
        [false, true, false] => [1, 2, 0],
        [false, true, true] => [1, 0, 2],
        [true, false, true] => [2, 0, 1],
        _ => [2, 1, 0],
    };
    let given = [x, y, z];
    let mut axes = [0, 1, 2].map(|i| given[i].unwrap_or(DVec3::AXES[i]));
    let [a, b, c] = order;
    axes[a] = axes[a].try_normalize().unwrap_or(DVec3::AXES[a]);
    let across = axes[b].reject_from_normalized(axes[a]);
    axes[b] = match across.length_squared() < PARALLEL {
        true => axes[a].cross(if axes[a].x.abs() > axes[a].y.abs() { DVec3::Y } else { DVec3::X }).normalize(),
        false => across.normalize(),
    };
    let across = axes[c].reject_from_normalized(axes[a]).reject_from_normalized(axes[b]);
    axes[c] = match across.length_squared() < PARALLEL {
        true => axes[a].cross(axes[b]),
        false => across.normalize(),
    };
    let mut matrix = DMat3::from_cols_array_2d(&axes.map(Into::into));
    if matrix.determinant() < 0.0 {
        match given {
            [None, ..] => matrix.x_axis = -matrix.x_axis,
            [_, None, _] => matrix.y_axis = -matrix.y_axis,
            _ => matrix.z_axis = -matrix.z_axis,
        }
    }
    matrix
}

/// About Z, then X, then Y.
fn rotation(degrees: DVec3) -> DMat3 {
    let [x, y, z] = degrees.to_array().map(f64::to_radians);
    // Its turn about Y is the other way round.
    DMat3::from_rotation_y(-y) * DMat3::from_rotation_x(x) * DMat3::from_rotation_z(z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn axes_are_at_right_angles_and_keep_what_is_given() {
        let camera = transform(&json!({"position": [0, 1, 6.8], "look_at": [0, 1, 0], "up": [0, 1, 0]})).unwrap();
        assert_eq!(camera.translation, DVec3::new(0.0, 1.0, 6.8));
        assert_eq!(camera.matrix3, DMat3::from_cols(-DVec3::X, DVec3::Y, -DVec3::Z));
        let up = DVec3::new(1.0, 2.0, 3.0).normalize();
        let turned = axes(None, Some(2.0 * up), None);
        assert!((turned.y_axis - up).length() < 1e-12 && (turned.determinant() - 1.0).abs() < 1e-12, "{turned}");
        let parallel = axes(None, Some(DVec3::Z), Some(DVec3::Z));
        assert!((parallel.determinant() - 1.0).abs() < 1e-12 && parallel.z_axis == DVec3::Z, "{parallel}");
    }

    /// The matrix of its documentation of rotations, entry by entry.
    #[test]
    fn a_rotation_is_that_of_tungsten() {
        let degrees = DVec3::new(20.0, -50.0, 110.0);
        let [x, y, z] = degrees.to_array().map(f64::to_radians);
        let rows = [
            [
                y.cos() * z.cos() - y.sin() * x.sin() * z.sin(),
                -y.cos() * z.sin() - y.sin() * x.sin() * z.cos(),
                -y.sin() * x.cos(),
            ],
            [x.cos() * z.sin(), x.cos() * z.cos(), -x.sin()],
            [
                y.sin() * z.cos() + y.cos() * x.sin() * z.sin(),
                -y.sin() * z.sin() + y.cos() * x.sin() * z.cos(),
                y.cos() * x.cos(),
            ],
        ];
        let expected = DMat3::from_cols_array_2d(&rows).transpose();
        assert!(rotation(degrees).abs_diff_eq(expected, 1e-12), "{}\n{expected}", rotation(degrees));
    }

    #[test]
    fn a_matrix_is_written_in_rows() {
        let matrix = transform(&json!([1, 0, 0, 5, 0, 2, 0, 6, 0, 0, 3, 7, 0, 0, 0, 1])).unwrap();
        assert_eq!(matrix.transform_point3(DVec3::ONE), DVec3::new(6.0, 8.0, 10.0));
        assert!(transform(&json!([1, 2])).is_none() && transform(&json!({"scale": "big"})).is_none());
    }
}
