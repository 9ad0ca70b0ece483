//! Image files as textures: decoded once, within limits.

use crate::gltf::images::{part_of_model, picture_of};
use crate::ktx2;
use crate::pfm;
use bytemuck::allocation::try_cast_vec;
use firstlight_files::input_file::{FileKind, InputFile, ReadError};
use firstlight_files::limits::{Budget, Limits, has_room};
use firstlight_render::{ImageTexture, Texels};
use glam::Vec3;
use image::codecs::hdr::HdrDecoder;
use image::{ColorType, DynamicImage, ImageDecoder, ImageFormat, ImageReader};
use std::io::{BufRead, BufReader, Cursor, Seek, SeekFrom};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// Maximum width and height, pixels.
const MAX_SIDE: u32 = 32_768;
/// Bytes that the decoder may allocate per pixel of the largest image.
const BYTES_A_PIXEL: u64 = 16;

/// Why an image cannot be read; the text follows its path.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PictureError {
    /// The file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The model that contains it cannot be read.
    #[error("{0}")]
    Model(String),
    /// Not a supported image format.
    #[error("unsupported image format: use PNG, JPEG, WebP, BMP, TGA, TIFF, GIF, DDS, PNM, PFM, KTX2, HDR or EXR")]
    Format,
    /// A PFM file that is damaged.
    #[error("cannot be decoded: {0}")]
    Pfm(String),
    /// A KTX2 file that is damaged, or that is no texture of Basis Universal.
    #[error("cannot be decoded: {0}")]
    Ktx2(String),
    /// The image says that it has no pixels.
    #[error("has no pixels")]
    Empty,
    /// The image has more pixels than the limits allow.
    #[error("has {width} x {height} pixels, above the limit of {limit} pixels for images: {}", Limits::advice())]
    TooLarge {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
        /// Pixels that an image may have.
        limit: u64,
    },
    /// All images of the scene together take more memory than the limits allow.
    #[error("is left out: the images of the scene take more than {} MiB together: {}", limit >> 20, Limits::advice())]
    TooLargeTogether {
        /// Bytes that they may take.
        limit: u64,
    },
    /// There is not enough memory to decode the image.
    #[error("has {width} x {height} pixels, for which there is not enough memory")]
    NoMemory {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
    },
    /// The image is truncated or damaged, or uses a feature that the decoder does not support.
    #[error("cannot be decoded: {0}")]
    Decode(#[from] image::ImageError),
}

/// The memory that the images of a scene may still take, all together.
#[derive(Debug)]
pub(crate) struct ImageBudget(Budget);

impl Default for ImageBudget {
    fn default() -> Self {
        Self(Budget::new(Limits::of_this_process().scene_image_bytes))
    }
}

impl ImageBudget {
    fn take(&self, bytes: u64) -> Result<(), PictureError> {
        self.0.take(bytes).map_err(|limit| PictureError::TooLargeTogether { limit })
    }
}

impl From<PictureError> for String {
    fn from(error: PictureError) -> Self {
        error.to_string()
    }
}

/// Reads PNG, JPEG, WebP, BMP, TGA, TIFF, GIF (its first image), DDS (DXT1 to DXT5), PNM, KTX2 (ETC1S, UASTC), HDR or EXR,
/// each in its own bit depth. Also returns a warning if invalid values were replaced.
///
/// # Errors
/// Like [`read_picture_within`].
pub fn read_picture(path: &Path) -> Result<(ImageTexture, Option<String>), PictureError> {
    read_picture_within(path, &Limits::of_this_process())
}

/// Like [`read_picture`], one of the images of a scene.
///
/// # Errors
/// Like [`read_picture_within`], and if all of them together are too large.
pub(crate) fn read_picture_of_scene(
    path: &Path,
    budget: &ImageBudget,
) -> Result<(ImageTexture, Option<String>), PictureError> {
    let limits = Limits::of_this_process();
    texture(picture_reader(path, &limits)?, &limits, budget)
}

/// Like [`read_picture_of_scene`], from bytes inside another file.
///
/// # Errors
/// Like [`read_picture_of_scene`].
pub(crate) fn picture_of_bytes(
    bytes: &[u8],
    limits: &Limits,
    budget: &ImageBudget,
) -> Result<(ImageTexture, Option<String>), PictureError> {
    let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(ReadError::from)?;
    reader.limits(limits_of_decoder(limits));
    texture(reader, limits, budget)
}

