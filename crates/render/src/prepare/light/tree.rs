//! A tree over many lights, for selecting one by its potential contribution to a point without evaluating all.
//!
//! Every node has a bounding sphere of its lights, a cone of their normals, and their power. From the root down, one of
//! two children is selected in proportion to a bound on its contribution: power over distance squared, times the
//! largest cosines at both ends (Conty Estevez and Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree
//! Splitting", without the splitting). The tree is built by their cost, surface area times orientation. Descending to a
//! given light gives the exact probability of its selection.

use crate::prepare::light::delta::{EVERYTHING, FAR};
use crate::prepare::light::emitter::Light;
use crate::prepare::light::shape::LightShape;
use firstlight_kdtree::geometry::Aabb;
use firstlight_simd::{Real, Vector3, select};
use glam::Vec3;
use std::f32::consts::{FRAC_PI_2, PI};

/// Depth from which on nodes are split by count, so that the path to a light fits into 64 bits.
const MAX_UNEVEN_DEPTH: u32 = 32;

const BINS: usize = 12;

#[derive(Debug, Default)]
pub(crate) struct LightTree {
    /// Children are stored next to each other.
    pub(crate) nodes: Vec<LightNode>,
    /// Per light the path from the root: bit k selects the child on level k.
    pub(crate) ways: Vec<u64>,
    /// Whether there are spot lights.
    pub(crate) has_spots: bool,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct LightNode {
    pub center: Vec3,
    pub radius: f32,
    /// Mean direction of the normals, unit.
    pub axis: Vec3,
    /// Bound on how much the cosine with some normal can exceed that with the axis: 2 sin(s/2) for normals up to s
    /// away.
    pub widening: f32,
    /// Luminance of the radiance times area that can face a point.
    pub power: f32,
    /// If all are spot lights, the cosine of the widest cone, beyond which there is no light. Otherwise −1.
    pub least_cos: f32,
    /// First of the two children, or `LEAF` plus a light.
    pub link: u32,
}

pub(crate) const LEAF: u32 = 1 << 31;

/// A light in the builder.
#[derive(Clone, Copy)]
struct LightItem {
    bounds: Aabb,
    cone: Cone,
    power: f32,
    least_cos: f32,
    id: u32,
    /// Whether it is a directional light.
    is_far: bool,
}

/// Directions within `spread` radians of a unit axis.
#[derive(Clone, Copy)]
struct Cone {
    axis: Vec3,
    spread: f32,
}

impl LightTree {
    /// Requires at least two lights.
    pub fn build(lights: &[Light]) -> Self {
        let mut items: Vec<LightItem> = (0..).zip(lights).map(|(id, light)| LightItem::new(id, light)).collect();
        let has_spots = items.iter().any(|item| item.least_cos >= 0.0);
        let (nodes, ways) = (Vec::with_capacity(2 * lights.len()), vec![0; lights.len()]);
        let mut tree = Self { nodes, ways, has_spots };
        tree.nodes.push(LightNode::new(&items));
        tree.split(0, &mut items, 0, 0);
        tree
    }

    fn split(&mut self, at: usize, items: &mut [LightItem], depth: u32, way: u64) {
        if let [only] = items {
            self.nodes[at].link = LEAF | only.id;
            self.ways[only.id as usize] = way;
            return;
        }
        let some_are_far = items.iter().any(|item| item.is_far) && !items.iter().all(|item| item.is_far);
        let middle = match (depth < MAX_UNEVEN_DEPTH && !some_are_far).then(|| best_split(items)).flatten() {
            Some((axis, limit)) => partition(items, |item| item.middle()[axis] < limit),
            // They would make the bounding box infinite.
            None if some_are_far => partition(items, |item| item.is_far),
            None => {
                let all = Aabb::from_points(items.iter().map(LightItem::middle));
                let axis = (all.max - all.min).max_position();
                items.sort_unstable_by(|a, b| a.middle()[axis].total_cmp(&b.middle()[axis]).then(a.id.cmp(&b.id)));
                items.len() / 2
            }
        };
        let (below, above) = items.split_at_mut(middle);
        let first = self.nodes.len();
        self.nodes[at].link = first as u32;
        self.nodes.extend([LightNode::new(below), LightNode::new(above)]);
        self.split(first, below, depth + 1, way);
        self.split(first + 1, above, depth + 1, way | 1 << depth);
    }

