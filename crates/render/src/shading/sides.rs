//! The two sides of a surface that a path meets.

use crate::core::material::MaterialId;
use crate::prepare::bodies::Boundary;
use crate::prepare::prepared::Prepared;
use crate::sampling::Sampler;
use crate::shading::dimensions::DIM_CHANNEL;
use crate::shading::interface::{Interface, MediumId};
use crate::shading::medium::MediumSets;
use firstlight_kdtree::Hit;
use firstlight_kdtree::geometry::Ray;
use glam::Vec3;

/// The media on the two sides of a surface that a path meets.
pub(crate) struct Sides<'a> {
    pub sets: &'a mut MediumSets,
    /// Media on the side of the path.
    pub here: MediumId,
    pub boundary: Boundary,
    /// Boundaries at the same position, see [`crate::shading::medium`].
    others: Vec<Boundary>,
}

impl<'a> Sides<'a> {
    #[inline]
    pub fn new(
        scene: &Prepared,
        sets: &'a mut MediumSets,
        here: MediumId,
        ray: &Ray,
        hit: &Hit,
        id: MaterialId,
        front: bool,
    ) -> Self {
        let bodies = &scene.tables.bodies;
        let others = scene.along_with(hit, || *ray);
        Self { sets, here, boundary: bodies.boundary(hit.object, hit.prim, id, front), others }
    }

    /// Limits a path to one channel if light is dispersed here: `here` becomes its media, and the factor of its
    /// throughput is returned. Must come before [`Self::interface`].
    #[inline]
    pub fn disperse(&mut self, scene: &Prepared, id: MaterialId, sampler: &Sampler) -> Option<Vec3> {
        let materials = &scene.shading.materials;
        if !scene.tables.features.dispersion || !materials[id as usize].has_clear_part(materials) {
            return None;
        }
        let boundaries = std::iter::once(self.boundary).chain(self.others.iter().copied());
        let (here, factor) = self.sets.dispersed(scene, self.here, boundaries, || sampler.single(DIM_CHANNEL))?;
        self.here = here;
        Some(factor)
    }

    /// Returns the interface of a transparent part of the material; see [`MediumSets::interface`].
    #[inline]
    pub fn interface(&mut self, scene: &Prepared, leaf: u32) -> Interface {
        self.sets.interface(scene, self.here, self.boundary, leaf, &self.others)
    }
}
