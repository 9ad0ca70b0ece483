//! What stands between a file of unknown origin and the parser.
//!
//! tobj reads well-formed files; it refuses others without naming the line (text that is not UTF-8, comments after
//! a face, a fifth number after `v`), reads some wrongly (polylines become faces, texture coordinates shift when
//! one corner lacks them) and splits vertices at every group. The screen rewrites a file into lines that tobj cannot
//! misread, checks each face where its line is still known, and keeps the materials to itself.

use super::error::LineProblem;
use crate::scene::relative::bytes_to_text;
use std::borrow::Cow;
use std::collections::HashMap;

/// A file in the form that the parser gets, and what was taken out of it.
#[derive(Debug, Default)]
pub(super) struct Screened {
    /// Lines `v x y z`, `vt u v`, `vn x y z` and `f` with every corner written in full.
    pub text: Vec<u8>,
    /// The number in `materials` under which each face was written.
    pub face_materials: Vec<u32>,
    /// Names after `usemtl`, in order of first use by a face; empty for faces before any of them.
    pub materials: Vec<String>,
    /// What stood after each `mtllib`.
    pub libraries: Vec<String>,
    /// Lines and points that were left out.
    pub lines_and_points: usize,
}

/// A problem and the line (from 1) that has it.
pub(super) type Located = (usize, LineProblem);

/// Index 1 of texture coordinates and of normals stands for a missing one in the screened text.
pub(super) fn screen(bytes: &[u8]) -> Result<Screened, Located> {
    let has = |keyword: &[u8]| lines(bytes).any(|(_, line)| first_word(&line) == keyword);
    let (has_uvs, has_normals) = (has(b"vt"), has(b"vn"));
    let mut screened = Screened { text: Vec::with_capacity(bytes.len() + bytes.len() / 4), ..Default::default() };
    if has_uvs {
        screened.text.extend(b"vt 0 0\n");
    }
    if has_normals {
        screened.text.extend(b"vn 0 0 0\n");
    }
    let mut counts = [0_usize; 3];
    let mut furthest = [(0_i64, 0_usize); 3];
    // The name that faces now belong to, and its number once a face has used it.
    let (mut name, mut material) = (String::new(), None);
    let mut known: HashMap<String, u32> = HashMap::new();
    for (number, line) in lines(bytes) {
        let keyword = first_word(&line);
        match keyword {
            b"v" | b"vn" | b"vt" => {
                let kind = [&b"v"[..], b"vt", b"vn"].iter().position(|k| *k == keyword).unwrap_or(0);
                counts[kind] += 1;
                push_numbers(&mut screened.text, &line, keyword).map_err(|problem| (number, problem))?;
            }
            b"f" => {
                let corners = Corners { has_uvs, has_normals, counts };
                let largest = corners.push_face(&mut screened.text, &line).map_err(|problem| (number, problem))?;
                for (furthest, index) in furthest.iter_mut().zip(largest) {
                    if index > furthest.0 {
                        *furthest = (index, number);
                    }
                }
                let current = *material.get_or_insert_with(|| {
                    *known.entry(name.clone()).or_insert_with(|| {
                        screened.materials.push(name.clone());
                        screened.materials.len() as u32 - 1
                    })
                });
                screened.face_materials.push(current);
            }
            b"l" | b"p" => screened.lines_and_points += 1,
            b"usemtl" => (name, material) = (rest(&line), None),
            b"mtllib" => screened.libraries.push(bytes_to_text(rest_bytes(&line))),
            _ => {}
        }
    }
    // A positive index may point forwards, so only now is it known whether it points at anything.
    for (kind, (index, number)) in furthest.into_iter().enumerate() {
        if index > counts[kind] as i64 {
            return Err((number, LineProblem::OutOfRange { what: KINDS[kind], index, count: counts[kind] }));
        }
    }
    Ok(screened)
}

