//! Data by material, as arrays for SIMD.

use crate::core::material::MaterialKind;
use crate::core::material::{ColorInput, Fresnel, Material, MaterialId, SMALLEST_ALPHA, ScalarInput};
use crate::core::snapshot::Geometry;
use crate::core::texture::Texture;
use crate::prepare::arrays::push;
use crate::prepare::layer_table::{LAYERED_RICHLY, LayerTable};
use firstlight_simd::padded;
use glam::Vec3;

/// Kinds by which hits are sorted: numbers of [`MaterialKind`], [`COATED`], and those of layers. Conductors are metals.
#[derive(Debug, Default)]
pub(crate) struct Kinds {
    /// Kind per material, padded for gather operations.
    pub of_material: Vec<u32>,
    /// One bit per kind that is present.
    pub present: u32,
}

/// Flags of a material in a [`MaterialTable`].
pub(crate) const SCHLICK: u32 = 1;
pub(crate) const COMPENSATE: u32 = 2;
pub(crate) const TEXTURED: u32 = 4;
/// It is layered and has a normal map, or needs tangents for another reason.
pub(crate) const MAPPED: u32 = 8;
pub(crate) const TANGENTS: u32 = 16;
pub(crate) const EMITS: u32 = 32;
/// Its textures need more than the first texture coordinates.
pub(crate) const MORE_THAN_UV: u32 = 64;
/// It has layers above its base.
pub(crate) const RICH: u32 = 128;
pub(crate) const BECKMANN: u32 = 256;
/// The base of a plastic colours light at every bounce.
pub(crate) const NONLINEAR: u32 = 512;
/// The normal map is that of a blend around it: the scalar code turns its normals.
pub(crate) const TURNED: u32 = 1024;
/// Paths end where they hit its back.
pub(crate) const BLACK_BACK: u32 = 2048;

/// The parameters of all materials of one lobe, and of the parts of those of two.
#[derive(Debug, Default)]
pub(crate) struct MaterialTable {
    /// Albedo, reflectance or emitted radiance.
    pub color: [Vec<f32>; 3],
    /// The same with textures.
    pub inputs: Vec<ColorInput>,
    pub alpha: Vec<f32>,
    pub flags: Vec<u32>,
    /// See [`MaterialKind`]; [`COATED`] for materials of two parts.
    pub kinds: Kinds,
    /// Rows of the parts, with their weights; the parts of a classic material have rows after those of all materials.
    pub parts: [Vec<u32>; 2],
    pub weights: [Vec<f32>; 2],
    /// Inputs of layered materials.
    pub layers: LayerTable,
    /// Whether some material is [`TURNED`].
    pub has_turned: bool,
    /// Whether some material has a [`BLACK_BACK`].
    pub has_black_backs: bool,
    /// Whether some emission is textured.
    pub textured_emission: bool,
    /// Whether some surface scatters light through itself, so that light is sampled on both sides.
    pub two_sided: bool,
    /// The material of each object; [`SEVERAL`] if its primitives differ.
    pub of_object: Vec<MaterialId>,
}

pub(crate) const SEVERAL: MaterialId = MaterialId::MAX;

/// Two parts of different kinds, each diffuse, rough metal or mirror.
pub(crate) const COATED: usize = MaterialKind::N;