/// Like [`read_picture`], with the given limits.
///
/// # Errors
/// If the file cannot be read, is in none of these formats, is too large or cannot be decoded.
pub fn read_picture_within(path: &Path, limits: &Limits) -> Result<(ImageTexture, Option<String>), PictureError> {
    if let Some((model, number)) = part_of_model(path) {
        let bytes = picture_of(&model, number).map_err(|error| PictureError::Model(error.to_string()))?;
        return picture_of_bytes(&bytes, limits, &ImageBudget::default());
    }
    texture(picture_reader(path, limits)?, limits, &ImageBudget::default())
}

fn texture<R: BufRead + Seek>(
    reader: ImageReader<R>,
    limits: &Limits,
    budget: &ImageBudget,
) -> Result<(ImageTexture, Option<String>), PictureError> {
    let picture = decode_counted(reader, limits, budget)?;
    let (width, height) = (picture.width(), picture.height());
    let (texels, bad) = texels_of(picture);
    let warning = (bad > 0).then(|| format!("{bad} pixels are negative or not finite and were set to black"));
    Ok((ImageTexture { width, height, texels }, warning))
}

/// The pixels in their own bit depth, and the number of pixels that were invalid colours and are now black.
pub(crate) fn texels_of(picture: DynamicImage) -> (Texels, usize) {
    let texels = match picture {
        DynamicImage::ImageLuma8(pixels) => Texels::U8 { channels: 1, data: pixels.into_raw() },
        DynamicImage::ImageLumaA8(pixels) => Texels::U8 { channels: 2, data: pixels.into_raw() },
        DynamicImage::ImageRgb8(pixels) => Texels::U8 { channels: 3, data: pixels.into_raw() },
        DynamicImage::ImageRgba8(pixels) => Texels::U8 { channels: 4, data: pixels.into_raw() },
        DynamicImage::ImageLuma16(pixels) => Texels::U16 { channels: 1, data: pixels.into_raw() },
        DynamicImage::ImageLumaA16(pixels) => Texels::U16 { channels: 2, data: pixels.into_raw() },
        DynamicImage::ImageRgb16(pixels) => Texels::U16 { channels: 3, data: pixels.into_raw() },
        DynamicImage::ImageRgba16(pixels) => Texels::U16 { channels: 4, data: pixels.into_raw() },
        other => {
            let numbers = other.into_rgb32f().into_raw();
            // Without a copy, unless the memory ends within a pixel.
            let mut texels: Vec<Vec3> = try_cast_vec(numbers).unwrap_or_else(|(_, numbers)| {
                numbers.as_chunks().0.iter().map(|&rgb| Vec3::from_array(rgb)).collect()
            });
            let is_good = |texel: &Vec3| texel.is_finite() && texel.cmpge(Vec3::ZERO).all();
            let bad = texels.iter().filter(|texel| !is_good(texel)).count();
            texels.iter_mut().filter(|texel| !is_good(texel)).for_each(|texel| *texel = Vec3::ZERO);
            return (Texels::F32(texels), bad);
        }
    };
    (texels, 0)
}

/// Alpha of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Alpha {
    /// The image has none.
    Missing,
    /// The same everywhere: it says nothing.
    Uniform,
    /// It differs from pixel to pixel.
    Varies,
}

/// Whether alpha of an image says anything, for maps that do not tell their channel. Decodes images with alpha.
///
/// - `budget`: pixels that may be decoded for this.
///
/// # Errors
/// Like [`read_picture`].
pub(crate) fn alpha_of(path: &Path, budget: &ImageBudget) -> Result<Alpha, PictureError> {
    let limits = Limits::of_this_process();
    let reader = picture_reader(path, &limits)?;
    if matches!(reader.format(), None | Some(ImageFormat::Hdr)) {
        return Ok(Alpha::Missing);
    }
    let decoder = reader.into_decoder()?;
    if !decoder.color_type().has_alpha() {
        return Ok(Alpha::Missing);
    }
    let picture = decode_within(decoder, &limits, budget)?;
    let pixels = picture.into_luma_alpha16();
    let mut alphas = pixels.pixels().map(|pixel| pixel.0[1]);
    let first = alphas.next();
    Ok(if alphas.all(|alpha| Some(alpha) == first) { Alpha::Uniform } else { Alpha::Varies })
}

