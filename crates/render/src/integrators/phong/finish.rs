//! Materials in the classic model: a diffuse part, highlights, mirrors and panes.

use crate::core::material::{Fresnel, MAX_LOBES, Material, MaterialId, SMALLEST_ALPHA, ScalarInput};
use crate::integrators::phong::lobe::lobe_pdf;
use crate::prepare::prepared::Prepared;
use crate::shading::dielectric::fresnel;
use crate::shading::interface::{Interface, MediumId};
use crate::shading::lights::power_heuristic;
use crate::shading::metal::{Tint, schlick};
use crate::shading::sides::Sides;
use crate::shading::vertex::Vertex;
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;

/// A surface at a point, with all parameters evaluated.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Finish {
    /// Reflected share of the ambient light.
    pub ambient: Vec3,
    /// Diffuse albedo.
    pub diffuse: Vec3,
    shiny: [Shiny; MAX_LOBES],
    n_shiny: usize,
}

/// A part that sends rays.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Shiny {
    /// A mirror that also shows lights.
    Mirror { tint: Vec3 },
    /// Highlights of lights, (n + 1) / 2π · cosⁿ about the mirrored direction, normalised to `tint`; everything else is
    /// mirrored, within the same lobe if `rough`, otherwise perfectly (Whitted 1980). Rough ones find lights by both
    /// techniques.
    Gloss { tint: Vec3, exponent: f32, rough: bool },
    /// A smooth interface.
    Pane { share: f32, interface: Interface },
}

impl Finish {
    /// Creates a black surface.
    pub fn new() -> Self {
        let nothing = Shiny::Mirror { tint: Vec3::ZERO };
        Self { ambient: Vec3::ZERO, diffuse: Vec3::ZERO, shiny: [nothing; MAX_LOBES], n_shiny: 0 }
    }

    /// Evaluates a material at a vertex. The same object is reused for many vertices, because creating one takes longer
    /// than this.
    pub fn look_up(&mut self, scene: &Prepared, id: MaterialId, vertex: &Vertex, mut sides: Option<&mut Sides>) {
        (self.ambient, self.diffuse, self.n_shiny) = (Vec3::ZERO, Vec3::ZERO, 0);
        self.add(scene, id, vertex, &mut sides, &mut 0, 1.0);
    }

    /// - `n_leaves`: number of transparent parts so far, of any weight: counted like in
    ///   [`crate::prepare::bodies::Bodies`].
    fn add(
        &mut self,
        scene: &Prepared,
        id: MaterialId,
        vertex: &Vertex,
        sides: &mut Option<&mut Sides>,
        n_leaves: &mut u32,
        weight: f32,
    ) {
        let uv = vertex.texture_point;
        let material = &scene.shading.materials[id as usize];
        let leaf = *n_leaves;
        *n_leaves += u32::from(material.is_clear());
        let mut pane = |share: f32| {
            let sides = sides.as_mut().expect("a scene with glass has media");
            Shiny::Pane { share, interface: sides.interface(scene, leaf) }
        };
        match material {
            Material::Blend { weight: share, a, b, by_side, .. } => {
                let share = vertex.share_of_second(scene, *share, *by_side);
                self.add(scene, *a, vertex, sides, n_leaves, weight * (1.0 - share));
                self.add(scene, *b, vertex, sides, n_leaves, weight * share);
            }
            _ if weight == 0.0 => {}
            Material::Emissive { .. } => {}
            Material::Mirror { reflectance } => {
                self.push(Shiny::Mirror { tint: weight * reflectance.eval(scene, uv) });
            }
            Material::Metal { alpha, reflectance, fresnel, .. } => {
                let color = reflectance.eval(scene, uv).into();
                let tint = Tint { color, schlick: *fresnel == Fresnel::Schlick, index: None };
                let tint = weight * Vec3::from(tint.at(vertex.normal.dot(vertex.wo)));
                self.push(glossy(tint, alpha.eval(scene, uv).clamp(0.0, 1.0)));
            }
            Material::Conductor { alpha, eta, k, reflectance, .. } => {
                let color = reflectance.eval(scene, uv).into();
                let tint = Tint { color, schlick: false, index: Some([(*eta).into(), (*k).into()]) };
                let tint = weight * Vec3::from(tint.at(vertex.normal.dot(vertex.wo)));
                self.push(glossy(tint, alpha.eval(scene, uv).clamp(0.0, 1.0)));
            }
            // The light between the two sides is left out.
            Material::ThinGlass { .. } => {
                let interface = Interface::thin(sides.as_ref().map_or(MediumId::OUTSIDE, |sides| sides.here));
                self.push(Shiny::Pane { share: weight, interface });
            }
            Material::Glass { .. } | Material::RoughGlass { .. } => {
                self.push(pane(weight));
            }
            Material::Phong { diffuse, ambient, specular, shininess, transparency, .. } => {
                let specular = specular.eval(scene, uv).clamp(0.0, 1.0);
                let opaque = weight * (1.0 - transparency);
                let diffuse = opaque * (1.0 - specular) * diffuse.eval(scene, uv);
                self.diffuse += diffuse;
                self.ambient += *ambient * diffuse;
                if opaque * specular > 0.0 {
                    let tint = Vec3::splat(opaque * specular);
                    self.push(Shiny::Gloss { tint, exponent: *shininess, rough: false });
                }
                if *transparency > 0.0 {
                    self.push(pane(weight * transparency));
                }
            }
            Material::Principled {
                base_color,
                metallic,
                roughness,
                ior,
                specular,
                specular_color,
                transmission,
                thin_walled,
                ..
            } => {
                let share = |input: &ScalarInput| input.eval(scene, uv).clamp(0.0, 1.0);
                let (metallic, transmission) = (share(metallic), share(transmission));
                let (color, alpha) = (base_color.eval(scene, uv), share(roughness).powi(2));
                let at_normal = ((ior - 1.0) / (ior + 1.0)).powi(2);
                let cos = vertex.normal.dot(vertex.wo);
                let facing = at_normal * specular_color.eval(scene, uv) * share(specular);
                let opaque = (1.0 - metallic) * (1.0 - transmission);
                let tint: Vec3 = opaque * Vec3::from(schlick(facing.into(), 1.0, cos))
                    + metallic * Vec3::from(schlick(color.into(), 1.0, cos));
                let tint = weight * tint;
                self.push(glossy(tint, alpha));
                let diffuse = weight * opaque * (Vec3::ONE - facing) * color;
                self.diffuse += diffuse;
                self.ambient += diffuse;
                if transmission > 0.0 && !thin_walled {
                    self.push(pane(weight * (1.0 - metallic) * transmission));
                }
            }
            // Materials without their own look in the classic model are diffuse in their colour.
            other => {
                let albedo = weight * other.color().map_or(Vec3::ONE, |color| color.eval(scene, uv));
                self.diffuse += albedo;
                self.ambient += albedo;
            }
        }
    }

