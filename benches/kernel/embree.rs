//! Embree 4 on the same rays, loaded at run time so that nothing depends on it.
//!
//! Declared here: the few functions and structures of its C interface (`embree4/rtcore.h`) that a comparison needs.

use crate::clock::cpu_seconds;
use crate::rays::RaySet;
use crate::{WAVE, all_rays};
use firstlight::geometry::Ray;
use firstlight::kdtree::{Hit, HitBatch, SceneTree};
use firstlight::stability::{CheckResult, ReferenceIntersector};
use glam::Vec3;
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::ptr::{null, null_mut};
use std::sync::atomic::{AtomicIsize, Ordering};

unsafe extern "C" {
    fn dlopen(path: *const c_char, flags: c_int) -> *mut c_void;
    fn dlsym(library: *mut c_void, name: *const c_char) -> *mut c_void;
    fn dlerror() -> *const c_char;
}

type Handle = *mut c_void;

/// One ray and its hit, as `RTCRayHit`, with room for what newer versions append.
#[derive(Clone, Copy)]
#[repr(C, align(16))]
struct RayHit {
    origin: [f32; 3],
    t_near: f32,
    dir: [f32; 3],
    time: f32,
    t_far: f32,
    mask: u32,
    id: u32,
    flags: u32,
    normal: [f32; 3],
    u: f32,
    v: f32,
    prim: u32,
    geometry: u32,
    instance: [u32; 9],
}

/// Sixteen of them, as `RTCRayHit16`.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
struct RayHit16 {
    origin: [[f32; 16]; 3],
    t_near: [f32; 16],
    dir: [[f32; 16]; 3],
    time: [f32; 16],
    t_far: [f32; 16],
    mask: [u32; 16],
    id: [u32; 16],
    flags: [u32; 16],
    normal: [[f32; 16]; 3],
    u: [f32; 16],
    v: [f32; 16],
    prim: [u32; 16],
    geometry: [u32; 16],
    instance: [[u32; 16]; 4],
}

/// `RTCIntersectArguments`.
#[repr(C)]
struct Arguments {
    flags: c_int,
    features: u32,
    context: *mut c_void,
    filter: *const c_void,
    intersect: *const c_void,
    unused: [u64; 4],
}

const COHERENT: c_int = 1 << 16;
const INVALID: u32 = u32::MAX;

pub struct Embree {
    device: Handle,
    new_scene: unsafe extern "C" fn(Handle) -> Handle,
    set_quality: unsafe extern "C" fn(Handle, c_int),
    set_flags: unsafe extern "C" fn(Handle, c_int),
    new_geometry: unsafe extern "C" fn(Handle, c_int) -> Handle,
    #[allow(clippy::type_complexity)]
    set_buffer: unsafe extern "C" fn(Handle, c_int, u32, c_int, *const c_void, usize, usize, usize),
    commit_geometry: unsafe extern "C" fn(Handle),
    attach: unsafe extern "C" fn(Handle, Handle) -> u32,
    commit_scene: unsafe extern "C" fn(Handle),
    intersect: unsafe extern "C" fn(Handle, *mut RayHit, *const Arguments),
    intersect16: unsafe extern "C" fn(*const c_int, Handle, *mut RayHit16, *const Arguments),
    occluded: unsafe extern "C" fn(Handle, *mut RayHit, *const Arguments),
}

static BYTES: AtomicIsize = AtomicIsize::new(0);

extern "C" fn count_bytes(_: *mut c_void, bytes: isize, _: bool) -> bool {
    BYTES.fetch_add(bytes, Ordering::Relaxed);
    true
}

