//! Rays through cutouts: surfaces with an opacity map, and the invisible backs of one-sided surfaces.
//!
//! A ray that hits such a point continues behind it, in the same direction and at the same path depth. Where opacity is
//! fractional, the decision is random: it is a hash of the ray and the hit, so that a ray gets the same answer in every
//! query, and on average the transmitted share of light continues. Scenes without such surfaces have no cost.

use crate::core::material::{MaterialId, ScalarInput};
use crate::core::material_queries::Cutout;
use crate::core::texture::TexturePoint;
use crate::prepare::occluders::Occluders;
use crate::prepare::prepared::Prepared;
use crate::sampling::{hash_combine, hash_u32};
use crate::shading::vertex::{Vertex, material_of, mesh_texture_point};
use firstlight_kdtree::geometry::{Ray, robust};
use firstlight_kdtree::{Hit, HitBatch, RayBatch, RayClass};

/// Maximum number of surfaces that a ray may pass: bounds the work, far above any real scene.
const MOST_PASSED: usize = 10_000;

impl Prepared {
    /// Finds the closest hits that are not cut out; see [`firstlight_kdtree::SceneTree::closest_hits`].
    ///
    /// `t` is measured from the origin of the original ray.
    pub(crate) fn closest_hits(&self, rays: &RayBatch, class: RayClass, hits: &mut HitBatch) {
        self.geometry.tree.closest_hits(rays, class, hits);
        if self.tables.features.cutouts {
            self.pass_cutouts(rays, hits, |rays, hits| {
                self.geometry.tree.closest_hits(rays, RayClass::Incoherent, hits);
            });
        }
    }

    /// Whether rays are occluded; see [`firstlight_kdtree::SceneTree::any_hits`].
    ///
    /// Among cutouts the closest hit tells where a ray continues.
    pub(crate) fn any_hits(&self, rays: &RayBatch, class: RayClass, occluded: &mut Vec<bool>) {
        if !self.tables.features.cutouts {
            return self.geometry.tree.any_hits(rays, class, occluded);
        }
        let mut hits = HitBatch::default();
        let Some(occluders) = &self.occluders else {
            self.closest_hits(rays, class, &mut hits);
            occluded.clear();
            occluded.extend((0..rays.len()).map(|i| hits.get(i).is_some()));
            return;
        };
        occluders.opaque.any_hits(rays, class, occluded);
        let mut passed = RayBatch::default();
        (0..rays.len()).filter(|&i| !occluded[i]).for_each(|i| passed.push(&rays.get(i)));
        occluders.cut.closest_hits(&passed, RayClass::Incoherent, &mut hits);
        in_scene(&mut hits, occluders);
        self.pass_cutouts(&passed, &mut hits, |rays, hits| {
            occluders.cut.closest_hits(rays, RayClass::Incoherent, hits);
            in_scene(hits, occluders);
        });
        occluded.iter_mut().filter(|occluded| !**occluded).enumerate().for_each(|(i, occluded)| {
            *occluded = hits.get(i).is_some();
        });
    }

    /// Like [`Self::closest_hits`], for one ray.
    pub(crate) fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        if !self.tables.features.cutouts {
            return self.geometry.tree.closest_hit(ray);
        }
        let mut rays = RayBatch::default();
        rays.push(ray);
        let mut hits = HitBatch::default();
        self.closest_hits(&rays, RayClass::Incoherent, &mut hits);
        hits.get(0)
    }

    /// Replaces hits of cutouts by the next ones behind them, which `closest_hits` finds.
    fn pass_cutouts(&self, rays: &RayBatch, hits: &mut HitBatch, closest_hits: impl Fn(&RayBatch, &mut HitBatch)) {
        let mut open: Vec<(usize, Ray)> = Vec::new();
        for i in 0..rays.len() {
            let ray = rays.get(i);
            if let Some(onwards) = hits.get(i).and_then(|hit| self.onwards(&ray, &hit)) {
                open.push((i, onwards));
            }
        }
        let (mut batch, mut found) = (RayBatch::default(), HitBatch::default());
        for _ in 0..MOST_PASSED {
            if open.is_empty() {
                return;
            }
            batch.clear();
            open.iter().for_each(|(_, ray)| batch.push(ray));
            closest_hits(&batch, &mut found);
            let mut k = 0;
            open.retain_mut(|(i, ray)| {
                let hit = found.get(k);
                k += 1;
                if let Some(onwards) = hit.and_then(|hit| self.onwards(ray, &hit)) {
                    *ray = onwards;
                    return true;
                }
                let first = rays.get(*i);
                hits.set(*i, hit.map(|hit| Hit { t: along(&first, ray.at(hit.t)), ..hit }));
                false
            });
        }
    }

    /// Returns the continuation of a ray behind its hit, if that is cut out.
    #[inline]
    fn onwards(&self, ray: &Ray, hit: &Hit) -> Option<Ray> {
        let id = material_of(self, hit);
        self.behind_cutout(self.tables.cutouts[id as usize].as_ref()?, id, ray, hit)
    }

    fn behind_cutout(&self, cutout: &Cutout, id: MaterialId, ray: &Ray, hit: &Hit) -> Option<Ray> {
        let length = ray.dir.length();
        let unit = Ray { dir: ray.dir / length, ..*ray };
        let of_unit = Hit { t: hit.t * length, ..*hit };
        // Most hits are decided by their side: a whole vertex, with its textures, costs several times as much.
        let point = self.geometry.tree.surface_point(&unit, &of_unit);
        let front = (-unit.dir).dot(point.geometric_normal) >= 0.0;
        if cutout.has_back || front {
            let opacity = match cutout.opacity {
                ScalarInput::Constant(opacity) => opacity,
                map @ ScalarInput::Texture(_) => map.eval(self, self.texture_point(id, &unit, &of_unit)),
            };
            let is_there = match cutout.cutoff {
                Some(cutoff) => opacity >= cutoff,
                None => opacity >= 1.0 || probability(ray, hit) < opacity,
            };
            if is_there {
                return None;
            }
        }
        let origin = robust::offset_ray_origin(point.position, point.error, point.geometric_normal, ray.dir);
        Some(if ray.t_max.is_finite() {
            // Ends exactly at the end of the first ray, wherever it starts.
            Ray { origin, dir: ray.at(ray.t_max) - origin, t_max: 1.0 }
        } else {
            Ray { origin, ..*ray }
        })
    }

    /// Returns the point of a hit for texture lookups; `ray` is of unit length.
    fn texture_point(&self, id: MaterialId, ray: &Ray, hit: &Hit) -> TexturePoint {
        match &self.geometry.objects[hit.object as usize].mesh {
            Some(mesh) => mesh_texture_point(mesh, hit),
            None => Vertex::new(self, ray, hit, id).texture_point,
        }
    }
}

