//! Builds a scene in code: `cargo run --release --example build_scene -- out.png`.
//!
//! A scene is an ECS world. Objects name the entities of their materials, so one material serves many objects.

use firstlight::prelude::*;
use std::sync::Arc;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let output = std::env::args().nth(1).unwrap_or_else(|| "build_scene.png".to_owned());
    let mut scene = Scene::new();
    let world = scene.world_mut();

    let mut material = |material: Material| world.spawn(SurfaceMaterial(material)).id();
    let gray = material(Material::diffuse(Vec3::splat(0.6)));
    let glass = material(Material::glass(1.5));
    let light = material(Material::emissive(Vec3::splat(12.0)));

    world.spawn((Shape::Plane { normal: DVec3::Y }, MaterialSlots(vec![gray])));
    for i in 0..5 {
        let at = DVec3::new(f64::from(i) - 2.0, 0.4, 0.0);
        let material = if i % 2 == 0 { glass } else { gray };
        world.spawn((Shape::Sphere { radius: 0.4 }, Placement::at(at), MaterialSlots(vec![material])));
    }
    // A mesh of one's own: positions, and the corners of each face counter-clockwise as seen from outside.
    let corners = [(-0.4, 0.0, -0.4), (-0.4, 0.0, 0.4), (0.4, 0.0, 0.4), (0.4, 0.0, -0.4), (0.0, 0.7, 0.0)];
    let faces = vec![[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [0, 2, 1], [0, 3, 2]];
    let pyramid = Shape::Mesh(Arc::new(Mesh::from_f64(&corners.map(DVec3::from), faces)?));
    world.spawn((pyramid, Placement::at(DVec3::new(0.0, 0.0, 1.2)), MaterialSlots(vec![gray])));

    let panel = Shape::Quad { edge_u: DVec3::X * 2.0, edge_v: DVec3::Z * 2.0 };
    world.spawn((panel, Placement::at(DVec3::new(-1.0, 3.0, -1.0)), MaterialSlots(vec![light])));

    let view = View::look_at(DVec3::new(0.0, 1.6, 5.0), DVec3::new(0.0, 0.3, 0.0), DVec3::Y)?;
    world.spawn((view, Projection::default(), Lens::thin(0.05, view.pivot_distance)));

    scene.render(&RenderOptions::default().size(640, 360).spp(64))?.save(&output)?;
    // The same world as a scene file.
    std::fs::write(std::path::Path::new(&output).with_extension("ron"), scene.to_ron())?;
    Ok(())
}
