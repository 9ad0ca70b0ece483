//! Binary STL: a header of 80 bytes, the number of triangles, and 50 bytes per triangle, little-endian.

use crate::error::Place;
use crate::error::stl::StlProblem;
use crate::stl::soup::{Located, Soup, is_plain};
use glam::DVec3;

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
    let mut has_attributes = false;
    for record in records.chunks_exact(TRIANGLE).take(count) {
        let number = |at: usize| {
            let bytes = [record[at], record[at + 1], record[at + 2], record[at + 3]];
            f64::from(f32::from_le_bytes(bytes))
        };
        // After the normal.
        let corners = [12, 24, 36].map(|at| DVec3::new(number(at), number(at + 4), number(at + 8)));
        if corners.iter().all(|corner| corner.is_finite()) {
            soup.corners.extend(corners);
        } else {
            soup.left_out += 1;
        }
        has_attributes |= record[48..] != [0, 0];
    }
    let rest = records.len() - count * TRIANGLE;
    if rest > 0 {
        soup.notes.push(format!("{rest} bytes after the last of {count} triangles were ignored"));
    }
    if has_attributes {
        soup.notes.push("attributes of triangles (colours of some programs) are not modelled and were ignored".into());
    }
    Ok(soup)
}
