//! Decoding of `EXT_meshopt_compression`: attributes, triangles and index sequences, with their filters.
//!
//! Sizes are checked against the maximum compression ratio before anything is allocated; no input causes a panic.
//!
//! Source: Khronos and Arseny Kapoulkine, "EXT_meshopt_compression", appendices A (bitstream) and B (filters).

use super::error::GltfProblem;
use serde::Deserialize;

/// Name of the extension.
pub(super) const NAME: &str = "EXT_meshopt_compression";

/// The extension object of a view.
#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct View {
    pub buffer: u32,
    pub byte_offset: u64,
    pub byte_length: u64,
    byte_stride: u64,
    count: u64,
    mode: String,
    filter: Option<String>,
}

/// The decoded bytes of a view.
///
/// # Errors
/// If the data is invalid.
pub(super) fn decode(view: &View, data: &[u8]) -> Result<Vec<u8>, GltfProblem> {
    let wrong = GltfProblem::Compressed;
    let decoded = view.count.checked_mul(view.byte_stride).ok_or(GltfProblem::Count { count: view.count })?;
    // A group of 16 bytes takes at least two bits, a triangle one byte.
    const MOST: u64 = 128;
    if decoded > (data.len() as u64).saturating_mul(MOST) {
        return Err(GltfProblem::Count { count: view.count });
    }
    let (count, stride) = (view.count as usize, view.byte_stride as usize);
    let is_index = matches!(stride, 2 | 4);
    let mut bytes = match view.mode.as_str() {
        "ATTRIBUTES" if stride > 0 && stride % 4 == 0 && stride <= 256 => attributes(data, count, stride),
        "ATTRIBUTES" => return Err(wrong("the stride of attributes must be a multiple of 4, at most 256")),
        "TRIANGLES" if is_index && count % 3 == 0 => triangles(data, count).map(|list| narrowed(&list, stride)),
        "INDICES" if is_index => sequence(data, count).map(|list| narrowed(&list, stride)),
        "TRIANGLES" | "INDICES" => return Err(wrong("indices must have 2 or 4 bytes, and triangles three of them")),
        other => {
            let expected = "ATTRIBUTES, TRIANGLES or INDICES";
            return Err(GltfProblem::Value { what: "mode", found: other.to_owned(), expected });
        }
    }
    .ok_or(wrong("the stream has another version, ends early or goes on too long"))?;
    match view.filter.as_deref() {
        None | Some("NONE") => {}
        Some("OCTAHEDRAL") if matches!(stride, 4 | 8) => octahedral(&mut bytes, stride),
        Some("QUATERNION") if stride == 8 => quaternion(&mut bytes),
        Some("EXPONENTIAL") => exponential(&mut bytes),
        Some(other) => {
            let expected = "OCTAHEDRAL (4 or 8 bytes), QUATERNION (8 bytes) or EXPONENTIAL";
            return Err(GltfProblem::Value { what: "filter", found: other.to_owned(), expected });
        }
    }
    Ok(bytes)
}

/// Elements per group.
const GROUP: usize = 16;

/// Decodes attributes: the deltas of each byte of the elements are packed in groups.
fn attributes(data: &[u8], count: usize, stride: usize) -> Option<Vec<u8>> {
    const HEADER: u8 = 0xa0;
    const SHORTEST_TAIL: usize = 32;
    if *data.first()? != HEADER {
        return None;
    }
    let tail = stride.max(SHORTEST_TAIL);
    let end = data.len().checked_sub(tail).filter(|&end| end >= 1)?;
    let mut last = data[data.len() - stride..].to_vec();
    let mut data = &data[1..end];
    let block = ((8192 / stride) & !(GROUP - 1)).min(256);
    let mut out = vec![0; count * stride];
    for block in out.chunks_mut(block * stride) {
        let n = block.len() / stride;
        let groups = n.div_ceil(GROUP);
        for k in 0..stride {
            let header = take(&mut data, groups.div_ceil(4))?;
            for group in 0..groups {
                let deltas = unpacked(&mut data, (header[group / 4] >> (2 * (group % 4))) & 3)?;
                for (i, delta) in deltas.into_iter().enumerate().take(n - group * GROUP) {
                    last[k] = last[k].wrapping_add((delta >> 1) ^ (delta & 1).wrapping_neg());
                    block[(group * GROUP + i) * stride + k] = last[k];
                }
            }
        }
    }
    data.is_empty().then_some(out)
}

fn take<'a>(data: &mut &'a [u8], n: usize) -> Option<&'a [u8]> {
    let (head, rest) = data.split_at_checked(n)?;
    *data = rest;
    Some(head)
}

