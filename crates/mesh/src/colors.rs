//! Transfer of vertex colours between meshes, for a mesh derived from another one, as by simplification.

use super::Mesh;
use glam::{DVec3, IVec3, Vec4};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

impl Mesh {
    /// Gives each vertex the colour of the nearest vertex of `original`; of those equally near, the first.
    ///
    /// Without colours in `original` the mesh is returned unchanged.
    pub fn with_colors_of(mut self, original: &Mesh) -> Self {
        if !original.colors.is_empty() {
            let grid = VertexGrid::of(original);
            let offset = self.center - original.center;
            let color = |position: &glam::Vec3| -> Vec4 {
                original.colors[grid.nearest(position.as_dvec3() + offset) as usize]
            };
            self.colors = self.positions.par_iter().map(color).collect();
        }
        self
    }
}

/// A uniform grid over the vertices of a mesh, with about one vertex per cell that the surface crosses.
struct VertexGrid<'a> {
    mesh: &'a Mesh,
    /// Edge of a cell, metres.
    cell: f64,
    cells: FxHashMap<IVec3, Vec<u32>>,
}

impl<'a> VertexGrid<'a> {
    fn of(mesh: &'a Mesh) -> Self {
        /// Limit on the cells along the longest side of the bounds, so that an `i32` holds their indices.
        const MAX_CELLS: f64 = 1e6;
        let bounds = mesh.bounds();
        let extent = f64::from((bounds.max - bounds.min).max_element());
        let cell = (extent / (mesh.positions.len() as f64).sqrt().min(MAX_CELLS)).max(f64::MIN_POSITIVE);
        let mut cells = FxHashMap::<IVec3, Vec<u32>>::default();
        for (position, vertex) in mesh.positions.iter().zip(0..) {
            cells.entry(cell_of(position.as_dvec3(), cell)).or_default().push(vertex);
        }
        Self { mesh, cell, cells }
    }

    fn nearest(&self, point: DVec3) -> u32 {
        /// Shells of cells that are searched before falling back to brute force.
        const MAX_SHELLS: i32 = 16;
        let middle = cell_of(point, self.cell);
        let mut best = (f64::INFINITY, 0);
        let visit = |best: &mut (f64, u32), vertex: u32| {
            let away = self.mesh.positions[vertex as usize].as_dvec3().distance_squared(point);
            if (away, vertex) < *best {
                *best = (away, vertex);
            }
        };
        for shell in 0..=MAX_SHELLS {
            for offset in shell_of(shell) {
                let cell = self.cells.get(&middle.saturating_add(offset));
                cell.into_iter().flatten().for_each(|&vertex| visit(&mut best, vertex));
            }
            // Vertices in farther shells are at least this many cells away.
            if best.0 < (f64::from(shell) * self.cell).powi(2) {
                return best.1;
            }
        }
        (0..self.mesh.positions.len() as u32).for_each(|vertex| visit(&mut best, vertex));
        best.1
    }
}

fn cell_of(point: DVec3, cell: f64) -> IVec3 {
    (point / cell).floor().as_ivec3()
}

/// Iterates over offsets whose largest absolute coordinate is `radius`.
fn shell_of(radius: i32) -> impl Iterator<Item = IVec3> {
    let all = -radius..=radius;
    let plane = move |x: i32| {
        all.clone().flat_map(move |y| {
            let is_rim = x.abs() == radius || y.abs() == radius;
            let step = if is_rim || radius == 0 { 1 } else { 2 * radius };
            (-radius..=radius).step_by(step as usize).map(move |z| IVec3::new(x, y, z))
        })
    };
    (-radius..=radius).flat_map(plane)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::procedural;
    use crate::simplify::{Method, Target, simplify};

    #[test]
    fn a_shell_has_the_cells_of_its_surface() {
        assert_eq!(shell_of(0).count(), 1);
        for radius in 1..5 {
            let cells: Vec<IVec3> = shell_of(radius).collect();
            let side = |radius: i32| (2 * radius + 1).pow(3);
            assert_eq!(cells.len() as i32, side(radius) - side(radius - 1));
            assert!(cells.iter().all(|cell| cell.abs().max_element() == radius));
        }
    }

    #[test]
    fn a_simplified_mesh_has_the_colors_of_its_nearest_vertices() {
        let mut mesh = procedural::icosphere(16);
        mesh.center = DVec3::splat(1e6);
        mesh.colors = mesh.positions.iter().map(|p| (0.5 * *p + 0.5).extend(1.0)).collect();
        let few = simplify(&mesh, Method::default(), Target::Ratio(0.1)).unwrap();
        assert!(few.colors.is_empty());
        let mut few = few.with_colors_of(&mesh);
        few.validate().unwrap();
        // Far away, the search is by brute force.
        few.positions.push(glam::Vec3::new(300.0, 1.0, 0.0));
        few.colors.clear();
        let few = few.with_colors_of(&mesh);
        for (position, color) in few.positions.iter().zip(&few.colors) {
            let point = position.as_dvec3() + few.center - mesh.center;
            let away = |vertex: &usize| mesh.positions[*vertex].as_dvec3().distance_squared(point);
            let nearest = (0..mesh.positions.len()).min_by(|a, b| away(a).total_cmp(&away(b))).unwrap();
            assert_eq!(*color, mesh.colors[nearest]);
        }
    }
}
