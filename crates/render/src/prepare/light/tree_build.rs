//! Builds a [`LightTree`].

use crate::prepare::light::delta::{EVERYTHING, FAR};
use crate::prepare::light::emitter::Light;
use crate::prepare::light::shape::LightShape;
use crate::prepare::light::tree::{LEAF, LightNode, LightTree};
use firstlight_kdtree::geometry::Aabb;
use glam::Vec3;
use std::f32::consts::{FRAC_PI_2, PI};

/// Depth from which on nodes are split by count, so that the path to a light fits into 64 bits.
const MAX_UNEVEN_DEPTH: u32 = 32;

/// More lights than this are divided, and their subtrees built, in parallel.
const LEAST_IN_PARALLEL: usize = 2048;

const BINS: usize = 12;

/// A light in the builder.
#[derive(Clone, Copy)]
struct LightItem {
    bounds: Aabb,
    cone: EmissionCone,
    power: f32,
    least_cos: f32,
    id: u32,
    /// See [`LightTree::ways`].
    way: u64,
    /// Whether it is a directional light.
    is_far: bool,
}

/// Directions within `spread` radians of a unit axis.
#[derive(Clone, Copy)]
struct EmissionCone {
    axis: Vec3,
    spread: f32,
}

impl LightTree {
    /// Builds the tree by the cost of Conty Estevez and Kulla: power times surface area times orientation. The result
    /// does not depend on the number of threads. Requires at least two lights.
    pub fn build(lights: &[Light]) -> Self {
        let mut items: Vec<LightItem> = (0..).zip(lights).map(|(id, light)| LightItem::new(id, light)).collect();
        let has_spots = items.iter().any(|item| item.least_cos >= 0.0);
        let root = LightNode::new(&items);
        let mut nodes = vec![root; 2 * items.len() - 1];
        let (top, descendants) = nodes.split_at_mut(1);
        split(&mut items, &mut top[0], descendants, 1, 0, 0);
        let mut ways = vec![0; items.len()];
        for item in &items {
            ways[item.id as usize] = item.way;
        }
        Self { nodes, ways, has_spots }
    }
}

/// Links a node to its light or to its children, and builds the tree below.
///
/// - `items`: the lights of the node; their ways are filled in.
/// - `descendants`: two for each light but the first; children come first, then what lies below each of them.
/// - `first`: index of the first descendant in the tree.
/// - `way`: path from the root to the node, of `depth` bits.
fn split(
    items: &mut [LightItem],
    node: &mut LightNode,
    descendants: &mut [LightNode],
    first: u32,
    depth: u32,
    way: u64,
) {
    if let [only] = items {
        node.link = LEAF | only.id;
        only.way = way;
        return;
    }
    node.link = first;
    let middle = divide(items, depth);
    let n_below_first = 2 * (middle as u32 - 1);
    let in_parallel = items.len() > LEAST_IN_PARALLEL;
    let (below, above) = items.split_at_mut(middle);
    let (children, descendants) = descendants.split_at_mut(2);
    let (lower, upper) = children.split_at_mut(1);
    let (lower, upper) = (&mut lower[0], &mut upper[0]);
    let (below_lower, below_upper) = descendants.split_at_mut(n_below_first as usize);
    let mut build_lower = || {
        *lower = LightNode::new(below);
        split(below, lower, below_lower, first + 2, depth + 1, way);
    };
    let mut build_upper = || {
        *upper = LightNode::new(above);
        split(above, upper, below_upper, first + 2 + n_below_first, depth + 1, way | 1 << depth);
    };
    if in_parallel {
        rayon::join(build_lower, build_upper);
    } else {
        build_lower();
        build_upper();
    }
}

