//! Upper bound of the radiance of all samples of a scene, where one is known.
//!
//! A check of the whole integrator without cost: in a scene that is lit by its environment only, found by BSDF sampling
//! only, without portals, with surfaces whose sample weights are at most 1, no sample is brighter than the brightest part of the
//! environment. A sample that is indicates a bug, and is counted with its position like one that is not finite.

use crate::core::color::luminance;
use crate::core::environment::Environment;
use crate::core::material::{ColorInput, Fresnel, Material, MaterialId, SMALLEST_ALPHA, ScalarInput};
use crate::core::material_queries::Emission;
use glam::Vec3;

/// Largest channel of any sample, outside of all glass, before roulette of endless paths; `None` if there is no bound.
pub(crate) fn radiance_bound(
    environment: &Environment,
    emission: &[Option<Emission>],
    materials: &[Material],
) -> Option<f32> {
    let brightest = match environment {
        Environment::Black | Environment::Image { .. } => return None,
        Environment::Constant(radiance) => *radiance,
        Environment::Gradient { zenith, horizon, ground } => zenith.max(*horizon).max(*ground),
    };
    let shines = emission.iter().any(Option::is_some);
    let holds = (0..materials.len() as u32).all(|id| returns_at_most_all(materials, id));
    (!shines && holds).then(|| brightest.max_element())
}

/// Whether no sample of the material has a weight above 1 in any channel.
fn returns_at_most_all(materials: &[Material], id: MaterialId) -> bool {
    let at_most_one = |input: &ColorInput| matches!(input, ColorInput::Constant(c) if c.max_element() <= 1.0);
    match &materials[id as usize] {
        Material::Diffuse { albedo: color } | Material::Mirror { reflectance: color } => at_most_one(color),
        Material::Metal { reflectance, compensate: false, .. } => at_most_one(reflectance),
        // A path of one channel has three times its light.
        glass @ (Material::Glass { .. } | Material::RoughGlass { compensate: false, .. }) => !glass.disperses(),
        Material::Emissive { .. } => true,
        Material::Phong { diffuse, specular, .. } => {
            at_most_one(diffuse) && matches!(specular, ScalarInput::Constant(_)) && is_even(diffuse)
        }
        // Parts are sampled by luminance: without colour, each has the weight of the whole.
        Material::Blend { weight, a, b, .. } => {
            let part = |id: MaterialId| returns_at_most_all(materials, id) && is_even_part(materials, id);
            matches!(weight, ScalarInput::Constant(_)) && part(*a) && part(*b)
        }
        // Compensation adds on some paths what others lose.
        _ => false,
    }
}

/// Whether a part of a blend is sampled exactly in proportion to its reflectance.
fn is_even_part(materials: &[Material], id: MaterialId) -> bool {
    match &materials[id as usize] {
        Material::Diffuse { albedo: color } | Material::Mirror { reflectance: color } => is_even(color),
        Material::Metal { alpha, reflectance, fresnel, .. } => {
            let sharp = matches!(alpha, ScalarInput::Constant(alpha) if *alpha < SMALLEST_ALPHA);
            *fresnel == Fresnel::Constant
                && is_even(reflectance)
                && (sharp || matches!(alpha, ScalarInput::Constant(_)))
        }
        Material::Emissive { .. } => false,
        _ => true,
    }
}

/// Whether a colour is grey and constant.
fn is_even(input: &ColorInput) -> bool {
    matches!(input, ColorInput::Constant(c) if (*c - Vec3::splat(luminance(*c))).abs().max_element() <= 1e-6)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::snapshot::Object;
    use crate::prepare::prepared::Prepared;
    use crate::test_scene::prepared;
    use firstlight_kdtree::Shape;

    fn scene(material: Material) -> Prepared {
        let shape = Shape::Sphere { center: Vec3::NEG_Z * 3.0, radius: 1.0 };
        prepared(vec![shape], vec![Object::plain(0)], vec![material], Environment::Constant(Vec3::splat(0.5)))
    }

    #[test]
    fn only_scenes_without_samples_that_outweigh_their_light_have_a_bound() {
        let color = |c| ColorInput::Constant(Vec3::splat(c));
        let metal = |compensate| Material::Metal {
            alpha: ScalarInput::Constant(0.3),
            reflectance: color(1.0),
            fresnel: Fresnel::Schlick,
            compensate,
        };
        let bound = |material| scene(material).tables.radiance_bound;
        assert_eq!(bound(Material::Diffuse { albedo: color(1.0) }), Some(0.5));
        assert_eq!(bound(metal(false)), Some(0.5));
        assert_eq!(bound(metal(true)), None);
        assert_eq!(bound(Material::Diffuse { albedo: color(1.2) }), None);
        assert_eq!(bound(Material::Emissive { radiance: color(0.1) }), None);
    }
}
