//! Parses the lines of an OBJ file, in `f64`.
//!
//! Nothing is refused: a face that cannot be used is removed, a normal or texture coordinate that is missing or no number
//! is left out, and each kind is counted (`repair`).

use crate::obj::lines::{decoded, first_word, line_ends, lines, pieces, rest, rest_bytes, words};
use crate::obj::repair::{Repair, Repairs};
use firstlight_files::relative::bytes_to_text;
use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;
use std::collections::HashMap;

/// The contents of a file.
#[derive(Debug, Default)]
pub(crate) struct ParsedObj {
    /// NaN where the file has no finite number; no face uses these.
    pub positions: Vec<DVec3>,
    /// Colours of the positions as in the file, NaN where it has none; empty if it has none at all.
    pub colors: Vec<Vec3>,
    /// Colours after `#MRGB`, sRGB, in the order of the positions.
    pub mrgb: Vec<[u8; 3]>,
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
    pub repairs: Repairs,
}

/// Indices of position, texture coordinate and normal, from 1; 0 if missing.
pub(crate) type Corner = [u32; 3];

/// Parses all lines. Unknown lines and excess numbers are ignored.
///
/// Pieces of a long file are parsed in parallel; the result is the same as for one piece.
pub(crate) fn parse(bytes: &[u8]) -> ParsedObj {
    let bytes = &*decoded(bytes);
    parse_in(bytes, (bytes.len() / LEAST_PIECE).clamp(1, 8 * rayon::current_num_threads()))
}

/// Minimum bytes per piece.
const LEAST_PIECE: usize = 1 << 18;

fn parse_in(bytes: &[u8], n_pieces: usize) -> ParsedObj {
    let pieces = pieces(bytes, n_pieces);
    // The counts before each piece, since faces may use indices relative to them.
    let mut starts = vec![PieceStart::default()];
    if pieces.len() > 1 {
        let sizes: Vec<PieceStart> = pieces.par_iter().map(|piece| PieceStart::of(piece)).collect();
        for size in sizes {
            starts.push(starts[starts.len() - 1].and(size));
        }
    }
    let read: Vec<TextPiece> =
        pieces.par_iter().zip(&starts).map(|(piece, start)| TextPiece::read(piece, *start)).collect();
    let mut furthest = [(0_i64, 0_usize); 3];
    for piece in &read {
        for (furthest, of_piece) in furthest.iter_mut().zip(piece.furthest) {
            if of_piece.0 > furthest.0 {
                *furthest = of_piece;
            }
        }
    }
    let mut parsed = joined(read);
    // A positive index may refer to a later line, so it can only be checked at the end.
    let counts = parsed.counts();
    for kind in [UV, NORMAL] {
        let (index, line) = furthest[kind];
        if index > counts[kind] as i64 {
            parsed.forget_indices_beyond(kind, counts[kind], line);
        }
    }
    let beyond = (furthest[0].0 > counts[0] as i64).then_some(furthest[0].1);
    let not_finite = parsed.repairs.first_line(Repair::Position);
    if beyond.is_some() || not_finite.is_some() {
        parsed.remove_faces_without_positions(beyond.unwrap_or(0), not_finite.unwrap_or(0));
    }
    parsed
}

/// Kinds of indices; 0 is that of positions.
const UV: usize = 1;
const NORMAL: usize = 2;

/// Counts before a position in the file.
#[derive(Clone, Copy, Default)]
struct PieceStart {
    /// Number of line endings.
    lines: usize,
    /// Number of positions, texture coordinates and normals.
    counts: [usize; 3],
}

impl PieceStart {
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
struct TextPiece {
    parsed: ParsedObj,
    before: [usize; 3],
    /// Each `usemtl`: the number of faces before it, and the name.
    materials: Vec<(usize, String)>,
    /// The largest index of each kind, and its line.
    furthest: [(i64, usize); 3],
}

impl TextPiece {
    fn read(bytes: &[u8], start: PieceStart) -> Self {
        let mut piece = Self { before: start.counts, ..Self::default() };
        for (number, line) in lines(bytes) {
            let number = start.lines + number;
            piece.read_line(number, &line);
        }
        piece
    }

