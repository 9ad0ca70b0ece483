//! Switches for variance reduction techniques, so that a report can measure the benefit of each.

use crate::core::caustic_plan::CausticPlan;

/// The techniques in use. None of them changes the expectation of the image: without it there is more noise, or the
/// same noise takes longer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Techniques {
    /// Each diffuse or rough vertex samples a light; off: only BSDF sampling finds lights.
    pub light_sampling: bool,
    /// Light that both light sampling and BSDF sampling find is weighted between them; off: light sampling takes all of
    /// it.
    pub mis: bool,
    /// A pixel's samples are Owen-scrambled nets; off: they are independent.
    pub even_samples: bool,
    /// Lights are sampled uniformly in solid angle; off: in area.
    pub solid_angle: bool,
    /// Lights are selected by estimated contribution or by power; off: uniformly.
    pub light_selection: bool,
    /// The environment is sampled through the openings of a room; off: by its brightness only, or not at all.
    pub portals: bool,
    /// Several points on lights compete for the shadow ray of a rough metal; off: one point.
    pub resampling: bool,
    /// Paths are also traced from the lights if there are specular casters; off: from the camera only.
    pub caustics: bool,
    /// Plan for caustics, if [`Self::caustics`] is set; `None`: the choice of a pilot, see [`crate::CausticChoice`].
    pub caustic_plan: Option<CausticPlan>,
    /// Russian roulette by throughput, and of shadow rays by contribution; off: for very long paths only.
    pub roulette: bool,
}

impl Techniques {
    /// All techniques, which is the default.
    pub const ALL: Self = Self {
        light_sampling: true,
        mis: true,
        even_samples: true,
        solid_angle: true,
        light_selection: true,
        portals: true,
        resampling: true,
        caustics: true,
        caustic_plan: None,
        roulette: true,
    };
}

impl Default for Techniques {
    fn default() -> Self {
        Self::ALL
    }
}

impl Techniques {
    /// One technique switched off at a time, with its name.
    pub fn ablations() -> [(&'static str, Self); 9] {
        let all = Self::default();
        [
            ("light sampling", Self { light_sampling: false, ..all }),
            ("multiple importance sampling", Self { mis: false, ..all }),
            ("even samples (Owen-Sobol\u{2019})", Self { even_samples: false, ..all }),
            ("lights by solid angle", Self { solid_angle: false, ..all }),
            ("choice of lights by contribution", Self { light_selection: false, ..all }),
            ("portals", Self { portals: false, ..all }),
            ("resampling of lights", Self { resampling: false, ..all }),
            ("light paths", Self { caustics: false, ..all }),
            ("Russian roulette", Self { roulette: false, ..all }),
        ]
    }
}
