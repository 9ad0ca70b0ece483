//! Meshes: of files, and of shapes that are none of ours.
//!
//! A `.wo3` file has the number of vertices (`u64`), records of eight `f32` for each (position, normal, texture
//! coordinates), the number of triangles, and three indices and the number of a BSDF (`u32`) for each; little endian.

use crate::error::together::MeshesTooLarge;
use crate::model::imported::{ModelNormals, ModelOptions, with_normals};
use crate::model::mesh_budget::MeshBudget;
use crate::model::placing::made_mesh;
use crate::obj::load_obj_with;
use firstlight_files::input_file::{FileKind, InputFile};
use firstlight_mesh::{Mesh, NormalWeight, procedural};
use glam::{DVec3, Vec2, Vec3};
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

/// Edges above this angle stay hard where normals are computed: 0.15 π.
const CREASE: f32 = 0.15 * std::f32::consts::PI;
/// Triangles around an axis.
const SEGMENTS: u32 = 128;
const BYTES_OF_VERTEX: usize = 32;
const BYTES_OF_TRIANGLE: usize = 16;

#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Geometry {
    File(PathBuf),
    /// Of side 1 about the origin.
    Cube,
    /// Of side 1 about the origin in the plane y = 0, facing +Y.
    Quad,
    /// Of radius 1 about the origin in the plane y = 0, facing +Y.
    Disk,
    /// Of radius 1/2 and height 1 about the origin, along Y.
    Cylinder {
        capped: bool,
    },
}

/// A mesh to be made. Equal ones are made once.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct MeshRequest {
    pub geometry: Geometry,
    /// Whether it has shading normals.
    pub smooth: bool,
    /// Whether those of the file are replaced by computed ones.
    pub recompute: bool,
    /// Number of materials.
    pub n_slots: u16,
}

impl MeshRequest {
    pub(crate) fn of_shape(geometry: Geometry) -> Self {
        Self { geometry, smooth: true, recompute: false, n_slots: 1 }
    }

    pub(crate) fn file(&self) -> Option<&Path> {
        match &self.geometry {
            Geometry::File(path) => Some(path),
            _ => None,
        }
    }

    /// Makes the mesh.
    ///
    /// # Errors
    /// A sentence about it.
    pub(crate) fn make(&self, budget: &MeshBudget) -> Result<Mesh, String> {
        let too_large = |error: MeshesTooLarge| match self.file() {
            Some(path) => format!("{}: {error}", path.display()),
            None => format!("a mesh {error}"),
        };
        let length = self.file().map_or(Ok(0), |path| budget.before(path)).map_err(too_large)?;
        let mut mesh = match &self.geometry {
            Geometry::File(path) => self.read(path)?,
            Geometry::Cube => cube(),
            Geometry::Quad => quad(),
            Geometry::Disk => turned(&[[1.0, 0.0], [0.0, 0.0]]),
            Geometry::Cylinder { capped } => {
                let profile = [[0.0, -0.5], [0.5, -0.5], [0.5, 0.5], [0.0, 0.5]];
                turned(if *capped { &profile } else { &profile[1..3] })
            }
        };
        match self.n_slots {
            0 | 1 => mesh.slots.clear(),
            n => mesh.slots.iter_mut().for_each(|slot| *slot = (*slot).min(n - 1)),
        }
        budget.after(length, &mesh).map_err(too_large)?;
        Ok(mesh)
    }

    fn read(&self, path: &Path) -> Result<Mesh, String> {
        if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("obj")) {
            let normals = match self.smooth {
                true => ModelNormals::FileOrComputed { crease_angle: CREASE },
                false => ModelNormals::Ignore,
            };
            let options = ModelOptions { normals, ..ModelOptions::default() };
            return Ok(load_obj_with(path, &options).map_err(|error| error.to_string())?.mesh);
        }
        let bytes = InputFile::open(path, FileKind::Model).and_then(InputFile::bytes);
        let bytes = bytes.map_err(|error| format!("{} {error}", path.display()))?;
        let (mesh, normals) = parse_wo3(&bytes).map_err(|why| format!("{}: {why}", path.display()))?;
        Ok(match (self.smooth, self.recompute) {
            (false, _) => mesh,
            (true, true) => mesh.with_smooth_normals(NormalWeight::Angle, Some(CREASE)),
            (true, false) => with_normals(mesh, &normals, CREASE).0,
        })
    }
}

