//! Full description of one ray of a case: labelled lines for people, the same names and numbers for machines.

use crate::geometry::Ray;
use crate::kdtree::Hit;
use crate::stability::reference::CheckResult;
use glam::Vec3;
use std::fmt;

/// Everything known about one ray or sample, in chronological order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Replay {
    rows: Vec<(String, ReplayValue)>,
}

/// One value; numbers are written with enough digits to be read back exactly.
#[derive(Clone, Debug, PartialEq)]
pub enum ReplayValue {
    Text(String),
    Flag(bool),
    Count(u64),
    Single(f32),
    Double(f64),
    Vector(Vec3),
}

/// Reasons why there is nothing to replay.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ReplayError {
    #[error("has no rays to replay")]
    NoRays,
    #[error("there is no test scene {test_scene}, only 0 to {last}")]
    NoScene { test_scene: usize, last: usize },
    #[error("test scene {test_scene} has no rays: single precision does not suffice at its position")]
    EmptyScene { test_scene: usize },
    #[error("test scene {test_scene} has no ray {ray}, only 0 to {last}; more --rays make it larger")]
    NoRay { test_scene: usize, ray: u64, last: u64 },
}

impl Replay {
    pub(super) fn push(&mut self, label: &str, value: ReplayValue) {
        self.rows.push((label.to_owned(), value));
    }

    /// Adds a ray.
    ///
    /// - `prefix`: of the labels.
    pub(super) fn push_ray(&mut self, prefix: &str, ray: &Ray) {
        self.push(&format!("{prefix}origin"), ReplayValue::Vector(ray.origin));
        self.push(&format!("{prefix}direction"), ReplayValue::Vector(ray.dir));
        self.push(&format!("{prefix}t_max"), ReplayValue::Single(ray.t_max));
    }

    pub(super) fn push_hit(&mut self, prefix: &str, hit: Option<&Hit>) {
        self.push(&format!("{prefix}hit"), ReplayValue::Flag(hit.is_some()));
        let Some(hit) = hit else { return };
        self.push(&format!("{prefix}t"), ReplayValue::Single(hit.t));
        self.push(&format!("{prefix}object"), ReplayValue::Count(hit.object.into()));
        self.push(&format!("{prefix}primitive"), ReplayValue::Count(hit.prim.into()));
        self.push(&format!("{prefix}u"), ReplayValue::Single(hit.u));
        self.push(&format!("{prefix}v"), ReplayValue::Single(hit.v));
    }

    pub(super) fn push_check(&mut self, check: CheckResult) {
        let (text, ratio) = match check {
            CheckResult::Right(ratio) => ("right", Some(ratio)),
            CheckResult::WrongT(ratio) => ("wrong t", Some(ratio)),
            CheckResult::Missed => ("missed", None),
        };
        self.push("result", ReplayValue::Text(text.to_owned()));
        if let Some(ratio) = ratio {
            self.push("error_of_bound", ReplayValue::Double(ratio));
        }
    }

    /// Iterates over labels and values in order.
    pub fn rows(&self) -> impl Iterator<Item = (&str, &ReplayValue)> {
        self.rows.iter().map(|(label, value)| (label.as_str(), value))
    }

    /// The value of a label, if present.
    pub fn get(&self, label: &str) -> Option<&ReplayValue> {
        self.rows().find(|(known, _)| *known == label).map(|(_, value)| value)
    }
}

impl fmt::Display for Replay {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let width = self.rows.iter().map(|(label, _)| label.len()).max().unwrap_or(0);
        for (i, (label, value)) in self.rows.iter().enumerate() {
            let end = if i == 0 { "" } else { "\n" };
            write!(f, "{end}{label:width$}  {value}")?;
        }
        Ok(())
    }
}

impl fmt::Display for ReplayValue {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        // The debug form of a number is its shortest one, with an exponent if that is shorter, and keeps −0.
        match self {
            Self::Text(text) => f.write_str(text),
            Self::Flag(flag) => f.write_str(if *flag { "yes" } else { "no" }),
            Self::Count(count) => write!(f, "{count}"),
            Self::Single(x) => write!(f, "{x:?}"),
            Self::Double(x) => write!(f, "{x:?}"),
            Self::Vector(v) => write!(f, "{:?}, {:?}, {:?}", v.x, v.y, v.z),
        }
    }
}

impl ReplayValue {
    /// The JSON form; values that JSON cannot represent as numbers are text.
    pub fn json(&self) -> serde_json::Value {
        let number = |x: f64| match serde_json::Number::from_f64(x) {
            Some(number) => number.into(),
            None => format!("{x:?}").into(),
        };
        match self {
            Self::Text(text) => text.clone().into(),
            Self::Flag(flag) => (*flag).into(),
            Self::Count(count) => (*count).into(),
            Self::Single(x) => number(f64::from(*x)),
            Self::Double(x) => number(*x),
            Self::Vector(v) => v.to_array().map(|x| number(f64::from(x))).to_vec().into(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_back_to_the_last_bit_in_both_forms() {
        for bits in [1, 0x8000_0000, 0x0080_0001, 0x3dcc_cccd, 0x7f7f_ffff, 0xff80_0000, 0x4b7f_ffff_u32] {
            let value = ReplayValue::Single(f32::from_bits(bits));
            assert_eq!(value.to_string().parse::<f32>().unwrap().to_bits(), bits, "{value}");
            if let Some(number) = value.json().as_f64() {
                assert_eq!((number as f32).to_bits(), bits, "{value}");
            } else {
                assert_eq!(value.json(), "-inf");
            }
        }
        assert_eq!(ReplayValue::Vector(Vec3::new(-0.0, 1e-44, f32::INFINITY)).to_string(), "-0.0, 1e-44, inf");
    }
}
