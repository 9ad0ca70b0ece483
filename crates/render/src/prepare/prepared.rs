//! A snapshot with everything that is derived from it.

use crate::core::camera::Camera;
use crate::core::environment::{Environment, EnvironmentSampler};
use crate::core::material::Material;
use crate::core::material_queries::{Cutout, Emission};
use crate::core::snapshot::{Geometry, Shading, Snapshot};
use crate::prepare::ambient::AmbientLight;
use crate::prepare::bodies::{Bodies, BodiesBefore, Boundary};
use crate::prepare::bound::radiance_bound;
use crate::prepare::casters::CasterTable;
use crate::prepare::classic_table::ClassicTable;
use crate::prepare::coat_table::CoatTable;
use crate::prepare::contacts::{ContactScene, Contacts, ContactsBefore};
use crate::prepare::environment_lines::EnvironmentLines;
use crate::prepare::large_textures::LargeTextures;
use crate::prepare::light::{LightTable, reach_of};
use crate::prepare::material_table::MaterialTable;
use crate::prepare::occluders::Occluders;
use crate::prepare::plan_cache::PlanCache;
use crate::prepare::portals::Portals;
use crate::prepare::radiance_unit::radiance_unit;
use crate::prepare::surface_table::SurfaceTable;
use crate::prepare::twins::Twins;
use firstlight_kdtree::geometry::Ray;
use firstlight_kdtree::{Hit, HitBatch, RayBatch};
use glam::Vec3;
use std::fmt;
use std::ops::Deref;
use std::panic::{RefUnwindSafe, UnwindSafe};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// A scene ready for rendering: a [`Snapshot`], to which it dereferences, and its tables, which are shared like its
/// parts.
#[derive(Clone, Debug)]
pub struct Prepared {
    snapshot: Snapshot,
    pub(crate) surfaces: Arc<SurfaceTable>,
    pub(crate) tables: Arc<Tables>,
    /// `None` for a scene without objects that rays may pass, or without others.
    pub(crate) occluders: Option<Arc<Occluders>>,
    /// `None` if nothing moves while the shutter is open.
    moments: Option<SharedMoments>,
    /// Of this camera, once they are looked for; `None` inside if there are none that pay.
    portals: OnceLock<FoundPortals>,
}

/// The portals of a view, if there are any that pay.
type FoundPortals = Option<Arc<Portals>>;

/// A scene that moves while the shutter is open.
pub trait Moments: Send + Sync {
    /// Returns the scene at a moment.
    ///
    /// Must be a pure function; the camera must pass [`Camera::check`](crate::core::camera::Camera::check).
    ///
    /// - `open`: the moment as a fraction of the shutter interval, in `[0, 1)`.
    fn at(&self, open: f64) -> Prepared;
}

impl<F: Fn(f64) -> Prepared + Send + Sync> Moments for F {
    fn at(&self, open: f64) -> Prepared {
        self(open)
    }
}

#[derive(Clone)]
struct SharedMoments(Arc<dyn Moments>);

// Moments are pure functions: a panic leaves nothing half done.
impl UnwindSafe for SharedMoments {}
impl RefUnwindSafe for SharedMoments {}

impl fmt::Debug for SharedMoments {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("moments")
    }
}

impl Deref for Prepared {
    type Target = Snapshot;

    #[inline(always)]
    fn deref(&self) -> &Snapshot {
        &self.snapshot
    }
}

