//! Every tree, every preset and every traversal against trying all primitives: the same bits.

use crate::random::Random;
use firstlight::geometry::{Ray, robust::offset_ray_origin};
use firstlight::kdtree::{
    BuildPreset, Hit, HitBatch, HitSpace, InstructionSet, MeshTree, RayBatch, RayClass, SceneTree, Shape, SphereTree,
    StaticTree,
};
use glam::{Affine3A, EulerRot, Quat, Vec3, vec3};
use std::sync::Arc;

const PRESETS: [BuildPreset; 3] = [BuildPreset::Quick, BuildPreset::Best, BuildPreset::Median];

impl Random {
    fn point(&mut self) -> Vec3 {
        vec3(self.signed(), self.signed(), self.signed())
    }

    fn unit(&mut self) -> Vec3 {
        loop {
            let p = self.point();
            if p.length() > 0.1 && p.length() < 1.0 {
                return p.normalize();
            }
        }
    }
}

#[derive(Default)]
struct Soup {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

impl Soup {
    fn push(&mut self, vertices: [Vec3; 3]) {
        let first = self.positions.len() as u32;
        self.positions.extend(vertices);
        self.triangles.push([first, first + 1, first + 2]);
    }

    fn tree(&self, preset: BuildPreset) -> Arc<MeshTree> {
        let tree = MeshTree::build(&self.positions, &self.triangles, preset);
        tree.check_invariants();
        Arc::new(tree)
    }

    fn scaled(mut self, scale: f32, offset: Vec3) -> Self {
        self.positions.iter_mut().for_each(|p| *p = *p * scale + offset);
        self
    }
}

/// Ordinary triangles, needles, repeated ones, some in axis planes (where splits lie), some without area.
fn triangle_soup(seed: u64, n: usize) -> Soup {
    let mut random = Random(seed);
    let mut soup = Soup::default();
    for i in 0..n {
        let (a, size) = (random.point(), 0.3 * random.signed().abs().powi(3));
        match i % 8 {
            0 => soup.push([a, a + random.unit(), a + random.unit() * 1e-5]),
            1 => {
                let along = random.unit();
                soup.push([a, a + along, a + along * 2.0 + random.unit() * 1e-6]);
            }
            2 if i > 8 => {
                let [p, q, r] = soup.triangles[random.below(soup.triangles.len())].map(|v| soup.positions[v as usize]);
                soup.push(if random.below(2) == 0 { [p, q, r] } else { [r, p, q] });
            }
            3 => {
                let axis = random.below(3);
                let level = (a[axis] * 4.0).round() / 4.0;
                let mut flat = [a, a + random.point() * size, a + random.point() * size];
                flat.iter_mut().for_each(|p| p[axis] = level);
                soup.push(flat);
            }
            4 if i % 3 == 0 => soup.push([a, a, random.point()]),
            _ => soup.push([a, a + random.point() * size, a + random.point() * size]),
        }
    }
    soup
}

/// A wavy sheet with shared vertices on a grid.
fn sheet(n: u32) -> Soup {
    let mut soup = Soup::default();
    for i in 0..=n {
        for j in 0..=n {
            let (x, z) = (i as f32 / n as f32 * 2.0 - 1.0, j as f32 / n as f32 * 2.0 - 1.0);
            soup.positions.push(vec3(x, 0.2 * (5.0 * x).sin() * (4.0 * z).cos(), z));
        }
    }
    for i in 0..n {
        for j in 0..n {
            let a = i * (n + 1) + j;
            soup.triangles.extend([[a, a + 1, a + n + 1], [a + 1, a + n + 2, a + n + 1]]);
        }
    }
    soup
}

/// A cube whose sides are grids of squares: walls that lie in the faces of the tree's bounds.
fn tiled_cube(n: u32) -> Soup {
    let mut soup = Soup::default();
    for (axis, side) in (0..3).flat_map(|axis| [(axis, -1.0), (axis, 1.0)]) {
        let first = soup.positions.len() as u32;
        for (i, j) in (0..=n).flat_map(|i| (0..=n).map(move |j| (i, j))) {
            let mut point = Vec3::splat(side);
            point[(axis + 1) % 3] = i as f32 / n as f32 * 2.0 - 1.0;
            point[(axis + 2) % 3] = j as f32 / n as f32 * 2.0 - 1.0;
            soup.positions.push(point);
        }
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let a = first + i * (n + 1) + j;
            soup.triangles.extend([[a, a + 1, a + n + 1], [a + 1, a + n + 2, a + n + 1]]);
        }
    }
    soup
}