/// A group of zeros, of two or four bits each (all ones: a full byte follows), or of bytes.
fn unpacked(data: &mut &[u8], mode: u8) -> Option<[u8; GROUP]> {
    let bits = match mode {
        0 => return Some([0; GROUP]),
        1 => 2,
        2 => 4,
        _ => return take(data, GROUP)?.try_into().ok(),
    };
    let packed = take(data, GROUP * bits / 8)?;
    let (each, mask) = (8 / bits, (1 << bits) - 1);
    let mut group = [0; GROUP];
    for (i, value) in group.iter_mut().enumerate() {
        // The first one is in the highest bits.
        *value = (packed[i / each] >> (8 - bits * (i % each + 1))) & mask;
        if *value == mask {
            *value = take(data, 1)?[0];
        }
    }
    Some(group)
}

fn narrowed(list: &[u32], stride: usize) -> Vec<u8> {
    match stride {
        2 => list.iter().flat_map(|&index| (index as u16).to_le_bytes()).collect(),
        _ => list.iter().flat_map(|&index| index.to_le_bytes()).collect(),
    }
}

/// A variable-length integer with seven bits per byte.
fn variable(data: &mut &[u8]) -> Option<u32> {
    let mut value = 0;
    for shift in [0, 7, 14, 21, 28] {
        let byte = take(data, 1)?[0];
        value |= u32::from(byte & 127) << shift;
        if byte < 128 {
            return Some(value);
        }
    }
    None
}

fn zigzag(value: u32) -> u32 {
    (value >> 1) ^ (value & 1).wrapping_neg()
}

/// The last 16 values.
struct Recent<T> {
    list: [T; 16],
    next: usize,
}

impl<T: Copy + Default> Recent<T> {
    fn new() -> Self {
        Self { list: [T::default(); 16], next: 0 }
    }

    fn push(&mut self, value: T) {
        self.list[self.next & 15] = value;
        self.next = self.next.wrapping_add(1);
    }

    /// The last value for 1, the one before for 2.
    fn back(&self, n: usize) -> T {
        self.list[self.next.wrapping_sub(n) & 15]
    }
}

/// Decodes triangle indices; most triangles share an edge with one of the last ones.
fn triangles(data: &[u8], count: usize) -> Option<Vec<u32>> {
    const HEADER: u8 = 0xe1;
    const TABLE: usize = 16;
    if *data.first()? != HEADER {
        return None;
    }
    let (codes, rest) = data[1..].split_at_checked(count / 3)?;
    let (mut data, table) = rest.split_at_checked(rest.len().checked_sub(TABLE)?)?;
    let mut edges = Recent::<[u32; 2]>::new();
    let mut vertices = Recent::<u32>::new();
    let (mut next, mut last) = (0_u32, 0_u32);
    let mut out = Vec::with_capacity(count);
    let fresh = |next: &mut u32| {
        let vertex = *next;
        *next = next.wrapping_add(1);
        vertex
    };
    for &code in codes {
        if code < 0xf0 {
            let [a, b] = edges.back(1 + usize::from(code >> 4));
            let third = code & 15;
            let c = match third {
                0 => fresh(&mut next),
                1..13 => vertices.back(1 + usize::from(third)),
                _ => {
                    last = match third {
                        13 => last.wrapping_sub(1),
                        14 => last.wrapping_add(1),
                        _ => last.wrapping_add(zigzag(variable(&mut data)?)),
                    };
                    last
                }
            };
            if third == 0 || third >= 13 {
                vertices.push(c);
            }
            edges.push([c, b]);
            edges.push([a, c]);
            out.extend([a, b, c]);
            continue;
        }
        let is_short = code < 0xfe;
        let more = if is_short { table[usize::from(code & 15)] } else { take(&mut data, 1)?[0] };
        if !is_short && more == 0 {
            next = 0;
        }
        let codes = [if code == 0xff { 15 } else { 0 }, more >> 4, more & 15];
        let mut corners = [0; 3];
        // New vertices come first, then the explicit ones.
        for (corner, &code) in corners.iter_mut().zip(&codes) {
            *corner = match code {
                0 => fresh(&mut next),
                n => vertices.back(usize::from(n)),
            };
        }
        if !is_short {
            for (corner, _) in corners.iter_mut().zip(&codes).filter(|(_, code)| **code == 15) {
                last = last.wrapping_add(zigzag(variable(&mut data)?));
                *corner = last;
            }
        }
        for (i, &corner) in corners.iter().enumerate() {
            if i == 0 || codes[i] == 0 || (codes[i] == 15 && !is_short) {
                vertices.push(corner);
            }
        }
        let [a, b, c] = corners;
        edges.push([b, a]);
        edges.push([c, b]);
        edges.push([a, c]);
        out.extend(corners);
    }
    data.is_empty().then_some(out)
}

