//! KTX2 files with textures of Basis Universal (ETC1S, UASTC), which `KHR_texture_basisu` refers to.
//!
//! Only the largest image is decoded. The crate `basisu` trusts the sizes that a file states: the caller compares
//! [`size`] with its limits first.
//!
//! Source: Khronos, "KTX File Format Specification" 2.0, §3 (file structure).

use basisu::{DecodeFlags, TargetFormat, Transcoder};
use image::{DynamicImage, RgbImage, RgbaImage};

/// First bytes of a KTX2 file.
pub(crate) const SIGNATURE: &[u8] = b"\xabKTX 20\xbb\r\n\x1a\n";

/// Levels of the largest image.
const MAX_LEVELS: u32 = 32;

/// Where the length of the keys with values is.
const KEYS_LENGTH: std::ops::Range<usize> = 60..64;

/// Width and height, pixels.
///
/// # Errors
/// If the file is truncated, or of another kind than an image of Basis Universal.
pub(crate) fn size(bytes: &[u8]) -> Result<(u32, u32), String> {
    let number = |at: usize| -> Result<u32, String> {
        let four = bytes.get(at..at + 4).ok_or("the file is truncated")?;
        Ok(u32::from_le_bytes([four[0], four[1], four[2], four[3]]))
    };
    let (format, width, height) = (number(12)?, number(20)?, number(24)?);
    let (depth, layers, faces) = (number(28)?, number(32)?, number(36)?);
    if format != 0 {
        let advice = "use ETC1S or UASTC, or another format of images";
        return Err(format!("only textures of Basis Universal are read from KTX2 files: {advice}"));
    }
    if width == 0 || height == 0 || depth > 1 || layers > 1 || faces != 1 {
        return Err("volumes, arrays and cube maps are not read".to_owned());
    }
    let long = |at: usize| Ok::<u64, String>(u64::from(number(at)?) | u64::from(number(at + 4)?) << 32);
    // Format descriptor, keys with values, global data and levels: offset and length.
    let levels = number(40)?;
    let mut parts = vec![(number(48)?.into(), number(52)?.into()), (number(56)?.into(), number(60)?.into())];
    parts.push((long(64)?, long(72)?));
    for level in 0..levels.clamp(1, MAX_LEVELS) as usize {
        parts.push((long(80 + 24 * level)?, long(88 + 24 * level)?));
    }
    let is_within =
        |(start, length): (u64, u64)| start.checked_add(length).is_some_and(|end| end <= bytes.len() as u64);
    if levels > MAX_LEVELS || !parts.into_iter().all(is_within) {
        return Err("it is damaged: a part of it lies beyond its end".to_owned());
    }
    // Offset, length and decompressed length of the largest level follow the header. A block of 4 x 4 pixels has at most
    // 16 bytes.
    if long(96)? > 16 * u64::from(width.div_ceil(4)) * u64::from(height.div_ceil(4)) {
        return Err("it says that it has more blocks than its size needs".to_owned());
    }
    Ok((width, height))
}

/// Decodes the image.
///
/// # Errors
/// Like [`size`], and if the data is damaged.
pub(crate) fn decode(bytes: &[u8]) -> Result<DynamicImage, String> {
    let (width, height) = size(bytes)?;
    // Nothing here needs keys and values, and the crate trusts the padding of the last one.
    let mut bytes = bytes.to_vec();
    bytes[KEYS_LENGTH].fill(0);
    let failed = |error: basisu::Error| format!("it is damaged ({error:?})");
    let transcoder = Transcoder::new(&bytes).map_err(failed)?;
    if !transcoder.supports(TargetFormat::Rgba32) {
        return Err("textures of high dynamic range are not read from KTX2 files: use an EXR".to_owned());
    }
    let pixels = transcoder.transcode(0, TargetFormat::Rgba32, DecodeFlags::NONE).map_err(failed)?;
    let image = if transcoder.has_alpha() {
        RgbaImage::from_raw(width, height, pixels).map(DynamicImage::from)
    } else {
        let opaque = pixels.chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
        RgbImage::from_raw(width, height, opaque).map(DynamicImage::from)
    };
    image.ok_or_else(|| "it has fewer pixels than its size needs".to_owned())
}
