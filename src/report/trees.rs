//! Tree report: build time and ray cost of different kd-trees over one mesh.
//!
//! The views are those of the 2013 program's tree test: the model over a reflecting checkered floor under two point
//! lights in the classic light model, at 500 × 500 pixels with one sample each, then four times nearer by a factor of
//! 1.2. Every row has the same images, because the tree affects the time of a query and never its result.
//!
//! If thousands of triangles meet in one point, every ray tests all of them, in any tree. Such views are rendered with
//! fewer pixels ([`LONGEST_VIEW`]) and their means taken over fewer rays ([`MOST_BLOCKS`]).
//!
//! Start reading at [`TreeTable::measure`].

use crate::geometry::{Ray, robust::offset_ray_origin};
use crate::kdtree::{BuildPreset, HitSpace, KdTreeStats, MeshTree, SceneTree, Shape, Visits};
use crate::mesh::Mesh;
use crate::render::{
    Camera, ColorInput, Environment, Film, Geometry, Integrator, Material, Object, Prepared, RayCounts, RenderSettings,
    ScalarInput, Shading, Snapshot, Texture, TexturePattern, advance,
};
use crate::sampling::{Sampler, cosine_hemisphere, uniform_disc};
use glam::{Affine3A, Mat2, Vec2, Vec3};
use std::f32::consts::{PI, TAU};
use std::sync::Arc;
use std::time::Instant;

/// Number of views, and pixels along a side of each.
pub const VIEWS: usize = 5;
pub const SIDE: u32 = 500;

/// Build preset and leaf limit of a tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TreePlan {
    pub preset: BuildPreset,
    /// Triangles; `None` for the preset's own limit.
    pub leaf_limit: Option<usize>,
}

/// Longest time of a view, seconds: a view that would take longer is rendered with fewer pixels, and its time and rays
/// are extrapolated.
pub const LONGEST_VIEW: f64 = 0.5;

/// Limit on the blocks that the rays of one kind test in one tree; means are taken over the rays before that.
pub const MOST_BLOCKS: usize = 1 << 20;

/// Plans of all rows of the table.
pub fn tree_plans() -> Vec<TreePlan> {
    let with = |preset, limits: &'static [Option<usize>]| {
        limits.iter().map(move |&leaf_limit| TreePlan { preset, leaf_limit })
    };
    with(BuildPreset::Median, &[Some(64), Some(32), Some(16), Some(8)])
        .chain(with(BuildPreset::Quick, &[Some(64), Some(32), Some(16), Some(8), None]))
        .chain(with(BuildPreset::Best, &[Some(64), Some(32), Some(16), Some(8), None]))
        .collect()
}

/// Mean visits per ray, for rays of one kind.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MeanVisits {
    pub inner: f64,
    /// Leaves with at least one triangle.
    pub leaves: f64,
    /// Blocks of 16 triangles.
    pub blocks: f64,
}

/// Mean visits per ray, for rays that enter the bounds of the mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CountedVisits {
    /// Unobstructed lines in all directions, to which the expected figures refer.
    pub lines: MeanVisits,
    /// Rays from the camera of view 1 to the first hit.
    pub camera: MeanVisits,
    /// Cosine-distributed rays from these hits into the hemisphere above, to the next hit.
    pub bounce: MeanVisits,
}

/// Results for one tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TreeRow {
    pub plan: TreePlan,
    /// Wall time on the current rayon pool, the minimum of two.
    pub build_seconds: f64,
    /// Wall time of each view, the minimum of two.
    pub view_seconds: [f64; VIEWS],
    pub stats: KdTreeStats,
    pub visits: CountedVisits,
}

impl TreeRow {
    /// Expected visits of an unobstructed line, computed from the areas of the cells.
    pub fn expected(&self) -> MeanVisits {
        let KdTreeStats { expected_inner_visits, expected_leaf_visits, expected_block_tests, .. } = self.stats;
        MeanVisits { inner: expected_inner_visits, leaves: expected_leaf_visits, blocks: expected_block_tests }
    }
}

/// Results for all trees over one mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct TreeTable {
    pub triangles: usize,
    pub threads: usize,
    pub rows: Vec<TreeRow>,
    /// Rays of view 1.
    pub rays: RayCounts,
    /// Seconds in which one thread tests every triangle for one ray.
    pub no_tree_seconds_per_ray: f64,
}

