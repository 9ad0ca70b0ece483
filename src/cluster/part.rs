//! A part of a whole: its number, where that comes from, and which samples, tiles or frames it has.
//!
//! Samples are divided so that the films of all parts add up to the very film of one go, its error estimate included.
//! The estimate looks at the image at powers of two, so all of them beyond the first part are ends of parts; in between,
//! parts are as equal as whole numbers allow. A power of two as the number of samples divides best.

use std::collections::BinaryHeap;
use std::ops::Range;

/// One part of `count`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// From 0, below `count`.
    pub index: u32,
    /// How many parts there are, at least 1.
    pub count: u32,
}

/// Why there is no such part.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PartError {
    /// The words are neither a part nor `auto`.
    #[error("expected I/N, such as 3/64 for the third of 64 parts, or auto")]
    Syntax,
    /// The number is not one of 1 to the number of parts.
    #[error("there is no part {number} of {count}: parts are numbered from 1 to {count}")]
    Range {
        /// As it was given.
        number: u64,
        /// Of the parts.
        count: u64,
    },
    /// There are more parts than anything is divided into.
    #[error("{0} parts: use at most {most}", most = Part::MOST)]
    Many(u64),
    /// No variable tells the part.
    #[error(
        "auto needs an engine that numbers its tasks: none of FIRSTLIGHT_PART, SLURM_ARRAY_TASK_ID and \
         JOB_COMPLETION_INDEX is set"
    )]
    NoNumber,
    /// No variable tells how many parts there are.
    #[error("auto knows the number of this part, but not how many there are: set FIRSTLIGHT_PARTS")]
    NoCount,
    /// A variable does not hold a number.
    #[error("auto: the variable {name} is `{value}`, but must be a whole number")]
    Variable {
        /// Of the variable.
        name: &'static str,
        /// What it holds.
        value: String,
    },
    /// There is less than one thing for each part.
    #[error("{count} parts of {n} {what}: use at most {n} parts")]
    TooMany {
        /// Of the parts.
        count: u32,
        /// Things that there are.
        n: u64,
        /// Samples, tiles or frames.
        what: &'static str,
    },
}

impl Part {
    /// The largest number of parts: the samples of all of them are listed to find those of one.
    pub const MOST: u32 = 1_000_000;

    /// The part that `text` names, as `3/64`, or the one that the environment tells where it is `auto`.
    ///
    /// # Errors
    /// When it is no part.
    pub fn parse(text: &str) -> Result<Self, PartError> {
        if text == "auto" {
            return Self::of_environment(|name| std::env::var(name).ok());
        }
        let (number, count) = text.split_once('/').ok_or(PartError::Syntax)?;
        let [number, count] = [number, count].map(|text| text.trim().parse::<u64>().map_err(|_| PartError::Syntax));
        Self::numbered(number?, count?)
    }

    /// - `number`: from 1.
    fn numbered(number: u64, count: u64) -> Result<Self, PartError> {
        match (u32::try_from(number), u32::try_from(count)) {
            _ if count > u64::from(Self::MOST) => Err(PartError::Many(count)),
            (Ok(number), Ok(count)) if (1..=count).contains(&number) => Ok(Self { index: number - 1, count }),
            _ => Err(PartError::Range { number, count }),
        }
    }

