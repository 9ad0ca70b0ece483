//! Reads accessors: all component types, normalised or not, with strides and sparse parts.
//!
//! Counts and offsets are checked against the available bytes before anything is allocated; sums are computed in 128
//! bits.
//!
//! Source: Khronos, "glTF 2.0 Specification", §3.6 (binary data storage).

use crate::error::gltf::{GltfProblem, Located, item, place};
use crate::gltf::document::Document;
use crate::gltf::json;

/// The type of a component, with its number in the format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn of(number: u32) -> Result<Self, GltfProblem> {
        Ok(match number {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => {
                let expected = "5120 to 5123, 5125 or 5126";
                return Err(GltfProblem::Value { what: "componentType", found: number.to_string(), expected });
            }
        })
    }

    fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// - `bytes`: at least [`Self::bytes`] of them.
    #[inline]
    fn float(self, bytes: &[u8], normalized: bool) -> f32 {
        let scaled = |value: f32, largest: f32| if normalized { (value / largest).max(-1.0) } else { value };
        match self {
            Self::I8 => scaled(f32::from(bytes[0] as i8), 127.0),
            Self::U8 => scaled(f32::from(bytes[0]), 255.0),
            Self::I16 => scaled(f32::from(i16::from_le_bytes([bytes[0], bytes[1]])), 32767.0),
            Self::U16 => scaled(f32::from(u16::from_le_bytes([bytes[0], bytes[1]])), 65535.0),
            Self::U32 => {
                let value = f64::from(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]));
                (if normalized { value / f64::from(u32::MAX) } else { value }) as f32
            }
            Self::F32 => f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
        }
    }

    /// `None` for signed and floating-point types.
    #[inline]
    fn whole(self, bytes: &[u8]) -> Option<u32> {
        match self {
            Self::U8 => Some(u32::from(bytes[0])),
            Self::U16 => Some(u32::from(u16::from_le_bytes([bytes[0], bytes[1]]))),
            Self::U32 => Some(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])),
            Self::I8 | Self::I16 | Self::F32 => None,
        }
    }
}

/// Number of rows and columns; columns of a matrix are aligned to four bytes.
fn shape_of(kind: &str) -> Result<(usize, usize), GltfProblem> {
    Ok(match kind {
        "SCALAR" => (1, 1),
        "VEC2" => (2, 1),
        "VEC3" => (3, 1),
        "VEC4" => (4, 1),
        "MAT2" => (2, 2),
        "MAT3" => (3, 3),
        "MAT4" => (4, 4),
        _ => {
            let expected = "SCALAR, VEC2 to VEC4 or MAT2 to MAT4";
            return Err(GltfProblem::Value { what: "type", found: kind.to_owned(), expected });
        }
    })
}

/// Elements that have been checked to lie within their bytes.
struct Elements<'a> {
    /// `None`: all zeros.
    bytes: Option<&'a [u8]>,
    stride: usize,
    count: usize,
    component: Component,
    normalized: bool,
    /// Byte offset of each component within an element.
    offsets: Vec<usize>,
}

impl<'a> Elements<'a> {
    #[inline]
    fn at(&self, element: usize, component: usize) -> Option<&'a [u8]> {
        Some(&self.bytes?[element * self.stride + self.offsets[component]..])
    }
}

impl Document {
    pub(crate) fn accessor(&self, index: u32) -> Result<&json::Accessor, Located> {
        item(&self.root.accessors, "accessors", index).map_err(|problem| (place("accessors", index), problem))
    }

    /// Number of components per element.
    pub(crate) fn n_components(&self, index: u32) -> Result<usize, Located> {
        let accessor = self.accessor(index)?;
        let (rows, columns) = shape_of(&accessor.kind).map_err(|problem| (place("accessors", index), problem))?;
        Ok(rows * columns)
    }

    /// All elements as floats, `N` components each.
    ///
    /// # Errors
    /// If an element has another number of components, is outside of its buffer, or is not finite.
    pub(crate) fn floats<const N: usize>(&self, index: u32) -> Result<Vec<[f32; N]>, Located> {
        self.first_floats(index, usize::MAX)
    }

