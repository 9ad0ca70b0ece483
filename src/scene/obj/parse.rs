//! Parses the lines of an OBJ file, in `f64`; values are checked while the line number is known.

use super::error::LineProblem;
use super::lines::{first_word, line_ends, lines, pieces, rest, rest_bytes, text_of, words};
use crate::scene::relative::bytes_to_text;
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::collections::HashMap;

/// The contents of a file.
#[derive(Debug, Default)]
pub(super) struct ParsedObj {
    pub positions: Vec<DVec3>,
    pub uvs: Vec<DVec2>,
    pub normals: Vec<DVec3>,
    /// Of all faces in order.
    pub corners: Vec<Corner>,
    /// Number of corners of each face.
    pub arities: Vec<u32>,
    /// Index in `materials` of each face.
    pub face_materials: Vec<u32>,
    /// Names after `usemtl`, in order of first use by a face; the empty name for faces before the first one.
    pub materials: Vec<String>,
    /// The text after each `mtllib`.
    pub libraries: Vec<String>,
    /// Number of lines and points, which are ignored.
    pub lines_and_points: usize,
}

/// Indices of position, texture coordinate and normal, from 1; 0 if missing.
pub(super) type Corner = [u32; 3];

/// A problem and its line, from 1.
pub(super) type Located = (usize, LineProblem);

/// Parses all lines. Unknown lines and excess numbers are ignored.
///
/// Pieces of a long file are parsed in parallel; the result is the same as for one piece.
pub(super) fn parse(bytes: &[u8]) -> Result<ParsedObj, Located> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    parse_in(bytes, (bytes.len() / LEAST_PIECE).clamp(1, 8 * rayon::current_num_threads()))
}

/// Minimum bytes per piece.
const LEAST_PIECE: usize = 1 << 18;

fn parse_in(bytes: &[u8], n_pieces: usize) -> Result<ParsedObj, Located> {
    let pieces = pieces(bytes, n_pieces);
    // The counts before each piece, since faces may use indices relative to them.
    let mut starts = vec![Start::default()];
    if pieces.len() > 1 {
        let sizes: Vec<Start> = pieces.par_iter().map(|piece| Start::of(piece)).collect();
        for size in sizes {
            starts.push(starts[starts.len() - 1].and(size));
        }
    }
    let read: Vec<Result<Piece, Located>> =
        pieces.par_iter().zip(&starts).map(|(piece, start)| Piece::read(piece, *start)).collect();
    let read = read.into_iter().collect::<Result<Vec<Piece>, Located>>()?;
    let mut furthest = [(0_i64, 0_usize); 3];
    for piece in &read {
        for (furthest, of_piece) in furthest.iter_mut().zip(piece.furthest) {
            if of_piece.0 > furthest.0 {
                *furthest = of_piece;
            }
        }
    }
    let parsed = joined(read);
    // A positive index may refer to a later line, so it can only be checked at the end.
    let counts = parsed.counts();
    for (kind, (index, number)) in furthest.into_iter().enumerate() {
        if index > counts[kind] as i64 {
            return Err((number, LineProblem::OutOfRange { what: KINDS[kind], index, count: counts[kind] }));
        }
    }
    Ok(parsed)
}

/// Counts before a position in the file.
#[derive(Clone, Copy, Default)]
struct Start {
    /// Number of line endings.
    lines: usize,
    /// Number of positions, texture coordinates and normals.
    counts: [usize; 3],
}

impl Start {
    /// The counts of a piece, assuming that it is valid.
    fn of(piece: &[u8]) -> Self {
        let mut start = Self { lines: line_ends(piece), ..Self::default() };
        for (_, line) in lines(piece) {
            match first_word(&line) {
                b"v" => start.counts[0] += 1,
                b"vt" => start.counts[1] += 1,
                b"vn" => start.counts[2] += 1,
                _ => {}
            }
        }
        start
    }

    fn and(self, other: Self) -> Self {
        let counts = std::array::from_fn(|k| self.counts[k] + other.counts[k]);
        Self { lines: self.lines + other.lines, counts }
    }
}