/// The first line whose numbers do not parse, or parse as NaN or infinity.
pub(super) fn find_bad_number(bytes: &[u8]) -> Option<Located> {
    lines(bytes).find_map(|(number, line)| {
        if !matches!(first_word(&line), b"v" | b"vn" | b"vt") {
            return None;
        }
        let bad = words(&line)
            .skip(1)
            .take_while(|word| word[0] != b'#')
            .take(3)
            .find(|word| !str::from_utf8(word).is_ok_and(|text| text.parse().is_ok_and(f64::is_finite)))?;
        Some((number, LineProblem::NotFinite { text: text_of(bad).into_owned() }))
    })
}

const KINDS: [&str; 3] = ["vertex", "texture coordinate", "normal"];

/// What a face may refer to at its place in the file.
struct Corners {
    has_uvs: bool,
    has_normals: bool,
    counts: [usize; 3],
}

impl Corners {
    /// Writes the face out in full; returns the largest index of each kind.
    fn push_face(&self, text: &mut Vec<u8>, line: &[u8]) -> Result<[i64; 3], LineProblem> {
        let mut largest = [0; 3];
        let mut corners = 0;
        text.push(b'f');
        for word in words(line).skip(1).take_while(|word| word[0] != b'#') {
            let indices = self.parse(word)?;
            text.push(b' ');
            push_index(text, indices[0]);
            if self.has_uvs || self.has_normals {
                text.push(b'/');
                if self.has_uvs {
                    push_index(text, indices[1] + 1);
                }
                if self.has_normals {
                    text.push(b'/');
                    push_index(text, indices[2] + 1);
                }
            }
            for (largest, index) in largest.iter_mut().zip(indices) {
                *largest = index.max(*largest);
            }
            corners += 1;
        }
        text.push(b'\n');
        if corners < 3 { Err(LineProblem::FewCorners { corners }) } else { Ok(largest) }
    }

    /// Indices from 1; 0 for what the corner does not have.
    fn parse(&self, word: &[u8]) -> Result<[i64; 3], LineProblem> {
        let malformed = || LineProblem::FaceCorner { text: text_of(word).into_owned() };
        let mut indices = [0; 3];
        for (kind, part) in word.split(|&byte| byte == b'/').enumerate() {
            if kind == 3 || (kind == 0 && part.is_empty()) {
                return Err(malformed());
            }
            if part.is_empty() {
                continue;
            }
            let what = KINDS[kind];
            let index = parse_index(part).ok_or_else(malformed)?;
            indices[kind] = match index {
                0 => return Err(LineProblem::IndexZero { what }),
                1.. => index,
                _ => {
                    let count = self.counts[kind];
                    let absolute = count as i64 + 1 + index;
                    if absolute < 1 {
                        return Err(LineProblem::OutOfRange { what, index, count });
                    }
                    absolute
                }
            };
        }
        Ok(indices)
    }
}

/// Up to 15 digits, so that sums never overflow; nothing longer can be an index.
fn parse_index(part: &[u8]) -> Option<i64> {
    let (sign, digits) = match part {
        [b'-', digits @ ..] => (-1, digits),
        [b'+', digits @ ..] => (1, digits),
        digits => (1, digits),
    };
    if digits.is_empty() || digits.len() > 15 {
        return None;
    }
    digits
        .iter()
        .try_fold(0, |sum, &digit| digit.is_ascii_digit().then(|| sum * 10 + i64::from(digit - b'0')))
        .map(|value| sign * value)
}

fn push_index(text: &mut Vec<u8>, mut index: i64) {
    let start = text.len();
    loop {
        text.push(b'0' + (index % 10) as u8);
        index /= 10;
        if index == 0 {
            break;
        }
    }
    text[start..].reverse();
}

/// Copies the numbers that count: three (two for `vt`, where a missing second one is 0); extras are left out.
fn push_numbers(text: &mut Vec<u8>, line: &[u8], keyword: &[u8]) -> Result<(), LineProblem> {
    let expected = if keyword == b"vt" { 2 } else { 3 };
    text.extend(keyword);
    let mut found = 0;
    for word in words(line).skip(1).take_while(|word| word[0] != b'#').take(expected) {
        text.push(b' ');
        // Not UTF-8 is not a number either: the replacement character makes the parser say so.
        text.extend(text_of(word).as_bytes());
        found += 1;
    }
    if keyword == b"vt" && found == 1 {
        text.extend(b" 0");
        found = 2;
    }
    text.push(b'\n');
    if found == expected {
        Ok(())
    } else {
        Err(LineProblem::Numbers { keyword: text_of(keyword).into_owned(), expected })
    }
}

