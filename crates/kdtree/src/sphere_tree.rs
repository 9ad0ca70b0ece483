//! Kd-tree over many spheres that share one material, in the space of their object.

use super::block_tree::BlockTree;
use super::blocks::SphereBlock;
use super::leaf::{BLOCK, LeafBlock, MAX_PRIMS};
use super::mesh_tree::BuildPreset;
use super::ray::{Nearest, TreeRay};
use super::reference::Primitives;
use crate::geometry::{Aabb, Ray, Shear, intersect_sphere};
use glam::{DVec3, Vec3};

/// Kd-tree over many spheres in the space of their object, built once and shared by all objects that use it.
#[derive(Debug, PartialEq)]
pub struct SphereTree {
    pub(super) centers: Vec<Vec3>,
    pub(super) radii: Vec<f32>,
    pub(super) tree: BlockTree<SphereBlock>,
}

struct BallPrimitives<'a> {
    centers: &'a [Vec3],
    radii: &'a [f32],
}

/// The box around a sphere, rounded outwards.
pub(super) fn ball_bounds(center: Vec3, radius: f32) -> Aabb {
    let (min, max) = (center - radius, center + radius);
    let slack = super::ray::WIDEN * (center.abs() + radius);
    Aabb { min: min - slack, max: max + slack }
}

/// The box around the part of a sphere on one side of a plane: the rim of the cap may be narrower than the ball.
/// Arguments as in [`Primitives::clipped`].
pub(super) fn clip_ball(center: Vec3, radius: f32, axis: usize, limit: f32, below: bool, padding: f32) -> Aabb {
    let mut bounds = ball_bounds(center, radius);
    // How far the plane cuts beyond the centre, towards the side that is kept.
    let height = if below { center[axis] - limit } else { limit - center[axis] };
    if height > 0.0 {
        let rim = (f64::from(radius).powi(2) - f64::from(height).powi(2)).max(0.0).sqrt() as f32;
        let reach = rim + padding + super::ray::WIDEN * (center.abs().max_element() + radius);
        for other in [(axis + 1) % 3, (axis + 2) % 3] {
            bounds.min[other] = bounds.min[other].max(center[other] - reach);
            bounds.max[other] = bounds.max[other].min(center[other] + reach);
        }
    }
    bounds
}

impl BallPrimitives<'_> {
    fn ball(&self, prim: u32) -> (Vec3, f32) {
        (self.centers[prim as usize], self.radii[prim as usize])
    }
}

impl Primitives for BallPrimitives<'_> {
    fn len(&self) -> usize {
        self.centers.len()
    }

    fn bounds(&self, prim: u32) -> Aabb {
        let (center, radius) = self.ball(prim);
        ball_bounds(center, radius)
    }

    fn clipped(&self, prim: u32, axis: usize, limit: f32, below: bool, padding: f32) -> Option<Aabb> {
        let (center, radius) = self.ball(prim);
        Some(clip_ball(center, radius, axis, limit, below, padding))
    }

    fn shape(&self, prim: u32) -> Option<[u32; 9]> {
        let (center, radius) = self.ball(prim);
        let [x, y, z] = center.to_array().map(f32::to_bits);
        Some([x, y, z, radius.to_bits(), 0, 0, 0, 0, 0])
    }
}

impl SphereTree {
    /// One radius per centre; radii positive, all numbers finite.
    ///
    /// # Panics
    /// When the two lists differ in length, or have more entries than a tree can number.
    pub fn build(centers: &[Vec3], radii: &[f32]) -> Self {
        assert_eq!(centers.len(), radii.len(), "each sphere needs a centre and a radius");
        let (centers, radii) = (centers.to_vec(), radii.to_vec());
        assert!(centers.len() < MAX_PRIMS, "a cloud of more than 2^31 spheres");
        let balls = BallPrimitives { centers: &centers, radii: &radii };
        let make_block = |prims: &[u32]| SphereBlock::new(prims, |prim| balls.ball(prim));
        let tree = BlockTree::build(&balls, &BuildPreset::Best.config(BLOCK), make_block, |_| Vec::new());
        Self { centers, radii, tree }
    }

    /// The box around all spheres; empty if there are none.
    pub fn bounds(&self) -> Aabb {
        self.tree.nodes.bounds
    }

    /// Centre and radius of one sphere, in the space of the object.
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

    /// Offers the spheres along the ray until nothing nearer can come; `ray.t_max` does not count, `nearest` does.
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

    /// The same by trying every ball.
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
            // The far side only counts from inside: outside, it is never in front.
            nearest.offer(if near > 0.0 { near } else { far }, 0.0, 0.0, prim);
        }
    }
}
