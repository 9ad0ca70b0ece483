//! BSDFs of version 0.x that Mitsuba 3 has no more: highlights that are added to a diffuse surface, and coatings.

use crate::mitsuba::bsdf::{Microfacets, within_share};
use crate::mitsuba::converter::{Converter, Surface};
use crate::mitsuba::graph::Node;
use crate::mitsuba::spectrum::Use;
use firstlight_format::error::SceneError;
use firstlight_format::parts::MaterialPart;
use firstlight_format::value::{ColorValue, ScalarValue};
use firstlight_render::Material;
use glam::Vec3;

impl Converter<'_> {
    /// `phong` and `ward`: a diffuse surface, and a highlight that is added to it.
    ///
    /// They become a blend of a diffuse surface and microfacets that reflect everything, each as much brighter as its
    /// share is smaller.
    pub(crate) fn with_highlight(&mut self, node: Node) -> Result<Surface, SceneError> {
        let mut diffuse = self.color(node, "diffuse_reflectance", 0.5, Use::Reflectance)?;
        let mut specular = self.color(node, "specular_reflectance", 0.2, Use::Reflectance)?;
        let (alpha, alpha_v) = if node.plugin() == "phong" {
            // The peak, (n + 2) / 2π, and the width of the highlight are those of these microfacets.
            let exponent = self.constant_scalar(node, "exponent", 30.0)?.max(0.0);
            (((2.0 * exponent + 4.0).sqrt().recip() as f32).into(), 0.0.into())
        } else {
            node.ignore(&["variant"]);
            let Microfacets { u, v, .. } = self.microfacets(node)?;
            (u.clone(), if u == v { 0.0.into() } else { v })
        };
        if let (ColorValue::Rgb(diffuse), ColorValue::Rgb(specular)) = (&mut diffuse, &mut specular) {
            // As Mitsuba does, so that no energy is gained.
            let sum = (*diffuse + *specular).max_element().max(1.0);
            (*diffuse, *specular) = (*diffuse / sum, *specular / sum);
        }
        let most = |color: &ColorValue, of_texture: f32| match color {
            ColorValue::Rgb(rgb) => rgb.max_element(),
            ColorValue::Texture(_) => of_texture,
        };
        let shine = most(&specular, 0.5);
        let share = shine / (shine + most(&diffuse, 1.0 - shine)).max(f32::MIN_POSITIVE);
        if share == 0.0 {
            return Ok(Surface::one_sided(Material::Diffuse { albedo: diffuse }));
        }
        let reflectance = self.times(specular, Vec3::splat(share.recip()));
        // Without a real part everything is reflected at every angle.
        let (eta, k) = (Vec3::ZERO.into(), Vec3::ONE.into());
        let highlight = Material::Conductor { alpha, alpha_v, beckmann: true, eta, k, reflectance, compensate: false };
        if share == 1.0 {
            return Ok(Surface::one_sided(highlight));
        }
        let base = Material::Diffuse { albedo: self.times(diffuse, Vec3::splat((1.0 - share).recip())) };
        let [base, highlight] = [base, highlight].map(|part| self.add_material(node, part));
        Ok(Surface::one_sided(Material::blend(share.into(), base, highlight)))
    }

    /// `coating` and `roughcoating`: a dielectric layer on another surface.
    pub(crate) fn coating(&mut self, node: Node, depth: u32) -> Result<Option<Surface>, SceneError> {
        let ior = self.relative_ior(node, "bk7")?;
        let specular = within_share(self.scalar(node, "specular_reflectance", 1.0)?);
        let absorbed =
            node.float_or("thickness", 1.0)? as f32 * self.constant_color(node, "sigma_a", 0.0, Use::Factor)?;
        // There and back, as at normal incidence.
        let passed = (-2.0 * absorbed).exp();
        let (width, beckmann) = match node.plugin() {
            "coating" => (0.0.into(), false),
            _ => self.isotropic(node)?,
        };
        let Some(surface) = self.only_nested(node, depth)? else { return Ok(None) };
        let part = match surface.part {
            // What the layer reflects back to the base is lost in Mitsuba's coating, and not in `plastic`.
            Material::Diffuse { albedo } => {
                let diffuse = self.times(albedo, passed * (1.0 - reflected_inside(ior)));
                Material::Plastic { diffuse, alpha: width, ior, specular, nonlinear: false, beckmann }
            }
            Material::Conductor { alpha: ScalarValue::Number(alpha), eta, k, reflectance, .. } => {
                let (eta, k) = (Vec3::from(eta), Vec3::from(k));
                let [below, above] = [-1.0, 1.0].map(|sign| (eta + sign) * (eta + sign) + k * k);
                let color = self.times(reflectance, passed * below / above);
                coated_metal(color, alpha * ior, specular, &width)
            }
            Material::Mirror { reflectance } => coated_metal(self.times(reflectance, passed), 0.0, specular, &width),
            part => {
                self.tell(node, "coatings of surfaces other than metals and diffuse ones are not modelled: it is bare");
                part
            }
        };
        Ok(Some(Surface { part, ..surface }))
    }

    /// A colour or texture with a factor.
    fn times(&mut self, color: ColorValue, factor: Vec3) -> ColorValue {
        match color {
            ColorValue::Rgb(rgb) => ColorValue::Rgb((rgb * factor).clamp(Vec3::ZERO, Vec3::ONE)),
            ColorValue::Texture(name) => ColorValue::Texture(self.tinted(&name, factor).unwrap_or(name)),
        }
    }
}

/// - `alpha`: of the metal as it is seen through the coat, which bends light.
fn coated_metal(color: ColorValue, alpha: f32, coat: ScalarValue, coat_alpha: &ScalarValue) -> MaterialPart {
    let mut part = MaterialPart::principled(color);
    if let Material::Principled { metallic, roughness, clearcoat, clearcoat_roughness, .. } = &mut part {
        (*metallic, *roughness, *clearcoat) = (1.0.into(), alpha.min(1.0).sqrt().into(), coat);
        if let ScalarValue::Number(width) = coat_alpha {
            *clearcoat_roughness = width.sqrt().into();
        }
    }
    part
}

/// Share of diffuse light that a smooth dielectric reflects back inside (Egan and Hilgeman 1979).
fn reflected_inside(ior: f32) -> f32 {
    (-1.4399 / (ior * ior) + 0.7099 / ior + 0.6681 + 0.0636 * ior).clamp(0.0, 1.0)
}