/// A reader for an image whose format is detected from its first bytes, or from the extension for TGA, which has no
/// signature; nothing is decoded yet.
pub fn picture_reader(
    path: &Path,
    limits: &Limits,
) -> Result<ImageReader<BufReader<InputFile<'static>>>, PictureError> {
    let file = InputFile::open_within(path, FileKind::Image, FileKind::Image.limit(limits));
    let mut reader =
        file.and_then(|file| ImageReader::new(BufReader::new(file)).with_guessed_format().map_err(ReadError::from))?;
    if reader.format().is_none() && path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("tga")) {
        reader.set_format(ImageFormat::Tga);
    }
    reader.limits(limits_of_decoder(limits));
    Ok(reader)
}

fn limits_of_decoder(limits: &Limits) -> image::Limits {
    let mut of_decoder = image::Limits::default();
    of_decoder.max_image_width = Some(MAX_SIDE);
    of_decoder.max_image_height = Some(MAX_SIDE);
    of_decoder.max_alloc = Some(limits.picture_pixels.saturating_mul(BYTES_A_PIXEL));
    of_decoder
}

/// First bytes of HDR files. The full signature is `#?RADIANCE`, but many programs write `#?RGBE`.
const HDR: &[u8] = b"#?";

/// Decodes the image if it has no more pixels than the limit.
pub fn decode_picture<R: BufRead + Seek>(
    reader: ImageReader<R>,
    limits: &Limits,
) -> Result<DynamicImage, PictureError> {
    decode_counted(reader, limits, &ImageBudget::default())
}

fn decode_counted<R: BufRead + Seek>(
    reader: ImageReader<R>,
    limits: &Limits,
    budget: &ImageBudget,
) -> Result<DynamicImage, PictureError> {
    if reader.format() == Some(ImageFormat::Tiff) {
        let mut bytes = reader.into_inner();
        if !tiff_counts_fit(&mut bytes).map_err(ReadError::from)? {
            return Err(PictureError::Format);
        }
        let mut reader = ImageReader::with_format(bytes, ImageFormat::Tiff);
        reader.limits(limits_of_decoder(limits));
        return decode_within(reader.into_decoder()?, limits, budget);
    }
    if reader.format().is_some_and(|format| format != ImageFormat::Hdr) {
        return decode_within(reader.into_decoder()?, limits, budget);
    }
    let mut bytes = reader.into_inner();
    if bytes.fill_buf().map_err(ReadError::from)?.starts_with(ktx2::SIGNATURE) {
        let mut whole = Vec::new();
        bytes.read_to_end(&mut whole).map_err(ReadError::from)?;
        let (width, height) = ktx2::size(&whole).map_err(PictureError::Ktx2)?;
        let is_large = width.max(height) > MAX_SIDE || u64::from(width) * u64::from(height) > limits.picture_pixels;
        if is_large {
            return Err(PictureError::TooLarge { width, height, limit: limits.picture_pixels });
        }
        let bytes = 4 * u64::from(width) * u64::from(height);
        budget.take(bytes)?;
        check_memory(width, height, bytes)?;
        return ktx2::decode(&whole).map_err(PictureError::Ktx2);
    }
    let start = bytes.fill_buf().map_err(ReadError::from)?;
    if pfm::is_pfm(start) {
        let header = pfm::Header::read(&mut bytes).map_err(PictureError::Pfm)?;
        let (width, height) = (header.width, header.height);
        if width.max(height) > MAX_SIDE || u64::from(width) * u64::from(height) > limits.picture_pixels {
            return Err(PictureError::TooLarge { width, height, limit: limits.picture_pixels });
        }
        let of_texels = u64::from(width) * u64::from(height) * texel_bytes(ColorType::Rgb32F);
        budget.take(of_texels)?;
        check_memory(width, height, of_texels)?;
        return header.pixels(bytes).map_err(PictureError::Pfm);
    }
    if !start.starts_with(HDR) {
        return Err(PictureError::Format);
    }
    decode_within(HdrDecoder::new_nonstrict(bytes)?, limits, budget)
}