/// Data derived from [`Shading`] for one [`Geometry`], because lights are objects.
#[derive(Debug)]
pub(crate) struct Tables {
    pub(crate) ambient: AmbientLight,
    /// Per material: whether it is textured, and so needs texture coordinates.
    pub(crate) textured: Vec<bool>,
    pub(crate) large_textures: LargeTextures,
    /// Per material, see [`Material::cutout`].
    pub(crate) cutouts: Vec<Option<Cutout>>,
    /// Per material, see [`Material::is_pane`].
    pub(crate) panes: Vec<bool>,
    /// Per material: whether it needs tangents.
    pub(crate) with_tangents: Vec<bool>,
    pub(crate) coats: CoatTable,
    /// Emission per material.
    pub(crate) emission: Vec<Option<Emission>>,
    pub(crate) lights: LightTable,
    pub(crate) bodies: Bodies,
    pub(crate) contacts: Contacts,
    pub(crate) twins: Twins,
    pub(crate) environment_sampler: Option<Arc<EnvironmentSampler>>,
    pub(crate) materials: MaterialTable,
    pub(crate) classic: ClassicTable,
    /// Specular casters, if there are any.
    pub(crate) casters: Option<CasterTable>,
    /// See [`crate::prepare::bound`].
    pub(crate) radiance_bound: Option<f32>,
    /// See [`crate::prepare::radiance_unit`].
    pub(crate) radiance_unit: f32,
    /// Those of the last view for which they were looked for.
    portals: Mutex<FoundPortals>,
    pub(crate) features: Features,
}

/// Features that the scene uses: unused ones cost nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Features {
    /// Some surface transmits paths, so paths keep track of their media.
    pub glass: bool,
    /// Some glass disperses light, so paths may be limited to one channel.
    pub dispersion: bool,
    /// There is absorption between surfaces: by glass or by air.
    pub media: bool,
    /// Some light can be sampled.
    pub light_sampling: bool,
    /// The environment emits.
    pub environment: bool,
    /// Some material is textured.
    pub textures: bool,
    /// Some surfaces have holes or no back.
    pub cutouts: bool,
    /// Some surfaces let light pass straight on.
    pub panes: bool,
    /// Some specular object focuses the light of an emitter, so paths are traced from lights as well.
    pub caustics: bool,
}

impl Prepared {
    /// Builds all tables of a snapshot; the time grows with its objects, lights and textures.
    pub fn new(snapshot: Snapshot) -> Self {
        let surfaces = Arc::new(SurfaceTable::build(&snapshot.geometry.tree));
        let tables = Arc::new(Tables::build(&snapshot.geometry, &snapshot.shading, None));
        let occluders = occluders(&snapshot.geometry, &tables);
        Self { snapshot, surfaces, tables, occluders, moments: None, portals: OnceLock::new() }
    }

    /// Returns the same objects with other materials and lights.
    pub fn with_shading(&self, shading: Arc<Shading>) -> Self {
        let tables = Arc::new(Tables::build(&self.geometry, &shading, Some(self)));
        let is_same = self.tables.passable().eq(tables.passable());
        let occluders = if is_same { self.occluders.clone() } else { occluders(&self.geometry, &tables) };
        let snapshot = Snapshot { shading, ..self.snapshot.clone() };
        Self { snapshot, tables, surfaces: self.surfaces.clone(), occluders, moments: None, portals: OnceLock::new() }
    }

    /// Returns the tables for another snapshot; what is the same in both, and takes long, is not computed again.
    pub fn with_snapshot(&self, snapshot: Snapshot) -> Self {
        let surfaces = Arc::new(SurfaceTable::build(&snapshot.geometry.tree));
        let tables = Arc::new(Tables::build(&snapshot.geometry, &snapshot.shading, Some(self)));
        let occluders = occluders(&snapshot.geometry, &tables);
        Self { snapshot, surfaces, tables, occluders, moments: None, portals: OnceLock::new() }
    }

    /// Returns the same scene with other trees of the same meshes: all hits are the same, and so are the tables.
    pub fn with_trees(&self, geometry: Arc<Geometry>) -> Self {
        let surfaces = Arc::new(SurfaceTable::build(&geometry.tree));
        let occluders = occluders(&geometry, &self.tables);
        let snapshot = Snapshot { geometry, ..self.snapshot.clone() };
        let (tables, portals) = (self.tables.clone(), self.portals.clone());
        Self { snapshot, surfaces, tables, occluders, moments: None, portals }
    }