/// Replaces the objects of hits among objects with cutouts by those of the scene.
fn in_scene(hits: &mut HitBatch, occluders: &Occluders) {
    for object in hits.object.iter_mut().filter(|object| **object != HitBatch::MISS) {
        *object = occluders.cut_objects[*object as usize];
    }
}

/// Returns the parameter of a point along a ray, in lengths of its direction.
fn along(ray: &Ray, point: glam::Vec3) -> f32 {
    (point - ray.origin).dot(ray.dir) / ray.dir.length_squared()
}

/// A hash of a ray and its hit, uniform in `[0, 1)`.
fn probability(ray: &Ray, hit: &Hit) -> f32 {
    let of_ray = ray.origin.to_array().into_iter().chain(ray.dir.to_array()).map(f32::to_bits);
    let bits = of_ray.chain([hit.object, hit.prim]).fold(0x51ed_270b, hash_combine);
    (hash_u32(bits) >> 8) as f32 * (1.0 / (1 << 24) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::environment::Environment;
    use crate::core::material::{Material, MaterialKind};
    use crate::core::snapshot::Object;
    use crate::sampling::Sampler;
    use crate::test_scene::prepared;
    use firstlight_kdtree::Shape;
    use glam::Vec3;

    /// A scene of small quads and spheres, of materials by turns, and rays of any length through it.
    fn crowd(materials: Vec<Material>, used: &[u32]) -> (Prepared, RayBatch) {
        let point = |i: u32, k: u32| {
            let [x, y] = Sampler::new(7, i, k, 0).pair(0).to_array();
            Vec3::new(x, y, Sampler::new(7, i, k, 0).single(2))
        };
        let shapes = (0..300).map(|i| match i % 3 {
            0 => Shape::Sphere { center: point(i, 0), radius: 0.02 },
            _ => Shape::Quad { corner: point(i, 0), edge_u: 0.2 * point(i, 1), edge_v: 0.2 * (point(i, 2) - 0.5) },
        });
        let objects = (0..300).map(|i| Object::plain(used[i % used.len()])).collect();
        let scene = prepared(shapes.collect(), objects, materials, Environment::Constant(Vec3::ONE));
        let mut rays = RayBatch::default();
        for i in 0..4000 {
            let (origin, end) = (point(i, 3), point(i, 4));
            let t_max = if i % 2 == 0 { 1.0 } else { f32::INFINITY };
            rays.push(&Ray { origin, dir: end - origin, t_max });
        }
        (scene, rays)
    }

    #[test]
    fn rays_among_cutouts_are_occluded_where_their_closest_hit_is_no_hole() {
        let material = |kind| Material::of_kind(kind, Vec3::ONE.into()).expect("no blend");
        let holes = |share: f32| {
            let mut blend = Material::blend(ScalarInput::Constant(1.0), 0, 0);
            if let Material::Blend { opacity, .. } = &mut blend {
                *opacity = ScalarInput::Constant(share);
            }
            blend
        };
        let materials =
            vec![material(MaterialKind::Diffuse), holes(0.5), holes(0.0), material(MaterialKind::Principled)];
        for (used, apart) in [(&[0, 1, 2, 3][..], true), (&[1, 2], false), (&[0], false)] {
            let (scene, rays) = crowd(materials.clone(), used);
            assert_eq!(scene.occluders.is_some(), apart);
            let (mut hits, mut occluded) = (HitBatch::default(), Vec::new());
            for class in [RayClass::Coherent, RayClass::Incoherent] {
                scene.closest_hits(&rays, class, &mut hits);
                scene.any_hits(&rays, class, &mut occluded);
                let expected: Vec<bool> = (0..rays.len()).map(|i| hits.get(i).is_some()).collect();
                assert_eq!(occluded, expected);
                let n = occluded.iter().filter(|occluded| **occluded).count();
                assert!((400..3600).contains(&n), "{n} rays of 4,000 are occluded");
            }
        }
    }
}