/// Rays that start on surfaces and on split planes, run along axes and edges, with zeros of both signs.
fn awkward_rays(seed: u64, soup: &Soup, n: usize) -> Vec<Ray> {
    let mut random = Random(seed ^ 0xABCD);
    let pick = |random: &mut Random| soup.positions[random.below(soup.positions.len())];
    let size = soup.positions.iter().fold(0.0f32, |size, p| size.max((*p - soup.positions[0]).length()));
    let axes = [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z, vec3(-0.0, 1.0, 0.0), vec3(-0.0, -0.0, -1.0)];
    (0..n)
        .map(|i| {
            let (p, q) = (pick(&mut random), pick(&mut random));
            let far = p + random.unit() * size * 1.5;
            let mut ray = match i % 8 {
                0 => Ray::new(p, q - p),
                1 => Ray::new(p, random.unit()),
                2 => Ray::new(far, p - far),
                3 => Ray::new(far, p.lerp(q, 0.3) - far),
                4 => Ray::new(p - axes[i / 8 % 8] * size, axes[i / 8 % 8]),
                5 => Ray::new(p, axes[i / 8 % 8]),
                6 => Ray::new(p.lerp(q, 0.5), random.unit() * 1e-3),
                _ => Ray::new(far * 30.0, (q - far * 30.0) * 1e3),
            };
            if ray.dir == Vec3::ZERO {
                ray.dir = axes[i % 8];
            }
            if random.below(4) == 0 {
                ray.t_max = random.signed().abs() * size / ray.dir.length();
            }
            ray
        })
        .collect()
}

fn bits(hit: Option<Hit>) -> Option<[u32; 5]> {
    hit.map(|hit| [hit.t.to_bits(), hit.u.to_bits(), hit.v.to_bits(), hit.prim, hit.object])
}

/// All ways to ask must give the naive answer, bit for bit.
fn assert_agrees(scene: &SceneTree, rays: &[Ray], what: &str) {
    let expected: Vec<_> = rays.iter().map(|ray| bits(scene.closest_hit_naive(ray))).collect();
    for (ray, expected) in rays.iter().zip(&expected) {
        assert_eq!(bits(scene.closest_hit(ray)), *expected, "{what}, {ray:?}");
        assert_eq!(scene.any_hit(ray), expected.is_some(), "any, {what}, {ray:?}");
    }
    let batch: RayBatch = rays.iter().collect();
    let (mut hits, mut occluded) = (HitBatch::default(), Vec::new());
    let classes = [RayClass::Coherent, RayClass::Incoherent];
    for (class, set) in
        classes.into_iter().flat_map(|class| InstructionSet::available().into_iter().map(move |set| (class, set)))
    {
        scene.closest_hits_with(set, &batch, class, &mut hits);
        scene.any_hits_with(set, &batch, class, &mut occluded);
        assert!(hits.len() == rays.len() && occluded.len() == rays.len());
        for (i, expected) in expected.iter().enumerate() {
            assert_eq!(bits(hits.get(i)), *expected, "{what}, {class:?} {set:?} {i}, {:?}", rays[i]);
            assert_eq!(occluded[i], expected.is_some(), "any, {what}, {class:?} {set:?} {i}, {:?}", rays[i]);
        }
    }
}

fn mesh(tree: &Arc<MeshTree>, world_from_object: Affine3A) -> Shape {
    Shape::Mesh { tree: tree.clone(), world_from_object, space: HitSpace::Object }
}

#[test]
fn soups_agree_with_trying_every_triangle() {
    for seed in 0..12 {
        let soup = triangle_soup(seed, [3, 40, 300, 1000][seed as usize % 4]);
        for preset in PRESETS {
            let scene = SceneTree::build(vec![mesh(&soup.tree(preset), Affine3A::IDENTITY)]);
            assert_agrees(&scene, &awkward_rays(seed, &soup, 800), &format!("soup {seed} {preset:?}"));
        }
    }
}

#[test]
fn soups_of_all_sizes_and_far_from_the_origin_agree() {
    let cases =
        [(1e-6, Vec3::ZERO), (1e6, Vec3::ZERO), (1.0, vec3(1e4, -3e4, 7e3)), (1e-12, Vec3::ZERO), (1e9, Vec3::ONE)];
    for (seed, (scale, offset)) in (100..).zip(cases) {
        let soup = triangle_soup(seed, 400).scaled(scale, offset);
        for preset in PRESETS {
            let scene = SceneTree::build(vec![mesh(&soup.tree(preset), Affine3A::IDENTITY)]);
            assert_agrees(&scene, &awkward_rays(seed, &soup, 1000), &format!("scale {scale} at {offset} {preset:?}"));
        }
    }
}

