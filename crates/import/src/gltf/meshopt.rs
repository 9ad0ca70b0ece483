//! Decoding of `KHR_meshopt_compression` and `EXT_meshopt_compression`: attributes, triangles and index sequences. The
//! two differ in name only: what the later one adds is read under both.
//!
//! Sizes are checked against the maximum compression ratio before anything is allocated; no input causes a panic.
//!
//! Source: Khronos and Arseny Kapoulkine, "KHR_meshopt_compression", appendix A (bitstream).

use crate::error::gltf::GltfProblem;
use crate::gltf::json::Extensions;
use crate::gltf::meshopt_filters::{color, exponential, octahedral, quaternion};
use serde::Deserialize;

/// Names of the extension.
const NAMES: [&str; 2] = ["KHR_meshopt_compression", "EXT_meshopt_compression"];

/// The extension object of a view.
#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(crate) struct MeshoptView {
    pub buffer: u32,
    pub byte_offset: u64,
    pub byte_length: u64,
    byte_stride: u64,
    count: u64,
    mode: String,
    filter: Option<String>,
}

/// The extension object of a view, if it has one.
///
/// # Errors
/// If the object is invalid.
pub(crate) fn of_view(extensions: &Extensions) -> Option<Result<MeshoptView, GltfProblem>> {
    let (name, object) = NAMES.iter().find_map(|name| Some((name, extensions.get(*name)?)))?;
    Some(MeshoptView::deserialize(object).map_err(|error| GltfProblem::Json(format!("{name}: {error}"))))
}

/// The decoded bytes of a view.
///
/// - `most_bytes`: maximum size of the result.
///
/// # Errors
/// If the data is invalid.
pub(crate) fn decode(view: &MeshoptView, data: &[u8], most_bytes: u64) -> Result<Vec<u8>, GltfProblem> {
    let wrong = GltfProblem::Compressed;
    let decoded = view.count.checked_mul(view.byte_stride).ok_or(GltfProblem::Count { count: view.count })?;
    // One byte says that four bytes of 256 elements stay the same.
    const MOST: u64 = 1024;
    if decoded > (data.len() as u64).saturating_mul(MOST).min(most_bytes) {
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
        Some("COLOR") if matches!(stride, 4 | 8) => color(&mut bytes, stride),
        Some(other) => {
            let expected = "OCTAHEDRAL or COLOR (4 or 8 bytes), QUATERNION (8 bytes) or EXPONENTIAL";
            return Err(GltfProblem::Value { what: "filter", found: other.to_owned(), expected });
        }
    }
    Ok(bytes)
}

/// Elements per group.
const GROUP: usize = 16;

/// Decodes attributes: the deltas of each byte of the elements are packed in groups.
fn attributes(data: &[u8], count: usize, stride: usize) -> Option<Vec<u8>> {
    let is_second = match *data.first()? {
        0xa0 => false,
        0xa1 => true,
        _ => return None,
    };
    // Four bytes are a channel. Only the second version has modes of channels, and a byte of controls for each.
    let (n_channels, shortest_tail) = if is_second { (stride / 4, 24) } else { (0, 32) };
    let tail = (stride + n_channels).max(shortest_tail);
    let end = data.len().checked_sub(tail).filter(|&end| end >= 1)?;
    let (mut last, modes) = {
        let (last, modes) = data[data.len() - stride - n_channels..].split_at(stride);
        (last.to_vec(), modes)
    };
    let mut data = &data[1..end];
    let block = ((8192 / stride) & !(GROUP - 1)).min(256);
    let mut out = vec![0; count * stride];
    for block in out.chunks_mut(block * stride) {
        let n = block.len() / stride;
        let controls = take(&mut data, n_channels)?;
        for k in 0..stride {
            let widths = match controls.get(k / 4).map(|control| (control >> (2 * (k % 4))) & 3) {
                None => [0, 2, 4, 8],
                Some(0) => [0, 1, 2, 4],
                Some(1) => [1, 2, 4, 8],
                // All deltas are zero.
                Some(2) => continue,
                Some(_) => {
                    let deltas = take(&mut data, n)?;
                    deltas.iter().enumerate().for_each(|(i, &delta)| block[i * stride + k] = delta);
                    continue;
                }
            };
            let groups = n.div_ceil(GROUP);
            let header = take(&mut data, groups.div_ceil(4))?;
            for group in 0..groups {
                let width = widths[usize::from((header[group / 4] >> (2 * (group % 4))) & 3)];
                let deltas = unpacked(&mut data, width)?;
                for (i, delta) in deltas.into_iter().enumerate().take(n - group * GROUP) {
                    block[(group * GROUP + i) * stride + k] = delta;
                }
            }
        }
        for element in block.chunks_mut(stride) {
            for (channel, value) in element.chunks_mut(4).enumerate() {
                let before = &mut last[4 * channel..4 * channel + 4];
                add_deltas(value, before, modes.get(channel).copied().unwrap_or(0))?;
                before.copy_from_slice(value);
            }
        }
    }
    data.is_empty().then_some(out)
}

