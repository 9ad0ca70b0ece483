//! Files that were written to do harm, and thousands of mutations of them: never a panic, a hang, or more memory
//! than the limits say. The same functions go through coverage-guided fuzzing in `fuzz/`.
//!
//! `FIRSTLIGHT_MUTATIONS`: how many mutations of each format instead of the usual number.

#[path = "../fuzz/drive.rs"]
mod drive;
#[path = "common/random.rs"]
mod random;

use random::Random;
use std::alloc::{GlobalAlloc, Layout, System};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// Counts what is allocated, and the most that it ever was.
struct Counting;

static NOW: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

// SAFETY: all memory comes from and goes back to the system's allocator; the counters own nothing.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let now = NOW.fetch_add(layout.size(), Ordering::Relaxed) + layout.size();
        PEAK.fetch_max(now, Ordering::Relaxed);
        // SAFETY: the caller's promise is passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        NOW.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: as above.
        unsafe { System.dealloc(memory, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// One format at a time, for memory is counted for the whole process.
static ALONE: Mutex<()> = Mutex::new(());

/// What numbers turn into.
const NUMBERS: [&[u8]; 16] = [
    b"0",
    b"-0",
    b"-1",
    b"1e-320",
    b"1e38",
    b"1e39",
    b"1e308",
    b"1e999",
    b"nan",
    b"inf",
    b"4294967296",
    b"2147483647",
    b"18446744073709551616",
    b"999999999999999999999999",
    b"0.1e-7",
    b"+.5",
];

/// One to four changes of the kinds that break parsers, or of numbers alone, which parsers let through.
fn mutated(random: &mut Random, seeds: &[Vec<u8>], numbers_only: bool) -> Vec<u8> {
    let mut bytes = seeds[random.below(seeds.len())].clone();
    for _ in 0..=random.below(4) {
        let (at, other) = (random.below(bytes.len()), random.below(bytes.len()));
        let (from, to) = (at.min(other), at.max(other));
        match if numbers_only { 6 } else { random.below(9) } {
            0 if !bytes.is_empty() => bytes[at] ^= 1 << random.below(8),
            1 if !bytes.is_empty() => bytes[at] = [0, 0xff, 0x7f, 0x80, b'\n', b'(', b'"', b'/'][random.below(8)],
            2 => bytes.truncate(at),
            3 if to - from < 4096 => drop(bytes.drain(from..to)),
            4 if to - from < 4096 => {
                let part = bytes[from..to].to_vec();
                let times = 1 + random.below(3);
                (0..times).for_each(|_| drop(bytes.splice(at..at, part.iter().copied())));
            }
            5 => {
                let seed = &seeds[random.below(seeds.len())];
                let cut = random.below(seed.len());
                bytes.truncate(at);
                bytes.extend_from_slice(&seed[cut..]);
            }
            6 => {
                // A number becomes another one.
                let is_digit = |byte: &u8| byte.is_ascii_digit() || b".-+".contains(byte);
                let Some(start) = (at..bytes.len()).find(|&i| bytes[i].is_ascii_digit()) else { continue };
                let end = (start..bytes.len()).find(|&i| !is_digit(&bytes[i])).unwrap_or(bytes.len());
                let number = NUMBERS[random.below(NUMBERS.len())];
                bytes.splice(start..end, number.iter().copied());
            }
            7 if bytes.len() >= 4 => {
                // Sizes in the headers of pictures.
                let at = at.min(bytes.len() - 4);
                let size = [0u32, 1, 0xffff_ffff, 0x7fff_ffff, 0x8000_0000, 32_768][random.below(6)];
                bytes[at..at + 4].copy_from_slice(&if random.below(2) == 0 {
                    size.to_be_bytes()
                } else {
                    size.to_le_bytes()
                });
            }
            _ => drop(bytes.splice(at..at, (0..random.below(8)).map(|_| 0).collect::<Vec<u8>>())),
        }
    }
    bytes.truncate(1 << 16);
    bytes
}

fn seeds(target: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds").join(target);
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files.iter().map(|file| std::fs::read(file).unwrap()).collect()
}

/// Runs all seeds and `usual` mutations; at no time may more than `bytes + factor · input` be allocated, and none may
/// take longer than a few seconds.
fn assault(target: &str, drive: fn(&[u8]), usual: usize, bytes: usize, factor: usize) {
    let _alone = ALONE.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let seeds = seeds(target);
    assert!(!seeds.is_empty());
    let count = std::env::var("FIRSTLIGHT_MUTATIONS").ok().and_then(|n| n.parse().ok()).unwrap_or(usual);
    let mut random = Random(0xF122);
    drive(&seeds[0]);
    let is_text = seeds.iter().all(|seed| !seed.contains(&0));
    let (start, mut largest) = (Instant::now(), 0);
    for i in 0..seeds.len() + count {
        let input =
            if i < seeds.len() { seeds[i].clone() } else { mutated(&mut random, &seeds, is_text && i % 2 == 0) };
        let before = NOW.load(Ordering::Relaxed);
        PEAK.store(before, Ordering::Relaxed);
        let clock = Instant::now();
        if std::panic::catch_unwind(|| drive(&input)).is_err() {
            let kept = std::env::temp_dir().join(format!("firstlight-hostile-{target}-{i}"));
            std::fs::write(&kept, &input).unwrap();
            panic!("{target} {i}: kept as {}", kept.display());
        }
        assert!(clock.elapsed() < Duration::from_secs(60), "{target} {i} took {:?}", clock.elapsed());
        let taken = PEAK.load(Ordering::Relaxed).saturating_sub(before);
        largest = largest.max(taken);
        assert!(taken <= bytes + factor * input.len(), "{target} {i}: {taken} bytes for {} of input", input.len());
    }
    println!(
        "{target}: {} inputs in {:.1} s, at most {largest} bytes",
        seeds.len() + count,
        start.elapsed().as_secs_f64()
    );
}

const MIB: usize = 1 << 20;

/// A test for each target: its function, the usual number of mutations, and the most memory, of its own and for each
/// byte of input.
macro_rules! assaults {
    ($($name:ident: $target:ident, $usual:expr, $bytes:expr, $factor:expr;)*) => {
        $(
            #[test]
            fn $name() {
                assault(stringify!($target), drive::$target, $usual, $bytes, $factor);
            }
        )*
    };
}

assaults! {
    models: obj, 2500, MIB, 64;
    ply_models: ply, 4000, MIB, 64;
    stl_models: stl, 2500, MIB, 64;
    gltf_models: gltf, 2500, 64 * MIB, 512;
    material_libraries: mtl, 2000, 16 * MIB, 64;
    scenes: scene, 4000, 2 * MIB, 64;
    pbrt_scenes: pbrt, 2500, 64 * MIB, 512;
    mitsuba_scenes: mitsuba, 2500, 64 * MIB, 512;
    tungsten_scenes: tungsten, 2500, 64 * MIB, 512;
    pictures: picture, 2500, 4 * MIB + 32 * drive::LIMITS.picture_pixels as usize, 8;
    whole_scenes_to_the_last_pixel: render, 3000, 64 * MIB, 64;
    films: film, 2000, 8 * MIB, 1200;
    metadata_of_images: metadata, 2000, 8 * MIB, 64;
}