#[test]
fn degenerate_meshes_build_in_bounds_and_agree() {
    let mut random = Random(9);
    let mut fan = Soup::default();
    (0..2000).for_each(|_| fan.push([vec3(0.1, 0.2, 0.3), random.point(), random.point()]));
    let mut coplanar = Soup::default();
    for _ in 0..2000 {
        let p = random.point();
        coplanar.push([p, p + random.point() * 0.2, p + random.point() * 0.2]);
    }
    coplanar.positions.iter_mut().for_each(|p| p.y = 0.25);
    let mut identical = Soup::default();
    (0..2000).for_each(|_| identical.push([Vec3::ZERO, Vec3::X, vec3(0.3, 1.0, 0.5)]));
    let mut huge = Soup::default();
    huge.push([vec3(-1e5, -1.0, -1e5), vec3(1e5, 1.0, -1e5), vec3(0.0, 0.0, 1e5)]);
    for _ in 0..2000 {
        let p = random.point();
        huge.push([p, p + random.point() * 0.02, p + random.point() * 0.02]);
    }
    let mut no_area = Soup::default();
    (0..500).for_each(|_| {
        let p = random.point();
        no_area.push([p, p + Vec3::X, p + 2.0 * Vec3::X]);
    });
    let point = Soup { positions: vec![Vec3::ONE], triangles: vec![[0; 3]; 300] };
    let cases = [
        ("fan", fan),
        ("coplanar", coplanar),
        ("identical", identical),
        ("huge", huge),
        ("flat", no_area),
        ("point", point),
    ];
    for (name, soup) in cases {
        for preset in PRESETS {
            let tree = soup.tree(preset);
            let stats = tree.stats();
            assert!(stats.references <= 10 * soup.triangles.len() + 100, "{name} {preset:?}: {stats:?}");
            let scene = SceneTree::build(vec![mesh(&tree, Affine3A::IDENTITY)]);
            assert_agrees(&scene, &awkward_rays(3, &soup, 400), &format!("{name} {preset:?}"));
        }
    }
    let empty = Arc::new(MeshTree::build(&[], &[], BuildPreset::Best));
    let scene = SceneTree::build(vec![mesh(&empty, Affine3A::IDENTITY)]);
    assert_eq!(scene.closest_hit(&Ray::new(Vec3::ZERO, Vec3::X)), None);
    assert_eq!(SceneTree::build(vec![]).closest_hit(&Ray::new(Vec3::ZERO, Vec3::X)), None);
}

/// Copies lie in every leaf of one another, and no split parts them: only the first of each can be hit.
#[test]
fn copies_are_tested_once_and_hit_as_if_all_were_there() {
    let mut random = Random(21);
    let mut soup = triangle_soup(5, 300);
    let corners = [vec3(-0.5, 0.1, -0.4), vec3(0.7, 0.3, -0.2), vec3(0.1, -0.6, 0.5)];
    for i in 0..6000 {
        let mut turned = corners;
        turned.rotate_left(i % 3);
        if i % 2 == 1 {
            turned.swap(0, 1);
        }
        soup.push(turned);
        if i % 100 == 0 {
            let p = random.point();
            soup.push([p, p + random.point() * 0.2, p + random.point() * 0.2]);
        }
    }
    for preset in PRESETS {
        let tree = soup.tree(preset);
        tree.check_invariants();
        let rays = awkward_rays(8, &soup, 400);
        let blocks: usize = rays.iter().map(|ray| tree.count_visits(ray).blocks).sum();
        // Of 375 blocks of copies none is looked at.
        assert!(blocks < 100 * rays.len(), "{preset:?}: {blocks} blocks for {} rays", rays.len());
        let scene = SceneTree::build(vec![mesh(&tree, Affine3A::IDENTITY)]);
        assert_agrees(&scene, &rays, &format!("{preset:?}"));
    }
    let centers: Vec<Vec3> = (0..3000).map(|i| vec3((i % 3) as f32, 0.0, 0.5)).collect();
    let balls = Arc::new(SphereTree::build(&centers, &vec![0.4; centers.len()]));
    let scene = SceneTree::build(vec![Shape::Spheres { tree: balls, world_from_object: Affine3A::IDENTITY }]);
    assert_agrees(&scene, &awkward_rays(9, &soup, 400), "balls");
}

