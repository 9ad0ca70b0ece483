//! Cryptomatte 1.2: masks of objects and materials by name, as channels and attributes of an OpenEXR image.
//!
//! Each pixel has pairs of an id and the share of the pixel that it covers, largest share first. An id is the
//! MurmurHash3 of a name, as the bits of a float; the attributes state that, and a manifest maps names to ids (Friedman
//! and Jones 2015, "Fully automatic ID mattes with support for motion blur and transparency"). Knows no file: start
//! reading at [`Cryptomatte`].

use crate::render::IdShares;
use std::cmp::Reverse;
use std::collections::BTreeMap;

/// Masks of objects or of materials.
pub struct Cryptomatte<'a> {
    /// Name of the channels, as in `CryptoObject00.R`.
    pub name: &'a str,
    /// The name per id; ids with the same name share a mask.
    pub names: &'a [String],
    /// Shares per pixel.
    pub shares: &'a [IdShares],
    /// Samples per pixel, to which shares are relative.
    pub samples: u32,
}

/// Pairs of id and coverage per group of four channels.
const PAIRS: usize = 2;

impl Cryptomatte<'_> {
    /// Groups of four channels with names and values, row by row from the top.
    pub fn channels(&self) -> Vec<(String, Vec<f32>)> {
        let ids: Vec<f32> = self.names.iter().map(|name| f32::from_bits(id_of(name))).collect();
        let n_groups = IdShares::RANKS.div_ceil(PAIRS);
        let channel = |group: usize, c: &str| (format!("{}{group:02}.{c}", self.name), Vec::new());
        let mut channels: Vec<(String, Vec<f32>)> =
            (0..n_groups).flat_map(|group| ["R", "G", "B", "A"].map(|c| channel(group, c))).collect();
        channels.iter_mut().for_each(|(_, numbers)| numbers.reserve_exact(self.shares.len()));
        for shares in self.shares {
            let ranks = self.by_name(shares);
            for rank in 0..IdShares::RANKS {
                let (id, samples) = ranks[rank];
                let id = ids.get(id as usize).copied().filter(|_| samples > 0).unwrap_or(0.0);
                channels[2 * rank].1.push(id);
                channels[2 * rank + 1].1.push(samples as f32 / self.samples as f32);
            }
        }
        channels
    }

    /// Merges the ranks of a pixel with the same name.
    fn by_name(&self, shares: &IdShares) -> [(u32, u32); IdShares::RANKS] {
        let mut ranks = shares.ranks;
        let mut n = 0;
        for (id, samples) in shares.iter() {
            let name = self.names.get(id as usize);
            match ranks[..n].iter().position(|&(known, _)| self.names.get(known as usize) == name) {
                Some(at) => ranks[at].1 += samples,
                None => {
                    ranks[n] = (id, samples);
                    n += 1;
                }
            }
        }
        ranks[n..].fill((u32::MAX, 0));
        ranks.sort_by_key(|&(_, samples)| Reverse(samples));
        ranks
    }

    /// Attributes of the image: names and values.
    pub fn attributes(&self) -> [(String, String); 4] {
        let key = format!("{:08x}", murmur3(self.name.as_bytes()))[..7].to_owned();
        let attribute = |what: &str, value: String| (format!("cryptomatte/{key}/{what}"), value);
        [
            attribute("name", self.name.to_owned()),
            attribute("hash", "MurmurHash3_32".to_owned()),
            attribute("conversion", "uint32_to_float32".to_owned()),
            attribute("manifest", self.manifest()),
        ]
    }

    /// Names and ids as JSON.
    fn manifest(&self) -> String {
        let entries: BTreeMap<&str, String> =
            self.names.iter().map(|name| (name.as_str(), format!("{:08x}", id_of(name)))).collect();
        serde_json::to_string(&entries).expect("a map of strings is JSON")
    }
}

