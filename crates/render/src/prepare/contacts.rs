//! Surfaces of transparent bodies that coincide with other surfaces: shared walls, glass that stands on a floor.
//!
//! A path that has passed a surface starts behind it, by the error bound of its position. It skips everything closer
//! than that, so coincident surfaces are handled at one vertex:
//!
//! - if one of them is opaque, that one is hit, from both sides;
//! - otherwise the path passes them all, entering bodies before leaving others, like a single wall between the media
//!   before and behind them ([`crate::shading::medium::MediumSets::interface`]).
//!
//! The objects that may have such points are determined when the scene is prepared: two faces in one plane, or two
//! equal spheres. Scenes without any have no cost.

use crate::core::material::Material;
use crate::core::snapshot::Geometry;
use crate::prepare::bodies::{Bodies, Boundary};
use crate::prepare::touching::touching;
use firstlight_kdtree::geometry::Ray;
use firstlight_kdtree::geometry::robust::offset_ray_origin;
use firstlight_kdtree::{Hit, HitBatch, RayBatch, SceneTree, Shape, SurfacePoint};
use glam::Vec3;
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// See the [module](self).
#[derive(Debug, Default)]
pub(crate) struct Contacts {
    /// Per object; empty if there are none.
    of_object: Vec<Vec<Other>>,
}

/// The scene data for coincident surfaces.
pub(crate) struct ContactScene<'a> {
    pub geometry: &'a Geometry,
    pub materials: &'a [Material],
    pub bodies: &'a Bodies,
}

/// The contacts of another scene, which may have some of the same objects at the same indices.
pub(crate) struct ContactsBefore<'a> {
    pub geometry: &'a Geometry,
    pub materials: &'a [Material],
    pub contacts: &'a Contacts,
}

impl ContactsBefore<'_> {
    /// Returns what is known of pairs with overlapping boxes: whether they touch, if both objects are here what they
    /// are among `shapes`.
    fn known_pairs(&self, shapes: &[Shape]) -> impl Fn((u32, u32)) -> Option<bool> {
        let clear = clear_objects(self.geometry, self.materials);
        let before = self.geometry.tree.shapes();
        let same: Vec<bool> = shapes.iter().zip(before).map(|(now, before)| now.is_same(before)).collect();
        let is_same = move |i: u32| same.get(i as usize).is_some_and(|&same| same);
        let listed = |a: u32, b: u32| {
            self.contacts.of_object.get(a as usize).is_some_and(|others| others.iter().any(|other| other.object == b))
        };
        move |(a, b)| {
            let was_compared = is_same(a) && is_same(b) && (clear[a as usize] || clear[b as usize]);
            was_compared.then(|| listed(a, b) || listed(b, a))
        }
    }
}

/// Per object: whether a part of it is transparent.
fn clear_objects(geometry: &Geometry, materials: &[Material]) -> Vec<bool> {
    let is_clear: Vec<bool> = materials.iter().map(|material| material.has_clear_part(materials)).collect();
    geometry.objects.iter().map(|object| object.materials.iter().any(|&id| is_clear[id as usize])).collect()
}

/// An object whose surface may coincide with that of a transparent one.
#[derive(Clone, Debug)]
struct Other {
    object: u32,
    /// A tree of this object only.
    alone: Arc<SceneTree>,
}

/// Precedence of coincident surfaces: the greatest is hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum ContactKind {
    Glass,
    /// Takes precedence over smooth glass: one rough wall scatters light that passes both.
    RoughGlass,
    /// A blend with transparent parts.
    PartlyClear,
    Opaque,
}

impl Contacts {
    pub fn build(geometry: &Geometry, materials: &[Material], before: Option<ContactsBefore>) -> Self {
        let shapes = geometry.tree.shapes();
        let clear = clear_objects(geometry, materials);
        let pairs = match &before {
            Some(before) => touching(shapes, &clear, before.known_pairs(shapes)),
            None => touching(shapes, &clear, |_| None),
        };
        if pairs.is_empty() {
            return Self::default();
        }
        let statics = geometry.tree.statics();
        let mut alone: FxHashMap<u32, Arc<SceneTree>> = FxHashMap::default();
        let mut of_object = vec![Vec::new(); shapes.len()];
        for (clear, other) in pairs {
            let tree = alone.entry(other);
            let only = || vec![shapes[other as usize].clone()];
            let tree = tree.or_insert_with(|| Arc::new(SceneTree::build_with(only(), &statics)));
            of_object[clear as usize].push(Other { object: other, alone: tree.clone() });
        }
        Self { of_object }
    }

    /// Replaces each hit by the coincident surface that takes precedence: an opaque one, or the first of several
    /// transparent ones.
    pub fn settle(&self, touched: &ContactScene, rays: &RayBatch, hits: &mut HitBatch) {
        if self.of_object.is_empty() {
            return;
        }
        for i in 0..rays.len() {
            let Some(hit) = hits.get(i) else { continue };
            if !self.of_object[hit.object as usize].is_empty() {
                let Hit { t, u, v, prim, object } = self.met(touched, &rays.get(i), &hit);
                (hits.t[i], hits.u[i], hits.v[i], hits.prim[i], hits.object[i]) = (t, u, v, prim, object);
            }
        }
    }