    /// The part that an engine tells its task by variables: `FIRSTLIGHT_PART` (from 1) and `FIRSTLIGHT_PARTS` win; then
    /// the array of Slurm, then the completion index of Kubernetes.
    ///
    /// - `variable`: the value of an environment variable.
    ///
    /// # Errors
    /// When the variables tell no part.
    pub fn of_environment(variable: impl Fn(&str) -> Option<String>) -> Result<Self, PartError> {
        let number = |name: &'static str| {
            let value = variable(name).filter(|value| !value.is_empty());
            let parse = |value: String| {
                value.trim().parse::<u64>().map_err(|_| PartError::Variable { name, value: value.clone() })
            };
            value.map(parse).transpose()
        };
        let count = number("FIRSTLIGHT_PARTS")?;
        if let Some(part) = number("FIRSTLIGHT_PART")? {
            return Self::numbered(part, count.ok_or(PartError::NoCount)?);
        }
        if let Some(id) = number("SLURM_ARRAY_TASK_ID")? {
            let first = number("SLURM_ARRAY_TASK_MIN")?.unwrap_or(1);
            let step = number("SLURM_ARRAY_TASK_STEP")?.unwrap_or(1).max(1);
            let count = count.or(number("SLURM_ARRAY_TASK_COUNT")?).ok_or(PartError::NoCount)?;
            return Self::numbered(id.saturating_sub(first) / step + 1, count);
        }
        match number("JOB_COMPLETION_INDEX")? {
            Some(index) => Self::numbered(index.saturating_add(1), count.ok_or(PartError::NoCount)?),
            None => Err(PartError::NoNumber),
        }
    }

    /// The number of the part, from 1.
    pub fn number(self) -> u32 {
        self.index + 1
    }

    /// The number with as many digits as that of the last part has, at least four: names sort as parts do.
    pub fn padded(self) -> String {
        let digits = self.count.to_string().len().max(4);
        format!("{:0digits$}", self.number())
    }

    /// Which of `samples` it has.
    ///
    /// # Errors
    /// When there are more parts than samples.
    pub fn samples(self, samples: Range<u32>) -> Result<Range<u32>, PartError> {
        let n = u64::from(samples.end.saturating_sub(samples.start));
        self.check(n, "samples")?;
        Ok(sample_ranges(samples, self.count)[self.index as usize].clone())
    }

    /// Which of `n` frames, counted from 0, it has.
    ///
    /// # Errors
    /// When there are more parts than frames.
    pub fn frames(self, n: u32) -> Result<Range<u32>, PartError> {
        self.check(u64::from(n), "frames")?;
        let end_of = |index: u32| (u64::from(n) * u64::from(index) / u64::from(self.count)) as u32;
        Ok(end_of(self.index)..end_of(self.index + 1))
    }

    /// Which rectangle it has of an image of `tiles` in x and y: the first tile, and the one after the last.
    ///
    /// # Errors
    /// When there are more parts than tiles.
    pub fn tiles(self, tiles: [u32; 2]) -> Result<[[u32; 2]; 2], PartError> {
        self.check(u64::from(tiles[0]) * u64::from(tiles[1]), "tiles")?;
        let (mut start, mut end) = ([0, 0], tiles);
        let (mut index, mut count) = (u64::from(self.index), u64::from(self.count));
        // Halves of the longer side, as long as several parts share the rectangle.
        while count > 1 {
            let side = [end[0] - start[0], end[1] - start[1]];
            let axis = usize::from(side[1] >= side[0]);
            let (length, width) = (u64::from(side[axis]), u64::from(side[1 - axis]));
            let half = count / 2;
            let cut = ((length * half + count / 2) / count).clamp(1, length - 1);
            // No half gets more parts than it has tiles.
            let half = half.clamp(count.saturating_sub((length - cut) * width).max(1), (cut * width).min(count - 1));
            let at = start[axis] + cut as u32;
            if index < half {
                end[axis] = at;
                count = half;
            } else {
                start[axis] = at;
                (index, count) = (index - half, count - half);
            }
        }
        Ok([start, end])
    }

    fn check(self, n: u64, what: &'static str) -> Result<(), PartError> {
        if u64::from(self.count) > n { Err(PartError::TooMany { count: self.count, n, what }) } else { Ok(()) }
    }
}

