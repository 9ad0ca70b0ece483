//! Materials of pbrt, version 3, which version 4 has no more or calls otherwise.
//!
//! | pbrt 3 | ours |
//! |---|---|
//! | `matte` | `diffuse` |
//! | `plastic`, `uber`, `substrate` | `principled`: a diffuse base under a reflection |
//! | `metal`, `shinymetal` | `conductor`, `metal` |
//! | `mirror` | `mirror` |
//! | `glass` | `glass`, `rough_glass` |
//! | `translucent` | `translucent` |
//! | `disney` | `disney` |
//! | `kdsubsurface` | `diffuse`, told |
//!
//! Source: "pbrt-v3 Input File Format", and Pharr, Jakob and Humphreys 2016, "Physically Based Rendering", third edition.

use crate::model::foreign::tinted_glass;
use crate::pbrt::material_inputs::{
    Conductor, MaterialScope, Widths, alpha, color, conductor, dielectric, of_conductor, principled, roughness,
};
use crate::pbrt::params::Params;
use crate::pbrt::textures::{Texture, product};
use firstlight_format::parts::MaterialPart;
use firstlight_format::value::{ColorValue, ScalarValue};
use glam::Vec3;

/// The width α of GGX for a roughness: a fit that version 4 has no more.
fn width(roughness: f32) -> f32 {
    let x = roughness.max(1e-3).ln();
    1.62142 + x * (0.819955 + x * (0.1734 + x * (0.0171201 + x * 0.000640711)))
}

/// Widths where a roughness that is not given is `default`.
const fn widths(default: f32) -> Widths {
    Widths { default, of_roughness: width }
}

/// A material of one of these kinds; `None` for other kinds.
///
/// - `absorption`: of the medium inside, per metre.
pub(super) fn material(
    scope: &mut impl MaterialScope,
    kind: &str,
    params: &Params,
    absorption: Vec3,
) -> Option<MaterialPart> {
    Some(match kind {
        "matte" => {
            if params.has("sigma") && !is_black(scope, params, "sigma") {
                scope.tell("its `sigma` is not modelled: the surface is Lambertian");
            }
            MaterialPart::Diffuse { albedo: color(scope, params, "Kd", 0.5) }
        }
        "plastic" => layered(scope, params, 0.25, 1.5),
        // Nothing but smooth reflection and transmission.
        "uber" if params.has("Kd") && is_black(scope, params, "Kd") && !is_black(scope, params, "Kt") => {
            let clear = dielectric(scope, params, index_name(params), absorption, &SMOOTH);
            let transmittance = color(scope, params, "Kt", 1.0);
            tinted_glass(clear, transmittance, ColorValue::grey(1.0), |why| scope.tell(why))
        }
        "uber" => uber(scope, params),
        "substrate" => substrate(scope, params),
        "metal" => {
            let conductor = conductor(scope, params, "");
            of_conductor(scope, params, conductor, &widths(0.01))
        }
        "shinymetal" => {
            let conductor = Conductor::Reflectance(color(scope, params, "Ks", 1.0));
            of_conductor(scope, params, conductor, &widths(0.1))
        }
        "mirror" => MaterialPart::Mirror { reflectance: color(scope, params, "Kr", 0.9) },
        "glass" => {
            let [reflectance, transmittance] = ["Kr", "Kt"].map(|name| color(scope, params, name, 1.0));
            // Without any roughness the surface is smooth, which the fit is not.
            let is_smooth = ["roughness", "uroughness", "vroughness"].iter().all(|name| is_black(scope, params, name));
            let widths = if is_smooth { &SMOOTH } else { &widths(0.0) };
            let clear = dielectric(scope, params, index_name(params), absorption, widths);
            tinted_glass(clear, transmittance, reflectance, |why| scope.tell(why))
        }
        "translucent" => {
            let base = scope.color(params, "Kd").unwrap_or(Texture::Constant(Vec3::splat(0.25)));
            let mut part = |name: &str| {
                let share = scope.color(params, name).unwrap_or(Texture::Constant(Vec3::splat(0.5)));
                let color = product(&base, &share).unwrap_or(base.clone());
                scope.color_value(color)
            };
            let (reflectance, transmittance) = (part("reflect"), part("transmit"));
            if !is_black(scope, params, "Ks") {
                scope.tell("its highlights are not modelled");
            }
            MaterialPart::Translucent { reflectance, transmittance }
        }
        "disney" => disney(scope, params),
        "kdsubsurface" => {
            scope.tell("subsurface scattering is not modelled: a diffuse surface is shown");
            MaterialPart::Diffuse { albedo: color(scope, params, "Kd", 0.5) }
        }
        _ => return None,
    })
}