    /// Selects a light; returns it and the probability of the choice; `None` if none can reach the point.
    pub fn sample(&self, position: Vec3, normal: Vec3, mut u: f32) -> Option<(u32, f32)> {
        let (mut node, mut pmf) = (self.nodes[0], 1.0);
        while node.link < LEAF {
            let children = &self.nodes[node.link as usize..][..2];
            let bounds = [self.bound(&children[0], position, normal), self.bound(&children[1], position, normal)];
            let sum = bounds[0] + bounds[1];
            if sum == 0.0 {
                return None;
            }
            let (second, part, rest) = step_down(bounds, u);
            (u, pmf) = (rest, pmf * part);
            node = children[usize::from(second)];
        }
        Some((node.link & !LEAF, pmf))
    }

    /// Probability that [`Self::sample`] selects a light.
    pub fn pmf(&self, id: u32, position: Vec3, normal: Vec3) -> f32 {
        let (mut node, mut pmf, mut way) = (self.nodes[0], 1.0, self.ways[id as usize]);
        while node.link < LEAF {
            let children = &self.nodes[node.link as usize..][..2];
            let bounds = [self.bound(&children[0], position, normal), self.bound(&children[1], position, normal)];
            let sum = bounds[0] + bounds[1];
            if sum == 0.0 {
                return 0.0;
            }
            let second = (way & 1) as usize;
            // The same division as in `sample`, so that both results are equal to the last bit.
            pmf *= bounds[second] / sum;
            node = children[second];
            way >>= 1;
        }
        pmf
    }
}

impl LightTree {
    /// See [`NodeBound::irradiance`].
    #[inline]
    fn bound(&self, node: &LightNode, position: Vec3, normal: Vec3) -> f32 {
        let LightNode { center, radius, axis, widening, power, least_cos, .. } = *node;
        let (offset, least_cos) = ((center - position).into(), self.has_spots.then_some(least_cos));
        let bound = NodeBound { offset, radius, axis: axis.into(), widening, power, least_cos };
        bound.irradiance((normal != Vec3::ZERO).then(|| normal.into()))
    }
}

impl LightNode {
    fn new(items: &[LightItem]) -> Self {
        let bounds = items.iter().fold(Aabb::EMPTY, |all, item| all.union(item.bounds));
        let cone = items[1..].iter().fold(items[0].cone, |all, item| all.union(item.cone));
        let center = 0.5 * (bounds.min + bounds.max);
        Self {
            center,
            // Both with a margin, so that rounding excludes nothing.
            radius: 0.5 * (bounds.max - bounds.min).length() * (1.0 + 8.0 * f32::EPSILON)
                + 4.0 * f32::EPSILON * center.length(),
            axis: cone.axis,
            widening: 2.0 * (0.5 * cone.spread).sin() + 1e-5,
            power: items.iter().map(|item| item.power).sum(),
            least_cos: items.iter().map(|item| item.least_cos).fold(1.0, f32::min),
            link: 0,
        }
    }
}

/// A node, or sixteen, seen from a point.
pub(crate) struct NodeBound<R> {
    /// Vector from the point to the centre.
    pub offset: Vector3<R>,
    pub radius: R,
    pub axis: Vector3<R>,
    pub widening: R,
    pub power: R,
    /// Only in trees with spot lights.
    pub least_cos: Option<R>,
}

impl<R: Real> NodeBound<R> {
    /// Approximate upper bound of the irradiance that the lights can cause, never zero if they can cause any.
    ///
    /// It is evaluated twice per level, so it takes a single root and no trigonometry: the cosine of the largest angle
    /// over a sphere is approximated by that of its centre plus radius over distance, and the cone of normals widens it
    /// further.
    ///
    /// - `normal`: unit, of the surface, if it has one side.
    #[inline(always)]
    pub fn irradiance(self, normal: Option<Vector3<R>>) -> R {
        let Self { offset, radius, axis, widening, power, least_cos } = self;
        let (distance2, r2) = (offset.length_squared(), radius * radius);
        let inv_distance = radius.all(1.0) / distance2.sqrt();
        // A margin, so that rounding excludes nothing.
        let slack = 16.0 * f32::EPSILON;
        let receiver = match normal {
            Some(normal) => (offset.dot(normal) + radius) * inv_distance + slack,
            None => radius.all(1.0),
        };
        let emitter = (radius - offset.dot(axis)) * inv_distance + widening + slack;
        let receiver = receiver.at_least(0.0).at_most(1.0);
        let mut emitter = emitter.at_least(0.0).at_most(1.0);
        if let Some(least_cos) = least_cos {
            // Over the positions in the sphere the cosine differs by at most a chord: √2 times radius over distance.
            let most_cos = (radius * 1.4143 - offset.dot(axis)) * inv_distance + widening + slack;
            emitter = select(most_cos.lt(least_cos), emitter.all(0.0), emitter);
        }
        let outside = power * receiver * emitter * (inv_distance * inv_distance);
        // Inside of the sphere no bound is possible; on average the lights are about a radius away.
        select(distance2.le(r2), power / r2.at_least(f32::MIN_POSITIVE), outside)
    }
}

/// Takes one step down from a node whose children have these bounds, not both of them zero: returns whether it leads to
/// the second child, its probability, and the rescaled uniform number `u` for further steps.
#[inline(always)]
pub(crate) fn step_down<R: Real>([first, second]: [R; 2], u: R) -> (R::Mask, R, R) {
    let sum = first + second;
    let share = first / sum;
    // Rounding must not lead to a child that contributes nothing.
    let take = (share.le(u) & second.is_positive()) | first.is_zero();
    let part = select(take, second / sum, share);
    let rest = (select(take, u - share, u) / part).at_least(0.0).at_most(1.0f32.next_down());
    (take, part, rest)
}

impl LightItem {
    fn new(id: u32, light: &Light) -> Self {
        let everywhere = Cone { axis: Vec3::Z, spread: PI };
        let (bounds, cone, facing) = match light.shape {
            LightShape::Sphere { center, radius } => {
                (Aabb { min: center - radius, max: center + radius }, everywhere, 0.25)
            }
            LightShape::Quad { corner, edge_u, edge_v, normal, .. } => {
                let corners = [corner, corner + edge_u, corner + edge_v, corner + edge_u + edge_v];
                (Aabb::from_points(corners), Cone { axis: normal, spread: 0.0 }, 1.0)
            }
            LightShape::Triangle { vertices, normal, .. } => {
                (Aabb::from_points(vertices), Cone { axis: normal, spread: 0.0 }, 1.0)
            }
            LightShape::Point { position, cone: None } => (Aabb::from_points([position]), everywhere, 0.25),
            // Its rays deviate from the axis by at most 90°, and those near it are the brightest: like those of a flat
            // light.
            LightShape::Point { position, cone: Some(spot) } => {
                (Aabb::from_points([position]), Cone { axis: spot.axis, spread: 0.0 }, 0.25)
            }
            LightShape::Directional { .. } => {
                let (center, size) = (light.shape.center(), Vec3::splat(EVERYTHING));
                (Aabb { min: center - size, max: center + size }, everywhere, 0.0)
            }
        };
        // A light with mean radiance 0 may still emit somewhere: its power is positive.
        let is_far = matches!(light.shape, LightShape::Directional { .. });
        let least_cos = match light.shape {
            LightShape::Point { cone: Some(spot), .. } => 1.0 - spot.outer,
            _ => -1.0,
        };
        let power = if is_far { FAR * FAR } else { light.shape.area() * facing };
        let power = (light.mean_radiance * power).max(f32::MIN_POSITIVE);
        Self { bounds, cone, power, least_cos, id, is_far }
    }

