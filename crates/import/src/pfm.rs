//! Portable float maps (PFM): linear floating-point pixels, rows from the bottom.
//!
//! Source: Debevec 2001, as HDR Shop writes it: `PF` or `Pf`, width and height, and a number whose sign gives the order of
//! the bytes, each followed by white space.

use image::{DynamicImage, Rgb32FImage};
use std::io::{BufRead, Read};

/// What is before the pixels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Header {
    pub width: u32,
    pub height: u32,
    channels: usize,
    is_little: bool,
}

/// Whether a file with this start is one.
pub(crate) fn is_pfm(start: &[u8]) -> bool {
    matches!(start, [b'P', b'F' | b'f', space, ..] if space.is_ascii_whitespace())
}

impl Header {
    /// Reads the header; the pixels follow.
    pub(crate) fn read(reader: &mut impl BufRead) -> Result<Self, String> {
        let channels = if word(reader)? == "PF" { 3 } else { 1 };
        let size = |word: String| word.parse().ok().filter(|size| *size > 0).ok_or("its size is no number".to_owned());
        let (width, height) = (size(word(reader)?)?, size(word(reader)?)?);
        let scale: f32 = word(reader)?.parse().map_err(|_| "the order of its bytes is not said")?;
        Ok(Self { width, height, channels, is_little: scale < 0.0 })
    }

    /// The pixels, from the top.
    pub(crate) fn pixels(self, mut reader: impl Read) -> Result<DynamicImage, String> {
        let n_row = self.width as usize * self.channels;
        let mut row = vec![0; 4 * n_row];
        let mut numbers = vec![0.0; 3 * self.width as usize * self.height as usize];
        for out in numbers.chunks_mut(3 * self.width as usize).rev() {
            reader.read_exact(&mut row).map_err(|_| "it ends within its pixels")?;
            let number =
                |&bytes: &[u8; 4]| if self.is_little { f32::from_le_bytes(bytes) } else { f32::from_be_bytes(bytes) };
            let values = row.as_chunks::<4>().0.iter().map(number);
            match self.channels {
                3 => out.iter_mut().zip(values).for_each(|(out, value)| *out = value),
                _ => out.chunks_mut(3).zip(values).for_each(|(out, value)| out.fill(value)),
            }
        }
        let pixels = Rgb32FImage::from_raw(self.width, self.height, numbers).expect("there are three for each pixel");
        Ok(DynamicImage::ImageRgb32F(pixels))
    }
}

/// The next word and the one space after it.
fn word(reader: &mut impl BufRead) -> Result<String, String> {
    /// No number is longer.
    const LONGEST: usize = 32;
    let mut word = String::new();
    loop {
        let mut byte = [0];
        reader.read_exact(&mut byte).map_err(|_| "it ends within its header")?;
        match byte[0] {
            space if space.is_ascii_whitespace() && word.is_empty() => {}
            space if space.is_ascii_whitespace() => return Ok(word),
            byte if byte.is_ascii_graphic() && word.len() < LONGEST => word.push(byte.into()),
            _ => return Err("its header is not text".to_owned()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(bytes: &[u8]) -> Result<DynamicImage, String> {
        let mut reader = bytes;
        Header::read(&mut reader)?.pixels(reader)
    }

    #[test]
    fn rows_count_from_the_bottom_in_either_order_of_bytes() {
        let rows: [[f32; 6]; 2] = [[0.0, 1.0, 2.0, 3.0, 4.0, 5.0], [6.0, 7.0, 8.0, 9.0, 10.0, 11.0]];
        let numbers = || rows.iter().flatten();
        let little: Vec<u8> =
            b"PF\n2 2\n-1.0\n".iter().copied().chain(numbers().flat_map(|n| n.to_le_bytes())).collect();
        let big: Vec<u8> = b"PF 2 2 1.0 ".iter().copied().chain(numbers().flat_map(|n| n.to_be_bytes())).collect();
        for bytes in [little, big] {
            let image = read(&bytes).unwrap().into_rgb32f();
            assert_eq!(image.into_raw(), [rows[1], rows[0]].concat());
            assert!(read(&bytes[..bytes.len() - 1]).unwrap_err().contains("within its pixels"));
        }
        let grey: Vec<u8> = b"Pf\n1 1\n-1\n".iter().copied().chain(0.5f32.to_le_bytes()).collect();
        assert_eq!(read(&grey).unwrap().into_rgb32f().into_raw(), [0.5; 3]);
    }

    #[test]
    fn broken_headers_are_told() {
        for text in ["PF", "PF 2", "PF 0 1 -1 ", "PF 2 -1 1 ", "PF 2 2 x ", "PF \u{7f} 2 1 "] {
            assert!(read(text.as_bytes()).is_err(), "{text}");
        }
    }
}
