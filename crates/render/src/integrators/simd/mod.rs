//! Shading of sixteen paths at a time, for diffuse, mirror, glass, metal, and two of them in one surface.
//!
//! A wave's hits come sorted by kind of material, so the lanes of a chunk do the same. What is rare is done lane by
//! lane with the scalar code: textures, the glasses that a path is inside of, many lights, and pictures of the
//! surroundings. The scalar version of the whole is `path.rs`, which shades all other materials; tests
//! hold the two against each other.
//!
//! Start reading at [`shade::shade`].

pub(crate) mod camera;
pub(crate) mod classic;
pub(crate) mod emitters;
pub(crate) mod first_hits;
pub(crate) mod misses;
pub(crate) mod shade;
pub(crate) mod sort;
mod track;
