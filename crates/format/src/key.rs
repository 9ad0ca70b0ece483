//! Keys and the interpolation between them.
//!
//! Source of the smooth curves: Catmull and Rom 1974, for non-uniform times, with the slopes of the parabola through
//! three keys; limited as by Hyman 1983 if a curve must stay within the range of its keys. Source of smooth rotations:
//! Shoemake 1985, Bézier curves of quaternions, with slopes found in the same way.

use crate::quantity::Quantity;
use glam::{DMat3, DQuat, DVec3, EulerRot};
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

/// Interpolation between two keys.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Interpolation {
    /// Linear; rotations about more than one axis take the shorter arc at constant angular velocity.
    #[default]
    Linear,
    /// A curve with continuous derivative.
    Smooth,
    /// The value of the earlier key.
    Held,
}

impl Interpolation {
    /// Name in scene files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Smooth => "smooth",
            Self::Held => "held",
        }
    }
}

/// The value of a key.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum KeyValue {
    /// A number; stands for three equal numbers.
    Number(f64),
    /// Three numbers: coordinates, degrees, factors or colour channels.
    Three(DVec3),
}

impl KeyValue {
    /// The three numbers.
    pub fn three(self) -> DVec3 {
        match self {
            Self::Number(number) => DVec3::splat(number),
            Self::Three(three) => three,
        }
    }
}

/// Time in seconds, and value.
pub type Key = (f64, KeyValue);

/// A property over time. It is constant before the first key and after the last one.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// Interpolation between the keys.
    pub interpolation: Interpolation,
    /// In ascending order of time, without duplicate times; not empty.
    pub keys: Vec<Key>,
}

/// Position of a time relative to the keys.
enum KeyPlace {
    /// At a key, or outside of all keys.
    At(usize),
    /// Between key `i` and the next one, at a fraction in (0, 1).
    Between(usize, f64),
}

impl Curve {
    fn time(&self, key: usize) -> f64 {
        self.keys[key].0
    }

    fn value(&self, key: usize) -> DVec3 {
        self.keys[key].1.three()
    }

    /// Seconds from a key to the next one.
    fn span(&self, key: usize) -> f64 {
        self.time(key + 1) - self.time(key)
    }

    fn place(&self, seconds: f64) -> KeyPlace {
        let next = self.keys.partition_point(|&(time, _)| time <= seconds);
        let Some(before) = next.checked_sub(1) else { return KeyPlace::At(0) };
        if next == self.keys.len() || self.time(before) == seconds {
            return KeyPlace::At(before);
        }
        KeyPlace::Between(before, (seconds - self.time(before)) / self.span(before))
    }

    /// The value at a time; a single number is returned three times. The values at keys are exact.
    ///
    /// - `quantity`: determines how values are interpolated.
    pub fn at(&self, quantity: Quantity, seconds: f64) -> DVec3 {
        let (key, share) = match self.place(seconds) {
            KeyPlace::At(key) => return self.value(key),
            KeyPlace::Between(key, share) => (key, share),
        };
        if self.rests(key) {
            return self.value(key);
        }
        if quantity == Quantity::Rotation && self.turns_freely() {
            return self.turned(key, share);
        }
        let (a, b) = (self.value(key), self.value(key + 1));
        match self.interpolation {
            Interpolation::Held => a,
            Interpolation::Linear => a + share * (b - a),
            Interpolation::Smooth => {
                let span = self.span(key);
                let (out, into) = (self.slope(quantity, key, key), self.slope(quantity, key + 1, key));
                let (t, t2, t3) = (share, share * share, share * share * share);
                let mixed = a + (3.0 * t2 - 2.0 * t3) * (b - a) + span * ((t3 - 2.0 * t2 + t) * out + (t3 - t2) * into);
                // Rounding may exceed the range of the keys.
                if quantity.is_limited() { mixed.clamp(a.min(b), a.max(b)) } else { mixed }
            }
        }
    }

