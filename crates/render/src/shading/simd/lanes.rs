//! Helpers of the code for sixteen hits.

use crate::core::material::MaterialKind;
use crate::shading::interface::MediumId;
use crate::shading::medium::MediumSets;
use firstlight_simd::{Float, LANES, Mask, Simd, Vector};

pub(crate) const DIFFUSE: usize = MaterialKind::Diffuse as usize;
pub(crate) const MIRROR: usize = MaterialKind::Mirror as usize;
pub(crate) const GLASS: usize = MaterialKind::Glass as usize;
pub(crate) const METAL: usize = MaterialKind::Metal as usize;
pub(crate) const PLASTIC: usize = MaterialKind::Plastic as usize;
pub(crate) const DISNEY: usize = MaterialKind::Disney as usize;
pub(crate) const TRANSLUCENT: usize = MaterialKind::Translucent as usize;

#[inline(always)]
pub(crate) fn lanes_of(mask: Mask) -> impl Iterator<Item = usize> {
    (0..LANES).filter(move |lane| mask >> lane & 1 != 0)
}

/// Transmittance over `distance` metres, lane by lane.
#[inline(always)]
pub(crate) fn transmittance<S: Simd>(
    s: S,
    sets: &MediumSets,
    mask: Mask,
    media: &[MediumId; LANES],
    distance: Float<S>,
) -> Vector<S> {
    let distances = distance.to_array();
    let mut kept = [[1.0; LANES]; 3];
    for lane in lanes_of(mask) {
        let found = sets.transmittance(media[lane], distances[lane]);
        (kept[0][lane], kept[1][lane], kept[2][lane]) = (found.x, found.y, found.z);
    }
    Vector::from_arrays(s, &kept)
}
