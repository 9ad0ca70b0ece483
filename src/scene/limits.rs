//! How much a file of unknown origin may ask for, and where one number raises all of it.

use std::fs::File;
use std::io;
use std::path::Path;

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
    };

    /// The usual limits times the number in [`Self::VARIABLE`], where there is one.
    pub fn of_this_process() -> Self {
        let factor = std::env::var(Self::VARIABLE).ok().and_then(|text| text.trim().parse().ok());
        Self::USUAL.times(factor.unwrap_or(1.0))
    }

    /// - `factor`: positive and finite; anything else counts as 1.
    pub fn times(self, factor: f64) -> Self {
        let factor = if factor > 0.0 && factor.is_finite() { factor } else { 1.0 };
        // The conversion saturates.
        let scaled = |limit: u64| (limit as f64 * factor) as u64;
        Self {
            model_bytes: scaled(self.model_bytes),
            library_bytes: scaled(self.library_bytes),
            scene_bytes: scaled(self.scene_bytes),
            picture_pixels: scaled(self.picture_pixels),
            film_pixels: scaled(self.film_pixels),
            note_bytes: scaled(self.note_bytes),
        }
    }

    /// What to do about a refusal.
    pub(crate) fn advice() -> String {
        format!("set {}=2 in the environment to double all limits", Self::VARIABLE)
    }
}

/// Opens a file whose end is known: a pipe would be waited for and a device might never end.
pub(crate) fn open_file(path: &Path) -> io::Result<File> {
    // Asked by name first, for opening a pipe already waits.
    let info = std::fs::metadata(path)?;
    if info.is_dir() {
        return Err(io::Error::other("it is a folder"));
    }
    if !info.is_file() {
        return Err(io::Error::other("it is not a regular file"));
    }
    File::open(path)
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

    #[test]
    fn folders_and_devices_are_not_opened() {
        assert!(open_file(&std::env::temp_dir()).unwrap_err().to_string().contains("folder"));
        #[cfg(unix)]
        assert!(open_file(Path::new("/dev/zero")).unwrap_err().to_string().contains("regular"));
    }
}