    /// Rate of change from a key to the next one, per second.
    fn chord(&self, key: usize) -> DVec3 {
        (self.value(key + 1) - self.value(key)) / self.span(key)
    }

    /// The slope of a smooth curve at a key, per second, for the segment that begins at key `from`.
    fn slope(&self, quantity: Quantity, key: usize, from: usize) -> DVec3 {
        let slope = slope(self.keys.len(), key, &|i| self.span(i), &|i| self.chord(i));
        if !quantity.is_limited() {
            return slope;
        }
        // A slope of at most three times the chord on either side keeps a curve monotone (Hyman 1983; Fritsch and
        // Carlson 1980).
        let chords = [key.checked_sub(1), (key + 1 < self.keys.len()).then_some(key)];
        let mut limited = slope;
        for chord in chords.into_iter().flatten().map(|i| self.chord(i)) {
            for axis in 0..3 {
                let (least, most) = if chord[axis] > 0.0 { (0.0, 3.0 * chord[axis]) } else { (3.0 * chord[axis], 0.0) };
                limited[axis] = limited[axis].clamp(least, most);
            }
        }
        debug_assert!(from == key || from + 1 == key);
        limited
    }

    /// Whether a rotation changes in more than one of its three angles, so that it needs quaternions.
    fn turns_freely(&self) -> bool {
        let first = self.value(0);
        let changes = |axis: usize| self.keys.iter().any(|(_, value)| value.three()[axis] != first[axis]);
        (0..3).filter(|&axis| changes(axis)).count() > 1
    }

    /// The interpolated rotation between a key and the next one: degrees about X, then Y, then Z.
    fn turned(&self, key: usize, share: f64) -> DVec3 {
        let turn = |i: usize| quaternion(self.value(i));
        let (a, b) = (turn(key), turn(key + 1));
        match self.interpolation {
            Interpolation::Held => self.value(key),
            Interpolation::Linear => degrees(slerp(a, b, share)),
            Interpolation::Smooth => {
                let chord = |i: usize| way(turn(i), turn(i + 1)) / self.span(i);
                let slope = |i: usize| slope(self.keys.len(), i, &|i| self.span(i), &chord);
                let third = self.span(key) / 3.0;
                let out = a * DQuat::from_scaled_axis(slope(key) * third);
                let into = b * DQuat::from_scaled_axis(-slope(key + 1) * third);
                let [ab, bc, cd] = [(a, out), (out, into), (into, b)].map(|(p, q)| slerp(p, q, share));
                degrees(slerp(slerp(ab, bc, share), slerp(bc, cd, share), share))
            }
        }
    }

    /// Whether the curve is constant from a key to the next one; slopes depend on the neighbours.
    fn rests(&self, key: usize) -> bool {
        let reach = usize::from(self.interpolation == Interpolation::Smooth);
        let last = self.keys.len() - 2;
        (key.saturating_sub(reach)..=(key + reach).min(last)).all(|i| self.value(i) == self.value(i + 1))
    }

    /// Whether the value may change within this range of seconds; never false if it does.
    pub fn is_moving_during(&self, seconds: &RangeInclusive<f64>) -> bool {
        let (start, end) = (*seconds.start(), *seconds.end());
        (0..self.keys.len().saturating_sub(1)).any(|i| {
            let is_within = match self.interpolation {
                Interpolation::Held => start < self.time(i + 1) && self.time(i + 1) <= end,
                _ => start < self.time(i + 1) && self.time(i) < end,
            };
            is_within && !self.rests(i)
        })
    }
}