/// Logical lines with the number (from 1) of their first physical line: `\` at an end joins the next line on, and
/// all three kinds of line ends are known.
fn lines(bytes: &[u8]) -> impl Iterator<Item = (usize, Cow<'_, [u8]>)> {
    let mut left = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
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

fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

fn first_word(line: &[u8]) -> &[u8] {
    words(line).next().unwrap_or_default()
}

/// What follows the first word, without the white space around it.
fn rest(line: &[u8]) -> String {
    text_of(rest_bytes(line)).into_owned()
}

fn rest_bytes(line: &[u8]) -> &[u8] {
    let line = line.trim_ascii_start();
    let end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
    line[end..].trim_ascii()
}

fn text_of(bytes: &[u8]) -> Cow<'_, str> {
    String::from_utf8_lossy(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(obj: &str) -> String {
        String::from_utf8(screen(obj.as_bytes()).unwrap().text).unwrap()
    }

    #[test]
    fn faces_are_written_in_full() {
        let obj = "v 0 0 0 1\r\nv 1 0 0\rv 0 1 0 # c\nvn 0 0 1\nf -3 2//1 \\\n 3//-1 # end\n";
        assert_eq!(text(obj), "vn 0 0 0\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//2 3//2\n");
        assert_eq!(text("v 1 2 3\nvt .5\nf 1/1 1 1/\n"), "vt 0 0\nv 1 2 3\nvt .5 0\nf 1/2 1/1 1/1\n");
    }

    #[test]
    fn bad_faces_are_named_by_their_line() {
        let of = |obj: &str| screen(obj.as_bytes()).unwrap_err();
        let v = "v 0 0 0\n";
        let out = |index| LineProblem::OutOfRange { what: "vertex", index, count: 1 };
        assert_eq!(of(&format!("{v}\nf 1 1 2")), (3, out(2)));
        assert_eq!(of(&format!("{v}f 1 1 -2")), (2, out(-2)));
        assert_eq!(of(&format!("{v}f 1 0 1")), (2, LineProblem::IndexZero { what: "vertex" }));
        assert_eq!(of(&format!("{v}f 1 1")), (2, LineProblem::FewCorners { corners: 2 }));
        for corner in ["a", "1/2/3/4", "/1", "1.5", "999999999999999999999", "-", "1/x"] {
            assert_eq!(of(&format!("{v}f 1 {corner}")), (2, LineProblem::FaceCorner { text: corner.into() }));
        }
        assert_eq!(of("v 1 2"), (1, LineProblem::Numbers { keyword: "v".into(), expected: 3 }));
    }

    #[test]
    fn bad_numbers_are_found() {
        let bad = find_bad_number(b"v 1 2 3\nvt 1 #\n# v x\nv 1 nan 2\n");
        assert_eq!(bad, Some((4, LineProblem::NotFinite { text: "nan".into() })));
        assert_eq!(find_bad_number(b"v 1 2 3 x\n"), None);
    }

    #[test]
    fn materials_and_libraries_keep_names_with_spaces_and_odd_bytes() {
        let obj = b"\xef\xbb\xbfmtllib my file.mtl\nf 1 1 1\nusemtl Mat #1\nf 1 1 1\nusemtl unused\nusemtl \xff\nf 1 1 1\nusemtl Mat #1\nf 1 1 1\nv 0 0 0\nl 1 1\n";
        let screened = screen(obj).unwrap();
        assert_eq!(screened.libraries, ["my file.mtl"]);
        assert_eq!(screened.materials, ["", "Mat #1", "\u{fffd}"]);
        assert_eq!(screened.face_materials, [0, 1, 2, 1]);
        assert_eq!(screened.lines_and_points, 1);
    }
}
