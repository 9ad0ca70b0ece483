//! Guiding cache: directions of light from specular surfaces, for vertices that are seen in mirrors and through glass.
//!
//! Light paths cannot be connected to the lens through specular surfaces, so a caustic that is seen in a mirror is left
//! to camera paths, which rarely find the light by themselves. So they are guided: a first wave of light paths stores,
//! at each diffuse or rough point that it reaches, the point of the specular surface that it came from (Jensen 1995,
//! "Importance Driven Path Tracing Using the Photon Map"). A tree over the reached points gives each position a small
//! list of such exits; a share of the directions there are sampled towards them. The pdf of the mixture is known
//! exactly, so the result is unbiased for any list.

use crate::sampling::{cone_pdf, one_minus_cos_from_sin2, uniform_cone};
use firstlight_kdtree::geometry::Frame;
use firstlight_simd::{Bits, Float, LANES, Mask, Real, Simd, Truth, Vector, Vector3, Word, padded, select};
use glam::{Vec2, Vec3};
use std::ops::Range;

/// Maximum number of exits per list. Each costs a few multiplications per evaluation.
const LIST: usize = 32;

/// Index of the neighbour that the sphere of an exit reaches: large enough to overlap, small enough to separate the two
/// sides of a lens.
const NEIGHBOR: usize = 3;

/// Share of directions that are sampled by the list if there is one.
pub(crate) const SHARE: f32 = 0.35;

/// A point that light reached, and the specular point that it came from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Trace {
    pub at: Vec3,
    pub from: Vec3,
}

/// A tree over the points that light reaches; the lower child of a node is the next node.
#[derive(Debug, Default)]
pub(crate) struct Guide {
    splits: Vec<f32>,
    /// The axis or [`LEAF`], and from the third bit on the upper child or the leaf.
    links: Vec<u32>,
    leaves: Vec<GuideLeaf>,
    blocks: Vec<ExitBlock>,
}

/// Replaces the axis in a leaf.
const LEAF: u32 = 3;

#[derive(Debug)]
struct GuideLeaf {
    /// Bounds of the leaf; there are no guiding distributions outside.
    min: Vec3,
    max: Vec3,
    blocks: Range<u32>,
    n_exits: u32,
}

/// Spheres around exits as structure of arrays; those of unused lanes are empty.
#[derive(Debug)]
#[repr(C, align(64))]
struct ExitBlock {
    center: [[f32; LANES]; 3],
    radius2: [f32; LANES],
}

impl ExitBlock {
    const NONE: Self = Self { center: [[0.0; LANES]; 3], radius2: [-1.0; LANES] };

    fn exit(&self, lane: usize) -> Exit {
        let [x, y, z] = &self.center;
        Exit { center: Vec3::new(x[lane], y[lane], z[lane]), radius2: self.radius2[lane] }
    }
}

/// A sphere around an exit.
#[derive(Clone, Copy, Debug)]
struct Exit {
    center: Vec3,
    radius2: f32,
}

impl Guide {
    pub(crate) fn build(mut traces: Vec<Trace>) -> Self {
        let mut guide = Self::default();
        if traces.len() > 2 * NEIGHBOR {
            guide.split(&mut traces);
            guide.splits = padded(guide.splits);
            guide.links = padded(guide.links);
        }
        guide
    }

    fn split(&mut self, traces: &mut [Trace]) {
        let min = traces.iter().fold(Vec3::INFINITY, |min, trace| min.min(trace.at));
        let max = traces.iter().fold(Vec3::NEG_INFINITY, |max, trace| max.max(trace.at));
        let size = max - min;
        if traces.len() <= LIST || size == Vec3::ZERO {
            // Equal points share one leaf: this many of them are representative.
            let exits = exits_of(&traces[..traces.len().min(LIST)], size.length());
            let margin = Vec3::splat(0.25 * size.length());
            let first_block = self.blocks.len() as u32;
            for some in exits.chunks(LANES) {
                let mut block = ExitBlock::NONE;
                for (lane, exit) in some.iter().enumerate() {
                    (0..3).for_each(|axis| block.center[axis][lane] = exit.center[axis]);
                    block.radius2[lane] = exit.radius2;
                }
                self.blocks.push(block);
            }
            self.splits.push(0.0);
            self.links.push((self.leaves.len() as u32) << 2 | LEAF);
            self.leaves.push(GuideLeaf {
                min: min - margin,
                max: max + margin,
                blocks: first_block..self.blocks.len() as u32,
                n_exits: exits.len() as u32,
            });
            return;
        }
        let axis = size.max_position();
        let middle = traces.len() / 2;
        traces.select_nth_unstable_by(middle, |a, b| {
            // Ties are broken by the other coordinates, so that the tree does not depend on the selection algorithm.
            let key = |t: &Trace| [t.at[axis], t.at.x, t.at.y, t.at.z, t.from.x, t.from.y, t.from.z];
            key(a)
                .into_iter()
                .zip(key(b))
                .map(|(a, b)| a.total_cmp(&b))
                .find(|o| o.is_ne())
                .unwrap_or(std::cmp::Ordering::Equal)
        });
        let split = traces[middle].at[axis];
        let (below, above) = traces.split_at_mut(middle);
        let here = self.links.len();
        self.splits.push(split);
        self.links.push(0);
        self.split(below);
        self.links[here] = (self.links.len() as u32) << 2 | axis as u32;
        self.split(above);
    }

