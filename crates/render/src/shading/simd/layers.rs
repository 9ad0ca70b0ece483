//! Layered surfaces at sixteen points; see [`crate::shading::principled`].

use crate::prepare::layer_table::{LayerTable, input};
use crate::prepare::material_table::{MAPPED, RICH};
use crate::shading::principled::layers::{BaseInputs, Principled};
use crate::shading::principled::seen::Seen;
use crate::shading::sheen;
use crate::shading::simd::lanes::lanes_of;
use crate::shading::simd::surface::{HitGroup, SurfaceLanes};
use crate::shading::tangent::tangent_axes;
use firstlight_simd::{Bits, Float, Kernel, LANES, Mask, Real, Simd, Vector, select_vector, three};

/// The inputs of each lane.
struct LayerInputs<'a, S: Simd> {
    table: &'a LayerTable,
    /// First place of the row of each lane's material.
    start: Bits<S>,
    /// Lanes with a texture, by input, and its values.
    textured: [Mask; input::N],
    values: [[f32; LANES]; input::N],
}

impl<'a, S: Simd> LayerInputs<'a, S> {
    /// Reads all textures.
    #[inline(always)]
    fn of(at: &HitGroup<'a, S>, place: &SurfaceLanes<S>) -> Self {
        let table = &at.scene.tables.materials.layers;
        let start = Bits::gather(at.materials, at.index) * input::N as u32;
        let mut inputs = Self { table, start, textured: [0; input::N], values: [[0.0; LANES]; input::N] };
        if at.scene.tables.features.textures {
            inputs.look_up(at, [place.uv[0].to_array(), place.uv[1].to_array()]);
        }
        inputs
    }

    #[inline(never)]
    fn look_up(&mut self, at: &HitGroup<S>, uv: [[f32; LANES]; 2]) {
        let textures = &at.scene.shading.textures;
        let material = |lane: usize| at.materials[at.indices[lane] as usize];
        let large = &at.scene.tables.large_textures;
        let mut points = [None; LANES];
        let mut bits = 0;
        for lane in lanes_of(at.mask) {
            if at.scene.tables.textured[material(lane) as usize] {
                let point = at.texture_point(lane, &uv);
                // Waits for memory once, and not again for each texture of each lane.
                for &id in large.of(material(lane)) {
                    bits ^= textures[id as usize].touch(&point);
                }
                points[lane] = Some(point);
            }
        }
        std::hint::black_box(bits);
        for (lane, point) in points.iter().enumerate() {
            let Some(point) = point else { continue };
            let mut texel = glam::Vec4::ONE;
            for one in self.table.textured(material(lane)) {
                let texture = &textures[one.texture as usize];
                if !one.has_texels {
                    texel = texture.texel(point);
                }
                let shown = texture.shown(texel).to_array();
                for (k, shown) in (one.input..).zip(shown).take(one.n) {
                    self.values[k][lane] = shown;
                    self.textured[k] |= 1 << lane;
                }
            }
        }
    }

    #[inline(always)]
    fn scalar(&self, k: usize) -> Float<S> {
        let constant = Float::gather(&self.table.constants, self.start + k as u32);
        if self.textured[k] == 0 {
            return constant;
        }
        let s = constant.s;
        Float { s, v: s.select(self.textured[k], Float::load(s, &self.values[k]).v, constant.v) }
    }

    #[inline(always)]
    fn color(&self, k: usize) -> Vector<S> {
        let [x, y, z] = three!(|i| self.scalar(k + i));
        Vector { x, y, z }
    }

    /// Limited to 0..1.
    #[inline(always)]
    fn share(&self, k: usize) -> Float<S> {
        self.scalar(k).at_least(0.0).at_most(1.0)
    }

    /// Likewise.
    #[inline(always)]
    fn shares(&self, k: usize) -> Vector<S> {
        let [x, y, z] = three!(|i| self.share(k + i));
        Vector { x, y, z }
    }
}

/// Prepares the surfaces, and turns their normals by their maps.
#[inline(always)]
pub(crate) fn layers_of<S: Simd>(s: S, at: &HitGroup<S>, place: &mut SurfaceLanes<S>) -> Seen<Float<S>> {
    let inputs = LayerInputs::of(at, place);
    let flags = Bits::gather(&at.scene.tables.materials.flags, Bits::gather(at.materials, at.index));
    let unmapped = place.unmapped_normal();
    let mut mapped = 0;
    if place.tangent.is_some() {
        let scale = inputs.scalar(input::NORMAL_SCALE);
        mapped = place.turn_normals(at.mask & flags.has(MAPPED), inputs.color(input::NORMAL), scale);
    }
    let specular_color = inputs.color(input::SPECULAR_COLOR);
    let zero = Float::splat(s, 0.0);
    let base = BaseInputs {
        color: inputs.shares(input::COLOR),
        metallic: inputs.share(input::METALLIC),
        roughness: inputs.share(input::ROUGHNESS),
        specular: inputs.share(input::SPECULAR),
        specular_color: specular_color.max(Vector::all(zero)) * inputs.scalar(input::FACING),
    };
    let mut layers = Principled::of_base(&base, place.normal);
    if mapped != 0 {
        layers.true_normal = Some(select_vector(mapped, place.reach_normal, Vector::all(zero)));
    }
    if flags.has(RICH) != 0 {
        layers.sheen = inputs.shares(input::SHEEN_COLOR);
        layers.sheen_alpha = sheen::alpha_of(inputs.share(input::SHEEN_ROUGHNESS));
        layers.coat = inputs.share(input::COAT);
        let roughness = inputs.share(input::COAT_ROUGHNESS);
        layers.coat_alpha = roughness * roughness;
        layers.coat_normal = unmapped;
        let anisotropy = inputs.share(input::ANISOTROPY);
        let elongated = anisotropy.is_positive();
        if let Some(tangent) = &place.tangent
            && elongated != 0
        {
            let map = inputs.shares(input::ANISOTROPY_MAP);
            layers.widen(anisotropy * map.z);
            let (cos, sin) = (inputs.scalar(input::TURN), inputs.scalar(input::TURN + 1));
            let (x, y) = (map.x * 2.0 - 1.0, map.y * 2.0 - 1.0);
            let across = Vector { x: cos * x - sin * y, y: sin * x + cos * y, z: zero };
            let across = across.normalize_or(Vector { x: zero + 1.0, y: zero, z: zero });
            let [along_u, along_v] = tangent_axes(tangent.along_u, tangent.handedness, place.normal);
            let direction = along_u * across.x + along_v * across.y;
            layers.tangent = Some(select_vector(elongated, direction, Vector::all(zero)));
        }
    }
    Seen::new(layers, place.wo, place.normal)
}

/// Arguments of [`Seen::eval`], which has one copy for all of its callers.
pub(crate) struct EvalLayers<'a, S: Simd> {
    pub seen: &'a Seen<Float<S>>,
    pub wi: Vector<S>,
}

impl<S: Simd> Kernel<S> for EvalLayers<'_, S> {
    type Output = (Vector<S>, Float<S>);

    #[inline(always)]
    fn run(self, _: S) -> Self::Output {
        self.seen.eval(self.wi)
    }
}
