//! Shading of sixteen paths at a time, for diffuse, mirror, glass, metal, plastic and translucent surfaces, two in one
//! surface, and layers.
//!
//! A wave's hits are sorted by kind of material, so the lanes of a group take the same branches. Rare cases use the
//! scalar code lane by lane: texels, the media of a path, and emission of layers. The scalar version of the whole is
//! `path/scalar.rs`, which shades all other materials; tests compare the two.
//!
//! Start reading at [`shade::shade`].

pub(crate) mod camera;
pub(crate) mod direct;
pub(crate) mod emission;
pub(crate) mod emitters;
pub(crate) mod first_hits;
pub(crate) mod misses;
pub(crate) mod shade;
pub(crate) mod sort;
mod track;
