//! The shapes of pbrt as triangles in their own space.
//!
//! The front of a triangle, from which an emitter shines, is where pbrt's normal points: along the shading normals if
//! there are any, else along the cross product of its edges; `ReverseOrientation` turns both round.

use crate::model::assemble::{Indexed, assemble};
use crate::model::imported::{ModelNormals, ModelOptions};
use crate::pbrt::params::Params;
use crate::ply::header::Header;
use firstlight_files::gzip::start_of_decompressed;
use firstlight_files::input_file::{FileKind, InputFile};
use firstlight_files::printable;
use firstlight_files::warnings::Warnings;
use firstlight_mesh::Mesh;
use glam::{DVec2, DVec3, Vec2};
use std::f64::consts::{PI, TAU};
use std::io::Read;
use std::path::Path;

/// Segments of a full turn of a sphere, disk or cylinder.
const SEGMENTS: u32 = 128;

/// Whether a shape is a whole sphere.
pub(crate) fn is_whole_sphere(params: &Params) -> bool {
    let radius = params.number("radius").unwrap_or(1.0);
    let (zmin, zmax) = (params.number("zmin").unwrap_or(-radius), params.number("zmax").unwrap_or(radius));
    radius > 0.0 && zmin <= -radius && zmax >= radius && params.number("phimax").unwrap_or(360.0) >= 360.0
}

/// The triangles of a shape, or why there are none.
///
/// - `kind`: other than `plymesh` and `curve`; `path`: of the scene, for messages.
pub(crate) fn mesh_of(
    kind: &str,
    params: &Params,
    is_reversed: bool,
    most_triangles: usize,
    path: &Path,
    warnings: &mut Warnings,
) -> Result<Mesh, String> {
    let indexed = match kind {
        "trianglemesh" => triangles(params)?,
        "bilinearmesh" => patches(params)?,
        "loopsubdiv" => crate::pbrt::subdivision::subdivided(params, most_triangles)?,
        "sphere" => sphere(params)?,
        "disk" => disk(params)?,
        "cylinder" => cylinder(params)?,
        other => return Err(format!("shapes of the kind `{}` are not modelled", printable::name(other))),
    };
    meshed(indexed, is_reversed, path, warnings)
}

/// The checked mesh of a shape.
pub(crate) fn meshed(
    mut indexed: Indexed,
    is_reversed: bool,
    path: &Path,
    warnings: &mut Warnings,
) -> Result<Mesh, String> {
    if indexed.positions.iter().any(|point| !point.is_finite()) {
        return Err("it has vertices that are not finite".to_owned());
    }
    if is_reversed {
        indexed.normals.iter_mut().for_each(|normal| *normal = -*normal);
    }
    let (positions, normals) = (&indexed.positions, &indexed.normals);
    for triangle in &mut indexed.triangles {
        let [a, b, c] = triangle.map(|vertex| positions[vertex as usize]);
        let along = match normals.is_empty() {
            true => DVec3::ZERO,
            false => triangle.iter().map(|&vertex| normals[vertex as usize].as_dvec3()).sum::<DVec3>(),
        };
        let agreement = (b - a).cross(c - a).dot(along);
        if agreement < 0.0 || agreement == 0.0 && is_reversed {
            triangle.swap(1, 2);
        }
    }
    let normals = match indexed.normals.is_empty() {
        true => ModelNormals::Ignore,
        false => ModelNormals::FileOrComputed { crease_angle: 0.0 },
    };
    let options = ModelOptions { normals, ..ModelOptions::default() };
    assemble(path, indexed, &options, warnings).map(|(mesh, _)| mesh).map_err(|error| error.to_string())
}

/// Whether a PLY file has texture coordinates, by its header; also if it has no good one.
pub(crate) fn has_uvs(path: &Path) -> bool {
    /// Longer headers are rare, and not read for this.
    const MOST: u64 = 1 << 16;
    let mut start = Vec::new();
    let read = InputFile::open(path, FileKind::Model).map(|file| file.take(MOST).read_to_end(&mut start));
    let header = Header::parse(&start_of_decompressed(start, MOST));
    let (Ok(Ok(_)), Ok(header)) = (read, header) else { return true };
    let is_u = |name: &str| matches!(name, "u" | "s" | "texture_u" | "texture_s" | "texcoord");
    header.elements.iter().flat_map(|element| &element.properties).any(|property| is_u(&property.name))
}

