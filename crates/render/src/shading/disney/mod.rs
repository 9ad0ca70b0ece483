//! Disney's BSDF as Mitsuba 3 evaluates it in `principled` and `principledthin` (Burley 2012, "Physically Based Shading
//! at Disney", and 2015, "Extending the Disney BRDF to a BSDF with Integrated Subsurface Scattering").
//!
//! [`layers`] is what it reflects, at one point or at sixteen; [`surface`] adds what passes, at one point. Its parts are
//! a plain sum: unlike `principled` it neither conserves energy nor is it limited to it.

pub(crate) mod at;
pub(crate) mod layers;
pub(crate) mod surface;