    fn middle(&self) -> Vec3 {
        0.5 * (self.bounds.min + self.bounds.max)
    }
}

impl Cone {
    fn union(self, other: Self) -> Self {
        let (wide, narrow) = if self.spread >= other.spread { (self, other) } else { (other, self) };
        if wide.spread >= PI {
            return wide;
        }
        let between = wide.axis.angle_between(narrow.axis);
        if between + narrow.spread <= wide.spread {
            return wide;
        }
        let spread = 0.5 * (wide.spread + between + narrow.spread);
        let across = wide.axis.cross(narrow.axis);
        if spread >= PI || across.length_squared() < 1e-12 {
            return Self { axis: wide.axis, spread: PI };
        }
        let turn = glam::Quat::from_axis_angle(across.normalize(), spread - wide.spread);
        // Rotation rounds.
        Self { axis: (turn * wide.axis).normalize(), spread: spread + 1e-5 }
    }

    /// Solid angle of the lights' emission, weighted by cosine beyond the cone (Conty and Kulla, section 4.4).
    fn measure(self) -> f32 {
        let (o, w) = (self.spread, (self.spread + FRAC_PI_2).min(PI));
        2.0 * PI * (1.0 - o.cos()) + FRAC_PI_2 * (2.0 * w * o.sin() - (o - 2.0 * w).cos() - 2.0 * o * o.sin() + o.cos())
    }
}

/// One side of a split; its cost is power times area times orientation.
#[derive(Clone, Copy)]
struct Half {
    bounds: Aabb,
    cone: Option<Cone>,
    power: f32,
}

impl Half {
    const EMPTY: Self = Self { bounds: Aabb::EMPTY, cone: None, power: 0.0 };

