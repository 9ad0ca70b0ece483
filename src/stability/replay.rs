//! One ray of a case, told in full: for people a labelled line a value, for machines the same names and numbers.

use super::reference::CheckResult;
use crate::geometry::Ray;
use crate::kdtree::Hit;
use glam::Vec3;
use std::fmt;

/// What is known of one ray or sample, in the order in which it happened.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Replay {
    rows: Vec<(String, Told)>,
}

/// One value; numbers are written with as many digits as it takes to read back the same.
#[derive(Clone, Debug, PartialEq)]
pub enum Told {
    Text(String),
    Flag(bool),
    Count(u64),
    Single(f32),
    Double(f64),
    Vector(Vec3),
}

/// Why there is nothing to replay.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ReplayError {
    #[error("has no rays to replay")]
    NoRays,
    #[error("there is no stage {stage}, only 0 to {last}")]
    NoStage { stage: usize, last: usize },
    #[error("stage {stage} has no rays: single precision does not suffice at its position")]
    EmptyStage { stage: usize },
    #[error("stage {stage} has no ray {ray}, only 0 to {last}; more --rays make it larger")]
    NoRay { stage: usize, ray: u64, last: u64 },
}

impl Replay {
    pub(super) fn push(&mut self, label: &str, told: Told) {
        self.rows.push((label.to_owned(), told));
    }

    /// - `prefix`: of the labels.
    pub(super) fn push_ray(&mut self, prefix: &str, ray: &Ray) {
        self.push(&format!("{prefix}origin"), Told::Vector(ray.origin));
        self.push(&format!("{prefix}direction"), Told::Vector(ray.dir));
        self.push(&format!("{prefix}t_max"), Told::Single(ray.t_max));
    }

    pub(super) fn push_hit(&mut self, prefix: &str, hit: Option<&Hit>) {
        self.push(&format!("{prefix}hit"), Told::Flag(hit.is_some()));
        let Some(hit) = hit else { return };
        self.push(&format!("{prefix}t"), Told::Single(hit.t));
        self.push(&format!("{prefix}object"), Told::Count(hit.object.into()));
        self.push(&format!("{prefix}primitive"), Told::Count(hit.prim.into()));
        self.push(&format!("{prefix}u"), Told::Single(hit.u));
        self.push(&format!("{prefix}v"), Told::Single(hit.v));
    }

    pub(super) fn push_verdict(&mut self, verdict: CheckResult) {
        let (text, ratio) = match verdict {
            CheckResult::Right(ratio) => ("right", Some(ratio)),
            CheckResult::WrongT(ratio) => ("wrong t", Some(ratio)),
            CheckResult::Missed => ("missed", None),
        };
        self.push("result", Told::Text(text.to_owned()));
        if let Some(ratio) = ratio {
            self.push("error_of_bound", Told::Double(ratio));
        }
    }

    /// Labels and values in their order.
    pub fn rows(&self) -> impl Iterator<Item = (&str, &Told)> {
        self.rows.iter().map(|(label, told)| (label.as_str(), told))
    }

    /// The value of a label, if there is one.
    pub fn get(&self, label: &str) -> Option<&Told> {
        self.rows().find(|(known, _)| *known == label).map(|(_, told)| told)
    }
}

impl fmt::Display for Replay {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let width = self.rows.iter().map(|(label, _)| label.len()).max().unwrap_or(0);
        for (i, (label, told)) in self.rows.iter().enumerate() {
            let end = if i == 0 { "" } else { "\n" };
            write!(f, "{end}{label:width$}  {told}")?;
        }
        Ok(())
    }
}

impl fmt::Display for Told {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        // The debug form of a number is its shortest one, with an exponent where that is shorter, and keeps −0.
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

impl Told {
    /// For machines; what JSON has no number for is the word that people read.
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
            let told = Told::Single(f32::from_bits(bits));
            assert_eq!(told.to_string().parse::<f32>().unwrap().to_bits(), bits, "{told}");
            if let Some(number) = told.json().as_f64() {
                assert_eq!((number as f32).to_bits(), bits, "{told}");
            } else {
                assert_eq!(told.json(), "-inf");
            }
        }
        assert_eq!(Told::Vector(Vec3::new(-0.0, 1e-44, f32::INFINITY)).to_string(), "-0.0, 1e-44, inf");
    }
}
