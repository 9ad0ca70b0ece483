//! Animations at a given time: transforms and morph weights of nodes.
//!
//! All animations of a file are applied together; if two animate the same property of a node, the first one counts.
//!
//! Source: Khronos, "glTF 2.0 Specification", §3.11 and appendix C (animation sampler interpolation modes).

use crate::error::gltf::{GltfProblem, Located, item, place};
use crate::gltf::document::Document;
use crate::gltf::json;
use bytemuck::{bytes_of, cast_slice};
use firstlight_files::hash::Fingerprint;
use glam::{DQuat, DVec3};
use std::collections::{BTreeSet, HashMap};
use std::rc::Rc;

/// The animated transform of a node; `None`: as stored in the file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct NodePose {
    pub translation: Option<DVec3>,
    pub rotation: Option<DQuat>,
    pub scale: Option<DVec3>,
}

/// The animated state of all nodes.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Pose {
    nodes: HashMap<u32, NodePose>,
    /// Morph weights by node.
    weights: HashMap<u32, Vec<f64>>,
}

impl Pose {
    pub(crate) fn of(&self, node: u32) -> Option<&NodePose> {
        self.nodes.get(&node)
    }

    pub(crate) fn weights(&self, node: u32) -> Option<&[f64]> {
        self.weights.get(&node).map(Vec::as_slice)
    }
}

#[derive(Clone, Copy, PartialEq)]
enum SamplerInterpolation {
    Step,
    Linear,
    CubicSpline,
}

/// Of no keys if they cannot be read.
fn of_keys<const N: usize>(keys: Result<Vec<[f32; N]>, Located>) -> Fingerprint {
    Fingerprint::of(cast_slice(keys.unwrap_or_default().as_flattened()))
}

impl Document {
    /// The time at which the last animation ends, seconds; `None` without animations.
    pub(crate) fn animation_length(&self) -> Option<f64> {
        let samplers = self.root.animations.iter().flat_map(|animation| &animation.samplers);
        let inputs: BTreeSet<u32> = samplers.map(|sampler| sampler.input).collect();
        let ends = inputs.into_iter().filter_map(|input| self.floats::<1>(input).ok()?.last().copied());
        ends.map(|[end]| f64::from(end)).reduce(f64::max)
    }

    /// Of what all animations move, and of their keys.
    pub(crate) fn animation_fingerprint(&self) -> Fingerprint {
        let mut known = HashMap::new();
        let mut keys = |index: u32, n_numbers: usize| {
            *known.entry((index, n_numbers)).or_insert_with(|| match n_numbers {
                1 => of_keys(self.raw_floats::<1>(index)),
                3 => of_keys(self.raw_floats::<3>(index)),
                _ => of_keys(self.raw_floats::<4>(index)),
            })
        };
        let mut print = Fingerprint::of(b"");
        for animation in &self.root.animations {
            for json::Channel { sampler, target } in &animation.channels {
                let Some(sampler) = animation.samplers.get(*sampler as usize) else { continue };
                let what = format!("{:?} {} {:?}", target.node, target.path, sampler.interpolation);
                let n_numbers = match target.path.as_str() {
                    "weights" => 1,
                    "rotation" => 4,
                    _ => 3,
                };
                let keys = [keys(sampler.input, 1), keys(sampler.output, n_numbers)];
                print = keys.iter().fold(print.with(what.as_bytes()), |print, of| print.with(bytes_of(&of.0)));
            }
        }
        print
    }

    /// The pose of all nodes; without a time, the stored one. Broken channels are left out.
    ///
    /// - `at`: seconds; clamped to the range of the keys.
    pub(crate) fn pose(&self, at: Option<f64>) -> Pose {
        let mut pose = Pose::default();
        let Some(at) = at else { return pose };
        let mut keys = KeyLists::default();
        for (i, animation) in self.root.animations.iter().enumerate() {
            for (k, channel) in animation.channels.iter().enumerate() {
                let part = format!("{}.{}", place("animations", i), place("channels", k));
                self.omissions.kept(&part, self.add_channel(&mut pose, &mut keys, animation, channel, at));
            }
        }
        pose
    }