    /// Returns the guiding distribution at a position.
    pub fn at(&self, position: Vec3) -> Option<Hints<'_>> {
        let mut node = 0;
        loop {
            let link = *self.links.get(node)?;
            let axis = link & 3;
            if axis == LEAF {
                return self.in_leaf(link >> 2, position);
            }
            node = if position[axis as usize] < self.splits[node] { node + 1 } else { (link >> 2) as usize };
        }
    }

    /// Returns the leaves of sixteen positions; see [`Self::in_leaf`]. The cache must not be empty.
    #[inline(always)]
    pub fn leaves_at<S: Simd>(&self, s: S, mask: Mask, position: Vector<S>) -> [u32; LANES] {
        let mut node = Bits::splat(s, 0);
        loop {
            let link = Bits::gather(&self.links, node);
            let (axis, beyond) = (link & LEAF, link.shift_right(2));
            let at_leaf = axis.equals(LEAF);
            if mask & !at_leaf == 0 {
                return beyond.to_array();
            }
            let at = select(axis.equals(0), position.x, select(axis.equals(1), position.y, position.z));
            let below = at.lt(Float::gather(&self.splits, node));
            let child = s.select_u(below, (node + 1).v, beyond.v);
            node = Bits { s, v: s.select_u(at_leaf, node.v, child) };
        }
    }

    #[inline(always)]
    pub fn in_leaf(&self, leaf: u32, position: Vec3) -> Option<Hints<'_>> {
        let GuideLeaf { min, max, ref blocks, n_exits } = self.leaves[leaf as usize];
        let inside = position.cmpge(min).all() && position.cmple(max).all();
        let blocks = &self.blocks[blocks.start as usize..blocks.end as usize];
        inside.then_some(Hints { blocks, n_exits, position })
    }

    pub fn is_empty(&self) -> bool {
        self.links.is_empty()
    }
}

/// Returns a sphere around each exit of a list.
///
/// - `extent`: size of the region of reached points, metres.
///
/// A sphere reaches to a neighbour, so that the spheres of one mirror image of a light overlap. For a faint image with
/// few exits the neighbours belong to another image: its spheres are limited to the size of most others, or to the
/// distance by which exits move from one end of the region to the other.
fn exits_of(list: &[Trace], extent: f32) -> Vec<Exit> {
    let reach = |trace: &Trace| {
        let mut distances: Vec<f32> = list.iter().map(|other| other.from.distance_squared(trace.from)).collect();
        distances.sort_by(f32::total_cmp);
        distances[NEIGHBOR.min(list.len() - 1)]
    };
    let reaches: Vec<f32> = list.iter().map(reach).collect();
    let mut sorted = reaches.clone();
    sorted.sort_by(f32::total_cmp);
    let most = sorted[sorted.len() / 2].max((0.5 * extent).powi(2));
    list.iter()
        .zip(reaches)
        .map(|(trace, reach)| {
            // A single point still represents a small piece of its surface.
            let least = (1e-3 * trace.at.distance(trace.from)).powi(2);
            Exit { center: trace.from, radius2: reach.min(most).max(least) }
        })
        .collect()
}

/// The guiding distribution at a position; never empty.
#[derive(Clone, Copy)]
pub(crate) struct Hints<'a> {
    blocks: &'a [ExitBlock],
    n_exits: u32,
    position: Vec3,
}