    fn met(&self, touched: &ContactScene, ray: &Ray, hit: &Hit) -> Hit {
        let rank = |hit: &Hit| (kind_of(touched, hit), size_rank(touched, hit.object), std::cmp::Reverse(hit.object));
        let (mut met, mut greatest) = (*hit, rank(hit));
        if greatest.0 == ContactKind::Opaque {
            return met;
        }
        self.in_place_of(touched, ray, hit, |other, _| {
            let rank = rank(&other);
            if rank > greatest {
                (met, greatest) = (other, rank);
            }
        });
        met
    }

    /// Returns the boundaries of glass that coincide with that of a hit, which comes from [`Self::settle`].
    #[inline]
    pub fn along_with(&self, touched: &ContactScene, hit: &Hit, ray: impl FnOnce() -> Ray) -> Vec<Boundary> {
        let mut found = Vec::new();
        if !self.of_object.is_empty() && !self.of_object[hit.object as usize].is_empty() {
            let ray = ray();
            self.in_place_of(touched, &ray, hit, |other, at| {
                if matches!(kind_of(touched, &other), ContactKind::Glass | ContactKind::RoughGlass) {
                    let front = ray.dir.dot(at.geometric_normal) <= 0.0;
                    found.push(touched.bodies.boundary(
                        other.object,
                        other.prim,
                        touched.geometry.material_of(&other),
                        front,
                    ));
                }
            });
        }
        found
    }

    /// Calls `f` with each other hit that a path through this one would skip.
    fn in_place_of(&self, touched: &ContactScene, ray: &Ray, hit: &Hit, mut f: impl FnMut(Hit, &SurfacePoint)) {
        let own = touched.geometry.tree.surface_point(ray, hit);
        let onwards =
            if own.geometric_normal.dot(ray.dir) < 0.0 { -own.geometric_normal } else { own.geometric_normal };
        let [near, far] =
            [-onwards, onwards].map(|to| offset_ray_origin(own.position, own.error, own.geometric_normal, to));
        // What coincides is hit no earlier, cells being bounded far better than to a thousandth. A ray leaves the slab by
        // no more than the error of a position, even if that of the other surface is sixteen times that of this one.
        let cosine = onwards.dot(ray.dir);
        let behind = hit.t + 64.0 * (far - near).dot(onwards) / cosine;
        let (ray, before) = (Ray { t_max: behind.max(hit.t.next_up()).min(ray.t_max), ..*ray }, 0.999 * hit.t);
        for Other { object, alone } in &self.of_object[hit.object as usize] {
            let Some(found) = alone.closest_hit_from(&ray, before) else { continue };
            let at = alone.surface_point(&ray, &found);
            if (at.position - near).dot(onwards) >= 0.0 && (far - at.position).dot(onwards) >= 0.0 {
                f(Hit { object: *object, ..found }, &at);
            }
        }
    }
}

fn kind_of(touched: &ContactScene, hit: &Hit) -> ContactKind {
    match &touched.materials[touched.geometry.material_of(hit) as usize] {
        Material::Glass { .. } => ContactKind::Glass,
        Material::RoughGlass { .. } => ContactKind::RoughGlass,
        Material::Blend { .. } | Material::Phong { .. } | Material::Principled { .. } | Material::Disney { .. }
            if touched.bodies.is_transparent(hit.object) =>
        {
            ContactKind::PartlyClear
        }
        _ => ContactKind::Opaque,
    }
}