/// Numbers of a record of four bytes each.
fn numbers<const N: usize>(record: &[u8]) -> [[u8; 4]; N] {
    std::array::from_fn(|i| std::array::from_fn(|k| record[4 * i + k]))
}

/// A mesh without normals, and the normals of its vertices; zero for those that are none.
///
/// # Errors
/// A sentence that follows the path.
fn parse_wo3(bytes: &[u8]) -> Result<(Mesh, Vec<Vec3>), String> {
    let short = || "is damaged: it ends early".to_owned();
    // Their number, their records, and what comes behind.
    let list = |bytes: &[u8], size: usize| -> Option<(usize, usize)> {
        let count = usize::try_from(u64::from_le_bytes(bytes.get(..8)?.try_into().ok()?)).ok()?;
        let length = count.checked_mul(size)?;
        (length <= bytes.len() - 8).then_some((8, 8 + length))
    };
    let (from, to) = list(bytes, BYTES_OF_VERTEX).ok_or_else(short)?;
    let (vertices, rest) = (&bytes[from..to], &bytes[to..]);
    let (from, to) = list(rest, BYTES_OF_TRIANGLE).ok_or_else(short)?;
    let (mut positions, mut normals, mut uvs) = (Vec::new(), Vec::new(), Vec::new());
    for record in vertices.chunks_exact(BYTES_OF_VERTEX) {
        let [x, y, z, a, b, c, u, v] = numbers(record).map(f32::from_le_bytes);
        positions.push(Vec3::new(x, y, z).as_dvec3());
        normals.push(Vec3::new(a, b, c).try_normalize().unwrap_or(Vec3::ZERO));
        uvs.push(Some(Vec2::new(u, v)).filter(|uv| uv.is_finite()).unwrap_or_default());
    }
    let (mut triangles, mut slots) = (Vec::new(), Vec::new());
    for record in rest[from..to].chunks_exact(BYTES_OF_TRIANGLE) {
        let [a, b, c, slot] = numbers(record).map(u32::from_le_bytes);
        triangles.push([a, b, c]);
        // Below 0 is the first.
        slots.push(u16::try_from(slot.cast_signed().max(0)).unwrap_or(u16::MAX));
    }
    let mesh = Mesh::from_f64(&positions, triangles).map_err(|error| error.to_string())?;
    Ok((Mesh { uvs, slots, ..mesh }, normals))
}

