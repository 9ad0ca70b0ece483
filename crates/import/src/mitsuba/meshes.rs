//! Shapes as meshes: files of other programs with Mitsuba's rules for normals and texture coordinates, and the shapes
//! that ours lack.

use crate::error::together::MeshesTooLarge;
use crate::mitsuba::serialized::{UnpackedBytes, read_serialized};
use crate::model::imported::{ModelNormals, ModelOptions};
use crate::model::mesh_budget::MeshBudget;
use crate::model::placing::{made_mesh, oriented};
use crate::obj::load_obj_with;
use crate::ply::load_ply_colored;
use crate::ply::vertices::ColourSource;
use firstlight_files::warnings::Warnings;
use firstlight_format::model_format::ModelFormat;
use firstlight_mesh::{Mesh, NormalWeight, procedural};
use glam::DVec3;
use std::f64::consts::{PI, TAU};
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
    Rectangle,
    /// About +Z, from 0 to 1, radius 1, open.
    Cylinder,
    /// Of radius 1 about the origin.
    Sphere,
}

impl Geometry {
    /// The file, if it is one.
    pub(crate) fn file(&self) -> Option<&Path> {
        match self {
            Self::Model(_, path) | Self::Serialized(path, _) => Some(path),
            Self::Cube | Self::Disk | Self::Rectangle | Self::Cylinder | Self::Sphere => None,
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
    /// The attribute of the file that is read as colours, `vertex_…` or `face_…`.
    pub attribute: Option<String>,
}

impl MeshRequest {
    fn colors(&self) -> ColourSource<'_> {
        let Some(attribute) = &self.attribute else { return ColourSource::Srgb };
        match attribute.split_once('_') {
            Some((kind, name)) => ColourSource::Attribute { of_faces: kind == "face", name },
            None => ColourSource::Srgb,
        }
    }

    /// Makes the mesh.
    ///
    /// - `room`: of all serialized meshes of the scene; `budget`: of all meshes.
    ///
    /// # Errors
    /// A sentence about the file.
    pub(crate) fn make(&self, room: &UnpackedBytes, budget: &MeshBudget) -> Result<(Mesh, Warnings), String> {
        let mut warnings = Warnings::default();
        let too_large = |error: MeshesTooLarge| match self.geometry.file() {
            Some(path) => format!("{}: {error}", path.display()),
            None => format!("a mesh {error}"),
        };
        // Of a serialized file, no more is read than the mesh.
        let length = match &self.geometry {
            Geometry::Model(_, path) => budget.before(path).map_err(too_large)?,
            _ => 0,
        };
        // In Mitsuba, the side of a surface is that of its shading normal.
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
                    _ => load_ply_colored(path, &options, self.colors()).map_err(|error| error.to_string())?,
                };
                warnings = model.warnings;
                let mesh = Mesh { slots: Vec::new(), ..model.mesh };
                if model.normals_from_file { oriented(mesh, false) } else { mesh }
            }
            Geometry::Serialized(path, index) => {
                let read = read_serialized(path, *index, room).map_err(|why| format!("{}: {why}", path.display()))?;
                match read.mesh.normals.is_empty() && !read.face_normals && !self.face_normals {
                    true => read.mesh.with_smooth_normals(NormalWeight::Angle, None),
                    false if read.face_normals || self.face_normals => read.mesh.flat(),
                    false => oriented(read.mesh, false),
                }
            }
            Geometry::Cube => cube(),
            Geometry::Disk => disk(),
            Geometry::Rectangle => rectangle(),
            Geometry::Cylinder => cylinder(),
            Geometry::Sphere => sphere(),
        };
        if self.flip_v {
            mesh.uvs.iter_mut().for_each(|uv| uv.y = 1.0 - uv.y);
        }
        if self.flip_normals {
            mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
            mesh.normals.iter_mut().for_each(|normal| *normal = -*normal);
        }
        // Without tangents of its own, a triangle has the direction of u as in Mitsuba.
        if self.tangents && is_mirrored(&mesh) {
            mesh = mesh.with_tangents();
            // The bitangent is normal × tangent, also where the texture is mirrored.
            mesh.tangents.iter_mut().for_each(|tangent| tangent.w = 1.0);
        }
        budget.after(length, &mesh).map_err(too_large)?;
        Ok((mesh, warnings))
    }
}

/// Whether the texture is mirrored on any triangle.
fn is_mirrored(mesh: &Mesh) -> bool {
    let uv = |vertex: u32| mesh.uvs.get(vertex as usize).copied().unwrap_or_default();
    mesh.triangles.iter().any(|&[a, b, c]| (uv(b) - uv(a)).perp_dot(uv(c) - uv(a)) < 0.0)
}

/// From −1 to 1 along each axis.
fn cube() -> Mesh {
    let mut mesh = procedural::cube_of(&[
        (DVec3::NEG_Y, DVec3::Z, DVec3::X),
        (DVec3::Y, DVec3::NEG_X, DVec3::NEG_Z),
        (DVec3::X, DVec3::Y, DVec3::NEG_Z),
        (DVec3::Z, DVec3::Y, DVec3::X),
        (DVec3::NEG_X, DVec3::Y, DVec3::Z),
        (DVec3::NEG_Z, DVec3::NEG_Y, DVec3::X),
    ]);
    mesh.positions.iter_mut().for_each(|position| *position *= 2.0);
    mesh
}