/// Divides `samples` among `count` parts, at most as many as there are samples, each a range of its own, ascending.
///
/// No part but that which begins with sample 0 has a power of two inside, where the error estimate looks at the image,
/// unless there are more of them than parts.
pub fn sample_ranges(samples: Range<u32>, count: u32) -> Vec<Range<u32>> {
    let n = samples.end.saturating_sub(samples.start);
    if n == 0 || count <= 1 {
        return vec![samples];
    }
    let count = count.min(n) as usize;
    // The smallest maximum size of a part for which `count` parts suffice.
    let (mut too_short, mut long_enough) = (n / count as u32 - 1, n);
    while long_enough - too_short > 1 {
        let length = too_short + (long_enough - too_short) / 2;
        if cut(&samples, length).len() <= count {
            long_enough = length;
        } else {
            too_short = length;
        }
    }
    let parts = cut(&samples, long_enough);
    if parts.len() > count {
        // There are more powers of two than parts: the light is the same, the estimate misses some of its looks.
        let end_of = |i: usize| samples.start + (u64::from(n) * i as u64 / count as u64) as u32;
        return (0..count).map(|i| end_of(i)..end_of(i + 1)).collect();
    }
    // Those that are left are halves of the longest.
    let key = |range: Range<u32>| (range.end - range.start, std::cmp::Reverse(range.start), range.end);
    let mut parts: BinaryHeap<_> = parts.into_iter().map(key).collect();
    while parts.len() < count {
        let (length, std::cmp::Reverse(start), end) = parts.pop().expect("there is one at least");
        // The first goes on having all powers of two up to its end.
        let at = if start == 0 { 1 << (end - 1).ilog2() } else { start + length / 2 };
        parts.extend([key(start..at), key(at..end)]);
    }
    let mut parts: Vec<Range<u32>> = parts.into_iter().map(|(_, start, end)| start.0..end).collect();
    parts.sort_by_key(|range| range.start);
    parts
}

