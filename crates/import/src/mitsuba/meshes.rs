//! Shapes as meshes: files of other programs with Mitsuba's rules for normals and texture coordinates, and the shapes
//! that ours lack.

use crate::mitsuba::serialized::{UnpackedBytes, read_serialized};
use crate::model::imported::{ModelNormals, ModelOptions};
use crate::obj::load_obj_with;
use crate::ply::load_ply_with;
use firstlight_format::model_format::ModelFormat;
use firstlight_mesh::{Mesh, NormalWeight};
use glam::{DVec3, Vec2, Vec3};
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

/// Segments around a disk or a cylinder: its edge is off by 2·10⁻⁵ of the radius.
const SEGMENTS: u32 = 512;

/// Where the triangles come from.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Geometry {
    Model(ModelFormat, PathBuf),
    Serialized(PathBuf, u32),
    Cube,
    Disk,
    /// About +Z, from 0 to 1, radius 1, open.
    Cylinder,
}

impl Geometry {
    /// The file, if it is one.
    pub(crate) fn file(&self) -> Option<&Path> {
        match self {
            Self::Model(_, path) | Self::Serialized(path, _) => Some(path),
            Self::Cube | Self::Disk | Self::Cylinder => None,
        }
    }
}

/// A mesh to be made. Equal ones are made once.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct MeshRequest {
    pub geometry: Geometry,
    /// Whether v is turned over: images are the other way up in OBJ.
    pub flip_v: bool,
    pub face_normals: bool,
    pub flip_normals: bool,
    /// Whether a normal map needs tangents.
    pub tangents: bool,
}

impl MeshRequest {
    /// Makes the mesh.
    ///
    /// - `room`: of all serialized meshes of the scene.
    ///
    /// # Errors
    /// A sentence about the file.
    pub(crate) fn make(&self, room: &UnpackedBytes) -> Result<Mesh, String> {
        let mut mesh = match &self.geometry {
            Geometry::Model(format, path) => {
                // Mitsuba smooths every edge of a file without normals.
                let normals = match self.face_normals {
                    true => ModelNormals::Ignore,
                    false => ModelNormals::FileOrComputed { crease_angle: std::f32::consts::PI },
                };
                let options = ModelOptions { normals, ..ModelOptions::default() };
                let model = match format {
                    ModelFormat::Obj => load_obj_with(path, &options).map_err(|error| error.to_string())?,
                    _ => load_ply_with(path, &options).map_err(|error| error.to_string())?,
                };
                Mesh { slots: Vec::new(), ..model.mesh }
            }
            Geometry::Serialized(path, index) => {
                let read = read_serialized(path, *index, room).map_err(|why| format!("{}: {why}", path.display()))?;
                match read.mesh.normals.is_empty() && !read.face_normals && !self.face_normals {
                    true => read.mesh.with_smooth_normals(NormalWeight::Angle, None),
                    false if read.face_normals || self.face_normals => read.mesh.flat(),
                    false => read.mesh,
                }
            }
            Geometry::Cube => cube(),
            Geometry::Disk => disk(),
            Geometry::Cylinder => cylinder(),
        };
        if self.flip_v {
            mesh.uvs.iter_mut().for_each(|uv| uv.y = 1.0 - uv.y);
        }
        if self.flip_normals {
            mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
            mesh.normals.iter_mut().for_each(|normal| *normal = -*normal);
        }
        if self.tangents {
            mesh = mesh.with_tangents();
            // The bitangent is normal × tangent, also where the texture is mirrored.
            mesh.tangents.iter_mut().for_each(|tangent| tangent.w = 1.0);
        }
        Ok(mesh)
    }
}

/// From corners with normals and texture coordinates.
fn built(vertices: Vec<(DVec3, DVec3, [f64; 2])>, triangles: Vec<[u32; 3]>) -> Mesh {
    let positions: Vec<DVec3> = vertices.iter().map(|vertex| vertex.0).collect();
    let mesh = Mesh::from_f64(&positions, triangles).expect("the shape is one");
    let normals: Vec<Vec3> = vertices.iter().map(|vertex| vertex.1.as_vec3()).collect();
    let uvs = vertices.iter().map(|vertex| Vec2::new(vertex.2[0] as f32, vertex.2[1] as f32)).collect();
    Mesh { normals, uvs, ..mesh }
}

