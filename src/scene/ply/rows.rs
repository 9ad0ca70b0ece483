//! The values after a PLY header in sequence: from lines of text or from bytes.
//!
//! All values are returned as `f64`, which represents all types of the format exactly.

use super::error::PlyProblem;
use super::header::Number;
use crate::printable;
use crate::scene::model::Place;

/// Why a value cannot be read.
#[derive(Debug)]
pub(super) enum Missing {
    /// The file has ended.
    End,
    /// The line has ended after this many values.
    Line(usize),
    /// The text is not a number.
    Problem(PlyProblem),
}

/// A source of values.
pub(super) trait Rows {
    fn begin_row(&mut self) -> Result<(), Missing>;
    fn next(&mut self, number: Number) -> Result<f64, Missing>;
    /// Skips `count` values.
    fn skip(&mut self, number: Number, count: u64) -> Result<(), Missing>;
    /// The error gives the number of values in the line if there are too many.
    fn end_row(&mut self) -> Result<(), Missing>;
    /// Location of the last value.
    fn place(&self) -> Place;
    /// Number of remaining bytes.
    fn left(&self) -> usize;
}

/// Binary values, big-endian if `BIG`.
pub(super) struct Bytes<'a, const BIG: bool> {
    bytes: &'a [u8],
    at: usize,
    before: usize,
}

impl<'a, const BIG: bool> Bytes<'a, BIG> {
    pub fn new(bytes: &'a [u8], at: usize) -> Self {
        Self { bytes, at, before: at }
    }

    #[inline]
    fn take<const N: usize>(&mut self) -> Result<[u8; N], Missing> {
        let mut found: [u8; N] = *self.bytes[self.at..].first_chunk().ok_or(Missing::End)?;
        self.before = self.at;
        self.at += N;
        if BIG {
            found.reverse();
        }
        Ok(found)
    }
}

impl<const BIG: bool> Rows for Bytes<'_, BIG> {
    #[inline]
    fn begin_row(&mut self) -> Result<(), Missing> {
        self.before = self.at;
        Ok(())
    }

    #[inline]
    fn next(&mut self, number: Number) -> Result<f64, Missing> {
        Ok(match number {
            Number::I8 => f64::from(i8::from_le_bytes(self.take()?)),
            Number::U8 => f64::from(u8::from_le_bytes(self.take()?)),
            Number::I16 => f64::from(i16::from_le_bytes(self.take()?)),
            Number::U16 => f64::from(u16::from_le_bytes(self.take()?)),
            Number::I32 => f64::from(i32::from_le_bytes(self.take()?)),
            Number::U32 => f64::from(u32::from_le_bytes(self.take()?)),
            Number::F32 => f64::from(f32::from_le_bytes(self.take()?)),
            Number::F64 => f64::from_le_bytes(self.take()?),
        })
    }

    fn skip(&mut self, number: Number, count: u64) -> Result<(), Missing> {
        let bytes = count.saturating_mul(number.bytes() as u64);
        if bytes > self.left() as u64 {
            return Err(Missing::End);
        }
        self.before = self.at;
        self.at += bytes as usize;
        Ok(())
    }

    #[inline]
    fn end_row(&mut self) -> Result<(), Missing> {
        Ok(())
    }

    fn place(&self) -> Place {
        Place::Byte(self.before)
    }

    fn left(&self) -> usize {
        self.bytes.len() - self.at
    }
}

/// Text values, one row per line.
pub(super) struct Text<'a> {
    left: &'a [u8],
    /// The rest of the line.
    line: &'a [u8],
    number: usize,
    words: usize,
}

impl<'a> Text<'a> {
    /// - `lines`: number of lines before `left`.
    pub fn new(left: &'a [u8], lines: usize) -> Self {
        Self { left, line: &[], number: lines, words: 0 }
    }

    fn word(&mut self) -> Result<&'a [u8], Missing> {
        let start = self.line.trim_ascii_start();
        let end = start.iter().position(u8::is_ascii_whitespace).unwrap_or(start.len());
        if end == 0 {
            return Err(Missing::Line(self.words));
        }
        self.words += 1;
        let (word, rest) = start.split_at(end);
        self.line = rest;
        Ok(word)
    }
}

impl Rows for Text<'_> {
    fn begin_row(&mut self) -> Result<(), Missing> {
        self.words = 0;
        while !self.left.is_empty() {
            let end = self.left.iter().position(|&byte| byte == b'\n' || byte == b'\r').unwrap_or(self.left.len());
            let (line, after) = self.left.split_at(end);
            self.left = after.strip_prefix(b"\r\n").or_else(|| after.get(1..)).unwrap_or_default();
            self.number += 1;
            self.line = line.trim_ascii();
            if !self.line.is_empty() {
                return Ok(());
            }
        }
        Err(Missing::End)
    }

    fn next(&mut self, _: Number) -> Result<f64, Missing> {
        let word = self.word()?;
        // Fast path: most values are short integers.
        if word.len() <= 15 && word.iter().all(u8::is_ascii_digit) {
            return Ok(word.iter().fold(0_u64, |sum, &digit| sum * 10 + u64::from(digit - b'0')) as f64);
        }
        let number = str::from_utf8(word).ok().and_then(|text| text.parse().ok());
        number.ok_or_else(|| {
            let text = printable::name(&String::from_utf8_lossy(word)).to_string();
            Missing::Problem(PlyProblem::NotNumber { text })
        })
    }

    fn skip(&mut self, _: Number, count: u64) -> Result<(), Missing> {
        (0..count).try_for_each(|_| self.word().map(drop))
    }

    fn end_row(&mut self) -> Result<(), Missing> {
        if self.line.trim_ascii_start().is_empty() {
            return Ok(());
        }
        while self.word().is_ok() {}
        Err(Missing::Line(self.words))
    }

    fn place(&self) -> Place {
        Place::Line(self.number)
    }

    fn left(&self) -> usize {
        self.left.len()
    }
}
