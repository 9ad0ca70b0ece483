//! A light, and its samples from a point.

use crate::core::color::luminance;
use crate::core::delta_light::{DeltaLight, LightImage, Origin};
use crate::core::material::{ColorInput, ScalarInput};
use crate::core::material_queries::Emission;
use crate::core::techniques::Techniques;
use crate::core::texture::{Texture, TexturePoint};
use crate::prepare::light::delta::{DeltaSample, DeltaSource, SHARPNESS};
use crate::prepare::light::mean_light::MeanLight;
use crate::prepare::light::shape::{LightPoint, LightShape, sphere_uv};
use glam::{Mat3, Vec2, Vec3, Vec4};

/// An emitter: a sphere, a quad, a triangle, or a delta light.
#[derive(Clone, Debug)]
pub(crate) struct Light {
    pub shape: LightShape,
    pub emission: Emission,
    /// Luminance of the radiance, mean over the surface.
    pub mean_radiance: f32,
    /// Whether it is a delta light, or represents one, see [`crate::core::snapshot::Object::is_point_light`].
    pub is_point: bool,
    /// See [`crate::core::snapshot::Object::turned`].
    pub turned: Option<Mat3>,
    /// Texture coordinates at the vertices of a triangle, if its emission is textured; for a quad at the corner and at
    /// the ends of its edges, if they differ from its surface coordinates.
    pub corners: Option<Box<[TexturePoint; 3]>>,
    /// The image that a delta light projects.
    pub image: Option<Box<LightImage>>,
}

/// A point on a light seen from a shading point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightSample {
    /// End of a shadow ray: on the light, offset from its front by the error bound.
    pub target: Vec3,
    /// Unit, towards the light.
    pub wi: Vec3,
    /// Pdf per steradian at the shading point, including the choice of the light.
    pub pdf: f32,
    /// Radiance towards the shading point, W·m⁻²·sr⁻¹.
    pub radiance: Vec3,
    /// Whether it is outside of the scene: shadow rays are infinite, and the air absorbs nothing.
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
            return self.delta_sample(textures, &source, position, pmf);
        }
        self.shape.sample(position, techniques.solid_angle, u).map(|point| self.shining(textures, &point, pmf))
    }

    /// Emitted radiance, if it is the same everywhere on the surface and in all directions.
    pub fn even_radiance(&self) -> Option<Vec3> {
        self.emission.even_radiance().filter(|_| self.image.is_none())
    }

    /// Emitted radiance at the point with this normal and these surface coordinates, W·m⁻²·sr⁻¹. Of a delta light the
    /// strength in the direction `normal`, without its cone.
    #[inline]
    pub fn radiance(&self, textures: &[Texture], normal: Vec3, uv: Vec2) -> Vec3 {
        let point = || match (&self.shape, &self.turned) {
            (LightShape::Sphere { .. }, Some(turn)) => sphere_uv(*turn * normal).into(),
            (LightShape::Sphere { .. }, None) => sphere_uv(normal).into(),
            _ => match self.corners.as_deref() {
                Some(corners) => TexturePoint::between(corners, uv),
                None => uv.into(),
            },
        };
        if let Some(image) = &self.image {
            return self.projected(image, textures, normal);
        }
        let radiance = match self.emission.radiance {
            ColorInput::Constant(radiance) => radiance,
            ColorInput::Texture(texture) => {
                textures[texture as usize].eval(TexturePoint { color: Vec4::ONE, ..point() })
            }
        };
        let there = match self.emission.opacity {
            (ScalarInput::Constant(opacity), None) => opacity.clamp(0.0, 1.0),
            (opacity, cutoff) => {
                let opacity = match opacity {
                    ScalarInput::Constant(opacity) => opacity,
                    ScalarInput::Texture(texture) => textures[texture as usize].eval(point()).x,
                };
                cutoff.map_or(opacity.clamp(0.0, 1.0), |cutoff| f32::from(opacity >= cutoff))
            }
        };
        self.emission.scale * there * radiance
    }

    #[inline]
    pub fn shining(&self, textures: &[Texture], point: &LightPoint, pmf: f32) -> LightSample {
        let radiance = self.radiance(textures, point.normal, point.uv);
        LightSample { target: point.target, wi: point.wi, pdf: pmf * point.pdf, radiance, is_far: false }
    }

    /// Samples a delta light, whose emission is its intensity or its irradiance.
    fn delta_sample(
        &self,
        textures: &[Texture],
        source: &DeltaSource<f32>,
        position: Vec3,
        pmf: f32,
    ) -> Option<LightSample> {
        let DeltaSample { found, target, wi, scale } = source.seen_from(true, position.into());
        let radiance = scale * self.radiance(textures, -Vec3::from(wi), Vec2::ZERO);
        let (pdf, is_far) = (pmf * SHARPNESS, source.is_far);
        found.then(|| LightSample { target: target.into(), wi: wi.into(), pdf, radiance, is_far })
    }

    /// Intensity of a delta light with an image in a unit direction, W·sr⁻¹, without its cone.
    fn projected(&self, image: &LightImage, textures: &[Texture], dir: Vec3) -> Vec3 {
        let Some((uv, factor)) = image.at(dir) else { return Vec3::ZERO };
        let color = image.texture.map_or(Vec3::ONE, |texture| textures[texture as usize].eval(uv));
        factor * self.strength() * color
    }

    /// Strength of a delta light: radiant intensity on the axis, W·sr⁻¹, or irradiance, W·m⁻².
    fn strength(&self) -> Vec3 {
        match self.emission.radiance {
            ColorInput::Constant(strength) => strength,
            ColorInput::Texture(_) => Vec3::ZERO,
        }
    }

    /// Creates a delta light.
    ///
    /// - `reach`: radius of the scene, metres.
    pub(super) fn without_size(light: &DeltaLight, reach: f32, means: &mut MeanLight) -> Self {
        let shape = match light.origin() {
            Origin::At(position, cone) => LightShape::Point { position, cone },
            Origin::Far(direction) => LightShape::Directional { to_light: -direction, reach },
        };
        let strength = light.strength();
        let emission = Emission::even(strength);
        let image = light.image();
        let mean = image.and_then(|image| image.texture).map_or(1.0, |texture| means.of(texture, None));
        let mean_radiance = mean * luminance(strength);
        Self { shape, emission, mean_radiance, is_point: true, turned: None, corners: None, image: image.map(Box::new) }
    }
}
