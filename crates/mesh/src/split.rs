//! Copies of vertices whose corners differ in something.

use super::Mesh;
use std::collections::HashMap;
use std::hash::Hash;

impl Mesh {
    /// Gives each pair of a vertex and a key a vertex of its own. The first pair of a vertex keeps its index; the copies
    /// come after all others, in the order of the triangles.
    ///
    /// - `keys`: one per corner of each triangle.
    ///
    /// Returns the key of each vertex, `None` for one that no triangle uses.
    pub(crate) fn split_by<K: Copy + Eq + Hash>(&mut self, keys: &[K]) -> Vec<Option<K>> {
        let mut of_vertex: Vec<Option<K>> = vec![None; self.positions.len()];
        // Most vertices have one key; only the others need the map.
        let mut copies: HashMap<(u32, K), u32> = HashMap::new();
        let mut sources: Vec<u32> = Vec::new();
        for (vertex, &key) in self.triangles.as_flattened_mut().iter_mut().zip(keys) {
            let known = of_vertex[*vertex as usize];
            if known.is_none() {
                of_vertex[*vertex as usize] = Some(key);
            } else if known != Some(key) {
                let source = *vertex;
                *vertex = *copies.entry((source, key)).or_insert_with(|| {
                    sources.push(source);
                    of_vertex.push(Some(key));
                    of_vertex.len() as u32 - 1
                });
            }
        }
        repeat(&mut self.positions, &sources);
        repeat(&mut self.normals, &sources);
        repeat(&mut self.uvs, &sources);
        repeat(&mut self.uvs2, &sources);
        repeat(&mut self.colors, &sources);
        repeat(&mut self.tangents, &sources);
        of_vertex
    }
}

/// Appends copies of an attribute of vertices; does nothing if the mesh lacks the attribute.
fn repeat<T: Copy>(attribute: &mut Vec<T>, sources: &[u32]) {
    if !attribute.is_empty() {
        attribute.reserve(sources.len());
        for &source in sources {
            attribute.push(attribute[source as usize]);
        }
    }
}