/// Returns the bits of the float that identifies a name: its hash, modified so that it is neither infinite, NaN nor
/// denormal.
fn id_of(name: &str) -> u32 {
    let hash = murmur3(name.as_bytes());
    match hash >> 23 & 0xff {
        0 | 0xff => hash ^ 1 << 23,
        _ => hash,
    }
}

/// MurmurHash3, 32 bits, seed 0 (Appleby 2011).
fn murmur3(bytes: &[u8]) -> u32 {
    let mixed = |k: u32| k.wrapping_mul(0xcc9e_2d51).rotate_left(15).wrapping_mul(0x1b87_3593);
    let mut blocks = bytes.chunks_exact(4);
    let mut hash = 0_u32;
    for block in &mut blocks {
        let k = u32::from_le_bytes(block.try_into().expect("four bytes"));
        hash = (hash ^ mixed(k)).rotate_left(13).wrapping_mul(5).wrapping_add(0xe654_6b64);
    }
    let tail = blocks.remainder();
    if !tail.is_empty() {
        let mut last = [0; 4];
        last[..tail.len()].copy_from_slice(tail);
        hash ^= mixed(u32::from_le_bytes(last));
    }
    hash ^= bytes.len() as u32;
    hash = (hash ^ hash >> 16).wrapping_mul(0x85eb_ca6b);
    hash = (hash ^ hash >> 13).wrapping_mul(0xc2b2_ae35);
    hash ^ hash >> 16
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reference values of other implementations.
    #[test]
    fn hashes_are_those_of_everybody_else() {
        for (text, hash) in [
            ("", 0),
            ("test", 0xba6b_d213),
            ("Hello, world!", 0xc036_3e43),
            ("The quick brown fox jumps over the lazy dog", 0x2e4f_f723),
        ] {
            assert_eq!(murmur3(text.as_bytes()), hash, "{text}");
        }
        // The example in the specification.
        assert_eq!(format!("{:08x}", id_of("hello")), "248bfa47");
    }

    #[test]
    fn ids_are_ordinary_numbers() {
        let ids = (0..200_000).map(|i| f32::from_bits(id_of(&format!("object {i}"))));
        assert!(ids.into_iter().all(f32::is_normal));
    }

    #[test]
    fn pixels_have_pairs_in_order_and_one_name_is_one_thing() {
        let names = ["a", "b", "a"].map(str::to_owned);
        let mut shares = IdShares::NONE;
        shares.ranks[..3].copy_from_slice(&[(1, 4), (0, 3), (2, 2)]);
        let matte = Cryptomatte { name: "CryptoObject", names: &names, shares: &[shares, IdShares::NONE], samples: 10 };
        let channels = matte.channels();
        let named: Vec<&str> = channels.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(
            named[..5],
            ["CryptoObject00.R", "CryptoObject00.G", "CryptoObject00.B", "CryptoObject00.A", "CryptoObject01.R"]
        );
        assert_eq!(channels.len(), 12);
        let id = |name| f32::from_bits(id_of(name));
        let first: Vec<f32> = channels.iter().map(|(_, numbers)| numbers[0]).collect();
        assert_eq!(first[..6], [id("a"), 0.5, id("b"), 0.4, 0.0, 0.0]);
        assert!(channels.iter().all(|(_, numbers)| numbers[1] == 0.0), "nothing covers the second");
        let [name, hash, conversion, manifest] = matte.attributes();
        assert!(name.0.starts_with("cryptomatte/") && name.0.ends_with("/name") && name.1 == "CryptoObject");
        assert_eq!((hash.1.as_str(), conversion.1.as_str()), ("MurmurHash3_32", "uint32_to_float32"));
        let parsed: BTreeMap<String, String> = serde_json::from_str(&manifest.1).unwrap();
        assert_eq!(parsed["a"], format!("{:08x}", id_of("a")));
        assert_eq!(parsed.len(), 2);
    }
}
