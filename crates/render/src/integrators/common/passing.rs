//! Rays through cutouts: surfaces with an opacity map, and the invisible backs of one-sided surfaces; and rays to lights
//! through panes.
//!
//! A ray that hits such a point continues behind it, in the same direction and at the same path depth. Where opacity is
//! fractional, the decision is random: it is a hash of the ray and the hit, so that a ray gets the same answer in every
//! query, and on average the transmitted share of light continues. Scenes without such surfaces have no cost.
//!
//! A pane without thickness does not bend light: what it lets pass of a point on a light is known, so light sampling
//! finds lights behind it. A path that goes straight on through it is weighted against that as if it were not there.

use crate::core::material::{Material, MaterialId, ScalarInput};
use crate::core::texture::TexturePoint;
use crate::prepare::occluders::Occluders;
use crate::prepare::prepared::Prepared;
use crate::sampling::{hash_combine, hash_u32};
use crate::shading::principled::at::principled_at;
use crate::shading::scatter::Scatter;
use crate::shading::surface::{blend_at, lobe_at};
use crate::shading::vertex::{Vertex, material_of, mesh_texture_point};
use firstlight_kdtree::geometry::{Ray, robust};
use firstlight_kdtree::{Hit, HitBatch, RayBatch, RayClass, SurfacePoint};
use glam::Vec3;

/// What a ray does where it hits something.
enum Passing {
    /// It goes on.
    Past(Ray),
    /// It ends at this hit, which may be that of the other one of two triangles back to back.
    Met(Hit),
}

/// Maximum number of surfaces that a ray may pass: bounds the work, far above any real scene.
const MOST_PASSED: usize = 10_000;

impl Prepared {
    /// Finds the closest hits that are not cut out; see [`firstlight_kdtree::SceneTree::closest_hits`].
    ///
    /// `t` is measured from the origin of the original ray.
    pub(crate) fn closest_hits(&self, rays: &RayBatch, class: RayClass, hits: &mut HitBatch) {
        self.geometry.tree.closest_hits(rays, class, hits);
        if self.tables.features.cutouts {
            self.pass_on(rays, hits, self.in_all(), |_, ray, hit| self.past_cutout(ray, hit));
        }
    }

    /// Like [`Self::closest_hits`], behind all panes.
    pub(crate) fn closest_hits_behind_panes(&self, rays: &RayBatch, class: RayClass, hits: &mut HitBatch) {
        self.geometry.tree.closest_hits(rays, class, hits);
        if self.tables.features.cutouts || self.tables.features.panes {
            self.pass_on(rays, hits, self.in_all(), |_, ray, hit| self.past(ray, hit).0);
        }
    }

    /// Whether rays are occluded; see [`firstlight_kdtree::SceneTree::any_hits`].
    pub(crate) fn any_hits(&self, rays: &RayBatch, class: RayClass, occluded: &mut Vec<bool>) {
        if self.tables.features.cutouts {
            self.any_hits_passing(rays, class, occluded, |_, ray, hit| self.past_cutout(ray, hit));
        } else {
            self.geometry.tree.any_hits(rays, class, occluded);
        }
    }

    /// Whether rays to lights are occluded, where panes are no obstacle. Returns those that pass panes, and the shares of
    /// light that these let pass.
    pub(crate) fn shadows(&self, rays: &RayBatch, class: RayClass, occluded: &mut Vec<bool>) -> Vec<(usize, Vec3)> {
        let mut passed: Vec<(usize, Vec3)> = Vec::new();
        if !self.tables.features.panes {
            self.any_hits(rays, class, occluded);
            return passed;
        }
        self.any_hits_passing(rays, class, occluded, |i, ray, hit| {
            let (passing, share) = self.past(ray, hit);
            if share != Vec3::ONE {
                passed.push((i, share));
            }
            passing
        });
        passed
    }

