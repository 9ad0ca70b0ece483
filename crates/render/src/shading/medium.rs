//! Media that contain a path: nested solids have their own index and absorption.
//!
//! The medium of a path is a set of bodies ([`crate::prepare::bodies::Bodies`]), of any size: entering a body adds it,
//! leaving removes it. Where bodies overlap the smallest one counts, independent of the order of entry, so index and
//! absorption are functions of position alone, and paths from the camera and from the lights agree on them (nested
//! dielectrics with priorities, Schmidt and Budge 2002).
//!
//! An open surface bounds no body: its side says what is before it and behind it, and a path in other media gets to the
//! right ones there. A set has at most one open body, the largest; closed ones within it count.
//!
//! An interface scales radiance by (n before / n after)², and both indices come from the sets on its two sides, never
//! from the surface. The factors of a path cancel except for the first and the last index, so no sequence of surfaces,
//! however they are nested, open or hit in the wrong order, makes radiance / n² grow.

use crate::prepare::bodies::Boundary;
use crate::prepare::prepared::Prepared;
use crate::shading::interface::{Interface, MediumId};
use glam::Vec3;
use rustc_hash::FxHashMap;

/// The sets of media that the paths of one worker have reached, each stored once.
///
/// The ids of sets differ between workers, but only their equality matters.
#[derive(Debug, Default)]
pub(crate) struct MediumSets {
    /// Rows of [`crate::prepare::bodies::Bodies`] of each set, ascending: the last one determines the medium.
    sets: Vec<Box<[u32]>>,
    /// Four per set, by [`MediumId`].
    media: Vec<Medium>,
    ids: FxHashMap<Box<[u32]>, MediumId>,
    /// By previous set and crossed boundary; `None` if the path leaves a body that is not in the set.
    crossings: FxHashMap<(MediumId, u32, bool), Option<MediumId>>,
    camera: MediumId,
}

/// Maximum number of sets per worker.
const MOST_SETS: usize = 1 << 16;

#[derive(Clone, Copy, Debug)]
struct Medium {
    ior: f32,
    /// Absorption per metre.
    absorption: Vec3,
}

impl MediumSets {
    /// Returns the set that contains the camera. Must be called before new paths, when no path is in flight.
    ///
    /// - `camera`: rows of [`crate::prepare::bodies::Bodies`], ascending; for the same [`MediumSets`], `camera` and
    ///   `scene` must always be the same.
    pub fn start(&mut self, scene: &Prepared, camera: &[u32]) -> MediumId {
        if self.sets.is_empty() || self.sets.len() > MOST_SETS {
            self.sets.clear();
            self.media.clear();
            self.ids.clear();
            self.crossings.clear();
            self.id_of(scene, Box::default());
            self.camera = self.id_of(scene, camera.into());
        }
        self.camera
    }

    /// Returns the set of these rows of [`crate::prepare::bodies::Bodies`], ascending.
    pub fn within(&mut self, scene: &Prepared, rows: &[u32]) -> MediumId {
        if rows.is_empty() { MediumId::OUTSIDE } else { self.id_of(scene, rows.into()) }
    }

    /// Index of refraction.
    #[inline]
    pub fn ior(&self, id: MediumId) -> f32 {
        self.media[id.0 as usize].ior
    }

    /// Factor n² of environment radiance inside these media, as for a path that entered through surfaces. It is 1
    /// unless a path leaves the scene without having left all bodies.
    #[inline]
    pub fn environment_scale(&self, id: MediumId) -> f32 {
        self.ior(id) * self.ior(id)
    }

    /// Transmittance over `distance` metres (Beer–Lambert).
    #[inline]
    pub fn transmittance(&self, id: MediumId, distance: f32) -> Vec3 {
        let absorption = self.media[id.0 as usize].absorption;
        if absorption == Vec3::ZERO {
            return Vec3::ONE;
        }
        // 0 · ∞ would be NaN: a channel without absorption transmits everything over any distance.
        Vec3::select(absorption.cmpgt(Vec3::ZERO), (-absorption * distance).exp(), Vec3::ONE)
    }

