//! What both forms of STL consist of.

use crate::error::Place;
use crate::error::stl::StlProblem;
use glam::DVec3;

/// Corners of triangles, three per triangle.
#[derive(Debug, Default)]
pub(super) struct Soup {
    /// Finite.
    pub corners: Vec<DVec3>,
    /// Colour of each triangle, as an index; empty if there is one or none.
    pub slots: Vec<u16>,
    /// Red, green and blue, sRGB.
    pub colors: Vec<[u8; 3]>,
    /// Number of facets with more than three vertices.
    pub polygons: usize,
    /// Number of facets that are no triangles or polygons of finite size.
    pub left_out: usize,
    /// Remarks for the user.
    pub notes: Vec<String>,
}

pub(super) type Located = (Place, StlProblem);

/// Whether text may contain the byte.
pub(super) fn is_plain(byte: &u8) -> bool {
    *byte >= b' ' || byte.is_ascii_whitespace()
}
