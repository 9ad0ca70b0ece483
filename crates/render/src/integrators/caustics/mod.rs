//! Caustics: light that comes to a diffuse surface through glass or off a mirror.
//!
//! A path that starts at the camera finds such light only when a bounce off the diffuse surface happens to go through the
//! glass and on to the light. So paths are traced from the lights as well, aimed at what is specular and gathers
//! light ([`crate::prepare::casters`]); from every diffuse or rough vertex that they come to, they are joined to a point of the lens and
//! their light is added to the pixels that see it ([`trace`], [`simd`], [`crate::film::light_layer`]). Both ways find the same light: all paths whose
//! first vertex from the camera scatters in all directions and whose last before the light is specular. Each is
//! weighted by the power heuristic ([`weight`]), so the mean of the picture stays as it is. What is seen in a mirror or
//! through glass cannot be joined to the lens: there, camera paths are told the way ([`crate::prepare::guide`]).
//!
//! Scenes without specular surfaces or without finite lights have no [`crate::prepare::casters::CasterTable`], and pay nothing.
//! Start reading at [`pass::CausticPass`].

pub(crate) mod batches;
pub(crate) mod dimensions;
pub(crate) mod lens_connections;
pub(crate) mod pass;
pub(crate) mod pilot;
pub(crate) mod plan;
pub(crate) mod simd;
pub(crate) mod trace;
pub(crate) mod weight;
