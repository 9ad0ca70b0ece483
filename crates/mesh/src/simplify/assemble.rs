//! Assembly of a mesh from the triangles that remain after simplification.

use super::prepare::PreparedMesh;
use super::surface::Wedge;
use crate::Mesh;
use std::collections::HashMap;

/// Assembles a mesh with the remaining triangles in their original order and vertices in order of use.
pub(super) fn assemble(remaining: &PreparedMesh, original: &Mesh) -> Mesh {
    let (positions, wedges) = (&remaining.positions, &remaining.wedges);
    // Each source occurs at most once, so a table over all of them sorts the triangles.
    let sources = remaining.sources.iter().max().map_or(0, |&last| last as usize + 1);
    let mut place_of = vec![Numbers::NONE; sources];
    remaining.sources.iter().zip(0..).for_each(|(&source, t)| place_of[source as usize] = t);
    let order = place_of.into_iter().enumerate().filter(|&(_, t)| t != Numbers::NONE);
    let mut mesh = Mesh { center: original.center, ..Mesh::default() };
    mesh.triangles.reserve(remaining.triangles.len());
    mesh.positions.reserve(remaining.triangles.len() / 2);
    let unscale = remaining.scale.recip();
    let mut numbers = Numbers::new(positions.len(), wedges.len());
    for (source, t) in order {
        let t = t as usize;
        let mut corners = remaining.triangles[t];
        for (k, corner) in corners.iter_mut().enumerate() {
            let place = *corner;
            let wedge = remaining.corner_wedges.get(3 * t + k).map(|&w| (w, wedges[w as usize]));
            let next = mesh.positions.len() as u32;
            *corner = numbers.number(place, wedge, next);
            if *corner == next {
                mesh.positions.push(positions[place as usize] * unscale);
                if let Some((_, wedge)) = wedge {
                    if !original.normals.is_empty() {
                        mesh.normals.push(wedge.normal);
                    }
                    if !original.uvs.is_empty() {
                        mesh.uvs.push(wedge.uv);
                    }
                }
            }
        }
        mesh.triangles.push(corners);
        if let Some(&slot) = original.slots.get(source) {
            mesh.slots.push(slot);
        }
    }
    mesh
}

/// New vertex indices: one per position, or one per wedge, where wedges that differ only in their slot share one.
struct Numbers {
    of: Vec<u32>,
    by_data: HashMap<(u32, [u32; 5]), u32>,
}

impl Numbers {
    const NONE: u32 = u32::MAX;

    fn new(places: usize, wedges: usize) -> Self {
        Self { of: vec![Self::NONE; if wedges == 0 { places } else { wedges }], by_data: HashMap::new() }
    }

    fn number(&mut self, place: u32, wedge: Option<(u32, Wedge)>, next: u32) -> u32 {
        let Some((wedge, data)) = wedge else {
            let known = &mut self.of[place as usize];
            if *known == Self::NONE {
                *known = next;
            }
            return *known;
        };
        let known = &mut self.of[wedge as usize];
        if *known == Self::NONE {
            let [x, y, z] = data.normal.to_array().map(f32::to_bits);
            let [u, v] = data.uv.to_array().map(f32::to_bits);
            *known = *self.by_data.entry((place, [x, y, z, u, v])).or_insert(next);
        }
        *known
    }
}