#[test]
fn no_ray_leaves_a_closed_mesh() {
    // A sphere of triangles around the origin, subdivided from an octahedron: seams on the axes, where splits lie.
    let mut faces: Vec<[Vec3; 3]> = (0..8)
        .map(|i| {
            let s = |bit: usize| if i >> bit & 1 == 0 { 1.0 } else { -1.0 };
            [Vec3::X * s(0), Vec3::Y * s(1), Vec3::Z * s(2)]
        })
        .collect();
    for _ in 0..5 {
        faces = faces
            .iter()
            .flat_map(|&[a, b, c]| {
                let [p, q, r] = [(a + b).normalize(), (b + c).normalize(), (c + a).normalize()];
                [[a, p, r], [p, b, q], [r, q, c], [p, q, r]]
            })
            .collect();
    }
    for (scale, offset) in [(1.0, Vec3::ZERO), (1e-5, Vec3::ZERO), (1e5, Vec3::ZERO), (1.0, vec3(1e5, 0.0, -1e4))] {
        let mut soup = Soup::default();
        faces.iter().for_each(|&face| soup.push(face));
        let soup = soup.scaled(scale, offset);
        for preset in PRESETS {
            let scene = SceneTree::build(vec![mesh(&soup.tree(preset), Affine3A::IDENTITY)]);
            let mut random = Random(5);
            for _ in 0..8_000 {
                let origin = random.point() * (0.5 * scale) + offset;
                let (p, q) = (random.below(soup.positions.len()), random.below(3));
                let along = (random.signed() + 1.0) * 0.5;
                let other = soup.positions[p / 3 * 3 + q];
                let ray = Ray::new(origin, soup.positions[p].lerp(other, along) - origin);
                assert!(scene.closest_hit(&ray).is_some(), "leak: scale {scale}, {offset}, {preset:?}, {ray:?}");
            }
        }
    }
}

fn placements(random: &mut Random, n: usize, spread: f32, even: bool) -> Vec<Affine3A> {
    (0..n)
        .map(|_| {
            let turn =
                Quat::from_euler(EulerRot::XYZ, random.signed() * 3.0, random.signed() * 3.0, random.signed() * 3.0);
            let scale = if even { Vec3::splat(0.3) } else { vec3(0.3, 0.1 + 0.2 * random.signed().abs(), -0.4) };
            Affine3A::from_scale_rotation_translation(scale, turn, random.point() * spread)
        })
        .collect()
}

/// Both spaces in turn.
fn space_of(i: usize) -> HitSpace {
    if i.is_multiple_of(2) { HitSpace::World } else { HitSpace::Object }
}

/// Every kind of shape, several of each, with ties: repeated objects and quads that share a plane.
fn mixed_scene(seed: u64, n: usize, preset: BuildPreset) -> (SceneTree, Soup) {
    let mut random = Random(seed);
    let sheet = sheet(12);
    let tree = sheet.tree(preset);
    let soup_tree = triangle_soup(seed, 200).tree(preset);
    let centers: Vec<Vec3> = (0..300).map(|_| random.point()).collect();
    let radii: Vec<f32> = (0..300).map(|_| 0.01 + 0.1 * random.signed().abs()).collect();
    let balls = Arc::new(SphereTree::build(&centers, &radii));
    // So few that packets test them one by one, the last at the place of the first.
    let few: Vec<Vec3> = centers[..7].iter().chain([&centers[0]]).copied().collect();
    let few_balls = Arc::new(SphereTree::build(&few, &[0.3, 0.1, 0.2, 0.15, 0.25, 0.05, 0.1, 0.3]));
    let mut shapes = vec![Shape::Plane { point: vec3(0.0, -1.0, 0.0), normal: Vec3::Y }];
    let placed = placements(&mut random, n, 1.0, false);
    let placed_balls = placements(&mut random, n, 1.0, true);
    for i in 0..n {
        let (p, q, r) = (random.point(), random.point() * 0.5, random.point() * 0.5);
        shapes.push(match i % 7 {
            0 => Shape::Quad { corner: p, edge_u: q, edge_v: r },
            1 => Shape::Sphere { center: p, radius: 0.05 + 0.3 * random.signed().abs() },
            2 => Shape::Triangle { vertices: [p, p + q, p + r] },
            3 => Shape::Mesh { tree: tree.clone(), world_from_object: placed[i], space: space_of(i / 7) },
            4 => {
                let tree = if i / 7 % 2 == 0 { &balls } else { &few_balls };
                Shape::Spheres { tree: tree.clone(), world_from_object: placed_balls[i] }
            }
            5 => Shape::Mesh { tree: soup_tree.clone(), world_from_object: placed[i], space: space_of(i / 14) },
            _ => shapes[random.below(shapes.len())].clone(),
        });
    }
    shapes.push(Shape::Plane { point: vec3(2.0, 0.0, 0.0), normal: vec3(0.6, 0.8, 0.0) });
    (SceneTree::build(shapes), sheet)
}

#[test]
fn scenes_of_all_shapes_agree() {
    for (seed, n) in [(1, 3), (2, 7), (3, 14), (4, 40), (5, 150), (6, 400)] {
        for preset in PRESETS {
            let (scene, sheet) = mixed_scene(seed, n, preset);
            assert_agrees(&scene, &awkward_rays(seed, &sheet, 1500), &format!("scene {seed} of {n}, {preset:?}"));
        }
    }
}