impl Embree {
    /// Opens the library; `isa` is empty, or the part `,isa=...` of the device configuration.
    pub fn open(path: &str, isa: &str) -> Result<Self, String> {
        let c_path = CString::new(path).map_err(|error| error.to_string())?;
        let configuration = CString::new(format!("threads=1{isa}")).map_err(|error| error.to_string())?;
        // SAFETY: signatures as in rtcore.h of Embree 4; the library stays open until the program ends.
        unsafe {
            let library = dlopen(c_path.as_ptr(), 2);
            if library.is_null() {
                return Err(CStr::from_ptr(dlerror()).to_string_lossy().into_owned());
            }
            let symbol = |name: &str| {
                let c_name = CString::new(name).unwrap();
                let at = dlsym(library, c_name.as_ptr());
                if at.is_null() { Err(format!("{path} has no {name}")) } else { Ok(at) }
            };
            macro_rules! function {
                ($name:literal) => {
                    std::mem::transmute_copy(&symbol($name)?)
                };
            }
            let new_device: unsafe extern "C" fn(*const c_char) -> Handle = function!("rtcNewDevice");
            let monitor: unsafe extern "C" fn(Handle, extern "C" fn(*mut c_void, isize, bool) -> bool, *mut c_void) =
                function!("rtcSetDeviceMemoryMonitorFunction");
            let device = new_device(configuration.as_ptr());
            monitor(device, count_bytes, null_mut());
            Ok(Self {
                device,
                new_scene: function!("rtcNewScene"),
                set_quality: function!("rtcSetSceneBuildQuality"),
                set_flags: function!("rtcSetSceneFlags"),
                new_geometry: function!("rtcNewGeometry"),
                set_buffer: function!("rtcSetSharedGeometryBuffer"),
                commit_geometry: function!("rtcCommitGeometry"),
                attach: function!("rtcAttachGeometry"),
                commit_scene: function!("rtcCommitScene"),
                intersect: function!("rtcIntersect1"),
                intersect16: function!("rtcIntersect16"),
                occluded: function!("rtcOccluded1"),
            })
        }
    }

    pub fn scene(&self, positions: &[Vec3], triangles: &[[u32; 3]]) -> Scene<'_> {
        let before = BYTES.load(Ordering::Relaxed);
        // Embree reads 16 bytes at the last vertex.
        let mut positions = positions.to_vec();
        positions.push(Vec3::ZERO);
        let triangles = triangles.to_vec();
        // SAFETY: the buffers live as long as the scene; formats are FLOAT3 and UINT3.
        let scene = unsafe {
            let scene = (self.new_scene)(self.device);
            (self.set_quality)(scene, 2);
            if std::env::var_os("FIRSTLIGHT_EMBREE_ROBUST").is_some() {
                (self.set_flags)(scene, 1 << 2);
            }
            let geometry = (self.new_geometry)(self.device, 0);
            (self.set_buffer)(geometry, 1, 0, 0x9003, positions.as_ptr().cast(), 0, 12, positions.len() - 1);
            (self.set_buffer)(geometry, 0, 0, 0x5003, triangles.as_ptr().cast(), 0, 12, triangles.len());
            (self.commit_geometry)(geometry);
            (self.attach)(scene, geometry);
            (self.commit_scene)(scene);
            scene
        };
        let bytes = BYTES.load(Ordering::Relaxed) - before;
        Scene { embree: self, scene, bytes, _positions: positions, _triangles: triangles }
    }
}

pub struct Scene<'a> {
    embree: &'a Embree,
    scene: Handle,
    bytes: isize,
    _positions: Vec<Vec3>,
    _triangles: Vec<[u32; 3]>,
}

/// Rays in Embree's own layouts, so that copying them is no more than a renderer would do.
pub struct Prepared {
    single: Vec<RayHit>,
    packets: Vec<RayHit16>,
    flags: c_int,
}

