//! Materials in the classic model, as arrays for SIMD; see `phong/finish.rs`.

use crate::core::material::{ColorInput, Fresnel, Material, MaterialId, SMALLEST_ALPHA, ScalarInput};
use crate::prepare::arrays::push;
use crate::prepare::material_table::Kinds;
use firstlight_simd::padded;
use glam::Vec3;

/// Materials for the scalar code: emitters, transparent ones, those with several parts that send rays, or with textured
/// scalars.
pub(crate) const ONE_BY_ONE: u32 = 0;
/// Diffuse only.
pub(crate) const MATTE: u32 = 1;
/// Optionally diffuse, plus highlights and a sharp mirror,
pub(crate) const GLOSS: u32 = 2;
/// plus rough highlights,
pub(crate) const ROUGH: u32 = 3;
/// or plus a mirror that shows lights as well.
pub(crate) const PLAIN_MIRROR: u32 = 4;

/// One row per material.
#[derive(Debug, Default)]
pub(crate) struct ClassicTable {
    pub kinds: Kinds,
    pub matte: Inputs,
    /// Reflected share of the ambient light, relative to the diffuse part.
    pub ambient: Vec<f32>,
    pub shiny: Inputs,
    /// Exponent of the highlights.
    pub exponent: Vec<f32>,
    /// See [`crate::prepare::material_table::SCHLICK`].
    pub flags: Vec<u32>,
}

/// A colour and its weight.
#[derive(Debug, Default)]
pub(crate) struct Inputs {
    pub color: [Vec<f32>; 3],
    /// The same with textures.
    pub inputs: Vec<ColorInput>,
    /// Whether a colour is textured.
    pub textured: Vec<u32>,
    pub weight: Vec<f32>,
}

impl Inputs {
    fn push(&mut self, color: ColorInput, weight: f32) {
        let constant = if let ColorInput::Constant(color) = color { color } else { Vec3::ZERO };
        push(&mut self.color, constant);
        self.inputs.push(color);
        self.textured.push(u32::from(matches!(color, ColorInput::Texture(_))));
        self.weight.push(weight);
    }

    fn padded(self) -> Self {
        let Self { color, inputs, textured, weight } = self;
        Self { color: color.map(padded), inputs, textured: padded(textured), weight: padded(weight) }
    }
}

/// A material in parts.
#[derive(Default)]
struct ClassicRow {
    /// Albedo, weight and share of ambient light.
    matte: Option<(ColorInput, f32, f32)>,
    shiny: Option<ShinyRow>,
}

struct ShinyRow {
    kind: u32,
    tint: ColorInput,
    weight: f32,
    exponent: f32,
    fresnel: Fresnel,
}

impl ClassicTable {
    pub fn build(materials: &[Material]) -> Self {
        let mut table = Self::default();
        for id in 0..materials.len() as u32 {
            let mut row = ClassicRow::default();
            let known = row.add(materials, id, 1.0).is_some();
            let kind = match (&row.shiny, known) {
                (_, false) => ONE_BY_ONE,
                (None, true) => MATTE,
                (Some(shiny), true) => shiny.kind,
            };
            table.kinds.of_material.push(kind);
            table.kinds.present |= 1 << kind;
            let black = ColorInput::Constant(Vec3::ZERO);
            let (albedo, weight, ambient) = row.matte.unwrap_or((black, 0.0, 0.0));
            table.matte.push(albedo, weight);
            table.ambient.push(ambient);
            let nothing = ShinyRow { kind, tint: black, weight: 0.0, exponent: 0.0, fresnel: Fresnel::Constant };
            let shiny = row.shiny.unwrap_or(nothing);
            table.shiny.push(shiny.tint, shiny.weight);
            table.exponent.push(shiny.exponent);
            table.flags.push(if shiny.fresnel == Fresnel::Schlick {
                crate::prepare::material_table::SCHLICK
            } else {
                0
            });
        }
        let Self { kinds, matte, ambient, shiny, exponent, flags } = table;
        Self {
            kinds: Kinds { of_material: padded(kinds.of_material), ..kinds },
            matte: matte.padded(),
            ambient: padded(ambient),
            shiny: shiny.padded(),
            exponent: padded(exponent),
            flags: padded(flags),
        }
    }
}

impl ClassicRow {
    /// Adds a part; `None` if there is no space for it, or it is not supported.
    fn add(&mut self, materials: &[Material], id: MaterialId, weight: f32) -> Option<()> {
        match &materials[id as usize] {
            _ if weight == 0.0 => Some(()),
            Material::Diffuse { albedo } => self.set_matte(*albedo, weight, 1.0),
            Material::Mirror { reflectance } => self.set_shiny(ShinyRow {
                kind: PLAIN_MIRROR,
                tint: *reflectance,
                weight,
                exponent: 0.0,
                fresnel: Fresnel::Constant,
            }),
            Material::Metal { alpha: ScalarInput::Constant(alpha), reflectance, fresnel, .. } => {
                let alpha = alpha.clamp(0.0, 1.0);
                let rough = alpha >= SMALLEST_ALPHA;
                self.set_shiny(ShinyRow {
                    kind: if rough { ROUGH } else { PLAIN_MIRROR },
                    tint: *reflectance,
                    weight,
                    exponent: if rough { (0.5 / (alpha * alpha) - 0.5).max(0.0) } else { 0.0 },
                    fresnel: *fresnel,
                })
            }
            Material::Phong {
                diffuse,
                ambient,
                specular: ScalarInput::Constant(specular),
                shininess,
                transparency: 0.0,
                ..
            } => {
                let specular = specular.clamp(0.0, 1.0);
                self.set_matte(*diffuse, weight * (1.0 - specular), *ambient)?;
                if weight * specular > 0.0 {
                    self.set_shiny(ShinyRow {
                        kind: GLOSS,
                        tint: ColorInput::Constant(Vec3::ONE),
                        weight: weight * specular,
                        exponent: *shininess,
                        fresnel: Fresnel::Constant,
                    })?;
                }
                Some(())
            }
            blend @ Material::Blend { weight: ScalarInput::Constant(share), a, b, by_side: false, .. }
                if blend.normal_map().is_none() =>
            {
                let share = share.clamp(0.0, 1.0);
                self.add(materials, *a, weight * (1.0 - share))?;
                self.add(materials, *b, weight * share)
            }
            _ => None,
        }
    }

    fn set_matte(&mut self, albedo: ColorInput, weight: f32, ambient: f32) -> Option<()> {
        self.matte.replace((albedo, weight, ambient)).is_none().then_some(())
    }

    fn set_shiny(&mut self, shiny: ShinyRow) -> Option<()> {
        self.shiny.replace(shiny).is_none().then_some(())
    }
}
