//! Switches for the techniques that make the picture better sooner, so that a report can tell what each is worth.

use crate::core::caustic_plan::CausticPlan;

/// Which techniques are used. Each leaves the mean of the picture as it is: without it there is more noise, or the
/// same noise takes longer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Techniques {
    /// Each diffuse or rough vertex asks a light for its share; off: paths run into lights by themselves or not at all.
    pub light_sampling: bool,
    /// Light that both light sampling and bounces find is weighted between them; off: light sampling takes all of it.
    pub mis: bool,
    /// A pixel's samples are Owen-scrambled nets; off: they are independent.
    pub even_samples: bool,
    /// Points on lights are spread evenly over the angle under which they are seen; off: over their area.
    pub solid_angle: bool,
    /// Lights are asked by what they could send or by their power; off: all alike.
    pub light_selection: bool,
    /// Where specular surfaces gather light, paths are traced from the lights as well; off: from the camera alone.
    pub caustics: bool,
    /// How, where [`Self::caustics`] are; `None`: as a pilot finds best for the picture, see [`crate::caustic_plan`].
    pub caustic_plan: Option<CausticPlan>,
    /// Dim paths are ended early; off: only very long ones.
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
    /// Each switched off alone, with the name of what is missing.
    pub fn ablations() -> [(&'static str, Self); 7] {
        let all = Self::default();
        [
            ("light sampling", Self { light_sampling: false, ..all }),
            ("multiple importance sampling", Self { mis: false, ..all }),
            ("even samples (Owen-Sobol\u{2019})", Self { even_samples: false, ..all }),
            ("lights by solid angle", Self { solid_angle: false, ..all }),
            ("choice of lights by contribution", Self { light_selection: false, ..all }),
            ("light paths", Self { caustics: false, ..all }),
            ("Russian roulette", Self { roulette: false, ..all }),
        ]
    }
}
