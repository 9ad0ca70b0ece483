//! Lines and words of an OBJ file.

use std::borrow::Cow;

/// Logical lines with the number (from 1) of their first physical line: a `\` at the end continues a line, and all
/// three kinds of line endings are supported.
pub(crate) fn lines(bytes: &[u8]) -> impl Iterator<Item = (usize, Cow<'_, [u8]>)> {
    let mut left = bytes;
    let mut number = 0;
    let mut physical = move || -> Option<(usize, &[u8])> {
        if left.is_empty() {
            return None;
        }
        number += 1;
        let end = left.iter().position(|&byte| byte == b'\n' || byte == b'\r').unwrap_or(left.len());
        let (line, after) = left.split_at(end);
        left = after.strip_prefix(b"\r\n").or_else(|| after.get(1..)).unwrap_or_default();
        Some((number, line))
    };
    std::iter::from_fn(move || {
        let (number, line) = physical()?;
        let Some(start) = line.strip_suffix(b"\\") else { return Some((number, Cow::Borrowed(line))) };
        let mut joined = start.to_vec();
        while let Some((_, next)) = physical() {
            joined.push(b' ');
            match next.strip_suffix(b"\\") {
                Some(more) => joined.extend(more),
                None => {
                    joined.extend(next);
                    break;
                }
            }
        }
        Some((number, Cow::Owned(joined)))
    })
}

/// The text in UTF-8, without a byte order mark; UTF-16 with one is converted.
pub(crate) fn decoded(bytes: &[u8]) -> Cow<'_, [u8]> {
    let utf16 = |unit: fn([u8; 2]) -> u16| -> Cow<'_, [u8]> {
        let (units, _) = bytes[2..].as_chunks();
        let chars = char::decode_utf16(units.iter().map(|&bytes| unit(bytes)));
        let text: String = chars.map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)).collect();
        Cow::Owned(text.into_bytes())
    };
    match bytes {
        [0xff, 0xfe, ..] => utf16(u16::from_le_bytes),
        [0xfe, 0xff, ..] => utf16(u16::from_be_bytes),
        _ => Cow::Borrowed(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)),
    }
}

pub(crate) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

pub(crate) fn first_word(line: &[u8]) -> &[u8] {
    words(line).next().unwrap_or_default()
}

/// The text after the first word, trimmed.
pub(crate) fn rest(line: &[u8]) -> String {
    text_of(rest_bytes(line)).into_owned()
}

pub(crate) fn rest_bytes(line: &[u8]) -> &[u8] {
    let line = line.trim_ascii_start();
    let end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
    line[end..].trim_ascii()
}

fn text_of(bytes: &[u8]) -> Cow<'_, str> {
    String::from_utf8_lossy(bytes)
}

/// Cuts a text into about `n` pieces of whole logical lines.
pub(crate) fn pieces(bytes: &[u8], n: usize) -> Vec<&[u8]> {
    let mut pieces = Vec::with_capacity(n);
    let mut left = bytes;
    for k in (1..=n).rev() {
        let mut end = left.len() / k;
        // After a line ending without a continuation; old files with `\r` alone stay in one piece.
        end = loop {
            match left[end..].iter().position(|&byte| byte == b'\n') {
                None => break left.len(),
                Some(at) => {
                    let line = left[..end + at].strip_suffix(b"\r").unwrap_or(&left[..end + at]);
                    end += at + 1;
                    if !line.ends_with(b"\\") {
                        break end;
                    }
                }
            }
        };
        let (piece, rest) = left.split_at(end);
        if !piece.is_empty() {
            pieces.push(piece);
        }
        left = rest;
    }
    pieces
}

/// Number of line endings of any kind.
pub(crate) fn line_ends(bytes: &[u8]) -> usize {
    let (mut ends, mut after_return) = (0, false);
    for &byte in bytes {
        // `\r\n` counts once.
        ends += usize::from(byte == b'\r' || (byte == b'\n' && !after_return));
        after_return = byte == b'\r';
    }
    ends
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_are_whole_logical_lines_that_make_up_the_text() {
        let text = b"v 1 2 3\r\nf 1 \\\n2 \\\r\n3\n\n# end\rv 4 5 6\nvt 1";
        let whole: Vec<_> = lines(text).map(|(number, line)| (number, line.into_owned())).collect();
        for n in 1..30 {
            let pieces = pieces(text, n);
            assert_eq!(pieces.concat(), text);
            let (mut found, mut before) = (Vec::new(), 0);
            for piece in pieces {
                found.extend(lines(piece).map(|(number, line)| (before + number, line.into_owned())));
                before += line_ends(piece);
            }
            assert_eq!(found, whole, "{n} pieces");
        }
    }
}