    /// Like [`Self::floats`], at most so many elements.
    pub(crate) fn first_floats<const N: usize>(&self, index: u32, most: usize) -> Result<Vec<[f32; N]>, Located> {
        let values = self.raw_floats_within(index, most)?;
        match values.iter().position(|value| !value.iter().all(|number| number.is_finite())) {
            Some(element) => Err((place("accessors", index), GltfProblem::NotFinite { element: element as u64 })),
            None => Ok(values),
        }
    }

    /// Like [`Self::floats`], but elements that are not finite become zero; also returns their number.
    pub(crate) fn floats_or_zero<const N: usize>(&self, index: u32) -> Result<(Vec<[f32; N]>, usize), Located> {
        let mut values: Vec<[f32; N]> = self.raw_floats(index)?;
        let mut wrong = 0;
        for value in values.iter_mut().filter(|value| !value.iter().all(|number| number.is_finite())) {
            *value = [0.0; N];
            wrong += 1;
        }
        Ok((values, wrong))
    }

    /// Like [`Self::floats`], but also elements that are not finite, as they are.
    pub(crate) fn raw_floats<const N: usize>(&self, index: u32) -> Result<Vec<[f32; N]>, Located> {
        self.raw_floats_within(index, usize::MAX)
    }

    fn raw_floats_within<const N: usize>(&self, index: u32, most: usize) -> Result<Vec<[f32; N]>, Located> {
        let accessor = self.accessor(index)?;
        let here = |problem| (place("accessors", index), problem);
        let found = self.n_components(index)?;
        if found != N {
            let what = format!("an element of type {}", accessor.kind);
            return Err(here(GltfProblem::Length { what, found: found as u64, expected: N as u64 }));
        }
        let elements = self.elements(index, accessor)?;
        let mut values = vec![[0.0; N]; elements.count.min(most)];
        let (component, normalized) = (elements.component, elements.normalized);
        let read = |elements: &Elements, i: usize| -> [f32; N] {
            std::array::from_fn(|k| elements.at(i, k).map_or(0.0, |bytes| component.float(bytes, normalized)))
        };
        if elements.bytes.is_some() {
            for (i, value) in values.iter_mut().enumerate() {
                *value = read(&elements, i);
            }
        }
        if let Some((places, sparse)) = self.sparse(index, accessor)? {
            for (i, &place) in places.iter().enumerate() {
                if let Some(value) = values.get_mut(place as usize) {
                    *value = read(&sparse, i);
                }
            }
        }
        Ok(values)
    }

    /// All elements of an accessor of integers, one component each.
    ///
    /// # Errors
    /// Like [`Self::floats`], and for component types that indices cannot have.
    pub(crate) fn indices(&self, index: u32) -> Result<Vec<u32>, Located> {
        self.whole::<1>(index).map(|list| list.into_iter().map(|[value]| value).collect())
    }

    /// All elements of an accessor of integers, `N` components each.
    pub(crate) fn whole<const N: usize>(&self, index: u32) -> Result<Vec<[u32; N]>, Located> {
        let accessor = self.accessor(index)?;
        let here = |problem| (place("accessors", index), problem);
        let found = self.n_components(index)?;
        if found != N {
            let what = format!("an element of type {}", accessor.kind);
            return Err(here(GltfProblem::Length { what, found: found as u64, expected: N as u64 }));
        }
        let elements = self.elements(index, accessor)?;
        let component = elements.component;
        if component.whole(&[0; 4]).is_none() {
            let (what, found) = ("componentType", accessor.component_type.to_string());
            return Err(here(GltfProblem::Value { what, found, expected: "5121, 5123 or 5125" }));
        }
        let read = |elements: &Elements, i: usize| -> [u32; N] {
            std::array::from_fn(|k| elements.at(i, k).and_then(|bytes| component.whole(bytes)).unwrap_or(0))
        };
        let mut values: Vec<[u32; N]> = (0..elements.count).map(|i| read(&elements, i)).collect();
        if let Some((places, sparse)) = self.sparse(index, accessor)? {
            for (i, &place) in places.iter().enumerate() {
                values[place as usize] = read(&sparse, i);
            }
        }
        Ok(values)
    }