/// Shapes of the world that share trees, as they are found after edits: some moved, removed, added or in another order.
#[test]
fn trees_that_outlive_edits_give_the_hits_of_new_ones() {
    let static_mesh = |tree: &Arc<MeshTree>, world_from_object| Shape::Mesh {
        tree: tree.clone(),
        world_from_object,
        space: HitSpace::World,
    };
    // The last two have so few triangles that no tree is traversed, some by the edits alone.
    for (seed, n, size) in [(1, 2, 10), (2, 5, 10), (3, 30, 10), (4, 80, 10), (5, 8, 3), (6, 4, 5)] {
        let mut random = Random(seed);
        let (sheet, soup) = (sheet(size as u32), triangle_soup(seed, 6 * size));
        let mut placed = placements(&mut random, n, 0.5, false);
        // Copies in one place tie everywhere.
        placed.extend_from_within(..n / 2);
        let trees: Vec<Arc<MeshTree>> =
            (0..placed.len()).map(|i| [&sheet, &soup][i % 2].tree(PRESETS[i % PRESETS.len()])).collect();
        let old: Vec<Shape> = placed.iter().zip(&trees).map(|(map, tree)| static_mesh(tree, *map)).collect();
        let statics: Vec<_> = StaticTree::build(&old, BuildPreset::Quick).into_iter().map(Arc::new).collect();
        let rays = awkward_rays(seed, &sheet, 600);
        let moved = Affine3A::from_translation(vec3(0.3, -0.1, 0.2));
        let mut fewer = old.clone();
        fewer.remove(n / 2);
        fewer.remove(0);
        let mut edited = fewer.clone();
        edited[n / 4] = static_mesh(&trees[n / 4], moved * placed[n / 4]);
        edited.insert(1, Shape::Sphere { center: Vec3::ZERO, radius: 0.2 });
        edited.push(mesh(&sheet.tree(BuildPreset::Best), moved));
        edited.push(static_mesh(&sheet.tree(BuildPreset::Best), placed[0]));
        let mut turned = old.clone();
        turned.reverse();
        for (what, shapes) in [("same", old), ("fewer", fewer), ("edited", edited), ("turned", turned)] {
            let what = format!("{what} {seed}");
            let scene = SceneTree::build_with(shapes.clone(), &statics);
            assert_agrees(&scene, &rays, &what);
            let new = SceneTree::build(shapes);
            for ray in &rays {
                assert_eq!(bits(scene.closest_hit(ray)), bits(new.closest_hit(ray)), "{what} {ray:?}");
            }
        }
    }
}

/// Meshes of very different sizes do not share a tree, and hits do not tell.
#[test]
fn a_ground_of_kilometres_leaves_the_tree_of_a_small_mesh_alone() {
    let small = sheet(10).tree(BuildPreset::Best);
    let ground = sheet(2).tree(BuildPreset::Best);
    let place = |tree: &Arc<MeshTree>, size: f32| Shape::Mesh {
        tree: tree.clone(),
        world_from_object: Affine3A::from_scale(Vec3::splat(size)),
        space: HitSpace::World,
    };
    let shapes = vec![place(&ground, 1e4), place(&small, 1.0), place(&small, 1.5), place(&small, 0.1)];
    let statics = StaticTree::build(&shapes, BuildPreset::Best);
    assert_eq!(statics.iter().map(StaticTree::n_members).collect::<Vec<_>>(), [3, 1]);
    assert_agrees(&SceneTree::build(shapes), &awkward_rays(4, &sheet(10), 1500), "sizes");
}

#[test]
fn piles_of_instances_agree() {
    // More in one place than a leaf block holds, some of them twice, with needles whose bounds are loose.
    for (seed, n, spread) in [(1, 100, 0.0), (2, 60, 0.02), (3, 300, 0.3)] {
        let mut random = Random(seed);
        let (sheet, soup) = (sheet(6), triangle_soup(seed, 30));
        let trees = [sheet.tree(BuildPreset::Best), soup.tree(BuildPreset::Best)];
        let mut placed = placements(&mut random, n, spread, false);
        placed.extend_from_within(..n / 3);
        let shapes = placed.iter().enumerate().map(|(i, place)| mesh(&trees[i % 2], *place)).collect();
        let scene = SceneTree::build(shapes);
        assert_agrees(&scene, &awkward_rays(seed, &sheet, 1500), &format!("pile {seed}"));
    }
}