    fn read_line(&mut self, number: usize, line: &[u8]) {
        let parsed = &mut self.parsed;
        match first_word(line) {
            b"v" => parsed.push_vertex(line, number),
            b"vn" => {
                let normal =
                    parsed.finite_or_zero(DVec3::from_array(numbers(&mut values(line))), Repair::Normal, number);
                parsed.normals.push(normal);
            }
            b"vt" => {
                let uv = parsed.finite_or_zero(texture_coordinate(line).extend(0.0), Repair::Uv, number);
                parsed.uvs.push(uv.truncate());
            }
            b"f" => {
                let counts = parsed.counts();
                let counts = std::array::from_fn(|k| self.before[k] + counts[k]);
                let largest = parsed.push_face(line, counts, number);
                for (furthest, index) in self.furthest.iter_mut().zip(largest) {
                    if index > furthest.0 {
                        *furthest = (index, number);
                    }
                }
            }
            b"l" | b"p" => parsed.lines_and_points += 1,
            b"usemtl" => self.materials.push((parsed.arities.len(), rest(line))),
            b"mtllib" => parsed.libraries.push(bytes_to_text(rest_bytes(line))),
            b"#MRGB" => parsed.mrgb.extend(rest_bytes(line).chunks_exact(8).map_while(masked_color)),
            _ => {}
        }
    }
}

/// Concatenates the pieces.
fn joined(pieces: Vec<TextPiece>) -> ParsedObj {
    let mut all = ParsedObj::default();
    let total = |len: fn(&ParsedObj) -> usize| pieces.iter().map(|piece| len(&piece.parsed)).sum::<usize>();
    all.positions.reserve_exact(total(|p| p.positions.len()));
    let has_colors = pieces.iter().any(|piece| !piece.parsed.colors.is_empty());
    all.uvs.reserve_exact(total(|p| p.uvs.len()));
    all.normals.reserve_exact(total(|p| p.normals.len()));
    all.corners.reserve_exact(total(|p| p.corners.len()));
    all.arities.reserve_exact(total(|p| p.arities.len()));
    all.face_materials.reserve_exact(total(|p| p.arities.len()));
    // The current material name, and its index once a face has used it.
    let (mut name, mut material) = (String::new(), None);
    let mut known: HashMap<String, u32> = HashMap::new();
    for TextPiece { parsed, materials, .. } in pieces {
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
        if has_colors {
            all.colors.extend(parsed.colors);
            all.colors.resize(all.positions.len(), Vec3::NAN);
        }
        all.mrgb.extend(parsed.mrgb);
        all.uvs.extend(parsed.uvs);
        all.normals.extend(parsed.normals);
        all.corners.extend(parsed.corners);
        all.arities.extend(parsed.arities);
        all.libraries.extend(parsed.libraries);
        all.lines_and_points += parsed.lines_and_points;
        all.repairs.add(parsed.repairs);
    }
    all
}

impl ParsedObj {
    /// Frees everything but the names of materials and libraries.
    pub fn leave_names(&mut self) {
        let (materials, libraries) = (std::mem::take(&mut self.materials), std::mem::take(&mut self.libraries));
        *self = Self { materials, libraries, ..Self::default() };
    }

    fn counts(&self) -> [usize; 3] {
        [self.positions.len(), self.uvs.len(), self.normals.len()]
    }

    /// Adds a position and, if three more numbers follow it, its colour; a single one is a weight.
    fn push_vertex(&mut self, line: &[u8], number: usize) {
        let mut values = values(line);
        let position = DVec3::from_array(numbers(&mut values));
        if !position.is_finite() {
            self.repairs.note(Repair::Position, number);
        }
        let mut channel =
            || values.next().map(parse_number).filter(|value| value.is_finite()).map(|value| value as f32);
        if let (Some(r), Some(g), Some(b)) = (channel(), channel(), channel()) {
            self.colors.resize(self.positions.len(), Vec3::NAN);
            self.colors.push(Vec3::new(r, g, b));
        } else if !self.colors.is_empty() {
            self.colors.push(Vec3::NAN);
        }
        self.positions.push(position);
    }

