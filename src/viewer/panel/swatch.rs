//! The colours that represent a material in a list.

use crate::scene::{ColorParam, Material, SurfaceMaterial, TextureSource};
use bevy_ecs::prelude::{Entity, World};
use egui::{Color32, Sense, Stroke, Ui, vec2};
use glam::Vec3;

/// Blends nested deeper than this are not followed.
const MAX_NESTING: usize = 4;

/// Draws one colour, or two for a blend or a checker.
///
/// - `side`: width and height, points.
pub fn swatch(ui: &mut Ui, world: &World, material: Entity, side: f32) {
    let [a, b] = colors(world, material, 0);
    let (rect, _) = ui.allocate_exact_size(vec2(side, side), Sense::hover());
    let painter = ui.painter();
    painter.rect_filled(rect, 2.0, srgb(a));
    if a != b {
        let half = vec![rect.right_top(), rect.right_bottom(), rect.left_bottom()];
        painter.add(egui::Shape::convex_polygon(half, srgb(b), Stroke::NONE));
    }
    painter.rect_stroke(rect, 2.0, (1.0, Color32::from_gray(90)), egui::StrokeKind::Inside);
}

fn colors(world: &World, entity: Entity, nesting: usize) -> [Vec3; 2] {
    let Some(material) = SurfaceMaterial::of(world, entity) else { return [Vec3::splat(0.5); 2] };
    match material {
        Material::Blend { a, b, .. } if nesting < MAX_NESTING => {
            [colors(world, *a, nesting + 1)[0], colors(world, *b, nesting + 1)[0]]
        }
        // Transmittance over a metre.
        Material::Glass { absorption, .. } | Material::RoughGlass { absorption, .. } => {
            [Vec3::new(0.75, 0.88, 0.92) * (-*absorption).exp(); 2]
        }
        // Gold, and others by their hue at normal incidence.
        Material::Conductor { eta, k, .. } => {
            let [less, more] = [*eta - 1.0, *eta + 1.0];
            [(less * less + *k * *k) / (more * more + *k * *k); 2]
        }
        Material::ThinGlass { transmittance: ColorParam::Rgb(rgb), .. } => [*rgb * Vec3::new(0.85, 0.92, 0.95); 2],
        material => match material.color() {
            // For an emitter, the hue.
            Some(ColorParam::Rgb(rgb)) => [*rgb / rgb.max_element().max(1.0); 2],
            Some(ColorParam::Texture(texture)) => match &texture.part {
                TextureSource::Checker { a, b, .. } => [a.0, b.0],
                TextureSource::Image { .. } | TextureSource::VertexColors { .. } => {
                    [Vec3::splat(0.75), Vec3::splat(0.1)]
                }
            },
            None => [Vec3::splat(0.5); 2],
        },
    }
}

fn srgb(linear: Vec3) -> Color32 {
    let [r, g, b] = linear.clamp(Vec3::ZERO, Vec3::ONE).to_array();
    egui::Rgba::from_rgb(r, g, b).into()
}