/// Replaces the four deltas of a channel by its values; `None` for an unknown mode.
fn add_deltas(value: &mut [u8], before: &[u8], mode: u8) -> Option<()> {
    match mode {
        0 => {
            for (value, before) in value.iter_mut().zip(before) {
                *value = before.wrapping_add((*value >> 1) ^ (*value & 1).wrapping_neg());
            }
        }
        1 => {
            for (value, before) in value.chunks_exact_mut(2).zip(before.chunks_exact(2)) {
                let delta = u16::from_le_bytes([value[0], value[1]]);
                let before = u16::from_le_bytes([before[0], before[1]]);
                let sum = before.wrapping_add((delta >> 1) ^ (delta & 1).wrapping_neg());
                value.copy_from_slice(&sum.to_le_bytes());
            }
        }
        // The high bits tell how far the difference was rotated to the left.
        mode if mode & 15 == 2 => {
            let four = |bytes: &[u8]| u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
            let changed = four(before) ^ four(value).rotate_right(u32::from(mode >> 4));
            value.copy_from_slice(&changed.to_le_bytes());
        }
        _ => return None,
    }
    Some(())
}

fn take<'a>(data: &mut &'a [u8], n: usize) -> Option<&'a [u8]> {
    let (head, rest) = data.split_at_checked(n)?;
    *data = rest;
    Some(head)
}

