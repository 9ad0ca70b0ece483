//! Kd-tree over many spheres that share one material, in the object's own space.

use super::block_tree::BlockTree;
use super::blocks::SphereBlock;
use super::leaf::{BLOCK, LeafBlock, MAX_PRIMS};
use super::mesh_tree::BuildPreset;
use super::ray::{Nearest, TreeRay};
use super::reference::Primitives;
use crate::geometry::{Aabb, Ray, Shear, intersect_sphere};
use glam::{DVec3, Vec3};

/// A kd-tree over many spheres in the object's own space, built once and shared by all objects that use it.
#[derive(Debug, PartialEq)]
pub struct SphereTree {
    pub(super) centers: Vec<Vec3>,
    pub(super) radii: Vec<f32>,
    pub(super) tree: BlockTree<SphereBlock>,
}

struct SpherePrimitives<'a> {
    centers: &'a [Vec3],
    radii: &'a [f32],
}

/// Bounds of a sphere, rounded outwards.
pub(super) fn sphere_bounds(center: Vec3, radius: f32) -> Aabb {
    let (min, max) = (center - radius, center + radius);
    let padding = super::ray::RELATIVE_PADDING * (center.abs() + radius);
    Aabb { min: min - padding, max: max + padding }
}

/// Bounds of the part of a sphere on one side of a plane; the rim of a cap may be narrower than the sphere. Arguments
/// as in [`Primitives::clipped`].
pub(super) fn clip_sphere(center: Vec3, radius: f32, axis: usize, limit: f32, below: bool, padding: f32) -> Aabb {
    let mut bounds = sphere_bounds(center, radius);
    // Distance of the plane from the centre, positive if less than half of the sphere is kept.
    let height = if below { center[axis] - limit } else { limit - center[axis] };
    if height > 0.0 {
        let rim = (f64::from(radius).powi(2) - f64::from(height).powi(2)).max(0.0).sqrt() as f32;
        let reach = rim + padding + super::ray::RELATIVE_PADDING * (center.abs().max_element() + radius);
        for other in [(axis + 1) % 3, (axis + 2) % 3] {
            bounds.min[other] = bounds.min[other].max(center[other] - reach);
            bounds.max[other] = bounds.max[other].min(center[other] + reach);
        }
    }
    bounds
}

impl SpherePrimitives<'_> {
    fn sphere(&self, prim: u32) -> (Vec3, f32) {
        (self.centers[prim as usize], self.radii[prim as usize])
    }
}

impl Primitives for SpherePrimitives<'_> {
    fn len(&self) -> usize {
        self.centers.len()
    }

    fn bounds(&self, prim: u32) -> Aabb {
        let (center, radius) = self.sphere(prim);
        sphere_bounds(center, radius)
    }

    fn clipped(&self, prim: u32, axis: usize, limit: f32, below: bool, padding: f32) -> Option<Aabb> {
        let (center, radius) = self.sphere(prim);
        Some(clip_sphere(center, radius, axis, limit, below, padding))
    }

    fn shape(&self, prim: u32) -> Option<[u32; 10]> {
        let (center, radius) = self.sphere(prim);
        let [x, y, z] = center.to_array().map(f32::to_bits);
        Some([x, y, z, radius.to_bits(), 0, 0, 0, 0, 0, 0])
    }
}

impl SphereTree {
    /// Builds the tree. One radius per centre; radii positive, all numbers finite.
    ///
    /// # Panics
    /// If the two lists differ in length, or have more entries than a tree can index.
    pub fn build(centers: &[Vec3], radii: &[f32]) -> Self {
        assert_eq!(centers.len(), radii.len(), "each sphere needs a centre and a radius");
        let (centers, radii) = (centers.to_vec(), radii.to_vec());
        assert!(centers.len() < MAX_PRIMS, "a cloud of more than 2^31 spheres");
        let spheres = SpherePrimitives { centers: &centers, radii: &radii };
        let make_block = |prims: &[u32]| SphereBlock::new(prims, |prim| spheres.sphere(prim));
        let tree = BlockTree::build(&spheres, &BuildPreset::Best.config(BLOCK), make_block, |_| Vec::new());
        Self { centers, radii, tree }
    }

    /// The bounds of all spheres; empty if there are none.
    pub fn bounds(&self) -> Aabb {
        self.tree.nodes.bounds
    }

    /// Centre and radius of one sphere, in the object's own space.
    #[inline]
    pub fn sphere(&self, prim: u32) -> (Vec3, f32) {
        (self.centers[prim as usize], self.radii[prim as usize])
    }

    /// Number of spheres.
    pub fn len(&self) -> usize {
        self.centers.len()
    }

    /// Whether there are no spheres.
    pub fn is_empty(&self) -> bool {
        self.centers.is_empty()
    }

    /// Offers the spheres along the ray until no nearer hit is possible; `nearest` limits the ray, not `ray.t_max`.
    pub(super) fn offer_hits(&self, ray: &Ray, shear: &Shear, nearest: &mut Nearest, any: bool) {
        let tree_ray = TreeRay::new(ray.origin, ray.dir, shear, self.tree.extent);
        let wide = RayF64::new(ray);
        self.tree.nodes.walk(&tree_ray, nearest.t, |first, count| {
            for block in self.tree.leaf(first, count).blocks {
                for (lane, prim) in block.prims().iter().enumerate() {
                    let (center, radius) = block.sphere(lane);
                    wide.offer_sphere(center, radius, prim, nearest);
                }
            }
            if any && nearest.found { f32::NEG_INFINITY } else { nearest.t }
        });
    }

    /// Like [`offer_hits`](Self::offer_hits), by brute force.
    pub(super) fn offer_hits_naive(&self, ray: &Ray, nearest: &mut Nearest) {
        let wide = RayF64::new(ray);
        for prim in 0..self.len() as u32 {
            let (center, radius) = self.sphere(prim);
            wide.offer_sphere(center, radius, prim, nearest);
        }
    }
}

/// A ray in `f64`, for spheres and planes.
pub(super) struct RayF64 {
    pub origin: DVec3,
    pub dir: DVec3,
    inv_dir_squared: f64,
}

impl RayF64 {
    #[inline]
    pub fn new(ray: &Ray) -> Self {
        let (origin, dir) = (ray.origin.as_dvec3(), ray.dir.as_dvec3());
        Self { origin, dir, inv_dir_squared: 1.0 / (dir.x * dir.x + dir.y * dir.y + dir.z * dir.z) }
    }

    #[inline]
    pub fn offer_sphere(&self, center: Vec3, radius: f32, prim: u32, nearest: &mut Nearest) {
        if let Some((near, far)) = intersect_sphere(self.origin, self.dir, self.inv_dir_squared, center, radius) {
            // The far side only counts from inside: for an origin outside, the near side is always in front of it.
            nearest.offer(if near > 0.0 { near } else { far }, 0.0, 0.0, prim);
        }
    }
}