    /// Among surfaces that rays may pass, the closest hit tells where a ray continues.
    ///
    /// - `past`: what the ray with this number does at a hit.
    fn any_hits_passing(
        &self,
        rays: &RayBatch,
        class: RayClass,
        occluded: &mut Vec<bool>,
        mut past: impl FnMut(usize, &Ray, &Hit) -> Passing,
    ) {
        let mut hits = HitBatch::default();
        let Some(occluders) = &self.occluders else {
            self.geometry.tree.closest_hits(rays, class, &mut hits);
            self.pass_on(rays, &mut hits, self.in_all(), past);
            occluded.clear();
            occluded.extend((0..rays.len()).map(|i| hits.get(i).is_some()));
            return;
        };
        occluders.opaque.any_hits(rays, class, occluded);
        let (mut open, mut numbers) = (RayBatch::default(), Vec::new());
        for i in (0..rays.len()).filter(|&i| !occluded[i]) {
            open.push(&rays.get(i));
            numbers.push(i);
        }
        let in_passable = |rays: &RayBatch, hits: &mut HitBatch| {
            occluders.passable.closest_hits(rays, RayClass::Incoherent, hits);
            in_scene(hits, occluders);
        };
        in_passable(&open, &mut hits);
        self.pass_on(&open, &mut hits, in_passable, |k, ray, hit| past(numbers[k], ray, hit));
        for (k, &i) in numbers.iter().enumerate() {
            occluded[i] = hits.get(k).is_some();
        }
    }

    fn in_all(&self) -> impl Fn(&RayBatch, &mut HitBatch) {
        |rays, hits| self.geometry.tree.closest_hits(rays, RayClass::Incoherent, hits)
    }

    /// Like [`Self::closest_hits_behind_panes`], for one ray.
    pub(crate) fn closest_hit_behind_panes(&self, ray: &Ray) -> Option<Hit> {
        let (mut rays, mut hits) = (RayBatch::default(), HitBatch::default());
        rays.push(ray);
        self.closest_hits_behind_panes(&rays, RayClass::Incoherent, &mut hits);
        hits.get(0)
    }

