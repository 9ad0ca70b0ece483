//! Vertex colours of OBJ files, which the format does not have and many programs write.
//!
//! Two forms are in use: three numbers after a position (MeshLab, Blender, CloudCompare, photogrammetry), from 0 to 1 or
//! to 255, and comments `#MRGB` with a mask and a colour in hexadecimal digits per position (ZBrush). Both are sRGB, as
//! Blender reads them.

use crate::obj::parse::ParsedObj;
use firstlight_render::decode_srgb;
use glam::{Vec3, Vec4};

/// Colours of the positions of the file, linear Rec. 709; white where it has none, empty if all are white.
pub(crate) fn vertex_colors(parsed: &ParsedObj) -> Vec<Vec4> {
    let bytes = |[r, g, b]: [u8; 3]| Vec3::new(r.into(), g.into(), b.into());
    let mrgb: Vec<Vec3>;
    let encoded = if parsed.colors.is_empty() {
        mrgb = parsed.mrgb.iter().copied().map(bytes).collect();
        &mrgb
    } else {
        &parsed.colors
    };
    /// No program writes colours from 0 to 1 that are so much brighter than white.
    const MOST: f32 = 2.0;
    let is_of_bytes = parsed.colors.is_empty() || encoded.iter().any(|color| color.max_element() > MOST);
    let white = if is_of_bytes { 255.0 } else { 1.0 };
    if encoded.iter().all(|color| color.is_nan() || *color == Vec3::splat(white)) {
        return Vec::new();
    }
    let linear = |color: &Vec3| {
        let decode = |value: f32| decode_srgb(f64::from((value / white).clamp(0.0, 1.0))) as f32;
        if color.is_nan() { Vec4::ONE } else { Vec3::from_array(color.to_array().map(decode)).extend(1.0) }
    };
    let mut colors: Vec<Vec4> = encoded.iter().take(parsed.positions.len()).map(linear).collect();
    colors.resize(parsed.positions.len(), Vec4::ONE);
    colors
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::obj::parse::parse;

    fn colors(text: &str) -> Vec<Vec4> {
        vertex_colors(&parse(text.as_bytes()))
    }

    #[test]
    fn both_ranges_and_zbrush_give_the_same_linear_colours() {
        let expected = [Vec4::ONE, Vec4::new(1.0, 0.2158605, 0.0, 1.0)];
        for text in [
            "v 0 0 0\nv 0 0 1 1 0.501960784 0\n",
            "v 0 0 0 255 255 255\nv 0 0 1 255 128 0\n",
            "v 0 0 0\nv 0 0 1\n#MRGB ffffffff00ff8000\n",
        ] {
            let found = colors(text);
            assert!(found.iter().zip(expected).all(|(a, b)| a.abs_diff_eq(b, 1e-5)), "{text}: {found:?}");
            assert_eq!(found.len(), 2);
        }
    }

    #[test]
    fn white_says_nothing() {
        assert!(colors("v 0 0 0 1 1 1\nv 0 0 1\n").is_empty());
        assert!(colors("v 0 0 0\n#MRGB ffffffff\n").is_empty());
        assert!(colors("v 0 0 0\n#MRGB\n").is_empty());
    }
}