/// From −1 to 1 along each axis; every side has the whole texture.
fn cube() -> Mesh {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    // Normal, and the directions of u and v.
    let sides = [
        (DVec3::NEG_Y, DVec3::Z, DVec3::X),
        (DVec3::Y, DVec3::NEG_X, DVec3::NEG_Z),
        (DVec3::X, DVec3::Y, DVec3::Z),
        (DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y),
        (DVec3::NEG_X, DVec3::NEG_Y, DVec3::Z),
        (DVec3::NEG_Z, DVec3::NEG_X, DVec3::Y),
    ];
    for (normal, u, v) in sides {
        let first = vertices.len() as u32;
        // Counter-clockwise seen from outside, whatever the handedness of the texture.
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        vertices.extend(corners.map(|[a, b]| (normal + (2.0 * a - 1.0) * u + (2.0 * b - 1.0) * v, normal, [a, b])));
        let is_right = u.cross(v).dot(normal) > 0.0;
        for triangle in [[0, 1, 2], [0, 2, 3]] {
            let [a, b, c] = triangle.map(|corner| first + corner);
            triangles.push(if is_right { [a, b, c] } else { [a, c, b] });
        }
    }
    built(vertices, triangles)
}

/// Radius 1 in the plane z = 0, facing +Z; u is the radius and v the angle.
fn disk() -> Mesh {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for i in 0..=SEGMENTS {
        let share = f64::from(i) / f64::from(SEGMENTS);
        let (sin, cos) = (TAU * f64::from(i % SEGMENTS) / f64::from(SEGMENTS)).sin_cos();
        vertices.push((DVec3::new(cos, sin, 0.0), DVec3::Z, [1.0, share]));
        // One vertex in the middle per segment: its angle is that of the segment.
        vertices.push((DVec3::ZERO, DVec3::Z, [0.0, share + 0.5 / f64::from(SEGMENTS)]));
    }
    triangles.extend((0..SEGMENTS).map(|i| [2 * i + 1, 2 * i, 2 * i + 2]));
    built(vertices, triangles)
}

/// Facing outwards; u is the angle and v the height.
fn cylinder() -> Mesh {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for i in 0..=SEGMENTS {
        let share = f64::from(i) / f64::from(SEGMENTS);
        let (sin, cos) = (TAU * f64::from(i % SEGMENTS) / f64::from(SEGMENTS)).sin_cos();
        let around = DVec3::new(cos, sin, 0.0);
        vertices.push((around, around, [share, 0.0]));
        vertices.push((around + DVec3::Z, around, [share, 1.0]));
    }
    for i in 0..SEGMENTS {
        let [a, b, c, d] = [0, 1, 2, 3].map(|k| 2 * i + k);
        triangles.extend([[a, c, d], [a, d, b]]);
    }
    built(vertices, triangles)
}

#[cfg(test)]
mod tests {
    use super::*;
    use firstlight_mesh::Topology;
    use std::f64::consts::PI;

    #[test]
    fn shapes_have_their_sizes_and_face_outwards() {
        let cube = cube();
        assert!(Topology::of(&cube).is_closed());
        assert!((cube.signed_volume() - 8.0).abs() < 1e-6);
        for (name, mesh, area) in [("disk", disk(), PI), ("cylinder", cylinder(), TAU)] {
            assert!((mesh.area() / area - 1.0).abs() < 3e-5, "{name}: {}", mesh.area());
            for (t, triangle) in mesh.triangles.iter().enumerate() {
                let normal = mesh.doubled_area_normal(t);
                triangle.iter().for_each(|&v| assert!(normal.dot(mesh.normals[v as usize].as_dvec3()) > 0.0, "{name}"));
            }
        }
    }
}
