//! Memory for images, reserved before it is needed: an image that is too large is an error that says its size, instead
//! of the end of the process.

use crate::film::exact_sum::ExactSum;
use crate::film::features::FeatureBuffers;
use glam::{DVec3, Vec3};

/// There is not enough memory for an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("an image of {width} x {height} needs {}, more than is available: choose a smaller size", size(*.bytes))]
pub struct NoRoom {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Required memory in bytes.
    pub bytes: u64,
}

impl From<NoRoom> for std::io::Error {
    fn from(error: NoRoom) -> Self {
        Self::new(std::io::ErrorKind::OutOfMemory, error)
    }
}

/// Memory that is reserved until it is dropped. It is never written, so the reservation takes no time.
#[derive(Debug)]
pub struct Room {
    _memory: Vec<u8>,
}

/// What an image is used for besides its film: determines the bytes per pixel of the buffers for writing it, including
/// the largest possible compressed file in a list that doubles as it grows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// Four developed bytes, and three compressed ones, twice.
    Png,
    /// Three numbers, as rows and as channels, and compressed.
    Exr,
    /// All numbers of the film, as planes and as two channels each, and compressed.
    FilmFile,
    /// A film with feature buffers, or an image with all layers: the buffers, and more channels.
    Layers,
    /// Feature buffers, and the buffers of the denoiser.
    Denoised,
}

impl Purpose {
    fn bytes_a_pixel(self) -> u64 {
        match self {
            Self::Png => 4 + 4 * 3,
            Self::Exr => 12 + 12 + 2 * 12,
            Self::FilmFile => 8 * 18 + 4 * 8 + 12 + 12 + 3 * (4 * 47),
            Self::Layers => Self::FilmFile.bytes_a_pixel() + FeatureBuffers::BYTES_A_PIXEL as u64 + 3 * (4 * 45),
            Self::Denoised => FeatureBuffers::BYTES_A_PIXEL as u64 + 640,
        }
    }
}

/// Bytes per pixel of a film: its sum, its mean at the last power of two, and the last change of the mean.
pub(crate) const BYTES_A_PIXEL: usize = size_of::<ExactSum>() + size_of::<DVec3>() + size_of::<Vec3>();

/// Bytes per pixel of light tracing, if there is any.
pub(crate) const LIGHT_BYTES_A_PIXEL: usize = size_of::<ExactSum>() + size_of::<DVec3>() + size_of::<Vec3>();

/// Margin for the rest that a large image takes, such as the workers' memory: an eighth, and at most this many bytes.
const MOST_BESIDES: u64 = 32 << 20;

impl Room {
    /// Reserves memory for writing or reading files one after the other: as much as the largest of them needs.
    ///
    /// # Errors
    /// If there is not enough memory.
    pub fn for_files(width: u32, height: u32, purposes: &[Purpose]) -> Result<Self, NoRoom> {
        Self::of(width, height, most(purposes))
    }

    /// Reserves memory for a film and then for its purposes.
    ///
    /// - `light_traced`: whether the film will have sums of light tracing.
    ///
    /// # Errors
    /// If there is not enough memory.
    pub fn for_film(width: u32, height: u32, light_traced: bool, purposes: &[Purpose]) -> Result<Self, NoRoom> {
        let film = BYTES_A_PIXEL + size_of::<f32>() + if light_traced { LIGHT_BYTES_A_PIXEL } else { 0 };
        Self::of(width, height, film as u64 + most(purposes))
    }

    fn of(width: u32, height: u32, bytes_a_pixel: u64) -> Result<Self, NoRoom> {
        let bytes = (u64::from(width) * u64::from(height)).saturating_mul(bytes_a_pixel);
        let mut memory = Vec::new();
        let besides = (bytes / 8).min(MOST_BESIDES);
        match usize::try_from(bytes.saturating_add(besides)).map(|bytes| memory.try_reserve_exact(bytes)) {
            Ok(Ok(())) => Ok(Self { _memory: memory }),
            _ => Err(NoRoom { width, height, bytes }),
        }
    }
}

fn most(purposes: &[Purpose]) -> u64 {
    purposes.iter().map(|purpose| purpose.bytes_a_pixel()).max().unwrap_or(0)
}

/// Formats a number of bytes for messages.
fn size(bytes: u64) -> String {
    let mib = bytes as f64 / f64::from(1 << 20);
    if mib < 1024.0 { format!("{mib:.0} MiB") } else { format!("{:.1} GiB", mib / 1024.0) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::tiles::Film;

    #[test]
    fn what_cannot_be_had_is_refused_with_its_size() {
        let error = Room::for_film(u32::MAX, u32::MAX, true, &[Purpose::FilmFile]).unwrap_err();
        assert_eq!((error.width, error.height), (u32::MAX, u32::MAX));
        assert!(error.to_string().contains("GiB"), "{error}");
        assert!(Room::for_film(64, 64, true, &[Purpose::Png, Purpose::Exr]).is_ok());
        assert_eq!((size(3 << 20), size(3 << 30)), ("3 MiB".to_owned(), "3.0 GiB".to_owned()));
    }

    #[test]
    fn a_film_refuses_what_there_is_no_memory_for() {
        // More than any address space, in tiles that are small.
        let error = Film::try_new(1 << 31, 1 << 31).unwrap_err();
        assert_eq!((error.width, error.height), (1 << 31, 1 << 31));
        let film = Film::try_new(70, 40).unwrap();
        assert_eq!((film.width(), film.height(), film.means()), (70, 40, Film::new(70, 40).means()));
    }
}
