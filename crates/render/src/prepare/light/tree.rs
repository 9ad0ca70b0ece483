//! A tree over many lights, for selecting one by its potential contribution to a point without evaluating all.
//!
//! Every node has a bounding sphere of its lights, a cone of their normals, and their power. From the root down, one of
//! two children is selected in proportion to a bound on its contribution: power over distance squared, times the
//! largest cosines at both ends (Conty Estevez and Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree
//! Splitting", without the splitting). `tree_build` builds it. Descending to a
//! given light gives the exact probability of its selection.

use firstlight_simd::{Real, Vector3, select};
use glam::Vec3;

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

impl LightTree {
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
        let tolerance = 16.0 * f32::EPSILON;
        let receiver = match normal {
            Some(normal) => (offset.dot(normal) + radius) * inv_distance + tolerance,
            None => radius.all(1.0),
        };
        let emitter = (radius - offset.dot(axis)) * inv_distance + widening + tolerance;
        let receiver = receiver.at_least(0.0).at_most(1.0);
        let mut emitter = emitter.at_least(0.0).at_most(1.0);
        if let Some(least_cos) = least_cos {
            // Over the positions in the sphere the cosine differs by at most a chord: √2 times radius over distance.
            let most_cos = (radius * 1.4143 - offset.dot(axis)) * inv_distance + widening + tolerance;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::delta_light::{Cone, Falloff};
    use crate::core::material_queries::Emission;
    use crate::core::techniques::Techniques;
    use crate::prepare::light::emitter::Light;
    use crate::prepare::light::shape::LightShape;
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
                        let cone = Cone::new(u.normalize(), outer * f64::from(b.x), outer, Falloff::Quadratic);
                        LightShape::Point { position: at, cone: Some(cone) }
                    }
                    _ => LightShape::Directional { to_light: (u + v).normalize(), reach: 8.0 },
                };
                let emission = Emission::even(Vec3::splat(radiance));
                Light {
                    shape,
                    emission,
                    mean_radiance: radiance,
                    is_point: false,
                    turned: None,
                    corners: None,
                    image: None,
                }
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
            let (id, pmf, found) = wide.sample(Mask::MAX, position, Some(normal), Float::load(s, &u));
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
        let cone = Cone::new(Vec3::NEG_Y, 0.1, 0.17, Falloff::Quadratic);
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