/// Decodes indices as deltas to one of two previous values.
fn sequence(data: &[u8], count: usize) -> Option<Vec<u32>> {
    const HEADER: u8 = 0xd1;
    const TAIL: usize = 4;
    if *data.first()? != HEADER {
        return None;
    }
    let end = data.len().checked_sub(TAIL).filter(|&end| end >= 1)?;
    let mut data = &data[1..end];
    let mut last = [0_u32; 2];
    let mut out = Vec::with_capacity(count.min(data.len()));
    for _ in 0..count {
        let value = variable(&mut data)?;
        let which = &mut last[(value & 1) as usize];
        *which = which.wrapping_add(zigzag(value >> 1));
        out.push(*which);
    }
    data.is_empty().then_some(out)
}

/// Decodes unit vectors in octahedral coordinates; the third component holds the encoding of 1.
fn octahedral(bytes: &mut [u8], stride: usize) {
    let size = stride / 4;
    let most = if size == 1 { 127.0 } else { 32767.0 };
    for element in bytes.chunks_exact_mut(stride) {
        let get = |i: usize| match size {
            1 => f32::from(element[i] as i8),
            _ => f32::from(i16::from_le_bytes([element[2 * i], element[2 * i + 1]])),
        };
        let (mut x, mut y, one) = (get(0), get(1), get(2));
        let z = one - x.abs() - y.abs();
        let fold = z.min(0.0);
        x += if x >= 0.0 { fold } else { -fold };
        y += if y >= 0.0 { fold } else { -fold };
        let length = (x * x + y * y + z * z).sqrt();
        let scale = if length > 0.0 { most / length } else { 0.0 };
        for (i, value) in [x, y, z].into_iter().enumerate() {
            let rounded = (value * scale).round();
            match size {
                1 => element[i] = (rounded as i8) as u8,
                _ => element[2 * i..2 * i + 2].copy_from_slice(&(rounded as i16).to_le_bytes()),
            }
        }
    }
}

/// Decodes unit quaternions without their largest component, whose index is in two bits of the fourth number.
fn quaternion(bytes: &mut [u8]) {
    for element in bytes.chunks_exact_mut(8) {
        let get = |i: usize| i16::from_le_bytes([element[2 * i], element[2 * i + 1]]);
        let (which, one) = ((get(3) & 3) as usize, f32::from(get(3) | 3));
        let scale = std::f32::consts::FRAC_1_SQRT_2 / one;
        let [x, y, z] = [0, 1, 2].map(|i| f32::from(get(i)) * scale);
        let w = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
        for (i, value) in [w, x, y, z].into_iter().enumerate() {
            let at = 2 * ((which + i) & 3);
            element[at..at + 2].copy_from_slice(&((value * 32767.0).round() as i16).to_le_bytes());
        }
    }
}