impl TreeTable {
    /// Builds and measures every plan of `plans`, one after the other, on the current rayon pool.
    ///
    /// - `mesh`: with at least one triangle with an area.
    /// - `world_from_mesh`: placement of the mesh; Y is up in the views.
    /// - `before`: called with each plan before it is measured.
    pub fn measure(
        mesh: &Arc<Mesh>,
        world_from_mesh: Affine3A,
        plans: &[TreePlan],
        mut before: impl FnMut(TreePlan),
    ) -> Self {
        let mut table = Self {
            triangles: mesh.triangles.len(),
            threads: rayon::current_num_threads(),
            rows: Vec::new(),
            rays: RayCounts::default(),
            no_tree_seconds_per_ray: 0.0,
        };
        let mut sample_rays = None;
        let mut sharpest = 0;
        for &plan in plans {
            before(plan);
            let build = || match plan.leaf_limit {
                Some(limit) => MeshTree::build_limited(&mesh.positions, &mesh.triangles, plan.preset, limit),
                None => MeshTree::build(&mesh.positions, &mesh.triangles, plan.preset),
            };
            let (tree, build_seconds) = least_seconds(build);
            let tree = Arc::new(tree);
            let stage = ModelScene::new(&tree, mesh, world_from_mesh);
            let mut view_seconds = [0.0; VIEWS];
            for (view, seconds) in view_seconds.iter_mut().enumerate() {
                let prepared = stage.seen_from(view);
                let (side, rays, least) = timed_view(&prepared);
                *seconds = least;
                if view == 0 && side > sharpest {
                    (table.rays, sharpest) = (rays, side);
                }
            }
            // The rays are the same for all trees.
            let rays = sample_rays.get_or_insert_with(|| SampleRays::of(&tree, &stage, world_from_mesh));
            if table.rows.is_empty() {
                table.no_tree_seconds_per_ray = no_tree_seconds(rays);
            }
            let (stats, visits) = (tree.stats(), rays.visits(&tree));
            table.rows.push(TreeRow { plan, build_seconds, view_seconds, stats, visits });
        }
        table
    }

    /// Time of view 1 if every ray tested every triangle, on as many threads as the rest.
    pub fn no_tree_seconds(&self) -> f64 {
        self.no_tree_seconds_per_ray * self.rays.total() as f64 / self.threads as f64
    }
}

/// Returns the result and the minimum wall time of two runs, which is closest to that of an idle machine.
fn least_seconds<T>(mut work: impl FnMut() -> T) -> (T, f64) {
    let mut timed = || {
        let start = Instant::now();
        let result = work();
        (result, start.elapsed().as_secs_f64())
    };
    let (_, first) = timed();
    let (result, second) = timed();
    (result, first.min(second))
}

/// Returns the pixels along a side of the traced image, and the rays and the least seconds of a full image.
fn timed_view(prepared: &Prepared) -> (u32, RayCounts, f64) {
    /// Sides of the full image, of one with a sixteenth of its pixels, and of one for a first estimate of the time.
    const SIDES: [u32; 3] = [SIDE, SIDE / 4, SIDE / 16];
    let whole = |side: u32| f64::from(SIDE * SIDE) / f64::from(side * side);
    let (mut side, mut seconds, mut rays) = (SIDES[2], 0.0, RayCounts::default());
    for next in SIDES.into_iter().rev() {
        if next > side && seconds / whole(next) > LONGEST_VIEW {
            break;
        }
        let (counted, least) = least_seconds(|| picture(prepared, next).1);
        (side, seconds) = (next, least * whole(next));
        let scaled = |count: u64| (count as f64 * whole(next)).round() as u64;
        rays = RayCounts {
            camera: scaled(counted.camera),
            bounce: scaled(counted.bounce),
            shadow: scaled(counted.shadow),
        };
    }
    (side, rays, seconds)
}

/// Renders one sample per pixel in the classic light model.
fn picture(prepared: &Prepared, side: u32) -> (Film, RayCounts) {
    let settings = RenderSettings { integrator: Integrator::Phong, ..RenderSettings::default() };
    let mut film = Film::new(side, side);
    let report = advance(prepared, &settings, &mut film, 1, &|| false);
    (film, report.rays)
}

