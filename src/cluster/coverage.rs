//! Which samples a set of films has: which are there twice, and which are missing.
//!
//! Told from what films say of themselves, without their numbers, so that thousands of films are looked through before the
//! first is added up.

use crate::render::FilmLayout;
use std::collections::BTreeMap;
use std::ops::Range;

/// The samples of a set of films, each known by its number in the order in which they were added.
#[derive(Clone, Debug, Default)]
pub struct Coverage {
    n_films: usize,
    n_blocks: usize,
    /// Of films with the same samples in all blocks: range and film.
    even: Vec<(Range<u32>, usize)>,
    /// Of all others, by block.
    uneven: BTreeMap<usize, Vec<(Range<u32>, usize)>>,
}

/// Two films that have samples in common.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Duplicate {
    /// Numbers of the films, ascending.
    pub films: [usize; 2],
    /// Samples that both have.
    pub samples: Range<u32>,
}

impl Coverage {
    /// Adds the next film.
    pub fn add(&mut self, layout: &FilmLayout) {
        let film = self.n_films;
        self.n_films += 1;
        let blocks = || layout.tiles.iter().flat_map(|tile| &tile.blocks);
        self.n_blocks = self.n_blocks.max(blocks().count());
        let ranges = |samples: &[(u32, u32)]| -> Vec<(Range<u32>, usize)> {
            samples.iter().filter(|(start, end)| start < end).map(|&(start, end)| (start..end, film)).collect()
        };
        let first = blocks().next().map_or(&[][..], |block| &block.samples);
        if blocks().all(|block| block.samples == first) {
            self.even.extend(ranges(first));
            return;
        }
        for (i, block) in blocks().enumerate() {
            let ranges = ranges(&block.samples);
            if !ranges.is_empty() {
                self.uneven.entry(i).or_default().extend(ranges);
            }
        }
    }

    /// Samples that any pixel has: the first, and the one after the last.
    pub fn hull(&self) -> Range<u32> {
        let all = || self.even.iter().chain(self.uneven.values().flatten());
        let start = all().map(|(range, _)| range.start).min().unwrap_or(0);
        start..all().map(|(range, _)| range.end).max().unwrap_or(start)
    }

    /// The first samples that two films have.
    pub fn duplicate(&self) -> Option<Duplicate> {
        let mut even = self.even.clone();
        let of_even = first_shared(&mut even);
        // From here on, no two of `even` overlap.
        let of_block = |ranges: &Vec<(Range<u32>, usize)>| {
            let mut ranges = ranges.clone();
            let with_even = |(range, film): &(Range<u32>, usize)| {
                let after = even.partition_point(|(other, _)| other.end <= range.start);
                let (other, of_other) = even.get(after).filter(|(other, _)| other.start < range.end)?;
                let films = [*film.min(of_other), *film.max(of_other)];
                Some(Duplicate { films, samples: range.start.max(other.start)..range.end.min(other.end) })
            };
            first_shared(&mut ranges).or_else(|| ranges.iter().find_map(with_even))
        };
        of_even.or_else(|| self.uneven.values().find_map(of_block))
    }

    /// Samples of `wanted` that some pixel does not have, ascending.
    pub fn missing(&self, wanted: Range<u32>) -> Vec<Range<u32>> {
        let only = |ranges: &[(Range<u32>, usize)]| ranges.iter().map(|(range, _)| range.clone()).collect::<Vec<_>>();
        let mut there = only(&self.even);
        let of_blocks = self.uneven.values().map(|ranges| joined(only(ranges)));
        if self.uneven.len() == self.n_blocks {
            there.extend(in_all(of_blocks.flatten(), self.n_blocks));
        }
        gaps(there, &wanted)
    }
}

/// Sorts `ranges`, and finds the first two that overlap.
fn first_shared(ranges: &mut [(Range<u32>, usize)]) -> Option<Duplicate> {
    ranges.sort_by_key(|(range, film)| (range.start, *film));
    let mut furthest: Option<&(Range<u32>, usize)> = None;
    for next in ranges.iter() {
        if let Some((range, film)) = furthest
            && range.end > next.0.start
        {
            let films = [*film.min(&next.1), *film.max(&next.1)];
            return Some(Duplicate { films, samples: next.0.start..range.end.min(next.0.end) });
        }
        furthest = Some(next);
    }
    None
}