impl MaterialTable {
    pub fn build(geometry: &Geometry, materials: &[Material], textures: &[Texture]) -> Self {
        let asks_for_more = |id: MaterialId| materials[id as usize].asks_for_more_than_uv(materials, textures);
        let disperses = materials.iter().any(Material::disperses);
        let mut table = Self::default();
        let mut parts_of_classics = Vec::new();
        for (id, material) in (0..).zip(materials.iter().map(|material| material.scattering(materials))) {
            table.add(material, materials);
            if material.normal_map().is_none() && materials[id as usize].normal_map().is_some() {
                *table.flags.last_mut().expect("it has been added") |= TURNED;
                table.has_turned = true;
            }
            if materials[id as usize].has_black_back(materials) {
                *table.flags.last_mut().expect("it has been added") |= BLACK_BACK;
                table.has_black_backs = true;
            }
            let mut parts = [(0, 0.0); 2];
            match material {
                Material::Blend { weight: ScalarInput::Constant(weight), a, b, by_side: false, .. }
                    if material.normal_map().is_none() =>
                {
                    let kinds = [a, b].map(|&id| kind_of_part(&materials[id as usize]));
                    if let [Some(first), Some(second)] = kinds
                        && first != second
                        && 0.0 < *weight
                        && *weight < 1.0
                    {
                        parts = [(*a, 1.0 - weight), (*b, *weight)];
                    }
                }
                Material::Phong { diffuse, specular: ScalarInput::Constant(specular), transparency: 0.0, .. }
                    if 0.0 < *specular && *specular < 1.0 =>
                {
                    let row = (materials.len() + parts_of_classics.len()) as u32;
                    parts_of_classics.push(Material::Diffuse { albedo: *diffuse });
                    parts_of_classics.push(Material::Mirror { reflectance: ColorInput::Constant(Vec3::ONE) });
                    parts = [(row, 1.0 - specular), (row + 1, *specular)];
                }
                _ => {}
            }
            let with_inputs = LayerTable::kind_of(material, textures);
            let kind = match material.kind() {
                // The SIMD code keeps all channels together.
                MaterialKind::Glass if disperses => MaterialKind::Blend as usize,
                // The SIMD code supports one pair of texture coordinates: materials that need more are shaded like
                // blends of many parts.
                kind if kind != MaterialKind::Emissive && asks_for_more(id) => MaterialKind::Blend as usize,
                MaterialKind::Disney if with_inputs.is_none() => MaterialKind::Blend as usize,
                _ if parts[0].1 > 0.0 => COATED,
                kind => kind as usize,
            };
            let kind = with_inputs.unwrap_or(kind);
            if let Some(kind) = with_inputs {
                table.flag_layers(material, kind, asks_for_more(id));
            }
            table.kinds.of_material.push(kind as u32);
            table.kinds.present |= 1 << kind;
            for (k, (row, weight)) in parts.into_iter().enumerate() {
                table.parts[k].push(row);
                table.weights[k].push(weight);
            }
        }
        for part in &parts_of_classics {
            table.add(part, materials);
            table.kinds.of_material.push(part.kind() as u32);
        }
        let of_object = geometry
            .objects
            .iter()
            .map(|object| if let [only] = object.materials[..] { only } else { SEVERAL })
            .collect();
        Self {
            color: table.color.map(padded),
            inputs: table.inputs,
            alpha: padded(table.alpha),
            flags: padded(table.flags),
            kinds: Kinds { of_material: padded(table.kinds.of_material), ..table.kinds },
            parts: table.parts.map(padded),
            weights: table.weights.map(padded),
            layers: LayerTable::build(materials, textures),
            has_turned: table.has_turned,
            has_black_backs: table.has_black_backs,
            textured_emission: materials.iter().any(is_textured_emitter),
            two_sided: materials.iter().any(Material::scatters_through),
            of_object: padded(of_object),
        }
    }

    /// Adds flags of a material of the table of inputs to those of the last row.
    fn flag_layers(&mut self, material: &Material, kind: usize, asks_for_more: bool) {
        let flags = [
            (material.normal_map().is_some(), MAPPED),
            (material.asks_for_tangents(), TANGENTS),
            (asks_for_more, MORE_THAN_UV),
            (kind == LAYERED_RICHLY, RICH),
            (matches!(material, Material::Principled { emission, .. } if *emission != BLACK), EMITS),
        ];
        let last = self.flags.last_mut().expect("it has been added");
        flags.into_iter().filter(|(is_set, _)| *is_set).for_each(|(_, flag)| *last |= flag);
    }

    /// Adds color, alpha and flags.
    fn add(&mut self, material: &Material, materials: &[Material]) {
        let (color, alpha) = match material {
            Material::Diffuse { albedo: color }
            | Material::Mirror { reflectance: color }
            | Material::Emissive { radiance: color } => (*color, 0.0),
            Material::Metal { alpha, reflectance, .. } => {
                (*reflectance, if let ScalarInput::Constant(alpha) = alpha { alpha.clamp(0.0, 1.0) } else { 0.0 })
            }
            _ => (ColorInput::Constant(Vec3::ONE), 0.0),
        };
        let mut flags = if material.is_textured(materials) { TEXTURED } else { 0 };
        let mut set = |flag, is_set: bool| flags |= if is_set { flag } else { 0 };
        match material {
            Material::Metal { fresnel, compensate, .. } => {
                set(SCHLICK, *fresnel == Fresnel::Schlick);
                set(COMPENSATE, *compensate);
            }
            Material::Conductor { beckmann, compensate, .. } => {
                set(BECKMANN, *beckmann);
                set(COMPENSATE, *compensate);
            }
            Material::Plastic { beckmann, nonlinear, .. } => {
                set(BECKMANN, *beckmann);
                set(NONLINEAR, *nonlinear);
            }
            _ => {}
        }
        push(&mut self.color, if let ColorInput::Constant(color) = color { color } else { Vec3::ZERO });
        self.inputs.push(color);
        self.alpha.push(alpha);
        self.flags.push(flags);
    }
}

fn is_textured_emitter(material: &Material) -> bool {
    matches!(material, Material::Emissive { radiance: ColorInput::Texture(_) })
}

const BLACK: ColorInput = ColorInput::Constant(Vec3::ZERO);

/// Returns `None` for a material that cannot be a part of a [`COATED`] one.
fn kind_of_part(material: &Material) -> Option<usize> {
    match material {
        Material::Diffuse { .. } | Material::Mirror { .. } => Some(material.kind() as usize),
        Material::Metal { alpha: ScalarInput::Constant(alpha), .. } => {
            (*alpha >= SMALLEST_ALPHA).then(|| material.kind() as usize)
        }
        _ => None,
    }
}