    /// Replaces hits that rays pass by the next ones behind them, which `closest_hits` finds.
    ///
    /// - `past`: what the ray with this number does at a hit.
    fn pass_on(
        &self,
        rays: &RayBatch,
        hits: &mut HitBatch,
        closest_hits: impl Fn(&RayBatch, &mut HitBatch),
        mut past: impl FnMut(usize, &Ray, &Hit) -> Passing,
    ) {
        let mut open: Vec<(usize, Ray)> = Vec::new();
        for i in 0..rays.len() {
            let ray = rays.get(i);
            let Some(hit) = hits.get(i) else { continue };
            match past(i, &ray, &hit) {
                Passing::Past(onwards) => open.push((i, onwards)),
                Passing::Met(met) if met.prim != hit.prim => hits.set(i, Some(met)),
                Passing::Met(_) => {}
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
                let passing = found.get(k).map(|hit| past(*i, ray, &hit));
                k += 1;
                let met = match passing {
                    Some(Passing::Past(onwards)) => {
                        *ray = onwards;
                        return true;
                    }
                    Some(Passing::Met(hit)) => Some(hit),
                    None => None,
                };
                let first = rays.get(*i);
                hits.set(*i, met.map(|hit| Hit { t: along(&first, ray.at(hit.t)), ..hit }));
                false
            });
        }
    }

    /// A ray goes on behind a hit that is cut out.
    #[inline]
    fn past_cutout(&self, ray: &Ray, hit: &Hit) -> Passing {
        self.past_cutout_of(ray, hit, false)
    }

    /// - `is_twin`: of two triangles back to back, it is the one that faces the ray.
    fn past_cutout_of(&self, ray: &Ray, hit: &Hit, is_twin: bool) -> Passing {
        let id = material_of(self, hit);
        let Some(cutout) = &self.tables.cutouts[id as usize] else { return Passing::Met(*hit) };
        let (unit, of_unit) = of_unit_length(ray, hit);
        // Most hits are decided by their side: a whole vertex, with its textures, costs several times as much.
        let point = self.geometry.tree.surface_point(&unit, &of_unit);
        if cutout.has_back || is_twin || (-unit.dir).dot(point.geometric_normal) >= 0.0 {
            let opacity = match cutout.opacity {
                ScalarInput::Constant(opacity) => opacity,
                map @ ScalarInput::Texture(_) => map.eval(self, self.texture_point(id, &unit, &of_unit)),
            };
            let is_there = match cutout.cutoff {
                Some(cutoff) => opacity >= cutoff,
                None => opacity >= 1.0 || probability(ray, hit) < opacity,
            };
            if is_there {
                return Passing::Met(*hit);
            }
        } else if let Some(twin) = self.twin_of(&unit, hit, &point) {
            return self.past_cutout_of(ray, &twin, true);
        }
        let origin = robust::offset_ray_origin(point.position, point.error, point.geometric_normal, ray.dir);
        Passing::Past(from_behind(origin, ray))
    }

    /// The hit of a triangle that lies where this one does, as far as both are known, and faces the ray.
    fn twin_of(&self, unit: &Ray, hit: &Hit, point: &SurfacePoint) -> Option<Hit> {
        self.tables.twins.opposite(&self.geometry, hit).find(|other| {
            let other = self.geometry.tree.surface_point(unit, other);
            let normal = other.geometric_normal;
            let apart = (other.position - point.position).dot(normal).abs();
            normal.dot(unit.dir) < 0.0 && apart <= (other.error + point.error).dot(normal.abs())
        })
    }

    /// A ray goes on behind cutouts and panes. The second is the share of light that passes.
    fn past(&self, ray: &Ray, hit: &Hit) -> (Passing, Vec3) {
        let met = match self.past_cutout(ray, hit) {
            Passing::Met(met) => met,
            onwards @ Passing::Past(_) => return (onwards, Vec3::ONE),
        };
        let id = material_of(self, &met);
        if !self.tables.panes[id as usize] {
            return (Passing::Met(met), Vec3::ONE);
        }
        let (unit, of_unit) = of_unit_length(ray, &met);
        let vertex = Vertex::new(self, &unit, &of_unit, id);
        let straight = match &self.shading.materials[id as usize] {
            Material::Principled { .. } => principled_at(self, id, &vertex, &mut None, 0, true)
                .map(|layered| layered.straight(vertex.wo, vertex.normal)),
            Material::Blend { .. } => {
                blend_at(self, id, &vertex, None).map(|blend| blend.straight(vertex.wo, vertex.normal))
            }
            _ => lobe_at(self, id, &vertex, None).map(|lobe| lobe.straight(vertex.wo, vertex.normal)),
        };
        match straight.filter(|share| *share != Vec3::ZERO) {
            Some(share) => (Passing::Past(from_behind(vertex.passing(ray.dir), ray)), share),
            None => (Passing::Met(met), Vec3::ONE),
        }
    }

    /// Returns the point of a hit for texture lookups; `ray` is of unit length.
    fn texture_point(&self, id: MaterialId, ray: &Ray, hit: &Hit) -> TexturePoint {
        match &self.geometry.objects[hit.object as usize].mesh {
            Some(mesh) => mesh_texture_point(mesh, hit),
            None => Vertex::new(self, ray, hit, id).texture_point,
        }
    }
}

/// Replaces the objects of hits among those that rays may pass by those of the scene.
fn in_scene(hits: &mut HitBatch, occluders: &Occluders) {
    for object in hits.object.iter_mut().filter(|object| **object != HitBatch::MISS) {
        *object = occluders.passable_objects[*object as usize];
    }
}

fn of_unit_length(ray: &Ray, hit: &Hit) -> (Ray, Hit) {
    let length = ray.dir.length();
    (Ray { dir: ray.dir / length, ..*ray }, Hit { t: hit.t * length, ..*hit })
}

/// Returns the rest of a ray from a point behind its hit.
fn from_behind(origin: Vec3, ray: &Ray) -> Ray {
    if ray.t_max.is_finite() {
        // Ends exactly at the end of the first ray, wherever it starts.
        Ray { origin, dir: ray.at(ray.t_max) - origin, t_max: 1.0 }
    } else {
        Ray { origin, ..*ray }
    }
}