impl Scene<'_> {
    pub fn bytes(&self) -> isize {
        self.bytes
    }

    pub fn prepare(&self, set: &RaySet) -> Prepared {
        let single: Vec<RayHit> = all_rays(set)
            .map(|ray| RayHit {
                origin: ray.origin.into(),
                t_near: 0.0,
                dir: ray.dir.into(),
                time: 0.0,
                t_far: ray.t_max,
                mask: u32::MAX,
                id: 0,
                flags: 0,
                normal: [0.0; 3],
                u: 0.0,
                v: 0.0,
                prim: INVALID,
                geometry: INVALID,
                instance: [INVALID; 9],
            })
            .collect();
        let packets = single
            .chunks_exact(16)
            .map(|rays| {
                let of = |f: &dyn Fn(&RayHit) -> f32| std::array::from_fn(|i| f(&rays[i]));
                RayHit16 {
                    origin: [of(&|r| r.origin[0]), of(&|r| r.origin[1]), of(&|r| r.origin[2])],
                    t_near: [0.0; 16],
                    dir: [of(&|r| r.dir[0]), of(&|r| r.dir[1]), of(&|r| r.dir[2])],
                    time: [0.0; 16],
                    t_far: of(&|r| r.t_far),
                    mask: [u32::MAX; 16],
                    id: [0; 16],
                    flags: [0; 16],
                    normal: [[0.0; 16]; 3],
                    u: [0.0; 16],
                    v: [0.0; 16],
                    prim: [INVALID; 16],
                    geometry: [INVALID; 16],
                    instance: [[INVALID; 16]; 4],
                }
            })
            .collect();
        let coherent = set.class == firstlight::kdtree::RayClass::Coherent;
        Prepared { single, packets, flags: if coherent { COHERENT } else { 0 } }
    }

    fn arguments(flags: c_int) -> Arguments {
        Arguments { flags, features: u32::MAX, context: null_mut(), filter: null(), intersect: null(), unused: [0; 4] }
    }

    fn intersect(&self, ray: &RayHit, arguments: &Arguments) -> RayHit {
        let mut hit = *ray;
        // SAFETY: laid out as RTCRayHit.
        unsafe { (self.embree.intersect)(self.scene, &mut hit, arguments) };
        hit
    }

    /// Seconds for all rays, one at a time.
    pub fn trace(&self, prepared: &Prepared) -> f64 {
        let arguments = Self::arguments(prepared.flags);
        let mut hits = vec![(0.0, 0.0, 0.0, 0); WAVE];
        let start = cpu_seconds();
        for wave in prepared.single.chunks(WAVE) {
            for (ray, to) in wave.iter().zip(&mut hits) {
                let hit = self.intersect(ray, &arguments);
                *to = (hit.t_far, hit.u, hit.v, hit.prim);
            }
            std::hint::black_box(&mut hits);
        }
        cpu_seconds() - start
    }

    /// Seconds to ask for any hit of all rays, one at a time.
    pub fn trace_any(&self, prepared: &Prepared) -> f64 {
        let arguments = Self::arguments(prepared.flags);
        let mut occluded = vec![false; WAVE];
        let start = cpu_seconds();
        for wave in prepared.single.chunks(WAVE) {
            for (ray, to) in wave.iter().zip(&mut occluded) {
                let mut ray = *ray;
                // SAFETY: begins as RTCRay, all that is asked for; `RTCOccludedArguments` is laid out like the other.
                unsafe { (self.embree.occluded)(self.scene, &mut ray, &arguments) };
                *to = ray.t_far < 0.0;
            }
            std::hint::black_box(&mut occluded);
        }
        cpu_seconds() - start
    }

    /// Seconds for all rays, scaled up from whole packets of 16.
    pub fn trace_packets(&self, prepared: &Prepared) -> f64 {
        let arguments = Self::arguments(prepared.flags);
        let valid = Aligned([-1; 16]);
        let start = cpu_seconds();
        for packet in &prepared.packets {
            let mut hit = *packet;
            // SAFETY: laid out as RTCRayHit16, aligned to 64 bytes.
            unsafe { (self.embree.intersect16)(valid.0.as_ptr(), self.scene, &mut hit, &arguments) };
            std::hint::black_box((&hit.t_far, &hit.u, &hit.v, &hit.prim));
        }
        (cpu_seconds() - start) * prepared.single.len() as f64 / (16 * prepared.packets.len().max(1)) as f64
    }

    /// Rays for which Embree does not find the same distance within a ten thousandth, and what the `f64` judge, which
    /// tries every triangle, says of either answer to them.
    pub fn differences(&self, prepared: &Prepared, scene: &SceneTree, set: &RaySet) -> String {
        let judge = std::cell::LazyCell::new(|| ReferenceIntersector::of(scene));
        let is_right = |ray: &Ray, hit: Option<Hit>| matches!(judge.check(ray, hit.as_ref()), CheckResult::Right(_));
        let (mut own_wrong, mut their_wrong) = (0, 0);
        let arguments = Self::arguments(prepared.flags);
        let mut rays = prepared.single.iter();
        let mut hits = HitBatch::default();
        let mut differ = 0;
        for wave in &set.waves {
            scene.closest_hits(wave, set.class, &mut hits);
            for (i, ray) in (0..wave.len()).zip(rays.by_ref()) {
                let theirs = self.intersect(ray, &arguments);
                let same = match hits.get(i) {
                    Some(hit) => theirs.geometry != INVALID && (theirs.t_far - hit.t).abs() <= 1e-4 * hit.t.abs(),
                    None => theirs.geometry == INVALID,
                };
                if !same {
                    differ += 1;
                    let found = Hit { t: theirs.t_far, u: theirs.u, v: theirs.v, prim: theirs.prim, object: 0 };
                    let found = (theirs.geometry != INVALID).then_some(found);
                    own_wrong += usize::from(!is_right(&wave.get(i), hits.get(i)));
                    their_wrong += usize::from(!is_right(&wave.get(i), found));
                }
            }
        }
        if differ == 0 { "none".to_owned() } else { format!("{differ} (wrong: {own_wrong} here, {their_wrong} there)") }
    }
}

#[repr(align(64))]
struct Aligned([c_int; 16]);
