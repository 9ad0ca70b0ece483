//! The container: a GLB with its chunks, or a JSON text.
//!
//! Source: Khronos, "glTF 2.0 Specification", chapter 4 (GLB file format).

use crate::error::gltf::GltfProblem;
use std::ops::Range;

const HEADER: usize = 12;
const JSON: u32 = u32::from_le_bytes(*b"JSON");
const BIN: u32 = u32::from_le_bytes(*b"BIN\0");

/// Byte ranges of the JSON text and of the embedded buffer.
#[derive(Debug, PartialEq)]
pub(crate) struct Chunks {
    pub json: Range<usize>,
    pub binary: Option<Range<usize>>,
}

/// Finds the chunks.
///
/// # Errors
/// If the format or version is another one, or the file is shorter than its lengths say.
pub(crate) fn chunks(bytes: &[u8]) -> Result<Chunks, GltfProblem> {
    if !bytes.starts_with(b"glTF") {
        let text = bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(bytes);
        let begins = text.iter().find(|byte| !byte.is_ascii_whitespace());
        return match begins {
            Some(b'{') => Ok(Chunks { json: bytes.len() - text.len()..bytes.len(), binary: None }),
            _ => Err(GltfProblem::NotGltf),
        };
    }
    let number = |at: usize| -> Option<u32> {
        bytes.get(at..at.checked_add(4)?).map(|four| u32::from_le_bytes([four[0], four[1], four[2], four[3]]))
    };
    let truncated = |what, needed: u64| GltfProblem::Truncated { what, needed, found: bytes.len() as u64 };
    let (Some(version), Some(length)) = (number(4), number(8)) else {
        return Err(truncated("the header", HEADER as u64));
    };
    if version != 2 {
        return Err(GltfProblem::Version(version.to_string()));
    }
    // What is cut is read as far as it goes, if the JSON text is whole.
    let end = bytes.len().min(length as usize);
    let (mut at, mut json, mut binary) = (HEADER, None, None);
    // The remaining bytes may be padding.
    while at + 8 <= end {
        let (Some(size), Some(kind)) = (number(at), number(at + 4)) else { break };
        let start = at + 8;
        let stop = start as u64 + u64::from(size);
        if stop > end as u64 && (kind != BIN || json.is_none()) {
            return Err(truncated("a chunk", stop));
        }
        let stop = stop.min(end as u64);
        let range = start..stop as usize;
        match (kind, json.is_some()) {
            (JSON, false) => json = Some(range),
            (_, false) => return Err(GltfProblem::NoJson),
            (BIN, true) if binary.is_none() => binary = Some(range),
            // Chunks of unknown types must be skipped.
            _ => {}
        }
        at = stop as usize;
    }
    Ok(Chunks { json: json.ok_or(GltfProblem::NoJson)?, binary })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn glb(parts: &[(u32, &[u8])]) -> Vec<u8> {
        let mut bytes = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
        for (kind, data) in parts {
            bytes.extend((data.len() as u32).to_le_bytes());
            bytes.extend(kind.to_le_bytes());
            bytes.extend_from_slice(data);
        }
        let length = bytes.len() as u32;
        bytes[8..12].copy_from_slice(&length.to_le_bytes());
        bytes
    }

    #[test]
    fn chunks_are_found_and_unknown_ones_skipped() {
        let bytes = glb(&[(JSON, b"{}  "), (77, b"abcd"), (BIN, b"1234"), (BIN, b"5678")]);
        let found = chunks(&bytes).unwrap();
        assert_eq!(&bytes[found.json], b"{}  ");
        assert_eq!(&bytes[found.binary.unwrap()], b"1234");
        assert_eq!(chunks(b"\xef\xbb\xbf {}").unwrap(), Chunks { json: 3..6, binary: None });
    }

    #[test]
    fn a_file_may_be_cut_in_its_buffer_only() {
        let whole = glb(&[(JSON, b"{}  "), (BIN, b"1234")]);
        let end_of_json = 12 + 8 + 4;
        for length in 0..end_of_json {
            assert!(chunks(&whole[..length]).is_err(), "{length}");
        }
        for length in end_of_json..whole.len() {
            let found = chunks(&whole[..length]).unwrap();
            assert_eq!(found.binary.map(|range| range.len()), length.checked_sub(end_of_json + 8), "{length}");
        }
        let mut liar = whole.clone();
        liar[12..16].copy_from_slice(&u32::MAX.to_le_bytes());
        assert!(matches!(chunks(&liar), Err(GltfProblem::Truncated { what: "a chunk", .. })));
        assert!(matches!(chunks(&glb(&[(BIN, b"1234")])), Err(GltfProblem::NoJson)));
        assert!(matches!(chunks(b"solid cube"), Err(GltfProblem::NotGltf)));
    }
}