/// The corners of a square, around it.
const CORNERS: [[f64; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];

fn quad() -> Mesh {
    let vertices = CORNERS.map(|[u, v]| (DVec3::new(u - 0.5, 0.0, v - 0.5), DVec3::Y, [u, v]));
    made_mesh(&vertices, vec![[0, 2, 1], [0, 3, 2]])
}

/// Texture coordinates are those of the two axes that follow the axis of the side.
fn cube() -> Mesh {
    let side = |axis: usize, sign: f64| {
        let [normal, u, v] = [0, 1, 2].map(|i| DVec3::AXES[(axis + i) % 3]);
        (sign * normal, u, v)
    };
    procedural::cube_of(&[side(0, -1.0), side(0, 1.0), side(1, -1.0), side(1, 1.0), side(2, -1.0), side(2, 1.0)])
}

/// A profile of radius and height, turned about Y; its edges stay hard.
fn turned(profile: &[[f64; 2]]) -> Mesh {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for edge in profile.windows(2) {
        let first = vertices.len() as u32;
        let [[r, y], [s, z]] = [edge[0], edge[1]];
        let [out, up] = [z - y, r - s].map(|part| part / (z - y).hypot(r - s));
        for i in 0..=SEGMENTS {
            let (sin, cos) = (TAU * f64::from(i % SEGMENTS) / f64::from(SEGMENTS)).sin_cos();
            let at = |radius: f64, height: f64| DVec3::new(radius * cos, height, radius * sin);
            let u = (f64::from(i) / f64::from(SEGMENTS) + 0.5) % 1.0;
            for (v, [radius, height]) in [(0.0, [r, y]), (1.0, [s, z])] {
                vertices.push((at(radius, height), at(out, up), [u, v]));
            }
        }
        for corner in (0..SEGMENTS).map(|i| first + 2 * i) {
            let [a, b, c, d] = [corner, corner + 1, corner + 2, corner + 3];
            // At the axis, one of the two has no area.
            triangles.extend((s > 0.0).then_some([a, b, d]));
            triangles.extend((r > 0.0).then_some([a, d, c]));
        }
    }
    made_mesh(&vertices, triangles)
}

#[cfg(test)]
mod tests {
    use super::*;
    use firstlight_mesh::Topology;
    use std::f64::consts::PI;

    #[test]
    fn shapes_have_their_sizes_and_face_outwards() {
        let make = |geometry| MeshRequest::of_shape(geometry).make(&MeshBudget::default()).unwrap();
        for (geometry, area, volume) in [
            (Geometry::Cube, 6.0, Some(1.0)),
            (Geometry::Quad, 1.0, None),
            (Geometry::Disk, PI, None),
            (Geometry::Cylinder { capped: false }, PI, None),
            (Geometry::Cylinder { capped: true }, 1.5 * PI, Some(0.25 * PI)),
        ] {
            let mesh = make(geometry.clone());
            assert!((mesh.area() / area - 1.0).abs() < 1e-3, "{geometry:?}: {}", mesh.area());
            for (t, triangle) in mesh.triangles.iter().enumerate() {
                let normal = mesh.doubled_area_normal(t);
                let is_outward = |&v: &u32| normal.dot(mesh.normals[v as usize].as_dvec3()) > 0.0;
                assert!(triangle.iter().all(is_outward), "{geometry:?}");
            }
            if let Some(volume) = volume {
                assert!(Topology::of(&mesh).is_closed(), "{geometry:?}");
                assert!((mesh.signed_volume() / volume - 1.0).abs() < 1e-3, "{geometry:?}: {}", mesh.signed_volume());
            }
        }
        assert!(make(Geometry::Disk).normals.iter().all(|normal| *normal == Vec3::Y));
    }

    fn wo3(n_vertices: u64, n_triangles: u64, slot: i32) -> Vec<u8> {
        let mut bytes = n_vertices.to_le_bytes().to_vec();
        for corner in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0_f32]] {
            let [x, y] = corner;
            [x, y, 0.0, 0.0, 0.0, 2.0, x, y].iter().for_each(|number| bytes.extend(number.to_le_bytes()));
        }
        bytes.extend(n_triangles.to_le_bytes());
        [0, 1, 2, slot].iter().for_each(|index| bytes.extend(index.to_le_bytes()));
        bytes
    }

    #[test]
    fn a_mesh_is_read_or_told_to_be_damaged() {
        let (mesh, normals) = parse_wo3(&wo3(3, 1, -1)).unwrap();
        assert_eq!((mesh.area(), &*normals, &*mesh.slots), (0.5, &[Vec3::Z; 3][..], &[0][..]));
        assert_eq!(mesh.uvs[1], Vec2::X);
        let whole = wo3(3, 1, 0);
        for end in 0..whole.len() {
            assert!(parse_wo3(&whole[..end]).is_err(), "{end}");
        }
        for (n_vertices, n_triangles) in [(u64::MAX, 1), (1 << 59, 1), (2, 1), (3, 1 << 60), (0, 0)] {
            assert!(parse_wo3(&wo3(n_vertices, n_triangles, 0)).is_err(), "{n_vertices} {n_triangles}");
        }
    }
}
