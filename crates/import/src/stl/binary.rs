//! Binary STL: a header of 80 bytes, the number of triangles, and 50 bytes per triangle, little-endian.
//!
//! Colours are those of Materialise Magics, which other programs write as well: `COLOR=` and red, green, blue and alpha in
//! the header, and after each triangle its own, 5 bits for each channel from red up. Its highest bit says that it has
//! that of the header.

use crate::error::Place;
use crate::error::stl::StlProblem;
use crate::stl::soup::{Located, Soup, is_plain};
use glam::DVec3;
use std::collections::BTreeSet;

const HEADER: usize = 80;
const START: usize = 84;
const TRIANGLE: usize = 50;

fn declared(bytes: &[u8]) -> Option<u32> {
    Some(u32::from_le_bytes(*bytes.get(HEADER..)?.first_chunk()?))
}

fn length_for(count: u32) -> u64 {
    START as u64 + TRIANGLE as u64 * u64::from(count)
}

/// Whether the length matches the declared number of triangles.
pub(super) fn has_right_length(bytes: &[u8]) -> bool {
    declared(bytes).is_some_and(|count| length_for(count) == bytes.len() as u64)
}

pub(super) fn parse(bytes: &[u8]) -> Result<Soup, Located> {
    let not_stl = (Place::File, StlProblem::NotStl { bytes: bytes.len() });
    let count = declared(bytes).ok_or(not_stl)?;
    let (expected, found) = (length_for(count), bytes.len() as u64);
    let mut soup = Soup::default();
    // Programs that write triangles as they come may not know their number in advance, and some files are cut.
    let records = &bytes[START..];
    let there = records.len() / TRIANGLE;
    let is_miscounted = expected > found || (count == 0 && there > 0);
    if is_miscounted && (there == 0 || bytes.iter().all(is_plain)) {
        return Err((Place::Byte(HEADER), StlProblem::Truncated { count, expected, bytes: bytes.len() }));
    }
    let count = if is_miscounted { there } else { count as usize };
    if is_miscounted {
        soup.notes.push(format!(
            "declares {} triangles, but its length is that of {there}, which were read",
            declared(bytes).unwrap_or(0)
        ));
    }
    soup.corners.reserve_exact(3 * count);
    let mut attributes = Vec::with_capacity(count);
    for record in records.chunks_exact(TRIANGLE).take(count) {
        let number = |at: usize| {
            let bytes = [record[at], record[at + 1], record[at + 2], record[at + 3]];
            f64::from(f32::from_le_bytes(bytes))
        };
        // After the normal.
        let corners = [12, 24, 36].map(|at| DVec3::new(number(at), number(at + 4), number(at + 8)));
        if corners.iter().all(|corner| corner.is_finite()) {
            soup.corners.extend(corners);
            attributes.push(u16::from_le_bytes([record[48], record[49]]));
        } else {
            soup.left_out += 1;
        }
    }
    let rest = records.len() - count * TRIANGLE;
    if rest > 0 {
        soup.notes.push(format!("{rest} bytes after the last of {count} triangles were ignored"));
    }
    let has_own = attributes.iter().any(|attribute| *attribute != 0);
    match color_of_file(bytes) {
        Some(whole) if has_own => (soup.colors, soup.slots) = colors(&attributes, whole),
        // Who colours nothing writes zeros.
        Some(whole) if whole != [0; 3] => soup.colors = vec![whole],
        None if has_own => soup.notes.push("attributes of triangles are ignored: the header has no `COLOR=`".into()),
        _ => {}
    }
    Ok(soup)
}

/// Red, green and blue of the header, sRGB.
fn color_of_file(bytes: &[u8]) -> Option<[u8; 3]> {
    const KEY: &[u8] = b"COLOR=";
    let header = &bytes[..HEADER];
    let at = header.windows(KEY.len()).position(|part| part == KEY)? + KEY.len();
    header[at..].first_chunk().copied()
}

/// The different colours of triangles, and which of them each one has; fewer bits count if there are too many.
fn colors(attributes: &[u16], whole: [u8; 3]) -> (Vec<[u8; 3]>, Vec<u16>) {
    const OF_FILE: u16 = 0x8000;
    const MOST: usize = 65;
    let color = |attribute: u16, bits: u16| match attribute & OF_FILE {
        0 => [0, 5, 10].map(|shift| {
            let level = u32::from((attribute >> shift & 31) >> (5 - bits));
            (level * 255 / ((1 << bits) - 1)) as u8
        }),
        _ => whole,
    };
    let colors_of = |bits| attributes.iter().map(|attribute| color(*attribute, bits)).collect::<BTreeSet<_>>();
    let few = (2..=5).rev().map(|bits| (bits, colors_of(bits))).find(|(_, colors)| colors.len() <= MOST);
    let (bits, colors) = few.expect("two bits for each channel have 64 values");
    let colors: Vec<[u8; 3]> = colors.into_iter().collect();
    let slot = |attribute: &u16| colors.binary_search(&color(*attribute, bits)).expect("one of them") as u16;
    let slots = if colors.len() > 1 { attributes.iter().map(slot).collect() } else { Vec::new() };
    (colors, slots)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_colours_become_few_that_are_near() {
        let attributes: Vec<u16> = (0..=0x8000).collect();
        let (palette, slots) = colors(&attributes, [1, 2, 3]);
        assert!(palette.len() <= 65 && palette.contains(&[0; 3]) && palette.contains(&[255; 3]));
        assert_eq!(palette[usize::from(slots[0x8000])], [1, 2, 3]);
        for attribute in 0..0x8000_u16 {
            for (channel, byte) in palette[usize::from(slots[usize::from(attribute)])].into_iter().enumerate() {
                let wanted = f64::from(attribute >> (5 * channel) & 31) / 31.0;
                assert!((f64::from(byte) / 255.0 - wanted).abs() < 0.25, "{attribute:#x}");
            }
        }
        assert_eq!(colors(&[0x7fff, 0x7fff], [1, 2, 3]), (vec![[255; 3]], Vec::new()));
    }
}