/// A room with boxes in it, turned and upright, whose walls meet at shared corners; some quads twice, some needles, one
/// without area. All corners are returned too, for rays to aim at.
fn room(seed: u64, n: usize, scale: f32, offset: Vec3) -> (SceneTree, Soup) {
    let mut random = Random(seed);
    let mut quads: Vec<[Vec3; 3]> = Vec::new();
    let mut size = 1.0;
    while quads.len() < n {
        let turn = if quads.is_empty() { Quat::IDENTITY } else { Quat::from_rotation_y(random.signed() * 3.0) };
        let [x, y, z] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| turn * axis * (2.0 * size));
        let o = if quads.is_empty() { Vec3::ZERO } else { random.point() * 0.6 } - 0.5 * (x + y + z);
        quads.extend([[o, x, y], [o + z, x, y], [o, y, z], [o + x, y, z], [o, z, x], [o + y, z, x]]);
        quads.push(match quads.len() / 7 % 3 {
            0 => quads[random.below(quads.len())],
            1 => [o, x * 1e-7, y],
            _ => [o, x, x],
        });
        size = 0.2 + 0.2 * random.signed().abs();
    }
    quads.truncate(n);
    let mut corners = Soup::default();
    let shapes = quads.iter().map(|quad| {
        let [corner, edge_u, edge_v] = [quad[0] * scale + offset, quad[1] * scale, quad[2] * scale];
        corners.positions.extend([corner, corner + edge_u, corner + edge_v, corner + 0.3 * edge_u + 0.6 * edge_v]);
        Shape::Quad { corner, edge_u, edge_v }
    });
    (SceneTree::build(shapes.collect()), corners)
}

#[test]
fn rooms_of_quads_agree() {
    let places = [(1.0, Vec3::ZERO), (1e-4, vec3(0.3, -0.2, 0.1)), (3e3, vec3(1e4, -2e4, 5e3)), (1e-12, Vec3::ZERO)];
    for (seed, n) in [(1, 5), (2, 6), (3, 16), (4, 17), (5, 32), (6, 33), (7, 48), (8, 49)] {
        for (scale, offset) in places {
            let (scene, corners) = room(seed, n, scale, offset);
            let what = format!("room {seed} of {n}, {scale} at {offset}");
            assert_agrees(&scene, &awkward_rays(seed, &corners, 4000), &what);
        }
    }
}

/// The shapes that a ray leaves, at one scale and place.
fn surfaces(scale: f32, offset: Vec3) -> Vec<(&'static str, Shape)> {
    let (a, b, c) = (vec3(-0.7, -0.2, 0.3), vec3(0.9, 0.1, -0.4), vec3(0.2, 0.8, 0.5));
    let at = |p: Vec3| p * scale + offset;
    let turned = Affine3A::from_scale_rotation_translation(
        vec3(2.0, 0.5, 1.0),
        Quat::from_euler(EulerRot::XYZ, 0.3, 1.0, -0.5),
        offset,
    ) * Affine3A::from_scale(Vec3::splat(scale));
    let even = Affine3A::from_scale_rotation_translation(Vec3::splat(scale), Quat::from_rotation_y(0.7), offset);
    let centered = sheet(20).tree(BuildPreset::Best);
    let placed = sheet(20).scaled(scale, offset).tree(BuildPreset::Best);
    let balls = SphereTree::build(&[a, b, c], &[0.5, 0.25, 0.125]);
    vec![
        ("sphere", Shape::Sphere { center: at(a), radius: 0.7 * scale }),
        ("plane", Shape::Plane { point: at(b), normal: vec3(0.36, 0.48, -0.8) }),
        ("quad", Shape::Quad { corner: at(a), edge_u: (b - a) * scale, edge_v: (c - a) * scale }),
        ("floor", Shape::Quad { corner: at(a), edge_u: Vec3::Z * scale, edge_v: Vec3::X * scale }),
        ("triangle", Shape::Triangle { vertices: [at(a), at(b), at(c)] }),
        ("mesh", mesh(&placed, Affine3A::IDENTITY)),
        ("instance", mesh(&centered, turned)),
        ("static", Shape::Mesh { tree: centered, world_from_object: turned, space: HitSpace::World }),
        ("balls", Shape::Spheres { tree: Arc::new(balls), world_from_object: even }),
    ]
}

