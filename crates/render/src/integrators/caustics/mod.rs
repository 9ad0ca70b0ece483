//! Caustics: light that reaches a diffuse surface through glass or by a mirror.
//!
//! A camera path finds such light only if a diffuse bounce happens to go through the glass and on to the light. So
//! paths are traced from the lights as well, aimed at specular casters that focus light ([`crate::prepare::casters`]);
//! every diffuse or rough vertex of them is connected to a point of the lens, and contributes to the pixels that see it
//! ([`trace`], [`simd`], [`crate::film::light_layer`]). Both techniques find the same light: all paths whose first
//! vertex from the camera scatters and whose last vertex before the light is specular. Each is weighted by the power
//! heuristic ([`weight`]), so the expectation of the image is unchanged. Light seen in a mirror or through glass cannot
//! be connected to the lens: there, camera paths are guided ([`crate::prepare::guide`]).
//!
//! Scenes without specular surfaces, or without lights and images of an environment, have no
//! [`crate::prepare::casters::CasterTable`], and no cost. Start reading at [`pass::CausticPass`].

pub(crate) mod dimensions;
pub(crate) mod lens_connections;
pub(crate) mod pilot;
pub(crate) mod plan;
pub(crate) mod simd;
pub(crate) mod trace;