/// The contents of one piece of a file.
#[derive(Default)]
struct Piece {
    parsed: ParsedObj,
    before: [usize; 3],
    /// Each `usemtl`: the number of faces before it, and the name.
    materials: Vec<(usize, String)>,
    /// The largest index of each kind, and its line.
    furthest: [(i64, usize); 3],
}

impl Piece {
    fn read(bytes: &[u8], start: Start) -> Result<Self, Located> {
        let mut piece = Self { before: start.counts, ..Self::default() };
        for (number, line) in lines(bytes) {
            let number = start.lines + number;
            piece.read_line(number, &line).map_err(|problem| (number, problem))?;
        }
        Ok(piece)
    }

    fn read_line(&mut self, number: usize, line: &[u8]) -> Result<(), LineProblem> {
        let parsed = &mut self.parsed;
        match first_word(line) {
            b"v" => parsed.positions.push(DVec3::from_array(numbers(line)?)),
            b"vn" => parsed.normals.push(DVec3::from_array(numbers(line)?)),
            b"vt" => parsed.uvs.push(texture_coordinate(line)?),
            b"f" => {
                let counts = parsed.counts();
                let largest = parsed.push_face(line, std::array::from_fn(|k| self.before[k] + counts[k]))?;
                for (furthest, index) in self.furthest.iter_mut().zip(largest) {
                    if index > furthest.0 {
                        *furthest = (index, number);
                    }
                }
            }
            b"l" | b"p" => parsed.lines_and_points += 1,
            b"usemtl" => self.materials.push((parsed.arities.len(), rest(line))),
            b"mtllib" => parsed.libraries.push(bytes_to_text(rest_bytes(line))),
            _ => {}
        }
        Ok(())
    }
}

/// Concatenates the pieces.
fn joined(pieces: Vec<Piece>) -> ParsedObj {
    let mut all = ParsedObj::default();
    let total = |len: fn(&ParsedObj) -> usize| pieces.iter().map(|piece| len(&piece.parsed)).sum::<usize>();
    all.positions.reserve_exact(total(|p| p.positions.len()));
    all.uvs.reserve_exact(total(|p| p.uvs.len()));
    all.normals.reserve_exact(total(|p| p.normals.len()));
    all.corners.reserve_exact(total(|p| p.corners.len()));
    all.arities.reserve_exact(total(|p| p.arities.len()));
    all.face_materials.reserve_exact(total(|p| p.arities.len()));
    // The current material name, and its index once a face has used it.
    let (mut name, mut material) = (String::new(), None);
    let mut known: HashMap<String, u32> = HashMap::new();
    for Piece { parsed, materials, .. } in pieces {
        let mut from = 0;
        let ends = materials.iter().map(|(face, _)| *face).skip(1).chain([parsed.arities.len()]);
        let first = materials.first().map_or(parsed.arities.len(), |(face, _)| *face);
        let mut add = |name: &String, material: &mut Option<u32>, to: usize| {
            if to > from {
                let number = *material.get_or_insert_with(|| {
                    *known.entry(name.clone()).or_insert_with(|| {
                        all.materials.push(name.clone());
                        all.materials.len() as u32 - 1
                    })
                });
                all.face_materials.resize(all.face_materials.len() + (to - from), number);
                from = to;
            }
        };
        add(&name, &mut material, first);
        for ((_, next), end) in materials.iter().zip(ends) {
            (name, material) = (next.clone(), None);
            add(&name, &mut material, end);
        }
        all.positions.extend(parsed.positions);
        all.uvs.extend(parsed.uvs);
        all.normals.extend(parsed.normals);
        all.corners.extend(parsed.corners);
        all.arities.extend(parsed.arities);
        all.libraries.extend(parsed.libraries);
        all.lines_and_points += parsed.lines_and_points;
    }
    all
}

const KINDS: [&str; 3] = ["vertex", "texture coordinate", "normal"];

impl ParsedObj {
    /// Frees everything but the names of materials and libraries.
    pub fn leave_names(&mut self) {
        let (materials, libraries) = (std::mem::take(&mut self.materials), std::mem::take(&mut self.libraries));
        *self = Self { materials, libraries, ..Self::default() };
    }