/// Whether the lists that the first directory of a TIFF file declares are no longer than the file. The decoder makes room
/// for them before it knows of any limit. Afterwards the reader is at the beginning.
fn tiff_counts_fit(reader: &mut (impl BufRead + Seek)) -> std::io::Result<bool> {
    let length = reader.seek(SeekFrom::End(0))?;
    reader.rewind()?;
    let mut start = [0; 8];
    reader.read_exact(&mut start)?;
    let is_little = start[0] == b'I';
    let short = |bytes: [u8; 2]| if is_little { u16::from_le_bytes(bytes) } else { u16::from_be_bytes(bytes) };
    let long = |bytes: [u8; 4]| if is_little { u32::from_le_bytes(bytes) } else { u32::from_be_bytes(bytes) };
    /// The other one has numbers of 64 bits.
    const CLASSIC: u16 = 42;
    if short([start[2], start[3]]) != CLASSIC {
        return Ok(false);
    }
    reader.seek(SeekFrom::Start(long([start[4], start[5], start[6], start[7]]).into()))?;
    let mut count = [0; 2];
    let mut entry = [0; 12];
    let mut fits = reader.read_exact(&mut count).is_ok();
    for _ in 0..short(count) {
        fits &= reader.read_exact(&mut entry).is_ok();
        fits = fits && u64::from(long([entry[4], entry[5], entry[6], entry[7]])) <= length;
        if !fits {
            break;
        }
    }
    reader.rewind()?;
    Ok(fits)
}

fn decode_within(
    decoder: impl ImageDecoder,
    limits: &Limits,
    budget: &ImageBudget,
) -> Result<DynamicImage, PictureError> {
    // A few bytes can claim any size: it is checked before decoding.
    let (width, height) = decoder.dimensions();
    let pixels = u64::from(width) * u64::from(height);
    if pixels == 0 {
        return Err(PictureError::Empty);
    }
    if pixels > limits.picture_pixels {
        return Err(PictureError::TooLarge { width, height, limit: limits.picture_pixels });
    }
    let bytes = pixels * texel_bytes(decoder.color_type());
    budget.take(bytes)?;
    let _alone = (bytes > LARGE).then(|| DECODING.lock().unwrap_or_else(PoisonError::into_inner));
    check_memory(width, height, bytes)?;
    Ok(DynamicImage::from_decoder(decoder)?)
}

/// Bytes from which on images are decoded one after the other: each takes its memory twice meanwhile.
const LARGE: u64 = 256 << 20;

static DECODING: Mutex<()> = Mutex::new(());

/// Bytes of a pixel as a texture.
fn texel_bytes(color: ColorType) -> u64 {
    match color {
        ColorType::Rgb32F | ColorType::Rgba32F => size_of::<Vec3>() as u64,
        color => color.bytes_per_pixel().into(),
    }
}