    fn push(&mut self, shiny: Shiny) {
        self.shiny[self.n_shiny] = shiny;
        self.n_shiny += 1;
    }

    pub fn shiny(&self) -> &[Shiny] {
        &self.shiny[..self.n_shiny]
    }

    /// Whether direct light contributes.
    pub fn is_lit(&self) -> bool {
        let matte = self.diffuse != Vec3::ZERO || self.ambient != Vec3::ZERO;
        matte || self.shiny().iter().any(|shiny| matches!(shiny, Shiny::Gloss { .. }))
    }

    /// Returns the radiance towards `wo` for light from `wi` with an irradiance of 1 on a perpendicular surface.
    ///
    /// - `mirrored`: unit, `wo` mirrored at the normal.
    /// - `pdf`: per steradian, of sampling `wi`; `None` for light from a point, which no ray finds. Rough highlights
    ///   contribute only the share that their own rays do not.
    #[inline]
    pub fn reflected(&self, wi: Vec3, normal: Vec3, mirrored: Vec3, pdf: Option<f32>) -> Vec3 {
        let cos = normal.dot(wi);
        if cos <= 0.0 {
            return Vec3::ZERO;
        }
        let mut sum = self.diffuse * (FRAC_1_PI * cos);
        for shiny in self.shiny() {
            if let Shiny::Gloss { tint, exponent, rough } = shiny {
                let lobe = lobe_pdf(*exponent, mirrored.dot(wi));
                let part = pdf.filter(|_| *rough).map_or(1.0, |pdf| power_heuristic(pdf, lobe));
                sum += *tint * (lobe * part);
            }
        }
        sum
    }
}

/// The reflection of GGX microfacets.
fn glossy(tint: Vec3, alpha: f32) -> Shiny {
    if alpha < SMALLEST_ALPHA {
        return Shiny::Mirror { tint };
    }
    // The lobe about the mirrored direction has four times the solid angle of that of the half vector, whose exponent is
    // 2 / α² − 2 (Walter et al. 2007, section 5).
    Shiny::Gloss { tint, exponent: (0.5 / (alpha * alpha) - 0.5).max(0.0), rough: true }
}

/// Returns the share of light that passes straight through a surface, for shadows without refraction, and the interface
/// of its first transparent part; `None` if there is none.
pub(crate) fn straight_through(
    scene: &Prepared,
    id: MaterialId,
    vertex: &Vertex,
    sides: &mut Sides,
) -> Option<(f32, Interface)> {
    let mut passage = Passage { share: 0.0, n_leaves: 0, first: None };
    passage.add(scene, id, vertex, sides, 1.0);
    passage.first.map(|first| (passage.share, first))
}

struct Passage {
    share: f32,
    n_leaves: u32,
    first: Option<Interface>,
}

impl Passage {
    fn add(&mut self, scene: &Prepared, id: MaterialId, vertex: &Vertex, sides: &mut Sides, weight: f32) {
        let material = &scene.shading.materials[id as usize];
        let leaf = self.n_leaves;
        self.n_leaves += u32::from(material.is_clear());
        let share = match material {
            Material::Blend { weight: share, a, b, by_side, .. } => {
                let share = vertex.share_of_second(scene, *share, *by_side);
                self.add(scene, *a, vertex, sides, weight * (1.0 - share));
                self.add(scene, *b, vertex, sides, weight * share);
                return;
            }
            _ if weight == 0.0 => return,
            Material::Glass { .. } | Material::RoughGlass { .. } => weight,
            Material::Phong { transparency, .. } if *transparency > 0.0 => weight * transparency,
            Material::Principled { metallic, transmission, thin_walled: false, .. } => {
                let share = |input: &ScalarInput| input.eval(scene, vertex.texture_point).clamp(0.0, 1.0);
                match (1.0 - share(metallic)) * share(transmission) {
                    0.0 => return,
                    clear => weight * clear,
                }
            }
            _ => return,
        };
        let interface = sides.interface(scene, leaf);
        // Straight light has the same angle on both sides: that of entering is used.
        let eta = if vertex.front { interface.eta } else { 1.0 / interface.eta };
        self.share += share * (1.0 - fresnel(vertex.wo.dot(vertex.normal).clamp(0.0, 1.0), eta).0);
        self.first.get_or_insert(interface);
    }
}