/// Returns the parameter of a point along a ray, in lengths of its direction.
fn along(ray: &Ray, point: Vec3) -> f32 {
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
    use crate::core::material::MaterialKind;
    use crate::core::snapshot::Object;
    use crate::sampling::Sampler;
    use crate::test_scene::prepared;
    use firstlight_kdtree::{BuildPreset, MeshTree, Shape};
    use glam::{Affine3A, Quat};
    use std::sync::Arc;

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

    /// Sheets of one-sided triangles, each with others that face the other way: the same, or the other halves of squares.
    #[test]
    fn no_ray_passes_one_sided_triangles_that_lie_back_to_back() {
        let mut ball = firstlight_mesh::procedural::icosphere(6);
        ball.triangles.extend(ball.triangles.clone().iter().map(|[a, b, c]| [*c, *b, *a]));
        let mut cube = firstlight_mesh::procedural::cube();
        for first in (0..6).map(|side| 4 * side) {
            let is_right = cube.triangles[first as usize / 2] == [first, first + 1, first + 2];
            for [a, b, c] in [[3, 1, 0], [3, 2, 1]].map(|corners| corners.map(|corner: u32| first + corner)) {
                cube.triangles.push(if is_right { [a, b, c] } else { [a, c, b] });
            }
        }
        let mut sheet = Material::of_kind(MaterialKind::Principled, Vec3::ONE.into()).expect("no blend");
        if let Material::Principled { two_sided, .. } = &mut sheet {
            *two_sided = false;
        }
        let size = Vec3::new(0.3, -0.4, 0.5);
        let world_from_object =
            Affine3A::from_scale_rotation_translation(size, Quat::from_rotation_x(0.7), Vec3::splat(0.5));
        for mesh in [ball, cube] {
            let n = mesh.triangles.len() as u32 / 2;
            let tree = Arc::new(MeshTree::build(&mesh.positions, &mesh.triangles, BuildPreset::Best));
            let shape = Shape::Mesh { tree, world_from_object, space: Default::default() };
            let object = Object { mesh: Some(Arc::new(mesh)), ..Object::plain(0) };
            let scene = prepared(vec![shape], vec![object], vec![sheet.clone()], Environment::Black);
            let (mut rays, mut hits, mut met, mut occluded) = <(RayBatch, HitBatch, HitBatch, Vec<bool>)>::default();
            for i in 0..4000 {
                let number = |k: usize| (hash_u32(hash_combine(i, k as u32)) >> 8) as f32 / (1 << 24) as f32;
                let [origin, end] = [0, 3].map(|first| Vec3::from_array(std::array::from_fn(|k| number(first + k))));
                rays.push(&Ray { origin, dir: end - origin, t_max: f32::INFINITY });
            }
            scene.geometry.tree.closest_hits(&rays, RayClass::Incoherent, &mut hits);
            scene.closest_hits(&rays, RayClass::Incoherent, &mut met);
            scene.any_hits(&rays, RayClass::Incoherent, &mut occluded);
            let mut n_turned = 0;
            for (i, is_occluded) in occluded.into_iter().enumerate() {
                let (first, hit, ray) = (hits.get(i), met.get(i), rays.get(i));
                assert_eq!((first.map(|hit| hit.t), first.is_some()), (hit.map(|hit| hit.t), is_occluded));
                let (Some(first), Some(hit)) = (first, hit) else { continue };
                n_turned += u32::from(first.prim / n != hit.prim / n);
                let unit = Ray { dir: ray.dir.normalize(), ..ray };
                let at = |hit: &Hit| {
                    let of_unit = Hit { t: hit.t * ray.dir.length(), ..*hit };
                    scene.geometry.tree.surface_point(&unit, &of_unit)
                };
                assert!(at(&hit).geometric_normal.dot(ray.dir) < 1e-5);
                assert!((at(&hit).position - at(&first).position).length() < 1e-6);
            }
            assert!(n_turned > 200, "{n_turned}");
        }
    }
}