impl Hints<'_> {
    /// Samples a direction to one of the exits, unit.
    ///
    /// - `u_exit`, `u`: independent uniform numbers in `[0, 1)`.
    pub fn sample(&self, u_exit: f32, u: Vec2) -> Vec3 {
        let chosen = ((u_exit * self.n_exits as f32) as usize).min(self.n_exits as usize - 1);
        let exit = self.blocks[chosen / LANES].exit(chosen % LANES);
        let way = exit.center - self.position;
        let distance2 = way.length_squared();
        if distance2 <= exit.radius2 {
            let (local, _) = uniform_cone(u.to_array(), 2.0);
            return local.normalize().into();
        }
        let cone = one_minus_cos_from_sin2(exit.radius2 / distance2);
        Frame::around(way / distance2.sqrt()).to_world(uniform_cone(u.to_array(), cone).0.into()).normalize()
    }

    /// Pdf per steradian.
    pub fn pdf(&self, wi: Vec3) -> f32 {
        let sum: f32 = (0..self.n_exits as usize)
            .map(|i| {
                let exit = self.blocks[i / LANES].exit(i % LANES);
                exit_pdf((exit.center - self.position).into(), exit.radius2, wi.into())
            })
            .sum();
        sum / self.n_exits as f32
    }

    /// Like [`Self::pdf`], sixteen exits at a time.
    #[inline(always)]
    pub fn pdf_lanes<S: Simd>(&self, s: S, wi: Vec3) -> f32 {
        let (position, wi) = (Vector::splat(s, self.position), Vector::splat(s, wi));
        let mut sum = Float::splat(s, 0.0);
        for block in self.blocks {
            let (way, radius2) = (Vector::from_arrays(s, &block.center) - position, Float::load(s, &block.radius2));
            sum += exit_pdf(way, radius2, wi);
        }
        sum.to_array().iter().sum::<f32>() / self.n_exits as f32
    }
}