#[test]
fn a_ray_that_leaves_a_surface_does_not_meet_it_again() {
    let scales = [1e-6f32, 1e-3, 1.0, 1e3, 1e6];
    let offsets = [0.0f32, 1.0, 1e3, 1e6];
    for (scale, far) in scales.into_iter().flat_map(|s| offsets.map(|o| (s, o * s))) {
        let offset = vec3(far, -0.7 * far, 0.3 * far);
        for (name, shape) in surfaces(scale, offset) {
            let scene = SceneTree::build(vec![shape]);
            let mut random = Random(77);
            let mut n_hits = 0;
            for i in 0..2000 {
                let target = random.point() * (0.8 * scale) + offset;
                let origin = target + random.unit() * (scale * 10f32.powf(random.signed() * 2.0));
                let ray = Ray::new(origin, (target - origin).normalize_or(Vec3::X));
                let Some(hit) = scene.closest_hit(&ray) else { continue };
                n_hits += 1;
                let point = scene.surface_point(&ray, &hit);
                assert!((point.geometric_normal.length() - 1.0).abs() < 1e-5);
                // Any direction, half of them within a thousandth to a millionth of the tangent plane.
                let mut dir = random.unit();
                if i % 2 == 0 {
                    let along = dir.cross(point.geometric_normal).normalize_or(dir);
                    dir = (along + point.geometric_normal * 10f32.powf(-4.5 + 1.5 * random.signed())).normalize();
                }
                let next = Ray::new(offset_ray_origin(point.position, point.error, point.geometric_normal, dir), dir);
                let Some(again) = scene.closest_hit(&next) else { continue };
                // A curved surface may be met again, but elsewhere and not from behind the tangent plane.
                let same = (again.prim == hit.prim) as u32;
                let flat = !matches!(name, "sphere" | "balls");
                let inside = dir.dot(point.geometric_normal) < 0.0;
                assert!(
                    same == 0 || (!flat && inside),
                    "{name} at scale {scale}, offset {far}: {ray:?} {hit:?} {point:?}, then {next:?} {again:?}"
                );
            }
            // Far away in units of its own size, f32 cannot aim at a shape any more.
            assert!(n_hits > 100 || far / scale > 1e3, "{name} at scale {scale}, offset {far}: only {n_hits} hits");
        }
    }
}

#[test]
fn error_of_a_surface_point_is_a_bound() {
    for (scale, far) in [(1.0, 0.0), (1e-3, 1.0), (1e3, 1e4)] {
        let offset = vec3(far, -0.7 * far, 0.3 * far);
        for (name, shape) in surfaces(scale, offset) {
            let scene = SceneTree::build(vec![shape.clone()]);
            let mut random = Random(78);
            for _ in 0..2000 {
                let target = random.point() * (0.8 * scale) + offset;
                let origin = target + random.unit() * scale;
                let ray = Ray::new(origin, target - origin);
                let Some(hit) = scene.closest_hit(&ray) else { continue };
                let point = scene.surface_point(&ray, &hit);
                // Distance from the surface, in f64, from the definition of the shape.
                let p = point.position.as_dvec3();
                let n = point.geometric_normal.as_dvec3();
                let distance = match &shape {
                    Shape::Sphere { center, radius } => (p - center.as_dvec3()).length() - f64::from(*radius),
                    Shape::Plane { point, normal } => (p - point.as_dvec3()).dot(normal.as_dvec3()),
                    Shape::Quad { corner, .. } => (p - corner.as_dvec3()).dot(n),
                    Shape::Triangle { vertices } => (p - vertices[0].as_dvec3()).dot(n),
                    Shape::Mesh { tree, world_from_object, .. } => {
                        let corner = tree.vertices(hit.prim)[0].as_dvec3();
                        let map = world_from_object;
                        (p - (map.matrix3.as_dmat3() * corner + map.translation.as_dvec3())).dot(n)
                    }
                    Shape::Spheres { tree, world_from_object: map } => {
                        let (center, radius) = tree.sphere(hit.prim);
                        let center = map.matrix3.as_dmat3() * center.as_dvec3() + map.translation.as_dvec3();
                        (p - center).length() - f64::from(radius) * map.matrix3.as_dmat3().x_axis.length()
                    }
                };
                let bound = f64::from(point.geometric_normal.abs().dot(point.error));
                assert!(distance.abs() <= bound, "{name} at {scale}, {far}: {distance} > {bound}, {hit:?}");
                let on_ray = (ray.at(hit.t) - point.position).length();
                // Points are kept clear of the rim of their triangle by a few times their error.
                assert!(on_ray <= 1e-3 * scale + 4e-4 * far, "{name}: {on_ray} off the ray");
            }
        }
    }
}

#[test]
fn batches_of_any_length_are_answered_in_full() {
    let (scene, sheet) = mixed_scene(6, 12, BuildPreset::Best);
    let rays = awkward_rays(6, &sheet, 2100);
    for n in [0, 1, 15, 16, 17, 47, 2047, 2048, 2100] {
        assert_agrees(&scene, &rays[..n], &format!("{n} rays"));
    }
}