/// The numbers that `n` of these ranges have.
fn in_all(ranges: impl Iterator<Item = Range<u32>>, n: usize) -> Vec<Range<u32>> {
    // Where there are how many more than before.
    let mut changes: BTreeMap<u32, isize> = BTreeMap::new();
    for range in ranges {
        *changes.entry(range.start).or_default() += 1;
        *changes.entry(range.end).or_default() -= 1;
    }
    let (mut count, mut since, mut found) = (0, None, Vec::new());
    for (at, change) in changes {
        count += change;
        match since {
            None if count == n as isize => since = Some(at),
            Some(start) if count < n as isize => {
                found.push(start..at);
                since = None;
            }
            _ => {}
        }
    }
    found
}

/// What of `wanted` is in none of `ranges`.
fn gaps(ranges: Vec<Range<u32>>, wanted: &Range<u32>) -> Vec<Range<u32>> {
    let mut at = wanted.start;
    let mut gaps = Vec::new();
    for range in joined(ranges) {
        if range.start > at {
            gaps.push(at..range.start.min(wanted.end));
        }
        at = at.max(range.end);
    }
    gaps.push(at..wanted.end);
    gaps.retain(|gap| gap.start < gap.end);
    gaps
}

/// The same numbers in as few ranges as there can be, ascending.
pub fn joined(mut ranges: Vec<Range<u32>>) -> Vec<Range<u32>> {
    ranges.retain(|range| range.start < range.end);
    ranges.sort_by_key(|range| range.start);
    let mut joined: Vec<Range<u32>> = Vec::new();
    for range in ranges {
        match joined.last_mut() {
            Some(last) if last.end >= range.start => last.end = last.end.max(range.end),
            _ => joined.push(range),
        }
    }
    joined
}

/// Samples in words: `sample 3`, `samples 0 to 63, 128 and 130 to 191`.
pub fn in_words(ranges: &[Range<u32>]) -> String {
    let noun = if is_one(ranges) { "sample" } else { "samples" };
    format!("{noun} {}", numbers_in_words(ranges))
}

/// The same as missing: `sample 3 is missing`.
pub fn missing_in_words(ranges: &[Range<u32>]) -> String {
    format!("{} {} missing", in_words(ranges), if is_one(ranges) { "is" } else { "are" })
}

fn is_one(ranges: &[Range<u32>]) -> bool {
    ranges.iter().map(|range| range.len() as u64).sum::<u64>() == 1
}

fn numbers_in_words(ranges: &[Range<u32>]) -> String {
    /// Nobody reads more.
    const MOST: usize = 6;
    let one = |range: &Range<u32>| match range.len() {
        1 => range.start.to_string(),
        _ => format!("{} to {}", range.start, range.end - 1),
    };
    let mut words: Vec<String> = ranges.iter().take(MOST).map(one).collect();
    if ranges.len() > MOST {
        words.push(format!("{} more ranges", ranges.len() - MOST));
    }
    match words.split_last() {
        Some((last, [])) => last.clone(),
        Some((last, others)) => format!("{} and {last}", others.join(", ")),
        None => "none".to_owned(),
    }
}