/// Pdf per steradian of `wi` for uniform sampling of the directions to a sphere; of all directions from inside of it.
///
/// - `way`: to the centre; `radius2`: square of the radius; `wi`: unit.
#[inline(always)]
fn exit_pdf<R: Real>(way: Vector3<R>, radius2: R, wi: Vector3<R>) -> R {
    let distance2 = way.length_squared();
    let inside = distance2.le(radius2);
    // Whether the line passes the centre within the radius: by its perpendicular distance, without cancellation.
    let hit = way.dot(wi).is_positive() & way.cross(wi).length_squared().le(radius2);
    let zero = distance2.all(0.0);
    if !(inside | hit).any() {
        return zero;
    }
    let found = cone_pdf(one_minus_cos_from_sin2(radius2 / distance2));
    select(inside, cone_pdf(zero.all(2.0)), select(hit, found, zero))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sampler;
    use crate::shading::bsdf::Lobe;
    use crate::shading::guided::Guided;
    use crate::shading::scatter::Scatter;
    use crate::test_statistics::ChiSquared;
    use firstlight_simd::{InstructionSet, dispatch};

    fn guide() -> Guide {
        // Two windows above a floor.
        let traces = (0..3000).map(|i| {
            let sampler = Sampler::new(4, 0, 0, i);
            let (at, from) = (sampler.pair(0), 0.2 * sampler.pair(1));
            let window = if i % 3 == 0 { Vec3::new(-1.0, 0.5, 0.0) } else { Vec3::new(0.8, 1.0, 0.3) };
            Trace { at: Vec3::new(at.x, 0.0, at.y), from: window + Vec3::new(from.x, 0.0, from.y) }
        });
        Guide::build(traces.collect())
    }

    /// The pdf integrates to one, and samples have the frequencies that it predicts.
    #[test]
    fn directions_follow_their_density() {
        let guide = guide();
        let matte = Lobe::Diffuse { albedo: Vec3::splat(0.5) };
        for (place, at) in [Vec3::new(0.3, 0.0, 0.4), Vec3::new(0.9, 0.0, 0.05)].into_iter().enumerate() {
            let hints = guide.at(at).expect("the middle of the floor is known");
            let guided = Guided { surface: &matte, hints };
            // Bins of equal solid angle: 24 in height, 24 in azimuth.
            let side = 24;
            let bin = |w: Vec3| {
                let around = (w.z.atan2(w.x) / std::f32::consts::TAU + 0.5) * side as f32;
                ((w.y * side as f32) as usize).min(side - 1) * side + (around as usize).min(side - 1)
            };
            let (n, fine) = (400_000, 40);
            let mut expected = vec![0.0_f64; side * side];
            let steps = side * fine;
            let mut whole = 0.0;
            for i in 0..2 * steps * steps {
                let y = ((i % (2 * steps)) as f32 + 0.5) / steps as f32 - 1.0;
                let phi =
                    ((i / (2 * steps)) as f32 + 0.5) / steps as f32 * std::f32::consts::TAU - std::f32::consts::PI;
                let r = (1.0 - y * y).sqrt();
                let w = Vec3::new(r * phi.cos(), y, r * phi.sin());
                let solid_angle = std::f64::consts::TAU / (steps * steps) as f64;
                let share = f64::from(guided.eval(Vec3::Y, w, Vec3::Y).1) * solid_angle;
                whole += share;
                // Directions below the surface are discarded.
                if y > 0.0 {
                    expected[bin(w)] += share;
                }
            }
            assert!((whole - 1.0).abs() < 5e-3, "place {place}: {whole}");
            let mut found = vec![0.0_f64; side * side];
            for i in 0..n {
                let sampler = Sampler::independent(9, place as u32, i, 0);
                if let Some(s) = guided.sample(Vec3::Y, Vec3::Y, || sampler.single(1), sampler.pair(0)) {
                    found[bin(s.wi)] += 1.0;
                }
            }
            let expected: Vec<f64> = expected.iter().map(|share| share * f64::from(n)).collect();
            // The fine sum is inaccurate by the steps at an edge, some per mille; 2.6 σ is 1 % over both positions.
            ChiSquared::of(&found, &expected, 3e-3).assert_below(2.6, &format!("place {place}"));
        }
    }

    /// Evaluates each position: whether it has a guiding distribution, and the pdf of a direction.
    #[inline(always)]
    fn ask<S: Simd>(s: S, guide: &Guide, asked: &[[Vec3; 2]], answers: &mut Vec<Option<f32>>) {
        for some in asked.chunks_exact(LANES) {
            let mut at = [[0.0; LANES]; 3];
            for (lane, [place, _]) in some.iter().enumerate() {
                (0..3).for_each(|axis| at[axis][lane] = place[axis]);
            }
            let leaves = guide.leaves_at(s, Mask::MAX, Vector::from_arrays(s, &at));
            for (leaf, [place, wi]) in leaves.into_iter().zip(some) {
                answers.push(guide.in_leaf(leaf, *place).map(|hints| hints.pdf_lanes(s, *wi)));
            }
        }
    }

    #[test]
    fn lanes_know_what_one_place_at_a_time_knows() {
        let guide = &guide();
        let asked: Vec<_> = (0..64 * LANES as u32)
            .map(|i| {
                let sampler = Sampler::new(6, 0, 0, i);
                let (at, to) = (sampler.pair(0), sampler.pair(1));
                let place = Vec3::new(1.2 * at.x - 0.1, 0.0, 1.2 * at.y - 0.1);
                // At and beside the windows.
                let window = if i % 2 == 0 { Vec3::new(-1.0, 0.5, 0.0) } else { Vec3::new(0.8, 1.0, 0.3) };
                let exit = window + 0.4 * Vec3::new(to.x - 0.25, 0.0, to.y - 0.25);
                [place, (exit - place).normalize()]
            })
            .collect();
        let asked = &asked[..];
        let one_by_one = asked.iter().map(|&[place, wi]| guide.at(place).map(|hints| hints.pdf(wi)));
        let one_by_one: Vec<_> = one_by_one.collect();
        for share in
            [one_by_one.iter().flatten().filter(|pdf| **pdf > 0.0).count(), one_by_one.iter().flatten().count()]
        {
            assert!(share > asked.len() / 8 && share < asked.len(), "{share} say little");
        }
        let ask_on = |set| {
            let mut found = Vec::new();
            let answers = &mut found;
            dispatch!(set, ask(guide: &Guide, asked: &[[Vec3; 2]], answers: &mut Vec<Option<f32>>));
            found
        };
        let expected = ask_on(InstructionSet::Portable);
        for set in InstructionSet::available() {
            assert!(ask_on(set) == expected, "{set:?}");
        }
        for (lanes, single) in expected.iter().zip(&one_by_one) {
            match (lanes, single) {
                (Some(lanes), Some(single)) => assert!((lanes - single).abs() <= 1e-5 * single, "{lanes} {single}"),
                (lanes, single) => assert_eq!(lanes.is_some(), single.is_some()),
            }
        }
    }

    #[test]
    fn nothing_is_known_far_away() {
        let guide = guide();
        assert!(guide.at(Vec3::new(9.0, 0.0, 9.0)).is_none());
        assert!(Guide::build(Vec::new()).at(Vec3::ZERO).is_none());
    }
}