/// Whatever the roughness is.
const SMOOTH: Widths = Widths { default: 0.0, of_roughness: |_| 0.0 };

/// The parameter with the index of refraction.
fn index_name(params: &Params) -> &'static str {
    if params.has("eta") { "eta" } else { "index" }
}

/// Whether a parameter is missing or black.
fn is_black(scope: &mut impl MaterialScope, params: &Params, name: &str) -> bool {
    params.find(name).is_none_or(|param| param.kind != "texture") && {
        let number = params.find(name).filter(|param| param.kind == "float").and_then(|_| params.number(name));
        match number {
            Some(number) => number == 0.0,
            None => !params.has(name) || color(scope, params, name, 0.0) == ColorValue::Rgb(Vec3::ZERO),
        }
    }
}

/// A Lambertian base under a reflection of the strength `Ks`, whose sum version 3 takes.
///
/// - `ior`: of the reflection.
fn layered(scope: &mut impl MaterialScope, params: &Params, default: f32, index: f32) -> MaterialPart {
    let mut part = principled(color(scope, params, "Kd", default));
    let width = alpha(scope, params, "", &widths(0.1));
    let strength = color(scope, params, "Ks", default);
    if let MaterialPart::Principled { roughness: r, ior, specular, specular_color, .. } = &mut part {
        (*r, *ior) = (roughness(scope, width), index);
        match strength {
            ColorValue::Rgb(rgb) if rgb == Vec3::ZERO => *specular = 0.0.into(),
            ColorValue::Rgb(rgb) => {
                *specular = rgb.max_element().into();
                *specular_color = ColorValue::Rgb(rgb / rgb.max_element());
            }
            texture => *specular_color = texture,
        }
    }
    part
}

fn uber(scope: &mut impl MaterialScope, params: &Params) -> MaterialPart {
    let index = params.number(index_name(params)).unwrap_or(1.5) as f32;
    let mut part = layered(scope, params, 0.25, if index > 1.0 { index } else { 1.5 });
    let opacity_of = match scope.color(params, "opacity") {
        Some(Texture::Constant(opacity)) => Some(ScalarValue::Number(opacity.element_sum() / 3.0)),
        Some(texture) => Some(scope.scalar_value(texture)),
        None => None,
    };
    // A smooth reflection of the same index is a coat.
    let coat = match color(scope, params, "Kr", 0.0) {
        ColorValue::Rgb(rgb) => rgb.max_element(),
        ColorValue::Texture(_) => 1.0,
    };
    if !is_black(scope, params, "Kt") {
        scope.tell("its transmission `Kt` is not modelled beside its other parts: it is left out");
    }
    if let MaterialPart::Principled { opacity, clearcoat, .. } = &mut part {
        *opacity = opacity_of.unwrap_or(1.0.into());
        *clearcoat = coat.into();
    }
    part
}

/// Its `Ks` is the reflectance at normal incidence, of which an index follows.
fn substrate(scope: &mut impl MaterialScope, params: &Params) -> MaterialPart {
    let mut part = layered(scope, params, 0.5, 1.5);
    if let MaterialPart::Principled { ior, specular: ScalarValue::Number(specular), .. } = &mut part
        && *specular > 0.0
    {
        // An index of 39 reflects 90 %.
        let amplitude = specular.min(0.9).sqrt();
        (*ior, *specular) = ((1.0 + amplitude) / (1.0 - amplitude), 1.0);
    }
    part
}