/// The model, the floor and the lights.
struct ModelScene {
    prepared: Prepared,
    center: Vec3,
    /// Longest side of the model.
    size: f32,
}

const MODEL: u32 = 0;
const FLOOR: u32 = 1;
const LIGHT: u32 = 2;

impl ModelScene {
    fn new(tree: &Arc<MeshTree>, mesh: &Arc<Mesh>, world_from_mesh: Affine3A) -> Self {
        let bounds = SceneTree::build(vec![placed(tree, world_from_mesh)]).bounds();
        let center = 0.5 * (bounds.min + bounds.max);
        let size = bounds.size().max_element().max(f32::MIN_POSITIVE);
        let light = |offset: Vec3| Shape::Sphere { center: center + size * offset, radius: 0.01 * size };
        let floor = Shape::Plane { point: Vec3::new(center.x, bounds.min.y, center.z), normal: Vec3::Y };
        let n_slots = mesh.slots.iter().max().map_or(1, |&last| usize::from(last) + 1);
        let model = Object { mesh: Some(mesh.clone()), ..Object::plain(MODEL) };
        let emitter = Object { is_point_light: true, ..Object::plain(LIGHT) };
        let shapes = vec![
            placed(tree, world_from_mesh),
            floor,
            light(Vec3::new(0.0, 2.0, 2.0)),
            light(Vec3::new(0.0, 1.2, -2.0)),
        ];
        let objects =
            vec![Object { materials: vec![MODEL; n_slots], ..model }, Object::plain(FLOOR), emitter.clone(), emitter];
        let geometry = Geometry::build(shapes, objects);
        // Five squares along the model. At two model sizes the lights give an irradiance of about 3.
        let squares = Texture {
            uv_matrix: Mat2::from_diagonal(Vec2::splat(5.0 / size)),
            ..Texture::new(TexturePattern::Checker { a: Vec3::splat(0.8), b: Vec3::splat(0.02) })
        };
        let radiance = 24.0 / (PI * 0.01 * 0.01);
        let materials = vec![
            phong(ColorInput::Constant(Vec3::new(0.05, 0.6, 0.6)), 0.0),
            phong(ColorInput::Texture(0), 0.4),
            Material::Emissive { radiance: ColorInput::Constant(Vec3::splat(radiance)) },
        ];
        let shading = Shading::new(materials, vec![squares], Environment::Black);
        let prepared = Prepared::new(Snapshot::new(geometry, shading, camera(center, size, 0)));
        Self { prepared, center, size }
    }

    fn seen_from(&self, view: usize) -> Prepared {
        self.prepared.with_camera(camera(self.center, self.size, view))
    }
}

fn placed(tree: &Arc<MeshTree>, world_from_object: Affine3A) -> Shape {
    Shape::Mesh { tree: tree.clone(), world_from_object, space: HitSpace::Object }
}

fn phong(diffuse: ColorInput, specular: f32) -> Material {
    let specular = ScalarInput::Constant(specular);
    Material::Phong {
        diffuse,
        ambient: 0.5,
        specular,
        shininess: 20.0,
        transparency: 0.0,
        ior: 1.5,
        absorption: Vec3::ZERO,
    }
}

/// Camera at two model sizes, with the model over a third of the image; each view is 1.2 times nearer than the one
/// before.
fn camera(center: Vec3, size: f32, view: usize) -> Camera {
    let distance = 2.0 * size / 1.2_f32.powi(view as i32);
    let forward = -Vec3::new(0.35, 0.55, 1.0).normalize();
    Camera::looking_at(center - distance * forward, center, 0.75)
}

/// Three kinds of rays in the space of the mesh.
struct SampleRays {
    scene: SceneTree,
    lines: Vec<Ray>,
    camera: Vec<Ray>,
    bounce: Vec<Ray>,
}

/// Number of samples of each kind; those that miss the bounds are not counted.
const SAMPLES: u32 = 1 << 14;

