//! Meshes as binary PLY files, with the names of properties that pbrt-v4 and Mitsuba 3 read.

use firstlight_mesh::Mesh;
use glam::{Vec2, Vec3};

/// Texture coordinates of the corners of triangles that have none.
pub(crate) const OWN_UVS: [Vec2; 3] = [Vec2::ZERO, Vec2::X, Vec2::Y];

/// The file of a mesh, in coordinates about its centre.
///
/// - `slot`: only triangles of this material slot; `is_mirrored`: mirrored along x, with the same front.
/// - `is_textured`: with texture coordinates, also where the mesh has none: then each corner is a vertex.
pub(crate) fn bytes(mesh: &Mesh, slot: Option<u16>, is_mirrored: bool, is_textured: bool) -> Vec<u8> {
    let adds_uvs = is_textured && mesh.uvs.is_empty();
    let of_slot = |i: usize| slot.is_none_or(|slot| mesh.slots.get(i).copied().unwrap_or(0) == slot);
    let triangles: Vec<[u32; 3]> =
        mesh.triangles.iter().enumerate().filter(|(i, _)| of_slot(*i)).map(|(_, triangle)| *triangle).collect();
    // Only the vertices that are used, in their order.
    let mut numbers = vec![u32::MAX; mesh.positions.len()];
    let mut used = Vec::new();
    if adds_uvs {
        used.extend(triangles.iter().flatten().map(|&vertex| vertex as usize));
    } else {
        triangles.iter().flatten().for_each(|&vertex| numbers[vertex as usize] = 0);
        for (vertex, number) in numbers.iter_mut().enumerate().filter(|(_, number)| **number == 0) {
            *number = used.len() as u32;
            used.push(vertex);
        }
    }
    let mut out = header(mesh, adds_uvs, used.len(), triangles.len()).into_bytes();
    let flip = if is_mirrored { Vec3::new(-1.0, 1.0, 1.0) } else { Vec3::ONE };
    let mut put = |numbers: &[f32]| numbers.iter().for_each(|number| out.extend(number.to_le_bytes()));
    for (i, &vertex) in used.iter().enumerate() {
        put(&(flip * mesh.positions[vertex]).to_array());
        mesh.normals.get(vertex).iter().for_each(|&&normal| put(&(flip * normal).to_array()));
        let uv = if adds_uvs { Some(&OWN_UVS[i % 3]) } else { mesh.uvs.get(vertex) };
        uv.iter().for_each(|uv| put(&uv.to_array()));
        mesh.colors.get(vertex).iter().for_each(|color| put(&color.truncate().to_array()));
    }
    for (i, triangle) in triangles.into_iter().enumerate() {
        let corner = |k: usize| if adds_uvs { (3 * i + k) as u32 } else { numbers[triangle[k] as usize] };
        out.push(3);
        let order = if is_mirrored { [0, 2, 1] } else { [0, 1, 2] };
        order.iter().for_each(|&k| out.extend(corner(k).to_le_bytes()));
    }
    out
}

fn header(mesh: &Mesh, adds_uvs: bool, n_vertices: usize, n_triangles: usize) -> String {
    let mut text = format!("ply\nformat binary_little_endian 1.0\nelement vertex {n_vertices}\n");
    let lists: [(&[&str], bool); 4] = [
        (&["x", "y", "z"], true),
        (&["nx", "ny", "nz"], !mesh.normals.is_empty()),
        (&["u", "v"], adds_uvs || !mesh.uvs.is_empty()),
        // Linear, as Mitsuba has them.
        (&["r", "g", "b"], !mesh.colors.is_empty()),
    ];
    for name in lists.iter().filter(|(_, is_there)| *is_there).flat_map(|(names, _)| *names) {
        text += &format!("property float {name}\n");
    }
    text + &format!("element face {n_triangles}\nproperty list uchar int vertex_indices\nend_header\n")
}