#[test]
fn counted_visits_match_the_tree() {
    let tree = sheet(60).tree(BuildPreset::Best);
    let stats = tree.stats();
    // A ray that meets nothing and one that goes through the middle.
    let away = tree.count_visits(&Ray::new(vec3(0.0, 5.0, 0.0), Vec3::Y));
    assert_eq!((away.inner, away.leaves, away.blocks), (0, 0, 0));
    let through = tree.count_visits(&Ray::new(vec3(0.01, 5.0, 0.02), -Vec3::Y));
    assert!(through.leaves >= 1 && through.blocks >= through.leaves && through.inner <= stats.inner_nodes);
    assert!(stats.references >= stats.primitives && stats.leaves + stats.empty_leaves == stats.inner_nodes + 1);
    assert!(stats.expected_leaf_visits > 1.0 && stats.expected_leaf_visits < stats.leaves as f64);
}

#[test]
fn a_ray_through_an_empty_room_looks_at_its_end_only() {
    let soup = tiled_cube(24);
    let tree = soup.tree(BuildPreset::Best);
    let mut random = Random(3);
    let (mut blocks, n) = (0, 1000);
    for _ in 0..n {
        let ray = Ray::new(random.point() * 0.9, random.unit());
        assert_eq!(tree.count_visits(&ray).leaves.min(1), 1, "{ray:?} leaves the room");
        blocks += tree.count_visits(&ray).blocks;
    }
    // Where walls have no cells of their own, every cell beside one tests it: 7.9 blocks a ray.
    assert!(blocks < 2 * n, "{blocks} blocks for {n} rays");
}

#[test]
fn packets_agree_with_trying_every_triangle() {
    // Bundles of all widths, from a point, from a patch and to a point, at vertices, edges and anything.
    for (seed, soup) in [triangle_soup(40, 700), sheet(30), tiled_cube(12)].into_iter().enumerate() {
        let scene = SceneTree::build(vec![mesh(&soup.tree(BuildPreset::Best), Affine3A::IDENTITY)]);
        let mut random = Random(seed as u64 + 77);
        let mut rays = Vec::new();
        for bundle in 0..120 {
            let (eye, at) = (random.point() * 3.0, random.point() * 0.7);
            let width = [1e-4, 3e-3, 0.03, 0.2][bundle % 4];
            for i in 0..16 {
                let vertex = soup.positions[random.below(soup.positions.len())];
                let target = if i % 5 == 4 { vertex } else { at + random.unit() * width };
                let patch = eye + random.unit() * width;
                rays.push(match bundle % 3 {
                    0 => Ray::new(eye, target - eye),
                    1 => Ray::new(patch, target - patch),
                    _ => Ray { t_max: 1.0, ..Ray::new(target, eye - target) },
                });
            }
        }
        assert_agrees(&scene, &rays, &format!("bundles {seed}"));
    }
}

#[test]
fn normals_look_to_the_front() {
    let quad = Shape::Quad { corner: Vec3::ZERO, edge_u: Vec3::X, edge_v: Vec3::Y };
    let triangle = Shape::Triangle { vertices: [Vec3::ZERO, Vec3::X, Vec3::Y] };
    let tree = Arc::new(MeshTree::build(&[Vec3::ZERO, Vec3::X, Vec3::Y], &[[0, 1, 2]], BuildPreset::Best));
    let mirrored = mesh(&tree, Affine3A::from_scale(vec3(1.0, 1.0, -1.0)));
    let ray = Ray::new(vec3(0.2, 0.2, 5.0), -Vec3::Z);
    for (shape, expected) in
        [(quad, Vec3::Z), (triangle, Vec3::Z), (mesh(&tree, Affine3A::IDENTITY), Vec3::Z), (mirrored, -Vec3::Z)]
    {
        let scene = SceneTree::build(vec![shape]);
        let hit = scene.closest_hit(&ray).unwrap();
        assert_eq!((hit.t, scene.surface_point(&ray, &hit).geometric_normal), (5.0, expected));
    }
    let scene = SceneTree::build(vec![Shape::Sphere { center: Vec3::ZERO, radius: 2.0 }]);
    for (ray, normal) in [(Ray::new(Vec3::ZERO, Vec3::X), Vec3::X), (Ray::new(5.0 * Vec3::Y, -Vec3::Y), Vec3::Y)] {
        let hit = scene.closest_hit(&ray).unwrap();
        assert_eq!(scene.surface_point(&ray, &hit).geometric_normal, normal);
    }
}

#[test]
fn trees_do_not_depend_on_the_number_of_threads() {
    let soup = sheet(150);
    let build = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| MeshTree::build(&soup.positions, &soup.triangles, BuildPreset::Best))
    };
    let one = build(1);
    assert!(one == build(2) && one == build(7));
}
