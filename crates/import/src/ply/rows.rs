//! The values after a PLY header in sequence: from lines of text or from bytes.
//!
//! All values are returned as `f64`, which represents all types of the format exactly.

use crate::error::Place;
use crate::error::ply::PlyProblem;
use crate::model::number::parse_number;
use crate::ply::header::{Element, Number, Property};
use firstlight_files::printable;

/// Why a value cannot be read.
#[derive(Debug)]
pub(crate) enum Missing {
    /// The file has ended.
    End,
    /// The line has ended after this many values.
    Line(usize),
    /// The text is not a number.
    Problem(PlyProblem),
}

/// A source of values.
pub(crate) trait Rows {
    fn begin_row(&mut self) -> Result<(), Missing>;
    fn next(&mut self, number: Number) -> Result<f64, Missing>;
    /// Skips `count` values.
    fn skip(&mut self, number: Number, count: u64) -> Result<(), Missing>;
    /// Returns whether the line goes on: the rest is not read.
    fn end_row(&mut self) -> bool;
    /// Location of the last value.
    fn place(&self) -> Place;
    /// Number of remaining bytes.
    fn left(&self) -> usize;
}

/// A problem with its location.
pub(crate) type Located = (Place, PlyProblem);

/// Skips a row of an element.
pub(crate) fn skip_row(element: &Element, row: u64, rows: &mut impl Rows) -> Result<(), Located> {
    rows.begin_row().map_err(|problem| missing(problem, element, row, rows))?;
    for property in &element.properties {
        if property.length.is_some() {
            skip_list(element, row, property, rows)?;
        } else {
            rows.skip(property.number, 1).map_err(|problem| missing(problem, element, row, rows))?;
        }
    }
    rows.end_row();
    Ok(())
}

/// Skips a list property.
pub(crate) fn skip_list(element: &Element, row: u64, property: &Property, rows: &mut impl Rows) -> Result<(), Located> {
    let length = next_length(element, row, property, rows)?;
    rows.skip(property.number, length).map_err(|problem| missing(problem, element, row, rows))
}

/// Reads the length of a list property: up to 2³² − 1, since longer lists exceed any file.
pub(crate) fn next_length(
    element: &Element,
    row: u64,
    property: &Property,
    rows: &mut impl Rows,
) -> Result<u64, Located> {
    let number = property.length.unwrap_or(property.number);
    let length = rows.next(number).map_err(|problem| missing(problem, element, row, rows))?;
    if length >= 0.0 && length <= f64::from(u32::MAX) && length.fract() == 0.0 {
        return Ok(length as u64);
    }
    let element = printable::name(&element.name).to_string();
    Err((rows.place(), PlyProblem::Length { element, row, length: length.to_string() }))
}

/// The problem of a missing value, with its location.
pub(crate) fn missing(problem: Missing, element: &Element, row: u64, rows: &impl Rows) -> Located {
    let name = || printable::name(&element.name).to_string();
    let problem = match problem {
        Missing::End => PlyProblem::Truncated { element: name(), row, declared: element.count },
        Missing::Line(found) => PlyProblem::Numbers { element: name(), row, found },
        Missing::Problem(problem) => problem,
    };
    (rows.place(), problem)
}

/// Binary values, big-endian if `BIG`.
pub(crate) struct Bytes<'a, const BIG: bool> {
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
    fn end_row(&mut self) -> bool {
        false
    }

    fn place(&self) -> Place {
        Place::Byte(self.before)
    }

    fn left(&self) -> usize {
        self.bytes.len() - self.at
    }
}

/// Text values, one row per line.
pub(crate) struct Text<'a> {
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
        parse_number(word).ok_or_else(|| {
            let text = printable::name(&String::from_utf8_lossy(word)).to_string();
            Missing::Problem(PlyProblem::NotNumber { text })
        })
    }

    fn skip(&mut self, _: Number, count: u64) -> Result<(), Missing> {
        (0..count).try_for_each(|_| self.word().map(drop))
    }

    fn end_row(&mut self) -> bool {
        !self.line.trim_ascii_start().is_empty()
    }

    fn place(&self) -> Place {
        Place::Line(self.number)
    }

    fn left(&self) -> usize {
        self.left.len()
    }
}
