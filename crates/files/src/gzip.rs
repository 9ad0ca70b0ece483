//! Files that are compressed as a whole (gzip, RFC 1952): a few bytes can stand for any number of them.

use crate::input_file::{FileKind, ReadError};
use crate::limits::Limits;
use flate2::bufread::MultiGzDecoder;
use std::io::Read;

/// First bytes of a compressed file.
const SIGNATURE: [u8; 2] = [0x1f, 0x8b];

/// The contents of a file, decompressed if they are compressed, whatever the name of the file is.
///
/// - `limit`: bytes that the contents may have.
///
/// # Errors
/// If they are damaged, or longer than the limit or than [`Limits::most_unpacked`].
pub fn decompressed(bytes: Vec<u8>, kind: FileKind, limit: u64) -> Result<Vec<u8>, ReadError> {
    if !bytes.starts_with(&SIGNATURE) {
        return Ok(bytes);
    }
    let most = Limits::most_unpacked(bytes.len() as u64);
    let mut contents = Vec::new();
    // One byte more than the limit shows whether there are more.
    let mut decoder = MultiGzDecoder::new(bytes.as_slice()).take(limit.min(most).saturating_add(1));
    decoder.read_to_end(&mut contents).map_err(ReadError::Io)?;
    match contents.len() as u64 {
        length if length > limit => Err(ReadError::TooLong { kind, limit }),
        length if length > most => Err(ReadError::Unpacks { limit: most }),
        _ => Ok(contents),
    }
}

/// The start of the contents of a file, from the start of the file.
pub fn start_of_decompressed(bytes: Vec<u8>, most: u64) -> Vec<u8> {
    if !bytes.starts_with(&SIGNATURE) {
        return bytes;
    }
    let mut contents = Vec::new();
    // It ends in the middle: what comes before is there.
    let _ = MultiGzDecoder::new(bytes.as_slice()).take(most).read_to_end(&mut contents);
    contents
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::Compression;
    use flate2::write::GzEncoder;
    use std::io::Write;

    fn packed(plain: &[u8]) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
        encoder.write_all(plain).unwrap();
        encoder.finish().unwrap()
    }

    #[test]
    fn a_small_file_does_not_stand_for_a_large_one() {
        let bomb = packed(&vec![b' '; 24 << 20]);
        assert!(bomb.len() < 1 << 15);
        assert!(matches!(decompressed(bomb, FileKind::Model, 1 << 30), Err(ReadError::Unpacks { .. })));
    }

    #[test]
    fn compressed_contents_are_read_within_the_limit() {
        let plain = vec![b'x'; 1000];
        let packed = packed(&plain);
        assert!(packed.len() < 100);
        let read = |bytes: &[u8], limit| decompressed(bytes.to_vec(), FileKind::Model, limit);
        assert_eq!(read(&packed, 1000).unwrap(), plain);
        assert_eq!(read(&plain, 1000).unwrap(), plain);
        assert!(matches!(read(&packed, 999), Err(ReadError::TooLong { limit: 999, .. })));
        assert!(matches!(read(&packed[..packed.len() - 9], 1000), Err(ReadError::Io(_))));
        assert!(read(&[0x1f, 0x8b, 8], 1000).is_err());
    }
}