    fn counts(&self) -> [usize; 3] {
        [self.positions.len(), self.uvs.len(), self.normals.len()]
    }

    /// Adds a face; returns the largest index of each kind.
    ///
    /// - `counts`: counts up to this line.
    fn push_face(&mut self, line: &[u8], counts: [usize; 3]) -> Result<[i64; 3], LineProblem> {
        let (mut largest, mut n_corners) = ([0; 3], 0);
        for word in words(line).skip(1).take_while(|word| word[0] != b'#') {
            let indices = parse_corner(word, counts)?;
            // An index that overflows `u32` is out of range, which the check of the largest index finds.
            self.corners.push(indices.map(|index| u32::try_from(index).unwrap_or(u32::MAX)));
            for (largest, index) in largest.iter_mut().zip(indices) {
                *largest = index.max(*largest);
            }
            n_corners += 1;
        }
        self.arities.push(n_corners);
        if n_corners < 3 { Err(LineProblem::FewCorners { corners: n_corners as usize }) } else { Ok(largest) }
    }
}

/// Indices from 1; 0 if missing.
///
/// - `counts`: counts up to this line.
fn parse_corner(word: &[u8], counts: [usize; 3]) -> Result<[i64; 3], LineProblem> {
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
                let count = counts[kind];
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

/// Up to 15 digits, so that sums cannot overflow; longer numbers are never valid.
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

/// The first `N` numbers of a line; the rest is ignored.
fn numbers<const N: usize>(line: &[u8]) -> Result<[f64; N], LineProblem> {
    let mut found = [0.0; N];
    let mut words = words(line).skip(1).take_while(|word| word[0] != b'#');
    for number in &mut found {
        let expected = || LineProblem::Numbers { keyword: text_of(first_word(line)).into_owned(), expected: N };
        *number = finite(words.next().ok_or_else(expected)?)?;
    }
    Ok(found)
}

/// A missing second coordinate is 0.
fn texture_coordinate(line: &[u8]) -> Result<DVec2, LineProblem> {
    let n_words = words(line).skip(1).take_while(|word| word[0] != b'#').count();
    if n_words == 1 { Ok(DVec2::new(numbers::<1>(line)?[0], 0.0)) } else { Ok(DVec2::from_array(numbers(line)?)) }
}

fn finite(word: &[u8]) -> Result<f64, LineProblem> {
    let number = str::from_utf8(word).ok().and_then(|text| text.parse().ok()).filter(|number: &f64| number.is_finite());
    number.ok_or_else(|| LineProblem::NotFinite { text: text_of(word).into_owned() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_count_from_one_and_from_the_end() {
        let obj = "v 0 0 0 1\r\nv 1 0 0\rv 0 1 0 # c\nvn 0 0 1\nf -3 2//1 \\\n 3//-1 # end\n";
        let parsed = parse(obj.as_bytes()).unwrap();
        assert_eq!(parsed.positions, [DVec3::ZERO, DVec3::X, DVec3::Y]);
        assert_eq!((parsed.normals, parsed.arities), (vec![DVec3::Z], vec![3]));
        assert_eq!(parsed.corners, [[1, 0, 0], [2, 0, 1], [3, 0, 1]]);
        let parsed = parse(b"v 1 2 3\nvt .5\nvt .25 1e-3 7\nf 1/1 1 1/\n").unwrap();
        assert_eq!(parsed.uvs, [DVec2::new(0.5, 0.0), DVec2::new(0.25, 1e-3)]);
        assert_eq!(parsed.corners, [[1, 1, 0], [1, 0, 0], [1, 0, 0]]);
    }

    #[test]
    fn positions_keep_all_of_their_digits() {
        let parsed = parse(b"v 500000.123456789 0.1 -7e-200\n").unwrap();
        assert_eq!(parsed.positions, [DVec3::new(500_000.123_456_789, 0.1, -7e-200)]);
    }

    #[test]
    fn bad_faces_are_named_by_their_line() {
        let of = |obj: &str| parse(obj.as_bytes()).unwrap_err();
        let v = "v 0 0 0\n";
        let out = |index| LineProblem::OutOfRange { what: "vertex", index, count: 1 };
        assert_eq!(of(&format!("{v}\nf 1 1 2")), (3, out(2)));
        assert_eq!(of(&format!("{v}\nf 1 1 99999999999")), (3, out(99_999_999_999)));
        assert_eq!(of(&format!("{v}f 1 1 -2")), (2, out(-2)));
        assert_eq!(of(&format!("{v}f 1 0 1")), (2, LineProblem::IndexZero { what: "vertex" }));
        assert_eq!(of(&format!("{v}f 1 1")), (2, LineProblem::FewCorners { corners: 2 }));
        for corner in ["a", "1/2/3/4", "/1", "1.5", "999999999999999999999", "-", "1/x"] {
            assert_eq!(of(&format!("{v}f 1 {corner}")), (2, LineProblem::FaceCorner { text: corner.into() }));
        }
    }

    #[test]
    fn bad_numbers_are_named_by_their_line() {
        let of = |obj: &[u8]| parse(obj).unwrap_err();
        let numbers = |keyword: &str, expected| LineProblem::Numbers { keyword: keyword.into(), expected };
        assert_eq!(of(b"v 1 2"), (1, numbers("v", 3)));
        assert_eq!(of(b"\nvn 1 2 # 3"), (2, numbers("vn", 3)));
        assert_eq!(of(b"vt"), (1, numbers("vt", 2)));
        let bad = |line, text: &str| (line, LineProblem::NotFinite { text: text.into() });
        assert_eq!(of(b"v 1 2 3\nvt 1 #\n# v x\nv 1 nan 2\n"), bad(4, "nan"));
        assert_eq!(of(b"v 1 1e999 2"), bad(1, "1e999"));
        assert_eq!(of(b"v 1 \xff 2"), bad(1, "\u{fffd}"));
        assert!(parse(b"v 1 2 3 x\n").is_ok());
    }

    #[test]
    fn materials_and_libraries_keep_names_with_spaces_and_odd_bytes() {
        let obj = b"\xef\xbb\xbfmtllib my file.mtl\nf 1 1 1\nusemtl Mat #1\nf 1 1 1\nusemtl unused\nusemtl \xff\nf 1 1 1\nusemtl Mat #1\nf 1 1 1\nv 0 0 0\nl 1 1\n";
        let parsed = parse(obj).unwrap();
        assert_eq!(parsed.libraries, ["my file.mtl"]);
        assert_eq!(parsed.materials, ["", "Mat #1", "\u{fffd}"]);
        assert_eq!(parsed.face_materials, [0, 1, 2, 1]);
        assert_eq!(parsed.lines_and_points, 1);
    }

    /// For any file, the result and the first error do not depend on the division into pieces.
    #[test]
    fn pieces_say_what_the_whole_says() {
        let mut text = String::from("mtllib a.mtl\n");
        for k in 0..60 {
            text += &format!("v {k} 0 1.5\nvt 0.{k} 1\nvn 0 0 1\n");
            match k % 7 {
                3 => text += &format!("usemtl m{}\n", k % 4),
                5 => text += "f -1/-1/-1 -2//-2 \\\n -3/-3\n",
                6 => text += "f 1 2 3 4\r\nl 1 2\n",
                _ => {}
            }
        }
        let whole = parse_in(text.as_bytes(), 1).unwrap();
        assert!(whole.materials.len() > 3 && whole.corners.len() > 40);
        let broken = text.clone() + "f 1 2\nf 0 0 0\n";
        for n in 2..40 {
            assert_eq!(format!("{:?}", parse_in(text.as_bytes(), n).unwrap()), format!("{whole:?}"), "{n} pieces");
            assert_eq!(parse_in(broken.as_bytes(), n).unwrap_err(), parse_in(broken.as_bytes(), 1).unwrap_err());
            let far = text.replacen("f 1 2 3 4", "f 1 2 3 9999", 1);
            assert_eq!(parse_in(far.as_bytes(), n).unwrap_err(), parse_in(far.as_bytes(), 1).unwrap_err());
        }
    }
}