    /// Whether both are the same scene but for the camera.
    pub fn has_scene_of(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.geometry, &other.geometry) && Arc::ptr_eq(&self.shading, &other.shading)
    }

    /// Returns the same scene with another camera.
    pub fn with_camera(&self, camera: Camera) -> Self {
        let mut seen = self.with_moments(None);
        seen.snapshot.camera = camera;
        seen.portals = OnceLock::new();
        seen
    }

    /// The same scene, which moves while the shutter is open or, with `None`, stands still. All other changes of a
    /// scene make it stand still.
    pub fn with_moments(&self, moments: Option<Arc<dyn Moments>>) -> Self {
        Self { moments: moments.map(SharedMoments), ..self.clone() }
    }

    /// How it moves while the shutter is open; `None` if it stands still.
    pub fn moments(&self) -> Option<&dyn Moments> {
        self.moments.as_ref().map(|moments| &*moments.0)
    }

    /// The portals of the view, if [`Self::find_portals`] has found some.
    #[inline]
    pub(crate) fn portals(&self) -> Option<&Portals> {
        self.portals.get()?.as_deref()
    }

    /// Sets the portals by `find` if they are not known.
    pub(crate) fn find_portals(&self, find: impl FnOnce() -> Option<Portals>) {
        self.portals.get_or_init(|| {
            let found = find().map(Arc::new);
            *self.tables.portals.lock().unwrap_or_else(PoisonError::into_inner) = found.clone();
            found
        });
    }

    /// Sets the portals to those of the same view at another moment, if they are not known.
    pub(crate) fn share_portals(&self, other: &Self) {
        self.portals.get_or_init(|| other.portals.get().cloned().flatten());
    }

    /// Returns the same scene for a preview, which must not be delayed: with the portals of the last view that has some.
    pub(crate) fn with_last_portals(&self) -> Self {
        Self { portals: OnceLock::from(self.tables.last_portals()), ..self.clone() }
    }

    /// Features that the scene uses.
    pub fn features(&self) -> Features {
        self.tables.features
    }

    /// Pretends that the scene uses more features than it does, to measure their cost.
    #[doc(hidden)]
    pub fn with_features(snapshot: Snapshot, features: Features) -> Self {
        let mut prepared = Self::new(snapshot);
        Arc::get_mut(&mut prepared.tables).expect("new").features = features;
        prepared
    }

    /// Whether anything emits.
    pub fn has_light(&self) -> bool {
        self.tables.features.environment
            || self.tables.emission.iter().any(Option::is_some)
            || !self.shading.delta_lights.is_empty()
    }

    /// The lights that can be sampled.
    pub fn lights(&self) -> &LightTable {
        &self.tables.lights
    }

    /// The bodies that contain the camera; see [`Bodies::around`].
    pub(crate) fn camera_media(&self) -> Vec<u32> {
        if !self.tables.features.glass {
            return Vec::new();
        }
        self.tables.bodies.around(&self.geometry, self.camera.eye)
    }

    fn touched(&self) -> ContactScene<'_> {
        ContactScene { geometry: &self.geometry, materials: &self.shading.materials, bodies: &self.tables.bodies }
    }

    /// See [`Contacts::settle`].
    pub(crate) fn settle(&self, rays: &RayBatch, hits: &mut HitBatch) {
        self.tables.contacts.settle(&self.touched(), rays, hits);
    }

    /// See [`Contacts::along_with`].
    #[inline]
    pub(crate) fn along_with(&self, hit: &Hit, ray: impl FnOnce() -> Ray) -> Vec<Boundary> {
        self.tables.contacts.along_with(&self.touched(), hit, ray)
    }
}

