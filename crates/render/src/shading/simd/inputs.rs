//! Inputs of materials at sixteen points: constants, and textures lane by lane.

use crate::prepare::layer_table::{LayerTable, input};
use crate::shading::simd::lanes::lanes_of;
use crate::shading::simd::surface::{HitGroup, SurfaceLanes};
use firstlight_simd::{Bits, Float, LANES, Mask, Real, Simd, Vector, three};

/// The inputs of the material of each lane.
pub(crate) struct InputLanes<'a, S: Simd> {
    table: &'a LayerTable,
    /// First place of the row of each lane's material.
    start: Bits<S>,
    /// Lanes with a texture, by input, and its values.
    textured: [Mask; input::N],
    values: [[f32; LANES]; input::N],
}

impl<'a, S: Simd> InputLanes<'a, S> {
    /// Reads all textures.
    #[inline(always)]
    pub fn of(at: &HitGroup<'a, S>, place: &SurfaceLanes<S>) -> Self {
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
    pub fn scalar(&self, k: usize) -> Float<S> {
        let constant = Float::gather(&self.table.constants, self.start + k as u32);
        if self.textured[k] == 0 {
            return constant;
        }
        let s = constant.s;
        Float { s, v: s.select(self.textured[k], Float::load(s, &self.values[k]).v, constant.v) }
    }

    #[inline(always)]
    pub fn color(&self, k: usize) -> Vector<S> {
        let [x, y, z] = three!(|i| self.scalar(k + i));
        Vector { x, y, z }
    }

    /// Limited to 0..1.
    #[inline(always)]
    pub fn share(&self, k: usize) -> Float<S> {
        self.scalar(k).at_least(0.0).at_most(1.0)
    }

    /// Likewise.
    #[inline(always)]
    pub fn shares(&self, k: usize) -> Vector<S> {
        let [x, y, z] = three!(|i| self.share(k + i));
        Vector { x, y, z }
    }
}