    fn add_channel(
        &self,
        pose: &mut Pose,
        keys: &mut KeyLists,
        animation: &json::Animation,
        channel: &json::Channel,
        at: f64,
    ) -> Result<(), Located> {
        let Some(node) = channel.target.node else { return Ok(()) };
        let here = |problem| (String::new(), problem);
        let sampler = item(&animation.samplers, "samplers", channel.sampler).map_err(here)?;
        self.node(node)?;
        let interpolation = match sampler.interpolation.as_deref() {
            None | Some("LINEAR") => SamplerInterpolation::Linear,
            Some("STEP") => SamplerInterpolation::Step,
            Some("CUBICSPLINE") => SamplerInterpolation::CubicSpline,
            Some(other) => {
                let (found, expected) = (other.to_owned(), "STEP, LINEAR or CUBICSPLINE");
                return Err(here(GltfProblem::Value { what: "interpolation", found, expected }));
            }
        };
        let times = keys.one.of(self, sampler.input)?;
        if times.is_empty() {
            return Ok(());
        }
        let output = sampler.output;
        let posed = pose.nodes.get(&node).copied().unwrap_or_default();
        let mut three = || {
            let value = sampled(&times, &keys.three.of(self, output)?, 1, interpolation, at, false).map_err(here)?;
            Ok(value.first().map_or(DVec3::ZERO, |&v| DVec3::from(v)))
        };
        match channel.target.path.as_str() {
            "translation" if posed.translation.is_none() => {
                let value = three()?;
                pose.nodes.entry(node).or_default().translation = Some(value);
            }
            "scale" if posed.scale.is_none() => {
                let value = three()?;
                pose.nodes.entry(node).or_default().scale = Some(value);
            }
            "rotation" if posed.rotation.is_none() => {
                let values = keys.four.of(self, output)?;
                let value = sampled(&times, &values, 1, interpolation, at, true).map_err(here)?;
                pose.nodes.entry(node).or_default().rotation = value.first().map(|&v| DQuat::from_array(v));
            }
            "weights" if !pose.weights.contains_key(&node) => {
                let values = keys.one.of(self, output)?;
                let n = times.len() * if interpolation == SamplerInterpolation::CubicSpline { 3 } else { 1 };
                let value = sampled(&times, &values, values.len() / n, interpolation, at, false).map_err(here)?;
                pose.weights.insert(node, value.into_iter().map(|[w]| w).collect());
            }
            // A later animation of the same property, or a path that belongs to an extension.
            _ => {}
        }
        Ok(())
    }

    /// Whether animations move each node, or one that it hangs from. Joints of skins are not looked at.
    pub(crate) fn moved_nodes(&self) -> Vec<bool> {
        let pose = self.pose(Some(0.0));
        let nodes = &self.root.nodes;
        let mut moved: Vec<bool> = (0..nodes.len() as u32).map(|node| pose.of(node).is_some()).collect();
        let mut todo: Vec<u32> = (0..nodes.len() as u32).filter(|&node| moved[node as usize]).collect();
        while let Some(node) = todo.pop() {
            for &child in &nodes[node as usize].children {
                if let Some(moved) = moved.get_mut(child as usize).filter(|moved| !**moved) {
                    *moved = true;
                    todo.push(child);
                }
            }
        }
        moved
    }
}

/// AccessorLists of keys that were read for a pose: many channels may use one.
#[derive(Default)]
struct KeyLists {
    one: AccessorLists<1>,
    three: AccessorLists<3>,
    four: AccessorLists<4>,
}

#[derive(Default)]
struct AccessorLists<const N: usize>(HashMap<u32, Rc<[[f32; N]]>>);

impl<const N: usize> AccessorLists<N> {
    fn of(&mut self, document: &Document, accessor: u32) -> Result<Rc<[[f32; N]]>, Located> {
        if let Some(known) = self.0.get(&accessor) {
            return Ok(known.clone());
        }
        let list: Rc<[[f32; N]]> = document.floats(accessor)?.into();
        self.0.insert(accessor, list.clone());
        Ok(list)
    }
}