    fn elements(&self, index: u32, accessor: &json::Accessor) -> Result<Elements<'_>, Located> {
        let here = |problem| (place("accessors", index), problem);
        let component = Component::of(accessor.component_type).map_err(here)?;
        let shape = shape_of(&accessor.kind).map_err(here)?;
        let (view, normalized) = (accessor.buffer_view, accessor.normalized);
        let elements =
            self.range(view, accessor.byte_offset, accessor.count, component, shape).map_err(|at| match at {
                (None, problem) => here(problem),
                (Some(place), problem) => (place, problem),
            })?;
        Ok(Elements { normalized, ..elements })
    }

    fn range(
        &self,
        view: Option<u32>,
        offset: u64,
        count: u64,
        component: Component,
        (rows, columns): (usize, usize),
    ) -> Result<Elements<'_>, (Option<String>, GltfProblem)> {
        let size = component.bytes();
        let column = if columns > 1 { (rows * size).next_multiple_of(4) } else { rows * size };
        let offsets: Vec<usize> = (0..columns).flat_map(|c| (0..rows).map(move |r| c * column + r * size)).collect();
        let length = column * (columns - 1) + rows * size;
        let Some(view) = view else {
            if count > self.most_elements() {
                return Err((None, GltfProblem::Count { count }));
            }
            let count = count as usize;
            return Ok(Elements { bytes: None, stride: 0, count, component, normalized: false, offsets });
        };
        let (bytes, stride) = self.view(view).map_err(|(place, problem)| (Some(place), problem))?;
        let stride = stride.unwrap_or((column * columns) as u64);
        let needed = match count {
            0 => 0,
            _ => u128::from(offset) + u128::from(count - 1) * u128::from(stride) + length as u128,
        };
        if needed > bytes.len() as u128 {
            let within = place("bufferViews", view);
            return Err((None, GltfProblem::Bounds { needed, within, found: bytes.len() as u64 }));
        }
        // With a stride of 0, or one shorter than an element, a few bytes could stand for any number of elements.
        if count > 1 && stride < length as u64 {
            let found = stride.to_string();
            let expected = "at least the size of an element";
            return Err((None, GltfProblem::Value { what: "the byteStride of its bufferView", found, expected }));
        }
        let bytes = if count == 0 { &[] } else { &bytes[offset as usize..] };
        let (stride, count) = (stride as usize, count as usize);
        Ok(Elements { bytes: Some(bytes), stride, count, component, normalized: false, offsets })
    }

    /// The sparse part of an accessor, if any: the indices that are replaced, each within its count, and the new
    /// elements.
    fn sparse(&self, index: u32, accessor: &json::Accessor) -> Result<Option<(Vec<u32>, Elements<'_>)>, Located> {
        let Some(sparse) = &accessor.sparse else { return Ok(None) };
        let inside = |part: &str| format!("{}.sparse.{part}", place("accessors", index));
        let at = |part: &'static str| {
            move |found: (Option<String>, GltfProblem)| (found.0.unwrap_or_else(|| inside(part)), found.1)
        };
        let indices = Component::of(sparse.indices.component_type).map_err(|problem| (inside("indices"), problem))?;
        let (view, offset) = (sparse.indices.buffer_view, sparse.indices.byte_offset);
        let places = self.range(Some(view), offset, sparse.count, indices, (1, 1)).map_err(at("indices"))?;
        let mut list = Vec::with_capacity(places.count);
        for i in 0..places.count {
            let place = places.at(i, 0).and_then(|bytes| indices.whole(bytes));
            match place {
                Some(place) if u64::from(place) < accessor.count => list.push(place),
                Some(place) => {
                    let problem = GltfProblem::Vertex { index: place, count: accessor.count as usize };
                    return Err((inside("indices"), problem));
                }
                None => {
                    let (what, found) = ("componentType", sparse.indices.component_type.to_string());
                    return Err((
                        inside("indices"),
                        GltfProblem::Value { what, found, expected: "5121, 5123 or 5125" },
                    ));
                }
            }
        }
        let here = |problem| (place("accessors", index), problem);
        let component = Component::of(accessor.component_type).map_err(here)?;
        let shape = shape_of(&accessor.kind).map_err(here)?;
        let (view, offset) = (sparse.values.buffer_view, sparse.values.byte_offset);
        let values = self.range(Some(view), offset, sparse.count, component, shape).map_err(at("values"))?;
        Ok(Some((list, Elements { normalized: accessor.normalized, ..values })))
    }
}