    fn finite_or_zero(&mut self, value: DVec3, repair: Repair, number: usize) -> DVec3 {
        if value.is_finite() {
            return value;
        }
        self.repairs.note(repair, number);
        DVec3::ZERO
    }

    /// Adds a face unless it cannot be used; returns the largest index of each kind.
    ///
    /// - `counts`: counts up to this line.
    fn push_face(&mut self, line: &[u8], counts: [usize; 3], number: usize) -> [i64; 3] {
        let first = self.corners.len();
        let mut largest = [0; 3];
        let mut fault = None;
        for word in values(line) {
            let Some(indices) = parse_corner(word, counts, |repair| self.repairs.note(repair, number)) else {
                fault = Some(Repair::Corner);
                break;
            };
            // An index that overflows `u32` is out of range, which the check of the largest index finds.
            self.corners.push(indices.map(|index| u32::try_from(index).unwrap_or(u32::MAX)));
            for (largest, index) in largest.iter_mut().zip(indices) {
                *largest = index.max(*largest);
            }
        }
        let n_corners = self.corners.len() - first;
        if let Some(fault) = fault.or((n_corners < 3).then_some(Repair::FewCorners)) {
            self.corners.truncate(first);
            self.repairs.note(fault, number);
            return [0; 3];
        }
        self.arities.push(n_corners as u32);
        largest
    }

    /// Corners whose index of this kind is larger than `count` have none.
    fn forget_indices_beyond(&mut self, kind: usize, count: usize, line: usize) {
        for corner in &mut self.corners {
            if corner[kind] as usize > count {
                corner[kind] = 0;
                self.repairs.note(of_index(kind), line);
            }
        }
    }