/// Divides the lights of a node among its children; returns how many belong to the first, which come first.
fn divide(items: &mut [LightItem], depth: u32) -> usize {
    let some_are_far = items.iter().any(|item| item.is_far) && !items.iter().all(|item| item.is_far);
    match (depth < MAX_UNEVEN_DEPTH && !some_are_far).then(|| best_split(items)).flatten() {
        Some((axis, limit)) => partition(items, |item| item.middle()[axis] < limit),
        // They would make the bounding box infinite.
        None if some_are_far => partition(items, |item| item.is_far),
        None => {
            let all = Aabb::from_points(items.iter().map(LightItem::middle));
            let axis = (all.max - all.min).max_position();
            items.sort_unstable_by(|a, b| a.middle()[axis].total_cmp(&b.middle()[axis]).then(a.id.cmp(&b.id)));
            items.len() / 2
        }
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

impl LightItem {
    fn new(id: u32, light: &Light) -> Self {
        let everywhere = EmissionCone { axis: Vec3::Z, spread: PI };
        let (bounds, cone, facing) = match light.shape {
            LightShape::Sphere { center, radius } => {
                (Aabb { min: center - radius, max: center + radius }, everywhere, 0.25)
            }
            LightShape::Quad { corner, edge_u, edge_v, normal, .. } => {
                let corners = [corner, corner + edge_u, corner + edge_v, corner + edge_u + edge_v];
                (Aabb::from_points(corners), EmissionCone { axis: normal, spread: 0.0 }, 1.0)
            }
            LightShape::Triangle { vertices, normal, .. } => {
                (Aabb::from_points(vertices), EmissionCone { axis: normal, spread: 0.0 }, 1.0)
            }
            LightShape::Point { position, cone: None } => (Aabb::from_points([position]), everywhere, 0.25),
            // Its rays deviate from the axis by at most 90°, and those near it are the brightest: like those of a flat
            // light.
            LightShape::Point { position, cone: Some(spot) } => {
                (Aabb::from_points([position]), EmissionCone { axis: spot.axis, spread: 0.0 }, 0.25)
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
        Self { bounds, cone, power, least_cos, id, way: 0, is_far }
    }

    fn middle(&self) -> Vec3 {
        0.5 * (self.bounds.min + self.bounds.max)
    }
}

impl EmissionCone {
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
    cone: Option<EmissionCone>,
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
    let along = |axis: usize| best_split_along(items, axis, &middles);
    let candidates = if items.len() > LEAST_IN_PARALLEL {
        let (x, (y, z)) = rayon::join(|| along(0), || rayon::join(|| along(1), || along(2)));
        [x, y, z]
    } else {
        [0, 1, 2].map(along)
    };
    let mut best: Option<(f32, usize, f32)> = None;
    for (axis, candidate) in candidates.into_iter().enumerate() {
        if let Some((cost, limit)) = candidate
            && best.is_none_or(|(least, ..)| cost < least)
        {
            best = Some((cost, axis, limit));
        }
    }
    let (_, axis, limit) = best?;
    // Rounding may put all of them on one side.
    let n_below = items.iter().filter(|item| item.middle()[axis] < limit).count();
    (0 < n_below && n_below < items.len()).then_some((axis, limit))
}

/// Returns the least cost of a split along one axis, and its limit.
///
/// - `middles`: bounds of the centres.
fn best_split_along(items: &[LightItem], axis: usize, middles: &Aabb) -> Option<(f32, f32)> {
    let size = middles.max - middles.min;
    if !(size[axis] > 0.0) {
        return None;
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
    let mut best: Option<(f32, f32)> = None;
    for i in 0..BINS - 1 {
        below = below.with(bins[i]);
        if below.cone.is_none() || above[i].cone.is_none() {
            continue;
        }
        let cost = slimness * (below.cost() + above[i].cost());
        if best.is_none_or(|(least, _)| cost < least) {
            best = Some((cost, middles.min[axis] + size[axis] * ((i + 1) as f32 / BINS as f32)));
        }
    }
    best
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

    #[test]
    fn trees_are_whole_and_the_same_on_any_number_of_threads() {
        let at = |i: u32| Vec3::new((i % 97) as f32, (i * i % 61) as f32, (i % 13) as f32);
        let lights: Vec<Light> = (0..3 * LEAST_IN_PARALLEL as u32)
            .map(|i| {
                let shape = LightShape::triangle([at(i), at(i) + at(i + 1).normalize(), at(i) + Vec3::Z]);
                let mean_radiance = 1.0 + (i % 5) as f32;
                let emission = Emission::even(Vec3::splat(mean_radiance));
                Light { shape, emission, mean_radiance, is_point: false, turned: None, corners: None, image: None }
            })
            .collect();
        let on_threads =
            |n| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap().install(|| LightTree::build(&lights));
        let (one, four) = (on_threads(1), on_threads(4));
        assert_eq!(format!("{one:?}"), format!("{four:?}"));
        for (id, way) in (0..).zip(&one.ways) {
            let (mut node, mut way) = (one.nodes[0], *way);
            while node.link < LEAF {
                node = one.nodes[node.link as usize + (way & 1) as usize];
                way >>= 1;
            }
            assert_eq!(node.link, LEAF | id);
        }
        let leaves = one.nodes.iter().filter(|node| node.link >= LEAF).count();
        assert_eq!((leaves, one.nodes.len()), (lights.len(), 2 * lights.len() - 1));
    }
}