/// The mesh with three vertices of its own for each triangle, and the texture coordinates that pbrt gives them: (0, 0),
/// (1, 0) and (1, 1).
pub(crate) fn with_own_uvs(mesh: &Mesh) -> Mesh {
    let corners: Vec<usize> = mesh.triangles.iter().flatten().map(|&vertex| vertex as usize).collect();
    let positions = corners.iter().map(|&corner| mesh.positions[corner]).collect();
    let normals = corners.iter().filter_map(|&corner| mesh.normals.get(corner).copied()).collect();
    let colors = corners.iter().filter_map(|&corner| mesh.colors.get(corner).copied()).collect();
    let uvs = [Vec2::ZERO, Vec2::X, Vec2::ONE].into_iter().cycle().take(corners.len()).collect();
    let triangles = (0..mesh.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    let (uvs2, tangents) = (Vec::new(), Vec::new());
    Mesh { positions, center: mesh.center, triangles, normals, uvs, uvs2, colors, tangents, slots: mesh.slots.clone() }
}

/// Vertices with what pbrt gives them.
fn vertices(params: &Params) -> Result<Indexed, String> {
    let positions = params.points("P");
    if positions.is_empty() {
        return Err("it has no vertices `P`".to_owned());
    }
    let n = positions.len();
    let normals = params.points("N").into_iter().map(|normal| normal.normalize_or_zero().as_vec3());
    let uvs: Vec<DVec2> =
        ["uv", "st"].iter().map(|name| params.pairs(name)).find(|list| !list.is_empty()).unwrap_or_default();
    let uvs = uvs.into_iter().map(|uv| uv.as_vec2());
    Ok(Indexed {
        positions,
        // A list of another length belongs to no vertices.
        normals: Some(normals.collect::<Vec<_>>()).filter(|list| list.len() == n).unwrap_or_default(),
        uvs: Some(uvs.collect::<Vec<Vec2>>()).filter(|list| list.len() == n).unwrap_or_default(),
        ..Indexed::default()
    })
}

/// The indices of a mesh in groups, all of them in range.
fn groups<const N: usize>(params: &Params, n_vertices: usize) -> Result<Vec<[u32; N]>, String> {
    let mut indices = params.indices("indices");
    if indices.is_empty() && n_vertices == N {
        indices = (0..N as u32).collect();
    }
    if let Some(index) = indices.iter().find(|&&index| index as usize >= n_vertices) {
        return Err(format!("it uses vertex {index}, counted from 0, of {n_vertices}"));
    }
    let (groups, rest) = indices.as_chunks::<N>();
    match (groups, rest) {
        ([], []) => Err("it has no `indices`".to_owned()),
        (groups, []) => Ok(groups.to_vec()),
        _ => Err(format!("its `indices` are not in groups of {N}")),
    }
}

fn triangles(params: &Params) -> Result<Indexed, String> {
    let vertices = vertices(params)?;
    let triangles = groups::<3>(params, vertices.positions.len())?;
    Ok(Indexed { triangles, ..vertices })
}

/// Bilinear patches: two triangles where a patch is flat, else a grid of them.
fn patches(params: &Params) -> Result<Indexed, String> {
    /// Cells of a curved patch along each side.
    const CELLS: u32 = 16;
    /// Curved patches of a mesh beyond which they are flat: many small ones are smooth enough.
    const MAX_CURVED: usize = 1 << 12;
    let vertices = vertices(params)?;
    let mut out = Indexed::default();
    let patches = groups::<4>(params, vertices.positions.len())?;
    let is_fine = patches.len() > MAX_CURVED;
    for corners in patches {
        let at = |i: usize| corners[i] as usize;
        let p = [0, 1, 2, 3].map(|i| vertices.positions[at(i)]);
        // Zero where the four corners lie in a plane.
        let bend = (p[1] - p[0]).cross(p[2] - p[0]).dot(p[3] - p[0]);
        let n = if bend == 0.0 || is_fine { 1 } else { CELLS };
        let uv_of = |i: usize| vertices.uvs.get(at(i)).map_or(Vec2::new((i % 2) as f32, (i / 2) as f32), |uv| *uv);
        let uvs = [0, 1, 2, 3].map(uv_of);
        let between = |u: f64, v: f64| p[0].lerp(p[1], u).lerp(p[2].lerp(p[3], u), v);
        let start = u32::try_from(out.positions.len()).map_err(|_| "it has too many patches".to_owned())?;
        for (j, i) in (0..=n).flat_map(|j| (0..=n).map(move |i| (j, i))) {
            let (u, v) = (f64::from(i) / f64::from(n), f64::from(j) / f64::from(n));
            out.positions.push(between(u, v));
            out.uvs.push(uvs[0].lerp(uvs[1], u as f32).lerp(uvs[2].lerp(uvs[3], u as f32), v as f32));
            let along_u = p[1].lerp(p[3], v) - p[0].lerp(p[2], v);
            let along_v = p[2].lerp(p[3], u) - p[0].lerp(p[1], u);
            let normal = along_u.cross(along_v).normalize_or_zero().as_vec3();
            let given = |i: usize| vertices.normals.get(at(i)).copied();
            out.normals.push(match [given(0), given(1), given(2), given(3)] {
                [Some(a), Some(b), Some(c), Some(d)] => {
                    a.lerp(b, u as f32).lerp(c.lerp(d, u as f32), v as f32).normalize_or_zero()
                }
                _ => normal,
            });
        }
        push_grid(&mut out.triangles, start, n, n);
    }
    Ok(out)
}

/// Two triangles for each cell of a grid of vertices, whose front is along ∂p/∂u × ∂p/∂v.
fn push_grid(triangles: &mut Vec<[u32; 3]>, start: u32, n_u: u32, n_v: u32) {
    for (j, i) in (0..n_v).flat_map(|j| (0..n_u).map(move |i| (j, i))) {
        let at = |i: u32, j: u32| start + j * (n_u + 1) + i;
        triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
        triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
    }
}

/// A surface over u and v in 0..1, with its normals.
fn surface(n_u: u32, n_v: u32, at: impl Fn(f64, f64) -> (DVec3, DVec3)) -> Indexed {
    let mut out = Indexed::default();
    for (j, i) in (0..=n_v).flat_map(|j| (0..=n_u).map(move |i| (j, i))) {
        let (u, v) = (f64::from(i) / f64::from(n_u), f64::from(j) / f64::from(n_v));
        let (position, normal) = at(u, v);
        out.positions.push(position);
        out.normals.push(normal.as_vec3().normalize_or_zero());
        out.uvs.push(Vec2::new(u as f32, v as f32));
    }
    push_grid(&mut out.triangles, 0, n_u, n_v);
    out
}

/// Radius and largest angle of a shape of revolution, radians.
fn turn(params: &Params) -> Result<(f64, f64, u32), String> {
    let radius = params.number("radius").unwrap_or(1.0);
    let angle = params.number("phimax").unwrap_or(360.0).clamp(0.0, 360.0).to_radians();
    if radius <= 0.0 || angle <= 0.0 {
        return Err("its radius or its angle is not positive".to_owned());
    }
    let segments = (f64::from(SEGMENTS) * angle / TAU).ceil().max(1.0) as u32;
    Ok((radius, angle, segments))
}

/// Cosine and sine, exact for whole quarters so that a full turn closes.
fn circle(angle: f64) -> (f64, f64) {
    if angle == TAU { (1.0, 0.0) } else { (angle.cos(), angle.sin()) }
}

fn sphere(params: &Params) -> Result<Indexed, String> {
    let (radius, angle, segments) = turn(params)?;
    let limit = |name: &str, default: f64| params.number(name).unwrap_or(default).clamp(-radius, radius);
    let (a, b) = (limit("zmin", -radius), limit("zmax", radius));
    let [low, high] = [a.min(b), a.max(b)].map(|z| (z / radius).acos());
    let rows = (f64::from(SEGMENTS / 2) * (low - high) / PI).ceil().max(1.0) as u32;
    Ok(surface(segments, rows, |u, v| {
        let (cos, sin) = circle(u * angle);
        let theta = low + v * (high - low);
        // The poles are points.
        let ring = if theta == 0.0 || theta == PI { 0.0 } else { theta.sin() };
        let normal = DVec3::new(ring * cos, ring * sin, theta.cos());
        (radius * normal, normal)
    }))
}

fn disk(params: &Params) -> Result<Indexed, String> {
    let (radius, angle, segments) = turn(params)?;
    let height = params.number("height").unwrap_or(0.0);
    let inner = params.number("innerradius").unwrap_or(0.0).max(0.0);
    if inner >= radius {
        return Err("its inner radius is not less than its radius".to_owned());
    }
    Ok(surface(segments, 1, |u, v| {
        let (cos, sin) = circle(u * angle);
        let ring = radius + v * (inner - radius);
        (DVec3::new(ring * cos, ring * sin, height), DVec3::Z)
    }))
}

fn cylinder(params: &Params) -> Result<Indexed, String> {
    let (radius, angle, segments) = turn(params)?;
    let (a, b) = (params.number("zmin").unwrap_or(-1.0), params.number("zmax").unwrap_or(1.0));
    let (low, high) = (a.min(b), a.max(b));
    Ok(surface(segments, 1, |u, v| {
        let (cos, sin) = circle(u * angle);
        (DVec3::new(radius * cos, radius * sin, low + v * (high - low)), DVec3::new(cos, sin, 0.0))
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pbrt::params::{Param, Values};

    fn params(list: &[(&str, &[f64])]) -> Params {
        let param = |(name, numbers): &(&str, &[f64])| Param {
            kind: "float".to_owned(),
            name: (*name).to_owned(),
            values: Values::Numbers(numbers.to_vec()),
        };
        Params::new(list.iter().map(param).collect())
    }

    fn mesh(kind: &str, list: &[(&str, &[f64])], is_reversed: bool) -> Result<Mesh, String> {
        mesh_of(kind, &params(list), is_reversed, usize::MAX, Path::new("a.pbrt"), &mut Warnings::default())
    }

    /// Area, and the flux of the position through the front.
    fn area_and_volume(mesh: &Mesh) -> (f64, f64) {
        let corner = |vertex: u32| mesh.positions[vertex as usize].as_dvec3() + mesh.center;
        mesh.triangles.iter().fold((0.0, 0.0), |(area, volume), triangle| {
            let [a, b, c] = triangle.map(corner);
            let normal = (b - a).cross(c - a);
            (area + 0.5 * normal.length(), volume + a.dot(normal) / 6.0)
        })
    }

    #[test]
    fn shapes_have_the_area_of_their_formulas_and_their_front_outside() {
        let whole = mesh("sphere", &[("radius", &[2.0])], false).unwrap();
        let (area, volume) = area_and_volume(&whole);
        assert!((area / (16.0 * PI) - 1.0).abs() < 2e-3 && (volume / (32.0 / 3.0 * PI) - 1.0).abs() < 3e-3);
        let (_, inside) = area_and_volume(&mesh("sphere", &[("radius", &[2.0])], true).unwrap());
        assert_eq!(inside, -volume);
        // A cap of height h has the area 2 π r h; half of it the half.
        let cap = mesh("sphere", &[("radius", &[2.0]), ("zmin", &[1.0]), ("phimax", &[180.0])], false).unwrap();
        assert!((area_and_volume(&cap).0 / (2.0 * PI) - 1.0).abs() < 2e-3);
        let ring = mesh("disk", &[("radius", &[3.0]), ("innerradius", &[1.0]), ("height", &[0.5])], false).unwrap();
        let (area, flux) = area_and_volume(&ring);
        // The front is +z: the flux is a third of area times height.
        assert!((area / (8.0 * PI) - 1.0).abs() < 1e-3 && (flux / (area * 0.5 / 3.0) - 1.0).abs() < 1e-6);
        let tube = mesh("cylinder", &[("zmin", &[0.0]), ("zmax", &[4.0])], false).unwrap();
        let (area, flux) = area_and_volume(&tube);
        assert!((area / (8.0 * PI) - 1.0).abs() < 1e-3 && flux > 0.0);
    }

    #[test]
    fn normals_say_which_side_is_the_front() {
        let corners: &[f64] = &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        let normal = |mesh: &Mesh| {
            let [a, b, c] = mesh.triangles[0].map(|vertex| mesh.positions[vertex as usize]);
            (b - a).cross(c - a).z.signum()
        };
        let (up, down): (&[f64], &[f64]) = (&[0.0, 0.0, 1.0], &[0.0, 0.0, -1.0]);
        for (n, is_reversed, front) in [
            (None, false, 1.0),
            (None, true, -1.0),
            (Some(up), true, -1.0),
            (Some(down), false, -1.0),
            (Some(down), true, 1.0),
        ] {
            let normals = n.map_or(Vec::new(), |n| n.repeat(3));
            let mut list: Vec<(&str, &[f64])> = vec![("P", corners)];
            if !normals.is_empty() {
                list.push(("N", &normals));
            }
            let mesh = mesh("trianglemesh", &list, is_reversed).unwrap();
            assert_eq!(normal(&mesh), front, "{n:?} {is_reversed}");
            assert!(mesh.normals.iter().all(|shading| shading.z.signum() == front));
        }
    }

    #[test]
    fn a_curved_patch_is_the_saddle_that_it_is() {
        // z = x y over the unit square has the area ∫∫ √(1 + x² + y²) = 1.280789.
        let flat: &[f64] = &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0];
        let saddle: &[f64] = &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 1.0];
        assert_eq!(mesh("bilinearmesh", &[("P", flat)], false).unwrap().triangles.len(), 2);
        let (area, _) = area_and_volume(&mesh("bilinearmesh", &[("P", saddle)], false).unwrap());
        assert!((area - 1.280789).abs() < 1e-3, "{area}");
    }

    #[test]
    fn broken_shapes_say_what_is_wrong() {
        let corners: &[f64] = &[0.0; 9];
        for (list, told) in [
            (&[][..], "no vertices"),
            (&[("P", corners)][..], "degenerate"),
            (&[("P", corners), ("indices", &[0.0, 1.0, 3.0])][..], "uses vertex 3"),
            (&[("P", corners), ("indices", &[0.0, 1.0])][..], "groups of 3"),
        ] {
            let error = mesh("trianglemesh", list, false).unwrap_err();
            assert!(error.contains(told), "{error}");
        }
        assert!(mesh("disk", &[("innerradius", &[1.0])], false).is_err());
    }
}