/// Divides films, given by their samples in ascending order, into at most `count` groups of films that follow each other.
/// Films of groups add up to the very film that all add up to: no group but the first has a power of two inside.
pub fn groups(films: &[Range<u32>], count: usize) -> Vec<Range<usize>> {
    let cut = |most: usize| {
        let mut groups: Vec<Range<usize>> = Vec::new();
        for (i, film) in films.iter().enumerate() {
            let belongs = |group: &Range<usize>| {
                let start = films[group.start].start;
                let next_power = (start + 1).checked_next_power_of_two().unwrap_or(u32::MAX);
                group.len() < most && (start == 0 || film.end <= next_power)
            };
            match groups.last_mut().filter(|group| belongs(group)) {
                Some(group) => group.end = i + 1,
                None => groups.push(i..i + 1),
            }
        }
        groups
    };
    let (mut too_few, mut enough) = (0, films.len().max(1));
    while enough - too_few > 1 {
        let most = too_few + (enough - too_few) / 2;
        if cut(most).len() <= count.max(1) { enough = most } else { too_few = most }
    }
    let of_powers = cut(enough);
    if of_powers.len() <= count.max(1) {
        return of_powers;
    }
    // There are fewer groups than powers of two: the light is the same, the estimate misses some of its looks.
    let end_of = |i: usize| films.len() * i / count.max(1);
    (0..count.max(1)).map(|i| end_of(i)..end_of(i + 1)).filter(|group| !group.is_empty()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::{BlockRecord, TileRecord};

    /// A film of tiles with these samples each.
    fn film(tiles: &[&[(u32, u32)]]) -> FilmLayout {
        let tile = |samples: &&[(u32, u32)]| TileRecord {
            blocks: vec![BlockRecord {
                samples: samples.to_vec(),
                mean_of: 0,
                steps: Default::default(),
                due: None,
                shadow_share: 0,
            }],
            bad: Vec::new(),
            light_mean_of: 0,
            light_steps: Default::default(),
        };
        let (width, tiles) = (32 * tiles.len() as u32, tiles.iter().map(tile).collect());
        FilmLayout { width, height: 32, tile_size: 32, tiles, round: None, light_traced: None, caustics: None }
    }

    fn coverage(films: &[FilmLayout]) -> Coverage {
        let mut coverage = Coverage::default();
        films.iter().for_each(|film| coverage.add(film));
        coverage
    }

    #[test]
    fn what_is_missing_and_what_is_there_twice_is_told() {
        let parts = coverage(&[
            film(&[&[(0, 4)], &[(0, 4)]]),
            film(&[&[(8, 12)], &[(8, 12)]]),
            film(&[&[(16, 20)], &[(16, 20)]]),
        ]);
        assert_eq!((parts.hull(), parts.duplicate()), (0..20, None));
        assert_eq!(parts.missing(0..20), [4..8, 12..16]);
        assert_eq!(parts.missing(0..24), [4..8, 12..16, 20..24]);
        assert_eq!(parts.missing(8..12), []);
        let mut twice = parts.clone();
        twice.add(&film(&[&[(10, 14)], &[(10, 14)]]));
        assert_eq!(twice.duplicate(), Some(Duplicate { films: [1, 3], samples: 10..12 }));
        assert_eq!(in_words(&parts.missing(0..21)), "samples 4 to 7, 12 to 15 and 20");
        assert_eq!(missing_in_words(&[3..4]), "sample 3 is missing");
        assert_eq!(missing_in_words(&[3..5]), "samples 3 to 4 are missing");
    }

    #[test]
    fn tiles_are_looked_at_one_by_one_where_they_differ() {
        let left = film(&[&[(0, 8)], &[(0, 0)]]);
        let right = film(&[&[(0, 0)], &[(0, 8)]]);
        let both = coverage(&[left.clone(), right.clone()]);
        assert_eq!((both.duplicate(), both.missing(0..8)), (None, vec![]));
        assert_eq!(coverage(std::slice::from_ref(&left)).missing(0..8), [0..8]);
        // A film that was interrupted: one tile is a sample ahead.
        let interrupted = film(&[&[(0, 5)], &[(0, 4)]]);
        assert_eq!(coverage(std::slice::from_ref(&interrupted)).missing(0..8), [4..8]);
        let rest = film(&[&[(4, 8)], &[(4, 8)]]);
        let found = coverage(&[interrupted, rest]).duplicate();
        assert_eq!(found, Some(Duplicate { films: [0, 1], samples: 4..5 }));
        assert_eq!(coverage(&[left.clone(), right, left]).duplicate().unwrap().films, [0, 2]);
    }

    /// Many ranges in one film against many blocks of another: what a forged film has must not multiply.
    #[test]
    fn ranges_of_many_blocks_are_not_compared_with_all_others() {
        let n = 5_000;
        let comb: Vec<(u32, u32)> = (0..n).map(|i| (2 * i, 2 * i + 1)).collect();
        let blocks: Vec<[(u32, u32); 1]> = (0..n).map(|i| [(3 * n, 3 * n + 1 + i % 2)]).collect();
        let blocks: Vec<&[(u32, u32)]> = blocks.iter().map(|block| &block[..]).collect();
        let both = coverage(&[film(&[&comb]), film(&blocks)]);
        assert_eq!((both.duplicate(), both.missing(0..3 * n + 2).len()), (None, n as usize + 1));
        assert_eq!(both.missing(3 * n..3 * n + 2), [3 * n + 1..3 * n + 2]);
    }

    #[test]
    fn groups_follow_each_other_and_end_at_powers_of_two() {
        for (n, each) in [(1, 1), (64, 4), (200, 1), (1000, 3), (1024, 1)] {
            let films: Vec<Range<u32>> = crate::cluster::part::sample_ranges(0..n * each, n);
            for count in [1, 2, 16, 40] {
                let groups = groups(&films, count);
                let ranges = groups.iter().map(|group| films[group.start].start..films[group.end - 1].end);
                let ranges: Vec<Range<u32>> = ranges.collect();
                assert!(groups.len() <= count, "{n} in {count}");
                assert_eq!(joined(ranges.clone()), [0..n * each]);
                let has_power = |range: &Range<u32>| (range.start + 1..range.end).any(u32::is_power_of_two);
                assert!(count < 16 || !ranges[1..].iter().any(has_power), "{n} in {count}: {ranges:?}");
                let longest = groups.iter().map(Range::len).max().unwrap();
                assert!(count < 16 || longest <= 2 * (n as usize).div_ceil(count), "{n} in {count}: {longest}");
            }
        }
    }
}