fn disney(scope: &mut impl MaterialScope, params: &Params) -> MaterialPart {
    let base_color = color(scope, params, "color", 0.5);
    let mut share = |name: &str, default: f32| {
        let value = scope.number(params, name).unwrap_or(Texture::Constant(Vec3::splat(default)));
        scope.scalar_value(value)
    };
    let thin_walled = params.flag("thin").unwrap_or(false);
    // Twice the share that passes a sheet, as ours is.
    let passes = if thin_walled { params.number("difftrans").unwrap_or(1.0) as f32 } else { 0.0 };
    MaterialPart::Disney {
        base_color,
        metallic: share("metallic", 0.0),
        roughness: share("roughness", 0.5),
        anisotropic: share("anisotropic", 0.0),
        ior: params.number("eta").map_or(1.5, |ior| (ior as f32).clamp(1.0, 1e3)),
        specular_tint: share("speculartint", 0.0),
        transmission: share("spectrans", 0.0),
        thin_walled,
        diffuse_transmission: ScalarValue::Number(passes.clamp(0.0, 2.0)),
        flatness: share("flatness", 0.0),
        sheen: share("sheen", 0.0),
        sheen_tint: share("sheentint", 0.5),
        clearcoat: share("clearcoat", 0.0),
        clearcoat_gloss: share("clearcoatgloss", 1.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pbrt::spectrum::peak_luminance;
    use crate::pbrt::tests::{SQUARE, part, read_text, told};
    use firstlight_format::parts::LightPart;
    use firstlight_format::sources::{EnvironmentLayout, EnvironmentSource};
    use firstlight_format::value::Rgb;
    use firstlight_render::PixelFilter;
    use glam::{DMat3, DVec3};

    /// The first object of a scene of version 3, which has this before it.
    fn surface(before: &str) -> (MaterialPart, Vec<String>) {
        let scene = read_text(&format!("WorldBegin\n{before}\n{SQUARE}WorldEnd\n"));
        (part(&scene).clone(), told(&scene))
    }

    fn shown(before: &str) -> MaterialPart {
        let (part, told) = surface(before);
        assert!(told.is_empty(), "{before}: {told:#?}");
        part
    }

    #[test]
    fn camera_film_and_the_end_of_the_world_are_those_of_version_3() {
        let before = "LookAt 0 0 -5 0 0 0 0 1 0\nFilm \"image\" \"float scale\" [2]\nRenderer \"sampler\"\n\
            Camera \"perspective\" \"float halffov\" [20] \"float shutterclose\" [0.1]\n\
            SurfaceIntegrator \"path\" \"integer maxdepth\" [9]\n";
        let scene = read_text(&format!("{before}WorldBegin\n{SQUARE}WorldEnd\nCamera of another frame"));
        assert_eq!(told(&scene), Vec::<String>::new());
        let (film, file) = (&scene.file.film, &scene.file);
        assert_eq!((film.width, film.height, film.filter), (1280, 720, PixelFilter::Box));
        assert_eq!((file.display.exposure_stops, file.max_depth), (1.0, Some(10)), "no shutter");
        assert!((file.camera.vfov - 40.0).abs() < 1e-12);
        let filtered =
            read_text(&format!("Film \"image\"\nPixelFilter \"mitchell\" \"float xwidth\" [2]\nWorldBegin\n{SQUARE}"));
        assert_eq!((filtered.file.film.filter, told(&filtered)), (PixelFilter::Mitchell, Vec::new()));
    }

    #[test]
    fn each_material_has_one_of_ours() {
        let grey = |value: f32| ColorValue::grey(value);
        let MaterialPart::Diffuse { albedo } = shown("Material \"matte\" \"color Kd\" [0.2 0.2 0.2]") else { panic!() };
        assert_eq!(albedo, grey(0.2));
        let plastic = shown("Material \"plastic\" \"rgb Kd\" [0.4 0.4 0.4] \"rgb Ks\" [0.1 0.1 0.1]");
        let MaterialPart::Principled { base_color, specular, roughness, ior, .. } = plastic else { panic!() };
        assert_eq!((base_color, specular, ior), (grey(0.4), 0.1.into(), 1.5));
        // The fit at 0.1 and 0.01, by hand.
        let ScalarValue::Number(roughness) = roughness else { panic!() };
        assert!((roughness * roughness - 0.4618).abs() < 1e-3 && (width(0.01) - 0.1389).abs() < 1e-3, "{roughness}");
        let substrate = shown("Material \"substrate\" \"rgb Ks\" [0.04 0.04 0.04]");
        let MaterialPart::Principled { ior, specular, .. } = substrate else { panic!() };
        assert!((ior - 1.5).abs() < 1e-6 && specular == 1.0.into(), "4 % at normal incidence: {ior}");
        let uber = shown("Material \"uber\" \"color opacity\" [0.3 0.3 0.3] \"color Kr\" [0.5 0.5 0.5]");
        let MaterialPart::Principled { opacity: ScalarValue::Number(opacity), clearcoat, .. } = uber else { panic!() };
        assert!((opacity - 0.3).abs() < 1e-6 && clearcoat == 0.5.into());
        assert!(matches!(shown("Material \"glass\" \"float index\" [1.33]"), MaterialPart::Glass { ior: 1.33, .. }));
        let pane = "Material \"uber\" \"color Kd\" [0 0 0] \"color Kt\" [1 1 1]";
        assert!(matches!(shown(pane), MaterialPart::Glass { ior: 1.5, .. }));
        let green = shown("Material \"glass\" \"color Kt\" [0.2 0.8 0.3] \"color Kr\" [0 0 0]");
        let MaterialPart::Principled { base_color, specular, .. } = green else { panic!("{green:?}") };
        assert_eq!((base_color, specular), (ColorValue::Rgb(Vec3::new(0.2, 0.8, 0.3)), 0.0.into()));
        let frosted = shown("Material \"glass\" \"float uroughness\" [0.1] \"float vroughness\" [0.1]");
        let MaterialPart::RoughGlass { alpha: ScalarValue::Number(alpha), ior, .. } = frosted else { panic!() };
        assert!((alpha - 0.4618).abs() < 1e-3 && ior == 1.5);
        let MaterialPart::Mirror { reflectance } = shown("Material \"mirror\"") else { panic!() };
        assert_eq!(reflectance, grey(0.9));
        let gold = "Material \"metal\" \"spectrum eta\" \"spds/Au.eta.spd\" \"spectrum k\" \"spds/Au.k.spd\"";
        let MaterialPart::Conductor { eta: Rgb(eta), k: Rgb(k), .. } = shown(gold) else { panic!() };
        assert!(eta.x < eta.z && k.x > k.z, "gold: {eta} {k}");
        let MaterialPart::Translucent { reflectance, transmittance } =
            shown("Material \"translucent\" \"color Kd\" [0.4 0.4 0.4] \"color transmit\" [1 1 1]")
        else {
            panic!()
        };
        assert_eq!((reflectance, transmittance), (grey(0.2), grey(0.4)));
        let disney = shown("Material \"disney\" \"color color\" [0.5 0.4 0.3] \"float metallic\" [0.7]");
        assert!(matches!(disney, MaterialPart::Disney { metallic: ScalarValue::Number(0.7), thin_walled: false, .. }));
        let thin = shown("Material \"disney\" \"bool thin\" \"true\"");
        assert!(matches!(thin, MaterialPart::Disney { diffuse_transmission: ScalarValue::Number(1.0), .. }));
        assert!(surface("Material \"matte\" \"float sigma\" [20]").1[0].contains("Lambertian"));
        assert!(surface("Material \"kdsubsurface\"").1[0].contains("subsurface"));
    }

    #[test]
    fn the_amount_of_a_mixture_is_that_of_its_first_part() {
        let scene = read_text(&format!(
            "WorldBegin\nMakeNamedMaterial \"a\" \"string type\" \"matte\" \"color Kd\" [1 0 0]\n\
             MakeNamedMaterial \"b\" \"string type\" \"matte\" \"color Kd\" [0 1 0]\n\
             Material \"mix\" \"string namedmaterial1\" \"a\" \"string namedmaterial2\" \"b\" \
             \"color amount\" [0.2 0.2 0.2]\n{SQUARE}WorldEnd"
        ));
        let MaterialPart::Blend { weight, a, b, .. } = part(&scene) else { panic!() };
        let color = |name: &str| match scene.file.materials.get(name).unwrap() {
            MaterialPart::Diffuse { albedo: ColorValue::Rgb(color) } => *color,
            other => panic!("{other:?}"),
        };
        // The weight is that of the second.
        assert_eq!((weight, color(a), color(b)), (&0.2.into(), Vec3::Y, Vec3::X));
    }

    #[test]
    fn textures_are_products_of_two_of_a_kind_and_may_be_linear() {
        let textured = |scale: &str| {
            format!(
                "Texture \"i\" \"color\" \"imagemap\" \"string filename\" \"n.png\" \"bool gamma\" \"false\"\n\
                 Texture \"t\" \"color\" \"scale\" {scale}\nMaterial \"matte\" \"texture Kd\" \"t\""
            )
        };
        for scale in
            ["\"texture tex1\" \"i\" \"color tex2\" [0.5 0.25 1]", "\"color tex1\" [0.5 0.25 1] \"texture tex2\" \"i\""]
        {
            let scene = read_text(&format!("WorldBegin\n{}\n{SQUARE}WorldEnd", textured(scale)));
            assert_eq!(told(&scene), Vec::<String>::new());
            let source = scene.file.textures.0.values().next().unwrap();
            let firstlight_format::sources::TextureSource::Image { tint, encoding, .. } = source else { panic!() };
            assert_eq!((tint.0, *encoding), (Vec3::new(0.5, 0.25, 1.0), firstlight_render::Encoding::Linear));
        }
    }

    #[test]
    fn lights_have_factors_of_colour_and_images_by_longitude_and_latitude() {
        let scene = read_text(&format!(
            "LookAt 1 2 3 0 0 0 0 0 1\nWorldBegin\nAttributeBegin\nRotate 30 0 1 0\n\
             LightSource \"infinite\" \"string mapname\" \"n.png\" \"color scale\" [2 4 6] \"color L\" [0.5 0.5 0.5]\n\
             LightSource \"point\" \"point from\" [1 0 0] \"color scale\" [3 2 1]\n\
             LightSource \"point\" \"point from\" [0 1 0]\nLightSource \"point\" \"point from\" [0 0 1]\n\
             AttributeEnd\nAreaLightSource \"area\" \"color L\" [1 1 1] \"color scale\" [1 2 3]\n{SQUARE}WorldEnd"
        ));
        assert_eq!(told(&scene), Vec::<String>::new());
        let environment = &scene.file.environment;
        let EnvironmentSource::Image { scale, layout, axes: Some(rows), .. } = environment else {
            panic!("{environment:?}")
        };
        assert_eq!((scale.0, *layout), (Vec3::new(1.0, 2.0, 3.0), EnvironmentLayout::Equirectangular));
        let image_from_world = DMat3::from_cols_array_2d(rows).transpose();
        let places = scene.file.lights.iter().map(|light| match light {
            LightPart::Point { position, intensity, .. } => (image_from_world * *position, intensity.0),
            other => panic!("{other:?}"),
        });
        let places: Vec<_> = places.collect();
        assert_eq!(places[0].1, Vec3::new(3.0, 2.0, 1.0));
        // Its columns 0 and a quarter of the width, and its top row: ours has −Z in the middle.
        for ((place, _), expected) in places.iter().zip([DVec3::Z, DVec3::NEG_X, DVec3::Y]) {
            assert!(place.abs_diff_eq(expected, 1e-12), "{place} instead of {expected}");
        }
        let emitted = scene.file.materials.0.values().find_map(|part| match part {
            MaterialPart::Emissive { radiance: ColorValue::Rgb(rgb) } => Some(*rgb),
            MaterialPart::Principled { emission: ColorValue::Rgb(rgb), .. } => Some(*rgb),
            _ => None,
        });
        // Half of the surface reflects, and the other half emits twice as much.
        assert_eq!(emitted.map(|rgb| rgb / rgb.x), Some(Vec3::new(1.0, 2.0, 3.0)));
    }

    #[test]
    fn a_black_body_has_a_peak_of_its_factor() {
        // The peak of 5000 K is green, that of 2700 K far in the infrared.
        assert!((0.95..1.0).contains(&peak_luminance(5000.0)) && (0.1..0.3).contains(&peak_luminance(2700.0)));
        let light = |value: &str| {
            let scene = read_text(&format!("WorldBegin\nLightSource \"point\" \"blackbody I\" {value}\n{SQUARE}"));
            let LightPart::Point { intensity, .. } = scene.file.lights[0].clone() else { panic!() };
            intensity.0.dot(Vec3::new(0.2126, 0.7152, 0.0722))
        };
        assert!((light("[2700 10]") / (10.0 * peak_luminance(2700.0) as f32) - 1.0).abs() < 1e-3);
        assert!((light("[2700]") - 1.0).abs() < 1e-3, "version 4");
    }
}
