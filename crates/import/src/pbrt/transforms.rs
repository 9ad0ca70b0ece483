//! Transforms of pbrt, and from its world to ours.
//!
//! pbrt is left-handed, and any direction may be up in its scenes. Our world is right-handed with +Y up, so the scene is
//! turned until the axis that is up in the image is +Y, and mirrored in depth if the camera is not mirrored already (most
//! exporters of right-handed programs write `Scale -1 1 1` or the like before it).

use glam::{DAffine3, DMat3, DVec3};

/// A rotation by degrees about an axis of any length; none if it has no length.
pub(crate) fn rotation(degrees: f64, axis: DVec3) -> DAffine3 {
    axis.try_normalize().map_or(DAffine3::IDENTITY, |axis| DAffine3::from_axis_angle(axis, degrees.to_radians()))
}

/// From the world to a camera at `eye` that looks along +z, with +y up and +x to the right; `None` without a direction.
pub(crate) fn look_at([eye, target, up]: [DVec3; 3]) -> Option<DAffine3> {
    let forward = (target - eye).try_normalize()?;
    let right = up.try_normalize()?.cross(forward).try_normalize()?;
    let world_from_camera = DMat3::from_cols(right, forward.cross(right), forward);
    Some(DAffine3::from_mat3_translation(world_from_camera, eye).inverse())
}

/// From the world of a pbrt scene to ours.
///
/// - `camera_from_world`: regular; `up`: the direction that is up in the scene, in its world.
pub(crate) fn world_for(camera_from_world: &DAffine3, up: DVec3) -> DMat3 {
    let size = up.abs();
    let axis = usize::from(size.y > size.x.max(size.z)) + 2 * usize::from(size.z > size.x && size.z >= size.y);
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    // Columns: where the axes of the scene go.
    let turned = match (axis, up[axis] < 0.0) {
        (0, false) => DMat3::from_cols(y, -x, z),
        (0, true) => DMat3::from_cols(-y, x, z),
        (1, false) => DMat3::IDENTITY,
        (1, true) => DMat3::from_cols(x, -y, -z),
        (_, false) => DMat3::from_cols(x, -z, y),
        (_, true) => DMat3::from_cols(x, z, -y),
    };
    let is_mirrored = camera_from_world.matrix3.determinant() < 0.0;
    if is_mirrored { turned } else { DMat3::from_diagonal(DVec3::new(1.0, 1.0, -1.0)) * turned }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_camera_of_look_at_sees_its_target_ahead() {
        let [eye, target, up] = [DVec3::new(1.0, 2.0, 3.0), DVec3::new(1.0, 2.0, 8.0), DVec3::Y];
        let camera = look_at([eye, target, up]).unwrap();
        assert!((camera.transform_point3(target) - DVec3::new(0.0, 0.0, 5.0)).length() < 1e-12);
        // Left-handed: looking along +z with +y up, +x is to the right.
        assert!((camera.transform_vector3(DVec3::X) - DVec3::X).length() < 1e-12);
        assert_eq!(look_at([eye, eye, up]), None);
        assert_eq!(look_at([eye, target, DVec3::Z]), None);
    }

    #[test]
    fn up_becomes_y_and_right_stays_right() {
        let turn = DMat3::from_rotation_x(0.3);
        for up in [DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z] {
            for mirror in [1.0, -1.0] {
                let forward = up.any_orthonormal_vector();
                let right = mirror * up.cross(forward);
                let axes = DMat3::from_cols(right, up, forward) * turn;
                let camera_from_world = DAffine3::from_mat3(axes).inverse();
                let world = world_for(&camera_from_world, up);
                assert!((world * up - DVec3::Y).length() < 1e-12, "{up}");
                // What is on the right in pbrt's image is on the right of a right-handed camera.
                let [right, up, forward] = [0, 1, 2].map(|i| world * axes.col(i));
                assert!((forward.cross(up) - right).length() < 1e-12, "{up} {mirror}");
            }
        }
    }
}