/// The slope at a key: of the parabola through it and its neighbours; at an end, through the three nearest keys; for
/// two keys, of the line.
///
/// - `span`, `chord`: seconds from a key to the next one, and the change per second.
fn slope(n: usize, key: usize, span: &dyn Fn(usize) -> f64, chord: &dyn Fn(usize) -> DVec3) -> DVec3 {
    let inner = |i: usize| {
        let (before, after) = (span(i - 1), span(i));
        (chord(i - 1) * after + chord(i) * before) / (before + after)
    };
    match (key, n) {
        (_, 0..=1) => DVec3::ZERO,
        (_, 2) => chord(0),
        // The mean of the slopes at both ends of a parabola is the slope of its chord.
        (0, _) => 2.0 * chord(0) - inner(1),
        _ if key + 1 == n => 2.0 * chord(n - 2) - inner(n - 2),
        _ => inner(key),
    }
}

fn quaternion(degrees: DVec3) -> DQuat {
    let DVec3 { x, y, z } = degrees.map(|angle| (angle % 360.0).to_radians());
    DQuat::from_euler(EulerRot::ZYX, z, y, x)
}

/// The shorter rotation from one orientation to another: axis times radians, in the frame of either.
fn way(from: DQuat, to: DQuat) -> DVec3 {
    let turn = from.conjugate() * to;
    let turn = if turn.w < 0.0 { -turn } else { turn };
    turn.normalize().to_scaled_axis()
}

fn slerp(from: DQuat, to: DQuat, share: f64) -> DQuat {
    from * DQuat::from_scaled_axis(share * way(from, to))
}

/// Euler angles of a rotation, degrees about X, then Y, then Z; accurate even if the angle about Y is near 90 degrees.
fn degrees(turn: DQuat) -> DVec3 {
    let m = DMat3::from_quat(turn.normalize());
    let y = (-m.x_axis.z).atan2(m.x_axis.x.hypot(m.x_axis.y));
    let x = if m.y_axis.z == 0.0 && m.z_axis.z == 0.0 { 0.0 } else { m.y_axis.z.atan2(m.z_axis.z) };
    let (sin, cos) = x.sin_cos();
    // The rotation that remains after those about X and Y.
    let (z_sin, z_cos) = (sin * m.z_axis.x - cos * m.y_axis.x, cos * m.y_axis.y - sin * m.z_axis.y);
    DVec3::new(x, y, z_sin.atan2(z_cos)).map(f64::to_degrees)
}