/// From −1 to 1 in the plane z = 0, facing +Z.
fn rectangle() -> Mesh {
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let vertex = |[u, v]: [f64; 2]| (DVec3::new(2.0 * u - 1.0, 2.0 * v - 1.0, 0.0), DVec3::Z, [u, v]);
    made_mesh(&corners.map(vertex), vec![[0, 1, 2], [0, 2, 3]])
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
    made_mesh(&vertices, triangles)
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
    made_mesh(&vertices, triangles)
}

/// Facing outwards; u is the angle about +Z, and v that from +Z.
fn sphere() -> Mesh {
    const SECTORS: u32 = 128;
    const RINGS: u32 = SECTORS / 2;
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for k in 0..=RINGS {
        let v = f64::from(k) / f64::from(RINGS);
        let (across, up) = (PI * v).sin_cos();
        for i in 0..=SECTORS {
            // A corner at a pole belongs to one segment: its angle is that of the segment.
            let is_pole = k == 0 || k == RINGS;
            let u = (f64::from(i) + if is_pole { 0.5 } else { 0.0 }) / f64::from(SECTORS);
            let (sin, cos) = (TAU * f64::from(i % SECTORS) / f64::from(SECTORS)).sin_cos();
            let at = if is_pole { DVec3::Z * up.signum() } else { DVec3::new(across * cos, across * sin, up) };
            vertices.push((at, at, [u, v]));
        }
    }
    for k in 0..RINGS {
        for i in 0..SECTORS {
            let a = k * (SECTORS + 1) + i;
            let [b, c, d] = [a + 1, a + SECTORS + 1, a + SECTORS + 2];
            triangles.extend((k > 0).then_some([a, d, b]));
            triangles.extend((k + 1 < RINGS).then_some([a, c, d]));
        }
    }
    made_mesh(&vertices, triangles)
}

#[cfg(test)]
mod tests {
    use super::*;
    use firstlight_mesh::Topology;
    use glam::Vec3;
    use std::f64::consts::PI;

    #[test]
    fn shapes_have_their_sizes_and_face_outwards() {
        let ball = sphere();
        assert!(Topology::of(&ball).is_closed());
        assert!((ball.signed_volume() / (4.0 / 3.0 * PI) - 1.0).abs() < 2e-3, "{}", ball.signed_volume());
        let cube = cube();
        assert!(Topology::of(&cube).is_closed());
        assert!((cube.signed_volume() - 8.0).abs() < 1e-6);
        for (name, mesh, area) in [("disk", disk(), PI), ("cylinder", cylinder(), TAU), ("rectangle", rectangle(), 4.0)]
        {
            assert!((mesh.area() / area - 1.0).abs() < 3e-5, "{name}: {}", mesh.area());
            for (t, triangle) in mesh.triangles.iter().enumerate() {
                let normal = mesh.doubled_area_normal(t);
                triangle.iter().for_each(|&v| assert!(normal.dot(mesh.normals[v as usize].as_dvec3()) > 0.0, "{name}"));
            }
        }
    }

    #[test]
    fn attributes_of_faces_and_vertices_become_linear_colours() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.ply");
        let text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
            property float heat_0\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nelement face 2\n\
            property list uchar int vertex_indices\nproperty float tint_1\nproperty float tint_2\n\
            property float tint_3\nproperty float glaze_r\nproperty float glaze_g\nproperty float glaze_b\nend_header\n\
            0 0 0 1.5 1 0 0\n1 0 0 2 1 0 0\n1 1 0 2.5 1 0 0\n0 1 0 3 1 0 1\n\
            3 0 1 2 0.25 0.5 2 1 0 0\n3 0 2 3 0 1 0 0 0 1\n";
        std::fs::write(&path, text).unwrap();
        let colors = |attribute: &str| {
            let request = MeshRequest {
                geometry: Geometry::Model(ModelFormat::Ply, path.clone()),
                flip_v: false,
                face_normals: false,
                flip_normals: false,
                tangents: false,
                attribute: Some(attribute.to_owned()),
            };
            let (mesh, _) = request.make(&UnpackedBytes::new(0), &MeshBudget::default()).unwrap();
            // Of the corners of both triangles.
            let color = |vertex: u32| mesh.colors.get(vertex as usize).map(|color| color.truncate());
            mesh.triangles.iter().flatten().filter_map(|&vertex| color(vertex)).collect::<Vec<Vec3>>()
        };
        let of_faces = |a: Vec3, b: Vec3| [a, a, a, b, b, b];
        assert_eq!(colors("face_tint"), of_faces(Vec3::new(0.25, 0.5, 2.0), Vec3::Y));
        assert_eq!(colors("face_glaze_color"), of_faces(Vec3::X, Vec3::Z));
        assert_eq!(colors("vertex_heat"), [1.5, 2.0, 2.5, 1.5, 2.5, 3.0].map(Vec3::splat));
        assert_eq!(colors("vertex_color")[5], Vec3::new(1.0, 0.0, 1.0));
        assert!(colors("face_heat").is_empty() && colors("vertex_tint").is_empty());
    }
}
