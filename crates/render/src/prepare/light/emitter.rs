//! One light, and what it sends from a point.

use crate::core::material::{ColorInput, Emission};
use crate::core::techniques::Techniques;
use crate::core::texture::Texture;
use crate::prepare::light::shape::{LightPoint, LightShape, sphere_uv};
use glam::{Mat3, Vec2, Vec3};

/// One emitter: a sphere, a quad or a triangle.
#[derive(Clone, Debug)]
pub(crate) struct Light {
    pub shape: LightShape,
    pub emission: Emission,
    /// Mean over the surface, luminance.
    pub mean_radiance: f32,
    /// Stands for a point light, see [`crate::core::snapshot::Object::is_point_light`].
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
        LightSample { target: point.target, wi: point.wi, pdf: pmf * point.pdf, radiance }
    }
}
