//! One light, and what it sends from a point.

use crate::core::color::luminance;
use crate::core::delta_light::DeltaLight;
use crate::core::material::{ColorInput, Emission};
use crate::core::techniques::Techniques;
use crate::core::texture::Texture;
use crate::prepare::light::delta::{DeltaSample, DeltaSource, SHARPNESS};
use crate::prepare::light::shape::{LightPoint, LightShape, sphere_uv};
use glam::{Mat3, Vec2, Vec3};

/// One emitter: a sphere, a quad, a triangle, or a light without size.
#[derive(Clone, Debug)]
pub(crate) struct Light {
    pub shape: LightShape,
    pub emission: Emission,
    /// Mean over the surface, luminance.
    pub mean_radiance: f32,
    /// Has no size, or stands for a light without one, see [`crate::core::snapshot::Object::is_point_light`].
    pub is_point: bool,
    /// See [`crate::core::snapshot::Object::turned`].
    pub turned: Option<Mat3>,
    /// Surface coordinates at the vertices of a triangle of a mesh, where its emission is textured.
    pub corner_uvs: Option<[Vec2; 3]>,
}

/// A point on a light as seen from a shading point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightSample {
    /// Where a shadow ray ends: on the light, lifted off its front by the bound of its own error.
    pub target: Vec3,
    /// Unit, towards the light.
    pub wi: Vec3,
    /// Per steradian at the shading point, the choice of the light included.
    pub pdf: f32,
    /// W·m⁻²·sr⁻¹, towards the shading point.
    pub radiance: Vec3,
    /// From outside of the scene: shadow rays have no end, and the air absorbs nothing on the way.
    pub is_far: bool,
}

impl Light {
    #[inline]
    pub fn sample(
        &self,
        textures: &[Texture],
        techniques: &Techniques,
        position: Vec3,
        u: Vec2,
        pmf: f32,
    ) -> Option<LightSample> {
        if let Some(source) = self.shape.delta() {
            return self.delta_sample(&source, position, pmf);
        }
        self.shape.sample(position, techniques.solid_angle, u).map(|point| self.shining(textures, &point, pmf))
    }

    /// What the point with this normal and these surface coordinates sends out, W·m⁻²·sr⁻¹.
    #[inline]
    pub fn radiance(&self, textures: &[Texture], normal: Vec3, uv: Vec2) -> Vec3 {
        let radiance = match self.emission.radiance {
            ColorInput::Constant(radiance) => radiance,
            ColorInput::Texture(texture) => {
                let uv = match (&self.shape, &self.turned) {
                    (LightShape::Sphere { .. }, Some(turn)) => sphere_uv(*turn * normal),
                    (LightShape::Sphere { .. }, None) => sphere_uv(normal),
                    _ => match self.corner_uvs {
                        Some([a, b, c]) => a + uv.x * (b - a) + uv.y * (c - a),
                        None => uv,
                    },
                };
                textures[texture as usize].eval(uv)
            }
        };
        self.emission.scale * radiance
    }

    #[inline]
    pub fn shining(&self, textures: &[Texture], point: &LightPoint, pmf: f32) -> LightSample {
        let radiance = self.radiance(textures, point.normal, point.uv);
        LightSample { target: point.target, wi: point.wi, pdf: pmf * point.pdf, radiance, is_far: false }
    }

    /// Of a light without size, whose emission is its intensity or its irradiance.
    fn delta_sample(&self, source: &DeltaSource<f32>, position: Vec3, pmf: f32) -> Option<LightSample> {
        let DeltaSample { found, target, wi, scale } = source.seen_from(true, position.into());
        let radiance = self.strength() * scale;
        let (pdf, is_far) = (pmf * SHARPNESS, source.is_far);
        found.then(|| LightSample { target: target.into(), wi: wi.into(), pdf, radiance, is_far })
    }

    /// Of a light without size: radiant intensity on the axis, W·sr⁻¹, or irradiance, W·m⁻².
    pub fn strength(&self) -> Vec3 {
        match self.emission.radiance {
            ColorInput::Constant(strength) => strength,
            ColorInput::Texture(_) => Vec3::ZERO,
        }
    }

    /// A light without size.
    ///
    /// - `reach`: radius of the scene, metres.
    pub fn without_size(light: &DeltaLight, reach: f32) -> Self {
        let shape = match *light {
            DeltaLight::Point { position, .. } => LightShape::Point { position, cone: None },
            DeltaLight::Spot { position, cone, .. } => LightShape::Point { position, cone: Some(cone) },
            DeltaLight::Directional { direction, .. } => LightShape::Directional { to_light: -direction, reach },
        };
        let strength = light.strength();
        let emission = Emission { radiance: ColorInput::Constant(strength), scale: 1.0, two_sided: false };
        let mean_radiance = luminance(strength);
        Self { shape, emission, mean_radiance, is_point: true, turned: None, corner_uvs: None }
    }
}