/// Decodes numbers with a mantissa of 24 bits and an exponent of 8 bits.
fn exponential(bytes: &mut [u8]) {
    for four in bytes.chunks_exact_mut(4) {
        let value = i32::from_le_bytes([four[0], four[1], four[2], four[3]]);
        let (exponent, mantissa) = (value >> 24, (value << 8) >> 8);
        let number = (f64::from(mantissa) * 2_f64.powi(exponent)) as f32;
        four.copy_from_slice(&number.to_le_bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(mode: &str, filter: Option<&str>, count: u64, byte_stride: u64) -> View {
        View { mode: mode.to_owned(), filter: filter.map(str::to_owned), count, byte_stride, ..View::default() }
    }

    /// Bytes of 17 elements of four bytes: constants, small steps, larger steps and noise.
    fn elements() -> Vec<[u8; 4]> {
        (0..17_u8).map(|i| [9, i / 8, i.wrapping_mul(7), i.wrapping_mul(91) ^ 0x5a]).collect()
    }

    /// An encoder that uses `mode` for every group that allows it, else raw bytes.
    fn encode(elements: &[[u8; 4]], modes: [u8; 4]) -> Vec<u8> {
        let mut out = vec![0xa0];
        let first = elements[0];
        for k in 0..4 {
            let mut last = first[k];
            let mut deltas: Vec<u8> = elements
                .iter()
                .map(|element| {
                    let delta = element[k].wrapping_sub(last) as i8;
                    last = element[k];
                    ((delta << 1) ^ (delta >> 7)) as u8
                })
                .collect();
            deltas.resize(deltas.len().next_multiple_of(16), 0);
            let mode = modes[k];
            let groups = deltas.len() / 16;
            out.push((0..groups).map(|g| mode << (2 * g)).sum());
            for group in deltas.chunks(16) {
                let bits = [0, 2, 4, 8][mode as usize];
                if bits == 0 {
                    assert!(group.iter().all(|&d| d == 0));
                } else if bits == 8 {
                    out.extend(group);
                } else {
                    let most = (1 << bits) - 1;
                    let small: Vec<u8> = group.iter().map(|&d| d.min(most)).collect();
                    out.extend(small.chunks(8 / bits).map(|part| part.iter().fold(0, |byte, v| (byte << bits) | v)));
                    out.extend(group.iter().filter(|&&d| d >= most));
                }
            }
        }
        out.extend([0; 28]);
        out.extend(first);
        out
    }

    #[test]
    fn attributes_come_back_from_every_packing() {
        let elements = elements();
        for modes in [[0, 1, 2, 3], [1, 2, 1, 1], [2, 1, 3, 2], [3; 4]] {
            let data = encode(&elements, modes);
            let decoded = decode(&view("ATTRIBUTES", None, 17, 4), &data).unwrap();
            assert_eq!(decoded, elements.concat(), "{modes:?}");
            for length in 0..data.len() {
                assert!(decode(&view("ATTRIBUTES", None, 17, 4), &data[..length]).is_err(), "{length}");
            }
        }
    }

    #[test]
    fn triangles_follow_edges_and_vertices() {
        // A new triangle by the table, one on its edge with a new vertex, and an explicit one.
        let mut data = vec![0xe1, 0xf0, 0x10, 0xff];
        // Vertices 7, 0 and 2: each as the difference to the previous one, starting at 0.
        data.extend([0xff, 14, 13, 4]);
        data.extend([0; 16]);
        let decoded = decode(&view("TRIANGLES", None, 9, 4), &data).unwrap();
        let list: Vec<u32> = decoded.chunks(4).map(|four| u32::from_le_bytes(four.try_into().unwrap())).collect();
        assert_eq!(list, [0, 1, 2, 2, 1, 3, 7, 0, 2]);
        assert!(decode(&view("TRIANGLES", None, 8, 4), &data).is_err());
        assert!(decode(&view("TRIANGLES", None, 12, 4), &data).is_err());
        assert!(decode(&view("TRIANGLES", None, u64::MAX, 4), &data).is_err());
        assert!(decode(&view("TRIANGLES", None, 3 << 30, 4), &data).is_err());
    }

    #[test]
    fn sequences_step_from_one_of_two_numbers() {
        // +5 to the first, +100 to the second, -1 to the first.
        let data = [0xd1, 5 << 2, 0x91, 0x03, 1 << 1, 0, 0, 0, 0];
        let decoded = decode(&view("INDICES", None, 3, 2), &data).unwrap();
        assert_eq!(decoded, [5, 0, 100, 0, 4, 0]);
    }

    #[test]
    fn filters_give_unit_vectors_turns_and_numbers() {
        let mut bytes: Vec<u8> = [100_i8, -20, 127, 5, 60, 120, 127, -9].map(|b| b as u8).to_vec();
        octahedral(&mut bytes, 4);
        for (element, (x, y)) in bytes.chunks(4).zip([(100.0, -20.0), (60.0, 120.0)]) {
            let found = [0, 1, 2].map(|i| f32::from(element[i] as i8) / 127.0);
            let z = 127.0 - f32::abs(x) - f32::abs(y);
            let fold = f32::min(z, 0.0);
            let (x, y) = (x + fold * x.signum(), y + fold * y.signum());
            let length = (x * x + y * y + z * z).sqrt();
            for (found, expected) in found.iter().zip([x, y, z]) {
                assert!((found - expected / length).abs() < 0.01);
            }
        }
        assert_eq!((bytes[3], bytes[7]), (5, (-9_i8) as u8));
        let mut bytes: Vec<u8> = [0_i16, 0, 1000, 1022].iter().flat_map(|v| v.to_le_bytes()).collect();
        quaternion(&mut bytes);
        let turn: Vec<f32> = bytes.chunks(2).map(|b| f32::from(i16::from_le_bytes([b[0], b[1]])) / 32767.0).collect();
        assert!((turn.iter().map(|v| v * v).sum::<f32>() - 1.0).abs() < 1e-3);
        // 1022 has 2 in its low bits: the third component is the largest, and the others follow cyclically.
        assert!(turn[1] > 0.6 && turn[2] > 0.6 && turn[0] == 0.0 && turn[3] == 0.0, "{turn:?}");
        let mut bytes = ((-3_i32 << 24) | (0x00ff_ffff & -20)).to_le_bytes().to_vec();
        exponential(&mut bytes);
        assert_eq!(bytes, (-2.5_f32).to_le_bytes());
    }
}