/// Whether there is room for an image and for what its decoder takes besides.
fn check_memory(width: u32, height: u32, bytes: u64) -> Result<(), PictureError> {
    if has_room(bytes.saturating_mul(2)) { Ok(()) } else { Err(PictureError::NoMemory { width, height }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eight_bit_pictures_are_decoded_to_linear_light() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("two.png");
        image::RgbImage::from_raw(2, 1, vec![0, 188, 255, 255, 0, 0]).unwrap().save(&path).unwrap();
        let (picture, warning) = read_picture(&path).unwrap();
        assert_eq!((picture.width, picture.height, warning), (2, 1, None));
        // Byte 188 is close to half the linear value.
        assert!(picture.linear(0).abs_diff_eq(Vec3::new(0.0, 0.5029, 1.0), 1e-3), "{}", picture.linear(0));
        assert_eq!(picture.linear(1), Vec3::X);
        assert_eq!(picture.bytes(), 6, "in its own depth");
    }

    /// Both signatures of HDR files are in use.
    #[test]
    fn hdr_files_of_any_program_are_read() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("sky.hdr");
        for signature in ["#?RADIANCE", "#?RGBE"] {
            let mut bytes = format!("{signature}\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n").into_bytes();
            bytes.extend([128, 64, 0, 129, 128, 128, 128, 133]);
            std::fs::write(&path, bytes).unwrap();
            let (picture, _) = read_picture(&path).unwrap();
            assert_eq!([picture.linear(0), picture.linear(1)], [Vec3::new(1.0, 0.5, 0.0), Vec3::splat(16.0)]);
        }
        std::fs::write(&path, "#?RGBE\n").unwrap();
        assert!(read_picture(&path).unwrap_err().to_string().contains("decoded"));
    }

    #[test]
    fn pictures_without_pixels_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        for (name, bytes) in [
            ("a.ppm", "P6\n0 1\n255\n"),
            ("a.pam", "P7\nWIDTH 0\nHEIGHT 1\nDEPTH 3\nMAXVAL 255\nTUPLTYPE RGB\nENDHDR\n"),
            ("a.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 0 +X 2\n"),
        ] {
            let path = dir.path().join(name);
            std::fs::write(&path, bytes).unwrap();
            assert!(matches!(read_picture(&path), Err(PictureError::Empty)), "{name}");
        }
    }

    /// A few hundred bytes that would decode to gigabytes are rejected by their size; devices and pipes are not opened.
    #[test]
    fn pictures_beyond_the_limit_are_refused_before_they_are_decoded() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("wide.png");
        image::GrayImage::new(100, 40).save(&path).unwrap();
        let limits = Limits { picture_pixels: 3999, ..Limits::USUAL };
        let error = read_picture_within(&path, &limits).unwrap_err().to_string();
        assert!(error.contains("100 x 40") && error.contains("3999") && error.contains(Limits::VARIABLE), "{error}");
        assert!(read_picture_within(&path, &Limits { picture_pixels: 4000, ..limits }).is_ok());
        #[cfg(unix)]
        assert!(read_picture(Path::new("/dev/zero")).unwrap_err().to_string().contains("not a regular file"));
    }

    #[test]
    fn formats_of_models_are_read() {
        let dir = tempfile::tempdir().unwrap();
        let pixels = image::RgbImage::from_raw(2, 1, vec![255, 0, 0, 0, 0, 255]).unwrap();
        for name in ["a.bmp", "a.tga", "A.TGA", "a.tiff", "a.gif", "a.ppm"] {
            let path = dir.path().join(name);
            DynamicImage::from(pixels.clone()).save(&path).unwrap();
            let (picture, warning) = read_picture(&path).unwrap_or_else(|error| panic!("{name}: {error}"));
            assert_eq!([picture.linear(0), picture.linear(1)], [Vec3::X, Vec3::Z], "{name}");
            assert_eq!((picture.width, picture.height, warning), (2, 1, None));
            let limits = Limits { picture_pixels: 1, ..Limits::USUAL };
            let error = read_picture_within(&path, &limits).unwrap_err().to_string();
            assert!(error.contains("2 x 1") || error.contains("limit"), "{name}: {error}");
        }
        // 4 x 4 pixels of DXT1: one block of two colours of 16 bits, and two bits per pixel.
        let mut dds = [0_u32; 32];
        (dds[0], dds[1], dds[2], dds[3], dds[4]) = (u32::from_le_bytes(*b"DDS "), 124, 0x1007, 4, 4);
        (dds[19], dds[20], dds[21], dds[27]) = (32, 4, u32::from_le_bytes(*b"DXT1"), 0x1000);
        let mut bytes: Vec<u8> = dds.iter().flat_map(|word| word.to_le_bytes()).collect();
        bytes.extend([0x00, 0xf8, 0x1f, 0x00, 0, 0, 0, 0]);
        std::fs::write(dir.path().join("a.dds"), bytes).unwrap();
        let (picture, _) = read_picture(&dir.path().join("a.dds")).unwrap();
        assert_eq!((picture.width, picture.linear(15)), (4, Vec3::X));
    }

    #[test]
    fn alpha_counts_where_it_varies() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.png");
        let alpha = |pixels: Vec<u8>| {
            image::GrayAlphaImage::from_raw(2, 1, pixels).unwrap().save(&path).unwrap();
            alpha_of(&path, &ImageBudget::default()).unwrap()
        };
        assert_eq!([alpha(vec![9, 255, 7, 255]), alpha(vec![9, 0, 9, 255])], [Alpha::Uniform, Alpha::Varies]);
        image::GrayImage::new(2, 1).save(&path).unwrap();
        assert_eq!(alpha_of(&path, &ImageBudget::default()).unwrap(), Alpha::Missing);
        assert!(alpha_of(&dir.path().join("none.png"), &ImageBudget::default()).is_err());
    }

    #[test]
    fn all_images_of_a_scene_have_a_limit_together() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("small.png");
        image::GrayImage::new(10, 10).save(&path).unwrap();
        let budget = ImageBudget(Budget::new(250));
        let read = || read_picture_of_scene(&path, &budget).map(drop).map_err(|error| error.to_string());
        assert_eq!((read(), read()), (Ok(()), Ok(())));
        assert!(read().unwrap_err().contains("more than 0 MiB together"));
    }

    #[test]
    fn broken_pictures_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("broken.png");
        std::fs::write(&path, b"\x89PNG\r\n\x1a\nnothing").unwrap();
        assert!(read_picture(&path).unwrap_err().to_string().contains("decoded"));
        std::fs::write(&path, b"just text").unwrap();
        assert!(read_picture(&path).is_err());
        assert!(read_picture(&dir.path().join("none.png")).unwrap_err().to_string().contains("no such file"));
    }
}