/// `samples` in parts of at most `length`, at least 1, that end at every power of two beyond the first.
fn cut(samples: &Range<u32>, length: u32) -> Vec<Range<u32>> {
    let mut parts = Vec::new();
    let mut at = samples.start;
    while at < samples.end {
        let next_power = if at == 0 { length } else { (at + 1).checked_next_power_of_two().unwrap_or(u32::MAX) };
        let end = next_power.min(samples.end);
        // Equal shares of what is before the next power of two.
        let n = (end - at).div_ceil(length);
        let end_of = |i: u32| at + (u64::from(end - at) * u64::from(i) / u64::from(n)) as u32;
        parts.extend((0..n).map(|i| end_of(i)..end_of(i + 1)));
        at = end;
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    #[test]
    fn parts_of_samples_cover_them_once_and_end_at_powers_of_two() {
        for start in [0, 1, 7, 64, 100] {
            for n in (1..70).chain([96, 100, 128, 192, 255, 256, 257, 1000, 4096]) {
                for count in (1..=n.min(40)).chain([64, 100].into_iter().filter(|count| *count <= n)) {
                    let parts = sample_ranges(start..start + n, count);
                    let place = format!("{start}..{} in {count}: {parts:?}", start + n);
                    assert_eq!(parts.len(), count as usize, "{place}");
                    assert_eq!((parts[0].start, parts[parts.len() - 1].end), (start, start + n), "{place}");
                    assert!(parts.windows(2).all(|pair| pair[0].end == pair[1].start), "{place}");
                    assert!(parts.iter().all(|part| !part.is_empty()), "{place}");
                    let has_power = |part: &Range<u32>| (part.start + 1..part.end).any(u32::is_power_of_two);
                    let n_powers = (start + 1..start + n).filter(|n| n.is_power_of_two()).count() as u32;
                    if count > 1 && (start == 0 || count > n_powers) {
                        assert!(parts.iter().all(|part| part.start == 0 || !has_power(part)), "{place}");
                        // The price of it: no part is longer than twice its share.
                        let longest = parts.iter().map(|part| part.len() as u32).max().unwrap();
                        assert!(start > 0 || longest <= 2 * n.div_ceil(count), "{place}");
                    }
                }
            }
        }
        // What divides best is divided evenly.
        assert!(sample_ranges(0..256, 64).iter().all(|part| part.len() == 4));
        assert!(sample_ranges(64..128, 16).iter().all(|part| part.len() == 4));
    }

    #[test]
    fn parts_of_tiles_cover_the_image_once() {
        for tiles in [[1, 1], [2, 2], [3, 2], [5, 7], [20, 1], [1, 9], [40, 23]] {
            let n = tiles[0] * tiles[1];
            for count in (1..=n.min(70)).chain([n]) {
                let mut covered = HashMap::new();
                let mut largest = 0;
                for index in 0..count {
                    let [start, end] = Part { index, count }.tiles(tiles).unwrap();
                    largest = largest.max((end[0] - start[0]) * (end[1] - start[1]));
                    for (y, x) in (start[1]..end[1]).flat_map(|y| (start[0]..end[0]).map(move |x| (y, x))) {
                        assert_eq!(covered.insert((x, y), index), None, "{tiles:?} in {count}");
                    }
                }
                assert_eq!(covered.len() as u32, n, "{tiles:?} in {count}");
                assert!(largest <= 3 * n.div_ceil(count), "{tiles:?} in {count}: {largest}");
            }
            let error = Part { index: 0, count: n + 1 }.tiles(tiles).unwrap_err();
            assert_eq!(error, PartError::TooMany { count: n + 1, n: u64::from(n), what: "tiles" });
        }
    }

    #[test]
    fn parts_of_frames_cover_them_once() {
        for (n, count) in [(60, 7), (5, 5), (1, 1), (100, 3)] {
            let parts: Vec<u32> = (0..count).flat_map(|index| Part { index, count }.frames(n).unwrap()).collect();
            assert_eq!(parts, (0..n).collect::<Vec<_>>());
        }
        assert!(Part { index: 0, count: 3 }.frames(2).is_err());
    }

    #[test]
    fn a_part_is_read_from_words_and_from_what_engines_set() {
        assert_eq!(Part::parse("3/64"), Ok(Part { index: 2, count: 64 }));
        for wrong in ["", "3", "0/4", "5/4", "a/4", "1/0", "-1/4", "Auto", "1/99999999999"] {
            assert!(Part::parse(wrong).is_err(), "{wrong}");
        }
        assert!(Part::parse("1/1000000").is_ok());
        for many in ["1/1000001", "1/2147483647", "5/99999999999"] {
            assert!(Part::parse(many).unwrap_err().to_string().ends_with("parts: use at most 1000000"), "{many}");
        }
        let of = |variables: &[(&str, &str)]| {
            let variables: HashMap<_, _> = variables.iter().copied().collect();
            Part::of_environment(|name| variables.get(name).map(|value| (*value).to_owned()))
        };
        let slurm = [("SLURM_ARRAY_TASK_ID", "7"), ("SLURM_ARRAY_TASK_MIN", "3"), ("SLURM_ARRAY_TASK_COUNT", "9")];
        assert_eq!(of(&slurm), Ok(Part { index: 4, count: 9 }));
        assert_eq!(of(&[&slurm[..], &[("SLURM_ARRAY_TASK_STEP", "2")]].concat()), Ok(Part { index: 2, count: 9 }));
        // The number of parts may be told.
        assert_eq!(of(&[&slurm[..], &[("FIRSTLIGHT_PARTS", "64")]].concat()), Ok(Part { index: 4, count: 64 }));
        let own = [("FIRSTLIGHT_PART", "1"), ("FIRSTLIGHT_PARTS", "2")];
        assert_eq!(of(&[&slurm[..], &own].concat()), Ok(Part { index: 0, count: 2 }));
        let kubernetes = [("JOB_COMPLETION_INDEX", "0")];
        assert_eq!(of(&kubernetes), Err(PartError::NoCount));
        assert_eq!(of(&[&kubernetes[..], &own[1..]].concat()), Ok(Part { index: 0, count: 2 }));
        assert_eq!(of(&[]), Err(PartError::NoNumber));
        assert!(matches!(of(&[("FIRSTLIGHT_PART", "x"), ("FIRSTLIGHT_PARTS", "2")]), Err(PartError::Variable { .. })));
        assert_eq!(Part { index: 6, count: 64 }.padded(), "0007");
        assert_eq!(Part { index: 6, count: 12_345 }.padded(), "00007");
    }
}
