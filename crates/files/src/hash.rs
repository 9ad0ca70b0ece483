//! A fast hash of bytes.

use std::fmt;
use xxhash_rust::xxh3::xxh3_128;

/// 128-bit hash.
///
/// The same in every run and on every little-endian machine; detects changes, but is not cryptographic.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Fingerprint(pub u128);

impl fmt::Display for Fingerprint {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{:032x}", self.0)
    }
}

impl Fingerprint {
    /// XXH3 (Collet 2019), 128 bits.
    pub fn of(bytes: &[u8]) -> Self {
        Self(xxh3_128(bytes))
    }

    /// Of this one and of these bytes after it; other splits into parts give another one.
    #[must_use]
    pub fn with(self, bytes: &[u8]) -> Self {
        Self::of(bytemuck::bytes_of(&[self.0, Self::of(bytes).0]))
    }
}