impl Tables {
    /// - `before`: a scene that may have some of the same objects, or the same environment, whose tables are then shared.
    fn build(geometry: &Geometry, shading: &Shading, before: Option<&Prepared>) -> Self {
        let Shading { materials, textures, environment, air, delta_lights } = shading;
        let emission: Vec<_> = (0..materials.len() as u32).map(|id| Emission::of(materials, id)).collect();
        let lights = LightTable::build(geometry, &emission, textures, delta_lights);
        let contacts_before = before.map(|before| ContactsBefore {
            geometry: &before.geometry,
            materials: &before.shading.materials,
            contacts: &before.tables.contacts,
        });
        let bodies_before =
            before.map(|before| BodiesBefore { geometry: &before.geometry, bodies: &before.tables.bodies });
        let twins = Twins::of(geometry, before.map(|before| (&*before.geometry, &before.tables.twins)));
        let portals = before.and_then(|before| before.tables.last_portals());
        let coats = CoatTable::build(materials, before.map(|before| &before.tables.coats));
        let casters_before = before.and_then(|before| before.tables.casters.as_ref());
        let before = before.filter(|before| is_same(&before.shading.environment, environment));
        let (ambient, environment_sampler) = match before.map(|before| &before.tables) {
            Some(tables) => (tables.ambient.clone(), tables.environment_sampler.clone()),
            None => (AmbientLight::of(environment), EnvironmentSampler::build(environment).map(Arc::new)),
        };
        let bodies = Bodies::build(geometry, materials, bodies_before);
        let contacts = Contacts::build(geometry, materials, contacts_before);
        let environment_lines = EnvironmentLines::of(environment, environment_sampler.as_ref());
        let mut casters = CasterTable::build(geometry, materials, &lights, environment_lines);
        if let (Some(casters), Some(before)) = (&mut casters, casters_before) {
            casters.plans = PlanCache::after(&before.plans);
        }
        if !delta_lights.is_empty() {
            casters = casters.map(|casters| casters.with_media(geometry, &bodies, &lights));
        }
        let features = Features {
            glass: materials.iter().any(Material::is_clear),
            dispersion: materials.iter().any(Material::disperses),
            media: materials.iter().any(Material::absorbs) || *air != Vec3::ZERO,
            light_sampling: !lights.is_empty() || environment_sampler.is_some(),
            environment: !matches!(environment, Environment::Black),
            textures: materials.iter().any(|material| material.is_textured(materials)),
            caustics: casters.is_some(),
            cutouts: materials.iter().any(|material| material.cutout().is_some()),
            panes: materials.iter().any(|material| material.is_pane(materials)),
        };
        Self {
            radiance_unit: radiance_unit(&lights, &ambient, reach_of(geometry)),
            textured: materials.iter().map(|material| material.is_textured(materials)).collect(),
            large_textures: LargeTextures::build(materials, textures),
            cutouts: materials.iter().map(Material::cutout).collect(),
            panes: materials.iter().map(|material| material.is_pane(materials)).collect(),
            coats,
            with_tangents: materials.iter().map(|material| material.has_tangents(materials)).collect(),
            radiance_bound: (delta_lights.is_empty())
                .then(|| radiance_bound(environment, &emission, materials))
                .flatten(),
            ambient,
            emission,
            lights,
            bodies,
            contacts,
            twins,
            environment_sampler,
            materials: MaterialTable::build(geometry, materials, textures),
            classic: ClassicTable::build(materials),
            casters,
            features,
            portals: Mutex::new(portals),
        }
    }

    /// Per material: whether rays may pass it.
    fn passable(&self) -> impl Iterator<Item = bool> {
        self.cutouts.iter().zip(&self.panes).map(|(cutout, is_pane)| cutout.is_some() || *is_pane)
    }

    fn last_portals(&self) -> FoundPortals {
        self.portals.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

fn occluders(geometry: &Geometry, tables: &Tables) -> Option<Arc<Occluders>> {
    let can_pass = tables.features.cutouts || tables.features.panes;
    can_pass.then(|| Occluders::build(geometry, &tables.passable().collect::<Vec<_>>()))?.map(Arc::new)
}

/// Whether two environments are equal; images only if they are shared.
fn is_same(a: &Environment, b: &Environment) -> bool {
    match (a, b) {
        (Environment::Black, Environment::Black) => true,
        (Environment::Constant(a), Environment::Constant(b)) => a == b,
        (
            Environment::Gradient { zenith, horizon, ground },
            Environment::Gradient { zenith: z, horizon: h, ground: g },
        ) => (zenith, horizon, ground) == (z, h, g),
        (Environment::Image { image, scale, rotation }, Environment::Image { image: other, scale: s, rotation: r }) => {
            Arc::ptr_eq(image, other) && (scale, rotation) == (s, r)
        }
        _ => false,
    }
}
