//! Binary STL: a header of 80 bytes, the number of triangles, and 50 bytes per triangle, little-endian.

use super::error::StlProblem;
use super::{Located, Soup};
use crate::scene::model::Place;
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
    if expected > found {
        return Err((Place::Byte(HEADER), StlProblem::Truncated { count, expected, bytes: bytes.len() }));
    }
    let mut soup = Soup { corners: Vec::with_capacity(3 * count as usize), ..Soup::default() };
    let mut has_attributes = false;
    for (triangle, record) in bytes[START..expected as usize].chunks_exact(TRIANGLE).enumerate() {
        let number = |at: usize| {
            let bytes = [record[at], record[at + 1], record[at + 2], record[at + 3]];
            f64::from(f32::from_le_bytes(bytes))
        };
        for corner in 0..3 {
            // After the normal.
            let at = 12 + 12 * corner;
            let position = DVec3::new(number(at), number(at + 4), number(at + 8));
            if !position.is_finite() {
                let place = Place::Byte(START + TRIANGLE * triangle + at);
                return Err((place, StlProblem::NotFinite { triangle, corner }));
            }
            soup.corners.push(position);
        }
        has_attributes |= record[48..] != [0, 0];
    }
    if found > expected {
        soup.notes.push(format!("{} bytes after the last of {count} triangles were ignored", found - expected));
    }
    if has_attributes {
        soup.notes.push("attributes of triangles (colours of some programs) are not modelled and were ignored".into());
    }
    Ok(soup)
}
