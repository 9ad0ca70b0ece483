//! Measured distance between two surfaces.
//!
//! Points spread evenly over one surface search for the nearest point of the other, in both directions. The points
//! depend on the mesh alone and sums have a fixed order, so results are reproducible bit for bit.

mod nearest;

use super::Mesh;
use glam::DVec3;
use nearest::NearestTree;
use rayon::prelude::*;

/// Distances from points of one surface to another, metres.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Distances {
    /// Mean over the sample points.
    pub mean: f64,
    /// Root mean square over the sample points.
    pub rms: f64,
    /// Largest distance of a sample point or a referenced vertex.
    pub max: f64,
}

/// Distances between two surfaces in both directions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Deviation {
    /// From the first surface to the second.
    pub forward: Distances,
    /// From the second surface to the first.
    pub backward: Distances,
}

impl Deviation {
    /// Measures the distances from `samples` points spread over the area of each surface; the maxima include every
    /// referenced vertex.
    ///
    /// Triangles without area count through their vertices only.
    pub fn between(first: &Mesh, second: &Mesh, samples: usize) -> Self {
        // In the first mesh's frame.
        let offset = second.center - first.center;
        let (first_tree, second_tree) =
            rayon::join(|| NearestTree::build(first, DVec3::ZERO), || NearestTree::build(second, offset));
        Self {
            forward: distances(first, DVec3::ZERO, &second_tree, samples),
            backward: distances(second, offset, &first_tree, samples),
        }
    }

    /// The Hausdorff distance, as estimated by the samples.
    pub fn max(&self) -> f64 {
        self.forward.max.max(self.backward.max)
    }

    /// The larger mean of the two directions.
    pub fn mean(&self) -> f64 {
        self.forward.mean.max(self.backward.mean)
    }

    /// The larger root mean square of the two directions.
    pub fn rms(&self) -> f64 {
        self.forward.rms.max(self.backward.rms)
    }
}

/// Points per task. They are neighbours along the surface, so the result of each bounds the search of the next.
const CHUNK: usize = 2048;

fn distances(from: &Mesh, offset: DVec3, to: &NearestTree, samples: usize) -> Distances {
    let points = spread_points(from, offset, samples);
    let partial: Vec<(f64, f64, f64)> = points
        .par_chunks(CHUNK)
        .map(|chunk| {
            let (mut sum, mut squares, mut max) = (0.0, 0.0, 0.0_f64);
            let mut guess = None;
            for &point in chunk {
                let distance2 = to.nearest(point, &mut guess);
                sum += distance2.sqrt();
                squares += distance2;
                max = max.max(distance2);
            }
            (sum, squares, max)
        })
        .collect();
    let mut used = vec![false; from.positions.len()];
    from.triangles.iter().flatten().for_each(|&vertex| used[vertex as usize] = true);
    let vertices: Vec<DVec3> =
        from.positions.iter().zip(used).filter(|(_, used)| *used).map(|(p, _)| p.as_dvec3() + offset).collect();
    let vertex_max = vertices
        .par_chunks(CHUNK)
        .map(|chunk| {
            let mut guess = None;
            chunk.iter().map(|&vertex| to.nearest(vertex, &mut guess)).fold(0.0, f64::max)
        })
        .reduce(|| 0.0, f64::max);
    let (sum, squares, max) = partial
        .iter()
        .fold((0.0, 0.0, vertex_max), |total, part| (total.0 + part.0, total.1 + part.1, total.2.max(part.2)));
    let count = points.len().max(1) as f64;
    Distances { mean: sum / count, rms: (squares / count).sqrt(), max: max.sqrt() }
}

/// Returns `samples` points, each representing an equal share of the area, in the order of the triangles.
fn spread_points(mesh: &Mesh, offset: DVec3, samples: usize) -> Vec<DVec3> {
    let mut up_to = 0.0;
    let sums: Vec<f64> = (0..mesh.triangles.len())
        .map(|t| {
            up_to += mesh.doubled_area_normal(t).length();
            up_to
        })
        .collect();
    if !(up_to > 0.0) {
        return Vec::new();
    }
    let mut t = 0;
    (0..samples)
        .map(|i| {
            let at = (i as f64 + 0.5) / samples as f64 * up_to;
            while t + 1 < sums.len() && sums[t] <= at {
                t += 1;
            }
            // The R2 sequence (Roberts 2018), folded into the triangle.
            let mut u = (0.5 + i as f64 * 0.754_877_666_246_692_8).fract();
            let mut v = (0.5 + i as f64 * 0.569_840_290_998_053_3).fract();
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            let [a, b, c] = mesh.corners(t).map(|p| p.as_dvec3());
            a + u * (b - a) + v * (c - a) + offset
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::procedural;

    #[test]
    fn a_moved_plate_is_as_far_as_it_was_moved() {
        let plate =
            Mesh::from_f64(&[DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y], vec![[0, 1, 2], [0, 2, 3]])
                .unwrap();
        let mut moved = plate.clone();
        moved.center += DVec3::new(0.0, 0.0, 0.25);
        let deviation = Deviation::between(&plate, &moved, 1000);
        for found in [deviation.forward, deviation.backward] {
            assert!((found.mean - 0.25).abs() < 1e-12 && (found.rms - 0.25).abs() < 1e-12);
            assert!((found.max - 0.25).abs() < 1e-12);
        }
        // Points on a face are rounded, and so is their distance to it.
        assert!(Deviation::between(&plate, &plate, 1000).max() < 1e-12);
    }

    #[test]
    fn spheres_of_two_radii_are_their_difference_apart() {
        let small = procedural::icosphere(60);
        let mut large = small.clone();
        large.positions.iter_mut().for_each(|p| *p *= 1.5);
        let deviation = Deviation::between(&small, &large, 5000);
        assert!((deviation.forward.mean - 0.5).abs() < 2e-3, "{deviation:?}");
        assert!((deviation.backward.mean - 0.5).abs() < 2e-3, "{deviation:?}");
        assert!((deviation.max() - 0.5).abs() < 2e-3);
    }

    #[test]
    fn one_way_can_be_zero_where_the_other_is_not() {
        let whole = procedural::cuboid(DVec3::ONE);
        let mut part = whole.clone();
        part.triangles.truncate(2);
        let deviation = Deviation::between(&part, &whole, 2000);
        assert!(deviation.forward.max < 1e-12, "{deviation:?}");
        assert!((deviation.backward.max - 1.0).abs() < 1e-6, "{deviation:?}");
    }
}