impl Quantity {
    /// The value of a key: a single number where the quantity allows it and all three are equal.
    pub fn key_value(self, value: DVec3) -> KeyValue {
        let is_even = value.x == value.y && value.y == value.z;
        match self {
            Self::Number => KeyValue::Number(value.x),
            Self::Factors | Self::Color if is_even => KeyValue::Number(value.x),
            _ => KeyValue::Three(value),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(interpolation: Interpolation, values: &[(f64, DVec3)]) -> Curve {
        Curve { interpolation, keys: values.iter().map(|&(time, value)| (time, KeyValue::Three(value))).collect() }
    }

    fn numbers(interpolation: Interpolation, values: &[(f64, f64)]) -> Curve {
        Curve { interpolation, keys: values.iter().map(|&(time, value)| (time, KeyValue::Number(value))).collect() }
    }

    const UNEVEN: [f64; 5] = [0.5, 1.0, 1.25, 3.0, 7.0];

    #[test]
    fn keys_come_back_to_the_last_bit_and_hold_outside() {
        let values = [0.1, 7.3, -2.0, 1e-9, 5.5];
        for how in [Interpolation::Linear, Interpolation::Smooth, Interpolation::Held] {
            let pairs: Vec<_> = UNEVEN.into_iter().zip(values).collect();
            let track = numbers(how, &pairs);
            for quantity in [Quantity::Number, Quantity::Position] {
                for &(time, value) in &pairs {
                    assert_eq!(track.at(quantity, time).x, value, "{how:?} {time}");
                }
                assert_eq!((track.at(quantity, -9.0).x, track.at(quantity, 99.0).x), (0.1, 5.5));
            }
        }
        let held = numbers(Interpolation::Held, &[(0.0, 1.0), (2.0, 5.0)]);
        assert_eq!((held.at(Quantity::Number, 1.999).x, held.at(Quantity::Number, 2.0).x), (1.0, 5.0));
        let linear = numbers(Interpolation::Linear, &[(1.0, 10.0), (3.0, 20.0)]);
        assert_eq!(linear.at(Quantity::Number, 1.5).x, 12.5);
    }

    #[test]
    fn smooth_positions_follow_any_parabola_at_uneven_times() {
        let path = |t: f64| DVec3::new(3.0 - 2.0 * t + 0.5 * t * t, t * t, 1.0 - t);
        let track = curve(Interpolation::Smooth, &UNEVEN.map(|t| (t, path(t))));
        for i in 0..=650 {
            let t = 0.5 + 0.01 * f64::from(i);
            let error = (track.at(Quantity::Position, t) - path(t)).length();
            assert!(error < 1e-12, "{t}: {error}");
        }
    }

    #[test]
    fn smooth_curves_have_no_kink() {
        let values = [0.1, 7.3, -2.0, 1e-9, 5.5];
        let pairs: Vec<_> = UNEVEN.into_iter().zip(values).collect();
        let track = numbers(Interpolation::Smooth, &pairs);
        for quantity in [Quantity::Number, Quantity::Position] {
            for &time in &UNEVEN[1..4] {
                let h = 1e-6;
                let slope = |a: f64, b: f64| (track.at(quantity, b) - track.at(quantity, a)).x / (b - a);
                let (before, after) = (slope(time - h, time), slope(time, time + h));
                assert!((before - after).abs() < 1e-3, "{quantity:?} {time}: {before} {after}");
            }
        }
    }

    #[test]
    fn smooth_numbers_stay_between_their_keys_and_follow_lines() {
        let pairs = [(0.0, 0.0), (1.0, 1.0), (2.0, 1.0), (2.1, 0.2), (4.0, 0.3), (5.0, 0.0)];
        let track = numbers(Interpolation::Smooth, &pairs);
        for pair in pairs.windows(2) {
            let [(start, a), (end, b)] = [pair[0], pair[1]];
            let mut last = a;
            for i in 0..=200 {
                let value = track.at(Quantity::Number, start + (end - start) * f64::from(i) / 200.0).x;
                assert!((a.min(b)..=a.max(b)).contains(&value), "{value} is not in {a}..{b}");
                assert!((value - last) * (b - a) >= -1e-15, "not monotone");
                last = value;
            }
        }
        let line = numbers(Interpolation::Smooth, &UNEVEN.map(|t| (t, 3.0 * t - 1.0)));
        assert!((line.at(Quantity::Number, 2.2).x - 5.6).abs() < 1e-14);
    }

    fn angle_between(a: DVec3, b: DVec3) -> f64 {
        way(quaternion(a), quaternion(b)).length().to_degrees()
    }

    #[test]
    fn turns_about_one_axis_count_degrees_of_any_number() {
        let track = curve(Interpolation::Linear, &[(0.0, DVec3::ZERO), (2.0, DVec3::new(0.0, 720.0, 0.0))]);
        assert_eq!(track.at(Quantity::Rotation, 0.5), DVec3::new(0.0, 180.0, 0.0));
    }

    #[test]
    fn free_turns_take_the_shorter_arc_at_an_even_pace() {
        let (a, b) = (DVec3::new(10.0, 20.0, -30.0), DVec3::new(-60.0, 75.0, 170.0));
        let track = curve(Interpolation::Linear, &[(1.0, a), (3.0, b)]);
        let whole = angle_between(a, b);
        assert!(whole < 180.0);
        for i in 1..10 {
            let share = f64::from(i) / 10.0;
            let now = track.at(Quantity::Rotation, 1.0 + 2.0 * share);
            let (done, left) = (angle_between(a, now), angle_between(now, b));
            assert!((done - share * whole).abs() < 1e-9 && (left - (1.0 - share) * whole).abs() < 1e-9, "{share}");
        }
    }

    #[test]
    fn smooth_turns_follow_an_even_turn_about_any_axis_and_have_no_kink() {
        // A rotation about an oblique axis at constant speed, with non-uniform keys.
        let axis = DVec3::new(1.0, 2.0, -0.5).normalize();
        let turn = |t: f64| degrees(DQuat::from_axis_angle(axis, 0.4 * t));
        let track = curve(Interpolation::Smooth, &UNEVEN.map(|t| (t, turn(t))));
        for i in 1..65 {
            let t = 0.5 + 0.1 * f64::from(i);
            let error = angle_between(track.at(Quantity::Rotation, t), turn(t));
            assert!(error < 1e-6, "{t}: {error}");
        }
        let wild = [DVec3::ZERO, DVec3::new(50.0, 0.0, 10.0), DVec3::new(0.0, 80.0, 0.0), DVec3::new(-70.0, 5.0, 90.0)];
        let keys: Vec<_> = UNEVEN.into_iter().zip(wild).collect();
        let track = curve(Interpolation::Smooth, &keys);
        for &time in &UNEVEN[1..3] {
            let h = 1e-5;
            let at = |t: f64| quaternion(track.at(Quantity::Rotation, t));
            let (before, after) = (way(at(time - h), at(time)) / h, way(at(time), at(time + h)) / h);
            assert!((before - after).length() < 1e-3, "{time}: {before} {after}");
        }
    }

    #[test]
    fn turns_come_back_from_quaternions_at_right_angles_too() {
        for x in [-170.0, -90.0, 0.0, 30.0, 180.0] {
            for y in [-90.0, -89.999_999, -20.0, 0.0, 45.0, 90.0] {
                for z in [-120.0, 0.0, 90.0, 179.0] {
                    let given = quaternion(DVec3::new(x, y, z));
                    let error = way(given, quaternion(degrees(given))).length();
                    assert!(error < 1e-7, "({x}, {y}, {z}): {error}");
                }
            }
        }
    }

    #[test]
    fn what_stands_still_is_told_from_what_moves() {
        let keys = [(0.0, 1.0), (1.0, 1.0), (2.0, 3.0), (4.0, 3.0)];
        let linear = numbers(Interpolation::Linear, &keys);
        let moves = |track: &Curve, start: f64, end: f64| track.is_moving_during(&(start..=end));
        assert!(!moves(&linear, 0.0, 1.0) && !moves(&linear, 2.0, 9.0) && !moves(&linear, -5.0, 0.5));
        assert!(moves(&linear, 0.9, 1.1) && moves(&linear, 1.4, 1.5));
        let held = numbers(Interpolation::Held, &keys);
        assert!(!moves(&held, 1.2, 1.9) && moves(&held, 1.9, 2.0) && !moves(&held, 2.0, 5.0));
        // A curve reported as not moving must be constant, for every quantity.
        for how in [Interpolation::Linear, Interpolation::Smooth, Interpolation::Held] {
            let track = numbers(how, &keys);
            for i in -4..45 {
                let (start, end) = (0.1 * f64::from(i), 0.1 * f64::from(i) + 0.25);
                if moves(&track, start, end) {
                    continue;
                }
                for quantity in [Quantity::Number, Quantity::Position, Quantity::Rotation] {
                    let first = track.at(quantity, start);
                    assert!(
                        (0..=20).all(|k| track.at(quantity, start + 0.0125 * f64::from(k)) == first),
                        "{how:?} {start}"
                    );
                }
            }
        }
    }

    #[test]
    fn values_are_single_numbers_where_that_says_all() {
        assert_eq!(Quantity::Color.key_value(DVec3::splat(0.5)), KeyValue::Number(0.5));
        assert_eq!(Quantity::Color.key_value(DVec3::X), KeyValue::Three(DVec3::X));
        assert_eq!(Quantity::Position.key_value(DVec3::ONE), KeyValue::Three(DVec3::ONE));
    }
}