/// The values at a time, `group` of them.
///
/// - `turns`: whether they are rotations.
fn sampled<const N: usize>(
    times: &[[f32; 1]],
    values: &[[f32; N]],
    group: usize,
    how: SamplerInterpolation,
    at: f64,
    turns: bool,
) -> Result<Vec<[f64; N]>, GltfProblem> {
    let parts = if how == SamplerInterpolation::CubicSpline { 3 } else { 1 };
    let expected = times.len() * group * parts;
    if values.len() != expected || group == 0 {
        let (what, found) = ("the output of its sampler".to_owned(), values.len() as u64);
        return Err(GltfProblem::Length { what, found, expected: expected.max(times.len() * parts) as u64 });
    }
    // Parts of a spline key: 0 incoming tangent, 1 value, 2 outgoing tangent.
    let value = |key: usize, part: usize, i: usize| values[(key * parts + part) * group + i].map(f64::from);
    let time = |key: usize| f64::from(times[key][0]);
    let middle = parts / 2;
    let next = times.partition_point(|&[t]| f64::from(t) <= at);
    if next == 0 || next == times.len() {
        let key = next.saturating_sub(1);
        return Ok((0..group).map(|i| value(key, middle, i)).collect());
    }
    let (a, b) = (next - 1, next);
    let span = time(b) - time(a);
    let t = if span > 0.0 { (at - time(a)) / span } else { 0.0 };
    let mix = |i: usize| -> [f64; N] {
        let (p, q) = (value(a, middle, i), value(b, middle, i));
        match how {
            SamplerInterpolation::Step => p,
            SamplerInterpolation::Linear if turns && N == 4 => slerp(p, q, t),
            SamplerInterpolation::Linear => std::array::from_fn(|k| p[k] + t * (q[k] - p[k])),
            SamplerInterpolation::CubicSpline => {
                let (out, into) = (value(a, 2, i), value(b, 0, i));
                let (t2, t3) = (t * t, t * t * t);
                std::array::from_fn(|k| {
                    (2.0 * t3 - 3.0 * t2 + 1.0) * p[k]
                        + span * (t3 - 2.0 * t2 + t) * out[k]
                        + (3.0 * t2 - 2.0 * t3) * q[k]
                        + span * (t3 - t2) * into[k]
                })
            }
        }
    };
    Ok((0..group).map(mix).collect())
}

/// Spherical linear interpolation along the shorter arc; `N` must be 4.
fn slerp<const N: usize>(p: [f64; N], q: [f64; N], t: f64) -> [f64; N] {
    let four = |v: [f64; N]| DQuat::from_xyzw(v[0], v[1], v[2], v[3]);
    let (p, q) = (four(p), four(q));
    let (from, to) = (p.length(), q.length());
    if !(from > 0.0 && to > 0.0) {
        let stays = p.to_array();
        return std::array::from_fn(|k| stays[k]);
    }
    let (p, q) = (p / from, q / to);
    let mut cos = p.dot(q);
    let q = if cos < 0.0 { -q } else { q };
    cos = cos.abs().min(1.0);
    let angle = cos.acos();
    let sin = angle.sin();
    // For small angles, the arc is nearly straight.
    let (a, b) = if sin < 1e-9 { (1.0 - t, t) } else { (((1.0 - t) * angle).sin() / sin, (t * angle).sin() / sin) };
    let mixed = (p * a + q * b).to_array();
    std::array::from_fn(|k| mixed[k])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(how: SamplerInterpolation, values: &[[f32; 1]], t: f64) -> f64 {
        sampled(&[[1.0], [3.0]], values, 1, how, t, false).ok().unwrap()[0][0]
    }

    #[test]
    fn keys_hold_before_and_after_and_are_mixed_between() {
        let values = [[10.0], [20.0]];
        for (t, linear, step) in
            [(0.0, 10.0, 10.0), (1.0, 10.0, 10.0), (1.5, 12.5, 10.0), (3.0, 20.0, 20.0), (9.0, 20.0, 20.0)]
        {
            assert_eq!(at(SamplerInterpolation::Linear, &values, t), linear);
            assert_eq!(at(SamplerInterpolation::Step, &values, t), step);
        }
        assert!(sampled(&[[1.0], [3.0]], &values[..1], 1, SamplerInterpolation::Step, 2.0, false).is_err());
    }

    #[test]
    fn splines_follow_any_cubic() {
        // f = t³ with its exact derivatives at the keys 1 and 3.
        let f = |t: f64| t * t * t;
        let values = [[3.0], [1.0], [3.0], [27.0], [27.0], [27.0]];
        for t in [1.0, 1.2, 2.0, 2.9, 3.0] {
            assert!((at(SamplerInterpolation::CubicSpline, &values, t) - f(t)).abs() < 1e-12, "{t}");
        }
    }

    #[test]
    fn turns_take_the_shorter_way_at_an_even_pace() {
        let turn = |angle: f64| DQuat::from_rotation_y(angle);
        let values = [turn(0.2), -turn(1.4)].map(|turn| turn.to_array().map(|part| part as f32));
        for t in [0.0, 0.25, 0.7] {
            let found = sampled(&[[0.0], [1.0]], &values, 1, SamplerInterpolation::Linear, t, true).ok().unwrap()[0];
            let angle = DQuat::from_array(found).angle_between(turn(0.2 + 1.2 * t));
            assert!(angle < 1e-6, "{t}: {angle}");
        }
    }
}