impl SampleRays {
    fn of(tree: &Arc<MeshTree>, stage: &ModelScene, world_from_mesh: Affine3A) -> Self {
        let scene = SceneTree::build(vec![placed(tree, Affine3A::IDENTITY)]);
        let mesh_from_world = world_from_mesh.inverse();
        let camera: Vec<Ray> = (0..SAMPLES)
            .map(|i| {
                let film = Sampler::new(1, 0, 0, i).pair(0) * SIDE as f32;
                let ray = stage.prepared.camera.ray(film, Vec2::splat(SIDE as f32), Vec2::ZERO);
                let origin = mesh_from_world.transform_point3(ray.origin);
                Ray::new(origin, mesh_from_world.transform_vector3(ray.dir).normalize())
            })
            .collect();
        let mut left = MOST_BLOCKS;
        let bounce = (camera.iter().zip(0..))
            .take_while(|(ray, _)| spend(&mut left, tree.count_visits_through(ray).blocks))
            .filter_map(|(ray, i)| bounce(&scene, ray, i))
            .collect();
        let bounds = tree.bounds();
        let (middle, reach) = (0.5 * (bounds.min + bounds.max), 0.5 * bounds.size().length());
        let lines = (0..SAMPLES).map(|i| line(middle, reach, &Sampler::new(2, 0, 0, i))).collect();
        Self { scene, lines, camera, bounce }
    }

    fn visits(&self, tree: &MeshTree) -> CountedVisits {
        CountedVisits {
            lines: mean_visits(&self.lines, |ray| tree.count_visits_through(ray)),
            camera: mean_visits(&self.camera, |ray| tree.count_visits(ray)),
            bounce: mean_visits(&self.bounce, |ray| tree.count_visits(ray)),
        }
    }
}

/// A uniformly distributed line through a sphere: isotropic directions, uniform positions across them.
fn line(middle: Vec3, radius: f32, sampler: &Sampler) -> Ray {
    let (u, v) = (sampler.pair(0), sampler.pair(1));
    let z = 1.0 - 2.0 * u.x;
    let (sin, cos) = (TAU * u.y).sin_cos();
    let across = (1.0 - z * z).max(0.0).sqrt();
    let dir = Vec3::new(across * cos, across * sin, z).normalize();
    let (right, up) = dir.any_orthonormal_pair();
    let place = uniform_disc(v);
    Ray::new(middle + radius * (place.x * right + place.y * up - 2.0 * dir), dir)
}

fn bounce(scene: &SceneTree, ray: &Ray, number: u32) -> Option<Ray> {
    let hit = scene.closest_hit(ray)?;
    let point = scene.surface_point(ray, &hit);
    let normal = if point.geometric_normal.dot(ray.dir) < 0.0 { 1.0 } else { -1.0 } * point.geometric_normal;
    let local = cosine_hemisphere(Sampler::new(3, 0, 0, number).pair(0));
    let (right, up) = normal.any_orthonormal_pair();
    let dir = (local.x * right + local.y * up + local.z * normal).normalize();
    Some(Ray::new(offset_ray_origin(point.position, point.error, point.geometric_normal, dir), dir))
}

/// Mean over the first of `rays` that test [`MOST_BLOCKS`] blocks, at least one ray.
fn mean_visits(rays: &[Ray], count: impl Fn(&Ray) -> Visits) -> MeanVisits {
    let mut left = MOST_BLOCKS;
    let mut counted: Vec<Visits> = Vec::new();
    for ray in rays {
        let visits = count(ray);
        if visits.inner + visits.leaves > 0 {
            counted.push(visits);
        }
        if !spend(&mut left, visits.blocks) {
            break;
        }
    }
    let mean = |of: fn(&Visits) -> usize| counted.iter().map(of).sum::<usize>() as f64 / counted.len().max(1) as f64;
    MeanVisits { inner: mean(|v| v.inner), leaves: mean(|v| v.leaves), blocks: mean(|v| v.blocks) }
}

/// Takes blocks from the budget; returns whether some is left.
fn spend(left: &mut usize, blocks: usize) -> bool {
    *left = left.saturating_sub(blocks);
    *left > 0
}