/// A group of 16 deltas of `bits` each: 0 (all are zero), 1, 2, 4 (all ones: a full byte follows) or 8.
fn unpacked(data: &mut &[u8], bits: usize) -> Option<[u8; GROUP]> {
    if bits == 0 {
        return Some([0; GROUP]);
    }
    let packed = take(data, GROUP * bits / 8)?;
    if bits == 8 {
        return packed.try_into().ok();
    }
    let (each, mask) = (8 / bits, (1 << bits) - 1);
    let mut group = [0; GROUP];
    for (i, value) in group.iter_mut().enumerate() {
        // The first one is in the highest bits, but single bits begin with the lowest.
        let shift = if bits == 1 { i % each } else { 8 - bits * (i % each + 1) };
        *value = (packed[i / each] >> shift) & mask;
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
struct RecentVertices<T> {
    list: [T; 16],
    next: usize,
}

impl<T: Copy + Default> RecentVertices<T> {
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
    let mut edges = RecentVertices::<[u32; 2]>::new();
    let mut vertices = RecentVertices::<u32>::new();
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

#[cfg(test)]
mod tests {
    use super::*;

    fn view(mode: &str, filter: Option<&str>, count: u64, byte_stride: u64) -> MeshoptView {
        MeshoptView {
            mode: mode.to_owned(),
            filter: filter.map(str::to_owned),
            count,
            byte_stride,
            ..MeshoptView::default()
        }
    }

    fn decode(view: &MeshoptView, data: &[u8]) -> Result<Vec<u8>, GltfProblem> {
        super::decode(view, data, 1 << 20)
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

    /// An encoder of the second version with one channel.
    fn encode_second(elements: &[[u8; 4]], mode: u8, controls: [u8; 4]) -> Vec<u8> {
        let mut last = elements[0];
        let delta = |element: &[u8; 4]| {
            let before = std::mem::replace(&mut last, *element);
            let words = |four: [u8; 4]| [[four[0], four[1]], [four[2], four[3]]].map(u16::from_le_bytes);
            match mode & 15 {
                0 => std::array::from_fn(|k| {
                    let delta = element[k].wrapping_sub(before[k]) as i8;
                    ((delta << 1) ^ (delta >> 7)) as u8
                }),
                1 => {
                    let (now, then) = (words(*element), words(before));
                    let delta = [0, 1].map(|i| now[i].wrapping_sub(then[i]) as i16);
                    let [a, b] = delta.map(|delta| (((delta << 1) ^ (delta >> 15)) as u16).to_le_bytes());
                    [a[0], a[1], b[0], b[1]]
                }
                _ => {
                    let changed = u32::from_le_bytes(*element) ^ u32::from_le_bytes(before);
                    changed.rotate_left(u32::from(mode >> 4)).to_le_bytes()
                }
            }
        };
        let deltas: Vec<[u8; 4]> = elements.iter().map(delta).collect();
        let mut out = vec![0xa1, (0..4).map(|k| controls[k] << (2 * k)).sum()];
        for (k, control) in controls.into_iter().enumerate() {
            let column: Vec<u8> = deltas.iter().map(|delta| delta[k]).collect();
            match control {
                2 => assert!(column.iter().all(|&delta| delta == 0)),
                3 => out.extend(column),
                // Each group with another of the widths, but for 0.
                _ => {
                    let groups = column.len().div_ceil(16);
                    let width = |group: usize| (group + usize::from(control == 0)) % 3 + usize::from(control == 0);
                    let width = |group: usize| width(group).clamp(usize::from(control == 0), 3);
                    out.push((0..groups).map(|group| (width(group) as u8) << (2 * group)).sum());
                    for (group, deltas) in column.chunks(16).enumerate() {
                        let mut deltas = deltas.to_vec();
                        deltas.resize(16, 0);
                        let bits = [[0, 1, 2, 4], [1, 2, 4, 8]][usize::from(control)][width(group)];
                        if bits == 8 {
                            out.extend(deltas);
                            continue;
                        }
                        let most = (1 << bits) - 1;
                        let small: Vec<u8> = deltas.iter().map(|&delta| delta.min(most)).collect();
                        out.extend(small.chunks(8 / bits).map(|part| {
                            let packed = |byte: u8, value: &u8| (byte << bits) | value;
                            match bits {
                                1 => part.iter().rev().fold(0, packed),
                                _ => part.iter().fold(0, packed),
                            }
                        }));
                        out.extend(deltas.iter().filter(|&&delta| delta >= most));
                    }
                }
            }
        }
        out.extend([0; 19]);
        out.extend(elements[0]);
        out.push(mode);
        out
    }

    #[test]
    fn attributes_of_the_second_version_come_back_too() {
        let elements: Vec<[u8; 4]> =
            (0..50_u32).map(|i| [9, (i / 3) as u8, (i * 7) as u8, ((i * 91) ^ 0x5a) as u8]).collect();
        for mode in [0, 1, 2, 2 | 5 << 4, 2 | 15 << 4] {
            for controls in [[0, 0, 1, 3], [1, 1, 0, 0], [3, 0, 3, 1]] {
                let data = encode_second(&elements, mode, controls);
                let decoded = decode(&view("ATTRIBUTES", None, 50, 4), &data).unwrap();
                assert_eq!(decoded, elements.concat(), "{mode} {controls:?}");
                for length in 0..data.len() {
                    assert!(decode(&view("ATTRIBUTES", None, 50, 4), &data[..length]).is_err(), "{length}");
                }
            }
        }
        let data = encode_second(&elements, 0, [2, 0, 1, 3]);
        assert_eq!(decode(&view("ATTRIBUTES", None, 50, 4), &data).unwrap(), elements.concat());
        for mode in [3, 1 | 1 << 4] {
            let mut data = data.clone();
            *data.last_mut().unwrap() = mode;
            assert!(decode(&view("ATTRIBUTES", None, 50, 4), &data).is_err());
        }
        // A few bytes for many elements that are all the same.
        let mut data = vec![0xa1, 0xaa];
        data.extend([0; 19]);
        data.extend([1, 2, 3, 4, 0]);
        assert_eq!(decode(&view("ATTRIBUTES", None, 256, 4), &data).unwrap(), [1, 2, 3, 4].repeat(256));
        assert!(super::decode(&view("ATTRIBUTES", None, 256, 4), &data, 1023).is_err());
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
}
