//! Placements of a scene file, and the fronts of meshes in it.

use firstlight_format::bounds;
use firstlight_format::parts::TransformPart;
use firstlight_mesh::Mesh;
use glam::{DAffine3, DVec3, Vec2, Vec3};

/// Whether an object may have this transform.
pub(crate) fn is_placement(world: &DAffine3) -> bool {
    let determinant = world.matrix3.determinant().abs();
    world.is_finite()
        && world.translation.abs().max_element() <= bounds::MAX_COORDINATE
        && (bounds::MIN_SIZE.powi(3)..f64::INFINITY).contains(&determinant)
}

/// A matrix as a scene file says it.
pub(crate) fn transform(world: &DAffine3) -> TransformPart {
    if *world == DAffine3::IDENTITY {
        return TransformPart::default();
    }
    let (m, t) = (world.matrix3.transpose(), world.translation);
    let row = |axis: DVec3, last: f64| [axis.x, axis.y, axis.z, last];
    let matrix = Some([row(m.x_axis, t.x), row(m.y_axis, t.y), row(m.z_axis, t.z)]);
    TransformPart { matrix, ..TransformPart::default() }
}

/// From vertices with a position, a normal and texture coordinates each, of a shape that formulas make.
pub(crate) fn made_mesh(vertices: &[(DVec3, DVec3, [f64; 2])], triangles: Vec<[u32; 3]>) -> Mesh {
    let positions: Vec<DVec3> = vertices.iter().map(|vertex| vertex.0).collect();
    let mesh = Mesh::from_f64(&positions, triangles).expect("the shape is one");
    let normals = vertices.iter().map(|vertex| vertex.1.as_vec3()).collect();
    let uvs = vertices.iter().map(|vertex| Vec2::new(vertex.2[0] as f32, vertex.2[1] as f32)).collect();
    Mesh { normals, uvs, ..mesh }
}

/// Area of a mesh where it stands, m².
pub(crate) fn area_of(mesh: &Mesh, world: &DAffine3) -> f64 {
    let corner = |vertex: u32| world.transform_vector3(mesh.positions[vertex as usize].as_dvec3());
    let doubled = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(corner);
        (b - a).cross(c - a).length()
    };
    0.5 * mesh.triangles.iter().map(doubled).sum::<f64>()
}

/// The same mesh with its front where its normals point, also that of triangles whose order says otherwise; or turned
/// round.
pub(crate) fn oriented(mut mesh: Mesh, is_reversed: bool) -> Mesh {
    if is_reversed {
        mesh.normals.iter_mut().for_each(|normal| *normal = -*normal);
    }
    for triangle in &mut mesh.triangles {
        let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize]);
        let along = triangle.iter().filter_map(|&vertex| mesh.normals.get(vertex as usize)).sum::<Vec3>();
        let agreement = (b - a).cross(c - a).dot(along);
        if agreement < 0.0 || agreement == 0.0 && is_reversed {
            triangle.swap(1, 2);
        }
    }
    mesh
}

/// Corners of the box of a mesh, in its own coordinates, metres.
pub fn corners_of(mesh: &Mesh) -> (DVec3, DVec3) {
    let around = mesh.bounds();
    (around.min.as_dvec3() + mesh.center, around.max.as_dvec3() + mesh.center)
}