    /// Returns the interface at a boundary for a path in the media `from`.
    ///
    /// - `leaf`: which of the transparent parts of the material the path takes, see [`crate::prepare::bodies::Bodies`];
    /// - `others`: boundaries at the same position, see [`crate::prepare::contacts`].
    #[inline]
    pub fn interface(
        &mut self,
        scene: &Prepared,
        from: MediumId,
        boundary: Boundary,
        leaf: u32,
        others: &[Boundary],
    ) -> Interface {
        let is_open = |boundary: Boundary| scene.tables.bodies.is_open(boundary.body);
        // A sheet that lies on a body says nothing: the body knows what is on both sides.
        let has_body = !others.is_empty() && (!is_open(boundary) || others.iter().any(|&other| !is_open(other)));
        // What is before an open surface follows from its side alone.
        let before = if is_open(boundary) && !has_body {
            self.crossed(scene, from, Boundary { front: !boundary.front, ..boundary }, leaf)
        } else {
            None
        };
        let (here, before) = (self.ior(from), self.ior(before.unwrap_or(from)));
        // Bodies are entered before others are left: intermediate media have no thickness.
        let all = || {
            let all = std::iter::once((boundary, leaf)).chain(others.iter().map(|&other| (other, 0)));
            all.filter(|&(boundary, _)| !(has_body && is_open(boundary)))
        };
        let mut in_order =
            all().filter(|(boundary, _)| boundary.front).chain(all().filter(|(boundary, _)| !boundary.front));
        let beyond = in_order.try_fold(from, |at, (boundary, leaf)| self.crossed(scene, at, boundary, leaf));
        match beyond {
            Some(beyond) => {
                let beyond_ior = self.ior(beyond);
                Interface { eta: before / beyond_ior, radiance_eta: here / beyond_ior, beyond }
            }
            // A closed surface hit from behind, alone or with others: it refracts, but medium and radiance of the path
            // stay the same.
            None => {
                let iors = scene.tables.bodies.iors(boundary.body + leaf);
                let eta = iors[from.channel() as usize] / here;
                Interface { eta, radiance_eta: 1.0, beyond: from }
            }
        }
    }

    /// Returns the set after a crossing; `None` if the path leaves a closed body that it did not enter.
    fn crossed(&mut self, scene: &Prepared, from: MediumId, boundary: Boundary, leaf: u32) -> Option<MediumId> {
        let Boundary { body, front } = boundary;
        let row = if front { body + leaf } else { body };
        if let Some(&found) = self.crossings.get(&(from, row, front)) {
            return found;
        }
        let mut rows = self.sets[from.0 as usize / 4].to_vec();
        let bodies = &scene.tables.bodies;
        let is_open = bodies.is_open(body);
        if is_open {
            rows.retain(|&row| !bodies.is_open(row));
        }
        let beyond = if front {
            rows.insert(rows.partition_point(|&other| other <= row), row);
            Some(self.id_of(scene, rows.into()))
        } else if is_open {
            Some(self.id_of(scene, rows.into()))
        } else {
            let own = row..row + scene.tables.bodies.n_leaves(body);
            let at = rows.iter().rposition(|row| own.contains(row));
            at.map(|at| {
                rows.remove(at);
                self.id_of(scene, rows.into())
            })
        };
        let beyond = beyond.map(|beyond| beyond.in_channel(from.channel()));
        self.crossings.insert((from, row, front), beyond);
        beyond
    }

    fn id_of(&mut self, scene: &Prepared, rows: Box<[u32]>) -> MediumId {
        if let Some(&id) = self.ids.get(&rows) {
            return id;
        }
        let id = MediumId(4 * self.sets.len() as u32);
        let (iors, absorption) = match rows.last() {
            Some(&row) => (scene.tables.bodies.iors(row), scene.tables.bodies.absorption(row)),
            None => ([1.0; 4], scene.shading.air),
        };
        self.ids.insert(rows.clone(), id);
        self.sets.push(rows);
        self.media.extend(iors.map(|ior| Medium { ior, absorption }));
        id
    }

