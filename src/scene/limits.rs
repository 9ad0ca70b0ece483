//! How much a file of unknown origin may ask for, and where one number raises all of it.

use crate::printable::name;

/// Bytes of a picture file beside its pixels and its note: profiles, thumbnails, tables.
const BESIDE: u64 = 64 << 20;

/// What is refused for its size. `docs/stability.md` says what each number means in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Bytes of a model; loading takes up to about 25 bytes of memory for each.
    pub model_bytes: u64,
    /// Bytes of a material library.
    pub library_bytes: u64,
    /// Bytes of the text of a scene; reading takes up to about 25 bytes of memory for each.
    pub scene_bytes: u64,
    /// Pixels of a picture; decoding takes up to 32 bytes of memory for each.
    pub picture_pixels: u64,
    /// Pixels of a film that is read; that takes up to 700 bytes of memory for each.
    pub film_pixels: u64,
    /// Bytes of the note that a picture carries.
    pub note_bytes: u64,
    /// Bytes of a recording; reading takes up to about 10 bytes of memory for each.
    pub recording_bytes: u64,
    /// Bytes of settings, of the views of a scene, and of other small files of the program's own.
    pub settings_bytes: u64,
}

impl Limits {
    /// The environment variable that multiplies all limits.
    pub const VARIABLE: &str = "FIRSTLIGHT_LIMITS";

    /// What fits a machine of today.
    pub const USUAL: Self = Self {
        model_bytes: 1 << 30,
        library_bytes: 16 << 20,
        scene_bytes: 256 << 20,
        picture_pixels: 1 << 27,
        film_pixels: 1 << 26,
        note_bytes: 64 << 20,
        recording_bytes: 256 << 20,
        settings_bytes: 1 << 20,
    };

    /// The usual limits times the number in [`Self::VARIABLE`], where there is one.
    pub fn of_this_process() -> Self {
        Self::USUAL.times(std::env::var(Self::VARIABLE).ok().and_then(|text| factor_of(&text)).unwrap_or(1.0))
    }

    /// What is wrong with [`Self::VARIABLE`], where it says something that is no factor.
    pub fn misunderstood() -> Option<String> {
        let text = std::env::var_os(Self::VARIABLE)?;
        let text = text.to_string_lossy();
        factor_of(&text).is_none().then(|| {
            format!("{} is `{}`, which is not a positive number: using the default limits", Self::VARIABLE, name(&text))
        })
    }

    /// - `factor`: positive and finite; anything else counts as 1.
    pub fn times(self, factor: f64) -> Self {
        let factor = if is_factor(factor) { factor } else { 1.0 };
        // The conversion saturates.
        let scaled = |limit: u64| (limit as f64 * factor) as u64;
        Self {
            model_bytes: scaled(self.model_bytes),
            library_bytes: scaled(self.library_bytes),
            scene_bytes: scaled(self.scene_bytes),
            picture_pixels: scaled(self.picture_pixels),
            film_pixels: scaled(self.film_pixels),
            note_bytes: scaled(self.note_bytes),
            recording_bytes: scaled(self.recording_bytes),
            settings_bytes: scaled(self.settings_bytes),
        }
    }

    /// Bytes of a picture file: the most pixels, not compressed, and all that may stand beside them.
    pub fn picture_bytes(&self) -> u64 {
        const BYTES_A_PIXEL: u64 = 16;
        self.picture_pixels.saturating_mul(BYTES_A_PIXEL).saturating_add(self.note_bytes).saturating_add(BESIDE)
    }

    /// Bytes of a film, likewise.
    pub fn film_bytes(&self) -> u64 {
        /// Of some thirty channels of four bytes, and what packing may add.
        const BYTES_A_PIXEL: u64 = 160;
        self.film_pixels.saturating_mul(BYTES_A_PIXEL).saturating_add(self.note_bytes).saturating_add(BESIDE)
    }

    /// What to do about a refusal.
    pub(crate) fn advice() -> String {
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