    fn with(self, other: Self) -> Self {
        let cone = match (self.cone, other.cone) {
            (Some(a), Some(b)) => Some(a.union(b)),
            (a, b) => a.or(b),
        };
        Self { bounds: self.bounds.union(other.bounds), cone, power: self.power + other.power }
    }

    fn cost(self) -> f32 {
        let Some(cone) = self.cone else { return 0.0 };
        let size = self.bounds.max - self.bounds.min;
        let area = size.x * size.y + size.y * size.z + size.z * size.x;
        self.power * area * cone.measure()
    }
}

/// Returns axis and limit of the centres; `None` if all centres are equal, or no split has a lower cost.
fn best_split(items: &[LightItem]) -> Option<(usize, f32)> {
    let middles = Aabb::from_points(items.iter().map(LightItem::middle));
    let size = middles.max - middles.min;
    let mut best: Option<(f32, usize, f32)> = None;
    for axis in 0..3 {
        if !(size[axis] > 0.0) {
            continue;
        }
        let mut bins = [Half::EMPTY; BINS];
        for item in items {
            let place = (item.middle()[axis] - middles.min[axis]) / size[axis] * BINS as f32;
            let bin = &mut bins[(place as usize).min(BINS - 1)];
            *bin = bin.with(Half { bounds: item.bounds, cone: Some(item.cone), power: item.power });
        }
        // Long boxes are preferably split across.
        let slimness = size.max_element() / size[axis];
        let mut above = [Half::EMPTY; BINS];
        for i in (0..BINS - 1).rev() {
            above[i] = above[i + 1].with(bins[i + 1]);
        }
        let mut below = Half::EMPTY;
        for i in 0..BINS - 1 {
            below = below.with(bins[i]);
            if below.cone.is_none() || above[i].cone.is_none() {
                continue;
            }
            let cost = slimness * (below.cost() + above[i].cost());
            if best.is_none_or(|(least, ..)| cost < least) {
                best = Some((cost, axis, middles.min[axis] + size[axis] * ((i + 1) as f32 / BINS as f32)));
            }
        }
    }
    let (_, axis, limit) = best?;
    // Rounding may put all of them on one side.
    let n_below = items.iter().filter(|item| item.middle()[axis] < limit).count();
    (0 < n_below && n_below < items.len()).then_some((axis, limit))
}

/// Moves the items for which `is_below` holds to the front, in order; returns their number.
fn partition(items: &mut [LightItem], is_below: impl Fn(&LightItem) -> bool) -> usize {
    items.sort_by_key(|item| !is_below(item));
    items.partition_point(is_below)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::material_queries::Emission;
    use crate::core::techniques::Techniques;
    use crate::prepare::light::tree_simd::LightTreeArrays;
    use crate::sampling::Sampler;
    use crate::test_statistics::ChiSquared;
    use firstlight_simd::{Float, InstructionSet, LANES, Mask, Simd, Vector, dispatch};

    fn lights(n: u32, seed: u32) -> Vec<Light> {
        (0..n)
            .map(|i| {
                let sampler = Sampler::new(seed, i, 0, 0);
                let (a, b, c) = (sampler.pair(0), sampler.pair(1), sampler.pair(2));
                let at = Vec3::new(8.0 * a.x - 4.0, 3.0 * a.y, 8.0 * b.x - 4.0);
                let (size, turn) = (0.02 + 0.3 * b.y * b.y, 6.3 * c.x);
                let (u, v) = (Vec3::new(turn.cos(), 0.2, turn.sin()) * size, Vec3::new(0.0, size, size * c.y));
                let radiance = 0.1 + 20.0 * c.y.powi(4);
                let shape = match i % 7 {
                    0 => LightShape::Sphere { center: at, radius: size },
                    1 | 5 => LightShape::quad(at, u, v),
                    2 => LightShape::triangle([at, at + u, at + v]),
                    3 => LightShape::Point { position: at, cone: None },
                    4 => {
                        let outer = 0.1 + 1.4 * f64::from(a.y);
                        let cone = crate::core::delta_light::Cone::new(u.normalize(), outer * f64::from(b.x), outer);
                        LightShape::Point { position: at, cone: Some(cone) }
                    }
                    _ => LightShape::Directional { to_light: (u + v).normalize(), reach: 8.0 },
                };
                let emission = Emission::even(Vec3::splat(radiance));
                Light { shape, emission, mean_radiance: radiance, is_point: false, turned: None, corners: None }
            })
            .collect()
    }

    /// Points among the lights, on their edges and far away, with normals in all directions.
    fn places() -> Vec<(Vec3, Vec3)> {
        (0..60)
            .map(|i| {
                let sampler = Sampler::new(77, i, 0, 0);
                let (a, b, c) = (sampler.pair(0), sampler.pair(1), sampler.pair(2));
                let reach = if i % 3 == 0 { 40.0 } else { 8.0 };
                let at = Vec3::new(a.x - 0.5, a.y - 0.5, b.x - 0.5) * reach;
                (at, Vec3::new(b.y - 0.5, c.x - 0.5, c.y - 0.5).normalize())
            })
            .collect()
    }

    #[inline(always)]
    fn walk_lanes<S: Simd>(s: S, tree: &LightTree, places: &[(Vec3, Vec3)], out: &mut Vec<(u32, u32, u32)>) {
        let wide = LightTreeArrays::new(tree);
        for (round, chunk) in places.chunks(LANES).enumerate() {
            let at = |k: usize| chunk[k.min(chunk.len() - 1)];
            let u: [f32; LANES] = std::array::from_fn(|k| (k as f32 + 0.5) / LANES as f32);
            let [px, py, pz] = [0, 1, 2].map(|axis| std::array::from_fn(|k| at(k).0[axis]));
            let [nx, ny, nz] = [0, 1, 2].map(|axis| std::array::from_fn(|k| at(k).1[axis]));
            let position = Vector::from_arrays(s, &[px, py, pz]);
            let normal = Vector::from_arrays(s, &[nx, ny, nz]);
            let (id, pmf, found) = wide.sample(Mask::MAX, position, normal, Float::load(s, &u));
            let again = wide.pmf(found, id, position, normal).to_array();
            let (ids, pmfs) = (id.to_array(), pmf.to_array());
            for (k, &(position, normal)) in chunk.iter().enumerate() {
                let expected = tree.sample(position, normal, u[k]);
                let got = (found >> k & 1 != 0).then_some((ids[k], pmfs[k]));
                assert_eq!(got, expected, "lane {k} of round {round}");
                if let Some((id, pmf)) = got {
                    assert_eq!(again[k], pmf);
                    out.push((round as u32, id, pmf.to_bits()));
                }
            }
        }
    }

    #[test]
    fn lanes_walk_the_same_way() {
        for n in [2, 17, 40, 300] {
            let (tree, places) = (LightTree::build(&lights(n, 9)), places());
            let run = |set| {
                let mut out = Vec::new();
                let (tree, places, into) = (&tree, &places[..], &mut out);
                dispatch!(
                    set,
                    walk_lanes(tree: &LightTree, places: &[(Vec3, Vec3)], into: &mut Vec<(u32, u32, u32)>)
                );
                out
            };
            let expected = run(InstructionSet::Portable);
            assert!(expected.len() > 20, "{n} lights: hardly any place is reached");
            for set in InstructionSet::available() {
                assert_eq!(run(set), expected, "{n} lights, {set:?}");
            }
        }
    }

    #[test]
    fn probabilities_sum_to_one_and_are_those_of_the_choice() {
        for n in [2, 17, 300] {
            let tree = LightTree::build(&lights(n, 5));
            for (position, normal) in places() {
                let pmfs: Vec<f32> = (0..n).map(|id| tree.pmf(id, position, normal)).collect();
                let sum: f32 = pmfs.iter().sum();
                let draws = 512;
                let mut in_vain = 0;
                for i in 0..draws {
                    match tree.sample(position, normal, (i as f32 + 0.5) / draws as f32) {
                        Some((id, pmf)) => assert_eq!(pmf, pmfs[id as usize]),
                        None => in_vain += 1,
                    }
                }
                // The difference to one consists of selections of nodes whose lights do not reach the point.
                let missing = 1.0 - sum - in_vain as f32 / draws as f32;
                assert!(missing.abs() < 0.02, "{sum} with {in_vain} of {draws} in vain");
            }
        }
    }

    #[test]
    fn frequencies_follow_the_probabilities() {
        let n = 40;
        let tree = LightTree::build(&lights(n, 6));
        let mut n_judged = 0;
        for (k, (position, normal)) in places().into_iter().take(12).enumerate() {
            let draws = 200_000;
            let mut found = vec![0.0_f64; n as usize];
            for i in 0..draws {
                let u = Sampler::independent(2, k as u32, i, 0).single(0);
                if let Some((id, _)) = tree.sample(position, normal, u) {
                    found[id as usize] += 1.0;
                }
            }
            let expected: Vec<f64> =
                (0..n).map(|id| f64::from(tree.pmf(id, position, normal)) * f64::from(draws)).collect();
            if expected.iter().all(|e| *e == 0.0) {
                assert!(found.iter().all(|f| *f == 0.0), "place {k}: no light reaches it");
                continue;
            }
            n_judged += 1;
            // 3.2 σ is 1 % over twelve positions.
            ChiSquared::of(&found, &expected, 0.0).assert_below(3.2, &format!("place {k}"));
        }
        assert!(n_judged >= 6, "too few places that light reaches: {n_judged}");
    }

    #[test]
    fn no_light_that_reaches_a_point_is_left_out() {
        let lights = lights(200, 8);
        let tree = LightTree::build(&lights);
        let mut n_reaching = 0;
        for (position, normal) in places() {
            for (id, light) in (0..).zip(&lights) {
                let reaches = (0..8).any(|i| {
                    let u = Sampler::new(3, id, 0, i).pair(0);
                    let sample = light.sample(&[], &Techniques::ALL, position, u, 1.0);
                    sample.is_some_and(|sample| sample.wi.dot(normal) > 1e-6)
                });
                n_reaching += u32::from(reaches);
                assert!(!reaches || tree.pmf(id, position, normal) > 0.0, "light {id} from {position} along {normal}");
            }
        }
        assert!(n_reaching > 1000, "the test must see something: {n_reaching}");
    }

    #[test]
    fn spots_that_shine_elsewhere_are_left_out() {
        // A ceiling of spot lights, each with its own circle on the floor.
        let cone = crate::core::delta_light::Cone::new(Vec3::NEG_Y, 0.1, 0.17);
        let at = |i: u32| Vec3::new((i % 16) as f32, 3.0, (i / 16) as f32);
        let light = lights(1, 5).remove(0);
        let spot = |i| Light { shape: LightShape::Point { position: at(i), cone: Some(cone) }, ..light.clone() };
        let tree = LightTree::build(&(0..256).map(spot).collect::<Vec<_>>());
        let floor = |i| at(i) * Vec3::new(1.0, 0.0, 1.0) + Vec3::new(0.2, 0.0, 0.1);
        let pmfs: Vec<f32> = (0..256).map(|i| tree.pmf(i, floor(i), Vec3::Y)).collect();
        let mean = pmfs.iter().sum::<f32>() / 256.0;
        assert!(mean > 0.04 && pmfs.iter().all(|&pmf| pmf > 0.01), "{mean}: {pmfs:?}");
    }

    #[test]
    fn lights_in_one_place_do_not_break_it() {
        let one = lights(1, 5).remove(0);
        let tree = LightTree::build(&vec![one; 1000]);
        let sum: f32 = (0..1000).map(|id| tree.pmf(id, Vec3::new(9.0, 1.0, 0.0), Vec3::NEG_X)).sum();
        assert!((sum - 1.0).abs() < 1e-3, "{sum}");
    }
}