/// Rank among equal surfaces: the one with the largest errors is hit, so that a path that starts behind it is behind
/// the others too. It does not depend on the side from which a path comes.
fn size_rank(touched: &ContactScene, object: u32) -> u32 {
    match &touched.geometry.tree.shapes()[object as usize] {
        Shape::Mesh { tree, world_from_object, .. } => {
            let bounds = tree.bounds();
            let offset = Vec3::from(world_from_object.translation).abs().max_element();
            let scale = world_from_object.matrix3.to_cols_array().iter().fold(0.0, |most: f32, x| most.max(x.abs()));
            // Positive numbers are ordered like their bits.
            (offset + scale * bounds.min.abs().max(bounds.max.abs()).max_element()).max(f32::MIN_POSITIVE).to_bits()
        }
        _ => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::material::MaterialKind;
    use crate::core::snapshot::Object;
    use firstlight_kdtree::{BuildPreset, HitSpace, MeshTree};
    use firstlight_mesh::procedural;
    use glam::{Affine3A, DVec3};
    use proptest::prelude::*;

    /// Boxes on a grid, half of them of glass, so that many share walls.
    fn scene(tree: &Arc<MeshTree>, places: &[(u8, u8)], is_glass: &[bool]) -> Geometry {
        let placed =
            places.iter().map(|&(x, y)| Affine3A::from_translation(Vec3::new(f32::from(x), f32::from(y), 0.0)));
        let shape = |world_from_object| Shape::Mesh { tree: tree.clone(), world_from_object, space: HitSpace::Object };
        let objects = is_glass.iter().map(|&is_glass| Object::plain(u32::from(!is_glass))).collect();
        Geometry::build(placed.map(shape).collect(), objects)
    }

    fn others(contacts: &Contacts) -> Vec<Vec<u32>> {
        contacts.of_object.iter().map(|list| list.iter().map(|other| other.object).collect()).collect()
    }

    /// What [`Contacts::in_place_of`] finds, and what lies in the slab among the first hits of the others on the whole ray.
    fn found_by_both(contacts: &Contacts, touched: &ContactScene, ray: &Ray, hit: &Hit) -> [Vec<Hit>; 2] {
        let mut found = Vec::new();
        contacts.in_place_of(touched, ray, hit, |other, _| found.push(other));
        let own = touched.geometry.tree.surface_point(ray, hit);
        let reach = own.geometric_normal.abs().dot(own.error);
        let others = contacts.of_object[hit.object as usize].iter();
        let expected = others.filter_map(|Other { object, alone }| {
            let first = alone.closest_hit(ray)?;
            let away = (alone.surface_point(ray, &first).position - own.position).dot(own.geometric_normal).abs();
            // The offset of a ray is rounded up by a unit in the last place.
            (away <= reach + 1e-6).then_some(Hit { object: *object, ..first })
        });
        [found, expected.collect()]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn what_coincides_is_found_as_on_the_whole_ray(
            places in proptest::collection::vec((0u8..4, 0u8..4), 12),
            stands in any::<bool>(),
            rays in proptest::collection::vec(
                ([-3.0f32..7.0, -3.0f32..7.0, -4.0f32..4.0], [0.0f32..4.0, 0.0f32..4.0, -0.5f32..0.5]), 200),
        ) {
            let mesh = procedural::cuboid(DVec3::ONE).flat();
            let geometry = {
                // Meshes that stand still need trees of their own to be in one.
                let tree = || Arc::new(MeshTree::build(&mesh.positions, &mesh.triangles, BuildPreset::Quick));
                let shapes = places.iter().map(|&(x, y)| Shape::Mesh {
                    tree: tree(),
                    world_from_object: Affine3A::from_translation(Vec3::new(f32::from(x), f32::from(y), 0.0)),
                    space: if stands { HitSpace::World } else { HitSpace::Object },
                });
                Geometry::build(shapes.collect(), (0..12).map(|i| Object::plain(i % 2)).collect())
            };
            let materials = [MaterialKind::Glass, MaterialKind::Diffuse]
                .map(|kind| Material::of_kind(kind, Vec3::ONE.into()).expect("no blend"));
            let contacts = Contacts::build(&geometry, &materials, None);
            prop_assume!(!contacts.of_object.is_empty());
            let bodies = Bodies::build(&geometry, &materials, None);
            let touched = ContactScene { geometry: &geometry, materials: &materials, bodies: &bodies };
            for (from, to) in rays {
                let (from, to) = (Vec3::from(from), Vec3::from(to));
                let ray = Ray::new(from, (to - from).normalize_or(Vec3::X));
                if let Some(hit) = geometry.tree.closest_hit(&ray) {
                    let [found, expected] = found_by_both(&contacts, &touched, &ray, &hit);
                    prop_assert_eq!(found, expected);
                }
            }
        }

        #[test]
        fn contacts_after_changes_are_those_of_a_new_scene(
            before in proptest::collection::vec((0u8..5, 0u8..5), 12),
            moved in proptest::collection::vec((0usize..12, (0u8..5, 0u8..5)), 0..4),
            other_materials in proptest::collection::vec(any::<bool>(), 12),
            changes_materials in any::<bool>(),
        ) {
            let mesh = procedural::cuboid(DVec3::ONE).flat();
            let tree = Arc::new(MeshTree::build(&mesh.positions, &mesh.triangles, BuildPreset::Quick));
            let materials = [MaterialKind::Glass, MaterialKind::Diffuse]
                .map(|kind| Material::of_kind(kind, Vec3::ONE.into()).expect("no blend"));
            let is_glass: Vec<bool> = (0..12).map(|i| i % 2 == 0).collect();
            let geometry = scene(&tree, &before, &is_glass);
            let contacts = Contacts::build(&geometry, &materials, None);
            let mut after = before.clone();
            for (i, place) in moved {
                after[i] = place;
            }
            let changed = scene(&tree, &after, if changes_materials { &other_materials } else { &is_glass });
            let known = ContactsBefore { geometry: &geometry, materials: &materials, contacts: &contacts };
            let kept = Contacts::build(&changed, &materials, Some(known));
            prop_assert_eq!(others(&kept), others(&Contacts::build(&changed, &materials, None)));
        }
    }
}
