//! Limits for files of unknown origin, and the variable that scales all of them.

use crate::printable::name;
use std::sync::atomic::{AtomicU64, Ordering};

/// Bytes of an image file besides its pixels and its metadata: profiles, thumbnails, tables.
const BESIDE: u64 = 64 << 20;

/// Sizes above which files are rejected. `docs/stability.md` gives the memory that corresponds to each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Bytes of a model; loading takes up to about 25 bytes of memory per byte.
    pub model_bytes: u64,
    /// Bytes of a material library.
    pub library_bytes: u64,
    /// Bytes of the text of a scene; objects of twenty bytes take about 100 bytes of memory per byte to read, and 220 to
    /// render.
    pub scene_bytes: u64,
    /// Pixels of an image; decoding takes up to 32 bytes of memory per pixel.
    pub picture_pixels: u64,
    /// Bytes of all images of a scene together, as they stay in memory.
    pub scene_image_bytes: u64,
    /// Bytes of all meshes of a scene together, and of the files that are read for them.
    pub scene_mesh_bytes: u64,
    /// Emissive triangles and spheres of a scene, besides those that its files have room for; 700 bytes each.
    pub scene_lights: u64,
    /// Pixels of a film that is read; reading takes up to 700 bytes of memory per pixel.
    pub film_pixels: u64,
    /// Bytes of the metadata in an image, with the scene that it may hold.
    pub note_bytes: u64,
    /// Bytes of a recording; reading takes up to about 10 bytes of memory per byte.
    pub recording_bytes: u64,
    /// Bytes of all files of an archive.
    pub archive_bytes: u64,
    /// Bytes of settings, saved views and other small files of the program.
    pub settings_bytes: u64,
}

/// Whether so many bytes of memory can be had at once: where they cannot, work that needs them is refused, since an
/// allocation that fails ends the process.
pub fn has_room(bytes: u64) -> bool {
    let mut room: Vec<u8> = Vec::new();
    usize::try_from(bytes).is_ok_and(|bytes| room.try_reserve_exact(bytes).is_ok())
}

/// What everything of one kind in a scene may still take, all together.
#[derive(Debug)]
pub struct Budget {
    limit: u64,
    used: AtomicU64,
}

impl Budget {
    /// All of the limit is left.
    pub fn new(limit: u64) -> Self {
        Self { limit, used: AtomicU64::new(0) }
    }

    /// Takes so many bytes of what is left.
    ///
    /// # Errors
    /// The limit, if there are fewer.
    pub fn take(&self, bytes: u64) -> Result<(), u64> {
        let used = |used: u64| used.checked_add(bytes).filter(|used| *used <= self.limit);
        self.used.fetch_update(Ordering::Relaxed, Ordering::Relaxed, used).map(drop).map_err(|_| self.limit)
    }
}

impl Limits {
    /// The environment variable that multiplies all limits.
    pub const VARIABLE: &str = "FIRSTLIGHT_LIMITS";

    /// The default limits, for current desktop computers.
    pub const USUAL: Self = Self {
        model_bytes: 1 << 30,
        library_bytes: 16 << 20,
        scene_bytes: 256 << 20,
        picture_pixels: 1 << 27,
        scene_image_bytes: 4 << 30,
        scene_mesh_bytes: 4 << 30,
        scene_lights: 1 << 21,
        film_pixels: 1 << 26,
        note_bytes: 16 << 20,
        recording_bytes: 256 << 20,
        archive_bytes: 16 << 30,
        settings_bytes: 1 << 20,
    };

    /// The default limits times the number in [`Self::VARIABLE`], if it is set.
    pub fn of_this_process() -> Self {
        Self::USUAL.times(std::env::var(Self::VARIABLE).ok().and_then(|text| factor_of(&text)).unwrap_or(1.0))
    }

    /// A warning if [`Self::VARIABLE`] is set to an invalid value.
    pub fn misunderstood() -> Option<String> {
        let text = std::env::var_os(Self::VARIABLE)?;
        let text = text.to_string_lossy();
        factor_of(&text).is_none().then(|| {
            format!("{} is `{}`, which is not a positive number: using the default limits", Self::VARIABLE, name(&text))
        })
    }

    /// Scales all limits.
    ///
    /// - `factor`: positive and finite; any other value counts as 1.
    pub fn times(self, factor: f64) -> Self {
        let factor = if is_factor(factor) { factor } else { 1.0 };
        // The conversion saturates.
        let scaled = |limit: u64| (limit as f64 * factor) as u64;
        Self {
            model_bytes: scaled(self.model_bytes),
            library_bytes: scaled(self.library_bytes),
            scene_bytes: scaled(self.scene_bytes),
            picture_pixels: scaled(self.picture_pixels),
            scene_image_bytes: scaled(self.scene_image_bytes),
            scene_mesh_bytes: scaled(self.scene_mesh_bytes),
            scene_lights: scaled(self.scene_lights),
            film_pixels: scaled(self.film_pixels),
            note_bytes: scaled(self.note_bytes),
            recording_bytes: scaled(self.recording_bytes),
            archive_bytes: scaled(self.archive_bytes),
            settings_bytes: scaled(self.settings_bytes),
        }
    }

    /// Bytes of an image file: the maximum number of pixels, uncompressed, plus metadata and other data.
    pub fn picture_bytes(&self) -> u64 {
        const BYTES_A_PIXEL: u64 = 16;
        self.picture_pixels.saturating_mul(BYTES_A_PIXEL).saturating_add(self.note_bytes).saturating_add(BESIDE)
    }

    /// Bytes of a film file, likewise.
    pub fn film_bytes(&self) -> u64 {
        /// About thirty channels of four bytes, and the overhead of compression.
        const BYTES_A_PIXEL: u64 = 160;
        self.film_pixels.saturating_mul(BYTES_A_PIXEL).saturating_add(self.note_bytes).saturating_add(BESIDE)
    }

    /// Bytes that this many compressed ones may stand for: more than in any scene, and less than a file of a megabyte
    /// needs to fill the memory.
    pub fn most_unpacked(packed: u64) -> u64 {
        const A_BYTE: u64 = 128;
        const ALWAYS: u64 = 16 << 20;
        ALWAYS.saturating_add(packed.saturating_mul(A_BYTE))
    }

    /// How to raise the limits.
    pub fn advice() -> String {
        format!("set {}=2 in the environment to double all limits", Self::VARIABLE)
    }
}

fn is_factor(factor: f64) -> bool {
    factor > 0.0 && factor.is_finite()
}

fn factor_of(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|&factor| is_factor(factor))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_factor_scales_all_limits_and_nonsense_none() {
        let twice = Limits::USUAL.times(2.0);
        assert_eq!((twice.model_bytes, twice.picture_pixels), (2 << 30, 1 << 28));
        for nonsense in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(Limits::USUAL.times(nonsense), Limits::USUAL);
        }
        assert_eq!(Limits::USUAL.times(1e30).model_bytes, u64::MAX);
    }
}