    /// - `beyond`, `not_finite`: a line with a vertex index out of range, and one with a position that is not finite.
    fn remove_faces_without_positions(&mut self, beyond: usize, not_finite: usize) {
        let position = |corner: &Corner| self.positions.get(corner[0] as usize - 1);
        let (mut corners, mut arities, mut face_materials) = (Vec::new(), Vec::new(), Vec::new());
        let mut start = 0;
        for (&count, &material) in self.arities.iter().zip(&self.face_materials) {
            let face = &self.corners[start..start + count as usize];
            start += count as usize;
            if face.iter().any(|corner| position(corner).is_none()) {
                self.repairs.note(Repair::Corner, beyond);
            } else if face.iter().filter_map(position).any(|position| !position.is_finite()) {
                self.repairs.note(Repair::FaceWithoutPosition, not_finite);
            } else {
                corners.extend_from_slice(face);
                arities.push(count);
                face_materials.push(material);
            }
        }
        (self.corners, self.arities, self.face_materials) = (corners, arities, face_materials);
    }
}

/// The repair of a wrong index of a kind that faces can do without.
fn of_index(kind: usize) -> Repair {
    if kind == UV { Repair::UvIndex } else { Repair::NormalIndex }
}

/// The colour of eight hexadecimal digits MMRRGGBB, where MM is a mask.
fn masked_color(digits: &[u8]) -> Option<[u8; 3]> {
    let value = u32::from_str_radix(str::from_utf8(digits).ok()?, 16).ok()?;
    let [_, r, g, b] = value.to_be_bytes();
    Some([r, g, b])
}

/// The words after the first one, up to a comment.
fn values(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    words(line).skip(1).take_while(|word| word[0] != b'#')
}

/// Indices from 1; 0 if missing. `None` if it is no vertex.
///
/// - `counts`: counts up to this line.
/// - `note`: is told of each index that is left out.
fn parse_corner(word: &[u8], counts: [usize; 3], mut note: impl FnMut(Repair)) -> Option<[i64; 3]> {
    let mut indices = [0; 3];
    for (kind, part) in word.split(|&byte| byte == b'/').enumerate() {
        if kind > 0 && part.is_empty() {
            continue;
        }
        let index = parse_index(part)?;
        let absolute = if index < 0 { *counts.get(kind)? as i64 + 1 + index } else { index };
        if absolute >= 1 {
            *indices.get_mut(kind)? = absolute;
        } else if kind > 0 {
            note(of_index(kind));
        } else {
            return None;
        }
    }
    Some(indices)
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

/// The next `N` numbers; NaN for what is missing or no number.
fn numbers<'a, const N: usize>(values: &mut impl Iterator<Item = &'a [u8]>) -> [f64; N] {
    [(); N].map(|()| values.next().map_or(f64::NAN, parse_number))
}

/// A missing second coordinate is 0.
fn texture_coordinate(line: &[u8]) -> DVec2 {
    let mut values = values(line);
    DVec2::new(values.next().map_or(f64::NAN, parse_number), values.next().map_or(0.0, parse_number))
}

/// NaN if it is no number, such as `-nan(ind)` and `1.#QNAN`, which programs write for NaN.
fn parse_number(word: &[u8]) -> f64 {
    str::from_utf8(word).ok().and_then(|text| text.parse().ok()).unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_count_from_one_and_from_the_end() {
        let obj = "v 0 0 0 1\r\nv 1 0 0\rv 0 1 0 # c\nvn 0 0 1\nf -3 2//1 \\\n 3//-1 # end\n";
        let parsed = parse(obj.as_bytes());
        assert_eq!(parsed.positions, [DVec3::ZERO, DVec3::X, DVec3::Y]);
        assert_eq!((parsed.normals, parsed.arities), (vec![DVec3::Z], vec![3]));
        assert_eq!(parsed.corners, [[1, 0, 0], [2, 0, 1], [3, 0, 1]]);
        let parsed = parse(b"v 1 2 3\nvt .5\nvt .25 1e-3 7\nf 1/1 1 1/\n");
        assert_eq!(parsed.uvs, [DVec2::new(0.5, 0.0), DVec2::new(0.25, 1e-3)]);
        assert_eq!(parsed.corners, [[1, 1, 0], [1, 0, 0], [1, 0, 0]]);
    }

    #[test]
    fn positions_keep_all_of_their_digits() {
        let parsed = parse(b"v 500000.123456789 0.1 -7e-200\n");
        assert_eq!(parsed.positions, [DVec3::new(500_000.123_456_789, 0.1, -7e-200)]);
    }

    #[test]
    fn faces_with_a_corner_that_is_no_vertex_are_removed() {
        for corner in ["a", "1/2/3/4", "/1", "1.5", "999999999999999999999", "-", "1/x", "0", "-4", "4", "99999999999"]
        {
            let parsed = parse(format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 {corner}\nusemtl b\nf 1 2 3\n").as_bytes());
            assert_eq!((&parsed.arities[..], parsed.repairs.count(Repair::Corner)), (&[3][..], 1), "{corner}");
            assert_eq!(parsed.repairs.first_line(Repair::Corner), Some(4), "{corner}");
            assert_eq!((parsed.corners.len(), parsed.materials[parsed.face_materials[0] as usize].as_str()), (3, "b"));
        }
    }

    #[test]
    fn what_is_no_number_costs_only_itself() {
        let parsed = parse(b"v 1 2\nv 1 2 3 x\nv 1 \xff 2\nv 1 2 3\nv 0 0 two\nv 4 5 6\nvt\nvn 1 2 # 3\nf 2 4 6\n");
        let is_there: Vec<bool> = parsed.positions.iter().map(|position| position.is_finite()).collect();
        assert_eq!(is_there, [false, true, false, true, false, true]);
        assert_eq!(
            (parsed.arities.len(), &parsed.uvs[..], &parsed.normals[..]),
            (1, &[DVec2::ZERO][..], &[DVec3::ZERO][..])
        );
        assert_eq!([Repair::Uv, Repair::Normal].map(|repair| parsed.repairs.first_line(repair)), [Some(7), Some(8)]);
    }

    #[test]
    fn what_a_face_can_do_without_is_left_out_and_counted() {
        let v = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
        let of = |lines: &str| parse(format!("{v}{lines}").as_bytes());
        let parsed = of("vn 0 0 1\nf 1//2 2//-2 3//0\nf 1//1 2//-1 3\n");
        assert_eq!(parsed.corners, [[1, 0, 0], [2, 0, 0], [3, 0, 0], [1, 0, 1], [2, 0, 1], [3, 0, 0]]);
        assert_eq!(parsed.repairs.count(Repair::NormalIndex), 3);
        let parsed = of("vt 0 1\nf 1/1 2/9 3/99999999999\n");
        assert_eq!(parsed.corners, [[1, 1, 0], [2, 0, 0], [3, 0, 0]]);
        assert_eq!(parsed.repairs.count(Repair::UvIndex), 2);
        let parsed = of("f\nf 1\nf 1 2 3\nf 1 2 # 3\n");
        assert_eq!((parsed.arities, parsed.corners.len()), (vec![3], 3));
        assert_eq!(parsed.repairs.count(Repair::FewCorners), 3);
        for nan in ["nan", "-NaN", "-nan(ind)", "1.#QNAN", "-1.#IND", "inf", "1e999"] {
            let parsed =
                of(&format!("vn 0 {nan} 1\nvt {nan} 1\nvt {nan}\nv {nan} 0 0\nf 1//1 2 3\nusemtl b\nf 4 2 3\n"));
            assert_eq!((&parsed.normals[..], &parsed.uvs[..]), (&[DVec3::ZERO][..], &[DVec2::ZERO; 2][..]), "{nan}");
            assert_eq!((&parsed.face_materials[..], parsed.corners.len()), (&[0][..], 3));
            let repairs = [Repair::Normal, Repair::Uv, Repair::Position, Repair::FaceWithoutPosition];
            assert_eq!(repairs.map(|repair| parsed.repairs.count(repair)), [1, 2, 1, 1], "{nan}");
        }
    }

    #[test]
    fn colours_follow_positions() {
        let parsed = parse(b"v 0 0 0\nv 1 0 0 1 .5 0\nv 0 1 0 1\n#MRGB ff0102030004050g\n");
        assert!(parsed.colors[0].is_nan() && parsed.colors[2].is_nan() && parsed.colors.len() == 3);
        assert_eq!((parsed.colors[1], &parsed.mrgb[..]), (Vec3::new(1.0, 0.5, 0.0), &[[1, 2, 3]][..]));
        assert!(parse(b"v 0 0 0 1\n").colors.is_empty());
    }

    #[test]
    fn materials_and_libraries_keep_names_with_spaces_and_odd_bytes() {
        let obj = b"\xef\xbb\xbfmtllib my file.mtl\nf 1 1 1\nusemtl Mat #1\nf 1 1 1\nusemtl unused\nusemtl \xff\nf 1 1 1\nusemtl Mat #1\nf 1 1 1\nv 0 0 0\nl 1 1\n";
        let parsed = parse(obj);
        assert_eq!(parsed.libraries, ["my file.mtl"]);
        assert_eq!(parsed.materials, ["", "Mat #1", "\u{fffd}"]);
        assert_eq!(parsed.face_materials, [0, 1, 2, 1]);
        assert_eq!(parsed.lines_and_points, 1);
    }

    /// For any file, the result and what was repaired do not depend on the division into pieces.
    #[test]
    fn pieces_say_what_the_whole_says() {
        let mut text = String::from("mtllib a.mtl\n");
        for k in 0..60 {
            let color = if k % 9 == 4 { " 0.5 1 0" } else { "" };
            text += &format!("v {k} 0 1.5{color}\nvt 0.{k} 1\nvn 0 nan 1\n");
            match k % 7 {
                3 => text += &format!("usemtl m{}\n", k % 4),
                5 => text += "f -1/-1/-1 -2//-2 \\\n -3/-3\n",
                6 => text += "f 1 2 3 4\r\nl 1 2\n",
                _ => {}
            }
        }
        let whole = parse_in(text.as_bytes(), 1);
        assert!(whole.materials.len() > 3 && whole.corners.len() > 40);
        let broken = text.clone() + "f 1 x\nf 0 0 0\n";
        for n in 2..40 {
            assert_eq!(format!("{:?}", parse_in(text.as_bytes(), n)), format!("{whole:?}"), "{n} pieces");
            for text in [&broken, &text.replacen("f 1 2 3 4", "f 1 2 3 9999", 1), &text.replacen("v 7 0", "v x 0", 1)] {
                let of = |n| format!("{:?}", parse_in(text.as_bytes(), n));
                assert_eq!(of(n), of(1), "{n} pieces");
            }
        }
    }
}
