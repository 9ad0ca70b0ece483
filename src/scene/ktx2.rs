//! KTX2 files with textures of Basis Universal (ETC1S, UASTC), which `KHR_texture_basisu` refers to.
//!
//! Only the largest image is decoded. The crate `basisu` trusts the sizes that a file states: the caller compares
//! [`size`] with its limits first.
//!
//! Source: Khronos, "KTX File Format Specification" 2.0, §3 (file structure).

use basisu::{DecodeFlags, TargetFormat, Transcoder};
use image::{DynamicImage, RgbImage, RgbaImage};

/// First bytes of a KTX2 file.
pub(super) const SIGNATURE: &[u8] = b"\xabKTX 20\xbb\r\n\x1a\n";

/// Width and height, pixels.
///
/// # Errors
/// If the file is truncated, or of another kind than an image of Basis Universal.
pub(super) fn size(bytes: &[u8]) -> Result<(u32, u32), String> {
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
    // Offset, length and decompressed length of the largest level follow the header. A block of 4 x 4 pixels has at most
    // 16 bytes.
    let decompressed = u64::from(number(96)?) | u64::from(number(100)?) << 32;
    if decompressed > 16 * u64::from(width.div_ceil(4)) * u64::from(height.div_ceil(4)) {
        return Err("it says that it has more blocks than its size needs".to_owned());
    }
    Ok((width, height))
}

/// Decodes the image.
///
/// # Errors
/// Like [`size`], and if the data is damaged.
pub(super) fn decode(bytes: &[u8]) -> Result<DynamicImage, String> {
    let (width, height) = size(bytes)?;
    let failed = |error: basisu::Error| format!("it is damaged ({error:?})");
    let transcoder = Transcoder::new(bytes).map_err(failed)?;
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