    /// Limits a path in the media `from` to one channel at boundaries where light is dispersed; returns its media and
    /// the factor of its throughput, or `None` if nothing changes.
    ///
    /// - `u`: uniform in `[0, 1)`, the same for all vertices of a path.
    pub fn dispersed(
        &self,
        scene: &Prepared,
        from: MediumId,
        boundaries: impl IntoIterator<Item = Boundary>,
        u: impl FnOnce() -> f32,
    ) -> Option<(MediumId, Vec3)> {
        let bodies = &scene.tables.bodies;
        let within = || self.sets[from.0 as usize / 4].last().is_some_and(|&row| bodies.disperses_in(row));
        if from.channel() != 0 || !(boundaries.into_iter().any(|boundary| bodies.disperses(boundary.body)) || within())
        {
            return None;
        }
        let channel = ((3.0 * u()) as u32).min(2);
        let mut factor = [0.0; 3];
        factor[channel as usize] = 3.0;
        Some((from.in_channel(1 + channel), factor.into()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::environment::Environment;
    use crate::core::material::{Material, ScalarInput};
    use crate::core::snapshot::Object;
    use crate::test_scene::prepared;
    use firstlight_kdtree::Shape;

    /// Spheres about the origin with these radii, each with its own glass; the last material is a blend of the first
    /// two.
    fn spheres(radii_and_iors: &[(f32, f32)]) -> Prepared {
        let mut materials: Vec<Material> = radii_and_iors
            .iter()
            .map(|&(_, ior)| Material::Glass { ior, absorption: Vec3::ZERO, dispersion: 0.0 })
            .collect();
        materials.push(Material::blend(ScalarInput::Constant(0.5), 0, 1));
        let shapes: Vec<_> =
            radii_and_iors.iter().map(|&(radius, _)| Shape::Sphere { center: Vec3::ZERO, radius }).collect();
        let objects = (0..shapes.len() as u32).map(Object::plain).collect();
        of(shapes, objects, materials)
    }

    fn of(shapes: Vec<Shape>, objects: Vec<Object>, materials: Vec<Material>) -> Prepared {
        prepared(shapes, objects, materials, Environment::Black)
    }

    /// Crosses object `object`, all of whose material is `material`.
    fn pass(sets: &mut MediumSets, scene: &Prepared, from: MediumId, object: u32, front: bool) -> Interface {
        let material = scene.geometry.objects[object as usize].materials[0];
        let boundary = scene.tables.bodies.boundary(object, 0, material, front);
        sets.interface(scene, from, boundary, 0, &[])
    }

    #[test]
    fn a_hundred_bodies_are_left_as_they_were_entered() {
        let radii: Vec<_> = (0..100).map(|i| (1.0 - 0.009 * i as f32, 1.1 + 0.01 * i as f32)).collect();
        let scene = spheres(&radii);
        let mut sets = MediumSets::default();
        assert_eq!(sets.start(&scene, &[]), MediumId::OUTSIDE);
        let (mut at, mut ids, mut scale) = (MediumId::OUTSIDE, Vec::new(), 1.0);
        for i in 0..100 {
            ids.push(at);
            let interface = pass(&mut sets, &scene, at, i, true);
            scale *= f64::from(interface.radiance_eta).powi(2);
            at = interface.beyond;
            assert_eq!(sets.ior(at), radii[i as usize].1);
        }
        for i in (0..100).rev() {
            let interface = pass(&mut sets, &scene, at, i, false);
            scale *= f64::from(interface.radiance_eta).powi(2);
            at = interface.beyond;
            assert_eq!(at, ids[i as usize], "layer {i}");
        }
        assert!((scale - 1.0).abs() < 1e-4, "{scale}");
        assert_eq!(scene.tables.bodies.deepest(), 100);
    }

    #[test]
    fn the_smallest_body_counts_in_whatever_order_they_are_entered_and_left() {
        let scene = spheres(&[(1.0, 1.5), (0.9, 1.3)]);
        let mut sets = MediumSets::default();
        sets.start(&scene, &[]);
        let large_first = pass(&mut sets, &scene, MediumId::OUTSIDE, 0, true).beyond;
        let both = pass(&mut sets, &scene, large_first, 1, true);
        let small_first = pass(&mut sets, &scene, MediumId::OUTSIDE, 1, true).beyond;
        let again = pass(&mut sets, &scene, small_first, 0, true);
        assert_eq!((again.beyond, again.eta, sets.ior(again.beyond)), (both.beyond, 1.0, 1.3));
        // The large sphere is left first: the path is in the small one before and after.
        let left = pass(&mut sets, &scene, both.beyond, 0, false);
        assert_eq!((left.beyond, left.eta), (small_first, 1.0));
        assert_eq!(pass(&mut sets, &scene, left.beyond, 1, false).beyond, MediumId::OUTSIDE);
    }

    #[test]
    fn leaving_what_was_not_entered_bends_light_and_changes_nothing_else() {
        let scene = spheres(&[(1.0, 1.5), (0.9, 1.3)]);
        let mut sets = MediumSets::default();
        sets.start(&scene, &[]);
        let inside = pass(&mut sets, &scene, MediumId::OUTSIDE, 0, true).beyond;
        let interface = pass(&mut sets, &scene, inside, 1, false);
        assert_eq!(interface, Interface { eta: 1.3 / 1.5, radiance_eta: 1.0, beyond: inside });
    }

    #[test]
    fn the_side_of_an_open_surface_says_what_is_before_and_behind_it() {
        let sheet =
            |y: f32| Shape::Quad { corner: Vec3::new(-5.0, y, -5.0), edge_u: 10.0 * Vec3::Z, edge_v: 10.0 * Vec3::X };
        let glass = |ior| Material::Glass { ior, absorption: Vec3::ZERO, dispersion: 0.0 };
        let ball = Shape::Sphere { center: Vec3::ZERO, radius: 1.0 };
        let materials = vec![glass(1.5), glass(1.5), glass(1.2)];
        let scene = of(vec![sheet(0.0), sheet(-3.0), ball], (0..3).map(Object::plain).collect(), materials);
        let mut sets = MediumSets::default();
        let outside = sets.start(&scene, &[]);
        let entered = pass(&mut sets, &scene, outside, 0, true);
        assert_eq!((entered.eta, entered.radiance_eta), (1.0 / 1.5, 1.0 / 1.5));
        // Left by another sheet: water need not be of one piece.
        let left = pass(&mut sets, &scene, entered.beyond, 1, false);
        assert_eq!(left, Interface { eta: 1.5, radiance_eta: 1.5, beyond: outside });
        // From behind without having entered it, and again from before: bent, but no brighter or darker than it is.
        let behind = pass(&mut sets, &scene, outside, 0, false);
        assert_eq!(behind, Interface { eta: 1.5, radiance_eta: 1.0, beyond: outside });
        let again = pass(&mut sets, &scene, entered.beyond, 1, true);
        assert_eq!((again.eta, again.radiance_eta, sets.ior(again.beyond)), (1.0 / 1.5, 1.0, 1.5));
        assert_eq!(pass(&mut sets, &scene, again.beyond, 0, false).beyond, outside);
        // A body in the water counts, and the surface of the water within it does not.
        let ball = pass(&mut sets, &scene, entered.beyond, 2, true);
        assert_eq!((ball.eta, sets.ior(ball.beyond)), (1.5 / 1.2, 1.2));
        let out_of_water = pass(&mut sets, &scene, ball.beyond, 0, false);
        assert_eq!((out_of_water.eta, sets.ior(out_of_water.beyond)), (1.0, 1.2));
        assert_eq!(pass(&mut sets, &scene, out_of_water.beyond, 2, false).beyond, outside);
    }

    #[test]
    fn cracks_leave_a_body_closed_and_large_holes_do_not() {
        let glass = Material::Glass { ior: 1.5, absorption: Vec3::ZERO, dispersion: 0.0 };
        let is_open = |keep: &dyn Fn(Vec3) -> bool| {
            let mut mesh = firstlight_mesh::procedural::icosphere(6).flat();
            let middle = |triangle: &[u32; 3]| triangle.iter().map(|&i| mesh.positions[i as usize]).sum::<Vec3>() / 3.0;
            let kept: Vec<_> = mesh.triangles.iter().copied().filter(|triangle| keep(middle(triangle))).collect();
            mesh.triangles = kept;
            let build = firstlight_kdtree::BuildPreset::Quick;
            let tree = firstlight_kdtree::MeshTree::build(&mesh.positions, &mesh.triangles, build).into();
            let object = Object { mesh: Some(mesh.into()), ..Object::plain(0) };
            let (world_from_object, space) = (glam::Affine3A::IDENTITY, Default::default());
            let shape = Shape::Mesh { tree, world_from_object, space };
            of(vec![shape], vec![object], vec![glass.clone()]).tables.bodies.is_open(0)
        };
        assert!(!is_open(&|_| true) && !is_open(&|p| p.y < 0.9) && !is_open(&|p| p.x.abs() > 0.05));
        assert!(is_open(&|p| p.y < 0.3) && is_open(&|p| p.y > 0.5));
    }

    #[test]
    fn a_blend_of_two_glasses_is_left_as_the_one_that_was_entered() {
        let mut scene = spheres(&[(1.0, 1.5), (0.9, 1.3)]);
        let (shapes, materials) = (scene.geometry.tree.shapes().to_vec(), scene.shading.materials.clone());
        scene = of(shapes, vec![Object::plain(2), Object::plain(1)], materials);
        let mut sets = MediumSets::default();
        sets.start(&scene, &[]);
        for (leaf, ior) in [(0, 1.5), (1, 1.3)] {
            let boundary = |front| scene.tables.bodies.boundary(0, 0, 2, front);
            let entered = sets.interface(&scene, MediumId::OUTSIDE, boundary(true), leaf, &[]).beyond;
            assert_eq!(sets.ior(entered), ior);
            for part in 0..2 {
                let left = sets.interface(&scene, entered, boundary(false), part, &[]);
                assert_eq!((left.beyond, left.eta), (MediumId::OUTSIDE, ior), "in by {leaf}, out by {part}");
            }
        }
    }

    #[test]
    fn a_camera_knows_what_it_is_inside_of() {
        let scene = spheres(&[(1.0, 1.5), (0.5, 1.3), (0.2, 1.1)]);
        let around = |x: f32| scene.tables.bodies.around(&scene.geometry, Vec3::new(x, 0.0, 0.0));
        assert_eq!([0.0, 0.3, 0.7, 1.2].map(around), [vec![0, 1, 2], vec![0, 1], vec![0], vec![]]);
        // A box of quads is one body, and so is a half-space; a point beside the box is in the half-space only.
        let quad = |corner, edge_u, edge_v| Shape::Quad { corner, edge_u, edge_v };
        let (o, x, y, z) = (Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z);
        let mut shapes =
            vec![quad(o, y, x), quad(o + z, x, y), quad(o, z, y), quad(o + x, y, z), quad(o, x, z), quad(o + y, z, x)];
        shapes.push(Shape::Plane { point: Vec3::Y * 2.0, normal: Vec3::Y });
        let objects = [0, 0, 0, 0, 0, 0, 1].map(Object::plain).into();
        let glass = |ior| Material::Glass { ior, absorption: Vec3::ZERO, dispersion: 0.0 };
        let scene = of(shapes, objects, vec![glass(1.5), glass(1.3)]);
        let around = |point| scene.tables.bodies.around(&scene.geometry, point);
        assert_eq!(around(Vec3::splat(0.5)), [0, 1]);
        assert_eq!(around(Vec3::new(1.5, 0.5, 0.5)), [0]);
        assert_eq!(around(Vec3::new(0.5, 3.0, 0.5)), [0; 0]);
    }
}