/// Tests every triangle for as many camera rays as fit into a fifth of a second, at least four; returns seconds per
/// ray.
fn no_tree_seconds(rays: &SampleRays) -> f64 {
    let start = Instant::now();
    let mut tried = 0;
    for ray in &rays.camera {
        std::hint::black_box(rays.scene.closest_hit_naive(ray));
        tried += 1;
        if tried >= 4 && start.elapsed().as_secs_f64() > 0.2 {
            break;
        }
    }
    start.elapsed().as_secs_f64() / f64::from(tried)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::procedural::{DisplacedSphere, displaced_sphere};
    use glam::DVec3;

    fn stone() -> Arc<Mesh> {
        Arc::new(displaced_sphere(&DisplacedSphere { frequency: 24, ..DisplacedSphere::default() }))
    }

    #[test]
    fn all_trees_show_the_same_pictures() {
        let mesh = stone();
        let turned = Affine3A::from_rotation_x(0.4);
        let shown = |plan: TreePlan| {
            let limit = plan.leaf_limit.unwrap_or(1);
            let tree = MeshTree::build_limited(&mesh.positions, &mesh.triangles, plan.preset, limit);
            picture(&ModelScene::new(&Arc::new(tree), &mesh, turned).seen_from(2), SIDE).0.means()
        };
        let plans = tree_plans();
        let first = shown(plans[0]);
        assert!(first.iter().any(|light| light.y > 0.1) && first.iter().any(|light| light.y == 0.0));
        for &plan in &plans[1..] {
            assert!(shown(plan) == first, "{plan:?}");
        }
    }

    #[test]
    fn dear_rays_are_counted_until_the_blocks_are_spent() {
        let rays = vec![Ray::new(Vec3::ZERO, Vec3::X); SAMPLES as usize];
        for (blocks, most) in [(10, rays.len()), (1000, MOST_BLOCKS / 1000 + 1), (2 * MOST_BLOCKS, 1)] {
            let calls = std::cell::Cell::new(0);
            let mean = mean_visits(&rays, |_| {
                calls.set(calls.get() + 1);
                Visits { inner: 3, leaves: 1, blocks }
            });
            assert_eq!(calls.get(), most);
            assert_eq!(mean, MeanVisits { inner: 3.0, leaves: 1.0, blocks: blocks as f64 });
        }
    }

    /// Every ray through the centre tests thousands of blocks, so no machine renders such a view in full in time.
    #[test]
    fn a_view_that_takes_too_long_is_shown_in_fewer_pixels() {
        let n = 400_000_u32;
        let rim = (0..n)
            .map(|i| (TAU * i as f32 / n as f32).sin_cos())
            .map(|(sin, cos)| DVec3::new(cos.into(), sin.into(), 0.0));
        let points: Vec<DVec3> = std::iter::once(DVec3::ZERO).chain(rim).collect();
        let mesh = Mesh::from_f64(&points, (0..n).map(|i| [0, 1 + i, 1 + (i + 1) % n]).collect()).unwrap();
        let tree = MeshTree::build_limited(&mesh.positions, &mesh.triangles, BuildPreset::Median, 64);
        let stage = ModelScene::new(&Arc::new(tree), &Arc::new(mesh), Affine3A::IDENTITY);
        let (side, rays, seconds) = timed_view(&stage.seen_from(0));
        assert!(side < SIDE && seconds > LONGEST_VIEW, "{side}: {seconds} s");
        // About as many rays as in a full image.
        let of_eye = f64::from(SIDE * SIDE);
        assert!((rays.camera as f64 / of_eye - 1.0).abs() < 0.01, "{rays:?}");
    }

    #[test]
    fn the_expected_visits_are_those_of_lines_that_nothing_stops() {
        let mesh = stone();
        let plans = [BuildPreset::Median, BuildPreset::Best].map(|preset| TreePlan { preset, leaf_limit: Some(32) });
        let table = TreeTable::measure(&mesh, Affine3A::IDENTITY, &plans, |_| ());
        let [median, best] = table.rows[..] else { panic!("a row a plan") };
        for row in [median, best] {
            let (expected, counted) = (row.expected(), row.visits.lines);
            for (expected, counted) in
                [(expected.inner, counted.inner), (expected.leaves, counted.leaves), (expected.blocks, counted.blocks)]
            {
                assert!((counted / expected - 1.0).abs() < 0.03, "{counted} for {expected}");
            }
            // A ray that hits something visits less.
            assert!(row.visits.camera.leaves < counted.leaves && row.visits.camera.leaves >= 1.0);
            assert!(row.stats.references >= mesh.triangles.len() && row.stats.bytes > 0);
        }
        assert!(best.stats.sah_cost() < median.stats.sah_cost());
        assert_eq!(table.rays.camera, u64::from(SIDE * SIDE));
        assert!(table.no_tree_seconds() > 0.0);
    }
}
